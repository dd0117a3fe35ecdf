"""On what the direction of force hangs: the length of the window, and time zero."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.crash.pdof_sensitivity import SHIFTS, WINDOWS, pdof_by_shift, pdof_by_window
from strapdown.crash.unit_reconstruction import UnitReconstruction
from strapdown.errors import DataError
from strapdown.report.chart import BLACK, Chart, Line, Mark, Panel
from strapdown.report.crash_moments import unit_look
from strapdown.report.crash_values import MEAN
from strapdown.rotation import within_half_turn

Array = NDArray[np.float64]

__all__ = ["pdof_by_shift_chart", "pdof_by_window_chart"]

_LABEL = "direction of force, deg"
_SIGN = (
    "Where the force came from along the turning axes, 0 the front, positive clockwise from above "
    "(from the right)"
)
_STEADY = 0.02


def pdof_by_window_chart(
    units: Sequence[UnitReconstruction], combined: UnitReconstruction | None, event: int = 0
) -> Chart | None:
    """Chart the direction of force against the length of the window from time zero.

    Parameters
    ----------
    units : sequence of UnitReconstruction
    combined : UnitReconstruction or None
        The mean of the units, whose event it is; the first unit if None.
    event : int
        From 0.

    Returns
    -------
    Chart or None
        None where there is no such event.
    """
    main = units[0] if combined is None else combined
    if not 0 <= event < len(main.body):
        return None
    found = main.events.events[event]
    length = main.body[event].event.delta_v.end - found.time_zero
    windows = sorted({*WINDOWS, length})

    def table(unit: UnitReconstruction) -> pd.DataFrame:
        return pdof_by_window(unit.acceleration, found.time_zero, windows)

    lines = _lines(units, combined, event, table)
    lines += _chosen(main, event, length, "the event's own window, 95 %")
    return Chart(
        "pdof-by-window",
        "Direction of force against the length of the window",
        f"{_SIGN}, from the change of velocity in windows that begin at time zero. The bar: the "
        "answer, from the whole event, with its 95 % interval.",
        "length of the window from time zero, ms",
        (Panel(_LABEL, tuple(lines), steady=_STEADY),),
        marks=(Mark(1e3 * length, "the whole event"),),
    )


def pdof_by_shift_chart(
    units: Sequence[UnitReconstruction], combined: UnitReconstruction | None, event: int = 0
) -> Chart | None:
    """Chart the direction of force against an error of time zero.

    Parameters
    ----------
    units, combined, event
        As `pdof_by_window_chart`.

    Returns
    -------
    Chart or None
        None where there is no such event.
    """
    main = units[0] if combined is None else combined
    if not 0 <= event < len(main.body):
        return None
    whole = main.body[event].event.delta_v

    def table(unit: UnitReconstruction) -> pd.DataFrame:
        return pdof_by_shift(unit.acceleration, whole.start, whole.end, SHIFTS)

    lines = _lines(units, combined, event, table)
    lines += _chosen(main, event, 0.0, "time zero as found, 95 %")
    return Chart(
        "pdof-by-time-zero",
        "Direction of force against time zero",
        f"{_SIGN}, from windows that begin earlier (negative) or later than the time zero that was "
        "found, and end with the event. The bar: the answer with its 95 % interval.",
        "shift of time zero, ms",
        (Panel(_LABEL, tuple(lines), steady=_STEADY),),
        marks=(Mark(0.0, "as found"),),
    )


def _near(angle_deg: Array, middle_deg: float) -> Array:
    """Angles within half a turn of another: one at 180 deg is not split."""
    return middle_deg + np.asarray(within_half_turn(angle_deg - middle_deg))


def _lines(
    units: Sequence[UnitReconstruction],
    combined: UnitReconstruction | None,
    event: int,
    table: Callable[[UnitReconstruction], pd.DataFrame],
) -> list[Line]:
    main = units[0] if combined is None else combined
    middle = main.types[event].direction.horizontal_deg
    lines = []
    named: list[tuple[UnitReconstruction, int | None]] = [(u, k) for k, u in enumerate(units)]
    if combined is not None:
        named.append((combined, None))
    for unit, number in named:
        try:
            found = table(unit)
        except DataError:
            # Its record does not reach over any of the windows.
            continue
        look = unit_look(number, len(units) == 1)
        line = Line(
            MEAN if number is None else unit.name,
            1e3 * found.index.to_numpy(dtype=np.float64),
            _near(found["horizontal_deg"].to_numpy(dtype=np.float64), middle),
            look["colour"],
            look["dash"],
            2.2 if unit is main else 1.3,
            dots=True,
            symbol=look["symbol"],
            size=6.0,
        )
        lines.append(line)
    return lines


def _chosen(main: UnitReconstruction, event: int, at: float, name: str) -> list[Line]:
    whole = main.body[event].event
    middle = main.types[event].direction.horizontal_deg
    interval = whole.interval.horizontal
    x = np.array([1e3 * at])
    point = Line(
        name, x, np.array([middle]), BLACK, points=True, symbol="diamond", size=11.0, hollow=True
    )
    if interval.undetermined:
        return [replace(point, name=f"{name}: undetermined")]
    ends = np.array([interval.low_deg, interval.high_deg])
    return [Line("bar", np.repeat(x, 2), ends, BLACK, width=2.4, legend=False), point]
