"""Write a proposed alignment configuration from a log, with the open questions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.config.alignment import STAGES, AxesTable, LogTable
from strapdown.config.choice import SLOTS, Slot, options_of
from strapdown.config.toml_text import ASK, Asked, Page, inline, string
from strapdown.errors import Finding
from strapdown.formats.recording import Recording
from strapdown.sensors.catalogue import SENSORS, load_sensor
from strapdown.sensors.triad_errors import NAMED_AXES
from strapdown.systems.alignment_source import body_record

__all__ = ["AlignmentDraft", "draft_alignment", "listed_kinds", "log_table_keys", "toml_value"]

#: Grades of the catalogue with gyros for gyrocompassing, or nearly.
GRADES = ("navigation", "tactical")


@dataclass(frozen=True)
class AlignmentDraft:
    """Proposed alignment configuration as text.

    Attributes
    ----------
    text : str
    found : tuple of str
        Findings from the log.
    asked : tuple of Asked
        Questions that the user has to answer.
    findings : tuple of Finding
        Findings of reading the log.
    """

    text: str
    found: tuple[str, ...]
    asked: tuple[Asked, ...]
    findings: tuple[Finding, ...]


def draft_alignment(log: LogTable, *, folder: Path, axes: str | None = None) -> AlignmentDraft:
    """Write the proposed alignment configuration of a log.

    Parameters
    ----------
    log : LogTable
        With a readable path.
    folder : Path
        Folder of the configuration; the log is named relative to it.
    axes : str, optional
        Orientation of the sensor's axes, as `AxesTable.axes`.

    Returns
    -------
    AlignmentDraft

    Raises
    ------
    DataError, ConfigError
        The log cannot be read; the message names file, row and remedy.
    """
    recording, imu, findings = body_record(log, AxesTable(axes=axes))
    page = Page()
    page.say(
        f"An alignment of {recording.name}: find roll, pitch and heading of a body that stands.",
        'Put what you know in place of each "?", then run: strapdown align on this file.',
    )
    found = _log(page, log, folder, recording.name, imu)
    found += _site(page, recording)
    _axes(page, axes)
    _sensors(page)
    for name, one in STAGES.items():
        _stage(page, SLOTS[name], one.default, one.empty)
    _rest(page)
    text = "\n".join(page.lines) + "\n"
    return AlignmentDraft(text, tuple(found), tuple(page.asked), findings)


def _log(page: Page, log: LogTable, folder: Path, name: str, imu: pd.DataFrame) -> list[str]:
    time = imu.index.to_numpy(dtype=np.float64)
    rate = 1.0 / float(np.median(np.diff(time)))
    span = f"{len(time)} samples, {time[0]:.6g} to {time[-1]:.6g} s, {rate:.4g} Hz"
    page.table("[log]", f"Found: {span}, {imu.attrs['sampling']} values.")
    log_table_keys(page, log, folder)
    if log.from_s is log.to_s is log.duration_s is None:
        page.say(
            f"from_s = {time[0]:.9g}, duration_s = 300.0 (or to_s): a part alone, where the body "
            "stands"
        )
    return [f"{name}: {span}"]


def log_table_keys(page: Page, log: LogTable, folder: Path) -> None:
    """Write the keys of ``[log]`` that the user stated, with the path relative to the folder."""
    page.path("path", Path(log.path), folder)
    if log.columns:
        page.key("columns", inline(log.columns))
    for key, value in log.model_dump(exclude={"path", "columns"}).items():
        if value is not None and value is not False:
            page.key(key, toml_value(value) or "")


def _site(page: Page, recording: Recording) -> list[str]:
    start = recording.start
    where = "Where the body stands: to a hundredth of a degree is enough."
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
        found = [f"place: {start.lat_deg:.6f}°, {start.lon_deg:.6f}°, {start.alt:g} m"]
    page.key("ellipsoid", '"wgs84"')
    return found


def _axes(page: Page, axes: str | None) -> None:
    page.table("[axes]", "How the sensor's axes lie in the body, where the log does not say it.")
    if axes:
        page.key("axes", string(axes))
    page.say(
        'axes = "forward-left-up": where x, y, z of the sensor point; or "x,-y,-z", the axes that '
        "point forward, right, down",
        "matrix = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]: any rotation; rows are the body's forward, "
        "right, down along the sensor's x, y, z. gyro_matrix and accel_matrix, where they differ",
        f"design = … by name: {', '.join(NAMED_AXES)}",
    )


def _sensors(page: Page) -> None:
    page.table(
        "[sensors]",
        "How good the sensors are: every bound rests on it. A gyro bias of 0.01 deg/h is 0.05° of "
        "heading, an accelerometer bias of 50 µg 0.003° of tilt.",
    )
    good = [s.name for s in map(load_sensor, SENSORS) if s.grade in GRADES]
    page.key("sensor", ASK, "only you know: one of the catalogue, or a .toml file of your own")
    page.say(
        f"Of those that can find north, or nearly: {', '.join(good)}; all: strapdown modules",
        "Alternatively, or to replace single values: tables [sensors.gyro] and [sensors.accel]: "
        "bias_sd_deg_per_h, noise_density_deg_per_sqrt_h; bias_sd_ug, "
        "noise_density_ug_per_sqrt_hz, …",
    )


def _stage(page: Page, slot: Slot, default: str, empty: bool) -> None:
    page.table(f"[{slot.name}]", f"{slot.title}:", *listed_kinds(slot, empty))
    page.key("kind", string(default))
    if default in slot.entries:
        for option in options_of(slot.entries[default]):
            value = toml_value(option.default)
            if option.slot is not None:
                choices = ", ".join(option.slot.entries)
                said = value if option.default is not None else '"none"'
                page.say(f"{option.key} = {said}    of {choices}")
            elif value is not None:
                page.say(f"{option.key} = {value}")
    if slot.name == "coarse":
        page.say("duration_s = 100.0: over the first part alone, and the fine one after it")


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
        "an attitude that is known from elsewhere, to hold the answer beside",
    )
