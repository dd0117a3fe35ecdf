"""Equations as they are printed: (1), (2), (4), and those under Figs. 8 to 11."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from papers.chernodarov.bench import ELLIPSOID, SITE, Course
from papers.chernodarov.damping import Predicted
from papers.chernodarov.drive import RECEIVER, Driven
from papers.reproduction import (
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Statement,
    amount,
)
from strapdown.earth import centrifugal, earth_rate, gravitation, gravity, radii_of_curvature
from strapdown.estimation import (
    COVARIANCES,
    Chernodarov,
    Huber,
    PaperUpdate,
    RobustUpdate,
    UpdateRule,
)
from strapdown.mechanization import OMEGA_EL

Array = NDArray[np.float64]

#: Of the paper, under Fig. 7.
PRINTED_AXIS, PRINTED_E2 = 6378245.0, 0.0066934
HOUR = 3600.0
# A turn of the wander axes that is rounding, rad/s.
NO_TURN = 1e-15


# --- (1) ---------------------------------------------------------------------------------------


def printed_pi0(rate: Array, mended: bool = False) -> Array:
    """Return the matrix of (1) for rates x, y, z, (4, 4).

    Parameters
    ----------
    rate : ndarray, (3,), rad/s
    mended : bool
        With the sign of the element (1, 4) that makes it skew-symmetric.
    """
    x, y, z = rate
    corner = -z if mended else z
    return np.array([[0.0, y, -x, corner], [-y, 0.0, z, -x], [x, -z, 0.0, -y], [z, x, y, 0.0]])


def quaternion_after(rate: Array, seconds: float, mended: bool) -> Array:
    """Return the quaternion of (1) after a constant rate, from 1, (4,)."""
    from scipy.linalg import expm

    start = np.array([1.0, 0.0, 0.0, 0.0])
    return np.asarray(expm(0.5 * seconds * printed_pi0(rate, mended)) @ start)


def skew_symmetric() -> Statement:
    """Judge (1) by the Earth's rate over an hour."""
    rate = earth_rate(SITE.lat_deg, ellipsoid=ELLIPSOID)
    printed = quaternion_after(rate, HOUR, mended=False)
    right = quaternion_after(rate, HOUR, mended=True)
    norm = float(np.linalg.norm(printed))
    off = 2.0 * math.acos(min(1.0, abs(float(printed @ right)) / norm))
    matrix = printed_pi0(rate / np.linalg.norm(rate))
    return skew_symmetric_from(float(np.abs(matrix + matrix.T).max()), norm, math.degrees(off))


def skew_symmetric_from(residual: float, norm: float, off: float) -> Statement:
    """Judge from Pi + Pi' per unit of rate, and from norm and angle off, deg, after an hour."""
    return Statement(
        "eq1",
        "Eq. (1)",
        "are skew-symmetric matrices the signs of elements of which correspond to the IMU design",
        HOLDS if residual < 1e-12 else DOES_NOT_HOLD,
        "",
        "Elements (1, 4) and (4, 1) of Π₀ are printed alike. With (1, 4) negative it is the usual "
        "matrix of an IMU that is mounted turned by 90° about z. As printed the norm does not "
        "stay, and normalising does not mend the attitude: here, a body that rests, by the "
        "rate of the Earth.",
        (
            Evidence("largest element of Π₀ + Π₀ᵀ, per unit of rate", residual),
            Evidence("norm after an hour at rest", norm),
            Evidence("attitude off after an hour at rest", off, "°"),
        ),
    )


# --- (2) ---------------------------------------------------------------------------------------


def no_turn_about_the_vertical(levels: Array) -> Statement:
    """Judge that the wander axes do not turn about the vertical, from level rows of a drive."""
    turn = levels[:, OMEGA_EL : OMEGA_EL + 3]
    return no_turn_from(
        float(np.abs(turn[:, 2]).max()), float(np.linalg.norm(turn[:, :2], axis=1).max())
    )


