"""One event of a crash."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from strapdown.errors import ConfigError


@dataclass(frozen=True)
class CrashEvent:
    """One event of a record.

    Attributes
    ----------
    time_zero : float, s
        First point of the interval in which the wake threshold was reached (49 CFR 563.5(b)), or
        the instant at which it was; as `EventRule.zero_at` says.
    time_zero_sd : float, s
        Of `time_zero` from noise and bias of the acceleration: that of the window's change,
        over its slope where it crosses the threshold. First order: right while it is small
        against the time in which the slope changes. Zero where nothing was said of the noise.
    basis : {'longitudinal', 'lateral', 'resultant', 'acceleration'}
        By which criterion.
    woken : float, s
        When the wake threshold was reached: no earlier could a recorder know.
    trigger : float, s
        When the trigger threshold was reached: the instant of detection.
    trigger_axis : {'longitudinal', 'lateral'}
    end : float, s
        When the resultant change within the wake window became small; the last stamp where
        `lasts_beyond_record`.
    end_sd : float, s
        As `time_zero_sd`; NaN where the event lasts beyond the record, or where the end is that
        of the trigger.
    peak : float, m/s²
        Largest horizontal magnitude of a sample from time zero to the end, unfiltered.
    peak_time : float, s
    starts_before_record : bool
        The record begins within the interval of time zero, which is then the first stamp.
    lasts_beyond_record : bool
        The record ends before the event.
    """

    time_zero: float
    time_zero_sd: float
    basis: str
    woken: float
    trigger: float
    trigger_axis: str
    end: float
    end_sd: float
    peak: float
    peak_time: float
    starts_before_record: bool
    lasts_beyond_record: bool

    @property
    def duration(self) -> float:
        """From time zero to the end, s."""
        return self.end - self.time_zero


def two_sds(given: float | Sequence[float], name: str) -> tuple[float, float]:
    """Forward and right standard deviation of one number or a triad.

    Raises
    ------
    ConfigError
        It is neither, or negative, or not finite.
    """
    try:
        sds = np.asarray(given, dtype=np.float64)
        sds = np.broadcast_to(sds, (3,)) if sds.ndim == 0 else sds
    except (TypeError, ValueError):
        sds = np.empty(0)
    if sds.shape != (3,) or not (np.isfinite(sds).all() and (sds >= 0.0).all()):
        raise ConfigError("crash.no-standard-deviation", quantity=name, given=given)
    return float(sds[0]), float(sds[1])
