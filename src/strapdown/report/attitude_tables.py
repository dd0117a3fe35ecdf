"""Tables of the attitude bench, shared by terminal and page."""

from __future__ import annotations

import math
from itertools import takewhile

import numpy as np

from strapdown.attitude_comparison.comparison import AttitudeComparison
from strapdown.attitude_comparison.references import PeerRun
from strapdown.report.attitude_words import (
    MEANINGS,
    condition,
    degrees,
    full_rate_errors,
    largest_known,
    like_with_like,
    share_basis,
    source_of,
    sweep_grid,
)
from strapdown.report.document import TableBlock, table_of

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
    parts = _parts(bench)
    compared, made = {}, {}
    for run in bench.runs:
        name = run.algorithm
        scores = [s for s in bench.scores if s.algorithm == name]
        errors = []
        for s in scores:
            errors += [s.error_deg, s.rms_deg, s.max_deg] if s.against == "truth" else []
        known = [s.error_deg for s in scores if s.reference is not None]
        errors += [max(known)] if len(known) > _MOST_POINTS else known
        compared[name] = [*map(degrees, errors), *[_NONE] * (len(columns) - len(errors))]
        made[name] = [cells.get(name, _NONE) for cells in parts.values()]
    note = ""
    if bench.shares:
        sensor = "sensor" in parts
        note = (
            f"alg. error, {'sensor, ' if sensor else ''}float32: largest error due to the "
            f"algorithm at this rate, {'to the sensor, ' if sensor else ''}and to single "
            f"precision. {share_basis(bench)} cycles: of a Cortex-M4F per sample; memory: numbers "
            "kept between samples."
        )
    tables = [("Results", [*columns, *parts], {k: compared[k] + made[k] for k in made}, note)]
    if len(columns) > _MOST_BESIDE:
        tables = [
            ("Results", columns, compared, ""),
            ("Parts of the error", list(parts), made, note),
        ]
    return [
        TableBlock(
            ("algorithm", *header),
            tuple((name, *row) for name, row in rows.items()),
            caption=caption,
            strong=_named(bench),
            title=title,
        )
        for title, header, rows, caption in tables
    ]


def _parts(bench: AttitudeComparison) -> dict[str, dict[str, str]]:
    """Columns of the error contributions and costs, each with its cells by algorithm."""
    cells: dict[str, dict[str, str]] = {}
    if bench.shares:
        cells["alg. error"] = {s.algorithm: degrees(s.own_deg[2]) for s in bench.shares}
        if any(s.sensor_deg is not None for s in bench.shares):
            cells["sensor"] = {
                s.algorithm: degrees(s.sensor_deg and s.sensor_deg[2]) for s in bench.shares
            }
        if len(bench.sweep):
            # Lowest rate of averaged samples down to which the algorithm error is within tolerance.
            limit, lowest = bench.answer.tolerance_deg, {}
            for name, errors in sweep_grid(bench, "sum", "own_deg").T.items():
                within = list(takewhile(lambda cell: cell[1] <= limit, errors.items()))
                lowest[str(name)] = f"{within[-1][0]:.3g} Hz" if within else _NONE
            cells[f"≤ {limit:g}° to"] = lowest
        cells["float32"] = {s.algorithm: degrees(s.single_deg[2]) for s in bench.shares}
    if bench.costs:
        cells["cycles"] = {c.algorithm: number(c.cycles) for c in bench.costs}
        cells["memory"] = {c.algorithm: str(c.memory) for c in bench.costs}
    return cells


def condition_table(bench: AttitudeComparison) -> TableBlock | None:
    """Return the source and the diagnostics of each algorithm."""
    rows = ((r.algorithm, source_of(r), condition(r.diagnostics)) for r in bench.runs)
    columns = "algorithm | source | diagnostics"
    title = "The algorithms"
    return table_of(columns, rows, text=(0, 1, 2), strong=_named(bench), title=title)


