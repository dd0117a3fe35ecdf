"""Position between rests by dead reckoning, as a measure of an attitude.

Between two rests the specific force, turned by the attitude of a run and freed of gravity, is
integrated twice. At the second rest the velocity should be zero: what is left of it is an error
that needs no reference at all. A wrong tilt ``delta`` leaks ``g sin(delta)`` of gravity into the
horizontal, so that position reacts to attitude with the square of time, and to a gyro's bias with
the cube.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import DataError
from strapdown.evaluation.differences import attitude_at
from strapdown.results.rests import RestStretch
from strapdown.results.runs import AttitudeRun
from strapdown.tables import ACCEL, QUATERNION

Array = NDArray[np.float64]

__all__ = ["Leg", "dead_reckon", "growth_laws"]


@dataclass(frozen=True)
class Leg:
    """Velocity and position from one rest to the next.

    Attributes
    ----------
    time : ndarray, (n,), s
        From the end of the first rest to the start of the second.
    velocity, position : ndarray, (n, 3), m/s and m
        From zero, along the axes of the run's local level.
    velocity_corrected, position_corrected : ndarray, (n, 3)
        With a velocity taken off that grows in proportion to time and makes the last one zero:
        right for an error of acceleration that is constant in the local level.
    gravity : float, m/s²
    velocity_by_bias, position_by_bias : ndarray, (3, 6)
        Change at the end, for each unit of the biases of accelerometers (m/s²) and gyros
        (rad/s).
    velocity_by_tilt, position_by_tilt : ndarray, (3, 2)
        For each rad of an initial tilt about north and east.
    """

    time: Array
    velocity: Array
    position: Array
    velocity_corrected: Array
    position_corrected: Array
    gravity: float
    velocity_by_bias: Array
    position_by_bias: Array
    velocity_by_tilt: Array
    position_by_tilt: Array

    @property
    def seconds(self) -> float:
        """Length of the leg in s."""
        return float(self.time[-1] - self.time[0])


def dead_reckon(
    run: AttitudeRun,
    imu: pd.DataFrame,
    first: RestStretch,
    second: RestStretch,
    *,
    gravity: float | None = None,
    levelled: bool = True,
) -> Leg:
    """Reckon velocity and position from one rest to the next.

    Parameters
    ----------
    run : AttitudeRun
    imu : DataFrame
        The Imu table that the run used, with acceleration.
    first, second : RestStretch
        One after the other.
    gravity : float, m/s², optional
        What is taken off along the vertical; the length of the mean specific force at the
        first rest if not given, which takes a part of the accelerometers' bias with it.
    levelled : bool
        The run was levelled with these accelerometers where it begins: their biases then tilt
        the start, so that they cancel as long as the body keeps that pose.

    Returns
    -------
    Leg
        Specific force at the stamp is taken to change in proportion to time between two
        samples, after it was turned; a mean is turned by the mean of the matrices at both ends
        of its interval. Both are right to the second order of the step.

    Raises
    ------
    DataError
        There is no acceleration, the second rest does not follow the first, or the run does
        not cover them.
    """
    if not set(ACCEL) <= set(imu.columns):
        raise DataError(
            "evaluation.position-needs-acceleration-log-none",
            file=imu.attrs.get("source"),
            quantity="accel",
        )
    stamps = imu.index.to_numpy(dtype=np.float64)
    a, b = (int(np.searchsorted(stamps, t)) for t in (first.end, second.start))
    begin = float(run.attitude.index[0])
    if b <= a or first.end < begin or second.start > float(run.attitude.index[-1]):
        raise DataError(
            "evaluation.no-stretch-rest-ends-starts",
            file=imu.attrs.get("source"),
            quantity="rest",
            end=first.end,
            start=second.start,
            begin=begin,
        )
    time = stamps[a : b + 1]
    force = imu[ACCEL].to_numpy(dtype=np.float64)[a : b + 1]
    g = _gravity(first) if gravity is None else gravity
    turn = rotation.dcm_from_quaternion(attitude_at(run.attitude, time))
    steps = _Steps(time, turn, force, mean=imu.attrs["sampling"] == "mean")
    down = np.array([0.0, 0.0, 1.0])
    velocity, position = steps.twice(steps.force_n + g * down)
    by_error = _sensitivities(run, time, steps, g, gravity is None, levelled)
    share = ((time - time[0]) / (time[-1] - time[0]))[:, None]
    elapsed = (time - time[0])[:, None]
    return Leg(
        time,
        velocity,
        position,
        velocity - velocity[-1] * share,
        position - velocity[-1] * 0.5 * share * elapsed,
        g,
        *by_error,
    )


def _gravity(rest: RestStretch) -> float:
    if rest.accel_mean is None:
        return STANDARD_GRAVITY
    return float(np.sqrt(np.square(rest.accel_mean).sum()))


class _Steps:
    """The steps of a leg: quantities at both ends of each, and their integrals."""

    def __init__(self, time: Array, turn: Array, force: Array, *, mean: bool) -> None:
        self.dt = np.diff(time)[:, None]
        if mean:
            half = 0.5 * (turn[:-1] + turn[1:])
            self.turn = np.stack([half, half])
            through = np.einsum("kij,kj->ki", half, force[1:])
            self.force_n = np.stack([through, through])
        else:
            self.turn = np.stack([turn[:-1], turn[1:]])
            through = np.einsum("kij,kj->ki", turn, force)
            self.force_n = np.stack([through[:-1], through[1:]])

    def once(self, rate: Array) -> Array:
        """Integral of what has these values at both ends of each step, from zero."""
        steps = 0.5 * (rate[0] + rate[1]) * self.dt
        return np.vstack([np.zeros(steps.shape[1]), np.cumsum(steps, axis=0)])

    def twice(self, rate: Array) -> tuple[Array, Array]:
        """Integral, and integral of the integral."""
        first = self.once(rate)
        steps = first[:-1] * self.dt + (2.0 * rate[0] + rate[1]) * self.dt**2 / 6.0
        return first, np.vstack([np.zeros(steps.shape[1]), np.cumsum(steps, axis=0)])


def _sensitivities(
    run: AttitudeRun, time: Array, steps: _Steps, g: float, gravity_of_rest: bool, levelled: bool
) -> tuple[Array, Array, Array, Array]:
    """First order: velocity and position at the end by the biases, and by an initial tilt.

    With ``C_est = (1 + [psi x]) C`` the acceleration is off by ``C b_a + psi x f_n``, and psi
    is what the start was off plus the integral of ``C b_g``.
    """
    n, seconds = len(time) - 1, float(time[-1] - time[0])
    by_psi = -rotation.cross_matrix(steps.force_n)  # (2, n, 3, 3): acceleration by psi
    velocity_psi, position_psi = (v[-1].reshape(3, 3) for v in steps.twice(by_psi.reshape(2, n, 9)))
    velocity_a, position_a = (v[-1].reshape(3, 3) for v in steps.twice(steps.turn.reshape(2, n, 9)))
    if levelled:
        start = rotation.dcm_from_quaternion(run.attitude[QUATERNION].to_numpy()[0])
        # psi x (0, 0, -g) takes back the horizontal part of C b_a.
        tilt = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]) @ start / g
        velocity_a = velocity_a + velocity_psi @ tilt
        position_a = position_a + position_psi @ tilt
    if gravity_of_rest:
        lost = np.zeros((3, 3))
        lost[2] = steps.turn[0, 0][2]
        velocity_a = velocity_a - lost * seconds
        position_a = position_a - lost * (0.5 * seconds**2)
    psi_g = _turned(run.attitude, float(time[0])) + steps.once(steps.turn.reshape(2, n, 9)).reshape(
        -1, 3, 3
    )
    rate = np.stack([by_psi[0] @ psi_g[:-1], by_psi[1] @ psi_g[1:]]).reshape(2, n, 9)
    velocity_g, position_g = (v[-1].reshape(3, 3) for v in steps.twice(rate))
    return (
        np.hstack([velocity_a, velocity_g]),
        np.hstack([position_a, position_g]),
        velocity_psi[:, :2],
        position_psi[:, :2],
    )


def _turned(attitude: pd.DataFrame, until: float) -> Array:
    """Integral of ``C_nb`` from the start of a run: what a gyro's bias has turned by then."""
    stamps = attitude.index.to_numpy(dtype=np.float64)
    inside = stamps < until
    time = np.append(stamps[inside], until)
    if len(time) < 2:
        return np.zeros((3, 3))
    q = np.vstack([attitude[QUATERNION].to_numpy()[inside], attitude_at(attitude, [until])])
    turn = rotation.dcm_from_quaternion(q)
    return np.asarray(np.trapezoid(turn, time, axis=0))


def growth_laws(
    seconds: float, *, accel_error: float, tilt_rate: float, gravity: float = STANDARD_GRAVITY
) -> tuple[float, float]:
    """How far constant errors carry a position that is not corrected at the end.

    Parameters
    ----------
    seconds : float, s
    accel_error : float, m/s²
        Constant in the local level.
    tilt_rate : float, rad/s
        Rate at which a horizontal axis drifts.
    gravity : float, m/s²

    Returns
    -------
    by_accel, by_tilt : float, m
        ``accel_error t²/2`` and ``g tilt_rate t³/6`` (Alexiev 2021, who leaves out g). Where
        the velocity is brought to zero in proportion to time, nothing is left of the first,
        and of the second half, with the other sign: ``g tilt_rate (t³/6 - t³/4)``.
    """
    return 0.5 * accel_error * seconds**2, gravity * tilt_rate * seconds**3 / 6.0
