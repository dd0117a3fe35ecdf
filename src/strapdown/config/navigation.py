"""A run of navigation, as a person writes it: every key with its unit."""

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
    """A satellite receiver that is simulated: the fixes of the aid of its name."""

    rate_hz: Positive = 1.0
    position_noise_m: OneOrThree = 1.0
    #: Of a process that orbits, clocks and atmosphere make, correlated over the time below.
    position_drift_m: OneOrThree = 0.0
    correlation_time_s: Positive = 60.0
    velocity_noise_m_per_s: OneOrThree = 0.05
    #: Whether it tells velocities, too.
    velocity: StrictBool = True
    #: Of the antenna from the inertial sensors, body axes.
    antenna_m: Triple = (0.0, 0.0, 0.0)
    #: A fix that is stamped t is of the instant t less this.
    time_offset_s: Number = 0.0
    #: Begin and end of spans without fixes.
    outages_s: tuple[Pair, ...] = ()
    #: Of the fixes, and how many of their standard deviations such a one is off.
    outlier_share: float = Field(default=0.0, ge=0.0, le=0.9, strict=True)
    outlier_size: Positive = 50.0


class NavigationSimulationTable(TableSpec):
    """A drive, flight or voyage that is simulated, with its sensors and receivers."""

    motion: MotionSpec
    rate_hz: Positive = 100.0
    seed: StrictInt = Field(default=0, ge=0)
    sampling: Literal["instantaneous", "mean"] = "mean"
    #: The catalogue's, or a file; that of [sensors], if not given.
    sensor: FileName | None = None
    #: By name of the aid, whose fixes they are.
    gnss: TableSpec = TableSpec()


class LiveTable(TableSpec):
    """Samples that come while it runs, and what aids send: `strapdown navigate --live`."""

    sampling: Literal["instantaneous", "mean"] = "instantaneous"
    #: A sample waits until one comes that is so much later: what aids send late is still in time.
    hold_s: NotNegative = 0.2


class StartTable(TableSpec):
    """A state that is known where navigation begins, and how well it is known."""

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
    """Where the body stands while it is aligned; the first fix of a receiver, if left out."""

    lat_deg: Number
    lon_deg: Number
    alt_m: Number = 0.0
    position_sd_m: OneOrThree = 10.0
    velocity_sd_m_per_s: OneOrThree = 0.1


class NavigationSensorsTable(SensorsTable):
    """What is not known of the sensors, and which of it the filter estimates."""

    #: Names of blocks of states; biases, drifts, and scale factors and misalignments that are
    #: stated, if not given.
    states: tuple[Word, ...] | None = None


class CoarseModeSpec(ChoiceSpec):
    """The coarse alignment, and what ends it: what comes first."""

    kind: str = "inertial_frame"
    duration_s: Positive | None = None
    until_heading_sd_deg: Positive | None = None
    #: Of the worse of roll and pitch.
    until_tilt_sd_deg: Positive | None = None
    #: The newest part that is aligned; all of it, if not given.
    window_s: Positive | None = None


class FineModeSpec(ChoiceSpec):
    """The fine alignment after it, and what ends it: what comes first."""

    kind: str = "filter"
    duration_s: Positive | None = None
    until_heading_sd_deg: Positive | None = None
    #: Of the worse of roll and pitch.
    until_tilt_sd_deg: Positive | None = None


class CommandTable(TableSpec):
    """A word to the chain: which mode begins with the first sample at or after an instant."""

    time_s: Number
    mode: Literal["fine", "navigation", "next"]


class GapsTable(TableSpec):
    """What is done where samples are missing."""

    #: A step of more than so many of the usual ones is a gap.
    usual: float = Field(default=3.0, gt=1.0, strict=True)
    #: A longer gap is not bridged.
    coast_s: NotNegative = 1.0
    #: What such a one does: ends the run, begins the alignment anew, or is bridged all the same.
    beyond: Literal["refuse", "align", "coast"] = "refuse"


class MechanizationSpec(ChoiceSpec):
    """How place, velocity and attitude are reckoned."""

    kind: str = "ned"


class FilterSpec(ChoiceSpec):
    """The filter around it."""

    kind: str = "error_state"


class DampingSpec(ChoiceSpec):
    """What becomes of the estimated errors."""

    kind: str = "feedback"


class SmootherSpec(ChoiceSpec):
    """What a run is smoothed by when it has ended."""

    kind: str = "none"


class RecorderSpec(ChoiceSpec):
    """What of the run is kept."""

    kind: str = "interval"


class AidSpec(ChoiceSpec):
    """What tells more than the inertial sensors do, under a name of the user's."""

    #: What it measured; where the record is simulated, that is simulated, too.
    path: FileName | None = None
    #: By quantity the name of its column, where the names do not say it.
    columns: dict[Word, Word] = Field(default_factory=dict)
    #: Of fixes, in place of what the file states.
    position_sd_m: OneOrThree | None = None
    velocity_sd_m_per_s: OneOrThree | None = None
    #: Leave out rows that cannot be used, and say so.
    repair: StrictBool = False


class TruthTable(TableSpec):
    """A reference trajectory that is known from elsewhere, to hold the answer beside."""

    path: FileName


class ControlPointsTable(TableSpec):
    """Where the body was at instants, north and east of a mark of one's own."""

    path: FileName
    #: By quantity (time, north, east) the name of its column, where the names do not say it.
    columns: dict[Word, Word] = Field(default_factory=dict)


class WithholdTable(TableSpec):
    """Fixes that are kept from the navigator, stretch by stretch, to score it by."""

    #: The aid whose fixes they are; the first of kind gnss, if not given.
    aid: Word | None = None
    #: Begin and end of each stretch, on the clock of the samples; each is tried by itself.
    spans_s: tuple[Pair, ...] = ()
    #: Or lengths, each at so many places, spread evenly.
    lengths_s: tuple[Positive, ...] = ()
    places: StrictInt = Field(default=5, ge=1, le=100)
    #: Of the first one; half a minute after navigation begins, if not given.
    from_s: Number | None = None


class TrustTable(TableSpec):
    """What is asked of the heading, and of what does not agree."""

    #: What a green light promises: the error is below it.
    heading_limit_deg: Positive = 3.0
    #: Known no better than this the light is red.
    heading_red_deg: Positive = 10.0
    #: Whether a run is repeated without the first measurement that is not as it was expected.
    repeat: StrictBool = True


class NavigationOutputTable(TableSpec):
    """What is written beside the report."""

    #: Forms of the trajectory.
    files: tuple[Word, ...] = ("csv", "kml", "geojson")
    #: Whether every chart is drawn as a picture, too: for print, and for a page without scripts.
    figures: StrictBool = True


class NavigationSpec(TableSpec):
    """One run of navigation; the stages, and each aid, are of the kinds that they name."""

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
    """The aids of a specification, by their names."""
    return {name: getattr(spec.aiding, name) for name in type(spec.aiding).model_fields}


def receivers_of(spec: NavigationSpec) -> dict[str, ReceiverTable]:
    """The simulated receivers of a specification, by the names of their aids."""
    if spec.simulation is None:
        return {}
    tables = spec.simulation.gnss
    return {name: getattr(tables, name) for name in type(tables).model_fields}
