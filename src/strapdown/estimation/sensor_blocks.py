"""Sensor errors that a filter may have as states, each made from its standard deviations.

`ERRORS_OF_SENSORS` lists them. Errors within the sensors are coupled to rate and force as in
`sensors.error_chain`, to first order: the errors are reading − truth, and the rates and forces
that they multiply are the measured ones. Errors that only measurements see (`lever_arm`,
`time_offset`, `mounting`) are not coupled here: the model of a measurement finds their position in
the state vector by name.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import ConfigError, check_choice
from strapdown.estimation.sensor_states import COUPLING, SensorStates, StateBlock
from strapdown.sensors.triad_errors import Triad, TriadLike, triad_of
from strapdown.sensors.uncertainty import BiasDrift, ImuUncertainty, TriadUncertainty
from strapdown.tables.checks import is_number

Array = NDArray[np.float64]

XYZ = ("x", "y", "z")
#: Indices of the rates and of the forces in a coupling.
RATE, FORCE = 1, 4
#: ``xy`` is the sensitivity of the sensor of x to the input along y.
CROSS_TERMS = ("xy", "xz", "yx", "yz", "zx", "zy")
ALL_TERMS = tuple(i + j for i in XYZ for j in XYZ)


def gyro_bias(sd: TriadLike) -> SensorStates:
    """Return the constant bias of the gyros: three states.

    `sd` (triad, rad/s): one number for all axes, or three. ConfigError: a standard deviation is
    negative or not finite.
    """
    return _bias("gyro_bias", "rad/s", sd)


def accel_bias(sd: TriadLike) -> SensorStates:
    """Return the constant bias of the accelerometers; `sd` in m/s²."""
    return _bias("accel_bias", "m/s²", sd)


def gyro_drift(sd: TriadLike, correlation_time: float) -> SensorStates:
    """Return the varying part of the gyro bias within a record: stationary Gauss-Markov.

    `sd` (triad, rad/s). `correlation_time` (s).
    """
    return gauss_markov(_bias("gyro_drift", "rad/s", sd), correlation_time)


def accel_drift(sd: TriadLike, correlation_time: float) -> SensorStates:
    """Return the varying part of the accelerometer bias within a record; `sd` in m/s²."""
    return gauss_markov(_bias("accel_drift", "m/s²", sd), correlation_time)


def gyro_scale(sd: TriadLike) -> SensorStates:
    """Return relative errors of the scale factors of gyros; `sd` without unit."""
    return _by_terms("gyro_scale", "1", sd, ("xx", "yy", "zz"), RATE, XYZ)


def accel_scale(sd: TriadLike) -> SensorStates:
    """Return relative errors of the scale factors of accelerometers; `sd` without unit."""
    return _by_terms("accel_scale", "1", sd, ("xx", "yy", "zz"), FORCE, XYZ)


def gyro_misalignment(sd: TriadLike, terms: Sequence[str] = CROSS_TERMS) -> SensorStates:
    """Return the misalignments of gyros.

    `sd` (triad, rad): of the terms of the sensors of x, of y and of z. `terms`: of ``xy xz yx yz zx
    zy``: ``xy`` is the part of the rate about y that the gyro of x feels. Six, where the body axes
    are given by something else; ``("yx", "zx", "zy")`` where they are those of this triad: x along
    its x, y in the plane of its x and y. ConfigError: a standard deviation is negative or not
    finite, or the term does not exist.
    """
    return _by_terms("gyro_misalignment", "rad", sd, _known(terms), RATE)


def accel_misalignment(sd: TriadLike, terms: Sequence[str] = CROSS_TERMS) -> SensorStates:
    """Return the misalignments of accelerometers, as `gyro_misalignment`; `sd` in rad."""
    return _by_terms("accel_misalignment", "rad", sd, _known(terms), FORCE)


def g_sensitivity(sd: TriadLike) -> SensorStates:
    """Return the g-sensitivity of gyros: nine states, ``xy`` of gyro x by the force along y.

    `sd` (triad, (rad/s)/(m/s²)): of the terms of the gyros of x, of y and of z.
    """
    return _by_terms("g_sensitivity", "(rad/s)/(m/s²)", sd, ALL_TERMS, FORCE, sensor="gyro")


def lever_arm(sd: TriadLike) -> SensorStates:
    """Return the error of an antenna's lever arm, body axes, assumed − true; `sd` in m."""
    return unseen("lever_arm", XYZ, "m", _numbers(sd, "lever_arm"))


