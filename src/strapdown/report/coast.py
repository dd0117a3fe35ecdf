"""A forecast of coasting as files: page, JSON, cone, sealed in a bundle."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from strapdown.bundle.configuration_paths import resolved
from strapdown.bundle.json_text import to_json
from strapdown.bundle.reading import read_manifest, unsealed_changes
from strapdown.bundle.seal import Seal
from strapdown.config.coast import coast_spec
from strapdown.config.navigation import NavigationSpec
from strapdown.config.navigation_file import navigation_spec, read_navigation_spec
from strapdown.config.toml_file import read_toml
from strapdown.errors import ConfigError, DataError
from strapdown.report.coast_document import coast_document
from strapdown.report.coast_json import coast_json, write_coast_tables
from strapdown.report.document_data import draw_stills
from strapdown.report.document_files import write_drawings, write_text
from strapdown.report.document_html import document_page
from strapdown.report.report_bundle import report_bundle
from strapdown.sensors.catalogue import SENSORS
from strapdown.systems.coasting.run import CoastResult, run_coast
from strapdown.systems.one_thread import one_thread
from strapdown.systems.progress import Progress, silent

__all__ = ["read_coasting_run", "rerun_coast", "write_coast"]


def read_coasting_run(source: str | Path) -> tuple[NavigationSpec | None, Path | None]:
    """Return the run of navigation that a source names; nothing of a sensor.

    Parameters
    ----------
    source : str or Path
        A folder that ``strapdown navigate`` wrote, the configuration of a run, or a sensor.

    Returns
    -------
    spec : NavigationSpec or None
    file : Path or None
        Its configuration, where it is a file.

    Raises
    ------
    DataError
        The folder is of another command, or what it read is not there any more, or has changed.
    """
    path = Path(source)
    if str(source).lower() in SENSORS:
        return None, None
    if path.is_dir():
        return _of_bundle(path)
    if path.suffix.lower() == ".toml" and path.is_file():
        table = read_toml(path).table
        if {"log", "simulation", "live"} & set(table):
            return read_navigation_spec(path), path
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
    changed = [
        c
        for c in unsealed_changes(root, manifest)
        if any(c.startswith(item["name"]) for item in manifest["inputs"])
    ]
    if changed:
        raise DataError("report.made-changed-since", file=path.name, changed=changed[0])
    configuration = resolved(manifest["configuration"], root)
    file = configuration.get("file_path")
    spec = navigation_spec(configuration["navigation"])
    return spec, None if file is None else Path(file)


def rerun_coast(configuration: dict[str, Any], out: Path, *, report: bool = True) -> Seal:
    """Run a sealed forecast again from its configuration, with or without its page."""
    table = configuration.get("navigation")
    navigation = None if table is None else navigation_spec(table)
    path = configuration.get("file_path")
    result = run_coast(
        coast_spec(configuration["coast"]), navigation, None if path is None else Path(path)
    )
    return write_coast(result, out, name=str(configuration["name"]), report=report)


@one_thread()
def write_coast(
    result: CoastResult,
    out: str | Path,
    *,
    name: str | None = None,
    report: bool = True,
    force: bool = False,
    progress: Progress = silent,
) -> Seal:
    """Write a forecast of coasting as a sealed bundle.

    Parameters
    ----------
    result : CoastResult
    out : str or Path
        Folder to make.
    name : str, optional
        Of the folder, as the report names it; that of `out`, if not given.
    report : bool
        Whether the page and the figures are written, too.
    force : bool
        Replace a bundle that is there.
    progress : callable, optional

    Returns
    -------
    Seal

    Raises
    ------
    ConfigError
        `out` exists and may not be replaced.
    """
    name = Path(out).absolute().name if name is None else name
    beside = {} if result.navigation is None else {"navigation": result.navigation}
    seals: list[Seal] = []
    with report_bundle(
        result,
        out,
        "coast",
        key="coast",
        name=name,
        force=force,
        seals=seals,
        beside=beside,
        report=report,
    ) as folder:
        progress("writing the tables", 0.78)
        write_text(folder / "coast.json", to_json(coast_json(result)))
        write_coast_tables(result, folder)
        if report:
            progress("drawing the figures", 0.8)
            document = coast_document(result, name)
            stills = draw_stills(document)
            write_drawings(document, stills, folder / "figures")
            progress("writing the page", 0.95)
            write_text(folder / "report.html", document_page(document, stills=stills))
    return seals[0]
