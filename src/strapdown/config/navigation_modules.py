"""The modules that the specification of a run of navigation names, made."""

from __future__ import annotations

from typing import Any

from strapdown.aiding.aid import Aid
from strapdown.config.alignment import AlignmentSpec
from strapdown.config.choice import make_choice
from strapdown.config.navigation import NavigationSpec, aids_of
from strapdown.config.slots import SLOTS
from strapdown.config.state_tables import processes_of
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.state_process import with_processes
from strapdown.estimation.stated_states import stated_states
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.sensors.stated_imu import stated_imu

__all__ = ["given_of", "make_aid", "make_aids", "make_filter", "sensors_of"]


def given_of(spec: NavigationSpec) -> dict[str, Any]:
    """Fields of modules that the chain fills."""
    return {"ellipsoid": spec.ellipsoid}


def sensors_of(spec: AlignmentSpec | NavigationSpec) -> ImuUncertainty:
    """What is not known of the sensors of a specification.

    Raises
    ------
    ConfigError
        The sensor is unknown, or says too little.
    """
    stated = spec.sensors
    sensor = None if stated.sensor is None else load_sensor(stated.sensor)
    return stated_imu(sensor, stated.gyro, stated.accel)


def make_filter(spec: NavigationSpec, sensors: ImuUncertainty) -> ErrorFilter:
    """Make the filter of a specification, without the states of its aids.

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


def make_aid(spec: NavigationSpec, name: str) -> Aid:
    """Make the aid of a name; as `make_aids`."""
    made: Aid = make_choice(aids_of(spec)[name], SLOTS["aiding"], {**given_of(spec), "name": name})
    return made


def make_aids(spec: NavigationSpec) -> tuple[Aid, ...]:
    """Make the aids of a specification.

    Raises
    ------
    ConfigError
        One refuses an option.
    """
    return tuple(make_aid(spec, name) for name in aids_of(spec))
