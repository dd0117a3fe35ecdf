"""Garmin FIT (``.fit``): activities with fixes, and cameras and watches with a gyro; by fitdecode.

The messages and their fields are those of the FIT profile (https://developer.garmin.com/fit):
``record`` has positions in semicircles (2³¹ are 180°), ``enhanced_altitude`` over the sea, speed
in m/s and ``gps_accuracy`` in m; ``gyroscope_data``, ``accelerometer_data`` and
``magnetometer_data`` have arrays of samples, each with its offset in ms from the stamp of the
message. Where a device did not calibrate them, ``three_d_sensor_calibration`` converts counts: less
``level_shift`` and ``offset_cal``, times ``calibration_factor`` over ``calibration_divisor``,
turned by ``orientation_matrix`` (FIT SDK, "calibration adjustment"). The profile does not say where
the axes of a device point.
"""

from __future__ import annotations

from collections import defaultdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats.clocks import RELATIVE, UNIX
from strapdown.formats.join import join
from strapdown.formats.known_formats import lacking
from strapdown.formats.recording import RawLog, library
from strapdown.formats.signs import Signs

TITLE = "Garmin FIT"
#: Degrees of a semicircle.
SEMICIRCLE = 180.0 / 2**31
SENSORS = {
    "gyro": ("gyroscope_data", "gyro", "deg/s", "gyroscope"),
    "accel": ("accelerometer_data", "accel", "g", "accelerometer"),
    "mag": ("magnetometer_data", "mag", "gauss", "compass"),
}
Message = dict[str, Any]


detect = Signs(first=rb"\A[\x0c\x0e].{7}\.FIT")


def read(path: Path) -> RawLog:
    """Read the gyro, with accelerometer and magnetometer interpolated to its stamps.

    Raises
    ------
    DataError
        The library is missing, or the file is damaged.
    """
    messages = _messages(path)
    logs = [_sensor(path, messages, triad) for triad in SENSORS if messages[SENSORS[triad][0]]]
    if not messages["gyroscope_data"]:
        raise lacking(path, "imu", TITLE, _streams(messages))
    raw = join(logs, path.name, (path,))
    raw.clock = logs[0].clock
    return raw


def read_fixes(path: Path) -> RawLog:
    """Read the positions of the records."""
    messages = _messages(path)
    records = [m for m in messages["record"] if isinstance(m.get("position_lat"), int)]
    if not records:
        raise lacking(path, "gnss", TITLE, _streams(messages))

    def values(*names: str) -> NDArray[np.float64]:
        said = [
            next((m[n] for n in names if isinstance(m.get(n), int | float)), np.nan)
            for m in records
        ]
        return np.array(said, dtype=np.float64)

    time, clock = _stamps(records)
    held: dict[str, tuple[NDArray[Any], str | None]] = {
        "time": (time, "s"),
        "lat": (values("position_lat") * SEMICIRCLE, "deg"),
        "lon": (values("position_long") * SEMICIRCLE, "deg"),
        "alt_msl": (values("enhanced_altitude", "altitude"), "m"),
        "speed": (values("enhanced_speed", "speed"), "m/s"),
    }
    if np.isfinite(accuracy := values("gps_accuracy")).any():
        held["horizontal_accuracy"] = (accuracy, "m")
    rows = np.array([m["#"] for m in records])
    findings = []
    if lost := len(messages["record"]) - len(records):
        findings.append(
            Finding(
                "io.records-without-place",
                file=path.name,
                severity="note",
                lost=lost,
                count=len(messages["record"]),
            )
        )
    return RawLog.of(path, held, clock=clock, rows=rows, findings=findings)


