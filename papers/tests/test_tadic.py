"""Tadic (2016) reproduced: every verdict follows from numbers, and other numbers turn it."""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.same_picture import PINNED, same_picture

from papers.page import (
    curves_json,
    looks,
    reproduction_json,
    reproduction_page,
    svg,
)
from papers.reproduction import (
    CANNOT_BE_JUDGED,
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    VERDICTS,
)
from papers.tadic import directions, displacement, equations, experiment, mounting, sensors
from papers.tadic import paper as system
from papers.tests.statements_of_a_paper import check_manual, check_statements
from strapdown import rotation

PAGE = Path(__file__).parents[1] / "tadic" / "README.md"
# Equations and a row of a table, as the paper's text has them.
AS_WRITTEN = {
    "eq8": (r"\frac{V_E \tan \varphi}{R_p + h}",),
    "eq19": ("2(q_2 q_3 + q_0 q_1)", "2(q_1 q_3 + q_0 q_2)"),
    "eq20": (r"derived under the assumption that the angles $\phi_N, \phi_E, \phi_D$ are small",),
    "high-g-range": ("IMU high-G\tMMA3202, MMA1213\t200 Hz\t±100 g",),
}


@pytest.fixture(scope="module")
def progress():
    return []


@pytest.fixture(scope="module")
def made(progress):
    return system.reproduce_tadic(lambda stage, share: progress.append((stage, share)))


def statement(made, key):
    return next(s for s in made.statements if s.key == key)


def evidence(made, key, what):
    return next(e.value for e in statement(made, key).evidence if e.what == what)


# --- the whole ----------------------------------------------------------------------------


def test_every_statement_is_there_once_in_the_order_of_the_paper(made):
    assert tuple(s.key for s in made.statements) == system.ORDER
    assert len(set(system.ORDER)) == len(system.ORDER)


def test_each_has_a_quote_of_one_sentence_numbers_and_a_figure_that_exists(made):
    check_statements(made)
    assert {"fig5", "fig6", "fig7", "fig7-points", "fig8", "fig8-ringing", "fig9"} <= {
        f.slug for f in made.figures
    }
    assert {"table1", "table2"} <= {t.slug for t in made.tables}


def test_the_quotes_stand_in_the_paper_word_for_word(made, recordings):
    path = recordings("..") / "papers" / "tadic-2016-crash-inertial-navigation.md"
    if not path.exists():
        pytest.skip("the paper is not there")
    raw = path.read_text(encoding="utf-8")
    text = _plain(raw)
    for s in made.statements:
        if s.key in AS_WRITTEN:
            for part in AS_WRITTEN[s.key]:
                assert part in re.sub(r"[^\S\t]+", " ", raw), (s.key, part)
        else:
            assert _plain(s.quote) in text, s.key


def _plain(text: str) -> str:
    """Of the mark-up of the paper's text only what is read."""
    for tex, word in (
        (r" \text{ m/s}^2", " m/s²"),
        (r" \text{ m/s}^3", " m/s³"),
        (r"\approx", "≈"),
        ("$", ""),
        ("*", ""),
        ("’", "'"),
    ):
        text = text.replace(tex, word)
    return re.sub(r"\s+", " ", text)


def test_progress_runs_from_the_first_stage_and_never_back(made, progress):
    shares = [share for _, share in progress]
    assert shares[0] == 0.0
    assert shares == sorted(shares)
    assert shares[-1] < 1.0


def test_the_headline_counts_what_is_there(made):
    assert made.headline.startswith(f"Of {len(made.statements)} statements {made.count(HOLDS)} ")
    assert sum(made.count(v) for v in VERDICTS) == len(made.statements)


def test_the_page_has_its_own_conventions(made):
    page = reproduction_page(made)
    for name, text in made.conventions:
        assert name in page
        assert re.split(r"[:']", text)[0] in page
    assert "no real recording is used" not in page


