"""Consistency checks of a crash case; contradictions are reported with both lines."""

from __future__ import annotations

from strapdown.config.crash_case import CaseSpec
from strapdown.config.crash_checks.entry import (
    check_entry,
    check_options,
    check_places,
    check_references,
)
from strapdown.config.crash_checks.units import check_triads, check_units
from strapdown.config.crash_checks.written import Written

__all__ = ["Written", "check_case"]


def check_case(spec: CaseSpec, written: Written) -> None:
    """Refuse an inconsistent case.

    Parameters
    ----------
    spec : CaseSpec
        With the files that it names as absolute paths.
    written : Written

    Raises
    ------
    ConfigError
        A required value is missing, a value is implausible, or two values are contradictory; the
        message names the line, or both lines, and the values.
    """
    check_places(spec, written)
    check_entry(spec, written)
    check_units(spec, written)
    check_triads(spec, written)
    check_references(spec, written)
    check_options(spec, written)
