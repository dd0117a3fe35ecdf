"""Configuration of a navigation run: every key with its unit, and the modules that it names."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, StrictBool, StrictInt, create_model, model_validator

from strapdown.config.alignment import (
    MOST_SAMPLES,
    EllipsoidName,
    PrefilterSpec,
    SensorName,
    SensorsTable,
    coarse_faults,
    sensor_faults,
    sensors_of,
    slot,
    source_faults,
)
from strapdown.config.choice import NONE, SLOTS, ChoiceSpec, Kinds
from strapdown.config.logs import AxesTable, FixesTable, LogTable
from strapdown.config.reading import FileSpec
from strapdown.config.spec import (
    Angle,
    Fault,
    FileName,
    Later,
    NotNegative,
    Number,
    OneOrThree,
    Pair,
    Position,
    Positive,
    Sizes,
    Spec,
    Triple,
    Word,
    Words,
    refuse,
    refused,
)
from strapdown.constants import DEG_PER_HOUR, STANDARD_GRAVITY
from strapdown.errors import ConfigError
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.sensor_blocks import (
    STATED_STATES,
    StateProcess,
    stated_states,
    with_processes,
)
from strapdown.formats.writers import TRAJECTORY_FORMATS
from strapdown.nav_state import NavState
from strapdown.navigation.filter_options import DAMPINGS
from strapdown.navigation.measurements.measurement import Measurement, TabulatedMeasurement
from strapdown.navigation.navigator import Warming, with_states
from strapdown.sensors.uncertainty import STATED_KEYS, ImuUncertainty


class ReceiverTable(Spec):
    """A simulated GNSS receiver: the fixes of the measurement with its name."""

    rate_hz: Positive = 1.0
    position_noise_m: Sizes = 1.0
    #: Time-correlated error from orbits, clocks and atmosphere; correlation time below.
    position_drift_m: Sizes = 0.0
    correlation_time_s: Positive = 60.0
    velocity_noise_m_per_s: Sizes = 0.05
    #: Whether it also measures velocity.
    velocity: StrictBool = True
    #: Antenna from the inertial sensors, body axes.
    antenna_m: Triple = (0.0, 0.0, 0.0)
    #: A fix stamped t belongs to the instant t minus this.
    time_offset_s: Number = 0.0
    #: Start and end of spans without fixes.
    outages_s: tuple[Pair, ...] = ()
    #: Fraction of fixes that are outliers, and their size in standard deviations.
    outlier_share: Annotated[Number, Field(ge=0.0, le=0.9)] = 0.0
    outlier_size: Positive = 50.0

    @model_validator(mode="after")
    def _spans(self) -> ReceiverTable:
        _refuse_empty(self.outages_s, "outages_s")
        return self


def _refuse_empty(spans: tuple[Pair, ...], key: str) -> None:
    for begin, end in spans:
        if not begin < end:
            raise refuse(key, "config.outage-span-empty", begin=begin, end=end, key=key)


class NavigationSimulationTable(Spec):
    """A simulated drive, flight or voyage, with its sensors and receivers."""

    motion: Annotated[Any, BeforeValidator(Later("strapdown.config.motions", "MotionSpec"))] = (
        Field(description='the motion, as kind = "car" and its keys')
    )
    rate_hz: Annotated[Positive, Field(le=MOST_SAMPLES)] = 100.0
    seed: StrictInt = Field(default=0, ge=0)
    sampling: Literal["instantaneous", "mean"] = "mean"
    #: Catalogue name or file; by default that of [sensors].
    sensor: SensorName | None = None
    #: By name of the measurement that they feed.
    gnss: dict[str, ReceiverTable] = Field(default_factory=dict)


class LiveTable(Spec):
    """Samples processed as they arrive, with measurements: `strapdown navigate --live`."""

    sampling: Literal["instantaneous", "mean"] = "instantaneous"
    #: Delay of each sample, so that late measurements are still in time.
    hold_s: NotNegative = 0.2


class StartTable(Position):
    """Known initial state of the navigation, with standard deviations."""

    v_ned_m_per_s: Triple = (0.0, 0.0, 0.0)
    roll_deg: Number = Field(description="right side down is positive")
    pitch_deg: Number = Field(description="nose up is positive")
    heading_deg: Angle = Field(description="clockwise from north")
    position_sd_m: Sizes = 10.0
    velocity_sd_m_per_s: Sizes = 0.1
    #: Of roll and pitch.
    tilt_sd_deg: Positive = 0.5
    heading_sd_deg: Positive = 5.0


class NavigationSiteTable(Position):
    """Position of the body during alignment; by default a receiver's first fix."""

    position_sd_m: Sizes = 10.0
    velocity_sd_m_per_s: Sizes = 0.1


