"""Values of a live run that no sensor can give, which are refused."""

from __future__ import annotations

from dataclasses import dataclass

from strapdown.live.lines import BadLineError, Sample
from strapdown.sensors.uncertainty import ImuUncertainty

#: Largest stamp, s: the year 2286, where a double resolves 2 µs.
LATEST = 1e10
#: The ranges of a sensor family, as ±2 to ±16 g or ±250 to ±2000 deg/s, differ at most eightfold.
FAMILY = 8.0
#: Beyond any gyro, rad/s, and accelerometer, m/s².
FASTEST, STRONGEST = 1e4, 1e6


@dataclass(frozen=True)
class ValueLimits:
    """Largest readings that a sensor can give, rad/s and m/s²."""

    rate: float = FASTEST
    force: float = STRONGEST

    def check(self, said: Sample) -> None:
        """Refuse a stamp or a reading beyond the limits."""
        if not abs(said.time) <= LATEST:
            raise BadLineError("stamp", "live.stamp-beyond-limit", time=said.time, most=LATEST)
        force, rate = said.values[-3:], said.values[:-3]
        for values, most, unit in ((rate, self.rate, "rad/s"), (force, self.force, "m/s²")):
            for value in values:
                if not abs(value) <= most:
                    raise BadLineError(
                        "value", "live.value-beyond-limit", value=value, most=most, unit=unit
                    )


def value_limits(sensors: ImuUncertainty) -> ValueLimits:
    """Return the limits by the stated full scale; a sensor may be set to its family's largest."""
    rate, force = (
        min(FAMILY * max(triad.axis("full_scale")), most)
        for triad, most in ((sensors.gyro, FASTEST), (sensors.accel, STRONGEST))
    )
    return ValueLimits(rate, force)