def test_curves_of_one_legend_are_told_apart_with_and_without_color(made):
    for figure in made.figures:
        style = looks(figure)
        for panel in figure.panels:
            lines = {t.name: style[t.name] for t in panel.traces if not t.points}
            assert len({color for color, _, _ in lines.values()}) == len(lines), figure.slug
            points = {t.name: style[t.name] for t in panel.traces if t.points}
            assert len({marker for _, _, marker in points.values()}) == len(points), figure.slug


def test_the_page_has_the_statements_of_this_code(made):
    check_manual(made, PAGE)


@pytest.mark.skipif(not PINNED, reason="another matplotlib than that of constraints.txt")
@pytest.mark.parametrize("slug", ["fig9", "pdof-ringing"])
def test_a_picture_of_the_manual_is_what_is_drawn_now(made, slug, tmp_path):
    picture = svg(next(f for f in made.figures if f.slug == slug))
    shown = PAGE.parent / "images" / f"{slug}.svg"
    if os.environ.get("STRAPDOWN_WRITE_PICTURES"):
        shown.write_text(picture, encoding="utf-8")
    (tmp_path / "now.svg").write_text(picture, encoding="utf-8")
    assert same_picture(shown, tmp_path / "now.svg"), "make pictures, and look at them"


@pytest.mark.slow
def test_a_second_run_has_the_same_bits(made):
    again = system.reproduce_tadic()
    assert reproduction_json(again) == reproduction_json(made)
    assert curves_json(again) == curves_json(made)


# --- the experiment -------------------------------------------------------------------------


def test_the_bounds_hold_the_errors_against_the_cameras(made):
    table = next(t for t in made.tables if t.slug == "fig9-errors")
    within = [values[-1] for _, values in table.rows]
    # 18 intervals of 95 % a platform, three of each on one record: fewer than 80 % of them all
    # would be a chance of less than 1e-6 even if only the 24 records were independent.
    assert np.mean(within) > 80.0


def test_the_table_of_directions_has_the_papers_angles_once(made):
    table = next(t for t in made.tables if t.slug == "table2")
    assert len(table.rows) == 4 * len(directions.WINDOWS)
    shown = {name.split(",")[0]: v[:2] for name, v in table.rows if v[0] is not None}
    assert shown == directions.PAPER
    for name, v in table.rows:
        horizontal, half, true = v[2], v[3], v[8]
        # Bounds of 95 %: three times as far is 5.9 sigma.
        assert abs(horizontal - true) < 3.0 * half, name


def test_gravity_left_in_makes_the_papers_vertical_angles(made):
    steep = evidence(made, "vertical-consistent", "acceleration at which gravity left in makes 15°")
    assert np.degrees(np.arctan(9.80665 / steep)) == pytest.approx(15.0, abs=1e-9)


def test_the_pulse_is_the_haversine_of_the_theory_notes(made):
    # (2 delta/T): 7.20 m/s in 113 ms are 13.0 g; 30 ms about the middle hold
    # x - sin(2 pi x)/2 pi between x = 0.5 -+ 0.015/0.113, which is 0.499 of it.
    x = 0.5 + np.array([-1.0, 1.0]) * 0.015 / 0.113
    share = np.ptp(x - np.sin(2.0 * np.pi * x) / (2.0 * np.pi))
    found = evidence(made, "severity-30-ms", "share") / 100.0
    # Twenty-four platforms, each with its noise of a percent and its own ends of the event.
    assert found == pytest.approx(share, abs=0.02)
    assert evidence(
        made, "pulse-magnitude", "peak of the simulated pole impact, 26 km/h"
    ) == pytest.approx(13.0, abs=0.05)


def test_an_arm_turns_the_direction_as_the_theory_notes_say():
    # Notes, part B: an arm that is left out moves 30 ms by 6 to 9 deg.
    base = mounting.turned_by("", mounting.Mounting())
    for arm in mounting.ARMS:
        moved = mounting.turned_by("", mounting.Mounting(arm))
        assert 5.5 < moved.most(2, base) < 9.5


