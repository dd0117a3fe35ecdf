"""What every aid is: when it observes, what it computes, what it adds to the states."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.aiding.view import View
from strapdown.estimation.observation import Observation
from strapdown.estimation.sensor_states import SensorStates
from strapdown.estimation.update_rule import UpdateRule

__all__ = ["Aid", "Epochs", "TableAid", "WatchingAid", "lasting"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Epochs:
    """When an aid observes, and what it was told then.

    Attributes
    ----------
    time : ndarray, (n,), s
        On the clock of the inertial sensors, not decreasing.
    values : ndarray, (n, m)
        In the aid's own order.
    """

    time: Array
    values: Array


@dataclass(frozen=True)
class Aid(ABC):
    """A source of observations; it holds no state of its own.

    Attributes
    ----------
    name : str
        The user's: two receivers have two names. States and observations are named after it:
        ``rtk.lever_arm``, ``rtk.position``.
    rule : UpdateRule, optional
        How far its observations are believed; that of the filter, if not given.
    """

    name: str = ""
    rule: UpdateRule | None = None

    kind: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]

    @property
    def wants_steady(self) -> bool:
        """Whether it looks at rate and force without the shaking: `View.steady`."""
        return False

    @property
    def lasts(self) -> bool:
        """Whether it states, and allows for, errors that last from one epoch to the next."""
        return False

    def states(self) -> tuple[SensorStates, ...]:
        """States that it needs beside those of the inertial sensors, named ``name.block``."""
        return ()

    @abstractmethod
    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return what it observes at one of its epochs; nothing, where it tells nothing.

        Parameters
        ----------
        view : View
            Of the navigator at the instant of the epoch.
        values : ndarray, (m,)
            Row of `Epochs.values`.
        """


@dataclass(frozen=True)
class TableAid(Aid):
    """An aid with a table of what it measured."""

    #: Columns that its table must have.
    columns: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def epochs(self, table: pd.DataFrame) -> Epochs:
        """Return the epochs of a table, without the rows that say nothing.

        Parameters
        ----------
        table : DataFrame
            By time in s of the clock of the inertial sensors, but for a known offset.

        Raises
        ------
        DataError
            The table is not valid; file, row, quantity and remedy are named.
        """


@dataclass(frozen=True)
class WatchingAid(Aid):
    """An aid that watches the inertial sensors, and observes where they tell it to."""

    @abstractmethod
    def begin(self) -> Any:
        """Return what it remembers before the first sample; never changed in place."""

    @abstractmethod
    def watch(self, memory: Any, time: Array, rows: Array) -> tuple[Any, Epochs]:
        """Look at samples: pieces of any length give the same as the whole.

        Parameters
        ----------
        memory : object
        time : ndarray, (k,), s
            Ends of the steps.
        rows : ndarray, (k, 10)
            Motion increments as the sensors gave them: ``dt``, angle, velocity, distance.

        Returns
        -------
        memory : object
        epochs : Epochs
            Where it observes: at the ends of some of these steps; and what it saw up to there.
        """


def lasting(aids: Iterable[Aid]) -> tuple[str, ...]:
    """Return the names of the aids that state that their errors last."""
    return tuple(one.name for one in aids if one.lasts)
