"""Chernodarov (2009) reproduced: every verdict follows from numbers, and other numbers turn it."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from papers.chernodarov import damping, drive, equations, robustness, signals, states
from papers.chernodarov import paper as system
from papers.page import looks, reproduction_page
from papers.reproduction import (
    CANNOT_BE_JUDGED,
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    VERDICTS,
)
from papers.tests.statements_of_a_paper import check_manual, check_statements
from strapdown.estimation import Huber, PaperUpdate
from strapdown.tables import GEODETIC, POSITION_SD, VELOCITY

PAGE = Path(__file__).parents[1] / "chernodarov" / "README.md"
# Equations, as the paper's text has them.
AS_WRITTEN = {
    "eq2": (r"Moreover, for the wander azimuth frame, $\omega_\zeta = 0$.",),
    "eq14": (r"W_j = [W_0; K_1; \dots; K_j]", r"\dots, \alpha_j^2 \psi'_j)"),
    "v-north": (r"V_N(SINS) = V_\xi \sin A - V_\eta \cos A",),
    "delta-lambda": (r"\delta_\lambda = (\lambda_{SINS} - \lambda_{GPS})R",),
    "radius": (r"R = a(1 - 0,5e^2 \sin^2 \varphi)", "6378245", "e^2 = 0,0066934"),
}


# --- the whole, which takes a minute and more ----------------------------------------------


@pytest.fixture(scope="module")
def progress():
    return []


@pytest.fixture(scope="module")
def made(progress):
    return system.reproduce_chernodarov(lambda stage, share: progress.append((stage, share)))


def evidence(made, key, what):
    found = next(s for s in made.statements if s.key == key)
    return next(e.value for e in found.evidence if e.what == what)


@pytest.mark.slow
def test_every_statement_is_there_once_in_the_order_of_the_paper(made):
    assert tuple(s.key for s in made.statements) == system.ORDER
    assert len(set(system.ORDER)) == len(system.ORDER)


@pytest.mark.slow
def test_each_has_a_quote_of_one_sentence_numbers_and_a_figure_that_exists(made):
    check_statements(made)
    assert {f"fig{k}" for k in range(4, 12)} <= {f.slug for f in made.figures}


@pytest.mark.slow
def test_the_quotes_stand_in_the_paper_word_for_word(made, recordings):
    path = recordings("..") / "papers" / "chernodarov-2009-sins-1000.md"
    if not path.exists():
        pytest.skip("the paper is not there")
    raw = path.read_text(encoding="utf-8")
    text = _plain(raw)
    for s in made.statements:
        if s.key in AS_WRITTEN:
            for part in AS_WRITTEN[s.key]:
                assert part in re.sub(r"\s+", " ", raw), (s.key, part)
        else:
            assert _plain(s.quote) in text, s.key


def _plain(text: str) -> str:
    """Of the mark-up of the paper's text only what is read."""
    return re.sub(r"\s+", " ", text.replace("$", "").replace("*", ""))


@pytest.mark.slow
def test_progress_runs_from_the_first_stage_and_never_back(made, progress):
    shares = [share for _, share in progress]
    assert shares[0] == 0.0
    assert shares == sorted(shares)
    assert shares[-1] < 1.0


@pytest.mark.slow
def test_the_headline_counts_what_is_there(made):
    assert made.headline.startswith(f"Of {len(made.statements)} statements {made.count(HOLDS)} ")
    assert sum(made.count(v) for v in VERDICTS) == len(made.statements)


@pytest.mark.slow
def test_the_page_has_its_own_conventions(made):
    page = reproduction_page(made)
    for name, _ in made.conventions:
        assert name in page


@pytest.mark.slow
def test_curves_of_one_legend_are_told_apart_with_and_without_color(made):
    for figure in made.figures:
        style = looks(figure)
        for panel in figure.panels:
            lines = {t.name: style[t.name] for t in panel.traces if not t.points}
            assert len({color for color, _, _ in lines.values()}) == len(lines), figure.slug
            points = {t.name: style[t.name] for t in panel.traces if t.points}
            assert len({marker for _, _, marker in points.values()}) == len(points), figure.slug


@pytest.mark.slow
def test_the_page_has_the_statements_of_this_code(made):
    check_manual(made, PAGE)


@pytest.mark.slow
def test_the_covariance_tells_what_the_units_have(made):
    # Roots of means of 24 units, along two axes that are alike: 1/sqrt(96) = 10 % one sigma,
    # and what is known of a drift that moves is a bound and not the process: 20 %.
    assert evidence(made, "comparison", "measured over predicted, least") > 0.6
    assert evidence(made, "comparison", "measured over predicted, most") < 1.4


