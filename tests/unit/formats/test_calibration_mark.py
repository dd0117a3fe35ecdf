"""A log that is written after a calibration says so in every format that can hold it."""

from __future__ import annotations

import numpy as np
import pytest
from tests.calibrated import GRAVITY

import strapdown as sd
from strapdown.errors import DataError
from strapdown.formats import csv

NAMES = ["time_s", *(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]
FILE = """
[accel]
bias_m_per_s2 = [0.1, 0.2, 0.3]
bias_sd_m_per_s2 = [0.01, 0.01, 0.01]
scale = [0.01, 0.0, 0.0]
scale_sd = [0.001, 0.001, 0.001]
misalignment_rad = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
misalignment_sd_rad = [0.001, 0.001, 0.001]
[gyro]
bias_rad_per_s = [0.01, 0.0, 0.0]
bias_sd_rad_per_s = [0.001, 0.001, 0.001]
scale = [0.0, 0.0, 0.0]
scale_sd = [0.001, 0.001, 0.001]
misalignment_rad = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
misalignment_sd_rad = [0.001, 0.001, 0.001]
"""


@pytest.fixture
def log(tmp_path):
    time = 1.7e9 + np.arange(300) / 100.0
    values = np.random.default_rng(1).normal(scale=0.01, size=(300, 6))
    values[:, 5] -= GRAVITY
    path = tmp_path / "log.csv"
    header = {"axes": "forward-right-down", "sampling": "instantaneous"}
    csv.write(path, dict(zip(NAMES, [time, *values.T], strict=True)), header)
    (tmp_path / "calibration.toml").write_text(FILE)
    return path


@pytest.mark.parametrize(
    "name", ["a.csv", "a.parquet", "a.npz", "a.h5", "a.mat", "a.mcap", "euroc"]
)
def test_the_mark_travels_and_a_second_application_is_refused(log, tmp_path, name):
    calibration, out = tmp_path / "calibration.toml", tmp_path / name
    form = "euroc" if name == "euroc" else None
    once = sd.read_imu(log, calibration=calibration)
    said = sd.write(once, out, format=form)
    assert "io.written-without-calibration-mark" not in {f.code for f in said}
    again = sd.read_imu(out)
    assert again.attrs["calibrated"] == once.attrs["calibrated"]
    assert again.attrs["calibrated"].startswith("calibration.toml, sha256 ")
    with pytest.raises(DataError) as caught:
        sd.read_imu(out, calibration=calibration)
    assert caught.value.finding.code == "calibrate.calibrated-twice"
    # Through a second format, and the table in memory of a run.
    sd.write(again.iloc[:200], tmp_path / "b.npz")
    assert "calibrated" in sd.read_imu(tmp_path / "b.npz").attrs
    with pytest.raises(DataError) as caught:
        sd.calibrate(out)
    assert caught.value.finding.code == "calibrate.calibrated-log-by"


def test_a_log_as_recorded_has_no_mark(log, tmp_path):
    sd.write(sd.read_imu(log), tmp_path / "a.csv")
    assert "calibrat" not in (tmp_path / "a.csv").read_text()[:500]
    # A remark of somebody else is none.
    text = (tmp_path / "a.csv").read_text()
    (tmp_path / "b.csv").write_text("# calibration: of the maker\n" + text)
    assert "calibrated" not in sd.read_imu(tmp_path / "b.csv").attrs


@pytest.mark.parametrize("form", ["kitti", "kf-gins"])
def test_a_format_without_a_mark_is_said(log, tmp_path, form):
    once = sd.read_imu(log, calibration=tmp_path / "calibration.toml")
    tables = {"imu": once}
    if form == "kitti":
        tables["reference"] = _still(once)
    said = sd.write(tables, tmp_path / form, format=form)
    assert "io.written-without-calibration-mark" in {f.code for f in said}


def _still(imu):
    from strapdown.tables import trajectory_table

    n = len(imu)
    track = trajectory_table(
        imu.index, np.tile([48.0, 11.0, 500.0], (n, 1)), np.zeros((n, 3)), np.zeros((n, 3))
    )
    track.attrs |= {k: v for k, v in imu.attrs.items() if k.startswith("clock")}
    return track
