"""What every alignment returns: an attitude at an instant, with its uncertainty."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.earth import earth_rate, gravity, rows
from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import Finding
from strapdown.rotation.euler_angles import euler_sd
from strapdown.sensors.uncertainty import ImuUncertainty

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Alignment:
    """Attitude of a body at one instant, and how well it is known.

    Attributes
    ----------
    method : str
        Which one found it.
    time : float, s
        The instant at which it holds.
    q_nb : ndarray, (4,)
        Body forward-right-down to north-east-down, scalar first.
    covariance : ndarray, (3, 3), rad²
        Of the rotation vector ``phi`` in north-east-down axes with
        ``C_estimated = exp([phi x]) C_true``: the components north and east are tilts, down is
        the error of the heading with its sign: a heading that is too large has a positive one.
    gyro_bias, accel_bias : ndarray, (3,), rad/s and m/s², optional
        Where the method tells them, body axes: reading less truth.
    gyro_bias_sd, accel_bias_sd : ndarray, (3,), optional
    heading_given : bool
        Whether the heading owes nothing to the gyros: it was stated, or is that of a course.
    measured_latitude_deg, measured_latitude_sd_deg : float, deg, optional
        Where the method tells it without the site's: from gravity and the Earth's rate.
    velocity : ndarray, (3,), m/s, optional
        North, east, down, where the method tells it.
    joint : ndarray, (39, 39), optional
        Covariance of the errors of velocity, of the rotation as above, of gyros and accelerometers,
        SI, and of `by_input`, where the method tells how they go together: with a bias that is not
        known an attitude errs the way the bias turned it. Errors are computed less true, those of
        the sensors what they still read too much: bias less estimate.
    by_input : ndarray, (27,), optional
        Where the method tells it, errors in proportion to what is sensed above the means of the
        record, at which the biases are: elements (i, j) of what axis i reads too much by input j,
        nine of gyros by rates, nine of gyros by forces, nine of accelerometers by forces.
    findings : tuple of Finding
        Assumptions that do not hold, and what the sensors cannot tell.
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

    def sd_deg_after(self, seconds: float) -> Array:
        """Standard deviations of roll, pitch and heading when the gyros have carried them on.

        Parameters
        ----------
        seconds : float, s

        Returns
        -------
        ndarray, (3,), deg
            With what an unknown bias of the gyros turns meanwhile, where the method tells of it;
            else those of now.
        """
        if self.joint is None:
            return self.sd_deg
        carry = np.zeros((3, len(self.joint)))
        carry[:, 3:6] = np.eye(3)
        carry[:, 6:9] = rotation.dcm_from_quaternion(self.q_nb) * seconds
        return euler_sd(self.roll_pitch_heading, carry @ self.joint @ carry.T)


# Where a body stands while it is aligned.


@dataclass(frozen=True)
class Site:
    """A place on the Earth.

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
        A latitude beyond 90 deg, a longitude of more than a turn, or no finite number.
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


# What every coarse alignment is: a method with options that makes an attitude of a record.


@dataclass(frozen=True)
class CoarseAlignment(ABC):
    """A way to find the attitude from the sensors' outputs; it holds no state of its own."""

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
            The record cannot give the attitude: the message says what is in the way.
        """
