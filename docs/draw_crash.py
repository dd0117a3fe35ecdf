"""Draw `images/crash.svg`: a simulated impact on a pole, as recorded, and what follows from it.

``python docs/draw_crash.py``
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from strapdown.constants import TWO_SIDED_95
from strapdown.crash.entry import Entry
from strapdown.crash.reconstruction import reconstruct_crash
from strapdown.report.chart import (
    AXIS_COLOURS,
    BLACK,
    GREY,
    ORANGE,
    PURPLE,
    Chart,
    Line,
    Mark,
    Panel,
)
from strapdown.report.chart_svg import ChartFigure
from strapdown.simulation import point_kinematics
from strapdown.simulation.crash_motion import find_crash
from strapdown.simulation.crash_recording import paper_units, record_crash
from strapdown.tables import NED, VELOCITY

SEED = 3
CENTRE = (0.0, 0.0, 0.0)
SHOWN = (-0.1, 0.75)


def within(table: pd.DataFrame) -> pd.DataFrame:
    """The part of a table that is drawn."""
    return table[(table.index >= SHOWN[0]) & (table.index <= SHOWN[1])]


def chart() -> Chart:
    """The chart of the page."""
    crash = find_crash("pole")
    impact = crash.impacts[0]
    design = next(d for d in paper_units() if d.name == "IMU1")
    unit, _ = record_crash(crash.motion, design, impact=impact, seed=SEED)
    answer = reconstruct_crash([unit], Entry.from_speed(7.1, 0.1)).main
    own = answer.at_point.prepared
    assert own is not None
    low, high = (within(part.table) for part in own.unit.accelerometers)
    merged = within(own.imu)
    forces = (
        Line("low-g", low.index.to_numpy(), low["accel_x"].to_numpy(), ORANGE, width=2.2),
        Line("high-g, as recorded", high.index.to_numpy(), high["accel_x"].to_numpy(), GREY, "dot"),
        Line("merged", merged.index.to_numpy(), merged["accel_x"].to_numpy(), PURPLE),
    )
    event = answer.events.events[0]
    path = answer.path
    exact = point_kinematics(crash.motion, CENTRE, path.time + impact, epoch=impact)
    changes, errors = [], []
    for k, axis in enumerate(("forward", "right", "down")):
        colour, first = AXIS_COLOURS[k], k == 0
        found = path.table[VELOCITY[k]].to_numpy()
        true = exact.velocity[:, k]
        changes.append(Line(axis, path.time, found - found[path.anchor], colour))
        changes.append(
            Line("truth", path.time, true - true[path.anchor], BLACK, "dot", legend=first)
        )
        error = path.table[NED[k]].to_numpy() - exact.position[:, k]
        errors.append(Line(axis, path.time, error, colour, legend=False))
        half = TWO_SIDED_95 * path.sd[NED[k]].to_numpy()
        for edge in (half, -half):
            shown = first and edge is half
            errors.append(Line("95 % bound", path.time, edge, colour, "dash", 0.9, legend=shown))
    return Chart(
        "crash",
        "A recorder in an impact on a pole: 7.1 m/s, simulated",
        "",
        "time from the trigger, s",
        (
            Panel("force ahead, m/s²", forces),
            Panel("change of velocity, m/s", tuple(changes)),
            Panel("error of the path, m", tuple(errors)),
        ),
        marks=(Mark(event.time_zero, "time zero"), Mark(event.end, "end")),
    )


if __name__ == "__main__":
    ChartFigure(chart()).save(Path(__file__).parent / "images" / "crash.svg")
