"""Flags of ``strapdown navigate`` as the specification of a run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from strapdown.api.navigation import specify_navigation
from strapdown.api.reading import ImuFile
from strapdown.cli.align_options import LOG_FLAGS, as_flag
from strapdown.cli.shared_options import log_keys
from strapdown.config.alignment import LogTable
from strapdown.config.navigation import NavigationSpec
from strapdown.config.spec import specify
from strapdown.errors import ConfigError

__all__ = ["FLAGS", "navigation_of_flags"]

#: Flags by key path of the specification.
FLAGS = {
    "site, lat_deg": "--lat",
    "site, lon_deg": "--lon",
    "site, alt_m": "--alt",
    "sensors, sensor": "--sensor",
    "coarse, heading_deg": "--heading",
    "aiding, gnss, path": "--gnss",
    "aiding, gnss, lever_arm_m": "--lever-arm",
    "truth, path": "--truth",
    "control_points, path": "--points",
    "smoother, kind": "--smooth",
    **LOG_FLAGS,
}


def navigation_of_flags(log: Path, given: Mapping[str, Any]) -> NavigationSpec:
    """Return the specification by the flags, completed from the log and the fixes.

    Parameters
    ----------
    log : Path
    given : mapping
        By flag, None where not given.

    Returns
    -------
    NavigationSpec

    Raises
    ------
    ConfigError
        A value is invalid or missing; the message names the flag.
    DataError
        A file cannot be read.
    """
    aids: dict[str, dict[str, Any]] = {}
    if given["gnss"] is not None:
        arm = given["lever_arm"]
        aids["gnss"] = {"kind": "gnss", "path": str(given["gnss"])}
        aids["gnss"] |= {} if arm is None else {"lever_arm_m": _arm(arm)}
    elif given["lever_arm"] is not None:
        raise ConfigError("cli.lever-arm-without-receiver", quantity="--lever-arm")
    start = {
        "lat_deg": given["lat"],
        "lon_deg": given["lon"],
        "alt_m": given["alt"],
        "heading_deg": given["heading"],
    }
    further = {
        "truth": given["truth"] and {"path": str(given["truth"])},
        "control_points": given["points"] and {"path": str(given["points"])},
        "smoother": given["smooth"] and {"kind": "rts"},
    }
    try:
        table = specify(LogTable, path=str(log), **log_keys(given))
        return specify_navigation(
            ImuFile(table, given["axes"]),
            aids,
            sensor=given["sensor"],
            start={key: value for key, value in start.items() if value is not None},
            options={name: table for name, table in further.items() if table},
            called=lambda argument: f"--{argument}",
        )
    except ConfigError as error:
        raise as_flag(error, _flag) from None


def _flag(place: str) -> str:
    return FLAGS.get(place) or FLAGS.get(f"log, {place}", place)


def _arm(text: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise ConfigError("cli.bad-lever-arm", quantity="--lever-arm", text=text) from None
    return x, y, z
