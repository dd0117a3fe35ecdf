"""The sealed folder of a report, with what makes its run again."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

from strapdown.bundle.seal import Seal
from strapdown.bundle.writing import write_bundle
from strapdown.config.spec import Spec
from strapdown.results.inputs import InputFiles

__all__ = ["report_bundle"]


class Ran(Protocol):
    """What was run: by which specification, from which files."""

    @property
    def spec(self) -> Spec:
        """As it was read."""

    @property
    def inputs(self) -> Sequence[InputFiles]:
        """Each with its role."""


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
        Folder to make.
    command : str
        Which command can run it again.
    key, path_key : str
        Where the specification stands in what is sealed, and where the path of its file.
    name : str
        Of the folder, as the report names it.
    force : bool
        Replace a bundle that is there.
    seals : list of Seal
        The seal is appended when the bundle stands.
    role : str
        Of the file that the specification was read from, among the inputs.
    beside : mapping of str to Spec, optional
        Further specifications that were run, by where they stand in what is sealed.
    report : bool
        Whether it has its pages and figures; sealed where it has not.

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
