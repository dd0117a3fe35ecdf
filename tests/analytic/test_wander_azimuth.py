"""A wander azimuth against exact truth in the Earth's axes, over poles, and other equations."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))

from ecef_motion import OverThePole, errors_in_earth_axes
from exact_increments import errors, exact_increments, start_of
from strapdown import frames, rotation
from strapdown._kernels import wander as kernel
from strapdown.ellipsoids import ELLIPSOIDS, WGS84
from strapdown.mechanization import NorthEastDown, WanderAzimuth, run_mechanization
from strapdown.mechanization.mechanization import state_error
from strapdown.nav_state import NavState
from strapdown.simulation import Origin, SineVelocityMotion, StationaryMotion
from strapdown.tables import MOTION

ROUNDING = 1.1e-16


def instants(motion_end, step):
    return np.arange(0.0, motion_end + 0.5 * step, step)


def over(motion, step, **options):
    """Run over a whole motion from its exact start."""
    time = instants(2.0 * motion.half, step)
    heights = None
    if options.get("height") == "damped":
        heights = [motion.state(t).alt for t in time[1:]]
    return run_mechanization(
        WanderAzimuth(ellipsoid=motion.ellipsoid.name, **options),
        motion.state(0.0),
        motion.increments(time),
        heights=heights,
        longest_step=10.0,
    )


def hold(found, steps, step, speed=250.0, duration=400.0):
    """Errors are those of the method and of rounding.

    Of the method: gravity's derivatives with height are right to a part in 1e3 and the changes
    within a step to the third order of v/R, which leaves less than 5e-12 m/s² for steps of a
    second at 250 m/s, and no less than linearly with the step; the place has it twice. Of rounding:
    of the exact attitudes, from which the turns are made, 2e-16 rad a step and always to the same
    side at worst, which tilts the force of 9.8 m/s², and of a place in ECEF, 6.4e6 m, ten times.
    """
    turned = 2.0 * ROUNDING * (steps + 20)
    fast = 5e-12 * step * duration + 9.8 * turned * duration + 20.0 * ROUNDING * speed
    far = 0.5 * (5e-12 * step + 9.8 * turned) * duration**2 + 10.0 * ROUNDING * 6.4e6
    assert found[:, 0].max() < far
    assert found[:, 1].max() < fast
    assert found[:, 2].max() < turned


@pytest.mark.parametrize("miss", [0.0, 1e-3, 10.0, -3000.0])
@pytest.mark.parametrize("south", [False, True])
@pytest.mark.parametrize("step", [1.0, 0.5])
def test_over_a_pole_it_is_as_exact_as_anywhere(step, south, miss):
    """With a miss of 0 a step ends at the pole itself."""
    motion = OverThePole(south=south, miss=miss)
    run = over(motion, step)
    found = errors_in_earth_axes(run, motion)
    hold(found, len(found), step)
    if miss == 0.0:
        at_pole = run.trajectory["lat"].iloc[round(motion.half / step)]
        # A micrometre is 1e-11 deg.
        assert abs(at_pole) > 90.0 - 1e-11


@pytest.mark.parametrize("name", ELLIPSOIDS)
def test_every_ellipsoid_has_its_poles(name):
    motion = OverThePole(ellipsoid=ELLIPSOIDS[name], miss=5.0)
    found = errors_in_earth_axes(over(motion, 1.0), motion)
    hold(found, len(found), 1.0)
    # And no other has them there: 30 m of flattening and axes, or gravity, for 400 s.
    other = "wgs84" if name != "wgs84" else "krassovsky1940"
    stranger = OverThePole(ellipsoid=ELLIPSOIDS[other], miss=5.0)
    run = run_mechanization(
        WanderAzimuth(ellipsoid=name), stranger.state(0.0), stranger.increments(instants(400, 1.0))
    )
    assert errors_in_earth_axes(run, stranger)[-1, 0] > 1e-3


def test_a_damped_height_goes_over_a_pole():
    motion = OverThePole(miss=5.0)
    found = errors_in_earth_axes(over(motion, 1.0, height="damped"), motion)
    hold(found, len(found), 1.0)


@pytest.mark.parametrize("south", [False, True])
def test_backward_over_a_pole_it_comes_to_the_start(south):
    motion = OverThePole(south=south)
    increments = motion.increments(instants(400.0, 1.0))
    back = run_mechanization(WanderAzimuth(), motion.state(400.0), increments, backward=True)
    found = errors_in_earth_axes(back, motion)
    hold(found, len(found), 1.0)


@pytest.mark.parametrize("lon_deg", [0.0, 77.0, -180.0])
@pytest.mark.parametrize("south", [False, True])
def test_a_start_at_a_pole_points_where_its_longitude_says(south, lon_deg):
    motion = OverThePole(south=south)
    lat = -0.5 * math.pi if south else 0.5 * math.pi
    level = frames.q_ne(math.degrees(lat), lon_deg)
    at = np.array([motion.half])
    start = NavState(
        time=motion.half,
        lat=lat,
        lon=math.radians(lon_deg),
        alt=motion.alt + motion.wave,
        v_n=rotation.rotate(level, motion.course(at)[1][0]),
        q_nb=rotation.compose(level, motion.earth_attitude(at)[0]),
    )
    if south:
        start = NavState(start.time, lat, start.lon, motion.state(200.0).alt, start.v_n, start.q_nb)
    steps = motion.increments(motion.half + instants(200.0, 1.0))
    run = run_mechanization(WanderAzimuth(), start, steps)
    found = errors_in_earth_axes(run, motion)
    # The truth is 5e-10 m from the pole: rounding of its cosines.
    hold(found, len(found), 1.0)


def test_longitude_goes_through_a_half_turn():
    motion = SineVelocityMotion(
        60.0, Origin(70.0, 179.99, 500.0), (5.0, 40.0, 0.0), (1.0, 1.0, 0.2), 16.0
    )
    increments = exact_increments(motion, instants(60.0, 0.5))
    run = run_mechanization(WanderAzimuth(), start_of(motion), increments)
    lon = run.trajectory["lon"].to_numpy()
    assert lon[0] > 179.9
    assert lon[-1] < -179.9
    wrong = errors(run, motion).abs().max()
    # At 40 m/s and 0.5 s the method leaves 1e-12 m/s²; a place is rounded to 1.4e-9 m.
    assert wrong[["north", "east", "down"]].max() < 2e-8
    assert wrong[["VN", "VE", "VD"]].max() < 1e-9
    assert wrong[["roll", "pitch", "heading"]].max() < 1e-12


# --- order, and north-east-down ---------------------------------------------------------


def both(motion, step):
    increments = exact_increments(motion, instants(motion.duration, step))
    return [
        run_mechanization(kind(), start_of(motion), increments, longest_step=10.0).end
        for kind in (NorthEastDown, WanderAzimuth)
    ]


def test_it_is_of_the_fourth_order():
    motion = SineVelocityMotion(
        600.0, Origin(0.1, 179.9, 0.0), (80.0, 0.0, 0.0), (30.0, 20.0, 0.0), 16.0
    )
    truth = NavState.from_trajectory(motion.trajectory(np.array([motion.duration])))
    steps = np.array([4.0, 2.0, 1.0])
    wrong = [np.abs(state_error(both(motion, s)[1], truth)[4]) for s in steps]
    order = np.polyfit(np.log(steps), np.log(wrong), 1)[0]
    assert 3.8 < order < 4.4
    # To there from 3e-6 m/s; and what is of lower orders is no more than rounding there.
    assert wrong[-1] < 2e-8


def test_it_is_north_east_down_within_the_error_of_that():
    """North-east-down is of the second order where it climbs: `_kernels.ned`."""
    motion = SineVelocityMotion(
        600.0, Origin(-42.0, 179.9, 3000.0), (120.0, 90.0, -2.0), (30.0, 20.0, 5.0), 16.0
    )
    truth = NavState.from_trajectory(motion.trajectory(np.array([motion.duration])))
    steps = np.array([2.0, 1.0, 0.5, 0.25])
    apart, own = [], []
    for step in steps:
        ned, wander = both(motion, step)
        apart.append(np.abs(state_error(wander, ned)[3:6]).max())
        own.append([np.abs(state_error(x, truth)[3:6]).max() for x in (ned, wander)])
    order = np.polyfit(np.log(steps), np.log(apart), 1)[0]
    assert 1.7 < order < 3.0
    ned, wander = np.array(own).T
    # From half a second on, the difference is the error of the one of them.
    assert np.all(np.abs(apart[2:] - ned[2:]) < 0.35 * ned[2:])
    assert np.all(wander[2:] < 0.35 * ned[2:])


# --- the equations of the paper ---------------------------------------------------------


def product(p, q):
    w, x, y, z = p
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]]) @ q


def printed_pi_1(w):
    x, y, z = w
    return np.array([[0, -x, -y, -z], [x, 0, z, -y], [y, -z, 0, x], [z, y, -x, 0]], dtype=float)


def printed_pi_0(w, sign):
    x, y, z = w
    return np.array([[0, y, -x, sign * z], [-y, 0, z, -x], [x, -z, 0, -y], [z, x, y, 0]])


def test_the_first_matrix_has_a_wrong_sign_in_print():
    """With -Theta_z it is skew, and the kinematics of ``(-Theta_y, Theta_x, Theta_z)``."""
    rng = np.random.default_rng(7)
    theta, q = rng.normal(size=3), rng.normal(size=4)
    printed, mended = printed_pi_0(theta, 1.0), printed_pi_0(theta, -1.0)
    assert np.abs(printed + printed.T).max() == pytest.approx(2.0 * abs(theta[2]))
    assert np.array_equal(mended, -mended.T)
    x, y, z = theta
    assert mended @ q == pytest.approx(product(q, [0.0, -y, x, z]), abs=1e-15)
    assert printed_pi_1(theta) @ q == pytest.approx(product(q, [0.0, *theta]), abs=1e-15)


def felt(t):
    """Body rate and specific force of a body that waves and pushes, in its axes."""
    rate = np.array([0.1 * math.sin(0.5 * t), 0.08 * math.cos(0.4 * t), 0.05])
    force = np.array([0.5 * math.sin(0.3 * t), 0.4, -9.8 + 0.3 * math.cos(0.6 * t)])
    return rate, force


def paper(t, y):
    """Right sides of (1), (2), (4), with gravitation and centrifugal term apart."""
    from strapdown import earth

    q_ib, q_ew, v, alt = y[:4], y[4:8], y[8:11], y[11]
    rate, force = felt(t)
    e2, a = WGS84.eccentricity_squared, WGS84.semi_major_axis
    turn = WGS84.rotation_rate
    c_ew = rotation.dcm_from_quaternion(q_ew / np.linalg.norm(q_ew))
    axis = c_ew[2]
    s = axis[2]
    prime = a / math.sqrt(1.0 - e2 * s * s)
    place = (prime + alt) * np.array([0.0, 0.0, 1.0]) - e2 * prime * s * axis
    # Curvature of the level surface: across the meridian, and along it.
    k = np.array([axis[0], axis[1], 0.0])
    c = math.hypot(axis[0], axis[1])
    to_north = k / c
    to_east = np.array([to_north[1], -to_north[0], 0.0])
    meridian = prime * (1.0 - e2) / (1.0 - e2 * s * s)
    tilt = to_north * (to_north @ v) / (meridian + alt) + to_east * (to_east @ v) / (prime + alt)
    w = np.array([-tilt[1], tilt[0], 0.0])
    north, _, down = earth.gravitation(math.degrees(math.atan2(s, c)), alt)
    gravitation = north * to_north - down * np.array([0.0, 0.0, 1.0])
    omega = turn * axis
    angle = 0.5 * turn * t
    q_ie = np.array([math.cos(angle), 0.0, 0.0, math.sin(angle)])
    flip = np.array([1.0, -1.0, -1.0, -1.0])
    q_wb = product(flip * q_ew, product(flip * q_ie, q_ib))
    c_wb = rotation.dcm_from_quaternion(q_wb / np.linalg.norm(q_wb))
    return np.concatenate(
        [
            0.5 * product(q_ib, [0.0, *rate]),
            0.5 * printed_pi_1(w) @ q_ew,
            c_wb @ force
            + gravitation
            - 2.0 * np.cross(omega, v)
            - np.cross(w, v)
            - np.cross(omega, np.cross(omega, place)),
            [v[2]],
        ]
    )


def body(t, y):
    """Attitude, velocity and distance of the force within a step, from its start."""
    rate, force = felt(t)
    turned = rotation.dcm_from_quaternion(y[:4] / np.linalg.norm(y[:4])) @ force
    return np.concatenate([0.5 * product(y[:4], [0.0, *rate]), turned, y[4:7]])


def runge_kutta(f, t, y, step, steps):
    for _ in range(steps):
        a = f(t, y)
        b = f(t + 0.5 * step, y + 0.5 * step * a)
        c = f(t + 0.5 * step, y + 0.5 * step * b)
        d = f(t + step, y + step * c)
        y = y + step / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        t += step
    return y


@pytest.mark.parametrize("lat_deg", [55.0, -89.99])
def test_the_kernel_solves_the_equations_of_the_paper(lat_deg):
    """By the fourth order of Runge and Kutta, 0.02 s, whose error is under 1e-11 of the rates."""
    from strapdown.tables import motion_increments_table

    duration, step, parts = 12.0, 0.2, 10
    steps = round(duration / step)
    rows = []
    for i in range(steps):
        y = np.array([1.0, *[0.0] * 9])
        y = runge_kutta(body, i * step, y, step / parts, parts)
        phi = rotation.rotation_vector_from_quaternion(y[:4] / np.linalg.norm(y[:4]))
        rows.append(np.concatenate([phi, y[4:]]))
    rows = np.array(rows)
    table = motion_increments_table(
        step * np.arange(1, steps + 1), np.full(steps, step), rows[:, :3], rows[:, 3:6], rows[:, 6:]
    )
    start = NavState.from_degrees(
        lat_deg, 30.0, 2000.0, v_n=[60.0, -110.0, 2.0], roll_deg=3.0, heading_deg=40.0
    )
    mechanization = WanderAzimuth()
    state = mechanization.begin(start)
    begin = np.concatenate([state[kernel.Q_IB :][:4], state[:4], state[5:8], [state[4]]])
    exact = runge_kutta(paper, 0.0, begin, 0.02, round(duration / 0.02))
    after, _ = mechanization.advance(state, table)
    # (0.2 rad/s * 0.02 s)^4 / 120 a second is 2e-12 rad, with 9.8 m/s² 1e-10 m/s in 12 s.
    assert after[kernel.Q_IB :][:4] == pytest.approx(exact[:4], abs=3e-11)
    assert after[4] == pytest.approx(exact[11], abs=1e-8)
    # Up and velocity in axes of the Earth: azimuth is free, and differs by the area that the path
    # encloses with the chords of the steps. Runge and Kutta round 600 times, to 1.1e-16.
    ours, theirs = after[:4], exact[4:8] / np.linalg.norm(exact[4:8])
    up = np.array([0.0, 0.0, 1.0])
    assert rotation.rotate(ours, up) == pytest.approx(rotation.rotate(theirs, up), abs=5e-15)
    assert rotation.rotate(ours, after[5:8]) == pytest.approx(
        rotation.rotate(theirs, exact[8:11]), abs=1e-9
    )
    assert ours == pytest.approx(theirs, abs=1e-12)


# --- a day of milliseconds --------------------------------------------------------------


def rest(steps_a_call, calls):
    """Errors and the state after a rest at 1 kHz with the height held."""
    step = 1e-3
    still = StationaryMotion(3600.0, Origin(55.0, 37.0, 150.0), -5.0, 10.0, 110.0)
    row = exact_increments(still, np.array([0.0, step]))[MOTION].to_numpy().copy()
    # The turn of a body at rest, not rounded as an attitude is.
    row[0, 1:4] = still.rate(np.zeros(1))[0] * step
    rows = np.repeat(row, steps_a_call, axis=0)
    mechanization = WanderAzimuth(height="held")
    start = start_of(still)
    state, none, earth = mechanization.begin(start), np.empty(0), WGS84.parameters()
    history = np.empty((steps_a_call, mechanization.row))
    for _ in range(calls):
        made, why = mechanization.advance_rows(state, rows, none, earth, history)
        assert (made, why) == (steps_a_call, 0)
    return state_error(mechanization.nav_state(state, 0.0), start), state


def check_rest(wrong, state, seconds):
    for at in (kernel.Q_EW, kernel.Q_IB, kernel.Q_WB):
        # Four squares and their root.
        assert abs(np.linalg.norm(state[at : at + 4]) - 1.0) < 4.0 * ROUNDING
    half = 0.5 * WGS84.rotation_rate * seconds
    c, s = state[kernel.SPIN], state[kernel.SPIN + 1]
    assert math.hypot(c - math.cos(half), s - math.sin(half)) < 8.0 * ROUNDING
    # What a rounding of the turn of a step, 1.1e-16 of it, leaves of a whole turn, and the rounding
    # of three quaternions that are multiplied: of each number one.
    turned = ROUNDING * (half * 2.0 + 12.0)
    assert np.abs(wrong[6:9]).max() < turned
    # The velocity of a step, 9.8e-3 m/s, is turned to level by six products: what their rounding
    # pushes is met by gravity as soon as it has moved the place by a/g of the radius, twice that at
    # the far end of Schuler's swing. Beside it stands the rounding of the place itself.
    push = 6.0 * ROUNDING * 9.8
    radius = 6.4e6
    assert np.abs(wrong[:3]).max() < 2.0 * push / 9.8 * radius + 4.0 * ROUNDING * radius
    assert np.abs(wrong[3:6]).max() < push * math.sqrt(radius / 9.8) + turned * 9.8


def test_an_hour_of_milliseconds_adds_up_no_rounding():
    wrong, state = rest(100_000, 36)
    check_rest(wrong, state, 3600.0)


@pytest.mark.slow
def test_a_day_of_milliseconds_adds_up_no_rounding():
    """8.64e7 steps."""
    wrong, state = rest(100_000, 864)
    check_rest(wrong, state, 86_400.0)
