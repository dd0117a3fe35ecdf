"""`strapdown extrinsics`: what it prints and writes, how it ends, and its parts in Python."""

from __future__ import annotations

import json
import tomllib

import numpy as np
import pandas as pd
import pytest
from tests.recorded import DATA
from tests.unit.evaluation.made_pairs import pair_of_units, unit_and_magnetometer

import strapdown as sd
from strapdown.errors import ConfigError
from strapdown.formats import csv
from strapdown.tables import ACCEL, GYRO, MAG

NAMES = ["time_s", *(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]


@pytest.fixture(scope="module")
def pair():
    return pair_of_units(3, "hand", "industrial")


@pytest.fixture(scope="module")
def logs(pair, tmp_path_factory):
    folder = tmp_path_factory.mktemp("pair")
    paths = []
    for name, table in zip(("a.csv", "b.csv"), pair, strict=False):
        table = table[table.index < table.index[0] + 20.0]
        columns = [table.index, *table[[*GYRO, *ACCEL]].to_numpy().T]
        head = {"axes": "forward-right-down", "sampling": "instantaneous"}
        csv.write(folder / name, dict(zip(NAMES, map(np.asarray, columns), strict=True)), head)
        paths.append(folder / name)
    return paths


def test_two_logs_the_folder_and_its_verification(pair, logs, run_cli, tmp_path):
    out = tmp_path / "out"
    done = run_cli("extrinsics", *logs, "--out", out)
    assert done.code == 0, done.err
    assert "T_i_b" in (out / "extrinsics.toml").read_text()
    table = tomllib.loads((out / "extrinsics.toml").read_text())
    found = json.loads((out / "extrinsics.json").read_text())
    R, truth = np.array(table["rotation"]["matrix"]), pair[2]
    np.testing.assert_allclose(R, truth.rotation, atol=1e-3)
    np.testing.assert_allclose(table["lever_arm"]["m"], truth.arm, atol=0.02)
    T = np.array(found["transform"])
    # The other programs have the same transform: kalibr its inverse, URDF its angles.
    of_kalibr = np.array(json.loads(table["bridge"]["kalibr"].removeprefix("T_i_b: ")))
    np.testing.assert_allclose(of_kalibr @ T, np.eye(4), atol=1e-7)
    rpy = [float(x) for x in table["bridge"]["urdf"].split('rpy="')[1].split('"')[0].split()]
    np.testing.assert_allclose(np.degrees(rpy), table["rotation"]["roll_pitch_yaw_deg"], rtol=1e-4)
    words = table["bridge"]["ros2"].split()
    q = [float(words[words.index(f"--q{k}") + 1]) for k in "xyzw"]
    from scipy.spatial.transform import Rotation

    np.testing.assert_allclose(Rotation.from_quat(q).as_matrix(), T[:3, :3], atol=1e-7)
    assert run_cli("verify", out).code == 0


def test_what_is_refused(logs, run_cli, tmp_path):
    out = ("--out", tmp_path / "x")
    assert run_cli("extrinsics", logs[0], tmp_path / "none.csv", *out).code == 4
    assert run_cli("extrinsics", *logs, "--kind", "camera", *out).code == 4
    assert run_cli("extrinsics", *logs, "--to", "0.5", *out).code == 3
    assert run_cli("extrinsics", logs[0], *out).code == 3


def test_in_memory_and_saved(tmp_path):
    imu, mag, truth = unit_and_magnetometer(3, "hand", "industrial", apart=False)
    run = sd.extrinsics(imu, mag, offset=0.0)
    assert run.spec.kind == "magnetometer"
    assert abs(run.result["time_offset"].value - truth.offset) < 0.002
    table = run.to_pandas()
    assert table.loc["rotation_x", "observed"]
    run.save(tmp_path / "saved", report=False)
    assert sd.verify(tmp_path / "saved").verdict == "identical"
    # A table that has both is one log, on one clock.
    both = imu.join(
        pd.DataFrame({c: np.interp(imu.index, mag.index, mag[c]) for c in MAG}, index=imu.index)
    )
    both.attrs = imu.attrs
    assert sd.extrinsics(both).spec.one_clock
    with pytest.raises(ConfigError):
        sd.extrinsics(imu, mag, colour="red")


@pytest.mark.slow
@pytest.mark.skipif(DATA is None, reason="without recordings")
def test_the_antenna_of_a_recorded_car():
    folder = DATA / "car_rtk"
    run = sd.extrinsics(
        folder / "part1_imu_frd_si.csv",
        folder / "part1_gnss_rtk.csv",
        sensor="icm-42688-p",
    )
    # Of its authors: antenna (0, -0.05, 0) m, mounting pitch -6.79 deg, yaw +5.35 deg.
    known = {"lever_arm_x": 0.0, "lever_arm_y": -0.05, "lever_arm_z": 0.0}
    known |= {"mounting_pitch": np.radians(-6.79), "mounting_yaw": np.radians(5.35)}
    for name, value in known.items():
        one = run.result[name]
        assert one.observed, name
        assert abs(one.value - value) < one.bound, name
    assert -0.2 < run.result["time_offset"].value < -0.1


@pytest.mark.slow
@pytest.mark.skipif(DATA is None, reason="without recordings")
@pytest.mark.parametrize(
    "trial", ["02_undisturbed_slow_rotation_B", "07_undisturbed_fast_rotation_B"]
)
def test_the_magnetometer_of_a_recorded_unit(trial):
    run = sd.extrinsics(DATA / "broad" / f"{trial}.hdf5")
    # One unit, calibrated by its maker: the axes agree within a degree; both trials, by hand and
    # against the same gyros, show the same delay.
    assert all(abs(run.result[f"rotation_{axis}"].value) < np.radians(1.0) for axis in "xyz")
    assert run.result["time_offset"].value == pytest.approx(0.0102, abs=0.001)
