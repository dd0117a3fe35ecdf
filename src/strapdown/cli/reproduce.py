"""``strapdown reproduce``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

EPILOG = "Example: strapdown reproduce alexiev --out alexiev"


def reproduce(
    paper: Annotated[
        str,
        typer.Argument(
            metavar="PAPER",
            help="alexiev: Alexiev (2021); tadic: Tadic (2016); chernodarov: Chernodarov (2009).",
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder to make (PAPER-reproduced).")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a result that is there.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print the result as JSON alone.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Re-make a paper: its figures, and a verdict on each of its statements.

    Simulated throughout: the same numbers every time. Writes a page, its figures and JSON.
    """
    from strapdown.bundle.destination import check_destination
    from strapdown.bundle.timing import write_timing
    from strapdown.cli.console import Stopwatch, console, print_seal, print_table, progress
    from strapdown.report.reproduction import (
        make_reproduction,
        reproduction_specification,
        verdict_words,
        write_reproduction,
    )

    spec = reproduction_specification(paper)
    folder = out or Path(f"{spec.paper}-reproduced")
    check_destination(folder, force)
    with progress(quiet or json) as show:
        report = Stopwatch(show)
        made = make_reproduction(spec, report)
        report("writing", 0.9)
        seal = write_reproduction(made, folder, force=force)
        report.stop()
        write_timing(seal, report.seconds)
    if json:
        typer.echo((seal.path / "reproduction.json").read_text(encoding="utf-8"), nl=False)
        return
    if quiet:
        return
    page = console()
    page.print(made.paper)
    print_table(
        ["statement", "where", "verdict"],
        [[s.key, s.place, verdict_words(s)] for s in made.statements],
    )
    page.print(made.headline, style="bold")
    print_seal(seal, "report.html")
