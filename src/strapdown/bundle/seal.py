"""Seal of a bundle, its digests, and the unsealed files."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from strapdown.errors import ConfigError

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
        _refuse_unwritable(out)
        return
    if out.is_dir() and not any(out.iterdir()):
        return
    if not force:
        raise ConfigError("bundle.folder-exists", file=str(out), quantity="--out")
    if not (out.is_dir() and (out / MANIFEST).is_file()):
        raise ConfigError("bundle.not-a-bundle", file=str(out), quantity="--out")


def _refuse_unwritable(out: Path) -> None:
    """Report before a long run a write error that would occur after it."""
    parent = next(p for p in out.absolute().parents if p.exists())
    if not parent.is_dir() or not os.access(parent, os.W_OK):
        raise ConfigError("bundle.not-writable", file=str(out), quantity="--out", parent=parent)


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
    # Names of files need not be valid text; invalid parts become question marks.
    return text.encode("utf-8", "replace").decode("utf-8")


def write_json(path: Path, content: Any) -> None:
    """Write a JSON file of a bundle, the same bytes on every system."""
    path.write_text(to_json(content), encoding="utf-8", newline="\n")
