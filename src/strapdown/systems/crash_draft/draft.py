"""A commented case.toml from records: what was found, what is assumed, what only the user knows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from strapdown.config.toml_text import Asked, Page, instant, plain
from strapdown.constants import STANDARD_GRAVITY
from strapdown.crash.event_rule import KMH
from strapdown.errors import Finding
from strapdown.systems.crash_draft.case_tables import (
    agreement,
    case_table,
    entry_table,
    head,
    left_out,
    options_table,
    vehicle_table,
)
from strapdown.systems.crash_draft.group_units import Unit
from strapdown.systems.crash_draft.heading_of_unit import facings
from strapdown.systems.crash_draft.known_path import KnownPath, reference_tables
from strapdown.systems.crash_draft.parts import Skipped
from strapdown.systems.crash_draft.unit_tables import unit_tables

__all__ = ["Draft", "write_draft"]


@dataclass(frozen=True)
class Draft:
    """A case as it was drafted.

    Attributes
    ----------
    text : str
        Of the file.
    found : tuple of str
        For the user, a line each.
    asked : tuple of Asked
        What is left to the user.
    to_check : tuple of Asked
        What follows from values that were found or assumed, for a person to confirm.
    left_out : tuple of Skipped
    findings : tuple of Finding
        What a person should know of the records.
    """

    text: str
    found: tuple[str, ...]
    asked: tuple[Asked, ...]
    to_check: tuple[Asked, ...] = ()
    left_out: tuple[Skipped, ...] = ()
    findings: tuple[Finding, ...] = ()


def write_draft(
    units: Sequence[Unit],
    skipped: Sequence[Skipped],
    *,
    title: str = "",
    facts: Mapping[str, str] | None = None,
    findings: Sequence[Finding] = (),
    paths: Sequence[KnownPath] = (),
) -> Draft:
    """Write a case of units.

    Parameters
    ----------
    units : sequence of Unit
    skipped : sequence of Skipped
        What was left out, for a comment.
    title : str
        As the record says; empty where it says none.
    facts : mapping, optional
        Of a test: the keys of `CrashRecord.facts`.
    findings : sequence of Finding
    paths : sequence of KnownPath
        What else is known of the crash.
    """
    page = Page()
    facing = facings(units)
    head(page)
    case_table(page, title, facts or {})
    vehicle_table(page, facts or {})
    entry_table(page, facts or {}, units)
    for k, unit in enumerate(units):
        unit_tables(page, unit, facing[k], units)
    agreement(page, units, facing)
    reference_tables(page, list(paths))
    left_out(page, skipped)
    options_table(page, units)
    found = _found(units)
    found += [
        f"{plain(p.name)}: a path from {instant(p.start)} to {instant(p.end)} s, a reference"
        for p in paths
    ]
    return Draft(
        page.text,
        tuple(found),
        tuple(page.asked),
        tuple(page.to_check),
        tuple(skipped),
        tuple(findings),
    )


def _found(units: Sequence[Unit]) -> list[str]:
    told = []
    for unit in units:
        impact = unit.impact
        parts = [
            f"{'low' if k == 0 and len(unit.accelerometers) > 1 else 'high' if k else 'one'} range"
            for k in range(len(unit.accelerometers))
        ]
        with_ = " and ".join(parts) + (", gyro" if unit.gyro else "")
        clock = unit.accelerometers[-1].clock
        if not clock.unit:
            at = impact.trigger * clock.rate
            what = f"its largest blow begins near sample {at:.0f}; it has no clock"
        elif impact.found:
            what = (
                f"struck at {instant(impact.trigger)} s of its clock, "
                f"{impact.largest / KMH:.3g} km/h, peak {impact.peak / STANDARD_GRAVITY:.3g} g"
            )
        elif unit.ends[len(unit.accelerometers) - 1].saturated:
            what = (
                f"struck at {instant(impact.trigger)} s of its clock, beyond the end of its range"
            )
        else:
            what = (
                f"no crash found: {impact.largest / KMH:.2g} km/h within 150 ms at most, of the 8 "
                "that 49 CFR 563 asks for"
            )
        told.append(f"{plain(unit.name)}: {with_}; {what}")
    return told
