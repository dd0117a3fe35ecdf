"""Write a navigation run as a sealed bundle: page, JSON, tables, paths for maps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from strapdown.bundle.seal import Seal, to_json
from strapdown.config.navigation_file import navigation_spec
from strapdown.report.document_data import draw_stills
from strapdown.report.document_files import write_drawings, write_text
from strapdown.report.document_html import document_page
from strapdown.report.navigation_document import navigation_document
from strapdown.report.navigation_found import examine, told_of
from strapdown.report.navigation_json import navigation_json, write_navigation_files
from strapdown.report.report_bundle import report_bundle
from strapdown.report.verdict_document import light_section
from strapdown.report.verdict_files import write_verdict
from strapdown.systems.one_thread import one_thread
from strapdown.systems.progress import Progress, silent
from strapdown.systems.sins.run import NavigationResult, run_navigation

__all__ = ["rerun_navigation", "write_navigation"]


def rerun_navigation(configuration: dict[str, Any], out: Path, *, report: bool = True) -> Seal:
    """Re-run a sealed navigation run from its configuration, with or without its page."""
    spec = navigation_spec(configuration["navigation"])
    path = configuration.get("file_path")
    name = str(configuration["name"])
    return write_navigation(
        run_navigation(spec, None if path is None else Path(path)), out, name=name, report=report
    )


@one_thread()
def write_navigation(
    result: NavigationResult,
    out: str | Path,
    *,
    name: str | None = None,
    report: bool = True,
    force: bool = False,
    progress: Progress = silent,
) -> Seal:
    """Write a navigation run as a sealed bundle.

    Parameters
    ----------
    result : NavigationResult
    out : str or Path
        Folder to create.
    name : str, optional
        Folder name shown in the report; by default that of `out`.
    report : bool
        Whether to write the pages and the figures.
    force : bool
        Overwrite an existing bundle.
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
    seals: list[Seal] = []
    with report_bundle(
        result,
        out,
        "navigate",
        key="navigation",
        name=name,
        force=force,
        seals=seals,
        report=report,
    ) as folder:
        progress("writing the tables", 0.82)
        found = examine(told_of(result))
        write_text(folder / "navigation.json", to_json(navigation_json(result, found)))
        write_navigation_files(result, folder)
        if report:
            write_verdict(result, name, folder)
            progress("drawing the figures", 0.86)
            document = navigation_document(found.told, name, found, light_section(result))
            stills = draw_stills(document)
            if result.spec.output.figures:
                write_drawings(document, stills, folder / "figures")
            progress("writing the page", 0.95)
            write_text(folder / "report.html", document_page(document, stills=stills))
        progress("sealing", 0.97)
    return seals[0]
