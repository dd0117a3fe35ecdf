"""Terminal output of ``strapdown crash``."""

from __future__ import annotations

from strapdown.cli.console import console, print_block
from strapdown.crash.case import CaseResult
from strapdown.report.crash_tables import answers_table, comparison_table, path_table
from strapdown.report.crash_words import headline, limitations
from strapdown.report.values import spaced

__all__ = ["print_crash"]


def print_crash(result: CaseResult) -> None:
    """Print the results of a case, and their limits."""
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
