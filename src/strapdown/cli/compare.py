"""``strapdown compare``."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from strapdown.cli.console import console, print_blocks, print_findings
from strapdown.cli.console import progress as bar
from strapdown.cli.result_folder import run_and_save
from strapdown.cli.shared_options import ReportFlags, spread, writing

if TYPE_CHECKING:
    from strapdown.progress import Progress
    from strapdown.report.compare import RunComparison

EPILOG = (
    "Example: strapdown compare drive-a drive-b --out compared\n\n"
    "Example: strapdown compare drive.toml other.toml"
)
CHANGED = 6


@spread
def compare(
    runs: list[Path] = typer.Argument(
        metavar="RUN...",
        help="Folders of results, of any command; or configurations (.toml) of navigate, align "
        "or crash, which are run first.",
    ),
    *,
    out: Path | None = writing("DIR", "Write a page, the data and the runs into this folder."),
    write: ReportFlags,
) -> None:
    """Show what differs between results: options, inputs, numbers, and positions over time.

    Differences are against the first run, each with its 95 % bound where both have one. A run that
    was changed after it was sealed is named, with exit code 6. The result of a configuration is in
    a temporary folder, and kept only by --out.
    """
    from strapdown.bundle import to_json
    from strapdown.report.compare import compare_results, comparison_json

    def compute(progress: Progress) -> RunComparison:
        return compare_results(runs, progress)

    show = partial(_print, verbose=write.verbose)
    if out is not None:
        result = run_and_save(compute, out, write, "compare.json", show)
    else:
        with bar(write.quiet or write.json) as report:
            result = compute(report)
        if write.json:
            typer.echo(to_json(comparison_json(result)), nl=False)
        elif not write.quiet:
            show(result)
    if result.changed:
        raise typer.Exit(CHANGED)


def _print(result: RunComparison, *, verbose: bool) -> None:
    from strapdown.report import compare_document as page
    from strapdown.report.values import spaced

    out = console()
    out.print(spaced(page.headline(result)), style="bold")
    blocks = (
        ("Options that differ", page.options_block(result)),
        ("Inputs", page.inputs_block(result)),
        ("Versions and platform that differ", page.conditions_block(result)),
        ("Numbers that differ", page.numbers_block(result, every=verbose, short=not verbose)),
        ("Differences over time", page.scores_block(result)),
        ("Findings that not all runs have", page.codes_block(result)),
        ("Time taken, indicative", page.seconds_block(result) if verbose else None),
    )
    for title, block in blocks:
        if block is None:
            continue
        out.print(f"\n{title}", style="bold")
        print_blocks(block, captions=True)
    if not verbose:
        if hidden := page.hidden_numbers(result):
            out.print(f"{hidden} further numbers differ: --verbose, or the page of --out.")
        if said := page.total_words(result):
            out.print(spaced(said))
    print_findings(result.findings)