def test_a_heading_that_is_not_known_turns_it_by_itself():
    base = mounting.turned_by("", mounting.Mounting())
    turned = mounting.turned_by("", mounting.Mounting(angles_deg=(0.0, 0.0, 3.0)))
    # The change of velocity along the vehicle turns as a vector, and time zero and the ends of
    # the event, which depend on its parts, by some microseconds.
    assert turned.most(2, base) == pytest.approx(3.0, abs=0.01)


def test_the_printed_matrix_differs_where_the_paper_has_its_pluses():
    q = rotation.quaternion_from_euler([[3.0, -2.0, 40.0]])
    off = np.abs(equations.as_printed(q)[0] - rotation.dcm_from_quaternion(q)[0])
    assert {(int(i), int(j)) for i, j in zip(*np.nonzero(off > 1e-12), strict=True)} == {
        (1, 2),
        (2, 0),
    }
    # One degree of roll: 2 g sin(1 deg) aside.
    made = equations.matrix_as_printed()
    rolled = next(e.value for e in made.evidence if "1° of roll" in e.what and e.unit == "m")
    expected = 2.0 * 9.80665 * np.sin(np.radians(1.0)) * 0.75**2 / 2.0
    assert rolled == pytest.approx(expected, rel=1e-9)


def test_increments_are_predicted():
    # (1 + theta²/4) a step, 107 steps of 87 deg/s at 200 Hz.
    assert equations.norm_growth() == pytest.approx(
        107 * np.radians(87.0 / 200.0) ** 2 / 4.0, rel=2e-3
    )


def test_a_high_pass_takes_what_its_formula_says(made):
    # While the corner is low: w times the twofold integral of the change of the speed. A step of
    # it at zero would lose w t²/2 delta; the pulse loses less, and 0.1 Hz already bends it.
    lost = evidence(made, "piezoelectric", "place lost, corner 0.1 Hz")
    step = 2.0 * np.pi * 0.1 * 7.2 * 0.75**2 / 2.0
    assert 0.6 * step < lost < step


def test_errors_alone_are_their_closed_forms():
    for r in equations.ranked():
        # The drive is straight and level: what is left out is Schuler's part, 1e-4 in 10 s, and
        # what the transport rate makes of it.
        assert r.accel == pytest.approx(0.5 * equations.ACCEL_BIAS * r.time**2, rel=1e-3)
        assert r.gyro == pytest.approx(9.806 * equations.GYRO_BIAS * r.time**3 / 6.0, rel=2e-3)


# --- verdicts turn with their numbers -------------------------------------------------------


def test_the_abstract_turns():
    ring, quiet = displacement.Rung("", 1.0), displacement.Rung("", 0.01)
    judge = displacement.decimetre_from
    assert judge({"LAB1": 0.2}, 0.05, 0.01, ring).verdict == HOLDS_WHEN
    assert judge({"LAB1": 0.2}, 0.05, 0.01, quiet).verdict == HOLDS
    assert judge({"LAB1": 0.6}, 0.05, 0.01, quiet).verdict == DOES_NOT_HOLD
    scaled = judge({"LAB1": 0.2}, 0.1, 0.01, quiet)
    assert "scale factors are known to 4.9%" in scaled.condition


def test_all_four_turn():
    judge = displacement.all_four_from
    assert judge(np.full((4, 4), 0.2)).verdict == HOLDS
    one = np.full((4, 4), 0.2)
    one[0, 2] = 0.7
    assert judge(one).verdict == HOLDS_WHEN
    assert judge(np.full((4, 4), 0.7)).verdict == DOES_NOT_HOLD


