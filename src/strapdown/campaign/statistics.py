"""Statistics of the results of a campaign, in memory that does not grow with its cases.

A *stream* is a function that returns an iterator over blocks of values, the same at each call, so
that several passes are possible. Values belong to *groups*, numbered from 0, such as one scalar in
one cell; NaN is not a value and is counted.

Means and variances are merged block by block (Chan, Golub and LeVeque 1983). Order statistics are
exact: each pass counts the values by the leading digits of their binary form, within the one
interval that holds each wanted rank, until what is left fits in memory (Munro and Paterson 1980).
Blocks have a fixed number of rows (`blocks`), so that a result does not depend, in any bit, on how
its cases are divided into batches.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import TWO_SIDED_95
from strapdown.dsp.chi_square import (
    binomial_quantile,
    chi_square_quantile,
    clopper_pearson,
    student_quantile,
)

Array = NDArray[np.float64]
Whole = NDArray[np.int64]
Keys = NDArray[np.uint64]

#: Rows of a block.
ROWS = 2**14
#: Counters of a pass of `order_statistics`, and values that it sorts in memory.
COUNTERS, CANDIDATES = 2**20, 2**17
#: Replications of the bootstrap of Sobol indices.
REPLICATIONS = 400


def blocks(batches: Iterable[Any], rows: int = ROWS) -> Iterator[pd.DataFrame]:
    """Divide batches into blocks of a fixed number of rows; the last one has what is left.

    `batches`: DataFrames, or tables of Arrow.
    """
    held: list[pd.DataFrame] = []
    count = 0
    for batch in batches:
        start = 0
        while start < len(batch):
            end = min(start + rows - count, len(batch))
            # Of a table of Arrow no more than a block is converted at a time.
            part = (
                batch[start:end]
                if isinstance(batch, pd.DataFrame)
                else batch.slice(start, end - start).to_pandas()
            )
            held.append(part)
            count, start = count + end - start, end
            if count == rows:
                yield pd.concat(held, ignore_index=True)
                held, count = [], 0
    if count:
        yield pd.concat(held, ignore_index=True)


@dataclass(frozen=True)
class Values:
    """A block of values.

    Attributes
    ----------
    group : ndarray of int, (n,)
    value : ndarray, (n,)
        NaN where there is none.
    case : ndarray of int, (n,)
        Number of the case of each value.
    """

    group: Whole
    value: Array
    case: Whole


Stream = Callable[[], Iterator[Values]]


class Moments:
    """Count, mean, variance and extremes of each group; blocks are added in order of case.

    Attributes
    ----------
    count, missing : ndarray of int, (groups,)
        Values, and cases without one.
    square : ndarray, (groups,)
        Sum of squared deviations from the mean.
    low, high : ndarray, (groups,)
        Infinite without values.
    low_case, high_case : ndarray of int, (groups,)
        First case with the extreme; -1 without values.
    """

    def __init__(self, groups: int) -> None:
        self.count, self.missing = np.zeros(groups, np.int64), np.zeros(groups, np.int64)
        # Means are kept from the first value, which loses no digits where the spread is small.
        self._origin, self._off = np.full(groups, np.nan), np.zeros(groups)
        self.square = np.zeros(groups)
        self.low, self.high = np.full(groups, np.inf), np.full(groups, -np.inf)
        self.low_case, self.high_case = np.full(groups, -1), np.full(groups, -1)

    def add(self, block: Values) -> None:
        """Add a block."""
        groups = self.count.size
        there = ~np.isnan(block.value)
        self.missing += np.bincount(block.group[~there], minlength=groups)
        group, value, case = block.group[there], block.value[there] + 0.0, block.case[there]
        count = np.bincount(group, minlength=groups)
        fresh = np.isnan(self._origin[group]) & np.isfinite(value)
        self._origin[group[fresh][::-1]] = value[fresh][::-1]
        # With an infinite value mean and variance are infinite or NaN.
        with np.errstate(invalid="ignore", over="ignore"):
            some = np.maximum(count, 1)
            off_origin = value - np.nan_to_num(self._origin)[group]
            mean = np.bincount(group, off_origin, groups) / some
            apart = off_origin - mean[group]
            rest = np.bincount(group, apart, groups)
            square = np.bincount(group, apart**2, groups) - rest**2 / some
            self._merge(count, mean + rest / some, square)
        for extreme, where, better, put in (
            (self.low, self.low_case, np.less, np.minimum),
            (self.high, self.high_case, np.greater, np.maximum),
        ):
            before = extreme.copy()
            put.at(extreme, group, value)
            fresh = better(extreme, before) | (where < 0)
            first = np.flatnonzero((value == extreme[group]) & fresh[group])[::-1]
            where[group[first]] = case[first]

    def _merge(self, count: Whole, mean: Array, square: Array) -> None:
        # Chan, Golub and LeVeque (1983), eq. 2.1.
        total = np.maximum(self.count + count, 1)
        step = np.where(count > 0, mean - self._off, 0.0)
        self._off = self._off + step * (count / total)
        self.square = self.square + square + step**2 * (self.count * count / total)
        self.count = self.count + count

    @property
    def mean(self) -> Array:
        """Mean of each group; NaN without values."""
        return np.where(self.count > 0, np.nan_to_num(self._origin) + self._off, np.nan)

    @property
    def sd(self) -> Array:
        """Standard deviation of each group, with n - 1; NaN below two values."""
        with np.errstate(invalid="ignore", divide="ignore"):
            variance = np.maximum(self.square, 0.0) / (self.count - 1)
        return np.where(self.count > 1, np.sqrt(np.where(self.count > 1, variance, 0.0)), np.nan)


def student_interval(
    count: int, mean: float, sd: float, confidence: float = 0.95
) -> tuple[float, float]:
    """Return Student's interval of a mean; NaN below two values."""
    if count < 2:
        return math.nan, math.nan
    half = student_quantile(0.5 + 0.5 * confidence, count - 1.0) * sd / math.sqrt(count)
    return mean - half, mean + half


