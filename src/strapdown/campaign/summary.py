"""Summary of a campaign: what its cases say of each cell, as plain data for programs and page."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from strapdown.campaign.statistics import (
    Extremes,
    Moments,
    Share,
    Sobol,
    Stream,
    Values,
    Whole,
    blocks,
    consistency,
    count_between,
    quantiles,
    share_of,
    student_interval,
)
from strapdown.dsp.chi_square import chi_square_quantile
from strapdown.report.report_bundle import finite
from strapdown.report.values import GAP, MINUS, decimals, plain, share_words
from strapdown.tables.checks import Array
from strapdown.units import named_unit

# --- results in words: names of cells and scalars, numbers and shares -------------------

Cell = Mapping[str, Any]

_ACRONYMS = ("nees", "nis", "rms", "gnss", "imu")


@dataclass(frozen=True)
class Results:
    """A campaign with its summary.

    Attributes
    ----------
    frozen : mapping
        Content of ``campaign.json``.
    summary : mapping
        From `summarise`, or read from its JSON.
    """

    frozen: Mapping[str, Any]
    summary: Mapping[str, Any]

    @cached_property
    def cells(self) -> list[Cell]:
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

    @cached_property
    def drawn(self) -> list[str]:
        """Names of the drawn parameters."""
        given = self.frozen.get("parameters") or ()
        return [str(one["name"]) for one in given if one.get("draw")]

    @cached_property
    def cases_words(self) -> str:
        """How many cases there are."""
        run, planned = self.summary["cases"]["run"], self.summary["cases"]["planned"]
        words = counted(run, self.case_noun)
        if planned and planned != run:
            words += f" of {planned:,} planned"
        if len(self.cells) > 1:
            words += f" in {len(self.cells)} cells"
        return words

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
        return f"{named_unit(name)[0]} {with_unit(f'{value:g}', self.unit(name))}"

    def cell_name(self, cell: Cell, without: Sequence[str] = ()) -> str:
        """Name of a cell by the parameters that vary."""
        own = cell["parameters"]
        names = [self.value(key, own[key]) for key in self.grid if key not in without]
        return ", ".join(names) or "all"

    def listed_cells(self, cells: Sequence[Cell]) -> str:
        """Names of the first cells, or the one value that all these and no others have."""
        for key, values in self.grid.items():
            for value in values:
                own = [cell for cell in self.cells if cell["parameters"][key] == value]
                if len(own) > 1 and own == list(cells):
                    return self.value(key, value)
        names = [self.cell_name(cell) for cell in cells]
        more = f"; and {len(names) - 4} more" if len(names) > 5 else ""
        return "; ".join(names[:4] if more else names) + more


# Numbers and shares.


def number(value: Any) -> float:
    """A number of the summary; NaN for null."""
    return math.nan if value is None else float(value)


def shown(value: Any, half: float = math.nan) -> str:
    """A number, rounded by the half width of its interval if it has one, else to three digits."""
    own = number(value)
    if not math.isfinite(own):
        return "–"
    size = abs(half) if math.isfinite(half) and half else abs(own)
    if own and (abs(own) < 1e-4 or abs(own) >= 1e7):
        mantissa, _, power = f"{own:.2e}".partition("e")
        return f"{plain(float(mantissa), 2)}e{plain(int(power), 0)}"
    digits = 2 if math.isfinite(half) and half else 3
    return plain(own, decimals(size, digits)) if size else "0"


def between(value: Any, low: Any, high: Any) -> str:
    """A number with its interval: ``3.14 (2.91 to 3.40)``."""
    half = 0.5 * (number(high) - number(low))
    if not math.isfinite(half):
        return shown(value)
    return f"{shown(value, half)} ({shown(low, half)} to {shown(high, half)})"


def percent(low: Any, high: Any) -> str:
    """An interval of a share: ``93.1 to 95.8 %``."""
    ends = 100.0 * number(low), 100.0 * number(high)
    # Of many cases a small share has more decimals.
    sizes = (ends[1], 100.0 - ends[0])
    places = min(decimals(part, 2, least=1, most=4) for part in sizes if part > 0.0)
    return f"{plain(ends[0], places)} to {plain(ends[1], places)}{GAP}%"


def share(one: Mapping[str, Any]) -> str:
    """A share with its 95 % interval."""
    if not one["of"]:
        return "–"
    return f"{share_words(number(one['share']))} ({percent(one['low'], one['high'])})"


def counted(count: int, noun: str) -> str:
    """A number of things."""
    return f"{count:,}{GAP}{noun}{'' if count == 1 else 's'}"


def with_unit(value: str, unit: str) -> str:
    """A number with its unit, if it has one."""
    return f"{value}{GAP}{unit}" if unit else value


def quantile(scalar: Mapping[str, Any], level: float) -> Mapping[str, Any]:
    """A quantile of a scalar, with its interval."""
    return next(one for one in scalar["quantiles"] if one["level"] == level)


def over_decades(values: Sequence[float]) -> bool:
    """Whether positive values span so much that a logarithmic axis shows them better."""
    there = [v for v in values if math.isfinite(v)]
    return bool(there) and min(there) > 0.0 and max(there) > DECADES * min(there)


# Names.


def words_and_unit(name: str) -> tuple[str, str]:
    """Name of a scalar in words, and its unit."""
    words, unit = named_unit(name)
    return " ".join(w.upper() if w in _ACRONYMS else w for w in words.split()), unit


def label(name: str) -> str:
    """Name of a scalar with its unit: ``end error, m``."""
    words, unit = words_and_unit(name)
    return f"{words}, {unit}" if unit else words


def listed(value: Any) -> str:
    """Values of a parameter in words."""
    if isinstance(value, list | tuple):
        return ", ".join(map(listed, value))
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:g}".replace("-", MINUS) if is_number(value) else str(value)


def is_number(value: Any) -> bool:
    """Whether a value of a parameter is a number."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def _word(value: Any) -> Any:
    """A value of a parameter as a number or a word."""
    return value if is_number(value) or isinstance(value, str) else listed(value)


