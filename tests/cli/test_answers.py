"""The lines under a refusal that answer what a file leaves open."""

from __future__ import annotations

import subprocess
import sys

import pytest
import typer.main
from tests.coded import coded

from strapdown.cli.console import WORDS
from strapdown.cli.main import _answers, _refuse_placeholders, app, run
from strapdown.errors import ConfigError, Finding
from strapdown.formats import ReadOptions, read_log
from strapdown.formats.recording import as_stated


def answers(monkeypatch, command, words="cli", **data):
    monkeypatch.setattr(sys, "argv", ["strapdown", *command.split()])
    token = WORDS.set(words)
    try:
        return _answers(Finding("io.questions", data=data))
    finally:
        WORDS.reset(token)


def test_a_command_is_given_and_never_the_one_that_was_refused(monkeypatch):
    said = as_stated({"gyro_unit": "deg/s", "time": "Zeit (s)"})
    (line,) = answers(monkeypatch, "attitude a.csv", **said)
    flags = "--gyro-unit deg/s --columns 'time=Zeit (s)'"
    assert line == f"As inferred: strapdown attitude a.csv {flags}"
    said = as_stated({"gyro_unit": "deg/s"})
    assert answers(monkeypatch, "attitude a.csv --gyro-unit deg/s", **said) == []
    assert answers(monkeypatch, "attitude a.csv", **as_stated({})) == []


def test_a_name_that_steers_a_terminal_is_quoted_and_gives_the_same_words(monkeypatch):
    name = "time='\x1b[2J\\ \u202e"
    said = as_stated({"time": name})
    (line,) = answers(monkeypatch, "attitude a.csv", **said)
    assert line.isprintable()
    flags = line.partition(" a.csv ")[2]
    shell = ["bash", "-c", f"printf '%s\\0' {flags}"]
    done = subprocess.run(shell, capture_output=True, check=True, env={"LC_ALL": "C.UTF-8"})
    assert done.stdout.decode().split("\0")[:-1] == ["--columns", f"time={name}"]


OPEN = {
    "--gyro-unit UNIT": {"--gyro-unit": "UNIT"},
    "--accel-unit UNIT --rate HZ": {"--accel-unit": "UNIT", "--rate": "HZ"},
    "--columns gyro_x=1,time=NAME": {"--columns": "NAME"},
    "--sensor bmi160 --heading DEG": {"--heading": "DEG"},
    "--lat DEG --lon DEG --alt M": {"--lat": "DEG", "--lon": "DEG", "--alt": "M"},
    "--axes AXES": {"--axes": "AXES"},
    "--sensor SENSOR": {"--sensor": "SENSOR"},
}


@pytest.mark.parametrize("flags", OPEN)
def test_what_cannot_be_inferred_is_to_be_filled_in_and_explained(monkeypatch, flags):
    """By the help of the option, on the line that has the command."""
    (line,) = answers(monkeypatch, "navigate a.csv", flags=flags)
    said, command = line.split(": strapdown ")
    assert command == f"navigate a.csv {flags}"
    params = typer.main.get_command(app).get_command(None, "navigate").params
    helps = {option: p.help for p in params for option in p.opts}
    for option, word in OPEN[flags].items():
        assert f"{word} of {option} ({helps[option].rstrip('.')})" in said


@pytest.mark.parametrize("flags", [f for f in OPEN if "--columns" not in f])
def test_a_placeholder_that_is_left_is_refused_with_what_it_stands_for(monkeypatch, capsys, flags):
    monkeypatch.setattr(sys, "argv", ["strapdown", "navigate", "a.csv", *flags.split()])
    with pytest.raises(ConfigError, check=coded("cli.placeholder-left")) as refused:
        _refuse_placeholders(sys.argv[1:])
    (option, word), *_ = OPEN[flags].items()
    assert (refused.value.finding.quantity, refused.value.finding.data["word"]) == (option, word)
    with pytest.raises(SystemExit) as ended:
        run()
    assert ended.value.code == 4


def test_values_that_only_look_like_a_placeholder_are_passed_on():
    for given in (
        "navigate UNIT --gyro-unit deg/s",
        "attitude M --as NAME",
        "init --columns time=NAME",
    ):
        _refuse_placeholders(given.split())


def test_a_column_that_is_a_placeholder_is_refused_with_the_columns_there_are(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,gx,gy,gz\n" + "".join(f"{k / 100},0,0,0.1\n" for k in range(50)))
    with pytest.raises(ConfigError) as refused:
        read_log(path, ReadOptions(gyro_unit="rad/s", columns={"time": "NAME"}))
    assert set(refused.value.finding.data["known"]) == {"t", "gx", "gy", "gz"}


def test_beside_a_configuration_the_keys_and_their_table_are_given(monkeypatch):
    said = as_stated({"accel_unit": "g", "time": "Zeit"})
    lines = answers(monkeypatch, "navigate a.toml", "file", **said)
    assert lines[0] == "Write into the table [log] of the file:"
    assert lines[1:] == ['  accel_unit = "g"', '  columns = {time = "Zeit"}']
    fixes = {"flags": "--gnss-units speed=kn", "keys": 'units = {speed = "kn"}'}
    assert "[aiding.gnss]" in answers(monkeypatch, "navigate a.toml", "file", **fixes)[0]
    assert "[gnss]" in answers(monkeypatch, "align a.toml", "file", **fixes)[0]
    # Faults of a configuration have names of keys under the same word.
    assert answers(monkeypatch, "navigate a.toml", "file", flags="--lat DEG", keys=("a",)) == []
