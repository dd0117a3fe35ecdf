"""Compare a file of two runs by its content: numbers within a tolerance, all else exactly.

Another processor or library may round the last digits of a number differently, and other versions
may draw a page differently. Compared, by kind of file:

* tables and arrays: the numbers of a column within `EQUAL` of its spread; words, units, comments
  and names exactly; JSON: a number within `EQUAL` of itself; positions within `PLACE`, times and
  angles within `EQUAL` of a second and a degree;
* HTML, SVG, KML, GeoJSON and other text: everything between the numbers exactly, the numbers within
  one unit of their last digit, whole numbers exactly;
* PDF: the same for all objects in it, drawings included.

Where other versions drew (another page, other fonts), the text of a page, an SVG or a PDF is
extracted and compared in that way; `Comparison.drawing` then says that the rest was not compared.
A picture of points is not compared: its figure as SVG is beside it.
"""

from __future__ import annotations

import base64
import itertools
import json
import logging
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError, StrapdownError
from strapdown.formats import read_raw
from strapdown.formats.signs import first_bytes
from strapdown.parsers.process import parse

#: A long integration amplifies rounding. A larger difference is a different result.
EQUAL = 1e-6
#: Latitude and longitude: a tenth of a millimetre.
PLACE = 1e-9  # deg
# Differences of numbers that are rounding alone, in any unit.
_ROUNDING = 1e-12
#: Readers of arrays, in a process of their own, and whether the file is as long as what it holds.
ARRAYS = {
    ".npz": ("archives.arrays", True),
    ".h5": ("hdf5.arrays", True),
    ".mat": ("matlab.arrays", True),
    ".parquet": ("parquet.table", False),
    ".geoparquet": ("parquet.with_bytes", False),
}
_NUMBER = re.compile(r"-?\d+\.?\d*(?:[eE][+-]?\d+)?")
_OWN_VERSION = re.compile(r"strapdown \d+\.\d+\.\d+[\w.+]*")
_EMBEDDED = re.compile(r"data:image/svg\+xml;base64,([A-Za-z0-9+/=]+)")
_BLANKS = re.compile(r"\s+")


@dataclass(frozen=True)
class Comparison:
    """Result of the comparison of two files.

    Attributes
    ----------
    within : float
        Largest difference of a number, relative if it exceeds 1; infinite if anything else differs.
    drawing : bool
        Whether the drawing was not compared: only the text agrees, or nothing could be read.
    """

    within: float
    drawing: bool = False


_DIFFERENT = Comparison(math.inf)


def compare_files(one: Path, two: Path, *, drawn_alike: bool) -> Comparison:
    """Compare two files of one name by their content.

    `drawn_alike`: whether the versions that draw are the same, so that drawings must be.
    """
    ending = one.suffix.lower()
    try:
        if ending == ".json":
            return Comparison(_difference_of_json(one, two))
        if ending in ARRAYS:
            return Comparison(_difference_of_arrays(one, two, *ARRAYS[ending]))
        if ending == ".csv":
            return Comparison(_difference_of_tables(one, two))
        if ending == ".pdf":
            return _compare_pdf(one, two, drawn_alike)
        texts = [path.read_bytes().decode("utf-8") for path in (one, two)]
        if ending == ".geojson":
            json_of(texts[0])
    except UnicodeDecodeError:
        return Comparison(0.0, drawing=True) if ending == ".png" else _DIFFERENT
    except (ValueError, RecursionError, StrapdownError):
        return _DIFFERENT
    if same_text(*texts):
        return Comparison(0.0)
    if drawn_alike or ending not in (".html", ".svg"):
        return _DIFFERENT
    said = [_joined(_html_text(text)) for text in texts]
    return Comparison(0.0, drawing=True) if same_text(*said) else _DIFFERENT


# Text with numbers.


def same_text(one: str, two: str) -> bool:
    """Whether two texts are the same but for the last digit of numbers, and our own version."""
    one, two = (_EMBEDDED.sub(_decoded, _OWN_VERSION.sub("strapdown", t)) for t in (one, two))
    if one == two:
        return True
    if _NUMBER.sub("#", one) != _NUMBER.sub("#", two):
        return False
    pairs = zip(_NUMBER.findall(one), _NUMBER.findall(two), strict=True)
    return all(x == y or _near(x, y) for x, y in pairs)


def _decoded(found: re.Match[str]) -> str:
    try:
        return base64.b64decode(found[1], validate=True).decode("utf-8")
    except ValueError:
        return found[0]


