"""The W-D filter of each channel beside the robust digital filter: where each is good."""

import numpy as np
import pytest

from strapdown.errors import DataError
from strapdown.estimation.robust import LeastSquares, RobustUpdate
from strapdown.prefilter import RobustFir, RobustWd
from strapdown.tables import imu_table

STEP = 1e-3


def log(motion, noise, seed=1):
    rng = np.random.default_rng(seed)
    values = motion[:, None] + noise * rng.standard_normal((len(motion), 6))
    return imu_table(STEP * np.arange(len(motion)), values[:, :3], values[:, 3:])


def test_at_rest_outliers_move_it_little():
    """One sample of 1000 standard deviations pulls Huber's filter as one of 1.4 would."""
    imu = log(np.zeros(5000), 1.0)
    bad = imu.copy()
    bad.iloc[2500, 0] += 1000.0
    prefilter = RobustWd()
    moved = (prefilter.apply(bad).imu - prefilter.apply(imu).imu)["gyro_x"]
    # Without a rule a sample counts pole step/(2 sqrt 2) = 0.044 at its own time, 44 in all; here
    # as one of 1.35, and what it was before, of three standard deviations at most, is gone.
    assert np.abs(moved).max() < 0.0445 * (1.35 + 3.0)
    plain = RobustWd(rule=RobustUpdate(LeastSquares()))
    moved = (plain.apply(bad).imu - plain.apply(imu).imu)["gyro_x"]
    assert np.abs(moved).max() > 35.0


def test_motion_beyond_its_model_is_taken_for_outliers():
    """A swing of 5 Hz and 1000 standard deviations: the W-D filter lags, the other does not."""
    t = STEP * np.arange(6000)
    swing = 1000.0 * np.sin(2.0 * np.pi * 5.0 * t)
    imu = log(swing, 1.0)
    fir, wd = RobustFir().apply(imu), RobustWd().apply(imu)
    assert fir.report.replaced.empty
    number = np.round(fir.imu.index.to_numpy() / STEP).astype(int)
    assert np.abs(fir.imu["gyro_x"].to_numpy() - swing[number]).max() < 1000.0 * 1e-4 + 5.0 * 0.265
    number = np.round(wd.imu.index.to_numpy() / STEP).astype(int)
    assert np.abs(wd.imu["gyro_x"].to_numpy() - swing[number])[50:-50].max() > 100.0
    assert len(wd.report.replaced) > 1000
    assert {f.quantity for f in wd.report.findings} == set(imu.columns)


def test_filter_alone_has_phase_and_is_not_late():
    assert RobustWd(smooth=False).apply(log(np.zeros(2000), 1.0)).report.latency == 0.0
    # At 20 Hz (1 + i sqrt 2)/(i sqrt 2): atan sqrt 2 less a right angle.
    response = RobustWd(smooth=False).signal.response(np.array([20.0]))
    assert np.degrees(np.angle(response))[0] == pytest.approx(-35.264, abs=1e-3)


def test_no_noise_is_refused():
    imu = log(np.zeros(2000), 0.0)
    with pytest.raises(DataError) as error:
        RobustWd().apply(imu)
    assert error.value.finding.quantity == "noise"
    assert "robust_fir" in str(error.value)
