"""Configuration of the predicted drift in a GNSS outage: every key with its unit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import Field, StrictInt, ValidationError, create_model

from strapdown.config.choice import SLOTS, ChoiceSpec, choice_form
from strapdown.config.crash_case import FileName, NotNegative, Number, Positive
from strapdown.config.spec import TableSpec, misfit
from strapdown.errors import ConfigError

__all__ = ["CoastMotionTable", "CoastSpec", "CoastStartTable", "coast_spec"]

#: Longest outage, s: predictions beyond a day are not meaningful.
LONGEST = 86_400.0


class CoastStartTable(TableSpec):
    """State at the start of the outage: after a drive with fixes, or as stated."""

    #: Length of the preceding drive with fixes; 0 starts from the end of an alignment.
    aided_s: float = Field(default=600.0, ge=0.0, le=36_000.0, strict=True)
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


class CoastMotionTable(TableSpec):
    """Level motion during the outage, and its position."""

    #: Stationary if zero.
    speed_m_per_s: NotNegative = 0.0
    #: Final speed, reached over the outage with minimum jerk.
    to_speed_m_per_s: NotNegative | None = None
    #: Positive to the right.
    turn_rate_deg_per_s: Number = 0.0
    heading_deg: Number = 45.0
    lat_deg: float = Field(default=45.0, ge=-85.0, le=85.0, strict=True)


class CoastSpec(TableSpec):
    """Predicted outage drift of a sensor along a stated motion, or of a navigation run."""

    outage_s: float = Field(gt=0.0, le=LONGEST, strict=True)
    #: Catalogue name or file; omitted if a navigation run states it.
    sensor: FileName | None = None
    start: CoastStartTable = CoastStartTable()
    motion: CoastMotionTable = CoastMotionTable()
    #: Measurements that remain available, by kind.
    aiding: TableSpec = TableSpec()
    #: For a navigation run: start of the outage; by default at evenly spaced instants.
    at_s: Number | None = None
    #: Alternatively the part of the log that contains them; by default all of it.
    from_s: Number | None = None
    to_s: Number | None = None
    duration_s: Positive | None = None
    places: StrictInt = Field(default=10, ge=1, le=100)


#: Measurements that can remain along a stated motion: each is evaluated at the true state.
KEPT = ("no_slip", "odometer", "zero_velocity", "zero_rate")


def coast_spec(table: Mapping[str, Any]) -> CoastSpec:
    """Create a specification from plain data, as from a command or a sealed folder.

    Parameters
    ----------
    table : mapping

    Returns
    -------
    CoastSpec

    Raises
    ------
    ConfigError
        A measurement cannot remain, or a value does not fit; the quantity names table and key.
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
    """Return a pydantic error as an error at the table and key."""
    place = [str(part) for part in error["loc"]]
    if error["type"] == "refused":
        place += [error["ctx"]["key"]]
    return ConfigError(misfit(error), quantity=", ".join(place))
