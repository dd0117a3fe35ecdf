"""Channel frequency classes (CFC) of crash tests: zero-phase low-pass of SAE J211-1, ISO 6487."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from strapdown._kernels import signals
from strapdown.constants import Array
from strapdown.dsp.samples import as_channels, positive_step
from strapdown.errors import ConfigError, DataError, check_choice

CHANNEL_CLASSES = (60, 180, 600, 1000)
# Design frequency of one pass, divided by the class number.
DESIGN_FREQUENCY = {"iso": 25.0 / 12.0, "sae": 2.0775}
LEAST_RATE = 10.0  # sampling rate in Hz, divided by the class number
LEAST_PADDING = 0.010  # s
LEAST_PADDED = 100
# Start transient left after the padding, relative. The standards' 10 ms leave 0.4 % with class 60.
FORGOTTEN = 1e-8


@dataclass(frozen=True)
class CfcCoefficients:
    """One pass: ``y[n] = a0 x[n] + a1 x[n-1] + a2 x[n-2] + b1 y[n-1] + b2 y[n-2]``."""

    a0: float
    a1: float
    a2: float
    b1: float
    b2: float


def cfc_coefficients(cfc: float, step: float, standard: str = "iso") -> CfcCoefficients:
    """Compute the coefficients of one pass of a channel frequency class.

    Parameters
    ----------
    cfc : {60, 180, 600, 1000}
        The class. The gain of both passes together is -3 dB at 5/3 of the class number, in Hz.
    step : float, s
        Sampling interval.
    standard : {'iso', 'sae'}
        ISO 6487 with ``wd = 2π CFC 25/12``, or SAE J211-1 with ``wd = 2π CFC 2.0775``.

    Returns
    -------
    CfcCoefficients
        Two-pole Butterworth by the bilinear transformation, ``wa = tan(wd step/2)``
        (SAE J211-1 MAR95, appendix C; ISO 6487:2002, annex A).

    Raises
    ------
    ConfigError
        Unknown class or standard, or a sampling rate below ten times the class. Towards the
        Nyquist frequency the transformation departs from the filter; beyond it the tangent is
        negative and the pass unstable (class 60 at 200 Hz).
    """
    step = positive_step(step)
    if cfc not in CHANNEL_CLASSES:
        raise ConfigError(
            "dsp.no-channel-frequency-class",
            quantity="cfc",
            cfc=cfc,
            word=str(cfc),
            known=[str(c) for c in CHANNEL_CLASSES],
        )
    check_choice(
        "dsp.no-standard-channel-frequency-classes",
        DESIGN_FREQUENCY,
        quantity="standard",
        standard=standard,
    )
    rate = 1.0 / step
    if rate < LEAST_RATE * cfc * (1.0 - 1e-9):
        fits = [c for c in CHANNEL_CLASSES if rate >= LEAST_RATE * c * (1.0 - 1e-9)]
        lower = f"use CFC {fits[-1]}, " if fits else ""
        raise ConfigError(
            "dsp.cfc-needs-samples-per-second",
            quantity="cfc",
            cfc=cfc,
            least_rate=LEAST_RATE * cfc,
            rate=rate,
            lower=lower,
        )
    wa = math.tan(math.pi * cfc * DESIGN_FREQUENCY[standard] * step)
    whole = 1.0 + math.sqrt(2.0) * wa + wa * wa
    a0 = wa * wa / whole
    return CfcCoefficients(
        a0,
        2.0 * a0,
        a0,
        -2.0 * (wa * wa - 1.0) / whole,
        (-1.0 + math.sqrt(2.0) * wa - wa * wa) / whole,
    )


def cfc_filter(values: ArrayLike, step: float, cfc: float, standard: str = "iso") -> Array:
    """Pass samples forward and backward through a channel frequency class.

    Parameters
    ----------
    values : array_like, (n,) or (n, k)
        Evenly spaced samples, one column per channel.
    step : float, s
    cfc, standard
        As in `cfc_coefficients`.

    Returns
    -------
    ndarray, of the shape of `values`
        Without delay. Both ends are padded by the samples point-mirrored about the end sample
        (ISO 6487), over at least 10 ms (the minimum of SAE J211-1) and at least 100 samples, and
        until the start transient of a pass has decayed to 1e-8, as far as there are samples.
        Each pass starts in the steady state of its first padded value. Constants pass to
        rounding, and straight lines without end effects.

    Raises
    ------
    ConfigError
        As in `cfc_coefficients`.
    DataError
        A sample is not finite, or the record is not longer than the 10 ms that are mirrored.
    """
    c = cfc_coefficients(cfc, step, standard)
    channels = as_channels(values)
    least = math.ceil(LEAST_PADDING / step - 1e-9)
    if len(channels) <= least:
        raise DataError(
            "dsp.samples-too-few-cfc-more",
            quantity="values",
            count=len(channels),
            step=step,
            cfc=cfc,
            least_padding=LEAST_PADDING * 1000.0,
            least=least + 1,
        )
    # The squared modulus of the poles is -b2.
    memory = math.log(FORGOTTEN) / (0.5 * math.log(-c.b2))
    n = min(len(channels) - 1, max(least, LEAST_PADDED, math.ceil(memory)))
    return both_ways(c, channels, n).reshape(np.shape(values))


def both_ways(c: CfcCoefficients, channels: Array, n: int, *, summed: bool = False) -> Array:
    """Pass channels, (k, c), forward and backward, with `n` samples mirrored at either end.

    Each pass begins in the steady state of its first value. `summed`: order of the sums
    (`_kernels.signals.second_order`).
    """
    first, last = channels[:1], channels[-1:]
    passed = np.concatenate(
        [2.0 * first - channels[n:0:-1], channels, 2.0 * last - channels[-2 : -n - 2 : -1]]
    )
    gained = [c.a1 + c.b1 * c.a0, c.a2 + c.b2 * c.a0]
    rest = np.linalg.solve([[1.0 - c.b1, -1.0], [-c.b2, 1.0]], gained)[:, None]
    coefficients = np.array([c.a0, c.a1, c.a2, c.b1, c.b2])
    for _ in range(2):
        out = np.empty_like(passed)
        signals.second_order(coefficients, rest * passed[0], passed, summed, out)
        passed = np.ascontiguousarray(out[::-1])
    return passed[n : n + len(channels)]
