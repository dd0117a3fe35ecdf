"""North as the gyros find it at rest, as the witness of a run without fixes."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from strapdown.config.navigation import NavigationSpec
from strapdown.ellipsoids import WGS84
from strapdown.navigation.gyrocompass import STUDENT, north_within
from strapdown.navigation.heading_checks import UNSEEN, agreeing_sources
from strapdown.navigation.heading_integrity import SURE, HeadingCheck
from strapdown.navigation.measurements.heading import Heading
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.systems.navigation_run import run_navigation

LIMIT = 3.0
PLACE = {"lat_deg": 55.75, "lon_deg": 37.62, "alt_m": 150.0}


def spec_of(*, sensor="fog-1000", latitude=None, stated=None, heading=None, bias=None):
    """A car that stands for five minutes, drives and turns, stands for two, and drives on."""
    table = {
        "simulation": {
            "rate_hz": 25.0,
            "seed": 4,
            "sensor": sensor if stated is None else stated,
            "motion": {
                "kind": "car",
                **PLACE,
                "heading_deg": 40.0,
                "speed_m_per_s": 0.0,
                "manoeuvres": [
                    {"do": "straight", "duration_s": 305.0},
                    {"do": "accelerate", "to_m_per_s": 12.0, "duration_s": 10.0},
                    {"do": "turn_left", "angle_deg": 110.0, "radius_m": 80.0},
                    {"do": "straight", "duration_s": 60.0},
                    {"do": "stop", "braking_s": 8.0, "stay_s": 120.0},
                    {"do": "accelerate", "to_m_per_s": 12.0, "duration_s": 10.0},
                    {"do": "straight", "duration_s": 60.0},
                ],
            },
        },
        "sensors": {"sensor": sensor},
        "mechanization": {"kind": "wander_azimuth", "height": "held"},
        "aiding": {"still": {"kind": "zero_velocity"}},
        "recorder": {"kind": "interval", "rate_hz": 1.0},
        "output": {"figures": False},
    }
    if heading is None:
        table["site"] = PLACE | ({} if latitude is None else {"lat_deg": latitude})
        table["coarse"] = {"kind": "inertial_frame", "duration_s": 60.0}
        table["fine"] = {"kind": "filter", "duration_s": 240.0}
    else:
        table["coarse"] = table["fine"] = {"kind": "none"}
        table["start"] = PLACE | {
            "roll_deg": 0.0,
            "pitch_deg": 0.0,
            "heading_deg": 40.0 + heading,
            "heading_sd_deg": 1.0,
            "position_sd_m": 1.0,
        }
    return NavigationSpec.checked(table)


def errors(result):
    """Light and error of the heading of each second."""
    light = result.trust.heading.table
    known = result.differences
    return light["status"].to_numpy(), np.interp(light.index, known.index, known["heading"])


@pytest.fixture(scope="module")
def sound():
    return run_navigation(spec_of())


def test_a_run_that_found_north_is_green_from_its_begin(sound):
    light, error = errors(sound)
    # A second or two of a soft start are taken for a rest, and scatter.
    assert np.mean(light == 0) > 0.97
    assert light[0] == 0
    assert np.abs(error).max() < LIMIT
    assert set(sound.trust.heading.table["check"]) == {"gyrocompass"}
    assert sound.trust.unconfirmed == ()


def test_what_is_carried_is_off_by_no_more_than_its_bound(sound):
    table = sound.trust.heading.table
    _, error = errors(sound)
    # Run less witness is known; the error of the witness is that of the run less this.
    of_witness = error - table["difference"].to_numpy()
    assert (np.abs(of_witness) < SURE * table["check_sd"].to_numpy()).all()
    # It has followed a turn of 110 deg by the gyros alone: noise of 0.001 deg/√h adds nothing.
    before = table.index < sound.trust.heading.table.index[0] + 100.0
    assert np.ptp(of_witness[before]) < 0.01


def test_a_stop_begins_anew(sound):
    since = sound.trust.heading.table["check_since"].to_numpy()
    # The stop lasts from some 400 s on for two minutes; five seconds at its ends are left out.
    assert len(np.unique(since)) == 2
    assert 480.0 < since[-1] < 560.0


def test_a_wrong_latitude_takes_the_witness_away():
    result = run_navigation(spec_of(latitude=PLACE["lat_deg"] + 5.0))
    light, _ = errors(result)
    # 5 deg are 1.1 deg/h of the Earth's horizontal rate, a hundred times the gyros' bias.
    assert (light != 0).all()
    codes = [one.code for one in result.trust.unconfirmed]
    assert codes[1:] == ["navigation.rest-not-consistent"]


@pytest.mark.slow
def test_a_wrong_stored_heading_is_not_green_while_it_is_wrong():
    light, error = errors(run_navigation(spec_of(sensor="hg1700", heading=9.0)))
    wrong = np.abs(error) > LIMIT
    assert wrong.sum() > 5
    assert not (wrong & (light == 0)).any()


@pytest.mark.slow
def test_gyros_that_find_north_correct_a_wrong_stored_heading():
    light, error = errors(run_navigation(spec_of(heading=9.0)))
    assert np.abs(error).max() < LIMIT
    # The rest at its begin is a compass, though nothing was aligned.
    assert (light == 0).any()


@pytest.mark.slow
def test_gyros_that_are_far_worse_than_stated_bear_nothing_out():
    # Some 5 deg/h in the place of 0.01 deg/h: north is off by tens of degrees.
    result = run_navigation(spec_of(stated="stim300"))
    light, error = errors(result)
    assert np.abs(error).max() > LIMIT
    assert (light != 0).all()


def test_gyros_that_find_no_north_say_what_would_help():
    result = run_navigation(spec_of(sensor="hg1700", heading=0.0))
    light, _ = errors(result)
    assert (light != 0).all()
    codes = [one.code for one in result.trust.unconfirmed]
    assert codes[1:] == ["navigation.gyros-find-north-coarsely"]


def test_the_quantiles_are_those_of_student():
    expected = [stats.t.ppf(0.995, 1 + n) for n in range(3)]
    np.testing.assert_allclose(STUDENT, expected, rtol=1e-9)
    assert stats.norm.ppf(0.995) == pytest.approx(SURE, rel=1e-12)


def test_north_is_found_to_the_bias_over_the_rate_of_the_earth():
    sensors = ImuUncertainty.of_sensor(load_sensor("hg9900"))
    # 0.0035 deg/h and a drift of 0.001 deg/h (Allan) over 15.041 deg/h x cos 60 deg.
    assert north_within(sensors, 60.0, WGS84) == pytest.approx(
        np.degrees(np.hypot(0.0035, 0.001 / 0.61736) / (15.04107 * 0.5)), rel=1e-4
    )


def record_with(offsets):
    """A record of 100 s whose heading aids read so much less than the run."""
    time = pd.Index(np.arange(101.0), name="time")
    tables = {
        f"{name}.heading": pd.DataFrame(
            {"nu": np.radians(off), "s": np.radians(0.5) ** 2, "weight": 1.0}, index=time
        )
        for name, off in offsets.items()
    }
    return SimpleNamespace(
        trajectory=pd.DataFrame(index=time),
        sd=pd.DataFrame({"heading": 0.3}, index=time),
        innovations=tables,
    )


def chain_with(names):
    return SimpleNamespace(navigator=SimpleNamespace(aids=[Heading(name=n) for n in names]))


def test_one_heading_aid_is_no_witness():
    assert agreeing_sources(chain_with(["a"]), record_with({"a": 0.0}), []) == []


def test_two_heading_aids_bear_out_what_the_worse_of_them_allows():
    (told,) = agreeing_sources(chain_with(["a", "b"]), record_with({"a": 0.1, "b": -0.9}), [])
    np.testing.assert_allclose(told.difference, -0.9)
    np.testing.assert_allclose(told.sd, 0.5)


def test_two_heading_aids_that_differ_bear_nothing_out():
    # 2.58 x √(0.5² + 0.3²) deg = 1.5 deg is what chance allows.
    assert agreeing_sources(chain_with(["a", "b"]), record_with({"a": 0.0, "b": 1.6}), []) == []


def test_a_heading_aid_and_the_gyros_bear_each_other_out():
    seconds = np.arange(50.0, 101.0)
    plain, wide = np.full(51, 0.8), np.full(51, 4.0)
    carried = HeadingCheck(50.0, seconds, np.full(51, 0.2), wide, "gyrocompass", plain=plain)
    (told,) = agreeing_sources(chain_with(["a"]), record_with({"a": 0.1}), [carried])
    assert told.time[0] == 50.0
    np.testing.assert_allclose(told.sd, 0.8)


def test_what_nobody_sees_grows_by_the_hour(sound):
    table = sound.trust.heading.table
    since = table["check_since"].to_numpy()
    first = table[since == since[0]]
    sd = first["check_sd"].to_numpy()
    hours = (first.index[-1] - first.index[0]) / 3600.0
    bias = np.hypot(0.01, 0.003)
    # Noise of 0.001 deg/√h, the bias, and 110 deg by a scale factor and an axis that are off.
    scale = 110.0 * np.hypot(10e-6, 0.05e-3)
    chance = np.sqrt(0.001**2 * hours + (bias * hours) ** 2 + scale**2)
    expected = UNSEEN * bias * hours + SURE * chance
    assert SURE * (sd[-1] - sd[0]) == pytest.approx(expected, rel=0.05)
