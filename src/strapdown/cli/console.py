"""Output common to all commands: consoles, tables, and progress."""

from __future__ import annotations

import json
import logging
import os
import sys
from collections.abc import Callable, Container, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from time import perf_counter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

    from strapdown.bundle import Seal
    from strapdown.errors import Finding, Words
    from strapdown.report.document import TableBlock

_EVENT = "numba:compile"
_log = logging.getLogger("strapdown")

#: Terms of messages: options, or the keys of the file that a command runs.
WORDS: ContextVar[Words] = ContextVar("words", default="cli")
#: Lines held until the command ends.
RESOURCES: ContextVar[ExitStack] = ContextVar("resources")
# Redirected output has no width; its tables are as wide as needed.
PIPE_WIDTH = 160
# A long name with options is wrapped in a table with many columns of numbers.
_NAME_WIDTH, _MANY_COLUMNS = 24, 6


def console(*, err: bool = False) -> Console:
    """Return a console that ignores markup and control characters in external text."""
    from rich.console import Console

    from strapdown.errors import printable

    class QuietlyPiped(Console):
        """Exit with success when the reader has closed the pipe, as with ``| head``."""

        def render_str(self, text: str, **options: Any) -> Text:
            # Everything that is printed passes here, cells of tables, too.
            return super().render_str(printable(text, lines=True), **options)

        def on_broken_pipe(self) -> None:
            try:
                super().on_broken_pipe()
            except SystemExit:
                sys.exit(0)

    out = QuietlyPiped(stderr=err, markup=False, highlight=False, soft_wrap=True)
    if not out.is_terminal:
        out.width = PIPE_WIDTH
    return out


