"""``strapdown crash``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

EPILOG = "Example: strapdown init crash record.csv, then strapdown crash case.toml"


def crash(
    case: Annotated[
        Path, typer.Argument(metavar="CASE.toml", help="The case; strapdown init crash writes one.")
    ],
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder to make (CASE-crash).")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a result that is there.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print the result as JSON alone.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Reconstruct a crash: delta-V, direction of force, severity and path, each with its bound.

    Reads the records that the case names and writes a report (HTML and PDF), JSON, CSV and
    figures, sealed so that any change is found.
    """
    from strapdown.bundle.destination import check_destination
    from strapdown.bundle.timing import write_timing
    from strapdown.cli.console import Stopwatch, console, print_findings, print_seal, progress
    from strapdown.cli.crash_tables import print_crash
    from strapdown.config.crash_case_file import read_case_spec
    from strapdown.report.crash_case import write_crash
    from strapdown.systems.crash_case import run_case

    folder = out or Path(f"{case.resolve().stem}-crash")
    check_destination(folder, force)
    spec = read_case_spec(case)
    with progress(quiet or json) as show:
        report = Stopwatch(show)
        result = run_case(spec, case, report)
        seal = write_crash(result, folder, force=force, progress=report)
        report.stop()
        write_timing(seal, report.seconds)
    if json:
        typer.echo((seal.path / "crash.json").read_text(encoding="utf-8"), nl=False)
        return
    if quiet:
        return
    console().print(spec.title, style="bold")
    print_crash(result)
    print_findings(result.findings)
    print_seal(seal, "report.html")
