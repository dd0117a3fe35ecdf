"""Where the labels of points stand, so that they do not cover each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

__all__ = ["PLACES", "place_labels"]

#: Where a label may stand, the best first, and the corner of its box from the point in units of
#: its size: 0 begins at the point, -1 ends there.
PLACES: dict[str, tuple[float, float]] = {
    "top center": (-0.5, 0.0),
    "bottom center": (-0.5, -1.0),
    "top right": (0.0, 0.0),
    "bottom right": (0.0, -1.0),
    "top left": (-1.0, 0.0),
    "bottom left": (-1.0, -1.0),
    "middle right": (0.0, -0.5),
    "middle left": (-1.0, -0.5),
}
# Of an axis, in its length: a character and a line of text of a chart of 900 by 350 pixels.
_CHARACTER, _TEXT_HEIGHT, _POINT = 0.0085, 0.06, 0.02


def place_labels(
    x: ArrayLike, y: ArrayLike, labels: Sequence[str], obstacles: ArrayLike = ()
) -> tuple[str, ...]:
    """Choose a place for each label, one after the other.

    Parameters
    ----------
    x, y : array_like, (n,)
        Points on axes that are drawn linearly (logarithms, where an axis is logarithmic).
    labels : sequence of str
    obstacles : array_like, (m, 2)
        Further points that a label should not cover.

    Returns
    -------
    tuple of str
        Of `PLACES`: where the least of a label lies on other labels, points or outside.
    """
    others = np.asarray(obstacles, dtype=np.float64).reshape(-1, 2)
    points = np.column_stack([np.asarray(x, float), np.asarray(y, float)])
    everything = np.vstack([points, others])
    low, high = everything.min(axis=0), everything.max(axis=0)
    # As the drawers do, leave a margin; a single value stands in the middle.
    span = np.where(high > low, high - low, 1.0)
    unit = 0.06 + 0.88 * (everything - low) / span
    unit[:, high == low] = 0.5
    dots = [_box(p, (-0.5, -0.5), (_POINT, _POINT), 0.0) for p in unit]
    taken: list[Array] = []
    chosen = []
    for k, label in enumerate(labels):
        size = (_CHARACTER * len(label), _TEXT_HEIGHT)
        boxes = {place: _box(unit[k], corner, size) for place, corner in PLACES.items()}
        covered = {
            place: 4.0 * sum(_overlap(box, other) for other in taken)
            + sum(_overlap(box, dot) for j, dot in enumerate(dots) if j != k)
            + _outside(box)
            for place, box in boxes.items()
        }
        best = min(covered, key=lambda place: round(covered[place], 9))
        chosen.append(best)
        taken.append(boxes[best])
    return tuple(chosen)


def _box(
    point: Array, corner: tuple[float, float], size: tuple[float, float], gap: float = 0.5 * _POINT
) -> Array:
    """Left, bottom, right, top of a label's box, a gap away from its point."""
    left = point[0] + corner[0] * size[0] + gap * np.sign(corner[0] + 0.5)
    bottom = point[1] + corner[1] * size[1] + gap * np.sign(corner[1] + 0.5)
    return np.array([left, bottom, left + size[0], bottom + size[1]])


def _overlap(a: Array, b: Array) -> float:
    width = min(a[2], b[2]) - max(a[0], b[0])
    height = min(a[3], b[3]) - max(a[1], b[1])
    return float(max(width, 0.0) * max(height, 0.0))


def _outside(box: Array) -> float:
    """Area beyond the axes, which weighs most: it would be cut off."""
    whole = float((box[2] - box[0]) * (box[3] - box[1]))
    return 10.0 * (whole - _overlap(box, np.array([0.0, 0.0, 1.0, 1.0])))
