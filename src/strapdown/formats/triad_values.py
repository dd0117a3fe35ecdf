"""Values of gyro, accelerometer and magnetometer as they stand in a file."""

from __future__ import annotations

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
        try:
            missing = [f"{triad}_{a}" for a in AXES if f"{triad}_{a}" not in found]
            if missing:
                raise DataError("io.not", missing=missing)
            block = _triad(raw, found, triad)
            if not np.isfinite(block).any():
                raise DataError("io.holds-no-number-2")
            empty = int((~np.isfinite(block)).any(axis=1).sum())
            if triad == "mag" and empty:
                raise DataError("io.rows-hold-no-number", empty=empty)
        except DataError as error:
            findings.append(left_out(raw, triad, error))
        else:
            values[triad] = block
    return values


def _triad(raw: RawLog, found: dict[str, Column], triad: str) -> Array:
    parts = [numbers(raw, found[f"{triad}_{a}"], f"{triad}_{a}") for a in AXES]
    return np.column_stack(parts).astype(np.float64, copy=False)


def left_out(raw: RawLog, triad: str, error: DataError) -> Finding:
    """Say of a triad that it is not used, and why."""
    said = error.finding
    return Finding(
        "io.message",
        file=raw.name,
        row=said.row,
        quantity=triad,
        message=f"left out: {said.what}",
        remedy_text=said.remedy,
    )
