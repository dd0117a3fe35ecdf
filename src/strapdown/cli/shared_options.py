"""Options common to several commands, with the same words, order and group everywhere.

A command takes a set of options as one parameter (`LogFlags`, `OutFlags`); `spread` expands it
into separate flags.
"""

from __future__ import annotations

import inspect
import logging
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields, is_dataclass
from functools import partial, wraps
from pathlib import Path
from typing import Any, get_type_hints

import typer

from strapdown.errors import ConfigError


def option(
    panel: str, metavar: str | None, text: str, *flags: str, default: Any = None, **more: Any
) -> Any:
    """Return an option, the default of its parameter; the help lists those of a panel together.

    The text says the default, in its own words.
    """
    more |= {"metavar": metavar, "help": text, "rich_help_panel": panel, "show_default": False}
    return typer.Option(default, *flags, **more)


reading = partial(option, "How to read the log")
fixes = partial(option, "How to read the fixes")
running = partial(option, "What to run")
with_what = partial(option, "Where, and with what")
writing = partial(option, "What to write")
BEGIN = "Begin at this stamp; {}, if not given."
END = "End at this stamp; the last, if not given."
LENGTH = "Length of the part to use, instead of --to."
SENSOR = (
    "Sensor error model: a sensor of the catalogue (strapdown sensors), or a .toml file of "
    "your own."
)

SENSOR_MODEL = with_what("NAME|FILE", SENSOR)
LONGITUDE = with_what("DEG", "Longitude, east positive.")
HEIGHT = with_what("M", "Height over the ellipsoid (0).")
TOKEN = running(
    "WORD",
    "With --live udp://…: what a command in a datagram must carry, command,WORD,TOKEN; "
    "by default one is drawn and shown.",
)
RECOVER = running(
    "DIR",
    "Finish a --live run that was killed, from the folder OUT-received that it left; "
    "with --live, continue it.",
)


@dataclass(frozen=True)
class LogFlags:
    """Part of a log to use, and how to read it."""

    from_s: float | None = reading("S", BEGIN.format("the first"), "--from")
    to_s: float | None = reading("S", END, "--to")
    duration: float | None = reading("S", LENGTH, "--duration")
    rate: float | None = reading("HZ", "Sample rate in Hz, for logs without a time column.")
    sampling: str | None = reading(
        "KIND", "instantaneous (the rate at the stamp) or mean (over the interval that ends there)."
    )
    format: str | None = reading(
        "FORMAT", "Format of the log (strapdown modules), if it is not found."
    )
    columns: list[str] | None = reading(
        "Q=NAME",
        "time=t,gyro_x=wx,… ; a number counts columns from 1; -NAME reverses one; gyro=NAME "
        "for an array of three.",
    )
    gyro_unit: str | None = reading(
        "UNIT", "rad/s, deg/s, …; of raw counts deg/s/131; rad, deg: increments."
    )
    accel_unit: str | None = reading(
        "UNIT",
        "m/s2, g, mg; -g or -m/s2 for the other sign (iOS); of raw counts g/16384; m/s: "
        "increments.",
    )
    time_unit: str | None = reading("UNIT", "s, ms, us, ns.")
    axes: str | None = reading(
        "X,Y,Z",
        "Sensor axes that point forward, right, down: 'x,-y,-z'; or where x, y, z point: "
        "forward-left-up.",
    )
    repair: bool = reading(
        None,
        "Drop rows that cannot be used, unwrap the clock, and report both.",
        "--repair",
        default=False,
    )
    calibration: Path | None = reading(
        "FILE.toml", "Take off the errors that strapdown calibrate found, of the same sensor."
    )

    def given(self) -> dict[str, Any]:
        """By name of the flag, None where not given."""
        return {**asdict(self), "repair": self.repair or None}


@dataclass(frozen=True)
class FixFlags:
    """How to read the fixes: of their own file, or of the log that has them."""

    gnss_format: str | None = fixes(
        "FORMAT", "Format of the fixes (strapdown modules), if it is not found."
    )
    gnss_columns: list[str] | None = fixes(
        "Q=NAME",
        "time=t,lat=y,lon=x,alt=h,VN=… ; a number counts columns from 1; local positions are "
        "north, east, up, those of the Earth ecef_x, ecef_y, ecef_z.",
    )
    gnss_units: list[str] | None = fixes(
        "Q=UNIT", "Units of columns: time=ms,lat=rad,alt=ft,speed=km/h."
    )
    gnss_datum_height: float | None = fixes(
        "M",
        "Height over the ellipsoid of the level that heights are counted from: the geoid "
        "(heights over the sea), or the point of take-off.",
    )
    gnss_origin: str | None = fixes(
        "LAT,LON,HEIGHT",
        "Origin of local positions, or where velocities without positions begin, deg, deg, m "
        "over the ellipsoid; or the UTM zone: 33N.",
    )

    gnss_position_sd: float | None = fixes(
        "M", "Standard deviation of each position, in place of those of the file."
    )
    gnss_velocity_sd: float | None = fixes(
        "M/S", "Standard deviation of each velocity, in place of those of the file."
    )

    def given(self) -> dict[str, Any]:
        """By name of the flag, None where not given."""
        return asdict(self)