def test_error_causes_turn(made):
    own = {"levelling": 0.0, "axes": 50.0, "biases": 20.0, "scale factors": 20.0}
    judge = displacement.causes_from
    assert judge(own, own).verdict == HOLDS_WHEN
    assert judge(own | {"levelling": 10.0, "axes": 40.0}, own).verdict == HOLDS
    assert judge(own | {"scale factors": 1.0}, own).verdict == DOES_NOT_HOLD
    for kind in ("IMU", "LAB"):
        groups = [e for e in statement(made, "error-causes").evidence if e.what.startswith(kind)]
        # What has no group is noise, lever arm and timing.
        assert 97.0 < sum(e.value for e in groups) < 100.0


def test_small_statements_of_the_displacement_turn():
    extra = displacement.extra_from
    assert extra({"a": 0.003}, 0.2).verdict == HOLDS_WHEN
    assert extra({"a": 0.1}, 0.2).verdict == HOLDS
    assert extra({"a": 0.0}, 0.2).verdict == DOES_NOT_HOLD
    rings = (displacement.Rung("", 0.5),)
    assert displacement.vibrations(rings, 0.001).verdict == HOLDS
    assert displacement.vibrations(rings, 0.2).verdict == DOES_NOT_HOLD
    truth = experiment.ground_truth_from
    assert [truth(r, r, 0.1).verdict for r in (0.01, 0.05, 0.2)] == [
        HOLDS,
        HOLDS_WHEN,
        DOES_NOT_HOLD,
    ]
    entry = experiment.same_entry_from
    assert [entry({"IMU": x}, 0.03).verdict for x in (0.001, 0.01, 0.1)] == [
        HOLDS,
        HOLDS_WHEN,
        DOES_NOT_HOLD,
    ]


def test_a_floor_that_rings_makes_the_lateral_peak_of_fig_8(made):
    lateral = next(f for f in made.figures if f.slug == "fig8-ringing").panels[1]
    peak = {t.name: float(np.abs(t.y).max()) for t in lateral.traces}
    rung = max(peak["IMU, floor rings"], peak["IMU, floor rings, half a sample later"])
    assert rung > 5.0 * peak["LAB, the same ringing"]


def test_the_points_of_fig_7_are_those_of_table_2(made):
    for panel in next(f for f in made.figures if f.slug == "fig7-points").panels:
        points = {t.name: (t.x[0], t.y[0]) for t in panel.traces}
        for name, angles in directions.PAPER.items():
            assert points[f"{name}, Table 2"] == angles


def test_the_cameras_of_fig_5_follow_the_truth(made):
    for panel in next(f for f in made.figures if f.slug == "fig5").panels:
        seen, true = panel.traces
        assert seen.x.shape == true.x.shape
        assert np.abs(seen.y - true.y).max() < 0.05
        assert np.abs(seen.y - true.y).max() > 0.0


def test_urgency_turns():
    assert directions.urgency_from(0.3, 0.02, 0.11).verdict == DOES_NOT_HOLD
    assert directions.urgency_from(1.0, 0.11, 0.11).verdict == HOLDS


def test_a_detection_knows_the_change_that_its_threshold_asks_for(made):
    # 8 km/h of the pulse of 7.2 m/s: what is known at the detection is the threshold itself, or
    # a little more where the samples are far apart.
    share = evidence(made, "urgency", "share of the delta-V that is known at the detection")
    assert 100.0 * (8.0 / 3.6) / 7.5 < share < 50.0


def test_directions_turn():
    frames = directions.frames_from
    early = dict(zip(directions.WINDOWS, (0.1, 0.2, 0.7, 3.0), strict=True))
    assert frames(early, 1.0).verdict == HOLDS_WHEN
    assert frames(dict.fromkeys(directions.WINDOWS, 0.1), 1.0).verdict == HOLDS
    assert frames(dict.fromkeys(directions.WINDOWS, 2.0), 1.0).verdict == DOES_NOT_HOLD
    vertical = directions.vertical_from
    assert vertical((53.0, 4.0), (1.0, 1.0), (36.0, 50.0)).verdict == HOLDS_WHEN
    assert vertical((53.0, 4.0), (9.0, 1.0), (36.0, 50.0)).verdict == HOLDS
    assert vertical((53.0, 40.0), (9.0, 1.0), (36.0, 50.0)).verdict == DOES_NOT_HOLD


