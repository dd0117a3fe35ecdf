"""Flags of ``strapdown align`` as the specification of an alignment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from strapdown.api.alignment import specify_alignment
from strapdown.api.reading import ImuFile
from strapdown.cli.shared_options import log_keys
from strapdown.config.alignment import AlignmentSpec, LogTable
from strapdown.config.spec import specify
from strapdown.errors import ConfigError

__all__ = [
    "LOG_FLAGS",
    "as_flag",
    "flag_of",
    "module_of_flag",
    "refuse_beside_file",
    "spec_of_flags",
]

#: How a log is read; common to all commands.
LOG_FLAGS = {
    "axes, axes": "--axes",
    "log, from_s": "--from",
    "log, to_s": "--to",
    "log, duration_s": "--duration",
    "log, sampling": "--sampling",
    "log, rate_hz": "--rate",
    "log, columns": "--columns",
    "log, repair": "--repair",
    "log, gyro_unit": "--gyro-unit",
    "log, accel_unit": "--accel-unit",
    "log, time_unit": "--time-unit",
}
#: Flags by key path of the specification.
FLAGS = {
    "site, lat_deg": "--lat",
    "site, lon_deg": "--lon",
    "site, alt_m": "--alt",
    "sensors, sensor": "--sensor",
    "gnss, path": "--gnss",
    **LOG_FLAGS,
}
_STAGES = {"coarse": "--method", "prefilter": "--prefilter"}


def refuse_beside_file(
    source: Path,
    given: Mapping[str, Any],
    flags: Mapping[str, str] = FLAGS,
) -> None:
    """Refuse options beside a configuration file, and name the key for each.

    Parameters
    ----------
    source : Path
    given : mapping
        By flag, None where not given.
    flags : mapping
        Flags by key path of the specification.

    Raises
    ------
    ConfigError
    """
    written = [name for name, value in given.items() if value is not None]
    if not written:
        return
    flag = flag_of(written[0])
    places = {**flags, **{f"{stage}, kind": name for stage, name in _STAGES.items()}}
    place = next((place for place, name in places.items() if name == flag), None)
    if place is None:
        raise ConfigError("cli.option-beside-file", file=source.name, quantity=flag)
    table, key = place.rsplit(", ", 1)
    entry = f'{key} = "rts"' if flag == "--smooth" else key
    table = table.replace(", ", ".")
    raise ConfigError(
        "cli.option-of-key-beside-file", file=source.name, quantity=flag, entry=entry, table=table
    )


def flag_of(name: str) -> str:
    """The flag of a parameter of a command."""
    return "--" + name.removesuffix("_s").replace("_", "-")


def spec_of_flags(log: Path, given: Mapping[str, Any]) -> AlignmentSpec:
    """Return the specification by the flags; the position may come from the log.

    Parameters
    ----------
    log : Path
    given : mapping
        By flag, None where not given.

    Returns
    -------
    AlignmentSpec

    Raises
    ------
    ConfigError
        A value is invalid or missing; the message names the flag.
    DataError
        The log cannot be read.
    """
    site = {"lat_deg": given["lat"], "lon_deg": given["lon"], "alt_m": given["alt"]}
    keys = log_keys(given)
    try:
        table = specify(LogTable, path=str(log), **keys)
        return specify_alignment(
            ImuFile(table, given["axes"]),
            site={key: float(value) for key, value in site.items() if value is not None},
            sensor=given["sensor"],
            coarse=module_of_flag(given["method"] or "inertial_frame"),
            fine=not given["coarse_only"],
            gnss=None if given["gnss"] is None else str(given["gnss"]),
            prefilter=module_of_flag(given["prefilter"] or "none"),
            called=lambda argument: f"--{argument}",
        )
    except ConfigError as error:
        raise as_flag(error) from None


def as_flag(error: ConfigError, flag: Callable[[str], str] | None = None) -> ConfigError:
    """Return the error, or each of several, with the option instead of the key path.

    Parameters
    ----------
    error : ConfigError
    flag : callable, optional
        Flag of a key path of a specification; those of ``strapdown align``, if not given.
    """
    flag = flag or _flag
    if error.finding.code == "config.several":
        faults = [f.replace(quantity=flag(f.quantity or "")) for f in error.finding.data["faults"]]
        return error.replaced(faults=faults)
    return error.replaced(quantity=flag(error.finding.quantity or ""))


def _flag(place: str) -> str:
    if flag := FLAGS.get(place) or FLAGS.get(f"log, {place}"):
        return flag
    # A path that names a flag already is kept.
    said = [part for part in place.split(", ") if part.startswith("--")]
    if said:
        return said[-1]
    stage, _, rest = place.partition(", ")
    if stage not in _STAGES:
        return place
    return f"{_STAGES[stage]}, {rest}" if rest and rest != "kind" else _STAGES[stage]


def module_of_flag(text: str) -> dict[str, Any]:
    """A kind with its options: ``robust_fir:rate_hz=100,passband=0.4``."""
    kind, _, rest = text.partition(":")
    out: dict[str, Any] = {"kind": kind.strip()}
    for part in (p for p in rest.split(",") if p.strip()):
        key, equals, value = (piece.strip() for piece in part.partition("="))
        if not equals or not value:
            raise ConfigError("cli.bad-module-option", quantity=kind, part=part)
        out[key] = _value(value)
    return out


def _value(text: str) -> Any:
    if text in ("true", "false"):
        return text == "true"
    for form in (int, float):
        try:
            return form(text)
        except ValueError:
            continue
    return text
