"""Charts of an alignment: readiness, signals, attitude, gyro and accelerometer biases."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import DEG_PER_HOUR, MICRO_G, TWO_SIDED_95
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
from strapdown.report.values import NOT_KNOWN, angle_bound
from strapdown.report.values import alignment_values_instant as instant
from strapdown.systems.alignment_run import AlignmentRun
from strapdown.tables import ACCEL, EULER, GYRO
from strapdown.tables.checks import values_of

Array = NDArray[np.float64]

_TIME = "time, s"
_NAMES = ("x, forward", "y, right", "z, down")
#: Smallest difference drawn, as a share of the smallest bound.
LEAST = 0.02
BEGUN = (
    " The fine one begins at the coarse attitude and is near it in its first seconds; its bound "
    "there takes none of that for granted."
)
_OFF = {
    "truth": "error",
    "reference": "off the reference",
    "answer": "off the final answer",
}
_OFF_WORDS = {
    "truth": "Dots and the thin line: the error against the truth of the simulation.",
    "reference": "Dots and the thin line: the difference from the reference that is stated.",
    "answer": "Dots and the thin line: how far each is from the answer of the whole record, which "
    "is no truth, and which they come to by themselves.",
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
            time = table.index.to_numpy(dtype=np.float64)
            kept = time > 0.0
            sd = table[sds].to_numpy().max(axis=1)
            size = np.abs(table[[f"{a}_off" for a in angles]].to_numpy()).max(axis=1)
            size = np.maximum(size, least)
            if found.against == "answer" and name == "fine":
                # The last estimate is the reference itself.
                size[time > 0.9 * time[-1]] = np.nan
            lines.append(
                Line(f"{name}: 95 % bound", time[kept], TWO_SIDED_95 * sd[kept], colour, dash, 2.4)
            )
            dots = name == "coarse"
            lines.append(
                Line(
                    f"{name}: {off}",
                    time[kept],
                    size[kept],
                    colour if dots else SKY,
                    width=1.1,
                    points=dots,
                    dots=dots,
                    symbol="circle",
                    size=6.0,
                )
            )
        panels.append(Panel("deg", tuple(lines), log=True, title=title, height=1.2))
    begun = "" if result.fine is None else BEGUN
    return Chart(
        "readiness",
        "Readiness: alignment time against accuracy",
        "Bounds hold 95 % (1.96 standard deviations); of roll and pitch the larger one. The coarse "
        f"alignment was run anew over each length. {_OFF_WORDS[found.against]}{begun}",
        "time since the start, s",
        tuple(panels),
        () if length is None or result.fine is None else (Mark(length, "fine alignment begins"),),
        log_x=True,
    )


def signal_chart(result: AlignmentRun) -> Chart:
    """Angular rate and specific force: as recorded, as aligned, and 1 s means."""
    panels = []
    for columns, factor, label in (
        (GYRO, DEG_PER_HOUR, "rate, deg/h"),
        (ACCEL, 1.0, "force, m/s²"),
    ):
        for k, column in enumerate(columns):
            lines = [_signal("recorded", result.source.imu, column, factor, GREY, 0.8)]
            if result.prefilter is not None:
                lines.append(_signal("pre-filtered", result.imu, column, factor, SKY, 1.0))
            lines.append(_means(result.imu, column, factor))
            panels.append(Panel(label, tuple(lines), title=_NAMES[k]))
    told = "The thin curves are single samples, the black ones means over a second"
    if result.prefilter is not None:
        told += f", after the pre-filter '{result.prefilter.name}'"
    return Chart(
        "signals",
        "Signals in body axes",
        f"{told}. At rest the rate is the Earth's, and the force is gravity's reaction.",
        _TIME,
        tuple(panels),
    )


def _signal(
    name: str, imu: pd.DataFrame, column: str, factor: float, colour: str, width: float
) -> Line:
    time = imu.index.to_numpy(dtype=np.float64)
    return curve(name, time, factor * imu[column].to_numpy(), colour, width=width, buckets=500)


def _means(imu: pd.DataFrame, column: str, factor: float) -> Line:
    time = imu.index.to_numpy(dtype=np.float64)
    size = max(1, round(1.0 / float(np.median(np.diff(time)))))
    count = max(1, len(time) // size)
    size = min(size, len(time))
    cut = slice(0, count * size)
    value = factor * imu[column].to_numpy()[cut].reshape(count, size).mean(axis=1)
    middle = time[cut].reshape(count, size).mean(axis=1)
    return curve("mean over 1 s", middle, value, BLACK, width=1.1, buckets=500)


def attitude_chart(result: AlignmentRun) -> Chart:
    """Attitude over the record: the aligned attitude propagated by the gyros."""
    table = result.attitude
    time = table.index.to_numpy(dtype=np.float64)
    panels = []
    carried = NOT_KNOWN not in [angle_bound(result.start, k) for k in (0, 1)]
    for k, angle in enumerate(EULER):
        values = table[angle].to_numpy()
        if angle == "heading":
            values = np.degrees(np.unwrap(np.radians(values)))
        lines = [curve("attitude", time, values, BLUE, buckets=800)]
        truth = result.source.truth
        if truth is not None:
            known = truth[angle].to_numpy()
            if angle == "heading":
                known = np.degrees(np.unwrap(np.radians(known)))
            lines.append(curve("truth", truth.index.to_numpy(), known, BLACK, "dot", buckets=800))
        halves = TWO_SIDED_95 * np.array([result.start.sd_deg[k], result.end.sd_deg[k]])
        half = np.interp(time[:: max(1, len(time) // 400)], time[[0, -1]], halves)
        step = max(1, len(time) // 400)
        x, y = time[::step], values[::step]
        band = Fill("95 % bound", x, y - half, y + half, BLUE)
        panels.append(Panel(f"{angle}, deg", tuple(lines), fills=(band,) if carried else ()))
    return Chart(
        "attitude",
        "Attitude over the record",
        "The answer, carried to every sample by the gyros, with its bound of 95 %; what rocks here "
        "is the body."
        if carried
        else f"The answer holds at {instant(result.end.time)} alone. These gyros cannot carry it "
        "to the start, where nothing is known of it: what turns here may be their bias.",
        _TIME,
        tuple(panels),
    )


def bias_charts(result: AlignmentRun) -> tuple[Chart, ...]:
    """Gyro and accelerometer biases over the fine alignment."""
    if result.fine is None:
        return ()
    history = result.fine.history
    time = history.index.to_numpy(dtype=np.float64)
    out = []
    for sensor, factor, unit, what in (
        ("gyro", DEG_PER_HOUR, "deg/h", "Drifts of the gyros"),
        ("accel", MICRO_G, "µg", "Biases of the accelerometers"),
    ):
        panels = []
        for k, axis in enumerate("xyz"):
            value = factor * history[f"{sensor}_bias_{axis}"].to_numpy()
            half = TWO_SIDED_95 * factor * history[f"{sensor}_bias_{axis}_sd"].to_numpy()
            colour = AXIS_COLOURS[k]
            panels.append(
                Panel(
                    f"{unit}",
                    (curve(f"{_NAMES[k]}", time, value, colour, width=1.8),),
                    title=_NAMES[k],
                    fills=(Fill("95 % bound", time, value - half, value + half, colour),),
                )
            )
        out.append(
            Chart(
                f"{sensor}-biases",
                f"{what}: estimates with their bounds",
                "A band that does not narrow belongs to a bias that this rest cannot tell from "
                "an attitude: a horizontal accelerometer bias from a tilt, an east drift from the "
                "heading.",
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
        time = table.index.to_numpy(dtype=np.float64)
        labels = [c.removeprefix("nu ") for c in table.columns if c.startswith("nu ")]
        lines = []
        for k, label in enumerate(labels):
            ratio = values_of(table, [f"nu {label}"])[:, 0] / np.sqrt(table[f"s {label}"])
            lines.append(curve("xyz"[k % 3], time, ratio, AXIS_COLOURS[k % 3], width=0.9))
        levels = (Level(TWO_SIDED_95, ""), Level(-TWO_SIDED_95, "95 %"))
        panels.append(Panel("in sd", tuple(lines), title=name.capitalize(), levels=levels))
    return Chart(
        "innovations",
        "Innovations of the fine alignment",
        "Observed less expected, in the standard deviation that was expected; 95 of 100 belong "
        "between the levels.",
        _TIME,
        tuple(panels),
    )
