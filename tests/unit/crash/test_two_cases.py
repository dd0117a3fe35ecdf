"""Two cars of one crash, each by its own case: momentum, closing speed, restitution, blame."""

from __future__ import annotations

import json
import math

import numpy as np
import pandas as pd
import pytest

import strapdown as sd
from strapdown.report.crash_tables import closure_table
from strapdown.report.crash_words import closure_words
from strapdown.report.values import MINUS, plain, shown_in

G = 9.80665
MASSES, SPEEDS = (1500.0, 1100.0), (15.0, 12.0)
HEADINGS = (10.0, 190.0)
RESTITUTION = 0.12

CASE = """
title = "Head-on {name}"
[vehicle]
name = "{name}"
mass_kg = {mass}
crush_m = {crush}
[point]
name = "center of mass"
[entry]
kind = "speed"
speed_m_per_s = {speed}
speed_sd_m_per_s = 0.2
heading_deg = {heading}
heading_sd_deg = 1.0
source = "marks"
[[units]]
name = "{name} recorder"
trigger_s = 0.0
trigger_sd_s = 0.0003
position_m = [0.0, 0.0, 0.0]
position_sd_m = 0.01
angles_deg = [0.0, 0.0, 0.0]
angles_sd_deg = 0.5
levelling_deg = [0.0, 0.0]
levelling_sd_deg = 0.5
[[units.accelerometers]]
path = "{name}.csv"
time = "t"
time_unit = "s"
unit = "m/s2"
sampling = "mean"
channels = {{ x = "ax", y = "ay", z = "az" }}
uncertainty = {{ noise_density_ug_per_sqrt_hz = 900.0, bias_sd_mg = 5.0, scale_sd_percent = 1.0, misalignment_sd_deg = 0.5, full_scale_g = 200.0 }}
[units.gyro]
path = "{name}.csv"
time = "t"
time_unit = "s"
unit = "deg/s"
sampling = "mean"
channels = {{ x = "gx", y = "gy", z = "gz" }}
uncertainty = {{ noise_density_deg_per_s_per_sqrt_hz = 0.02, bias_sd_deg_per_s = 0.2, scale_sd_percent = 1.0, full_scale_deg_per_s = 500.0 }}
[options]
rate_hz = 1000.0
sampling = "mean"
monte_carlo_runs = 0
"""  # noqa: E501


def write_case(folder, which, rng, wrong=""):
    """Record and case of one car of a collinear, central head-on crash."""
    closing = sum(SPEEDS)
    impulse = (1 + RESTITUTION) * closing * MASSES[0] * MASSES[1] / sum(MASSES)
    time = np.arange(-300, 500) / 1000.0
    x = np.clip(time / 0.11, 0, 1)
    done = x - np.sin(2 * np.pi * x) / (2 * np.pi)
    shape = np.diff(done, prepend=done[0]) * 1000.0
    name = "ab"[which]
    force = np.zeros((len(time), 3))
    force[:, 0] = -shape * impulse / MASSES[which]
    force[:, 2] = -G
    force *= 1.0 + 0.01 * rng.normal(size=3)
    force += 0.05 * rng.normal(size=3) + 0.28 * rng.normal(size=force.shape)
    if wrong == "sign":
        force[:, 0] *= -1.0
    rates = 0.2 * rng.normal(size=3) + 0.6 * rng.normal(size=force.shape)
    table = pd.DataFrame(
        np.column_stack([time, force, rates]), columns=["t", "ax", "ay", "az", "gx", "gy", "gz"]
    )
    table.to_csv(folder / f"{name}.csv", index=False, float_format="%.6f")
    case = folder / f"{name}.toml"
    mass = 10.0 * MASSES[which] if wrong == "mass" else MASSES[which]
    case.write_text(
        CASE.format(
            name=name,
            mass=mass,
            speed=SPEEDS[which],
            heading=HEADINGS[which],
            crush=(0.5, 0.6)[which],
        ),
        encoding="utf-8",
    )
    return case


def cases(folder, seed, wrong=""):
    rng = np.random.default_rng(seed)
    return [write_case(folder, k, rng, wrong if k == 1 else "") for k in range(2)]


