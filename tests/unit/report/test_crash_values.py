"""Numbers as a reader of a crash report sees them."""

from __future__ import annotations

import math

import pytest

from strapdown.crash.pdof import AngleInterval
from strapdown.report.values import (
    about,
    angle_range,
    bounded,
    heading_shown,
    instant,
    plain,
    side_words,
    spaced,
    speed,
    speed_range,
)

MINUS = "\u2212"


@pytest.mark.parametrize(
    ("value", "places", "text"),
    [
        (1.25, 1, "1.2"),
        (-1.26, 1, f"{MINUS}1.3"),
        (-0.04, 1, "0.0"),
        (-0.0, 0, "0"),
        (-1e-9, 4, "0.0000"),
        (0.0, 2, "0.00"),
        (-12345.6, 0, f"{MINUS}12346"),
        (math.nan, 2, "–"),
        (math.inf, 2, "–"),
        (-math.inf, 0, "–"),
    ],
)
def test_a_number_to_so_many_places(value, places, text):
    assert plain(value, places) == text


@pytest.mark.parametrize(
    ("value", "half", "text"),
    [
        # The bound has two digits, the value ends where it does.
        (7.3412, 0.2689, "7.34 ± 0.27 m"),
        (7.3412, 2.689, "7.3 ± 2.7 m"),
        (7.3412, 26.89, "7 ± 27 m"),
        (7341.2, 268.9, "7340 ± 270 m"),
        (-7.3412, 0.02689, f"{MINUS}7.341 ± 0.027 m"),
        # Six places at most; a smaller bound is still no zero.
        (1.0, 1e-7, f"1.000000 ± 1.0e{MINUS}07 m"),
        # Zero to rounding, with its bound.
        (-1.28e-10, 0.0031, "0.0000 ± 0.0031 m"),
        # Nothing is known of a bound: two places.
        (1.23456, 0.0, "1.23 ± 0.00 m"),
        (1.23456, math.inf, "1.23 ± – m"),
        (1.23456, math.nan, "1.23 ± – m"),
        (math.nan, 0.1, "– ± 0.10 m"),
        (0.001, 1.0, "0.0 ± 1.0 m"),
        (-0.001, 1.0, "0.0 ± 1.0 m"),
    ],
)
def test_a_value_is_rounded_by_its_bound(value, half, text):
    assert spaced(about(value, half, "m")) == text


def test_a_bound_that_rounds_up_has_two_digits_too():
    assert spaced(about(10.0, 0.0996, "m")) == "10.00 ± 0.10 m"
    assert spaced(about(10.0, 9.96, "m")) == "10 ± 10 m"


@pytest.mark.parametrize(
    ("value", "below", "above", "texts"),
    [
        (63.798, 2.5, 2.5, ("63.8", "± 2.5")),
        # Ends that differ by more than their digits show, by the finer one.
        (86.54, 1.62, 1.48, ("86.5", f"+1.5 {MINUS}1.6")),
        (63.798, 2.5, math.inf, ("63.8", f"+∞ {MINUS}2.5")),
        (63.798, math.inf, 0.21, ("63.80", f"+0.21 {MINUS}∞")),
        (0.12, 0.0, 0.37, ("0.12", f"+0.37 {MINUS}0.00")),
        # Without a bound: four digits.
        (63.798, math.inf, math.inf, ("63.80", "")),
    ],
)
def test_a_value_and_a_bound_of_two_ends(value, below, above, texts):
    assert tuple(spaced(text) for text in bounded(value, below, above)) == texts


def test_without_a_unit_nothing_trails():
    assert spaced(about(1.0, 0.1, "")) == "1.00 ± 0.10"


def test_speeds_are_in_km_per_h_with_m_per_s_beside():
    assert spaced(speed(-10.0, 1.0)) == f"{MINUS}36.0 ± 3.6 km/h"
    assert spaced(speed_range(10.0, 1.0)) == "32.4 to 39.6 km/h with 95 %; 10.0 ± 1.0 m/s"
    assert spaced(speed_range(0.5, 1.0)).startswith(f"{MINUS}1.8 to 5.4 km/h")


@pytest.mark.parametrize(
    ("time", "text"),
    [
        (0.1157164, "0.1157 s"),
        (-0.1, f"{MINUS}0.1 s"),
        (0.0, "0 s"),
        (-0.00001, "0 s"),
        (10.0, "10 s"),
        (100.25, "100.25 s"),
    ],
)
def test_instants_have_no_idle_zeros(time, text):
    assert spaced(instant(time)) == text


def test_a_direction_that_nothing_bounds_is_said_to_be_none():
    open_one = AngleInterval(math.nan, math.nan, True)
    assert spaced(angle_range(open_one)) == "not determined: no direction is excluded with 95 %"
    assert (
        spaced(angle_range(AngleInterval(-3.44, 0.26, False))) == f"{MINUS}3.4° to 0.3° with 95 %"
    )


@pytest.mark.parametrize(
    ("forward", "right", "words"),
    [
        (-7.0, 0.1, "backward"),
        (7.0, -0.1, "forward"),
        (0.1, 5.0, "to the right"),
        (0.1, -5.0, "to the left"),
        (-3.0, 2.0, "backward and to the right"),
        (3.0, -2.0, "forward and to the left"),
    ],
)
def test_ways_in_words(forward, right, words):
    assert side_words(forward, right) == words


def test_a_heading_is_below_a_turn_as_it_is_shown():
    gap = "\u00a0"
    for deg, half, shown in (
        (359.7, 16.0, f"0{gap}±{gap}16°"),
        (359.7, 0.21, f"359.70{gap}±{gap}0.21°"),
        (-0.001, 0.21, f"0.00{gap}±{gap}0.21°"),
        (-90.0, 2.3, f"270.0{gap}±{gap}2.3°"),
    ):
        assert about(heading_shown(deg, half), half, "°") == shown
    assert heading_shown(359.999, math.nan) == 0.0
