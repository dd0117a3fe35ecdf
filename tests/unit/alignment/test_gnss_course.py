"""Alignment of a vehicle that drives."""

from __future__ import annotations

import functools
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom, chi2
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parent))

from stands import ORIGIN, SITE, chi_square, ideal, phi, still, unit

from strapdown import rotation
from strapdown.alignment.course_sums import ARM, END_VELOCITY, OF_SENSORS, TURN, Antenna
from strapdown.alignment.gnss_course import SMALL, GnssCourse, _excess, _root_of_inverse
from strapdown.errors import ConfigError, DataError
from strapdown.frames import ned_from_geodetic
from strapdown.navigation.navigator import Warming
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.simulation.motion import Track
from strapdown.simulation.path_motion import PathMotion
from strapdown.tables import ACCEL, GEODETIC, GYRO, POSITION_SD, VELOCITY, VELOCITY_SD

# Speeds up, brakes, turns both ways, climbs; leans on its springs.
DRIVE = PathMotion(
    60.0,
    ORIGIN,
    heading_deg=30.0,
    speed=Track((0.0, 20.0, 30.0, 50.0, 58.0), (12.0, 18.0, 10.0, 16.0, 8.0)),
    turn_rate=Track((0.0, 10.0, 20.0, 35.0, 50.0, 55.0), (0.0, 8.0, -5.0, 6.0, 3.0, 5.0)),
    climb=Track((0.0, 30.0, 60.0), (0.0, 3.0, -2.0)),
    roll_deg=1.5,
    sway_roll=0.5,
    sway_pitch=0.3,
)
NO_SLIP = GnssCourse(mounting_yaw_sd_deg=0.0, sideslip_sd_deg=0.001, axle_sd=0.0)
RUNS, SIXTY = 12, 60


def fixes(seed=0, motion=DRIVE, noise=0.05, rate=5.0, place_noise=1.0):
    receiver = GnssReceiver(rate=rate, velocity_noise=noise, position_noise=place_noise)
    return simulate_gnss(motion, receiver, seed=seed, source="gnss.csv")


@pytest.mark.slow
def test_without_errors():
    imu, truth = ideal(DRIVE, 100.0)
    exact = simulate_gnss(DRIVE, GnssReceiver(rate=10.0, velocity_noise=1e-5, position_noise=0.01))
    none = ImuUncertainty(TriadUncertainty(bias=1e-9), TriadUncertainty(bias=1e-9))
    for end in (1001, 2501, 6001):
        found = GnssCourse().align(imu.iloc[:end], SITE, none, exact)
        # Between fixes 0.1 s apart the velocity is taken for a line: a jerk of 3 m/s³ leaves
        # 4 mm/s at a sample between two, over a window of 10 s and more 4e-4 m/s², 4e-5 rad;
        # of the course 4 mm/s over 8 m/s.
        error = np.abs(phi(found, truth[end - 1]))
        assert error[:2].max() < 1e-4
        assert error[2] < 5e-4


@pytest.mark.slow
@pytest.mark.parametrize("sensor", ["fog-1000", "icm-42688-p", "adis16495-1"])
def test_units_in_a_drive(sensor):
    found = []
    for seed in range(RUNS):
        imu, truth, sensors = unit(DRIVE, 100.0, seed, sensor)
        end = (2501, 4001, 6001)[seed % 3]
        result = NO_SLIP.align(imu.iloc[:end], SITE, sensors, fixes(seed))
        assert not result.findings
        found.append(chi_square(result, truth[end - 1]))
    assert max(found) < chi2.isf(1e-6, 3)
    low, high = chi2.isf([1 - 1e-4, 1e-4], 3 * RUNS)
    assert low < sum(found) < high