#: A function that returns an iterator over batches of cases, in order of case.
Batches = Callable[[], Iterator[Any]]

#: Levels of the quantiles of scalars, and of curves.
LEVELS = (0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975)
CURVE_LEVELS = (0.05, 0.5, 0.95)
#: States of a case.
STATUSES = ("done", "refused", "diverged", "failed", "crashed", "hung", "memory")
#: Quartiles and, in interquartile ranges, how far outliers are beyond them (Tukey 1977: far out).
FAR_OUT = 3.0
#: Numbers of cases that are listed with a code; logs of a fleet that are listed with their values.
EXAMPLES, LOGS = 5, 500
#: Ratio of the 97.5 to the 2.5 % quantile from which a distribution is shown over a logarithm.
DECADES = 30.0


def summarise(
    frozen: Mapping[str, Any], cases: Batches, curves: Batches | None = None
) -> dict[str, Any]:
    """Summarise the cases of a campaign, in memory that does not grow with their number.

    Parameters
    ----------
    frozen : mapping
        Content of ``campaign.json``.
    cases, curves : callable
        Each call returns an iterator over batches, DataFrames or tables of Arrow, in order of case.

    Returns
    -------
    dict
        For JSON, with null for what does not exist. ``cases``: of how many in the plan;
        ``status``, ``failure``, ``errors`` and ``findings`` of all cases; ``x`` of the curves; for
        a fleet ``logs``, as many as are listed.
        ``cells``: for each its ``parameters``, the counts as above, ``scalars``, ``coverage``,
        ``rates``, ``consistency``, ``curves`` and, by Saltelli's design, ``sensitivity``.
    """
    plan = _Plan(frozen)
    stream = plan.stream(cases)
    tally = _Tally(plan)
    for block in blocks(cases()):
        tally.add(block)
    found = quantiles(stream, tally.moments, LEVELS)
    shapes = _Shapes(plan, tally.moments, found[0])
    for block in blocks(cases()):
        shapes.add(block)
    sensitivity = _sensitivity(plan, tally.moments, cases)
    axis, bands = _curves(plan, cases, curves) if curves and plan.curves else ([], [])
    cells = [
        {
            "cell": cell,
            "parameters": dict(parameters),
            **tally.counts(cell),
            "scalars": {
                name: _scalar(tally.moments, found, shapes, plan.group(cell, s))
                for s, name in enumerate(plan.scalars)
            },
            **tally.tests(cell),
            "curves": bands[cell] if bands else {},
            "sensitivity": sensitivity[cell] if sensitivity else {},
        }
        for cell, parameters in enumerate(plan.cells)
    ]
    fleet = {"logs": shapes.logs, "log_count": tally.cases} if tally.fleet else {}
    out = {
        "title": frozen.get("title", ""),
        "cases": {"run": tally.cases, "planned": frozen.get("total")},
        **tally.counts(None),
        "x": axis,
        "cells": cells,
        **fleet,
    }
    if tally.fleet:
        _name_logs(out, cases)
    return finite(out)


