"""MATLAB files of a foot-mounted unit, with surveyed control points.

Layout of https://github.com/mtahakoroglu/LLIO-aided-iPyShoe: ``imu_data`` (n, 6), specific force in
m/s² and rates in rad/s along forward, right, down; ``timestamps`` s. With control points: ``GCP``
(m, 2), north and east in m from an arbitrary origin and direction, and ``strideIndex``, the sample,
counted from zero, at which the foot was on each point.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats import hdf5
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs

__all__ = ["detect", "detect_points", "read", "read_points"]

Array = NDArray[np.float64]
LOG, POINTS = ("timestamps", "imu_data"), ("strideIndex", "GCP")
COLUMNS = [*(f"accel_{a}" for a in "xyz"), *(f"gyro_{a}" for a in "xyz")]


def _has_log(path: Path) -> bool:
    return set(LOG) <= _names(path)


detect = Signs(suffixes=(".mat",), also=_has_log)


def detect_points(path: Path) -> bool:
    """Detect by the names of the arrays."""
    return {*LOG, *POINTS} <= _names(path)


def _names(path: Path) -> set[str]:
    if not hdf5.detect_matlab(path):
        return set()
    from scipy.io import whosmat

    try:
        return {name for name, _, _ in whosmat(path)}
    except Exception:  # damage is reported by the reader of MATLAB files
        return set()


def _arrays(path: Path, *names: str) -> dict[str, Any]:
    arrays, _ = hdf5.read_matlab_arrays(path)
    for name in names:
        if name not in arrays:
            raise DataError(
                "io.no-such-array",
                file=path.name,
                quantity=name,
                name=name,
                arrays=list(arrays),
            )
    return {name: arrays[name].astype(np.float64) for name in names}


def _log(path: Path) -> tuple[Array, Array]:
    arrays = _arrays(path, *LOG)
    time, imu = arrays["timestamps"].reshape(-1), arrays["imu_data"]
    if imu.shape != (time.size, len(COLUMNS)):
        raise DataError(
            "io.shapes-n-stamps-n-belong",
            file=path.name,
            quantity="timestamps, imu_data",
            shape=arrays["timestamps"].shape,
            shape_2=imu.shape,
        )
    return time, imu


def read(path: Path) -> RawLog:
    """Read rates and specific force.

    Raises
    ------
    DataError
        The file is damaged, or its arrays have the wrong shapes.
    """
    time, imu = _log(path)
    units = {"gyro": "rad/s", "accel": "m/s2"}
    columns = {n: (imu[:, k], units[n.partition("_")[0]]) for k, n in enumerate(COLUMNS)}
    return RawLog.of(path, {"time": (time, "s"), **columns}, sampling="instantaneous", axes="x,y,z")


def read_points(path: Path) -> tuple[Array, Array]:
    """Read the control points.

    Returns `time` ((m,), s): times at which the foot was on each point; `places` ((m, 2), m): north
    and east.
    """
    time, _ = _log(path)
    arrays = _arrays(path, *POINTS)
    at, places = arrays["strideIndex"].reshape(-1), arrays["GCP"]
    if places.shape != (at.size, 2):
        raise DataError(
            "io.samples-control-points-shape",
            file=path.name,
            quantity="strideIndex, GCP",
            size=at.size,
            shape=places.shape,
        )
    within = (at >= 0) & (at < time.size) & (at == np.floor(at))
    if not within.all():
        k = int(np.argmin(within))
        raise DataError(
            "io.control-point-outside",
            file=path.name,
            row=k + 1,
            quantity="strideIndex",
            at=at[k],
            size=time.size,
        )
    return time[at.astype(np.intp)], places
