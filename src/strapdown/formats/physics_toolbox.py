"""Physics Toolbox Sensor Suite (Vieyra Software): CSV of several sensors of a phone.

``time``, ``gFx, gFy, gFz`` (g-force: the accelerometer over 9.81 m/s², with gravity), ``ax, ay,
az`` (linear acceleration in m/s², without it), ``wx, wy, wz`` in rad/s, ``Bx, By, Bz`` in µT, ``p``
in hPa (https://www.vieyrasoftware.net, "Multi record"). ``time`` is in seconds from the start, or
the time of day with a fourth part of milliseconds. Axes are those of the phone; the sign of the
g-force differs between its systems and is inferred from the numbers.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats import csv
from strapdown.formats.clocks import RELATIVE
from strapdown.formats.known_formats import AXES, column, lacking, optional, stated_by, under
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs

TITLE = "recording of Physics Toolbox"
QUANTITIES: dict[str, tuple[str, str | None]] = {f"gyro_{a}": (f"w{a}", "rad/s") for a in "xyz"}
QUANTITIES |= {f"accel_{a}": (f"gF{a}", "g or -g") for a in "xyz"}
QUANTITIES |= {f"mag_{a}": (f"B{a}", "uT") for a in "xyz"}


# No other application has these names of the g-force.
detect = Signs(text=r'\A[\s"]*time\b(?=.*\bgFx\b)(?=.*\bgFy\b)(?=.*\bgFz\b)', also=csv.detect)


def read(path: Path) -> RawLog:
    """Read rates, specific force and magnetic field."""
    raw = under(path)
    held = optional(raw, QUANTITIES)
    if "gyro_x" not in held:
        raise lacking(path, "imu", TITLE, ["barometer"] if "p" in raw.columns else [])
    log = stated_by(raw, {"time": (_time(raw), "s"), **held}, axes=AXES, clock=RELATIVE)
    if "ax" in raw.columns:
        log.findings.append(
            Finding(
                "io.linear-acceleration-not-used",
                file=path.name,
                quantity="accel",
                severity="note",
                source="ax, ay, az",
            )
        )
    return log


def read_barometer(path: Path) -> RawLog:
    """Read the pressure."""
    raw = under(path)
    if "p" not in raw.columns:
        raise lacking(path, "barometer", TITLE, ["imu"] if "wx" in raw.columns else [])
    held = {"time": (_time(raw), "s"), "pressure": (column(raw, "p"), "hPa")}
    return stated_by(raw, held, clock=RELATIVE)


def _time(raw: RawLog) -> NDArray[np.float64]:
    """Return seconds; times of day as ``10:11:12:345`` count on over midnight."""
    values = raw.columns["time"]
    if values.dtype.kind in "iuf" or ":" not in str(values[0]):
        return column(raw, "time").astype(np.float64)
    out = np.empty(values.size)
    for k, text in enumerate(values):
        parts = str(text).replace(",", ".").split(":")
        try:
            hours, minutes, seconds = (float(p) for p in parts[:3])
            out[k] = (
                3600 * hours + 60 * minutes + seconds + float(f"0.{parts[3]}" if parts[3:] else 0)
            )
        except ValueError:
            raise DataError(
                "io.value-not-a-number",
                file=raw.name,
                row=raw.row(k),
                quantity="time",
                values=text,
                source="time",
            ) from None
    return np.asarray(out + 86400.0 * np.cumsum(np.diff(out, prepend=out[0]) < -43200.0))
