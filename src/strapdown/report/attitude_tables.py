"""Tables of the attitude bench, shared by terminal and page."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from strapdown.attitude_algorithms import ALGORITHMS
from strapdown.attitude_algorithms.algorithm import AttitudeRun
from strapdown.attitude_comparison.comparison import AttitudeComparison
from strapdown.attitude_comparison.references import PeerRun
from strapdown.evaluation.reference_points import Score
from strapdown.evaluation.second_log import SecondLog
from strapdown.report.attitude_charts import share_basis
from strapdown.report.attitude_words import (
    MEANINGS,
    condition,
    degrees,
    full_rate_errors,
    largest_known,
    like_with_like,
    sweep_grid,
)
from strapdown.report.document import TableBlock

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
        return [
            _table("Results", ["algorithm", *columns], names, compared, strong, ""),
            _table("What the error is made of", ["algorithm", *parts], names, made, strong, note),
        ]
    rows = [[*left, *right] for left, right in zip(compared, made, strict=True)]
    return [_table("Results", ["algorithm", *columns, *parts], names, rows, strong, note)]


def _table(
    title: str,
    columns: list[str],
    names: list[str],
    rows: list[list[str]],
    strong: tuple[int, ...],
    note: str,
) -> TableBlock:
    named = tuple((name, *row) for name, row in zip(names, rows, strict=True))
    return TableBlock(tuple(columns), named, caption=note, strong=strong, title=title)


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
        cells["own"] = {s.algorithm: degrees(s.own_deg[2]) for s in bench.shares}
        if any(s.sensor_deg is not None for s in bench.shares):
            cells["sensor"] = {
                s.algorithm: degrees(None if s.sensor_deg is None else s.sensor_deg[2])
                for s in bench.shares
            }
        if len(bench.sweep):
            cells[f"own ≤ {bench.answer.tolerance_deg:g}° to"] = {
                s.algorithm: _lowest_rate(bench, s.algorithm) for s in bench.shares
            }
        cells["float32"] = {s.algorithm: degrees(s.single_deg[2]) for s in bench.shares}
    if bench.costs:
        cells["cycles"] = {c.algorithm: number(c.cycles) for c in bench.costs}
        cells["memory"] = {c.algorithm: str(c.memory) for c in bench.costs}
    return list(cells), cells


def _lowest_rate(bench: AttitudeComparison, algorithm: str) -> str:
    """Lowest decimated rate down to which the algorithm error is within the tolerance."""
    cells = bench.sweep[
        (bench.sweep["algorithm"] == algorithm) & (bench.sweep["meaning"] == "drop")
    ].sort_values("factor")
    within = (cells["own_deg"] <= bench.answer.tolerance_deg).cummin()
    return f"{float(cells.loc[within, 'rate_hz'].min()):.3g} Hz" if within.any() else _NONE


def _part_note(bench: AttitudeComparison) -> str:
    if not bench.shares:
        return ""
    sensor = any(share.sensor_deg is not None for share in bench.shares)
    return (
        "own, "
        + ("sensor, " if sensor else "")
        + "float32: the largest that the algorithm with the rate, "
        + ("the sensor " if sensor else "")
        + f"and single precision make. {share_basis(bench)} cycles: of a Cortex-M4F, one sample; "
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
    columns = ("algorithm", "source", "own condition")
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
        caption="Operations counted on the kernel itself, in steps of 0.01 rad; cycles: the "
        "same weighed as a Cortex-M4F's floating-point unit takes them, for ranking; memory: "
        "numbers kept between samples.",
        strong=_named(bench),
        title="What a sample costs",
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


def luck_words(luck: float) -> str:
    """Return whether a rank difference to the next algorithm is due to chance."""
    if not math.isfinite(luck):
        return _NONE
    if luck < 0.05:
        return f"not luck ({luck:.2g})"
    return f"may be luck ({luck:.2g})"


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
        ("algorithm", "mean error", "95 % interval", "its rank above the next is"),
        rows,
        text=(0, 3),
        caption="In brackets: the probability that the next one is no worse, from paired "
        "differences.",
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
    rows += [(p.peer, _peer_error(p), "", p.aiding) for p in alone]
    rows += [(p.peer, "", _peer_error(p), p.aiding) for p in aided]
    return TableBlock(
        ("who", "gyro alone", "aided", "uses"),
        tuple(rows),
        text=(0, 3),
        caption="Largest error against what is known. An aided filter corrects what gyros alone "
        "cannot: its column is not to be compared with the other. These libraries take each "
        "row for the mean of its step; ours for the rate at its stamp, unless --sampling mean.",
        strong=_named(bench),
        title="Other libraries on the same log",
    )


def _peer_error(peer: PeerRun) -> str:
    error = largest_known(peer.scores)
    return _NONE if error is None else degrees(error)


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
            *("algorithm", "known", "error, m", "1σ, m", "stopped, m", "1σ, m"),
            "left at the rest, m/s",
        ),
        rows,
        text=(0, 1),
        caption=f"Over at most {legs} stretch{'es' if legs > 1 else ''} between rests. Stopped: "
        "with the velocity at the end of each brought to zero. The 1σ is what assumed biases, tilt "
        "and noise of a consumer sensor lead to; scale factors are not in it.",
        title="Places, dead-reckoned between rests",
    )


def offer_lines(bench: AttitudeComparison) -> list[str]:
    """Stationary stretches of similar attitude, proposed as reference points."""
    return [
        f"--reference '{offer.words}' ({offer.apart_deg:.2g}° apart by gravity, 1σ "
        f"{offer.sd_deg:.2g}°; {offer.caveat})"
        for offer in bench.offers[:4]
    ]


def places_json(bench: AttitudeComparison) -> dict[str, Any]:
    """Positions, proposed reference points and the second log as plain data."""
    return {
        "places": [asdict(place) for place in bench.places],
        "offered_references": [asdict(offer) for offer in bench.offers],
        "second_log": None if bench.second is None else _second_json(bench.second),
    }


# Each key carries the unit of its value.
_UNITS = {
    **dict.fromkeys(("start", "end", "middle", "offset", "offset_sd", "smoothing"), "_s"),
    **dict.fromkeys(("bias", "bias_sd", "residual"), "_rad_per_s"),
}


def _second_json(second: SecondLog) -> dict[str, Any]:
    return {key + _UNITS.get(key, ""): value for key, value in asdict(second).items()}
