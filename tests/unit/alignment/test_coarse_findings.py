"""What a coarse alignment says of a record that is not what it should be."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parent))

from stands import ORIGIN, SITE, changed, chi_square, phi, rocking, still, unit

from strapdown.alignment.alignment import Site
from strapdown.alignment.inertial_frame import InertialFrame
from strapdown.alignment.levelling import KnownHeading, Levelling
from strapdown.alignment.two_vector import TwoVector
from strapdown.errors import ConfigError, DataError
from strapdown.simulation.earth_motion import Origin
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.simulation.motion import Track
from strapdown.simulation.path_motion import PathMotion
from strapdown.tables import ACCEL, GYRO

NORTH = [InertialFrame(), TwoVector()]
ALL = [*NORTH, Levelling(), KnownHeading(60.0, 0.1)]
each = pytest.mark.parametrize("method", ALL, ids=str)
each_north = pytest.mark.parametrize("method", NORTH, ids=str)


@pytest.fixture(scope="module")
def stood():
    return unit(still(300.0), 20.0, 3)


def words(alignment):
    return "\n".join(str(f) for f in alignment.findings)


def scaled(imu, columns, factor):
    return changed(imu, **{c: imu[c] * factor for c in columns})


@each
def test_nothing_is_said_of_a_body_that_stands(method, stood):
    imu, _, sensors = stood
    found = words(method.align(imu, SITE, sensors))
    assert found == "" or method.name == "levelling"


@each
def test_a_dead_channel(method, stood):
    imu, _, sensors = stood
    with pytest.raises(
        DataError,
        check=coded(
            "alignment.dead-gyro", row=1, file="log.csv", quantity="gyro_y", value=0.0, count=6001
        ),
    ):
        method.align(changed(imu, gyro_y=0.0), SITE, sensors)
    with pytest.raises(
        DataError,
        check=coded("alignment.dead-accelerometer", quantity="accel_z", value=-9.8, count=6001),
    ):
        method.align(changed(imu, accel_z=-9.8), SITE, sensors)


@each
def test_a_value_that_is_no_number(method, stood):
    imu, _, sensors = stood
    broken = changed(imu)
    broken.iloc[77, 1] = np.nan
    with pytest.raises(
        DataError, check=coded("tables.not-finite-number", row=78, quantity="gyro_y")
    ):
        method.align(broken, SITE, sensors)


@each
def test_no_accelerometer_and_too_few_samples(method, stood):
    imu, _, sensors = stood
    with pytest.raises(
        DataError, check=coded("alignment.no-accelerometer", quantity="accel", file="log.csv")
    ):
        method.align(imu[GYRO], SITE, sensors)
    with pytest.raises(DataError, check=coded("alignment.too-few-samples", count=10, index=0.45)):
        method.align(imu.iloc[:10], SITE, sensors)


@each
@pytest.mark.parametrize(
    ("factor", "remedy"), [(1 / 9.80665, "to be g"), (1e3, "mm/s²"), (0.3, "unit")]
)
def test_forces_in_other_units(method, stood, factor, remedy):
    imu, _, sensors = stood
    with pytest.raises(DataError, match=f"(?s)log.csv, accel: the mean specific force.*{remedy}"):
        method.align(scaled(imu, ACCEL, factor), SITE, sensors)


@each
def test_gravity_instead_of_specific_force(method, stood):
    imu, _, sensors = stood
    assert "upside down" in words(method.align(scaled(imu, ACCEL, -1.0), SITE, sensors))


@each_north
def test_rates_in_degrees(method, stood):
    imu, _, sensors = stood
    with pytest.raises(DataError, match=r"(?s)log.csv.*seem to be in deg/s"):
        method.align(scaled(imu, GYRO, 57.29578), SITE, sensors)


@each_north
def test_another_latitude(method, stood):
    imu, _, sensors = stood
    for lat in (50.0, -55.0):
        found = words(method.align(imu, Site(lat, 37.0, 150.0), sensors))
        assert "deg (standard deviation" in found or "latitude by its gyros is 55 deg" in found
        assert "latitude" in found
    # The measured one is the true one, within what a bias of 0.01 deg/h leaves.
    said = words(method.align(imu, Site(50.0, 37.0, 150.0), sensors))
    assert "the latitude from Earth rate and gravity is 5" in said


@each
def test_another_height(method, stood):
    """Gravity falls by 0.31 ppm a metre: 5 km are 1570 ppm, the accelerometers' are 70."""
    imu, _, sensors = stood
    found = words(method.align(imu, Site(55.0, 37.0, 5150.0), sensors))
    assert "log.csv, accel: measured gravity differs from that of the site by +15" in found


