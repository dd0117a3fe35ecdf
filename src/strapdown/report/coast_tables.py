"""Tables of a forecast of coasting: the drift over time, its budget, and what came."""

from __future__ import annotations

import math

import numpy as np

from strapdown.report.coast_words import aids_name, at_start, source_words
from strapdown.report.crash_values import GAP, plain
from strapdown.report.document import TableBlock
from strapdown.report.navigation_values import (
    duration_words,
    half,
    length_words,
    share_words,
)
from strapdown.systems.coasting.run import CoastResult

__all__ = ["budget_table", "drift_table", "time_table"]

#: Shares of an outage that are told.
_AT = (0.0, 1.0 / 6.0, 1.0 / 3.0, 0.5, 2.0 / 3.0, 5.0 / 6.0, 1.0)
#: Letters of a bar that is the whole.
_BAR = 20
#: What is less of the variance is not told by itself.
_LEAST = 5e-4


def time_table(result: CoastResult) -> TableBlock:
    """The drift over the outage."""
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


def budget_table(result: CoastResult) -> TableBlock:
    """What each source adds to the horizontal drift at the end."""
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


def drift_table(result: CoastResult) -> TableBlock | None:
    """The outages that were tried."""
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
