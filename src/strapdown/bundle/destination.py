"""Where a bundle may be written, told before the run that it is for."""

from __future__ import annotations

import os
from pathlib import Path

from strapdown.bundle.seal import MANIFEST
from strapdown.errors import ConfigError

__all__ = ["check_destination"]


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
        raise ConfigError("bundle.folder-exists", file=str(out), quantity="--out")
    if not (out.is_dir() and (out / MANIFEST).is_file()):
        raise ConfigError("bundle.not-a-bundle", file=str(out), quantity="--out")


def _refuse_unwritable(out: Path) -> None:
    """Say before a long run what would fail after it."""
    parent = next(p for p in out.absolute().parents if p.exists())
    if not parent.is_dir() or not os.access(parent, os.W_OK):
        raise ConfigError("bundle.not-writable", file=str(out), quantity="--out", parent=parent)
