"""Create the modules that a navigation specification names."""

from __future__ import annotations

from typing import Any

from pydantic import create_model

from strapdown.config.alignment import AlignmentSpec
from strapdown.config.choice import SLOTS, make_choice
from strapdown.config.crash_case import OneOrThree, Positive
from strapdown.config.navigation import NavigationSpec, aids_of
from strapdown.config.spec import TableSpec
from strapdown.errors import ConfigError
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.sensor_blocks import (
    STATED_STATES,
    StateProcess,
    stated_states,
    with_processes,
)
from strapdown.navigation.measurements.measurement import Measurement
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import STATED_KEYS, ImuUncertainty, stated_imu

__all__ = [
    "StatesTable",
    "given_of",
    "make_aid",
    "make_aids",
    "make_filter",
    "processes_of",
    "sensors_of",
]


def given_of(spec: NavigationSpec) -> dict[str, Any]:
    """Module fields that the chain fills."""
    return {"ellipsoid": spec.ellipsoid}


def sensors_of(spec: AlignmentSpec | NavigationSpec) -> ImuUncertainty:
    """Sensor uncertainty of a specification.

    Raises
    ------
    ConfigError
        The sensor is unknown or incomplete.
    """
    stated = spec.sensors
    sensor = None if stated.sensor is None else load_sensor(stated.sensor)
    return stated_imu(sensor, stated.gyro, stated.accel)


def make_filter(spec: NavigationSpec, sensors: ImuUncertainty) -> ErrorFilter:
    """Create the filter of a specification, without measurement states.

    Parameters
    ----------
    spec : NavigationSpec
    sensors : ImuUncertainty

    Returns
    -------
    ErrorFilter

    Raises
    ------
    ConfigError
        A module refuses an option, or a state has no size.
    """
    options = make_choice(spec.filter, SLOTS["filter"], given_of(spec))
    mechanization = make_choice(spec.mechanization, SLOTS["mechanization"], given_of(spec))
    return ErrorFilter(
        mechanization,
        options.model(
            gyro_noise=sensors.gyro.axis("noise_density"),
            accel_noise=sensors.accel.axis("noise_density"),
            sensors=with_processes(
                stated_states(sensors, spec.sensors.states), processes_of(spec.states)
            ),
        ),
        options.form,
        options.rule,
        step=options.step,
    )


def make_aid(spec: NavigationSpec, name: str) -> Measurement:
    """Create the measurement of a name; as `make_aids`."""
    made: Measurement = make_choice(
        aids_of(spec)[name], SLOTS["aiding"], {**given_of(spec), "name": name}
    )
    return made


def make_aids(spec: NavigationSpec) -> tuple[Measurement, ...]:
    """Create the measurements of a specification.

    Raises
    ------
    ConfigError
        A measurement refuses an option.
    """
    return tuple(make_aid(spec, name) for name in aids_of(spec))


# [states.NAME]: size of a sensor error, and its change in time.


#: Random walk per root hour to per root second.
ROOT_HOUR = 60.0


class StateTable(TableSpec):
    """One block of states."""

    #: Correlation time of a Gauss-Markov process; without it and a walk, the error is constant.
    correlation_time_s: Positive | None = None


def _units(name: str) -> dict[str, float]:
    """Factors to SI by the unit of a key."""
    triad, attribute, _, _ = STATED_STATES[name]
    quantity = "bias" if attribute == "drift" else attribute
    start = f"{quantity}_sd_"
    return {
        key.removeprefix(start): one.factor
        for key, one in STATED_KEYS[triad].items()
        if key.startswith(start)
    }


def _form(name: str) -> type[StateTable]:
    fields: dict[str, Any] = {}
    for unit in _units(name):
        fields[f"sd_{unit}"] = (OneOrThree | None, None)
        fields[f"walk_{unit}_per_sqrt_h"] = (OneOrThree | None, None)
    return create_model(f"State_{name}", __base__=StateTable, **fields)


_TABLES: dict[str, Any] = {name: (_form(name) | None, None) for name in STATED_STATES}
#: A table for every error that a filter can estimate.
StatesTable: type[TableSpec] = create_model("States", __base__=TableSpec, **_TABLES)


def processes_of(table: TableSpec) -> dict[str, StateProcess]:
    """State processes of a table, by name of the block, in SI.

    Raises
    ------
    ConfigError
        A size is stated twice, or both a walk and a correlation time are.
    """
    out = {}
    for name in STATED_STATES:
        one = getattr(table, name, None)
        if one is None:
            continue
        given: dict[str, Any] = {}
        for unit, factor in _units(name).items():
            for key, part, scale in (
                (f"sd_{unit}", "sd", factor),
                (f"walk_{unit}_per_sqrt_h", "walk", factor / ROOT_HOUR),
            ):
                value = getattr(one, key)
                if value is None:
                    continue
                if part in given:
                    raise ConfigError("config.state-in-two-units", quantity=f"states.{name}, {key}")
                single = isinstance(value, int | float)
                given[part] = scale * value if single else tuple(scale * x for x in value)
        out[name] = StateProcess(correlation_time=one.correlation_time_s, **given)
    return out
