"""The one table of aids."""

from __future__ import annotations

from strapdown.aiding.aid import Aid
from strapdown.aiding.barometer import Barometer
from strapdown.aiding.body_velocity import BodyVelocity
from strapdown.aiding.gnss import Gnss
from strapdown.aiding.heading import Heading
from strapdown.aiding.no_slip import NoSlip
from strapdown.aiding.odometer import Odometer
from strapdown.aiding.zero_rate import ZeroRate
from strapdown.aiding.zero_velocity import ZeroVelocity

AIDS: dict[str, type[Aid]] = {
    "gnss": Gnss,
    "zero_velocity": ZeroVelocity,
    "zero_rate": ZeroRate,
    "no_slip": NoSlip,
    "odometer": Odometer,
    "body_velocity": BodyVelocity,
    "barometer": Barometer,
    "heading": Heading,
}
