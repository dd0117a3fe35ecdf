"""Results of the attitude bench in words and rows, shared by terminal and page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import takewhile
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from strapdown.attitude_algorithms import ALGORITHMS
from strapdown.attitude_algorithms.algorithm import AttitudeRun
from strapdown.attitude_comparison.comparison import AttitudeComparison
from strapdown.attitude_comparison.references import PeerRun, passed_pole
from strapdown.evaluation.reference_points import Score, in_words
from strapdown.formats.recording import Reading
from strapdown.report.document import TableBlock

if TYPE_CHECKING:
    from strapdown.evaluation.second_log import SecondLog

CONVENTIONS = (
    ("Body axes", "x forward, y right, z down"),
    ("Local level", "north, east, down; without a north reference, the initial heading"),
    ("Attitude", "q_nb and C_nb turn a vector from body axes to local level; scalar first"),
    (
        "Angles",
        "3-2-1: heading 0–360° clockwise from north, pitch ±90° nose up, roll ±180° "
        "right side down",
    ),
    ("Error", "rotation angle |log(C_est^T C_ref)| in degrees, whatever the axis"),
    ("Earth rate", "neglected, as in Alexiev (2021): 15°/h"),
)
HOW_TO_REFERENCE = (
    "No reference. Give a known attitude: "
    "--reference 'end same as start' (returned to its initial attitude), "
    "--reference 'end 2 turns about z since start', "
    "--reference '12.5 roll 0 pitch 0 heading 90', or --reference TRUTH.csv."
)


# Two exact algorithms that differ by less are taken as equal.
AGREE = 1e-6  # deg


def degrees(value: float | None) -> str:
    """Format an angle to three significant digits; rounding errors are named as such."""
    if value is None:
        return "–"
    if abs(value) < 1e-9:
        return "< 1e-9°"
    if abs(value) < 1e-3:
        return f"{value:.1e}°"
    return f"{value:.3g}°" if abs(value) < 100 else f"{value:.1f}°"


def seconds(value: float) -> str:
    """Format an instant to a millisecond."""
    return f"{value:.3f}".rstrip("0").rstrip(".") + " s"


def standing(bench: AttitudeComparison) -> str:
    """Return the final errors of the algorithms in one or two sentences."""
    scores = [s for s in bench.scores if s.against == "truth"]
    if scores:
        answer = f"At {seconds(scores[0].time)}, {_ranked(bench, scores, 'from the truth')}."
    elif bench.scores:
        last = len(bench.references)
        scores = [s for s in bench.scores if s.reference == last]
        answer = f"At reference point R{last}, {_ranked(bench, scores, 'from it')}."
    elif len(bench.runs) > 1:
        table = bench.differences_deg.to_numpy()
        a, b = (bench.runs[k].algorithm for k in divmod(int(table.argmax()), len(table)))
        answer = (
            f"The algorithms differ by up to {degrees(float(table.max()))} ({a} against {b}) on "
            "these samples."
        )
    else:
        answer = f"{bench.runs[0].algorithm} ran over the log."
    return answer + _whose_error(bench, scores)


def _ranked(bench: AttitudeComparison, scores: list[Score], off: str) -> str:
    ranked = sorted(scores, key=lambda s: s.error_deg)
    worst = ranked[-1]
    # A run through the pole may be near the truth by chance; it is not named as the best.
    lost = {r.algorithm for r in bench.runs if passed_pole(r)}
    best = next((s for s in ranked if s.algorithm not in lost), ranked[0])
    # Algorithms with equal displayed errors are named together.
    level = [
        s.algorithm
        for s in scores
        if degrees(s.error_deg) == degrees(best.error_deg)
        and (s is best or s.algorithm not in lost)
    ]
    verb = "are" if len(level) > 1 else "is"
    text = f"{_listed(level)} {verb} {degrees(best.error_deg)} {off}"
    if worst.algorithm not in level:
        text += f"; {worst.algorithm} is {degrees(worst.error_deg)}"
    return text


def _listed(names: list[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


# Share of the total error below which the algorithm error does not explain it.
SMALL_SHARE = 0.1


def _whose_error(bench: AttitudeComparison, scores: list[Score]) -> str:
    """Exclude the algorithms as the error source when two exact ones agree."""
    names = [run.algorithm for run in bench.runs]
    exact = [s for s in scores if s.algorithm == "quaternion"]
    if not {"dcm", "quaternion"} <= set(names) or not exact or exact[0].error_deg < AGREE:
        return ""
    pair = [names.index("dcm"), names.index("quaternion")]
    if bench.differences_deg.to_numpy()[*pair] > AGREE:
        return ""
    own = next((s.own_deg[2] for s in bench.shares if s.algorithm == "quaternion"), 0.0)
    if own > SMALL_SHARE * exact[0].error_deg:
        # They agree but share the error of an axis that turns within the step.
        return ""
    return (
        " Direction cosines and quaternion agree to rounding: the remaining error is due to the "
        "sensor, its rate, its bias or the reference, not to arithmetic."
    )


def condition(diagnostics: dict[str, float]) -> str:
    """Diagnostics of an algorithm in words."""
    parts = []
    if "closest_to_pole_deg" in diagnostics:
        near = diagnostics["closest_to_pole_deg"]
        how = f"±90° pitch {degrees(near)} off" if near else "through ±90° pitch"
        parts.append(f"{how} at {seconds(diagnostics['closest_to_pole_time_s'])}")
    if "orthogonality_loss" in diagnostics:
        parts.append(f"|CᵀC − I| = {diagnostics['orthogonality_loss']:.1e}")
    if "norm_error" in diagnostics:
        parts.append(f"|q| − 1 = {diagnostics['norm_error']:.1e}")
    return "; ".join(parts) or "–"


def first_value(reading: Reading) -> str:
    """The first value of a column, in display form."""
    return reading.first if isinstance(reading.first, str) else f"{reading.first:.6g}"


def reference_lines(bench: AttitudeComparison) -> list[str]:
    """Each reference point in words, with the turned angle where turns were counted."""
    lines = []
    for number, (_, row) in enumerate(bench.references.iterrows(), start=1):
        text = f"R{number}: {in_words(row)}"
        score = next((s for s in bench.scores if s.reference == number), None)
        if score is not None and score.turned_deg is not None and score.expected_deg:
            share = score.turned_deg / score.expected_deg - 1.0
            text += (
                f"; the gyro turned {score.turned_deg:.1f}° of {score.expected_deg:.1f}° "
                f"({100 * share:+.2f} %: scale factor, bias and handling)"
            )
        if score is not None and score.sd_deg is not None:
            text += f"; known to {score.sd_deg:g}° (1σ)"
        lines.append(text)
    return lines


def facts(bench: AttitudeComparison) -> list[tuple[str, str]]:
    """Inputs and assumptions of the run."""
    i, removed = bench.initial, str(bench.gyro_bias["from"])
    if (bias := bench.gyro_bias["rad_per_s"]) is not None:
        values = ", ".join(f"{math.degrees(v):.4f}" for v in bias)
        removed = f"({values}) deg/s about forward, right, down removed: {removed}"
    found = [
        ("Log", bench.description),
        (
            "Initial attitude",
            f"roll {i['roll_deg']:.3f}°, pitch {i['pitch_deg']:.3f}°, heading "
            f"{i['heading_deg']:.3f}° at {seconds(i['time_s'])}: {i['from']}",
        ),
        ("Gyro bias", removed),
    ]
    if bench.truth is not None:
        found.append(("Truth", _truth_words(bench)))
    if bench.second is not None:
        found.append(("Second log", second_words(bench.second)))
    if bench.sampling_error_deg is not None:
        final, most = bench.sampling_error_deg
        how = (
            "error of exact arithmetic on noise-free samples at this rate"
            if bench.specification["source"]["kind"] == "scenario"
            else "estimate: rates interpolated linearly between their stamps, against cubically"
        )
        found.append(
            (
                "Sampling error",
                f"{degrees(final)} at the end, {degrees(most)} at most: {how}",
            )
        )
    if bench.rests:
        shown = [
            f"{seconds(r.start)} to {seconds(r.end)}, mean rate "
            f"({', '.join(f'{math.degrees(v):.3f}' for v in r.gyro_mean)}) deg/s"
            for r in bench.rests[:6]
        ]
        if (more := len(bench.rests) - len(shown)) > 0:
            shown.append(f"and {more} more")
        found.append(("At rest", "; ".join(shown)))
    elif not bench.scores:
        found.append(("At rest", "no stationary stretch of a second or more was found"))
    return found


def _truth_words(bench: AttitudeComparison) -> str:
    assert bench.truth is not None
    counted = bench.truth.index[bench.scored]
    if not len(counted):
        return f"known at {len(bench.truth)} samples, none of which counts"
    return (
        f"known at {len(bench.truth)} samples; {len(counted)} of them count, from "
        f"{seconds(float(counted[0]))} to {seconds(float(counted[-1]))}"
    )


def second_words(second: SecondLog) -> str:
    """Clock, mounting and scale of a second log relative to the first, with standard deviations."""
    roll, pitch, heading = second.mounting_deg
    sd = max(second.mounting_sd_deg)
    return (
        f"its clock is {second.offset:.4f} s ahead (1σ {second.offset_sd:.2g} s) and runs "
        f"{second.drift_ppm:+.3g} ppm (1σ {second.drift_sd_ppm:.2g}); mounted at roll {roll:.2f}°, "
        f"pitch {pitch:.2f}°, heading {heading:.2f}° (1σ up to {sd:.2g}°); ratio of scale factors "
        f"{second.scale:.5f} (1σ {second.scale_sd:.2g}); correlation of the rates "
        f"{100 * second.correlation:.1f} %"
    )


# Numbers of a bench that several tables and charts share.


#: Methods of lowering the sample rate, with their labels.
MEANINGS = {
    "sum": "samples averaged",
    "drop": "samples left out",
}


def largest_known(scores: Sequence[Score]) -> float | None:
    """Largest finite error against a known attitude, deg; None if there is none."""
    found = [s.error_deg if s.max_deg is None else s.max_deg for s in scores]
    return max((e for e in found if math.isfinite(e)), default=None)


def full_rate_errors(bench: AttitudeComparison) -> dict[str, float]:
    """Return the error by which each algorithm is judged, at the log's own rate.

    Returns
    -------
    dict of str to float
        In deg, in the order of the runs: the largest error against known attitudes, else the
        algorithm error.
    """
    own = {share.algorithm: share.own_deg[2] for share in bench.shares}
    swept: dict[str, float] = {}
    if len(bench.sweep):
        rows = bench.sweep[bench.sweep["factor"] == 1]
        swept = dict(zip(rows["algorithm"].tolist(), rows["error_deg"].tolist(), strict=True))
    errors = {}
    for run in bench.runs:
        name = run.algorithm
        known = largest_known([s for s in bench.scores if s.algorithm == name])
        errors[name] = swept.get(name, own.get(name, math.nan) if known is None else known)
    return errors


def chosen_run(bench: AttitudeComparison) -> AttitudeRun:
    """Return the run of the recommended algorithm, else that with the smallest error."""
    for run in bench.runs:
        if run.algorithm == bench.answer.algorithm:
            return run
    errors = full_rate_errors(bench)
    return min(
        bench.runs,
        key=lambda r: errors[r.algorithm] if math.isfinite(errors[r.algorithm]) else math.inf,
    )


def sweep_grid(bench: AttitudeComparison, meaning: str, column: str = "error_deg") -> pd.DataFrame:
    """Return the errors of one method of lowering the rate.

    Parameters
    ----------
    meaning : {'drop', 'sum'}
    column : str
        Of the sweep.

    Returns
    -------
    DataFrame
        In deg: algorithms in the order of the runs, rates in Hz from high to low; NaN where an
        algorithm did not run.
    """
    names = [run.algorithm for run in bench.runs]
    if not len(bench.sweep):
        return pd.DataFrame(index=names)
    part = bench.sweep[bench.sweep["meaning"] == meaning]
    rates = sorted(set(part["rate_hz"].tolist()), reverse=True)
    grid = np.full((len(names), len(rates)), np.nan)
    for name, rate, error in part[["algorithm", "rate_hz", column]].itertuples(index=False):
        cell = names.index(name), rates.index(rate)
        grid[cell] = np.fmax(grid[cell], error)
    return pd.DataFrame(grid, index=names, columns=rates)


def like_with_like(bench: AttitudeComparison) -> tuple[list[PeerRun], list[PeerRun]]:
    """Split the other libraries into gyro-only ones, as the bench's own are, and aided ones."""
    alone = [p for p in bench.peers if p.aiding == "gyro"]
    return alone, [p for p in bench.peers if p.aiding != "gyro"]


