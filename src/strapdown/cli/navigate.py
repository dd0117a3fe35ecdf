"""``strapdown navigate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

EPILOG = "Example: strapdown navigate navigate.toml (strapdown init navigate LOG writes one)"
MOST = 6  # findings on the terminal
_OUT = "What to write"


def navigate(
    source: Annotated[
        Path,
        typer.Argument(metavar="CONFIG.toml", help="The file of a run of navigation."),
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder to make (CONFIG-navigate).", rich_help_panel=_OUT),
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Replace a result that is there.", rich_help_panel=_OUT)
    ] = False,
    json: Annotated[
        bool,
        typer.Option("--json", help="Print the result as JSON alone.", rich_help_panel=_OUT),
    ] = False,
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="Print nothing but errors.", rich_help_panel=_OUT)
    ] = False,
) -> None:
    """Find place, velocity and attitude over a record, from inertial sensors and what aids them."""
    from strapdown.bundle import check_destination, write_timing
    from strapdown.cli.console import Stopwatch, print_findings, print_seal, progress
    from strapdown.cli.navigate_tables import print_navigation
    from strapdown.config.navigation_file import read_navigation_spec
    from strapdown.exceptions import Finding
    from strapdown.report.navigation import write_navigation
    from strapdown.systems.sins.run import run_navigation

    folder = out or Path(f"{source.resolve().stem}-navigate")
    check_destination(folder, force)
    with progress(quiet or json) as show:
        report = Stopwatch(show)
        spec = read_navigation_spec(source)
        result = run_navigation(spec, source, report)
        seal = write_navigation(result, folder, force=force, progress=report)
        report.stop()
        write_timing(seal, report.seconds)
    if json:
        typer.echo((seal.path / "navigation.json").read_text(encoding="utf-8"), nl=False)
        return
    if quiet:
        return
    print_navigation(result)
    print_findings(result.findings[:MOST])
    if len(result.findings) > MOST:
        more = f"{len(result.findings) - MOST} more; all of them are in the report"
        print_findings([Finding(more)])
    print_seal(seal, "report.html")
