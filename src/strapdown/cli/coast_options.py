"""Flags of ``strapdown coast`` as the specification of a drift prediction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from strapdown.cli.align_options import as_flag, module_of_flag
from strapdown.config.coast import CoastSpec
from strapdown.config.spec import specify
from strapdown.errors import ConfigError

__all__ = ["coast_of_flags"]

#: Flags by key path of the specification.
FLAGS = {
    "outage_s": "--outage",
    "places": "--places",
    "at_s": "--at",
    "from_s": "--from",
    "to_s": "--to",
    "duration_s": "--duration",
    "sensor": "SENSOR|BUNDLE",
    "motion, speed_m_per_s": "--speed",
    "motion, to_speed_m_per_s": "--to-speed",
    "motion, turn_rate_deg_per_s": "--turn-rate",
    "motion, heading_deg": "--heading",
    "motion, lat_deg": "--lat",
    "start, aided_s": "--aided",
    "start, fix_position_sd_m": "--fix-sd",
    "start, position_sd_m": "--position-sd",
    "start, velocity_sd_m_per_s": "--velocity-sd",
    "start, tilt_sd_deg": "--tilt-sd",
    "start, heading_sd_deg": "--heading-sd",
    "start, gyro_bias_sd_deg_per_h": "--gyro-bias-sd",
    "start, accel_bias_sd_ug": "--accel-bias-sd",
}


def coast_of_flags(
    source: str,
    outage: float,
    of_run: bool,
    *,
    motion: Mapping[str, Any],
    start: Mapping[str, Any],
    keep: Sequence[str],
    run: Mapping[str, Any],
) -> CoastSpec:
    """Return the specification by the flags.

    Parameters
    ----------
    source : str
        As given.
    outage : float, s
    of_run : bool
        Whether it is a navigation run, which states motion and start itself.
    motion, start, run : mapping
        By key of their tables, None where not given.
    keep : sequence of str
        Remaining measurements, as given.

    Returns
    -------
    CoastSpec

    Raises
    ------
    ConfigError
        A value is invalid, or belongs to the other kind of source; the message names the flag.
    """
    _refuse_others(source, of_run, motion, start, keep, run)
    parts = [key for key in ("from_s", "to_s", "duration_s") if run.get(key) is not None]
    if run.get("at_s") is not None and parts:
        raise ConfigError("cli.part-beside-at", quantity=FLAGS[parts[0]])
    aiding: dict[str, Any] = {}
    for text in keep:
        module = module_of_flag(text)
        kind = module.pop("kind")
        if kind in aiding:
            raise ConfigError("cli.aid-repeated", quantity="--with", kind=kind)
        aiding[kind] = module
    sensor = str(Path(source).absolute()) if source.lower().endswith(".toml") else source
    table = {
        "outage_s": outage,
        "sensor": None if of_run else sensor,
        "motion": {k: v for k, v in motion.items() if v is not None},
        "start": {k: v for k, v in start.items() if v is not None},
        "aiding": aiding,
        **run,
    }
    try:
        return specify(CoastSpec, **table)
    except ConfigError as error:
        raise as_flag(error, _flag) from None


def _flag(place: str) -> str:
    return FLAGS.get(place, "--with" if place.startswith("aiding") else place)


def _refuse_others(
    source: str,
    of_run: bool,
    motion: Mapping[str, Any],
    start: Mapping[str, Any],
    keep: Sequence[str],
    run: Mapping[str, Any],
) -> None:
    """Refuse flags of the other kind of source."""
    tables = {"motion, ": motion, "start, ": start} if of_run else {"": run}
    said = [
        FLAGS[f"{place}{key}"]
        for place, table in tables.items()
        for key, value in table.items()
        if value is not None
    ]
    said += ["--with"] if of_run and keep else []
    if not said:
        return
    if of_run:
        raise ConfigError("cli.motion-option-of-run", file=Path(source).name, quantity=said[0])
    raise ConfigError("cli.record-option-of-sensor", quantity=said[0])
