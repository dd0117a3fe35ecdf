"""Limits of the cost of a file: memory, time, and what it may declare, each by its size."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from strapdown.errors import DataError, StrapdownError

_MIB = 1 << 20
#: Bytes that arrays of a file may have, unpacked: a share that any may have, and per stored byte.
DECLARED, DECLARED_PER_BYTE = 256 * _MIB, 16
#: Memory of the process that parses: beside three times that.
MEMORY = 512 * _MIB
#: Bytes of JSON that it may answer beside arrays: fields of messages have names, each time.
TEXT, TEXT_PER_BYTE = 64 * _MIB, 48
#: Time of its processor, s, and s per MiB; pure Python reads half a MiB a second.
SECONDS, SECONDS_PER_MIB = 10.0, 10.0
#: An array is refused if it declares more than SMALL and exceeds its stored bytes by this ratio.
LARGEST_RATIO, SMALL = 1000, 64 * _MIB


def size_of(path: Path) -> int:
    """Return the bytes of a file, or of the files of a folder."""
    try:
        if path.is_dir():
            return sum(p.stat().st_size for p in path.iterdir() if p.is_file())
        return path.stat().st_size
    except OSError:
        return 0


def declared_most(size: int) -> int:
    """Return the most bytes that the arrays of a file of `size` bytes may have in all."""
    return DECLARED + DECLARED_PER_BYTE * size


def memory_most(size: int) -> int:
    """Return the memory, bytes, that may be taken to parse a file of `size` bytes."""
    return MEMORY + 3 * declared_most(size)


def text_most(size: int) -> int:
    """Return the most bytes of an answer about a file of `size` bytes, beside arrays."""
    return TEXT + TEXT_PER_BYTE * size


def seconds_most(size: int) -> float:
    """Return the processor time, s, that may be taken to parse a file of `size` bytes."""
    return SECONDS + SECONDS_PER_MIB * size / _MIB


def refuse_lie(declared: int, stored: int, what: str, file: str) -> None:
    """Refuse an array that declares far more data than its file can hold.

    `what`: name of the array.
    """
    if declared > SMALL and declared > LARGEST_RATIO * max(stored, 1):
        raise DataError(
            "io.claims-bytes-stored", file=file, quantity=what, declared=declared, stored=stored
        )


def refuse_total(declared: int, path: Path) -> None:
    """Refuse a file whose arrays or members would fill the memory together.

    `declared`: bytes, unpacked. Compression that is worth while on measurements stays far below.
    """
    stored = size_of(path)
    if declared > declared_most(stored):
        raise DataError(
            "io.unpacks-too-far",
            file=path.name,
            declared=declared,
            stored=stored,
            most=declared_most(stored),
        )


@contextmanager
def damage(code: str, path: Path, **data: Any) -> Iterator[None]:
    """Report what a library raises on a damaged file by `code`: its words are `error`, `reason`."""
    try:
        yield
    except (StrapdownError, MemoryError):
        raise
    except Exception as error:  # libraries document no common class of their errors
        said = str(error)[:300] or type(error).__name__
        reason = f"{type(error).__name__}: {error}".strip(": ")[:200]
        words = {"error": said, "reason": reason}
        raise DataError(code, file=path.name, data=words | data) from None


def library(module: str, path: Path, extra: str = "logs") -> Any:
    """Import the library that reads a format.

    `module`: its name. `path`: the file that needs it. `extra`: of this package, which installs it.
    DataError: it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError:
        raise DataError(
            "io.library-missing", file=path.name, library=module.partition(".")[0], extra=extra
        ) from None
