"""The report of a run of navigation says what its record holds, in words and tables."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from tests.coded import coded
from tests.unit.report.navigation_records import one_epoch, record, shifted, told, without_aids

from strapdown.constants import TWO_SIDED_95
from strapdown.dsp.chi_square import PLANE_95
from strapdown.errors import DataError, Finding
from strapdown.navigation.outage_test import Withheld, WithheldScore
from strapdown.navigation.record import Span
from strapdown.report.chart import Chart
from strapdown.report.document import (
    Items,
    KeyFigures,
    Paragraph,
    TableBlock,
    capital,
)
from strapdown.report.document_html import document_page
from strapdown.report.navigation_charts import bound_chart, error_charts, height_chart
from strapdown.report.navigation_document import (
    cautions,
    end_table,
    error_table,
    event_table,
    headline,
    key_figures,
    navigation_document,
    observation_table,
    outage_table,
    separation_chart,
    smoothing_chart,
    smoothing_table,
    state_table,
    withheld_table,
)
from strapdown.report.navigation_evaluation import distance_over_ground, trust
from strapdown.report.values import NOT_ESTIMATED, duration_words, length_words, share_words


def plain(text):
    return text.replace("\u00a0", " ")


def rows(block):
    return {row[0]: [plain(cell) for cell in row[1:]] for row in block.rows}


def test_the_headline_is_the_end_of_the_record():
    made = record()
    found = told(made)
    last = made.trajectory.iloc[-1]
    said = plain(headline(found))
    assert f"{last['lat']:.6f}°, {last['lon']:.6f}°" in said
    assert "after 120 s and 959 m" in said  # 8 m/s over 119.9 s
    assert "position 7.34 m" in said  # 2.4477 * 3 m
    assert "heading 0.98°" in said  # 1.96 * 0.5 deg


def test_the_end_stands_in_the_table():
    made = record(place=(-33.75, -70.6, 560.0), course=200.0)
    table = rows(end_table(told(made)))
    assert table["heading"] == ["200.00 ± 0.98°"] * 2
    assert table["horizontal ±"] == ["7.34 m"] * 2
    assert table["velocity north"][1] == "−7.52 ± 0.20 m/s"  # 8 cos 200
    assert table["position"][0].startswith("−33.75")
    assert "−70.60" in table["position"][0]


def without_height(made):
    """The same run of an error model without a height."""
    covariance, sd = made.covariance.copy(), made.sd.copy()
    covariance[:, 2] = covariance[:, :, 2] = np.nan
    sd["down"] = np.nan
    return replace(made, covariance=covariance, sd=sd)


def test_what_is_not_estimated_has_no_bound_of_zero():
    made = without_height(record())
    found = told(made, truth=shifted(made.trajectory, down=176.0))
    assert made.not_estimated == ("down",)
    table = rows(end_table(found))
    assert all(NOT_ESTIMATED in cell and "±" not in cell for cell in table["height"])
    assert all("±" in cell for cell in table["heading"])
    errors = {row[0]: row for row in error_table(found).rows}
    assert errors["down (height), m"][4] == NOT_ESTIMATED
    # Neither for nor against the run: its error is in the table.
    assert float(errors["down (height), m"][2]) == pytest.approx(176.0)
    assert not [one for one in trust(found).reasons if one.data.get("component") == "height"]
    figures = key_figures(found)
    assert NOT_ESTIMATED in figures[1].bound
    assert found.errors.freedom["all"] == 8
    bounds = bound_chart(found).panels
    assert NOT_ESTIMATED in bounds[1].y_label
    assert [line.name for line in bounds[1].lines] == ["horizontal"]
    height = height_chart(found).panels[-1]
    assert NOT_ESTIMATED in height.y_label
    assert not height.fills
    panels = error_charts(found)[0].panels[-3:]
    assert [bool(panel.fills) for panel in panels] == [True, True, False]
    for text in words(navigation_document(found, "made")):
        assert not re.search(r"\bnan\b", text), text


def test_the_separation_of_filter_and_smoother_has_its_expected_band():
    smoothed = record()
    ahead = record(place=tuple(np.add((55.0, 37.0, 150.0), (1.0 / 111_350.0, 0.0, 0.0))))
    forward = replace(ahead, sd=2.0 * smoothed.sd)
    chart = separation_chart(told(smoothed, forward=forward))
    north, east, down = (p for p in chart.panels if not p.categories)
    # A degree of latitude is 111,350 m at 55 deg north.
    assert north.lines[0].y == pytest.approx(1.0, abs=2e-3)
    assert east.lines[0].y == pytest.approx(0.0, abs=2e-3)
    # Variances 4 and 1: the difference has a standard deviation of the root of 3 of the smoothed.
    (fill,) = down.fills
    at = np.isin(smoothed.sd.index, fill.x)
    expected = TWO_SIDED_95 * np.sqrt(3.0) * smoothed.sd["down"].to_numpy()[at]
    assert fill.high == pytest.approx(expected)
    assert fill.low == pytest.approx(-expected)
    assert separation_chart(told(smoothed)) is None


def test_a_smoothed_run_has_no_bound_of_what_is_not_estimated():
    made = without_height(record())
    found = told(made, forward=without_height(record()))
    (chart,) = [smoothing_chart(found)]
    assert [panel.y_label for panel in chart.panels if panel.lines and panel.log] == [
        "horizontal, m",
        "heading, deg",
    ]
    table = rows(smoothing_table(found))
    assert table["down, m"] == ["–", "–", "–", NOT_ESTIMATED]
    assert NOT_ESTIMATED not in table["north, m"]


def test_the_final_heading_is_shown_with_its_status():
    found = told(record())
    (heading,) = [one for one in key_figures(found) if one.name == "Final heading"]
    assert found.run.trust.heading.spans[-1].status in heading.bound
    slugs = [one.slug for one in navigation_document(found, "made").sections if one.blocks]
    assert slugs[1:4] == ["integrity", "quantities", "first"]


def test_longitudes_that_went_on_are_told_within_half_a_turn():
    made = record(place=(10.0, 179.9995, 0.0), course=90.0)
    made.trajectory["lon"] = np.mod(made.trajectory["lon"], 360.0)
    assert made.trajectory["lon"].iloc[-1] > 180.0
    assert "−179.99" in plain(headline(told(made)))


def test_outages_are_told_with_their_largest_bound():
    found = told(record())
    assert outage_table(found).rows[0][1:] == ("50\u00a0s", "30.0\u00a0s", "73.4\u00a0m")
    said = dict(cautions(found))
    assert "73.4" in said["In outages the position is less accurate"]
    assert plain(key_figures(found)[-1].value) == "± 73.4 m"
    assert outage_table(told(record(outage=None))) is None


def test_a_run_that_ends_in_an_outage_says_so():
    found = told(record(outage=(90.0, 120.0)))
    assert any("ended without rtk" in head for head, _ in cautions(found))


def test_observations_are_counted():
    found = told(record())
    (row,) = observation_table(found).rows
    (one,) = found.agreements
    table = found.record.innovations["rtk.position"]
    assert row[:4] == ("rtk.position", str(len(table)), "1", "0")
    used = table[table["weight north, m"] > 0.0]
    squares = np.mean([used[f"nu {x}"] ** 2 / 4.0 for x in one.labels])
    assert float(row[4]) == pytest.approx(np.sqrt(squares), abs=0.005)
    assert one.inside


@pytest.mark.parametrize(("factor", "code"), [(3.0, "larger"), (0.2, "smaller")])
def test_what_does_not_agree_speaks_against_it(factor, code):
    made = record()
    table = made.innovations["rtk.position"]
    table[[c for c in table if c.startswith("nu ")]] *= factor
    found = trust(told(made))
    assert found.verdict == "reserve"
    assert f"navigation.innovations-{code}" in [one.code for one in found.against]


def test_what_lasts_speaks_against_it():
    made = record(seconds=300.0, outage=None, reject=())
    table = made.innovations["rtk.position"]
    table["nu north, m"] = 2.0 * np.sin(np.arange(len(table)) / 5.0) * np.sqrt(2.0)
    found = told(made)
    assert found.agreements[0].remembers
    assert trust(found).verdict == "reserve"
    assert any("correlated" in head for head, _ in cautions(found))


def test_what_lasts_and_is_stated_wide_enough_for_it_does_not():
    made = record(seconds=300.0, outage=None, reject=())
    table = made.innovations["rtk.position"]
    # A sine of 0.1 sd over 50 epochs: correlated by 0.98, as much as independent errors of 0.7 sd.
    for label in ("north, m", "east, m", "down, m"):
        table[f"nu {label}"] = 2.0 * 0.1 * np.sin(np.arange(len(table)) / 5.0) * np.sqrt(2.0)
    one = told(made).agreements[0]
    assert one.correlation > 0.9
    assert 0.5 < one.lasting < 1.0
    assert not one.remembers
    assert one.acceptable
    assert not any("correlated" in head for head, _ in cautions(told(made)))


def test_most_epochs_far_off_refute_it_and_outliers_do_not():
    few, most = record(outage=None, reject=()), record(outage=None, reject=())
    nu = few.innovations["rtk.position"].columns[:3]
    for made, share in ((few, 4), (most, 1)):
        table = made.innovations["rtk.position"]
        table.loc[table.index[::share], nu] = 40.0 * np.sqrt(table["s north, m"].iloc[0])
    assert trust(told(few)).verdict == "reserve"
    found = trust(told(most))
    assert found.verdict == "distrusted"
    assert found.against[0].code == "navigation.innovations-larger"
    assert found.against[0].data["name"] == "rtk.position"


def test_large_errors_that_last_refute_it():
    made = record(seconds=300.0, outage=None, reject=())
    table = made.innovations["rtk.position"]
    # Less than half of the epochs, one after the other: the median does not see them.
    wave = 14.0 * np.sin(np.arange(140) / 5.0) * np.sqrt(table["s north, m"].iloc[0])
    table.iloc[:140, 0] = wave
    (found,) = told(made).agreements
    assert found.usual < 3.0 < found.ratio
    assert found.refutes


def test_an_aid_that_is_mostly_refused_refutes_it():
    made = record(outage=None, reject=())
    table = made.innovations["rtk.position"]
    table.loc[table.index[: len(table) // 2 + 1], "weight north, m"] = 0.0
    assert trust(told(made)).verdict == "distrusted"


@pytest.mark.parametrize(("severity", "verdict"), [("note", "trusted"), ("warning", "reserve")])
def test_a_note_speaks_against_nothing_whatever_its_remedy(severity, verdict):
    made = record()
    fact = Finding("navigation.fixes-begin-late", severity=severity, file="log.imu", apart=3.0)
    assert fact.remedy
    found = trust(told(made, findings=(fact,), truth=shifted(made.trajectory)))
    assert found.verdict == verdict, found.sentence


def test_sensors_alone_are_borne_out_by_nothing():
    found = trust(told(without_aids(record())))
    assert found.verdict == "reserve"
    assert [one.code for one in found.against] == ["navigation.nothing-observed"]


def test_many_rejections_speak_against_it():
    found = trust(told(record(reject=range(20))))
    assert "navigation.many-rejected" in [one.code for one in found.against]


def test_as_many_rejections_in_a_row_as_the_rule_endures_speak_against_it():
    """After ten the next fix is taken, whichever of receiver and inertial solution was wrong."""
    assert trust(told(record(seconds=600.0, reject=range(20, 29)))).against == ()
    found = trust(told(record(seconds=600.0, reject=range(20, 30))))
    (down,) = (one for one in found.against if one.data["component"] == "rtk.position down")
    assert down.code == "navigation.rejected-in-a-row"
    assert down.data["count"] == 10
    assert (down.data["since"], down.data["until"]) == (21.0, 30.0)


def test_a_good_run_can_be_trusted():
    made = record()
    found = trust(told(made, truth=shifted(made.trajectory, north=1.0)))
    assert found.verdict == "trusted", found.sentence
    assert "100" in found.sentence


def test_an_error_that_hardly_changes_is_one_draw():
    """One that is beyond its bounds for most of the time occurs in a few percent of good runs."""
    made = record()
    for north, verdict, code in (
        (5.0, "trusted", "navigation.error-beside-bound-lasting"),
        (8.0, "distrusted", "navigation.error-beside-bound"),
    ):
        found = told(made, truth=shifted(made.trajectory, north=north))
        assert found.errors.score("horizontal").share < 0.3
        assert (trust(found).verdict, trust(found).reasons[0].code) == (verdict, code)


def test_a_run_beyond_its_bounds_cannot():
    made = record(outage=None)
    found = told(made, truth=shifted(made.trajectory, north=30.0))
    assert trust(found).verdict == "distrusted"
    assert found.errors.score("horizontal").share == 0.0
    assert rows(error_table(found))["horizontal, m"][0] == "30.0"


def test_errors_are_of_the_time_and_not_of_the_instants():
    """Off by 30 m in the second half, where instants are five times as wide apart."""
    made = record(outage=None)
    near = np.flatnonzero((made.sd.index <= 60.0) | (np.arange(120) % 5 == 4))
    thin = replace(
        made,
        sd=made.sd.iloc[near],
        covariance=made.covariance[near],
        sensors=made.sensors.iloc[near],
        sensors_sd=made.sensors_sd.iloc[near],
    )
    truth = shifted(made.trajectory, north=30.0)
    early = made.trajectory.index.to_numpy() <= 60.0
    for name in ("lat", "lon", "alt"):
        truth.loc[truth.index[early], name] = made.trajectory[name].to_numpy()[early]
    (north,) = (s for s in told(thin, truth=truth).errors.scores if s.quantity == "north")
    # Steps of 5 s count as 3: an instant stands for three times one before, of 60 and 12.
    assert north.share == pytest.approx(60.0 / (60.0 + 3.0 * 12.0), abs=0.02)
    assert north.rms == pytest.approx(30.0 * np.sqrt(1.0 - north.share), rel=1e-6)


def test_a_truth_of_another_time_is_refused():
    made = record()
    truth = made.trajectory.set_index(made.trajectory.index + 1e4)
    truth.index.name = "time"
    with pytest.raises(
        DataError, check=coded("evaluation.run-truth-no-instant-common", quantity="time")
    ):
        told(made, truth=truth).errors  # noqa: B018


def test_states_are_told_with_what_was_known_before():
    table = rows(state_table(told(record())))
    # exp(-119 / 30) of the bound of the first mark is left.
    assert table["gyro bias x"][2] == "98.1 %"
    assert table["gyro bias y"][2] == "0 %"
    assert table["rtk: time offset"][0] == "0.1250 ± 0.0036 s"
    said = dict(cautions(told(record())))
    assert "gyro bias y" in said["Not observable in this run"]
    assert "gyro bias x" not in said["Not observable in this run"]


def test_what_was_withheld_is_scored():
    def score(begin, end, error, bound):
        one = np.array([[bound, 0.0], [0.0, bound]]) ** 2 / PLANE_95**2
        there = np.array([[error, 0.0, 0.0]])
        span = Span("withheld", begin, end)
        return Withheld(WithheldScore(span, np.array([end]), there, one[None], np.ones(1)), None)

    given = (score(50.0, 80.0, 12.0, 20.0), score(1.0, 2.0, 9.0, 3.0))
    found = told(record(), withheld=given)
    table = withheld_table(found)
    assert [row[-2:] for row in table.rows] == [
        ("100\u00a0% of 1", "yes"),
        ("0\u00a0% of 1", "no"),
    ]
    assert table.strong == (1,)
    assert trust(found).verdict == "distrusted"


def test_events_beyond_what_can_be_read_are_in_the_json():
    made = record()
    many = replace(made, events=made.events * 50)
    assert "10 more are in navigation.json" in event_table(told(many)).caption


def test_numbers_are_said_as_people_say_them():
    assert [
        plain(length_words(x)) for x in (0.0213, 2.5, 13.42, 387.6, 2410.0, 28400.0, 2.5e5)
    ] == [
        "0.021 m",
        "2.50 m",
        "13.4 m",
        "388 m",
        "2.41 km",
        "28.4 km",
        "250 km",
    ]
    assert [
        plain(duration_words(x)) for x in (0.5, 30.25, 221.4, 1805.0, 1800.0, 7200.0, 8000.0)
    ] == [
        "0.50 s",
        "30.2 s",
        "221 s",
        "30 min 5 s",
        "30 min",
        "2 h",
        "2 h 13 min",
    ]
    assert [plain(share_words(x)) for x in (1.0, 0.99999, 0.974, 0.0, 1e-5)] == [
        "100 %",
        "99.9 %",
        "97.4 %",
        "0 %",
        "0.1 %",
    ]
    assert distance_over_ground(record().trajectory) == pytest.approx(8.0 * 119.9)


def words(document):
    out = [document.title, document.subtitle]
    for block in (*document.front, *(b for s in document.sections for b in s.blocks)):
        match block:
            case Paragraph(text=text):
                out.append(text)
            case Items(rows=those):
                out += [f"{head} {text}" for head, text in those]
            case KeyFigures(figures=figures):
                out += [f"{f.value} {f.bound} {f.note}" for f in figures]
            case TableBlock(rows=those):
                out += [" ".join(row) for row in those]
            case Chart() as chart:
                out.append(f"{chart.title} {chart.caption}")
    return out


@pytest.mark.parametrize(
    "make",
    [
        lambda made: made,
        without_aids,
        one_epoch,
        lambda made: one_epoch(without_aids(made)),
        lambda made: replace(
            without_aids(made),
            sensors=made.sensors.iloc[:, :0],
            sensors_sd=made.sensors_sd.iloc[:, :0],
        ),
        without_height,
    ],
)
def test_any_run_has_a_report_without_numbers_that_are_none(make):
    document = navigation_document(told(make(record())), "out")
    for text in words(document):
        assert not re.search(r"\bnan\b|\binf\b|None\b(?!\.)", text), text
    titles = [s.title for s in document.sections]
    assert titles[0] == "The answer"
    assert titles[-1] == "Conventions"


def test_findings_stand_with_their_remedies():
    made = record()
    finding = Finding("navigation.fixes-begin-late", file="rtk.csv", apart=3.0)
    findings = (finding,)
    document = navigation_document(told(made, findings=findings), "out")
    (section,) = [s for s in document.sections if s.slug == "findings"]
    assert section.blocks[0].rows[0] == (
        "rtk.csv",
        f"{finding.what}. {capital(finding.remedy)}.",
    )


def test_the_page_needs_no_network_and_is_the_same_twice():
    given = told(record(), name="<script>alert(1)</script>.csv")
    page = document_page(navigation_document(given, "out"))
    assert page == document_page(navigation_document(given, "out"))
    assert "<script>alert" not in page
    assert not re.search(r'(?:src|href)="https?:', page)


def test_a_long_run_makes_no_long_page():
    made = record(seconds=3600.0, rate=50.0)
    document = navigation_document(told(made), "out")
    assert len(document_page(document)) < 1.5e6


def test_a_name_at_the_beginning_keeps_its_spelling() -> None:
    assert capital("gnss.position north: rejected") == "gnss.position north: rejected"
    assert capital("log.csv has no time") == "log.csv has no time"
    assert capital("position: rejected") == "Position: rejected"
