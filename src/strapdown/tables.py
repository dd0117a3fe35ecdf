"""The tables that flow between stages: their columns, their units, and who checks them.

Each is a pandas DataFrame with fixed columns. A table that was made by the functions here is
valid; a table from elsewhere is checked by ``check_*`` before it is used. Inputs are never
changed in place.

======================  =====================  ===================================================
table                   index                  columns
======================  =====================  ===================================================
Imu                     ``time`` s             ``gyro_x..z`` rad/s, and where there is an
                                               accelerometer ``accel_x..z`` m/s² (specific force),
                                               where there is a magnetometer ``mag_x..z`` µT;
                                               body axes forward-right-down;
                                               ``attrs["sampling"]``: ``instantaneous`` at the
                                               stamp, or ``mean`` over the interval that ends there
Increments              ``time`` s, its end    ``dt`` s, ``theta_x..z`` rad, ``dtheta_x..z`` rad
                                               (change of the rate over the step times `dt`)
Attitude                ``time`` s             ``q_w q_x q_y q_z`` (body to local level) and
                                               ``roll pitch heading`` deg
References              none                   ``time`` s, ``kind`` (``known``, ``tilt``,
                                               ``same``, ``turns``), ``since`` s, ``roll pitch
                                               heading`` deg, ``turns``, ``axis``, ``sd`` deg
======================  =====================  ===================================================
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.exceptions import DataError

Array = NDArray[np.float64]

GYRO = ["gyro_x", "gyro_y", "gyro_z"]
ACCEL = ["accel_x", "accel_y", "accel_z"]
MAG = ["mag_x", "mag_y", "mag_z"]
THETA = ["theta_x", "theta_y", "theta_z"]
DTHETA = ["dtheta_x", "dtheta_y", "dtheta_z"]
QUATERNION = ["q_w", "q_x", "q_y", "q_z"]
EULER = ["roll", "pitch", "heading"]
REFERENCE = ["time", "kind", "since", *EULER, "turns", "axis", "sd"]
SAMPLINGS = ("instantaneous", "mean")
REFERENCE_KINDS = ("known", "tilt", "same", "turns")

__all__ = [
    "Gap",
    "attitude_table",
    "check_attitude",
    "check_imu",
    "check_increments",
    "check_references",
    "find_gaps",
    "imu_table",
    "increments_table",
    "references_table",
]


@dataclass(frozen=True)
class Gap:
    """A hole in a record.

    Attributes
    ----------
    start, end : float, s
        The stamps on its two sides.
    usual : float, s
        The step that the record usually keeps.
    sample : int
        Position of the sample after the gap, counted from 0.
    """

    start: float
    end: float
    usual: float
    sample: int

    @property
    def length(self) -> float:
        """Length of the gap in s."""
        return self.end - self.start


def find_gaps(time: ArrayLike) -> list[Gap]:
    """Find the steps that are far longer than a record's own habit.

    Parameters
    ----------
    time : array_like, (n,), s
        Increasing stamps. Bursts, as of a phone that sends over a network, are a habit: a
        gap is a step of more than three times the step that 95 % of the steps do not exceed.

    Returns
    -------
    list of Gap
        In order of time.
    """
    stamps = np.asarray(time, dtype=np.float64)
    steps = np.diff(stamps)
    if steps.size < 2:
        return []
    usual = float(np.quantile(steps, 0.95, method="lower"))
    return [
        Gap(float(stamps[k]), float(stamps[k + 1]), usual, int(k) + 1)
        for k in np.flatnonzero(steps > 3.0 * usual)
    ]


def _array(values: ArrayLike, columns: int | None, name: str, source: str | None = None) -> Array:
    """Numbers of shape (n,), or (n, columns)."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty((0, 0, 0))
    wanted = 1 if columns is None else 2
    if array.ndim != wanted or (columns is not None and array.shape[1] != columns):
        raise DataError(
            f"it is no array of numbers of shape ({'n,' if columns is None else f'n, {columns}'})",
            file=source,
            quantity=name,
            remedy="pass one row a sample",
        )
    return array


def _same_length(source: str | None, **arrays: Array) -> None:
    if len({len(a) for a in arrays.values()}) > 1:
        lengths = ", ".join(f"{name} {len(a)}" for name, a in arrays.items())
        raise DataError(
            f"the arrays have different lengths: {lengths}",
            file=source,
            remedy="pass one row a sample in each",
        )


def _check_rows(values: Array, columns: Sequence[str], source: str | None) -> None:
    bad = ~np.isfinite(values)
    if bad.any():
        row, column = (int(i) for i in np.argwhere(bad)[0])
        raise DataError(
            f"not a finite number ({values[row, column]})",
            file=source,
            row=row + 1,
            quantity=columns[column],
            remedy="drop the row, or fill it before the table is made",
        )


