"""Charts of the delta-V of each event, by every unit and by their mean."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95, Array
from strapdown.crash.acceleration import Acceleration, window_weights
from strapdown.crash.case import ReferenceAnswer
from strapdown.crash.consistency import UnitComparison
from strapdown.crash.contact import Edge
from strapdown.crash.delta_v import cumulative_delta_v, trailing_delta_v
from strapdown.crash.delta_v_bound import VelocityChange, body_delta_v_bound
from strapdown.crash.events import CrashEvent
from strapdown.crash.path import CrashPath
from strapdown.crash.pdof import SHIFTS, WINDOWS, pdof_by_shift, pdof_by_window
from strapdown.crash.reconstruction import UnitReconstruction
from strapdown.crash.severity import SPEEDS, InjuryRisk, SeverityModel, injury_risk
from strapdown.dsp.channel_class import LEAST_RATE, cfc_filter
from strapdown.errors import DataError, StrapdownError
from strapdown.report.chart import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    PURPLE,
    Band,
    Bars,
    Chart,
    Fill,
    Line,
    Mark,
    Panel,
    curve,
    look,
)
from strapdown.report.crash_outline import AROUND, SINCE_TRIGGER, crash_span, event_marks, unit_look
from strapdown.report.values import (
    AXES,
    MEAN,
    SHOWN,
    decimals,
    instant,
    plain,
    speed_factor,
    speed_unit,
)
from strapdown.rotation import within_half_turn
from strapdown.tables import NED
from strapdown.tables.checks import index_of

_PARTS = (*AXES, "resultant")
# Instants at which the bound is computed; it is smooth between them.
_INSTANTS = 31
_SYMBOLS = ("square", "diamond", "triangle-up", "star", "pentagon", "cross")


def answers_of(
    units: Sequence[UnitReconstruction], combined: UnitReconstruction | None
) -> list[tuple[UnitReconstruction, str, dict[str, str]]]:
    """Return each unit and their mean, if there is one, with its name and look in every chart."""
    found = [(u, u.name, unit_look(k, len(units) == 1)) for k, u in enumerate(units)]
    return found if combined is None else [*found, (combined, MEAN, unit_look(None))]


def delta_v_course(acceleration: Acceleration, zero: float, low: float, high: float) -> Array:
    """Change of velocity since an instant, before and after it.

    `zero`, `low`, `high`, s: `zero` is the origin of the change; `low` and `high` are clipped to
    the record. Returns: (n, 5), time in s, forward, right, down and resultant in m/s.
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
    onset: Edge,
    instants: Array,
    gravity: float = STANDARD_GRAVITY,
) -> Array:
    """95 % half widths of the change of velocity since the onset of a contact.

    `instants`, (n,), s: after the onset; taken as exact, as clock times. `gravity`, m/s². Returns:
    (n, 4), m/s, forward, right, down, resultant.
    """
    of, acceleration = unit.at_point, unit.acceleration
    rest_sd = of.resting_force(gravity)[1]
    moved = (onset.sd * onset.rate)[None]
    rows = []
    for at in instants.tolist():
        weights = window_weights(acceleration.time, onset.time, at, acceleration.sampling)
        bound = body_delta_v_bound(of.effects, weights, rest_sd=rest_sd, at_ends=moved)
        vector = weights @ acceleration.values
        # A change of zero has no direction: its length is bounded as in the widest one.
        widest = float(np.sqrt(np.linalg.eigvalsh(bound.covariance)[-1]))
        along = bound.along(vector) if vector.any() else widest
        rows.append([*bound.half_width, TWO_SIDED_95 * along])
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def delta_v_chart(
    units: Sequence[UnitReconstruction],
    combined: UnitReconstruction | None,
    event: int = 0,
    *,
    gravity: float = STANDARD_GRAVITY,
    stated: Sequence[ReferenceAnswer] = (),
) -> Chart | None:
    """Chart the change of velocity since the onset of the contact of an event.

    `combined`: mean of the units, whose event and bound are drawn; if None, those of the first
    unit. `event`: index into the events of the mean, from 0. `gravity`, m/s². `stated`: changes of
    velocity stated by others, drawn with their 95 % bounds. Returns: None if the event does not
    exist.
    """
    main = units[0] if combined is None else combined
    if not 0 <= event < len(main.events.events):
        return None
    found = main.events.events[event]
    whole, onset = main.body[event].event, main.body[event].contact.start
    zero, end = whole.delta_v.start, whole.delta_v.end
    span = (zero - 0.4 * AROUND[0], end + AROUND[1])
    lines: list[list[Line]] = [[] for _ in _PARTS]
    for unit, name, drawn in answers_of(units, combined):
        if unit is combined or unit.acceleration.begin <= zero < unit.acceleration.end:
            course = delta_v_course(unit.acceleration, zero, *span)
            at, style = 1e3 * course[:, 0], (drawn["colour"], drawn["dash"])
            width = 2.2 if unit is main else 1.3
            for k in range(len(_PARTS)):
                lines[k].append(curve(name, at, speed_factor() * course[:, 1 + k], *style, width))
    own = unit_look(None if combined is not None else 0)["colour"]
    last = min(span[1], main.acceleration.end)
    instants = np.unique(np.r_[np.linspace(zero, last, _INSTANTS)[1:], end])
    half = speed_factor() * delta_v_half_widths(main, onset, instants, gravity)
    course = delta_v_course(main.acceleration, zero, *span)
    values = [*whole.delta_v.vector.tolist(), whole.resultant]
    halves = [*whole.bound.half_width, whole.resultant_bound]
    part = ", recorded part" if whole.at_least else ""
    panels = []
    beside = SHOWN.get().beside
    shown = ((speed_factor(), 1, speed_unit()), (speed_factor(beside), 2, beside))
    of = "of the mean" if combined is not None else f"of {main.name}"
    for k, axis in enumerate(_PARTS):
        middle = speed_factor() * np.interp(instants, course[:, 0], course[:, 1 + k])
        low = middle - half[:, k]
        fill = Fill(
            f"95 % {of}",
            1e3 * np.r_[zero, instants],
            np.r_[0.0, np.maximum(low, 0.0) if axis == "resultant" else low],
            np.r_[0.0, middle + half[:, k]],
            own,
            0.15,
        )
        told = [
            f"{plain(factor * values[k], places)} ± {plain(factor * halves[k], places)} {unit}"
            for factor, places, unit in shown
        ]
        words = f"{axis}{part}: {told[0]} ({told[1]})"
        ends = speed_factor() * np.array([values[k] - halves[k], values[k] + halves[k]])
        at = np.array([1e3 * end])
        marks = [
            Line("bar", np.repeat(at, 2), ends, own, width=2.4, legend=False),
            Line(
                f"end of the contact, 95 % {of}",
                at,
                np.array([speed_factor() * values[k]]),
                own,
                points=True,
                symbol="circle",
                size=8.0,
            ),
        ]
        given = _stated_lines([s for s in stated if s.spec.axis == axis])
        panels.append(
            Panel(
                f"{axis}, {speed_unit()}",
                (*lines[k], *marks, *given),
                title=words,
                fills=(fill,),
                height=0.8,
            )
        )
    many = len(main.events.events) > 1
    title = f"Change of velocity, event {event + 1}" if many else "Change of velocity"
    return Chart(
        f"delta-v-{event + 1}" if many else "delta-v",
        title,
        "Change of velocity of the reference point since the onset of the contact, in the axes of "
        "the vehicle, less the specific force at rest; forward, right, down are positive, so "
        "braking is negative. Shaded: 95 % at an exact time; the bar at the end "
        "of the contact includes the uncertainty of that end."
        + (" Symbols with bars: stated by others, with their 95 % bounds." if stated else ""),
        SINCE_TRIGGER,
        tuple(panels),
        marks=event_marks([found], *span),
    )


