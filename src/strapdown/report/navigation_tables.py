"""Tables of a navigation run: start and end, states, observations, outages, errors."""

from __future__ import annotations

import math

from strapdown.evaluation.plane_bound import plane_bound
from strapdown.report.document import TableBlock
from strapdown.report.navigation_found import NavigationFound
from strapdown.report.navigation_words import longest_outages, place_words
from strapdown.report.values import (
    GAP,
    about,
    blocks_of,
    duration_words,
    half,
    length_words,
    plain,
    share_words,
)
from strapdown.report.values import alignment_values_instant as instant
from strapdown.tables import EULER, VELOCITY

_MOST_EVENTS = 40


def end_table(found: NavigationFound) -> TableBlock:
    """Position, velocity and attitude at the start and at the end, with bounds."""
    record = found.record
    rows = [
        ("time", *(instant(float(record.trajectory.index[k])) for k in (0, -1))),
        ("place", place_words(found, 0), place_words(found, -1)),
    ]
    plane = plane_bound(record.covariance)
    rows.append(("horizontal ±", *(length_words(float(plane[k])) for k in (0, -1))))
    for name, column, sd, unit in (
        ("height", "alt", "down", "m"),
        *(
            (f"velocity {w}", v, v, "m/s")
            for v, w in zip(VELOCITY, ("north", "east", "down"), strict=True)
        ),
        *((a, a, a, "°") for a in reversed(EULER)),
    ):
        cells = []
        for k in (0, -1):
            value = float(record.trajectory[column].iloc[k])
            value = value % 360.0 if column == "heading" else value
            cells.append(about(value, half(record.sd[sd].iloc[k]), unit))
        rows.append((name, *cells))
    return TableBlock(
        ("", "start", "end"), tuple(rows), text=(0,), caption="Start and end, with bounds of 95 %."
    )


def state_table(found: NavigationFound) -> TableBlock | None:
    """Sensor and measurement errors: uncertainty before and after the run."""
    record = found.filtered
    if record.sensors.empty or not len(record.sensors.columns):
        return None
    rows = []
    for block in blocks_of(record):
        for column, label in zip(block.columns, block.labels, strict=True):
            value = block.factor * float(record.sensors[column].iloc[-1])
            first, last = (block.factor * half(record.sensors_sd[column].iloc[k]) for k in (0, -1))
            name = f"{block.name} {label}" if len(block.columns) > 1 else block.name
            before = about(0.0, first, block.unit)
            rows.append(
                (
                    name,
                    about(value, last, block.unit),
                    before[before.index("±") :],
                    share_words(1.0 - last / first) if first > 0.0 and last <= first else "–",
                )
            )
    return TableBlock(
        ("error of", "estimate at the end", "bound at the start", "bound fell by"),
        tuple(rows),
        text=(0,),
        caption="Bounds of 95 %.",
    )


def observation_table(found: NavigationFound) -> TableBlock | None:
    """Observations with their innovation statistics and rejected epochs."""
    rows = []
    for one in found.agreements:
        band = "–"
        if one.used.any():
            band = f"{plain(one.band[0], 2)} to {plain(one.band[1], 2)}"
        memory = "–"
        if math.isfinite(one.correlation):
            memory = f"{plain(one.correlation, 2)} (±{GAP}{plain(one.correlation_bound, 2)})"
        rows.append(
            (
                one.name,
                str(one.epochs),
                str(one.rejected),
                str(one.weakened),
                plain(one.ratio, 2),
                plain(one.mean_nis, 2),
                band,
                memory,
            )
        )
    if not rows:
        return None
    return TableBlock(
        (
            "observation",
            "epochs",
            "rejected",
            "weakened",
            "rms, sd",
            "mean NIS",
            "expected, 95 %",
            "memory",
        ),
        tuple(rows),
        text=(0,),
        caption="Innovations that were used: root mean square in the standard deviations that were "
        "expected, mean of the normalised innovation squared (NIS) and where it belongs, and the "
        "largest correlation of a component with itself an epoch later, beside what chance makes.",
    )


