"""A navigator's run smoothed: against the truth, against other forms, cut anywhere, from disk."""

from __future__ import annotations

import errno
import io
from dataclasses import replace

import numpy as np
import pytest
from tests.aided_drives import begin, drive, gnss_of, increments_of, navigator_of, truth_at
from tests.coded import coded

from strapdown.errors import ConfigError
from strapdown.estimation.error_model import QuaternionModel
from strapdown.mechanization import NorthEastDown
from strapdown.mechanization.mechanization import state_error
from strapdown.nav_state import NavState
from strapdown.navigation import engine as node_rows
from strapdown.navigation import smoother as smoothing_tape
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.vehicle import NoSlip
from strapdown.navigation.recorder import FullRecorder, IntervalRecorder
from strapdown.navigation.smoother import RauchTungStriebel
from strapdown.rotation import dcm_from_quaternion

OUTAGE = (50.0, 80.0)


def smoothing(navigator):
    return replace(navigator, smoother=RauchTungStriebel())


def both(navigator, seed=1, tables=None, pieces=1, recorder=None, tilt_sd=0.0):
    """Records of a drive with an outage, forward and smoothed; of a start so tilted, rad."""
    motion = drive()
    time, rows = increments_of(motion, seed)
    # From one start, whatever the level axes.
    drawn = begin(navigator_of(gnss()), motion, seed, time[0] - rows[0, 0])
    start = NorthEastDown().nav_state(drawn.engine.mechanization, drawn.time)
    P = drawn.engine.filter.covariance.copy()
    # Level with what the accelerometers read too much: each tilt has the bias that hides it.
    tilt = np.zeros((len(P), 2))
    tilt[6:8] = np.eye(2)
    tilt[12:15] = dcm_from_quaternion(start.q_nb)[:2].T @ [[0.0, 9.8], [-9.8, 0.0]]
    P += tilt_sd**2 * tilt @ tilt.T
    state = navigator.begin(start, P)
    state = navigator.begin(start, P)
    told = tables if tables is not None else {"gnss": gnss_of(motion, seed, *OUTAGE)}
    for name, table in told.items():
        state = navigator.tell(state, name, table[table.index > state.time])
    tape = (recorder or FullRecorder()).begin(navigator)
    later = navigator.smoother.begin(navigator)
    for cut in np.array_split(np.arange(len(time)), pieces):
        state, piece = navigator.advance(state, time[cut], rows[cut])
        tape.take(piece)
        later.take(piece)
    piece = navigator.finish(state)
    tape.take(piece)
    later.take(piece)
    return tape.record(), tape.record(smoothing=later)


def gnss(**more):
    return (Gnss(name="gnss", **more),)


def errors_of(record, times):
    """Physical errors at samples, in the standard deviations that are told of them, and alone."""
    e, z = [], []
    marks, rows = record.sd.index.to_numpy(), record.trajectory.index.to_numpy()
    for at in times:
        row = int(np.searchsorted(rows, at - 1e-6))
        mark = int(np.searchsorted(marks, rows[row] - 1e-6))
        state = NavState.from_trajectory(record.trajectory.iloc[[row]])
        error = state_error(state, truth_at(drive(), rows[row]))
        e.append(error)
        z.append(error / np.sqrt(np.diagonal(record.covariance[mark])))
    return np.array(e), np.array(z)


def test_an_outage_is_known_from_both_of_its_sides():
    forward, smoothed = both(smoothing(navigator_of(gnss())))
    inside = np.arange(60.0, 80.0, 2.0)
    before, _ = errors_of(forward, inside)
    after, z = errors_of(smoothed, inside)
    # What is known of its middle is a mean of what comes from either side: over half of the time
    # errors of tilt and bias, which grow with its square, are a quarter, and at its end nothing.
    size = np.sqrt(np.mean(np.square(after[:, :2]))) / np.sqrt(np.mean(np.square(before[:, :2])))
    assert size < 0.5
    # Within five of their standard deviations: nine numbers, at instants that are not independent.
    assert np.abs(z).max() < 5.0
    assert np.sqrt(np.mean(np.square(z))) > 0.2