@pytest.mark.slow
def test_a_free_height_grows_as_its_closed_form(made):
    found = evidence(made, "vertical", "time in which it grows by e")
    # Gravity falls by 2 g / R with height, but for the flattening and the rotation: 1 %.
    assert found == pytest.approx(evidence(made, "vertical", "√(R/2g)"), rel=0.02)


# --- parts of it, against closed forms -------------------------------------------------------


def test_the_printed_matrix_lets_the_quaternion_grow_as_its_eigenvalues_say():
    # About z alone it is no rotation at all: of (q0, q3) it makes [[0, z], [z, 0]].
    z, seconds = 1e-3, 500.0
    found = equations.quaternion_after(np.array([0.0, 0.0, z]), seconds, mended=False)
    half = 0.5 * z * seconds
    np.testing.assert_allclose(found, [math.cosh(half), 0, 0, math.sinh(half)], atol=1e-14)
    right = equations.quaternion_after(np.array([0.0, 0.0, z]), seconds, mended=True)
    np.testing.assert_allclose(right, [math.cos(half), 0, 0, math.sin(half)], atol=1e-14)


def test_the_lean_of_attraction_is_that_of_the_theory_notes():
    found = {e.what: e.value for e in equations.gravitational().evidence}
    # The rate squared times the distance from the axis, a cos(lat) less flattening, times sin(lat).
    lat = math.radians(55.98)
    expected = 7.292115e-5**2 * 6.3929e6 * math.cos(lat) * math.sin(lat)
    assert found["attraction, horizontal part"] == pytest.approx(expected, rel=1e-3)


def test_the_printed_radius_is_that_from_the_centre():
    found = {e.what: e.value for e in equations.radius().evidence}
    lat, a, e2 = math.radians(55.98), 6378245.0, 0.0066934
    w = 1.0 - e2 * math.sin(lat) ** 2
    own = a * (1.0 - 0.5 * e2 * math.sin(lat) ** 2)
    north = 100.0 * (own / (a * (1.0 - e2) / w**1.5) - 1.0)
    east = 100.0 * (own / (a / math.sqrt(w)) - 1.0)
    assert found["distances north too long by"] == pytest.approx(north, abs=1e-4)
    assert found["distances east too long by"] == pytest.approx(east, abs=1e-4)


def test_undeflated_columns_add_and_deflated_ones_take():
    P = np.diag([100.0, 4.0])
    H, R = np.eye(2)[:1], np.array([1.0])
    # K = 100/101: K r K' comes on top of 100.
    printed = equations.printed_columns(P, H, R)
    np.testing.assert_allclose(printed, np.diag([100.0 + (100 / 101) ** 2, 4.0]), atol=1e-12)


def test_one_newton_step_goes_where_the_theory_notes_say():
    printed, minimiser, kalman = equations.one_step()
    assert printed == pytest.approx(134.5, abs=0.05)
    assert minimiser == pytest.approx(9.90, abs=0.005)
    assert kalman == pytest.approx(1000.0 / 101.0)
    # Within the linear range there is no difference.
    step = PaperUpdate(Huber()).step(1.0, 100.0, 1.0)
    assert (step.moved, step.slope) == (1.0, 1.0)


def test_schulers_period_is_that_of_the_books():
    assert damping.schuler() / 60.0 == pytest.approx(84.4, abs=0.2)


def test_outliers_are_as_many_and_as_far_as_is_said():
    made = drive.Drive()
    clean, spoilt = made.fixes("clean"), made.fixes("outliers")
    off = (spoilt[VELOCITY] - clean[VELOCITY]).to_numpy() / 0.1
    hit = np.abs(off).max(axis=1) > 1.0
    np.testing.assert_allclose(np.abs(off[hit]), 50.0, rtol=1e-9)
    # 784 fixes: a tenth, and three sigma of chance.
    assert hit.mean() == pytest.approx(0.1, abs=3.0 * math.sqrt(0.09 / len(hit)))
    up = (spoilt[GEODETIC[2]] - clean[GEODETIC[2]]).to_numpy() / clean[POSITION_SD[2]].to_numpy()
    assert set(np.abs(up).round(9)) == {0.0, 50.0}
    gone = made.fixes("outage")
    assert not ((gone.index > drive.OUTAGE[0]) & (gone.index < drive.OUTAGE[1])).any()


def test_the_table_turns_by_half_a_turn_and_stands_otherwise():
    still, turned = (damping.table_motion(k) for k in (False, True))
    at = np.array([0.0, 600.0, 620.0, 4000.0])
    np.testing.assert_allclose(still.trajectory(at)["heading"], 40.0, atol=1e-9)
    np.testing.assert_allclose(turned.trajectory(at)["heading"], [40, 40, 220, 220], atol=1e-9)


