"""A forecast of coasting as JSON and as tables of numbers."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.formats import csv
from strapdown.report.coast_words import end_bound, headline, inside_words, remedy, start_words
from strapdown.report.crash_values import spaced
from strapdown.systems.coasting.forecast import QUANTITIES
from strapdown.systems.coasting.run import CoastResult

__all__ = ["coast_json", "write_coast_tables"]

Array = NDArray[np.float64]

#: Names with units, and factors from SI.
SHOWN = {
    "horizontal": ("horizontal_sd_m", 1.0),
    "along": ("along_sd_m", 1.0),
    "across": ("across_sd_m", 1.0),
    "vertical": ("vertical_sd_m", 1.0),
    "speed": ("speed_sd_m_per_s", 1.0),
    "heading": ("heading_sd_deg", math.degrees(1.0)),
}


def coast_json(result: CoastResult) -> dict[str, Any]:
    """Return everything that a program would ask of a forecast.

    Parameters
    ----------
    result : CoastResult

    Returns
    -------
    dict
        Lengths in m, times in s, angles in deg; sizes of sources in SI.
    """
    found, recorded = result.forecast, result.recorded
    whole = {q: float(v[-1]) for q, v in _variances(result).items()}
    budget = found.variance("horizontal")[-1]
    return {
        "name": result.name,
        "what": result.what,
        "answer": spaced(headline(result)),
        "remedy": spaced(remedy(result)),
        "outage_s": result.spec.outage_s,
        "start": spaced(start_words(result)),
        "begin_s": found.begin,
        "aids_that_stay": list(result.stays),
        "at_the_end": {
            "horizontal_95_m": end_bound(result),
            **{SHOWN[q][0]: SHOWN[q][1] * math.sqrt(max(v, 0.0)) for q, v in whole.items()},
        },
        "budget": {
            "outage_from_s": found.begin,
            "horizontal_sd_m": float(math.sqrt(budget)),
            "sources": [
                {
                    "source": one.source.name,
                    "sd_at_start": one.sd.tolist(),
                    "unit": one.source.unit,
                    "share": {
                        q: float(one.variance[q][-1] / _positive(found.variance(q)[-1]))
                        for q in QUANTITIES
                    },
                    "alone_m": _number(float(one.alone["horizontal"][-1])),
                }
                for one in found.shares
            ],
            "aids": {
                q: float(v[-1] / _positive(found.variance(q)[-1])) for q, v in found.aids.items()
            },
        },
        "tried": spaced(inside_words(result)),
        "drifts": [
            {
                "begin_s": d.span.begin,
                "end_s": d.span.end,
                "fixes": len(d.time),
                "drift_m": float(d.horizontal[-1]),
                "along_m": float(d.along[-1]),
                "across_m": float(d.across[-1]),
                "down_m": float(d.down[-1]),
                "foretold_95_m": float(d.bound[-1]),
                "inside_95": float(d.inside.mean()),
            }
            for d in (() if recorded is None else recorded.drifts)
            if d.time.size
        ],
        "findings": [spaced(str(f)) for f in result.findings],
    }


def write_coast_tables(result: CoastResult, folder: Path) -> None:
    """Write the cone, its budget over time, and the drifts that came.

    Parameters
    ----------
    result : CoastResult
    folder : Path
        ``cone.csv``, ``budget.csv``, and ``drifts.csv`` where there were fixes.
    """
    told = {"coasting": result.name, "outage_s": f"{result.spec.outage_s:g}"}
    recorded = result.recorded
    time = result.forecast.time if recorded is None else recorded.time
    bound = result.forecast.bound if recorded is None else recorded.bound
    sds = {
        SHOWN[q][0]: SHOWN[q][1] * np.sqrt(np.maximum(v, 0.0))
        for q, v in _variances(result).items()
    }
    csv.write(folder / "cone.csv", {"time_s": time, "horizontal_95_m": bound, **sds}, told)
    found = result.forecast
    parts = {f"{_column(one.source.name)}_m2": one.variance["horizontal"] for one in found.shares}
    if found.aids:
        parts["aids_m2"] = found.aids["horizontal"]
    parts["all_m2"] = found.variance("horizontal")
    of = {**told, "of": "variance of the horizontal drift", "outage_from_s": f"{found.begin:.9g}"}
    csv.write(folder / "budget.csv", {"time_s": found.time, **parts}, of)
    drifts = [] if recorded is None else [d for d in recorded.drifts if d.time.size]
    if drifts:
        columns = {
            "outage_from_s": np.concatenate([np.full(len(d.time), d.span.begin) for d in drifts]),
            "time_s": np.concatenate([d.time for d in drifts]),
            "along_m": np.concatenate([d.along for d in drifts]),
            "across_m": np.concatenate([d.across for d in drifts]),
            "down_m": np.concatenate([d.down for d in drifts]),
            "inside_95": np.concatenate([d.inside.astype(np.float64) for d in drifts]),
        }
        csv.write(folder / "drifts.csv", columns, {**told, "sign": "computed less fix"})


def _variances(result: CoastResult) -> dict[str, Array]:
    if result.recorded is not None:
        return result.recorded.variance
    return {q: result.forecast.variance(q) for q in QUANTITIES}


def _column(name: str) -> str:
    return name.replace(".", "_")


def _positive(value: float) -> float:
    return float(value) if value > 0.0 else math.inf


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
