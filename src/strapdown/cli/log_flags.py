"""Flags that say how a log is read as the keys of its table."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from strapdown.formats.columns import parse_column_option

__all__ = ["LOG_FLAGS", "log_keys"]

#: Flags by the place in a specification.
LOG_FLAGS = {
    "axes, axes": "--axes",
    "log, from_s": "--from",
    "log, duration_s": "--duration",
    "log, sampling": "--sampling",
    "log, rate_hz": "--rate",
    "log, gyro_unit": "--gyro-unit",
    "log, accel_unit": "--accel-unit",
    "log, time_unit": "--time-unit",
}


def log_keys(log: Path, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of [log] that flags make.

    Parameters
    ----------
    log : Path
    given : mapping
        By flag, None where it is not given.

    Raises
    ------
    ConfigError
        A column is not said as Q=NAME.
    """
    return {
        "path": str(log),
        "columns": parse_column_option(given["columns"] or []),
        "gyro_unit": given["gyro_unit"],
        "accel_unit": given["accel_unit"],
        "time_unit": given["time_unit"],
        "sampling": given["sampling"],
        "rate_hz": given["rate"],
        "repair": bool(given["repair"]),
        "from_s": given["from_s"],
        "duration_s": given["duration"],
    }
