"""A crash while its parameters move: one recorder, linear bounds, without drawings or files.

The whole answer of `strapdown crash` has all recorders against each other, drawn paths and
severity, and takes seconds; this part takes a fraction of one. Its records are kept between
two questions.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from strapdown.config.crash_case import CaseSpec
from strapdown.constants import TWO_SIDED_95
from strapdown.crash.case import reconstruct_recorder, whole_records
from strapdown.crash.delta_v_bound import direction_bounds
from strapdown.crash.path import PLACE
from strapdown.crash.pdof import clock_of
from strapdown.dsp.chi_square import plane_bound
from strapdown.formats.crash_record import CrashRecord
from strapdown.formats.crash_records import read_crash_record
from strapdown.report.crash_outline import vehicle_outline
from strapdown.report.values import change_words, has_heading, shown_in
from strapdown.studio.configuration import checked
from strapdown.studio.kinds import KINDS
from strapdown.studio.reading_process import told

#: Points of the path that are shown; records that are kept.
POINTS, MOST = 240, 32


def quick(folder: Path, toml: str, changes: Mapping[str, Any], unit: int = 0) -> dict[str, Any]:
    """Return delta-V, direction of force and path of a case by one recorder, with 95 % bounds.

    Parameters
    ----------
    folder : Path
        Of the studio.
    toml : str
        Of the case.
    changes : mapping
        Values by key path that replace those of the case.
    unit : int
        Number of the recorder.

    Returns
    -------
    dict
        ``delta_v`` (value and bound, m/s, and both as the report shows them; None without an
        event), ``pdof`` (deg, and the hour of the clock), ``path`` with the longer half axis of the
        ellipse of each point, m; ``over_ground``: whether a heading is known; without one ``north``
        is forward of the vehicle at the entry, and ``east`` its right. ``vehicle``, ``recorder``,
        and ``ms`` that it took.
    """
    begun = time.perf_counter()
    spec = checked(folder, KINDS["crash"], toml, changes=changes)
    assert isinstance(spec, CaseSpec)
    records, spec = whole_records(spec, _record)
    number = min(max(unit, 0), len(spec.units) - 1)
    made = reconstruct_recorder(spec, records, number)
    change = made.delta_v
    delta_v: dict[str, Any] | None = None
    pdof: dict[str, Any] | None = None
    if change is not None:
        at, low, high = direction_bounds(change)
        with shown_in(spec.options.units):
            shown = change_words(change)
        delta_v = {
            "value": change.resultant,
            "bound": _number(change.resultant_bound),
            "range": [_number(x) for x in change.resultant_range],
            "at_least": change.at_least,
            "shown": shown,
            "unit": "m/s",
            "forward": float(change.delta_v.vector[0]),
            "right": float(change.delta_v.vector[1]),
        }
        pdof = {
            "deg": at,
            "low": _number(low),
            "high": _number(high),
            "clock": clock_of(at),
            "unit": "deg",
        }
    path = made.path
    rows = np.unique(np.linspace(0, len(path.time) - 1, POINTS).round().astype(int))
    covariance, sd = path.covariance[rows], path.sd["heading"].to_numpy()[rows]
    radius = plane_bound(covariance[:, PLACE, PLACE])
    table = path.table.iloc[rows]
    outline = vehicle_outline(spec.vehicle)
    return {
        "delta_v": delta_v,
        "pdof": pdof,
        "path": {
            "t": path.time[rows].tolist(),
            "north": table["north"].tolist(),
            "east": table["east"].tolist(),
            "heading": table["heading"].tolist(),
            "heading_bound": (TWO_SIDED_95 * sd).tolist(),
            "bound": radius.tolist(),
        },
        "vehicle": {
            "length": spec.vehicle.length_m,
            "width": spec.vehicle.width_m,
            "outline": outline.body.tolist(),
        },
        "over_ground": has_heading(spec),
        "recorder": made.name,
        "recorders": [one.name for one in spec.units],
        "findings": [told(finding) for finding in made.findings],
        "ms": 1e3 * (time.perf_counter() - begun),
    }


_RECORDS: dict[tuple[str, int, int], CrashRecord] = {}


def _record(path: str) -> CrashRecord:
    """Return a record, read once until its file changes."""
    if Path(path).is_dir():
        return read_crash_record(path)
    about = Path(path).stat()
    key = (path, about.st_mtime_ns, about.st_size)
    if key not in _RECORDS:
        if len(_RECORDS) >= MOST:
            _RECORDS.clear()
        _RECORDS[key] = read_crash_record(path)
    return _RECORDS[key]


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