def time_offset(sd: float) -> SensorStates:
    """Return the time stamps of an aid minus the time of the inertial sensors; `sd` in s."""
    if not is_number(sd):
        raise ConfigError("estimation.time-offset-sd-no-number", quantity="time_offset", sd=str(sd))
    return unseen("time_offset", ("t",), "s", _numbers(sd, "time_offset")[:1])


def mounting(sd: TriadLike) -> SensorStates:
    """Return the rotation vector m of a mounting, ``C_assumed = exp([m x]) C_true``; `sd` in rad.

    In the axes that C maps to.
    """
    return unseen("mounting", XYZ, "rad", _numbers(sd, "mounting"))


def unseen(name: str, labels: Sequence[str], unit: str, sd: Any) -> SensorStates:
    """Return constants without effect on the inertial sensors, as those of an aid.

    `name`: of the block. `labels`: one a state. `sd` (float or sequence of float): one number for
    all, or one a state. ConfigError: a standard deviation is negative or not finite.
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
    """Return random walks.

    `drive` (float or triad, unit/√s): one number for all, or one a state. Returns with a variance
    of ``sd² + drive² t``.
    """
    name, k = states.block.name, len(states.block)
    each = _as_many(drive, k, name)
    return replace(states, correlation_time=math.inf, drive=each)


def gauss_markov(states: SensorStates, correlation_time: float) -> SensorStates:
    """Return stationary Gauss-Markov processes.

    `states`: whose `sd` is that of the processes at every instant. `correlation_time` (s):
    autocorrelation ``exp(-|t| / correlation_time)``. Returns driven by ``sd √(2 /
    correlation_time)``. ConfigError: the time is not a positive number of seconds.
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


#: Sensor errors by the names of their blocks. Each factory takes standard deviations; a drift
#: also takes a correlation time.
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
            word=wrong[0] if wrong else None,
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


# Sensor errors of a stationary body as states of a filter.


def resting_sd(sensors: ImuUncertainty, rate: ArrayLike, force: ArrayLike) -> tuple[Array, Array]:
    """Return the errors of gyros and accelerometers at constant rate and force.

    Scale factors, misalignments and g-sensitivities are then a part of the bias: a rest cannot
    separate them.

    `rate` ((3,), rad/s): mean rate in body axes. `force` ((3,), m/s²): mean specific force in body
    axes. Returns `gyro`, `accel` ((3,), rad/s and m/s²): standard deviations.
    """
    w, f = np.asarray(rate, dtype=np.float64), np.asarray(force, dtype=np.float64)
    sensitivity = np.asarray(sensors.gyro.axis("g_sensitivity")) * math.sqrt(float(f @ f))
    gyro = _resting(sensors.gyro, sensors.gyro_drift, w)
    accel = _resting(sensors.accel, sensors.accel_drift, f)
    return np.sqrt(gyro + sensitivity**2), np.sqrt(accel)


def resting_states(
    sensors: ImuUncertainty, rate: ArrayLike, force: ArrayLike
) -> tuple[SensorStates, SensorStates]:
    """Return the biases of a stationary body as states.

    `sensors`, `rate`, `force`: as `resting_sd`. Returns `gyro_bias`, `accel_bias`: random walks:
    over a time that is short against its correlation time a Gauss-Markov process of deviation s is
    one, with the drive ``s sqrt(2 / correlation time)``.
    """
    gyro, accel = resting_sd(sensors, rate, force)
    return (
        random_walk(gyro_bias(tuple(gyro)), _walk(sensors.gyro_drift)),
        random_walk(accel_bias(tuple(accel)), _walk(sensors.accel_drift)),
    )


def _resting(triad: TriadUncertainty, drift: BiasDrift, value: Array) -> Array:
    """Variance of each axis."""
    constant = np.square(triad.axis("bias")) + np.square(drift.triad)
    return np.asarray(constant + triad.variance_by_input(value))


def _walk(drift: BiasDrift) -> tuple[float, float, float]:
    part = 0.0 if math.isinf(drift.correlation_time) else math.sqrt(2.0 / drift.correlation_time)
    return _both(triad_of(part * x for x in drift.triad), drift.steps)


# Errors of sensors as states by their names, with the sizes that a data sheet states.