def share_basis(bench: AttitudeComparison) -> str:
    """Return whether the shares are exact or estimates."""
    if bench.specification["source"]["kind"] == "scenario":
        return "Exact: each algorithm also ran on simulated samples without sensor errors."
    own = (
        "Estimate: the algorithm error is the difference from the most accurate algorithm on the "
        "same samples"
    )
    if any(share.sensor_deg is not None for share in bench.shares):
        return own + ", the sensor error that one's error against the truth."
    return own + "; the sensor error is unknown without a truth."


# Tables of the attitude bench, shared by terminal and page.


# With more comparisons the error contributions no longer fit in a terminal.
_MOST_BESIDE = 4
# Reference points with their own columns; with more, only the worst is shown.
_MOST_POINTS = 7
_NONE = "–"


def _named(bench: AttitudeComparison) -> tuple[int, ...]:
    names = [run.algorithm for run in bench.runs]
    answer = bench.answer.algorithm
    return (names.index(answer),) if answer in names else ()


def number(value: float) -> str:
    """Format a count to three digits, without a needless decimal point."""
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


def result_tables(bench: AttitudeComparison) -> list[TableBlock]:
    """Return the errors of each algorithm with their contributions; two tables if wide."""
    truth = any(s.against == "truth" for s in bench.scores)
    points = len(bench.references)
    at = [f"at R{k}" for k in range(1, points + 1)]
    if points > _MOST_POINTS:
        at = [f"worst of R1 to R{points}"]
    columns = (["final", "RMS", "largest"] if truth else []) + at
    parts, cells = _parts(bench)
    compared, made = [], []
    for run in bench.runs:
        scores = [s for s in bench.scores if s.algorithm == run.algorithm]
        compared.append(_compared(scores, len(columns)))
        made.append([cells[column].get(run.algorithm, _NONE) for column in parts])
    names = [run.algorithm for run in bench.runs]
    strong, note = _named(bench), _part_note(bench)
    if len(columns) > _MOST_BESIDE:
        tables = [("Results", columns, compared, ""), ("Parts of the error", parts, made, note)]
    else:
        rows = [[*left, *right] for left, right in zip(compared, made, strict=True)]
        tables = [("Results", [*columns, *parts], rows, note)]
    return [
        TableBlock(
            ("algorithm", *header),
            tuple((name, *row) for name, row in zip(names, rows, strict=True)),
            caption=caption,
            strong=strong,
            title=title,
        )
        for title, header, rows, caption in tables
    ]