class WarmingTable(Spec):
    """Biases of a unit that was switched on with its record, and changes them as it warms up."""

    #: Standard deviation of the change until it is warm.
    gyro_sd_deg_per_h: NotNegative = 0.0
    accel_sd_ug: NotNegative = 0.0
    #: Of its decay.
    time_s: Positive = 400.0

    def make(self) -> Warming | None:
        """Make the change of the biases, in SI; None without a change."""
        gyro, accel = self.gyro_sd_deg_per_h / DEG_PER_HOUR, 1e-6 * self.accel_sd_ug
        if not gyro and not accel:
            return None
        return Warming(gyro, accel * STANDARD_GRAVITY, self.time_s)


class NavigationSensorsTable(SensorsTable):
    """Sensor uncertainty, and the sensor errors that the filter estimates."""

    #: Names of blocks of states; by default biases, drifts, and the stated scale factors and
    #: misalignments.
    states: tuple[Word, ...] | None = None
    warming: WarmingTable = WarmingTable()


class FineModeSpec(ChoiceSpec):
    """Fine alignment after the coarse one; it ends at the first condition met."""

    duration_s: Positive | None = None
    until_heading_sd_deg: Positive | None = None
    #: Of the worse of roll and pitch.
    until_tilt_sd_deg: Positive | None = None
    #: Time before which it does not end by these.
    least_s: Positive | None = None


class CoarseModeSpec(FineModeSpec):
    """Coarse alignment; it ends at the first condition met."""

    #: Length of the latest part to align; by default the whole part.
    window_s: Positive | None = None


class CommandTable(Spec):
    """Mode command: the mode that begins with the first sample at or after an instant."""

    time_s: Number
    mode: Literal["fine", "navigation", "next"]


class GapsTable(Spec):
    """Treatment of missing samples."""

    #: A step longer than so many usual steps is a gap.
    usual: Annotated[Number, Field(gt=1.0)] = 3.0
    #: Longer gaps are not bridged.
    bridge_s: NotNegative = 1.0
    #: Action after such a gap: end the run, restart the alignment, or bridge it all the same.
    beyond: Literal["refuse", "align", "bridge"] = "refuse"


class AidSpec(FixesTable, ChoiceSpec):
    """A measurement besides the inertial sensors, under a name chosen by the user.

    Standard deviations are of fixes alone.
    """

    #: Measured data; simulated if the record is simulated.
    path: FileName | None = None  # type: ignore[assignment]


class DampingSpec(ChoiceSpec):
    """Correction by the estimated errors, and another one for comparison."""

    #: Kind with which the record is navigated a second time, for one report of both.
    beside: Word | None = None


class TruthTable(Spec):
    """Independent reference trajectory to compare the result with."""

    path: FileName = Field(description="the reference trajectory, from the folder of this file")


class MapTable(Spec):
    """Local map under the plan of the report."""

    path: FileName = Field(
        description="raster tiles, .mbtiles or .pmtiles, from the folder of this file"
    )


class ControlPointsTable(Spec):
    """Known positions of the body at instants, north and east of a local mark."""

    path: FileName = Field(description="a table of time, north, east, from the folder of this file")
    #: Column name by quantity (time, north, east), where it differs.
    columns: dict[Word, Word] = Field(default_factory=dict)