def test_a_unit_is_the_same_every_time_and_gains_at_rest_alone():
    one, again = damping.units(1), damping.units(1)
    assert one.forward_apart == again.forward_apart
    # Errors of 1e-4 rad and 0.5 m/s to first order: their products with the turn of the place,
    # and the covariance's steps of 0.1 s, are parts of 1e-3.
    assert one.forward_apart < 1e-3 * one.still.undamped[0].speed.max()
    for kind in ("still", "turned"):
        a, b = getattr(one, kind), getattr(again, kind)
        np.testing.assert_array_equal(a.damped[0].velocity, b.damped[0].velocity)
        np.testing.assert_array_equal(a.predicted["undamped"].place, b.predicted["undamped"].place)
        told = damping.predicted_at(a, "undamped", "circular") / damping.predicted_at(
            a, "damped", "circular"
        )
        # What a rest tells of drifts is worth a factor of two on a table that stands; a turn
        # brings out a tilt of 15", some 35 times as much after five minutes.
        assert (told.min() > 1.5) if kind == "still" else (told[1] < 1.05)


# --- verdicts turn with their numbers -------------------------------------------------------


def test_signals_turn():
    judge = signals.smoothed_from
    assert judge({"gyro": 0.26}, 0.265, 1.0, 0, 100).verdict == HOLDS
    assert judge({"gyro": 0.30}, 0.265, 1.0, 0, 100).verdict == DOES_NOT_HOLD
    assert judge({"gyro": 0.26}, 0.265, 0.9, 0, 100).verdict == DOES_NOT_HOLD
    assert judge({"gyro": 0.26}, 0.265, 1.0, 5, 100).verdict == DOES_NOT_HOLD
    assert signals.phase().verdict == HOLDS_WHEN
    assert signals.phase_from(1e-3, 0.1).verdict == DOES_NOT_HOLD


def test_drifts_turn():
    blind = signals.Learnt((1.0,) * 3, (0.3, 1.0, 0.3), (1.0,) * 3, (1.0, 1.0, 0.03), -0.96, 0.99)
    seen = signals.Learnt((1.0,) * 3, (0.3,) * 3, (1.0,) * 3, (0.1,) * 3, -0.1, 0.1)
    near, far = (0.013, 0.0134, 0.014, -0.004, 0.003, 50), (0.05, 0.0134, 0.014, 0.04, 0.003, 50)
    assert signals.follows_from(*near, blind).verdict == HOLDS_WHEN
    assert signals.follows_from(*near, seen).verdict == HOLDS
    assert signals.follows_from(*far, seen).verdict == DOES_NOT_HOLD
    assert signals.predicted_from(0.01, 0.02, 0.01, 0.007).verdict == HOLDS_WHEN
    assert signals.predicted_from(0.02, 0.02, 0.01, 0.007).verdict == DOES_NOT_HOLD
    biases = ([1e-3] * 3, [1e-3] * 3)
    assert signals.accelerometers_from(*biases, blind).verdict == HOLDS_WHEN
    assert signals.accelerometers_from(*biases, seen).verdict == HOLDS
    assert signals.attitude_and_drifts_from(blind).verdict == HOLDS_WHEN
    assert signals.attitude_and_drifts_from(seen).verdict == HOLDS


def test_damping_turns():
    twice, none = np.full(4, 2.0), np.ones(4)
    for quantity in ("speed", "circular"):
        assert damping.damped_from(quantity, twice, none, twice).verdict == HOLDS_WHEN
        assert damping.damped_from(quantity, twice, twice, twice).verdict == HOLDS
        assert damping.damped_from(quantity, none, none, twice).verdict == DOES_NOT_HOLD
    judge = damping.comparison_from
    assert judge(0.8, 1.1, 950.0, 3500.0, 2600.0, 1e-4).verdict == HOLDS_WHEN
    assert judge(0.8, 1.1, 950.0, 1000.0, 2600.0, 1e-4).verdict == HOLDS
    assert judge(0.3, 1.1, 950.0, 3500.0, 2600.0, 1e-4).verdict == DOES_NOT_HOLD


def test_equations_turn():
    assert equations.skew_symmetric().verdict == DOES_NOT_HOLD
    assert equations.skew_symmetric_from(0.0, 1.0, 0.0).verdict == HOLDS
    assert equations.no_turn_from(0.0, 1e-6).verdict == HOLDS
    assert equations.no_turn_from(1e-9, 1e-6).verdict == DOES_NOT_HOLD
    assert equations.gravitational().verdict == HOLDS_WHEN
    assert equations.gravitational_from(0.1, 0.0, 0.0, 0.0, 0.0).verdict == DOES_NOT_HOLD
    assert equations.north_velocity_from(30.0, 0.04, 0.04).verdict == DOES_NOT_HOLD
    assert equations.north_velocity_from(0.04, 0.04, 0.04).verdict == HOLDS
    assert equations.longitude_from(2000.0, 1200.0, 0.56).verdict == DOES_NOT_HOLD
    assert equations.longitude_from(1200.0, 1200.0, 1.0).verdict == HOLDS
    assert equations.radius().verdict == HOLDS_WHEN
    assert equations.radius_from(0.0, 0.0, 6378245.0, 0.0).verdict == HOLDS
    assert equations.radius_from(0.05, 0.0, 6378245.0, 0.0).verdict == DOES_NOT_HOLD


