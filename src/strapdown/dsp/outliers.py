"""Outliers of evenly sampled channels: detected from both sides, interpolated, by chunks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import Array
from strapdown.dsp.samples import check_segment
from strapdown.errors import ConfigError

Flags = NDArray[np.int8]


#: Flags of `Screened`: as those of the kernel.
REPLACED, KEPT = 1, 2
# Inverse of the size that a quarter of normal numbers exceed: 0.75 = erf(1.1503/sqrt 2).
TO_SIGMA = 0.8692952
# Samples on either side for the prediction: a polynomial of degree five.
NODES = 3
LEAST_WINDOW, LONGEST_RUN = 16, 5


@dataclass(frozen=True, eq=False)
class Screened:
    """Samples that have been checked.

    `first`: index of the first sample, from the start of the record. `values`, `raw` ((k, c)): with
    outliers replaced, and as recorded. `flags` ((k, c)): `REPLACED`; `KEPT` where a sample deviates
    more than its neighbors but the two sides do not both contradict it, as at a step; otherwise
    zero.
    """

    first: int
    values: Array
    raw: Array
    flags: Flags


@dataclass(frozen=True, eq=False)
class OutlierState:
    """State between chunks.

    `first`: index of the oldest sample kept. `judged`: index of the first sample not checked yet.
    `given`: index of the first sample not output yet. `raw`, `work` ((c, n)). `flags` ((c, n)).
    `ahead` ((c,)): next sample of each channel to check: a run may extend beyond `judged`. `own`
    ((c, 3)): the quantization step and the last run of each channel.
    """

    first: int
    judged: int
    given: int
    raw: Array
    work: Array
    flags: Flags
    ahead: NDArray[np.int64]
    own: Array


@dataclass(frozen=True)
class OutlierDesign:
    """Outlier detector: an outlier is a short run of samples that both sides contradict.

    A run is predicted, without its own samples, by the polynomial of degree five through three
    samples on either side. It is replaced by the prediction where, for its first and last sample,

    - the residual exceeds `threshold` standard deviations. The scale is the magnitude that a
      quarter of the residuals reach over `window` samples before it and as many after it, the
      larger of both; the residual of a tone of `bandwidth` with the amplitude around it is
      subtracted first;
    - the straight lines through the two samples on either side of the run lie on the same side by
      at least half the residual, and for a single sample agree with each other. A step, a kink and
      each straight segment are confirmed by one side, and therefore kept.

    A steady tone of any frequency sets its own scale and is never changed. In a channel that mostly
    repeats its value because its quantization is coarse, only residuals of 30 quantization steps or
    more are outliers. This needs the readings as recorded, before channels are mixed.

    `threshold`: in standard deviations of the residual, which is 1.52 times that of white noise
    (runs of two and three: 1.83 and 2.11). On white noise a sample is wrongly replaced with a
    probability of at most ``E[erfc(threshold m / sqrt 2)]``, m the larger of two independent
    scales: 4.2e-8 for 6 and a window of 128, with runs 1e-7. Outliers of 10, 12, 15 and 20 standard
    deviations of the noise are detected with probability 0.45, 0.82, 0.99 and 1. `window`
    (samples): 16 or more, on each side. Up to a quarter of the residuals in it may be spoiled by
    outliers: some four outliers in 128 samples. `longest_run` (samples): 1 to 5. A real pulse of at
    most this length, isolated in a quiet signal, is taken for an outlier; with 3, a pulse of eight
    samples or more at its base is not, whatever its shape. `bandwidth`: of the motion, as a
    fraction of the sampling rate: below 0.25. ConfigError: a parameter is out of its range.
    """

    threshold: float = 6.0
    window: int = 128
    longest_run: int = 3
    bandwidth: float = 0.2

    def __post_init__(self) -> None:
        for name, good, code in (
            ("threshold", 3.0 <= self.threshold < math.inf, "dsp.outlier-threshold"),
            ("window", self.window >= LEAST_WINDOW, "dsp.outlier-window"),
            ("longest_run", 1 <= self.longest_run <= LONGEST_RUN, "dsp.outlier-run"),
            ("bandwidth", 0.0 < self.bandwidth < 0.25, "dsp.outlier-bandwidth"),
        ):
            if not good:
                raise ConfigError(
                    code,
                    quantity=name,
                    value=getattr(self, name),
                    least_window=LEAST_WINDOW,
                    longest_run=LONGEST_RUN,
                )

    @cached_property
    def weights(self) -> Array:
        """Weights of the six samples beside a run of m, for its sample k: (m - 1, k, 6)."""
        out = np.zeros((self.longest_run, self.longest_run, 2 * NODES))
        for m in range(1, self.longest_run + 1):
            nodes = _nodes(m)
            for k in range(m):
                for j, a in enumerate(nodes):
                    others = np.delete(nodes, j)
                    out[m - 1, k, j] = np.prod((k - others) / (a - others))
        return out

    @cached_property
    def allowed(self) -> Array:
        """Largest residual of a tone up to `bandwidth`, relative to its amplitude, by length."""
        frequency = np.linspace(0.0, self.bandwidth, 400)
        out = np.empty(self.longest_run)
        for m in range(1, self.longest_run + 1):
            wave = np.exp(2j * np.pi * np.outer(frequency, _nodes(m)))
            out[m - 1] = np.abs(1.0 - wave @ self.weights[m - 1, 0]).max()
        return out

    @property
    def guard(self) -> int:
        """Samples from the start of a run to the nearest residual that sets its noise scale."""
        return 2 * NODES + self.longest_run

    @property
    def ahead(self) -> int:
        """Samples needed after a sample before it is checked."""
        return self.guard + self.window + self.longest_run + NODES - 1

    @property
    def latency(self) -> int:
        """Samples needed after a sample before it is final: a later run may still change it."""
        return self.ahead + NODES + self.longest_run

    @property
    def _behind(self) -> int:
        return self.guard + self.window + NODES

    def begin(self, channels: int, steps: Array | None = None) -> OutlierState:
        """Return the state before the first sample.

        `steps` ((channels,)): quantization step of each channel, zero where it has none. If not
        given, the smallest change between samples so far is taken: two such steps are never
        outliers.
        """
        own = np.zeros((channels, 3))
        own[:, 0] = -np.inf if steps is None else np.where(np.asarray(steps) > 0.0, steps, TINY)
        empty = np.empty((channels, 0))
        return OutlierState(
            0,
            0,
            0,
            empty,
            empty,
            np.empty((channels, 0), np.int8),
            np.zeros(channels, np.int64),
            own,
        )

    def advance(
        self, state: OutlierState, values: Array, last: bool = False
    ) -> tuple[OutlierState, Screened]:
        """Check the samples that a further chunk completes.

        `values` ((k, c)): finite; k may be zero. `last`: whether the record ends with them. Returns
        `state`; `screened`: the same numbers however the record is split into chunks. DataError: a
        value is not finite.
        """
        from strapdown._kernels.signals import replace_outliers

        check_segment(values, state.first + state.raw.shape[1])
        new = np.ascontiguousarray(values.T)
        raw = np.hstack([state.raw, new])
        work = np.hstack([state.work, new])
        flags = np.hstack([state.flags, np.zeros(new.shape, np.int8)])
        own, on = state.own.copy(), state.ahead.copy()
        n = raw.shape[1]
        judged = max(state.judged, state.first + (n if last else n - self.ahead))
        if judged > state.judged:
            left = np.empty((2 * self.longest_run, n))
            for c in range(len(raw)):
                own[c, 1] -= state.first
                on[c] = state.first + replace_outliers(
                    raw[c],
                    work[c],
                    flags[c],
                    on[c] - state.first,
                    judged - state.first,
                    self.weights,
                    self.allowed,
                    self.guard,
                    self.window,
                    self.threshold * TO_SIGMA,
                    own[c],
                    left,
                )
                own[c, 1] += state.first
        final = state.first + n if last else max(state.given, judged - NODES - self.longest_run)
        give = slice(state.given - state.first, final - state.first)
        screened = Screened(
            state.given, work[:, give].T.copy(), raw[:, give].T.copy(), flags[:, give].T.copy()
        )
        drop = max(0, min(judged - self._behind, final - NODES) - state.first)
        return (
            OutlierState(
                state.first + drop,
                judged,
                final,
                raw[:, drop:].copy(),
                work[:, drop:].copy(),
                flags[:, drop:].copy(),
                on,
                own,
            ),
            screened,
        )


#: A quantization step below any reading.
TINY = 1e-300


def _nodes(m: int) -> Array:
    return np.asarray(np.r_[np.arange(-NODES, 0.0), m + np.arange(0.0, NODES)])
