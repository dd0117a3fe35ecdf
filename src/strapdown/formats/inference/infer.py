"""Inference of a log's units, axes, clock and content from its numbers."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import Array
from strapdown.errors import DataError
from strapdown.formats.arrays import ticks_of
from strapdown.formats.find_columns import AXES, Column, find_columns
from strapdown.formats.inference.conclusion import (
    Inference,
    Steps,
    conclude,
    evidence,
    infer_accel,
    infer_rate,
    infer_time_faults,
    infer_up,
    posterior,
    time_evidence,
    time_unit_probabilities,
)
from strapdown.formats.inference.rotation_rate import infer_gyro
from strapdown.formats.recording import RawLog, ReadOptions
from strapdown.tables.checks import all_finite
from strapdown.tables.on_disk import let_go
from strapdown.units import INFERRED, MAG_UNITS, TIME_UNITS, factor_of, parse_unit

# Of a longer log the signals are judged in contiguous parts, spread evenly over it so that rests
# and motion are both in them, with this many rows in total. A part lasts long compared with the
# windows in which gravity rotates (`HALF_WIDTHS`), if the parts are not too few, and never less
# than one of them.
LARGEST, MOST_PARTS, LEAST_PARTS, PART, LEAST_PART = 40_000, 16, 3, 40.0, 10.0  # s
#: Mean step below which stamps do not advance, in their unit: the largest, min, counts 60 s.
LEAST_ADVANCE = 1e-12
#: Beyond any value of a sensor and any stamp, in any unit: their products would overflow.
HUGE, FAR = 1e12, 1e25


@dataclass(frozen=True)
class Signals:
    """Raw numbers of a log, without units.

    `stamps` ((n,)). `gyro`, `accel`, `mag` ((n, 3)). `time_unit`: if known. `rate` (Hz): without
    stamps.
    """

    stamps: NDArray[Any] | None
    gyro: Array | None
    accel: Array | None = None
    mag: Array | None = None
    time_unit: str | None = None
    rate: float | None = None


def infer(raw: RawLog, options: ReadOptions | None = None) -> tuple[Inference, ...]:
    """Infer from the numbers of a log, regardless of its statements.

    `options`: which columns to use, and the unit of time if known. Stated units of the sensors are
    ignored: they are inferred from the numbers. Returns one for each quantity that the log has
    numbers for. ConfigError: an option names a column that the log does not have. DataError: a
    value or a stamp is not a number.
    """
    options = options or ReadOptions()
    found = find_columns(raw, options)
    stamps, unit = None, None
    if "time" in found:
        stamps, dated = ticks_of(raw, found["time"].source, found["time"].unit)
        unit = "ns" if dated else found["time"].unit
        if options.time_unit and not dated:
            unit = parse_unit(options.time_unit, "time")
    triads = {t: _triad(raw, found, t) for t in ("gyro", "accel", "mag")}
    return infer_signals(Signals(stamps, **triads, time_unit=unit, rate=options.rate or raw.rate))


def _triad(raw: RawLog, found: dict[str, Column], triad: str) -> Array | None:
    columns = [f"{triad}_{a}" for a in AXES]
    if not all(c in found for c in columns):
        return None
    try:
        parts = [found[c].values(raw, c).astype(np.float64) for c in columns]
    except DataError:
        if triad == "gyro":
            raise
        return None
    return np.column_stack(parts)


def infer_signals(signals: Signals) -> tuple[Inference, ...]:
    """Infer from the numbers of arrays; see `infer`."""
    out: list[Inference] = []
    signals = replace(signals, stamps=_below(signals.stamps, FAR))
    stamps = _finite(signals.stamps)
    steps = None if stamps is None else Steps.of(stamps)
    # The length of a step, s, where its unit is stated or hardly in doubt.
    if signals.time_unit is not None:
        times = {signals.time_unit: 1.0}
    elif steps is not None:
        times = time_unit_probabilities(steps)
    else:
        times = {"s": 1.0} if signals.rate else {}
    step = 1.0 / signals.rate if signals.rate else None
    if steps is not None and times:
        best = next(iter(times))
        known = steps.mean * factor_of(best, TIME_UNITS)
        step = known if known > 0 and times[best] > 0.9 else None
    # All stamps show the clock; of the rest a part is enough.
    signals, starts = _part(signals, step)
    force = None
    accel = _finite(signals.accel)
    heard: list[Inference] = []
    if accel is not None:
        unit, form, gravity, usual = infer_accel(accel, step)
        heard, arm = [unit, form, gravity], None
        if step is not None and signals.gyro is not None and signals.accel is not None:
            kept = np.isfinite(signals.gyro).all(axis=1) & np.isfinite(signals.accel).all(axis=1)
            before = np.concatenate([[0], np.cumsum(kept)])[starts]
            arm = fit_arm(step, signals.gyro[kept], signals.accel[kept], before.tolist())
        # The acceleration of an arm may be indistinguishable from rotating gravity.
        swings = arm is not None and arm.frequency > LEAST_FREQUENCY and arm.in_step > ARM_IN_STEP
        if arm is not None and swings and arm.alone > ARM_ALONE:
            # The force is explained without gravity: the answers become questions.
            told = evidence("io.evidence-arm-explains-force", percent=100 * arm.alone)
            heard = [
                replace(i, confidence=min(i.confidence, 0.5), evidence=(*i.evidence, told))
                for i in heard
            ]
            gravity = heard[2]
        if gravity.value == "present" and gravity.confidence > 0.9:
            heard.append(infer_up(accel, step))
            # Motion cannot decide the sign of the accelerometer, only the axes can.
            signs = evidence("io.evidence-signs-turn-alike")
            told_of_sign = (signs, evidence("io.evidence-sign-of-gravity"))
            other = (("gravity", 0.05),)
            heard.append(
                Inference("accel_sign", "reaction", 0.95, told_of_sign, other, "--accel-unit")
            )
            assert signals.accel is not None
            force = signals.accel / usual
        elif gravity.value is None and _steady(accel):
            # Gravity in an unknown unit still rotates like gravity.
            assert signals.accel is not None
            force = signals.accel / usual
        if swings:
            force = None
    turned: list[Inference] = []
    if signals.gyro is not None and len(signals.gyro) > 1:
        ticks, gyro, force = _increasing(signals, force)
        if len(gyro) > 1:
            # The prior of gyro increments is that of the accelerometer, within bounds.
            summed = 0.01
            if heard:
                summed = float(np.clip(_share(heard, "accel_form", "increment"), 1e-3, 0.95))
            milli = _share(heard, "accel_unit", "mg")
            *turned, joint = infer_gyro(ticks, gyro, force, times or {"s": 1.0}, summed, milli)
            if times and next(iter(joint)) != next(iter(times)):
                # A rotation that fits only in another unit of time is a doubt, not a proof.
                times = {u: min(p, 0.5) for u, p in times.items()}
    if steps is not None and times and steps.mean > LEAST_ADVANCE:
        best = next(iter(times))
        shares = times if signals.time_unit is None else time_unit_probabilities(steps)
        of_time = time_evidence(steps, best)
        out.append(conclude("time_unit", {**shares}, of_time, "--time-unit"))
        out.append(infer_time_faults(steps))
        out.append(infer_rate(steps, signals.time_unit or best))
    elif steps is not None:
        nothing = (evidence("io.evidence-time-does-not-advance"),)
        out.append(Inference("time_unit", None, 1.0, nothing, (), "--time-unit"))
        out.append(infer_time_faults(steps))
    out += turned
    out += heard
    mag = _finite(signals.mag)
    if mag is not None:
        out.append(infer_mag_unit(mag))
    return tuple(out)


def _part(signals: Signals, step: float | None) -> tuple[Signals, list[int]]:
    """Select the rows that are judged, and where their contiguous parts begin among them."""
    triads = {t: v for t in ("gyro", "accel", "mag") if (v := getattr(signals, t)) is not None}
    size = len(next(iter(triads.values()), ()))
    if size <= LARGEST:
        all_rows: dict[str, Any] = {t: _below(v, HUGE) for t, v in triads.items()}
        return replace(signals, **all_rows), [0]
    rows = None
    if not all(all_finite(v) for v in triads.values()):
        full = np.logical_and.reduce([np.isfinite(v).all(axis=1) for v in triads.values()])
        rows = np.flatnonzero(full) if full.any() else None
    size = size if rows is None else rows.size
    count, width = LEAST_PARTS, LARGEST // LEAST_PARTS
    if step is not None:
        count = int(np.clip(LARGEST * step / PART, LEAST_PARTS, MOST_PARTS))
        width = max(LARGEST // count, round(LEAST_PART / step))
    if count * width >= size:
        count, width = 1, size
    firsts = np.linspace(0, size - width, count).astype(np.int64)
    some = (firsts[:, None] + np.arange(width)).reshape(-1)
    rows = some if rows is None else rows[some]
    part: dict[str, Any] = {}
    for triad, values in triads.items():
        part[triad] = _below(values[rows], HUGE)
        let_go(values)
    if signals.stamps is not None:
        part["stamps"] = signals.stamps[rows]
    return replace(signals, **part), list(range(0, count * width, width))


def _steady(accel: Array) -> bool:
    """Whether the norm is nearly constant: relative spread below a fifth."""
    norms = np.linalg.norm(accel, axis=1)
    return bool(np.std(norms) < 0.2 * np.mean(norms))


def _share(heard: list[Inference], quantity: str, value: str) -> float:
    """Return the probability of an answer about the accelerometer."""
    one = next((i for i in heard if i.quantity == quantity), None)
    shares = {} if one is None else dict(((one.value, one.confidence), *one.alternatives))
    return float(shares.get(value, 0.0))


def _below(values: NDArray[Any] | None, limit: float) -> NDArray[Any] | None:
    """Replace values beyond a limit by NaN; integers stay."""
    if values is None or values.dtype.kind != "f" or not values.size:
        return values
    if -limit < values.min() and values.max() < limit:  # faster than each value; not of NaN
        return values
    return np.where(np.abs(values) < limit, values, np.nan)


def _finite(values: NDArray[Any] | None) -> NDArray[Any] | None:
    """Select the finite stamps, or the rows of finite values; None if fewer than two are."""
    if values is None:
        return None
    # A sum is finite if every term is.
    if values.dtype.kind == "f" and not np.isfinite(values.sum()):
        values = values[np.isfinite(values.reshape(len(values), -1)).all(axis=1)]
    return values if len(values) > 1 else None


def _increasing(signals: Signals, force: Array | None) -> tuple[Array, Array, Array | None]:
    """Select finite rows with increasing stamps."""
    assert signals.gyro is not None
    gyro = signals.gyro
    keep = np.isfinite(gyro).all(axis=1)
    if force is not None:
        keep &= np.isfinite(force).all(axis=1)
    if signals.stamps is None:
        rate = signals.rate
        ticks = np.arange(len(gyro)) / rate if rate else np.arange(len(gyro), dtype=np.float64)
        force = force if rate else None
    else:
        stamps = signals.stamps
        exact = stamps.astype(np.int64) if stamps.dtype.kind in "iub" else stamps
        keep &= np.isfinite(exact)
        first = exact[np.argmax(keep)]
        ticks = (exact - first).astype(np.float64)
        latest = np.maximum.accumulate(np.where(keep, ticks, -np.inf))
        keep &= ticks > np.concatenate([[-np.inf], latest[:-1]])
    rows = np.flatnonzero(keep)
    ticks = ticks[rows] - (ticks[rows[0]] if rows.size else 0.0)
    return ticks, gyro[rows], None if force is None else force[rows]


# Whether the force is that of a swinging arm: a function of the rotation, with or without gravity.
#
# A point at r of a rotating body feels a x r + w x (w x r), with a = dw/dt: linear in a and in
# the products of w, and zero where both vanish. The remainder is gravity. Free coefficients cover
# every unit and every orientation of gyro and accelerometer axes.

PIECE = 0.1  # s, short compared with the period of an arm
LEAST_PIECES = 30  # intervals, twice the unknowns of a fit
# At lower frequencies an arm of 0.7 m cannot add half of gravity to a rotation of one radian.
LEAST_FREQUENCY = 2.5  # rad/s
# Squares explain two thirds of a constant for one sine, 6/7 for three that are not in phase; for an
# arm without gravity only the noise remains.
ARM_ALONE = 0.95
# Fraction of the variation, including that of gravity in phase with the rotation.
ARM_IN_STEP = 0.97


@dataclass(frozen=True)
class Arm:
    """Fraction of a force's mean square that a lever arm explains.

    `alone`: of the whole force, for a model that is zero without rotation (gravity-free).
    `in_step`: of its variation about the mean. `frequency` (rad/s): root mean square of the angular
    acceleration over that of the rate.
    """

    alone: float
    in_step: float
    frequency: float


def fit_arm(step: float, gyro: Array, accel: Array, starts: Sequence[int] = (0,)) -> Arm | None:
    """Fit a lever arm to an accelerometer.

    `step` (s). `gyro`, `accel` ((n, 3)): finite, in any units and axes. `starts`: first rows of
    contiguous parts. Returns none if the log is too short or does not rotate.
    """
    size = max(round(PIECE / step), 1)
    parts = [
        slice(a, a + (b - a) // size * size)
        for a, b in itertools.pairwise((*starts, len(gyro)))
        if b - a >= 3 * size
    ]
    count = sum(part.stop - part.start for part in parts) // size
    # The mean is the bias, provided that the swing returns.
    rate = gyro - gyro.mean(axis=0) if len(gyro) else gyro
    largest = float(np.abs(rate).max(initial=0.0))
    if count < LEAST_PIECES or not largest > 0:
        return None
    rate = rate / largest
    products = np.column_stack([rate[:, i] * rate[:, j] for i in range(3) for j in range(i, 3)])
    means: list[list[Array]] = [[], [], [], []]
    for part in parts:
        w, p, f = (
            v[part].reshape(-1, size, v.shape[1]).mean(axis=1) for v in (rate, products, accel)
        )
        a = (w[2:] - w[:-2]) / (2.0 * size * step)
        for held, one in zip(means, (a, w[1:-1], p[1:-1], f[1:-1]), strict=True):
            held.append(one)
    a, w, p, f = map(np.concatenate, means)
    moved = float(np.sum(w**2))
    if not moved > 0:
        return None
    # A residual bias multiplies the rate, so w itself is among the regressors.
    alone = _explained(np.hstack([a, p, w]), f)
    turn = np.hstack([a, p])
    in_step = _explained(turn - turn.mean(axis=0), f - f.mean(axis=0))
    return Arm(alone, in_step, float(np.sqrt(np.sum(a**2) / moved)))


def _explained(x: Array, y: Array) -> float:
    norms = np.linalg.norm(x, axis=0)
    x = x / np.where(norms > 0, norms, 1.0)
    left = y - x @ np.linalg.lstsq(x, y, rcond=1e-6)[0]
    return 1.0 - float(np.sum(left**2)) / max(float(np.sum(y**2)), 1e-300)


# Inference of a magnetometer's unit, from the strength of the Earth's field.


# The field at the surface is 22 to 67 µT (IGRF-13), plus uncalibrated iron in the device and its
# surroundings.
_FIELD = (22.0, 67.0)
_IRON = 0.15  # decades, width of the tail on either side
_PRIOR = {"uT": 0.75, "nT": 0.05, "gauss": 0.12, "mG": 0.06, "T": 0.02}
_OTHER, _DECADES = 0.05, 12.0


def infer_mag_unit(mag: Array) -> Inference:
    """Infer the unit of a magnetometer.

    `mag` ((n, 3)): finite, as in the log.
    """
    usual = float(np.median(np.linalg.norm(mag, axis=1)))
    remedy = evidence("io.evidence-unit-in-name")
    if not usual > 0:
        return Inference("mag_unit", None, 1.0, (evidence("io.evidence-all-zero"), remedy))
    low, high = np.log10(_FIELD)
    height = 1.0 / (high - low + 2.5 * _IRON)
    weights: dict[str | None, float] = {}
    for unit in INFERRED["mag"]:
        where = np.log10(usual * MAG_UNITS[unit])
        off = max(low - where, where - high, 0.0) / _IRON
        weights[unit] = float(np.log(_PRIOR[unit] * height) - 0.5 * off * off)
    weights[None] = float(np.log(_OTHER / _DECADES))
    found = posterior(weights)
    best = next(iter(found))
    if best is None:
        told = evidence("io.evidence-field", norm=usual)
    else:
        field = {"microtesla": usual * MAG_UNITS[best], "low": _FIELD[0], "high": _FIELD[1]}
        told = evidence("io.evidence-field-in-unit", norm=usual, unit=best, **field)
    return conclude("mag_unit", found, (told, remedy))
