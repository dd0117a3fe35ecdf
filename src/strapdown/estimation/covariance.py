"""Interface of every covariance form: begin from P, predict, update, return P."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from strapdown.errors import ConfigError, DataError
from strapdown.tables.checks import Array


@dataclass(frozen=True, eq=False)
class Innovations:
    """Innovations of an epoch's observations, processed one after the other.

    Attributes
    ----------
    nu : ndarray, (l,)
        Observation minus its prediction, after the observations before it, in its unit.
    s : ndarray, (l,)
        Predicted variance of each: ``h P h' + R``.
    weight : ndarray, (l,)
        Weight by the update rule, from 0 (not used) to 1.
    """

    nu: Array
    s: Array
    weight: Array


@dataclass(frozen=True)
class CovarianceForm(ABC):
    """A form in which a covariance is kept and changed; stateless.

    A state is one float64 array (n, n), whose meaning depends on the form: P itself, or U above a
    diagonal D.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]

    @abstractmethod
    def begin(self, P: Array) -> Array:
        """Return the state of a covariance; (n, n).

        `P` ((n, n)): symmetric, positive semidefinite: a row of zeros is an exactly known state.
        DataError: p is not finite, not symmetric, or has a negative eigenvalue beyond rounding.
        """

    @abstractmethod
    def predict(self, state: Array, Phi: Array, Q: Array) -> Array:
        """Return the state of ``Phi P Phi' + Q``.

        `state` ((n, n)). `Phi` ((n, n)). `Q` ((n, n)): symmetric, positive semidefinite to
        rounding; of any rank. DataError: shapes that do not fit, or a predicted variance that is
        negative or not finite.
        """

    def update(
        self,
        state: Array,
        x: Array,
        z: Array,
        H: Array,
        R: Array,
        rule: UpdateRule | Sequence[UpdateRule] | None = None,
    ) -> tuple[Array, Array, Innovations]:
        """Update with the observations of an epoch, one after the other.

        `state` ((n, n)). `x` ((n,)): estimate before. `z` ((l,)). `H` ((l, n)). `R` ((l,)):
        variances of observations that are independent of each other. `rule` (or a sequence of
        them): weighting of the observations, one rule for all or one for each; full weight if not
        given. Returns `state` ((n, n)); `x` ((n,)). DataError: shapes that do not fit, or an
        observation that is not finite.
        """
        z, H, R = contiguous(z, H, R)
        state, x = own(state), own(x)
        check_observations(x, z, H, R)
        if rule is not None:
            expect, take = self._halves()
            work = np.empty((4, len(x)))
            seen = take_by_rule(expect, take, (state, state[0]), x, (z, H, R), rule, work)
            return state, x, seen
        told = np.ones((3, len(z)))
        bad = self._take_all(state, x, z, H, R, told)
        if bad >= 0:
            raise bad_observation(bad, told[0, bad], told[1, bad], R)
        return state, x, Innovations(told[0], told[1], told[2])

    @abstractmethod
    def _halves(self) -> tuple[Callable[..., tuple[float, float]], Callable[..., None]]:
        """Kernels that expect an observation and take it."""

    @abstractmethod
    def _take_all(self, state: Array, x: Array, *observations: Array) -> int:
        """Update in place with z, H, R and a record; the index of an invalid one, or -1."""

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
        """Predict, then update: a form may combine both at a lower cost.

        `state` ((n, n)): before the prediction. `Phi`, `Q` ((n, n)): as for `predict`. `x` ((n,)):
        estimate, predicted already. `z`, `H`, `R`, `rule`: as for `update`. Returns state, x,
        innovations, as from `update`.
        """
        return self.update(self.predict(state, Phi, Q), x, z, H, R, rule)

    @abstractmethod
    def matrix(self, state: Array) -> Array:
        """Return P, (n, n), exactly symmetric."""

    def sd(self, state: Array) -> Array:
        """Return the standard deviation of each state, (n,)."""
        return np.sqrt(np.diagonal(self.matrix(state)))


# Effect of an observation on an estimate: gain, and reduction of the covariance.


