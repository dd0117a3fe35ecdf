"""Clock and mounting of a second sensor on the same body, fitted to both logs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.attitude_algorithms import Quaternion, run_attitude
from strapdown.constants import Triple
from strapdown.dsp.delay import lag_correlation, repeats, top_peaks
from strapdown.errors import DataError
from strapdown.evaluation.differences import attitude_at
from strapdown.increments import increments_from_imu
from strapdown.tables import GYRO, attitude_table, check_imu, find_gaps, imu_table
from strapdown.tables.checks import Array

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


@dataclass(frozen=True)
class SecondLog:
    """Alignment of a second sensor's log with the first, on the same body.

    The model is ``omega_1(t) = scale R_12 omega_2(u) + bias`` with
    ``u = t + offset + drift (t - middle)``; every ``sd`` is one standard deviation from the
    residuals, with their correlation in time.

    Attributes
    ----------
    start, end : float, s
        Common interval of both logs, on the first clock.
    middle : float, s
        Instant of the first clock at which `offset` holds.
    offset, offset_sd : float, s
        Second clock minus first clock.
    drift_ppm, drift_sd_ppm : float
        Rate excess of the second clock, in parts per million.
    mounting : tuple of four float
        ``q_12``: rotates a vector from the second sensor's axes into the first one's.
    mounting_deg : tuple of float, deg
        The same as roll, pitch, heading.
    mounting_sd_deg : tuple of float, deg
        About the first sensor's axes; infinite where not observable.
    bias, bias_sd : tuple of float, rad/s
        Bias of the first minus (scaled, rotated) bias of the second, in the first one's axes.
    scale, scale_sd : float
        Scale of the first over that of the second.
    axis : tuple of float or None
        If the body rotated about one axis only: that axis, in the first sensor's axes. The
        mounting about it is then the smallest rotation that fits, and not observable.
    correlation : float
        Correlation of the rates at the coarse offset, at best 1.
    runner_up : float
        The same for the next-best offset.
    residual : float, rad/s
        Root mean square of the residuals, all axes together, after smoothing.
    smoothing : float, s
        Standard deviation of the Gaussian that smoothed both before the fit.
    cells : int
        Number of fitted points.
    """

    start: float
    end: float
    middle: float
    offset: float
    offset_sd: float
    drift_ppm: float
    drift_sd_ppm: float
    mounting: tuple[float, float, float, float]
    mounting_deg: Triple
    mounting_sd_deg: Triple
    bias: Triple
    bias_sd: Triple
    scale: float
    scale_sd: float
    axis: Triple | None
    correlation: float
    runner_up: float
    residual: float
    smoothing: float
    cells: int


ITERATIONS = 30
# Blocks over which residuals are summed to be independent.
BLOCK = 1.0  # s
LEAST_BLOCKS = 40
# Windows with an offset of their own, to find the drift between the clocks.
WINDOW = 20.0  # s
# Crystals are accurate to 100 ppm, and time stamps of a phone or a host to some hundreds.
MAX_DRIFT = 2e-3
# The second axis of the motion must exceed the noise by this ratio in power, and determine the
# mounting about the first to this.
ABOVE_NOISE = 10.0
MAX_MOUNTING_SD = 2.0  # deg
LEAST_SHARE = 0.5

OFFSET, DRIFT, TURN, BIAS, SCALE = 0, 1, slice(2, 5), slice(5, 8), 8


@dataclass(frozen=True)
class _Estimate:
    offset: float
    drift: float
    turn: Array  # C_12
    bias: Array
    scale: float


def align_second_log(
    first: pd.DataFrame, second: pd.DataFrame, *, offset: float | None = None
) -> SecondLog:
    """Find the clock offset and mounting of a second sensor relative to the first.

    Parameters
    ----------
    first, second : DataFrame
        Imu tables of two sensors on one rigid body; only their gyros are used. Clocks,
        axes, rates and kinds of sampling may differ.
    offset : float, s, optional
        Second clock minus first clock, to half a second, if known: it is then not searched.

    Returns
    -------
    SecondLog

    Raises
    ------
    DataError
        There is too little motion, too little overlap, or the offset is ambiguous.

    Notes
    -----
    The coarse offset comes from `clock_alignment.coarse_offset`, the drift of the clocks from
    offsets in windows of 20 s. Then all nine figures (offset, drift, three of mounting, three
    of bias, scale) are fitted to the smoothed rates together, by Gauss-Newton. Their covariance
    is that of the residuals summed over blocks of a second (a sandwich), so that neither the
    smoothing nor model errors make it too small. A difference of the delays of the
    sensors' filters is part of the offset. Noise of the second log reduces its scale
    by its share in the power of the smoothed rates.
    """
    check_imu(first)
    check_imu(second)
    if offset is None:
        coarse = coarse_offset(first, second)
    else:
        coarse = CoarseOffset(float(offset), float("nan"), float("nan"))
    step = max(float(np.median(np.diff(t.index.to_numpy()))) for t in (first, second))
    a, b = even_rates(first, step), even_rates(second, step)
    fit = _Fit(a, b, coarse.offset)
    state, axis = fit.solve()
    covariance, residual, share = fit.spread(state, axis)
    if share < LEAST_SHARE:
        raise DataError(
            "evaluation.rotation-clock-leave-power-rates", quantity="gyro", share=100 * (1 - share)
        )
    sd = np.sqrt(np.diag(covariance))
    mounting = rotation.quaternion_from_dcm(state.turn)
    mounting_sd = np.degrees(sd[TURN])
    if axis is not None:
        # About a sensor axis that is partly along the single axis the result is undetermined.
        mounting_sd = np.where(np.abs(axis) > 1e-3, np.inf, mounting_sd)
    return SecondLog(
        start=float(fit.time[0]),
        end=float(fit.time[-1]),
        middle=fit.middle,
        offset=state.offset,
        offset_sd=float(sd[OFFSET]),
        drift_ppm=1e6 * state.drift,
        drift_sd_ppm=1e6 * float(sd[DRIFT]),
        mounting=(float(mounting[0]), float(mounting[1]), float(mounting[2]), float(mounting[3])),
        mounting_deg=_triple(rotation.euler_from_quaternion(mounting)),
        mounting_sd_deg=_triple(mounting_sd),
        bias=_triple(state.bias),
        bias_sd=_triple(sd[BIAS]),
        scale=state.scale,
        scale_sd=float(sd[SCALE]),
        axis=None if axis is None else _triple(axis),
        correlation=coarse.correlation,
        runner_up=coarse.runner_up,
        residual=residual,
        smoothing=SMOOTH_CELLS * fit.step,
        cells=len(fit.time),
    )


class _Fit:
    """Rates of the first log at its cells, and those of the second as a function of time."""

    def __init__(self, a: EvenRates, b: EvenRates, offset: float) -> None:
        from scipy.interpolate import CubicSpline

        # From the second log's own start, so that time stamps since an epoch keep their digits.
        self.origin = b.start
        self.spline: CubicSpline[np.float64] = CubicSpline(b.time - b.start, b.rate)
        self.slope = self.spline.derivative()
        self.known = b.known
        self.step = a.step
        time = a.time
        inside = a.known & (time + offset > b.start) & (time + offset < b.time[-1])
        # One more cell than the drift can consume at either end.
        margin = 0.5 + MAX_DRIFT * float(time[-1] - time[0])
        inside &= (time + offset > b.start + margin) & (time + offset < b.time[-1] - margin)
        cell = np.clip(np.round((time + offset - b.start) / b.step), 0, len(b.rate) - 1)
        inside &= b.known[cell.astype(np.int64)]
        if inside.sum() * a.step < 2.0:
            raise DataError(
                "evaluation.offset-logs-share",
                quantity="time",
                offset=offset,
                inside=inside.sum() * a.step,
            )
        self.time, self.rate = time[inside], a.rate[inside]
        self.middle = float(0.5 * (self.time[0] + self.time[-1]))
        self.coarse = offset

    def second(self, offset: float, drift: float, keep: slice | None = None) -> tuple[Array, Array]:
        """Rates of the second log and their slopes at the first one's cells."""
        time = self.time if keep is None else self.time[keep]
        u = time - self.origin + offset + drift * (time - self.middle)
        return self.spline(u), self.slope(u)

    def solve(self) -> tuple[_Estimate, Array | None]:
        """Gauss-Newton from the coarse offset and the drift of the windows."""
        offset, drift = self._by_windows()
        state = self._mounted(offset, drift)
        axis = self._single_axis(state)
        if axis is not None:
            state = self._least_turn(state, axis)
        for _ in range(ITERATIONS):
            left, jacobian = self._residuals(state)
            free = self._free(axis)
            design = jacobian.reshape(-1, 9) @ free
            # Columns differ by six orders of size.
            size = np.sqrt((design**2).sum(axis=0))
            scaled = design / size
            change = free @ (np.linalg.solve(scaled.T @ scaled, scaled.T @ left.ravel()) / size)
            state = _Estimate(
                state.offset + float(change[OFFSET]),
                state.drift + float(change[DRIFT]),
                rotation.dcm_from_rotation_vector(change[TURN]) @ state.turn,
                state.bias + change[BIAS],
                state.scale + float(change[SCALE]),
            )
            if np.abs(change[TURN]).max() < 1e-10 and abs(change[OFFSET]) < 1e-9:
                break
        return state, axis

    def _by_windows(self) -> tuple[float, float]:
        """Offset and drift from windows, each aligned by itself with one common mounting."""
        offset, drift = self.coarse, 0.0
        for _ in range(5):
            offset = self._shift(self._mounted(offset, drift), slice(None))
        cells = int(WINDOW / self.step)
        count = len(self.time) // cells
        if count < 3:
            return offset, drift
        for _ in range(3):
            state = self._mounted(offset, drift)
            at, found, weight = [], [], []
            for k in range(count):
                keep = slice(k * cells, (k + 1) * cells)
                slope = self.second(offset, drift, keep)[1]
                power = float((slope**2).sum())
                shift = self._shift(state, keep) - state.offset
                at.append(float(self.time[keep].mean()) - self.middle)
                found.append(shift)
                weight.append(np.sqrt(power))
            line = np.polyfit(at, found, 1, w=weight)
            limit = MAX_DRIFT / 3.0
            drift = float(np.clip(drift + np.clip(line[0], -limit, limit), -MAX_DRIFT, MAX_DRIFT))
            offset += float(np.clip(line[1], -0.25, 0.25))
        return offset, drift

    def _shift(self, state: _Estimate, keep: slice) -> float:
        """Best offset within a window, by Newton steps of at most a tenth of a second."""
        offset = state.offset
        for _ in range(6):
            rate, slope = self.second(offset, state.drift, keep)
            model = state.scale * rate @ state.turn.T + state.bias
            gradient = state.scale * slope @ state.turn.T
            power = float((gradient**2).sum())
            if power == 0.0:
                break
            step = float(((self.rate[keep] - model) * gradient).sum()) / power
            offset += float(np.clip(step, -0.1, 0.1))
        return offset

    def _mounted(self, offset: float, drift: float) -> _Estimate:
        rate, _ = self.second(offset, drift)
        mean_1, mean_2 = self.rate.mean(axis=0), rate.mean(axis=0)
        x, y = self.rate - mean_1, rate - mean_2
        turn, common = proper_rotation(x.T @ y)
        scale = common / max(float((y**2).sum()), 1e-300)
        return _Estimate(offset, drift, turn, mean_1 - scale * turn @ mean_2, scale)

    def _residuals(self, state: _Estimate) -> tuple[Array, Array]:
        """Residuals, (n, 3), and their derivatives by each parameter, (n, 3, 9)."""
        rate, slope = self.second(state.offset, state.drift)
        turned = rate @ state.turn.T
        left = self.rate - (state.scale * turned + state.bias)
        jacobian = np.zeros((len(rate), 3, 9))
        jacobian[:, :, OFFSET] = state.scale * slope @ state.turn.T
        jacobian[:, :, DRIFT] = jacobian[:, :, OFFSET] * (self.time - self.middle)[:, None]
        # A small turn a about the first sensor's axes adds a x turned.
        for k in range(3):
            jacobian[:, :, 2 + k] = state.scale * np.cross(np.eye(3)[k], turned)
            jacobian[:, k, 5 + k] = 1.0
        jacobian[:, :, SCALE] = turned
        return left, jacobian

    def _single_axis(self, state: _Estimate) -> Array | None:
        """The axis in the first sensor's axes, if the body turned about one only."""
        left, _ = self._residuals(state)
        noise = float((left**2).mean())
        power, axes = np.linalg.eigh(np.cov(self.rate.T))
        independent = len(self.time) / (2.0 * np.sqrt(np.pi) * SMOOTH_CELLS)
        second = power[1] - noise
        fixed = np.sqrt(noise / max(second * independent, 1e-300))
        if second >= ABOVE_NOISE * noise and np.degrees(fixed) <= MAX_MOUNTING_SD:
            return None
        return np.asarray(axes[:, 2])

    def _least_turn(self, state: _Estimate, axis: Array) -> _Estimate:
        """The same alignment of the axis, with the least rotation about it."""
        there = state.turn.T @ axis
        across = np.cross(there, axis)
        size, along = float(np.sqrt(across @ across)), float(there @ axis)
        if size < 1e-9:
            flip = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
            flip *= np.pi / np.sqrt(flip @ flip)
            vector = np.zeros(3) if along > 0.0 else flip
        else:
            vector = across / size * np.arctan2(size, along)
        turn = rotation.dcm_from_rotation_vector(vector)
        mean = self.second(state.offset, state.drift)[0].mean(axis=0)
        bias = self.rate.mean(axis=0) - state.scale * turn @ mean
        return _Estimate(state.offset, state.drift, turn, bias, state.scale)

    def _free(self, axis: Array | None) -> Array:
        """Free directions of the parameters: not about a single axis."""
        free = np.eye(9)
        if axis is None:
            return free
        _, _, vt = np.linalg.svd(axis[None, :])
        keep = [0, 1, 5, 6, 7, 8]
        out = np.zeros((9, 8))
        out[keep, range(6)] = 1.0
        out[TURN, 6:] = vt[1:].T
        return out

    def spread(self, state: _Estimate, axis: Array | None) -> tuple[Array, float, float]:
        """Covariance of the parameters, root mean square of the residuals, share explained."""
        left, jacobian = self._residuals(state)
        free = self._free(axis)
        design = jacobian @ free
        size = np.sqrt((design**2).sum(axis=(0, 1)))
        design = design / size
        scores = np.einsum("kij,ki->kj", design, left)
        cells = int(max(1, min(BLOCK / self.step, len(left) / LEAST_BLOCKS)))
        block = np.add.reduceat(scores, np.arange(0, len(scores), cells), axis=0)
        inverse = np.linalg.inv(np.einsum("kij,kil->jl", design, design))
        blocks, free_count = len(block), free.shape[1]
        widen = blocks / max(blocks - free_count, 1)
        part = inverse @ (block.T @ block) @ inverse * widen
        covariance = (free / size) @ part @ (free / size).T
        power = float(((self.rate - self.rate.mean(axis=0)) ** 2).sum())
        square = float((left**2).sum())
        return covariance, float(np.sqrt(square / len(left))), 1.0 - square / max(power, 1e-300)