def no_turn_from(vertical: float, horizontal: float) -> Statement:
    """Judge from the largest rates of the axes about the vertical and the horizontal, rad/s."""
    return Statement(
        "eq2",
        "Eq. (2)",
        "Moreover, for the wander azimuth frame, ω_ζ = 0.",
        HOLDS if vertical < NO_TURN else DOES_NOT_HOLD,
        "",
        "That is what makes it a wander azimuth; on the simulated drive.",
        (
            Evidence("largest turn about the vertical", vertical, "rad/s"),
            Evidence("largest turn about the horizontal", horizontal, "rad/s"),
        ),
    )


# --- (4) ---------------------------------------------------------------------------------------


def gravitational() -> Statement:
    """Judge what g and R of (4) must be."""
    lat, alt = SITE.lat_deg, SITE.alt
    pull = gravitation(lat, alt, ellipsoid=ELLIPSOID)
    whole = gravity(lat, alt, ellipsoid=ELLIPSOID)
    away = centrifugal(lat, alt, ellipsoid=ELLIPSOID)
    # With R along the vertical, as printed: its length is that of the geocentric radius.
    omega = earth_rate(lat, ellipsoid=ELLIPSOID)
    along = np.array([0.0, 0.0, -(printed_radius(lat) + alt)])
    printed = -np.cross(omega, np.cross(omega, along))
    return gravitational_from(
        float(np.linalg.norm(pull + away - whole)),
        float(pull[0]),
        60.0 * math.degrees(math.atan2(abs(float(pull[0])), float(pull[2]))),
        float(np.linalg.norm(printed - away)),
        float(np.linalg.norm(away[:2])),
    )


def gravitational_from(
    residual: float, north: float, minutes: float, radius: float, twice: float
) -> Statement:
    """Judge from gravitation + centrifugal − normal gravity and what other readings cost, m/s²."""
    if residual > 1e-9:
        verdict, condition = DOES_NOT_HOLD, ""
    else:
        verdict = HOLDS_WHEN
        condition = (
            "g is attraction alone, which is not along the vertical; with normal gravity there, "
            f"the centrifugal term counts twice, as a horizontal bias of {amount(twice, 'm/s²')}"
        )
    return Statement(
        "eq4",
        "Eq. (4)",
        "is the vector of gravitational acceleration",
        verdict,
        condition,
        "Attraction and centrifugal term together must be normal gravity, which is what is used "
        "here. R along the vertical, as printed, is not the way from the axis of an ellipsoid.",
        (
            Evidence("attraction + centrifugal − normal gravity", residual, "m/s²"),
            Evidence("attraction, horizontal part", north, "m/s²"),
            Evidence("its lean", minutes, "′"),
            Evidence("centrifugal term by the printed R, off", radius, "m/s²"),
        ),
    )


# --- under Figs. 8 to 11 -----------------------------------------------------------------------


def north_velocity(driven: Driven, levels: Array, wander_angle: Array, north: Array) -> Statement:
    """Judge V_N as printed.

    Parameters
    ----------
    driven : Driven
        A run with fixes.
    levels : ndarray, (n, 14)
        Its level rows.
    wander_angle : ndarray, (n,), rad
    north : ndarray, (n,), m/s
        True.
    """
    from strapdown.mechanization import V_L

    xi, eta = levels[:, V_L], levels[:, V_L + 1]
    s, c = np.sin(wander_angle), np.cos(wander_angle)
    return north_velocity_from(
        float(np.abs(xi * s - eta * c - north).max()),
        float(np.abs(xi * s + eta * c - north).max()),
        float(np.abs(driven.velocity_error[:, 0]).max()),
    )


def north_velocity_from(printed: float, mended: float, own: float) -> Statement:
    """Judge from the largest errors of the velocity north, m/s."""
    wrong = printed > 2.0 * mended
    return Statement(
        "v-north",
        "Section 4, under Fig. 7",
        "V_N(SINS) = V_ξ sin A - V_η cos A",
        DOES_NOT_HOLD if wrong else HOLDS,
        "",
        "With the velocity east beside it, it is no rotation: its determinant is −cos 2A. It is "
        "V_ξ sin A + V_η cos A. On the simulated drive with fixes; as printed a vehicle "
        "that drives north is taken to drive south.",
        (
            Evidence("largest error north, as printed", printed, "m/s"),
            Evidence("the same with a plus", mended, "m/s"),
            Evidence("that of the navigator", own, "m/s"),
        ),
    )


