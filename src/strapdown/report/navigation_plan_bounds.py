"""Ellipses of 95 % on the plan of a run, and what they are labelled with."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from strapdown.dsp.running_integral import running_integral
from strapdown.evaluation.plane_bound import plane_bound
from strapdown.navigation.record import NavigationRecord, Span
from strapdown.report.chart import BLUE, VERMILLION, Line
from strapdown.report.crash_values import GAP
from strapdown.report.error_envelope import ellipse
from strapdown.report.label_places import place_labels
from strapdown.report.navigation_plane import Plane, within_span
from strapdown.report.navigation_values import duration_words, length_words
from strapdown.report.path_marks import View

__all__ = ["bound_labels", "centres", "ellipse_rows", "ellipses"]

Array = NDArray[np.float64]

# Ellipses: so many at ends of outages, and along the way; the largest as a share of the view.
_AT_OUTAGES, _ALONG, _LARGEST = 8, 6, 0.05
# A letter and a line of text, as shares of the width and of the height.
_LETTER, _TEXT = 0.0082, 0.04


def ellipse_rows(record: NavigationRecord) -> tuple[list[int], list[tuple[int, Span]]]:
    """Marks at which ellipses are drawn: along the way, and at the ends of outages.

    Parameters
    ----------
    record : NavigationRecord

    Returns
    -------
    along : list of int
        Even over the way, the end among them; none in an outage.
    at_outages : list of (int, Span)
        The last mark before each ends; of many those that are known least.
    """
    time = record.sd.index.to_numpy(dtype=np.float64)
    bounds = plane_bound(record.covariance)
    ends: list[tuple[int, Span]] = []
    for span in sorted({s for v in record.outages.values() for s in v}, key=lambda s: s.begin):
        inside = np.flatnonzero((time >= span.begin) & (time < span.end - 1e-6))
        if inside.size:
            ends.append((int(inside[-1]), span))
    ends = sorted(sorted(ends, key=lambda e: -bounds[e[0]])[:_AT_OUTAGES])
    spans = [s for v in record.outages.values() for s in v]
    free = (
        ~np.any([within_span(time, s) for s in spans], axis=0)
        if spans
        else np.ones(time.size, bool)
    )
    rows = np.flatnonzero(free)
    if not rows.size:
        return [], ends
    table = record.trajectory
    speed = np.hypot(table["VN"].to_numpy(), table["VE"].to_numpy())
    at = table.index.to_numpy(dtype=np.float64)
    way = running_integral(at, speed)
    gone = np.interp(time[rows], at, way)
    picked = np.searchsorted(gone, np.linspace(0.0, gone[-1], _ALONG + 1)[1:])
    picked = np.clip(picked, 0, rows.size - 1)
    return [int(k) for k in np.unique(rows[picked])], ends


def ellipses(plane: Plane, view: View) -> tuple[list[Line], str, list[tuple[int, Span]]]:
    """Return ellipses, magnified alike so that the largest can be seen, and what to say of them.

    Parameters
    ----------
    plane : Plane
    view : View

    Returns
    -------
    lines : list of Line
    said : str
        Empty where there are none.
    at_outages : list of (int, Span)
        As `ellipse_rows`.
    """
    record = plane.told.record
    along, ends = ellipse_rows(record)
    rows = [*along, *(k for k, _ in ends)]
    bounds = plane_bound(record.covariance)[rows] * plane.scale
    if not rows or not bounds.max() > 0.0:
        return [], "", []
    factor = max(1.0, _round_down(_LARGEST * view.width / float(bounds.max())))
    middles = centres(plane, rows)
    out = []
    count = len(along)
    times = f"{factor:,.0f}".replace(",", GAP)
    named = "" if factor == 1.0 else f" × {times}"
    drawn = "" if factor == 1.0 else f", drawn {times} times as large"
    for name, colour, part in (
        (f"95{GAP}% ellipse{named}", BLUE, slice(0, count)),
        (f"95{GAP}% ellipse{named} at the end of an outage", VERMILLION, slice(count, None)),
    ):
        if not rows[part]:
            continue
        rings = []
        for k, centre in zip(rows[part], middles[part], strict=True):
            ring = ellipse(
                centre[::-1], (factor * plane.scale) ** 2 * record.covariance[k, :2, :2], 48
            )
            rings.append(np.vstack([ring, ring[:1], [[np.nan, np.nan]]]))
        ned = np.vstack(rings)[:-1]
        out.append(Line(name, ned[:, 1], ned[:, 0], colour, width=1.4, inside=0.16))
    said = f"The place is within an ellipse in 95 of 100 cases{drawn}."
    return out, said if factor == 1.0 else f"{said[:-1]} than they are.", ends


def centres(plane: Plane, rows: list[int]) -> Array:
    """Return east and north of marks, (k, 2), in the unit of the plan."""
    record = plane.told.record
    time = record.trajectory.index.to_numpy(dtype=np.float64)
    at = np.searchsorted(time, record.sd.index.to_numpy(dtype=np.float64)[rows] - 1e-9)
    near = record.trajectory.iloc[np.clip(at, 0, len(time) - 1)]
    return np.column_stack(plane.of(near))


def _round_down(value: float) -> float:
    """The greatest of 1, 2, 5 times a power of ten that is not above a number."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(f * power for f in (5.0, 2.0, 1.0) if f * power <= value * (1.0 + 1e-9))


def bound_labels(
    plane: Plane,
    view: View,
    path: tuple[Array, Array],
    marks: list[Line],
    ends: list[tuple[int, Span]],
) -> list[Line]:
    """Return labels of what the bound had grown to where an outage ended.

    Parameters
    ----------
    plane : Plane
    view : View
    path : tuple of ndarray, (n,)
        East and north: what labels keep off.
    marks : list of Line
        Whose labels they keep off, too.
    ends : list of (int, Span)
        Of `ellipses`.
    """
    if not ends:
        return []
    record = plane.told.record
    bounds = plane_bound(record.covariance)
    points = centres(plane, [k for k, _ in ends])
    words = tuple(
        f"{length_words(float(bounds[k]))} after {duration_words(s.end - s.begin)}" for k, s in ends
    )
    taken = [_text(m, view) for m in marks if m.labels]
    obstacles = np.vstack([view.corners, np.column_stack(path)[:: max(1, path[0].size // 150)]])
    places = place_labels(points[:, 0], points[:, 1], words, np.vstack([obstacles, *taken]))
    return [
        Line(
            "bound",
            points[:, 0],
            points[:, 1],
            VERMILLION,
            points=True,
            symbol="circle",
            size=3.0,
            labels=words,
            places=places,
            legend=False,
        )
    ]


def _text(mark: Line, view: View) -> Array:
    """Points on the labels of marks, about where they stand, (n, 2)."""
    letter, line = _LETTER * view.width, _TEXT * float(view.high[1] - view.low[1])
    found = [np.column_stack([mark.x, mark.y])]
    for x, y, label, (side, rise) in zip(mark.x, mark.y, mark.labels, mark.places, strict=True):
        length = letter * len(label)
        left = x + side * 1.5 * letter - 0.5 * (1 - side) * length
        along = np.linspace(left, left + length, 5)
        found.append(np.column_stack([along, np.full(5, y + rise * line)]))
    return np.vstack(found)
