"""A satellite receiver that rides on a motion, and what a crash does to it."""

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

#: What a receiver does beyond its limits: gives no fix, gives false ones, or bears it.
ON_EXCESS = ("lost", "garbage", "unaffected")

# Streams below the seed of the receiver. A number is never given to another.
_POSITION, _DRIFT, _VELOCITY, _FALSE = range(4)
# What the tracking loops have in mind, s: acceleration and jerk are means over it.
LOOP_MEMORY = 0.05
# So finely the motion is searched for what is beyond the limits, s.
_SEARCH = 0.005
# Standard deviations of the fixes of a receiver that has lost its way.
FALSE_POSITION, FALSE_VELOCITY = 100.0, 30.0  # m, m/s
_MOST_FIXES = 1_000_000


@dataclass(frozen=True)
class GnssReceiver:
    """What a receiver does to the truth. Triads are north, east, down.

    Attributes
    ----------
    rate : float, Hz
        Of fixes, 1 to 10 usually.
    position_noise : triad, m
        Standard deviation, new with each fix.
    position_drift : triad, m
        Standard deviation of a stationary Gauss-Markov process: orbits, clocks, atmosphere.
    correlation_time : float, s
        Of that process.
    velocity_noise : triad, m/s
    antenna : triad, m
        In body axes, from the point that the motion describes.
    time_offset : float, s
        A fix that is stamped t is of the instant ``t - time_offset``.
    largest_acceleration : float, m/s²
    largest_jerk : float, m/s³
        Of the antenna, as means over 50 ms, the memory of tracking loops.
    on_excess : {'lost', 'garbage', 'unaffected'}
        What comes of the fixes from the first instant beyond a limit until `outage` after the
        last: none; false ones, with the usual claims of precision; or fixes as ever.
    outage : float, s
    stated_position_sd, stated_velocity_sd : triad, optional
        What the receiver claims; where it is left out, the truth.

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
    """Fixes of a receiver over a motion.

    Parameters
    ----------
    motion : EarthMotion
    receiver : GnssReceiver
    seed : int or SeedSequence
        Of everything that is random. What a seed draws for a fix does not depend on whether
        others were lost.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        Gnss table; fixes fall on the instants ``k / rate`` within the motion.

    Raises
    ------
    ConfigError
        There is no more than a fix, or there are too many.
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
    """Return places that are wrong by metres north, east, down, (n, 3)."""
    from strapdown.earth import radii_of_curvature

    meridian, transverse = radii_of_curvature(place[:, 0], ellipsoid=ellipsoid)
    out = place.copy()
    out[:, 0] += np.degrees(off[:, 0] / (meridian + place[:, 2]))
    parallel = (transverse + place[:, 2]) * np.cos(np.radians(place[:, 0]))
    out[:, 1] += np.degrees(off[:, 1] / parallel)
    out[:, 2] -= off[:, 2]
    return out


def _beyond(motion: EarthMotion, receiver: GnssReceiver, instants: Array) -> NDArray[np.bool_]:
    """Fixes within reach of an instant beyond the limits."""
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


# What goes wrong with a satellite receiver, put into a Gnss table.

Flags = NDArray[np.bool_]

# Place in the tree of seeds, beside those of a receiver's own streams.
FAULT_SEED = 4


@dataclass(frozen=True)
class GnssFault(ABC):
    """A failure of a receiver over an interval; its kinds are the classes of this module.

    Attributes
    ----------
    begin, end : float, s
        Fixes from the one, included, to the other, excluded.

    Raises
    ------
    ConfigError
        The interval is none, or a number is out of range.
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
        """Return the table with the fault in the rows that are marked; those given are left."""

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
    """It gives no fixes: their rows are missing."""

    def broken(
        self, table: pd.DataFrame, within: Flags, random: np.random.Generator
    ) -> pd.DataFrame:
        """As `GnssFault.broken`."""
        return table[~within]


@dataclass(frozen=True)
class Outliers(GnssFault):
    """Some of its fixes are far off, in a direction of their own, as by reflected signals.

    Attributes
    ----------
    share : float
        Of the fixes, each by chance.
    size : float
        In stated standard deviations, of every component of the place.
    velocity_size : float
        The same of the velocity.
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
    """Its places go away slowly, from nothing at the begin, as where it is misled.

    Attributes
    ----------
    rate : tuple of float, (3,), m/s
        North, east, down; the velocity that it states is not touched.
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
    """It repeats the fix that it had, place, velocity and precision, with stamps that go on."""

    def broken(
        self, table: pd.DataFrame, within: Flags, random: np.random.Generator
    ) -> pd.DataFrame:
        """As `GnssFault.broken`."""
        out = table.copy()
        out.loc[within, :] = table.to_numpy()[int(np.flatnonzero(within)[0])]
        return out


@dataclass(frozen=True)
class WrongSd(GnssFault):
    """What it states of its precision is not so.

    Attributes
    ----------
    position_factor, velocity_factor : float
        By which the standard deviations are multiplied: a third where it is three times as bad as
        it says.
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
    """Put failures into a Gnss table.

    Parameters
    ----------
    table : DataFrame
        It is left as it is.
    faults : sequence of GnssFault
        In order: a later one acts on what an earlier one left.
    seed : int
        Of what is random; each fault has a stream of its own.

    Returns
    -------
    DataFrame

    Raises
    ------
    ConfigError
        There is no fix within an interval, or an outage leaves none.
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
    """Nothing where nothing was measured."""
    return np.where(np.isfinite(sd), sd, 0.0)
