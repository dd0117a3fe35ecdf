"""A crash case, as a person writes it: every key with its unit."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field, FiniteFloat

from strapdown.config.spec import TableSpec

Positive = Annotated[FiniteFloat, Field(gt=0.0)]
NotNegative = Annotated[FiniteFloat, Field(ge=0.0)]
Pair = tuple[FiniteFloat, FiniteFloat]
Triple = tuple[FiniteFloat, FiniteFloat, FiniteFloat]


class VehicleSpec(TableSpec):
    """The vehicle, as far as a report draws and speaks of it."""

    name: str = ""
    mass_kg: Positive | None = None
    length_m: Positive = 4.5
    width_m: Positive = 1.8
    front_m: FiniteFloat | None = None
    outline_m: tuple[Pair, ...] = ()


class PointSpec(TableSpec):
    """The point whose motion is told."""

    name: str = "reference point"
    position_m: Triple = (0.0, 0.0, 0.0)


class EntrySpec(TableSpec):
    """How the vehicle moved at one instant, and how that is known."""

    kind: Literal["speed", "standstill", "gnss"] = "speed"
    source: str = ""
    speed_m_per_s: FiniteFloat | None = None
    speed_sd_m_per_s: NotNegative | None = None
    time_s: FiniteFloat = 0.0
    heading_deg: FiniteFloat = 0.0
    heading_sd_deg: NotNegative = 0.0
    slip_deg: FiniteFloat = 0.0
    slip_sd_deg: NotNegative = 0.0
    climb_sd_m_per_s: NotNegative = 0.0
    path: str | None = None
    antenna_m: Triple | None = None
    antenna_sd_m: NotNegative = 0.0


class TriadSpec(TableSpec):
    """One triad of sensors: where its channels stand, and what is not known of it.

    A channel is the name of a column or channel of the record, with a minus before it where it
    points the other way; an axis that is left out is missing.
    """

    name: str = ""
    path: str
    channels: dict[Literal["x", "y", "z"], str] = Field(default_factory=dict)
    time: str | None = None
    time_unit: str | None = None
    rate_hz: Positive | None = None
    unit: str | None = None
    sampling: Literal["instantaneous", "mean"] | None = None
    sensor: str | None = None
    #: Replaces the sensor's: keys of the catalogue of sensors, each with its unit.
    uncertainty: dict[str, FiniteFloat | Triple] = Field(default_factory=dict)


class AssumedSpec(TableSpec):
    """What is taken for axes and gyros that are not there, with its standard deviation."""

    turn_sd_deg: NotNegative | None = None
    delta_v_sd_m_per_s: NotNegative | None = None
    over_s: Pair = (0.0, 0.15)
    because: str = ""


class UnitSpec(TableSpec):
    """A recorder on the vehicle."""

    name: str
    position_m: Triple = (0.0, 0.0, 0.0)
    position_sd_m: NotNegative = 0.0
    angles_deg: Triple = (0.0, 0.0, 0.0)
    angles_sd_deg: NotNegative = 0.0
    trigger_s: FiniteFloat | None = None
    trigger_sd_s: NotNegative = 0.0
    accelerometers: tuple[TriadSpec, ...] = Field(min_length=1)
    gyro: TriadSpec | None = None
    gyro_from: str | None = None
    assumed: AssumedSpec | None = None
    rest_s: Pair | None = None
    levelling_deg: Pair | None = None
    levelling_sd_deg: NotNegative | None = None


class ReferenceSpec(TableSpec):
    """Something else that is known of the crash, beside which the answers are held."""

    kind: Literal["path", "delta_v"]
    name: str
    source: str = ""
    #: Of a path: time, north, east, down of the reference point, with or without their sd.
    path: str | None = None
    #: Of a change of velocity: along the axis, over the span; over the event, if not given.
    delta_v_m_per_s: FiniteFloat | None = None
    delta_v_sd_m_per_s: NotNegative = 0.0
    axis: Literal["forward", "right", "resultant"] = "forward"
    over_s: Pair | None = None


class OptionsSpec(TableSpec):
    """How it is computed."""

    window_s: Pair | None = None
    rate_hz: Positive = 200.0
    sampling: Literal["instantaneous", "mean"] = "instantaneous"
    clock: Literal["trigger", "correlation"] = "trigger"
    combine: bool = True
    peak_window_s: Positive = 0.030
    gravity_m_per_s2: Positive = 9.80665
    zero_at: Literal["interval", "threshold"] = "interval"
    monte_carlo_runs: int = Field(default=2000, ge=0, le=100_000)
    seed: int = Field(default=0, ge=0)
    #: Names of severity models; None takes those that fit the type of the crash.
    severity: tuple[str, ...] | None = None
    severity_inputs: dict[str, FiniteFloat | str] = Field(default_factory=dict)
    formats: tuple[Literal["csv", "mme"], ...] = ("csv",)


class CaseSpec(TableSpec):
    """One crash case."""

    unwritten: ClassVar[tuple[str, ...]] = ("name",)

    name: str = "case"
    title: str
    number: str = ""
    author: str = ""
    description: str = ""
    vehicle: VehicleSpec = VehicleSpec()
    point: PointSpec = PointSpec()
    entry: EntrySpec
    units: tuple[UnitSpec, ...] = Field(min_length=1)
    references: tuple[ReferenceSpec, ...] = ()
    options: OptionsSpec = OptionsSpec()
