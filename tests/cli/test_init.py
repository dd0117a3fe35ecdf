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
    assert "left: one range; struck at" in done.out
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
