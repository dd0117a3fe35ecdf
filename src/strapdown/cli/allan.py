"""``strapdown allan``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from strapdown.cli import shared_options as options
from strapdown.cli.console import console, print_blocks, print_findings
from strapdown.cli.result_folder import file_beside, folder_to_write, refuse_result, run_and_save
from strapdown.errors import ConfigError

if TYPE_CHECKING:
    from strapdown.progress import Progress
    from strapdown.systems.allan_run import AllanRun

EPILOG = (
    "Example: strapdown allan unmoved.csv --sensor-file mine.toml\n\n"
    "Example: strapdown allan unmoved.csv --for KF-GINS"
)
MOST = 4  # findings on the terminal


@options.spread
def allan(
    logs: list[Path] = typer.Argument(
        metavar="LOG...",
        help="Log of an unmoved sensor, an hour or more; several logs of one sensor are "
        "fitted together.",
    ),
    program: str | None = options.running(
        "PROGRAM",
        "Print the noise as the parameters of another program, too: KF-GINS, OB_GINS, GTSAM, "
        "kalibr, ORB-SLAM3, robot_localization, PX4, NaveGo, PSINS, data-sheet.",
        "--for",
    ),
    at_rest: bool = options.running(
        None,
        "Use the whole log, or its part, as stationary, without a test.",
        "--at-rest",
        default=False,
    ),
    sensor_file: Path | None = options.writing(
        "FILE.toml", "Write the sensor here, for --sensor of navigate and align."
    ),
    *,
    flags: options.LogFlags,
    out: Path | None = options.folder_to_make("LOG-allan"),
    write: options.ReportFlags,
) -> None:
    """Find the noise of a sensor from a log at rest: Allan deviation, noise terms, sensor file.

    White noise (angle and velocity random walk), bias instability or Gauss-Markov process, random
    walk, quantization and ramp of each channel, by maximum likelihood, with 95 % intervals; a term
    that the record does not show has an upper bound.
    """
    from strapdown.api.allan import allan as analyse

    for log in logs:
        refuse_result(log, "log")
    beside = file_beside(
        sensor_file, "--sensor-file", write.force, lambda run: str(run.sensor_text())
    )
    keys = {key: value for key, value in options.log_keys(flags.given()).items() if value}

    def compute(report: Progress) -> AllanRun:
        try:
            keys.update(axes=flags.axes, at_rest=at_rest, target=program)
            return analyse(*map(str, logs), progress=report, **keys)
        except ConfigError as error:
            raise options.as_flag(error, {"target": "--for"}) from None

    def show(result: AllanRun) -> None:
        print_noise(result, sensor_file)
        print_findings(result.findings, MOST)

    folder = folder_to_write(out, logs[0], "allan", write.force)
    run_and_save(compute, folder, write, "allan.json", show, beside)


def print_noise(result: AllanRun, sensor_file: Path | None) -> None:
    """Print the terms of each channel, the parameters of another program, and the next command."""
    from strapdown.report.allan import headline, parameter_table, term_tables
    from strapdown.report.values import spaced

    out = console()
    out.print(spaced(headline(result)), style="bold")
    print_blocks(*term_tables(result), parameter_table(result), captions=True)
    if sensor_file is not None:
        out.print(f"Sensor {sensor_file}: strapdown navigate LOG --sensor {sensor_file}")
