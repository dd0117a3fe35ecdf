"""Scale factor and nonlinearity of one sensor axis, and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Newton halves the bracket at worst and squares the error at best; a double has 53 bits.
MOST_ITERATIONS = 60


def transfer(x: Array, scale: float, second: float, third: float, full: float) -> Array:
    """What an axis reads for an input.

    Parameters
    ----------
    x : ndarray, (n,), u
    scale, second, third : float
        Of `TriadErrors`: ``y/F = (1 + scale) x/F + second (x/F)² + third (x/F)³`` up to full
        scale, ``|x| <= F``, and beyond it along the tangent, so that a reading never has two
        inputs.
    full : float, u
        F.

    Returns
    -------
    ndarray, (n,), u
    """
    if second == 0.0 and third == 0.0:
        return x * (1.0 + scale)
    r = x / full
    inner = np.clip(r, -1.0, 1.0)
    gain = 1.0 + scale
    value = inner * (gain + inner * (second + inner * third))
    slope = gain + inner * (2.0 * second + inner * 3.0 * third)
    return np.asarray(full * (value + slope * (r - inner)), dtype=np.float64)


def input_of(y: Array, scale: float, second: float, third: float, full: float) -> Array:
    """Which input an axis reads so: the inverse of `transfer`, to rounding.

    Newton's method within a bracket, which the monotone curve cannot leave.
    """
    gain = 1.0 + scale
    if second == 0.0 and third == 0.0:
        return y / gain
    r = y / full
    ends = {end: end * (gain + end * (second + end * third)) for end in (-1.0, 1.0)}
    low, high = np.full_like(r, -1.0), np.full_like(r, 1.0)
    target = np.clip(r, ends[-1.0], ends[1.0])
    x = np.clip(target / gain, -1.0, 1.0)
    for _ in range(MOST_ITERATIONS):
        excess = x * (gain + x * (second + x * third)) - target
        high, low = np.where(excess > 0.0, x, high), np.where(excess <= 0.0, x, low)
        step = x - excess / (gain + x * (2.0 * second + x * 3.0 * third))
        step = np.where((step >= low) & (step <= high), step, 0.5 * (low + high))
        settled = bool(np.all(np.abs(step - x) <= 2.0**-53 * np.abs(x)))
        x = step
        if settled:
            break
    for end, value in ends.items():
        slope = gain + end * (2.0 * second + end * 3.0 * third)
        beyond = r > value if end > 0.0 else r < value
        x = np.where(beyond, end + (r - value) / slope, x)
    return np.asarray(x * full, dtype=np.float64)
