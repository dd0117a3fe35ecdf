"""Simulated GNSS receiver on a motion, its response to a crash, and injected faults."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import ConfigError
from strapdown.sensors.antenna import antenna_motion
from strapdown.sensors.error_chain import Seed, child, gauss_markov, normal
from strapdown.sensors.triad_errors import ZERO, Triad, TriadLike
from strapdown.simulation.earth_motion import EarthMotion
from strapdown.tables import GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD, gnss_table
from strapdown.tables.checks import index_of, is_number, source_of, values_of

__all__ = [
    "Frozen",
    "GnssFault",
    "GrowingBias",
    "Outage",
    "Outliers",
    "WrongSd",
    "inject_gnss_faults",
]


Array = NDArray[np.float64]

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

    Raises
    ------
    ConfigError
        A number is out of range, or `on_excess` is unknown.
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
    count = math.floor(receiver.rate * motion.duration * (1.0 + 1e-12)) + 1
    if not 2 <= count <= _MOST_FIXES:
        raise ConfigError(
            "simulation.hz-gives-fixes",
            quantity="rate",
            rate=receiver.rate,
            count=count,
            duration=motion.duration,
            most_fixes=_MOST_FIXES,
        )
    instants = np.minimum(np.arange(count) / receiver.rate, motion.duration)
    place, velocity = _antenna(motion, instants, receiver)
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
        struck = _beyond(motion, receiver, instants)
        if receiver.on_excess == "lost":
            kept = ~struck
        else:
            wild = normal(seed, _FALSE, count, axes=6) * struck[:, None]
            off += FALSE_POSITION * wild[:, :3]
            fast += FALSE_VELOCITY * wild[:, 3:]
    position_sd = receiver.stated_position_sd or tuple(np.hypot(noise, drift))
    velocity_sd = receiver.stated_velocity_sd or receiver.velocity_noise
    return gnss_table(
        (instants + receiver.time_offset)[kept],
        moved_places(place, off, motion.ellipsoid)[kept],
        (velocity + fast)[kept],
        position_sd,
        velocity_sd,
        source=source,
    )


def _antenna(motion: EarthMotion, time: Array, receiver: GnssReceiver) -> tuple[Array, Array]:
    truth = motion.trajectory(time)
    return antenna_motion(
        truth[GEODETIC].to_numpy(dtype=np.float64),
        truth[VELOCITY].to_numpy(dtype=np.float64),
        motion.attitude(time),
        motion.rate(time),
        receiver.triad("antenna"),
        ellipsoid=motion.ellipsoid,
    )


def moved_places(place: Array, off: Array, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Displace positions by meters north, east, down, (n, 3)."""
    from strapdown.earth import radii_of_curvature

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
    _, velocity = _antenna(motion, time, receiver)
    acceleration = (velocity[per:] - velocity[:-per]) / LOOP_MEMORY
    jerk = (acceleration[per:] - acceleration[:-per]) / LOOP_MEMORY
    excess = np.linalg.norm(acceleration, axis=1) > receiver.largest_acceleration
    excess[per:] |= np.linalg.norm(jerk, axis=1) > receiver.largest_jerk
    for at in time[per:][excess]:
        struck |= (instants >= at) & (instants <= at + receiver.outage)
    return struck


# GNSS receiver faults injected into a Gnss table.

Flags = NDArray[np.bool_]

# Key in the seed tree, beside those of a receiver's own streams.
FAULT_SEED = 4


@dataclass(frozen=True)
class GnssFault(ABC):
    """A receiver fault over an interval; its kinds are the classes of this module.

    Attributes
    ----------
    begin, end : float, s
        Interval of the fixes, `begin` included, `end` excluded.

    Raises
    ------
    ConfigError
        The interval is empty, or a number is out of range.
    """

    begin: float = -math.inf
    end: float = math.inf

    def __post_init__(self) -> None:
        if not self.begin < self.end:
            raise ConfigError(
                "simulation.fault-lasts-no-time",
                quantity="begin, end",
                begin=self.begin,
                end=self.end,
            )

    @abstractmethod
    def broken(
        self, table: pd.DataFrame, within: Flags, random: np.random.Generator
    ) -> pd.DataFrame:
        """Return the table with the fault applied to the marked rows; the input is not changed."""

    def _checked(self, name: str, low: float, high: float = math.inf) -> None:
        value = getattr(self, name)
        if not (is_number(value) and math.isfinite(value) and low <= value <= high):
            raise ConfigError(
                "simulation.fault-out-of-range"
                if math.isfinite(high)
                else "simulation.fault-below-least",
                quantity=name,
                value=value,
                low=low,
                high=high,
            )


@dataclass(frozen=True)
class Outage(GnssFault):
    """GNSS outage: the rows are removed."""

    def broken(
        self, table: pd.DataFrame, within: Flags, random: np.random.Generator
    ) -> pd.DataFrame:
        """As `GnssFault.broken`."""
        return table[~within]


