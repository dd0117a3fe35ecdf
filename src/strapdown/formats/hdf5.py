"""HDF5 and MATLAB files; MATLAB v7.3 is HDF5."""

from __future__ import annotations

import io
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.arrays import raw_log, refuse_lie
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, first_bytes

if TYPE_CHECKING:
    import h5py


SUFFIXES = (".h5", ".hdf5", ".hdf", ".mat")
SIGNATURE = b"\x89HDF\r\n\x1a\n"


def _is_hdf5(path: Path) -> bool:
    """Whether a file of MATLAB is HDF5, to which 512 bytes are prepended; others are by name."""
    start = first_bytes(path, 1024)
    return path.suffix.lower() != ".mat" or SIGNATURE in (start[:8], start[512:520])


detect = Signs(suffixes=SUFFIXES, also=_is_hdf5)


def read(path: Path) -> RawLog:
    """Read the numeric datasets of an HDF5 file.

    Returns
    -------
    RawLog
        Datasets in groups are named ``group/dataset``.

    Raises
    ------
    DataError
        The file is not HDF5, is damaged, or declares more data than it holds.
    """
    arrays, units, meta = read_arrays(path)
    return raw_log(path, arrays, units, meta)


def read_arrays(
    path: Path, only: Collection[str] | None = None
) -> tuple[dict[str, NDArray[Any]], dict[str, str], dict[str, Any]]:
    """Read arrays, their ``unit`` attributes, and the attributes of the file.

    `only` (collection of str): names of the datasets to read; all if not given.
    """
    import h5py

    arrays: dict[str, NDArray[Any]] = {}
    units: dict[str, str] = {}
    try:
        with h5py.File(path, "r") as file:
            meta: dict[str, Any] = dict(file.attrs.items())

            def visit(name: str, item: object) -> None:
                if only is not None and name not in only:
                    return
                if isinstance(item, h5py.Dataset) and not name.startswith("#"):
                    values = _dataset(item, name, path.name)
                    if values.ndim == 0:
                        meta.setdefault(name, values[()])
                    else:
                        arrays[name] = values
                    for key in ("unit", "units"):
                        if key in item.attrs:
                            said = item.attrs[key]
                            units[name] = said.decode() if isinstance(said, bytes) else str(said)

            file.visititems(visit)
    except DataError:
        raise
    except Exception as error:  # a damaged file can break the library anywhere
        raise DataError("io.hdf5-unreadable", file=path.name, error=error) from None
    return arrays, units, meta


def _dataset(item: h5py.Dataset, name: str, file: str) -> NDArray[Any]:
    if item.dtype.kind not in "iufb":
        return (
            np.array(item.asstr()[()])
            if item.dtype.kind in "OS" and not item.shape
            else np.empty(0, dtype="O")
        )
    refuse_lie(int(item.size) * item.dtype.itemsize, item.id.get_storage_size(), name, file)
    return np.asarray(item[()])


def write(
    path: Path, arrays: dict[str, NDArray[Any]], units: dict[str, str], meta: dict[str, str]
) -> None:
    """Write arrays with their units; equal input gives identical bytes.

    `units`: written as the attribute ``unit`` of each. `meta`: written as attributes of the file.
    """
    import h5py

    with h5py.File(path, "w", track_order=True) as file:
        for key, value in meta.items():
            file.attrs[key] = value
        for name, array in arrays.items():
            dataset = file.create_dataset(name, data=array, track_times=False)
            if name in units:
                dataset.attrs["unit"] = units[name]


# MATLAB files up to v7; v7.3 is read as HDF5.


# Header text of a file. SciPy would write date and platform; equal input must give identical bytes.
_HEADER = b"MATLAB 5.0 MAT-file, written by strapdown"


def _is_old(path: Path) -> bool:
    return not _is_hdf5(path)


detect_matlab = Signs(suffixes=(".mat",), also=_is_old)


def read_matlab(path: Path) -> RawLog:
    """Read the numeric arrays of a MATLAB file.

    DataError: the file is not a MATLAB file, is damaged, or declares more data than it holds.
    """
    arrays, meta = read_matlab_arrays(path)
    return raw_log(path, arrays, {}, meta)


def read_matlab_arrays(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Read the arrays and the texts of a MATLAB file."""
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
