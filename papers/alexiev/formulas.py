"""The printed formulas: which can be taken as they stand, and which cannot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from papers.alexiev.motions import NONE, algorithm_history, final_error, scenario_motion
from papers.reproduction import (
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Statement,
)
from strapdown import rotation
from strapdown.increments import increments_from_imu
from strapdown.simulation import simulate_imu
from strapdown.tables import QUATERNION, THETA, increments_table

Array = NDArray[np.float64]

# Attitudes on which identities are tried, rad; off every special value.
_GRID = [
    (roll, pitch, heading)
    for roll in (-2.1, -0.4, 0.3, 1.7)
    for pitch in (-1.2, -0.5, 0.2, 1.1)
    for heading in (-2.6, -0.7, 0.9, 2.2)
]
_RATE = np.array([0.3, -0.7, 1.1])  # rad/s
EXACT = 1e-12


def elementary(angle: float, axis: int) -> tuple[Array, Array]:
    """Return (4), (5) or (6) as printed, for axis 0, 1 or 2, and its derivative by the angle."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    matrix, slope = np.eye(3), np.zeros((3, 3))
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = s, -s
    slope[i, i] = slope[j, j] = -s
    slope[i, j], slope[j, i] = c, -c
    return matrix, slope


def product(angles: tuple[float, float, float], transposed: bool) -> tuple[Array, list[Array]]:
    """Return Cz Cy Cx of (4)-(6), each transposed or as printed, and its three derivatives."""
    pairs = [elementary(a, k) for k, a in enumerate(angles)]
    if transposed:
        pairs = [(m.T, d.T) for m, d in pairs]
    (x, dx), (y, dy), (z, dz) = pairs
    return z @ y @ x, [z @ y @ dx, z @ dy @ x, dz @ y @ x]


def euler_rates(angles: tuple[float, float, float], rate: Array) -> Array:
    """Return (8)-(10) as printed."""
    roll, pitch, _ = angles
    wx, wy, wz = rate
    across = np.sin(roll) * wy + np.cos(roll) * wz
    return np.array(
        [
            wx + np.tan(pitch) * across,
            np.cos(roll) * wy - np.sin(roll) * wz,
            across / np.cos(pitch),
        ]
    )


def skew(v: Array) -> Array:
    """Skew-symmetric matrix, as printed below (7)."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def worst_attitude(transposed: bool) -> float:
    """Return the largest element by which (3) misses C_nb of the same angles."""
    return max(
        float(
            np.abs(
                product(angles, transposed)[0] - rotation.dcm_from_euler(np.degrees(angles))
            ).max()
        )
        for angles in _GRID
    )


def worst_kinematics(transposed: bool) -> float:
    """Return the largest element of dC/dt - C Ω× with the rates of (8)-(10), 1/s."""
    worst = 0.0
    for angles in _GRID:
        matrix, slopes = product(angles, transposed)
        rates = euler_rates(angles, _RATE)
        change = sum(
            (slope * rate for slope, rate in zip(slopes, rates, strict=True)), np.zeros((3, 3))
        )
        worst = max(worst, float(np.abs(change - matrix @ skew(_RATE)).max()))
    return worst


def product_as_printed(printed: float, transposed: float, kinematics: float) -> Statement:
    """Judge Eq. (3).

    Parameters
    ----------
    printed, transposed : float
        Largest element by which the product misses C_nb: as printed, and each factor transposed.
    kinematics : float, 1/s
        Residual of (7) with (8)-(10) for the transposed reading.
    """
    return Statement(
        "eq3",
        "Eq. (3)",
        "C_b^n(t) = C_z(t) C_y(t) C_x(t)",
        HOLDS if printed < EXACT else DOES_NOT_HOLD,
        "",
        "(4)-(6) as printed turn the frame and not the vector. From body to navigation axes the "
        "product is C_z^T C_y^T C_x^T, and (8)-(10) fit that reading of (7) and no other.",
        (
            Evidence("largest element off, as printed", printed),
            Evidence("largest element off, each transposed", transposed),
            Evidence("dC/dt − C Ω×, transposed, with (8)-(10)", kinematics, "1/s"),
        ),
    )


def kinematics_as_printed(residual: float) -> Statement:
    """Judge Eqs. (8)-(10) from the residual of (7), 1/s."""
    return Statement(
        "eq8-10",
        "Eqs. (8)-(10)",
        "The differential Eqs. (8)-(10) are the most frequently cited for calculation of Euler "
        "rotations.",
        HOLDS if residual < EXACT else DOES_NOT_HOLD,
        "",
        "As printed they are the 3-2-1 kinematics: with the derivatives of the three factors they "
        "satisfy (7) to rounding at 64 attitudes.",
        (Evidence("largest element of dC/dt − C Ω×", residual, "1/s"),),
    )


def exponential(sigma: float) -> tuple[float, float]:
    """Return the coefficients of (12) exactly as printed."""
    with np.errstate(invalid="ignore", divide="ignore"):
        s = np.float64(sigma)
        return float(np.sin(s) / s), float((1.0 - np.cos(s)) / (s * s))


def coefficient_loss(sigma: float) -> float:
    """Return the relative error of (1 - cos σ)/σ² as printed, against the half angle's form."""
    half = np.sin(0.5 * sigma) / sigma
    return float(abs(exponential(sigma)[1] / (2.0 * half * half) - 1.0))


