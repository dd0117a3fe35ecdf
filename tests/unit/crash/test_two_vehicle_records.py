"""Records of car-to-car crashes, from the files of a laboratory to the closure of both vehicles.

Each is written in the layout of NHTSA or ISO MME, proposed as cases, answered with what only a
person knows, reconstructed, and compared with the exact impact.
`STRAPDOWN_RECORD_DRAWS`: draws of each kind, either layout in turn, half of them without gyros.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections import Counter

import numpy as np
import pytest
from scipy.stats import binomtest
from tests.unit.crash.planar_impact import KINDS
from tests.unit.crash.recorded_impact import recorded_impact

import strapdown as sd
from strapdown.crash.template import draft_cases, read_records
from strapdown.formats.crash_writers import write_mme, write_nhtsa

WRITERS = {"nhtsa": write_nhtsa, "mme": write_mme}
DRAWS = int(os.environ.get("STRAPDOWN_RECORD_DRAWS", "4"))
LEVEL = 0.99
#: What no record of a laboratory states: positions, headings, and the turn where no gyro is.
ONLY_A_PERSON_KNOWS = {"position_m", "heading_deg", "heading_sd_deg", "turn_sd_deg", "because"}
AT_CONTACT = ("closing_speed", "separation_speed", "restitution", "common_velocity", "energy")


def answered(text, answers):
    """A proposed case with the answers of a person in place of its questions."""
    lines, name = [], ""
    for line in text.splitlines():
        key, _, value = line.partition(" = ")
        if key == "mass_sd_kg":
            continue
        name = json.loads(value.partition("  #")[0]) if key == "name" else name
        if key in ONLY_A_PERSON_KNOWS and '"?"' in value:
            answer = answers[key]
            line = f"{key} = {json.dumps(answer[name] if isinstance(answer, dict) else answer)}"
        lines.append(line)
        if key == "mass_kg":
            more = ("mass_sd_kg", "contact_m", "contact_sd_m")
            lines += [f"{k} = {json.dumps(answers[k])}" for k in more]
    return "\n".join(lines) + "\n"


def answer_cases(files, made, runs=2000):
    for file, answers in zip(files, made.answers, strict=True):
        text = file.read_text(encoding="utf-8")
        asked = {m[1] for m in re.finditer(r'^(\w+) = [^#\n]*"\?"', text, re.M)}
        assert asked <= ONLY_A_PERSON_KNOWS and {"position_m", "heading_deg"} <= asked
        text = answered(text, answers).replace("runs = 2000", f"runs = {runs}")
        file.write_text(text, encoding="utf-8")


def closed(folder, kind, number, fault=""):
    """The impact of a draw, and the reconstruction by its cases; None of what is no event."""
    layout = list(WRITERS)[number % 2]
    made = recorded_impact(kind, number, layout, gyros=number // 2 % 2 == 0, fault=fault)
    WRITERS[layout](folder / "record", made.record)
    files = []
    for draft in draft_cases(read_records([folder / "record"]), folder=folder):
        files.append(folder / f"case-{draft.vehicle}.toml")
        files[-1].write_text(draft.text, encoding="utf-8")
        if "trigger_s" in {a.key for a in draft.asked}:
            # A point near the center of rotation may change by less than the 8 km/h that make an
            # event of 49 CFR 563; then the instant is asked.
            assert kind == "sideswipe"
            return made, None
    answer_cases(files, made, runs=0)
    return made, sd.reconstruct(*files)


def held(made, run):
    """Which of the bounds hold the truth: (figure, whether)."""
    closure, truth = run.closure, made.impact.truth
    # Without gyros the velocities are those of the centers, and the truth is of the contact.
    for name in (*(AT_CONTACT if closure.basis == "contact" else ()), "mass_ratio"):
        figure = getattr(closure, name)
        if figure is not None and not math.isnan(truth[name]):
            yield name, figure.contains(truth[name])
    for name in ("relative_heading_deg", "direction_deg"):
        figure = getattr(closure, name)
        away = (truth[name] - figure.value + 180.0) % 360.0 - 180.0
        yield name, abs(away) <= figure.half_width
    yield "magnitude", closure.magnitude.contains(0.0)
    for one, crash in zip((run, *run.others), made.crashes, strict=True):
        change = one.reconstruction.main.delta_v
        true = crash.truth(change.delta_v.start, change.delta_v.end)
        inside = np.abs(change.delta_v.vector - true) <= change.bound.half_width
        yield from zip(("forward", "right"), inside.tolist(), strict=False)


def test_cases_of_a_record_ask_only_a_person_and_close(tmp_path):
    made, run = closed(tmp_path, "offset", 0)
    assert run.closure.basis == "contact" and not run.closure.contradicted
    # Of 13 figures with 95 % bounds, more than three outside are less likely than 0.3 %.
    assert sum(not ok for _, ok in held(made, run)) <= 3
    truth = made.impact.truth
    assert run.closure.closing_speed.half_width < 0.1 * truth["closing_speed"]
    assert run.closure.restitution.half_width < 0.1


@pytest.mark.slow
def test_the_command_goes_from_a_record_to_two_sealed_reports(tmp_path, run_cli, monkeypatch):
    made = recorded_impact("side", 1, "mme")
    write_mme(tmp_path / "record", made.record)
    monkeypatch.chdir(tmp_path)
    done = run_cli("init", "crash", "record")
    assert done.code == 0, done.err
    files = [tmp_path / f"case-{k}.toml" for k in "12"]
    answer_cases(files, made)
    done = run_cli("crash", *files, "--out", "report", "--json")
    assert done.code == 0, done.err
    both = json.loads(done.out)
    assert [one["closure"] for one in both] == [both[0]["closure"]] * 2
    speed = both[0]["closure"]["closing_speed_m_per_s"]
    truth = made.impact.truth["closing_speed"]
    # Four standard deviations of a 95 % bound's 1.96.
    assert abs(speed["value"] - truth) <= 2.05 * 0.5 * (speed["high"] - speed["low"])
    for number in "12":
        assert (tmp_path / "report" / number / "report.pdf").exists()
        assert sd.verify(tmp_path / "report" / number).verdict == "identical"


@pytest.mark.slow
def test_bounds_from_records_hold_the_exact_impacts_of_all_kinds(tmp_path):
    inside, counted, reported, none = Counter(), Counter(), 0, Counter()
    for kind in KINDS:
        for number in range(DRAWS):
            made, run = closed(tmp_path / kind / str(number), kind, number)
            if run is None or run.closure is None:
                none[kind] += 1
                continue
            reported += run.closure.contradicted
            for name, holds in held(made, run):
                inside[name] += bool(holds)
                counted[name] += 1
    # A sideswipe may change less than an event needs.
    assert set(none) <= {"sideswipe"}
    assert binomtest(reported, len(KINDS) * DRAWS).proportion_ci(LEVEL).low <= 0.01
    for name, number in counted.items():
        high = binomtest(inside[name], number).proportion_ci(LEVEL).high
        assert high >= 0.95, (name, inside[name], number)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "codes"),
    [
        ("swapped", {"crash.closes-if-records-swapped"}),
        ("sign", {"crash.closes-if-sign-reversed"}),
        ("scale", {"crash.closes-if-unit"}),
    ],
)
def test_what_is_wrong_with_a_record_is_named(tmp_path, fault, codes):
    _, run = closed(tmp_path, "offset", 0, fault)
    found = {one.finding.code for one in run.blame.candidates} if run.blame else set()
    assert found & codes