def _stated_lines(stated: Sequence[ReferenceAnswer]) -> list[Line]:
    out = []
    for k, one in enumerate(stated):
        value, reach = one.spec.delta_v_m_per_s or 0.0, TWO_SIDED_95 * one.spec.delta_v_sd_m_per_s
        at = np.array([1e3 * one.span[1]])
        ends = speed_factor() * np.array([value - reach, value + reach])
        colour = PURPLE if k == 0 else GREY
        out.append(Line("bar", np.repeat(at, 2), ends, colour, width=1.8, legend=False))
        symbol = _SYMBOLS[k % len(_SYMBOLS)]
        value_at = np.array([speed_factor() * value])
        out.append(
            Line(one.spec.name, at, value_at, colour, points=True, symbol=symbol, hollow=True)
        )
    return out


def sliding_chart(
    units: Sequence[UnitReconstruction],
    combined: UnitReconstruction | None,
    window: float,
) -> Chart | None:
    """Chart the change of velocity over a window that slides along the record, by every unit.

    `window`, s. Returns: each value at the end of its window; None where no record is as long as
    the window.
    """
    main = units[0] if combined is None else combined
    events = main.events.events
    low, high = crash_span(events, main.acceleration.begin, main.acceleration.end)
    lines: list[list[Line]] = [[] for _ in _PARTS]
    for unit, name, drawn in answers_of(units, combined):
        try:
            found = trailing_delta_v(unit.acceleration, window)
        except DataError:
            continue
        inside = (found.time >= low) & (found.time <= high + window)
        vector = speed_factor() * found.vector[inside]
        at, style = 1e3 * found.time[inside], (drawn["colour"], drawn["dash"])
        for k in range(len(_PARTS)):
            values = vector[:, k] if k < 3 else np.sqrt((vector**2).sum(axis=1))
            lines[k].append(curve(name, at, values, *style, 2.2 if unit is main else 1.3))
    if not lines[0]:
        return None
    ms = f"{1e3 * window:.3g} ms"
    return Chart(
        "sliding-change",
        f"Change of velocity within {ms}",
        f"Change of velocity of the reference point over the {ms} that end at each instant, in the "
        "axes of the vehicle: the rate of change by which severity and direction of force are "
        "often rated (Tadic and Vukajlovic 2016, Fig. 8). Recorders that differ here differ in "
        "their direction of force.",
        SINCE_TRIGGER,
        tuple(
            Panel(f"{axis}, {speed_unit()}", tuple(lines[k]), height=0.7)
            for k, axis in enumerate(_PARTS)
        ),
        marks=event_marks(events, low, high),
    )


