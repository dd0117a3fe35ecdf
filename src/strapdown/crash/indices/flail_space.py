"""Occupant impact velocity and ridedown acceleration: the flail-space model."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.indices.pulse import (
    checked,
    cubic,
    first_reach,
    from_start,
    integrals,
    largest_mean,
)
from strapdown.errors import ConfigError, DataError, Finding

__all__ = ["FlailSpace", "flail_space"]

FORWARD, SIDEWAYS = 0.6, 0.3  # m
WINDOW = 0.01  # s


@dataclass(frozen=True)
class FlailSpace:
    """Occupant risk by the flail-space model.

    Attributes
    ----------
    oiv_x, oiv_y : float, m/s
        Occupant impact velocity: of the occupant relative to the vehicle, forward and
        right.
    at : float, s, or None
        Of the occupant's impact, on the record's clock; None without an impact, and the
        velocities are then the greatest changes of the vehicle's velocity.
    ora_x_g, ora_y_g : float or None
        Ridedown acceleration of the vehicle: the 10 ms mean of greatest magnitude after the
        impact, in g, signed.
    findings : tuple of Finding
    """

    oiv_x: float
    oiv_y: float
    at: float | None
    ora_x_g: float | None
    ora_y_g: float | None
    findings: tuple[Finding, ...] = ()


def flail_space(
    time: ArrayLike,
    accel: ArrayLike,
    *,
    start: float = 0.0,
    forward: float = FORWARD,
    sideways: float = SIDEWAYS,
) -> FlailSpace:
    """Occupant impact velocity, and the subsequent ridedown acceleration.

    Parameters
    ----------
    time : array_like, (n,), s
    accel : array_like, (n, 2) or (n, 3), m/s²
        Of the vehicle near its center of gravity, forward and right, without gravity, of
        class CFC 180.
    start : float, s
        First contact.
    forward, sideways : float, m
        Flail space; the same to the rear and to the left.

    Returns
    -------
    FlailSpace

    Raises
    ------
    DataError
        As `pulse.checked`; `start` is not in the record.
    ConfigError
        A distance is not valid.

    Notes
    -----
    Each axis separately, rotation of the vehicle neglected: the occupant moves by ``-∬ a``
    relative to the vehicle and hits it at 0.6 m along or 0.3 m across, whichever is first; the
    velocities are ``-∫ a`` then. Where neither is reached, they are the vehicle's changes of
    velocity (Michie 1981, Transportation Research Record 796; NCHRP Report 350, 1993, and MASH
    2009, occupant risk). Exact for acceleration that is linear between samples.
    """
    for name, distance in (("forward", forward), ("sideways", sideways)):
        if not (math.isfinite(distance) and distance > 0.0):
            raise ConfigError("crash.no-space", quantity=name, distance=distance)
    plane = np.asarray(accel, dtype=np.float64)
    t, a = checked(time, plane[:, :2] if plane.ndim == 2 else plane, 2, "accel")
    t, a = from_start(t, a, start, "start")
    velocity, way = integrals(t, -a)
    met = [
        at
        for axis, distance in ((0, forward), (1, sideways))
        for sign in (1.0, -1.0)
        if (at := first_reach(t, sign * way[:, axis], sign * velocity[:, axis], distance))
        is not None
    ]
    if not met:
        x, y = (float(v[np.argmax(np.abs(v))]) for v in velocity.T)
        found = Finding(
            "crash.occupant-moves-less-than-along",
            quantity="OIV",
            forward=forward,
            sideways=sideways,
            t=t[-1],
        )
        return FlailSpace(x, y, None, None, None, (found,))
    at = min(met)
    x, y = (cubic(t, way[:, k], velocity[:, k], at)[1] for k in (0, 1))
    try:
        rest, values = from_start(t, a, at, "ORA")
        ora = [largest_mean(rest, values[:, k], WINDOW)[0] / STANDARD_GRAVITY for k in (0, 1)]
    except DataError:
        found = Finding("crash.record-ends-before-ora", quantity="ORA", at=at)
        return FlailSpace(x, y, at, None, None, (found,))
    return FlailSpace(x, y, at, ora[0], ora[1])
