"""Motions on the Earth, as a person writes them: every key with its unit."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, FiniteFloat, model_validator

from strapdown.config.spec import TableSpec, refuse

__all__ = ["KINDS", "MANOEUVRES", "MotionSpec"]

Positive = Annotated[FiniteFloat, Field(gt=0.0)]
NotNegative = Annotated[FiniteFloat, Field(ge=0.0)]
Triple = tuple[FiniteFloat, FiniteFloat, FiniteFloat]


class PlaceSpec(TableSpec):
    """Where a motion begins; the range of the angles is looked at where the place is made."""

    lat_deg: FiniteFloat
    lon_deg: FiniteFloat
    alt_m: FiniteFloat = 0.0


class AngleWaveSpec(TableSpec):
    """One sine of an angle."""

    amplitude_deg: FiniteFloat
    period_s: Positive
    phase_deg: FiniteFloat = 0.0


class HeaveWaveSpec(TableSpec):
    """One sine of the height, downward."""

    amplitude_m: FiniteFloat
    period_s: Positive
    phase_deg: FiniteFloat = 0.0


class WavesSpec(TableSpec):
    """Sines of the three angles."""

    roll_waves: tuple[AngleWaveSpec, ...] = ()
    pitch_waves: tuple[AngleWaveSpec, ...] = ()
    heading_waves: tuple[AngleWaveSpec, ...] = ()


class StationarySpec(PlaceSpec):
    """Rest."""

    kind: Literal["stationary"]
    duration_s: Positive
    roll_deg: FiniteFloat = 0.0
    pitch_deg: FiniteFloat = 0.0
    heading_deg: FiniteFloat = 0.0


class RockingStandSpec(PlaceSpec, WavesSpec):
    """Rocking about a fixed place."""

    kind: Literal["rocking_stand"]
    duration_s: Positive
    roll_deg: FiniteFloat = 0.0
    pitch_deg: FiniteFloat = 0.0
    heading_deg: FiniteFloat = 0.0


class SineVelocitySpec(PlaceSpec):
    """A velocity of a mean and a sine in each of north, east, down."""

    kind: Literal["sine_velocity"]
    duration_s: Positive
    mean_velocity_m_per_s: Triple
    amplitude_m_per_s: Triple = (0.0, 0.0, 0.0)
    period_s: Positive = 60.0
    phase_deg: Triple = (0.0, 90.0, 0.0)


class WalkingSpec(PlaceSpec):
    """A unit on a shoe, around blocks."""

    kind: Literal["walking"]
    gait: Literal["walk", "run", "shuffle"] = "walk"
    strides: int = Field(ge=1, le=100_000, strict=True)
    #: After so many strides it turns; never, if zero.
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
    """Another speed."""

    do: Literal["accelerate", "brake"]
    to_m_per_s: NotNegative
    duration_s: Positive


class StopSpec(TableSpec):
    """Brake to a stop, and stay."""

    do: Literal["stop"]
    braking_s: Positive
    stay_s: NotNegative = 0.0


class StraightSpec(TableSpec):
    """Go on, for a time or a distance."""

    do: Literal["straight"]
    duration_s: Positive | None = None
    distance_m: Positive | None = None

    @model_validator(mode="after")
    def _one(self) -> StraightSpec:
        if (self.duration_s is None) == (self.distance_m is None):
            raise refuse("duration_s, distance_m", "config.duration-or-distance")
        return self


class TurnSpec(TableSpec):
    """A turn on a radius."""

    do: Literal["turn_left", "turn_right"]
    angle_deg: Positive = 90.0
    radius_m: Positive
    ramp_s: Positive | None = None


class BankedTurnSpec(TableSpec):
    """A turn at a bank."""

    do: Literal["turn_left", "turn_right"]
    angle_deg: Positive = 90.0
    bank_deg: Positive
    ramp_s: Positive | None = None


class LaneChangeSpec(TableSpec):
    """Over to the lane beside."""

    do: Literal["lane_change"]
    offset_m: FiniteFloat
    duration_s: Positive


class ClimbSpec(TableSpec):
    """Up or down, on or by a height."""

    do: Literal["climb", "descend"]
    angle_deg: Positive
    height_m: Positive | None = None
    ramp_s: Positive | None = None


class LevelSpec(TableSpec):
    """Out of a climb."""

    do: Literal["level"]
    ramp_s: Positive | None = None


#: Any of the manoeuvres.
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
    """What all vehicles begin with."""

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
    """A place on the way, with its time or the speed of the leg that leads to it."""

    time_s: NotNegative | None = None
    speed_m_per_s: Positive | None = None


class WaypointsSpec(TableSpec):
    """A path through places."""

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

#: What `kind` of a motion may be.
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
#: What `do` of a manoeuvre may be, for one vehicle or another.
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
