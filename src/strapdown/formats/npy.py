"""Single NumPy arrays, from files or archives; their content is never executed."""

from __future__ import annotations

from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError


def load(path: Path, label: str) -> NDArray[Any]:
    """Load the array of a file.

    Parameters
    ----------
    path : Path
    label : str
        For messages.

    Returns
    -------
    ndarray

    Raises
    ------
    DataError
        The array is damaged, declares more data than it holds, or holds Python objects.
    """
    try:
        with path.open("rb") as stream:
            return read_array(stream, path.stat().st_size, None, label)
    except DataError:
        raise
    except Exception as error:  # a damaged header can break NumPy's parser
        raise DataError(
            "io.npy-unreadable", file=label, error=error or type(error).__name__
        ) from None


def read_array(stream: BinaryIO | Any, size: int, name: str | None, file: str) -> NDArray[Any]:
    """Read an array from a stream.

    Parameters
    ----------
    stream : file object
    size : int, bytes
        Stored size, including the header.
    name : str or None
        Name of the array, for messages.
    file : str

    Returns
    -------
    ndarray

    Raises
    ------
    DataError
        The declared size differs from the stored one, or the array holds Python objects.
    ValueError
        The header is damaged.
    """
    version = np.lib.format.read_magic(stream)
    header = (
        np.lib.format.read_array_header_1_0
        if version == (1, 0)
        else np.lib.format.read_array_header_2_0
    )
    shape, fortran, dtype = header(stream)
    if dtype.hasobject:
        raise DataError("io.holds-python-objects-not-loaded", file=file, quantity=name)
    count = int(np.prod([int(n) for n in shape], dtype=object))
    stored = size - stream.tell()
    if count * dtype.itemsize != stored:
        raise DataError(
            "io.claims-values-bytes-bytes-stored"
            if name
            else "io.claims-values-bytes-bytes-stored-2",
            file=file,
            quantity=name,
            count=count,
            itemsize=dtype.itemsize,
            stored=stored,
        )
    data = np.frombuffer(stream.read(), dtype=dtype)
    return data.reshape(shape, order="F" if fortran else "C")
