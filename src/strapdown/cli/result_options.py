"""Options of commands that write a result: how the folder is written, and what is printed."""

from __future__ import annotations

from typing import Annotated

import typer

__all__ = ["RESULT_PANEL", "Force", "Json", "Quiet"]

RESULT_PANEL = "What to write"

Force = Annotated[
    bool,
    typer.Option("--force", help="Replace a result that is there.", rich_help_panel=RESULT_PANEL),
]
Json = Annotated[
    bool,
    typer.Option("--json", help="Print the result as JSON alone.", rich_help_panel=RESULT_PANEL),
]
Quiet = Annotated[
    bool,
    typer.Option("--quiet", "-q", help="Print nothing but errors.", rich_help_panel=RESULT_PANEL),
]
