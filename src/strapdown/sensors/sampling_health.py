"""Health of the sampling of a log: its stamps, repeated samples, and quantization."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import Finding, add_warning
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import Array, index_of, source_of, values_of

#: Fewest steps that show a pattern.
LEAST_STEPS = 50
#: Longer steps are pauses of the recording: this many s, and this many usual steps.
PAUSE, PAUSE_STEPS = 5.0, 50.0
#: In bursts this share of the steps is shorter than a fifth of the mean step. Two samples a
#: delivery make a half short; jitter of a third of a step makes a hundredth.
SHORT, BURSTS = 0.2, 0.3
#: Half of the range of the middle 68 % of the steps, over the median step.
JITTER = 0.2
#: Steps of more than this times the 95 % quantile are gaps (`tables.checks.find_gaps`).
GAP = 3.0
#: Steps within this part of a step of a multiple of the usual one, and their share in a log
#: whose only fault is missing samples.
MULTIPLE, MULTIPLES = 0.15, 0.98
#: Mean length of runs of equal samples that shows a held value, and the largest scatter of these
#: lengths relative to that of independent repetitions (geometric lengths).
HELD, REGULAR = 1.35, 0.75
#: Samples from which a quantization step is found.
SEEN = 200_000
#: Steps closer than this part of the largest reading are rounding.
ROUNDING = 1e-9
#: Differences of readings are multiples of a step to this part of it, at this share of them.
ON_GRID, SHARE_ON_GRID = 0.05, 0.99
#: Ratio of quantization step to measured noise above which means do not resolve the step: noise
#: of a third of a step flips one sample in eight, which measures as 0.3 steps.
COARSE = 3.3
#: Share of the blocks of a second that is quiet.
QUIET = 0.1
#: Steps up to these change no result: 2 deg/h, and 10 µg.
HARMLESS = {"gyro": 1e-5, "accel": 1e-4}


def check_sampling(imu: pd.DataFrame, channels: Sequence[str]) -> tuple[Finding, ...]:
    """Test the stamps and the resolution of an inertial log.

    `imu`: Imu table. `channels`: those that are not stuck; only these are tested for quantization.
    Returns findings: stamps of arrival in bursts; jitter; missing samples; samples that repeat the
    one before; quantization that hides the noise.
    """
    return (*_stamps(imu), *_held(imu), *_coarse(imu, channels))


def _stamps(imu: pd.DataFrame) -> list[Finding]:
    time = index_of(imu)
    steps = np.diff(time)
    if steps.size < LEAST_STEPS:
        return []
    usual = float(np.median(steps))
    steps = steps[steps < max(PAUSE, PAUSE_STEPS * usual)]
    if steps.size < LEAST_STEPS:
        return []
    mean = float(steps.mean())
    short = steps < SHORT * mean
    file = source_of(imu)
    if short.mean() >= BURSTS:
        size = steps.size / max(int((~short).sum()), 1)
        return [
            Finding(
                "sensors.stamps-in-bursts",
                file=file,
                quantity="time",
                size=size,
                interval=mean * size,
                rate_hz=1.0 / mean,
            )
        ]
    multiple = np.round(steps / usual)
    whole = np.abs(steps / usual - multiple) <= MULTIPLE * np.maximum(multiple, 1.0)
    # Longer steps are gaps, which the reading of a log reports.
    lost = (multiple > 1.0) & (steps <= GAP * np.quantile(steps, 0.95, method="lower"))
    if (whole & (multiple >= 1.0)).mean() >= MULTIPLES:
        if not lost.any():
            return []
        count = int((multiple[lost] - 1.0).sum())
        share = count / (steps.size + count)
        return [
            Finding(
                "sensors.samples-dropped",
                severity="warning" if share > 1e-3 else "note",
                file=file,
                quantity="time",
                count=count,
                stretches=int(lost.sum()),
                percent=100.0 * share,
                usual=usual,
            )
        ]
    low, high = np.quantile(steps, [0.16, 0.84])
    if 0.5 * (high - low) <= JITTER * usual:
        return []
    least, most = np.quantile(steps, [0.01, 0.99])
    return [
        Finding(
            "sensors.stamps-jitter",
            file=file,
            quantity="time",
            usual=usual,
            sd=0.5 * float(high - low),
            least=float(least),
            most=float(most),
        )
    ]


def held_starts(values: Array) -> NDArray[np.int64] | None:
    """Return the first rows of samples that are repeated until the sensor has a new one.

    `values` ((n, k)): of a triad. None where its samples are not held.
    """
    new = np.any(values[1:] != values[:-1], axis=1)
    starts = np.flatnonzero(np.concatenate([[True], new]))
    lengths = np.diff(np.append(starts, len(values)))
    length = float(lengths.mean())
    if lengths.size < LEAST_STEPS or length < HELD:
        return None
    # Of independent repetitions, as of a quantized channel at rest.
    chance = math.sqrt(length * (length - 1.0))
    return starts if float(lengths.std()) < REGULAR * chance else None


def _held(imu: pd.DataFrame) -> list[Finding]:
    """Find triads whose samples are repeated until the sensor has a new one."""
    out: list[Finding] = []
    rate = (len(imu) - 1) / float(imu.index[-1] - imu.index[0])
    for triad, columns in (("gyro", GYRO), ("accel", ACCEL)):
        if columns[0] not in imu.columns:
            continue
        values = values_of(imu, columns)
        starts = held_starts(values)
        if starts is not None:
            length = len(values) / starts.size
            add_warning(
                out,
                "sensors.samples-held",
                file=source_of(imu),
                quantity=triad,
                triad=triad,
                length=length,
                rate_hz=rate,
                own_rate_hz=rate / length,
            )
    return out


def quantization_step(values: Array) -> float | None:
    """Return the step that all differences of readings are multiples of; None if there is none.

    `values` ((n,)): finite.
    """
    distinct = np.unique(values[:SEEN])
    if distinct.size < 3:
        return None
    apart = np.diff(distinct)
    apart = apart[apart > ROUNDING * float(np.abs(distinct).max())]
    if not apart.size:
        return None
    step = float(apart.min())
    parts = apart / step
    off = np.abs(parts - np.round(parts))
    return step if float((off <= ON_GRID).mean()) >= SHARE_ON_GRID else None


def _coarse(imu: pd.DataFrame, channels: Sequence[str]) -> list[Finding]:
    # The quantization of increments is that of a sum, which loses nothing.
    if imu.attrs.get("sampling") == "mean":
        return []
    out: list[Finding] = []
    block = max(round((len(imu) - 1) / float(imu.index[-1] - imu.index[0])), LEAST_STEPS)
    for triad, columns in (("gyro", GYRO), ("accel", ACCEL)):
        coarse: dict[str, tuple[float, float]] = {}
        for name in columns:
            if name not in channels or name not in imu.columns:
                continue
            values = imu[name].to_numpy(dtype=np.float64)
            step, noise = quantization_step(values), _quiet_noise(values, block)
            if step is not None and step > max(COARSE * noise, HARMLESS[triad]):
                coarse[name] = step, noise
        if coarse:
            step, noise = max(coarse.values())
            add_warning(
                out,
                "sensors.quantization-coarse",
                file=source_of(imu),
                quantity=", ".join(coarse),
                step=step,
                noise=noise,
                unit="rad/s" if triad == "gyro" else "m/s²",
            )
    return out


def _quiet_noise(values: Array, block: int) -> float:
    """Return the noise from second differences in the quiet blocks of a channel."""
    second = np.diff(values, n=2)
    count = second.size // block
    if count == 0:
        return math.inf
    variances = np.square(second[: count * block]).reshape(count, block).mean(axis=1) / 6.0
    return math.sqrt(float(np.quantile(variances, QUIET)))
