"""The options of `strapdown attitude` that say what to run and to write."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from strapdown import simulate
from strapdown.formats.writers import WRITERS
from strapdown.simulation import ImuErrors, simulate_imu
from strapdown.simulation.attitude_motions import Handling

#: Without the page, which takes as long as the runs and has tests of its own.
FEW = ["--algorithms", "naive quaternion", "--rates", "50,25", "--no-report"]


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    for name, scenario, rate in (
        ("a", "gestures", 50),
        ("b", "gestures", 100),
        ("c", "alexiev-fig2e", 50),
    ):
        simulate(scenario, rate_hz=rate).save(folder / name, formats=["csv"])
    return {name: folder / name / "log.csv" for name in "abc"}


def configuration(folder):
    return json.loads((folder / "manifest.json").read_text(encoding="utf-8"))["configuration"]


def test_what_was_asked_for_is_what_was_run(here, run_cli):
    found = run_cli(
        *("attitude", "alexiev-fig2d", *FEW, "--tolerance-deg", "2.5", "--trials", "2"),
        *("--seed", "7", "--sensor", "stim300", "--interpolation", "cubic", "--out", "out"),
        "--quiet",
    )
    assert (found.code, found.err) == (0, "")
    told = configuration(here / "out")
    assert told["algorithms"] == ["naive", "quaternion"]
    assert told["rates_hz"] == [50.0, 25.0]
    assert told["tolerance_deg"] == 2.5
    assert told["interpolation"] == "cubic"
    scenarios = [told["source"], *told["also"]]
    assert [(s["seed"], s["sensor"], s["rate_hz"]) for s in scenarios] == [
        (7, "stim300", 50.0),
        (8, "stim300", 50.0),
    ]


def test_all_algorithms(here, run_cli):
    run_cli(
        *("attitude", "alexiev-fig2a", "--algorithms", "all", "--rates", "50", "--out", "out"),
        "--no-report",
    )
    told = configuration(here / "out")["algorithms"]
    assert told[:5] == ["naive", "euler", "dcm", "quaternion", "rk4"]
    variants = ["1", "1,previous=true", "2", "3", "4"]
    assert [t.partition("samples=")[2] for t in told[5:]] == variants


def test_several_logs_are_named_one_after_the_other(here, run_cli, logs):
    found = run_cli("attitude", logs["a"], logs["c"], *FEW, "--out", "out", "--quiet")
    assert found.code == 0
    told = configuration(here / "out")
    assert len(told["also"]) == 1
    assert run_cli("verify", "out").out.startswith("identical")


def test_a_second_log_and_rests(here, run_cli, logs):
    found = run_cli(
        *("attitude", logs["a"], *FEW, "--reference-log", logs["b"], "--reference", "rests"),
        *("--gyro-bias", "rests", "--out", "out", "--quiet"),
    )
    assert found.code == 0
    assert configuration(here / "out")["reference_log_path"] == "inputs/reference-log/log.csv"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--rates", "abc"], "'abc' is not a list of numbers"),
        (["--rates=-5"], "a rate of -5 Hz is not positive"),
        (["--rates", "nan"], "a rate of nan Hz is not positive"),
        (["--rates", "50,0"], "a rate of 0 Hz is not positive"),
        (["--rate", "100", "--rates", "0.01"], "fewer than two steps"),
        (["--tolerance-deg", "0"], "--tolerance-deg"),
        (["--tolerance-deg", "nan"], "--tolerance-deg"),
        (["--trials", "0"], "0 trials are out of range"),
        (["--sensor", "nosuch"], "unknown sensor 'nosuch'"),
        (["--sensor", "nosuch.toml"], "does not exist"),
        (["--interpolation", "spline"], "Known: linear, cubic"),
        (["--peers", "nosuch"], "unknown library 'nosuch'"),
        (["--peers", "vqf:nosuch"], "unknown filter 'nosuch' of vqf"),
        (["--reference-log", "nosuch.csv"], "does not exist"),
        (["--export", "nosuch/x.c"], "the folder does not exist"),
        (["--export", "there.c"], "the file exists"),
        (["--export", "folder.c", "--force"], "it is a folder"),
        (["--export", "log.csv", "--force"], "must end in .c or .py"),
        (["--export-of", "quaternion"], "no file to write it to"),
        (["--export", "x.c", "--export-of", "quaternoin"], "quaternoin"),
        (["--export", "x.c", "--export-of", "error-state:velocity=-1"], "-1"),
        (
            ["--export", "x.c", "--tolerance-deg", "1e-9"],
            "no algorithm reached the required accuracy",
        ),
    ],
)
def test_what_cannot_be_had_is_told_and_leaves_nothing(here, run_cli, options, said):
    (here / "there.c").write_text("int there;\n")
    (here / "log.csv").write_text("a log\n")
    (here / "folder.c").mkdir()
    asked = ["attitude", "coning-slow", "--algorithms", "naive quaternion"]
    found = run_cli(*asked, *([] if "--rates" in options[0] else ["--rates", "50"]), *options)
    assert found.code == 4
    assert found.err.startswith("error: ")
    assert said in found.err
    assert "Remedy: " in found.err
    assert "Traceback" not in found.err
    assert sorted(p.name for p in here.iterdir()) == ["folder.c", "log.csv", "there.c"]
    assert (here / "there.c").read_text() == "int there;\n"
    assert (here / "log.csv").read_text() == "a log\n"


def test_a_log_is_not_drawn_again(here, run_cli, logs):
    found = run_cli("attitude", logs["c"], "--trials", "3")
    assert found.code == 4
    assert "give several logs instead" in found.err
    twice = run_cli("attitude", logs["c"], logs["c"])
    assert twice.code == 4
    assert "given twice" in twice.err


def test_a_second_log_of_another_motion(here, run_cli, logs):
    other, _ = simulate_imu(Handling(duration=30.0, seed=77), ImuErrors(), rate=100.0)
    WRITERS["csv"].write(here / "other.csv", {"imu": other})
    found = run_cli("attitude", logs["a"], "--reference-log", "other.csv")
    assert found.code == 3
    assert "Traceback" not in found.err
    assert not list(here.glob("*-attitude"))


def test_the_chosen_algorithm_as_c(here, run_cli):
    asked = ["attitude", "alexiev-fig4", *FEW, "--rate", "100", "--quiet"]
    assert run_cli(*asked, "--out", "one", "--export", "one.c").code == 0
    assert "quaternion" in (here / "one.c").read_text(encoding="utf-8")
    again = run_cli(*asked, "--out", "two", "--export", "one.c", "--force")
    assert again.code == 0
    assert not list(here.glob("*.partial"))


def test_a_filter_and_an_algorithm_by_name_for_a_device(here, run_cli, logs):
    asked = ["attitude", logs["a"], "--algorithms", "quaternion", "--rates", "50", "--force"]
    asked.append("--no-report")
    shown = run_cli(*asked, "--export", "a.py", "--export-of", "complementary:tilt=2")
    assert shown.code == 0
    assert "MicroPython   a.py: complementary:tilt=2" in shown.out
    text = (here / "a.py").read_text(encoding="utf-8")
    assert "min(2.0, START_TIME" in text
    done = subprocess.run(
        [sys.executable, "a.py"], cwd=here, capture_output=True, text=True, check=False
    )
    assert done.stdout.endswith("passed\n")
    assert run_cli(*asked, "--quiet", "--export", "a.c", "--export-of", "rotvec").code == 0
    assert "rotvec" in (here / "a.c").read_text(encoding="utf-8")


def test_a_filter_for_a_log_without_an_accelerometer(here, run_cli):
    rows = "\n".join(f"{0.02 * k:.2f},0.1,0.2,{0.01 * k:.2f}" for k in range(200))
    text = f"time_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s\n{rows}\n"
    (here / "log.csv").write_text(f"# axes: forward-right-down\n{text}")
    found = run_cli("attitude", "log.csv", "--export", "a.c", "--export-of", "error-state")
    assert found.code == 3
    assert "error-state needs an accelerometer" in found.err
    assert sorted(p.name for p in here.iterdir()) == ["log.csv"]