def longitude(course: Course) -> Statement:
    """Judge the error of longitude as printed, on the hour on the bench."""
    radius = printed_radius(SITE.lat_deg)
    printed = radius * np.hypot(*course.angles.T)
    return longitude_from(
        float(printed[-1]), float(course.circular[-1]), math.cos(math.radians(SITE.lat_deg))
    )


def longitude_from(printed: float, true: float, cosine: float) -> Statement:
    """Judge from Delta S as printed and as a distance, m."""
    return Statement(
        "delta-lambda",
        "Section 4, under Fig. 7",
        "δ_λ = (λ_SINS - λ_GPS)R",
        DOES_NOT_HOLD if abs(printed - true) > 0.01 * true else HOLDS,
        "",
        "A difference of longitudes is shorter by cos φ. Without it ΔS is no distance, but grows "
        "with latitude: errors eastward count "
        f"{amount(1.0 / cosine)} times at the latitude of the test bed.",
        (
            Evidence("ΔS after the hour, as printed", printed, "m"),
            Evidence("the same as a distance", true, "m"),
            Evidence("cos φ", cosine),
        ),
    )


def printed_radius(lat_deg: float) -> float:
    """R of the paper, m."""
    return PRINTED_AXIS * (1.0 - 0.5 * PRINTED_E2 * math.sin(math.radians(lat_deg)) ** 2)


def radius() -> Statement:
    """Judge R as a radius for distances north and east."""
    meridian, transverse = (float(r) for r in radii_of_curvature(SITE.lat_deg, ellipsoid=ELLIPSOID))
    own = printed_radius(SITE.lat_deg)
    e2 = ELLIPSOID.eccentricity_squared
    return radius_from(
        own / meridian - 1.0, own / transverse - 1.0, ELLIPSOID.semi_major_axis, PRINTED_E2 - e2
    )


def radius_from(north: float, east: float, axis: float, e2: float) -> Statement:
    """Judge from the relative errors of distances, and from axis, m, and e² of Krassovsky."""
    worst = max(abs(north), abs(east))
    known = axis == PRINTED_AXIS and abs(e2) < 1e-7
    if worst < 1e-4:
        verdict, condition = HOLDS, ""
    elif known and worst < 0.01:
        verdict = HOLDS_WHEN
        condition = f"{amount(100.0 * worst, '%')} of a distance does not matter"
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "radius",
        "Section 4, under Fig. 7",
        "R = a(1 - 0,5e² sin² φ) ; a = 6378245 m ; e² = 0,0066934",
        verdict,
        condition,
        "Axis and eccentricity are those of Krassovsky (1940). R is the distance from the Earth's "
        "centre; a difference of latitudes wants the radius of the meridian, one of longitudes "
        "that of the prime vertical.",
        (
            Evidence("distances north too long by", 100.0 * north, "%"),
            Evidence("distances east too long by", 100.0 * east, "%"),
            Evidence("e² less that of Krassovsky", e2),
        ),
    )


# ==================================================================================================
# The update (9)-(15) as it is printed: one Newton step, W not deflated, one orthogonalisation
# ==================================================================================================

# Of theory: an innovation of one sigma after an outage.
VARIANCE, INNOVATION = 100.0, 10.0


def printed_columns(P: Array, H: Array, R: Array) -> Array:
    """Return the covariance that (11)-(14) leave as they are printed, (n, n).

    Parameters
    ----------
    P : ndarray, (n, n)
        Before the observations.
    H : ndarray, (l, n)
    R : ndarray, (l,)
        Variances; every observation is believed (psi' = 1).
    """
    d, U = np.linalg.eigh(P)
    W, D = U, np.maximum(d, 0.0)
    for h, r in zip(H, R, strict=True):
        f = h @ W
        V = D * f
        K = W @ V / (f @ V + r)
        W, D = np.column_stack([W, K]), np.append(D, r)
    return np.asarray((W * D) @ W.T)


@dataclass(frozen=True)
class Fixed:
    """Standard deviations of the place, north and east together, m.

    Attributes
    ----------
    before, printed, deflated, exact : float
        Before a fix; after it by (14) as printed, by the deflated form, and by Kalman's formula.
    apart : float
        Largest element by which deflated and exact differ, over the largest of them.
    """

    before: float
    printed: float
    deflated: float
    exact: float
    apart: float


