"""``strapdown verify``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from strapdown.cli.shared_options import Json, Quiet, Verbose

EPILOG = "Example: strapdown verify alexiev-fig4-attitude"
CHANGED = 6


def verify(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A folder that a run wrote.")],
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Run a result again from its own configuration and compare it bit for bit.

    Answers identical, numerically equal within a number (another processor or version), or
    changed, and names what. Exit code 6 where it has changed, with --quiet, too.
    """
    from strapdown.bundle import to_json
    from strapdown.cli.console import console, progress
    from strapdown.report.verify import verify as check

    with progress(quiet or json) as report:
        report("running it again", 0.5)
        result = check(folder)
    if json:
        finite = result.within if result.within < float("inf") else None
        typer.echo(to_json({**vars(result), "within": finite}), nl=False)
    elif not quiet:
        out = console()
        style = {"identical": "bold green", "numerically equal": "bold yellow"}
        within = f" within {result.within:.1e}" if result.verdict == "numerically equal" else ""
        out.print(f"{result.verdict}{within}", style=style.get(result.verdict, "bold red"))
        for line in result.details:
            out.print(f"  {line}")
        out.print(f"Seal  sha256 {result.digest}")
    if result.verdict == "changed":
        raise typer.Exit(CHANGED)
