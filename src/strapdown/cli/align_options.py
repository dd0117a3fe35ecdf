"""Flags of ``strapdown align`` as the specification of an alignment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from strapdown.api.alignment import specify_alignment
from strapdown.api.reading import ImuFile
from strapdown.cli.shared_options import log_keys
from strapdown.config.alignment import AlignmentSpec, LogTable
from strapdown.exceptions import ConfigError, StrapdownError

__all__ = [
    "LOG_FLAGS",
    "as_flag",
    "flag_of",
    "flag_words",
    "module_of_flag",
    "refused_flag",
    "spec_of_flags",
]

#: Of how a log is read; the same of every command.
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
#: Flags by the place in a specification.
FLAGS = {
    "site, lat_deg": "--lat",
    "site, lon_deg": "--lon",
    "site, alt_m": "--alt",
    "sensors, sensor": "--sensor",
    "gnss, path": "--gnss",
    **LOG_FLAGS,
}
_STAGES = {"coarse": "--method", "prefilter": "--prefilter"}


def flag_words(
    source: Path,
    given: Mapping[str, Any],
    what: str = "the file of an alignment",
    flags: Mapping[str, str] = FLAGS,
) -> None:
    """Refuse flags beside a file that says all of it, and name the key that says the same.

    Parameters
    ----------
    source : Path
    given : mapping
        By flag, None where it is not given.
    what : str
        What the file is of.
    flags : mapping
        Flags by the place in a specification.

    Raises
    ------
    ConfigError
    """
    written = [name for name, value in given.items() if value is not None]
    if not written:
        return
    flag = flag_of(written[0])
    raise ConfigError(
        f"{what} says how it is run, and this is said beside it",
        file=source.name,
        quantity=flag,
        remedy=f"write {_key(flag, flags)} in the file; --out, --force, --json and --quiet go "
        "with both",
    )


def flag_of(name: str) -> str:
    """The flag of a parameter of a command."""
    return "--" + name.removesuffix("_s").replace("_", "-")


def _key(flag: str, flags: Mapping[str, str]) -> str:
    places = {**flags, **{f"{stage}, kind": name for stage, name in _STAGES.items()}}
    place = next((place for place, name in places.items() if name == flag), None)
    if place is None:
        return "it"
    table, key = place.rsplit(", ", 1)
    value = ' = "rts"' if flag == "--smooth" else ""
    return f"{key}{value} under [{table.replace(', ', '.')}]"


def spec_of_flags(log: Path, given: Mapping[str, Any]) -> AlignmentSpec:
    """Return the specification that flags make; the place may come from the log.

    Parameters
    ----------
    log : Path
    given : mapping
        By flag, None where it is not given.

    Returns
    -------
    AlignmentSpec

    Raises
    ------
    ConfigError
        A value does not fit, or what is needed is not said; the message names the flag.
    DataError
        The log cannot be read.
    """
    try:
        table = LogTable(path=str(log), **log_keys(given))
    except ValidationError as error:
        first = error.errors()[0]
        raise refused_flag({**first, "loc": ("log", *first["loc"])}) from None
    site = {"lat_deg": given["lat"], "lon_deg": given["lon"], "alt_m": given["alt"]}
    try:
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
    except ValidationError as error:
        raise refused_flag(error.errors()[0]) from None
    except ConfigError as error:
        raise as_flag(error) from None


def refused_flag(error: Any, flag: Callable[[str], str] | None = None) -> ConfigError:
    """What pydantic finds in flags, in our words.

    Parameters
    ----------
    error : dict
        One of `ValidationError.errors`.
    flag : callable, optional
        The flag of a place in a specification; those of ``strapdown align``, if not given.
    """
    path = [str(p) for p in error["loc"]]
    context = error.get("ctx", {})
    if error["type"] == "missing":
        what, remedy = "it is missing", f"write it after the colon: {path[-1]}=…"
    elif error["type"] == "finite_number":
        what, remedy = f"{error['input']} is no number", "give a finite number"
    else:
        what = context.get("what") or f"{error['input']!r} does not fit: {error['msg'].lower()}"
        remedy = context.get("remedy") or "give another value"
    if context.get("key"):
        path.append(context["key"])
    return ConfigError(what, quantity=(flag or _flag)(", ".join(path)), remedy=remedy)


def as_flag(error: StrapdownError, flag: Callable[[str], str] | None = None) -> StrapdownError:
    """The error with the flag in place of the place in a specification."""
    f = error.finding
    return type(error)(
        f.what, file=f.file, row=f.row, quantity=(flag or _flag)(f.quantity or ""), remedy=f.remedy
    )


def _flag(place: str) -> str:
    if place in FLAGS:
        return FLAGS[place]
    # Where it was told by name of the flag already, that is the name.
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
            raise ConfigError(
                f"'{part}' is no option",
                quantity=kind,
                remedy="write name=value after the colon, several joined by commas",
            )
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
