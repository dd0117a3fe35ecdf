"""Position of a vehicle from a velocity known at every instant, integrated to rounding."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.ellipsoids import Ellipsoid
from strapdown.errors import ConfigError
from strapdown.simulation.earth_motion import MOST_NORTHERN, Origin
from strapdown.simulation.rate_integral import RateIntegral, integrate_rate

Array = NDArray[np.float64]

# `integrate_rate` converges to 1e-14 of its input: with these factors to 1e-17 rad, which is 6e-11
# m on the ground, and to 8e-11 m in height. Scaling by powers of two is free of rounding.
_SCALE = np.array([2.0**10, 2.0**10, 2.0**-13])
# Latitude affects its own rate only through the meridian radius, 1 % per radian at most: each
# iteration reduces the error by a factor of a hundred or more.
_ROUNDS = 16


@dataclass(frozen=True)
class PlaceIntegral:
    """Change of latitude, longitude (rad) and height (m) since time zero."""

    scaled: RateIntegral

    def __call__(self, time: ArrayLike) -> Array:
        """Latitude and longitude in rad and height in m relative to the origin, (n, 3)."""
        return np.asarray(self.scaled(time) / _SCALE)


def integrate_velocity(
    velocity: Callable[[Array], Array],
    breaks: Sequence[float],
    origin: Origin,
    ellipsoid: Ellipsoid,
) -> PlaceIntegral:
    """Integrate a piecewise smooth velocity over the ellipsoid.

    `velocity`: (n,) instants in s to (n, 3) m/s: north, east, down. `breaks` (s): instants where it
    or a derivative may jump; the first is zero, the last the end. Returns within 1e-10 m per panel,
    plus rounding. ConfigError: the vehicle comes within 1 deg of a pole.

    ``lat' = v_N/(R_M(lat) + h)``, ``lon' = v_E/((R_N(lat) + h) cos lat)``, ``h' = -v_D``, by Picard
    iteration: each iteration integrates the rates at the previous positions, as Legendre series
    over panels, until the change is within rounding.
    """
    from strapdown._kernels.earth import place_rates

    parameters = ellipsoid.parameters()
    place: PlaceIntegral | None = None
    ends = np.asarray(breaks, dtype=np.float64)

    def rates(time: ArrayLike) -> Array:
        t = np.asarray(time, dtype=np.float64)
        moved = np.zeros((t.size, 3)) if place is None else place(t)
        at, out = origin.place(moved), np.empty((t.size, 3))
        _refuse_pole(at)
        place_rates(at, velocity(t), parameters, out)
        return np.asarray(out * _SCALE)

    before = np.zeros((ends.size, 3))
    for _ in range(_ROUNDS):
        place = PlaceIntegral(integrate_rate(rates, breaks))
        now = place(ends)
        # A hundredth of the double-precision resolution of a latitude.
        if np.all(np.abs(now - before) <= [1e-18, 1e-18, 1e-11] + 1e-16 * np.abs(now)):
            break
        before = now
    assert place is not None
    return place


def _refuse_pole(place: Array) -> None:
    highest = float(np.degrees(np.abs(place[:, 0]).max(initial=0.0)))
    if not highest <= MOST_NORTHERN:
        raise ConfigError(
            "simulation.vehicle-comes-latitude",
            quantity="latitude",
            highest=highest,
            most_northern=MOST_NORTHERN,
        )