#: By name of the block: triad, attribute of its uncertainty, factory of the block, and the key of
#: [sensors.gyro] or [sensors.accel] that states it.
STATED_STATES: dict[str, tuple[str, str, Callable[..., SensorStates], str]] = {
    "gyro_bias": ("gyro", "bias", gyro_bias, "bias_sd_deg_per_h"),
    "accel_bias": ("accel", "bias", accel_bias, "bias_sd_ug"),
    "gyro_drift": ("gyro", "drift", gyro_drift, "bias_instability_deg_per_h, correlation_time_s"),
    "accel_drift": ("accel", "drift", accel_drift, "bias_instability_ug, correlation_time_s"),
    "gyro_scale": ("gyro", "scale", gyro_scale, "scale_sd_ppm"),
    "accel_scale": ("accel", "scale", accel_scale, "scale_sd_ppm"),
    "gyro_misalignment": ("gyro", "misalignment", gyro_misalignment, "misalignment_sd_mrad"),
    "accel_misalignment": ("accel", "misalignment", accel_misalignment, "misalignment_sd_mrad"),
    "g_sensitivity": ("gyro", "g_sensitivity", g_sensitivity, "g_sensitivity_sd_deg_per_h_per_g"),
}


#: Errors in proportion to rate and force: negligible at rest, largest in motion. Unmodeled, 0.1
#: deg/s of a gyro for each g left two thirds of a drive within its 95 % bounds.
MOVING = (
    *("gyro_scale", "accel_scale", "gyro_misalignment", "accel_misalignment"),
    "g_sensitivity",
)


def stated_states(
    sensors: ImuUncertainty, names: Sequence[str] | None = None
) -> tuple[SensorStates, ...]:
    """Return errors of sensors as states.

    `sensors`: standard deviation of each. `names`: of `STATED_STATES`; if not given, biases and
    drifts as `standard_states`, and the scale factors, misalignments and g-sensitivities with a
    stated size: without them the covariance of a body that turns and accelerates is too small. A
    bias that is named without its drift is a random walk that bounds both. ConfigError: a block
    does not exist, one is named twice, or its size is not stated.
    """
    if names is None:
        known = [n for n in MOVING if any(_size(n, sensors))]
        return (*standard_states(sensors), *(_block(n, sensors, {}, known) for n in known))
    bounds = {one.block.name: one for one in standard_states(sensors, separate=False)}
    out = []
    for name in names:
        check_choice(
            "estimation.no-error-sensor-filter-can", STATED_STATES, quantity="states", name=name
        )
        if list(names).count(name) > 1:
            raise ConfigError("estimation.stands-twice", quantity="states", name=name)
        out.append(_block(name, sensors, bounds, names))
    return tuple(out)


def states_that_are_stated(sensors: ImuUncertainty) -> tuple[str, ...]:
    """Return those of `STATED_STATES` with a stated size: all that can be estimated."""
    return tuple(
        name
        for name, (triad, attribute, _, _) in STATED_STATES.items()
        if any(_size(name, sensors))
        and (
            attribute != "drift"
            or math.isfinite(getattr(sensors, f"{triad}_drift").correlation_time)
        )
    )


def _block(
    name: str, sensors: ImuUncertainty, bounds: dict[str, SensorStates], names: Sequence[str]
) -> SensorStates:
    triad, attribute, make, keys = STATED_STATES[name]
    if attribute == "bias" and f"{triad}_drift" not in names:
        return bounds[name]
    drift, sd = getattr(sensors, f"{triad}_drift"), _size(name, sensors)
    if not any(sd):
        raise ConfigError(
            "estimation.nothing-states-how-large-may-2",
            quantity="states",
            name=name,
            keys=keys,
            triad=triad,
        )
    if attribute == "bias":
        return random_walk(make(sd), drift.steps)
    if attribute != "drift":
        return make(sd)
    if math.isinf(drift.correlation_time):
        raise ConfigError(
            "estimation.nothing-states-over-time-changes-2",
            quantity="states",
            name=name,
            triad=triad,
        )
    return make(sd, drift.correlation_time)


def _size(name: str, sensors: ImuUncertainty) -> Triad:
    """Standard deviation of a block, axis by axis."""
    triad, attribute, _, _ = STATED_STATES[name]
    if attribute == "drift":
        drift: BiasDrift = getattr(sensors, f"{triad}_drift")
        return drift.triad
    stated: TriadUncertainty = getattr(sensors, triad)
    return stated.axis(attribute)


