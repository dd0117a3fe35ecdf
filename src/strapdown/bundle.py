"""Sealed bundles: what a run wrote, what it read, and how to run it again.

A bundle is a folder. ``manifest.json`` in it names the command, the resolved configuration,
the seed, the versions, the platform, and the SHA-256 of every input and output; its own
SHA-256 is the seal. A bundle is written beside its place and moved there whole, so that a run
that fails leaves nothing. ``timing.json`` stands outside the seal, because clocks differ.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from secrets import token_hex
from typing import Any

from strapdown.exceptions import ConfigError, DataError
from strapdown.results import InputFiles

__all__ = [
    "Seal",
    "read_manifest",
    "resolved",
    "sha256",
    "unsealed_changes",
    "write_bundle",
    "write_latency",
    "write_timing",
]

MANIFEST = "manifest.json"
TIMING = "timing.json"
#: Outside the seal: clocks differ.
UNSEALED = (TIMING, "latency.json")
SCHEMA = "strapdown bundle 1"
KEPT = ("copy", "reference")
# Inputs up to this size together are copied into the bundle, which then stands on its own.
COPY_LIMIT = 64 * 1024 * 1024  # bytes
PACKAGES = (
    "strapdown",
    "numpy",
    "scipy",
    "numba",
    "pandas",
    "pyarrow",
    "h5py",
    "matplotlib",
    "plotly",
)


@dataclass(frozen=True)
class Seal:
    """What a bundle's writer returns.

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


def to_json(content: Any) -> str:
    """JSON as bundles hold it: readable, in the order given, the same bytes every time."""
    text = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    # Names of files need not be text; what is not is shown as a question mark.
    return text.encode("utf-8", "replace").decode("utf-8")


