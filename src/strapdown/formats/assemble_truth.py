"""Attitude truth, from the log itself or from a file of its own."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats.body_axes import axes_matrix, mirrored
from strapdown.formats.columns import EULERS, QUATERNIONS, parse_axes
from strapdown.formats.find_columns import Column, find_columns
from strapdown.formats.numbers import numbers, ticks_of
from strapdown.formats.recording import Origin, RawLog, Reading, ReadOptions
from strapdown.formats.stamps import read_stamps
from strapdown.formats.unit_words import parse_unit
from strapdown.tables import attitude_table

Array = NDArray[np.float64]
Turn = tuple[list[int], list[float]]

AS_THEY_ARE: Turn = ([0, 1, 2], [1.0, 1.0, 1.0])

# Optical systems write a zero quaternion while their markers are lost.
LOST = 1e-6


def truth_of_log(
    raw: RawLog,
    found: dict[str, Column],
    time: Array,
    kept: NDArray[np.int64],
    axes: Turn,
    readings: list[Reading],
    findings: list[Finding],
) -> tuple[pd.DataFrame | None, NDArray[np.bool_] | None]:
    """Return the truth of a log, in the body axes that the log is read in.

    Parameters
    ----------
    raw : RawLog
    found : dict of str to Column
    time : ndarray, (n,), s
        Stamps of the rows used.
    kept : ndarray of int, (n,)
        Those rows.
    axes : tuple
        Sensor axis of each body axis, and its sign.
    readings, findings : list
        Its source columns and findings are appended.

    Returns
    -------
    truth : DataFrame or None
    scored : ndarray of bool, or None
        Rows of `truth` that count for errors.

    Raises
    ------
    ConfigError
        The axes are a mirror image, for which no attitude exists.
    """
    if raw.truth is not None:
        q_ns, scored = raw.truth.q_ns[kept], raw.truth.scored[kept]
    else:
        # The frames of an attitude are unknown unless the file states its axes.
        q, names = _quaternions(raw, found) if raw.axes else (None, [])
        if q is None:
            _mention(raw, found, findings)
            return None, None
        # Avoid copies of a long log.
        q = q if kept.size == len(q) else q[kept]
        if not _known(q).any():
            return None, None
        for name in names:
            column = found[name]
            values = numbers(raw, column, name)
            first = float(values[kept[np.argmax(np.isfinite(values[kept]))]])
            readings.append(Reading(column.source, name, column.unit or "", column.why, first))
        q_ns, scored = q, np.ones(kept.size, dtype=bool)
        del q
    known = _known(q_ns)
    if not known.any():
        return None, None
    q_nb = q_ns if known.all() else q_ns[known]
    if axes != AS_THEY_ARE:
        q_nb = rotation.compose(q_nb, _sensor_from_body(raw, axes))
    return attitude_table(time[known], q_nb, raw.name), scored[known]


def truth_of_file(raw: RawLog, options: ReadOptions, origin: Origin) -> pd.DataFrame | None:
    """Return the truth of a separate file, on the clock of a log.

    Parameters
    ----------
    raw : RawLog
    options : ReadOptions
        Of these, `repair` is used, and the axes of the log where the attitude is that of its
        sensor.
    origin : Origin
        Origin of the log's time.

    Returns
    -------
    DataFrame or None
        An Attitude table of the rows with known attitude; None if there is none.

    Raises
    ------
    DataError
        Time cannot be used.
    """
    found = find_columns(raw, ReadOptions())
    if raw.truth is not None:
        q: Array | None = _of_body(raw, raw.truth.q_ns, options.axes)
    else:
        q, _ = _quaternions(raw, found)
    if q is None or "time" not in found:
        return None
    ticks, dated = ticks_of(raw, found["time"])
    rows = np.flatnonzero(_known(q) & np.isfinite(ticks.astype(np.float64)))
    if not rows.size:
        return None
    unit = "ns" if dated else found["time"].unit
    try:
        stamps = read_stamps(
            ticks[rows],
            parse_unit(unit, "time") if unit else None,
            "",
            file=raw.name,
            row=lambda k: raw.row(int(rows[k])),
            repair=options.repair,
            origin=origin,
            only_seconds=True,
        )
    except DataError as error:
        if unit is not None:
            raise
        # The options that would state it are those of the log.
        raise DataError(
            "io.truth-time-unusable",
            file=raw.name,
            row=error.finding.row,
            quantity="time",
            reason=error.finding,
        ) from None
    return attitude_table(stamps.seconds[stamps.keep], q[rows][stamps.keep], raw.name)


def _of_body(raw: RawLog, q_ns: Array, text: str | None) -> Array:
    """Convert the attitude of the sensor to that of the body axes of a log."""
    axes = parse_axes(text) if text else AS_THEY_ARE
    if axes == AS_THEY_ARE:
        return q_ns
    known = _known(q_ns)
    q = np.full_like(q_ns, np.nan)
    q[known] = rotation.compose(q_ns[known], _sensor_from_body(raw, axes))
    return q


def _known(q: Array) -> NDArray[np.bool_]:
    large = (q.max(axis=1) > LOST) | (q.min(axis=1) < -LOST)
    known: NDArray[np.bool_] = np.isfinite(q).all(axis=1) & large
    return known


def _quaternions(raw: RawLog, found: dict[str, Column]) -> tuple[Array | None, list[str]]:
    """Return the attitude of each row, NaN where unknown, and its source columns."""
    if all(n in found for n in QUATERNIONS):
        parts = [numbers(raw, found[n], n) for n in QUATERNIONS]
        return np.column_stack(parts).astype(np.float64, copy=False), list(QUATERNIONS)
    if not all(n in found for n in EULERS):
        return None, []
    angles = np.column_stack([numbers(raw, found[n], n) for n in EULERS]).astype(np.float64)
    units = {found[n].unit for n in EULERS}
    if units == {"rad"}:
        angles = np.degrees(angles)
    elif units != {"deg"}:
        raise DataError("io.unit-angles-not-stated", file=raw.name, quantity=", ".join(EULERS))
    finite = np.isfinite(angles).all(axis=1)
    q = np.full((len(angles), 4), np.nan)
    q[finite] = rotation.quaternion_from_euler(angles[finite])
    return q, list(EULERS)


def _mention(raw: RawLog, found: dict[str, Column], findings: list[Finding]) -> None:
    """Note that an attitude of unknown frames, as from a phone, is not used as truth."""
    if not raw.axes and any(set(names) <= set(found) for names in (QUATERNIONS, EULERS)):
        findings.append(
            Finding(
                "io.attitude-not-used",
                severity="note",
                file=raw.name,
                quantity="attitude",
            )
        )


def _sensor_from_body(raw: RawLog, axes: Turn) -> Array:
    """Return the quaternion ``q_sb`` from body axes to the axes of the file's truth."""
    if mirrored(*axes):
        raise ConfigError("io.truth-axes-mirrored", file=raw.name, quantity="--axes")
    return rotation.quaternion_from_dcm(axes_matrix(*axes).T)
