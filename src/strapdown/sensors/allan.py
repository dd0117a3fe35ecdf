"""Allan, modified Allan and Hadamard deviations, and the shapes of noise terms."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import DataError
from strapdown.tables.checks import Array
from strapdown.tables.on_disk import let_go

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
