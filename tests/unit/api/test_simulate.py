"""`simulate` returns data; `save` writes what the command writes."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import strapdown as sd
from strapdown.errors import ConfigError


def test_a_trajectory_has_samples_fixes_and_truth(tmp_path):
    drive = sd.simulate("drive-town", rate_hz=20, seed=1)
    assert isinstance(drive.imu, sd.Imu)
    assert isinstance(drive.gnss, sd.GnssFixes)
    pd.testing.assert_index_equal(drive.imu.index, drive.truth.index)
    at = drive.gnss.index[drive.gnss.index <= drive.truth.index[-1]]
    north = np.interp(at, drive.truth.index, drive.truth["lat"])
    off = np.radians(drive.gnss.loc[at, "lat"] - north) * 6.37e6
    # White noise of 1 m; a standard deviation from n samples is known to 1/sqrt(2 n), here 2 %.
    assert np.std(off) == pytest.approx(1.0, abs=5.0 / np.sqrt(2.0 * len(at)))
    assert "fixes" in repr(drive)
    assert not list(tmp_path.iterdir())


def test_the_same_seed_gives_the_same_bits_and_another_one_others():
    first, again, other = (
        sd.simulate("alexiev-fig2e", rate_hz=50, seed=seed).imu for seed in (1, 1, 2)
    )
    pd.testing.assert_frame_equal(first, again, check_exact=True)
    assert not np.array_equal(first.to_numpy(), other.to_numpy())


def test_samples_state_their_kind():
    means = sd.simulate("alexiev-fig4", rate_hz=20, sampling="mean").imu
    assert means.attrs["sampling"] == "mean"
    assert sd.simulate("drive-town", rate_hz=20).imu.attrs["sampling"] == "instantaneous"


def test_samples_go_into_the_other_functions():
    turned = sd.simulate("alexiev-fig4", rate_hz=100)
    assert turned.gnss is None
    # The README states 0.574 deg for this scenario, algorithm and rate, as the largest error.
    found = sd.attitude(turned.imu, algorithm="quaternion").rotation[-1]
    true = turned.truth[["q_x", "q_y", "q_z", "q_w"]].iloc[-1].to_numpy()
    assert np.degrees((found * type(found).from_quat(true).inv()).magnitude()) < 1.0


def test_what_is_saved_is_what_was_simulated_and_verifies(tmp_path):
    made = sd.simulate("alexiev-fig2e", rate_hz=50, seed=3)
    seal = made.save(tmp_path / "log")
    np.testing.assert_array_equal(
        sd.read_imu(seal.path / "log.csv").to_numpy(), made.imu.to_numpy()
    )
    assert sd.verify(seal.path).verdict == "identical"


def test_a_crash_has_its_recorders():
    crash = sd.simulate("pole", recorders=["imu2"])
    assert crash.imu is None
    assert list(crash.recorders) == ["IMU2"]
    assert not crash.truth.empty


@pytest.mark.parametrize(
    ("source", "options", "code"),
    [
        ("nowhere", {}, "report.no-scenario-no-crash"),
        ("pole", {"sensor": "mpu-6050"}, "report.recorders-crash-parts-their-own"),
        ("alexiev-fig4", {"recorders": ["imu1"]}, "report.no-crash-no-recorders"),
    ],
)
def test_what_does_not_fit_is_refused(source, options, code):
    with pytest.raises(ConfigError) as refused:
        sd.simulate(source, **options)
    assert refused.value.finding.code == code
