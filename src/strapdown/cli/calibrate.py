"""``strapdown calibrate``."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from strapdown.cli import shared_options as options
from strapdown.cli.console import console, print_blocks, print_findings
from strapdown.cli.result_folder import file_beside, folder_to_write, refuse_result, run_and_save
from strapdown.errors import ConfigError

if TYPE_CHECKING:
    from strapdown.progress import Progress
    from strapdown.systems.calibrate_run import CalibrateRun

EPILOG = (
    "Example: strapdown calibrate poses.csv --lat 48.1 --alt 520\n\n"
    "Example: strapdown calibrate unmoved.csv turns.csv --turns 360\n\n"
    "Example: strapdown attitude log.csv --calibration calibration.toml"
)
MOST = 4  # findings on the terminal
#: Options, by the keys that other programs and the configuration have for them.
KEYS = {
    **dict.fromkeys(("gravity", "g", "gravity_m_per_s2"), "--gravity"),
    **dict.fromkeys(("lat", "lat_deg", "latitude"), "--lat"),
    **dict.fromkeys(("alt", "alt_m", "height"), "--alt"),
    **{key: f"--{key}" for key in ("turns", "procedure", "sensor", "calibration")},
}


@dataclass(frozen=True)
class ProcedureFlags:
    """What was done with the sensor, and what is known of it."""

    procedure: str | None = options.running(
        "KIND",
        "positions (rests in nine or more poses), six-position (each face up), turns (by known "
        "angles), rate-table; by the logs if not given.",
    )
    turns: str | None = options.running(
        "ANGLES|TABLE.csv",
        "Known rotations: 360, every turn of about 360 deg between stops; 'x 720, y 720', in "
        "order; or a table: axis, angle_deg or rate_deg_per_s, sd_deg, log, from_s, to_s.",
    )
    turn_sd_deg: float | None = options.running(
        "DEG", "Standard deviation of the known angles (3).", "--turn-sd"
    )
    pose_sd_deg: float | None = options.running(
        "DEG", "Standard deviation of the faces in six positions (2).", "--pose-sd"
    )
    gravity_m_per_s2: float | None = options.with_what(
        "M/S2",
        "Local gravity, 9.8123; by --lat and --alt, or the Earth's mean, if not given.",
        "--gravity",
    )
    lat: float | None = options.with_what("DEG", "Latitude, north positive.")
    alt: float | None = options.HEIGHT
    sensor: str | None = options.SENSOR_MODEL


FLAGS = options.flags_by_key(ProcedureFlags) | {"lat_deg": "--lat", "alt_m": "--alt"}


@options.spread
def calibrate(
    logs: list[Path] = typer.Argument(
        metavar="LOG...", help="Logs of one sensor, at rest in poses."
    ),
    *,
    asked: ProcedureFlags,
    flags: options.LogFlags,
    calibration_file: Path | None = options.writing(
        "FILE.toml", "Write the calibration here, for --calibration."
    ),
    out: Path | None = options.folder_to_make("LOG-calibrate"),
    write: options.ReportFlags,
) -> None:
    """Find bias, scale, misalignment and g-sensitivity of a sensor from rests and turns.

    Let it rest in nine or more poses for three seconds each, and turn it quickly between them;
    no equipment is needed. Each error has a 95 % bound; what the logs do not show is said, with the
    pose or turn that would. A magnetometer is calibrated, too.
    """
    from strapdown.api.calibrate import calibrate as find

    for log in logs:
        key, _, value = log.name.partition("=")
        if value and key in KEYS and not log.exists():
            flag = KEYS[key]
            raise ConfigError("calibrate.key-as-log", text=log.name, flag=flag, value=value)
        refuse_result(log, "log")
    if flags.axes is not None:
        raise ConfigError("calibrate.axes", quantity="--axes")
    beside = file_beside(
        calibration_file, "--calibration-file", write.force, lambda run: str(run.calibration_text())
    )
    keys = {key: value for key, value in options.log_keys(flags.given()).items() if value}
    keys |= {key: value for key, value in asdict(asked).items() if value is not None}

    def compute(report: Progress) -> CalibrateRun:
        try:
            return find([str(log) for log in logs], progress=report, **keys)
        except ConfigError as error:
            raise options.as_flag(error, FLAGS) from None

    def show(result: CalibrateRun) -> None:
        print_calibration(result)
        print_findings(result.findings, MOST)

    folder = folder_to_write(out, logs[0], "calibrate", write.force)
    run_and_save(compute, folder, write, "calibrate.json", show, beside)


def print_calibration(result: CalibrateRun) -> None:
    """Print the errors with their bounds, and what the calibration changes."""
    from strapdown.report.calibrate import (
        effect_table,
        field_table,
        headline,
        parameter_table,
        turn_table,
    )
    from strapdown.report.values import spaced

    console().print(spaced(headline(result)), style="bold")
    tables = (parameter_table, effect_table, turn_table, field_table)
    print_blocks(*(table(result) for table in tables), captions=True)
