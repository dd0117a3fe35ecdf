"""A vehicle that goes on over a full turn of longitude is simulated, navigated and compared."""

import numpy as np
import pytest

from strapdown import simulate
from strapdown.evaluation.trajectory_differences import trajectory_differences
from strapdown.formats.writers import TRAJECTORY_FORMATS, WRITERS
from strapdown.nav_state import NavState
from strapdown.simulation import ImuErrors, Origin, SplineMotion, car, simulate_imu
from strapdown.simulation.vehicles import Straight
from strapdown.tables import places_of

DRIVE = """[motion]
kind = "car"
lat_deg = 10
lon_deg = {}
heading_deg = {}
speed_m_per_s = 20
manoeuvres = [{{ do = "straight", duration_s = 5 }}]
"""


def drive(lon_deg, heading_deg):
    motion = car(
        Origin(10.0, lon_deg), [("go", Straight(5.0))], heading_deg=heading_deg, speed=20.0
    )
    imu, _ = simulate_imu(motion, ImuErrors(), rate=10.0)
    return motion.trajectory(imu.index)


@pytest.mark.parametrize(("lon_deg", "heading_deg"), [(359.9999, 90.0), (-359.9999, 270.0)])
def test_over_a_full_turn_it_is_where_it_would_be_before_it(lon_deg, heading_deg, tmp_path):
    over = drive(lon_deg, heading_deg)
    assert np.abs(over["lon"]).max() > 360.0
    plain = drive(lon_deg - np.copysign(360.0, lon_deg), heading_deg)
    # A longitude near 360 deg is rounded to 6e-14 deg, 6 nm.
    apart = trajectory_differences(over, plain)
    assert np.abs(apart[["north", "east", "down"]].to_numpy()).max() < 2e-8
    assert NavState.from_trajectory(over, -1).lon == pytest.approx(
        NavState.from_trajectory(plain, -1).lon, abs=2e-15
    )
    assert SplineMotion.from_trajectory(over).duration == 5.0
    for name in TRAJECTORY_FORMATS:
        WRITERS[name].write(tmp_path / f"drive.{name}", {"reference": over})


def test_within_a_full_turn_no_digit_changes():
    trajectory = drive(359.0, 90.0)
    assert np.array_equal(places_of(trajectory), trajectory[["lat", "lon", "alt"]].to_numpy())


def test_its_files_and_its_picture_are_made(tmp_path):
    (tmp_path / "east.toml").write_text(DRIVE.format(359.9999, 90))
    seal = simulate(str(tmp_path / "east.toml"), rate_hz=10).save(tmp_path / "out")
    assert (seal.path / "trajectory.csv").is_file()
