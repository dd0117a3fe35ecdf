"""Attitude algorithms: one file each, and the table of all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from strapdown.attitude_algorithms.algorithm import (
    AttitudeAlgorithm,
    AttitudeRun,
    AttitudeTracker,
    attitude_history,
    run_attitude,
)
from strapdown.attitude_algorithms.cost import Cost, count_cost
from strapdown.attitude_algorithms.direction_cosine import DirectionCosine
from strapdown.attitude_algorithms.euler_krylov import EulerKrylov
from strapdown.attitude_algorithms.naive import Naive
from strapdown.attitude_algorithms.quaternion import Quaternion
from strapdown.attitude_algorithms.rotation_vector import RotationVector
from strapdown.attitude_algorithms.runge_kutta import RungeKutta
from strapdown.errors import ConfigError

__all__ = [
    "ALGORITHMS",
    "AttitudeAlgorithm",
    "AttitudeRun",
    "AttitudeTracker",
    "Cost",
    "DirectionCosine",
    "EulerKrylov",
    "Naive",
    "Quaternion",
    "RotationVector",
    "RungeKutta",
    "attitude_history",
    "count_cost",
    "make_algorithm",
    "run_attitude",
    "with_options",
]

ALGORITHMS: dict[str, type[AttitudeAlgorithm]] = {
    "naive": Naive,
    "euler": EulerKrylov,
    "dcm": DirectionCosine,
    "quaternion": Quaternion,
    "rk4": RungeKutta,
    "rotvec": RotationVector,
}

_BOOLEANS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}


def make_algorithm(text: str, others: Sequence[str] = ()) -> AttitudeAlgorithm:
    """Make an algorithm from its name and options.

    Parameters
    ----------
    text : str
        ``name`` or ``name:option=value,option=value``, as in ``quaternion:order=3`` or
        ``euler:step=rk4``.
    others : sequence of str
        Further names that the caller knows, for the message.

    Returns
    -------
    AttitudeAlgorithm

    Raises
    ------
    ConfigError
        The name, an option or a value is unknown; the message gives the nearest one.
    """
    name, _, rest = text.strip().lower().partition(":")
    cls = ALGORITHMS.get(name)
    if cls is None:
        from strapdown.plugins import plugin

        cls = plugin("attitude", name, AttitudeAlgorithm)
    if cls is None:
        raise ConfigError(
            "attitude.no-attitude-algorithm",
            quantity="algorithms",
            name=name,
            word=name,
            known=[*ALGORITHMS, *others],
        )
    made: AttitudeAlgorithm = with_options(cls, name, rest)
    return made


def with_options(cls: type[Any], name: str, rest: str) -> Any:
    """Make a dataclass from its options as text, ``option=value,option=value/value``."""
    known = {f.name: f.default for f in fields(cls)}
    options: dict[str, object] = {}
    for item in filter(None, (part.strip() for part in rest.split(","))):
        key, _, value = item.partition("=")
        if key not in known:
            raise ConfigError(
                "attitude.no-option" if known else "attitude.no-option-2",
                quantity="algorithms",
                key=key,
                name=name,
                word=key,
                known=known,
            )
        options[key] = _option(name, key, value.strip().lower(), known[key])
    return cls(**options)


def _option(name: str, key: str, value: str, default: object) -> object:
    if isinstance(default, bool):
        if value in _BOOLEANS:
            return _BOOLEANS[value]
        code = "attitude.option-not-boolean"
    elif isinstance(default, int):
        try:
            return int(value)
        except ValueError:
            code = "attitude.option-not-whole"
    elif isinstance(default, float):
        try:
            return float(value)
        except ValueError:
            code = "attitude.option-not-number"
    elif isinstance(default, tuple):
        try:
            return tuple(float(one) for one in value.split("/"))
        except ValueError:
            code = "attitude.option-not-number"
    else:
        return value
    raise ConfigError(code, quantity=f"{name}:{key}", value=value)