def _triple(values: ArrayLike) -> tuple[float, float, float]:
    x, y, z = np.asarray(values, dtype=np.float64)
    return float(x), float(y), float(z)


# Two logs of one motion: their rates on even grids, and the coarse offset of their clocks.


# A Gaussian of two cells attenuates to 3e-9 at the end of the band, so that interpolating
# between cells changes neither the signal nor the power of its noise.
SMOOTH_CELLS = 2.0
# Least overlap of both logs for the search of an offset.
LEAST_OVERLAP = 5.0  # s
COARSE_STEP = 0.02  # s
PEAKS = 8
# A pause of rates below this has no timing information.
LEAST_RATE = 0.02  # rad/s, root mean square
LEAST_CORRELATION = 0.7


@dataclass(frozen=True)
class EvenRates:
    """Smoothed rates on an even grid.

    Attributes
    ----------
    start, step : float, s
        Middle of the first cell, and the distance of cells.
    rate : ndarray, (n, 3), rad/s
    known : ndarray of bool, (n,)
        False in gaps of the log and near them.
    """

    start: float
    step: float
    rate: Array
    known: NDArray[np.bool_]

    @property
    def time(self) -> Array:
        """Middles of the cells in s."""
        return np.asarray(self.start + self.step * np.arange(len(self.rate)))


