"""Configuration of a crash case: every key with its unit."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, BeforeValidator, Field, StrictBool, StrictInt

from strapdown.config.spec import TableSpec, file_name, refuse, word, words
from strapdown.config.toml_file import shown

# A number in quotation marks, or true for 1, is rejected.
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0.0)]
NotNegative = Annotated[Number, Field(ge=0.0)]
Pair = tuple[Number, Number]
Triple = tuple[Number, Number, Number]
#: One line of text, suitable for titles, tables and file names.
Words = Annotated[str, AfterValidator(words)]
Word = Annotated[str, AfterValidator(word)]
FileName = Annotated[str, AfterValidator(file_name)]


def _listed(value: Any) -> Any:
    return [value] if isinstance(value, str) else value


def _text(value: Any) -> Any:
    # Channels of some records are numbered.
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


def _one_or_three(value: Any) -> Any:
    several = value if isinstance(value, list | tuple) and len(value) == 3 else [value]
    if not all(_is_number(part) for part in several):
        raise refuse("", "config.not-one-or-three-numbers", given=shown(value))
    return tuple(float(v) for v in several) if len(several) == 3 else float(several[0])


def _sizes(value: float | Triple) -> float | Triple:
    if min(value if isinstance(value, tuple) else (value,)) < 0.0:
        raise refuse("", "config.negative-size", given=shown(value))
    return value


def _number_or_words(value: Any) -> Any:
    if isinstance(value, str):
        return words(value)
    if not _is_number(value):
        raise refuse("", "config.not-number-or-text", given=shown(value))
    return float(value)


def _is_number(value: Any) -> bool:
    try:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        return number and math.isfinite(float(value))
    except OverflowError:
        return False


#: Of an injury-risk model.
Input = Annotated[float | str, BeforeValidator(_number_or_words)]
OneOrThree = Annotated[float | Triple, BeforeValidator(_one_or_three)]
Listed = BeforeValidator(_listed)
Channel = Annotated[Word, BeforeValidator(_text)]


class VehicleSpec(TableSpec):
    """The vehicle, as a report draws and describes it.

    Its front is `front_m` ahead of the origin of all positions; by default the origin is in the
    middle. `outline_m` replaces length, width and front: corners seen from above, forward and
    right, in order around it.
    """

    name: Words = ""
    mass_kg: Positive | None = None
    length_m: Positive = 4.5
    width_m: Positive = 1.8
    front_m: Number | None = None
    outline_m: tuple[Pair, ...] = ()


class PointSpec(TableSpec):
    """The point whose motion is reconstructed."""

    name: Words = "reference point"
    position_m: Triple = (0.0, 0.0, 0.0)


class EntrySpec(TableSpec):
    """Motion of the vehicle at one instant, and its uncertainty."""

    kind: Literal["speed", "standstill", "gnss"] = "speed"
    source: str = ""
    speed_m_per_s: Number | None = None
    speed_sd_m_per_s: NotNegative | None = None
    time_s: Number = 0.0
    heading_deg: Number = 0.0
    heading_sd_deg: NotNegative = 0.0
    slip_deg: Number = 0.0
    slip_sd_deg: NotNegative = 0.0
    climb_sd_m_per_s: NotNegative = 0.0
    path: FileName | None = None
    antenna_m: Triple | None = None
    antenna_sd_m: NotNegative = 0.0


class TriadSpec(TableSpec):
    """One triad of sensors: its channels and their uncertainty.

    A channel is the name of a column or channel of the record, with a minus sign if it points
    the other way; an omitted axis is missing.
    """

    name: Words = ""
    path: FileName
    channels: dict[Literal["x", "y", "z"], Channel] = Field(default_factory=dict)
    time: Channel | None = None
    time_unit: Word | None = None
    rate_hz: Positive | None = None
    unit: Word | None = None
    sampling: Literal["instantaneous", "mean"] | None = None
    sensor: FileName | None = None
    #: Replaces the sensor's: keys of the sensor catalogue, each with its unit.
    uncertainty: dict[Word, OneOrThree] = Field(default_factory=dict)


class AssumedSpec(TableSpec):
    """Assumed values for missing axes and gyros, with standard deviations."""

    turn_sd_deg: Annotated[OneOrThree, AfterValidator(_sizes)] | None = None
    delta_v_sd_m_per_s: Annotated[OneOrThree, AfterValidator(_sizes)] | None = None
    over_s: Pair = (0.0, 0.15)
    because: str = ""


class UnitSpec(TableSpec):
    """A recorder on the vehicle."""

    name: Word
    position_m: Triple = (0.0, 0.0, 0.0)
    position_sd_m: NotNegative = 0.0
    angles_deg: Triple = (0.0, 0.0, 0.0)
    angles_sd_deg: NotNegative = 0.0
    trigger_s: Number | None = None
    trigger_sd_s: NotNegative = 0.0
    accelerometers: tuple[TriadSpec, ...] = Field(min_length=1)
    gyro: TriadSpec | None = None
    gyro_from: Word | None = None
    assumed: AssumedSpec | None = None
    rest_s: Pair | None = None
    levelling_deg: Pair | None = None
    levelling_sd_deg: NotNegative | None = None


class ReferenceSpec(TableSpec):
    """Other known data of the crash, for comparison with the results."""

    kind: Literal["path", "delta_v"]
    name: Word
    source: str = ""
    #: Of a path: time, north, east, down of the reference point, with or without sd.
    path: FileName | None = None
    #: Of a change of velocity: along the axis, over the span; by default over the event.
    delta_v_m_per_s: Number | None = None
    delta_v_sd_m_per_s: NotNegative = 0.0
    axis: Literal["forward", "right", "resultant"] = "forward"
    over_s: Pair | None = None


class OptionsSpec(TableSpec):
    """Options of the computation."""

    window_s: Pair | None = None
    rate_hz: Positive = 200.0
    sampling: Literal["instantaneous", "mean"] = "instantaneous"
    clock: Literal["trigger", "correlation"] = "trigger"
    combine: StrictBool = True
    peak_window_s: Positive = 0.030
    gravity_m_per_s2: Positive = 9.80665
    zero_at: Literal["interval", "threshold"] = "interval"
    monte_carlo_runs: StrictInt = Field(default=2000, ge=0, le=100_000)
    seed: StrictInt = Field(default=0, ge=0)
    #: Names of severity models; None selects those that apply to the crash type.
    severity: Annotated[tuple[Word, ...] | None, Listed] = None
    severity_inputs: dict[Word, Input] = Field(default_factory=dict)
    formats: Annotated[tuple[Literal["csv", "mme"], ...], Listed] = ("csv",)


class CaseSpec(TableSpec):
    """One crash case."""

    unwritten: ClassVar[tuple[str, ...]] = ("name",)

    name: str = "case"
    title: Word
    number: Words = ""
    author: Words = ""
    description: str = ""
    vehicle: VehicleSpec = VehicleSpec()
    point: PointSpec = PointSpec()
    entry: EntrySpec
    units: tuple[UnitSpec, ...] = Field(min_length=1)
    references: tuple[ReferenceSpec, ...] = ()
    options: OptionsSpec = OptionsSpec()
