"""NumPy archives (``.npz``)."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.arrays import raw_log, refuse_lie
from strapdown.formats.npy import read_array
from strapdown.formats.recording import RawLog


def detect(path: Path) -> bool:
    """Whether the name is that of a NumPy archive."""
    return path.is_file() and path.suffix.lower() == ".npz"


def read(path: Path) -> RawLog:
    """Read the arrays of a NumPy archive; its content is never executed.

    Parameters
    ----------
    path : Path

    Returns
    -------
    RawLog

    Raises
    ------
    DataError
        The file is not an archive, is damaged, declares too much data, or holds Python objects.
    """
    found = arrays_of(path)
    arrays = {name: array for name, array in found.items() if array.ndim}
    meta = {name: array for name, array in found.items() if not array.ndim}
    return raw_log(path, arrays, {}, meta)


def arrays_of(path: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of an archive by name.

    Parameters
    ----------
    path : Path

    Raises
    ------
    DataError
        As `read`.
    """
    found: dict[str, NDArray[Any]] = {}
    try:
        with zipfile.ZipFile(path) as archive:
            for info in archive.infolist():
                if info.filename.endswith(".npy"):
                    found[info.filename[:-4]] = _member(archive, info, path.name)
    except DataError:
        raise
    except Exception as error:  # a damaged archive can break any of the decoders involved
        raise DataError(
            "io.npz-unreadable", file=path.name, error=error or type(error).__name__
        ) from None
    return found


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo, file: str) -> NDArray[Any]:
    name = info.filename[:-4]
    refuse_lie(info.file_size, info.compress_size, name, file)
    with archive.open(info) as stream:
        return read_array(stream, info.file_size, name, file)


def write(path: Path, arrays: dict[str, NDArray[Any]]) -> None:
    """Write arrays; equal input gives identical bytes.

    Parameters
    ----------
    path : Path
    arrays : dict of str to ndarray
    """
    np.savez(path, allow_pickle=False, **arrays)
