"""Sealed bundles: outputs and inputs of a run, with all that is needed to repeat it.

A bundle is a folder. ``manifest.json`` in it names the command, the resolved configuration,
the seed, the versions, the platform, and the SHA-256 of every input and output; its own
SHA-256 is the seal. A bundle is written to a temporary folder and renamed as a whole, so that
a failed run leaves no files. ``timing.json`` is outside the seal, because clocks differ.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import platform
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from secrets import token_hex
from typing import Any

from strapdown.errors import ConfigError, DataError, printable

MANIFEST = "manifest.json"
TIMING = "timing.json"
LATENCY = "latency.json"
#: Files outside the seal: clocks differ.
UNSEALED = (TIMING, LATENCY)
SCHEMA = "strapdown bundle 2"


@dataclass(frozen=True)
class InputFiles:
    """Files that a result depends on.

    Attributes
    ----------
    role : str
        ``log``, ``truth``, ``gyro-bias``, ``reference-log`` or ``sensor``.
    path : Path
        As given: a file, or a folder.
    files : tuple of Path
        Every file that was read.
    digests : tuple of str
        SHA-256 of each when it was read.
    copied : bool
        Whether a bundle copies them, whatever their size: they come from tables in memory and
        exist only there.
    """

    role: str
    path: Path
    files: tuple[Path, ...]
    digests: tuple[str, ...]
    copied: bool = False


@dataclass(frozen=True)
class Seal:
    """Seal of a written bundle.

    Attributes
    ----------
    path : Path
        The folder.
    digest : str
        SHA-256 of its manifest.
    """

    path: Path
    digest: str


def sha256(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def input_files(role: str, path: str, files: tuple[Path, ...]) -> InputFiles:
    """List files read in a role, with their present digests."""
    return InputFiles(role, Path(path), files, tuple(sha256(file) for file in files))


def sensor_file(sensor: str | None) -> tuple[InputFiles, ...]:
    """Return the file of a sensor that is not from the catalogue."""
    from strapdown.sensors.catalogue import SENSORS

    if sensor is None or sensor.lower() in SENSORS:
        return ()
    return (input_files("sensor", sensor, (Path(sensor),)),)


def files_of(root: Path) -> list[str]:
    """Everything but folders; a link to a folder is not a folder of the bundle."""
    found = (p for p in root.rglob("*") if p.is_symlink() or not p.is_dir())
    return sorted(p.relative_to(root).as_posix() for p in found)


# Check of the destination before the run.


def check_destination(out: Path, force: bool) -> None:
    """Refuse a folder that must not be written.

    `force`: allow a bundle, or an empty folder, to be replaced.
    """
    if not out.exists():
        # Report before a long run a write error that would occur after it.
        parent = next(p for p in out.absolute().parents if p.exists())
        if not parent.is_dir() or not os.access(parent, os.W_OK):
            raise ConfigError("bundle.not-writable", file=str(out), quantity="--out", parent=parent)
        return
    if out.is_dir() and not any(out.iterdir()):
        return
    if not force:
        raise ConfigError("bundle.folder-exists", file=str(out), quantity="--out")
    if not (out.is_dir() and (out / MANIFEST).is_file()):
        raise ConfigError("bundle.not-a-bundle", file=str(out), quantity="--out")


# Files beside the seal, because clocks differ.


def write_timing(
    seal: Seal, seconds: dict[str, float], sample_ns: dict[str, dict[str, float]] | None = None
) -> None:
    """Write the times of a run beside its bundle's seal.

    `seconds`: stage to seconds. `sample_ns`: algorithm to nanoseconds per sample in each precision.
    """
    timing: dict[str, Any] = {"seconds": {stage: round(t, 4) for stage, t in seconds.items()}}
    if sample_ns:
        timing["sample_ns"] = sample_ns
    write_json(seal.path / TIMING, timing)


def write_latency(seal: Seal, latency: Mapping[str, Any]) -> None:
    """Write the latency of the samples beside the bundle's seal.

    `latency`: as JSON.
    """
    write_json(seal.path / LATENCY, latency)


# JSON format of bundles.


def to_json(content: Any) -> str:
    """Format JSON for bundles: readable, in the given order, reproducible byte by byte."""
    text = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    # Names of files need not be valid text, and marks of direction would change how it looks.
    return printable(text, lines=True, json=True)


def write_json(path: Path, content: Any) -> None:
    """Write a JSON file of a bundle, the same bytes on every system."""
    path.write_text(to_json(content), encoding="utf-8", newline="\n")


# Paths of inputs in a configuration.


def names_file(key: str, value: Any) -> bool:
    """Whether a value of a configuration is the path of an input.

    `key`: name of the field, of a list that of the list. `value`: a path; for a sensor or a model
    of severity, a file path with its suffix, or a name of the catalogue.
    """
    if not isinstance(value, str):
        return False
    return key.endswith("path") or (
        key in ("sensor", "severity") and value.lower().endswith(".toml")
    )


def named_paths(value: Any, key: str = "") -> Iterator[str]:
    """Every path of an input in a configuration; `key`: that of the value."""
    if isinstance(value, list):
        for item in value:
            yield from named_paths(item, key)
    elif isinstance(value, dict):
        for name, item in value.items():
            yield from named_paths(item, name)
    elif names_file(key, value):
        yield value


def with_paths(value: Any, change: Callable[[str], str], key: str = "") -> Any:
    """Return a configuration with every path of an input replaced.

    `value`: the configuration, or a part. `change`: maps a path to its replacement. `key`: that of
    the value.
    """
    if isinstance(value, dict):
        return {k: with_paths(v, change, k) for k, v in value.items()}
    if isinstance(value, list):
        return [with_paths(v, change, key) for v in value]
    return change(value) if names_file(key, value) else value


def resolved(value: Any, root: Path) -> Any:
    """Return a configuration with the paths of copied inputs made absolute.

    `value`: from a manifest. `root`: folder of the bundle.
    """
    return with_paths(value, lambda path: str(root / path))


# Write a bundle atomically.


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
    root = Path(__file__).parent
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


# Read a manifest, and list the changes since it was sealed.


KEPT = ("copy", "reference")


def read_manifest(bundle: Path) -> dict[str, Any]:
    """Read the manifest of a bundle.

    DataError: the manifest is missing or damaged.
    """
    path = bundle / MANIFEST
    if not bundle.exists():
        raise DataError("bundle.no-such-folder", file=str(bundle))
    if not path.is_file():
        raise DataError("bundle.no-manifest", file=str(bundle))
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise DataError("bundle.not-json", file=MANIFEST, reason=error) from None
    wanted = {"schema", "command", "configuration", "inputs", "outputs", "versions", "platform"}
    if not isinstance(manifest, dict) or wanted - set(manifest):
        raise DataError("bundle.unknown-form", file=MANIFEST)
    if manifest["schema"] != SCHEMA:
        known = manifest["versions"]
        version = known.get("strapdown", "unknown") if isinstance(known, dict) else "unknown"
        raise DataError(
            "bundle.other-schema", file=MANIFEST, schema=manifest["schema"], version=version
        )
    _refuse_escape(manifest)
    return manifest


def _refuse_escape(manifest: dict[str, Any]) -> None:
    """Refuse a malformed manifest, or one with own files outside its folder."""
    try:
        for item in [*manifest["inputs"], *manifest["outputs"]]:
            path, refers = Path(item["name"]), item.get("kept") == "reference"
            if not isinstance(item["sha256"], str) or path.is_absolute() != refers:
                raise ValueError
            if not isinstance(item["bytes"], int) or item.get("kept", "copy") not in KEPT:
                raise ValueError
            if ".." in path.parts:
                raise ValueError
        _refuse_unsealed_paths(manifest)
        for part in ("versions", "platform"):
            if not all(isinstance(v, str) for v in manifest[part].values()):
                raise ValueError
        if not isinstance(manifest["command"], str):
            raise ValueError
    except (TypeError, KeyError, ValueError, AttributeError):
        raise DataError("bundle.malformed", file=MANIFEST) from None


def _refuse_unsealed_paths(manifest: dict[str, Any]) -> None:
    """Refuse a configuration that reads files not covered by the seal."""
    sealed = {item["name"] for item in manifest["inputs"]}
    sealed |= {str(Path(name).parent) for name in sealed}
    for path in named_paths(manifest["configuration"]):
        if path not in sealed:
            raise ValueError


def unsealed_changes(bundle: Path, manifest: dict[str, Any]) -> list[str]:
    """List the files of a bundle that differ from the seal.

    `manifest`: from `read_manifest`. Returns one sentence per file: changed, missing, or not in the
    manifest.
    """
    changes = []
    expected: set[str] = {MANIFEST, *UNSEALED}
    for item in [*manifest["inputs"], *manifest["outputs"]]:
        path = bundle / item["name"]  # an absolute path stays what it is
        expected.add(item["name"])
        if not path.is_file():
            changes.append(f"{item['name']}: missing")
        elif sha256(path) != item["sha256"]:
            changes.append(f"{item['name']}: changed after it was sealed")
        elif path.stat().st_size != item["bytes"]:
            changes.append(f"{item['name']}: not of the {item['bytes']} bytes of the manifest")
    changes += [f"{name}: not in the manifest" for name in files_of(bundle) if name not in expected]
    return changes
