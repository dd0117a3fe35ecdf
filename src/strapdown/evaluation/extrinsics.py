"""Extrinsics of two inertial units on one rigid body: rotation, lever arm, clocks, bounds."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.errors import DataError
from strapdown.evaluation.second_log import (
    EvenRates,
    SecondLog,
    align_second_log,
    even_values,
)
from strapdown.sensors.lever_arm import lever_matrix, rate_effect
from strapdown.tables import ACCEL, GYRO, check_imu
from strapdown.tables.checks import index_of, values_of

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

#: Shortest step of the grid on which two logs are compared, s: motion of a body is below 10 Hz.
FINEST = 0.01
#: Cells from row to row: the Gaussian of two cells leaves 0.1 % of the power beyond half of it.
THINNED = 4
#: Order of the autoregressive model that whitens residuals.
ORDER = 10
#: Blocks with independent scores: so many in a log, and their length, s.
BLOCKS, SHORTEST_BLOCK, LONGEST_BLOCK = 40, 1.0, 5.0
#: Steps at most, each with residuals whitened anew, and the last one in standard deviations.
STEPS, SETTLED = 24, 1e-2
#: Fewest degrees of freedom of a bound.
LEAST_FREEDOM = 3.0
#: Standard deviations before the logs are read: rotation (any), rad; lever arm, m; drift.
ANY, ARM, DRIFT = 1.0, 1.0, 3e-4
#: The same of what is not looked for: gyro scale, nonorthogonality; accelerometers against gyros,
#: rad; their delay, s; bias, rad/s, scale and misalignment of the first unit by itself, which a
#: lever arm shows.
SHAPE, TRIADS, DELAY, WHOLE_BIAS, WHOLE_SHAPE = 0.02, 0.01, 0.003, 0.02, 0.01
#: Largest standard deviations of what is observable: rotation, rad; lever arm, m; offset, s; drift.
OBSERVED = {"rotation": np.radians(5.0), "lever_arm": 0.5, "time_offset": 0.05, "clock_drift": 1e-4}
#: Symmetric matrices: scale of each axis, and nonorthogonality.
SYMMETRIC = np.array([np.diag(row) for row in np.eye(3)] + [np.zeros((3, 3))] * 3)
for _k, (_i, _j) in enumerate(((1, 2), (0, 2), (0, 1)), 3):
    SYMMETRIC[_k, _i, _j] = SYMMETRIC[_k, _j, _i] = 1.0


@dataclass(frozen=True)
class Estimate:
    """One parameter with its bound.

    Attributes
    ----------
    name : str
        ``rotation_x`` … (about the axes of the first sensor), ``lever_arm_x`` …, ``time_offset``,
        ``clock_drift``, ``hard_iron_x`` …, ``gyro_bias_x`` …
    unit : str
        SI; ``rad``, ``m``, ``s``, ``1``, ``rad/s``, ``m/s2``, or the magnetometer's.
    value, sd : float
    bound : float
        Half width of the 95 % interval: `sd` times the quantile of Student's t of the blocks of
        residuals that determine it.
    observed : bool
        Whether the log determines it.
    prior_share : float
        Share of its variance that is what was assumed before, 0 to 1.
    """

    name: str
    unit: str
    value: float
    sd: float
    bound: float
    observed: bool
    prior_share: float


@dataclass(frozen=True, eq=False)
class Extrinsics:
    """Second sensor b relative to the first, a: ``v_a = R v_b``, ``t_b = t_a + offset``.

    Attributes
    ----------
    kind : str
        ``imu``, ``magnetometer`` or ``gnss``.
    rotation : ndarray, (3, 3), or None
        R, also C_ab: from the axes of b to those of a; an antenna has no axes.
    estimates : tuple of Estimate
    covariance : ndarray, (n, n)
        Of the estimates, in their order and units.
    hidden : dict of str to tuple of ndarray
        ``rotation``, ``lever_arm``: directions, in the axes of a, along (about) which the motion
        does not determine it.
    start, middle, end : float, s
        Used span, on the clock of a; `middle`: where the offset holds.
    series : DataFrame
        By time on the clock of a: ``a_x`` …, what a measured; ``before_x`` …, what b measured,
        turned by nothing and at its own stamps; ``after_x`` …, the same after the fit.
    residual : dict of str to tuple of float
        Root mean square of the difference before and after, by quantity.
    soft_iron : ndarray, (3, 3) or None
        Of a magnetometer: ``field = soft_iron (reading - hard_iron)`` along its own axes.
    """

    kind: str
    rotation: Array | None
    estimates: tuple[Estimate, ...]
    covariance: Array = field(repr=False)
    hidden: dict[str, tuple[Array, ...]]
    start: float
    middle: float
    end: float
    series: pd.DataFrame = field(repr=False)
    residual: dict[str, tuple[float, float]]
    soft_iron: Array | None = field(default=None, repr=False)

    def __getitem__(self, name: str) -> Estimate:
        return next(one for one in self.estimates if one.name == name)


# Weighted least squares with correlated residuals.


@dataclass(frozen=True, eq=False)
class Residuals:
    """Residuals of a triad, (n, 3), their rows on a grid, and the derivatives of the model.

    `tests`, `slopes`, (n, 3, k): the derivatives as the second and as the first sensor shows them.
    Their noise is independent, so that products of the two are those of the motion: noise would
    make the information of a single one too large (instrumental variables).
    """

    at: Rows
    residual: Array
    tests: Array
    slopes: Array
    block: Rows
    #: Columns of parameters that each block has by itself, (n, 3, l), or None.
    local: Array | None = None


class _Problem(Protocol):
    prior: Array

    def rows(self) -> list[Residuals]: ...

    def off(self) -> Array: ...

    def move(self, step: Array) -> None: ...


def _autoregression(rows: Residuals) -> tuple[Array, float]:
    """Coefficients common to the axes, by Yule and Walker, and the variance of the innovations."""
    from scipy.linalg import solve_toeplitz

    x = rows.residual - rows.residual.mean(axis=0)
    covariance = np.empty(ORDER + 1)
    for lag in range(ORDER + 1):
        near = rows.at[lag:] - rows.at[: len(rows.at) - lag] == lag
        products = (x[lag:] * x[: len(x) - lag])[near]
        covariance[lag] = products.sum() / max(products.size, 1)
    # A lag has fewer pairs than the one before: a taper keeps the matrix positive.
    covariance *= 1.0 - np.arange(ORDER + 1) / max(len(x), ORDER + 2)
    covariance[0] *= 1.0 + 1e-6
    a = np.asarray(solve_toeplitz(covariance[:-1], covariance[1:]))
    return np.asarray(a, np.float64), max(
        float(covariance[0] - a @ covariance[1:]), 1e-12 * float(covariance[0]), 1e-300
    )


def _whitened(rows: Residuals) -> tuple[Array, Array, Array, Rows]:
    """Residuals, tests and slopes without their correlation in time, of unit variance."""
    a, variance = _autoregression(rows)
    whole = np.flatnonzero(rows.at[ORDER:] - rows.at[:-ORDER] == ORDER) + ORDER

    def apply(x: Array) -> Array:
        out: Array = x[whole].copy()
        for k, c in enumerate(a, 1):
            out -= c * x[whole - k]
        return np.asarray(out / np.sqrt(variance))

    r, z, block = apply(rows.residual), apply(rows.tests), rows.block[whole]
    if rows.local is None:
        return r, z, apply(rows.slopes), block
    # The part that a block's own parameters explain is taken out (Frisch and Waugh).
    local = apply(rows.local)
    for low, high in pairwise([*np.flatnonzero(np.diff(block, prepend=-1)), len(block)]):
        q, _ = np.linalg.qr(local[low:high].reshape(-1, local.shape[2]))
        r[low:high] -= (q @ (q.T @ r[low:high].ravel())).reshape(-1, 3)
        part = z[low:high].reshape(-1, z.shape[2])
        z[low:high] = (part - q @ (q.T @ part)).reshape(-1, 3, z.shape[2])
    return r, z, z, block


def _products(tests: Array, slopes: Array) -> Array:
    """Symmetric part of the sum of products over rows and axes, (k, k)."""
    count = tests.shape[2]
    H = tests.reshape(-1, count).T @ slopes.reshape(-1, count)
    return np.asarray(0.5 * (H + H.T))


def _nowhere_negative(H: Array, prior: Array) -> Array:
    """Information without what noise makes negative, by units of what was assumed."""
    size = 1.0 / np.sqrt(prior)
    power, axes = np.linalg.eigh(H * size * size[:, None])
    return np.asarray((axes * np.maximum(power, 0.0)) @ axes.T / size / size[:, None])


def _information(
    white: list[tuple[Array, Array, Array, Rows]], prior: Array
) -> tuple[Array, Array]:
    """Information of the data, nowhere negative, (k, k); and scores, (blocks, k)."""
    count = len(prior)
    H = np.zeros((count, count))
    for _, z, j, _ in white:
        H += _products(z, j)
    H = _nowhere_negative(H, prior)
    scores = np.zeros((max(int(b.max()) for *_, b in white) + 1, count))
    for r, z, _, b in white:
        first = np.flatnonzero(np.diff(b, prepend=-1))
        scores[b[first]] += np.add.reduceat((z * r[:, :, None]).sum(axis=1), first, axis=0)
    return H, scores


def solve(problem: _Problem) -> tuple[Array, Array, Array]:
    """Move a problem to its solution: covariance, freedom, and share of what was assumed."""
    prior = problem.prior
    for _ in range(STEPS):
        white = [_whitened(one) for one in problem.rows()]
        _, scores = _information(white, prior)
        # With the noise in it, as that of the scores: a step of signals alone would go too far.
        whole = sum((_products(z, z) for _, z, _, _ in white), np.diag(prior))
        step = np.linalg.solve(whole, scores.sum(axis=0) - prior * problem.off())
        problem.move(step)
        if (np.abs(step) * np.sqrt(np.diag(whole))).max() < SETTLED:
            break
    white = [_whitened(one) for one in problem.rows()]
    H, scores = _information(white, prior)
    whole = H + np.diag(prior)
    inverse = np.linalg.inv(whole)
    # A block draws the solution to itself: its score as the others see it (CR3, a jackknife).
    z = np.zeros_like(scores)
    for k in range(len(scores)):
        others = H.copy()
        for _, tests, slopes, block in white:
            low, high = np.searchsorted(block, [k, k + 1])
            others -= _products(tests[low:high], slopes[low:high])
        z[k] = np.linalg.solve(_nowhere_negative(others, prior) + np.diag(prior), scores[k])
    assumed = (inverse * prior) @ inverse
    spread = z.T @ z
    # Scores of few blocks scatter: not below what white residuals of that size leave.
    wider = np.sqrt(np.maximum(1.0, np.diag(inverse) / np.diag(spread + assumed)))
    covariance = (spread + assumed) * wider * wider[:, None]
    fourth = np.maximum((z**4).sum(axis=0), 1e-300)
    freedom = np.clip(3.0 * np.diag(spread) ** 2 / fourth, LEAST_FREEDOM, None)
    return covariance, freedom, np.clip(prior * np.diag(inverse), 0.0, 1.0)


def bounded(
    names: list[tuple[str, str]], values: Array, covariance: Array, freedom: Array, share: Array
) -> tuple[tuple[Estimate, ...], dict[str, tuple[Array, ...]]]:
    """Parameters with bounds, and the directions of vectors that the log leaves open."""
    from scipy.special import stdtrit

    sd = np.sqrt(np.diag(covariance))
    hidden: dict[str, tuple[Array, ...]] = {}
    seen = np.ones(len(names), dtype=bool)
    groups = [
        name.rsplit("_", 1)[0] if name[-2:] in ("_x", "_y", "_z") else name for name, _ in names
    ]
    for group in dict.fromkeys(groups):
        at = np.array([k for k, g in enumerate(groups) if g == group])
        limit = OBSERVED.get(group)
        if limit is None:
            seen[at] = share[at] < 0.5
        elif len(at) == 1:
            seen[at] = sd[at] <= limit
        else:
            power, axes = np.linalg.eigh(covariance[np.ix_(at, at)])
            open_ = power > limit**2
            if open_.any():
                hidden[group] = tuple(axes[:, k] for k in np.flatnonzero(open_))
            seen[at] = sd[at] <= limit
    bound = sd * stdtrit(freedom, 0.975)
    found = tuple(
        Estimate(name, unit, float(v), float(s), float(b), bool(o), float(p))
        for (name, unit), v, s, b, o, p in zip(names, values, sd, bound, seen, share, strict=True)
    )
    return found, hidden


def named(group: str, unit: str) -> list[tuple[str, str]]:
    """Names and units of the components of a vector."""
    return [(f"{group}_{axis}", unit) for axis in "xyz"]


def crossed(vectors: Array) -> Array:
    """Change of vectors by a small rotation about each axis, (n, 3, 3)."""
    return -rotation.cross_matrix(vectors)


def rms(values: Array) -> float:
    """Root mean square of the lengths of vectors, (n, 3)."""
    return float(np.sqrt((values**2).sum(axis=1).mean()))


# Two inertial measurement units.

OFFSET_, DRIFT_, TURN_, BIAS_, SHAPE_ = 0, 1, slice(2, 5), slice(5, 8), slice(8, 14)
ARM_, FORCE_, FORCE_SHAPE_, TRIADS_, DELAY_, WHOLE_ = (
    slice(14, 17),
    slice(17, 20),
    slice(20, 26),
    slice(26, 29),
    29,
    slice(30, 33),
)
WHOLE_SHAPE_, WHOLE_FORCE_, WHOLE_TRIADS_ = slice(33, 39), slice(39, 45), slice(45, 48)
PARAMETERS = 48


class _Imus:
    """Rates and specific forces of two units as functions of time, and the parameters.

    ``omega_a = (I + E) R omega_b(u) + bias``, ``f_a + (alpha x r + omega x (omega x r)) =
    (I + E') (I + [psi x]) R f_b(u + delay) + bias'``, ``u = t + offset + drift (t - middle)``.
    """

    def __init__(self, first: pd.DataFrame, second: pd.DataFrame, start: SecondLog) -> None:
        from scipy.interpolate import CubicSpline

        step = max(FINEST, *(float(np.median(np.diff(index_of(t)))) for t in (first, second)))
        self.force = ACCEL[0] in first.columns and ACCEL[0] in second.columns
        columns = [*GYRO, *ACCEL] if self.force else [*GYRO]
        own = values_of(first, columns)
        turned = own[:, :3]
        squares = (turned[:, :, None] * turned[:, None, :]).reshape(-1, 9)
        a, b = (
            even_values(index_of(t), v, step, mean=t.attrs["sampling"] == "mean")
            for t, v in ((first, np.hstack([own, squares])), (second, values_of(second, columns)))
        )
        self.x = np.zeros(PARAMETERS)
        self.x[[OFFSET_, DRIFT_]] = start.offset, 1e-6 * start.drift_ppm
        self.turn = rotation.dcm_from_quaternion(np.array(start.mounting))
        self.middle = start.middle
        cells = np.arange(0, len(a.rate), THINNED)
        inside = self._covered(a, b, cells)
        if inside.sum() < 10 * ORDER:
            raise DataError(
                "evaluation.offset-logs-share",
                quantity="time",
                offset=start.offset,
                inside=float(inside.sum() * THINNED * step),
            )
        self.cells = cells[inside]
        self.time = a.time[self.cells]
        spline = CubicSpline(a.time - a.start, a.rate[:, : len(columns)])
        since = self.time - a.start
        self.own, self.own_slope, self.own_bend = spline(since), spline(since, 1), spline(since, 2)
        self.squares = a.rate[self.cells, len(columns) :].reshape(-1, 3, 3)
        self.spline, self.origin = CubicSpline(b.time - b.start, b.rate), b.start
        length = np.clip((self.time[-1] - self.time[0]) / BLOCKS, SHORTEST_BLOCK, LONGEST_BLOCK)
        self.block = ((self.time - self.time[0]) / length).astype(np.int64)
        sd = np.empty(PARAMETERS)
        sd[[OFFSET_, DRIFT_, DELAY_]] = 10.0, DRIFT, DELAY
        sd[TURN_], sd[BIAS_], sd[SHAPE_] = ANY, 1.0, SHAPE
        sd[ARM_], sd[FORCE_], sd[FORCE_SHAPE_] = ARM, 3.0, SHAPE
        sd[TRIADS_] = sd[WHOLE_TRIADS_] = TRIADS
        sd[WHOLE_], sd[WHOLE_SHAPE_], sd[WHOLE_FORCE_] = WHOLE_BIAS, WHOLE_SHAPE, WHOLE_SHAPE
        self.prior = sd**-2.0
        self.x[BIAS_] = start.bias
        if self.force and start.axis is not None:
            self.turn = self._about(np.array(start.axis))
        self.began = self.turn
        if self.force:
            self.x[FORCE_] = (self.own[:, 3:] - self._other()[0][:, 3:] @ self.turn.T).mean(axis=0)

    def _covered(self, a: EvenRates, b: EvenRates, cells: Rows) -> NDArray[np.bool_]:
        u = a.time[cells] + self.x[OFFSET_] + self.x[DRIFT_] * (a.time[cells] - self.middle)
        margin = 0.5
        near = np.clip(np.round((u - b.start) / b.step), 0, len(b.rate) - 1).astype(np.int64)
        inside = (u > b.start + margin) & (u < b.time[-1] - margin)
        return np.asarray(a.known[cells] & b.known[near] & inside)

    def _other(self, delay: float = 0.0) -> tuple[Array, Array, Array]:
        u = self.time - self.origin + self.x[OFFSET_] + self.x[DRIFT_] * (self.time - self.middle)
        return self.spline(u + delay), self.spline(u + delay, 1), self.spline(u + delay, 2)

    def _about(self, axis: Array) -> Array:
        """The rotation about a single axis of the rates that the specific forces show best."""
        f = self._other()[0][:, 3:]
        best, least = self.turn, np.inf
        for angle in np.radians(np.arange(0.0, 360.0, 10.0)):
            turn = rotation.dcm_from_rotation_vector(angle * axis) @ self.turn
            left = self.own[:, 3:] - f @ turn.T
            cost = float(((left - left.mean(axis=0)) ** 2).sum())
            if cost < least:
                best, least = turn, cost
        return best

    def off(self) -> Array:
        """Parameters less their assumed values."""
        out = self.x.copy()
        out[OFFSET_] = 0.0
        out[TURN_] = rotation.rotation_vector_from_dcm(self.turn @ self.began.T)
        return out

    def move(self, step: Array) -> None:
        step = step.copy()
        turn = step[TURN_] * min(1.0, 0.3 / max(float(np.linalg.norm(step[TURN_])), 1e-12))
        self.turn = rotation.dcm_from_rotation_vector(turn) @ self.turn
        step[TURN_] = 0.0
        step[OFFSET_] = np.clip(step[OFFSET_], -0.1, 0.1)
        self.x = self.x + step

    def _derivatives(
        self, omega: tuple[Array, ...], force: tuple[Array, ...] | None
    ) -> list[Array]:
        """Of both models from rates, their slopes and second slopes, along the first axes."""
        w, dw, _ = omega
        lag = (self.time - self.middle)[:, None]
        G = np.zeros((len(w), 3, PARAMETERS))
        G[:, :, OFFSET_], G[:, :, DRIFT_] = dw, dw * lag
        G[:, :, TURN_], G[:, :, BIAS_] = crossed(w), np.eye(3)
        G[:, :, SHAPE_] = np.einsum("kij,nj->nik", SYMMETRIC, w)
        if force is None:
            return [G]
        f, df, _ = force
        F = np.zeros_like(G)
        F[:, :, OFFSET_], F[:, :, DRIFT_], F[:, :, DELAY_] = df, df * lag, df
        F[:, :, TURN_] = F[:, :, TRIADS_] = crossed(f)
        F[:, :, ARM_] = -lever_matrix(dw, w)
        added = F[:, :, ARM_] @ self.x[ARM_]
        F[:, :, WHOLE_FORCE_] = np.einsum("kij,nj->nik", SYMMETRIC, added)
        F[:, :, WHOLE_TRIADS_] = crossed(added)
        by_rate = rate_effect(w, self.x[ARM_])
        F[:, :, FORCE_], F[:, :, WHOLE_] = np.eye(3), by_rate
        turned = np.einsum("kij,nj->nik", SYMMETRIC, dw)
        F[:, :, WHOLE_SHAPE_] = -rotation.cross_matrix(self.x[ARM_][None])[0] @ turned
        F[:, :, WHOLE_SHAPE_] += by_rate @ np.einsum("kij,nj->nik", SYMMETRIC, w)
        F[:, :, FORCE_SHAPE_] = np.einsum("kij,nj->nik", SYMMETRIC, f)
        return [G, F]

    def modelled(self) -> tuple[Array, Array, Array]:
        """Rates as b shows them, and a's moved specific force, as predicted and as b shows it."""
        x, eye = self.x, np.eye(3)
        E, E_f = (np.tensordot(x[part], SYMMETRIC, 1) for part in (SHAPE_, FORCE_SHAPE_))
        rate = self._other()[0][:, :3] @ ((eye + E) @ self.turn).T + x[BIAS_]
        if not self.force:
            return rate, rate, rate
        true = eye - np.tensordot(x[WHOLE_SHAPE_], SYMMETRIC, 1)
        w, alpha, b = self.own[:, :3], self.own_slope[:, :3] @ true, x[WHOLE_]
        # [w x]² from the smoothed squares, less the bias: [w x]² = w w' - |w|² I.
        S = self.squares - w[:, :, None] * b - b[:, None] * w[:, None, :] + np.outer(b, b)
        S = true @ S @ true
        S = S - np.trace(S, axis1=1, axis2=2)[:, None, None] * eye
        own = eye + np.tensordot(x[WHOLE_FORCE_], SYMMETRIC, 1)
        own = own + rotation.cross_matrix(x[WHOLE_TRIADS_][None])[0]
        moved = self.own[:, 3:] + (rotation.cross_matrix(alpha) + S) @ x[ARM_] @ own.T
        M = (eye + E_f) @ (eye + rotation.cross_matrix(x[TRIADS_])) @ self.turn
        return rate, moved, self._other(x[DELAY_])[0][:, 3:] @ M.T + x[FORCE_]

    def rows(self) -> list[Residuals]:
        """Residuals of rates and of specific forces."""
        rate, moved, force = self.modelled()
        parts = (0, 3) if self.force else (0,)
        there = [v[:, k : k + 3] @ self.turn.T for k in parts for v in self._other()]
        here = [v[:, k : k + 3] for k in parts for v in (self.own, self.own_slope, self.own_bend)]
        here[0] = here[0] - self.x[BIAS_]
        if self.force:
            here[3] = moved - self.x[FORCE_]
        tests, slopes = (
            self._derivatives(tuple(v[:3]), tuple(v[3:]) if self.force else None)
            for v in (there, here)
        )
        left = [self.own[:, :3] - rate, moved - force]
        at = self.cells // THINNED
        return [
            Residuals(at, r, z, j, self.block) for r, z, j in zip(left, tests, slopes, strict=False)
        ]


def between_imus(
    first: pd.DataFrame, second: pd.DataFrame, *, offset: float | None = None
) -> Extrinsics:
    """Find rotation, lever arm, clock offset and drift between two units on one rigid body.

    Parameters
    ----------
    first, second : DataFrame
        Imu tables a and b, each on its own clock and along its own axes.
    offset : float, s, optional
        Clock of b less clock of a, to half a second, if known: it is then not searched.

    Returns
    -------
    Extrinsics
        Without a lever arm if one of the logs has no accelerometers.

    Raises
    ------
    DataError
        As `align_second_log`, with which the fit begins.

    Notes
    -----
    Iterated least squares over rates and specific forces together, whitened by an autoregressive
    model of the residuals. Besides the extrinsics: both biases, scale factors and nonorthogonality
    of each pair of triads, misalignment and delay of accelerometers against gyros, and the whole
    bias of the first gyro, which a lever arm shows. Covariance: a sandwich over blocks, so that
    what the model leaves does not make it too small.
    """
    check_imu(first)
    check_imu(second)
    fit = _Imus(first, second, align_second_log(first, second, offset=offset))
    names = [("time_offset", "s"), ("clock_drift", "1"), *named("rotation", "rad")]
    names += named("gyro_bias", "rad/s") + [(f"gyro_{w}", "1") for w in SHAPE_WORDS]
    if fit.force:
        names += named("lever_arm", "m") + named("accel_bias", "m/s2")
        names += [(f"accel_{w}", "1") for w in SHAPE_WORDS]
    _, before, other = fit.modelled()
    began = fit._other()[0]
    covariance, freedom, share = solve(fit)
    k = len(names)
    values = fit.x.copy()
    values[TURN_] = rotation.rotation_vector_from_dcm(fit.turn)
    estimates, hidden = bounded(names, values[:k], covariance[:k, :k], freedom[:k], share[:k])
    rate, moved, force = fit.modelled()
    own = fit.own[:, :3]
    residual = {"gyro": (rms(own - began[:, :3]), rms(own - rate))}
    if fit.force:
        # Before: turned only, so that the lever arm shows.
        residual["accel"] = (rms(before - other), rms(moved - force))
    return Extrinsics(
        "imu",
        fit.turn,
        estimates,
        covariance[:k, :k],
        hidden,
        float(fit.time[0]),
        fit.middle,
        float(fit.time[-1]),
        compared(fit.time, own, began[:, :3], rate),
        residual,
    )


SHAPE_WORDS = ("scale_1", "scale_2", "scale_3", "shear_1", "shear_2", "shear_3")


def compared(time: Array, own: Array, before: Array, after: Array) -> pd.DataFrame:
    """Table of vectors, (n, 3), of sensor a and of the other before and after the fit."""
    columns = [f"{word}_{axis}" for word in ("a", "before", "after") for axis in "xyz"]
    index = pd.Index(time, name="time")
    return pd.DataFrame(np.hstack([own, before, after]), index=index, columns=columns)
