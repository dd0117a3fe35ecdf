"""Attitude tables."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown.tables.checks import as_array, check_rows, check_same_length, checked_values
from strapdown.tables.columns import EULER, QUATERNION


def attitude_table(time: ArrayLike, q_nb: ArrayLike, source: str | None = None) -> pd.DataFrame:
    """Make an Attitude table.

    Parameters
    ----------
    time : array_like, (n,), s
    q_nb : array_like, (n, 4)
        Body to local level, scalar first, norm 1 within 1 %.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        Quaternion, and roll, pitch, heading in degrees.

    Raises
    ------
    DataError
        Shapes disagree, a value is not finite, time does not advance, or a norm is not 1.
    """
    stamps, q = as_array(time, None, "time", source), as_array(q_nb, 4, "q_nb", source)
    check_same_length(source, time=stamps, q_nb=q)
    check_rows(q, QUATERNION, source)
    table = pd.DataFrame(
        np.hstack([q, rotation.euler_from_quaternion(q)]),
        index=pd.Index(stamps, name="time"),
        columns=QUATERNION + EULER,
        copy=False,
    )
    table.attrs["source"] = source
    check_attitude(table)
    return table


def check_attitude(table: pd.DataFrame) -> None:
    """Check an Attitude table.

    Parameters
    ----------
    table : DataFrame

    Raises
    ------
    DataError
        A column is missing, a value is not finite, time does not advance, or a quaternion's
        norm is not 1 within 1 %.
    """
    values = checked_values(table, QUATERNION + EULER)
    rotation.conjugate(values[:, : len(QUATERNION)])