# The plan: what there is to summarise.


@dataclass(frozen=True)
class _Test:
    """A coverage, a rate or a consistency: a yes or no of each case that has its scalars."""

    kind: str
    name: str
    given: Mapping[str, Any]

    def of(self, plan: _Plan, block: pd.DataFrame) -> tuple[Any, Any]:
        """Whether each case is a hit, and whether it has the scalars."""
        given = self.given
        if self.kind == "coverage":
            error, bound = plan.columns(block, [given["error"], given["bound"]]).T
            hit = np.abs(error) <= bound
            there = ~np.isnan(error) & ~np.isnan(bound)
        else:
            (value,) = plan.columns(block, [given["scalar"]]).T
            there = ~np.isnan(value)
            if self.kind == "consistency":
                hit = value <= chi_square_quantile(0.95, given["dof"])
            else:
                above, below = given.get("above"), given.get("below")
                hit = there if above is None else value > above
                hit = hit if below is None else hit & (value < below)
        return hit & there, there


@dataclass(frozen=True)
class _Plan:
    """Names in a frozen campaign, and the columns of its cases by them."""

    frozen: Mapping[str, Any]

    @cached_property
    def scalars(self) -> tuple[str, ...]:
        """Names of the kept scalars."""
        return tuple((self.frozen.get("keep") or {}).get("scalars") or ())

    @cached_property
    def curves(self) -> tuple[str, ...]:
        """Names of the kept curves."""
        return tuple((self.frozen.get("keep") or {}).get("curves") or ())

    @cached_property
    def cells(self) -> Sequence[Mapping[str, Any]]:
        """Parameters of each cell; without a grid there is one cell."""
        return self.frozen.get("cells") or [{}]

    @cached_property
    def drawn(self) -> tuple[str, ...]:
        """Names of the drawn parameters, in order of the file."""
        given = self.frozen.get("parameters") or ()
        return tuple(one["name"] for one in given if one.get("draw"))

    @cached_property
    def tests(self) -> tuple[_Test, ...]:
        """Coverages, rates and consistencies."""
        return tuple(
            _Test(kind, one["name"], one)
            for kind in ("coverage", "rate", "consistency")
            for one in self.frozen.get(kind) or ()
        )

    def group(self, cell: int, scalar: int) -> int:
        """Number of the group of a scalar in a cell."""
        return cell * len(self.scalars) + scalar

    def number(self, block: pd.DataFrame, column: str = "case") -> Whole:
        """A column of whole numbers."""
        return block[column].to_numpy(np.int64)

    def columns(self, block: pd.DataFrame, names: Sequence[str]) -> Array:
        """Scalars of the cases, (n, names): NaN in a case that is not done."""
        values = block[list(names)].to_numpy(np.float64, na_value=np.nan)
        done = (block["status"] == "done").to_numpy(bool)
        return np.where(done[:, None], values, np.nan)

    def values(self, block: pd.DataFrame) -> Values:
        """All scalars of the cases, by `group`."""
        scalars = len(self.scalars)
        cell, case = self.number(block, "cell"), self.number(block)
        group = cell[:, None] * scalars + np.arange(scalars)
        values = self.columns(block, self.scalars)
        return Values(group.ravel(), values.ravel(), np.repeat(case, scalars))

    def stream(self, cases: Batches) -> Stream:
        """All scalars of a campaign."""
        return lambda: map(self.values, blocks(cases()))


