"""Sculling and scrolling: what swinging and shaking at one frequency leave, in closed form."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError
from strapdown.increments import motion_increments
from strapdown.simulation import ImuErrors, Sculling, simulate_imu
from strapdown.tables import ACCEL, DR, DV, GYRO, PHI, QUATERNION, imu_table

SKEW = (0.5, -0.1, 0.7, 0.5)  # norm 1
WIDE = Sculling(
    70.0,
    3.0,
    1.7,
    5.0,
    phase=30.0,
    swing_axis=(1.0, 2.0, -1.0),
    push_axis=(1.0, 0.0, 1.0),
    q_nb=SKEW,
)


@pytest.mark.parametrize("motion", [WIDE, Sculling(180.0, 1.0, 0.5, 4.0, phase=-60.0)])
@pytest.mark.parametrize("time", [0.01, 0.3, 1.9])
def test_velocity_and_position_are_the_integrals(motion, time):
    mp = mpmath.mp.clone()
    mp.dps = 25
    alpha, omega = mp.radians(motion.swing), 2 * mp.pi * mp.mpf(motion.frequency)
    psi, t = mp.radians(motion.phase), mp.mpf(time)

    def z(x):
        return motion.push * mp.exp(1j * alpha * mp.sin(omega * x)) * mp.sin(omega * x + psi)

    edges = [t * k / 16 for k in range(17)]
    n, e = (np.array(a) / np.linalg.norm(a) for a in (motion.swing_axis, motion.push_axis))
    for found, integral in (
        (motion.velocity([time]), mp.quad(z, edges)),
        (motion.position([time]), mp.quad(lambda x: (t - x) * z(x), edges)),
    ):
        body = float(integral.real) * e + float(integral.imag) * np.cross(n, e)
        # Fifty harmonics of up to 3 m/s2 over 3 rad/s, each with a rounding or two, and the drift.
        assert found[0] == pytest.approx(rotation.rotate(motion.q_nb, body), abs=2e-14)


def test_force_and_rate_are_what_the_motion_gives():
    t = np.linspace(0.0, 2.0, 201)
    step = 2.0**-13
    # Central differences of second order: the third derivative of 70 deg at 1.7 Hz, (11 rad/s)^3,
    # times step^2/6 is 4e-6; rounding over the step is 1e-12.
    rate = (WIDE.angle(t + step) - WIDE.angle(t - step)) / (2 * step)
    assert rate == pytest.approx(WIDE.rate(t), abs=1e-5)
    shake = (WIDE.shake_sum(t + step) - WIDE.shake_sum(t - step)) / (2 * step)
    assert shake == pytest.approx(WIDE.shake(t), abs=2e-6)
    assert rotation.rotate(WIDE.attitude(t), WIDE.shake(t)) == pytest.approx(
        WIDE.acceleration(t), abs=1e-15
    )
    assert (WIDE.angle([0.0]) == 0).all() and (WIDE.velocity([0.0]) == 0).all()
    assert rotation.rotation_angle(WIDE.attitude([0.0])[0], SKEW) < 1e-13


def test_the_drift_is_that_of_whole_cycles():
    cycles = 3 / WIDE.frequency
    n, e = (np.array(a) / np.linalg.norm(a) for a in (WIDE.swing_axis, WIDE.push_axis))
    side = rotation.rotate(SKEW, np.cross(n, e))
    # What is left along e and across after whole cycles is drift alone.
    assert WIDE.velocity([cycles])[0] == pytest.approx(WIDE.drift * cycles * side, abs=1e-14)
    # J1(x) is x/2 - x^3/16: half of swing times push for a small swing.
    small = Sculling(0.1, 2.0, 1.0, 1.0)
    assert small.drift == pytest.approx(np.radians(0.1), rel=1e-6)
    assert abs(Sculling(20.0, 5.0, 1.0, 3.0, phase=90.0).drift) < 1e-15


@pytest.mark.parametrize(
    "wrong",
    [
        {"swing": 0.0},
        {"swing": 181.0},
        {"push": -1.0},
        {"frequency": np.inf},
        {"duration": 0.0},
        {"phase": np.nan},
        {"push_axis": (1.0, 1.0, 0.0)},
        {"swing_axis": (0.0, 0.0, 0.0)},
    ],
)
def test_numbers_that_make_no_sculling(wrong):
    with pytest.raises(ConfigError):
        Sculling(**({"swing": 1.0, "push": 1.0, "frequency": 1.0, "duration": 1.0} | wrong))


# --- what is left of it by each form of increments ----------------------------------------------

SWING, PUSH, FREQUENCY = 0.5, 10.0, 10.0


def drift(samples, interpolation, step, phase=0.0, sampling="mean"):
    """Steady velocity error along n x e over a second of whole cycles, m/s2, of exact sums."""
    motion = Sculling(SWING, PUSH, FREQUENCY, 2.0, phase=phase)
    time = np.arange(round(1.0 / step) + 1) * step
    edges = np.concatenate([[-step], time])
    if sampling == "mean":
        rate = np.diff(motion.angle(edges), axis=0) / step
        force = np.diff(motion.shake_sum(edges), axis=0) / step
    else:
        rate, force = motion.rate(time), motion.shake(time)
    rows = motion_increments(
        imu_table(time, rate, force, sampling=sampling), samples, interpolation
    )
    velocity = np.zeros(3)
    q = np.array([1.0, 0.0, 0.0, 0.0])
    for phi, dv in zip(rows[PHI].to_numpy(), rows[DV].to_numpy(), strict=True):
        velocity = velocity + rotation.rotate(q, dv)
        q = rotation.compose(q, rotation.quaternion_from_rotation_vector(phi))
    return (velocity - motion.velocity(time[-1:])[0])[2] / time[-1]


# A swing of 0.5 deg: terms of its square, 8e-5, are left out of what is derived below.
HALF = 0.5 * np.radians(SWING) * PUSH


@pytest.mark.parametrize("step", [0.01, 0.005])
@pytest.mark.parametrize("phase", [0.0, 40.0])
def test_what_single_increments_lose(step, phase):
    """A mean for itself keeps sin x/x of the drift, x = 2 pi f T (Savage 1998 has what is lost).

    With sums of ``2 sin(x/2)`` times a cosine, the half sum of the angles before and after a step
    times its velocity is, on average, ``1/2 a B cos psi sin x/x``.
    """
    x = 2 * np.pi * FREQUENCY * step
    expected = -HALF * np.cos(np.radians(phase)) * (1.0 - np.sin(x) / x)
    assert drift(1, "constant", step, phase) == pytest.approx(expected, rel=2e-4)


@pytest.mark.parametrize("step", [0.01, 0.005])
@pytest.mark.parametrize("phase", [0.0, 40.0])
def test_what_the_increment_before_it_gives_back(step, phase):
    """A twelfth of both products with the step before: a share of 2/3 sin^2(x/2) sin x/x."""
    x = 2 * np.pi * FREQUENCY * step
    kept = np.sin(x) / x * (1.0 + 2.0 / 3.0 * np.sin(x / 2) ** 2)
    expected = -HALF * np.cos(np.radians(phase)) * (1.0 - kept)
    # Relative to what is left, x^4 times a number of 0.1; the swing's square beside it, and the
    # first step, whose neighbour is known.
    assert drift(1, "linear", step, phase) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("phase", [0.0, 40.0])
def test_samples_at_the_stamps_lose_more(phase):
    """The chord cuts each crest: angle and velocity are short by half of x cot(x/2) each."""
    step = 0.005
    x = 2 * np.pi * FREQUENCY * step
    short = 0.5 * x / np.tan(0.5 * x)
    kept = short**2 * np.sin(x) / x
    # And within a step the line's own sculling, a twelfth of (w0 x f1 + f0 x w1) T^2.
    kept += x * np.sin(x) / 6.0
    expected = -HALF * np.cos(np.radians(phase)) * (1.0 - kept)
    assert drift(1, "linear", step, phase, "instantaneous") == pytest.approx(expected, rel=2e-3)


def test_each_further_sample_leaves_less():
    """At 24 samples a cycle; blocks of four are then a sixth of a cycle."""
    alone, two, three, four = (
        abs(drift(n, i, 1 / 240))
        for n, i in ((1, "constant"), (2, "linear"), (3, "linear"), (4, "linear"))
    )
    # The errors fall as x^2, x^4, x^4, x^6 with x = 2 pi/24 = 0.26.
    assert two < alone / 30 and three < two and four < three / 15


def test_scrolling_is_in_the_distance_of_a_step():
    """The distance after a quarter of a cycle, and what half of dv would make of it."""
    motion = Sculling(20.0, 5.0, 1.0, 2.0, phase=90.0)
    time = np.arange(301) / 240
    edges = np.concatenate([[-1 / 240], time])
    imu = imu_table(
        time,
        np.diff(motion.angle(edges), axis=0) * 240,
        np.diff(motion.shake_sum(edges), axis=0) * 240,
        sampling="mean",
    )
    rows = motion_increments(imu, 4, rows="block")
    q, v, r = np.array([1.0, 0, 0, 0]), np.zeros(3), np.zeros(3)
    plain = np.zeros(3)
    for dt, phi, dv, dr in zip(
        rows["dt"], rows[PHI].to_numpy(), rows[DV].to_numpy(), rows[DR].to_numpy(), strict=True
    ):
        r = r + v * dt + rotation.rotate(q, dr)
        plain = plain + v * dt + rotation.rotate(q, 0.5 * dv * dt)
        v = v + rotation.rotate(q, dv)
        q = rotation.compose(q, rotation.quaternion_from_rotation_vector(phi))
    true = motion.position([1.25])[0]
    # Sixth order: 2e-8 m were measured at 48 steps a cycle; 5^6 below that here.
    assert np.linalg.norm(r - true) < 1e-11
    # Half of dv for the distance is the trapezoid of the velocity: wrong by T^2/12 times the
    # change of the acceleration over the log, here from B to nothing along e.
    assert np.linalg.norm(plain - true) == pytest.approx(5.0 / 12.0 / 60.0**2, rel=0.05)


def test_a_simulated_sensor_feels_gravity_beside_it():
    motion = Sculling(20.0, 5.0, 1.0, 3.0, q_nb=SKEW)
    imu, truth = simulate_imu(motion, ImuErrors(), rate=200.0, sampling="mean")
    rows = motion_increments(imu, 4)
    q, v = truth[QUATERNION].to_numpy()[0], np.zeros(3)
    for phi, dv in zip(rows[PHI].to_numpy(), rows[DV].to_numpy(), strict=True):
        v = v + rotation.rotate(q, dv)
        q = rotation.compose(q, rotation.quaternion_from_rotation_vector(phi))
    gained = motion.velocity([3.0])[0] - [0.0, 0.0, 3.0 * STANDARD_GRAVITY]
    # Sixth order at 200 steps a cycle: (48/200)^6 of the 2.7e-7 m/s measured at 48, and gravity
    # twice the push.
    assert v == pytest.approx(gained, abs=2e-10)
    assert imu[GYRO + ACCEL].shape == (601, 6)
