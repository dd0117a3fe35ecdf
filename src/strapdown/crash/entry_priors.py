"""What is known before the fixes are used: of the sensors, the vehicle and the receiver."""

from __future__ import annotations

import math
from dataclasses import dataclass

from strapdown.errors import ConfigError
from strapdown.sensors.triad_errors import ZERO, Triad
from strapdown.sensors.triad_uncertainty import TriadUncertainty


def _positive(value: float, name: str, code: str) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise ConfigError(code, quantity=name, value=value)


@dataclass(frozen=True)
class FixCorrelation:
    """How much of a fix's error is still there at the next.

    Attributes
    ----------
    share : float
        Of the variance that the receiver states, 0 to 1, which a Gauss-Markov process has; the
        rest is new with each fix.
    time : float, s
        In which its correlation falls to 1/e.

    Raises
    ------
    ConfigError
        A number is out of range.
    """

    share: float
    time: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.share <= 1.0:
            raise ConfigError("crash.no-share", quantity="share", share=self.share)
        _positive(self.time, "time", "crash.correlation-time-not-positive")


@dataclass(frozen=True)
class EntryPriors:
    """Priors of an entry state. All are normal, independent, and standard deviations of zero mean.

    Attributes
    ----------
    gyro, accel : TriadUncertainty
        Of the Imu table, in vehicle axes: noise and biases that are left in it, scale,
        misalignment, g-sensitivity. Nonlinearity, vibration rectification and the range play no
        part at what a vehicle feels before a crash.
    roll_deg, pitch_deg, tilt_sd_deg : float, deg
        Of the vehicle at the anchor; a road's slope and more, where nothing is known.
    heading_deg, heading_sd_deg : float, deg, optional
        From elsewhere, as from marks on the road; both or neither.
    side_slip_sd_deg : float, deg, optional
        The vehicle travels along its forward axis, within this: of the side-slip angle at
        `no_slip_point`, once for the whole window and once more from fix to fix, where the
        vehicle is faster than 3 m/s and its acceleration to the side, speed times yaw rate, is
        below 2 m/s²: tyres slip where they hold. Without it the heading comes from
        accelerations alone.
    no_slip_point : triad, m
        In vehicle axes; of a car the middle of the rear axle.
    antenna_sd : float, m
        Of each coordinate of the antenna.
    time_offset, time_offset_sd : float, s
        A fix that is stamped t is of the instant ``t - time_offset``.
    position_correlation, velocity_correlation : FixCorrelation
        Places of a receiver that stands alone wander over a minute with most of their error; the
        defaults say so. Velocities are new each time, unless the receiver filters them.

    Raises
    ------
    ConfigError
        A number is out of range.
    """

    gyro: TriadUncertainty
    accel: TriadUncertainty
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    tilt_sd_deg: float = 30.0
    heading_deg: float | None = None
    heading_sd_deg: float | None = None
    side_slip_sd_deg: float | None = None
    no_slip_point: Triad = ZERO
    antenna_sd: float = 0.0
    time_offset: float = 0.0
    time_offset_sd: float = 0.0
    position_correlation: FixCorrelation = FixCorrelation(0.9, 60.0)
    velocity_correlation: FixCorrelation = FixCorrelation(0.0, 1.0)

    def __post_init__(self) -> None:
        if (self.heading_deg is None) != (self.heading_sd_deg is None):
            raise ConfigError(
                "crash.heading-worth-something-only-standard",
                quantity="heading_deg, heading_sd_deg",
            )
        for name in ("roll_deg", "pitch_deg", "heading_deg", "time_offset"):
            value = getattr(self, name)
            if value is not None and not math.isfinite(value):
                raise ConfigError("crash.not-finite-number", quantity=name, value=value)
        for name in ("tilt_sd_deg", "heading_sd_deg", "side_slip_sd_deg"):
            if getattr(self, name) is not None:
                _positive(getattr(self, name), name, "crash.standard-deviation-not-positive")
        for name in ("antenna_sd", "time_offset_sd"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ConfigError("crash.standard-deviation-negative", quantity=name, value=value)
        if len(self.no_slip_point) != 3 or not all(map(math.isfinite, self.no_slip_point)):
            raise ConfigError(
                "crash.no-slip-point-not-three-numbers",
                quantity="no_slip_point",
                no_slip_point=self.no_slip_point,
            )
