"""Animation of the vehicle along its path in 3D, and still instants for paper."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown.constants import Array
from strapdown.crash.events import CrashEvent
from strapdown.crash.path import CrashPath
from strapdown.report.chart import BLUE, GREY, VERMILLION
from strapdown.report.crash_outline import Outline, path_moments
from strapdown.report.document import Animation, Picture
from strapdown.report.plan import hull
from strapdown.report.scene import Scene, SceneBody, SceneLine, SceneWord
from strapdown.report.svg_drawing import INK, SMALL, Drawing, nice_step, tick_words
from strapdown.report.values import plain
from strapdown.tables import NED

#: A slider on a page cannot resolve more frames.
MOST_FRAMES = 120
_FRAME = 60.0  # ms
_SOFT = "#4a525c"


def path_animation(
    path: CrashPath,
    outline: Outline,
    *,
    events: Sequence[CrashEvent] = (),
    point: Sequence[float] = (0.0, 0.0, 0.0),
    names: tuple[str, str] = ("forward", "right"),
    reference: pd.DataFrame | None = None,
    reference_name: str = "reference",
) -> Animation:
    """Animate the vehicle along its path with its attitude.

    `outline`: in vehicle axes. `point`, (3,), m: reference point of the path, in vehicle axes.
    `names`: of the first two axes of the path. `reference`: ``north east down`` of the point in the
    axes of the path, m. Returns: at most `MOST_FRAMES` frames, at samples of the path.
    """
    body = vehicle_body(outline)
    rows = np.unique(
        np.linspace(0, len(path.time) - 1, min(MOST_FRAMES, len(path.time))).round().astype(int)
    )
    places = path.table[NED].to_numpy(dtype=np.float64)
    corners = [body.placed(places[k], path.q_nb[k], point) for k in rows]
    given = None if reference is None else reference[NED].to_numpy(dtype=np.float64)
    ground = body.bottom - float(point[2]) + places[path.anchor, 2]
    low, high = _space([*corners, places, *([] if given is None else [given])], ground)
    lines, words = _ground(low, high, ground, names)
    lines.append(SceneLine("path of the reference point", _few(places), GREY, 1.5))
    if given is not None:
        lines.append(SceneLine(reference_name, _few(given), VERMILLION, 2.0, True))
    scene = Scene(
        (
            SceneBody(
                body.corners - np.asarray(point, dtype=np.float64),
                body.faces,
                body.colours,
                path.q_nb[rows],
                places[rows],
            ),
        ),
        tuple(lines),
        tuple(words),
        tuple(f"{1e3 * path.time[row]:.0f} ms".replace("-", "−") for row in rows.tolist()),
        low,
        high,
        _FRAME,
        (path.entry.heading_deg + 90.0 - _AHEAD, _ABOVE),
        ("up to now", BLUE),
    )
    slower = 1e-3 * _FRAME * len(rows) / max(float(path.time[-1] - path.time[0]), 1e-3)
    caption = (
        f"The vehicle on its path; {names[0]}, {names[1]} and down in m from the position of the "
        "reference point at the entry, one scale for all axes. Orange: front. Length and width are "
        "the vehicle's, the height is illustrative; the ground is drawn half a meter below the "
        "vehicle's origin at the entry."
    )
    return Animation(
        "motion",
        "Motion in 3D",
        caption,
        scene,
        crash_stills(path, body, events=events, point=point, ground=ground),
        f"Played {slower:.2g} times slower; drag to turn the view.",
    )


def _space(points: Sequence[Array], ground: float) -> tuple[Array, Array]:
    """Minimum and maximum north, east, down of all points, with a margin."""
    every = np.vstack(points)
    every = every[np.isfinite(every).all(axis=1)]
    low, high = every.min(axis=0), every.max(axis=0)
    low[:2] -= 0.5
    high[:2] += 0.5
    high[2] = max(high[2], ground) + 0.05
    low[2] -= 0.2
    return low, high


def _few(points: Array) -> Array:
    rows = np.unique(np.linspace(0, len(points) - 1, min(len(points), 300)).astype(int))
    return np.asarray(points[rows])


def _ground(
    low: Array, high: Array, down: float, names: tuple[str, str]
) -> tuple[list[SceneLine], list[SceneWord]]:
    """Grid on the ground, with the names and numbers of its axes along two edges."""
    step = nice_step(float((high - low)[:2].max()) / 16.0)
    rows: list[list[float]] = []
    words = []
    gap = [math.nan] * 3
    for axis in (0, 1):
        other = 1 - axis
        edge = float(low[other] if axis else high[other]) + (-0.6 if axis else 0.6) * step
        first, last = math.ceil(low[axis] / step), math.floor(high[axis] / step)
        for k in range(first, last + 1):
            at = [0.0, 0.0, down]
            at[axis] = k * step
            for end in (low[other], high[other]):
                at[other] = float(end)
                rows.append(list(at))
            rows.append(gap)
            if k % 2 == 0:
                at[other] = edge
                words.append(SceneWord(tick_words(k * step, step), (at[0], at[1], down), _SOFT))
        at = [0.0, 0.0, down]
        at[axis] = 0.5 * float(low[axis] + high[axis])
        at[other] = edge + (-1.2 if axis else 1.2) * step
        words.append(SceneWord(f"{names[axis]}, m", (at[0], at[1], down), INK))
    return [SceneLine(f"ground, {step:g} m", np.array(rows), "#c3cad2", 0.8)], words


# Still instants of the motion in 3D, in parallel projection from right, ahead and above.


_WIDTH, _GAP, _HEAD = 640.0, 10.0, 20.0
_MOST = 6
# Direction of the viewer: angle ahead of the right side, and elevation, deg.
_AHEAD, _ABOVE = 28.0, 30.0
_GRID = "#dfe4ea"
# Above this ratio of width to height, a row has two views instead of three.
_WIDE = 2.0


def crash_stills(
    path: CrashPath,
    body: VehicleBody,
    *,
    events: Sequence[CrashEvent] = (),
    point: Sequence[float] = (0.0, 0.0, 0.0),
    ground: float = 0.5,
) -> Picture:
    """Draw the vehicle at up to six instants of its path.

    `point`, (3,), m: reference point in vehicle axes. `ground`, m: down coordinate of the drawn
    ground, in the axes of the path. All views have one scale.
    """
    places = path.table[NED].to_numpy(dtype=np.float64)
    instants = _instants(path, events)
    rows = [int(np.abs(path.time - at).argmin()) for _, at in instants]
    flat, away = _projection(path.entry.heading_deg)
    corners = [body.placed(places[k], path.q_nb[k], point) for k in rows]
    shown = np.vstack([*corners, places]) @ flat
    low, high = shown.min(axis=0), shown.max(axis=0)
    size = np.maximum(high - low, 0.5)
    columns = 2 if size[0] > _WIDE * size[1] else 3
    width = (_WIDTH - _GAP * (columns - 1)) / columns
    scale = min((width - 16.0) / size[0], 240.0 / size[1])
    height = scale * float(size[1]) + 16.0
    lines = -(-len(rows) // columns)
    words = ", ".join(f"{name} {plain(1e3 * at, 0)} ms" for name, at in instants)
    spanned = np.vstack([places, *corners])[:, :2]
    step = nice_step(float(np.ptp(spanned, axis=0).max()) / 12.0)
    out = Drawing(_WIDTH, lines * (height + _HEAD + _GAP), f"The vehicle in space at {words}")
    for k, (row, (name, at)) in enumerate(zip(rows, instants, strict=True)):
        left = (k % columns) * (width + _GAP)
        top = (k // columns) * (height + _HEAD + _GAP)
        centre = np.array([left + 0.5 * width, top + _HEAD + 0.5 * height])

        def pixels(points: Array, centre: Array = centre) -> Array:
            page = points @ flat - 0.5 * (low + high)
            return np.asarray(centre + scale * page * [1.0, -1.0])

        _cell(out, (left, top, width, height), f"{plain(1e3 * at, 0)} ms", name)
        shadow = places.copy()
        shadow[:, 2] = ground
        with out.group((left, top + _HEAD, left + width, top + _HEAD + height)):
            _ground_lines(out, pixels, spanned, step, ground)
            out.shape(pixels(shadow), "#8a939e", 1.0, "dash", closed=False)
            out.shape(pixels(shadow[: row + 1]), BLUE, 2.2, closed=False)
            for f in body.seen(corners[k], away):
                face = pixels(corners[k][list(body.faces[f])])
                out.shape(face, "#3d5166", 0.6, fill=body.colours[f])
    return Picture(
        "motion",
        out.svg(),
        "Motion in 3D",
        "The vehicle at instants of its path, in parallel projection from the right, ahead and "
        "above of its attitude at the entry. Blue: path of the reference point up to that instant, "
        "projected onto the ground; dashed: the whole path. Lines on the ground are "
        f"{step:g} m apart.",
        out.alt,
    )


def _projection(heading_deg: float) -> tuple[Array, Array]:
    """Right and up of a page that is projected onto, (3, 2), and the direction away from it."""
    heading, around = math.radians(heading_deg), -math.radians(_AHEAD)
    above = math.radians(_ABOVE)
    ahead = np.array([math.cos(heading), math.sin(heading), 0.0])
    right = np.array([-math.sin(heading), math.cos(heading), 0.0])
    up = np.array([0.0, 0.0, -1.0])
    away = math.sin(around) * ahead - math.cos(around) * right
    across = math.cos(around) * ahead + math.sin(around) * right
    page = np.column_stack([across, math.cos(above) * up + math.sin(above) * away])
    return page, math.cos(above) * away - math.sin(above) * up


def _instants(path: CrashPath, events: Sequence[CrashEvent]) -> list[tuple[str, float]]:
    """The key instants, with others added in the longest intervals between them."""
    found = path_moments(path, events)
    if len(found) > _MOST:
        found = [one for one in found if one[0] != "begin"]
    while len(found) > _MOST:
        gaps = [found[k + 1][1] - found[k - 1][1] for k in range(1, len(found) - 1)]
        found.pop(1 + int(np.argmin(gaps)))
    step = float(np.median(np.diff(path.time))) if len(path.time) > 1 else 0.0
    while 2 <= len(found) < _MOST:
        gaps = [b[1] - a[1] for a, b in pairwise(found)]
        k = int(np.argmax(gaps))
        if gaps[k] < 4.0 * step:
            break
        found.insert(k + 1, ("", 0.5 * (found[k][1] + found[k + 1][1])))
    return found


def _cell(out: Drawing, box: tuple[float, float, float, float], when: str, name: str) -> None:
    left, top, width, height = box
    low, high = top + _HEAD, top + _HEAD + height
    rim = [(left, low), (left + width, low), (left + width, high), (left, high)]
    out.shape(rim, "#c3cad2", 0.8, fill="#fbfcfd")
    after = out.text((left + 2.0, top + 10.0), when, 11.5, INK, bold=True)[2]
    out.text((after + 6.0, top + 10.0), name, SMALL, "#4a525c")


def _ground_lines(
    out: Drawing, pixels: Callable[[Array], Array], spanned: Array, step: float, ground: float
) -> None:
    """Lines on the ground, `step` m apart, under the points (n, 2) that it is to span."""
    low = np.floor(spanned.min(axis=0) / step) * step
    high = np.ceil(spanned.max(axis=0) / step) * step
    for axis in (0, 1):
        other = 1 - axis
        for k in range(round((high[axis] - low[axis]) / step) + 1):
            ends = np.full((2, 3), ground)
            ends[:, axis] = low[axis] + k * step
            ends[:, other] = low[other], high[other]
            out.shape(pixels(ends), _GRID, 0.7, closed=False)


# The vehicle as a 3D body: its outline with a height, its front marked.


# Typical heights, m, down from the vehicle's origin; the origin of a car is taken half a meter
# above the ground.
_SILL, _BELT, _ROOF = 0.50, -0.30, -0.95
_RING = 16  # corners kept of the outline
# Shares of length and width: the cabin at the belt and at the roof.
_CABIN = ((0.09, 0.735, 0.90), (0.19, 0.565, 0.72))
_CABIN_FACES = 5
_SIDE, _TOP, _GLASS, _FRONT = "#9fb3c8", "#cdd8e2", "#3d5166", "#D55E00"


@dataclass(frozen=True, eq=False)
class VehicleBody:
    """Corners and faces of a vehicle body.

    `corners`, (n, 3), m: vehicle axes forward, right, down, from the vehicle's origin. `faces`:
    corner indices of each face. `colours`: one per face. `cabin`: number of faces, at the end, that
    belong to a cabin on top of the body.
    """

    corners: Array = field(repr=False)
    faces: tuple[tuple[int, ...], ...] = field(repr=False)
    colours: tuple[str, ...] = field(repr=False)
    cabin: int = 0

    @property
    def bottom(self) -> float:
        """Down coordinate of the lowest corner, from the origin, m."""
        return float(self.corners[:, 2].max())

    def seen(self, corners: Array, away: Array) -> list[int]:
        """Visible faces, farthest first, for any attitude of the body.

        `corners`, (n, 3), m: as returned by `placed`. `away`, (3,): viewing direction, in the same
        axes.
        """
        lower = range(len(self.faces) - self.cabin)
        upper = range(len(self.faces) - self.cabin, len(self.faces))
        order: list[list[int]] = [[], []]
        for part, faces in enumerate((lower, upper)):
            used = sorted({c for f in faces for c in self.faces[f]})
            middle = corners[used].mean(axis=0) if used else np.zeros(3)
            for f in faces:
                a, b, c = corners[list(self.faces[f][:3])]
                normal = np.cross(b - a, c - a)
                outward = normal if normal @ (a - middle) > 0.0 else -normal
                if outward @ away < 0.0:
                    order[part].append(f)
        # Both parts are convex and separated by the top of the lower one.
        cap = lower[-1]
        above = cap in order[0]
        return [*order[0], *order[1]] if above else [*order[1], *order[0]]

    def placed(self, at: ArrayLike, q_nb: ArrayLike, point: ArrayLike) -> Array:
        """Corners in the axes of the path, (n, 3), m.

        `at`, (3,), m: position of `point`. `q_nb`, (4,). `point`, (3,), m: of the vehicle, in
        vehicle axes.
        """
        arms = self.corners - np.asarray(point, dtype=np.float64)
        return np.asarray(rotation.rotate(q_nb, arms) + np.asarray(at, dtype=np.float64))


def vehicle_body(outline: Outline) -> VehicleBody:
    """Make a body from an outline: a car with a cabin, or a plain body for a stated outline.

    `outline`: in vehicle axes.
    """
    ring = hull(outline.body)
    if len(ring) > _RING:
        ring = ring[np.unique(np.linspace(0, len(ring), _RING, endpoint=False).astype(int))]
    low, high = outline.low, outline.high
    n, top = len(ring), _ROOF if outline.stated else _BELT
    levels = [np.column_stack([ring, np.full(n, z)]) for z in (_SILL, top)]
    faces: list[tuple[int, ...]] = []
    colours: list[str] = []
    front = float(high[0] - 0.06 * (high[0] - low[0]))
    for k in range(n):
        j = (k + 1) % n
        faces.append((k, j, n + j, n + k))
        ahead = min(ring[k, 0], ring[j, 0]) > front
        colours.append(_FRONT if ahead else _SIDE)
    faces.append(tuple(range(n, 2 * n)))
    colours.append(_TOP)
    if not outline.stated:
        length, width = (high - low).tolist()
        middle = 0.5 * float(low[1] + high[1])
        for (rear, fore, wide), z in zip(_CABIN, (_BELT, _ROOF), strict=True):
            x = low[0] + length * np.array([rear, fore, fore, rear])
            y = middle + 0.5 * width * wide * np.array([-1.0, -1.0, 1.0, 1.0])
            levels.append(np.column_stack([x, y, np.full(4, z)]))
        a, b = 2 * n, 2 * n + 4
        faces += [(a + k, a + (k + 1) % 4, b + (k + 1) % 4, b + k) for k in range(4)]
        faces.append((b, b + 1, b + 2, b + 3))
        colours += [_GLASS] * 4 + [_TOP]
    cabin = 0 if outline.stated else _CABIN_FACES
    return VehicleBody(np.vstack(levels), tuple(faces), tuple(colours), cabin)