def test_the_sd_of_a_course_falls_with_the_speed():
    sensors = unit(DRIVE, 100.0, 0)[2]
    sd = []
    for speed in (5.0, 20.0):
        motion = PathMotion(10.0, ORIGIN, heading_deg=30.0, speed=Track((0.0,), (speed,)))
        imu, _ = ideal(motion, 100.0)
        found = NO_SLIP.align(imu, SITE, sensors, fixes(0, motion))
        sd.append(np.sqrt(found.covariance[2, 2]))
    # 51 fixes of 0.05 m/s of a velocity and its change, which a level known to the noise of the
    # fixes leaves open: at least as a mean, and at most as the end of a line, twice that.
    mean = 0.05 / 5.0 / np.sqrt(51.0)
    assert 0.95 * mean < sd[0] < 2.0 * mean
    assert sd[0] / sd[1] == pytest.approx(4.0, rel=0.05)


def test_a_mounting_and_its_uncertainty():
    motion = PathMotion(10.0, ORIGIN, heading_deg=30.0, speed=Track((0.0,), (20.0,)))
    imu, truth = ideal(motion, 100.0)
    sensors = unit(DRIVE, 100.0, 0)[2]
    plain = NO_SLIP.align(imu, SITE, sensors, fixes(0, motion))
    turned = GnssCourse(mounting_yaw_deg=5.0, mounting_yaw_sd_deg=0.5, sideslip_sd_deg=1.2)
    other = turned.align(imu, SITE, sensors, fixes(0, motion))
    # Nothing but the course tells of the heading where the speed stays.
    assert (other.roll_pitch_heading - plain.roll_pitch_heading)[2] == pytest.approx(5.0, abs=0.05)
    # 1.3 deg that stay; of the 0.6 deg that change each second eleven are a mean.
    assert other.sd_deg[2] == pytest.approx(np.hypot(1.3, 0.6 / np.sqrt(11.0)), rel=0.01)
    assert abs(phi(plain, truth[-1])[2]) < np.radians(0.1)


def test_accelerations_tell_of_a_mounting_that_is_not_as_stated():
    imu, truth = ideal(DRIVE, 100.0)
    sensors = unit(DRIVE, 100.0, 0)[2]
    turned = GnssCourse(mounting_yaw_deg=2.0, sideslip_sd_deg=1.0)
    found = turned.align(imu, SITE, sensors, fixes())
    # Gyros and accelerometers of a fog-1000 know the heading to some 0.02 deg of their own.
    assert abs(phi(found, truth[-1])[2]) < np.radians(0.1)
    assert found.sd_deg[2] < 0.05


@pytest.mark.slow
def test_a_mounting_that_is_not_stated_is_within_the_bound_of_the_heading():
    """4 and -5 deg off: where speed and course stay, the prior; else what the sensors tell."""
    straight = PathMotion(20.0, ORIGIN, heading_deg=30.0, speed=Track((0.0,), (20.0,)))
    for motion, low, high in ((straight, 4.5, 6.0), (DRIVE, 0.0, 1.5)):
        inside = []
        for seed, off in enumerate((4.0, -5.0, 4.0, -5.0)):
            imu, truth, sensors = unit(motion, 100.0, seed, "icm-42688-p")
            c, s = np.cos(np.radians(off)), np.sin(np.radians(off))
            turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
            turned = imu.copy()
            turned.attrs = dict(imu.attrs)
            for names in (GYRO, ACCEL):
                turned[names] = imu[names].to_numpy() @ turn
            q = rotation.compose(truth[-1], rotation.quaternion_from_dcm(turn))
            found = GnssCourse().align(turned, SITE, sensors, fixes(seed, motion))
            sd = np.sqrt(found.covariance[2, 2])
            assert low < np.degrees(sd) < high
            inside.append(abs(phi(found, q)[2]) / sd)
        # None beyond 2.6 standard deviations, which one of a hundred exceeds.
        assert max(inside) < 2.6


def test_reverse():
    imu, _ = ideal(DRIVE, 100.0)
    sensors = unit(DRIVE, 100.0, 0)[2]
    assert not GnssCourse().align(imu, SITE, sensors, fixes()).findings
    with pytest.raises(
        DataError, check=coded("alignment.drives-other-way", quantity="heading", file="log.csv")
    ):
        GnssCourse(reverse=True).align(imu, SITE, sensors, fixes())


