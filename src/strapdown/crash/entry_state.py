"""A vehicle's state before it is struck, with its covariance and what it was made of."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.crash.angle_rates import angles_sd
from strapdown.errors import Finding
from strapdown.nav_state import NavState

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

#: Places in the covariance: m north, east, down; m/s north, east, down; rad about north, east,
#: down; rad/s and m/s² of the biases, forward, right, down.
POSITION, VELOCITY, ATTITUDE = slice(0, 3), slice(3, 6), slice(6, 9)
GYRO_BIAS, ACCEL_BIAS = slice(9, 12), slice(12, 15)
STATES = 15


@dataclass(frozen=True, eq=False)
class EntryState:
    """Place, velocity, attitude and biases at an instant, from fixes before it.

    Attributes
    ----------
    state : NavState
        Of the vehicle's reference point, at a sample of the Imu table.
    gyro_bias : triple, rad/s
    accel_bias : triple, m/s²
        What the Imu table reads too much at its mean rate and mean specific force over the
        window: with what scale, misalignment and g-sensitivity make of these, of which gravity
        is most. To be taken off the table.
    covariance : ndarray, (15, 15)
        Of `POSITION`, `VELOCITY`, `ATTITUDE`, `GYRO_BIAS`, `ACCEL_BIAS`. The attitude's error is
        the rotation vector phi about north, east, down of ``C_true = exp([phi x]) C_estimate``.
    mean_rate, mean_specific_force : triple, rad/s, m/s²
        At which the biases hold.
    fixes : DataFrame
        Every fix from the beginning of the window on, by its stamp: ``used``; ``why`` not, or
        why with less weight; ``position_weight``, ``velocity_weight`` from 0 to 1; and
        ``position_misfit``, ``velocity_misfit``: how far it is from what all others together
        say, in standard deviations of that difference (root of the squared Mahalanobis
        distance; NaN where it was not measured or used).
    chi_square : float
        Of the misfit of all fixes that were used, with their weights, and the priors.
    degrees_of_freedom : int
    iterations : int
    findings : tuple of Finding
    """

    state: NavState
    gyro_bias: Triple
    accel_bias: Triple
    covariance: Array = field(repr=False)
    mean_rate: Triple
    mean_specific_force: Triple
    fixes: pd.DataFrame = field(repr=False)
    chi_square: float
    degrees_of_freedom: int
    iterations: int
    findings: tuple[Finding, ...] = ()

    @property
    def sd(self) -> Array:
        """Standard deviations of the 15 states, (15,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def speed(self) -> float:
        """Length of the velocity, m/s."""
        return float(np.linalg.norm(self.state.v_n))

    @property
    def speed_sd(self) -> float:
        """Standard deviation of the speed, m/s; at a stand that of any direction at most."""
        block = self.covariance[VELOCITY, VELOCITY]
        if self.speed == 0.0:
            return float(np.sqrt(np.linalg.eigvalsh(block)[-1]))
        along = self.state.v_n / self.speed
        return float(np.sqrt(along @ block @ along))

    @property
    def course_sd_deg(self) -> float:
        """Standard deviation of the course, deg; infinite at a stand."""
        north, east, _ = self.state.v_n
        level = math.hypot(north, east)
        if level == 0.0:
            return math.inf
        across = np.array([-east, north, 0.0]) / level
        return math.degrees(
            math.sqrt(across @ self.covariance[VELOCITY, VELOCITY] @ across) / level
        )

    @property
    def roll_pitch_heading(self) -> Array:
        """Attitude, (3,), deg."""
        return self.state.roll_pitch_heading

    @property
    def roll_pitch_heading_sd(self) -> Array:
        """Standard deviations of these angles to first order, (3,), deg; not near a pitch of 90."""
        block = self.covariance[ATTITUDE, ATTITUDE]
        return np.asarray(angles_sd(self.state.roll_pitch_heading[None], block[None])[0])

    def with_biases_off(self, imu: pd.DataFrame) -> pd.DataFrame:
        """Return an Imu table without the biases that were found."""
        return biases_off(imu, np.array(self.gyro_bias), np.array(self.accel_bias))


def biases_off(imu: pd.DataFrame, gyro_bias: Array, accel_bias: Array) -> pd.DataFrame:
    """Return a copy of an Imu table less biases in rad/s and m/s²."""
    from strapdown.tables import ACCEL, GYRO

    out = imu[[*GYRO, *ACCEL]] - np.concatenate([gyro_bias, accel_bias])
    out.attrs = dict(imu.attrs)
    return out


def rotated(q_nb: Array, phi: Array) -> Array:
    """Attitude that is turned by a rotation vector in local level axes."""
    return rotation.compose(rotation.quaternion_from_rotation_vector(phi), q_nb)
