"""The copy of a case in a sealed folder: where the folder keeps what the case names."""

from __future__ import annotations

import json
from pathlib import Path, PurePosixPath
from typing import Any

from strapdown.config.toml_lines import KeyPath

__all__ = ["beside_sealed_case"]

# A manifest of hundreds of records is shorter.
LARGEST = 50_000_000


def beside_sealed_case(case: Path, key: KeyPath, given: str) -> Path | None:
    """Find the copy of a file that a case names, where the case is itself a copy.

    Parameters
    ----------
    case : Path
        As ``FOLDER/inputs/case/case.toml``.
    key : tuple
        Of the value in the case.
    given : str
        The value.

    Returns
    -------
    Path or None
        None where the case stands in no sealed folder, or the folder keeps no copy under this key
        with this last name.
    """
    home = case.absolute().parent
    if home.parent.name != "inputs":
        return None
    root = home.parent.parent
    manifest = root / "manifest.json"
    try:
        if not manifest.is_file() or manifest.stat().st_size > LARGEST:
            return None
        node: Any = json.loads(manifest.read_text(encoding="utf-8"))["configuration"]["case"]
        for step in key:
            node = node[step]
        if not isinstance(node, str):
            return None
        kept = (root / node).resolve()
        if not kept.is_relative_to((root / "inputs").resolve()) or not kept.exists():
            return None
    except (OSError, ValueError, KeyError, IndexError, TypeError, RecursionError):
        return None
    # A case that was changed may name another record under this key.
    named = PurePosixPath(given.replace("\\", "/")).name
    return kept if kept.name in (named, PurePosixPath(given).parent.name) else None
