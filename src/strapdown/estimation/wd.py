"""The W-D form: columns are appended over an epoch, and orthogonalised once at its end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from strapdown.estimation.covariance import Innovations
from strapdown.estimation.covariance_input import (
    bad_observation,
    bad_prediction,
    check_observations,
    check_prediction,
)
from strapdown.estimation.sequential import contiguous, own, take_by_rule
from strapdown.estimation.ud import BiermanThornton
from strapdown.estimation.update_rule import UpdateRule

Array = NDArray[np.float64]


@cache
def _kernels() -> ModuleType:
    from strapdown._kernels import factored_update

    return factored_update


@dataclass(frozen=True)
class Chernodarov(BiermanThornton):
    """``P = W D W'`` within an epoch, ``U D U'`` between epochs.

    W begins as ``[Phi U, G]``; an observation deflates it and appends its gain as a column, so
    that Joseph's form is met factor by factor. `epoch` orthogonalises once for prediction
    and observations together, as the source does; `predict` and `update` alone do so once each.
    """

    name: ClassVar[str] = "wd"
    summary: ClassVar[str] = "W D W', one orthogonalisation an epoch"
    source: ClassVar[str] = "Chernodarov 2009, Eqs. (5)-(15), (14) with W deflated"

    def update(
        self,
        state: Array,
        x: Array,
        z: Array,
        H: Array,
        R: Array,
        rule: UpdateRule | Sequence[UpdateRule] | None = None,
    ) -> tuple[Array, Array, Innovations]:
        """Take the observations of an epoch, one after the other; see `CovarianceForm.update`."""
        (state,) = contiguous(state)
        return self._observed(state, state, state, False, x, (z, H, R), rule)

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
        """Predict and take the observations, with one orthogonalisation (Eqs. 6-15)."""
        state, Phi, Q = contiguous(state, Phi, Q)
        check_prediction(state, Phi, Q)
        return self._observed(state, Phi, Q, True, x, (z, H, R), rule)

    def _observed(
        self,
        state: Array,
        Phi: Array,
        Q: Array,
        predicted: bool,
        x: Array,
        observations: tuple[Array, Array, Array],
        rule: UpdateRule | Sequence[UpdateRule] | None,
    ) -> tuple[Array, Array, Innovations]:
        kernels = _kernels()
        z, H, R = contiguous(*observations)
        x, out = own(x), np.empty_like(state)
        check_observations(x, z, H, R)
        if rule is None:
            told = np.ones((3, len(z)))
            bad = kernels.wd_epoch(state, Phi, Q, predicted, x, z, H, R, told, out)
            if bad >= 0:
                raise bad_observation(bad, told[0, bad], told[1, bad], R)
            if bad < -1:
                raise bad_prediction(-2 - bad, Phi, Q)
            return out, x, Innovations(told[0], told[1], told[2])
        W, d, row = kernels.wd_begin(state, Phi, Q, predicted, len(z))
        if row >= 0:
            raise bad_prediction(row, Phi, Q)
        work = np.empty((3, W.shape[1]))
        expect, take = kernels.wd_expect, kernels.wd_take
        innovations = take_by_rule(expect, take, (W, d), x, (z, H, R), rule, work)
        row = kernels.wd_finish(W, d, out)
        if row >= 0:
            raise bad_prediction(row, Phi, Q)
        return out, x, innovations
