"""Results in the studio: what a sealed folder holds, as numbers, series, track and downloads."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from strapdown.bundle import MANIFEST, SIGNATURE_FILE, UNSEALED, read_manifest, sha256
from strapdown.errors import ConfigError
from strapdown.studio.folder import Folder, plain_name

__all__ = ["file_of_run", "summary"]

#: Largest manifest that is read, bytes.
LARGEST = 50_000_000


def summary(folder: Path, name: str) -> dict[str, Any]:
    """Return what the list of results shows of one: command, title, digest, instant, verdict."""
    place = folder / name
    manifest = read_manifest(place)
    about = (place / MANIFEST).stat()
    return {
        "name": name,
        "command": str(manifest["command"]),
        "title": _title(manifest, name),
        "made": about.st_mtime,
        "digest": sha256(place / MANIFEST),
        "verdict": None,
    }


def _title(manifest: Mapping[str, Any], name: str) -> str:
    return name


def file_of_run(folder: Path, name: str, path: str) -> Path:
    """Return a file of a result that its manifest lists, or that stands beside the seal.

    ConfigError: there is none, or the path leads elsewhere.
    """
    place = Folder(folder).file(name)
    manifest = read_manifest(place)
    listed = {str(one["name"]) for one in manifest["outputs"]}
    listed |= {str(one["name"]) for one in manifest["inputs"] if one.get("kept") == "copy"}
    own = path in UNSEALED or path == MANIFEST or SIGNATURE_FILE.fullmatch(path) is not None
    if path not in listed and not own:
        raise ConfigError("studio.no-such-file", file=path[:80])
    # A manifest is data: what it lists must be in the folder, too.
    try:
        found = (place / path).resolve(strict=True)
    except (OSError, ValueError, RuntimeError):
        raise ConfigError("studio.no-such-file", file=path[:80]) from None
    if not found.is_relative_to(place.resolve()) or not found.is_file():
        raise ConfigError("studio.no-such-file", file=path[:80])
    return found
