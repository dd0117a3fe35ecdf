"""Report of a crash case: page one and the sections after it, with its charts and pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from strapdown.constants import TWO_SIDED_95
from strapdown.crash.case import CaseResult, ReferenceAnswer
from strapdown.crash.case_contact import main_event
from strapdown.crash.path import CrashPath
from strapdown.crash.reconstruction import UnitReconstruction
from strapdown.report import crash_tables
from strapdown.report.crash_animation import path_animation
from strapdown.report.crash_charts import (
    accelerations_chart,
    delta_v_budget_chart,
    delta_v_chart,
    differences_chart,
    pdof_charts,
    place_budget_chart,
    risk_chart,
    sliding_chart,
)
from strapdown.report.crash_outline import vehicle_outline
from strapdown.report.crash_pictures import (
    Direction,
    MountingPoint,
    PointChange,
    conventions_picture,
    elevation_dial,
    pdof_dial,
    points_picture,
)
from strapdown.report.crash_plan import path_plan
from strapdown.report.crash_signals import (
    attitude_chart,
    place_chart,
    reference_chart,
    unit_signals,
    velocity_chart,
)
from strapdown.report.crash_words import (
    GRAVE,
    assumptions,
    contradictions,
    conventions,
    headline,
    how_to_verify,
    key_figures,
    lead,
    limitations,
    method,
    not_shown,
    notes,
    record_facts,
)
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
    GAP,
    axis_names,
    length_factor,
    length_unit,
    mass_words,
    plain,
    shown_in,
)
from strapdown.tables import NED
from strapdown.tables.checks import index_of

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
    outline, point = vehicle_outline(spec.vehicle), found.point
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
    limits = limitations(result)
    sections = (
        section(
            "delta-v",
            "Delta-V",
            crash_tables.answers_table(result),
            *(
                delta_v_chart(
                    *units,
                    k,
                    gravity=spec.options.gravity_m_per_s2,
                    stated=_stated(result, k),
                )
                for k in range(len(events))
            ),
            sliding_chart(*units, spec.options.peak_window_s) if happened else None,
            points_picture(outline, points) if points else None,
            paragraph(None if happened else headline(result)),
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
                    pdof_dial(outline, directions, **around),
                    elevation_dial(outline, directions[which], recorders),
                    *pdof_charts(*units, which),
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
            Items(not_shown(result)),
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
                if (rows := record_facts(record))
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
            None if which is None else delta_v_budget_chart(main.body[which].event),
            place_budget_chart(path, names),
            crash_tables.budget_table(result),
            folded=True,
        ),
        section(
            "assumptions",
            "Method and assumptions",
            items_of((("", step) for step in method(result)), numbered=True),
            Paragraph("Assumptions:"),
            Items(assumptions(result)),
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
            conventions_picture(
                outline,
                [MountingPoint(u.name, u.mounting.position, k) for k, u in enumerate(result.units)],
                point=point,
                point_name=spec.point.name,
            ),
            Facts(conventions()),
            folded=True,
        ),
        section(
            "verify",
            "Verification",
            Items(how_to_verify()),
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
    dial = pdof_dial(outline, directions, **around, small=True)
    against = contradictions(result)
    grave = [head for code, head, _ in limits if code in GRAVE]
    others = [head for code, head, _ in limits if code not in GRAVE]
    return document_of(
        spec.title,
        "Crash reconstruction from inertial records",
        (fact for fact in facts if fact[1]),
        (
            KeyFigures(
                key_figures(result),
                (*((dial,) if directions else ()), path_plan(path, outline, small=True, **seen)),
            ),
            Paragraph(lead(result), "lead"),
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
    words = notes(comparison.findings, result, remedies=False)
    remedies = dict.fromkeys(text for f in comparison.findings if (text := f.advice("file")))
    return (
        crash_tables.comparison_table(result),
        crash_tables.turning_table(result),
        differences_chart(comparison, [u.name for u in found.units]),
        accelerations_chart(found.units, found.combined, found.main.events.events),
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
        chart = risk_chart(
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
    rows = notes([f for f in result.findings if f not in told], result)
    if not rows:
        more = " What contradicts the answer is on page one." if contradictions(result) else ""
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


def _direction(unit: UnitReconstruction, k: int, name: str, **more: Any) -> Direction:
    change, angle = unit.body[k].event, unit.types[k].direction
    return Direction(
        name,
        angle.horizontal_deg,
        change.interval.horizontal,
        angle.clock,
        change.resultant,
        vertical_deg=angle.vertical_deg,
        vertical=change.interval.vertical,
        **more,
    )


def _recorders(result: CaseResult) -> list[Direction]:
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


def _points(result: CaseResult) -> list[PointChange]:
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
        at = MountingPoint(name, position, number)
        found.append(PointChange(at, (x, y, z), change.bound.covariance, change.at_least))
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
