"""Least and largest values of a long series over any buckets of time, without reading it whole.

A pyramid has the least and the largest value of each block of `FACTOR` samples, of each block of
so many blocks, and so on. A bucket is then at most `FACTOR` - 1 samples at each of its ends, so
many blocks at each end of what remains, and so on upwards: a look at 3.6 million samples reads some
hundred values of each bucket. The result is exact: that of a look at every sample.

Files are arrays of numpy without pickles, mapped into memory.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import Array

FACTOR = 16
#: List of what a stream has.
LIST = "stream.json"


def levels_of(values: Array) -> tuple[Array, Array]:
    """Return the least and largest values of all levels, one after the other.

    Parameters
    ----------
    values : ndarray, (n,)
        NaN where there is none.

    Returns
    -------
    least, largest : ndarray
        ``ceil(n / 16)`` values of the first level, a sixteenth of the second … down to one. NaN of
        a block without any value.
    """
    least, largest = [], []
    low = high = np.asarray(values, dtype=np.float64)
    while low.size > 1:
        low, high = _blocks(low, np.fmin), _blocks(high, np.fmax)
        least.append(low)
        largest.append(high)
    empty = [np.empty(0)]
    return np.concatenate(least or empty), np.concatenate(largest or empty)


def _blocks(values: Array, join: Any) -> Array:
    whole = values.size // FACTOR * FACTOR
    found = join.reduce(values[:whole].reshape(-1, FACTOR), axis=1)
    if whole < values.size:
        found = np.append(found, join.reduce(values[whole:]))
    return np.asarray(found, dtype=np.float64)


def least_and_largest(
    values: Array, least: Array, largest: Array, begin: NDArray[np.int64], end: NDArray[np.int64]
) -> tuple[Array, Array]:
    """Return the least and largest values of stretches of a series.

    Parameters
    ----------
    values, least, largest : ndarray
        The series, and `levels_of` it.
    begin, end : ndarray of int, (m,)
        First sample of each stretch, and the one after its last; empty where they are equal.

    Returns
    -------
    least, largest : ndarray, (m,)
        NaN where a stretch is empty, or has no value.
    """
    low, high = np.full(begin.shape, np.nan), np.full(begin.shape, np.nan)
    begin, end = begin.copy(), end.copy()
    # The level: its least, its largest, and its size.
    below, above, size, at = values, values, values.size, 0
    while (begin < end).any():
        # To the next multiple at the begin, from the last one at the end.
        up = np.minimum(-(-begin // FACTOR) * FACTOR, end)
        down = np.maximum(end // FACTOR * FACTOR, up)
        for first, last in ((begin, up), (down, end)):
            _join(low, below, first, last, np.fmin)
            _join(high, above, first, last, np.fmax)
        begin, end = up // FACTOR, down // FACTOR
        size = -(-size // FACTOR)
        below, above = least[at : at + size], largest[at : at + size]
        at += size
    return low, high


def _join(
    found: Array, values: Array, first: NDArray[np.int64], last: NDArray[np.int64], join: Any
) -> None:
    """Join at most `FACTOR` values of each stretch to what was found."""
    some = np.flatnonzero(first < last)
    if not some.size:
        return
    steps = np.arange(int((last - first).max()))
    # The last value again, where a stretch is shorter: it changes no extreme.
    at = np.minimum(first[some, None] + steps, last[some, None] - 1)
    found[some] = join(found[some], join.reduce(values[at], axis=1))


def write_stream(
    folder: Path, time: Array, columns: Mapping[str, Array], units: Mapping[str, str]
) -> dict[str, Any]:
    """Write a stream with its pyramids into a new folder; return its list.

    Parameters
    ----------
    time : ndarray, (n,), s
        Sorted here where it is not.
    columns : mapping of str to ndarray, (n,)
    units : mapping of str to str
    """
    folder.mkdir(parents=True)
    order = None if (np.diff(time) >= 0.0).all() else np.argsort(time, kind="stable")
    time = time if order is None else time[order]
    np.save(folder / "time.npy", np.ascontiguousarray(time), allow_pickle=False)
    for k, values in enumerate(columns.values()):
        values = np.ascontiguousarray(values if order is None else values[order], dtype=np.float64)
        least, largest = levels_of(values)
        for name, part in (("values", values), ("least", least), ("largest", largest)):
            np.save(folder / f"{k}-{name}.npy", part, allow_pickle=False)
    listed = {
        "rows": int(time.size),
        "from_s": float(time[0]) if time.size else None,
        "to_s": float(time[-1]) if time.size else None,
        "columns": [{"name": name, "unit": units.get(name, "")} for name in columns],
    }
    (folder / LIST).write_text(json.dumps(listed), encoding="utf-8")
    return listed


@dataclass(frozen=True)
class StoredStream:
    """A stream that `write_stream` wrote.

    Attributes
    ----------
    folder : Path
    """

    folder: Path

    def series(
        self, columns: Sequence[str], begin: float | None, end: float | None, width: int
    ) -> dict[str, Any]:
        """Return the extremes over buckets of equal length, or every sample where there are fewer.

        Parameters
        ----------
        columns : sequence of str
            Names that the stream does not have are left out; all, if empty.
        begin, end : float or None, s
            Both included; the whole stream, if None.
        width : int
            Number of buckets.

        Returns
        -------
        dict
            ``t``: middle of each bucket, s, or the stamps; ``columns``: unit, ``low`` and ``high``
            of each, None where a value is missing.
        """
        listed = json.loads((self.folder / LIST).read_text(encoding="utf-8"))
        time = self._array("time")
        known = {one["name"]: (k, one["unit"]) for k, one in enumerate(listed["columns"])}
        asked = [name for name in columns if name in known] or ([] if columns else list(known))
        first = 0 if begin is None else int(np.searchsorted(time, begin, side="left"))
        last = time.size if end is None else int(np.searchsorted(time, end, side="right"))
        exact = last - first <= width
        if exact or last <= first:
            stamps = np.asarray(time[first:last])
            edges = np.arange(first, max(last, first) + 1, dtype=np.int64)
        else:
            low = float(time[first]) if begin is None else begin
            high = float(time[last - 1]) if end is None else end
            cuts = np.linspace(low, high, width + 1)
            stamps = 0.5 * (cuts[1:] + cuts[:-1])
            inner = np.searchsorted(time, cuts[1:-1], side="left")
            edges = np.concatenate([[first], np.clip(inner, first, last), [last]]).astype(np.int64)
        found: dict[str, Any] = {}
        for name in asked:
            number, unit = known[name]
            values = self._array(f"{number}-values")
            if exact:
                one = _listed(np.asarray(values[first:last]))
                found[name] = {"unit": unit, "low": one, "high": one}
                continue
            extremes = least_and_largest(
                values,
                self._array(f"{number}-least"),
                self._array(f"{number}-largest"),
                edges[:-1],
                edges[1:],
            )
            found[name] = {"unit": unit, "low": _listed(extremes[0]), "high": _listed(extremes[1])}
        return {"t": stamps.tolist(), "exact": bool(exact), "columns": found}

    def _array(self, name: str) -> Array:
        path = self.folder / f"{name}.npy"
        # An empty array cannot be mapped.
        mode: Any = "r" if path.stat().st_size > 1024 else None
        return np.load(path, mmap_mode=mode, allow_pickle=False)  # type: ignore[no-any-return]


def _listed(values: Array) -> list[float | None]:
    """Numbers for JSON, which has neither NaN nor infinity."""
    kept = np.isfinite(values)
    if kept.all():
        return values.tolist()  # type: ignore[no-any-return]
    return [v if k else None for v, k in zip(values.tolist(), kept.tolist(), strict=True)]
