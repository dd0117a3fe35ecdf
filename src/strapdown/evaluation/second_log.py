"""The log of a second sensor on the same body: its clock and its mounting, fitted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.errors import DataError
from strapdown.evaluation.clock_alignment import (
    SMOOTH_CELLS,
    CoarseOffset,
    EvenRates,
    coarse_offset,
    even_rates,
    proper_rotation,
)
from strapdown.results.second_log import SecondLog
from strapdown.tables import check_imu

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]

__all__ = ["align_second_log"]

ITERATIONS = 30
# Blocks over which residuals are summed before they count as independent.
BLOCK = 1.0  # s
LEAST_BLOCKS = 40
# Windows in which the offset is looked for by itself, to see the clocks drift apart.
WINDOW = 20.0  # s
# Crystals are good to 100 ppm, and stamps of a phone or a host to some hundreds.
MAX_DRIFT = 2e-3
# The second axis of the motion must stand above the noise by this much in power, and fix the
# mounting about the first to this.
ABOVE_NOISE = 10.0
MAX_MOUNTING_SD = 2.0  # deg
LEAST_SHARE = 0.5

OFFSET, DRIFT, TURN, BIAS, SCALE = 0, 1, slice(2, 5), slice(5, 8), 8


@dataclass(frozen=True)
class _State:
    offset: float
    drift: float
    turn: Array  # C_12
    bias: Array
    scale: float


def align_second_log(
    first: pd.DataFrame, second: pd.DataFrame, *, offset: float | None = None
) -> SecondLog:
    """Find how a second sensor's clock and axes lie to the first one's.

    Parameters
    ----------
    first, second : DataFrame
        Imu tables of two sensors on one rigid body; only their gyros are used. Clocks,
        axes, rates and kinds of sampling may differ.
    offset : float, s, optional
        Second clock less first clock, to half a second, where it is known: it is then not
        looked for.

    Returns
    -------
    SecondLog

    Raises
    ------
    DataError
        There is too little motion, too little in common, or the offset is ambiguous.

    Notes
    -----
    The coarse offset comes from `clock_alignment.coarse_offset`, the drift of the clocks from
    offsets in windows of 20 s. Then all nine figures (offset, drift, three of mounting, three
    of bias, scale) are fitted to the smoothed rates together, by Gauss-Newton. Their covariance
    is that of the residuals summed over blocks of a second (a sandwich), so that neither the
    smoothing nor what the model leaves out makes it too small. A difference of the delays of the
    sensors' filters is part of the offset. What noise the second log has shrinks its scale
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
    return _result(fit, state, axis, covariance, residual, coarse)


class _Fit:
    """Rates of the first log at its cells, and those of the second as a function of time."""

    def __init__(self, a: EvenRates, b: EvenRates, offset: float) -> None:
        from scipy.interpolate import CubicSpline

        # From the second log's own start, so that stamps of an epoch keep their digits.
        self.origin = b.start
        self.spline: CubicSpline[np.float64] = CubicSpline(b.time - b.start, b.rate)
        self.slope = self.spline.derivative()
        self.known = b.known
        self.step = a.step
        time = a.time
        inside = a.known & (time + offset > b.start) & (time + offset < b.time[-1])
        # One more cell than the drift can take away at either end.
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

    def solve(self) -> tuple[_State, Array | None]:
        """Gauss-Newton from the coarse offset and the drift that windows show."""
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
            state = _moved(state, change)
            if np.abs(change[TURN]).max() < 1e-10 and abs(change[OFFSET]) < 1e-9:
                break
        return state, axis

    def _by_windows(self) -> tuple[float, float]:
        """Offset and drift from windows, each aligned by itself with one mounting for all."""
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

    def _shift(self, state: _State, keep: slice) -> float:
        """Offset that does best within a window, by Newton's steps of at most a tenth second."""
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

    def _mounted(self, offset: float, drift: float) -> _State:
        rate, _ = self.second(offset, drift)
        mean_1, mean_2 = self.rate.mean(axis=0), rate.mean(axis=0)
        x, y = self.rate - mean_1, rate - mean_2
        turn, common = proper_rotation(x.T @ y)
        scale = common / max(float((y**2).sum()), 1e-300)
        return _State(offset, drift, turn, mean_1 - scale * turn @ mean_2, scale)

    def _residuals(self, state: _State) -> tuple[Array, Array]:
        """What is left, (n, 3), and what each figure changes of the model, (n, 3, 9)."""
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

    def _single_axis(self, state: _State) -> Array | None:
        """The axis, where the body turned about one only, in the first sensor's axes."""
        left, _ = self._residuals(state)
        noise = float((left**2).mean())
        power, axes = np.linalg.eigh(np.cov(self.rate.T))
        independent = len(self.time) / (2.0 * np.sqrt(np.pi) * SMOOTH_CELLS)
        second = power[1] - noise
        fixed = np.sqrt(noise / max(second * independent, 1e-300))
        if second >= ABOVE_NOISE * noise and np.degrees(fixed) <= MAX_MOUNTING_SD:
            return None
        return np.asarray(axes[:, 2])

    def _least_turn(self, state: _State, axis: Array) -> _State:
        """The same alignment of the axis, with the least turn about it."""
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
        return _State(state.offset, state.drift, turn, bias, state.scale)

    def _free(self, axis: Array | None) -> Array:
        """Directions in which the figures may move: not about a single axis."""
        free = np.eye(9)
        if axis is None:
            return free
        _, _, vt = np.linalg.svd(axis[None, :])
        keep = [0, 1, 5, 6, 7, 8]
        out = np.zeros((9, 8))
        out[keep, range(6)] = 1.0
        out[TURN, 6:] = vt[1:].T
        return out

    def spread(self, state: _State, axis: Array | None) -> tuple[Array, float, float]:
        """Covariance of the figures, root mean square of the residuals, share explained."""
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


def _moved(state: _State, change: Array) -> _State:
    return _State(
        state.offset + float(change[OFFSET]),
        state.drift + float(change[DRIFT]),
        rotation.dcm_from_rotation_vector(change[TURN]) @ state.turn,
        state.bias + change[BIAS],
        state.scale + float(change[SCALE]),
    )


def _result(
    fit: _Fit,
    state: _State,
    axis: Array | None,
    covariance: Array,
    residual: float,
    coarse: CoarseOffset,
) -> SecondLog:
    sd = np.sqrt(np.diag(covariance))
    mounting = rotation.quaternion_from_dcm(state.turn)
    mounting_sd = np.degrees(sd[TURN])
    if axis is not None:
        # About an axis of the sensor that has a part of the single axis nothing is known.
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


def _triple(values: ArrayLike) -> tuple[float, float, float]:
    x, y, z = np.asarray(values, dtype=np.float64)
    return float(x), float(y), float(z)
