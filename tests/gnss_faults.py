"""Faults of a GNSS receiver, injected into a Gnss table."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from strapdown.sensors.error_chain import child
from strapdown.simulation.gnss import moved_places
from strapdown.tables import GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD
from strapdown.tables.checks import index_of, values_of

# Key in the seed tree, beside those of a receiver's own streams.
FAULT_SEED = 4


@dataclass(frozen=True)
class GnssFault:
    """A receiver fault over the fixes from `begin` to before `end`, s."""

    begin: float = -math.inf
    end: float = math.inf

    def broken(self, table, within, random):
        raise NotImplementedError


@dataclass(frozen=True)
class Outage(GnssFault):
    """GNSS outage: the rows are removed."""

    def broken(self, table, within, random):
        return table[~within]


@dataclass(frozen=True)
class Outliers(GnssFault):
    """Random fixes displaced in random directions, as by multipath.

    `share`: probability that a fix is an outlier. `size`, `velocity_size`: error of every
    component, in stated standard deviations.
    """

    share: float = 0.1
    size: float = 50.0
    velocity_size: float = 0.0

    def broken(self, table, within, random):
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
    """Position error north, east, down that grows by `rate` in m/s from zero, as under spoofing."""

    rate: tuple[float, float, float] = (0.1, 0.0, 0.0)

    def broken(self, table, within, random):
        time = index_of(table)
        since = np.where(within, time - max(self.begin, float(time[0])), 0.0)
        out = table.copy()
        off = since[:, None] * np.asarray(self.rate)
        out[GEODETIC] = moved_places(values_of(table, GEODETIC), off)
        return out


@dataclass(frozen=True)
class Frozen(GnssFault):
    """Repeat the last fix: position, velocity and precision are constant while stamps advance."""

    def broken(self, table, within, random):
        out = table.copy()
        out.loc[within, :] = table.to_numpy()[int(np.flatnonzero(within)[0])]
        return out


@dataclass(frozen=True)
class WrongSd(GnssFault):
    """Stated standard deviations times a factor: 1/3 if the true error is three times them."""

    position_factor: float = 1.0 / 3.0
    velocity_factor: float = 1.0

    def broken(self, table, within, random):
        out = table.copy()
        for columns, factor in (
            (POSITION_SD, self.position_factor),
            (VELOCITY_SD, self.velocity_factor),
        ):
            out.loc[within, columns] = factor * values_of(table, columns)[within]
        return out


def inject_gnss_faults(table, faults, *, seed=0):
    """Inject faults into a Gnss table, in order, each with its own random stream."""
    out = table
    for k, fault in enumerate(faults):
        time = index_of(out)
        within = (time >= fault.begin) & (time < fault.end)
        assert within.any()
        random = np.random.Generator(np.random.PCG64(child(seed, FAULT_SEED, k)))
        out = fault.broken(out, within, random)
        out.attrs = dict(table.attrs)
    return out


def _finite(sd):
    """Replace standard deviations that are not finite by zero."""
    return np.where(np.isfinite(sd), sd, 0.0)
