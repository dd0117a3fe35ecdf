"""Crush, impulse of a measured force and energy of deformation, in a case and by themselves."""

from __future__ import annotations

import json
import math
import tomllib
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded
from tests.unit.crash.test_two_cases import CASE, cases

import strapdown as sd
from strapdown.config.crash_case import CaseSpec
from strapdown.crash.closure import Figure
from strapdown.crash.deformation import (
    crush_energy,
    dynamic_crush,
    energy_equivalent_speed,
    energy_share,
    impulse_of,
)
from strapdown.crash.template import draft_cases, read_records
from strapdown.errors import ConfigError, DataError
from strapdown.report.crash_words import contradictions

G = 9.80665
MASS, SPEED, RESTITUTION, LENGTH = 1500.0, 15.0, 0.12, 0.11
FORCE = """
[[references]]
kind = "force"
name = "wall"
path = "force.csv"
force_sd_percent = 1.0
"""


def forward(time):
    """Acceleration forward of a car at a wall, m/s²: a raised cosine."""
    x = np.clip(time / LENGTH, 0.0, 1.0)
    return -SPEED * (1 + RESTITUTION) / LENGTH * (1.0 - np.cos(2 * np.pi * x))


def true_crush():
    time = np.linspace(0.0, LENGTH, 200_001)
    step = time[1] - time[0]
    speed = SPEED + np.cumsum(forward(time)) * step
    return float((np.cumsum(speed) * step).max())


def at_wall(folder, more="", force_is=1.0, header="time_s,force_kN", entry_at=0.0):
    """Case of a car with one recorder at a wall that measures the force."""
    rng = np.random.default_rng(5)
    fine = (np.arange(-3000, 5000) + 0.5) / 10_000.0
    time = (np.arange(-300, 500) + 1) / 1000.0
    force = np.zeros((len(time), 3))
    force[:, 0] = forward(fine).reshape(-1, 10).mean(axis=1)
    force[:, 2] = -G
    force *= 1.0 + 0.01 * rng.normal(size=3)
    force += 0.05 * rng.normal(size=3) + 0.28 * rng.normal(size=force.shape)
    rates = 0.2 * rng.normal(size=3) + 0.6 * rng.normal(size=force.shape)
    names = ["t", "ax", "ay", "az", "gx", "gy", "gz"]
    table = pd.DataFrame(np.column_stack([time, force, rates]), columns=names)
    table.to_csv(folder / "car.csv", index=False, float_format="%.6f")
    felt = 1e-3 * force_is * MASS * forward(fine)
    rows = "\n".join(f"{t:.5f},{f:.5f}" for t, f in zip(fine, felt, strict=True))
    (folder / "force.csv").write_text(f"{header}\n{rows}\n", encoding="utf-8")
    text = CASE.format(name="car", mass=MASS, speed=SPEED, heading=0.0, crush=0.5)
    text = text.replace("[point]", f'against = "barrier"\n{more}[point]')
    text = text.replace('source = "marks"', f'source = "marks"\ntime_s = {entry_at}')
    if entry_at < 0.0:
        text = text.replace("levelling_deg =", "rest_s = [-0.29, -0.15]\nlevelling_deg =")
    (folder / "case.toml").write_text(text + FORCE, encoding="utf-8")
    return folder / "case.toml"


def test_what_a_car_says_at_a_wall_holds(tmp_path):
    run = sd.reconstruct(at_wall(tmp_path))
    closure, (crush, *others) = run.closure, run.deformation.crush
    impulse = MASS * SPEED * (1 + RESTITUTION)
    for figure, true, most in (
        (closure.closing_speed, SPEED, 0.03),
        (closure.restitution, RESTITUTION, 0.4),
        (closure.impulse, impulse, 0.1),
        (closure.energy, 0.5 * MASS * SPEED**2 * (1 - RESTITUTION**2), 0.15),
        (closure.energy_equivalent_speed[0], SPEED * math.sqrt(1 - RESTITUTION**2), 0.08),
        (crush.depth, true_crush(), 0.05),
        (run.deformation.impulses[0][1], impulse, 0.03),
    ):
        assert figure.contains(true), (figure, true)
        assert figure.half_width < most * true, (figure, true)
    assert not closure.contradicted and closure.mass_ratio is None and not others
    assert crush.touch == 0.0 and not crush.at_least
    # The velocity is zero where the crush is largest.
    assert abs(SPEED + np.trapezoid(forward(t := np.linspace(0, crush.time, 2001)), t)) < 0.3
    (reference,) = run.references
    assert reference.consistent and reference.spec.delta_v_m_per_s < 0.0
    assert reference.spec.delta_v_m_per_s == pytest.approx(-impulse / MASS, rel=2e-3)
    assert contradictions(run) == ()


