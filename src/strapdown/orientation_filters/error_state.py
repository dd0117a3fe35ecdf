"""The error-state orientation filter: attitude, gyro bias and velocity, with a covariance."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, hypot, radians, sin

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown._kernels import orientation as kernel
from strapdown.attitude_algorithms import Quaternion
from strapdown.attitude_algorithms.algorithm import history_of_samples
from strapdown.constants import Array
from strapdown.orientation_filters.filter import FilterRun, OrientationEstimator
from strapdown.tables import ACCEL, GYRO

#: Windows over which changes of velocity are looked at: of a slow body, and within it of one that
#: is carried, s; of each at most so many, and the quantile over them.
SLOW_WINDOW, FAST_WINDOW, MOST_WINDOWS, QUANTILE = 10.0, 3.0, 400, 0.9
#: Time between the points of a window at least, s.
POINT = 0.05
#: Standard deviation of a velocity over that of its changes within 10 s, on a straight line less.
OF_CHANGE = 5.0
#: Velocity of what is carried in hand, m/s.
CARRIED = 0.3
#: Velocity from which the body is one that walks or drives, m/s; below, the filter sees it itself.
WALKS = 1.0


@dataclass(frozen=True)
class ErrorState(OrientationEstimator):
    """Error-state Kalman filter: a carried body has a bounded velocity.

    Dead-reckoned in the level frame, the specific force gives a velocity that a tilt error makes
    grow. A velocity of zero, with the standard deviation and correlation time of the body's true
    velocity, is its measurement: accelerations average out over the time that the gyros allow,
    and the covariance says what remains. The variance of the true velocity is that of `velocity`,
    and what the specific force shows within seconds. While stationary, rate and velocity are
    measured as zero.

    The heading of the field is a measurement whose noise grows with the deviation of norm and dip
    from their usual values. It corrects heading and gyro bias, never roll and pitch.

    The covariance is propagated and updated once a block, by the sums of its samples.

    Parameters
    ----------
    velocity : float, m/s
        Standard deviation of the velocity of the body, each axis: 0.3 in hand; 10 to 30 in a
        vehicle. 0: that of what is carried in hand, unless a whole record shows a larger one
        (`of_motion`).
    bias : float, deg/s
        Standard deviation of the gyro bias at the start, each axis.
    noise : float, deg/s/√Hz
        Gyro noise density, with what vibration adds.
    field : float, deg
        Standard deviation of the constant error of the magnetic heading: local field, hard iron.
    block : float, s
        Length of a block.

    declination : float, deg
        Of magnetic north, east positive: added to headings found with a magnetometer.

    Notes
    -----
    Error state in the level frame with the multiplicative attitude error of Markley, J. Guidance,
    Control, Dynamics 26 (2003) 311; the average of accelerations in a nearly inertial frame is the
    idea of Laidig and Seel, Information Fusion 91 (2023) 187, here with a model of the velocity
    instead of a low-pass filter. White noise with the density ``2 sd² T`` replaces a velocity of
    correlation time T, which is exact below 1/T (Maybeck, Stochastic Models 1, 1979, 4.11).
    """

    name = "error-state"
    title = "Error-state filter"
    source = "Markley (2003), Laidig and Seel (2023)"
    summary = "attitude, gyro bias and their covariance; a bounded velocity; a disturbed field"
    size = kernel.STATE
    row = kernel.ROW
    advance_kernel = staticmethod(kernel.error_state_advance)
    update_kernel = staticmethod(kernel.error_state_update)
    may_be_zero = ("velocity",)

    velocity: float = 0.0
    bias: float = 1.0
    noise: float = 0.02
    field: float = 4.0
    block: float = 0.08

    @property
    def _velocity(self) -> float:
        """The velocity that is used, m/s."""
        return self.velocity or CARRIED

    def kernel_options(self) -> tuple[float, ...]:
        """Return velocity variance, bias prior, gyro noise density and block, SI and radians."""
        return self._velocity**2, radians(self.bias), radians(self.noise) ** 2, self.block

    def of_motion(self, imu: pd.DataFrame, run: FilterRun) -> ErrorState:
        """Take the velocity from its slow changes, as of a walker or a vehicle.

        The filter sees the fast ones by itself.
        """
        if self.velocity:
            return self
        found = float(f"{OF_CHANGE * slow_velocity(imu, run):.2g}")
        return replace(self, velocity=found) if found > WALKS else self

    def with_heading(self, declination: float, sd: float) -> ErrorState:
        """As in the base; `sd` widens the constant error of the magnetic heading."""
        # As its label says it, so that the label is the whole configuration.
        field = float(f"{hypot(self.field, sd):.3g}")
        return replace(super().with_heading(declination, sd), field=field)

    def begin_state(self, record: Array, given: bool) -> None:
        """Set the covariance of the start."""
        p = record[kernel.P : kernel.P + kernel.N**2].reshape(kernel.N, kernel.N)
        tilt = kernel.GIVEN_SD if given else kernel.UNKNOWN
        # Without a magnetometer the heading is counted from the start.
        p[np.diag_indices(kernel.N)] = (
            [tilt**2] * 2
            + [0.0]
            + [radians(self.bias) ** 2] * 3
            + [max(self._velocity**2, 0.25)] * 2
            + [kernel.ACCEL_BIAS_SD**2] * 3
        )
        record[kernel.POWER] = 0.25

    def row_of(self, record: Array) -> Array:
        """Return quaternion and covariance of a record, as in a row of the history."""
        p = record[kernel.P : kernel.P + kernel.N**2].reshape(kernel.N, kernel.N)
        return np.concatenate([super().row_of(record), p[np.triu_indices(3)]])

    def covariance(self, history: Array, record: Array) -> Array:
        """Covariance of the attitude error in north-east-down, (n, 3, 3), rad²."""
        out = history[:, [4, 5, 6, 5, 7, 8, 6, 8, 9]].reshape(-1, 3, 3)
        if record[kernel.HEADED] != 0.0:
            out[:, 2, 2] += radians(self.field) ** 2
            if self.declination:
                c, s = cos(radians(self.declination)), sin(radians(self.declination))
                turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
                out = turn @ out @ turn.T
        return out

    def bias_sd(self, record: Array) -> Array:
        """Return the standard deviation of the gyro bias, (3,), rad/s."""
        p = record[kernel.P : kernel.P + kernel.N**2].reshape(kernel.N, kernel.N)
        return np.asarray(np.sqrt(np.diag(p)[3:6]))


def slow_velocity(imu: pd.DataFrame, run: FilterRun) -> float:
    """Horizontal velocity that changes within 10 s and not within 3 s, m/s, root mean square.

    A tilt, which is as good as constant within a window, makes a velocity grow along a straight
    line; that line is taken off. Gyros rotate the specific force within a window, and the first run
    levels its start. Windows with a gap do not count; 0 without another.
    """
    time = imu.index.to_numpy(dtype=np.float64)
    force = imu[ACCEL].ffill().to_numpy(dtype=np.float64)
    rate = imu[GYRO].to_numpy(dtype=np.float64) - run.bias
    mean = imu.attrs.get("sampling") == "mean"
    q = history_of_samples(Quaternion(), time, rate, mean, [1.0, 0.0, 0.0, 0.0])
    step = np.diff(time, prepend=time[0])
    pushed = np.cumsum(rotation.rotate(q, force) * step[:, None], axis=0)
    gaps = step > max(kernel.GAP_STEPS * float(np.median(step)), kernel.GAP_S)
    lost = np.cumsum(gaps)
    each = max(1, int(POINT / max(float(np.median(step)), 1e-6)))
    time, pushed, lost = time[::each], pushed[::each], lost[::each]
    levels = rotation.dcm_from_quaternion(run.q_nb[::each])
    levels = levels @ rotation.dcm_from_quaternion(q[::each]).transpose(0, 2, 1)
    sizes = []
    for length in (SLOW_WINDOW, FAST_WINDOW):
        last = time[-1] - length
        count = int(2.0 * (last - time[0]) / length) + 1 if last >= time[0] else 0
        found = []
        for begin in np.linspace(time[0], last, min(count, MOST_WINDOWS)):
            i, j = np.searchsorted(time, [begin, begin + length])
            if j - i < 8 or lost[j - 1] > lost[i]:
                continue
            velocity = (pushed[i:j] - pushed[i:j].mean(axis=0)) @ levels[i, :2].T
            line = time[i:j] - time[i:j].mean()
            left = velocity - np.outer(line, line @ velocity / (line @ line))
            found.append(float(np.sqrt(np.mean(left * left))))
        sizes.append(np.quantile(found, QUANTILE) if np.isfinite(found).all() and found else 0.0)
    return float(np.sqrt(max(sizes[0] ** 2 - sizes[1] ** 2, 0.0)))
