"""Tables of an alignment: the answer, the sensors' errors, and what was run."""

from __future__ import annotations

import math

import numpy as np

from strapdown.constants import DEG_PER_HOUR, MICRO_G, TWO_SIDED_95
from strapdown.report.alignment_trust import ORDER, answer_error
from strapdown.report.alignment_values import NOT_KNOWN, angle_bound, instant, small
from strapdown.report.alignment_words import prior_sd
from strapdown.report.crash_values import about, plain
from strapdown.report.document import TableBlock
from strapdown.systems.alignment_run import AlignmentResult
from strapdown.tables import EULER

__all__ = ["answer_table", "bias_table", "method_rows", "readiness_table", "turn_table"]

#: Times since the start that the table of readiness shows, s.
SHOWN = (30.0, 60.0, 100.0, 300.0, 600.0)


def answer_table(result: AlignmentResult) -> TableBlock:
    """The attitude at start and end, by both alignments."""
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


def bias_table(result: AlignmentResult) -> TableBlock | None:
    """Estimated drifts and biases, and how much of what was unknown before is known now."""
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
    """A bound alone: ``± 0.02 deg/h``."""
    text = about(0.0, half, unit)
    return text[text.index("±") :]


def _found(share: float) -> str:
    if share < 0.1:
        return "no"
    return "yes" if share > 0.7 else "in part"


def readiness_table(result: AlignmentResult) -> TableBlock:
    """How well heading and level are known after some times."""
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
                # Lengths that were tried are evenly apart in their logarithm.
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


def turn_table(result: AlignmentResult) -> TableBlock | None:
    """What a turn and a further rest would make known, the best heading first."""
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


def method_rows(result: AlignmentResult) -> tuple[tuple[str, str], ...]:
    """What was run: the slots of the chain with their modules."""
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
