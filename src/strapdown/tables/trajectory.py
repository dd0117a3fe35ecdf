"""Attitude, References and Trajectory tables."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown.errors import DataError
from strapdown.rotation import within_half_turn
from strapdown.tables.checks import (
    EULER,
    GEODETIC,
    NED,
    QUATERNION,
    REFERENCE,
    VELOCITY,
    Array,
    as_array,
    check_columns,
    check_latitude,
    check_rows,
    check_same_length,
    checked_values,
    joined,
    source_of,
)

TRAJECTORY = [*GEODETIC, *VELOCITY, *EULER]


def trajectory_table(
    time: ArrayLike,
    place: ArrayLike,
    velocity: ArrayLike,
    euler: ArrayLike,
    source: str | None = None,
) -> pd.DataFrame:
    """Make a Trajectory table.

    Parameters
    ----------
    time : array_like, (n,), s
    place : array_like, (n, 3)
        Geodetic latitude and longitude in deg, height over the ellipsoid in m.
    velocity : array_like, (n, 3), m/s
        Relative to the Earth: north, east, down.
    euler : array_like, (n, 3), deg
        Roll, pitch, heading; body forward-right-down to north-east-down.
    source : str, optional
        Name for messages.

    Raises
    ------
    DataError
        Shapes disagree, or as `check_trajectory`.
    """
    blocks = {"place": (place, 3), "velocity": (velocity, 3), "euler": (euler, 3)}
    table = joined(time, TRAJECTORY, source, **blocks)
    check_trajectory(table)
    return table


def places_of(trajectory: pd.DataFrame) -> Array:
    """Return latitude and longitude in deg and height in m, longitudes within a turn.

    Parameters
    ----------
    trajectory : DataFrame
        A Trajectory table. Its longitude may be unwrapped where a vehicle circles the Earth.

    Returns
    -------
    ndarray, (n, 3)
        Longitudes beyond a full turn are wrapped to within half a turn; others keep their
        digits.
    """
    place = trajectory[GEODETIC].to_numpy(dtype=np.float64, copy=True)
    over = np.abs(place[:, 1]) > 360.0
    place[over, 1] = within_half_turn(place[over, 1])
    return place


def check_trajectory(table: pd.DataFrame) -> None:
    """Check a Trajectory table.

    DataError: a column is missing, a value is not finite, time does not advance, or a latitude is
    beyond 90 deg.
    """
    lat, lon = checked_values(table, TRAJECTORY)[:, :2].T
    check_latitude(lat, lon, source_of(table))


# Tables of trajectory errors, or of their standard deviations.


TRAJECTORY_ERROR = [*NED, *VELOCITY, *EULER]


def trajectory_error_table(
    time: ArrayLike,
    place: ArrayLike,
    velocity: ArrayLike,
    euler: ArrayLike,
    source: str | None = None,
) -> pd.DataFrame:
    """Make a TrajectoryError table: errors, or standard deviations.

    Parameters
    ----------
    time : array_like, (n,), s
    place : array_like, (n, 3), m
        North, east, down.
    velocity : array_like, (n, 3), m/s
        North, east, down.
    euler : array_like, (n, 3), deg
        Roll, pitch, heading.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        Errors are estimate minus truth.

    Raises
    ------
    DataError
        Shapes disagree, a value is not finite, or time does not advance.
    """
    blocks = {"place": (place, 3), "velocity": (velocity, 3), "euler": (euler, 3)}
    table = joined(time, TRAJECTORY_ERROR, source, **blocks)
    check_trajectory_error(table)
    return table


def check_trajectory_error(table: pd.DataFrame) -> None:
    """Check a TrajectoryError table that holds errors.

    `table`: further columns are ignored. DataError: a column is missing, a value is not finite, or
    time does not advance.
    """
    checked_values(table, TRAJECTORY_ERROR)


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
        Quaternion, and roll, pitch, heading in deg.

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

    DataError: a column is missing, a value is not finite, time does not advance, or a quaternion's
    norm is not 1 within 1 %.
    """
    values = checked_values(table, QUATERNION + EULER)
    rotation.conjugate(values[:, : len(QUATERNION)])


# References tables: instants of known attitude.


REFERENCE_KINDS = ("known", "tilt", "same", "turns")


def references_table(rows: Sequence[dict[str, object]], source: str | None = None) -> pd.DataFrame:
    """Make a References table.

    Parameters
    ----------
    rows : sequence of dict
        Each with ``time`` (s) and ``kind``. ``known`` adds ``roll``, ``pitch``, ``heading``
        in deg; ``tilt`` adds ``roll`` and ``pitch`` only, the direction of gravity; ``same``
        adds ``since`` (s), the instant whose attitude it shares; ``turns``
        adds ``since``, ``turns`` (whole or not; positive right-handed) and ``axis`` (``x``,
        ``y``, ``z`` of the body, forward-right-down). ``sd`` in deg is the standard deviation.
    source : str, optional
        Name for messages.

    Raises
    ------
    DataError
        As `check_references`.
    """
    table = pd.DataFrame([dict(r) for r in rows], columns=REFERENCE)
    numbers = [c for c in REFERENCE if c not in ("kind", "axis")]
    for name in numbers:
        table[name] = as_array(table[name].tolist(), None, name, source)
    table.attrs["source"] = source
    check_references(table)
    return table


def check_references(table: pd.DataFrame) -> None:
    """Check a References table.

    DataError: a column is missing, the kind is unknown, or a kind lacks what it needs.
    """
    source = source_of(table)
    check_columns(table, REFERENCE, source)
    needs = {
        "known": ["time", *EULER],
        "tilt": ["time", "roll", "pitch"],
        "same": ["time", "since"],
        "turns": ["time", "since", "turns"],
    }
    for number, (_, row) in enumerate(table.iterrows(), start=1):
        kind = row["kind"]
        if kind not in needs:
            raise DataError(
                "tables.unknown-kind",
                file=source,
                row=number,
                quantity="kind",
                kind=kind,
                reference_kinds=REFERENCE_KINDS,
            )
        for name in needs[kind]:
            if not np.isfinite(float(row[name])):
                raise DataError(
                    "tables.reference-kind-needs-missing",
                    file=source,
                    row=number,
                    quantity=name,
                    kind=kind,
                    needs=needs[kind],
                )
        if kind == "turns" and row["axis"] not in ("x", "y", "z"):
            raise DataError(
                "tables.axis", file=source, row=number, quantity="axis", at_row=row["axis"]
            )
