"""Configuration of a navigation run: every key with its unit."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field, StrictBool, StrictInt, model_validator

from strapdown.config.alignment import (
    AxesTable,
    LogTable,
    PrefilterSpec,
    SensorsTable,
)
from strapdown.config.choice import ChoiceSpec
from strapdown.config.crash_case import (
    FileName,
    NotNegative,
    Number,
    OneOrThree,
    Pair,
    Positive,
    Triple,
    Word,
    Words,
)
from strapdown.config.motions import MotionSpec
from strapdown.config.spec import TableSpec, refuse

__all__ = [
    "AidSpec",
    "CoarseModeSpec",
    "CommandTable",
    "ControlPointsTable",
    "DampingSpec",
    "FilterSpec",
    "FineModeSpec",
    "GapsTable",
    "LiveTable",
    "MechanizationSpec",
    "NavigationOutputTable",
    "NavigationSensorsTable",
    "NavigationSimulationTable",
    "NavigationSiteTable",
    "NavigationSpec",
    "ReceiverTable",
    "RecorderSpec",
    "SmootherSpec",
    "StartTable",
    "TrustTable",
    "TruthTable",
    "WithholdTable",
    "aids_of",
    "receivers_of",
]


class ReceiverTable(TableSpec):
    """A simulated GNSS receiver: the fixes of the measurement with its name."""

    rate_hz: Positive = 1.0
    position_noise_m: OneOrThree = 1.0
    #: Time-correlated error from orbits, clocks and atmosphere; correlation time below.
    position_drift_m: OneOrThree = 0.0
    correlation_time_s: Positive = 60.0
    velocity_noise_m_per_s: OneOrThree = 0.05
    #: Whether it also measures velocity.
    velocity: StrictBool = True
    #: Antenna from the inertial sensors, body axes.
    antenna_m: Triple = (0.0, 0.0, 0.0)
    #: A fix stamped t belongs to the instant t minus this.
    time_offset_s: Number = 0.0
    #: Start and end of spans without fixes.
    outages_s: tuple[Pair, ...] = ()
    #: Fraction of fixes that are outliers, and their size in standard deviations.
    outlier_share: float = Field(default=0.0, ge=0.0, le=0.9, strict=True)
    outlier_size: Positive = 50.0


class NavigationSimulationTable(TableSpec):
    """A simulated drive, flight or voyage, with its sensors and receivers."""

    motion: MotionSpec
    rate_hz: Positive = 100.0
    seed: StrictInt = Field(default=0, ge=0)
    sampling: Literal["instantaneous", "mean"] = "mean"
    #: Catalogue name or file; by default that of [sensors].
    sensor: FileName | None = None
    #: By name of the measurement that they feed.
    gnss: TableSpec = TableSpec()


class LiveTable(TableSpec):
    """Samples processed as they arrive, with measurements: `strapdown navigate --live`."""

    sampling: Literal["instantaneous", "mean"] = "instantaneous"
    #: Delay of each sample, so that late measurements are still in time.
    hold_s: NotNegative = 0.2


class StartTable(TableSpec):
    """Known initial state of the navigation, with standard deviations."""

    lat_deg: Number
    lon_deg: Number
    alt_m: Number = 0.0
    v_ned_m_per_s: Triple = (0.0, 0.0, 0.0)
    roll_deg: Number
    pitch_deg: Number
    heading_deg: Number
    position_sd_m: OneOrThree = 10.0
    velocity_sd_m_per_s: OneOrThree = 0.1
    #: Of roll and pitch.
    tilt_sd_deg: Positive = 0.5
    heading_sd_deg: Positive = 5.0


class NavigationSiteTable(TableSpec):
    """Position of the body during alignment; by default a receiver's first fix."""

    lat_deg: Number
    lon_deg: Number
    alt_m: Number = 0.0
    position_sd_m: OneOrThree = 10.0
    velocity_sd_m_per_s: OneOrThree = 0.1


class NavigationSensorsTable(SensorsTable):
    """Sensor uncertainty, and the sensor errors that the filter estimates."""

    #: Names of blocks of states; by default biases, drifts, and the stated scale factors and
    #: misalignments.
    states: tuple[Word, ...] | None = None


class CoarseModeSpec(ChoiceSpec):
    """Coarse alignment; it ends at the first condition met."""

    kind: str = "inertial_frame"
    duration_s: Positive | None = None
    until_heading_sd_deg: Positive | None = None
    #: Of the worse of roll and pitch.
    until_tilt_sd_deg: Positive | None = None
    #: Length of the latest part to align; by default all of it.
    window_s: Positive | None = None


class FineModeSpec(ChoiceSpec):
    """Fine alignment after it; it ends at the first condition met."""

    kind: str = "filter"
    duration_s: Positive | None = None
    until_heading_sd_deg: Positive | None = None
    #: Of the worse of roll and pitch.
    until_tilt_sd_deg: Positive | None = None


class CommandTable(TableSpec):
    """Mode command: the mode that begins with the first sample at or after an instant."""

    time_s: Number
    mode: Literal["fine", "navigation", "next"]


class GapsTable(TableSpec):
    """Treatment of missing samples."""

    #: A step longer than so many usual steps is a gap.
    usual: float = Field(default=3.0, gt=1.0, strict=True)
    #: Longer gaps are not bridged.
    coast_s: NotNegative = 1.0
    #: Action after such a gap: end the run, restart the alignment, or bridge it all the same.
    beyond: Literal["refuse", "align", "coast"] = "refuse"


