"""Rows of a log in which every value that is used is a number."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats.find_columns import AXES, Column
from strapdown.formats.recording import RawLog, ReadOptions

__all__ = ["finite_rows"]

Array = NDArray[np.float64]


def finite_rows(
    raw: RawLog,
    found: dict[str, Column],
    ticks: NDArray[Any] | None,
    values: dict[str, Array],
    options: ReadOptions,
    findings: list[Finding],
) -> NDArray[np.bool_]:
    """Rows in which every value that is used is a number.

    Parameters
    ----------
    raw : RawLog
    found : dict of str to Column
    ticks : ndarray or None, (n,)
        Stamps as they stand in the file.
    values : dict of str to ndarray, (n, 3)
        Of the triads that are used.
    options : ReadOptions
        Whether rows may be left out.
    findings : list of Finding
        How many are left out is added.

    Returns
    -------
    ndarray of bool, (n,)

    Raises
    ------
    DataError
        A row cannot be used and may not be left out, or none is left.
    """
    blocks = dict(values)
    if ticks is not None:
        blocks = {"time": ticks[:, None].astype(np.float64)} | blocks
    keep = np.ones(len(values["gyro"]), dtype=bool)
    for name, block in blocks.items():
        bad = ~np.isfinite(block)
        if not bad.any():
            continue
        row, column = (int(i) for i in np.argwhere(bad)[0])
        quantity = name if name == "time" else f"{name}_{AXES[column]}"
        count = int(bad.any(axis=1).sum())
        if not options.repair:
            raise DataError(
                "io.not-finite-in-rows",
                file=raw.name,
                row=raw.row(row),
                quantity=quantity,
                block=block[row, column],
                source=found[quantity].source,
                count=count,
            )
        findings.append(
            Finding(
                "io.rows-without-number-left-out",
                file=raw.name,
                row=raw.row(row),
                quantity=quantity,
                severity="note",
                count=count,
            )
        )
        keep &= ~bad.any(axis=1)
    if not keep.any():
        raise DataError("io.no-usable-row", file=raw.name)
    return keep