def _messages(path: Path) -> defaultdict[str, list[Message]]:
    """Return the messages of each kind, each with its number in the file as ``#``."""
    fitdecode = library("fitdecode", path)
    found: defaultdict[str, list[Message]] = defaultdict(list)
    count = 0
    try:
        with fitdecode.FitReader(path.read_bytes()) as reader:
            for frame in reader:
                if frame.frame_type == fitdecode.FIT_FRAME_DATA:
                    count += 1
                    found[frame.name].append({f.name: f.value for f in frame.fields} | {"#": count})
    except Exception as error:  # a damaged file can break the decoder anywhere
        raise DataError(
            "io.fit-unreadable",
            file=path.name,
            count=count,
            error=str(error) or type(error).__name__,
        ) from None
    return found


def _streams(messages: defaultdict[str, list[Message]]) -> list[str]:
    there = {
        "imu": messages["gyroscope_data"],
        "gnss": [m for m in messages["record"] if m.get("position_lat") is not None],
    }
    return [stream for stream, has in there.items() if has]


def _stamps(messages: list[Message]) -> tuple[NDArray[np.float64], str]:
    """Return seconds since 1970; since the start of the device if it did not know the date."""
    said = [m.get("timestamp") for m in messages]
    dated = all(isinstance(s, datetime) for s in said)
    seconds = [
        s.replace(tzinfo=s.tzinfo or UTC).timestamp() if isinstance(s, datetime) else s
        for s in said
    ]
    clock = UNIX if dated else RELATIVE
    return np.array([np.nan if s is None else s for s in seconds], dtype=np.float64), clock


def _sensor(path: Path, messages: defaultdict[str, list[Message]], triad: str) -> RawLog:
    kind, prefix, stated, sensor = SENSORS[triad]
    unit: str | None = stated
    own = messages[kind]
    names = [f"calibrated_{prefix}_{a}" for a in "xyz"]
    calibrated = all(m.get(n) is not None for m in own for n in names)
    names = names if calibrated else [f"{prefix}_{a}" for a in "xyz"]
    base, clock = _stamps(own)
    times, samples = [], []
    for message, start in zip(own, base, strict=True):
        axes = [np.atleast_1d(np.array(message.get(n) or [], dtype=np.float64)) for n in names]
        offsets = np.atleast_1d(np.array(message.get("sample_time_offset") or 0, dtype=np.float64))
        if any(a.shape != offsets.shape for a in axes):
            raise DataError(
                "io.fit-samples-and-offsets",
                file=path.name,
                row=message["#"],
                quantity=triad,
                count=offsets.size,
                counts=[a.size for a in axes],
            )
        times.append(start + ((message.get("timestamp_ms") or 0) + offsets) * 1e-3)
        samples.append(np.column_stack(axes))
    values = np.concatenate(samples)
    if not calibrated:
        applied = _calibrated(path, messages, sensor, values)
        values, unit = (values, None) if applied is None else (applied, unit)
    held: dict[str, tuple[NDArray[Any], str | None]] = {"time": (np.concatenate(times), "s")}
    held |= {f"{triad}_{a}": (values[:, k], unit) for k, a in enumerate("xyz")}
    log = RawLog.of(path, held, clock=clock)
    log.name = f"{path.name}/{kind}"
    return log


def _calibrated(
    path: Path, messages: defaultdict[str, list[Message]], sensor: str, counts: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Convert counts by the first calibration of their sensor; None if there is none."""
    for one in messages["three_d_sensor_calibration"]:
        factor = next(
            (one[n] for n in one if n.endswith("cal_factor") or n == "calibration_factor"), None
        )
        divisor = one.get("calibration_divisor")
        if one.get("sensor_type") != sensor or not factor or not divisor:
            continue
        offset = np.array(one.get("offset_cal") or (0, 0, 0), dtype=np.float64)
        matrix = np.array(one.get("orientation_matrix") or np.eye(3).ravel(), dtype=np.float64)
        if offset.size != 3 or matrix.size != 9:
            raise DataError(
                "io.fit-samples-and-offsets",
                file=path.name,
                row=one["#"],
                quantity=sensor,
                count=offset.size,
                counts=[matrix.size],
            )
        shifted = counts - float(one.get("level_shift") or 0) - offset
        return np.asarray(shifted * (factor / divisor) @ matrix.reshape(3, 3).T)
    return None
