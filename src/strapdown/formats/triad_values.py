"""Values of gyro, accelerometer and magnetometer as they stand in a file."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats.find_columns import AXES, Column
from strapdown.formats.numbers import numbers
from strapdown.formats.recording import RawLog

__all__ = ["left_out", "values_of_triads"]

Array = NDArray[np.float64]
# Left out where they cannot be used, for the gyro alone makes an attitude.
OPTIONAL = ("accel", "mag")


def values_of_triads(
    raw: RawLog, found: dict[str, Column], findings: list[Finding]
) -> dict[str, Array]:
    """Values of each triad that can be used, as they stand in the file.

    Parameters
    ----------
    raw : RawLog
    found : dict of str to Column
    findings : list of Finding
        What is left out is added.

    Returns
    -------
    dict of str to ndarray, (n, 3)

    Raises
    ------
    DataError
        Those of the gyro cannot be used.
    """
    values = {"gyro": _triad(raw, found, "gyro")}
    for triad in OPTIONAL:
        if not any(f"{triad}_{a}" in found for a in AXES):
            continue
        missing = [f"{triad}_{a}" for a in AXES if f"{triad}_{a}" not in found]
        if missing:
            findings.append(_not_used(raw, triad, "io.left-out-without-axes", missing=missing))
            continue
        try:
            block = _triad(raw, found, triad)
        except DataError as error:
            findings.append(left_out(raw, triad, error))
            continue
        empty = int((~np.isfinite(block)).any(axis=1).sum())
        if not np.isfinite(block).any():
            findings.append(_not_used(raw, triad, "io.left-out-without-number"))
        elif triad == "mag" and empty:
            findings.append(_not_used(raw, triad, "io.left-out-rows-without-number", count=empty))
        else:
            values[triad] = block
    return values


def _not_used(raw: RawLog, triad: str, code: str, **data: Any) -> Finding:
    return Finding(code, file=raw.name, quantity=triad, severity="note", **data)


def _triad(raw: RawLog, found: dict[str, Column], triad: str) -> Array:
    parts = [numbers(raw, found[f"{triad}_{a}"], f"{triad}_{a}") for a in AXES]
    return np.column_stack(parts).astype(np.float64, copy=False)


def left_out(raw: RawLog, triad: str, error: DataError) -> Finding:
    """Say of a triad that it is not used, and why."""
    return Finding(
        "io.left-out-unusable",
        file=raw.name,
        row=error.finding.row,
        quantity=triad,
        reason=error.finding,
    )
