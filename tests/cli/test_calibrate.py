"""`strapdown calibrate`: what it prints and writes, how it ends, and that commands apply it."""

from __future__ import annotations

import json
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import beta
from tests.calibrated import GRAVITY, POSES, between, by_hand, facing, record, unit

import strapdown as sd
from strapdown.errors import ConfigError, DataError
from strapdown.formats import csv
from strapdown.sensors import catalogue as sensors
from strapdown.sensors.calibration import CASE, SensorCalibration
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty

NAMES = ["time_s", *(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]


def write_log(path, made, axes="forward-right-down"):
    values = [made.imu.index.to_numpy(), *made.imu.to_numpy().T]
    header = {"axes": axes, "sampling": "instantaneous"}
    csv.write(path, dict(zip(NAMES, values, strict=True)), header)
    return path


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """Twelve poses on a table; a further log of the unit at rest, tilted, in other axes."""
    folder, errors = tmp_path_factory.mktemp("calibrate"), unit(4)
    draw = np.random.default_rng(4)
    poses = [facing(up) for up in POSES[:12]]
    made = record(*by_hand(poses[0], between(poses), draw, rest=2.0), errors, 4)
    rest = record(*by_hand(facing((0.3, 0.2, -1.0)), [], draw, rest=20.0), errors, 9)
    return write_log(folder / "poses.csv", made), write_log(folder / "rest.csv", rest)


@pytest.fixture(scope="module")
def result(logs, run_cli, tmp_path_factory):
    """What the command prints, and its folder."""
    out = tmp_path_factory.mktemp("result") / "out"
    done = run_cli("calibrate", logs[0], "--gravity", GRAVITY, "--out", out)
    assert done.code == 0, done.err
    return done.out, out


def test_the_terminal_and_the_folder(result):
    printed, out = result
    assert "12 rests" in printed
    assert len(printed.splitlines()) <= 45
    found = json.loads((out / "calibrate.json").read_text())
    assert found["procedure"] == "positions"
    assert found["parameters"]["accel_scale_x"]["observed"] is True
    true = unit(4).accel.axis("bias")[0]
    bias = found["parameters"]["accel_bias_x"]
    assert abs(bias["value"] - true) < 4.0 * bias["sd"]
    file = tomllib.loads((out / "calibration.toml").read_text())
    assert file["accel"]["bias_m_per_s2"][0] == pytest.approx(bias["value"], rel=1e-8)
    assert len(file["log"][0]["sha256"]) == 64
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "what is missing" in page


@pytest.mark.slow
def test_its_verification(result, run_cli):
    assert run_cli("verify", result[1]).code == 0


def test_one_flag_applies_it(result, logs, run_cli, tmp_path):
    calibration = result[1] / "calibration.toml"
    out = tmp_path / "converted.csv"
    done = run_cli("convert", logs[1], out, "--calibration", calibration)
    assert done.code == 0, done.err
    raw, less = sd.read_imu(logs[1]), sd.read_imu(logs[1], calibration=calibration)
    force = [np.linalg.norm(one.filter(like="accel").mean()) for one in (raw, less)]
    # Bounds of scale and bias beside gravity: 1 mg; raw errors are some per cent.
    assert abs(force[1] - GRAVITY) < 0.02 < abs(force[0] - GRAVITY)
    written = sd.read_imu(out)
    assert written.filter(like="accel").mean().to_numpy() == pytest.approx(
        less.filter(like="accel").mean().to_numpy(), abs=1e-6
    )
    codes = [f.code for f in less.findings]
    assert "calibrate.applied" in codes and "calibrate.of-another-sensor" not in codes
    # Of another sensor, as in a folder of several.
    other = tmp_path / "other.toml"
    text = [line for line in calibration.read_text().splitlines() if not line.startswith("seal")]
    row = next(k for k, line in enumerate(text) if line.startswith("bias_rad_per_s"))
    text[row] = "bias_rad_per_s = [0.3, -0.2, 0.1]"
    other.write_text("\n".join(text))
    codes = [f.code for f in sd.read_imu(logs[1], calibration=other).findings]
    assert "calibrate.of-another-sensor" in codes
    # Another mounting of the same sensor: the same vectors in other axes.
    turned = sd.read_imu(logs[1], axes="y,-x,z", calibration=calibration)
    assert turned["gyro_x"].to_numpy() == pytest.approx(less["gyro_y"].to_numpy(), abs=1e-12)
    folder = tmp_path / "attitude"
    options = ["--calibration", calibration, "--gyro-bias", "none", "--no-report"]
    done = run_cli("attitude", logs[1], "--algorithms", "quaternion", *options, "--out", folder)
    assert done.code == 0, done.err
    roles = [i["role"] for i in json.loads((folder / "manifest.json").read_text())["inputs"]]
    assert roles == ["log", "calibration"]
    assert run_cli("verify", folder).code == 0


@pytest.mark.slow
def test_what_is_left_enters_the_filters(result, logs, run_cli, tmp_path):
    from strapdown.config.alignment import sensors_of
    from strapdown.config.navigation import NavigationSpec

    calibration = result[1] / "calibration.toml"
    file = tmp_path / "navigate.toml"
    options = ["--sensor", "mpu-6050", "--calibration", calibration, "--out", file]
    done = run_cli("init", "navigate", logs[1], *options)
    assert done.code == 0, done.err
    text = file.read_text()
    assert "calibration = " in text
    text = text.replace('"?"', "48.0")
    file.write_text(text)
    spec = NavigationSpec.read(file)
    left, made = sensors_of(spec), SensorCalibration.read(calibration)
    assert max(left.gyro.axis("bias")) == pytest.approx(max(made.gyro.axis("bias")))
    table = spec.log.model_copy(update={"calibration": None})
    sheet = sensors_of(spec.model_copy(update={"log": table}))
    assert max(left.gyro.axis("bias")) < 0.1 * max(sheet.gyro.axis("bias"))
    stated = spec.sensors.model_copy(update={"gyro": {"bias_sd_deg_per_h": 36.0}})
    own = sensors_of(spec.model_copy(update={"sensors": stated}))
    assert own.gyro.axis("bias")[0] == pytest.approx(np.radians(0.01))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "code", "word"),
    [
        (["--axes", "x,-y,-z"], 4, "--axes"),
        (["--turns", "twice"], 4, "twice"),
        (["--turns", "none.csv"], 4, "none.csv"),
        (["--turns", "1000"], 3, "1 turns are stated"),
        (["--procedure", "turns"], 4, "--turns"),
        (["--procedure", "cube"], 4, "--procedure"),
        (["--gravity", "5"], 4, "--gravity"),
        (["--gravity", "981"], 4, "980 Gal"),
        (["gravity=9.8"], 4, "--gravity 9.8"),
        (["lat_deg=48"], 4, "--lat 48"),
        (["--to", "1.5", "--from", "0"], 0, "not observed"),
        (["--from", "2.2", "--to", "2.8"], 3, "poses.csv, log: the logs show no rest"),
    ],
)
def test_what_it_refuses_and_what_it_says(logs, run_cli, tmp_path, options, code, word):
    done = run_cli("calibrate", logs[0], *options, "--no-report", "--out", tmp_path / "a")
    assert done.code == code, done.err
    assert word in done.err + done.out


