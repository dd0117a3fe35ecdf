"""Geodetic, Earth-centered and local coordinates, and the axes of each.

* A *position* (`place`) is ``(..., 3)``: geodetic latitude and longitude in degrees, north and east
  positive, and height over the ellipsoid in meters.
* *ECEF* is Earth-centered, Earth-fixed, ``(..., 3)`` in meters: x through latitude and longitude
  zero, z through the north pole.
* *Local* coordinates are north, east, down, ``(..., 3)`` in meters, along the axes at an origin,
  which is a position: straight lines, and not along the surface.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown._kernels import earth as kernel
from strapdown.constants import Array
from strapdown.earth import earth_rate, refuse, rows
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import DataError

#: Valid distances of a point in ECEF from the center of the Earth, m. Nearer, more than one normal
#: to the ellipsoid goes through it.
NEAREST, FARTHEST = 5e4, 1e9


def ecef_from_geodetic(place: ArrayLike, *, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Earth-centered coordinates of positions.

    Parameters
    ----------
    place : array_like, (..., 3)
        Latitude and longitude in deg, height in m.
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (..., 3), m
        Right to rounding, 2e-9 m near the surface.

    Raises
    ------
    DataError
        A latitude is beyond 90 deg, a longitude beyond 360 deg, a height outside of -1e6 to
        1e9 m, a value not finite, or the shape is wrong.
    """
    (lat, lon, alt), leading = _columns(place, ("lat_deg", "lon_deg", "alt"), "place")
    return _ecef(lat, lon, alt, ellipsoid).reshape((*leading, 3))


