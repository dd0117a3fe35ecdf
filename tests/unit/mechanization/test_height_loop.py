"""The loop that damps the height, with references that come less often than steps."""

import numpy as np
import pytest

from strapdown.earth import earth_rate, gravity
from strapdown.increments import motion_increments
from strapdown.mechanization import MECHANIZATIONS, NavTracker, NorthEastDown, run_mechanization
from strapdown.nav_state import NavState
from strapdown.tables import imu_table

LAT, ALT = 45.0, 100.0


def rest_log(step, duration):
    """A body at rest and level, heading north."""
    time = np.arange(round(duration / step) + 1) * step
    return imu_table(
        time,
        np.tile(earth_rate(LAT), (len(time), 1)),
        np.tile(-gravity(LAT, ALT), (len(time), 1)),
        source="rest",
    )


def references(steps, every):
    heights = np.full(steps, np.nan)
    heights[every - 1 :: every] = ALT
    return heights


@pytest.mark.parametrize("name", sorted(MECHANIZATIONS))
@pytest.mark.parametrize(("every", "tau"), [(1, 50.0), (10, 50.0), (100, 50.0), (10, 10.0)])
def test_references_now_and_then_draw_the_height_as_those_of_every_step_do(name, every, tau):
    """``H exp(-at) (1 - 2at + a²t²/2)``, three poles at -a, however seldom they come."""
    step, jump = 0.1, 20.0
    log = motion_increments(rest_log(step, 8.0 * tau))
    loop = MECHANIZATIONS[name](height="damped", height_time_constant=tau)
    start = NavState.from_degrees(LAT, 10.0, ALT + jump)
    run = run_mechanization(loop, start, log, heights=references(len(log), every))
    at = run.time[every::every] / tau
    exact = jump * np.exp(-at) * (1.0 - 2.0 * at + 0.5 * at * at)
    found = run.history[every::every, loop.alt_at] - ALT
    # Closing the loop once in a time T delays it by up to T: 3 T/tau of the jump, and 1.5 as it is
    # linear between. The Earth's turn and the Tadic kernel's first order: a millimetre.
    assert np.abs(found - exact).max() < jump * 3.0 * every * step / tau + 0.01
    assert abs(found[-1]) < 0.02 * jump


@pytest.mark.parametrize("name", sorted(MECHANIZATIONS))
@pytest.mark.parametrize(
    ("step", "every", "tau"), [(1.0, 1, 1.0), (0.5, 120, 50.0), (0.5, 120, 1.0)]
)
def test_a_loop_faster_than_its_references_is_stable(name, step, every, tau):
    log = motion_increments(rest_log(step, 3000.0))
    loop = MECHANIZATIONS[name](height="damped", height_time_constant=tau)
    start = NavState.from_degrees(LAT, 10.0, ALT + 20.0, v_n=(0.0, 0.0, 0.5))
    run = run_mechanization(loop, start, log, heights=references(len(log), every))
    assert np.abs(run.history[:, loop.alt_at] - ALT).max() < 120.0
    assert np.abs(run.history[-500:, loop.alt_at] - ALT).max() < 0.1


def test_a_constant_error_of_the_accelerometer_is_found_and_held_between_references():
    """1 mg up, a reference a minute: without its memory 18 m between two of them."""
    log = motion_increments(rest_log(0.5, 3600.0))
    log["dv_z"] -= 0.0098 * log["dt"]
    log["dr_z"] -= 0.0049 * log["dt"] ** 2
    loop = NorthEastDown(height="damped")
    run = run_mechanization(
        loop, NavState.from_degrees(LAT, 10.0, ALT), log, heights=references(len(log), 120)
    )
    assert np.abs(run.history[-1200:, 2] - ALT).max() < 0.05


@pytest.mark.parametrize("backward", [False, True])
def test_pieces_remember_when_the_last_reference_came(backward):
    log = motion_increments(rest_log(0.1, 60.0))
    heights = references(len(log), 70)
    loop = NorthEastDown(height="damped", height_time_constant=5.0)
    begin = loop.begin(NavState.from_degrees(LAT, 10.0, ALT + 5.0))
    whole, _ = loop.advance(begin, log, heights, backward=backward)
    first, second = slice(0, 333), slice(333, None)
    state = begin
    for part in (second, first) if backward else (first, second):
        state, _ = loop.advance(state, log.iloc[part], heights[part], backward=backward)
    assert np.array_equal(state, whole)


def test_a_tracker_takes_references_now_and_then_as_a_run_does():
    imu = rest_log(0.1, 60.0)
    loop = NorthEastDown(height="damped", height_time_constant=5.0)
    start = NavState.from_degrees(LAT, 10.0, ALT + 5.0)
    heights = references(len(imu) - 1, 7)
    tracker = NavTracker(start, loop)
    for time, row, height in zip(imu.index, imu.to_numpy(), np.r_[np.nan, heights], strict=True):
        tracker.update(float(time), row[:3].copy(), row[3:6].copy(), float(height))
    end = run_mechanization(loop, start, motion_increments(imu), heights=heights).end
    assert (tracker.state.alt, tracker.state.v_n[2]) == (end.alt, end.v_n[2])
