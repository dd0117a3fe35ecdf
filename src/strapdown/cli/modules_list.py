"""Modules of each slot as plain data, for a terminal and for a script."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from strapdown.attitude_algorithms import ALGORITHMS, AttitudeAlgorithm
from strapdown.config.choice import SLOTS, Slot, options_of
from strapdown.config.motions import KINDS
from strapdown.ellipsoids import ELLIPSOIDS
from strapdown.errors import Finding
from strapdown.formats import READERS, Reader
from strapdown.formats.crash_records import CRASH_READERS
from strapdown.formats.writers import WRITERS
from strapdown.mechanization import MECHANIZATIONS, Mechanization
from strapdown.navigation.measurements.measurement import Measurement
from strapdown.navigation.measurements.standstill import STANDSTILL_DETECTORS, STANDSTILL_THRESHOLDS
from strapdown.plugins import plugins
from strapdown.sensors.catalogue import SENSORS, load_sensor
from strapdown.simulation import SCENARIOS
from strapdown.simulation.crash_cases import CASES
from strapdown.simulation.crash_motion import CRASHES

__all__ = ["HEADINGS", "Listed", "cell_text", "listed_modules"]

#: Defaults of slots that a file omits, where the default is not a module.
_UNSAID = {"update_rule": "; where none is named, every observation counts in full"}


#: Column headings on a terminal, where they differ from the names for a script.
HEADINGS = {
    "summary": "what it is",
    "duration_s": "s",
    "semi_major_axis_m": "a, m",
    "inverse_flattening": "1/f",
}


@dataclass(frozen=True)
class Listed:
    """One list.

    Attributes
    ----------
    key : str
        Its name for a script.
    title : str
    rows : tuple of mapping
        By column; a text, a number, a list of texts, or None if empty.
    numbers : tuple of str
        Columns of numbers.
    """

    key: str
    title: str
    rows: tuple[Mapping[str, Any], ...]
    numbers: tuple[str, ...] = ()


def cell_text(value: Any) -> str:
    """Format a cell of a list for printing."""
    if isinstance(value, float):
        return f"{value:.12g}"
    if isinstance(value, list):
        value = ", ".join(value)
    return value or "–"


#: For each list, the kind of its plug-ins, and their base class.
_PLUGINS: dict[str, tuple[str, type]] = {
    "attitude_algorithms": ("attitude", AttitudeAlgorithm),
    "aiding": ("measurement", Measurement),
    "formats": ("reader", Reader),
}


def listed_modules() -> tuple[tuple[Listed, ...], tuple[Finding, ...]]:
    """Return every list in printing order, including plug-ins.

    Returns `findings`: one for each unusable plug-in.
    """
    lists: list[Listed] = []
    findings: list[Finding] = []
    for one in _literal():
        if one.key not in _PLUGINS:
            lists.append(one)
            continue
        found, broken = plugins(*_PLUGINS[one.key])
        findings += broken
        added = {
            "attitude_algorithms": _algorithm_rows,
            "aiding": _module_rows,
            "formats": _formats,
        }[one.key](found)
        lists.append(replace(one, rows=(*one.rows, *added)))
    return tuple(lists), tuple(findings)


def _literal() -> tuple[Listed, ...]:
    slots = {name: slot for name, slot in SLOTS.items() if name != "mechanization"}
    return (
        _algorithms(),
        _mechanizations(),
        *(_slot(name, slot) for name, slot in slots.items()),
        Listed(
            "standstill_detectors",
            "Detectors of a standstill (detector = … of a measurement)",
            _summaries(STANDSTILL_DETECTORS),
        ),
        Listed(
            "standstill_thresholds",
            "What becomes of its threshold (threshold_rule = …)",
            _summaries(STANDSTILL_THRESHOLDS),
        ),
        Listed(
            "ellipsoids",
            "Ellipsoids",
            tuple(
                {
                    "name": name,
                    "semi_major_axis_m": float(e.semi_major_axis),
                    "inverse_flattening": float(f"{e.inverse_flattening:.12g}"),
                    "source": e.source,
                }
                for name, e in ELLIPSOIDS.items()
            ),
            ("semi_major_axis_m", "inverse_flattening"),
        ),
        Listed(
            "motions", "Motions of a trajectory's file", tuple({"name": kind} for kind in KINDS)
        ),
        *_scenarios(),
        Listed(
            "sensors",
            "Sensors that can be simulated",
            tuple(
                {"name": s.name, "class": s.grade, "summary": f"{s.title}: {s.summary}"}
                for s in map(load_sensor, SENSORS)
            ),
        ),
        Listed("formats", "Formats that are read", _formats(READERS)),
        Listed("crash_formats", "Formats of crash records that are read", _titles(CRASH_READERS)),
        Listed(
            "writers",
            "Formats that are written",
            tuple(
                {
                    "name": name,
                    "streams": list(one.streams),
                    "ending": list(one.endings) or ["folder"],
                    "read as": one.reader,
                    "summary": one.title,
                }
                for name, one in WRITERS.items()
            ),
        ),
    )


def _algorithms() -> Listed:
    return Listed(
        "attitude_algorithms",
        "Attitude algorithms",
        _algorithm_rows(ALGORITHMS),
    )


def _algorithm_rows(entries: Mapping[str, Any]) -> tuple[Mapping[str, Any], ...]:
    return tuple(
        {
            "name": name,
            "source": f"{cls.source} {cls.equations}".strip(),
            "options": [f"{f.name}={f.default}".lower() for f in fields(cls)],
            "summary": cls.summary,
        }
        for name, cls in entries.items()
    )


def _mechanizations() -> Listed:
    shared = len(fields(Mechanization))
    return Listed(
        "mechanization",
        "Mechanizations",
        tuple(
            {
                "name": name,
                "source": cls.source,
                "options": [f.name for f in fields(cls)[shared:]],
                "summary": cls.summary,
            }
            for name, cls in MECHANIZATIONS.items()
        ),
    )


def _slot(name: str, slot: Slot) -> Listed:
    return Listed(
        name,
        f"{slot.title} ([{name}] of a chain{_UNSAID.get(name, '')})",
        _module_rows(slot.entries),
    )


def _module_rows(entries: Mapping[str, Any]) -> tuple[Mapping[str, Any], ...]:
    return tuple(
        {
            "name": kind,
            "source": getattr(entry, "source", "") or None,
            "options": [o.key for o in options_of(entry)],
            "summary": getattr(entry, "summary", "") or (entry.__doc__ or "").partition("\n")[0],
        }
        for kind, entry in entries.items()
    )


def _scenarios() -> tuple[Listed, ...]:
    return (
        Listed(
            "scenarios",
            "Scenarios with exact attitude",
            tuple(
                {
                    "name": name,
                    "duration_s": float(f"{s.motion.duration:g}"),
                    "summary": f"{s.title} ({s.origin})",
                }
                for name, s in SCENARIOS.items()
            ),
            ("duration_s",),
        ),
        Listed(
            "crashes",
            "Crashes with exact truth, and what is none",
            tuple(
                {
                    "name": name,
                    "duration_s": float(f"{c.motion.duration:.3g}"),
                    "kind": c.kind,
                    "summary": f"{c.summary} ({c.source})",
                }
                for name, c in CRASHES.items()
            ),
            ("duration_s",),
        ),
        Listed(
            "crash_cases",
            "The same crashes with recorders of their own",
            tuple(
                {
                    "name": name,
                    "crash": c.crash.name,
                    "recorders": list(c.usual),
                    "summary": c.summary,
                }
                for name, c in CASES.items()
                if name not in CRASHES
            ),
        ),
    )


def _summaries(entries: Mapping[str, Any]) -> tuple[Mapping[str, Any], ...]:
    return tuple(
        {"name": name, "source": one.source, "summary": one.summary}
        for name, one in entries.items()
    )


def _formats(readers: Mapping[str, Reader]) -> tuple[Mapping[str, Any], ...]:
    return tuple(
        {
            "name": name,
            "streams": list(one.streams),
            "written as": next((n for n, w in WRITERS.items() if w.reader == name), None),
            "summary": one.title,
        }
        for name, one in readers.items()
    )


def _titles(readers: Mapping[str, Any]) -> tuple[Mapping[str, Any], ...]:
    return tuple({"name": name, "summary": one.title} for name, one in readers.items())
