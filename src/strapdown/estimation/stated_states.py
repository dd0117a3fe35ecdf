"""Errors of sensors as states by their names, with the sizes that a data sheet states."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from strapdown.errors import ConfigError
from strapdown.estimation.sensor_blocks import (
    accel_bias,
    accel_drift,
    accel_misalignment,
    accel_scale,
    g_sensitivity,
    gyro_bias,
    gyro_drift,
    gyro_misalignment,
    gyro_scale,
)
from strapdown.estimation.sensor_states import SensorStates
from strapdown.estimation.standard_states import standard_states
from strapdown.sensors.imu_uncertainty import BiasDrift, ImuUncertainty
from strapdown.sensors.triad_errors import Triad
from strapdown.sensors.triad_uncertainty import TriadUncertainty

__all__ = ["STATED_STATES", "stated_states", "states_that_are_stated"]

#: By name of the block: triad, attribute of its uncertainty, what makes the block of it, and the
#: key of [sensors.gyro] or [sensors.accel] that states it.
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


#: Errors that go with rate and force: nothing at rest, and most of all on the move.
MOVING = ("gyro_scale", "accel_scale", "gyro_misalignment", "accel_misalignment")


def stated_states(
    sensors: ImuUncertainty, names: Sequence[str] | None = None
) -> tuple[SensorStates, ...]:
    """Return errors of sensors as states.

    Parameters
    ----------
    sensors : ImuUncertainty
        How large each may be.
    names : sequence of str, optional
        Of `STATED_STATES`; if not given, biases and drifts as `standard_states`, and of scale
        factors and misalignments those whose size is stated: without them the bounds of a body that
        turns and accelerates are too narrow. A bias that is named without its drift is a random
        walk that bounds both.

    Returns
    -------
    tuple of SensorStates

    Raises
    ------
    ConfigError
        There is no such block, one is named twice, or nothing states its size.
    """
    if names is None:
        known = [n for n in MOVING if any(_size(n, sensors))]
        return (*standard_states(sensors), *(_block(n, sensors, {}, known) for n in known))
    bounds = {one.block.name: one for one in standard_states(sensors, separate=False)}
    out = []
    for name in names:
        if name not in STATED_STATES:
            raise ConfigError(
                "estimation.no-error-sensor-filter-can",
                quantity="states",
                name=name,
                word=name,
                known=STATED_STATES,
            )
        if list(names).count(name) > 1:
            raise ConfigError("estimation.stands-twice", quantity="states", name=name)
        out.append(_block(name, sensors, bounds, names))
    return tuple(out)


def states_that_are_stated(sensors: ImuUncertainty) -> tuple[str, ...]:
    """Return those of `STATED_STATES` whose size is stated: all that can be estimated.

    Parameters
    ----------
    sensors : ImuUncertainty

    Returns
    -------
    tuple of str
    """
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
