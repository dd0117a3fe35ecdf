"""Attitude algorithms: one file each, and the table of all."""

from __future__ import annotations

import sys
from dataclasses import fields
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown._kernels.increments import LARGEST
from strapdown.attitude.algorithm import AttitudeAlgorithm, Steps, steps_of
from strapdown.attitude.cost import count_cost
from strapdown.attitude.direction_cosine import DirectionCosine
from strapdown.attitude.euler_krylov import EulerKrylov
from strapdown.attitude.naive import Naive
from strapdown.attitude.quaternion import Quaternion
from strapdown.attitude.rotation_vector import RotationVector
from strapdown.attitude.runge_kutta import RungeKutta
from strapdown.attitude.tracker import AttitudeTracker
from strapdown.errors import ConfigError, DivergenceError
from strapdown.plugins import plugin
from strapdown.results.attitude_bench import AttitudeRun
from strapdown.tables import attitude_table

__all__ = [
    "ALGORITHMS",
    "AttitudeAlgorithm",
    "AttitudeTracker",
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


def make_algorithm(text: str) -> AttitudeAlgorithm:
    """Make an algorithm from its name and options.

    Parameters
    ----------
    text : str
        ``name`` or ``name:option=value,option=value``, as in ``quaternion:order=3`` or
        ``euler:step=rk4``.

    Returns
    -------
    AttitudeAlgorithm

    Raises
    ------
    ConfigError
        The name, an option or a value is unknown; the message gives the nearest one.
    """
    name, _, rest = text.strip().lower().partition(":")
    cls = ALGORITHMS.get(name) or plugin("attitude", name, AttitudeAlgorithm)
    if cls is None:
        raise ConfigError(
            "attitude.no-attitude-algorithm",
            quantity="algorithms",
            name=name,
            word=name,
            known=ALGORITHMS,
        )
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
    else:
        return value
    raise ConfigError(code, quantity=f"{name}:{key}", value=value)


def _refuse_overflow(algorithm: AttitudeAlgorithm, history: NDArray[np.float64]) -> None:
    """Raise the error of a truncated series that overflows."""
    bad = np.flatnonzero(~(np.abs(history) < LARGEST).all(axis=1))
    if bad.size:
        raise DivergenceError(
            "attitude.numbers-left-range-floating-point",
            row=int(bad[0]) + 1,
            quantity=algorithm.label,
        )


def attitude_history(
    algorithm: AttitudeAlgorithm, increments: pd.DataFrame | Steps, q_nb: ArrayLike
) -> NDArray[np.float64]:
    """Run an attitude algorithm for its quaternions alone.

    Parameters
    ----------
    algorithm : AttitudeAlgorithm
    increments : DataFrame or Steps
        An Increments table, or its arrays.
    q_nb : array_like, (4,)
        Attitude at the start, body to local level.

    Returns
    -------
    ndarray, (n+1, 4)
        ``q_nb`` at the start and at the end of each step.

    Raises
    ------
    DataError, DivergenceError
        As `run_attitude`.
    """
    steps = increments if isinstance(increments, Steps) else steps_of(increments)
    return _run(algorithm, steps, q_nb)[0]


def _run(
    algorithm: AttitudeAlgorithm, steps: Steps, q_nb: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Quaternions at the start and after each step, and the state at the end."""
    state = algorithm.begin(rotation.normalise(q_nb))
    first = state[None, : algorithm.width]
    state, history = algorithm.advance_steps(state, steps)
    _refuse_overflow(algorithm, history)
    return algorithm.quaternions(np.vstack([first, history])), state


def run_attitude(
    algorithm: AttitudeAlgorithm,
    increments: pd.DataFrame,
    q_nb: ArrayLike = (1.0, 0.0, 0.0, 0.0),
) -> AttitudeRun:
    """Run an attitude algorithm over a whole record.

    Parameters
    ----------
    algorithm : AttitudeAlgorithm
    increments : DataFrame
        An Increments table; the run starts where its first step begins.
    q_nb : array_like, (4,)
        Attitude at the start, body to local level.

    Returns
    -------
    AttitudeRun
        Attitude at the start and at the end of each step, and the diagnostics of the
        algorithm.

    Raises
    ------
    DataError
        `q_nb` is not a rotation.
    DivergenceError
        The algorithm left the range of floating point.
    """
    q, state = _run(algorithm, steps_of(increments), q_nb)
    ends = increments.index.to_numpy(dtype=np.float64)
    time = np.concatenate([[ends[0] - increments["dt"].iloc[0]], ends])
    return AttitudeRun(
        algorithm=algorithm.label,
        title=algorithm.title,
        equations=algorithm.equations,
        attitude=attitude_table(time, q),
        diagnostics=algorithm.diagnostics(state, time),
    )


class _CallableRoom(ModuleType):
    """The package, callable as the public function: ``strapdown.attitude(t, gyro, accel)``.

    Importing a package sets it as an attribute of its parent, so that the name cannot be that of
    a function alone.
    """

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """As `strapdown.api.attitude.attitude`."""
        return import_module("strapdown.api.attitude").attitude(*args, **kwargs)


sys.modules[__name__].__class__ = _CallableRoom
