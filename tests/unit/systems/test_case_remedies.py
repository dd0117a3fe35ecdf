"""Remedies name keys of a case, and not what only a program could write."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import strapdown
from strapdown.exceptions import Finding
from strapdown.systems import case_remedies
from strapdown.systems.case_remedies import case_finding, case_remedy

# As the stages say it.
SAID = [
    "record longer before and after, or use means (sampling='mean')",
    "if it is the speed before the crash, give it with time=-0.012; if the trigger is late, "
    "correct it",
    "if the vehicle stood still until it was struck, say moving_at_impact=False; if its velocity "
    "was constant, steady_acceleration=0 (of reconstruct_crash: in preparation={...})",
    "give levelling=(roll, pitch, sd) in deg, as (0, 0, 1.5) for a level road, and the biases stay "
    "at their stated standard deviations; or name the stretch, rest=(start, end) in s (of "
    "reconstruct_crash: in preparation={...})",
    "if the record is in g, multiply it by 9.80665; otherwise check its axes",
    "multiply the accelerations by 9.80665",
    "multiply the columns by π/180, so that they are in rad/s",
    "give Entry.from_speed(speed, sd) in m/s; or, for a vehicle that stood until it was struck, "
    "preparation={'moving_at_impact': False}",
    "on a slope, give Entry(time, velocity=(north, east, down), heading_deg) or, with "
    "Entry.from_speed, climb_sd; else check the levelling",
    "or state how far it may have turned, CrashUnit(assumed=Assumed(turn_sd_deg=...))",
]
PYTHON = re.compile(
    r"reconstruct_crash|preparation|Entry|CrashUnit|Assumed|=False|time=|='|multiply"
)


@pytest.mark.parametrize("remedy", SAID)
def test_nothing_of_python_is_left(remedy):
    told = case_remedy(remedy)
    assert told != remedy
    assert not PYTHON.search(told), told


def test_numbers_go_over_into_the_case():
    assert "time_s = -0.012 under [entry]" in case_remedy(SAID[1])
    assert "levelling_sd_deg = 1.5" in case_remedy(SAID[3])


def test_other_remedies_and_findings_stay():
    assert case_remedy("look how the two are fixed") == "look how the two are fixed"
    assert case_finding(Finding("it rings")) == Finding("it rings")


def test_every_phrase_is_still_said_by_a_stage():
    """A phrase that a stage no longer says would be translated in vain."""
    root = Path(strapdown.__file__).parent
    texts = [
        re.sub(r'"\s*\n\s*f?"', "", file.read_text("utf-8"))
        for file in (*root.glob("crash/*.py"), *root.glob("sensors/*.py"))
    ]
    # Numbers are put in while the remedy is made.
    for pattern, _ in case_remedies._WORDS:
        first = re.split(r"\\[(S{.]|\(\\S", pattern)[0].strip(" \\")
        assert any(first in text for text in texts), first
