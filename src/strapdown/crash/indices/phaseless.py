"""The four-pole Butterworth low-pass without phase of EN 1317-1:2010."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from strapdown.crash.indices.pulse import step_of
from strapdown.errors import ConfigError, DataError

Array = NDArray[np.float64]
#: What the cut-off frequency belongs to.
CUTOFFS = ("whole", "pass")
# Record that is put before and after, in s, as T/HIS does for EN 1317-1:2010.
PADDING = 0.5
# Both passes together fall by 1/(1 + (f/each)^4), which is 3 dB at this share of their own
# cut-off, 0.8022.
PASS_SHARE = (math.sqrt(2.0) - 1.0) ** 0.25


def four_pole(time: Array, values: Array, frequency: float, cutoff: str = "whole") -> Array:
    """Filter forward and backward with two poles each.

    Parameters
    ----------
    time : ndarray, (n,), s
        Of one step.
    values : ndarray, (n,) or (n, k)
    frequency : float, Hz
    cutoff : {'whole', 'pass'}
        Whether the filter as a whole is 3 dB down there, or each pass (the whole then 6 dB).

    Returns
    -------
    ndarray
        Of the shape of `values`. Before and after the record its point mirror is put, half a
        second of it or as much as there is, so that a record that rests at its ends starts
        and stops without a transient.

    Raises
    ------
    DataError
        The steps differ, or the record is sampled at less than ten times the frequency.
    ConfigError
        The cut-off is of neither kind.
    """
    from scipy.signal import butter, sosfiltfilt

    if cutoff not in CUTOFFS:
        raise ConfigError(
            "crash.no-kind-cut-off", quantity="cutoff", cutoff=cutoff, word=cutoff, known=CUTOFFS
        )
    step = step_of(time)
    if 1.0 / step < 10.0 * frequency:
        raise DataError(
            "crash.rate-hz-less-than-ten", quantity="time", step=1.0 / step, frequency=frequency
        )
    each = frequency / PASS_SHARE if cutoff == "whole" else frequency
    sections = butter(2, each, fs=1.0 / step, output="sos")
    padding = min(round(PADDING / step), time.size - 1)
    return np.asarray(sosfiltfilt(sections, values, axis=0, padtype="odd", padlen=padding))
