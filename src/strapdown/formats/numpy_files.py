"""NumPy archives (``.npz``), arrays (``.npy``), and folders of arrays; none is executed."""

from __future__ import annotations

import dataclasses
import zipfile
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats.arrays import raw_log, refuse_lie
from strapdown.formats.columns import read_name
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs

detect = Signs(named=(".npz",))


def read(path: Path) -> RawLog:
    """Read the arrays of a NumPy archive; its content is never executed.

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
    """Return the arrays of an archive by name."""
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
    """Write arrays; equal input gives identical bytes."""
    with path.open("wb") as stream:  # by a name NumPy would append an ending
        np.savez(stream, allow_pickle=False, **arrays)


# Single NumPy arrays, from files or archives; their content is never executed.


def load(path: Path, label: str) -> NDArray[Any]:
    """Load the array of a file.

    `label`: for messages. DataError: the array is damaged, declares more data than it holds, or
    holds Python objects.
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

    `size`: stored size, including the header. `name`: name of the array, for messages. DataError:
    the declared size differs from the stored one, or the array holds Python objects. ValueError:
    the header is damaged.
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


# Folders of NumPy arrays, one per quantity: ``time.npy``, ``gyro_rad_s.npy``, ``accel.npy``.


def _has_gyro(folder: Path) -> bool:
    """Whether a folder has an array with the name of a gyro."""
    return any(str(read_name(p.stem).quantity).startswith("gyro") for p in _arrays(folder))


detect_folder = Signs(folder=_has_gyro)


def read_folder(path: Path) -> RawLog:
    """Read every array of the folder, each under its file name.

    Returns arrays that differ in length from the gyro's are dropped and listed. DataError: an array
    is damaged, declares more data than it holds, or holds Python objects; or the stamps differ in
    length from the gyro.
    """
    name = path.resolve().name
    arrays: dict[str, NDArray[Any]] = {}
    meta: dict[str, Any] = {}
    files = _arrays(path)
    for file in files:
        array = load(file, f"{name}/{file.name}")
        (meta if array.ndim == 0 else arrays)[file.stem] = array
    raw = raw_log(path, arrays, {}, meta)
    return dataclasses.replace(raw, name=name, files=tuple(files))


def _arrays(path: Path) -> list[Path]:
    return sorted(p for p in path.glob("*.npy") if p.is_file()) if path.is_dir() else []