@contextmanager
def logged() -> Iterator[None]:
    """Show messages of the logger on the error stream: warnings, unless a flag sets the level."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(levelname)s: %(message)s"))
    before = _log.level
    _log.addHandler(handler)
    _log.setLevel(logging.WARNING)
    try:
        yield
    finally:
        _log.removeHandler(handler)
        _log.setLevel(before)


class Stopwatch:
    """Pass progress on, and record the duration of each stage."""

    def __init__(self, report: Callable[[str, float], None]) -> None:
        self._report = report
        self._stage: tuple[str, float] | None = None
        self.seconds: dict[str, float] = {}

    def __call__(self, stage: str, share: float) -> None:
        """Begin a stage."""
        self.stop()
        self._stage = (stage, perf_counter())
        self._report(stage, share)

    def within(self, words: str, share: float) -> None:
        """Show how far a stage is."""
        self._report(words, share)

    def stop(self) -> None:
        """End the last stage."""
        if self._stage is not None:
            name, start = self._stage
            taken = perf_counter() - start
            self.seconds[name] = self.seconds.get(name, 0.0) + taken
            _log.info("%s: %.2f s", name, taken)
        self._stage = None


class Compilations:
    """Report begin and end of compilations, once numba is loaded.

    Parameters
    ----------
    report : callable
        Called with True at the begin of the first of nested compilations, with False at its end.
    """

    def __init__(self, report: Callable[[bool], None]) -> None:
        self._report = report
        self._listener: Any = None

    def listen(self) -> None:
        """Start to listen if numba is loaded; this does not load it."""
        if self._listener is not None or "numba.core.event" not in sys.modules:
            return
        from numba.core import event

        tell = self._report

        class Listener(event.Listener):
            depth = 0

            def on_start(self, _: Any) -> None:
                self.depth += 1
                if self.depth == 1:
                    tell(True)

            def on_end(self, _: Any) -> None:
                self.depth -= 1
                if not self.depth:
                    tell(False)

        self._listener = Listener()
        self._events().register(_EVENT, self._listener)

    def stop(self) -> None:
        """Stop listening."""
        if self._listener is not None:
            self._events().unregister(_EVENT, self._listener)
            self._listener = None

    def _events(self) -> Any:
        from numba.core import event

        return event


#: Environment variable with the file to which progress is written, for the program that reads it.
PROGRESS_FILE = "STRAPDOWN_PROGRESS"
#: Time between two lines of it, s, and its length, bytes, beyond which it begins again.
_EVERY, _LONGEST = 0.1, 1 << 16


def tell(said: dict[str, Any]) -> None:
    """Append a line of JSON to the file that the environment names for progress, if it does.

    `said`: ``stage`` and ``share``, ``error``, or ``live``. A run does not fail if it cannot be
    written.
    """
    path = os.environ.get(PROGRESS_FILE)
    if not path:
        return
    with suppress(OSError), open(path, "a", encoding="utf-8") as stream:  # noqa: PTH123
        if stream.tell() > _LONGEST:
            stream.truncate(0)
        stream.write(json.dumps(said) + "\n")


@contextmanager
def progress(quiet: bool) -> Iterator[Callable[[str, float], None]]:
    """Show the stage and the share done on the terminal, and erase them at the end.

    Both are also written to the file that `PROGRESS_FILE` names.
    """
    with _on_terminal(quiet) as show:
        if not os.environ.get(PROGRESS_FILE):
            yield show
            return
        last: tuple[str, float] = ("", 0.0)

        def report(stage: str, share: float) -> None:
            nonlocal last
            show(stage, share)
            now = perf_counter()
            if stage != last[0] or now - last[1] >= _EVERY:
                last = (stage, now)
                tell({"stage": stage, "share": round(share, 4)})

        yield report


@contextmanager
def _on_terminal(quiet: bool) -> Iterator[Callable[[str, float], None]]:
    """Show stage and share on the terminal, if there is one."""
    if quiet or not (out := console(err=True)).is_terminal:
        yield lambda stage, share: None
        return
    from rich.progress import (
        BarColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    with Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=out,
        transient=True,
    ) as bar:
        task = bar.add_task("starting", total=1.0)
        at = "starting"

        def compiling(begun: bool) -> None:
            from strapdown._kernels.compilation import NOT_KEPT

            often = "in each run: set NUMBA_CACHE_DIR" if NOT_KEPT else "once on this machine"
            bar.update(task, description=f"{at} (compiling, {often})" if begun else at)

        compilations = Compilations(compiling)

        def show(stage: str, share: float) -> None:
            nonlocal at
            at = stage
            compilations.listen()
            bar.update(task, description=stage, completed=share)

        try:
            yield show
        finally:
            compilations.stop()


def print_table(
    columns: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    text: Sequence[int] | None = None,
    strong: Container[int] = (),
) -> None:
    """Print a table; on a terminal too narrow for it, row by row.

    `text`: left-aligned columns of text, wrapped between words; the first and the last if not
    given. The others are right-aligned numbers, which are never wrapped nor cut. `strong`
    (container of int): highlighted rows.
    """
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    left = {0, len(columns) - 1} if text is None else set(text)
    # A long name with one option per line.
    first = [
        row[0].replace(",", ",\n  ")
        if len(columns) > _MANY_COLUMNS and len(row[0]) > _NAME_WIDTH
        else row[0]
        for row in rows
    ]
    shown = [(name, *row[1:]) for name, row in zip(first, rows, strict=True)]
    least = [
        max(
            len(part)
            for cell in (name, *(row[k] for row in shown))
            for part in ((cell.split() or [""]) if k in left else [cell])
        )
        for k, name in enumerate(columns)
    ]
    out = console()
    # A column has a space on either side, and the frame another.
    if sum(least) + 2 * len(least) + 2 > out.width:
        _print_rows(columns, rows, strong)
        return
    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 1), header_style="bold")
    for k, name in enumerate(columns):
        if k in left:
            table.add_column(name, justify="left", overflow="fold", min_width=least[k])
        else:
            table.add_column(name, justify="right", no_wrap=True)
    for k, row in enumerate(shown):
        table.add_row(*row, style="bold" if k in strong else None)
    out.print(table, soft_wrap=False)


def _print_rows(
    columns: Sequence[str], rows: Sequence[Sequence[str]], strong: Container[int]
) -> None:
    """Print each row under its first cell, a line for each further cell that is not empty."""
    out = console()
    wide = max(map(len, columns[1:]), default=0)
    out.print()
    for k, row in enumerate(rows):
        out.print(row[0], style="bold")
        for name, cell in zip(columns[1:], row[1:], strict=True):
            if cell:
                out.print(f"  {name:<{wide}}  {cell}", style="bold" if k in strong else None)
    out.print()


def print_blocks(*blocks: TableBlock | None, captions: bool = False) -> None:
    """Print tables of a report, with line breaks only where the page has them; None is left out."""
    from strapdown.report.values import spaced

    for block in blocks:
        if block is None:
            continue
        rows = [[spaced(cell) for cell in row] for row in block.rows]
        columns = [spaced(name) for name in block.columns]
        print_table(columns, rows, text=block.text, strong=block.strong)
        if captions and block.caption:
            console().print(spaced(block.caption), style="dim")


def print_findings(findings: Sequence[Finding], most: int | None = None) -> None:
    """Print findings to stderr, in `WORDS`; at most the first `most`.

    Findings that several files or recorders share are printed once.
    """
    out = console(err=True)
    findings = _joined(findings)
    for finding in findings[:most]:
        head, _, remedy = finding.text(WORDS.get()).partition("\n")
        out.print(f"{finding.severity}: {head}", style="yellow")
        if remedy:
            out.print(remedy, style="dim")
    if most is not None and len(findings) > most:
        more = f"{len(findings) - most} more; see the result"
        out.print(f"note: {more}", style="yellow")


def _joined(findings: Sequence[Finding]) -> list[Finding]:
    alike: dict[object, list[Finding]] = {}
    for k, finding in enumerate(findings):
        # A row or a line belongs to one file.
        placed = finding.file is None or finding.row is not None or finding.line is not None
        words = finding.replace(file=None).text(WORDS.get())
        alike.setdefault(k if placed else (finding.severity, words), []).append(finding)
    return [
        one[0] if len(one) == 1 else one[0].replace(file="; ".join(str(f.file) for f in one))
        for one in alike.values()
    ]


def print_seal(seal: Seal, look_at: str, no_report: bool = False) -> None:
    """Print the written folder, the file to open, which is its page if it has one, and the seal."""
    out, page = console(), seal.path / "report.html"
    out.print(f"\nWrote {seal.path}")
    if no_report:
        out.print(f"Data  {seal.path / look_at}; no page, as --no-report asks")
    else:
        out.print(f"Open  {page if page.is_file() else seal.path / look_at}")
    out.print(f"Seal  sha256 {seal.digest}")