# The first pass: counts, means, and tests.


@dataclass
class _Codes:
    """How often a code was seen, and the first cases with it."""

    count: int = 0
    cases: list[int] = field(default_factory=list)

    def add(self, cases: Sequence[int]) -> None:
        """Add cases of a block."""
        self.count += len(cases)
        self.cases = sorted([*self.cases, *sorted(cases)[:EXAMPLES]])[:EXAMPLES]


class _Tally:
    """Counts and means of every cell."""

    def __init__(self, plan: _Plan) -> None:
        self.plan, self.cases, self.fleet = plan, 0, False
        cells = len(plan.cells)
        self.moments = Moments(cells * len(plan.scalars))
        self.hits = np.zeros((cells, len(plan.tests), 2), np.int64)
        self.status: dict[tuple[int, str], int] = Counter()
        self.errors: dict[tuple[int, str, str], _Codes] = {}
        self.findings: dict[tuple[int, str], _Codes] = {}

    def add(self, block: pd.DataFrame) -> None:
        """Add a block of cases."""
        plan = self.plan
        self.cases += len(block)
        self.fleet |= "log" in block
        self.moments.add(plan.values(block))
        cell = plan.number(block, "cell")
        for t, test in enumerate(plan.tests):
            for k, mask in enumerate(test.of(plan, block)):
                self.hits[:, t, k] += np.bincount(cell[mask], minlength=len(plan.cells))
        # Most cases are done and without a finding.
        done = (block["status"] == "done").to_numpy(bool)
        for c, count in enumerate(np.bincount(cell[done])):
            self.status[c, "done"] += int(count)
        failed = _codes(block, cell, ~done, ("status", "code"))
        for (c, status, code), cases in failed.items():
            self.status[c, status] += len(cases)
            self.errors.setdefault((c, status, code), _Codes()).add(cases)
        found = _codes(
            block, cell, (block["findings"].fillna("") != "").to_numpy(bool), ("findings",)
        )
        for (c, text), cases in found.items():
            for code in dict.fromkeys(text.split()):
                self.findings.setdefault((c, code), _Codes()).add(cases)

    def counts(self, cell: int | None) -> dict[str, Any]:
        """States, errors and findings of a cell, or of all."""

        def of(key: int) -> bool:
            return cell is None or key == cell

        status = {
            name: sum(n for (c, s), n in self.status.items() if of(c) and s == name)
            for name in (*STATUSES, *sorted({s for _, s in self.status} - set(STATUSES)))
        }
        total = sum(status.values())
        errors: dict[tuple[str, str], _Codes] = {}
        for (c, state, code), entry in sorted(self.errors.items()):
            if of(c):
                merged = errors.setdefault((state, code), _Codes())
                merged.count, merged.cases = _joined(merged, entry)
        findings: dict[str, _Codes] = {}
        for (c, code), entry in sorted(self.findings.items()):
            if of(c):
                merged = findings.setdefault(code, _Codes())
                merged.count, merged.cases = _joined(merged, entry)
        return {
            "count": total,
            "status": {s: _share(share_of(n, total)) for s, n in status.items() if n},
            "failure": _share(share_of(total - status["done"], total)),
            "errors": [
                {"status": s, "code": code, "count": one.count, "cases": one.cases}
                for (s, code), one in sorted(errors.items(), key=lambda e: (-e[1].count, e[0]))
            ],
            "findings": [
                {"code": code, **_share(share_of(one.count, total)), "cases": one.cases}
                for code, one in sorted(findings.items(), key=lambda e: (-e[1].count, e[0]))
            ],
        }

    def tests(self, cell: int) -> dict[str, Any]:
        """Coverages, rates and consistencies of a cell."""
        out: dict[str, list[dict[str, Any]]] = {"coverage": [], "rates": [], "consistency": []}
        done = self.status[cell, "done"]
        for t, test in enumerate(self.plan.tests):
            hits, of = self.hits[cell, t].tolist()
            row = {"name": test.name, "missing": done - of}
            if test.kind == "consistency":
                group = self.plan.group(cell, self.plan.scalars.index(test.given["scalar"]))
                found = consistency(of, float(self.moments.mean[group]), hits, test.given["dof"])
                words = {1: "optimistic", -1: "pessimistic", 0: "consistent"}
                row |= {k: test.given[k] for k in ("scalar", "dof")}
                row |= {k: v for k, v in vars(found).items() if k != "inside"}
                row |= {"inside": _share(found.inside)}
                row["verdict"] = words[found.differs] if of else None
                out["consistency"].append(row)
                continue
            share = share_of(hits, of)
            row |= _share(share)
            if test.kind == "coverage":
                expected = test.given.get("expected", 0.95)
                words = {1: "pessimistic", -1: "optimistic", 0: "consistent"}
                row |= {k: test.given[k] for k in ("error", "bound")} | {"expected": expected}
                row["verdict"] = words[share.differs(expected)] if of else None
                out["coverage"].append(row)
            else:
                row |= {k: test.given.get(k) for k in ("scalar", "above", "below")}
                out["rates"].append(row)
        return out