class WithholdTable(Spec):
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

    @model_validator(mode="after")
    def _one_way(self) -> WithholdTable:
        if bool(self.spans_s) == bool(self.lengths_s):
            both = (
                "config.outage-spans-and-lengths" if self.spans_s else "config.outage-without-span"
            )
            raise refuse("spans_s", both)
        _refuse_empty(self.spans_s, "spans_s")
        return self


class TrustTable(Spec):
    """Limits of the heading integrity, and re-runs without outliers."""

    #: Error limit for heading status green (trusted).
    heading_limit_deg: Positive = 3.0
    #: 95 % bound beyond which the heading status is red.
    heading_red_deg: Positive = 10.0
    #: Whether to re-run excluding the first inconsistent measurement.
    repeat: StrictBool = True


class NavigationOutputTable(Spec):
    """Output besides the report."""

    #: Formats of the trajectory.
    files: tuple[Word, ...] = ("csv", "kml", "geojson")
    #: Whether charts are also written as images, for print and pages without scripts.
    figures: StrictBool = True


# --- [states.NAME]: size of a sensor error, and its change in time ------------------------

#: Random walk per root hour to per root second.
ROOT_HOUR = 60.0


class StateTable(Spec):
    """One block of states, with ``sd_UNIT`` and ``walk_UNIT_per_sqrt_h`` in units of its own."""

    #: Correlation time of a Gauss-Markov process; without it and a walk, the error is constant.
    correlation_time_s: Positive | None = None

    @property
    def process(self) -> StateProcess:
        """The process of the block, in SI."""
        given: dict[str, Any] = {}
        for part, key, factor in _state_keys(type(self).__name__):
            value = getattr(self, key)
            if value is not None:
                single = isinstance(value, int | float)
                given[part] = factor * value if single else tuple(factor * x for x in value)
        return StateProcess(correlation_time=self.correlation_time_s, **given)

    @model_validator(mode="after")
    def _consistent(self) -> StateTable:
        seen: set[str] = set()
        for part, key, _ in _state_keys(type(self).__name__):
            if getattr(self, key) is not None:
                if part in seen:
                    raise refuse(key, "config.state-in-two-units")
                seen.add(part)
        try:
            _ = self.process
        except ConfigError as error:
            raise refuse("correlation_time_s", error.finding.replace(quantity=None)) from None
        return self


def _state_keys(name: str) -> Iterator[tuple[str, str, float]]:
    """Parts of a block's process, with the key of each unit and its factor to SI."""
    triad, attribute, _, _ = STATED_STATES[name]
    start = f"{'bias' if attribute == 'drift' else attribute}_sd_"
    for key, one in STATED_KEYS[triad].items():
        if key.startswith(start):
            unit = key.removeprefix(start)
            yield "sd", f"sd_{unit}", one.factor
            yield "walk", f"walk_{unit}_per_sqrt_h", one.factor / ROOT_HOUR


def _state_form(name: str) -> type[StateTable]:
    keys: dict[str, Any] = {key: (OneOrThree | None, None) for _, key, _ in _state_keys(name)}
    return create_model(name, __base__=StateTable, **keys)


_STATES: dict[str, Any] = {name: (_state_form(name) | None, None) for name in STATED_STATES}
#: A table for every error that a filter can estimate.
StatesTable: type[Spec] = create_model("States", __base__=Spec, **_STATES)


# --- the run ------------------------------------------------------------------------------

#: Stages that a module fills, each with the validator of its table.
STAGES: dict[str, Kinds] = {
    one.slot: one
    for one in (
        Kinds("prefilter", NONE, True, PrefilterSpec),
        Kinds("coarse", "inertial_frame", True, CoarseModeSpec),
        Kinds("fine", "filter", True, FineModeSpec),
        Kinds("mechanization", "ned"),
        Kinds("filter", "error_state"),
        Kinds("damping", "feedback", base=DampingSpec),
        Kinds("smoother", NONE, True),
        Kinds("recorder", "interval"),
    )
}
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
#: Keys that end an alignment.
ENDS = ("duration_s", "until_heading_sd_deg", "until_tilt_sd_deg")


