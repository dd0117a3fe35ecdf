"""Whether outliers may be why a record could not be aligned."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pandas as pd

from strapdown.dsp.outliers import REPLACED, OutlierDesign
from strapdown.dsp.samples import even_step
from strapdown.errors import DataError, Finding
from strapdown.prefilter import PrefilterReport
from strapdown.prefilter.report import LOW_RATE
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import index_of, values_of

__all__ = ["saying_outliers"]

#: Of the samples of a channel: fewer are no reason, more are its habit and no outliers.
LEAST, MOST = 1e-3, 0.03

#: How many times its usual scatter over a second makes a channel loud; and for how much of a record
#: that can be no habit of it.
LOUD, MOST_LOUD = 10.0, 0.25
LEAST_SECONDS = 8


@contextmanager
def saying_outliers(imu: pd.DataFrame, report: PrefilterReport | None) -> Iterator[None]:
    """Add to an error that samples stand out: those that a pre-filter left, or all without one.

    Parameters
    ----------
    imu : DataFrame
        Imu table that is aligned inside.
    report : PrefilterReport or None
        Of the pre-filter that it has passed.
    """
    try:
        yield
    except DataError as error:
        faults = () if report is None else _faults(report)
        if faults:
            raise _after_prefilter(error, faults[0]) from None
        found = None if report is not None else _outliers(imu)
        if found is None:
            raise _with_unquiet(error, imu) from None
        channel, rows = found
        f = error.finding
        first = float(imu.index[rows[0]])
        raise DataError(
            "alignment.outliers",
            file=f.file,
            row=f.row,
            quantity=f.quantity,
            reason=f,
            count=len(rows),
            channel=channel,
            first=first,
        ) from None


def _faults(report: PrefilterReport) -> tuple[Finding, ...]:
    """What a pre-filter found, but for the caution that goes with a low rate."""
    return tuple(f for f in report.findings if f.code != LOW_RATE)


def _after_prefilter(error: DataError, said: Finding) -> DataError:
    f = error.finding
    return DataError(
        "alignment.fails-after-prefilter",
        file=f.file,
        row=f.row if said.row is None else said.row,
        quantity=f.quantity,
        reason=f,
        of_what=said.quantity,
        reason_2=said,
    )


def _with_unquiet(error: DataError, imu: pd.DataFrame) -> DataError:
    """The error with the stretch in which the record is least like itself."""
    found = _unquiet(imu)
    if found is None:
        return error
    channel, begin, end, ratio = found
    f = error.finding
    return DataError(
        "alignment.channel-scatters",
        file=f.file,
        row=f.row,
        quantity=f.quantity,
        reason=f,
        channel=channel,
        begin=begin,
        end=end,
        ratio=ratio,
    )


def _unquiet(imu: pd.DataFrame) -> tuple[str, float, float, float] | None:
    """The channel that scatters far more than it usually does, from when to when, how much."""
    columns = [c for c in [*GYRO, *ACCEL] if c in imu.columns]
    time = index_of(imu)
    size = max(2, round(1.0 / float(np.median(np.diff(time)))))
    count = len(imu) // size
    if count < LEAST_SECONDS:
        return None
    blocks = values_of(imu, columns)[: count * size].reshape(count, size, len(columns))
    scatter = blocks.std(axis=1)
    usual = np.median(scatter, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(usual > 0.0, scatter / usual, 0.0)
    second, channel = (int(k) for k in np.unravel_index(ratio.argmax(), ratio.shape))
    worst = float(ratio[second, channel])
    loud = ratio[:, channel] > LOUD
    if worst < LOUD or loud.mean() > MOST_LOUD:
        return None
    first, last = second, second
    while first > 0 and loud[first - 1]:
        first -= 1
    while last + 1 < count and loud[last + 1]:
        last += 1
    begin, end = float(time[first * size]), float(time[(last + 1) * size - 1])
    return columns[channel], begin, end, worst


def _outliers(imu: pd.DataFrame) -> tuple[str, np.ndarray] | None:
    """The channel that has most of them, and its samples."""
    columns = [c for c in [*GYRO, *ACCEL] if c in imu.columns]
    try:
        even_step(index_of(imu))
    except DataError:
        return None
    design = OutlierDesign()
    values = np.ascontiguousarray(values_of(imu, columns))
    _, screened = design.advance(design.begin(len(columns)), values, True)
    flagged = screened.flags == REPLACED
    share = flagged.mean(axis=0)
    share[share > MOST] = 0.0
    worst = int(share.argmax())
    if share[worst] < LEAST:
        return None
    return columns[worst], np.flatnonzero(flagged[:, worst]) + screened.first
