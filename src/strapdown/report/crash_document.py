"""The report of a crash case: what stands on page one, and the sections after it."""

from __future__ import annotations

from strapdown import __version__
from strapdown.report import crash_tables as tables
from strapdown.report.chart import Chart
from strapdown.report.crash_assumptions import CONVENTIONS, assumptions, how_to_verify, method
from strapdown.report.crash_figures import CrashFigures
from strapdown.report.crash_limits import limitations
from strapdown.report.crash_words import headline, key_figures, lead
from strapdown.report.document import (
    Animation,
    Block,
    ChartBlock,
    Document,
    Facts,
    Items,
    KeyFigures,
    Paragraph,
    Picture,
    Section,
)
from strapdown.systems.crash_case import CaseResult

__all__ = ["crash_document", "drawings"]


def crash_document(result: CaseResult, figures: CrashFigures, name: str) -> Document:
    """Return the report of a case.

    Parameters
    ----------
    result : CaseResult
    figures : CrashFigures
    name : str
        Of the folder, for the command that verifies it.

    Returns
    -------
    Document
    """
    spec = result.spec
    facts = [
        ("Case", spec.number),
        ("Vehicle", _vehicle(result)),
        ("Reference point", f"{spec.point.name}, {_place(spec.point.position_m)}"),
        ("Recorders", ", ".join(u.name for u in result.units)),
        ("Author", spec.author),
        ("Made with", f"strapdown {__version__}"),
    ]
    sections = (
        Section("case", "The case", _case(result)),
        Section("signals", "Signals", _signals(result, figures)),
        Section(
            "delta-v",
            "Delta-V",
            _blocks(tables.answers_table(result), *_charts(*figures.delta_v)),
        ),
        Section(
            "direction",
            "Direction of force",
            _blocks(
                tables.direction_table(result),
                *_charts(figures.pdof_by_window, figures.pdof_by_time_zero),
            ),
        ),
        Section(
            "path",
            "Path",
            _blocks(
                figures.motion,
                tables.path_table(result),
                *_charts(figures.place, figures.velocity, figures.attitude),
            ),
        ),
        Section("agreement", "Sensors against each other", _agreement(result, figures)),
        Section(
            "budget",
            "Error budget",
            _blocks(
                Paragraph(
                    "What makes the bounds: every unknown was carried through the whole "
                    "computation, and those of one kind are added up here."
                ),
                *_charts(figures.delta_v_budget, figures.place_budget),
                tables.budget_table(result),
            ),
        ),
        Section("severity", "Severity", _severity(result, figures)),
        Section("references", "Reference comparison", _references(result, figures)),
        Section(
            "assumptions",
            "Method and assumptions",
            _blocks(
                Items(tuple(("", step) for step in method(result)), numbered=True),
                Paragraph("Taken for given:"),
                Items(assumptions(result)),
            ),
        ),
        Section(
            "sensors", "Sensors", _blocks(tables.units_table(result), tables.sensors_table(result))
        ),
        Section("conventions", "Conventions", _blocks(figures.conventions, Facts(CONVENTIONS))),
        Section("limitations", "Limitations", _limitations(result)),
        Section("findings", "Notes on the records", _findings(result)),
        Section("verify", "How to verify", _verify(result, name)),
    )
    return Document(
        title=spec.title,
        subtitle="Crash reconstruction from inertial records",
        facts=tuple((head, text) for head, text in facts if text),
        front=(
            KeyFigures(key_figures(result), figures.front),
            Paragraph(lead(result), "lead"),
            *((Paragraph(f"Mind: {_worst(result)}", "warning"),) if _worst(result) else ()),
        ),
        sections=tuple(s for s in sections if s.blocks),
        footer=spec.number or spec.title,
    )


def _blocks(*found: Block | None) -> tuple[Block, ...]:
    return tuple(block for block in found if block is not None)


def _charts(*found: Chart | None) -> tuple[ChartBlock, ...]:
    return tuple(ChartBlock(chart) for chart in found if chart is not None)


def _signals(result: CaseResult, figures: CrashFigures) -> tuple[Block, ...]:
    return _charts(
        *(c for unit in figures.signals for c in (unit.crash, unit.rates, unit.overview))
    )


