"""The lines under a refusal that answer what a file leaves open."""

from __future__ import annotations

import sys

import pytest

from strapdown.cli.console import WORDS
from strapdown.cli.main import _answers
from strapdown.errors import Finding
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


@pytest.mark.parametrize(
    "flags", ["--gyro-unit UNIT", "--columns time=NAME", "--sensor bmi160 --heading DEG"]
)
def test_what_cannot_be_inferred_is_to_be_filled_in(monkeypatch, flags):
    (line,) = answers(monkeypatch, "navigate a.csv", flags=flags)
    assert line == f"Fill in: strapdown navigate a.csv {flags}"


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
