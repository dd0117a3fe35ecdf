"""Terminal output of ``strapdown coast``."""

from __future__ import annotations

from strapdown.cli.console import console, print_block
from strapdown.report.coast_document import budget_table, drift_table, time_table
from strapdown.report.coast_words import headline, inside_words, motion_words, remedy, start_words
from strapdown.report.values import spaced
from strapdown.systems.outage_run import CoastResult

__all__ = ["print_coast"]


def print_coast(result: CoastResult) -> None:
    """Print the predicted drift, its sources, and the measured drifts."""
    out = console()
    out.print(spaced(f"{result.name}: {result.what}; {motion_words(result)}"))
    out.print(spaced(f"At the start: {start_words(result)}"))
    if result.stays:
        out.print(f"Aids that stay: {', '.join(result.stays)}")
    for block in (time_table(result), budget_table(result), drift_table(result)):
        if block is not None:
            print_block(block)
    out.print(spaced(headline(result)), style="bold")
    out.print(spaced(remedy(result)), style="yellow")
    if inside_words(result):
        out.print(spaced(inside_words(result)))
