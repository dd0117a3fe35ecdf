"""The page of a campaign: answers first, then results over the grid, distributions and method."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from strapdown.campaign.summary import (
    Cell,
    Results,
    between,
    counted,
    is_number,
    label,
    listed,
    number,
    over_decades,
    percent,
    quantile,
    share,
    shown,
    with_unit,
    words_and_unit,
)
from strapdown.constants import Array
from strapdown.report.chart import (
    BLACK,
    BLUE,
    ORANGE,
    VERMILLION,
    Bars,
    Chart,
    Fill,
    Level,
    Line,
    Mark,
    Panel,
    dots,
    kept_rows,
    look,
)
from strapdown.report.document import (
    Block,
    Document,
    Facts,
    KeyFigure,
    KeyFigures,
    Paragraph,
    TableBlock,
    capital,
    document_of,
    items_of,
    section,
    table_of,
)
from strapdown.report.document import listed as listed_texts
from strapdown.report.values import GAP, share_words
from strapdown.units import named_unit

# Charts of a campaign: scalars over the grid, curves, distributions, sensitivities, logs.

#: Categories of a chart, lines of a panel, and panels of a chart, at most.
CATEGORIES, LINES, PANELS = 40, 6, 6
#: Values of which a histogram is drawn, at least.
LEAST = 20

#: Panels of cells: title, and lines, each with its name and its cells.
Layout = list[tuple[str, list[tuple[str, list[Cell]]]]]


def _title(name: str) -> str:
    return capital(named_unit(name)[0])


def _ends_and_middle(scalars: Sequence[Mapping[str, Any]]) -> tuple[Array, Array, Array]:
    """5 % quantile, median and 95 % quantile of each."""
    low, middle, high = (
        np.array([number(quantile(one, p)["value"]) for one in scalars]) for p in (0.05, 0.5, 0.95)
    )
    return low, middle, high


# Scalars over the grid.


def _layout(results: Results, axis: str | None) -> Layout:
    """Panels of cells, with lines of cells along the `axis`, a grid parameter or none.

    Empty if there are too many lines or panels.
    """
    rest = [key for key in results.grid if key != axis]

    def by(keys: Sequence[str], cells: Sequence[Cell]) -> list[list[Cell]]:
        groups: dict[Any, list[Cell]] = {}
        for cell in cells:
            groups.setdefault(tuple(cell["parameters"][key] for key in keys), []).append(cell)
        return list(groups.values())

    for panel_keys in ([], sorted(rest, key=lambda key: len(results.grid[key]))[:1]):
        line_keys = [key for key in rest if key not in panel_keys]
        not_of_line = [key for key in results.grid if key not in line_keys]
        not_of_panel = [key for key in results.grid if key not in panel_keys]
        drawn: Layout = []
        for cells in by(panel_keys, results.cells):
            lines = [
                (results.cell_name(own[0], not_of_line) if line_keys else "", own)
                for own in by(line_keys, cells)
            ]
            title = results.cell_name(cells[0], not_of_panel) if panel_keys else ""
            drawn.append((title, lines))
        if len(drawn) <= PANELS and max(len(lines) for _, lines in drawn) <= LINES:
            return drawn
    return []


def over_grid(results: Results) -> Iterator[Chart]:
    """A chart of each scalar over the cells."""
    if len(results.cells) < 2:
        return
    numeric = [key for key, values in results.grid.items() if all(map(is_number, values))]
    axis = max(numeric, key=lambda key: len(results.grid[key]), default=None)
    layout = _layout(results, axis) if axis is not None else []
    for name in results.scalars:
        if layout and axis is not None:
            yield _axis_chart(results, name, axis, layout)
        elif len(results.cells) <= CATEGORIES:
            yield _category_chart(results, name)


def _axis_chart(results: Results, name: str, axis: str, layout: Layout) -> Chart:
    """Median and 5 to 95 % of a scalar over a numeric grid parameter."""
    scalars = [cell["scalars"][name] for cell in results.cells]
    low, _, high = _ends_and_middle(scalars)
    log = over_decades([*low.tolist(), *high.tolist()])
    panels = []
    for title, lines in layout:
        fills, drawn = [], []
        for k, (line, cells) in enumerate(lines):
            ordered = sorted(cells, key=lambda cell: cell["parameters"][axis])
            x = np.array([float(cell["parameters"][axis]) for cell in ordered])
            low, middle, high = _ends_and_middle([cell["scalars"][name] for cell in ordered])
            words, style = line or "median", dict[str, Any](look(k))
            drawn.append(Line(words, x, middle, **style, dots=True, size=7.0))
            fills.append(Fill(words, x, low, high, style["colour"], 0.14, legend=False))
        panels.append(Panel(label(name), tuple(drawn), log=log, title=title, fills=tuple(fills)))
    values = [float(v) for v in results.grid[axis]]
    return Chart(
        f"grid-{name}",
        _title(name),
        f"Line: median of the cases of a cell. Band: 5 to 95{GAP}% of the cases.",
        results.parameter(axis),
        tuple(panels),
        log_x=min(values) > 0.0 and max(values) >= 10.0 * min(values),
    )


def _category_chart(results: Results, name: str) -> Chart:
    """Median and 5 to 95 % of a scalar of each cell, one below the other."""
    low, middle, high = _ends_and_middle([cell["scalars"][name] for cell in results.cells])
    at, title = np.arange(len(results.cells)), "median, and 5 to 95 %"
    line = dots(title, middle, at, BLUE, "circle", low=low, high=high)
    return Chart(
        f"grid-{name}",
        _title(name),
        f"Point: median of the cases of a cell. Bar: 5 to 95{GAP}% of the cases.",
        label(name),
        (Panel("", (line,), categories=tuple(map(results.cell_name, results.cells))),),
        log_x=over_decades([*low.tolist(), *high.tolist()]),
    )


# Curves.


def curves(results: Results) -> Iterator[Chart]:
    """Median and 5 to 95 % of each curve along its axis."""
    if not results.cells or not results.cells[0]["curves"]:
        return
    x = np.array(results.summary["x"], dtype=np.float64)
    # Of many cells the first ones along the grid.
    first = [("", [(results.cell_name(cell), [cell]) for cell in results.cells[:LINES]])]
    layout = _layout(results, None) or first
    shown_cells = sum(len(lines) for _, lines in layout)
    caption = f"Line: median over the {results.case_noun}s. Band: 5 to 95{GAP}%, at each point."
    if shown_cells < len(results.cells):
        caption += f" The first {shown_cells} of {len(results.cells)} cells."
    for name in results.cells[0]["curves"]:
        panels = []
        for title, lines in layout:
            fills, drawn = [], []
            for k, (line, (cell, *_)) in enumerate(lines):
                low, middle, high = (
                    np.array([number(v) for v in cell["curves"][name][key]])
                    for key in ("low", "median", "high")
                )
                rows = kept_rows((low, middle, high), 150)
                many = len(lines) > 1
                style = look(k) if many else {"colour": BLUE, "dash": "solid"}
                words = line if many else "median"
                drawn.append(Line(words, x[rows], middle[rows], style["colour"], style["dash"]))
                fills.append(
                    Fill(words, x[rows], low[rows], high[rows], style["colour"], 0.14, False)
                )
            panels.append(Panel(label(name), tuple(drawn), title=title, fills=tuple(fills)))
        yield Chart(f"curve-{name}", _title(name), caption, "time from the start, s", tuple(panels))


# Sensitivities.


def sensitivity(results: Results) -> Iterator[Chart]:
    """Sobol indices of each scalar as bars."""
    for cell in results.cells[:PANELS]:
        for name, found in cell["sensitivity"].items():
            if any(one["total"] is not None for one in found["parameters"]):
                yield _sobol_chart(results, cell, name, found)


def _sobol_chart(results: Results, cell: Cell, name: str, found: Mapping[str, Any]) -> Chart:
    """First order and total indices of one scalar, largest total first."""
    rows = sorted(found["parameters"], key=lambda one: -number(one["total"]))
    at = np.arange(len(rows), dtype=np.float64)
    bars, lines = [], []
    for kind, words, off, colour, pattern in (
        ("total", "total", -0.2, ORANGE, "/"),
        ("first", "first order", 0.2, BLUE, ""),
    ):
        value, low, high = (
            np.array([number(one[f"{kind}{end}"]) for one in rows]) for end in ("", "_low", "_high")
        )
        bars.append(Bars(words, at + off, value, colour, width=0.36, pattern=pattern))
        interval = dots(f"{words}, interval", value, at + off, BLACK, size=0.0, low=low, high=high)
        lines.append(replace(interval, legend=False))
    first = sum(number(one["first"]) for one in rows)
    caption = (
        f"Share of the variance due to each parameter alone (first order, together "
        f"{shown(first)}), and with its interactions (total), with 95{GAP}% intervals. "
        f"{counted(found['base_samples'], 'base sample')}."
    )
    if found["left_out"]:
        caption += f" {found['left_out']:,} left out, as a case of them has no value."
    where = f" ({results.cell_name(cell)})" if len(results.cells) > 1 else ""
    names = tuple(results.parameter(one["parameter"]) for one in rows)
    return Chart(
        f"sobol-{name}-{cell['cell']}",
        f"{_title(name)}{where}",
        caption,
        "Sobol index",
        (Panel("", tuple(lines), bars=tuple(bars), categories=names, height=1.0),),
    )


# Distributions.


def distributions(results: Results) -> Iterator[Chart]:
    """Histograms of each scalar, the cells one below the other."""
    if len(results.cells) > PANELS:
        return
    for name in results.scalars:
        found = [
            cell
            for cell in results.cells
            if "histogram" in cell["scalars"][name] and cell["scalars"][name]["count"] >= LEAST
        ]
        if found:
            yield _histograms(results, name, found)


def _histograms(results: Results, name: str, cells: Sequence[Cell]) -> Chart:
    """Histogram of a scalar of each of the cells."""
    noun, many = results.case_noun, len(cells) > 1
    found = [cell["scalars"][name]["histogram"] for cell in cells]
    panels = []
    for k, (cell, one) in enumerate(zip(cells, found, strict=True)):
        x = np.repeat(np.array(one["edges"], dtype=np.float64), 2)[1:-1]
        y = np.repeat(np.array(one["counts"], dtype=np.float64), 2)
        colour = look(k)["colour"] if many else BLUE
        line = Line(f"{noun}s", x, y, colour, legend=False)
        fill = Fill("", x, 0.0 * y, y, colour, 0.35, legend=False)
        title = results.cell_name(cell) if many else ""
        panels.append(Panel(f"{noun}s", (line,), title=title, fills=(fill,)))
    log = all(one["log"] for one in found)
    caption = f"{capital(noun)}s by value, in steps of equal {'ratio' if log else 'width'}."
    if beyond := sum(one["below"] + one["above"] for one in found):
        caption += f" {counted(beyond, noun)} beyond the axis, far out."
    marks = [
        Mark(float(one[side]), f"{side} {one[side]:g}")
        for one in results.cells[0]["rates"]
        for side in ("above", "below")
        if one["scalar"] == name and one[side] is not None
    ]
    ends = [edge for one in found for edge in (one["edges"][0], one["edges"][-1])]
    if not many:
        own = cells[0]["scalars"][name]
        levels = ((0.05, "5 %"), (0.5, "median"), (0.95, "95 %"))
        quantiles = [Mark(number(quantile(own, level)["value"]), words) for level, words in levels]
        marks = [mark for mark in (*quantiles, *marks) if ends[0] <= mark.x <= ends[1]]
    return Chart(
        f"distribution-{name}",
        _title(name),
        caption,
        label(name),
        tuple(panels),
        marks=tuple(marks),
        log_x=log or (many and over_decades(ends)),
    )


# Logs of a fleet.


def logs(results: Results) -> Iterator[Chart]:
    """Each scalar over the logs, one panel below the other."""
    if not results.is_fleet or not results.cells:
        return
    found, run = results.summary["logs"], results.summary["cases"]["run"]
    x = np.array([one["draw"] for one in found], dtype=np.float64)
    cell = np.array([one["cell"] for one in found])
    caption = "Each point is a log; one without a value has none."
    if len(found) < run:
        caption += f" The first {len(found)} of {run:,} cases."
    for start in range(0, len(results.scalars), 4):
        panels = []
        for name in results.scalars[start : start + 4]:
            y = np.array([number(one["scalars"][name]) for one in found])
            panels.append(_logs_panel(results, name, x, cell, y))
        title = "Logs beside each other"
        yield Chart(f"logs-{start // 4}", title, caption, "number of the log", tuple(panels))


def _logs_panel(results: Results, name: str, x: Array, cell: Array, y: Array) -> Panel:
    """A scalar over the logs; of several cells each has its color."""
    scalars = [one["scalars"][name] for one in results.cells]
    many = len(results.cells) > 1
    if many:
        kinds = [
            (results.cell_name(one), cell == one["cell"], look(k)["colour"], look(k)["symbol"])
            for k, one in enumerate(results.cells[: 2 * LINES])
        ]
    else:
        fences = scalars[0].get("outliers") or {"low_fence": -math.inf, "high_fence": math.inf}
        far = (y < fences["low_fence"]) | (y > fences["high_fence"])
        kinds = [("log", ~far, BLUE, "circle"), ("far out", far, VERMILLION, "diamond")]
    lines = tuple(
        dots(words, x[own], y[own], colour, symbol, 4.0)
        for words, own, colour, symbol in kinds
        if np.isfinite(y[own]).any()
    )
    ends = [number(quantile(one, p)["value"]) for one in scalars for p in (0.025, 0.975)]
    log = over_decades(ends) and min(number(one["minimum"]) for one in scalars) > 0.0
    middle = number(quantile(scalars[0], 0.5)["value"])
    levels = () if many or not math.isfinite(middle) else (Level(middle, "median"),)
    return Panel(label(name), lines, log=log, levels=levels)


#: Rows of a table, at most.
ROWS = 100
#: Share of the logs of a fleet below which a finding is said on page one.
UNUSUAL = 0.5
#: Errors that are said on page one, at most.
SAID = 5
_BOUND_WORDS = {
    "consistent": "consistent with {}",
    "optimistic": "optimistic: the bound is too small for {}",
    "pessimistic": "pessimistic: the bound is too large for {}",
}
_VARIANCE_WORDS = {
    "consistent": "consistent",
    "optimistic": "optimistic: errors exceed the stated variances",
    "pessimistic": "pessimistic: errors are below the stated variances",
}
_STATUS_WORDS = {
    "refused": "refused (input or configuration)",
    "diverged": "diverged",
    "failed": "failed",
    "crashed": "process ended",
    "hung": "time limit",
    "memory": "memory limit",
}


def campaign_document(frozen: Mapping[str, Any], summary: Mapping[str, Any], name: str) -> Document:
    """Return the page of a campaign: of its ``campaign.json`` and the statistics of `summarise`.

    `name`: folder of the campaign, for the commands on the page.
    """
    results = Results(frozen, summary)
    sections = (
        section("grid", "Results over the grid", *over_grid(results)),
        section("coverage", "Coverage, rates and consistency", *_tests(results)),
        section("linear", "Linear propagation", *_linear(results)),
        section("fleet", "Logs", *logs(results)),
        section("curves", "Curves", *curves(results)),
        section("sensitivity", "Sensitivity", *sensitivity(results)),
        section("distributions", "Distributions", *distributions(results)),
        section("failures", "Failures and findings", *_failures(results, name)),
        section("outliers", "Outliers", _outliers(results), folded=not results.is_fleet),
        section("tables", "All statistics", *_statistics(results), folded=True),
        section("method", "Method", *_method(results), folded=True),
    )
    return document_of(
        str(frozen.get("title") or name),
        "Campaign",
        (
            ("Cases", results.cases_words),
            ("Each case", f"strapdown {(frozen.get('base') or {}).get('kind', '')}"),
        ),
        _front(results),
        sections,
        links=(
            ("summary.json", "every statistic"),
            ("campaign.json", "the campaign as it was run"),
        ),
    )


# Page one.


def _front(results: Results) -> Iterator[Block | None]:
    """Answers: coverages, rates, consistency and failures."""
    failure, cells = results.summary["failure"], results.cells
    text = f"{results.cases_words}: {failure['of'] - failure['hits']:,} done"
    if failure["hits"]:
        text += f", {failure['hits']:,} not: {share(failure)}"
    bad = failure["hits"] or any(
        one["verdict"] not in ("consistent", None)
        for cell in cells
        for one in (*cell["coverage"], *cell["consistency"])
    )
    yield Paragraph(f"{capital(text)}.", "warning" if bad else "lead")
    if len(cells) == 1:
        figures = tuple(_answers(results, cells[0])) or tuple(_medians(results, cells[0]))
        if figures:
            yield KeyFigures(figures)
        # Of a fleet, findings that most of its logs do not have.
        yield items_of(
            (one["code"], f"{_examples(one, one['hits'])}: {share(one)}.")
            for one in (results.summary["findings"][:ROWS] if results.is_fleet else ())
            if one["share"] < UNUSUAL
        )
    elif cells:
        yield items_of(_answers_over_cells(results))
        yield _cell_table(results)
    yield items_of(_errors(results))


def _errors(results: Results) -> Iterator[tuple[str, str]]:
    """Errors that cases ended with, each with its first case."""
    for one in results.summary["errors"][:SAID]:
        first = f"{one['logs'][0]} ({one['cases'][0]})" if "logs" in one else one["cases"][0]
        words = f"{counted(one['count'], results.case_noun)}, the first is {first}"
        state = _STATUS_WORDS.get(one["status"], one["status"])
        yield state, f"{one['code']}: {words}" if one["code"] else words


def _answers(results: Results, cell: Cell) -> Iterator[KeyFigure]:
    """Answers of the only cell."""
    shares = [(one, "errors within the bound", _verdict(one)) for one in cell["coverage"]]
    shares += [(one, _limit_words(one), "") for one in cell["rates"]]
    for one, what, verdict in shares:
        yield KeyFigure(
            f"{one['name']}: {what}",
            share_words(number(one["share"])),
            f"95{GAP}% interval {percent(one['low'], one['high'])}",
            _of_words(results, one, verdict),
        )
    for one in cell["consistency"]:
        ends = f"{shown(one['low'], 0.1)} to {shown(one['high'], 0.1)}"
        yield KeyFigure(
            f"{one['name']}: mean normalized error squared",
            shown(one["mean"]),
            f"expected {one['dof']:g}; 95{GAP}% within {ends} if consistent",
            _of_words(results, one, _VARIANCE_WORDS.get(one["verdict"], "")),
        )


def _medians(results: Results, cell: Cell) -> Iterator[KeyFigure]:
    """Medians of the first scalars, where no others are asked of the only cell."""
    for name in results.scalars[:4]:
        (words, unit), one = words_and_unit(name), cell["scalars"][name]
        low, middle, high = (quantile(one, p) for p in (0.05, 0.5, 0.95))
        half = 0.5 * (number(middle["high"]) - number(middle["low"]))
        rows = (cell["sensitivity"].get(name) or {}).get("parameters", ())
        rows = [row for row in rows if row["total"] is not None]
        note = _of_words(results, one, "")
        if rows:
            top = max(rows, key=lambda row: number(row["total"]))
            index = between(top["total"], top["total_low"], top["total_high"])
            note = f"Most sensitive to {named_unit(top['parameter'])[0]}: total index {index}"
        yield KeyFigure(
            f"{words}, median",
            with_unit(shown(middle["value"], half), unit),
            f"5 to 95{GAP}% of the {results.case_noun}s: {shown(low['value'])} to "
            f"{with_unit(shown(high['value']), unit)}",
            note,
        )


def _of_words(results: Results, one: Mapping[str, Any], verdict: str) -> str:
    """Verdict, and of how many cases a number is."""
    of = one["of"] if "of" in one else one["count"]
    words = f"of {counted(of, results.case_noun)}"
    if one["missing"]:
        words += f"; {one['missing']:,} without the value"
    return f"{capital(verdict)}; {words}" if verdict else capital(words)


def _verdict(one: Mapping[str, Any]) -> str:
    """Verdict on a coverage in words."""
    expected = f"{100.0 * one['expected']:g}{GAP}%"
    return _BOUND_WORDS.get(one["verdict"], "").format(expected)


def _limit_words(one: Mapping[str, Any]) -> str:
    """The condition of a rate: ``end error above 10 m``."""
    words, unit = named_unit(one["scalar"])
    sides = [side for side in ("above", "below") if one[side] is not None]
    limits = " and ".join(f"{side} {with_unit(f'{one[side]:g}', unit)}" for side in sides)
    return f"{words} {limits}"


def _answers_over_cells(results: Results) -> Iterator[tuple[str, str]]:
    """A sentence for each coverage, consistency and rate over the cells of a grid."""
    cells = results.cells
    for kind in ("coverage", "consistency"):
        for k, first in enumerate(cells[0][kind]):
            parts = []
            for verdict in ("consistent", "optimistic", "pessimistic"):
                own = [cell for cell in cells if cell[kind][k]["verdict"] == verdict]
                if not own:
                    continue
                coverage = kind == "coverage"
                one = {**first, "verdict": verdict}
                words = _verdict(one) if coverage else _VARIANCE_WORDS[verdict]
                names = "" if verdict == "consistent" else f" ({results.listed_cells(own)})"
                parts.append(f"{words} in {len(own)} of {len(cells)} cells{names}")
            yield first["name"], f"{capital('; '.join(parts))}."
    for k, first in enumerate(cells[0]["rates"]):
        shares = [(number(cell["rates"][k]["share"]), i) for i, cell in enumerate(cells)]
        shares = [one for one in shares if math.isfinite(one[0])]
        if shares:
            low, high = (
                f"{share_words(part)} ({results.cell_name(cells[i])})"
                for part, i in (min(shares), max(shares))
            )
            yield first["name"], f"{capital(_limit_words(first))}: from {low} to {high}."


# Tables with a row for each cell.


def _table(
    results: Results,
    columns: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    text: Sequence[int] = (),
    passed: Sequence[tuple[int, int]] = (),
    title: str = "",
    caption: str = "",
) -> TableBlock:
    """A row for each cell: its parameters, then `columns`; of these `text` are words."""
    grid = results.grid
    ahead = len(grid)
    made = []
    for cell, own in zip(results.cells[:ROWS], rows, strict=False):
        values = [cell["parameters"][key] for key in grid]
        made.append((*(v if isinstance(v, str) else f"{v:g}" for v in values), *own))
    words = [k for k, values in enumerate(grid.values()) if isinstance(values[0], str)]
    more = len(results.cells) - ROWS
    rest = f" {more} more cells are in summary.json." if more > 0 else ""
    return TableBlock(
        (*map(results.parameter, grid), *columns),
        tuple(made),
        text=(*words, *(ahead + k for k in text)),
        passed=frozenset((row, ahead + k) for row, k in passed if row < ROWS),
        title=title,
        caption=caption + rest,
    )


def _cell_table(results: Results) -> TableBlock:
    """Coverage and rates, and the failures, of each cell."""
    first = results.cells[0]
    names = [f"{one['name']}, within the bound" for one in first["coverage"]]
    names += [one["name"] for one in first["rates"]]
    rows = []
    for cell in results.cells:
        failed = f"{cell['failure']['hits']} of {cell['failure']['of']}"
        rows.append([*(share(one) for one in (*cell["coverage"], *cell["rates"])), failed])
    passed = [
        (row, k)
        for row, cell in enumerate(results.cells)
        for k, one in enumerate(cell["coverage"])
        if one["verdict"] == "consistent"
    ]
    caption = f"Shares of cases with 95{GAP}% intervals."
    if passed:
        caption += f" Marked: the expected share is in the 99{GAP}% interval."
    return _table(results, (*names, "not done"), rows, passed=passed, caption=caption)


def _tests(results: Results) -> Iterator[Block]:
    """Coverages and consistencies with their verdicts."""
    if not results.cells:
        return
    for k, first in enumerate(results.cells[0]["coverage"]):
        rows = []
        for one in (cell["coverage"][k] for cell in results.cells):
            interval = percent(one["low_99"], one["high_99"])
            rows.append((f"{one['of']:,}", share(one), interval, _verdict(one)))
        title = f"{capital(first['name'])}: {label(first['error'])}, within {label(first['bound'])}"
        columns = ("of", "within the bound", f"99{GAP}% interval", "verdict")
        yield _table(results, columns, rows, text=(3,), title=title)
    for k, first in enumerate(results.cells[0]["consistency"]):
        tests: list[tuple[str, ...]] = []
        for one in (cell["consistency"][k] for cell in results.cells):
            half = 0.5 * (number(one["high"]) - number(one["low"]))
            tests.append(
                (
                    str(one["count"]),
                    shown(one["mean"], half),
                    f"{shown(one['low'], half)} to {shown(one['high'], half)}",
                    share(one["inside"]),
                    _VARIANCE_WORDS.get(one["verdict"], "–"),
                )
            )
        expected = f"95{GAP}% if consistent"
        yield _table(
            results,
            ("of", "mean", expected, "inside the 95 % quantile", "verdict"),
            tests,
            text=(4,),
            title=(
                f"{capital(first['name'])}: normalized error squared, {first['dof']:g} degrees "
                "of freedom"
            ),
            caption=(
                "The mean of a consistent filter is the number of degrees of freedom. The "
                f"verdict is by its 99{GAP}% interval."
            ),
        )


def _statistics(results: Results) -> Iterator[Block]:
    """Statistics of every scalar."""
    columns = ("of", "mean", "sd", "5 %", "median", "95 %", "least", "greatest")
    for name in results.scalars:
        rows, missing = [], 0
        for one in (cell["scalars"][name] for cell in results.cells):
            low, middle, high = (quantile(one, p) for p in (0.05, 0.5, 0.95))
            spread = 0.5 * (number(one["mean_high"]) - number(one["mean_low"]))
            extremes = [
                f"{shown(one[end])} ({one[f'{end}_case']})" if one["count"] else "–"
                for end in ("minimum", "maximum")
            ]
            missing += one["missing"]
            rows.append(
                (
                    f"{one['count']:,}",
                    between(one["mean"], one["mean_low"], one["mean_high"]),
                    shown(one["sd"]),
                    shown(low["value"], spread),
                    between(middle["value"], middle["low"], middle["high"]),
                    between(high["value"], high["low"], high["high"]),
                    *extremes,
                )
            )
        caption = f"In brackets 95{GAP}% intervals, and the {results.case_noun} of an extreme."
        if missing:
            caption += f" Without the value: {counted(missing, results.case_noun)}."
        yield _table(results, columns, rows, title=capital(label(name)), caption=caption)


# Other tables.


def _linear(results: Results) -> Iterator[Block | None]:
    """In bulk: standard deviations by linear propagation beside those of the cases."""
    linear = results.frozen.get("linear") or {}
    if not linear or not results.cells:
        return
    rows, counts = [], []
    for name, sd in linear["linear_sd"].items():
        one = results.cells[0]["scalars"][name]
        if not one["count"] or not number(sd) > 0.0 or one["sd"] is None:
            continue
        counts.append(one["count"])
        values = shown(linear["nominal"][name], sd), shown(one["mean"], sd), shown(sd)
        rows.append((label(name), *values, shown(one["sd"]), f"{one['sd'] / sd:.3f}"))
    scatter = 100.0 / math.sqrt(2.0 * min(counts, default=1))
    yield table_of(
        "scalar | unperturbed | mean | sd, linear | sd, of the cases | ratio",
        rows,
        "Where the ratio is one, linear propagation suffices. By chance it differs by "
        f"{scatter:.2g}{GAP}% (1 sd, of normal values).",
    )


def _failures(results: Results, folder: str) -> Iterator[Block | None]:
    """What failed, what was found, and how a case is repeated."""
    summary, noun = results.summary, results.case_noun
    errors, findings, failure = summary["errors"], summary["findings"], summary["failure"]
    if not summary["count"]:
        return
    rows = []
    for one in errors[:ROWS]:
        state = _STATUS_WORDS.get(one["status"], one["status"])
        count = one["count"]
        rows.append((state, one["code"] or "–", f"{count:,}", _examples(one, count)))
    yield table_of(
        f"state | code | {noun}s | which",
        rows,
        f"In all {share(failure)} with the 95{GAP}% interval.",
        text=(0, 1, 3),
        title=f"{capital(noun)}s that are not done",
    ) or Paragraph(
        f"Every {noun} is done; the 95{GAP}% interval of the share of failures is "
        f"{percent(failure['low'], failure['high'])}."
    )
    yield table_of(
        f"finding | {noun}s | share, with its 95{GAP}% interval | which",
        (
            (one["code"], f"{one['hits']:,}", share(one), _examples(one, one["hits"]))
            for one in findings[:ROWS]
        ),
        text=(0, 3),
        title="Findings of the results",
    )
    yield Paragraph("To repeat one of them with its whole report:")
    first = errors[0]["cases"][0] if errors else 0
    yield Paragraph(f"strapdown campaign case {folder} {first}", "mono")


def _examples(one: Mapping[str, Any], count: int) -> str:
    """Numbers of the first cases, or their logs with the numbers."""
    names = [str(case) for case in one["cases"]]
    if "logs" in one:
        names = [f"{log} ({case})" for case, log in zip(names, one["logs"], strict=True)]
    more = f" and {count - len(names):,} more" if count > len(names) else ""
    return ", ".join(names) + more


def _outliers(results: Results) -> Block | None:
    """Cases far beyond the quartiles."""
    rows: list[tuple[str, ...]] = []
    many, total = len(results.cells) > 1, 0
    for name in results.scalars:
        for cell in results.cells:
            scalar = cell["scalars"][name]
            if not (found := scalar.get("outliers")):
                continue
            total += found["below"] + found["above"]
            ends = [shown(quantile(scalar, p)["value"]) for p in (0.25, 0.75)]
            where = (results.cell_name(cell),) if many else ()
            for one in found["worst"][: 3 if many else None]:
                what = f"{one['log']} ({one['case']})" if "log" in one else str(one["case"])
                rows.append((label(name), *where, what, shown(one["value"]), " to ".join(ends)))
    caption = (
        "Values beyond the quartiles by more than three times the distance between them, the "
        f"farthest {'three of each cell' if many else 'ten of each scalar'}; in all {total:,}."
    )
    if len(rows) > ROWS:
        caption += f" {len(rows) - ROWS} more rows are in summary.json."
    columns = f"scalar |{' cell |' if many else ''} {results.case_noun} | value | quartiles"
    return table_of(columns, rows[:ROWS], caption, text=(0, 1, 2) if many else (0, 1))


# Method.


def _method(results: Results) -> Iterator[Block | None]:
    """What varied, and how the intervals are made."""
    frozen = results.frozen
    yield table_of(
        "parameter | key | unit | values",
        (
            (one["name"], one.get("key", ""), results.unit(one["name"]) or "–", _distribution(one))
            for one in frozen.get("parameters") or ()
        ),
        text=(0, 1, 2, 3),
        title="Parameters",
    )
    if given := frozen.get("cases") or {}:
        words = {
            "random": "independent draws",
            "latin": "Latin hypercube",
            "sobol": "scrambled Sobol sequence",
            "sensitivity": "Saltelli's design",
            "list": "list",
        }
        method, draws = str(given.get("method", "random")), int(given.get("draws", 1))
        asked = f"{draws:,} in each cell{' and of each log' if results.is_fleet else ''}"
        if method == "sensitivity":
            asked = f"{counted(draws, 'base sample')} of {len(results.drawn) + 2} cases"
        facts = (("Draws", asked), ("Method", words.get(method, method)))
        yield Facts((*facts, ("Seed", f"{given.get('seed', '–')}")))
    yield listed_texts(_method_words(results))


def _method_words(results: Results) -> Iterator[str]:
    """How the numbers were made."""
    yield (
        f"Numbers are over the {results.case_noun}s that are done and have the value; the others "
        "are counted beside them."
    )
    if len(results.cells) > 1:
        yield (
            "Cells are paired: a draw has the same seed and the same drawn parameters in every "
            "cell, so that cells differ by their grid parameters alone."
        )
    yield (
        "Shares: exact intervals by Clopper and Pearson (1934). A verdict other than "
        "consistent is by the 99 % interval; one test in a hundred gives it by chance."
    )
    yield (
        "Means: Student's interval. Quantiles: exact, interpolated between order statistics; "
        "their intervals are order statistics by the binomial distribution, which need no "
        "assumption on the distribution of the values."
    )
    if any(cell["consistency"] for cell in results.cells):
        yield (
            "Consistency: the sum of the normalized errors squared is chi-square, with the "
            "degrees of freedom of all cases together, if the errors are normal and the stated "
            "variances right."
        )
    method = (results.frozen.get("cases") or {}).get("method")
    if method in ("latin", "sobol"):
        yield (
            "The draws fill the space of the parameters more evenly than independent ones; the "
            "intervals take them as independent and are too wide rather than too narrow."
        )
    if method == "sensitivity":
        yield (
            "Sobol indices: first order by Saltelli and others (2010), total by Jansen (1999). "
            "Intervals by a bootstrap over base samples. An index may be slightly negative by "
            "chance."
        )
    if stop := results.frozen.get("stop") or {}:
        yield (
            f"The number of cases was not fixed: a cell ended when half the width of its "
            f"interval was {stop.get('half_width')} or less. Such an interval contains the "
            "truth slightly less often than 95 %."
        )


def _distribution(one: Mapping[str, Any]) -> str:
    """Values or distribution of a parameter."""
    if not one.get("draw"):
        return listed(one["values"]) if one.get("values") else "from the table of cases"
    known = ("name", "key", "draw", "values")
    parts = [f"of {listed(one['values'])}"] if one.get("values") else []
    parts += [
        f"{key.replace('_', ' ')} {listed(value)}"
        for key, value in one.items()
        if key not in known and value is not None
    ]
    words = str(one["draw"]).replace("-", " ")
    return f"{words}: {', '.join(parts)}" if parts else words