def test_a_table_of_turns_and_files_that_are_no_calibration(result, logs, run_cli, tmp_path):
    table = tmp_path / "turns.csv"
    table.write_text("axis,angle_deg,sd_deg\nx,many,1\n")
    done = run_cli("calibrate", logs[0], "--turns", table, "--out", tmp_path / "a")
    assert (done.code, "row 2" in done.err) == (3, True)
    table.write_text("axis,rate_deg_per_s,from_s,to_s\nx,10,,\n")
    done = run_cli("calibrate", logs[0], "--turns", table, "--out", tmp_path / "b")
    assert done.code == 4, done.err
    calibration = result[1] / "calibration.toml"
    done = run_cli("calibrate", logs[0], "--calibration", calibration, "--out", tmp_path / "c")
    assert done.code == 4, done.err
    done = run_cli("convert", logs[1], tmp_path / "d.csv", "--calibration", logs[1])
    assert done.code == 3, done.err
    assert "calibration.toml" in done.err


def test_a_column_of_temperature_shows_the_slopes_and_is_used(run_cli, tmp_path):
    """As `allan` reads it: of the log itself, in calibration and in application."""
    errors, draw = unit(4), np.random.default_rng(4)
    poses = [facing(up) for up in POSES[:12]]
    made = record(*by_hand(poses[0], between(poses), draw, rest=2.0), errors, 4)
    time = made.imu.index.to_numpy()
    warmth, slope = 20.0 + 30.0 * time / time[-1], np.array([2e-4, -1e-4, 5e-5])
    values = made.imu.to_numpy().copy()
    values[:, :3] += (warmth[:, None] - 35.0) * slope
    path = tmp_path / "warm.csv"
    names = [*NAMES, "temperature_degC"]
    header = {"axes": "forward-right-down", "sampling": "instantaneous"}
    csv.write(path, dict(zip(names, [time, *values.T, warmth], strict=True)), header)
    run = sd.calibrate(path, gravity_m_per_s2=GRAVITY)
    found = run.calibration
    at = found.names.index("gyro_temperature_x")
    assert found.temperature_slopes[0] == pytest.approx(
        slope, abs=4.0 * found.sd[at : at + 3].max()
    )
    assert "io.columns-not-used" not in {f.code for f in run.findings}
    run.save(tmp_path / "out", report=False)
    imu = sd.read_imu(path, calibration=tmp_path / "out" / "calibration.toml")
    rate = imu.filter(like="gyro").to_numpy()
    ends = rate[:150].mean(axis=0), rate[-150:].mean(axis=0)
    # 30 °C change the bias by 0.006 rad/s; what is left is within the bounds, 0.0035 rad/s.
    assert np.abs(ends[0] - ends[1]).max() < 4.0 * 30.0 * found.sd[at : at + 3].max()


