"""Channels at the end of their range."""

from __future__ import annotations

import math

import numpy as np

from strapdown.sensors.health_log import (
    ChannelFault,
    HealthLog,
    intervals_of,
)
from strapdown.sensors.saturation import find_limits

__all__ = ["find_saturated"]

SAME_FAULT = 1.0  # s


def find_saturated(log: HealthLog) -> list[ChannelFault]:
    """Samples at the stated full scale, or on a flat top (`saturation.find_limits`)."""
    faults = []
    join = max(round(SAME_FAULT * log.rate), 1)
    for k in range(len(log.names)):
        known = ~log.wrong[k]
        # Two readings make no top that is flat, nor does a channel that never moves.
        if known.sum() < 3:
            continue
        stated = log.stated(k)
        full = np.inf if stated is None else stated[0].axis("full_scale")[stated[1]]
        step = 0.0 if stated is None else stated[0].axis("quantization")[stated[1]]
        values = log.values[k, known]
        if float(values.min()) == float(values.max()):
            continue
        limits = find_limits(
            log.time[known],
            values[:, None],
            np.array([full]),
            np.array([step]),
            longest_flat=math.inf,
        )
        clipped = np.zeros(log.time.size, dtype=bool)
        clipped[known] = limits.clipped[:, 0]
        code = "sensors.saturated-flat-top" if limits.found[0] else "sensors.saturated-at-range"
        for a, b in intervals_of(clipped, join):
            count = int(clipped[a : b + 1].sum())
            size = float(np.abs(log.values[k, a : b + 1][clipped[a : b + 1]]).max())
            faults.append(log.fault(k, "saturated", (a, b), size, size, code, count=count))
    return faults
