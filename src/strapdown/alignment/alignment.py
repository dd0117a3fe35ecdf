"""Result of an alignment: attitude at an instant, with its uncertainty."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.earth import earth_rate, gravity, rows
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import Finding
from strapdown.rotation import euler_sd
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables.checks import Array

#: A well-known attitude must stay so for this long, s.
AHEAD = 3.0


@dataclass(frozen=True, eq=False)
class Alignment:
    """Attitude of a body at one instant, with its covariance.

    Attributes
    ----------
    method : str
        Name of the alignment method.
    time : float, s
        Time of validity.
    q_nb : ndarray, (4,)
        Body forward-right-down to north-east-down, scalar first.
    covariance : ndarray, (3, 3), rad²
        Of the rotation vector ``phi`` in north-east-down axes with
        ``C_estimated = exp([phi x]) C_true``: the components north and east are tilts, down is
        the heading error, positive where the heading is too large.
    gyro_bias, accel_bias : ndarray, (3,), rad/s and m/s², optional
        If the method estimates them, body axes: reading minus truth.
    gyro_bias_sd, accel_bias_sd : ndarray, (3,), optional
    heading_given : bool
        Whether the heading is independent of the gyros: stated, or from the course.
    measured_latitude_deg, measured_latitude_sd_deg : float, deg, optional
        If the method estimates the latitude without the site's: from gravity and Earth rate.
    velocity : ndarray, (3,), m/s, optional
        North, east, down, if the method estimates it.
    place : ndarray, (3,), optional
        Latitude and longitude in deg and height in m, if the method estimates the position.
    joint : ndarray, (39, 39) or (42, 42), optional
        Covariance of the errors of velocity, of the rotation as above, of gyros and accelerometers,
        SI, and of `by_input`, if the method estimates their correlations: an unknown bias is
        correlated with the attitude error that it causes. Error = computed − true; those of the
        sensors are the residual excess of the readings: bias − estimate. With `place` the errors of
        the position follow, north, east, down, without that by a wrong clock of the fixes.
    by_input : ndarray, (27,), optional
        If the method estimates them, errors in proportion to the input above the means of the
        record, at which the biases hold: elements (i, j) are the excess of axis i by input j,
        nine of gyros by rates, nine of gyros by forces, nine of accelerometers by forces.
    earlier : Alignment, optional
        At the first sample of the record, if the method carries its state back there.
    findings : tuple of Finding
        Assumptions that do not hold, and quantities that the sensors cannot determine.
    """

    method: str
    time: float
    q_nb: Array
    covariance: Array
    gyro_bias: Array | None = None
    accel_bias: Array | None = None
    gyro_bias_sd: Array | None = None
    accel_bias_sd: Array | None = None
    heading_given: bool = False
    measured_latitude_deg: float | None = None
    measured_latitude_sd_deg: float | None = None
    velocity: Array | None = None
    joint: Array | None = None
    by_input: Array | None = None
    place: Array | None = None
    earlier: Alignment | None = None
    findings: tuple[Finding, ...] = field(default=())

    @property
    def roll_pitch_heading(self) -> Array:
        """Attitude as 3-2-1 angles, (3,), deg."""
        return rotation.euler_from_quaternion(self.q_nb)

    @property
    def sd_deg(self) -> Array:
        """Standard deviations of roll, pitch and heading, (3,), deg, to first order.

        Near a pitch of ±90° those of roll and heading grow without bound.
        """
        return euler_sd(self.roll_pitch_heading, self.covariance)

    @property
    def sd_deg_to_begin(self) -> Array:
        """Standard deviations of roll, pitch and heading that decide on a begin, (3,), deg.

        A well-known attitude must stay so for `AHEAD` without fixes that observe the biases; with
        a state that is carried back, also that one's must be small: the larger of both.
        """
        sd = self.sd_deg_after(AHEAD)
        return sd if self.earlier is None else np.maximum(sd, self.earlier.sd_deg)

    def sd_deg_after(self, seconds: float) -> Array:
        """Standard deviations of roll, pitch and heading after propagation by the gyros.

        Parameters
        ----------
        seconds : float, s

        Returns
        -------
        ndarray, (3,), deg
            Including the rotation by an unknown gyro bias meanwhile, if the method estimates one;
            else the present ones.
        """
        if self.joint is None:
            return self.sd_deg
        carry = np.zeros((3, len(self.joint)))
        carry[:, 3:6] = np.eye(3)
        carry[:, 6:9] = rotation.dcm_from_quaternion(self.q_nb) * seconds
        return euler_sd(self.roll_pitch_heading, carry @ self.joint @ carry.T)


# Site of an alignment.


@dataclass(frozen=True)
class Site:
    """A position on the Earth.

    Attributes
    ----------
    lat_deg, lon_deg : float, deg
        Geodetic, north and east positive.
    alt : float, m
        Over the ellipsoid.
    ellipsoid : Ellipsoid

    Raises
    ------
    DataError
        A latitude beyond 90 deg, a longitude beyond a full turn, or not a finite number.
    """

    lat_deg: float
    lon_deg: float
    alt: float = 0.0
    ellipsoid: Ellipsoid = WGS84

    def __post_init__(self) -> None:
        rows(lat_deg=self.lat_deg, lon_deg=self.lon_deg, alt=self.alt)

    @property
    def gravity(self) -> Array:
        """Normal gravity north, east, down, (3,), m/s²."""
        return gravity(self.lat_deg, self.alt, ellipsoid=self.ellipsoid)

    @property
    def earth_rate(self) -> Array:
        """Rate of the Earth north, east, down, (3,), rad/s."""
        return earth_rate(self.lat_deg, ellipsoid=self.ellipsoid)


# Interface of every coarse alignment: a method with options that aligns a record.


@dataclass(frozen=True)
class CoarseAlignment(ABC):
    """A method that finds the attitude from the sensor outputs; stateless."""

    name: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]

    @abstractmethod
    def align(
        self,
        imu: pd.DataFrame,
        site: Site,
        sensors: ImuUncertainty,
        gnss: pd.DataFrame | None = None,
    ) -> Alignment:
        """Find the attitude.

        Parameters
        ----------
        imu : DataFrame
            Imu table of the time of alignment alone.
        site : Site
        sensors : ImuUncertainty
        gnss : DataFrame, optional
            Gnss table, for methods that need one.

        Returns
        -------
        Alignment
            At the last sample.

        Raises
        ------
        DataError
            The record does not allow an alignment; the message gives the reason.
        """
