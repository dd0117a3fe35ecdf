"""Fig. 6: the longitudinal acceleration, left and right, of three kinds of sensors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from papers.reproduction import (
    DOES_NOT_HOLD,
    HOLDS,
    HOLDS_WHEN,
    Evidence,
    Figure,
    FigurePanel,
    Statement,
    Trace,
    amount,
)
from papers.tadic.experiment import CHOSEN, END, Experiment, Experiments, gravity_at
from strapdown import reconstruct_crash
from strapdown.sensors import CrashUnit
from strapdown.tables import NED

Array = NDArray[np.float64]

SHOWN = (-0.05, 0.25)  # s
SIDES = (("left", "LAB1", "IMU1"), ("right", "LAB2", "IMU2"))
# A car on a level floor, unloaded evenly.
STOOD = 2.0  # deg


def figure(made: Experiment) -> Figure:
    """Fig. 6: laboratory at 200 Hz, low-g and high-g, as recorded."""
    panels = []
    for side, lab, imu in SIDES:
        low, high = (_ahead(part.table) for part in _on_common_time(made, imu).accelerometers)
        reference = _ahead(_on_common_time(made, lab).accelerometers[0].table)
        panels.append(
            FigurePanel(
                f"{side}, m/s²",
                (
                    Trace("LAB, 200 Hz", *reference),
                    Trace("IMU low-g", *low),
                    Trace("IMU high-g, as recorded", *high),
                ),
            )
        )
    return Figure(
        "fig6",
        "Fig. 6: longitudinal acceleration, left and right",
        "LAB1 and LAB2 down-sampled to 200 Hz without aliasing, IMU1 and IMU2 as recorded. The "
        "low-g part stands at its end while the crash lasts; the high-g part keeps its own bias.",
        CHOSEN,
        "time from the trigger, s",
        tuple(panels),
    )


def _on_common_time(made: Experiment, name: str) -> CrashUnit:
    return next(u.unit for u in made.found.synchronised.units if u.unit.name == name)


def _ahead(table: pd.DataFrame) -> tuple[Array, Array]:
    time = table.index.to_numpy(dtype=np.float64)
    shown = (time >= SHOWN[0]) & (time <= SHOWN[1])
    return time[shown], table["accel_x"].to_numpy(dtype=np.float64)[shown]


# --- statements -------------------------------------------------------------------------------


def saturated(made: Experiments) -> Statement:
    """Judge that the low-g parts were mostly at their end."""
    shares = []
    for e in made.all:
        for _, _, imu in SIDES:
            unit = e.platform(imu)
            assert unit.at_point.prepared is not None
            time, event = unit.at_point.time, unit.events.events[0]
            high = unit.at_point.prepared.range_spoken > 0
            within = (time >= 0.0) & (time <= event.end)
            later = (time >= 0.0) & (time <= END)
            shares.append((high[within, 0].mean(), high[later, 0].mean(), high[later, 1].mean()))
    ahead, long, aside = np.mean(np.array(shares), axis=0).tolist()
    return saturated_from(100.0 * ahead, 100.0 * long, 100.0 * aside)


def saturated_from(ahead: float, long: float, aside: float) -> Statement:
    """Judge from shares in %: ahead in the event, ahead and aside in the 750 ms."""
    if ahead > 50.0 and long > 50.0:
        verdict, condition = HOLDS, ""
    elif ahead > 50.0:
        verdict, condition = HOLDS_WHEN, "“during crash” means the pulse and not the 750 ms"
    else:
        verdict, condition = DOES_NOT_HOLD, ""
    return Statement(
        "low-g-saturated",
        "Section 4, Fig. 6",
        "the “low-G” sensors (on both units) were mostly saturated during crash",
        verdict,
        condition,
        "Share of the samples at which the ±2 g part is at its end, or so near that the high-g "
        "part speaks for it; both units, all experiments.",
        (
            Evidence("ahead, in the event", ahead, "%"),
            Evidence("ahead, over 750 ms", long, "%"),
            Evidence("aside, over 750 ms", aside, "%"),
        ),
        "fig6",
    )


def low_g_calibrates(made: Experiments) -> Statement:
    """Judge that the high-g parts need the low-g ones."""
    units = [(e, name) for e in made.all for _, _, name in SIDES]
    both = [np.linalg.norm(_end_error(e, e.platform(n).path.table)) for e, n in units]
    alone = [without_low_g(e, n) for e, n in units]
    biases = np.array([np.asarray(e.truths[n].accelerometers[1].bias) for e, n in units])
    left = 0.5 * END**2 * np.linalg.norm(biases, axis=1)
    rms = [float(np.sqrt(np.mean(np.square(x)))) for x in (both, alone, left)]
    return calibrates_from(rms[0], rms[1], rms[2], float(np.abs(biases).max()))


def without_low_g(made: Experiment, name: str) -> float:
    """Distance from the true place after 750 ms with the high-g part alone, m."""
    unit = _on_common_time(made, name)
    entry = made.platform(name).path.entry
    only = replace(unit, accelerometers=unit.accelerometers[1:])
    level = (0.0, 0.0, STOOD)
    found = reconstruct_crash(
        [only], entry, gravity=gravity_at(entry), preparation={"levelling": level}
    )
    return float(np.linalg.norm(_end_error(made, found.main.path.table)))


def _end_error(made: Experiment, path: pd.DataFrame) -> Array:
    row = int(np.argmin(np.abs(path.index.to_numpy() - END)))
    true, _ = made.exact.course([float(path.index[row])])
    return np.asarray(path[NED].to_numpy(dtype=np.float64)[row] - true[0])


def calibrates_from(both: float, alone: float, left: float, worst: float) -> Statement:
    """Judge from quadratic means of the distance after 750 ms, m.

    With both ranges, with the high-g part alone and told how the car stood, and what the bias of
    the high-g part alone makes if nobody takes it off.
    """
    if not left > 2.0 * both:
        verdict, condition = DOES_NOT_HOLD, ""
    elif alone > 2.0 * both:
        verdict, condition = HOLDS, ""
    else:
        verdict = HOLDS_WHEN
        condition = (
            f"nothing else tells how the car stood: gravity, in an attitude that is known to "
            f"{amount(STOOD, '°')}, calibrates the high-g part to {amount(alone, 'm')}"
        )
    return Statement(
        "low-g-calibrates",
        "Section 4",
        "Still, they play a very significant role in coarse calibration of “high-G” components",
        verdict,
        condition,
        "Distance from the true place, RMS over both units of all experiments: the same records "
        "with both ranges and with the high-g part alone; and ½ b t² of the high-g biases b that "
        "were drawn.",
        (
            Evidence("both ranges", both, "m"),
            Evidence(f"high-g alone, told that the car stood level to {STOOD:g}°", alone, "m"),
            Evidence("high-g alone, bias left in", left, "m"),
            Evidence("largest high-g bias that was drawn", worst, "m/s²"),
        ),
        "fig6",
    )
