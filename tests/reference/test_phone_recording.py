"""A segment of comma2k19: a phone in a car on a straight motorway, with its pose in ECEF.

Provenance and the numbers that are asserted stand in the README beside the recording; without it
these tests skip.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from strapdown import frames, read_log, rotation
from strapdown.api.attitude import compare_attitude
from strapdown.tables import ACCEL, GYRO, QUATERNION


@pytest.fixture(scope="module")
def folder(recordings):
    return recordings("phone_comma2k19")


@pytest.fixture(scope="module")
def recording(folder):
    return read_log(folder)


def load(folder, name):
    return np.load(folder / f"{name}.npy")


def test_numbers_are_those_that_numpy_reads(folder, recording):
    t = load(folder, "IMU__gyro__t")
    # Rows may be left out at the ends, where another sensor has no values.
    rows = np.searchsorted(t, recording.imu.index)
    assert np.array_equal(t[rows], recording.imu.index)
    assert rows.size > 0.99 * t.size
    assert np.array_equal(recording.imu[GYRO], load(folder, "IMU__gyro__value")[rows])
    assert np.array_equal(recording.imu[ACCEL], load(folder, "IMU__accelerometer__value")[rows])
    rate = (rows.size - 1) / (recording.imu.index[-1] - recording.imu.index[0])
    assert rate == pytest.approx(104.0, abs=0.5)  # "~104 Hz"


def test_attitude_is_that_of_the_pose(folder, recording):
    """Turned to north-east-down by SciPy, with the latitude by iteration."""
    times = load(folder, "global_pose__frame_times")
    x, y, z = load(folder, "global_pose__frame_positions").T
    q = load(folder, "global_pose__frame_orientations")
    e2 = 0.00669437999014
    latitude = np.arctan2(z, np.hypot(x, y) * (1.0 - e2))
    for _ in range(10):
        n = 6378137.0 / np.sqrt(1.0 - e2 * np.sin(latitude) ** 2)
        latitude = np.arctan2(z + e2 * n * np.sin(latitude), np.hypot(x, y))
    down_first = np.column_stack([np.arctan2(y, x), -latitude - np.pi / 2])
    ned = Rotation.from_euler("ZY", down_first).inv()
    pose = ned * Rotation.from_quat(q, scalar_first=True)
    ours = Rotation.from_quat(recording.truth[QUATERNION].to_numpy(), scalar_first=True)
    # Frame and sample are at most 17 ms apart, in which the car turns by less than 0.5 deg.
    nearest = np.abs(times[:, None] - recording.truth.index.to_numpy()).argmin(axis=0)
    assert np.degrees((pose[nearest].inv() * ours).magnitude()).max() < 0.5
    lat_deg, lon_deg, _ = frames.geodetic_from_ecef(np.column_stack([x, y, z])).T
    same = Rotation.from_quat(frames.q_ne(lat_deg, lon_deg), scalar_first=True)
    assert np.degrees((same.inv() * ned).magnitude()).max() < 1e-9


def test_frames_and_axes_agree_with_velocity_and_gravity(folder, recording):
    """The car drives where the phone looks, and the phone is held up against gravity."""
    q_ed = load(folder, "global_pose__frame_orientations")
    v = rotation.rotate(rotation.conjugate(q_ed), load(folder, "global_pose__frame_velocities"))
    assert v.mean(axis=0) == pytest.approx([16.8, 0.24, -1.1], abs=0.05)
    f = rotation.rotate(
        recording.truth[QUATERNION].to_numpy(),
        recording.imu.loc[recording.truth.index, ACCEL].to_numpy(),
    ).mean(axis=0)
    assert -f[2] == pytest.approx(9.67, abs=0.03)  # "2 % low"
    assert np.hypot(f[0], f[1]) < 0.5  # from 7.9 to 11.5 m/s in a minute, and a hill
    change = np.ptp(np.unwrap(recording.truth["heading"], period=360.0)[[0, -1]])
    assert change < 0.7  # "heading changes 0.6 deg in all"


def test_gyro_alone_keeps_the_attitude(folder):
    plain = compare_attitude(folder)
    # A bias that Android estimates is good to a tenth of a deg/s or so; it adds up over 60 s.
    score = {s.algorithm: s for s in plain.scores}["quaternion"]
    assert 0.1 < score.error_deg < 6.0
    # What is left at the end, given back evenly as a bias, shows what is not bias.
    truth = plain.truth
    run = next(r for r in plain.runs if r.algorithm == "quaternion")
    ours = run.attitude.loc[truth.index, QUATERNION].to_numpy()
    off = rotation.rotation_vector_from_quaternion(
        rotation.compose(rotation.conjugate(truth[QUATERNION].to_numpy()[-1]), ours[-1])
    )
    bias = np.degrees(off) / (truth.index[-1] - truth.index[0])
    assert np.linalg.norm(bias) < 0.1
    text = ",".join(f"{b:.9f}" for b in bias) + " deg/s"
    left = {s.algorithm: s for s in compare_attitude(folder, gyro_bias=text).scores}["quaternion"]
    # The heading changes by 0.6 deg in all, so that body axes hardly turn and the bias is even.
    assert left.error_deg < 0.1
    assert left.max_deg < 1.5
