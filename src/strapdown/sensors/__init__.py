"""Sensor models: errors, uncertainty, health tests, redundancy and preparation of records."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.sensors.catalogue import SENSORS as SENSORS
    from strapdown.sensors.catalogue import Sensor as Sensor
    from strapdown.sensors.catalogue import load_sensor as load_sensor
    from strapdown.sensors.crash_unit import CrashUnit as CrashUnit
    from strapdown.sensors.crash_unit import Mounting as Mounting
    from strapdown.sensors.error_chain import apply as apply
    from strapdown.sensors.error_chain import child as child
    from strapdown.sensors.error_chain import intervals as intervals
    from strapdown.sensors.error_chain import white_noise as white_noise
    from strapdown.sensors.rest import RestStretch as RestStretch
    from strapdown.sensors.synchronise import synchronise as synchronise
    from strapdown.sensors.triad_errors import ImuErrors as ImuErrors
    from strapdown.sensors.triad_errors import TriadErrors as TriadErrors
    from strapdown.sensors.uncertainty import ImuUncertainty as ImuUncertainty
    from strapdown.sensors.uncertainty import TriadUncertainty as TriadUncertainty
    from strapdown.sensors.uncertainty import crash_priors as crash_priors
    from strapdown.sensors.uncertainty import draw_errors as draw_errors


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