def flag_of(name: str) -> str:
    """The flag of a parameter of a command."""
    return "--" + name.removesuffix("_s").replace("_", "-")


#: Keys of ``[log]``, and of a table of fixes, by the names of their flags.
LOG_KEYS = {f.name: f.name for f in fields(LogFlags) if f.name != "axes"}
LOG_KEYS |= {"rate": "rate_hz", "duration": "duration_s"}
FIX_KEYS = {name: name for name in (f.name.removeprefix("gnss_") for f in fields(FixFlags))}
FIX_KEYS |= {"datum_height": "datum_height_m", "position_sd": "position_sd_m"}
FIX_KEYS |= {"velocity_sd": "velocity_sd_m_per_s"}


def fix_keys(given: Mapping[str, Any], path: Path | None) -> dict[str, Any]:
    """Keys of a table of fixes by the flags, without those not given; empty without any.

    `given`: as `FixFlags.given`; other entries are ignored. `path`: of the fixes. ConfigError: an
    option has another form.
    """
    keys = {key: given[f"gnss_{name}"] for name, key in FIX_KEYS.items()}
    for key in ("columns", "units"):
        keys[key] = _pairs(keys[key], f"--gnss-{key}") or None
    keys |= {"path": None if path is None else str(path), "origin": _origin_or_zone(keys["origin"])}
    return {key: value for key, value in keys.items() if value is not None}


def _pairs(items: list[str] | None, flag: str) -> dict[str, str]:
    out: dict[str, str] = {}
    for item in (part for text in items or [] for part in text.split(",") if part.strip()):
        quantity, equals, value = (piece.strip() for piece in item.partition("="))
        if not equals or not value:
            raise ConfigError("io.no-form-understood", quantity=flag, item=item)
        out[quantity] = value
    return out


def as_origin(text: str | None, flag: str) -> tuple[float, float, float] | None:
    """Latitude, longitude and height of an option; ConfigError: it has another form."""
    if text is None:
        return None
    try:
        lat, lon, height = (float(part) for part in text.split(","))
    except ValueError:
        raise ConfigError("cli.bad-origin", quantity=flag, text=text) from None
    return lat, lon, height


def _origin_or_zone(text: str | None) -> tuple[float, float, float] | str | None:
    """Origin of local positions, or the zone of UTM; ConfigError: it is neither."""
    zone = text is not None and "," not in text
    return text if zone else as_origin(text, "--gnss-origin")


