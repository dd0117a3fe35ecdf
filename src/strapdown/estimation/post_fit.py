"""The residual that an observation leaves where its loss and the prior's are least together."""

from __future__ import annotations

import math

from strapdown.estimation.influence import Influence

#: Newton's steps go to the root from one side; they stop where they no longer change it.
STEPS = 200


def post_fit(influence: Influence, b: float, kappa: float) -> float:
    """Return the residual after the fit, in standard deviations of the observation.

    Along ``P h'`` the loss ``(x - m)' P^-1 (x - m) / 2 + rho`` is, as a function of the residual
    beta that it leaves, ``(b - beta)^2 / (2 kappa) + rho(beta)``. It is stationary where
    ``F(beta) = beta + kappa psi(beta) = b``; a minimum is where F rises. With a psi that comes
    down again there are several of them, and the lowest is taken.

    Between two knots F is convex or concave, and has one rising root at most. Newton's method
    finds it from the left of a concave piece and from the right of a convex one: the tangent then
    lies on the far side of F, no step goes past the root, and a slope that is not positive means
    that there is none.

    Parameters
    ----------
    influence : Influence
    b : float
        Residual before the fit, >= 0.
    kappa : float
        Variance of the prediction over that of the observation, >= 0.

    Returns
    -------
    float
        From 0 to b.
    """
    best, least = b, math.inf
    lo = 0.0
    for knot in (*influence.knots, math.inf):
        hi = min(knot, b)
        beta = _rising_root(influence, lo, hi, b, kappa)
        if beta is not None:
            # b - beta = kappa psi, without the cancellation.
            loss = 0.5 * kappa * influence.psi(beta) ** 2 + influence.rho(beta)
            if loss < least:
                best, least = beta, loss
        if hi >= b:
            break
        lo = hi
    return best


def _rising_root(
    influence: Influence, lo: float, hi: float, b: float, kappa: float
) -> float | None:
    """Return where F rises through b between two neighbouring knots, if it does."""
    psi, psi_prime = influence.psi, influence.psi_prime
    inside = math.nextafter(lo, math.inf)
    concave = psi_prime(inside) >= psi_prime(hi)
    u = lo if concave else hi
    excess = u + kappa * psi(u) - b
    if (excess > 0.0) if concave else (excess < 0.0):
        return None
    slope_at = inside if concave else hi
    for _ in range(STEPS):
        slope = 1.0 + kappa * psi_prime(slope_at)
        if slope <= 0.0:
            return None
        after = u - excess / slope
        if after > hi:
            # By rounding alone, or because there is no root before the knot.
            return hi if after <= hi * (1.0 + 1e-12) else None
        if after < lo:
            return lo if after >= lo * (1.0 - 1e-12) else None
        # All steps go the same way, until rounding turns one back.
        if (after <= u) if concave else (after >= u):
            return u
        u = slope_at = after
        excess = u + kappa * psi(u) - b
    return u
