"""Position and velocity of a GNSS antenna on a moving body."""

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
    """Position and velocity of a point fixed to a body.

    `place` ((n, 3)): position of the body: latitude and longitude in deg, height in m. `v_n` ((n,
    3), m/s): velocity relative to the Earth, north, east, down. `q_nb` ((n, 4)). `rate` ((n, 3),
    rad/s): angular rate relative to inertial space, in body axes, as measured by gyros. `arm`
    ((3,), m): lever arm from the body's reference point to the other point, in body axes. Returns
    `place` ((n, 3)): position of the end of the straight lever arm, as the argument; `v_n` ((n, 3),
    m/s): ``v + C_nb (w_eb x r)``, along local-level axes at the body's own position; those at the
    point are rotated by arm over Earth radius, 1.6e-7 rad per meter.
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
