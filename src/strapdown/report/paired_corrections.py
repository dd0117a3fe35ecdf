"""A record navigated twice, with two corrections of the estimated errors: errors of both.

Chernodarov (2009), Figs. 8 to 11: the errors of ground velocity and of position with the sensor
drifts "damped" and not.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from strapdown.constants import Array
from strapdown.evaluation.trajectory_differences import trajectory_differences
from strapdown.formats import csv
from strapdown.frames import ned_from_geodetic
from strapdown.navigation.record import NavigationRecord
from strapdown.report.chart import BLUE, VERMILLION, Chart, Panel, curve
from strapdown.report.chart import BUCKETS_OVER_TIME as BUCKETS
from strapdown.report.document import TableBlock, table_of
from strapdown.report.navigation_evaluation import rms
from strapdown.report.values import duration_words, length_words, plain
from strapdown.tables import GEODETIC, VELOCITY
from strapdown.tables.checks import index_of, values_of

if TYPE_CHECKING:
    from strapdown.report.navigation_evaluation import NavigationEvaluation
    from strapdown.systems.navigation_run import NavigationRun

#: Times after the begin of navigation that the table has, s, besides the end.
AT = (60.0, 120.0, 300.0, 1200.0, 3600.0)
COLOURS = (BLUE, VERMILLION)


@dataclass(frozen=True, eq=False)
class HorizontalErrors:
    """Horizontal errors of one of the two solutions.

    Attributes
    ----------
    kind : str
        Of `DAMPINGS`.
    time : ndarray, (n,), s
    velocity, position : ndarray, (n,), m/s and m
        Lengths of the errors; NaN where the reference has none.
    velocity_sd, position_sd : ndarray, (n,), m/s and m
        Stated: root of the sum of both variances.
    """

    kind: str
    time: Array
    velocity: Array
    position: Array
    velocity_sd: Array
    position_sd: Array


def reference_words(result: NavigationRun) -> str:
    """Return what the errors are relative to."""
    if result.source.truth is not None:
        return result.source.truth_name or "the truth"
    return f"the fixes of {name}" if (name := _receiver(result)) else ""


def paired_errors(result: NavigationRun) -> tuple[HorizontalErrors, ...]:
    """Return the errors of the run and of the one beside it; empty without a second or a reference.

    Relative to the truth, or else to the fixes of the first receiver, as in the paper: then the
    errors contain those of the fixes, and the lever arm of the antenna.
    """
    if result.beside is None or not reference_words(result):
        return ()
    kinds = (result.spec.damping.kind, str(result.spec.damping.beside))
    return tuple(
        _horizontal(result, kind, record)
        for kind, record in zip(kinds, (result.filtered, result.beside), strict=True)
    )


def _receiver(result: NavigationRun) -> str:
    """Name of the first measurement with positions."""
    tables = result.source.tables
    return next((name for name, one in tables.items() if set(GEODETIC) <= set(one.columns)), "")


def _horizontal(result: NavigationRun, kind: str, record: NavigationRecord) -> HorizontalErrors:
    trajectory = record.trajectory
    if result.source.truth is not None:
        apart = trajectory_differences(trajectory, result.source.truth, result.ellipsoid)
        time = index_of(apart)
        position = np.hypot(*values_of(apart, ["north", "east"]).T)
        velocity = np.hypot(*values_of(apart, ["VN", "VE"]).T)
    else:
        fixes = result.source.tables[_receiver(result)]
        time = index_of(fixes)
        stamps = index_of(trajectory)
        inside = (time >= stamps[0]) & (time <= stamps[-1])
        inside &= np.isfinite(values_of(fixes, GEODETIC)).all(axis=1)
        time, fixes = time[inside], fixes[inside]
        own = {c: np.interp(time, stamps, trajectory[c]) for c in (*GEODETIC, *VELOCITY[:2])}
        places = values_of(fixes, GEODETIC)
        off = [
            ned_from_geodetic([[own[c][k] for c in GEODETIC]], place)[0]
            for k, place in enumerate(places)
        ]
        position = np.hypot(*np.reshape(off, (-1, 3))[:, :2].T)
        velocity = np.hypot(*(own[c] - fixes[c].to_numpy() for c in VELOCITY[:2]))
    marks = index_of(record.sd)
    stated = [
        np.interp(time, marks, np.hypot(*values_of(record.sd, columns).T))
        for columns in (["VN", "VE"], ["north", "east"])
    ]
    return HorizontalErrors(kind, time, velocity, position, *stated)


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


def paired_json(evaluation: NavigationEvaluation) -> dict[str, Any]:
    """Return the errors of both solutions as plain data."""
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
            for one in evaluation.pair
        },
    }


def write_paired(evaluation: NavigationEvaluation, folder: Path, comments: dict[str, str]) -> None:
    """Write ``paired.csv``: errors of both solutions over time."""
    pair = evaluation.pair
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