# Order statistics.


_SIGN = np.uint64(1 << 63)
_ALL = np.uint64(2**64 - 1)


def _keys(values: Array) -> Keys:
    """Whole numbers in the order of the values; both zeros have one."""
    bits = np.ascontiguousarray(values + 0.0).view(np.uint64)
    return bits ^ np.where(bits & _SIGN, _ALL, _SIGN)


def _values(keys: Keys) -> Array:
    return (keys ^ np.where(keys & _SIGN, _SIGN, _ALL)).view(np.float64)


@dataclass
class _Level:
    """Intervals of keys, each counted in ``2**bits`` parts; `below` has the next level's numbers.

    Attributes
    ----------
    base, shift : ndarray of uint64, (intervals,)
        First key of each, and the bits of a part.
    below : ndarray of int, (intervals << bits,)
        -1 for a part that holds no wanted rank.
    """

    base: Keys
    shift: Keys
    bits: int
    below: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, np.int32))

    def parts(self, interval: NDArray[np.int32], key: Keys) -> Whole:
        """Return the part of each key among those of all intervals."""
        digit = (key - self.base[interval]) >> self.shift[interval]
        return (interval.astype(np.int64) << self.bits) | digit.astype(np.int64)


def order_statistics(stream: Stream, of: Moments, ranks: Whole) -> Array:
    """Select values by their rank, exactly.

    Parameters
    ----------
    stream : callable
    of : Moments
        Of the same stream.
    ranks : ndarray of int, (groups, k)
        From 0 in ascending order; others than 0 to count - 1 are NaN in the result.

    Returns
    -------
    ndarray, (groups, k)
    """
    found = np.full(ranks.size, np.nan)
    wanted = np.flatnonzero(((ranks >= 0) & (ranks < of.count[:, None])).ravel())
    owner, rank = wanted // max(ranks.shape[1], 1), ranks.ravel()[wanted].astype(np.int64)
    # The root: an interval for each group with a wanted rank, from its least to its greatest value.
    groups, interval = np.unique(owner, return_inverse=True)
    root = np.full(of.count.size, -1, np.int32)
    root[groups] = np.arange(groups.size)
    base = _keys(of.low[groups])
    width = _bit_length(_keys(of.high[groups]) - base)
    count = of.count[groups]
    levels: list[_Level] = []

    def walk() -> Iterator[tuple[NDArray[np.int32], Keys]]:
        """Values in the intervals of the last level, with the interval of each."""
        for block in stream():
            node = root[block.group]
            node[np.isnan(block.value)] = -1
            kept = np.flatnonzero(node >= 0)
            node, key = node[kept], _keys(block.value[kept])
            for level in levels:
                node = level.below[level.parts(node, key)]
                kept = np.flatnonzero(node >= 0)
                node, key = node[kept], key[kept]
            yield node, key

    while wanted.size:
        known = width[interval] == 0
        found[wanted[known]] = _values(base[interval[known]])
        wanted, rank, interval = wanted[~known], rank[~known], interval[~known]
        if not wanted.size:
            break
        if count[width > 0].sum() <= max(CANDIDATES, 16 * of.count.size):
            nodes, keys = (np.concatenate(part) for part in zip(*walk(), strict=True))
            order = np.lexsort((keys, nodes))
            begin = np.concatenate([[0], np.cumsum(np.bincount(nodes, minlength=base.size))])
            found[wanted] = _values(keys[order][begin[interval] + rank])
            break
        bits = min(16, max(4, int(math.log2(COUNTERS / base.size))))
        level = _Level(base, np.maximum(width - bits, 0).astype(np.uint64), bits)
        counted = np.zeros(base.size << bits, np.int64)
        for node, key in walk():
            np.add.at(counted, level.parts(node, key), 1)
        levels.append(level)
        # Parts of all intervals in one row: a rank of an interval is one of the row.
        upto = np.cumsum(counted)
        begin = np.concatenate([[0], upto[(1 << bits) - 1 :: 1 << bits]])
        part = np.searchsorted(upto, begin[interval] + rank, side="right")
        rank = rank - (upto[part] - counted[part] - begin[interval])
        parts, interval = np.unique(part, return_inverse=True)
        parent, digit = parts >> bits, (parts & ((1 << bits) - 1)).astype(np.uint64)
        level.below = np.full(counted.size, -1, np.int32)
        base = level.base[parent] + (digit << level.shift[parent])
        width, count = np.maximum(width[parent] - bits, 0), counted[parts]
        level.below[parts] = np.where(width > 0, np.arange(parts.size), -1)
    return found.reshape(ranks.shape)


