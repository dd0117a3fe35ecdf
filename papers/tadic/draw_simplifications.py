"""Draw `images/simplifications.svg`: what simplifications cost with time, beside sensors.

``python -m papers.tadic.draw_simplifications``
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from papers.page import svg
from papers.reproduction import Figure, FigurePanel, Trace
from papers.tadic.simplifications import (
    SIMPLIFICATIONS,
    TRIPS,
    Trip,
    error_course,
    sensor_increments,
    straight,
)
from strapdown.mechanization import NorthEastDown

Array = NDArray[np.float64]

LEFT_OUT = (
    "no Coriolis term",
    "no Earth rate",
    "no transport rate",
    "gravity 9.80665",
    "all: flat Earth",
)
SENSORS = ("mpu-6050", "hg1700", "hg9900")
UNITS = range(9)
POINTS = 200


def _at(course: pd.DataFrame, times: Array) -> Array:
    """Position error at instants, m."""
    position = course["position_m"].to_numpy(dtype=np.float64)
    return np.asarray(np.interp(times, course.index.to_numpy(dtype=np.float64), position))


def panel(trip: Trip, label: str, times: Array, least: float) -> FigurePanel:
    """Curves of one trip; errors below `least` m are left out, as rounding."""
    courses = {n: _at(error_course(trip, SIMPLIFICATIONS[n]), times) for n in LEFT_OUT}
    for sensor in SENSORS:
        units = [
            _at(
                error_course(trip, NorthEastDown(), sensor_increments(trip, sensor, unit)),
                times,
            )
            for unit in UNITS
        ]
        courses[sensor] = np.median(units, axis=0)
    traces = tuple(
        Trace(n, times, np.where(y >= least, y, np.nan), reference=n in SENSORS)
        for n, y in courses.items()
    )
    return FigurePanel(f"{label}, m", traces, log=True)


def figure() -> Figure:
    """Position errors in a crash and on a straight road."""
    road = Trip("", straight(120.0, 20.0), 100.0, "free")
    return Figure(
        "simplifications",
        "Position error of what is left out, and of sensors",
        "",
        "medians of 9 units of each sensor",
        "time, s",
        (
            panel(TRIPS["crash"], "a crash", np.geomspace(0.02, 0.75, POINTS), 3e-6),
            panel(road, "20 m/s, straight", np.geomspace(0.05, 120.0, POINTS), 1e-7),
        ),
        x_log=True,
    )


if __name__ == "__main__":
    target = Path(__file__).parent / "images" / "simplifications.svg"
    target.write_text(svg(figure()), encoding="utf-8")