def test_at_the_end_nothing_is_added_and_nowhere_is_less_known():
    forward, smoothed = both(smoothing(navigator_of(gnss())))
    last = forward.trajectory.iloc[-1] - smoothed.trajectory.iloc[-1]
    # Rounding of a quaternion and of degrees.
    np.testing.assert_allclose(last, 0.0, atol=1e-10)
    np.testing.assert_allclose(smoothed.sd.iloc[-1], forward.sd.iloc[-1], rtol=1e-9)
    # One covariance takes nothing off another but for rounding.
    assert (smoothed.sd.to_numpy() <= forward.sd.to_numpy() * (1.0 + 1e-7)).all()
    assert (smoothed.sensors_sd.to_numpy() <= forward.sensors_sd.to_numpy() * (1.0 + 1e-7)).all()
    # What does not change is known alike at all times: a bias.
    for column in ("gyro_bias_x", "accel_bias_z"):
        known = smoothed.sensors[column].to_numpy()
        np.testing.assert_allclose(
            known, known[-1], rtol=0.0, atol=1e-7 * forward.sensors_sd[column].iloc[0]
        )


def test_innovations_are_the_filters():
    forward, smoothed = both(smoothing(navigator_of(gnss())))
    for name, table in forward.innovations.items():
        np.testing.assert_array_equal(table.to_numpy(), smoothed.innovations[name].to_numpy())


def test_the_filter_goes_on_as_without_a_smoother():
    made = navigator_of(gnss())
    forward, _ = both(smoothing(made))
    tape = FullRecorder().begin(made)
    motion = drive()
    time, rows = increments_of(motion, 1)
    state = begin(made, motion, 1, time[0] - rows[0, 0])
    table = gnss_of(motion, 1, *OUTAGE)
    state = made.tell(state, "gnss", table[table.index > state.time])
    state, piece = made.advance(state, time, rows)
    tape.take(piece)
    tape.take(made.finish(state))
    alone = tape.record()
    np.testing.assert_array_equal(alone.trajectory.to_numpy(), forward.trajectory.to_numpy())
    np.testing.assert_array_equal(alone.covariance, forward.covariance)
    np.testing.assert_array_equal(alone.sensors.to_numpy(), forward.sensors.to_numpy())


@pytest.mark.parametrize("form", ["plain", "ud", "wd"])
def test_forms_of_the_covariance(form):
    assert_alike(navigator_of(gnss()), navigator_of(gnss(), form=form), 1e-5)


def test_a_wander_azimuth():
    # They differ by the order of their integration.
    assert_alike(navigator_of(gnss()), navigator_of(gnss(), "wander_azimuth"), 0.02)


@pytest.mark.parametrize("mechanization", ["ned", "wander_azimuth"])
@pytest.mark.parametrize("form", ["joseph", "ud", "wd"])
def test_any_modules_as_the_compiled_ones(mechanization, form):
    made = navigator_of(gnss(), mechanization, form)

    class Own(type(made.filter.model)):
        """Its numbers, and no compiled loop."""

    model = made.filter.model
    own = Own(model.gyro_noise, model.accel_noise, model.sensors)
    # Of a fix with a velocity one takes place and velocity one after the other, and one together.
    table = gnss_of(drive(), 1, *OUTAGE)
    table[["VN_sd", "VE_sd", "VD_sd"]] = np.inf
    other = replace(made, filter=replace(made.filter, model=own))
    assert_alike(made, other, 1e-5, tables={"gnss": table})


def assert_alike(one, other, share, **told):
    """Smoothed by either, apart by no more than a share of what is known."""
    assert_near(both(smoothing(one), **told)[1], both(smoothing(other), **told)[1], share)


def assert_near(a, b, share):
    apart = (a.trajectory - b.trajectory).to_numpy()
    sd = a.sd.to_numpy().mean(axis=0)
    scale = np.r_[np.degrees(sd[0] / 6.4e6), np.degrees(sd[1] / 4.3e6), sd[2:]]
    assert np.abs(apart / scale).max() < share
    np.testing.assert_allclose(b.sd.to_numpy(), a.sd.to_numpy(), rtol=share)


