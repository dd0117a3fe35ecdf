"""Rests, places and second logs on real recordings, against what is independently known.

As in test_recordings: numbers are those of the recordings' own documentation or follow from
physics.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.io import loadmat

from strapdown import read_log, rotation
from strapdown.attitude_algorithms import Quaternion, run_attitude
from strapdown.attitude_algorithms.algorithm import AttitudeRun
from strapdown.evaluation.differences import attitude_at
from strapdown.evaluation.position_references import dead_reckon
from strapdown.evaluation.reference_points import (
    same_pose_candidates,
    score_references,
    tilt_references,
)
from strapdown.evaluation.second_log import align_second_log, truth_from_second_log
from strapdown.increments import increments_from_imu
from strapdown.rotation import level
from strapdown.sensors.rest import (
    find_rests,
    find_rests_of_every_grade,
    find_shaking_rests,
    gyro_bias_from_rests,
    rest_between,
    without_gyro_bias,
)
from strapdown.tables import GYRO, QUATERNION, imu_table

TRIALS = [
    "02_undisturbed_slow_rotation_B",
    "07_undisturbed_fast_rotation_B",
    "14_undisturbed_slow_translation_with_breaks_B",
    "27_disturbed_phone_vibration_B",
]
MOUNTING = rotation.quaternion_from_euler([30.0, -20.0, 75.0])


@pytest.mark.parametrize("name", TRIALS)
def test_gravity_at_rests_agrees_with_the_camera(recordings, name):
    """The optical attitude is level to its calibration; the sensor is a good MEMS (20 mg)."""
    recording = read_log(recordings("broad") / f"{name}.hdf5")
    rests = find_rests(recording.imu)
    table = tilt_references(rests, bias_sd=0.2)
    optical = AttitudeRun("optical", "", "", recording.truth, {})
    table = table[table["time"] > recording.truth.index[0]]
    scores = score_references(optical, table, recording.imu)
    assert len(scores) >= 2
    for score in scores:
        # The root mean square of two axes: one in 3000 lies beyond 2.8 of it.
        assert score.error_deg < 2.8 * score.sd_deg


@pytest.mark.parametrize("name", TRIALS)
def test_poses_offered_as_the_same_have_the_same_tilt_to_the_camera(recordings, name):
    """And the camera says whether the heading was the same, which gravity cannot."""
    recording = read_log(recordings("broad") / f"{name}.hdf5")
    down = np.array([0.0, 0.0, 1.0])
    for pose in same_pose_candidates(find_rests(recording.imu)):
        q = attitude_at(recording.truth, [pose.time, pose.since])
        a, b = rotation.rotate(rotation.conjugate(q), down)
        apart = np.degrees(np.arccos(np.clip(a @ b, -1.0, 1.0)))
        # Each optical attitude is good to about 0.1 deg (Laidig et al. 2021).
        assert abs(apart - pose.apart_deg) < 4 * np.hypot(0.1, pose.sd_deg)


@pytest.mark.parametrize("name", TRIALS)
def test_a_trial_as_its_own_second_log(recordings, name):
    """Every second sample against every third, turned, late by 0.1237 s and 50 ppm fast."""
    recording = read_log(recordings("broad") / f"{name}.hdf5")
    imu = recording.imu
    first, other = imu.iloc[::2], imu.iloc[1::3]
    first.attrs = imu.attrs
    u = other.index.to_numpy()
    middle = 0.5 * float(imu.index[-1])
    late = u + 0.1237 + 50e-6 * (u - middle)
    turned = rotation.rotate(rotation.conjugate(MOUNTING), other[GYRO].to_numpy())
    second = imu_table(late, turned)
    found = align_second_log(first, second)
    # u = t + offset + drift (t - middle), to the second order of 50 ppm.
    assert found.offset == pytest.approx(
        0.1237 + 50e-6 * (found.middle - middle), abs=5 * found.offset_sd
    )
    assert found.drift_ppm == pytest.approx(50.0, abs=5 * found.drift_sd_ppm)
    off = rotation.rotation_vector_from_quaternion(
        rotation.compose(found.mounting, rotation.conjugate(MOUNTING))
    )
    assert (np.abs(np.degrees(off)) < 5 * np.array(found.mounting_sd_deg)).all()
    assert found.scale == pytest.approx(1.0, abs=5 * found.scale_sd)
    assert (np.abs(found.bias) < 5 * np.array(found.bias_sd)).all()
    assert found.offset_sd < 1e-4
    # The truth it gives is what its own samples give, in the axes and at the stamps of the first:
    # apart by the mounting, twice, by the offset and the drift times the rate, and by the drift
    # times all that was turned.
    truth = truth_from_second_log(found, first, second)
    other.attrs = imu.attrs
    straight = run_attitude(Quaternion(), increments_from_imu(other)).attitude
    q = attitude_at(straight, truth.index.to_numpy())
    q = rotation.compose(rotation.conjugate(q[0]), q)
    error = rotation.rotation_angle(truth[QUATERNION].to_numpy(), q).max()
    rate = np.linalg.norm(other[GYRO].to_numpy(), axis=1)
    of_clock = found.offset_sd + 1e-6 * found.drift_sd_ppm * middle
    of_clock = of_clock * rate.max() + 1e-6 * found.drift_sd_ppm * np.trapezoid(rate, u)
    assert error < 5 * (2 * np.linalg.norm(found.mounting_sd_deg) + np.degrees(of_clock))


def car(recordings):
    values = np.loadtxt(recordings("car_rtk") / "part1_imu_frd_si.csv", delimiter=",")
    return imu_table(values[:, 0] - values[0, 0], values[:, 1:4], values[:, 4:7])


def test_a_parked_car_with_people_in_it_is_a_rest(recordings):
    """GNSS: below 0.15 m/s until 34.6 s and from 196.4 to 206.1 s, never else."""
    imu = car(recordings)
    shaken = find_shaking_rests(imu)
    assert len(shaken) == 2
    for rest, (start, end) in zip(shaken, [(0.0, 34.6), (196.4, 206.1)], strict=True):
        # Windows of 4 s start every second.
        assert start - 0.2 <= rest.start <= start + 2.0
        assert end - 4.0 <= rest.end <= end + 0.2
    first, second = find_rests_of_every_grade(imu)
    assert first.grade == "shaking"
    apart = np.subtract(first.gyro_mean, second.gyro_mean)
    # The bias of a MEMS over three minutes, 0.03 deg/s, and what the means are known to.
    sd = np.hypot(first.gyro_mean_sd, second.gyro_mean_sd)
    assert (np.abs(apart) < np.radians(0.03) + 4 * sd).all()


def test_a_motorway_is_no_rest(recordings):
    folder = recordings("phone_comma2k19")
    time = np.load(folder / "IMU__gyro__t.npy")
    at = np.load(folder / "IMU__accelerometer__t.npy")
    force = np.load(folder / "IMU__accelerometer__value.npy")
    gyro = np.load(folder / "IMU__gyro__value.npy")
    accel = np.column_stack([np.interp(time, at, column) for column in force.T])
    assert find_rests_of_every_grade(imu_table(time - time[0], gyro, accel)) == ()


@pytest.mark.parametrize(
    ("axis", "tilt"), [("x-pointing-forward", 15), ("y-pointing-left", 12), ("z-pointing-up", 11)]
)
def test_the_board_was_put_back_tilted(recordings, axis, tilt):
    """15, 12 and 11 deg between start and end, by gravity, in a hand that shakes."""
    imu = read_log(recordings("mpu6050_turns") / f"rotate-360ccw-around-{axis}").imu
    begin, end = float(imu.index[0]), float(imu.index[-1])
    rests = [rest_between(imu, begin, begin + 1.0), rest_between(imu, end - 1.0, end)]
    start = rotation.quaternion_from_euler([*level(rests[0].accel_mean), 0.0])
    unmoved = imu.copy()
    unmoved.attrs = imu.attrs
    unmoved[GYRO] = 0.0
    still = run_attitude(Quaternion(), increments_from_imu(unmoved), start)
    (score,) = score_references(still, tilt_references(rests, levelled_from=rests[0]), imu)
    # Half a degree by rounding, and the noise of two seconds in a hand, a deg or so each.
    assert score.error_deg == pytest.approx(tilt, abs=2.5)
    # Far from what anybody would call the same pose.
    assert same_pose_candidates(rests) == ()


def test_strides_between_stances_are_as_long_as_the_control_points_are_apart(recordings):
    """Control points to about a decimetre each, so distances to √2 of that.

    The recording marks each stance near its end; the foot is quietest shortly before.
    """
    content = loadmat(recordings("foot") / "SensorConnectData_32_LLIO.mat")
    values, time = content["imu_data"], content["timestamps"].ravel()
    imu = imu_table(time - time[0], values[:, 3:6], values[:, :3])
    rests = find_rests(imu)
    imu = without_gyro_bias(imu, gyro_bias_from_rests(rests))
    q_start = rotation.quaternion_from_euler([*level(rests[0].accel_mean), 0.0])
    run = run_attitude(Quaternion(), increments_from_imu(imu), q_start)
    speed = np.linalg.norm(imu[GYRO].to_numpy(), axis=1)
    stamps = imu.index.to_numpy()
    stances = []
    for mark in content["strideIndex"].ravel().astype(int) - 1:
        quiet = mark - 40 + int(np.argmin(speed[mark - 40 : mark + 1]))
        stances.append(
            rest_between(imu, stamps[quiet - 3], stamps[min(quiet + 3, len(stamps) - 1)])
        )
    # Where the foot was is the middle of a stance: gravity of 9.80 m/s², the first rest's 9.818
    # includes its accelerometers' bias.
    legs = [dead_reckon(run, imu, a, b, gravity=9.80) for a, b in pairwise(stances)]
    reckoned = np.array([np.linalg.norm(leg.position_corrected[-1][:2]) for leg in legs])
    apart = np.linalg.norm(np.diff(content["GCP"], axis=0), axis=1)
    assert len(legs) == 61
    assert np.sqrt(np.mean((reckoned - apart) ** 2)) < 0.1 * np.sqrt(2)
    assert reckoned.sum() == pytest.approx(apart.sum(), rel=0.05)
