"""What a manoeuvre would do to a heading that is not known: by the filter's own covariance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY
from strapdown.earth import gravity
from strapdown.ellipsoids import find_ellipsoid
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.filter_state import FilterState
from strapdown.estimation.observation import Observation
from strapdown.nav_state import NavState
from strapdown.rotation.euler_angles import euler_sd

__all__ = ["Manoeuvre", "manoeuvres_from", "sd_after"]

Array = NDArray[np.float64]

#: What is tried: m/s², s.
HARD, LONG = 0.2 * STANDARD_GRAVITY, 5.0
#: Slower than this it stands, m/s; nothing turns faster than so much, rad/s.
STANDS, QUICKEST = 1.0, 0.5
STEP = 0.1


@dataclass(frozen=True)
class Manoeuvre:
    """Something that a driver could do.

    Attributes
    ----------
    what : str
        In words, as they stand before "would bring".
    forward, aside : float, m/s²
        Horizontal acceleration along and across the way.
    duration : float, s
    """

    what: str
    forward: float
    aside: float
    duration: float


def manoeuvres_from(speed: float) -> tuple[Manoeuvre, ...]:
    """Return what can be done at a speed in m/s: 0.2 g for 5 s, or less where it would stop."""
    out = [Manoeuvre(f"speeding up at 0.2 g for {LONG:g} s", HARD, 0.0, LONG)]
    if speed >= STANDS:
        lasts = min(LONG, math.floor(10.0 * speed / HARD) / 10.0)
        out.append(Manoeuvre(f"braking at 0.2 g for {lasts:g} s", -HARD, 0.0, lasts))
    if speed * QUICKEST >= HARD:
        angle = math.degrees(HARD / speed * LONG)
        words = f"a turn at 0.2 g for {LONG:g} s (by {angle:.0f}°)"
        out.append(Manoeuvre(words, 0.0, HARD, LONG))
    return tuple(out)


def sd_after(
    filter_: ErrorFilter,
    start: NavState,
    P: Array,
    manoeuvre: Manoeuvre,
    position_sd: Array | None,
    velocity_sd: Array | None,
    interval: float,
) -> float:
    """Return the standard deviation of the heading after a manoeuvre, deg.

    The filter goes on from a state over the motion, and takes fixes on its way; no number is
    observed, for a covariance does not depend on it.

    Parameters
    ----------
    filter_ : ErrorFilter
    start : NavState
    P : ndarray, (p, p)
        As `ErrorFilter.begin`.
    manoeuvre : Manoeuvre
    position_sd, velocity_sd : ndarray, (3,), or None
        Of the fixes, north, east, down, m and m/s; None of what they do not tell.
    interval : float, s
        Between two fixes.

    Returns
    -------
    float
    """
    state = filter_.begin(start, P)
    state = _fixed(filter_, state, position_sd, velocity_sd)
    for begin in np.arange(0.0, manoeuvre.duration - 0.5 * STEP, interval):
        end = min(begin + interval, manoeuvre.duration)
        count = max(1, round((end - begin) / STEP))
        dt = (end - begin) / count
        rows = np.array([_row(filter_, start, manoeuvre, begin + k * dt, dt) for k in range(count)])
        time = state.time + dt * np.arange(1, count + 1)
        state, _ = filter_.predict(state, time, rows)
        state = _fixed(filter_, state, position_sd, velocity_sd)
    mechanization = filter_.mechanization
    turn = np.kron(np.eye(3), mechanization.level_from_ned(state.row))
    whole = turn.T @ filter_.physical_covariance(state)[:9, :9] @ turn
    euler = rotation.euler_from_quaternion(start.q_nb)
    return float(euler_sd(euler, whole[6:, 6:])[2])


def _row(filter_: ErrorFilter, start: NavState, m: Manoeuvre, begin: float, dt: float) -> Array:
    """Increment of a step: a level motion along and across a way that turns with it."""
    speed = float(np.hypot(*start.v_n[:2]))
    course = math.atan2(start.v_n[1], start.v_n[0])
    roll, pitch, heading = np.radians(rotation.euler_from_quaternion(start.q_nb)).tolist()
    if speed < STANDS:
        course = heading
    rate = m.aside / speed if m.aside else 0.0
    along = course + rate * (begin + 0.5 * dt)
    ahead = np.array([math.cos(along), math.sin(along), 0.0])
    right = np.array([-math.sin(along), math.cos(along), 0.0])
    g = gravity(
        math.degrees(start.lat),
        start.alt,
        ellipsoid=find_ellipsoid(filter_.mechanization.ellipsoid),
    )
    # Attitude turns with the way; the force is that of the middle of the step, in its first axes.
    turned = np.degrees([roll, pitch, heading + rate * begin])
    C_bn = rotation.dcm_from_euler(turned).T
    force = C_bn @ (m.forward * ahead + m.aside * right - g)
    turn = C_bn @ np.array([0.0, 0.0, rate])
    return np.concatenate([[dt], turn * dt, force * dt, 0.5 * force * dt * dt])


def _fixed(
    filter_: ErrorFilter, state: FilterState, position_sd: Array | None, velocity_sd: Array | None
) -> FilterState:
    """The state after a fix; only the covariance is changed."""
    seen = []
    for first, sd in ((0, position_sd), (3, velocity_sd)):
        if sd is not None:
            H = np.zeros((3, filter_.model.physical_size))
            H[:, first : first + 3] = np.eye(3)
            R = np.full(3, float(np.mean(np.square(sd))))
            seen.append(Observation("fix", np.zeros(3), H, R, ("x", "y", "z")))
    if not seen:
        return state
    after, _, _ = filter_.estimate(
        state, np.zeros(filter_.model.layout.size), seen, [None] * len(seen)
    )
    return after
