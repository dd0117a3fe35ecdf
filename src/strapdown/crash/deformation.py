"""Deformation of a vehicle: how deep it was crushed, and the energy that this took."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from strapdown.constants import TWO_SIDED_95
from strapdown.crash.closure import CONTACT_FRICTION, Figure, Pair, jacobian_of
from strapdown.crash.events import PART_563
from strapdown.crash.path import PLACE, at_instant
from strapdown.errors import DataError
from strapdown.tables.checks import Array

if TYPE_CHECKING:
    from strapdown.crash.events import CrashEvent
    from strapdown.crash.path import CrashPath


@dataclass(frozen=True)
class Crush:
    """Dynamic crush of a vehicle by one of its answers.

    Attributes
    ----------
    unit : str
        Recorder, or the mean.
    depth : Figure, m
        How far the reference point went on along its travel after the first touch, at most.
    touch, time : float, s
        Instants of the first touch and of the largest depth.
    at_least : bool
        The path ends while the point still moves on.
    """

    unit: str
    depth: Figure
    touch: float
    time: float
    at_least: bool


def dynamic_crush(unit: str, path: CrashPath, event: CrashEvent) -> Crush | None:
    """Crush between a point of a vehicle and a rigid barrier that its front has met.

    The front is at the barrier from the first touch on, so that the way of the point is that by
    which it came nearer to the front. The first touch is the instant of the entry, or time zero of
    the event where the entry is earlier; the sd of time zero then counts with the speed.

    Parameters
    ----------
    path : CrashPath
        Of the reference point, entry included.
    event : CrashEvent

    Returns
    -------
    Crush or None
        None where the vehicle stood at the first touch, or went on faster after the event, or the
        path does not contain them.
    """
    touch, touch_sd = path.entry.time, 0.0
    if touch < event.time_zero - PART_563.wake_window:
        # Anywhere from the begin to the end of the interval in which the velocity changed enough.
        touch = 0.5 * (event.time_zero + event.woken)
        touch_sd = math.hypot((event.woken - event.time_zero) / math.sqrt(12.0), event.time_zero_sd)
    place = path.table[["north", "east"]].to_numpy()
    velocity = at_instant(path, touch, ("VN", "VE"))
    speed = float(np.hypot(*velocity))
    rows = np.flatnonzero(path.time >= touch)
    if not rows.size or touch < path.time[0] or speed <= 0.0:
        return None
    along = np.array([*velocity, 0.0]) / speed
    if float(along[:2] @ at_instant(path, event.end, ("VN", "VE"))) >= speed:
        return None
    start = at_instant(path, touch, ("north", "east"))
    depth = (place[rows] - start) @ along[:2]
    k, first = int(rows[np.argmax(depth)]), int(rows[0])
    grown = (path.errors[:, k, PLACE] - path.errors[:, first, PLACE]) @ along
    noise = path.noise_covariance[k, PLACE, PLACE] + path.noise_covariance[first, PLACE, PLACE]
    variance = float(grown @ grown + along @ noise @ along) + (speed * touch_sd) ** 2
    return Crush(
        unit,
        Figure.from_sd(float(depth.max()), math.sqrt(variance)),
        touch,
        float(path.time[k]),
        k == len(path.time) - 1,
    )


def impulse_of(time: ArrayLike, force: ArrayLike, span: Pair, scale_sd: float) -> Figure:
    """Size of the impulse of a measured force over a span, N s.

    Parameters
    ----------
    time, force : array_like, (n,), s and N
        With either sign.
    span : (float, float), s
    scale_sd : float
        Relative sd of the scale. The error of the zero is what the force reads before the span:
        its mean, and the sd of that.

    Raises
    ------
    DataError
        The record does not contain the span.
    """
    t, f = np.asarray(time, dtype=np.float64), np.asarray(force, dtype=np.float64)
    start, end = span
    if not (t.size > 1 and t[0] <= start and end <= t[-1]):
        raise DataError(
            "crash.force-outside-record",
            quantity="force",
            start=float(t[0]) if t.size else math.nan,
            end=float(t[-1]) if t.size else math.nan,
            begin=start,
            finish=end,
        )
    at = np.array([start, *t[(t > start) & (t < end)], end])
    impulse = float(np.trapezoid(np.interp(at, t, f), at))
    before = f[t < start]
    zero = float(before.mean()) if before.size else 0.0
    zero_sd = float(before.std()) / math.sqrt(before.size) if before.size else 0.0
    sd = math.hypot(impulse * scale_sd, math.hypot(zero, zero_sd) * (end - start))
    return Figure.from_sd(abs(impulse), sd)


def equal_force_share(first: Pair, second: Pair, *, of: str = "crush") -> Pair:
    """Share of the energy that the first vehicle absorbed, and its sd, from equal forces.

    Both vehicles feel one force F, and with linear structures absorb ``F s / 2`` each: the share is
    ``s1 / (s1 + s2)`` (Burg; PC-Crash Technical Manual: ``EES1 / EES2 = sqrt(m2 s1 / (m1 s2))``).
    `of`: the pairs, value and sd, are ``crush`` depths s, m, or ``stiffness``, N/m, with s = F / k.
    """
    for pair in (first, second):
        if not (all(map(math.isfinite, pair)) and pair[0] > 0.0 and pair[1] >= 0.0):
            raise DataError("crash.closure-share", quantity=of, value=str(pair))
    if of not in ("crush", "stiffness"):
        raise DataError("crash.closure-share", quantity="of", value=of)
    above, below = (first, second) if of == "crush" else (second, first)
    share = above[0] / (above[0] + below[0])
    relative = math.hypot(above[1] / above[0], below[1] / below[0])
    return share, share * (1.0 - share) * relative


def energy_share(first: Figure, second: Figure) -> Pair:
    """Share of the energy that the first vehicle absorbed, and its sd, from both energies."""
    whole = first.value + second.value
    share = first.value / whole
    sds = (first.half_width / TWO_SIDED_95, second.half_width / TWO_SIDED_95)
    return share, math.hypot((1.0 - share) * sds[0], share * sds[1]) / whole


def crush_energy(
    crush: ArrayLike,
    width: Pair,
    stiffness_a: Pair,
    stiffness_b: Pair,
    *,
    crush_sd: float = 0.0,
    angle_deg: Pair = (0.0, 0.0),
) -> Figure:
    """Energy of deformation from a residual crush profile by the CRASH3 relation, J.

    Parameters
    ----------
    crush : array_like, (n,), m
        Depths at n equally spaced stations over the width; six are C1 to C6.
    width : pair, m
        Of the damage, L, and its sd.
    stiffness_a, stiffness_b : pair, N/m and N/m²
        Force per width at the onset of crush, and its slope, with their sd.
    crush_sd : float, m
        Of each depth.
    angle_deg : pair, deg
        Alpha, of the force against the perpendicular of the damaged side, and its sd.

    Returns
    -------
    Figure
        ``integral (A C + B C² / 2 + A² / (2 B)) dw * (1 + tan² alpha)``, the depth linear between
        the stations: for six, ``L/5 [A/2 (C1 + 2 C2 + ... + 2 C5 + C6) + B/6 (C1² + 2 C2² + ... +
        2 C5² + C6² + C1 C2 + ... + C5 C6) + 5 G]``, G = A² / (2 B). The correction is at most 2
        (CRASH3; alpha 45 deg).

    Raises
    ------
    DataError
        A number is not finite, negative, or zero where it divides; fewer than two stations.

    Notes
    -----
    Force linear in residual crush: Campbell (1974), SAE 740565. The integral and the correction:
    CRASH3 User's Guide and Technical Manual, NHTSA DOT HS 805 732; McHenry, The Algorithms of
    CRASH. Residual, not dynamic, crush belongs to such coefficients.
    """
    depth = np.asarray(crush, dtype=np.float64)
    positive = (width[0], stiffness_b[0])
    rest = [stiffness_a[0], crush_sd, width[1], stiffness_a[1], stiffness_b[1], angle_deg[1]]
    good = depth.ndim == 1 and depth.size >= 2 and bool((np.isfinite(depth) & (depth >= 0)).all())
    good = good and all(math.isfinite(v) and v > 0.0 for v in positive)
    good = good and all(math.isfinite(v) and v >= 0.0 for v in rest) and abs(angle_deg[0]) < 90.0
    if not good:
        raise DataError("crash.crush-profile", quantity="crush", value=depth.tolist())
    n = depth.size
    x = np.concatenate([depth, [width[0], stiffness_a[0], stiffness_b[0]]])
    sd = np.array([crush_sd] * n + [width[1], stiffness_a[1], stiffness_b[1]])

    def compute(x: Array) -> Array:
        c, length, a, b = x[..., :n], x[..., n], x[..., n + 1], x[..., n + 2]
        left, right = c[..., :-1], c[..., 1:]
        linear = 0.5 * (left + right).mean(axis=-1)
        square = (left**2 + left * right + right**2).mean(axis=-1) / 6.0
        return np.asarray(length * (a * linear + b * square + a**2 / (2.0 * b)))[..., None]

    covariance = np.diag(sd**2)
    jacobian = jacobian_of(compute, x, covariance)
    value = float(compute(x)[0])
    variance = float((jacobian @ covariance @ jacobian.T)[0, 0])
    at, angle_sd = math.radians(abs(angle_deg[0])), math.radians(angle_deg[1])
    limit = 1.0 + CONTACT_FRICTION**2
    low, factor, high = (
        min(1.0 + math.tan(min(max(v, 0.0), 0.25 * math.pi)) ** 2, limit)
        for v in (at - angle_sd, at, at + angle_sd)
    )
    # The larger side: the slope is zero at zero and beyond the limit.
    spread = max(high - factor, factor - low)
    return Figure.from_sd(value * factor, math.hypot(factor * math.sqrt(variance), value * spread))


def energy_equivalent_speed(energy: Figure, mass: Pair) -> Figure:
    """Speed at which the vehicle's kinetic energy is its energy of deformation, m/s.

    ``EES = sqrt(2 E / m)``: Zeidler, Schreier & Stadelmann (1985), SAE 850256; Burg & Zeidler
    (1980); ISO 12353-1 for the term. `mass`: kg, and sd. Energy and mass are independent; the bound
    is that of 2 E / m, and its roots.

    Raises
    ------
    DataError
        The mass is not positive, or its sd negative.
    """
    if not (all(map(math.isfinite, mass)) and mass[0] > 0.0 and mass[1] >= 0.0):
        raise DataError("crash.closure-share", quantity="mass", value=str(mass))
    square = 2.0 * energy.value / mass[0]
    by_mass = square * mass[1] / mass[0]
    sd = math.hypot(2.0 * energy.half_width / TWO_SIDED_95 / mass[0], by_mass)
    return Figure.from_sd(square, sd).root()
