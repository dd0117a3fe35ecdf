"""``strapdown reproduce``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from strapdown.cli.shared_options import OutFlags, folder_to_make, spread

EPILOG = "Example: strapdown reproduce alexiev --out alexiev"


@spread
def reproduce(
    paper: Annotated[
        str,
        typer.Argument(
            metavar="PAPER",
            help="alexiev: Alexiev (2021); tadic: Tadic (2016); chernodarov: Chernodarov (2009).",
        ),
    ],
    *,
    out: Annotated[Path | None, folder_to_make("PAPER-reproduced")] = None,
    write: OutFlags,
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
    check_destination(folder, write.force)
    with progress(write.quiet or write.json) as show:
        report = Stopwatch(show)
        made = make_reproduction(spec, report)
        report("writing", 0.9)
        seal = write_reproduction(made, folder, force=write.force)
        report.stop()
        write_timing(seal, report.seconds)
    if write.json:
        typer.echo((seal.path / "reproduction.json").read_text(encoding="utf-8"), nl=False)
        return
    if write.quiet:
        return
    page = console()
    page.print(made.paper)
    print_table(
        ["statement", "where", "verdict"],
        [[s.key, s.place, verdict_words(s)] for s in made.statements],
    )
    page.print(made.headline, style="bold")
    print_seal(seal, "report.html")
