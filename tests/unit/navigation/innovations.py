"""Tables of innovations as a navigator records them, made of numbers."""

from __future__ import annotations

import numpy as np
import pandas as pd

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
