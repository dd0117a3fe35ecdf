"""Results of an outage prediction in words: the answer, its limiting sources, and remedies."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from strapdown.constants import DEG_PER_HOUR, MICRO_G, TWO_SIDED_95
from strapdown.navigation.outage import Share
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
    dots,
)
from strapdown.report.document import (
    Document,
    Facts,
    KeyFigure,
    KeyFigures,
    Paragraph,
    TableBlock,
    assumed,
    document_of,
    paragraph,
    run_again,
    section,
    table_of,
)
from strapdown.report.plan import ellipse
from strapdown.report.values import (
    GAP,
    KMH,
    NOT_ESTIMATED,
    duration_words,
    half,
    length_words,
    plain,
    share_words,
    shown_unit,
    three_digits,
)
from strapdown.systems.outage_run import Drift, OutageRun

_WORDS = {
    "position": "position at the start",
    "velocity": "velocity at the start",
    "tilt": "tilt at the start",
    "heading": "heading at the start",
    "gyro_noise": "gyro white noise",
    "accel_noise": "accelerometer white noise",
    "gyro_bias": "gyro bias at the start",
    "accel_bias": "accelerometer bias at the start",
    "gyro_instability": "gyro bias instability",
    "accel_instability": "accelerometer bias instability",
    "gyro_scale": "gyro scale factor",
    "accel_scale": "accelerometer scale factor",
    "gyro_misalignment": "gyro misalignment",
    "accel_misalignment": "accelerometer misalignment",
    "g_sensitivity": "gyro g-sensitivity",
}
_REMEDIES = {
    "position": "the drift hardly exceeds the uncertainty of the initial position: a better "
    "initial position would help",
    "velocity": "Doppler velocities, or more fixes, before the outage would help; so would an "
    "odometer during it",
    "tilt": "a drive with turns and changes of speed, or a standstill, shortly before the outage "
    "separates tilt from accelerometer bias; a less biased accelerometer would help more",
    "heading": "turns or changes of speed before the outage make the heading known; a second "
    "antenna or a better gyro would help more",
    "gyro_noise": "no calibration removes white noise: a gyro with less angle random walk would "
    "help, or a measurement that remains",
    "accel_noise": "no calibration removes white noise: an accelerometer with less noise "
    "would help, or a measurement that remains",
    "gyro_bias": "a standstill before the outage determines the gyro biases; else a gyro with "
    "a more stable bias would help",
    "accel_bias": "turns and changes of speed before the outage separate accelerometer biases "
    "from tilts; else an accelerometer whose bias is smaller would help",
    "gyro_instability": "the bias changes within the outage and cannot be calibrated before: a "
    "gyro with a more stable bias would help",
    "accel_instability": "the bias changes within the outage and cannot be calibrated before: an "
    "accelerometer with a more stable bias would help",
    "gyro_scale": "turns to both sides before the outage, or a calibration, would determine it",
    "accel_scale": "changes of speed before the outage, or a calibration, would determine it",
    "gyro_misalignment": "a calibration of the axes would remove it",
    "accel_misalignment": "a calibration of the axes would remove it",
    "g_sensitivity": "a calibration of the gyros under tilt would remove it",
}
aids_name = "noise of the remaining measurements"


def source_words(name: str) -> str:
    """Name of a drift source in words."""
    aid, dot, own = name.rpartition(".")
    if dot:
        return f"{aid}: {own.replace('_', ' ')}"
    return _WORDS.get(name, name.replace("_", " "))


def at_start(share: Share, result: OutageRun) -> str:
    """Size of an error source at the start of the outage, with its unit."""
    name = share.source.name
    triad = result.sensors.gyro if name.startswith("gyro") else result.sensors.accel
    if name.endswith("_noise"):
        density = float(np.max(triad.axis("noise_density")))
        if name.startswith("gyro"):
            return f"{three_digits(density * DEG_PER_HOUR / 60.0)}{GAP}deg/√h"
        return f"{three_digits(density * MICRO_G)}{GAP}µg/√Hz"
    if name.endswith("_instability"):
        gyro = name.startswith("gyro")
        drift = result.sensors.gyro_drift if gyro else result.sensors.accel_drift
        size = max(drift.triad)
        if not size or math.isinf(drift.correlation_time):
            return "–"
        factor, unit = shown_unit("rad/s" if gyro else "m/s²", size)
        over = duration_words(drift.correlation_time)
        return f"{three_digits(factor * size)}{GAP}{unit} over {over}"
    if not share.sd.size:
        return "–"
    low, high = float(share.sd.min()), float(share.sd.max())
    factor, unit = shown_unit(share.source.unit, high)
    if high <= 1.2 * low:
        return f"{three_digits(factor * high)}{GAP}{unit}"
    return f"{three_digits(factor * low)} to {three_digits(factor * high)}{GAP}{unit}"


def drifts_of(outages: Sequence[Drift]) -> list[Drift]:
    """Return the outages of which fixes show the drift."""
    return [d for d in outages if d.time.size]


def left_out_words(result: OutageRun) -> str:
    """Outages and fixes that do not count, and why; empty if all do."""
    late = [d.since_fix for d in result.drifts if not d.whole]
    rejected = sum(d.rejected for d in result.drifts)
    said = []
    if late and len(late) < len(result.drifts):
        outages = "1 outage that begins" if len(late) == 1 else f"{len(late)} outages that begin"
        said.append(
            f"Left out of bounds and drifts: {outages} up to {duration_words(max(late))} after the "
            "last fix, so that the position is without fixes for longer"
        )
    elif late:
        said.append(
            f"No outage begins with a fix: the last one is up to {duration_words(max(late))} before"
        )
    if rejected:
        said.append(
            f"{rejected} withheld {'fix' if rejected == 1 else 'fixes'} that the run with fixes "
            f"rejects {'is' if rejected == 1 else 'are'} left out"
        )
    return "".join(f" {one}." for one in said)


def end_bound(result: OutageRun) -> float:
    """95 % bound at the end of the outage, m; over all outage tests, if there were any."""
    return float(result.cone[1][-1])


def motion_words(result: OutageRun) -> str:
    """The motion in words."""
    if result.navigation is not None:
        return "along its own trajectory"
    asked = result.spec.motion
    speed, to = asked.speed_m_per_s, asked.to_speed_m_per_s
    if to is not None and to != speed:
        return f"from {_speed(speed)} to {_speed(to)}"
    if not speed:
        return "stationary"
    if asked.turn_rate_deg_per_s:
        side = "right" if asked.turn_rate_deg_per_s > 0.0 else "left"
        rate = plain(abs(asked.turn_rate_deg_per_s), 1)
        return f"at {_speed(speed)}, turning {side} with {rate}{GAP}deg/s"
    return f"straight on at {_speed(speed)}"


def _speed(value: float) -> str:
    return f"{value:g}{GAP}m/s ({plain(KMH * value, 0)}{GAP}km/h)"


def start_words(result: OutageRun) -> str:
    """Knowledge of the state at the start of the outage, and its origin."""
    if result.drifts:
        return "the filter's covariance at each outage"
    start, begin = result.spec.start, result.forecast.begin
    stated = [
        name.partition("_sd_")[0].replace("_", " ")
        for name in type(start).model_fields
        if "_sd_" in name and not name.startswith("fix") and getattr(start, name) is not None
    ]
    if not begin:
        text = "the covariance after an alignment, and the data sheet"
    else:
        text = (
            f"the covariance after {duration_words(begin)} of driving with fixes of "
            f"{start.fix_position_sd_m:g}{GAP}m and {start.fix_velocity_sd_m_per_s:g}{GAP}m/s "
            "each second"
        )
    return text if not stated else f"{text}; stated: {', '.join(stated)}"


def outage_words(result: OutageRun) -> str:
    """Length of the outage: ``60 s``."""
    seconds = result.spec.outage_s
    return f"{seconds:g}{GAP}s" if seconds < 600.0 else duration_words(seconds)


def headline(result: OutageRun) -> str:
    """Return the answer in a sentence."""
    outage = outage_words(result)
    said = (
        f"after {outage} {motion_words(result)}, 95 % of drifts are within "
        f"{length_words(end_bound(result))}"
    )
    if result.stays:
        said += f", with {', '.join(result.stays)}"
    return f"{result.name}: {said}"


def remedy(result: OutageRun) -> str:
    """Return the largest contributor to the drift, and its remedy."""
    parts = _parts(result)
    (_, share, first), (_, last, source) = parts[0], parts[-1]
    if source is None and last > share:
        share = last
        return (
            f"The largest share, {share_words(share)} of the variance, is {aids_name}: they limit "
            "the drift."
        )
    assert first is not None
    words = _REMEDIES.get(first.source.name, "a more accurate value would help")
    return (
        f"The largest share, {share_words(float(share))} of the variance, is "
        f"{source_words(first.source.name)} ({at_start(first, result)}): {words}."
    )


def inside_words(result: OutageRun) -> str:
    """Number of observed drifts within the predicted bound; empty if none were observed."""
    drifts = drifts_of(result.equal)
    if not drifts:
        return left_out_words(result).strip()
    fixes = np.concatenate([d.inside for d in drifts])
    of = f"{share_words(float(fixes.mean()))} of {len(fixes)} fixes are within their 95 % bounds."
    ended = [d for d in drifts if d.to_end]
    if ended:
        ends = [bool(d.inside[-1]) for d in ended]
        middle = float(np.median([d.horizontal[-1] for d in ended]))
        worst = max(float(d.horizontal[-1]) for d in ended)
        where = "" if len(ended) == len(drifts) else f" of the {len(ended)} with fixes to the end"
        of = (
            f"the final drift{where} is {length_words(middle)} in the median and "
            f"{length_words(worst)} at most; {sum(ends)} of {len(ends)} final drifts and {of}"
        )
    said = f"Measured in {len(drifts)} {'outages' if len(drifts) > 1 else 'outage'}: {of}"
    verdict = result.verdict
    if verdict is not None and not verdict.consistent:
        said += (
            " The bounds are too small: as few within them, or an error as large as "
            f"{length_words(verdict.error)} (bound {length_words(verdict.bound)}), have a "
            f"probability of {share_words(verdict.probability)}."
        )
    return said + left_out_words(result)


def key_figures(result: OutageRun) -> tuple[KeyFigure, ...]:
    """Return the key figures."""
    said = "95 % at the end"
    # Half widths, in SI.
    along, across, up, heading = (
        half(math.sqrt(max(float(result.cone[2][quantity][-1]), 0.0)))
        for quantity in ("along", "across", "vertical", "heading")
    )
    figures = [
        KeyFigure("Horizontal", length_words(end_bound(result)), said),
        KeyFigure("Along track", f"±{GAP}{length_words(along)}", said),
        KeyFigure("Cross track", f"±{GAP}{length_words(across)}", said),
        KeyFigure("Vertical", NOT_ESTIMATED, "the error model has no height")
        if math.isnan(up)
        else KeyFigure("Vertical", f"±{GAP}{length_words(up)}", said),
        KeyFigure("Heading", f"±{GAP}{three_digits(math.degrees(heading))}°", said),
    ]
    if drifts := drifts_of(result.equal):
        fixes = np.concatenate([d.inside for d in drifts])
        of = f"of {len(fixes)} fixes in {len(drifts)} outages"
        figures.append(KeyFigure("Within 95 % bounds", share_words(float(fixes.mean())), of))
    return tuple(figures)


# Report of a GNSS outage prediction: the answer first, then its basis.


def outage_document(result: OutageRun, name: str) -> Document:
    """Return the report of an outage prediction; `name` is that of its folder, to verify it."""
    sections = (
        section("over-time", "Over the outage", time_table(result), parts_chart(result)),
        section("budget", "Error budget of the drift", budget_table(result), budget_chart(result)),
        section("measured", "Measured drift", drift_table(result)),
        section("plane", "From above", plane_chart(result)),
        section(
            "method",
            "Method and assumptions",
            *assumed(*_assumptions(result)),
            Facts(CONVENTIONS),
            *run_again(name),
            folded=True,
        ),
    )
    title = f"Drift of {result.name} over an outage of {outage_words(result)}"
    return document_of(
        title,
        headline(result),
        (
            ("Sensor" if result.navigation is None else "Record", f"{result.name}: {result.what}"),
            ("Motion", motion_words(result)),
            ("Start", start_words(result)),
            ("Remaining measurements", ", ".join(result.stays) or "none"),
        ),
        (
            KeyFigures(key_figures(result)),
            Paragraph(remedy(result), "lead"),
            paragraph(inside_words(result)),
            cone_chart(result),
        ),
        sections,
        footer=title,
    )


CONVENTIONS = (
    ("Horizontal, 95 %", "semi-major axis of the 95 % ellipse of the position"),
    ("Horizontal, 1 sd", "root of the sum of both variances"),
    ("Along, across", "along the velocity; along the heading where stationary"),
    ("Sign of a drift", "computed − true, or computed − fix"),
)


def _assumptions(result: OutageRun) -> list[str]:
    taken = [
        "The drift is the filter's own covariance, propagated over the outage. The share of a "
        "source follows from runs in which it is enlarged and reduced.",
        "Errors are small and normal, and sensors as their data sheet or configuration states: "
        "noise, bias, bias instability, scale factors, misalignments, g-sensitivity where stated. "
        "Vibration beyond the data sheet is not included.",
        "Normal gravity: a deflection of the vertical is not included.",
    ]
    if result.navigation is None:
        taken.append(
            "Before the outage a car drives round blocks to both sides, with changes of speed. "
            "Without turns the initial uncertainty is larger, after a standstill smaller."
        )
    return taken


# Tables of an outage prediction: drift over time, error budget, observed drifts.


#: Fractions of an outage in the table.
_AT = (0.0, 1.0 / 6.0, 1.0 / 3.0, 0.5, 2.0 / 3.0, 5.0 / 6.0, 1.0)
#: Characters of a full-length bar.
_BAR = 20
#: Smallest share of the variance with its own row.
_LEAST = 5e-4


def time_table(result: OutageRun) -> TableBlock:
    """Drift over the outage."""
    grid, bound, variances = result.cone

    def sd(quantity: str, at: float) -> float:
        return math.sqrt(max(float(np.interp(at, grid, variances[quantity])), 0.0))

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
    many = len(result.equal)
    said = "" if many < 2 else f" Root mean square over {many} outages."
    sides = (f"{name} ±" for name in ("along", "across", "vertical", "speed", "heading"))
    return TableBlock(
        ("after", "horizontal, 1 sd", "horizontal, 95 %", *sides),
        tuple(rows),
        caption="Horizontal: root of both variances, and semi-major axis of the 95 % ellipse. "
        f"Others: 95 %, 1.96 standard deviations.{said}",
        strong=(len(rows) - 1,),
    )


def budget_table(result: OutageRun) -> TableBlock:
    """Contribution of each error source to the horizontal drift at the end."""
    found, rest = result.forecast, 0.0
    rows = []
    for name, part, share in _parts(result):
        if share is None:
            rows.append((part, name, "", "–"))
        elif abs(part) < _LEAST:
            rest += part
        else:
            alone = float(share.alone["horizontal"][-1])
            size = length_words(alone) if math.isfinite(alone) else "–"
            rows.append((part, name, at_start(share, result), size))
    rows.sort(key=lambda row: -row[0])
    told = [(name, size, alone, *_part(part)) for part, name, size, alone in rows]
    if abs(rest) >= 5e-5:
        told.append(("all others", "", "", *_part(rest)))
    whole = float(found.variance("horizontal")[-1])
    told.append(("total", "", length_words(math.sqrt(whole)), f"100{GAP}%", ""))
    return TableBlock(
        ("source", "1 sd at the start", "alone", "share of the variance", ""),
        tuple(told),
        text=(0, 1, 4),
        caption="Horizontal drift at the end, 1 standard deviation. Alone: without the other "
        "sources. Shares add up to 100 %; initial errors that are correlated, such as tilt and "
        "accelerometer bias, cancel, so a share can be small or negative although the source "
        "alone is large.",
        strong=(len(told) - 1,),
    )


def _parts(result: OutageRun) -> list[tuple[str, float, Share | None]]:
    """Each source of the drift with its share of the final variance; last the measurements."""
    found = result.forecast
    whole = float(found.variance("horizontal")[-1])
    parts: list[tuple[str, float, Share | None]] = [
        (source_words(s.source.name), float(s.variance["horizontal"][-1]) / whole, s)
        for s in found.shares
    ]
    if found.aids:
        parts.append((aids_name, float(found.aids["horizontal"][-1]) / whole, None))
    return parts


def _part(part: float) -> tuple[str, str]:
    size = f"{plain(100.0 * part, 1)}{GAP}%" if part < 0.0 else share_words(min(part, 0.9999))
    return size, "█" * round(_BAR * part) if part > 0.0 else ""


def drift_table(result: OutageRun) -> TableBlock | None:
    """Table of the outage tests."""
    rows = [
        (
            f"{plain(d.span.begin, 1)}{GAP}s",
            duration_words(d.since_fix),
            f"{plain(float(d.time[-1]), 1)}{GAP}s",
            *(length_words(float(v[-1])) for v in (d.horizontal, d.along, d.across, d.down)),
            length_words(float(d.bound[-1])),
            share_words(float(d.inside.mean())),
        )
        for d in drifts_of(result.drifts)
    ]
    return table_of(
        "outage from | after a fix | fixes to | drift | along | across | down | predicted, 95 % "
        "| fixes within",
        rows,
        "Drift at the last fix of each outage, computed − fix, and the share of its fixes "
        "within their 95 % ellipses, which include the noise of the fixes. After a fix: time from "
        "the last fix that was used to the begin.",
        text=(),
    )


# Charts of an outage prediction: the cone over time and from above, and its error budget.


TIME = "time since the outage began, s"
#: Error sources drawn separately; the others are joined.
MOST = 7
#: Share of the total variance below which a source is joined with the others.
_LEAST_PART = 0.005
#: Fractions of the outage at which the plan has an ellipse.
_RINGS = (0.25, 0.5, 0.75, 1.0)
_CORNERS = 90
#: Share by which a bound has fallen that is explained.
_FALL = 0.05
_INSIDE, _OUTSIDE = "measured drift, within its 95 % bound", "beyond its 95 % bound"


def cone_chart(result: OutageRun) -> Chart:
    """Cone over time with the observed drifts, and its error budget."""
    found = result.forecast
    time, bound, variances = result.cone
    sd = np.sqrt(np.maximum(variances["horizontal"], 0.0))
    lines: list[Line] = []
    for d in drifts_of(result.equal):
        lines.append(Line(_INSIDE, d.time, d.horizontal, GREY, "solid", 1.0))
        if not d.inside.all():
            out = ~d.inside
            lines.append(dots(_OUTSIDE, d.time[out], d.horizontal[out], VERMILLION, "circle", 5.0))
    lines += [
        Line("1 standard deviation", time, sd, BLUE, "dash", 1.6),
        Line("95 % bound", time, bound, BLUE, "solid", 2.2),
    ]
    band = Fill("95 % bound", time, np.zeros_like(time), bound, BLUE, 0.13)
    cone = Panel("horizontal drift, m", tuple(lines), fills=(band,), height=1.4)
    fills, note = _stack(result)
    stack = Panel(
        "1 standard deviation, m",
        (Line("total", found.time, found.sd("horizontal"), BLACK, "solid", 1.6),),
        fills=fills,
        title="Shares of the drift",
    )
    return Chart(
        "cone",
        "Horizontal drift over the outage",
        f"Above: horizontal drift.{_tried(result)} Below: its standard deviation, divided by "
        f"shares of the variance.{note}",
        TIME,
        (cone, stack),
    )


def _tried(result: OutageRun) -> str:
    """Abscissa of the curve, and why it can fall."""
    many, said = len(result.equal), ""
    if many > 1:
        said = (
            f" The bound is the root mean square of the predictions for {many} outages of one "
            "length; each drift is compared with its own."
        )
    falls = any(float(np.max(d.bound)) > (1.0 + _FALL) * float(d.bound[-1]) for d in result.equal)
    if falls:
        said += " A bound falls where a remaining measurement, as at a standstill, corrects it."
    return said + left_out_words(result)


def _stack(result: OutageRun) -> tuple[tuple[Fill, ...], str]:
    """Bands of the error sources, as high as their shares of the variance."""
    found = result.forecast
    whole = np.maximum(found.variance("horizontal"), 1e-30)
    parts = [(source_words(s.source.name), s.variance["horizontal"]) for s in found.shares]
    if found.aids:
        parts.append((aids_name, found.aids["horizontal"]))
    signed = [(name, v / whole) for name, v in parts]
    most = {name: float(np.max(v)) for name, v in signed}
    shown = [n for n in sorted(most, key=lambda n: -most[n]) if most[n] > _LEAST_PART][:MOST]
    drawn = [(n, np.maximum(v, 0.0)) for n, v in signed if n in shown]
    rest = np.sum(
        [np.maximum(v, 0.0) for n, v in signed if n not in shown] or [0.0 * whole], axis=0
    )
    if float(rest.max()) > _LEAST_PART:
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
    cancels = any(float(np.min(v)) < -_LEAST_PART for _, v in signed)
    note = " Negative shares, of errors that cancel, are not drawn." if cancels else ""
    if len(result.equal) > 1:
        note += f" Outage from {result.forecast.begin:.1f} s, the median one by its bound."
    return tuple(fills), note


def plane_chart(result: OutageRun) -> Chart:
    """Possible drift seen from above, relative to the true position."""
    found, (time, _, variance) = result.forecast, result.cone
    if not result.drifts:
        c, s = np.cos(found.course), np.sin(found.course)
        P = found.covariance[:, :2, :2]
        turn = np.array([[c, s], [-s, c]]).transpose(2, 0, 1)
        planes = turn @ P @ turn.transpose(0, 2, 1)
    else:
        planes = np.zeros((len(time), 2, 2))
        planes[:, 0, 0] = variance["along"]
        planes[:, 1, 1] = variance["across"]
    lines = []
    for k, (share, dash) in enumerate(
        zip(_RINGS, ("dot", "dashdot", "dash", "solid"), strict=True)
    ):
        at = share * result.spec.outage_s
        row = int(np.argmin(np.abs(time - at)))
        # Cross-track to the right, along-track upward.
        ring = ellipse(np.zeros(2), planes[row][::-1, ::-1], _CORNERS)
        east, north = np.vstack([ring, ring[:1]]).T
        name = f"95 % after {duration_words(at)}"
        lines.append(Line(name, east, north, BLUE, dash, 1.2 + 0.3 * k, inside=0.06))
    for d in drifts_of(result.equal):
        lines.append(Line(_INSIDE, d.across, d.along, GREY, "solid", 1.0))
        name, colour = ("drift at the last fix", GREY) if d.inside[-1] else (_OUTSIDE, VERMILLION)
        lines.append(dots(name, d.across[-1:], d.along[-1:], colour, "circle", 7.0))
    panel = Panel("along track, m", tuple(lines), x_label="cross track, to the right, m")
    return Chart(
        "plane",
        "Drift from above",
        "Computed position relative to the true one, along and cross track, with 95 % ellipses.",
        "cross track, to the right, m",
        (panel,),
    )


def parts_chart(result: OutageRun) -> Chart:
    """Along-track, cross-track, height, speed and heading over the outage."""
    time, _, variances = result.cone
    panels = []
    for label, factor, lines in (
        (
            "position ±, m",
            1.0,
            (
                ("along", "along", VERMILLION, "solid", 1.8),
                ("across", "across", GREEN, "dash", 1.8),
                ("vertical", "vertical", BLUE, "dot", 1.8),
            ),
        ),
        ("velocity ±, m/s", 1.0, (("horizontal speed", "speed", BLACK, "solid", 1.6),)),
        ("heading ±, deg", math.degrees(1.0), (("heading", "heading", BLACK, "dash", 1.6),)),
    ):
        drawn = []
        for name, quantity, colour, dash, width in lines:
            sd = np.sqrt(np.maximum(variances[quantity], 0.0))
            drawn.append(Line(name, time, factor * TWO_SIDED_95 * sd, colour, dash, width))
        panels.append(Panel(label, tuple(drawn)))
    return Chart(
        "parts",
        "Position, velocity and heading drift",
        "95 % bounds (1.96 standard deviations).",
        TIME,
        tuple(panels),
    )


def budget_chart(result: OutageRun) -> Chart:
    """Shares of the variance at the end, largest first."""
    parts = [(name, part) for name, part, _ in _parts(result)]
    kept = sorted((p for p in parts if abs(p[1]) >= _LEAST_PART), key=lambda p: -p[1])
    rest = math.fsum(p for _, p in parts) - math.fsum(p for _, p in kept)
    if abs(rest) >= _LEAST_PART:
        kept.append(("all others", rest))
    bars = Bars(
        "share",
        np.arange(len(kept), dtype=np.float64),
        100.0 * np.array([p for _, p in kept]),
        BLUE,
        labels=tuple(share_words(p) if p > 0.0 else f"{100.0 * p:.1f} %" for _, p in kept),
        legend=False,
    )
    return Chart(
        "budget",
        "Error budget of the drift",
        "Shares of the variance of the horizontal drift at the end of the outage. They add up to "
        "100 %; negative shares cancel others.",
        "share of the variance, %",
        (Panel("", (), categories=tuple(n for n, _ in kept), bars=(bars,)),),
    )
