"""``make bench``: every ratio of one run in one table; ends with 1 where one is over its limit.

The whole run also writes the table into ``docs/performance.md``.
"""

from __future__ import annotations

import argparse
import platform
import re
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks import commands, crash, filters, kernels, proposed
from benchmarks.measure import Row

#: What `--only` chooses from.
GROUPS: dict[str, Callable[[], Iterator[Row]]] = {
    "start-up": commands.start_up,
    "commands": commands.short_runs,
    "attitude": kernels.attitude,
    "mechanization": kernels.mechanization,
    "prefilter": kernels.prefilter,
    "filter": filters.half_hour,
    "epochs": filters.epochs,
    "hour-drive": commands.hour_drive,
    "crash": crash.monte_carlo,
    "bulk": crash.bulk,
    "reading": commands.text_table,
    "long-runs": commands.long_runs,
    "proposed": proposed.times,
}
HEADINGS = ("what", "ours", "against", "theirs", "ratio", "goal", "limit", "")
PAGE = Path(__file__).parents[1] / "docs" / "performance.md"
BEGIN, END = "<!-- written by make bench -->", "<!-- to here -->"


def machine() -> str:
    """Processor, and what compiled the kernels."""
    from strapdown._kernels.compilation import COMPILER, MODE

    name = platform.processor() or platform.machine()
    about = Path("/proc/cpuinfo")
    if about.exists():
        found = re.search(r"^model name\s*: (.*)$", about.read_text(), flags=re.M)
        name = found.group(1) if found else name
    return f"{name}; kernels by {COMPILER or MODE}"


def write_page(rows: list[Row]) -> None:
    lines = [f"| {' | '.join(HEADINGS)} |", "|---" * len(HEADINGS) + "|"]
    lines += [f"| {' | '.join(row.cells())} |" for row in rows]
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    _, after = rest.split(END)
    table = "\n".join([BEGIN, f"Machine: {machine()}.", "", *lines, END])
    PAGE.write_text(before + table + after, encoding="utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Speed and memory.")
    parser.add_argument("--only", metavar="PATTERN", default="", help=f"of {', '.join(GROUPS)}")
    pattern = re.compile(parser.parse_args().only)
    begun, rows = time.perf_counter(), []
    for name, measured in GROUPS.items():
        if pattern.search(name):
            print(f"{time.perf_counter() - begun:5.0f} s  {name}", file=sys.stderr, flush=True)
            rows += list(measured())
    table = Table(title=f"ours / theirs: median (quartiles)\n{machine()}", title_justify="left")
    for name in HEADINGS:
        table.add_column(name)
    for row in rows:
        table.add_row(*row.cells())
    Console(width=170).print(table)
    if not pattern.pattern:
        write_page(rows)
    over = [row for row in rows if row.verdict == "OVER"]
    for row in over:
        print(f"OVER its limit: {row.what}, against {row.against}: {row.ratios[1]:.2f}")
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main())
