"""First page of a demonstration: the answers of several runs, each with its picture."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from strapdown.report.document import (
    Block,
    Document,
    Items,
    Links,
    Paragraph,
    Picture,
    Section,
    blocks,
    paragraph,
)
from strapdown.report.document_html import document_page
from strapdown.report.values import decimals, plain

_MS_TO_KMH = 3.6
_SMALL_DEG = 1e-3
_PARTS = (
    ("A", "Navigation", "position, velocity and attitude, with 95 % bounds"),
    ("B", "Attitude", "the simplest algorithm and lowest rate of sufficient accuracy"),
    ("C", "Crash", "delta-V, direction of force and path, with 95 % bounds"),
)


@dataclass(frozen=True)
class Shown:
    """One run on the page.

    Attributes
    ----------
    part : str
        A, B or C: one of the three systems.
    slug : str
        Its folder beside the page.
    command : str
        Command that reproduces it, typed beside the page's own folder.
    figures : tuple of str
        Figures of the bundle, without their extension.
    pages : tuple of (file, words)
        Pages to open.
    records : str, optional
        Folder of the records with the truth, for a simulated crash.
    """

    part: str
    slug: str
    title: str
    question: str
    command: str
    figures: tuple[str, ...]
    pages: tuple[tuple[str, str], ...] = (("report.html", "Report"),)
    records: str | None = None


def shown_answer(bundle: Path) -> str:
    """Return the answer of a bundle of `attitude`, `crash`, `navigate` or `outage`."""
    kind, result = _result_of(bundle)
    if kind == "attitude":
        return str(result["answer"]["sentence"] if result["answer"] else result["headline"])
    if kind == "crash":
        return str(result["headline"])
    if kind == "outage":
        answer = str(result["answer"]).removeprefix(f"{result['name']}: ")
        return f"{answer[:1].upper()}{answer[1:]}."
    return str(_json(bundle / "verdict.json")["answer"])


def shown_truth(bundle: Path, records: Path | None = None) -> str | None:
    """Return the truth or reference of a bundle, and the error of its answer; None without one.

    `records`: of a simulated crash.
    """
    kind, result = _result_of(bundle)
    if kind == "attitude":
        return _attitude_truth(result)
    if kind == "crash":
        return None if records is None else _crash_truth(_json(records / "scenario.json"))
    if kind == "outage":
        return str(result["measured"]) if result["measured"] else None
    return _navigation_truth(result)


def demo_page(shown: Sequence[Shown], folder: Path, missing: str | None = None) -> str:
    """Return the page of runs with their bundles in `folder`: HTML that needs no network.

    Identical for the same bundles. `missing`: missing parts, and the reason.
    """
    document = Document(
        "Results of strapdown, with bounds and references",
        "Three systems: each result with its bound, and its error where the truth is known.",
        (),
        blocks(
            Items(tuple((f"{part} · {system}", text) for part, system, text in _PARTS)),
            paragraph(missing, "note"),
        ),
        tuple(
            Section(run.slug, f"{run.part} · {run.title}", tuple(_blocks(run, folder)))
            for run in shown
        ),
        "Written by strapdown demo. Every folder is sealed: strapdown verify FOLDER repeats the "
        "run and compares it to the last bit.",
    )
    return document_page(document)


def _blocks(run: Shown, folder: Path) -> Iterator[Block]:
    bundle = folder / run.slug
    yield Paragraph(run.question, "note")
    yield Paragraph(shown_answer(bundle), "lead")
    truth = shown_truth(bundle, None if run.records is None else folder / run.records)
    if truth:
        yield Items((("Against the truth", truth),))
    # A PDF is there if the extra for it is installed.
    pages = ((page, words) for page, words in run.pages if (bundle / page).is_file())
    yield Links(tuple((f"{quote(run.slug)}/{page}", words) for page, words in pages))
    for figure in run.figures:
        drawn = (bundle / "figures" / f"{figure}.svg").read_text(encoding="utf-8")
        name = figure.replace("-", " ")
        yield Picture(
            figure, drawn, f"{name.capitalize()} of the report", alt=f"{run.title}: {name}"
        )
    yield Paragraph(run.command, "mono")


def _attitude_truth(result: dict[str, Any]) -> str | None:
    full = {
        s["algorithm"]: s["error_deg"]
        for s in result["sweep"]
        if s["factor"] == 1 and s["meaning"] == "drop" and s["error_deg"] is not None
    }
    if not full:
        return None
    exact = any(s["max_deg"] is not None for s in result["sweep"])
    known = "True attitude known" if exact else "Final attitude known"
    rate = max(s["rate_hz"] for s in result["sweep"])
    errors = ", ".join(f"{name} {_degrees(error)}" for name, error in full.items())
    return f"{known}. Errors at {plain(rate, 0)} Hz: {errors}."


def _degrees(value: float) -> str:
    if value < _SMALL_DEG:
        return f"less than {_SMALL_DEG:g}°"
    return f"{plain(value, decimals(value))}°"


def _crash_truth(scenario: dict[str, Any]) -> str:
    (impact,) = scenario["impacts"]
    # The report states both along the axes of the vehicle, which turns meanwhile.
    change = math.hypot(*impact["delta_v_along_turning_axes_m_per_s"]) * _MS_TO_KMH
    return (
        f"Simulated: delta-V {plain(change, 2)} km/h, direction of force "
        f"{plain(impact['pdof_along_turning_axes_deg'], 1)}°."
    )


def _navigation_truth(result: dict[str, Any]) -> str | None:
    if result["control_points"]:
        points = result["control_points"]
        return (
            f"{points['points']} control points, after a fit of origin and heading: error "
            f"{plain(points['rms_m'], 2)} m (RMS), {plain(points['largest_m'], 2)} m at most, over "
            f"{plain(points['path_length_m'], 1)} m: "
            f"{plain(100.0 * points['rms_m'] / points['path_length_m'], 2)} %."
        )
    if result["against"]:
        errors = result["against"]["errors"]
        sides = (("horizontal", "horizontal position"), ("down", "height"))
        return (
            f"Against {result['against']['name']} "
            + "; ".join(
                f"{name}: error {plain(errors[key]['rms_m'], 3)} m (RMS), "
                f"{plain(errors[key]['largest_m'], 3)} m at most, within its 95 % bound for "
                f"{plain(100.0 * errors[key]['share_within_bound'], 1)} % of the time"
                for key, name in sides
            )
            + "."
        )
    if result["gnss_outage_tests"]:
        return _withheld_truth(result["gnss_outage_tests"])
    return None


def _withheld_truth(withheld: list[dict[str, Any]]) -> str:
    tried = [w for w in withheld if w["largest_horizontal_error_m"] is not None]
    length = plain(max(w["to_s"] - w["from_s"] for w in tried), 0)
    errors = ", ".join(plain(w["largest_horizontal_error_m"], 1) for w in tried)
    forward, before = [w["largest_horizontal_error_forward_m"] for w in tried], ""
    if None not in forward:
        before = f" (before smoothing by {', '.join(plain(error, 1) for error in forward)} m)"
    return (
        f"{len(tried)} GNSS outage tests of {length} s: error {errors} m at most{before}, "
        f"consistent with the 95 % bounds in {sum(w['inside'] for w in tried)} of {len(tried)}."
    )


def _result_of(bundle: Path) -> tuple[str, dict[str, Any]]:
    manifest = _json(bundle / "manifest.json")
    name = {"navigate": "navigation"}.get(manifest["command"], manifest["command"])
    return manifest["command"], _json(bundle / f"{name}.json")


def _json(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))
