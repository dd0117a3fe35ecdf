"""What every mechanization promises, held for every entry of the table."""

from __future__ import annotations

import itertools
import re
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parents[1]))

from exact_increments import exact_increments, start_of
from strapdown.errors import ConfigError, DataError, DivergenceError
from strapdown.increments import motion_increments
from strapdown.mechanization import (
    HEIGHTS,
    MECHANIZATIONS,
    NavTracker,
    NorthEastDown,
    navigate_segments,
    run_mechanization,
)
from strapdown.nav_state import NavState
from strapdown.simulation import Origin, SineVelocityMotion
from strapdown.tables import imu_table

NAMES = list(MECHANIZATIONS)
FLIGHT = SineVelocityMotion(
    60.0, Origin(-42.0, 179.999, 3000.0), (120.0, 90.0, -2.0), (30.0, 20.0, 5.0), 16.0
)
START = NavState.from_degrees(
    48.0, 179.9999, 120.0, v_n=[3.0, -20.0, 0.5], roll_deg=4.0, heading_deg=250.0, time=17.0
)


def shaken_log(sampling="instantaneous", samples=300):
    """Irregular in time, with bursts and pauses, and never twice about the same axis."""
    rng = np.random.default_rng(5)
    time = np.cumsum(rng.choice([0.001, 0.004, 0.01, 0.08], samples))
    force = rng.normal(0.0, 2.0, (samples, 3)) - [0.0, 0.0, 9.8]
    turn = rng.normal(0.0, 1.0, (samples, 3))
    return imu_table(17.0 + time - time[0], turn, force, sampling=sampling)


def flight(step=0.5):
    return exact_increments(FLIGHT, np.arange(0.0, FLIGHT.duration + 0.5 * step, step))


@pytest.mark.parametrize("height", HEIGHTS)
@pytest.mark.parametrize("name", NAMES)
def test_a_run_cut_anywhere_and_continued_gives_the_same_bits(name, height):
    mechanization, log = MECHANIZATIONS[name](height=height), motion_increments(shaken_log())
    rng = np.random.default_rng(1)
    heights = 120.0 + rng.normal(0.0, 5.0, len(log)) if height == "damped" else None
    if heights is not None:
        heights[::7] = np.nan
    begin = mechanization.begin(START)
    whole_state, whole = mechanization.advance(begin, log, heights)
    state, parts, at = begin, [], 0
    for length in (1, 1, 2, 57, 0, 100, 1, len(log)):
        part_heights = None if heights is None else heights[at : at + length]
        state, part = mechanization.advance(state, log.iloc[at : at + length], part_heights)
        parts.append(part)
        at += length
    assert np.array_equal(np.vstack(parts), whole)
    assert np.array_equal(state, whole_state)


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_advance_leaves_its_inputs_alone(name, backward):
    mechanization, log = MECHANIZATIONS[name](height="damped"), motion_increments(shaken_log())
    state, heights = mechanization.begin(START), np.full(len(log), 118.0)
    before = state.copy(), log.copy(), heights.copy()
    mechanization.advance(state, log, heights, backward=backward)
    assert np.array_equal(state, before[0])
    assert log.equals(before[1])
    assert np.array_equal(heights, before[2])


@pytest.mark.parametrize("name", NAMES)
def test_further_and_reordered_columns_change_nothing(name):
    mechanization, log = MECHANIZATIONS[name](), motion_increments(shaken_log())
    odd = log[log.columns[::-1]].assign(temperature=20.0)
    one = mechanization.advance(mechanization.begin(START), log)
    other = mechanization.advance(mechanization.begin(START), odd)
    assert np.array_equal(one[1], other[1])


