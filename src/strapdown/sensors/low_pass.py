"""Single-pole low-pass for samples with variable spacing."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def time_constant(bandwidth: float) -> float:
    """Time constant in s of a single pole with its -3 dB point at `bandwidth` Hz."""
    return 1.0 / (2.0 * math.pi * bandwidth)


def low_pass(time: Array, values: Array, bandwidth: float) -> Array:
    """Apply the low-pass, exactly for an input linear between samples.

    `time` ((n,), s). `values` ((n, 3)). `bandwidth`: -3 dB frequency; with infinity the output
    equals the input. Returns (n, 3): output at the stamps, settled at the first value before the
    first stamp. With ``h = dt/τ`` and ``a = exp(-h)``, a step goes from y0 to
    ``a y0 + ((1-a)/h - a) u0 + (1 - (1-a)/h) u1``, the solution of ``τ y' = u - y`` for u linear in
    between.
    """
    if math.isinf(bandwidth):
        return values
    from strapdown._kernels.signals import first_order

    h = np.diff(time) / time_constant(bandwidth)
    a = np.exp(-h)
    held = -np.expm1(-h) / h
    drive = (held - a)[:, None] * values[:-1] + (1.0 - held)[:, None] * values[1:]
    out = np.empty_like(values)
    out[0] = values[0]
    first_order(a, np.ascontiguousarray(drive), np.ascontiguousarray(values[0]), out[1:])
    return out


def mean_of_filtered(ends: Array, mean: Array, steps: Array, bandwidth: float) -> Array:
    """Mean of the filter output over each step, from the mean of its input.

    ``τ y' = u - y`` integrated over a step: ``mean(y) = mean(u) - τ (y1 - y0)/dt``.

    `ends` ((n, 3)): output at the end of each step; before the first step the filter is settled at
    its mean. `mean` ((n, 3)): mean of the input over each step. `steps` ((n,), s).
    """
    before = np.vstack([ends[:1], ends[:-1]])
    return np.asarray(
        mean - time_constant(bandwidth) * (ends - before) / steps[:, None], dtype=np.float64
    )
