"""Checks common to all tables: shapes, columns, finite numbers, advancing time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.constants import Array as Array
from strapdown.errors import DataError
from strapdown.tables.on_disk import let_go, parts_of, step_range

# Upper limits of any rate and specific force; squares of larger ones soon overflow a double. A
# shell is fired with 1e6 m/s².
IMPOSSIBLE_RATE = 1e6  # rad/s
IMPOSSIBLE_FORCE = 1e8  # m/s²


def as_array(values: ArrayLike, columns: int | None, name: str, source: str | None = None) -> Array:
    """Convert to numbers of shape (n,), or (n, columns)."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty((0, 0, 0))
    wanted = 1 if columns is None else 2
    if array.ndim != wanted or (columns is not None and array.shape[1] != columns):
        raise DataError(
            "tables.no-array-numbers-shape",
            file=source,
            quantity=name,
            value="n," if columns is None else f"n, {columns}",
        )
    return array


def check_same_length(source: str | None, **arrays: Array) -> None:
    """Check that all arrays have the same number of rows."""
    if len({len(a) for a in arrays.values()}) > 1:
        lengths = [f"{name} {len(a)}" for name, a in arrays.items()]
        raise DataError("tables.arrays-different-lengths", file=source, lengths=lengths)


def joined(
    time: ArrayLike,
    columns: Sequence[str],
    source: str | None,
    **blocks: tuple[ArrayLike, int | None],
) -> pd.DataFrame:
    """Join blocks, each of shape (n,) or (n, columns), over one index of stamps."""
    stamps = as_array(time, None, "time", source)
    arrays = {
        name: as_array(values, width, name, source) for name, (values, width) in blocks.items()
    }
    check_same_length(source, time=stamps, **arrays)
    table = pd.DataFrame(
        np.column_stack(list(arrays.values())),
        index=pd.Index(stamps, name="time"),
        columns=list(columns),
        copy=False,
    )
    table.attrs["source"] = source
    return table


def each_row(values: ArrayLike, time: ArrayLike, width: int | None = None) -> ArrayLike:
    """Expand to shape (n,), or (n, width), where one row is given for all."""
    one = () if width is None else (width,)
    return np.full((np.size(time), *one), values) if np.shape(values) == one else values


def checked_values(table: pd.DataFrame, columns: Sequence[str], sd: Sequence[str] = ()) -> Array:
    """Return columns as floats, after checking columns, stamps, values, standard deviations.

    DataError: a column is missing, time does not advance, a value is not finite, or a standard
    deviation is not above zero.
    """
    source = source_of(table)
    check_columns(table, [*columns, *sd], source)
    check_time(index_of(table), source)
    values = view_of(table, columns)
    check_rows(values, columns, source)
    if sd:
        spread = view_of(table, sd)
        refuse_cell(~(spread > 0.0), "tables.no-standard-deviation", source, sd, values=spread)
    return values


def refuse_row(
    bad: NDArray[np.bool_], code: str, source: str | None, quantity: str, **values: Array
) -> None:
    """Raise `DataError` at the first row that is bad, with the values there."""
    rows = np.flatnonzero(bad)
    if rows.size:
        k = int(rows[0])
        at_row = {name: array[k] for name, array in values.items()}
        raise DataError(code, file=source, row=k + 1, quantity=quantity, data=at_row)


def refuse_cell(
    bad: NDArray[np.bool_], code: str, source: str | None, columns: Sequence[str], **values: Array
) -> None:
    """Raise `DataError` at the first cell that is bad, row by row, with the values there."""
    cells = np.argwhere(bad)
    if len(cells):
        row, column = (int(i) for i in cells[0])
        at_cell = {name: array[row, column] for name, array in values.items()}
        raise DataError(code, file=source, row=row + 1, quantity=columns[column], data=at_cell)


