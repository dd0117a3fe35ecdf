"""What goes wrong with a satellite receiver, put into a Gnss table."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import ConfigError
from strapdown.sensors.error_draws import child
from strapdown.simulation.gnss import moved_places
from strapdown.tables import GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD
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
