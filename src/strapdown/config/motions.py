"""Configuration of motions on the Earth and of simulated trajectories: every key with its unit."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field, StrictInt, model_validator

from strapdown.config.reading import FileSpec
from strapdown.config.spec import (
    AngleWaveSpec,
    Later,
    NotNegative,
    Number,
    Position,
    Positive,
    Several,
    Spec,
    Triple,
    refuse,
)


class HeaveWaveSpec(Spec):
    """One sine component of the height, positive downward."""

    amplitude_m: Number
    period_s: Positive
    phase_deg: Number = 0.0


class WavesSpec(Spec):
    """Sine components of the three angles."""

    roll_waves: tuple[AngleWaveSpec, ...] = ()
    pitch_waves: tuple[AngleWaveSpec, ...] = ()
    heading_waves: tuple[AngleWaveSpec, ...] = ()


class PlaceSpec(Position):
    """Initial position of a motion, whose heights are checked by the motion."""

    alt_m: Number = 0.0


class StationarySpec(PlaceSpec):
    """Stationary."""

    kind: Literal["stationary"]
    duration_s: Positive
    roll_deg: Number = 0.0
    pitch_deg: Number = 0.0
    heading_deg: Number = 0.0


class RockingStandSpec(PlaceSpec, WavesSpec):
    """Rocking about a fixed position."""

    kind: Literal["rocking_stand"]
    duration_s: Positive
    roll_deg: Number = 0.0
    pitch_deg: Number = 0.0
    heading_deg: Number = 0.0


class SineVelocitySpec(PlaceSpec):
    """Mean velocity plus a sine in each of north, east, down."""

    kind: Literal["sine_velocity"]
    duration_s: Positive
    mean_velocity_m_per_s: Triple
    amplitude_m_per_s: Triple = (0.0, 0.0, 0.0)
    period_s: Positive = 60.0
    phase_deg: Triple = (0.0, 90.0, 0.0)


class WalkingSpec(PlaceSpec):
    """A foot-mounted unit, walking around blocks."""

    kind: Literal["walking"]
    gait: Literal["walk", "run", "shuffle"] = "walk"
    strides: StrictInt = Field(ge=1, le=100_000)
    #: Number of strides between turns; zero for none.
    corner_each: StrictInt = Field(default=10, ge=0)
    corner_deg: Number = 90.0
    #: Strides that climb two stairs each, counted from zero.
    stairs: tuple[Annotated[StrictInt, Field(ge=0)], ...] = ()
    stair_m: Number = 0.17
    heading_deg: Number = 0.0
    #: At the beginning and at the end.
    stand_s: Positive = 5.0
    roll_deg: Number = 0.0
    pitch_deg: Number = 0.0


class SpeedSpec(Spec):
    """Change to another speed."""

    do: Literal["accelerate", "brake"]
    to_m_per_s: NotNegative
    duration_s: Positive


class StopSpec(Spec):
    """Brake to a stop, and remain stationary."""

    do: Literal["stop"]
    braking_s: Positive
    stay_s: NotNegative = 0.0


class StraightSpec(Spec):
    """Continue straight, for a time or a distance."""

    do: Literal["straight"]
    duration_s: Positive | None = None
    distance_m: Positive | None = None

    @model_validator(mode="after")
    def _one(self) -> StraightSpec:
        if (self.duration_s is None) == (self.distance_m is None):
            raise refuse("duration_s, distance_m", "config.duration-or-distance")
        return self


class TurnSpec(Spec):
    """Turn with a radius."""

    do: Literal["turn_left", "turn_right"]
    angle_deg: Positive = 90.0
    radius_m: Positive
    ramp_s: Positive | None = None


class BankedTurnSpec(Spec):
    """Turn with a bank angle."""

    do: Literal["turn_left", "turn_right"]
    angle_deg: Positive = 90.0
    bank_deg: Positive
    ramp_s: Positive | None = None


class LaneChangeSpec(Spec):
    """Change to the neighboring lane."""

    do: Literal["lane_change"]
    offset_m: Number
    duration_s: Positive


class ClimbSpec(Spec):
    """Climb or descend, to or by a height."""

    do: Literal["climb", "descend"]
    angle_deg: Positive
    height_m: Positive | None = None
    ramp_s: Positive | None = None


class LevelSpec(Spec):
    """Level off after a climb."""

    do: Literal["level"]
    ramp_s: Positive | None = None


_BY_DO = Field(discriminator="do")
CarStep = SpeedSpec | StopSpec | StraightSpec | TurnSpec | LaneChangeSpec
AircraftStep = SpeedSpec | StopSpec | StraightSpec | BankedTurnSpec | ClimbSpec | LevelSpec
ShipStep = SpeedSpec | StopSpec | StraightSpec | TurnSpec
#: Any of the maneuvers.
Step = CarStep | AircraftStep


class SteeredSpec(PlaceSpec):
    """Common part of all vehicles."""

    heading_deg: Number = 0.0
    speed_m_per_s: NotNegative = 0.0
    most_acceleration_m_per_s2: Positive | None = None
    most_lateral_m_per_s2: Positive | None = None


class CarSpec(SteeredSpec):
    """A car."""

    kind: Literal["car"]
    roll_deg_per_m_per_s2: Number = 0.0
    pitch_deg_per_m_per_s2: Number = 0.0
    manoeuvres: tuple[Annotated[CarStep, _BY_DO], ...]


class AircraftSpec(SteeredSpec):
    """An aircraft."""

    kind: Literal["aircraft"]
    angle_of_attack_deg: Number = 0.0
    most_bank_deg: Positive | None = None
    manoeuvres: tuple[Annotated[AircraftStep, _BY_DO], ...]


class ShipSpec(SteeredSpec, WavesSpec):
    """A ship."""

    kind: Literal["ship"]
    heave_waves: tuple[HeaveWaveSpec, ...] = ()
    manoeuvres: tuple[Annotated[ShipStep, _BY_DO], ...]


class WaypointSpec(PlaceSpec):
    """Waypoint, with its time or the speed of the leg that leads to it."""

    time_s: NotNegative | None = None
    speed_m_per_s: Positive | None = None


class WaypointsSpec(Spec):
    """A path through waypoints."""

    kind: Literal["waypoints"]
    speed_m_per_s: Positive | None = None
    most_acceleration_m_per_s2: Positive = 30.0
    waypoints: tuple[WaypointSpec, ...] = Field(min_length=2)

    @model_validator(mode="after")
    def _timed(self) -> WaypointsSpec:
        timed = [w.time_s is not None for w in self.waypoints]
        paced = [w.speed_m_per_s is not None for w in self.waypoints]
        if any(timed) and (self.speed_m_per_s is not None or any(paced) or not all(timed)):
            raise refuse("waypoints", "config.waypoints-partly-timed")
        if not any(timed) and self.speed_m_per_s is None and not all(paced[1:]):
            raise refuse(
                "waypoints", "config.waypoint-without-time", index=paced.index(False, 1) + 1
            )
        return self


class PulseSpec(Spec):
    """One pulse of rate about an axis, or several at a period."""

    start_s: NotNegative
    duration_s: Positive
    #: Between the edges.
    rate_deg_per_s: Number | None = None
    #: Instead of the rate: of the whole pulse.
    turn_deg: Number | None = None
    #: Of a raised cosine at either end: zero for a rectangle, half of the duration for a haversine.
    edge_s: NotNegative = 0.0
    times: StrictInt = Field(default=1, ge=1, le=100_000)
    every_s: Positive | None = None

    @model_validator(mode="after")
    def _one(self) -> PulseSpec:
        if (self.rate_deg_per_s is None) == (self.turn_deg is None):
            raise refuse("rate_deg_per_s, turn_deg", "config.rate-or-turn")
        if (self.times > 1) != (self.every_s is not None):
            raise refuse("times, every_s", "config.times-and-period")
        return self


class PulsesSpec(Spec):
    """Pulses of rate about the body's axes, overlapping or not."""

    kind: Literal["pulses"]
    duration_s: Positive
    roll_deg: Number = 0.0
    pitch_deg: Number = 0.0
    heading_deg: Number = 0.0
    x: tuple[PulseSpec, ...] = ()
    y: tuple[PulseSpec, ...] = ()
    z: tuple[PulseSpec, ...] = ()
    #: From the point about which the body turns to the sensor.
    arm_m: Triple = (0.0, 0.0, 0.0)


