"""What commands share: where they print, tables, and progress."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from time import perf_counter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

    from strapdown.bundle import Seal
    from strapdown.exceptions import Finding


# Redirected output has no width of its own; a table is then as wide as it is.
PIPE_WIDTH = 160


def console(*, err: bool = False) -> Console:
    """A console that takes no text from outside for markup."""
    from rich.console import Console

    class QuietlyPiped(Console):
        """Ends with success when the reader has gone, as with ``| head``."""

        def on_broken_pipe(self) -> None:
            try:
                super().on_broken_pipe()
            except SystemExit:
                sys.exit(0)

    out = QuietlyPiped(stderr=err, markup=False, highlight=False, soft_wrap=True)
    if not out.is_terminal:
        out.width = PIPE_WIDTH
    return out


class Stopwatch:
    """Pass progress on, and keep how long each stage took."""

    def __init__(self, report: Callable[[str, float], None]) -> None:
        self._report = report
        self._stage: tuple[str, float] | None = None
        self.seconds: dict[str, float] = {}

    def __call__(self, stage: str, share: float) -> None:
        """Begin a stage."""
        self.stop()
        self._stage = (stage, perf_counter())
        self._report(stage, share)

    def stop(self) -> None:
        """End the last stage."""
        if self._stage is not None:
            name, start = self._stage
            self.seconds[name] = self.seconds.get(name, 0.0) + perf_counter() - start
        self._stage = None


@contextmanager
def progress(quiet: bool) -> Iterator[Callable[[str, float], None]]:
    """Show the stage and the share done on the terminal, and leave nothing behind."""
    out = console(err=True)
    if quiet or not out.is_terminal:
        yield lambda stage, share: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    with Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TimeElapsedColumn(),
        console=out,
        transient=True,
    ) as bar:
        task = bar.add_task("starting", total=1.0)
        yield lambda stage, share: bar.update(task, description=stage, completed=share)


def print_table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table whose first and last columns are text and the others numbers."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 1), header_style="bold")
    for k, name in enumerate(columns):
        text = k in (0, len(columns) - 1)
        table.add_column(name, justify="left" if text else "right", overflow="fold")
    for row in rows:
        table.add_row(*row)
    console().print(table, soft_wrap=False)


def print_findings(findings: Sequence[Finding]) -> None:
    """Print what a person should know, to stderr."""
    out = console(err=True)
    for finding in findings:
        head, _, remedy = str(finding).partition("\n")
        out.print(f"note: {head}", style="yellow")
        if remedy:
            out.print(remedy, style="dim")


def print_seal(seal: Seal, look_at: str) -> None:
    """Say what was written, what to open, and the seal."""
    out = console()
    out.print(f"\nWrote {seal.path}")
    out.print(f"Open  {seal.path / look_at}")
    out.print(f"Seal  sha256 {seal.digest}")