def _check_time(time: Array, source: str | None) -> None:
    _check_rows(time[:, None], ["time"], source)
    steps = np.diff(time)
    if (steps <= 0.0).any():
        row = int(np.argmax(steps <= 0.0)) + 1
        raise DataError(
            f"time does not advance: {time[row - 1]:.9g} s is followed by {time[row]:.9g} s",
            file=source,
            row=row + 1,
            quantity="time",
            remedy="sort the rows and drop repeated stamps",
        )


def _check_columns(table: pd.DataFrame, columns: Sequence[str], source: str | None) -> None:
    missing = [c for c in columns if c not in table.columns]
    if missing:
        raise DataError(
            f"missing columns: {', '.join(missing)}; it has {', '.join(map(str, table.columns))}",
            file=source,
            remedy=f"a table of this kind needs {', '.join(columns)}",
        )


def _values(table: pd.DataFrame, columns: Sequence[str]) -> Array:
    return np.ascontiguousarray(table[list(columns)].to_numpy(dtype=np.float64))


def _index(table: pd.DataFrame) -> Array:
    return np.asarray(table.index.to_numpy(), dtype=np.float64)


def imu_table(
    time: ArrayLike,
    gyro: ArrayLike,
    accel: ArrayLike | None = None,
    mag: ArrayLike | None = None,
    *,
    sampling: str = "instantaneous",
    source: str | None = None,
) -> pd.DataFrame:
    """Make an Imu table.

    Parameters
    ----------
    time : array_like, (n,), s
        Increasing stamps, any origin, any spacing.
    gyro : array_like, (n, 3), rad/s
        Rate of the body relative to inertial space, in body axes (forward, right, down).
    accel : array_like, (n, 3), m/s², optional
        Specific force in body axes: about (0, 0, -9.8) at rest and level.
    mag : array_like, (n, 3), µT, optional
        Magnetic field in body axes.
    sampling : {'instantaneous', 'mean'}
        Whether a row holds the value at its stamp or the mean over the interval ending there.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame
        Indexed by ``time``.

    Raises
    ------
    DataError
        Shapes disagree, a value is not finite, time does not advance, or `sampling` is
        unknown.
    """
    stamps = _array(time, None, "time", source)
    columns, values = list(GYRO), _array(gyro, 3, "gyro", source)
    _same_length(source, time=stamps, gyro=values)
    if accel is not None:
        force = _array(accel, 3, "accel", source)
        _same_length(source, time=stamps, accel=force)
        columns, values = columns + ACCEL, np.hstack([values, force])
    if mag is not None:
        field = _array(mag, 3, "mag", source)
        _same_length(source, time=stamps, mag=field)
        columns, values = columns + MAG, np.hstack([values, field])
    table = pd.DataFrame(values, index=pd.Index(stamps, name="time"), columns=columns)
    table.attrs = {"sampling": sampling, "source": source, "axes": "forward-right-down"}
    check_imu(table)
    return table


def check_imu(table: pd.DataFrame) -> None:
    """Check an Imu table.

    Parameters
    ----------
    table : DataFrame

    Raises
    ------
    DataError
        A column is missing, a value is not finite, time does not advance, there are fewer
        than two samples, or ``attrs["sampling"]`` does not say how the rows were sampled.
    """
    source = table.attrs.get("source")
    _check_columns(table, GYRO, source)
    if table.attrs.get("sampling") not in SAMPLINGS:
        raise DataError(
            f"attrs['sampling'] is {table.attrs.get('sampling')!r}",
            file=source,
            quantity="sampling",
            remedy="say 'instantaneous' (rate at the stamp) or 'mean' (over the interval "
            "that ends there)",
        )
    columns = list(GYRO)
    for triad in (ACCEL, MAG):
        there = [c for c in triad if c in table.columns]
        if there:
            _check_columns(table, triad, source)
        columns += there
    if len(table) < 2:
        raise DataError(
            f"{len(table)} sample: attitude is the integral of a rate, and needs at least two",
            file=source,
            quantity="time",
            remedy="record for longer, or check that the right file was given",
        )
    _check_time(_index(table), source)
    _check_rows(_values(table, columns), columns, source)


