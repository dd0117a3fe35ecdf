"""HDF5 files, and MATLAB v7.3, by h5py: datasets that are in the file itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from strapdown.errors import DataError
from strapdown.parsers.limits import damage, refuse_lie, refuse_total

#: Most links that are walked: those of a recording are some hundred.
MOST_LINKS = 100_000
#: Attributes and texts that are handed on.
_PLAIN = "biufSU"


def outline(path: Path) -> dict[str, Any]:
    """List the names of all objects, and of the attributes of the file; none if it is not HDF5.

    DataError: it refers to another file.
    """
    try:
        with h5py.File(path, "r") as file:
            return {"names": _links(file, path), "attributes": list(file.attrs)}
    except DataError:
        raise
    except Exception:  # damage is reported by the reader of arrays
        return {"names": [], "attributes": []}


def arrays(path: Path, only: Sequence[str] | None = None) -> dict[str, Any]:
    """Read ``arrays``, their ``units``, and ``meta``: attributes of the file, and scalars.

    `only`: names of the datasets to read; all if not given. DataError: the file is damaged,
    refers to another one, or declares more data than it holds.
    """
    held: dict[str, Any] = {}
    units: dict[str, str] = {}
    with damage("io.hdf5-unreadable", path), h5py.File(path, "r") as file:
        _links(file, path)
        meta: dict[str, Any] = {k: _plain(v) for k, v in file.attrs.items()}
        wanted: dict[str, h5py.Dataset] = {}

        def visit(name: str, item: object) -> None:
            chosen = not name.startswith("#") if only is None else name in only
            if chosen and isinstance(item, h5py.Dataset):
                wanted[name] = item

        file.visititems(visit)
        total = 0
        for name, item in wanted.items():
            _refuse_elsewhere(item, name, path)
            if item.dtype.kind in "iufb":
                size = int(np.prod(item.shape or (), dtype=object)) * item.dtype.itemsize
                refuse_lie(size, item.id.get_storage_size(), name, path.name)
                total += size
        refuse_total(total, path)
        for name, item in wanted.items():
            values = _dataset(item)
            if values.ndim == 0:
                meta.setdefault(name, values)
            else:
                held[name] = values
            for key in ("unit", "units"):
                if key in item.attrs:
                    said = item.attrs[key]
                    units[name] = said.decode() if isinstance(said, bytes) else str(said)
    return {"arrays": held, "units": units, "meta": meta}


def _links(file: h5py.File, path: Path) -> list[str]:
    """Return the names of all links; none is followed to another file."""
    names: list[str] = []

    def visit(name: bytes, about: Any) -> str | None:
        # A returned value ends the walk; the library does not survive an exception in here.
        text = name.decode("utf-8", "replace")
        names.append(text)
        if about.type > h5py.h5l.TYPE_SOFT:  # external, or defined by a user
            return text
        return "" if len(names) > MOST_LINKS else None

    if outside := file.id.links.visit(visit, info=True):
        kind = "the target of the link"
        raise DataError("io.hdf5-elsewhere", file=path.name, quantity=outside, kind=kind)
    if len(names) > MOST_LINKS:
        raise DataError("io.hdf5-too-many-objects", file=path.name, most=MOST_LINKS)
    return names


def _refuse_elsewhere(item: h5py.Dataset, name: str, path: Path) -> None:
    """Refuse a dataset whose values are in another file, before anything asks for its shape."""
    creation = item.id.get_create_plist()
    kind = ""
    if creation.get_layout() == h5py.h5d.VIRTUAL:
        kind = "the source of the virtual dataset"
    elif creation.get_external_count():
        kind = "the storage of the dataset (external)"
    if kind:
        raise DataError("io.hdf5-elsewhere", file=path.name, quantity=name, kind=kind)


def _dataset(item: h5py.Dataset) -> Any:
    if item.dtype.kind not in "iufb":
        if item.dtype.kind in "OS" and not item.shape:
            return np.array(item.asstr()[()])
        return np.empty(0, dtype="O")
    return np.asarray(item[()])


def _plain(value: Any) -> Any:
    """Return an attribute as numbers or text."""
    if isinstance(value, np.ndarray) and value.dtype.kind not in _PLAIN:
        return [str(v) for v in value.ravel()[:1]]
    return value
