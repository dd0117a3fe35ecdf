"""Write a verdict as files: the page, its values for programs, and heading integrity over time."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from strapdown.bundle.seal import to_json
from strapdown.evaluation.heading_light import COLOURS, REASONS
from strapdown.evaluation.plane_bound import plane_bound
from strapdown.formats import csv
from strapdown.navigation.consistency import Inconsistency
from strapdown.report.document import finding_json
from strapdown.report.document_files import write_text
from strapdown.report.document_html import document_page
from strapdown.report.verdict_document import verdict_document
from strapdown.report.verdict_words import (
    answer,
    first_words,
    promise,
    repeated_words,
    witness_words,
)
from strapdown.systems.sins.run import NavigationResult
from strapdown.systems.sins.trust import Repeated

__all__ = ["verdict_json", "write_verdict"]


def write_verdict(result: NavigationResult, name: str, folder: Path) -> None:
    """Write ``verdict.html``, ``verdict.json`` and ``heading_light.csv``.

    Parameters
    ----------
    result : NavigationResult
    name : str
        Folder name shown on the page.
    folder : Path
    """
    write_text(folder / "verdict.html", document_page(verdict_document(result, name)))
    write_text(folder / "verdict.json", to_json(verdict_json(result)))
    table = result.trust.light.table
    light = table["light"].to_numpy(dtype=np.int64)
    csv.write(
        folder / "heading_light.csv",
        {
            "time_s": table.index.to_numpy(dtype=np.float64),
            "light": np.array([COLOURS[k] for k in light], dtype=np.str_),
            "reason": np.array([str(r) for r in table["reason"]], dtype=np.str_),
            "bound_95_deg": table["bound"].to_numpy(dtype=np.float64),
            "borne_out_99_deg": table["carried"].to_numpy(dtype=np.float64),
            "witness": np.array([str(w) for w in table["witness"]], dtype=np.str_),
            "witness_difference_deg": table["difference"].to_numpy(dtype=np.float64),
            "witness_sd_deg": table["witness_sd"].to_numpy(dtype=np.float64),
            "witness_since_s": table["witness_since"].to_numpy(dtype=np.float64),
            "innovation_scatter": table["scatter"].to_numpy(dtype=np.float64),
        },
        {
            "run": result.source.name,
            "green_below_deg": f"{result.trust.light.green:g}",
            "red_beyond_deg": f"{result.trust.light.red:g}",
        },
    )


def verdict_json(result: NavigationResult) -> dict[str, Any]:
    """Return a verdict for programs; angles in degrees, lengths in meters, times in s."""
    trust, light = result.trust, result.trust.light
    bounds = plane_bound(result.record.covariance)
    spans = light.spans
    return {
        "answer": _plain(answer(result)),
        "place": {
            "bound_95_at_end_m": _number(bounds[-1]),
            "largest_bound_95_m": _number(bounds.max()),
            "borne_out": bool(trust.consistency) and trust.against_bounds is None,
        },
        "heading": {
            "meaning": {k.lower(): _plain(v) for k, v in promise(trust)},
            "green_below_deg": light.green,
            "red_beyond_deg": light.red,
            "borne_out": not trust.unwitnessed,
            "why_not": [finding_json(f) for f in trust.unwitnessed],
            "borne_out_by": witness_words(trust) or None,
            "share": {c: light.share(c) for c in COLOURS},
            "at_end": spans[-1].colour if spans else None,
            "spans": [
                {
                    "from_s": s.begin,
                    "to_s": s.end,
                    "light": s.colour,
                    "reason": s.reason,
                    "why": REASONS[s.reason],
                }
                for s in spans
            ],
            "advice": [
                {
                    "time_s": a.time,
                    "light": a.span.colour,
                    "sd_deg": _number(a.sd),
                    "manoeuvres": [
                        {
                            "what": m.what,
                            "forward_m_per_s2": m.forward,
                            "aside_m_per_s2": m.aside,
                            "duration_s": m.duration,
                            "sd_after_deg": _number(sd),
                        }
                        for m, sd in a.options
                    ],
                }
                for a in trust.advice
            ],
        },
        "innovations": {name: one.consistent for name, one in trust.consistency.items()},
        "inconsistencies": [_doubt(i) for i in trust.inconsistencies],
        "first": _plain(first_words(trust)),
        "repeated": None if trust.repeated is None else _repeated(trust.repeated, result),
    }


def _repeated(repeated: Repeated, result: NavigationResult) -> dict[str, Any]:
    out: dict[str, Any] = {
        "without": repeated.without,
        "answer": _plain(repeated_words(result)),
        "failed": None if repeated.failed is None else finding_json(repeated.failed),
        "left": [_doubt(i) for i in repeated.left],
    }
    if repeated.differences is not None:
        table = repeated.differences
        place = np.hypot(table["north"].to_numpy(), table["east"].to_numpy())
        turn = np.abs(table["heading"].to_numpy(dtype=np.float64))
        for name, unit, values in (("place", "m", place), ("heading", "deg", turn)):
            out[f"{name}_apart"] = {
                f"median_{unit}": _number(np.median(values)),
                f"largest_{unit}": _number(values.max()),
                f"at_end_{unit}": _number(values[-1]),
            }
    return out


def _doubt(one: Inconsistency) -> dict[str, Any]:
    return {
        "observation": one.name,
        "aid": one.aid,
        "component": one.component,
        "kind": one.kind,
        "since_s": one.since,
        "until_s": one.until,
        "epochs_s": one.epochs.tolist(),
        "what": one.what,
        "meaning": one.meaning,
    }


def _number(value: Any) -> float | None:
    number = float(value)
    return number if math.isfinite(number) else None


def _plain(text: str) -> str:
    return text.replace("\u00a0", " ")
