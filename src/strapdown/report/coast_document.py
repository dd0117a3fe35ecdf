"""The report of a forecast of coasting: the answer first, then what it rests on."""

from __future__ import annotations

from strapdown import __version__
from strapdown.report import coast_charts as charts
from strapdown.report import coast_tables as tables
from strapdown.report.coast_words import (
    headline,
    inside_words,
    key_figures,
    motion_words,
    outage_words,
    remedy,
    start_words,
)
from strapdown.report.document import (
    Block,
    ChartBlock,
    Document,
    Facts,
    Items,
    KeyFigures,
    Paragraph,
    Section,
)
from strapdown.systems.coasting.run import CoastResult

__all__ = ["coast_document"]


def coast_document(result: CoastResult, name: str) -> Document:
    """Return the report of a forecast.

    Parameters
    ----------
    result : CoastResult
    name : str
        Of the folder, for the command that verifies it.

    Returns
    -------
    Document
    """
    came = inside_words(result)
    front: tuple[Block | None, ...] = (
        KeyFigures(key_figures(result)),
        Paragraph(remedy(result), "lead"),
        Paragraph(came) if came else None,
        ChartBlock(charts.cone_chart(result)),
    )
    drifts = tables.drift_table(result)
    sections = [
        Section(
            "over-time",
            "Over the outage",
            (tables.time_table(result), ChartBlock(charts.parts_chart(result))),
        ),
        Section(
            "budget",
            "What makes the drift",
            (tables.budget_table(result), ChartBlock(charts.budget_chart(result))),
        ),
        Section("plane", "From above", (ChartBlock(charts.plane_chart(result)),)),
        Section("method", "Method and assumptions", _method(result, name)),
    ]
    if drifts is not None:
        sections.insert(2, Section("tried", "What came", (drifts,)))
    title = f"Coasting of {result.name} for {outage_words(result)}"
    return Document(
        title,
        headline(result),
        _facts(result),
        tuple(block for block in front if block is not None),
        tuple(sections),
        title,
    )


def _facts(result: CoastResult) -> tuple[tuple[str, str], ...]:
    return (
        ("Sensor" if result.navigation is None else "Record", f"{result.name}: {result.what}"),
        ("Motion", motion_words(result)),
        ("Start", start_words(result)),
        ("Aids that stay", ", ".join(result.stays) or "none"),
        ("Made with", f"strapdown {__version__}"),
    )


def _method(result: CoastResult, name: str) -> tuple[Block, ...]:
    taken = [
        (
            "",
            "The covariance of the filter itself, run over the outage; no formula of its own. What "
            "each source adds is how that covariance answers to its size, by runs in which it is "
            "larger and smaller.",
        ),
        (
            "",
            "Errors are small and normal, and the sensors as their data sheet or configuration "
            "states: noise, bias, its instability, scale factors and misalignments where they are "
            "known. Shaking beyond it is not in the forecast.",
        ),
        ("", "Normal gravity: a deflection of the vertical is not in it."),
    ]
    if result.navigation is None:
        taken.append(
            (
                "",
                "Before the outage a car goes round blocks to both sides, with changes of speed. A "
                "drive without turns leaves more unknown, and a standstill less.",
            )
        )
    return (
        Paragraph("Taken for given:"),
        Items(tuple(taken)),
        Facts(
            (
                ("Horizontal, 95 %", "longer half axis of the ellipse that holds 95 % of places"),
                ("Horizontal, 1 sd", "root of the sum of both variances"),
                ("Along, across", "along the velocity; along the heading where it stands"),
                ("Sign of a drift", "computed less true, or less the fix"),
            )
        ),
        Paragraph("To run it again and compare every byte:"),
        Paragraph(f"strapdown verify {name}", "mono"),
    )