@dataclass(frozen=True)
class CoarseOffset:
    """Offset of two clocks to a cell of the grid.

    Attributes
    ----------
    offset : float, s
        Second clock less first clock.
    correlation, runner_up : float
        Share that the rates have in common there, and at the best other offset.
    """

    offset: float
    correlation: float
    runner_up: float


def even_rates(imu: pd.DataFrame, step: float) -> EvenRates:
    """Mean rates over the cells of a grid of `step` s, smoothed by a Gaussian of two cells."""
    time = imu.index.to_numpy(dtype=np.float64)
    if int((time[-1] - time[0]) / step) < 8:
        raise DataError(
            "evaluation.too-short-compared-another-log",
            file=imu.attrs.get("source"),
            quantity="time",
            time=time[-1] - time[0],
            least_overlap=LEAST_OVERLAP,
        )
    rate = imu[GYRO].to_numpy(dtype=np.float64)
    return even_values(time, rate, step, mean=imu.attrs["sampling"] == "mean")


def even_values(time: Array, values: Array, step: float, *, mean: bool) -> EvenRates:
    """As `even_rates` of any values, (n, k), at stamps, (n,).

    From the integral of the values, so that stamps in bursts are weighted by their interval.
    """
    from scipy.interpolate import CubicSpline
    from scipy.ndimage import gaussian_filter1d

    origin, steps = time[0], np.diff(time)
    n = int((time[-1] - origin) / step)
    edges = step * np.arange(n + 1)
    even = steps.max() < 1.5 * np.median(steps)
    if not mean and even:
        summed = CubicSpline(time - origin, values).antiderivative()(edges)
    else:
        # A spline overshoots at uneven time stamps; the integral is kept in any case.
        parts = values[1:] if mean else 0.5 * (values[:-1] + values[1:])
        whole = np.vstack([np.zeros(values.shape[1]), np.cumsum(parts * steps[:, None], axis=0)])
        if even:
            summed = CubicSpline(time - origin, whole)(edges)
        else:
            summed = np.column_stack([np.interp(edges, time - origin, c) for c in whole.T])
    smooth = gaussian_filter1d(np.diff(summed, axis=0) / step, SMOOTH_CELLS, axis=0, truncate=5.0)
    middle = edges[:-1] + 0.5 * step
    known = np.ones(n, dtype=bool)
    reach = 5.0 * SMOOTH_CELLS * step
    for gap in find_gaps(time):
        known &= ~((middle > gap.start - origin - reach) & (middle < gap.end - origin + reach))
    # At the ends the filter mirrors the signal.
    known[: int(4 * SMOOTH_CELLS)] = known[-int(4 * SMOOTH_CELLS) :] = False
    return EvenRates(float(origin + 0.5 * step), step, smooth, known)


