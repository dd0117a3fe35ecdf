"""The covariance as ``U D U'``: Bierman's update and Thornton's prediction."""

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
    indefinite,
)
from strapdown.estimation.sequential import contiguous, own, take_by_rule
from strapdown.estimation.update_rule import UpdateRule

Array = NDArray[np.float64]


@cache
def _kernels() -> tuple[ModuleType, ModuleType]:
    from strapdown._kernels import factored_update, factors

    return factors, factored_update


@dataclass(frozen=True)
class BiermanThornton(CovarianceForm):
    """Unit upper triangular U and diagonal D; a state holds U above its diagonal and D on it.

    No variance is ever computed as a difference: D stays >= 0, and digits are kept as if by
    square roots, without taking any.
    """

    name: ClassVar[str] = "ud"
    summary: ClassVar[str] = "U D U', an orthogonalisation a prediction"
    source: ClassVar[str] = "Bierman 1977, Sections V.3 (update) and VI.4 (Thornton's prediction)"

    def begin(self, P: Array) -> Array:
        """Return the factors of a covariance; see `CovarianceForm.begin`."""
        factors, _ = _kernels()
        P = checked_covariance(P)
        out = np.empty_like(P)
        if (row := factors.udu_factor(P, out)) >= 0:
            raise indefinite(row)
        return out

    def predict(self, state: Array, Phi: Array, Q: Array) -> Array:
        """Return the factors of ``Phi P Phi' + Q``, by one weighted Gram-Schmidt.

        Raises
        ------
        DataError
            Shapes that do not fit; Phi or Q that is not finite; Q with a negative eigenvalue.
        """
        state, Phi, Q = contiguous(state, Phi, Q)
        check_prediction(state, Phi, Q)
        out = np.empty_like(state)
        row = _kernels()[0].udu_predict(state, Phi, Q, out)
        if row >= 0:
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
        _, kernels = _kernels()
        z, H, R = contiguous(z, H, R)
        ud, x = own(state), own(x)
        check_observations(x, z, H, R)
        if rule is not None:
            expect, take = kernels.ud_expect, kernels.ud_take
            work = np.empty((4, len(x)))
            return ud, x, take_by_rule(expect, take, (ud, ud[0]), x, (z, H, R), rule, work)
        told = np.ones((3, len(z)))
        bad = kernels.ud_update(ud, x, z, H, R, told)
        if bad >= 0:
            raise bad_observation(bad, told[0, bad], told[1, bad], R)
        return ud, x, Innovations(told[0], told[1], told[2])

    def matrix(self, state: Array) -> Array:
        """Return ``U D U'``."""
        out = np.empty_like(state)
        _kernels()[0].udu_matrix(np.ascontiguousarray(state), out)
        return out
