"""The Earth: radii of curvature, gravity, the rates of the local level, and the magnetic field.

Latitudes are geodetic and in degrees, heights in meters over the ellipsoid, vectors north, east,
down. Every argument may be a number or an array; they are broadcast against each other. The
formulas are those of the compiled kernels, which mechanizations run.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown._kernels import earth as kernel
from strapdown.constants import Array
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import DataError

# Deeper, normals to the ellipsoid intersect; beyond the upper limit a number is not a height.
_DEEPEST, _HIGHEST = -1e6, 1e9  # m
# Limit of the continuation of gravity with height.
_HIGHEST_GRAVITY = 1e6  # m
#: Years of the World Magnetic Models, and the one that is taken where no date is known.
FIRST_YEAR, LAST_YEAR, THIS_YEAR = 2010.0, 2029.99, 2025.0
# Range of the model in height, m.
_LOWEST_FIELD, _HIGHEST_FIELD = -1e3, 850e3
# Uncertainty of its declination: deg, and deg times uT of the horizontal field.
_DECLINATION_SD = 0.26, 5.417


def radii_of_curvature(lat_deg: ArrayLike, *, ellipsoid: Ellipsoid = WGS84) -> tuple[Array, Array]:
    """Radii of curvature of the ellipsoid: of the meridian, and of the prime vertical.

    Parameters
    ----------
    lat_deg : array_like, (...), deg
        Geodetic latitude.
    ellipsoid : Ellipsoid

    Returns
    -------
    meridian, prime_vertical : ndarray, (...), m
        On the surface; at a height, add it to both.

    Raises
    ------
    DataError
        A latitude is beyond 90 deg or not finite.

    Notes
    -----
    ``M = a (1 - e²)/W³`` and ``N = a/W`` with ``W² = 1 - e² sin²``. The one radius of Chernodarov
    (2009), Eq. (7), ``a (1 - e² sin²/2)``, is the distance from the center and not a radius of
    curvature.
    """
    (lat,), leading = rows(lat_deg=lat_deg)
    out = np.empty((lat.size, 2))
    kernel.all_radii(np.radians(lat), ellipsoid.parameters(), out)
    return out[:, 0].reshape(leading), out[:, 1].reshape(leading)


def gravity(lat_deg: ArrayLike, alt: ArrayLike, *, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Normal gravity: attraction and centrifugal acceleration of the turning ellipsoid.

    Parameters
    ----------
    lat_deg : array_like, (...), deg
        Geodetic latitude.
    alt : array_like, (...), m
        Height over the ellipsoid, within 1000 km.
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (..., 3), m/s²
        North, east, down. East is zero. North is zero on the surface and about
        ``-8e-9 alt sin(2 lat)`` above it.

    Raises
    ------
    DataError
        A latitude is beyond 90 deg, a height beyond 1000 km, or a value not finite.

    Notes
    -----
    Somigliana's formula, continued by a rational function of the height whose first power is
    exact (Bruns) and whose second and third are exact to the first order of the flattening; the
    kernel has the derivation. Largest error against the closed normal field (Heiskanen and
    Moritz 1967, sec. 2-7) over all latitudes, WGS 84, m/s²:

    ============== ======= ======= ======= ======= ======= ======= =======
    height, km        0      10      20      50      100     400    1000
    ============== ======= ======= ======= ======= ======= ======= =======
    down           1e-10   3e-9    1e-8    7e-8    3e-7    5e-6    4e-5
    north          1e-17   2e-9    5e-9    3e-8    2e-7    3e-6    4e-5
    ============== ======= ======= ======= ======= ======= ======= =======

    The usual second order of the height (their Eq. (2-124)) has an error of 1.5e-4 at 100 km and
    1.4e-6 at 20 km. The real field differs from the normal one by some 1e-4 to 1e-3 m/s². Below the
    ellipsoid this is the same field continued inward, without the mass above.
    """
    (lat, height), leading = rows(lat_deg=lat_deg, alt=alt)
    beyond = np.abs(height) > _HIGHEST_GRAVITY
    refuse(beyond, height, "alt", "geodesy.height-beyond-gravity")
    return _vectors(kernel.gravities, leading, np.radians(lat), height, ellipsoid.parameters())