def _codes(
    block: pd.DataFrame, cell: Whole, rows: Any, names: Sequence[str]
) -> dict[Any, list[int]]:
    """Cases of some rows of a block by cell and texts."""
    out: dict[Any, list[int]] = {}
    some = block[rows]
    texts = [some[name].fillna("").tolist() for name in names]
    for c, case, *own in zip(cell[rows].tolist(), some["case"].tolist(), *texts, strict=True):
        out.setdefault((c, *own), []).append(int(case))
    return out


def _joined(one: _Codes, other: _Codes) -> tuple[int, list[int]]:
    return one.count + other.count, sorted({*one.cases, *other.cases})[:EXAMPLES]


def _share(share: Share) -> dict[str, Any]:
    return {
        "hits": share.hits,
        "of": share.of,
        "share": share.share,
        "low": share.low,
        "high": share.high,
        "low_99": share.low_99,
        "high_99": share.high_99,
    }


# The last pass: histograms and outliers.


def _edges(moments: Moments, found: Array, group: int) -> tuple[Array, bool] | None:
    """Edges of the histogram of a group, and whether they are of equal ratio; None if constant."""
    least, most = float(moments.low[group]), float(moments.high[group])
    if not (moments.count[group] and math.isfinite(least) and math.isfinite(most)):
        return None
    q = dict(zip(LEVELS, found.tolist(), strict=True))
    log = least > 0.0 and q[0.975] > DECADES * q[0.025]
    values = np.array([least, q[0.25], q[0.75], most])
    low, first, third, high = (np.log10(values) if log else values).tolist()
    reach = third - first
    start, end = max(low, first - FAR_OUT * reach), min(high, third + FAR_OUT * reach)
    if not reach > 0.0:
        start, end = low, high
    # Freedman and Diaconis (1981).
    width = 2.0 * reach / float(moments.count[group]) ** (1.0 / 3.0)
    bins = int(min(40.0, max(8.0, (end - start) / width))) if width > 0.0 else 20
    edges = np.linspace(start, end, bins + 1)
    edges = 10.0**edges if log else edges
    # The logarithm of an extreme is rounded.
    edges[0] = least if start == low else edges[0]
    edges[-1] = most if end == high else edges[-1]
    if not (np.isfinite(edges).all() and (np.diff(edges) > 0.0).all()):
        return None
    return edges, log


