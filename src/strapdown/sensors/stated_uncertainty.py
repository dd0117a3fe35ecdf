"""What a person states of a triad, in the keys of the catalogue of sensors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

from strapdown.errors import ConfigError
from strapdown.sensors.catalogue import Sensor
from strapdown.sensors.catalogue_keys import KEYS, Key
from strapdown.sensors.sensor_uncertainty import FACTS, SPREADS, uncertainty_of
from strapdown.sensors.triad_uncertainty import TriadUncertainty

__all__ = ["STATED_KEYS", "stated_uncertainty"]

Stated = float | Sequence[float]


def _usable(keys: Mapping[str, Key]) -> dict[str, Key]:
    return {k: key for k, key in keys.items() if key.quantity in SPREADS or key.quantity in FACTS}


#: By triad, the keys that may be stated, each with its unit.
STATED_KEYS: dict[str, dict[str, Key]] = {triad: _usable(keys) for triad, keys in KEYS.items()}


def stated_uncertainty(
    triad: str, stated: Mapping[str, Stated], sensor: Sensor | None = None
) -> TriadUncertainty:
    """Turn what is stated of a triad into its uncertainty.

    Parameters
    ----------
    triad : {'gyro', 'accel'}
    stated : dict
        By key of the catalogue (``bias_sd_mg``, ``full_scale_g``): one number, or three; a
        bound counts as the standard deviation of a uniform distribution.
    sensor : Sensor, optional
        What is not stated is as its data sheet has it.

    Returns
    -------
    TriadUncertainty

    Raises
    ------
    ConfigError
        A key is unknown, a quantity is stated twice, or a number is none.
    """
    keys = STATED_KEYS[triad]
    values: dict[str, Any] = {}
    said: dict[str, str] = {}
    for name, given in stated.items():
        if name not in keys:
            raise ConfigError(
                "sensors.no-such-key", quantity=f"uncertainty, {name}", word=name, known=keys
            )
        key = keys[name]
        attribute = SPREADS.get(key.quantity, key.quantity)
        if attribute in values:
            raise ConfigError(
                "sensors.states-same", quantity=f"uncertainty, {name}", said=said[attribute]
            )
        factor = key.factor / (math.sqrt(3.0) if key.spread == "bound" else 1.0)
        one = isinstance(given, int | float)
        values[attribute] = given * factor if one else tuple(factor * x for x in given)  # type: ignore[operator,union-attr]
        said[attribute] = name
    if sensor is not None:
        return uncertainty_of(sensor, triad, **values)
    known = {f.name for f in fields(TriadUncertainty)}
    assert set(values) <= known
    return replace(TriadUncertainty(), **values)
