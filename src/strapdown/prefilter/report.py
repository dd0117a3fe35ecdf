"""What a prefilter changed, and what it does to time, noise and frequencies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.dsp.outliers import KEPT, REPLACED, Screened
from strapdown.errors import Finding

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

__all__ = ["Changed", "PrefilterReport", "report_of"]

# Flagged samples with fewer between them belong to one event.
APART = 32
# A share of outliers above this is no rare fault.
USUAL_SHARE = 0.01
# Events of one channel that are told one by one.
MOST_TOLD = 3


@dataclass(frozen=True, eq=False)
class Changed:
    """Samples that stood out.

    Attributes
    ----------
    number : ndarray of int64, (k,)
        Of the sample, from zero.
    channel : ndarray of int64, (k,)
    value, by : ndarray, (k,)
        As it came, and what stands for it; the same where it was kept.
    flag : ndarray of int8, (k,)
    """

    number: Indices
    channel: Indices
    value: Array
    by: Array
    flag: NDArray[np.int8]

    @classmethod
    def none(cls) -> Changed:
        """Nothing stood out."""
        no = np.empty(0, dtype=np.int64)
        return cls(no, no, np.empty(0), np.empty(0), np.empty(0, np.int8))

    @classmethod
    def of(cls, part: Screened) -> Changed:
        """Those of a segment."""
        row, channel = np.nonzero(part.flags)
        at = (row, channel)
        return cls(row + part.first, channel, part.raw[at], part.values[at], part.flags[at])

    @classmethod
    def joined(cls, parts: Sequence[Changed]) -> Changed:
        """Those of several segments."""
        names = ("number", "channel", "value", "by", "flag")
        return cls(*(np.concatenate([getattr(p, n) for p in parts]) for n in names))


@dataclass(frozen=True, eq=False)
class PrefilterReport:
    """What became of a record.

    Attributes
    ----------
    name : str
    delay : float, s
        Group delay of the filter: the same for all channels and frequencies, and taken off by
        the stamps of the outputs.
    latency : float, s
        From an output's stamp to the last sample that it waits for.
    noise_factor : float
        Standard deviation of an output per that of white noise of the samples.
    passband, stopband : float, Hz
        Up to the one the gain is 1, from the other on nothing, both to `attenuation`.
    attenuation : float, dB
    replaced : DataFrame
        One row a replaced sample: time (s), row (from 1), channel, value, by.
    kept : DataFrame
        The same of samples that stood out and were left, for one side confirms them.
    share : dict
        Replaced part of each channel.
    findings : tuple of Finding
    """

    name: str
    delay: float
    latency: float
    noise_factor: float
    passband: float
    stopband: float
    attenuation: float
    replaced: pd.DataFrame = field(repr=False)
    kept: pd.DataFrame = field(repr=False)
    share: dict[str, float]
    findings: tuple[Finding, ...]


#: Code of the finding that a pre-filter cannot tell outliers from knocks: a caution, and no fault.
LOW_RATE = "prefilter.rate-too-low-for-knocks"
# A knock on a body lasts some milliseconds; faster samples show more than one of it.
SHORTEST_KNOCK = 2e-3  # s


def report_of(
    name: str,
    figures: dict[str, float],
    grid: Any,
    changed: Changed,
    columns: Sequence[str],
    samples: int,
    source: str | None,
) -> PrefilterReport:
    """Put together the report of a record."""
    names = np.array(columns, dtype=object)

    def table(flag: int) -> pd.DataFrame:
        at = changed.flag == flag
        return pd.DataFrame(
            {
                "time": grid.time(changed.number[at]),
                "row": changed.number[at] + 1,
                "channel": names[changed.channel[at]],
                "value": changed.value[at],
                "by": changed.by[at],
            }
        )

    replaced = table(REPLACED)
    share = {c: float((replaced["channel"] == c).sum()) / samples for c in columns}
    found = [
        *_bursts(changed, grid, columns, source),
        *_too_many(share, samples, source),
        *_knocks(replaced, grid, source),
    ]
    return PrefilterReport(
        name=name,
        replaced=replaced,
        kept=table(KEPT),
        share=share,
        findings=tuple(found),
        **figures,
    )


def _bursts(
    changed: Changed, grid: Any, columns: Sequence[str], source: str | None
) -> list[Finding]:
    """Events of more samples than are bridged, but no mere steps."""
    found = []
    for c, column in enumerate(columns):
        of = changed.channel == c
        number, flag = changed.number[of], changed.flag[of]
        told, left = 0, 0
        for event in np.split(np.arange(len(number)), np.flatnonzero(np.diff(number) > APART) + 1):
            kept = number[event][flag[event] == KEPT]
            # A step stands out at one place: at two samples beside each other, or one.
            if (np.diff(kept) > 1).sum() < 1:
                continue
            if told == MOST_TOLD:
                left += 1
                continue
            told += 1
            a, b = int(number[event[0]]), int(number[event[-1]])
            found.append(
                Finding(
                    "prefilter.outliers-too-close",
                    file=source,
                    row=a + 1,
                    quantity=column,
                    time=grid.time(a),
                    time_2=grid.time(b),
                    a=a + 1,
                    b=b + 1,
                    count=len(kept),
                )
            )
        if left:
            found.append(
                Finding(
                    "prefilter.more-bursts",
                    file=source,
                    quantity=column,
                    severity="note",
                    left=left,
                )
            )
    return found


def _too_many(share: dict[str, float], samples: int, source: str | None) -> list[Finding]:
    return [
        Finding(
            "prefilter.many-outliers",
            file=source,
            quantity=column,
            part=100.0 * part,
            samples=samples,
        )
        for column, part in share.items()
        if part > USUAL_SHARE
    ]


def _knocks(replaced: pd.DataFrame, grid: Any, source: str | None) -> list[Finding]:
    if replaced.empty or grid.step <= SHORTEST_KNOCK:
        return []
    first = replaced.iloc[0]
    return [
        Finding(
            LOW_RATE,
            file=source,
            row=int(first["row"]),
            quantity=str(first["channel"]),
            count=len(replaced),
            rate=1.0 / grid.step,
        )
    ]
