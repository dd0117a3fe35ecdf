"""``make bench``: every ratio of one run in one table."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from benchmarks import (
    answer,
    attitude,
    crash,
    drive30,
    estimation,
    kfgins,
    memory,
    navigation,
    prefilter,
    smoothing,
    start_up,
    text_table,
)


def main() -> None:
    table = Table(title="ours / theirs, medians of alternating runs", title_justify="left")
    for name in ("what", "ours", "against", "theirs", "ratio", "limit", ""):
        table.add_column(
            name, justify="right" if name in ("ours", "theirs", "ratio", "limit") else "left"
        )
    for module in (
        attitude,
        navigation,
        prefilter,
        estimation,
        drive30,
        kfgins,
        smoothing,
        crash,
        answer,
        start_up,
        text_table,
        memory,
    ):
        for row in module.ratios():
            verdict = "" if row.limit is None else "within" if row.value <= row.limit else "OVER"
            table.add_row(
                row.what,
                f"{row.ours:.1f} {row.unit}",
                row.against,
                f"{row.theirs:.1f} {row.unit}",
                f"{row.value:.2f}",
                "–" if row.limit is None else f"{row.limit:.2f}",
                verdict,
            )
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
