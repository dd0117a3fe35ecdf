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

__all__ = ["telling_record"]

GAPS = ("mechanization.gap-before-body-did-not", "mechanization.gap-body-did-not-known")


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
        # The remedy of the mechanization is an argument that an alignment does not have.
        if f.code not in GAPS:
            raise
        raise DataError(
            "alignment.gap-in-fine-record", file=f.file, row=f.row, quantity="time", reason=f
        ) from None
    except DivergenceError as error:
        f = error.finding
        rate = float(np.linalg.norm(values_of(imu, GYRO).mean(axis=0)))
        raise DivergenceError(
            "alignment.fine-alignment-diverged",
            file=imu.attrs.get("source"),
            row=f.row,
            quantity=f.quantity,
            reason=f,
            rate_deg=math.degrees(3600.0 * rate),
        ) from None
