"""Drives before a crash with what a car does on its tires, and recorders with drawn errors.

The motion is of the reference point; north, east, down and the attitude are functions of time, the
readings follow from them on a rotating ellipsoid, and the wheels, the receiver and the recorder see
it as they would: with side slip, squat, scale, delay and noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from scipy.signal import butter, sosfilt

from strapdown import rotation
from strapdown.crash.drive_entry import DriveEntry, start_from_drive
from strapdown.crash.entry_estimate import FixCorrelation
from strapdown.crash.measuring_point import at_point
from strapdown.crash.preparation import Preparation, prepare_unit
from strapdown.crash.reconstruction import CrashOptions, reconstruct_unit
from strapdown.earth import earth_rate
from strapdown.earth import gravity as normal_gravity
from strapdown.ellipsoids import WGS84
from strapdown.frames import geodetic_from_ned
from strapdown.sensors.crash_unit import CrashUnit, Mounting, RecordedTriad
from strapdown.sensors.synchronise import synchronise
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.tables import gnss_table

FINE, RATE = 1000.0, 100.0
ORIGIN = np.array([45.0, 20.0, 80.0])
# Ahead of the reference point, vehicle axes, m.
AXLE, UNIT, ANTENNA = (-1.35, 0.0, 0.3), (0.3, 0.2, 0.1), (0.5, 0.3, -1.2)
DELTA_V, PULSE, SPIN = (-9.0, -4.0), 0.11, 60.0
OVER = (-0.005, PULSE + 0.01)


def pulse(time, start, length):
    """Haversine of area one."""
    x = (time - start) / length
    return np.where((x > 0.0) & (x < 1.0), 2.0 / length * np.sin(np.pi * x) ** 2, 0.0)


@dataclass(frozen=True)
class Road:
    """What the driver does: (start before the impact, length, change), and what the car does."""

    length: float = 40.0
    speed: float = 8.0
    #: m/s
    pushes: tuple = (
        (-38.0, 5.0, 7.0),
        (-27.0, 4.0, -8.0),
        (-16.0, 5.0, 9.0),
        (-5.0, 3.0, -5.0),
    )
    #: deg
    bends: tuple = ((-32.0, 4.0, 50.0), (-22.0, 5.0, -80.0), (-10.0, 4.0, 60.0))
    slip_deg: float = 0.0
    slip_slope_deg: float = 0.4
    squat_deg: float = 0.15

    def after(self):
        return 0.4


@dataclass(frozen=True)
class Drive:
    """A drive and a crash at time zero."""

    road: Road

    @cached_property
    def time(self):
        return np.arange(-self.road.length, self.road.after(), 1.0 / FINE)

    def integral(self, x):
        return np.concatenate([[0.0], np.cumsum(0.5 * (x[1:] + x[:-1]) / FINE)])

    @cached_property
    def motion(self):
        """Velocity (n, 3) north, east, down; attitude (n, 4); own speed of the rear axle."""
        t, road = self.time, self.road
        push = sum(v * pulse(t, a, n) for a, n, v in road.pushes)
        turn = np.radians(sum(v * pulse(t, a, n) for a, n, v in road.bends))
        speed = road.speed + self.integral(push)
        spin = self.integral(np.radians(SPIN) * pulse(t, 0.0, PULSE))
        heading = np.radians(70.0) + self.integral(turn + spin)
        pitch = np.radians(road.squat_deg) * push
        slip = np.radians(road.slip_deg - road.slip_slope_deg * speed * turn)
        q = rotation.quaternion_from_euler(
            np.degrees(np.column_stack([np.zeros_like(t), pitch, heading]))
        )
        course = heading - self.integral(spin) + slip
        level = np.column_stack([speed * np.cos(course), speed * np.sin(course), 0.0 * t])
        # The reference point is ahead of the axle; in the crash it is pushed itself.
        arm = rotation.rotate(q, -np.array(AXLE))
        turned = np.where(t < 0.0, turn, 0.0)
        level += np.cross(np.column_stack([0 * t, 0 * t, turned]), arm)
        at = int(np.searchsorted(t, 0.0))
        C = rotation.dcm_from_quaternion(q[at])
        change = C @ np.array([*DELTA_V, 0.0])
        level += self.integral(pulse(t, 0.0, PULSE))[:, None] * change
        return level, q, speed

    @cached_property
    def place(self):
        velocity = self.motion[0]
        moved = np.column_stack([self.integral(v) for v in velocity.T])
        return geodetic_from_ned(moved[:: round(FINE / 20)], ORIGIN)

    @cached_property
    def ideal(self):
        """Rate and specific force of the reference point at the recorder's stamps."""
        t, (velocity, q, _) = self.time, self.motion
        earth = earth_rate(ORIGIN[0], ellipsoid=WGS84)
        lat = np.radians(ORIGIN[0])
        radius = 6.38e6
        over = np.column_stack(
            [
                velocity[:, 1] / radius,
                -velocity[:, 0] / radius,
                -velocity[:, 1] * np.tan(lat) / radius,
            ]
        )
        pushed = np.gradient(velocity, t, axis=0) + np.cross(2.0 * earth + over, velocity)
        pushed[:, 2] -= gravity()
        back = rotation.conjugate(q)
        step = rotation.compose(rotation.conjugate(q[:-2]), q[2:])
        rate = rotation.rotation_vector_from_quaternion(step) * (0.5 * FINE)
        rate = np.vstack([rate[:1], rate, rate[-1:]]) + rotation.rotate(back, earth + over)
        return rate, rotation.rotate(back, pushed)

    def delta_v(self):
        """Change of velocity along the turning axes over `OVER`, m/s, without gravity."""
        t, (velocity, q, _) = self.time, self.motion
        pushed = rotation.rotate(rotation.conjugate(q), np.gradient(velocity, t, axis=0))
        within = (t >= OVER[0]) & (t <= OVER[1])
        return pushed[within].sum(axis=0) / FINE


