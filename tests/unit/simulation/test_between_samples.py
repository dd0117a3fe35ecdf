"""Quadratures that are cut where a quantity is not smooth."""

from __future__ import annotations

import math

import numpy as np
import pytest

from strapdown.sensors.error_chain import time_constant
from strapdown.simulation import (
    CrashMotion,
    ImuErrors,
    MountedMotion,
    Origin,
    Ringing,
    simulate_imu,
)
from strapdown.simulation.imu import low_passed, low_passed_at, mean_between, mean_over

STILL = CrashMotion(1.0, Origin(45.0, 20.0, 100.0))
RINGING = Ringing(0.1031, 98.0665, 195.0, 0.03, (1.0, -2.0, 2.0))
STAMPS = np.arange(201) / 200.0


def corner(time):
    return np.column_stack([np.maximum(time - 0.313, 0.0), np.abs(time - 0.5), time])


def test_a_corner_on_a_cut_is_exact():
    found = mean_between(corner, STAMPS, [0.313, 0.5])
    a, b = STAMPS[:-1], STAMPS[1:]
    ramp = (np.maximum(b - 0.313, 0.0) ** 2 - np.maximum(a - 0.313, 0.0) ** 2) / (2.0 * (b - a))
    # The difference of two squares of up to 0.47 is rounded, over a step of 5 ms.
    np.testing.assert_allclose(found[:, 0], ramp, rtol=0.0, atol=3e-14)
    # Off a cut it is not.
    assert np.abs(mean_between(corner, STAMPS, ())[:, 0] - ramp).max() > 1e-7


def test_without_cuts_between_the_stamps_nothing_changes():
    for cuts in ((), (-1.0, 0.0, 0.25, 1.0, 7.0)):
        np.testing.assert_array_equal(
            mean_between(corner, STAMPS, cuts), mean_over(corner, STAMPS[:-1], STAMPS[1:])
        )
        np.testing.assert_array_equal(
            low_passed_at(corner, STAMPS, 40.0, cuts), low_passed(corner, STAMPS, 40.0)
        )
    np.testing.assert_array_equal(low_passed_at(corner, STAMPS, math.inf, (0.3,)), corner(STAMPS))


def felt(ringing, **options):
    imu, _ = simulate_imu(MountedMotion(STILL, ringing=ringing), ImuErrors(), rate=200.0, **options)
    return imu[["accel_x", "accel_y", "accel_z"]].to_numpy()


def test_true_means_of_ringing_are_changes_of_its_velocity():
    mean = (felt((RINGING,), sampling="mean") - felt((), sampling="mean"))[1:]
    # The Earth's rate makes nothing of 0.08 m/s: 2 w v is 1e-5 m/s².
    exact = np.diff(RINGING.velocity(STAMPS), axis=0) * 200.0
    np.testing.assert_allclose(mean, exact, rtol=0.0, atol=1.2e-5)
    assert np.abs(exact).max() > 1.0


@pytest.mark.parametrize("step", [0.0125, 2.9, 5.9, 6.1, 13.0, 39.0, 41.0, 400.0])
@pytest.mark.parametrize("turn", [0.01, 0.3, 1.0, 2.0])
def test_a_turning_vector_behind_a_pole_is_its_closed_form_for_any_step(step, turn):
    """`step` in time constants; `turn` in rad per time constant: rounding is of the phase."""
    tau = time_constant(300.0)
    stamps = np.arange(50) * (step * tau)
    phase = turn * stamps / tau
    found = low_passed(
        lambda s: np.column_stack([np.cos(turn * s / tau), np.sin(turn * s / tau), 1.0 + 0.0 * s]),
        stamps,
        300.0,
    )
    gain = 1.0 / (1.0 + 1j * turn)
    exact = gain * np.exp(1j * phase) + (1.0 - gain) * np.exp(-stamps / tau)
    within = 8e-12 * (turn / 2.0) ** 12 + 4e-16 * (4.0 + phase.max())
    np.testing.assert_allclose(found[:, 0], exact.real, rtol=0.0, atol=within)
    np.testing.assert_allclose(found[:, 1], exact.imag, rtol=0.0, atol=within)
    np.testing.assert_allclose(found[:, 2], 1.0, rtol=0.0, atol=2e-15)


@pytest.mark.parametrize("bandwidth", [20.0, 80.0, 500.0])
def test_ringing_behind_a_pole_is_its_closed_form(bandwidth):
    found = low_passed_at(RINGING.acceleration, STAMPS, bandwidth, RINGING.quarters())
    tau, w = time_constant(bandwidth), 2.0 * math.pi * 195.0
    size = 98.0665 / (w * w + 0.03**-2)
    since = np.maximum(STAMPS - RINGING.start, 0.0)
    exact = np.zeros(since.size)
    for k, part in enumerate((1.0, -2.0, 1.0)):
        s = complex(-1.0 / 0.03 - k * w, w)
        after = (np.exp(s * since) - np.exp(-since / tau)) / (1.0 + s * tau)
        exact += size * part * (s * s * after).imag
    # Six nodes in a quarter of a period, in which the fastest part turns and falls by 3.5:
    # 2e-9 of four parts of the amplitude.
    np.testing.assert_allclose(found, np.outer(exact, RINGING.direction), rtol=0.0, atol=1e-6)
