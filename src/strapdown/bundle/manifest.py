"""Make the manifest of a bundle, and keep the inputs that it names."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from strapdown.bundle.configuration_paths import with_paths
from strapdown.bundle.environment import machine, versions
from strapdown.bundle.seal import SCHEMA, UNSEALED, files_of, sha256
from strapdown.errors import DataError
from strapdown.results.inputs import InputFiles

__all__ = ["make_manifest"]

# Inputs up to this size together are copied into the bundle, which then stands on its own.
COPY_LIMIT = 64 * 1024 * 1024  # bytes


def make_manifest(
    folder: Path, command: str, configuration: dict[str, Any], inputs: Sequence[InputFiles]
) -> dict[str, Any]:
    """Make the manifest of a finished folder, and copy its inputs into it.

    Parameters
    ----------
    folder : Path
        What is in it are the outputs.
    command, configuration, inputs
        As for `write_bundle`.

    Returns
    -------
    dict

    Raises
    ------
    DataError
        An input has changed since it was read.
    """
    outputs = [
        {"name": name, "sha256": sha256(folder / name), "bytes": (folder / name).stat().st_size}
        for name in files_of(folder)
        if name not in UNSEALED
    ]
    for item in inputs:
        for file, digest in zip(item.files, item.digests, strict=True):
            _refuse_changed(file, digest)
    kept, moved = _keep(folder, inputs)
    return {
        "schema": SCHEMA,
        "command": command,
        "configuration": with_paths(configuration, lambda path: moved.get(path, path)),
        "inputs": kept,
        "outputs": outputs,
        "versions": versions(),
        "platform": machine(),
    }


def _refuse_changed(file: Path, digest: str) -> None:
    if not file.is_file() or sha256(file) != digest:
        raise DataError("bundle.input-changed", file=file.name)


def _keep(
    folder: Path, inputs: Sequence[InputFiles]
) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """Copy the inputs, or refer to them: their lines in the manifest, and where each is now."""
    small = sum(f.stat().st_size for i in inputs for f in i.files) <= COPY_LIMIT
    kept: list[dict[str, Any]] = []
    moved: dict[str, str] = {}
    places: dict[Path, Path] = {}
    names: set[Path] = set()
    for item in inputs:
        copy = small or item.copied
        place = _place(item, places)
        if place in places and not item.path.is_dir():
            continue
        places[place] = item.path
        for file, digest in zip(item.files, item.digests, strict=True):
            name = place / file.relative_to(item.path) if item.path.is_dir() else place
            if name in names:
                continue
            names.add(name)
            if copy:
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(file, folder / name)
            kept.append(
                {
                    "role": item.role,
                    "name": name.as_posix() if copy else str(file.resolve()),
                    "kept": "copy" if copy else "reference",
                    "sha256": digest,
                    "bytes": file.stat().st_size,
                }
            )
        moved[str(item.path)] = place.as_posix() if copy else str(item.path.resolve())
    return kept, moved


def _place(item: InputFiles, places: dict[Path, Path]) -> Path:
    """A place of its own for each path; the same for a path that has one."""
    # What two roles took of one folder stands in one: a path is of one place.
    first = next((p for p, path in places.items() if path == item.path), None)
    if first is not None and item.path.is_dir():
        return first
    # The name that was given; a link's target may have lost its ending.
    own = item.path.name or item.path.resolve().name
    place = Path("inputs") / item.role / own
    # Several logs may have one name, and one file may have been read for each of them.
    number = 2
    while places.get(place, item.path) != item.path:
        place = Path("inputs") / f"{item.role}-{number}" / own
        number += 1
    return place
