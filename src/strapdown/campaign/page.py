"""The page of a campaign: answers first, then results over the grid, distributions and method."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from strapdown import __version__
from strapdown.campaign.summary import DECADES
from strapdown.report.chart import (
    BLACK,
    BLUE,
    ORANGE,
    VERMILLION,
    Array,
    Bars,
    Chart,
    Fill,
    Level,
    Line,
    Mark,
    Panel,
    kept_rows,
    look,
)
from strapdown.report.document import (
    Block,
    Document,
    Facts,
    Items,
    KeyFigure,
    KeyFigures,
    Paragraph,
    TableBlock,
    capital,
    section,
)
from strapdown.report.values import GAP, MINUS, decimals, plain, share_words
from strapdown.units import named_unit

__all__ = ["campaign_document"]

#: Rows of a table, categories of a chart, lines of a panel, and panels of a chart, at most.
ROWS, CATEGORIES, LINES, PANELS = 100, 40, 6, 6
#: Values of which a histogram is drawn, at least.
LEAST = 20
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
_ACRONYMS = ("nees", "nis", "rms", "gnss", "imu")
_STATUS_WORDS = {
    "refused": "refused (input or configuration)",
    "diverged": "diverged",
    "failed": "failed",
    "crashed": "process ended",
    "hung": "time limit",
    "memory": "memory limit",
}


def campaign_document(frozen: Mapping[str, Any], summary: Mapping[str, Any], name: str) -> Document:
    """Return the page of a campaign.

    Parameters
    ----------
    frozen : mapping
        Content of ``campaign.json``.
    summary : mapping
        From `summarise`, or read from its JSON.
    name : str
        Folder of the campaign, for the commands on the page.
    """
    page = _Page(frozen, summary, name)
    sections = [
        section("grid", "Results over the grid", *page.over_grid()),
        section("coverage", "Coverage, rates and consistency", *page.tests()),
        section("fleet", "Logs", *page.fleet()),
        section("curves", "Curves", *page.curve_charts()),
        section("sensitivity", "Sensitivity", *page.sensitivity()),
        section("distributions", "Distributions", *page.distributions()),
        section("failures", "Failures and findings", *page.failures()),
        section("outliers", "Outliers", *page.outliers(), folded=not page.is_fleet),
        section("tables", "All statistics", *page.tables(), folded=True),
        section("method", "Method", *page.method(), folded=True),
    ]
    return Document(
        str(frozen.get("title") or name),
        "Campaign",
        (
            ("Cases", page.cases_words),
            ("Each case", f"strapdown {(frozen.get('base') or {}).get('kind', '')}"),
            ("Software", f"strapdown {__version__}"),
        ),
        tuple(page.front()),
        tuple(sections),
        links=(
            ("summary.json", "every statistic"),
            ("campaign.json", "the campaign as it was run"),
        ),
    )


# Numbers and names.


def _label(name: str) -> str:
    """Name of a scalar with its unit: ``end error, m``."""
    words, unit = _words(name)
    return f"{words}, {unit}" if unit else words


def _words(name: str) -> tuple[str, str]:
    """Name of a scalar in words, and its unit."""
    words, unit = named_unit(name)
    return " ".join(w.upper() if w in _ACRONYMS else w for w in words.split()), unit


def _number(value: Any) -> float:
    return math.nan if value is None else float(value)


def _shown(value: Any, half: float = math.nan) -> str:
    """A number, rounded by the half width of its interval if it has one, else to three digits."""
    number = _number(value)
    if not math.isfinite(number):
        return "–"
    size = abs(half) if math.isfinite(half) and half else abs(number)
    if number and (abs(number) < 1e-4 or abs(number) >= 1e7):
        mantissa, _, power = f"{number:.2e}".partition("e")
        return f"{plain(float(mantissa), 2)}e{plain(int(power), 0)}"
    digits = 2 if math.isfinite(half) and half else 3
    return plain(number, decimals(size, digits)) if size else "0"


def _between(value: Any, low: Any, high: Any) -> str:
    """A number with its interval: ``3.14 (2.91 to 3.40)``."""
    ends = _number(low), _number(high)
    half = 0.5 * (ends[1] - ends[0])
    if not math.isfinite(half):
        return _shown(value)
    return f"{_shown(value, half)} ({_shown(low, half)} to {_shown(high, half)})"


def _percent(share: Mapping[str, Any]) -> str:
    """The 95 % interval of a share: ``93.1 to 95.8 %``."""
    low, high = 100.0 * _number(share["low"]), 100.0 * _number(share["high"])
    # Of many cases a small share has more decimals.
    places = min(decimals(part, 2, least=1, most=4) for part in (high, 100.0 - low) if part > 0.0)
    return f"{plain(low, places)} to {plain(high, places)}{GAP}%"


def _share(share: Mapping[str, Any]) -> str:
    """A share with its interval."""
    if not share["of"]:
        return "–"
    return f"{share_words(_number(share['share']))} ({_percent(share)})"


def _count(number: int, noun: str) -> str:
    return f"{number:,}{GAP}{noun}{'' if number == 1 else 's'}"


def _numbers(cases: Sequence[int], count: int) -> str:
    """Numbers of cases; the first of more than are listed."""
    more = f" and {count - len(cases):,} more" if count > len(cases) else ""
    return ", ".join(map(str, cases)) + more


def _decades(values: Sequence[float]) -> bool:
    """Whether positive values span so much that a logarithmic axis shows them better."""
    there = [v for v in values if math.isfinite(v)]
    return bool(there) and min(there) > 0.0 and max(there) > DECADES * min(there)


def _quantile(scalar: Mapping[str, Any], level: float) -> Mapping[str, Any]:
    return next(one for one in scalar["quantiles"] if one["level"] == level)


def _steps(edges: Array, counts: Array) -> tuple[Array, Array]:
    """Outline of a histogram."""
    return np.repeat(edges, 2)[1:-1], np.repeat(counts, 2).astype(np.float64)


@dataclass(frozen=True)
class _Page:
    """Blocks of the page."""

    frozen: Mapping[str, Any]
    summary: Mapping[str, Any]
    name: str

    @cached_property
    def cells(self) -> list[Mapping[str, Any]]:
        """Summaries of the cells with cases."""
        return [
            {**one, "parameters": {k: _word(v) for k, v in one["parameters"].items()}}
            for one in self.summary["cells"]
            if one["count"]
        ]

    @cached_property
    def is_fleet(self) -> bool:
        """Whether a case is a log."""
        return "logs" in self.summary

    @cached_property
    def case_noun(self) -> str:
        """Name of a case."""
        alone = self.is_fleet and (self.frozen.get("cases") or {}).get("draws", 1) == 1
        return "log" if alone and len(self.cells) < 2 else "case"

    @cached_property
    def scalars(self) -> list[str]:
        """Names of the scalars."""
        return list(self.cells[0]["scalars"]) if self.cells else []

    @cached_property
    def grid(self) -> dict[str, list[Any]]:
        """Values of each grid parameter that varies, in order of the cells."""
        if not self.cells:
            return {}
        values = {
            key: list(dict.fromkeys(cell["parameters"][key] for cell in self.cells))
            for key in self.cells[0]["parameters"]
        }
        return {key: found for key, found in values.items() if len(found) > 1}

    def unit(self, parameter: str) -> str:
        """Unit of a parameter."""
        keys = [
            str(one.get("key", ""))
            for one in self.frozen.get("parameters") or ()
            if one["name"] == parameter
        ]
        return next(filter(None, (named_unit(one)[1] for one in (parameter, *keys))), "")

    def parameter(self, name: str) -> str:
        """Name of a parameter with its unit."""
        words, unit = named_unit(name)[0], self.unit(name)
        return f"{words}, {unit}" if unit else words

    def value(self, name: str, value: Any) -> str:
        """A value of a parameter with its name, or alone if it is a word."""
        if isinstance(value, str):
            return value
        unit = self.unit(name)
        return f"{named_unit(name)[0]} {value:g}{f'{GAP}{unit}' if unit else ''}"

    def cell_name(self, cell: Mapping[str, Any], without: Sequence[str] = ()) -> str:
        """Name of a cell by the parameters that vary."""
        own = cell["parameters"]
        names = [self.value(key, own[key]) for key in self.grid if key not in without]
        return ", ".join(names) or "all"

    @cached_property
    def cases_words(self) -> str:
        """How many cases there are."""
        run, planned = self.summary["cases"]["run"], self.summary["cases"]["planned"]
        words = _count(run, self.case_noun)
        if planned and planned != run:
            words += f" of {planned:,} planned"
        if len(self.cells) > 1:
            words += f" in {len(self.cells)} cells"
        return words

    # Page one.

    def front(self) -> Iterator[Block]:
        """Answers: coverages, rates, consistency and failures."""
        failure = self.summary["failure"]
        done = failure["of"] - failure["hits"]
        text = f"{self.cases_words}: {done:,} done"
        if failure["hits"]:
            text += f", {failure['hits']:,} not: {_share(failure)}"
        bad = failure["hits"] or any(
            one["verdict"] not in ("consistent", None)
            for cell in self.cells
            for one in (*cell["coverage"], *cell["consistency"])
        )
        yield Paragraph(f"{capital(text)}.", "warning" if bad else "lead")
        if not self.cells:
            return
        if len(self.cells) == 1:
            figures = tuple(self.key_figures(self.cells[0])) or tuple(self.usual(self.cells[0]))
            if figures:
                yield KeyFigures(figures)
            return
        if rows := tuple(self.answers()):
            yield Items(rows)
        yield from self.cell_table()

    def key_figures(self, cell: Mapping[str, Any]) -> Iterator[KeyFigure]:
        """Answers of the only cell."""
        for one in cell["coverage"]:
            verdict = self.verdict(one)
            bound = f"95{GAP}% interval {_percent(one)}"
            yield KeyFigure(
                f"{one['name']}: errors within the bound",
                share_words(_number(one["share"])),
                bound,
                self.of_words(one, verdict),
            )
        for one in cell["rates"]:
            yield KeyFigure(
                f"{one['name']}: {self.limit_words(one)}",
                share_words(_number(one["share"])),
                f"95{GAP}% interval {_percent(one)}",
                self.of_words(one, ""),
            )
        for one in cell["consistency"]:
            ends = f"{_shown(one['low'], 0.1)} to {_shown(one['high'], 0.1)}"
            yield KeyFigure(
                f"{one['name']}: mean normalized error squared",
                _shown(one["mean"]),
                f"expected {one['dof']:g}; 95{GAP}% within {ends} if consistent",
                self.of_words(one, _VARIANCE_WORDS.get(one["verdict"], "")),
            )

    def usual(self, cell: Mapping[str, Any]) -> Iterator[KeyFigure]:
        """Medians of the first scalars, where nothing else is asked of the only cell."""
        for name in self.scalars[:4]:
            (words, unit), one = _words(name), cell["scalars"][name]
            low, middle, high = (_quantile(one, p) for p in (0.05, 0.5, 0.95))
            half = 0.5 * (_number(middle["high"]) - _number(middle["low"]))
            of = unit and f"{GAP}{unit}"
            rows = (cell["sensitivity"].get(name) or {}).get("parameters", ())
            rows = [row for row in rows if row["total"] is not None]
            note = self.of_words(one, "")
            if rows:
                top = max(rows, key=lambda row: _number(row["total"]))
                share = _between(top["total"], top["total_low"], top["total_high"])
                note = f"Most sensitive to {named_unit(top['parameter'])[0]}: total index {share}"
            yield KeyFigure(
                f"{words}, median",
                f"{_shown(middle['value'], half)}{of}",
                f"5 to 95{GAP}% of the {self.case_noun}s: {_shown(low['value'])} to "
                f"{_shown(high['value'])}{of}",
                note,
            )

    def of_words(self, one: Mapping[str, Any], verdict: str) -> str:
        """Verdict, and of how many cases a number is."""
        of = one["of"] if "of" in one else one["count"]
        words = f"of {_count(of, self.case_noun)}"
        if one["missing"]:
            words += f"; {one['missing']:,} without the value"
        return f"{capital(verdict)}; {words}" if verdict else capital(words)

    def verdict(self, one: Mapping[str, Any]) -> str:
        """Verdict on a coverage in words."""
        expected = f"{100.0 * one['expected']:g}{GAP}%"
        return _BOUND_WORDS.get(one["verdict"], "").format(expected)

    def limit_words(self, one: Mapping[str, Any]) -> str:
        """The condition of a rate: ``end error above 10 m``."""
        words, unit = named_unit(one["scalar"])
        parts = [
            f"{side} {one[side]:g}{f'{GAP}{unit}' if unit else ''}"
            for side in ("above", "below")
            if one[side] is not None
        ]
        return f"{words} {' and '.join(parts)}"

    def answers(self) -> Iterator[tuple[str, str]]:
        """A sentence for each coverage, rate and consistency over the cells of a grid."""
        for kind in ("coverage", "consistency"):
            for k, first in enumerate(self.cells[0][kind]):
                groups: dict[str, list[Mapping[str, Any]]] = {}
                for cell in self.cells:
                    groups.setdefault(cell[kind][k]["verdict"] or "", []).append(cell)
                parts = []
                for verdict in ("consistent", "optimistic", "pessimistic"):
                    cells = groups.get(verdict, [])
                    if not cells:
                        continue
                    one = {**first, "verdict": verdict}
                    words = self.verdict(one) if kind == "coverage" else _VARIANCE_WORDS[verdict]
                    listed = "" if verdict == "consistent" else f" ({self.listed(cells)})"
                    parts.append(f"{words} in {len(cells)} of {len(self.cells)} cells{listed}")
                yield first["name"], f"{capital('; '.join(parts))}."
        for k, first in enumerate(self.cells[0]["rates"]):
            shares = [(_number(c["rates"][k]["share"]), i) for i, c in enumerate(self.cells)]
            shares = [one for one in shares if math.isfinite(one[0])]
            if not shares:
                continue
            (low, a), (high, b) = min(shares), max(shares)
            text = f"{capital(self.limit_words(first))}: from {share_words(low)}"
            text += f" ({self.cell_name(self.cells[a])})"
            text += f" to {share_words(high)} ({self.cell_name(self.cells[b])})."
            yield first["name"], text

    def listed(self, cells: Sequence[Mapping[str, Any]]) -> str:
        """Names of the first cells, or the one value that all of them and no others have."""
        for key, values in self.grid.items():
            for value in values:
                own = [cell for cell in self.cells if cell["parameters"][key] == value]
                if len(own) > 1 and own == list(cells):
                    return self.value(key, value)
        names = [self.cell_name(cell) for cell in cells]
        more = f"; and {len(names) - 4} more" if len(names) > 5 else ""
        return "; ".join(names[:4] if more else names) + more

    def cell_rows(self, columns: Sequence[Sequence[str]]) -> tuple[tuple[str, ...], ...]:
        """Rows of a table: the parameters of each cell, then its columns."""
        rows = []
        for cell, own in zip(self.cells[:ROWS], columns, strict=False):
            values = [cell["parameters"][key] for key in self.grid]
            rows.append((*(v if isinstance(v, str) else f"{v:g}" for v in values), *own))
        return tuple(rows)

    def cell_columns(self) -> tuple[tuple[str, ...], tuple[int, ...]]:
        """Names of the parameter columns, and which of them are words."""
        words = tuple(k for k, v in enumerate(self.grid.values()) if isinstance(v[0], str))
        return tuple(self.parameter(key) for key in self.grid), words

    def rest(self) -> str:
        """Note on cells beyond the table."""
        more = len(self.cells) - ROWS
        return f" {more} more cells are in summary.json." if more > 0 else ""

    def cell_table(self) -> Iterator[Block]:
        """Coverage and rates, and the failures, of each cell."""
        first = self.cells[0]
        names = [f"{one['name']}, within the bound" for one in first["coverage"]]
        names += [one["name"] for one in first["rates"]]
        columns = [
            [_share(one) for one in (*cell["coverage"], *cell["rates"])] + [self.failed(cell)]
            for cell in self.cells
        ]
        own, words = self.cell_columns()
        passed = frozenset(
            (r, len(own) + k)
            for r, cell in enumerate(self.cells[:ROWS])
            for k, one in enumerate(cell["coverage"])
            if one["verdict"] == "consistent"
        )
        caption = f"Shares of cases with 95{GAP}% intervals."
        if passed:
            caption += f" Marked: the expected share is in the 99{GAP}% interval."
        yield TableBlock(
            (*own, *names, "not done"),
            self.cell_rows(columns),
            text=words,
            caption=caption + self.rest(),
            passed=passed,
        )

    def failed(self, cell: Mapping[str, Any]) -> str:
        """How many cases of a cell are not done."""
        return f"{cell['failure']['hits']} of {cell['failure']['of']}"

    # Charts.

    def layout(
        self, axis: str | None
    ) -> list[tuple[str, list[tuple[str, list[Mapping[str, Any]]]]]]:
        """Panels of cells, with lines of cells along the `axis`, a grid parameter or none.

        Empty if there are too many lines or panels.
        """
        rest = [key for key in self.grid if key != axis]

        def by(keys: Sequence[str], cells: Sequence[Mapping[str, Any]]) -> dict[Any, Any]:
            groups: dict[Any, list[Mapping[str, Any]]] = {}
            for cell in cells:
                groups.setdefault(tuple(cell["parameters"][key] for key in keys), []).append(cell)
            return groups

        for panel_keys in ([], sorted(rest, key=lambda key: len(self.grid[key]))[:1]):
            line_keys = [key for key in rest if key not in panel_keys]
            others = [key for key in self.grid if key not in line_keys]
            panels = by(panel_keys, self.cells)
            drawn = []
            for cells in panels.values():
                lines = [
                    (self.cell_name(own[0], others) if line_keys else "", own)
                    for own in by(line_keys, cells).values()
                ]
                off = [key for key in self.grid if key not in panel_keys]
                drawn.append((self.cell_name(cells[0], off) if panel_keys else "", lines))
            if len(drawn) <= PANELS and max(len(lines) for _, lines in drawn) <= LINES:
                return drawn
        return []

    def over_grid(self) -> Iterator[Block]:
        """A chart of each scalar over the cells."""
        if len(self.cells) < 2:
            return
        numeric = [k for k, v in self.grid.items() if all(_is_number(one) for one in v)]
        axis = max(numeric, key=lambda key: len(self.grid[key]), default=None)
        layout = self.layout(axis) if axis is not None else []
        for name in self.scalars:
            if layout and axis is not None:
                yield self.axis_chart(name, axis, layout)
            elif len(self.cells) <= CATEGORIES:
                yield self.category_chart(name)

    def axis_chart(self, name: str, axis: str, layout: Any) -> Chart:
        """Median and 5 to 95 % of a scalar over a numeric grid parameter."""
        panels, ends = [], []
        for title, lines in layout:
            fills, drawn = [], []
            for k, (line, cells) in enumerate(lines):
                ordered = sorted(cells, key=lambda cell: cell["parameters"][axis])
                x = np.array([float(cell["parameters"][axis]) for cell in ordered])
                low, middle, high = (
                    np.array([_number(_quantile(c["scalars"][name], p)["value"]) for c in ordered])
                    for p in (0.05, 0.5, 0.95)
                )
                style = look(k)
                label = line or "median"
                drawn.append(
                    Line(
                        label,
                        x,
                        middle,
                        style["colour"],
                        style["dash"],
                        dots=True,
                        symbol=style["symbol"],
                        size=7.0,
                    )
                )
                fills.append(Fill(label, x, low, high, style["colour"], 0.14, legend=False))
                ends += [*low.tolist(), *high.tolist()]
            panels.append((title, tuple(drawn), tuple(fills)))
        log = _decades(ends)
        made = tuple(
            Panel(_label(name), lines, log=log, title=title, fills=fills)
            for title, lines, fills in panels
        )
        values = [float(v) for v in self.grid[axis]]
        return Chart(
            f"grid-{name}",
            capital(named_unit(name)[0]),
            f"Line: median of the cases of a cell. Band: 5 to 95{GAP}% of the cases.",
            self.parameter(axis),
            made,
            log_x=min(values) > 0.0 and max(values) >= 10.0 * min(values),
        )

    def category_chart(self, name: str) -> Chart:
        """Median and 5 to 95 % of a scalar of each cell, one below the other."""
        scalars = [cell["scalars"][name] for cell in self.cells]
        low, middle, high = (
            np.array([_number(_quantile(one, p)["value"]) for one in scalars])
            for p in (0.05, 0.5, 0.95)
        )
        at = np.arange(len(self.cells), dtype=np.float64)
        line = Line(
            "median, and 5 to 95 %",
            middle,
            at,
            BLUE,
            points=True,
            symbol="circle",
            low=low,
            high=high,
        )
        names = tuple(self.cell_name(cell) for cell in self.cells)
        return Chart(
            f"grid-{name}",
            capital(named_unit(name)[0]),
            f"Point: median of the cases of a cell. Bar: 5 to 95{GAP}% of the cases.",
            _label(name),
            (Panel("", (line,), categories=names),),
            log_x=_decades([*low.tolist(), *high.tolist()]),
        )

    def curve_charts(self) -> Iterator[Block]:
        """Median and 5 to 95 % of each curve along its axis."""
        if not self.cells or not self.cells[0]["curves"]:
            return
        x = np.array(self.summary["x"], dtype=np.float64)
        layout = self.layout(None)
        if not layout:
            # Of many cells the first ones along the grid.
            lines = [(self.cell_name(cell), [cell]) for cell in self.cells[:LINES]]
            layout = [("", lines)]
        shown = sum(len(lines) for _, lines in layout)
        for name in self.cells[0]["curves"]:
            panels = []
            for title, lines in layout:
                fills, drawn = [], []
                for k, (line, (cell, *_)) in enumerate(lines):
                    curve = cell["curves"][name]
                    low, middle, high = (
                        np.array([_number(v) for v in curve[key]])
                        for key in ("low", "median", "high")
                    )
                    rows = kept_rows((low, middle, high), 150)
                    style = look(k) if len(lines) > 1 else {"colour": BLUE, "dash": "solid"}
                    label = line if len(lines) > 1 else "median"
                    drawn.append(Line(label, x[rows], middle[rows], style["colour"], style["dash"]))
                    fills.append(
                        Fill(label, x[rows], low[rows], high[rows], style["colour"], 0.14, False)
                    )
                panels.append(Panel(_label(name), tuple(drawn), title=title, fills=tuple(fills)))
            caption = (
                f"Line: median over the {self.case_noun}s. Band: 5 to 95{GAP}%, at each point."
            )
            if shown < len(self.cells):
                caption += f" The first {shown} of {len(self.cells)} cells."
            words = capital(named_unit(name)[0])
            yield Chart(f"curve-{name}", words, caption, self.axis_label, tuple(panels))

    @cached_property
    def axis_label(self) -> str:
        """Name of the axis of the curves."""
        return "time from the start, s"

    def sensitivity(self) -> Iterator[Block]:
        """Sobol indices of each scalar as bars."""
        for cell in self.cells[:PANELS]:
            for name, found in cell["sensitivity"].items():
                rows = found["parameters"]
                if all(one["total"] is None for one in rows):
                    continue
                yield self.sobol_chart(cell, name, found, rows)

    def sobol_chart(
        self, cell: Mapping[str, Any], name: str, found: Mapping[str, Any], rows: Any
    ) -> Chart:
        """First order and total indices of one scalar, largest total first."""
        rows = sorted(rows, key=lambda one: -_number(one["total"]))
        at = np.arange(len(rows), dtype=np.float64)
        bars, lines = [], []
        for kind, words, off, colour in (
            ("total", "total", -0.2, ORANGE),
            ("first", "first order", 0.2, BLUE),
        ):
            value, low, high = (
                np.array([_number(one[f"{kind}{end}"]) for one in rows])
                for end in ("", "_low", "_high")
            )
            pattern = "/" if kind == "total" else ""
            bars.append(Bars(words, at + off, value, colour, width=0.36, pattern=pattern))
            lines.append(
                Line(
                    f"{words}, interval",
                    value,
                    at + off,
                    BLACK,
                    points=True,
                    size=0.0,
                    low=low,
                    high=high,
                    legend=False,
                )
            )
        first = sum(_number(one["first"]) for one in rows)
        caption = (
            f"Share of the variance due to each parameter alone (first order, together "
            f"{_shown(first)}), and with its interactions (total), with 95{GAP}% intervals. "
            f"{_count(found['base_samples'], 'base sample')}."
        )
        if found["left_out"]:
            caption += f" {found['left_out']:,} left out, as a case of them has no value."
        where = f" ({self.cell_name(cell)})" if len(self.cells) > 1 else ""
        return Chart(
            f"sobol-{name}-{cell['cell']}",
            f"{capital(named_unit(name)[0])}{where}",
            caption,
            "Sobol index",
            (
                Panel(
                    "",
                    tuple(lines),
                    bars=tuple(bars),
                    categories=tuple(self.parameter(one["parameter"]) for one in rows),
                    height=1.0,
                ),
            ),
        )

    def distributions(self) -> Iterator[Block]:
        """Histograms of each scalar, the cells one below the other."""
        if len(self.cells) > PANELS:
            return
        limits = {one["scalar"]: one for one in (self.cells[0]["rates"] if self.cells else ())}
        for name in self.scalars:
            found = [
                (c, c["scalars"][name]["histogram"])
                for c in self.cells
                if "histogram" in c["scalars"][name] and c["scalars"][name]["count"] >= LEAST
            ]
            if not found:
                continue
            panels = []
            for k, (cell, one) in enumerate(found):
                edges = np.array(one["edges"], dtype=np.float64)
                x, y = _steps(edges, np.array(one["counts"]))
                colour = look(k)["colour"] if len(found) > 1 else BLUE
                label = self.cell_name(cell) if len(found) > 1 else ""
                panels.append(
                    Panel(
                        f"{self.case_noun}s",
                        (Line(f"{self.case_noun}s", x, y, colour, legend=False),),
                        title=label,
                        fills=(Fill("", x, 0.0 * y, y, colour, 0.35, legend=False),),
                        levels=(),
                    )
                )
            beyond = sum(one["below"] + one["above"] for _, one in found)
            steps = "ratio" if all(one["log"] for _, one in found) else "width"
            caption = f"{capital(self.case_noun)}s by value, in steps of equal {steps}."
            if beyond:
                caption += f" {_count(beyond, self.case_noun)} beyond the axis, far out."
            marks = []
            if len(found) == 1:
                scalar = self.cells[0]["scalars"][name]
                for level, words in ((0.05, "5 %"), (0.5, "median"), (0.95, "95 %")):
                    marks.append(Mark(_number(_quantile(scalar, level)["value"]), words))
            if name in limits:
                limit = limits[name]
                marks += [
                    Mark(float(limit[side]), f"{side} {limit[side]:g}")
                    for side in ("above", "below")
                    if limit[side] is not None
                ]
            low, high = found[0][1]["edges"][0], found[0][1]["edges"][-1]
            log = all(one["log"] for _, one in found) or (
                len(found) > 1
                and _decades([e for _, one in found for e in (one["edges"][0], one["edges"][-1])])
            )
            if len(found) == 1:
                marks = [mark for mark in marks if low <= mark.x <= high]
            yield Chart(
                f"distribution-{name}",
                capital(named_unit(name)[0]),
                caption,
                _label(name),
                tuple(panels),
                marks=tuple(marks),
                log_x=log,
            )

    def fleet(self) -> Iterator[Block]:
        """Each scalar over the logs, one panel below the other."""
        if not self.is_fleet or not self.cells:
            return
        logs = self.summary["logs"]
        x = np.array([one["draw"] for one in logs], dtype=np.float64)
        cell = np.array([one["cell"] for one in logs])
        for start in range(0, len(self.scalars), 4):
            panels = tuple(
                self.fleet_panel(
                    name, x, cell, np.array([_number(one["scalars"][name]) for one in logs])
                )
                for name in self.scalars[start : start + 4]
            )
            caption = "Each point is a log; one without a value has none."
            if len(logs) < self.summary["cases"]["run"]:
                caption += f" The first {len(logs)} of {self.summary['cases']['run']:,} cases."
            yield Chart(
                f"logs-{start // 4}", "Logs beside each other", caption, "number of the log", panels
            )

    def fleet_panel(self, name: str, x: Array, cell: Array, y: Array) -> Panel:
        """A scalar over the logs; of several cells each has its color."""
        scalars = [one["scalars"][name] for one in self.cells]
        kinds = []
        if len(self.cells) > 1:
            for k, one in enumerate(self.cells[: 2 * LINES]):
                style = look(k)
                own = cell == one["cell"]
                kinds.append((self.cell_name(one), own, style["colour"], style["symbol"]))
        else:
            fences = scalars[0].get("outliers") or {"low_fence": -math.inf, "high_fence": math.inf}
            far = (y < fences["low_fence"]) | (y > fences["high_fence"])
            kinds.append(("log", ~far, BLUE, "circle"))
            kinds.append(("far out", far, VERMILLION, "diamond"))
        ends = [_number(_quantile(one, p)["value"]) for one in scalars for p in (0.025, 0.975)]
        log = _decades(ends) and min(_number(one["minimum"]) for one in scalars) > 0.0
        lines = tuple(
            Line(words, x[own], y[own], colour, points=True, symbol=symbol, size=4.0)
            for words, own, colour, symbol in kinds
            if np.isfinite(y[own]).any()
        )
        middle = _number(_quantile(scalars[0], 0.5)["value"])
        shown = len(self.cells) < 2 and math.isfinite(middle)
        levels = (Level(middle, "median"),) if shown else ()
        return Panel(_label(name), lines, log=log, levels=levels)

    # Tables.

    def tests(self) -> Iterator[Block]:
        """Coverages and consistencies with their verdicts, one row a cell."""
        for k, first in enumerate(self.cells[0]["coverage"] if self.cells else ()):
            rows = []
            for cell in self.cells:
                one = cell["coverage"][k]
                ends = _percent({"low": one["low_99"], "high": one["high_99"]})
                rows.append([f"{one['of']:,}", _share(one), ends, self.verdict(one)])
            own, words = self.cell_columns()
            yield TableBlock(
                (*own, "of", "within the bound", f"99{GAP}% interval", "verdict"),
                self.cell_rows(rows),
                text=(*words, len(own) + 3),
                title=(
                    f"{capital(first['name'])}: {_label(first['error'])}, within "
                    f"{_label(first['bound'])}"
                ),
            )
        for k, first in enumerate(self.cells[0]["consistency"] if self.cells else ()):
            rows = []
            for cell in self.cells:
                one = cell["consistency"][k]
                half = 0.5 * (_number(one["high"]) - _number(one["low"]))
                ends = f"{_shown(one['low'], half)} to {_shown(one['high'], half)}"
                rows.append(
                    [
                        str(one["count"]),
                        _shown(one["mean"], half),
                        ends,
                        _share(one["inside"]),
                        _VARIANCE_WORDS.get(one["verdict"], "–"),
                    ]
                )
            own, words = self.cell_columns()
            yield TableBlock(
                (
                    *own,
                    "of",
                    "mean",
                    f"95{GAP}% if consistent",
                    "inside the 95 % quantile",
                    "verdict",
                ),
                self.cell_rows(rows),
                text=(*words, len(own) + 4),
                title=(
                    f"{capital(first['name'])}: normalized error squared, {first['dof']:g} degrees "
                    "of freedom"
                ),
                caption=(
                    "The mean of a consistent filter is the number of degrees of freedom. The "
                    f"verdict is by its 99{GAP}% interval.{self.rest()}"
                ),
            )

    def failures(self) -> Iterator[Block]:
        """What failed, what was found, and how a case is repeated."""
        errors, findings = self.summary["errors"], self.summary["findings"]
        noun = self.case_noun
        if errors:
            rows = [
                (
                    _STATUS_WORDS.get(one["status"], one["status"]),
                    one["code"] or "–",
                    f"{one['count']:,}",
                    self.examples(one, one["count"]),
                )
                for one in errors[:ROWS]
            ]
            yield TableBlock(
                ("state", "code", f"{noun}s", "which"),
                tuple(rows),
                text=(0, 1, 3),
                title=f"{capital(noun)}s that are not done",
                caption=f"In all {_share(self.summary['failure'])} with the 95{GAP}% interval.",
            )
        elif self.summary["count"]:
            yield Paragraph(
                f"Every {noun} is done; the 95{GAP}% interval of the share of failures is "
                f"{_percent(self.summary['failure'])}."
            )
        if findings:
            rows = [
                (one["code"], f"{one['hits']:,}", _share(one), self.examples(one, one["hits"]))
                for one in findings[:ROWS]
            ]
            yield TableBlock(
                ("finding", f"{noun}s", f"share, with its 95{GAP}% interval", "which"),
                tuple(rows),
                text=(0, 3),
                title="Findings of the results",
            )
        if self.summary["count"]:
            yield Paragraph("To repeat one of them with its whole report:")
            first = errors[0]["cases"][0] if errors else 0
            yield Paragraph(f"strapdown campaign case {self.name} {first}", "mono")

    def examples(self, one: Mapping[str, Any], count: int) -> str:
        """Numbers of cases, or logs with their numbers."""
        if "logs" not in one:
            return _numbers(one["cases"], count)
        names = [f"{log} ({case})" for case, log in zip(one["cases"], one["logs"], strict=True)]
        more = f" and {count - len(names):,} more" if count > len(names) else ""
        return ", ".join(names) + more

    def outliers(self) -> Iterator[Block]:
        """Cases far beyond the quartiles."""
        rows: list[tuple[str, ...]] = []
        many = len(self.cells) > 1
        total = 0
        for name in self.scalars:
            for cell in self.cells:
                found = cell["scalars"][name].get("outliers")
                if not found:
                    continue
                total += found["below"] + found["above"]
                for one in found["worst"][: 3 if many else None]:
                    what = f"{one['log']} ({one['case']})" if "log" in one else str(one["case"])
                    where = (self.cell_name(cell),) if many else ()
                    usual = (
                        f"{_shown(_quantile(cell['scalars'][name], 0.25)['value'])} to "
                        f"{_shown(_quantile(cell['scalars'][name], 0.75)['value'])}"
                    )
                    rows.append((_label(name), *where, what, _shown(one["value"]), usual))
        if not rows:
            return
        columns = ("scalar", *(("cell",) if many else ()), self.case_noun, "value", "quartiles")
        caption = (
            "Values beyond the quartiles by more than three times the distance between them, the "
            f"farthest {'three of each cell' if many else 'ten of each scalar'}; in all {total:,}."
        )
        if len(rows) > ROWS:
            caption += f" {len(rows) - ROWS} more rows are in summary.json."
        text = (0, 1, 2) if many else (0, 1)
        yield TableBlock(columns, tuple(rows[:ROWS]), text=text, caption=caption)

    def tables(self) -> Iterator[Block]:
        """Statistics of every scalar, one row a cell."""
        for name in self.scalars:
            rows = []
            for cell in self.cells:
                one = cell["scalars"][name]
                low, middle, high = (_quantile(one, p) for p in (0.05, 0.5, 0.95))
                spread = 0.5 * (_number(one["mean_high"]) - _number(one["mean_low"]))
                rows.append(
                    [
                        f"{one['count']:,}",
                        _between(one["mean"], one["mean_low"], one["mean_high"]),
                        _shown(one["sd"]),
                        _shown(low["value"], spread),
                        _between(middle["value"], middle["low"], middle["high"]),
                        _between(high["value"], high["low"], high["high"]),
                        f"{_shown(one['minimum'])} ({one['minimum_case']})"
                        if one["count"]
                        else "–",
                        f"{_shown(one['maximum'])} ({one['maximum_case']})"
                        if one["count"]
                        else "–",
                    ]
                )
            own, words = self.cell_columns()
            columns = ("of", "mean", "sd", "5 %", "median", "95 %", "least", "greatest")
            missing = sum(cell["scalars"][name]["missing"] for cell in self.cells)
            caption = f"In brackets 95{GAP}% intervals, and the {self.case_noun} of an extreme."
            if missing:
                caption += f" Without the value: {_count(missing, self.case_noun)}."
            yield TableBlock(
                (*own, *columns),
                self.cell_rows(rows),
                text=words,
                title=capital(_label(name)),
                caption=caption + self.rest(),
            )

    def method(self) -> Iterator[Block]:
        """What varied, and how the intervals are made."""
        rows = [
            (one["name"], one.get("key", ""), self.unit(one["name"]) or "–", _distribution(one))
            for one in self.frozen.get("parameters") or ()
        ]
        if rows:
            yield TableBlock(
                ("parameter", "key", "unit", "values"),
                tuple(rows),
                (0, 1, 2, 3),
                title="Parameters",
            )
        given = self.frozen.get("cases") or {}
        if given:
            words = {
                "random": "independent draws",
                "latin": "Latin hypercube",
                "sobol": "scrambled Sobol sequence",
                "sensitivity": "Saltelli's design",
                "list": "list",
            }
            method = str(given.get("method", "random"))
            yield Facts(
                (
                    ("Draws", self.draws_words(given)),
                    ("Method", words.get(method, method)),
                    ("Seed", f"{given.get('seed', '–')}"),
                )
            )
        yield Items(tuple(("", text) for text in self.method_words()))

    def draws_words(self, given: Mapping[str, Any]) -> str:
        """How many draws were asked."""
        number = int(given.get("draws", 1))
        if given.get("method") == "sensitivity":
            return f"{_count(number, 'base sample')} of {len(self.drawn) + 2} cases"
        return f"{number:,} in each cell{' and of each log' if self.is_fleet else ''}"

    @cached_property
    def drawn(self) -> list[str]:
        """Names of the drawn parameters."""
        given = self.frozen.get("parameters") or ()
        return [str(one["name"]) for one in given if one.get("draw")]

    def method_words(self) -> Iterator[str]:
        """How the numbers were made."""
        noun = self.case_noun
        yield (
            f"Numbers are over the {noun}s that are done and have the value; the others are "
            "counted beside them."
        )
        if len(self.cells) > 1:
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
        if any(cell["consistency"] for cell in self.cells):
            yield (
                "Consistency: the sum of the normalized errors squared is chi-square, with the "
                "degrees of freedom of all cases together, if the errors are normal and the stated "
                "variances right."
            )
        method = (self.frozen.get("cases") or {}).get("method")
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
        stop = self.frozen.get("stop") or {}
        if stop:
            yield (
                f"The number of cases was not fixed: a cell ended when half the width of its "
                f"interval was {stop.get('half_width')} or less. Such an interval contains the "
                "truth slightly less often than 95 %."
            )


def _word(value: Any) -> Any:
    """A value of a parameter as a number or a word."""
    return value if _is_number(value) or isinstance(value, str) else _listed(value)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _distribution(one: Mapping[str, Any]) -> str:
    """Values or distribution of a parameter."""
    if not one.get("draw"):
        return _listed(one["values"]) if one.get("values") else "from the table of cases"
    known = ("name", "key", "draw", "values")
    rest = ", ".join(
        f"{key.replace('_', ' ')} {_listed(value)}"
        for key, value in one.items()
        if key not in known and value is not None
    )
    words = str(one.get("draw", "")).replace("-", " ")
    if one.get("values"):
        rest = f"of {_listed(one['values'])}{', ' if rest else ''}{rest}"
    return f"{words}: {rest}" if rest else words


def _listed(value: Any) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(map(_listed, value))
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:g}".replace("-", MINUS) if _is_number(value) else str(value)
