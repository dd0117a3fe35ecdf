"""Charts of a navigation run as figures for a notebook."""

from __future__ import annotations

from collections.abc import Callable

from strapdown.errors import ConfigError
from strapdown.report import navigation_charts as charts
from strapdown.report.chart import Chart
from strapdown.report.chart_figure import ChartFigure
from strapdown.report.navigation_charts import innovation_chart
from strapdown.report.navigation_found import NavigationTold, agreements, told_of
from strapdown.report.navigation_plan import plan_chart
from strapdown.systems.sins.run import NavigationResult

__all__ = ["plot"]

KINDS: dict[str, Callable[[NavigationTold], Chart | None]] = {
    "plan": plan_chart,
    "bound": charts.bound_chart,
    "height": charts.height_chart,
    "velocity": charts.velocity_chart,
    "attitude": charts.attitude_chart,
}


def plot(result: NavigationResult, kind: str) -> ChartFigure:
    """Draw one chart of a run, as its report shows it.

    Parameters
    ----------
    result : NavigationResult
    kind : str
        One of `KINDS`, or the name of an observation.

    Returns
    -------
    ChartFigure

    Raises
    ------
    ConfigError
        The chart does not exist.
    """
    observed = result.filtered.innovations
    if kind in observed:
        found = {one.name: one for one in agreements(result.filtered)}
        return ChartFigure(innovation_chart(result.filtered, found[kind]))
    if kind not in KINDS:
        raise ConfigError(
            "report.unknown-chart", quantity="kind", word=kind, known=[*KINDS, *observed]
        )
    chart = KINDS[kind](told_of(result))
    if chart is None:
        raise ConfigError("report.no-path-to-draw", quantity=f"kind '{kind}'")
    return ChartFigure(chart)
