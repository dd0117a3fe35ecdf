"""Write a GNSS outage prediction as a sealed bundle: page, JSON, cone of the drift."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from strapdown.bundle import read_manifest, resolved, unsealed_changes, write_json
from strapdown.config.navigation import NavigationSpec
from strapdown.config.outage import OutageSpec
from strapdown.config.spec import specify
from strapdown.config.toml_file import read_toml
from strapdown.errors import ConfigError, DataError
from strapdown.formats import csv
from strapdown.navigation.outage import QUANTITIES, Forecast
from strapdown.report import outage_document as document
from strapdown.report.report_bundle import (
    ReportBundle,
    file_of,
    finite,
    with_file,
    with_page,
)
from strapdown.report.values import spaced
from strapdown.sensors.catalogue import SENSORS
from strapdown.systems.outage_run import OutageRun, run_outage


def read_run_of_outage(source: str | Path) -> tuple[NavigationSpec | None, Path | None]:
    """Return the navigation run that a source names; None for a sensor.

    Parameters
    ----------
    source : str or Path
        A folder written by ``strapdown navigate``, the configuration of a run, or a sensor.

    Returns
    -------
    tuple of (NavigationSpec or None, Path or None)
        The specification, and its configuration file, if there is one.

    Raises
    ------
    DataError
        The folder is of another command, or its inputs are missing or have changed.
    """
    path = Path(source)
    if str(source).lower() in SENSORS:
        return None, None
    if path.is_dir():
        return _of_bundle(path)
    if path.suffix.lower() == ".toml" and path.is_file():
        table = read_toml(path).table
        if {"log", "simulation", "live"} & set(table):
            return NavigationSpec.read(path), path
    elif path.is_file():
        raise ConfigError("report.log-not-run-navigation", file=path.name, quantity="SENSOR|BUNDLE")
    elif path.suffix.lower() != ".toml":
        raise ConfigError(
            "report.no-sensor-catalogue-no-folder",
            quantity="SENSOR|BUNDLE",
            source=source,
            word=str(source).lower(),
            known=SENSORS,
        )
    return None, None


def _of_bundle(path: Path) -> tuple[NavigationSpec, Path | None]:
    root = path.absolute()
    manifest = read_manifest(root)
    if manifest["command"] != "navigate":
        raise DataError(
            "report.folder-strapdown-no-run-navigation",
            file=path.name,
            quantity="SENSOR|BUNDLE",
            manifest=manifest["command"],
        )
    for item in manifest["inputs"]:
        if not (root / item["name"]).is_file():
            raise DataError("report.made-not-any-more", file=path.name, item=item["name"])
    inputs = {item["name"] for item in manifest["inputs"]}
    changed = [c for c in unsealed_changes(root, manifest) if c.file in inputs]
    if changed:
        raise DataError("report.made-changed-since", file=path.name, changed=changed[0].text())
    configuration = resolved(manifest["configuration"], root)
    file = configuration.get("file_path")
    spec = NavigationSpec.checked(configuration["navigation"])
    return spec, None if file is None else Path(file)


def _configuration(result: OutageRun) -> dict[str, Any]:
    beside = {} if result.navigation is None else {"navigation": result.navigation.plain()}
    return with_file({"outage": result.spec.plain(), **beside}, result)


def _run(configuration: dict[str, Any]) -> OutageRun:
    table = configuration.get("navigation")
    navigation = None if table is None else NavigationSpec.checked(table)
    spec = specify(OutageSpec, **configuration["outage"])
    return run_outage(spec, navigation, file_of(configuration))


def _write_data(result: OutageRun, folder: Path) -> None:
    write_json(folder / "outage.json", outage_json(result))
    write_outage_tables(result, folder)


#: Page, JSON and cone of the drift of an outage prediction.
OUTAGE = ReportBundle(
    "outage", _configuration, _run, with_page(_write_data, document.outage_document)
)


# JSON and tables of an outage prediction.


#: Names with units, and factors from SI.
SHOWN = {
    "horizontal": ("horizontal_sd_m", 1.0),
    "along": ("along_sd_m", 1.0),
    "across": ("across_sd_m", 1.0),
    "vertical": ("vertical_sd_m", 1.0),
    "speed": ("speed_sd_m_per_s", 1.0),
    "heading": ("heading_sd_deg", math.degrees(1.0)),
}


def outage_json(result: OutageRun) -> dict[str, Any]:
    """Return an outage prediction as plain data for programs.

    Returns
    -------
    dict
        Lengths in m, times in s, angles in deg; sizes of error sources in SI.
    """
    parts = outage_parts(result)
    return finite({key: part() if callable(part) else part for key, part in parts.items()})


def outage_parts(result: OutageRun) -> dict[str, Any]:
    """As `outage_json`, whose parts that need the budget are functions."""
    predicted, variances = result.forecast, result.cone[2]
    whole = {q: float(v[-1]) for q, v in variances.items()}
    parts = {
        "name": result.name,
        "what": result.what,
        "answer": spaced(document.headline(result)),
        "remedy": lambda: spaced(document.remedy(result)),
        "outage_s": result.spec.outage_s,
        "start": spaced(document.start_words(result)),
        "begin_s": predicted.begin,
        "remaining_measurements": list(result.stays),
        "at_the_end": {
            "horizontal_95_m": document.end_bound(result),
            **{SHOWN[q][0]: SHOWN[q][1] * math.sqrt(max(v, 0.0)) for q, v in whole.items()},
        },
        "budget": lambda: _budget(predicted),
        "outages": {
            "tried": len(result.drifts),
            "equal_length": len(result.equal),
            "fixes_to_the_end": sum(d.to_end for d in result.equal),
            "rejected_fixes": sum(d.rejected for d in result.drifts),
        },
        "probability": None if result.verdict is None else result.verdict.probability,
        "measured": spaced(document.inside_words(result)),
        "drifts": [
            {
                "begin_s": d.span.begin,
                "end_s": d.span.end,
                "since_fix_s": d.since_fix,
                "equal_length": d in result.equal,
                "fixes": len(d.time),
                "rejected_fixes": d.rejected,
                "last_fix_s": d.span.begin + float(d.time[-1]),
                "drift_m": float(d.horizontal[-1]),
                "along_m": float(d.along[-1]),
                "across_m": float(d.across[-1]),
                "down_m": float(d.down[-1]),
                "predicted_95_m": float(d.bound[-1]),
                "inside_95": float(d.inside.mean()),
            }
            for d in document.drifts_of(result.drifts)
        ],
        "findings": [f.plain("file") for f in result.findings],
    }
    return finite(parts)


def _budget(predicted: Forecast) -> dict[str, Any]:
    return {
        "outage_from_s": predicted.begin,
        "horizontal_sd_m": float(math.sqrt(predicted.variance("horizontal")[-1])),
        "sources": [
            {
                "source": one.source.name,
                "sd_at_start": one.sd.tolist(),
                "unit": one.source.unit,
                "share": {
                    q: one.variance[q][-1] / _positive(predicted.variance(q)[-1])
                    for q in QUANTITIES
                },
                "alone_m": float(one.alone["horizontal"][-1]),
            }
            for one in predicted.shares
        ],
        "measurements": {
            q: v[-1] / _positive(predicted.variance(q)[-1]) for q, v in predicted.aids.items()
        },
    }


def write_outage_tables(result: OutageRun, folder: Path) -> None:
    """Write the cone, its error budget over time, and the observed drifts.

    Parameters
    ----------
    folder : Path
        ``cone.csv``, ``budget.csv``, and ``drifts.csv`` if there were fixes.
    """
    comments = {"outage_of": result.name, "outage_s": f"{result.spec.outage_s:g}"}
    time, bound, variances = result.cone
    sds = {SHOWN[q][0]: SHOWN[q][1] * np.sqrt(np.maximum(v, 0.0)) for q, v in variances.items()}
    csv.write(folder / "cone.csv", {"time_s": time, "horizontal_95_m": bound, **sds}, comments)
    predicted = result.forecast
    parts = {
        f"{one.source.name.replace('.', '_')}_m2": one.variance["horizontal"]
        for one in predicted.shares
    }
    if predicted.aids:
        parts["measurements_m2"] = predicted.aids["horizontal"]
    parts["all_m2"] = predicted.variance("horizontal")
    of = {
        **comments,
        "of": "variance of the horizontal drift",
        "outage_from_s": f"{predicted.begin:.9g}",
    }
    csv.write(folder / "budget.csv", {"time_s": predicted.time, **parts}, of)
    drifts = document.drifts_of(result.drifts)
    if drifts:
        columns = {
            "outage_from_s": np.concatenate([np.full(len(d.time), d.span.begin) for d in drifts]),
            "time_s": np.concatenate([d.time for d in drifts]),
            "along_m": np.concatenate([d.along for d in drifts]),
            "across_m": np.concatenate([d.across for d in drifts]),
            "down_m": np.concatenate([d.down for d in drifts]),
            "inside_95": np.concatenate([d.inside.astype(np.float64) for d in drifts]),
        }
        csv.write(folder / "drifts.csv", columns, {**comments, "sign": "computed minus fix"})


def _positive(value: float) -> float:
    return float(value) if value > 0.0 else math.inf
