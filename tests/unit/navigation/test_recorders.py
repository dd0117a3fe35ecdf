"""Recorders: what is kept of a run, and how much memory it takes."""

from itertools import pairwise

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import ConfigError, DataError
from strapdown.estimation.covariance import COVARIANCES, Innovations
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.sensor_blocks import accel_bias, gyro_bias
from strapdown.mechanization import MECHANIZATIONS
from strapdown.nav_state import NavState
from strapdown.navigation.navigator import Navigator
from strapdown.navigation.record import (
    CovarianceSnapshots,
    Event,
    InnovationColumns,
    InnovationRecords,
    NavigationChunk,
    Span,
)
from strapdown.navigation.recorder import FullRecorder, IntervalRecorder

MODEL = RotationVectorModel((1e-6,) * 3, (1e-4,) * 3, (gyro_bias(1e-7), accel_bias(2e-4)))
NAVIGATOR = Navigator(ErrorFilter(MECHANIZATIONS["ned"](), MODEL, COVARIANCES["ud"]()))


def run(rate=100.0, length=3.0, begin=7.003):
    """A piece of a body at rest with a mark and an observation at every fifth of a second."""
    used = NAVIGATOR.filter.mechanization
    row = used.history_row(used.begin(NavState.from_degrees(10.0, 20.0, 30.0)))
    time = begin + np.arange(round(length * rate)) / rate
    history = np.tile(row, (len(time), 1))
    history[:, 2] += np.arange(len(time))
    at = time[::20]
    m, one = len(at), at[:, None]
    marks = CovarianceSnapshots(at, np.eye(9) * at[:, None, None], np.tile(one, 6), np.ones((m, 6)))
    told = Innovations(one, 2.0 * np.ones((m, 1)), np.ones((m, 1)))
    seen = InnovationRecords((InnovationColumns("baro.height", ("up, m",), at, told),))
    return NavigationChunk(time, history, seen, marks)


def kept(recorder, pieces, **more):
    tape = recorder.begin(NAVIGATOR)
    for piece in pieces:
        tape.take(piece)
    return tape.record("run.csv", **more)


def cut(piece, edges):
    bounds = [-np.inf, *edges, np.inf]
    out = []
    for a, b in pairwise(bounds):
        at = (piece.time >= a) & (piece.time < b)
        part = slice(*piece.marks.time.searchsorted([a, b]).tolist())
        (of,) = piece.seen.parts
        told = Innovations(*(getattr(of.innovations, n)[part] for n in ("nu", "s", "weight")))
        seen = InnovationRecords((of._replace(time=of.time[part], innovations=told),))
        out.append(NavigationChunk(piece.time[at], piece.history[at], seen, piece.marks[part]))
    return out


def test_full_keeps_every_sample():
    piece = run()
    record = kept(FullRecorder(), [piece])
    np.testing.assert_array_equal(record.trajectory.index, piece.time)
    np.testing.assert_array_equal(record.trajectory["alt"], piece.history[:, 2])
    assert len(record.sd) == len(piece.marks)
    np.testing.assert_array_equal(record.covariance[3], piece.marks[3].covariance)
    assert record.units["gyro_bias_x"] == "rad/s"
    table = record.innovations["baro.height"]
    assert list(table.columns) == ["nu up, m", "s up, m", "weight up, m"]
    np.testing.assert_array_equal(table["nu up, m"], table.index)


def test_an_interval_keeps_its_first_sample_and_all_innovations():
    piece = run()
    record = kept(IntervalRecorder(2.0), [piece])
    # The grid is that of time zero: 7.0, 7.5, 8.0 ...; stamps are 3 ms off it.
    np.testing.assert_allclose(
        record.trajectory.index, [7.003, 7.503, 8.003, 8.503, 9.003, 9.503], atol=1e-9
    )
    assert len(record.innovations["baro.height"]) == len(piece.seen)
    # Marks at the same rate, and the last one of all.
    np.testing.assert_allclose(
        record.sd.index, [7.003, 7.603, 8.003, 8.603, 9.003, 9.603, 9.803], atol=1e-9
    )


@pytest.mark.parametrize("recorder", [FullRecorder(), IntervalRecorder(3.0)])
def test_cut_anywhere_as_the_whole(recorder):
    piece = run()
    whole = kept(recorder, [piece])
    for edges in ([8.0], [7.2, 7.2001, 9.0], list(piece.time)):
        parts = kept(recorder, cut(piece, edges))
        for name in ("trajectory", "sd", "sensors", "sensors_sd"):
            assert getattr(parts, name).equals(getattr(whole, name)), name
        np.testing.assert_array_equal(parts.covariance, whole.covariance)


def test_events_and_spans_are_handed_on():
    events, modes = (Event(8.0, "gap", "none"),), (Span("navigation", 7.0, 10.0),)
    record = kept(FullRecorder(), [run()], events=events, modes=modes, outages={"rtk": modes})
    assert record.events == events and record.modes == modes and record.outages["rtk"] == modes


def test_a_mark_that_is_told_again_is_the_later_one():
    none, row = InnovationRecords(), np.ones((1, 6))
    mark = CovarianceSnapshots(np.array([7.1]), np.eye(9)[None], 0.0 * row, row)
    again = CovarianceSnapshots(np.array([7.1]), 2.0 * np.eye(9)[None], row, row)
    piece = run(length=0.2)
    pieces = [
        NavigationChunk(piece.time[:10], piece.history[:10], none, mark),
        NavigationChunk(piece.time[10:], piece.history[10:], none, again),
    ]
    for recorder in (FullRecorder(), IntervalRecorder(1.0)):
        record = kept(recorder, pieces)
        assert len(record.sd) == 1
        np.testing.assert_array_equal(record.covariance[0], 2.0 * np.eye(9))


def test_a_mark_before_an_epoch_is_kept_with_it():
    """As at the end of an outage, also where the two are on either side of an interval's edge."""
    at = np.array([7.0, 7.6, 7.9999985, 7.9999995, 8.5])
    shown = np.ones((5, 6))
    marks = CovarianceSnapshots(at, np.tile(np.eye(9), (5, 1, 1)), shown, shown)
    piece = run(length=2.0, begin=7.0)
    whole = NavigationChunk(piece.time, piece.history, InnovationRecords(), marks)
    record = kept(IntervalRecorder(1.0), [whole])
    assert record.sd.index.tolist() == [7.0, 7.9999985, 7.9999995, 8.5]


def test_memory_grows_with_the_rate_of_the_recorder():
    tape = IntervalRecorder(10.0).begin(NAVIGATOR)
    for k in range(200):
        tape.take(run(rate=1000.0, length=1.0, begin=float(k)))
    row = NAVIGATOR.filter.mechanization.row + 1
    # Ten a second; what they grow into is at most half as much again, and once the first room.
    assert tape._states.room.buffer.size <= 1.5 * 10 * 200 * row + 64 * row


def test_no_step_and_no_rate_are_refused():
    with pytest.raises(DataError, check=coded("navigation.no-step", file="run.csv")):
        kept(FullRecorder(), [])
    for rate in (0.0, np.inf, "fast"):
        with pytest.raises(
            ConfigError, check=coded("navigation.recorder-rate-not-positive", quantity="rate_hz")
        ):
            IntervalRecorder(rate)
