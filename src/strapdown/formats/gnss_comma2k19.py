"""Fixes of the receiver of a comma2k19 segment, on the clock of its inertial sensors.

Layout of https://github.com/commaai/comma2k19 (README, "Log Format"): in
``processed_log/GNSS`` ``live_gnss_ublox`` and ``live_gnss_qcom``, each with an array ``t``, seconds
since the device started, and an array ``value`` of six columns: latitude and longitude in deg,
speed in m/s, UTC, altitude in m, bearing in deg; or the same with ``__`` for the slashes and the
suffix ``.npy``. UTC counts from 1970, in seconds by the README, in milliseconds in the segments.
The altitude is above the ellipsoid: in the segment of the README's example the pose of the camera
is 1.1 m below it, and the geoid is 32 m below the ellipsoid there.

``t`` is when a fix was written, on the clock of the inertial sensors, and UTC is when it was
measured. No fix is written before it is measured, so the smallest ``t`` minus UTC is the best
estimate of the difference of the clocks: a fix is dated by its UTC plus this difference, which
includes the latency common to all fixes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats import npy
from strapdown.formats.clocks import RELATIVE, Clock
from strapdown.formats.gnss_fixes import Fixes, GnssOptions

__all__ = ["belongs", "detect", "files_of", "read"]

Array = NDArray[np.float64]

#: The first one present is used: ten fixes per second, and one in two seconds.
RECEIVERS = ("live_gnss_ublox", "live_gnss_qcom")
COLUMNS = 6
#: From this value on UTC is in ms: as seconds it would be in the year 5138.
IN_MS = 1e11
AGAIN = "get the segment again from its source"


def detect(path: Path) -> bool:
    """Whether a folder has the arrays of a receiver."""
    return bool(files_of(path))


def belongs(path: Path) -> bool:
    """Whether a file is one of the arrays of a receiver."""
    parts = (path.resolve().parent.name, *path.stem.split("__"))
    return path.name.split("__")[-1] in ("t", "value", "t.npy", "value.npy") and any(
        receiver in parts for receiver in RECEIVERS
    )


def files_of(path: Path) -> tuple[Path, ...]:
    """Find the stamps and values of the receiver of a folder; empty if there is none.

    Parameters
    ----------
    path : Path
        The folder of a segment, its ``processed_log``, ``GNSS`` in it, the folder of one
        receiver, or the folder of the arrays.
    """
    if not path.is_dir():
        return ()
    own = path.resolve().name
    for receiver in RECEIVERS:
        for folder in (path, path / "GNSS", path / "processed_log" / "GNSS"):
            found = tuple(folder / receiver / part for part in ("t", "value"))
            if all(file.is_file() for file in found):
                return found
        flat = tuple(path / f"GNSS__{receiver}__{part}.npy" for part in ("t", "value"))
        if all(file.is_file() for file in flat):
            return flat
        if own == receiver and (path / "t").is_file() and (path / "value").is_file():
            return path / "t", path / "value"
    return ()


def read(path: Path, options: GnssOptions) -> Fixes:
    """Read the fixes of a segment.

    Parameters
    ----------
    path : Path
    options : GnssOptions

    Returns
    -------
    Fixes
        Without standard deviations. Speed and bearing are converted to velocity north and
        east; down is not measured.

    Raises
    ------
    DataError
        An array is damaged or has the wrong shape.
    """
    t_file, value_file = files_of(path)
    name = path.resolve().name
    t, value = (npy.load(file, f"{name}/{file.name}") for file in (t_file, value_file))
    if (
        t.ndim != 1
        or value.shape != (t.size, COLUMNS)
        or not set(t.dtype.kind + value.dtype.kind) <= set("iuf")
    ):
        raise DataError(
            "io.stamps-shape-values-numbers-shapes-2",
            file=f"{name}/{value_file.name}",
            quantity="fixes",
            shape=t.shape,
            shape_2=value.shape,
            dtype=value.dtype,
            columns=COLUMNS,
        )
    if not t.size:
        raise DataError("io.no-fix", file=f"{name}/{value_file.name}")
    lat, lon, speed, utc, alt, bearing = np.asarray(value, dtype=np.float64).T
    findings: list[Finding] = []
    course = np.radians(bearing)
    return Fixes(
        name=name,
        time=_dated(np.asarray(t, dtype=np.float64), utc, name, findings),
        place=np.column_stack([lat, lon, alt]),
        rows=np.arange(1, t.size + 1),
        clock=Clock(RELATIVE),
        velocity=np.column_stack(
            [speed * np.cos(course), speed * np.sin(course), np.full(t.size, np.nan)]
        ),
        findings=findings,
    )


def _dated(t: Array, utc: Array, name: str, findings: list[Finding]) -> Array:
    """Compute when each fix was measured, on the clock of the stamps."""
    if not (np.isfinite(utc).all() and np.isfinite(t).all() and (np.diff(utc) > 0.0).all()):
        findings.append(
            Finding("io.not-every-fix-utc-later", file=name, quantity="time", severity="note")
        )
        return t
    seconds = utc * 1e-3 if utc.max() > IN_MS else utc
    late = t - seconds
    late -= late.min()
    findings.append(
        Finding(
            "io.comma2k19-fixes-dated-by-utc",
            file=name,
            quantity="time",
            late=late.max(),
            median=np.median(late),
        )
    )
    return np.asarray(t - late)