def test_a_force_that_contradicts_the_recorders_is_on_page_one(tmp_path):
    run = sd.reconstruct(at_wall(tmp_path, force_is=1.4))
    assert not run.references[0].consistent
    assert "wall" in dict(contradictions(run))


DEFORMATION = (
    "[vehicle.deformation]\ncrush_m = [{depth}, {depth}]\nwidth_m = 1.4\n"
    "stiffness_a_n_per_m = 0.0\nstiffness_a_sd_n_per_m = 0.0\n"
    "stiffness_b_n_per_m2 = {b}\nstiffness_b_sd_n_per_m2 = 0.0\n"
)


def test_a_deformation_that_cannot_be_is_on_page_one(tmp_path):
    lost = 0.5 * MASS * SPEED**2 * (1 - RESTITUTION**2)
    for depth, times, codes in (
        (0.4, 1.0, set()),
        (0.4, 1.5, {"crash.deformation-energy-apart"}),
        (1.1, 1.0, {"crash.residual-crush-above-dynamic"}),
    ):
        # The energy of a constant depth: width B C² / 2.
        stiffness = 2.0 * times * lost / 1.4 / depth**2
        made = DEFORMATION.format(depth=depth, b=stiffness)
        run = sd.reconstruct(at_wall(tmp_path, made))
        found = {f.code for f in run.findings if "crush" in f.code or "energy" in f.code}
        assert found == codes
        assert len(contradictions(run)) == len(codes)
    for key, text in (("width_m", "width_m = 9.0"), ("crush_m", "crush_m = [0.3, 4.9]")):
        wrong = "\n".join(
            text if line.startswith(f"{key} ") else line for line in made.splitlines()
        )
        with pytest.raises(ConfigError, check=coded("config.deformation-beyond-vehicle")):
            CaseSpec.read(at_wall(tmp_path, f"{wrong}\n"))


def test_a_vehicle_that_met_no_rigid_barrier_is_named(tmp_path):
    file = at_wall(tmp_path)
    text = file.read_text(encoding="utf-8")
    for speed, code, crushed in (
        (25.0, "crash.moves-on-at-barrier", True),
        (5.0, "crash.no-rigid-barrier", True),
        (-15.0, "crash.no-rigid-barrier", False),
    ):
        other = text.replace(f"speed_m_per_s = {SPEED}", f"speed_m_per_s = {speed}")
        file.write_text(other, encoding="utf-8")
        run = sd.reconstruct(file)
        assert code in {f.code for f in run.findings} and contradictions(run)
        # One that is pushed on along its travel is not crushed by what it left.
        assert bool(run.deformation.crush) == crushed


def test_the_way_before_the_touch_is_in_the_bound(tmp_path):
    found = sd.reconstruct(at_wall(tmp_path, entry_at=-0.1)).deformation.crush[0]
    # Within the interval of 20 ms in which the velocity changed enough.
    assert -0.02 < found.touch < 0.02
    assert found.depth.contains(true_crush())
    assert found.depth.half_width > 1.9 * SPEED * 0.02 / math.sqrt(12.0)


