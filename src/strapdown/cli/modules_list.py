"""Modules of each slot as plain data, for a terminal and for a script."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any

from strapdown.attitude_algorithms import ALGORITHMS, AttitudeAlgorithm
from strapdown.config.choice import SLOTS, options_of
from strapdown.config.motions import KINDS
from strapdown.ellipsoids import ELLIPSOIDS
from strapdown.errors import Finding
from strapdown.export.steps import STEPS
from strapdown.formats import READERS, Reader
from strapdown.formats.crash_records import CRASH_READERS
from strapdown.formats.writers import WRITERS
from strapdown.mechanization import MECHANIZATIONS, Mechanization
from strapdown.navigation.measurements.measurement import Measurement
from strapdown.navigation.measurements.standstill import STANDSTILL_DETECTORS, STANDSTILL_THRESHOLDS
from strapdown.orientation_filters import FILTERS
from strapdown.plugins import plugins
from strapdown.sensors.catalogue import SENSORS, load_sensor
from strapdown.simulation import SCENARIOS
from strapdown.simulation.crash_cases import CASES
from strapdown.simulation.crash_motion import CRASHES

#: Defaults of slots that a file omits, where the default is not a module.
_UNSAID = {"update_rule": "; where none is named, every observation counts in full"}


#: Column headings on a terminal, where they differ from the names for a script.
HEADINGS = {
    "summary": "what it is",
    "sourced": "figures with a source",
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

#: Columns of a list: each cell from an entry and its name.
Columns = Mapping[str, Callable[[str, Any], Any]]


def listed_modules() -> tuple[tuple[Listed, ...], tuple[Finding, ...]]:
    """Return every list in printing order, including plug-ins.

    Returns `findings`: one for each unusable plug-in.
    """
    lists: list[Listed] = []
    findings: list[Finding] = []
    for key, title, entries, columns in _tables():
        known = dict(entries)
        if key in _PLUGINS:
            found, broken = plugins(*_PLUGINS[key])
            findings += broken
            known |= found
        rows = tuple(
            {"name": name, **{column: cell(name, entry) for column, cell in columns.items()}}
            for name, entry in known.items()
        )
        lists.append(Listed(key, title, rows, tuple(c for c in columns if c in _NUMBERS)))
    return tuple(lists), tuple(findings)


_NUMBERS = ("semi_major_axis_m", "inverse_flattening", "duration_s")
_TITLE: Columns = {"summary": lambda _, one: one.title}
_SUMMARY: Columns = {
    "source": lambda _, one: one.source,
    "summary": lambda _, one: one.summary,
}
_MODULE: Columns = {
    "source": lambda _, one: getattr(one, "source", "") or None,
    "options": lambda _, one: [o.key for o in options_of(one)],
    "summary": lambda _, one: getattr(one, "summary", "") or (one.__doc__ or "").partition("\n")[0],
}


def _tables() -> Iterator[tuple[str, str, Mapping[str, Any], Columns]]:
    """Key, title, entries and columns of each list, in printing order."""
    yield (
        "attitude_algorithms",
        "Attitude algorithms",
        ALGORITHMS,
        {
            "source": lambda _, cls: f"{cls.source} {cls.equations}".strip(),
            "options": lambda _, cls: [f"{f.name}={f.default}".lower() for f in fields(cls)],
            "summary": lambda _, cls: cls.summary,
        },
    )
    yield (
        "orientation_filters",
        "Orientation filters (sd.attitude; beside the algorithms in a comparison)",
        FILTERS,
        {
            **_SUMMARY,
            "options": lambda _, cls: [f"{f.name}={f.default:g}" for f in fields(cls)],
        },
    )
    shared = len(fields(Mechanization))
    options = {"options": lambda _, cls: [f.name for f in fields(cls)[shared:]]}
    columns = {"source": _SUMMARY["source"], **options, "summary": _SUMMARY["summary"]}
    yield "mechanization", "Mechanizations", MECHANIZATIONS, columns
    for name, slot in SLOTS.items():
        if name != "mechanization":
            title = f"{slot.title} ([{name}] of a chain{_UNSAID.get(name, '')})"
            yield name, title, slot.entries, _MODULE
    yield (
        "exports",
        "As C for a device (strapdown export), beside the algorithms and filters above",
        STEPS,
        {
            "options": lambda _, step: [f.name for f in fields(step[0])],
            "summary": lambda _, step: step[2],
        },
    )
    yield (
        "standstill_detectors",
        "Detectors of a standstill (detector = … of a measurement)",
        STANDSTILL_DETECTORS,
        _SUMMARY,
    )
    yield (
        "standstill_thresholds",
        "Threshold rules of an update rule (threshold_rule = …)",
        STANDSTILL_THRESHOLDS,
        _SUMMARY,
    )
    yield (
        "ellipsoids",
        "Ellipsoids",
        ELLIPSOIDS,
        {
            "semi_major_axis_m": lambda _, e: float(e.semi_major_axis),
            "inverse_flattening": lambda _, e: float(f"{e.inverse_flattening:.12g}"),
            "source": lambda _, e: e.source,
        },
    )
    yield "motions", "Motions of a trajectory's file", dict.fromkeys(KINDS), {}
    yield "scenario_motions", "Motions of a scenario's file", {"pulses": None}, {}
    yield (
        "scenarios",
        "Scenarios with exact attitude",
        SCENARIOS,
        {
            "duration_s": lambda _, s: float(f"{s.motion.duration:g}"),
            "summary": lambda _, s: f"{s.title} ({s.after or s.origin})",
        },
    )
    yield (
        "crashes",
        "Crashes with exact truth, and records without a crash",
        CRASHES,
        {
            "duration_s": lambda _, c: float(f"{c.motion.duration:.3g}"),
            "kind": lambda _, c: c.kind,
            "summary": lambda _, c: f"{c.summary} ({c.source})",
        },
    )
    yield (
        "crash_cases",
        "The same crashes with recorders of their own",
        {name: c for name, c in CASES.items() if name not in CRASHES},
        {
            "crash": lambda _, c: c.crash.name,
            "recorders": lambda _, c: list(c.usual),
            "summary": lambda _, c: c.summary,
        },
    )
    yield (
        "sensors",
        "Sensors that can be simulated",
        {s.name: s for s in map(load_sensor, SENSORS)},
        {
            "class": lambda _, s: s.grade,
            "sourced": lambda _, s: f"{sum(bool(f.source) for f in s.sources)} of {len(s.sources)}",
            "summary": lambda _, s: f"{s.title}: {s.summary}",
        },
    )
    written = {w.reader: n for n, w in reversed(WRITERS.items())}
    yield (
        "formats",
        "Formats that are read",
        READERS,
        {
            "streams": lambda _, one: list(one.streams),
            "written as": lambda name, _: written.get(name),
            **_TITLE,
        },
    )
    yield "crash_formats", "Formats of crash records that are read", CRASH_READERS, _TITLE
    yield (
        "writers",
        "Formats that are written",
        WRITERS,
        {
            "streams": lambda _, one: list(one.streams),
            "ending": lambda _, one: list(one.endings) or ["folder"],
            "read as": lambda _, one: one.reader,
            **_TITLE,
        },
    )
