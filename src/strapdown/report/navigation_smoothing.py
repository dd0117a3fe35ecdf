"""What a smoother made of a run: bounds and errors beside those of the filter alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import TWO_SIDED_95
from strapdown.evaluation.plane_bound import plane_bound
from strapdown.evaluation.smoother_consistency import SmootherConsistency
from strapdown.navigation.record import NavigationRecord
from strapdown.report.chart import BLUE, GREY, Chart, Panel, curve
from strapdown.report.crash_values import plain
from strapdown.report.document import TableBlock
from strapdown.report.navigation_charts import over_time
from strapdown.report.navigation_found import NavigationFound
from strapdown.report.navigation_thinning import BUCKETS
from strapdown.report.navigation_values import share_words
from strapdown.tables import EULER, NED, VELOCITY

__all__ = ["agreement_words", "smoothing_chart", "smoothing_table", "smoothing_words"]

Array = NDArray[np.float64]

#: A smaller share of the differences within three standard deviations is not by chance.
SHARE = 0.95
UNITS = dict.fromkeys(NED, "m") | dict.fromkeys(VELOCITY, "m/s") | dict.fromkeys(EULER, "°")


def smoothing_chart(found: NavigationFound) -> Chart | None:
    """Bounds of place, height and heading over time, before and after."""
    forward, record = found.told.forward, found.record
    if forward is None:
        return None
    panels = []
    for label, of in (
        ("horizontal, m", _plane),
        ("height, m", lambda one: _bound(one, "down")),
        ("heading, deg", lambda one: _bound(one, "heading")),
    ):
        lines = tuple(
            curve(name, one.sd.index.to_numpy(), of(one), colour, "solid", width, buckets=BUCKETS)
            for name, one, colour, width in (
                ("filter", forward, GREY, 1.2),
                ("smoothed", record, BLUE, 1.6),
            )
        )
        panels.append(Panel(label, lines, log=True))
    return over_time(
        "smoothing",
        "What later observations told",
        "Bounds of 95 %: of the filter, by what came before; smoothed, by what came after, too.",
        tuple(panels),
        record,
    )


def smoothing_table(found: NavigationFound) -> TableBlock | None:
    """Median bounds and, beside the truth, errors before and after."""
    forward, agreement = found.told.forward, found.smoother
    if forward is None or agreement is None:
        return None
    rows = []
    for k, column in enumerate(agreement.columns):
        before, after = (float(np.median(_bound(one, column))) for one in (forward, found.record))
        rows.append(
            (
                f"{column}, {UNITS[column]}",
                _figure(before),
                _figure(after),
                plain(before / after, 1) if after > 0.0 else "–",
                *_errors(found, column),
                share_words(float(agreement.share[k])) if agreement.instants[k] else "–",
            )
        )
    return TableBlock(
        (
            *("", "filter", "smoothed", "times less"),
            *(() if found.errors is None else ("error of filter", "smoothed")),
            "agree",
        ),
        tuple(rows),
        text=(0,),
        caption="Bounds of 95 %, medians over the run"
        + ("" if found.errors is None else "; errors against the truth, root mean square")
        + "; and how often the two are within three of "
        "the standard deviations that their covariances leave for the difference (99.7 % where "
        "the model is right).",
        strong=tuple(k for k in range(len(rows)) if _apart(agreement, k)),
    )


def _errors(found: NavigationFound, column: str) -> tuple[str, ...]:
    """Root mean square errors before and after, where the truth is known."""
    if found.errors is None or found.forward_errors is None:
        return ()
    return tuple(_figure(one.score(column).rms) for one in (found.forward_errors, found.errors))


def smoothing_words(found: NavigationFound) -> str | None:
    """What the smoother did, in a sentence."""
    forward = found.told.forward
    if forward is None:
        return None
    before, after = (float(np.median(_plane(one))) for one in (forward, found.record))
    heading = [float(np.median(_bound(one, "heading"))) for one in (forward, found.record)]
    return (
        "Smoothed: every state is by all observations, later ones too. In the median the bound of "
        f"the place is {_figure(after)} m where the filter had {_figure(before)} m, that of the "
        f"heading {_figure(heading[1])}° where it had {_figure(heading[0])}°."
    )


def agreement_words(found: NavigationFound) -> tuple[tuple[str, str], ...]:
    """What is to be careful about where filter and smoother cannot both be right."""
    agreement = found.smoother
    if agreement is None:
        return ()
    apart = [k for k in range(len(agreement.columns)) if _apart(agreement, k)]
    if not apart:
        return ()
    worst = min(apart, key=lambda k: agreement.share[k])
    named = ", ".join(agreement.columns[k] for k in apart)
    return (
        (
            "Filter and smoother do not agree",
            f"in {named}: of {agreement.columns[worst]} {share_words(agreement.share[worst])} of "
            "the differences are within three of the standard deviations that are expected of "
            "them. Later observations speak against the model: look for errors of the sensors "
            "that last or change and are not stated ([sensors], [states.NAME]).",
        ),
    )


def _apart(agreement: SmootherConsistency, k: int) -> bool:
    return bool(agreement.instants[k] > 0 and agreement.share[k] < SHARE)


def _bound(record: NavigationRecord, column: str) -> Array:
    """The bound of a component, over the marks."""
    return TWO_SIDED_95 * record.sd[column].to_numpy(dtype=np.float64)


def _plane(record: NavigationRecord) -> Array:
    """The bound of the horizontal place, over the marks."""
    return plane_bound(record.covariance)


def _figure(value: float) -> str:
    return f"{value:.3g}" if value < 1000.0 else f"{value:.0f}"
