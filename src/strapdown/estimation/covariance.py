"""What every form of a covariance is: begun of P, predicted, updated, read as P."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown.estimation.update_rule import UpdateRule

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Innovations:
    """What an epoch's observations were beside what was expected, one after the other.

    Attributes
    ----------
    nu : ndarray, (l,)
        Observation less its prediction, after the observations before it, in its unit.
    s : ndarray, (l,)
        Variance that was expected of it: ``h P h' + R``.
    weight : ndarray, (l,)
        What the update rule gave it, from 0 (not used) to 1.
    """

    nu: Array
    s: Array
    weight: Array


@dataclass(frozen=True)
class CovarianceForm(ABC):
    """A way to keep and to change a covariance; it holds no state of its own.

    A state is one float64 array (n, n), whose meaning is the form's own: P itself, or U above a
    diagonal D.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]

    @abstractmethod
    def begin(self, P: Array) -> Array:
        """Return the state of a covariance.

        Parameters
        ----------
        P : ndarray, (n, n)
            Symmetric, positive semidefinite: a row of zeros is a state that is known.

        Returns
        -------
        ndarray, (n, n)

        Raises
        ------
        DataError
            P is not finite, not symmetric, or has a negative eigenvalue beyond rounding.
        """

    @abstractmethod
    def predict(self, state: Array, Phi: Array, Q: Array) -> Array:
        """Return the state of ``Phi P Phi' + Q``.

        Parameters
        ----------
        state : ndarray, (n, n)
        Phi : ndarray, (n, n)
        Q : ndarray, (n, n)
            Symmetric, positive semidefinite to rounding; of any rank.
        """

    @abstractmethod
    def update(
        self,
        state: Array,
        x: Array,
        z: Array,
        H: Array,
        R: Array,
        rule: UpdateRule | Sequence[UpdateRule] | None = None,
    ) -> tuple[Array, Array, Innovations]:
        """Take the observations of an epoch, one after the other.

        Parameters
        ----------
        state : ndarray, (n, n)
        x : ndarray, (n,)
            Estimate before.
        z : ndarray, (l,)
        H : ndarray, (l, n)
        R : ndarray, (l,)
            Variances of observations that are independent of each other.
        rule : UpdateRule, or a sequence of them, optional
            How much of an observation is believed, one rule for all or one for each; all of
            each, if not given.

        Returns
        -------
        state : ndarray, (n, n)
        x : ndarray, (n,)
        innovations : Innovations
        """

    def epoch(
        self,
        state: Array,
        Phi: Array,
        Q: Array,
        x: Array,
        z: Array,
        H: Array,
        R: Array,
        rule: UpdateRule | Sequence[UpdateRule] | None = None,
    ) -> tuple[Array, Array, Innovations]:
        """Predict, then take the observations: a form may do both together for less.

        Parameters
        ----------
        state : ndarray, (n, n)
            Before the prediction.
        Phi, Q : ndarray, (n, n)
            As for `predict`.
        x : ndarray, (n,)
            Estimate, predicted already.
        z, H, R, rule
            As for `update`.

        Returns
        -------
        state, x, innovations
            As from `update`.
        """
        return self.update(self.predict(state, Phi, Q), x, z, H, R, rule)

    @abstractmethod
    def matrix(self, state: Array) -> Array:
        """Return P, (n, n), exactly symmetric."""

    def sd(self, state: Array) -> Array:
        """Return the standard deviation of each state, (n,)."""
        return np.sqrt(np.diagonal(self.matrix(state)))
