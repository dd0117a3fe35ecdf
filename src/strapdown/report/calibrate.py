"""Write a calibration as a sealed bundle: page, JSON, calibration file, tables."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strapdown.bundle import write_json
from strapdown.config.logs import CalibrateSpec
from strapdown.constants import STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.formats import csv
from strapdown.report import document
from strapdown.report.chart import AXIS_COLOURS, Chart, Level, Panel, dots
from strapdown.report.report_bundle import bundle_by_specification, finite, with_page
from strapdown.report.values import about
from strapdown.rotation import rotation_vector_from_dcm
from strapdown.sensors.calibration import correlations
from strapdown.systems.calibrate_run import CalibrateRun, run_calibrate

DEG, G = math.pi / 180.0, STANDARD_GRAVITY
XYZ = ("x", "y", "z")
#: Rows of the table: title, unit, factor, names of the parameters.
ROWS: tuple[tuple[str, str, float, tuple[str, ...]], ...] = tuple(
    (title, unit, factor, tuple(f"{name}_{axis}" for axis in axes))
    for title, unit, factor, name, axes in (
        ("gyro bias", "deg/s", 1.0 / DEG, "gyro_bias", XYZ),
        ("gyro scale", "%", 100.0, "gyro_scale", XYZ),
        ("gyro x by y, y by z, z by x", "deg", 1.0 / DEG, "gyro_misalignment", ("xy", "yz", "zx")),
        ("gyro x by z, y by x, z by y", "deg", 1.0 / DEG, "gyro_misalignment", ("xz", "yx", "zy")),
        *(
            (
                f"gyro by force along {f}",
                "deg/s/g",
                G / DEG,
                "g_sensitivity",
                ("x" + f, "y" + f, "z" + f),
            )
            for f in XYZ
        ),
        ("gyro bias with temperature", "deg/s/°C", 1.0 / DEG, "gyro_temperature", XYZ),
        ("accelerometer bias", "mg", 1e3 / G, "accel_bias", XYZ),
        ("accelerometer scale", "%", 100.0, "accel_scale", XYZ),
        (
            "accelerometer axes xy, yz, xz",
            "deg",
            1.0 / DEG,
            "accel_misalignment",
            ("xy", "yz", "xz"),
        ),
        ("accelerometer bias with temperature", "mg/°C", 1e3 / G, "accel_temperature", XYZ),
    )
)
CAPTION = (
    "Reading − truth in the axes of the sensor, ± 95 % bound. ? : not observed, left as before. "
    "Gyros are aligned to the axes of the accelerometers, whose misalignment is symmetric."
)
METHOD = (
    "Maximum posterior of all errors, of the direction of gravity at each rest and of the drift of "
    "the gyro bias; a turn carries gravity from rest to rest (Tedaldi, Pretto and Menegatti 2014).",
    "Noise of means by three parts of a rest; what residuals exceed it widens the bounds, as do "
    "products of errors that are not observed.",
    "The Earth's rotation is in the mean rates of rests: its vertical part is estimated, or by the "
    "latitude; its horizontal part, in an unknown direction, counts as noise.",
    "The bias is that of these logs: what it changes by from day to day is not in its bound.",
)


def _write_data(result: CalibrateRun, folder: Path) -> None:
    write_json(folder / "calibrate.json", calibrate_json(result))
    text = result.calibration_text()
    (folder / "calibration.toml").write_text(text, encoding="utf-8", newline="\n")
    if result.calibration is not None and len(result.calibration.rests):
        table = result.calibration.rests
        csv.write(
            folder / "rests.csv",
            {str(c): table[c].to_numpy(dtype=np.float64) for c in table.columns},
            {"units": "start, end: s; force_: m/s²; turn_: rad; up_: sensor axes"},
        )


def calibrate_json(result: CalibrateRun) -> dict[str, Any]:
    """Return the calibration as plain data for programs, in SI.

    Returns
    -------
    dict
        ``parameters`` with ``value``, ``sd``, ``prior_sd``, ``observed``; ``correlations``;
        ``remedies``; ``excess``; ``turns``; ``magnetometer``; the findings.
    """
    found, mag = result.calibration, result.magnetometer
    out: dict[str, Any] = {"name": result.name, "procedure": result.procedure}
    if found is not None:
        rows = result.parameters.to_dict("records")
        out["parameters"] = {str(row.pop("parameter")): row for row in rows}
        out["correlations"] = [list(pair) for pair in correlations(found)]
        out["remedies"] = list(found.remedies)
        out["excess"] = found.excess
        out["rests"] = int((~found.rests["held"]).sum()) if len(found.rests) else 0
        out["turns"] = found.turns.to_dict("records")
        out["temperature_c"] = found.temperature
    out["magnetometer"] = (
        None
        if mag is None
        else {
            "hard_iron": mag.hard_iron.tolist(),
            "hard_iron_sd": mag.hard_iron_sd.tolist(),
            "soft_iron": mag.soft_iron.tolist(),
            "field": mag.field,
            "direction_sd_deg": mag.direction_sd_deg,
            "rotation": mag.rotation.tolist(),
            "rotation_sd_rad": mag.rotation_sd.tolist(),
        }
    )
    out["findings"] = [one.plain("cli") for one in result.findings]
    return finite(out)


# The answer, which page and terminal share.


#: Biases across the vertical make the force larger in the mean, whatever their sign.
FEW_POSES = (
    "The calibrated force is farther from gravity: these poses do not show the biases across the "
    "vertical, and what these add to its strength in the mean is allowed for. Record more poses."
)


def headline(result: CalibrateRun) -> str:
    """Say what was used, and how much of the sensor it determines."""
    found = result.calibration
    if found is None:
        return f"{result.name}: no rest and no known rotation; the magnetometer is calibrated."
    count = int((~found.rests["held"]).sum()) if len(found.rests) else 0
    seen = int(found.observed.sum())
    rests = "1 rest" if count == 1 else f"{count} rests"
    turns = "1 known rotation" if len(found.turns) == 1 else f"{len(found.turns)} known rotations"
    return (
        f"{result.name}: {rests} and {turns} ({result.procedure}) "
        f"determine {seen} of {len(found.names)} errors."
    )


def parameter_table(result: CalibrateRun) -> document.TableBlock | None:
    """Return the errors with their bounds."""
    found = result.calibration
    if found is None:
        return None
    by_name = {n: k for k, n in enumerate(found.names)}
    sd, observed = found.sd, found.observed
    rows = []
    for title, unit, factor, names in ROWS:
        if names[0] not in by_name:
            continue
        cells = []
        for k in (by_name[name] for name in names):
            text = about(factor * float(found.values[k]), 1.96 * factor * float(sd[k]), "")
            cells.append(text + ("" if observed[k] else " ?"))
        rows.append((title, unit, *cells))
    return document.table_of(("Error", "unit", *XYZ), rows, CAPTION, text=(0, 1))


#: Residuals of the rests: title, unit, factor, columns before and after the calibration.
RESIDUALS = (
    ("force at rest − gravity", "mg", 1e3 / G, ("force_error", "force_left")),
    ("vertical after a turn, by the gyro", "deg", 1.0 / DEG, ("turn_error", "turn_left")),
)


def _rests(result: CalibrateRun) -> pd.DataFrame | None:
    """Rests that are not known rotations, if there are rests."""
    found = result.calibration
    if found is None or not len(found.rests):
        return None
    return found.rests[~found.rests["held"]]


def effect_table(result: CalibrateRun) -> document.TableBlock | None:
    """Return what the calibration changes: force at rest, and the vertical after turns."""
    still = _rests(result)
    if still is None:
        return None
    rows = []
    for title, unit, factor, names in RESIDUALS:
        before, after = (still[n].dropna().to_numpy(dtype=np.float64) for n in names)
        if before.size:
            values = [factor * math.sqrt(float(np.mean(v**2))) for v in (before, after)]
            rows.append((title, unit, *(f"{v:.3g}" for v in values)))
    was, left = (float(np.square(still[n].to_numpy(np.float64)).sum()) for n in RESIDUALS[0][3])
    caption = FEW_POSES if left > was else ""
    return document.table_of("Root mean square | unit | before | after", rows, caption, text=(0, 1))


def turn_table(result: CalibrateRun) -> document.TableBlock | None:
    """Return the known rotations beside those that the calibrated gyro measures."""
    found = result.calibration
    if found is None or not len(found.turns):
        return None
    rows = []
    for row in found.turns.to_dict("records"):
        known, measured, left = (row[key] / DEG for key in ("known", "measured", "left"))
        rows.append((XYZ[int(row["axis"])], f"{known:.6g}", f"{measured:.6g}", f"{left:.3g}"))
    caption = (
        "Angles in deg, rates in deg/s. Left: what the end differs by from the known rotation."
    )
    return document.table_of("Known rotation about | known | measured | left", rows, caption)


def field_table(result: CalibrateRun) -> document.TableBlock | None:
    """Return hard iron and what it leaves of the direction of the field."""
    mag = result.magnetometer
    if mag is None:
        return None
    iron = [
        about(100.0 * v / mag.field, 100.0 * TWO_SIDED_95 * s / mag.field, "")
        for v, s in zip(mag.hard_iron, mag.hard_iron_sd, strict=True)
    ]
    caption = (
        f"The direction of the field changes by {mag.change_deg:.2g}° (rms) and is then known to "
        f"{1.96 * mag.direction_sd_deg:.2g}° (95 %)."
    )
    rows = [("hard iron", "% of the field", *iron)]
    if np.isfinite(mag.rotation_sd).all():
        turn = rotation_vector_from_dcm(mag.rotation) / DEG
        pairs = zip(turn, mag.rotation_sd, strict=True)
        axes = [about(v, TWO_SIDED_95 * s / DEG, "") for v, s in pairs]
        rows.append(("axes against accelerometers", "deg", *axes))
    return document.table_of(("Magnetometer", "unit", *XYZ), rows, caption, text=(0, 1))


# Page and charts.


def calibrate_document(result: CalibrateRun, name: str = "") -> document.Document:
    """Return the report of a calibration."""
    found = result.calibration
    remedies = () if found is None else found.remedies
    missing = document.items_of(
        ("Turn", f"by 90° or more about {one[-1]}, from rest to rest")
        if one.startswith("turn ")
        else ("Rest", f"with {one} up")
        for one in remedies
    )
    sections = (
        document.section("poses", "Poses: what is missing", poses_chart(result), missing),
        document.section("effect", "Before and after", rests_chart(result), turn_table(result)),
        document.section("bounds", "Errors and their bounds", bounds_chart(result), folded=True),
        document.section(
            "file",
            "Calibration file",
            document.Paragraph(
                "calibration.toml, for --calibration of the commands that read a log."
            ),
            document.paragraph(result.calibration_text(), "mono"),
            folded=True,
        ),
        document.section("method", "Method", document.listed(METHOD), folded=True),
        document.section("again", "Check this folder", *document.run_again(name)),
    )
    good = not any(f.severity == "warning" for f in result.findings)
    front = (
        document.Paragraph(headline(result), "lead" if good else "warning"),
        *(parameter_table(result), effect_table(result), field_table(result)),
        document.findings_list(result.findings, "cli") if result.findings else None,
    )
    links = [
        ("calibrate.json", "errors with their bounds, SI"),
        ("calibration.toml", "the calibration, for --calibration"),
    ]
    if found is not None and len(found.rests):
        links.append(("rests.csv", "rests with their residuals, SI"))
    facts = (("Procedure", result.procedure),)
    title = "Calibration of the sensor"
    return document.document_of(result.name, title, facts, front, sections, links=links)


def _map(up: np.ndarray[Any, Any]) -> tuple[float, float]:
    """Azimuth and elevation of a direction in the axes of the sensor, deg."""
    elevation = math.asin(max(-1.0, min(1.0, up[2])))
    return math.degrees(math.atan2(up[1], up[0])), math.degrees(elevation)


def poses_chart(result: CalibrateRun) -> Chart | None:
    """Return the directions that were up, and those that are missing."""
    found, still = result.calibration, _rests(result)
    if found is None or still is None:
        return None
    places = np.array([_map(u) for u in still[["up_x", "up_y", "up_z"]].to_numpy()]).reshape(-1, 2)
    lines = [dots("rest", places[:, 0], places[:, 1], AXIS_COLOURS[0], size=6.0)]
    if missing := [r for r in found.remedies if not r.startswith("turn")]:
        ups = [
            np.array([float(f"{s}1") if (s := _sign(r, a)) else 0.0 for a in XYZ]) for r in missing
        ]
        at = np.array([_map(u / np.linalg.norm(u)) for u in ups])
        labels = tuple(f"{r} up" for r in missing)
        points = dots("missing", at[:, 0], at[:, 1], AXIS_COLOURS[1], hollow=True, labels=labels)
        lines.append(points)
    panel = Panel("elevation of up above the xy plane, deg", tuple(lines))
    return Chart("poses", "What was up", "", "azimuth of up from x to y, deg", (panel,))


def _sign(text: str, axis: str) -> str:
    at = text.find(axis)
    return text[at - 1] if at > 0 else ""


def rests_chart(result: CalibrateRun) -> Chart | None:
    """Return force and vertical at each rest, before and after."""
    still = _rests(result)
    if still is None:
        return None
    x = np.arange(1, len(still) + 1)
    panels = []
    titles = ("Force at rest − gravity", "Vertical after the turn to it")
    for title, (_, unit, factor, names) in zip(titles, RESIDUALS, strict=True):
        before, after = (factor * still[n].to_numpy(dtype=np.float64) for n in names)
        if not np.isfinite(before).any():
            continue
        lines = (
            dots("before", x, before, AXIS_COLOURS[1], size=6.0, hollow=True),
            dots("after", x, after, AXIS_COLOURS[0], size=6.0),
        )
        panels.append(Panel(f"error, {unit}", lines, title=title, levels=(Level(0.0, ""),)))
    return Chart("rests", "Residuals at rests", "", "rest", tuple(panels)) if panels else None


def bounds_chart(result: CalibrateRun) -> Chart | None:
    """Return the standard deviation of each error as a share of the one before the calibration."""
    found = result.calibration
    if found is None:
        return None
    share = 100.0 * found.sd / found.prior_sd
    points = dots("error", np.arange(1, share.size + 1), share, AXIS_COLOURS[0], size=5.0)
    levels = (Level(50.0, "observed below"),)
    panel = Panel("standard deviation, % of that before", (points,), log=True, levels=levels)
    caption = ", ".join(f"{k + 1} {n.replace('_', ' ')}" for k, n in enumerate(found.names))
    return Chart("bounds", "How well each error is known", caption, "error", (panel,))


#: Page, JSON, calibration file and rests of a calibration.
CALIBRATE = bundle_by_specification(
    "calibrate", CalibrateSpec, run_calibrate, with_page(_write_data, calibrate_document)
)
