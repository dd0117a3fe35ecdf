"""Risk of injury against the change of velocity, and where this crash is on the curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from strapdown.constants import TWO_SIDED_95
from strapdown.crash.severity_model import SPEEDS, InjuryRisk, SeverityModel, injury_risk
from strapdown.errors import StrapdownError
from strapdown.report.chart import Chart, Line, Panel, look

__all__ = ["risk_chart"]

_POINTS = 121
# Where a model tells no range, up to this many times our value.
_BEYOND = 2.5
_KMH = 3.6


def risk_chart(
    risks: Sequence[InjuryRisk],
    delta_v: float,
    sd: float,
    inputs: Mapping[str, float | str] | None = None,
) -> Chart | None:
    """Chart the models that gave an answer, each within its range.

    Parameters
    ----------
    risks : sequence of InjuryRisk
    delta_v, sd : float, m/s
        What they were asked with.
    inputs : mapping, optional
        Their other inputs.

    Returns
    -------
    Chart or None
        None where no model uses a change of velocity or none gave an answer.
    """
    lines: list[Line] = []
    reach = TWO_SIDED_95 * sd
    for risk in risks:
        model = risk.model
        if "delta_v" not in model.inputs:
            continue
        x, y = _curve(model, delta_v, dict(inputs or {}))
        if not x.size:
            continue
        style = look(len(lines) // 3)
        lines.append(Line(_name(model), x, 100.0 * y, style["colour"], style["dash"], 1.8))
        at = np.array([_KMH * delta_v])
        bound = 100.0 * np.array([risk.low, risk.high])
        upright = np.repeat(at, 2)
        lines.append(Line("bar", upright, bound, style["colour"], width=2.4, legend=False))
        lines.append(
            Line(
                f"this crash: {_percent(risk.probability)} "
                f"({_percent(risk.low)} to {_percent(risk.high)})",
                at,
                np.array([100.0 * risk.probability]),
                style["colour"],
                points=True,
                symbol=style["symbol"],
                low=np.array([_KMH * max(delta_v - reach, 0.0)]),
                high=np.array([_KMH * (delta_v + reach)]),
                legend=False,
            )
        )
    if not lines:
        return None
    return Chart(
        "severity",
        "Risk of injury against the change of velocity",
        "Published logistic models, each drawn within the range that it is valid in; marked: this "
        "crash with the 95 % bound of its change of velocity and what that makes of the risk. The "
        "bound has nothing of the model's own uncertainty.",
        "change of velocity (resultant of the main event), km/h",
        (Panel("probability, %", tuple(lines)),),
    )


def _curve(
    model: SeverityModel, delta_v: float, inputs: dict[str, float | str]
) -> tuple[np.ndarray, np.ndarray]:
    """Change of velocity in km/h and probability, within the model's range."""
    factor = SPEEDS.get(model.unit("delta_v"), 1.0)
    low, high = model.validity.get("delta_v", (0.0, _BEYOND * delta_v / factor))
    at = np.linspace(low * factor, high * factor, _POINTS)
    # Rounding may put an end just outside.
    at[[0, -1]] += np.array([1e-9, -1e-9]) * (at[-1] - at[0])
    x, y = [], []
    for value in at.tolist():
        try:
            risk = injury_risk(model, {**inputs, "delta_v": value})
        except StrapdownError:
            # A logarithm has no value at zero; an input is missing.
            continue
        x.append(_KMH * value)
        y.append(risk.probability)
    return np.array(x), np.array(y)


def _name(model: SeverityModel) -> str:
    return f"{model.outcome}: {model.author} {model.year}, {model.table}"


def _percent(share: float) -> str:
    value = 100.0 * share
    return f"{value:.2g} %" if value < 9.95 else f"{value:.0f} %"