def proper_rotation(product: Array) -> tuple[Array, float]:
    """Rotation C_ab of least squares from the sum of ``a b^T``, and the sum of ``a · C_ab b``.

    Wahba's problem by singular values (Markley 1988, doi:10.1007/BF03546354).
    """
    u, size, vt = np.linalg.svd(product)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt)) or 1.0])
    return (u * sign) @ vt, float((size * sign).sum())


def coarse_offset(first: pd.DataFrame, second: pd.DataFrame) -> CoarseOffset:
    """Find the offset of two clocks from the rates, whatever the mounting.

    Peaks of the correlation of the rates' magnitudes, weighted by the share of the vectors that one
    rotation explains.
    """
    usual = max(float(np.median(np.diff(t.index.to_numpy()))) for t in (first, second))
    step = max(COARSE_STEP, usual)
    a, b = even_rates(first, step), even_rates(second, step)
    for grid, name in ((a, "first"), (b, "second")):
        spread = grid.rate[grid.known] if grid.known.any() else np.zeros((1, 3))
        if float(np.sqrt(spread.var(axis=0).sum())) < LEAST_RATE:
            raise DataError(
                "evaluation.log-hardly-turns-rates-scatter",
                quantity="gyro",
                name=name,
                least_rate=LEAST_RATE,
            )
    x, y = (np.sqrt((g.rate**2).sum(axis=1)) for g in (a, b))
    shorter = min(len(a.rate) * a.step, len(b.rate) * b.step)
    least = min(LEAST_OVERLAP, 0.5 * shorter) / step
    lags, score = lag_correlation(x, y, a.known, b.known, least)
    if not score.size:
        raise DataError(
            "evaluation.they-share-less-than-however", quantity="time", least_overlap=LEAST_OVERLAP
        )
    weighed = [(_vector_share(a, b, lag), lag) for lag in lags[top_peaks(score, PEAKS)].astype(int)]
    best, at = max(weighed, default=(0.0, 0))
    # Offsets within half a second belong to the same peak.
    apart = int(np.ceil(0.5 / step))
    rest = [share for share, lag in weighed if abs(lag - at) > apart]
    found = CoarseOffset(b.start - a.start - at * step, best, max(rest, default=0.0))
    if best < LEAST_CORRELATION:
        raise DataError(
            "evaluation.rates-two-logs-little-common",
            quantity="gyro",
            best=best,
            least_correlation=LEAST_CORRELATION,
        )
    if repeats(best, found.runner_up):
        other = next(lag for share, lag in weighed if share == found.runner_up)
        raise DataError(
            "evaluation.offsets-do-about-well-motion",
            quantity="time",
            offset=found.offset,
            start=b.start - a.start - other * step,
            best=best,
            runner_up=found.runner_up,
        )
    return found


