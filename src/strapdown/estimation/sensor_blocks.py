"""The errors of sensors that a filter may have as states, each made of its standard deviations.

`ERRORS_OF_SENSORS` lists them. What acts within the sensors is coupled to rate and force as in
`sensors.error_chain`, to first order: the errors are reading less truth, and the rates and forces
that they multiply are the measured ones. What only measurements see (`lever_arm`, `time_offset`,
`mounting`) is coupled to nothing here: the model of a measurement looks for its place by its name.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import ConfigError
from strapdown.estimation.sensor_states import COUPLING, SensorStates
from strapdown.estimation.states import StateBlock
from strapdown.sensors.triad_errors import TriadLike
from strapdown.tables.checks import is_number

__all__ = [
    "ERRORS_OF_SENSORS",
    "accel_bias",
    "accel_drift",
    "accel_misalignment",
    "accel_scale",
    "g_sensitivity",
    "gauss_markov",
    "gyro_bias",
    "gyro_drift",
    "gyro_misalignment",
    "gyro_scale",
    "lever_arm",
    "mounting",
    "random_walk",
    "time_offset",
    "unseen",
]

Array = NDArray[np.float64]

XYZ = ("x", "y", "z")
#: Places of the rates and of the forces in a coupling.
RATE, FORCE = 1, 4
#: ``xy`` is the part of the input along y that the sensor of x feels.
CROSS_TERMS = ("xy", "xz", "yx", "yz", "zx", "zy")
ALL_TERMS = tuple(i + j for i in XYZ for j in XYZ)


def gyro_bias(sd: TriadLike) -> SensorStates:
    """Return what the gyros read at rest, constant: three states.

    Parameters
    ----------
    sd : triad, rad/s
        One number for all axes, or three.

    Returns
    -------
    SensorStates

    Raises
    ------
    ConfigError
        A standard deviation is negative or not finite.
    """
    return _bias("gyro_bias", "rad/s", sd)


def accel_bias(sd: TriadLike) -> SensorStates:
    """Return what the accelerometers read without force, constant; `sd` in m/s²."""
    return _bias("accel_bias", "m/s²", sd)


def gyro_drift(sd: TriadLike, correlation_time: float) -> SensorStates:
    """Return what of a bias of gyros changes within a record: stationary Gauss-Markov.

    Parameters
    ----------
    sd : triad, rad/s
    correlation_time : float, s

    Returns
    -------
    SensorStates
    """
    return gauss_markov(_bias("gyro_drift", "rad/s", sd), correlation_time)


def accel_drift(sd: TriadLike, correlation_time: float) -> SensorStates:
    """Return what of a bias of accelerometers changes within a record; `sd` in m/s²."""
    return gauss_markov(_bias("accel_drift", "m/s²", sd), correlation_time)


def gyro_scale(sd: TriadLike) -> SensorStates:
    """Return relative errors of the scale factors of gyros; `sd` without unit."""
    return _by_terms("gyro_scale", "1", sd, ("xx", "yy", "zz"), RATE, XYZ)


def accel_scale(sd: TriadLike) -> SensorStates:
    """Return relative errors of the scale factors of accelerometers; `sd` without unit."""
    return _by_terms("accel_scale", "1", sd, ("xx", "yy", "zz"), FORCE, XYZ)


def gyro_misalignment(sd: TriadLike, terms: Sequence[str] = CROSS_TERMS) -> SensorStates:
    """Return the directions of gyros.

    Parameters
    ----------
    sd : triad, rad
        Of the terms of the sensors of x, of y and of z.
    terms : sequence of str
        Of ``xy xz yx yz zx zy``: ``xy`` is the part of the rate about y that the gyro of x feels.
        Six, where the body axes are given by something else; ``("yx", "zx", "zy")`` where they
        are those of this triad: x along its x, y in the plane of its x and y.

    Returns
    -------
    SensorStates

    Raises
    ------
    ConfigError
        A standard deviation is negative or not finite, or there is no such term.
    """
    return _by_terms("gyro_misalignment", "rad", sd, _known(terms), RATE)


def accel_misalignment(sd: TriadLike, terms: Sequence[str] = CROSS_TERMS) -> SensorStates:
    """Return the directions of accelerometers, as `gyro_misalignment`; `sd` in rad."""
    return _by_terms("accel_misalignment", "rad", sd, _known(terms), FORCE)


def g_sensitivity(sd: TriadLike) -> SensorStates:
    """Return what force does to gyros: nine states, ``xy`` of the gyro of x by the force along y.

    Parameters
    ----------
    sd : triad, (rad/s)/(m/s²)
        Of the terms of the gyros of x, of y and of z.

    Returns
    -------
    SensorStates
    """
    return _by_terms("g_sensitivity", "(rad/s)/(m/s²)", sd, ALL_TERMS, FORCE, sensor="gyro")


def lever_arm(sd: TriadLike) -> SensorStates:
    """Return the assumed place of an antenna in body axes less the true one; `sd` in m."""
    return unseen("lever_arm", XYZ, "m", _numbers(sd, "lever_arm"))


def time_offset(sd: float) -> SensorStates:
    """Return the stamps of an aid less the time of the inertial sensors; `sd` in s."""
    if not is_number(sd):
        raise ConfigError("estimation.time-offset-sd-no-number", quantity="time_offset", sd=str(sd))
    return unseen("time_offset", ("t",), "s", _numbers(sd, "time_offset")[:1])


def mounting(sd: TriadLike) -> SensorStates:
    """Return the rotation vector m of a mounting, ``C_assumed = exp([m x]) C_true``; `sd` in rad.

    In the axes into which C turns.
    """
    return unseen("mounting", XYZ, "rad", _numbers(sd, "mounting"))


def unseen(name: str, labels: Sequence[str], unit: str, sd: Any) -> SensorStates:
    """Return constants that act on no inertial sensor, as those of an aid.

    Parameters
    ----------
    name : str
        Of the block.
    labels : sequence of str
        One a state.
    unit : str
    sd : float or sequence of float
        One number for all, or one a state.

    Returns
    -------
    SensorStates

    Raises
    ------
    ConfigError
        A standard deviation is negative or not finite.
    """
    k = len(labels)
    nothing = np.zeros((COUPLING, 3, k))
    return SensorStates(
        StateBlock(name, tuple(labels), unit),
        _as_many(sd, k, name),
        nothing,
        nothing.copy(),
        math.inf,
        np.zeros(k),
    )


def random_walk(states: SensorStates, drive: TriadLike) -> SensorStates:
    """Return states that walk from where they are at the start.

    Parameters
    ----------
    states : SensorStates
    drive : float or triad, unit/√s
        One number for all, or one a state.

    Returns
    -------
    SensorStates
        With a variance of ``sd² + drive² t``.
    """
    name, k = states.block.name, len(states.block)
    each = _as_many(drive, k, name)
    return replace(states, correlation_time=math.inf, drive=each)


def gauss_markov(states: SensorStates, correlation_time: float) -> SensorStates:
    """Return states that change as stationary Gauss-Markov processes.

    Parameters
    ----------
    states : SensorStates
        Whose `sd` is that of the processes at every instant.
    correlation_time : float, s
        Autocorrelation ``exp(-|t| / correlation_time)``.

    Returns
    -------
    SensorStates
        Driven by ``sd √(2 / correlation_time)``.

    Raises
    ------
    ConfigError
        The time is no number of seconds above zero.
    """
    if not is_number(correlation_time) or not 0.0 < correlation_time < math.inf:
        raise ConfigError(
            "estimation.no-time-over-changes",
            quantity="correlation_time",
            correlation_time=correlation_time,
            name=states.block.name,
        )
    time = float(correlation_time)
    return replace(states, correlation_time=time, drive=states.sd * math.sqrt(2.0 / time))


#: Errors of sensors by the names of their blocks. Each is made of standard deviations; those that
#: drift of a correlation time, too.
ERRORS_OF_SENSORS: dict[str, Callable[..., SensorStates]] = {
    "gyro_bias": gyro_bias,
    "accel_bias": accel_bias,
    "gyro_drift": gyro_drift,
    "accel_drift": accel_drift,
    "gyro_scale": gyro_scale,
    "accel_scale": accel_scale,
    "gyro_misalignment": gyro_misalignment,
    "accel_misalignment": accel_misalignment,
    "g_sensitivity": g_sensitivity,
    "lever_arm": lever_arm,
    "time_offset": time_offset,
    "mounting": mounting,
}


def _bias(name: str, unit: str, sd: TriadLike) -> SensorStates:
    states = unseen(name, XYZ, unit, _numbers(sd, name))
    (states.gyro if unit == "rad/s" else states.accel)[0] = np.eye(3)
    return states


def _by_terms(
    name: str,
    unit: str,
    sd: TriadLike,
    terms: Sequence[str],
    source: int,
    labels: Sequence[str] | None = None,
    sensor: str = "",
) -> SensorStates:
    """States that act on one axis by the rate or force (`source`) of one axis each."""
    by_axis = _numbers(sd, name)
    sds = np.array([by_axis[XYZ.index(term[0])] for term in terms])
    states = unseen(name, tuple(labels or terms), unit, sds)
    on_gyros = sensor == "gyro" or (not sensor and source == RATE)
    coupling = states.gyro if on_gyros else states.accel
    for k, term in enumerate(terms):
        coupling[source + XYZ.index(term[1]), XYZ.index(term[0]), k] = 1.0
    return states


def _known(terms: Sequence[str]) -> tuple[str, ...]:
    wrong = [str(term) for term in terms if term not in CROSS_TERMS]
    if isinstance(terms, str) or wrong or not terms or len(set(terms)) != len(terms):
        raise ConfigError(
            "estimation.no-terms-misalignment" if wrong else "estimation.no-terms-misalignment-2",
            quantity="terms",
            terms=terms,
            word=wrong[0],
            known=CROSS_TERMS,
        )
    return tuple(terms)


def _numbers(given: TriadLike, name: str) -> Array:
    return _as_many(given, 3, name)


def _as_many(given: Any, k: int, name: str) -> Array:
    numbers = [given] * k if is_number(given) else given
    if (
        not isinstance(numbers, list | tuple | np.ndarray)
        or len(numbers) != k
        or not all(is_number(x) and 0.0 <= x < math.inf for x in numbers)
    ):
        raise ConfigError("estimation.sd-out-of-range", quantity=name, sd=str(given), count=k)
    return np.array([float(x) for x in numbers])
