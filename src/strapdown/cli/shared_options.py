"""Options common to several commands, with the same words, order and group everywhere.

A command takes a set of options as one parameter (`LogFlags`, `OutFlags`); `spread` expands it
into separate flags.
"""

from __future__ import annotations

import inspect
import logging
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields, is_dataclass
from functools import wraps
from typing import Annotated, Any, get_type_hints

import typer

__all__ = [
    "LOG_PANEL",
    "OUT_PANEL",
    "RUN_PANEL",
    "WITH_PANEL",
    "Json",
    "LogFlags",
    "OutFlags",
    "Quiet",
    "Verbose",
    "WriteFlags",
    "folder_to_make",
    "log_keys",
    "part_from",
    "part_long",
    "part_to",
    "spread",
]

LOG_PANEL = "How to read the log"
RUN_PANEL = "What to run"
WITH_PANEL = "Where, and with what"
OUT_PANEL = "What to write"


def part_from(else_from: str, panel: str) -> Any:
    """The option ``--from``, with the default begin of a part."""
    return typer.Option(
        "--from",
        metavar="S",
        help=f"Begin at this stamp; {else_from}, if not given.",
        rich_help_panel=panel,
    )


def part_to(panel: str) -> Any:
    """The option ``--to``."""
    return typer.Option(
        "--to",
        metavar="S",
        help="End at this stamp; the last, if not given.",
        rich_help_panel=panel,
    )


def part_long(panel: str) -> Any:
    """The option ``--duration``."""
    return typer.Option(
        "--duration",
        metavar="S",
        help="Length of the part to use, instead of --to.",
        rich_help_panel=panel,
    )


@dataclass(frozen=True)
class LogFlags:
    """Part of a log to use, and how to read it."""

    from_s: Annotated[float | None, part_from("the first", LOG_PANEL)] = None
    to_s: Annotated[float | None, part_to(LOG_PANEL)] = None
    duration: Annotated[float | None, part_long(LOG_PANEL)] = None
    rate: Annotated[
        float | None,
        typer.Option(
            metavar="HZ",
            help="Sample rate in Hz, for logs without a time column.",
            rich_help_panel=LOG_PANEL,
        ),
    ] = None
    sampling: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help="instantaneous (the rate at the stamp) or mean (over the interval that ends "
            "there).",
            rich_help_panel=LOG_PANEL,
        ),
    ] = None
    columns: Annotated[
        list[str] | None,
        typer.Option(
            metavar="Q=NAME",
            help="time=t,gyro_x=wx,… ; a number counts columns from 1; gyro=NAME for an array of "
            "three.",
            rich_help_panel=LOG_PANEL,
        ),
    ] = None
    gyro_unit: Annotated[
        str | None,
        typer.Option(
            metavar="UNIT",
            help="rad/s, deg/s, …; of raw counts deg/s/131; rad, deg: increments.",
            rich_help_panel=LOG_PANEL,
        ),
    ] = None
    accel_unit: Annotated[
        str | None,
        typer.Option(
            metavar="UNIT",
            help="m/s2, g, mg; -g or -m/s2 for the other sign (iOS); of raw counts g/16384; m/s: "
            "increments.",
            rich_help_panel=LOG_PANEL,
        ),
    ] = None
    time_unit: Annotated[
        str | None, typer.Option(metavar="UNIT", help="s, ms, us, ns.", rich_help_panel=LOG_PANEL)
    ] = None
    axes: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z",
            help="Sensor axes that point forward, right, down: 'x,-y,-z'; or where x, y, z point: "
            "forward-left-up.",
            rich_help_panel=LOG_PANEL,
        ),
    ] = None
    repair: Annotated[
        bool,
        typer.Option(
            "--repair",
            help="Leave out rows that cannot be used, undo a wrapped clock, and say so.",
            rich_help_panel=LOG_PANEL,
        ),
    ] = False

    def given(self) -> dict[str, Any]:
        """By name of the flag, None where not given."""
        return {**asdict(self), "repair": self.repair or None}


def log_keys(given: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of a configuration's ``[log]`` by the flags.

    Parameters
    ----------
    given : mapping
        As `LogFlags.given`; other entries are ignored.

    Returns
    -------
    dict

    Raises
    ------
    ConfigError
        A column name or the part of the log is invalid.
    """
    from strapdown.formats.columns import parse_column_option
    from strapdown.systems.inputs import check_part

    check_part(given["from_s"], given["to_s"], given["duration"])
    return {
        "columns": parse_column_option(given["columns"] or []),
        "gyro_unit": given["gyro_unit"],
        "accel_unit": given["accel_unit"],
        "time_unit": given["time_unit"],
        "sampling": given["sampling"],
        "rate_hz": given["rate"],
        "repair": bool(given["repair"]),
        "from_s": given["from_s"],
        "to_s": given["to_s"],
        "duration_s": given["duration"],
    }


def folder_to_make(name: str) -> Any:
    """The option ``--out`` of a command that creates a folder, with its default name."""
    return typer.Option(
        metavar="DIR",
        help=f"Folder to make ({name}).",
        rich_help_panel=OUT_PANEL,
        show_default=False,
    )


Force = Annotated[
    bool,
    typer.Option("--force", help="Overwrite an existing result.", rich_help_panel=OUT_PANEL),
]


def log_level(level: int) -> Callable[[bool], bool]:
    """Callback of a flag that sets the lowest level of shown log messages."""

    def shown(asked: bool) -> bool:
        if asked:
            logging.getLogger("strapdown").setLevel(level)
        return asked

    return shown


Quiet = Annotated[
    bool,
    typer.Option(
        "--quiet",
        "-q",
        help="Print nothing but errors.",
        rich_help_panel=OUT_PANEL,
        callback=log_level(logging.ERROR),
    ),
]
Verbose = Annotated[
    bool,
    typer.Option(
        "--verbose",
        "-v",
        help="Print each stage with its duration, which reader took which file, and all tables.",
        rich_help_panel=OUT_PANEL,
        callback=log_level(logging.INFO),
    ),
]


Json = Annotated[
    bool,
    typer.Option("--json", help="Print the result as JSON alone.", rich_help_panel=OUT_PANEL),
]


@dataclass(frozen=True)
class WriteFlags:
    """Whether to replace an existing result, and whether to print."""

    force: Force = False
    quiet: Quiet = False
    verbose: Verbose = False


@dataclass(frozen=True)
class OutFlags:
    """`WriteFlags` for a command that can print its result as JSON."""

    force: Force = False
    json: Json = False
    quiet: Quiet = False
    verbose: Verbose = False


def spread(command: Callable[..., None]) -> Callable[..., None]:
    """Expand the option sets of a command into separate flags.

    Parameters
    ----------
    command : callable
        Some of its parameters are of a dataclass whose fields are options.

    Returns
    -------
    callable
        The same command with a parameter for each option instead of the set.
    """
    hints = get_type_hints(command, include_extras=True)
    hints.pop("return", None)
    sets: dict[str, Any] = {name: kind for name, kind in hints.items() if is_dataclass(kind)}
    laid_out: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(command).parameters.items():
        if name not in sets:
            laid_out.append(parameter.replace(annotation=hints[name]))
            continue
        options = get_type_hints(sets[name], include_extras=True)
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
