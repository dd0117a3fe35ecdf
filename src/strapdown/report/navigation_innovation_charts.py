"""Charts of what was observed beside what was expected."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import TWO_SIDED_95
from strapdown.evaluation.nees import bounds
from strapdown.navigation.record import NavigationRecord
from strapdown.report.chart import AXIS_COLOURS, BLACK, GREY, VERMILLION, Chart, Level, Line, Panel
from strapdown.report.navigation_agreement import Agreement, chi_square_far
from strapdown.report.navigation_charts import over_time
from strapdown.report.navigation_thinning import BUCKETS, broken, kept_rows, thin_fill

__all__ = ["innovation_chart", "nis_chart"]

Array = NDArray[np.float64]

# What lies beyond so many times the usual bound is drawn at the edge.
_REACH, _USUAL = 2.5, 0.97
# Epochs of a mean, and the least that is drawn of a sum of squares.
_WINDOW, _LEAST = 20, 1e-2
# Points of a panel; of those within so many standard deviations no more are drawn.
_POINTS, _FAR = 500, 3.0


def innovation_chart(record: NavigationRecord, agreement: Agreement) -> Chart:
    """Innovations of one observation with the bounds that were expected."""
    panels = []
    beyond = 0
    step = max(1, agreement.epochs // _POINTS)
    for k, label in enumerate(agreement.labels):
        nu, bound = agreement.nu[:, k], TWO_SIDED_95 * agreement.sd[:, k]
        edge = _REACH * float(np.quantile(bound, _USUAL))
        low, high = np.clip(-bound, -edge, edge), np.clip(bound, -edge, edge)
        time, low, high = broken(agreement.time, low, high)
        fill = thin_fill("95 % expected", time, low, high, GREY, opacity=0.22)
        lost = agreement.weight[:, k] <= 0.0
        out = np.abs(nu) > edge
        beyond += int(out.sum())
        colour = AXIS_COLOURS[k % 3]
        lines = [
            *_points(
                "used", agreement.time, nu, _some(agreement, k, ~lost & ~out), colour, "circle", 3.4
            ),
            *_points("rejected", agreement.time, nu, lost & ~out, VERMILLION, "x", 6.0),
        ]
        for up, symbol in ((True, "triangle-up"), (False, "triangle-down")):
            some = out & ((nu > 0.0) == up)
            at = np.full(nu.size, edge if up else -edge)
            lines += _points("beyond the picture", agreement.time, at, some, BLACK, symbol, 6.0)
        panels.append(Panel(label, tuple(lines), fills=(fill,), height=0.7))
    more = f" {beyond} lie beyond the edge, and are drawn at it." if beyond else ""
    if step > 1:
        more += (
            f" Of those within {_FAR:g} standard deviations one in {step} is drawn, of the others "
            "each that can be told apart."
        )
    return over_time(
        f"innovations-{agreement.name.replace('.', '-').replace('_', '-')}",
        f"Innovations of {agreement.name}",
        f"Observed less expected; 95 of 100 belong in the band.{more}",
        tuple(panels),
        record,
    )


def _some(one: Agreement, k: int, which: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """All that are far off, and of the others even in time as many as can be seen."""
    step = max(1, one.epochs // _POINTS)
    with np.errstate(divide="ignore", invalid="ignore"):
        far = np.abs(one.nu[:, k]) > _FAR * one.sd[:, k]
    even = np.arange(one.epochs) % step == 0
    return np.asarray(which & (far | even))


def _points(
    name: str,
    time: Array,
    value: Array,
    some: NDArray[np.bool_],
    colour: str,
    symbol: str,
    size: float,
) -> list[Line]:
    if not some.any():
        return []
    time, value = time[some], value[some]
    rows = kept_rows((value,), BUCKETS)
    return [Line(name, time[rows], value[rows], colour, points=True, symbol=symbol, size=size)]


def nis_chart(record: NavigationRecord, found: tuple[Agreement, ...]) -> Chart | None:
    """Normalised innovations squared of every observation, with what is expected of them."""
    panels = []
    thin = any(one.epochs >= 2 * _POINTS for one in found)
    for k, one in enumerate(found):
        if not one.used.any():
            continue
        low, high = bounds(one.freedom)
        nis = np.maximum(one.nis, _LEAST)
        colour = AXIS_COLOURS[(2 + k) % 3]
        step = max(1, one.epochs // _POINTS)
        drawn = (np.arange(one.epochs) % step == 0) | (one.nis > chi_square_far(one.freedom))
        lines = _points("an epoch", one.time, nis, one.used & drawn, colour, "circle", 3.2)
        lines += _points("rejected", one.time, nis, ~one.used, VERMILLION, "x", 6.0)
        lines += _mean(one)
        levels = (Level(low, "2.5 %"), Level(high, "97.5 %"))
        panels.append(Panel(f"{one.name}", tuple(lines), log=True, levels=levels, height=0.8))
    if not panels:
        return None
    return over_time(
        "nis",
        "Normalised innovations squared",
        "By their expected variance; 95 of 100 belong between the levels. The line is the mean "
        f"of {_WINDOW} epochs that were used."
        + (
            " Where there are many, the points are a part of them, and all of the largest."
            if thin
            else ""
        ),
        tuple(panels),
        record,
    )


def _mean(one: Agreement) -> list[Line]:
    nis, time = one.nis[one.used], one.time[one.used]
    if nis.size < 2 * _WINDOW:
        return []
    total = np.cumsum(np.concatenate([[0.0], nis]))
    mean = (total[_WINDOW:] - total[:-_WINDOW]) / _WINDOW
    middle = time[_WINDOW // 2 : _WINDOW // 2 + mean.size]
    middle, mean = broken(middle, mean)
    rows = kept_rows((mean,), BUCKETS // 2)
    return [Line("mean", middle[rows], mean[rows], BLACK, width=1.4)]
