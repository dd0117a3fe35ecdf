"""Folders of NumPy arrays, one quantity a file: ``time.npy``, ``gyro_rad_s.npy``, ``accel.npy``."""

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
    """Tell by the names of its arrays whether a folder has a gyro among them."""
    return any(str(read_name(p.stem).quantity).startswith("gyro") for p in _arrays(path))


def read(path: Path) -> RawLog:
    """Read every array of the folder, each under its file's name.

    Parameters
    ----------
    path : Path

    Returns
    -------
    RawLog
        Arrays of another length than the gyro's are left out, and named.

    Raises
    ------
    DataError
        An array is damaged, claims more than it holds, or holds Python objects; or the stamps
        have another length than the gyro.
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
