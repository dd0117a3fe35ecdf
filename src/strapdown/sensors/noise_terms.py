"""Noise terms of a stationary channel, with intervals, by maximum likelihood."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import DataError
from strapdown.tables.checks import Array
from strapdown.tables.on_disk import let_go

# --- Allan, modified Allan and Hadamard deviations, and the shapes of noise terms -------

#: Averaging times of a decade.
PER_DECADE = 8
#: Parts of a record at the longest averaging time: IEEE Std 952 trusts no estimate from fewer.
LEAST_PARTS = 9
#: Samples from which noise terms are estimated.
LEAST_SAMPLES = 1000


def deviations(
    rate: ArrayLike | Sequence[ArrayLike], dt: float, factors: Iterable[int] | None = None
) -> pd.DataFrame:
    """Overlapping Allan, modified Allan and overlapping Hadamard deviations of a rate.

    With the mean rate over τ = m dt beginning at sample k as y_k, and < > over all k:
    σ² = <(y_{k+m} - y_k)²>/2; the modified one has the mean of m successive differences in place of
    one; Hadamard's is <(y_{k+2m} - 2 y_{k+m} + y_k)²>/6 (IEEE Std 952-1997, annex C; Riley and
    Howe, NIST Special Publication 1065).

    Parameters
    ----------
    rate : array_like, (n,), u, or list of them
        Of several records the means of squares are over the differences within each.
    dt : float, s
        Sample interval.
    factors : iterable of int, optional
        Values of m; by default about eight a decade, up to a ninth of the record.

    Returns
    -------
    DataFrame
        Indexed by ``tau`` in s: ``allan``, ``modified``, ``hadamard`` in u, NaN where the record is
        too short; ``relative_sd``, standard deviation of the Allan deviation relative to it,
        1/√(2(n/m - 1)) (IEEE Std 952, C.1), n/m - 1 summed over records.
    """
    from strapdown._kernels.allan import integrate, overlapping_variances

    several = isinstance(rate, list) and np.ndim(rate[0]) == 1
    given: Any = rate if several else [rate]
    records = [np.ascontiguousarray(one, dtype=np.float64) for one in given]
    n = max(one.size for one in records)
    chosen = _factors(n) if factors is None else np.array(sorted(set(factors)), dtype=np.int64)
    if n < 3 or not chosen.size or chosen[0] < 1 or 2 * chosen[-1] > n:
        raise DataError("allan.too-short", samples=n, least=LEAST_SAMPLES)
    sums, scale = np.zeros((chosen.size, 6)), chosen.astype(np.float64)
    parts = np.zeros(chosen.size)
    for values in records:
        phase = np.empty(values.size + 1)
        integrate(values, float(values.mean()), phase)
        let_go(values)
        short = int(np.searchsorted(chosen, values.size // 2, side="right"))
        own = np.empty((short, 6))
        overlapping_variances(phase, chosen[:short], own)
        sums[:short] += own
        parts[:short] += values.size / chosen[:short] - 1.0
    with np.errstate(divide="ignore", invalid="ignore"):
        found = {
            "allan": np.sqrt(sums[:, 0] / (2.0 * sums[:, 3])) / scale,
            "modified": np.sqrt(sums[:, 1] / (2.0 * sums[:, 4])) / scale**2,
            "hadamard": np.sqrt(sums[:, 2] / (6.0 * sums[:, 5])) / scale,
            "relative_sd": 1.0 / np.sqrt(2.0 * parts),
        }
    return pd.DataFrame(found, index=pd.Index(scale * dt, name="tau"))


def _factors(n: int) -> NDArray[np.int64]:
    most = max(n // LEAST_PARTS, 1)
    count = int(PER_DECADE * math.log10(most)) + 1
    return np.unique(np.rint(np.geomspace(1, most, max(count, 1))).astype(np.int64))


# Noise terms. Each is a process of the rate y with a known shape; x is its integral, and g(t) the
# generalized covariance of x: the variance of any sum of values of x with weights that annihilate
# 1, t (and t² within g, a constant rate) is the sum over pairs of weights times g of their distance
# (Matheron 1973, doi:10.1017/S0001867800039379). Means of y over blocks are differences of x, so
# their covariance is exact for every block length, without windows, leakage or aliasing.

#: Symbols of the terms with a coefficient, as in IEEE Std 952, and that of a Gauss-Markov process.
TERMS = ("Q", "N", "B", "K", "GM")


def shape(term: str, t: Array, correlation: float = math.inf) -> Array:
    """Generalized covariance of the integral of a term with coefficient one.

    `t` (s). With S(f) the two-sided spectrum of the rate, and σ²(τ) the Allan variance
    (IEEE Std 952-1997, annex C):

    - Q, quantization of the integral: S = Q² (2 - 2 cos 2πf dt)/dt, σ² = 3 Q²/τ²;
    - N, angle or velocity random walk: S = N², σ² = N²/τ (N at 1 s of the slope -1/2);
    - B, bias instability, flicker: S = B²/(2πf), σ² = (2 ln 2/π) B² (B = flat minimum/0.664);
    - K, rate random walk: S = K²/(2πf)², σ² = K² τ/3 (K at 3 s of the slope +1/2);
    - GM, Gauss-Markov process of standard deviation s and correlation time T:
      S = 2 s² T/(1 + (2πfT)²).

    The rate ramp, σ² = R² τ²/2, is deterministic.
    """
    d = np.abs(t)
    if term == "Q":
        return np.asarray(d == 0.0, dtype=np.float64)
    if term == "N":
        return -0.5 * d
    if term == "B":
        return np.asarray(d**2 * np.log(np.where(d > 0.0, d, 1.0)) / (2.0 * math.pi))
    if term == "K":
        return d**3 / 12.0
    h = d / correlation
    # For a short time the difference of large numbers is a series; h is what t² annihilates.
    series = h**2 / 2.0 - h**3 / 6.0 + h**4 / 24.0 - h**5 / 120.0
    return np.asarray(-(correlation**2) * np.where(h < 1e-2, series, np.expm1(-h) + h))


def block_covariance(term: str, count: int, block: float, correlation: float = math.inf) -> Array:
    """Covariance of means of a term over `count` blocks of `block` s, up to a constant."""
    lags = np.asarray(np.arange(-1, count + 1) * block, dtype=np.float64)
    g = shape(term, lags, correlation)
    by_lag = (2.0 * g[1:-1] - g[2:] - g[:-2]) / block**2
    at = np.arange(count)
    return np.asarray(by_lag[np.abs(at[:, None] - at[None, :])])


def allan_model(terms: Mapping[str, float], tau: ArrayLike, correlation: float = math.inf) -> Array:
    """Allan deviation of a sum of terms, with the ramp as ``R``."""
    t: Array = np.asarray(tau, dtype=np.float64)
    variance: Array = np.zeros(t.shape)
    for term, value in terms.items():
        if term == "R":
            variance += 0.5 * (value * t) ** 2
            continue
        g = [shape(term, np.asarray(k * t, np.float64), correlation) for k in (0.0, 1.0, 2.0)]
        variance += value**2 * (6.0 * g[0] - 8.0 * g[1] + 2.0 * g[2]) / (2.0 * t**2)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)), np.float64)


# The likelihood. The record is cut into runs of blocks; the mean of a run is a block of the next
# level. Within a run, differences from its mean are Gaussian with a covariance that the terms give
# exactly, and for white noise independent of every other level. The few runs of the last level are
# one vector, of which mean and ramp are projected out (restricted maximum likelihood).

#: Blocks in a run and in the last level, at most; and shortest run of shapes kept where a sensor's
#: own filter colors the highest frequencies.
RUN, TOP, LEAST_RUN = 64, 96, 7
#: Rows by which matrices of a stack may differ.
FILLED = 2
#: Twice the gain in log-likelihood that a further parameter must bring: a chance of 0.1 %.
DEMANDED = 10.8
#: Twice the log-likelihood by which a model may be worse and yet not be excluded.
ALIKE = 6.6
#: Quantiles of chi-square with one degree: 95 % two-sided, and 95 % one-sided.
TWO_SIDED, ONE_SIDED = 3.841, 2.706
#: Relative standard deviation of a variance below which its logarithm is as good as Gaussian.
WELL_KNOWN = 0.1
#: A level whose shapes exceed the model by this share, beyond 5 standard deviations, is colored.
COLORED, SURELY = 0.05, 5.0
#: Steps of a fit at most; and gain in log-likelihood, expected or seen, below which it ends.
ITERATIONS, NO_GAIN = 40, 1e-5
#: Least variance, in units of that of the record; and furthest end of an interval, logarithms.
TINY, FURTHEST = 1e-30, 30.0
#: Correlation times of a Gauss-Markov process in a record, at least: a slower one is a random walk,
#: if its driving noise has that one's variance within its interval and this factor.
SLOWEST, SAME = 10.0, 1.5


@dataclass(frozen=True, eq=False)
class Level:
    """Second moments of the runs of one level.

    Attributes
    ----------
    block : float, s
    count : int
        Blocks in a run.
    basis : ndarray, (count, k)
        Orthonormal, without the mean; in the last level without the ramp.
    moments : ndarray, (k, k), u²
        Mean product of the coefficients in the basis.
    runs : int
    record : int
        Of several records, which are independent.
    """

    block: float
    count: int
    basis: Array
    moments: Array
    runs: int
    record: int = 0

    def covariance(self, term: str, correlation: float) -> Array:
        """Covariance of the coefficients by a term with coefficient one."""
        whole = block_covariance(term, self.count, self.block, correlation)
        return np.asarray(self.basis.T @ whole @ self.basis)

    @property
    def halves(self) -> list[NDArray[np.intp]]:
        """Columns of the basis that are alike from either end, and those of opposite sign.

        A stationary process does not correlate them: its covariance is the same from either end.
        With a temperature that is projected out, all columns together.
        """
        mirrored = np.rint((self.basis * self.basis[::-1]).sum(axis=0))
        sides = [np.flatnonzero(mirrored == side) for side in (1.0, -1.0)]
        whole = np.arange(self.basis.shape[1])
        if np.abs(self.basis[::-1] - mirrored * self.basis).max(initial=0.0) > 1e-9:
            sides = [whole]
        return [one for one in sides if one.size]

    def lowest(self, kept: int) -> Level:
        """The level with its `kept` lowest frequencies alone."""
        basis, moments = self.basis[:, :kept], self.moments[:kept, :kept]
        return replace(self, basis=basis, moments=moments)


def levels_of(
    rate: Array, dt: float, beside: Array | None = None, record: int = 0
) -> tuple[tuple[Level, ...], Array, Array, float]:
    """Levels of a record, and of the last one the means, what is projected out, and the block in s.

    `beside`: a regressor, such as temperature, that is projected out with mean and ramp.
    """
    n = rate.size
    whole = max(1, math.ceil(n / TOP))
    count = max(1, math.ceil(math.log(whole) / math.log(RUN) - 1e-9)) if whole > 1 else 0
    run = max(2, math.ceil(whole ** (1.0 / count) - 1e-9)) if count else 1
    basis = _cosines(run) if count else np.empty((0, 0))
    means, block, found = rate, dt, []
    for _ in range(count):
        rows = means[: means.size // run * run].reshape(-1, run)
        second = np.zeros((run, run))
        for first in range(0, len(rows), 65536):
            part = rows[first : first + 65536]
            second += part.T @ part
        moments = basis.T @ second @ basis / len(rows)
        found.append(Level(block, run, basis, moments, len(rows), record))
        means, block = rows.mean(axis=1), block * run
    middle = (np.arange(means.size) - 0.5 * (means.size - 1)) * block
    line = np.column_stack([np.ones(means.size), middle])
    if beside is not None:
        over = run**count
        warm = beside[: means.size * over].reshape(-1, over).mean(axis=1)
        line = np.column_stack([line, warm - warm.mean()])
    last = _complement(line) if beside is not None else _complement_by_sides(line)
    z = last.T @ means
    found.append(Level(block, means.size, last, np.outer(z, z), 1, record))
    return tuple(found), means, line, block


def _complement(line: Array) -> Array:
    """Orthonormal columns across those of `line`."""
    return np.asarray(np.linalg.svd(line / np.abs(line).max(axis=0))[0][:, line.shape[1] :])


def _complement_by_sides(line: Array) -> Array:
    """Orthonormal columns across mean and ramp, alike from either end or of opposite sign."""
    n = len(line)
    unit = np.eye(n)
    even, odd = unit + unit[::-1], unit - unit[::-1]
    half = n // 2
    found = []
    for columns, one in ((even[:, : n - half], line[:, 0]), (odd[:, :half], line[:, 1])):
        own = columns / np.linalg.norm(columns, axis=0)
        found.append(own @ _complement((own.T @ one)[:, None]))
    return np.hstack(found)


def _cosines(count: int) -> Array:
    """Orthonormal cosines of the second kind without the mean, the slowest first."""
    at, k = np.arange(count) + 0.5, np.arange(1, count)
    return np.asarray(np.sqrt(2.0 / count) * np.cos(math.pi / count * np.outer(at, k)))


@dataclass(frozen=True, eq=False)
class _Fit:
    """Maximum of the likelihood over the variances (squared coefficients) of some terms."""

    names: tuple[str, ...]
    variances: Array
    value: float  # log-likelihood
    information: Array  # of the logarithms of the variances
    correlation: float = math.inf
    edge: bool = False  # the best correlation time is that or beyond: never the choice

    @property
    def penalized(self) -> float:
        if self.edge:
            return -math.inf
        count = len(self.names) + (1 if "GM" in self.names else 0)
        return 2.0 * self.value - DEMANDED * count

    def variance(self, name: str) -> float:
        return float(self.variances[self.names.index(name)])


#: Covariances of terms on levels, by the geometry of those: of all channels of a log the same.
Shapes = dict[Any, tuple[dict[Any, list[Array]], dict[Any, list[Array]]]]


class _Record:
    """Levels of a record with the covariances of the terms on them, each made once."""

    def __init__(self, levels: tuple[Level, ...], known: Shapes) -> None:
        self.levels = levels
        # Parts that are not correlated, each by its level and columns; those of nearly one size
        # are one stack of matrices, filled up with ones on the diagonal.
        parts = [(k, half) for k, one in enumerate(levels) for half in one.halves]
        self._alike: list[list[tuple[int, NDArray[np.intp]]]] = []
        for part in sorted(parts, key=lambda one: one[1].size):
            if not self._alike or part[1].size > self._alike[-1][0][1].size + FILLED:
                self._alike.append([])
            self._alike[-1].append(part)
        self._moments = self._stacked([one.moments for one in levels])
        self._unit = self._stacked([np.eye(len(one.moments)) for one in levels])
        self._fill = [np.eye(len(unit[0])) - unit for unit in self._unit]
        self._runs = [np.array([float(levels[k].runs) for k, _ in group]) for group in self._alike]
        geometry = tuple((one.block, one.count, one.basis.tobytes()) for one in levels)
        self._made, self._shapes = known.setdefault(geometry, ({}, {}))

    def _stacked(self, every: list[Array]) -> list[Array]:
        out = []
        for group in self._alike:
            size = group[-1][1].size
            stack = np.zeros((len(group), size, size))
            for one, (k, half) in zip(stack, group, strict=True):
                one[: half.size, : half.size] = every[k][np.ix_(half, half)]
            out.append(stack)
        return out

    def covariances(self, term: str, correlation: float) -> list[Array]:
        """Covariances of the coefficients of all levels by a term with coefficient one."""
        key = (term, correlation if term == "GM" else 0.0)
        if key not in self._made:
            if term == "GM" and len(self._made) > 60:
                for made in (self._made, self._shapes):
                    for old in [k for k in made if k[0] == "GM"]:
                        del made[old]
            self._made[key] = [one.covariance(term, correlation) for one in self.levels]
        return self._made[key]

    def _stacks(self, term: str, correlation: float) -> list[Array]:
        key = (term, correlation if term == "GM" else 0.0)
        if key not in self._shapes:
            self._shapes[key] = self._stacked(self.covariances(term, correlation))
        return self._shapes[key]

    def likelihood(self, variances: Array, shapes: list[list[Array]]) -> tuple[float, Array, Array]:
        """Log-likelihood, its gradient and the information in the logarithms of the variances."""
        count = len(variances)
        value, slope, information = 0.0, np.zeros(count), np.zeros((count, count))
        stacks = zip(self._moments, self._unit, self._fill, self._runs, strict=True)
        for k, (moments, unit, fill, runs) in enumerate(stacks):
            parts = [v * s[k] for v, s in zip(variances, shapes, strict=True)]
            sigma = sum(parts, fill)
            try:
                factor = np.linalg.cholesky(sigma)
            except np.linalg.LinAlgError:
                return -math.inf, slope, information
            inverse = np.linalg.inv(sigma)
            fitted = inverse @ moments
            log_det = 2.0 * np.log(np.diagonal(factor, 0, 1, 2)).sum(axis=1)
            value -= 0.5 * float(runs @ (log_det + np.trace(fitted, 0, 1, 2)))
            # All together are the unit matrix; the first, of which most is, needs no product.
            weighted = np.empty((count, *sigma.shape))
            for i in range(1, count):
                np.matmul(inverse, parts[i], out=weighted[i])
            weighted[0] = unit - weighted[1:].sum(axis=0)
            by_runs = runs[:, None, None]
            excess = by_runs * (fitted.transpose(0, 2, 1) - unit)
            slope += 0.5 * weighted.reshape(count, -1) @ excess.ravel()
            turned = (by_runs * weighted.transpose(0, 1, 3, 2)).reshape(count, -1)
            information += 0.5 * turned @ weighted.reshape(count, -1).T
        return value, slope, information

    def fit(
        self,
        names: tuple[str, ...],
        start: Array,
        correlation: float = math.inf,
        held: int = -1,
    ) -> _Fit:
        """Maximize over the logarithms of the variances by scoring; `held`: one that stays."""
        shapes = [self._stacks(name, correlation) for name in names]
        free = [k for k in range(len(names)) if k != held]
        log = np.log(np.maximum(start, TINY))
        value, slope, information = self.likelihood(np.exp(log), shapes)
        for _ in range(ITERATIONS):
            if not free or not math.isfinite(value):
                break
            inner = information[np.ix_(free, free)]
            # A term that the record does not show has no information; it shrinks by steps.
            inner = inner + 1e-3 * np.eye(len(free))
            step = np.clip(np.linalg.solve(inner, slope[free]), -3.0, 3.0)
            if 0.5 * float(slope[free] @ step) < NO_GAIN:
                break
            size = 1.0
            while size > 1e-3:
                trial = log.copy()
                trial[free] += size * step
                new, s, i = self.likelihood(np.exp(trial), shapes)
                if new >= value - 1e-9:
                    break
                size *= 0.5
            else:
                break
            gained = new - value
            log, value, slope, information = trial, new, s, i
            if gained < NO_GAIN:
                break
        return _Fit(names, np.exp(log), value, information, correlation)


@dataclass(frozen=True)
class NoiseTerm:
    """One noise term of a channel.

    Attributes
    ----------
    name : str
        ``Q``, ``N``, ``B``, ``K``, ``R``, or ``GM`` (standard deviation) and ``T`` (its correlation
        time in s); ``C``, the effect of temperature in u/°C, of either sign.
    value : float
        In u s (Q), u √s (N), u (B, GM), u/√s (K), u/s (R), u being rad/s or m/s²; NaN if the record
        does not show the term.
    low, high : float
        95 % interval; of a term that is not observable zero and its 95 % upper bound, or NaN.
    observable : bool
        Whether every model that the record does not exclude has the term.
    """

    name: str
    value: float
    low: float
    high: float
    observable: bool


@dataclass(frozen=True, eq=False)
class ChannelNoise:
    """Noise of one channel.

    Attributes
    ----------
    terms : tuple of NoiseTerm
    model : mapping of str to float
        Coefficients of the model chosen, observable or not; ``R`` if the ramp is.
    correlation_time : float, s
        Of its Gauss-Markov process; infinite without one.
    up_to_hz : float
        Highest frequency that was used: half the rate, or less where the noise is colored.
    alike : bool
        Whether another model without one of its slow terms describes the record as well.
    """

    terms: tuple[NoiseTerm, ...]
    model: Mapping[str, float]
    correlation_time: float
    up_to_hz: float
    alike: bool = False

    def term(self, name: str) -> NoiseTerm:
        """Return the term of a name."""
        return next(one for one in self.terms if one.name == name)


def noise_terms(rate: ArrayLike, dt: float, temperature: ArrayLike | None = None) -> ChannelNoise:
    """Noise terms of a stationary channel, as `pooled_terms` of one record.

    `rate` ((n,), u): its mean does not matter. `dt` (s). `temperature` ((n,), °C).
    """
    return pooled_terms([rate], [dt], [temperature])


def pooled_terms(
    rates: Sequence[ArrayLike],
    steps: Sequence[float],
    temperatures: Sequence[ArrayLike | None],
    known: Shapes | None = None,
) -> ChannelNoise:
    """Noise terms of a stationary channel from one or more records, by maximum likelihood.

    Parameters
    ----------
    rates : sequence of array_like, (n,), u
        Angular rate or specific force in each record; its means do not matter.
    steps : sequence of float, s
        Sample interval of each.
    temperatures : sequence of array_like, (n,), °C, or None
        The effect is estimated with the noise, and is excluded from it.
    known : dict, optional
        Kept from one channel to the next of the same records, whose covariances have one shape.

    Returns
    -------
    ChannelNoise
        Models of white noise, with and without Q, and with none, B, K, both, a Gauss-Markov
        process, or that with K, are compared; a parameter must gain 5.4 in log-likelihood. The
        intervals are those of the likelihood ratio (profile), where the variance of a term is
        known to worse than 10 %, else Gaussian in its logarithm. Records are independent, each
        with a mean and a ramp of its own in the likelihood of the noise; R and C are what they
        have in common.

    Raises
    ------
    DataError
        A record has fewer than 1000 samples, or a channel is constant.
    """
    unit, every = 0.0, list[Level]()
    ends: list[tuple[Array, Array, float]] = []
    for k, (rate, dt, temperature) in enumerate(zip(rates, steps, temperatures, strict=True)):
        given = np.asarray(rate, dtype=np.float64)
        if given.size < LEAST_SAMPLES:
            raise DataError("allan.too-short", samples=given.size, least=LEAST_SAMPLES)
        if not np.ptp(given) > 0.0:
            raise DataError("allan.constant")
        values = given - given.mean()
        white = float(values @ values) / values.size * dt
        # In units of its own size, so that no number of the fit depends on the unit.
        unit = unit or math.sqrt(white)
        values /= unit
        beside = None if temperature is None else np.asarray(temperature, dtype=np.float64)
        own, means, line, block = levels_of(values, dt, beside, k)
        if beside is not None:
            share = np.linalg.lstsq(line, means, rcond=None)[0][2]
            own = levels_of(values - share * (beside - beside.mean()), dt, beside, k)[0]
        every += own
        ends.append((means, line, block))
    levels, whole = tuple(every), True
    shapes: Shapes = {} if known is None else known
    span = max(np.size(rate) * dt for rate, dt in zip(rates, steps, strict=True))
    while True:
        record = _Record(levels, shapes)
        fits = _models(record, steps[0], span, whole)
        best = max(fits, key=lambda one: one.penalized)
        cut = _without_colored(levels, record, best)
        if cut is None:
            break
        levels, whole = cut, False
    terms = _intervals(record, fits, best)
    walk = next(one.high for one in terms if one.name == "K")
    models = [*_alike(fits, best), _with_walk(best, walk**2)]
    for column, name in enumerate(("R", "C"), 1):
        held = [end for end in ends if end[1].shape[1] > column]
        if held:
            slopes = [_combined([_slope(f, *end, column) for end in held]) for f in models]
            terms.append(_slope_term(name, slopes))
    ramp = next(one for one in terms if one.name == "R")
    model = {name: math.sqrt(best.variance(name)) for name in best.names}
    if ramp.observable:
        model["R"] = ramp.value
    doubtful = [t for t in terms if t.name in ("B", "K", "GM") and t.value > 0.0]
    first = levels[0]
    return ChannelNoise(
        tuple(_scaled(one, unit) for one in terms),
        {name: unit * value for name, value in model.items()},
        best.correlation,
        first.basis.shape[1] / (2.0 * first.count * first.block),
        any(not t.observable for t in doubtful),
    )


def _scaled(term: NoiseTerm, unit: float) -> NoiseTerm:
    if term.name == "T":
        return term
    return NoiseTerm(
        term.name, unit * term.value, unit * term.low, unit * term.high, term.observable
    )


def _combined(slopes: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Mean of values with weights by their sd, and its sd."""
    if len(slopes) == 1:
        return slopes[0]
    weights = [1.0 / sd**2 for _, sd in slopes]
    whole = math.fsum(weights)
    mean = math.fsum(w * slope for w, (slope, _) in zip(weights, slopes, strict=True)) / whole
    return mean, math.sqrt(1.0 / whole)


