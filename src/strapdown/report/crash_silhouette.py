"""The vehicle from its right side and from behind."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from strapdown.report.crash_outline import Outline
from strapdown.report.svg_drawing import Drawing

__all__ = ["Project", "draw_behind", "draw_side"]

#: Pixels of a place in vehicle axes, m.
Project = Callable[[Sequence[float]], tuple[float, float]]
_BODY = "#3d5166"
# A car from its side, along its length (0 the rear) and down from its origin, m; from behind, of
# half its width. Of no car in particular.
_SIDE = (
    *((0.0, 0.30), (0.0, -0.22), (0.03, -0.33), (0.13, -0.39), (0.24, -0.91), (0.30, -0.95)),
    *((0.50, -0.95), (0.56, -0.92), (0.70, -0.37), (0.93, -0.24), (0.99, -0.10), (1.0, 0.08)),
    (1.0, 0.30),
)
_SIDE_GLASS = ((0.185, -0.42), (0.265, -0.84), (0.545, -0.84), (0.655, -0.42))
_REAR = ((1.0, 0.30), (1.0, -0.25), (0.95, -0.38), (0.74, -0.90), (0.62, -0.95))
_REAR_GLASS = ((0.84, -0.42), (0.68, -0.82))
_BOX = ((1.0, 0.50), (1.0, -0.95))
_WHEEL = 0.31  # m


def draw_side(out: Drawing, outline: Outline, view: Project, scale: float) -> None:
    """Draw a vehicle from its right side: `view` makes pixels of places, `scale` of metres."""
    low, high = float(outline.low[0]), float(outline.high[0])
    ground = view((low, 0.0, 0.5))[1]
    out.line(
        (view((low, 0, 0))[0] - 22.0, ground), (view((high, 0, 0))[0] + 22.0, ground), "#c3cad2"
    )
    if outline.stated:
        shape = [(low, z) for _, z in _BOX] + [(high, z) for _, z in reversed(_BOX)]
        out.shape([view((x, 0.0, z)) for x, z in shape], _BODY, 1.4, fill="#eef1f5")
        return

    def at(part: tuple[tuple[float, float], ...]) -> list[tuple[float, float]]:
        return [view((low + share * (high - low), 0.0, z)) for share, z in part]

    out.shape(at(_SIDE), _BODY, 1.4, fill="#eef1f5")
    out.shape(at(_SIDE_GLASS), _BODY, 0.6, fill=_BODY, opacity=0.35)
    for share in (0.19, 0.81):
        wheel = view((low + share * (high - low), 0.0, 0.5 - _WHEEL))
        out.circle(wheel, scale * _WHEEL, _BODY, 1.2, fill="#c5cdd6")


def draw_behind(out: Drawing, outline: Outline, view: Project) -> None:
    """Draw a vehicle from behind; `view` makes pixels of places."""
    middle = 0.5 * float(outline.low[1] + outline.high[1])
    half = 0.5 * float(outline.high[1] - outline.low[1])
    ground = view((0.0, 0.0, 0.5))[1]
    ends = (view((0, middle - half, 0))[0] - 40.0, view((0, middle + half, 0))[0] + 40.0)
    out.line((ends[0], ground), (ends[1], ground), "#c3cad2")

    def whole(part: tuple[tuple[float, float], ...]) -> list[tuple[float, float]]:
        both = [*part, *((-y, z) for y, z in reversed(part))]
        return [view((0.0, middle + half * y, z)) for y, z in both]

    if outline.stated:
        out.shape(whole(_BOX), _BODY, 1.4, fill="#eef1f5")
        return
    for y in (-0.82, 0.82):
        x = view((0.0, middle + half * y, 0.0))[0]
        top = view((0.0, 0.0, 0.5 - 2.0 * _WHEEL))[1]
        tyre = [(x - 5.0, top), (x + 5.0, top), (x + 5.0, ground), (x - 5.0, ground)]
        out.shape(tyre, _BODY, 1.0, fill="#c5cdd6")
    out.shape(whole(_REAR), _BODY, 1.4, fill="#eef1f5")
    out.shape(whole(_REAR_GLASS), _BODY, 0.6, fill=_BODY, opacity=0.25)
