"""Every sentence replaced by nonsense: no number, verdict or exit code changes."""

from __future__ import annotations

import json
import re
import string

import pandas as pd
import pytest

from strapdown import errors
from strapdown.config.alignment import AlignmentSpec
from strapdown.config.navigation import NavigationSpec
from strapdown.errors import Finding
from strapdown.report.alignment import alignment_json
from strapdown.report.alignment_document import trust as alignment_trust
from strapdown.report.navigation_evaluation import NavigationEvaluation
from strapdown.report.navigation_evaluation import trust as navigation_trust
from strapdown.systems.alignment_run import run_alignment
from strapdown.systems.navigation_run import run_navigation

ROOMS = sorted(
    path.name.removesuffix(".toml")
    for path in errors.resources.files("strapdown").joinpath("messages").iterdir()
    if path.name.endswith(".toml")
)
PLACE = {"lat_deg": 55.0, "lon_deg": 37.0, "alt_m": 100.0}
KNOWN = errors._entry


def nonsense(template: str) -> str:
    """A sentence with the same placeholders and no word of the template."""
    fields = [
        "{" + name + (f"!{how}" if how else "") + (f":{spec}" if spec else "") + "}"
        for _, name, spec, how in string.Formatter().parse(template)
        if name is not None
    ]
    return " ".join(["zzz", *fields])


def replaced(code: str) -> dict[str, str]:
    return {part: nonsense(text) for part, text in KNOWN(code).items()}


@pytest.fixture
def without_words(monkeypatch):
    return lambda: monkeypatch.setattr(errors, "_entry", replaced)


def codes(findings) -> list[tuple[str, str]]:
    return [(one.code, one.severity) for one in findings]


def test_nonsense_has_no_word_of_a_sentence():
    for room in ROOMS:
        for code in errors._entries(room):
            for part, text in replaced(f"{room}.{code}").items():
                words = re.sub(r"\{[^{}]*\}", "", text).split()
                assert set(words) == {"zzz"}, (room, code, part)


def test_nonsense_is_shown(without_words):
    fact = Finding("navigation.fixes-begin-late", apart=3.0)
    assert "first fix" in fact.what
    without_words()
    assert fact.what == "zzz 3"


def aligned():
    """A body that rocks by more than an alignment with a stated heading wants."""
    wave = {"amplitude_deg": 1.0, "period_s": 6.0}
    rocks = {"duration_s": 120.0, "heading_deg": 40.0, "roll_waves": [wave]}
    spec = AlignmentSpec.checked(
        {
            "site": PLACE,
            "sensors": {"sensor": "fog-1000"},
            "simulation": {"rate_hz": 50.0, "seed": 2, **rocks},
            "coarse": {"kind": "known_heading", "heading_deg": 40.0, "sd_deg": 1.0},
            "fine": {"kind": "filter"},
        }
    )
    result = run_alignment(spec)
    verdict = alignment_trust(result)
    return verdict, result, json.dumps(_numbers(alignment_json(result)), sort_keys=True)


@pytest.mark.slow
def test_an_alignment_is_judged_without_a_sentence(without_words):
    before, one, numbers = aligned()
    # What a bound accounts for makes the difference between the two verdicts.
    assert before.verdict == "reserve"
    assert len(before.against) > 1
    assert all(why.data["in_bound"] for why in before.against)
    without_words()
    after, other, same = aligned()
    assert after.verdict == before.verdict
    assert codes(after.reasons) == codes(before.reasons)
    assert codes(other.findings) == codes(one.findings)
    assert same == numbers


def navigated():
    """A drive with outliers among its fixes, judged and compared with its truth."""
    bends = [
        {"do": "straight", "duration_s": 15.0},
        {"do": "turn_left", "angle_deg": 90.0, "radius_m": 60.0},
        {"do": "straight", "duration_s": 15.0},
    ]
    receiver = {"rate_hz": 1.0, "position_noise_m": 0.5, "velocity_noise_m_per_s": 0.05}
    motion = {"kind": "car", **PLACE, "heading_deg": 0.0, "speed_m_per_s": 12.0}
    spec = NavigationSpec.checked(
        {
            "simulation": {
                "rate_hz": 20.0,
                "seed": 5,
                "motion": {**motion, "manoeuvres": bends},
                "gnss": {"rtk": {**receiver, "outlier_share": 0.1}},
            },
            "sensors": {"sensor": "stim300"},
            "start": {
                **PLACE,
                "v_ned_m_per_s": [12.0, 0.0, 0.0],
                "roll_deg": 0.0,
                "pitch_deg": 0.0,
                "heading_deg": 1.0,
                "position_sd_m": 1.0,
                "heading_sd_deg": 1.0,
            },
            "aiding": {"rtk": {"kind": "gnss"}},
            "trust": {"repeat": False},
            "output": {"figures": False},
        }
    )
    result = run_navigation(spec)
    return navigation_trust(NavigationEvaluation(result)), result


def test_a_run_is_judged_without_a_sentence(without_words):
    before, one = navigated()
    assert before.against
    without_words()
    after, other = navigated()
    assert after.verdict == before.verdict
    assert codes(after.reasons) == codes(before.reasons)
    assert codes(other.findings) == codes(one.findings)
    assert codes(other.trust.unconfirmed) == codes(one.trust.unconfirmed)
    pd.testing.assert_frame_equal(other.trust.heading.table, one.trust.heading.table)
    pd.testing.assert_frame_equal(other.record.trajectory, one.record.trajectory, check_exact=True)
    pd.testing.assert_frame_equal(other.record.sd, one.record.sd, check_exact=True)


def test_exit_codes_need_no_sentence(without_words, run_cli, tmp_path):
    log = tmp_path / "short.csv"
    log.write_text("time_s,gyro_x_rad_s\n0,0\n")
    wrong = (
        ("align", log, "--lat", 55, "--lon", 37, "--alt", 0, "--sensor", "fog-1000"),
        ("align", tmp_path / "none.toml"),
        ("navigate", tmp_path / "none.toml"),
        ("outage", "no-such-sensor"),
        ("attitude", tmp_path / "none.csv"),
    )
    before = [run_cli(*one).code for one in wrong]
    assert set(before) <= {3, 4} and before
    without_words()
    assert [run_cli(*one).code for one in wrong] == before


def _numbers(value):
    """What is no text."""
    if isinstance(value, dict):
        return {key: _numbers(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_numbers(one) for one in value]
    return None if isinstance(value, str) else value
