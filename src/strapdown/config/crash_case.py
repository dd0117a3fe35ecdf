"""Configuration of a crash case: every key with its unit, and what it means."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, StrictBool, StrictInt

from strapdown.config.reading import FileSpec
from strapdown.config.spec import (
    Angle,
    At,
    Channel,
    Fault,
    FileName,
    NotNegative,
    Number,
    OneOrThree,
    Pair,
    Positive,
    Several,
    Sizes,
    Spec,
    Triple,
    Word,
    Words,
    is_number,
    missing,
    one_line,
    refuse,
)
from strapdown.config.toml_file import KeyPath, shown
from strapdown.crash.severity import SEVERITY_MODELS, load_severity_model
from strapdown.errors import Finding, StrapdownError
from strapdown.sensors.catalogue import SENSORS, load_sensor
from strapdown.sensors.crash_unit import LONGEST as LONGEST_ASSUMED
from strapdown.sensors.crash_unit import MOST_CHANGE, MOST_TURN
from strapdown.sensors.uncertainty import STATED_KEYS
from strapdown.units import ACCEL_UNITS, GYRO_UNITS, TIME_UNITS, unit_of


def _number_or_words(value: Any) -> Any:
    if isinstance(value, str):
        return one_line(value)
    if not is_number(value):
        raise refuse("", "config.not-number-or-text", given=shown(value))
    return float(value)


#: Of an injury-risk model.
Input = Annotated[float | str, BeforeValidator(_number_or_words)]
#: Above any car's speed on a road, and below most speeds in km/h entered as m/s.
FASTEST = 90.0
Speed = Annotated[Number, Field(ge=-FASTEST, le=FASTEST)]
#: Two of three such measurements lie within it.
AngleSd = Annotated[Number, Field(ge=0.0, le=180.0)]
Tilt = Annotated[Number, Field(ge=-90.0, le=90.0)]
TiltSd = Annotated[Number, Field(ge=0.0, le=90.0)]
#: Of a measured position: a larger one is probably in another unit.
PositionSd = Annotated[Number, Field(ge=0.0, le=2.0)]
#: Of a vehicle on a road.
Size = Annotated[Number, Field(ge=0.3, le=30.0)]
_FROM = "from the origin that all positions share"


class DeformationSpec(Spec):
    """Residual crush of the vehicle, and the stiffness of that side: its energy of deformation."""

    crush_m: Annotated[
        tuple[Annotated[Number, Field(ge=0.0, le=5.0)], ...], Field(min_length=2)
    ] = Field(
        description="depths of the residual crush at equally spaced stations across the damage, "
        "C1 to C6 where there are six"
    )
    crush_sd_m: PositionSd = Field(default=0.02, description="standard deviation of each depth")
    width_m: Annotated[Number, Field(gt=0.0, le=30.0)] = Field(
        description="width of the damage, from the first station to the last"
    )
    width_sd_m: PositionSd = Field(default=0.05, description="standard deviation of that width")
    stiffness_a_n_per_m: NotNegative = Field(
        description="coefficient A: force per width at which crush begins"
    )
    stiffness_a_sd_n_per_m: NotNegative = Field(description="standard deviation of A")
    stiffness_b_n_per_m2: Positive = Field(
        description="coefficient B: force per width that each depth adds"
    )
    stiffness_b_sd_n_per_m2: NotNegative = Field(description="standard deviation of B")
    #: Beyond it CRASH3 corrects no farther.
    angle_deg: Annotated[Number, Field(ge=-45.0, le=45.0)] = Field(
        default=0.0, description="of the force against the perpendicular of the damaged side"
    )
    angle_sd_deg: TiltSd = Field(default=5.0, description="standard deviation of that angle")


class VehicleSpec(Spec):
    """The vehicle, as a report draws and describes it.

    Its front is `front_m` ahead of the origin of all positions; by default the origin is in the
    middle. `outline_m` replaces length, width and front: corners seen from above, forward and
    right, in order around it.
    """

    name: Words = Field(default="", description="make, model and year of the vehicle")
    mass_kg: Annotated[Number, Field(ge=20.0, le=100_000.0)] | None = Field(
        default=None, description="mass of the vehicle with its load"
    )
    mass_sd_kg: Annotated[Number, Field(gt=0.0, le=50_000.0)] | None = Field(
        default=None, description="standard deviation of that mass; by default 3 % of it"
    )
    contact_m: Pair | None = Field(
        default=None,
        description="forward, right of the point at which the other vehicle pushed, from the "
        "origin that all positions share",
    )
    contact_sd_m: PositionSd = Field(
        default=0.2, description="standard deviation of each of these coordinates"
    )
    crush_m: Annotated[Number, Field(gt=0.0, le=5.0)] | None = Field(
        default=None, description="largest depth to which the vehicle was crushed"
    )
    crush_sd_m: PositionSd = Field(default=0.05, description="standard deviation of that depth")
    against: Literal["vehicle", "barrier"] = Field(
        default="vehicle",
        description="what it met; a barrier is rigid and does not move",
    )
    deformation: DeformationSpec | None = Field(
        default=None, description="residual crush and stiffness, for the energy of deformation"
    )
    rear_axle_m: Pair | None = Field(
        default=None,
        description="forward, right of the middle of the rear axle, from the origin that all "
        "positions share",
    )
    length_m: Size = Field(default=4.5, description="overall length of the vehicle")
    width_m: Size = Field(default=1.8, description="width of the vehicle without mirrors")
    front_m: Number | None = Field(
        default=None,
        description="how far the front of the vehicle is ahead of the origin of positions",
    )
    outline_m: tuple[Pair, ...] = Field(
        default=(),
        description="corners of the vehicle from above: forward, right of each, around it",
    )


class PointSpec(Spec):
    """The point whose motion is reconstructed."""

    name: Words = Field(default="reference point", description="what the reference point is")
    position_m: Triple = Field(
        default=(0.0, 0.0, 0.0), description=f"forward, right, down of the reference point {_FROM}"
    )


class EntrySpec(Spec):
    """Motion of the vehicle at one instant, and its uncertainty.

    With `gnss` and `speed_record` it is found from the drive before the crash, and with it biases,
    scale factors and mounting of the recorders, as far as the drive shows them.
    """

    kind: Literal["speed", "standstill", "gnss", "speed_record"] = Field(
        default="speed", description="speed, standstill, gnss or speed_record"
    )
    source: str = Field(
        default="",
        description="where the speed is from: a test's speed trap, a tachograph, skid marks",
    )
    speed_m_per_s: Speed | None = Field(
        default=None, description="speed of the vehicle at the entry"
    )
    speed_sd_m_per_s: Annotated[Number, Field(ge=0.0, le=FASTEST / 3.0)] | None = Field(
        default=None, description="standard deviation of that speed"
    )
    time_s: Annotated[Number, Field(ge=-600.0, le=600.0)] = Field(
        default=0.0, description="instant of the entry, from the trigger"
    )
    heading_deg: Angle = Field(
        default=0.0, description="heading of the vehicle at the entry, clockwise from north"
    )
    heading_sd_deg: AngleSd = 0.0
    slip_deg: Angle = Field(default=0.0, description="direction of travel less heading, clockwise")
    slip_sd_deg: AngleSd = 0.0
    climb_sd_m_per_s: NotNegative = 0.0
    path: FileName | None = Field(default=None, description="file of the satellite fixes")
    antenna_m: Triple | None = Field(
        default=None, description=f"forward, right, down of the antenna {_FROM}"
    )
    antenna_sd_m: PositionSd = 0.0
    speed_path: FileName | None = Field(
        default=None,
        description="file of the speeds of the vehicle's wheels (CAN, OBD) before the crash",
    )
    speed_column: Channel | None = Field(default=None, description="the column of the speeds")
    speed_unit: Word | None = Field(
        default=None, description="unit of the speeds: km/h, mph or m/s, where none is stated"
    )
    #: Tires and wheel circumference: standard deviation of the relative error.
    speed_scale_sd_percent: Annotated[Number, Field(ge=0.0, le=20.0)] = 2.0
    speed_delay_s: Annotated[Number, Field(ge=-2.0, le=2.0)] = 0.1
    speed_delay_sd_s: Annotated[Number, Field(ge=0.0, le=1.0)] = 0.1
    trigger_s: Number = Field(
        default=0.0, description="instant of the trigger on the clock of the fixes or speeds"
    )
    window_s: Annotated[Number, Field(ge=1.0, le=60.0)] = Field(
        default=60.0, description="length of the drive before the entry that is used"
    )


class TriadSpec(Spec):
    """One triad of sensors: its channels and their uncertainty.

    A channel is the name of a column or channel of the record, with a minus sign if it points
    the other way; an omitted axis is missing.
    """

    name: Words = Field(default="", description="a unique name")
    path: FileName = Field(description="the file, from the folder of this one")
    channels: dict[Literal["x", "y", "z"], Channel] = Field(
        default_factory=dict,
        description="the column or channel of each axis: x forward, y right, z down",
    )
    time: Channel | None = Field(default=None, description="column of the time")
    time_unit: Word | None = Field(default=None, description="unit of the time: s, ms or us")
    rate_hz: Positive | None = Field(default=None, description="samples in a second")
    unit: Word | None = Field(
        default=None, description="unit of the record: g or m/s2, deg/s or rad/s"
    )
    sampling: Literal["instantaneous", "mean"] | None = Field(
        default=None, description="instantaneous or mean"
    )
    sensor: FileName | None = Field(
        default=None, description="a sensor of the catalogue, or a .toml file of your own"
    )
    #: Replaces the sensor's: keys of the sensor catalogue, each with its unit.
    uncertainty: dict[Word, OneOrThree] = Field(
        default_factory=dict,
        description="what is not known of the sensor, from its data sheet",
    )


class AssumedSpec(Spec):
    """Assumed values for missing axes and gyros, with standard deviations."""

    turn_sd_deg: Sizes | None = Field(
        default=None,
        description="by how much the vehicle may have turned, as a standard deviation",
    )
    delta_v_sd_m_per_s: Sizes | None = Field(
        default=None,
        description="how large delta-V along the missing axis may be, as a standard deviation",
    )
    over_s: Pair = (0.0, 0.15)
    because: str = Field(default="", description="why that may be taken")


class UnitSpec(Spec):
    """A recorder on the vehicle."""

    name: Word = Field(description="a unique name")
    position_m: Triple = Field(
        default=(0.0, 0.0, 0.0),
        description=f"forward, right, down of the recorder {_FROM}; delta-V and the direction of "
        "force move with it",
    )
    position_sd_m: PositionSd = Field(
        default=0.0,
        description="standard deviation of each of these coordinates: how well it was measured",
    )
    angles_deg: tuple[Angle, Angle, Angle] = Field(
        default=(0.0, 0.0, 0.0),
        description="roll, pitch, heading that turn vehicle axes into the recorder's",
    )
    angles_sd_deg: TiltSd = Field(default=0.0, description="standard deviation of these angles")
    trigger_s: Number | None = Field(
        default=None, description="instant of the trigger on the recorder's clock"
    )
    trigger_sd_s: NotNegative = Field(default=0.0, description="standard deviation of that instant")
    accelerometers: tuple[TriadSpec, ...] = Field(
        min_length=1, description="one for each range, the lowest first"
    )
    gyro: TriadSpec | None = None
    gyro_from: Word | None = Field(
        default=None, description="name of the unit whose gyro turns with this one"
    )
    assumed: AssumedSpec | None = Field(
        default=None, description="what is taken for axes and gyros that are not there"
    )
    rest_s: Pair | None = Field(
        default=None,
        description="start and end of the time in which the vehicle stood, from the trigger",
    )
    levelling_deg: tuple[Tilt, Tilt] | None = Field(
        default=None, description="roll and pitch of the vehicle before the crash"
    )
    levelling_sd_deg: TiltSd | None = Field(
        default=None, description="standard deviation of these angles"
    )

    @property
    def accelerometer_names(self) -> tuple[str, ...]:
        """Names of the accelerometers, numbered where there are several."""
        several = len(self.accelerometers) > 1
        return tuple(
            triad.name or (f"accelerometer {k}" if several else "accelerometer")
            for k, triad in enumerate(self.accelerometers, start=1)
        )


class ReferenceSpec(Spec):
    """Other known data of the crash, for comparison with the results."""

    kind: Literal["path", "delta_v", "force"] = Field(description="path, delta_v or force")
    name: Word = Field(description="what it is: a video, a barrier's force, another recorder")
    source: str = Field(default="", description="where it is from")
    path: FileName | None = Field(
        default=None,
        description="file of the path of the reference point: time, north, east, down; or of the "
        "force on the vehicle: time, force",
    )
    force_column: Channel | None = Field(default=None, description="the column of the force")
    force_unit: Literal["N", "kN", "lbf", "kip"] | None = Field(
        default=None, description="unit of the force: N, kN, lbf or kip, where none is stated"
    )
    force_sd_percent: Annotated[Number, Field(gt=0.0, le=50.0)] | None = Field(
        default=None, description="standard deviation of the scale of the force"
    )
    delta_v_m_per_s: Speed | None = Field(
        default=None, description="change of velocity along the axis, from time zero"
    )
    delta_v_sd_m_per_s: NotNegative = 0.0
    axis: Literal["forward", "right", "resultant"] = "forward"
    #: By default over the event.
    over_s: Pair | None = None


class OptionsSpec(Spec):
    """Options of the computation."""

    window_s: Pair | None = Field(
        default=None, description="start and end of the path, from the trigger"
    )
    rate_hz: Positive = 200.0
    sampling: Literal["instantaneous", "mean"] = "instantaneous"
    clock: Literal["trigger", "correlation"] = "trigger"
    combine: StrictBool = True
    peak_window_s: Annotated[Positive, Field(le=1.0)] = 0.030
    #: On the Earth, from the equator at altitude to the poles.
    gravity_m_per_s2: Annotated[Number, Field(gt=9.7, lt=9.9)] = 9.80665
    zero_at: Literal["interval", "threshold"] = "interval"
    monte_carlo_runs: StrictInt = Field(default=2000, ge=0, le=1_000_000)
    seed: StrictInt = Field(default=0, ge=0)
    #: The largest that is possible: dry asphalt.
    tire_friction: Annotated[Number, Field(ge=0.0, le=2.0)] = Field(
        default=0.8, description="largest coefficient of friction of the tires on the road"
    )
    #: None selects those that apply to the crash type.
    severity: Annotated[tuple[FileName, ...] | None, Several] = Field(
        default=None, description="names of models of injury risk, or .toml files of your own"
    )
    severity_inputs: dict[Word, Input] = Field(default_factory=dict)
    units: Literal["metric", "si", "us"] = Field(
        default="metric", description="units of the report: metric (km/h, m), si (m/s, m) or us"
    )
    formats: Annotated[tuple[Literal["csv", "mme"], ...], Several] = ("csv",)


class CaseSpec(FileSpec):
    """One crash case."""

    called = "case"
    looks_into_files: ClassVar[bool] = True

    name: str = "case"
    title: Word = Field(description="what the case is called in the report")
    number: Words = Field(default="", description="the number or sign of the case")
    author: Words = Field(default="", description="who answers for the report")
    description: str = Field(default="", description="what happened, in your words")
    vehicle: VehicleSpec = VehicleSpec()
    point: PointSpec = Field(
        default=PointSpec(), description="the point whose motion is reconstructed"
    )
    entry: EntrySpec = Field(
        description="how the vehicle moved before the crash, and how that is known"
    )
    units: tuple[UnitSpec, ...] = Field(
        min_length=1, description="one for each recorder on the vehicle"
    )
    references: tuple[ReferenceSpec, ...] = Field(
        default=(), description="something else that is known of the crash"
    )
    options: OptionsSpec = OptionsSpec()

    def faults(self) -> Iterator[Fault]:
        """Yield what is missing, implausible, or contradicts another value."""
        # The checks need the sensor catalogue; a specification alone does not.

        return case_faults(self)


# --- consistency: missing values, implausible ones, contradictions -----------------------

fault = Fault.of


def case_faults(spec: CaseSpec) -> Iterator[Fault]:
    """Yield the faults of a case, whose files are named by absolute paths."""
    yield from list(_vehicle(spec.vehicle)) or _positions(spec)
    yield from _deformation(spec.vehicle)
    yield from _entry(spec)
    yield from _names("units", [unit.name for unit in spec.units])
    yield from _triggers(spec)
    for k, unit in enumerate(spec.units):
        at: KeyPath = ("units", k)
        for name, code in _MEASURED.items():
            if name not in unit.model_fields_set:
                yield missing(CaseSpec, (*at, name), code)
        yield from _gyro(at, unit, spec)
        yield from _levelling(at, unit)
        yield from _rest(at, unit, spec)
        yield from _assumed(at, unit)
    yield from _triads(spec)
    yield from _names("references", [r.name for r in spec.references])
    yield from _references(spec)
    yield from _options(spec)


_MEASURED = {
    "position_m": "config.unit-position-missing",
    "position_sd_m": "config.unit-position-sd-missing",
}


def _names(table: str, names: Sequence[str]) -> Iterator[Fault]:
    seen: dict[str, int] = {}
    for k, name in enumerate(names):
        first = seen.setdefault(" ".join(name.split()).casefold(), k)
        if first != k:
            other = At((table, first, "name"))
            yield fault((table, k, "name"), "config.name-repeated", other=other)


# --- vehicle and positions: outside of the vehicle, the unit is probably wrong ------------

Corner = tuple[float, float]
#: Largest distance of a position from the outline: a camera on a bumper, a mirror, a rough drawing.
BEYOND = 0.5  # m
#: Largest distance above or below the origin.
HIGHEST = 4.5  # m
LONGEST = 30.0  # m
#: Beyond this distance from the origin a coordinate is probably in another unit.
LARGE = 10.0  # m
SMALLEST = 0.1  # m²


def _vehicle(vehicle: VehicleSpec) -> Iterator[Fault]:
    outline, corners = ("vehicle", "outline_m"), vehicle.outline_m
    if "outline_m" in vehicle.model_fields_set:
        for name in ("length_m", "width_m", "front_m"):
            if name in vehicle.model_fields_set and getattr(vehicle, name) is not None:
                data: dict[str, Any] = {"other": At(outline), "name": name}
                yield fault(("vehicle", name), "config.outline-and-size", **data)
        # Half the sum of the cross products of neighbors (Gauss).
        sides = zip(corners, [*corners[1:], *corners[:1]], strict=True)
        area = abs(0.5 * math.fsum(x * v - u * y for (x, y), (u, v) in sides))
        if len(corners) < 3:
            yield fault(outline, "config.outline-too-few-corners", count=len(corners))
        elif max(math.dist(a, corners[0]) for a in corners) > LONGEST:
            yield fault(outline, "config.outline-too-large")
        elif area < SMALLEST:
            yield fault(outline, "config.outline-area-too-small", area=area)
    if vehicle.front_m is not None and not 0.0 <= vehicle.front_m <= vehicle.length_m:
        other = At(("vehicle", "length_m"), vehicle.length_m)
        yield fault(("vehicle", "front_m"), "config.origin-outside-vehicle", other=other)


def _deformation(vehicle: VehicleSpec) -> Iterator[Fault]:
    found = vehicle.deformation
    if found is None:
        return
    spans = (max(along) - min(along) for along in zip(*vehicle.outline_m, strict=True))
    size = max(vehicle.length_m, vehicle.width_m, *spans)
    for name, given in (("crush_m", max(found.crush_m)), ("width_m", found.width_m)):
        if given > size:
            other = At(("vehicle",), f"{vehicle.length_m:g} m by {vehicle.width_m:g} m")
            path = ("vehicle", "deformation", name)
            yield fault(path, "config.deformation-beyond-vehicle", other=other)


def _positions(spec: CaseSpec) -> Iterator[Fault]:
    places: list[tuple[KeyPath, Any]] = [(("point", "position_m"), spec.point.position_m)]
    places += [(("units", k, "position_m"), unit.position_m) for k, unit in enumerate(spec.units)]
    places += [(("entry", "antenna_m"), spec.entry.antenna_m)]
    vehicle = spec.vehicle
    length, width, front = vehicle.length_m, vehicle.width_m, vehicle.front_m
    back, half = (-length, width) if front is None else (front - length, 0.5 * width)
    if front is None:
        # With the origin anywhere in the vehicle, all positions that it may then cover.
        front = length
    sides = [(front, -half), (front, half), (back, half), (back, -half)]
    corners = list(vehicle.outline_m) or sides
    if vehicle.outline_m:
        length, width = (max(along) - min(along) for along in zip(*corners, strict=True))
    for path, place in places:
        if place is None:
            continue
        beside, down = _outside(place[:2], corners), abs(place[2])
        # In which smaller unit it would lie on the vehicle.
        hint = Finding("config.position-convention")
        keys = [
            f"position_{unit}" if path[-1] == "position_m" else f"antenna_{unit}"
            for part, unit in ((1000.0, "mm"), (100.0, "cm"))
            if max(map(abs, place)) >= LARGE
            and down / part <= HIGHEST
            and _outside((place[0] / part, place[1] / part), corners) <= BEYOND
        ]
        if keys:
            hint = Finding("config.position-in-other-unit", keys=keys)
        if beside > BEYOND:
            stated = At(("vehicle",), f"{length:g} m by {width:g} m")
            data = {"distance": beside, "length": length, "width": width, "hint": hint}
            yield fault(path, "config.position-outside-vehicle", **data, vehicle=stated)
        elif down > HIGHEST:
            side = "below" if place[2] > 0 else "above"
            yield fault(path, f"config.position-{side}-origin", distance=down, hint=hint)


def _outside(place: Corner, corners: Sequence[Corner]) -> float:
    """Distance from a polygon, 0 within it, m."""
    sides = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    x, y = place
    crossings = sum(
        (b > y) != (d > y) and x < a + (y - b) / (d - b) * (c - a) for (a, b), (c, d) in sides
    )
    return 0.0 if crossings % 2 else min(_from_side(place, a, b) for a, b in sides)


def _from_side(place: Corner, begin: Corner, end: Corner) -> float:
    x, y = end[0] - begin[0], end[1] - begin[1]
    square = x * x + y * y
    along = (place[0] - begin[0]) * x + (place[1] - begin[1]) * y
    part = min(max(along / square, 0.0), 1.0) if square else 0.0
    return math.dist(place, (begin[0] + part * x, begin[1] + part * y))


# --- the entry ----------------------------------------------------------------------------

_OF_SPEED = (
    "speed_m_per_s",
    "slip_deg",
    "climb_sd_m_per_s",
)
_OF_SPEEDS = ("speed_sd_m_per_s",)
_OF_HEADING = ("heading_deg", "heading_sd_deg")
_OF_FIXES = ("path", "antenna_m", "antenna_sd_m")
_OF_SPEED_RECORD = (
    "speed_path",
    "speed_column",
    "speed_unit",
    "speed_scale_sd_percent",
    "speed_delay_s",
    "speed_delay_sd_s",
)
_OF_DRIVE = ("trigger_s", "window_s")
#: Keys that each kind does not use; a value of zero is ignored.
_NO_USE = {
    "speed": (*_OF_FIXES, *_OF_SPEED_RECORD, *_OF_DRIVE),
    # Its heading is of use to the closure with the other vehicle.
    "standstill": (
        *_OF_SPEED,
        *_OF_SPEEDS,
        "slip_sd_deg",
        "time_s",
        *_OF_FIXES,
        *_OF_SPEED_RECORD,
        *_OF_DRIVE,
    ),
    "gnss": (*_OF_SPEED, *_OF_HEADING),
    "speed_record": (*_OF_SPEED, *_OF_FIXES),
}
_NEEDED = {
    "speed": {
        "speed_m_per_s": "config.entry-speed-missing",
        "speed_sd_m_per_s": "config.entry-speed-sd-missing",
        "source": "config.entry-source-missing",
    },
    "standstill": {},
    "gnss": {"path": "config.entry-fixes-missing"},
    "speed_record": {"speed_path": "config.entry-speed-record-missing"},
}


def _entry(spec: CaseSpec) -> Iterator[Fault]:
    entry, window = spec.entry, spec.options.window_s
    unused = _NO_USE[entry.kind]
    if entry.kind == "gnss" and entry.speed_path is None:
        unused = (*unused, *_OF_SPEEDS, *_OF_SPEED_RECORD)
    for name in unused:
        if name in entry.model_fields_set and getattr(entry, name) not in (None, 0.0):
            yield fault(
                ("entry", name),
                f"config.entry-{entry.kind.replace('_', '-')}-no-use",
                other=At(("entry", "kind"), entry.kind),
                key=name,
                kind="gnss"
                if name in _OF_FIXES
                else "speed_record"
                if name in (*_OF_SPEED_RECORD, *_OF_DRIVE)
                else "speed",
            )
    for name, code in _NEEDED[entry.kind].items():
        given = getattr(entry, name)
        if given is None or (isinstance(given, str) and not given.strip()):
            yield missing(CaseSpec, ("entry", name), code)
    if entry.kind != "standstill" and entry.speed_sd_m_per_s == 0.0:
        yield fault(("entry", "speed_sd_m_per_s"), "config.entry-speed-sd-zero")
    start, end = window or (-math.inf, math.inf)
    outside = start < end and not start <= entry.time_s <= end
    if entry.kind != "standstill" and outside:
        first, second = ("entry", "time_s"), ("options", "window_s")
        if "time_s" not in entry.model_fields_set:
            first, second = second, first
        yield fault(first, "config.entry-outside-window", other=At(second, entry.time_s))


# --- recorders ----------------------------------------------------------------------------

#: A common trigger with a larger standard deviation cannot synchronize clocks.
MOST_TRIGGER_SD = 0.5  # s


def _triggers(spec: CaseSpec) -> Iterator[Fault]:
    without = [k for k, unit in enumerate(spec.units) if unit.trigger_s is None]
    if spec.options.clock == "trigger":
        for k in without:
            yield missing(CaseSpec, ("units", k, "trigger_s"), "config.trigger-missing")
    elif len(without) == len(spec.units):
        yield missing(CaseSpec, ("units", 0, "trigger_s"), "config.no-unit-with-trigger")
    for k, unit in enumerate(spec.units):
        if spec.options.clock == "trigger" and unit.trigger_sd_s > MOST_TRIGGER_SD:
            data = {"trigger_sd_s": unit.trigger_sd_s}
            yield fault(("units", k, "trigger_sd_s"), "config.trigger-sd-too-large", **data)


def _gyro(at: KeyPath, unit: UnitSpec, spec: CaseSpec) -> Iterator[Fault]:
    path, lender = (*at, "gyro_from"), unit.gyro_from
    if lender is None:
        return
    known = [other.name for other in spec.units if other.gyro is not None]
    at_lender = next((n for n, other in enumerate(spec.units) if other.name == lender), None)
    if unit.gyro is not None:
        yield fault(path, "config.gyro-and-lender", other=At((*at, "gyro")))
    elif lender == unit.name:
        yield fault(path, "config.lender-is-borrower", other=At((*at, "name")))
    elif at_lender is None:
        code = "config.unknown-unit-with-gyro" if known else "config.unknown-unit-no-gyro"
        yield fault(path, code, word=lender, known=known)
    elif spec.units[at_lender].gyro is None:
        code = "config.lender-without-gyro" if known else "config.no-unit-with-gyro"
        other = At(("units", at_lender, "name"))
        yield fault(path, code, other=other, word=lender, known=known)


def _levelling(at: KeyPath, unit: UnitSpec) -> Iterator[Fault]:
    level, sd = (*at, "levelling_deg"), (*at, "levelling_sd_deg")
    if unit.levelling_deg is not None and unit.levelling_sd_deg is None:
        yield missing(CaseSpec, sd, "config.levelling-sd-missing", said=At(level))
    if unit.levelling_deg is None and unit.levelling_sd_deg is not None:
        yield missing(CaseSpec, level, "config.levelling-missing", said=At(sd))


def _rest(at: KeyPath, unit: UnitSpec, spec: CaseSpec) -> Iterator[Fault]:
    path, entry = (*at, "rest_s"), spec.entry
    if unit.rest_s is None:
        return
    start, end = unit.rest_s
    if not start < end:
        yield fault(path, "config.span-end-before-begin", key="rest_s")
    elif end > 0.0:
        yield fault(path, "config.rest-after-trigger", end=end)
    elif entry.kind == "speed" and entry.speed_m_per_s and end > entry.time_s:
        said = At(("entry", "speed_m_per_s"))
        other = At(("entry", "time_s"), entry.time_s)
        yield fault(path, "config.rest-after-entry", other=other, said=said)


# --- assumptions: for every missing axis, and for no other --------------------------------

AXES = ("x", "y", "z")


def _assumed(at: KeyPath, unit: UnitSpec) -> Iterator[Fault]:
    assumed = unit.assumed or AssumedSpec()
    no_force = _unmeasured(unit.accelerometers[0])
    no_turn = [] if unit.gyro_from is not None else list(AXES)
    no_turn = no_turn if unit.gyro is None else _unmeasured(unit.gyro)
    first = (*at, "accelerometers", 0, "channels")
    for n, triad in enumerate(unit.accelerometers):
        if _unmeasured(triad) != no_force:
            path = (*at, "accelerometers", n, "channels")
            yield fault(path, "config.range-axes-differ", other=At(first))
    if no_force and assumed.delta_v_sd_m_per_s is None and len(no_force) < len(AXES):
        yield fault(first, "config.axis-not-measured", axes=no_force)
    if no_turn and assumed.turn_sd_deg is None:
        if unit.gyro is None:
            yield fault(at, "config.no-gyro", axes=no_turn)
        else:
            path = (*at, "gyro", "channels")
            yield fault(path, "config.turn-axis-not-measured", axes=no_turn)
    if unit.assumed is None:
        return
    path, measured = (*at, "assumed"), "gyro" if unit.gyro is not None else "gyro_from"
    if not no_force and not no_turn and not assumed.model_fields_set & {*_ASSUMED}:
        yield fault(path, "config.nothing-to-assume", other=At((*at, measured)))
        return
    for name, most in _ASSUMED.items():
        lacking = no_turn if name == "turn_sd_deg" else no_force
        given = getattr(assumed, name)
        sizes = given if isinstance(given, tuple) else (given or 0.0,)
        if given is not None and not lacking:
            other = At((*at, measured if name == "turn_sd_deg" else "accelerometers"))
            yield fault((*path, name), "config.assumed-though-measured", other=other)
        elif max(sizes) > most:
            yield fault((*path, name), "config.assumed-sd-too-large", most=most)
    if not assumed.because.strip():
        yield missing(CaseSpec, (*path, "because"), "config.reason-of-assumption-missing")
    start, end = assumed.over_s
    if not 0.0 < end - start <= LONGEST_ASSUMED:
        yield fault((*path, "over_s"), "config.assumed-span-out-of-range", end=end - start)


#: Largest plausible standard deviations.
_ASSUMED = {"turn_sd_deg": MOST_TURN, "delta_v_sd_m_per_s": MOST_CHANGE}


def _unmeasured(triad: TriadSpec) -> list[str]:
    return [axis for axis in AXES if axis not in triad.channels]


# --- triads: each channel once, its unit, and its uncertainty -----------------------------

_TRIAD_UNITS = {"accel": ACCEL_UNITS, "gyro": GYRO_UNITS}
_OTHER_UNIT = {
    "accel": "config.gyro-unit-of-accelerometers",
    "gyro": "config.accelerometer-unit-of-gyro",
}


def _triads(spec: CaseSpec) -> Iterator[Fault]:
    used: dict[tuple[str, str], KeyPath] = {}
    for k, unit in enumerate(spec.units):
        ranges = [
            (("units", k, "accelerometers", n), "accel", triad)
            for n, triad in enumerate(unit.accelerometers)
        ]
        gyro = [(("units", k, "gyro"), "gyro", unit.gyro)] if unit.gyro is not None else []
        broken = False
        for at, kind, triad in [*ranges, *gyro]:
            yield from _channels(at, triad, used)
            yield from _triad_units(at, kind, triad)
            found = [*_sensor(at, kind, triad), *_uncertainty(at, kind, triad.uncertainty)]
            yield from found
            broken = broken or bool(found)
        if not broken:
            yield from _ranges(("units", k, "accelerometers"), unit.accelerometers)


def _channels(
    at: KeyPath, triad: TriadSpec, used: dict[tuple[str, str], KeyPath]
) -> Iterator[Fault]:
    if not triad.channels and "gyro" not in at:
        yield missing(CaseSpec, (*at, "channels"), "config.channels-missing")
    for axis, channel in triad.channels.items():
        path = (*at, "channels", axis)
        name = channel.removeprefix("-").strip()
        before = used.setdefault((triad.path, name), path)
        if not name:
            yield fault(path, "config.sign-without-channel")
        elif name == triad.time:
            yield fault(path, "config.time-as-axis", other=At((*at, "time")))
        elif before != path:
            gyro = "gyro" in at and "gyro" in before
            code = "config.gyro-channel-used-twice" if gyro else "config.channel-used-twice"
            yield fault(path, code, other=At(before))


def _triad_units(at: KeyPath, kind: str, triad: TriadSpec) -> Iterator[Fault]:
    if triad.unit is not None:
        unit = unit_of(triad.unit) or triad.unit
        other = _TRIAD_UNITS["gyro" if kind == "accel" else "accel"]
        if unit in other:
            yield fault((*at, "unit"), _OTHER_UNIT[kind], units=_TRIAD_UNITS[kind])
    given = triad.time_unit
    if given is not None and (unit_of(given) or given) not in TIME_UNITS:
        yield fault((*at, "time_unit"), "config.unknown-time-unit", word=given, known=TIME_UNITS)


def _sensor(at: KeyPath, kind: str, triad: TriadSpec) -> Iterator[Fault]:
    name, path = triad.sensor, (*at, "sensor")
    if name is None:
        if not triad.uncertainty:
            yield missing(CaseSpec, path, "config.uncertainty-missing")
        return
    if name.lower() not in SENSORS and not name.lower().endswith(".toml"):
        yield fault(path, "config.unknown-sensor", word=name, known=SENSORS)
        return
    try:
        sensor = load_sensor(name)
    except StrapdownError as error:
        part = error.finding.quantity
        code = "config.sensor-key-refused" if part else "config.sensor-refused"
        yield fault(path, code, part=part, reason=error.finding)
        return
    except (RecursionError, OSError, ValueError) as error:
        yield fault(path, "config.sensor-unreadable", error=type(error).__name__)
        return
    if not any(figure.key.startswith(f"{kind}.") for figure in sensor.sources):
        lacks = "gyro" if kind == "gyro" else "accelerometers"
        yield fault(path, f"config.sensor-without-{lacks}")


def _uncertainty(at: KeyPath, kind: str, stated: Mapping[str, Any]) -> Iterator[Fault]:
    known = STATED_KEYS[kind]
    by: dict[str, str] = {}
    for name, given in stated.items():
        path = (*at, "uncertainty", name)
        if name not in known:
            yield Fault(path, Finding("config.unknown-key", word=name[:100], known=known))
            continue
        quantity = known[name].quantity
        numbers = given if isinstance(given, tuple) else (given,)
        if quantity in by:
            other = At((*at, "uncertainty", by[quantity]))
            data: dict[str, Any] = {"other": other, "property": quantity.replace("_", " ")}
            yield fault(path, "config.uncertainty-in-two-units", **data)
        elif min(numbers) < 0.0:
            yield fault(path, "config.negative-uncertainty")
        elif quantity in ("full_scale", "bandwidth") and min(numbers) == 0.0:
            yield fault(path, "config.zero-uncertainty")
        elif quantity == "bandwidth" and len(numbers) != 1:
            yield fault(path, "config.bandwidth-by-axis")
        by.setdefault(quantity, name)


def _ranges(at: KeyPath, triads: Sequence[TriadSpec]) -> Iterator[Fault]:
    for n in range(1, len(triads)):
        before, after = _full_scale(triads[n - 1]), _full_scale(triads[n])
        if before and after and any(b > a for a, b in zip(after, before, strict=True)):
            yield fault(
                (*at, n, *_range_key(triads[n])),
                "config.ranges-not-ascending",
                other=At((*at, n - 1, *_range_key(triads[n - 1]))),
                before=_in_g(before),
                after=_in_g(after),
            )


def _range_key(triad: TriadSpec) -> KeyPath:
    return ("uncertainty", "full_scale_g") if "full_scale_g" in triad.uncertainty else ("sensor",)


def _full_scale(triad: TriadSpec) -> tuple[float, ...] | None:
    """As stated or from the sensor, g; None if unknown."""
    stated = triad.uncertainty.get("full_scale_g")
    if stated is not None:
        return stated if isinstance(stated, tuple) else (stated, stated, stated)
    figures = () if triad.sensor is None else load_sensor(triad.sensor).sources
    return next((f.value for f in figures if f.key == "accel.full_scale_g"), None)


def _in_g(values: Sequence[float]) -> str:
    return f"{values[0]:g}" if len(set(values)) == 1 else f"[{', '.join(f'{v:g}' for v in values)}]"


# --- references and options ---------------------------------------------------------------

_REFERENCES_NO_USE = {
    "path": (
        *("delta_v_m_per_s", "delta_v_sd_m_per_s", "axis", "over_s"),
        *("force_column", "force_unit", "force_sd_percent"),
    ),
    "delta_v": ("path", "force_column", "force_unit", "force_sd_percent"),
    "force": ("delta_v_m_per_s", "delta_v_sd_m_per_s", "over_s"),
}
_REFERENCES_NEEDED = {
    "path": ("path",),
    "delta_v": ("delta_v_m_per_s",),
    "force": ("path", "force_sd_percent"),
}
#: The path covers the crash, not the whole drive.
LONGEST_WINDOW = 60.0  # s


def _references(spec: CaseSpec) -> Iterator[Fault]:
    for k, reference in enumerate(spec.references):
        at, kind = ("references", k), reference.kind
        for name in _REFERENCES_NO_USE[kind]:
            if name in reference.model_fields_set and getattr(reference, name) is not None:
                code = f"config.reference-{kind.replace('_', '-')}-no-use"
                yield fault((*at, name), code, other=At((*at, "kind")))
        change = reference.delta_v_m_per_s
        for needed in _REFERENCES_NEEDED[kind]:
            if getattr(reference, needed) is None:
                yield missing(CaseSpec, (*at, needed), "config.reference-value-missing", kind=kind)
        if kind == "force" and spec.vehicle.mass_kg is None:
            said = At((*at, "kind"))
            yield missing(CaseSpec, ("vehicle", "mass_kg"), "config.force-without-mass", said=said)
        if reference.axis == "resultant" and (change or 0.0) < 0.0:
            path = (*at, "delta_v_m_per_s")
            yield fault(path, "config.resultant-with-sign", other=At((*at, "axis")))
        if reference.over_s is not None and not reference.over_s[0] < reference.over_s[1]:
            yield fault((*at, "over_s"), "config.span-end-before-begin", key="over_s")


def _options(spec: CaseSpec) -> Iterator[Fault]:
    options = spec.options
    at, peak_at = ("options", "window_s"), ("options", "peak_window_s")
    if options.window_s is not None:
        start, end = options.window_s
        if not start < end:
            yield fault(at, "config.span-end-before-begin", key="window_s")
        elif end - start > LONGEST_WINDOW:
            yield fault(at, "config.window-too-long", end=end - start)
        elif end <= 0.0:
            yield fault(at, "config.window-before-trigger")
        elif options.peak_window_s > end - start:
            first, second = (peak_at, at)
            if "peak_window_s" not in options.model_fields_set:
                first, second = at, peak_at
            other = At(second, options.peak_window_s)
            yield fault(first, "config.peak-window-longer-than-window", other=other)
    names = options.severity or ()
    for k, name in enumerate(names):
        path = ("options", "severity", k)
        if name.lower().endswith(".toml"):
            try:
                load_severity_model(name)
            except StrapdownError as error:
                of = error.finding
                if of.quantity and of.line:
                    told = {"line": of.line, "part": of.quantity, "reason": of}
                    yield fault(path, "config.severity-key-refused", **told)
                else:
                    yield fault(path, "config.severity-file-refused", reason=of)
                continue
            if name in names[:k]:
                yield fault(path, "config.severity-model-repeated")
        elif name not in SEVERITY_MODELS:
            data = {"word": name, "known": SEVERITY_MODELS}
            yield fault(path, "config.unknown-severity-model", **data)
        elif name in names[:k]:
            yield fault(path, "config.severity-model-repeated")
