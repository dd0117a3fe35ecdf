"""``strapdown crash``."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from strapdown.cli import shared_options as options
from strapdown.cli.console import (
    WORDS,
    Stopwatch,
    console,
    print_blocks,
    print_findings,
    print_seal,
    progress,
)
from strapdown.cli.result_folder import claim, folder_to_write, refuse_result
from strapdown.errors import printable

if TYPE_CHECKING:
    from strapdown.crash.case import CaseResult

EPILOG = (
    "Example: strapdown crash case.toml (strapdown init crash RECORD writes it); of two vehicles: "
    "strapdown crash case-1.toml case-2.toml"
)


@dataclass(frozen=True)
class LiveFlags:
    """Detection while samples arrive, and on a microcontroller."""

    live: str | None = options.running(
        "-|udp://HOST:PORT",
        "Detect a crash in samples as they come, as lines of standard input or of datagrams, "
        "by the recorder of the case.",
    )
    every: float | None = options.running(
        "S", "With --live: an estimate of an event so often (0.01)."
    )
    calibration: Path | None = options.running(
        "RESULT",
        "With --live or --export: a result of strapdown crash in which the drive determined "
        "biases, scale factors and mounting of the recorder; they are taken off.",
    )
    token: str | None = options.TOKEN
    recover: Path | None = options.RECOVER
    export: Path | None = options.writing(
        "FILE.c",
        "Write the detection of --live for the recorder of the case as C99, with a test "
        "vector, and nothing else.",
    )


@options.spread
def crash(
    cases: list[Path] | None = typer.Argument(
        None,
        metavar="CASE.toml...",
        help="The case of each vehicle; strapdown init crash writes them.",
        show_default=False,
    ),
    *,
    flags: LiveFlags,
    out: Path | None = options.folder_to_make("CASE-crash, with --live CASE-crash-live"),
    write: options.ReportFlags,
) -> None:
    """Reconstruct a crash: delta-V, direction of force, severity and path, each with its bound.

    Reads the records that the case names and writes a report (HTML; PDF where the extra 'pdf' is
    installed), JSON, CSV and figures, sealed so that any change is found. Two vehicles are held
    against each other as well: momentum, closing speed, restitution and energy; each has its report
    in a folder of its own.

    With --live, samples are watched as they arrive, and delta-V so far, direction of force and
    severity of a crash are written as lines of JSON.
    """
    if flags.recover is not None:
        from strapdown.cli.crash_live import recover_crash

        recover_crash(cases or None, out, write, flags)
        return
    if not cases:
        raise options.missing_argument("CASE.toml...")
    if any(one is not None for one in asdict(flags).values()):
        from strapdown.cli.crash_live import crash_live

        crash_live(cases, out, write, flags)
        return
    from strapdown.api.crash import reconstruct
    from strapdown.bundle import MANIFEST, Seal, sha256, write_timing
    from strapdown.report.values import shown_in

    for case in cases:
        refuse_result(case, "case")
    folder = folder_to_write(out, cases[0], "crash", write.force)
    several = len(cases) > 1
    for k in range(len(cases)):
        claim(folder / str(k + 1) if several else folder, write.force)
    WORDS.set("file")
    with progress(write.quiet or write.json) as show:
        report = Stopwatch(show)
        result = reconstruct(*cases, progress=report)
        first = result.save(folder, report=not write.no_report, force=write.force, progress=report)
        report.stop()
        write_timing(first, report.seconds)
    folders = [folder / number if several else folder for number in result.runs]
    seals = [Seal(one, sha256(one / MANIFEST)) for one in folders]
    if write.json:
        told = [(seal.path / "crash.json").read_text(encoding="utf-8") for seal in seals]
        typer.echo("".join(told) if not several else f"[{','.join(told)}]", nl=several)
        return
    if write.quiet:
        return
    for run, seal in zip(result.runs.values(), seals, strict=True):
        console().print(printable(run.spec.title), style="bold")
        if several:
            console().print(printable(run.vehicle_names[run.number - 1]), style="bold")
        with shown_in(run.spec.options.units):
            print_crash(run)
        # Statements of both are printed with the first.
        both = run.closure.findings if run.closure is not None and run.number > 1 else ()
        print_findings([found for found in run.findings if found not in both])
        print_seal(seal, "crash.json", write.no_report)
    if several:
        from strapdown.report.crash_tables import closure_table

        with shown_in(result.spec.options.units):
            closure = closure_table(result)
        if closure is not None:
            console().print("Closure of both vehicles", style="bold")
            print_blocks(closure)


def print_crash(result: CaseResult) -> None:
    """Print the results of a case, and their limits."""
    from strapdown.report.crash_tables import (
        answers_table,
        closure_table,
        comparison_table,
        deformation_table,
        drive_table,
        indices_table,
        path_table,
        reference_tables,
        severity_table,
    )
    from strapdown.report.crash_words import contradictions, headline, limitations
    from strapdown.report.values import spaced

    out = console()
    tables = [
        ("Delta-V", answers_table(result)),
        ("Path", path_table(result)),
        ("Errors by the drive before the crash", drive_table(result)),
        ("Recorders compared: differences of delta-V", comparison_table(result)),
        # That of two vehicles is printed once, below both.
        ("Contact", None if result.partners else closure_table(result)),
        ("Deformation", deformation_table(result)),
        ("Probability of injury", severity_table(result)),
        ("Indices", indices_table(result)),
        *(("Reference", block) for block in reference_tables(result)),
    ]
    for name, block in tables:
        if block is not None and block.rows:
            out.print(name, style="bold")
            print_blocks(block)
    out.print(spaced(headline(result)), style="bold")
    against = contradictions(result)
    if against:
        out.print("\nThese contradict the answer:")
        for source, text in against:
            out.print(f"  - {spaced(f'{source}: {text}' if source else text)}")
    found = limitations(result)
    if found:
        out.print("\nLimitations (details in the result):")
        for _, head, _ in found:
            out.print(f"  - {spaced(head)}")
