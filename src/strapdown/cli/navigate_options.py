"""Flags of ``strapdown navigate`` as the specification of a run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from strapdown.cli.align_options import LOG_FLAGS, as_flag, refused_flag
from strapdown.cli.shared_options import log_keys
from strapdown.config.alignment import LogTable
from strapdown.config.navigation import NavigationSpec
from strapdown.config.navigation_file import navigation_spec
from strapdown.errors import ConfigError
from strapdown.systems.sins.proposal import propose

__all__ = ["FLAGS", "navigation_of_flags"]

#: Flags by the place in a specification.
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
    """Return the specification that flags make, with what the log and the fixes tell.

    Parameters
    ----------
    log : Path
    given : mapping
        By flag, None where it is not given.

    Returns
    -------
    NavigationSpec

    Raises
    ------
    ConfigError
        A value does not fit, or what is needed is not said; the message names the flag.
    DataError
        A file cannot be read.
    """
    try:
        table = LogTable(
            path=str(log),
            **log_keys(given),
        )
    except ValidationError as error:
        first = error.errors()[0]
        raise refused_flag({**first, "loc": ("log", *first["loc"])}, _flag) from None
    proposal = propose(
        table,
        axes=given["axes"],
        gnss=given["gnss"],
        sensor=given["sensor"],
        site=_site(given),
        heading_deg=given["heading"],
    )
    if given["sensor"] is None:
        near = proposal.table.get("sensors", {}).get("sensor")
        code = "cli.no-sensor-near-one" if near else "cli.no-sensor-for-navigation"
        raise ConfigError(code, quantity="--sensor", near=near)
    whole = {"name": log.resolve().stem, **proposal.table}
    if "position_sd_m" in whole.get("aiding", {}).get("gnss", {}):
        raise ConfigError("cli.fixes-without-sd", file=Path(given["gnss"]).name, quantity="--gnss")
    coarse = whole["coarse"]
    if coarse["kind"] == "known_heading" and "heading_deg" not in coarse:
        raise ConfigError("cli.no-heading", quantity="--heading")
    if "site" not in whole and proposal.gnss is None:
        raise ConfigError("cli.no-initial-position", quantity="--lat")
    if given["lever_arm"] is not None:
        if "aiding" not in whole:
            raise ConfigError("cli.lever-arm-without-receiver", quantity="--lever-arm")
        whole["aiding"]["gnss"]["lever_arm_m"] = _arm(given["lever_arm"])
    if given["truth"] is not None:
        whole["truth"] = {"path": str(given["truth"])}
    if given["points"] is not None:
        whole["control_points"] = {"path": str(given["points"])}
    if given["smooth"]:
        whole["smoother"] = {"kind": "rts"}
    try:
        return navigation_spec(whole)
    except ValidationError as error:
        raise refused_flag(error.errors()[0], _flag) from None
    except ConfigError as error:
        raise as_flag(error, _flag) from None


def smoothed_too(spec: NavigationSpec) -> NavigationSpec:
    """Return a run that is smoothed when it has ended, whatever its file says of that.

    Parameters
    ----------
    spec : NavigationSpec

    Returns
    -------
    NavigationSpec
    """
    if spec.smoother.kind != "none":
        return spec
    return navigation_spec({**spec.plain(), "smoother": {"kind": "rts"}})


def _flag(place: str) -> str:
    return FLAGS.get(place, place)


def _site(given: Mapping[str, Any]) -> tuple[float, float, float] | None:
    lat, lon, alt = given["lat"], given["lon"], given["alt"]
    if lat is None and lon is None and alt is None:
        return None
    for value, flag in ((lat, "--lat"), (lon, "--lon")):
        if value is None:
            raise ConfigError("cli.half-a-position", quantity=flag, flag=flag)
    return lat, lon, alt or 0.0


def _arm(text: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise ConfigError("cli.bad-lever-arm", quantity="--lever-arm", text=text) from None
    return x, y, z
