"""The biases of a sensor as states, of what its data sheet leaves unknown."""

from __future__ import annotations

import math
from collections.abc import Callable

from strapdown.estimation.sensor_blocks import (
    accel_bias,
    accel_drift,
    gyro_bias,
    gyro_drift,
    random_walk,
)
from strapdown.estimation.sensor_states import SensorStates
from strapdown.sensors.imu_uncertainty import BiasDrift, ImuUncertainty
from strapdown.sensors.triad_errors import Triad, triad_of
from strapdown.sensors.triad_uncertainty import TriadUncertainty

__all__ = ["standard_states"]


def standard_states(sensors: ImuUncertainty, *, separate: bool = True) -> tuple[SensorStates, ...]:
    """Return the biases of gyros and accelerometers as states.

    A bias is a constant of the record and a Gauss-Markov process within it, which is more than
    three states can hold: their sum is not Markov.

    Parameters
    ----------
    sensors : ImuUncertainty
    separate : bool
        True: the two as they are, ``gyro_bias gyro_drift accel_bias accel_drift``, twelve states
        where both triads drift (a triad that does not has no drift block). False: their sum as a
        random walk, ``gyro_bias accel_bias``, six states as in the papers' models; with
        ``sd² = bias² + 2 drift²`` and ``drive² = 2 drift² / correlation_time`` its covariance
        over any instants exceeds the true one by a positive semidefinite matrix, and with less
        of either it does not, so that a filter's P is a bound for what its estimates do.

    Returns
    -------
    tuple of SensorStates

    Notes
    -----
    Of the bound: for unit correlation time and variance, functions on [0, T] have in the space of
    the process the norm ``(f(0)² + f(T)² + int f'² + f² dt) / 2`` and in that of the walk
    ``f(0)²/k + int f'² dt / drive²``; a kernel exceeds another if its norm is never larger
    (Aronszajn 1950, sec. 7), which for all f and T asks for ``k >= 2`` and ``drive² >= 2``.
    """
    return (
        *_of_triad(sensors.gyro, sensors.gyro_drift, gyro_bias, gyro_drift, separate),
        *_of_triad(sensors.accel, sensors.accel_drift, accel_bias, accel_drift, separate),
    )


def _of_triad(
    constant: TriadUncertainty,
    drift: BiasDrift,
    bias_block: Callable[[Triad], SensorStates],
    drift_block: Callable[[Triad, float], SensorStates],
    separate: bool,
) -> list[SensorStates]:
    sd, time = constant.axis("bias"), drift.correlation_time
    if math.isinf(time) or not any(drift.triad):
        # A drift without end is a constant, too.
        return [bias_block(_both(sd, drift.triad))]
    if separate:
        return [bias_block(sd), drift_block(drift.triad, time)]
    root = math.sqrt(2.0)
    twice = triad_of(root * x for x in drift.triad)
    bound = random_walk(bias_block(_both(sd, twice)), triad_of(x / math.sqrt(time) for x in twice))
    return [bound]


def _both(a: Triad, b: Triad) -> Triad:
    return triad_of(math.hypot(x, y) for x, y in zip(a, b, strict=True))
