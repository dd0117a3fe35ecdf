"""A picture of lines, shapes and text as SVG: all text escaped, the same bytes every time."""

from __future__ import annotations

import base64
import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from html import escape

import numpy as np
from numpy.typing import ArrayLike

from strapdown.constants import Array

Box = tuple[float, float, float, float]


INK = "#1b1f24"
#: Smallest font size, in pixels of a picture at its size on paper.
SMALL = 9.5
# Dash names of charts, in widths of a thin line.
_DASHES = {"dash": "6 4", "dot": "1.5 3", "dashdot": "7 3 1.5 3", "longdash": "11 4"}
# Zero before a decimal point.
_ZERO = re.compile(r"(?<!\d)0\.")
# Letter widths over the font size, of DejaVu Sans, the widest of the usual fonts.
_NARROW, _WIDE = frozenset("iIjl.,:;'|!()[] /tfr°′·"), frozenset("mwMWO@%Q—→←")
_LINE = 1.18
_UNIT = 256.0  # side of a picture before it is placed


def number(value: float) -> str:
    """Format a coordinate to a hundredth of a pixel, without trailing zeros."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def nice_step(least: float) -> float:
    """Smallest of 1, 2, 5 times a power of ten that is not below a number."""
    if not (math.isfinite(least) and least > 0.0):
        return 1.0
    power = 10.0 ** math.floor(math.log10(least))
    for factor in (1.0, 2.0, 5.0, 10.0):
        if factor * power >= least * (1.0 - 1e-9):
            return factor * power
    return 10.0 * power


def tick_words(value: float, step: float) -> str:
    """Format a tick with as many digits as its step needs."""
    digits = max(0, -math.floor(math.log10(step) + 1e-9))
    text = f"{value:.{digits}f}"
    return (text if float(text) else text.removeprefix("-")).replace("-", "−")


def text_width(text: str, size: float, bold: bool = False) -> float:
    """Upper estimate of the width of a line of text in pixels."""
    ems = math.fsum(0.40 if c in _NARROW else 0.95 if c in _WIDE else 0.64 for c in text)
    return ems * size * (1.08 if bold else 1.0)


def shortened(text: str, width: float, size: float) -> str:
    """Cut a text longer than a width in pixels, marked by an ellipsis."""
    if text_width(text, size) <= width:
        return text
    while text and text_width(text + "…", size) > width:
        text = text[:-1]
    return text.rstrip() + "…"


def overlap(a: Box | Array, b: Box | Array) -> float:
    """Overlap area of two boxes (left, top, right, bottom)."""
    across = min(a[2], b[2]) - max(a[0], b[0])
    up = min(a[3], b[3]) - max(a[1], b[1])
    return float(max(across, 0.0) * max(up, 0.0))


class Drawing:
    """Sequence of SVG elements; y points down the page.

    `width`, `height`: in pixels, 1/96 inch at the picture's size on paper. `alt`: text alternative
    for the picture. `boxes`: extent of each line of text, for the placement of others.
    """

    def __init__(self, width: float, height: float, alt: str = "") -> None:
        self.width, self.height, self.alt = float(width), float(height), alt
        self.boxes: list[tuple[str, Box]] = []
        self._parts: list[str] = []

    def svg(self) -> str:
        """Return the whole picture."""
        size = f'width="{number(self.width)}" height="{number(self.height)}"'
        view = f'viewBox="0 0 {number(self.width)} {number(self.height)}"'
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" {size} {view} role="img" '
            'font-family="Helvetica, Arial, DejaVu Sans, sans-serif">'
        )
        title = f"<title>{_escaped(self.alt)}</title>" if self.alt else ""
        paper = (
            f'<rect width="{number(self.width)}" height="{number(self.height)}" fill="#ffffff"/>'
        )
        return "\n".join([head + title, paper, *self._parts, "</svg>\n"])

    @contextmanager
    def group(self, box: Box | None = None, **attributes: str) -> Iterator[None]:
        """Group everything drawn in this context; `data_x` becomes the attribute ``data-x``.

        `box`: to which it is clipped (left, top, right, bottom).
        """
        element, place = "g", ""
        if box is not None:
            left, top, right, bottom = box
            size = f"{number(left)} {number(top)} {number(right - left)} {number(bottom - top)}"
            x, y, width, height = size.split()
            place = f' x="{x}" y="{y}" width="{width}" height="{height}" viewBox="{size}"'
            element, place = "svg", f'{place} overflow="hidden"'
        for name, text in attributes.items():
            quoted = _escaped(text).replace('"', "&quot;")
            place += f' {name.rstrip("_").replace("_", "-")}="{quoted}"'
        self._parts.append(f"<{element}{place}>")
        yield
        self._parts.append(f"</{element}>")

    def line(
        self,
        start: Sequence[float],
        end: Sequence[float],
        colour: str = INK,
        width: float = 1.0,
        dash: str = "solid",
    ) -> None:
        """Draw a straight line."""
        (x1, y1), (x2, y2) = start, end
        ends = f'x1="{number(x1)}" y1="{number(y1)}" x2="{number(x2)}" y2="{number(y2)}"'
        self._parts.append(f"<line {ends}{_stroke(colour, width, dash)}/>")

    def shape(
        self,
        points: ArrayLike,
        colour: str | None = INK,
        width: float = 1.0,
        dash: str = "solid",
        *,
        fill: str | None = None,
        opacity: float = 1.0,
        closed: bool = True,
    ) -> None:
        """Draw a polygon, or a line of several points; skip fewer than two finite points."""
        array = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        array = array[np.isfinite(array).all(axis=1)]
        if len(array) < 2:
            return
        path = " ".join(f"{number(x)},{number(y)}" for x, y in array.tolist())
        kind = "polygon" if closed else "polyline"
        self._parts.append(
            f'<{kind} points="{path}"{_fill(fill, opacity)}{_stroke(colour, width, dash)}/>'
        )

    def circle(
        self,
        centre: Sequence[float],
        radius: float,
        colour: str | None = INK,
        width: float = 1.0,
        *,
        fill: str | None = None,
    ) -> None:
        """Draw a circle."""
        x, y = centre
        at = f'cx="{number(x)}" cy="{number(y)}" r="{number(radius)}"'
        self._parts.append(f"<circle {at}{_fill(fill, 1.0)}{_stroke(colour, width, 'solid')}/>")

    def curve(
        self,
        points: Array,
        colour: str = INK,
        width: float = 1.0,
        dash: str = "solid",
        stamps: Array | None = None,
    ) -> None:
        """Draw a line of many finite points, (n, 2), to a hundredth of a pixel.

        `stamps`: time of each point in s, for the page's script.
        """
        if len(points) < 2:
            return
        times = ""
        if stamps is not None:
            times = f' data-stamps="{" ".join(f"{t:.3f}" for t in stamps.tolist())}"'
        self._parts.append(
            f'<path d="{_steps(points)}" fill="none"{_stroke(colour, width, dash)}{times}/>'
        )

    def area(self, points: Array, fill: str, opacity: float = 1.0) -> None:
        """Fill an outline of many finite points, (n, 2), to a hundredth of a pixel."""
        if len(points) < 3:
            return
        self._parts.append(f'<path d="{_steps(points)}z"{_fill(fill, opacity)}/>')

    def points(
        self, at: Array, outline: Array, radius: float, colour: str, *, hollow: bool = False
    ) -> None:
        """Draw one shape at many points, (n, 2): an outline (k, 2) of radius one, or a circle."""
        if not len(at) or not radius > 0.0:
            return
        size = number(radius)
        if len(outline):
            steps = np.diff(radius * outline, axis=0)
            begin = at + radius * outline[0]
            turn = "l" + " ".join(f"{number(x)},{number(y)}" for x, y in steps.tolist()) + "z"
        else:
            begin = at - np.array([0.0, radius])
            turn = f"a{size},{size} 0 1 0 .01,0z"
        path = "".join(f"M{x:.2f},{y:.2f}{turn}" for x, y in begin.tolist())
        look = f'fill="none"{_stroke(colour, 1.2, "")}' if hollow else f'fill="{colour}"'
        self._parts.append(f'<path class="points" d="{path}" {look}/>')

    def picture(self, data: bytes, media: str, corners: Array) -> None:
        """Draw a square picture by its upper left, upper right and lower left corner, (3, 2).

        `media`: ``png``, ``jpeg`` or ``webp``.
        """
        (x, y), across, down = corners[0], corners[1] - corners[0], corners[2] - corners[0]
        # Half a pixel of 256 larger than it is, so that no gap shows between two.
        turn = " ".join(f"{v / _UNIT:.6f}" for v in (*across.tolist(), *down.tolist()))
        side = number(_UNIT * 1.002)
        source = f"data:image/{media};base64,{base64.b64encode(data).decode('ascii')}"
        self._parts.append(
            f'<image width="{side}" height="{side}" preserveAspectRatio="none" '
            f'transform="matrix({turn} {number(x)} {number(y)})" href="{source}"/>'
        )

    def arrow(
        self,
        tail: Sequence[float],
        tip: Sequence[float],
        colour: str = INK,
        width: float = 2.0,
        dash: str = "solid",
    ) -> None:
        """Draw an arrow with a filled head; skipped if it has no length."""
        x, y = tip[0] - tail[0], tip[1] - tail[1]
        length = math.hypot(x, y)
        if not length > 0.0:
            return
        x, y = x / length, y / length
        head = min(4.0 + 3.0 * width, length)
        neck = (tip[0] - 0.8 * head * x, tip[1] - 0.8 * head * y)
        base, half = (tip[0] - head * x, tip[1] - head * y), 0.42 * head
        self.line(tail, neck, colour, width, dash)
        wings = [(base[0] - half * y, base[1] + half * x), (base[0] + half * y, base[1] - half * x)]
        self.shape([tip, wings[0], neck, wings[1]], None, fill=colour)

    def text(
        self,
        at: Sequence[float],
        text: str,
        size: float = 11.0,
        colour: str = INK,
        *,
        anchor: str = "start",
        bold: bool = False,
        turn: float = 0.0,
        halo: bool = False,
    ) -> Box:
        """Write a line of text, vertically centered at `at`; return its extent.

        Parameters
        ----------
        at : (float, float)
        text : str
            Escaped here.
        anchor : {'start', 'middle', 'end'}
        turn : float, deg
            Clockwise.
        halo : bool
            Whether to draw a white rim that separates it from the background.
        """
        x, y = at
        box = self.box_of(at, text, size, anchor=anchor, bold=bold, turn=turn)
        more = ' font-weight="bold"' if bold else ""
        if anchor != "start":
            more += f' text-anchor="{anchor}"'
        if turn:
            more += f' transform="rotate({number(turn)} {number(x)} {number(y)})"'
        if halo:
            more += (
                ' stroke="#ffffff" stroke-width="3" stroke-linejoin="round" paint-order="stroke"'
            )
        place = f'x="{number(x)}" y="{number(y + 0.35 * size)}"'
        look = f'font-size="{number(size)}" fill="{colour}"'
        self._parts.append(f"<text {place} {look}{more}>{_escaped(text)}</text>")
        self.boxes.append((text, box))
        return box

    def box_of(
        self,
        at: Sequence[float],
        text: str,
        size: float,
        *,
        anchor: str = "start",
        bold: bool = False,
        turn: float = 0.0,
    ) -> Box:
        """Return the extent of a line of text without writing it."""
        width = text_width(text, size, bold)
        left = {"start": 0.0, "middle": -0.5, "end": -1.0}[anchor] * width
        corners = np.array([[left, -0.5], [left + width, -0.5], [left + width, 0.5], [left, 0.5]])
        corners[:, 1] *= _LINE * size
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        turned = corners @ np.array([[c, s], [-s, c]]) + np.asarray(at, dtype=np.float64)
        (x0, y0), (x1, y1) = turned.min(axis=0).tolist(), turned.max(axis=0).tolist()
        return x0, y0, x1, y1

    def label(
        self,
        at: Sequence[float],
        text: str,
        size: float = 10.0,
        colour: str = INK,
        *,
        bold: bool = False,
        away: float = 8.0,
        avoid: Sequence[Box] = (),
    ) -> Box:
        """Write beside a point with the least overlap, with a thin line if far from the point."""
        best: tuple[float, tuple[float, float], str, bool] | None = None
        for far, (dx, dy) in _tries(away, size):
            anchor = "start" if dx > 0.1 else "end" if dx < -0.1 else "middle"
            place = (at[0] + dx, at[1] + dy)
            box = self.box_of(place, text, size, anchor=anchor, bold=bold)
            covered = math.fsum(overlap(box, other) for _, other in self.boxes)
            covered += math.fsum(overlap(box, other) for other in avoid)
            outside = max(2.0 - box[0], box[2] - self.width + 2.0, 0.0)
            outside += max(2.0 - box[1], box[3] - self.height + 2.0, 0.0)
            cost = covered + 50.0 * outside + 0.5 * math.hypot(dx, dy)
            if best is None or cost < best[0] - 1e-9:
                best = (cost, place, anchor, far)
        assert best is not None
        _, place, anchor, far = best
        if far:
            self.line(at, place, "#8a939e", 0.7)
        return self.text(place, text, size, colour, anchor=anchor, bold=bold, halo=True)


def _tries(away: float, size: float) -> list[tuple[bool, tuple[float, float]]]:
    found: list[tuple[bool, tuple[float, float]]] = []
    for ring in (1.0, 1.8, 3.0, 4.5, 6.5):
        reach = away * ring
        for dx, dy in ((1, 0), (1, -1), (1, 1), (-1, 0), (-1, -1), (-1, 1), (0, -1), (0, 1)):
            up = dy * (reach + (0.5 * size if not dx else 0.0))
            found.append((ring > 1.8, (dx * reach, up)))
    return found


def _fill(colour: str | None, opacity: float) -> str:
    text = f' fill="{colour or "none"}"'
    return text + (f' fill-opacity="{number(opacity)}"' if colour and opacity < 1.0 else "")


def _stroke(colour: str | None, width: float, dash: str) -> str:
    if colour is None:
        return ""
    text = f' stroke="{colour}" stroke-width="{number(width)}" stroke-linejoin="round"'
    if dash in _DASHES:
        text += f' stroke-dasharray="{_DASHES[dash]}"'
    return text


def _steps(points: Array) -> str:
    """Format a curve as its start and its steps, which are shorter than its points."""
    rounded = np.rint(100.0 * points).astype(np.int64)
    x, y = (0.01 * rounded[0]).tolist()
    steps = (np.diff(rounded, axis=0) / 100).ravel().tolist()
    pairs = " ".join(["%g,%g"] * (len(steps) // 2)) % tuple(steps)
    return f"M{x:.2f},{y:.2f}l{_ZERO.sub('.', pairs)}"


def _escaped(text: str) -> str:
    """Escape a text for XML, and remove characters that it does not allow."""
    if not (text.isascii() and text.isprintable()):
        text = "".join(c if c >= " " and not "\ud800" <= c <= "\udfff" else " " for c in text)
        text = "".join(c for c in text if c not in "\ufffe\uffff\x7f")
    return escape(text, quote=False)