def increments_table(
    time: ArrayLike, dt: ArrayLike, theta: ArrayLike, dtheta: ArrayLike | None = None
) -> pd.DataFrame:
    """Make an Increments table.

    Parameters
    ----------
    time : array_like, (n,), s
        End of each step.
    dt : array_like, (n,), s
        Length of each step.
    theta : array_like, (n, 3), rad
        Integral of the body rate over the step.
    dtheta : array_like, (n, 3), rad, optional
        Change of the body rate over the step times `dt`; zero, where it is not known.

    Returns
    -------
    DataFrame

    Raises
    ------
    DataError
        Shapes disagree, a value is not finite, or a step has no positive length.
    """
    ends, lengths = _array(time, None, "time"), _array(dt, None, "dt")
    angles = _array(theta, 3, "theta")
    change = np.zeros_like(angles) if dtheta is None else _array(dtheta, 3, "dtheta")
    _same_length(None, time=ends, dt=lengths, theta=angles, dtheta=change)
    table = pd.DataFrame(
        np.column_stack([lengths, angles, change]),
        index=pd.Index(ends, name="time"),
        columns=["dt", *THETA, *DTHETA],
    )
    check_increments(table)
    return table


def check_increments(table: pd.DataFrame) -> None:
    """Check an Increments table.

    Parameters
    ----------
    table : DataFrame

    Raises
    ------
    DataError
        A column is missing, a value is not finite, time does not advance, a step is not
        positive, or a step begins before the one before it has ended.
    """
    source = table.attrs.get("source")
    columns = ["dt", *THETA, *DTHETA]
    _check_columns(table, columns, source)
    time, dt = _index(table), _values(table, ["dt"])[:, 0]
    _check_time(time, source)
    _check_rows(_values(table, columns), columns, source)
    # Stamps of epoch size carry no more than this.
    slack = 8.0 * float(np.spacing(np.abs(time).max(initial=1.0)))
    overlap = np.flatnonzero((dt <= 0.0) | np.r_[False, time[1:] - dt[1:] < time[:-1] - slack])
    if overlap.size:
        row = int(overlap[0])
        raise DataError(
            f"a step of {dt[row]:.9g} s ending at {time[row]:.9g} s is not positive, or begins "
            "before the last one ended",
            file=source,
            row=row + 1,
            quantity="dt",
            remedy="the index is the end of each step, and dt its length in seconds",
        )


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
    stamps, q = _array(time, None, "time", source), _array(q_nb, 4, "q_nb", source)
    _same_length(source, time=stamps, q_nb=q)
    _check_rows(q, QUATERNION, source)
    table = pd.DataFrame(
        np.hstack([q, rotation.euler_from_quaternion(q)]),
        index=pd.Index(stamps, name="time"),
        columns=QUATERNION + EULER,
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
    source = table.attrs.get("source")
    _check_columns(table, QUATERNION + EULER, source)
    _check_time(_index(table), source)
    _check_rows(_values(table, QUATERNION + EULER), QUATERNION + EULER, source)
    rotation.conjugate(_values(table, QUATERNION))


def references_table(rows: Sequence[dict[str, object]], source: str | None = None) -> pd.DataFrame:
    """Make a References table.

    Parameters
    ----------
    rows : sequence of dict
        Each with ``time`` (s) and ``kind``. ``known`` adds ``roll``, ``pitch``, ``heading``
        in deg; ``tilt`` adds ``roll`` and ``pitch`` only, the direction of gravity; ``same``
        adds ``since`` (s), the instant whose attitude it shares; ``turns``
        adds ``since``, ``turns`` (whole or not; positive right-handed) and ``axis`` (``x``,
        ``y``, ``z`` of the body, forward-right-down). ``sd`` in deg is how well it is known.
    source : str, optional
        Name for messages.

    Returns
    -------
    DataFrame

    Raises
    ------
    DataError
        As `check_references`.
    """
    table = pd.DataFrame([dict(r) for r in rows], columns=REFERENCE)
    numbers = [c for c in REFERENCE if c not in ("kind", "axis")]
    for name in numbers:
        table[name] = _array(table[name].tolist(), None, name, source)
    table.attrs["source"] = source
    check_references(table)
    return table


def check_references(table: pd.DataFrame) -> None:
    """Check a References table.

    Parameters
    ----------
    table : DataFrame

    Raises
    ------
    DataError
        A column is missing, the kind is unknown, or a kind lacks what it needs.
    """
    source = table.attrs.get("source")
    _check_columns(table, REFERENCE, source)
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
                f"unknown kind {kind!r}",
                file=source,
                row=number,
                quantity="kind",
                remedy=f"use one of {', '.join(REFERENCE_KINDS)}",
            )
        for name in needs[kind]:
            if not np.isfinite(float(row[name])):
                raise DataError(
                    f"a reference of kind '{kind}' needs it, and it is missing",
                    file=source,
                    row=number,
                    quantity=name,
                    remedy=f"kind '{kind}' needs {', '.join(needs[kind])}",
                )
        if kind == "turns" and row["axis"] not in ("x", "y", "z"):
            raise DataError(
                f"the axis is {row['axis']!r}",
                file=source,
                row=number,
                quantity="axis",
                remedy="use x, y or z: the body's forward, right and down axis",
            )