def cost_table(bench: AttitudeComparison) -> TableBlock | None:
    """Return the operations per sample of each algorithm; None if none were counted."""
    rows = []
    for c in bench.costs:
        counts = (c.add, c.multiply, c.divide, c.sqrt, c.trig, c.cycles)
        rows.append((c.algorithm, *map(number, counts), str(c.memory)))
    return table_of(
        "algorithm | add | multiply | divide | root | sin, cos | cycles | memory",
        rows,
        "Operations counted in the kernel, in steps of 0.01 rad; cycles: weighted by "
        "their duration on a Cortex-M4F's floating-point unit, for ranking; memory: numbers kept "
        "between samples.",
        strong=_named(bench),
        title="Cost per sample",
    )


def sweep_tables(bench: AttitudeComparison) -> list[TableBlock]:
    """Return the errors at every rate, one table per method of lowering it."""
    tables = []
    limit = bench.answer.tolerance_deg
    for meaning, words in MEANINGS.items():
        grid = sweep_grid(bench, meaning)
        values = grid.to_numpy(dtype=float)
        if not values.size or not math.isfinite(float(grid.min().min())):
            continue
        passed = frozenset((int(i), int(j) + 1) for i, j in np.argwhere(values <= limit))
        rows = []
        for i, name in enumerate(grid.index):
            cells = [degrees(v) if math.isfinite(v) else _NONE for v in values[i].tolist()]
            ticks = ("✓ " if (i, j) in passed else "" for j in range(1, len(cells) + 1))
            rows.append((name, *(tick + cell for tick, cell in zip(ticks, cells, strict=True))))
        tables.append(
            TableBlock(
                ("algorithm", *(f"{number(float(rate))} Hz" for rate in grid.columns)),
                tuple(rows),
                caption=f"{'✓:' if passed else 'None is'} within the tolerance of "
                f"{degrees(limit)}.",
                passed=passed,
                strong=_named(bench),
                title=f"Error by rate, {words}",
            )
        )
    return tables


def difference_table(bench: AttitudeComparison) -> TableBlock | None:
    """Return the largest difference of each pair of algorithms; None for a single one."""
    names = [run.algorithm for run in bench.runs]
    rows = [
        (name, *(_NONE if i == j else degrees(float(v)) for j, v in enumerate(values)))
        for i, (name, values) in enumerate(
            zip(names, bench.differences_deg.to_numpy(), strict=True)
        )
    ]
    title = "Largest difference between the algorithms"
    return table_of(("", *names), rows if len(rows) > 1 else (), title=title)


#: Description of each part of the sensor error.
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
    rows = []
    for row in budget.parts.to_dict("records"):
        share = _NONE if row["part"] == "as stamped" else degrees(row["share_deg"])
        errors = (degrees(row[f"{key}_deg"]) for key in ("final", "rms", "max"))
        rows.append((_PARTS[row["part"]], share, *errors))
    return table_of(
        "sensor | change | final | RMS | largest",
        rows,
        "Estimated from this log and its reference, removed one after the other. Stamps: "
        f"{1e3 * budget.delay_s:.3g} ms late (1σ {1e3 * budget.delay_sd:.2g} ms), drifting by "
        f"{budget.drift_ppm:.2g} ppm (1σ {budget.drift_sd_ppm:.2g}); "
        f"{budget.delay_s / bench.clock.step:.2g} of a step: 0.5 where samples are means over the "
        "step before their stamps, 0 where they are instantaneous, -0.5 where they are means over "
        "the step after.",
        title="Parts of the sensor error",
    )


def luck_words(luck: float) -> str:
    """Return whether a rank difference to the next algorithm is due to chance."""
    if not math.isfinite(luck):
        return _NONE
    return f"{'' if luck < 0.05 else 'not '}significant ({luck:.2g})"


def trial_table(bench: AttitudeComparison) -> TableBlock | None:
    """Return the ranking over several trials; None for a single trial."""
    if bench.trials is None:
        return None
    rows = []
    for name, *numbers in bench.trials.ranking[_RANKING].itertuples(index=False):
        mean, low, high, luck = map(float, numbers)
        interval = _NONE
        if math.isfinite(low) and math.isfinite(high):
            interval = f"{degrees(max(low, 0.0))} to {degrees(high)}"
        rows.append((str(name), degrees(mean), interval, luck_words(luck)))
    names = [row[0] for row in rows]
    answer = bench.answer.algorithm
    return table_of(
        "algorithm | mean error | 95 % interval | difference from the next",
        rows,
        "In brackets: probability that the next one is no worse, from paired differences.",
        text=(0, 3),
        strong=(names.index(answer),) if answer in names else (),
        title=f"Over {len(bench.trials.names)} trials",
    )


