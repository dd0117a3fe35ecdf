"""Report of an alignment: the answer first, then its basis."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from strapdown import __version__, rotation
from strapdown.constants import DEG_PER_HOUR, MICRO_G, TWO_SIDED_95
from strapdown.errors import Finding
from strapdown.estimation.sensor_blocks import resting_sd
from strapdown.report import alignment_charts as charts
from strapdown.report.alignment_trust import ORDER, answer_error, bounds_hold, trust
from strapdown.report.document import (
    Block,
    ChartBlock,
    Document,
    Facts,
    Items,
    KeyFigure,
    KeyFigures,
    Paragraph,
    Section,
    TableBlock,
    findings_list,
)
from strapdown.report.values import (
    GAP,
    NOT_KNOWN,
    about,
    angle_bound,
    force_words,
    plain,
    rate_words,
    small,
)
from strapdown.report.values import (
    alignment_values_instant as instant,
)
from strapdown.systems.alignment_run import AlignmentRun
from strapdown.tables import ACCEL, EULER, GYRO, QUATERNION
from strapdown.tables.checks import values_of

CONVENTIONS = (
    ("Body axes", "forward, right, down; local level: north, east, down"),
    ("Attitude", "roll, pitch, heading (3-2-1): right side down, nose up, clockwise are positive"),
    ("Heading", "from true north, clockwise seen from above"),
    ("Specific force", "what an accelerometer feels: −9.8 m/s² downward at rest"),
    ("Bias", "reading less truth; so the truth is the reading less the bias"),
    (
        "Bounds",
        "hold the truth in 95 of 100 cases (1.96 standard deviations) where what is stated "
        "of the sensors is right",
    ),
    ("Time", "s, on the record's own clock"),
)


def alignment_document(result: AlignmentRun, name: str) -> Document:
    """Return the report of an alignment.

    Parameters
    ----------
    result : AlignmentRun
    name : str
        Folder name, for the verification command.
    """
    found = trust(result)
    site = result.site
    facts = (
        ("Record", f"{result.source.name}, {result.source.what}"),
        ("Place", f"{site.lat_deg:.6f}°, {site.lon_deg:.6f}°, {site.alt:g} m"),
        ("Sensors", _sensors(result)),
        ("Made with", f"strapdown {__version__}"),
    )
    front: tuple[Block, ...] = (
        KeyFigures(key_figures(result)),
        Paragraph(found.sentence, "lead" if found.verdict == "trusted" else "warning"),
        Items(tuple((head, text) for head, text in limits(result))),
        ChartBlock(charts.readiness_chart(result)),
        readiness_table(result),
    )
    sections = (
        Section("answer", "The answer", _answer(result, found.reasons)),
        Section(
            "attitude", "Attitude over the record", (ChartBlock(charts.attitude_chart(result)),)
        ),
        *_biases(result),
        *_more(result),
        Section("signals", "Signals", (ChartBlock(charts.signal_chart(result)),)),
        Section("findings", "Findings", _findings(result)),
        Section("method", "Method and assumptions", _method(result, name)),
        Section("conventions", "Conventions", (Facts(CONVENTIONS),)),
    )
    title = result.spec.title or f"Alignment of {result.source.name}"
    return Document(title, headline(result), facts, front, sections, title)


def _sensors(result: AlignmentRun) -> str:
    given = result.spec.sensors
    stated = [*(f"gyro {k}" for k in given.gyro), *(f"accel {k}" for k in given.accel)]
    parts = [given.sensor or ""] + ([f"stated: {', '.join(stated)}"] if stated else [])
    return "; ".join(p for p in parts if p)


def _answer(result: AlignmentRun, reasons: tuple[Finding, ...]) -> tuple[Block, ...]:
    said = tuple(
        ("For it" if one.severity == "note" else "Against it", f"{one.sentence()}.")
        for one in reasons
    )
    blocks: list[Block] = [answer_table(result)]
    if said:
        blocks += [Paragraph("What speaks for the answer, and what against it:"), Items(said)]
    blocks += [Paragraph("What limits it:"), Items(limits(result))]
    return tuple(blocks)


def _more(result: AlignmentRun) -> tuple[Section, ...]:
    """Section on the accuracy that a turn of the body would add."""
    table = turn_table(result)
    if table is None:
        return ()
    said = (
        "A body that only stands cannot tell a horizontal accelerometer bias from a tilt, nor an "
        "east gyro drift from the heading. A turn can: the bias goes with the body, and the tilt "
        "does not."
    )
    return (Section("more", "What would make more known", (Paragraph(said), table)),)


def _biases(result: AlignmentRun) -> tuple[Section, ...]:
    table: TableBlock | None = bias_table(result)
    if table is None:
        return ()
    innovations = charts.innovation_chart(result)
    blocks: list[Block] = [table, *(ChartBlock(c) for c in charts.bias_charts(result))]
    blocks += [] if innovations is None else [ChartBlock(innovations)]
    return (Section("sensors", "Drifts and biases", tuple(blocks)),)


def _findings(result: AlignmentRun) -> tuple[Block, ...]:
    blocks: list[Block] = [findings_list(result.findings)]
    refused = result.readiness.refused
    if refused:
        text = (
            f"{len(refused)} shorter lengths, up to {max(r[0] for r in refused):.3g} s, gave "
            f"no attitude: {refused[-1][1].sentence()}."
        )
        blocks.append(Items((("readiness", text),)))
    return tuple(blocks)


def _method(result: AlignmentRun, name: str) -> tuple[Block, ...]:
    taken = [
        (
            "",
            "The body stays at its place; it may rock and sway about it as far as the coarse "
            "alignment allows.",
        ),
        ("", "The errors of the sensors are as stated: every bound rests on them."),
        (
            "",
            "Normal gravity of the ellipsoid: a deflection of the vertical of 5 arc seconds is "
            "0.0014° of tilt, and is not in the bounds.",
        ),
    ]
    return (
        Facts(method_rows(result)),
        Paragraph("Taken for given:"),
        Items(tuple(taken)),
        Paragraph("To run it again and compare every byte:"),
        Paragraph(f"strapdown verify {name}", "mono"),
    )


# Results of an alignment in sentences, shared by terminal and page.


Array = NDArray[np.float64]


def headline(result: AlignmentRun) -> str:
    """Return the answer in one sentence."""
    end = result.end
    angles = ", ".join(f"{EULER[k]} {angle_bound(end, k)}" for k in ORDER)
    bounds = "bounds of 95 %"
    if not bounds_hold(result):
        bounds += ", which do not hold here: the record contradicts them"
    return f"{angles[0].upper()}{angles[1:]} at {instant(end.time)} ({bounds})."


def key_figures(result: AlignmentRun) -> tuple[KeyFigure, ...]:
    """Return the key figures at the top of the page."""
    out = []
    for k in ORDER:
        said = angle_bound(result.end, k)
        out.append(
            KeyFigure(
                EULER[k].capitalize(),
                said,
                f"any of them: no bound of 95{GAP}%" if said == NOT_KNOWN else _bound_of(result, k),
                f"at the end; at the start {angle_bound(result.start, k)}",
            )
        )
    return tuple(out)


def _bound_of(result: AlignmentRun, which: int) -> str:
    if not bounds_hold(result):
        return "its bound does not hold: the record contradicts it"
    sd = float(result.end.sd_deg[which])
    return f"95{GAP}% bound; standard deviation {plain(sd, _places(TWO_SIDED_95 * sd))}°"


def _places(half: float) -> int:
    return min(5, max(1, 2 - math.floor(math.log10(half)))) if half > 0 else 2


def limits(result: AlignmentRun) -> tuple[tuple[str, str], ...]:
    """Return the limiting error sources and their remedies."""
    site = result.site
    gyro, accel = prior_sd(result)
    c_nb = _mean_attitude(result)
    out = [_heading_limit(result, float(np.linalg.norm(c_nb[1] * gyro)))]
    g = float(np.linalg.norm(site.gravity))
    level = c_nb[:2] * accel
    tilt = float(np.linalg.norm(level, axis=1).max())
    out.append(
        (
            "The bias of the accelerometers limits roll and pitch",
            f"{force_words(tilt)} too much, one standard deviation of bias, scale and "
            f"misalignment, are {small(math.degrees(tilt / g))}° of tilt; at one attitude no "
            "alignment can tell them apart.",
        )
    )
    return tuple(out)


def _heading_limit(result: AlignmentRun, east: float) -> tuple[str, str]:
    """Limit of the heading for a 1-sigma east gyro drift in rad/s."""
    coarse, heading = result.coarse, float(result.end.sd_deg[2])
    across = float(np.linalg.norm(result.site.earth_rate[:2]))
    hidden = (
        f"the horizontal rate of the Earth is {small(across * DEG_PER_HOUR)} deg/h here, and the "
        f"gyros may read {rate_words(east)} too much (one standard deviation)"
    )
    if coarse.method == "levelling":
        return (
            "The heading was not sought",
            f"levelling finds roll and pitch alone; {hidden}: state the heading (known_heading), "
            + (
                "or find it by these gyros (inertial_frame)."
                if across > east
                else "or take it from satellite fixes while driving (gnss_course)."
            ),
        )
    if coarse.heading_given and not across > east:
        told = "satellite course" if coarse.method == "gnss_course" else "stated heading"
        return (
            f"The heading is as good as the {told}",
            f"{hidden}: they cannot find north themselves.",
        )
    part = math.degrees(east / across) if across > 0 else math.inf
    told = (
        f"{small(east * DEG_PER_HOUR)} deg/h too much about east, one standard deviation of bias, "
        f"scale and misalignment, are {small(part)}° of heading at this latitude; all of the "
        f"heading's standard deviation is {small(heading)}°"
    )
    if coarse.heading_given and heading < 0.7 * part:
        return ("What was stated of the heading limits it", f"{told}: state it better.")
    if part > 0.7 * heading:
        why = "longer alignment at the same attitude does not help; better or calibrated gyros do"
        return ("The bias of the gyros limits the heading", f"{told}: {why}.")
    return ("Noise and motion limit the heading", f"{told}: a longer or quieter alignment helps.")


def prior_sd(result: AlignmentRun) -> tuple[Array, Array]:
    """Standard deviations of the gyro and accelerometer errors before any estimation."""
    rate, force = (values_of(result.imu, columns).mean(axis=0) for columns in (GYRO, ACCEL))
    return resting_sd(result.sensors, rate, force)


def _mean_attitude(result: AlignmentRun) -> Array:
    middle = values_of(result.attitude, QUATERNION)[len(result.attitude) // 2]
    return rotation.dcm_from_quaternion(middle)


# Tables of an alignment: attitude, sensor errors, and method.


#: Times since the start in the readiness table, s.
SHOWN = (30.0, 60.0, 100.0, 300.0, 600.0)


def answer_table(result: AlignmentRun) -> TableBlock:
    """Attitude at start and end from both alignments."""
    known = answer_error(result)
    columns = ["", "start", "end", "coarse alone"]
    if known is not None:
        columns.append(f"end less {known[0]}")
    rows = []
    for k in ORDER:
        row = [
            EULER[k],
            angle_bound(result.start, k),
            angle_bound(result.end, k),
            angle_bound(result.coarse, k),
        ]
        if known is not None:
            row.append(
                about(float(known[1][k]), TWO_SIDED_95 * known[2], "°")
                if known[2]
                else f"{plain(float(known[1][k]), 4)}°"
            )
        rows.append(tuple(row))
    time = ("time", *(instant(a.time) for a in (result.start, result.end, result.coarse)))
    rows.append((*time, "") if known is not None else time)
    return TableBlock(tuple(columns), tuple(rows), text=(0,), strong=(0,))


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
        for k, axis in enumerate(("x, forward", "y, right", "z, down")):
            known = 1.0 - float(sd[k] / prior[k]) if prior[k] > 0 else 0.0
            rows.append(
                (
                    f"{name} {axis}",
                    about(factor * float(bias[k]), TWO_SIDED_95 * factor * float(sd[k]), unit),
                    _half(TWO_SIDED_95 * factor * float(prior[k]), unit),
                    _found(known),
                )
            )
    return TableBlock(
        ("sensor", "estimate", "before", "found by this rest"),
        tuple(rows),
        text=(0, 3),
        caption="Bounds of 95 %. What this rest does not find, another attitude would.",
    )


def _half(half: float, unit: str) -> str:
    """Format a half width alone: ``± 0.02 deg/h``."""
    text = about(0.0, half, unit)
    return text[text.index("±") :]


def _found(share: float) -> str:
    if share < 0.1:
        return "no"
    return "yes" if share > 0.7 else "in part"


def readiness_table(result: AlignmentRun) -> TableBlock:
    """Heading and level accuracy after given alignment times."""
    found = result.readiness
    whole = float(result.imu.index[-1] - result.imu.index[0])
    times = [t for t in SHOWN if t < 0.97 * whole] + [whole]
    rows = []
    for time in times:
        cells = [f"{time:.0f} s"]
        for table in (found.coarse, found.fine):
            for names in (("heading_sd",), ("roll_sd", "pitch_sd")):
                if table.empty:
                    continue
                at = table.index.to_numpy(dtype=np.float64)
                sizes = table[list(names)].to_numpy().max(axis=1)
                inside = at[0] <= time * 1.001
                # The tested lengths are evenly spaced in their logarithm.
                where = np.log(np.maximum(at, 1e-9))
                value = np.exp(np.interp(np.log(time), where, np.log(sizes))) if inside else np.nan
                cells.append(_bound(TWO_SIDED_95 * value, names[0]))
        rows.append(tuple(cells))
    columns = ["after"]
    for name, table in (("coarse", found.coarse), ("fine", found.fine)):
        if not table.empty:
            columns += [f"{name}: heading ±", f"{name}: level ±"]
    return TableBlock(tuple(columns), tuple(rows), text=(0,))


def _bound(half: float, name: str) -> str:
    if math.isnan(half):
        return "–"
    return f"{small(half)}°" if half < (180.0 if name == "heading_sd" else 90.0) else NOT_KNOWN


def turn_table(result: AlignmentRun) -> TableBlock | None:
    """Predicted accuracy after a turn and a further stationary stretch, best heading first."""
    if not result.manoeuvres:
        return None
    rows = []
    for one in result.manoeuvres:
        gyro = TWO_SIDED_95 * DEG_PER_HOUR * float(np.max(one.gyro_bias_sd))
        accel = TWO_SIDED_95 * MICRO_G * float(np.max(one.accel_bias_sd))
        rows.append(
            (
                one.name,
                f"{small(TWO_SIDED_95 * float(one.sd_deg[2]))}°",
                f"{small(TWO_SIDED_95 * float(one.sd_deg[:2].max()))}°",
                f"{small(gyro)} deg/h",
                f"{plain(accel, 0 if accel >= 10.0 else 1)} µg",
            )
        )
    columns = ("first", "heading ±", "level ±", "worst gyro ±", "worst accelerometer ±")
    rest = result.manoeuvres[0].rest
    caption = f"Forecast of the bounds of 95 % after a further rest of {rest:.0f} s."
    return TableBlock(columns, tuple(rows), text=(0,), caption=caption, strong=(0,))


def method_rows(result: AlignmentRun) -> tuple[tuple[str, str], ...]:
    """Slots of the chain with their modules."""
    spec = result.spec
    rows = [("Record", f"{result.source.name}: {result.source.what}")]
    if result.prefilter is not None:
        report = result.prefilter
        replaced = len(report.replaced)
        rows.append(
            ("Pre-filter", f"{spec.prefilter.kind}, {replaced} samples replaced as outliers")
        )
    length = spec.coarse.duration_s
    over = "over the whole record" if length is None else f"over the first {length:g} s"
    rows.append(("Coarse alignment", f"{spec.coarse.kind}, {over}"))
    if result.fine is not None:
        chosen = [
            f"{key.replace('_', ' ')} {value.kind}"
            for key in ("mechanization", "error_model", "covariance", "update_rule")
            if (value := getattr(spec.fine, key, None)) is not None
        ]
        over = "over the whole record" if length is None else "after the coarse one"
        rows.append(("Fine alignment", f"{spec.fine.kind}, {over}: {', '.join(chosen)}"))
    return tuple(rows)