def geodetic_from_ecef(position: ArrayLike, *, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Positions from Earth-centered coordinates.

    Parameters
    ----------
    position : array_like, (..., 3), m
        From 50 km to 1e9 m from the center.
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (..., 3)
        Latitude in deg, [-90, 90]; longitude in deg, [-180, 180], at a pole as the signs of the
        zeros make it; height in m. Right to rounding, 3e-9 m near the surface.

    Raises
    ------
    DataError
        A position is outside of these distances, a value is not finite, or the shape is wrong.

    Notes
    -----
    The closed form of Vermeille, J. Geodesy 76 (2002) 451-454, at every height; that of You (2000)
    has an error of 1 µm at 100 km, 9 mm at 1000 km and 60 m at 30 000 km.
    """
    (x, y, z), leading = _columns(position, ("x", "y", "z"), "position")
    xyz = np.column_stack([x, y, z])
    # Clipped against overflow of the square.
    distance = np.linalg.norm(np.clip(xyz, -FARTHEST, FARTHEST), axis=1)
    refuse(
        (distance < NEAREST) | (distance >= FARTHEST),
        xyz,
        "position",
        "geodesy.not-earth-centered",
        nearest_m=NEAREST,
        farthest_m=FARTHEST,
    )
    out = np.empty((x.size, 3))
    kernel.places_from_ecef(xyz, ellipsoid.parameters(), out)
    out[:, :2] = np.degrees(out[:, :2])
    return out.reshape((*leading, 3))


def ned_from_ecef(position: ArrayLike, origin: ArrayLike, *, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Local coordinates from Earth-centered ones.

    Parameters
    ----------
    position : array_like, (..., 3), m
    origin : array_like, (3,)
        Position of the origin and of the axes.
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (..., 3), m
        North, east, down; right to 3e-9 m near the surface.

    Raises
    ------
    DataError
        As `ecef_from_geodetic`.
    """
    xyz, leading = _columns(position, ("x", "y", "z"), "position")
    lat, lon, alt = _origin(origin)
    (sin_lat, cos_lat), (sin_lon, cos_lon) = _sin_cos(lat), _sin_cos(lon)
    x, y, z = (a - b for a, b in zip(xyz, _ecef(lat, lon, alt, ellipsoid), strict=True))
    outward = cos_lon * x + sin_lon * y
    east = -sin_lon * x + cos_lon * y
    up = cos_lat * outward + sin_lat * z
    north = -sin_lat * outward + cos_lat * z
    return np.stack([north, east, -up], axis=-1).reshape((*leading, 3))


def ecef_from_ned(ned: ArrayLike, origin: ArrayLike, *, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Earth-centered coordinates from local ones.

    Parameters
    ----------
    ned : array_like, (..., 3), m
        North, east, down.
    origin : array_like, (3,)
        Position of the origin and of the axes.
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (..., 3), m

    Raises
    ------
    DataError
        As `ecef_from_geodetic`.
    """
    (north, east, down), leading = _columns(ned, ("north", "east", "down"), "ned")
    lat, lon, alt = _origin(origin)
    (sin_lat, cos_lat), (sin_lon, cos_lon) = _sin_cos(lat), _sin_cos(lon)
    outward = cos_lat * -down - sin_lat * north
    z = sin_lat * -down + cos_lat * north
    x = cos_lon * outward - sin_lon * east
    y = sin_lon * outward + cos_lon * east
    out = _ecef(lat, lon, alt, ellipsoid) + np.stack([x, y, z], axis=-1)
    return np.asarray(out.reshape((*leading, 3)))


def ned_from_geodetic(
    place: ArrayLike, origin: ArrayLike, *, ellipsoid: Ellipsoid = WGS84
) -> Array:
    """Local coordinates of positions.

    Parameters
    ----------
    place : array_like, (..., 3)
        Latitude and longitude in deg, height in m.
    origin : array_like, (3,)
        Position of the origin and of the axes.
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (..., 3), m
        North, east, down.

    Raises
    ------
    DataError
        As `ecef_from_geodetic`.
    """
    return ned_from_ecef(
        ecef_from_geodetic(place, ellipsoid=ellipsoid), origin, ellipsoid=ellipsoid
    )


def geodetic_from_ned(ned: ArrayLike, origin: ArrayLike, *, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Positions from local coordinates.

    Parameters
    ----------
    ned : array_like, (..., 3), m
        North, east, down.
    origin : array_like, (3,)
        Position of the origin and of the axes.
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (..., 3)
        Latitude and longitude in deg, height in m.

    Raises
    ------
    DataError
        As `ecef_from_geodetic` and `geodetic_from_ecef`.
    """
    return geodetic_from_ecef(ecef_from_ned(ned, origin, ellipsoid=ellipsoid), ellipsoid=ellipsoid)


def geodetic_from_utm(
    easting: ArrayLike, northing: ArrayLike, zone: int, *, south: bool = False
) -> Array:
    """Latitude and longitude of coordinates of the Universal Transverse Mercator grid, on WGS 84.

    Parameters
    ----------
    easting, northing : array_like, (n,), m
        With the false easting of 500 km, and in the south the false northing of 10,000 km.
    zone : int
        1 to 60; its central meridian is at ``6 zone - 183`` deg.
    south : bool
        Whether the northings are of the southern hemisphere.

    Returns
    -------
    ndarray, (n, 2)
        Latitude and longitude in deg.

    Notes
    -----
    The inverse series of Krüger to the sixth order of the third flattening (Karney 2011,
    *Transverse Mercator with an accuracy of a few nanometers*, Eqs. (19) to (21) and (36)). Its
    error is below 5 nm within 3,900 km of the central meridian.
    """
    n = WGS84.flattening / (2.0 - WGS84.flattening)
    radius = WGS84.semi_major_axis / (1.0 + n) * (1.0 + n**2 / 4 + n**4 / 64 + n**6 / 256)
    zero = 1e7 if south else 0.0
    xi = (np.asarray(northing, dtype=np.float64) - zero) / (UTM_SCALE * radius)
    eta = (np.asarray(easting, dtype=np.float64) - 5e5) / (UTM_SCALE * radius)
    a, b = xi.copy(), eta.copy()
    for j, terms in enumerate(_KRUEGER, 1):
        beta = sum(term * n ** (j + k) for k, term in enumerate(terms))
        a -= beta * np.sin(2 * j * xi) * np.cosh(2 * j * eta)
        b -= beta * np.cos(2 * j * xi) * np.sinh(2 * j * eta)
    lon = np.degrees(np.arctan2(np.sinh(b), np.cos(a))) + 6.0 * zone - 183.0
    conformal = np.sin(a) / np.hypot(np.sinh(b), np.cos(a))
    e2 = WGS84.flattening * (2.0 - WGS84.flattening)
    e = np.sqrt(e2)
    tau = conformal.copy()
    for _ in range(5):  # Newton doubles the digits of the flattening
        sigma = np.sinh(e * np.arctanh(e * tau / np.hypot(1.0, tau)))
        away = tau * np.hypot(1.0, sigma) - sigma * np.hypot(1.0, tau)
        slope = (1.0 + (1.0 - e2) * tau**2) / ((1.0 - e2) * np.hypot(1.0, tau))
        tau += (conformal - away) / np.hypot(1.0, away) * slope
    return np.column_stack([np.degrees(np.arctan(tau)), (lon + 180.0) % 360.0 - 180.0])


#: Scale on the central meridian of a zone.
UTM_SCALE = 0.9996
#: Coefficients of the inverse series, from the power of the third flattening that is the order.
_KRUEGER = (
    (1 / 2, -2 / 3, 37 / 96, -1 / 360, -81 / 512, 96199 / 604800),
    (1 / 48, 1 / 15, -437 / 1440, 46 / 105, -1118711 / 3870720),
    (17 / 480, -37 / 840, -209 / 4480, 5569 / 90720),
    (4397 / 161280, -11 / 504, -830251 / 7257600),
    (4583 / 161280, -108847 / 3991680),
    (20648693 / 638668800,),
)


def place_difference(
    place: ArrayLike, reference: ArrayLike, *, ellipsoid: Ellipsoid = WGS84
) -> Array:
    """Displacement of positions from others, in meters north, east and down.

    The straight line from `reference` to `place`, along the axes halfway between the two. So it
    changes its sign when they are exchanged, its length is the distance, two positions of equal
    height have a zero down component, and the date line and the poles need no special case.

    Parameters
    ----------
    place, reference : array_like, (..., 3)
        Latitude and longitude in deg, height in m. Leading shapes are broadcast.
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (..., 3), m
        North, east, down; right to 4e-9 m near the surface. Over 100 km, a straight line is 1 m
        shorter than the way over the ground.

    Raises
    ------
    DataError
        As `ecef_from_geodetic`; or the positions are on opposite sides of the Earth.
    """
    to = ecef_from_geodetic(place, ellipsoid=ellipsoid)
    start = ecef_from_geodetic(reference, ellipsoid=ellipsoid)
    try:
        leading = np.broadcast_shapes(to.shape, start.shape)
    except ValueError:
        raise DataError(
            "geodesy.shapes-do-not-go-together-2",
            quantity="place, reference",
            shape=to.shape,
            shape_2=start.shape,
        ) from None
    line = np.broadcast_to(to - start, leading)
    halfway = geodetic_from_ecef(0.5 * (to + start), ellipsoid=ellipsoid)
    return rotation.rotate(q_ne(halfway[..., 0], halfway[..., 1]), line)


def ways_between(place: ArrayLike) -> Array:
    """Horizontal distance from each position to the next, (n - 1,), m; `place` as above, (n, 3)."""
    at = np.asarray(place, dtype=np.float64)
    return np.asarray(np.linalg.norm(place_difference(at[1:], at[:-1])[:, :2], axis=1))


def q_ne(lat_deg: ArrayLike, lon_deg: ArrayLike) -> Array:
    """Quaternion from ECEF to north-east-down axes: ``v_n = rotate(q_ne, v_e)``.

    Parameters
    ----------
    lat_deg, lon_deg : array_like, (...), deg
        Geodetic. At a pole north points along the meridian of the longitude, as it does close to
        it.

    Returns
    -------
    ndarray, (..., 4)
        Hamilton, scalar first.

    Raises
    ------
    DataError
        A latitude is beyond 90 deg, a longitude beyond 360 deg, or a value not finite.
    """
    (lat, lon), leading = rows(lat_deg=lat_deg, lon_deg=lon_deg)
    out = np.empty((lat.size, 4))
    kernel.quats_ned_from_ecef(np.radians(lat), np.radians(lon), out)
    return out.reshape((*leading, 4))


def C_ne(lat_deg: ArrayLike, lon_deg: ArrayLike) -> Array:  # noqa: N802
    """Direction cosine matrix from ECEF to north-east-down axes: ``v_n = C_ne @ v_e``.

    Parameters
    ----------
    lat_deg, lon_deg : array_like, (...), deg
        As in `q_ne`.

    Returns
    -------
    ndarray, (..., 3, 3)
        Rows are the directions of north, east and down in ECEF.

    Raises
    ------
    DataError
        As `q_ne`.
    """
    return rotation.dcm_from_quaternion(q_ne(lat_deg, lon_deg))


def _columns(
    values: ArrayLike, names: tuple[str, str, str], name: str
) -> tuple[list[Array], tuple[int, ...]]:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise DataError("geodesy.shape-does-not-end", quantity=name, shape=array.shape, names=names)
    return rows(**dict(zip(names, np.moveaxis(array, -1, 0), strict=True)))


def _origin(origin: ArrayLike) -> list[float]:
    columns, leading = _columns(origin, ("lat_deg", "lon_deg", "alt"), "origin")
    if leading:
        raise DataError("geodesy.shape-more-than-place", quantity="origin", leading=(*leading, 3))
    return [float(column[0]) for column in columns]


def _sin_cos(angle_deg: Any) -> tuple[Any, Any]:
    return np.sin(np.radians(angle_deg)), np.cos(np.radians(angle_deg))


def _ecef(lat_deg: Any, lon_deg: Any, alt: Any, ellipsoid: Ellipsoid) -> Array:
    """Earth-centered coordinates, (..., 3), by the radius of the prime vertical."""
    a, b = ellipsoid.semi_major_axis, ellipsoid.semi_minor_axis
    (sin_lat, cos_lat), (sin_lon, cos_lon) = _sin_cos(lat_deg), _sin_cos(lon_deg)
    normal = a**2 / np.hypot(a * cos_lat, b * sin_lat)
    x = (normal + alt) * cos_lat * cos_lon
    y = (normal + alt) * cos_lat * sin_lon
    return np.stack([x, y, (normal * (b / a) ** 2 + alt) * sin_lat], axis=-1)


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