def _models(record: _Record, dt: float, span: float, whole: bool) -> list[_Fit]:
    """Fits of all models; the first level decides about Q, if it is `whole`."""
    first = record.levels[0]
    white = float(np.median(np.diag(first.moments))) * first.block
    plain = record.fit(("N",), np.array([white]))
    n = plain.variances[0]
    # Where white noise crosses the other terms, if they begin within the record.
    middle = math.sqrt(first.block * span)
    start = {"B": n / middle, "K": n / middle**2, "GM": n / middle, "Q": n * dt}
    fits = [plain]
    names: tuple[str, ...]
    for names in (("N", "B"), ("N", "K"), ("N", "B", "K")):
        known = [f for f in fits if set(f.names) < set(names)]
        best = max(known, key=lambda f: f.value)
        begin = [best.variance(x) if x in best.names else 0.1 * start[x] for x in names]
        fits.append(record.fit(names, np.maximum(begin, 1e-12 * n)))
    richest = fits[-1]
    with_q = record.fit(("Q", *richest.names), np.array([0.1 * start["Q"], *richest.variances]))
    quantized = whole and 2.0 * (with_q.value - richest.value) > DEMANDED
    own: tuple[str, ...] = ("Q", "N") if quantized else ("N",)
    if quantized:
        q = with_q.variances[0]
        fits = [record.fit(("Q", *f.names), np.array([q, *f.variances])) for f in fits]
    # Over the correlation time: a coarse grid, then the parabola about the best.
    low, high = 4.0 * dt * first.count, span / SLOWEST
    base = min(fits, key=lambda f: f.value)
    for names in (("GM",), ("K", "GM")):
        if low >= high:
            break
        grid = list(np.geomspace(low, high, 9))
        every = (*own, *names)
        guess = [base.variance(x) if x in base.names else 0.3 * start[x] for x in every]
        near, tried = np.array(guess), list[_Fit]()
        for time in grid:
            # Each begins at the one before, but not at a variance so small that no slope leads on.
            tried.append(record.fit(every, near, time))
            near = np.maximum(tried[-1].variances, 0.03 * np.array(guess))
        fits += _refined(record, tried)
    return fits


