"""Coning: the axis of the rate turns within the step, and what that makes drift.

Half-angle 1°, 10 Hz. The attitude is exactly ``q(t) = [cos(b/2), sin(b/2) (cos wt, sin wt, 0)]``,
and the drifts about the cone axis at a step of 10 ms were derived apart from this code (theory
notes, part A), in deg/h.
"""

from __future__ import annotations

import numpy as np
import pytest

from strapdown import rotation
from strapdown.attitude_algorithms import make_algorithm, run_attitude
from strapdown.increments import increments_from_imu
from strapdown.simulation import Coning, ImuErrors, find_scenario, simulate_imu
from strapdown.tables import QUATERNION, THETA, imu_table, increments_table

HALF_ANGLE = np.radians(1.0)
OMEGA = 2 * np.pi * 10.0


def attitude(time, half_angle=HALF_ANGLE):
    s = np.sin(half_angle / 2)
    q = np.full((len(time), 4), np.cos(half_angle / 2))
    q[:, 1], q[:, 2], q[:, 3] = s * np.cos(OMEGA * time), s * np.sin(OMEGA * time), 0.0
    return q


def rates(time, half_angle=HALF_ANGLE):
    """2 q* dq/dt, written out."""
    side = OMEGA * np.sin(half_angle)
    along = 2 * OMEGA * np.sin(half_angle / 2) ** 2
    return np.column_stack(
        [-side * np.sin(OMEGA * time), side * np.cos(OMEGA * time), np.full(len(time), -along)]
    )


def exact_increments(time, half_angle=HALF_ANGLE):
    """The integral of the rate, in closed form."""
    side = np.sin(half_angle)
    along = 2 * OMEGA * np.sin(half_angle / 2) ** 2
    angle = np.column_stack(
        [side * np.cos(OMEGA * time), side * np.sin(OMEGA * time), -along * time]
    )
    return increments_table(time[1:], np.diff(time), np.diff(angle, axis=0))


def drift(increments, variant, seconds, half_angle=HALF_ANGLE):
    """Turn about the cone axis against the truth after whole cycles, deg/h."""
    time = np.concatenate([[increments.index[0] - increments["dt"].iloc[0]], increments.index])
    truth = attitude(time, half_angle)
    run = run_attitude(make_algorithm(variant), increments, truth[0])
    error = rotation.compose(run.attitude[QUATERNION].to_numpy()[-1], rotation.conjugate(truth[-1]))
    return float(np.degrees(rotation.rotation_vector_from_quaternion(error)[2]) / seconds * 3600)


def test_the_rates_are_those_of_the_attitude():
    time = np.linspace(0.0, 0.1, 100_001)
    increments = increments_from_imu(imu_table(time, rates(time)))
    # Trapezoid of order 2: halving 1 µs changes nothing that shows.
    assert abs(drift(increments, "quaternion", 0.1)) < 1e-3


@pytest.mark.parametrize(
    ("source", "variant", "expected", "digits"),
    [
        ("increments", "naive", -1974.0, 0),
        ("increments", "quaternion", -127.3, 1),
        ("increments", "dcm", -127.3, 1),
        ("rates", "quaternion", -247.6, 1),
        ("rates", "dcm", -247.6, 1),
        ("rates", "euler:step=rk4", -126.0, 0),
        ("rates", "rk4", -126.0, 0),
        ("rates", "rotvec:samples=1", -126.0, 0),
        ("rectangles", "quaternion", -65.0, 0),
        ("increments", "rk4", -127.3, 1),
        ("increments", "rotvec:samples=1", -127.3, 1),
        ("increments", "rotvec", -9.78, 2),
        ("increments", "rotvec:samples=3", -0.81, 2),
        ("increments", "rotvec:samples=4", -0.12, 2),
    ],
)
def test_the_drift_at_10_ms(source, variant, expected, digits):
    time = np.arange(1201) * 0.01  # whole blocks of 2, 3 and 4
    if source == "increments":
        increments = exact_increments(time)
    else:
        # A rate at the stamp, taken for the mean of the step: the rectangular rule.
        sampling = "mean" if source == "rectangles" else "instantaneous"
        increments = increments_from_imu(imu_table(time, rates(time), sampling=sampling))
    assert drift(
        increments, variant, increments.index[-1] - (0.01 * (source == "rectangles"))
    ) == pytest.approx(expected, abs=0.51 * 10**-digits)