def versions() -> dict[str, str]:
    """Versions of the packages that numbers depend on."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def machine() -> dict[str, str]:
    """What of the platform can change the last bit of a number."""
    from llvmlite.binding import get_host_cpu_name

    return {
        "system": platform.system(),
        "machine": platform.machine(),
        "cpu": get_host_cpu_name(),
        "libc": " ".join(platform.libc_ver()).strip(),
    }


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
    """Write a bundle, whole or not at all.

    Parameters
    ----------
    out : Path
        The folder to make. An existing one is replaced only if `force` is set and it is empty
        or a bundle itself.
    command : str
        Which command can run it again.
    configuration : dict
        The resolved configuration; paths of inputs in it are replaced by where the bundle
        keeps or finds them.
    inputs : sequence of InputFiles
        Copied, if all of them together have at most 64 MiB, or else referred to by path.
    force : bool
    seals : list of Seal
        The seal is appended when the bundle stands.

    Yields
    ------
    Path
        An empty folder; what is in it when the block ends becomes the bundle.

    Raises
    ------
    ConfigError
        `out` exists and may not be replaced.
    """
    out = out.absolute()
    check_destination(out, force)
    made = [p for p in out.parents if not p.exists()]
    # Named before it is made: whoever interrupts in between leaves nothing either.
    staging = out.parent / f".{out.name}.{token_hex(8)}.partial"
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        staging.mkdir(0o700)
        yield staging
        manifest = _manifest(staging, command, configuration, inputs)
        (staging / MANIFEST).write_text(to_json(manifest), encoding="utf-8", newline="\n")
        digest = sha256(staging / MANIFEST)
        staging.chmod(0o755)
        _move(staging, out)
    except BaseException:
        shutil.rmtree(staging, ignore_errors=True)
        # One that somebody else has begun to use stays.
        with suppress(OSError):
            for parent in made:
                parent.rmdir()
        raise
    seals.append(Seal(out, digest))


def check_destination(out: Path, force: bool) -> None:
    """Refuse a folder that may not be written.

    Parameters
    ----------
    out : Path
    force : bool
        Allow a bundle, or an empty folder, to be replaced.

    Raises
    ------
    ConfigError
    """
    if not out.exists():
        _refuse_unwritable(out)
        return
    if out.is_dir() and not any(out.iterdir()):
        return
    if not force:
        raise ConfigError(
            "it exists already",
            file=str(out),
            quantity="--out",
            remedy="name another folder with --out, or replace this one with --force",
        )
    if not (out.is_dir() and (out / MANIFEST).is_file()):
        raise ConfigError(
            "it exists and is no bundle; --force replaces bundles alone",
            file=str(out),
            quantity="--out",
            remedy="name another folder",
        )


def _refuse_unwritable(out: Path) -> None:
    """Say before a long run what would fail after it."""
    parent = next(p for p in out.absolute().parents if p.exists())
    if not parent.is_dir() or not os.access(parent, os.W_OK):
        raise ConfigError(
            f"it cannot be made: {parent} is no folder that may be written",
            file=str(out),
            quantity="--out",
            remedy="name another folder with --out",
        )


def _manifest(
    staging: Path, command: str, configuration: dict[str, Any], inputs: Sequence[InputFiles]
) -> dict[str, Any]:
    outputs = [
        {"name": name, "sha256": sha256(staging / name), "bytes": (staging / name).stat().st_size}
        for name in _files(staging)
        if name not in UNSEALED
    ]
    for item in inputs:
        for file, digest in zip(item.files, item.digests, strict=True):
            _refuse_changed(file, digest)
    copy = sum(f.stat().st_size for i in inputs for f in i.files) <= COPY_LIMIT
    kept: list[dict[str, Any]] = []
    moved: dict[str, str] = {}
    places: dict[Path, Path] = {}
    names: set[Path] = set()
    for item in inputs:
        # The name that was given; a link's target may have lost its ending.
        own = item.path.name or item.path.resolve().name
        place = Path("inputs") / item.role / own
        # What two roles took of one folder stands in one: a path is of one place.
        first = next((p for p, path in places.items() if path == item.path), None)
        if first is not None and item.path.is_dir():
            place = first
        # Several logs may have one name, and one file may have been read for each of them.
        number = 2
        while places.get(place, item.path) != item.path:
            place = Path("inputs") / f"{item.role}-{number}" / own
            number += 1
        if place in places and not item.path.is_dir():
            continue
        places[place] = item.path
        for file, digest in zip(item.files, item.digests, strict=True):
            name = place / file.relative_to(item.path) if item.path.is_dir() else place
            if name in names:
                continue
            names.add(name)
            if copy:
                (staging / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(file, staging / name)
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
    return {
        "schema": SCHEMA,
        "command": command,
        "configuration": _replace_paths(configuration, moved),
        "inputs": kept,
        "outputs": outputs,
        "versions": versions(),
        "platform": machine(),
    }


def _refuse_changed(file: Path, digest: str) -> None:
    if not file.is_file() or sha256(file) != digest:
        raise DataError(
            "it has changed or gone since it was read",
            file=file.name,
            remedy="run again",
        )


def _replace_paths(value: Any, moved: dict[str, str]) -> Any:
    if isinstance(value, dict):
        return {
            k: moved.get(v, v) if names_file(k, v) else _replace_paths(v, moved)
            for k, v in value.items()
        }
    if isinstance(value, list):
        return [_replace_paths(v, moved) for v in value]
    return value


def names_file(key: str, value: Any) -> bool:
    """Tell whether a value of a configuration is the path of an input.

    Parameters
    ----------
    key : str
        Name of the field.
    value : object
        A path; or of a sensor a file's path, which ends as such, or a name of the catalogue.
    """
    if not isinstance(value, str):
        return False
    return key.endswith("path") or (key == "sensor" and value.lower().endswith(".toml"))


def resolved(value: Any, root: Path) -> Any:
    """Return a configuration with the paths of copied inputs made absolute.

    Parameters
    ----------
    value : object
        Of a manifest.
    root : Path
        The bundle.
    """
    if isinstance(value, dict):
        return {
            k: str(root / v) if names_file(k, v) else resolved(v, root) for k, v in value.items()
        }
    if isinstance(value, list):
        return [resolved(v, root) for v in value]
    return value


def _files(root: Path) -> list[str]:
    """Everything but folders; a link to one is no folder of the bundle."""
    found = (p for p in root.rglob("*") if p.is_symlink() or not p.is_dir())
    return sorted(p.relative_to(root).as_posix() for p in found)


def _move(staging: Path, out: Path) -> None:
    """Put the finished bundle in its place; an old one goes only once the new one stands."""
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


def write_timing(
    seal: Seal, seconds: dict[str, float], sample_ns: dict[str, dict[str, float]] | None = None
) -> None:
    """Put the times that a run took beside its bundle's seal.

    Parameters
    ----------
    seal : Seal
    seconds : dict of str to float
        Stage to seconds.
    sample_ns : dict of str to dict, optional
        Algorithm to nanoseconds of a sample in each precision.
    """
    timing: dict[str, Any] = {"seconds": {stage: round(t, 4) for stage, t in seconds.items()}}
    if sample_ns:
        timing["sample_ns"] = sample_ns
    (seal.path / TIMING).write_text(to_json(timing), encoding="utf-8", newline="\n")


def write_latency(seal: Seal, latency: Mapping[str, Any]) -> None:
    """Put what each sample took beside its bundle's seal.

    Parameters
    ----------
    seal : Seal
    latency : mapping
        As JSON.
    """
    (seal.path / "latency.json").write_text(to_json(latency), encoding="utf-8", newline="\n")


def read_manifest(bundle: Path) -> dict[str, Any]:
    """Read the manifest of a bundle.

    Parameters
    ----------
    bundle : Path

    Returns
    -------
    dict

    Raises
    ------
    DataError
        There is none, or it is damaged.
    """
    path = bundle / MANIFEST
    if not path.is_file():
        raise DataError(
            "no manifest.json in it: this is no bundle of strapdown",
            file=str(bundle),
            remedy="name the folder that a run wrote",
        )
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise DataError(
            f"no JSON any more: {error}",
            file=MANIFEST,
            remedy="the bundle was changed after it was sealed; get it again",
        ) from None
    wanted = {"schema", "command", "configuration", "inputs", "outputs", "versions", "platform"}
    if not isinstance(manifest, dict) or wanted - set(manifest) or manifest["schema"] != SCHEMA:
        raise DataError(
            f"not a manifest of the form '{SCHEMA}'",
            file=MANIFEST,
            remedy="use the version of strapdown that wrote it",
        )
    _refuse_escape(manifest)
    return manifest


def _refuse_escape(manifest: dict[str, Any]) -> None:
    """Refuse a manifest that is malformed, or whose own files lie outside its folder."""
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
        raise DataError(
            "it is malformed, or names files outside the folder or outside the seal",
            file=MANIFEST,
            remedy="do not trust this bundle; get it again from its source",
        ) from None


def _refuse_unsealed_paths(manifest: dict[str, Any]) -> None:
    """Refuse a configuration that reads what the seal does not hold."""
    sealed = {item["name"] for item in manifest["inputs"]}
    sealed |= {str(Path(name).parent) for name in sealed}
    for path in _paths(manifest["configuration"]):
        if path not in sealed:
            raise ValueError


def _paths(value: Any) -> Iterator[str]:
    if isinstance(value, list):
        for item in value:
            yield from _paths(item)
    for key, item in value.items() if isinstance(value, dict) else ():
        if names_file(key, item):
            yield item
        yield from _paths(item)


def unsealed_changes(bundle: Path, manifest: dict[str, Any]) -> list[str]:
    """Say which files of a bundle are not as they were sealed.

    Parameters
    ----------
    bundle : Path
    manifest : dict
        From `read_manifest`.

    Returns
    -------
    list of str
        One sentence a file: changed, missing, or not in the manifest.
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
    changes += [f"{name}: not in the manifest" for name in _files(bundle) if name not in expected]
    return changes
