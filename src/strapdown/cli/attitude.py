"""``strapdown attitude``."""

from __future__ import annotations

import json as json_module
from pathlib import Path
from typing import Annotated

import typer

EPILOG = (
    "Example: strapdown attitude alexiev-fig4 --rate 100   |   "
    "Example: strapdown attitude log.csv --gyro-unit deg/s --reference 'end same as start'"
)
_LOG, _RUN, _OUT = "How to read the log", "What to run", "What to write"


def attitude(
    source: Annotated[
        str,
        typer.Argument(
            metavar="LOG|SCENARIO",
            help="A log (CSV, .mat, .h5, .npz, or the folder of a known recording), or the name "
            "of a scenario (see: strapdown modules).",
        ),
    ],
    algorithms: Annotated[
        str,
        typer.Option(
            help="Names joined by blanks or commas, with options after a colon: 'naive euler "
            "euler:step=rk4 dcm:order=3 quaternion'.",
            rich_help_panel=_RUN,
        ),
    ] = "naive euler dcm quaternion",
    reference: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WORDS|FILE",
            help="What is known, as often as you like: 'end same as start', 'end 2 turns about z "
            "since start', '12.5 roll 0 pitch 0 heading 90', a file of such lines (.txt .toml "
            ".csv), or an attitude truth.",
            rich_help_panel=_RUN,
        ),
    ] = None,
    initial: Annotated[
        str,
        typer.Option(
            metavar="ATTITUDE",
            help="auto, truth, level, zero, or roll,pitch,heading in deg.",
            rich_help_panel=_RUN,
        ),
    ] = "auto",
    gyro_bias: Annotated[
        str,
        typer.Option(
            metavar="BIAS",
            help="none; rest (mean of the first stationary stretch); 'x,y,z deg/s' about forward, "
            "right, down; or a log of the sensor lying still.",
            rich_help_panel=_RUN,
        ),
    ] = "none",
    from_s: Annotated[
        float | None, typer.Option("--from", metavar="S", help="Begin here.", rich_help_panel=_RUN)
    ] = None,
    to_s: Annotated[
        float | None, typer.Option("--to", metavar="S", help="End here.", rich_help_panel=_RUN)
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option(
            metavar="HZ",
            help="Rate of a scenario (100), or of a log without a time column.",
            rich_help_panel=_LOG,
        ),
    ] = None,
    sampling: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help="instantaneous (the rate at the stamp) or mean (over the interval that ends "
            "there).",
            rich_help_panel=_LOG,
        ),
    ] = None,
    columns: Annotated[
        list[str] | None,
        typer.Option(
            metavar="Q=NAME",
            help="time=t,gyro_x=wx,… ; a number counts columns from 1; gyro=NAME for an array of "
            "three.",
            rich_help_panel=_LOG,
        ),
    ] = None,
    gyro_unit: Annotated[
        str | None,
        typer.Option(metavar="UNIT", help="rad/s, deg/s, …", rich_help_panel=_LOG),
    ] = None,
    accel_unit: Annotated[
        str | None,
        typer.Option(
            metavar="UNIT",
            help="m/s2, g, mg; -g or -m/s2 for the other sign (iOS).",
            rich_help_panel=_LOG,
        ),
    ] = None,
    time_unit: Annotated[
        str | None, typer.Option(metavar="UNIT", help="s, ms, us, ns.", rich_help_panel=_LOG)
    ] = None,
    axes: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z",
            help="Sensor axes that point forward, right, down: 'x,-y,-z' for a sensor whose axes "
            "point forward, left, up.",
            rich_help_panel=_LOG,
        ),
    ] = None,
    repair: Annotated[
        bool,
        typer.Option(
            "--repair",
            help="Leave out rows that cannot be used, undo a wrapped clock, and say so.",
            rich_help_panel=_LOG,
        ),
    ] = False,
    seed: Annotated[
        int | None, typer.Option(help="Of a scenario's noise (0).", rich_help_panel=_RUN)
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder to make; named after the input if not given.",
            rich_help_panel=_OUT,
        ),
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Replace a result that is there.", rich_help_panel=_OUT)
    ] = False,
    json: Annotated[
        bool,
        typer.Option("--json", help="Print the result as JSON alone.", rich_help_panel=_OUT),
    ] = False,
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="Print nothing but errors.", rich_help_panel=_OUT)
    ] = False,
) -> None:
    """Tell how far each attitude algorithm can be trusted on this log.

    Runs Alexiev's four algorithms (naive, Euler-Krylov, direction cosines, quaternion) over a
    gyro log or a scenario, compares them with what is known, and writes a table, JSON, CSV, a
    report page and its figures.
    """
    from strapdown.bundle import check_destination, write_timing
    from strapdown.cli.attitude_tables import print_bench
    from strapdown.cli.console import Stopwatch, print_findings, print_seal, progress
    from strapdown.formats.columns import parse_column_option
    from strapdown.report.attitude import attitude_json, write_attitude
    from strapdown.systems.attitude_bench import bench_attitude

    folder = out or Path(f"{Path(source).resolve().stem}-attitude")
    check_destination(folder, force)
    with progress(quiet or json) as show:
        report = Stopwatch(show)
        bench = bench_attitude(
            source,
            algorithms=_split(algorithms),
            reference=reference or [],
            initial=initial,
            gyro_bias=gyro_bias,
            rate=rate,
            sampling=sampling,
            seed=seed,
            columns=parse_column_option(columns or []),
            gyro_unit=gyro_unit,
            accel_unit=accel_unit,
            time_unit=time_unit,
            axes=axes,
            repair=repair,
            from_s=from_s,
            to_s=to_s,
            progress=report,
        )
        report("writing", 0.95)
        seal = write_attitude(bench, folder, force=force)
        report.stop()
        write_timing(seal, report.seconds)
    if json:
        typer.echo(json_module.dumps(attitude_json(bench), indent=2, ensure_ascii=False))
        return
    if quiet:
        return
    print_bench(bench)
    print_findings(bench.findings)
    print_seal(seal, "report.html")


def _split(text: str) -> list[str]:
    """Names with options; a comma inside options belongs to them."""
    names: list[str] = []
    for word in text.replace(",", " , ").split():
        if word == ",":
            continue
        if "=" in word and ":" not in word and names:
            names[-1] += f",{word}"
        else:
            names.append(word)
    return names
