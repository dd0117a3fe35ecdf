"""Extrinsics of two inertial units on one rigid body: rotation, lever arm, clocks, bounds."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.attitude_algorithms import Quaternion, run_attitude
from strapdown.dsp.delay import lag_correlation, top_peaks
from strapdown.errors import DataError
from strapdown.evaluation.differences import attitude_at
from strapdown.evaluation.second_log import (
    EvenRates,
    SecondLog,
    align_second_log,
    even_rates,
    even_values,
)
from strapdown.increments import increments_from_imu
from strapdown.sensors.lever_arm import lever_matrix, rate_effect
from strapdown.sensors.magnetometer import SHAPES, calibrate_magnetometer
from strapdown.tables import ACCEL, GYRO, MAG, check_imu, imu_table
from strapdown.tables.checks import Array, index_of, values_of

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


# --- a magnetometer beside gyros: rotation, delay and iron -------------------------------

#: Windows within which the field is constant: so many in a log, and their length, s.
WINDOWS, SHORTEST_WINDOW, LONGEST_WINDOW = 24, 3.0, 10.0
#: Fewest readings of a window, and of a fit.
LEAST_OF_WINDOW, LEAST = 30, 100
#: Before the log is read: hard iron as a share of the field, soft iron along each term.
IRON, SOFT = 3.0, 0.1
#: Readings are averaged to this rate at most, Hz.
MAG_RATE = 40.0
#: Share of the change of the field that the gyros must explain.
EXPLAINED = 0.3
#: Delay that is searched about each offset, s, and the step.
SEARCHED, SEARCH_STEP = 0.3, 0.02

LAG_, SLIP_, FACE_, IRON_, SOFT_, RATE_BIAS_, RATE_SCALE_, MAG_PARAMETERS = (
    0,
    1,
    slice(2, 5),
    slice(5, 8),
    slice(8, 13),
    slice(13, 16),
    slice(16, 22),
    22,
)


class _Magnetometer:
    """Readings of windows within each of which the field is constant, and the parameters.

    ``m(t + offset) = c + K R' C_an(t) h_w``: hard iron c, soft iron K, the field h_w of a window
    in the frame that the gyros keep, and their bias and scale, which turn this frame.
    """

    def __init__(
        self, imu: pd.DataFrame, time: Array, mag: Array, offset: float, turn: Array, apart: bool
    ) -> None:
        self.imu, self.rate = imu, values_of(imu, GYRO)
        self.stamps = index_of(imu)
        self.size = float(np.median(np.linalg.norm(mag, axis=1)))
        begin, end = self.stamps[0] + offset, self.stamps[-1] + offset
        length = np.clip((end - begin) / WINDOWS, SHORTEST_WINDOW, LONGEST_WINDOW)
        inside = (time > begin + 0.5) & (time < end - 0.5)
        if inside.sum() < LEAST:
            raise DataError("extrinsics.too-few-readings", quantity="mag", count=int(inside.sum()))
        time, mag = time[inside], mag[inside]
        window = ((time - begin) / length).astype(np.int64)
        step = float(np.median(np.diff(time)))
        row = np.round(time / step).astype(np.int64)
        # A window without a run of readings, or across a pause of the gyros, is not used.
        full = np.bincount(window, minlength=window.max() + 1) > LEAST_OF_WINDOW
        pauses = np.flatnonzero(np.diff(self.stamps) > 0.5)
        for k in pauses:
            low, high = (int((self.stamps[j] + offset - begin) / length) for j in (k, k + 1))
            full[max(low, 0) : high + 1] = False
        kept = full[window]
        if kept.sum() < LEAST:
            raise DataError("extrinsics.too-few-readings", quantity="mag", count=int(kept.sum()))
        self.time, self.mag, self.at = time[kept], mag[kept] / self.size, row[kept]
        names, self.window = np.unique(window[kept], return_inverse=True)
        # Readings of two windows are not neighbors.
        self.at = self.at + 1000 * self.window
        self.middles = begin - offset + (names + 0.5) * length
        self.middle = 0.5 * float(self.time[0] + self.time[-1]) - offset
        self.turn = self.began = turn
        self.x = np.zeros(MAG_PARAMETERS)
        self.x[LAG_] = offset
        start = calibrate_magnetometer(mag)
        self.x[IRON_] = start.hard_iron / self.size
        K = np.linalg.inv(start.soft_iron)
        K = 3.0 * K / np.trace(K) - np.eye(3)
        self.x[SOFT_] = K[0, 0], K[1, 1], K[0, 1], K[0, 2], K[1, 2]
        sd = np.empty(MAG_PARAMETERS)
        sd[LAG_], sd[SLIP_] = 10.0, DRIFT if apart else 1e-9
        sd[FACE_], sd[IRON_], sd[SOFT_] = ANY, IRON, SOFT
        sd[RATE_BIAS_], sd[RATE_SCALE_] = WHOLE_BIAS, SHAPE
        self.prior = sd**-2.0
        self._propagate()

    @property
    def iron(self) -> Array:
        """Soft iron, from the field to the readings, (3, 3)."""
        return np.asarray(np.eye(3) + np.tensordot(self.x[SOFT_], SHAPES, 1))

    def on_first(self) -> Array:
        """Instants of the readings on the clock of the gyros."""
        x = self.x
        return np.asarray(self.time - x[LAG_] - x[SLIP_] * (self.time - x[LAG_] - self.middle))

    def _propagate(self) -> None:
        """Attitude by the gyros, and what their bias and scale turn it by since each middle."""
        from scipy.interpolate import make_interp_spline

        x = self.x
        E = np.eye(3) + np.tensordot(x[RATE_SCALE_], SYMMETRIC, 1)
        rate = np.linalg.solve(E, (self.rate - x[RATE_BIAS_]).T).T
        imu = imu_table(self.stamps, rate, sampling=self.imu.attrs["sampling"])
        table = run_attitude(Quaternion(), increments_from_imu(imu)).attitude
        at = np.clip(self.on_first(), table.index[0], table.index[-1])
        self.C_an = rotation.dcm_from_quaternion(attitude_at(table, at)).transpose(0, 2, 1)
        self.omega = np.column_stack([np.interp(at, self.stamps, c) for c in rate.T])
        times = index_of(table)
        C = rotation.dcm_from_quaternion(values_of(table, ["q_w", "q_x", "q_y", "q_z"]))
        w = np.column_stack([np.interp(times, self.stamps, c) for c in rate.T])
        by_shape = C @ np.einsum("kij,nj->nik", SYMMETRIC, w)
        both = np.concatenate([C, by_shape], axis=2).reshape(len(times), 27)
        mean = 0.5 * (both[1:] + both[:-1]) * np.diff(times)[:, None]
        summed = make_interp_spline(times, np.vstack([np.zeros(27), np.cumsum(mean, axis=0)]), k=1)
        middles = np.clip(self.middles, times[0], times[-1])
        self.turned = (summed(at) - summed(middles)[self.window]).reshape(-1, 3, 9)

    def off(self) -> Array:
        """Parameters less their assumed values."""
        out = self.x.copy()
        out[LAG_] = 0.0
        out[FACE_] = rotation.rotation_vector_from_dcm(self.turn @ self.began.T)
        return out

    def move(self, step: Array) -> None:
        step = step.copy()
        step[FACE_] *= min(1.0, 0.3 / max(float(np.linalg.norm(step[FACE_])), 1e-12))
        self.turn = rotation.dcm_from_rotation_vector(step[FACE_]) @ self.turn
        step[FACE_] = 0.0
        step[LAG_] = np.clip(step[LAG_], -0.05, 0.05)
        step[SOFT_] = np.clip(step[SOFT_], -0.1, 0.1)
        self.x = self.x + step
        self._propagate()

    def fields(self) -> tuple[Array, Array]:
        """Field of each reading's window in the kept frame, and along the first axes, (n, 3)."""
        v = np.linalg.solve(self.iron, (self.mag - self.x[IRON_]).T).T @ self.turn.T
        v = np.einsum("nji,nj->ni", self.C_an, v)
        count = np.bincount(self.window)
        means = np.column_stack([np.bincount(self.window, c) / count for c in v.T])
        h_n = means[self.window]
        return h_n, np.einsum("nij,nj->ni", self.C_an, h_n)

    def rows(self) -> list[Residuals]:
        """Residuals of the readings."""
        h_n, h_a = self.fields()
        to_m = self.iron @ self.turn.T
        h_m = h_a @ self.turn
        left = self.mag - self.x[IRON_] - h_m @ self.iron
        J = np.zeros((len(left), 3, MAG_PARAMETERS))
        # The field turns against the body; a later offset is an earlier instant.
        change = np.cross(self.omega, h_a) @ to_m.T
        J[:, :, LAG_] = change
        J[:, :, SLIP_] = change * (self.time - self.x[LAG_] - self.middle)[:, None]
        J[:, :, FACE_] = to_m @ -crossed(h_a)
        J[:, :, IRON_] = np.eye(3)
        J[:, :, SOFT_] = np.einsum("kij,nj->nik", SHAPES, h_m)
        by_turn = to_m @ self.C_an @ -rotation.cross_matrix(h_n) @ self.turned
        J[:, :, RATE_BIAS_], J[:, :, RATE_SCALE_] = by_turn[:, :, :3], by_turn[:, :, 3:]
        return [Residuals(self.at, left, J, J, self.window, to_m @ self.C_an)]


