"""Configuration of an alignment: every key with its unit."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field, StrictBool, StrictInt, model_validator

from strapdown.config.choice import ChoiceSpec
from strapdown.config.crash_case import (
    FileName,
    NotNegative,
    Number,
    OneOrThree,
    Positive,
    Triple,
    Word,
    Words,
)
from strapdown.config.motions import AngleWaveSpec
from strapdown.config.spec import TableSpec, refuse

__all__ = [
    "AlignmentSpec",
    "AxesTable",
    "CoarseSpec",
    "FineSpec",
    "GnssTable",
    "LogTable",
    "OutputTable",
    "PrefilterSpec",
    "ReferenceTable",
    "SensorsTable",
    "SimulationTable",
    "SiteTable",
]

Matrix = tuple[Triple, Triple, Triple]


class LogTable(TableSpec):
    """A recorded log, how to read it, and the part to use."""

    path: FileName
    columns: dict[Word, Word] = Field(default_factory=dict)
    gyro_unit: Word | None = None
    accel_unit: Word | None = None
    time_unit: Word | None = None
    sampling: Literal["instantaneous", "mean"] | None = None
    rate_hz: Positive | None = None
    repair: StrictBool = False
    from_s: Number | None = None
    to_s: Number | None = None
    #: From `from_s`, or from the first stamp.
    duration_s: Positive | None = None


class GnssTable(TableSpec):
    """GNSS fixes for an alignment in motion."""

    path: FileName


class SimulationTable(TableSpec):
    """A simulated record at the site: stationary, or rocking about it."""

    duration_s: Positive
    rate_hz: Positive = 100.0
    seed: StrictInt = Field(default=0, ge=0)
    sampling: Literal["instantaneous", "mean"] = "mean"
    roll_deg: Number = 0.0
    pitch_deg: Number = 0.0
    heading_deg: Number = 0.0
    roll_waves: tuple[AngleWaveSpec, ...] = ()
    pitch_waves: tuple[AngleWaveSpec, ...] = ()
    heading_waves: tuple[AngleWaveSpec, ...] = ()
    #: Catalogue name or file; by default that of [sensors].
    sensor: FileName | None = None


class AxesTable(TableSpec):
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


class SiteTable(TableSpec):
    """Position of the body."""

    lat_deg: Number
    lon_deg: Number
    alt_m: Number = 0.0
    ellipsoid: Word = "wgs84"


class SensorsTable(TableSpec):
    """Sensor uncertainty: a data sheet, and values that replace it."""

    sensor: FileName | None = None
    gyro: dict[Word, OneOrThree] = Field(default_factory=dict)
    accel: dict[Word, OneOrThree] = Field(default_factory=dict)


class CoarseSpec(ChoiceSpec):
    """Coarse alignment over the first part of the record, or over all of it."""

    kind: str = "inertial_frame"
    duration_s: Positive | None = None


class PrefilterSpec(ChoiceSpec):
    """Filter applied to the samples before the alignment."""

    kind: str = "none"


class FineSpec(ChoiceSpec):
    """Fine alignment: after the coarse alignment if that ends by itself, else over the record."""

    kind: str = "filter"
    duration_s: Positive | None = None


class ReferenceTable(TableSpec):
    """Independent reference attitude to compare the result with."""

    source: Words = ""
    roll_deg: Number | None = None
    pitch_deg: Number | None = None
    heading_deg: Number | None = None
    sd_deg: NotNegative = 0.0
    at: Literal["start", "end"] = "end"


class OutputTable(TableSpec):
    """Output files."""

    #: Rate of attitude.csv; by default every sample.
    rate_hz: Positive | None = 10.0


class AlignmentSpec(TableSpec):
    """One alignment; `prefilter`, `coarse` and `fine` are of the kinds that they name."""

    unwritten: ClassVar[tuple[str, ...]] = ("name",)

    name: str = "alignment"
    title: Words = ""
    log: LogTable | None = None
    simulation: SimulationTable | None = None
    gnss: GnssTable | None = None
    axes: AxesTable = AxesTable()
    site: SiteTable
    sensors: SensorsTable = SensorsTable()
    prefilter: PrefilterSpec = PrefilterSpec()
    coarse: CoarseSpec = CoarseSpec()
    fine: FineSpec = FineSpec()
    reference: ReferenceTable | None = None
    output: OutputTable = OutputTable()

    @model_validator(mode="before")
    @classmethod
    def _source(cls, data: Any) -> Any:
        if isinstance(data, dict):
            there = [n for n in ("log", "simulation") if data.get(n) is not None]
            if len(there) == 2:
                raise refuse("simulation", "config.log-and-simulation")
            if not there:
                raise refuse("log", "config.log-missing-in-alignment")
        return data