def with_outliers(table, share, seed):
    """Velocities gone wrong by up to 30 m/s, one at least of the last five."""
    rng = np.random.default_rng(seed)
    out = table.copy()
    out.attrs = dict(table.attrs)
    wrong = rng.random(len(out)) < share
    wrong[-3] = True
    wrong[-2:] = False
    out.loc[wrong, VELOCITY] += rng.uniform(-30.0, 30.0, (int(wrong.sum()), 3))
    return out, int(wrong.sum())


@pytest.mark.slow
def test_ten_percent_of_outliers():
    found, plain = [], []
    for seed in range(8):
        imu, truth, sensors = unit(DRIVE, 100.0, seed, "icm-42688-p")
        good = fixes(seed)[lambda table: table.index <= 40.0]
        good.attrs = dict(fixes(seed).attrs)
        bad, count = with_outliers(good, 0.1, seed)
        result = NO_SLIP.align(imu.iloc[:4001], SITE, sensors, bad)
        (finding,) = result.findings
        # One of a few m/s in each axis may pass for a weak fix.
        assert abs(int(finding.what.split()[0]) - count) <= 3
        found.append(chi_square(result, truth[4000]))
        plain.append(
            np.sqrt(np.trace(NO_SLIP.align(imu.iloc[:4001], SITE, sensors, good).covariance))
        )
        # A tenth of the fixes is worth 5 % of an error.
        assert np.sqrt(np.trace(result.covariance)) < 1.2 * plain[-1]
    low, high = chi2.isf([1 - 1e-4, 1e-4], 3 * len(found))
    assert low < sum(found) < high


def park_and_go(rest):
    return PathMotion(
        rest + 12.0,
        ORIGIN,
        heading_deg=70.0,
        speed=Track((0.0, rest, rest + 6.0), (0.0, 0.0, 9.0)),
        turn_rate=Track((0.0, rest + 6.0, rest + 9.0), (0.0, 0.0, 12.0)),
        roll_deg=1.5,
    )


@pytest.mark.slow
@pytest.mark.parametrize("rest", [20.0, 2.0])
def test_a_rest_before_tells_the_bias_of_the_gyros(rest):
    motion = park_and_go(rest)
    squares, biases, known = [], [], []
    for seed in range(8):
        imu, truth, sensors = unit(motion, 100.0, seed, "mpu-6050")
        end = int((rest + 8.0) * 100.0)
        way = GnssCourse(axle_sd=0.0)
        result = way.align(imu.iloc[: end + 1], SITE, sensors, fixes(seed, motion))
        squares.append(chi_square(result, truth[end]))
        drawn = load_sensor("mpu-6050").draw(seed).gyro
        read = ideal(motion, 100.0)[0].iloc[: end + 1].to_numpy().mean(axis=0)
        by_rate = np.diag(drawn.scale) + np.array(drawn.misalignment)
        true = np.array(drawn.bias) + by_rate @ read[:3]
        true += np.array(drawn.g_sensitivity) @ read[3:]
        drawn_too = (imu.iloc[: end + 1].to_numpy().mean(axis=0) - read)[:3]
        # With the drift of this record, 30 deg/h, which the mean of what is read shows.
        np.testing.assert_allclose(drawn_too, true, atol=np.radians(0.05))
        biases.append(result.gyro_bias - drawn_too)
        known.append(result.gyro_bias_sd)
    # 0.05 deg/s a sample of 100 Hz, and a drift of 0.01 deg/s: a thousandth of what is stated.
    assert np.degrees(np.median(known)) < (0.1 if rest == 20.0 else 0.5)
    chi = float(np.sum(np.square(biases) / np.square(known)))
    assert chi < chi2.isf(1e-4, 3 * len(squares))
    assert sum(squares) < chi2.isf(1e-4, 3 * len(squares))