class _Shapes:
    """Histograms and outliers of every cell, and values of the first logs of a fleet."""

    def __init__(self, plan: _Plan, moments: Moments, found: Array) -> None:
        self.plan = plan
        self.edges = [_edges(moments, one, group) for group, one in enumerate(found)]
        self.histogram = [
            None if one is None else np.zeros(one[0].size + 1, np.int64) for one in self.edges
        ]
        low, high = found[:, LEVELS.index(0.25)], found[:, LEVELS.index(0.75)]
        with np.errstate(invalid="ignore"):
            reach = high - low
        # Of a scalar that is mostly one value no value is far out.
        self.varies = np.isfinite(reach) & (reach > 0.0)
        reach = np.where(self.varies, reach, np.nan)
        self.far = Extremes(low - FAR_OUT * reach, high + FAR_OUT * reach, reach)
        self.logs: list[dict[str, Any]] = []

    def add(self, block: pd.DataFrame) -> None:
        """Add a block of cases."""
        plan = self.plan
        self.far.add(plan.values(block))
        cell, values = plan.number(block, "cell"), plan.columns(block, plan.scalars)
        for c in np.unique(cell).tolist():
            own = values[cell == c]
            for s in range(len(plan.scalars)):
                group = plan.group(c, s)
                edges, counts = self.edges[group], self.histogram[group]
                if edges is not None and counts is not None:
                    counts += count_between(edges[0], own[:, s])
        room = LOGS - len(self.logs)
        if "log" in block and room > 0:
            for row, own in zip(block.head(room).to_dict("records"), values, strict=False):
                scalars = dict(zip(plan.scalars, own.tolist(), strict=True))
                kept = {key: row[key] for key in ("case", "cell", "draw", "log", "status", "code")}
                self.logs.append({**kept, "scalars": scalars})


def _scalar(
    moments: Moments,
    found: tuple[Array, Array, Array],
    shapes: _Shapes,
    group: int,
) -> dict[str, Any]:
    """Statistics of one scalar in one cell."""
    count, mean, sd = int(moments.count[group]), moments.mean[group], moments.sd[group]
    low, high = student_interval(count, float(mean), float(sd))
    out: dict[str, Any] = {
        "count": count,
        "missing": int(moments.missing[group]),
        "mean": float(mean),
        "mean_low": low,
        "mean_high": high,
        "sd": float(sd),
    }
    for name in ("low", "high"):
        key = {"low": "minimum", "high": "maximum"}[name]
        out[key] = float(getattr(moments, name)[group])
        out[f"{key}_case"] = int(getattr(moments, f"{name}_case")[group]) if count else None
    out["quantiles"] = [
        {"level": level, "value": v, "low": a, "high": b}
        for level, v, a, b in zip(LEVELS, *(part[group].tolist() for part in found), strict=True)
    ]
    edges, counts = shapes.edges[group], shapes.histogram[group]
    if edges is not None and counts is not None:
        below, *inside, above = counts.tolist()
        out["histogram"] = {
            "edges": edges[0].tolist(),
            "log": edges[1],
            "below": below,
            "counts": inside,
            "above": above,
        }
    if shapes.varies[group]:
        far = shapes.far
        out["outliers"] = {
            "low_fence": float(far.low[group]),
            "high_fence": float(far.high[group]),
            "below": int(far.below[group]),
            "above": int(far.above[group]),
            "worst": [{"case": case, "value": value} for case, value in far.worst(group)],
        }
    return out


def _name_logs(out: dict[str, Any], cases: Batches) -> None:
    """Put the log of each case of a fleet that is listed beside its number."""
    lists: list[tuple[dict[str, Any], str, list[int]]] = []
    for counted in (out, *out["cells"]):
        lists += [(one, "logs", one["cases"]) for one in counted["errors"] + counted["findings"]]
    for cell in out["cells"]:
        for scalar in cell["scalars"].values():
            for key in ("minimum", "maximum"):
                if scalar[f"{key}_case"] is not None:
                    lists.append((scalar, f"{key}_log", [scalar[f"{key}_case"]]))
            lists += [
                (one, "log", [one["case"]]) for one in scalar.get("outliers", {}).get("worst", ())
            ]
    wanted = {case for _, _, found in lists for case in found}
    logs: dict[int, str] = {}
    for block in blocks(cases()):
        own = block[block["case"].isin(wanted)]
        logs |= dict(zip(own["case"].tolist(), own["log"].tolist(), strict=True))
    for one, key, found in lists:
        names = [logs[case] for case in found]
        one[key] = names if key == "logs" else names[0]


# Sensitivity, and curves.