def _change_of_field(time: Array, mag: Array, step: float) -> tuple[EvenRates, Array]:
    """Smoothed readings on an even grid, and their slope."""
    from scipy.interpolate import CubicSpline

    even = even_values(time, mag, step, mean=False)
    return even, CubicSpline(even.time, even.rate)(even.time, 1)


def _map_of_rates(rate: Array, m: Array, slope: Array) -> tuple[Array, float]:
    """Matrix Q that maps rates to those in the magnetometer's axes, and the share unexplained.

    ``dm/dt = m x (Q omega)``, by least squares; `rate` without its mean.
    """
    lever = rotation.cross_matrix(m)
    normal = np.einsum("nij,na,nik,nb->jakb", lever, rate, lever, rate, optimize=True)
    right = np.einsum("nij,na,ni->ja", lever, rate, slope, optimize=True)
    normal = normal.reshape(9, 9)
    Q = np.linalg.solve(normal + 1e-6 * np.trace(normal) * np.eye(9), right.ravel())
    power = max(float((slope**2).sum()), 1e-300)
    return Q.reshape(3, 3), 1.0 - float(Q @ right.ravel()) / power


def _coarse_magnetometer(
    imu: pd.DataFrame, time: Array, mag: Array, offset: float | None
) -> tuple[float, Array]:
    """Offset and rotation C_am, to begin with."""
    step = max(SEARCH_STEP, *(float(np.median(np.diff(t))) for t in (time, index_of(imu))))
    rates = even_rates(imu, step)
    field_, slope = _change_of_field(time, calibrate_magnetometer(mag).apply(mag), step)
    if offset is None:
        x = np.linalg.norm(rates.rate, axis=1)
        y = np.linalg.norm(slope, axis=1)
        least = 0.5 * min(len(x), len(y))
        lags, score = lag_correlation(x, y, rates.known, field_.known, least)
        peaks = lags[top_peaks(score, 5)] if score.size else np.empty(0)
        if not peaks.size:
            raise DataError("extrinsics.clocks-apart", quantity="time")
        centers = [field_.start - rates.start - lag * step for lag in peaks]
    else:
        centers = [offset]
    best = (np.inf, 0.0, np.eye(3))
    for center in centers:
        for near in np.arange(-SEARCHED, SEARCHED + 1e-9, step):
            there = field_.time - center - near
            cell = np.round((there - rates.start) / step).astype(np.int64)
            good = (cell >= 0) & (cell < len(rates.rate)) & field_.known
            good[good] &= rates.known[cell[good]]
            if good.sum() < 50:
                continue
            rate = np.column_stack([np.interp(there[good], rates.time, c) for c in rates.rate.T])
            Q, left = _map_of_rates(rate, field_.rate[good], slope[good])
            if left < best[0]:
                best = left, center + near, Q
    if best[0] > 1.0 - EXPLAINED:
        raise DataError(
            "extrinsics.field-does-not-turn", quantity="mag", share=100.0 * max(0.0, 1.0 - best[0])
        )
    Q = best[2]
    u, _, vt = np.linalg.svd(Q)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    return best[1], np.asarray(((u * sign) @ vt).T)


