"""Write a crash case as a sealed bundle: page, PDF, JSON, tables and figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from strapdown.bundle.seal import Seal, to_json
from strapdown.config.crash_case import CaseSpec
from strapdown.crash.case import CaseResult, run_case
from strapdown.formats.crash_writers import write_mme
from strapdown.progress import Progress, silent
from strapdown.report.crash_document import crash_document
from strapdown.report.crash_figures import crash_figures
from strapdown.report.crash_json import (
    crash_json,
    signal_record,
    signals_table,
    trajectory_table,
    write_table,
)
from strapdown.report.crash_limits import CONVENTIONS
from strapdown.report.document_data import draw_stills
from strapdown.report.document_files import write_drawings, write_text
from strapdown.report.document_html import document_page
from strapdown.report.document_pdf import write_pdf
from strapdown.report.report_bundle import report_bundle
from strapdown.systems.one_thread import one_thread

__all__ = ["file_name", "rerun_crash", "write_crash"]


def rerun_crash(configuration: dict[str, Any], out: Path, *, report: bool = True) -> Seal:
    """Re-run a sealed case from its configuration, with or without its report."""
    spec = CaseSpec.model_validate(configuration["case"])
    path = configuration.get("case_path")
    name = str(configuration["name"])
    result = run_case(spec, None if path is None else Path(path))
    return write_crash(result, out, name=name, report=report)


@one_thread()
def write_crash(
    result: CaseResult,
    out: str | Path,
    *,
    name: str | None = None,
    report: bool = True,
    force: bool = False,
    progress: Progress = silent,
) -> Seal:
    """Write the report of a case as a sealed bundle.

    Parameters
    ----------
    result : CaseResult
    out : str or Path
        Folder to create.
    name : str, optional
        Folder name shown in the report; by default that of `out`.
    report : bool
        Whether to write page, PDF and figures.
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
        "crash",
        key="case",
        name=name,
        force=force,
        seals=seals,
        role="case",
        path_key="case_path",
        report=report,
    ) as folder:
        _write_numbers(result, folder)
        if report:
            progress("drawing the report", 0.55)
            document = crash_document(result, crash_figures(result), name)
            progress("drawing the figures", 0.65)
            stills = draw_stills(document)
            write_drawings(document, stills, folder / "figures")
            progress("writing the page", 0.85)
            write_text(folder / "report.html", document_page(document, stills=stills))
            progress("setting the PDF", 0.9)
            write_pdf(document, folder / "report.pdf", stills=stills)
    return seals[0]


def _write_numbers(result: CaseResult, folder: Path) -> None:
    write_text(folder / "crash.json", to_json(crash_json(result)))
    told = {key.lower().replace(" ", "_"): text for key, text in CONVENTIONS}
    main = result.reconstruction.main
    write_table(trajectory_table(main.path), folder / "trajectory.csv", told)
    answers, formats = result.reconstruction.answers, result.spec.options.formats
    made: set[str] = set()
    for unit in answers if "csv" in formats else ():
        own = file_name(unit.name, made)
        write_table(signals_table(unit), folder / f"signals-{own}.csv", told)
    if "mme" in formats:
        spec = result.spec
        record = signal_record(spec.title, spec.point.name, answers, spec.options.rate_hz)
        write_mme(folder / "mme", record)


def file_name(name: str, made: set[str]) -> str:
    """Return a valid file name that differs from those already made.

    Parameters
    ----------
    name : str
    made : set of str
        The new name is added.
    """
    plain = "".join(c if c.isascii() and c.isalnum() else "-" for c in name.lower()).strip("-")
    plain = plain[:60] or "recorder"
    own, number = plain, 2
    while own in made:
        own, number = f"{plain}-{number}", number + 1
    made.add(own)
    return own