@dataclass(frozen=True)
class Outliers(GnssFault):
    """Outliers: random fixes are displaced in random directions, as by multipath.

    Attributes
    ----------
    share : float
        Probability that a fix is an outlier.
    size : float
        Position error of every component, in stated standard deviations.
    velocity_size : float
        The same for the velocity.
    """

    share: float = 0.1
    size: float = 50.0
    velocity_size: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self._checked("share", 0.0, 1.0)
        self._checked("size", 0.0)
        self._checked("velocity_size", 0.0)

    def broken(
        self, table: pd.DataFrame, within: Flags, random: np.random.Generator
    ) -> pd.DataFrame:
        """As `GnssFault.broken`."""
        struck = within & (random.random(len(table)) < self.share)
        sign = np.where(random.random((len(table), 6)) < 0.5, -1.0, 1.0) * struck[:, None]
        out = table.copy()
        sd = _finite(values_of(table, POSITION_SD))
        out[GEODETIC] = moved_places(values_of(table, GEODETIC), self.size * sd * sign[:, :3])
        sd = _finite(values_of(table, VELOCITY_SD))
        out[VELOCITY] = values_of(table, VELOCITY) + self.velocity_size * sd * sign[:, 3:]
        return out


@dataclass(frozen=True)
class GrowingBias(GnssFault):
    """Position error that grows linearly from zero at `begin`, as under spoofing.

    Attributes
    ----------
    rate : tuple of float, (3,), m/s
        North, east, down; the stated velocity is unchanged.
    """

    rate: tuple[float, float, float] = (0.1, 0.0, 0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.rate) != 3 or not all(is_number(x) and math.isfinite(x) for x in self.rate):
            raise ConfigError("simulation.no-rate", quantity="rate", rate=self.rate)

    def broken(
        self, table: pd.DataFrame, within: Flags, random: np.random.Generator
    ) -> pd.DataFrame:
        """As `GnssFault.broken`."""
        time = index_of(table)
        since = np.where(within, time - max(self.begin, float(time[0])), 0.0)
        out = table.copy()
        out[GEODETIC] = moved_places(
            values_of(table, GEODETIC), since[:, None] * np.asarray(self.rate)
        )
        return out


@dataclass(frozen=True)
class Frozen(GnssFault):
    """Repeat the last fix: position, velocity and precision are constant while stamps advance."""

    def broken(
        self, table: pd.DataFrame, within: Flags, random: np.random.Generator
    ) -> pd.DataFrame:
        """As `GnssFault.broken`."""
        out = table.copy()
        out.loc[within, :] = table.to_numpy()[int(np.flatnonzero(within)[0])]
        return out


@dataclass(frozen=True)
class WrongSd(GnssFault):
    """Wrong stated precision.

    Attributes
    ----------
    position_factor, velocity_factor : float
        Factors on the stated standard deviations: 1/3 if the true error is three times the stated
        one.
    """

    position_factor: float = 1.0 / 3.0
    velocity_factor: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self._checked("position_factor", 0.0)
        self._checked("velocity_factor", 0.0)

    def broken(
        self, table: pd.DataFrame, within: Flags, random: np.random.Generator
    ) -> pd.DataFrame:
        """As `GnssFault.broken`."""
        out = table.copy()
        for columns, factor in (
            (POSITION_SD, self.position_factor),
            (VELOCITY_SD, self.velocity_factor),
        ):
            out.loc[within, columns] = factor * values_of(table, columns)[within]
        return out


def inject_gnss_faults(
    table: pd.DataFrame, faults: Sequence[GnssFault], *, seed: int = 0
) -> pd.DataFrame:
    """Inject faults into a Gnss table.

    `table`: not changed. `faults`: applied in order: a later fault acts on the output of an earlier
    one. `seed`: seed of the random draws; each fault has its own stream. ConfigError: an interval
    contains no fix, or an outage removes all fixes.
    """
    out = table
    for k, fault in enumerate(faults):
        time = index_of(out)
        within = (time >= fault.begin) & (time < fault.end)
        if not within.any() or (within.all() and isinstance(fault, Outage)):
            raise ConfigError(
                "simulation.outage-of-every-fix" if within.any() else "simulation.no-fix-between",
                file=source_of(table),
                quantity=type(fault).__name__,
                begin=fault.begin,
                end=fault.end,
                time=time[0],
                time_2=time[-1],
            )
        random = np.random.Generator(np.random.PCG64(child(seed, FAULT_SEED, k)))
        out = fault.broken(out, within, random)
        out.attrs = dict(table.attrs)
    return out


def _finite(sd: Array) -> Array:
    """Replace standard deviations that are not finite by zero."""
    return np.where(np.isfinite(sd), sd, 0.0)
