"""Configuration of a crash case: every key with its unit, and what it means."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, StrictBool, StrictInt

from strapdown.config.reading import FileSpec
from strapdown.config.spec import (
    Angle,
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
    one_line,
    refuse,
)
from strapdown.config.toml_file import shown


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
        from strapdown.config.crash_checks import case_faults

        return case_faults(self)
