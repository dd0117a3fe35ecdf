"""By how much a vehicle turned after the blow, as its gyro has it: what a person can confirm."""

from __future__ import annotations

import numpy as np

from strapdown.systems.crash_draft.group_units import Unit

__all__ = ["LEAST_TURN", "in_turn_words", "turn_after"]

# How long after the blow is looked at, s, and how long before it the gyro's rest is.
AFTER, BEFORE, GAP = 0.5, 1.0, 0.05
#: Of less a person who saw the crash cannot tell the direction, deg.
LEAST_TURN = 3.0


def turn_after(unit: Unit) -> float | None:
    """Turn about the vertical in the half second after the blow.

    Parameters
    ----------
    unit : Unit

    Returns
    -------
    float or None, deg
        Positive to the right; None where no gyro or no rest tells it. It does not depend on the
        heading of the mounting.
    """
    gyro, sitting = unit.gyro, unit.impact.sitting
    if gyro is None or sitting is None or len(gyro.axes) < 3 or not unit.impact.found:
        return None
    zero = unit.impact.trigger
    before = (gyro.time > zero - BEFORE) & (gyro.time < zero - GAP)
    after = (gyro.time >= zero) & (gyro.time <= zero + AFTER)
    if not before.any() or after.sum() < 2:
        return None
    rate = sitting.into_vehicle(gyro.values - np.median(gyro.values[before], axis=0))[:, 2]
    return float(np.degrees(np.trapezoid(rate[after], gyro.time[after])))


def in_turn_words(turn: float) -> str:
    """A turn as a person who saw it from above would tell it."""
    return f"{abs(turn):.0f} deg to the {'right' if turn > 0.0 else 'left'}"
