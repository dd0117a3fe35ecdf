"""The forward axis of a body is held against where it drives, by forces and velocities."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation
from tests.town_drive import fixes, motion

from strapdown.config.logs import DoctorSpec, FixesTable, LogTable
from strapdown.config.navigation import NavigationSpec
from strapdown.formats import csv
from strapdown.formats.writers import table_columns
from strapdown.navigation.measurements.gnss_course import check_forward, forward_direction
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation import Origin, car, simulate_imu
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.simulation.vehicles import Straight
from strapdown.systems.doctor import run_doctor
from strapdown.systems.navigation_checks import look_through
from strapdown.systems.navigation_proposal import propose
from strapdown.tables import ACCEL, GYRO

ERRORS = ImuErrors(
    TriadErrors(noise_density=np.radians(0.005), bias=(1e-3, -1e-3, 2e-3)),
    TriadErrors(noise_density=1e-3, bias=(0.05, -0.05, 0.05)),
)
CODES = {"navigation.forward-axis-elsewhere", "navigation.forward-not-along-course"}


def driven(yaw, pitch=0.0, roll=0.0):
    """The samples of a car in axes that are turned from its own, and the turn."""
    imu, _ = simulate_imu(motion(), ERRORS, rate=50.0, sampling="mean", seed=2)
    turn = Rotation.from_euler("ZYX", [yaw, pitch, roll], degrees=True)
    for triad in (GYRO, ACCEL):
        imu[triad] = turn.inv().apply(imu[triad].to_numpy(copy=True))
    return imu, turn


MOUNTINGS = [(0, 0, 0), (90, 0, 0), (180, 0, 0), (-90, 0, 0), (0, 0, 180), (90, 0, 180)]
MOUNTINGS += [(0, 90, 0), (0, 0, 90), (40, 0, 0), (-100, 4, 3)]


@pytest.mark.parametrize("velocity", [True, False])
@pytest.mark.parametrize("angles", MOUNTINGS)
def test_the_direction_of_motion_in_any_axes(angles, velocity):
    imu, turn = driven(*angles)
    gnss = fixes(antenna=(0.0, 0.0, 0.0))
    if not velocity:
        gnss[["VN_sd", "VE_sd", "VD_sd"]] = np.inf
    forward, down, sd = forward_direction(gnss, imu)
    # The mean force is tilted by the accelerations of the drive.
    off = np.arccos(forward @ turn.inv().apply([1.0, 0.0, 0.0]))
    assert off < np.hypot(3.0 * sd, np.radians(2.0))
    assert np.arccos(down @ turn.inv().apply([0.0, 0.0, 1.0])) < np.radians(2.0)
    assert sd < np.radians(1.0 if velocity else 6.0)


@pytest.mark.parametrize("angles", MOUNTINGS)
def test_axes_that_are_said_put_the_body_right(angles):
    imu, turn = driven(*angles)
    said = check_forward(fixes(), imu)
    truly = turn.inv().apply(np.eye(3))  # forward, right, down in the axes of the samples
    if truly[0, 0] > np.cos(np.radians(20.0)):
        assert said == []
        return
    (found,) = said
    assert found.code in CODES
    if np.abs(truly).max(axis=1).min() > 0.98:
        names = found.data["axes"].split(",")
        stated = [(-1.0 if n[0] == "-" else 1.0) * np.eye(3)["xyz".index(n[-1])] for n in names]
        np.testing.assert_allclose(stated, truly, atol=0.2)
    elif not any(angles[1:]):
        assert found.data["yaw_deg"] == pytest.approx(angles[0], abs=3.0)
        assert check_forward(fixes(), imu, mounting_yaw=np.radians(angles[0])) == []


def test_axes_are_of_the_sensor_where_others_were_stated():
    imu, _ = driven(90, 0, 0)
    imu.attrs["sensor_axes"] = "y,-x,z"  # forward, right, down by the statement
    (found,) = check_forward(fixes(), imu)
    assert found.data["axes"] == "x,y,z"


def test_a_straight_drive_at_one_speed_says_nothing():
    straight = car(Origin(45.0, 20.0, 80.0), [("on", Straight(120.0))], speed=15.0)
    imu, _ = simulate_imu(straight, ERRORS, rate=50.0, sampling="mean", seed=2)
    receiver = GnssReceiver(rate=1.0, position_noise=1.0, velocity_noise=0.1)
    assert forward_direction(simulate_gnss(straight, receiver, seed=3), imu) is None


@pytest.mark.parametrize(("yaw", "said"), [(0, False), (90, True)])
def test_doctor_proposal_and_run_say_it(tmp_path, yaw, said):
    imu, _ = driven(yaw)
    log, file = tmp_path / "log.csv", tmp_path / "fixes.csv"
    csv.write(log, table_columns(imu), {"sampling": "mean"})
    table = fixes(rate=1.0)
    csv.write(file, table_columns(pd.DataFrame(table)), {})
    gnss = FixesTable(path=str(file))
    samples = LogTable(path=str(log), gyro_unit="rad/s", accel_unit="m/s2")
    logs = (samples, LogTable(path=str(file)))
    spec = DoctorSpec(name="doctor", logs=logs, fixes=(gnss,))
    one = run_doctor(spec).logs[0]
    assert bool(CODES & {f.code for f in one.faults}) == said
    assert one.answer("navigation") == ("with limits" if said else "yes")
    made = propose(samples, gnss=gnss)
    assert bool(CODES & {f.code for f in made.findings}) == said
    run = NavigationSpec.model_validate(made.table)
    assert bool(CODES & {f.code for f in look_through(run, imu, {"gnss": table})}) == said
    # A mounting that the file states is no news.
    coarse = run.coarse.model_copy(update={"mounting_yaw_deg": float(yaw)})
    run = run.model_copy(update={"coarse": coarse})
    assert not CODES & {f.code for f in look_through(run, imu, {"gnss": table})}
