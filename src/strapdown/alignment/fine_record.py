"""What is said of the record of a fine alignment that cannot be carried through."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pandas as pd

from strapdown.errors import DataError, DivergenceError
from strapdown.tables import GYRO
from strapdown.tables.checks import values_of

__all__ = ["WITHOUT", "telling_record"]

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
            "alignment.message",
            file=f.file,
            row=f.row,
            quantity="time",
            message=f.what,
            remedy_text=f"align a stretch before or after it (--from, --duration; from_s and to_s in [log]), or {WITHOUT}",
        ) from None
    except DivergenceError as error:
        f = error.finding
        rate = float(np.linalg.norm(values_of(imu, GYRO).mean(axis=0)))
        raise DivergenceError(
            "alignment.gyros-read-h-mean-earth",
            file=imu.attrs.get("source"),
            row=f.row,
            quantity=f.quantity,
            reason=f,
            rate_deg=math.degrees(3600.0 * rate),
        ) from None