def log_keys(given: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of a configuration's ``[log]`` by the flags.

    `given`: as `LogFlags.given`; other entries are ignored. ConfigError: a column name or the part
    of the log is invalid.
    """
    from strapdown.formats.columns import parse_column_option
    from strapdown.systems.inputs import check_part

    check_part(given["from_s"], given["to_s"], given["duration"])
    keys = {key: given[name] for name, key in LOG_KEYS.items()}
    keys["columns"] = parse_column_option(given["columns"] or [])
    keys["repair"] = bool(given["repair"])
    keys["calibration"] = None if given["calibration"] is None else str(given["calibration"])
    return keys


def folder_to_make(name: str, default: Path | None = None) -> Any:
    """The option ``--out`` of a command that creates a folder, with its default name."""
    return writing("DIR", f"Folder to make ({name}).", default=default)


FORCE = writing(None, "Overwrite an existing result.", "--force", default=False)


#: Lowest level of shown log messages, by the flag that asks for it.
LEVELS = {"quiet": logging.ERROR, "verbose": logging.INFO}


def set_level(flag: typer.CallbackParam, asked: bool) -> bool:
    """Set the lowest level of shown log messages, where a flag asks for it."""
    if asked:
        logging.getLogger("strapdown").setLevel(LEVELS[str(flag.name)])
    return asked


QUIET = writing(None, "Print errors only.", "--quiet", "-q", callback=set_level, default=False)
VERBOSE = writing(
    None,
    "Print each stage with its duration, which reader took which file, and all tables.",
    "--verbose",
    "-v",
    callback=set_level,
    default=False,
)


JSON = writing(None, "Print the result as JSON alone.", "--json", default=False)


@dataclass(frozen=True)
class WriteFlags:
    """Whether to replace an existing result, and whether to print."""

    force: bool = FORCE
    quiet: bool = QUIET
    verbose: bool = VERBOSE


@dataclass(frozen=True)
class OutFlags:
    """`WriteFlags` for a command that can print its result as JSON."""

    force: bool = FORCE
    json: bool = JSON
    quiet: bool = QUIET
    verbose: bool = VERBOSE


@dataclass(frozen=True)
class ReportFlags:
    """`OutFlags` for a command that writes a report."""

    no_report: bool = writing(
        None,
        "Write no page and no figures: the data, the findings and the seal alone, which "
        "strapdown verify repeats likewise.",
        "--no-report",
        default=False,
    )
    force: bool = FORCE
    json: bool = JSON
    quiet: bool = QUIET
    verbose: bool = VERBOSE


def spread(command: Callable[..., None]) -> Callable[..., None]:
    """Expand the option sets of a command into separate flags.

    `command`: some of its parameters are of a dataclass whose fields are options. Returns the same
    command with a parameter for each option instead of the set.
    """
    hints = get_type_hints(command)
    hints.pop("return", None)
    sets: dict[str, Any] = {name: kind for name, kind in hints.items() if is_dataclass(kind)}
    laid_out: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(command).parameters.items():
        if name not in sets:
            laid_out.append(parameter.replace(annotation=hints[name]))
            continue
        options = get_type_hints(sets[name])
        laid_out += [
            parameter.replace(name=f.name, annotation=options[f.name], default=f.default)
            for f in fields(sets[name])
        ]

    @wraps(command)
    def run(**given: Any) -> None:
        made = {
            name: kind(**{f.name: given.pop(f.name) for f in fields(kind)})
            for name, kind in sets.items()
        }
        command(**given, **made)

    # Signature for typer; that of the command itself has the sets.
    told: Any = run
    del told.__wrapped__
    told.__signature__ = inspect.Signature(laid_out)
    told.__annotations__ = {p.name: p.annotation for p in laid_out}
    return run


# --- flags as keys of a specification --------------------------------------------------

#: How a log is read; common to all commands.
LOG_FLAGS = {"axes, axes": "--axes", **{f"log, {k}": flag_of(n) for n, k in LOG_KEYS.items()}}


def fix_flags(table: str) -> dict[str, str]:
    """Flags of the fixes by key path, under the table that has them."""
    return {f"{table}, {key}": flag_of(f"gnss_{name}") for name, key in FIX_KEYS.items()}


def flags_by_key(options: type, table: str = "") -> dict[str, str]:
    """Flags of a set of options that are named by the keys of a table, by key path."""
    own: dict[str, Any] = {f.name: f.default for f in fields(options)}
    return {f"{table}{n}": (*made.param_decls, flag_of(n))[0] for n, made in own.items()}


def refuse_beside_file(
    source: Path,
    given: Mapping[str, Any],
    flags: Mapping[str, str],
) -> None:
    """Refuse options beside a configuration file, and name the key for each.

    `given`: by flag, None where not given. `flags`: flags by key path of the specification.
    """
    written = [name for name, value in given.items() if value is not None]
    if not written:
        return
    flag = flag_of(written[0])
    place = next((place for place, name in flags.items() if name == flag), None)
    if place is None:
        raise ConfigError("cli.option-beside-file", file=source.name, quantity=flag)
    table, key = place.rsplit(", ", 1)
    entry = f'{key} = "rts"' if flag == "--smooth" else key
    table = table.replace(", ", ".")
    raise ConfigError(
        "cli.option-of-key-beside-file", file=source.name, quantity=flag, entry=entry, table=table
    )


def missing_argument(name: str) -> typer.BadParameter:
    """Return the error of an argument that only ``--recover`` replaces."""
    return typer.BadParameter("missing argument; only --recover does without", param_hint=name)


def refuse_without_live(given: Mapping[str, Any]) -> None:
    """Refuse options that only a live run has; `given`: by flag, None where not given."""
    for flag, value in given.items():
        if value is not None:
            raise ConfigError("live.only-with", option=flag, beside="--live")


def as_flag(
    error: ConfigError,
    flags: Mapping[str, str],
    otherwise: Callable[[str], str] = lambda place: LOG_FLAGS.get(f"log, {place}", place),
) -> ConfigError:
    """Return the error, or each of several, with the option instead of the key path.

    `flags`: flags by key path of a specification, beside those of a log; `otherwise`: flag of
    another path.
    """
    known = {**LOG_FLAGS, **flags}

    def flag(place: str) -> str:
        return known.get(place) or otherwise(place)

    if error.finding.code == "config.several":
        faults = [
            f.replace(quantity=flag(f.quantity)) if f.quantity else f
            for f in error.finding.data["faults"]
        ]
        return error.replaced(faults=faults)
    quantity = error.finding.quantity
    return error.replaced(quantity=flag(quantity)) if quantity else error


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
