"""The misprints (8) and (19), the missing (16)-(17), and the sign of (20)."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from papers.reproduction import (
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Statement,
    amount,
)
from papers.tadic.experiment import END
from papers.tadic.simplifications import SIMPLIFICATIONS, Trip, error_course
from strapdown import rotation
from strapdown.dsp import running_integral
from strapdown.earth import radii_of_curvature
from strapdown.simulation import CRASHES, CrashMotion, CrashScenario, HaversinePulse, Origin

Array = NDArray[np.float64]

RATE = 200.0  # Hz
FINE = 2000  # steps of the integral of exact forces
LATITUDE = 60.0  # deg, of the flight
SPEED, HEIGHT, HOUR = 230.0, 1e4, 3600.0


# --- (8) ---------------------------------------------------------------------------------------


def transport_as_printed() -> Statement:
    """Judge the third component of (8)."""
    printed = replace(SIMPLIFICATIONS["every term"], as_printed=True)
    pulse = HaversinePulse(0.1, 0.113, (0.0, -7.2, 0.0), (0.0, 0.0, 87.0))
    east = Trip(
        "",
        CrashMotion(END, Origin(45.0, 20.0, 100.0), (0.0, 7.1, 0.0), (pulse,), heading_deg=90.0),
        2000.0,
        "free",
    )
    wrong, right = (error_course(east, m) for m in (printed, SIMPLIFICATIONS["every term"]))
    apart = float((wrong["position_m"] - right["position_m"]).abs().max())
    radius = radii_of_curvature(LATITUDE)[1] + HEIGHT
    turned = math.degrees(2.0 * SPEED * math.tan(math.radians(LATITUDE)) / radius * HOUR)
    return transport_from(apart, float(turned))


def transport_from(crash: float, flight: float) -> Statement:
    """Judge from what the printed sign does in the crash, m, and in an hour's flight, deg."""
    if flight < 1e-3:
        verdict, condition = HOLDS, ""
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "eq8",
        "Eq. (8)",
        "V_E tan φ / (R_p + h)",
        verdict,
        condition,
        "The third component lacks its minus. Eastward, the heading is then turned by twice the "
        "transport rate. In 750 ms of a crash it is nothing, on a flight everything.",
        (
            Evidence("place in 750 ms of the crash, heading east", 1e3 * crash, "mm"),
            Evidence("heading after an hour at 230 m/s, 60° north", flight, "°"),
        ),
    )


# --- (19) --------------------------------------------------------------------------------------


def as_printed(q: Array) -> Array:
    """Matrices of (19) with C23 and C31 as printed, (n, 3, 3), from unit quaternions (n, 4)."""
    C = np.array(rotation.dcm_from_quaternion(q))
    w, x, y, z = np.atleast_2d(q).T
    C = C.reshape(-1, 3, 3)
    C[:, 1, 2], C[:, 2, 0] = 2.0 * (y * z + w * x), 2.0 * (x * z + w * y)
    return np.asarray(C)


def matrix_as_printed(crash: CrashScenario | None = None) -> Statement:
    """Judge (19)."""
    scenario = crash or CRASHES["pole"]
    time = scenario.start + np.linspace(0.0, END, FINE + 1)
    q, force = scenario.motion.attitude(time), scenario.motion.specific_force(time)
    wrong = np.einsum("nij,nj->ni", as_printed(q), force) - rotation.rotate(q, force)
    rolled = np.asarray(rotation.quaternion_from_euler([1.0, 0.0, 0.0]), dtype=np.float64)
    still = np.array([0.0, 0.0, -9.80665])
    aside = as_printed(rolled)[0] @ still - rotation.rotate(rolled, still)
    moved = float(np.linalg.norm(_twice(wrong, time)))
    residual = as_printed(rolled)[0]
    return matrix_from(
        float(np.abs(residual @ residual.T - np.eye(3)).max()),
        0.5 * float(np.linalg.norm(aside)) * END**2,
        moved,
    )


def _twice(values: Array, time: Array) -> Array:
    """Integral of the integral at the end, by trapezoids."""
    return np.asarray(np.trapezoid(running_integral(time, values), time, axis=0))


def matrix_from(residual: float, rolled: float, crash: float) -> Statement:
    """Judge from C C^T - 1, and the place after 750 ms at 1° of roll and in the crash, m."""
    holds = residual < 1e-9
    return Statement(
        "eq19",
        "Eq. (19)",
        "2(q2 q3 + q0 q1), 2(q1 q3 + q0 q2)",
        HOLDS if holds else DOES_NOT_HOLD,
        "",
        "C23 and C31 lack their minus, and the matrix is no rotation. A level car does not notice. "
        "The simulated one puts its nose down by 2° while it is struck; that, and a degree of "
        "roll, cost about a decimetre, so that the paper's result would not betray it.",
        (
            Evidence("C Cᵀ − 1 at 1° of roll, largest element", residual),
            Evidence("place after 750 ms at rest, 1° of roll", rolled, "m"),
            Evidence("place after 750 ms of the crash", crash, "m"),
        ),
    )


# --- (16)-(17) ---------------------------------------------------------------------------------


