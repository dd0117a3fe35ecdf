"""Which sensor is proposed where none is named, and that it is good enough for the one it was."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from strapdown.config.logs import FixesTable, LogTable
from strapdown.config.navigation import NavigationSpec
from strapdown.constants import DEG_PER_HOUR, MICRO_G
from strapdown.frames import place_difference
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.sensors.uncertainty import UNIT_FACTOR, ImuUncertainty
from strapdown.simulation import Origin, car, simulate_imu
from strapdown.simulation.earth_motion import StationaryMotion
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.simulation.vehicles import Accelerate, Stop, Straight, Turn
from strapdown.systems.navigation_proposal import (
    LOUD,
    NOISE_OF_GRADES,
    RECTIFIED,
    Scatter,
    _rest_bias,
    _scatter,
    _sensors,
    propose,
)
from strapdown.systems.navigation_run import run_navigation
from strapdown.tables import ACCEL, GEODETIC, GYRO

TACTICAL_NOISE = NOISE_OF_GRADES[0][1]
PLACE = (45.0, 20.0, 80.0)
#: RTK, m and m/s.
RECEIVER = {"rate": 1.0, "position_noise": 0.01, "velocity_noise": 0.03}


def scatter(gyro, accel, shaken=1.0):
    """Quiet and usual noise of three like axes, as `_scatter` gives them."""
    quiet = np.outer([gyro, accel], np.ones(3))
    return Scatter(quiet, shaken * quiet, shaken * quiet, 10.0 * shaken * quiet)


def sensors(*given):
    return _sensors(*given)[0]


def test_noise_tells_the_grade_and_is_stated():
    gyro, accel = 0.5 * TACTICAL_NOISE, 60.0 / MICRO_G
    found = sensors(None, scatter(gyro, accel), None)
    assert found["sensor"] == "tactical-grade"
    assert found["accel"]["noise_density_ug_per_sqrt_hz"] == (60.0, 60.0, 60.0)
    assert np.degrees(gyro) * 60.0 == pytest.approx(
        found["gyro"]["noise_density_deg_per_sqrt_h"][0], rel=0.05
    )
    for noise, grade in ((0.1, "industrial-grade"), (0.168, "consumer-grade")):
        found = sensors(None, scatter(np.radians(noise) / 60.0, accel), None)
        assert found["sensor"] == grade


@pytest.mark.parametrize(
    ("noise", "bias", "grade"),
    [
        (0.003, 0.3, "intermediate-grade"),
        (0.003, None, "tactical-grade"),  # a filtered sensor has any noise
        (0.003, 1.1, "tactical-grade"),  # Groves (2013), Table 4.1: from 1 deg/h on
        (0.012, 0.3, "tactical-grade"),  # of good tactical units
    ],
)
def test_a_quiet_unit_whose_rest_shows_no_bias_is_better_than_tactical(noise, bias, grade):
    quiet = scatter(np.radians(noise) / 60.0, 50.0 / MICRO_G)
    found = sensors(None, quiet, None if bias is None else bias / DEG_PER_HOUR)
    assert found["sensor"] == grade


def test_noise_beyond_the_data_sheet_is_stated_for_a_named_sensor_too():
    # The HG9900 has accelerometers of 10 µg/√Hz and gyros of 0.002 deg/√h.
    gyro = np.radians(0.001) / 60.0
    found = sensors("hg9900", scatter(gyro, 48.0 / MICRO_G), None)
    assert "gyro" not in found
    assert found["accel"]["noise_density_ug_per_sqrt_hz"] == (48.0, 48.0, 48.0)


def test_a_named_unit_may_lie_outside_of_its_type_and_a_grade_has_no_type():
    quiet = scatter(1e-6, 1e-4)
    assert sensors("bmi160", quiet, None)["unit_factor"] == round(UNIT_FACTOR, 2)
    assert sensors("bmi160", None, None)["unit_factor"] == round(UNIT_FACTOR, 2)
    assert "unit_factor" not in sensors(None, quiet, None)


def test_the_industrial_grade_is_as_wide_as_the_units_it_stands_for():
    units = ("adis16448", "adis16470", "adis16505-1", "xsens-mti-1")
    own = ImuUncertainty.of_sensor(load_sensor("industrial-grade"))
    known = [ImuUncertainty.of_sensor(load_sensor(name)) for name in units]
    for triad, name in (("gyro", "misalignment"), ("accel", "misalignment"), ("accel", "bias")):
        sds = [getattr(one, triad).axis(name) for one in known]
        # As stated: two digits.
        stated = max(getattr(own, triad).axis(name))
        assert stated == pytest.approx(np.sqrt(np.mean(np.square(sds))), rel=0.05)


def test_the_intermediate_grade_is_aligned_as_the_navigation_units_are():
    own = ImuUncertainty.of_sensor(load_sensor("intermediate-grade"))
    known = [ImuUncertainty.of_sensor(load_sensor(name)) for name in ("fog-1000", "hg9900")]
    for triad in ("gyro", "accel"):
        sds = [getattr(one, triad).axis("misalignment") for one in known]
        # As stated: two digits.
        stated = max(getattr(own, triad).axis("misalignment"))
        assert stated == pytest.approx(np.sqrt(np.mean(np.square(sds))), rel=0.02)


@pytest.mark.parametrize(
    ("named", "gyro"), [("bmi160", 180.0), ("adis16470", 54.0), ("stim300", None), ("hg9900", None)]
)
def test_units_of_cheap_grades_are_taken_to_warm_up(named, gyro):
    for quiet in (scatter(1e-6, 1e-4), None):
        found = sensors(named, quiet, None).get("warming", {})
        assert found.get("gyro_sd_deg_per_h") == gyro
        assert (found.get("accel_sd_ug", 0.0) > 0.0) == (gyro is not None)


def test_gyros_whose_rest_shows_that_they_find_north_are_warm():
    loud = scatter(np.radians(0.1) / 60.0, 1e-4)
    assert "warming" in sensors(None, loud, None)
    assert "warming" not in sensors(None, loud, 1.0 / DEG_PER_HOUR)


def test_shaking_is_stated_but_for_gyros_that_find_north():
    gyro, accel, shaken = 0.5 * TACTICAL_NOISE, 60.0 / MICRO_G, 2.0 * LOUD
    key = "noise_density_ug_per_sqrt_hz"
    found = sensors(None, scatter(gyro, accel, shaken), None)
    assert found["accel"][key][0] == pytest.approx(60.0 * shaken)
    quiet = sensors(None, scatter(gyro, accel, shaken), 1.0 / DEG_PER_HOUR)
    assert quiet["accel"][key][0] == pytest.approx(60.0)
    assert quiet["gyro"]["bias_sd_deg_per_h"] == pytest.approx(1.0)


def test_of_vibration_only_what_is_white_is_noise_and_gyros_drift_by_the_rest():
    """A line of 31 Hz, 30 times the noise, was taken as white."""
    draws, rate, count = np.random.default_rng(20261201), 100.0, 20000
    time, white = np.arange(count) / rate, np.array([0.05, 0.1])  # deg/s, m/s²
    line = np.sqrt(2.0) * np.sin(2.0 * np.pi * 31.0 * time)[:, None]
    loud = (time > 20.0)[:, None]
    gyro, accel = (
        size * (draws.normal(size=(count, 3)) + 30.0 * loud * line)
        for size in np.array([np.radians(white[0]), white[1]])
    )
    values = np.hstack([gyro, accel - [0.0, 0.0, 9.8]])
    imu = pd.DataFrame(values, pd.Index(time, name="time"), [*GYRO, *ACCEL])
    found = _scatter(imu)
    density = np.array([np.radians(white[0]), white[1]]) / np.sqrt(rate)
    # Its second differences are 2 (1 - cos(2 pi 31 / 100)) = 2.74 times the line, of 6; a tenth of
    # the record is quiet, a twentieth is left out.
    times = 30.0 * 2.74 / np.sqrt(6.0) * np.sqrt(0.85 / 0.95)
    assert found.loud / density[:, None] == pytest.approx(times, rel=0.02)
    # Means of eight samples leave 0.012 of it; their second differences at most four times that.
    assert (found.white < 1.7 * density[:, None]).all()
    stated, shaken = _sensors(None, found, None)
    assert shaken == ("gyro", "accel")
    # A drift is stated by the least of its Allan deviation, 0.617 of the standard deviation.
    rms = times * white[0]
    drift = stated["gyro"]["bias_instability_deg_per_h"]
    assert drift == pytest.approx(3 * [0.617 * RECTIFIED * rms * 3600.0], rel=0.05)
    # The drift of the grade is a walk: 30 deg/h over 300 s.
    walk = 30.0 / 0.617 * np.sqrt(2.0 / 300.0) * 60.0
    assert stated["gyro"]["random_walk_deg_per_h_per_sqrt_h"] == pytest.approx(3 * [walk], rel=0.05)


def test_a_named_sensor_that_shakes_as_its_data_sheet_allows_drifts_all_the_same():
    """What may be white is below the data sheet: there was no table to state the drift in."""
    quiet = np.full((2, 3), 1e-6)
    stated, shaken = _sensors("mpu-6050", Scatter(quiet, np.ones((2, 3)), quiet, quiet), None)
    assert "gyro" in shaken
    assert "noise_density_deg_per_sqrt_h" not in stated["gyro"]
    assert stated["gyro"]["correlation_time_s"] > 0.0


@pytest.mark.parametrize("rate", [100.0, 200.0, 1000.0])
def test_vibration_is_the_same_at_any_rate_and_without_a_rest(rate):
    """By samples alone 20 Hz of a log at 1 kHz were none; by its quietest part, nor was a drone."""
    draws, count = np.random.default_rng(20261203), int(60 * rate)
    time = np.arange(count) / rate
    line = np.sqrt(2.0) * np.sin(2.0 * np.pi * 20.0 * time)[:, None]
    noise = np.repeat([1e-4, 1e-2], 3) * np.sqrt(rate) * draws.normal(size=(count, 6))
    found = _scatter(pd.DataFrame(noise + line, pd.Index(time), [*GYRO, *ACCEL]))
    assert _sensors(None, found, None)[1] == ("gyro", "accel")
    # Second differences of means over 10 ms or 16 ms: 0.4 to 1.3 of a line of 20 Hz.
    assert ((found.shaking > 0.4) & (found.shaking < 1.3)).all()
    assert (found.quiet <= found.white).all()
    # Means over 0.128 s leave 0.122 of it, their second differences at most 1.63 of that, and the
    # root of 0.128 s makes a density of 0.071; those of 16 ms one of 0.124.
    assert (found.white < 0.6 * found.loud).all()


def test_a_record_that_rests_most_of_the_time_has_the_noise_of_its_drive():
    """The median was that of the rest, and a drive after it ran without its vibration."""
    draws, count = np.random.default_rng(20261202), 20000
    size = np.where(np.arange(count) < 0.7 * count, 1.0, 20.0)[:, None]
    values = size * draws.normal(size=(count, 6)) * np.repeat([1e-3, 1e-1], 3)
    found = _scatter(pd.DataFrame(values, pd.Index(0.01 * np.arange(count)), [*GYRO, *ACCEL]))
    # A twentieth is left out, of the loud 0.3: 0.25 of 0.95.
    expected = np.sqrt((0.7 + 0.25 * 20.0**2) / 0.95) * np.array([1e-4, 1e-2])
    assert found.loud == pytest.approx(np.outer(expected, np.ones(3)), rel=0.05)
    assert found.white == pytest.approx(found.loud, rel=0.2)  # 300 loud means
    assert found.quiet == pytest.approx(np.outer([1e-4, 1e-2], np.ones(3)), rel=0.15)
    assert _sensors(None, found, None)[1] == ("gyro", "accel")


def test_a_rest_bounds_the_gyro_biases_as_often_as_it_says():
    """The factor is the 95 % bound of the standard deviation by two components."""
    sd, held = 1.0 / DEG_PER_HOUR, 0
    draws = np.random.default_rng(20261123)
    count = 200
    for _ in range(count):
        roll, pitch, heading = draws.uniform([-5.0, -5.0, 0.0], [5.0, 5.0, 360.0])
        motion = StationaryMotion(120.0, Origin(*PLACE), roll, pitch, heading)
        errors = ImuErrors(
            TriadErrors(bias=tuple(draws.normal(0.0, sd, 3))), TriadErrors(bias=1e-4)
        )
        imu, _ = simulate_imu(motion, errors, rate=5.0, sampling="mean")
        found = _rest_bias(imu, 120.0, PLACE, None)
        held += found >= sd
    low, high = stats.binomtest(held, count).proportion_ci(0.99)
    assert low <= 0.95 <= high, held


def test_a_short_rest_bounds_nothing():
    imu = pd.DataFrame(np.zeros((3, 6)), index=[0.0, 30.0, 59.0], columns=[*GYRO, *ACCEL])
    assert _rest_bias(imu, 59.0, PLACE, None) is None


def quiet_drive(folder, seed, shaken=0.0, turns=6):
    """A drive after a rest of 70 s: noise of a navigation unit, slow errors of a tactical one.

    `shaken` (m/s² and deg/s): a vibration of 20 Hz, of which a mean leaves nothing.
    """
    legs = [("rest", Straight(70.0))]
    for k in range(turns):
        legs += [
            (f"{k} faster", Accelerate(14.0, 6.0)),
            (f"{k} on", Straight(10.0)),
            (f"{k} bend", Turn(90.0 if k % 3 else -120.0, 25.0, ramp=2.0)),
            (f"{k} stop", Stop(6.0)),
        ]
    motion = car(Origin(*PLACE), legs, speed=0.0)
    draws = np.random.default_rng(seed)
    errors = ImuErrors(
        TriadErrors(
            noise_density=np.radians(0.003) / 60.0,
            bias=tuple(draws.normal(0.0, 0.03 / DEG_PER_HOUR, 3)),
            scale=tuple(draws.normal(0.0, 500e-6, 3)),
        ),
        TriadErrors(
            noise_density=50.0 / MICRO_G,
            bias=tuple(draws.normal(0.0, 300.0 / MICRO_G, 3)),
            scale=tuple(draws.normal(0.0, 500e-6, 3)),
        ),
    )
    imu, _ = simulate_imu(motion, errors, rate=50.0, sampling="mean", seed=seed)
    wave = np.sin(2.0 * np.pi * 20.3 * imu.index.to_numpy())[:, None]
    imu[[*GYRO, *ACCEL]] += shaken * wave * np.repeat([np.radians(1.0), 1.0], 3)
    fixes = simulate_gnss(motion, GnssReceiver(**RECEIVER), seed=seed)
    names = [*(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]
    log = imu[[*GYRO, *ACCEL]].set_axis(names, axis=1).rename_axis("time_s")
    (folder / "log.csv").write_text("# sampling: mean\n" + log.to_csv())
    fixes.to_csv(folder / "fixes.csv")
    return motion, propose(
        LogTable(path=str(folder / "log.csv")),
        axes="forward-right-down",
        gnss=FixesTable(path=str(folder / "fixes.csv")),
    )


def test_a_rest_that_vibration_keeps_from_north_is_not_proposed(tmp_path):
    """The bias is that of a navigation unit, so that north was proposed, and the run refused it."""
    _, made = quiet_drive(tmp_path, 1, shaken=0.4, turns=2)
    assert made.table["sensors"]["gyro"]["bias_sd_deg_per_h"] < 2.0
    assert made.table["coarse"]["kind"] == "gnss_course"
    assert "alignment.no-north" in {one.code for one in made.findings}


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_quiet_sensors_with_large_slow_errors_follow_their_fixes(tmp_path, seed):
    """Noise as that of a navigation unit, biases and scale factors of a tactical one.

    The nearest sensor of the catalogue by noise was taken: one of 10 µg/√Hz, 25 µg and 100 ppm for
    one of 50 µg/√Hz, 300 µg and 500 ppm. With a receiver good to 1 cm the height ran away.
    """
    motion, made = quiet_drive(tmp_path, seed)
    run = run_navigation(NavigationSpec.checked({"name": "drive", **made.table}))
    found = run.trajectory
    later = found[found.index > found.index[-1] - 60.0]
    truth = motion.trajectory(later.index.to_numpy())[GEODETIC].to_numpy()
    off = place_difference(later[GEODETIC].to_numpy(), truth)
    sd = run.sd[["north", "east", "down"]].reindex(later.index, method="nearest").to_numpy()
    # 1 cm of the fixes, and 2 ms between the clocks at 14 m/s.
    assert np.median(sd) < 0.03
    assert (np.abs(off) < 1.96 * sd).mean() > 0.9


def test_without_a_rest_the_turns_of_a_record_bound_the_biases_of_a_named_unit(tmp_path):
    """20 deg/s by its data sheet: the heading of a walk would be open within seconds."""
    time = np.arange(0.0, 120.0, 0.02)
    rng = np.random.default_rng(1)
    gyro = np.radians(rng.normal(0.0, 20.0, (len(time), 3)))
    accel = np.array([0.0, 0.0, 9.8]) + rng.normal(0.0, 2.0, (len(time), 3))
    for rest, stated in ((0.0, True), (30.0, False)):
        still = time < rest
        gyro[still], accel[still] = 1e-4, [0.0, 0.0, 9.8]
        gyro[still] += 1e-4 * rng.normal(size=(still.sum(), 3))
        accel[still] += 1e-3 * rng.normal(size=(still.sum(), 3))
        names = [*(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]
        table = pd.DataFrame(np.hstack([gyro, accel]), pd.Index(time, name="time_s"), names)
        (tmp_path / "log.csv").write_text("# sampling: instantaneous\n" + table.to_csv())
        log = LogTable(path=str(tmp_path / "log.csv"))
        made = propose(log, axes="forward-right-down", sensor="mpu-6050")
        own = made.table["sensors"].get("gyro", {})
        assert ("bias_sd_deg_per_h" in own) == stated
        if stated:
            assert own["bias_sd_deg_per_h"] / 3600.0 == pytest.approx(3.0, rel=0.1)