def fix_after_the_hour(predicted: Predicted) -> Fixed:
    """Take a fix of the receiver after the hour without aids."""
    P = predicted.last
    H = np.zeros((2, len(P)))
    H[0, 0] = H[1, 1] = 1.0
    R = np.square(RECEIVER.triad("position_noise")[:2])
    form = COVARIANCES["wd"]()
    state, _, _ = form.update(form.begin(P), np.zeros(len(P)), np.zeros(2), H, R)
    deflated = form.matrix(state)
    exact = P - P @ H.T @ np.linalg.solve(H @ P @ H.T + np.diag(R), H @ P)
    return Fixed(
        _place(P),
        _place(printed_columns(P, H, R)),
        _place(deflated),
        _place(exact),
        float(np.abs(deflated - exact).max() / np.abs(P).max()),
    )


def _place(P: Array) -> float:
    return float(np.sqrt(P[0, 0] + P[1, 1]))


def undeflated(found: Fixed) -> Statement:
    """Judge (14)."""
    return Statement(
        "eq14",
        "Eq. (14)",
        "W_j = [W_0; K_1; …; K_j] D_j = diag(D_0, α_1² ψ'_1, …, α_j² ψ'_j)",
        HOLDS if found.printed < 1.01 * found.exact else DOES_NOT_HOLD,
        "",
        "The columns before must be deflated: W_j = [W_(j−1) − ψ' K f, K], and then W D Wᵀ is "
        "Joseph's form. As printed an observation adds variance and takes none. A fix of the "
        "receiver after the hour without aids; standard deviation of the place.",
        (
            Evidence("before the fix", found.before, "m"),
            Evidence("after it, as printed", found.printed, "m"),
            Evidence("after it, deflated", found.deflated, "m"),
            Evidence("after it, by Kalman's formula", found.exact, "m"),
            Evidence("deflated less Kalman's, relative", found.apart),
        ),
    )


def once(predicted: Predicted) -> Statement:
    """Judge that one orthogonalisation an epoch is enough."""
    P = predicted.last
    n = len(P)
    form = Chernodarov()
    Phi, Q = np.eye(n), np.diag(1e-3 * np.diagonal(P))
    Phi[:3, 3:6] = np.eye(3)
    H = np.zeros((4, n))
    H[np.arange(4), [0, 1, 3, 4]] = 1.0
    R = np.square([3.0, 3.0, 0.1, 0.1])
    z, x = np.array([5.0, -2.0, 0.3, 0.1]), np.zeros(n)
    begun = form.begin(P)
    together = form.matrix(form.epoch(begun, Phi, Q, x, z, H, R)[0])
    state = form.predict(begun, Phi, Q)
    for k in range(4):
        state, x, _ = form.update(state, x, z[k : k + 1], H[k : k + 1], R[k : k + 1])
    apart = np.abs(together - form.matrix(state)) / np.sqrt(
        np.outer(np.diagonal(together), np.diagonal(together))
    )
    return once_from(float(apart.max()))


def once_from(apart: float) -> Statement:
    """Judge from elements of the covariance apart, over the standard deviations."""
    return Statement(
        "eq15",
        "Eq. (15)",
        "to take the orthogonalization procedure (15) out of the basic loop of observation "
        "processing (9) – (14) and to execute it only once",
        HOLDS if apart < 1e-9 else DOES_NOT_HOLD,
        "",
        "A prediction and four observations with one orthogonalisation, and with five; with W "
        "deflated, as (14) is to be read.",
        (Evidence("covariances apart, relative", apart),),
    )


def moved(rule: UpdateRule) -> float:
    """Return how far an innovation of one sigma of the prediction moves the state.

    h P h' is 100, the noise 1.
    """
    step = rule.step(INNOVATION, VARIANCE, 1.0)
    return VARIANCE * step.moved / (step.slope * VARIANCE + step.r)


def one_step() -> tuple[float, float, float]:
    """Return how far the printed step, the minimiser and Kalman's update move a state."""
    kalman = VARIANCE * INNOVATION / (VARIANCE + 1.0)
    return moved(PaperUpdate(Huber())), moved(RobustUpdate(Huber())), kalman
