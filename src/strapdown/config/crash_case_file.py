"""Read a crash case from its file."""

from __future__ import annotations

from pathlib import Path

from pydantic import ValidationError

from strapdown.config.case_keys import canonical
from strapdown.config.case_paths import with_absolute_paths
from strapdown.config.crash_case import CaseSpec
from strapdown.config.crash_checks import Written, check_case
from strapdown.config.filled_form import explained, refuse_placeholders
from strapdown.config.toml_file import read_toml
from strapdown.config.wanted import what_to_write

__all__ = ["read_case_spec"]


def read_case_spec(path: str | Path, *, files: bool = True) -> CaseSpec:
    """Read the file of a crash case.

    Parameters
    ----------
    path : str or Path
    files : bool
        Whether the files that it names must exist and become absolute paths; otherwise only the
        form is checked.

    Returns
    -------
    CaseSpec
        Named after the file; every quantity in the unit of its field, every file name as an
        absolute path, resolved from the folder of the case.

    Raises
    ------
    ConfigError
        The file is missing or not TOML; a key is unknown, missing or still ``"?"``; a value does
        not fit, or two are contradictory. The message names the line, or both lines.
    """
    path = Path(path)
    file = read_toml(path)
    if "name" in file.table:
        raise file.refuse(("name",), "config.named-after-file", kind="case")
    refuse_placeholders(file)
    table, written = canonical(file, CaseSpec)
    try:
        spec = CaseSpec(**{**table, "name": path.stem})
        if files:
            spec = CaseSpec(**with_absolute_paths(file, spec.model_dump()))
    except ValidationError as error:
        raise explained(error.errors()[0], file, written=written, wanted=what_to_write) from None
    if files:
        check_case(spec, Written(file, written))
    return spec
