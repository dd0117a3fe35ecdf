"""The vehicle as a body in space: its outline given a height, its front marked."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.report.crash_outline import Outline
from strapdown.report.error_envelope import hull

Array = NDArray[np.float64]

__all__ = ["VehicleBody", "vehicle_body"]

# Heights of no vehicle in particular, m, down from the vehicle's origin: the origin of a car is
# taken half a metre above the ground.
_SILL, _BELT, _ROOF = 0.50, -0.30, -0.95
_RING = 16  # corners of the outline that are kept
# Of length and width: the cabin at the belt and at the roof.
_CABIN = ((0.09, 0.735, 0.90), (0.19, 0.565, 0.72))
_CABIN_FACES = 5
_SIDE, _TOP, _GLASS, _FRONT = "#9fb3c8", "#cdd8e2", "#3d5166", "#D55E00"


@dataclass(frozen=True, eq=False)
class VehicleBody:
    """Corners and faces of a body.

    Attributes
    ----------
    corners : ndarray, (n, 3), m
        Vehicle axes forward, right, down, from the vehicle's origin.
    faces : tuple of tuple of int
        Corners of each face.
    colours : tuple of str
        Of each face.
    cabin : int
        How many of the last faces are those of a cabin on top of the rest.
    """

    corners: Array = field(repr=False)
    faces: tuple[tuple[int, ...], ...] = field(repr=False)
    colours: tuple[str, ...] = field(repr=False)
    cabin: int = 0

    @property
    def bottom(self) -> float:
        """How far down it reaches from the origin, m."""
        return float(self.corners[:, 2].max())

    @property
    def triangles(self) -> tuple[Array, tuple[str, ...]]:
        """Corners of triangles that make up the faces, (k, 3), and the colour of each."""
        rows, colours = [], []
        for face, colour in zip(self.faces, self.colours, strict=True):
            for j in range(1, len(face) - 1):
                rows.append([face[0], face[j], face[j + 1]])
                colours.append(colour)
        return np.array(rows, dtype=np.float64), tuple(colours)

    @property
    def edges(self) -> tuple[tuple[int, int], ...]:
        """Pairs of corners, each once."""
        found: dict[tuple[int, int], None] = {}
        for face in self.faces:
            for a, b in zip(face, (*face[1:], face[0]), strict=True):
                found[(min(a, b), max(a, b))] = None
        return tuple(found)

    def seen(self, corners: Array, away: Array) -> list[int]:
        """Faces that are seen, the farthest first, however the body is turned.

        Parameters
        ----------
        corners : ndarray, (n, 3), m
            As `placed`.
        away : ndarray, (3,)
            Direction of sight, in the same axes.
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
        # Both parts are convex, and the top of the lower one lies between them.
        cap = lower[-1]
        above = cap in order[0]
        return [*order[0], *order[1]] if above else [*order[1], *order[0]]

    def placed(self, at: ArrayLike, q_nb: ArrayLike, point: ArrayLike) -> Array:
        """Corners in the axes of the path, (n, 3), m.

        Parameters
        ----------
        at : array_like, (3,), m
            Where `point` is.
        q_nb : array_like, (4,)
        point : array_like, (3,), m
            Of the vehicle, vehicle axes.
        """
        arms = self.corners - np.asarray(point, dtype=np.float64)
        return np.asarray(rotation.rotate(q_nb, arms) + np.asarray(at, dtype=np.float64))


def vehicle_body(outline: Outline) -> VehicleBody:
    """Make a body of an outline: a car with a cabin, or a plain one of a stated outline.

    Parameters
    ----------
    outline : Outline
        In vehicle axes.
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