def _near(one: str, two: str) -> bool:
    """Whether two printed numbers may be roundings of nearly the same number."""
    p, q = float(one), float(two)
    if not math.isfinite(p) or not math.isfinite(q):
        return False
    if one.lstrip("-").isdigit() and two.lstrip("-").isdigit():
        # Whole numbers count something; a rounding does not change them but with odds of 1e-6.
        return p == q
    last = min(_unit(one), _unit(two))
    # Numbers with all of their digits, as in the scenes of a page, have no last one to round.
    return abs(p - q) <= max(1.001 * last, PLACE * abs(p), _ROUNDING)


def _unit(number: str) -> float:
    """Unit of the last digit of a printed number."""
    mantissa, _, exponent = number.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    return 10.0 ** (int(exponent or 0) - decimals) if abs(int(exponent or 0)) < 300 else 0.0


# JSON, tables and arrays.


def json_of(text: str) -> Any:
    """Parse JSON. ValueError, also for a key twice in an object: readers may take either."""

    def pairs(found: list[tuple[str, Any]]) -> dict[str, Any]:
        if len(made := dict(found)) != len(found):
            raise ValueError("a key twice")
        return made

    return json.loads(text, object_pairs_hook=pairs)


def _difference_of_json(one: Path, two: Path) -> float:
    leaves = [list(_leaves(json_of(p.read_text(encoding="utf-8")))) for p in (one, two)]
    if len(leaves[0]) != len(leaves[1]):
        return math.inf
    return max(map(_leaf_difference, *leaves), default=0.0)


_Leaf = tuple[tuple[str | int, ...], str, Any]


def _leaves(value: Any, path: tuple[str | int, ...] = (), key: str = "") -> Iterator[_Leaf]:
    """Every value in JSON with its path and the name of its field; an empty list, too."""
    if isinstance(value, dict) and value:
        for name, item in value.items():
            yield from _leaves(item, (*path, name), name)
    elif isinstance(value, list) and value:
        for k, item in enumerate(value):
            yield from _leaves(item, (*path, k), key)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield path, key, float(value)
    else:
        yield path, key, value


def _leaf_difference(one: _Leaf, two: _Leaf) -> float:
    (place, key, x), (other, _, y) = one, two
    if place != other:
        return math.inf
    if isinstance(x, float) and isinstance(y, float):
        return _apart(key, np.array([x]), np.array([y]), abs(x))
    if isinstance(x, str) and isinstance(y, str):
        return 0.0 if same_text(x, y) else math.inf
    return 0.0 if x == y and type(x) is type(y) else math.inf


_LINES = 20_000


def _difference_of_tables(one: Path, two: Path) -> float:
    with one.open(encoding="utf-8", newline="") as a, two.open(encoding="utf-8", newline="") as b:
        while True:
            texts = ["".join(itertools.islice(stream, _LINES)) for stream in (a, b)]
            if texts == ["", ""]:
                break
            if _NUMBER.sub("#", texts[0]) != _NUMBER.sub("#", texts[1]):
                return math.inf
    first, second = read_raw(one), read_raw(two)
    said = [repr((t.units, t.above, t.rate)) for t in (first, second)]
    return _largest(first.columns, second.columns) if same_text(*said) else math.inf


def _difference_of_arrays(one: Path, two: Path, reader: str, full: bool) -> float:
    # What no reader looks at, as a comment of an archive, makes the file longer.
    if full and one.stat().st_size != two.stat().st_size:
        return math.inf
    if one.suffix.lower() == ".mat" and first_bytes(one, 128) != first_bytes(two, 128):
        return math.inf
    first, second = parse(reader, one), parse(reader, two)
    if "arrays" not in first:
        return _largest(first, second)
    said = [repr((f.get("units"), f.get("meta"))) for f in (first, second)]
    return _largest(first["arrays"], second["arrays"]) if same_text(*said) else math.inf


def _largest(one: Mapping[str, NDArray[Any]], two: Mapping[str, NDArray[Any]]) -> float:
    if list(one) != list(two) or any(one[k].shape != two[k].shape for k in one):
        return math.inf
    return max((_apart(n, one[n], two[n], _spread(one[n])) for n in one), default=0.0)


def _spread(values: NDArray[Any]) -> float:
    """Distance between the least and the largest number."""
    if values.dtype.kind not in "fiu" or not np.isfinite(values).any():
        return 0.0
    return float(np.nanmax(values) - np.nanmin(values))