def test_quaternions_have_no_height_and_the_rest_is_smoothed():
    made = navigator_of(gnss(), "wander_azimuth")
    model = made.filter.model
    quaternions = QuaternionModel(model.gyro_noise, model.accel_noise, model.sensors)
    held = replace(made, filter=replace(made.filter, model=quaternions))
    table = gnss_of(drive(), 1, *OUTAGE)
    table["down_sd"] = 1e6
    _, a = both(smoothing(held), tables={"gnss": table})
    _, b = both(smoothing(made), tables={"gnss": table})
    columns = ["VN", "VE", "heading"]
    apart = (a.trajectory[columns] - b.trajectory[columns]).to_numpy()
    # One has a state of the height, and the other has not: of the level they tell the same.
    assert np.abs(apart / b.sd[columns].to_numpy().mean(axis=0)).max() < 0.5
    assert a.not_estimated == ("down",)
    assert b.not_estimated == ()
    assert np.isfinite(a.sd.drop(columns="down").to_numpy()).all()


@pytest.mark.parametrize("pieces", [2, 17])
def test_a_run_cut_anywhere_is_smoothed_to_the_same_numbers(pieces):
    made = smoothing(navigator_of((*gnss(lever_arm=(1.0, 0.2, -0.5)), NoSlip(name="tires"))))
    _, whole = both(made)
    _, cut = both(made, pieces=pieces)
    np.testing.assert_array_equal(cut.trajectory.to_numpy(), whole.trajectory.to_numpy())
    np.testing.assert_array_equal(cut.covariance, whole.covariance)
    np.testing.assert_array_equal(cut.sensors.to_numpy(), whole.sensors.to_numpy())


@pytest.mark.parametrize("mechanization", ["ned", "wander_azimuth"])
def test_where_a_large_tilt_was_corrected_less_is_known_of_what_it_told(mechanization, monkeypatch):
    made = smoothing(navigator_of(gnss(), mechanization=mechanization))
    tilt = np.radians(3.0)
    forward, smoothed = both(made, tilt_sd=tilt)
    _, cut = both(made, tilt_sd=tilt, pieces=5)
    np.testing.assert_array_equal(cut.covariance, smoothed.covariance)
    # A filter's last epoch is the smoother's, and nowhere does the smoother know less.
    np.testing.assert_allclose(
        smoothed.covariance[-1], forward.covariance[-1], rtol=1e-12, atol=1e-15
    )
    sd = [np.sqrt(np.diagonal(r.covariance, axis1=1, axis2=2)) for r in (forward, smoothed)]
    assert (sd[1] <= sd[0] * (1.0 + 1e-9)).all()
    monkeypatch.setattr("strapdown.navigation.navigator.unlearnt_force", lambda *_: None)
    linear, _ = both(made, tilt_sd=tilt)
    # Vertical velocity after the first turns: 3 deg of tilt are 0.5 g 0.05**2 = 13 mm/s², which
    # are as much as the accelerometers' bias is known to by then.
    at = int(np.searchsorted(forward.sd.index, 40.0))
    wider = forward.covariance[at, 5, 5] / linear.covariance[at, 5, 5]
    assert wider > 1.01
    assert forward.covariance[0] == pytest.approx(linear.covariance[0])
    # Before them, with the bias that hides a tilt in axes that corrections turn, it seems known.
    monkeypatch.setattr("strapdown.navigation.navigator.turned_force", lambda *_: None)
    fixed, _ = both(made, tilt_sd=tilt)
    before = int(np.searchsorted(forward.sd.index, 25.0))
    assert forward.covariance[before, 6, 6] > 2.0 * fixed.covariance[before, 6, 6]


@pytest.mark.parametrize("aids", [gnss(), (*gnss(), NoSlip(name="tires"))])
def test_rows_that_are_full_at_every_turn_change_nothing(monkeypatch, aids):
    made = smoothing(navigator_of(aids))
    forward, smoothed = both(made)
    # A growth and an update at one instant need two; a compiled loop then stops at every second.
    monkeypatch.setattr(node_rows, "BLOCK", 2)
    forward_again, smoothed_again = both(made)
    for one, other in ((forward, forward_again), (smoothed, smoothed_again)):
        np.testing.assert_array_equal(one.trajectory.to_numpy(), other.trajectory.to_numpy())
        np.testing.assert_array_equal(one.covariance, other.covariance)


