"""HDF5 files, including MATLAB v7.3."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.arrays import raw_log, refuse_lie
from strapdown.formats.recording import RawLog

if TYPE_CHECKING:
    import h5py

SUFFIXES = (".h5", ".hdf5", ".hdf", ".mat")
SIGNATURE = b"\x89HDF\r\n\x1a\n"


def detect(path: Path) -> bool:
    """Whether the content is HDF5; MATLAB prepends 512 bytes."""
    if not path.is_file() or path.suffix.lower() not in SUFFIXES:
        return False
    with path.open("rb") as stream:
        start = stream.read(1024)
    return path.suffix.lower() != ".mat" or SIGNATURE in (start[:8], start[512:520])


def read(path: Path) -> RawLog:
    """Read the numeric datasets of an HDF5 file.

    Parameters
    ----------
    path : Path

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

    Parameters
    ----------
    path : Path
    only : collection of str, optional
        Names of the datasets to read; all if not given.

    Returns
    -------
    arrays : dict of str to ndarray
    units : dict of str to str
    meta : dict

    Raises
    ------
    DataError
        As `read`.
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

    Parameters
    ----------
    path : Path
    arrays : dict of str to ndarray
    units : dict of str to str
        Written as the attribute ``unit`` of each.
    meta : dict of str to str
        Written as attributes of the file.
    """
    import h5py

    with h5py.File(path, "w", track_order=True) as file:
        for key, value in meta.items():
            file.attrs[key] = value
        for name, array in arrays.items():
            dataset = file.create_dataset(name, data=array, track_times=False)
            if name in units:
                dataset.attrs["unit"] = units[name]