# Error budget of delta-V and of the end position.


_SUM = "total"
# Smallest share of the largest sum with its own bar; smaller ones are joined.
_LEAST = 0.01
_REST = "others"


def delta_v_budget(change: VelocityChange) -> pd.DataFrame:
    """Standard deviation that each contributor adds to a change of velocity.

    Returns: indexed by contributor; ``forward right down``, m/s.
    """
    found = change.bound.by_contributor[["xx", "yy", "zz"]]
    values = np.sqrt(np.maximum(found.to_numpy(dtype=np.float64), 0.0))
    return pd.DataFrame(values, index=found.index, columns=list(AXES))


def delta_v_budget_chart(change: VelocityChange) -> Chart:
    """Chart the error budget of a change of velocity, largest contributor first.

    `change`: along vehicle axes.
    """
    table = delta_v_budget(change)[["forward", "right"]]
    return _chart(
        "budget-delta-v",
        "Sources of the uncertainty of delta-V",
        "Standard deviation of the delta-V of the main event, forward and right, due to each "
        "contributor; squares add up to that of the total, and the 95 % bound is 1.96 times it. "
        "Contributors below 1 % are joined.",
        table,
        "m/s",
    )


def place_budget_chart(path: CrashPath, names: tuple[str, str] = ("forward", "right")) -> Chart:
    """Chart the error budget of the end position, largest contributor first.

    `names`: of the first two axes of the path.
    """
    found = path.variances()[NED[:2]]
    table = pd.DataFrame(np.sqrt(found.to_numpy()), index=found.index, columns=list(names))
    at = 1e3 * float(path.time[-1])
    return _chart(
        "budget-position",
        f"Sources of the uncertainty of the position at {instant(path.time[-1])}",
        f"Standard deviation of the position of the reference point at {at:.0f} ms, {names[0]} and "
        f"{names[1]}, due to each contributor; squares add up to that of the total, and the 95 % "
        "bound is 1.96 times it. Contributors below 1 % are joined.",
        table,
        "m",
    )


