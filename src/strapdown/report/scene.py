"""A scene in space with moving bodies: its description, and its data for the page's script."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from strapdown.constants import Array

_DIGITS = 4  # a tenth of a millimeter


@dataclass(frozen=True, eq=False)
class SceneBody:
    """A rigid body with its pose in each frame.

    `corners`, (n, 3), m: in body axes. `faces`: corners of each face, convex. `colours`: one per
    face. `q`, (frames, 4): body to scene, scalar first; a row of NaN hides the body. `positions`,
    (frames, 3), m, or None: of the body's origin; None for the origin of the scene. `wire`: edges
    alone, dashed. `axes`: name, tip in body axes and color of arrows from the body's origin.
    """

    corners: Array = field(repr=False)
    faces: tuple[tuple[int, ...], ...] = field(repr=False)
    colours: tuple[str, ...] = field(repr=False)
    q: Array = field(repr=False)
    positions: Array | None = field(default=None, repr=False)
    wire: bool = False
    axes: tuple[tuple[str, tuple[float, float, float], str], ...] = ()


@dataclass(frozen=True, eq=False)
class SceneLine:
    """A line that does not move; a row of NaN in `points`, (n, 3), breaks it.

    An empty name has no legend entry.
    """

    name: str
    points: Array = field(repr=False)
    colour: str
    width: float = 1.0
    dash: bool = False


@dataclass(frozen=True)
class SceneWord:
    """A text at a point of the scene."""

    text: str
    at: tuple[float, float, float]
    colour: str


@dataclass(frozen=True, eq=False)
class Scene:
    """Bodies, lines and texts in space, seen in parallel projection; axes north, east, down.

    `frames`: name of each frame, with its unit. `low`, `high`, (3,), m: corners of the drawn space.
    `interval_ms`: between frames in playback. `view`, deg: azimuth of the viewer, clockwise from
    north, and elevation. `trail`: name and color of the path of the first body up to the frame, if
    any. `height`: pixels.
    """

    bodies: tuple[SceneBody, ...]
    lines: tuple[SceneLine, ...]
    words: tuple[SceneWord, ...]
    frames: tuple[str, ...]
    low: Array
    high: Array
    interval_ms: float = 60.0
    view: tuple[float, float] = (153.0, 30.0)
    trail: tuple[str, str] | None = None
    height: int = 480

    @property
    def legend(self) -> list[dict[str, Any]]:
        """Name, color and dash of each named line."""
        lines = [(line.name, line.colour, line.dash) for line in self.lines]
        if self.trail:
            lines.append((*self.trail, False))
        return [{"name": n, "colour": c, "dash": d} for n, c, d in lines if n]

    def data(self) -> dict[str, Any]:
        """Return the scene as plain data for the page's script."""
        return {
            "bodies": [
                {
                    "corners": _rows(body.corners),
                    "faces": [list(face) for face in body.faces],
                    "colours": list(body.colours),
                    "q": _rows(body.q),
                    "positions": None if body.positions is None else _rows(body.positions),
                    "wire": body.wire,
                    "axes": [{"name": n, "tip": list(t), "colour": c} for n, t, c in body.axes],
                }
                for body in self.bodies
            ],
            "lines": [
                {
                    "points": _rows(line.points),
                    "colour": line.colour,
                    "width": line.width,
                    "dash": line.dash,
                }
                for line in self.lines
            ],
            "words": [{"text": w.text, "at": list(w.at), "colour": w.colour} for w in self.words],
            "frames": list(self.frames),
            "low": self.low.tolist(),
            "high": self.high.tolist(),
            "interval_ms": self.interval_ms,
            "view": list(self.view),
            "trail": {"colour": self.trail[1], "width": 3} if self.trail else None,
        }


def _rows(values: Array) -> list[list[float] | None]:
    return [
        None if np.isnan(row).any() else [round(v, _DIGITS) + 0.0 for v in row.tolist()]
        for row in values
    ]