def outage_table(found: NavigationFound) -> TableBlock | None:
    """Outages, each with its largest bound."""
    rows = [
        (
            aid,
            instant(span.begin),
            duration_words(span.end - span.begin),
            length_words(bound),
        )
        for aid, span, bound in longest_outages(found)
    ]
    if not rows:
        return None
    return TableBlock(
        ("aid", "from", "for", "largest bound"),
        tuple(rows),
        text=(0,),
        caption="Outages, and the largest horizontal bound of 95 % in each: at its last mark.",
    )


def withheld_table(found: NavigationFound) -> TableBlock | None:
    """GNSS outage tests with the resulting errors."""
    rows = [
        (
            w.aid,
            instant(w.begin),
            duration_words(w.end - w.begin),
            length_words(w.error_m),
            length_words(w.bound_m),
            "yes" if w.inside else "no",
            *(() if w.forward_m is None else (length_words(w.forward_m),)),
        )
        for w in found.told.withheld
    ]
    if not rows:
        return None
    smoothed = found.told.forward is not None
    return TableBlock(
        (
            *("withheld", "from", "for", "largest error", "bound then", "inside"),
            *(("filter alone",) if smoothed else ()),
        ),
        tuple(rows),
        text=(0, 5),
        caption="Aids withheld on purpose: the largest horizontal error, and the run's own bound "
        "of 95 % at that instant" + ("; smoothed, and of the filter alone." if smoothed else "."),
        strong=tuple(k for k, w in enumerate(found.told.withheld) if not w.inside),
    )


def point_table(found: NavigationFound) -> TableBlock | None:
    """Errors at the control points."""
    score = found.told.points
    if score is None:
        return None
    row = (
        f"{len(score.time)} of {score.given}",
        length_words(score.way),
        length_words(score.rms),
        length_words(score.median),
        length_words(score.largest),
        instant(score.largest_at),
        f"{plain(100.0 * score.rms / score.way, 2)} %",
    )
    return TableBlock(
        ("control points", "way", "rms", "median", "largest", "at", "rms of the way"),
        (row,),
        caption="Horizontal distance from the control points, after the one origin and heading "
        "that fit best (no scale): the run's heading less theirs is "
        f"{plain(score.turn_deg, 2)} deg.",
    )


def error_table(found: NavigationFound) -> TableBlock | None:
    """Errors against the truth with their bounds."""
    if found.errors is None:
        return None
    names = {"horizontal": "horizontal", "down": "down (height)"}
    names |= {v: f"velocity {w}" for v, w in zip(VELOCITY, ("north", "east", "down"), strict=True)}
    rows = []
    for score in found.errors.scores:
        places = _places(score.rms)
        rows.append(
            (
                f"{names.get(score.quantity, score.quantity)}, {score.unit}",
                plain(score.rms, places),
                plain(score.largest, places),
                instant(score.largest_at),
                plain(score.bound, places),
                share_words(score.share),
            )
        )
    return TableBlock(
        ("error", "rms", "largest", "at", "95 % bound, rms", "inside"),
        tuple(rows),
        text=(0,),
        caption=f"Errors against {found.told.truth_name}, at {len(found.errors.time)} instants.",
        strong=(0,),
    )


def _places(value: float) -> int:
    if not (math.isfinite(value) and value > 0.0):
        return 3
    return min(6, max(0, 2 - math.floor(math.log10(value))))


def event_table(found: NavigationFound) -> TableBlock | None:
    """Events; only the first ones if there are many."""
    events = found.record.events
    if not events:
        return None
    shown = events[:_MOST_EVENTS]
    rest = len(events) - len(shown)
    more = f"; {rest} more stand in navigation.json" if rest else ""
    return TableBlock(
        ("at", "event", "what"),
        tuple((instant(e.time), e.kind, e.finding.what) for e in shown),
        text=(0, 1, 2),
        caption=f"What happened, in the order of time{more}.",
    )
