"""Linear algebra on one thread: how many there are changes the last digits of a sum."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

__all__ = ["one_thread"]

# Names that OpenBLAS has in wheels of numpy and scipy, and where a system brings its own.
_PREFIXES, _SUFFIXES = ("scipy_openblas", "openblas"), ("64_", "")


@contextmanager
def one_thread() -> Iterator[None]:
    """Run on one thread of OpenBLAS, whatever the machine and its settings allow.

    OpenBLAS divides a product or a factorisation among its threads, and so adds in another order
    with each number of them: 1e-14 of a result, which is another byte in a sealed file. Numbers
    of threads are as before afterwards. Where numpy rests on another library, nothing is done.
    """
    import numpy  # noqa: F401  (loads its OpenBLAS)
    import scipy.linalg  # noqa: F401

    before = [(put, get()) for get, put in _controls()]
    try:
        for put, _ in before:
            put(1)
        yield
    finally:
        for put, count in before:
            put(count)


@cache
def _controls() -> tuple[tuple[Callable[[], int], Callable[[int], None]], ...]:
    """Getter and setter of the number of threads of each OpenBLAS that is loaded."""
    found = []
    for path in sorted(_libraries()):
        try:
            library = ctypes.CDLL(path)
        except OSError:
            continue
        for prefix, suffix in ((p, s) for p in _PREFIXES for s in _SUFFIXES):
            get = getattr(library, f"{prefix}_get_num_threads{suffix}", None)
            put = getattr(library, f"{prefix}_set_num_threads{suffix}", None)
            if get is not None and put is not None:
                put.restype = None
                found.append((get, put))
                break
    return tuple(found)


def _libraries() -> set[str]:
    import numpy as np
    import scipy

    found = set()
    for package in (np, scipy):
        home = Path(str(package.__file__)).parent
        for folder in (home.with_name(f"{home.name}.libs"), home / ".dylibs"):
            found |= {str(p.resolve()) for p in folder.glob("*openblas*")}
    maps = Path("/proc/self/maps")
    if maps.is_file():
        # Of a system's own, whose place is not known.
        words = (line.split(maxsplit=5) for line in maps.read_text("utf-8", "replace").splitlines())
        found |= {w[5] for w in words if len(w) == 6 and "openblas" in Path(w[5]).name}
    return found
