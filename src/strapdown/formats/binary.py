"""Common part of the readers of binary logs: damage, first bytes, and own solutions."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.errors import DataError, Finding, StrapdownError
from strapdown.formats import gnss_nmea
from strapdown.formats.clocks import Clock, with_clock
from strapdown.formats.gnss_fixes import Fixes
from strapdown.formats.recording import NoStreamError, RawLog
from strapdown.tables import trajectory_table

__all__ = [
    "Quantities",
    "damage",
    "interpolated",
    "or_sentences",
    "solution",
    "turned",
]

Array = NDArray[np.float64]
#: Argument of `RawLog.of`.
Quantities = dict[str, tuple[NDArray[Any], str | None]]


_SENTENCE = re.compile(rb"\$[A-Z]{5},[ -#%-)+-~]*\*[0-9A-Fa-f]{2}")


@contextmanager
def damage(path: Path) -> Iterator[None]:
    """Report whatever a library raises on damaged content as a DataError of this file."""
    try:
        yield
    except StrapdownError:
        raise
    except Exception as error:  # libraries document no common class of their errors
        reason = f"{type(error).__name__}: {error}".strip(": ")[:200]
        raise DataError("io.log-damaged", file=path.name, reason=reason) from None


def interpolated(time: Array, own: Array, values: Sequence[NDArray[Any]]) -> Array:
    """Interpolate columns linearly to other stamps; (n, columns), NaN outside."""
    return np.column_stack([np.interp(time, own, v, left=np.nan, right=np.nan) for v in values])


def turned(time: Array, own: Array, q: Array) -> Array:
    """Interpolate attitude quaternions to other stamps within theirs; roll, pitch, heading, deg."""
    flips = np.cumprod(np.concatenate([[1.0], np.where((q[1:] * q[:-1]).sum(axis=1) < 0, -1, 1)]))
    at = interpolated(np.clip(time, own[0], own[-1]), own, list((q * flips[:, None]).T))
    return rotation.euler_from_quaternion(at / np.linalg.norm(at, axis=1, keepdims=True))


def solution(
    path: Path,
    columns: Sequence[Array],
    clock: Clock,
    findings: Sequence[Finding] = (),
    *,
    of_recorder: bool = True,
) -> pd.DataFrame:
    """Make a Trajectory of a solution.

    `columns`: time (s), position, velocity and attitude, (n,) and three of (n, 3); rows with a
    value that is not a number are left out. `of_recorder`: whether the recorder computed it.
    DataError: no row is left, or as `trajectory_table`.
    """
    everything = np.column_stack(columns)
    use = np.isfinite(everything).all(axis=1)
    use &= np.diff(everything[:, 0], prepend=-np.inf) > 0.0
    if not use.any():
        raise DataError("io.solution-without-rows", file=path.name, quantity="reference")
    kept = everything[use]
    table = trajectory_table(kept[:, 0], kept[:, 1:4], kept[:, 4:7], kept[:, 7:], source=path.name)
    table.attrs["ellipsoid"] = "wgs84"
    code = "io.reference-own-solution" if of_recorder else "io.reference-rows"
    count = {"count": int(use.sum()), "size": use.size}
    note = Finding(code, file=path.name, quantity="reference", severity="note", data=count)
    told = of_recorder or not use.all()
    table.attrs["findings"] = (*([note] if told else []), *findings)
    return with_clock(table, clock)


def or_sentences(read: Callable[[Path], RawLog]) -> Callable[[Path], RawLog | Fixes]:
    """Make a reader of fixes that takes NMEA sentences of the stream if it has no own fixes."""

    def either(path: Path) -> RawLog | Fixes:
        try:
            return read(path)
        except NoStreamError:
            found = _SENTENCE.findall(path.read_bytes())
            if not any(sentence[3:6] == b"GGA" for sentence in found):
                raise
        with tempfile.TemporaryDirectory() as folder:
            lines = Path(folder) / path.name
            lines.write_bytes(b"\n".join(found))
            fixes = gnss_nmea.read(lines)
        note = Finding("io.fixes-of-sentences", file=path.name, severity="note", count=len(found))
        fixes.findings.append(note)
        return fixes

    return either
