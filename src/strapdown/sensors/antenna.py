"""Where a satellite antenna is, and how it moves, on a body that moves and turns."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.earth import earth_rate
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.frames import ecef_from_geodetic, geodetic_from_ecef, q_ne

Array = NDArray[np.float64]


def antenna_motion(
    place: ArrayLike,
    v_n: ArrayLike,
    q_nb: ArrayLike,
    rate: ArrayLike,
    arm: ArrayLike,
    *,
    ellipsoid: Ellipsoid = WGS84,
) -> tuple[Array, Array]:
    """Place and velocity of a point that is fixed to a body.

    Parameters
    ----------
    place : array_like, (n, 3)
        Of the body: latitude and longitude in deg, height in m.
    v_n : array_like, (n, 3), m/s
        Relative to the Earth, north, east, down.
    q_nb : array_like, (n, 4)
    rate : array_like, (n, 3), rad/s
        Of the body relative to inertial space, in body axes, as gyros read it.
    arm : array_like, (3,), m
        From the body's own point to the other, in body axes.
    ellipsoid : Ellipsoid

    Returns
    -------
    place : ndarray, (n, 3)
        As the argument; at the end of the straight arm.
    v_n : ndarray, (n, 3), m/s
        ``v + C_nb (w_eb x r)``, along the axes of the body's own place; those of the point are
        turned by arm over radius, 1.6e-7 rad a metre.
    """
    p, v = np.asarray(place, dtype=np.float64), np.asarray(v_n, dtype=np.float64)
    q, r = np.asarray(q_nb, dtype=np.float64), np.asarray(arm, dtype=np.float64)
    if not r.any():
        return p.copy(), v.copy()
    to_level = q_ne(p[:, 0], p[:, 1])
    earth = rotation.rotate(rotation.conjugate(q), earth_rate(p[:, 0], ellipsoid=ellipsoid))
    moved = rotation.rotate(rotation.conjugate(to_level), rotation.rotate(q, r))
    at = geodetic_from_ecef(ecef_from_geodetic(p, ellipsoid=ellipsoid) + moved, ellipsoid=ellipsoid)
    return at, v + rotation.rotate(q, np.cross(np.asarray(rate) - earth, r))