def test_states_turn():
    assert states.seventeen_from(17, 14, 0.0, 0.0).verdict == HOLDS_WHEN
    assert states.seventeen_from(17, 17, 0.0, 0.0).verdict == HOLDS
    assert states.seventeen_from(16, 14, 0.0, 0.0).verdict == DOES_NOT_HOLD
    assert states.same_organisation_from(5, 1e-6, 0.08, 1e-8).verdict == HOLDS
    assert states.same_organisation_from(5, 0.05, 0.08, 1e-8).verdict == DOES_NOT_HOLD
    assert states.separate_from(1e-4, 17, 15).verdict == HOLDS_WHEN
    assert states.separate_from(1.0, 17, 15).verdict == HOLDS
    assert states.factored_from({"wd": 1e-12}, 0.0, 0.0).verdict == HOLDS
    assert states.factored_from({"wd": 1e-3}, 0.0, 0.0).verdict == DOES_NOT_HOLD
    assert states.vertical_from(0.1, 10.0, 9000.0, 565.0, 570.0).verdict == HOLDS_WHEN
    assert states.vertical_from(0.1, 1.0, 5.0, 565.0, 570.0).verdict == HOLDS


def test_updates_turn():
    fixed = equations.Fixed(960.0, 960.0, 4.2, 4.2, 0.0)
    assert equations.undeflated(fixed).verdict == DOES_NOT_HOLD
    assert equations.undeflated(equations.Fixed(960.0, 4.2, 4.2, 4.2, 0.0)).verdict == HOLDS
    assert equations.once_from(1e-14).verdict == HOLDS
    assert equations.once_from(1e-3).verdict == DOES_NOT_HOLD


def test_the_drive_turns():
    judge = robustness.observed_from
    assert judge(0.5, 0.6, 390.0, 4.2).verdict == HOLDS
    assert judge(3.0, 0.6, 390.0, 4.2).verdict == DOES_NOT_HOLD
    judge = robustness.outliers_from
    assert judge(0.5, 7.4, 0.6, 0.6).verdict == HOLDS
    assert judge(0.5, 7.4, 3.0, 0.6).verdict == DOES_NOT_HOLD
    assert judge(0.5, 0.6, 0.6, 0.6).verdict == DOES_NOT_HOLD
    judge = robustness.continuity_from
    assert judge(2.9, 0.84, 0.81, 0.86).verdict == HOLDS
    assert judge(2.9, 9.0, 0.81, 0.86).verdict == DOES_NOT_HOLD
    judge = robustness.newton_from
    step = equations.one_step()
    assert judge(step, 880.0, 0.03, 0.03, -1e-3).verdict == HOLDS_WHEN
    assert judge((9.9, 9.9, 9.9), 880.0, 0.03, 0.03, -1e-3).verdict == DOES_NOT_HOLD
    assert judge(step, 0.03, 0.03, 0.03, 1e-3).verdict == HOLDS
    judge = robustness.turned_drive_from
    assert judge(386.0, 392.0, 293.0).verdict == HOLDS_WHEN
    assert judge(100.0, 392.0, 293.0).verdict == HOLDS


def test_what_was_not_published_is_not_judged():
    assert {s.verdict for s in robustness.unpublished()} == {CANNOT_BE_JUDGED}


def test_the_filter_at_the_primary_level_turns_with_its_numbers():
    digital = signals.Primary(0.26, 54, 54, 1e-15)
    wd = signals.Primary(0.19, 54, 54, 1e-4)
    assert signals.primary_level(digital, wd, 54).verdict == HOLDS
    turning = signals.Primary(0.19, 54, 1400, 1e-4)
    assert signals.primary_level(digital, turning, 54).verdict == HOLDS_WHEN
    loud, blind = signals.Primary(0.5, 54, 54, 1e-4), signals.Primary(0.19, 10, 10, 1e-4)
    for other in (loud, blind):
        assert signals.primary_level(digital, other, 54).verdict == DOES_NOT_HOLD


def test_both_prefilters_find_the_outliers_of_a_unit_at_rest():
    digital, wd, outliers = signals.primary()
    # One row in 500 of 4001, in six channels.
    assert outliers == 8 * 6
    assert digital.doubted == digital.turning == outliers
    assert outliers <= wd.doubted < 1.2 * outliers
    assert signals.primary_level(digital, wd, outliers).verdict == HOLDS_WHEN