class Step(NamedTuple):
    """One scalar update: ``K = P h' / (slope s + r)``, ``x + K moved``.

    The covariance becomes ``(1 - slope K h) P (1 - slope K h)' + slope r K K'``. A plain update has
    ``moved = nu``, ``slope = 1`` and ``r = R``; one with a lower weight has a larger r.

    Attributes
    ----------
    moved : float
        In the unit of the observation.
    slope : float
    r : float
        In the unit of the observation, squared.
    weight : float
        For the record: 1 for full weight, 0 for a rejected observation, which leaves the state
        unchanged.
    """

    moved: float
    slope: float
    r: float
    weight: float


class UpdateRule(Protocol):
    """Determines the effect of one observation on the filter."""

    def step(self, nu: float, s: float, r: float) -> Step:
        """Return the step of one observation.

        `nu`: observation minus its prediction. `s`: ``h P h'``, the variance of the prediction.
        `r`: variance of the observation.
        """
        ...


class FullUpdate:
    """Kalman's update: every observation is weighted by its stated variance."""

    def step(self, nu: float, s: float, r: float) -> Step:
        """Return the full step, as `UpdateRule.step`."""
        return Step(nu, 1.0, r, 1.0)


@dataclass(frozen=True, eq=False)
class Observation:
    """Computed − observed, with its sensitivity to the physical errors.

    Attributes
    ----------
    name : str
        Of the source; two receivers have two names.
    z : ndarray, (l,)
        Computed − observed.
    H : ndarray, (l, p)
        ``z = H physical + noise``: columns as `ErrorModel` has the physical errors, nine and those
        of the sensors, in level axes.
    R : ndarray, (l,)
        Variances of the noise; its components are independent.
    labels : tuple of str
        One a component, with its unit.
    """

    name: str
    z: Array
    H: Array
    R: Array
    labels: tuple[str, ...]


# Checks of the matrices that a covariance form is given.


#: Tolerance of asymmetry, and of negative eigenvalues, of correlations, in n roundings.
ROUNDINGS = 1e3


def checked_covariance(P: Array) -> Array:
    """Return a covariance as an array of its own, exactly symmetric; (n, n).

    `P` ((n, n)). DataError: p is not square, not finite, not symmetric, or not positive
    semidefinite.
    """
    P = np.array(P, dtype=np.float64, order="C")
    if P.ndim != 2 or P.shape[0] != P.shape[1] or not P.size:
        raise _bad("estimation.covariance-not-square", shape=P.shape)
    if not np.isfinite(P).all():
        i, j = np.argwhere(~np.isfinite(P))[0]
        raise _bad("estimation.covariance-not-finite", value=P[i, j], i=i + 1, j=j + 1)
    variances = np.diagonal(P)
    if (variances < 0.0).any():
        i = int(np.argmin(variances))
        raise _bad("estimation.variance-negative", value=P[i, i], i=i + 1)
    sd = np.sqrt(variances)
    known = sd == 0.0
    if (P[known] != 0.0).any():
        i = int(np.flatnonzero(known & (P != 0.0).any(axis=1))[0])
        raise _bad("estimation.covariance-without-variance", i=i + 1)
    unit = np.where(known, 1.0, sd)
    correlation = P / unit[:, None] / unit
    tolerance = ROUNDINGS * len(P) * np.finfo(np.float64).eps
    if np.abs(correlation - correlation.T).max() > tolerance:
        i, j = np.unravel_index(np.argmax(np.abs(correlation - correlation.T)), P.shape)
        raise _bad(
            "estimation.covariance-not-symmetric", i=i + 1, j=j + 1, value=P[i, j], mirrored=P[j, i]
        )
    P = 0.5 * (P + P.T)
    lowest = float(np.linalg.eigvalsh(0.5 * (correlation + correlation.T))[0])
    if lowest < -tolerance:
        raise _bad("estimation.covariance-indefinite", eigenvalue=lowest)
    return P


def _bad(code: str, **data: Any) -> DataError:
    return DataError(code, quantity="P", **data)


