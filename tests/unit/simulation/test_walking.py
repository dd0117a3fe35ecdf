"""A unit on a shoe: what it does in stances, that all of it is one motion, and how hard it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.frames import ned_from_geodetic
from strapdown.simulation import GAITS, Origin, Stride, WalkingMotion, walk
from strapdown.tables import places_of

HERE = Origin(48.0, 11.0, 500.0)
STANDARD_G = 9.80665


@pytest.fixture(scope="module", params=list(GAITS))
def motion(request):
    strides = walk(GAITS[request.param], 24, stairs=(14, 15))
    return WalkingMotion(strides, HERE, roll_deg=5.0, pitch_deg=-15.0)


def test_in_stances_nothing_moves_to_the_last_bit(motion):
    time = np.arange(0.0, motion.duration, 0.003)
    stands = motion.stances(time)
    assert 0.3 < stands.mean() < 0.8
    found = motion.kinematics(time)
    for what in (found.velocity, found.acceleration, found.turning):
        assert (what[stands] == 0.0).all()
        # Within the swing a single value may pass zero.
        assert (np.abs(what[~stands]).max(axis=1) > 0.0).mean() > 0.99


def test_it_goes_where_its_strides_lead(motion):
    """24 strides by hand; corners after 10 and 20 of them, and two strides of stairs."""
    at = motion.footfalls
    assert len(at) == 25
    places = ned_from_geodetic(places_of(motion.trajectory(at)), np.array([48.0, 11.0, 500.0]))
    here, heading = np.zeros(2), 0.0
    for k in range(24):
        heading += 45.0 if k in (10, 11, 20, 21) else 0.0
        stride = motion.strides[0].gait.stride
        size = 0.6 if k in (14, 15) else stride * (0.6 if k in (10, 11, 20, 21) else 1.0)
        here = here + size * np.array([np.cos(np.radians(heading)), np.sin(np.radians(heading))])
        # North and east of a start are not quite those of where it is by then: 40 m away they
        # are turned by the convergence of the meridians, 40 m tan(48 deg) / 6.4e6 m.
        np.testing.assert_allclose(places[k + 1, :2], here, atol=40.0 * 7e-6 + 1e-4)
    np.testing.assert_allclose(places[-1, 2], -4 * 0.17, atol=2e-4)


def test_velocity_and_rate_are_derivatives(motion):
    """Central differences of 0.1 ms: the third derivative of a swing, 2e4 m/s³ in the blow."""
    h = 1e-4
    time = np.linspace(4.9, motion.duration - 4.9, 400)
    # Moves of least jerk have a jerk that jumps where they begin and end.
    edges = np.array(motion.breaks)
    time = time[np.abs(time[:, None] - edges).min(axis=1) > 2.0 * h]
    after, before = motion.kinematics(time + h), motion.kinematics(time - h)
    now = motion.kinematics(time)
    acceleration = (after.velocity - before.velocity) / (2.0 * h)
    # h²/6 of the third derivative of a velocity: of the blow 60 v/T³, v = 1.9 m/s of a run's
    # fall, T = 10 ms; and a tenth of that of what is slower.
    np.testing.assert_allclose(acceleration, now.acceleration, atol=h * h / 6 * 60 * 1.9 / 0.01**3)
    turned = rotation.compose(rotation.conjugate(before.q_nb), after.q_nb)
    rate = rotation.rotation_vector_from_quaternion(turned) / (2.0 * h)
    np.testing.assert_allclose(rate, now.turning, atol=2e-3)


def test_a_walk_is_as_hard_as_one(motion):
    """On shoes some 300 to 600 deg/s and 4 to 8 g were measured, of a run up to a half more."""
    time = np.arange(0.0, motion.duration, 0.001)
    rate = np.degrees(np.abs(motion.rate(time))).max()
    force = np.linalg.norm(motion.specific_force(time), axis=1).max() / STANDARD_G
    gait = motion.strides[0].gait
    limits = {
        GAITS["walk"]: ((400.0, 600.0), (5.0, 8.0)),
        GAITS["run"]: ((700.0, 1000.0), (8.0, 12.0)),
        GAITS["shuffle"]: ((100.0, 300.0), (2.0, 5.0)),
    }[gait]
    assert limits[0][0] < rate < limits[0][1]
    assert limits[1][0] < force < limits[1][1]


@pytest.mark.parametrize(
    ("make", "quantity"),
    [
        (lambda: WalkingMotion((), HERE), "strides"),
        (lambda: WalkingMotion((Stride(GAITS["walk"]),), HERE, stand=0.0), "strides"),
        (lambda: WalkingMotion(walk(GAITS["run"], 3), HERE, pitch_deg=-30.0), "pitch_deg"),
        (lambda: replace(GAITS["walk"], swing=0.0), "swing"),
        (lambda: replace(GAITS["walk"], strike_time=0.3), "strike_time"),
        (lambda: replace(GAITS["walk"], heel_off_deg=85.0), "pitch"),
    ],
)
def test_what_no_foot_does_is_refused(make, quantity):
    with pytest.raises(ConfigError) as refused:
        make()
    assert refused.value.finding.quantity == quantity
    assert refused.value.finding.remedy