def _sensitivity(plan: _Plan, moments: Moments, cases: Batches) -> list[dict[str, Any]]:
    """Sobol indices of each scalar in each cell."""
    given = plan.frozen.get("cases") or {}
    if given.get("method") != "sensitivity" or not plan.drawn:
        return []
    centre = moments.mean.reshape(len(plan.cells), len(plan.scalars))
    sobol = Sobol(len(plan.drawn), centre, int(given.get("seed", 0)))
    for block in blocks(cases()):
        draw = plan.number(block, "draw")
        sobol.add(plan.number(block, "cell"), draw, plan.columns(block, plan.scalars))
    sobol.finish()
    out = []
    for cell in range(len(plan.cells)):
        own = {}
        for s, name in enumerate(plan.scalars):
            found = sobol.indices(cell, s)
            rows = [
                {
                    "parameter": parameter,
                    **dict(zip(("first", "first_low", "first_high"), first, strict=True)),
                    **dict(zip(("total", "total_low", "total_high"), total, strict=True)),
                }
                for parameter, first, total in zip(
                    plan.drawn, found.first.tolist(), found.total.tolist(), strict=True
                )
            ]
            own[name] = {
                "base_samples": found.samples,
                "left_out": found.left_out,
                "parameters": rows,
            }
        out.append(own)
    return out


def _curves(
    plan: _Plan, cases: Batches, curves: Batches
) -> tuple[list[float], list[dict[str, Any]]]:
    """Axis of the curves, and for each cell and curve its mean and quantiles along it."""
    axis = _axis(curves)
    size, names = axis.size, plan.curves
    if not size:
        return [], []

    def stream() -> Iterator[Values]:
        for block, cell in _with_cells(cases, curves):
            x = block["x"].to_numpy(np.float64)
            at = np.minimum(np.searchsorted(axis, x), size - 1)
            if not np.array_equal(axis[at], x):
                raise ValueError("the curves of the cases have different axes")
            first = (cell * len(names))[:, None] + np.arange(len(names))
            values = block[list(names)].to_numpy(np.float64, na_value=np.nan)
            group = first * size + at[:, None]
            case = np.repeat(plan.number(block), len(names))
            yield Values(group.ravel(), values.ravel(), case)

    moments = Moments(len(plan.cells) * len(names) * size)
    for block in stream():
        moments.add(block)
    found, _, _ = quantiles(stream, moments, CURVE_LEVELS)
    shape = (len(plan.cells), len(names), size)
    parts = {
        "count": moments.count,
        "mean": moments.mean,
        **dict(zip(("low", "median", "high"), found.T, strict=True)),
    }
    bands = [
        {
            name: {key: part.reshape(shape)[cell, k].tolist() for key, part in parts.items()}
            for k, name in enumerate(names)
        }
        for cell in range(len(plan.cells))
    ]
    return axis.tolist(), bands


def _axis(curves: Batches) -> Array:
    """Axis of the first curve, ascending."""
    found: list[Array] = []
    first = None
    for block in blocks(curves()):
        first = block["case"].iloc[0] if first is None else first
        own = block[block["case"] == first]
        found.append(own["x"].to_numpy(np.float64))
        if len(own) < len(block):
            break
    return np.unique(np.concatenate(found)) if found else np.empty(0)


def _with_cells(cases: Batches, curves: Batches) -> Iterator[tuple[pd.DataFrame, Whole]]:
    """Curves of the cases that there are, with the cell of each row; both in order of case."""
    known = iter(blocks(cases()))
    case, cell = np.empty(0, np.int64), np.empty(0, np.int64)
    for block in blocks(curves()):
        own = block["case"].to_numpy(np.int64)
        while not case.size or case[-1] < own[-1]:
            more = next(known, None)
            if more is None:
                break
            kept = case >= own[0]
            case = np.concatenate([case[kept], more["case"].to_numpy(np.int64)])
            cell = np.concatenate([cell[kept], more["cell"].to_numpy(np.int64)])
        # A case beyond the end of its cell may have a curve.
        at = np.minimum(np.searchsorted(case, own), max(case.size - 1, 0))
        there = case[at] == own if case.size else np.zeros(own.size, bool)
        yield block[there], cell[at[there]]
