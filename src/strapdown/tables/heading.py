"""Heading tables: where a compass or the baseline of two antennas points."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown.errors import DataError
from strapdown.tables.checks import checked_values, each_row, joined, source_of, values_of

HEADING = ["heading", "heading_sd"]

TURN = 2.0 * math.pi
# Part of a full turn in rad that a record fills, and that two rows leap, where it is in rad.
FILLED, LEAPT = 0.97, 0.9
# A standard deviation of a heading is below, deg: an even distribution has 104.
MOST_SD = 110.0


def heading_table(
    time: ArrayLike, heading: ArrayLike, heading_sd: ArrayLike, source: str | None = None
) -> pd.DataFrame:
    """Make a Heading table.

    Parameters
    ----------
    time : array_like, (n,), s
        On the clock of the inertial sensors.
    heading : array_like, (n,), deg
        Clockwise from north, -360 to 360.
    heading_sd : array_like, (n,) or float, deg
        Of the noise of each; infinite where nothing was measured.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame

    Raises
    ------
    DataError
        Shapes disagree, or as `check_heading`.
    """
    blocks = {"heading": (heading, None), "heading_sd": (each_row(heading_sd, time), None)}
    table = joined(time, HEADING, source, **blocks)
    check_heading(table)
    return table


def check_heading(table: pd.DataFrame) -> None:
    """Check a Heading table.

    Parameters
    ----------
    table : DataFrame

    Raises
    ------
    DataError
        A column is missing, a value is not finite, time does not advance, a standard deviation is
        not above zero or finite beyond 110 deg, a heading is beyond a turn, or all are within a
        turn in rad, and leap by one.
    """
    heading = checked_values(table, ["heading"], ["heading_sd"])[:, 0]
    sd = values_of(table, ["heading_sd"])[:, 0]
    source = source_of(table)
    beyond = np.flatnonzero(np.abs(heading) > 360.0)
    if beyond.size:
        row = int(beyond[0])
        raise DataError(
            "tables.heading-more-than-turn",
            file=source,
            row=row + 1,
            quantity="heading",
            heading=heading[row],
        )
    wide = np.flatnonzero(np.isfinite(sd) & (sd > MOST_SD))
    if wide.size:
        row = int(wide[0])
        raise DataError(
            "tables.standard-deviation-says-nothing-heading",
            file=source,
            row=row + 1,
            quantity="heading_sd",
            sd=sd[row],
        )
    leaps = np.abs(np.diff(heading))
    in_radians = np.ptp(heading) <= 1.001 * TURN if len(heading) else False
    if in_radians and np.ptp(heading) > FILLED * TURN and leaps.max() > LEAPT * TURN:
        row = int(np.argmax(leaps)) + 1
        raise DataError(
            "tables.all-headings-within-leap-radians",
            file=source,
            row=row + 1,
            quantity="heading",
            heading=heading.min(),
            heading_2=heading.max(),
            heading_3=heading[row - 1],
            heading_4=heading[row],
        )