def _bit_length(keys: Keys) -> Whole:
    """Bits of each number."""
    left, bits = keys.copy(), np.zeros(keys.size, np.int64)
    for step in (32, 16, 8, 4, 2, 1):
        more = left >= np.uint64(1 << step)
        bits[more] += step
        left[more] >>= np.uint64(step)
    return bits + (left > 0)


def quantile_ranks(count: Whole, levels: Sequence[float], confidence: float = 0.95) -> Whole:
    """Return the ranks from which quantiles and their intervals are made.

    The quantile of a level p is interpolated between the two order statistics about
    ``(n - 1) p`` (Hyndman and Fan 1996, definition 7). Its interval needs no distribution: the
    number of values below the true quantile is binomial, so that the order statistics of two ranks
    contain it with `confidence` or more (David and Nagaraja 2003, section 7.1).

    Returns
    -------
    ndarray of int, (groups, levels, 4)
        From 0: the two about the quantile, then the ends of the interval. -1 for an end that does
        not exist, as few values do not show the far ends of a distribution.
    """
    p = np.asarray(levels, dtype=np.float64)
    sizes, of = np.unique(count, return_inverse=True)
    n = sizes[:, None]
    at = np.maximum(n - 1, 0) * p
    tail = 0.5 * (1.0 - confidence)
    low = binomial_quantile(np.nextafter(tail, 1.0), n, p) - 1
    high = binomial_quantile(1.0 - tail, n, p)
    ends = (np.floor(at), np.ceil(at), low, np.where(high < n, high, -1))
    return np.asarray(np.stack(ends, axis=-1).astype(np.int64)[of])