def check_latitude(lat: Array, lon: Array, source: str | None) -> None:
    """Check that latitudes are within 90 deg."""
    beyond = np.abs(lat) > 90.0
    if beyond.any():
        exchanged = np.all(np.abs(lon) <= 90.0)
        code = "tables.latitude-beyond-pole" if exchanged else "tables.latitude-beyond-pole-2"
        refuse_row(beyond, code, source, "lat", lat=lat)


def all_finite(values: Array) -> bool:
    """Whether every number of an array, (n, ...), is finite; it is let go of."""
    for part in parts_of(len(values), int(np.prod(values.shape[1:]))):
        # A sum is finite only if every term is. It needs no memory and is several times faster
        # than a check of each value.
        with np.errstate(invalid="ignore", over="ignore"):
            finite = np.isfinite(values[part].sum()) or np.isfinite(values[part]).all()
        let_go(values)
        if not finite:
            return False
    return True


def check_rows(values: Array, columns: Sequence[str], source: str | None) -> None:
    """Check that every value is finite; the message names the first that is not."""
    if all_finite(values):
        return
    bad = ~np.isfinite(values)
    if bad.any():
        row, column = (int(i) for i in np.argwhere(bad)[0])
        rows = np.flatnonzero(bad.any(axis=1))
        raise DataError(
            "tables.not-finite-numbers" if rows.size > 1 else "tables.not-finite-number",
            file=source,
            row=row + 1,
            quantity=columns[column],
            values=values[row, column],
            count=rows.size,
            last_row=rows[-1] + 1,
        )


def check_time(time: Array, source: str | None) -> None:
    """Check that stamps are finite and advance."""
    check_rows(time[:, None], ["time"], source)
    for part in parts_of(len(time) - 1, 1):
        steps = np.diff(time[part.start : part.stop + 1])
        let_go(time)
        if steps.min() > 0.0:
            continue
        row = part.start + int(np.argmax(steps <= 0.0)) + 1
        raise DataError(
            "tables.time-does-not-advance-followed",
            file=source,
            row=row + 1,
            quantity="time",
            time=time[row - 1],
            time_2=time[row],
        )


def check_columns(table: pd.DataFrame, columns: Sequence[str], source: str | None) -> None:
    """Check that every column is present."""
    missing = [c for c in columns if c not in table.columns]
    if missing:
        raise DataError(
            "tables.missing-columns",
            file=source,
            missing=missing,
            columns=table.columns,
            columns_2=columns,
        )


def source_of(table: object) -> str | None:
    """Return the name of a table's source for messages.

    DataError: the object is not a DataFrame.
    """
    if not isinstance(table, pd.DataFrame):
        raise DataError("tables.table-needed-kind", quantity="table", name=type(table).__name__)
    source = table.attrs.get("source")
    return None if source is None else str(source)


def is_number(value: object) -> bool:
    """Whether a value is one real number, of Python or of numpy."""
    return isinstance(value, Real)


def values_of(table: pd.DataFrame, columns: Sequence[str]) -> Array:
    """Return columns as one contiguous array of floats, which is the caller's own."""
    return np.require(view_of(table, columns), requirements=["C", "W", "O"])


def view_of(table: pd.DataFrame, columns: Sequence[str]) -> Array:
    """Return columns as floats to be read, of a table made here without a copy.

    Such a table is one block, of which pandas gives a view; a copy of its columns, selected by
    name, would take several times what a kernel does with them.
    """
    own, wanted = list(table.columns), list(columns)
    if not wanted or len(set(own)) < len(own) or not set(wanted) <= set(own):
        return np.asarray(table[wanted].to_numpy(dtype=np.float64))
    manager: Any = getattr(table, "_mgr", None)
    whole = table.to_numpy() if getattr(manager, "is_single_block", False) else None
    places = [own.index(name) for name in wanted]
    if whole is None or whole.dtype != np.float64:
        parts = [table[name].to_numpy(dtype=np.float64) for name in wanted]
    elif places == [*range(places[0], places[0] + len(places))]:
        return whole[:, places[0] : places[0] + len(places)]
    else:
        parts = [whole[:, place] for place in places]
    out = np.empty((len(table), len(wanted)))
    for k, part in enumerate(parts):
        out[:, k] = part
    return out