@pytest.mark.parametrize("name", NAMES)
def test_a_start_comes_back_as_it_went_in(name):
    mechanization = MECHANIZATIONS[name]()
    back = mechanization.nav_state(mechanization.begin(START), START.time)
    assert (back.time, back.alt) == (START.time, START.alt)
    if name != "wander_azimuth":
        assert (back.lat, back.lon) == (START.lat, START.lon)
        assert np.array_equal(back.v_n, START.v_n)
        # Made unit again: a rounding of each component.
        assert np.abs(back.q_nb - START.q_nb).max() < 2.3e-16
        return
    # Through a quaternion and back, six roundings of 1.1e-16: of numbers up to pi, of 20 m/s that
    # are turned by what those leave of a wander angle, and of components under one.
    assert abs(back.lat - START.lat) < 7e-16
    assert abs(back.lon - START.lon) < 7e-16 * np.pi
    assert np.abs(back.v_n - START.v_n).max() < 7e-16 * np.pi * 20.0
    assert np.abs(back.q_nb - START.q_nb).max() < 7e-16 * np.pi


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_a_run_has_its_start_at_the_right_end(name, backward):
    log = motion_increments(shaken_log())
    last = float(log.index[-1])
    start = NavState(last, START.lat, START.lon, START.alt, START.v_n, START.q_nb)
    given = start if backward else START
    run = run_mechanization(MECHANIZATIONS[name](), given, log, backward=backward)
    assert len(run.trajectory) == len(log) + 1
    assert run.trajectory.index[0] == pytest.approx(17.0, abs=1e-12)
    assert run.trajectory.index[-1] == last
    rows = run.trajectory.to_numpy()
    here, there = (-1, 0) if backward else (0, -1)
    expected = given.to_trajectory().to_numpy()[0]
    assert np.allclose(rows[here], expected, rtol=0.0, atol=1e-12)
    assert np.allclose(rows[there], run.end.to_trajectory().to_numpy()[0], rtol=0.0, atol=1e-12)
    assert run.end.time == run.trajectory.index[there]


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_a_held_height_stays_to_the_last_bit(name, backward):
    log, time = motion_increments(shaken_log()), 17.0
    if backward:
        time = float(log.index[-1])
    start = NavState(time, START.lat, START.lon, 120.1, START.v_n, START.q_nb)
    run = run_mechanization(MECHANIZATIONS[name](height="held"), start, log, backward=backward)
    assert (run.trajectory["alt"] == 120.1).all()
    assert (run.trajectory["VD"] == 0.0).all()
    assert (run.trajectory["VN"] != START.v_n[0]).any()


@pytest.mark.parametrize("name", NAMES)
def test_a_damped_height_without_references_is_free_but_for_its_damping(name):
    """NaN is no reference: the loop rests."""
    log = motion_increments(shaken_log())
    free = run_mechanization(MECHANIZATIONS[name](), START, log)
    loop = MECHANIZATIONS[name](height="damped")
    rest = run_mechanization(loop, START, log, heights=np.full(len(log), np.nan))
    assert np.array_equal(free.history, rest.history)
    drawn = run_mechanization(loop, START, log, heights=np.full(len(log), 100.0))
    assert (drawn.trajectory["alt"].iloc[-1] - free.trajectory["alt"].iloc[-1]) < -0.1


@pytest.mark.parametrize(
    ("heights", "height", "message"),
    [
        (None, "damped", "needs reference heights"),
        (np.zeros(3), "damped", r"have the shape \(3,\)"),
        ([[1.0]], "damped", "have the shape"),
        (np.r_[1.0, -np.inf, np.zeros(297)], "damped", "row 2.*infinite"),
        (np.zeros(299), "free", "height is 'free'"),
        (np.zeros(299), "held", "height is 'held'"),
    ],
)
@pytest.mark.parametrize("name", NAMES)
def test_heights_that_do_not_fit_are_refused(name, heights, height, message):
    log = motion_increments(shaken_log())
    with pytest.raises(DataError, match=rf"heights.*{message}|{message}") as caught:
        run_mechanization(MECHANIZATIONS[name](height=height), START, log, heights=heights)
    assert caught.value.finding.quantity == "heights"
    assert caught.value.finding.remedy


