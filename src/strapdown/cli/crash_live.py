"""``strapdown crash --live``: read lines, write estimates, and write the bundle at the end."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from strapdown.bundle import write_latency
from strapdown.cli.console import WORDS, print_seal
from strapdown.cli.navigate_live import line_writer, warner
from strapdown.cli.navigate_tables import print_latency
from strapdown.cli.result_folder import claim, default_folder, refuse_result
from strapdown.cli.shared_options import OutFlags
from strapdown.errors import ConfigError, DataError
from strapdown.live.crash import receive_crash, recorder_of_case
from strapdown.live.replay import MachineClock
from strapdown.live.sources import open_source
from strapdown.report.attitude_export import check_export
from strapdown.report.crash_live import DETECTIONS, RECEIVED, write_crash_live, write_received

if TYPE_CHECKING:
    from strapdown.cli.crash import LiveFlags

EVERY = 0.01


def crash_live(cases: Sequence[Path], out: Path | None, write: OutFlags, flags: LiveFlags) -> None:
    """Detect crashes in lines, or write the detection as C.

    Standard output holds the estimates only; all else goes to standard error.
    """
    if flags.live is not None and (flags.export is not None or write.json):
        option = "--json" if write.json else "--export"
        raise ConfigError("live.not-together", beside="--live", option=option)
    if flags.live is None and flags.every is not None:
        raise ConfigError("live.only-with", option="--every", beside="--live")
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
        flags.export.write_text(text, encoding="utf-8", newline="\n")
        if not write.quiet:
            typer.echo(f"C99   {flags.export}")
        return
    folder = out or default_folder(cases[0], "crash-live")
    claim(folder, write.force)
    clock = MachineClock()
    every = EVERY if flags.every is None else flags.every
    source = open_source(flags.live, clock, sys.stdin.buffer)
    got = receive_crash(options, source, clock, line_writer, warner(write.quiet), every)
    if not got.log.watch.samples:
        raise DataError("cli.no-sample", quantity="--live")
    latency = got.tape.latency()
    with tempfile.TemporaryDirectory(prefix="strapdown-live-") as received:
        record = Path(received) / RECEIVED
        write_received(record, got.rows)
        seal = write_crash_live(
            options, record, folder, every=every, log=got.log, force=write.force
        )
    told: dict[str, Any] = {
        **({} if latency is None else latency.told()),
        "lines": got.lines,
        "not_used": dict(got.unused),
    }
    if (own := got.processing.latency()) is not None:
        told["processing"] = own.told()
    write_latency(seal, told)
    if not write.quiet:
        with redirect_stdout(sys.stderr):
            # Of lines that come all at once, the time from a sample to its state is their queue.
            if own is not None:
                print_latency(own, flags.live, "processing of a sample")
            print_seal(seal, DETECTIONS)
