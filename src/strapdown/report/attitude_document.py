"""The report of the attitude bench, with the body in motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

import numpy as np

from strapdown.attitude_comparison.comparison import AttitudeComparison
from strapdown.errors import ConfigError, check_choice
from strapdown.evaluation.differences import attitude_at
from strapdown.report import attitude_tables as tables
from strapdown.report import attitude_words as words
from strapdown.report.attitude_charts import charts
from strapdown.report.attitude_words import MEANINGS, chosen_run, full_rate_errors, sweep_grid
from strapdown.report.chart import AXIS_COLOURS, BLACK, GREY, Chart
from strapdown.report.chart_svg import ChartFigure
from strapdown.report.document import (
    Animation,
    Block,
    Document,
    Facts,
    KeyFigure,
    KeyFigures,
    Paragraph,
    TableBlock,
    document_of,
    findings_list,
    listed,
    section,
    table_of,
)
from strapdown.report.scene import Scene, SceneBody, SceneLine, SceneWord
from strapdown.tables import NED
from strapdown.tables.checks import index_of


def attitude_document(bench: AttitudeComparison, drawn: Sequence[Chart] | None = None) -> Document:
    """Return the report of a bench; its charts are drawn here unless they are given."""
    chart = {c.slug: c for c in (charts(bench) if drawn is None else drawn)}.get
    answer = bench.answer
    # Warnings are beside the answer; notes and remedies follow below.
    warnings = [
        f"{f.quantity}: {f.sentence('python')}." if f.quantity else f"{f.sentence('python')}."
        for f in bench.findings
        if f.severity != "note"
    ]
    readings = ((r.source, r.quantity, r.unit, words.first_value(r), r.why) for r in bench.readings)
    sections = (
        section(
            "rates",
            "Cost, rate and error",
            chart("cost"),
            chart("sweep"),
            *tables.sweep_tables(bench),
        ),
        section("results", "Results", *tables.result_tables(bench)),
        section(
            "log", "Signals and attitude", chart("gyro"), chart("attitude"), body_animation(bench)
        ),
        section(
            "errors",
            "Errors over time",
            chart("error"),
            chart("reference-error"),
            chart("difference"),
            tables.difference_table(bench),
            *_named_items("Reference points:", words.reference_lines(bench)),
            figures=1,
        ),
        section(
            "parts",
            "Cost, parts of the error, trials and other libraries",
            tables.condition_table(bench),
            tables.cost_table(bench),
            chart("share"),
            tables.budget_table(bench),
            chart("trials"),
            tables.trial_table(bench),
            tables.place_table(bench),
            chart("peers"),
            tables.peer_table(bench),
            tables.filter_table(bench),
            folded=True,
        ),
        section("findings", "Findings", findings_list(bench.findings), folded=not warnings),
        section(
            "inputs",
            "Inputs and assumptions",
            Facts(tuple(words.facts(bench))),
            table_of(
                "column | taken as | unit | first value | because",
                readings,
                text=(0, 1, 2, 4),
                title="How the log was read",
            ),
            folded=True,
        ),
        section("conventions", "Conventions", Facts(words.CONVENTIONS), folded=True),
        section(
            "again",
            "Verification",
            Paragraph(
                "This folder is sealed: manifest.json holds the configuration and the SHA-256 of "
                "every input and output."
            ),
            Paragraph("strapdown verify FOLDER", "mono"),
            folded=True,
        ),
    )
    return document_of(
        bench.source,
        "Comparison of attitude algorithms",
        (),
        (
            _key_figures(bench),
            Paragraph(answer.sentence, "lead"),
            Paragraph(words.standing(bench)),
            *_named_items("To be considered beside it:", warnings),
            *_named_items("Why:", answer.why),
            *_named_items("Remedies:", answer.helps),
            *_named_items(
                "Rests of similar attitude, possible reference points:", words.offer_lines(bench)
            ),
        ),
        sections,
        footer=bench.source,
    )


def _key_figures(bench: AttitudeComparison) -> KeyFigures | None:
    """Algorithm, rate and error of the answer, if it names an algorithm."""
    answer = bench.answer
    if answer.algorithm is None:
        return None
    names = ("Simplest sufficient algorithm", "Lowest sufficient rate")
    whose = "algorithm error, without a reference" if answer.verdict == "own" else "largest error"
    bound = f"tolerance {answer.tolerance_deg:g}°"
    if answer.verdict == "sensor":  # beside its errors the algorithm's own are small
        names = ("All that integration needs", "At a rate of")
        whose, bound = "largest error, the sensor's included", f"beyond the {bound}"
    figures = [KeyFigure(names[0], answer.algorithm, "")]
    rate, meaning, error = answer.rate_hz, answer.meaning, math.nan
    if rate is not None:
        figures.append(KeyFigure(names[1], f"{rate:.4g} Hz", MEANINGS.get(meaning or "", "")))
        grid = sweep_grid(bench, meaning or "drop")
        if rate in grid.columns:
            error = float(grid[rate].get(answer.algorithm, math.nan))
    if math.isnan(error):
        error = full_rate_errors(bench).get(answer.algorithm, math.nan)
    figures.append(KeyFigure(whose.capitalize(), words.degrees(error), bound))
    return KeyFigures(tuple(figures))


def _named_items(title: str, lines: Sequence[str]) -> list[Block]:
    return [Paragraph(title), listed(lines)] if lines else []


# The body in space: a box with its axes among north, east and down, over time.


#: A slider on a page cannot resolve more frames.
MOST_FRAMES = 300
_AS_IT_WAS = 30_000.0  # ms: a longer log is played faster
_SHORTEST = 33.0  # ms a frame
# Half dimensions of a phone, in drawing units; forward along its long side.
_HALF = np.array([0.72, 0.38, 0.07])
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * _HALF
# Aft, fore, left, right, up, down. The front and the upper face, with the screen, have their own
# colors to show the orientation.
_FACES = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
_COLOURS = ("#c5d2de", "#D55E00", "#c5d2de", "#c5d2de", "#3d5166", "#9fb3c8")
_AXIS_NAMES = ("x forward", "y right", "z down")
_SPACE = 1.3


def body_animation(bench: AttitudeComparison) -> Animation:
    """Animate the body by the chosen algorithm (`chosen_run`).

    A wireframe follows the truth, where it is known.
    """
    run, truth = chosen_run(bench), bench.truth
    # Equally spaced instants, at most as many as there are samples.
    start, end = float(run.attitude.index[0]), float(run.attitude.index[-1])
    time = np.linspace(start, end, min(MOST_FRAMES, max(2, len(run.attitude))))
    # Real time for a short log, else the fastest drawable.
    real = 1000.0 * (end - start) / (len(time) - 1)
    frame = max(real, _SHORTEST) if real * (len(time) - 1) <= _AS_IT_WAS else _SHORTEST
    tips = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    axes = tuple(zip(_AXIS_NAMES, tips, AXIS_COLOURS, strict=True))
    bodies = [SceneBody(_CORNERS, _FACES, _COLOURS, attitude_at(run.attitude, time), axes=axes)]
    if truth is not None and len(truth):
        stamps, ghost = index_of(truth), attitude_at(truth, time)
        ghost[(time < stamps[0]) | (time > stamps[-1])] = np.nan
        bodies.append(SceneBody(_CORNERS, _FACES, (BLACK,) * 6, ghost, wire=True))
    tips_ned = ((1.2, 0.0, 0.0), (0.0, 1.2, 0.0), (0.0, 0.0, 1.1))
    lines = [SceneLine("", np.vstack([np.zeros(3), tip]), GREY, 1.0, True) for tip in tips_ned]
    labels = [SceneWord(name, tip, GREY) for name, tip in zip(NED, tips_ned, strict=True)]
    scene = Scene(
        tuple(bodies),
        tuple(lines),
        tuple(labels),
        tuple(f"{at:.3f} s" for at in time),
        np.full(3, -0.8 * _SPACE),
        np.full(3, 0.8 * _SPACE),
        round(frame, 1),
        # From the south-east and above: north points away, east to the right.
        (153.0, 28.0),
    )
    text = f"Attitude by {run.algorithm}; dark: upper side, orange: front. Drag to turn the view."
    if truth is not None:
        text += " Wireframe: truth."
    if real > 1.05 * frame:
        text += (
            f" Played {real / frame:.3g} times as fast as recorded, one pose every "
            f"{time[1] - time[0]:.3g} s."
        )
    return Animation("body", "The body in space", text, scene)


# A bench in a notebook: a short text with its table, and its charts as figures.


#: Chart kinds, and the data that a bench needs for each.
KINDS = {
    "cost": "costs",
    "sweep": "a sweep of rates",
    "gyro": "samples",
    "attitude": "a run",
    "error": "a truth",
    "reference-error": "reference points",
    "difference": "two algorithms",
    "share": "shares",
    "trials": "trials",
    "peers": "scores of other libraries",
}


def plot(bench: AttitudeComparison, kind: str = "cost") -> ChartFigure:
    """Draw one chart of a bench, as the page shows it.

    Parameters
    ----------
    kind : str
        One of `KINDS`.

    Returns
    -------
    ChartFigure
        Displays itself in a notebook; `save` writes it as SVG, PNG or PDF.

    Raises
    ------
    ConfigError
        The chart does not exist, or the bench lacks its data.
    """
    check_choice("report.no-chart-bench", KINDS, quantity="kind", kind=kind)
    drawn = {chart.slug: chart for chart in charts(bench)}
    if kind not in drawn:
        raise ConfigError(
            "report.nothing-draw-needs", quantity=f"kind '{kind}'", kinds=KINDS[kind], drawn=drawn
        )
    return ChartFigure(drawn[kind])


def short_html(bench: AttitudeComparison) -> str:
    """Return the answer and the table of results as HTML for a notebook.

    Returns
    -------
    str
        Everything from outside is escaped.
    """
    parts = [
        f"<div><b>{escape(bench.source)}</b></div>",
        f'<p style="font-size:1.25em;margin:.3em 0"><b>{escape(bench.answer.sentence)}</b></p>',
        f'<p style="margin:.3em 0">{escape(words.standing(bench))}</p>',
        *map(_table, tables.result_tables(bench)),
    ]
    return "<div>" + "".join(parts) + "</div>"


def _table(table: TableBlock) -> str:
    def row(cells: tuple[str, ...], tag: str, bold: bool) -> str:
        weight = ";font-weight:bold" if bold else ""
        made = ""
        for k, cell in enumerate(cells):
            side = "left" if k in table.text else "right"
            made += f'<{tag} style="text-align:{side}{weight}">{escape(cell)}</{tag}>'
        return f"<tr>{made}</tr>"

    rows = "".join(row(r, "td", k in table.strong) for k, r in enumerate(table.rows))
    note = f"<div><small>{escape(table.caption)}</small></div>" if table.caption else ""
    head = row(table.columns, "th", False)
    return f"<table><thead>{head}</thead><tbody>{rows}</tbody></table>{note}"
