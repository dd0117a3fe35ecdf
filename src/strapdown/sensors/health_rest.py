"""Whether what is read at rest can be gravity and the Earth's rate."""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from strapdown.ellipsoids import WGS84
from strapdown.sensors.health_log import ChannelFault, HealthLog, intervals_of
from strapdown.tables import ACCEL, GYRO

Array = NDArray[np.float64]

__all__ = ["find_implausible"]

# Blocks at rest that follow each other, for a mean.
LEAST_REST = 3


def find_implausible(log: HealthLog) -> list[ChannelFault]:
    """Means at rest that neither gravity nor the Earth's rate explains within what is stated.

    A single channel reads no more than gravity (the Earth's rate) and its own errors; the length
    of the three is that, to within their errors along the direction. Only with a stated
    uncertainty, over the longest rest by the word of all channels.
    """
    if log.sensors is None:
        return []
    rest = log.rests() & log.blocks.valid.all(axis=1)
    spans = [s for s in intervals_of(rest) if s[1] - s[0] + 1 >= LEAST_REST]
    if not spans:
        return []
    first, last = max(spans, key=lambda s: s[1] - s[0])
    middle = log.blocks.mean[first : last + 1].mean(axis=0)
    span = log.span_of(first, last)
    k_sd = -NormalDist().inv_cdf(0.5 * log.false_alarm)
    faults = _triad(log, middle, span, GYRO, (WGS84.rotation_rate, WGS84.rotation_rate), k_sd)
    if ACCEL[0] in log.names:
        faults += _triad(log, middle, span, ACCEL, log.gravity, k_sd)
    return faults


def _triad(
    log: HealthLog,
    means: Array,
    span: tuple[int, int],
    columns: list[str],
    size: tuple[float, float],
    k_sd: float,
) -> list[ChannelFault]:
    at = [log.names.index(c) for c in columns]
    mean = means[at]
    sd = _sd(log, columns, mean, size[1], float(log.time[span[1]] - log.time[span[0]]))
    kind = "gyro" if columns is GYRO else "accel"
    faults = []
    for axis, channel in enumerate(at):
        limit = size[1] + k_sd * float(sd[axis])
        if abs(mean[axis]) > limit:
            read, code = float(mean[axis]), f"sensors.{kind}-implausible-at-rest"
            faults.append(
                log.fault(channel, "implausible", span, abs(read), limit, code, read=read)
            )
    if faults:
        return faults
    length = float(np.sqrt(mean @ mean))
    along = mean / length if length > 0.0 else np.zeros(3)
    spread = float(np.sqrt((along**2) @ (sd**2)))
    # Errors across add to the length by their square: chi-square of two over twice the length.
    across = float((sd**2).max()) * k_sd**2 / (2.0 * size[0])
    low, high = size[0] - k_sd * spread, size[1] + k_sd * spread + across
    if columns is GYRO and low <= 0.0:
        # The grade does not see the Earth turn; the channels have been held against their biases.
        return []
    if low <= length <= high:
        return []
    limit = high if length > high else low
    said = {"low": low, "high": high}
    code = f"sensors.{kind}-triad-implausible-at-rest"
    return [log.fault(kind, "implausible", span, length, limit, code, **said)]


def _sd(log: HealthLog, columns: list[str], mean: Array, size: float, duration: float) -> Array:
    """Stated standard deviation of the mean at rest, per axis."""
    assert log.sensors is not None
    gyro = columns is GYRO
    triad = log.sensors.gyro if gyro else log.sensors.accel
    drift = log.sensors.gyro_drift if gyro else log.sensors.accel_drift
    out = np.zeros(3)
    for axis in range(3):
        across = math.sqrt(max(size**2 - min(float(mean[axis]) ** 2, size**2), 0.0))
        terms = [
            triad.axis("noise_density")[axis] / math.sqrt(duration),
            triad.axis("bias")[axis],
            drift.triad[axis],
            triad.axis("scale")[axis] * min(abs(float(mean[axis])), size),
            triad.axis("misalignment")[axis] * across,
            triad.axis("quantization")[axis] / math.sqrt(12.0),
        ]
        full = triad.axis("full_scale")[axis]
        if math.isfinite(full):
            terms.append(triad.axis("nonlinearity_2")[axis] * size**2 / full)
        if gyro:
            terms.append(triad.axis("g_sensitivity")[axis] * log.gravity[1])
        out[axis] = math.sqrt(sum(t * t for t in terms))
    return out
