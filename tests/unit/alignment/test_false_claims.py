"""What no rest can tell is not claimed, and what cannot be aligned is said in words that help."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parent))

from resting import SITE, UNCERTAINTY, resting, roughly

from strapdown.alignment.fine import FineAlignment, heading_floor_deg, refuse_false_claims
from strapdown.alignment.levelling import KnownHeading
from strapdown.alignment.record_checks import latitude_findings, outlier_findings
from strapdown.errors import DataError, DivergenceError
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.simulation import Origin, StationaryMotion, simulate_imu
from strapdown.tables import GYRO

CHEAP = load_sensor("mpu-6050")


@pytest.fixture(scope="module")
def rest():
    return resting(3, 120.0)


@pytest.fixture(scope="module")
def fine(rest):
    return FineAlignment().align(rest.imu, SITE, UNCERTAINTY, roughly(rest))


def test_a_heading_that_is_stated_owes_nothing_to_the_gyros(rest):
    heading = float(roughly(rest, at="end").roll_pitch_heading[2])
    coarse = KnownHeading(heading + 4.0, 5.0).align(rest.imu, SITE, UNCERTAINTY)
    assert coarse.heading_given
    # So the filter begins with what was stated, and not with ten times it.
    found = FineAlignment().align(rest.imu, SITE, UNCERTAINTY, coarse)
    assert found.prior_heading_sd_deg == pytest.approx(5.0, rel=1e-6)


def test_a_stated_heading_that_is_wrong_is_told(rest):
    heading = float(roughly(rest, at="end").roll_pitch_heading[2])
    coarse = KnownHeading(heading + 60.0, 5.0).align(rest.imu, SITE, UNCERTAINTY)
    with pytest.raises(
        DataError, check=coded("alignment.heading-contradicted-by-gyros", quantity="heading")
    ):
        FineAlignment().align(rest.imu, SITE, UNCERTAINTY, coarse)


def test_no_rest_beats_the_drift_of_its_gyros(fine):
    # Navigation grade: b_E / (omega cos(lat)), and what was known before adds next to nothing.
    floor = heading_floor_deg(fine, SITE)
    east = float(np.mean(fine.filter.model.sensors[0].sd[:2]))
    assert floor == pytest.approx(np.degrees(east / SITE.earth_rate[0]), rel=0.02)
    assert fine.alignment.sd_deg[2] > floor
    refuse_false_claims(fine, SITE)


def test_a_claim_beyond_the_floor_is_refused(fine):
    few = fine.alignment.covariance.copy()
    few[2, 2] = np.radians(0.5 * heading_floor_deg(fine, SITE)) ** 2
    claimed = replace(fine, alignment=replace(fine.alignment, covariance=few))
    with pytest.raises(DataError, match=r"the limit is .*\n.*--coarse-only"):
        refuse_false_claims(claimed, SITE)


def test_a_cheap_unit_gets_no_heading_out_of_a_stated_one():
    # A tilt of degrees and a bias of tenths of m/s²: their second order is beyond the noise.
    stand = StationaryMotion(60.0, Origin(55.0, 37.0, 200.0), 2.0, -3.0, 60.0)
    sensors = ImuUncertainty.of_sensor(CHEAP)
    imu, _ = simulate_imu(stand, CHEAP.draw(4), rate=50.0, sampling="mean", seed=4, source="c.csv")
    coarse = KnownHeading(60.0, 5.0).align(imu, SITE, sensors)
    try:
        found = FineAlignment().align(imu, SITE, sensors, coarse)
    except (DataError, DivergenceError) as error:
        assert error.finding.file == "c.csv"
        assert "coarse-only" in error.finding.remedy
    else:
        assert found.alignment.sd_deg[2] > 0.7 * 5.0


def test_a_gap_is_told_with_what_a_command_can_do(rest):
    torn = rest.imu.drop(rest.imu.index[1000:1200])
    torn.attrs = dict(rest.imu.attrs)
    with pytest.raises(DataError, match="gap of 4") as error:
        FineAlignment().align(torn, SITE, UNCERTAINTY, roughly(rest, at="end"))
    assert "longest_step" not in str(error.value)
    assert "--from" in error.value.finding.remedy


def test_degrees_for_radians_are_named(rest):
    wrong = rest.imu.copy()
    wrong[GYRO] = np.degrees(wrong[GYRO])
    wide = roughly(rest)
    wide.covariance[2, 2] = 1.0
    with pytest.raises(
        DataError, check=coded("alignment.coarse-heading-too-uncertain-gyros-in-deg-per-s")
    ):
        FineAlignment().align(wrong, SITE, UNCERTAINTY, wide)


def test_a_latitude_that_there_is_not():
    (said,) = latitude_findings(SITE, -2116.0, 37.0, "x.csv")
    assert said.code == "alignment.no-latitude-fits"
    assert "2116" not in said.what
    (said,) = latitude_findings(SITE, 40.0, 0.5, "x.csv")
    assert "40" in said.what


def test_one_step_is_one_step():
    values = np.random.default_rng(1).normal(size=(4000, 1))
    values[2000:] += 100.0
    (said,) = outlier_findings(values, ["gyro_x"], "x.csv")
    assert said.what.startswith("one step between samples")
    assert "robust_fir" in (said.remedy or "")