@pytest.mark.slow
def test_without_a_rest_an_attitude_is_worth_what_the_bias_leaves():
    motion = PathMotion(6.0, ORIGIN, heading_deg=70.0, speed=Track((0.0, 6.0), (12.0, 15.0)))
    squares = []
    for seed in range(12):
        imu, truth, sensors = unit(motion, 100.0, seed, "mpu-6050")
        end = (151, 201, 301, 401)[seed % 4]
        result = GnssCourse().align(imu.iloc[:end], SITE, sensors, fixes(seed, motion))
        squares.append(chi_square(result, truth[end - 1]))
        later, now = result.sd_deg_after(3.0), result.sd_deg
        grown = np.degrees(3.0 * result.gyro_bias_sd)
        # The attitude goes on with its bias: no more than the sum of both, no less than the
        # difference.
        assert (later < 1.01 * (now + grown.max())).all()
        assert later.max() > 0.99 * (grown.min() - now.max())
    assert sum(squares) < chi2.isf(1e-4, 3 * len(squares))


def test_positions_alone_with_an_outage_at_the_end():
    # Bias unknown to 3 deg/s: the first part is three baselines long, and no fix is within it.
    imu, truth, sensors = unit(DRIVE, 100.0, 0, "icm-42688-p")
    vague = replace(sensors, gyro=replace(sensors.gyro, bias=3.0))
    before = alone(fixes(rate=5.0, place_noise=0.02)).loc[:30.0]
    result = GnssCourse().align(imu.iloc[:4001], SITE, vague, before)
    assert chi_square(result, truth[4000]) < chi2.isf(1e-6, 3)


def test_what_it_refuses():
    imu, _ = ideal(DRIVE, 100.0)
    sensors = unit(DRIVE, 100.0, 0)[2]
    with pytest.raises(
        DataError, check=coded("alignment.no-fixes-for-course", quantity="gnss", file="log.csv")
    ):
        GnssCourse().align(imu, SITE, sensors)
    with pytest.raises(
        DataError, match=r"gnss.csv, VN, VE: fixes between 0 and 0.19 s of the inertial record: 1"
    ):
        GnssCourse().align(imu.iloc[:20], SITE, sensors, fixes())
    other_clock = fixes()
    other_clock.index = other_clock.index + 1e6
    with pytest.raises(DataError, match=r"(?s)inertial record: 0;.*both clocks"):
        GnssCourse().align(imu, SITE, sensors, other_clock)
    unmeasured = fixes()
    unmeasured[[*POSITION_SD, *VELOCITY_SD]] = np.inf
    with pytest.raises(DataError, match=r"(?s)standard deviation: 0; two.*measures velocity"):
        GnssCourse().align(imu, SITE, sensors, unmeasured)
    with pytest.raises(DataError, match=r"(?s)gnss.csv, row 301, VN, VE: .* m/s at 60 s.*at least"):
        GnssCourse(least_speed=9.0).align(imu, SITE, sensors, fixes())
    with pytest.raises(DataError, match=r"(?s)the course standard deviation.*10 deg are needed"):
        GnssCourse().align(imu, SITE, sensors, fixes(noise=2.0))
    rest, _ = ideal(still(20.0), 50.0)
    with pytest.raises(DataError, match=r"the speed is 0\.\d+ m/s"):
        GnssCourse().align(rest, SITE, sensors, fixes(motion=still(20.0)))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("mounting_yaw_deg", np.inf),
        ("mounting_yaw_sd_deg", -1.0),
        ("sideslip_sd_deg", np.nan),
        ("least_speed", -1.0),
        ("largest_sd_deg", "a"),
        ("axle_sd", -1.0),
    ],
)
def test_options_out_of_range(name, value):
    with pytest.raises(ConfigError, match=name):
        GnssCourse(**{name: value})


def test_places_need_no_precision():
    imu, truth = ideal(DRIVE, 100.0)
    sensors = unit(DRIVE, 100.0, 0)[2]
    placeless = fixes()
    placeless[POSITION_SD] = np.inf
    found = GnssCourse().align(imu, SITE, sensors, placeless)
    assert chi_square(found, truth[-1]) < chi2.isf(1e-6, 3)


@functools.cache
def true_states():
    truth = DRIVE.trajectory(ideal(DRIVE, 100.0)[0].index.to_numpy())
    return truth[[*GEODETIC, *VELOCITY]].to_numpy()


def true_state(row):
    """Latitude, longitude, height and velocity of the drive."""
    return true_states()[row]


