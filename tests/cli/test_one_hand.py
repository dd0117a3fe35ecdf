"""The commands as one hand made them: one word for one thing, in one order, in one group."""

from __future__ import annotations

import json
import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from typer.main import get_command

from strapdown.cli.main import COMMANDS as SENTENCES
from strapdown.cli.main import app
from strapdown.cli.result_folder import default_folder, folder_to_write
from strapdown.cli.shared_options import LogFlags

LOG_PANEL, OUT_PANEL = "How to read the log", "What to write"
ROOT = get_command(app)
COMMANDS = {
    **{name: ROOT.get_command(None, name) for name in ROOT.list_commands(None) if name != "init"},
    **{f"init {n}": one for n, one in ROOT.get_command(None, "init").commands.items()},
}
READS_A_LOG = (
    "allan",
    "calibrate",
    "extrinsics",
    "attitude",
    "align",
    "navigate",
    "init align",
    "init navigate",
)
TABULAR = {
    *("attitude", "align", "navigate", "outage", "crash", "simulate", "verify", "modules"),
    *("allan", "calibrate", "extrinsics", "sensors", "doctor", "convert", "export"),
    "compare",
}
#: What one word says of two things: of a scenario beside a log, of a start beside a place.
OF_ITS_OWN = {
    *(("simulate", flag) for flag in ("--rate", "--sampling", "--sensor", "--seed", "--format")),
    *(("attitude", flag) for flag in ("--sensor", "--seed")),
    *(("outage", flag) for flag in ("--lat", "--heading", "--from")),
    *(("navigate", flag) for flag in ("--lat",)),
    *(("init navigate", flag) for flag in ("--sensor",)),
    *(("align", flag) for flag in ("--gnss",)),
    *(("studio", flag) for flag in ("--map", "--listen", "--port", "--host")),
    *(("live", flag) for flag in ("--every", "--lines", "--token")),
    *(("crash", flag) for flag in ("--live", "--every", "--calibration", "--export")),
}


def options(command):
    return [p for p in command.params if p.param_type_name == "option" and p.name != "help"]


def test_the_list_of_all_commands_says_of_each_what_its_own_help_begins_with():
    assert {
        name: ROOT.get_command(None, name).help.partition("\n\n")[0] for name in SENTENCES
    } == SENTENCES


def test_options_of_reading_a_log_are_the_same_in_the_same_order():
    names = [f.name for f in fields(LogFlags)]
    for name in READS_A_LOG:
        command = COMMANDS[name]
        own = [p.name for p in options(command) if p.rich_help_panel == LOG_PANEL]
        assert own == names, name


def test_a_flag_has_one_meaning_one_form_and_one_group():
    said = {}
    for name, command in COMMANDS.items():
        for option in options(command):
            flag = next(o for o in option.opts if o.startswith("--"))
            if (name, flag) in OF_ITS_OWN or flag in ("--out", "--force"):
                continue
            panel = None if name == "outage" or flag == "--sensor" else option.rich_help_panel
            form = (option.help, option.metavar)
            first = said.setdefault(flag, (form, panel, name))
            assert form == first[0], (flag, name, first[2])
            if None not in (panel, first[1]):
                assert panel == first[1], (flag, name, first[2])


def test_every_option_stands_in_a_group_and_the_usual_ones_come_last():
    for name, command in COMMANDS.items():
        assert all(p.rich_help_panel for p in options(command)), name
        written = [p.name for p in options(command) if p.rich_help_panel == OUT_PANEL]
        usual = [
            n for n in ("out", "no_report", "force", "json", "quiet", "verbose") if n in written
        ]
        assert written[len(written) - len(usual) :] == usual, name
    assert {
        name for name, c in COMMANDS.items() if any(p.name == "json" for p in options(c))
    } == TABULAR


