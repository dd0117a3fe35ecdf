"""How a file or folder shows its format: by its ending, its first bytes and their text.

A format states its signs as data. All formats look at the same first bytes, which are read once;
a function of the format is called only where the signs leave it open.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import Path

__all__ = ["HEAD", "Signs", "first_bytes", "head"]

#: Bytes of a file that are looked at.
HEAD = 1 << 16


@dataclass(frozen=True)
class Signs:
    """Detection of a format.

    Attributes
    ----------
    named : tuple of str
        Endings of a file that are enough, in lower case.
    suffixes : tuple of str
        Endings that a file may have otherwise; any if empty.
    first : bytes
        Regular expression that is found in the first `HEAD` bytes; a dot stands for any byte.
    text : str
        Regular expression that is found in the text of these bytes; ``^`` and ``$`` are ends of a
        line. The text of binary content ends at its first zero byte.
    also : callable, optional
        Sign that these cannot express; called if all others are there.
    inside : str
        Pattern of names (`fnmatch`, in lower case), of which a folder holds at least one.
    folder : callable, optional
        Sign of a folder. Without either no folder is of this format.
    zipped : bool
        Whether an archive (``.zip``) is looked at like a folder.
    """

    named: tuple[str, ...] = ()
    suffixes: tuple[str, ...] = ()
    first: bytes = b""
    text: str = ""
    also: Callable[[Path], bool] | None = None
    inside: str = ""
    folder: Callable[[Path], bool] | None = None
    zipped: bool = False

    def __call__(self, path: Path, data: bytes | None = None) -> bool:
        """Whether a file or folder has the signs. `data`: its first bytes; read if not given."""
        suffix = path.suffix.lower()
        if path.is_dir() and self.inside:
            return any(fnmatchcase(p.name.lower(), self.inside) for p in path.iterdir())
        if path.is_dir() or (self.zipped and suffix == ".zip"):
            return self.folder is not None and self.folder(path)
        if not path.is_file() or suffix in self.named:
            return path.is_file()
        if (self.suffixes and suffix not in self.suffixes) or not (
            self.suffixes or self.first or self.text or self.also
        ):
            return False
        top = first_bytes(path, HEAD) if data is None else data
        if self.first and not re.search(self.first, top, re.S):
            return False
        if self.text and not re.search(self.text, text_of(top), re.M):
            return False
        return self.also is None or self.also(path)


def first_bytes(path: Path, count: int) -> bytes:
    """Return the first bytes of a file; none of a folder or an unreadable file."""
    try:
        with path.open("rb") as stream:
            return stream.read(count)
    except OSError:
        return b""


def head(path: Path, count: int = 1 << 14) -> str:
    """Return the beginning of a text; empty if there is none."""
    data = first_bytes(path, count)
    return "" if b"\0" in data and data[:2] not in _WIDE else text_of(data)


_WIDE = (b"\xff\xfe", b"\xfe\xff")


@lru_cache(maxsize=2)
def text_of(data: bytes) -> str:
    """Decode the beginning of a text, up to a zero byte."""
    if data.startswith(_WIDE):
        return data.decode("utf-16", "replace")
    return data.partition(b"\0")[0].decode("utf-8-sig", "replace")