def test_a_latitude_of_the_wrong_sign_is_called_that(stood):
    imu, _, sensors = stood
    found = words(InertialFrame().align(imu, Site(-55.0, 37.0, 150.0), sensors))
    assert "the latitude seems to have the wrong sign" in found


@each_north
def test_a_bias_that_was_not_stated(method, stood):
    imu, _, sensors = stood
    biased = changed(imu, gyro_z=imu["gyro_z"] + np.radians(5.0) / 3600.0)
    assert "deg/h" in words(method.align(biased, SITE, sensors))


@each_north
def test_gyros_too_poor_for_north(method):
    imu, _, sensors = unit(still(300.0), 20.0, 3, "icm-42688-p")
    with pytest.raises(
        DataError,
        match=r"(?s)log.csv, heading: the gyros cannot find north.*at latitude 55 deg.*"
        r"standard deviation of the gyro bias 1.04e\+03 deg/h.*known_heading",
    ):
        method.align(imu, SITE, sensors)


@each_north
@pytest.mark.parametrize("lat", [90.0, -90.0, 89.99])
def test_at_a_pole(method, lat):
    imu, _, sensors = unit(still(300.0, origin=Origin(lat, 0.0, 0.0)), 20.0, 3)
    with pytest.raises(DataError, check=coded("alignment.no-north-near-pole")):
        method.align(imu, Site(lat, 0.0), sensors)


@each_north
def test_near_a_pole(method):
    imu, truth, sensors = unit(still(300.0, origin=Origin(80.0, 0.0, 0.0)), 20.0, 3)
    found = method.align(imu, Site(80.0, 0.0), sensors)
    assert "only 17.4 % of the Earth rate is horizontal" in words(found)
    assert chi_square(found, truth[-1]) < 25.0


@each_north
def test_too_short_a_time(method, stood):
    """What is stated covers the error, or it refuses."""
    imu, truth, sensors = stood
    for count in (20, 60, 200, 1000):
        try:
            found = method.align(imu.iloc[:count], SITE, sensors)
        except DataError as error:
            assert "cannot find north" in str(error)
            continue
        assert chi_square(found, truth[count - 1]) < 25.0


@each
def test_a_gap_is_told_with_its_row(method, stood):
    imu, _, sensors = stood
    holed = imu.drop(imu.index[1000:1040])
    holed.attrs = imu.attrs
    (gap,) = [f for f in method.align(holed, SITE, sensors).findings if f.quantity == "time"]
    assert (gap.code, gap.file, gap.row) == ("alignment.gap", "log.csv", 1001)
    assert gap.data["length"] == pytest.approx(2.05)


def moved(speed=((0.0,), (0.0,)), turn=((0.0,), (0.0,)), seed=3):
    motion = PathMotion(
        300.0, ORIGIN, heading_deg=60.0, speed=Track(*speed), turn_rate=Track(*turn)
    )
    return motion, *unit(motion, 50.0, seed)


@pytest.mark.parametrize(
    "speed",
    [((0.0, 250.0, 260.0), (0.0, 0.0, 10.0)), ((0.0, 100.0, 110.0, 150.0, 160.0), (0, 0, 5, 5, 0))],
    ids=["drives off", "drives and stops"],
)
def test_a_vehicle_that_drives(speed):
    _, imu, truth, sensors = moved(speed=speed)
    with pytest.raises(
        DataError, check=coded("alignment.body-travelled", quantity="accel", file="log.csv")
    ):
        InertialFrame().align(imu, SITE, sensors)
    for method in (TwoVector(), KnownHeading(60.0, 0.1)):
        found = method.align(imu, SITE, sensors)
        assert "is not stationary" in words(found)
        assert chi_square(found, truth[-1]) < 16.0