def _place(position: tuple[float, float, float]) -> str:
    forward, right, down = position
    return f"{forward:g} m forward, {right:g} m right, {down:g} m down of the vehicle's origin"


def _vehicle(result: CaseResult) -> str:
    vehicle = result.spec.vehicle
    size = f"{vehicle.length_m:g} m × {vehicle.width_m:g} m" if not vehicle.outline_m else ""
    mass = "" if vehicle.mass_kg is None else f"{vehicle.mass_kg:g} kg"
    return ", ".join(part for part in (vehicle.name, mass, size) if part)


def _worst(result: CaseResult) -> str:
    """The heads of what is grave: what makes an answer wrong, and not only less precise."""
    grave = ("do not agree", "end of its range", "not measured", "not determined", "beyond the")
    found = [head for head, _ in limitations(result) if any(word in head for word in grave)]
    return "; ".join(found) + " (see Limitations)." if found else ""


def _case(result: CaseResult) -> tuple[Block, ...]:
    described = [Paragraph(text) for text in result.spec.description.split("\n\n") if text.strip()]
    records = [
        (record.path.name, "; ".join([record.title, *_told(record.facts)]).strip("; "))
        for record in result.records.values()
    ]
    return _blocks(
        *described,
        Paragraph(headline(result), "note"),
        Facts(
            tuple((name, text or "a record without a word of its own") for name, text in records)
        ),
    )


def _told(facts: object) -> list[str]:
    from collections.abc import Mapping

    assert isinstance(facts, Mapping)
    return [f"{str(k).replace('_', ' ')}: {v}" for k, v in facts.items()]


def _agreement(result: CaseResult, figures: CrashFigures) -> tuple[Block, ...]:
    table = tables.comparison_table(result)
    if table is None:
        return (Paragraph("There is one recorder, and nothing to hold it against."),)
    comparison = result.reconstruction.comparison
    assert comparison is not None
    words = tuple(
        (f"{f.file or ''} {f.quantity or ''}".strip(), f.what) for f in comparison.findings
    )
    return _blocks(
        table,
        *_charts(figures.units, figures.accelerations),
        Items(words) if words else None,
    )


def _severity(result: CaseResult, figures: CrashFigures) -> tuple[Block, ...]:
    table = tables.severity_table(result)
    if table is None:
        return (Paragraph("Without an event there is no severity to tell."),)
    notes = dict.fromkeys(a.model.note for a in result.severity if a.model.note)
    return _blocks(table, *_charts(figures.severity), *(Paragraph(note, "note") for note in notes))


def _references(result: CaseResult, figures: CrashFigures) -> tuple[Block, ...]:
    table = tables.reference_table(result)
    if table is None:
        return (Paragraph("No reference was given."),)
    sources = tuple((r.name, r.source) for r in result.spec.references if r.source)
    return _blocks(table, *_charts(*figures.references), Facts(sources) if sources else None)


def _limitations(result: CaseResult) -> tuple[Block, ...]:
    return (
        Paragraph("Written from what happened in this case; the gravest first."),
        Items(limitations(result)),
    )


def _findings(result: CaseResult) -> tuple[Block, ...]:
    if not result.findings:
        return (Paragraph("Nothing was noticed in the records that a reader should know."),)
    rows = []
    for finding in result.findings:
        place = ", ".join(
            p
            for p in (
                finding.file,
                None if finding.row is None else f"row {finding.row}",
                finding.quantity,
            )
            if p
        )
        rows.append((place, finding.what))
    return (Items(tuple(rows)),)


def _verify(result: CaseResult, name: str) -> tuple[Block, ...]:
    rows = how_to_verify(name)
    command = dict(rows)["Command"]
    return (
        Items(tuple(r for r in rows if r[0] != "Command")),
        Paragraph(command, "mono"),
        tables.inputs_table(result),
    )


def drawings(document: Document) -> list[ChartBlock | Picture | Animation]:
    """Return every chart, picture and animation, in the order of the report."""
    found: list[ChartBlock | Picture | Animation] = []
    for block in (*document.front, *(b for s in document.sections for b in s.blocks)):
        if isinstance(block, ChartBlock | Picture | Animation):
            found.append(block)
        elif isinstance(block, KeyFigures):
            found += block.pictures
    return found
