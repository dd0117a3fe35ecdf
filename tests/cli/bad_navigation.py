"""Bad input to navigation from Python: what is called, and what is said about it."""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from strapdown.increments import motion_increments
from strapdown.mechanization import NavTracker, NorthEastDown, WanderAzimuth, run_mechanization
from strapdown.nav_state import NavState
from strapdown.tables import imu_table, motion_increments_table, trajectory_table

HOME = NavState.from_degrees(55.0, 37.0, 150.0)
TIME = np.arange(6000) * 0.01
STILL = np.zeros((6000, 3))
LEVEL = np.tile([0.0, 0.0, -9.8153], (6000, 1))


def latitude():
    NavState.from_degrees(95.0, 200.0)


def swapped():
    NavState.from_degrees(139.6917, 35.6895)  # Tokyo, longitude first


def degrees_for_radians():
    NavState(time=0.0, lat=55.0, lon=37.0, alt=150.0, v_n=(0, 0, 0), q_nb=(1, 0, 0, 0))


def swapped_columns():
    place = [[139.6917, 35.6895, 40.0], [139.6918, 35.6896, 40.0]]
    trajectory_table([0.0, 1.0], place, np.zeros((2, 3)), np.zeros((2, 3)), source="drive.csv")


def time_stands_still():
    imu_table([0.0, 0.01, 0.01], STILL[:3], LEVEL[:3], source="drive.csv")


def step_of_no_length():
    motion_increments_table([0.01, 0.02], [0.01, 0.0], STILL[:2], STILL[:2], STILL[:2])


def gap():
    later = np.where(TIME < 20.0, TIME, TIME + 2.5)
    imu = imu_table(later, STILL, LEVEL, source="drive.csv")
    run_mechanization(NorthEastDown(), HOME, motion_increments(imu))


def burst():
    rate = STILL.copy()
    rate[1200:1207] = np.nan
    imu_table(TIME, rate, LEVEL, source="drive.csv")


def gravity_upside_down():
    imu = imu_table(TIME, STILL, -LEVEL, source="drive.csv")
    run_mechanization(NorthEastDown(), HOME, motion_increments(imu))


def one_wild_sample():
    force = LEVEL.copy()
    force[3000] = 4e6
    imu = imu_table(TIME, STILL, force, source="drive.csv")
    run_mechanization(NorthEastDown(), HOME, motion_increments(imu))


def over_the_pole():
    start = NavState.from_degrees(89.89, 0.0, 10_000.0, v_n=(300.0, 0.0, 0.0))
    imu = imu_table(TIME, STILL, LEVEL, source="flight.csv")
    run_mechanization(NorthEastDown(height="held"), start, motion_increments(imu))


def limit_for_no_pole():
    WanderAzimuth(latitude_limit_deg=85.0)


def another_start():
    imu = imu_table(TIME + 100.0, STILL, LEVEL, source="drive.csv")
    run_mechanization(NorthEastDown(), HOME, motion_increments(imu))


def no_accelerometer():
    motion_increments(imu_table(TIME, STILL, source="drive.csv"))


def nothing_to_damp_by():
    increments = motion_increments(imu_table(TIME, STILL, LEVEL))
    run_mechanization(NorthEastDown(height="damped"), HOME, increments)


def wrong_word():
    NorthEastDown(height="hold")


def live_sample():
    tracker = NavTracker(HOME)
    tracker.update(0.0, [0.0, 0.0, 0.0], [0.0, 0.0, -9.8])
    tracker.update(0.01, [0.0, 0.0, float("nan")], [0.0, 0.0, -9.8])


@dataclass(frozen=True)
class Call:
    title: str
    call: Callable[[], None]

    @property
    def source(self) -> str:
        return textwrap.dedent(inspect.getsource(self.call).split("\n", 1)[1]).rstrip()


CALLS = (
    Call("A latitude over 90 degrees", latitude),
    Call("Latitude and longitude swapped", swapped),
    Call("Degrees for radians", degrees_for_radians),
    Call("A trajectory with its columns swapped", swapped_columns),
    Call("Time that does not advance", time_stands_still),
    Call("A step of no length", step_of_no_length),
    Call("A gap", gap),
    Call("A burst of NaN", burst),
    Call("Gravity with the other sign", gravity_upside_down),
    Call("One wild sample", one_wild_sample),
    Call("A flight over the pole", over_the_pole),
    Call("A limit of latitude for axes that have none", limit_for_no_pole),
    Call("A start at another time", another_start),
    Call("No accelerometer", no_accelerometer),
    Call("A height to be damped by nothing", nothing_to_damp_by),
    Call("An option that there is not", wrong_word),
    Call("A bad sample, live", live_sample),
)
