"""``strapdown navigate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from strapdown.cli.log_options import (
    RUN_PANEL,
    AccelUnit,
    Axes,
    Columns,
    Duration,
    From,
    GyroUnit,
    Rate,
    Repair,
    Sampling,
    TimeUnit,
)
from strapdown.cli.result_options import RESULT_PANEL, Force, Json, Quiet

EPILOG = (
    "Example: strapdown navigate log.csv --gnss fixes.csv --sensor adis16470\n\n"
    "Example: strapdown navigate navigate.toml (strapdown init navigate LOG writes one)"
)
MOST = 6  # findings on the terminal
_WITH = "With what"


def navigate(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="LOG|CONFIG.toml",
            help="A log of gyros and accelerometers, or the file of a run of navigation.",
        ),
    ],
    gnss: Annotated[
        Path | None,
        typer.Option(metavar="FIXES", help="Fixes of a satellite receiver.", rich_help_panel=_WITH),
    ] = None,
    lever_arm: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z",
            help="Of its antenna from the sensors, forward, right, down, m (0,0,0).",
            rich_help_panel=_WITH,
        ),
    ] = None,
    sensor: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="How good the sensors are: a sensor of the catalogue (strapdown modules), or a "
            ".toml file of your own.",
            rich_help_panel=_WITH,
        ),
    ] = None,
    lat: Annotated[
        float | None,
        typer.Option(
            metavar="DEG", help="Latitude at the start, without fixes.", rich_help_panel=_WITH
        ),
    ] = None,
    lon: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="Longitude, east positive.", rich_help_panel=_WITH),
    ] = None,
    alt: Annotated[
        float | None,
        typer.Option(metavar="M", help="Height over the ellipsoid (0).", rich_help_panel=_WITH),
    ] = None,
    heading: Annotated[
        float | None,
        typer.Option(
            metavar="DEG",
            help="Heading at the start, where neither the gyros nor a course can tell it.",
            rich_help_panel=_WITH,
        ),
    ] = None,
    truth: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A trajectory to compare with.", rich_help_panel=_WITH),
    ] = None,
    points: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Control points (time, north, east) to score the path by, after the origin and "
            "heading that fit best.",
            rich_help_panel=_WITH,
        ),
    ] = None,
    smooth: Annotated[
        bool,
        typer.Option(
            "--smooth",
            help="When it has ended, tell every state by all observations, later ones too.",
            rich_help_panel=RUN_PANEL,
        ),
    ] = False,
    from_s: From = None,
    duration: Duration = None,
    pace: Annotated[
        str | None,
        typer.Option(
            metavar="N|max",
            help="Play the record sample by sample, N times as fast as it was taken, and tell how "
            "long each sample takes.",
            rich_help_panel=RUN_PANEL,
        ),
    ] = None,
    live: Annotated[
        str | None,
        typer.Option(
            metavar="-|udp://HOST:PORT",
            help="Take samples as they come, as lines of standard input or of datagrams, by the "
            "file of a run.",
            rich_help_panel=RUN_PANEL,
        ),
    ] = None,
    every: Annotated[
        float,
        typer.Option(
            metavar="S",
            help="With --live: a line of the state so often.",
            rich_help_panel=RUN_PANEL,
        ),
    ] = 1.0,
    lines: Annotated[
        str,
        typer.Option(metavar="json|csv", help="With --live: as what.", rich_help_panel=RUN_PANEL),
    ] = "json",
    rate: Rate = None,
    sampling: Sampling = None,
    columns: Columns = None,
    gyro_unit: GyroUnit = None,
    accel_unit: AccelUnit = None,
    time_unit: TimeUnit = None,
    axes: Axes = None,
    repair: Repair = False,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Folder to make (LOG-navigate).", rich_help_panel=RESULT_PANEL
        ),
    ] = None,
    force: Force = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find place, velocity and attitude over a record, from inertial sensors and what aids them."""
    from strapdown.bundle import check_destination, write_latency, write_timing
    from strapdown.cli.align_options import flag_words
    from strapdown.cli.console import Stopwatch, print_findings, print_seal, progress
    from strapdown.cli.latency_table import print_latency
    from strapdown.cli.navigate_options import FLAGS, navigation_of_flags
    from strapdown.cli.navigate_tables import print_navigation
    from strapdown.config.navigation_file import read_navigation_spec
    from strapdown.live.replay import Replay, parse_pace
    from strapdown.report.navigation import write_navigation
    from strapdown.systems.sins.run import run_navigation

    folder = out or Path(f"{source.resolve().stem}-navigate")
    check_destination(folder, force)
    played = None if pace is None else Replay(parse_pace(pace))
    given: dict[str, Any] = {
        "gnss": gnss,
        "lever_arm": lever_arm,
        "sensor": sensor,
        "lat": lat,
        "lon": lon,
        "alt": alt,
        "heading": heading,
        "truth": truth,
        "points": points,
        "smooth": smooth or None,
        "from_s": from_s,
        "duration": duration,
        "rate": rate,
        "sampling": sampling,
        "columns": columns,
        "gyro_unit": gyro_unit,
        "accel_unit": accel_unit,
        "time_unit": time_unit,
        "axes": axes,
        "repair": repair or None,
    }
    if live is not None:
        from strapdown.cli.navigate_live import navigate_live

        refused = {f"--{name.replace('_', '-')}": value for name, value in given.items()}
        navigate_live(
            source,
            live,
            folder,
            lines=lines,
            every=every,
            force=force,
            quiet=quiet,
            given={**refused, "--pace": pace, "--json": json or None},
        )
        return
    own = source.suffix.lower() == ".toml"
    with progress(quiet or json) as show:
        report = Stopwatch(show)
        if own:
            flag_words(source, given, "the file of a run", FLAGS)
            spec = read_navigation_spec(source)
        else:
            report("looking through", 0.01)
            spec = navigation_of_flags(source, given)
        drive: dict[str, Any] = {} if played is None else {"drive": played}
        result = run_navigation(spec, source if own else None, report, **drive)
        seal = write_navigation(result, folder, force=force, progress=report)
        report.stop()
        write_timing(seal, report.seconds)
        latency = None if played is None else played.tape.latency()
        if latency is not None:
            write_latency(seal, {"pace": pace, **latency.told()})
    if json:
        typer.echo((seal.path / "navigation.json").read_text(encoding="utf-8"), nl=False)
        return
    if quiet:
        return
    print_navigation(result)
    if latency is not None:
        print_latency(latency, f"played, pace {pace}")
    print_findings(result.findings, MOST)
    print_seal(seal, "report.html")