_RANKING = ["algorithm", "mean_deg", "low_deg", "high_deg", "luck"]


def peer_table(bench: AttitudeComparison) -> TableBlock | None:
    """Return the errors of other libraries, gyro-only ones separate from aided ones, if known."""
    if not (bench.peers and bench.scores):
        return None
    alone, aided = like_with_like(bench)
    rows = [
        (f"strapdown {name}", degrees(error), "", "gyro")
        for name, error in full_rate_errors(bench).items()
    ]
    rows += [(p.peer, degrees(largest_known(p.scores)), "", p.aiding) for p in alone]
    rows += [(p.peer, "", degrees(largest_known(p.scores)), p.aiding) for p in aided]
    return table_of(
        "library | gyro alone | aided | uses",
        rows,
        "Largest error against the known attitude. An aided filter also uses other "
        "sensors: do not compare its column with the other. These libraries take each row as the "
        "mean over its step, and so do the aided filters of strapdown; its algorithms as the rate "
        "at its stamp, unless --sampling mean.",
        text=(0, 3),
        strong=_named(bench),
        title="Filters and other libraries on the same log",
    )


def filter_table(bench: AttitudeComparison) -> TableBlock | None:
    """Return errors, coverage and cost of the aided filters, if any ran."""
    rows = [_filter_row(peer) for peer in like_with_like(bench)[1]]
    columns: tuple[str, ...] = (
        *("filter", "uses", "RMS", "final", "tilt", "heading", "drift/min", "in 95 %"),
        *(f"≤ {bench.answer.tolerance_deg:g}° to", "float32", "ops", "bytes"),
    )
    errors = slice(2, 9)  # against a truth
    caption = (
        "Float32: largest difference in single precision. Ops: operations a sample, as counted on "
        "the kernel; bytes: kept between samples in single precision."
    )
    if any(cell not in ("", _NONE) for row in rows for cell in row[errors]):
        caption = (
            "Root mean square and final error against the truth; its parts about a level axis "
            "and about the vertical; without a magnetometer the heading is that of the truth at "
            "the start. Drift: root mean square change of the heading error over a minute, or over "
            "half of a shorter record, per minute. In 95 %: share of the time in which inclination "
            "and heading are within their stated 95 % bounds. ≤: lowest rate, with samples "
            "averaged, down to which the largest error is within the tolerance; in brackets, that "
            f"of roll and pitch. {caption}"
        )
    else:
        columns, *rows = (row[: errors.start] + row[errors.stop :] for row in (columns, *rows))
    return table_of(columns, rows, caption, text=(0, 1), title="Aided filters")


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
    rate = "" if peer.ran is None else _NONE
    if peer.lowest_hz is not None:
        rate = f"{peer.lowest_hz:.3g} Hz"
    elif peer.lowest_level_hz is not None:
        rate = f"({peer.lowest_level_hz:.3g} Hz)"
    sensors = {"gyro+accel": "6D", "gyro+accel+mag": "9D"}
    name = peer.peer.removeprefix("strapdown ")
    return (name, sensors[peer.aiding], *parts, rate, *of_kernel)


# Dead-reckoned positions and the second log.


def place_table(bench: AttitudeComparison) -> TableBlock | None:
    """Return the errors of dead-reckoned positions against known positions, if any is given."""
    legs = max((place.legs for place in bench.places), default=0)
    return table_of(
        "algorithm | reference | error, m | 1σ, m | zero velocity, m | 1σ, m | final velocity, m/s",
        (
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
        ),
        f"Over at most {legs} stretch{'es' if legs > 1 else ''} between rests. Zero "
        "velocity: corrected for zero velocity at the end of each. 1σ: from assumed biases, tilt "
        "and noise of a consumer sensor, without scale factors.",
        text=(0, 1),
        title="Positions, dead-reckoned between rests",
    )