def _chart(slug: str, title: str, caption: str, table: pd.DataFrame, unit: str) -> Chart:
    total = np.sqrt((table**2).sum())
    table = _joined(table, float(total.max()))
    size = np.sqrt((table**2).sum(axis=1))
    # A stable sort keeps the budget's order for equal contributors; the rest is always last.
    order = sorted(table.index, key=lambda name: (name == _REST, -float(size[name])))
    categories = (_SUM, *(str(name) for name in order))
    # Three digits of the larger sum, and the same number of decimals for its contributors.
    most = float(total.max())
    digits = decimals(most) if most > 0.0 else 0
    panels = []
    for column, colour in zip(table.columns, (BLUE, GREEN), strict=True):
        values = np.array([float(total[column]), *(float(table[column][n]) for n in order)])
        labels = tuple(f"{v:.{digits}f}" for v in values.tolist())
        at = np.arange(len(values), dtype=np.float64)
        panels.append(
            Panel(
                "",
                (),
                title=f"{column}, {unit}",
                categories=categories,
                bars=(
                    Bars(_SUM, at[:1], values[:1], BLACK, labels=labels[:1], legend=False),
                    Bars(str(column), at[1:], values[1:], colour, labels=labels[1:], legend=False),
                ),
            )
        )
    return Chart(slug, title, caption, f"standard deviation, {unit}", tuple(panels), beside=True)


def _joined(table: pd.DataFrame, most: float) -> pd.DataFrame:
    """Contributors, with those too small to be seen joined into one."""
    small = (table < _LEAST * most).all(axis=1)
    if int(small.sum()) < 2:
        return table
    kept = table[~small].copy()
    kept.loc[_REST] = np.sqrt((table[small] ** 2).sum())
    return kept


# Sensitivity of the principal direction of force to the window length and to time zero.


_LABEL = "direction of force, deg"
_SIGN = (
    "Principal direction of force in the axes of the vehicle, 0 the front, positive clockwise from "
    "above (from the right)"
)
_STEADY = 0.02


def pdof_charts(
    units: Sequence[UnitReconstruction], combined: UnitReconstruction | None, event: int = 0
) -> tuple[Chart, Chart]:
    """Chart the direction of force against the window length, and against an error of time zero.

    `combined`: mean of the units, whose event it is; if None, the first unit. `event`: from 0.
    """
    main = units[0] if combined is None else combined
    whole = main.body[event].event.delta_v
    zero = whole.start
    length = whole.end - zero
    windows = sorted({*WINDOWS, length})

    def chart(
        slug: str,
        title: str,
        how: str,
        x_label: str,
        table: Callable[[UnitReconstruction], pd.DataFrame],
        answer: tuple[float, str, str],
    ) -> Chart:
        at, name, mark = answer
        lines = (*_lines(units, combined, event, table), *_chosen(main, event, at, name))
        return Chart(
            slug,
            f"Direction of force against {title}",
            f"{_SIGN}, from {how}. Bar: the answer with its 95 % interval.",
            x_label,
            (Panel(_LABEL, lines, steady=_STEADY),),
            marks=(Mark(1e3 * at, mark),),
        )

    return (
        chart(
            "pdof-by-window",
            "the length of the window",
            "the delta-V over windows from the onset of the contact",
            "length of the window from the onset, ms",
            lambda unit: pdof_by_window(unit.acceleration, zero, windows),
            (length, "the contact's own window, 95 %", "the whole contact"),
        ),
        chart(
            "pdof-by-time-zero",
            "the onset",
            "windows that begin earlier (negative) or later than the onset of the contact and end "
            "with it",
            "shift of the onset, ms",
            lambda unit: pdof_by_shift(unit.acceleration, whole.start, whole.end, SHIFTS),
            (0.0, "detected onset, 95 %", "detected"),
        ),
    )


