"""A record navigated with two corrections of the estimated errors, in one report."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

from strapdown.config.navigation import NavigationSpec
from strapdown.config.outage import OutageSpec
from strapdown.errors import ConfigError
from strapdown.evaluation.trajectory_differences import trajectory_differences
from strapdown.report.navigation import NAVIGATION
from strapdown.report.navigation_evaluation import NavigationEvaluation
from strapdown.report.outage import outage_json
from strapdown.report.outage_document import key_figures
from strapdown.report.paired_corrections import paired_errors, paired_table, reference_words
from strapdown.report.values import NOT_ESTIMATED
from strapdown.systems.navigation_run import run_navigation
from strapdown.systems.outage_run import run_outage

#: The fixes end here, s.
LAST_FIX = 70.0


def spec(**damping):
    place = {"lat_deg": 55.75, "lon_deg": 37.62, "alt_m": 150.0}
    model = {"error_model": "quaternions", "covariance": "wd"}
    return NavigationSpec.checked(
        {
            "simulation": {
                "rate_hz": 50.0,
                "seed": 3,
                "motion": {
                    "kind": "car",
                    **place,
                    "heading_deg": 30.0,
                    "manoeuvres": [
                        {"do": "straight", "duration_s": 40.0},
                        {"do": "accelerate", "to_km_per_h": 50.0, "duration_s": 10.0},
                        {"do": "turn_left", "angle_deg": 90.0, "radius_m": 80.0},
                        {"do": "straight", "duration_s": 60.0},
                    ],
                },
                "gnss": {"gps": {"position_noise_m": 0.5, "outages_s": [[LAST_FIX, 500.0]]}},
            },
            "site": {**place, "position_sd_m": 1.0},
            "sensors": {"sensor": "stim300"},
            "coarse": {
                "kind": "known_heading",
                "heading_deg": 30.0,
                "sd_deg": 1.0,
                "duration_s": 10.0,
            },
            "fine": {
                "kind": "filter",
                "duration_s": 25.0,
                "mechanization": "wander_azimuth",
                **model,
            },
            "mechanization": {"kind": "wander_azimuth", "height": "held"},
            "filter": {"kind": "error_state", **model},
            "damping": damping,
            "aiding": {"gps": {"kind": "gnss"}},
            "recorder": {"kind": "interval", "rate_hz": 5.0},
            "trust": {"repeat": False},
            "output": {"figures": False},
        }
    )


@pytest.fixture(scope="module")
def both():
    return run_navigation(spec(kind="feedback", beside="none"))


@pytest.mark.slow
def test_either_is_the_run_alone_to_the_last_bit(both):
    for record, kind in ((both.record, "feedback"), (both.beside, "none")):
        alone = run_navigation(spec(kind=kind))
        assert alone.beside is None
        assert paired_errors(alone) == ()
        pd.testing.assert_frame_equal(record.trajectory, alone.record.trajectory, check_exact=True)
        np.testing.assert_array_equal(record.covariance, alone.record.covariance)


def test_errors_are_those_against_the_truth(both):
    found = paired_errors(both)
    assert [one.kind for one in found] == ["feedback", "none"]
    for one, record in zip(found, (both.record, both.beside), strict=True):
        apart = trajectory_differences(record.trajectory, both.source.truth, both.ellipsoid)
        np.testing.assert_array_equal(one.position, np.hypot(apart["north"], apart["east"]))
        np.testing.assert_array_equal(one.velocity, np.hypot(apart["VN"], apart["VE"]))
    damped, left = found
    # What the fixes have found is subtracted in one and left on the other.
    assert left.position[-1] > 5.0 * damped.position[-1]
    # Stated: within three standard deviations of both axes at all times, whatever is left.
    for one in found:
        assert (one.position < 3.0 * one.position_sd + 1e-9).all()
        assert (one.velocity < 3.0 * one.velocity_sd + 1e-9).all()


def test_without_a_truth_the_fixes_are_the_reference(both):
    untold = replace(both, source=replace(both.source, truth=None))
    assert "gps" in reference_words(untold)
    exact, by_fixes = paired_errors(both), paired_errors(untold)
    for one, other in zip(exact, by_fixes, strict=True):
        assert (np.diff(other.time) > 0.9).all()
        assert other.time[-1] <= LAST_FIX
        apart = np.interp(other.time, one.time, one.position) - other.position
        # Noise of a fix, 0.5 m an axis; five of them, and 5 m/s² over the step of the record.
        assert np.abs(apart).max() < 5 * 0.5
    nothing = replace(untold, source=replace(untold.source, tables={}))
    assert paired_errors(nothing) == ()
    assert paired_table(NavigationEvaluation(nothing)) is None


def test_the_report_has_both(both, tmp_path):
    NAVIGATION.write(both, tmp_path / "out")
    told = json.loads((tmp_path / "out" / "navigation.json").read_text(encoding="utf-8"))
    errors = told["paired"]["horizontal_errors"]
    damped, left = paired_errors(both)
    assert errors["none"]["position_at_end_m"] == left.position[-1]
    assert errors["feedback"]["position_at_end_m"] == damped.position[-1]
    table = pd.read_csv(tmp_path / "out" / "paired.csv", comment="#")
    np.testing.assert_array_equal(table["none_position_error_m"], left.position)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert page.count("none, 1 sd as stated") >= 1
    both.plot("paired").save(tmp_path / "paired.svg")
    assert (tmp_path / "paired.svg").stat().st_size > 0
    rows = paired_table(NavigationEvaluation(both)).rows
    assert len(rows[0]) == len(paired_table(NavigationEvaluation(both)).columns)
    assert rows[-1][0] == "rms"


@pytest.mark.parametrize("beside", ["feedback", "sideways"])
def test_beside_is_another_kind(beside):
    with pytest.raises(ConfigError, check=coded("config.unknown-correction-beside")):
        spec(kind="feedback", beside=beside)


def test_an_outage_has_no_bound_of_a_height_that_is_not_estimated():
    """The same drive, of which 17 states know no height."""
    made = run_outage(OutageSpec(outage_s=2.0, places=1), spec(kind="feedback"))
    told = outage_json(made)
    assert told["at_the_end"]["vertical_sd_m"] is None
    assert told["at_the_end"]["horizontal_sd_m"] > 0.0
    figures = {one.name: one.value for one in key_figures(made)}
    assert figures["Vertical"] == NOT_ESTIMATED
    json.dumps(told, allow_nan=False)