def increments_missing(crash: CrashScenario | None = None) -> Statement:
    """Judge that (15) follows from (7) and (8), with what is missing between."""
    exact, first = (place_error(kind, crash) for kind in ("exact", "first order"))
    return increments_from(exact, first, growth())


def growth(rate_deg: float = 87.0, seconds: float = 0.537) -> float:
    """By how much (19) grows with increments [1, θ/2] that nobody normalises."""
    theta = math.radians(rate_deg) / RATE
    return float((1.0 + 0.25 * theta * theta) ** round(seconds * RATE) - 1.0)


def place_error(kind: str, crash: CrashScenario | None = None) -> float:
    """Place after 750 ms, forces exact and attitude by increments at 200 Hz, m.

    Parameters
    ----------
    kind : {'exact', 'first order'}
        Of the increments of each turn: [cos ½|θ|, …], or [1, θ/2].
    crash : CrashScenario, optional
    """
    scenario = crash or CRASHES["pole"]
    motion, steps = scenario.motion, round(END * RATE)
    time = scenario.start + np.arange(steps + 1) / RATE
    rate = motion.rate(time)
    turns = 0.5 / RATE * (rate[1:] + rate[:-1])
    q = np.empty((steps + 1, 4))
    q[0] = motion.attitude(time[:1])[0]
    for k, theta in enumerate(turns):
        if kind == "exact":
            step = rotation.quaternion_from_rotation_vector(theta)
        else:
            step = np.array([1.0, *(0.5 * theta)])
        q[k + 1] = rotation.compose(q[k], step) if kind == "exact" else _product(q[k], step)
    force = motion.specific_force(time)
    true = rotation.rotate(motion.attitude(time), force)
    # (19) of a quaternion that is not of unit length is as much longer as its square.
    size = (q * q).sum(axis=1, keepdims=True)
    own = size * rotation.rotate(q / np.sqrt(size), force)
    return float(np.linalg.norm(_twice(own - true, time)))


def _product(a: Array, b: Array) -> Array:
    """Product of two quaternions as (11) has it, of any length."""
    w, v = a[0], a[1:]
    s, u = b[0], b[1:]
    return np.array([w * s - v @ u, *(w * u + s * v + np.cross(v, u))])


def increments_from(exact: float, first: float, longer: float) -> Statement:
    """Judge from the place by exact and first-order increments, m, and by how much (19) grows."""
    if first < 2.0 * exact:
        verdict, condition = HOLDS, ""
    else:
        verdict = HOLDS_WHEN
        condition = (
            "(16) and (17), which are missing, say that the increment of a turn θ is [cos ½|θ|, "
            "(θ/|θ|) sin ½|θ|]; with [1, ½θ] and no normalising the matrix (19) grows by "
            f"{amount(100.0 * longer, '%')}"
        )
    return Statement(
        "eq16-17",
        "Eqs. (15)-(17)",
        "Equation (15) presents quaternion increment calculated from (7) and (8).",
        verdict,
        condition,
        "Equations (16) and (17) are not in the paper. Exact forces of the simulated crash, turned "
        "by an attitude of increments at 200 Hz; for the level the same increment, conjugated, "
        "from the left.",
        (
            Evidence("place after 750 ms, increment of a turn", 1e3 * exact, "mm"),
            Evidence("the same, [1, ½θ] without normalising", 1e3 * first, "mm"),
            Evidence("growth of the matrix, 87°/s for 537 ms", 100.0 * longer, "%"),
        ),
    )


# --- (20) --------------------------------------------------------------------------------------


def small_angles() -> Statement:
    """Judge (20) against the exact rotation."""
    off = {}
    for angle in (1.0, 5.0):
        phi = np.radians(angle) * np.array([1.0, 2.0, 2.0]) / 3.0
        exact = rotation.dcm_from_rotation_vector(phi)
        off[angle] = float(np.abs(exact - (np.eye(3) + _cross(phi))).max())
        if angle == 1.0:
            other = float(np.abs(exact.T - (np.eye(3) + _cross(phi))).max())
    return small_angles_from(off, other)


def _cross(v: Array) -> Array:
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def small_angles_from(off: dict[float, float], other: float) -> Statement:
    """Judge from the largest element off by angle in deg, and with the other meaning of φ at 1°."""
    if off[1.0] > 1e-3:
        verdict, condition = DOES_NOT_HOLD, ""
    elif other > 10.0 * off[1.0]:
        verdict = HOLDS_WHEN
        condition = (
            "φ is the turn that carries the computed axes into the true ones; many texts mean the "
            "opposite one, and have the other sign"
        )
    else:
        verdict, condition = HOLDS, ""
    return Statement(
        "eq20",
        "Eq. (20)",
        "derived under the assumption that the angles φ_N, φ_E, φ_D are small",
        verdict,
        condition,
        "Largest element by which (20), which is 1 + [φ×], differs from the exact rotation. What "
        "is neglected is of the second order: ½φ².",
        (
            *(Evidence(f"off at {a:g}°", v) for a, v in off.items()),
            Evidence("off at 1°, φ meant the other way", other),
        ),
    )