@pytest.mark.parametrize(
    ("options", "quantity", "remedy"),
    [
        ({"ellipsoid": "wgs48"}, "ellipsoid", "did you mean 'wgs84'"),
        ({"height": "hold"}, "height", "did you mean 'held'"),
        ({"height_time_constant": 0.0}, "height_time_constant", "range"),
        ({"height_time_constant": float("nan")}, "height_time_constant", "range"),
        ({"latitude_limit_deg": 90.0}, "latitude_limit_deg", "range"),
        ({"latitude_limit_deg": -1.0}, "latitude_limit_deg", "range"),
        ({"largest_speed": 0.0}, "largest_speed", "range"),
        ({"largest_speed": float("inf")}, "largest_speed", "range"),
        ({"height_limits": (100.0, -100.0)}, "height_limits", "lowest"),
        ({"height_limits": (float("nan"), 1.0)}, "height_limits", "lowest"),
    ],
)
@pytest.mark.parametrize("name", NAMES)
def test_wrong_options_are_refused_with_a_remedy(name, options, quantity, remedy):
    with pytest.raises(ConfigError) as caught:
        MECHANIZATIONS[name](**options)
    assert caught.value.finding.quantity == quantity
    assert remedy in caught.value.finding.remedy


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize("column", ["phi_y", "dv_x", "dr_z"])
@pytest.mark.parametrize("name", NAMES)
def test_nan_does_not_get_in(name, column, backward):
    log = motion_increments(shaken_log()).copy()
    log.loc[log.index[41], column] = np.nan
    with pytest.raises(DataError, match=f"row 42.*{column}"):
        run_mechanization(MECHANIZATIONS[name](), START, log, backward=backward)


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize(
    ("column", "burst", "quantity"),
    [("dv_x", 2e4, "state"), ("dv_z", -1e300, "state"), ("dr_y", 1e308, "state")],
)
@pytest.mark.parametrize("name", NAMES)
def test_a_divergence_names_the_first_bad_sample(name, column, burst, quantity, backward):
    if name == "tadic" and column == "dr_y":
        pytest.skip("its position is by the trapezoid and takes no distance")
    log = motion_increments(shaken_log()).copy()
    log.attrs["source"] = "burst.csv"
    at = 41
    log.loc[log.index[at], column] = burst
    start = NavState(
        float(log.index[-1]) if backward else 17.0,
        START.lat,
        START.lon,
        120.0,
        START.v_n,
        START.q_nb,
    )
    with pytest.raises(DivergenceError) as caught:
        run_mechanization(MECHANIZATIONS[name](), start, log, backward=backward)
    finding = caught.value.finding
    assert (finding.file, finding.quantity) == ("burst.csv", quantity)
    assert f"(step {at + 1}" in finding.what
    assert f"sample at {log.index[at]:.9g} s" in finding.what
    assert f"{column} {burst:.4g}" in finding.what
    assert "deg of latitude" in finding.what
    assert "units" in finding.remedy


@pytest.mark.parametrize("name", NAMES)
def test_a_divergence_leaves_the_caller_with_the_state_it_had(name):
    mechanization, log = MECHANIZATIONS[name](largest_speed=60.0), flight()
    state = mechanization.begin(start_of(FLIGHT))
    kept = state.copy()
    with pytest.raises(
        DivergenceError,
        check=lambda refused: refused.finding.code == "mechanization.state-begin-high-outside-or",
    ):
        mechanization.advance(state, log)
    assert np.array_equal(state, kept)


@pytest.mark.parametrize("name", NAMES)
def test_height_limits_end_a_run(name):
    log = flight()
    with pytest.raises(DivergenceError) as caught:
        run_mechanization(MECHANIZATIONS[name](height_limits=(0.0, 3050.0)), start_of(FLIGHT), log)
    truth = FLIGHT.trajectory(log.index)["alt"].to_numpy()
    # Of a climb of 3 m a step: a step for the edge, two for the Coriolis force that tadic lacks,
    # 2 m/s after 30 s.
    late = 3 if name == "tadic" else 1
    step = int(re.search(r"\(step (\d+)", caught.value.finding.what)[1])
    assert abs(step - 1 - np.argmax(truth > 3050.0)) <= late


@pytest.mark.parametrize("name", NAMES)
def test_backward_of_forward_is_the_start(name):
    """Exactly the inverse it is not, so the bound is that of its error: see tests/analytic."""
    log, start = flight(0.05), start_of(FLIGHT)
    forward = run_mechanization(MECHANIZATIONS[name](), start, log)
    back = run_mechanization(MECHANIZATIONS[name](), forward.end, log, backward=True)
    # tadic: without Coriolis's force, 0.02 m/s² of it, for 60 s there and not back: what is left
    # out has the other sign for the opposite velocity, on an Earth that turns the other way.
    far, fast, turned = (200.0, 8.0, 0.5) if name == "tadic" else (1e-6, 1e-9, 1e-9)
    assert abs(back.end.lat - start.lat) * 6.4e6 < far
    assert abs(back.end.lon - start.lon) * 6.4e6 < far
    assert abs(back.end.alt - start.alt) < far
    assert np.abs(back.end.v_n - start.v_n).max() < fast
    assert np.degrees(np.abs(back.end.q_nb - start.q_nb).max()) < turned