def test_causes_and_peak_turn():
    few, none = [3.0] * 4, [0.0] * 4
    judge = mounting.causes_from
    assert judge(43.0, 49.0, few, few, [90.0, 27.0, 7.0, 17.0]).verdict == HOLDS_WHEN
    assert judge(43.0, 49.0, few, few, none).verdict == CANNOT_BE_JUDGED
    assert judge(43.0, 49.0, [60.0] * 4, few, none).verdict == HOLDS
    peak = mounting.lateral_peak_from
    assert peak([90.0, 27.0, 7.0, 17.0], none, 2.0).verdict == HOLDS_WHEN
    assert peak([90.0, 60.0, 50.0, 17.0], none, 2.0).verdict == HOLDS
    assert peak(few, none, 2.0).verdict == CANNOT_BE_JUDGED


def test_raw_data_turn():
    sat = experiment.saturated_from
    assert [sat(*x).verdict for x in ((80, 60, 0), (80, 10, 0), (20, 10, 0))] == [
        HOLDS,
        HOLDS_WHEN,
        DOES_NOT_HOLD,
    ]
    low = experiment.calibrates_from
    assert low(0.2, 0.3, 3.0, 11.0).verdict == HOLDS_WHEN
    assert low(0.2, 1.0, 3.0, 11.0).verdict == HOLDS
    assert low(0.2, 1.0, 0.3, 11.0).verdict == DOES_NOT_HOLD
    severity = directions.severity_from
    assert [severity(p, 7.2).verdict for p in (7.1, 3.6, 1.0)] == [
        CANNOT_BE_JUDGED,
        HOLDS_WHEN,
        DOES_NOT_HOLD,
    ]


def test_sensors_turn():
    assert sensors.high_g_range_from((100, 100, 100), (13, 1, 1)).verdict == HOLDS
    assert sensors.high_g_range_from((100, 50, 50), (13, 1, 1)).verdict == DOES_NOT_HOLD
    piezo = sensors.piezoelectric_from
    assert piezo({1.0: 4.0, 0.1: 0.9}, 0.03).verdict == DOES_NOT_HOLD
    assert piezo({1.0: 4.0, 0.1: 0.1}, 0.3).verdict == HOLDS_WHEN
    assert piezo({1.0: 0.1, 0.1: 0.01}, 9.0).verdict == HOLDS
    assert sensors.worst_bias_from(147.0, 11.0, 0.2).verdict == CANNOT_BE_JUDGED
    assert sensors.worst_bias_from(5.0, 11.0, 0.2).verdict == DOES_NOT_HOLD
    line = sensors.proportional_from
    assert line(1.0, 0.9, 1.5, 18).verdict == HOLDS
    assert line(1.0, 0.4, 1.5, 18).verdict == HOLDS_WHEN
    assert line(0.1, 0.1, 0.2, 18).verdict == DOES_NOT_HOLD
    gyros = sensors.gyros_stable_from
    assert gyros([0.5] * 4, [0.5] * 4, 0.1).verdict == HOLDS
    assert gyros([0.5] * 4, [2.0] * 4, 0.1).verdict == HOLDS_WHEN
    assert gyros([2.0] * 4, [2.0] * 4, 0.1).verdict == DOES_NOT_HOLD
    own = sensors.own_biases_from
    assert [own(b, 0.0, b).verdict for b in (0.01, 0.1, 0.6)] == [HOLDS, HOLDS_WHEN, DOES_NOT_HOLD]


