"""How the vehicle moved at one instant before or at the impact: where a path is tied to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError
from strapdown.sensors.triad_numbers import finite, triple

Array = NDArray[np.float64]
Triple = tuple[float, float, float]
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
    """Velocity, heading and place at an instant, and how they are known.

    The place of the reference point at that instant is the origin of the path, and without error.

    Attributes
    ----------
    time : float, s
        From the common trigger.
    velocity : tuple of float, m/s
        North, east, down, of the reference point.
    heading_deg : float, deg
        Of the vehicle, clockwise from north. Where the path is told in axes of the vehicle at
        the entry, zero: "north" is then forward at the entry, "east" right of it.
    unknowns : tuple of (name, contributor, nine or fifteen numbers)
        What one standard deviation of each independent unknown does to attitude (rotation vector
        in local level, rad), velocity (m/s) and place (m); and, for what was estimated with them,
        to every sample of the rates (rad/s) and of the specific force (m/s²), vehicle axes.
    attitude_deg : tuple of float, deg, optional
        Roll and pitch at that instant, where they are known from elsewhere than the rest.
    lat_deg, lon_deg, alt : float, deg, m
        Of the origin; they matter to gravity alone.
    source : str
        Where the velocity is from, for a report.

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
        """Make one of a speed over ground along the vehicle.

        Parameters
        ----------
        speed, speed_sd : float, m/s
            Horizontal; negative for a vehicle that rolls backward.
        time : float, s
        heading_deg, heading_sd_deg : float, deg
            Zero without uncertainty, where the path is told in axes of the entry.
        slip_deg, slip_sd_deg : float, deg
            Direction of travel less heading, clockwise.
        climb_sd : float, m/s
            Of the vertical velocity, which is taken as zero.
        **others
            Attributes of the class.

        Raises
        ------
        ConfigError
            A number is not finite, a standard deviation is negative, or the speed is no speed of
            a road vehicle (more than 150 m/s).
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
            if name not in OTHERS:
                raise ConfigError(
                    "crash.entry-no", quantity="entry", name=name, word=name, known=OTHERS
                )
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

    @classmethod
    def from_covariance(
        cls,
        time: float,
        velocity: Sequence[float],
        roll_pitch_heading: Sequence[float],
        covariance: Array,
        *,
        contributor: str = "entry state",
        **others: Any,
    ) -> Entry:
        """Make one of a state with a joint covariance, as an estimator gives it.

        Parameters
        ----------
        time : float, s
        velocity : sequence of float, (3,), m/s
        roll_pitch_heading : sequence of float, (3,), deg
        covariance : ndarray, (6, 6)
            Of the rotation vector in local level, rad, and of the velocity, m/s.
        contributor : str
        **others
            Attributes of the class.

        Raises
        ------
        ConfigError
            The covariance is not symmetric or not positive.
        """
        given = np.asarray(covariance, dtype=np.float64)
        if given.shape != (6, 6) or not np.allclose(given, given.T, rtol=1e-9, atol=0.0):
            raise ConfigError("crash.no-symmetric-matrix-x", quantity="covariance")
        values, vectors = np.linalg.eigh(given)
        if values[0] < -1e-9 * values[-1]:
            raise ConfigError(
                "crash.covariance-not-positive", quantity="covariance", values=values[0]
            )
        columns = vectors * np.sqrt(np.maximum(values, 0.0))
        roll, pitch, heading = triple(
            roll_pitch_heading, "roll_pitch_heading", "sensors.angles-not-three-numbers"
        )
        north, east, down = triple(velocity, "velocity", "crash.velocity-not-three-numbers")
        return cls(
            time=time,
            velocity=(north, east, down),
            heading_deg=heading,
            unknowns=tuple(
                (f"{contributor} {k + 1}", contributor, (*columns[:, k].tolist(), 0.0, 0.0, 0.0))
                for k in range(6)
                if columns[:, k].any()
            ),
            attitude_deg=(roll, pitch),
            **others,
        )


def _times(size: float, direction: Triple) -> Triple:
    return (size * direction[0], size * direction[1], size * direction[2])
