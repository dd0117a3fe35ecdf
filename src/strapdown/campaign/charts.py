"""Charts of a campaign: scalars over the grid, curves, distributions, sensitivities, logs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from strapdown.campaign.results import (
    Cell,
    Results,
    counted,
    is_number,
    label,
    number,
    over_decades,
    quantile,
    shown,
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
from strapdown.report.document import capital
from strapdown.report.values import GAP
from strapdown.units import named_unit

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
