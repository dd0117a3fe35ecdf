"""A car with a MEMS unit and an RTK receiver: navigated, and scored by fixes that are withheld.

There is no truth but the receiver, which is right to centimetres. The settings follow from what the
recording's description says and what its rest shows; five sets of noise were scored, too, so that
the scores are no blind test:

* noise: the standard deviation of a sample at rest, as white noise. The rest is not quiet, nor is
  the drive;
* the pitch gyro shakes and rectifies, 4.5 deg in 20 s: a drift of 0.2 deg/s that lasts 20 s;
* biases: what the rest leaves of a MEMS gyro, 0.05 deg/s; |f| at rest is 1.3 % too large, so
  0.15 m/s²;
* delay of the velocity and offset of the clocks: as `gnss_readiness` tells them;
* the receiver: no better than its data sheet, 3 cm and 5 cm/s;
* the vehicle: mounting as described, pitch -6.8 and yaw 5 deg, known to 2 deg.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from tests.withheld_fixes import score_withheld, scores_table

from strapdown import rotation
from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.sensor_blocks import accel_bias, gyro_bias, gyro_drift
from strapdown.increments import motion_increments
from strapdown.mechanization import MECHANIZATIONS
from strapdown.nav_state import NavState
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.gnss_clock import time_offset, velocity_delay
from strapdown.navigation.measurements.gnss_readiness import gnss_readiness
from strapdown.navigation.measurements.vehicle import NoSlip
from strapdown.navigation.navigator import Navigator, with_states
from strapdown.navigation.outage_test import spans_to_withhold
from strapdown.rotation import level
from strapdown.tables import gnss_table, imu_table

DEG = np.pi / 180.0
REST = 30.0  # s
#: When the car first goes straight on and fast, after the record's start, s.
BEGIN, SETTLED = 58.0, 90.0


@dataclass(frozen=True, eq=False)
class Drive:
    imu: object
    gnss: object
    time: np.ndarray
    rows: np.ndarray


@pytest.fixture(scope="module")
def drive(recordings):
    folder = recordings("car_rtk")
    imu = np.loadtxt(folder / "part1_imu_frd_si.csv", delimiter=",")
    fix = np.loadtxt(folder / "part1_gnss_rtk.csv", delimiter=",")
    time = imu[:, 0]
    imu[:, 1:4] -= imu[time < time[0] + REST, 1:4].mean(axis=0)
    imu = imu_table(time, imu[:, 1:4], imu[:, 4:7], source="part1_imu_frd_si.csv")
    gnss = gnss_table(
        fix[:, 0],
        fix[:, 1:4],
        fix[:, 4:7],
        fix[:, 7:10],
        fix[:, 10:13],
        # RTKLIB's 1 is fixed and 2 is float.
        quality=np.where(fix[:, 13] == 1.0, 4, 5),
        source="part1_gnss_rtk.csv",
    )
    table = motion_increments(imu)
    return Drive(imu, gnss, table.index.to_numpy(), np.ascontiguousarray(table.to_numpy()))


@pytest.fixture(scope="module")
def clock(drive):
    """Delay of the velocity and offset of the clocks, as they are told."""
    delay = velocity_delay(drive.gnss)
    return delay, time_offset(drive.gnss, drive.imu, delay.delay)


def begun(drive, clock, *more):
    """A navigator, its state where the car drives, and the steps from there."""
    delay, offset = clock
    t0 = drive.time[0]
    rest = drive.imu[drive.imu.index < t0 + REST].to_numpy()
    step = float(np.median(np.diff(drive.time)))
    gyro_noise, accel_noise = np.split(rest.std(axis=0) * np.sqrt(step), 2)
    model = RotationVectorModel(
        tuple(gyro_noise),
        tuple(accel_noise),
        (
            gyro_bias(0.05 * DEG),
            gyro_drift((0.02 * DEG, 0.2 * DEG, 0.005 * DEG), 20.0),
            accel_bias(0.15),
        ),
    )
    receiver = Gnss(
        name="rtk",
        lever_arm=(0.0, -0.05, 0.0),
        time_offset=offset.offset,
        time_offset_sd=0.1,
        time_offset_drift=1e-3,
        velocity_delay=delay.delay,
        least_position_sd=0.03,
        least_velocity_sd=0.05,
    )
    aids = (receiver, *more)
    filter_ = ErrorFilter(MECHANIZATIONS["ned"](), model, COVARIANCES["ud"]())
    navigator = Navigator(with_states(filter_, aids), aids)
    at = int(np.searchsorted(drive.time, t0 + BEGIN))
    instant = drive.time[at - 1]
    stamps = drive.gnss.index.to_numpy() - offset.offset
    fix = drive.gnss.to_numpy()
    place = [np.interp(instant, stamps, fix[:, k]) for k in (0, 1, 2)]
    v = [np.interp(instant, stamps - delay.delay, fix[:, k]) for k in (3, 4, 5)]
    roll, pitch = level(rest[:, 3:].mean(axis=0))
    start = NavState.from_degrees(
        *place,
        v_n=v,
        roll_deg=roll,
        pitch_deg=pitch,
        heading_deg=np.degrees(np.arctan2(v[1], v[0])),
        time=instant,
    )
    # The rest need not be where the car stands level, nor the unit point forward.
    angles = np.array([4.0, 4.0, 10.0]) * DEG
    # The place is that of an instant that is known to 0.1 s, at 10 m/s.
    sd = np.r_[[1.0] * 3, [0.3] * 3, angles, navigator.filter.model.stacked.sd]
    gnss = drive.gnss[stamps > instant + 0.5]
    return navigator, navigator.begin(start, np.diag(sd**2)), at, gnss


@cache
def scores(drive, clock, length, *more):
    navigator, state, at, gnss = begun(drive, clock, *more)
    spans = spans_to_withhold(drive.time[0] + SETTLED, drive.time[-1] - 1.0, length)
    return scores_table(
        score_withheld(navigator, state, drive.time[at:], drive.rows[at:], "rtk", gnss, spans)
    )


NO_SLIP = NoSlip(name="no_slip", pitch_deg=-6.8, yaw_deg=5.0, mounting_sd_deg=(2.0, 2.0))
#: Slip and dive as constants of the car; a third of them as noise.
COMPLIANT = replace(
    NO_SLIP, compliance_sd_deg_per_g=(4.0, 2.0), slip_deg_per_g=1.2, dive_deg_per_g=0.6
)


def test_the_fixes_show_that_velocities_are_late_and_clocks_apart(drive, clock):
    delay, offset = clock
    # A mean over the 0.25 s before the stamp is 0.125 s late.
    assert delay.delay == pytest.approx(0.125, abs=0.01)
    assert delay.sd < 0.005
    # Inertial stamps are 0.12 to 0.15 s late, and drift.
    assert offset.offset == pytest.approx(-0.135, abs=0.015 + 3.0 * offset.sd)
    assert offset.sd < 0.05
    remedies = [one.remedy for one in gnss_readiness(drive.gnss, drive.imu)]
    assert any(re.match(r"set velocity_delay_s = 0\.1[23]", one) for one in remedies)
    assert any(re.match(r"set time_offset_s = -0\.1[0-9]", one) for one in remedies)
    good = Gnss(name="rtk", velocity_delay=0.125, time_offset=-0.135)
    assert gnss_readiness(drive.gnss, drive.imu, good) == ()


@pytest.mark.slow
def test_the_filter_finds_what_is_known_of_the_recording(drive, clock):
    navigator, state, at, gnss = begun(drive, clock, NO_SLIP)
    state = navigator.tell(state, "rtk", gnss)
    state, piece = navigator.advance(state, drive.time[at:], drive.rows[at:])
    last = piece.marks[-1]
    place = navigator.filter.model.columns_of
    k = place["rtk.time_offset"].start - 9
    # Inertial stamps are late by 0.12 to 0.15 s, and drift.
    settled = [m for m in piece.marks if m.time > drive.time[0] + SETTLED]
    offsets = [clock[1].offset - m.sensors[k] for m in settled]
    assert -0.16 < np.median(offsets) < -0.11
    assert -0.16 < offsets[-1] < -0.11
    # The same is found from another nominal value, as far as it says.
    other = replace(clock[1], offset=clock[1].offset + 0.05)
    navigator, state, at, gnss = begun(drive, (clock[0], other), NO_SLIP)
    state = navigator.tell(state, "rtk", gnss)
    again = navigator.advance(state, drive.time[at:], drive.rows[at:])[1].marks[-1]
    found = other.offset - again.sensors[k]
    assert found == pytest.approx(offsets[-1], abs=3.0 * again.sensors_sd[k])
    # The yaw of the unit is 5.35 deg, as the description has it: heading less course, straight on.
    row = piece.history[piece.time < drive.time[0] + 170.0][-1]
    heading = rotation.euler_from_quaternion(row[None, 6:10])[0, 2]
    course = np.degrees(np.arctan2(row[4], row[3]))
    assert rotation.within_half_turn(heading - course) == pytest.approx(5.35, abs=1.0)
    mounting = np.degrees(last.sensors[place["no_slip.mounting"].start - 9 :][:2])
    assert np.abs(mounting).max() < 1.0
    # Innovations are no larger than they say.
    for name in ("rtk.position", "rtk.velocity", "no_slip.velocity"):
        settled = drive.time[0] + SETTLED
        seen = [o.innovations for o in piece.seen if o.name == name and o.time > settled]
        nis = np.mean([one.nu**2 / one.s for one in seen], axis=0)
        assert (nis < 1.5).all(), name


@pytest.mark.slow
def test_fifteen_places_say_more_than_five(drive, clock):
    navigator, state, at, gnss = begun(drive, clock, NO_SLIP)
    spans = spans_to_withhold(drive.time[0] + SETTLED, drive.time[-1] - 1.0, 30.0, 15)
    table = scores_table(
        score_withheld(navigator, state, drive.time[at:], drive.rows[at:], "rtk", gnss, spans)
    )
    # Measured: 5.8 m and 14 m, all of them within what was stated; a fifth more.
    assert table["error"].median() < 7.0
    assert table["error"].max() < 17.0
    assert (table["distance"] < 2.45).sum() >= 13


# Median and worst largest horizontal error of five places in m. `python -m benchmarks.car_rtk` has
# python-ins at the same places: 1.8 (2.4), 45 (72), 325 (459), and with the constraint 0.7 (1.2),
# 8.2 (12.5), 10 (35). Measured here: 1.4 (1.7), 29 (36), 204 (549); 0.7 (1.2), 8.7 (12), 13 (31);
# with slip and dive as states 0.4 (1.1), 7.7 (9.4), 11 (25): nearly all of it along the way, where
# no constraint holds, by the pitch that the shaking gyro leaves unknown. What is asserted is a
# fifth more than measured, or less than python-ins has, whichever is more.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("length", "more", "median", "worst"),
    [
        (10.0, (), 2.8, 8.3),
        (30.0, (), 40.0, 62.0),
        (60.0, (), 250.0, 660.0),
        (10.0, (NO_SLIP,), 1.3, 2.6),
        (30.0, (NO_SLIP,), 10.6, 15.0),
        (60.0, (NO_SLIP,), 16.0, 38.0),
        (30.0, (COMPLIANT,), 9.3, 12.5),
        (60.0, (COMPLIANT,), 13.0, 35.0),
    ],
    ids=lambda value: f"{value:g}" if isinstance(value, float) else f"{len(value)} more",
)
def test_withheld_fixes_are_met_and_errors_within_their_bounds(
    drive, clock, length, more, median, worst
):
    table = scores(drive, clock, length, *more)
    assert table["error"].median() < median
    assert table["error"].max() < worst
    # One of 20 is outside a bound of 95 %; of five, two are with a probability of 2 %.
    assert (table["distance"] < 2.45).sum() >= 4
    assert table["distance"].max() < 3.5
    # And the bounds say something: a filter that claims nothing has distances near zero.
    assert np.sqrt(np.mean(table["distance"] ** 2)) > 0.3
