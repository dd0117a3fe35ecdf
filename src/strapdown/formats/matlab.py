"""MATLAB files up to v7; v7.3 is read as HDF5."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats import hdf5
from strapdown.formats.arrays import raw_log, refuse_lie
from strapdown.formats.recording import RawLog

# Header text of a file. SciPy would write date and platform; equal input must give identical bytes.
_HEADER = b"MATLAB 5.0 MAT-file, written by strapdown"


def detect(path: Path) -> bool:
    """Whether the name is that of a MATLAB file and the content is not HDF5."""
    return path.is_file() and path.suffix.lower() == ".mat" and not hdf5.detect(path)


def read(path: Path) -> RawLog:
    """Read the numeric arrays of a MATLAB file.

    Parameters
    ----------
    path : Path

    Returns
    -------
    RawLog

    Raises
    ------
    DataError
        The file is not a MATLAB file, is damaged, or declares more data than it holds.
    """
    arrays, meta = read_arrays(path)
    return raw_log(path, arrays, {}, meta)


def read_arrays(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Read the arrays and the texts of a MATLAB file.

    Parameters
    ----------
    path : Path

    Returns
    -------
    arrays : dict of str to ndarray
    meta : dict

    Raises
    ------
    DataError
        As `read`.
    """
    from scipy.io import loadmat, whosmat

    stored = path.stat().st_size
    try:
        for name, shape, _ in whosmat(path):
            refuse_lie(8 * int(np.prod(shape, dtype=object)), stored, str(name), path.name)
        content = loadmat(path)
    except DataError:
        raise
    except Exception as error:  # a damaged file can break the parser anywhere
        raise DataError(
            "io.matlab-unreadable", file=path.name, error=error or type(error).__name__
        ) from None
    named: dict[str, NDArray[Any]] = {}
    for name, value in content.items():
        if not name.startswith("__"):
            named |= _unfolded(name, value)
    arrays = {k: v for k, v in named.items() if v.dtype.kind in "iufb" and v.size > 1}
    return arrays, {k: v for k, v in named.items() if k not in arrays}


def _unfolded(name: str, value: Any) -> dict[str, NDArray[Any]]:
    """Return a value under its name; fields of a structure under name.field."""
    if not isinstance(value, np.ndarray) or value.dtype.names is None or value.size != 1:
        return {name: np.asarray(value)}
    found: dict[str, NDArray[Any]] = {}
    for field in value.dtype.names:
        found |= _unfolded(f"{name}.{field}", value[field].item())
    return found


def write(path: Path, arrays: dict[str, NDArray[Any]], meta: dict[str, str]) -> None:
    """Write arrays; equal input gives identical bytes.

    Parameters
    ----------
    path : Path
    arrays : dict of str to ndarray
    meta : dict of str to str
        Written as character arrays.
    """
    from scipy.io import savemat

    buffer = io.BytesIO()
    stream: Any = buffer  # SciPy's stubs only accept file names
    savemat(stream, {**arrays, **meta}, oned_as="column")
    data = bytearray(buffer.getvalue())
    data[:116] = _HEADER.ljust(116)
    path.write_bytes(data)