def _lines(
    units: Sequence[UnitReconstruction],
    combined: UnitReconstruction | None,
    event: int,
    table: Callable[[UnitReconstruction], pd.DataFrame],
) -> list[Line]:
    main = units[0] if combined is None else combined
    middle = main.types[event].direction.horizontal_deg
    lines = []
    for unit, name, drawn in answers_of(units, combined):
        try:
            found = table(unit)
        except DataError:
            # The record of this unit covers none of the windows.
            continue
        angle = found["horizontal_deg"].to_numpy(dtype=np.float64)
        line = Line(
            name,
            1e3 * index_of(found),
            # Within half a turn of the middle, so that a curve at 180 deg is not split.
            middle + np.asarray(within_half_turn(angle - middle)),
            drawn["colour"],
            drawn["dash"],
            2.2 if unit is main else 1.3,
            dots=True,
            symbol=drawn["symbol"],
            size=6.0,
        )
        lines.append(line)
    return lines


def _chosen(main: UnitReconstruction, event: int, at: float, name: str) -> list[Line]:
    whole = main.body[event].event
    middle = main.types[event].direction.horizontal_deg
    interval = whole.interval.horizontal
    x = np.array([1e3 * at])
    point = Line(
        name, x, np.array([middle]), BLACK, points=True, symbol="diamond", size=11.0, hollow=True
    )
    if interval.undetermined:
        return [replace(point, name=f"{name}: undetermined")]
    ends = np.array([interval.low_deg, interval.high_deg])
    return [Line("bar", np.repeat(x, 2), ends, BLACK, width=2.4, legend=False), point]


# Comparison of the units at the reference point.


_CLASS = 60


def differences_chart(comparison: UnitComparison, names: Sequence[str]) -> Chart | None:
    """Chart the difference of each unit's change of velocity from that of all together.

    `names`: of all units in the order of the report, for their colours. Returns: for axes that two
    or more units measure; None if there are none.
    """
    edges = 1e3 * comparison.edges
    panels = []
    for k, axis in enumerate(AXES):
        lines: list[Line] = []
        fills: list[Fill] = []
        measured = [one for one in comparison.against if np.isfinite(one.difference[:, k]).any()]
        for one in measured:
            look = unit_look(list(names).index(one.name))
            y, half = one.difference[:, k], TWO_SIDED_95 * one.sd[:, k]
            lines.append(curve(one.name, edges, y, look["colour"], look["dash"], 1.8))
            for edge in (half, -half):
                lines.append(curve(one.name, edges, edge, look["colour"], "dot", 0.9))
            fills.append(Fill(one.name, edges, -half, half, look["colour"], 0.05))
        if measured:
            panels.append(Panel(f"{axis}, m/s", tuple(lines), fills=tuple(fills), height=0.9))
    if not panels:
        return None
    said = "consistent" if comparison.agree else "NOT consistent"
    return Chart(
        "units",
        "Differences between recorders",
        "Delta-V at the reference point by each recorder minus that of the weighted mean, vehicle "
        "axes, since the first instant shown. Dotted, in its color: 95 % bound of the difference "
        "by the stated uncertainties, with the recorder's share in the mean. "
        f"Together they are {said} with their bounds (chi-square {comparison.chi_square:.4g} of "
        f"{comparison.freedom} degrees of freedom, probability {comparison.probability:.2g}).",
        SINCE_TRIGGER,
        tuple(panels),
    )


def accelerations_chart(
    units: Sequence[UnitReconstruction],
    combined: UnitReconstruction | None,
    events: Sequence[CrashEvent] = (),
) -> Chart:
    """Chart the acceleration of the reference point from every unit.

    Low-pass filtered with CFC 60 where the common rate permits.
    """
    main = units[0] if combined is None else combined
    span = crash_span(events, main.acceleration.begin, main.acceleration.end)
    rows: list[list[Line]] = [[], [], []]
    filtered = False
    for unit, name, drawn in answers_of(units, combined):
        time, values = unit.acceleration.time, unit.acceleration.values / STANDARD_GRAVITY
        step = float(np.median(np.diff(time)))
        if step * LEAST_RATE * _CLASS <= 1.0 and not unit.acceleration.gaps(time[0], time[-1]):
            values, filtered = cfc_filter(values, step, _CLASS), True
        inside = (time >= span[0]) & (time <= span[1])
        at, style = 1e3 * time[inside], (drawn["colour"], drawn["dash"])
        for k in range(3):
            width = 2.0 if unit is combined else 1.3
            rows[k].append(curve(name, at, values[inside, k], *style, width))
    how = f"after a phaseless low-pass of class CFC {_CLASS}" if filtered else "as sampled"
    return Chart(
        "accelerations",
        "Acceleration of the reference point by every recorder",
        "In the axes of the vehicle, forward, right, down, less the specific force at rest, "
        f"{how}; 1 g = 9.80665 m/s². Shaded: the 49 CFR 563 event.",
        SINCE_TRIGGER,
        tuple(Panel(f"{axis}, g", tuple(rows[k]), height=0.9) for k, axis in enumerate(AXES)),
        marks=event_marks(events, *span),
        bands=tuple(Band(1e3 * e.time_zero, 1e3 * e.end, "563 event") for e in events),
    )