def alone(table):
    """Positions of the fixes without their velocities."""
    out = table.copy()
    out.attrs = dict(table.attrs)
    out[VELOCITY], out[VELOCITY_SD] = 0.0, np.inf
    return out


@pytest.mark.slow
def test_positions_alone_without_errors():
    imu, truth = ideal(DRIVE, 100.0)
    arm = (0.5, -0.3, -1.2)
    receiver = GnssReceiver(rate=10.0, antenna=arm, position_noise=1e-4)
    exact = alone(simulate_gnss(DRIVE, receiver))
    none = ImuUncertainty(TriadUncertainty(bias=1e-9), TriadUncertainty(bias=1e-9))
    for end in (1001, 2501, 6001):
        found = GnssCourse().align(imu.iloc[:end], SITE, none, exact, Antenna(lever_arm=arm))
        # As of velocities; the integral over a window is closer still.
        error = np.abs(phi(found, truth[end - 1]))
        assert error[:2].max() < 1e-5
        assert error[2] < 5e-5
        sd = np.sqrt(np.diagonal(found.joint)[39:])
        off = ned_from_geodetic(found.place, true_state(end - 1)[:3])
        # Gravity is that of the site: 15 m higher it is 5e-5 m/s² less, over 60 s by t²/8.
        assert (np.abs(off) < 5.0 * sd + 0.025).all()


@pytest.mark.slow
def test_positions_alone_are_worth_what_is_stated():
    """Heading, tilt, velocity and position of 102 units: inside 1.96 sd as often as 95 % allow."""
    inside, squares = [], []
    cases = (("icm-42688-p", 1.0, 1.0), ("adis16495-1", 0.02, 1.0), ("mpu-6050", 2.0, 5.0))
    for seed in range(102):
        sensor, noise, rate = cases[seed % 3]
        imu, truth, sensors = unit(DRIVE, 100.0, seed, sensor)
        end = (3001, 4001, 5001)[seed % 3]
        table = alone(fixes(seed, rate=rate, place_noise=noise))
        found = NO_SLIP.align(imu.iloc[:end], SITE, sensors, table)
        error = phi(found, truth[end - 1])
        squares.append(chi_square(found, truth[end - 1]))
        state = true_state(end - 1)
        off = np.concatenate(
            [ned_from_geodetic(found.place, state[:3]), found.velocity - state[3:]]
        )
        sd = np.sqrt(np.diagonal(found.joint))
        share = np.abs(np.concatenate([error, off])) / np.r_[sd[3:6], sd[39:], sd[:3]]
        inside.append(share < 1.96)
    low, high = binom.interval(0.99, len(inside), 0.95)
    count = np.sum(inside, axis=0)
    assert (low <= count).all() and (count <= high).all(), count
    low, high = chi2.isf([0.995, 0.005], 3 * len(squares))
    assert low < sum(squares) < high


def whole_error(found, row):
    """Errors of position, velocity and attitude, (9,), and their covariance."""
    truth, state = ideal(DRIVE, 100.0)[1][row], true_state(row)
    place = ned_from_geodetic(found.place, state[:3])
    error = np.concatenate([place, found.velocity - state[3:], phi(found, truth)])
    rows = np.r_[39:42, 0:6]
    return error, found.joint[np.ix_(rows, rows)]


def nees(pairs):
    return [float(error @ np.linalg.solve(P, error)) for error, P in pairs]


@pytest.mark.slow
def test_errors_of_position_and_velocity_are_correlated_as_stated():
    """By positions alone a velocity that is too large has moved the position too far."""
    found = []
    for seed in range(RUNS):
        imu, _, sensors = unit(DRIVE, 100.0, seed, "icm-42688-p")
        result = NO_SLIP.align(imu.iloc[:4001], SITE, sensors, alone(fixes(seed)))
        found.append(whole_error(result, 4000))
    low, high = chi2.isf([0.995, 0.005], 9 * RUNS)
    assert low < sum(nees(found)) < high


