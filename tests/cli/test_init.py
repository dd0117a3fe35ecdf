"""strapdown init crash, as a user runs it."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest


@pytest.fixture
def record(tmp_path):
    """Two seconds at rest, and 27 km/h lost in a tenth of a second."""
    time = np.arange(0.0, 3.0, 0.005)
    rng = np.random.default_rng(0)
    values = rng.normal((0.0, 0.0, -9.80665), 0.05, (time.size, 3))
    blow = (time > 2.0) & (time < 2.1)
    values[blow, 0] -= 150.0 * np.sin(np.pi * (time[blow] - 2.0) / 0.1) ** 2
    path = tmp_path / "left.csv"
    rows = np.column_stack([time, values])
    np.savetxt(path, rows, fmt="%.4f", delimiter=",", header="t,ax,ay,az", comments="")
    return path


def test_it_writes_a_case_and_says_what_is_missing(run_cli, record, tmp_path):
    out = tmp_path / "case.toml"
    done = run_cli("init", "crash", record, "--out", out)
    assert (done.code, done.err) == (0, "")
    text = out.read_text(encoding="utf-8")
    table = tomllib.loads(text)
    assert table["units"][0]["accelerometers"][0]["path"] == "left.csv"
    assert "left: one range; impact at" in done.out
    assert "delta-V" in done.out and "(change of velocity, no speed)" in done.out
    # 150 m/s² times half of 0.1 s.
    assert "27 km/h" in done.out or "26.9 km/h" in done.out
    for k, line in enumerate(text.splitlines(), 1):
        if '"?"' in line and not line.startswith("#"):
            assert f"line {k:>3}  {line.split(' = ')[0]}: " in done.out
    assert f"strapdown crash {out}" in done.out


def test_an_open_case_is_refused_with_the_same_lines(run_cli, record, tmp_path):
    from strapdown.config.crash_case import CaseSpec
    from strapdown.errors import ConfigError

    out = tmp_path / "case.toml"
    done = run_cli("init", "crash", record, "--out", out)
    with pytest.raises(ConfigError) as caught:
        CaseSpec.read(out)
    asked = done.out.partition("Check; correct it in")[0]
    told = [line.split()[1] for line in asked.splitlines() if line.startswith("  line ")]
    for line in told:
        assert f"line {line}, " in str(caught.value)


def test_a_file_that_is_there_stays(run_cli, record, tmp_path):
    out = tmp_path / "case.toml"
    out.write_text("mine")
    done = run_cli("init", "crash", record, "--out", out)
    assert done.code == 4
    assert "case.toml, --out: the file exists" in done.err
    assert out.read_text() == "mine"
    assert run_cli("init", "crash", record, "--out", out, "--force", "--quiet").code == 0
    assert out.read_text().startswith("# A crash case")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["case.toml", "left.csv"]


def test_a_record_that_fails_leaves_nothing(run_cli, tmp_path):
    bad = tmp_path / "bad.csv"
    bad.write_text("t,ax\n0,1\n")
    done = run_cli("init", "crash", bad, "--out", tmp_path / "case.toml")
    assert done.code == 3
    assert "bad.csv: 1 sample is too few for a crash" in done.err
    assert [p.name for p in tmp_path.iterdir()] == ["bad.csv"]


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (["nowhere.csv"], 4, "nowhere.csv: the file"),
        ([], 2, "Missing argument"),
    ],
)
def test_what_was_not_understood(run_cli, arguments, code, told):
    done = run_cli("init", "crash", *arguments)
    assert done.code == code
    assert told in done.err


def test_one_record_twice(run_cli, record, tmp_path):
    done = run_cli("init", "crash", record, record, "--out", tmp_path / "case.toml")
    assert done.code == 4
    assert "left.csv, RECORD: the record is given twice" in done.err


def test_a_folder_is_no_place(run_cli, record, tmp_path):
    done = run_cli("init", "crash", record, "--out", tmp_path)
    assert done.code == 4
    assert f"--out {tmp_path / 'case.toml'}" in done.err


def test_quiet_prints_nothing(run_cli, record, tmp_path):
    done = run_cli("init", "crash", record, "--out", tmp_path / "case.toml", "-q")
    assert (done.code, done.out, done.err) == (0, "", "")


def test_help_says_what_it_does(run_cli):
    assert "crash" in run_cli("init", "--help").out
    page = run_cli("init", "crash", "--help").out
    assert "--out" in page
    assert "RECORD" in page


# A log and its fixes.


@pytest.fixture
def ride(tmp_path):
    """A level car at rest, and its fixes without velocities; and those of another ride."""
    rng = np.random.default_rng(4)
    time = np.arange(0.0, 60.0, 0.01)
    values = rng.normal((0.0, 0.0, 0.0, 0.0, 0.0, -9.81), [1e-3] * 3 + [0.02] * 3, (time.size, 6))
    log, fixes, other = (tmp_path / name for name in ("imu.csv", "fixes.csv", "other.csv"))
    names = [f"gyro_{a}_rad_s" for a in "xyz"] + [f"accel_{a}_m_s2" for a in "xyz"]
    rows = np.column_stack([time + 1.7e9, values])
    header = ",".join(["unix_time_s", *names])
    np.savetxt(log, rows, fmt="%.6f", delimiter=",", header=header, comments="")
    at = np.arange(0.0, 60.0)
    for path, begin in ((fixes, 1.7e9), (other, 1.7e9 + 5000.0)):
        places = np.column_stack([at + begin, 0.0 * at + 49.0, 0.0 * at + 8.4, 0.0 * at + 150.0])
        header = "unix_time_s,lat_deg,lon_deg,height_m"
        np.savetxt(path, places, fmt="%.6f", delimiter=",", header=header, comments="")
    return log, fixes, other


def test_fixes_may_be_the_second_argument(run_cli, ride, tmp_path):
    log, fixes, _ = ride
    outs = tmp_path / "a.toml", tmp_path / "b.toml"
    for out, arguments in zip(outs, ([fixes], ["--gnss", fixes]), strict=True):
        assert run_cli("init", "navigate", log, *arguments, "--out", out).code == 0
    assert outs[0].read_text() == outs[1].read_text()
    assert tomllib.loads(outs[0].read_text())["aiding"]["gnss"]["path"] == "fixes.csv"
    assert run_cli("init", "navigate", log, fixes, "--gnss", fixes).code == 4


def test_fixes_without_velocity_are_named_with_what_follows(run_cli, ride, tmp_path):
    log, fixes, _ = ride
    done = run_cli("init", "navigate", log, fixes, "--out", tmp_path / "a.toml")
    (line,) = [line for line in done.out.splitlines() if "no velocity" in line]
    assert "positions alone" in line


def test_fixes_of_another_time_are_refused_as_the_run_refuses_them(run_cli, ride, tmp_path):
    import strapdown as sd
    from strapdown.config.logs import FixesTable, LogTable
    from strapdown.errors import DataError
    from strapdown.systems.navigation_draft import draft_navigation

    log, _, other = ride
    done = run_cli("init", "navigate", log, other, "--out", tmp_path / "a.toml")
    assert done.code == 3
    assert not (tmp_path / "a.toml").exists()
    with pytest.raises(DataError) as proposed:
        draft_navigation(LogTable(path=str(log)), folder=tmp_path, gnss=FixesTable(path=str(other)))
    with pytest.raises(DataError) as run:
        sd.navigate(
            str(log),
            [sd.Gnss(str(other), position_sd_m=5.0)],
            sensor="mpu-9250",
            start={"heading_deg": 0.0},
        )
    assert proposed.value.finding.code == run.value.finding.code == "navigation.no-fix-in-record"


def test_a_test_of_two_vehicles_gives_a_case_for_each(run_cli, tmp_path):
    from tests.unit.crash.two_vehicles import recorded

    from strapdown.formats.crash_writers import write_nhtsa

    write_nhtsa(tmp_path / "test", recorded("car to car", "nhtsa"))
    out = tmp_path / "case.toml"
    (tmp_path / "case-2.toml").write_text("mine")
    done = run_cli("init", "crash", tmp_path / "test", "--out", out)
    # Nothing is written where one of the files exists.
    assert done.code == 4
    assert not (tmp_path / "case-1.toml").exists()
    done = run_cli("init", "crash", tmp_path / "test", "--out", out, "--force")
    assert (done.code, done.err, out.exists()) == (0, "", False)
    files = [tmp_path / f"case-{k}.toml" for k in (1, 2)]
    for name, file in zip(("Car A, 2018", "Car B"), files, strict=True):
        text = file.read_text(encoding="utf-8")
        assert tomllib.loads(text)["vehicle"]["name"] == name
        told = done.out.partition(f"Wrote {file}")[2].partition("Wrote ")[0]
        for k, line in enumerate(text.splitlines(), 1):
            if '"?"' in line and not line.startswith("#"):
                assert f"line {k:>3}  {line.split(' = ')[0]}: " in told
    assert "Vehicle 1: Car A, 2018" in done.out
    assert "channels 10, 11, 12: it moves with the engine" in done.out
    assert "channels 13, 14, 15: it moves with the driver's head" in done.out
    assert done.out.rstrip().endswith(f"Then   strapdown crash {files[0]} {files[1]}")


def test_columns_named_by_codes_of_iso_mme(run_cli, tmp_path):
    """A head was taken for the vehicle, the vehicle for its gyro, and a yaw rate for x."""
    time = np.arange(-0.05, 0.2, 1e-4)
    pulse = np.where((time > 0.0) & (time < 0.1), -np.sin(np.pi * time / 0.1), 0.0)
    names = [f"11HEAD0000H3AC{a}A" for a in "XYZ"] + [f"10VEHCCG0000AC{a}D" for a in "XYZ"]
    held = [40.0 * pulse, 3.0 * pulse, 9.0 * pulse, 30.0 * pulse, 2.0 * pulse, 3.0 * pulse]
    columns = [*held, 50.0 * pulse]
    rows = [f"{t:.4f},{','.join(f'{c[k]:.5f}' for c in columns)}" for k, t in enumerate(time)]
    units = ",".join(["s", *["g"] * 6, "deg/s"])
    path = tmp_path / "test.csv"
    path.write_text(
        "\n".join([",".join(["Time", *names, "10VEHCCG0000AVZD"]), units, *rows]) + "\n"
    )
    done = run_cli("init", "crash", path, "--out", tmp_path / "case.toml")
    assert done.code == 0, done.err
    (unit,) = tomllib.loads((tmp_path / "case.toml").read_text(encoding="utf-8"))["units"]
    (triad,) = unit["accelerometers"]
    assert triad["channels"] == {a: f"10VEHCCG0000AC{a.upper()}D" for a in "xyz"}
    assert unit["gyro"]["channels"] == {"z": "10VEHCCG0000AVZD"}
