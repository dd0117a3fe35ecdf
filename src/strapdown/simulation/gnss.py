"""Simulated GNSS receiver on a motion, and its response to a crash."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.earth import radii_of_curvature
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import ConfigError
from strapdown.frames import antenna_motion
from strapdown.sensors.error_chain import Seed, child, gauss_markov, normal
from strapdown.sensors.triad_errors import ZERO, Triad, TriadLike
from strapdown.simulation.earth_motion import EarthMotion
from strapdown.tables import GEODETIC, VELOCITY, gnss_table
from strapdown.tables.checks import Array

#: Response of a receiver beyond its limits: no fixes, false fixes, or no effect.
ON_EXCESS = ("lost", "garbage", "unaffected")

# Stream keys below the receiver's seed. A number is never reused.
_POSITION, _DRIFT, _VELOCITY, _FALSE = range(4)
# Memory of the tracking loops, s: acceleration and jerk are averaged over it.
LOOP_MEMORY = 0.05
# Step of the search for instants beyond the limits, s.
_SEARCH = 0.005
# Standard deviations of the false fixes.
FALSE_POSITION, FALSE_VELOCITY = 100.0, 30.0  # m, m/s
_MOST_FIXES = 1_000_000


@dataclass(frozen=True)
class GnssReceiver:
    """Error model of a GNSS receiver. Triads are north, east, down.

    Attributes
    ----------
    rate : float, Hz
        Fix rate, usually 1 to 10.
    position_noise : triad, m
        Standard deviation, independent for each fix.
    position_drift : triad, m
        Standard deviation of a stationary Gauss-Markov process: orbits, clocks, atmosphere.
    correlation_time : float, s
        Correlation time of that process.
    velocity_noise : triad, m/s
    antenna : triad, m
        In body axes, from the motion's reference point.
    time_offset : float, s
        A fix stamped t is valid at ``t - time_offset``.
    largest_acceleration : float, m/s²
    largest_jerk : float, m/s³
        Limits for the antenna, averaged over 50 ms, the memory of the tracking loops.
    on_excess : {'lost', 'garbage', 'unaffected'}
        Fixes from the first instant beyond a limit until `outage` after the last: none; false fixes
        with the usual stated precision; or unaffected fixes.
    outage : float, s
    stated_position_sd, stated_velocity_sd : triad, optional
        Standard deviations that the receiver states; default, the true ones.
    """

    rate: float = 10.0
    position_noise: TriadLike = ZERO
    position_drift: TriadLike = ZERO
    correlation_time: float = 60.0
    velocity_noise: TriadLike = ZERO
    antenna: TriadLike = ZERO
    time_offset: float = 0.0
    largest_acceleration: float = 50.0
    largest_jerk: float = 20.0
    on_excess: str = "lost"
    outage: float = 2.0
    stated_position_sd: TriadLike | None = None
    stated_velocity_sd: TriadLike | None = None

    def __post_init__(self) -> None:
        if self.on_excess not in ON_EXCESS:
            raise ConfigError(
                "simulation.nothing-receiver-does",
                quantity="on_excess",
                on_excess=self.on_excess,
                on_excess_2=ON_EXCESS,
            )
        for f in fields(self):
            given = getattr(self, f.name)
            if f.name == "on_excess" or given is None:
                continue
            triad = not isinstance(f.default, float)
            value = np.atleast_1d(np.asarray(given, dtype=np.float64))
            value = np.repeat(value, 3) if triad and value.size == 1 else value
            if value.shape != ((3,) if triad else (1,)):
                raise ConfigError(
                    "simulation.not-right-shape" if triad else "simulation.not-right-shape-2",
                    quantity=f.name,
                    given=given,
                )
            signed = f.name in ("antenna", "time_offset")
            positive = f.name in ("rate", "correlation_time")
            limit = f.name in ("largest_acceleration", "largest_jerk", "correlation_time")
            if (
                not (np.isfinite(value) | (limit & (value == math.inf))).all()
                or (not signed and (value < 0.0).any())
                or (positive and (value == 0.0).any())
            ):
                raise ConfigError(
                    "simulation.sensor-not-finite"
                    if signed
                    else "simulation.sensor-not-positive"
                    if positive
                    else "simulation.sensor-negative",
                    quantity=f.name,
                    value=given,
                )
            kept = tuple(value.tolist()) if triad else float(value[0])
            object.__setattr__(self, f.name, kept)

    def triad(self, name: str) -> Triad:
        """Return a per-axis attribute as three numbers."""
        value: Triad = getattr(self, name)
        return value


def simulate_gnss(
    motion: EarthMotion,
    receiver: GnssReceiver,
    *,
    seed: Seed = 0,
    source: str | None = None,
) -> pd.DataFrame:
    """Simulate the fixes of a receiver over a motion.

    Parameters
    ----------
    motion : EarthMotion
    receiver : GnssReceiver
    seed : int or SeedSequence
        Seed of all random draws. The draws for a fix do not depend on whether others were lost.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        Gnss table; fixes fall on the instants ``k / rate`` within the motion.

    Raises
    ------
    ConfigError
        The fixes are fewer than two, or too many.
    """
    time = instants(motion, receiver.rate)
    count = len(time)
    place, velocity = motion_of_point(motion, time, receiver.triad("antenna"))
    noise, drift = receiver.triad("position_noise"), receiver.triad("position_drift")
    off = normal(seed, _POSITION, count) * noise
    off += gauss_markov(
        child(seed, _DRIFT),
        np.full(count, 1.0 / receiver.rate),
        drift,
        receiver.correlation_time,
        mean=False,
    )
    fast = normal(seed, _VELOCITY, count) * np.asarray(receiver.triad("velocity_noise"))
    kept = np.ones(count, dtype=np.bool_)
    if receiver.on_excess != "unaffected":
        struck = _beyond(motion, receiver, time)
        if receiver.on_excess == "lost":
            kept = ~struck
        else:
            wild = normal(seed, _FALSE, count, axes=6) * struck[:, None]
            off += FALSE_POSITION * wild[:, :3]
            fast += FALSE_VELOCITY * wild[:, 3:]
    position_sd = receiver.stated_position_sd or tuple(np.hypot(noise, drift))
    velocity_sd = receiver.stated_velocity_sd or receiver.velocity_noise
    measured = moved_places(place, off, motion.ellipsoid)[kept]
    # The longitude of a motion continues beyond a full turn; that of a receiver does not.
    beyond = (measured[:, 1] < -180.0) | (measured[:, 1] >= 360.0)
    measured[beyond, 1] = (measured[beyond, 1] + 180.0) % 360.0 - 180.0
    return gnss_table(
        (time + receiver.time_offset)[kept],
        measured,
        (velocity + fast)[kept],
        position_sd,
        velocity_sd,
        source=source,
    )


def instants(motion: EarthMotion, rate: float) -> Array:
    """Instants ``k / rate`` within a motion, (n,), s; ConfigError if fewer than two or too many."""
    count = math.floor(rate * motion.duration * (1.0 + 1e-12)) + 1
    if not 2 <= count <= _MOST_FIXES:
        raise ConfigError(
            "simulation.hz-gives-fixes",
            quantity="rate",
            rate=rate,
            count=count,
            duration=motion.duration,
            most_fixes=_MOST_FIXES,
        )
    return np.minimum(np.arange(count) / rate, motion.duration)


def motion_of_point(motion: EarthMotion, time: Array, arm: ArrayLike) -> tuple[Array, Array]:
    """Position (deg, deg, m) and velocity (NED, m/s) of a body point, (n, 3) each."""
    truth = motion.trajectory(time)
    return antenna_motion(
        truth[GEODETIC].to_numpy(dtype=np.float64),
        truth[VELOCITY].to_numpy(dtype=np.float64),
        motion.attitude(time),
        motion.rate(time),
        arm,
        ellipsoid=motion.ellipsoid,
    )


def velocity_of_point(motion: EarthMotion, time: Array, arm: ArrayLike) -> Array:
    """Velocity of a body point relative to the Earth, in body axes, (n, 3), m/s."""
    velocity = motion_of_point(motion, time, arm)[1]
    return rotation.rotate(rotation.conjugate(motion.attitude(time)), velocity)


def moved_places(place: Array, off: Array, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Displace positions by meters north, east, down, (n, 3)."""
    meridian, transverse = radii_of_curvature(place[:, 0], ellipsoid=ellipsoid)
    out = place.copy()
    out[:, 0] += np.degrees(off[:, 0] / (meridian + place[:, 2]))
    parallel = (transverse + place[:, 2]) * np.cos(np.radians(place[:, 0]))
    out[:, 1] += np.degrees(off[:, 1] / parallel)
    out[:, 2] -= off[:, 2]
    return out


def _beyond(motion: EarthMotion, receiver: GnssReceiver, instants: Array) -> NDArray[np.bool_]:
    """Mark fixes affected by an instant beyond the limits."""
    per = round(LOOP_MEMORY / _SEARCH)
    time = np.arange(math.floor(motion.duration / _SEARCH) + 1, dtype=np.float64) * _SEARCH
    struck = np.zeros(len(instants), dtype=np.bool_)
    if len(time) <= 2 * per:
        return struck
    _, velocity = motion_of_point(motion, time, receiver.triad("antenna"))
    acceleration = (velocity[per:] - velocity[:-per]) / LOOP_MEMORY
    jerk = (acceleration[per:] - acceleration[:-per]) / LOOP_MEMORY
    excess = np.linalg.norm(acceleration, axis=1) > receiver.largest_acceleration
    excess[per:] |= np.linalg.norm(jerk, axis=1) > receiver.largest_jerk
    for at in time[per:][excess]:
        struck |= (instants >= at) & (instants <= at + receiver.outage)
    return struck
