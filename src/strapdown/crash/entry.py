"""Entry state: motion of the vehicle at one instant before or at the impact."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown.constants import Triple
from strapdown.errors import ConfigError, Finding, check_choice
from strapdown.nav_state import NavState
from strapdown.sensors.triad_errors import finite, triple
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import Array

NUMBERS = (
    ("time", "s"),
    ("heading_deg", "deg"),
    ("lat_deg", "deg"),
    ("lon_deg", "deg"),
    ("alt", "m"),
)
OTHERS = ("attitude_deg", "lat_deg", "lon_deg", "alt", "source")


@dataclass(frozen=True, eq=False)
class Entry:
    """Velocity, heading and position at an instant, with their uncertainty.

    The position of the reference point at that instant is the origin of the path, without error.

    Attributes
    ----------
    time : float, s
        From the common trigger.
    velocity : tuple of float, m/s
        North, east, down, of the reference point.
    heading_deg : float, deg
        Of the vehicle, clockwise from north. Zero where the path is expressed in axes of the
        vehicle at the entry: "north" is then forward at the entry, "east" right.
    unknowns : tuple of (name, contributor, nine numbers)
        Effect of one standard deviation of each independent unknown on attitude (rotation vector
        in local level, rad), velocity (m/s) and position (m). One that has the name of an unknown
        of the samples is that unknown.
    attitude_deg : tuple of float, deg, optional
        Roll and pitch at that instant, where known from a source other than leveling.
    lat_deg, lon_deg, alt : float, deg, m
        Of the origin; used only for gravity.
    source : str
        Source of the velocity, for a report.

    Raises
    ------
    ConfigError
        The velocity is not three finite numbers, or another number is not finite.
    """

    time: float
    velocity: Triple
    heading_deg: float
    unknowns: tuple[tuple[str, str, tuple[float, ...]], ...] = ()
    attitude_deg: tuple[float, float] | None = None
    lat_deg: float = 45.0
    lon_deg: float = 0.0
    alt: float = 0.0
    source: str = "stated"

    def __post_init__(self) -> None:
        code = "crash.velocity-not-three-numbers"
        object.__setattr__(self, "velocity", triple(self.velocity, "velocity", code))
        for name, unit in NUMBERS:
            if not finite(getattr(self, name)):
                raise ConfigError(
                    "crash.entry-not-a-number",
                    quantity=f"entry, {name}",
                    value=getattr(self, name),
                    unit=unit,
                )

    @classmethod
    def from_speed(
        cls,
        speed: float,
        speed_sd: float,
        *,
        time: float = 0.0,
        heading_deg: float = 0.0,
        heading_sd_deg: float = 0.0,
        slip_deg: float = 0.0,
        slip_sd_deg: float = 0.0,
        climb_sd: float = 0.0,
        **others: Any,
    ) -> Entry:
        """Create an entry from a speed over ground along the vehicle.

        Parameters
        ----------
        speed, speed_sd : float, m/s
            Horizontal; negative for a vehicle that rolls backward.
        time : float, s
        heading_deg, heading_sd_deg : float, deg
            Zero without uncertainty, where the path is expressed in axes of the entry.
        slip_deg, slip_sd_deg : float, deg
            Direction of travel minus heading, clockwise.
        climb_sd : float, m/s
            Of the vertical velocity, which is taken as zero.
        **others
            Attributes of the class.

        Raises
        ------
        ConfigError
            A number is not finite, a standard deviation is negative, or the speed exceeds
            150 m/s, which is not possible for a road vehicle.
        """
        numbers = {
            "speed": speed,
            "speed_sd": speed_sd,
            "time": time,
            "heading_deg": heading_deg,
            "heading_sd_deg": heading_sd_deg,
            "slip_deg": slip_deg,
            "slip_sd_deg": slip_sd_deg,
            "climb_sd": climb_sd,
        }
        for name, value in numbers.items():
            if not finite(value) or (value < 0.0 and name.split("_deg")[0].endswith("sd")):
                raise ConfigError("crash.not-possible", quantity=f"entry, {name}", value=value)
        if abs(speed) > 150.0:
            raise ConfigError("crash.no-speed-road-vehicle", quantity="entry, speed", speed=speed)
        for name in others:
            check_choice("crash.entry-no", OTHERS, quantity="entry", name=name)
        course = math.radians(heading_deg + slip_deg)
        along = (math.cos(course), math.sin(course), 0.0)
        across = (-math.sin(course), math.cos(course), 0.0)
        turned, slipped = math.radians(heading_sd_deg), math.radians(slip_sd_deg)
        unknowns = [
            ("entry speed", "entry speed", (0.0, 0.0, 0.0, *_times(speed_sd, along), 0, 0, 0)),
            ("entry slip", "entry direction", (0, 0, 0, *_times(slipped * speed, across), 0, 0, 0)),
            ("entry climb", "entry direction", (0.0, 0.0, 0.0, 0.0, 0.0, climb_sd, 0, 0, 0)),
            ("heading", "heading", (0, 0, turned, *_times(turned * speed, across), 0, 0, 0)),
        ]
        return cls(
            time=time,
            velocity=_times(speed, along),
            heading_deg=heading_deg,
            unknowns=tuple((a, b, c) for a, b, c in unknowns if any(c)),
            **others,
        )


def _times(size: float, direction: Triple) -> Triple:
    return (size * direction[0], size * direction[1], size * direction[2])


# Vehicle state at the impact, with covariance and the fixes used.


#: Slices of the covariance: m north, east, down; m/s north, east, down; rad about north, east,
#: down; rad/s and m/s² of the biases, forward, right, down.
POSITION, VELOCITY, ATTITUDE = slice(0, 3), slice(3, 6), slice(6, 9)
GYRO_BIAS, ACCEL_BIAS = slice(9, 12), slice(12, 15)
STATES = 15


# An unknown that a drive leaves less certain than this, of what was stated, was not determined.
NARROWED = 0.9


def determined(what: Mapping[Any, Any]) -> bool:
    """Whether the drive determined the error of a row of `EntryState.calibration`."""
    return bool(what["sd"] <= NARROWED * what["stated"])


@dataclass(frozen=True, eq=False)
class EntryState:
    """Position, velocity, attitude and biases at an instant, from earlier fixes.

    Attributes
    ----------
    state : NavState
        Of the vehicle's reference point, at a sample of the Imu table.
    gyro_bias, accel_bias : triple, rad/s, m/s²
        Excess of the Imu table at `mean_rate` and `mean_specific_force` of the window, with the
        effect of scale, misalignment and g-sensitivity there. To be subtracted from the table.
    covariance : ndarray, (15, 15)
        Of `POSITION`, `VELOCITY`, `ATTITUDE`, `GYRO_BIAS`, `ACCEL_BIAS`; attitude as the rotation
        vector phi about north, east, down of ``C_true = exp([phi x]) C_estimate``.
    fixes : DataFrame
        Every fix from the beginning of the window on, by its stamp: ``used``, ``why`` it was
        rejected or down-weighted, weights from 0 to 1 and misfits of position and velocity:
        difference from the prediction by all others in standard deviations (NaN where not measured
        or not used).
    chi_square, degrees_of_freedom : float, int
        Of the residuals of all used fixes, with their weights, and the priors.
    speeds : DataFrame or None
        Every speed, as `fixes`; of a drive without fixes `fixes` has the speeds, too.
    calibration : DataFrame or None
        Of a unit of a crash: what the drive shows of its errors, one row for each ``quantity``
        (`Parameter.quantity`, or ``speed scale``, ``speed delay``), ``axis`` (0 to 2) and ``of``:
        ``error``, what the sensor reads too much, relatively for a scale, or the angle by which
        the unit is turned about an axis of the vehicle beyond its stated angles; ``sd``;
        ``stated``, the standard deviation before the drive; ``in_crash``, that which the crash is
        given. SI, rad.
    """

    state: NavState
    gyro_bias: Triple
    accel_bias: Triple
    covariance: Array = field(repr=False)
    mean_rate: Triple
    mean_specific_force: Triple
    fixes: pd.DataFrame = field(repr=False)
    chi_square: float
    degrees_of_freedom: int
    iterations: int
    findings: tuple[Finding, ...] = ()
    speeds: pd.DataFrame | None = field(default=None, repr=False)
    calibration: pd.DataFrame | None = field(default=None, repr=False)

    @property
    def sd(self) -> Array:
        """Standard deviations of the 15 states, (15,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def speed(self) -> float:
        """Length of the velocity, m/s."""
        return float(np.linalg.norm(self.state.v_n))

    @property
    def speed_sd(self) -> float:
        """Standard deviation of the speed, m/s; when stationary, the largest of any direction."""
        block = self.covariance[VELOCITY, VELOCITY]
        if self.speed == 0.0:
            return float(np.sqrt(np.linalg.eigvalsh(block)[-1]))
        along = self.state.v_n / self.speed
        return float(np.sqrt(along @ block @ along))

    @property
    def course_sd_deg(self) -> float:
        """Standard deviation of the course, deg; infinite when stationary."""
        north, east, _ = self.state.v_n
        level = math.hypot(north, east)
        if level == 0.0:
            return math.inf
        across = np.array([-east, north, 0.0]) / level
        return math.degrees(
            math.sqrt(across @ self.covariance[VELOCITY, VELOCITY] @ across) / level
        )

    @property
    def roll_pitch_heading(self) -> Array:
        """Attitude, (3,), deg."""
        return self.state.roll_pitch_heading

    @property
    def roll_pitch_heading_sd(self) -> Array:
        """Standard deviations of these angles to first order, (3,), deg; not near a pitch of 90."""
        block = self.covariance[ATTITUDE, ATTITUDE]
        return np.asarray(angles_sd(self.state.roll_pitch_heading[None], block[None])[0])


def biases_off(imu: pd.DataFrame, gyro_bias: Array, accel_bias: Array) -> pd.DataFrame:
    """Return a copy of an Imu table less biases in rad/s and m/s²."""
    out = imu[[*GYRO, *ACCEL]] - np.concatenate([gyro_bias, accel_bias])
    out.attrs = dict(imu.attrs)
    return out


def rotated(q_nb: Array, phi: Array) -> Array:
    """Attitude rotated by a rotation vector in local level axes."""
    return rotation.compose(rotation.quaternion_from_rotation_vector(phi), q_nb)


# Effect of a small rotation in local level on roll, pitch and heading.


def angle_rates(roll_pitch_heading: ArrayLike) -> Array:
    """Matrices, (n, 3, 3), from a small rotation vector in local level to changes of the angles.

    Of roll, pitch, heading, (n, 3), deg, for ``C' = (I + [phi x]) C``. Infinite at a pitch of 90
    deg.
    """
    angles = np.radians(np.asarray(roll_pitch_heading, dtype=np.float64))
    pitch, heading = angles[:, 1], angles[:, 2]
    c, s = np.cos(heading), np.sin(heading)
    out = np.zeros((len(angles), 3, 3))
    out[:, 0, 0], out[:, 0, 1] = c / np.cos(pitch), s / np.cos(pitch)
    out[:, 1, 0], out[:, 1, 1] = -s, c
    out[:, 2, 0], out[:, 2, 1] = c * np.tan(pitch), s * np.tan(pitch)
    out[:, 2, 2] = 1.0
    return out


def angles_sd(roll_pitch_heading: ArrayLike, covariance: Array) -> Array:
    """Standard deviations of the angles, (n, 3), deg, to first order.

    From the covariance, (n, 3, 3), rad², of the rotation vector in local level.
    """
    rates = angle_rates(roll_pitch_heading)
    turned = np.einsum("nij,njk,nlk->nil", rates, covariance, rates)
    return np.asarray(np.degrees(np.sqrt(np.diagonal(turned, axis1=1, axis2=2))))