def test_two_cars_close_and_the_figures_hold(tmp_path):
    run = sd.reconstruct(*cases(tmp_path, 1))
    closure = run.closure
    assert closure is run.others[0].closure and not closure.contradicted
    assert closure.freedom == 2 and closure.probability > 0.005
    total = sum(MASSES)
    common = (MASSES[0] * SPEEDS[0] - MASSES[1] * SPEEDS[1]) / total
    lost = 0.5 * MASSES[0] * MASSES[1] / total * sum(SPEEDS) ** 2 * (1 - RESTITUTION**2)
    for figure, true in (
        (closure.closing_speed, sum(SPEEDS)),
        (closure.restitution, RESTITUTION),
        (closure.mass_ratio, MASSES[1] / MASSES[0]),
        (closure.energy, lost),
        (closure.direction_deg, HEADINGS[0] + 180.0),
        (closure.energy_equivalent_speed[0], math.sqrt(2 * lost * (0.5 / 1.1) / MASSES[0])),
    ):
        assert figure.contains(true), (figure, true)
        assert figure.half_width < 0.35 * abs(true)
    # Along the impulse on the first, which points backward.
    assert closure.common_velocity.contains(-common)
    assert run.vehicle_names == ("a", "b")
    # Its sums are in the units of the report.
    closed = {}
    for system in ("metric", "us"):
        with shown_in(system):
            found = closure_table(run).rows
        closed[system] = {row[3]: float(row[1].replace(MINUS, "-")) for row in found}
    lbf = 0.45359237 * G
    joules = closure.energy.value
    assert closed["metric"]["kJ"] == pytest.approx(1e-3 * joules, abs=0.05)
    assert closed["us"]["ft lbf"] == pytest.approx(joules / (0.3048 * lbf), abs=0.5)
    assert closed["us"]["lbf s"] == pytest.approx(1e3 * closed["metric"]["kN s"] / lbf, abs=2.0)
    # Page one of either names the other and has the closing speed.
    speed = plain(3.6 * closure.closing_speed.value, 1)
    for one, other in ((run, "b"), (run.others[0], "a")):
        words = closure_words(one)
        assert speed in words and f" {other} " in words


@pytest.mark.parametrize(
    ("wrong", "code"), [("sign", "closes-if-sign-reversed"), ("mass", "closes-if-mass-wrong")]
)
def test_what_does_not_close_is_explained(tmp_path, wrong, code):
    run = sd.reconstruct(*cases(tmp_path, 2, wrong))
    assert run.closure.contradicted
    found = [one.finding for one in run.blame.candidates]
    assert f"crash.{code}" in [f.code for f in found]
    assert "b" in [f.data.get("name") for f in found if f.code == f"crash.{code}"]
    assert "crash.momentum-not-closed" in [f.code for f in run.findings]


def test_vehicles_without_headings_are_compared_by_magnitude(tmp_path):
    files = cases(tmp_path, 3)
    for file in files:
        text = file.read_text(encoding="utf-8").replace("heading_sd_deg = 1.0\n", "")
        file.write_text(text, encoding="utf-8")
    run = sd.reconstruct(*files)
    assert run.closure.freedom == 1 and not run.closure.contradicted
    # What the directions of force imply: they met head-on.
    assert run.closure.relative_heading_deg.low < 180.0 < run.closure.relative_heading_deg.high or (
        run.closure.relative_heading_deg.low < -180.0 < run.closure.relative_heading_deg.high
    )


@pytest.mark.slow
def test_the_command_writes_a_sealed_report_for_each(tmp_path, run_cli):
    files = cases(tmp_path, 1)
    out = tmp_path / "out"
    done = run_cli("crash", *files, "--out", out)
    assert done.code == 0, done.output
    for number in "12":
        told = json.loads((out / number / "crash.json").read_text(encoding="utf-8"))
        assert told["closure"]["vehicles"] == ["a", "b"]
        assert told["closure"]["restitution"]["low"] < RESTITUTION
        assert sd.verify(out / number).verdict == "identical"
        page = (out / number / "report.html").read_text(encoding="utf-8")
        assert "Closure with the other vehicle" in page
