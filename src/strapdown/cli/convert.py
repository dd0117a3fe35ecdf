"""``strapdown convert``."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import typer

from strapdown.cli import shared_options as options
from strapdown.cli.console import console, print_findings, print_table
from strapdown.errors import ConfigError, check_choice

EPILOG = (
    "Example: strapdown convert flight.ulg flight.mcap\n\n"
    "Example: strapdown convert log.csv fixes.pos for-kf-gins --as kf-gins\n\n"
    "Example: strapdown convert drive-navigate path.gpx --epoch 2026-05-01T12:00:00Z --geoid 46.5"
)


@dataclass(frozen=True)
class TargetFlags:
    """Format of the result, and what it needs that no log states."""

    form: str | None = options.writing(
        "FORMAT",
        "Format of OUT (strapdown modules), if its ending does not say it: euroc, kitti, "
        "kf-gins are folders.",
        "--as",
    )
    streams: str | None = options.writing(
        "NAMES", "Only these: imu,gnss,reference,magnetometer,barometer,wheel,heading."
    )
    epoch: str | None = options.writing(
        "DATE", "Instant of stamp zero, for a clock that is not related to UTC."
    )
    origin: str | None = options.writing(
        "LAT,LON,HEIGHT",
        "Origin of formats with local axes, deg, deg, m over the ellipsoid (first position).",
    )
    geoid: float | None = options.writing(
        "M", "Height of the geoid over the ellipsoid, for heights over the sea."
    )


@options.spread
def convert(
    paths: list[Path] = typer.Argument(
        metavar="IN... OUT",
        help="Logs, fixes, trajectories or results, and the file or folder to make.",
    ),
    *,
    target: TargetFlags,
    log: options.LogFlags,
    fixes: options.FixFlags,
    write: options.OutFlags,
) -> None:
    """Write what a log, a file of fixes or a trajectory holds in another format.

    Each format has its own axes, units and clock; what it cannot hold is said. A clock that the
    format needs and the log does not state is asked for.
    """
    from strapdown.api.writing import read_streams, writer_streams
    from strapdown.api.writing import write as write_file
    from strapdown.bundle import to_json
    from strapdown.formats import STREAMS
    from strapdown.formats.clocks import clock_of

    if len(paths) < 2:
        raise ConfigError("cli.convert-needs-two", quantity="OUT")
    *sources, out = paths
    held = writer_streams(out, target.form)
    epoch, origin = _date(target.epoch), options.as_origin(target.origin, "--origin")
    wanted = [w.strip() for w in target.streams.split(",")] if target.streams else list(STREAMS)
    for name in wanted:
        check_choice("cli.no-such-stream", STREAMS, quantity="--streams", name=name)
    given: dict[str, Any] = {**log.given(), **fixes.given()}
    found, findings = read_streams(
        sources,
        options.log_keys(given),
        given["axes"],
        options.fix_keys(given, None),
        [name for name in wanted if name in held],
    )
    chosen = {name: table for name, table in found.items() if name in wanted}
    if not chosen:
        raise ConfigError("cli.no-wanted-stream", file=found.source, streams=list(found))
    said = write_file(
        chosen,
        out,
        format=target.form,
        epoch=epoch,
        origin=origin,
        geoid_undulation_m=target.geoid,
        force=write.force,
    )
    written = {str(f.quantity): f.data for f in said if f.code == "io.stream-written"}
    read = (f for name in written for f in chosen[name].attrs.get("findings", ()))
    rest = list(dict.fromkeys([*read, *findings, *said]))
    if write.json:
        typer.echo(to_json({"path": str(out), "findings": [f.plain() for f in rest]}), nl=False)
        return
    if write.quiet:
        return
    rows = [
        [name, str(data["rows"]), clock_of(chosen[name]).name, data["held"]]
        for name, data in written.items()
    ]
    print_table(["stream", "rows", "clock of the log", "written as"], rows, text=(0, 2, 3))
    print_findings([f for f in rest if f.code != "io.stream-written"])
    console().print(f"Wrote {out}")


def _date(text: str | None) -> datetime | None:
    if text is None:
        return None
    try:
        date = datetime.fromisoformat(text)
    except ValueError:
        raise ConfigError("cli.no-date", quantity="--epoch", text=text) from None
    if date.utcoffset() is None:
        raise ConfigError("cli.no-date", quantity="--epoch", text=text)
    return date