def _compared(scores: list[Score], count: int) -> list[str]:
    cells = []
    for s in scores:
        if s.against == "truth":
            cells += [degrees(s.error_deg), degrees(s.rms_deg), degrees(s.max_deg)]
    points = [s.error_deg for s in scores if s.reference is not None]
    cells += [degrees(max(points))] if len(points) > _MOST_POINTS else map(degrees, points)
    return cells + [_NONE] * (count - len(cells))


def _parts(bench: AttitudeComparison) -> tuple[list[str], dict[str, dict[str, str]]]:
    """Columns of the error contributions and costs, and their cells by algorithm."""
    cells: dict[str, dict[str, str]] = {}
    if bench.shares:
        cells["alg. error"] = {s.algorithm: degrees(s.own_deg[2]) for s in bench.shares}
        if any(s.sensor_deg is not None for s in bench.shares):
            cells["sensor"] = {
                s.algorithm: degrees(None if s.sensor_deg is None else s.sensor_deg[2])
                for s in bench.shares
            }
        if len(bench.sweep):
            # Lowest rate of averaged samples down to which the algorithm error is within tolerance.
            limit, lowest = bench.answer.tolerance_deg, {}
            for name, errors in sweep_grid(bench, "sum", "own_deg").T.items():
                within = list(takewhile(lambda cell: cell[1] <= limit, errors.items()))
                lowest[str(name)] = f"{within[-1][0]:.3g} Hz" if within else _NONE
            cells[f"≤ {limit:g}° to"] = {s.algorithm: lowest[s.algorithm] for s in bench.shares}
        cells["float32"] = {s.algorithm: degrees(s.single_deg[2]) for s in bench.shares}
    if bench.costs:
        cells["cycles"] = {c.algorithm: number(c.cycles) for c in bench.costs}
        cells["memory"] = {c.algorithm: str(c.memory) for c in bench.costs}
    return list(cells), cells