def test_the_command_tells_them_and_seals_them(tmp_path, run_cli):
    out = tmp_path / "out"
    deformation = (
        "[vehicle.deformation]\ncrush_cm = [30, 40, 45, 45, 40, 30]\nwidth_m = 1.5\n"
        "stiffness_a_lb_per_in = 300.0\nstiffness_a_sd_lb_per_in = 20.0\n"
        "stiffness_b_lb_per_in2 = 60.0\nstiffness_b_sd_lb_per_in2 = 5.0\n"
    )
    done = run_cli("crash", at_wall(tmp_path, deformation), "--out", out)
    assert done.code == 0, done.err
    told = json.loads((out / "crash.json").read_text(encoding="utf-8"))
    found = told["deformation"]
    depth = found["crush"][0]["depth_m"]
    assert depth["low"] < true_crush() < depth["high"]
    assert found["measured_forces"][0]["reference"] == "wall"
    lbf = 4.4482216152605
    crush = np.array([30, 40, 45, 45, 40, 30]) / 100.0
    a, b = 300.0 * lbf / 0.0254, 60.0 * lbf / 0.0254**2
    exact = crush_energy(
        crush,
        (1.5, 0.05),
        (a, 20.0 * lbf / 0.0254),
        (b, 5.0 * lbf / 0.0254**2),
        crush_sd=0.02,
        angle_deg=(0.0, 5.0),
    )
    energy = found["energy_of_residual_crush_j"]
    assert energy["value"] == pytest.approx(exact.value, rel=1e-12)
    assert energy["high"] == pytest.approx(exact.high, rel=1e-12)
    speed = energy_equivalent_speed(exact, (MASS, 0.03 * MASS))
    assert found["energy_equivalent_speed_m_per_s"]["low"] == pytest.approx(speed.low, rel=1e-12)
    assert told["closure"]["impulse_n_s"]["value"] > 0.0
    # The terminal has the largest depth, in m.
    assert f"{depth['value']:.3f}" in done.out
    assert sd.verify(out).verdict == "identical"


def test_stiffness_of_both_cars_divides_the_energy(tmp_path):
    files = cases(tmp_path, 1)
    for file, depth in zip(files, (0.3, 0.5), strict=True):
        more = DEFORMATION.format(depth=depth, b=5e5)
        text = file.read_text(encoding="utf-8").replace("[point]", f"{more}[point]")
        file.write_text(text, encoding="utf-8")
    closure = sd.reconstruct(*files).closure
    first, second = (v.value**2 for v in closure.energy_equivalent_speed)
    # Energies go with the square of the depth: 0.09 to 0.25, whatever crush_m says. The masses are
    # adjusted under momentum by less than their 3 %.
    assert first * 1500.0 / (second * 1100.0) == pytest.approx(0.09 / 0.25, rel=0.03)


def test_the_share_of_two_energies():
    rng = np.random.default_rng(3)
    one, other = Figure.from_sd(4e4, 2e3), Figure.from_sd(9e4, 6e3)
    share, sd_ = energy_share(one, other)
    a, b = 4e4 + 2e3 * rng.normal(size=200_000), 9e4 + 6e3 * rng.normal(size=200_000)
    assert share == pytest.approx(4.0 / 13.0)
    assert sd_ == pytest.approx(float(np.std(a / (a + b))), rel=0.02)


def test_the_bound_of_the_crush_has_what_grows_between_touch_and_depth():
    time = np.arange(6) / 10.0
    north = np.array([-1.0, 0.0, 0.6, 0.8, 0.7, 0.6])
    table = pd.DataFrame(
        {"north": north, "east": 0.0 * north, "VN": [6.0, 6.0, 6.0, 1.0, -1.0, -1.0], "VE": 0.0},
        index=time,
    )
    errors, noise = np.zeros((2, 6, 9)), np.zeros((6, 9, 9))
    # One grows by 3 cm from touch to depth, another is common to both.
    errors[0, :, 6], errors[1, :, 6] = 0.01 * np.arange(6), 0.5
    errors[0, 3, 6] = 0.04
    noise[1, 6, 6], noise[3, 6, 6] = 0.02**2, 0.06**2
    errors[0, 1, 6] = 0.01
    path = SimpleNamespace(
        time=time,
        table=table,
        errors=errors,
        noise_covariance=noise,
        entry=SimpleNamespace(time=0.1),
    )
    event = SimpleNamespace(time_zero=0.1, time_zero_sd=0.001, woken=0.12, end=0.4)
    found = dynamic_crush("car", path, event)
    assert found.depth.value == pytest.approx(0.8) and found.time == 0.3 and not found.at_least
    sd = math.sqrt(0.03**2 + 0.02**2 + 0.06**2)
    assert found.depth.half_width == pytest.approx(1.959964 * sd, rel=1e-6)
    # The entry is 30 ms before the interval of time zero: the touch is anywhere within that.
    later = SimpleNamespace(time_zero=0.13, time_zero_sd=0.001, woken=0.15, end=0.4)
    found = dynamic_crush("car", path, later)
    assert found.touch == pytest.approx(0.14)
    at_touch = math.sqrt(0.02**2 / 12.0 + 0.001**2)
    errors_since = errors[0, 3, 6] - errors[0, 2, 6]
    sd = math.sqrt(errors_since**2 + 0.06**2 + (6.0 * at_touch) ** 2)
    assert found.depth.half_width == pytest.approx(1.959964 * sd, rel=1e-6)
    # One that still moves on at the end was crushed at least so far.
    table["north"] = time
    assert dynamic_crush("car", path, event).at_least
    # One that goes on faster was pushed, and one that stood was not driven into anything.
    for after in (7.0, 0.0):
        table["VN"] = [after and 6.0, after and 6.0, after, after, after, after]
        assert dynamic_crush("car", path, event) is None


