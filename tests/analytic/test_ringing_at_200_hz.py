"""What structural ringing does to samples at 200 Hz, from formulas and from runs.

Ringing moves nothing for good, so that whatever velocity its samples add up to is false. Sampled
at instants, ``x = Im sum c_j exp(s_j t)`` gives the velocity
``h Im sum c_j s_j² q_j/(1 - exp(s_j h))`` with q_j the exponential at the first sample: a geometric
series, whose size is that of the alias.
Theory's numbers (1.03 m for 10 g at 195 Hz, 0.21 m for 10 g at 120 Hz, 0.05 m for 5 g at 300 Hz,
each decaying in 30 ms, over 750 ms) depend on where the ringing begins between two samples. The
quadratic mean over all such phases, for ringing that begins 50 ms after the start, is 1.05, 0.21
and 0.08 m.

For ringing that begins with the pulse of the crash, at 100 ms of 750 ms, quadratic mean and largest
of ten phases (what the filter's delay alone does to the crash, 58, 23 and 14 mm, is taken off):

====================  ===========  ============  ============  ============  ============
m                     instants     means         20 Hz filter  50 Hz filter  80 Hz filter
====================  ===========  ============  ============  ============  ============
10 g at 195 Hz        0.98, 1.45   0.001, 0.002  0.10, 0.14    0.24, 0.33    0.36, 0.51
10 g at 120 Hz        0.20, 0.36   0.000, 0.000  0.02, 0.03    0.04, 0.07    0.07, 0.11
5 g at 300 Hz         0.08, 0.18   0.000, 0.000  0.00, 0.01    0.01, 0.01    0.01, 0.02
====================  ===========  ============  ============  ============  ============
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown, run_mechanization
from strapdown.nav_state import NavState
from strapdown.simulation import (
    CrashMotion,
    HaversinePulse,
    ImuErrors,
    MountedMotion,
    Origin,
    Ringing,
    TriadErrors,
    simulate_imu,
)

STEP, END, DECAY = 0.005, 0.75, 0.03
PLACE = Origin(45.0, 20.0, 100.0)
BLOW = HaversinePulse(0.1, 0.113, (-7.2, 0.0, 0.0), (0.0, 0.0, 87.0))
CRASH = CrashMotion(END, PLACE, (7.1, 0.0, 0.0), (BLOW,))
STRAIGHT = CrashMotion(END, PLACE, (7.1, 0.0, 0.0))
CASES = [(195.0, 98.0665), (120.0, 98.0665), (300.0, 49.03325)]


def exponentials(ringing):
    w = 2.0 * math.pi * ringing.frequency
    s = np.array([complex(-1.0 / ringing.decay - k * w, w) for k in range(3)])
    size = ringing.amplitude / (w * w + ringing.decay**-2)
    return size * np.array([1.0, -2.0, 1.0]), s


def sampled_way(ringing):
    """Way that the samples from zero to the end add up to, by the series; m.

    Trapezoids twice: each sample counts for the time that is left, ``h sum (T - t_k) a_k``.
    """
    c, s = exponentials(ringing)
    first = math.ceil(round(ringing.start / STEP, 9))
    count = round(END / STEP) - first
    q, r = np.exp(s * (first * STEP - ringing.start)), np.exp(s * STEP)
    # sum of r^k and of k r^k below `count`, for the samples of weight T - t = (count - k) h.
    geometric = (1.0 - r**count) / (1.0 - r)
    rising = r * (1.0 - count * r ** (count - 1) + (count - 1) * r**count) / (1.0 - r) ** 2
    way = c * s**2 * q * (count * geometric - rising) * STEP * STEP
    return float(way.imag.sum())


def along(motion, *, sampling="instantaneous", bandwidth=math.inf, interpolation="linear"):
    """Error of the last place, north, east, down in m."""
    triad = TriadErrors(bandwidth=bandwidth)
    # The gyro is behind the same filter; turning and force are then late together.
    imu, _ = simulate_imu(motion, ImuErrors(triad, triad), rate=1.0 / STEP, sampling=sampling)
    truth = motion.trajectory(imu.index)
    increments = motion_increments(imu, interpolation=interpolation)
    run = run_mechanization(NorthEastDown(), NavState.from_trajectory(truth), increments)
    place = ["lat", "lon", "alt"]
    apart = run.trajectory.iloc[-1][place] - truth.iloc[-1][place]
    return apart.to_numpy(dtype=float) * [111.13e3, 78.85e3, -1.0]


@pytest.mark.parametrize("phase", [0.0, 0.23, 0.6])
@pytest.mark.parametrize(("frequency", "amplitude"), CASES)
def test_a_formula_predicts_the_false_way(frequency, amplitude, phase):
    ringing = Ringing(0.1 + phase * STEP, amplitude, frequency, DECAY)
    error = along(MountedMotion(STRAIGHT, ringing=(ringing,)))
    # 0.05 %: metres of a degree; and the double integral of straight lines between the samples,
    # which differs from the trapezoids' by h²/12 of each change of force, 0.2 mm. The last of the
    # true displacement is e^-21 of 65 um.
    assert error[0] == pytest.approx(sampled_way(ringing), rel=5e-4, abs=3e-4)
    # The Earth turns a false velocity: 2 w sin(lat) t/2 of the way.
    assert abs(error[1]) < 4e-5 * abs(error[0]) + 1e-8


def rms(ways):
    return float(np.sqrt(np.mean(np.square(ways))))


@pytest.mark.parametrize(
    ("frequency", "amplitude", "theory", "mean"),
    [(195.0, 98.0665, 1.03, 1.05), (120.0, 98.0665, 0.21, 0.21), (300.0, 49.03325, 0.05, 0.076)],
)
def test_theory_numbers_are_within_what_the_phase_makes(frequency, amplitude, theory, mean):
    phases = (np.arange(100) + 0.5) / 100.0
    ways = [sampled_way(Ringing(0.05 + p * STEP, amplitude, frequency, DECAY)) for p in phases]
    # To the digits told; over a hundred phases the mean of a smooth period is exact.
    assert rms(ways) == pytest.approx(mean, rel=0.02)
    assert np.abs(ways).min() < theory < np.abs(ways).max()


@pytest.mark.parametrize(("frequency", "amplitude"), CASES)
def test_a_bare_sine_as_acceleration_would_leave_a_velocity(frequency, amplitude):
    # The other reading, a = a0 exp(-t/T) sin(w t): 5 to 13 cm/s for ever, which no structure does.
    w = 2.0 * math.pi * frequency
    x, weight = np.polynomial.legendre.leggauss(20)
    edges = np.arange(0.0, 1.0, 1e-3)
    t = (edges[:, None] + 5e-4 * (1.0 + x)).ravel()
    bare = amplitude * np.exp(-t / DECAY) * np.sin(w * t)
    left = float(np.tile(5e-4 * weight, edges.size) @ bare)
    assert left == pytest.approx(amplitude * w / (w * w + DECAY**-2), rel=1e-12)
    assert left * 0.65 > 0.015


def test_bare_sine_from_the_grid_has_the_first_of_theorys_numbers():
    # From 50 ms on, sampled from its beginning: the alias of 195 Hz is 5 Hz. 1.03 m to the digit;
    # the others are 0.15 and 0.02 m, where theory has 0.21 and 0.05.
    found = []
    for frequency, amplitude in CASES:
        s = complex(-1.0 / DECAY, 2.0 * math.pi * frequency)
        t, left = np.arange(0.0, 0.70001, STEP), 0.7
        sampled = STEP * np.sum((left - t) * np.imag(amplitude * np.exp(s * t)))
        true = np.imag(amplitude * (np.exp(s * left) - 1.0 - s * left) / s**2)
        found.append(abs(sampled - true))
    np.testing.assert_allclose(found, [1.033, 0.146, 0.018], atol=6e-4)


@pytest.mark.parametrize(("frequency", "amplitude"), CASES)
def test_true_means_and_a_filter_keep_most_of_it_out(frequency, amplitude):
    quiet = {b: along(MountedMotion(CRASH), bandwidth=b) for b in (math.inf, 50.0)}
    worst = {"instantaneous": 0.0, "mean": 0.0, "filter": 0.0}
    for phase in (0.1, 0.35, 0.6, 0.85):
        ringing = Ringing(0.15 + phase * STEP, amplitude, frequency, DECAY)
        motion = MountedMotion(CRASH, ringing=(ringing,))
        errors = {
            "instantaneous": along(motion) - quiet[math.inf],
            "mean": along(motion, sampling="mean"),
            "filter": along(motion, bandwidth=50.0) - quiet[50.0],
        }
        for name, error in errors.items():
            worst[name] = max(worst[name], float(np.linalg.norm(error)))
    # Means over the sample lose no velocity. What is left is the way within a step that a line
    # through the means misses, h²/12 of a change of force of the amplitude, for each step of the
    # decay, and as much again for the steps that this line takes from.
    assert worst["mean"] < 2.0 * amplitude * STEP**2 / 12.0 * (DECAY / STEP)
    # A pole at 50 Hz passes 1/sqrt(1 + (f/50)²) of the oscillation.
    passes = 1.0 / math.hypot(1.0, frequency / 50.0)
    assert 0.3 * passes < worst["filter"] / worst["instantaneous"] < 3.0 * passes
    assert worst["mean"] < 0.02 * worst["filter"]
