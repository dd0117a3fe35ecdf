"""A second sensor on the same body: clock and mounting found again, and as well as it says."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown import rotation
from strapdown.errors import DataError
from strapdown.evaluation.second_log import (
    align_second_log,
    coarse_offset,
    first_clock,
    second_clock,
    truth_from_second_log,
)
from strapdown.tables import QUATERNION, attitude_table, imu_table

OFFSET, DRIFT = 0.1237, 50e-6  # s; 50 ppm
MOUNTING = rotation.quaternion_from_euler([30.0, -20.0, 75.0])  # q_12
BIAS_1, BIAS_2 = np.array([0.01, -0.02, 0.005]), np.array([-0.004, 0.003, 0.008])  # rad/s


class Motion:
    """Euler angles as Fourier series: attitude and body rate exact at every instant."""

    def __init__(self, seed=0, *, axes=(1, 1, 1), size=25.0, lines=12, band=1.5):
        rng = np.random.default_rng(seed)
        self.frequency = rng.uniform(0.05, band, size=(3, lines))
        self.phase = rng.uniform(0, 2 * np.pi, size=(3, lines))
        self.size = np.radians(size) * rng.normal(size=(3, lines)) * np.asarray(axes)[:, None]
        self.size /= 1.0 + 2.0 * self.frequency

    def _angles(self, time):
        w = 2 * np.pi * self.frequency
        at = w[..., None] * time + self.phase[..., None]
        value = (self.size[..., None] * np.sin(at)).sum(axis=1)
        slope = ((self.size * w)[..., None] * np.cos(at)).sum(axis=1)
        return value, slope

    def attitude(self, time):
        return rotation.quaternion_from_euler(np.degrees(self._angles(time)[0]).T)

    def rate(self, time):
        """Body rate of 3-2-1 angles: the inverse of Alexiev's (8)-(10)."""
        (roll, pitch, _), (dr, dp, dh) = self._angles(time)
        return np.column_stack(
            [
                dr - np.sin(pitch) * dh,
                np.cos(roll) * dp + np.sin(roll) * np.cos(pitch) * dh,
                -np.sin(roll) * dp + np.cos(roll) * np.cos(pitch) * dh,
            ]
        )


def two_logs(
    motion,
    *,
    seconds=60.0,
    rates=(100.0, 128.0),
    noise=(2e-3, 2e-3),
    scale=1.0,
    seed=1,
    drift=DRIFT,
):
    """The first on the true clock; the second late, fast, turned, biased and noisy."""
    rng = np.random.default_rng(seed)
    middle = seconds / 2
    one = np.arange(2.0, seconds - 2.0, 1 / rates[0])
    two = np.arange(0.0, seconds, 1 / rates[1])
    # u = t + offset + drift (t - middle)
    true = middle + (two - middle - OFFSET) / (1 + drift)
    gyro_1 = motion.rate(one) + BIAS_1
    gyro_2 = rotation.rotate(rotation.conjugate(MOUNTING), motion.rate(true)) / scale + BIAS_2
    return (
        imu_table(one, gyro_1 + noise[0] * rng.normal(size=gyro_1.shape)),
        imu_table(two, gyro_2 + noise[1] * rng.normal(size=gyro_2.shape)),
    )


def offset_at(time, seconds, drift=DRIFT):
    """The true offset at an instant, for the middle that the fit happened to choose."""
    return OFFSET + drift * (time - seconds / 2)


def mounting_error(found):
    """Rotation vector from the true to the found mounting, in the first axes, deg."""
    return np.degrees(
        rotation.rotation_vector_from_quaternion(
            rotation.compose(found.mounting, rotation.conjugate(MOUNTING))
        )
    )


