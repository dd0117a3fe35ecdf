"""Terminal output of ``strapdown attitude``."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console

    from strapdown.report.document import TableBlock
    from strapdown.results.attitude_bench import AttitudeBench


MOST_LINES = 8


def print_bench(bench: AttitudeBench) -> None:
    """Print the input of the run, its tables, and the answer last, where it is visible.

    Parameters
    ----------
    bench : AttitudeBench
    """
    from strapdown.cli.console import console, print_table
    from strapdown.report import attitude_tables as tables
    from strapdown.report import attitude_words as words
    from strapdown.report.attitude_tables import offer_lines, place_table

    page = console()
    if bench.trials is not None:
        count = len(bench.trials.names)
        page.print(f"First of {count} trials; the answer and the errors by rate hold for all:")
    page.print(bench.source, style="bold")
    if bench.readings:
        page.print("Read as:")
        print_table(
            ["column", "taken as", "unit", "first value"],
            [[r.source, r.quantity, r.unit, words.first_value(r)] for r in bench.readings],
        )
    for name, text in words.facts(bench):
        page.print(f"{name}: {text}")
    shown = [
        *tables.result_tables(bench),
        *tables.sweep_tables(bench),
        tables.trial_table(bench),
        place_table(bench),
        tables.peer_table(bench),
    ]
    for table in shown:
        if table is not None:
            _print(table, page)
    points = words.reference_lines(bench)
    for point in points[:MOST_LINES]:
        page.print(point)
    if len(points) > MOST_LINES:
        page.print(f"and {len(points) - MOST_LINES} more reference points, in the report")
    page.print(bench.answer.sentence, style="bold")
    page.print(words.standing(bench))
    for title, lines in (("Why", bench.answer.why), ("What would help", bench.answer.helps)):
        if lines:
            page.print(f"{title}:")
        for line in lines:
            page.print(f"  - {line}")
    if not bench.scores:
        page.print(words.HOW_TO_REFERENCE)
    if offers := offer_lines(bench):
        page.print("These rests look alike, and could be reference points:")
    for line in offers:
        page.print(f"  {line}")


def print_speed(taken: pd.DataFrame) -> None:
    """Print the time per sample of each algorithm on this machine.

    Parameters
    ----------
    taken : DataFrame
        From `attitude.speed.time_algorithms`.
    """
    from strapdown.cli.console import console, print_table

    console().print("\nTime of a sample on this machine")
    print_table(
        ["algorithm", "float64, ns", "float32, ns"],
        [[str(a), f"{d:.3g}", f"{f:.3g}"] for a, d, f in taken.itertuples(index=False)],
    )


def _print(table: TableBlock, page: Console) -> None:
    from strapdown.cli.console import print_table

    page.print(f"\n{table.title}", style="bold")
    print_table(table.columns, table.rows, text=table.text, strong=table.strong)
    if table.caption:
        page.print(table.caption, style="dim")
