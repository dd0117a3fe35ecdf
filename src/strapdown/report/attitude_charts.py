"""Charts of the attitude bench."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from strapdown.attitude_comparison.comparison import AttitudeComparison
from strapdown.attitude_comparison.references import PeerRun
from strapdown.evaluation.differences import error_angles
from strapdown.report.attitude_words import (
    MEANINGS,
    full_rate_errors,
    largest_known,
    like_with_like,
    share_basis,
)
from strapdown.report.chart import (
    AXIS_COLOURS,
    BLACK,
    BLUE,
    BUCKETS,
    GREEN,
    GREY,
    VERMILLION,
    Array,
    Band,
    Chart,
    Level,
    Line,
    Mark,
    Panel,
    break_jumps,
    curve,
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
    for angle in EULER:
        lines = [
            _of_run(bench, k, run.attitude.index, break_jumps(run.attitude[angle].to_numpy()))
            for k, run in enumerate(bench.runs)
        ]
        if bench.truth is not None:
            lines.append(
                curve(
                    "truth",
                    index_of(bench.truth),
                    break_jumps(bench.truth[angle].to_numpy()),
                    BLACK,
                    "dot",
                    1.0,
                )
            )
        known = bench.references[bench.references["kind"] == "known"]
        if len(known):
            at = known["time"].to_numpy(dtype=np.float64)
            value = known[angle].to_numpy(dtype=np.float64)
            shown = value % 360.0 if angle == "heading" else value
            lines.append(Line("known", at, shown, BLACK, points=True))
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
        "Rotation angle between computed and true attitude. "
        f"Drawn at {LEAST_WORDS} where it is less.",
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
        at = np.array([s.time for s in scores])
        errors = np.array([s.error_deg for s in scores])
        style = look(k)
        lines.append(
            Line(run.algorithm, at, errors, style["colour"], points=True, symbol=style["symbol"])
        )
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
    lines = [
        _of_run(
            bench,
            k,
            run.attitude.index,
            np.maximum(error_angles(run.attitude, base.attitude).to_numpy(), LEAST_ERROR),
        )
        for k, run in enumerate(bench.runs)
        if run is not base
    ]
    return Chart(
        "difference",
        f"Difference from {base.algorithm}",
        "Rotation angle between the algorithms on the same samples. "
        f"Drawn at {LEAST_WORDS} where it is less.",
        _TIME,
        (Panel("difference, deg", tuple(lines), log=True),),
    )


# Charts behind the answer: cost, sample rate, error shares, trials, other libraries.


# A logarithmic axis has no zero; smaller values are drawn here.
LEAST_ERROR, LEAST_WORDS = 1e-6, "10⁻⁶°"
_FAINT = "#c3c9d0"


def _shown(values: object) -> Array:
    """Clip values for a logarithmic axis; NaN stays NaN."""
    array = np.atleast_1d(np.asarray(values, dtype=np.float64))
    return np.where(np.isnan(array), np.nan, np.maximum(array, LEAST_ERROR))


def _tolerance(bench: AttitudeComparison) -> str:
    return f"tolerance {bench.answer.tolerance_deg:g}°"


def _cost(bench: AttitudeComparison) -> Chart:
    cycles = np.array([max(cost.cycles, 1.0) for cost in bench.costs])
    errors = full_rate_errors(bench)
    names = [cost.algorithm for cost in bench.costs]
    total = _shown([errors.get(name, np.nan) for name in names])
    shares = {share.algorithm: share.own_deg[2] for share in bench.shares}
    own = _shown([shares.get(name, np.nan) for name in names])
    tolerance = max(bench.answer.tolerance_deg, LEAST_ERROR)
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
    level = np.array([[float(np.median(cycles)), tolerance]])
    places = place_labels(
        np.log10(cycles[known]),
        np.log10(total[known]),
        [name for name, is_known in zip(names, known, strict=True) if is_known],
        np.log10(np.vstack([obstacles, level])),
    )
    for k, place in zip(np.flatnonzero(known), places, strict=True):
        style, at, name = look(int(k)), cycles[k : k + 1], names[k]
        point = Line(
            name,
            at,
            total[k : k + 1],
            style["colour"],
            points=True,
            symbol=style["symbol"],
            size=12,
            labels=(name,),
            places=(place,),
            legend=False,
        )
        lines.append(point)
        if judged:
            alone, error = f"{name}, algorithm error", own[k : k + 1]
            lines.append(
                replace(point, name=alone, y=error, size=10, hollow=True, labels=(), places=())
            )
    return Chart(
        "cost",
        "Cost against error",
        (
            "Filled: total error, which the answer uses. Hollow: algorithm error. "
            if judged
            else "Algorithm error, without a reference. "
        )
        + "Largest rotation angle at the log's own rate. Cost: operations per sample, weighted by "
        f"their duration on a Cortex-M4F. Drawn at {LEAST_WORDS} where it is less.",
        "cost, Cortex-M4F cycles per sample",
        (
            Panel(
                "error, deg", tuple(lines), log=True, levels=(Level(tolerance, _tolerance(bench)),)
            ),
        ),
        log_x=True,
    )


def _sweep(bench: AttitudeComparison) -> Chart:
    answer = bench.answer
    meanings = [m for m in MEANINGS if (bench.sweep["meaning"] == m).any()]
    judged = bool(bench.scores)
    panels = []
    for meaning in meanings:
        part = bench.sweep[bench.sweep["meaning"] == meaning].sort_values("rate_hz")
        columns = (part[c].tolist() for c in ("algorithm", "rate_hz", "own_deg", "error_deg"))
        cells = list(zip(*columns, strict=True))
        lines = []
        for k, run in enumerate(bench.runs):
            rows = np.array([cell[1:] for cell in cells if cell[0] == run.algorithm])
            if not rows.size:
                continue
            rate, own, error = rows.T.copy()
            style = look(k)
            if judged:
                lines.append(
                    Line(
                        f"{run.algorithm}, algorithm error",
                        rate,
                        _shown(own),
                        style["colour"],
                        style["dash"],
                        width=0.7,
                        legend=False,
                    )
                )
            lines.append(
                Line(
                    run.algorithm,
                    rate,
                    _shown(error),
                    style["colour"],
                    style["dash"],
                    # Decreasing widths keep coinciding curves visible.
                    width=max(1.4, 4.4 - 0.4 * k),
                    symbol=style["symbol"],
                    dots=True,
                    size=7,
                )
            )
        chosen = part[
            (part["algorithm"] == answer.algorithm)
            & np.isclose(part["rate_hz"], np.nan if answer.rate_hz is None else answer.rate_hz)
        ]
        if answer.meaning in (None, meaning) and len(chosen):
            lines.append(
                Line(
                    "the answer",
                    chosen["rate_hz"].to_numpy(dtype=np.float64),
                    _shown(chosen["error_deg"]),
                    BLACK,
                    points=True,
                    symbol="circle",
                    size=19,
                    hollow=True,
                )
            )
        level = Level(max(answer.tolerance_deg, LEAST_ERROR), _tolerance(bench))
        label = "error, deg"
        title = MEANINGS[meaning].capitalize()
        panels.append(Panel(label, tuple(lines), log=True, title=title, levels=(level,)))
    return Chart(
        "sweep",
        "Error against rate",
        (
            "Thick: total error; thin: algorithm error at that rate. "
            if judged
            else "Algorithm error at that rate. "
        )
        + "Averaged: as by a sensor of that rate. Left out: as if it were read less often "
        f"(aliased). Drawn at {LEAST_WORDS} where it is less.",
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
        Line(name, _shown(values), rows, colour, points=True, symbol=symbol, size=11)
        for name, values, colour, symbol in parts
    )
    return Chart(
        "share",
        "Parts of the error",
        "Largest rotation angle due to each part. "
        + share_basis(bench)
        + f" Drawn at {LEAST_WORDS} where it is less.",
        "error, deg",
        (Panel("", lines, categories=names),),
        log_x=True,
    )


def _trials(bench: AttitudeComparison) -> Chart:
    trials = bench.trials
    assert trials is not None
    names = tuple(str(name) for name in trials.ranking["algorithm"])
    row_of = {name: k for k, name in enumerate(names)}
    errors = trials.errors[trials.errors["algorithm"].isin(names)]
    at = np.array([row_of[name] for name in errors["algorithm"]], dtype=np.float64)
    mean, low, high = (
        _shown(trials.ranking[c].to_numpy()) for c in ("mean_deg", "low_deg", "high_deg")
    )
    lines = (
        Line(
            "trial",
            _shown(errors["error_deg"].to_numpy()),
            at,
            GREY,
            points=True,
            symbol="circle",
            size=7,
            hollow=True,
        ),
        Line(
            "mean, with its 95 % interval",
            mean,
            np.arange(len(names), dtype=np.float64),
            BLUE,
            points=True,
            symbol="diamond",
            size=11,
            low=np.where(np.isnan(low), mean, low),
            high=np.where(np.isnan(high), mean, high),
        ),
    )
    return Chart(
        "trials",
        f"Over {len(trials.names)} trials",
        "The error that the answer uses, best on top.",
        "error, deg",
        (Panel("", lines, categories=names),),
        (Mark(max(bench.answer.tolerance_deg, LEAST_ERROR), _tolerance(bench)),),
        log_x=True,
    )


def _peers(bench: AttitudeComparison) -> Chart:
    alone, aided = like_with_like(bench)
    errors = full_rate_errors(bench)
    own = [(name, error, BLUE, "circle") for name, error in errors.items()]
    panels = [_peer_panel("Gyro alone", own + _rows(alone))]
    if aided:
        panels.append(_peer_panel("Aided", _rows(aided, named=True)))
    return Chart(
        "peers",
        "Filters and other libraries on the same log",
        "Largest error against the known attitude. Blue: strapdown's. Filters that also "
        "use an accelerometer or a magnetometer are apart.",
        "error, deg",
        tuple(panels),
        (Mark(max(bench.answer.tolerance_deg, LEAST_ERROR), _tolerance(bench)),),
        log_x=True,
        beside=True,
    )


def _rows(peers: list[PeerRun], named: bool = False) -> list[tuple[str, float, str, str]]:
    rows = []
    for peer in peers:
        error = largest_known(peer.scores)
        name = f"{peer.peer} ({peer.aiding})" if named else peer.peer
        own = peer.cost is not None
        look = (BLUE, "circle") if own else (VERMILLION, "square")
        rows.append((name, np.nan if error is None else error, *look))
    return rows


def _peer_panel(title: str, rows: list[tuple[str, float, str, str]]) -> Panel:
    lines = []
    for colour, symbol, who in ((BLUE, "circle", "strapdown"), (VERMILLION, "square", "others")):
        ours = [k for k, row in enumerate(rows) if row[2] == colour]
        if ours:
            values = _shown([rows[k][1] for k in ours])
            at = np.array(ours, dtype=np.float64)
            lines.append(Line(who, values, at, colour, points=True, symbol=symbol, size=11))
    return Panel("", tuple(lines), title=title, categories=tuple(row[0] for row in rows))
