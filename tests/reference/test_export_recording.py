"""A real recording through the exported C code, as a device would take it."""

from __future__ import annotations

import shutil
import subprocess

import numpy as np
import pytest

from strapdown import read_log, rotation
from strapdown.attitude_algorithms import make_algorithm, run_attitude
from strapdown.export import export_c
from strapdown.increments import increments_from_imu
from strapdown.orientation_filters import FILTERS, make_filter, run_filter
from strapdown.tables import ACCEL, GYRO, MAG, QUATERNION

COMPILER = shutil.which("cc") or shutil.which("gcc")


@pytest.mark.skipif(COMPILER is None, reason="no C compiler: install gcc or clang")
@pytest.mark.parametrize("precision", ["double", "float"])
@pytest.mark.parametrize("name", ["quaternion", "rotvec", "dcm"])
def test_two_turns_of_a_board(recordings, tmp_path, name, precision):
    imu = read_log(recordings("mpu6050_turns") / "rotate-360ccw-around-z-pointing-up").imu
    algorithm = make_algorithm(name)
    (tmp_path / "attitude.c").write_text(export_c(algorithm, imu=imu), encoding="utf-8")

    def run(flag: str, given: str = "") -> str:
        command = [COMPILER, "-std=c99", "-O2", f"-DREAL={precision}", flag, "attitude.c", "-lm"]
        subprocess.run(command, cwd=tmp_path, check=True)
        done = subprocess.run(
            [tmp_path / "a.out"], input=given, capture_output=True, text=True, check=True
        )
        return done.stdout

    assert "passed" in run("-DATTITUDE_TEST")
    rows = np.column_stack([np.diff(imu.index, prepend=imu.index[0]), imu[GYRO].to_numpy()])
    given = "\n".join(" ".join(repr(float(v)) for v in row) for row in rows)
    found = [line.split() for line in run("-DATTITUDE_FILTER", given).splitlines()]
    expected = run_attitude(algorithm, increments_from_imu(imu)).attitude[QUATERNION].to_numpy()
    apart = rotation.rotation_angle(np.array(found, dtype=float), expected)
    # Sixteen roundings of half an eps a step (product, increment, dt and rates), all one way.
    eps = np.finfo(np.float32 if precision == "float" else np.float64).eps
    assert apart.max() < np.degrees(len(rows) * 8 * eps)
    if precision == "float":
        assert apart.max() > np.degrees(eps)  # and it was single precision


@pytest.mark.slow
@pytest.mark.skipif(COMPILER is None, reason="no C compiler: install gcc or clang")
@pytest.mark.parametrize("precision", ["double", "float"])
@pytest.mark.parametrize("magnetometer", [False, True])
@pytest.mark.parametrize("name", FILTERS)
def test_a_filter_over_a_trial_of_three_minutes(
    recordings, tmp_path, name, magnetometer, precision
):
    imu = read_log(recordings("broad/02_undisturbed_slow_rotation_B.hdf5")).imu
    imu = imu[[*GYRO, *ACCEL, *(MAG if magnetometer else ())]]
    chosen = make_filter(name)
    (tmp_path / "attitude.c").write_text(export_c(chosen, imu=imu), encoding="utf-8")
    command = [COMPILER, "-std=c99", "-O2", f"-DREAL={precision}", "-DATTITUDE_FILTER"]
    subprocess.run([*command, "attitude.c", "-lm"], cwd=tmp_path, check=True)
    rows = np.column_stack([np.diff(imu.index, prepend=imu.index[0]), imu.to_numpy()])
    given = "\n".join(" ".join(repr(float(v)) for v in row) for row in rows)
    done = subprocess.run(
        [tmp_path / "a.out"], input=given, capture_output=True, text=True, check=True
    )
    found = np.array([line.split() for line in done.stdout.splitlines()], dtype=float)
    apart = rotation.rotation_angle(found, run_filter(chosen, imu).q_nb)
    # In double precision every step is the kernel's; a filter does not let roundings accumulate, so
    # that after 53 240 samples single precision is where it was after a thousand.
    assert apart.max() < (1e-12 if precision == "double" else 0.01)
    if precision == "float":
        assert apart.max() > 1e-5  # and it was single precision