@pytest.mark.parametrize("positions", [False, True])
def test_the_first_sample_without_errors(positions):
    imu, _ = ideal(DRIVE, 100.0)
    arm = (0.5, -0.3, -1.2)
    receiver = GnssReceiver(rate=10.0, antenna=arm, velocity_noise=1e-5, position_noise=1e-4)
    exact = simulate_gnss(DRIVE, receiver)
    exact = alone(exact) if positions else exact
    # The first fix is 3 s later.
    exact = exact[exact.index >= 3.0]
    none = ImuUncertainty(TriadUncertainty(bias=1e-9), TriadUncertainty(bias=1e-9))
    way = GnssCourse(backtrack=True)
    found = way.align(imu.iloc[:2001], SITE, none, exact, Antenna(lever_arm=arm)).earlier
    assert found.time == imu.index[0]
    error, _ = whole_error(found, 0)
    # As at the end (see above): tilts of 1e-4 rad, over 3 s a velocity of 3 mm/s and 5 mm.
    assert np.abs(error[:3]).max() < 0.02
    assert np.abs(error[3:6]).max() < 0.01
    assert np.abs(error[6:8]).max() < 1e-4
    assert abs(error[8]) < 5e-4


@pytest.mark.slow
@pytest.mark.parametrize("positions", [False, True])
def test_errors_at_the_first_sample_are_as_stated(positions, monkeypatch):
    """With the whole weight of the fixes; a filter that meets them again gets a tenth of it."""
    way = GnssCourse(mounting_yaw_sd_deg=0.0, sideslip_sd_deg=0.001, axle_sd=0.0, backtrack=True)
    found, least = [], []
    for seed in range(RUNS):
        imu, _, sensors = unit(DRIVE, 100.0, seed, "icm-42688-p")
        table = fixes(seed)
        table = alone(table) if positions else table
        table = table[table.index >= 3.0]
        least.append(whole_error(way.align(imu.iloc[:4001], SITE, sensors, table).earlier, 0))
        with monkeypatch.context() as patched:
            patched.setattr("strapdown.alignment.gnss_course.ONCE", 1.0)
            once = way.align(imu.iloc[:4001], SITE, sensors, table).earlier
        found.append(whole_error(once, 0))
    low, high = chi2.isf([0.995, 0.005], 9 * RUNS)
    assert low < sum(nees(found)) < high
    assert 0.1 * low < sum(nees(least)) < high


@pytest.mark.slow
@pytest.mark.parametrize("times", [1.0, 4.0])
def test_tilts_of_units_far_outside_their_data_sheet_are_as_stated(times):
    """Biases of the accelerometers by so many of the stated sd: one that shows widens the others.

    Of 60 drives as many have their tilt within 95 % as 99 % of sixties of such a chance do.
    """
    inside = 0
    for seed in range(SIXTY):
        imu, truth, sensors = unit(DRIVE, 50.0, seed, "icm-20602")
        more = np.random.default_rng(seed).normal(size=3) * np.sqrt(times**2 - 1.0)
        beyond = imu.copy()
        beyond.attrs = dict(imu.attrs)
        beyond[ACCEL] = imu[ACCEL].to_numpy() + more * sensors.accel.axis("bias")
        found = NO_SLIP.align(beyond, SITE, sensors, fixes(seed, noise=0.1, rate=1.0))
        error = phi(found, truth[-1])[:2]
        square = error @ np.linalg.solve(found.covariance[:2, :2], error)
        inside += square < chi2.isf(0.05, 2)
    low, high = binom.ppf([0.005, 0.995], SIXTY, 0.95)
    assert low <= inside <= high


