"""Delay between two records of one motion, to a fraction of a sample, with its uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import Array, Flags
from strapdown.dsp.decimation import decimate, low_pass_design
from strapdown.dsp.samples import as_channels, positive_step
from strapdown.errors import DataError

# Rates above add noise and hardly any signal: structures of vehicles vibrate at 30 to 300 Hz.
COMMON_RATE = 1000.0  # Hz
# Decimates the faster record to the rate of the slower one.
PASSBAND, ATTENUATION = 0.8, 60.0
PEAKS = 16
LEAST_CORRELATION = 0.7
LEAST_SAMPLES = 16
# Two maxima belong to one peak unless the coefficient drops by this much between them.
LEAST_DIP = 0.05
STEPS = 30
# Standard deviations, in samples, of the Gaussian smoothing before the fit. Unsmoothed, an
# interpolated record has less noise between samples than at them, which draws the fit to the grid;
# wider ones leave less noise, but also smaller slopes.
WIDTHS = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
TRUNCATE = 4.0


@dataclass(frozen=True, eq=False)
class EvenSignal:
    """A record on an even grid.

    `start`, `step` (s): stamp of the first sample, and the sampling interval, on the record's own
    clock. `values` ((n, k)).
    """

    start: float
    step: float
    values: Array

    @property
    def time(self) -> Array:
        """Stamps in s, (n,)."""
        return np.asarray(self.start + self.step * np.arange(len(self.values)))


@dataclass(frozen=True)
class Delay:
    """Delay of one motion between two clocks.

    `delay` (s): stamp on the second clock minus stamp on the first, for the same instant. `sd` (s):
    standard deviation, from the residuals, their correlation in time, and the slopes.
    `correlation`: correlation coefficient at the delay. `gain`: second record divided by the first.
    """

    delay: float
    sd: float
    correlation: float
    gain: float


def find_delay(first: EvenSignal, second: EvenSignal) -> Delay:
    """Estimate the delay of the second record against the first by correlation.

    `first`, `second`: any rates; the same number of channels, which show one motion in one unit or
    in proportion, such as magnitudes of vectors, which do not depend on the mounting. Each channel
    may have a constant offset. Half the shorter record must overlap. Both records are decimated to
    the slower rate, at most 1 kHz. The highest correlation coefficient gives the delay to one
    sample. Least squares with a gain and constants refines it to a fraction, after the Gaussian
    smoothing that gives the smallest variance: ``second(t + d) = g first(t) + c``. The variance is
    ``Σ r_l Σ_i x'_i x'_(i+l)`` over ``(Σ x' y')²``, with the autocovariance r of the residuals. For
    white residuals it is ``σ²/Σ x'²``, the Cramér-Rao bound for known shapes (Kay, Fundamentals of
    Statistical Signal Processing I, Eq. (3.14)). Where two points of a vehicle move differently,
    the difference is part of the residuals. DataError: the numbers of channels differ, the overlap
    is too short, the signal is constant, or the peak is ambiguous.
    """
    one, two = _at_common_rate(first, second)
    step = one.step
    x, y = one.values, two.values
    for signal, name in ((x, "first"), (y, "second")):
        if not float(np.ptp(signal, axis=0).max()) > 1e-9 * float(np.abs(signal).max()):
            raise DataError("dsp.record-does-not-vary-constants", quantity="values", name=name)
    least = max(0.5 * min(len(x), len(y)), LEAST_SAMPLES)
    lags, score = lag_correlation(
        x, y, np.ones(len(x), dtype=bool), np.ones(len(y), dtype=bool), least
    )
    delays = two.start - one.start - lags * step
    peaks = top_peaks(score, PEAKS) if score.size else np.empty(0, dtype=np.int64)
    if not peaks.size:
        raise DataError(
            "dsp.no-delay-leaves-common-both",
            quantity="time",
            least=least * step,
        )
    best = int(peaks[0])
    rival = next((int(k) for k in peaks[1:] if _apart(score, best, int(k))), None)
    result = _refine(one, two, float(delays[best]), float(score[best]))
    if result.correlation < LEAST_CORRELATION:
        raise DataError(
            "dsp.records-little-common-best-needed",
            quantity="values",
            correlation=result.correlation,
            least_correlation=LEAST_CORRELATION,
        )
    if rival is not None and repeats(float(score[best]), float(score[rival])):
        raise DataError(
            "dsp.delays-do-about-well-motion",
            quantity="time",
            delay=result.delay,
            runner_up_delay=float(delays[rival]),
            score=score[best],
            runner_up=float(score[rival]),
        )
    return result


def _at_common_rate(first: EvenSignal, second: EvenSignal) -> tuple[EvenSignal, EvenSignal]:
    signals = [
        EvenSignal(s.start, positive_step(s.step), as_channels(s.values, name))
        for s, name in ((first, "first"), (second, "second"))
    ]
    widths = [s.values.shape[1] for s in signals]
    if widths[0] != widths[1]:
        raise DataError(
            "dsp.records-channels", quantity="values", widths=widths[0], widths_2=widths[1]
        )
    step = max(*(s.step for s in signals), 1.0 / COMMON_RATE)
    return _slower(signals[0], step), _slower(signals[1], step)


def _slower(signal: EvenSignal, step: float) -> EvenSignal:
    if signal.step * (1.0 + 1e-6) > step:
        # The rates agree to rounding: use one step for both, so that lags are whole samples.
        return EvenSignal(signal.start, step, signal.values)
    design = low_pass_design(signal.step, 1.0 / step, passband=PASSBAND, attenuation=ATTENUATION)
    n = int((len(signal.values) - 1) * signal.step / step * (1.0 + 1e-9)) + 1
    stamps = signal.start + step * np.arange(n)
    out = decimate(signal.values, signal.start, signal.step, stamps, design)
    return EvenSignal(signal.start, step, out.values)


def _apart(score: Array, a: int, b: int) -> bool:
    low, high = min(a, b), max(a, b)
    return bool(score[low : high + 1].min() < min(score[a], score[b]) - LEAST_DIP)


def _refine(one: EvenSignal, two: EvenSignal, delay: float, coarse: float) -> Delay:
    """Fit with smoothing widths that double, and keep the smallest variance."""
    from scipy.ndimage import gaussian_filter1d

    shorter = min(len(one.values), len(two.values))
    widths = [w for w in WIDTHS if 2.0 * TRUNCATE * w + LEAST_SAMPLES <= 0.5 * shorter]
    best: Delay | None = None
    noise: Array | None = None
    for width in widths or WIDTHS[:1]:
        edge = int(TRUNCATE * width) if widths else 0
        smooth = [
            EvenSignal(
                s.start + edge * s.step,
                s.step,
                gaussian_filter1d(s.values, width, axis=0, truncate=TRUNCATE)[
                    edge : len(s.values) - edge
                ],
            )
            for s in (one, two)
        ]
        found, noise = _least_squares(smooth[0], smooth[1], delay, coarse, width, noise)
        if best is None or found.sd < best.sd:
            best = found
    assert best is not None
    return best


def _least_squares(
    one: EvenSignal, two: EvenSignal, delay: float, coarse: float, width: float, noise: Array | None
) -> tuple[Delay, Array | None]:
    """Fit the delay, a gain and constants from the nearest sample on; estimate the noise.

    The variance is the larger of two: one from the correlation of the residuals, which scatters,
    so that the smallest over the widths is low by chance; and one for white noise before the
    smoothing, with the noise variance of the narrowest width.
    """
    from scipy.interpolate import CubicSpline
    from scipy.ndimage import gaussian_filter1d

    shape = CubicSpline(one.time, one.values)
    slope = CubicSpline(two.time, two.values)(two.time, 1)
    at, limit = delay, (1.5 + 3.0 * width) * one.step
    nothing = Delay(delay, math.inf, coarse, 1.0)
    for _ in range(STEPS):
        inside = (two.time - at >= one.time[0]) & (two.time - at <= one.time[-1])
        if inside.sum() < LEAST_SAMPLES:
            return nothing, noise
        t = two.time[inside] - at
        x, y, dx, dy = shape(t), two.values[inside], shape(t, 1), slope[inside]
        x, y = x - x.mean(axis=0), y - y.mean(axis=0)
        dx, dy = dx - dx.mean(axis=0), dy - dy.mean(axis=0)
        gain = float((x * y).sum() / (x * x).sum())
        # The noise of the two records is independent: it does not bias the product of slopes.
        energy = gain * float((dx * dy).sum())
        if not energy > 0.0:
            return nothing, noise
        move = -gain * float((dx * (y - gain * x)).sum()) / energy
        at = float(np.clip(at + move, delay - limit, delay + limit))
        if abs(move) < 1e-9 * one.step:
            break
    residual = y - gain * x
    common = float((x * y).sum() / math.sqrt((x * x).sum() * (y * y).sum()))
    if noise is None:
        # A Gaussian reduces the variance of white noise to 1/(2 sqrt(π) width).
        left = 2.0 * math.sqrt(math.pi) * width / max(len(t) - 3, 1)
        noise = left * (residual**2).sum(axis=0)
    felt = gaussian_filter1d(gain * dx, width, axis=0, truncate=TRUNCATE, mode="constant")
    white = float(((felt**2).sum(axis=0) * noise).sum())
    sd = math.sqrt(max(_variance(gain * dx, residual, width), white)) / energy
    found = Delay(at, sd, max(common, coarse), gain)
    return found, noise


def _variance(slope: Array, residual: Array, width: float) -> float:
    """Compute the variance of ``Σ slope residual``; correlation up to a tenth of the record."""
    from scipy.signal import correlate

    n = len(residual)
    reach = min(n, max(n // 10, int(12.0 * width)))
    lag = np.arange(reach)
    # Full weight over half the reach, then tapered to zero; both signs of a lag.
    taper = np.minimum(1.0, 2.0 - 2.0 * lag / reach) * np.where(lag, 2.0, 1.0) / (n - lag)
    total = 0.0
    for s, e in zip(slope.T, residual.T, strict=True):
        of_slope, of_residual = (
            correlate(x, x, mode="full", method="fft")[n - 1 : n - 1 + reach] for x in (s, e)
        )
        total += float((taper * of_slope * of_residual).sum())
    # Degrees of freedom that the gain, the constants and the delay took from the residuals.
    return max(total, 0.0) * n / max(n - 3, 1)


# Correlation of two signals over their lags, with gaps, and its peaks.


def lag_correlation(
    x: Array, y: Array, known_x: Flags, known_y: Flags, least: float
) -> tuple[Array, Array]:
    """Compute the correlation coefficient for each lag: sample k of y lies at k + lag of x.

    `x`, `y` ((n,) and (m,), or (n, k) and (m, k)): on one step; channels are pooled, each about its
    own mean. `known_x`, `known_y` ((n,) and (m,)): False where a sample is missing. `least`:
    samples that both must have at a lag. Returns `lags`: lags with enough overlap; `coefficient`:
    -1 to 1; means and variances are taken over the overlap at the lag.
    """
    from scipy.signal import correlate

    x = np.where(known_x[:, None], x.reshape(len(x), -1), 0.0)
    y = np.where(known_y[:, None], y.reshape(len(y), -1), 0.0)
    m, w = known_x.astype(np.float64), known_y.astype(np.float64)

    def slide(p: Array, q: Array) -> Array:
        return np.asarray(correlate(p, q, mode="full", method="fft"))

    count = np.maximum(np.round(slide(m, w)), 1.0)
    cross, var_x, var_y = (np.zeros(len(count)) for _ in range(3))
    for p, q in zip(x.T, y.T, strict=True):
        sum_x, sum_y = slide(p, w), slide(m, q)
        cross += slide(p, q) - sum_x * sum_y / count
        var_x += slide(p * p, w) - sum_x**2 / count
        var_y += slide(m, q * q) - sum_y**2 / count
    lags = np.arange(-(len(y) - 1), len(x), dtype=np.float64)
    # A nearly constant stretch would correlate by its noise.
    floor = 1e-3 * min(float(s.var(axis=0).sum()) * len(s) for s in (x, y))
    good = (count >= least) & (var_x > floor) & (var_y > floor)
    return lags[good], cross[good] / np.sqrt(var_x[good] * var_y[good])


def top_peaks(score: Array, most: int) -> NDArray[np.int64]:
    """Find the highest positive local maxima; indices, the highest first."""
    inner = np.r_[-np.inf, score, -np.inf]
    top = np.flatnonzero((inner[1:-1] >= inner[:-2]) & (inner[1:-1] >= inner[2:]))
    order = top[np.argsort(score[top])[::-1][:most]]
    return order[score[order] > 0.0]


def repeats(best: float, runner_up: float) -> bool:
    """Whether another peak fits about as well as the best.

    True up to twice the best misfit plus a hundredth of the total.
    """
    return 1.0 - runner_up < 2.0 * (1.0 - best) + 0.01
