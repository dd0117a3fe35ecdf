"""Tables of innovations as a navigator records them, made of numbers."""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.optimize import brentq

LABELS = ("north, m", "east, m", "down, m")
# Variance that was expected, m².
VARIANCE = 4.0


def innovation_table(normalised, time=None):
    n, k = normalised.shape
    time = np.arange(float(n)) if time is None else time
    s = np.full((n, k), VARIANCE)
    return pd.DataFrame(
        np.hstack([normalised * np.sqrt(VARIANCE), s, np.ones((n, k))]),
        index=pd.Index(time, name="time"),
        columns=[f"{part} {label}" for part in ("nu", "s", "weight") for label in LABELS[:k]],
    )


def exactly(seed, scale=1.0, mean=0.0, rho=0.0):
    """Numbers whose root mean square about the mean, mean and lag-one correlation are as given."""
    x = np.random.default_rng(seed).standard_normal(601)

    def mixed(a):
        y = x[1:] + a * x[:-1]
        y -= y.mean()
        return y / np.sqrt(np.mean(y**2))

    def correlation(a):
        y = mixed(a)
        return y[1:] @ y[:-1] / (y @ y) - rho

    return (mean + scale * mixed(brentq(correlation, -0.999, 0.999)))[:, None]
