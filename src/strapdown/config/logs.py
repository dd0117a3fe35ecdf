"""Configuration of `strapdown doctor`: the logs, and how to read them."""

from __future__ import annotations

import shlex

from pydantic import Field

from strapdown.config.alignment import FixesTable, LogTable
from strapdown.config.reading import FileSpec
from strapdown.config.spec import Word
from strapdown.formats.recording import as_stated


class DoctorSpec(FileSpec):
    """Logs to examine."""

    called = "doctor"

    logs: tuple[LogTable, ...] = Field(min_length=1)
    #: How the fixes in each log are read; as stated in it, if empty.
    fixes: tuple[FixesTable, ...] = ()
    #: Orientation of the sensor's axes, as `AxesTable.axes`; of every log.
    axes: Word | None = None


def flags_of(log: LogTable, axes: str | None) -> str:
    """Return the options of the command line that read a log as its table does."""
    answers = {**log.columns}
    answers |= {q: u for q in ("gyro_unit", "accel_unit", "time_unit") if (u := getattr(log, q))}
    answers |= {"repair": "true"} if log.repair else {}
    flags = [as_stated(answers)["flags"]]
    for flag, value in (
        ("--format", log.format),
        ("--sampling", log.sampling),
        ("--rate", log.rate_hz),
        ("--axes", axes),
        ("--from", log.from_s),
        ("--to", log.to_s),
        ("--duration", log.duration_s),
    ):
        if value is not None:
            text = f"{value:g}" if isinstance(value, float) else str(value)
            flags.append(f"{flag} {shlex.quote(text)}" if text[:1] != "-" else f"{flag}={text}")
    return " ".join(flag for flag in flags if flag)


def flags_of_fixes(fixes: FixesTable | None) -> str:
    """Return the options of the command line that read fixes as their table does."""
    if fixes is None:
        return ""
    flags = []
    for flag, value in (
        ("--gnss-format", fixes.format),
        ("--gnss-columns", ",".join(f"{q}={c}" for q, c in fixes.columns.items())),
        ("--gnss-units", ",".join(f"{q}={u}" for q, u in fixes.units.items())),
        ("--gnss-datum-height", fixes.datum_height_m),
        ("--gnss-origin", None if fixes.origin is None else ",".join(map(repr, fixes.origin))),
        ("--gnss-position-sd", fixes.position_sd_m),
        ("--gnss-velocity-sd", fixes.velocity_sd_m_per_s),
    ):
        if value is not None and value != "":
            flags.append(
                f"{flag}={shlex.quote(f'{value:g}' if isinstance(value, float) else str(value))}"
            )
    return " ".join(flags)
