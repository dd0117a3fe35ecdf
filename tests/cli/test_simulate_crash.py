"""`strapdown simulate CRASH`: what a person types, and what is answered."""

from __future__ import annotations

import json

import pytest


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_one_command_writes_a_case_and_says_what_next(here, run_cli):
    done = run_cli("simulate", "pole", "--out", "records")
    assert (done.code, done.err) == (0, "")
    assert "imu1_low_g.csv" in done.out
    assert f"Open  {here / 'records' / 'case.toml'}" in done.out
    assert f"Next  strapdown crash {here / 'records' / 'case.toml'}" in done.out
    assert run_cli("verify", "records").out.startswith("identical")


def test_recorders_are_chosen(here, run_cli):
    assert run_cli("simulate", "pole", "--units", "imu1, lab2", "-q", "--out", "two").code == 0
    names = {p.name for p in (here / "two").glob("*.csv")} - {"cameras.csv", "truth.csv"}
    assert names == {"imu1_low_g.csv", "imu1_high_g.csv", "imu1_gyro.csv", "lab2_accel.csv"}


def test_json_is_what_really_happened(here, run_cli):
    told = json.loads(run_cli("simulate", "pole", "--seed", "4", "--json").out)
    assert told["seed"] == 4
    # V0 (1 + e)/(1 + d²/k²) with the scenario's own 7.1 m/s, 0.1, 0.4 m and 1.9 m².
    assert told["impacts"][0]["delta_v_m_per_s"][0] == pytest.approx(
        -7.1 * 1.1 / (1.0 + 0.16 / 1.9), rel=1e-12
    )
    assert told["impacts"][0]["pdof_deg"] == 0.0


@pytest.mark.parametrize(
    ("options", "what"),
    [
        (["pole", "--units", "IMU9"], "error: --units: 'pole' has no recorder 'IMU9'"),
        (["pole", "--units", "LAB1"], "LAB1 has no gyro and uses that of IMU1"),
        (["pole", "--format", "npz"], "error: --format: no writer of crash records"),
        (
            ["pole", "--sensor", "bmi270"],
            "error: --sensor: the option does not apply to the recorders",
        ),
        (["pole", "--sampling", "often"], "there is no 'often'"),
        (["pole", "--rate", "0"], "give a number above 0"),
        (["alexiev-fig4", "--units", "IMU1"], "'alexiev-fig4' is not a simulated crash"),
    ],
)
def test_what_cannot_be_is_named_and_nothing_is_written(here, run_cli, options, what):
    done = run_cli("simulate", *options)
    assert done.code == 4
    assert what in done.err
    assert list(here.iterdir()) == []


def test_a_slip_in_the_name_is_answered_with_the_crash(here, run_cli):
    done = run_cli("simulate", "tadic-pol")
    assert done.code == 4
    assert "tadic-pole" in done.err