def _apart(name: str, one: NDArray[Any], two: NDArray[Any], scale: float) -> float:
    """Largest difference, as a part of `scale`; infinite if one is not a number.

    A difference that is rounding alone counts as a part of one, and what may be `EQUAL` is less for
    positions, times and angles, whose numbers may be large.
    """
    if not {one.dtype.kind, two.dtype.kind} <= set("fiu"):
        return 0.0 if np.array_equal(one, two) else math.inf
    # An empty field on both sides is equal.
    apart = np.where(np.isnan(one) & np.isnan(two), 0.0, np.abs(one - two))
    if name.endswith("heading_deg"):
        # A heading just below 360 may be just above 0 on another platform.
        apart = np.minimum(apart, np.abs(apart - 360.0))
    if name.startswith(("lat", "lon")):
        scale = min(scale, PLACE / EQUAL)
    elif name.endswith(("_s", "_deg")) or name in ("t", "time"):
        scale = min(scale, 1.0)
    rounding = _ROUNDING * max(1.0, float(np.max(np.abs(one), initial=0.0, where=np.isfinite(one))))
    largest = float(np.max(apart, initial=0.0))
    if not math.isfinite(largest):
        return math.inf
    return 0.0 if largest == 0.0 else largest / max(scale, rounding / EQUAL)


# The text of a page, and the objects of a PDF.


class _Text(HTMLParser):
    """Content of a page: its text, the data of its scenes, and where its links lead."""

    _SAID = ("href", "alt", "title", "aria-label")

    def __init__(self) -> None:
        super().__init__()
        self.said: list[str] = []
        self._skip: str | None = None

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        data = tag == "script" and given.get("type") == "application/json"
        if tag == "style" or (tag == "script" and not data):
            self._skip = tag
        self.said += [value for name in self._SAID if (value := given.get(name))]
        source = _EMBEDDED.fullmatch(given.get("src") or "")
        if source:
            self.said += _html_text(_decoded(source))

    def handle_endtag(self, tag: str) -> None:
        if tag == self._skip:
            self._skip = None

    def handle_data(self, data: str) -> None:
        if self._skip is None:
            self.said.append(data)


def _html_text(text: str) -> list[str]:
    page = _Text()
    page.feed(text)
    page.close()
    return page.said


def _joined(parts: Iterable[str]) -> str:
    """Words with one blank between them, wherever lines were broken."""
    return _BLANKS.sub(" ", " ".join(parts)).strip()


def _compare_pdf(one: Path, two: Path, drawn_alike: bool) -> Comparison:
    try:
        import pypdf
        from pypdf.errors import PyPdfError
    except ImportError:
        raise ConfigError("report.pdf-not-compared", file=one.name) from None

    # A later part of a file replaces objects, in one viewer or in all.
    data = one.read_bytes()
    if data.count(b"startxref") != 1 or not data.rstrip().endswith(b"%%EOF"):
        return _DIFFERENT
    log = logging.getLogger("pypdf")
    before, log.disabled = log.disabled, True
    try:
        readers = [pypdf.PdfReader(path, strict=True) for path in (one, two)]
        parts = [list(_pdf_objects(reader)) for reader in readers]
        if len(parts[0]) == len(parts[1]) and all(map(_same_part, *parts)):
            return Comparison(0.0)
        if drawn_alike:
            return _DIFFERENT
        # Lines may be broken elsewhere, within a word, too.
        said = ["".join(_BLANKS.sub("", p.extract_text()) for p in r.pages) for r in readers]
    except (PyPdfError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return _DIFFERENT  # a damaged file can break the library anywhere
    finally:
        log.disabled = before
    return Comparison(0.0, drawing=True) if same_text(*said) else _DIFFERENT


def _pdf_objects(reader: Any) -> Iterator[tuple[str, bytes]]:
    """Each object of a PDF as text, with the decoded data of a stream."""
    from pypdf.generic import IndirectObject, StreamObject

    for number in range(1, int(reader.trailer["/Size"])):
        found = reader.get_object(IndirectObject(number, 0, reader))
        stream = isinstance(found, StreamObject)
        entries = {k: v for k, v in found.items() if k != "/Length"} if stream else found
        # Names of objects hold the address of their reader.
        yield re.sub(r", \d+\)", ")", repr(entries)), found.get_data() if stream else b""


def _same_part(one: tuple[str, bytes], two: tuple[str, bytes]) -> bool:
    if not same_text(one[0], two[0]):
        return False
    if one[1] == two[1]:
        return True
    try:
        return same_text(one[1].decode("ascii"), two[1].decode("ascii"))
    except UnicodeDecodeError:
        return same_text(one[1].decode("latin-1"), two[1].decode("latin-1"))
