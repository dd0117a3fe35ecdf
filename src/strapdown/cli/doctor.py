"""``strapdown doctor``."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from strapdown.cli import shared_options as options
from strapdown.cli.console import console, print_blocks, print_findings
from strapdown.cli.result_folder import folder_to_write, refuse_result, run_and_save
from strapdown.errors import ConfigError

if TYPE_CHECKING:
    from strapdown.progress import Progress
    from strapdown.systems.doctor import Diagnosis, LogDiagnosis

EPILOG = (
    "Example: strapdown doctor drive.csv\n\n"
    "Example: strapdown doctor drive.csv --gyro-unit deg/s --fix drive.parquet"
)
#: Faults in full on the terminal, and characters of a sentence.
MOST, WIDTH = 8, 300


@options.spread
def doctor(
    logs: list[Path] = typer.Argument(
        metavar="LOG…", help="Logs, or folders of recordings.", show_default=False
    ),
    fix: Path | None = options.writing(
        "FILE",
        "Write a clean log (.parquet or .csv): SI, body axes, increasing stamps; other streams "
        "and the record of what was done beside it.",
    ),
    *,
    flags: options.LogFlags,
    fixes: options.FixFlags,
    out: Path | None = options.folder_to_make("LOG-doctor"),
    write: options.ReportFlags,
) -> None:
    """Examine logs: what is in them, what is wrong, the fix, and what they suffice for.

    Streams, rates, gaps and clocks; units and axes with the evidence; gravity, saturation,
    quantization, stuck channels, stationary stretches with the noise there. A log that leaves
    something open is examined with the answers as inferred, and the questions are listed.
    """
    from strapdown.api.doctor import doctor as examine
    from strapdown.systems.clean_log import axes_of_clean_log, write_clean_log

    for log in logs:
        refuse_result(log, "log")
    keys = {key: value for key, value in options.log_keys(flags.given()).items() if value}

    def compute(report: Progress) -> Diagnosis:
        try:
            paths = [str(log) for log in logs]
            gnss = options.fix_keys(fixes.given(), None)
            return examine(paths, axes=flags.axes, gnss=gnss, progress=report, **keys)
        except ConfigError as error:
            raise options.as_flag(error, {}) from None

    def show(result: Diagnosis) -> None:
        paths = {one.name: one.log.path for one in result.logs}
        for one in result.logs:
            print_log(one, paths, [x.path for x in result.spec.logs], tables=write.verbose)
        print_findings(result.between)

    folder = folder_to_write(out, logs[0], "doctor", write.force)
    found = run_and_save(compute, folder, write, "doctor.json", show)
    if fix is not None:
        files = write_clean_log(found, fix, force=write.force)
        if not (write.json or write.quiet):
            console().print(f"Clean {', '.join(map(str, files))}")
            said = [axes_of_clean_log(one) for one in found.logs]
            print_findings([finding for finding in said if finding is not None])


def print_log(
    one: LogDiagnosis, paths: Mapping[str, str], logs: Sequence[str], *, tables: bool
) -> None:
    """Print what a log is fit for, its streams, and its faults with their fixes.

    `paths`: of logs by name, for commands. `logs`: paths of all that were examined.
    `tables`: also those of channels and rests.
    """
    from strapdown.report import doctor as report
    from strapdown.report.values import spaced

    out = console()
    out.print(report.headline(one), style="bold")
    ways: set[str] = set()
    for use in report.uses(one):
        out.print(spaced(f"  {use:<11}{one.answer(use)}: {_cut(report.reasons(one, use))}"))
        line = report.command(one, use, one.log.path, paths.get(one.data["fixes_from"]))
        line = line or report.way(one, use)
        if line and line not in ways:
            out.print(f"  {'':<11}{line}", style="dim")
            ways.add(line)
    blocks = [report.stream_table(one)]
    if tables:
        blocks += [report.channel_table(one), report.rest_table(one)]
    print_blocks(*blocks)
    faults = report.wrong(one)
    for number, (head, text, fix) in enumerate(faults[:MOST], 1):
        said = _cut(" ".join(text.split()))
        out.print(f"{number}. {f'{head}: {said}' if head else said}", style="yellow")
        if fix:
            out.print(f"   {_cut(fix)}", style="dim")
    if len(faults) > MOST:
        out.print(f"   {len(faults) - MOST} more; see the result", style="yellow")
    for note in one.notes:
        if note.code == "io.columns-not-used":
            out.print(_cut(note.sentence("cli")), style="dim")
    if line := report.answering(one, logs):
        from strapdown.cli.main import introduced  # which imports this module

        words = shlex.split(line)[1:]
        out.print(f"{introduced(words, words)}: {line}")


def _cut(text: str) -> str:
    return text if len(text) <= WIDTH else f"{text[:WIDTH]} …"
