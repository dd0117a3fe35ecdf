"""Increments of angle and velocity, converted to means over their steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import ACCEL_SUMS, GYRO_SUMS
from strapdown.errors import ConfigError, Finding

__all__ = ["OPEN", "SUMS", "intervals", "sampling_of_sums", "sum_of"]

Array = NDArray[np.float64]
#: Units of increments, by triad.
SUMS: dict[str, dict[str, float]] = {"gyro": GYRO_SUMS, "accel": ACCEL_SUMS, "mag": {}}
#: Unit choices for a name that states increments without a unit.
OPEN = {triad: " or ".join(units) for triad, units in SUMS.items()}
# Unit of the increments for each unit of rate.
_SUM_OF = {"rad/s": "rad", "deg/s": "deg", "m/s2": "m/s", "g": "g*s"}


def sum_of(unit: str | None, triad: str) -> str:
    """Return the unit of the increments of a rate, or the choice if the unit is unknown."""
    return _SUM_OF.get(unit or "", OPEN[triad])


def intervals(time: Array, kept: NDArray[np.int64]) -> Array:
    """Compute the integration time of each sample.

    Parameters
    ----------
    time : ndarray, (n,), s
        Stamps of the samples used; at least two.
    kept : ndarray of int, (n,)
        Their indices in the log. After a dropped sample an increment still belongs to its own
        step, not to the gap.

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
    """Return the sampling of increments: always means, regardless of the file.

    Parameters
    ----------
    summed : set of str
        Triads that hold increments; not empty.
    triads : set of str
        Triads used.
    asked : str or None
        Sampling stated by the user.
    file : str
    findings : list of Finding
        The conversion is appended.

    Raises
    ------
    ConfigError
        The user states instantaneous values.
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
