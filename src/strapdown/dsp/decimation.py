"""Decimation without aliasing: a linear-phase low-pass at the output stamps, or true means."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from strapdown.constants import Array, Flags
from strapdown.dsp.derivative import LocalWeights, mirrored
from strapdown.dsp.samples import as_channels, positive_step
from strapdown.errors import ConfigError, DataError

# Reserve: Kaiser's length formula is a fit, and a gain of exactly 1 at zero shifts the ripple of
# the passband to one side.
MARGIN = 5.0  # dB
# Weights in one block: 16 MB.
BLOCK = 2_000_000
# Tolerance for stamps outside the record by rounding.
SLACK = 1e-6  # steps


@dataclass(frozen=True, eq=False)
class Resampled:
    """Channels at new stamps.

    `values` ((m, k)). `noise_factor` ((m,)): standard deviation of each output divided by that of
    white noise of the samples, exact. `whole` ((m,)): False where the output uses the padding
    beyond an end of the record. `touched` ((m, k)): whether a marked sample contributes to the
    output.
    """

    values: Array
    noise_factor: Array
    whole: Flags
    touched: Flags


@dataclass(frozen=True)
class LowPassDesign:
    """A windowed sinc low-pass, symmetric about each output stamp.

    `passband`, `stopband` (Hz): up to `passband` the gain is 1, and from `stopband` on 0, both to
    `ripple`. `attenuation` (dB): attenuation of the stopband. `reach` (s): half the length of the
    kernel. `beta`: shape parameter of the Kaiser window.
    """

    passband: float
    stopband: float
    attenuation: float
    reach: float
    beta: float

    @property
    def ripple(self) -> float:
        """Largest deviation of the gain, in both bands."""
        return math.pow(10.0, -self.attenuation / 20.0)

    def kernel(self, u: Array) -> Array:
        """Compute the weight, not normalized, of a sample `u` seconds from the stamp."""
        cutoff = 0.5 * (self.passband + self.stopband)
        inside = np.clip(1.0 - (u / self.reach) ** 2, 0.0, None)
        window = np.i0(self.beta * np.sqrt(inside)) * (np.abs(u) <= self.reach)
        return np.asarray(np.sinc(2.0 * cutoff * u) * window)

    def response(self, frequency: ArrayLike, step: float) -> Array:
        """Compute the gain at frequencies in Hz, for samples of a step in s, stamps on samples."""
        half = int(self.reach / step)
        u: Array = step * np.arange(-half, half + 1, dtype=np.float64)
        weight = self.kernel(u)
        f = np.atleast_1d(np.asarray(frequency, dtype=np.float64))
        return np.asarray(np.cos(2.0 * np.pi * np.outer(f, u)) @ weight / weight.sum())


def low_pass_design(
    step: float, rate: float, *, passband: float = 0.5, attenuation: float = 80.0
) -> LowPassDesign:
    """Design the anti-aliasing low-pass for a lower rate.

    `step` (s): sampling interval. `rate` (Hz): output rate. The stopband begins at its Nyquist
    frequency. `passband`: end of the passband, as a fraction of that Nyquist frequency. The
    kernel's length grows as ``1/(1 - passband)``: at 0.5 and 80 dB it reaches 10.9 output steps to
    either side. `attenuation` (dB): 40 to 150. By Kaiser (1974): Oppenheim & Schafer, Discrete-Time
    Signal Processing, 3rd edition, Eqs. (7.75) and (7.76), with five decibels in reserve.
    ConfigError: an option is out of its range, or the output is not slower than the samples.
    """
    step = positive_step(step)
    if not (math.isfinite(rate) and 0.0 < rate <= (1.0 + 1e-9) / step):
        raise ConfigError("dsp.hz-no-decimating-hz", quantity="rate", step=1.0 / step, rate=rate)
    if not 0.0 < passband < 1.0:
        raise ConfigError(
            "dsp.no-part-output-nyquist-frequency", quantity="passband", passband=passband
        )
    if not 40.0 <= attenuation <= 150.0:
        raise ConfigError(
            "dsp.db-out-reach-double-or", quantity="attenuation", attenuation=attenuation
        )
    stop = 0.5 * rate
    depth = attenuation + MARGIN
    order = (depth - 7.95) / (2.285 * 2.0 * math.pi * stop * (1.0 - passband) * step)
    beta = 0.1102 * (depth - 8.7)
    if depth <= 50.0:
        beta = 0.5842 * (depth - 21.0) ** 0.4 + 0.07886 * (depth - 21.0)
    return LowPassDesign(passband * stop, stop, attenuation, 0.5 * order * step, beta)


def decimate(
    values: ArrayLike,
    start: float,
    step: float,
    stamps: ArrayLike,
    design: LowPassDesign,
    marked: Flags | None = None,
) -> Resampled:
    """Resample evenly spaced samples to stamps with a zero-delay low-pass.

    `values` ((n,) or (n, k)). `start`, `step` (s): stamp of the first sample, and the sampling
    interval. `stamps` ((m,), s): anywhere in the record, at any ratio of rates; they need not be
    even. `design`: from `low_pass_design`. `marked` ((n, k)): samples to trace: `Resampled.touched`
    marks the outputs that they contribute to. Each output is a weighted sum of samples, with the
    kernel centered at its stamp (zero delay) and weights that sum to 1. Within `reach` of the ends
    the record is padded by its point mirror, which preserves constants and straight lines.
    DataError: a sample or stamp is not finite, a stamp lies outside the record, or the record is
    shorter than the reach of the kernel.
    """
    channels, at = as_channels(values), as_channels(stamps, "stamps")[:, 0]
    step = positive_step(step)
    n = len(channels)
    _check_within(at, start, start + (n - 1) * step, step)
    half = math.ceil(design.reach / step) + 1
    if half > n - 1:
        raise DataError(
            "dsp.low-pass-reaches-either-side",
            quantity="values",
            reach=design.reach,
            n=(n - 1) * step,
        )
    place = (at - start) / step

    def weigh(rows: slice) -> tuple[LocalWeights, Flags]:
        first = np.round(place[rows]).astype(np.int64) - half
        u = step * (first[:, None] + np.arange(2 * half + 1) - place[rows, None])
        weights = design.kernel(u)
        weights /= weights.sum(axis=1, keepdims=True)
        reached = np.abs(u) <= design.reach
        over = first[:, None] + np.arange(2 * half + 1)
        beyond = ((over < 0) | (over > n - 1)) & reached
        return mirrored(first, weights, n), np.asarray(~beyond.any(axis=1))

    return in_blocks(channels, len(at), 2 * half + 1, weigh, marked)


def mean_samples(
    values: ArrayLike,
    start: float,
    step: float,
    stamps: ArrayLike,
    length: float,
    *,
    sampling: str = "instantaneous",
    marked: Flags | None = None,
) -> Resampled:
    """Average over the interval that ends at each stamp.

    `values` ((n,) or (n, k)). `start`, `step` (s): stamp of the first sample, and the sampling
    interval. `stamps` ((m,), s). `length` (s): length of the intervals; at least one step of the
    samples. `sampling` ({'instantaneous', 'mean'}): whether a sample is the value at its stamp,
    linear in between (trapezoids), or the mean over the step that ends there. `marked` ((n, k)): as
    in `decimate`. Integrals over consecutive intervals add up to the integral of the whole, to
    rounding. The gain at f is ``sinc(f length)``, times ``sinc²(f step)`` for the trapezoids: a
    mean is only a weak low-pass. It belongs to the middle of the interval. ConfigError: `sampling`
    is unknown, or the intervals are shorter than a step. DataError: a sample or stamp is not
    finite, or an interval does not lie in the record.
    """
    channels, at = as_channels(values), as_channels(stamps, "stamps")[:, 0]
    step = positive_step(step)
    if sampling not in ("instantaneous", "mean"):
        raise ConfigError("dsp.no-kind-sampling", quantity="sampling", sampling=sampling)
    if not length >= step * (1.0 - SLACK):
        raise ConfigError(
            "dsp.means-over-samples-apart-say", quantity="length", length=length, step=step
        )
    n = len(channels)
    before = step if sampling == "mean" else 0.0
    low = start - before
    _check_within(np.r_[at - length, at], low, start + (n - 1) * step, step)
    until = np.clip((at - start) / step, -before / step, n - 1.0)
    since = np.clip((at - length - start) / step, -before / step, n - 1.0)

    def share(u: Array) -> Array:
        """Integral to u of the unit step of a mean, or of the triangle between samples."""
        if sampling == "mean":
            return np.asarray(np.clip(u + 1.0, 0.0, 1.0))
        v = np.clip(u, -1.0, 1.0)
        return np.asarray(0.5 + v - 0.5 * v * np.abs(v))

    width = math.ceil(length / step) + 3

    def weigh(rows: slice) -> tuple[LocalWeights, Flags]:
        first = np.floor(since[rows]).astype(np.int64)
        first = np.clip(first, 0, max(n - width, 0))
        i = first[:, None] + np.arange(min(width, n))
        weights = share(until[rows, None] - i) - share(since[rows, None] - i)
        weights /= weights.sum(axis=1, keepdims=True)
        return LocalWeights(first, weights), np.ones(len(first), dtype=bool)

    return in_blocks(channels, len(at), width, weigh, marked)


def in_blocks(
    channels: Array,
    m: int,
    width: int,
    weigh: Callable[[slice], tuple[LocalWeights, Flags]],
    marked: Flags | None,
) -> Resampled:
    """Compute and apply weights by blocks of outputs, to limit memory."""
    values, noise = np.empty((m, channels.shape[1])), np.empty(m)
    whole, touched = np.empty(m, dtype=bool), np.zeros(values.shape, dtype=bool)
    size = max(1, BLOCK // (width * channels.shape[1]))
    for k in range(0, m, size):
        rows = slice(k, min(k + size, m))
        local, whole[rows] = weigh(rows)
        values[rows], noise[rows] = local.apply(channels), local.noise_factor
        if marked is not None:
            touched[rows] = local.any_of(marked)
    return Resampled(values, noise, whole, touched)


def _check_within(at: Array, low: float, high: float, step: float) -> None:
    off = np.maximum(low - at, at - high)
    if off.max() > SLACK * step:
        worst = int(np.argmax(off))
        raise DataError(
            "dsp.lies-outside-record-goes", quantity="stamps", at=at[worst], low=low, high=high
        )


# Decimation by an integer factor with fixed weights, chunk by chunk. Integrals are kept exactly.


@dataclass(frozen=True, eq=False)
class FirState:
    """State between chunks.

    `first`: index of the oldest sample kept. `given`: number of outputs so far. `values` ((k, c)).
    """

    first: int
    given: int
    values: Array


@dataclass(frozen=True, eq=False)
class FirDecimation:
    """A low-pass of fixed length that keeps every `factor`-th sample.

    Output j has the stamp of sample ``centre + j factor``, in the middle of its window: the delay
    is the same at all frequencies, and this stamp compensates it.

    `step` (s): sampling interval. `means`: whether a sample is a mean over the step that ends at
    its stamp. The weights are then symmetric about the output's stamp, half a step off the samples'
    stamps.
    """

    design: LowPassDesign
    step: float
    factor: int
    means: bool = False

    @cached_property
    def weights(self) -> Array:
        """Filter weights, oldest sample first.

        The weights of the design, corrected so that each sample counts the same in the sum of all
        outputs: weights that are `factor` apart sum to ``1/factor``. Constants pass unchanged, the
        gain at all multiples of the output rate is zero to rounding, and the integral of the
        outputs equals that of the samples.
        """
        half = self.half
        count = 2 * half + int(not self.means)
        place: Array = np.arange(count, dtype=np.float64) - 0.5 * (count - 1)
        raw = self.design.kernel(self.step * place)
        phase = np.arange(len(raw)) % self.factor
        shares = np.bincount(phase, raw, self.factor)
        # In proportion to its sum, so that small weights far from the middle change little.
        return np.asarray(raw / (self.factor * shares[phase]))

    @property
    def half(self) -> int:
        """Samples on either side of the middle."""
        return max(self.factor, math.floor(self.design.reach / self.step + 0.5 * self.means))

    @property
    def centre(self) -> int:
        """Sample at the stamp of the first output: a multiple of `factor`."""
        # A mean before the first stamp counts as one sample earlier.
        return math.ceil((self.half - int(self.means)) / self.factor) * self.factor

    @property
    def delay(self) -> float:
        """Latency in s: from an output's stamp to the last sample that it needs."""
        return (self.half - 0.5 * self.means) * self.step

    @property
    def noise_factor(self) -> float:
        """Ratio of the standard deviations of output and sample for white noise."""
        return float(np.linalg.norm(self.weights))

    def response(self, frequency: ArrayLike) -> Array:
        """Compute the gain at frequencies in Hz, with that of the mean over a step for `means`."""
        f = np.atleast_1d(np.asarray(frequency, dtype=np.float64))
        place = np.arange(len(self.weights)) - 0.5 * (len(self.weights) - 1)
        gain = np.cos(2.0 * np.pi * self.step * np.outer(f, place)) @ self.weights
        return np.asarray(gain * np.sinc(f * self.step) if self.means else gain)

    def begin(self, channels: int) -> FirState:
        """Return the state before the first sample."""
        return FirState(0, 0, np.empty((0, channels)))

    def advance(self, state: FirState, values: Array) -> tuple[FirState, Array]:
        """Process a chunk of samples and return the outputs that are complete.

        `values` ((k, c)). Returns `state`; `outputs` ((m, c)).
        """
        from strapdown._kernels.signals import fir_decimate

        held = np.ascontiguousarray(np.vstack([state.values, values]))
        start = self.centre + state.given * self.factor - self.half + int(self.means)
        after = state.first + len(held) - (start + len(self.weights))
        count = max(0, after // self.factor + 1)
        out = np.empty((count, held.shape[1]))
        fir_decimate(held, self.weights, start - state.first, self.factor, out)
        drop = max(0, min(start + count * self.factor - state.first, len(held)))
        return FirState(state.first + drop, state.given + count, held[drop:].copy()), out


def fir_decimation(
    step: float,
    factor: int,
    *,
    means: bool = False,
    passband: float = 0.5,
    attenuation: float = 80.0,
) -> FirDecimation:
    """Design the low-pass for decimation by an integer factor.

    `step` (s). `factor`: two or more. `means`: whether a sample is the mean over the step that ends
    at its stamp. `passband`, `attenuation`: as `low_pass_design`. ConfigError: an option is out of
    its range.
    """
    if factor != int(factor) or factor < 2:
        raise ConfigError("dsp.every-th-sample-no-decimation", quantity="factor", factor=factor)
    design = low_pass_design(
        step, 1.0 / (factor * step), passband=passband, attenuation=attenuation
    )
    return FirDecimation(design, step, int(factor), means)


# Interpolation by polynomials through the six nearest samples, with the noise gain.

POINTS = 6


def interpolate(
    time: ArrayLike, values: ArrayLike, stamps: ArrayLike, marked: Flags | None = None
) -> Resampled:
    """Interpolate samples to stamps.

    `time` ((n,), s): increasing, any spacing. `values` ((n,) or (n, k)). `stamps` ((m,), s): within
    the record. `marked` ((n, k)): as in `decimate`. Returns the polynomial of degree 5
    through the six nearest samples, one-sided near the ends: exact for polynomials up to that
    degree, and at the samples. Midway between even samples the gain at f is
    ``150/128 cos x - 25/128 cos 3x + 3/128 cos 5x`` with ``x = π f step``: 0.9990 at an eighth of
    the sampling rate, 0.950 at a quarter. The noise factor there is 0.84; between the first two
    samples it is up to 1.6. DataError: fewer than six samples, time does not advance, a stamp is
    outside the record, or a number is not finite.
    """
    t, channels = as_channels(time, "time")[:, 0], as_channels(values)
    at = as_channels(stamps, "stamps")[:, 0]
    n = len(t)
    if n != len(channels) or n < POINTS:
        raise DataError(
            "dsp.stamps-samples-cannot-interpolated",
            quantity="time",
            n=n,
            count=len(channels),
            points=POINTS,
        )
    if not np.diff(t).min() > 0.0:
        row = int(np.argmax(np.diff(t) <= 0.0)) + 1
        raise DataError(
            "dsp.time-does-not-advance-followed",
            row=row + 1,
            quantity="time",
            t=t[row - 1],
            t_2=t[row],
        )
    slack = SLACK * float(np.median(np.diff(t)))
    off = np.maximum(t[0] - at, at - t[-1])
    if off.max() > slack:
        raise DataError(
            "dsp.lies-outside-record-goes-2",
            quantity="stamps",
            at=at[int(np.argmax(off))],
            t=t[0],
            t_2=t[-1],
        )
    first = np.clip(np.searchsorted(t, at, side="right") - POINTS // 2, 0, n - POINTS)

    def weigh(rows: slice) -> tuple[LocalWeights, Flags]:
        return (
            LocalWeights(first[rows], lagrange(t[first[rows, None] + np.arange(POINTS)], at[rows])),
            np.ones(len(first[rows]), dtype=bool),
        )

    return in_blocks(channels, len(at), POINTS, weigh, marked)


def lagrange(nodes: Array, at: Array) -> Array:
    """Compute weights (m, p) that evaluate polynomials through nodes (m, p) at points (m,)."""
    p = nodes.shape[1]
    weights = np.ones_like(nodes)
    for i in range(p):
        for j in range(p):
            if i != j:
                weights[:, i] *= (at - nodes[:, j]) / (nodes[:, i] - nodes[:, j])
    return weights


def interpolated_means(
    time: ArrayLike,
    values: ArrayLike,
    stamps: ArrayLike,
    length: float,
    marked: Flags | None = None,
) -> Resampled:
    """Average `interpolate` over intervals that end at stamps (three-point Gauss quadrature).

    `time`, `values`, `stamps`, `marked`: as in `interpolate`; the intervals lie within the record.
    `length` (s): length of the intervals, at most two steps of the samples. Exact for polynomials
    up to degree 5.
    """
    t, channels = as_channels(time, "time")[:, 0], as_channels(values)
    at = as_channels(stamps, "stamps")[:, 0]
    node, share = np.polynomial.legendre.leggauss(3)
    points = at[:, None] + 0.5 * length * (node - 1.0)
    interpolate(t, channels, [points.min(), points.max()])
    n, width = len(t), min(POINTS + 4, len(t))
    low = np.clip(np.searchsorted(t, points[:, 0], side="right") - POINTS // 2, 0, n - width)

    def weigh(rows: slice) -> tuple[LocalWeights, Flags]:
        m = len(low[rows])
        weights = np.zeros((m, width))
        for k in range(3):
            x = points[rows, k]
            first = np.searchsorted(t, x, side="right") - POINTS // 2
            first = np.clip(first, low[rows], low[rows] + width - POINTS)
            at_node = lagrange(t[first[:, None] + np.arange(POINTS)], x)
            place = (first - low[rows])[:, None] + np.arange(POINTS)
            weights[np.arange(m)[:, None], place] += 0.5 * share[k] * at_node
        return LocalWeights(low[rows], weights), np.ones(m, dtype=bool)

    return in_blocks(channels, len(at), width, weigh, marked)
