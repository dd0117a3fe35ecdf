"""Text that shows what it is."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from strapdown.report.document import plain_text


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("delta-V 51 km/h \u00b1 2°, Straße, 車, \U0001f697", None),
        ("a\nb\r\nc\td\u2028e", "a b c d e"),
        ("nul\x00bell\x07esc\x1b[31m", "nul[U+0000]bell[U+0007]esc[U+001B][31m"),
        ("\u202egnp.exe\u2066x\u2069", "[U+202E]gnp.exe[U+2066]x[U+2069]"),
        ("zero\u200bwidth\ufeff", "zero[U+200B]width[U+FEFF]"),
        ("lone \ud800", "lone [U+D800]"),
        (
            "private \ue000 nothing \uffff \U0010ffff",
            "private [U+E000] nothing [U+FFFF] [U+10FFFF]",
        ),
        ("z\u0337\u0336\u0335\u0334", "z\u0337\u0336\u0335[U+0334]"),
    ],
)
def test_what_has_no_shape_is_written_as_its_number(text, plain):
    assert plain_text(text) == (text if plain is None else plain)


def test_lines_stay_where_they_may():
    assert plain_text("a\r\nb\n\tc", lines=True) == "a\nb\n c"


def test_a_long_text_says_how_long_it_was():
    assert plain_text("a" * 20_000, 100) == "a" * 80 + "… (20000 characters)"
    assert len(plain_text("\x00" * 99, 100)) == 100
    assert plain_text("\x00" * 99, 100).endswith("… (99 characters)")
    assert plain_text("a" * 100, 100) == "a" * 100


@given(st.text(st.characters(codec=None, categories=None), max_size=60), st.integers(40, 70))
def test_a_second_pass_does_nothing(text, limit):
    once = plain_text(text, limit)
    assert plain_text(once, limit) == once
    assert len(once) <= limit
    once.encode("utf-8")
