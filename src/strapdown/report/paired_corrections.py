"""A record navigated twice, with two corrections of the estimated errors: errors of both.

Chernodarov (2009), Figs. 8 to 11: the errors of ground velocity and of position with the sensor
drifts "damped" and not.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from strapdown.formats import csv
from strapdown.report.chart import BLUE, VERMILLION, Chart, Panel, curve
from strapdown.report.chart import BUCKETS_OVER_TIME as BUCKETS
from strapdown.report.document import TableBlock, table_of
from strapdown.report.navigation_evaluation import NavigationEvaluation, reference_words, rms
from strapdown.report.values import duration_words, length_words, plain

#: Times after the begin of navigation that the table has, s, besides the end.
AT = (60.0, 120.0, 300.0, 1200.0, 3600.0)
COLOURS = (BLUE, VERMILLION)


def paired_table(evaluation: NavigationEvaluation) -> TableBlock | None:
    """Errors of both solutions at some times after the begin, and their ratio."""
    pair = evaluation.pair
    if not pair or not len(pair[0].time):
        return None
    one, other = pair
    last = float(one.time[-1] - one.time[0])
    rows = []
    for after in (*(t for t in AT if t < last), last):
        k = int(np.argmin(np.abs(one.time - one.time[0] - after)))
        j = int(np.argmin(np.abs(other.time - one.time[k])))
        rows.append(
            (
                duration_words(after),
                *(f"{plain(e.velocity[i], 3)} m/s" for e, i in ((one, k), (other, j))),
                *(length_words(float(e.position[i])) for e, i in ((one, k), (other, j))),
                _ratio(other.position[j], one.position[k]),
            )
        )
    sizes = [rms(x) for x in (one.velocity, other.velocity, one.position, other.position)]
    rows.append(
        (
            "rms",
            *(f"{plain(x, 3)} m/s" for x in sizes[:2]),
            *(length_words(x) for x in sizes[2:]),
            _ratio(sizes[3], sizes[2]),
        )
    )
    kinds = f"{one.kind} | {other.kind}"
    return table_of(
        f"after | velocity, {kinds} | position, {kinds} | ratio",
        rows,
        "Horizontal errors of the same record with both corrections of the estimated errors, "
        f"relative to {reference_words(evaluation.run)}.",
        strong=(len(rows) - 1,),
    )


def paired_chart(evaluation: NavigationEvaluation) -> Chart | None:
    """Errors of ground velocity and of position over time, both solutions in one chart."""
    from strapdown.report.navigation_charts import over_time

    pair = evaluation.pair
    if not pair:
        return None
    panels = []
    for label, of in (("velocity, m/s", "velocity"), ("position, m", "position")):
        lines = []
        for one, colour in zip(pair, COLOURS, strict=True):
            error, sd = getattr(one, of), getattr(one, f"{of}_sd")
            lines.append(curve(one.kind, one.time, error, colour, width=1.5, buckets=BUCKETS))
            name = f"{one.kind}, 1 sd as stated"
            lines.append(curve(name, one.time, sd, colour, "dot", 1.1, buckets=BUCKETS))
        panels.append(Panel(label, tuple(lines)))
    return over_time(
        evaluation.run.filtered,
        "paired",
        "With two corrections of the estimated errors",
        f"Lengths of the horizontal errors relative to {reference_words(evaluation.run)}: with "
        f"{pair[0].kind} and with {pair[1].kind}. Dotted: as stated, one standard deviation.",
        panels,
    )


def paired_json(evaluation: NavigationEvaluation) -> dict[str, Any] | None:
    """Return the errors of both solutions as plain data."""
    pair = evaluation.pair
    if not pair:
        return None
    return {
        "relative_to": reference_words(evaluation.run),
        "horizontal_errors": {
            one.kind: {
                "velocity_rms_m_per_s": rms(one.velocity),
                "velocity_at_end_m_per_s": one.velocity[-1],
                "velocity_sd_at_end_m_per_s": one.velocity_sd[-1],
                "position_rms_m": rms(one.position),
                "position_at_end_m": one.position[-1],
                "position_sd_at_end_m": one.position_sd[-1],
            }
            for one in pair
        },
    }


def write_paired(evaluation: NavigationEvaluation, folder: Path, comments: dict[str, str]) -> None:
    """Write ``paired.csv``: errors of both solutions over time, if there are two."""
    pair = evaluation.pair
    if not pair:
        return
    columns = {"time_s": pair[0].time}
    for each in pair:
        for name, values in (
            ("velocity_error_m_s", each.velocity),
            ("velocity_sd_m_s", each.velocity_sd),
            ("position_error_m", each.position),
            ("position_sd_m", each.position_sd),
        ):
            columns[f"{each.kind}_{name}"] = np.interp(pair[0].time, each.time, values)
    against = {**comments, "against": reference_words(evaluation.run)}
    csv.write(folder / "paired.csv", columns, against)


def _ratio(more: float, less: float) -> str:
    return plain(more / less, 2) if less > 0.0 else "–"
