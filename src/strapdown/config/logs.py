"""Logs and how to read them, in any configuration; those of `doctor`, `allan`, `calibrate`."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool, model_validator

from strapdown.config.reading import FileSpec
from strapdown.config.spec import (
    Fault,
    FileName,
    Latitude,
    Number,
    OneOrThree,
    Positive,
    Spec,
    Triple,
    Word,
    accepted_by,
    refuse,
    refused,
)
from strapdown.formats.columns import parse_axes
from strapdown.formats.gnss_fixes import GnssOptions, utm_zone
from strapdown.formats.recording import as_stated
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.triad_errors import NAMED_AXES, check_axes_matrix
from strapdown.tables.sample_clock import ends_of_part
from strapdown.units import parse_unit

Matrix = tuple[Triple, Triple, Triple]


class LogTable(Spec):
    """A recorded log, how to read it, and the part to use."""

    path: FileName = Field(description="the log, from the folder of this file")
    format: Word | None = None
    columns: dict[Word, Word] = Field(default_factory=dict)
    gyro_unit: Annotated[Word, accepted_by(parse_unit, "gyro")] | None = None
    accel_unit: Annotated[Word, accepted_by(parse_unit, "accel")] | None = None
    time_unit: Annotated[Word, accepted_by(parse_unit, "time")] | None = None
    sampling: Literal["instantaneous", "mean"] | None = None
    rate_hz: Positive | None = None
    repair: StrictBool = False
    #: File of `strapdown calibrate`: known errors of the sensor, which are taken off.
    calibration: FileName | None = None
    from_s: Number | None = None
    to_s: Number | None = None
    #: From `from_s`, or from the first stamp.
    duration_s: Positive | None = None

    @model_validator(mode="after")
    def _one_span(self) -> LogTable:
        if self.to_s is not None and self.duration_s is not None:
            raise refuse("duration_s", "config.span-stated-twice")
        if self.from_s is not None and self.to_s is not None and not self.from_s < self.to_s:
            raise refuse("to_s", "config.end-before-begin", begin=self.from_s)
        return self

    @property
    def length_s(self) -> float | None:
        """Length of the used part; None if it is not stated."""
        if self.from_s is not None and self.to_s is not None:
            return self.to_s - self.from_s
        return self.duration_s

    def part_s(self, first: float) -> tuple[float, float]:
        """Return begin and end of the part to use, as `ends_of_part`."""
        return ends_of_part(first, self.from_s, self.to_s, self.duration_s)


def with_answers(log: LogTable, answers: Mapping[str, str]) -> LogTable:
    """Return the table of a log with answers to its questions, by option or quantity."""
    keys = LogTable.model_fields
    columns = log.columns | {q: c for q, c in answers.items() if q not in keys}
    stated: dict[str, Any] = {q: a for q, a in answers.items() if q in keys}
    stated |= {"repair": True} if "repair" in answers else {}
    return log.model_copy(update={**stated, "columns": columns})


class FixesTable(Spec):
    """A file of fixes, and statements about it."""

    path: FileName
    format: Word | None = None
    #: Column name by quantity, where it differs.
    columns: dict[Word, Word] = Field(default_factory=dict)
    #: Unit of its column by quantity.
    units: dict[Word, Word] = Field(default_factory=dict)
    #: Height over the ellipsoid of the level of the file's heights: the geoid, or the take-off.
    datum_height_m: Annotated[Number, Field(ge=-500.0, le=9000.0)] | None = None
    #: Latitude, longitude (deg) and height (m) of the origin of local positions; or their UTM zone.
    origin: Triple | Annotated[Word, accepted_by(utm_zone)] | None = None
    #: Standard deviations, replacing those of the file.
    position_sd_m: OneOrThree | None = None
    velocity_sd_m_per_s: OneOrThree | None = None
    #: Steps of the receiver's clock: a stamp, and by how much it and the later ones are too late.
    clock_steps_s: tuple[tuple[Number, Number], ...] = ()
    #: Leave out unusable rows, and report them.
    repair: StrictBool = False

    def options(self) -> GnssOptions:
        """The statements, as a reader of fixes takes them."""
        return GnssOptions(
            format=self.format,
            columns=self.columns,
            units=self.units,
            datum_height=self.datum_height_m,
            origin=self.origin,
            position_sd=self.position_sd_m,
            velocity_sd=self.velocity_sd_m_per_s,
            clock_steps=self.clock_steps_s,
            repair=self.repair,
        )


class AxesTable(Spec):
    """Sensor axes relative to the body: as letters or words, by a name, or as matrices."""

    axes: Word | None = None
    design: Word | None = None
    matrix: Matrix | None = None
    gyro_matrix: Matrix | None = None
    accel_matrix: Matrix | None = None

    @model_validator(mode="after")
    def _one(self) -> AxesTable:
        written = [name for name in ("axes", "design", "matrix") if getattr(self, name) is not None]
        apart = [n for n in ("gyro_matrix", "accel_matrix") if getattr(self, n) is not None]
        if len(written) > 1 or (written and apart):
            two = [*written, *apart][:2]
            raise refuse(two[1], "config.axes-stated-twice", two=two[0])
        if len(apart) == 1:
            other = "accel_matrix" if apart[0] == "gyro_matrix" else "gyro_matrix"
            raise refuse(apart[0], "config.matrix-missing", other=other)
        return self

    def faults(self) -> Iterator[Fault]:
        """Yield what makes it no axes of sensors."""
        if self.axes is not None:
            yield from refused(("axes", "axes"), parse_axes, self.axes)
        if self.design is not None and self.design not in NAMED_AXES:
            data = {"word": self.design, "known": NAMED_AXES}
            yield Fault(("axes", "design"), "config.unknown-axes", data)
        for name in ("matrix", "gyro_matrix", "accel_matrix"):
            if getattr(self, name) is not None:
                yield from refused(("axes", name), check_axes_matrix, getattr(self, name), name)


class DoctorSpec(FileSpec):
    """Logs to examine."""

    called = "doctor"

    logs: tuple[LogTable, ...] = Field(min_length=1)
    #: How the fixes in each log are read; as stated in it, if empty.
    fixes: tuple[FixesTable, ...] = ()
    #: Orientation of the sensor's axes, as `AxesTable.axes`: of every log, or of each in order,
    #: empty where it is not stated.
    axes: Word | tuple[str, ...] | None = None

    def axes_of(self, number: int) -> str | None:
        """Return the stated axes of a log, counted from zero; None where there are none."""
        if self.axes is None or isinstance(self.axes, str):
            return self.axes
        return self.axes[number] or None

    def faults(self) -> Iterator[Fault]:
        """Yield axes of another number than the logs."""
        if isinstance(self.axes, tuple) and len(self.axes) != len(self.logs):
            data = {"count": len(self.axes), "logs": len(self.logs)}
            yield Fault(("axes",), "config.axes-of-each-log", data)


def _target(name: str) -> object:
    from strapdown.sensors.bridge import target_of

    return target_of(name)


class AllanSpec(FileSpec):
    """Logs at rest, for the noise of their sensor."""

    called = "allan"

    logs: tuple[LogTable, ...] = Field(min_length=1)
    #: Orientation of the sensor's axes, as `AxesTable.axes`.
    axes: Word | None = None
    #: Whether the whole part is taken as stationary, as stated, without a test.
    at_rest: StrictBool = False
    #: Program whose parameters the result gives as well, of `sensors.bridge.TARGETS`.
    target: Annotated[Word, accepted_by(_target)] | None = None


class KnownTurn(Spec):
    """A rotation of a calibration that is known: its angle, or its rate over a stretch."""

    axis: Literal["x", "y", "z"] | None = None
    angle_deg: Positive | None = None
    rate_deg_per_s: Number | None = None
    sd_deg: Positive | None = None
    #: Which of the logs, from 1; with `from_s` and `to_s`.
    log: Annotated[int, Field(ge=1)] | None = None
    from_s: Number | None = None
    to_s: Number | None = None

    @model_validator(mode="after")
    def _one(self) -> KnownTurn:
        if (self.angle_deg is None) == (self.rate_deg_per_s is None):
            raise refuse("angle_deg, rate_deg_per_s", "config.turn-angle-or-rate")
        timed = (self.from_s is not None) + (self.to_s is not None)
        if timed == 1 or (self.rate_deg_per_s is not None and not (timed and self.axis)):
            raise refuse("from_s, to_s", "config.turn-without-span")
        if self.from_s is not None and self.to_s is not None and not self.from_s < self.to_s:
            raise refuse("to_s", "config.end-before-begin", begin=self.from_s)
        return self


#: Gravity on the Earth with room to either side, m/s².
GRAVITY_RANGE = 9.5, 10.0


class CalibrateSpec(FileSpec):
    """Logs of one sensor, for the errors of its gyros, accelerometers and magnetometer."""

    called = "calibrate"

    logs: tuple[LogTable, ...] = Field(min_length=1)
    procedure: Literal["positions", "six-position", "turns", "rate-table"] | None = None
    turns: tuple[KnownTurn, ...] = ()
    #: Local gravity; by latitude and height, or the mean of the Earth, if not stated.
    gravity_m_per_s2: Annotated[Number, Field(ge=GRAVITY_RANGE[0], le=GRAVITY_RANGE[1])] | None = (
        None
    )
    lat_deg: Latitude | None = None
    alt_m: Number = 0.0
    #: Data sheet, for what is known before the logs are read.
    sensor: Annotated[FileName, accepted_by(load_sensor)] | None = None
    #: Of the faces in six positions, and of the angles of turns.
    pose_sd_deg: Positive = 2.0
    turn_sd_deg: Positive = 3.0


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
        ("--calibration", log.calibration),
        ("--from", log.from_s),
        ("--to", log.to_s),
        ("--duration", log.duration_s),
    ):
        if value is not None:
            text = f"{value:g}" if isinstance(value, float) else str(value)
            flags.append(f"{flag} {shlex.quote(text)}" if text[:1] != "-" else f"{flag}={text}")
    return " ".join(flag for flag in flags if flag)


def _listed(origin: tuple[float, float, float] | str | None) -> str | None:
    return ",".join(map(repr, origin)) if isinstance(origin, tuple) else origin


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
        ("--gnss-origin", _listed(fixes.origin)),
        ("--gnss-position-sd", fixes.position_sd_m),
        ("--gnss-velocity-sd", fixes.velocity_sd_m_per_s),
    ):
        if value is not None and value != "":
            flags.append(
                f"{flag}={shlex.quote(f'{value:g}' if isinstance(value, float) else str(value))}"
            )
    return " ".join(flags)
