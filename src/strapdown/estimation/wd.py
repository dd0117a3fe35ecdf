"""The W-D form: columns are appended over an epoch, and orthogonalised once at its end."""

from __future__ import annotations

from dataclasses import dataclass
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
from strapdown.estimation.sequential import contiguous, take_by_rule
from strapdown.estimation.ud import BiermanThornton
from strapdown.estimation.update_rule import UpdateRule

Array = NDArray[np.float64]


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
        rule: UpdateRule | None = None,
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
        rule: UpdateRule | None = None,
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
        rule: UpdateRule | None,
    ) -> tuple[Array, Array, Innovations]:
        from strapdown._kernels.factored_update import (
            wd_begin,
            wd_expect,
            wd_finish,
            wd_take,
            wd_update,
        )

        z, H, R = contiguous(*observations)
        x = np.array(x, dtype=np.float64)
        check_observations(x, z, H, R)
        W, d, row = wd_begin(state, Phi, Q, predicted, len(z))
        if row >= 0:
            raise bad_prediction(row, Phi, Q)
        if rule is not None:
            work = np.empty((3, W.shape[1]))
            told = take_by_rule(wd_expect, wd_take, (W, d), x, (z, H, R), rule, work)
        else:
            nu, s = np.empty((2, len(z)))
            bad = wd_update(W, d, x, z, H, R, nu, s)
            if bad >= 0:
                raise bad_observation(bad, nu[bad], s[bad], R)
            told = Innovations(nu, s, np.ones(len(z)))
        out = np.empty_like(state)
        row = wd_finish(W, d, out)
        if row >= 0:
            raise bad_prediction(row, Phi, Q)
        return out, x, told
