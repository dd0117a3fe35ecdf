"""Head injury criterion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.indices.pulse import checked
from strapdown.dsp.running_integral import running_integral
from strapdown.errors import ConfigError

__all__ = ["Hic", "hic"]


@dataclass(frozen=True)
class Hic:
    """Head injury criterion of a record.

    Attributes
    ----------
    value : float
        In the customary unit, s g^2.5.
    begin, end : float, s
        Window with the maximum.
    longest : float, s
        Longest window evaluated.
    """

    value: float
    begin: float
    end: float
    longest: float


def hic(time: ArrayLike, accel: ArrayLike, *, longest: float = 0.015) -> Hic:
    """Head injury criterion: maximum over all windows between samples.

    Parameters
    ----------
    time : array_like, (n,), s
    accel : array_like, (n, 3), m/s²
        Of the head's center of gravity, of class CFC 1000.
    longest : float, s
        0.015 for HIC15, 0.036 for HIC36.

    Returns
    -------
    Hic

    Raises
    ------
    DataError
        As `pulse.checked`.
    ConfigError
        `longest` is not a positive, finite time.

    Notes
    -----
    ``max (t2 - t1) [1/(t2 - t1) ∫ a dt]^2.5`` with a the resultant in g, over windows that begin
    and end at samples (49 CFR 571.208, S6.2). Every pair of samples is evaluated.
    """
    if not (math.isfinite(longest) and longest > 0.0):
        raise ConfigError("crash.no-length-window", quantity="longest", longest=longest)
    t, a = checked(time, accel, 3, "accel")
    total = running_integral(t, np.sqrt((a * a).sum(axis=1)) / STANDARD_GRAVITY)
    best = (0.0, 0, 1)
    # By number of samples between the ends, until every window is too long.
    for apart in range(1, t.size):
        length = t[apart:] - t[:-apart]
        fits = length <= longest * (1.0 + 1e-9)
        if not fits.any():
            break
        rise = total[apart:] - total[:-apart]
        values = np.where(fits, length * np.abs(rise / length) ** 2.5, -1.0)
        k = int(np.argmax(values))
        if values[k] > best[0]:
            best = (float(values[k]), k, k + apart)
    return Hic(best[0], float(t[best[1]]), float(t[best[2]]), longest)
