"""Interface of every attitude algorithm: state, propagation, and attitude output."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown._kernels import rotation as kernel
from strapdown.tables import DTHETA, THETA

Array = NDArray[np.float64]


def quaternions_from_angles(roll_pitch_heading: Array) -> Array:
    """Quaternions of 3-2-1 angles in rad, (n, 3), of any size: pitch beyond ±90° is legal."""
    q = np.empty((len(roll_pitch_heading), 4))
    kernel.quats_from_eulers(np.ascontiguousarray(roll_pitch_heading), q)
    return q


def unit_quaternions(history: Array) -> Array:
    """Rows of four numbers, scaled to norm 1."""
    norm = np.sqrt((history * history).sum(axis=1, keepdims=True))
    return np.asarray(history / norm)


@dataclass(frozen=True)
class Steps:
    """Increments for the kernels: (n,) s, (n, 3) rad, (n, 3) rad."""

    dt: Array
    theta: Array
    dtheta: Array


def steps_of(increments: pd.DataFrame) -> Steps:
    """Return the arrays of an Increments table, without its time stamps."""
    return Steps(
        np.ascontiguousarray(increments["dt"].to_numpy(dtype=np.float64)),
        np.ascontiguousarray(increments[THETA].to_numpy(dtype=np.float64)),
        np.ascontiguousarray(increments[DTHETA].to_numpy(dtype=np.float64)),
    )


@dataclass(frozen=True)
class Accuracy:
    """Order of an algorithm's attitude error in the step; 0: it does not decrease.

    Attributes
    ----------
    increments : int
        On general smooth motion, from exact increments.
    rates : int
        On general smooth motion, from rates at the stamps that are interpolated by a cubic;
        by the trapezoid it is this, and at most 2.
    coning : int
        Drift on pure coning, from exact increments.
    """

    increments: int
    rates: int
    coning: int


@dataclass(frozen=True)
class AttitudeAlgorithm(ABC):
    """One attitude algorithm with its options; stateless.

    Attributes
    ----------
    name : str
        The word for it on the command line.
    title : str
        The words for it in a report.
    equations : str
        Equation numbers in its source.
    source : str
        That source.
    width : int
        Number of elements of the state that are the attitude, the first ones.
    advance_kernel, update_kernel : callable
        The compiled loops over many steps and for one sample.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    equations: ClassVar[str]
    source: ClassVar[str] = "Alexiev (2021)"
    summary: ClassVar[str]
    width: ClassVar[int]
    advance_kernel: ClassVar[Any]
    update_kernel: ClassVar[Callable[..., Any]]

    @abstractmethod
    def begin(self, q_nb: Array) -> Array:
        """Return the state of an attitude given as a unit quaternion, shape (4,)."""

    @abstractmethod
    def quaternions(self, history: Array) -> Array:
        """Return unit quaternions ``q_nb``, (n, 4), of `width` numbers a row."""

    @property
    @abstractmethod
    def accuracy(self) -> Accuracy:
        """Order of its error in the step."""

    @abstractmethod
    def kernel_options(self) -> tuple[float, float]:
        """Return the two options for the kernels, as numbers; zero for a missing one."""

    def diagnostics(self, state: Array, time: Array) -> dict[str, float]:
        """Return the algorithm's diagnostics after a run.

        Parameters
        ----------
        state : ndarray
            As left by `advance`.
        time : ndarray, (n+1,), s
            The start, and the end of every step since.
        """
        return {}

    def advance(self, state: Array, increments: pd.DataFrame) -> tuple[Array, Array]:
        """Advance over a segment of increments.

        Parameters
        ----------
        state : ndarray
            From `begin`, or from an earlier segment; it is not changed.
        increments : DataFrame
            An Increments table of any length, one row included.

        Returns
        -------
        state : ndarray
            After the last step.
        history : ndarray, (n, width)
            The attitude part of the state after each step.
        """
        return self.advance_steps(state, steps_of(increments))

    def advance_steps(self, state: Array, steps: Steps) -> tuple[Array, Array]:
        """Advance over a segment of steps, as `advance`.

        Parameters
        ----------
        state : ndarray
        steps : Steps
            From `steps_of`; made once for many algorithms over the same steps.
        """
        history = np.empty((len(steps.dt), self.width))
        after = state.copy()
        options = self.kernel_options()
        type(self).advance_kernel(after, steps.dt, steps.theta, steps.dtheta, history, *options)
        return after, history

    @property
    def label(self) -> str:
        """The name with every option that is not at its default."""
        changed = [
            f"{f.name}={getattr(self, f.name)}".lower()
            for f in fields(self)
            if getattr(self, f.name) != f.default
        ]
        return f"{self.name}:{','.join(changed)}" if changed else self.name