@pytest.mark.slow
def test_attitudes_of_units_that_warm_up_are_as_stated():
    """Gyros drift by 0.1 deg/s until they are warm: at both ends of 60 drives, as above."""
    warming = Warming(np.radians(0.1), 0.02, 60.0)
    way = replace(NO_SLIP, backtrack=True)
    inside = np.zeros(2, dtype=int)
    for seed in range(SIXTY):
        imu, truth, sensors = unit(DRIVE, 50.0, seed, "icm-20602")
        warm = 1.0 - np.exp(-imu.index.to_numpy() / 60.0)
        change = np.random.default_rng(seed).normal(size=(2, 3))
        warmed = imu.copy()
        warmed.attrs = dict(imu.attrs)
        for names, of, size in ((GYRO, 0, warming.gyro), (ACCEL, 1, warming.accel)):
            warmed[names] = imu[names].to_numpy() + size * warm[:, None] * change[of]
        known = warming.within(sensors, 0.0, float(imu.index[-1]))
        found = way.align(warmed, SITE, known, fixes(seed, noise=0.1, rate=1.0))
        for k, (one, at) in enumerate(((found, -1), (found.earlier, 0))):
            inside[k] += chi_square(one, truth[at]) < chi2.isf(0.05, 3)
    low, high = binom.ppf([0.005, 0.995], SIXTY, 0.95)
    assert (inside >= low).all()
    # At the first sample a tenth of the weight of the fixes leaves wider bounds.
    assert inside[0] <= high


@pytest.mark.parametrize("current", [(0.0, 0.0), (1.5, -1.0)])
def test_a_current_that_turns_the_course_widens_the_bound_of_the_heading(current):
    """A boat in a stream, an aircraft in wind: courses off by up to ten degrees, not by slip."""
    squares = []
    for seed in range(4):
        imu, truth, sensors = unit(DRIVE, 100.0, seed, "icm-42688-p")
        table = fixes(seed)
        table[VELOCITY[:2]] += np.array(current)
        squares.append(
            chi_square(GnssCourse().align(imu.iloc[:4001], SITE, sensors, table), truth[4000])
        )
    assert sum(squares) < chi2.isf(1e-4, 3 * len(squares))


def test_scatter_of_courses_counts_by_its_size_and_its_correlation():
    white = np.random.default_rng(4).normal(size=4000)
    assert _excess(white) < 1.1
    assert _excess(3.0 * white) == pytest.approx(9.0, rel=0.15)
    # A first-order process of r = 0.8 in variance counts (1 + r) / (1 - r) times.
    slow = lfilter([0.6], [1.0, -0.8], white)
    assert _excess(3.0 * slow) == pytest.approx(9.0 * 9.0, rel=0.25)
    assert _excess(np.array([7.0])) == _excess(np.zeros(5)) == 1.0


def test_heights_give_a_course_receiver_its_vertical_velocity():
    imu, _ = ideal(DRIVE, 100.0)
    exact = simulate_gnss(DRIVE, GnssReceiver(rate=5.0, velocity_noise=1e-5, position_noise=1e-3))
    level = exact.copy()
    level[VELOCITY_SD[2]] = np.inf
    none = ImuUncertainty(TriadUncertainty(bias=1e-9), TriadUncertainty(bias=1e-9))
    found = GnssCourse().align(imu.iloc[:4001], SITE, none, level)
    down = np.interp(40.0, exact.index, exact["VD"])
    assert found.velocity[2] == pytest.approx(down, abs=0.02)
    assert found.joint[2, 2] < 0.05**2


def test_a_root_of_the_inverse_stays_finite_where_rounding_makes_the_matrix_singular():
    normal = np.cov(np.random.default_rng(5).normal(size=(80, 200)))
    root = _root_of_inverse(normal)
    assert np.abs(root.T @ root @ normal - np.eye(80)).max() < 1e-12
    assert np.isfinite(_root_of_inverse(np.ones((80, 80)))).all()


def test_a_search_from_a_near_estimate_ends_where_one_from_nothing_does():
    imu, _ = ideal(DRIVE, 50.0)
    sensors = ImuUncertainty(TriadUncertainty(bias=1e-2), TriadUncertainty(bias=0.3))
    fit = GnssCourse().fit(imu.iloc[:2001], SITE, sensors, fixes(1, rate=3.7), Antenna())
    found = fit.search()
    again = fit.search(found)
    moved = np.concatenate([again.velocity - found.velocity, again.bias - found.bias])
    sd = np.sqrt(np.diagonal(found.covariance)[[0, 1, 2, *range(6, 12)]])
    assert (np.abs(moved) < SMALL * sd).all()


