"""Aids by name."""

from __future__ import annotations

from strapdown.aiding.aid import Measurement
from strapdown.aiding.barometer import Barometer
from strapdown.aiding.gnss import Gnss
from strapdown.aiding.heading import Heading
from strapdown.aiding.standstill import ZeroRate, ZeroVelocity
from strapdown.aiding.vehicle import BodyVelocity, NoSlip, Odometer

AIDS: dict[str, type[Measurement]] = {
    "gnss": Gnss,
    "zero_velocity": ZeroVelocity,
    "zero_rate": ZeroRate,
    "no_slip": NoSlip,
    "odometer": Odometer,
    "body_velocity": BodyVelocity,
    "barometer": Barometer,
    "heading": Heading,
}
