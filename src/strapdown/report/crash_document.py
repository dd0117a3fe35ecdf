"""Report of a crash case: page one and the sections after it."""

from __future__ import annotations

from strapdown import __version__
from strapdown.crash.case import CaseResult
from strapdown.report import crash_tables
from strapdown.report.chart import Chart
from strapdown.report.crash_figures import CrashFigures
from strapdown.report.crash_limits import (
    CONVENTIONS,
    assumptions,
    grave_limitations,
    how_to_verify,
    limitations,
    method,
)
from strapdown.report.crash_words import headline, key_figures, lead, notes, record_facts
from strapdown.report.document import (
    Block,
    ChartBlock,
    Document,
    Facts,
    Items,
    KeyFigures,
    Paragraph,
    Section,
    TableBlock,
)
from strapdown.report.values import GAP, plain

SIGNALS = (
    "Specific force is what an accelerometer feels: −1 g downward at rest, 1 g = 9.80665 m/s². It "
    "is drawn along the axes of the vehicle (forward, right, down), and rates about them; as "
    "recorded, each range at its own rate, and as used: at the stamps that all recorders share, "
    "ranges merged, biases taken off. Triangles mark a range at its end, dashed levels the ends of "
    "ranges that were come near."
)


def crash_document(result: CaseResult, figures: CrashFigures, name: str) -> Document:
    """Return the report of a case.

    Parameters
    ----------
    result : CaseResult
    figures : CrashFigures
    name : str
        Folder name, for the verification command.
    """
    spec = result.spec
    facts = [
        ("Case", spec.number),
        ("Vehicle", _vehicle(result)),
        ("Reference point", spec.point.name + _place(spec.point.position_m)),
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
            _blocks(_if_any(crash_tables.answers_table(result)), *_charts(*figures.delta_v))
            or (Paragraph(headline(result)),),
        ),
        Section(
            "direction",
            "Direction of force",
            _blocks(
                _if_any(crash_tables.direction_table(result)),
                *_charts(figures.pdof_by_window, figures.pdof_by_time_zero),
            )
            or (Paragraph("Without an event there is no direction of force to tell."),),
        ),
        Section(
            "path",
            "Path",
            _blocks(
                crash_tables.path_table(result),
                figures.path,
                figures.motion,
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
                crash_tables.budget_table(result),
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
            "sensors",
            "Sensors",
            _blocks(crash_tables.units_table(result), crash_tables.sensors_table(result)),
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


def _if_any(table: TableBlock) -> TableBlock | None:
    return table if table.rows else None


def _charts(*found: Chart | None) -> tuple[ChartBlock, ...]:
    return tuple(ChartBlock(chart) for chart in found if chart is not None)


def _signals(result: CaseResult, figures: CrashFigures) -> tuple[Block, ...]:
    charts = _charts(
        *(c for unit in figures.signals for c in (unit.overview, unit.crash, unit.rates))
    )
    return (Paragraph(SIGNALS), *charts)


def _place(position: tuple[float, float, float]) -> str:
    if not any(position):
        return ""
    return f" ({', '.join(plain(v, 2) for v in position)} m from the origin)"


def _vehicle(result: CaseResult) -> str:
    vehicle = result.spec.vehicle
    size = ""
    if not vehicle.outline_m:
        size = f"{vehicle.length_m:g} m × {vehicle.width_m:g} m".replace(" ", GAP)
    mass = "" if vehicle.mass_kg is None else f"{vehicle.mass_kg:g} kg"
    return ", ".join(part for part in (vehicle.name, mass, size) if part)


def _worst(result: CaseResult) -> str:
    found = grave_limitations(result)
    return "; ".join(found) + " (see Limitations)." if found else ""


def _case(result: CaseResult) -> tuple[Block, ...]:
    described = [Paragraph(text) for text in result.spec.description.split("\n\n") if text.strip()]
    facts: list[Block] = []
    for record in result.records.values():
        rows = record_facts(record)
        if rows:
            facts += [Paragraph(f"What {record.path.name} says of itself:"), Facts(rows)]
    return _blocks(*described, crash_tables.records_table(result), *facts)


def _agreement(result: CaseResult, figures: CrashFigures) -> tuple[Block, ...]:
    table = crash_tables.comparison_table(result)
    if table is None:
        return (Paragraph("There is one recorder, and nothing to hold it against."),)
    comparison = result.reconstruction.comparison
    assert comparison is not None
    words = notes(comparison.findings, result, remedies=False)
    remedies = dict.fromkeys(text for f in comparison.findings if (text := f.advice("file")))
    return _blocks(
        table,
        *_charts(figures.units, figures.accelerations),
        Items(words) if words else None,
        Paragraph(f"What can be done: {'; '.join(remedies)}.") if remedies else None,
    )


def _severity(result: CaseResult, figures: CrashFigures) -> tuple[Block, ...]:
    table = crash_tables.severity_table(result)
    if table is None:
        return (Paragraph("Without an event there is no severity to tell."),)
    notes = dict.fromkeys(a.model.note for a in result.severity if a.model.note)
    return _blocks(table, *_charts(figures.severity), *(Paragraph(note, "note") for note in notes))


def _references(result: CaseResult, figures: CrashFigures) -> tuple[Block, ...]:
    tables = crash_tables.reference_tables(result)
    if not tables:
        return (Paragraph("No reference was given."),)
    sources = tuple((r.name, r.source) for r in result.spec.references if r.source)
    return _blocks(*tables, *_charts(*figures.references), Facts(sources) if sources else None)


def _limitations(result: CaseResult) -> tuple[Block, ...]:
    return (
        Paragraph("Written from what happened in this case; the gravest first."),
        Items(limitations(result)),
    )


def _findings(result: CaseResult) -> tuple[Block, ...]:
    comparison = result.reconstruction.comparison
    told = () if comparison is None else comparison.findings
    rows = notes([f for f in result.findings if f not in told], result)
    if not rows:
        return (Paragraph("Nothing was noticed in the records that a reader should know."),)
    more = (Paragraph("What recorders differ in stands under Sensors against each other."),)
    return (
        Paragraph(
            "What was noticed while the records were read and worked through, in this order, and "
            "what can be done about it. What weighs on the answers stands under Limitations."
        ),
        Items(rows),
        *(more if told else ()),
    )


def _verify(result: CaseResult, name: str) -> tuple[Block, ...]:
    return (
        Items(how_to_verify()),
        Paragraph(f"strapdown verify {name}", "mono"),
        crash_tables.inputs_table(result),
    )