@pytest.mark.parametrize("positions", [False, True])
def test_derivatives_are_those_of_the_predictions(positions):
    """A tilt and a bias nearly cancel: what is left of both decides what the fixes tell apart.

    With derivatives at the sample before each fix, 0.4 per mille off, positions of a centimetre
    separated 65 mg from a tilt of 3.7 deg "to 0.08 deg", and the iteration did not converge.
    """
    imu, _ = ideal(DRIVE, 50.0)
    table = fixes(1, rate=3.7, noise=0.05, place_noise=0.02)
    table = alone(table) if positions else table
    sensors = ImuUncertainty(
        TriadUncertainty(bias=1e-2, scale=1e-2, misalignment=1e-2),
        TriadUncertainty(bias=0.3, scale=1e-2, misalignment=1e-2),
    )
    antenna = Antenna(lever_arm=(0.5, -0.3, -1.2))
    fit = GnssCourse().fit(imu.iloc[:2001], SITE, sensors, table, antenna)
    found = fit.search()
    seen = fit._observed(found)
    steps = {0: 1e-3, 1: 1e-3, 3: 1e-4, 4: 1e-4, 5: 1e-4, 6: 1e-6, 7: 1e-6, 9: 1e-3, 10: 1e-3}
    for column, step in steps.items():
        x = np.zeros(fit.unknowns)
        x[column] = step
        moved = replace(
            found,
            C=rotation.dcm_from_rotation_vector(x[TURN]) @ found.C,
            velocity=found.velocity + x[END_VELOCITY],
            errors=found.errors + x[OF_SENSORS],
        )
        change = seen.gap - fit._observed(moved).gap
        # The second order of the step, the motion between two samples and between two nodes, and
        # for velocities the turn of the lever arm, which the rows leave out.
        part = 1e-3 if positions else 5e-3
        off = np.abs(change - seen.rows[:, :, column] * step).max() / np.abs(change).max()
        assert off < part, (column, off)
    for axis in range(3):
        longer = np.array(antenna.lever_arm)
        longer[axis] += 0.01
        other = replace(fit.model, antenna=replace(antenna, lever_arm=tuple(longer)))
        change = seen.gap - replace(fit, model=other)._observed(found).gap
        off = np.abs(change - seen.rows[:, :, ARM.start + axis] * 0.01).max()
        assert off < 1e-9


@pytest.mark.parametrize("positions", [False, True])
def test_the_start_of_a_drive_is_known_whatever_the_speeds_are(positions):
    """The level turns with the way, and fixes may miss the part in which the vehicle drives off.

    By the rate of turning at the end of the record, 14 m/s off for half of it, the velocity three
    minutes before was 0.4 m/s wrong; by a turn of the Earth of first order 0.02 m/s.
    """
    speed = Track((0.0, 90.0, 110.0, 180.0), (6.0, 6.0, 20.0, 20.0))
    turn = Track((0.0, 110.0, 120.0, 150.0, 160.0), (0.0, 0.0, 6.0, -4.0, 3.0))
    motion = PathMotion(180.0, ORIGIN, heading_deg=30.0, speed=speed, turn_rate=turn)
    imu, truth = ideal(motion, 50.0)
    table = fixes(0, motion, noise=1e-4, rate=1.0, place_noise=1e-3)
    table = alone(table) if positions else table
    attrs, missed = table.attrs, (table.index > 65.0) & (table.index < 130.0)
    table = table[~missed]
    table.attrs = attrs
    none = ImuUncertainty(TriadUncertainty(bias=1e-9), TriadUncertainty(bias=1e-7))
    found = replace(NO_SLIP, backtrack=True).align(imu, SITE, none, table).earlier
    state = motion.trajectory(imu.index.to_numpy()[:1])[VELOCITY].to_numpy()[0]
    # What is left: gravity grows by 8e-9 m/s² a metre northward, 0.002 m/s by 2.5 km and 180 s; and
    # the sensors' prior errors of 1e-7 m/s² and 1e-9 rad/s, 3e-4 m/s.
    assert np.abs(found.velocity - state).max() < 3e-3
    assert np.abs(phi(found, truth[0])[:2]).max() < 2e-5