def imu_to_magnetometer(
    imu: pd.DataFrame,
    magnetometer: pd.DataFrame,
    *,
    offset: float | None = 0.0,
    apart: bool = False,
) -> Extrinsics:
    """Find the rotation of a magnetometer against gyros, its iron, and its delay.

    Parameters
    ----------
    imu : DataFrame
        Imu table, a; its gyros are used.
    magnetometer : DataFrame
        ``mag_x mag_y mag_z`` by time in s, b, along its own axes and in any unit.
    offset : float, s, optional
        Clock of b less clock of a, to 0.3 s; None: it is searched.
    apart : bool
        Whether both have clocks of their own, which drift.

    Raises
    ------
    DataError
        There are too few readings, or the gyros do not explain the change of the field.

    Notes
    -----
    Within a window of 3 to 10 s the field is constant in the frame that the gyros keep; its
    strength and direction in each window are free, so that a field that changes from place to
    place is allowed. Rotation and soft iron are a polar decomposition: soft iron is symmetric, and
    what is not symmetric counts as rotation. Gyros do not show whether the readings, or those of
    one axis, have the wrong sign: a left-handed magnetometer looks like one that is turned by 180°.
    """
    check_imu(imu)
    table = magnetometer[MAG].dropna()
    time, mag = index_of(table), values_of(table, MAG)
    # Readings that are held from row to row are late; the first one is not.
    new = np.r_[True, (np.diff(mag, axis=0) != 0.0).any(axis=1)] & mag.any(axis=1)
    time, mag = time[new], mag[new]
    if len(time) < LEAST:
        raise DataError("extrinsics.too-few-readings", quantity="mag", count=len(time))
    many = int(MAG_RATE**-1 / float(np.median(np.diff(time))) + 0.5)
    if many > 1:
        kept = len(time) // many * many
        time = time[:kept].reshape(-1, many).mean(axis=1)
        mag = mag[:kept].reshape(-1, many, 3).mean(axis=1)
    if time[-1] - time[0] < 2.0 * SHORTEST_WINDOW:
        raise DataError("extrinsics.too-few-readings", quantity="mag", count=len(time))
    at, turn = _coarse_magnetometer(imu, time, mag, offset)
    fit = _Magnetometer(imu, time, mag, at, turn, apart)
    covariance, freedom, share = solve(fit)
    h_n, h_a = fit.fields()
    strength = float(np.linalg.norm(h_n, axis=1).mean())
    names = [("time_offset", "s"), ("clock_drift", "1"), *named("rotation", "rad")]
    names += named("hard_iron", "field") + [(f"soft_iron_{k}", "1") for k in range(1, 6)]
    values = fit.x.copy()
    values[FACE_] = rotation.rotation_vector_from_dcm(fit.turn)
    scale = np.ones(MAG_PARAMETERS)
    scale[IRON_] = fit.size
    used = np.array([k for k in range(len(names)) if apart or k != SLIP_])
    covariance = covariance * scale * scale[:, None]
    covariance = covariance[np.ix_(used, used)]
    estimates, hidden = bounded(
        [names[k] for k in used], (values * scale)[used], covariance, freedom[used], share[used]
    )
    iron = np.linalg.inv(fit.iron)
    calibrated = (fit.mag - fit.x[IRON_]) @ iron
    turned = calibrated @ fit.turn.T
    raw = rms((fit.mag - h_a) / strength), rms((turned - h_a) / strength)
    return Extrinsics(
        "magnetometer",
        fit.turn,
        estimates,
        covariance,
        hidden,
        float(fit.on_first()[0]),
        fit.middle,
        float(fit.on_first()[-1]),
        compared(fit.on_first(), h_a / strength, fit.mag / strength, turned / strength),
        {"mag": raw},
        iron * 3.0 / np.trace(iron),
    )
