"""Measurements of aided navigation: one file each, one table of all by name."""

from __future__ import annotations

from collections.abc import MutableMapping

from strapdown.lazy_names import Choices
from strapdown.navigation.measurements.measurement import Measurement

#: Measurements by their kind in a configuration; plug-ins are added.
AIDS: MutableMapping[str, type[Measurement]] = Choices(
    {
        "gnss": "strapdown.navigation.measurements.gnss:Gnss",
        "zero_velocity": "strapdown.navigation.measurements.standstill:ZeroVelocity",
        "zero_rate": "strapdown.navigation.measurements.standstill:ZeroRate",
        "no_slip": "strapdown.navigation.measurements.vehicle:NoSlip",
        "odometer": "strapdown.navigation.measurements.vehicle:Odometer",
        "body_velocity": "strapdown.navigation.measurements.vehicle:BodyVelocity",
        "barometer": "strapdown.navigation.measurements.barometer:Barometer",
        "heading": "strapdown.navigation.measurements.heading:Heading",
        "magnetometer": "strapdown.navigation.measurements.magnetometer:Magnetometer",
    }
)