def _part_note(bench: AttitudeComparison) -> str:
    if not bench.shares:
        return ""
    sensor = any(share.sensor_deg is not None for share in bench.shares)
    return (
        "alg. error, "
        + ("sensor, " if sensor else "")
        + "float32: largest error due to the algorithm at this rate, "
        + ("to the sensor, " if sensor else "")
        + f"and to single precision. {share_basis(bench)} cycles: of a Cortex-M4F per sample; "
        "memory: numbers kept between samples."
    )


def source_of(run: AttitudeRun) -> str:
    """Source of an algorithm, as ``Alexiev (2021) Eq. (2)``."""
    cls = ALGORITHMS.get(run.algorithm.partition(":")[0])
    source = "" if cls is None else cls.source
    return f"{source} Eq. {run.equations}".strip() if run.equations else source


def condition_table(bench: AttitudeComparison) -> TableBlock:
    """Return the source and the diagnostics of each algorithm."""
    rows = tuple((r.algorithm, source_of(r), condition(r.diagnostics)) for r in bench.runs)
    columns = ("algorithm", "source", "diagnostics")
    return TableBlock(columns, rows, (0, 1, 2), strong=_named(bench), title="The algorithms")


def cost_table(bench: AttitudeComparison) -> TableBlock | None:
    """Return the operations per sample of each algorithm; None if none were counted."""
    if not bench.costs:
        return None
    rows = tuple(
        (
            c.algorithm,
            *(number(v) for v in (c.add, c.multiply, c.divide, c.sqrt, c.trig, c.cycles)),
            str(c.memory),
        )
        for c in bench.costs
    )
    return TableBlock(
        ("algorithm", "add", "multiply", "divide", "root", "sin, cos", "cycles", "memory"),
        rows,
        caption="Operations counted in the kernel, in steps of 0.01 rad; cycles: weighted by "
        "their duration on a Cortex-M4F's floating-point unit, for ranking; memory: numbers kept "
        "between samples.",
        strong=_named(bench),
        title="Cost per sample",
    )