#: What is wrong with a file, what it does to its text, the code, and a word of the message.
DAMAGE = (
    ("a digit", lambda t: re.sub(r"\]\nbias_sd", r"1]\nbias_sd", t, count=1), "file-changed"),
    ("its end", lambda t: t[: t.index("[gyro]")], "file-changed"),
    ("its middle", lambda t: t[: t.index("scale_sd") + 14], "file-no-toml"),
    ("a key", lambda t: unsealed(t).replace("scale_sd", "scale_sdd", 1), "file-without-key"),
    ("a word", lambda t: unsealed(t).replace("scale = [", 'scale = ["a", '), "file-value"),
    ("all", lambda t: "time,gyro_x\n0.0,1.0\n", "file-no-toml"),
    ("a sensor", lambda t: (sensors.FOLDER / "mpu-6050.toml").read_text(), "file-of-sensor"),
    ("another", lambda t: "[log]\npath = 'a.csv'\n", "no-calibration"),
    ("no accelerometer", lambda t: 'procedure = "magnetometer"\n', "file-of-magnetometer"),
)


def unsealed(text):
    return "".join(line for line in text.splitlines(keepends=True) if not line.startswith("seal"))


@pytest.mark.parametrize(("what", "change", "code"), DAMAGE, ids=[d[0] for d in DAMAGE])
def test_a_damaged_file_is_said_to_be_damaged_where(result, tmp_path, what, change, code):
    text = (result[1] / "calibration.toml").read_text()
    file = tmp_path / "calibration.toml"
    # Other ends of lines are no change, nor is a file without a seal.
    for same in (text, text.replace("\n", "\r\n"), unsealed(text)):
        file.write_text(same, newline="")
        made = SensorCalibration.read(file)
    file.write_text(change(text))
    assert file.read_text() != text
    with pytest.raises(DataError) as caught:
        SensorCalibration.read(file)
    assert caught.value.finding.code == f"calibrate.{code}", what
    assert made.gyro.axis("bias")[0] > 0.0


