"""Samples that stand out of a record that is to be aligned."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import Finding

Array = NDArray[np.float64]

__all__ = ["outlier_findings"]

#: Share of the steps from sample to sample that are taken for usual, and how many times as large
#: a step stands out: 36 standard deviations of white noise, 10 times the steepest of a swing.
USUAL = 0.99
FACTOR = 10.0


def outlier_findings(values: Array, columns: list[str], source: str | None) -> tuple[Finding, ...]:
    """Find jumps that neither noise nor rocking makes.

    Parameters
    ----------
    values : ndarray, (n, k)
    columns : list of str
        Their names.
    source : str, optional

    Returns
    -------
    tuple of Finding
        At most one, of the channel that jumps most, with the row of its largest jump. A channel
        whose usual step is zero (a coarse converter) is not judged.
    """
    steps = np.abs(np.diff(values, axis=0))
    place = int(USUAL * (len(steps) - 1))
    usual = np.partition(steps, place, axis=0)[place]
    ratio = np.divide(steps.max(axis=0), usual, out=np.zeros_like(usual), where=usual > 1e-12)
    if not ratio.max(initial=0.0) > FACTOR:
        return ()
    channel = int(np.argmax(ratio))
    large = np.flatnonzero(steps[:, channel] > FACTOR * usual[channel])
    row = int(np.argmax(steps[:, channel])) + 1
    return (
        Finding(
            "alignment.outlier-or-shock" if len(large) == 1 else "alignment.outliers-or-shocks",
            file=source,
            row=row + 1,
            quantity=columns[channel],
            count=len(large),
            factor=FACTOR,
            ratio=ratio[channel],
            values=values[row, channel],
        ),
    )
