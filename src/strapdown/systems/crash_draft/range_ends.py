"""Where a triad stood at the end of its range, and which parts of the catalogue end there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import GYRO_UNITS, STANDARD_GRAVITY
from strapdown.sensors.catalogue import SENSORS, load_sensor
from strapdown.sensors.saturation import find_limits
from strapdown.systems.crash_draft.parts import Part

Array = NDArray[np.float64]

__all__ = ["RangeEnds", "range_ends"]

# A full scale is met within this: converters stop a step or two short of it, and scale factors
# are a few percent off.
SAME_END = 0.03


@dataclass(frozen=True)
class RangeEnds:
    """What a triad reached, and at which end it stood.

    Attributes
    ----------
    peak : tuple of float, (3,)
        Largest of each axis, SI; NaN where it is missing.
    ends : tuple of float or None, (3,)
        End of the range, where it was found.
    samples : int
        That stood at an end.
    sensors : tuple of str
        Of the catalogue: those with this full scale; where no end was found, those whose range
        holds the peaks.
    """

    peak: tuple[float, ...]
    ends: tuple[float | None, ...]
    samples: int
    sensors: tuple[str, ...]

    @property
    def saturated(self) -> bool:
        """Whether an axis stood at an end."""
        return any(e is not None for e in self.ends)


def range_ends(part: Part) -> RangeEnds:
    """Find the ends of a triad's range.

    Parameters
    ----------
    part : Part
        Of accelerations or rates, with values in SI.
    """
    has = part.axes
    values = part.values[:, has]
    infinite = np.full(len(has), np.inf)
    limits = find_limits(part.time, values, infinite, np.zeros(len(has)))
    peak, ends = [float("nan")] * 3, [None] * 3
    for j, k in enumerate(has):
        peak[k] = float(np.abs(values[:, j]).max())
        if limits.found[j]:
            sizes = [abs(e) for e in (limits.lower[j], limits.upper[j]) if np.isfinite(e)]
            ends[k] = float(max(sizes))  # type: ignore[call-overload]
    fits = [
        name
        for name, full in _full_scales(part.kind).items()
        if all(_fits(peak[k], ends[k], full[k]) for k in has)
    ]
    samples = int(limits.clipped[:, limits.found].any(axis=1).sum()) if limits.found.any() else 0
    return RangeEnds(tuple(peak), tuple(ends), samples, tuple(fits))


def _fits(peak: float, end: float | None, full: float) -> bool:
    if end is not None:
        return abs(end / full - 1.0) <= SAME_END
    return peak <= (1.0 + SAME_END) * full


@cache
def _full_scales(kind: str) -> dict[str, tuple[float, ...]]:
    """Of every sensor of the catalogue that has such a triad, SI."""
    found = {}
    for name in SENSORS:
        sensor = load_sensor(name)
        triad = sensor.imu_errors.accel if kind == "acceleration" else sensor.imu_errors.gyro
        own = "accel" if kind == "acceleration" else "gyro"
        if triad is not None and any(f.key.startswith(f"{own}.") for f in sensor.sources):
            found[name] = tuple(float(v) for v in triad.axis("full_scale"))
    return found


def in_words(value: float, kind: str) -> str:
    """A size in the unit that people use for it."""
    if kind == "acceleration":
        return f"{value / STANDARD_GRAVITY:.3g} g"
    return f"{value / GYRO_UNITS['deg/s']:.4g} deg/s"