def exponential_at_zero(at_zero: float, tiny: float, usual: float) -> Statement:
    """Judge (12), and (15)-(17), which divide in the same way.

    Parameters
    ----------
    at_zero : float
        The first coefficient at σ = 0; one, if it can be computed.
    tiny, usual : float
        Relative loss of the second at σ = 1e-8 rad and at 0.01 rad.
    """
    fails = not np.isfinite(at_zero)
    if fails and usual < 1e-6:
        verdict, condition = HOLDS_WHEN, "the body turns; at rest it divides zero by zero"
    else:
        verdict, condition = (HOLDS if not fails and tiny < 1e-6 else DOES_NOT_HOLD), ""
    return Statement(
        "eq12-15-17",
        "Eqs. (12), (15)-(17)",
        "exp(σ×) = I + (sin σ_n / σ_n) σ× + ((1 − cos σ_n) / σ_n²) (σ×)²",
        verdict,
        condition,
        "Right, and not to be programmed as it stands: the error-free gyros of Figs. 2 to 5 are "
        "exactly zero for seconds, and the first such step makes everything after it no number. "
        "Near zero the second coefficient cancels. Series or half angles cure both.",
        (
            Evidence("sin σ / σ at σ = 0", at_zero),
            Evidence("relative loss of (1 − cos σ)/σ² at 1e-8 rad", tiny),
            Evidence("the same at 0.01 rad", usual),
        ),
    )


def increments_as_printed(rate: float = 100.0) -> tuple[float, float]:
    """Run direction cosines on alexiev-fig2c from two readings of σ in (11).

    Returns
    -------
    integrals, angles : float, deg
        Final error with σ the integral of the body rate, and with σ the differences of roll,
        pitch and heading.
    """
    motion = scenario_motion("alexiev-fig2c")
    imu, truth = simulate_imu(motion, NONE, rate=rate, sampling="mean", accelerometer=False)
    steps = increments_from_imu(imu)
    known = truth[QUATERNION].to_numpy()
    euler = np.radians(truth[["roll", "pitch", "heading"]].to_numpy())
    differences = np.diff(np.unwrap(euler, axis=0), axis=0)
    as_angles = increments_table(
        steps.index.to_numpy(dtype=np.float64), steps["dt"].to_numpy(), differences
    )
    assert len(steps[THETA]) == len(differences)
    integrals, angles = (
        float(rotation.rotation_angle(algorithm_history("dcm", table, known[0])[-1], known[-1]))
        for table in (steps, as_angles)
    )
    return integrals, angles


def sigma_as_printed(integrals: float, angles: float) -> Statement:
    """Judge the vector σ of (11), from the final errors in deg of both readings."""
    if angles < 1e-6:
        verdict, condition = HOLDS, ""
    elif integrals < 1e-6:
        verdict = HOLDS_WHEN
        condition = "φ, θ, ψ mean the three integrals of the body rates, and not Euler angles"
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "eq11-sigma",
        "Eq. (11)",
        "σ = [φ_k+1 − φ_k, θ_k+1 − θ_k, ψ_k+1 − ψ_k]",
        verdict,
        condition,
        "The same letters are Euler angles in (1)-(10). On Fig. 2c direction cosines end on the "
        "truth with integrals of the rates, and far from it with differences of Euler angles.",
        (
            Evidence("error with integrals of the rates", integrals, "°"),
            Evidence("error with differences of Euler angles", angles, "°"),
        ),
    )


def poisson_difference() -> float:
    """Return the largest difference between (18) and (19) over a few quaternions and rates."""
    worst = 0.0
    wx, wy, wz = _RATE
    for angles in _GRID:
        q0, q1, q2, q3 = rotation.quaternion_from_euler(np.degrees(angles))
        left = np.array(
            [[q0, -q1, -q2, -q3], [q1, q0, -q3, q2], [q2, q3, q0, -q1], [q3, -q2, q1, q0]]
        ) @ np.array([0.0, wx, wy, wz])
        right = np.array(
            [[0.0, -wx, -wy, -wz], [wx, 0.0, wz, -wy], [wy, -wz, 0.0, wx], [wz, wy, -wx, 0.0]]
        ) @ np.array([q0, q1, q2, q3])
        worst = max(worst, float(np.abs(left - right).max()))
    return worst


def quaternion_equations(apart: float) -> Statement:
    """Judge that (18) and (19) are the same, from their largest difference, 1/s."""
    return Statement(
        "eq18-19",
        "Eqs. (18), (19)",
        "The more useful form of quaternion differential equation is",
        HOLDS if apart < EXACT else DOES_NOT_HOLD,
        "",
        "The 4 × 4 matrices of (18) and (19), typed as printed, give the same derivative.",
        (Evidence("largest difference", apart, "1/s"),),
    )


ORDERS = (1, 2, 3, 4, 5)


def truncated(rate: float = 10.0) -> list[float]:
    """Return the final error in deg on Fig. 4 of (20)-(22), cut at orders 1 to 5."""
    motion = scenario_motion("alexiev-fig4")
    return [final_error(motion, f"quaternion:order={n}", rate) for n in ORDERS]


def series(errors: list[float]) -> Statement:
    """Judge that the series (21), (22) may be cut, from the error in deg of each order."""
    falls = errors[2] < 0.01 * errors[0] and errors[-1] < 1e-4
    enough = next((n for n, e in zip(ORDERS, errors, strict=True) if e < 1e-2), None)
    return Statement(
        "eq20-22",
        "Eqs. (20)-(22)",
        "The components of A have to be calculated up to a given truncation point from the series",
        HOLDS if falls else DOES_NOT_HOLD,
        "",
        "On Fig. 4 at 10 Hz, with steps of 11°, normalised after each"
        + (f": order {enough} leaves less than 0.01°." if enough else "."),
        tuple(Evidence(f"order {n}", e, "°") for n, e in zip(ORDERS, errors, strict=True)),
    )
