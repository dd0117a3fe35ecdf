"""What each contributor adds to the uncertainty of the answers."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd

from strapdown.crash.path import CrashPath
from strapdown.crash.velocity_change import VelocityChange
from strapdown.report.chart import BLACK, BLUE, GREEN, Bars, Chart, Panel
from strapdown.tables import NED

__all__ = ["delta_v_budget", "delta_v_budget_chart", "place_budget_chart"]

_SUM = "all together"
# Of the largest sum: what is less is no bar, and joined with the others.
_LEAST = 0.01
_REST = "others"


def delta_v_budget(change: VelocityChange) -> pd.DataFrame:
    """Standard deviations that each contributor adds to a change of velocity.

    Returns
    -------
    DataFrame
        Indexed by contributor; ``forward right down``, m/s.
    """
    found = change.bound.by_contributor[["xx", "yy", "zz"]]
    values = np.sqrt(np.maximum(found.to_numpy(dtype=np.float64), 0.0))
    return pd.DataFrame(values, index=found.index, columns=["forward", "right", "down"])


def delta_v_budget_chart(change: VelocityChange) -> Chart:
    """Chart the contributors to the uncertainty of a change of velocity, the largest first.

    Parameters
    ----------
    change : VelocityChange
        Along vehicle axes.
    """
    table = delta_v_budget(change)[["forward", "right"]]
    return _chart(
        "budget-delta-v",
        "What makes the uncertainty of the change of velocity",
        "Standard deviation that each contributor adds to the change of velocity of the main "
        "event, forward and right; their squares add up to that of the bar at the top, and 1.96 "
        "of it are the 95 % bound. Contributors below 1 % of the sum are joined.",
        table,
        "m/s",
    )


def place_budget_chart(path: CrashPath, names: tuple[str, str] = ("forward", "right")) -> Chart:
    """Chart the contributors to the uncertainty of the end of the path, the largest first.

    Parameters
    ----------
    path : CrashPath
    names : (str, str)
        Of the first two axes of the path.
    """
    found = path.variances()[NED[:2]]
    table = pd.DataFrame(np.sqrt(found.to_numpy()), index=found.index, columns=list(names))
    at = 1e3 * float(path.time[-1])
    return _chart(
        "budget-place",
        "What makes the uncertainty of the end of the path",
        f"Standard deviation that each contributor adds to the place of the reference point at "
        f"{at:.0f} ms, {names[0]} and {names[1]}; their squares add up to that of the bar at the "
        "top, and 1.96 of it are the 95 % bound. Contributors below 1 % of the sum are joined.",
        table,
        "m",
    )


def _chart(slug: str, title: str, caption: str, table: pd.DataFrame, unit: str) -> Chart:
    total = np.sqrt((table**2).sum())
    table = _joined(table, float(total.max()))
    size = np.sqrt((table**2).sum(axis=1))
    # Stable, so that equal ones keep the order of the budget; the rest always last.
    order = sorted(table.index, key=lambda name: (name == _REST, -float(size[name])))
    categories = (_SUM, *(str(name) for name in order))
    # Three digits of the larger sum, and as many decimals of all that adds up to it.
    most = float(total.max())
    digits = max(0, 2 - math.floor(math.log10(most))) if most > 0.0 else 0
    panels = []
    for column, colour in zip(table.columns, (BLUE, GREEN), strict=True):
        values = np.array([float(total[column]), *(float(table[column][n]) for n in order)])
        panels.append(
            Panel(
                "",
                (),
                title=f"{column}, {unit}",
                categories=categories,
                bars=(
                    _bars(_SUM, [0], values[:1], BLACK, digits),
                    _bars(str(column), range(1, len(values)), values[1:], colour, digits),
                ),
            )
        )
    return Chart(slug, title, caption, f"standard deviation, {unit}", tuple(panels), beside=True)


def _bars(name: str, at: Sequence[int] | range, values: object, colour: str, digits: int) -> Bars:
    ends = np.asarray(values, dtype=np.float64)
    labels = tuple(f"{v:.{digits}f}" for v in ends.tolist())
    where = np.array(list(at), dtype=np.float64)
    return Bars(name, where, ends, colour, labels=labels, legend=False)


def _joined(table: pd.DataFrame, most: float) -> pd.DataFrame:
    """The contributors with what is too little to be seen as one."""
    small = (table < _LEAST * most).all(axis=1)
    if int(small.sum()) < 2:
        return table
    kept = table[~small].copy()
    kept.loc[_REST] = np.sqrt((table[small] ** 2).sum())
    return kept
