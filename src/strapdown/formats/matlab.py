"""MATLAB files up to v7; v7.3 is HDF5 and read as that."""

from __future__ import annotations

import io
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.exceptions import DataError
from strapdown.formats import hdf5
from strapdown.formats.arrays import raw_log, refuse_lie
from strapdown.formats.recording import RawLog

# The text that opens a file. SciPy writes the date and the platform into it; the same arrays
# shall give the same bytes.
_HEADER = b"MATLAB 5.0 MAT-file, written by strapdown"


def detect(path: Path) -> bool:
    """Tell whether the name is MATLAB's and the content is not HDF5."""
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
        It is no MATLAB file, is damaged, or claims more than it holds.
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
    from scipy.io.matlab import MatReadError

    stored = path.stat().st_size
    try:
        for name, shape, _ in whosmat(path):
            refuse_lie(8 * int(np.prod(shape, dtype=object)), stored, str(name), path.name)
        content = loadmat(path)
    except (
        MatReadError,
        OSError,
        ValueError,
        TypeError,
        KeyError,
        IndexError,
        EOFError,
        MemoryError,
        NotImplementedError,
        zlib.error,
    ) as error:
        raise DataError(
            f"it cannot be read as a MATLAB file: {error or type(error).__name__}",
            file=path.name,
            remedy="copy it again, or save it from MATLAB with -v7 or -v7.3",
        ) from None
    named = {k: v for k, v in content.items() if not k.startswith("__")}
    arrays = {k: v for k, v in named.items() if v.dtype.kind in "iufb" and v.size > 1}
    return arrays, {k: v for k, v in named.items() if k not in arrays and v.size == 1}


def write(path: Path, arrays: dict[str, NDArray[Any]], meta: dict[str, str]) -> None:
    """Write arrays; the same arrays give the same bytes.

    Parameters
    ----------
    path : Path
    arrays : dict of str to ndarray
    meta : dict of str to str
        Written as character arrays.
    """
    from scipy.io import savemat

    buffer = io.BytesIO()
    stream: Any = buffer  # its stubs know names of files alone
    savemat(stream, {**arrays, **meta}, oned_as="column")
    data = bytearray(buffer.getvalue())
    data[:116] = _HEADER.ljust(116)
    path.write_bytes(data)