def centrifugal(lat_deg: ArrayLike, alt: ArrayLike, *, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Centrifugal acceleration of a position that rotates with the Earth.

    Parameters
    ----------
    lat_deg : array_like, (...), deg
        Geodetic latitude.
    alt : array_like, (...), m
        Height over the ellipsoid.
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (..., 3), m/s²
        North, east, down: away from the axis, which is south and up in the northern hemisphere.

    Raises
    ------
    DataError
        A latitude is beyond 90 deg, a height outside of -1e6 to 1e9 m, or a value not finite.
    """
    (lat, height), leading = rows(lat_deg=lat_deg, alt=alt)
    return _vectors(kernel.centrifugals, leading, np.radians(lat), height, ellipsoid.parameters())


def gravitation(lat_deg: ArrayLike, alt: ArrayLike, *, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Attraction of the ellipsoid alone: `gravity` without the centrifugal acceleration.

    Called g in Chernodarov (2009), Eq. (4). It is not along the vertical: at 55 deg it leans
    0.016 m/s², or 5.6 minutes of arc, to the north.

    Parameters
    ----------
    lat_deg : array_like, (...), deg
        Geodetic latitude.
    alt : array_like, (...), m
        Height over the ellipsoid, within 1000 km.
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (..., 3), m/s²
        North, east, down; errors as those of `gravity`.

    Raises
    ------
    DataError
        As `gravity`.
    """
    whole = gravity(lat_deg, alt, ellipsoid=ellipsoid)
    return whole - centrifugal(lat_deg, alt, ellipsoid=ellipsoid)


def earth_rate(lat_deg: ArrayLike, *, ellipsoid: Ellipsoid = WGS84) -> Array:
    """Rate of the Earth relative to inertial space, in axes of the local level.

    Parameters
    ----------
    lat_deg : array_like, (...), deg
        Geodetic latitude.
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (..., 3), rad/s
        North, east, down: ``rate (cos lat, 0, -sin lat)``, Tadic and Vukajlovic (2016), Eq. (7).

    Raises
    ------
    DataError
        A latitude is beyond 90 deg or not finite.
    """
    (lat,), leading = rows(lat_deg=lat_deg)
    return _vectors(kernel.earth_rates, leading, np.radians(lat), ellipsoid.parameters())


def transport_rate(
    lat_deg: ArrayLike, alt: ArrayLike, v_n: ArrayLike, *, ellipsoid: Ellipsoid = WGS84
) -> Array:
    """Rate of north-east-down relative to the Earth by motion over the ellipsoid.

    Parameters
    ----------
    lat_deg : array_like, (...), deg
        Geodetic latitude, short of the poles, where north has no direction.
    alt : array_like, (...), m
        Height over the ellipsoid.
    v_n : array_like, (..., 3), m/s
        Velocity relative to the Earth: north, east, down.
    ellipsoid : Ellipsoid

    Returns
    -------
    ndarray, (..., 3), rad/s
        North, east, down. Down grows as the tangent of the latitude.

    Raises
    ------
    DataError
        A latitude is 90 deg or more, a height outside of -1e6 to 1e9 m, a value not finite, or
        `v_n` has no three components.

    Notes
    -----
    Tadic and Vukajlovic (2016), Eq. (8), whose third component must read
    ``-V_E tan(lat)/(R_P + h)``; it is printed without the minus.
    """
    velocity = np.asarray(v_n, dtype=np.float64)
    if velocity.ndim == 0 or velocity.shape[-1] != 3:
        raise DataError("geodesy.shape", quantity="v_n", shape=velocity.shape)
    north, east, down = np.moveaxis(velocity, -1, 0)
    (lat, height, north, east, _), leading = rows(
        lat_deg=lat_deg, alt=alt, v_n_north=north, v_n_east=east, v_n_down=down
    )
    refuse(np.abs(lat) >= 90.0, lat, "lat_deg", "geodesy.no-direction-at-pole")
    velocities = np.column_stack([north, east])
    return _vectors(
        kernel.transport_rates, leading, np.radians(lat), height, velocities, ellipsoid.parameters()
    )


@dataclass(frozen=True)
class MagneticField:
    """The Earth's magnetic field at a position and date.

    Attributes
    ----------
    field_ned : tuple of float, (3,), uT
        North, east, down.
    declination : float, deg
        Of magnetic north from true north, east positive.
    declination_sd : float, deg
        One standard deviation, by the error model of the World Magnetic Model: rocks and ore of
        the place, which the model does not resolve, included; steel nearby is not.
    inclination : float, deg
        Down from the horizontal.
    strength : float, uT
    year : float
        For which it was computed.
    """

    field_ned: tuple[float, float, float]
    declination: float
    declination_sd: float
    inclination: float
    strength: float
    year: float


def magnetic_field(
    lat_deg: float, lon_deg: float, alt: float = 0.0, year: float | None = None
) -> MagneticField:
    """Magnetic field by the World Magnetic Model, at one position.

    Parameters
    ----------
    lat_deg, lon_deg : float, deg
    alt : float, m
        Height over the ellipsoid, -1 to 850 km.
    year : float, optional
        Decimal year, 2010 to 2030; 2025 if it is not known: declination changes by some tenths of a
        degree a year at most, but near the magnetic poles.

    Returns
    -------
    MagneticField

    Raises
    ------
    DataError
        The position or the year is outside the model.

    Notes
    -----
    Chulliat et al. (2025), The US/UK World Magnetic Model for 2025-2030, NOAA; its coefficients,
    and those of 2010 to 2020, are those of pygeomag. Declination is uncertain by
    ``sqrt(0.26² + (5417 / H)²)`` deg, H in nT.
    """
    from pygeomag import GeoMag

    limits = {"lat": (lat_deg, -90.0, 90.0), "lon": (lon_deg, -360.0, 360.0)}
    limits |= {"alt": (alt, _LOWEST_FIELD, _HIGHEST_FIELD)}
    at = THIS_YEAR if year is None else float(year)
    limits |= {"year": (at, FIRST_YEAR, LAST_YEAR)}
    for name, (value, least, most) in limits.items():
        if not least <= value <= most:
            raise DataError(
                "geodesy.outside-field-model", quantity=name, value=value, least=least, most=most
            )
    model = GeoMag(base_year=at).calculate(lat_deg, lon_deg, 1e-3 * alt, at)
    flat = 1e-3 * float(model.h)
    return MagneticField(
        field_ned=(1e-3 * model.x, 1e-3 * model.y, 1e-3 * model.z),
        declination=float(model.d),
        declination_sd=min(
            math.hypot(_DECLINATION_SD[0], _DECLINATION_SD[1] / max(flat, 1e-6)), 180.0
        ),
        inclination=float(model.i),
        strength=1e-3 * float(model.f),
        year=at,
    )


def rows(**quantities: ArrayLike) -> tuple[list[Array], tuple[int, ...]]:
    """Check numbers by the names of their arguments and broadcast them to contiguous columns.

    Parameters
    ----------
    **quantities : array_like
        Finite numbers; one whose name begins with ``lat`` is a latitude, with ``lon`` a
        longitude, in degrees, and with ``alt`` a height in meters.

    Returns
    -------
    columns : list of ndarray, (n,)
    leading : tuple of int
        The common shape.

    Raises
    ------
    DataError
        Named by row and argument.
    """
    arrays = {}
    for name, values in quantities.items():
        try:
            arrays[name] = np.asarray(values, dtype=np.float64)
        except (TypeError, ValueError):
            raise DataError("geodesy.these-no-numbers", quantity=name) from None
    try:
        leading = np.broadcast_shapes(*(array.shape for array in arrays.values()))
    except ValueError:
        raise DataError(
            "geodesy.shapes-do-not-go-together",
            quantity=", ".join(arrays),
            values=[str(array.shape) for array in arrays.values()],
        ) from None
    columns = []
    for name, array in arrays.items():
        if array.shape != leading:
            array = np.broadcast_to(array, leading)
        column = np.ascontiguousarray(array.reshape(-1))
        refuse(~np.isfinite(column), column, name, "geodesy.not-finite")
        if name.startswith("lat"):
            refuse(np.abs(column) > 90.0, column, name, "geodesy.latitude-beyond-pole")
        elif name.startswith("lon"):
            refuse(np.abs(column) > 360.0, column, name, "geodesy.longitude-beyond-turn")
        elif name.startswith("alt"):
            refuse(
                (column < _DEEPEST) | (column > _HIGHEST),
                column,
                name,
                "geodesy.height-beyond-limits",
            )
        columns.append(column)
    return columns, leading


def refuse(bad: NDArray[np.bool_], values: Array, name: str, code: str, **data: Any) -> None:
    """Raise the error of the first bad row, if any.

    Parameters
    ----------
    bad : ndarray of bool, (n,)
    values : ndarray, (n, ...)
    name, code : str
        Of the quantity, and of the error.
    **data
        Of the error, in addition to the value.

    Raises
    ------
    DataError
        With the value.
    """
    if bad.any():
        row = int(np.argmax(bad))
        raise DataError(code, row=row + 1, quantity=name, value=values[row].tolist(), **data)


def _vectors(loop: Callable[..., Any], leading: tuple[int, ...], *columns: Array) -> Array:
    out = np.empty((columns[0].size, 3))
    loop(*columns, out)
    return out.reshape((*leading, 3))
