"""Configuration of an alignment, and the tables that it shares with navigation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, StrictInt

from strapdown.alignment.alignment import Site
from strapdown.alignment.fine import FineAlignment
from strapdown.alignment.stationary import home_of
from strapdown.config.choice import NONE, ChoiceSpec, Kinds
from strapdown.config.logs import AxesTable, FixesTable, LogTable
from strapdown.config.reading import FileSpec
from strapdown.config.spec import (
    AngleWaveSpec,
    Fault,
    FileName,
    NotNegative,
    Number,
    OneOrThree,
    Position,
    Positive,
    Spec,
    Word,
    Words,
    accepted_by,
    refused,
)
from strapdown.ellipsoids import find_ellipsoid
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.formats.columns import parse_axes
from strapdown.formats.triad_units import axes_matrix
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty, stated_imu

if TYPE_CHECKING:
    from strapdown.sensors.calibration import SensorCalibration

#: An hour at 4 kHz.
MOST_SAMPLES = 1.5e7
#: Coarse alignments that need GNSS fixes.
NEEDS_GNSS = ("gnss_course",)
#: Coarse alignments that cannot start a stationary fine filter, and the code of the reason.
NOT_BEFORE_FINE = {
    "gnss_course": "config.course-before-fine",
    "levelling": "config.levelling-before-fine",
}


#: A sensor of the catalogue, or a file.
SensorName = Annotated[FileName, accepted_by(load_sensor)]
EllipsoidName = Annotated[Word, accepted_by(find_ellipsoid)]


class SimulationTable(Spec):
    """A simulated record at the site: stationary, or rocking about it."""

    duration_s: Positive = Field(description="how long to simulate")
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
    sensor: SensorName | None = None


class SiteTable(Position):
    """Position of the body."""

    ellipsoid: EllipsoidName = "wgs84"


class SensorsTable(Spec):
    """Sensor uncertainty: a data sheet, and values that replace it."""

    sensor: SensorName | None = Field(
        default=None,
        description="a sensor of the catalogue (strapdown sensors), or a .toml file of your own",
    )
    gyro: dict[Word, OneOrThree] = Field(default_factory=dict)
    accel: dict[Word, OneOrThree] = Field(default_factory=dict)
    #: Factor on the standard deviations by which units of the sensor's type differ.
    unit_factor: Positive = 1.0


class CoarseSpec(ChoiceSpec):
    """Coarse alignment over the first part of the record, or the whole record."""

    duration_s: Positive | None = None


class PrefilterSpec(ChoiceSpec):
    """Filter applied to the samples before the alignment."""


class FineSpec(ChoiceSpec):
    """Fine alignment: after the coarse alignment if that ends by itself, else over the record."""

    duration_s: Positive | None = None


class ReferenceTable(Spec):
    """Independent reference attitude to compare the result with."""

    source: Words = ""
    roll_deg: Number | None = None
    pitch_deg: Number | None = None
    heading_deg: Number | None = Field(
        default=None, description="heading that is known from elsewhere"
    )
    sd_deg: NotNegative = 0.0
    at: Literal["start", "end"] = "end"


class OutputTable(Spec):
    """Output files."""

    #: Rate of attitude.csv; by default every sample.
    rate_hz: Positive | None = 10.0


def slot(kind: str) -> Any:
    """Default of a slot."""
    return Field(default={"kind": kind}, validate_default=True)


#: Stages that a module fills, each with the validator of its table.
STAGES: dict[str, Kinds] = {
    one.slot: one
    for one in (
        Kinds("prefilter", NONE, True, PrefilterSpec),
        Kinds("coarse", "inertial_frame", False, CoarseSpec),
        Kinds("fine", "filter", True, FineSpec),
    )
}


class AlignmentSpec(FileSpec):
    """One alignment; `prefilter`, `coarse` and `fine` are of the kinds that they name."""

    called = "alignment"

    name: str = "alignment"
    title: Words = ""
    log: LogTable | None = None
    simulation: SimulationTable | None = None
    gnss: FixesTable | None = None
    axes: AxesTable = AxesTable()
    site: SiteTable = Field(description="position of the body")
    sensors: SensorsTable = SensorsTable()
    prefilter: Annotated[PrefilterSpec, BeforeValidator(STAGES["prefilter"])] = slot(NONE)
    coarse: Annotated[CoarseSpec, BeforeValidator(STAGES["coarse"])] = slot("inertial_frame")
    fine: Annotated[FineSpec, BeforeValidator(STAGES["fine"])] = slot("filter")
    reference: ReferenceTable | None = None
    output: OutputTable = OutputTable()

    def faults(self) -> Iterator[Fault]:
        """Yield inconsistent positions, axes, sensors, times and stages."""
        yield from source_faults(self, "[simulation] and duration_s = …")
        yield from self.axes.faults()
        yield from sensor_faults(self)
        longest = self.log.length_s if self.log is not None else None
        if self.simulation is not None:
            longest = self.simulation.duration_s
            count = self.simulation.rate_hz * longest
            if count > MOST_SAMPLES:
                data: dict[str, Any] = {"count": count, "most": MOST_SAMPLES}
                yield Fault(("simulation", "duration_s"), "config.samples-too-many", data)
        if longest is not None and (self.coarse.duration_s or 0.0) > longest:
            data = {"longest": longest}
            yield Fault(("coarse", "duration_s"), "config.longer-than-record", data)
        kind = self.coarse.kind
        if self.gnss is not None and kind not in NEEDS_GNSS:
            known = {"kind": kind, "other": NEEDS_GNSS[0]}
            yield Fault(("gnss", "path"), "config.coarse-takes-no-fixes", known)
        found = list(coarse_faults(self.coarse, self.fine, fixes=self.gnss is not None))
        yield from found
        if self.fine.kind != NONE and not found:
            yield from refused(("fine",), self._begin_filter)

    def _begin_filter(self) -> None:
        """Initialize the filter of the fine alignment, which refuses incompatible parts."""
        ellipsoid = find_ellipsoid(self.site.ellipsoid)
        site = Site(self.site.lat_deg, self.site.lon_deg, self.site.alt_m, ellipsoid)
        way: FineAlignment = self.fine.make(ellipsoid=self.site.ellipsoid)
        # Near a pole the alignments themselves report whether north can be found.
        if abs(self.site.lat_deg) <= way.mechanization.latitude_limit_deg:
            filter_ = ErrorFilter(way.mechanization, way.model(), way.form, way.rule)
            filter_.begin(home_of(site, 0.0), np.zeros((filter_.model.physical_size,) * 2))


# --- shared by alignment and navigation ---------------------------------------------------


def sensors_of(spec: Any) -> ImuUncertainty:
    """Sensor uncertainty of the specification of an alignment or a navigation run.

    ConfigError: the sensor is unknown or incomplete.
    """
    stated: SensorsTable = spec.sensors
    sensor = None if stated.sensor is None else load_sensor(stated.sensor)
    log = getattr(spec, "log", None)
    if log is None or log.calibration is None:
        return stated_imu(sensor, stated.gyro, stated.accel, unit_factor=stated.unit_factor)
    from strapdown.sensors.calibration import SensorCalibration

    known = _axes_of(SensorCalibration.read(log.calibration), spec.axes)
    return stated_imu(
        sensor, stated.gyro, stated.accel, known.uncertainty, unit_factor=stated.unit_factor
    )


def _axes_of(calibration: SensorCalibration, axes: AxesTable) -> SensorCalibration:
    """A calibration in the axes of the body; of the worst axis, if only the log knows them."""
    if axes.axes is not None:
        return calibration.turned(axes_matrix(*parse_axes(axes.axes)))

    def worst(sd: TriadUncertainty) -> TriadUncertainty:
        names = ("bias", "scale", "misalignment", "g_sensitivity")
        return replace(sd, **{name: max(sd.axis(name)) for name in names})

    return replace(calibration, gyro=worst(calibration.gyro), accel=worst(calibration.accel))


def source_faults(spec: Any, others: str) -> Iterator[Fault]:
    """Yield a log beside a simulation, and neither."""
    if spec.log is not None and spec.simulation is not None:
        yield Fault(("simulation",), "config.log-and-simulation")
    if spec.log is None and spec.simulation is None and getattr(spec, "live", None) is None:
        yield Fault(("log",), "config.log-missing", {"others": others})


def sensor_faults(spec: Any) -> Iterator[Fault]:
    """Yield what is not stated of the sensors, and of those of a simulation."""
    stated, simulation = spec.sensors, spec.simulation
    if stated.sensor is None and not stated.gyro and not stated.accel:
        yield Fault(("sensors", "sensor"), "config.no-sensor")
        return
    yield from refused(("sensors",), sensors_of, spec)
    if simulation is not None and simulation.sensor is None and stated.sensor is None:
        yield Fault(("simulation", "sensor"), "config.no-sensor-to-simulate")


def coarse_faults(coarse: ChoiceSpec, fine: ChoiceSpec, *, fixes: bool) -> Iterator[Fault]:
    """Yield what a coarse alignment lacks, and whether a fine one can follow."""
    if coarse.kind in NEEDS_GNSS and not fixes:
        yield Fault(("coarse", "kind"), "config.course-without-fixes")
    if coarse.kind in NOT_BEFORE_FINE and fine.kind != NONE:
        yield Fault(("coarse", "kind"), NOT_BEFORE_FINE[coarse.kind])
