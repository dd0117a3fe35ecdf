"""The vehicle from above: its outline, the marking of its front, and its position."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.config.crash_case import VehicleSpec
from strapdown.report.svg_drawing import Drawing

Array = NDArray[np.float64]

__all__ = ["Outline", "draw_outline", "vehicle_outline"]

# Half of a generic car, along (0 the rear, 1 the front) and to the side (1 the widest): its
# body, and the details that mark its front.
_BODY = (
    *((0.000, 0.55), (0.004, 0.72), (0.016, 0.86), (0.045, 0.95), (0.120, 0.99), (0.300, 1.00)),
    *((0.620, 1.00), (0.800, 0.985), (0.880, 0.955), (0.940, 0.890), (0.975, 0.780)),
    *((0.993, 0.620), (1.000, 0.380)),
)
_WINDSCREEN = ((0.565, 0.70), (0.700, 0.86), (0.722, 0.55), (0.728, 0.0))
_SCREEN_FOOT = ((0.565, 0.0),)
_REAR_WINDOW = ((0.085, 0.0), (0.092, 0.60), (0.105, 0.78), (0.185, 0.68), (0.190, 0.0))
_BONNET = ((0.745, 0.80), (0.965, 0.58))
# Size of the arrow that marks the front of a stated outline, as a share of its smaller side.
_ARROW = 0.28


@dataclass(frozen=True, eq=False)
class Outline:
    """A vehicle from above in some plane.

    Attributes
    ----------
    body : ndarray, (n, 2), m
        Corners in order around the body, in vehicle axes forward and right, or as placed.
    windows : tuple of ndarray, (k, 2), m
        Filled shapes: the windscreen first, or an arrow towards the front of a stated outline.
    folds : tuple of ndarray, (k, 2), m
        Lines on the body.
    stated : bool
        Whether the outline is stated in the case, instead of a car of its length and width.
    """

    body: Array = field(repr=False)
    windows: tuple[Array, ...] = field(repr=False)
    folds: tuple[Array, ...] = field(repr=False)
    stated: bool = False

    @property
    def low(self) -> Array:
        """Minimum coordinates, (2,), m."""
        return np.asarray(self.body.min(axis=0))

    @property
    def high(self) -> Array:
        """Maximum coordinates, (2,), m."""
        return np.asarray(self.body.max(axis=0))

    def placed(self, at: ArrayLike, heading_deg: float, point: ArrayLike = (0.0, 0.0)) -> Outline:
        """Turn and move the vehicle into a level plane.

        Parameters
        ----------
        at : array_like, (2,), m
            Position of `point`: north and east, or the axes of headings of zero and of 90 deg.
        heading_deg : float, deg
            Clockwise from above. Roll and pitch are not shown.
        point : array_like, (2,), m
            Of the vehicle, forward and right from its origin.
        """
        c, s = math.cos(math.radians(heading_deg)), math.sin(math.radians(heading_deg))
        turn = np.array([[c, s], [-s, c]])
        origin, there = np.asarray(point, np.float64)[:2], np.asarray(at, np.float64)[:2]

        def moved(points: Array) -> Array:
            return np.asarray((points - origin) @ turn + there)

        return replace(
            self,
            body=moved(self.body),
            windows=tuple(moved(w) for w in self.windows),
            folds=tuple(moved(f) for f in self.folds),
        )

    def edge(self, point: ArrayLike, direction_deg: float) -> float:
        """Distance from a point to the outline in a direction, m; zero if it does not intersect.

        Parameters
        ----------
        point : array_like, (2,), m
        direction_deg : float, deg
            Clockwise from forward.
        """
        u = np.array([math.cos(math.radians(direction_deg)), math.sin(math.radians(direction_deg))])
        a = self.body - np.asarray(point, dtype=np.float64)[:2]
        b = np.roll(a, -1, axis=0)
        across = np.array([-u[1], u[0]])
        da, db = a @ across, b @ across
        meets = (da <= 0.0) != (db <= 0.0)
        share = np.where(meets, da / np.where(meets, da - db, 1.0), 0.0)
        reach = ((a + share[:, None] * (b - a)) @ u)[meets]
        return float(max(reach.max(initial=0.0), 0.0))


def vehicle_outline(vehicle: VehicleSpec) -> Outline:
    """Outline of a vehicle from above, in vehicle axes from its origin.

    Parameters
    ----------
    vehicle : VehicleSpec
        ``outline_m`` as stated; else a car of ``length_m`` and ``width_m`` whose front is
        ``front_m`` ahead of the origin, half its length where that is not given.

    Returns
    -------
    Outline
    """
    if len(vehicle.outline_m) >= 3:
        body = np.array(vehicle.outline_m, dtype=np.float64)
        low, high = body.min(axis=0), body.max(axis=0)
        size = _ARROW * float((high - low).min())
        tip = np.array([high[0] - 0.35 * size, 0.5 * (low[1] + high[1])])
        wings = [[-1.2 * size, -0.6 * size], [-0.85 * size, 0.0], [-1.2 * size, 0.6 * size]]
        return Outline(body, (np.vstack([tip, tip + np.array(wings)]),), (), stated=True)
    front = 0.5 * vehicle.length_m if vehicle.front_m is None else vehicle.front_m
    scale = np.array([vehicle.length_m, 0.5 * vehicle.width_m])

    def whole(half: tuple[tuple[float, float], ...]) -> Array:
        right = np.array(half, dtype=np.float64)
        both = np.vstack([right, (right * [1.0, -1.0])[::-1]])
        return np.asarray(both * scale + np.array([front - vehicle.length_m, 0.0]))

    sides = [np.array(_BONNET) * [1.0, sign] for sign in (1.0, -1.0)]
    return Outline(
        whole(_BODY),
        (whole(_SCREEN_FOOT + _WINDSCREEN), whole(_REAR_WINDOW)),
        tuple(side * scale + np.array([front - vehicle.length_m, 0.0]) for side in sides),
    )


def draw_outline(
    drawing: Drawing,
    pixels: Outline,
    colour: str,
    width: float = 1.2,
    dash: str = "solid",
    *,
    fill: str | None = None,
    opacity: float = 1.0,
    details: bool = True,
) -> None:
    """Draw a vehicle whose points are already in pixels.

    Parameters
    ----------
    drawing : Drawing
    pixels : Outline
    colour, width, dash
        Style of its edge.
    fill, opacity
        Style of its body.
    details : bool
        Whether all windows and folds are drawn, or only the marking of the front.
    """
    drawing.shape(pixels.body, colour, width, dash, fill=fill, opacity=opacity)
    for k, window in enumerate(pixels.windows):
        if k == 0 or details:
            drawing.shape(window, colour, 0.6, fill=colour, opacity=0.55 if k == 0 else 0.25)
    if details:
        for fold in pixels.folds:
            drawing.shape(fold, colour, 0.6, closed=False)
