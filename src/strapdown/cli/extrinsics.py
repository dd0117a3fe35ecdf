"""``strapdown extrinsics``."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from strapdown.cli import shared_options as options
from strapdown.cli.console import console, print_blocks, print_findings
from strapdown.cli.result_folder import folder_to_write, refuse_result, run_and_save
from strapdown.errors import ConfigError

if TYPE_CHECKING:
    from strapdown.progress import Progress
    from strapdown.systems.extrinsics_run import ExtrinsicsRun

EPILOG = (
    "Example: strapdown extrinsics phone.csv unit.csv\n\n"
    "Example: strapdown extrinsics drive.csv fixes.pos --sensor icm-42688-p"
)
MOST = 6  # findings on the terminal


@dataclass(frozen=True)
class PairFlags:
    """The other sensor, and what is known of both, by argument of `find`."""

    kind: str | None = options.running(
        "imu|magnetometer|gnss", "What OTHER is, if it is not found.", "--kind"
    )
    offset: float | None = options.running(
        "S", "Clock of OTHER less that of LOG, to 0.3 s; searched, if not given."
    )
    not_on_wheels: bool = options.running(
        None,
        "With fixes: the vehicle does not roll; no mounting angles.",
        "--not-on-wheels",
        default=False,
    )
    sensor: str | None = options.SENSOR_MODEL
    other_axes: str | None = options.running(
        "X,Y,Z", "Axes of OTHER, as --axes of LOG.", "--other-axes"
    )
    other_calibration: Path | None = options.running(
        "FILE.toml", "Of OTHER, as --calibration of LOG.", "--other-calibration"
    )
    heading_deg: float | None = options.with_what(
        "DEG", "Initial heading, if neither gyros nor course determine it.", "--heading"
    )


@options.spread
def extrinsics(
    log: Path = typer.Argument(metavar="LOG", help="Log of gyros and accelerometers, a."),
    other: Path | None = typer.Argument(
        None,
        metavar="OTHER",
        help="The other sensor, b: a second log, a magnetometer, fixes of an antenna; without "
        "it, the magnetometer in LOG.",
    ),
    *,
    asked: PairFlags,
    flags: options.LogFlags,
    fixes: options.FixFlags,
    out: Path | None = options.folder_to_make("LOG-extrinsics"),
    write: options.ReportFlags,
) -> None:
    """Find rotation, lever arm and time offset between two sensors on one rigid body.

    Two inertial units, a unit and a magnetometer, or a unit and a GNSS antenna (from a drive), each
    with 95 % bounds, and with what the motion does not show.
    """
    from strapdown.api.extrinsics import extrinsics as find
    from strapdown.api.reading import read_gnss

    refuse_result(log, "log")
    keys: dict[str, Any] = {k: v for k, v in options.log_keys(flags.given()).items() if v}
    keys |= {**asdict(asked), "axes": flags.axes}
    keys["wheels"] = not keys.pop("not_on_wheels")
    if asked.other_calibration is not None:
        keys["other_calibration"] = str(asked.other_calibration)
    of_fixes = options.fix_keys(fixes.given(), None)

    def compute(report: Progress) -> ExtrinsicsRun:
        try:
            second: Any = None if other is None else str(other)
            return find(
                str(log),
                read_gnss(second, **of_fixes) if second and of_fixes else second,
                progress=report,
                **keys,
            )
        except ConfigError as error:
            raise options.as_flag(error, FLAGS) from None

    folder = folder_to_write(out, log, "extrinsics", write.force)
    run_and_save(
        compute, folder, write, "extrinsics.json", print_extrinsics, look_at="extrinsics.toml"
    )


#: Options by key path of the specification; those of reading LOG also under ``log``.
FLAGS = {
    "other": "OTHER",
    "gnss": "OTHER",
    "offset_s": "--offset",
    "heading": "--heading",
    **options.flags_by_key(PairFlags),
    **options.fix_flags("navigation, aiding, gnss"),
}


def print_extrinsics(result: ExtrinsicsRun) -> None:
    """Print the parameters, the lines for a navigation configuration, and the findings."""
    from strapdown.report.extrinsics import headline, navigation_lines, table
    from strapdown.report.values import spaced

    out = console()
    out.print(spaced(headline(result)), style="bold")
    print_blocks(table(result), captions=True)
    if result.result.kind == "gnss":
        out.print("\n" + "\n".join(navigation_lines(result)), markup=False, highlight=False)
    print_findings(result.findings, MOST)
