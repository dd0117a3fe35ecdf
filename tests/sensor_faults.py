"""Faults of single sensor channels, injected into an Imu table."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from strapdown.sensors.error_chain import child

# Key in the seed tree, beside those of the triads and of a unit's draws.
FAULT_SEED = 3


@dataclass(frozen=True)
class SensorFault:
    """A fault of one channel over the samples from `begin` to before `end`, s."""

    channel: str
    begin: float = -math.inf
    end: float = math.inf

    def broken(self, values, generator):
        raise NotImplementedError


@dataclass(frozen=True)
class Stuck(SensorFault):
    """Stuck at the reading at the start of the fault."""

    def broken(self, values, generator):
        return np.full_like(values, values[0])


@dataclass(frozen=True)
class Dead(SensorFault):
    """Output is exactly zero."""

    def broken(self, values, generator):
        return np.zeros_like(values)


@dataclass(frozen=True)
class DropOut(SensorFault):
    """Missing output: NaN."""

    def broken(self, values, generator):
        return np.full_like(values, math.nan)


@dataclass(frozen=True)
class Jump(SensorFault):
    """Bias jump by `size`."""

    size: float = 0.0

    def broken(self, values, generator):
        return values + self.size


@dataclass(frozen=True)
class Noisy(SensorFault):
    """Added white noise of standard deviation `sd`."""

    sd: float = 0.0

    def broken(self, values, generator):
        return values + self.sd * generator.standard_normal(values.size)


@dataclass(frozen=True)
class Saturated(SensorFault):
    """Output clipped to ± `limit`."""

    limit: float = math.inf

    def broken(self, values, generator):
        return np.clip(values, -self.limit, self.limit)


@dataclass(frozen=True)
class Burst(SensorFault):
    """A share of the samples off by `size`, to either side."""

    size: float = 0.0
    share: float = 0.2

    def broken(self, values, generator):
        struck = generator.random(values.size) < self.share
        sign = np.where(generator.random(values.size) < 0.5, -1.0, 1.0)
        return values + self.size * sign * struck


def inject_faults(imu, faults, *, seed=0):
    """Inject faults into channels of an Imu table, in order, each with its own random stream."""
    out = imu.copy()
    out.attrs = dict(imu.attrs)
    time = out.index.to_numpy(dtype=np.float64)
    for k, fault in enumerate(faults):
        within = (time >= fault.begin) & (time < fault.end)
        assert within.any()
        values = out[fault.channel].to_numpy(dtype=np.float64).copy()
        generator = np.random.Generator(np.random.PCG64(child(seed, FAULT_SEED, k)))
        values[within] = fault.broken(values[within], generator)
        out[fault.channel] = values
    return out