def sweep_tables(bench: AttitudeComparison) -> list[TableBlock]:
    """Return the errors at every rate, one table per method of lowering it."""
    tables = []
    answer = bench.answer
    for meaning, words in MEANINGS.items():
        grid = sweep_grid(bench, meaning)
        values = grid.to_numpy(dtype=float)
        if not values.size or not math.isfinite(float(grid.min().min())):
            continue
        passed = {
            (i, j + 1)
            for i, row in enumerate(values)
            for j, value in enumerate(row)
            if value <= answer.tolerance_deg
        }
        rows = tuple(
            (
                name,
                *(
                    ("✓ " if (i, j + 1) in passed else "")
                    + (degrees(float(v)) if math.isfinite(v) else _NONE)
                    for j, v in enumerate(values[i])
                ),
            )
            for i, name in enumerate(grid.index)
        )
        tables.append(
            TableBlock(
                ("algorithm", *(f"{number(float(rate))} Hz" for rate in grid.columns)),
                rows,
                caption=f"✓: within the tolerance of {degrees(answer.tolerance_deg)}."
                if passed
                else f"None is within the tolerance of {degrees(answer.tolerance_deg)}.",
                passed=frozenset(passed),
                strong=_named(bench),
                title=f"Error by rate, {words}",
            )
        )
    return tables


