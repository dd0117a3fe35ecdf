"""What is not known of the vector that redundant axes tell together."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.sensors.axis_voting import AxisVoting
from strapdown.sensors.imu_uncertainty import BiasDrift
from strapdown.sensors.triad_uncertainty import TriadUncertainty

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

__all__ = ["fused_drift", "fused_noise", "fused_uncertainty"]


def fused_noise(voting: AxisVoting, used: Mask) -> Array:
    """Noise density of the fused axes at each sample.

    Parameters
    ----------
    voting : AxisVoting
    used : ndarray of bool, (n, m)
        Axes that the vector is made of.

    Returns
    -------
    ndarray, (n, 3), u/√Hz
    """
    out = np.empty((len(used), 3))
    code = used @ (2 ** np.arange(used.shape[1], dtype=np.int64))
    for value in np.unique(code):
        at = code == value
        mask = used[int(np.argmax(at))]
        covariance = voting.covariance(mask, voting.errors.noise_density**2)
        out[at] = np.sqrt(np.diagonal(covariance))
    return out


def fused_uncertainty(voting: AxisVoting) -> TriadUncertainty:
    """Noise, bias, scale, misalignment and g-sensitivity of the vector of all axes."""
    e, everything = voting.errors, np.ones(len(voting.errors.bias), dtype=bool)
    parts: dict[str, Any] = {}
    for name in ("noise_density", "bias", "scale", "misalignment", "g_sensitivity"):
        variance = np.asarray(getattr(e, name)) ** 2
        x, y, z = np.sqrt(np.diagonal(voting.covariance(everything, variance))).tolist()
        parts[name] = (x, y, z)
    return TriadUncertainty(**parts)


def fused_drift(voting: AxisVoting) -> BiasDrift:
    """Drift of the bias of the vector of all axes."""
    e, everything = voting.errors, np.ones(len(voting.errors.bias), dtype=bool)
    x, y, z = np.sqrt(np.diagonal(voting.covariance(everything, e.drift**2))).tolist()
    # The shortest: what the slower ones do is allowed for too early.
    return BiasDrift((x, y, z), float(e.correlation_time.min()))