def quantiles(
    stream: Stream, of: Moments, levels: Sequence[float], confidence: float = 0.95
) -> tuple[Array, Array, Array]:
    """Return exact quantiles and the ends of their intervals (`quantile_ranks`).

    Returns
    -------
    tuple of ndarray, (groups, levels)
        Quantiles, low and high ends; NaN for what does not exist.
    """
    ranks = quantile_ranks(of.count, levels, confidence)
    flat = ranks.reshape(len(ranks), 4 * len(levels))
    found = order_statistics(stream, of, flat).reshape(ranks.shape)
    below, above, low, high = np.moveaxis(found, -1, 0)
    at = np.maximum(of.count - 1, 0)[:, None] * np.asarray(levels)
    with np.errstate(invalid="ignore"):
        between = below + (above - below) * (at - np.floor(at))
    return np.where(below == above, below, between), low, high


# Shares, and consistency of stated variances.


@dataclass(frozen=True)
class Share:
    """A share of cases with its exact intervals (`clopper_pearson`)."""

    hits: int
    of: int
    low: float
    high: float
    low_99: float
    high_99: float

    @property
    def share(self) -> float:
        """The share itself; NaN of no cases."""
        return self.hits / self.of if self.of else math.nan

    def differs(self, expected: float) -> int:
        """Whether the 99 % interval is below (-1) or above (1) a share; 0 if it contains it."""
        return int(self.low_99 > expected) - int(self.high_99 < expected)


def share_of(hits: int, of: int) -> Share:
    """Return a share with its 95 and 99 % intervals."""
    return Share(hits, of, *clopper_pearson(hits, of), *clopper_pearson(hits, of, 0.99))


@dataclass(frozen=True)
class Consistency:
    """Normalized errors squared over cases, which are chi-square if the variances are right.

    Attributes
    ----------
    mean : float
        Expected: the degrees of freedom.
    low, high, low_99, high_99 : float
        Interval of the mean if the variances are right: of n cases, n times the mean is chi-square
        with n times the degrees of freedom (Bar-Shalom, Li and Kirubarajan 2001, section 5.4).
    inside : Share
        Cases within the 95 % quantile of one case.
    """

    count: int
    mean: float
    low: float
    high: float
    low_99: float
    high_99: float
    inside: Share

    @property
    def differs(self) -> int:
        """Whether the mean is below (-1) or above (1) its 99 % interval; 0 if within."""
        return int(self.mean > self.high_99) - int(self.mean < self.low_99)


def consistency(count: int, mean: float, inside: int, dof: float) -> Consistency:
    """Return the test of `count` normalized errors squared, each of `dof` degrees of freedom."""
    shares = (0.025, 0.975, 0.005, 0.995)
    low, high, low_99, high_99 = (
        chi_square_quantile(p, count * dof) / count if count else math.nan for p in shares
    )
    middle = mean if count else math.nan
    return Consistency(count, middle, low, high, low_99, high_99, share_of(inside, count))


def count_between(edges: Array, values: Array) -> Whole:
    """Count the values below the first edge, between the edges, and above the last, (edges + 1,).

    A part contains its lower edge, the last one both.
    """
    there = values[~np.isnan(values)]
    part = np.searchsorted(edges, there, side="right")
    part[there == edges[-1]] = edges.size - 1
    return np.bincount(part, minlength=edges.size + 1)


