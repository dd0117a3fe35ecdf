"""[states.NAME]: how large an error of the sensors may be, and how it changes in time."""

from __future__ import annotations

from typing import Any

from pydantic import create_model

from strapdown.config.crash_case import OneOrThree, Positive
from strapdown.config.spec import TableSpec
from strapdown.errors import ConfigError
from strapdown.estimation.state_process import StateProcess
from strapdown.estimation.stated_states import STATED_STATES
from strapdown.sensors.stated_uncertainty import STATED_KEYS

__all__ = ["StatesTable", "processes_of"]

#: From a walk an hour's root to one a second's.
ROOT_HOUR = 60.0


class StateTable(TableSpec):
    """Of one block of states."""

    #: It comes back to zero within about this; constant, if neither is given.
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
    """What a table states, by name of the block, in SI.

    Raises
    ------
    ConfigError
        A size is stated twice, or both a walk and a correlation time.
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
