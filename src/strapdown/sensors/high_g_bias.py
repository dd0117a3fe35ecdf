"""The bias of a high range from the range below it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.sensors.rest import sd_of_mean

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

__all__ = ["RangeBias", "bias_from_lower_range"]

LEAST_SAMPLES = 5
# A converter whose input does not wander over a good part of a step does not average it out
# (the error of the mean is below q/100 where the noise exceeds 0.7 q, and q/√12 without any).
DITHERED = 0.5


@dataclass(frozen=True)
class RangeBias:
    """Difference of two ranges that feel the same.

    Attributes
    ----------
    bias : tuple of float, u
        Of the higher range, relative to the lower.
    sd : tuple of float, u
        Of that difference: noise of the mean, and the part of a step that no noise averages
        out. The lower range's own bias is in the difference and not in this.
    samples : tuple of int
        How many there were, per axis.
    """

    bias: tuple[float, float, float]
    sd: tuple[float, float, float]
    samples: tuple[int, int, int]


def bias_from_lower_range(
    time: Array,
    higher: Array,
    lower: Array,
    use: Mask,
    *,
    quantization: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> RangeBias | None:
    """Take the bias of a range from the next lower one.

    Parameters
    ----------
    time : ndarray, (n,), s
    higher, lower : ndarray, (n, 3), m/s²
        At the same stamps, in the same axes.
    use : ndarray of bool, (n, 3)
        Samples at which the lower range is clear of its end and the vehicle is quiet.
    quantization : tuple of float, m/s²
        Step of the higher range.

    Returns
    -------
    RangeBias or None
        None where an axis has fewer than five samples to use.

    Notes
    -----
    Mean of ``higher - lower``: whatever the vehicle does cancels, but for the difference of the
    two scale factors times the specific force over the stretch (at rest: gravity), which is
    found as bias. So was the paper's bias of up to 11.91 m/s² found (Tadic and Vukajlovic 2016,
    section 3), and it says as well that the low range's own, 0.2 m/s² there, stays.
    """
    bias, sd, samples = np.zeros(3), np.zeros(3), np.zeros(3, dtype=np.int64)
    for k in range(3):
        rows = np.flatnonzero(use[:, k])
        if rows.size < LEAST_SAMPLES:
            return None
        difference = (higher[rows, k] - lower[rows, k])[:, None]
        bias[k] = difference.mean()
        noise = float(sd_of_mean(time[rows], difference)[0])
        step = float(quantization[k])
        dithered = float(higher[rows, k].std()) >= DITHERED * step
        sd[k] = np.hypot(noise, 0.0 if dithered else step / np.sqrt(12.0))
        samples[k] = rows.size
    return RangeBias(
        (float(bias[0]), float(bias[1]), float(bias[2])),
        (float(sd[0]), float(sd[1]), float(sd[2])),
        (int(samples[0]), int(samples[1]), int(samples[2])),
    )