def test_impulse_of_a_force_and_what_its_zero_may_be():
    time = np.arange(-1000, 2001) / 1e4
    force = np.where(time >= 0.0, -2e5, 50.0)
    found = impulse_of(time, force, (0.0, 0.1), 0.02)
    assert found.value == pytest.approx(2e4, rel=1e-12)
    assert found.half_width == pytest.approx(1.959964 * math.hypot(400.0, 5.0), rel=1e-6)
    # The whole record has nothing before it.
    whole = impulse_of(time, force, (time[0], time[-1]), 0.02)
    assert whole.value == pytest.approx(4e4 - 5.0, abs=10.1)
    assert whole.half_width == pytest.approx(1.959964 * 0.02 * whole.value, rel=1e-6)
    # A zero that scatters by 300 N is known to 300 / √1000.
    noisy = np.where(time >= 0.0, force, 300.0 * (-1.0) ** np.arange(len(time)))
    found = impulse_of(time, noisy, (0.0, 0.1), 0.0)
    assert found.half_width == pytest.approx(1.959964 * 30.0 / math.sqrt(1000.0), rel=1e-3)
    for span in ((-0.2, 0.1), (0.0, 0.21)):
        with pytest.raises(DataError, check=coded("crash.force-outside-record")):
            impulse_of(time, force, span, 0.02)


def test_what_cannot_be_is_refused(tmp_path):
    file = at_wall(tmp_path, header="time_s,force")
    with pytest.raises(DataError, check=coded("crash.force-without-unit")):
        sd.reconstruct(file)
    text = file.read_text(encoding="utf-8")
    file.write_text(f'{text}force_unit = "kN"\n', encoding="utf-8")
    assert sd.reconstruct(file).references[0].consistent
    at_wall(tmp_path)
    file.write_text(f'{text}force_unit = "kN"\n', encoding="utf-8")
    with pytest.raises(DataError, check=coded("crash.force-unit-stated-twice")):
        sd.reconstruct(file)
    file = at_wall(tmp_path, header="time_s,other_kN")
    with pytest.raises(DataError, check=coded("crash.force-without-column")):
        sd.reconstruct(file)
    with pytest.raises(ConfigError, check=coded("crash.vehicles-share-record")):
        sd.reconstruct(*[cases(tmp_path, 1)[0]] * 2)
    (tmp_path / "two").mkdir()
    first, second = cases(tmp_path / "two", 1)
    text = first.read_text(encoding="utf-8").replace("[point]", 'against = "barrier"\n[point]')
    first.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, check=coded("crash.barrier-and-other-vehicle")):
        sd.reconstruct(first, second)
    text = file.read_text(encoding="utf-8").replace(f"mass_kg = {MASS}\n", "")
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, check=coded("config.force-without-mass")):
        CaseSpec.read(file)


def test_a_laboratory_test_at_a_wall_is_proposed_so(recordings):
    folder = recordings("crash_nhtsa_10146")
    (draft,) = draft_cases(read_records([folder, folder / "barrier_force_sum.csv"]))
    text = draft.text.replace('"?"', "0.0")
    told = tomllib.loads(text)
    assert told["vehicle"]["against"] == "barrier"
    (reference,) = told["references"]
    assert reference["kind"] == "force" and reference["force_column"] == "force_N"
    assert "force_sd_percent" in {asked.key for asked in draft.asked}
    (alone,) = draft_cases(read_records([folder]))
    assert [s for s in alone.left_out if "barrier_force_sum.csv" in s.path]
