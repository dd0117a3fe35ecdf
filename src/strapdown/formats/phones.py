"""Common part of phone logs: axes, and sums of linear acceleration and gravity."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats.arrays import numbers
from strapdown.formats.find_columns import Column
from strapdown.formats.join import Clock, at_stamps, in_seconds
from strapdown.formats.recording import RawLog

# The phone's own axes point right, to the top edge, and out of the screen. It is assumed to lie on
# its back with the top edge forward: forward is y, right is x, down is -z.
AXES = "y,x,-z"
XYZ = "xyz"


def sensor_log(
    name: str,
    file: Path,
    columns: Mapping[str, NDArray[Any]],
    triad: str,
    unit: str | None,
    *,
    time: tuple[str, str],
    xyz: tuple[str, str, str] = ("x", "y", "z"),
    rows: NDArray[np.int64] | None = None,
    findings: list[Finding] | None = None,
) -> RawLog:
    """Make the log of one sensor of a phone.

    `name`: for messages. `columns` ((n,)). `triad`: ``gyro``, ``accel`` or ``mag``. `unit`: none if
    unknown. `time` ((str, str)): column of the stamps and their unit. `xyz` ((str, str, str)):
    columns of the three axes.
    """
    return RawLog(
        name=name,
        files=(file,),
        columns=dict(columns),
        rows=rows,
        stated={time[0]: ("time", time[1])}
        | {column: (f"{triad}_{axis}", unit) for column, axis in zip(xyz, XYZ, strict=True)},
        axes=AXES,
        findings=findings or [],
    )


def force_of(linear: RawLog, gravity: RawLog) -> RawLog:
    """Add linear acceleration and gravity, each with the phone's sign, to specific force.

    `linear`, `gravity`: from `sensor_log`, of the triad ``accel``, in one unit. Returns the sum, at
    the stamps of `linear` that gravity covers. DataError: the two do not overlap in time, or a
    value is not a number.
    """
    clocks, values = [], []
    for log in (linear, gravity):
        columns = {q: Column(s, u, "file") for s, (q, u) in log.stated.items()}
        clocks.append(Clock(numbers(log, columns["time"].source, "time"), columns["time"].unit))
        found = [numbers(log, columns[f"accel_{a}"].source, f"accel_{a}") for a in XYZ]
        values.append(np.column_stack(found).astype(np.float64))
    time, own = (in_seconds(clock, clocks[0]) for clock in clocks)
    if time.shape == own.shape and np.array_equal(time, own):
        inside, distance, at = np.ones(time.size, dtype=bool), 0.0, values[1]
    else:
        use = np.isfinite(own) & np.isfinite(values[1]).all(axis=1)
        order = np.flatnonzero(use)[np.argsort(own[use], kind="stable")]
        if not order.size:
            raise DataError("io.holds-no-number", file=gravity.name, quantity="accel")
        at, inside, distance = at_stamps(time, own[order], values[1][order])
    if not inside.any():
        raise DataError(
            "io.logs-without-common-time", file=gravity.name, quantity="time", name=linear.name
        )
    total = (values[0] + at)[inside]
    rows = np.arange(1, time.size + 1) if linear.rows is None else linear.rows
    time_column = next(s for s, (q, _) in linear.stated.items() if q == "time")
    sources = [next(s for s, (q, _) in linear.stated.items() if q == f"accel_{a}") for a in XYZ]
    return RawLog(
        name=linear.name,
        files=tuple(dict.fromkeys([*linear.files, *gravity.files])),
        columns={time_column: linear.columns[time_column][inside]}
        | {source: total[:, k] for k, source in enumerate(sources)},
        rows=rows[inside],
        stated=linear.stated,
        axes=linear.axes,
        findings=[
            *linear.findings,
            *gravity.findings,
            Finding(
                "io.force-summed-interpolated" if distance > 0 else "io.force-summed",
                file=linear.name,
                quantity="accel",
                severity="note",
                linear=linear.name,
                gravity=gravity.name,
                distance=distance,
            ),
        ],
    )