def residual(source, previous, step):
    """What a step lacks of the solid angle of its cone, over beta^2, by its phase x.

    The attitude turns about the cone axis by ``x / 2`` a step. Increments, chords of a circle that
    turn by x from one to the next, compose to ``sin(x) / 2``; trapezoids are shorter than them by
    ``(x / 2) cot(x / 2)``, and the change of their rates adds ``x^2 sin(x) / 12``.
    """
    x = OMEGA * step
    short, own = 1.0, 0.0
    if source == "rates":
        short, own = 0.5 * x / np.tan(0.5 * x), x * x * np.sin(x) / 12.0
    composed = 0.5 * np.sin(x) + (2.0 * np.sin(x) - np.sin(2.0 * x)) / 12.0 * previous
    return 0.5 * x - short**2 * composed - own


@pytest.mark.parametrize("source", ["increments", "rates"])
@pytest.mark.parametrize("step", [0.01, 0.004])
def test_drift_of_one_increment_that_knows_the_one_before(source, step):
    time, half_angle = np.arange(round(6.0 / step) + 1) * step, np.radians(0.1)
    if source == "increments":
        increments = exact_increments(time, half_angle)
    else:
        increments = increments_from_imu(imu_table(time, rates(time, half_angle)))
    # The first step has none before it.
    steps = len(time) - 1
    lacks = residual(source, 1, step) * (steps - 1) + residual(source, 0, step)
    expected = -np.degrees(half_angle**2 * lacks) / time[-1] * 3600
    found = drift(increments, "rotvec:samples=1,previous=yes", time[-1], half_angle)
    # Products of three increments are beta^2 of it.
    assert found == pytest.approx(expected, rel=1e-4)
    # A residual of x^5 / 60 of increments, x^5 / 36 of chords: order 4 of either.
    x = OMEGA * step
    size = {"increments": x**5 / 60, "rates": x**5 / 36}[source]
    assert residual(source, 1, step) == pytest.approx(size, rel=0.3 * x * x)


def test_steps_of_any_length_keep_the_order_of_what_the_increment_before_corrects():
    errors = []
    for step in (0.1 / 24, 0.1 / 48):
        lengths = step * np.random.default_rng(1).uniform(0.5, 1.5, round(6 / step))
        time = np.concatenate([[0.0], np.cumsum(lengths)])
        run = run_attitude(
            make_algorithm("rotvec:samples=1,previous=yes"),
            exact_increments(time),
            attitude(time)[0],
        )
        last = run.attitude[QUATERNION].to_numpy()[-1]
        errors.append(float(rotation.rotation_angle(last, attitude(time)[-1])))
    # The steps of the two are other draws, of 1440 and 2880.
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.2)


def test_increment_before_a_gap_or_in_a_burst_corrects_nothing():
    time = np.cumsum([0.0, 0.01, 0.01, 0.031, 0.0103, 0.0034, 0.0034])
    found, plain = (
        run_attitude(make_algorithm(v), exact_increments(time)).attitude[QUATERNION].to_numpy()
        for v in ("rotvec:samples=1,previous=yes", "rotvec:samples=1")
    )
    turns = [rotation.compose(rotation.conjugate(q[:-1]), q[1:]) for q in (found, plain)]
    apart = rotation.rotation_angle(*turns)
    alike = np.array([False, True, False, False, False, True])
    assert (apart[~alike] < 1e-13).all()
    assert (apart[alike] > 1e-6).all()


@pytest.mark.parametrize(
    ("variant", "half_angle_deg"),
    [
        *(("quaternion", 1.0), ("euler:step=rk4", 1.0), ("rk4", 1.0), ("dcm", 1.0)),
        ("rotvec:samples=1,previous=yes", 0.1),
        *(("rotvec:samples=1", 1.0), ("rotvec", 0.1), ("rotvec:samples=3", 0.02)),
        # At 1 deg products of three increments, of order 4, hide the coefficients' eighth.
        *(("rotvec:samples=4", 0.02), ("rotvec:samples=3,coefficients=fit", 0.02)),
        ("rotvec:samples=4,coefficients=fit", 0.02),
    ],
)
def test_the_order_of_the_drift_that_it_declares(variant, half_angle_deg):
    half_angle, drifts = np.radians(half_angle_deg), []
    steps = np.array([0.1 / 12, 0.1 / 24])
    for step in steps:
        # A whole number of cycles, and of blocks.
        time = np.arange(round(1.2 / step) + 1) * step
        drifts.append(drift(exact_increments(time, half_angle), variant, time[-1], half_angle))
    slope = np.log(drifts[0] / drifts[1]) / np.log(steps[0] / steps[1])
    # The next term is (2 pi/12 samples)^2 of the first times a number of the order of 1: 0.27
    # at the longer step, which moves a two-point fit by about 0.2; the next even order is 2 off.
    assert slope == pytest.approx(make_algorithm(variant).accuracy.coning, abs=0.35)


