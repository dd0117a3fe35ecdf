"""The sealed folder of a report, with the inputs needed to re-run it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

import pandas as pd

from strapdown.bundle.seal import InputFiles, Seal
from strapdown.bundle.writing import write_bundle
from strapdown.config.spec import Spec
from strapdown.formats import csv


class Ran(Protocol):
    """A completed run with its specification and input files."""

    @property
    def spec(self) -> Spec:
        """The specification as read."""

    @property
    def inputs(self) -> Sequence[InputFiles]:
        """Input files with their roles."""


@contextmanager
def report_bundle(
    result: Ran,
    out: str | Path,
    command: str,
    *,
    key: str,
    name: str,
    force: bool,
    seals: list[Seal],
    role: str = "configuration",
    path_key: str = "file_path",
    beside: Mapping[str, Spec] | None = None,
    report: bool = True,
) -> Iterator[Path]:
    """Write the bundle of a report, whole or not at all; as `write_bundle`.

    Parameters
    ----------
    result : Ran
    out : str or Path
        Folder to create.
    command : str
        Command that can re-run it.
    key, path_key : str
        Keys of the specification, and of the path of its file, in the sealed configuration.
    name : str
        Folder name shown in the report.
    force : bool
        Overwrite an existing bundle.
    seals : list of Seal
        The seal is appended when the bundle is complete.
    role : str
        Role of the specification's file among the inputs.
    beside : mapping of str to Spec, optional
        Further specifications of the run, by their keys in the sealed configuration.
    report : bool
        Whether it has its pages and figures; recorded in the seal if not.

    Yields
    ------
    Path
        An empty folder.

    Raises
    ------
    ConfigError
        `out` exists and may not be replaced.
    """
    file = next((str(i.path) for i in result.inputs if i.role == role), None)
    configuration = {
        "name": name,
        key: result.spec.plain(),
        **{name: spec.plain() for name, spec in (beside or {}).items()},
        **({} if file is None else {path_key: file}),
        **({} if report else {"report": False}),
    }
    with write_bundle(
        Path(out),
        command=command,
        configuration=configuration,
        inputs=result.inputs,
        force=force,
        seals=seals,
    ) as folder:
        yield folder


def write_table(table: pd.DataFrame, path: Path, comments: dict[str, str]) -> None:
    """Write a table as CSV with shortest round-trip numbers.

    Parameters
    ----------
    table : DataFrame
    path : Path
    comments : dict of str to str
        Written at the top.
    """
    csv.write(path, {str(c): table[c].to_numpy() for c in table.columns}, comments)
