"""Configuration of motions on the Earth: every key with its unit."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat, model_validator

from strapdown.config.spec import TableSpec, refuse

__all__ = ["KINDS", "MANOEUVRES", "MotionSpec"]

Positive = Annotated[FiniteFloat, Field(gt=0.0)]
NotNegative = Annotated[FiniteFloat, Field(ge=0.0)]
Triple = tuple[FiniteFloat, FiniteFloat, FiniteFloat]


class PlaceSpec(TableSpec):
    """Initial position of a motion; the range of the angles is checked on use."""

    lat_deg: FiniteFloat
    lon_deg: FiniteFloat
    alt_m: FiniteFloat = 0.0


class AngleWaveSpec(TableSpec):
    """One sine component of an angle."""

    amplitude_deg: FiniteFloat
    period_s: Positive
    phase_deg: FiniteFloat = 0.0


class HeaveWaveSpec(TableSpec):
    """One sine component of the height, positive downward."""

    amplitude_m: FiniteFloat
    period_s: Positive
    phase_deg: FiniteFloat = 0.0


class WavesSpec(TableSpec):
    """Sine components of the three angles."""

    roll_waves: tuple[AngleWaveSpec, ...] = ()
    pitch_waves: tuple[AngleWaveSpec, ...] = ()
    heading_waves: tuple[AngleWaveSpec, ...] = ()


class StationarySpec(PlaceSpec):
    """Stationary."""

    kind: Literal["stationary"]
    duration_s: Positive
    roll_deg: FiniteFloat = 0.0
    pitch_deg: FiniteFloat = 0.0
    heading_deg: FiniteFloat = 0.0


class RockingStandSpec(PlaceSpec, WavesSpec):
    """Rocking about a fixed position."""

    kind: Literal["rocking_stand"]
    duration_s: Positive
    roll_deg: FiniteFloat = 0.0
    pitch_deg: FiniteFloat = 0.0
    heading_deg: FiniteFloat = 0.0


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
    strides: int = Field(ge=1, le=100_000, strict=True)
    #: Number of strides between turns; zero for none.
    corner_each: int = Field(default=10, ge=0, strict=True)
    corner_deg: FiniteFloat = 90.0
    #: Strides that climb two stairs each, counted from zero.
    stairs: tuple[Annotated[int, Field(ge=0, strict=True)], ...] = ()
    stair_m: FiniteFloat = 0.17
    heading_deg: FiniteFloat = 0.0
    #: At the beginning and at the end.
    stand_s: Positive = 5.0
    roll_deg: FiniteFloat = 0.0
    pitch_deg: FiniteFloat = 0.0


class SpeedSpec(TableSpec):
    """Change to another speed."""

    do: Literal["accelerate", "brake"]
    to_m_per_s: NotNegative
    duration_s: Positive


class StopSpec(TableSpec):
    """Brake to a stop, and remain stationary."""

    do: Literal["stop"]
    braking_s: Positive
    stay_s: NotNegative = 0.0


class StraightSpec(TableSpec):
    """Continue straight, for a time or a distance."""

    do: Literal["straight"]
    duration_s: Positive | None = None
    distance_m: Positive | None = None

    @model_validator(mode="after")
    def _one(self) -> StraightSpec:
        if (self.duration_s is None) == (self.distance_m is None):
            raise refuse("duration_s, distance_m", "config.duration-or-distance")
        return self


class TurnSpec(TableSpec):
    """Turn with a radius."""

    do: Literal["turn_left", "turn_right"]
    angle_deg: Positive = 90.0
    radius_m: Positive
    ramp_s: Positive | None = None


class BankedTurnSpec(TableSpec):
    """Turn with a bank angle."""

    do: Literal["turn_left", "turn_right"]
    angle_deg: Positive = 90.0
    bank_deg: Positive
    ramp_s: Positive | None = None


class LaneChangeSpec(TableSpec):
    """Change to the neighboring lane."""

    do: Literal["lane_change"]
    offset_m: FiniteFloat
    duration_s: Positive


class ClimbSpec(TableSpec):
    """Climb or descend, to or by a height."""

    do: Literal["climb", "descend"]
    angle_deg: Positive
    height_m: Positive | None = None
    ramp_s: Positive | None = None


class LevelSpec(TableSpec):
    """Level off after a climb."""

    do: Literal["level"]
    ramp_s: Positive | None = None


#: Any of the maneuvers.
Step = (
    SpeedSpec
    | StopSpec
    | StraightSpec
    | TurnSpec
    | BankedTurnSpec
    | LaneChangeSpec
    | ClimbSpec
    | LevelSpec
)


class VehicleSpec(PlaceSpec):
    """Common part of all vehicles."""

    heading_deg: FiniteFloat = 0.0
    speed_m_per_s: NotNegative = 0.0
    most_acceleration_m_per_s2: Positive | None = None
    most_lateral_m_per_s2: Positive | None = None


class CarSpec(VehicleSpec):
    """A car."""

    kind: Literal["car"]
    roll_deg_per_m_per_s2: FiniteFloat = 0.0
    pitch_deg_per_m_per_s2: FiniteFloat = 0.0
    manoeuvres: tuple[
        Annotated[
            SpeedSpec | StopSpec | StraightSpec | TurnSpec | LaneChangeSpec,
            Field(discriminator="do"),
        ],
        ...,
    ]


class AircraftSpec(VehicleSpec):
    """An aircraft."""

    kind: Literal["aircraft"]
    angle_of_attack_deg: FiniteFloat = 0.0
    most_bank_deg: Positive | None = None
    manoeuvres: tuple[
        Annotated[
            SpeedSpec | StopSpec | StraightSpec | BankedTurnSpec | ClimbSpec | LevelSpec,
            Field(discriminator="do"),
        ],
        ...,
    ]


class ShipSpec(VehicleSpec, WavesSpec):
    """A ship."""

    kind: Literal["ship"]
    heave_waves: tuple[HeaveWaveSpec, ...] = ()
    manoeuvres: tuple[
        Annotated[
            SpeedSpec | StopSpec | StraightSpec | TurnSpec,
            Field(discriminator="do"),
        ],
        ...,
    ]


class WaypointSpec(PlaceSpec):
    """Waypoint, with its time or the speed of the leg that leads to it."""

    time_s: NotNegative | None = None
    speed_m_per_s: Positive | None = None


class WaypointsSpec(TableSpec):
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
                "waypoints",
                "config.waypoint-without-time",
                index=paced.index(False, 1) + 1,
            )
        return self


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

#: Values of `kind` of a motion.
KINDS = (
    "stationary",
    "rocking_stand",
    "sine_velocity",
    "walking",
    "car",
    "aircraft",
    "ship",
    "waypoints",
)
#: Values of `do` of a maneuver, for one vehicle or another.
MANOEUVRES = (
    "accelerate",
    "brake",
    "stop",
    "straight",
    "turn_left",
    "turn_right",
    "lane_change",
    "climb",
    "descend",
    "level",
)
