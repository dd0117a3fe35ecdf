"""Files of ISO MME as text: lines of ``key :value``, and samples under them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError
from strapdown.formats import csv
from strapdown.formats.crash_text import clean

Array = NDArray[np.float64]

__all__ = ["MmeHeader", "even_stamps", "read_header", "read_number", "read_samples", "text_of"]

# Headers have some thousand characters; samples some ten each.
LONGEST_HEADER = 262_144
LARGEST = 1_000_000_000
# Powers of ten and whole numbers that doubles hold exactly.
EXACT_POWER = 22
EXACT_WHOLE = 2**53
_KEY = re.compile(r"([^:]*[^:\s])\s*:(.*)")
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eEdD][+-]?\d+)?")
_UNUSUAL = re.compile(r"[^0-9eE+\-. \t\n]")
_MISSING = ("novalue", "nan")


@dataclass(frozen=True)
class MmeHeader:
    """Lines of a header.

    Attributes
    ----------
    file : str
        For messages.
    values : dict of str to (str, int)
        Key in small letters, with single blanks, to its value and its line; the first where a key
        stands more than once.
    more : dict of str to list of str
        All values of each key.
    end : int
        Number of lines before the samples.
    """

    file: str
    values: dict[str, tuple[str, int]]
    more: dict[str, list[str]]
    end: int

    def text(self, key: str) -> str:
        """Value of a key on one line; empty where it is not stated."""
        value = self.values.get(key, ("", 0))[0]
        return "" if value.lower() in ("novalue", "none", "-") else clean(value)

    def all(self, key: str) -> list[str]:
        """Each stated value of a key."""
        texts = [clean(v) for v in self.more.get(key, [])]
        return [t for t in texts if t and t.lower() not in ("novalue", "none", "-")]

    def line(self, key: str) -> int | None:
        """Line of a key."""
        return self.values[key][1] if key in self.values else None

    def number(self, key: str) -> float | None:
        """Value of a key as a number, with or without a unit after it.

        Raises
        ------
        DataError
            It is stated, and no number.
        """
        text = self.text(key)
        if not text:
            return None
        value = read_number(text.split()[0])
        if value is None or not np.isfinite(value):
            raise DataError(
                "io.no-number", file=self.file, row=self.line(key), quantity=key, text=text[:60]
            )
        return value


def text_of(path: Path, longest: int = LARGEST) -> str:
    """Text of a file of the test, in UTF-8 or Windows-1252.

    Raises
    ------
    DataError
        It is no text, or far too large.
    """
    if path.stat().st_size > LARGEST:
        raise DataError("io.bytes-more-than-channel", file=path.name, st_size=path.stat().st_size)
    with path.open("rb") as stream:
        data = stream.read(longest)
    if len(data) == longest:
        data = data[: data.rfind(b"\n") + 1]
    text = csv.decoded(data, path.name)[0]
    if "\0" in text:
        raise DataError("io.mme-with-zero-bytes", file=path.name)
    return text


def read_header(path: Path) -> MmeHeader:
    """Read the header of a file of the test.

    Parameters
    ----------
    path : Path

    Returns
    -------
    MmeHeader

    Raises
    ------
    DataError
        It is empty, no text, or a line is neither ``key :value`` nor the first sample.
    """
    values: dict[str, tuple[str, int]] = {}
    more: dict[str, list[str]] = {}
    end = 0
    for row, line in enumerate(_lines(text_of(path, LONGEST_HEADER)), start=1):
        text = line.strip()
        if not text:
            continue
        if is_sample(text):
            end = row - 1
            break
        end = row
        match = _KEY.fullmatch(text)
        if match is None:
            raise DataError(
                "io.mme-line-not-understood", file=path.name, row=row, clean=clean(text, 60)
            )
        key = " ".join(match[1].lower().split())
        values.setdefault(key, (match[2].strip(), row))
        more.setdefault(key, []).append(match[2].strip())
    if not values:
        raise DataError(
            "io.no-header" if end == 0 and path.stat().st_size else "io.file-empty-3",
            file=path.name,
            row=1,
        )
    return MmeHeader(path.name, values, more, end)


def is_sample(text: str) -> bool:
    """Whether a line is a sample and no `key :value`."""
    return bool(_NUMBER.fullmatch(text)) or text.lower() in _MISSING


def read_number(text: str) -> float | None:
    """Read a number, with a point or a comma."""
    if not _NUMBER.fullmatch(text):
        return None
    return float(text.replace(",", ".").replace("d", "e").replace("D", "e"))


def read_samples(path: Path, header: MmeHeader, quantity: str) -> Array:
    """Samples of a channel, one a line; NaN for NOVALUE.

    Parameters
    ----------
    path : Path
    header : MmeHeader
        Of that file.
    quantity : str
        For messages.

    Returns
    -------
    ndarray, (n,)

    Raises
    ------
    DataError
        A line is no number, or their count is not that of the header.
    """
    lines = _lines(text_of(path))[header.end :]
    while lines and not lines[-1].strip():
        lines.pop()
    promised = header.number("number of samples")
    if promised is not None and promised != len(lines):
        cut = len(lines) < promised
        raise DataError(
            "io.samples-header-says" if cut else "io.samples-header-says-2",
            file=path.name,
            row=header.end + (len(lines) if cut else int(promised) + 1),
            quantity=quantity,
            count=len(lines),
            promised=promised,
        )
    if not lines:
        raise DataError(
            "io.header-no-samples-under", file=path.name, row=header.end, quantity=quantity
        )
    if not _UNUSUAL.search("\n".join(lines)):
        # Most files have points alone and nothing missing.
        try:
            return np.array(lines, dtype=np.float64)
        except ValueError:
            pass
    out = np.empty(len(lines))
    for k, line in enumerate(lines):
        text = line.strip()
        value = float("nan") if text.lower() in _MISSING else read_number(text)
        if value is None:
            raise DataError(
                "io.no-number-2",
                file=path.name,
                row=header.end + k + 1,
                quantity=quantity,
                clean=clean(text, 60),
            )
        out[k] = value
    return out


def even_stamps(first: str, interval: str, count: int) -> Array:
    """Stamps of even sampling, each the double nearest to the decimal number.

    Parameters
    ----------
    first, interval : str
        Decimal numbers, s, as the header has them.
    count : int

    Returns
    -------
    ndarray, (count,), s
        Where the decimals fit into whole numbers below 2^53 over a power of ten up to 10^22, which
        doubles hold exactly, the quotient of the two is rounded once, as IEEE 754 has it; a sum of
        doubles would be off by one in the last place, and a stamp of -0.0499 not be -0.0499.
    """
    start, step = _decimal(first), _decimal(interval)
    k = np.arange(count, dtype=np.int64)
    places = max(0, *(-int(d.as_tuple().exponent) for d in (start, step)))
    if places <= EXACT_POWER:
        scale = 10**places
        a, b = int(start * scale), int(step * scale)
        if abs(a) + abs(b) * count < EXACT_WHOLE:
            whole = (a + b * k).astype(np.float64)
            return np.asarray(whole / float(scale), dtype=np.float64)
    return np.asarray(float(start) + float(step) * k, dtype=np.float64)


def _decimal(text: str) -> Decimal:
    return Decimal(text.replace(",", ".").lower().replace("d", "e"))


def _lines(text: str) -> list[str]:
    # Not splitlines: it would end a line at characters that stand in comments.
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
