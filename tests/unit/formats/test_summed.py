"""Logs of increments: read as means when their unit says so, and only then."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import ConfigError, DataError
from strapdown.formats import ReadOptions, read_log
from strapdown.formats.columns import read_name
from strapdown.formats.triad_units import intervals
from strapdown.tables import ACCEL, GYRO

G0 = 9.80665
RNG = np.random.default_rng(8)
# Steps that are not equal; each sample is summed since the stamp before it.
STEPS = np.array([0.01, 0.012, 0.008, 0.01, 0.011, 0.009, 0.01, 0.01])
TIME = np.concatenate([[0.0], np.cumsum(STEPS)])
RATES = RNG.normal(size=(9, 3))
FORCES = RNG.normal(size=(9, 3)) + np.array([0.0, 0.0, -9.8])
LENGTHS = np.concatenate([[np.median(STEPS)], STEPS])[:, None]


def log(folder, header, gyro, accel, time=TIME):
    lines = [header]
    for row in np.column_stack([time, gyro, accel]):
        lines.append(",".join(repr(float(v)) for v in row))
    path = folder / "log.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def check(recording):
    assert recording.imu.attrs["sampling"] == "mean"
    # A product, a quotient and a difference of stamps of the size of their sum: a few 1e-16 of
    # a value, and of stamps 1e-17 over steps of 8e-3.
    assert recording.imu[GYRO].to_numpy() == pytest.approx(RATES, rel=1e-13)
    assert recording.imu[ACCEL].to_numpy() == pytest.approx(FORCES, rel=1e-13)
    said = [f for f in recording.findings if f.quantity == "sampling"]
    assert len(said) == 1 and "increments of each sample" in said[0].what


@pytest.mark.parametrize(
    ("gyro", "accel", "angle", "velocity"),
    [
        ("dtheta_{}_rad", "dv_{}_m_s", 1.0, 1.0),
        ("delta_angle_{} (deg)", "delta_velocity_{} (m/s)", np.pi / 180, 1.0),
        ("imu/dtheta{} [rad]", "imu/dvel{} [g*s]", 1.0, G0),
        ("dang_{}_deg", "DV_{}_mps", np.pi / 180, 1.0),
    ],
)
def test_names_that_say_increments_and_their_units(tmp_path, gyro, accel, angle, velocity):
    header = ",".join(
        ["time_s", *(gyro.format(a) for a in "xyz"), *(accel.format(a) for a in "xyz")]
    )
    path = log(tmp_path, header, RATES * LENGTHS / angle, FORCES * LENGTHS / velocity)
    check(read_log(path))


@pytest.mark.parametrize(("unit", "angle"), [("rad", 1.0), ("deg", np.pi / 180)])
def test_units_that_the_user_states(tmp_path, unit, angle):
    path = log(tmp_path, "time_s,gx,gy,gz,ax,ay,az", RATES * LENGTHS / angle, FORCES * LENGTHS)
    check(read_log(path, ReadOptions(gyro_unit=unit, accel_unit="m/s")))


def test_degrees_in_a_name_of_rates_are_not_believed(tmp_path):
    """They are often meant a second: the numbers are asked, and if they are silent the user."""
    path = log(tmp_path, "time_s,gx_deg,gy_deg,gz_deg,ax_g,ay_g,az_g", RATES, FORCES / G0)
    with pytest.raises(DataError, check=coded("io.unit-undecided")):
        read_log(path)


def test_rates_go_before_increments_beside_them(tmp_path):
    header = "time_s,gx_rad_s,gy_rad_s,gz_rad_s,dtheta_x_rad,dtheta_y_rad,dtheta_z_rad"
    recording = read_log(log(tmp_path, header, RATES, RATES * LENGTHS))
    assert recording.imu.attrs["sampling"] == "instantaneous"
    assert recording.imu[GYRO].to_numpy() == pytest.approx(RATES, rel=1e-15)


@pytest.mark.parametrize("triad", ["gyro", "accel"])
def test_a_name_that_says_increments_without_a_unit_asks_for_it(tmp_path, triad):
    gyro = "dtheta_x,dtheta_y,dtheta_z" if triad == "gyro" else "gx_dps,gy_dps,gz_dps"
    accel = "dv_x,dv_y,dv_z" if triad == "accel" else "ax_g,ay_g,az_g"
    path = log(tmp_path, f"time_s,{gyro},{accel}", RATES * LENGTHS, FORCES * LENGTHS)
    if triad == "gyro":
        with pytest.raises(DataError, check=coded("io.file-leaves-open-whether")) as error:
            read_log(path)
        assert error.value.finding.code == "io.file-leaves-open-whether"
    else:
        recording = read_log(path)
        assert ACCEL[0] not in recording.imu.columns
        assert any("m/s or g*s" in f.what for f in recording.findings)


def test_increments_are_no_values_at_their_stamps(tmp_path):
    path = log(
        tmp_path,
        "time_s,dtheta_x_rad,dtheta_y_rad,dtheta_z_rad,ax_g,ay_g,az_g",
        RATES * LENGTHS,
        FORCES / G0,
    )
    with pytest.raises(ConfigError, check=coded("io.sampling-against-increments")):
        read_log(path, ReadOptions(sampling="instantaneous"))
    said = [f.what for f in read_log(path).findings if f.quantity == "sampling"]
    assert "accel is taken as such a mean as well" in said[0]


def test_an_increment_after_a_row_left_out_is_of_its_own_step():
    time, kept = np.array([0.0, 0.01, 0.02, 0.04, 0.05, 0.12]), np.array([0, 1, 2, 4, 5, 6])
    # One row is gone before 0.04; before 0.12 there is a gap in which nothing stood.
    length = intervals(time, kept)[:, 0]
    assert length == pytest.approx([0.01, 0.01, 0.01, 0.01, 0.01, 0.07], rel=1e-12)


def test_a_row_that_is_left_out_takes_its_increment_with_it(tmp_path):
    gyro = RATES * LENGTHS
    gyro[4, 1] = np.nan
    header = "time_s,dtheta_x_rad,dtheta_y_rad,dtheta_z_rad,dv_x_m_s,dv_y_m_s,dv_z_m_s"
    recording = read_log(log(tmp_path, header, gyro, FORCES * LENGTHS), ReadOptions(repair=True))
    rows = np.delete(np.arange(9), 4)
    expected = RATES[rows]
    # The step of row 5 was 0.011: after the hole it is taken for the usual one.
    usual = np.median(np.diff(TIME[rows]))
    expected[4] *= 0.011 / usual
    assert recording.imu[GYRO].to_numpy()[1:] == pytest.approx(expected[1:], rel=1e-12)


@pytest.mark.parametrize(
    ("name", "quantity", "unit", "increment"),
    [
        ("dtheta_x_rad", "gyro_x", "rad", True),
        ("DeltaV_z [m/s]", "accel_z", "m/s", True),
        ("dv[1]", "accel_y", None, True),
        ("sensor.dvel_y_m_s", "accel_y", "m/s", True),
        ("gyro_x_deg", "gyro_x", "deg", False),
        ("acc_x_m_s", "accel_x", "m/s", False),
        ("acc_x_m_s2", "accel_x", "m/s2", False),
        ("device", None, None, False),
        ("dv", "accel", None, True),
    ],
)
def test_what_names_of_increments_say(name, quantity, unit, increment):
    said = read_name(name)
    assert (said.quantity, said.unit) == (quantity, unit)
    assert said.increment is increment
