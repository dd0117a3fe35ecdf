"""Report of a crash case: page one and the sections after it, with its charts and pictures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95, Array, Flags
from strapdown.crash.case import CaseResult, ReferenceAnswer
from strapdown.crash.case_contact import main_event
from strapdown.crash.events import CrashEvent
from strapdown.crash.path import CrashPath, PathComparison, PathSamples
from strapdown.crash.reconstruction import UnitReconstruction
from strapdown.report import crash_charts as charts
from strapdown.report import crash_outline, crash_tables, crash_words
from strapdown.report import crash_pictures as pictures
from strapdown.report.chart import (
    AXIS_COLOURS,
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    SKY,
    VERMILLION,
    Band,
    Chart,
    Fill,
    Level,
    Line,
    Panel,
    curve,
    dots,
)
from strapdown.report.crash_plan import path_animation, path_plan
from strapdown.report.document import (
    Block,
    Document,
    Facts,
    Items,
    KeyFigures,
    Paragraph,
    document_of,
    items_of,
    listed,
    paragraph,
    section,
)
from strapdown.report.values import (
    AXES,
    GAP,
    axis_names,
    length_factor,
    length_unit,
    mass_words,
    plain,
    shown_in,
)
from strapdown.sensors.crash_unit import CrashUnit, RecordedTriad
from strapdown.sensors.synchronise import SynchronisedUnit
from strapdown.sensors.unit_clocks import TriadAtStamps
from strapdown.tables import ACCEL, EULER, GYRO, NED, VELOCITY
from strapdown.tables.checks import index_of
from strapdown.tables.on_disk import let_go, parts_of

# --- charts of each recorder: ranges, merged signal, limits reached ----------------------

_TURNS = ("roll", "pitch", "yaw")
_ANGLES = ("roll", "pitch", "heading")
_RAW = ((GREY, "solid"), (SKY, "dash"), (GREY, "dot"))


def unit_signals(
    recorded: CrashUnit,
    synchronised: SynchronisedUnit,
    unit: UnitReconstruction,
    number: int,
    events: Sequence[CrashEvent],
) -> list[Chart]:
    """Chart the record of a unit: as a whole, specific force and rates about the crash.

    `recorded`: on its own clock; without a gyro of its own it has no chart of rates. `number`:
    index of the unit, from 0; sets its color. `events`: events of the crash, from the mean of the
    units.
    """
    prepared = unit.at_point.prepared
    if prepared is None:
        raise ValueError(f"{unit.name} is a mean of units, which recorded nothing")
    time = np.asarray(prepared.imu.index.to_numpy(), dtype=np.float64)
    span = crash_outline.crash_span(events, float(time[0]), float(time[-1]))
    about = [_forces_and_rates(recorded, synchronised, unit, number, span)]
    if synchronised.lender is None and recorded.gyro is not None:
        about.append(_forces_and_rates(recorded, synchronised, unit, number, span, recorded.gyro))
    marks = crash_outline.event_marks(events, *span)
    bands = tuple(Band(1e3 * e.time_zero, 1e3 * e.end, "563 event") for e in events)
    return [
        _overview(unit, number, events),
        *(replace(chart, marks=marks, bands=bands) for chart in about),
    ]


def _forces_and_rates(
    recorded: CrashUnit,
    synchronised: SynchronisedUnit,
    unit: UnitReconstruction,
    number: int,
    span: tuple[float, float],
    gyro: RecordedTriad | None = None,
) -> Chart:
    """Specific force of a unit about the crash, or with its gyro the rates: recorded, processed."""
    prepared, assumed = unit.at_point.prepared, unit.at_point.assumed_axes
    assert prepared is not None
    time, C = index_of(prepared.imu), recorded.mounting.C_vs
    triads: tuple[RecordedTriad, ...]
    aligned: tuple[TriadAtStamps | None, ...]
    if gyro is None:
        triads, aligned = recorded.accelerometers, synchronised.accelerometers
        columns, scale, symbol, axes, names = ACCEL, STANDARD_GRAVITY, "g", AXES, AXES
        processed = "merged, less bias" if len(triads) > 1 else "at the common stamps"
        cut = flags_in_vehicle_axes(np.asarray(prepared.clipped), C)
        slug, title = "signals", "specific force about the crash"
        caption = "Specific force at the recorder. Thin: as recorded; thick: as processed. "
        told = _told([axis for axis in AXES if axis in assumed])
    else:
        triads, aligned = (gyro,), (synchronised.gyro,)
        columns, scale, symbol, axes, names = GYRO, math.radians(1.0), "deg/s", _ANGLES, _TURNS
        processed, cut, told = "less bias", np.zeros((time.size, 3), dtype=bool), ""
        slug, title = "rates", "rates about the crash"
        caption = (
            "Rates about the vehicle's axes: roll about forward (right side down is positive), "
            "pitch about right (nose up), yaw about down (clockwise from above). "
        )
    rows: list[list[Line]] = [[], [], []]
    levels: list[list[Level]] = [[], [], []]
    for j, (triad, there) in enumerate(zip(triads, aligned, strict=True)):
        flags = (time, np.asarray(prepared.gyro_clipped))
        if there is not None:
            flags = (index_of(there.triad.table), np.asarray(there.clipped))
        raw = _RAW[j % len(_RAW)]
        lines = triad_lines(triad, flags, recorded, synchronised.offset, scale, span, raw)
        for k in range(3):
            rows[k] += lines[k]
            levels[k] += near_levels(triad, C, lines[k][:1], k, scale, symbol)
    inside = (time >= span[0]) & (time <= span[1])
    values, cut = prepared.imu[columns].to_numpy(dtype=np.float64) / scale, cut & inside[:, None]
    colour, ms = crash_outline.unit_look(number)["colour"], 1e3 * time
    for k in range(3):
        rows[k].append(curve(processed, ms[inside], values[inside, k], colour, width=2.0))
        if cut[:, k].any():
            x, y = ms[cut[:, k]], values[cut[:, k], k]
            rows[k].append(dots("clipped in every range", x, y, VERMILLION, "x", 10.0))
    return Chart(
        f"{slug}-{number + 1}",
        f"{unit.name}: {title}",
        f"{caption}Shaded: the 49 CFR 563 event.{told}",
        crash_outline.SINCE_TRIGGER,
        tuple(
            Panel(
                f"{name}, {symbol}",
                tuple(line for line in rows[k] if np.isfinite(line.y).any()),
                levels=tuple(levels[k]),
                height=0.9,
            )
            for k, (axis, name) in enumerate(zip(axes, names, strict=True))
            if axis not in assumed
        ),
    )


def _told(assumed: Sequence[str]) -> str:
    """Caption text on the axes that are not drawn."""
    if not assumed:
        return ""
    return f" Assumed instead of recorded, and not drawn: {', '.join(assumed)}."


def _overview(unit: UnitReconstruction, number: int, events: Sequence[CrashEvent]) -> Chart:
    prepared = unit.at_point.prepared
    assert prepared is not None
    time = index_of(prepared.imu)
    panels = []
    assumed = unit.at_point.assumed_axes
    for label, columns, scale, named in (
        ("specific force, g", ACCEL, STANDARD_GRAVITY, AXES),
        ("rate, deg/s", GYRO, math.radians(1.0), _ANGLES),
    ):
        values = prepared.imu[columns].to_numpy(dtype=np.float64) / scale
        lines = [
            curve(axis, time, values[:, k], AXIS_COLOURS[k], dash, buckets=BUCKETS)
            for k, (axis, dash) in enumerate(zip(AXES, ("solid", "dash", "dot"), strict=True))
            if named[k] not in assumed
        ]
        if lines and np.isfinite(values).any():
            panels.append(Panel(label, tuple(lines), height=0.9))
    bands = [Band(e.time_zero, e.end, "563 event") for e in events]
    rest = unit.at_point.rest
    if rest is not None:
        bands.append(Band(rest.start, rest.end, "rest"))
    said = (
        "no rest detected"
        if rest is None
        else f"rest before the crash, {rest.start:.3g} to {rest.end:.3g} s, for biases and attitude"
    )
    return Chart(
        f"overview-{number + 1}",
        f"{unit.name}: the whole record",
        "Merged specific force (−1 g downward at rest) and rates along and about the vehicle's "
        f"axes. Shaded: the 49 CFR 563 event; {said}." + _told(assumed),
        "time from the trigger, s",
        tuple(panels),
        marks=crash_outline.marks_apart(
            [(e.time_zero, "time zero") for e in events], float(time[0]), float(time[-1]), 1.0
        ),
        bands=tuple(bands),
    )


# A triad as recorded: its curves in vehicle axes, and the limits of its range.


#: Buckets per curve; a report has many curves.
BUCKETS = 700
# A sensor axis within 18 deg of a vehicle axis also has its limits drawn there.
_ALONG = 0.95
_PART = 0.3
# Limits are drawn from this share of the range on; others would compress the signal.
_NEAR = 0.5


def in_vehicle_axes(values: Array, C: Array) -> Array:
    """Rotate to vehicle axes; a missing sensor axis affects only the axes it contributes to."""
    parts = np.where(np.abs(C) < 0.02, 0.0, C)[None] * np.where(
        np.abs(C)[None] < 0.02, 0.0, values[:, None, :]
    )
    return np.asarray(parts.sum(axis=2))


def flags_in_vehicle_axes(flags: Flags, C: Array) -> Flags:
    """Whether a sensor axis that contributes to a vehicle axis is at the end of its range."""
    return np.asarray((flags[:, None, :] & (np.abs(C)[None] > _PART)).any(axis=2))


def triad_lines(
    triad: RecordedTriad,
    flags: tuple[Array, Flags],
    unit: CrashUnit,
    offset: float,
    scale: float,
    span: tuple[float, float],
    look: tuple[str, str],
) -> list[list[Line]]:
    """Curves of one triad as recorded, by vehicle axis, with symbols at the end of its range."""
    C = unit.mounting.C_vs
    stamps = index_of(triad.table) - offset
    inside = (stamps >= span[0]) & (stamps <= span[1])
    columns = ACCEL if set(ACCEL) & set(triad.table.columns) else GYRO
    # An axis that was not recorded has no column.
    whole = triad.table.reindex(columns=columns).to_numpy(dtype=np.float64)
    values = in_vehicle_axes(whole[inside], C) / scale
    at, ends = flags
    ends = flags_in_vehicle_axes(ends, C) & ((at >= span[0]) & (at <= span[1]))[:, None]
    out = []
    for k in range(3):
        name = f"{triad.name}, as recorded"
        lines = [curve(name, 1e3 * stamps[inside], values[:, k], *look, 1.1, BUCKETS)]
        held = at[ends[:, k]]
        if held.size and inside.any():
            found = np.interp(held, stamps[inside], values[:, k])
            lines.append(
                Line(
                    f"{triad.name} at the end of its range",
                    1e3 * held,
                    found,
                    look[0],
                    points=True,
                    symbol="triangle-up",
                    hollow=True,
                    size=7.0,
                )
            )
        out.append(lines)
    return out


def near_levels(
    triad: RecordedTriad, C: Array, lines: Sequence[Line], axis: int, scale: float, unit: str
) -> list[Level]:
    """Range limits that a signal comes near, if a sensor axis is along the vehicle axis."""
    own = int(np.argmax(np.abs(C[axis])))
    if abs(C[axis, own]) < _ALONG:
        return []
    limit = triad.uncertainty.axis("full_scale")[own] / scale
    values = np.concatenate([line.y for line in lines] or [np.empty(0)])
    values = values[np.isfinite(values)]
    if not math.isfinite(limit) or not values.size:
        return []
    reached = ((1.0, float(values.max())), (-1.0, -float(values.min())))
    name = triad.name
    return [
        Level(sign * limit, f"{name}: {'+' if sign > 0 else '−'}{limit:.3g} {unit}")
        for sign, most in reached
        if most > _NEAR * limit
    ]


# Charts of position, velocity and attitude over time with bounds, and against references.


# Instants at which the Monte Carlo bounds are taken; they are as smooth as the path.
_INSTANTS = 160
# Numbers of a run while its angles are computed.
_WIDTH = 64
_STEADY = 1e-3


def place_chart(
    path: CrashPath,
    names: tuple[str, str] = ("forward", "right"),
    *,
    samples: PathSamples | None = None,
    events: Sequence[CrashEvent] = (),
    reference: pd.DataFrame | None = None,
    reference_name: str = "reference",
) -> Chart:
    """Chart the position of the reference point over time.

    `names`: of the first two axes of the path. `samples`: Monte Carlo samples, whose 95 % bounds
    are drawn beside the linear ones. `reference`: ``north east down`` in the axes of the path, m,
    indexed by time.
    """
    labels = [f"{name}, m" for name in (*names, "down")]
    chart = _over_time(
        "position",
        f"Position of the reference point, {names[0]}, {names[1]}, down, from that at the entry, "
        "which is exact by definition.",
        (path, events, samples),
        dict(zip(NED, labels, strict=True)),
        _sampled(samples, 6),
    )
    if reference is None:
        return chart
    at, panels = 1e3 * index_of(reference), []
    for panel, column in zip(chart.panels, NED, strict=True):
        y = reference[column].to_numpy(dtype=np.float64)
        line = curve(reference_name, at, y, VERMILLION, "dash", 1.6)
        panels.append(replace(panel, lines=(*panel.lines, line)))
    return replace(chart, panels=tuple(panels))


def velocity_chart(
    path: CrashPath,
    names: tuple[str, str] = ("forward", "right"),
    *,
    samples: PathSamples | None = None,
    events: Sequence[CrashEvent] = (),
) -> Chart:
    """Chart the velocity of the reference point over time; parameters as `place_chart`."""
    labels = [f"{name}, m/s" for name in (*names, "down")]
    return _over_time(
        "velocity",
        f"Velocity of the reference point over ground, {names[0]}, {names[1]}, down, in axes that "
        "do not turn with the vehicle.",
        (path, events, samples),
        dict(zip(VELOCITY, labels, strict=True)),
        _sampled(samples, 3),
    )


def attitude_chart(
    path: CrashPath,
    *,
    samples: PathSamples | None = None,
    events: Sequence[CrashEvent] = (),
) -> Chart:
    """Chart roll, pitch and heading over time; parameters as `place_chart`."""
    return _over_time(
        "attitude",
        "Roll (right side down is positive), pitch (nose up) and heading (clockwise from above), "
        "3-2-1 angles of the vehicle against the axes of the path; the heading continues beyond a "
        "full turn.",
        (path, events, samples),
        {a: f"{a}, deg" for a in EULER},
        _sampled_angles(path, samples),
    )


def reference_chart(
    comparison: PathComparison,
    name: str,
    names: tuple[str, str] = ("forward", "right"),
    number: int = 1,
) -> Chart:
    """Chart the difference of the path from a reference, with its bound.

    `name`: of the reference. `names`: of the first two axes of the path. `number`: index of the
    reference, for the file name.
    """
    time = 1e3 * index_of(comparison.errors)
    panels = []
    for k, axis in enumerate(NED):
        y = comparison.errors[axis].to_numpy(dtype=np.float64)
        half = comparison.bound[axis].to_numpy(dtype=np.float64)
        line = curve("path less reference", time, y, BLUE, width=1.8)
        fill = Fill("95 % of path and reference", time, -half, half, BLUE)
        label = f"{(*names, 'down')[k]}, m"
        panels.append(Panel(label, (line,), fills=(fill,), height=0.8))
    return Chart(
        f"reference-{number}",
        f"Path against {name}",
        f"Reconstructed position − position by {name}, shifted to agree at the entry. "
        "Shaded: 95 % bound of the difference, from both; "
        + ("they are consistent" if comparison.consistent else "they are NOT consistent")
        + f" at the last instant (chi-square {comparison.chi_square:.3g}, limit "
        f"{comparison.chi_square_95:.3g}).",
        crash_outline.SINCE_TRIGGER,
        tuple(panels),
    )


def _sampled(samples: PathSamples | None, first: int) -> list[Array] | None:
    """Low and high ends of the Monte Carlo 95 % interval for three columns of its errors."""
    if samples is None:
        return None
    low, high = samples.interval(0.95, slice(first, first + 3))
    return [np.stack([low[:, k], high[:, k]]) for k in range(3)]


def _sampled_angles(path: CrashPath, samples: PathSamples | None) -> list[Array] | None:
    if samples is None:
        return None
    rows = np.unique(np.linspace(0, len(path.time) - 1, _INSTANTS).astype(int))
    out = np.full((3, 2, len(path.time)), np.nan)
    off = np.empty((3, len(samples.errors)))
    nominal = rotation.euler_from_quaternion(path.q_nb)
    for row in rows.tolist():
        for part in parts_of(len(samples.errors), _WIDTH):
            # The error angles are applied after the computed attitude.
            turned = rotation.quaternion_from_rotation_vector(samples.errors[part, row, :3])
            true = rotation.euler_from_quaternion(rotation.compose(turned, path.q_nb[row]))
            off[:, part] = rotation.within_half_turn(true - nominal[row]).T
        let_go(samples.errors)
        out[..., row] = np.quantile(off, [0.025, 0.975], axis=1).T
    return list(out)


def _over_time(
    slug: str,
    caption: str,
    of: tuple[CrashPath, Sequence[CrashEvent], PathSamples | None],
    labels: Mapping[str, str],
    sampled: list[Array] | None,
) -> Chart:
    """Columns of a path with both bounds.

    `of`: the path, its events and its Monte Carlo samples. `labels`: of the panels, by column;
    `sampled`: ends of the interval of each by the samples, relative to it.
    """
    path, events, samples = of
    time, panels = 1e3 * path.time, []
    for k, (column, label) in enumerate(labels.items()):
        y = path.table[column].to_numpy(dtype=np.float64)
        if column == "heading":
            y = np.unwrap(y, period=360.0)
            # A heading of 359.9 deg at the entry is shown as -0.1 deg.
            y = y - 360.0 * np.round(y[path.anchor] / 360.0)
        half = TWO_SIDED_95 * path.sd[column].to_numpy(dtype=np.float64)
        lines = [curve("reconstructed", time, y, BLACK, width=1.8)]
        fill = Fill("95 %, linear", time, y - half, y + half, BLUE)
        for edge in () if sampled is None else sampled[k]:
            there = np.isfinite(edge)
            y_there = (y + edge)[there]
            lines.append(Line("95 %, Monte Carlo", time[there], y_there, ORANGE, "dash", 1.2))
        panels.append(Panel(label, tuple(lines), fills=(fill,), height=0.8, steady=_STEADY))
    named = [
        (at, name)
        for name, at in crash_outline.path_moments(path, events)
        if name not in ("begin", "end")
    ]
    said = " Shaded: 95 % by the linear covariance"
    if samples is not None:
        said += f"; dashed: central 95 % of {len(samples.errors)} Monte Carlo runs"
    return Chart(
        slug,
        f"{slug.capitalize()} over time",
        f"{caption}{said}.",
        crash_outline.SINCE_TRIGGER,
        tuple(panels),
        marks=crash_outline.marks_apart(named, path.time[0], path.time[-1]),
    )


SIGNALS = (
    "Specific force, as an accelerometer measures: −1 g downward at rest, 1 g = 9.80665 m/s²; in "
    "the axes of the vehicle (forward, right, down), with rates about them. As recorded: each "
    "range at its own rate. As processed: at the common stamps, ranges merged, less bias. "
    "Triangles mark samples at the end of a range, dashed levels the ends of ranges nearly "
    "reached."
)


def crash_document(result: CaseResult, name: str) -> Document:
    """Return the report of a case; `name` is that of its folder, to verify it.

    Time is from the trigger, ms (s in overviews). Axes are the turning axes of the vehicle; those
    of the path are north, east, down or, without a stated heading, forward, right, down of the
    vehicle at the entry. Every bound holds 95 %. Units are those that the case chooses.
    """
    with shown_in(result.spec.options.units):
        return _document(result, name)


def _document(result: CaseResult, name: str) -> Document:
    spec, found = result.spec, result.reconstruction
    main, which = found.main, main_event(found.main)
    path, events, units = main.path, main.events.events, (found.units, found.combined)
    names = axis_names(result)[:2]
    outline, point = crash_outline.vehicle_outline(spec.vehicle), found.point
    paths = [r for r in result.references if r.path is not None and r.unit == main.name]
    reference = reference_in_path_axes(path, paths[0]) if paths else None
    shown = paths[0].spec.name if paths else "reference"
    seen: Any = {
        "events": events,
        "point": point,
        "names": names,
        "reference": reference,
        "reference_name": shown,
    }
    sampled: Any = {"samples": result.samples, "events": events}
    directions = [
        _direction(main, k, f"event {k + 1}", main=k == which) for k in range(len(main.body))
    ]
    recorders = _recorders(result)
    around: Any = {"recorders": recorders, "point": point, "point_name": spec.point.name}
    points = _points(result)
    by_name = {unit.name: unit for unit in result.units}
    sources = tuple((r.name, r.source) for r in spec.references if r.source)
    happened = any(unit.body for unit in found.answers)
    described = [Paragraph(text) for text in spec.description.split("\n\n") if text.strip()]
    limits = crash_words.limitations(result)
    sections = (
        section(
            "delta-v",
            "Delta-V",
            crash_tables.answers_table(result),
            *(
                charts.delta_v_chart(
                    *units,
                    k,
                    gravity=spec.options.gravity_m_per_s2,
                    stated=_stated(result, k),
                )
                for k in range(len(events))
            ),
            charts.sliding_chart(*units, spec.options.peak_window_s) if happened else None,
            pictures.points_picture(outline, points) if points else None,
            paragraph(None if happened else crash_words.headline(result)),
            figures=1,
        ),
        section(
            "direction",
            "Direction of force",
            crash_tables.direction_table(result),
            *(
                ()
                if which is None
                else (
                    pictures.pdof_dial(outline, directions, **around),
                    pictures.elevation_dial(outline, directions[which], recorders),
                    *charts.pdof_charts(*units, which),
                )
            ),
            paragraph(
                None if happened else "Without an event the direction of force is not defined."
            ),
            figures=2,
        ),
        section(
            "path",
            "Path",
            crash_tables.path_table(result),
            path_plan(path, outline, **seen),
            path_animation(path, outline, **seen),
            place_chart(path, names, reference=reference, reference_name=shown, **sampled),
            velocity_chart(path, names, **sampled),
            attitude_chart(path, **sampled),
            figures=2,
        ),
        section("agreement", "Consistency of the recorders", *_agreement(result), figures=1),
        section(
            "limitations",
            "Limitations",
            Paragraph("Those that apply to this case, most serious first."),
            Items(tuple((head, text) for _, head, text in limits)),
        ),
        section(
            "not-shown",
            "Not shown by these records",
            Paragraph("Questions that no evaluation of these records can answer."),
            Items(crash_words.not_shown(result)),
        ),
        section("severity", "Severity", *_severity(result, which)),
        section(
            "references",
            "Reference comparison",
            *crash_tables.reference_tables(result),
            *(
                reference_chart(r.path, r.spec.name, names, k)
                for k, r in enumerate(paths, start=1)
                if r.path is not None
            ),
            Facts(sources) if sources else None,
            paragraph(None if spec.references else "No reference was given."),
        ),
        section(
            "case",
            "The case",
            *described,
            crash_tables.records_table(result),
            *(
                block
                for record in result.records.values()
                if (rows := crash_words.record_facts(record))
                for block in (Paragraph(f"Metadata of {record.path.name}:"), Facts(rows))
            ),
            folded=True,
        ),
        section(
            "signals",
            "Signals",
            Paragraph(SIGNALS),
            *(
                chart
                for k, unit in enumerate(found.units)
                for chart in unit_signals(
                    by_name[unit.name], found.synchronised.unit(unit.name), unit, k, events
                )
            ),
            folded=True,
        ),
        section(
            "closure",
            "Closure with the other vehicle" if result.partners else "Contact and deformation",
            *_closure(result),
            folded=True,
        ),
        section(
            "indices",
            "Occupant and barrier indices",
            crash_tables.indices_table(result),
            folded=True,
        ),
        section(
            "budget",
            "Error budget",
            Paragraph(
                "Each unknown was propagated through the whole computation; those of one kind are "
                "summed here."
            ),
            None if which is None else charts.delta_v_budget_chart(main.body[which].event),
            charts.place_budget_chart(path, names),
            crash_tables.budget_table(result),
            folded=True,
        ),
        section(
            "assumptions",
            "Method and assumptions",
            items_of((("", step) for step in crash_words.method(result)), numbered=True),
            Paragraph("Assumptions:"),
            Items(crash_words.assumptions(result)),
            folded=True,
        ),
        section(
            "sensors",
            "Sensors",
            crash_tables.units_table(result),
            crash_tables.sensors_table(result),
            crash_tables.drive_table(result),
            folded=True,
        ),
        section("findings", "Notes on the records", *_findings(result), folded=True),
        section(
            "conventions",
            "Conventions",
            pictures.conventions_picture(
                outline,
                [
                    pictures.MountingPoint(u.name, u.mounting.position, k)
                    for k, u in enumerate(result.units)
                ],
                point=point,
                point_name=spec.point.name,
            ),
            Facts(crash_words.conventions()),
            folded=True,
        ),
        section(
            "verify",
            "Verification",
            Items(crash_words.how_to_verify()),
            Paragraph(f"strapdown verify {name}", "mono"),
            crash_tables.inputs_table(result),
            folded=True,
        ),
    )
    vehicle, place = spec.vehicle, ""
    size = ""
    if not vehicle.outline_m:
        sides = (length_factor() * v for v in (vehicle.length_m, vehicle.width_m))
        size = " × ".join(f"{v:.4g} {length_unit()}" for v in sides).replace(" ", GAP)
    mass = "" if vehicle.mass_kg is None else mass_words(vehicle.mass_kg)
    if any(spec.point.position_m):
        there = ", ".join(plain(length_factor() * v, 2) for v in spec.point.position_m)
        place = f" ({there} {length_unit()} from the origin)"
    facts = (
        ("Case", spec.number),
        ("Vehicle", ", ".join(part for part in (vehicle.name, mass, size) if part)),
        ("Reference point", spec.point.name + place),
        ("Recorders", ", ".join(u.name for u in result.units)),
        ("Author", spec.author),
    )
    dial = pictures.pdof_dial(outline, directions, **around, small=True)
    against = crash_words.contradictions(result)
    grave = [head for code, head, _ in limits if code in crash_words.GRAVE]
    others = [head for code, head, _ in limits if code not in crash_words.GRAVE]
    return document_of(
        spec.title,
        "Crash reconstruction from inertial records",
        (fact for fact in facts if fact[1]),
        (
            KeyFigures(
                crash_words.key_figures(result),
                (*((dial,) if directions else ()), path_plan(path, outline, small=True, **seen)),
            ),
            Paragraph(crash_words.lead(result), "lead"),
            Paragraph(f"Caution: {'; '.join(grave)} (see Limitations).", "warning")
            if grave
            else None,
            Paragraph("These contradict the answer:", "warning") if against else None,
            items_of(against),
            Paragraph(f"Limitations: {'; '.join(others)}.", "note") if others else None,
        ),
        sections,
        footer=spec.number or spec.title,
    )


def _closure(result: CaseResult) -> tuple[Block | None, ...]:
    explained: tuple[Block, ...] = ()
    if result.blame is not None:
        candidates = [one.finding.sentence("file") for one in result.blame.candidates]
        explained = (
            Paragraph(
                "The two do not close. Each of these would explain it, and no other is as likely:"
                if candidates
                else "The two do not close, and no single error explains it."
            ),
            listed(candidates),
        )
    return (
        crash_tables.closure_table(result),
        *explained,
        crash_tables.deformation_table(result),
    )


def _agreement(result: CaseResult) -> tuple[Block | None, ...]:
    found = result.reconstruction
    comparison = found.comparison
    if comparison is None:
        return (Paragraph("One recorder: no comparison."),)
    words = crash_words.notes(comparison.findings, result, remedies=False)
    remedies = dict.fromkeys(text for f in comparison.findings if (text := f.advice("file")))
    return (
        crash_tables.comparison_table(result),
        crash_tables.turning_table(result),
        charts.differences_chart(comparison, [u.name for u in found.units]),
        charts.accelerations_chart(found.units, found.combined, found.main.events.events),
        items_of(words),
        paragraph(f"Remedies: {'; '.join(remedies)}." if remedies else None),
    )


def _severity(result: CaseResult, which: int | None) -> tuple[Block | None, ...]:
    table = crash_tables.severity_table(result)
    if table is None:
        return (Paragraph("Without an event the severity is not defined."),)
    remarks = dict.fromkeys(a.model.note for a in result.severity if a.model.note)
    risks = [answer.risk for answer in result.severity if answer.risk is not None]
    chart = None
    if which is not None and risks:
        main = result.reconstruction.main
        change = main.body[which].event
        chart = charts.risk_chart(
            risks,
            change.resultant,
            change.resultant_bound / TWO_SIDED_95,
            {"crash_type": main.types[which].name, **result.spec.options.severity_inputs},
            at_least=change.at_least,
        )
    return table, chart, *(Paragraph(remark, "note") for remark in remarks)


def _findings(result: CaseResult) -> tuple[Block | None, ...]:
    comparison = result.reconstruction.comparison
    told = () if comparison is None else comparison.findings
    rows = crash_words.notes([f for f in result.findings if f not in told], result)
    if not rows:
        more = (
            " What contradicts the answer is on page one."
            if crash_words.contradictions(result)
            else ""
        )
        return (Paragraph(f"No findings from reading and processing the records.{more}"),)
    elsewhere = "Differences between recorders are under Consistency of the recorders."
    return (
        Paragraph(
            "Findings from reading and processing the records, in this order, with remedies. "
            "Those that affect the answers are under Limitations."
        ),
        Items(rows),
        paragraph(elsewhere if told else None),
    )


def reference_in_path_axes(path: CrashPath, answer: ReferenceAnswer) -> pd.DataFrame:
    """Positions of a reference path, shifted to agree with the reconstruction at the entry.

    `path`: reconstructed path of the comparison. `answer`: answer with a reference path. Returns:
    ``north east down``, m, indexed by time, s, as used in the comparison.
    """
    assert answer.path is not None
    errors = answer.path.errors
    at = index_of(errors)
    return pd.DataFrame(
        path.positions(at) - errors[NED].to_numpy(), index=errors.index, columns=NED
    )


def _direction(unit: UnitReconstruction, k: int, name: str, **more: Any) -> pictures.Direction:
    change, angle = unit.body[k].event, unit.types[k].direction
    return pictures.Direction(
        name,
        angle.horizontal_deg,
        change.interval.horizontal,
        angle.clock,
        change.resultant,
        vertical_deg=angle.vertical_deg,
        vertical=change.interval.vertical,
        **more,
    )


def _recorders(result: CaseResult) -> list[pictures.Direction]:
    """Direction of force of the severest event of every recorder; none of a single one."""
    units = result.reconstruction.units
    if len(units) == 1:
        return []
    found = [(number, unit, main_event(unit)) for number, unit in enumerate(units)]
    return [
        _direction(unit, k, unit.name, main=False, number=number)
        for number, unit, k in found
        if k is not None
    ]


def _points(result: CaseResult) -> list[pictures.PointChange]:
    """Change of velocity of every recorder at its own position, over its severest contact."""
    found = []
    for number, unit in enumerate(result.reconstruction.units):
        k = main_event(unit)
        if k is None:
            continue
        change = unit.body[k].event
        name, position = unit.name, result.units[number].mounting.position
        lever = np.asarray(position) - np.asarray(result.reconstruction.point)
        # The point moves against the reference point by ω × r, and along turning axes the integral
        # of its acceleration has ω × (ω × r) as well.
        time, rate = unit.at_point.time, unit.at_point.rate
        inside = (time >= change.delta_v.start) & (time <= change.delta_v.end)
        rate, steps = rate[inside], np.diff(time[inside])[:, None]
        inward = np.cross(rate, np.cross(rate, lever))
        moved = np.cross(rate[-1] - rate[0], lever)
        moved = moved + (0.5 * steps * (inward[1:] + inward[:-1])).sum(axis=0)
        x, y, z = (change.delta_v.vector + moved).tolist()
        at = pictures.MountingPoint(name, position, number)
        found.append(pictures.PointChange(at, (x, y, z), change.bound.covariance, change.at_least))
    return found


def _stated(result: CaseResult, event: int) -> list[ReferenceAnswer]:
    """Delta-V stated by other sources that ends in an event: after its time zero, before the next.

    At the end of the main event if no time is stated.
    """
    main = result.reconstruction.main
    if main_event(main) is None:
        return []
    zeros = [e.time_zero for e in main.events.events]
    return [
        answer
        for answer in result.references
        if answer.unit == main.name
        and answer.spec.delta_v_m_per_s is not None
        and event == max((k for k, zero in enumerate(zeros) if zero <= answer.span[1]), default=0)
    ]