def test_at_a_wide_cone_four_increments_fall_to_six():
    """At 1 deg the neglected products of three increments take over from the eighth order.

    The compressed form of the same coefficients, ``(54 a + 92 b + 214 c)/105 x d``, falls to
    four there, because it integrates a rate that changes direction unevenly less well.
    """
    ours, compressed = [], []
    for step in (0.1 / 96, 0.1 / 192):
        time = np.arange(round(1.2 / step) + 1) * step
        increments = exact_increments(time)
        ours.append(drift(increments, "rotvec:samples=4", time[-1]))
        a, b, c, d = np.moveaxis(increments[THETA].to_numpy().reshape(-1, 4, 3), 1, 0)
        vector = a + b + c + d + np.cross((54 * a + 92 * b + 214 * c) / 105, d)
        blocks = increments_table(time[4::4], np.full(len(vector), 4 * step), vector)
        compressed.append(drift(blocks, "quaternion", time[-1]))
    assert np.log2(ours[0] / ours[1]) == pytest.approx(6.0, abs=0.1)
    assert np.log2(compressed[0] / compressed[1]) == pytest.approx(4.0, abs=0.2)


def test_cubic_rates_beat_the_trapezoid():
    """Order 4 against 2; the drift that is left at 10 ms is a twelfth of the trapezoid's."""
    time = np.arange(1201) * 0.01
    imu = imu_table(time, rates(time))
    by = {
        interpolation: drift(increments_from_imu(imu, interpolation), "rotvec:samples=1", 12.0)
        for interpolation in ("linear", "cubic")
    }
    assert by["linear"] == pytest.approx(-126.1, abs=0.1)
    assert abs(by["cubic"]) < abs(by["linear"]) / 10


def test_the_scenario_is_this_motion():
    motion = find_scenario("coning").motion
    time = np.linspace(0.0, 60.0, 4001)
    # Six hundred cycles: the phase is known to 2 pi 600 x 1e-16 = 4e-13 here, where no whole
    # cycles are taken away, times the sine of half a degree or the rate of 1.1 rad/s.
    assert np.abs(motion.attitude(time) - attitude(time)).max() < 1e-14
    assert np.abs(motion.rate(time) - rates(time)).max() < 1e-12
    whole = increments_table(time[1:], np.diff(time), np.diff(motion.angle(time), axis=0))
    known = exact_increments(time)
    assert np.abs(whole.to_numpy() - known.to_numpy()).max() < 3e-14


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (1.0, -2.0, 3.0)])
@pytest.mark.parametrize(("sampling", "expected"), [("mean", -127.3), ("instantaneous", -247.6)])
def test_the_drift_is_about_the_cone_axis_wherever_it_points(axis, sampling, expected):
    motion = Coning(1.0, 10.0, 10.0, axis=axis, q_nb=(0.5, 0.5, -0.5, 0.5))
    imu, truth = simulate_imu(motion, ImuErrors(), rate=100.0, sampling=sampling)
    q = truth[QUATERNION].to_numpy()
    run = run_attitude(make_algorithm("quaternion"), increments_from_imu(imu), q[0])
    final = run.attitude[QUATERNION].to_numpy()[-1]
    # Seen from the mean attitude, in whose axes the cone axis is the one that is given.
    mean = rotation.conjugate(motion.q_nb)
    error = rotation.rotation_vector_from_quaternion(
        rotation.compose(
            rotation.compose(mean, final), rotation.conjugate(rotation.compose(mean, q[-1]))
        )
    )
    along = error @ np.array(axis) / np.linalg.norm(axis)
    assert np.degrees(along) / 10.0 * 3600 == pytest.approx(expected, abs=0.051)
    assert np.linalg.norm(error) == pytest.approx(abs(along), rel=1e-3)


@pytest.mark.parametrize("name", ["coning", "coning-slow"])
def test_the_naive_drift_is_the_solid_angle(name):
    """Each cycle leaves 2 pi (1 - cos(half-angle)) of a turn that never was."""
    motion = find_scenario(name).motion
    cycles = motion.frequency * motion.duration
    solid = 2 * np.pi * (1 - np.cos(np.radians(motion.half_angle))) * cycles
    # Whole cycles: nothing is left about the other two axes.
    assert np.abs(motion.angle([motion.duration])[0] - [0, 0, -solid]).max() < 1e-12
