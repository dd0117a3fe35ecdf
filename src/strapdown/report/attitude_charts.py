"""The charts of the attitude bench."""

from __future__ import annotations

import numpy as np

from strapdown.evaluation.differences import error_angles
from strapdown.report.attitude_answer_charts import (
    LEAST_ERROR,
    LEAST_WORDS,
    answer_charts,
    judgement_charts,
)
from strapdown.report.chart import (
    AXIS_COLOURS,
    BLACK,
    BUCKETS,
    Band,
    Chart,
    Line,
    Mark,
    Panel,
    break_jumps,
    curve,
    look,
)
from strapdown.results.attitude_bench import AttitudeBench
from strapdown.tables import EULER, GYRO

_TIME = "time, s"


def charts(bench: AttitudeBench) -> list[Chart]:
    """Return the charts that this bench has something to show in, in the order of the page.

    Parameters
    ----------
    bench : AttitudeBench

    Returns
    -------
    list of Chart
    """
    return [
        *answer_charts(bench),
        *log_charts(bench),
        *error_charts(bench),
        *judgement_charts(bench),
    ]


def log_charts(bench: AttitudeBench) -> list[Chart]:
    """Return the signals and the attitudes over time."""
    return [_gyro(bench), _attitude(bench)]


def error_charts(bench: AttitudeBench) -> list[Chart]:
    """Return the errors and the differences over time."""
    found = []
    if bench.truth is not None:
        found.append(_error(bench))
    if len(bench.references):
        found.append(_reference_error(bench))
    if len(bench.runs) > 1:
        found.append(_difference(bench))
    return found


def _buckets(bench: AttitudeBench) -> int:
    """Fewer points a curve where there are many, so that a page stays a page."""
    return min(BUCKETS, 4500 // max(1, len(bench.runs)))


def _marks(bench: AttitudeBench) -> tuple[Mark, ...]:
    instants: dict[float, str] = {}
    for number, (_, row) in enumerate(bench.references.iterrows(), start=1):
        for key in ("since", "time"):
            if np.isfinite(row[key]):
                label = f"R{number}" + (" from" if key == "since" else "")
                at = float(row[key])
                instants[at] = f"{instants[at]}, {label}" if at in instants else label
    return tuple(Mark(at, label) for at, label in sorted(instants.items()))


def _bands(bench: AttitudeBench) -> tuple[Band, ...]:
    first = float(bench.imu.index[0])
    return tuple(Band(max(r.start, first), r.end, "at rest") for r in bench.rests if r.end > first)


def _gyro(bench: AttitudeBench) -> Chart:
    time = bench.imu.index.to_numpy(dtype=np.float64)
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
        _bands(bench),
    )


def _attitude(bench: AttitudeBench) -> Chart:
    panels = []
    for angle in EULER:
        lines = [
            curve(
                run.algorithm,
                run.attitude.index.to_numpy(dtype=np.float64),
                break_jumps(run.attitude[angle].to_numpy()),
                look(k)["colour"],
                look(k)["dash"],
                buckets=_buckets(bench),
            )
            for k, run in enumerate(bench.runs)
        ]
        if bench.truth is not None:
            lines.append(
                curve(
                    "truth",
                    bench.truth.index.to_numpy(dtype=np.float64),
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
        "clockwise from north; where nothing tells north, from the initial heading.",
        _TIME,
        tuple(panels),
        _marks(bench),
    )


def _error(bench: AttitudeBench) -> Chart:
    assert bench.truth is not None
    scored = bench.truth[np.asarray(bench.scored)]
    lines = []
    for k, run in enumerate(bench.runs):
        errors = error_angles(run.attitude, scored)
        lines.append(
            curve(
                run.algorithm,
                errors.index.to_numpy(dtype=np.float64),
                np.maximum(errors.to_numpy(), LEAST_ERROR),
                look(k)["colour"],
                look(k)["dash"],
                buckets=_buckets(bench),
            )
        )
    return Chart(
        "error",
        "Error against the truth",
        "Rotation angle between the computed and the true attitude, where the truth counts. "
        f"Drawn at {LEAST_WORDS} where it is less.",
        _TIME,
        (Panel("error, deg", tuple(lines), log=True),),
        _marks(bench),
    )


def _reference_error(bench: AttitudeBench) -> Chart:
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


def _difference(bench: AttitudeBench) -> Chart:
    base = next((r for r in bench.runs if r.algorithm == "quaternion"), bench.runs[-1])
    lines = [
        curve(
            run.algorithm,
            run.attitude.index.to_numpy(dtype=np.float64),
            np.maximum(error_angles(run.attitude, base.attitude).to_numpy(), LEAST_ERROR),
            look(k)["colour"],
            look(k)["dash"],
            buckets=_buckets(bench),
        )
        for k, run in enumerate(bench.runs)
        if run is not base
    ]
    return Chart(
        "difference",
        f"Difference from {base.algorithm}",
        "Rotation angle between the algorithms on the same samples: what the choice of the "
        f"algorithm makes, whatever the sensor did. Drawn at {LEAST_WORDS} where it is less.",
        _TIME,
        (Panel("difference, deg", tuple(lines), log=True),),
    )