@pytest.mark.parametrize("rates", [(100.0, 128.0), (100.0, 100.0), (200.0, 50.0)])
def test_without_noise_all_is_found_to_the_error_of_interpolation(rates):
    """Cubic splines at 50 Hz and more of 1.5 Hz and its combinations (to about 10 Hz).

    A spline through 20 samples a period is off by (2π/20)⁴/720 or so, 1.4e-5; at 5 Hz at 50 Hz
    it is 2e-4 of a component that holds a hundredth of the rate. So 1e-4 of the rate, of which
    most averages out: offsets to 1e-5 s, mounting to 5e-3 deg.
    """
    first, second = two_logs(Motion(), rates=rates, noise=(0, 0), scale=1.002)
    found = align_second_log(first, second)
    assert found.offset == pytest.approx(offset_at(found.middle, 60.0), abs=1e-5)
    assert found.drift_ppm == pytest.approx(50.0, abs=1.0)
    assert np.abs(mounting_error(found)).max() < 5e-3
    assert found.scale == pytest.approx(1.002, abs=1e-4)
    expected = BIAS_1 - 1.002 * rotation.rotate(MOUNTING, BIAS_2)
    assert found.bias == pytest.approx(expected, abs=1e-5)
    assert found.axis is None


@pytest.mark.slow
def test_errors_are_as_large_as_their_sd_says():
    """60 draws of noise, 9 figures: each mean square ratio within 1 ± 4 √(2/60) or less.

    The covariance is estimated from 56 blocks and 9 figures, which spreads it by √(2/47), 20 %
    in each run, and leaves its mean right to some per cent.
    """
    ratios = []
    for seed in range(60):
        first, second = two_logs(Motion(), rates=(50.0, 64.0), noise=(5e-3, 3e-3), seed=seed)
        found = align_second_log(first, second)
        bias = BIAS_1 - rotation.rotate(MOUNTING, BIAS_2)
        ratios.append(
            [
                (found.offset - offset_at(found.middle, 60.0)) / found.offset_sd,
                (found.drift_ppm - 50.0) / found.drift_sd_ppm,
                *(mounting_error(found) / found.mounting_sd_deg),
                *((np.array(found.bias) - bias) / found.bias_sd),
                (found.scale - 1.0) / found.scale_sd,
            ]
        )
    square = np.mean(np.square(ratios), axis=0)
    assert np.abs(square - 1.0).max() < 4 * np.sqrt(2 / 60), square
    # Nine figures together are known better.
    assert abs(square.mean() - 1.0) < 4 * np.sqrt(2 / 540) + 0.1, square


def test_a_large_drift_over_a_long_log_is_followed():
    """500 ppm over 300 s, 0.15 s from end to end: no one offset fits both ends."""
    first, second = two_logs(Motion(3), seconds=300.0, rates=(50.0, 50.0), drift=500e-6)
    found = align_second_log(first, second)
    assert found.drift_ppm == pytest.approx(500.0, abs=5 * found.drift_sd_ppm)
    assert found.drift_sd_ppm < 1.0
    expected = offset_at(found.middle, 300.0, 500e-6)
    assert found.offset == pytest.approx(expected, abs=5 * found.offset_sd)


def test_clocks_of_another_epoch_and_another_length():
    first, second = two_logs(Motion(2))
    late = second.set_axis(second.index + 1.6e9, axis="index")
    late.index.name, late.attrs = "time", second.attrs
    part = first[(first.index > 20) & (first.index < 45)]
    part.attrs = first.attrs
    found = align_second_log(part, late)
    expected = offset_at(found.middle, 60.0) + 1.6e9
    # Stamps of this size carry 2.4e-7 s.
    assert found.offset == pytest.approx(expected, abs=5 * found.offset_sd + 5e-7)


