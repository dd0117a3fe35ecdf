"""The update (9)-(15) as it is printed: one Newton step, W not deflated, one orthogonalisation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from papers.chernodarov.drive import RECEIVER
from papers.chernodarov.prediction import Predicted
from papers.reproduction import DOES_NOT_HOLD, HOLDS, Evidence, Statement
from strapdown.estimation import (
    COVARIANCES,
    Chernodarov,
    Huber,
    PaperUpdate,
    RobustUpdate,
    UpdateRule,
)

Array = NDArray[np.float64]

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
