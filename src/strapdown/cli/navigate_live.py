"""``strapdown navigate --live``: read lines, write states, and write the bundle at the end."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import typer

from strapdown.bundle import Seal, read_manifest, write_latency, write_timing
from strapdown.cli.console import WORDS, Stopwatch, print_seal, progress
from strapdown.cli.navigate_tables import print_latency, print_navigation
from strapdown.cli.shared_options import OutFlags
from strapdown.config.navigation import NavigationSpec
from strapdown.errors import ConfigError, DataError, Finding, StrapdownError
from strapdown.live.replay import MachineClock
from strapdown.live.run import LiveRun, live_spec, receive, result_of
from strapdown.live.sources import open_source
from strapdown.report.navigation import NAVIGATION


def navigate_live(
    file: Path,
    where: str,
    folder: Path,
    write: OutFlags,
    *,
    lines: str,
    every: float,
    given: Mapping[str, Any],
) -> None:
    """Navigate by lines, and write the bundle at their end.

    Standard output holds the states only; all else goes to standard error.

    `file`: the configuration. `where`: as `open_source`. `folder`: the bundle. `lines`, `every`: as
    `StateLines`. `given`: flags without a meaning here, by name; None where not given. ConfigError:
    the configuration is missing, or a flag without a meaning here is given. StrapdownError: the
    error that ended the run; the bundle holds the run up to it, if navigation had begun.
    """
    flag = next((name for name, value in given.items() if value is not None), None)
    if flag is not None or file.suffix.lower() != ".toml":
        raise ConfigError(
            "cli.live-without-file" if flag is None else "cli.option-beside-live",
            quantity="--live",
            option=flag,
        )
    received = folder.parent / f"{folder.name}-received"
    if received.exists():
        raise ConfigError("cli.received-before", file=str(received), quantity="--out")
    clock = MachineClock()
    spec = live_spec(NavigationSpec.read(file))
    live = receive(
        spec,
        open_source(where, clock, sys.stdin.buffer),
        clock,
        line_writer,
        warner(write.quiet),
        lines,
        every,
    )
    if not len(live.got.samples):
        raise DataError("cli.no-sample", quantity="--live")
    with redirect_stdout(sys.stderr):
        seal = _sealed(live, file, folder, received, force=write.force, quiet=write.quiet)
        if not write.quiet and live.latency is not None:
            print_latency(live.latency, where)
        if not write.quiet:
            print_seal(seal, "report.html")
    if live.error is not None:
        raise live.error


def _sealed(
    live: LiveRun, file: Path, folder: Path, received: Path, *, force: bool, quiet: bool
) -> Seal:
    """Write the bundle; the received input is kept beside it unless the bundle has a copy."""
    try:
        received.mkdir(parents=True)
        with progress(quiet) as show:
            report = Stopwatch(show)
            result = result_of(live, received, file, report)
            if live.run is None and live.error is not None:
                raise live.error
            seal = NAVIGATION.write(result, folder, force=force, progress=report)
            report.stop()
            write_timing(seal, report.seconds)
            write_latency(seal, live.told())
    except StrapdownError:
        typer.echo(f"received data: {received}", err=True)
        raise
    except BaseException:
        shutil.rmtree(received, ignore_errors=True)
        raise
    if all(item["kept"] == "copy" for item in read_manifest(seal.path)["inputs"]):
        shutil.rmtree(received)
    if not quiet:
        print_navigation(result)
    return seal


def line_writer(text: str) -> None:
    """Write a line to standard output at once; BrokenPipeError: its reader has closed."""
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise


def warner(quiet: bool) -> Callable[[Finding], None]:
    """Return a function that writes a finding to standard error."""

    def warn(finding: Finding) -> None:
        if not quiet:
            typer.echo(f"note: {finding.text(WORDS.get())}", err=True)

    return warn
