"""The recorders of a case: told apart, placed, each with a gyro or what is assumed for it."""

from __future__ import annotations

from collections.abc import Sequence

from strapdown.config.crash_case import CaseSpec, UnitSpec
from strapdown.config.crash_checks.assumed import check_assumed
from strapdown.config.crash_checks.written import Written

__all__ = ["check_names", "check_units"]

MOST_ANGLE = 360.0  # deg
STEEPEST = 90.0  # deg
#: A common trigger that is known no better ties no clocks together.
MOST_TRIGGER_SD = 0.5  # s


def check_units(spec: CaseSpec, written: Written) -> None:
    """Check the units, but for their triads.

    Raises
    ------
    ConfigError
        One lacks its place, or says two things at once, or borrows a gyro that is not there.
    """
    check_names("units", [unit.name for unit in spec.units], written)
    _triggered(spec, written)
    for k, unit in enumerate(spec.units):
        _placed(k, unit, written)
        _gyro(k, spec, written)
        _levelled(k, unit, written)
        _rest(k, spec, written)
        if spec.options.clock == "trigger" and unit.trigger_sd_s > MOST_TRIGGER_SD:
            raise written.refuse(
                ("units", k, "trigger_sd_s"),
                "config.trigger-sd-too-large",
                trigger_sd_s=unit.trigger_sd_s,
            )
        check_assumed(k, spec, written)


def check_names(several: str, names: Sequence[str], written: Written) -> None:
    """Refuse two of one name.

    Parameters
    ----------
    several : str
        Key of the tables.
    names : sequence of str
    written : Written
    """
    seen: dict[str, int] = {}
    for k, name in enumerate(names):
        same = " ".join(name.split()).casefold()
        if same in seen:
            raise written.contradiction(
                (several, k, "name"),
                (several, seen[same], "name"),
                "config.name-repeated",
            )
        seen[same] = k


def _triggered(spec: CaseSpec, written: Written) -> None:
    without = [k for k, unit in enumerate(spec.units) if unit.trigger_s is None]
    if without and spec.options.clock == "trigger":
        raise written.missing(("units", without[0], "trigger_s"), "config.trigger-missing")
    if len(without) == len(spec.units):
        raise written.missing(("units", 0, "trigger_s"), "config.no-unit-with-trigger")


def _placed(k: int, unit: UnitSpec, written: Written) -> None:
    for name, code in (
        ("position_m", "config.unit-position-missing"),
        ("position_sd_m", "config.unit-position-sd-missing"),
    ):
        if not written.has("units", k, name):
            raise written.missing(("units", k, name), code)
    if any(abs(angle) > MOST_ANGLE for angle in unit.angles_deg):
        raise written.refuse(("units", k, "angles_deg"), "config.angles-beyond-turn")
    if unit.angles_sd_deg > STEEPEST:
        raise written.refuse(("units", k, "angles_sd_deg"), "config.mounting-sd-too-large")


def _gyro(k: int, spec: CaseSpec, written: Written) -> None:
    unit, at = spec.units[k], ("units", k, "gyro_from")
    lender = unit.gyro_from
    if lender is None:
        return
    if unit.gyro is not None:
        raise written.contradiction(at, ("units", k, "gyro"), "config.gyro-and-lender")
    if lender == unit.name:
        raise written.contradiction(at, ("units", k, "name"), "config.lender-is-borrower")
    lenders = [n for n, other in enumerate(spec.units) if other.name == lender]
    with_gyro = [other.name for other in spec.units if other.gyro is not None]
    if not lenders:
        code = "config.unknown-unit-with-gyro" if with_gyro else "config.unknown-unit-no-gyro"
        raise written.refuse(at, code, word=lender, known=with_gyro)
    if spec.units[lenders[0]].gyro is None:
        code = "config.lender-without-gyro" if with_gyro else "config.no-unit-with-gyro"
        raise written.contradiction(
            at, ("units", lenders[0], "name"), code, word=lender, known=with_gyro
        )


def _levelled(k: int, unit: UnitSpec, written: Written) -> None:
    level, sd = ("units", k, "levelling_deg"), ("units", k, "levelling_sd_deg")
    if unit.levelling_deg is not None and unit.levelling_sd_deg is None:
        raise written.missing(sd, "config.levelling-sd-missing", said=written.said(*level))
    if unit.levelling_deg is None and unit.levelling_sd_deg is not None:
        raise written.missing(level, "config.levelling-missing", said=written.said(*sd))
    if unit.levelling_deg is not None and max(abs(a) for a in unit.levelling_deg) > STEEPEST:
        raise written.refuse(level, "config.levelling-too-steep")
    if unit.levelling_sd_deg is not None and unit.levelling_sd_deg > STEEPEST:
        raise written.refuse(sd, "config.levelling-sd-too-large")


def _rest(k: int, spec: CaseSpec, written: Written) -> None:
    unit, at = spec.units[k], ("units", k, "rest_s")
    if unit.rest_s is None:
        return
    start, end = unit.rest_s
    if not start < end:
        raise written.refuse(at, "config.rest-end-before-begin")
    if end > 0.0:
        raise written.refuse(at, "config.rest-after-trigger", end=end)
    entry, speed = spec.entry, ("entry", "speed_m_per_s")
    if entry.kind == "speed" and entry.speed_m_per_s and end > entry.time_s:
        raise written.contradiction(
            at,
            ("entry", "time_s"),
            "config.rest-after-entry",
            default=entry.time_s,
            said=written.said(*speed),
        )
