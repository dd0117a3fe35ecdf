"""Zip archives, and those of NumPy (``.npz``)."""

from __future__ import annotations

import importlib
import sys
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from strapdown.errors import DataError
from strapdown.parsers.limits import damage, declared_most, refuse_lie, refuse_total, size_of

#: Most members of an archive. Recordings have some ten tables, and perhaps their pictures.
MOST_MEMBERS = 100_000

#: The archive that was opened last, with what shows that it is the same: its list is long.
_opened: list[Any] = []


def _open(path: Path) -> zipfile.ZipFile:
    """Open an archive whose members are few and small enough, before any is opened."""
    about = path.stat()
    state = (path, about.st_ino, about.st_size, about.st_mtime_ns)
    if _opened and _opened[0] == state:
        archive: zipfile.ZipFile = _opened[1]
        return archive
    if _opened:
        _opened[1].close()
        _opened.clear()
    archive = zipfile.ZipFile(path)
    members = archive.infolist()
    if len(members) > MOST_MEMBERS:
        raise DataError(
            "io.too-many-archived", file=path.name, count=len(members), most=MOST_MEMBERS
        )
    refuse_total(sum(m.file_size for m in members), path)
    if sys.platform != "win32":  # which would not let it be deleted
        _opened[:] = [state, archive]
    return archive


def names(path: Path) -> list[str]:
    """List the members that are not folders, sorted."""
    with damage("io.zip-unreadable", path):
        return sorted({m.filename for m in _open(path).infolist() if not m.is_dir()})


def heads(path: Path, members: Sequence[str], count: int) -> list[bytes | None]:
    """Read the first `count` bytes of members; None of those that cannot be read."""
    found: list[bytes | None] = []
    for name in members:
        try:
            found.append(member(path, name, count))
        except DataError:
            found.append(None)
    return found


def member(path: Path, name: str, count: int = -1) -> bytes:
    """Read the first `count` bytes of a member, or all."""
    with damage("io.member-unreadable", path):
        archive = _open(path)
        info = archive.getinfo(name)
        refuse_lie(info.file_size, info.compress_size, name, path.name)
        with archive.open(info) as stream:
            return stream.read(count)


#: First bytes of files that are compressed by gzip, bzip2, xz and Zstandard.
PACKED = {b"\x1f\x8b": "gzip", b"BZh": "bz2", b"\xfd7zXZ": "lzma", b"\x28\xb5\x2f\xfd": "zstd"}
#: Bytes that are unpacked at a time.
_PART = 1 << 20


def unpacked(path: Path) -> bytes:
    """Return the content of a compressed file, if it is not too large."""
    with damage("io.packed-unreadable", path):
        with path.open("rb") as file:
            begin = file.read(6)
        kind = next(k for magic, k in PACKED.items() if begin.startswith(magic))
        parts: list[bytes] = []
        size, most = 0, declared_most(size_of(path))
        with _unpacking(path, kind) as stream:
            while part := stream.read(_PART):
                size += len(part)
                if size > most:
                    refuse_total(size, path)
                parts.append(bytes(part))
        return b"".join(parts)


def _unpacking(path: Path, kind: str) -> Any:
    if kind == "zstd":
        import pyarrow as pa

        return pa.CompressedInputStream(pa.OSFile(str(path)), "zstd")
    return importlib.import_module(kind).open(path, "rb")


def array_names(path: Path) -> list[str]:
    """List the arrays of an archive of NumPy; none if it is damaged."""
    try:
        return [m.filename[:-4] for m in _open(path).infolist() if m.filename.endswith(".npy")]
    except (DataError, MemoryError):
        raise
    except Exception:  # zipfile raises more than BadZipFile; the reader of arrays reports it
        return []


def arrays(path: Path) -> dict[str, Any]:
    """Read the arrays of an archive of NumPy by name."""
    found: dict[str, Any] = {}
    with damage("io.npz-unreadable", path):
        archive = _open(path)
        for info in archive.infolist():
            name = info.filename.removesuffix(".npy")
            if name != info.filename:
                refuse_lie(info.file_size, info.compress_size, name, path.name)
                with archive.open(info) as stream:
                    found[name] = numpy_array(stream, info.file_size, name, path.name)
    return found


def numpy_array(stream: BinaryIO | Any, size: int, name: str | None, file: str) -> Any:
    """Read an array from a stream; its content is never executed.

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
