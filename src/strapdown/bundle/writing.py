"""Write a bundle atomically."""

from __future__ import annotations

import functools
import hashlib
import platform
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from secrets import token_hex
from typing import Any

from strapdown.bundle.configuration_paths import with_paths
from strapdown.bundle.seal import (
    MANIFEST,
    SCHEMA,
    UNSEALED,
    InputFiles,
    Seal,
    check_destination,
    files_of,
    sha256,
    write_json,
)
from strapdown.errors import DataError


@contextmanager
def write_bundle(
    out: Path,
    *,
    command: str,
    configuration: dict[str, Any],
    inputs: Sequence[InputFiles] = (),
    force: bool = False,
    seals: list[Seal],
) -> Iterator[Path]:
    """Write a bundle atomically.

    `out`: folder to create. An existing one is replaced only if `force` is set and it is empty or a
    bundle itself. `command`: command that can repeat the run. `configuration`: the resolved
    configuration; paths of inputs are replaced by those in or from the bundle. `inputs`: copied if
    they total at most 64 MiB, otherwise referred to by path. `seals`: the seal is appended when the
    bundle is complete. Yields an empty folder; its content at the end of the block becomes the
    bundle. ConfigError: `out` exists and must not be replaced.
    """
    out = out.absolute()
    check_destination(out, force)
    made = [p for p in out.parents if not p.exists()]
    # Named before it is created: an interrupt in between leaves no folder either.
    staging = out.parent / f".{out.name}.{token_hex(8)}.partial"
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        staging.mkdir(0o700)
        yield staging
        manifest = make_manifest(staging, command, configuration, inputs)
        write_json(staging / MANIFEST, manifest)
        digest = sha256(staging / MANIFEST)
        staging.chmod(0o755)
        _move(staging, out)
    except BaseException:
        shutil.rmtree(staging, ignore_errors=True)
        # A folder that another process has begun to use is kept.
        with suppress(OSError):
            for parent in made:
                parent.rmdir()
        raise
    seals.append(Seal(out, digest))


def _move(staging: Path, out: Path) -> None:
    """Rename the finished bundle to its destination, then delete an old one."""
    if not out.exists():
        staging.rename(out)
        return
    old = out.parent / f".{out.name}.{token_hex(8)}.old"
    try:
        out.rename(old)
        staging.rename(out)
        shutil.rmtree(old, ignore_errors=True)
    except BaseException:
        if old.exists() and not out.exists():
            old.rename(out)
        shutil.rmtree(old, ignore_errors=True)
        raise


# The manifest of a bundle, and copies of its inputs.


# Inputs up to this total size are copied into the bundle, which then is self-contained.
COPY_LIMIT = 64 * 1024 * 1024  # bytes


def make_manifest(
    folder: Path, command: str, configuration: dict[str, Any], inputs: Sequence[InputFiles]
) -> dict[str, Any]:
    """Create the manifest of a finished folder, and copy its inputs into it.

    `folder`: its files are the outputs. `command`, `configuration`, `inputs`: as for
    `write_bundle`. DataError: an input has changed since it was read.
    """
    outputs = [
        {"name": name, "sha256": sha256(folder / name), "bytes": (folder / name).stat().st_size}
        for name in files_of(folder)
        if name not in UNSEALED
    ]
    for item in inputs:
        for file, digest in zip(item.files, item.digests, strict=True):
            if not file.is_file() or sha256(file) != digest:
                raise DataError("bundle.input-changed", file=file.name)
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


def _keep(
    folder: Path, inputs: Sequence[InputFiles]
) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """Copy the inputs, or refer to them; return their manifest entries and present paths."""
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
    """Assign a separate folder to each path, and the same to a repeated path."""
    # Files of one folder with two roles share a folder: each path has one.
    first = next((p for p, path in places.items() if path == item.path), None)
    if first is not None and item.path.is_dir():
        return first
    # The given name; a link's target may have lost its suffix.
    own = item.path.name or item.path.resolve().name
    place = Path("inputs") / item.role / own
    # Several logs may share a name, and a file may have been read for each.
    number = 2
    while places.get(place, item.path) != item.path:
        place = Path("inputs") / f"{item.role}-{number}" / own
        number += 1
    return place


# Dependencies of the results besides the inputs: packages and the platform.


PACKAGES = (
    "strapdown",
    "numpy",
    "scipy",
    "numba",
    "pandas",
    "pyarrow",
    "h5py",
    "jinja2",
    "typst",
)


def versions() -> dict[str, str]:
    """Versions of the packages that affect results, and the digest of our own sources."""
    found = {"python": platform.python_version(), "strapdown source": source_digest()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


@functools.cache
def source_digest() -> str:
    """SHA-256 of the sources and data of this package, as installations of a version may differ.

    Of the name and the content of each file except compiled ones, in order of names.
    """
    root = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*")):
        if path.is_file() and path.suffix in (".py", ".toml", ".j2", ".html", ".js", ".css"):
            content = hashlib.sha256(path.read_bytes()).hexdigest()
            digest.update(f"{path.relative_to(root).as_posix()} {content}\n".encode())
    return digest.hexdigest()


def machine() -> dict[str, str]:
    """Platform properties that can change the last bit of a result."""
    from llvmlite.binding import get_host_cpu_name

    return {
        "system": platform.system(),
        "machine": platform.machine(),
        "cpu": get_host_cpu_name(),
        "libc": " ".join(platform.libc_ver()).strip(),
    }
