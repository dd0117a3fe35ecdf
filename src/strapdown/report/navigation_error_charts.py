"""Charts of a run of navigation against its truth."""

from __future__ import annotations

import numpy as np

from strapdown.evaluation.nees import bounds
from strapdown.report.chart import AXIS_COLOURS, BLUE, Chart, Level, Panel, curve
from strapdown.report.navigation_charts import BOUND, over_time
from strapdown.report.navigation_errors import NavigationErrors
from strapdown.report.navigation_thinning import BUCKETS, thin_fill
from strapdown.report.navigation_told import NavigationTold
from strapdown.tables import EULER, NED, VELOCITY

__all__ = ["error_charts", "nees_chart"]

_LEAST = 1e-2
_NAMES = dict(zip(VELOCITY, NED, strict=True))


def error_charts(told: NavigationTold, found: NavigationErrors) -> tuple[Chart, ...]:
    """Errors of place, velocity and attitude within their bounds."""
    out = []
    for slug, title, columns, unit in (
        ("errors-place", "Errors of place", NED, "m"),
        ("errors-velocity", "Errors of velocity", VELOCITY, "m/s"),
        ("errors-attitude", "Errors of attitude", EULER, "deg"),
    ):
        panels = []
        for k, column in enumerate(columns):
            half, error = found.bound(column), found.error(column)
            panels.append(
                Panel(
                    f"{_NAMES.get(column, column)}, {unit}",
                    (curve("error", found.time, error, AXIS_COLOURS[k], buckets=BUCKETS),),
                    fills=(thin_fill(BOUND, found.time, -half, half, AXIS_COLOURS[k]),),
                    height=0.8,
                )
            )
        caption = f"Navigated less {told.truth_name}, within what the run itself claims."
        out.append(over_time(slug, title, caption, tuple(panels), told.record))
    return tuple(out)


def nees_chart(told: NavigationTold, found: NavigationErrors) -> Chart | None:
    """Normalised errors squared of place, velocity and attitude; None where no bound is told."""
    if not found.freedom:
        return None
    low, high = bounds(found.freedom)
    nees = np.maximum(found.nees, _LEAST)
    panel = Panel(
        "error squared",
        (curve("place, velocity and attitude", found.time, nees, BLUE, buckets=BUCKETS),),
        log=True,
        levels=(Level(low, "2.5 %"), Level(high, "97.5 %")),
    )
    return over_time(
        "nees",
        "Normalised errors squared",
        f"By the covariance of these errors; {found.freedom} is expected, and 95 of 100 runs "
        "belong between the levels at an instant. The errors of one run are alike from instant to "
        "instant: one that stays outside for a while says less than many runs would.",
        (panel,),
        told.record,
    )
