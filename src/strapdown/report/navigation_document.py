"""Report of a navigation run: the answer first, then its basis."""

from __future__ import annotations

from strapdown import __version__
from strapdown.errors import Finding
from strapdown.report import navigation_charts as charts
from strapdown.report import navigation_tables as tables
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
    findings_list,
)
from strapdown.report.navigation_charts import error_charts, innovation_chart, nees_chart, nis_chart
from strapdown.report.navigation_found import NavigationFound, NavigationTold, examine
from strapdown.report.navigation_plan import plan_chart
from strapdown.report.navigation_trust import trust
from strapdown.report.navigation_words import (
    cautions,
    headline,
    key_figures,
    place_words,
    smoothing_chart,
    smoothing_table,
    smoothing_words,
)


def navigation_document(
    told: NavigationTold,
    name: str,
    found: NavigationFound | None = None,
    light: Section | None = None,
) -> Document:
    """Return the report of a navigation run.

    Parameters
    ----------
    told : NavigationTold
    name : str
        Folder name, for the verification command; no command if empty.
    found : NavigationFound, optional
        From `examine`, if already computed.
    light : Section, optional
        Integrity section, for a run whose verdict is on a separate page.
    """
    found = examine(told) if found is None else found
    verdict = trust(found)
    plan = plan_chart(told)
    front: tuple[Block | None, ...] = (
        KeyFigures(key_figures(found)),
        Paragraph(verdict.sentence, "lead" if verdict.verdict == "trusted" else "warning"),
        Items(cautions(found)) if cautions(found) else None,
        Paragraph(f"It did not move from {place_words(found, 0)}.") if plan is None else None,
        None if plan is None else ChartBlock(plan),
        ChartBlock(charts.bound_chart(told)),
    )
    sections = (
        _section("answer", "The answer", *_answer(found, verdict.reasons)),
        *(() if light is None else (light,)),
        _section(
            "state",
            "Height, velocity, attitude",
            ChartBlock(charts.height_chart(told)),
            ChartBlock(charts.velocity_chart(told)),
            ChartBlock(charts.attitude_chart(told)),
        ),
        _section("truth", f"Against {told.truth_name}", *_errors(found)),
        _section("points", "At the control points", tables.point_table(found)),
        _section("smoothing", "Smoothed", *_smoothing(found)),
        _section("sensors", "Errors of the sensors and the aids", *_states(found)),
        _section("observations", "What was observed", *_observations(found)),
        _section("outages", "Outages", *_outages(found)),
        _section("events", "Events", tables.event_table(found)),
        _section("findings", "Findings", findings_list(found.findings)),
        _section("method", "Method and assumptions", *_method(found, name)),
        _section("conventions", "Conventions", Facts(CONVENTIONS)),
    )
    title = told.title or f"Navigation of {told.name}"
    return Document(
        title,
        headline(found),
        _facts(found),
        tuple(block for block in front if block is not None),
        tuple(s for s in sections if s.blocks),
        title,
        links=() if light is None else (("verdict.html", "Can it be trusted? The verdict"),),
    )


def _section(slug: str, title: str, *blocks: Block | None) -> Section:
    return Section(slug, title, tuple(b for b in blocks if b is not None))


def _facts(found: NavigationFound) -> tuple[tuple[str, str], ...]:
    told = found.told
    aids = dict.fromkeys(
        [*told.record.outages, *(a.name.partition(".")[0] for a in found.agreements)]
    )
    return (
        ("Record", ", ".join(t for t in (told.name, told.what) if t)),
        ("Start", place_words(found, 0)),
        ("Aids", ", ".join(aids) or "none"),
        ("Made with", f"strapdown {__version__}"),
    )


def _answer(found: NavigationFound, reasons: tuple[Finding, ...]) -> tuple[Block, ...]:
    said = tuple(
        ("For it" if one.severity == "note" else "Against it", f"{one.sentence()}.")
        for one in reasons
    )
    blocks: list[Block] = [tables.end_table(found)]
    if said:
        blocks += [Paragraph("What speaks for the answer, and what against it:"), Items(said)]
    return tuple(blocks)


