"""Terminal output of ``strapdown navigate``."""

from __future__ import annotations

from dataclasses import replace

from strapdown.cli.console import console, print_block
from strapdown.report.document import TableBlock
from strapdown.report.navigation_found import examine, told_of
from strapdown.report.navigation_tables import (
    end_table,
    error_table,
    observation_table,
    outage_table,
    point_table,
    state_table,
    withheld_table,
)
from strapdown.report.navigation_trust import trust
from strapdown.report.navigation_words import cautions, headline
from strapdown.report.values import duration_words, spaced
from strapdown.report.verdict_words import terminal_lines
from strapdown.systems.navigation_run import NavigationResult

__all__ = ["print_navigation"]

# Most rows of a table on the terminal; the report has all.
_MOST = 12


def print_navigation(result: NavigationResult) -> None:
    """Print the final state of a run, its uncertainty, and the warnings."""
    out = console()
    found = examine(told_of(result))
    time = result.record.trajectory.index
    out.print(
        f"{result.source.name}: {result.source.what}, "
        f"{spaced(duration_words(float(time[-1] - time[0])))}, {len(time)} samples"
    )
    tables = (
        end_table(found),
        error_table(found),
        point_table(found),
        observation_table(found),
        outage_table(found),
        withheld_table(found),
        state_table(found),
    )
    for block in tables:
        if block is not None:
            _print(block)
    out.print(spaced(headline(found)), style="bold")
    verdict = trust(found)
    style = {"trusted": "green", "reserve": "yellow", "distrusted": "bold red"}[verdict.verdict]
    out.print(spaced(verdict.sentence), style=style)
    for head, text in cautions(found):
        out.print(spaced(f"  - {head}: {text}"))
    for text, style in terminal_lines(result):
        out.print(spaced(text), style=style)


def _print(block: TableBlock) -> None:
    print_block(replace(block, rows=block.rows[:_MOST]))
    if len(block.rows) > _MOST:
        console().print(f"  {len(block.rows) - _MOST} more rows; all of them are in the report")