class Extremes:
    """Values beyond two fences of each group, counted, and the farthest ones.

    Attributes
    ----------
    below, above : ndarray of int, (groups,)
    """

    def __init__(self, low: Array, high: Array, unit: Array, keep: int = 10) -> None:
        """`low`, `high`: fences. `unit`: in which the distance from a fence is compared."""
        self.low, self.high, self.unit, self.keep = low, high, unit, keep
        self.below = np.zeros(low.size, np.int64)
        self.above = np.zeros(low.size, np.int64)
        none = np.empty(0, np.int64)
        self._kept = Values(none, np.empty(0), none)

    def add(self, block: Values) -> None:
        """Add a block."""
        under = block.value < self.low[block.group]
        over = block.value > self.high[block.group]
        self.below += np.bincount(block.group[under], minlength=self.low.size)
        self.above += np.bincount(block.group[over], minlength=self.low.size)
        new = under | over
        if not new.any():
            return
        group = np.concatenate([self._kept.group, block.group[new]])
        value = np.concatenate([self._kept.value, block.value[new]])
        case = np.concatenate([self._kept.case, block.case[new]])
        low, high = self.low[group], self.high[group]
        far = np.maximum(low - value, value - high) / self.unit[group]
        order = np.lexsort((case, -far, group))
        first = np.searchsorted(group[order], group[order], side="left")
        kept = order[np.arange(order.size) - first < self.keep]
        self._kept = Values(group[kept], value[kept], case[kept])

    def worst(self, group: int) -> list[tuple[int, float]]:
        """Return the cases of a group farthest beyond its fences, with their values."""
        own = self._kept.group == group
        return list(zip(self._kept.case[own].tolist(), self._kept.value[own].tolist(), strict=True))


# Sensitivity.


@dataclass(frozen=True)
class SobolIndices:
    """Sobol indices of one scalar, with 95 % intervals.

    Attributes
    ----------
    samples, left_out : int
        Base samples, and those that are not used because one of their cases has no value.
    first, total : ndarray, (parameters, 3)
        Index of the first order and total index: value, low and high end.
    """

    samples: int
    left_out: int
    first: Array
    total: Array


