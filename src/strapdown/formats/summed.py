"""Columns of a sensor that sums: increments of angle and velocity, made means over their steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import ACCEL_SUMS, GYRO_SUMS
from strapdown.errors import ConfigError, Finding

__all__ = ["OPEN", "SUMS", "intervals", "sampling_of_sums", "sum_of"]

Array = NDArray[np.float64]
#: Units of increments, by triad.
SUMS: dict[str, dict[str, float]] = {"gyro": GYRO_SUMS, "accel": ACCEL_SUMS, "mag": {}}
#: What a name that says increments and no unit leaves open.
OPEN = {triad: " or ".join(units) for triad, units in SUMS.items()}
# The unit of the increments of a rate in another.
_SUM_OF = {"rad/s": "rad", "deg/s": "deg", "m/s2": "m/s", "g": "g*s"}


def sum_of(unit: str | None, triad: str) -> str:
    """The unit of the increments of a rate: that of one, or the choice where none is known."""
    return _SUM_OF.get(unit or "", OPEN[triad])


def intervals(time: Array, kept: NDArray[np.int64]) -> Array:
    """How long each sample was summed.

    Parameters
    ----------
    time : ndarray, (n,), s
        Stamps of the samples that are used; at least two.
    kept : ndarray of int, (n,)
        Their places in the log. After one that was left out an increment is still that of its
        own step, and not of the hole.

    Returns
    -------
    ndarray, (n, 1), s
    """
    steps = np.diff(time)
    usual = float(np.median(steps))
    alone = np.diff(kept) > 1
    length = np.concatenate([[usual], np.where(alone, np.minimum(steps, usual), steps)])
    return np.asarray(length[:, None])


def sampling_of_sums(
    summed: set[str], triads: set[str], asked: str | None, file: str, findings: list[Finding]
) -> str:
    """How the rows of increments are sampled: they are means, whatever the file says.

    Parameters
    ----------
    summed : set of str
        Triads that hold increments; not empty.
    triads : set of str
        Those that are used.
    asked : str or None
        What the user says.
    file : str
    findings : list of Finding
        What was done is added.

    Raises
    ------
    ConfigError
        The user says that they are values at their stamps.
    """
    names = [t for t in ("gyro", "accel") if t in summed]
    if asked and asked.lower() != "mean":
        raise ConfigError(
            "io.sampling-against-increments", quantity="--sampling", asked=asked, names=names
        )
    rest = [t for t in ("gyro", "accel") if t in triads - summed]
    findings.append(
        Finding(
            "io.increments-made-means-with-rates" if rest else "io.increments-made-means",
            file=file,
            quantity="sampling",
            severity="note",
            names=names,
            rest=rest,
        )
    )
    return "mean"
