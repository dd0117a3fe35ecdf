"""The report of an alignment: the answer first, then what it rests on."""

from __future__ import annotations

from strapdown import __version__
from strapdown.errors import Finding
from strapdown.report import alignment_charts as charts
from strapdown.report.alignment_tables import (
    answer_table,
    bias_table,
    method_rows,
    readiness_table,
    turn_table,
)
from strapdown.report.alignment_trust import trust
from strapdown.report.alignment_words import headline, key_figures, limits
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
from strapdown.systems.alignment_run import AlignmentResult

__all__ = ["CONVENTIONS", "alignment_document"]

CONVENTIONS = (
    ("Body axes", "forward, right, down; local level: north, east, down"),
    ("Attitude", "roll, pitch, heading (3-2-1): right side down, nose up, clockwise are positive"),
    ("Heading", "from true north, clockwise seen from above"),
    ("Specific force", "what an accelerometer feels: −9.8 m/s² downward at rest"),
    ("Bias", "reading less truth; so the truth is the reading less the bias"),
    (
        "Bounds",
        "hold the truth in 95 of 100 cases (1.96 standard deviations) where what is stated "
        "of the sensors is right",
    ),
    ("Time", "s, on the record's own clock"),
)


def alignment_document(result: AlignmentResult, name: str) -> Document:
    """Return the report of an alignment.

    Parameters
    ----------
    result : AlignmentResult
    name : str
        Of the folder, for the command that verifies it.

    Returns
    -------
    Document
    """
    found = trust(result)
    site = result.site
    facts = (
        ("Record", f"{result.source.name}, {result.source.what}"),
        ("Place", f"{site.lat_deg:.6f}°, {site.lon_deg:.6f}°, {site.alt:g} m"),
        ("Sensors", _sensors(result)),
        ("Made with", f"strapdown {__version__}"),
    )
    front: tuple[Block, ...] = (
        KeyFigures(key_figures(result)),
        Paragraph(found.sentence, "lead" if found.verdict == "trusted" else "warning"),
        Items(tuple((head, text) for head, text in limits(result))),
        ChartBlock(charts.readiness_chart(result)),
        readiness_table(result),
    )
    sections = (
        Section("answer", "The answer", _answer(result, found.reasons)),
        Section(
            "attitude", "Attitude over the record", (ChartBlock(charts.attitude_chart(result)),)
        ),
        *_biases(result),
        *_more(result),
        Section("signals", "Signals", (ChartBlock(charts.signal_chart(result)),)),
        Section("findings", "Findings", _findings(result)),
        Section("method", "Method and assumptions", _method(result, name)),
        Section("conventions", "Conventions", (Facts(CONVENTIONS),)),
    )
    title = result.spec.title or f"Alignment of {result.source.name}"
    return Document(title, headline(result), facts, front, sections, title)


def _sensors(result: AlignmentResult) -> str:
    given = result.spec.sensors
    stated = [*(f"gyro {k}" for k in given.gyro), *(f"accel {k}" for k in given.accel)]
    parts = [given.sensor or ""] + ([f"stated: {', '.join(stated)}"] if stated else [])
    return "; ".join(p for p in parts if p)


def _answer(result: AlignmentResult, reasons: tuple[Finding, ...]) -> tuple[Block, ...]:
    said = tuple(
        ("For it" if one.severity == "note" else "Against it", f"{one.sentence()}.")
        for one in reasons
    )
    blocks: list[Block] = [answer_table(result)]
    if said:
        blocks += [Paragraph("What speaks for the answer, and what against it:"), Items(said)]
    blocks += [Paragraph("What limits it:"), Items(limits(result))]
    return tuple(blocks)


def _more(result: AlignmentResult) -> tuple[Section, ...]:
    """What a turn of the body would tell that this rest does not."""
    table = turn_table(result)
    if table is None:
        return ()
    said = (
        "A body that only stands cannot tell a horizontal accelerometer bias from a tilt, nor an "
        "east gyro drift from the heading. A turn can: the bias goes with the body, and the tilt "
        "does not."
    )
    return (Section("more", "What would make more known", (Paragraph(said), table)),)


def _biases(result: AlignmentResult) -> tuple[Section, ...]:
    table: TableBlock | None = bias_table(result)
    if table is None:
        return ()
    innovations = charts.innovation_chart(result)
    blocks: list[Block] = [table, *(ChartBlock(c) for c in charts.bias_charts(result))]
    blocks += [] if innovations is None else [ChartBlock(innovations)]
    return (Section("sensors", "Drifts and biases", tuple(blocks)),)


def _findings(result: AlignmentResult) -> tuple[Block, ...]:
    if not result.findings:
        return (Paragraph("None."),)
    rows = []
    for finding in result.findings:
        head = ", ".join(p for p in (finding.quantity, finding.row and f"row {finding.row}") if p)
        text = finding.what if not finding.remedy else f"{finding.what}. {finding.remedy}."
        rows.append((str(head), text))
    refused = result.readiness.refused
    if refused:
        rows.append(
            (
                "readiness",
                f"{len(refused)} shorter lengths, up to {max(r[0] for r in refused):.3g} s, gave "
                f"no attitude: {refused[-1][1].sentence()}.",
            )
        )
    return (Items(tuple(rows)),)


def _method(result: AlignmentResult, name: str) -> tuple[Block, ...]:
    taken = [
        (
            "",
            "The body stays at its place; it may rock and sway about it as far as the coarse "
            "alignment allows.",
        ),
        ("", "The errors of the sensors are as stated: every bound rests on them."),
        (
            "",
            "Normal gravity of the ellipsoid: a deflection of the vertical of 5 arc seconds is "
            "0.0014° of tilt, and is not in the bounds.",
        ),
    ]
    return (
        Facts(method_rows(result)),
        Paragraph("Taken for given:"),
        Items(tuple(taken)),
        Paragraph("To run it again and compare every byte:"),
        Paragraph(f"strapdown verify {name}", "mono"),
    )
