"""Folders of NumPy arrays, one per quantity: ``time.npy``, ``gyro_rad_s.npy``, ``accel.npy``."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from strapdown.formats import npy
from strapdown.formats.arrays import raw_log
from strapdown.formats.columns import read_name
from strapdown.formats.recording import RawLog


def detect(path: Path) -> bool:
    """Whether a folder has an array with the name of a gyro."""
    return any(str(read_name(p.stem).quantity).startswith("gyro") for p in _arrays(path))


def read(path: Path) -> RawLog:
    """Read every array of the folder, each under its file name.

    Parameters
    ----------
    path : Path

    Returns
    -------
    RawLog
        Arrays that differ in length from the gyro's are dropped and listed.

    Raises
    ------
    DataError
        An array is damaged, declares more data than it holds, or holds Python objects; or the
        stamps differ in length from the gyro.
    """
    name = path.resolve().name
    arrays: dict[str, NDArray[Any]] = {}
    meta: dict[str, Any] = {}
    files = _arrays(path)
    for file in files:
        array = npy.load(file, f"{name}/{file.name}")
        (meta if array.ndim == 0 else arrays)[file.stem] = array
    raw = raw_log(path, arrays, {}, meta)
    return dataclasses.replace(raw, name=name, files=tuple(files))


def _arrays(path: Path) -> list[Path]:
    return sorted(p for p in path.glob("*.npy") if p.is_file()) if path.is_dir() else []
