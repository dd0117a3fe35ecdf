"""What `strapdown navigate` leaves of its report: JSON, page, figures, tables of the terminal."""

from __future__ import annotations

import json
import math
import re

import numpy as np
import pytest

from strapdown.config.navigation import NavigationSpec
from strapdown.dsp.chi_square import plane_bound
from strapdown.errors import Finding
from strapdown.report.document import draw_stills, drawings, write_drawings
from strapdown.report.navigation import navigation_json
from strapdown.report.navigation_document import navigation_document
from strapdown.report.navigation_evaluation import NavigationEvaluation, trust
from strapdown.report.verdict import answer, heading_words
from strapdown.systems.navigation_run import run_navigation

FILE = """
[simulation]
rate_hz = 20
seed = 4
[simulation.motion]
kind = "car"
lat_deg = -33.5
lon_deg = 179.9995
heading_deg = 80
manoeuvres = [
  { do = "accelerate", to_m_per_s = 14, duration_s = 8 },
  { do = "straight", duration_s = 22 },
]
[simulation.gnss.rtk]
rate_hz = 2
position_noise_m = 0.3
outages_s = [[12, 20]]
[sensors]
sensor = "hg1700"
[start]
lat_deg = -33.5
lon_deg = 179.9995
roll_deg = 0
pitch_deg = 0
heading_deg = 80
[aiding.rtk]
kind = "gnss"
"""


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    path = tmp_path_factory.mktemp("navigate") / "drive.toml"
    path.write_text(FILE, encoding="utf-8")
    return run_navigation(NavigationSpec.read(path), path)


@pytest.fixture(scope="module")
def found(result):
    return NavigationEvaluation(result)


def leaves(value, path=""):
    """Every number with the keys that lead to it."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from leaves(item, f"{path}/{key}")
    elif isinstance(value, list):
        for item in value:
            yield from leaves(item, path)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield path, value


def test_the_json_is_the_record(result, found):
    told = navigation_json(found)
    record = result.record
    assert told["end"]["lat_deg"] == float(record.trajectory["lat"].iloc[-1])
    assert told["end"]["heading_sd_deg"] == float(record.sd["heading"].iloc[-1])
    assert told["end"]["horizontal_bound_95_m"] == float(plane_bound(record.covariance)[-1])
    (outage,) = told["outages"]
    assert outage["measurement"] == "rtk"
    assert 11.0 <= outage["from_s"] <= 12.0
    assert 20.0 <= outage["to_s"] <= 21.0
    inside = (record.sd.index >= outage["from_s"]) & (record.sd.index <= outage["to_s"])
    assert outage["largest_horizontal_bound_95_m"] == plane_bound(record.covariance)[inside].max()
    place = told["observations"]["rtk.position"]
    assert place["epochs"] == len(record.innovations["rtk.position"])
    low, high = place["mean_nis_expected_95"]
    assert low < 3.0 < high
    error = np.hypot(*(found.errors.error(axis) for axis in ("north", "east")))
    assert told["against"]["errors"]["horizontal"]["largest_m"] == error.max()


def test_numbers_in_the_json_have_units_in_their_keys(result, found):
    units = re.compile(
        r"_(s|m|deg|m_per_s|hz)\b|_(s|m|deg|m_per_s|95)$|/rms/|/(unit|estimate|sd|rows|samples"
        r"|epochs|rejected|weakened|instants|nees_of|mean_nis|mean_nees|rms_in_sd"
        r"|share_within_bound|correlation_next_epoch|factor)\b"
    )
    told = navigation_json(found)
    told.pop("method")  # as the file has it, whose keys are tested with it
    told.pop("findings")
    # The catalogue of sentences has the units of what a finding shows.
    for key in ("for", "against"):
        for reason in told["trust"][key]:
            reason.pop("data")
            reason.pop("row", None)
    for path, value in leaves(told):
        assert math.isfinite(value), path
        assert units.search(path), path


def test_the_json_states_its_conventions_and_no_clock(result, found):
    told = navigation_json(found)
    assert "north, east, down" in told["conventions"]["body_axes"]
    assert told["conventions"]["errors"].startswith("error = computed − true")
    assert told == navigation_json(NavigationEvaluation(result))
    assert json.loads(json.dumps(told, allow_nan=False)) == told
    assert "\u00a0" not in json.dumps(told, ensure_ascii=False)


def test_each_drawing_is_a_file(result, found, tmp_path):
    document = navigation_document(found, "out")
    write_drawings(document, draw_stills(document), tmp_path / "figures")
    names = sorted(p.stem for p in (tmp_path / "figures").iterdir())
    assert names == sorted(chart.slug for chart in drawings(document))
    assert {"plan", "bounds", "errors-position", "nees", "innovations-rtk-position"} <= set(names)


def test_the_terminal_says_what_the_page_says(result, capsys):
    from strapdown.cli.navigate_tables import print_navigation

    print_navigation(result)
    said = " ".join(capsys.readouterr().out.split())
    found = NavigationEvaluation(result)
    assert trust(found).sentence.replace("\u00a0", " ") in said
    assert heading_words(result.trust).replace("\u00a0", " ") in said
    assert "rtk.position" in said
    assert "within bound" in said
    print_navigation(result, verbose=True)
    said = " ".join(capsys.readouterr().out.split())
    assert answer(found).replace("\u00a0", " ") in said
    assert "gyro bias x" in said


def test_the_answer_on_the_terminal_fits_40_lines(result, capsys):
    from strapdown.cli.navigate_tables import print_navigation

    many = [Finding("navigation.window-too-short", window=k) for k in range(60)]
    print_navigation(result, many)
    # The paths and the seal take four lines.
    printed = capsys.readouterr()
    assert len((printed.out + printed.err).splitlines()) <= 36
    assert "more; see the result" in printed.err


def test_the_bound_of_a_test_outage_is_that_at_its_largest_error():
    from strapdown.navigation.outage_test import WithheldScore
    from strapdown.navigation.record import Span

    score = WithheldScore(
        Span("withheld", 10.0, 20.0),
        np.array([12.0, 15.0]),
        np.array([[1.0, 0.0, 0.0], [0.0, 4.0, 0.0]]),
        np.array([np.diag([1.0, 9.0])] * 2),
        np.ones(2),
    )
    assert score.largest == 4.0
    # East the ellipse of 95 % reaches 2.4477 times 3 m.
    assert score.bound_at_largest == pytest.approx(3.0 * math.sqrt(-2.0 * math.log(0.05)))
    assert score.inside.all()
