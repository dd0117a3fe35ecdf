"""Theoretical head impact velocity and post-impact head deceleration."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.indices.pulse import (
    checked,
    cubic,
    first_reach,
    four_pole,
    from_start,
    integrals,
    largest_mean,
)
from strapdown.dsp.running_integral import running_integral
from strapdown.errors import ConfigError, DataError, Finding

__all__ = ["PHD_AVERAGES", "Thiv", "thiv"]

Array = NDArray[np.float64]
FORWARD, SIDEWAYS = 0.6, 0.3  # m
WINDOW = 0.01  # s
FREQUENCY = 10.0  # Hz
#: Smoothing of the acceleration after the head impact.
PHD_AVERAGES: dict[str, str] = {
    "mean_10ms": "mean of the resultant over a moving window of 10 ms (EN 1317-1:1998; MASH)",
    "butterworth_10hz": "resultant of the components through a four-pole Butterworth low-pass "
    "without phase, 10 Hz",
}


@dataclass(frozen=True)
class Thiv:
    """Impact of a head that flies freely in the vehicle.

    Attributes
    ----------
    velocity : float, m/s, or None
        Of the head relative to the vehicle at its impact; None without an impact.
    time_of_flight : float, s, or None
        From the start.
    surface : str or None
        ``front``, ``right`` or ``left`` of the vehicle.
    phd_g : float or None
        Post-impact head deceleration, in g.
    phd_at : float, s, or None
        On the record's clock: start of the window, or the instant of the filtered peak.
    largest : float, m/s
        Greatest velocity of the head relative to the vehicle up to its impact, or to the end.
    findings : tuple of Finding
    """

    velocity: float | None
    time_of_flight: float | None
    surface: str | None
    phd_g: float | None
    phd_at: float | None
    largest: float
    findings: tuple[Finding, ...] = ()


def thiv(
    time: ArrayLike,
    accel: ArrayLike,
    yaw_rate: ArrayLike | None = None,
    *,
    start: float = 0.0,
    head: tuple[float, float] = (0.0, 0.0),
    forward: float = FORWARD,
    sideways: float = SIDEWAYS,
    phd_average: str = "mean_10ms",
) -> Thiv:
    """Theoretical head impact velocity, and the subsequent deceleration.

    Parameters
    ----------
    time : array_like, (n,), s
    accel : array_like, (n, 2) or (n, 3), m/s²
        Acceleration of the reference point, forward and right, without gravity, of class
        CFC 180.
    yaw_rate : array_like, (n,), rad/s, optional
        About the downward axis: clockwise from above; by default zero.
    start : float, s
        First contact.
    head : pair of float, m
        The head before the impact, forward and right of the reference point.
    forward, sideways : float, m
        Flight distance of the head to the surfaces.
    phd_average : {'mean_10ms', 'butterworth_10hz'}

    Returns
    -------
    Thiv

    Raises
    ------
    DataError
        As `pulse.checked`; `start` is not in the record.
    ConfigError
        An option is unknown, or a distance is none.

    Notes
    -----
    The head keeps the velocity of the reference point at `start`. In nonrotating axes that move
    with this velocity, the vehicle's point moves by ``X'' = ax cos ψ - ay sin ψ``,
    ``Y'' = ax sin ψ + ay cos ψ``; the head, at rest there, is at ``(x, y) = C(ψ)ᵀ (head - (X, Y))``
    in the vehicle. It hits a surface where x has grown by `forward` or y has changed by
    `sideways`, whichever is first, with the velocity ``(x', y')``, including the rotation of the
    vehicle (EN 1317-1, clauses on THIV and PHD; MASH 2009, appendix F2, which adopts it).
    The model has no surface behind the head. Exact for acceleration that is linear between
    samples and no yaw; with yaw, of the second order of the step.
    """
    t, a, rate = _inputs(time, accel, yaw_rate, forward, sideways, phd_average)
    table = np.column_stack([a, rate])
    after, cut = from_start(t, table, start, "start")
    position, velocity = _head_in_vehicle(after, cut[:, :2], cut[:, 2], np.asarray(head))
    meeting = _first_surface(after, position, velocity, head, forward, sideways)
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    if meeting is None:
        found = Finding(
            "crash.head-flies-less-than-forward",
            quantity="THIV",
            forward=forward,
            sideways=sideways,
            after=after[-1],
        )
        return Thiv(None, None, None, None, None, float(speed.max()), (found,))
    at, surface = meeting
    met = [cubic(after, position[:, k], velocity[:, k], at)[1] for k in (0, 1)]
    flown = speed[after <= at]
    thiv_value = math.hypot(*met)
    phd, phd_at, findings = _after_impact(t, a, at, phd_average)
    return Thiv(
        thiv_value,
        at - start,
        surface,
        phd,
        phd_at,
        max(float(flown.max()), thiv_value),
        findings,
    )


def _inputs(
    time: ArrayLike,
    accel: ArrayLike,
    yaw_rate: ArrayLike | None,
    forward: float,
    sideways: float,
    phd_average: str,
) -> tuple[Array, Array, Array]:
    if phd_average not in PHD_AVERAGES:
        raise ConfigError(
            "crash.no-average-phd",
            quantity="phd_average",
            phd_average=phd_average,
            word=phd_average,
            known=PHD_AVERAGES,
        )
    for name, distance in (("forward", forward), ("sideways", sideways)):
        if not (math.isfinite(distance) and distance > 0.0):
            raise ConfigError("crash.no-way-fly", quantity=name, distance=distance)
    plane = np.asarray(accel, dtype=np.float64)
    t, a = checked(time, plane[:, :2] if plane.ndim == 2 else plane, 2, "accel")
    rate = np.zeros(t.size) if yaw_rate is None else checked(time, yaw_rate, None, "yaw_rate")[1]
    return t, a, rate


def _head_in_vehicle(time: Array, accel: Array, rate: Array, head: Array) -> tuple[Array, Array]:
    """Position of the head in vehicle axes, and its velocity there."""
    yaw = running_integral(time, rate)
    c, s = np.cos(yaw), np.sin(yaw)
    level = np.column_stack([c * accel[:, 0] - s * accel[:, 1], s * accel[:, 0] + c * accel[:, 1]])
    moved, place = integrals(time, level)
    away = head - place
    x, y = c * away[:, 0] + s * away[:, 1], c * away[:, 1] - s * away[:, 0]
    vx = rate * y - (c * moved[:, 0] + s * moved[:, 1])
    vy = -rate * x - (c * moved[:, 1] - s * moved[:, 0])
    return np.column_stack([x, y]), np.column_stack([vx, vy])


def _first_surface(
    time: Array,
    position: Array,
    velocity: Array,
    head: tuple[float, float],
    forward: float,
    sideways: float,
) -> tuple[float, str] | None:
    sides = (("front", 0, 1.0, forward), ("right", 1, 1.0, sideways), ("left", 1, -1.0, sideways))
    met = []
    for surface, axis, sign, distance in sides:
        flown = sign * (position[:, axis] - head[axis])
        at = first_reach(time, flown, sign * velocity[:, axis], distance)
        if at is not None:
            met.append((at, surface))
    return min(met) if met else None


def _after_impact(
    time: Array, accel: Array, at: float, average: str
) -> tuple[float | None, float | None, tuple[Finding, ...]]:
    if average == "butterworth_10hz":
        smooth = four_pole(time, accel, FREQUENCY)
        rest, values = from_start(time, np.hypot(smooth[:, 0], smooth[:, 1]), at, "PHD")
        k = int(np.argmax(values))
        return float(values[k]) / STANDARD_GRAVITY, float(rest[k]), ()
    try:
        rest, values = from_start(time, np.hypot(accel[:, 0], accel[:, 1]), at, "PHD")
        phd, begins = largest_mean(rest, values, WINDOW)
    except DataError:
        found = Finding("crash.record-ends-before-phd", quantity="PHD", at=at)
        return None, None, (found,)
    return phd / STANDARD_GRAVITY, begins, ()
