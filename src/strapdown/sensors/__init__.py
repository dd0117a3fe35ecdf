"""What a sensor does and what can be known of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.sensors.catalogue import SENSORS, Sensor, load_sensor
    from strapdown.sensors.crash_priors import crash_priors
    from strapdown.sensors.crash_unit import CrashUnit, Mounting
    from strapdown.sensors.error_chain import apply, intervals
    from strapdown.sensors.error_draws import child, white_noise
    from strapdown.sensors.imu_uncertainty import ImuUncertainty
    from strapdown.sensors.synchronise import synchronise
    from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
    from strapdown.sensors.triad_uncertainty import TriadUncertainty
    from strapdown.sensors.uncertainty_draws import draw_errors

__all__ = [
    "SENSORS",
    "CrashUnit",
    "ImuErrors",
    "ImuUncertainty",
    "Mounting",
    "Sensor",
    "TriadErrors",
    "TriadUncertainty",
    "apply",
    "child",
    "crash_priors",
    "draw_errors",
    "intervals",
    "load_sensor",
    "synchronise",
    "white_noise",
]

load_on_first_use(
    __name__,
    {
        "catalogue": "SENSORS Sensor load_sensor",
        "crash_priors": "crash_priors",
        "crash_unit": "CrashUnit Mounting",
        "error_chain": "apply intervals",
        "error_draws": "child white_noise",
        "imu_uncertainty": "ImuUncertainty",
        "synchronise": "synchronise",
        "triad_errors": "ImuErrors TriadErrors",
        "triad_uncertainty": "TriadUncertainty",
        "uncertainty_draws": "draw_errors",
    },
)
