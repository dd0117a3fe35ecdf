"""Charts of the attitude bench."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from strapdown.attitude_comparison.comparison import AttitudeComparison
from strapdown.constants import Array
from strapdown.evaluation.differences import error_angles
from strapdown.report import attitude_words as words
from strapdown.report.chart import (
    AXIS_COLOURS,
    BLACK,
    BLUE,
    BUCKETS,
    GREEN,
    GREY,
    VERMILLION,
    Band,
    Chart,
    Level,
    Line,
    Mark,
    Panel,
    break_jumps,
    curve,
    dots,
    look,
)
from strapdown.report.plan import place_labels
from strapdown.tables import EULER, GYRO
from strapdown.tables.checks import index_of

_TIME = "time, s"


def charts(bench: AttitudeComparison) -> list[Chart]:
    """Return the charts for which this bench has data, in page order."""
    found = (
        _cost(bench) if bench.costs else None,
        _sweep(bench) if len(bench.sweep) else None,
        _gyro(bench),
        _attitude(bench),
        None if bench.truth is None else _error(bench),
        _reference_error(bench) if len(bench.references) else None,
        _difference(bench) if len(bench.runs) > 1 else None,
        _share(bench) if bench.shares else None,
        None if bench.trials is None else _trials(bench),
        _peers(bench) if any(peer.scores for peer in bench.peers) else None,
    )
    return [chart for chart in found if chart is not None]


def _of_run(bench: AttitudeComparison, k: int, time: pd.Index, values: Array) -> Line:
    """Curve of the k-th algorithm, of fewer points the more there are, to limit the page size."""
    buckets = min(BUCKETS, 4500 // max(1, len(bench.runs)))
    at, style = time.to_numpy(dtype=np.float64), look(k)
    name = bench.runs[k].algorithm
    return curve(name, at, values, style["colour"], style["dash"], buckets=buckets)


def _marks(bench: AttitudeComparison) -> tuple[Mark, ...]:
    instants: dict[float, str] = {}
    for number, (_, row) in enumerate(bench.references.iterrows(), start=1):
        for key in ("since", "time"):
            if np.isfinite(row[key]):
                label = f"R{number}" + (" from" if key == "since" else "")
                at = float(row[key])
                instants[at] = f"{instants[at]}, {label}" if at in instants else label
    return tuple(Mark(at, label) for at, label in sorted(instants.items()))


def _gyro(bench: AttitudeComparison) -> Chart:
    time = index_of(bench.imu)
    first = float(time[0])
    names = ("x, forward", "y, right", "z, down")
    lines = tuple(
        curve(name, time, np.degrees(bench.imu[column].to_numpy()), colour, width=1.1)
        for name, column, colour in zip(names, GYRO, AXIS_COLOURS, strict=True)
    )
    removed = bench.gyro_bias["rad_per_s"] is not None
    return Chart(
        "gyro",
        "Gyro signals and reference points",
        "Rates about the body's axes, "
        + ("bias removed. " if removed else "as recorded, bias included. ")
        + ("Red: reference points. " if len(bench.references) else "")
        + ("Shaded: at rest." if bench.rests else ""),
        _TIME,
        (Panel("rate, deg/s", lines),),
        _marks(bench),
        tuple(Band(max(r.start, first), r.end, "at rest") for r in bench.rests if r.end > first),
    )


def _attitude(bench: AttitudeComparison) -> Chart:
    panels = []
    known = bench.references[bench.references["kind"] == "known"]
    for angle in EULER:
        lines = [
            _of_run(bench, k, run.attitude.index, break_jumps(run.attitude[angle].to_numpy()))
            for k, run in enumerate(bench.runs)
        ]
        if (truth := bench.truth) is not None:
            values = break_jumps(truth[angle].to_numpy())
            lines.append(curve("truth", index_of(truth), values, BLACK, "dot", 1.0))
        if len(known):
            value = known[angle].to_numpy(dtype=np.float64)
            shown = value % 360.0 if angle == "heading" else value
            lines.append(dots("known", known["time"], shown, BLACK))
        panels.append(Panel(f"{angle}, deg", tuple(lines)))
    return Chart(
        "attitude",
        "Attitude",
        "Body forward-right-down relative to north-east-down, 3-2-1 angles. Heading 0–360°, "
        "clockwise from north; without a north reference, from the initial heading.",
        _TIME,
        tuple(panels),
        _marks(bench),
    )


def _error(bench: AttitudeComparison) -> Chart:
    assert bench.truth is not None
    scored = bench.truth[np.asarray(bench.scored)]
    lines = []
    for k, run in enumerate(bench.runs):
        errors = error_angles(run.attitude, scored)
        lines.append(_of_run(bench, k, errors.index, np.maximum(errors.to_numpy(), LEAST_ERROR)))
    return Chart(
        "error",
        "Error against the truth",
        f"Rotation angle between computed and true attitude. {_DRAWN}",
        _TIME,
        (Panel("error, deg", tuple(lines), log=True),),
        _marks(bench),
    )


def _reference_error(bench: AttitudeComparison) -> Chart:
    lines = []
    for k, run in enumerate(bench.runs):
        scores = [
            s for s in bench.scores if s.algorithm == run.algorithm and s.reference is not None
        ]
        points = [s.time for s in scores], [s.error_deg for s in scores]
        lines.append(dots(run.algorithm, *points, look(k)["colour"], look(k)["symbol"]))
    return Chart(
        "reference-error",
        "Error at the reference points",
        "Rotation angle between the computed and the known attitude.",
        _TIME,
        (Panel("error, deg", tuple(lines)),),
        _marks(bench),
    )


def _difference(bench: AttitudeComparison) -> Chart:
    base = next((r for r in bench.runs if r.algorithm == "quaternion"), bench.runs[-1])
    lines = []
    for k, run in enumerate(bench.runs):
        if run is not base:
            apart = np.maximum(error_angles(run.attitude, base.attitude).to_numpy(), LEAST_ERROR)
            lines.append(_of_run(bench, k, run.attitude.index, apart))
    return Chart(
        "difference",
        f"Difference from {base.algorithm}",
        f"Rotation angle between the algorithms on the same samples. {_DRAWN}",
        _TIME,
        (Panel("difference, deg", tuple(lines), log=True),),
    )


# Charts behind the answer: cost, sample rate, error shares, trials, other libraries.


# A logarithmic axis has no zero; smaller values are drawn here.
LEAST_ERROR = 1e-6
_DRAWN = "Drawn at 10⁻⁶° where it is less."
_FAINT = "#c3c9d0"


def _shown(values: object) -> Array:
    """Clip values for a logarithmic axis; NaN stays NaN."""
    array = np.atleast_1d(np.asarray(values, dtype=np.float64))
    return np.where(np.isnan(array), np.nan, np.maximum(array, LEAST_ERROR))


def _tolerance(bench: AttitudeComparison) -> tuple[float, str]:
    """Where the tolerance is drawn, and its label."""
    limit = bench.answer.tolerance_deg
    return max(limit, LEAST_ERROR), f"tolerance {limit:g}°"


def _cost(bench: AttitudeComparison) -> Chart:
    cycles = np.array([max(cost.cycles, 1.0) for cost in bench.costs])
    errors = words.full_rate_errors(bench)
    names = [cost.algorithm for cost in bench.costs]
    total = _shown([errors.get(name, np.nan) for name in names])
    shares = {share.algorithm: share.own_deg[2] for share in bench.shares}
    own = _shown([shares.get(name, np.nan) for name in names])
    tolerance = Level(*_tolerance(bench))
    lines = []
    # Pareto-optimal points, cheapest first.
    front: list[int] = []
    for j in sorted(np.flatnonzero(~np.isnan(total)).tolist(), key=lambda i: (cycles[i], total[i])):
        if not front or total[j] < total[front[-1]]:
            front.append(j)
    if len(front) > 1:
        steps_x = np.repeat(cycles[front], 2)[1:]
        steps_y = np.repeat(total[front], 2)[:-1]
        lines.append(Line("Pareto front", steps_x, steps_y, GREY, "dot", 1.4))
    judged = any(share.sensor_deg is not None for share in bench.shares) or bool(bench.scores)
    if judged:
        stems = np.column_stack([own, total, np.full(len(own), np.nan)]).ravel()
        lines.append(Line("", np.repeat(cycles, 3), stems, _FAINT, width=1.0, legend=False))
    known = ~np.isnan(total)
    obstacles = np.column_stack([cycles, own])[~np.isnan(own)] if judged else np.empty((0, 2))
    level = np.array([[float(np.median(cycles)), tolerance.y]])
    places = place_labels(
        np.log10(cycles[known]),
        np.log10(total[known]),
        [name for name, is_known in zip(names, known, strict=True) if is_known],
        np.log10(np.vstack([obstacles, level])),
    )
    for k, place in zip(np.flatnonzero(known), places, strict=True):
        style, at, name = look(int(k)), cycles[k : k + 1], names[k]
        drawn = style["colour"], style["symbol"]
        point = dots(name, at, total[k : k + 1], *drawn, 12, labels=(name,), places=(place,))
        lines.append(replace(point, legend=False))
        if judged:
            alone = f"{name}, algorithm error"
            lines.append(dots(alone, at, own[k : k + 1], *drawn, 10, hollow=True, legend=False))
    return Chart(
        "cost",
        "Cost against error",
        (
            "Filled: total error, which the answer uses. Hollow: algorithm error. "
            if judged
            else "Algorithm error, without a reference. "
        )
        + "Largest rotation angle at the log's own rate. Cost: operations per sample, weighted by "
        f"their duration on a Cortex-M4F. {_DRAWN}",
        "cost, Cortex-M4F cycles per sample",
        (Panel("error, deg", tuple(lines), log=True, levels=(tolerance,)),),
        log_x=True,
    )


def _sweep(bench: AttitudeComparison) -> Chart:
    answer = bench.answer
    judged = bool(bench.scores)
    panels = []
    for meaning, title in words.MEANINGS.items():
        part = bench.sweep[bench.sweep["meaning"] == meaning].sort_values("rate_hz")
        if not len(part):
            continue
        lines = []
        for k, run in enumerate(bench.runs):
            rows = part[part["algorithm"] == run.algorithm]
            if not len(rows):
                continue
            rate = rows["rate_hz"].to_numpy(dtype=np.float64)
            style = look(k)
            drawn = style["colour"], style["dash"]
            if judged:
                name, own = f"{run.algorithm}, algorithm error", _shown(rows["own_deg"])
                lines.append(Line(name, rate, own, *drawn, width=0.7, legend=False))
            # Decreasing widths keep coinciding curves visible.
            width = max(1.4, 4.4 - 0.4 * k)
            error, marked = _shown(rows["error_deg"]), style["symbol"]
            lines.append(
                Line(run.algorithm, rate, error, *drawn, width, symbol=marked, dots=True, size=7)
            )
        at = np.nan if answer.rate_hz is None else answer.rate_hz
        chosen = part[(part["algorithm"] == answer.algorithm) & np.isclose(part["rate_hz"], at)]
        if answer.meaning in (None, meaning) and len(chosen):
            point = chosen["rate_hz"], _shown(chosen["error_deg"])
            lines.append(dots("the answer", *point, BLACK, "circle", 19, hollow=True))
        levels = (Level(*_tolerance(bench)),)
        panels.append(
            Panel("error, deg", tuple(lines), log=True, title=title.capitalize(), levels=levels)
        )
    return Chart(
        "sweep",
        "Error against rate",
        (
            "Thick: total error; thin: algorithm error at that rate. "
            if judged
            else "Algorithm error at that rate. "
        )
        + "Averaged: as by a sensor of that rate. Left out: as if it were read less often "
        f"(aliased). {_DRAWN}",
        "rate, Hz",
        tuple(panels),
        log_x=True,
        beside=True,
    )


def _share(bench: AttitudeComparison) -> Chart:
    names = tuple(share.algorithm for share in bench.shares)
    rows = np.arange(len(names), dtype=np.float64)
    parts = [
        ("of the algorithm at this rate", [s.own_deg[2] for s in bench.shares], BLUE, "circle"),
        ("of single precision", [s.single_deg[2] for s in bench.shares], GREEN, "diamond"),
    ]
    sensor = [np.nan if s.sensor_deg is None else s.sensor_deg[2] for s in bench.shares]
    if not np.isnan(sensor).all():
        parts.insert(0, ("of the sensor", sensor, VERMILLION, "square"))
    lines = tuple(
        dots(name, _shown(values), rows, colour, symbol, 11)
        for name, values, colour, symbol in parts
    )
    return Chart(
        "share",
        "Parts of the error",
        f"Largest rotation angle due to each part. {words.share_basis(bench)} {_DRAWN}",
        "error, deg",
        (Panel("", lines, categories=names),),
        log_x=True,
    )


def _trials(bench: AttitudeComparison) -> Chart:
    trials = bench.trials
    assert trials is not None
    names = tuple(str(name) for name in trials.ranking["algorithm"])
    errors = trials.errors[trials.errors["algorithm"].isin(names)]
    at = [names.index(name) for name in errors["algorithm"]]
    mean, low, high = (
        _shown(trials.ranking[c].to_numpy()) for c in ("mean_deg", "low_deg", "high_deg")
    )
    low, high = (np.where(np.isnan(end), mean, end) for end in (low, high))
    interval, rows = "mean, with its 95 % interval", np.arange(len(names))
    lines = (
        dots("trial", _shown(errors["error_deg"]), at, GREY, "circle", 7, hollow=True),
        dots(interval, mean, rows, BLUE, size=11, low=low, high=high),
    )
    return Chart(
        "trials",
        f"Over {len(trials.names)} trials",
        "The error that the answer uses, best on top.",
        "error, deg",
        (Panel("", lines, categories=names),),
        (Mark(*_tolerance(bench)),),
        log_x=True,
    )


def _peers(bench: AttitudeComparison) -> Chart:
    alone, aided = words.like_with_like(bench)
    own = [(name, error, True) for name, error in words.full_rate_errors(bench).items()]
    panels = []
    for title, ours, peers in (("Gyro alone", own, alone), ("Aided", [], aided)):
        # Name, largest error, and whether it is of strapdown.
        rows = list(ours)
        for peer in peers:
            name = f"{peer.peer} ({peer.aiding})" if title == "Aided" else peer.peer
            error = words.largest_known(peer.scores)
            rows.append((name, np.nan if error is None else error, peer.cost is not None))
        lines = []
        for is_own, colour, symbol, who in (
            (True, BLUE, "circle", "strapdown"),
            (False, VERMILLION, "square", "others"),
        ):
            if at := [k for k, row in enumerate(rows) if row[2] == is_own]:
                values = _shown([rows[k][1] for k in at])
                lines.append(dots(who, values, at, colour, symbol, 11))
        if rows:
            categories = tuple(row[0] for row in rows)
            panels.append(Panel("", tuple(lines), title=title, categories=categories))
    return Chart(
        "peers",
        "Filters and other libraries on the same log",
        "Largest error against the known attitude. Blue: strapdown's. Filters that also "
        "use an accelerometer or a magnetometer are apart.",
        "error, deg",
        tuple(panels),
        (Mark(*_tolerance(bench)),),
        log_x=True,
        beside=True,
    )