def gravity():
    """At the drive, m/s²."""
    return float(np.linalg.norm(normal_gravity(ORIGIN[0], ORIGIN[2])))


#: A range of 50 g whose data sheet has a nonlinearity, and a gyro of 300 deg/s.
ACCEL = TriadUncertainty(
    noise_density=0.02,
    bias=0.3,
    scale=0.02,
    misalignment=0.003,
    nonlinearity_2=0.003,
    full_scale=490.0,
)
GYRO = TriadUncertainty(noise_density=3e-4, bias=0.01, scale=0.01, misalignment=0.003)
MOUNTING_SD = 3.0  # deg


@dataclass(frozen=True)
class Draw:
    """Errors of one recorder, as the truth less the reading would have them."""

    unit: CrashUnit
    fixes: pd.DataFrame
    speeds: pd.DataFrame
    truth: dict


def drawn(
    drive,
    seed,
    *,
    vibration=0.5,
    drift=0.0,
    turned=0.0,
    tires=None,
    delay=None,
    mounting_sd=MOUNTING_SD,
):
    """A recorder with errors from its stated uncertainty, fixes and speeds of one drive.

    `turned`, deg: heading of the unit as the case states it; `tires`, `delay`: of the speeds
    instead of drawn ones; `drift`, m/s² and a hundredth of it in rad/s, over the drive.
    """
    g = np.random.default_rng(seed)
    rate, force = drive.ideal
    t = drive.time
    arm = np.array(UNIT)
    alpha = np.gradient(rate, t, axis=0)
    force = force + np.cross(alpha, arm) + np.cross(rate, np.cross(rate, arm))
    # Vibration of floor and engine between 15 and 40 Hz.
    white = g.standard_normal((len(t), 3))
    fast = sosfilt(butter(2, [15.0, 40.0], "band", fs=FINE, output="sos"), white, axis=0)
    force = force + vibration * fast / fast.std()
    rows = slice(None, None, round(FINE / RATE))
    time, rate, force = t[rows], rate[rows], force[rows]
    angles = np.radians(mounting_sd) * g.standard_normal(3)
    stated = Mounting(UNIT, (0.0, 0.0, turned), 0.0, mounting_sd)
    true_C = rotation.dcm_from_rotation_vector(angles) @ stated.C_vs
    tables, errors = [], {"mounting": angles}
    for name, unknown, own in (("gyro", GYRO, rate @ true_C), ("accel", ACCEL, force @ true_C)):
        bias, scale, bend = (
            g.standard_normal(3) * unknown.axis(k) for k in ("bias", "scale", "nonlinearity_2")
        )
        cross = g.standard_normal((3, 3)) * np.array(unknown.axis("misalignment"))[:, None]
        np.fill_diagonal(cross, 0.0)
        noise = g.standard_normal(own.shape) * unknown.axis("noise_density") * np.sqrt(RATE)
        far = np.where(np.isfinite(unknown.full_scale), unknown.full_scale, 1.0)
        size = drift * (0.01 if name == "gyro" else 1.0)
        wander = size * g.standard_normal(3) * ((time - time[0]) / -time[0])[:, None]
        read = own * (1.0 + scale) + own @ cross.T + bend * own**2 / far + bias + noise + wander
        tables.append(
            pd.DataFrame(
                read,
                index=pd.Index(time, name="time"),
                columns=[f"{name}_{axis}" for axis in "xyz"],
            )
        )
        tables[-1].attrs["sampling"] = "instantaneous"
        errors |= {f"{name} bias": bias + wander[-1], f"{name} scale": scale}
    unit = CrashUnit(
        "box",
        (RecordedTriad(tables[1], ACCEL, "accelerometer"),),
        RecordedTriad(tables[0], GYRO, "gyro"),
        stated,
        trigger=0.0,
    )
    return Draw(unit, fixes_of(drive, g), speeds_of(drive, g, tires, delay), errors)


