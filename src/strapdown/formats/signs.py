"""How a file or folder shows its format: by its ending, its first bytes and their text.

A format states its signs as data. All formats look at the same first bytes, which are read once;
a function of the format is called only where the signs leave it open.
"""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import lru_cache, wraps
from pathlib import Path
from typing import Any, TypeVar

T = TypeVar("T")
#: Bytes of a file that are looked at.
HEAD = 1 << 16


@dataclass(frozen=True)
class Signs:
    """Detection of a format."""

    #: Endings of a file that are enough, in lower case.
    named: tuple[str, ...] = ()
    #: Endings that a file may have otherwise; any if empty.
    suffixes: tuple[str, ...] = ()
    #: Regular expression that is found in the first `HEAD` bytes; a dot is any byte.
    first: bytes = b""
    #: Regular expression that is found in the text of these bytes; ``^`` and ``$`` are ends of a
    #: line. The text of binary content ends at its first zero byte.
    text: str = ""
    #: Sign that these cannot express; called if all others are there.
    also: Callable[[Path], bool] | None = None
    #: Pattern of names (`fnmatch`, in lower case), of which a folder holds at least one.
    inside: str = ""
    #: Sign of a folder. Without either no folder is of this format.
    folder: Callable[[Path], bool] | None = None
    #: Whether an archive (``.zip``) is looked at like a folder.
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


#: Most entries of a folder by which its state is known.
_MOST_ENTRIES = 200


def state_of(path: Path) -> tuple[Any, ...]:
    """Return what shows whether a file or folder was changed; empty where it cannot be known.

    Of a file: its size, its time of change and its first bytes, as a clock of files may be too
    coarse for a file that is written twice. Of a folder: those of all entries in it, without bytes.
    """
    try:
        if not path.is_dir():
            about = path.stat()
            return about.st_ino, about.st_size, about.st_mtime_ns, first_bytes(path, HEAD)
        inside = sorted(itertools.islice(path.rglob("*"), _MOST_ENTRIES + 1))
        if len(inside) > _MOST_ENTRIES:
            return ()
        return tuple((str(p), (at := p.stat()).st_size, at.st_mtime_ns) for p in inside)
    except OSError:
        return ()


def while_unchanged(most: int) -> Callable[[Callable[[Path], T]], Callable[[Path], T]]:
    """Keep the newest results of a function of a path until its file or folder changes."""

    def decorated(read: Callable[[Path], T]) -> Callable[[Path], T]:
        kept = lru_cache(maxsize=most)(lambda path, _state: read(path))
        found = wraps(read)(lambda path: kept(path, state_of(path)))
        vars(found)["cache_clear"] = kept.cache_clear
        return found

    return decorated


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


# Strings, brackets and commas of JSON.
_JSON = re.compile(r'"(?:[^"\\]|\\.)*"|[\[\]{},]')


@lru_cache(maxsize=2)
def json_beginning(text: str) -> tuple[Any, int]:
    """Parse the first value of a text in JSON, of which the end may be missing or damaged.

    Returns the value, or its part before the damage, and the length of a whole one, or else 0. None
    if the text does not begin with a list or an object.
    """
    closing, sound = {"[": "]", "{": "}"}, 0
    if text[:1] not in closing:
        return None, 0
    try:
        return json.JSONDecoder().raw_decode(text)
    except json.JSONDecodeError as error:
        sound = error.pos
    except (RecursionError, ValueError):  # or an integer of 4,301 digits
        return None, 0
    open_, end, closers = "", 0, ""
    for m in _JSON.finditer(text, 0, sound):
        if m[0] in closing:
            open_ = closing[m[0]] + open_
        elif m[0] in "]}":
            open_ = open_[1:]
        if len(m[0]) == 1:
            end, closers = m.start() if m[0] == "," else m.end(), open_
    try:
        return json.loads(text[:end] + closers), 0
    except (RecursionError, ValueError):
        return None, 0
