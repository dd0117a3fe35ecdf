"""Draw `images/simplifications.svg`: what simplifications cost with time, beside sensors.

``python docs/draw_simplifications.py``
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from papers.tadic.simplifications import (
    SIMPLIFICATIONS,
    TRIPS,
    Trip,
    error_course,
    sensor_increments,
    straight,
)
from strapdown.mechanization import NorthEastDown
from strapdown.report.chart import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    VERMILLION,
    Chart,
    Line,
    Panel,
)
from strapdown.report.svg_chart import draw

LOOKS = {
    "no Coriolis term": (BLUE, "solid"),
    "no Earth rate": (VERMILLION, "solid"),
    "no transport rate": (GREEN, "solid"),
    "gravity 9.80665": (PURPLE, "solid"),
    "all: flat Earth": (BLACK, "longdash"),
}
SENSORS = {"mpu-6050": ORANGE, "hg1700": "#7f6000", "hg9900": GREY}
UNITS = range(9)
POINTS = 200


def at(course: pd.Series, times: np.ndarray) -> np.ndarray:
    """Position error at instants."""
    return np.interp(times, course.index.to_numpy(), course.to_numpy())


def panel(trip: Trip, title: str, times: np.ndarray, least: float) -> Panel:
    """Lines of one trip; what is below `least` m is left out."""
    courses = {}
    for name in LOOKS:
        course = error_course(trip, SIMPLIFICATIONS[name])
        courses[name] = at(course["position_m"], times), *LOOKS[name], 1.6
    for sensor, colour in SENSORS.items():
        units = [
            at(
                error_course(trip, NorthEastDown(), sensor_increments(trip, sensor, unit))[
                    "position_m"
                ],
                times,
            )
            for unit in UNITS
        ]
        courses[sensor] = np.median(units, axis=0), colour, "dot", 2.2
    lines = tuple(
        Line(name, times, np.where(y >= least, y, np.nan), colour, dash, width)
        for name, (y, colour, dash, width) in courses.items()
    )
    return Panel("position error, m", lines, log=True, title=title)


def chart() -> Chart:
    """The chart of the page."""
    crash, minute = TRIPS["crash"], Trip("", straight(120.0, 20.0), 100.0, "free")
    return Chart(
        "simplifications",
        "What is left out, and what sensors do",
        "",
        "time, s",
        (
            panel(crash, "a crash", np.geomspace(0.02, 0.75, POINTS), 3e-6),
            panel(minute, "20 m/s, straight", np.geomspace(0.05, 120.0, POINTS), 1e-7),
        ),
        log_x=True,
        beside=True,
    )


if __name__ == "__main__":
    draw(chart(), Path(__file__).parent / "images" / "simplifications.svg")
