"""Instants of the motion in space, in parallel projection from right, ahead and above."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.crash_event import CrashEvent
from strapdown.crash.path import CrashPath
from strapdown.report.chart import BLUE
from strapdown.report.crash_body import VehicleBody
from strapdown.report.crash_moments import path_moments
from strapdown.report.crash_values import plain
from strapdown.report.document import Picture
from strapdown.report.plan_view import nice_step
from strapdown.report.svg_drawing import INK, SMALL, Drawing
from strapdown.tables import NED

Array = NDArray[np.float64]

__all__ = ["crash_stills"]

_WIDTH, _GAP, _HEAD = 640.0, 10.0, 20.0
_MOST = 6
# Where the eye is: so far ahead of the right side, and so high, deg.
_AHEAD, _ABOVE = 28.0, 30.0
_GRID = "#dfe4ea"
# Wider than so many times its height, and two views stand in a row instead of three.
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

    Parameters
    ----------
    path : CrashPath
    body : VehicleBody
    events : sequence of CrashEvent
    point : sequence of float, (3,), m
        The reference point in vehicle axes.
    ground : float, m
        How far down the ground is drawn, in the axes of the path.

    Returns
    -------
    Picture
        One scale for all.
    """
    places = path.table[NED].to_numpy(dtype=np.float64)
    instants = _instants(path, events)
    rows = [int(np.abs(path.time - at).argmin()) for _, at in instants]
    flat = _Projection(path.entry.heading_deg)
    corners = [body.placed(places[k], path.q_nb[k], point) for k in rows]
    shown = flat.page(np.vstack([*corners, places]))
    low, high = shown.min(axis=0), shown.max(axis=0)
    size = np.maximum(high - low, 0.5)
    columns = 2 if size[0] > _WIDE * size[1] else 3
    width = (_WIDTH - _GAP * (columns - 1)) / columns
    scale = min((width - 16.0) / size[0], 240.0 / size[1])
    height = scale * float(size[1]) + 16.0
    lines = -(-len(rows) // columns)
    words = ", ".join(f"{name} {plain(1e3 * at, 0)} ms" for name, at in instants)
    out = Drawing(_WIDTH, lines * (height + _HEAD + _GAP), f"The vehicle in space at {words}")
    for k, (row, (name, at)) in enumerate(zip(rows, instants, strict=True)):
        left = (k % columns) * (width + _GAP)
        top = (k // columns) * (height + _HEAD + _GAP)
        centre = np.array([left + 0.5 * width, top + _HEAD + 0.5 * height])

        def pixels(points: Array, centre: Array = centre) -> Array:
            page = flat.page(points) - 0.5 * (low + high)
            return np.asarray(centre + scale * page * [1.0, -1.0])

        _cell(out, (left, top, width, height), f"{plain(1e3 * at, 0)} ms", name)
        shadow = places.copy()
        shadow[:, 2] = ground
        with out.within((left, top + _HEAD, left + width, top + _HEAD + height)):
            _ground(out, pixels, (places, corners), ground)
            out.shape(pixels(shadow), "#8a939e", 1.0, "dash", closed=False)
            out.shape(pixels(shadow[: row + 1]), BLUE, 2.2, closed=False)
            _body(out, body, corners[k], flat, pixels)
    return Picture(
        "motion",
        out.svg(),
        "The motion in space",
        "The vehicle at instants of its path, in parallel projection from the right, ahead and "
        "above of how it stood at the entry; one scale for all. Orange: the front. Blue: the path "
        "of the reference point up to then, put down on the ground; dashed: the whole of it. "
        f"Lines on the ground are {_step(places, corners):g} m apart. The height of the vehicle is "
        "for the eye alone.",
        out.alt,
    )


class _Projection:
    """Parallel projection onto a page: right, and up; depth grows away from the eye."""

    def __init__(self, heading_deg: float) -> None:
        heading, around = math.radians(heading_deg), -math.radians(_AHEAD)
        above = math.radians(_ABOVE)
        ahead = np.array([math.cos(heading), math.sin(heading), 0.0])
        right = np.array([-math.sin(heading), math.cos(heading), 0.0])
        up = np.array([0.0, 0.0, -1.0])
        away = math.sin(around) * ahead - math.cos(around) * right
        across = math.cos(around) * ahead + math.sin(around) * right
        self._page = np.column_stack([across, math.cos(above) * up + math.sin(above) * away])
        self.away = math.cos(above) * away - math.sin(above) * up

    def page(self, points: Array) -> Array:
        return np.asarray(points @ self._page)


def _instants(path: CrashPath, events: Sequence[CrashEvent]) -> list[tuple[str, float]]:
    """The instants that matter, and others where there is most time between."""
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


def _step(places: Array, corners: list[Array]) -> float:
    """Between lines on the ground, m."""
    every = np.vstack([places, *corners])[:, :2]
    return nice_step(float(np.ptp(every, axis=0).max()) / 12.0)


def _ground(
    out: Drawing, pixels: Callable[[Array], Array], shown: tuple[Array, list[Array]], ground: float
) -> None:
    places, corners = shown
    every = np.vstack([places, *corners])
    low, high = every[:, :2].min(axis=0), every[:, :2].max(axis=0)
    step = _step(places, corners)
    low, high = np.floor(low / step) * step, np.ceil(high / step) * step
    for axis in (0, 1):
        other = 1 - axis
        for k in range(round((high[axis] - low[axis]) / step) + 1):
            ends = np.full((2, 3), ground)
            ends[:, axis] = low[axis] + k * step
            ends[:, other] = low[other], high[other]
            out.shape(pixels(ends), _GRID, 0.7, closed=False)


def _body(
    out: Drawing,
    body: VehicleBody,
    corners: Array,
    flat: _Projection,
    pixels: Callable[[Array], Array],
) -> None:
    """Faces that the eye sees."""
    for f in body.seen(corners, flat.away):
        points = pixels(corners[list(body.faces[f])])
        out.shape(points, "#3d5166", 0.6, fill=body.colours[f])
