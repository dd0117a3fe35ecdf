"""The change of velocity over each event, of every unit and of their mean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.crash.acceleration import Acceleration
from strapdown.crash.delta_v import cumulative_delta_v
from strapdown.crash.delta_v_bound import DeltaVBound, body_delta_v_bound
from strapdown.crash.unit_reconstruction import UnitReconstruction
from strapdown.crash.velocity_course import VelocityCourse
from strapdown.crash.window_weights import window_weights
from strapdown.report.chart import GREY, PURPLE, Chart, Fill, Line, Panel, curve
from strapdown.report.crash_moments import AROUND, event_marks, unit_look
from strapdown.report.crash_values import MEAN, plain

Array = NDArray[np.float64]

__all__ = ["StatedDeltaV", "delta_v_chart", "delta_v_course", "delta_v_half_widths"]

AXES = ("forward", "right", "down", "resultant")
KMH = 3.6
# Instants at which the bound is found; between them it is smooth.
_INSTANTS = 31
_SYMBOLS = ("square", "diamond", "triangle-up", "star", "pentagon", "cross")


@dataclass(frozen=True)
class StatedDeltaV:
    """A change of velocity that somebody else states.

    Attributes
    ----------
    time : float, s
        From the trigger; the change is that from time zero to then.
    value, sd : float, m/s
    name : str
    axis : {'forward', 'right', 'down', 'resultant'}
    """

    time: float
    value: float
    sd: float
    name: str
    axis: str = "forward"


def delta_v_course(acceleration: Acceleration, zero: float, low: float, high: float) -> Array:
    """Change of velocity since an instant, before and after it.

    Parameters
    ----------
    acceleration : Acceleration
    zero, low, high : float, s
        Zero where the change is; the others are cut to the record.

    Returns
    -------
    ndarray, (n, 5)
        Time in s, forward, right, down and resultant in m/s.
    """
    low, high = max(low, acceleration.begin), min(high, acceleration.end)
    parts = []
    if low < zero:
        before = cumulative_delta_v(acceleration, low, zero)
        values = before[["dv_x", "dv_y", "dv_z"]].to_numpy()
        parts.append(np.column_stack([before.index.to_numpy() + low, values - values[-1]])[:-1])
    after = cumulative_delta_v(acceleration, zero, high)
    values = after[["dv_x", "dv_y", "dv_z"]].to_numpy()
    parts.append(np.column_stack([after.index.to_numpy() + zero, values]))
    whole = np.vstack(parts)
    return np.column_stack([whole, np.sqrt((whole[:, 1:] ** 2).sum(axis=1))])


def delta_v_half_widths(
    unit: UnitReconstruction,
    zero: float,
    zero_sd: float,
    instants: Array,
    gravity: float = STANDARD_GRAVITY,
) -> Array:
    """Half widths of what holds 95 % of a change of velocity since time zero.

    Parameters
    ----------
    unit : UnitReconstruction
    zero, zero_sd : float, s
    instants : ndarray, (n,), s
        After `zero`. They are taken as exact, as those of a clock.
    gravity : float, m/s²

    Returns
    -------
    ndarray, (n, 4), m/s
        Forward, right, down, resultant.
    """
    of, acceleration = unit.at_point, unit.acceleration
    rest_sd = of.resting_force(gravity)[1]
    course = VelocityCourse(acceleration)
    moved = -course.rate(np.array([zero])) * zero_sd
    rows = []
    for at in instants.tolist():
        weights = window_weights(acceleration.time, zero, at, acceleration.sampling)
        bound = body_delta_v_bound(of.effects, weights, rest_sd=rest_sd, at_ends=moved)
        rows.append([*bound.half_width, _along(bound, weights @ acceleration.values)])
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def _along(bound: DeltaVBound, vector: Array) -> float:
    if not vector.any():
        return TWO_SIDED_95 * float(np.sqrt(np.linalg.eigvalsh(bound.covariance)[-1]))
    return TWO_SIDED_95 * bound.along(vector)


def delta_v_chart(
    units: Sequence[UnitReconstruction],
    combined: UnitReconstruction | None,
    event: int = 0,
    *,
    gravity: float = STANDARD_GRAVITY,
    stated: Sequence[StatedDeltaV] = (),
) -> Chart | None:
    """Chart the change of velocity since time zero of an event.

    Parameters
    ----------
    units : sequence of UnitReconstruction
    combined : UnitReconstruction or None
        The mean of the units, whose event and bound are drawn; those of the first unit if None.
    event : int
        Of the mean, from 0.
    gravity : float, m/s²
    stated : sequence of StatedDeltaV
        Laid over with their 95 %.

    Returns
    -------
    Chart or None
        None where there is no such event.
    """
    main = units[0] if combined is None else combined
    if not 0 <= event < len(main.events.events):
        return None
    found = main.events.events[event]
    zero, end = found.time_zero, min(found.end, main.acceleration.end)
    span = (zero - 0.4 * AROUND[0], end + AROUND[1])
    lines: list[list[Line]] = [[] for _ in AXES]
    for k, unit in enumerate(units):
        if unit.acceleration.begin <= zero < unit.acceleration.end:
            look = unit_look(k, len(units) == 1)
            _add_course(lines, unit, (zero, *span), unit.name, look, 2.2 if unit is main else 1.3)
    own = unit_look(None if combined is not None else 0)["colour"]
    if combined is not None:
        _add_course(lines, combined, (zero, *span), MEAN, unit_look(None), 2.2)
    last = min(span[1], main.acceleration.end)
    instants = np.unique(np.r_[np.linspace(zero, last, _INSTANTS)[1:], end])
    half = KMH * delta_v_half_widths(main, zero, found.time_zero_sd, instants, gravity)
    course = delta_v_course(main.acceleration, zero, *span)
    whole = main.body[event].event
    values = [*whole.delta_v.vector.tolist(), whole.resultant]
    halves = [*whole.bound.half_width, whole.resultant_bound]
    panels = []
    of = "of the mean" if combined is not None else f"of {main.name}"
    for k, axis in enumerate(AXES):
        middle = KMH * np.interp(instants, course[:, 0], course[:, 1 + k])
        low = middle - half[:, k]
        fill = Fill(
            f"95 % {of}",
            1e3 * np.r_[zero, instants],
            np.r_[0.0, np.maximum(low, 0.0) if axis == "resultant" else low],
            np.r_[0.0, middle + half[:, k]],
            own,
            0.15,
            legend=k == 0,
        )
        words = f"{axis}: {plain(KMH * values[k], 1)} ± {plain(KMH * halves[k], 1)} km/h "
        words += f"({plain(values[k], 2)} ± {plain(halves[k], 2)} m/s)"
        ends = KMH * np.array([values[k] - halves[k], values[k] + halves[k]])
        at = np.array([1e3 * end])
        marks = [
            Line("bar", np.repeat(at, 2), ends, own, width=2.4, legend=False),
            Line(
                f"end of the event, 95 % {of}",
                at,
                np.array([KMH * values[k]]),
                own,
                points=True,
                symbol="circle",
                size=8.0,
                legend=k == 0,
            ),
        ]
        given = _stated_lines([s for s in stated if s.axis == axis])
        panels.append(
            Panel(
                f"{axis}, km/h", (*lines[k], *marks, *given), title=words, fills=(fill,), height=0.8
            )
        )
    many = len(main.events.events) > 1
    title = f"Change of velocity, event {event + 1}" if many else "Change of velocity"
    return Chart(
        f"delta-v-{event + 1}" if many else "delta-v",
        title,
        _caption(bool(stated)),
        "time from the trigger, ms",
        tuple(panels),
        marks=event_marks([found], *span),
    )


def _caption(stated: bool) -> str:
    return (
        "Change of the velocity of the reference point since time zero, integrated along the "
        "turning axes of the vehicle, gravity as it was felt at rest taken off; forward, right, "
        "down are positive, so that braking counts negative; 1 m/s = 3.6 km/h. Shaded: 95 % at "
        "an exact time; the bar at the end of the event has the uncertainty of that end as well."
        + (" Symbols with bars: what others state, with their 95 %." if stated else "")
    )


def _add_course(
    lines: list[list[Line]],
    unit: UnitReconstruction,
    times: tuple[float, float, float],
    name: str,
    look: Mapping[str, str],
    width: float,
) -> None:
    course = delta_v_course(unit.acceleration, *times)
    for k in range(len(AXES)):
        made = curve(
            name, 1e3 * course[:, 0], KMH * course[:, 1 + k], look["colour"], look["dash"], width
        )
        lines[k].append(replace(made, legend=k == 0))


def _stated_lines(stated: Sequence[StatedDeltaV]) -> list[Line]:
    out = []
    for k, one in enumerate(stated):
        at = np.array([1e3 * one.time])
        reach = TWO_SIDED_95 * one.sd
        ends = KMH * np.array([one.value - reach, one.value + reach])
        colour = PURPLE if k == 0 else GREY
        out.append(Line("bar", np.repeat(at, 2), ends, colour, width=1.8, legend=False))
        out.append(
            Line(
                one.name,
                at,
                np.array([KMH * one.value]),
                colour,
                points=True,
                symbol=_SYMBOLS[k % len(_SYMBOLS)],
                hollow=True,
            )
        )
    return out
