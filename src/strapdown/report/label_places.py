"""Where the labels of points stand, so that they do not cover each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

__all__ = ["PLACES", "place_labels"]

#: Where a label may stand, the best first: on which side of its point (-1 left, 0 above or below,
#: 1 right), and how many lines of text above it; from two on, a thin line leads to it.
PLACES: tuple[tuple[int, int], ...] = (
    *((side, rise) for rise in (1, -1) for side in (0, 1, -1)),
    (1, 0),
    (-1, 0),
    *((side, sign * rise) for rise in (2, 3, 4) for sign in (1, -1) for side in (0, 1, -1)),
)
# Of an axis, in its length: a character, a line of text and a point of a chart of 900 by 320
# pixels.
_CHARACTER, _LINE, _POINT = 0.0082, 0.05, 0.02


def place_labels(
    x: ArrayLike, y: ArrayLike, labels: Sequence[str], obstacles: ArrayLike = ()
) -> tuple[tuple[int, int], ...]:
    """Choose a place for each label, the longest first.

    Parameters
    ----------
    x, y : array_like, (n,)
        Points on axes that are drawn linearly (logarithms, where an axis is logarithmic).
    labels : sequence of str
    obstacles : array_like, (m, 2)
        Further points that a label should not cover.

    Returns
    -------
    tuple of (int, int)
        Of `PLACES`, in the order of the labels: where the least of a label lies on other
        labels, on points or outside.
    """
    if not labels:
        return ()
    others = np.asarray(obstacles, dtype=np.float64).reshape(-1, 2)
    points = np.column_stack([np.asarray(x, float), np.asarray(y, float)])
    unit = _on_axes(np.vstack([points, others]))
    dots = np.hstack([unit - 0.5 * _POINT, unit + 0.5 * _POINT])
    taken: list[Array] = []
    chosen: dict[int, tuple[int, int]] = {}
    for k in sorted(range(len(labels)), key=lambda j: (-len(labels[j]), j)):
        boxes = [_box(unit[k], place, len(labels[k])) for place in PLACES]
        covered = [
            4.0 * sum(_overlap(box, other) for other in taken)
            + sum(_overlap(box, dots[j]) for j in _touched(box, dots) if j != k)
            + _outside(box)
            # Near is better where nothing is covered anyway.
            + 1e-7 * number
            for number, box in enumerate(boxes)
        ]
        best = int(np.argmin(np.round(covered, 9)))
        chosen[k] = PLACES[best]
        taken.append(boxes[best])
    return tuple(chosen[k] for k in range(len(labels)))


def _on_axes(points: Array) -> Array:
    """Points as shares of the axes, which leave a margin about them."""
    low, high = points.min(axis=0), points.max(axis=0)
    unit = np.full(points.shape, 0.5)
    wide = high > low
    unit[:, wide] = 0.05 + 0.9 * (points - low)[:, wide] / (high - low)[wide]
    return unit


def _touched(box: Array, others: Array) -> list[int]:
    """Which of many boxes, (n, 4), share an area with one."""
    apart = np.minimum(others[:, 2:], box[2:]) <= np.maximum(others[:, :2], box[:2])
    touched: list[int] = np.flatnonzero(~apart.any(axis=1)).tolist()
    return touched


def _box(point: Array, place: tuple[int, int], characters: int) -> Array:
    """Left, bottom, right, top of a label."""
    side, rise = place
    width = _CHARACTER * characters
    left = point[0] + {-1: -width - 0.5 * _POINT, 0: -0.5 * width, 1: 0.5 * _POINT}[side]
    bottom = point[1] + (rise - 0.5) * _LINE
    return np.array([left, bottom, left + width, bottom + _LINE])


def _overlap(a: Array, b: Array) -> float:
    width = min(a[2], b[2]) - max(a[0], b[0])
    height = min(a[3], b[3]) - max(a[1], b[1])
    return float(max(width, 0.0) * max(height, 0.0))


def _outside(box: Array) -> float:
    """Area beyond the axes, which weighs most: it would be cut off."""
    whole = float((box[2] - box[0]) * (box[3] - box[1]))
    return 10.0 * (whole - _overlap(box, np.array([0.0, 0.0, 1.0, 1.0])))
