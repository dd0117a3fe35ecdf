"""What is not known of gyros and accelerometers that are to be aligned or navigated by."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from strapdown.errors import ConfigError
from strapdown.sensors.catalogue import Sensor
from strapdown.sensors.sensor_uncertainty import uncertainty_of
from strapdown.sensors.triad_errors import Triad, TriadErrors, TriadLike
from strapdown.sensors.triad_uncertainty import TriadUncertainty
from strapdown.tables.checks import is_number

__all__ = ["BiasDrift", "ImuUncertainty"]


@dataclass(frozen=True)
class BiasDrift:
    """How a bias changes within a record: a first-order Gauss-Markov process.

    Attributes
    ----------
    sd : triad, rad/s or m/s²
        Of the process, once it has run for long.
    correlation_time : float, s
        Infinite where the bias is constant.
    """

    sd: TriadLike = 0.0
    correlation_time: float = math.inf

    def __post_init__(self) -> None:
        given: tuple[float, ...] = (
            (self.sd,) * 3 if isinstance(self.sd, int | float) else tuple(self.sd)
        )
        if len(given) != 3 or not all(is_number(x) and 0.0 <= x < math.inf for x in given):
            raise ConfigError("sensors.no-standard-deviation", quantity="sd", sd=self.sd)
        if not is_number(self.correlation_time) or not self.correlation_time > 0.0:
            raise ConfigError(
                "sensors.no-time",
                quantity="correlation_time",
                correlation_time=self.correlation_time,
            )
        object.__setattr__(self, "sd", tuple(float(x) for x in given))

    @property
    def triad(self) -> Triad:
        """Standard deviation of each axis."""
        return self.sd  # type: ignore[return-value]


@dataclass(frozen=True)
class ImuUncertainty:
    """Standard deviations of what gyros and accelerometers do to the truth, in SI.

    Attributes
    ----------
    gyro, accel : TriadUncertainty
        What stays over a record, and white noise.
    gyro_drift, accel_drift : BiasDrift
        What changes within it.
    """

    gyro: TriadUncertainty
    accel: TriadUncertainty
    gyro_drift: BiasDrift = field(default_factory=BiasDrift)
    accel_drift: BiasDrift = field(default_factory=BiasDrift)

    @classmethod
    def of_sensor(cls, sensor: Sensor) -> ImuUncertainty:
        """Take a data sheet.

        Parameters
        ----------
        sensor : Sensor
            With gyros and accelerometers.

        Returns
        -------
        ImuUncertainty

        Raises
        ------
        ConfigError
            The sensor lacks a triad.
        """
        gyro = uncertainty_of(sensor, "gyro")
        accel = uncertainty_of(sensor, "accel")
        errors = sensor.imu_errors
        assert errors.accel is not None  # uncertainty_of has found it
        return cls(gyro, accel, _drift(errors.gyro), _drift(errors.accel))


def _drift(errors: TriadErrors) -> BiasDrift:
    time = errors.correlation_time
    return BiasDrift(errors.bias_instability, time if time > 0.0 else math.inf)