class NavigationSpec(FileSpec):
    """One navigation run; stages and measurements are of the kinds that they name."""

    name: str = "navigation"
    title: Words = ""
    ellipsoid: EllipsoidName = "wgs84"
    log: LogTable | None = None
    simulation: NavigationSimulationTable | None = None
    live: LiveTable | None = None
    axes: AxesTable = AxesTable()
    sensors: NavigationSensorsTable = NavigationSensorsTable()
    states: StatesTable = StatesTable()  # type: ignore[valid-type]
    prefilter: Annotated[PrefilterSpec, BeforeValidator(STAGES["prefilter"])] = slot(NONE)
    start: StartTable | None = None
    site: NavigationSiteTable | None = None
    coarse: Annotated[CoarseModeSpec, BeforeValidator(STAGES["coarse"])] = slot("inertial_frame")
    fine: Annotated[FineModeSpec, BeforeValidator(STAGES["fine"])] = slot("filter")
    commands: tuple[CommandTable, ...] = ()
    gaps: GapsTable = GapsTable()
    mechanization: Annotated[ChoiceSpec, BeforeValidator(STAGES["mechanization"])] = slot("ned")
    filter: Annotated[ChoiceSpec, BeforeValidator(STAGES["filter"])] = slot("error_state")
    damping: Annotated[DampingSpec, BeforeValidator(STAGES["damping"])] = slot("feedback")
    smoother: Annotated[ChoiceSpec, BeforeValidator(STAGES["smoother"])] = slot(NONE)
    recorder: Annotated[ChoiceSpec, BeforeValidator(STAGES["recorder"])] = slot("interval")
    aiding: dict[str, Annotated[AidSpec, BeforeValidator(Kinds("aiding", base=AidSpec))]] = Field(
        default_factory=dict
    )
    truth: TruthTable | None = None
    control_points: ControlPointsTable | None = None
    withhold: WithholdTable | None = None
    trust: TrustTable = TrustTable()
    map: MapTable | None = None
    output: NavigationOutputTable = NavigationOutputTable()

    @model_validator(mode="before")
    @classmethod
    def _completed(cls, data: Any) -> Any:
        """Kinds that follow from others: no alignment before a start, aids called by their kind."""
        if not isinstance(data, Mapping):
            return data
        out = dict(data)
        if out.get("start") is not None:
            for stage in ("coarse", "fine"):
                given = out.get(stage, {})
                out[stage] = {"kind": NONE, **given} if isinstance(given, Mapping) else given
        aids = out.get("aiding")
        if isinstance(aids, Mapping):
            out["aiding"] = aids = {name: _named(name, aid) for name, aid in aids.items()}
        simulation = out.get("simulation")
        if isinstance(simulation, Mapping) and isinstance(simulation.get("gnss", {}), Mapping):
            free = [
                name
                for name, aid in (aids or {}).items()
                if isinstance(aid, Mapping) and aid.get("kind") == "gnss" and not aid.get("path")
            ]
            own = simulation.get("gnss", {})
            receivers = {name: own.get(name, {}) for name in sorted({*free, *own})}
            out["simulation"] = {**simulation, "gnss": receivers}
        return out

    def smoothed(self) -> NavigationSpec:
        """Return the specification with a smoother: its own, or a Rauch-Tung-Striebel smoother."""
        if self.smoother.kind != NONE:
            return self
        return NavigationSpec.checked({**self.plain(), "smoother": {"kind": "rts"}})

    def with_path(self, table: str, path: str | Path | None) -> NavigationSpec:
        """Return the specification with another map or truth, or with none."""
        plain = {key: value for key, value in self.plain().items() if key != table}
        given = {} if path is None else {table: {"path": str(path)}}
        return NavigationSpec.checked({**plain, **given})

    @property
    def receivers(self) -> dict[str, ReceiverTable]:
        """Simulated receivers, by name of their measurement."""
        return {} if self.simulation is None else self.simulation.gnss

    @property
    def fixes(self) -> list[str]:
        """Names of the measurements that give fixes."""
        return [name for name, aid in self.aiding.items() if aid.kind == "gnss"]

    def faults(self) -> Iterator[Fault]:
        """Yield modules that are incompatible, and what a stage lacks."""
        yield from source_faults(self, "[simulation] and [simulation.motion]")
        yield from self.axes.faults()
        yield from sensor_faults(self)
        yield from self._begin_faults()
        yield from self._alignment_faults()
        if getattr(self.mechanization, "height", "") == "damped":
            yield Fault(("mechanization", "height"), "config.damped-height-without-states")
        if self.gaps.beyond == "align" and self.start is not None:
            yield Fault(("gaps", "beyond"), "config.no-alignment-to-repeat")
        for name in self.aiding:
            yield from self._aid_faults(name)
        for name in self.receivers:
            if name not in self.fixes or self.aiding[name].path is not None:
                path = ("simulation", "gnss", name)
                yield Fault(path, "config.receiver-without-aid", {"name": name})
        if self.withhold is not None:
            named = self.withhold.aid
            if not self.fixes:
                yield Fault(("withhold", "aid"), "config.no-aid-to-withhold")
            elif named is not None and named not in self.fixes:
                data = {"word": named, "known": self.fixes}
                yield Fault(("withhold", "aid"), "config.unknown-aid-to-withhold", data)
        for form in self.output.files:
            if form not in TRAJECTORY_FORMATS:
                known = {"form": form, "known": TRAJECTORY_FORMATS}
                yield Fault(("output", "files"), "config.unknown-trajectory-form", known)
        yield from self._filter_faults()

    def _begin_faults(self) -> Iterator[Fault]:
        """Yield what contradicts a known start, or is missing without one."""
        if self.start is None:
            if self.coarse.kind == NONE:
                yield Fault(("start", "lat_deg"), "config.no-start")
            elif self.site is None and not self.fixes:
                yield Fault(("site", "lat_deg"), "config.no-initial-position")
            return
        for stage in ("coarse", "fine"):
            if getattr(self, stage).kind != NONE:
                yield Fault((stage, "kind"), "config.start-and-alignment", {"stage": stage})
        if self.site is not None:
            yield Fault(("site", "lat_deg"), "config.start-and-site")

    def _alignment_faults(self) -> Iterator[Fault]:
        """Yield alignments that do not end, or end after the record."""
        longest = self.log.length_s if self.log is not None else None
        for name in ("coarse", "fine"):
            stage = getattr(self, name)
            if longest is not None and (stage.duration_s or 0.0) > longest:
                data = {"longest": longest}
                yield Fault((name, "duration_s"), "config.longer-than-record", data)
            if self.start is not None:
                continue
            ends = [n for n in (*ENDS, "window_s") if getattr(stage, n, None) is not None]
            if stage.kind == NONE and ends:
                yield Fault((name, ends[0]), "config.alignment-end-without-alignment")
            commanded = any(one.mode != "navigation" or name == "fine" for one in self.commands)
            if stage.kind != NONE and not {*ends} & {*ENDS} and not commanded and self.live is None:
                yield Fault((name, "duration_s"), "config.alignment-never-ends")
        if self.start is None:
            yield from coarse_faults(self.coarse, self.fine, fixes=bool(self.fixes))

    def _aid_faults(self, name: str) -> Iterator[Fault]:
        """Yield a name that cannot be one, and data that a measurement lacks or does not take."""
        aid, path = self.aiding[name], ("aiding", name)
        if not _NAME.fullmatch(name):
            yield Fault(path, "config.bad-aid-name")
        entry = SLOTS["aiding"].entries[aid.kind]
        if not issubclass(entry, TabulatedMeasurement):
            if aid.path is not None:
                yield Fault((*path, "path"), "config.aid-takes-no-file", {"kind": aid.kind})
        elif not (
            aid.path is not None
            or name in self.receivers
            or self.live is not None
            or (entry.of_samples and self.log is not None)
        ):
            yield Fault((*path, "path"), "config.aid-file-missing", {"kind": aid.kind})
        for key in ("position_sd_m", "velocity_sd_m_per_s", "units", "datum_height_m", "origin"):
            if getattr(aid, key) and aid.kind != "gnss":
                yield Fault((*path, key), "config.fix-sd-of-other-aid", {"kind": aid.kind})
        if not any(getattr(aid, "field_ned_ut", (1.0,))):
            yield Fault(
                (*path, "field_ned_ut"), "navigation.no-field-of-the-earth", {"strength": 0.0}
            )
        if aid.kind == "barometer" and getattr(self.mechanization, "height", None) == "held":
            yield Fault((*path, "kind"), "config.height-aid-with-held-height")

    def _filter_faults(self) -> Iterator[Fault]:
        """Initialize the filter, which refuses incompatible parts."""
        beside, known = self.damping.beside, [k for k in DAMPINGS if k != self.damping.kind]
        if beside is not None and beside not in known:
            yield Fault(("damping", "beside"), "config.unknown-correction-beside", {"known": known})
        if self.smoother.kind != NONE and not DAMPINGS[self.damping.kind].corrects:
            yield Fault(("smoother", "kind"), "navigation.smoother-without-correction")
        try:
            sensors = sensors_of(self)
        except ConfigError:  # already among the faults
            return
        try:
            made = with_states(make_filter(self, sensors), make_aids(self))
        except ConfigError as error:
            table, _, block = (error.finding.quantity or "").partition(".")
            path = ("states", block) if block else ("sensors",)
            yield Fault(path if table == "states" else ("filter",), error.finding)
            return

        def begin() -> None:
            limit = made.mechanization.latitude_limit_deg
            start = NavState.from_degrees(min(80.0, limit), 0.0)
            made.begin(start, np.zeros((made.model.physical_size,) * 2))

        yield from refused(("filter",), begin)


