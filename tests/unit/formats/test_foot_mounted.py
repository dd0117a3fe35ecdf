"""Logs of a unit on a shoe, and its control points."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.io import savemat
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.formats import read_log
from strapdown.formats.aid_table import read_control_points


def arrays(n=400, points=5):
    rng = np.random.default_rng(0)
    force = np.tile([0.0, 0.0, -9.8], (n, 1)) + 0.01 * rng.standard_normal((n, 3))
    rate = 0.01 * rng.standard_normal((n, 3))
    at = np.linspace(10, n - 10, points).astype(np.int64)
    return {
        "timestamps": 0.005 * np.arange(n),
        "imu_data": np.column_stack([force, rate]),
        "strideIndex": at,
        "GCP": rng.uniform(-5.0, 5.0, (points, 2)),
        "pyshoeTrajectory": rng.uniform(-5.0, 5.0, (n, 2)),
    }


def written(path, **changed):
    values = {k: v for k, v in {**arrays(), **changed}.items() if v is not None}
    savemat(path, values)
    return path


def test_force_comes_first_and_then_the_rate(tmp_path):
    given = arrays()
    found = read_log(written(tmp_path / "foot.mat"))
    np.testing.assert_array_equal(
        found.imu[["accel_x", "accel_y", "accel_z"]], given["imu_data"][:, :3]
    )
    np.testing.assert_array_equal(
        found.imu[["gyro_x", "gyro_y", "gyro_z"]], given["imu_data"][:, 3:]
    )
    np.testing.assert_array_equal(found.imu.index, given["timestamps"])


def test_points_are_at_samples_counted_from_zero(tmp_path):
    given = arrays()
    found = read_control_points(written(tmp_path / "foot.mat"))
    np.testing.assert_array_equal(found.index, given["timestamps"][given["strideIndex"]])
    np.testing.assert_array_equal(found[["north", "east"]], given["GCP"])


def test_a_table_of_points_may_have_units(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("time_s,north_m,east_cm\n1.0,2.0,300\n4.0,5.0,600\n")
    found = read_control_points(path)
    np.testing.assert_array_equal(found.index, [1.0, 4.0])
    np.testing.assert_allclose(found[["north", "east"]], [[2.0, 3.0], [5.0, 6.0]])


def test_one_point_is_refused(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("time_s,north_m,east_m\n1.0,2.0,3.0\n")
    with pytest.raises(
        DataError, check=coded("io.control-point-origin-heading-fit", count=1)
    ) as refused:
        read_control_points(path)
    assert refused.value.finding.remedy


@pytest.mark.parametrize(
    ("changed", "quantity"),
    [
        ({"imu_data": np.zeros((400, 5))}, "timestamps, imu_data"),
        ({"timestamps": np.arange(399.0)}, "timestamps, imu_data"),
        ({"strideIndex": np.array([1, 2, 3, 4, 400])}, "strideIndex"),
        ({"strideIndex": np.array([-1, 2, 3, 4, 5])}, "strideIndex"),
        ({"GCP": np.zeros((4, 2))}, "strideIndex, GCP"),
    ],
)
def test_arrays_that_do_not_fit_are_named(tmp_path, changed, quantity):
    with pytest.raises(DataError) as refused:
        read_control_points(written(tmp_path / "foot.mat", **changed))
    assert refused.value.finding.file == "foot.mat"
    assert refused.value.finding.quantity == quantity
    assert refused.value.finding.remedy


def test_the_recording_walks_as_far_as_is_told_of_it(recordings):
    """62 strides and 79.59 m, by what comes with it."""
    path = recordings("foot/SensorConnectData_32_LLIO.mat")
    found = read_control_points(path)
    assert len(found) == 62
    way = np.hypot(*np.diff(found.to_numpy(), axis=0).T).sum()
    assert way == pytest.approx(79.587, abs=0.001)
    imu = read_log(path).imu
    assert len(imu) == 14601
    # It stands at first: what the force is then is gravity, to 3 mg.
    force = imu[["accel_x", "accel_y", "accel_z"]].to_numpy()[:200].mean(axis=0)
    assert np.linalg.norm(force) == pytest.approx(9.80, abs=0.03)
