"""``strapdown attitude``."""

from __future__ import annotations

import json as json_module
from pathlib import Path
from typing import Annotated

import typer

from strapdown.cli.shared_options import (
    OUT_PANEL,
    RUN_PANEL,
    LogFlags,
    OutFlags,
    folder_to_make,
    spread,
)

EPILOG = (
    "Example: strapdown attitude alexiev-fig4 --rate 100\n\n"
    "Example: strapdown attitude log.csv --gyro-unit deg/s --reference 'end same as start'"
)


@spread
def attitude(
    sources: Annotated[
        list[str],
        typer.Argument(
            metavar="LOG|SCENARIO",
            help="A log (a file or a folder), or the name of a scenario (strapdown modules). "
            "Several are trials of one question.",
        ),
    ],
    algorithms: Annotated[
        str,
        typer.Option(
            metavar="NAMES",
            help="Names joined by blanks or commas, with options after a colon: 'naive "
            "euler:step=rk4 dcm:order=3 rotvec:samples=3'; or all (naive euler dcm quaternion rk4 "
            "rotvec).",
            show_default=False,
            rich_help_panel=RUN_PANEL,
        ),
    ] = "naive euler dcm quaternion rk4 rotvec",
    rates: Annotated[
        str | None,
        typer.Option(
            metavar="HZ,HZ,…",
            help="Lower rates to try: '100 50 20 10'; the full rate and its halves if not given.",
            rich_help_panel=RUN_PANEL,
        ),
    ] = None,
    tolerance_deg: Annotated[
        float,
        typer.Option(
            metavar="DEG",
            help="What is accurate enough: the largest error (1).",
            show_default=False,
            rich_help_panel=RUN_PANEL,
        ),
    ] = 1.0,
    interpolation: Annotated[
        str,
        typer.Option(
            metavar="KIND",
            help="How rates run between their stamps: linear (the trapezoid), or cubic (linear).",
            show_default=False,
            rich_help_panel=RUN_PANEL,
        ),
    ] = "linear",
    trials: Annotated[
        int,
        typer.Option(
            metavar="N",
            help="Of a scenario: so many seeds (1).",
            show_default=False,
            rich_help_panel=RUN_PANEL,
        ),
    ] = 1,
    reference: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WORDS|FILE",
            help="What is known, as often as you like: 'end same as start', 'end 2 turns about z "
            "since start', '12.5 roll 0 pitch 0 heading 90', '8 same place as 2', rests (gravity "
            "at every rest), a file of such lines (.txt .toml .csv), or an attitude truth.",
            rich_help_panel=RUN_PANEL,
        ),
    ] = None,
    reference_log: Annotated[
        Path | None,
        typer.Option(
            metavar="LOG",
            help="Log of a second, better sensor on the same body, to be taken for the truth.",
            rich_help_panel=RUN_PANEL,
        ),
    ] = None,
    initial: Annotated[
        str,
        typer.Option(
            metavar="ATTITUDE",
            help="auto, truth, level, zero, or roll,pitch,heading in deg (auto).",
            show_default=False,
            rich_help_panel=RUN_PANEL,
        ),
    ] = "auto",
    gyro_bias: Annotated[
        str,
        typer.Option(
            metavar="BIAS",
            help="none; rest (mean of the first stationary stretch); rests (course through all of "
            "them); 'x,y,z deg/s' about forward, right, down; or a log of the sensor lying still "
            "(none).",
            show_default=False,
            rich_help_panel=RUN_PANEL,
        ),
    ] = "none",
    peers: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="Other libraries to lay beside: vqf, imufusion, ahrs, or all (the extra 'peers').",
            rich_help_panel=RUN_PANEL,
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            metavar="N", help="Of a scenario's simulated errors (0).", rich_help_panel=RUN_PANEL
        ),
    ] = None,
    sensor: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="Of a scenario: its errors are those of a unit of this sensor of the catalogue "
            "(strapdown modules), or of a .toml file of your own.",
            rich_help_panel=RUN_PANEL,
        ),
    ] = None,
    *,
    log: LogFlags,
    export_c: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.c",
            help="Write the algorithm that the answer chose (or the only one named) as C99, with "
            "a test vector of this log.",
            rich_help_panel=OUT_PANEL,
        ),
    ] = None,
    timing: Annotated[
        bool,
        typer.Option(
            "--timing",
            help="Print how long a sample takes on this machine (it is in timing.json, too).",
            rich_help_panel=OUT_PANEL,
        ),
    ] = False,
    png: Annotated[
        bool, typer.Option("--png", help="Draw the figures as PNG, too.", rich_help_panel=OUT_PANEL)
    ] = False,
    out: Annotated[Path | None, folder_to_make("LOG-attitude")] = None,
    write: OutFlags,
) -> None:
    """Find the simplest attitude algorithm, and the lowest rate, of sufficient accuracy.

    Runs attitude algorithms over a gyro log or a scenario at its own and at lower rates, compares
    them with the known attitude, splits their error into the sensor's and their own, counts their
    cost, and writes the answer with tables, JSON, CSV, a report page and its figures.
    """
    from strapdown.api.attitude import compare_attitude
    from strapdown.attitude import make_algorithm
    from strapdown.attitude.cost import time_algorithms
    from strapdown.bundle.seal import check_destination, write_timing
    from strapdown.cli.attitude_tables import print_bench, print_speed
    from strapdown.cli.console import Stopwatch, console, print_findings, print_seal, progress
    from strapdown.cli.result_folder import default_folder, refuse_result
    from strapdown.formats.columns import parse_column_option
    from strapdown.report.attitude import attitude_json, check_c, chosen_for_c, write_c

    for source in sources:
        refuse_result(source, "log")
    folder = out or default_folder(sources[0], "attitude")
    check_destination(folder, write.force)
    check_c(export_c, write.force)
    with progress(write.quiet or write.json) as show:
        report = Stopwatch(show)
        bench = compare_attitude(
            sources,
            _split(algorithms),
            rates_hz=_numbers(rates),
            tolerance_deg=tolerance_deg,
            reference=reference or [],
            gyro_bias=gyro_bias,
            options={
                "interpolation": interpolation,
                "trials": trials,
                "reference_log": reference_log,
                "peers": (peers or "").replace(",", " ").split(),
                "initial": initial,
                "rate": log.rate,
                "sampling": log.sampling,
                "seed": seed,
                "sensor": sensor,
                "columns": parse_column_option(log.columns or []),
                "gyro_unit": log.gyro_unit,
                "accel_unit": log.accel_unit,
                "time_unit": log.time_unit,
                "axes": log.axes,
                "repair": log.repair,
                "from_s": log.from_s,
                "to_s": log.to_s,
                "duration_s": log.duration,
            },
            progress=report,
        )
        if export_c is not None:
            chosen_for_c(bench)
        report("writing", 0.95)
        seal = bench.save(folder, force=write.force, png=png)
        if export_c is not None:
            exported = write_c(bench, export_c, force=write.force)
        report("timing", 0.99)
        taken = time_algorithms([make_algorithm(run.algorithm) for run in bench.runs])
        report.stop()
        of_sample = {
            str(name): {"float64": round(double, 1), "float32": round(single, 1)}
            for name, double, single in taken.itertuples(index=False)
        }
        write_timing(seal, report.seconds, of_sample)
    if write.json:
        typer.echo(json_module.dumps(attitude_json(bench), indent=2, ensure_ascii=False))
        return
    if write.quiet:
        return
    print_bench(bench)
    if timing:
        print_speed(taken)
    print_findings(bench.findings)
    print_seal(seal, "report.html")
    if export_c is not None:
        console().print(f"C99   {export_c}: {exported}", soft_wrap=True)


def _numbers(text: str | None) -> list[float]:
    """Parse numbers separated by blanks or commas."""
    from strapdown.errors import ConfigError

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