def test_the_truth_is_the_attitude_of_the_first_sensor():
    motion = Motion()
    first, second = two_logs(motion, rates=(100.0, 500.0), noise=(2e-3, 0.0))
    found = align_second_log(first, second)
    begin = first.index[0]
    truth = truth_from_second_log(
        found, first, second, gyro_bias=BIAS_2, q_start=motion.attitude(np.array([begin]))[0]
    )
    exact = motion.attitude(truth.index.to_numpy())
    error = rotation.rotation_angle(truth[QUATERNION].to_numpy(), exact)
    # Trapezoid at 500 Hz: h²/12 of the change of ω', at most 60 rad/s², 2e-5 rad; coning the
    # same. The mounting counts twice and the time with the largest rate.
    sd = 2 * np.linalg.norm(found.mounting_sd_deg)
    sd += np.degrees(np.abs(motion.rate(truth.index.to_numpy())).max()) * found.offset_sd
    assert error.max() < 4 * sd + 0.01


def test_an_attitude_of_the_second_log_is_taken_over():
    motion = Motion()
    first, second = two_logs(motion, noise=(0, 0))
    found = align_second_log(first, second)
    u = second.index.to_numpy()
    true = 30.0 + (u - 30.0 - OFFSET) / (1 + DRIFT)
    q_n2 = rotation.compose(motion.attitude(true), MOUNTING)
    truth = truth_from_second_log(found, first, second, attitude=attitude_table(u, q_n2))
    exact = motion.attitude(truth.index.to_numpy())
    # Between stamps the rate is taken for constant: h²/8 of its largest change. The rest of the
    # error is the offset's, 1e-5 s of the largest rate, and the mounting's, 5e-3 deg an axis.
    rate = motion.rate(u)
    change = np.linalg.norm(np.gradient(rate, u, axis=0), axis=1).max()
    bound = np.degrees((1 / 128.0) ** 2 / 8 * change + 1e-5 * np.linalg.norm(rate, axis=1).max())
    error = rotation.rotation_angle(truth[QUATERNION].to_numpy(), exact).max()
    assert error < bound + 5e-3 * np.sqrt(3)
    assert second_clock(found, [found.middle])[0] == found.middle + found.offset
    # There and back, to a few roundings of 60 s.
    assert first_clock(found, second_clock(found, u)) == pytest.approx(u, abs=1e-13)


def test_one_axis_only_is_said():
    first, second = two_logs(Motion(axes=(0, 0, 1)))
    found = align_second_log(first, second)
    assert found.axis is not None
    assert abs(found.axis[2]) == pytest.approx(1.0, abs=1e-3)
    assert found.offset == pytest.approx(offset_at(found.middle, 60.0), abs=5 * found.offset_sd)
    # The axis itself is found: what turns it is known, what turns about it is not.
    down = rotation.rotate(rotation.conjugate(MOUNTING), [0.0, 0.0, 1.0])
    there = rotation.rotate(rotation.conjugate(found.mounting), [0.0, 0.0, 1.0])
    assert np.degrees(np.arccos(min(1.0, down @ there))) < 0.1
    assert np.isinf(found.mounting_sd_deg[2])
    with pytest.raises(DataError, check=coded("evaluation.body-turned-about-axis-only")):
        truth_from_second_log(found, first, second)


def test_two_motions_that_have_nothing_to_do_with_each_other_are_refused():
    first, _ = two_logs(Motion(1))
    _, second = two_logs(Motion(2))
    with pytest.raises(
        DataError,
        check=lambda refused: refused.finding.code == "evaluation.rates-two-logs-little-common",
    ):
        align_second_log(first, second)


def test_a_motion_that_repeats_itself_is_refused():
    motion = Motion()
    motion.frequency[:] = 0.5
    first, second = two_logs(motion)
    with pytest.raises(
        DataError,
        check=lambda refused: refused.finding.code == "evaluation.offsets-do-about-well-motion",
    ):
        coarse_offset(first, second)


def test_logs_at_rest_are_refused():
    first, second = two_logs(Motion(size=0.0))
    with pytest.raises(
        DataError,
        check=lambda refused: refused.finding.code == "evaluation.log-hardly-turns-rates-scatter",
    ):
        align_second_log(first, second)