def _named(name: Any, aid: Any) -> Any:
    """A measurement of the kind that it is called by, if it names none."""
    kinds = SLOTS["aiding"].entries
    called = isinstance(aid, Mapping) and "kind" not in aid and name in kinds
    return {"kind": name, **aid} if called else aid


# --- the modules --------------------------------------------------------------------------


def make_filter(spec: NavigationSpec, sensors: ImuUncertainty) -> ErrorFilter:
    """Create the filter of a specification, without measurement states.

    ConfigError: a module refuses an option, or a state has no size.
    """
    options = spec.filter.make(ellipsoid=spec.ellipsoid)
    tables = {name: getattr(spec.states, name) for name in STATED_STATES}
    processes = {name: one.process for name, one in tables.items() if one is not None}
    return ErrorFilter(
        spec.mechanization.make(ellipsoid=spec.ellipsoid),
        options.model(
            gyro_noise=sensors.gyro.axis("noise_density"),
            accel_noise=sensors.accel.axis("noise_density"),
            sensors=with_processes(stated_states(sensors, spec.sensors.states), processes),
        ),
        options.form,
        options.rule,
        step=options.step,
    )


def make_aids(spec: NavigationSpec) -> tuple[Measurement, ...]:
    """Create the measurements of a specification, in its order."""
    return tuple(aid.make(ellipsoid=spec.ellipsoid, name=name) for name, aid in spec.aiding.items())


class ExtrinsicsSpec(FileSpec):
    """Logs of two sensors on one rigid body."""

    called = "extrinsics"

    kind: Literal["imu", "magnetometer", "gnss"]
    log: LogTable
    #: Log of the other sensor; the same log, if not given.
    other: LogTable | None = None
    #: Orientation of the axes, as `AxesTable.axes`.
    axes: Word | None = None
    other_axes: Word | None = None
    #: Clock of the other less that of the log, roughly; searched, if not given.
    offset_s: Number | None = None
    #: Whether both have the same clock.
    one_clock: StrictBool = False
    #: Of fixes: the smoothed run whose states are the extrinsics.
    navigation: NavigationSpec | None = None
