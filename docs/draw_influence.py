"""Draw `images/influence.svg`: influence functions, and what they do after an outage.

``python docs/draw_influence.py``
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from strapdown.estimation.robust import INFLUENCES, RobustUpdate
from strapdown.report.chart import BLACK, BLUE, GREEN, ORANGE, VERMILLION, Chart, Line, Panel
from strapdown.report.chart_svg import ChartFigure

LOOKS = {
    "none": (BLACK, "dot"),
    "huber": (BLUE, "solid"),
    "hampel": (ORANGE, "solid"),
    "tukey": (VERMILLION, "solid"),
    "igg3": (GREEN, "solid"),
}
# After an outage: variance of the prediction, of an observation.
S, R = 100.0, 1.0
POINTS = 601
FAR = 8.0
HIGH = 5.0


def moves(rule: RobustUpdate, innovations: np.ndarray) -> np.ndarray:
    """How far the estimate goes for innovations, all in standard deviations of theirs."""
    sd = (S + R) ** 0.5
    steps = [rule.step(float(nu) * sd, S, R) for nu in innovations]
    return np.array([S / (S + t.r) * t.moved for t in steps]) / sd


def chart() -> Chart:
    """The chart of the page."""
    x = np.linspace(0.0, FAR, POINTS)
    shapes, after = [], []
    for name, (colour, dash) in LOOKS.items():
        influence = INFLUENCES[name]()
        psi = np.array([influence.psi(float(u)) for u in x])
        shapes.append(Line(name, x, np.where(psi <= HIGH, psi, np.nan), colour, dash, 1.6))
        y = moves(RobustUpdate(influence), x)
        after.append(Line(name, x, np.where(y <= HIGH, y, np.nan), colour, dash, 1.6, legend=False))
    return Chart(
        "influence",
        "Influence functions, and the first observation after an outage",
        "",
        "in standard deviations: a residual's (left), an innovation's (right)",
        (
            Panel("influence ψ of a residual", tuple(shapes), title="what counts"),
            Panel(
                "step of the estimate",
                tuple(after),
                title="after an outage: s = 100 r",
            ),
        ),
        beside=True,
    )


if __name__ == "__main__":
    ChartFigure(chart()).save(Path(__file__).parent / "images" / "influence.svg")