MotionSpec = Annotated[
    StationarySpec
    | RockingStandSpec
    | SineVelocitySpec
    | WalkingSpec
    | CarSpec
    | AircraftSpec
    | ShipSpec
    | WaypointsSpec,
    Field(discriminator="kind"),
]

#: Motion of a scenario.
ScenarioMotion = Annotated[PulsesSpec | MotionSpec, Field(discriminator="kind")]

#: Values of `kind` of a motion.
KINDS = tuple(
    get_args(form.model_fields["kind"].annotation)[0] for form in get_args(get_args(MotionSpec)[0])
)


FixesForm = Literal["csv", "none"]
FIXES_FORMS: tuple[str, ...] = get_args(FixesForm)


class TrajectorySpec(FileSpec):
    """One run of the simulator over a motion on the Earth."""

    called = "trajectory"

    name: str = "trajectory"
    title: str = ""
    ellipsoid: str = "wgs84"
    rate_hz: Positive = 100.0
    sampling: str = "instantaneous"
    seed: StrictInt = Field(default=0, ge=0)
    sensor: str | None = None
    formats: Annotated[tuple[str, ...], Several] = Field(default=("csv",), min_length=1)
    trajectory_formats: Annotated[tuple[str, ...], Several] = ()
    #: Form of the receiver's fixes; none leaves them out.
    fixes: FixesForm = "csv"
    motion: MotionSpec
    #: Receiver whose fixes are written; 5 Hz, white noise of 1 m and 0.1 m/s.
    gnss: Annotated[Any, BeforeValidator(Later("strapdown.config.navigation", "ReceiverTable"))] = (
        Field(
            default={"rate_hz": 5.0, "velocity_noise_m_per_s": 0.1},
            validate_default=True,
            description="the receiver along it",
        )
    )
