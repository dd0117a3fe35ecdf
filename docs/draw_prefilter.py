"""Draw `images/prefilter.svg`: a bench run at 1 kHz, raw and filtered (Chernodarov's Figs. 4, 5).

``python docs/draw_prefilter.py``
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from strapdown.prefilter import RobustFir
from strapdown.report.chart import BLACK, Chart, Panel, curve
from strapdown.report.chart_svg import ChartFigure
from strapdown.sensors.catalogue import load_sensor
from strapdown.simulation import Origin, StationaryMotion
from strapdown.simulation.imu import simulate_imu

SECONDS, RATE, OUTLIERS = 60.0, 1000.0, 60
LIGHT = "#f0b95a"


def bench() -> pd.DataFrame:
    """FOG-1000 class at rest in Moscow, with outliers of 20 to 60 times the noise."""
    motion = StationaryMotion(SECONDS, Origin(55.75, 37.6), roll_deg=0.5, pitch_deg=-0.3)
    imu, _ = simulate_imu(
        motion, load_sensor("fog-1000").imu_errors, rate=RATE, sampling="mean", seed=1
    )
    rng = np.random.default_rng(2)
    values = imu.to_numpy().copy()
    sd = np.diff(values, axis=0).std(axis=0) / np.sqrt(2.0)
    rows = rng.choice(len(values) - 400, OUTLIERS, replace=False) + 200
    channels = rng.integers(0, 6, OUTLIERS)
    size = rng.uniform(20.0, 60.0, OUTLIERS) * rng.choice([-1.0, 1.0], OUTLIERS)
    values[rows, channels] += size * sd[channels]
    imu.iloc[:, :] = values
    return imu


def panel(raw: pd.DataFrame, done: pd.DataFrame, channel: str, unit: float, label: str) -> Panel:
    """One channel, raw in a light colour and filtered in a dark one."""
    return Panel(
        label,
        (
            curve("raw, 1 kHz", raw.index, raw[channel] * unit, LIGHT, width=0.7, buckets=500),
            curve(
                "robust digital filter, 100 Hz",
                done.index,
                done[channel] * unit,
                BLACK,
                width=1.0,
                buckets=500,
            ),
        ),
    )


def chart() -> Chart:
    """The chart of the page."""
    raw = bench()
    done = RobustFir().apply(raw).imu
    arcsec = float(np.degrees(3600.0))
    return Chart(
        "prefilter",
        "A bench run of a FOG-1000 class unit",
        "",
        "time, s",
        (
            panel(raw, done, "gyro_z", arcsec, "vertical gyro, arcsec/s"),
            panel(raw, done, "accel_x", 1.0, "horizontal accelerometer, m/s²"),
        ),
    )


if __name__ == "__main__":
    ChartFigure(chart()).save(Path(__file__).parent / "images" / "prefilter.svg")
