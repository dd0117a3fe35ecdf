"""``strapdown align``."""

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
    "Example: strapdown align log.csv --lat 55.75 --lon 37.62 --alt 150 --sensor fog-1000\n\n"
    "Example: strapdown align align.toml (strapdown init align LOG writes one)"
)
MOST = 6  # findings on the terminal


@dataclass(frozen=True)
class AlignFlags:
    """Position, sensor and method of an alignment."""

    lat: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="Latitude, north positive.", rich_help_panel=WITH_PANEL),
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
    sensor: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="How good the sensors are: a sensor of the catalogue (strapdown modules), or a "
            ".toml file of your own.",
            rich_help_panel=WITH_PANEL,
        ),
    ] = None
    method: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="Coarse alignment, with options after a colon: inertial_frame (the body may "
            "rock), two_vector, levelling, known_heading:heading_deg=90,sd_deg=1, gnss_course "
            "(inertial_frame).",
            show_default=False,
            rich_help_panel=RUN_PANEL,
        ),
    ] = "inertial_frame"
    coarse_only: Annotated[
        bool,
        typer.Option(
            "--coarse-only", help="No fine alignment after it.", rich_help_panel=RUN_PANEL
        ),
    ] = False
    gnss: Annotated[
        Path | None,
        typer.Option(
            metavar="FIXES",
            help="Fixes of a satellite receiver, for --method gnss_course.",
            rich_help_panel=RUN_PANEL,
        ),
    ] = None
    prefilter: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="Pre-filter of the samples, with options after a colon: "
            "robust_fir:rate_hz=100 (none).",
            show_default=False,
            rich_help_panel=RUN_PANEL,
        ),
    ] = "none"


@spread
def align(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="LOG|CONFIG.toml",
            help="A log of gyros and accelerometers of a body that stays at its place, or the "
            "file of an alignment.",
        ),
    ],
    flags: AlignFlags,
    *,
    log: LogFlags,
    out: Annotated[Path | None, folder_to_make("LOG-align")] = None,
    write: OutFlags,
) -> None:
    """Find roll, pitch and heading of a stationary body from its gyros and accelerometers.

    A coarse alignment finds north from the Earth's rotation, a filter refines it and estimates
    drifts and biases; the report states the uncertainty of each, its limits, and the alignment
    time.
    """
    from strapdown.api.alignment import run_specified
    from strapdown.bundle.seal import check_destination, write_timing
    from strapdown.cli.align_options import refuse_beside_file, spec_of_flags
    from strapdown.cli.align_tables import print_alignment
    from strapdown.cli.console import WORDS, Stopwatch, print_findings, print_seal, progress
    from strapdown.cli.result_folder import default_folder, refuse_result, source_name
    from strapdown.config.alignment import AlignmentSpec

    given: dict[str, Any] = {
        **asdict(flags),
        "method": None if flags.method == "inertial_frame" else flags.method,
        "coarse_only": flags.coarse_only or None,
        "prefilter": None if flags.prefilter == "none" else flags.prefilter,
        **log.given(),
    }
    refuse_result(source, "log")
    own = source.suffix.lower() == ".toml"
    if own:
        refuse_beside_file(source, given)
        WORDS.set("file")
    asked = AlignmentSpec.read(source) if own else None
    folder = out or default_folder(source, "align", None if asked is None else source_name(asked))
    check_destination(folder, write.force)
    with progress(write.quiet or write.json) as show:
        report = Stopwatch(show)
        spec = spec_of_flags(source, given) if asked is None else asked
        result = run_specified(spec, source if own else None, report)
        seal = result.save(folder, force=write.force, progress=report)
        report.stop()
        write_timing(seal, report.seconds)
    if write.json:
        typer.echo((seal.path / "align.json").read_text(encoding="utf-8"), nl=False)
        return
    if write.quiet:
        return
    print_alignment(result)
    print_findings(result.findings, MOST)
    print_seal(seal, "report.html")
