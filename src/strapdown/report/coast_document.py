"""Report of a GNSS outage prediction: the answer first, then its basis."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from strapdown import __version__
from strapdown.constants import TWO_SIDED_95
from strapdown.report.chart import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    SERIES_COLOURS,
    VERMILLION,
    Bars,
    Chart,
    Fill,
    Line,
    Panel,
)
from strapdown.report.coast_words import (
    aids_name,
    at_start,
    headline,
    inside_words,
    key_figures,
    motion_words,
    outage_words,
    remedy,
    source_words,
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
    TableBlock,
)
from strapdown.report.plan_view import ellipse
from strapdown.report.values import GAP, duration_words, half, length_words, plain, share_words
from strapdown.systems.outage_run import Drift, OutageRun


def coast_document(result: OutageRun, name: str) -> Document:
    """Return the report of an outage prediction.

    Parameters
    ----------
    result : OutageRun
    name : str
        Folder name, for the verification command.
    """
    came = inside_words(result)
    front: tuple[Block | None, ...] = (
        KeyFigures(key_figures(result)),
        Paragraph(remedy(result), "lead"),
        Paragraph(came) if came else None,
        ChartBlock(cone_chart(result)),
    )
    drifts = drift_table(result)
    sections = [
        Section(
            "over-time",
            "Over the outage",
            (time_table(result), ChartBlock(parts_chart(result))),
        ),
        Section(
            "budget",
            "What makes the drift",
            (budget_table(result), ChartBlock(budget_chart(result))),
        ),
        Section("plane", "From above", (ChartBlock(plane_chart(result)),)),
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


def _facts(result: OutageRun) -> tuple[tuple[str, str], ...]:
    return (
        ("Sensor" if result.navigation is None else "Record", f"{result.name}: {result.what}"),
        ("Motion", motion_words(result)),
        ("Start", start_words(result)),
        ("Aids that stay", ", ".join(result.stays) or "none"),
        ("Made with", f"strapdown {__version__}"),
    )


def _method(result: OutageRun, name: str) -> tuple[Block, ...]:
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


# Tables of an outage prediction: drift over time, error budget, observed drifts.


#: Fractions of an outage in the table.
_AT = (0.0, 1.0 / 6.0, 1.0 / 3.0, 0.5, 2.0 / 3.0, 5.0 / 6.0, 1.0)
#: Characters of a full-length bar.
_BAR = 20
#: Smallest share of the variance with its own row.
_LEAST = 5e-4


def time_table(result: OutageRun) -> TableBlock:
    """Drift over the outage."""
    found, recorded = result.forecast, result.recorded
    grid = found.time if recorded is None else recorded.time
    bound = found.bound if recorded is None else recorded.bound

    def sd(quantity: str, at: float) -> float:
        values = found.variance(quantity) if recorded is None else recorded.variance[quantity]
        return math.sqrt(max(float(np.interp(at, grid, values)), 0.0))

    rows = []
    for share in _AT:
        at = share * result.spec.outage_s
        rows.append(
            (
                duration_words(at),
                length_words(sd("horizontal", at)),
                length_words(float(np.interp(at, grid, bound))),
                *(length_words(half(sd(q, at))) for q in ("along", "across", "vertical")),
                f"{plain(half(sd('speed', at)), 3)}{GAP}m/s",
                f"{plain(math.degrees(half(sd('heading', at))), 3)}°",
            )
        )
    said = (
        ""
        if recorded is None or len(recorded.drifts) < 2
        else (f" Of {len(recorded.drifts)} outages, the root of the mean square.")
    )
    return TableBlock(
        (
            "after",
            "horizontal, 1 sd",
            "horizontal, 95 %",
            "along ±",
            "across ±",
            "vertical ±",
            "speed ±",
            "heading ±",
        ),
        tuple(rows),
        text=(0,),
        caption="Horizontal: the root of both variances, and the longer half axis of the ellipse "
        f"that holds 95 %. Others: 95 %, 1.96 standard deviations.{said}",
        strong=(len(rows) - 1,),
    )


def budget_table(result: OutageRun) -> TableBlock:
    """Contribution of each error source to the horizontal drift at the end."""
    found = result.forecast
    whole = float(found.variance("horizontal")[-1])
    rows, rest = [], 0.0
    for share in found.shares:
        part = float(share.variance["horizontal"][-1]) / whole
        if abs(part) < _LEAST:
            rest += part
            continue
        alone = float(share.alone["horizontal"][-1])
        rows.append(
            (
                part,
                source_words(share.source.name),
                at_start(share, result),
                length_words(alone) if math.isfinite(alone) else "–",
            )
        )
    if found.aids:
        rows.append((float(found.aids["horizontal"][-1]) / whole, aids_name, "", "–"))
    rows.sort(key=lambda row: -row[0])
    told = [(name, size, alone, *_part(part)) for part, name, size, alone in rows]
    if abs(rest) >= 5e-5:
        told.append(("all others", "", "", *_part(rest)))
    told.append(("all together", "", length_words(math.sqrt(whole)), f"100{GAP}%", ""))
    return TableBlock(
        ("source", "1 sd at the start", "alone", "share of the variance", ""),
        tuple(told),
        text=(0, 1, 4),
        caption="Of the horizontal drift at the end, 1 standard deviation. Alone: were there no "
        "other source. Shares add up to the whole; where errors of the start are bound to each "
        "other, as tilt and accelerometer bias are, they cancel, and a share may be small or "
        "below zero although the source alone would be large.",
        strong=(len(told) - 1,),
    )


def _part(part: float) -> tuple[str, str]:
    size = f"{plain(100.0 * part, 1)}{GAP}%" if part < 0.0 else share_words(min(part, 0.9999))
    return size, "█" * round(_BAR * part) if part > 0.0 else ""


def drift_table(result: OutageRun) -> TableBlock | None:
    """Table of the outage tests."""
    recorded = result.recorded
    drifts = [] if recorded is None else [d for d in recorded.drifts if d.time.size]
    if not drifts:
        return None
    rows = [
        (
            f"{plain(d.span.begin, 1)}{GAP}s",
            length_words(float(d.horizontal[-1])),
            length_words(float(d.along[-1])),
            length_words(float(d.across[-1])),
            length_words(float(d.down[-1])),
            length_words(float(d.bound[-1])),
            share_words(float(d.inside.mean())),
        )
        for d in drifts
    ]
    return TableBlock(
        ("outage from", "drift", "along", "across", "down", "foretold, 95 %", "fixes inside"),
        tuple(rows),
        text=(),
        caption="Drift at the last fix of each outage: computed less fix. Inside: the share of "
        "its fixes within their ellipses of 95 %, the noise of the fixes with them.",
    )


# Charts of an outage prediction: the cone over time and from above, and its error budget.


Array = NDArray[np.float64]

TIME = "time since the outage began, s"
#: Error sources drawn separately; the others are joined.
MOST = 7
#: Share of the total variance below which a source is joined with the others.
_COAST_CHARTS_LEAST = 0.005
#: Fractions of the outage at which the plan has an ellipse.
_RINGS = (0.25, 0.5, 0.75, 1.0)
_CORNERS = 90
_INSIDE, _OUTSIDE = "a drift that came, within its 95 %", "outside of it"


def cone_chart(result: OutageRun) -> Chart:
    """Cone over time with the observed drifts, and its error budget."""
    found, recorded = result.forecast, result.recorded
    if recorded is None:
        time, bound, sd = found.time, found.bound, found.sd("horizontal")
    else:
        time, bound = recorded.time, recorded.bound
        sd = np.sqrt(np.maximum(recorded.variance["horizontal"], 0.0))
    lines = [
        *_came(result, lambda d: d.horizontal),
        Line("1 standard deviation", time, sd, BLUE, "dash", 1.6),
        Line("95 % are within", time, bound, BLUE, "solid", 2.2),
    ]
    cone = Panel(
        "horizontal drift, m",
        tuple(lines),
        fills=(Fill("95 % are within", time, np.zeros_like(time), bound, BLUE, 0.13),),
        height=1.4,
    )
    fills, note = _stack(result)
    stack = Panel(
        "1 standard deviation, m",
        (Line("all together", found.time, found.sd("horizontal"), BLACK, "solid", 1.6),),
        fills=fills,
        title="What it is made of",
    )
    tried = "" if recorded is None else _tried(recorded.drifts)
    return Chart(
        "cone",
        "How far it drifts",
        f"Above: horizontal drift.{tried} Below: its standard deviation, each band as high as its "
        f"share of the variance.{note}",
        TIME,
        (cone, stack),
    )


def _tried(drifts: Sequence[Drift]) -> str:
    many = sum(bool(d.time.size) for d in drifts)
    if many < 2:
        return ""
    return (
        f" The cone is the root mean square of those foretold for {many} outages; each drift is "
        "judged by its own."
    )


def _came(result: OutageRun, value: object) -> list[Line]:
    """Observed drifts over time."""
    lines = []
    for d in () if result.recorded is None else result.recorded.drifts:
        if not d.time.size:
            continue
        y = np.asarray(value(d))  # type: ignore[operator]
        lines.append(Line(_INSIDE, d.time, y, GREY, "solid", 1.0))
        if not d.inside.all():
            out = ~d.inside
            lines.append(
                Line(
                    _OUTSIDE,
                    d.time[out],
                    y[out],
                    VERMILLION,
                    points=True,
                    symbol="circle",
                    size=5.0,
                )
            )
    return lines


def _stack(result: OutageRun) -> tuple[tuple[Fill, ...], str]:
    """Bands of the error sources, as high as their shares of the variance."""
    found = result.forecast
    whole = np.maximum(found.variance("horizontal"), 1e-30)
    parts = [(source_words(s.source.name), s.variance["horizontal"]) for s in found.shares]
    if found.aids:
        parts.append((aids_name, found.aids["horizontal"]))
    signed = [(name, v / whole) for name, v in parts]
    most = {name: float(np.max(v)) for name, v in signed}
    shown = [n for n in sorted(most, key=lambda n: -most[n]) if most[n] > _COAST_CHARTS_LEAST][
        :MOST
    ]
    drawn = [(n, np.maximum(v, 0.0)) for n, v in signed if n in shown]
    rest = np.sum(
        [np.maximum(v, 0.0) for n, v in signed if n not in shown] or [0.0 * whole], axis=0
    )
    if float(rest.max()) > _COAST_CHARTS_LEAST:
        drawn.append(("all others", rest))
    total = np.maximum(np.sum([v for _, v in drawn], axis=0), 1e-30)
    sd = found.sd("horizontal")
    below = np.zeros_like(sd)
    fills = []
    for k, (name, v) in enumerate(drawn):
        above = below + v / total * sd
        colour = GREY if name == "all others" else SERIES_COLOURS[k % len(SERIES_COLOURS)]
        fills.append(Fill(name, found.time, below, above, colour, 0.55))
        below = above
    cancels = any(float(np.min(v)) < -_COAST_CHARTS_LEAST for _, v in signed)
    note = " Shares below zero, of errors that cancel, are not drawn." if cancels else ""
    if result.recorded is not None and len(result.recorded.drifts) > 1:
        note += f" Of the outage from {result.forecast.begin:.1f} s, the middle one by its bound."
    return tuple(fills), note


def plane_chart(result: OutageRun) -> Chart:
    """Possible drift seen from above, relative to the true position."""
    found, recorded = result.forecast, result.recorded
    if recorded is None:
        time = found.time
        c, s = np.cos(found.course), np.sin(found.course)
        P = found.covariance[:, :2, :2]
        turn = np.array([[c, s], [-s, c]]).transpose(2, 0, 1)
        planes = turn @ P @ turn.transpose(0, 2, 1)
    else:
        time = recorded.time
        planes = np.zeros((len(time), 2, 2))
        planes[:, 0, 0] = recorded.variance["along"]
        planes[:, 1, 1] = recorded.variance["across"]
    lines = []
    for k, share in enumerate(_RINGS):
        at = share * result.spec.outage_s
        row = int(np.argmin(np.abs(time - at)))
        # Cross-track to the right, along-track upward.
        ring = ellipse(np.zeros(2), planes[row][::-1, ::-1], _CORNERS)
        ring = np.vstack([ring, ring[:1]])
        name = f"95 % after {duration_words(at)}"
        lines.append(
            Line(
                name,
                ring[:, 0],
                ring[:, 1],
                BLUE,
                ("dot", "dashdot", "dash", "solid")[k],
                1.2 + 0.3 * k,
                inside=0.06,
            )
        )
    for d in () if recorded is None else recorded.drifts:
        if d.time.size:
            lines.append(Line(_INSIDE, d.across, d.along, GREY, "solid", 1.0))
            end = slice(len(d.time) - 1, len(d.time))
            colour = GREY if d.inside[-1] else VERMILLION
            lines.append(
                Line(
                    "its end" if d.inside[-1] else _OUTSIDE,
                    d.across[end],
                    d.along[end],
                    colour,
                    points=True,
                    symbol="circle",
                    size=7.0,
                )
            )
    panel = Panel("along the way, m", tuple(lines), x_label="across it, to the right, m")
    return Chart(
        "plane",
        "The drift from above",
        "Computed place relative to the true one, along and across the way. Ellipses hold 95 % "
        "of the places.",
        "across it, to the right, m",
        (panel,),
    )


def parts_chart(result: OutageRun) -> Chart:
    """Along-track, cross-track, height, speed and heading over the outage."""
    found, recorded = result.forecast, result.recorded
    time = found.time if recorded is None else recorded.time

    def bound(quantity: str, factor: float = 1.0) -> Array:
        values = found.variance(quantity) if recorded is None else recorded.variance[quantity]
        return np.asarray(factor * TWO_SIDED_95 * np.sqrt(np.maximum(values, 0.0)))

    place = (
        Line("along", time, bound("along"), VERMILLION, "solid", 1.8),
        Line("across", time, bound("across"), GREEN, "dash", 1.8),
        Line("vertical", time, bound("vertical"), BLUE, "dot", 1.8),
    )
    speed = (Line("horizontal speed", time, bound("speed"), BLACK, "solid", 1.6),)
    heading = (Line("heading", time, bound("heading", math.degrees(1.0)), BLACK, "dash", 1.6),)
    return Chart(
        "parts",
        "Along, across, up and down; velocity and heading",
        "Bounds of 95 %: 1.96 standard deviations.",
        TIME,
        (
            Panel("place ±, m", place),
            Panel("velocity ±, m/s", speed),
            Panel("heading ±, deg", heading),
        ),
    )


def budget_chart(result: OutageRun) -> Chart:
    """Shares of the variance at the end, largest first."""
    found = result.forecast
    whole = float(found.variance("horizontal")[-1])
    parts = [
        (source_words(s.source.name), float(s.variance["horizontal"][-1]) / whole)
        for s in found.shares
    ]
    if found.aids:
        parts.append((aids_name, float(found.aids["horizontal"][-1]) / whole))
    kept = sorted((p for p in parts if abs(p[1]) >= _COAST_CHARTS_LEAST), key=lambda p: -p[1])
    rest = sum(p for _, p in parts) - sum(p for _, p in kept)
    if abs(rest) >= _COAST_CHARTS_LEAST:
        kept.append(("all others", rest))
    values = 100.0 * np.array([p for _, p in kept])
    bars = Bars(
        "share",
        np.arange(len(kept), dtype=np.float64),
        values,
        BLUE,
        labels=tuple(share_words(p) if p > 0.0 else f"{100.0 * p:.1f} %" for _, p in kept),
        legend=False,
    )
    return Chart(
        "budget",
        "What makes the drift",
        "Shares of the variance of the horizontal drift at the end of the outage. They add up to "
        "100 %; below zero is what cancels others.",
        "share of the variance, %",
        (Panel("", (), categories=tuple(n for n, _ in kept), bars=(bars,)),),
    )
