"""Judge whether an alignment can be trusted, from the evidence in its own record."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.alignment.alignment import Alignment
from strapdown.alignment.fine import ROCKS
from strapdown.alignment.readiness import STAY
from strapdown.constants import DEG_PER_HOUR, MICRO_G, TWO_SIDED_95, Array
from strapdown.errors import Finding
from strapdown.estimation.sensor_blocks import resting_sd
from strapdown.navigation.record import innovation_labels
from strapdown.report.chart import (
    AXIS_COLOURS,
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    SKY,
    Chart,
    Fill,
    Level,
    Line,
    Mark,
    Panel,
    curve,
)
from strapdown.report.document import (
    Document,
    Facts,
    Items,
    KeyFigure,
    KeyFigures,
    Paragraph,
    TableBlock,
    Trust,
    assumed,
    document_of,
    findings_list,
    items_of,
    paragraph,
    reason,
    run_again,
    section,
    table_of,
)
from strapdown.report.values import (
    GAP,
    about,
    decimals,
    force_words,
    heading_shown,
    plain,
    plus_minus,
    rate_words,
    small,
)
from strapdown.report.values import stamp as instant
from strapdown.rotation import within_half_turn
from strapdown.systems.alignment_run import AlignmentRun, reference_offset
from strapdown.tables import ACCEL, EULER, GYRO, QUATERNION
from strapdown.tables.checks import index_of, values_of

ORDER = (2, 1, 0)  # heading first: it is the hardest to determine


def answer_error(result: AlignmentRun) -> tuple[str, Array, float] | None:
    """Return the error against the truth or a reference, deg, with the reference's sd.

    Returns
    -------
    tuple or None
        ``truth`` or the reference's name; roll, pitch, heading; standard deviation in deg.
    """
    if result.source.truth is not None:
        known = result.source.truth
        row = int(np.argmin(np.abs(known.index.to_numpy() - result.end.time)))
        off = result.end.roll_pitch_heading - values_of(known, EULER)[row]
        return "the truth", np.asarray(within_half_turn(off)), 0.0
    stated = result.spec.reference
    if stated is None:
        return None
    off = reference_offset(result.attitude, stated)
    return stated.source or "the reference", off, stated.sd_deg


def trust(result: AlignmentRun) -> Trust:
    """Judge the answer by the evidence in its own record."""
    reasons: list[Finding] = []
    known = answer_error(result)
    if known is not None:
        name, off, own = known
        bound = TWO_SIDED_95 * np.hypot(result.end.sd_deg, own)
        for k in ORDER:
            if math.isfinite(off[k]):
                good = bool(abs(off[k]) <= 3.0 / TWO_SIDED_95 * bound[k])
                within, beyond = "alignment.error-within-bound", "alignment.error-beyond-bound"
                code = within if abs(off[k]) <= bound[k] else beyond
                sizes = {"off_deg": off[k], "bound_deg": bound[k]}
                reasons.append(reason(good, code, angle=EULER[k], reference=name, **sizes))
    # Causes come before their effects.
    told = [*result.unread, *result.coarse.findings]
    told += () if result.fine is None else result.fine.findings
    # The inertial frame alignment is designed for a body that rocks.
    allowed = {ROCKS} if result.coarse.method == "inertial_frame" else set()
    reasons += [f for f in told if f.severity == "warning" and f.code not in allowed]
    reasons += _agreement(result)
    reasons += _surprises(result)
    against = [one for one in reasons if one.severity == "warning"]
    verdict = "trusted" if not against else "reserve"
    # A finding that the bound already includes does not contradict the bound.
    counted = sum(bool(one.data.get("in_bound")) for one in against)
    wrong = known is not None and bool(against) and reasons[0].severity == "warning"
    if len(against) - counted > 1 or wrong:
        verdict = "distrusted"
    short = ["alignment.near-known"] if known is not None else []
    if result.fine is None:
        short.append("alignment.not-contradicted")
    else:
        short += ["alignment.coarse-and-fine-agree", "alignment.sensors-as-expected"]
    return Trust(verdict, tuple(reasons), tuple(reason(True, code) for code in short))


def bounds_hold(result: AlignmentRun) -> bool:
    """Whether the record is consistent with the bounds."""
    return all(one.severity == "note" for one in (*_agreement(result), *_surprises(result)))


def _agreement(result: AlignmentRun) -> list[Finding]:
    """Compare coarse and fine alignment at the end of the coarse alignment."""
    if result.fine is None:
        return []
    time = result.attitude.index.to_numpy()
    row = int(np.argmin(np.abs(time - result.coarse.time)))
    here = values_of(result.attitude, EULER)[row]
    off = within_half_turn(result.coarse.roll_pitch_heading - here)
    bound = TWO_SIDED_95 * np.hypot(result.coarse.sd_deg, result.end.sd_deg)
    out = []
    for k in ORDER:
        good = bool(abs(off[k]) <= bound[k])
        code = "alignment.angle-agrees" if good else "alignment.angle-disagrees"
        out.append(reason(good, code, angle=EULER[k], off_deg=off[k], bound_deg=bound[k]))
    return out


def _surprises(result: AlignmentRun) -> list[Finding]:
    """Check the size of the fine-alignment innovations against their expected covariance."""
    if result.fine is None:
        return []
    out = []
    for name, table in result.fine.innovations.items():
        labels = innovation_labels(table)
        ratios = [float(np.sqrt(np.mean(table[f"nu {x}"] ** 2 / table[f"s {x}"]))) for x in labels]
        worst = max(ratios, default=0.0)
        good = worst < 2.0
        code = "alignment.innovations-larger-than-expected"
        code = "alignment.innovations-as-expected" if good else code
        out.append(reason(good, code, name=name, ratio=worst))
    return out


# Charts of an alignment: readiness, signals, attitude, gyro and accelerometer biases.


_TIME = "time, s"
_NAMES = ("x, forward", "y, right", "z, down")
#: Smallest difference drawn, as a share of the smallest bound.
LEAST = 0.02
BEGUN = " The fine alignment starts from the coarse attitude with a wider covariance."
_OFF = {
    "truth": "error",
    "reference": "difference from the reference",
    "answer": "difference from the final attitude",
}
_OFF_WORDS = {
    "truth": "Dots and thin line: error against the simulated truth.",
    "reference": "Dots and thin line: difference from the stated reference.",
    "answer": "Dots and thin line: difference from the attitude over the whole record, which is an "
    "estimate, not the truth.",
}


def readiness_chart(result: AlignmentRun) -> Chart:
    """Accuracy against alignment time, coarse and fine."""
    found = result.readiness
    length = result.spec.coarse.duration_s
    off = _OFF[found.against]
    panels = []
    for title, angles in (("Heading", ("heading",)), ("Roll and pitch", ("roll", "pitch"))):
        lines: list[Line] = []
        sds = [f"{a}_sd" for a in angles]
        bounds = [t[sds].to_numpy() for t in (found.coarse, found.fine) if not t.empty]
        least = LEAST * TWO_SIDED_95 * min(float(b.min()) for b in bounds) if bounds else 0.0
        for name, table, colour, dash in (
            ("coarse", found.coarse, ORANGE, "dash"),
            ("fine", found.fine, BLUE, "solid"),
        ):
            if table.empty:
                continue
            time = index_of(table)
            kept = time > 0.0
            sd = table[sds].to_numpy().max(axis=1)
            size = np.abs(table[[f"{a}_off" for a in angles]].to_numpy()).max(axis=1)
            size = np.maximum(size, least)
            if found.against == "answer" and name == "fine":
                # The last estimate is the reference itself.
                size[time > 0.9 * time[-1]] = np.nan
            bound = TWO_SIDED_95 * sd[kept]
            lines.append(Line(f"{name}: 95 % bound", time[kept], bound, colour, dash, 2.4))
            coarse: dict[str, Any] = {"points": name == "coarse", "dots": name == "coarse"}
            coarse |= {"colour": colour if name == "coarse" else SKY, "symbol": "circle"}
            apart = f"{name}: {off}", time[kept], size[kept]
            lines.append(Line(*apart, width=1.1, size=6.0, **coarse))
        panels.append(Panel("deg", tuple(lines), log=True, title=title, height=1.2))
    begun = "" if result.fine is None else BEGUN
    return Chart(
        "readiness",
        "Readiness: accuracy against alignment time",
        "95 % bounds; of roll and pitch the larger one. The coarse alignment was repeated over "
        f"each length. {_OFF_WORDS[found.against]}{begun}",
        "time since the start, s",
        tuple(panels),
        () if length is None or result.fine is None else (Mark(length, "fine alignment begins"),),
        log_x=True,
    )


def signal_chart(result: AlignmentRun) -> Chart:
    """Angular rate and specific force: as recorded, as aligned, and 1 s means."""
    drawn = [("recorded", result.source.imu, GREY, 0.8)]
    told = "Thin: samples; black: means over 1 s"
    if result.prefilter is not None:
        drawn.append(("pre-filtered", result.imu, SKY, 1.0))
        told += f", after the pre-filter '{result.prefilter.name}'"
    panels = []
    for columns, factor, label in (
        (GYRO, DEG_PER_HOUR, "rate, deg/h"),
        (ACCEL, 1.0, "force, m/s²"),
    ):
        for column, title in zip(columns, _NAMES, strict=True):
            lines = []
            for name, imu, colour, width in drawn:
                time, values = index_of(imu), factor * imu[column].to_numpy()
                lines.append(curve(name, time, values, colour, width=width, buckets=500))
            lines.append(_means(result.imu, column, factor))
            panels.append(Panel(label, tuple(lines), title=title))
    return Chart(
        "signals",
        "Signals in body axes",
        f"{told}. At rest the rate is the Earth rate and the specific force the reaction to "
        "gravity.",
        _TIME,
        tuple(panels),
    )


def _means(imu: pd.DataFrame, column: str, factor: float) -> Line:
    time = index_of(imu)
    size = max(1, round(1.0 / float(np.median(np.diff(time)))))
    count = max(1, len(time) // size)
    size = min(size, len(time))
    cut = slice(0, count * size)
    value = factor * imu[column].to_numpy()[cut].reshape(count, size).mean(axis=1)
    middle = time[cut].reshape(count, size).mean(axis=1)
    return curve("mean over 1 s", middle, value, BLACK, width=1.1, buckets=500)


def attitude_chart(result: AlignmentRun) -> Chart:
    """Attitude over the record: the aligned attitude propagated by the gyros."""
    table, truth = result.attitude, result.source.truth
    time = index_of(table)
    step = max(1, len(time) // 400)
    panels = []
    carried = NOT_KNOWN not in [angle_bound(result.start, k) for k in (0, 1)]
    for k, angle in enumerate(EULER):
        values, known = (
            np.empty(0)
            if one is None
            else np.degrees(np.unwrap(np.radians(one[angle].to_numpy())))
            if angle == "heading"
            else one[angle].to_numpy()
            for one in (table, truth)
        )
        lines = [curve("attitude", time, values, BLUE, buckets=800)]
        if truth is not None:
            lines.append(curve("truth", truth.index.to_numpy(), known, BLACK, "dot", buckets=800))
        halves = TWO_SIDED_95 * np.array([result.start.sd_deg[k], result.end.sd_deg[k]])
        x, y = time[::step], values[::step]
        half = np.interp(x, time[[0, -1]], halves)
        band = Fill("95 % bound", x, y - half, y + half, BLUE)
        panels.append(Panel(f"{angle}, deg", tuple(lines), fills=(band,) if carried else ()))
    return Chart(
        "attitude",
        "Attitude over the record",
        "The aligned attitude propagated to every sample by the gyros, with its 95 % bound."
        if carried
        else f"The attitude is known at {instant(result.end.time)} only: propagated to the start "
        "by these gyros it is unknown, and the rotation drawn may be their bias.",
        _TIME,
        tuple(panels),
    )


def bias_charts(result: AlignmentRun) -> tuple[Chart, ...]:
    """Gyro and accelerometer biases over the fine alignment."""
    if result.fine is None:
        return ()
    history = result.fine.history
    time = index_of(history)
    out = []
    for sensor, factor, unit, what in (
        ("gyro", DEG_PER_HOUR, "deg/h", "Gyro biases"),
        ("accel", MICRO_G, "µg", "Accelerometer biases"),
    ):
        panels = []
        for axis, name, colour in zip("xyz", _NAMES, AXIS_COLOURS, strict=True):
            value = factor * history[f"{sensor}_bias_{axis}"].to_numpy()
            half = TWO_SIDED_95 * factor * history[f"{sensor}_bias_{axis}_sd"].to_numpy()
            line = curve(name, time, value, colour, width=1.8)
            fill = Fill("95 % bound", time, value - half, value + half, colour)
            panels.append(Panel(unit, (line,), title=name, fills=(fill,)))
        out.append(
            Chart(
                f"{sensor}-biases",
                f"{what}: estimates with 95 % bounds",
                "A bias whose bound does not decrease is not separable from the attitude at rest: "
                "a horizontal accelerometer bias from tilt, an east gyro bias from heading.",
                _TIME,
                tuple(panels),
            )
        )
    return tuple(out)


def innovation_chart(result: AlignmentRun) -> Chart | None:
    """Innovation of each epoch in its own standard deviations."""
    if result.fine is None:
        return None
    panels = []
    for name, table in result.fine.innovations.items():
        time = index_of(table)
        labels = innovation_labels(table)
        lines = []
        for k, label in enumerate(labels):
            ratio = values_of(table, [f"nu {label}"])[:, 0] / np.sqrt(table[f"s {label}"])
            lines.append(curve("xyz"[k % 3], time, ratio, AXIS_COLOURS[k % 3], width=0.9))
        levels = (Level(TWO_SIDED_95, ""), Level(-TWO_SIDED_95, "95 %"))
        panels.append(Panel("in sd", tuple(lines), title=name.capitalize(), levels=levels))
    return Chart(
        "innovations",
        "Innovations of the fine alignment",
        "Measured − predicted, in predicted standard deviations; 95 % are expected between the "
        "levels.",
        _TIME,
        tuple(panels),
    )


#: Half widths of roll, pitch and heading, in deg, that exclude no angle.
ANY = (180.0, 90.0, 180.0)


NOT_KNOWN = "unknown"


def angle_bound(alignment: Alignment, which: int) -> str:
    """Format an angle with its bound: ``90.60° ± 0.12°``; in words if it is undetermined."""
    value = float(alignment.roll_pitch_heading[which])
    half = TWO_SIDED_95 * float(alignment.sd_deg[which])
    if not half < ANY[which]:
        return NOT_KNOWN
    return about(heading_shown(value, half) if which == 2 else value, half, "°")


# Report of an alignment: the answer first, then its basis.


CONVENTIONS = (
    ("Body axes", "forward, right, down; local level: north, east, down"),
    ("Attitude", "roll, pitch, heading (3-2-1): right side down, nose up, clockwise are positive"),
    ("Heading", "from true north, clockwise seen from above"),
    ("Specific force", "as an accelerometer measures: −9.8 m/s² downward at rest"),
    ("Bias", "measured − true"),
    ("Bounds", "95 % (1.96 standard deviations), if sensor errors are as stated"),
    ("Time", "s, on the record's own clock"),
)


def alignment_document(result: AlignmentRun, name: str) -> Document:
    """Return the report of an alignment; `name` is that of its folder, to verify it."""
    found = trust(result)
    site = result.site
    refused = result.readiness.refused
    turns = turn_table(result)
    separated = (
        "At one attitude a horizontal accelerometer bias is not separable from tilt, nor an east "
        "gyro bias from heading. A turn separates them: the bias turns with the body, the tilt "
        "does not."
    )
    sections = (
        section(
            "answer",
            "The answer",
            answer_table(result),
            *found.blocks,
            Paragraph("Limited by:"),
            Items(limits(result)),
        ),
        section("attitude", "Attitude over the record", attitude_chart(result)),
        section(
            "sensors",
            "Sensor biases",
            bias_table(result),
            *bias_charts(result),
            innovation_chart(result),
        ),
        section("more", "Effect of a turn", paragraph(separated if turns else None), turns),
        section("signals", "Signals", signal_chart(result), folded=True),
        section(
            "findings",
            "Findings",
            findings_list(result.findings),
            items_of(
                (
                    "readiness",
                    f"{len(refused)} shorter lengths, up to {max(r[0] for r in refused):.3g} "
                    f"s, gave no attitude: {last.sentence()}.",
                )
                for _, last in refused[-1:]
            ),
        ),
        section(
            "method",
            "Method and assumptions",
            Facts(method_rows(result)),
            *assumed(
                "The body is stationary; it may rock and sway as far as the coarse alignment "
                "allows.",
                "Sensor errors are as stated. Every bound depends on this.",
                "Normal gravity of the ellipsoid: a deflection of the vertical of 5 arc seconds is "
                "0.0014° of tilt, and is not in the bounds.",
            ),
            *run_again(name),
            folded=True,
        ),
        section("conventions", "Conventions", Facts(CONVENTIONS), folded=True),
    )
    given = result.spec.sensors
    stated = ", ".join((*(f"gyro {k}" for k in given.gyro), *(f"accel {k}" for k in given.accel)))
    title = result.spec.title or f"Alignment of {result.source.name}"
    return document_of(
        title,
        headline(result),
        (
            ("Record", f"{result.source.name}, {result.source.what}"),
            ("Position", f"{site.lat_deg:.6f}°, {site.lon_deg:.6f}°, {site.alt:g} m"),
            ("Sensors", "; ".join(p for p in (given.sensor, stated and f"stated: {stated}") if p)),
        ),
        (
            KeyFigures(key_figures(result)),
            found.paragraph,
            Items(limits(result)),
            readiness_chart(result),
            readiness_table(result),
        ),
        sections,
        footer=title,
    )


def headline(result: AlignmentRun) -> str:
    """Return the answer in one sentence."""
    end = result.end
    angles = ", ".join(f"{EULER[k]} {angle_bound(end, k)}" for k in ORDER)
    bounds = "95 % bounds"
    if not bounds_hold(result):
        bounds += ", which the record contradicts"
    return f"{angles[0].upper()}{angles[1:]} at {instant(end.time)} ({bounds})."


def key_figures(result: AlignmentRun) -> tuple[KeyFigure, ...]:
    """Return the key figures at the top of the page."""
    out = []
    for k in ORDER:
        said, half = angle_bound(result.end, k), TWO_SIDED_95 * float(result.end.sd_deg[k])
        bound = f"no 95{GAP}% bound"
        if said != NOT_KNOWN and not bounds_hold(result):
            bound = f"the record contradicts the 95{GAP}% bound"
        elif said != NOT_KNOWN:
            sd = plain(float(result.end.sd_deg[k]), decimals(half, least=1, most=5))
            bound = f"95{GAP}% bound; standard deviation {sd}°"
        note = f"at the end; at the start {angle_bound(result.start, k)}"
        out.append(KeyFigure(EULER[k].capitalize(), said, bound, note))
    return tuple(out)


def limits(result: AlignmentRun) -> tuple[tuple[str, str], ...]:
    """Return the limiting error sources and their remedies."""
    gyro, accel = prior_sd(result)
    middle = values_of(result.attitude, QUATERNION)[len(result.attitude) // 2]
    c_nb = rotation.dcm_from_quaternion(middle)
    tilt = float(np.linalg.norm(c_nb[:2] * accel, axis=1).max())
    g = float(np.linalg.norm(result.site.gravity))
    return (
        _heading_limit(result, float(np.linalg.norm(c_nb[1] * gyro))),
        (
            "Accelerometer bias limits roll and pitch",
            f"one standard deviation of bias, scale factor and misalignment, {force_words(tilt)}, "
            f"is {small(math.degrees(tilt / g))}° of tilt; at one attitude they are not separable.",
        ),
    )


def _heading_limit(result: AlignmentRun, east: float) -> tuple[str, str]:
    """Limit of the heading for a 1-sigma east gyro drift in rad/s."""
    coarse, heading = result.coarse, float(result.end.sd_deg[2])
    across = float(np.linalg.norm(result.site.earth_rate[:2]))
    hidden = (
        f"the horizontal Earth rate is {small(across * DEG_PER_HOUR)} deg/h, and one standard "
        f"deviation of the gyro errors {rate_words(east)}"
    )
    if coarse.method == "levelling":
        other = "take it from GNSS fixes while driving (gnss_course)."
        if across > east:
            other = "determine it by these gyros (inertial_frame)."
        return (
            "The heading was not determined",
            f"leveling gives roll and pitch only; {hidden}: state the heading (known_heading), "
            f"or {other}",
        )
    if coarse.heading_given and not across > east:
        told = "GNSS course" if coarse.method == "gnss_course" else "stated heading"
        said = f"{hidden}: the gyros cannot find north."
        return f"The heading is as good as the {told}", said
    part = math.degrees(east / across) if across > 0 else math.inf
    told = (
        f"one standard deviation of bias, scale factor and misalignment about east, "
        f"{small(east * DEG_PER_HOUR)} deg/h, is {small(part)}° of heading at this latitude; the "
        f"heading's standard deviation is {small(heading)}°"
    )
    if coarse.heading_given and heading < 0.7 * part:
        return ("The stated heading limits it", f"{told}: state it more accurately.")
    if part > 0.7 * heading:
        why = "longer alignment at the same attitude does not help; better or calibrated gyros do"
        return ("Gyro bias limits the heading", f"{told}: {why}.")
    return ("Noise and motion limit the heading", f"{told}: a longer or quieter alignment helps.")


def prior_sd(result: AlignmentRun) -> tuple[Array, Array]:
    """Standard deviations of the gyro and accelerometer errors before any estimation."""
    rate, force = (values_of(result.imu, columns).mean(axis=0) for columns in (GYRO, ACCEL))
    return resting_sd(result.sensors, rate, force)


# Tables of an alignment: attitude, sensor errors, and method.


#: Times since the start in the readiness table, s.
SHOWN = (30.0, 60.0, 100.0, 300.0, 600.0)


def answer_table(result: AlignmentRun) -> TableBlock:
    """Attitude at start and end from both alignments."""
    known = answer_error(result)
    columns = ["", "start", "end", "coarse alone"]
    found = (result.start, result.end, result.coarse)
    rows = [[EULER[k], *(angle_bound(one, k) for one in found)] for k in ORDER]
    rows.append(["time", *(instant(one.time) for one in found)])
    if known is not None:
        columns.append(f"end − {known[0]}")
        for row, k in zip(rows, ORDER, strict=False):
            off = float(known[1][k])
            half = TWO_SIDED_95 * known[2]
            row.append(about(off, half, "°") if known[2] else f"{plain(off, 4)}°")
        rows[-1].append("")
    return TableBlock(tuple(columns), tuple(map(tuple, rows)), strong=(0,))


def bias_table(result: AlignmentRun) -> TableBlock | None:
    """Estimated gyro and accelerometer biases, and the reduction of their uncertainty."""
    if result.fine is None:
        return None
    end = result.fine.alignment
    rows = []
    gyro, accel = prior_sd(result)
    for name, bias, sd, prior, factor, unit in (
        ("gyro", end.gyro_bias, end.gyro_bias_sd, gyro, DEG_PER_HOUR, "deg/h"),
        ("accelerometer", end.accel_bias, end.accel_bias_sd, accel, MICRO_G, "µg"),
    ):
        assert bias is not None and sd is not None
        for k, axis in enumerate(_NAMES):
            known = 1.0 - float(sd[k] / prior[k]) if prior[k] > 0 else 0.0
            rows.append(
                (
                    f"{name} {axis}",
                    about(factor * float(bias[k]), TWO_SIDED_95 * factor * float(sd[k]), unit),
                    plus_minus(TWO_SIDED_95 * factor * float(prior[k]), unit),
                    "no" if known < 0.1 else "yes" if known > 0.7 else "partly",
                )
            )
    caption = "95 % bounds. Another attitude would make the others observable."
    return table_of("sensor | estimate | before | observable", rows, caption, text=(0, 3))


def readiness_table(result: AlignmentRun) -> TableBlock:
    """Heading and level accuracy after given alignment times."""
    found = result.readiness
    whole = float(result.imu.index[-1] - result.imu.index[0])
    times = [t for t in SHOWN if t < 0.97 * whole] + [whole]
    rows = []
    tables = [("coarse", found.coarse), ("fine", found.fine)]
    tables = [(name, table) for name, table in tables if not table.empty]
    for time in times:
        cells = [f"{time:.0f} s"]
        for _, table in tables:
            for names in (("heading_sd",), ("roll_sd", "pitch_sd")):
                at = index_of(table)
                sizes = table[list(names)].to_numpy().max(axis=1)
                inside = at[0] <= time * 1.001
                # The tested lengths are evenly spaced in their logarithm.
                where = np.log(np.maximum(at, 1e-9))
                value = np.exp(np.interp(np.log(time), where, np.log(sizes))) if inside else np.nan
                cells.append(_bound(TWO_SIDED_95 * value, names[0]))
        rows.append(tuple(cells))
    columns = [
        "after",
        *(f"{name}: {what} ±" for name, _ in tables for what in ("heading", "level")),
    ]
    return TableBlock(tuple(columns), tuple(rows))


def _bound(half: float, name: str) -> str:
    if math.isnan(half):
        return "–"
    return f"{small(half)}°" if half < (180.0 if name == "heading_sd" else 90.0) else NOT_KNOWN


_TURN_WORDS = {
    STAY: "leave it unchanged",
    "heading-90": "turn it by 90° about the vertical",
    "heading-180": "turn it by 180° about the vertical",
    "roll-90": "roll it by 90° onto its side",
    "pitch-90": "pitch it by 90° onto its nose",
}


def turn_table(result: AlignmentRun) -> TableBlock | None:
    """Predicted accuracy after a turn and a further stationary stretch, best heading first."""
    rows, rest = [], 0.0
    for one in result.manoeuvres:
        gyro = TWO_SIDED_95 * DEG_PER_HOUR * float(np.max(one.gyro_bias_sd))
        accel = TWO_SIDED_95 * MICRO_G * float(np.max(one.accel_bias_sd))
        rest = rest or one.rest
        rows.append(
            (
                _TURN_WORDS[one.name],
                f"{small(TWO_SIDED_95 * float(one.sd_deg[2]))}°",
                f"{small(TWO_SIDED_95 * float(one.sd_deg[:2].max()))}°",
                f"{small(gyro)} deg/h",
                f"{plain(accel, 0 if accel >= 10.0 else 1)} µg",
            )
        )
    return table_of(
        "first | heading ± | level ± | worst gyro ± | worst accelerometer ±",
        rows,
        f"Predicted 95 % bounds after a further rest of {rest:.0f} s.",
        strong=(0,),
    )


def method_rows(result: AlignmentRun) -> tuple[tuple[str, str], ...]:
    """Slots of the chain with their modules."""
    spec = result.spec
    rows = [("Record", f"{result.source.name}: {result.source.what}")]
    if result.prefilter is not None:
        replaced = f"{len(result.prefilter.replaced)} samples replaced as outliers"
        rows.append(("Pre-filter", f"{spec.prefilter.kind}, {replaced}"))
    length = spec.coarse.duration_s
    over = "over the whole record" if length is None else f"over the first {length:g} s"
    rows.append(("Coarse alignment", f"{spec.coarse.kind}, {over}"))
    if result.fine is not None:
        chosen = [
            f"{key.replace('_', ' ')} {value.kind}"
            for key in ("mechanization", "error_model", "covariance", "update_rule")
            if (value := getattr(spec.fine, key, None)) is not None
        ]
        over = "over the whole record" if length is None else "after the coarse alignment"
        rows.append(("Fine alignment", f"{spec.fine.kind}, {over}: {', '.join(chosen)}"))
    return tuple(rows)