def test_from_disk_as_from_memory(monkeypatch):
    monkeypatch.setattr(smoothing_tape, "CHUNK", 64)
    made = smoothing(navigator_of(gnss()))
    _, here = both(made)
    # One chunk at a time, of some hundred kilobytes.
    small = replace(made, smoother=RauchTungStriebel(memory=1.0))
    monkeypatch.setattr(smoothing_tape.SmoothingTape, "_new_chunk", counted := spy())
    _, there = both(small)
    assert counted.most_in_memory < counted.made
    np.testing.assert_array_equal(there.trajectory.to_numpy(), here.trajectory.to_numpy())
    np.testing.assert_array_equal(there.covariance, here.covariance)


def spy():
    usual = smoothing_tape.SmoothingTape._new_chunk

    def new_chunk(tape):
        usual(tape)
        new_chunk.made += 1
        new_chunk.most_in_memory = max(new_chunk.most_in_memory, len(tape._chunks))

    new_chunk.made = new_chunk.most_in_memory = 0
    return new_chunk


def test_where_the_temporary_folder_has_no_room_it_is_said(monkeypatch):
    class Full(io.BytesIO):
        def write(self, data):
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(smoothing_tape.tempfile, "TemporaryFile", Full)
    monkeypatch.setattr(smoothing_tape, "CHUNK", 64)
    small = replace(navigator_of(gnss()), smoother=RauchTungStriebel(memory=1.0))
    with pytest.raises(
        ConfigError, check=coded("navigation.smoother-keeps-mb-memory-took")
    ) as refused:
        both(small)
    assert "TMPDIR" in str(refused.value)
    assert "memory_mb" in str(refused.value)


def test_without_any_aid_nothing_is_told():
    forward, smoothed = both(smoothing(navigator_of(())), tables={})
    # Rounding of a quaternion and of degrees, from which nothing is taken off.
    apart = (smoothed.trajectory - forward.trajectory).to_numpy()
    np.testing.assert_allclose(apart, 0.0, atol=1e-10)
    np.testing.assert_array_equal(smoothed.sensors.to_numpy(), forward.sensors.to_numpy())
    # The covariance is packed as the mean of its two halves.
    np.testing.assert_allclose(smoothed.sd.to_numpy(), forward.sd.to_numpy(), rtol=1e-12)


def test_a_recorder_of_one_sample_a_second_keeps_those_of_all():
    made = smoothing(navigator_of(gnss()))
    _, every = both(made)
    _, some = both(made, recorder=IntervalRecorder(rate_hz=1.0))
    assert len(some.trajectory) < 0.1 * len(every.trajectory)
    of = every.trajectory.loc[some.trajectory.index]
    np.testing.assert_array_equal(some.trajectory.to_numpy(), of.to_numpy())
    kept = np.isin(every.sd.index, some.sd.index)
    assert kept.mean() > 0.9
    np.testing.assert_array_equal(some.covariance, every.covariance[kept])


@pytest.mark.parametrize("memory", [0.0, float("nan"), "256", -1.0])
def test_a_memory_that_is_none(memory):
    with pytest.raises(ConfigError, match="memory"):
        RauchTungStriebel(memory)


def test_a_variance_that_rounding_made_negative_is_the_filter_s(monkeypatch):
    # A start that is all but unknown has variances some 1e10 times those of its smoothed state.
    navigator = smoothing(navigator_of(gnss()))
    forward, sound = both(navigator)
    whole = smoothing_tape.smooth_back
    struck = []

    def rounded(rows, n, told, less, wanted, estimates, covariances):
        whole(rows, n, told, less, wanted, estimates, covariances)
        if not struck and len(covariances):
            covariances[0, 4, 4] = -1e-3
            struck.append(True)

    monkeypatch.setattr(smoothing_tape, "smooth_back", rounded)
    _, smoothed = both(navigator)
    assert struck
    other = np.flatnonzero((smoothed.covariance != sound.covariance).any(axis=(1, 2)))
    assert 1 <= len(other) <= 2
    assert np.isfinite(smoothed.sd.to_numpy()).all()
    for k in other:
        assert smoothed.covariance[k] == pytest.approx(forward.covariance[k], rel=1e-6)