@pytest.mark.parametrize("columns", ["80", "110"])
def test_help_tells_defaults_in_one_way_and_ends_with_an_example(run_cli, monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", columns)
    for name in COMMANDS:
        text = run_cli(*name.split(), "--help").out
        assert "[default" not in text, name
        tail = " ".join(text[text.rindex("╯") :].split())
        assert re.match(r"╯ Example: strapdown ", tail), name


# --- which part of a log ------------------------------------------------------------------


def log(path: Path, seconds: float = 10.0) -> Path:
    """A sensor that lies still, 50 Hz, on a clock that begins at 100 s."""
    rows = (f"{100.0 + k / 50.0:.2f},0,0,0,0,0,-9.81" for k in range(int(50 * seconds) + 1))
    head = "time_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x,accel_y,accel_z"
    path.write_text("\n".join([head, *rows]) + "\n")
    return path


SPANS = [
    (("--from", "102", "--to", "105"), (102.0, 105.0)),
    (("--from", "102", "--duration", "3"), (102.0, 105.0)),
    (("--to", "103"), (100.0, 103.0)),
    (("--duration", "3"), (100.0, 103.0)),
    (("--from", "107"), (107.0, 110.0)),
]


@pytest.mark.parametrize(("flags", "span"), SPANS)
def test_attitude_takes_the_part_that_flags_name(tmp_path, run_cli, flags, span):
    run_cli("attitude", log(tmp_path / "log.csv"), *flags, "--out", tmp_path / "out", "-q")
    told = json.loads((tmp_path / "out" / "attitude.json").read_text())
    text = json.dumps(told)
    assert f"from {span[0]:g} to {span[1]:g} s of one from 100 to 110 s" in text


@pytest.mark.parametrize("command", ["align", "navigate"])
@pytest.mark.parametrize(("flags", "span"), SPANS)
def test_a_draft_keeps_the_part_that_flags_name(
    tmp_path, run_cli, monkeypatch, command, flags, span
):
    monkeypatch.chdir(tmp_path)
    log(tmp_path / "log.csv")
    done = run_cli("init", command, "log.csv", *flags, "--accel-unit", "m/s2")
    assert done.code == 0, done.err
    assert f"{span[0]:g} to {span[1]:g} s" in done.out
    text = (tmp_path / f"{command}.toml").read_text()
    for flag, value in zip(flags[::2], flags[1::2], strict=True):
        assert f"\n{flag[2:]}_s = {float(value)}" in text


@pytest.mark.parametrize("command", ["attitude", "align", "navigate", "outage"])
@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (("--to", "5", "--duration", "5"), "error: --to, --duration: "),
        (("--duration", "0"), "error: --duration: a duration of 0 s is not positive"),
        (("--from", "7", "--to", "5"), "error: --to: 5 s is not after the begin at 7 s"),
        (("--from", "nan"), "error: --from: nan is not a finite number"),
    ],
)
def test_a_part_that_cannot_be_meant_is_refused_alike(tmp_path, run_cli, command, flags, said):
    source = "adis16470" if command == "outage" else log(tmp_path / "log.csv")
    more = () if command in ("attitude", "outage") else ("--lat", "55", "--lon", "37")
    more = (*more, "--sensor", "fog-1000") if command in ("align", "navigate") else more
    done = run_cli(command, source, *more, *flags, "--out", tmp_path / "out")
    assert (done.code, done.out) == (4, "")
    assert done.err.startswith(said)
    assert not (tmp_path / "out").exists()


# --- folders of results -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("source", "ending", "named", "folder"),
    [
        ("drive.csv", "navigate", None, "drive-navigate"),
        ("a/navigate.toml", "navigate", "drive.v2.csv", "drive.v2-navigate"),
        ("navigate.toml", "navigate", "simulated", "simulated-navigate"),
        ("night.toml", "navigate", "drive.csv", "night-navigate"),
        ("night-navigate.toml", "navigate", "drive.csv", "night-navigate"),
        ("align.toml", "align", "rest.imu", "rest-align"),
        ("navigate.toml", "outage", "drive.csv", "drive-outage"),
        ("case.toml", "crash", None, "case-crash"),
        ("crash.toml", "crash", None, "crash-result"),
        ("adis16470", "outage", None, "adis16470-outage"),
        ("alexiev-fig4", "simulated", None, "alexiev-fig4-simulated"),
    ],
)
def test_a_result_is_named_after_what_it_is_of(source, ending, named, folder):
    assert default_folder(source, ending, named) == Path(folder)


def test_a_folder_keeps_its_whole_name_and_a_result_of_a_result_has_one_ending(tmp_path):
    for name in ("drive.2018", "drive-navigate"):
        (tmp_path / name).mkdir()
    assert default_folder(tmp_path / "drive.2018", "align") == Path("drive.2018-align")
    assert default_folder(tmp_path / "drive-navigate", "outage") == Path("drive-outage")
    (tmp_path / "drive-navigate-2").mkdir()
    assert default_folder(tmp_path / "drive-navigate-2", "outage") == Path("drive-outage")


