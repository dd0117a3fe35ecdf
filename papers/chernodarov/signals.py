"""Figs. 4 and 5: signals at 1 kHz, and what the robust digital filter makes of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from papers.chernodarov.bench import (
    OUTLIER_SDS,
    OUTLIER_SHARE,
    OUTPUT_RATE,
    RATE,
    SHOWN,
    Bench,
)
from papers.chernodarov.drive import ROAD_SPEED
from papers.chernodarov.setting import FINE_END
from papers.reproduction import (
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Figure,
    FigurePanel,
    Statement,
    Trace,
)
from strapdown.constants import DEG_PER_HOUR
from strapdown.prefilter import Grid, RobustFir
from strapdown.tables import ACCEL, GYRO

Array = NDArray[np.float64]

ARC_SECONDS = DEG_PER_HOUR  # deg/h are arc seconds a second
CHOSEN = (
    "Sensors of the catalogue's fog-1000, unit 1, at rest at 55.98° north with roll 0.5°, pitch "
    "−0.8°, heading 40°. One sample in 10 000 of each channel is knocked off by 50 standard "
    "deviations. The filter: outliers replaced, linear-phase low-pass, 100 Hz."
)


def figures(made: Bench) -> list[Figure]:
    """Return Figs. 4 and 5."""
    time = made.imu.index.to_numpy(dtype=np.float64)
    shown = (time >= SHOWN[0]) & (time <= SHOWN[1])
    out = []
    for slug, title, channel, column, factor, label in (
        (
            "fig4",
            "Fig. 4: the “vertical” gyro, as it comes and smoothed",
            GYRO[2],
            2,
            ARC_SECONDS,
            "turn rate, arcsec/s",
        ),
        (
            "fig5",
            "Fig. 5: a horizontal accelerometer, as it comes and smoothed",
            ACCEL[0],
            3,
            1.0,
            "specific force, m/s²",
        ),
    ):
        smooth = made.imu[channel].to_numpy(dtype=np.float64)[shown]
        traces = (
            Trace("1 kHz", made.raw_time, factor * made.raw[:, column]),
            Trace("smoothed, 100 Hz", time[shown], factor * smooth),
        )
        out.append(
            Figure(
                slug,
                title,
                "The robust digital filter takes the outliers and most of the noise.",
                CHOSEN,
                "time, s",
                (FigurePanel(label, traces),),
            )
        )
    return out


def smoothed(made: Bench) -> Statement:
    """Judge the filter of Figs. 4 and 5 on the whole record."""
    rest = made.imu[made.imu.index <= FINE_END]
    ratios = {}
    for name, channel, k in (("gyro", GYRO[2], 2), ("accelerometer", ACCEL[0], 3)):
        values = rest[channel].to_numpy(dtype=np.float64)
        # Differences over a second: the drift is nothing in them.
        apart = values[round(OUTPUT_RATE) :] - values[: -round(OUTPUT_RATE)]
        ratios[name] = float(apart.std() / np.sqrt(2.0) / made.raw_sd[k])
    whole = int(made.outliers.sum())
    return smoothed_from(ratios, made.noise_factor, made.found / whole, made.wrongly, whole)


def smoothed_from(
    ratios: dict[str, float], designed: float, found: float, wrongly: int, outliers: int
) -> Statement:
    """Judge from the noise that is left, by design, and from the outliers that were found."""
    quiet = all(r < 1.05 * designed for r in ratios.values())
    holds = quiet and found > 0.99 and wrongly < 0.01 * outliers
    return Statement(
        "smoothed",
        "Section 4, Figs. 4 and 5",
        "the output signal (a dark-colored graph) of the same gyro, which was smoothed by means "
        "of a robust digital filter",
        HOLDS if holds else DOES_NOT_HOLD,
        "",
        f"One sample in {1.0 / OUTLIER_SHARE:.0f} was knocked off by {OUTLIER_SDS:g} standard "
        "deviations. What is left of the noise is what the weights of the filter leave of white "
        "noise, as if there had been no outliers.",
        (
            *(Evidence(f"noise left, {name}", r) for name, r in ratios.items()),
            Evidence("noise left, by design", designed),
            Evidence("outliers put in", float(outliers)),
            Evidence("found", 100.0 * found, "%"),
            Evidence("good samples replaced", float(wrongly)),
        ),
        "fig4",
    )


def phase() -> Statement:
    """Judge that phases are not distorted."""
    low_pass = RobustFir(rate=OUTPUT_RATE).low_pass(Grid(0.0, 1.0 / RATE, True))
    weights = low_pass.weights
    return phase_from(float(np.abs(weights - weights[::-1]).max()), low_pass.delay)


def phase_from(asymmetry: float, delay: float) -> Statement:
    """Judge from the asymmetry of the weights and from the delay in s that the stamps take off."""
    if asymmetry > 1e-12:
        verdict, condition = DOES_NOT_HOLD, ""
    else:
        verdict = HOLDS_WHEN
        condition = "the filter's delay is taken off the stamps, as it is here"
    return Statement(
        "phase",
        "Section 1",
        "Such an organization must exclude phase distortions and must provide the required "
        "frequency of determining the parameters of Acft motion.",
        verdict,
        condition,
        "The weights are symmetric and the same for all six channels: one delay for every "
        "frequency, and none between gyros and accelerometers.",
        (
            Evidence("asymmetry of the weights", asymmetry),
            Evidence("delay", delay, "s"),
            Evidence(f"way in it at {ROAD_SPEED:g} m/s", ROAD_SPEED * delay, "m"),
        ),
    )
