"""The attitude that lays the specific force of a record on the gravity of its place.

In the axes of the body at the first instant, held still in inertial space, the second integral of
the specific force is ``S(t) = s0 + v0 t + C_bn W(t) + e(t)``, and in those of the local level at
that instant, held still likewise, that of minus gravity is known:
``W(t) = -∫∫ exp([ω t x]) g``. Both are expanded in Legendre polynomials of the time; what is of
degree zero and one is place and velocity, which nobody asks for. The others make Wahba's problem.

A body that rocks and sways stays near its place, so that ``e`` is bounded by its excursion and
does not grow, while ``W`` grows as ``g t²/2``: for the mean force the fit is a weight
``30 t² (T - t)²/T⁵`` that vanishes at both ends with its slope. On white noise of the
accelerometers it costs a fifth of the standard deviation against the plain mean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.inertial_sums import InertialSums, moments
from strapdown.alignment.site import Site
from strapdown.earth import earth_rate

Array = NDArray[np.float64]

__all__ = ["DEGREES", "FIRST_FREE", "InertialFit", "Response", "fit_inertially"]

# Degrees 0 and 1 are nuisance and 2 and 3 hold the attitude; the noise is judged by those above,
# ten periods over the record at the most.
DEGREES = 21
FIRST_FREE = 4
_STEP = 1e-4  # rad of latitude, for a derivative that is a sine


@dataclass(frozen=True, eq=False)
class Response:
    """What an error in a node does to the answer, (m, 5, 3) each.

    The answer is: error of the attitude at the first instant (3, north-east-down, rad), that of
    the latitude (rad) and of the size of gravity (relative). An error is a vector in the body's
    axes at the first instant.

    Attributes
    ----------
    turn : ndarray, (m, 5, 3), per rad
        Of an error of the angle within the node.
    push : ndarray, (m, 5, 3), per m/s
        Of an error of the velocity gained within the node.
    place : ndarray, (m, 5, 3), per m s
        Of an error of the second integral, times the length of the node.
    """

    turn: Array
    push: Array
    place: Array


@dataclass(frozen=True, eq=False)
class InertialFit:
    """The attitude at the first instant, and what is left over.

    Attributes
    ----------
    C_nb : ndarray, (3, 3)
        Body to local level at the first instant.
    measured, known : ndarray, (DEGREES, 3), m
        Coefficients of S in north-east-down by that attitude, and of W.
    latitude_change : float, rad
        Measured latitude less the site's: from the Earth's rate across the vertical.
    gravity_change : float
        Measured gravity less the site's, relative.
    response : Response
    """

    C_nb: Array
    measured: Array
    known: Array
    latitude_change: float
    gravity_change: float
    response: Response

    @property
    def residual(self) -> Array:
        """Measured less known, (DEGREES, 3), m; degrees 0 and 1 mean nothing."""
        return self.measured - self.known


def turning_gravity(stamps: Array, rate: float) -> Array:
    """Second integrals of 1, sin(w t)/w and (1 - cos(w t))/w²; (n, 3).

    Minus gravity of an Earth that turns by the vector w is
    ``-(g + sin(w t)/w (w x g) + (1 - cos(w t))/w² w x (w x g))``.
    """
    t = stamps
    plain = 0.5 * t * t
    once = (t - np.sin(rate * t) / rate) / rate**2
    twice = (plain - 2.0 * np.square(np.sin(0.5 * rate * t) / rate)) / rate**2
    return np.column_stack([plain, once, twice])


def fallen_gravity(basis: Array, gravity: Array, rate: Array) -> Array:
    """W, second integral of minus gravity, from (..., 3) of `turning_gravity`; (..., 3), m."""
    across = np.cross(rate, gravity)
    return np.asarray(-basis @ np.vstack([gravity, across, np.cross(rate, across)]))


def _wahba(measured: Array, known: Array, weights: Array) -> Array:
    """C with the least sum of weighted squares of ``C measured - known`` (Markley 1988)."""
    product = (known * weights[:, None]).T @ measured
    u, _, vt = np.linalg.svd(product)
    sign = np.linalg.det(u) * np.linalg.det(vt)
    return np.asarray(u @ np.diag([1.0, 1.0, sign]) @ vt)


def fit_inertially(sums: InertialSums, site: Site) -> InertialFit:
    """Fit the attitude.

    Parameters
    ----------
    sums : InertialSums
    site : Site

    Returns
    -------
    InertialFit

    Notes
    -----
    Wahba's problem by the singular value decomposition (Markley, J. Astronaut. Sci. 36 (1988)
    245): north, east and down are told by ``g`` and by ``ω x g``, which the second and third
    powers of the time carry.
    """
    gravity, rate = site.gravity, site.earth_rate
    basis = turning_gravity(sums.stamps, float(np.sqrt(rate @ rate)))
    both = moments(sums.stamps, np.hstack([sums.fallen, basis]), DEGREES)
    measured_b, basis = both[:, :3], both[:, 3:]
    known = fallen_gravity(basis, gravity, rate)
    weights: Array = np.asarray(2.0 / (2.0 * np.arange(DEGREES) + 1.0), dtype=np.float64)
    weights[:2] = 0.0
    C_nb = _wahba(measured_b, known, weights)
    measured = measured_b @ C_nb.T

    lat = np.degrees(_STEP)
    ahead, behind = (_rate_at(site, site.lat_deg + side * lat) for side in (1.0, -1.0))
    by_latitude = (
        fallen_gravity(basis, gravity, ahead) - fallen_gravity(basis, gravity, behind)
    ) / (2.0 * _STEP)
    cross = np.array([rotation.cross_matrix(x) for x in known])
    design = np.concatenate([-cross, by_latitude[:, :, None], known[:, :, None]], axis=2)
    normal = np.einsum("d,dik,dil->kl", weights, design, design)
    # The estimate turns so as to undo an error: C d + phi x W = 0. Latitude and gravity tell it.
    gain3 = -np.linalg.solve(normal[:3, :3], _rows(design[:, :, :3], weights))
    gain5 = _solve(normal, _rows(design, weights))
    gain = np.concatenate([gain3, gain5[3:]]).reshape(5, DEGREES, 3)
    change = np.einsum("kdi,di->k", gain[3:], measured - known)
    return InertialFit(
        C_nb,
        measured,
        known,
        float(change[0]),
        float(change[1]),
        _response(sums, gain, C_nb),
    )


def _rate_at(site: Site, lat_deg: float) -> Array:
    """Rate of the Earth in the local level, continued beyond the poles."""
    at_equator = earth_rate(0.0, ellipsoid=site.ellipsoid)
    size = float(np.sqrt(at_equator @ at_equator))
    lat = np.radians(lat_deg)
    return size * np.array([np.cos(lat), 0.0, -np.sin(lat)])


def _rows(design: Array, weights: Array) -> Array:
    return np.asarray(np.einsum("d,dik->kdi", weights, design).reshape(design.shape[2], -1))


def _solve(normal: Array, rows: Array) -> Array:
    """Solve where a direction may be unseen, as the latitude at the equator: it gets nothing."""
    scale = np.sqrt(np.diagonal(normal))
    scale = np.where(scale > 0.0, scale, 1.0)
    inner = np.linalg.pinv(normal / np.outer(scale, scale), rcond=1e-12)
    return np.asarray((inner @ (rows / scale[:, None])) / scale[:, None])


def functionals(sums: InertialSums) -> tuple[Array, Array]:
    """Coefficients per second integral times time in a node, and per velocity gained in it.

    Parameters
    ----------
    sums : InertialSums

    Returns
    -------
    place, push : ndarray, (DEGREES, m)
        Exact for what is constant within a node: by integrals of the polynomials from the end.
    """
    from numpy.polynomial import legendre

    ends = np.concatenate([[0.0], np.cumsum(sums.node_length)])
    u = 2.0 * ends / ends[-1] - 1.0
    place, push = (np.empty((DEGREES, len(u) - 1)) for _ in range(2))
    for d in range(DEGREES):
        once = legendre.legint(np.eye(d + 1)[d], lbnd=1)
        # The second is the integral of P_d(s) (s - u) from u to the end.
        thrice = legendre.legint(once, m=2, lbnd=1)
        for out, whole in ((place, once), (push, thrice)):
            out[d] = (2 * d + 1) / sums.length * np.diff(legendre.legval(u, whole)) / np.diff(u)
    return place, push * (0.5 * sums.length) ** 2


def _response(sums: InertialSums, gain: Array, C_nb: Array) -> Response:
    place, push = functionals(sums)
    # Errors come in the body's first axes; the gain wants north, east, down.
    gain_b = gain @ C_nb
    of_place = np.einsum("kdi,dm->mki", gain_b, place)
    of_push = np.einsum("kdi,dm->mki", gain_b, push)
    # An angle error d turns what comes after it: d x dv = -[dv x] d; half of its own node.
    crosses = np.array([rotation.cross_matrix(v) for v in sums.node_velocity])
    turned = -of_push @ crosses
    after = np.cumsum(turned[::-1], axis=0)[::-1]
    return Response(after - 0.5 * turned, of_push, of_place)