def test_bytes_that_are_no_text(result, tmp_path):
    file = tmp_path / "calibration.toml"
    file.write_bytes((result[1] / "calibration.toml").read_bytes().replace(b"gyro", b"g\xffro"))
    with pytest.raises(DataError) as caught:
        SensorCalibration.read(file)
    assert caught.value.finding.code == "calibrate.file-not-text"
    assert caught.value.finding.row > 1


def test_the_two_options_name_each_other(result, logs, run_cli, tmp_path):
    calibration, out = result[1] / "calibration.toml", tmp_path / "out"
    done = run_cli("calibrate", logs[0], "--sensor", calibration, "--out", out)
    assert done.code == 4, done.err
    assert "--calibration" in done.err
    sheet = sensors.FOLDER / "mpu-6050.toml"
    done = run_cli("convert", logs[1], tmp_path / "c.csv", "--calibration", sheet)
    assert done.code == 3, done.err
    assert "--sensor" in done.err


def test_from_arrays(logs):
    for wrong in ({"gravity": 9.81}, {"g": 9.81}, {"lat_deg": 48.0}):
        with pytest.raises(ConfigError) as caught:
            sd.calibrate(logs[0], **wrong)
        assert caught.value.finding.code == "calibrate.unknown-option"
        assert "gravity_m_per_s2" in str(caught.value)
    samples = sd.read_imu(logs[0]).iloc[:2000]
    run = sd.calibrate((samples.index, samples.iloc[:, :3], samples.iloc[:, 3:6]), lat=48.0)
    assert "not_observed" in run.calibration_text()
    assert list(run.parameters.columns)[:3] == ["parameter", "value", "sd"]
    assert run.plot() is not None
    assert run.findings[0].code.startswith("calibrate.not-observed")


def test_how_the_axes_lie_in_the_case_is_a_line_with_a_number(result, logs, run_cli, tmp_path):
    """The part of a misalignment that no gravity shows: a rotation of all three axes."""
    calibration = result[1] / "calibration.toml"
    made = SensorCalibration.read(calibration)
    # A misalignment of 0.03 rad of each of two axes, half the difference.
    assert made.case == pytest.approx([0.03 / np.sqrt(2.0)] * 3)
    assert tomllib.loads(calibration.read_text())["case"]["rotation_sd_rad"] == pytest.approx(
        made.case
    )
    (said,) = [
        f
        for f in sd.read_imu(logs[1], calibration=calibration).findings
        if f.code == "calibrate.axes-in-case"
    ]
    assert said.data["deg"] == pytest.approx(1.96 * np.degrees(0.03 / np.sqrt(2.0)), rel=1e-3)
    # A data sheet that states less makes it less.
    sheet = tmp_path / "sheet.toml"
    text = (sensors.FOLDER / "mpu-6050.toml").read_text()
    sheet.write_text(text)
    known = load_sensor(sheet)
    run = sd.calibrate(logs[0], gravity_m_per_s2=GRAVITY, sensor=sheet)
    own = ImuUncertainty.of_sensor(known).accel.axis("misalignment")
    assert run.sensor.case == pytest.approx(0.5 * np.hypot(own, np.roll(own, 1)), rel=1e-6)
    # In other axes each rotation is about the same line.
    swap = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    odd = replace(made, case=(0.01, 0.02, 0.03))
    assert odd.turned(swap).case == (0.02, 0.01, 0.03)
    folder = tmp_path / "attitude"
    options = ["--calibration", calibration, "--gyro-bias", "none", "--no-report"]
    done = run_cli("attitude", logs[1], "--algorithms", "quaternion", *options, "--out", folder)
    assert "2.4° about each" in " ".join((done.out + done.err).split())


def test_the_rotation_of_simulated_units_is_within_it():
    """Antisymmetric parts of drawn misalignments, which `in_accel_axes` takes off."""
    skew = []
    for seed in range(100):
        m = np.array(unit(seed).accel.misalignment)
        skew.append(0.5 * np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]]))
    inside = int((np.abs(skew) < 1.96 * np.array(CASE)).sum())
    assert beta.ppf(0.995, inside + 1, 300 - inside) >= 0.95 > beta.ppf(0.005, inside, 301 - inside)
