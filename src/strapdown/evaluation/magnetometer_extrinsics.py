"""Extrinsics of a magnetometer beside gyros: rotation, delay and iron, with bounds."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.attitude_algorithms import Quaternion, run_attitude
from strapdown.dsp.delay import lag_correlation, top_peaks
from strapdown.errors import DataError
from strapdown.evaluation.differences import attitude_at
from strapdown.evaluation.extrinsics import (
    ANY,
    DRIFT,
    SHAPE,
    SYMMETRIC,
    WHOLE_BIAS,
    Extrinsics,
    Residuals,
    bounded,
    compared,
    crossed,
    named,
    rms,
    solve,
)
from strapdown.evaluation.second_log import EvenRates, even_rates, even_values
from strapdown.increments import increments_from_imu
from strapdown.sensors.magnetometer import SHAPES, calibrate_magnetometer
from strapdown.tables import GYRO, MAG, check_imu, imu_table
from strapdown.tables.checks import index_of, values_of

Array = NDArray[np.float64]

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
