"""HDF5 and MATLAB files; MATLAB v7.3 is HDF5."""

from __future__ import annotations

import io
from collections.abc import Collection
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from strapdown.formats.arrays import raw_log
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, first_bytes, while_unchanged
from strapdown.parsers import parse

SUFFIXES = (".h5", ".hdf5", ".hdf", ".mat")
SIGNATURE = b"\x89HDF\r\n\x1a\n"


def _is_hdf5(path: Path) -> bool:
    """Whether a file of MATLAB is HDF5, to which 512 bytes are prepended; others are by name."""
    start = first_bytes(path, 1024)
    return path.suffix.lower() != ".mat" or SIGNATURE in (start[:8], start[512:520])


detect = Signs(suffixes=SUFFIXES, also=_is_hdf5)


def read(path: Path) -> RawLog:
    """Read the numeric datasets of an HDF5 file.

    Datasets in groups are named ``group/dataset``.
    """
    arrays, units, meta = read_arrays(path)
    return raw_log(path, arrays, units, meta)


def read_arrays(
    path: Path, only: Collection[str] | None = None
) -> tuple[dict[str, NDArray[Any]], dict[str, str], dict[str, Any]]:
    """Read arrays, their ``unit`` attributes, and the attributes of the file.

    `only` (collection of str): names of the datasets to read; all if not given.
    """
    found = parse("hdf5.arrays", path, only=None if only is None else list(only))
    return found["arrays"], found["units"], found["meta"]


@while_unchanged(4)
def outline(path: Path) -> tuple[frozenset[str], frozenset[str]]:
    """Return the names of all objects and of the attributes of a file; none if it is not HDF5.

    DataError: it refers to another file.
    """
    if SIGNATURE not in first_bytes(path, 1 << 20):
        return frozenset(), frozenset()
    found = parse("hdf5.outline", path)
    return frozenset(found["names"]), frozenset(found["attributes"])


def write(
    path: Path, arrays: dict[str, NDArray[Any]], units: dict[str, str], meta: dict[str, str]
) -> None:
    """Write arrays with their units; equal input gives identical bytes.

    `units`: written as the attribute ``unit`` of each. `meta`: written as attributes of the file.
    It is made in memory: where a write fails, HDF5 ends in tracebacks or ends the process.
    """
    import h5py

    made = io.BytesIO()
    with h5py.File(made, "w", track_order=True) as file:
        for key, value in meta.items():
            file.attrs[key] = value
        for name, array in arrays.items():
            dataset = file.create_dataset(name, data=array, track_times=False)
            if name in units:
                dataset.attrs["unit"] = units[name]
    path.write_bytes(made.getbuffer())


# MATLAB files up to v7; v7.3 is read as HDF5.


# Header text of a file. SciPy would write date and platform; equal input must give identical bytes.
_HEADER = b"MATLAB 5.0 MAT-file, written by strapdown"


detect_matlab = Signs(suffixes=(".mat",), also=lambda path: not _is_hdf5(path))


def read_matlab(path: Path) -> RawLog:
    """Read the numeric arrays of a MATLAB file."""
    arrays, meta = read_matlab_arrays(path)
    return raw_log(path, arrays, {}, meta)


def read_matlab_arrays(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Read the arrays and the texts of a MATLAB file; fields of structures as structure.field."""
    found = parse("matlab.arrays", path)
    return found["arrays"], found["meta"]


@while_unchanged(4)
def contents_of_matlab(path: Path) -> tuple[tuple[str, str], ...]:
    """Return name and class of each variable; none if damaged, or HDF5."""
    if _is_hdf5(path):
        return ()
    return tuple((name, kind) for name, kind in parse("matlab.contents", path))


def write_matlab(path: Path, arrays: dict[str, NDArray[Any]], meta: dict[str, str]) -> None:
    """Write arrays; equal input gives identical bytes.

    `meta`: written as character arrays.
    """
    from scipy.io import savemat

    buffer = io.BytesIO()
    stream: Any = buffer  # SciPy's stubs only accept file names
    savemat(stream, {**arrays, **meta}, oned_as="column")
    data = bytearray(buffer.getvalue())
    data[:116] = _HEADER.ljust(116)
    path.write_bytes(data)