def test_a_second_try_with_an_answer_more_has_a_folder_of_its_own(tmp_path, monkeypatch, run_cli):
    """The command that `doctor` prints can be typed; the first result is not replaced."""
    monkeypatch.chdir(tmp_path)
    stamps = 0.01 * np.arange(500)
    rows = "".join(f"{t:.2f},{np.sin(t):.5f},0.1,0.2,0.0,0.0,9.8\n" for t in stamps)
    Path("log.csv").write_text("time_s,gx,gy,gz,ax,ay,az\n" + rows)
    folders = ["log-doctor", "log-doctor-2", "log-doctor-3"]
    for folder, unit in zip(folders, ("rad/s", "deg/s", "deg/s"), strict=True):
        done = run_cli("doctor", "log.csv", "--gyro-unit", unit, "--no-report")
        assert done.code == 0 and f"/{folder}\n" in done.out
    assert [Path(f).is_dir() for f in folders] == [True] * 3
    before = Path("log-doctor/doctor.json").read_bytes()
    done = run_cli("doctor", "log.csv", "--gyro-unit", "deg/s", "--no-report", "--force")
    assert done.code == 0 and Path("log-doctor/doctor.json").read_bytes() != before
    # A folder that is asked for is that folder, and an empty one is free.
    assert folder_to_write(Path("log-doctor"), "log.csv", "doctor", False) == Path("log-doctor")
    Path("x-align").mkdir()
    assert folder_to_write(None, "x.csv", "align", False) == Path("x-align")


@pytest.fixture(scope="module")
def results(tmp_path_factory, run_cli):
    """Results of two commands, by their names."""
    root = tmp_path_factory.mktemp("results")
    assert run_cli("attitude", log(root / "log.csv"), "-q", "--out", root / "rest").code == 0
    assert run_cli("simulate", "alexiev-fig2a", "-q", "--out", root / "made").code == 0
    assert run_cli("simulate", "pole", "-q", "--out", root / "pole").code == 0
    return root


@pytest.mark.parametrize(
    "command", ["attitude", "align", "navigate", "crash", "init navigate", "init align"]
)
def test_a_result_in_place_of_a_log_is_known_for_what_it_is(results, run_cli, command):
    done = run_cli(*command.split(), results / "rest", "--out", results / "out.toml")
    assert (done.code, done.out) == (4, "")
    assert "it is a result of strapdown attitude, not a " in done.err
    assert f"open {results / 'rest' / 'report.html'}" in done.err
    assert f"strapdown verify {results / 'rest'}" in done.err
    assert str(results / "rest" / "inputs" / "log" / "log.csv") in done.err
    done = run_cli(*command.split(), results / "pole", "--out", results / "out.toml")
    assert f"strapdown crash {results / 'pole' / 'case.toml'}" in done.err
    done = run_cli(*command.split(), results / "made", "--out", results / "out.toml")
    assert str(results / "made" / "log.csv") in done.err
    assert not (results / "out.toml").exists()


def test_a_folder_of_logs_names_them(tmp_path, run_cli):
    (tmp_path / "LICENSE").write_text("free\n")
    (tmp_path / "notes.txt").write_text("day,weather\n1,2\n2,3\n")
    said = run_cli("init", "navigate", tmp_path, "--foot", "--out", tmp_path / "x.toml").err
    assert "it has: LICENSE, notes.txt" in said
    log(tmp_path / "one.csv")
    said = run_cli("init", "navigate", tmp_path, "--foot", "--out", tmp_path / "x.toml").err
    assert "contains one recording: one.csv" in said
    assert f"give it: {tmp_path / 'one.csv'}" in said
    log(tmp_path / "two.csv")
    # A table of fixes is no log to navigate by.
    (tmp_path / "fixes.csv").write_text("time,lat,lon,alt\n1,55,37,100\n2,55,37,100\n")
    said = run_cli("init", "navigate", tmp_path, "--foot", "--out", tmp_path / "x.toml").err
    assert "contains several recordings: one.csv, two.csv" in said


# --- modules ------------------------------------------------------------------------------


def test_modules_as_json_hold_what_the_tables_hold(run_cli):
    lists = json.loads(run_cli("modules", "--json").out)
    text = run_cli("modules").out
    for key in ("attitude_algorithms", "aiding", "sensors", "formats"):
        for row in lists[key]:
            assert row["name"] in text
    assert {"name", "source", "options", "summary"} == set(lists["attitude_algorithms"][0])
    assert lists["ellipsoids"][0]["semi_major_axis_m"] > 6.3e6
