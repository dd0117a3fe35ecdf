"""Results of a navigation run in sentences, shared by terminal and page."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import TWO_SIDED_95
from strapdown.evaluation.plane_bound import plane_bound
from strapdown.navigation.record import NavigationRecord, Span
from strapdown.navigation.truth_comparison import SmootherConsistency
from strapdown.report.chart import BLUE, GREY, Chart, Panel, curve
from strapdown.report.chart import BUCKETS_OVER_TIME as BUCKETS
from strapdown.report.document import KeyFigure, TableBlock
from strapdown.report.navigation_charts import over_time
from strapdown.report.navigation_found import NavigationFound
from strapdown.report.values import (
    GAP,
    about,
    blocks_of,
    distance_over_ground,
    duration_words,
    half,
    length_words,
    plain,
    share_words,
    worst_within,
)
from strapdown.report.values import alignment_values_instant as instant
from strapdown.rotation import within_half_turn
from strapdown.tables import EULER, NED, VELOCITY

# 95 % bound in deg from which a heading is unknown.
_NO_HEADING = 180.0
# A smaller relative reduction of a bound means that the motion made the state not observable.
_FELL = 0.1


def headline(found: NavigationFound) -> str:
    """Return the end position, the distance traveled, and the bounds."""
    record = found.record
    return (
        f"Ended at {place_words(found)} after {duration_words(_duration(found))} and "
        f"{length_words(distance_over_ground(record.trajectory))}; the place is known to "
        f"{length_words(float(plane_bound(record.covariance)[-1]))}, the heading {_heading(found)} "
        "(bounds of 95 %)."
    )


def place_words(found: NavigationFound, row: int = -1) -> str:
    """Latitude, longitude and height of a row: ``40.096627°, −105.147448°, 1601.5 m``."""
    last = found.record.trajectory.iloc[row]
    lon = float(within_half_turn(last["lon"]))
    return (
        f"{plain(float(last['lat']), 6)}°, {plain(lon, 6)}°, {plain(float(last['alt']), 1)}{GAP}m"
    )


def key_figures(found: NavigationFound) -> tuple[KeyFigure, ...]:
    """Return the key figures at the top of the page."""
    record = found.record
    sd = record.sd.iloc[-1]
    last = record.trajectory.iloc[-1]
    plane = float(plane_bound(record.covariance)[-1])
    heading = half(sd["heading"])
    out = [
        KeyFigure(
            "Way and time",
            length_words(distance_over_ground(record.trajectory)),
            f"in {duration_words(_duration(found))}",
            f"from {instant(float(record.trajectory.index[0]))} to "
            f"{instant(float(record.trajectory.index[-1]))}",
        ),
        KeyFigure(
            "Place at the end",
            f"±{GAP}{length_words(plane)}",
            f"horizontal, 95{GAP}%; height {about(float(last['alt']), half(sd['down']), 'm')}",
            place_words(found),
        ),
        KeyFigure(
            "Heading at the end",
            "not known"
            if heading >= _NO_HEADING
            else about(float(last["heading"]) % 360.0, heading, "°"),
            f"95{GAP}% bound",
            f"roll {about(float(last['roll']), half(sd['roll']), '°')}, pitch "
            f"{about(float(last['pitch']), half(sd['pitch']), '°')}",
        ),
    ]
    out.append(_known(found))
    return tuple(out)


def _known(found: NavigationFound) -> KeyFigure:
    """The main figure besides the end: the error, the worst outage, or the worst bound."""
    if found.errors is not None:
        score = found.errors.score("horizontal")
        up = found.errors.score("down")
        return KeyFigure(
            f"Error against {found.told.truth_name}",
            length_words(score.rms),
            f"horizontal, root mean square; at most {length_words(score.largest)}",
            f"height {length_words(up.rms)}, at most {length_words(up.largest)}",
        )
    outages = longest_outages(found)
    if outages:
        aid, span, bound = max(outages, key=lambda o: o[2])
        return KeyFigure(
            "Largest bound in an outage",
            f"±{GAP}{length_words(bound)}",
            f"horizontal, 95{GAP}%, after {duration_words(span.end - span.begin)} without {aid}",
            f"{len(outages)} {'outage' if len(outages) == 1 else 'outages'} in all",
        )
    bounds = plane_bound(found.record.covariance)
    worst = int(np.argmax(bounds))
    return KeyFigure(
        "Largest bound",
        f"±{GAP}{length_words(float(bounds[worst]))}",
        f"horizontal, 95{GAP}%, at {instant(float(found.record.sd.index[worst]))}",
        "no outage",
    )


def longest_outages(found: NavigationFound) -> list[tuple[str, Span, float]]:
    """Source, span and largest horizontal bound in m of each outage, in time order."""
    out = []
    for aid, spans in found.record.outages.items():
        for span in spans:
            worst = worst_within(found.record, span)
            if worst is not None:
                out.append((aid, span, worst[0]))
    return sorted(out, key=lambda o: (o[1].begin, o[0]))


def cautions(found: NavigationFound, *, brief: bool = False) -> tuple[tuple[str, str], ...]:
    """Return the cautions, each with its number; brief, without those that the tables show."""
    shown = () if brief else (*_memory(found), *_refused(found), *_not_told(found))
    return (
        *_outages(found),
        *_ended_without(found),
        *_heading_caution(found),
        *shown,
        *agreement_words(found),
    )


def _outages(found: NavigationFound) -> list[tuple[str, str]]:
    outages = longest_outages(found)
    if not outages:
        return []
    total = sum(s.end - s.begin for _, s, _ in outages)
    aid, span, bound = max(outages, key=lambda o: o[2])
    count = "one outage" if len(outages) == 1 else f"{len(outages)} outages"
    return [
        (
            "In outages the place is known less",
            f"{count}, {duration_words(total)} in all; the largest bound of 95{GAP}% is "
            f"{length_words(bound)}, at the end of {duration_words(span.end - span.begin)} without "
            f"{aid} from {instant(span.begin)}.",
        )
    ]


def _ended_without(found: NavigationFound) -> list[tuple[str, str]]:
    end = float(found.record.trajectory.index[-1])
    late = [(a, s) for a, s, _ in longest_outages(found) if s.end >= end - 1e-6]
    return [
        (
            f"It ended without {aid}",
            f"the last {duration_words(span.end - span.begin)}; what is said of the end is by the "
            "inertial sensors alone, and a fix would mend it.",
        )
        for aid, span in late
    ]


def _heading_caution(found: NavigationFound) -> list[tuple[str, str]]:
    bound = half(found.record.sd["heading"].iloc[-1])
    if bound < 2.0:
        return []
    how = "is not known" if bound >= _NO_HEADING else f"is known to {plain(bound, 1)}° alone"
    return [
        (
            f"The heading {how}",
            "without fixes its error turns the way that is gone: "
            f"{plain(min(100.0, 100.0 * math.radians(min(bound, 90.0))), 1)}{GAP}% of it aside. "
            "Speeding up, braking and turning with fixes find it, or a receiver with two antennas.",
        )
    ]


def _memory(found: NavigationFound) -> list[tuple[str, str]]:
    out = []
    for one in found.agreements:
        if one.remembers:
            out.append(
                (
                    f"What is left of {one.name} is no noise",
                    f"an epoch is like the one before it (correlation {plain(one.correlation, 2)}, "
                    f"by chance up to {plain(one.correlation_bound, 2)}): its errors last, and the "
                    "bounds are narrower than they should be. Look for a time offset, a lever arm, "
                    "or noise of the sensors that is stated too small.",
                )
            )
    return out


def _refused(found: NavigationFound) -> list[tuple[str, str]]:
    rows = [
        f"{one.rejected} of {one.epochs} epochs of {one.name}"
        for one in found.agreements
        if one.rejected
    ]
    if not rows:
        return []
    return [("Some observations were rejected", f"{', '.join(rows)}; they stand as crosses.")]


def _not_told(found: NavigationFound) -> list[tuple[str, str]]:
    """States whose bounds hardly decreased."""
    sd = found.filtered.sensors_sd
    if len(sd) < 2:
        return []
    names = []
    for block in blocks_of(found.filtered):
        first = sd[list(block.columns)].iloc[0].to_numpy()
        last = sd[list(block.columns)].iloc[-1].to_numpy()
        some = [
            label
            for label, a, b in zip(block.labels, first, last, strict=True)
            if a > 0.0 and b > (1.0 - _FELL) * a
        ]
        if some:
            names.append(f"{block.name} {', '.join(some)}" if len(block.labels) > 1 else block.name)
    if not names:
        return []
    return [
        (
            "This motion did not tell everything",
            f"as unknown as at the start, to {plain(100.0 * _FELL, 0)}{GAP}%: {'; '.join(names)}.",
        )
    ]


def _heading(found: NavigationFound) -> str:
    bound = half(found.record.sd["heading"].iloc[-1])
    return (
        "not at all"
        if bound >= _NO_HEADING
        else f"to {about(0.0, bound, '°').split('±')[1].strip()}"
    )


def _duration(found: NavigationFound) -> float:
    time = found.record.trajectory.index
    return float(time[-1] - time[0])


# Effect of the smoother: bounds and errors beside those of the filter alone.


Array = NDArray[np.float64]

#: A smaller share of the differences within three standard deviations is not due to chance.
SHARE = 0.95
UNITS = dict.fromkeys(NED, "m") | dict.fromkeys(VELOCITY, "m/s") | dict.fromkeys(EULER, "°")


def smoothing_chart(found: NavigationFound) -> Chart | None:
    """Bounds of position, height and heading over time, filter and smoother."""
    forward, record = found.told.forward, found.record
    if forward is None:
        return None
    panels = []
    for label, of in (
        ("horizontal, m", _plane),
        ("height, m", lambda one: _bound(one, "down")),
        ("heading, deg", lambda one: _bound(one, "heading")),
    ):
        lines = tuple(
            curve(name, one.sd.index.to_numpy(), of(one), colour, "solid", width, buckets=BUCKETS)
            for name, one, colour, width in (
                ("filter", forward, GREY, 1.2),
                ("smoothed", record, BLUE, 1.6),
            )
        )
        panels.append(Panel(label, lines, log=True))
    return over_time(
        "smoothing",
        "What later observations told",
        "Bounds of 95 %: of the filter, by what came before; smoothed, by what came after, too.",
        tuple(panels),
        record,
    )


def smoothing_table(found: NavigationFound) -> TableBlock | None:
    """Median bounds and errors against the truth, filter and smoother."""
    forward, agreement = found.told.forward, found.smoother
    if forward is None or agreement is None:
        return None
    rows = []
    for k, column in enumerate(agreement.columns):
        before, after = (float(np.median(_bound(one, column))) for one in (forward, found.record))
        rows.append(
            (
                f"{column}, {UNITS[column]}",
                _figure(before),
                _figure(after),
                plain(before / after, 1) if after > 0.0 else "–",
                *_errors(found, column),
                share_words(float(agreement.share[k])) if agreement.instants[k] else "–",
            )
        )
    return TableBlock(
        (
            *("", "filter", "smoothed", "times less"),
            *(() if found.errors is None else ("error of filter", "smoothed")),
            "agree",
        ),
        tuple(rows),
        text=(0,),
        caption="Bounds of 95 %, medians over the run"
        + ("" if found.errors is None else "; errors against the truth, root mean square")
        + "; and how often the two are within three of "
        "the standard deviations that their covariances leave for the difference (99.7 % where "
        "the model is right).",
        strong=tuple(k for k in range(len(rows)) if _apart(agreement, k)),
    )


def _errors(found: NavigationFound, column: str) -> tuple[str, ...]:
    """RMS errors of filter and smoother, if the truth is known."""
    if found.errors is None or found.forward_errors is None:
        return ()
    return tuple(_figure(one.score(column).rms) for one in (found.forward_errors, found.errors))


def smoothing_words(found: NavigationFound) -> str | None:
    """Effect of the smoother in a sentence."""
    forward = found.told.forward
    if forward is None:
        return None
    before, after = (float(np.median(_plane(one))) for one in (forward, found.record))
    heading = [float(np.median(_bound(one, "heading"))) for one in (forward, found.record)]
    return (
        "Smoothed: every state is by all observations, later ones too. In the median the bound of "
        f"the place is {_figure(after)} m where the filter had {_figure(before)} m, that of the "
        f"heading {_figure(heading[1])}° where it had {_figure(heading[0])}°."
    )


def agreement_words(found: NavigationFound) -> tuple[tuple[str, str], ...]:
    """Cautions where filter and smoother are inconsistent."""
    agreement = found.smoother
    if agreement is None:
        return ()
    apart = [k for k in range(len(agreement.columns)) if _apart(agreement, k)]
    if not apart:
        return ()
    worst = min(apart, key=lambda k: agreement.share[k])
    named = ", ".join(agreement.columns[k] for k in apart)
    return (
        (
            "Filter and smoother do not agree",
            f"in {named}: of {agreement.columns[worst]} {share_words(agreement.share[worst])} of "
            "the differences are within three of the standard deviations that are expected of "
            "them. Later observations speak against the model: look for errors of the sensors "
            "that last or change and are not stated ([sensors], [states.NAME]).",
        ),
    )


def _apart(agreement: SmootherConsistency, k: int) -> bool:
    return bool(agreement.instants[k] > 0 and agreement.share[k] < SHARE)


def _bound(record: NavigationRecord, column: str) -> Array:
    """95 % bound of a component at the covariance marks."""
    return TWO_SIDED_95 * record.sd[column].to_numpy(dtype=np.float64)


def _plane(record: NavigationRecord) -> Array:
    """95 % bound of the horizontal position at the covariance marks."""
    return plane_bound(record.covariance)


def _figure(value: float) -> str:
    return f"{value:.3g}" if value < 1000.0 else f"{value:.0f}"
