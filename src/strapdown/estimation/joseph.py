"""The covariance as a matrix: Joseph's update, and the plain one to compare with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown.estimation.covariance import CovarianceForm, Innovations
from strapdown.estimation.covariance_input import (
    bad_observation,
    bad_prediction,
    check_observations,
    check_prediction,
    checked_covariance,
)
from strapdown.estimation.sequential import contiguous, own, take_by_rule
from strapdown.estimation.update_rule import UpdateRule

Array = NDArray[np.float64]


@cache
def _kernels() -> ModuleType:
    from strapdown._kernels import covariance

    return covariance


@dataclass(frozen=True)
class Plain(CovarianceForm):
    """``P <- (1 - K h) P``, kept to show where it fails.

    A difference of two matrices that may be equal to rounding: with observations much better
    than what is known before, variances become negative.
    """

    name: ClassVar[str] = "plain"
    summary: ClassVar[str] = "P - K h P: fast, and without defence against rounding"
    source: ClassVar[str] = "Kalman 1960"
    _joseph: ClassVar[bool] = False

    def begin(self, P: Array) -> Array:
        """Return the state of a covariance: itself."""
        return checked_covariance(P)

    def predict(self, state: Array, Phi: Array, Q: Array) -> Array:
        """Return ``Phi P Phi' + Q``, exactly symmetric."""
        state, Phi, Q = contiguous(state, Phi, Q)
        check_prediction(state, Phi, Q)
        out = np.empty_like(state)
        row = _kernels().dense_predict(state, Phi, Q, out)
        if row >= 0 and (self._joseph or not np.isfinite(out).all()):
            raise bad_prediction(row, Phi, Q)
        return out

    def update(
        self,
        state: Array,
        x: Array,
        z: Array,
        H: Array,
        R: Array,
        rule: UpdateRule | Sequence[UpdateRule] | None = None,
    ) -> tuple[Array, Array, Innovations]:
        """Take the observations of an epoch, one after the other; see `CovarianceForm.update`.

        Raises
        ------
        DataError
            Shapes that do not fit, or an observation that is not finite.
        """
        kernels = _kernels()
        z, H, R = contiguous(z, H, R)
        P, x = own(state), own(x)
        check_observations(x, z, H, R)
        if rule is not None:
            take = kernels.joseph_take if self._joseph else kernels.plain_take
            work = np.empty((3, len(x)))
            return (
                P,
                x,
                take_by_rule(kernels.dense_expect, take, (P, P[0]), x, (z, H, R), rule, work),
            )
        told = np.ones((3, len(z)))
        bad = kernels.dense_update(P, x, z, H, R, self._joseph, told)
        if bad >= 0:
            raise bad_observation(bad, told[0, bad], told[1, bad], R)
        return P, x, Innovations(told[0], told[1], told[2])

    def matrix(self, state: Array) -> Array:
        """Return P: the state."""
        return state.copy()


@dataclass(frozen=True)
class Joseph(Plain):
    """``P <- (1 - K h) P (1 - K h)' + r K K'``.

    A sum of two matrices neither of which is negative, whatever the gain is: rounding of the gain
    counts in second order only. It holds P itself, which costs half of the digits that U-D has.
    """

    name: ClassVar[str] = "joseph"
    summary: ClassVar[str] = "P itself; (1 - K h) P (1 - K h)' + r K K'"
    source: ClassVar[str] = "Bucy and Joseph 1968; as rank-one changes, Bierman 1977, Section V.4"
    _joseph: ClassVar[bool] = True
