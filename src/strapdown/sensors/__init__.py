"""Sensor models: errors, uncertainty, health tests, redundancy and preparation of records."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.sensors.catalogue import SENSORS, Sensor, load_sensor
    from strapdown.sensors.crash_unit import CrashUnit, Mounting
    from strapdown.sensors.error_chain import apply, child, intervals, white_noise
    from strapdown.sensors.rest import RestStretch
    from strapdown.sensors.synchronise import synchronise
    from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
    from strapdown.sensors.uncertainty import (
        ImuUncertainty,
        TriadUncertainty,
        crash_priors,
        draw_errors,
    )

__all__ = [
    "SENSORS",
    "CrashUnit",
    "ImuErrors",
    "ImuUncertainty",
    "Mounting",
    "RestStretch",
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
        "crash_unit": "CrashUnit Mounting",
        "error_chain": "apply child intervals white_noise",
        "rest": "RestStretch",
        "synchronise": "synchronise",
        "triad_errors": "ImuErrors TriadErrors",
        "uncertainty": "ImuUncertainty TriadUncertainty crash_priors draw_errors",
    },
)
