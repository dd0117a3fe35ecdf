"""Write a proposed alignment configuration from a log, with the open questions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING
from pathlib import Path
from typing import Any

import pandas as pd

from strapdown.config.alignment import STAGES
from strapdown.config.choice import SLOTS, Kinds, Slot, options_of
from strapdown.config.logs import AxesTable, LogTable
from strapdown.config.toml_text import ASK, Draft, Page, inline, string
from strapdown.formats.assemble import require_accel
from strapdown.formats.recording import Recording
from strapdown.sensors.catalogue import SENSORS, load_sensor
from strapdown.sensors.triad_errors import NAMED_AXES
from strapdown.systems.alignment_source import body_record
from strapdown.tables.checks import index_of

#: Grades of the catalogue with gyros for gyrocompassing, or nearly.
GRADES = ("navigation", "tactical")


def draft_alignment(log: LogTable, *, folder: Path, axes: str | None = None) -> Draft:
    """Write the proposed alignment configuration of a log.

    Parameters
    ----------
    log : LogTable
        With a readable path.
    folder : Path
        Folder of the configuration; the log is named relative to it.
    axes : str, optional
        Orientation of the sensor's axes, as `AxesTable.axes`.
    """
    recording, imu, findings = body_record(log, AxesTable(axes=axes))
    require_accel(recording)
    page = Page()
    page.say(
        f"An alignment of {recording.name}: find roll, pitch and heading of a stationary body.",
        'Put what you know in place of each "?", then run: strapdown align on this file.',
    )
    found = log_table(page, log, folder, imu, recording.name, ", position of the body")
    found += _site(page, recording)
    axes_table(
        page,
        axes,
        "matrix = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]: any rotation; rows are the body's forward, "
        "right, down along the sensor's x, y, z. gyro_matrix and accel_matrix, where they differ",
        f"design = … by name: {', '.join(NAMED_AXES)}",
    )
    _sensors(page)
    for name, one in STAGES.items():
        stage(page, one, {})
        if name == "coarse":
            page.say("duration_s = 100.0: over the first part alone, and the fine one after it")
    _rest(page)
    return Draft(page.text, tuple(found), tuple(page.asked), findings=findings)


def log_table(
    page: Page,
    log: LogTable,
    folder: Path,
    imu: pd.DataFrame,
    name: str,
    part: str = "",
    check_sampling: str = "",
) -> list[str]:
    """Write ``[log]`` with the keys that the user stated; return what the log is.

    `check_sampling`: consequence of a kind of sampling that is assumed, if the user is to check it.
    """
    time = index_of(imu)
    rate = (len(time) - 1) / float(time[-1] - time[0])
    span = f"{len(time)} samples, {time[0]:.9g} to {time[-1]:.9g} s, {rate:.4g} Hz"
    page.table("[log]", f"Found: {span}, {imu.attrs['sampling']} values.")
    page.path("path", Path(log.path), folder)
    if log.columns:
        page.key("columns", inline(log.columns))
    if log.calibration is not None:
        page.path("calibration", Path(log.calibration), folder)
    for key, value in log.model_dump(exclude={"path", "columns", "calibration"}).items():
        if value is not None and value is not False:
            page.key(key, toml_value(value) or "")
    if check_sampling:
        page.key("sampling", string(imu.attrs["sampling"]), "assumed", check=check_sampling)
    if log.from_s is log.to_s is log.duration_s is None:
        page.say(f"from_s = {time[0]:.9g}, duration_s = 300.0 (or to_s): a part alone{part}")
    return [f"{name}: {span}"]


def _site(page: Page, recording: Recording) -> list[str]:
    start = recording.start
    where = "Position of the body: a hundredth of a degree is enough."
    if start is None:
        page.table("[site]", where)
        page.key("lat_deg", ASK, "only you know: geodetic latitude, north positive")
        page.key("lon_deg", ASK, "only you know: longitude, east positive")
        page.key("alt_m", "0.0", "assumed: height over the ellipsoid")
        found = []
    else:
        page.table("[site]", where, "Found: the log states it; check that it is so.")
        page.key("lat_deg", repr(start.lat_deg), "north positive")
        page.key("lon_deg", repr(start.lon_deg), "east positive")
        page.key("alt_m", repr(start.alt), "over the ellipsoid")
        found = [f"position: {start.lat_deg:.6f}°, {start.lon_deg:.6f}°, {start.alt:g} m"]
    page.key("ellipsoid", '"wgs84"')
    return found


def axes_table(page: Page, axes: str | None, *further: str) -> None:
    """Write ``[axes]``, with further remarks."""
    page.table("[axes]", "How the sensor's axes lie in the body, where the log does not say it.")
    if axes:
        page.key("axes", string(axes))
    page.say(
        'axes = "forward-left-up": where x, y, z of the sensor point; or "x,-y,-z", the axes that '
        "point forward, right, down",
        *further,
    )


def _sensors(page: Page) -> None:
    page.table(
        "[sensors]",
        "How good the sensors are: every bound rests on it. A gyro bias of 0.01 deg/h is 0.05° of "
        "heading, an accelerometer bias of 50 µg 0.003° of tilt.",
    )
    good = [s.name for s in map(load_sensor, SENSORS) if s.grade in GRADES]
    page.key(
        "sensor", ASK, "only you know: which sensor, of the catalogue or a .toml file of your own"
    )
    page.say(
        f"Of those that can find north, or nearly: {', '.join(good)}; all: strapdown modules",
        "Alternatively, or to replace single values: tables [sensors.gyro] and [sensors.accel]: "
        "bias_sd_deg_per_h, noise_density_deg_per_sqrt_h; bias_sd_ug, "
        "noise_density_ug_per_sqrt_hz, …",
    )


def stage(
    page: Page, kinds: Kinds, chosen: Mapping[str, Any], checks: Mapping[str, str] | None = None
) -> None:
    """Write the table of a module: its chosen options, and the others as comments.

    `checks`: by key, the consequence of a chosen value, for the user to confirm.
    """
    slot = SLOTS[kinds.slot]
    kind = chosen.get("kind", kinds.default)
    page.table(f"[{slot.name}]", f"{slot.title}:", *listed_kinds(slot, kinds.empty))
    page.key("kind", string(kind))
    if kind in slot.entries:
        options(page, slot.entries[kind], chosen, checks)
    keys = [o.key for o in options_of(slot.entries[kind])] if kind in slot.entries else []
    for key, value in chosen.items():
        if key != "kind" and key not in keys:
            page.key(key, toml_value(value) or "", _ENDS.get(key, ""))


#: End conditions of an alignment.
_ENDS = {
    "duration_s": "its end",
    "window_s": "length of the latest part that is aligned",
    "until_heading_sd_deg": "ends when the sd of heading is below",
    "until_tilt_sd_deg": "and those of roll and pitch",
    "least_s": "but not before this time",
}


def options(
    page: Page, module: type, chosen: Mapping[str, Any], checks: Mapping[str, str] | None = None
) -> None:
    """Write chosen options as keys, the others as comments with their defaults."""
    for option in options_of(module):
        if option.key in chosen:
            remark, check = _CHOSEN.get(option.key, ""), (checks or {}).get(option.key, "")
            if chosen[option.key] == "?":
                remark = f"only you know: {_WANTED[option.key]}"
            page.key(option.key, _inline(chosen[option.key]), remark, check=check)
            continue
        value = toml_value(option.default)
        if option.slot is not None:
            said = value if option.default is not None else '"none"'
            page.say(f"{option.key} = {said}    of {', '.join(option.slot.entries)}")
        elif value is not None:
            page.say(f"{option.key} = {value}")
        elif option.default is MISSING:
            page.key(option.key, ASK, f"only you know: {_WANTED.get(option.key, 'no default')}")


def _inline(value: Any) -> str:
    """Write a value, or a module with its options, on one line."""
    if isinstance(value, Mapping):
        parts = ", ".join(f"{key} = {_inline(one)}" for key, one in value.items())
        return f"{{ {parts} }}"
    return toml_value(value) or ""


#: Effect of an option that was chosen.
_CHOSEN = {"backtrack": "navigation begins with the first sample of that part"}
_WANTED = {
    "heading_deg": "heading of the body at the start, clockwise from north (gyros that "
    "find north at a rest of a minute need none, if their sensor is named)",
    "axis_deg": "direction of the baseline, from the antenna of the base (master, primary) to the "
    "other one, in the body, from forward to the right: 0 if the other one is in front, 90 on the "
    "right, 180 behind, -90 on the left",
    "sd_deg": "how well that heading is known, one standard deviation",
}


def listed_kinds(slot: Slot, empty: bool) -> list[str]:
    """List the kinds of a slot for comments, one per line; with ``none`` if it may be empty."""
    kinds = {kind: _summary(entry) for kind, entry in slot.entries.items()}
    if empty:
        kinds["none"] = "left out"
    width = max(map(len, kinds))
    return [f"  {kind:<{width}}  {told}" for kind, told in kinds.items()]


def _summary(entry: type) -> str:
    said = getattr(entry, "summary", "") or (entry.__doc__ or "").partition("\n")[0]
    return str(said).rstrip(".")


def toml_value(value: Any) -> str | None:
    """Format a plain TOML value; None for other values."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str):
        return string(value)
    if isinstance(value, tuple | list):
        parts = [toml_value(v) for v in value]
        return f"[{', '.join(p for p in parts if p is not None)}]"
    if isinstance(value, Mapping) or value is MISSING:
        return None
    return None


def _rest(page: Page) -> None:
    page.table("[output]", "Files beside the report.")
    page.key("rate_hz", "10.0", "of attitude.csv")
    page.blank()
    page.say(
        '[reference]: heading_deg, pitch_deg, roll_deg, sd_deg, at = "end" or "start", source: '
        "an attitude that is known from elsewhere, to hold the answer beside"
    )
