"""The sealed folder of a run with its report: written, and run again from its configuration."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import numpy as np
import pandas as pd

from strapdown.bundle import InputFiles, Seal, write_bundle
from strapdown.formats import csv
from strapdown.progress import Progress, silent
from strapdown.systems.one_thread import one_thread
from strapdown.tables import EULER
from strapdown.tables.checks import index_of

if TYPE_CHECKING:
    from strapdown.alignment.alignment import Alignment
    from strapdown.config.reading import FileSpec
    from strapdown.report.document import Document


class Ran(Protocol):
    """A completed run."""

    @property
    def inputs(self) -> Sequence[InputFiles]:
        """Input files with their roles."""


class Specified(Ran, Protocol):
    """A run that its specification alone makes."""

    @property
    def spec(self) -> FileSpec:
        """What it was made by."""


R = TypeVar("R", bound=Ran)
M = TypeVar("M", bound=Specified)
F = TypeVar("F", bound="FileSpec")
T = TypeVar("T")
WriteFiles = Callable[[R, Path, str, tuple[str, ...], Progress], None]


def with_page(
    write_data: Callable[[R, Path], None],
    document: Callable[[R, str], Document],
    *,
    figures: bool = True,
) -> WriteFiles[R]:
    """Return how the data of a run and its page are written, as `ReportBundle.write_files`.

    `document`: of a run, with the name that it shows. `figures`: whether the drawings of the page
    are files, too.
    """

    def write_files(
        result: R, folder: Path, name: str, forms: tuple[str, ...], progress: Progress
    ) -> None:
        write_data(result, folder)
        if forms:
            from strapdown.report.document_html import write_report

            write_report(document(result, name), folder, progress, figures=figures)

    return write_files


@dataclass(frozen=True)
class ReportBundle(Generic[R]):
    """How the runs of one command are sealed.

    `configuration`: from a run to its sealed configuration. `run`: from a sealed configuration to
    the run. `write_files`: writes the files of a run into a folder. Takes the run, the folder, the
    name shown in the report, the forms of the report (``html``, ``pdf``; none for the data alone),
    and progress. `pdf`: whether the report is a PDF, too, where typst is installed. `prepared`:
    from a run, and whether it has a report, to a context in which the run has further inputs.
    """

    command: str
    configuration: Callable[[R], dict[str, Any]]
    run: Callable[[dict[str, Any]], R]
    write_files: WriteFiles[R]
    pdf: bool = False
    prepared: Callable[[R, bool], AbstractContextManager[R]] = lambda run, _: nullcontext(run)

    @one_thread()
    def write(
        self,
        result: R,
        out: str | Path,
        *,
        name: str | None = None,
        report: bool = True,
        pdf: bool | None = None,
        force: bool = False,
        progress: Progress = silent,
    ) -> Seal:
        """Write a run as a sealed bundle, whole or not at all.

        Parameters
        ----------
        result : object
        out : str or Path
            Folder to create.
        name : str, optional
            Folder name shown in the report; by default that of `out`.
        report : bool
            Whether to write pages and figures; recorded in the seal if not.
        pdf : bool, optional
            Whether to write the PDF of a report that has one; by default where typst is installed,
            and recorded in the seal if not.
        force : bool
            Overwrite an existing bundle.
        progress : callable, optional

        Raises
        ------
        ConfigError
            `out` exists and may not be replaced, or `pdf` is wanted and typst is not installed.
        """
        forms: tuple[str, ...] = ("html",) if report else ()
        left_out = {} if report else {"report": False}
        if report and self.pdf:
            from strapdown.report.document_pdf import can_lay_out

            if can_lay_out() if pdf is None else pdf:
                forms = ("html", "pdf")
            else:
                left_out = {"pdf": False}
        name = Path(out).absolute().name if name is None else name
        seals: list[Seal] = []
        with (
            self.prepared(result, report) as run,
            write_bundle(
                Path(out),
                command=self.command,
                configuration={"name": name, **self.configuration(run), **left_out},
                inputs=run.inputs,
                force=force,
                seals=seals,
            ) as folder,
        ):
            progress("writing the tables", 0.8)
            self.write_files(run, folder, name, forms, progress)
            progress("sealing", 0.97)
        return seals[0]

    def rerun(self, configuration: dict[str, Any], out: Path) -> Seal:
        """Re-run a sealed bundle from its configuration, with its report as it was."""
        report, pdf = (bool(configuration.get(key, True)) for key in ("report", "pdf"))
        if report and pdf and self.pdf:
            from strapdown.report.document_pdf import typst_library

            typst_library()  # before the run, as its PDF is to be compared
        name = str(configuration["name"])
        return self.write(self.run(configuration), out, name=name, report=report, pdf=pdf)


def bundle_by_specification(
    command: str, form: type[F], run: Callable[[F], M], write_files: WriteFiles[M]
) -> ReportBundle[M]:
    """Return how runs that a specification of a form makes are sealed: by it, under the command."""
    return ReportBundle(
        command,
        lambda result: {command: result.spec.plain()},
        lambda configuration: run(form.checked(configuration[command])),
        write_files,
    )


def file_of(configuration: dict[str, Any], key: str = "file_path") -> Path | None:
    """Return the configuration file of a sealed run, if it had one."""
    path = configuration.get(key)
    return None if path is None else Path(path)


def with_file(
    configuration: dict[str, Any], result: Ran, role: str = "configuration", key: str = "file_path"
) -> dict[str, Any]:
    """Return a configuration with the path of its own file among the inputs, if it had one."""
    file = next((str(i.path) for i in result.inputs if i.role == role), None)
    return configuration if file is None else {**configuration, key: file}


def write_table(table: pd.DataFrame, path: Path, comments: dict[str, str]) -> None:
    """Write a table over time as CSV, with shortest round-trip numbers and comments on top."""
    columns = {str(c): table[c].to_numpy() for c in table.columns}
    csv.write(path, {"time_s": index_of(table), **columns}, comments)


def as_comments(rows: Iterable[tuple[str, str]]) -> dict[str, str]:
    """Return named texts, such as conventions, as comments of a table or keys of a JSON."""
    return {name.lower().replace(" ", "_"): text for name, text in rows}


def alignment_data(one: Alignment) -> dict[str, Any]:
    """Method, instant, angles and their standard deviations of an alignment, deg, as plain data."""
    angles, sd = one.roll_pitch_heading, one.sd_deg
    return {
        "method": one.method,
        "time_s": one.time,
        **{f"{a}_deg": float(angles[k]) for k, a in enumerate(EULER)},
        **{f"{a}_sd_deg": float(sd[k]) for k, a in enumerate(EULER)},
    }


def finite(value: T) -> T:
    """Return plain data for JSON, which has no NaN and no infinity: these are null."""
    made: Any = value.item() if isinstance(value, np.generic) else value
    if isinstance(made, dict):
        made = {str(key): finite(item) for key, item in made.items()}
    elif isinstance(made, list | tuple):
        made = [finite(item) for item in made]
    elif isinstance(made, float) and not math.isfinite(made):
        made = None
    return made  # type: ignore[no-any-return]