# Injury risk against delta-V, with this crash on the curve.


_POINTS = 121
# Upper end of a model without a stated range, as a multiple of this case's delta-V.
_BEYOND = 2.5


def risk_chart(
    risks: Sequence[InjuryRisk],
    delta_v: float,
    sd: float,
    inputs: Mapping[str, float | str] | None = None,
    *,
    at_least: bool = False,
) -> Chart | None:
    """Chart the injury-risk models that gave an answer, each within its range.

    `delta_v`, `sd`, m/s: inputs of the models. `inputs`: further inputs of the models. `at_least`:
    whether the change of velocity has no upper bound; its bar then reaches to the model's end.
    Returns: None if no model uses a change of velocity or none gave an answer.
    """
    lines: list[Line] = []
    reach = TWO_SIDED_95 * sd
    for risk in risks:
        model = risk.model
        if "delta_v" not in model.inputs:
            continue
        x, y = _curve(model, delta_v, dict(inputs or {}))
        if not x.size:
            continue
        style = look(len(lines) // 3)
        lines.append(
            Line(
                f"{model.outcome}: {model.author} {model.year}, {model.table}",
                x,
                100.0 * y,
                style["colour"],
                style["dash"],
                1.8,
            )
        )
        at = np.array([speed_factor() * delta_v])
        bound = 100.0 * np.array([risk.low, risk.high])
        upright = np.repeat(at, 2)
        lines.append(Line("bar", upright, bound, style["colour"], width=2.4, legend=False))
        lines.append(
            Line(
                f"this crash: {_percent(risk.probability)} "
                f"({_percent(risk.low)} to {_percent(risk.high)})",
                at,
                np.array([100.0 * risk.probability]),
                style["colour"],
                points=True,
                symbol=style["symbol"],
                low=np.array([speed_factor() * max(delta_v - reach, 0.0)]),
                high=np.array([x[-1] if at_least else speed_factor() * (delta_v + reach)]),
                legend=False,
            )
        )
    if not lines:
        return None
    return Chart(
        "severity",
        "Risk of injury against the change of velocity",
        "Published logistic models, each within its range of validity; marked: this crash with the "
        "95 % bound of its delta-V, and the resulting bound of the risk"
        + (
            "; the uncertainty of the model is not included."
            if any(risk.model_sd is None for risk in risks)
            else ", with the uncertainty of the model."
        ),
        f"change of velocity (resultant of the main event), {speed_unit()}",
        (Panel("probability, %", tuple(lines)),),
    )


def _curve(
    model: SeverityModel, delta_v: float, inputs: dict[str, float | str]
) -> tuple[np.ndarray, np.ndarray]:
    """Change of velocity in the shown unit and probability, within the model's range."""
    factor = SPEEDS.get(model.unit("delta_v"), 1.0)
    low, high = model.validity.get("delta_v", (0.0, _BEYOND * delta_v / factor))
    at = np.linspace(low * factor, high * factor, _POINTS)
    # Rounding may put an end just outside of the range.
    at[[0, -1]] += np.array([1e-9, -1e-9]) * (at[-1] - at[0])
    x, y = [], []
    for value in at.tolist():
        try:
            risk = injury_risk(model, {**inputs, "delta_v": value})
        except StrapdownError:
            # A logarithm is undefined at zero, or an input is missing.
            continue
        x.append(speed_factor() * value)
        y.append(risk.probability)
    return np.array(x), np.array(y)


def _percent(share: float) -> str:
    value = 100.0 * share
    return f"{value:.2g} %" if value < 9.95 else f"{value:.0f} %"
