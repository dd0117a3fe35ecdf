"""The seal of a bundle, what stands outside of it, and the digests that it is made of."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

__all__ = ["LATENCY", "MANIFEST", "SCHEMA", "TIMING", "UNSEALED", "Seal", "files_of", "sha256"]

MANIFEST = "manifest.json"
TIMING = "timing.json"
LATENCY = "latency.json"
#: Outside the seal: clocks differ.
UNSEALED = (TIMING, LATENCY)
SCHEMA = "strapdown bundle 2"


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


def files_of(root: Path) -> list[str]:
    """Everything but folders; a link to one is no folder of the bundle."""
    found = (p for p in root.rglob("*") if p.is_symlink() or not p.is_dir())
    return sorted(p.relative_to(root).as_posix() for p in found)
