"""``strapdown navigate --live``: read lines, write states, and write the bundle at the end."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

from strapdown.bundle import Seal, write_latency, write_timing
from strapdown.cli import live_folder
from strapdown.cli.console import Stopwatch, print_seal, progress
from strapdown.cli.navigate_tables import print_latency, print_navigation
from strapdown.cli.shared_options import ReportFlags
from strapdown.config.navigation import NavigationSpec
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.live.journal import Journal, received_folder
from strapdown.live.replay import MachineClock, Replay
from strapdown.live.run import LiveRun, live_spec, receive, replay_session, result_of
from strapdown.progress import Progress
from strapdown.report.navigation import NAVIGATION

if TYPE_CHECKING:
    from strapdown.cli.navigate import NavigateFlags
    from strapdown.systems.navigation_run import NavigationRun

COMMAND = "navigate --live"
EVERY, LINES = 1.0, "json"


def navigate_live(
    file: Path, folder: Path, write: ReportFlags, flags: NavigateFlags, given: Mapping[str, Any]
) -> None:
    """Navigate by lines, and write the bundle at their end.

    Standard output holds the states only; all else goes to standard error.

    `file`: the configuration. `folder`: the bundle. `given`: flags without a meaning here, by name;
    None where not given. ConfigError: the configuration is missing, or a flag without a meaning
    here is given. StrapdownError: the error that ended the run; the bundle holds the run up to it,
    if navigation had begun.
    """
    flag = next((name for name, value in given.items() if value is not None), None)
    if flag is not None or file.suffix.lower() != ".toml":
        raise ConfigError(
            "cli.live-without-file" if flag is None else "cli.option-beside-live",
            quantity="--live",
            option=flag,
        )
    spec = live_spec(NavigationSpec.read(file))
    run = {
        "configuration": spec.plain(),
        "file": {"path": str(file.absolute()), "text": file.read_bytes().decode()},
        "every": EVERY if flags.every is None else flags.every,
        "lines": LINES if flags.lines is None else flags.lines,
    }
    _run(live_folder.begin_journal(folder, COMMAND, run), spec, file, folder, write, flags)


def recover_navigation(
    out: Path | None, write: ReportFlags, flags: NavigateFlags, given: Mapping[str, Any]
) -> None:
    """Finish, or with ``--live`` continue, a run that was killed, from what it had received.

    `out`, `given`: as of `navigate_live`; by default the bundle that the killed run was to write.
    """
    live_folder.refuse_beside_recover(given)
    assert flags.recover is not None
    journal = live_folder.recovered(flags.recover, COMMAND, live_folder.warner(write.quiet))
    with live_folder.sealing(journal):
        folder = live_folder.output_of(journal, out, write.force)
        spec = NavigationSpec.checked(journal.run["configuration"])
        file = _file(journal)
    _run(journal, spec, file, folder, write, flags)


def navigate_session(
    session: Path,
    folder: Path,
    report: Progress,
    played: Replay | None,
    warn: Callable[[Finding], None],
) -> NavigationRun:
    """Navigate a session of ``strapdown live`` again, with its configuration; or replay it.

    `session`: its folder. `folder`: the bundle, beside which the received input is written.
    StrapdownError: the error that ended the session, if it has no result.
    """
    report("reading", 0.01)
    live = replay_session(session, warn)
    if not live.got.count or (live.run is None and live.error is not None):
        raise live.error or DataError("cli.no-sample", file=str(session))
    received = received_folder(folder)
    received.mkdir(parents=True, exist_ok=True)
    return result_of(live, received, None, report, played)


def _file(journal: Journal) -> Path:
    """Return the configuration file of a killed run; a copy, if it has changed since."""
    path, text = Path(journal.run["file"]["path"]), journal.run["file"]["text"].encode()
    if not path.is_file() or path.read_bytes() != text:
        path = journal.folder / "configuration" / path.name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(text)
    return path


def _run(
    journal: Journal,
    spec: NavigationSpec,
    file: Path,
    folder: Path,
    write: ReportFlags,
    flags: NavigateFlags,
) -> None:
    """Navigate what the journal has, and what comes; and write the bundle."""
    clock, warn, run = MachineClock(), live_folder.warner(write.quiet), journal.run
    with live_folder.sealing(journal):
        source = live_folder.open_lines(flags.live, clock, flags.token, warn)
        lines = run["lines"] if flags.lines is None else flags.lines
        every = run["every"] if flags.every is None else flags.every
        live = receive(spec, source, clock, line_writer, warn, lines, every, journal)
        with redirect_stdout(sys.stderr):
            if live.got.count:
                seal = _sealed(live, journal, file, folder, write)
    if not live.got.count:
        live_folder.remove_empty(journal, source is not None)
    live_folder.remove_received(journal, seal.path)
    with redirect_stdout(sys.stderr):
        if not write.quiet and live.latency is not None:
            print_latency(live.latency, flags.live or "")
        if not write.quiet:
            print_seal(seal, "navigation.json", write.no_report)
    if live.error is not None:
        raise live.error


def _sealed(live: LiveRun, journal: Journal, file: Path, folder: Path, write: ReportFlags) -> Seal:
    """Write the bundle."""
    with progress(write.quiet) as show:
        report = Stopwatch(show)
        result = result_of(live, journal.folder, file, report)
        if live.run is None and live.error is not None:
            raise live.error
        seal = NAVIGATION.write(
            result, folder, report=not write.no_report, force=write.force, progress=report
        )
        journal.sealed(seal.digest)
        report.stop()
        write_timing(seal, report.seconds)
        write_latency(seal, live.told())
    if not write.quiet:
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
