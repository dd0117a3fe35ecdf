"""Alexiev (2021) reproduced: every verdict follows from numbers, and other numbers turn it."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from papers.alexiev import fig4, fig5, fig6, formulas, growth, motions, real_log
from papers.alexiev import paper as system
from papers.page import curves_json, reproduction_json
from papers.reproduction import (
    CANNOT_BE_JUDGED,
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Statement,
    amount,
)
from papers.tests.statements_of_a_paper import check_manual
from strapdown.attitude_algorithms import ALGORITHMS
from strapdown.constants import STANDARD_GRAVITY

PAGE = Path(__file__).parents[1] / "alexiev" / "README.md"


@pytest.fixture(scope="module")
def shares():
    """What was told of the progress of `made`."""
    return []


@pytest.fixture(scope="module")
def made(shares):
    return system.reproduce_alexiev(lambda stage, share: shares.append(share))


@pytest.fixture(scope="module")
def verdicts(made):
    return {s.key: s.verdict for s in made.statements}


def evidence(made, key: str, what: str) -> float:
    statement = next(s for s in made.statements if s.key == key)
    return next(e.value for e in statement.evidence if e.what == what)


# --- the whole ----------------------------------------------------------------------------


def test_every_statement_is_there_once_in_the_order_of_the_paper(made):
    assert tuple(s.key for s in made.statements) == system.ORDER
    assert len(set(system.ORDER)) == len(system.ORDER)


def test_each_has_a_quote_of_one_sentence_numbers_and_a_figure_that_exists(made):
    slugs = {f.slug for f in made.figures}
    for s in made.statements:
        assert 0 < len(s.quote) < 260, s.key
        assert not re.search(r"[a-z]\. [A-Z]", s.quote), s.key
        assert s.evidence or s.verdict == CANNOT_BE_JUDGED, s.key
        assert s.figure in {"", *slugs}, s.key
    assert len(slugs) == len(made.figures)


def test_a_second_run_has_the_same_bits(made):
    again = system.reproduce_alexiev()
    assert reproduction_json(again) == reproduction_json(made)
    assert curves_json(again) == curves_json(made)


def test_the_page_has_the_statements_of_this_code(made):
    check_manual(made, PAGE)


def test_progress_runs_from_the_first_stage_and_never_back(made, shares):
    assert shares[0] == 0.0
    assert shares == sorted(shares)
    assert shares[-1] < 1.0


def test_the_headline_counts_what_is_there(made):
    assert made.headline.startswith(f"Of {len(made.statements)} statements {made.count(HOLDS)} ")
    total = sum(made.count(v) for v in (HOLDS, HOLDS_WHEN, DOES_NOT_HOLD, CANNOT_BE_JUDGED))
    assert total == len(made.statements)


# --- Fig. 4, against numbers derived apart from this code -----------------------------------


def test_fig4_table_holds_the_known_numbers(made):
    table = next(t for t in made.tables if t.slug == "fig4")
    column = {name: k for k, name in enumerate(table.columns[1:])}
    values = dict(table.rows)
    # Theory notes, part A, to the digits given there.
    for rate, known, digits in (
        *(("10 Hz", 5.57, 2), ("50 Hz", 21.4, 1), ("100 Hz", 2.55, 2)),
        *(("1000 Hz", 0.252, 3), ("10000 Hz", 0.0251, 4)),
    ):
        assert values[rate][column["euler, °"]] == pytest.approx(known, abs=0.5 * 10**-digits)
        assert values[rate][column["dcm, °"]] < 1e-9
        assert values[rate][column["quaternion, °"]] < 1e-9
    start = column["euler, rate at start, °"]
    assert values["10 Hz"][start] == pytest.approx(25.2, abs=0.05)
    assert values["50 Hz"][start] == pytest.approx(4.16, abs=0.005)
    assert values["100 Hz"][column["dcm, pulse closed, °"]] == pytest.approx(1.15, abs=0.005)


def test_the_greatest_pitch_of_fig4_is_the_angle_between_its_axis_and_x(made):
    # The x axis goes round a cone about (0.1, 2, 0): its pitch is at most that cone's half-angle.
    exact = np.degrees(np.arctan2(2.0, 0.1))
    # Sampled 1e5 times over 115 deg: within (half a step)² of the top, in rad.
    assert fig4.greatest_pitch() == pytest.approx(exact, abs=1e-7)
    assert fig4.crosses(90.0, 114.6).verdict == HOLDS
    assert fig4.crosses(exact, 114.6).verdict == HOLDS_WHEN


def test_the_error_before_90_is_of_first_order_and_the_steps_own():
    slow, fast = fig4.approach(1000.0), fig4.approach(2000.0)
    # Half the step, half the error; the next term is of the order of the step.
    assert slow.at(45.0) / fast.at(45.0) == pytest.approx(2.0, rel=0.01)
    assert fig4.approach(100.0, "rk4").at(45.0) < 1e-6 * fig4.approach(100.0).at(45.0) + 1e-7


def test_before_90_turns_with_its_numbers():
    found = tuple(fig4.approach(r) for r in (20.0, 100.0))
    smooth = fig4.approach(100.0, "rk4")
    assert fig4.before_ninety(found, smooth).verdict == HOLDS
    none = tuple(replace(a, roll=0.0 * a.roll, heading=1e-12 + 0.0 * a.heading) for a in found)
    assert fig4.before_ninety(none, smooth).verdict == DOES_NOT_HOLD


def test_crossing_90_turns_with_pitch_and_integral():
    assert fig4.crosses(90.0, 114.6).verdict == HOLDS
    assert fig4.crosses(87.1, 114.6).verdict == HOLDS_WHEN
    assert fig4.crosses(87.1, 89.0).verdict == DOES_NOT_HOLD


def test_instability_turns_where_the_error_falls_with_the_rate():
    rates, exact = (10.0, 100.0, 1000.0), np.full(3, 1e-13)
    assert fig4.unstable(rates, np.array([5.6, 21.4, 0.3]), exact).verdict == HOLDS
    assert fig4.unstable(rates, np.array([5.6, 0.6, 0.06]), exact).verdict == DOES_NOT_HOLD


@pytest.mark.parametrize(
    ("exact", "closed", "verdict"),
    [(1e-12, 1.147, HOLDS_WHEN), (1e-12, 0.0, HOLDS), (0.5, 1.147, DOES_NOT_HOLD)],
)
def test_the_reference_of_fig4(exact, closed, verdict):
    assert fig4.reference(np.array([exact]), closed, 1.147).verdict == verdict


def test_a_wrong_sign_in_the_algorithm_turns_the_verdicts_that_rest_on_it(monkeypatch, verdicts):
    """Direction cosines that turn the other way: nothing that praised them is left standing."""
    right = ALGORITHMS["dcm"]

    class Backwards(right):  # type: ignore[misc, valid-type]
        def advance(self, state, steps):
            return super().advance(state, replace(steps, theta=-steps.theta))

    keys = ("fig4-dcm-reference", "euler-unstable", "fig4-incorrect")
    assert [verdicts[k] for k in keys] == [HOLDS_WHEN, HOLDS, HOLDS]
    monkeypatch.setitem(ALGORITHMS, "dcm", Backwards)
    found = {s.key: s.verdict for s in system._fig4()[0]}
    assert [found[k] for k in keys] == [DOES_NOT_HOLD] * 3
    changed = {s.key: s.verdict for s in system._motions()[0]}
    assert changed["dcm-quaternion-excellent"] == DOES_NOT_HOLD


# --- the naive sum --------------------------------------------------------------------------


@pytest.mark.parametrize("order", ["together", "x then y", "y then x"])
def test_the_closed_form_of_small_turns(order):
    angles = np.array([0.5, 1.0, 2.0])
    theta = np.radians(angles)
    # The next terms of the series are products of three angles, each of a factor of one at most.
    bound = np.degrees(theta**3)
    assert np.all(np.abs(fig5.measured(angles, order) - fig5.closed_form(angles, order)) < bound)


def test_the_turn_that_costs_a_degree():
    for order in ("together", "x then y"):
        angle = fig5.angle_for(1.0, order)
        assert fig5.naive_reading_error(angle, order) == pytest.approx(1.0, abs=1e-9)
    # Closed form: θ² = 1°, with a correction of the order of θ.
    assert fig5.angle_for(1.0, "x then y") == pytest.approx(7.57, rel=0.02)


def test_no_rate_removes_it(made):
    key = "naive-high-rate"
    at_100 = evidence(made, key, "turns of 5° to 8°, 100 Hz")
    # What the trapezoid adds at 100 Hz where edges share a step.
    assert evidence(made, key, "the same, 10 kHz") == pytest.approx(at_100, abs=1e-3)
    turned = fig5.good_at_high_rate(1.0, 1e-3, 10.0, 1e-2, 10.7, 7.6)
    assert turned.verdict == HOLDS
    assert fig5.good_at_high_rate(5.0, 5.0, 90.0, 90.0, 1, 1).verdict == DOES_NOT_HOLD


def test_fig5_turns_with_its_numbers():
    good, bad = fig5.Compared(100.0, 0.5, 0.0, 0.5), fig5.Compared(100.0, 50.0, 0.0, 50.0)
    assert fig5.very_good_at_high_rate(good, bad).verdict == HOLDS_WHEN
    assert fig5.very_good_at_high_rate(good, good).verdict == HOLDS
    assert fig5.very_good_at_high_rate(bad, bad).verdict == DOES_NOT_HOLD
    one, two = np.ones(4), np.array([1.0, 1.0, 1.0, 2.0])
    for low, verdict in ((one, DOES_NOT_HOLD), (two, HOLDS_WHEN), (2.0 * one, HOLDS)):
        many = fig5.OverManyMotions(low, one)
        assert fig5.differs_at_low_rate(good, good, bad, many).verdict == verdict


def test_a_low_rate_parts_the_two_only_where_turns_nearly_commute(made):
    key = "fig5-low-rate"
    assert 0.0 < evidence(made, key, "random motions that 5 Hz part by half as much again") < 10.0
    bound = evidence(made, key, "of those, largest difference at 100 Hz")
    assert bound < 0.5 * evidence(made, key, "of all, median difference at 100 Hz")


# --- Fig. 6 ---------------------------------------------------------------------------------


def test_fig6_costs_what_the_rate_costs(made):
    # As tests/analytic has it, from samples taken at 20 Hz and not decimated.
    assert evidence(made, "fig6-rate-is-the-reason", "20 Hz, samples dropped") == pytest.approx(
        17.6, abs=0.1
    )
    table = next(t for t in made.tables if t.slug == "fig6")
    dropped = {name: row[0] for name, row in table.rows}
    # Second order; 2 % is the next term at 100 Hz.
    assert dropped["100 Hz"] / dropped["200 Hz"] == pytest.approx(4.0, rel=0.02)


def test_the_reason_turns_with_its_numbers():
    slow = fig6.AtRate(20.0, 17.6, 8.9, 0.8, 1.0, 170.0)
    fast = replace(slow, rate=1000.0, dropped=0.007)
    poor = fig6.SensorCost("poor", 8.0, 0.001, 20.0, 0.05)
    fine = fig6.SensorCost("fine", 0.001, 0.001, 0.01, 0.01)
    assert fig6.rate_is_the_reason(slow, fast, (fine,)).verdict == HOLDS
    assert fig6.rate_is_the_reason(slow, fast, (poor,)).verdict == HOLDS_WHEN
    assert fig6.rate_is_the_reason(slow, slow, (fine,)).verdict == DOES_NOT_HOLD
    other = fig6.neither_sensor_nor_algorithm
    assert other(slow, 1e-12, (poor,)).verdict == CANNOT_BE_JUDGED
    assert other(slow, 1e-12, (fine,)).verdict == CANNOT_BE_JUDGED
    assert other(replace(slow, cubic=17.0, rotation_vector=17.0), 0.0, (fine,)).verdict == HOLDS
    assert other(slow, 1.0, (fine,)).verdict == CANNOT_BE_JUDGED
    assert fig6.stable_at_rest((fine,)).verdict == HOLDS
    assert fig6.stable_at_rest((poor,)).verdict == HOLDS_WHEN
    assert fig6.stable_at_rest((replace(poor, resting_free=3.0),)).verdict == DOES_NOT_HOLD


def test_a_return_hides_a_scale_factor():
    at_return, largest = fig6.scale_seen(0.03)
    # Three per cent of 90° and half a step of the trapezoid at either edge: 0.45° at 100 Hz.
    assert largest == pytest.approx(2.7, abs=0.46)
    assert at_return < 1e-9
    assert fig6.reference_points(at_return, largest, 17.0, 18.0).verdict == HOLDS_WHEN
    assert fig6.reference_points(largest, largest, 17.0, 18.0).verdict == HOLDS
    assert fig6.reference_points(0.0, largest, 0.1, 18.0).verdict == DOES_NOT_HOLD


def test_a_real_log_returns_to_its_pose(recordings, monkeypatch):
    monkeypatch.setenv("STRAPDOWN_DATA", str(recordings("mpu6050_turns").parent))
    statements, (table,), figures = real_log.real_log()
    assert not statements
    assert len(figures) == 6
    for axis, (dcm, slow, naive, fastest) in table.rows:
        # A turn by hand wobbles about the other axes: the order of rotations counts, and most of
        # the naive sum's error is its own.
        assert naive > 2.0 * dcm, axis
        assert naive > 2.0 * slow, axis
        assert fastest > 30.0, axis


def test_without_the_recording_one_line_says_so(monkeypatch, capsys):
    monkeypatch.delenv("STRAPDOWN_DATA", raising=False)
    assert real_log.real_log() == ([], [], [])
    assert capsys.readouterr().err.count("\n") == 1


# --- growth ---------------------------------------------------------------------------------


def test_the_laws_are_measured_and_not_assumed():
    laws = growth.laws()
    # The tilt is its own sine to 6e-8, and attitude is piecewise linear: far below 1e-3.
    assert laws.accel.exponent == pytest.approx(2.0, abs=1e-3)
    assert laws.gyro.exponent == pytest.approx(3.0, abs=1e-3)
    assert laws.gyro.coefficient == pytest.approx(
        STANDARD_GRAVITY * growth.GYRO_BIAS / 6.0, rel=1e-3
    )
    assert laws.gyro_vertical.error[-1] < 1e-9
    as_printed = replace(laws.gyro, coefficient=growth.GYRO_BIAS / 6.0)
    assert growth.gyro_growth(laws.gyro, laws.gyro_vertical).verdict == HOLDS_WHEN
    assert growth.gyro_growth(as_printed, laws.gyro_vertical).verdict == HOLDS
    square = replace(laws.gyro, exponent=2.0)
    assert growth.gyro_growth(square, laws.gyro_vertical).verdict == DOES_NOT_HOLD
    assert growth.accel_growth(laws.accel, laws.accel_turning).verdict == HOLDS_WHEN
    assert growth.accel_growth(laws.accel, laws.accel).verdict == HOLDS
    assert growth.accel_growth(laws.gyro, laws.accel).verdict == DOES_NOT_HOLD
    assert growth.attitude_growth(laws.tilt, laws.tilt_turning).verdict == HOLDS_WHEN
    assert growth.attitude_growth(laws.tilt, laws.tilt).verdict == HOLDS
    assert growth.attitude_growth(laws.accel, laws.tilt).verdict == DOES_NOT_HOLD


def test_who_leads_when():
    assert growth.gyros_lead({"a": 3.0}).verdict == HOLDS_WHEN
    assert growth.gyros_lead({"a": 0.0}).verdict == HOLDS
    assert growth.gyros_lead({"a": np.inf}).verdict == DOES_NOT_HOLD
    assert growth.earth_rate_small({"a": 1.0}).verdict == HOLDS_WHEN
    assert growth.earth_rate_small({"a": 0.001}).verdict == DOES_NOT_HOLD


# --- formulas, effort, motions --------------------------------------------------------------


def test_formulas_turn_with_their_numbers():
    assert formulas.product_as_printed(0.0, 1.0, 0.0).verdict == HOLDS
    assert formulas.product_as_printed(1.9, 0.0, 0.0).verdict == DOES_NOT_HOLD
    # (8)-(10) do not fit the product as printed: the rates would have to change sign.
    assert formulas.worst_kinematics(transposed=False) > 0.1
    assert formulas.kinematics_as_printed(0.1).verdict == DOES_NOT_HOLD
    assert formulas.sigma_as_printed(0.0, 0.0).verdict == HOLDS
    assert formulas.sigma_as_printed(5.0, 80.0).verdict == DOES_NOT_HOLD
    assert formulas.exponential_at_zero(1.0, 0.0, 0.0).verdict == HOLDS
    assert formulas.exponential_at_zero(np.nan, 1.0, 0.0).verdict == HOLDS_WHEN
    assert formulas.quaternion_equations(0.5).verdict == DOES_NOT_HOLD
    assert formulas.series([1.0] * 5).verdict == DOES_NOT_HOLD


def test_a_sign_that_is_wrong_in_8_to_10_is_found(monkeypatch):
    right = formulas.euler_rates
    monkeypatch.setattr(formulas, "euler_rates", lambda a, w: right(a, w) * [1.0, 1.0, -1.0])
    residual = formulas.worst_kinematics(transposed=True)
    assert formulas.kinematics_as_printed(residual).verdict == DOES_NOT_HOLD


def test_effort_turns_with_its_numbers():
    costs = {c.algorithm: c for c in motions.costs()}
    assert motions.compromise(tuple(costs.values())).verdict == HOLDS_WHEN
    costs["euler"] = replace(costs["euler"], cycles=50.0)
    assert motions.compromise(tuple(costs.values())).verdict == HOLDS
    costs["naive"] = replace(costs["naive"], cycles=500.0)
    assert motions.compromise(tuple(costs.values())).verdict == DOES_NOT_HOLD


def test_the_closing_sentence_turns_with_the_table(made):
    table = next(t for t in made.tables if t.slug == "scenarios")
    assert motions.practical(table).verdict == HOLDS_WHEN
    for error, verdict in ((0.1, HOLDS), (90.0, DOES_NOT_HOLD)):
        rows = tuple((name, (error, *row[1:])) for name, row in table.rows)
        assert motions.practical(replace(table, rows=rows)).verdict == verdict


def test_excellence_turns_with_its_numbers():
    assert motions.excellent(0.0, 0.0, 17.6, 0.007, 20.0, 1000.0).verdict == HOLDS_WHEN
    assert motions.excellent(0.0, 0.0, 0.1, 0.007, 20.0, 1000.0).verdict == HOLDS
    assert motions.excellent(1.0, 0.0, 17.6, 0.007, 20.0, 1000.0).verdict == DOES_NOT_HOLD
    assert motions.excellent(0.0, 0.0, 17.6, 17.6, 20.0, 1000.0).verdict == DOES_NOT_HOLD


# --- the form -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("verdict", "condition"), [("perhaps", ""), (HOLDS, "x"), (HOLDS_WHEN, "")]
)
def test_a_verdict_is_one_of_four_and_has_a_condition_where_it_needs_one(verdict, condition):
    with pytest.raises(ValueError, match="key"):
        Statement("key", "Section 1", "quote", verdict, condition, "because", ())


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [
        (17.634, "°", "17.6°"),
        (114.59, "°", "114.6°"),
        (4420.4, "s", "4420 s"),
        (0.0, "m", "< 1e-9 m"),
        (3e-13, "°", "< 1e-9°"),
        (0.00022, "°", "2.2e-04°"),
        (-1.5, "m/s²", "-1.5 m/s²"),
        (float("nan"), "", "not a number"),
    ],
)
def test_amounts_are_written_to_three_digits(value, unit, shown):
    assert amount(value, unit) == shown