def _errors(found: NavigationFound) -> tuple[Block | None, ...]:
    if found.errors is None:
        return ()
    drawn = [ChartBlock(c) for c in error_charts(found.told, found.errors)]
    nees = nees_chart(found.told, found.errors)
    return (tables.error_table(found), *drawn, None if nees is None else ChartBlock(nees))


def _smoothing(found: NavigationFound) -> tuple[Block | None, ...]:
    said, chart = smoothing_words(found), smoothing_chart(found)
    if said is None or chart is None:
        return ()
    return (Paragraph(said), smoothing_table(found), ChartBlock(chart))


def _states(found: NavigationFound) -> tuple[Block | None, ...]:
    table: TableBlock | None = tables.state_table(found)
    return (table, *(ChartBlock(c) for c in charts.state_charts(found.filtered)))


def _observations(found: NavigationFound) -> tuple[Block | None, ...]:
    if not found.agreements:
        return (Paragraph("Nothing was observed: the inertial sensors were alone."),)
    nis = nis_chart(found.record, found.agreements)
    return (
        tables.observation_table(found),
        *_verdicts(found),
        None if nis is None else ChartBlock(nis),
        *(ChartBlock(innovation_chart(found.record, one)) for one in found.agreements),
    )


def _verdicts(found: NavigationFound) -> tuple[Block, ...]:
    """Conclusions from the innovations on the stated errors, beyond chance."""
    rows: list[tuple[str, str]] = []
    for one in found.agreements:
        kinds = dict.fromkeys(v.kind for v in one.consistency.verdicts)
        for kind in kinds:
            alike = [v for v in one.consistency.verdicts if v.kind == kind]
            said = "; ".join(v.finding.what for v in alike)
            rows.append((one.name, f"{said}. {_capital(alike[0].finding.remedy or '')}."))
    if not rows:
        return (Paragraph("Nothing in them speaks against what was stated of sensors and aids."),)
    return (
        Paragraph("What in them is not by chance, and what it may mean:"),
        Items(tuple(rows)),
    )


def _capital(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"


def _outages(found: NavigationFound) -> tuple[Block | None, ...]:
    return (tables.withheld_table(found), tables.outage_table(found))


def _method(found: NavigationFound, name: str) -> tuple[Block | None, ...]:
    taken = (
        (
            "",
            "The errors of the sensors and of the aids are as stated, without bias that is not "
            "among the states, and those of the aids without memory: every bound rests on them.",
        ),
        ("", "Normal gravity of the ellipsoid: a deflection of the vertical is not in the bounds."),
    )
    return (
        Facts(found.told.chain) if found.told.chain else None,
        Paragraph("Taken for given:"),
        Items(taken),
        Paragraph("To run it again and compare every byte:") if name else None,
        Paragraph(f"strapdown verify {name}", "mono") if name else None,
    )


# Conventions of the report of a navigation run.


CONVENTIONS = (
    ("Body axes", "forward, right, down; local level: north, east, down"),
    (
        "Place",
        "geodetic latitude north and longitude east in deg, height over the ellipsoid in m, of the "
        "inertial sensors",
    ),
    ("Velocity", "relative to the Earth, in m/s: north, east, down"),
    ("Attitude", "roll, pitch, heading (3-2-1): right side down, nose up, clockwise are positive"),
    ("Heading", "from true north, clockwise seen from above"),
    ("Errors", "computed or measured less true; so the truth is the reading less the bias"),
    (
        "Rotation errors",
        "vector psi about north, east, down: C_computed = exp([psi x]) C_true",
    ),
    ("Innovations", "observed less expected, after what was observed before at the same instant"),
    (
        "Bounds",
        "hold the truth in 95 of 100 cases (1.96 standard deviations; of an ellipse in a plane "
        "2.45) where what is stated of the sensors and the aids is right",
    ),
    ("Time", "s, on the record's own clock"),
)
