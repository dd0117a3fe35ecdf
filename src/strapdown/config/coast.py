"""A forecast of coasting, as a person asks for it: every key with its unit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import Field, StrictInt, ValidationError, create_model

from strapdown.config.choice import SLOTS, ChoiceSpec, choice_form
from strapdown.config.crash_case import FileName, NotNegative, Number, Positive
from strapdown.config.spec import TableSpec, misfit
from strapdown.errors import ConfigError

__all__ = ["CoastMotionTable", "CoastSpec", "CoastStartTable", "coast_spec"]

#: Longest outage that is asked for, s: beyond a day nothing is coasting any more.
LONGEST = 86_400.0


class CoastStartTable(TableSpec):
    """What is known when the aids go away: what a drive with fixes leaves, or what is stated."""

    #: Length of the drive with fixes before it; 0 leaves what an alignment ends with.
    aided_s: float = Field(default=600.0, ge=0.0, le=36_000.0, strict=True)
    #: Of the fixes, one a second.
    fix_position_sd_m: Positive = 1.5
    fix_velocity_sd_m_per_s: Positive = 0.05
    #: In place of what the drive leaves, each axis, and then bound to nothing else.
    position_sd_m: NotNegative | None = None
    velocity_sd_m_per_s: NotNegative | None = None
    #: Of roll and pitch.
    tilt_sd_deg: NotNegative | None = None
    heading_sd_deg: NotNegative | None = None
    gyro_bias_sd_deg_per_h: NotNegative | None = None
    accel_bias_sd_ug: NotNegative | None = None


class CoastMotionTable(TableSpec):
    """How it moves while it coasts, level, and where."""

    #: It stands, if zero.
    speed_m_per_s: NotNegative = 0.0
    #: To which it comes over the outage, with least jerk.
    to_speed_m_per_s: NotNegative | None = None
    #: Positive to the right.
    turn_rate_deg_per_s: Number = 0.0
    heading_deg: Number = 45.0
    lat_deg: float = Field(default=45.0, ge=-85.0, le=85.0, strict=True)


class CoastSpec(TableSpec):
    """One forecast of coasting: of a sensor along a stated motion, or of a run of navigation."""

    outage_s: float = Field(gt=0.0, le=LONGEST, strict=True)
    #: Of the catalogue, or a file; none where a run of navigation says it.
    sensor: FileName | None = None
    start: CoastStartTable = CoastStartTable()
    motion: CoastMotionTable = CoastMotionTable()
    #: Aids that stay, by their kinds.
    aiding: TableSpec = TableSpec()
    #: Of a run of navigation: where the outage begins; even places, if not given.
    at_s: Number | None = None
    #: In its place the part of the log that they lie in; all of it, if not given.
    from_s: Number | None = None
    to_s: Number | None = None
    duration_s: Positive | None = None
    places: StrictInt = Field(default=10, ge=1, le=100)


#: Aids that can be kept along a stated motion: each tells what it would at the truth.
KEPT = ("no_slip", "odometer", "zero_velocity", "zero_rate")


def coast_spec(table: Mapping[str, Any]) -> CoastSpec:
    """Make a specification of plain data, as a command or a sealed folder has it.

    Parameters
    ----------
    table : mapping

    Returns
    -------
    CoastSpec

    Raises
    ------
    ConfigError
        An aid cannot be kept, or a value does not fit; the quantity names table and key.
    """
    aiding = table.get("aiding") or {}
    forms: dict[str, Any] = {}
    for kind, given in aiding.items():
        if kind not in KEPT:
            raise ConfigError("config.aid-not-kept", quantity="aiding", kind=kind, kept=KEPT)
        form = choice_form(SLOTS["aiding"], {"kind": kind, **given}, ChoiceSpec, path=(kind,))
        forms[kind] = (form, ...)
    kept = create_model("Kept", __base__=TableSpec, **forms)
    whole = create_model("Coast", __base__=CoastSpec, aiding=(kept, ... if forms else kept()))
    try:
        return whole.model_validate({k: v for k, v in table.items() if v is not None})
    except ValidationError as error:
        raise _refused(error.errors()[0]) from None


def _refused(error: Any) -> ConfigError:
    """Return what pydantic finds, at the table and key."""
    place = [str(part) for part in error["loc"]]
    if error["type"] == "refused":
        place += [error["ctx"]["key"]]
    return ConfigError(misfit(error), quantity=", ".join(place))