def difference_table(bench: AttitudeComparison) -> TableBlock | None:
    """Return the largest difference of each pair of algorithms; None for a single one."""
    names = [run.algorithm for run in bench.runs]
    if len(names) < 2:
        return None
    rows = tuple(
        (name, *(_NONE if i == j else degrees(float(v)) for j, v in enumerate(values)))
        for i, (name, values) in enumerate(
            zip(names, bench.differences_deg.to_numpy(), strict=True)
        )
    )
    title = "Largest difference between the algorithms"
    return TableBlock(("", *names), rows, title=title)


#: What each part of the sensor error is.
_PARTS = {
    "as stamped": "as stamped",
    "bias": "less a constant bias",
    "clock": "with the stamps shifted",
    "scale and axes": "less scale factors and misalignment",
}


def budget_table(bench: AttitudeComparison) -> TableBlock | None:
    """Return the parts of the sensor error by the truth; None where none was found."""
    budget = bench.budget
    if budget is None or len(budget.parts) < 2:
        return None
    rows = tuple(
        (
            _PARTS[row["part"]],
            _NONE if row["part"] == "as stamped" else degrees(row["share_deg"]),
            *(degrees(row[f"{key}_deg"]) for key in ("final", "rms", "max")),
        )
        for row in budget.parts.to_dict("records")
    )
    step = bench.clock.step
    return TableBlock(
        ("sensor", "change", "final", "RMS", "largest"),
        rows,
        caption="Estimated from this log and its reference, removed one after the other. Stamps: "
        f"{1e3 * budget.delay_s:.3g} ms late (1σ {1e3 * budget.delay_sd:.2g} ms), drifting by "
        f"{budget.drift_ppm:.2g} ppm (1σ {budget.drift_sd_ppm:.2g}); "
        f"{budget.delay_s / step:.2g} of a step: 0.5 where samples are means over the step before "
        "their stamps, 0 where they are instantaneous, -0.5 where they are means over the step "
        "after.",
        title="Parts of the sensor error",
    )


def luck_words(luck: float) -> str:
    """Return whether a rank difference to the next algorithm is due to chance."""
    if not math.isfinite(luck):
        return _NONE
    if luck < 0.05:
        return f"significant ({luck:.2g})"
    return f"not significant ({luck:.2g})"


def trial_table(bench: AttitudeComparison) -> TableBlock | None:
    """Return the ranking over several trials; None for a single trial."""
    if bench.trials is None:
        return None
    rows = tuple(
        (
            str(row["algorithm"]),
            degrees(float(row["mean_deg"])),
            _interval(float(row["low_deg"]), float(row["high_deg"])),
            luck_words(float(row["luck"])),
        )
        for _, row in bench.trials.ranking.iterrows()
    )
    names = [row[0] for row in rows]
    answer = bench.answer.algorithm
    return TableBlock(
        ("algorithm", "mean error", "95 % interval", "difference from the next"),
        rows,
        text=(0, 3),
        caption="In brackets: probability that the next one is no worse, from paired differences.",
        strong=(names.index(answer),) if answer in names else (),
        title=f"Over {len(bench.trials.names)} trials",
    )


def _interval(low: float, high: float) -> str:
    if not (math.isfinite(low) and math.isfinite(high)):
        return _NONE
    return f"{degrees(max(low, 0.0))} to {degrees(high)}"


def peer_table(bench: AttitudeComparison) -> TableBlock | None:
    """Return the errors of other libraries, gyro-only ones separate from aided ones.

    Returns
    -------
    TableBlock or None
        None if no other library ran.
    """
    if not bench.peers:
        return None
    alone, aided = like_with_like(bench)
    judged = bool(bench.scores)
    rows = [
        (f"strapdown {name}", degrees(error) if judged else _NONE, "", "gyro")
        for name, error in full_rate_errors(bench).items()
    ]
    rows += [(p.peer, degrees(largest_known(p.scores)), "", p.aiding) for p in alone]
    rows += [(p.peer, "", degrees(largest_known(p.scores)), p.aiding) for p in aided]
    return TableBlock(
        ("library", "gyro alone", "aided", "uses"),
        tuple(rows),
        text=(0, 3),
        caption="Largest error against the known attitude. An aided filter also uses other "
        "sensors: do not compare its column with the other. These libraries take each row as the "
        "mean over its step, and so do the aided filters of strapdown; its algorithms as the rate "
        "at its stamp, unless --sampling mean.",
        strong=_named(bench),
        title="Filters and other libraries on the same log",
    )


