"""Channel frequency classes of crash tests: the phaseless low-pass of SAE J211-1 and ISO 6487."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.dsp.samples import as_channels, positive_step
from strapdown.errors import ConfigError, DataError

Array = NDArray[np.float64]

__all__ = [
    "CHANNEL_CLASSES",
    "DESIGN_FREQUENCY",
    "CfcCoefficients",
    "cfc_coefficients",
    "cfc_filter",
    "cfc_noise_factor",
    "cfc_response",
]

CHANNEL_CLASSES = (60, 180, 600, 1000)
# Design frequency of one pass over the class number.
DESIGN_FREQUENCY = {"iso": 25.0 / 12.0, "sae": 2.0775}
LEAST_RATE = 10.0  # samples per second, over the class number
LEAST_PADDING = 0.010  # s
LEAST_PADDED = 100
# What is left of a start that does not fit, after the padding; the standards' 10 ms leave 0.4 % of
# it with class 60.
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
    """Coefficients of one pass of a channel frequency class.

    Parameters
    ----------
    cfc : {60, 180, 600, 1000}
        The class. Both passes together are 3 dB down at 5/3 of it, in Hz.
    step : float, s
        Distance of samples.
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
        No such class or standard, or a rate below ten times the class: towards the Nyquist
        frequency the transformation is no longer that filter, and beyond it the tangent is
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
    if standard not in DESIGN_FREQUENCY:
        raise ConfigError(
            "dsp.no-standard-channel-frequency-classes",
            quantity="standard",
            standard=standard,
            word=str(standard),
            known=DESIGN_FREQUENCY,
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


def cfc_response(
    frequency: ArrayLike, cfc: float, step: float, standard: str = "iso"
) -> Array | float:
    """Gain of both passes; their phase is zero.

    Parameters
    ----------
    frequency : array_like, Hz
        Up to the Nyquist frequency.
    cfc, step, standard
        As in `cfc_coefficients`.

    Returns
    -------
    ndarray or float
        ``1/(1 + (tan(π f step)/wa)⁴)``, which is what the bilinear transformation makes of a
        two-pole Butterworth twice. At 10 kHz the classes 60, 180 and 600 lie in the corridor of
        the standards throughout. So does 1000 from 12.5 kHz on; at 10 kHz it falls up to 3 dB too
        much above 2.9 kHz, where less than a twentieth passes anyway.
    """
    cfc_coefficients(cfc, step, standard)
    wa = math.tan(math.pi * cfc * DESIGN_FREQUENCY[standard] * step)
    warped = np.tan(np.pi * np.asarray(frequency, dtype=np.float64) * step) / wa
    gain = 1.0 / (1.0 + warped**4)
    return float(gain) if gain.ndim == 0 else np.asarray(gain)


def cfc_noise_factor(cfc: float, step: float, standard: str = "iso") -> float:
    """Standard deviation of the output per that of white noise in the samples, far from the ends.

    The mean square of the gain over all frequencies, by Parseval.
    """
    # The mean over an even grid of a periodic analytic function converges geometrically.
    grid = (np.arange(1 << 16) + 0.5) / (1 << 17)
    gain = np.asarray(cfc_response(grid / step, cfc, step, standard))
    return float(np.sqrt(np.mean(gain**2)))


def cfc_filter(values: ArrayLike, step: float, cfc: float, standard: str = "iso") -> Array:
    """Pass samples forward and backward through a channel frequency class.

    Parameters
    ----------
    values : array_like, (n,) or (n, k)
        Evenly spaced samples, one column a channel.
    step : float, s
    cfc, standard
        As in `cfc_coefficients`.

    Returns
    -------
    ndarray, of the shape of `values`
        Without delay. Both ends are continued by their own samples, point-mirrored about the end
        sample as ISO 6487 has it, over 10 ms or more (SAE J211-1's least) and 100 samples or more,
        and in any case until a pass has forgotten its start to 1e-8, as far as there are samples;
        each pass begins at rest with its first padded value. A constant passes to rounding, and a
        straight line without a trace of the ends.

    Raises
    ------
    ConfigError
        As in `cfc_coefficients`.
    DataError
        A sample is not finite, or the record is shorter than the 10 ms that are mirrored.
    """
    from scipy.signal import lfilter, lfilter_zi

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
    # The pole's modulus squared is -b2.
    memory = math.log(FORGOTTEN) / (0.5 * math.log(-c.b2))
    n = min(len(channels) - 1, max(least, LEAST_PADDED, math.ceil(memory)))
    first, last = channels[:1], channels[-1:]
    padded = np.concatenate(
        [2.0 * first - channels[n:0:-1], channels, 2.0 * last - channels[-2 : -n - 2 : -1]]
    )
    b, a = [c.a0, c.a1, c.a2], [1.0, -c.b1, -c.b2]
    rest = lfilter_zi(b, a)[:, None]
    for _ in range(2):
        padded = lfilter(b, a, padded, axis=0, zi=rest * padded[0])[0][::-1]
    return np.ascontiguousarray(padded[n : n + len(channels)]).reshape(np.shape(values))
