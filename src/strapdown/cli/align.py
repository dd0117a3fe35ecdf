"""``strapdown align``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from strapdown.cli import shared_options as options
from strapdown.cli.console import WORDS, console, print_blocks, print_findings
from strapdown.cli.result_folder import folder_to_write, refuse_result, run_and_save, source_name
from strapdown.errors import ConfigError

if TYPE_CHECKING:
    from strapdown.config.alignment import AlignmentSpec
    from strapdown.progress import Progress
    from strapdown.systems.alignment_run import AlignmentRun

EPILOG = (
    "Example: strapdown align log.csv --lat 55.75 --lon 37.62 --alt 150 --sensor fog-1000\n\n"
    "Example: strapdown align align.toml (strapdown init align LOG writes one)"
)
MOST = 6  # findings on the terminal


@dataclass(frozen=True)
class AlignFlags:
    """Position, sensor and method of an alignment."""

    lat: float | None = options.with_what("DEG", "Latitude, north positive.")
    lon: float | None = options.LONGITUDE
    alt: float | None = options.HEIGHT
    sensor: str | None = options.SENSOR_MODEL
    method: str = options.running(
        "NAME",
        "Coarse alignment, with options after a colon: inertial_frame (the body may "
        "rock), two_vector, levelling, known_heading:heading_deg=90,sd_deg=1, gnss_course "
        "(inertial_frame).",
        default="inertial_frame",
    )
    coarse_only: bool = options.running(
        None, "No fine alignment after it.", "--coarse-only", default=False
    )
    gnss: Path | None = options.running(
        "FIXES", "Fixes of a satellite receiver, for --method gnss_course."
    )
    prefilter: str = options.running(
        "NAME",
        "Pre-filter of the samples, with options after a colon: robust_fir:rate_hz=100 (none).",
        default="none",
    )


#: Flags by key path of the specification.
FLAGS = {
    "site, lat_deg": "--lat",
    "site, lon_deg": "--lon",
    "site, alt_m": "--alt",
    "sensors, sensor": "--sensor",
    "gnss, path": "--gnss",
    "coarse, kind": "--method",
    "prefilter, kind": "--prefilter",
    **options.LOG_FLAGS,
    **options.fix_flags("gnss"),
}


@options.spread
def align(
    source: Path = typer.Argument(
        metavar="LOG|CONFIG.toml",
        help="A log of gyros and accelerometers of a stationary body, or the file of an alignment.",
    ),
    *,
    flags: AlignFlags,
    log: options.LogFlags,
    fixes: options.FixFlags,
    out: Path | None = options.folder_to_make("LOG-align"),
    write: options.ReportFlags,
) -> None:
    """Find roll, pitch and heading of a stationary body from its gyros and accelerometers.

    A coarse alignment finds north from the Earth's rotation, a filter refines it and estimates
    drifts and biases; the report states the uncertainty of each, its limits, and the alignment
    time.
    """
    from strapdown.config.alignment import AlignmentSpec
    from strapdown.systems.alignment_run import run_alignment

    given: dict[str, Any] = {
        **asdict(flags),
        "method": None if flags.method == "inertial_frame" else flags.method,
        "coarse_only": flags.coarse_only or None,
        "prefilter": None if flags.prefilter == "none" else flags.prefilter,
        **log.given(),
        **fixes.given(),
    }
    refuse_result(source, "log")
    own = source.suffix.lower() == ".toml"
    if own:
        options.refuse_beside_file(source, given, FLAGS)
        WORDS.set("file")
    asked = AlignmentSpec.read(source) if own else None

    def compute(report: Progress) -> AlignmentRun:
        spec = spec_of_flags(source, given) if asked is None else asked
        return run_alignment(spec, source if own else None, report)

    folder = folder_to_write(
        out, source, "align", write.force, None if asked is None else source_name(asked)
    )
    run_and_save(compute, folder, write, "align.json", print_alignment)


def spec_of_flags(log: Path, given: Mapping[str, Any]) -> AlignmentSpec:
    """Return the specification by the flags; the position may come from the log.

    ConfigError: a value is invalid or missing; the message names the flag. DataError: the log
    cannot be read.
    """
    from strapdown.api.alignment import specify_alignment
    from strapdown.api.reading import ImuFile
    from strapdown.config.logs import LogTable
    from strapdown.config.spec import specify

    site = {"lat_deg": given["lat"], "lon_deg": given["lon"], "alt_m": given["alt"]}
    keys, fixes = options.log_keys(given), options.fix_keys(given, given["gnss"])
    try:
        table = specify(LogTable, path=str(log), **keys)
        return specify_alignment(
            ImuFile(table, given["axes"]),
            site={key: float(value) for key, value in site.items() if value is not None},
            sensor=given["sensor"],
            coarse=options.module_of_flag(given["method"] or "inertial_frame"),
            fine=not given["coarse_only"],
            gnss={"path": str(log), **fixes} if fixes else None,
            prefilter=options.module_of_flag(given["prefilter"] or "none"),
            called=lambda argument: f"--{argument}",
        )
    except ConfigError as error:
        raise options.as_flag(error, FLAGS, _flag) from None


def _flag(place: str) -> str:
    # A path that names a flag already is kept.
    said = [part for part in place.split(", ") if part.startswith("--")]
    if said:
        return said[-1]
    stage, _, rest = place.partition(", ")
    flag = FLAGS.get(f"{stage}, kind") or FLAGS.get(f"log, {place}")
    return place if flag is None else f"{flag}, {rest}" if rest else flag


def print_alignment(result: AlignmentRun) -> None:
    """Print the result of an alignment, its limits and its findings."""
    from strapdown.report import alignment_document as tables
    from strapdown.report.alignment_document import trust
    from strapdown.report.values import spaced

    out = console()
    site = result.site
    out.print(
        f"{result.source.name}: {result.source.what}, "
        f"{float(result.imu.index[-1] - result.imu.index[0]):.6g} s at {site.lat_deg:.5f}°, "
        f"{site.lon_deg:.5f}°"
    )
    print_blocks(
        tables.answer_table(result), tables.readiness_table(result), tables.bias_table(result)
    )
    out.print(spaced(tables.headline(result)), style="bold")
    found = trust(result)
    style = {"trusted": "green", "reserve": "yellow", "distrusted": "bold red"}[found.verdict]
    out.print(spaced(found.sentence), style=style)
    for head, text in tables.limits(result):
        out.print(spaced(f"  - {head}: {text}"))
    print_findings(result.findings, MOST)