def channels_of(table: pd.DataFrame, columns: Sequence[str]) -> Iterator[Array]:
    """Yield columns to be read, each an array of floats; each is let go of after its use."""
    for channel in view_of(table, columns).T:
        yield channel
        let_go(channel)


def index_of(table: pd.DataFrame) -> Array:
    """Return the stamps as floats."""
    return np.asarray(table.index.to_numpy(), dtype=np.float64)


def check_steps(time: Array, dt: Array, source: str | None) -> None:
    """Check that steps, which end at `time`, are positive and do not overlap."""
    # Resolution of stamps of epoch size.
    slack = 8.0 * float(np.spacing(np.abs(time).max(initial=1.0)))
    overlap = dt <= 0.0
    overlap[1:] |= time[1:] - dt[1:] < time[:-1] - slack
    refuse_row(overlap, "tables.step-ending-not-positive-or", source, "dt", dt=dt, time=time)


# Column names.


GYRO = ["gyro_x", "gyro_y", "gyro_z"]
ACCEL = ["accel_x", "accel_y", "accel_z"]
MAG = ["mag_x", "mag_y", "mag_z"]
THETA = ["theta_x", "theta_y", "theta_z"]
DTHETA = ["dtheta_x", "dtheta_y", "dtheta_z"]
PHI = ["phi_x", "phi_y", "phi_z"]
DV = ["dv_x", "dv_y", "dv_z"]
DR = ["dr_x", "dr_y", "dr_z"]
QUATERNION = ["q_w", "q_x", "q_y", "q_z"]
EULER = ["roll", "pitch", "heading"]
GEODETIC = ["lat", "lon", "alt"]
VELOCITY = ["VN", "VE", "VD"]
NED = ["north", "east", "down"]
POSITION_SD = ["north_sd", "east_sd", "down_sd"]
VELOCITY_SD = ["VN_sd", "VE_sd", "VD_sd"]
REFERENCE = ["time", "kind", "since", *EULER, "turns", "axis", "sd"]
#: Attribute of Gnss and Trajectory tables whose heights count from the level of the file, which
#: may be the sea, and not from the ellipsoid.
HEIGHTS_AS_STATED = "heights_as_stated"
#: Attribute of Gnss tables of velocities alone: their place is the origin that the user stated.
ORIGIN_STATED = "origin_stated"


def height_words(*, as_stated: bool) -> str:
    """Level from which heights count, to follow "height"."""
    if as_stated:
        return "over the level that the fixes count from (of the sea, say), not the ellipsoid"
    return "over the ellipsoid"


#: Clock of a table (``attrs["clock"]``) whose stamps count from its own start.
RELATIVE = "relative"


# Gaps in a record.


@dataclass(frozen=True)
class Gap:
    """A gap in a record.

    `start`, `end` (s): the stamps on either side. `usual` (s): the usual step of the record.
    `sample`: index of the sample after the gap, from 0.
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
    """Find the steps that are far longer than the usual step of a record.

    `time` ((n,), s): increasing stamps. A gap is a step of more than three times the step that 95 %
    of the steps do not exceed, so that regular bursts, as of a phone over a network, are not gaps.
    Returns in order of time.
    """
    stamps = np.asarray(time, dtype=np.float64)
    least, most = step_range(stamps)
    if len(stamps) < 3 or most <= 3.0 * least:
        return []  # faster, as most records are regular
    steps = np.diff(stamps)
    usual = float(np.quantile(steps, 0.95, method="lower"))
    return [
        Gap(float(stamps[k]), float(stamps[k + 1]), usual, int(k) + 1)
        for k in np.flatnonzero(steps > 3.0 * usual)
    ]