def filter_table(bench: AttitudeComparison) -> TableBlock | None:
    """Return errors, coverage and cost of the aided filters.

    Returns
    -------
    TableBlock or None
        None if none ran.
    """
    _, aided = like_with_like(bench)
    if not aided:
        return None
    return TableBlock(
        (
            *("filter", "uses", "RMS", "final", "inclination", "heading", "drift/min", "in 95 %"),
            *("float32", "ops", "bytes"),
        ),
        tuple(_filter_row(peer) for peer in aided),
        text=(0, 1),
        caption="Root mean square and final error against the truth; its parts about a level axis "
        "and about the vertical; without a magnetometer the heading is that of the truth at the "
        "start. Drift: root mean square change of the heading error over a minute, or over half "
        "of a shorter record, per minute. In 95 %: share of the time in which inclination and "
        "heading are within their stated 95 % bounds. Float32: largest difference in single "
        "precision. Ops: operations a sample, as counted on the kernel; bytes: kept between "
        "samples in single precision.",
        title="Aided filters",
    )


def _filter_row(peer: PeerRun) -> tuple[str, ...]:
    errors, cost = peer.errors, peer.cost
    parts: tuple[str, ...] = ("",) * 6
    if errors is not None:
        numbers = (
            *(errors.rms_deg, errors.final_deg, errors.inclination_deg, errors.heading_deg),
            errors.drift_deg_per_min,
        )
        bounds = "" if errors.covered is None else " / ".join(f"{x:.0%}" for x in errors.covered)
        parts = (*(degrees(x) for x in numbers), bounds)
    of_kernel = ("", "", "")
    if cost is not None and peer.single_deg is not None:
        operations = cost.add + cost.multiply + cost.divide + cost.sqrt + cost.trig
        of_kernel = (degrees(peer.single_deg), f"{operations:.0f}", f"{4 * cost.memory}")
    sensors = {"gyro+accel": "6D", "gyro+accel+mag": "9D"}
    name = peer.peer.removeprefix("strapdown ")
    return (name, sensors[peer.aiding], *parts, *of_kernel)


# Dead-reckoned positions and the second log.


def place_table(bench: AttitudeComparison) -> TableBlock | None:
    """Return the errors of dead-reckoned positions against known positions.

    Returns
    -------
    TableBlock or None
        None if no position was given.
    """
    if not bench.places:
        return None
    rows = tuple(
        (
            place.algorithm,
            place.against,
            f"{place.error_m:.3g}",
            f"{place.sd_m:.2g}",
            f"{place.corrected_error_m:.3g}",
            f"{place.corrected_sd_m:.2g}",
            f"{place.end_velocity_m_s:.3g}",
        )
        for place in bench.places
    )
    legs = max(place.legs for place in bench.places)
    return TableBlock(
        (
            *("algorithm", "reference", "error, m", "1σ, m", "zero velocity, m", "1σ, m"),
            "final velocity, m/s",
        ),
        rows,
        text=(0, 1),
        caption=f"Over at most {legs} stretch{'es' if legs > 1 else ''} between rests. Zero "
        "velocity: corrected for zero velocity at the end of each. 1σ: from assumed biases, tilt "
        "and noise of a consumer sensor, without scale factors.",
        title="Positions, dead-reckoned between rests",
    )


def offer_lines(bench: AttitudeComparison) -> list[str]:
    """Stationary stretches of similar attitude, proposed as reference points."""
    return [
        f"--reference '{offer.words}' ({offer.apart_deg:.2g}° apart by gravity, 1σ "
        f"{offer.sd_deg:.2g}°; {offer.caveat})"
        for offer in bench.offers[:4]
    ]
