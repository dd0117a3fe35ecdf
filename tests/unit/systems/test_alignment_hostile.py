"""Records that cannot be aligned, or not all of them, and what is said of what is not known."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown.cli.align import spec_of_flags
from strapdown.errors import ConfigError, DataError
from strapdown.report.alignment_document import (
    attitude_chart,
    bounds_hold,
    headline,
    key_figures,
    limits,
    trust,
)
from strapdown.report.values import rate_words
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.simulation import Origin, PathMotion, StationaryMotion, Wave, simulate_imu
from strapdown.systems.alignment_run import channel_findings, run_alignment
from strapdown.tables import ACCEL, GYRO

PLACE = Origin(55.0, 37.0, 100.0)
SENSOR = load_sensor("fog-1000")
SENSORS = ImuUncertainty.of_sensor(SENSOR)
FLAGS = (
    *("lat", "lon", "alt", "sensor", "method", "coarse_only", "gnss", "prefilter", "from_s"),
    "to_s",
    *("duration", "rate", "sampling", "columns", "gyro_unit", "accel_unit", "time_unit", "axes"),
    *("repair", "calibration"),
    "format",
    *(f"gnss_{key}" for key in ("format", "columns", "units", "datum_height", "origin")),
    *("gnss_position_sd", "gnss_velocity_sd"),
)


@pytest.fixture(scope="module")
def stand():
    motion = StationaryMotion(120.0, PLACE, 1.0, 2.0, 40.0)
    return simulate_imu(motion, SENSOR.draw(1), rate=50.0, sampling="mean", seed=1)[0]


def write(path, imu, begin=0.0):
    columns = [*(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]
    out = imu[[*GYRO, *ACCEL]].set_axis(columns, axis=1)
    out.insert(0, "time_s", imu.index.to_numpy() + begin)
    path.write_text("# sampling: mean\n" + out.to_csv(index=False))
    return path


def flagged(log, **given):
    table = dict.fromkeys(FLAGS) | {"lat": 55.0, "lon": 37.0, "alt": 100.0, "sensor": "fog-1000"}
    return spec_of_flags(log, table | given)


def result_of(log, **given):
    return run_alignment(flagged(log, **given))


def test_a_duration_counts_from_the_first_stamp_of_any_clock(stand, tmp_path):
    # Seconds of a GPS week, with a column that says no unit.
    log = write(tmp_path / "week.csv", stand, 243261.85)
    log.write_text(log.read_text().replace("time_s", "t"))
    found = result_of(log, duration=60.0, coarse_only=True)
    time = found.imu.index
    assert time[0] == pytest.approx(243261.85)
    assert time[-1] - time[0] == pytest.approx(60.0, abs=0.03)
    assert "243321.8" in headline(found)


def test_a_duration_counts_from_where_it_is_said_to_begin(stand, tmp_path):
    found = result_of(write(tmp_path / "a.csv", stand), from_s=20.0, duration=60.0)
    assert [round(t) for t in (found.imu.index[0], found.imu.index[-1])] == [20, 80]


def test_a_channel_that_stops_is_refused_with_the_stretch_that_is_left(stand):
    for channel, value in (("gyro_z", None), ("gyro_x", 0.0)):
        stuck = stand.copy()
        column = stuck.columns.get_loc(channel)
        stuck.iloc[2000:, column] = stuck.iloc[2000, column] if value is None else value
        with pytest.raises(DataError, match=f"{channel}.*67% of the record") as error:
            channel_findings(stuck, SENSORS)
        assert "--duration 40" in error.value.finding.remedy


def test_a_triad_that_reads_nothing_is_refused(stand):
    dead = stand.copy()
    dead[GYRO] = 0.0
    with pytest.raises(DataError, check=coded("alignment.channel-lost")):
        channel_findings(dead, SENSORS)


def test_sound_channels_are_left_alone(stand):
    assert channel_findings(stand, SENSORS) == ()


def test_a_log_without_noise_was_not_recorded(stand, tmp_path):
    held = stand.copy()
    held[:] = np.tile(stand.mean().to_numpy(), (len(stand), 1))
    found = result_of(write(tmp_path / "held.csv", held))
    assert trust(found).verdict != "trusted"
    assert any("no channel changes" in f.what for f in found.findings)


@pytest.mark.slow
def test_a_rocking_body_is_what_the_inertial_frame_is_for(tmp_path):
    waves = {"roll_waves": (Wave(1.5, 6.0, 0.0),), "pitch_waves": (Wave(0.7, 4.0, 30.0),)}
    motion = PathMotion(300.0, PLACE, heading_deg=40.0, **waves)
    imu, _ = simulate_imu(motion, SENSOR.draw(2), rate=50.0, sampling="mean", seed=2)
    found = result_of(write(tmp_path / "rock.csv", imu))
    assert trust(found).verdict == "trusted"
    assert any(f.what.startswith("the body rocks") for f in found.findings)


def test_bounds_that_the_record_contradicts_are_not_shown_as_such(stand, tmp_path):
    # 60 outliers of half a rad/s or of 20 m/s², and no pre-filter.
    draw = np.random.default_rng(4)
    values = stand.to_numpy().copy()
    for row, column in zip(draw.integers(0, len(values), 60), draw.integers(0, 6, 60), strict=True):
        values[row, column] += draw.choice([-1.0, 1.0]) * (0.02 if column < 3 else 5.0)
    bad = stand.copy()
    bad[:] = values
    log = write(tmp_path / "spikes.csv", bad)
    try:
        found = result_of(log)
    except DataError as error:
        assert "robust_fir" in error.finding.remedy
        return
    assert trust(found).verdict == "distrusted"
    if not bounds_hold(found):
        assert "contradicts" in headline(found)
        assert all("contradicts" in figure.bound for figure in key_figures(found))


def test_a_heading_that_nobody_sought_is_not_known(stand, tmp_path):
    log = write(tmp_path / "a.csv", stand)
    found = result_of(log, method="levelling", sensor="mpu-6050")
    assert "Heading unknown" in headline(found)
    (head, said), _ = limits(found)
    assert head == "The heading was not determined"
    assert "gnss_course" in said and "deg/s" in said
    found = result_of(log, method="levelling")
    assert "inertial_frame" in limits(found)[0][1]


def test_gyros_that_cannot_carry_an_attitude_draw_no_bound_around_it(stand, tmp_path):
    log = write(tmp_path / "a.csv", stand)
    cheap, good = (result_of(log, method="levelling", sensor=s) for s in ("mpu-6050", "fog-1000"))
    assert [bool(panel.fills) for panel in attitude_chart(cheap).panels] == [False] * 3
    assert "propagated to the start" in attitude_chart(cheap).caption
    assert [bool(panel.fills) for panel in attitude_chart(good).panels] == [True] * 3


def test_a_stated_heading_is_not_limited_by_gyros_that_cannot_tell_it(stand, tmp_path):
    log = write(tmp_path / "a.csv", stand)
    method = "known_heading:heading_deg=40,sd_deg=2"
    found = result_of(log, method=method, sensor="mpu-6050", coarse_only=True)
    assert limits(found)[0][0] == "The heading is as good as the stated heading"


def test_rates_in_the_unit_in_which_they_are_small():
    assert rate_words(np.radians(0.01 / 3600.0)) == "0.010 deg/h"
    assert rate_words(np.radians(11.5)) == "11.5 deg/s"


@pytest.mark.parametrize(
    ("given", "place", "said"),
    [
        ({"lat": float("nan")}, "--lat", "nan does not fit"),
        ({"axes": "q,r,s"}, "--axes", "three axes"),
        ({"method": "known_heading"}, "--method, heading_deg", "the value is missing"),
        ({"duration": -1.0}, "--duration", "--duration: a duration of -1 s is not positive"),
    ],
)
def test_a_flag_is_told_by_its_name(stand, tmp_path, given, place, said):
    with pytest.raises(ConfigError, match=said) as error:
        flagged(write(tmp_path / "a.csv", stand), **given)
    finding = error.value.finding
    assert finding.data.get("faults", (finding,))[0].quantity == place
