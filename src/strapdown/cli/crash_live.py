"""``strapdown crash --live``: read lines, write estimates, and write the bundle at the end."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from strapdown.bundle import write_latency
from strapdown.bundle.atomic_folder import replace_file
from strapdown.cli import live_folder
from strapdown.cli.console import WORDS, print_seal
from strapdown.cli.navigate_live import line_writer
from strapdown.cli.navigate_tables import print_latency
from strapdown.cli.result_folder import claim, default_folder, refuse_result
from strapdown.cli.shared_options import ReportFlags, refuse_without_live
from strapdown.errors import ConfigError
from strapdown.live.crash import receive_crash, recorder_of_case
from strapdown.live.journal import Journal
from strapdown.live.replay import MachineClock
from strapdown.report import crash_live as report
from strapdown.report.attitude_export import check_export

if TYPE_CHECKING:
    from strapdown.cli.crash import LiveFlags

EVERY = 0.01


def crash_live(
    cases: Sequence[Path], out: Path | None, write: ReportFlags, flags: LiveFlags
) -> None:
    """Detect crashes in lines, or write the detection as C.

    Standard output holds the estimates only; all else goes to standard error.
    """
    if flags.live is not None and (flags.export is not None or write.json):
        option = "--json" if write.json else "--export"
        raise ConfigError("live.not-together", beside="--live", option=option)
    if flags.live is None:
        refuse_without_live({"--every": flags.every, "--token": flags.token})
    if flags.live is None and flags.export is None:
        raise ConfigError("live.only-with", option="--calibration", beside="--live or --export")
    name = "--live" if flags.live is not None else "--export"
    if len(cases) != 1:
        raise ConfigError("live.one-case", option=name, count=len(cases))
    refuse_result(cases[0], "case")
    WORDS.set("file")
    check_export(flags.export, write.force, (".c",))
    options = recorder_of_case(cases[0], flags.calibration)
    if flags.live is None:
        from strapdown.export.detector import export_detector

        assert flags.export is not None
        known = (*options.bias, *options.scale, *options.axes) if flags.calibration else ()
        text = export_detector(
            options.errors, options.variance, mean=options.mean, calibration=known
        )
        replace_file(flags.export, text.encode())
        if not write.quiet:
            typer.echo(f"C99   {flags.export}")
        return
    folder = out or default_folder(cases[0], "crash-live")
    claim(folder, write.force)
    every = EVERY if flags.every is None else flags.every
    run = {"configuration": {"recorder": asdict(options)}, "every": every}
    _run(live_folder.begin_journal(folder, report.COMMAND, run), folder, write, flags)


def recover_crash(
    cases: Sequence[Path] | None, out: Path | None, write: ReportFlags, flags: LiveFlags
) -> None:
    """Finish, or with ``--live`` continue, a run that was killed, from what it had received."""
    live_folder.refuse_beside_recover(
        {
            "CASE.toml": cases,
            "--export": flags.export,
            "--calibration": flags.calibration,
            "--json": write.json or None,
        }
    )
    assert flags.recover is not None
    WORDS.set("file")
    journal = live_folder.recovered(flags.recover, report.COMMAND, live_folder.warner(write.quiet))
    with live_folder.sealing(journal):
        folder = live_folder.output_of(journal, out, write.force)
    _run(journal, folder, write, flags)


def _run(journal: Journal, folder: Path, write: ReportFlags, flags: LiveFlags) -> None:
    """Detect crashes in what the journal has, and in what comes; and write the bundle."""
    clock, warn = MachineClock(), live_folder.warner(write.quiet)
    options = report.recorder_of(journal.run["configuration"])
    every = journal.run["every"] if flags.every is None else flags.every
    with live_folder.sealing(journal):
        source = live_folder.open_lines(flags.live, clock, flags.token, warn)
        got = receive_crash(options, source, clock, line_writer, warn, every, journal)
        if got.rows.count:
            record = journal.folder / report.RECEIVED
            report.write_received(record, got.rows.rows)
            seal = report.write_crash_live(
                options, record, folder, every=every, log=got.log, force=write.force
            )
            journal.sealed(seal.digest)
    if not got.log.watch.samples:
        live_folder.remove_empty(journal, source is not None)
    live_folder.remove_received(journal, seal.path)
    latency, own = got.tape.latency(), got.processing.latency()
    told: dict[str, Any] = {
        **({} if latency is None else latency.told()),
        "lines": got.lines,
        "not_used": dict(got.unused),
        **({"replayed": got.replayed} if got.replayed else {}),
    }
    if own is not None:
        told["processing"] = own.told()
    write_latency(seal, told)
    if not write.quiet:
        with redirect_stdout(sys.stderr):
            # Of lines that come all at once, the time from a sample to its state is their queue.
            if own is not None:
                print_latency(own, flags.live or "", "processing of a sample")
            print_seal(seal, report.DETECTIONS)
