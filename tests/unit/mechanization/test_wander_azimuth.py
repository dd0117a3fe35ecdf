"""A wander azimuth as a mechanization: starts, corrections, what a filter sees, messages."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parents[2]))

from ecef_motion import OverThePole, in_earth_axes
from strapdown import earth, rotation
from strapdown._kernels import wander as kernel
from strapdown.ellipsoids import ELLIPSOIDS, WGS84
from strapdown.errors import ConfigError, DivergenceError
from strapdown.increments import motion_increments
from strapdown.mechanization import (
    MECHANIZATIONS,
    NavTracker,
    NorthEastDown,
    WanderAzimuth,
    run_mechanization,
)
from strapdown.mechanization.mechanization import state_error
from strapdown.nav_state import NavState
from strapdown.tables import imu_table, motion_increments_table

ROUNDING = 1.1e-16
WANDER = WanderAzimuth()


def somewhere(lat_deg, lon_deg=-170.0, time=0.0):
    return NavState.from_degrees(
        lat_deg,
        lon_deg,
        1200.0,
        v_n=[150.0, -60.0, 3.0],
        roll_deg=4.0,
        pitch_deg=-8.0,
        heading_deg=250.0,
        time=time,
    )


def wandered(lat_deg, steps=200):
    """State and history of a run that has given the axes a wander angle."""
    time = np.arange(steps + 1.0)
    force = np.tile([0.3, -0.2, -9.8], (steps + 1, 1))
    log = motion_increments(imu_table(time, np.zeros((steps + 1, 3)), force))
    return WANDER.advance(WANDER.begin(somewhere(lat_deg)), log)


@pytest.mark.parametrize("lon_deg", [-180.0, -77.0, 0.0, 135.0])
@pytest.mark.parametrize("lat_deg", [-90.0, 90.0])
def test_a_start_at_a_pole_comes_back_with_its_longitude(lat_deg, lon_deg):
    start = somewhere(lat_deg, lon_deg)
    back = WANDER.nav_state(WANDER.begin(start), 0.0)
    assert (back.lat, back.alt) == (start.lat, start.alt)
    assert math.remainder(back.lon - start.lon, 2.0 * math.pi) == pytest.approx(0.0, abs=2e-15)
    assert back.v_n == pytest.approx(start.v_n, abs=150.0 * 2e-15)
    assert back.q_nb == pytest.approx(start.q_nb, abs=2e-15)


def test_its_trajectory_is_that_of_its_states():
    _, history = wandered(80.0)
    table = WANDER.trajectory(np.arange(1.0, 201.0), history)
    for k in (0, 77, 199):
        one = WANDER.nav_state(history[k], k + 1.0).to_trajectory()
        assert table.iloc[k].to_numpy() == pytest.approx(one.iloc[0].to_numpy(), abs=1e-12)


def test_the_wander_angle_is_zero_at_the_start_and_then_turns_against_the_longitude():
    """``dA/dt = -dlon/dt sin lat``: what keeps the rate about zeta at zero."""
    state, history = wandered(80.0)
    angle = WANDER.wander_angle(np.vstack([WANDER.begin(somewhere(80.0))[:12], history]))
    assert angle[0] == 0.0
    table = WANDER.trajectory(np.arange(1.0, 201.0), history)
    lat = np.radians(table["lat"].to_numpy())
    lon = np.unwrap(np.radians(table["lon"].to_numpy()))
    between = np.diff(lon) * np.sin(0.5 * (lat[1:] + lat[:-1]))
    # The trapezoid of a step of 170 m, 3e-5 rad at 10 deg from the pole: its cube, 200 times.
    assert np.diff(angle[1:]) == pytest.approx(-between, abs=3e-10)
    assert abs(angle[-1]) > 1e-3
    assert state[: kernel.ROW] == pytest.approx(history[-1], abs=0.0)


def test_the_first_quaternion_follows_from_a_row_and_the_time():
    state, history = wandered(55.0)
    found = WANDER.inertial_attitude(history, np.arange(1.0, 201.0))
    assert found[-1] == pytest.approx(state[kernel.Q_IB :][:4], abs=10.0 * ROUNDING)
    # The body did not turn in inertial space.
    assert np.abs(found - found[0]).max() < 10.0 * ROUNDING
    assert np.abs(history[:, 8:12] - history[0, 8:12]).max() > 1e-3


@pytest.mark.parametrize("name", ELLIPSOIDS)
def test_gravitation_and_centrifugal_term_are_normal_gravity(name):
    """What (4) has apart, the kernel has together: in axes of the Earth, ``-W x (W x R)``."""
    from strapdown.frames import C_ne, ecef_from_geodetic

    ellipsoid = ELLIPSOIDS[name]
    for lat_deg in (-90.0, -55.0, 0.0, 33.0):
        place = [lat_deg, 20.0, 3000.0]
        x, y, _ = ecef_from_geodetic(place, ellipsoid=ellipsoid)
        outward = C_ne(lat_deg, 20.0) @ (np.array([x, y, 0.0]) * ellipsoid.rotation_rate**2)
        attraction = earth.gravitation(lat_deg, 3000.0, ellipsoid=ellipsoid)
        whole = earth.gravity(lat_deg, 3000.0, ellipsoid=ellipsoid)
        assert attraction + outward == pytest.approx(whole, abs=1e-14)
    lean = earth.gravitation(55.0, 0.0, ellipsoid=ellipsoid)[0]
    assert lean == pytest.approx(0.016, abs=5e-4)


# --- as a filter sees it ----------------------------------------------------------------


@pytest.mark.parametrize("lat_deg", [-70.0, 0.0, 55.0])
def test_levels_are_those_of_north_east_down_turned(lat_deg):
    _, history = wandered(lat_deg)
    ned = NorthEastDown()
    for row in history[::60]:
        state = WANDER.nav_state(row, 0.0)
        (ours,), (theirs,) = WANDER.levels(row[None]), ned.levels(ned.begin(state)[None, :10])
        angle = WANDER.wander_angle(row[None])[0]
        s, c = math.sin(angle), math.cos(angle)
        turn = np.array([[s, c, 0.0], [c, -s, 0.0], [0.0, 0.0, -1.0]])
        assert ours[4:7] == pytest.approx(turn @ theirs[4:7], abs=1e-12)
        assert ours[7:10] == pytest.approx(turn @ theirs[7:10], abs=1e-14)
        assert ours[10] == pytest.approx(theirs[10], abs=1e-9)
        # Relative to the Earth it does not turn about up.
        assert ours[13] == 0.0
        assert ours[11:13] == pytest.approx((turn @ theirs[11:14])[:2], rel=1e-12)
        body = rotation.dcm_from_quaternion(ours[:4])
        assert body == pytest.approx(turn @ rotation.dcm_from_quaternion(theirs[:4]), abs=1e-14)


def test_the_rate_of_the_level_is_that_of_the_rows_over_a_pole():
    motion = OverThePole(half=20.0, wave=0.0)
    time = np.arange(0.0, 40.25, 0.5)
    run = run_mechanization(WANDER, motion.state(0.0), motion.increments(time))
    axes = rotation.dcm_from_quaternion(run.history[:, :4])
    rate = WANDER.levels(run.history)[:, 11:]
    up, turned = axes[:, :, 2], np.einsum("nij,nj->ni", axes, rate)
    # Central differences at 0.5 s of an angle that goes at 4e-5 rad/s: its cube, and rounding.
    slope = (up[2:] - up[:-2]) / 1.0
    assert np.cross(turned, up)[1:-1] == pytest.approx(slope, abs=1e-13)


ERROR = np.array([30.0, -20.0, 5.0, 0.3, -0.2, 0.1, 2e-4, -1e-4, 3e-4])


@pytest.mark.parametrize("lat_deg", [-88.0, 0.0, 55.0])
def test_an_error_that_is_taken_off_is_found_turned_to_north_east_down(lat_deg):
    state, _ = wandered(lat_deg)
    angle = WANDER.wander_angle(state[None, :12])[0]
    s, c = math.sin(angle), math.cos(angle)
    turn = np.array([[s, c, 0.0], [c, -s, 0.0], [0.0, 0.0, -1.0]])
    kept = state.copy()
    found = state_error(
        WANDER.nav_state(state, 0.0), WANDER.nav_state(WANDER.correct(state, ERROR), 0.0)
    )
    expected = np.concatenate([turn @ ERROR[k : k + 3] for k in (0, 3, 6)])
    # Geometry is exact; ECEF and angles near a pole are rounded.
    tolerance = [1e-8] * 3 + [1e-12] * 3 + [1e-13] * 3
    assert np.all(np.abs(found - expected) < tolerance)
    assert np.array_equal(state, kept)


@pytest.mark.parametrize("south", [False, True])
def test_an_error_is_taken_off_at_a_pole_in_axes_of_the_earth(south):
    motion = OverThePole(south=south)
    state = WANDER.begin(motion.state(motion.half))
    after = WANDER.correct(state, ERROR)
    position, velocity, attitude = in_earth_axes(np.vstack([state[:12], after[:12]]), WGS84)
    axes = rotation.dcm_from_quaternion(state[:4])
    assert position[0] - position[1] == pytest.approx(axes @ ERROR[:3], abs=1e-8)
    assert velocity[0] - velocity[1] == pytest.approx(axes @ ERROR[3:6], abs=1e-12)
    psi = rotation.rotation_vector_from_quaternion(
        rotation.compose(attitude[0], rotation.conjugate(attitude[1]))
    )
    assert psi == pytest.approx(axes @ ERROR[6:], abs=1e-14)


def test_a_corrected_run_goes_on_as_one_from_its_state():
    """The attitude in inertial axes is corrected with the rest, wherever the Earth has turned."""
    state, _ = wandered(70.0)
    after = WANDER.correct(state, ERROR)
    assert np.linalg.norm(after[kernel.Q_IB :][:4]) == pytest.approx(1.0, abs=3.0 * ROUNDING)
    time = np.arange(0.0, 101.0)
    force = np.tile([0.1, 0.2, -9.7], (101, 1))
    log = motion_increments(imu_table(time, np.full((101, 3), 0.01), force))
    one, _ = WANDER.advance(after, log)
    other, _ = WANDER.advance(WANDER.begin(WANDER.nav_state(after, 0.0)), log)
    apart = state_error(WANDER.nav_state(one, 0.0), WANDER.nav_state(other, 0.0))
    # A rounding of place or attitude at the start, as an angle, over 100 s of 9.8 m/s².
    tolerance = [1e-8] * 2 + [1e-8] + [1e-11] * 3 + [1e-14] * 3
    assert np.all(np.abs(apart) < tolerance)


def test_nothing_taken_off_changes_nothing_but_rounding():
    state, _ = wandered(-30.0)
    after = WANDER.correct(state, np.zeros(9))
    # Two products of quaternions and their norms.
    kept = slice(0, kernel.PRIME)
    assert after[kept] == pytest.approx(state[kept], rel=8e-16, abs=8e-16)
    # The radius was that of the place before the last step, 150 m back.
    assert after[kernel.PRIME] == pytest.approx(state[kernel.PRIME], rel=2e-7)


# --- messages ---------------------------------------------------------------------------


def test_it_is_in_the_table():
    assert MECHANIZATIONS["wander_azimuth"] is WanderAzimuth
    assert (WANDER.row, WANDER.level_up) == (12, 1.0)
    assert (NorthEastDown().row, NorthEastDown().level_up) == (10, -1.0)


def test_a_limit_of_latitude_is_refused_where_there_is_none():
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "mechanization.limit-axes-none"
    ) as caught:
        WanderAzimuth(latitude_limit_deg=85.0)
    assert caught.value.finding.quantity == "latitude_limit_deg"
    assert "across the poles" in caught.value.finding.remedy


def test_a_run_near_a_pole_says_where_angles_from_north_mean_little():
    motion = OverThePole(half=30.0, miss=60.0, wave=0.0)
    time = np.arange(0.0, 61.0)
    (found,) = run_mechanization(WANDER, motion.state(0.0), motion.increments(time)).findings
    # At 250 m/s it is 1000.4 m away after 26 s, on the ground, 9 km below.
    assert "7 states from 27 s to 33 s are within 1000 m of a pole" in found.what
    assert "the nearest 59.9 m" in found.what
    assert found.quantity == "heading"
    assert "earth_attitude" in found.remedy
    far = OverThePole(half=30.0, miss=2000.0)
    assert run_mechanization(WANDER, far.state(0.0), far.increments(time)).findings == ()


def leap():
    """200 m/s for 400 s, in one step."""
    force = np.array([[0.0, 0.0, -9.8 * 400.0]])
    table = motion_increments_table([400.0], [400.0], np.zeros((1, 3)), force, 200.0 * force)
    table.attrs["source"] = "flight.csv"
    return table


def test_a_step_far_around_the_earth_is_refused():
    start = NavState.from_degrees(50.0, 10.0, 100.0, v_n=[200.0, 0.0, 0.0])
    held = WanderAzimuth(height="held")
    with pytest.raises(
        DivergenceError, check=coded("mechanization.first-step-too-far", largest_turn=0.01)
    ) as caught:
        run_mechanization(held, start, leap(), longest_step=1e9)
    finding = caught.value.finding
    assert (finding.file, finding.quantity) == ("flight.csv", "state")
    assert "step 1, of 400 s" in finding.what
    tracker = NavTracker(start, held, longest_step=1e9)
    tracker.update(0.0, np.zeros(3), [0.0, 0.0, -9.8])
    with pytest.raises(
        DivergenceError, check=coded("mechanization.step-place-would-move-more", largest_turn=0.01)
    ) as caught:
        tracker.update(400.0, np.zeros(3), [0.0, 0.0, -9.8])
    assert caught.value.finding.row == 2
    assert tracker.state.time == 0.0


def test_a_tracker_goes_over_a_pole():
    tracker = NavTracker(
        NavState.from_degrees(89.9999, 10.0, 0.0, v_n=[300.0, 0.0, 0.0]),
        WanderAzimuth(height="held"),
    )
    for k in range(11):
        tracker.update(0.1 * k, np.zeros(3), np.array([0.0, 0.0, -9.83]))
    # 300 m over from 11 m before it.
    assert math.degrees(tracker.state.lat) == pytest.approx(90.0 - 289.0 / 111_694.0, abs=1e-5)
    assert math.degrees(tracker.state.lon) == pytest.approx(-170.0, abs=1.0)


def test_a_sample_that_is_refused_leaves_every_bit_of_the_state():
    tracker = NavTracker(somewhere(89.999), WANDER)
    for k in range(5):
        tracker.update(0.1 * k, [0.1, 0.2, 0.3], [0.0, 0.1, -9.8])
    kept = tracker._record.copy()
    with pytest.raises(DivergenceError, check=coded("mechanization.state-would-diverge")):
        tracker.update(0.5, [0.1, 0.2, 0.3], [4e6, 0.0, 0.0])
    assert np.array_equal(tracker._record, kept)
