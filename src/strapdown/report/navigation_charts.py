"""Charts of a run of navigation over time: the state with its bounds, and the bounds alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import TWO_SIDED_95
from strapdown.evaluation.plane_bound import plane_bound
from strapdown.navigation.record import NavigationRecord
from strapdown.report.chart import (
    AXIS_COLOURS,
    BLACK,
    BLUE,
    Chart,
    Fill,
    Line,
    Panel,
    break_jumps,
    curve,
)
from strapdown.report.navigation_strip import outage_bands, strip
from strapdown.report.navigation_thinning import BUCKETS, thin_fill
from strapdown.report.navigation_told import NavigationTold
from strapdown.report.navigation_values import (
    StateBlock,
    at_marks,
    blocks_of,
    heading_shown,
    unwrapped,
)
from strapdown.tables import EULER, NED, VELOCITY

__all__ = [
    "attitude_chart",
    "bound_chart",
    "height_chart",
    "over_time",
    "state_charts",
    "velocity_chart",
]

Array = NDArray[np.float64]

TIME = "time, s"
BOUND = "95 % bound"
SHADED = "Shaded: times without an aid."
#: Bounds that change by more have a logarithmic axis: within less it would have no label or one.
WIDE = 3.0


def over_time(
    slug: str, title: str, caption: str, panels: tuple[Panel, ...], record: NavigationRecord
) -> Chart:
    """Put panels over time under the strip of modes and aids."""
    above = strip(record)
    bands = outage_bands(record)
    told = f"{caption} {SHADED}" if bands else caption
    return Chart(
        slug,
        title,
        told.strip(),
        TIME,
        panels if above is None else (above, *panels),
        bands=bands,
    )


def bound_chart(told: NavigationTold) -> Chart:
    """How well place, velocity and attitude are known over the run."""
    record = told.record
    time = record.sd.index.to_numpy(dtype=np.float64)
    groups = (
        (
            "Place",
            "m",
            (
                ("horizontal", plane_bound(record.covariance), BLUE),
                _bound(record, "down", "height"),
            ),
        ),
        (
            "Velocity",
            "m/s",
            tuple(_bound(record, v, n) for v, n in zip(VELOCITY, NED, strict=True)),
        ),
        ("Attitude", "deg", tuple(_bound(record, a, a) for a in EULER)),
    )
    panels = []
    for title, unit, curves in groups:
        lines = []
        for k, (name, value, colour) in enumerate(curves):
            shown = np.where(value > 0.0, value, np.nan)
            dash = ("solid", "dash", "dot")[k]
            lines.append(curve(name, time, shown, colour, dash, 1.6, buckets=BUCKETS))
        every = np.concatenate([value[value > 0.0] for _, value, _ in curves])
        log = bool(every.size and every.max() > WIDE * every.min())
        panels.append(Panel(f"{title.lower()}, {unit}", tuple(lines), log=log))
    return over_time(
        "bounds",
        "How well it was known",
        "Bounds of 95 %: 1.96 standard deviations; of the horizontal place the longer half axis "
        "of its ellipse.",
        tuple(panels),
        record,
    )


def _bound(record: NavigationRecord, column: str, name: str) -> tuple[str, Array, str]:
    colours = dict(zip(["north", "east", "down"], AXIS_COLOURS, strict=True))
    colours |= dict(zip(VELOCITY, AXIS_COLOURS, strict=True))
    colours |= dict(zip(EULER, AXIS_COLOURS, strict=True)) | {"down": AXIS_COLOURS[0]}
    return name, TWO_SIDED_95 * record.sd[column].to_numpy(dtype=np.float64), colours[column]


def height_chart(told: NavigationTold) -> Chart:
    """Height over the ellipsoid with its bound."""
    panel = _state_panel(told, "alt", "down", "height, m")
    return over_time(
        "height",
        "Height",
        f"Over the ellipsoid ({told.ellipsoid.name}).",
        (panel,),
        told.record,
    )


def velocity_chart(told: NavigationTold) -> Chart:
    """Velocity over the ground with its bounds."""
    panels = tuple(
        _state_panel(told, name, name, f"{words}, m/s")
        for name, words in zip(VELOCITY, NED, strict=True)
    )
    return over_time("velocity", "Velocity", "Relative to the Earth.", panels, told.record)


def attitude_chart(told: NavigationTold) -> Chart:
    """Roll, pitch and heading with their bounds."""
    heading, marks, said = heading_shown(told.record)
    panels = [_state_panel(told, name, name, f"{name}, deg") for name in EULER[:2]]
    panels.append(_state_panel(told, "heading", "heading", "heading, deg", (heading, marks)))
    return over_time(
        "attitude",
        "Attitude",
        said,
        tuple(panels),
        told.record,
    )


def _state_panel(
    told: NavigationTold,
    column: str,
    error: str,
    label: str,
    shown: tuple[Array, Array] | None = None,
) -> Panel:
    """A quantity of the trajectory, its bound at the marks, and the truth where there is one.

    What is shown of it over the trajectory and at the marks is given where it is not the column.
    """
    record = told.record
    time = record.trajectory.index.to_numpy(dtype=np.float64)
    if shown is None:
        shown = record.trajectory[column].to_numpy(dtype=np.float64), at_marks(record, column)
    values, here = shown
    lines = [curve("navigated", time, values, BLUE, width=1.3, buckets=BUCKETS)]
    if told.truth is not None:
        lines.append(_true(told, column, values))
    at = record.sd.index.to_numpy(dtype=np.float64)
    half = TWO_SIDED_95 * record.sd[error].to_numpy(dtype=np.float64)
    fill = thin_fill(BOUND, at, here - half, here + half, BLUE, opacity=0.25)
    return Panel(label, tuple(lines), fills=(fill,), height=0.8)


def _true(told: NavigationTold, column: str, navigated: Array) -> Line:
    truth = told.truth
    assert truth is not None
    time = told.record.trajectory.index
    within = truth[(truth.index >= time[0]) & (truth.index <= time[-1])]
    values = within[column].to_numpy(dtype=np.float64)
    if column == "heading" and np.isnan(navigated).any():
        values = break_jumps(values % 360.0)
    elif column == "heading" and values.size:
        values = unwrapped(values)
        # The same turn as the navigated heading.
        values = values + 360.0 * np.round((navigated[0] - values[0]) / 360.0)
    stamps = within.index.to_numpy(dtype=np.float64)
    return curve("truth", stamps, values, BLACK, "dot", 1.1, buckets=BUCKETS)


def state_charts(record: NavigationRecord) -> tuple[Chart, ...]:
    """Estimates of the errors of sensors and aids, with their bounds."""
    return tuple(_block_chart(record, block) for block in blocks_of(record))


def _block_chart(record: NavigationRecord, block: StateBlock) -> Chart:
    time = record.sensors.index.to_numpy(dtype=np.float64)
    panels = []
    for k, (column, label) in enumerate(zip(block.columns, block.labels, strict=True)):
        value = block.factor * record.sensors[column].to_numpy(dtype=np.float64)
        sd = record.sensors_sd[column].to_numpy(dtype=np.float64)
        reach = TWO_SIDED_95 * block.factor * sd
        colour = AXIS_COLOURS[k % 3]
        line = curve("estimate", time, value, colour, width=1.6, buckets=BUCKETS)
        fill: Fill = thin_fill(BOUND, time, value - reach, value + reach, colour)
        several = len(block.columns) > 1
        name = f"{label}, {block.unit}" if several else f"{block.name}, {block.unit}"
        panels.append(Panel(name, (line,), fills=(fill,), height=0.7))
    return over_time(
        f"state-{block.slug}",
        f"{block.name[0].upper()}{block.name[1:]}",
        "Reading less truth, or what was assumed less the truth; a band that does not narrow is "
        "of what this motion does not tell.",
        tuple(panels),
        record,
    )
