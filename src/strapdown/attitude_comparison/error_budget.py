"""Share of a gyro's bias, clock, scale and axes in an attitude error, estimated against a truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.attitude_comparison.sweep import MOST_ACCURATE, Grounds
from strapdown.dsp.chi_square import chi_square_above
from strapdown.dsp.samples import moving_mean
from strapdown.evaluation.differences import Errors, Known, known_at
from strapdown.increments import increments_from_imu
from strapdown.rotation import unit_rotation_angle
from strapdown.tables import GYRO
from strapdown.tables.checks import Array, index_of, values_of

#: Rotations are compared over windows of at most and at least this length, s: so many in a record;
#: the fewest of them.
WINDOW, SHORTEST, WINDOWS, LEAST_WINDOWS = 1.0, 0.1, 60, 30
#: A part counts if its chi-square has a smaller probability by chance.
CHANCE = 1e-3
#: A delay is that of means if it is within so many standard deviations.
SIGNIFICANT = 3.0
#: Parts, in the order in which they are removed, and their parameters in the estimate.
PARTS = {"clock": slice(0, 2), "bias": slice(2, 5), "scale and axes": slice(5, 14)}
UNKNOWNS = 14
#: Times that a clock is estimated, and the largest delay that a line of the rates can show, s.
CLOCK_STEPS, MOST_DELAY = 4, 0.3
#: Spacing of the starts and of the instants in a search for the time that a tolerance is held.
STARTS, INSTANTS = 1.0, 0.1


@dataclass(frozen=True)
class ErrorBudget:
    """Gyro errors from the rotations of a log against a truth, and the error without them.

    Estimated from the record itself: a bound of what a calibration could remove, not a calibration.

    Attributes
    ----------
    delay_s, delay_sd : float
        Stamps less instants of the rates, by the clock of the truth, at `middle_s`, and standard
        deviation. Half a step where samples are means over the step before their stamps, minus half
        a step where they are means over the step after.
    drift_ppm, drift_sd_ppm : float
        Change of the delay over time.
    middle_s : float
        Instant of the delay.
    bias : ndarray, (3,), rad/s
        Beside the bias that was removed.
    matrix : ndarray, (3, 3)
        The gyro reads ``(I + matrix) @ rate + bias``.
    parts : DataFrame
        One row per part that counts, in the order of removal, and first ``as stamped``: ``part``,
        ``share_deg`` (largest angle between the attitudes before and after), ``final_deg``,
        ``rms_deg``, ``max_deg`` (errors with this and all parts before removed).
    """

    delay_s: float
    delay_sd: float
    drift_ppm: float
    drift_sd_ppm: float
    middle_s: float
    bias: Array
    matrix: Array
    parts: pd.DataFrame = field(repr=False)

    @property
    def clock_counts(self) -> bool:
        """Whether a delay of the stamps is among the parts."""
        return "clock" in self.parts["part"].tolist()

    def on_log_clock(self, truth: pd.DataFrame) -> pd.DataFrame:
        """Move the truth to the clock of the log."""
        return on_log_clock(truth, (self.delay_s, 1e-6 * self.drift_ppm, self.middle_s))

    def most_delay_s(self, time: Array) -> float:
        """Largest delay over the record."""
        ends = self.delay_s + 1e-6 * self.drift_ppm * (time[[0, -1]] - self.middle_s)
        return float(np.abs(ends).max())

    def late_as_means(self, step: float) -> bool:
        """Whether the stamps are late by half a step, and not in time."""
        off = abs(self.delay_s - 0.5 * step)
        return self.clock_counts and off <= SIGNIFICANT * self.delay_sd


@dataclass(frozen=True)
class Holding:
    """For how long integration alone stays within a tolerance, from any known attitude.

    Attributes
    ----------
    shortest_s, median_s : float
        Over starts along the record.
    ends : bool
        Whether the tolerance is exceeded at all; if not, both are what the record covers.
    median_ends : bool
        Likewise for the median.
    """

    shortest_s: float
    median_s: float
    ends: bool
    median_ends: bool


def find_budget(
    grounds: Grounds, truth: pd.DataFrame, scored: NDArray[np.bool_]
) -> ErrorBudget | None:
    """Estimate the parts of a log's sensor error against an attitude truth.

    Over a window the gyro's rotation less the truth's is, to first order in the gyro's errors and
    in axes at the end, ``∫ C (b + M ω) dt + τ(t_begin) C ω_begin - τ(t_end) ω_end``, with C from
    each instant to the end and τ the delay of the stamps, a line over the record: the error
    equation of strapdown attitude (Titterton and Weston, 2004, sec. 12.3), integrated. Least
    squares over all windows; parts without significance are left out.

    Returns
    -------
    ErrorBudget or None
        None without enough windows of known attitude.
    """
    if grounds.truth is None or len(rows := _windows(grounds)) < LEAST_WINDOWS:
        return None
    clock = [0.0, 0.0, float(index_of(grounds.imu).mean())]
    now = grounds
    for _ in range(CLOCK_STEPS):
        # A delay is estimated from the rates at its own instants: again, once it is taken off.
        design, off = _equations(now, rows, clock[2])
        values, sd, kept = _significant_parts(design, off)
        if "clock" not in kept or not abs(values[0]) < MOST_DELAY:
            break
        clock[0] += float(values[0])
        clock[1] += float(values[1])
        now = replace(
            grounds, truth=known_at(on_log_clock(truth, clock), scored, index_of(grounds.imu))
        )
        if not len(rows := _windows(now)) >= LEAST_WINDOWS:
            return None
    delay, drift, middle = clock
    bias, matrix = values[PARTS["bias"]], values[PARTS["scale and axes"]].reshape(3, 3)
    found = ErrorBudget(
        delay, float(sd[0]), 1e6 * drift, 1e6 * float(sd[1]), middle, bias, matrix, pd.DataFrame()
    )
    counted = [p for p in PARTS if p in kept or (p == "clock" and delay != 0.0)]
    return replace(found, parts=_removed(grounds, truth, scored, counted, found))


def on_log_clock(truth: pd.DataFrame, clock: Sequence[float]) -> pd.DataFrame:
    """Move a truth to the clock of a log: its delay in s, drift, and the instant of the delay."""
    delay, drift, middle = clock
    time = index_of(truth)
    moved = truth.copy()
    moved.index = pd.Index(time + delay + drift * (time - middle), name=truth.index.name)
    return moved


def _significant_parts(design: Array, off: Array) -> tuple[Array, Array, list[str]]:
    """Solve for the parts that are significant; a clock that agrees has its uncertainty, too."""
    kept = list(PARTS)
    while True:
        columns = np.array([c for p in kept for c in range(UNKNOWNS)[PARTS[p]]], dtype=np.int64)
        found, covariance = _solved(design[:, columns], off)
        chances = {p: _chance(found, covariance, columns, PARTS[p]) for p in kept}
        weak = [p for p in kept if chances[p] > CHANCE]
        if not weak:
            break
        kept.remove(max(weak, key=lambda p: chances[p]))
    values, sd = np.zeros(UNKNOWNS), np.full(UNKNOWNS, np.nan)
    values[columns], sd[columns] = found, np.sqrt(np.diag(covariance))
    if "clock" not in kept:
        with_clock = np.concatenate([columns, np.arange(UNKNOWNS)[PARTS["clock"]]])
        sd[PARTS["clock"]] = np.sqrt(np.diag(_solved(design[:, with_clock], off)[1])[-2:])
    return values, sd, kept


def _windows(grounds: Grounds) -> list[tuple[int, int]]:
    """First and last rows of windows within stretches, between samples of known attitude."""
    assert grounds.truth is not None
    time = index_of(grounds.imu)
    known_s = time.size * grounds.clock.step * float(grounds.truth.counts.mean())
    window = min(max(known_s / WINDOWS, SHORTEST), WINDOW)
    out = []
    for begin, end in grounds.clock.stretches:
        known = begin + np.flatnonzero(grounds.truth.counts[begin:end])
        if known.size < 2:
            continue
        number = np.floor((time[known] - time[known[0]]) / window)
        first = known[np.flatnonzero(np.diff(number, prepend=-1.0))]
        near = np.diff(time[first]) <= 2.0 * window
        out += [(int(a), int(b)) for a, b in zip(first[:-1][near], first[1:][near], strict=True)]
    return out


def _equations(
    grounds: Grounds, rows: Sequence[tuple[int, int]], middle: float
) -> tuple[Array, Array]:
    """Design matrix, (3 n, 14), and rotations left, (3 n,), rad, of all windows."""
    assert grounds.truth is not None
    time, rate = index_of(grounds.imu), values_of(grounds.imu, GYRO)
    q = grounds.own.q_nb
    c_nb = rotation.dcm_from_quaternion(q)
    steps = np.diff(time)
    a, b = np.array(rows).T

    def over(integrand: Array) -> Array:
        """Integrals over the windows, by the trapezoid."""
        whole = np.concatenate([[0.0], np.cumsum(0.5 * steps * (integrand[1:] + integrand[:-1]))])
        return np.asarray(whole[b] - whole[a])

    # One element after the other: all at once would take 36 numbers a sample.
    turn = np.empty((len(rows), 3, 3))
    weighed = np.empty((len(rows), 3, 3, 3))
    for i, k in np.ndindex(3, 3):
        turn[:, i, k] = over(c_nb[:, i, k])
        for m in range(3):
            weighed[:, i, k, m] = over(c_nb[:, i, k] * rate[:, m])
    c_bn = c_nb[b].transpose(0, 2, 1)
    bias = c_bn @ turn
    scale = c_bn @ weighed.reshape(-1, 3, 9)
    smooth = moving_mean(rate, max(1, round(0.02 / grounds.clock.step)))
    turned = c_bn @ (c_nb[a] @ smooth[a][:, :, None])
    ended = smooth[b][:, :, None]
    since = (time - middle)[:, None, None]
    clock = np.concatenate([turned - ended, turned * since[a] - ended * since[b]], axis=2)
    by_gyro = rotation.compose(rotation.conjugate(q[a]), q[b])
    known = grounds.truth.q_nb
    by_truth = rotation.compose(rotation.conjugate(known[a]), known[b])
    left = rotation.rotation_vector_from_quaternion(
        rotation.compose(rotation.conjugate(by_truth), by_gyro)
    )
    design = np.concatenate([clock, bias, scale], axis=2)
    return design.reshape(-1, UNKNOWNS), np.asarray(left).reshape(-1)


def _solved(design: Array, off: Array) -> tuple[Array, Array]:
    """Least squares and covariance, by the scatter of what is left."""
    if design.shape[1] == 0:
        return np.empty(0), np.empty((0, 0))
    found = np.asarray(np.linalg.lstsq(design, off, rcond=1e-9)[0], dtype=np.float64)
    left = off - design @ found
    variance = float(left @ left) / max(off.size - design.shape[1], 1)
    return found, np.asarray(variance * np.linalg.pinv(design.T @ design), dtype=np.float64)


def _chance(found: Array, covariance: Array, columns: NDArray[np.int64], part: slice) -> float:
    """Probability that a part is as large by chance."""
    there = np.flatnonzero((columns >= part.start) & (columns < part.stop))
    x = found[there]
    size = float(x @ np.linalg.pinv(covariance[np.ix_(there, there)]) @ x)
    return float(chi_square_above(size, there.size))


def _removed(
    grounds: Grounds,
    truth: pd.DataFrame,
    scored: NDArray[np.bool_],
    kept: Sequence[str],
    found: ErrorBudget,
) -> pd.DataFrame:
    """Errors with one part after another removed; those of `ErrorBudget.parts`."""
    before, now = grounds.own.q_nb, grounds
    rows: list[dict[str, object]] = [_row("as stamped", 0.0, _errors(grounds, before))]
    for part in kept:
        less = now
        if part == "clock":
            known = known_at(found.on_log_clock(truth), scored, index_of(now.imu))
            if not known.counts.any():
                continue
            less = replace(now, truth=known, **_anew(now, known))
        else:
            rate = values_of(now.imu, GYRO) - (found.bias if part == "bias" else 0.0)
            if part == "scale and axes":
                # The rest of the bias here is small beside the rates.
                rate = np.asarray(np.linalg.solve(np.eye(3) + found.matrix, rate.T).T)
            imu = now.imu.copy()
            imu[GYRO] = rate
            less = replace(now, imu=imu)
        q = less.history(MOST_ACCURATE, increments_from_imu(less.imu, less.interpolation))
        row = _row(part, float(unit_rotation_angle(before, q).max()), _errors(less, q))
        if part == "clock":
            # Rotation of the body meanwhile.
            speed = np.sqrt(np.square(values_of(now.imu, GYRO)).sum(axis=1)).max()
            row["share_deg"] = float(np.degrees(speed)) * found.most_delay_s(index_of(now.imu))
        # A part counts only if less is left without it.
        if float(str(row["rms_deg"])) < float(str(rows[-1]["rms_deg"])):
            rows.append(row)
            now, before = less, q
    return pd.DataFrame(rows)


def _anew(grounds: Grounds, known: Known) -> dict[str, Any]:
    """Start and restarts by a truth on another clock."""
    first = int(np.argmax(known.counts))
    anew = {row: known.q_nb[row] if known.counts[row] else q for row, q in grounds.restarts}
    if first:
        anew[first] = known.q_nb[first]
    start = grounds.q_nb if first else known.q_nb[0]
    return {"q_nb": start, "restarts": tuple(sorted(anew.items()))}


def _errors(grounds: Grounds, q: Array) -> Errors:
    assert grounds.truth is not None
    return grounds.truth.errors(q) or (np.nan, np.nan, np.nan)


def _row(part: str, share: float, errors: Errors) -> dict[str, object]:
    final, rms, largest = errors
    return {
        "part": part,
        "share_deg": share,
        "final_deg": final,
        "rms_deg": rms,
        "max_deg": largest,
    }


def holding_time(grounds: Grounds, tolerance_deg: float) -> Holding | None:
    """Find for how long integration alone stays within a tolerance of the truth.

    From every second of known attitude on, within a stretch without gaps.

    Returns
    -------
    Holding or None
        None where fewer than two instants are known.
    """
    if grounds.truth is None:
        return None
    time, reference = index_of(grounds.imu), grounds.truth
    # In a simulation `own` is the truth.
    run = grounds.own.q_nb
    if grounds.exact:
        increments = increments_from_imu(grounds.imu, grounds.interpolation)
        run = grounds.history(MOST_ACCURATE, increments)
    times: list[float] = []
    ended: list[bool] = []
    thin = max(1, round(INSTANTS / grounds.clock.step))
    for begin, end in grounds.clock.stretches:
        known = (begin + np.flatnonzero(reference.counts[begin:end]))[::thin]
        if known.size < 2:
            continue
        # Error of the attitude in local-level axes; its change is that of a run from then on.
        error = rotation.compose(run[known], rotation.conjugate(reference.q_nb[known]))
        at = time[known]
        starts = np.flatnonzero(np.diff(np.floor((at - at[0]) / STARTS), prepend=-1.0))
        for k in starts[:-1]:
            start = np.broadcast_to(error[k], error[k + 1 :].shape)
            beyond = unit_rotation_angle(error[k + 1 :], start) > tolerance_deg
            first = int(np.argmax(beyond)) if beyond.any() else beyond.size - 1
            times.append(float(at[k + 1 + first] - at[k]))
            ended.append(bool(beyond.any()))
    if not times:
        return None
    held, beyond = np.array(times), np.array(ended)
    median, reached = _median(held, beyond)
    return Holding(
        shortest_s=float(held[beyond].min()) if beyond.any() else float(held.max()),
        median_s=median,
        ends=bool(beyond.any()),
        median_ends=reached,
    )


def _median(times: Array, ended: NDArray[np.bool_]) -> tuple[float, bool]:
    """Median of times of which some are cut by the end of the record, and whether it is reached.

    Product-limit estimate (Kaplan and Meier, 1958, Eq. (2b)).
    """
    order = np.lexsort((~ended, times))
    at_risk = times.size - np.arange(times.size)
    left = np.cumprod(1.0 - ended[order] / at_risk)
    below = np.flatnonzero(left <= 0.5)
    if not below.size:
        return float(times.max()), False
    return float(times[order][below[0]]), True
