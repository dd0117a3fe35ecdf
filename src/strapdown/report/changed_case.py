"""Which options of a sealed crash case are not those of the case file that lies beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from strapdown.bundle.configuration_paths import names_file
from strapdown.config.changed_options import changed_options
from strapdown.config.crash_case_file import read_case_spec
from strapdown.errors import StrapdownError

__all__ = ["changed_case"]


def changed_case(root: Path, manifest: dict[str, Any]) -> list[str]:
    """Name the options in which a bundle's case file and its sealed configuration differ.

    Parameters
    ----------
    root : Path
        The bundle.
    manifest : dict
        From `read_manifest`.

    Returns
    -------
    list of str
        One sentence an option, with the sealed value first; empty where both say the same, or
        where the bundle is of no crash.
    """
    configuration = manifest["configuration"]
    if manifest["command"] != "crash" or not isinstance(configuration, dict):
        return []
    name = configuration.get("case_path")
    if not isinstance(name, str):
        return []
    path = root / name
    if not path.is_file():
        return []
    try:
        told = read_case_spec(path, files=False).model_dump(mode="json", exclude_none=True)
    except StrapdownError as error:
        return [f"{name}: it is no case any more: {error.finding.what}"]
    told.pop("name", None)
    sealed = {k: v for k, v in configuration.get("case", {}).items() if k != "name"}
    return [f"{name}: {what}" for what in changed_options(_told(sealed), _told(told))]


def _told(value: Any) -> Any:
    """Without the names of files, which are others in a bundle."""
    if isinstance(value, dict):
        return {k: _told(v) for k, v in value.items() if not names_file(k, v)}
    if isinstance(value, list):
        return [_told(v) for v in value]
    return value