def _vector_share(a: EvenRates, b: EvenRates, lag: int) -> float:
    """Share of the rates that one rotation explains at a lag, 0 to 1."""
    lo, hi = max(0, lag), min(len(a.rate), len(b.rate) + lag)
    known = a.known[lo:hi] & b.known[lo - lag : hi - lag]
    x, y = a.rate[lo:hi][known], b.rate[lo - lag : hi - lag][known]
    if len(x) < 3:
        return 0.0
    x, y = x - x.mean(axis=0), y - y.mean(axis=0)
    _, common = proper_rotation(x.T @ y)
    return common / max(float(np.sqrt((x**2).sum() * (y**2).sum())), 1e-300)


# Attitude truth on the first log's clock and axes, from the log of a second sensor.


def second_clock(aligned: SecondLog, time: ArrayLike) -> Array:
    """Convert instants of the first clock to the second."""
    t = np.asarray(time, dtype=np.float64)
    out: Array = t + aligned.offset + 1e-6 * aligned.drift_ppm * (t - aligned.middle)
    return out


def first_clock(aligned: SecondLog, time: ArrayLike) -> Array:
    """Convert instants of the second clock to the first: inverse of `second_clock`."""
    since = np.asarray(time, dtype=np.float64) - aligned.middle - aligned.offset
    out: Array = aligned.middle + since / (1.0 + 1e-6 * aligned.drift_ppm)
    return out


