"""`strapdown extrinsics`: what it prints and writes, how it ends, and its parts in Python."""

from __future__ import annotations

import json
import re
import tomllib

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom
from tests.recorded import DATA
from tests.unit.evaluation.made_pairs import (
    drive_with_antenna,
    pair_of_units,
    unit_and_magnetometer,
)
from typer.main import get_command

import strapdown as sd
from strapdown.cli.main import app
from strapdown.errors import ConfigError, DataError
from strapdown.formats import csv
from strapdown.sensors.calibration import SensorCalibration
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.simulation import GnssReceiver
from strapdown.systems import extrinsics_run
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


def errors_in_sd(run, drive):
    """Error by sd of each parameter of an antenna; the unit is mounted straight."""
    known = {f"lever_arm_{axis}": value for axis, value in zip("xyz", drive.arm, strict=True)}
    known |= {"time_offset": drive.offset, "mounting_pitch": 0.0, "mounting_yaw": 0.0}
    return {e.name: (e.value - known[e.name]) / e.sd for e in run.result.estimates}


@pytest.mark.slow
def test_the_antenna_of_a_drive(monkeypatch):
    arm, offset = (0.8, 0.3, -1.2), 0.15
    receiver = GnssReceiver(
        rate=2.0, position_noise=1.0, velocity_noise=0.1, antenna=arm, time_offset=offset
    )
    drive = sd.simulate("drive-town", rate_hz=50, sensor="mpu-6050", receiver=receiver)
    run_batch, chains = extrinsics_run.run_batch, []
    monkeypatch.setattr(
        extrinsics_run,
        "run_batch",
        lambda chain, *a, **k: (chains.append(chain), run_batch(chain, *a, **k))[1],
    )
    run = sd.extrinsics(drive.imu, drive.gnss, sensor="mpu-6050", wheels=False)
    found = run.result
    known = {f"lever_arm_{axis}": value for axis, value in zip("xyz", arm, strict=True)}
    for name, value in (known | {"time_offset": offset}).items():
        assert abs(found[name].value - value) < 3.0 * found[name].sd
    # What was known of nothing: an alignment by the same fixes would make the height 0.2 m sure.
    assert found["lever_arm_x"].sd < 0.15
    assert found["time_offset"].sd < 0.01
    assert not found["lever_arm_z"].observed
    assert found["lever_arm_z"].sd > 0.4
    said = [f for f in run.findings if f.code.startswith("extrinsics.")]
    assert [(f.code, f.data["parameter"]) for f in said] == [
        ("extrinsics.state-open", "lever_arm_z")
    ]
    # The last pass has the offset that it finds.
    used = chains[-1].navigator.by_name["gnss"].time_offset
    assert abs(used - found["time_offset"].value) < 0.1 * found["time_offset"].sd
    sds = [one.sd for one in found.estimates]
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), sds)
    np.testing.assert_allclose(found.covariance, found.covariance.T, rtol=1e-9)
    assert np.linalg.eigvalsh(found.covariance)[0] > 0.0
    assert abs(found.covariance[0, 3]) > 0.0


@pytest.mark.slow
def test_a_stated_heading_is_where_the_passes_begin_and_no_more(tmp_path):
    drive = drive_with_antenna(1, tmp_path, rate=2.0)
    given = {"sensor": drive.sensor, "wheels": False}
    found = sd.extrinsics(drive.imu, drive.gnss, **given).result
    wrong = drive.heading_deg + 10.0
    again = sd.extrinsics(drive.imu, drive.gnss, **given, heading_deg=wrong)
    assert again.spec.navigation.coarse.heading_deg == wrong
    for one in found.estimates:
        assert abs(again.result[one.name].value - one.value) < one.sd


@pytest.mark.slow
def test_coverage_of_antennas(tmp_path):
    inside: dict[str, list[bool]] = {}
    for seed in range(100, 106):
        drive = drive_with_antenna(seed, tmp_path, rate=1.0)
        run = sd.extrinsics(drive.imu, drive.gnss, sensor=drive.sensor, wheels=False)
        for name, error in errors_in_sd(run, drive).items():
            if run.result[name].observed:
                inside.setdefault(name, []).append(abs(error) <= 1.96)
    flags = [flag for each in inside.values() for flag in each]
    assert len(flags) >= 15
    for each in (*inside.values(), flags):
        # The 99 % interval of the share contains 95 %.
        assert sum(each) >= binom.ppf(0.005, len(each), 0.95), inside


def test_what_is_proposed_for_an_antenna_is_an_option(run_cli, tmp_path):
    rng, t = np.random.default_rng(1), np.arange(1000) / 50.0
    force = [0.0, 0.0, -9.81] + 0.02 * rng.normal(size=(1000, 3))
    values = np.column_stack([1e-3 * rng.normal(size=(1000, 3)), force]).T
    csv.write(tmp_path / "log.csv", dict(zip(NAMES, [t, *values], strict=True)), {})
    k = np.arange(20.0)
    places = {"lat_deg": 55.0 + 0.0 * k, "lon_deg": 37.0 + 0.0 * k, "alt_m": 100.0 + 0.0 * k}
    csv.write(tmp_path / "fixes.csv", {"time_s": k, **places}, {})
    ask = ("extrinsics", tmp_path / "log.csv", tmp_path / "fixes.csv", "--out", tmp_path / "x")
    done = run_cli(*ask)
    assert done.code == 4
    command = get_command(app).get_command(None, "extrinsics")
    options = {name for one in command.params for name in one.opts}
    asked = set(re.findall(r"--[a-z][a-z-]+", done.err))
    assert {"--heading", "--gnss-position-sd", "--sensor"} <= asked <= options
    # Of fixes alone axes and a calibration say nothing.
    stated = ("--gnss-position-sd", "1", "--sensor", "mpu-6050")
    done = run_cli(*ask, *stated, "--other-axes", "x,y,z")
    assert done.code == 4
    assert "--other-axes" in done.err
    done = run_cli(*ask, *stated, "--other-calibration", tmp_path / "log.csv")
    assert done.code == 4
    assert "--other-calibration" in done.err


def test_a_calibration_of_the_other_unit(logs, tmp_path):
    first, second = logs
    plain = sd.extrinsics(first, second)
    calibration = tmp_path / "scale.toml"
    errors = ImuErrors(TriadErrors(scale=0.01), TriadErrors())
    none = TriadUncertainty()
    tables = SensorCalibration(errors, none, none, np.zeros((2, 3)), None, None, ()).tables()
    lines = [
        line
        for name, table in tables.items()
        for line in (f"[{name}]", *(f"{k} = {json.dumps(v)}" for k, v in table.items()))
    ]
    calibration.write_text("\n".join(lines))
    known = sd.extrinsics(first, second, other_calibration=str(calibration))
    assert any(one.role == "calibration" for one in known.inputs)
    moved = known.result["gyro_scale_1"].value - plain.result["gyro_scale_1"].value
    assert abs(moved) == pytest.approx(0.01, rel=0.1)
    # A table of a field alone has no axes to be turned.
    imu, mag, _ = unit_and_magnetometer(3, "hand", "industrial", apart=False)
    with pytest.raises(DataError):
        sd.extrinsics(imu, mag, other_axes="y,x,-z")


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
