"""Every recording, and every log of strangers, gives a diagnosis or a refusal; clean logs agree."""

from __future__ import annotations

import numpy as np
import pytest

import strapdown as sd
from strapdown.errors import StrapdownError
from strapdown.formats import read_log
from strapdown.report.doctor import diagnosis_json, doctor_document

pytestmark = pytest.mark.slow


def everything(root):
    """Files and folders, down to those of a recording."""
    return [root, *sorted(root.rglob("*"))]


def test_every_file_of_strangers_is_examined_or_refused(recordings):
    examined = 0
    for path in everything(recordings("zoo")):
        try:
            found = sd.doctor(path)
        except StrapdownError:
            continue
        examined += 1
        assert found.data["logs"], path
        assert diagnosis_json(found)["logs"], path
        assert doctor_document(found).front, path
    assert examined >= 25


#: Axes of files that do not state them, and in which z does not point down by gravity.
AXES = {"zoo/rosbag1_loc/test1.bag": "-z,x,-y", "zoo/xio/short_walk.csv": "x,-y,-z"}


@pytest.mark.parametrize(
    "name",
    [
        "car_rtk/part1_imu_frd_si.csv",
        "rlg_static/part1_first900s.imu",
        "phone_comma2k19",
        "broad/07_undisturbed_fast_rotation_B.hdf5",
        "mpu6050_turns/unmoved-10min",
        "foot/SensorConnectData_32_LLIO.mat",
        "zoo/px4_ulg/sample_log_small.ulg",
        "zoo/rosbag1_loc/test1.bag",
        "zoo/xio/short_walk.csv",
    ],
)
@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_a_clean_log_is_the_recording_itself(name, suffix, recordings, tmp_path):
    path, clean = recordings(name), tmp_path / f"clean.{suffix}"
    # Where gravity does not show that z points down, a clean log needs axes.
    (one,) = sd.doctor(path, axes=AXES.get(name), fix=clean).logs
    again = read_log(clean)
    imu = one.streams["imu"]
    assert np.array_equal(again.imu.to_numpy(), imu.to_numpy())
    assert np.array_equal(again.imu.index, imu.index)
    assert again.imu.attrs["sampling"] == imu.attrs["sampling"]


def test_the_file_of_a_crash_laboratory_is_a_crash_record(recordings):
    (one,) = sd.doctor(recordings("crash_nhtsa_10146") / "v10146.EV5").logs
    (told,) = one.fit["crash"]
    assert told.code == "doctor.crash-record"
    assert told.data["count"] > 20