def check_prediction(state: Array, Phi: Array, Q: Array) -> None:
    """Raise `DataError` if the shapes of a prediction do not match."""
    for name, given in (("Phi", Phi), ("Q", Q)):
        if given.shape != state.shape:
            raise DataError(
                "estimation.shape-covariance",
                quantity=name,
                name=name,
                shape=given.shape,
                shape_2=state.shape,
            )


def bad_prediction(row: int, Phi: Array, Q: Array) -> DataError:
    """Return the error to raise for an invalid predicted variance."""
    for name, given in (("Phi", Phi), ("Q", Q)):
        if not np.isfinite(given).all():
            i, j = np.argwhere(~np.isfinite(given))[0]
            return DataError(
                "estimation.row-column",
                quantity=name,
                name=name,
                given=given[i, j],
                i=i + 1,
                j=j + 1,
            )
    return DataError(
        "estimation.predicted-variance-state-no-variance", quantity="Q", at_row=row + 1
    )


def check_observations(x: Array, z: Array, H: Array, R: Array) -> None:
    """Raise `DataError` if the shapes of an epoch's observations do not match."""
    if H.ndim != 2 or H.shape[1] != len(x) or not H.shape[0] == len(z) == len(R):
        raise DataError(
            "estimation.z-shape-h-r-states",
            quantity="H",
            shape=z.shape,
            shape_2=H.shape,
            shape_3=R.shape,
            count=len(x),
        )


def bad_observation(j: int, nu: float, s: float, R: Array) -> DataError:
    """Return the error to raise for an invalid observation j."""
    if not R[j] >= 0.0 or not np.isfinite(R[j]):
        return DataError("estimation.variance-observation", quantity="R", j=j + 1, r=R[j])
    which, number = (
        ("difference from its prediction", nu) if not np.isfinite(nu) else ("expected variance", s)
    )
    return DataError("estimation.observation", quantity="z", which=which, number=number, j=j + 1)


# Sequential update with the observations of an epoch; the rule is evaluated at each.


def take_by_rule(
    expect: Callable[..., tuple[float, float]],
    take: Callable[..., None],
    parts: tuple[Array, Array],
    x: Array,
    observations: tuple[Array, Array, Array],
    rule: UpdateRule | Sequence[UpdateRule],
    work: Array,
) -> Innovations:
    """Update the factors of a covariance and x, in place, by every observation.

    `expect`, `take` (kernels): the two halves of a scalar step; the rule is evaluated between them.
    `parts` ((ndarray, ndarray)): arrays in which the kernels keep a covariance. `x` ((n,)).
    `observations` ((z, H, R)). `work`: passed from `expect` to `take`.
    """
    z, H, R = observations
    matrix, diagonal = parts
    told = np.empty((3, len(z)))
    steps = [one.step for one in rule] if isinstance(rule, Sequence) else [rule.step] * len(z)
    if len(steps) != len(z):
        raise ConfigError(
            "estimation.rules-observations", quantity="rule", count=len(steps), count_2=len(z)
        )
    for j, (r, step) in enumerate(zip(R.tolist(), steps, strict=True)):
        nu, s = expect(matrix, diagonal, x, z, H, j, work)
        if not (0.0 <= r < math.inf and math.isfinite(nu) and math.isfinite(s)):
            raise bad_observation(j, nu, s, R)
        moved, slope, used, weight = step(nu, s, r)
        if weight != 0.0:
            take(matrix, diagonal, x, H, j, work, s, moved, slope, used)
        told[0, j], told[1, j], told[2, j] = nu, s + r, weight
    return Innovations(told[0], told[1], told[2])


def contiguous(*arrays: Array) -> list[Array]:
    """Return contiguous arrays for the kernels."""
    return [np.ascontiguousarray(a, dtype=np.float64) for a in arrays]


def own(array: Array) -> Array:
    """Return a copy that the kernels may change."""
    return np.array(array, dtype=np.float64, order="C")


# The covariance as a matrix: Joseph's update, and the plain one for comparison.


@cache
def _kernels() -> ModuleType:
    from strapdown._kernels import covariance

    return covariance


