"""Options that say how a log is read: the same in every command that reads one."""

from __future__ import annotations

from typing import Annotated

import typer

__all__ = [
    "LOG_PANEL",
    "AccelUnit",
    "Axes",
    "Columns",
    "GyroUnit",
    "Rate",
    "Repair",
    "Sampling",
    "TimeUnit",
]

LOG_PANEL = "How to read the log"

Rate = Annotated[
    float | None,
    typer.Option(metavar="HZ", help="Of a log without a time column.", rich_help_panel=LOG_PANEL),
]
Sampling = Annotated[
    str | None,
    typer.Option(
        metavar="KIND",
        help="instantaneous (the rate at the stamp) or mean (over the interval that ends there).",
        rich_help_panel=LOG_PANEL,
    ),
]
Columns = Annotated[
    list[str] | None,
    typer.Option(
        metavar="Q=NAME",
        help="time=t,gyro_x=wx,… ; a number counts columns from 1; gyro=NAME for an array of "
        "three.",
        rich_help_panel=LOG_PANEL,
    ),
]
GyroUnit = Annotated[
    str | None,
    typer.Option(
        metavar="UNIT",
        help="rad/s, deg/s, …; of raw counts deg/s/131; rad, deg: increments.",
        rich_help_panel=LOG_PANEL,
    ),
]
AccelUnit = Annotated[
    str | None,
    typer.Option(
        metavar="UNIT",
        help="m/s2, g, mg; -g or -m/s2 for the other sign (iOS); of raw counts g/16384; m/s: "
        "increments.",
        rich_help_panel=LOG_PANEL,
    ),
]
TimeUnit = Annotated[
    str | None, typer.Option(metavar="UNIT", help="s, ms, us, ns.", rich_help_panel=LOG_PANEL)
]
Axes = Annotated[
    str | None,
    typer.Option(
        metavar="X,Y,Z",
        help="Sensor axes that point forward, right, down: 'x,-y,-z'; or where x, y, z point: "
        "forward-left-up.",
        rich_help_panel=LOG_PANEL,
    ),
]
Repair = Annotated[
    bool,
    typer.Option(
        "--repair",
        help="Leave out rows that cannot be used, undo a wrapped clock, and say so.",
        rich_help_panel=LOG_PANEL,
    ),
]
