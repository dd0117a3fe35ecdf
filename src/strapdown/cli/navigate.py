"""``strapdown navigate``."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from strapdown.cli.shared_options import (
    RUN_PANEL,
    WITH_PANEL,
    LogFlags,
    OutFlags,
    folder_to_make,
    spread,
)

EPILOG = (
    "Example: strapdown navigate log.csv --gnss fixes.csv --sensor adis16470\n\n"
    "Example: strapdown navigate navigate.toml (strapdown init navigate LOG writes one)"
)


@dataclass(frozen=True)
class NavigateFlags:
    """Measurements, start and mode of a navigation run."""

    gnss: Annotated[
        Path | None,
        typer.Option(
            metavar="FIXES", help="Fixes of a satellite receiver.", rich_help_panel=WITH_PANEL
        ),
    ] = None
    lever_arm: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z",
            help="Of its antenna from the sensors, forward, right, down, m (0,0,0).",
            rich_help_panel=WITH_PANEL,
        ),
    ] = None
    sensor: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="How good the sensors are: a sensor of the catalogue (strapdown modules), or a "
            ".toml file of your own.",
            rich_help_panel=WITH_PANEL,
        ),
    ] = None
    lat: Annotated[
        float | None,
        typer.Option(
            metavar="DEG", help="Latitude at the start, without fixes.", rich_help_panel=WITH_PANEL
        ),
    ] = None
    lon: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="Longitude, east positive.", rich_help_panel=WITH_PANEL),
    ] = None
    alt: Annotated[
        float | None,
        typer.Option(
            metavar="M", help="Height over the ellipsoid (0).", rich_help_panel=WITH_PANEL
        ),
    ] = None
    heading: Annotated[
        float | None,
        typer.Option(
            metavar="DEG",
            help="Initial heading, if neither gyros nor course determine it.",
            rich_help_panel=WITH_PANEL,
        ),
    ] = None
    truth: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="A trajectory to compare with.", rich_help_panel=WITH_PANEL
        ),
    ] = None
    points: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Control points (time, north, east) to score the path by, after the origin and "
            "heading that fit best.",
            rich_help_panel=WITH_PANEL,
        ),
    ] = None
    smooth: Annotated[
        bool,
        typer.Option(
            "--smooth",
            help="Smooth the run: estimate every state from all measurements (RTS).",
            rich_help_panel=RUN_PANEL,
        ),
    ] = False
    pace: Annotated[
        str | None,
        typer.Option(
            metavar="N|max",
            help="Replay the record sample by sample, N times as fast as recorded, and report "
            "the latency of each sample.",
            rich_help_panel=RUN_PANEL,
        ),
    ] = None
    live: Annotated[
        str | None,
        typer.Option(
            metavar="-|udp://HOST:PORT",
            help="Take samples as they come, as lines of standard input or of datagrams, by the "
            "file of a run.",
            rich_help_panel=RUN_PANEL,
        ),
    ] = None
    every: Annotated[
        float,
        typer.Option(
            metavar="S",
            help="With --live: a line of the state so often (1).",
            show_default=False,
            rich_help_panel=RUN_PANEL,
        ),
    ] = 1.0
    lines: Annotated[
        str,
        typer.Option(
            metavar="json|csv",
            help="With --live: as what (json).",
            show_default=False,
            rich_help_panel=RUN_PANEL,
        ),
    ] = "json"


@spread
def navigate(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="LOG|CONFIG.toml",
            help="A log of gyros and accelerometers, or the file of a run of navigation.",
        ),
    ],
    flags: NavigateFlags,
    *,
    log: LogFlags,
    out: Annotated[Path | None, folder_to_make("LOG-navigate")] = None,
    write: OutFlags,
) -> None:
    """Find position, velocity and attitude over a record, by inertial sensors and measurements."""
    from strapdown.api.navigation import smoothed_too
    from strapdown.bundle.seal import check_destination, write_latency, write_timing
    from strapdown.cli.align_options import flag_of, refuse_beside_file
    from strapdown.cli.console import WORDS, Stopwatch, print_seal, progress
    from strapdown.cli.navigate_options import FLAGS, navigation_of_flags
    from strapdown.cli.navigate_tables import print_navigation
    from strapdown.cli.result_folder import default_folder, refuse_result, source_name
    from strapdown.config.navigation import NavigationSpec
    from strapdown.live.replay import Replay, parse_pace
    from strapdown.systems.navigation_run import run_navigation

    refuse_result(source, "log")
    played = None
    if flags.pace is not None:
        from strapdown.live.replay import Replay, parse_pace

        played = Replay(parse_pace(flags.pace))
    given: dict[str, Any] = {**asdict(flags), "smooth": flags.smooth or None, **log.given()}
    pace, live = given.pop("pace"), given.pop("live")
    every, lines = given.pop("every"), given.pop("lines")
    own = source.suffix.lower() == ".toml"
    if own and live is None:
        refuse_beside_file(source, {**given, "smooth": None}, FLAGS)
    if own:
        WORDS.set("file")
    asked = NavigationSpec.read(source) if own else None
    if asked is not None and flags.smooth:
        asked = smoothed_too(asked)
    folder = out or default_folder(
        source, "navigate", None if asked is None else source_name(asked)
    )
    check_destination(folder, write.force)
    if live is not None:
        from strapdown.cli.navigate_live import navigate_live

        refused = {flag_of(name): value for name, value in given.items()}
        navigate_live(
            source,
            live,
            folder,
            lines=lines,
            every=every,
            force=write.force,
            quiet=write.quiet,
            given={**refused, "--pace": pace, "--json": write.json or None},
        )
        return
    with progress(write.quiet or write.json) as show:
        report = Stopwatch(show)
        report("looking through", 0.01)
        spec = navigation_of_flags(source, given) if asked is None else asked
        drive: dict[str, Any] = {} if played is None else {"drive": played}
        result = run_navigation(spec, source if own else None, report, **drive)
        seal = result.save(folder, force=write.force, progress=report)
        report.stop()
        write_timing(seal, report.seconds)
        latency = None if played is None else played.tape.latency()
        if latency is not None:
            write_latency(seal, {"pace": pace, **latency.told()})
    if write.json:
        typer.echo((seal.path / "navigation.json").read_text(encoding="utf-8"), nl=False)
        return
    if write.quiet:
        return
    print_navigation(result, result.findings, verbose=write.verbose)
    if latency is not None:
        from strapdown.cli.latency_table import print_latency

        print_latency(latency, f"played, pace {pace}")
    print_seal(seal, "report.html")
