"""``strapdown coast``."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import typer

from strapdown.cli.shared_options import (
    RUN_PANEL,
    OutFlags,
    folder_to_make,
    part_from,
    part_long,
    part_to,
    spread,
)

EPILOG = (
    "Example: strapdown coast adis16470 --outage 60 --speed 15 --with no_slip\n\n"
    "Example: strapdown coast drive-navigate --outage 30 (a folder of strapdown navigate)"
)
_WHAT, _START, _WHERE = (
    "Motion, for a sensor",
    "Initial standard deviations, for a sensor",
    "Instants, for a navigation run",
)


@dataclass(frozen=True)
class MotionFlags:
    """Motion of a sensor, by key of its table."""

    speed_m_per_s: Annotated[
        float | None,
        typer.Option(
            "--speed", metavar="M/S", help="It goes so fast (0: it stands).", rich_help_panel=_WHAT
        ),
    ] = None
    to_speed_m_per_s: Annotated[
        float | None,
        typer.Option(
            "--to-speed",
            metavar="M/S",
            help="To which it comes over the outage.",
            rich_help_panel=_WHAT,
        ),
    ] = None
    turn_rate_deg_per_s: Annotated[
        float | None,
        typer.Option(
            "--turn-rate", metavar="DEG/S", help="It turns, to the right.", rich_help_panel=_WHAT
        ),
    ] = None
    heading_deg: Annotated[
        float | None,
        typer.Option("--heading", metavar="DEG", help="Where it goes (45).", rich_help_panel=_WHAT),
    ] = None
    lat_deg: Annotated[
        float | None,
        typer.Option("--lat", metavar="DEG", help="Latitude (45).", rich_help_panel=_WHAT),
    ] = None


@dataclass(frozen=True)
class StartFlags:
    """Initial standard deviations, by key of the table."""

    aided_s: Annotated[
        float | None,
        typer.Option(
            "--aided",
            metavar="S",
            help="So long a drive with fixes before it (600); 0: what an alignment leaves.",
            rich_help_panel=_START,
        ),
    ] = None
    fix_position_sd_m: Annotated[
        float | None,
        typer.Option(
            "--fix-sd",
            metavar="M",
            help="Of these fixes, one a second (1.5).",
            rich_help_panel=_START,
        ),
    ] = None
    position_sd_m: Annotated[
        float | None,
        typer.Option(
            "--position-sd",
            metavar="M",
            help="In place of what that leaves, each axis; so the following.",
            rich_help_panel=_START,
        ),
    ] = None
    velocity_sd_m_per_s: Annotated[
        float | None,
        typer.Option("--velocity-sd", metavar="M/S", help="Each axis.", rich_help_panel=_START),
    ] = None
    tilt_sd_deg: Annotated[
        float | None,
        typer.Option("--tilt-sd", metavar="DEG", help="Roll and pitch.", rich_help_panel=_START),
    ] = None
    heading_sd_deg: Annotated[
        float | None,
        typer.Option("--heading-sd", metavar="DEG", help="Heading.", rich_help_panel=_START),
    ] = None
    gyro_bias_sd_deg_per_h: Annotated[
        float | None,
        typer.Option(
            "--gyro-bias-sd",
            metavar="DEG/H",
            help="Gyro biases after alignment or aiding.",
            rich_help_panel=_START,
        ),
    ] = None
    accel_bias_sd_ug: Annotated[
        float | None,
        typer.Option(
            "--accel-bias-sd",
            metavar="UG",
            help="Accelerometer biases after alignment or aiding, µg.",
            rich_help_panel=_START,
        ),
    ] = None


@dataclass(frozen=True)
class OutageFlags:
    """Outages of a navigation run, by key of its table."""

    at_s: Annotated[
        float | None,
        typer.Option(
            "--at",
            metavar="S",
            help="The outage begins at this stamp of the log; even places, if not given.",
            rich_help_panel=_WHERE,
        ),
    ] = None
    places: Annotated[
        int | None,
        typer.Option(metavar="N", help="So many outages, evenly (10).", rich_help_panel=_WHERE),
    ] = None
    from_s: Annotated[float | None, part_from("where the filter has settled", _WHERE)] = None
    to_s: Annotated[float | None, part_to(_WHERE)] = None
    duration_s: Annotated[float | None, part_long(_WHERE)] = None


@spread
def coast(
    source: Annotated[
        str,
        typer.Argument(
            metavar="SENSOR|BUNDLE",
            help="A sensor of the catalogue (strapdown modules) or a .toml file of your own; or a "
            "folder that strapdown navigate wrote, or the file of such a run, whose receivers are "
            "then taken away.",
        ),
    ],
    *,
    outage: Annotated[
        float,
        typer.Option(
            metavar="S",
            help="How long nothing aids it (60).",
            show_default=False,
            rich_help_panel=RUN_PANEL,
        ),
    ] = 60.0,
    motion: MotionFlags,
    keep: Annotated[
        list[str] | None,
        typer.Option(
            "--with",
            metavar="AID",
            help="An aid that stays, with options after a colon: no_slip, odometer, "
            "zero_velocity, zero_rate:sd_deg_per_s=0.1; again for another.",
            rich_help_panel=_WHAT,
        ),
    ] = None,
    start: StartFlags,
    run: OutageFlags,
    out: Annotated[Path | None, folder_to_make("SENSOR-coast, or DRIVE-coast")] = None,
    write: OutFlags,
) -> None:
    """Predict the drift during a GNSS outage, and the sources of the drift.

    For a sensor the prediction uses its data sheet and a stated motion. For a navigation run it
    uses the filter's own state, and compares the prediction with the measured drifts.
    """
    from strapdown.api.alignment import run_outage
    from strapdown.bundle.seal import check_destination, write_timing
    from strapdown.cli.coast_options import coast_of_flags
    from strapdown.cli.coast_tables import print_coast
    from strapdown.cli.console import WORDS, Stopwatch, print_findings, print_seal, progress
    from strapdown.cli.result_folder import default_folder, source_name
    from strapdown.report.coast import read_coasting_run
    from strapdown.systems.inputs import check_part

    check_part(run.from_s, run.to_s, run.duration_s)
    navigation, file = read_coasting_run(source)
    named = None if navigation is None or file is None else source_name(navigation)
    folder = out or default_folder(source, "coast", named)
    check_destination(folder, write.force)
    with progress(write.quiet or write.json) as show:
        report = Stopwatch(show)
        spec = coast_of_flags(
            source,
            outage,
            navigation is not None,
            motion=asdict(motion),
            start=asdict(start),
            keep=keep or [],
            run=asdict(run),
        )
        if navigation is not None:
            WORDS.set("file")
        result = run_outage(spec, navigation, file, report)
        seal = result.save(folder, force=write.force, progress=report)
        report.stop()
        write_timing(seal, report.seconds)
    if write.json:
        typer.echo((seal.path / "coast.json").read_text(encoding="utf-8"), nl=False)
        return
    if write.quiet:
        return
    print_coast(result)
    print_findings(result.findings)
    print_seal(seal, "report.html")
