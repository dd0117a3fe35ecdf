"""What headings say, and that text of any origin comes back from the file as it was."""

from __future__ import annotations

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from strapdown.config.toml_text import ASK, Page, array, inline, number, plain, string
from strapdown.formats.columns import read_name
from strapdown.formats.vocabularies import CRASHES


@pytest.mark.parametrize(
    ("name", "quantity", "axis", "unit"),
    [
        ("Beschl. HD X [g]", "acceleration", "x", "g"),
        ("Drehrate Z [°/s]", "rate", "z", "deg/s"),
        ("Gierrate [Grad/s]", "rate", "z", "deg/s"),
        ("Beschl. quer [m/s²]", "acceleration", "y", "m/s2"),
        ("acc_x_mg", "acceleration", "x", "mg"),
        ("roll rate (deg/s)", "rate", "x", "deg/s"),
        ("hi_ay", "acceleration", "y", ""),
        ("gyro temp", "other", "", ""),
        ("brake acceleration", "other", "", ""),
        ("Body acceleration", "acceleration", "", ""),
        ("wz", "rate", "z", ""),
        ("Delta-V Longitudinal (MPH)", "velocity", "x", "mph"),
        ("Accelerator Pedal (% full)", "other", "", "% full"),
        ("Steering Wheel Angle (deg)", "other", "", "deg"),
        ("gx", "", "x", ""),
        ("gx [g]", "acceleration", "x", "g"),
        ("Zeit", "time", "", ""),
        ("Zeit in ms", "time", "", "ms"),
        ("time_us", "time", "", "us"),
        ("Nr", "counter", "", ""),
        ("Temperatur", "other", "", ""),
        ("Rate (Hz)", "rate", "", "Hz"),
        ("Kanal 1", "", "", ""),
        ("", "", "", ""),
    ],
)
def test_heading(name, quantity, axis, unit):
    said = read_name(name, CRASHES)
    assert (said.quantity or "", said.axis, said.unit or "") == (quantity, axis, unit)


def test_headings_of_one_triad_share_their_stem():
    stems = {read_name(f"Beschl. ND {a} [g]", CRASHES).family for a in "XYZ"}
    assert len(stems) == 1
    assert stems != {read_name("Beschl. HD X [g]", CRASHES).family}


def without_halves(text: str) -> str:
    return "".join("\ufffd" if 0xD800 <= ord(c) <= 0xDFFF else c for c in text)


any_text = st.text(st.characters(exclude_categories=()), max_size=60)


@given(any_text)
def test_text_comes_back(text):
    assert tomllib.loads(f"key = {string(text)}")["key"] == without_halves(text)


@given(st.dictionaries(any_text, any_text, max_size=4))
def test_a_table_comes_back(table):
    # Halves of pairs would make two keys one.
    table = {without_halves(k): v for k, v in table.items()}
    read = tomllib.loads(f"key = {inline(table)}")["key"]
    assert read == {k: without_halves(v) for k, v in table.items()}


@given(any_text, any_text, any_text)
def test_comments_stay_comments(comment, remark, header):
    page = Page()
    page.say(comment)
    page.table("[table]", header)
    page.key("key", ASK, remark)
    assert tomllib.loads(page.text) == {"table": {"key": "?"}}
    assert page.text.splitlines()[page.asked[0].line - 1].startswith('key = "?"')


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_are_floats(value):
    read = tomllib.loads(f"key = {number(value)}")["key"]
    assert isinstance(read, float)
    # Six digits.
    assert read == pytest.approx(value, rel=5e-6, abs=0.0)


def test_an_open_component_is_a_question():
    assert tomllib.loads(f"key = {array([1.0, None])}")["key"] == [1.0, "?"]


def test_a_long_text_is_cut_in_a_comment():
    assert len(plain("x" * 100_000)) == 300
    page = Page()
    page.say("y" * 100_000)
    assert len(page.text) < 3000