def test_a_vehicle_that_turns_at_its_place():
    _, imu, truth, sensors = moved(turn=((0.0, 100.0, 130.0, 160.0), (0.0, 0.0, 3.0, 0.0)))
    found = InertialFrame().align(imu, SITE, sensors)
    assert "turns about the vertical" in words(found)
    assert chi_square(found, truth[-1]) < 16.0
    found = TwoVector().align(imu, SITE, sensors)
    assert "is not stationary" in words(found)
    assert chi_square(found, truth[-1]) < 16.0


def test_a_steady_drive_needs_fixes_to_be_seen():
    motion, imu, truth, sensors = moved(speed=((0.0,), (10.0,)))
    fixes = simulate_gnss(motion, GnssReceiver(rate=1.0, velocity_noise=0.05), source="gnss.csv")
    for method in NORTH:
        with pytest.raises(DataError, match=r"gnss.csv, row 1, VN, VE: the vehicle moves at 10"):
            method.align(imu, SITE, sensors, fixes)
        # Without them the Earth seems to turn otherwise: 10 m/s are 0.32 deg/h.
        found = method.align(imu, SITE, sensors)
        assert found.findings
        assert abs(phi(found, truth[-1])[2]) > np.radians(0.5)


def test_fixes_of_a_vehicle_that_stands_are_no_drive(stood):
    imu, _, sensors = stood
    fixes = simulate_gnss(still(300.0), GnssReceiver(rate=1.0, velocity_noise=0.05))
    for method in NORTH:
        assert not method.align(imu, SITE, sensors, fixes).findings


def test_noisier_gyros_than_stated_are_in_the_uncertainty():
    imu, truth, sensors = unit(still(300.0), 20.0, 3)
    rng = np.random.default_rng(0)
    # 0.1 deg/sqrt(h), a hundred times what the sheet says.
    density = np.radians(0.1) / 60.0
    loud = changed(
        imu, **{c: imu[c] + rng.normal(0.0, density * np.sqrt(20.0), len(imu)) for c in GYRO}
    )
    for method in NORTH:
        found = method.align(loud, SITE, sensors)
        assert found.findings
        assert chi_square(found, truth[-1]) < 16.0
        # density/sqrt(T)/(w cos lat), of the fit to the second integral by a fifth or so more.
        expected = density / np.sqrt(300.0) / SITE.earth_rate[0]
        assert 0.4 * expected < np.sqrt(found.covariance[2, 2]) < 3.0 * expected


def test_rocking_alone_is_no_fault_to_the_inertial_frame():
    imu, _, sensors = unit(rocking(600.0), 50.0, 3)
    assert not InertialFrame().align(imu, SITE, sensors).findings


@each
def test_a_burst_of_outliers(method, stood):
    imu, truth, sensors = stood
    burst = changed(imu)
    burst.iloc[3000:3005, burst.columns.get_loc("accel_x")] += 50.0
    place = r"log.csv, row 300[16], accel_x: 2 steps between samples"
    if method.name == "inertial_frame":
        with pytest.raises(DataError, match=rf"(?s){place}.*deviation of the heading.*robust_fir"):
            method.align(burst, SITE, sensors)
        return
    found = method.align(burst, SITE, sensors)
    assert re.search(place, words(found))
    if method.name != "levelling":
        assert chi_square(found, truth[-1]) < 16.0


def test_options_out_of_range():
    for wrong in (1, 2000, True, "ten"):
        with pytest.raises(ConfigError, match="blocks"):
            TwoVector(wrong)
    with pytest.raises(ConfigError, check=coded("alignment.unknown-epoch", quantity="at")):
        InertialFrame("ende")
    with pytest.raises(
        ConfigError, check=coded("alignment.heading-not-finite", quantity="heading_deg")
    ):
        KnownHeading(np.nan, 1.0)
    for sd in (0.0, -1.0, 200.0, np.nan):
        with pytest.raises(
            ConfigError, check=coded("alignment.heading-sd-not-positive", quantity="sd_deg")
        ):
            KnownHeading(60.0, sd)


def test_a_body_that_points_to_the_zenith_has_no_heading():
    imu, _, sensors = unit(still(60.0, 0.0, 90.0, 0.0), 20.0, 3)
    with pytest.raises(
        DataError, check=coded("alignment.pitch-vertical", quantity="pitch", file="log.csv")
    ):
        KnownHeading(60.0, 0.1).align(imu, SITE, sensors)