def fixes_of(drive, g, rate=2.0, noise=0.05):
    """Fixes until the impact."""
    velocity, q, _ = drive.motion
    omega, _ = drive.ideal
    rows = np.arange(0, int(drive.road.length * FINE), round(FINE / rate))
    arm = np.array(ANTENNA)
    moving = velocity[rows] + rotation.rotate(q[rows], np.cross(omega[rows], arm))
    place = drive.place[rows // round(FINE / 20)]
    place = geodetic_of(rotation.rotate(q[rows], arm), place)
    wander = 1.0 * g.standard_normal(3)
    place = geodetic_of(wander + 0.3 * g.standard_normal(place.shape), place)
    return gnss_table(
        drive.time[rows],
        place,
        moving + noise * g.standard_normal(moving.shape),
        (1.05,) * 3,
        (noise,) * 3,
        source="fixes.csv",
    )


def geodetic_of(ned, place):
    """Positions moved by some meters, (n, 3)."""
    return np.array([geodetic_from_ned(m, p) for m, p in zip(ned, place, strict=True)])


def speeds_of(drive, g, tires=None, delay=None, rate=20.0, step=0.03):
    """Speeds of a bus, rounded to 0.1 km/h, until the impact."""
    _, _, speed = drive.motion
    tires = 0.02 * g.standard_normal() if tires is None else tires
    delay = 0.1 + 0.05 * g.standard_normal() if delay is None else delay
    stamps = np.arange(-drive.road.length + 0.5, 0.3, 1.0 / rate)
    shown = (1.0 + tires) * np.interp(stamps - delay, drive.time, speed)
    shown = step * np.round((shown + 0.02 * g.standard_normal(len(stamps))) / step)
    return pd.DataFrame({"speed": shown}, index=pd.Index(stamps, name="time"))


PRIORS = {
    "tilt_sd_deg": 5.0,
    "side_slip_sd_deg": 0.5,
    "slip_slope_sd_deg": 0.5,
    "pitch_slip_sd_deg": 1.0,
    "pitch_slope_sd_deg": 0.2,
    "no_slip_point": AXLE,
    "no_slip_point_sd": 0.1,
    "position_correlation": FixCorrelation(0.9, 60.0),
}


def reconstructed(draw, by, window=40.0, **priors):
    """Unit with the drive, `by` its fixes, speeds or both; and its state."""
    own = synchronise([draw.unit], rate=RATE).units[0]
    given = DriveEntry(
        draw.fixes if by in ("fixes", "both") else None,
        window=window,
        antenna=ANTENNA,
        priors=PRIORS | priors,
        speeds=draw.speeds if by in ("speeds", "both") else None,
        speed_sd=0.03,
    )
    options = Preparation(gravity=gravity(), stood=given.stood())
    at = at_point(prepare_unit(own.unit, options), (0.0, 0.0, 0.0), time_sd=own.time_sd)
    return start_from_drive(at, given, (0.0, 0.0, 0.0))


def answer(at, entry):
    """Reconstruction of the corrected unit."""
    return reconstruct_unit(at, entry, CrashOptions(window=(-0.05, 0.3), gravity=gravity()))
