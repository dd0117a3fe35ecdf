"""What holds of navigation anywhere: symmetries of the Earth, and the way back."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from strapdown import rotation
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown, run_mechanization
from strapdown.nav_state import NavState
from strapdown.tables import DR, DV, PHI, imu_table

STEPS, STEP = 60, 0.02
places = st.tuples(st.floats(-85.0, 85.0), st.floats(-180.0, 180.0), st.floats(-400.0, 30_000.0))
velocities = st.tuples(*[st.floats(-300.0, 300.0)] * 3)
angles = st.tuples(st.floats(-180.0, 180.0), st.floats(-85.0, 85.0), st.floats(0.0, 359.9))
seeds = st.integers(0, 2**32 - 1)
few = settings(max_examples=60, deadline=None)


def start(place, velocity, angles):
    roll, pitch, heading = angles
    return NavState.from_degrees(
        *place, v_n=velocity, roll_deg=roll, pitch_deg=pitch, heading_deg=heading
    )


def increments(seed):
    """A smooth random turn and force: five g and 2 rad/s."""
    rng = np.random.default_rng(seed)
    time = np.arange(STEPS + 1) * STEP
    swing = np.sin(np.outer(time, rng.uniform(0.5, 8.0, 6)) + rng.uniform(0.0, 6.3, 6))
    return motion_increments(imu_table(time, 2.0 * swing[:, :3], 50.0 * swing[:, 3:]))


def navigate(state, log, height="free", backward=False):
    used = NorthEastDown(height=height)
    return run_mechanization(used, state, log, backward=backward)


@few
@given(places, velocities, angles, seeds, st.floats(-180.0, 180.0))
def test_the_longitude_of_the_start_is_nothing_but_an_origin(place, velocity, angles, seed, by):
    log = increments(seed)
    one = navigate(start(place, velocity, angles), log)
    moved = (place[0], math.remainder(place[1] + by, 360.0), place[2])
    other = navigate(start(moved, velocity, angles), log)
    # Longitude itself is rounded; nothing else sees it.
    apart = np.delete(one.history, 1, axis=1) - np.delete(other.history, 1, axis=1)
    assert np.all(apart == 0.0)
    turned = other.history[:, 1] - one.history[:, 1]
    # A rounding a step of an angle of up to 2 pi: 4.4e-16.
    assert np.ptp(turned) < 2 * STEPS * 4.5e-16


@few
@given(places, velocities, angles, seeds)
def test_north_and_south_are_mirror_images(place, velocity, angles, seed):
    """Mirrored in the plane of the equator, an Earth that turns turns the same way.

    North changes sign, and so do the turns about east and about down; body axes are mirrored
    along with the level ones.
    """
    log, state = increments(seed), start(place, velocity, angles)
    # Made as its image is made: to be made unit once more changes a last bit.
    again = NavState(0.0, state.lat, state.lon, state.alt, state.v_n, state.q_nb)
    one = navigate(again, log)
    mirrored = log.copy()
    mirrored[[PHI[1], PHI[2], DV[0], DR[0]]] *= -1.0
    w, x, y, z = state.q_nb
    image = NavState(
        0.0,
        -state.lat,
        state.lon,
        state.alt,
        state.v_n * [-1.0, 1.0, 1.0],
        np.array([w, x, -y, -z]),
    )
    other = navigate(image, mirrored)
    signs = np.array([-1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0, 1.0, -1.0, -1.0])
    assert (one.history == other.history * signs).all()


@few
@given(places, velocities, angles, seeds)
def test_the_quaternion_stays_unit(place, velocity, angles, seed):
    run = navigate(start(place, velocity, angles), increments(seed))
    norms = np.linalg.norm(run.history[:, 6:], axis=1)
    # The norm is mended one step late: two products of quaternions are ten roundings or so, and
    # the turn of the level is unit to its own fourth order, 1e-18 here.
    assert np.abs(norms - 1.0).max() < 3e-15


@few
@given(places, velocities, angles, seeds)
def test_there_and_back_is_the_start(place, velocity, angles, seed):
    log, state = increments(seed), start(place, velocity, angles)
    there = navigate(state, log)
    back = navigate(there.end, log, backward=True).end
    # What the step leaves out is not the same on the way back: gravity and the turn of the level,
    # of (dt/806 s)² and less, which is under rounding; what is left is rounding of a place of up
    # to 6.4e6 m, and of velocities of up to 400 m/s, a few a step.
    steep = 1.0 / math.cos(state.lat)
    assert abs(back.lat - state.lat) * 6.4e6 < 1e-7
    assert abs(math.remainder(back.lon - state.lon, 2.0 * math.pi)) * 6.4e6 < 1e-7 * steep
    assert abs(back.alt - state.alt) < 1e-7
    assert np.abs(back.v_n - state.v_n).max() < 1e-9
    assert rotation.rotation_angle(back.q_nb, state.q_nb) < 1e-11 * steep


@few
@given(places, velocities, angles, seeds)
def test_a_held_height_is_held(place, velocity, angles, seed):
    state = start(place, velocity, angles)
    run = navigate(state, increments(seed), height="held")
    assert np.all(run.history[:, 2] == state.alt)
    assert np.all(run.history[:, 5] == 0.0)


@few
@given(places, velocities, angles, seeds, st.floats(0.0, 360.0))
def test_how_the_sensor_is_mounted_is_nothing_to_the_path(place, velocity, angles, seed, by):
    """Other body axes, the same motion: the same place and velocity."""
    log, state = increments(seed), start(place, velocity, angles)
    mount = rotation.quaternion_from_euler([by, 0.5 * by - 90.0, 2.0 * by])
    other = log.copy()
    for columns in (PHI, DV, DR):
        other[columns] = rotation.rotate(rotation.conjugate(mount), log[columns].to_numpy())
    turned = NavState(
        0.0,
        state.lat,
        state.lon,
        state.alt,
        state.v_n,
        rotation.compose(state.q_nb, mount),
    )
    one, two = navigate(state, log), navigate(turned, other)
    # Roundings of 1e-16 of 5 g times 1.2 s, and of their attitude.
    assert np.abs(one.history[:, 3:6] - two.history[:, 3:6]).max() < 1e-11
    assert np.abs(one.history[:, 2] - two.history[:, 2]).max() < 2e-10
    assert np.abs(one.history[:, 0] - two.history[:, 0]).max() * 6.4e6 < 2e-8