# The biases of a sensor as states, by its data sheet's uncertainty.


def standard_states(sensors: ImuUncertainty, *, separate: bool = True) -> tuple[SensorStates, ...]:
    """Return the biases of gyros and accelerometers as states.

    A bias is the sum of a constant of the record, or a random walk if the sensor has one, and a
    Gauss-Markov process within it. Three states cannot represent it: the sum is not Markov.

    Parameters
    ----------
    sensors : ImuUncertainty
    separate : bool
        True: the two as they are, ``gyro_bias gyro_drift accel_bias accel_drift``, twelve states
        if both triads drift (a triad without drift has no drift block). False: their sum as a
        random walk, ``gyro_bias accel_bias``, six states as in the papers' models; with
        ``sd² = bias² + 2 drift²`` and ``drive² = 2 drift² / correlation_time`` its covariance
        over any instants exceeds the true one by a positive semidefinite matrix, and with less
        of either it does not, so that a filter's P bounds the covariance of its estimates.

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
        # A drift of infinite correlation time is a constant, too.
        return [random_walk(bias_block(_both(sd, drift.triad)), drift.steps)]
    if separate:
        return [random_walk(bias_block(sd), drift.steps), drift_block(drift.triad, time)]
    root = math.sqrt(2.0)
    twice = triad_of(root * x for x in drift.triad)
    drive = _both(triad_of(x / math.sqrt(time) for x in twice), drift.steps)
    return [random_walk(bias_block(_both(sd, twice)), drive)]


def _both(a: Triad, b: Triad) -> Triad:
    return triad_of(math.hypot(x, y) for x, y in zip(a, b, strict=True))


# Process of a sensor error as stated by a user: constant, fading (Gauss-Markov) or random walk.


@dataclass(frozen=True)
class StateProcess:
    """Stated process of a block of states; values not stated stay unchanged.

    Attributes
    ----------
    sd : float or triad, optional
        At the start; of a Gauss-Markov process at every instant. SI.
    correlation_time : float, s, optional
        Of a stationary Gauss-Markov process.
    walk : float or triad, unit/√s, optional
        Of a random walk.

    Raises
    ------
    ConfigError
        Both a correlation time and a walk are stated.
    """

    sd: TriadLike | None = None
    correlation_time: float | None = None
    walk: TriadLike | None = None

    def __post_init__(self) -> None:
        if self.correlation_time is not None and self.walk is not None:
            raise ConfigError(
                "estimation.cannot-both-walk-come-back", quantity="states, correlation_time"
            )

    def of(self, name: str, block: SensorStates | None) -> SensorStates:
        """Return a block with the stated values.

        `name`: of `ERRORS_OF_SENSORS`. `block`: block to be changed; None if only this process
        states it. ConfigError: the size is not stated.
        """
        if self.sd is not None:
            drifts = name.endswith("_drift")
            time = self.correlation_time
            if (
                drifts
                and time is None
                and block is not None
                and math.isfinite(block.correlation_time)
            ):
                time = block.correlation_time
            if drifts and time is None:
                raise ConfigError(
                    "estimation.nothing-states-over-time-changes",
                    quantity=f"states.{name}",
                    name=name,
                )
            made = ERRORS_OF_SENSORS[name]
            new = made(self.sd, time) if drifts else made(self.sd)
            if block is not None and not drifts:
                new = replace(new, drive=block.drive, correlation_time=block.correlation_time)
            block = new
        if block is None:
            raise ConfigError(
                "estimation.nothing-states-how-large-may", quantity=f"states.{name}", name=name
            )
        if self.correlation_time is not None:
            return gauss_markov(block, self.correlation_time)
        return block if self.walk is None else random_walk(block, self.walk)


def with_processes(
    states: tuple[SensorStates, ...], processes: Mapping[str, StateProcess]
) -> tuple[SensorStates, ...]:
    """Return states with the stated values of some; additional ones come last.

    `processes`: by name of a block.
    """
    there = {one.block.name for one in states}
    changed = [
        processes[one.block.name].of(one.block.name, one) if one.block.name in processes else one
        for one in states
    ]
    more = [process.of(name, None) for name, process in processes.items() if name not in there]
    return (*changed, *more)