@dataclass(frozen=True)
class Plain(CovarianceForm):
    """``P <- (1 - K h) P``, kept to show its failure.

    A difference of two matrices that may be equal to rounding: variances become negative with
    observations much more accurate than the prediction.
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

    def _halves(self) -> tuple[Callable[..., tuple[float, float]], Callable[..., None]]:
        kernels = _kernels()
        return kernels.dense_expect, kernels.joseph_take if self._joseph else kernels.plain_take

    def _take_all(self, state: Array, x: Array, *observations: Array) -> int:
        *zhr, told = observations
        return int(_kernels().dense_update(state, x, *zhr, self._joseph, told))

    def matrix(self, state: Array) -> Array:
        """Return P: the state."""
        return state.copy()


@dataclass(frozen=True)
class Joseph(Plain):
    """``P <- (1 - K h) P (1 - K h)' + r K K'``.

    A sum of two positive semidefinite matrices, whatever the gain is: rounding of the gain has a
    second-order effect only. It holds P itself, which costs half of the digits that U-D has.
    """

    name: ClassVar[str] = "joseph"
    summary: ClassVar[str] = "P itself; (1 - K h) P (1 - K h)' + r K K'"
    source: ClassVar[str] = "Bucy and Joseph 1968; as rank-one changes, Bierman 1977, Section V.4"
    _joseph: ClassVar[bool] = True


# The covariance as ``U D U'``: Bierman's update and Thornton's prediction.


@dataclass(frozen=True)
class BiermanThornton(CovarianceForm):
    """Unit upper triangular U and diagonal D; a state holds U above its diagonal and D on it.

    A variance is never computed as a difference: D stays >= 0, and digits are kept as in a square
    root form, without square roots.
    """

    name: ClassVar[str] = "ud"
    summary: ClassVar[str] = "U D U', an orthogonalisation a prediction"
    source: ClassVar[str] = "Bierman 1977, Sections V.3 (update) and VI.4 (Thornton's prediction)"

    def begin(self, P: Array) -> Array:
        """Return the factors of a covariance; see `CovarianceForm.begin`."""
        P = checked_covariance(P)
        out = np.empty_like(P)
        if (row := _kernels().udu_factor(P, out)) >= 0:
            raise _bad("estimation.covariance-indefinite-in-row", i=row + 1)
        return out

    def predict(self, state: Array, Phi: Array, Q: Array) -> Array:
        """Return the factors of ``Phi P Phi' + Q``, by one weighted Gram-Schmidt.

        DataError: shapes that do not fit; Phi or Q that is not finite; Q with a negative
        eigenvalue.
        """
        state, Phi, Q = contiguous(state, Phi, Q)
        check_prediction(state, Phi, Q)
        out = np.empty_like(state)
        row = _kernels().udu_predict(state, Phi, Q, out)
        if row >= 0:
            raise bad_prediction(row, Phi, Q)
        return out

    def _halves(self) -> tuple[Callable[..., tuple[float, float]], Callable[..., None]]:
        return _kernels().ud_expect, _kernels().ud_take

    def _take_all(self, state: Array, x: Array, *observations: Array) -> int:
        return int(_kernels().ud_update(state, x, *observations))

    def matrix(self, state: Array) -> Array:
        """Return ``U D U'``."""
        out = np.empty_like(state)
        _kernels().udu_matrix(np.ascontiguousarray(state), out)
        return out


# The W-D form: columns are appended over an epoch, and orthogonalized once at its end.


@dataclass(frozen=True)
class Chernodarov(BiermanThornton):
    """``P = W D W'`` within an epoch, ``U D U'`` between epochs.

    W begins as ``[Phi U, G]``; an observation deflates it and appends its gain as a column, so
    that the result is Joseph's form in factors. `epoch` orthogonalizes once for prediction and
    observations together, as the source does; `predict` and `update` alone do so once each.
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
        """Update with the observations of an epoch; see `CovarianceForm.update`."""
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
        """Predict and update with one orthogonalization (Eqs. 6-15)."""
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


COVARIANCES: dict[str, type[CovarianceForm]] = {
    "joseph": Joseph,
    "ud": BiermanThornton,
    "wd": Chernodarov,
    "plain": Plain,
}
