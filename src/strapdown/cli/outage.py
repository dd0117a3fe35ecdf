"""``strapdown outage``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from strapdown.cli.console import WORDS, console, print_blocks, print_findings
from strapdown.cli.result_folder import folder_to_write, run_and_save, source_name
from strapdown.cli.shared_options import (
    BEGIN,
    END,
    LENGTH,
    ReportFlags,
    as_flag,
    flags_by_key,
    folder_to_make,
    module_of_flag,
    option,
    running,
    spread,
)
from strapdown.errors import ConfigError

if TYPE_CHECKING:
    from strapdown.config.outage import OutageSpec
    from strapdown.progress import Progress
    from strapdown.systems.outage_run import OutageRun

EPILOG = (
    "Example: strapdown outage adis16470 --outage 60 --speed 15 --with no_slip\n\n"
    "Example: strapdown outage drive-navigate --outage 30 (a folder of strapdown navigate)"
)
moving = partial(option, "Motion, for a sensor")
starting = partial(option, "Initial standard deviations, for a sensor")
during = partial(option, "Instants, for a navigation run")


@dataclass(frozen=True)
class MotionFlags:
    """Motion of a sensor, by key of its table."""

    speed_m_per_s: float | None = moving("M/S", "Speed (0: stationary).", "--speed")
    to_speed_m_per_s: float | None = moving("M/S", "Speed at the end of the outage.", "--to-speed")
    turn_rate_deg_per_s: float | None = moving(
        "DEG/S", "Turn rate, positive to the right.", "--turn-rate"
    )
    heading_deg: float | None = moving("DEG", "Heading (45).", "--heading")
    lat_deg: float | None = moving("DEG", "Latitude (45).", "--lat")


@dataclass(frozen=True)
class StartFlags:
    """Initial standard deviations, by key of the table."""

    aided_s: float | None = starting(
        "S",
        "Duration of the drive with fixes before the outage (600); 0: after an alignment.",
        "--aided",
    )
    fix_position_sd_m: float | None = starting("M", "Of these fixes, at 1 Hz (1.5).", "--fix-sd")
    position_sd_m: float | None = starting(
        "M", "Position, each axis, instead of that after the drive; so below.", "--position-sd"
    )
    velocity_sd_m_per_s: float | None = starting("M/S", "Velocity, each axis.", "--velocity-sd")
    tilt_sd_deg: float | None = starting("DEG", "Roll and pitch.", "--tilt-sd")
    heading_sd_deg: float | None = starting("DEG", "Heading.", "--heading-sd")
    gyro_bias_sd_deg_per_h: float | None = starting(
        "DEG/H", "Gyro biases after alignment or aiding.", "--gyro-bias-sd"
    )
    accel_bias_sd_ug: float | None = starting(
        "UG", "Accelerometer biases after alignment or aiding, µg.", "--accel-bias-sd"
    )


@dataclass(frozen=True)
class OutageFlags:
    """Outages of a navigation run, by key of its table."""

    at_s: float | None = during(
        "S", "Begin of the outage, a stamp of the log; evenly spaced if not given.", "--at"
    )
    places: int | None = during("N", "Number of evenly spaced outages (10).")
    from_s: float | None = during("S", BEGIN.format("where the filter has settled"), "--from")
    to_s: float | None = during("S", END, "--to")
    duration_s: float | None = during("S", LENGTH, "--duration")


#: Flags by key path of the specification.
FLAGS = {
    "outage_s": "--outage",
    "sensor": "SENSOR|BUNDLE",
    **flags_by_key(OutageFlags),
    **flags_by_key(MotionFlags, "motion, "),
    **flags_by_key(StartFlags, "start, "),
}


@spread
def outage(
    source: str = typer.Argument(
        metavar="SENSOR|BUNDLE",
        help="A sensor of the catalogue (strapdown sensors) or a .toml file of your own; or a "
        "folder written by strapdown navigate, or the file of such a run, whose GNSS fixes are "
        "then withheld.",
    ),
    *,
    outage: float = running("S", "Duration of the outage (60).", default=60.0),
    motion: MotionFlags,
    keep: list[str] | None = moving(
        "KIND",
        "A measurement that remains, with options after a colon: no_slip, odometer, "
        "zero_velocity, zero_rate:sd_deg_per_s=0.1; repeatable.",
        "--with",
    ),
    start: StartFlags,
    run: OutageFlags,
    out: Path | None = folder_to_make("SENSOR-outage, or DRIVE-outage"),
    write: ReportFlags,
) -> None:
    """Predict the drift during a GNSS outage, and the sources of the drift.

    For a sensor the prediction uses its data sheet and a stated motion. For a navigation run it
    uses the filter's own state, and compares the prediction with the measured drifts.
    """
    from strapdown.report.outage import read_run_of_outage
    from strapdown.systems.inputs import check_part
    from strapdown.systems.outage_run import run_outage

    check_part(run.from_s, run.to_s, run.duration_s)
    navigation, file = read_run_of_outage(source)
    named = None if navigation is None or file is None else source_name(navigation)
    tables = {"motion": asdict(motion), "start": asdict(start)}

    def compute(report: Progress) -> OutageRun:
        spec = outage_of_flags(
            source, outage, navigation is not None, tables, keep or [], asdict(run)
        )
        if navigation is not None:
            WORDS.set("file")
        return run_outage(spec, navigation, file, report)

    folder = folder_to_write(out, source, "outage", write.force, named)
    run_and_save(compute, folder, write, "outage.json", print_outage)


def outage_of_flags(
    source: str,
    outage: float,
    of_run: bool,
    tables: Mapping[str, Mapping[str, Any]],
    keep: Sequence[str],
    run: Mapping[str, Any],
) -> OutageSpec:
    """Return the specification by the flags.

    `of_run`: whether `source` is a navigation run, which states motion and start itself. `tables`,
    `run`: by key, None where not given. `keep`: remaining measurements, as given. ConfigError: a
    value is invalid, or belongs to the other kind of source; the message names the flag.
    """
    from strapdown.config.outage import OutageSpec
    from strapdown.config.spec import specify

    stated = {
        name: {key: value for key, value in table.items() if value is not None}
        for name, table in tables.items()
    }
    places = {key: value for key, value in run.items() if value is not None}
    # Flags of the other kind of source.
    if of_run:
        others = [FLAGS[f"{name}, {key}"] for name, table in stated.items() for key in table]
        others += ["--with"] if keep else []
    else:
        others = [FLAGS[key] for key in places]
    if others and of_run:
        raise ConfigError("cli.motion-option-of-run", file=Path(source).name, quantity=others[0])
    if others:
        raise ConfigError("cli.record-option-of-sensor", quantity=others[0])
    parts = [key for key in ("from_s", "to_s", "duration_s") if key in places]
    if "at_s" in places and parts:
        raise ConfigError("cli.part-beside-at", quantity=FLAGS[parts[0]])
    aiding: dict[str, Any] = {}
    for text in keep:
        module = module_of_flag(text)
        kind = module.pop("kind")
        if kind in aiding:
            raise ConfigError("cli.aid-repeated", quantity="--with", kind=kind)
        aiding[kind] = module
    sensor = str(Path(source).absolute()) if source.lower().endswith(".toml") else source
    table = {
        "outage_s": outage,
        "sensor": None if of_run else sensor,
        **stated,
        "aiding": aiding,
        **run,
    }
    try:
        return specify(OutageSpec, **table)
    except ConfigError as error:
        raise as_flag(error, FLAGS, _with) from None


def _with(place: str) -> str:
    return "--with" if place.startswith("aiding") else place


def print_outage(result: OutageRun) -> None:
    """Print the predicted drift, its sources, the measured drifts, and the findings."""
    from strapdown.report import outage_document as words
    from strapdown.report.outage_document import budget_table, drift_table, time_table
    from strapdown.report.values import spaced

    out = console()
    out.print(spaced(f"{result.name}: {result.what}; {words.motion_words(result)}"))
    out.print(spaced(f"At the start: {words.start_words(result)}"))
    if result.stays:
        out.print(f"Remaining measurements: {', '.join(result.stays)}")
    print_blocks(time_table(result), budget_table(result), drift_table(result))
    out.print(spaced(words.headline(result)), style="bold")
    out.print(spaced(words.remedy(result)), style="yellow")
    if words.inside_words(result):
        out.print(spaced(words.inside_words(result)))
    print_findings(result.findings)