def test_terms_of_the_earth_turn():
    trips = ("crash", *equations.LONGER)
    own = dict(zip(trips, (0.2, 10.0, 1000.0), strict=True))
    judge = equations.coriolis
    assert judge(dict.fromkeys(trips, 1e-4), own).verdict == HOLDS
    assert judge({"crash": 1e-4, "10 s": 0.1, "60 s": 500.0}, own).verdict == HOLDS_WHEN
    assert equations.earth_rate(dict.fromkeys(trips, 0.1), own).verdict == DOES_NOT_HOLD


def test_equations_turn():
    assert equations.transport_from(0.0, 25.0).verdict == DOES_NOT_HOLD
    assert equations.transport_from(0.0, 0.0).verdict == HOLDS
    assert equations.matrix_from(1e-16, 0.0, 0.0).verdict == HOLDS
    assert equations.increments_from(1e-4, 1e-4, 0.0).verdict == HOLDS
    angles = equations.small_angles_from
    assert angles({1.0: 1e-4, 5.0: 1e-3}, 1e-4).verdict == HOLDS
    assert angles({1.0: 1e-2, 5.0: 1e-1}, 1.0).verdict == DOES_NOT_HOLD


def test_rates_turn():
    fine = mounting.Sampled(100.0, 0.0, 0.01, 0.01)
    judge = mounting.above_100_from
    assert judge(100.0, 100.0, fine, fine, fine).verdict == HOLDS
    assert judge(100.0, 500.0, fine, fine, fine).verdict == HOLDS_WHEN
    assert judge(200.0, 500.0, fine, fine, fine).verdict == DOES_NOT_HOLD
    pulses = mounting.pulses_from
    assert pulses({(50.0, 0.05): 12.0}, 13.0, 32.0).verdict == HOLDS
    assert pulses({(50.0, 0.25): 61.0}, 13.0, 32.0).verdict == DOES_NOT_HOLD
    both = {"pole": (127.0, 3500.0)}
    assert mounting.receiver_from(both).verdict == CANNOT_BE_JUDGED
    assert mounting.receiver_from({"pole": (7.0, 10.0)}).verdict == DOES_NOT_HOLD


def test_ranking_and_growth_turn():
    first = equations.Ranked(5.0, 3.0, 2.0, 1.0)
    assert equations.ranking((first,)).verdict == HOLDS
    assert equations.ranking((replace(first, speed=1.0),)).verdict == HOLDS_WHEN
    assert equations.ranking((replace(first, gyro=9.0),)).verdict == DOES_NOT_HOLD
    grown = equations.Growth(2.0, 3.0, 1.0, 1.0, 0.0)
    assert equations.time_and_distance(grown).verdict == HOLDS_WHEN
    assert equations.time_and_distance(replace(grown, steady=2.0)).verdict == HOLDS
    assert equations.time_and_distance(replace(grown, bias=1.0)).verdict == DOES_NOT_HOLD


def test_better_sensors_turn():
    good = sensors.Short("a", "tactical", 37.0, 1.0, 2.0)
    bad = sensors.Short("b", "phone", 16.0, 9.0, 20.0)
    # What stands at its end says nothing of a grade.
    held = sensors.Short("c", "tactical", 10.0, 70.0, 170.0)
    assert sensors.reference_10((good, held)).verdict == HOLDS
    assert sensors.reference_10((good, bad)).verdict == HOLDS_WHEN
    assert sensors.reference_10((bad,)).verdict == DOES_NOT_HOLD
    tied = sensors.Tied((0.3, 2.7), (0.5, 3.1), (0.2, 1.3), (0.2, 1.0), (0.2, 1.0))
    assert sensors.satellites(tied).verdict == HOLDS
    near = replace(tied, satellites=(0.3, 1.3))
    assert sensors.satellites(near).verdict == HOLDS_WHEN
    none = replace(tied, satellites=(0.6, 3.0))
    assert sensors.satellites(none).verdict == DOES_NOT_HOLD
