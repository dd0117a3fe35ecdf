"""Faults of single sensor channels, injected into an Imu table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import ConfigError
from strapdown.sensors.error_chain import child
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import is_number

__all__ = [
    "Burst",
    "Dead",
    "DropOut",
    "Jump",
    "Noisy",
    "Saturated",
    "SensorFault",
    "Stuck",
    "inject_faults",
]

Array = NDArray[np.float64]

CHANNELS = (*GYRO, *ACCEL)
# Key in the seed tree, beside those of the triads and of a unit's draws.
FAULT_SEED = 3


@dataclass(frozen=True)
class SensorFault:
    """A fault of one channel over an interval; its kinds are the classes of this module.

    Attributes
    ----------
    channel : str
        ``gyro_x`` to ``accel_z``.
    begin, end : float, s
        Interval of the samples, `begin` included, `end` excluded.

    Raises
    ------
    ConfigError
        The channel is unknown, or the interval is empty.
    """

    channel: str
    begin: float = -math.inf
    end: float = math.inf

    def __post_init__(self) -> None:
        if self.channel not in CHANNELS:
            raise ConfigError(
                "simulation.no-channel",
                quantity="channel",
                channel=self.channel,
                word=str(self.channel),
                known=CHANNELS,
            )
        if not self.begin < self.end:
            raise ConfigError(
                "simulation.fault-lasts-no-time",
                quantity="begin, end",
                begin=self.begin,
                end=self.end,
            )

    def broken(self, values: Array, generator: np.random.Generator) -> Array:
        """Output of the faulty channel for these samples of the interval, (k,)."""
        raise NotImplementedError

    def _checked(self, name: str, least: float = 0.0) -> None:
        value = getattr(self, name)
        if not is_number(value) or not least <= value < math.inf:
            raise ConfigError("simulation.will-not-do-2", quantity=name, value=value, least=least)


@dataclass(frozen=True)
class Stuck(SensorFault):
    """Stuck at the reading at the start of the fault."""

    def broken(self, values: Array, generator: np.random.Generator) -> Array:
        """As `SensorFault.broken`."""
        return np.full_like(values, values[0])


@dataclass(frozen=True)
class Dead(SensorFault):
    """Output is exactly zero."""

    def broken(self, values: Array, generator: np.random.Generator) -> Array:
        """As `SensorFault.broken`."""
        return np.zeros_like(values)


@dataclass(frozen=True)
class DropOut(SensorFault):
    """Missing output: the values are NaN."""

    def broken(self, values: Array, generator: np.random.Generator) -> Array:
        """As `SensorFault.broken`."""
        return np.full_like(values, math.nan)


@dataclass(frozen=True)
class Jump(SensorFault):
    """Bias jump.

    Attributes
    ----------
    size : float, rad/s or m/s²
    """

    size: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self._checked("size", -math.inf)

    def broken(self, values: Array, generator: np.random.Generator) -> Array:
        """As `SensorFault.broken`."""
        return values + self.size


@dataclass(frozen=True)
class Noisy(SensorFault):
    """Added white noise.

    Attributes
    ----------
    sd : float, rad/s or m/s²
        Standard deviation of a sample.
    """

    sd: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self._checked("sd")

    def broken(self, values: Array, generator: np.random.Generator) -> Array:
        """As `SensorFault.broken`."""
        return values + self.sd * generator.standard_normal(values.size)


@dataclass(frozen=True)
class Saturated(SensorFault):
    """Reduced range, from an amplifier fault or a wrong setting.

    Attributes
    ----------
    limit : float, rad/s or m/s²
        The output is clipped to ± this.
    """

    limit: float = math.inf

    def __post_init__(self) -> None:
        super().__post_init__()
        if not is_number(self.limit) or not self.limit > 0.0:
            raise ConfigError("simulation.no-range", quantity="limit", limit=self.limit)

    def broken(self, values: Array, generator: np.random.Generator) -> Array:
        """As `SensorFault.broken`."""
        return np.clip(values, -self.limit, self.limit)


@dataclass(frozen=True)
class Burst(SensorFault):
    """Random samples far off, to either side.

    Attributes
    ----------
    size : float, rad/s or m/s²
        Magnitude of the error.
    share : float
        Probability that a sample is affected.
    """

    size: float = 0.0
    share: float = 0.2

    def __post_init__(self) -> None:
        super().__post_init__()
        self._checked("size")
        if not is_number(self.share) or not 0.0 < self.share <= 1.0:
            raise ConfigError("simulation.no-share", quantity="share", share=self.share)

    def broken(self, values: Array, generator: np.random.Generator) -> Array:
        """As `SensorFault.broken`."""
        struck = generator.random(values.size) < self.share
        sign = np.where(generator.random(values.size) < 0.5, -1.0, 1.0)
        return values + self.size * sign * struck


def inject_faults(
    imu: pd.DataFrame, faults: Sequence[SensorFault], *, seed: int = 0
) -> pd.DataFrame:
    """Inject faults into channels of an Imu table.

    Parameters
    ----------
    imu : DataFrame
        An Imu table; not changed.
    faults : sequence of SensorFault
        Applied in order: a later fault acts on the output of an earlier one.
    seed : int
        Seed of the random draws; each fault has its own stream.

    Returns
    -------
    DataFrame
        With NaN for a `DropOut`, which `check_imu` rejects.

    Raises
    ------
    ConfigError
        The table lacks the channel, or has no sample within the interval.
    """
    out = imu.copy()
    out.attrs = dict(imu.attrs)
    time = out.index.to_numpy(dtype=np.float64)
    for k, fault in enumerate(faults):
        within = (time >= fault.begin) & (time < fault.end)
        if fault.channel not in out.columns or not within.any():
            raise ConfigError(
                "simulation.table-no-between",
                quantity=type(fault).__name__,
                channel=fault.channel,
                begin=fault.begin,
                end=fault.end,
            )
        values = out[fault.channel].to_numpy(dtype=np.float64).copy()
        generator = np.random.Generator(np.random.PCG64(child(seed, FAULT_SEED, k)))
        values[within] = fault.broken(values[within], generator)
        out[fault.channel] = values
    return out
