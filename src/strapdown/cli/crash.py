"""``strapdown crash``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from strapdown.cli.shared_options import OutFlags, folder_to_make, spread

if TYPE_CHECKING:
    from strapdown.crash.case import CaseResult

EPILOG = "Example: strapdown crash case.toml (strapdown init crash RECORD writes one)"


@spread
def crash(
    case: Annotated[
        Path, typer.Argument(metavar="CASE.toml", help="The case; strapdown init crash writes one.")
    ],
    *,
    out: Annotated[Path | None, folder_to_make("CASE-crash")] = None,
    write: OutFlags,
) -> None:
    """Reconstruct a crash: delta-V, direction of force, severity and path, each with its bound.

    Reads the records that the case names and writes a report (HTML and PDF), JSON, CSV and
    figures, sealed so that any change is found.
    """
    from strapdown.api.crash import reconstruct
    from strapdown.bundle.seal import check_destination, write_timing
    from strapdown.cli.console import (
        WORDS,
        Stopwatch,
        console,
        print_findings,
        print_seal,
        progress,
    )
    from strapdown.cli.result_folder import default_folder, refuse_result

    refuse_result(case, "case")
    folder = out or default_folder(case, "crash")
    check_destination(folder, write.force)
    WORDS.set("file")
    with progress(write.quiet or write.json) as show:
        report = Stopwatch(show)
        result = reconstruct(case, progress=report)
        seal = result.save(folder, force=write.force, progress=report)
        report.stop()
        write_timing(seal, report.seconds)
    if write.json:
        typer.echo((seal.path / "crash.json").read_text(encoding="utf-8"), nl=False)
        return
    if write.quiet:
        return
    console().print(result.spec.title, style="bold")
    print_crash(result)
    print_findings(result.findings)
    print_seal(seal, "report.html")


def print_crash(result: CaseResult) -> None:
    """Print the results of a case, and their limits."""
    from strapdown.cli.console import console, print_block
    from strapdown.report.crash_tables import answers_table, comparison_table, path_table
    from strapdown.report.crash_words import headline, limitations
    from strapdown.report.values import spaced

    out = console()
    for block in (answers_table(result), path_table(result), comparison_table(result)):
        if block is not None and block.rows:
            print_block(block)
    out.print(spaced(headline(result)), style="bold")
    found = limitations(result)
    if found:
        out.print("\nLimitations (details in the report):")
        for _, head, _ in found:
            out.print(f"  - {spaced(head)}")