class Sobol:
    """Sobol indices by Saltelli's design, over cases in order.

    Draw ``j (d + 2) + k`` is of base sample j: k = 0 matrix A, 1 matrix B, 2 + i matrix A with
    column i of B. First order: ``mean(f_B (f_ABi - f_A)) / V`` (Saltelli and others 2010, table 2
    b), of values from which their mean is subtracted first; total: ``mean((f_A - f_ABi)²) / 2V``
    (Jansen 1999). The intervals are normal, with the standard deviation of a bootstrap over base
    samples: each replication gives base sample j a weight of Poisson's distribution of mean one
    (Oza and Russell 2001), drawn from a hash of j and the replication, so that no sample is kept.
    """

    def __init__(self, parameters: int, centre: Array, seed: int = 0) -> None:
        """`centre`: mean of each scalar in each cell, (cells, scalars)."""
        self.parameters, self.centre, self.seed = parameters, np.nan_to_num(centre), seed
        size = (REPLICATIONS + 1, 3 + 2 * parameters)
        self._sums = np.zeros((*centre.shape, *size))
        self.used = np.zeros(centre.shape, np.int64)
        self.left_out = np.zeros(centre.shape, np.int64)
        self._held = (np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, centre.shape[1])))

    def add(self, cell: Whole, draw: Whole, values: Array) -> None:
        """Add cases; in each cell they are in order of draw.

        `values`: (n, scalars), NaN where there is none.
        """
        cell, draw, values = (
            np.concatenate([old, new])
            for old, new in zip(self._held, (cell, draw, values), strict=True)
        )
        of, sample = self.parameters + 2, draw // (self.parameters + 2)
        # The last sample of each cell may go on in the next block.
        last = np.full(self.centre.shape[0], -1, np.int64)
        np.maximum.at(last, cell, sample)
        wait = sample == last[cell]
        self._held = (cell[wait], draw[wait], values[wait])
        self._count(cell[~wait], sample[~wait], (draw % of)[~wait], values[~wait])

    def _count(self, cell: Whole, sample: Whole, place: Whole, values: Array) -> None:
        if not cell.size:
            return
        both, row = np.unique(np.column_stack([cell, sample]), axis=0, return_inverse=True)
        f = np.full((len(both), self.parameters + 2, values.shape[1]), np.nan)
        f[row.ravel(), place] = values
        # Every cell has the same weights of a sample, as it has the same seed.
        weights = poisson_weights(both[:, 1], self.seed)
        for c in np.unique(both[:, 0]).tolist():
            own = both[:, 0] == c
            for s in range(values.shape[1]):
                g = f[own, :, s] - self.centre[c, s]
                whole = np.isfinite(g).all(axis=1)
                self.used[c, s] += np.count_nonzero(whole)
                self.left_out[c, s] += np.count_nonzero(~whole)
                a, b, ab = g[whole, 0], g[whole, 1], g[whole, 2:]
                terms = np.column_stack(
                    [
                        np.ones_like(a),
                        a + b,
                        a**2 + b**2,
                        b[:, None] * (ab - a[:, None]),
                        (a[:, None] - ab) ** 2,
                    ]
                )
                self._sums[c, s] += weights[:, own][:, whole] @ terms

    def finish(self) -> None:
        """Count what waits for another block."""
        cell, draw, values = self._held
        of = self.parameters + 2
        self._held = (cell[:0], draw[:0], values[:0])
        self._count(cell, draw // of, draw % of, values)

    def indices(self, cell: int, scalar: int) -> SobolIndices:
        """Return the indices of a scalar in a cell; NaN where it does not vary."""
        sums, d = self._sums[cell, scalar], self.parameters
        with np.errstate(invalid="ignore", divide="ignore"):
            weight = sums[:, 0]
            variance = sums[:, 2] / (2.0 * weight) - (sums[:, 1] / (2.0 * weight)) ** 2
            scale = np.where(variance > 0.0, weight * variance, np.nan)[:, None]
            first, total = sums[:, 3 : 3 + d] / scale, 0.5 * sums[:, 3 + d :] / scale
        used = int(self.used[cell, scalar])
        made = []
        for one in (first, total):
            some = one[1:][np.isfinite(one[1:]).all(axis=1)]
            enough = len(some) > 1 and used > 1
            half = TWO_SIDED_95 * (some.std(axis=0, ddof=1) if enough else np.full(d, np.nan))
            made.append(np.column_stack([one[0], one[0] - half, one[0] + half]))
        return SobolIndices(used, int(self.left_out[cell, scalar]), made[0], made[1])


def poisson_weights(samples: Whole, seed: int) -> Array:
    """Return a weight of each base sample in each replication; the first replication has ones.

    Returns
    -------
    ndarray, (REPLICATIONS + 1, samples)
        Of Poisson's distribution with mean one, by SplitMix64 (Steele, Lea and Flood 2014) of seed,
        sample and replication.
    """
    mixed = _mixed(samples.astype(np.uint64) + _mixed(np.array([seed], np.uint64)))
    each = _mixed(mixed + _mixed(np.arange(REPLICATIONS, dtype=np.uint64)[:, None]))
    upto = np.cumsum([math.exp(-1.0) / math.factorial(k) for k in range(16)])
    drawn = np.searchsorted(upto, each.astype(np.float64) * 2.0**-64, side="right")
    return np.vstack([np.ones(samples.size), drawn.astype(np.float64)])


def _mixed(state: Keys) -> Keys:
    """One step of SplitMix64 of each number; it goes round at 2**64."""
    z = state + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))
