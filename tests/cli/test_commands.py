"""The commands as a person and a script meet them."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import time
from itertools import pairwise

import pytest

from strapdown.cli.main import EXIT_CODES

COMMANDS = ["attitude", "simulate", "verify", "modules", "demo"]


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def shell(*arguments: str, cwd=None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "strapdown", *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        check=False,
        env={**os.environ, "TERM": "dumb", "COLUMNS": "120"},
    )


def test_help_of_every_command_has_a_working_example(here, run_cli):
    for command in COMMANDS:
        text = " ".join(run_cli(command, "--help").out.split())
        assert "Usage:" in text
        assert "Example: strapdown" in text.replace("│", " ")


def test_the_examples_of_the_help_work(here, run_cli):
    assert run_cli("attitude", "alexiev-fig4", "--rate", "100").code == 0
    lines = ["time_s,wx,wy,wz"] + [f"{0.01 * k:.2f},0,0,{k}" for k in range(30)]
    (here / "log.csv").write_text("\n".join(lines) + "\n")
    done = run_cli(
        "attitude", "log.csv", "--gyro-unit", "deg/s", "--reference", "end same as start"
    )
    assert done.code == 0
    options = ["--rate", "100", "--format", "all", "--out", "fig4"]
    assert run_cli("simulate", "alexiev-fig4", *options).code == 0
    assert run_cli("verify", "alexiev-fig4-attitude").out.startswith("identical")
    assert sorted(p.name for p in here.iterdir()) == [
        "alexiev-fig4-attitude",
        "fig4",
        "log-attitude",
        "log.csv",
    ]


def test_exit_codes_are_those_of_the_help(here, run_cli):
    assert "3 the data cannot be used" in " ".join(EXIT_CODES.split())
    (here / "empty.csv").write_text("")
    assert run_cli("attitude", "alexiev-fig4", "--quiet").code == 0
    assert run_cli("attitude").code == 2
    assert run_cli("attitude", "--no-such-option").code == 2
    assert run_cli("attitude", "empty.csv").code == 3
    assert run_cli("attitude", "alexiev-fig4", "--algorithms", "x", "--force").code == 4
    assert run_cli("verify", ".").code == 3
    page = here / "alexiev-fig4-attitude" / "report.html"
    page.write_bytes(page.read_bytes() + b" ")
    found = run_cli("verify", "alexiev-fig4-attitude")
    assert found.code == 6
    assert "report.html: changed after it was sealed" in found.out


def test_json_alone_is_json(here, run_cli):
    found = run_cli("attitude", "alexiev-fig4", "--json", "--no-report")
    result = json.loads(found.out)
    assert result == json.loads((here / "alexiev-fig4-attitude" / "attitude.json").read_text())
    names = [a["algorithm"] for a in result["algorithms"]]
    assert names == ["naive", "euler", "dcm", "quaternion", "rk4", "rotvec"]
    assert json.loads(run_cli("simulate", "alexiev-fig2a", "--json").out)["rate_hz"] == 100.0
    verdict = json.loads(run_cli("verify", "alexiev-fig4-attitude", "--json").out)["verdict"]
    assert verdict == "identical"


def test_quiet_says_nothing(here, run_cli):
    found = run_cli("attitude", "alexiev-fig4", "--quiet", "--no-report")
    assert (found.out, found.err) == ("", "")


def test_the_table_says_what_the_json_says(here, run_cli):
    text = run_cli("attitude", "alexiev-fig4", "--no-report").out
    result = json.loads((here / "alexiev-fig4-attitude" / "attitude.json").read_text())
    for name, error in [
        ("naive", r"5\.12°"),
        ("euler", r"2\.55°"),
        ("dcm", "< 1e-9°"),
        ("quaternion", "< 1e-9°"),
    ]:
        assert re.search(rf"{name}\s+{error}", text)
    assert result["answer"]["sentence"] in " ".join(text.split())
    assert "within" in result["answer"]["sentence"]
    assert "Seal  sha256" in text


def test_without_a_reference_it_says_what_it_can_tell_and_how_to_give_one(here, run_cli):
    lines = ["time_s,wx_dps,wy_dps,wz_dps"] + [f"{0.01 * k:.2f},0,{k},9" for k in range(300)]
    (here / "log.csv").write_text("\n".join(lines) + "\n")
    text = run_cli("attitude", "log.csv", "--no-report").out
    assert "differ by up to" in text
    assert "no stationary stretch" in text
    assert "--reference 'end same as start'" in text


@pytest.mark.parametrize(
    ("text", "labels"),
    [
        ("naive euler", ["naive", "euler"]),
        ("naive,dcm", ["naive", "dcm"]),
        (
            "dcm:order=3,orthogonalise_every=10, quaternion:normalise=no",
            ["dcm:order=3,orthogonalise_every=10", "quaternion:normalise=false"],
        ),
    ],
)
def test_algorithms_are_named_with_their_options(here, run_cli, text, labels):
    found = run_cli("attitude", "alexiev-fig4", "--algorithms", text, "--json", "--no-report")
    assert [a["algorithm"] for a in json.loads(found.out)["algorithms"]] == labels


def test_modules_lists_what_there_is(run_cli):
    text = run_cli("modules").out
    for word in (
        "naive",
        "euler",
        "dcm",
        "quaternion",
        "alexiev-fig4",
        "mpu-6050",
        "broad",
        "npz",
        "h5",
    ):
        assert word in text
    sensors = json.loads(run_cli("modules", "--json").out)["sensors"]
    assert {"name": "mpu-6050", "class": "phone", "sourced": "17 of 21"}.items() <= next(
        one.items() for one in sensors if one["name"] == "mpu-6050"
    )


def test_a_simulation_takes_a_named_sensor_or_a_file(here, run_cli):
    base = ["simulate", "alexiev-fig2a", "--rate", "20", "--json"]
    named = json.loads(run_cli(*base, "--sensor", "mpu-9250", "--out", "a").out)
    assert named["sensor"] == "mpu-9250"
    assert "noise_density_rad_per_s_per_sqrt_hz" in named["gyro_errors"]
    (here / "own.toml").write_text(
        'title = "x"\nclass = "phone"\nsummary = "x"\n[gyro]\n'
        'bias_bound_deg_per_s = { value = 1, assumed = "for this test" }\n'
    )
    own = json.loads(run_cli(*base, "--sensor", "own.toml", "--out", "b").out)
    assert list(own["gyro_errors"]) == ["bias_rad_per_s"]
    wrong = run_cli(*base, "--sensor", "mpu-9251", "--out", "c")
    assert wrong.code == 4
    assert "did you mean 'mpu-9250'" in wrong.err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("navigate", "log.csv", "--sensor", "x"), "error: --sensor: unknown sensor 'x'"),
        (("attitude", "log.csv", "--format=x"), "error: --format: unknown format of a log 'x'"),
    ],
)
def test_an_unknown_choice_is_named_by_its_option(tmp_path, given, said):
    rows = "\n".join(f"{k / 100},0.1,0.2,0.3,0,0,-9.8" for k in range(200))
    names = ",".join(
        f"{t}_{a}_{u}" for t, u in (("gyro", "rad_s"), ("accel", "m_s2")) for a in "xyz"
    )
    (tmp_path / "log.csv").write_text(f"time_s,{names}\n{rows}\n")
    done = shell(*given, "--out", "out", cwd=tmp_path)
    assert done.stderr.splitlines()[0] == said
    assert done.returncode == 4


@pytest.mark.slow
def test_python_m_strapdown_and_a_closed_pipe(tmp_path):
    assert shell("--version").stdout.startswith("strapdown 0.")
    done = shell("attitude", "no-such-log.csv", cwd=tmp_path)
    assert done.returncode == 4
    assert done.stderr.startswith("error: no-such-log.csv: the file")
    piped = subprocess.run(
        ["bash", "-c", f"set -o pipefail; {sys.executable} -m strapdown modules | head -1"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (piped.stderr, piped.returncode) == ("", 0)


def test_redirected_output_is_plain_text(run_cli):
    done = run_cli("modules")
    assert "quaternion" in done.out
    assert "\x1b[" not in done.out


@pytest.mark.slow
def test_a_terminal_without_degree_signs_gets_question_marks(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "strapdown", "attitude", "alexiev-fig4"],
        capture_output=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
        check=False,
    )
    assert done.returncode == 0
    assert b"5.12?" in done.stdout


@pytest.mark.parametrize("out", ["/dev/null/out", "file/out", "x" * 300])
def test_a_place_that_cannot_be_written_is_told_before_the_run(here, run_cli, out):
    (here / "file").write_text("")
    found = run_cli("attitude", "alexiev-fig4", "--out", out)
    assert found.code == 4
    assert found.err.startswith("error: ")
    assert "--out" in found.err


@pytest.mark.slow
def test_a_job_that_is_stopped_leaves_nothing_behind(tmp_path):
    job = subprocess.Popen(
        [sys.executable, "-m", "strapdown", "attitude", "alexiev-fig2c", "--rate", "2000"],
        cwd=tmp_path,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    deadline = time.monotonic() + 60
    while not list(tmp_path.glob(".*.partial")) and time.monotonic() < deadline:
        time.sleep(0.02)
    job.terminate()
    assert job.wait(60) == 128 + 15
    assert list(tmp_path.iterdir()) == []


def test_lines_of_the_help_break_where_the_terminal_ends_alone(run_cli):
    """No line of prose is broken while the next word would still have fitted."""
    for command in (*COMMANDS, "outage", "navigate"):
        head = run_cli(command, "--help").out.split("╭")[0].rstrip().splitlines()
        width = len(head[0]) or 80
        for line, following in pairwise(head):
            if line.strip() and following.strip():
                word = following.split()[0]
                assert len(line.rstrip()) + 1 + len(word) >= width - 1, (command, line)


def data_of(folder):
    """Bytes of the sealed outputs but page and figures, by name."""
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    return {
        item["name"]: item["sha256"]
        for item in manifest["outputs"]
        if not item["name"].startswith(("report.", "figures/"))
    }, manifest["configuration"]


def test_without_a_report_the_data_are_the_same_and_verify_repeats_them(here, run_cli):
    run_cli("attitude", "alexiev-fig4", "--quiet", "--out", "with")
    found = run_cli("attitude", "alexiev-fig4", "--no-report", "--out", "without")
    assert f"Data  {here / 'without' / 'attitude.json'}" in found.out.replace("\n", "")
    (all_data, stated), (data, lacking) = data_of(here / "with"), data_of(here / "without")
    assert data == all_data
    assert lacking == {**stated, "report": False}
    assert not (here / "without" / "report.html").exists()
    assert not (here / "without" / "figures").exists()
    assert json.loads(run_cli("verify", "without", "--json").out)["verdict"] == "identical"


def test_png_without_a_report_or_without_typst_is_refused_before_the_run(
    here, run_cli, monkeypatch
):
    found = run_cli("attitude", "alexiev-fig4", "--no-report", "--png")
    assert found.code == 4 and "--png" in found.err
    monkeypatch.setitem(sys.modules, "typst", None)
    found = run_cli("attitude", "alexiev-fig4", "--png")
    assert found.code == 4 and "strapdown[pdf]" in found.err
    assert list(here.iterdir()) == []
