"""What passes between this process and the one that parses files: JSON and raw arrays.

An answer is a tree of dictionaries, lists, text, numbers, dates, bytes and arrays. Its JSON is
first, with a slot for each array, whose dtype, shape and bytes follow. Nothing is executed that
arrives: pickle is not used, dtypes are those of a list, and sizes are checked before memory is
taken, because the sender has parsed a file that nobody vouches for.
"""

from __future__ import annotations

import itertools
import json
import re
import struct
from collections.abc import Callable
from datetime import date, datetime, time
from typing import Any

import numpy as np

#: Length of the JSON, and of all arrays together.
_LENGTHS = struct.Struct("<QQ")
#: Numbers, dates and texts of fixed width, whose bytes are all that they are.
_DTYPE = re.compile(r"[<>|=](?:[biufcSU]\d{1,9}|[mM]8(?:\[\d{0,4}[a-zA-Z]{1,2}\])?)")
_ARRAY, _TEXTS, _BYTES = "\0array", "\0texts", "\0bytes"
_MOMENTS: dict[str, Callable[[str], Any]] = {
    "\0datetime": datetime.fromisoformat,
    "\0date": date.fromisoformat,
    "\0time": time.fromisoformat,
}
_LAST_CODE_POINT = 0x10FFFF
Room = Callable[[tuple[int, int]], np.ndarray[Any, Any]]


class BrokenAnswerError(Exception):
    """What arrived is not an answer."""


def encode(value: Any) -> list[Any]:
    """Return the buffers of a tree, in the order in which they are written."""
    arrays: list[np.ndarray[Any, Any]] = []
    about: list[list[Any]] = []

    def tagged(one: Any) -> Any:
        if isinstance(one, np.generic) and one.dtype.kind != "V":
            one = one.item()
            return one if isinstance(one, bool | int | float | str | None) else tagged(one)
        if isinstance(one, np.ndarray):
            if not _DTYPE.fullmatch(one.dtype.str):
                return {_TEXTS: [str(v) for v in one.ravel().tolist()], "shape": one.shape}
            # The layout is kept: sums depend on it in their last bit.
            turned = one.flags.f_contiguous and not one.flags.c_contiguous
            flat = np.ascontiguousarray(one.T if turned else one).reshape(-1)
            arrays.append(flat)
            about.append([one.dtype.str, one.shape, turned, flat.nbytes])
            return {_ARRAY: len(about) - 1}
        if isinstance(one, bytes | bytearray | memoryview):
            arrays.append(np.frombuffer(one, np.uint8))
            about.append(["|u1", [len(one)], False, len(one)])
            return {_BYTES: len(about) - 1}
        kind = f"\0{type(one).__name__}"
        if kind in _MOMENTS:
            return {kind: one.isoformat()}
        return list(one) if isinstance(one, set | frozenset) else str(one)

    text = json.dumps(value, default=tagged)
    head = json.dumps([about, text]).encode()
    size = sum(a.nbytes for a in arrays)
    return [_LENGTHS.pack(len(head), size), head, *(a.view(np.uint8) for a in arrays if a.nbytes)]


def decode(stream: Any, most: int, most_text: int | None = None, room: Room | None = None) -> Any:
    """Read a tree.

    `most`: bytes that its arrays may have. `most_text`: that the rest may. `room`: makes an array,
    (k, n), of which successive arrays of n doubles are the rows. EOFError: the stream ended.
    BrokenAnswerError: it is not a tree.
    """
    head, size = _LENGTHS.unpack(_exactly(stream, _LENGTHS.size))
    if size > most or head > (most if most_text is None else most_text):
        raise BrokenAnswerError(f"{head + size} bytes")
    try:
        about, text = json.loads(_exactly(stream, head))
        sizes = [int(nbytes) for *_, nbytes in about]
        if min(sizes, default=0) < 0 or sum(sizes) != size:
            raise BrokenAnswerError("sizes")
        arrays: list[np.ndarray[Any, Any]] = []
        for alike, some in itertools.groupby(about, key=lambda one: (one[0], one[1])):
            group = list(some)
            rows: Any = [None] * len(group)
            if room is not None and alike[0] == "<f8" and len(alike[1]) == 1:
                count = int(alike[1][0])
                if any(int(nbytes) != 8 * count for *_, nbytes in group):
                    raise BrokenAnswerError("shape")
                rows = room((len(group), count))
            arrays += [_array(stream, row, *one) for one, row in zip(group, rows, strict=True)]

        def untagged(one: dict[str, Any]) -> Any:
            if _ARRAY in one:
                return arrays[one[_ARRAY]]
            if _BYTES in one:
                return arrays[one[_BYTES]].tobytes()
            if _TEXTS in one:
                made = np.empty(len(one[_TEXTS]), dtype=object)
                made[:] = [str(v) for v in one[_TEXTS]]
                return made.reshape(one["shape"])
            for kind, made_from in _MOMENTS.items():
                if kind in one:
                    return made_from(one[kind])
            return one

        return json.loads(text, object_hook=untagged)
    except (EOFError, BrokenAnswerError):
        raise
    except Exception as error:  # of a sender that is not trusted
        raise BrokenAnswerError(type(error).__name__) from None


def _array(
    stream: Any,
    row: np.ndarray[Any, Any] | None,
    dtype: str,
    shape: list[int],
    turned: bool,
    nbytes: int,
) -> np.ndarray[Any, Any]:
    """Read an array, of one dimension into `row` if it is given."""
    if not _DTYPE.fullmatch(dtype):
        raise BrokenAnswerError("dtype")
    kind = np.dtype(dtype)
    count = int(np.prod([int(n) for n in shape], dtype=object))
    if min(shape, default=0) < 0 or count * kind.itemsize != nbytes:
        raise BrokenAnswerError("shape")
    values = np.empty(count, dtype=kind) if row is None else row
    if nbytes:
        _into(stream, values.view(np.uint8).data)
    if kind.kind == "U" and nbytes:
        order: Any = kind.byteorder
        if values.view(np.dtype(np.uint32).newbyteorder(order)).max() > _LAST_CODE_POINT:
            raise BrokenAnswerError("text")
    if row is not None:
        return row
    return values.reshape(shape[::-1]).T if turned else values.reshape(shape)


def _exactly(stream: Any, size: int) -> bytes:
    data = bytearray(size)
    _into(stream, memoryview(data))
    return bytes(data)


def _into(stream: Any, view: memoryview) -> None:
    done = 0
    while done < len(view):
        count = stream.readinto(view[done:])
        if not count:
            raise EOFError
        done += count
