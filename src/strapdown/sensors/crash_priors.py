"""Stated uncertainties of a crash recorder's triads."""

from __future__ import annotations

import math

from strapdown.constants import GYRO_UNITS
from strapdown.errors import ConfigError
from strapdown.sensors.triad_uncertainty import TriadUncertainty


def crash_priors(rate: float = 200.0) -> dict[str, TriadUncertainty]:
    """Give the error model that a merged recorder of consumer grade was found to have.

    Parameters
    ----------
    rate : float, Hz
        At which a sample of the specific force has the noise that is stated.

    Returns
    -------
    dict
        ``accel``: bias 0.2 m/s² (Tadic and Vukajlovic 2016, section 3: the low-g parts' own),
        scale factor 2 %, noise 0.4 m/s² a sample. ``gyro``: bias 0.3 deg/s. All standard
        deviations, of every axis; nothing else is uncertain, and no range ends. Scale, noise
        and gyro bias are choices: the paper has no figures of them.

    Raises
    ------
    ConfigError
        The rate is not positive.
    """
    if not (math.isfinite(rate) and rate > 0.0):
        raise ConfigError("sensors.rate-not-positive", quantity="rate", rate=rate)
    return {
        "accel": TriadUncertainty(
            bias=0.2,
            scale=0.02,
            noise_density=0.4 / math.sqrt(rate),
        ),
        "gyro": TriadUncertainty(bias=0.3 * GYRO_UNITS["deg/s"]),
    }
