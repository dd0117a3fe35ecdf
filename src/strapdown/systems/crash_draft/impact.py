"""Impact of a unit on its own clock, and its state of rest before."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.events import PART_563, EventDetector
from strapdown.sensors.pre_crash import find_pre_crash_rest
from strapdown.systems.crash_draft.parts import Part
from strapdown.tables import ACCEL, GYRO

__all__ = ["Impact", "Sitting", "find_impact", "sitting_at_rest"]


Array = NDArray[np.float64]

# Span before the largest pulse that belongs to it, and window for the resting value before that.
BEFORE, REACH = 0.3, 3.0  # s
LEAST_BASE = 5  # samples
# A record that counts from its trigger has the event within this of zero.
AT_ZERO = 0.05  # s
CHANGE_OVER = 0.15  # s
# A pulse without an event begins at this share of its peak, after this time below it.
BEGUN, QUIET = 0.2, 0.02  # s


@dataclass(frozen=True)
class Impact:
    """Impact as measured by accelerometers.

    Attributes
    ----------
    trigger : float, s
        On their clock; without an event, the begin of the largest pulse.
    trigger_sd : float, s
    at_zero : bool
        The record counts from its trigger.
    found : bool
        Whether an event as defined by 49 CFR 563 was found.
    largest : float, m/s
        Horizontal delta-v of the event; without one, the largest within 150 ms.
    peak : float, m/s²
        Of the resultant, without gravity.
    change : ndarray, (3,), m/s
        Delta-v in sensor axes, over 150 ms from the trigger, with the resting value subtracted.
    base : ndarray, (3,), m/s²
        The resting value.
    rest : (float, float) or None, s
    grade : str
        Of the rest: ``still``, ``steady``, or empty.
    sitting : Sitting or None
    more : int
        Events after the first.
    """

    trigger: float
    trigger_sd: float
    at_zero: bool
    found: bool
    largest: float
    peak: float
    change: Array
    base: Array
    rest: tuple[float, float] | None
    grade: str
    sitting: Sitting | None
    more: int


def find_impact(strong: Part, fine: Part, gyro: Part | None = None) -> Impact:
    """Find the impact and the rest before it.

    Parameters
    ----------
    strong : Part
        The accelerometer of the highest range.
    fine : Part
        The accelerometer of the lowest range, on the same clock; may be the same.
    gyro : Part, optional
        On the same clock.
    """
    time = strong.time
    rest = _rest(fine, gyro, _struck(strong))
    base, fine_base = _base(strong, rest), _base(fine, rest)
    free = np.nan_to_num(strong.values - base)
    sitting = sitting_at_rest(fine_base) if len(fine.axes) == 3 else None
    level = _ahead(sitting.into_vehicle(free) if sitting else free)
    step = float(np.median(np.diff(time)))
    # Rounded stamps have steps of two lengths.
    lasts = np.gradient(time)[:, None]
    before = time < time[int(np.argmax(np.linalg.norm(free, axis=1)))] - BEFORE
    noise = free[before].std(axis=0) if before.sum() > LEAST_BASE else np.zeros(3)
    detector = EventDetector(noise=tuple(float(n) for n in noise))
    detector.extend(time, level)
    events = [*detector.events, *([detector.current] if detector.current else [])]
    peak_at = int(np.argmax(np.linalg.norm(free, axis=1)))
    if events:
        first = events[0]
        trigger, sd = first.time_zero, first.time_zero_sd
        during = (time >= first.time_zero) & (time <= first.end)
        largest = float(np.linalg.norm((level[:, :2] * lasts)[during].sum(axis=0)))
    else:
        trigger, sd = _onset(time, np.linalg.norm(free, axis=1), peak_at), math.nan
        largest = detector.largest_change[0]
    # Time zero is not more accurate than the interval in which it is searched allows.
    sd = max(sd if math.isfinite(sd) else 0.0, step, 0.25 * PART_563.wake_window)
    at_zero = bool(time[0] - 1.5 * step <= 0.0 <= time[-1] and abs(trigger) < AT_ZERO)
    after = (time >= trigger) & (time <= trigger + CHANGE_OVER)
    change = (free * lasts)[after].sum(axis=0)
    return Impact(
        0.0 if at_zero else trigger,
        step / math.sqrt(12.0) if at_zero else sd,
        at_zero,
        bool(events),
        largest,
        float(np.linalg.norm(free[peak_at])),
        change,
        fine_base,
        None if rest is None else (rest[0], rest[1]),
        "" if rest is None else rest[2],
        sitting,
        max(len(events) - 1, 0),
    )


def _ahead(level: Array) -> Array:
    """With the larger of the two horizontal components first, as the heading is not known yet."""
    size = (level[:, :2] ** 2).sum(axis=0)
    return level if size[0] >= size[1] else np.asarray(level[:, [1, 0, 2]])


def _onset(time: Array, size: Array, peak_at: int) -> float:
    """Begin of the largest pulse: the last quiet instant before it, quiet for 5 ms."""
    above = np.flatnonzero(size[: peak_at + 1] > BEGUN * size[peak_at])
    gaps = np.flatnonzero(np.diff(time[above]) > QUIET)
    first = above[gaps[-1] + 1] if gaps.size else above[0]
    return float(time[max(int(first) - 1, 0)])


def _struck(part: Part) -> float:
    """Time of the largest acceleration minus the duration of a pulse."""
    return float(part.time[int(np.argmax((part.free**2).sum(axis=1)))]) - BEFORE


def _base(part: Part, rest: tuple[float, float, str] | None) -> Array:
    """Resting value: the mean over the rest, or else before the largest pulse."""
    time, values, has = part.time, part.values, part.axes
    out = np.full(3, np.nan)
    if part.zeroed:
        out[has] = 0.0
        return out
    struck = _struck(part)
    windows = [(rest[0], rest[1])] if rest else []
    windows += [(struck - REACH, struck), (float(time[0]), 0.5 * float(time[0] + struck))]
    for start, end in windows:
        rows = (time >= start) & (time <= end)
        if rows.sum() >= LEAST_BASE:
            out[has] = values[rows][:, has].mean(axis=0)
            return out
    # A record that begins with the crash: either zeroed, or without a usable rest.
    out[has] = values[: LEAST_BASE - 2, has].mean(axis=0)
    return out


def _rest(fine: Part, gyro: Part | None, impact: float) -> tuple[float, float, str] | None:
    if len(fine.axes) < 3 or fine.zeroed:
        return None
    noise = float(np.sqrt(np.mean(np.diff(fine.values, axis=0) ** 2, axis=0) / 2.0).max())
    rates = np.zeros_like(fine.values)
    if gyro is not None and len(gyro.axes) == 3:
        rates = np.column_stack(
            [np.interp(fine.time, gyro.time, gyro.values[:, k]) for k in range(3)]
        )
    imu = pd.DataFrame(
        np.column_stack([rates, fine.values]),
        index=pd.Index(fine.time, name="time"),
        columns=[*GYRO, *ACCEL],
    )
    found = find_pre_crash_rest(imu, impact=impact, accel_noise=noise)
    return None if found is None else (found.start, found.end, found.grade)


# Roll and pitch of a mounting from gravity at rest; gravity does not observe the heading.


# A housing is bolted along the vehicle's axes; floor, bracket and bias tilt it by less.
MOST_LEAN = 20.0  # deg
# Plausible magnitudes at rest: scale factor and bias of a low-cost sensor.
LEAST_LENGTH, MOST_LENGTH = 0.8, 1.2  # g


@dataclass(frozen=True)
class Sitting:
    """Mounting angles from gravity at rest.

    Attributes
    ----------
    roll_deg, pitch_deg : float, deg
        As `Mounting.angles_deg`, without the heading, which gravity does not observe.
    along : str
        Sensor axis that points up, as ``-z``; empty where none does.
    lean_deg : float, deg
        Between that axis and the vertical.
    length : float, m/s²
        Of the specific force at rest.
    """

    roll_deg: float
    pitch_deg: float
    along: str
    lean_deg: float
    length: float

    def into_vehicle(self, vectors: Array, heading_deg: float = 0.0) -> Array:
        """Turn vectors from sensor into vehicle axes.

        Parameters
        ----------
        vectors : ndarray, (n, 3)
        heading_deg : float, deg
        """
        C_vs = rotation.dcm_from_euler((self.roll_deg, self.pitch_deg, heading_deg))
        return np.asarray(vectors @ C_vs.T)


def sitting_at_rest(force: Array) -> Sitting | None:
    """Find roll and pitch of a mounting from the specific force at rest.

    Parameters
    ----------
    force : ndarray, (3,), m/s²
        Mean over a rest, in sensor axes; it points up.

    Returns
    -------
    Sitting or None
        None where its magnitude is not that of gravity. An axis within 20° of the vertical is
        taken to be along it: the rest is the tilt of vehicle and sensor together, which the
        leveling finds.

    Notes
    -----
    The vehicle's up, ``(0, 0, -1)``, is in sensor axes
    ``C_vsᵀ (0, 0, -1) = (sin p, -sin r cos p, -cos r cos p)`` whatever the heading; so
    ``p = asin u_x`` and ``r = atan2(-u_y, -u_z)``. With x along the vertical, roll and heading
    turn about one axis, and roll is zero.
    """
    length = float(np.linalg.norm(force))
    if not LEAST_LENGTH <= length / STANDARD_GRAVITY <= MOST_LENGTH:
        return None
    up = force / length
    k = int(np.argmax(np.abs(up)))
    lean = math.degrees(math.acos(min(1.0, float(abs(up[k])))))
    along = ""
    if lean <= MOST_LEAN:
        along = f"{'-' if up[k] < 0.0 else ''}{'xyz'[k]}"
        up = np.where(np.arange(3) == k, np.sign(up), 0.0)
    pitch = math.degrees(math.asin(float(np.clip(up[0], -1.0, 1.0))))
    roll = 0.0 if along.endswith("x") else math.degrees(math.atan2(-up[1], -up[2]))
    if not along:
        roll, pitch = round(roll, 1), round(pitch, 1)
    # -180 deg equals 180 deg.
    return Sitting(180.0 if roll == -180.0 else roll + 0.0, pitch + 0.0, along, lean, length)
