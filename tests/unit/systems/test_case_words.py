"""What a case says of a remedy names keys of the case, and no argument of a function."""

from __future__ import annotations

import pytest

from strapdown.errors import DataError, Finding
from strapdown.systems.case_words import in_case_words, saying_case_words

PYTHON = ("(", "preparation", "moving_at_impact", "Entry", "sampling=", "levelling=", "time=")


@pytest.mark.parametrize(
    ("remedy", "key"),
    [
        (
            "give levelling=(roll, pitch, sd) in deg, as (0, 0, 1.5) for a level road, and the "
            "biases stay at their stated standard deviations; or name the stretch, rest=(start, "
            "end) in s (of reconstruct_crash: in preparation={...})",
            "levelling_sd_deg = 1.5",
        ),
        (
            "if the vehicle stood still until it was struck, say moving_at_impact=False; if its "
            "velocity was constant, steady_acceleration=0 (of reconstruct_crash: in "
            "preparation={...})",
            'kind = "standstill"',
        ),
        (
            "give Entry.from_speed(speed, sd) in m/s; or, for a vehicle that stood until it was "
            "struck, preparation={'moving_at_impact': False}",
            'kind = "speed"',
        ),
        (
            "on a slope, give Entry(time, velocity=(north, east, down), heading_deg) or, with "
            "Entry.from_speed, climb_sd; else check the levelling",
            "climb_sd_m_per_s",
        ),
        (
            "if it is the speed before the crash, give it with time=-0.001; if the trigger is "
            "late, correct it",
            "time_s = -0.001",
        ),
        ("use means (sampling='mean')".replace("(", "").replace(")", ""), 'sampling = "mean"'),
        ("interpolate onto even stamps first, or cut the record at the gap", "rate_hz"),
    ],
)
def test_remedies_name_keys(remedy, key):
    said = in_case_words(Finding("…", remedy=remedy)).remedy
    assert key in said
    assert not [word for word in PYTHON if word in said]


def test_what_needs_no_other_words_stays():
    finding = Finding("…", remedy="look at the recorder")
    assert in_case_words(finding) is finding


def test_errors_keep_their_place():
    with pytest.raises(DataError, match=r"left.csv, row 3: odd\n.*rate_hz") as caught:  # noqa: SIM117
        with saying_case_words():
            raise DataError(
                "odd",
                file="left.csv",
                row=3,
                remedy="interpolate onto even stamps first, or cut the record at the gap",
            )
    assert caught.value.finding.row == 3


def test_remedies_in_the_sources_are_those_that_are_translated():
    """A remedy whose words changed where it is written would go untranslated."""
    import re
    from pathlib import Path

    import strapdown

    root = Path(strapdown.__file__).parent
    sources = [*(root / "crash").glob("*.py"), *(root / "sensors").glob("*.py")]
    joined = " ".join(re.sub(r'"\s*f?r?"', "", p.read_text(encoding="utf-8")) for p in sources)
    for words in (
        "give levelling=(roll, pitch, sd) in deg",
        "rest=(start, end) in s (of reconstruct_crash: in preparation={...})",
        "say moving_at_impact=False; if its velocity was constant, steady_acceleration=0",
        "give Entry.from_speed(speed, sd) in m/s; or, for a vehicle that stood",
        "with Entry.from_speed, climb_sd",
        "sampling='mean'",
    ):
        assert words in joined
