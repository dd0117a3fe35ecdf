"""Configuration of the predicted drift in a GNSS outage: every key with its unit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, StrictInt, model_validator

from strapdown.config.choice import ChoiceSpec, Kinds
from strapdown.config.spec import FileName, NotNegative, Number, Positive, Spec, refuse

#: Longest outage, s: predictions beyond a day are not meaningful.
LONGEST = 86_400.0
#: Measurements that can remain along a stated motion: each is evaluated at the true state.
KEPT = ("no_slip", "odometer", "zero_velocity", "zero_rate")


class OutageStartTable(Spec):
    """State at the start of the outage: after a drive with fixes, or as stated."""

    #: Length of the preceding drive with fixes; 0 starts from the end of an alignment.
    aided_s: Annotated[Number, Field(ge=0.0, le=36_000.0)] = 600.0
    #: Of the fixes, one per second.
    fix_position_sd_m: Positive = 1.5
    fix_velocity_sd_m_per_s: Positive = 0.05
    #: Replaces the result of the drive, on each axis, without correlation with other states.
    position_sd_m: NotNegative | None = None
    velocity_sd_m_per_s: NotNegative | None = None
    #: Of roll and pitch.
    tilt_sd_deg: NotNegative | None = None
    heading_sd_deg: NotNegative | None = None
    gyro_bias_sd_deg_per_h: NotNegative | None = None
    accel_bias_sd_ug: NotNegative | None = None


class OutageMotionTable(Spec):
    """Level motion during the outage, and its position."""

    #: Stationary if zero.
    speed_m_per_s: NotNegative = 0.0
    #: Final speed, reached over the outage with minimum jerk.
    to_speed_m_per_s: NotNegative | None = None
    #: Positive to the right.
    turn_rate_deg_per_s: Number = 0.0
    heading_deg: Number = 45.0
    lat_deg: Annotated[Number, Field(ge=-85.0, le=85.0)] = 45.0


class OutageSpec(Spec):
    """Predicted outage drift of a sensor along a stated motion, or of a navigation run."""

    outage_s: Annotated[Number, Field(gt=0.0, le=LONGEST)]
    #: Catalogue name or file; omitted if a navigation run states it.
    sensor: FileName | None = None
    start: OutageStartTable = OutageStartTable()
    motion: OutageMotionTable = OutageMotionTable()
    #: Measurements that remain available, by kind.
    aiding: dict[str, Annotated[ChoiceSpec, BeforeValidator(Kinds("aiding"))]] = Field(
        default_factory=dict
    )
    #: For a navigation run: start of the outage; by default at evenly spaced instants.
    at_s: Number | None = None
    #: Alternatively the part of the log that contains them; by default the whole log.
    from_s: Number | None = None
    to_s: Number | None = None
    duration_s: Positive | None = None
    places: StrictInt = Field(default=10, ge=1, le=100)

    @model_validator(mode="before")
    @classmethod
    def _kept(cls, data: Any) -> Any:
        """Name each measurement by its kind; None leaves a default."""
        given = {key: value for key, value in dict(data).items() if value is not None}
        aiding: Mapping[str, Any] = given.get("aiding", {})
        for kind in aiding:
            if kind not in KEPT:
                raise refuse("aiding", "config.aid-not-kept", kind=kind, kept=KEPT)
        return {**given, "aiding": {kind: {"kind": kind, **one} for kind, one in aiding.items()}}


class SensorsSpec(Spec):
    """Sensors that are compared: their noise, and their drift in an outage straight on."""

    #: Catalogue names or files.
    sensor: Annotated[tuple[FileName, ...], Field(min_length=1, max_length=9)]
    outage_s: Annotated[Number, Field(gt=0.0, le=LONGEST)] = 60.0
    speed_m_per_s: NotNegative = 15.0