class MechanizationSpec(ChoiceSpec):
    """Integration of position, velocity and attitude."""

    kind: str = "ned"


class FilterSpec(ChoiceSpec):
    """The estimation filter."""

    kind: str = "error_state"


class DampingSpec(ChoiceSpec):
    """Treatment of the estimated errors (closed-loop or open-loop correction)."""

    kind: str = "feedback"


class SmootherSpec(ChoiceSpec):
    """Smoother applied after the end of a run."""

    kind: str = "none"


class RecorderSpec(ChoiceSpec):
    """Which data of the run are kept."""

    kind: str = "interval"


class AidSpec(ChoiceSpec):
    """A measurement besides the inertial sensors, under a name chosen by the user."""

    #: Measured data; simulated if the record is simulated.
    path: FileName | None = None
    #: Column name by quantity, where it differs.
    columns: dict[Word, Word] = Field(default_factory=dict)
    #: Of fixes, replacing the values of the file.
    position_sd_m: OneOrThree | None = None
    velocity_sd_m_per_s: OneOrThree | None = None
    #: Leave out unusable rows, and report them.
    repair: StrictBool = False


class TruthTable(TableSpec):
    """Independent reference trajectory to compare the result with."""

    path: FileName


class ControlPointsTable(TableSpec):
    """Known positions of the body at instants, north and east of a local mark."""

    path: FileName
    #: Column name by quantity (time, north, east), where it differs.
    columns: dict[Word, Word] = Field(default_factory=dict)


class WithholdTable(TableSpec):
    """GNSS outage test: fixes withheld span by span, to score the navigation."""

    #: Measurement whose fixes are withheld; by default the first of kind gnss.
    aid: Word | None = None
    #: Start and end of each span, on the clock of the samples; each is tested by itself.
    spans_s: tuple[Pair, ...] = ()
    #: Alternatively lengths, each tested at so many evenly spaced instants.
    lengths_s: tuple[Positive, ...] = ()
    places: StrictInt = Field(default=5, ge=1, le=100)
    #: Of the first one; by default half a minute after the start of navigation.
    from_s: Number | None = None


class TrustTable(TableSpec):
    """Limits of the heading integrity, and re-runs without outliers."""

    #: Error limit for heading status green (trusted).
    heading_limit_deg: Positive = 3.0
    #: 95 % bound beyond which the heading status is red.
    heading_red_deg: Positive = 10.0
    #: Whether to re-run excluding the first inconsistent measurement.
    repeat: StrictBool = True


class NavigationOutputTable(TableSpec):
    """Output besides the report."""

    #: Formats of the trajectory.
    files: tuple[Word, ...] = ("csv", "kml", "geojson")
    #: Whether charts are also written as images, for print and pages without scripts.
    figures: StrictBool = True


class NavigationSpec(TableSpec):
    """One navigation run; stages and measurements are of the kinds that they name."""

    unwritten: ClassVar[tuple[str, ...]] = ("name",)

    name: str = "navigation"
    title: Words = ""
    ellipsoid: Word = "wgs84"
    log: LogTable | None = None
    simulation: NavigationSimulationTable | None = None
    live: LiveTable | None = None
    axes: AxesTable = AxesTable()
    sensors: NavigationSensorsTable = NavigationSensorsTable()
    states: TableSpec = TableSpec()
    prefilter: PrefilterSpec = PrefilterSpec()
    start: StartTable | None = None
    site: NavigationSiteTable | None = None
    coarse: CoarseModeSpec = CoarseModeSpec()
    fine: FineModeSpec = FineModeSpec()
    commands: tuple[CommandTable, ...] = ()
    gaps: GapsTable = GapsTable()
    mechanization: MechanizationSpec = MechanizationSpec()
    filter: FilterSpec = FilterSpec()
    damping: DampingSpec = DampingSpec()
    smoother: SmootherSpec = SmootherSpec()
    recorder: RecorderSpec = RecorderSpec()
    aiding: TableSpec = TableSpec()
    truth: TruthTable | None = None
    control_points: ControlPointsTable | None = None
    withhold: WithholdTable | None = None
    trust: TrustTable = TrustTable()
    output: NavigationOutputTable = NavigationOutputTable()

    @model_validator(mode="before")
    @classmethod
    def _source(cls, data: Any) -> Any:
        if isinstance(data, dict):
            there = [n for n in ("log", "simulation") if data.get(n) is not None]
            if len(there) == 2:
                raise refuse("simulation", "config.log-and-simulation")
            if not there and data.get("live") is None:
                raise refuse("log", "config.log-missing-in-run")
        return data


def aids_of(spec: NavigationSpec) -> dict[str, AidSpec]:
    """Measurements of a specification, by name."""
    return {name: getattr(spec.aiding, name) for name in type(spec.aiding).model_fields}


def receivers_of(spec: NavigationSpec) -> dict[str, ReceiverTable]:
    """Simulated receivers of a specification, by name of their measurement."""
    if spec.simulation is None:
        return {}
    tables = spec.simulation.gnss
    return {name: getattr(tables, name) for name in type(tables).model_fields}