def truth_from_second_log(
    aligned: SecondLog,
    first: pd.DataFrame,
    second: pd.DataFrame,
    *,
    attitude: pd.DataFrame | None = None,
    gyro_bias: ArrayLike = (0.0, 0.0, 0.0),
    q_start: ArrayLike = (1.0, 0.0, 0.0, 0.0),
) -> pd.DataFrame:
    """Attitude of the first sensor's axes at its stamps, by the second log.

    Parameters
    ----------
    aligned : SecondLog
        From `second_log.align_second_log`.
    first, second : DataFrame
        The two Imu tables.
    attitude : DataFrame, optional
        Attitude table of the second sensor on its own clock. If it has one, it is taken; if
        not, the second log's rates are integrated sample by sample.
    gyro_bias : array_like, (3,), rad/s
        Bias of the second gyro in its own axes, subtracted beforehand: its residual turns
        the truth at its rate. From a rest, or from its calibration.
    q_start : array_like, (4,)
        Attitude of the first sensor at its first stamp that both cover: a gyro gives relative
        attitude only. Not used if `attitude` is given.

    Returns
    -------
    DataFrame
        An Attitude table at the stamps of the first log that both cover.

    Raises
    ------
    DataError
        The body turned about one axis only, so that the mounting is unknown; or the logs do
        not overlap.

    Notes
    -----
    ``C_n1 = C_n2 C_12^T``. A time error ``dt`` causes an error ``omega dt``. A mounting error ``m``
    enters an absolute attitude in full; in an attitude that starts equal it causes ``m - C^T m``,
    at most twice its size.
    """
    if aligned.axis is not None:
        raise DataError(
            "evaluation.body-turned-about-axis-only",
            quantity="mounting",
            axis=[f"{v:.2f}" for v in aligned.axis],
        )
    check_imu(second)
    if attitude is None:
        # On the first clock: a second clock that runs fast would enlarge every rotation.
        imu = imu_table(
            first_clock(aligned, second.index),
            second[GYRO].to_numpy(dtype=np.float64) - np.asarray(gyro_bias),
            sampling=second.attrs["sampling"],
            source=second.attrs.get("source"),
        )
        table = run_attitude(Quaternion(), increments_from_imu(imu)).attitude
    else:
        table = attitude
    stamps = first.index.to_numpy(dtype=np.float64)
    there = stamps if attitude is None else second_clock(aligned, stamps)
    inside = (there >= table.index[0]) & (there <= table.index[-1])
    if inside.sum() < 2:
        raise DataError(
            "evaluation.stamps-first-log-lie-within", quantity="time", inside=int(inside.sum())
        )
    q_n2 = attitude_at(table, there[inside])
    q_21 = rotation.conjugate(aligned.mounting)
    q_n1 = rotation.compose(q_n2, q_21)
    if attitude is None:
        since_start = rotation.compose(rotation.conjugate(q_n1[0]), q_n1)
        q_n1 = rotation.compose(q_start, since_start)
    return attitude_table(stamps[inside], q_n1, source="second log")