# --- sample by sample -------------------------------------------------------------------


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
@pytest.mark.parametrize("height", HEIGHTS)
@pytest.mark.parametrize("name", [name for name in NAMES if name != "tadic"])
def test_sample_by_sample_gives_the_bits_of_the_batch(name, height, sampling):
    mechanization = MECHANIZATIONS[name](height=height, ellipsoid="pz90.11")
    log = shaken_log(sampling)
    rng = np.random.default_rng(2)
    heights = 120.0 + rng.normal(0.0, 5.0, len(log))
    heights[::3] = np.nan
    run = run_mechanization(
        mechanization,
        START,
        motion_increments(log),
        heights=heights[1:] if height == "damped" else None,
    )
    tracker = NavTracker(START, mechanization, sampling)
    for k, (time, row, wanted) in enumerate(zip(log.index, log.to_numpy(), heights, strict=True)):
        tracker.update(time, row[:3], row[3:], wanted if height == "damped" else np.nan)
        of_run = mechanization.nav_state(run.history[k], time)
        assert same_state(tracker.state, of_run)
    assert same_state(tracker.state, run.end)


def same_state(one, other):
    parts = ("time", "lat", "lon", "alt")
    return (
        all(getattr(one, part) == getattr(other, part) for part in parts)
        and np.array_equal(one.v_n, other.v_n)
        and np.array_equal(one.q_nb, other.q_nb)
    )


@pytest.mark.slow
def test_a_bad_sample_is_refused_and_changes_nothing():
    tracker, rate, force = NavTracker(START), [0.1, 0.2, 0.3], [0.0, 0.1, -9.8]
    tracker.update(17.0, rate, force)
    tracker.update(17.1, rate, force)
    before = tracker.state
    bad = [
        (17.1, rate, force, DataError, "time does not increase"),
        (16.0, rate, force, DataError, "time does not increase"),
        (np.nan, rate, force, DataError, "three finite rates"),
        (None, rate, force, DataError, "three finite rates"),
        (17.2, [np.nan, 0.2, 0.3], force, DataError, "three finite rates"),
        (17.2, rate, [np.inf, 0.2, 0.3], DataError, "three finite rates"),
        (17.2, rate, [0.0, -9.8], DataError, "three finite rates"),
        (17.2, rate, [0.0, 0.0, 0.0, -9.8], DataError, "three finite rates"),
        (17.2, np.ones((3, 1)), force, DataError, "three finite rates"),
        (17.2, ["a", "b", "c"], force, DataError, "three finite rates"),
        (17.2, None, force, DataError, "three finite rates"),
        (17.2, rate, [1e200, 0.0, 0.0], DataError, "three finite rates"),
        (17.2, rate, [4e5, 0.0, 0.0], DivergenceError, "would diverge"),
    ]
    for time, gyro, accel, kind, message in bad:
        with pytest.raises(kind, match=message) as caught:
            tracker.update(time, gyro, accel)
        assert caught.value.finding.row == 3
        assert caught.value.finding.remedy
        after = tracker.state
        for part in ("time", "lat", "lon", "alt"):
            assert getattr(after, part) == getattr(before, part)
        assert np.array_equal(after.v_n, before.v_n)
        assert np.array_equal(after.q_nb, before.q_nb)
    tracker.update(17.2, rate, force)
    without = NavTracker(START)
    for time in (17.0, 17.1, 17.2):
        without.update(time, rate, force)
    assert np.array_equal(tracker.state.v_n, without.state.v_n)
    assert tracker.state.lat == without.state.lat


