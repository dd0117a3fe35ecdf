"""MATLAB files up to v7, by SciPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat, whosmat

from strapdown.parsers.limits import damage, refuse_lie, refuse_total


def contents(path: Path) -> list[list[Any]]:
    """List name and class of each variable; none if the file is damaged or of another version."""
    try:
        return [[str(name), str(kind)] for name, _, kind in whosmat(path)]
    except MemoryError:
        raise
    except Exception:  # damage is reported by the reader of arrays
        return []


def arrays(path: Path) -> dict[str, Any]:
    """Read ``arrays`` of numbers, and ``meta``: the rest, as text where it is not a number.

    Fields of a structure are named ``structure.field``. DataError: the file is damaged, or
    declares more data than it holds.
    """
    stored = path.stat().st_size
    with damage("io.matlab-unreadable", path):
        total = 0
        for name, shape, _ in whosmat(path):
            size = 8 * int(np.prod([int(n) for n in shape], dtype=object))
            refuse_lie(size, stored, str(name), path.name)
            total += size
        refuse_total(total, path)
        content = loadmat(path)
    named: dict[str, Any] = {}
    for name, value in content.items():
        if not name.startswith("__"):
            named |= _unfolded(name, value)
    held = {k: v for k, v in named.items() if v.dtype.kind in "iufb" and v.size > 1}
    return {"arrays": held, "meta": {k: _plain(v) for k, v in named.items() if k not in held}}


def _unfolded(name: str, value: Any, depth: int = 0) -> dict[str, Any]:
    """Return a value under its name; fields of a structure under name.field."""
    if not isinstance(value, np.ndarray) or value.dtype.names is None or value.size != 1:
        return {name: np.asarray(value)}
    if depth > 64:
        return {}
    found: dict[str, Any] = {}
    for field in value.dtype.names:
        found |= _unfolded(f"{name}.{field}", value[field].item(), depth + 1)
    return found


def _plain(value: Any) -> Any:
    """Return an array of numbers or text as it is, and of anything else the first as text."""
    if not isinstance(value, np.ndarray):
        return np.array([str(value)], dtype=object)
    if value.dtype.kind in "biufcSU":
        return value
    return _plain(value.reshape(-1)[0]) if value.size else np.empty(0, dtype=object)
