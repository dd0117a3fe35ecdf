"""What one pose at two instants can tell, and what it cannot."""

from __future__ import annotations

import numpy as np

from papers.alexiev.sampling import errors_over_time
from papers.reproduction import (
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Statement,
)
from strapdown.simulation import ImuErrors, Pulse, PulseMotion, TriadErrors


def scale_seen(scale: float = 0.03) -> tuple[float, float]:
    """Turn out and back by 90° with a wrong scale factor: error at the return, and at most, deg."""
    quarter = 0.5 * np.pi
    motion = PulseMotion((Pulse(2, 1.0, 2.0, quarter), Pulse(2, 3.0, 4.0, -quarter)), 5.0)
    errors = ImuErrors(TriadErrors(scale=scale))
    _, error = errors_over_time(motion, "quaternion", 100.0, errors=errors)
    return float(error[-1]), float(error.max())


def reference_points(at_return: float, largest: float, at_nine: float, on_way: float) -> Statement:
    """Judge what a reference point can tell.

    Parameters
    ----------
    at_return, largest : float, deg
        Of a turn out and back with a wrong scale factor: at the return, and on the way.
    at_nine, on_way : float, deg
        Of the motion of Fig. 6 at 20 Hz: at the reference point, and the largest before it.
    """
    blind = at_return < 0.1 * largest
    sees = at_nine > 0.1 * on_way
    if sees and blind:
        verdict = HOLDS_WHEN
        condition = "the errors do not cancel on the way back to the same pose"
    else:
        verdict, condition = (HOLDS if sees else DOES_NOT_HOLD), ""
    return Statement(
        "reference-points",
        "Section 2",
        "Using this approach allows us to obtain an assessment of the quality of the entire "
        "navigation system.",
        verdict,
        condition,
        "One pose at two instants gives the sum of all errors between them. It shows the rate's "
        "on Fig. 6; it is blind to what a return takes back, such as a wrong scale factor on a "
        "turn out and back about one axis.",
        (
            Evidence("Fig. 6 at 20 Hz, seen at 9 s", at_nine, "°"),
            Evidence("the same, largest until then", on_way, "°"),
            Evidence("90° out and back, scale 3 % wrong, seen at the return", at_return, "°"),
            Evidence("the same, largest on the way", largest, "°"),
        ),
        "fig6",
    )