def test_a_tracker_takes_what_numpy_takes():
    """Lists, rows of a larger array: the same numbers."""
    samples = shaken_log().to_numpy()[:5]
    found = []
    for turn in (
        lambda v: v,
        lambda v: [float(x) for x in v],
        lambda v: np.repeat(v, 2)[::2],
    ):
        tracker = NavTracker(START)
        for k, row in enumerate(samples):
            tracker.update(17.0 + 0.01 * k, turn(row[:3]), turn(row[3:]))
        found.append([tracker.state.lat, *tracker.state.v_n, *tracker.state.q_nb])
    assert all(row == found[0] for row in found)


def test_a_tracker_knows_its_samplings():
    with pytest.raises(ConfigError, check=coded("tables.no-kind-sampling")):
        NavTracker(START, sampling="averaged")


def test_a_tracker_stops_before_a_pole():
    tracker = NavTracker(
        NavState.from_degrees(89.8999, 10.0, v_n=[300.0, 0.0, 0.0]), NorthEastDown(height="held")
    )
    tracker.update(0.0, np.zeros(3), np.array([0.0, 0.0, -9.83]))
    with pytest.raises(
        DivergenceError,
        check=coded("mechanization.step-comes-nearer-pole-than", latitude_limit_deg=89.9),
    ):
        tracker.update(0.5, np.zeros(3), np.array([0.0, 0.0, -9.83]))
    assert np.degrees(tracker.state.lat) == pytest.approx(89.8999, abs=1e-12)


# --- in pieces --------------------------------------------------------------------------


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
@pytest.mark.parametrize(
    "cuts", [[1, 2, 3, 60, 61, 299], [2, 150], [150, 150, 151], list(range(1, 100)), [298]]
)
@pytest.mark.parametrize("name", NAMES)
def test_pieces_give_the_bits_of_the_whole(name, cuts, sampling):
    mechanization, log = MECHANIZATIONS[name](), shaken_log(sampling)
    whole = run_mechanization(mechanization, START, motion_increments(log)).trajectory
    bounds = [0, *cuts, len(log)]
    pieces = [log.iloc[a:b] for a, b in itertools.pairwise(bounds)]
    found = pd.concat(list(navigate_segments(mechanization, START, pieces)))
    assert np.array_equal(found.to_numpy(), whole.iloc[1:].to_numpy())
    assert np.array_equal(found.index, whole.index[1:])


@pytest.mark.parametrize("first", [1, 10])
def test_pieces_are_held_to_their_start(first):
    log = shaken_log()
    late = NavState(18.0, START.lat, START.lon, START.alt, START.v_n, START.q_nb)
    with pytest.raises(
        DataError,
        check=lambda refused: refused.finding.code == "mechanization.state-increments-begin",
    ):
        list(navigate_segments(NorthEastDown(), late, [log.iloc[:first], log.iloc[first:]]))


def test_a_hole_between_pieces_is_refused():
    log = shaken_log()
    late = log.set_axis(log.index + 100.0)
    late.attrs = dict(log.attrs)
    pieces = navigate_segments(NorthEastDown(), START, [log, late])
    assert len(next(pieces)) == len(log) - 1
    with pytest.raises(DataError, check=coded("mechanization.gap-body-did-not-known")):
        next(pieces)


def test_pieces_out_of_order_are_refused():
    log = shaken_log()
    with pytest.raises(DataError, match="time"):
        list(navigate_segments(NorthEastDown(), START, [log.iloc[:50], log.iloc[10:20]]))


def test_of_no_pieces_nothing_comes():
    log = shaken_log()
    assert list(navigate_segments(NorthEastDown(), START, [])) == []
    assert list(navigate_segments(NorthEastDown(), START, [log.iloc[:0], log.iloc[:1]])) == []


def test_a_tracker_refuses_a_leap_and_a_start_at_another_time():
    still, level = np.zeros(3), np.array([0.0, 0.0, -9.8])
    tracker = NavTracker(START)
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "mechanization.state-first-sample"
    ):
        tracker.update(START.time + 1.5, still, level)
    tracker.update(START.time, still, level)
    before = tracker.state
    with pytest.raises(DataError, match=r"a gap of 1\.01 s"):
        tracker.update(START.time + 1.01, still, level)
    assert tracker.state.time == before.time
    tracker.update(START.time + 1.0, still, level)
    patient = NavTracker(START, longest_step=5.0)
    patient.update(START.time, still, level)
    patient.update(START.time + 4.0, still, level)
