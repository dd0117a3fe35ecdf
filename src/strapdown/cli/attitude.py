"""``strapdown attitude``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from strapdown.cli.console import (
    Stopwatch,
    console,
    print_findings,
    print_seal,
    print_table,
    progress,
)
from strapdown.cli.result_folder import claim, folder_to_write, refuse_result
from strapdown.cli.shared_options import (
    HEIGHT,
    LONGITUDE,
    LogFlags,
    ReportFlags,
    folder_to_make,
    running,
    spread,
    with_what,
    writing,
)
from strapdown.errors import ConfigError, printable

if TYPE_CHECKING:
    from rich.console import Console

    from strapdown.attitude_comparison.comparison import AttitudeComparison
    from strapdown.attitude_comparison.options import AttitudeOptions
    from strapdown.report.document import TableBlock

EPILOG = (
    "Example: strapdown attitude alexiev-fig4 --rate 100\n\n"
    "Example: strapdown attitude log.csv --gyro-unit deg/s --reference 'end same as start'"
)


@dataclass(frozen=True)
class ComparisonFlags:
    """What to compare; the fields of `AttitudeOptions` as a person types them."""

    algorithms: str | None = running(
        "NAMES",
        "Names joined by blanks or commas, with options after a colon: 'naive "
        "euler:step=rk4 dcm:order=3 rotvec:samples=3'; or all, with variants. One of each "
        "(strapdown modules) if not given.",
    )
    rates: str | None = running(
        "HZ,HZ,…", "Lower rates to try: '100 50 20 10'; the full rate and its halves if not given."
    )
    tolerance_deg: float = running(
        "DEG", "Tolerance: the largest acceptable error (1).", default=1.0
    )
    interpolation: str = running(
        "KIND",
        "How rates run between their stamps: linear (the trapezoid), or cubic (linear).",
        default="linear",
    )
    trials: int = running("N", "Of a scenario: so many seeds (1).", default=1)
    reference: list[str] | None = running(
        "WORDS|FILE",
        "Known parts of the motion, repeatable: 'end same as start', 'end 2 turns about z "
        "since start', '12.5 roll 0 pitch 0 heading 90', '8 same place as 2', rests (gravity "
        "at every rest), a file of such lines (.txt .toml .csv), or an attitude truth.",
    )
    reference_log: Path | None = running(
        "LOG", "Log of a second, better sensor on the same body, to be taken for the truth."
    )
    reference_clock: str = running(
        "CLOCK",
        "Clock of an attitude truth: fitted to the log's by the rotations of both, or as "
        "stated (fitted).",
        default="fitted",
    )
    initial: str = running(
        "ATTITUDE", "auto, truth, level, zero, or roll,pitch,heading in deg (auto).", default="auto"
    )
    gyro_bias: str = running(
        "BIAS",
        "auto (that of the first rest, if it is significant); none; rest (mean of the first "
        "stationary stretch); rests (interpolated between all of these); 'x,y,z deg/s' about "
        "forward, right, down; or a log of the stationary sensor (auto).",
        default="auto",
    )
    magnetometer: str = running(
        "auto|raw|LOG",
        "Of the filters: hard and soft iron removed where the log shows them; raw, left; or a "
        "log in which the sensor turned through all directions (auto). With --lat and --lon "
        "headings are true ones.",
        default="auto",
    )
    lat: float | None = with_what("DEG", "Latitude, north positive.")
    lon: float | None = LONGITUDE
    alt: float | None = HEIGHT
    peers: str | None = running(
        "NAMES", "Other libraries to lay beside: vqf, imufusion, ahrs, or all (the extra 'peers')."
    )
    seed: int | None = running("N", "Of a scenario's simulated errors (0).")
    sensor: str | None = running(
        "NAME|FILE",
        "Of a scenario: its errors are those of a unit of this sensor of the catalogue "
        "(strapdown modules), or of a .toml file of your own.",
    )


@dataclass(frozen=True)
class FileFlags:
    """Files beside the result."""

    export: Path | None = writing(
        "FILE",
        "Write an algorithm or a filter for the rate of the answer, with units, axes and "
        "biases of this log and a test vector from it: C99 (FILE.c) or MicroPython (FILE.py).",
    )
    export_of: str | None = writing(
        "NAME",
        "What --export writes: an algorithm or a filter with its options, such as error-state "
        "or complementary:declination=3.1; the algorithm that the answer chose if not given.",
    )
    timing: bool = writing(
        None,
        "Measure how long a sample takes on this machine, and print it (timing.json has it, too).",
        "--timing",
        default=False,
    )
    png: bool = writing(None, "Draw the figures as PNG, too.", "--png", default=False)


@spread
def attitude(
    sources: list[str] = typer.Argument(
        metavar="LOG|SCENARIO",
        help="A log (a file or a folder), or a scenario: its name (strapdown modules) or its "
        "file (.toml). "
        "Several are trials of one question.",
    ),
    *,
    compare: ComparisonFlags,
    log: LogFlags,
    files: FileFlags,
    out: Path | None = folder_to_make("LOG-attitude"),
    write: ReportFlags,
) -> None:
    """Find the simplest attitude algorithm, and the lowest rate, of sufficient accuracy.

    Runs attitude algorithms over a gyro log or a scenario at its own and at lower rates, compares
    them with the known attitude, splits their error into the sensor's and their own, counts their
    cost, and writes the answer with tables, JSON, CSV, a report page and its figures.
    """
    from strapdown.attitude_comparison.comparison import run_comparison
    from strapdown.bundle import to_json, write_timing
    from strapdown.report.attitude import attitude_json

    if files.png:
        from strapdown.report.document_pdf import typst_library

        if write.no_report:
            raise ConfigError("report.png-without-report", quantity="--png")
        typst_library()  # before the run
    for source in sources:
        refuse_result(source, "log")
    folder = folder_to_write(out, sources[0], "attitude", write.force)
    claim(folder, write.force)
    if files.export is not None:
        from strapdown.report import attitude_export as export

        export.check_export(files.export, write.force)
        if files.export_of is not None:
            export.named_for_export(files.export_of)
    elif files.export_of is not None:
        raise ConfigError("report.export-of-alone", quantity="--export-of")
    with progress(write.quiet or write.json) as show:
        report = Stopwatch(show)
        bench = run_comparison(_options(compare, log).specify(sources), report)
        if files.export is not None:
            export.chosen_for_export(bench, files.export_of)
        report("writing", 0.95)
        seal = bench.save(folder, report=not write.no_report, force=write.force, png=files.png)
        if files.export is not None:
            exported = export.write_export(bench, files.export, files.export_of, force=write.force)
        taken = {}
        if files.timing:
            report("timing", 0.99)
            taken = _sample_times(bench)
        report.stop()
        of_sample = {
            name: {"float64": round(double, 1), "float32": round(single, 1)}
            for name, (double, single) in taken.items()
        }
        write_timing(seal, report.seconds, of_sample)
    if write.json:
        typer.echo(to_json(attitude_json(bench)), nl=False)
        return
    if write.quiet:
        return
    print_comparison(bench, verbose=write.verbose)
    if taken:
        _print_speed(taken)
    print_findings(bench.findings)
    print_seal(seal, "attitude.json", write.no_report)
    if files.export is not None:
        language = export.WRITERS[files.export.suffix.lower()][0]
        console().print(f"{language}   {files.export}: {exported}", soft_wrap=True)


def _options(compare: ComparisonFlags, log: LogFlags) -> AttitudeOptions:
    from strapdown.attitude_comparison.options import AttitudeOptions
    from strapdown.formats.columns import parse_column_option

    flags = asdict(compare)
    read = asdict(log)
    if (algorithms := flags.pop("algorithms")) is not None:
        flags["algorithms"] = _split(algorithms)
    return AttitudeOptions(
        rates_hz=_numbers(flags.pop("rates")),
        reference=flags.pop("reference") or (),
        peers=(flags.pop("peers") or "").replace(",", " ").split(),
        rate_hz=read.pop("rate"),
        duration_s=read.pop("duration"),
        columns=parse_column_option(read.pop("columns") or []),
        **flags,
        **read,
    )


def _numbers(text: str | None) -> list[float]:
    """Parse numbers separated by blanks or commas."""
    try:
        return [float(word) for word in (text or "").replace(",", " ").split()]
    except ValueError:
        raise ConfigError("cli.bad-rates", quantity="--rates", text=text) from None


def _split(text: str) -> list[str]:
    """Split names with options; a comma within options belongs to them."""
    names: list[str] = []
    for word in text.replace(",", " , ").split():
        if word == ",":
            continue
        if "=" in word and ":" not in word and names:
            names[-1] += f",{word}"
        else:
            names.append(word)
    return names


MOST_LINES = 8


def print_comparison(bench: AttitudeComparison, *, verbose: bool = False) -> None:
    """Print the input of the run, its tables, and the answer last, where it is visible.

    `verbose`: also the tables that the answer does not rest on.
    """
    from strapdown.report import attitude_tables as tables
    from strapdown.report import attitude_words as words

    page = console()
    if bench.trials is not None:
        count = len(bench.trials.names)
        page.print(f"First of {count} trials; the answer and the errors by rate hold for all:")
    page.print(printable(bench.source), style="bold")
    if bench.readings:
        page.print("Read as:")
        print_table(
            ["column", "taken as", "unit", "first value"],
            [[r.source, r.quantity, r.unit, words.first_value(r)] for r in bench.readings],
        )
    for name, text in words.facts(bench):
        page.print(f"{name}: {text}")
    sweeps = tables.sweep_tables(bench)
    aided = [tables.peer_table(bench), tables.filter_table(bench)]
    beside = [*sweeps[1:], *([] if bench.scores else aided)]
    shown = [
        *tables.result_tables(bench),
        *sweeps[:1],
        tables.budget_table(bench),
        tables.trial_table(bench),
        tables.place_table(bench),
        *(aided if bench.scores else []),
        *(beside if verbose else []),
    ]
    for table in filter(None, shown):
        _print_table(table, page)
    if not verbose and (further := [table.title for table in filter(None, beside)]):
        page.print(f"\nWith --verbose, and on the page: {'; '.join(further)}.\n")
    points = words.reference_lines(bench)
    for point in points[:MOST_LINES]:
        page.print(point)
    if len(points) > MOST_LINES:
        page.print(f"and {len(points) - MOST_LINES} more reference points, in the report")
    page.print(bench.answer.sentence, style="bold")
    page.print(words.standing(bench))
    for title, lines in (("Why", bench.answer.why), ("Remedies", bench.answer.helps)):
        if lines:
            page.print(f"{title}:")
        for line in lines:
            page.print(f"  - {line}")
    if offers := words.offer_lines(bench):
        page.print("Rests of similar attitude, possible reference points:")
    for line in offers:
        page.print(f"  {line}")


def _sample_times(bench: AttitudeComparison) -> dict[str, tuple[float, float]]:
    """Time of a sample of each algorithm and filter on this machine, float64 and float32, ns."""
    from strapdown.attitude_algorithms import make_algorithm
    from strapdown.attitude_algorithms.cost import time_algorithms
    from strapdown.orientation_filters import FILTERS, make_filter
    from strapdown.orientation_filters.cost import time_filters

    tables = [time_algorithms([make_algorithm(run.algorithm) for run in bench.runs])]
    if any(peer.cost is not None for peer in bench.peers):
        tables.append(time_filters([make_filter(name) for name in FILTERS]))
    rows = (row for table in tables for row in table.itertuples(index=False))
    return {str(name): (double, single) for name, double, single in rows}


def _print_speed(taken: Mapping[str, tuple[float, float]]) -> None:
    """Print the time per sample of each algorithm and filter on this machine."""
    console().print("\nTime of a sample on this machine")
    print_table(
        ["algorithm", "float64, ns", "float32, ns"],
        [[name, f"{d:.3g}", f"{f:.3g}"] for name, (d, f) in taken.items()],
    )


def _print_table(table: TableBlock, page: Console) -> None:
    page.print(f"\n{table.title}", style="bold")
    print_table(table.columns, table.rows, text=table.text, strong=table.strong)
    if table.caption:
        page.print(table.caption, style="dim")
