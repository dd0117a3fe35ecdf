"""``strapdown sensors``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from strapdown.cli.console import console, print_blocks, print_findings
from strapdown.cli.console import progress as bar
from strapdown.cli.result_folder import run_and_save
from strapdown.cli.shared_options import ReportFlags, as_flag, running, spread, writing
from strapdown.errors import ConfigError

if TYPE_CHECKING:
    from strapdown.progress import Progress
    from strapdown.report.sensors import SensorsRun

EPILOG = (
    "Example: strapdown sensors icm-42688-p\n\n"
    "Example: strapdown sensors mpu-6050 adis16470 mine.toml --outage 30 --out compared"
)
FLAGS = {"outage_s": "--outage", "speed_m_per_s": "--speed", "sensor": "NAME|FILE"}


@spread
def sensors(
    names: list[str] | None = typer.Argument(
        None,
        metavar="[NAME|FILE]...",
        help="Sensors of the catalogue, or files of your own, as of strapdown allan.",
    ),
    *,
    outage: float = running("S", "Duration of the outage (60).", default=60.0),
    speed: float = running("M/S", "Speed (0: stationary).", default=15.0),
    out: Path | None = writing("DIR", "Write a page and the data into this folder."),
    write: ReportFlags,
) -> None:
    """List the sensors of the catalogue, show one with its sources, or compare several.

    A comparison has the Allan deviations over one another, and the drift of position and attitude
    in an outage (standard deviations against time).
    """
    from strapdown.bundle import to_json
    from strapdown.config.outage import SensorsSpec
    from strapdown.config.spec import specify
    from strapdown.report import sensors as report
    from strapdown.sensors.catalogue import load_sensor

    if not names:
        if out is not None:
            raise ConfigError("cli.sensors-to-write-missing", quantity="--out")
        table = report.catalogue_table()
        if write.json:
            rows = [report.sensor_json(load_sensor(name)) for name in table["name"]]
            typer.echo(to_json(rows), nl=False)
        else:
            _print(report.list_block(table))
        return
    if len(names) == 1 and out is None:
        sensor = load_sensor(names[0])
        if write.json:
            typer.echo(to_json(report.sensor_json(sensor)), nl=False)
        else:
            _print(report.figures_block(sensor))
            _print(report.list_block(report.catalogue_table([sensor])))
        return
    given = [str(Path(n).absolute()) if n.lower().endswith(".toml") else n for n in names]

    def compute(progress: Progress) -> SensorsRun:
        keys: dict[str, Any] = {"outage_s": outage, "speed_m_per_s": speed}
        try:
            return report.compare(specify(SensorsSpec, sensor=tuple(given), **keys), progress)
        except ConfigError as error:
            raise as_flag(error, FLAGS) from None

    def show(run: SensorsRun) -> None:
        _print(report.list_block(report.catalogue_table(run.sensors)))
        if (drift := report.drift_block(run)) is not None:
            _print(drift)
        print_findings(run.findings)

    if out is not None:
        run_and_save(compute, out, write, "sensors.json", show)
        return

    with bar(write.quiet or write.json) as reported:
        run = compute(reported)
    if write.json:
        typer.echo(to_json(report.sensors_json(run)), nl=False)
    else:
        show(run)


def _print(block: Any) -> None:
    from strapdown.report.values import spaced

    if block.title:
        console().print(spaced(block.title), style="bold")
    print_blocks(block, captions=True)
