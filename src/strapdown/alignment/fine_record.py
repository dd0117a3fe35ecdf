"""What is said of the record of a fine alignment that cannot be carried through."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pandas as pd

from strapdown.exceptions import DataError, DivergenceError
from strapdown.tables import GYRO
from strapdown.tables.checks import values_of

__all__ = ["telling_record"]

WITHOUT = 'leave the fine alignment out (--coarse-only; kind = "none" in [fine])'


@contextmanager
def telling_record(imu: pd.DataFrame) -> Iterator[None]:
    """Say of a gap what can be done at a command; of a divergence, what the gyros read.

    Parameters
    ----------
    imu : DataFrame
        Imu table that is aligned inside.
    """
    try:
        yield
    except DataError as error:
        f = error.finding
        # A remedy that is an argument of a function helps nobody who has a command.
        if f.remedy is None or "longest_step" not in f.remedy:
            raise
        raise DataError(
            f.what,
            file=f.file,
            row=f.row,
            quantity="time",
            remedy="align a stretch before or after it (--from, --duration; from_s and to_s in "
            f"[log]), or {WITHOUT}",
        ) from None
    except DivergenceError as error:
        f = error.finding
        rate = float(np.linalg.norm(values_of(imu, GYRO).mean(axis=0)))
        raise DivergenceError(
            f"{f.what}; the gyros read {math.degrees(3600.0 * rate):.3g} deg/h in the mean, where "
            "the Earth turns at 15 deg/h",
            file=imu.attrs.get("source"),
            row=f.row,
            quantity=f.quantity,
            remedy=f"where that is their bias, take it off first, or {WITHOUT}; else {f.remedy}",
        ) from None