def _refined(record: _Record, tried: list[_Fit]) -> list[_Fit]:
    """Fit at the best correlation time; of an end of the range, that end."""
    for _ in range(3):
        k = int(np.argmax([one.value for one in tried]))
        if k in (0, len(tried) - 1):
            return [replace(tried[k], edge=True)]
        near = tried[k]
        sides = [
            record.fit(near.names, near.variances, math.sqrt(near.correlation * one.correlation))
            for one in (tried[k - 1], tried[k + 1])
        ]
        tried = [tried[k - 1], sides[0], near, sides[1], tried[k + 1]]
    # The maximum of the parabola through three in the logarithm of the time.
    k = int(np.argmax([one.value for one in tried]))
    if k in (0, len(tried) - 1):
        return [tried[k]]
    x = np.log([one.correlation for one in tried[k - 1 : k + 2]])
    a, b, _c = np.polyfit(x - x[1], [one.value for one in tried[k - 1 : k + 2]], 2)
    at = x[1] - 0.5 * b / a if a < 0.0 else x[1]
    found = record.fit(tried[k].names, tried[k].variances, float(np.exp(at)))
    return [max((found, tried[k]), key=lambda f: f.value)]


def _without_colored(
    levels: tuple[Level, ...], record: _Record, best: _Fit
) -> tuple[Level, ...] | None:
    """Levels without the highest frequencies, if those do not agree with the model; else None."""
    shapes = [record.covariances(name, best.correlation) for name in best.names]
    out: list[Level] = []
    colored = False
    for of in dict.fromkeys(one.record for one in levels):
        own = [k for k, one in enumerate(levels) if one.record == of]
        first, rest = levels[own[0]], [levels[k] for k in own[1:]]
        if not rest:
            return None
        model = np.diag(sum(v * s[own[0]] for v, s in zip(best.variances, shapes, strict=True)))
        ratio = np.diag(first.moments) / model - 1.0
        count = ratio.size
        parts = np.array_split(np.arange(count), max(1, count // 4))
        sd = [math.sqrt(2.0 / (first.runs * part.size)) for part in parts]
        off = [abs(float(ratio[part].mean())) for part in parts]
        colored |= any(o >= max(COLORED, SURELY * s) for o, s in zip(off, sd, strict=True))
        kept = count // 2
        if kept < LEAST_RUN and len(rest) < 2:
            return None
        out += [first.lowest(kept), *rest] if kept >= LEAST_RUN else rest
    return tuple(out) if colored else None


def _alike(fits: list[_Fit], best: _Fit) -> list[_Fit]:
    """Fits that the likelihood does not exclude, whatever their number of parameters."""
    return [f for f in fits if 2.0 * f.value > 2.0 * best.value - ALIKE]


def _intervals(record: _Record, fits: list[_Fit], best: _Fit) -> list[NoiseTerm]:
    alike = _alike(fits, best)
    plain, robust = _covariances(record, best)
    terms = []
    for name in TERMS:
        if name in best.names:
            ends = _profile(record, best, best.names.index(name), plain, robust)
            low, high = (best.variance(name) * math.exp(end) for end in ends)
            everywhere = ends[0] > -FURTHEST and all(
                name in f.names or _drives(f, name, low, high) for f in alike
            )
            value = math.sqrt(best.variance(name))
            terms.append(NoiseTerm(name, value, math.sqrt(low), math.sqrt(high), everywhere))
            if name == "GM":
                time = best.correlation
                ends = _profile(record, best, len(best.names), plain, robust)
                low, high = (time * math.exp(end) for end in ends)
                terms.append(NoiseTerm("T", time, low, high, everywhere))
        elif name in ("Q", "B", "K"):
            bound = math.sqrt(_upper_bound(record, best, name))
            terms.append(NoiseTerm(name, math.nan, 0.0, bound, False))
    return terms


def _drives(fit: _Fit, name: str, low: float, high: float) -> bool:
    """Whether the slowest process that differs from a random walk is driven by the same noise."""
    if name != "K" or not fit.edge:
        return False
    return low / SAME <= 2.0 * fit.variance("GM") / fit.correlation <= SAME * high


def _profile(
    record: _Record, best: _Fit, k: int, plain: Array, robust: Array
) -> tuple[float, float]:
    """Ends of the 95 % interval of parameter k, in its logarithm about the maximum.

    Parameters are the variances and, of a Gauss-Markov process, last its correlation time. By the
    profile of the likelihood, which is as much too narrow as the plain covariance is.
    """
    sd, limit = math.sqrt(robust[k, k]), TWO_SIDED * robust[k, k] / plain[k, k]
    sd = min(sd, FURTHEST / 4.0)
    if sd < WELL_KNOWN:
        return -1.96 * sd, 1.96 * sd
    starts = {0.0: best}

    def lost(offset: float) -> float:
        near = starts[min(starts, key=lambda x: abs(x - offset))]
        if k == len(best.names):
            fit = record.fit(best.names, near.variances, best.correlation * math.exp(offset))
            starts[offset] = fit
            return 2.0 * (best.value - fit.value)
        begin = near.variances.copy()
        begin[k] = best.variances[k] * math.exp(offset)
        if "GM" not in best.names:
            fit = starts[offset] = record.fit(best.names, begin, held=k)
            return 2.0 * (best.value - fit.value)
        # The time that goes with it by the covariance, and the parabola about that.
        slope, wide = plain[-1, k] / plain[k, k], 0.7 * math.sqrt(plain[-1, -1])
        times = best.correlation * np.exp(slope * offset + wide * np.array([-1.0, 0.0, 1.0]))
        fits = [record.fit(best.names, begin, float(t), held=k) for t in times]
        low, middle, high = (one.value for one in fits)
        bend = low - 2.0 * middle + high
        top = max(low, middle, high)
        if bend < 0.0:
            top = max(top, middle - 0.125 * (high - low) ** 2 / bend)
        starts[offset] = fits[1]
        return 2.0 * (best.value - top)

    low, high = (_crossing(lost, sign * 1.96 * sd, limit) for sign in (-1.0, 1.0))
    return low, high


def _crossing(lost: Callable[[float], float], first: float, limit: float) -> float:
    """Where a loss that is nearly quadratic reaches a limit, from a first guess."""
    inside, outside, at = 0.0, math.inf, first
    for _ in range(12):
        found = lost(at)
        if abs(found - limit) < 0.01 * limit:
            break
        if found > limit:
            outside = abs(at)
        else:
            inside = abs(at)
        step = abs(at) * math.sqrt(limit / max(found, 0.1 * limit))
        if not inside < step < outside:
            step = 0.5 * (inside + outside) if math.isfinite(outside) else 2.0 * abs(at)
        at = math.copysign(min(step, FURTHEST), first)
        if step > FURTHEST:
            break
    return at


def _covariances(record: _Record, best: _Fit) -> tuple[Array, Array]:
    """Covariance of the logarithms of the variances and, of a process, last of its time.

    Returns
    -------
    plain, robust : ndarray
        As if the levels were independent; and with the covariance between each level and the next
        (sandwich: inverse information, covariance of the scores, inverse information).
    """
    names, shapes = best.names, [record.covariances(n, best.correlation) for n in best.names]
    parts = [[v * m for m in made] for v, made in zip(best.variances, shapes, strict=True)]
    if "GM" in names:
        h, size = 0.05, best.variance("GM")
        up, down = (record.covariances("GM", best.correlation * math.exp(x)) for x in (h, -h))
        parts.append([size * (u - d) / (2.0 * h) for u, d in zip(up, down, strict=True)])
    count = len(parts)
    information, weights = np.zeros((count, count)), []
    for j, level in enumerate(record.levels):
        inverse = np.linalg.inv(sum(part[j] for part in parts[: len(names)]))
        weighted = [inverse @ part[j] for part in parts]
        weights.append([w @ inverse for w in weighted])
        for a in range(count):
            for b in range(count):
                share = float(np.sum(weighted[a] * weighted[b].T))
                information[a, b] += 0.5 * level.runs * share
    plain: Array = np.asarray(np.linalg.inv(information + 1e-12 * np.eye(count)), np.float64)
    if not set(names) & {"B", "K", "GM"}:
        return plain, plain
    scores = information.copy()
    for j in range(len(record.levels) - 1):
        if record.levels[j].record != record.levels[j + 1].record:
            continue
        across = _across(record.levels[j], record.levels[j + 1], best)
        runs = record.levels[j + 1].runs
        right = [across @ w @ across.transpose(0, 2, 1) for w in weights[j + 1]]
        summed = [r.sum(axis=0) for r in right]
        for a in range(count):
            for b in range(count):
                shared = 0.5 * runs * float(np.sum(weights[j][a] * summed[b].T))
                scores[a, b] += shared
                scores[b, a] += shared
    return plain, np.asarray(plain @ scores @ plain, np.float64)


def _across(fine: Level, coarse: Level, fit: _Fit) -> Array:
    """Covariance, (p, k, m), of a run's k coefficients, at each place p in a run of m above it."""
    h, wide = fine.block, coarse.block
    steps = np.arange(1 - coarse.count, coarse.count) * wide
    d = steps[:, None] + np.arange(fine.count) * h
    total = np.zeros_like(d)
    for variance, name in zip(fit.variances, fit.names, strict=True):
        at = [d + h - wide, d + h, d - wide, d]
        g = [shape(name, x, fit.correlation) for x in at]
        total += variance * (g[0] - g[1] - g[2] + g[3]) / (h * wide)
    projected = total @ fine.basis
    place = np.arange(coarse.count)
    lag = place[:, None] - place[None, :] + coarse.count - 1
    return np.asarray(projected[lag].transpose(0, 2, 1) @ coarse.basis)


def _upper_bound(record: _Record, best: _Fit, name: str) -> float:
    """One-sided 95 % bound of the variance of a term that the model does not have."""
    names = (*best.names, name)
    n = best.variance("N")
    low = n * {"Q": record.levels[0].block ** 2, "B": 1.0, "K": 1.0}[name]
    fit = record.fit(names, np.append(best.variances, 1e-6 * low), best.correlation)
    top, peak, start = max(fit.value, best.value), fit.variances[-1], fit.variances
    # Where the likelihood has fallen: first as far as the information at the peak has it, with the
    # other terms as unknown as they are.
    scaled = fit.information / np.outer(fit.variances, fit.variances)
    size = np.sqrt(np.maximum(np.diag(scaled), 1e-300))
    inverse = np.linalg.inv(scaled / np.outer(size, size) + 1e-9 * np.eye(len(names)))
    first = math.sqrt(max(inverse[-1, -1], 1.0)) / size[-1]
    inside, outside, beyond = 0.0, math.inf, math.sqrt(ONE_SIDED) * min(first, 1e6 * low)
    for _ in range(60):
        trial = start.copy()
        trial[-1] = peak + beyond
        found = record.fit(names, trial, best.correlation, held=len(names) - 1)
        lost = 2.0 * (top - found.value)
        if abs(lost - ONE_SIDED) < 0.01 * ONE_SIDED:
            break
        if lost < ONE_SIDED:
            inside, start = beyond, found.variances
        else:
            outside = beyond
        if outside - inside < 0.005 * (peak + inside):
            break
        step = beyond * math.sqrt(ONE_SIDED / max(lost, 0.05 * ONE_SIDED))
        if not inside < step < outside:
            step = 0.5 * (inside + outside) if math.isfinite(outside) else 3.0 * beyond
        beyond = step
    return float(peak + beyond)


def _slope(fit: _Fit, means: Array, line: Array, block: float, column: int) -> tuple[float, float]:
    """Coefficient of a column of `line` by generalized least squares, and its sd."""
    sigma = sum(
        v * block_covariance(term, means.size, block, fit.correlation)
        for v, term in zip(fit.variances, fit.names, strict=True)
    )
    # The covariance is known up to a constant, which only the mean would see.
    sigma = sigma + (1.0 + np.abs(sigma).max())
    weighted = np.linalg.solve(sigma, line)
    covariance = np.linalg.inv(line.T @ weighted)
    return float((covariance @ (weighted.T @ means))[column]), math.sqrt(covariance[column, column])


def _slope_term(name: str, found: list[tuple[float, float]]) -> NoiseTerm:
    """Ramp, of which the size counts, or effect of temperature.

    `found`: by each model that is not excluded, and last by one with a random walk as large as the
    record allows, which a slope may be. Observable beyond 3.3 standard deviations of each, a chance
    of 0.1 %; the interval is the widest of the others.
    """
    observable = all(abs(slope) > 3.3 * sd for slope, sd in found)
    slope, sd = max(found[:-1], key=lambda one: one[1])
    if name == "C":
        return NoiseTerm(name, slope, slope - 1.96 * sd, slope + 1.96 * sd, observable)
    size = abs(slope)
    if observable:
        return NoiseTerm(name, size, size - 1.96 * sd, size + 1.96 * sd, True)
    return NoiseTerm(name, math.nan, 0.0, max(abs(x) + 1.645 * s for x, s in found), False)


def _with_walk(fit: _Fit, variance: float) -> _Fit:
    """The model with a random walk of a given variance."""
    kept = [k for k, name in enumerate(fit.names) if name != "K"]
    names = (*(fit.names[k] for k in kept), "K")
    return replace(fit, names=names, variances=np.append(fit.variances[kept], variance))
