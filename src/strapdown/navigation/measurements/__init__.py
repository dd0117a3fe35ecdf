"""Measurements of aided navigation: one file each, one table of all by name."""

from __future__ import annotations

from strapdown.navigation.measurements.barometer import Barometer
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.heading import Heading
from strapdown.navigation.measurements.magnetometer import Magnetometer
from strapdown.navigation.measurements.measurement import Measurement
from strapdown.navigation.measurements.standstill import ZeroRate, ZeroVelocity
from strapdown.navigation.measurements.vehicle import BodyVelocity, NoSlip, Odometer

__all__ = [
    "AIDS",
    "Barometer",
    "BodyVelocity",
    "Gnss",
    "Heading",
    "Magnetometer",
    "Measurement",
    "NoSlip",
    "Odometer",
    "ZeroRate",
    "ZeroVelocity",
]

#: Measurements by their kind in a configuration; plug-ins are added.
AIDS: dict[str, type[Measurement]] = {
    "gnss": Gnss,
    "zero_velocity": ZeroVelocity,
    "zero_rate": ZeroRate,
    "no_slip": NoSlip,
    "odometer": Odometer,
    "body_velocity": BodyVelocity,
    "barometer": Barometer,
    "heading": Heading,
    "magnetometer": Magnetometer,
}
