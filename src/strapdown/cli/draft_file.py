"""Write a proposed file atomically, and replace another only on request."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from pathlib import Path

from strapdown.errors import ConfigError

__all__ = ["check_free", "write_file"]


def check_free(path: Path, usual: str, *, force: bool) -> None:
    """Refuse an existing path.

    Parameters
    ----------
    path : Path
    usual : str
        Usual name of such a file.
    force : bool
        Whether a file may be replaced.

    Raises
    ------
    ConfigError
        A file exists and must not be replaced, or a folder exists.
    """
    if path.is_dir():
        raise ConfigError("cli.out-is-folder", file=str(path), quantity="--out", path=path / usual)
    if path.exists() and not force:
        raise ConfigError("cli.file-exists", file=str(path), quantity="--out")


def write_file(path: Path, text: str, usual: str, *, force: bool) -> None:
    """Write a text file.

    Parameters
    ----------
    path : Path
    text : str
    usual : str
        Usual name of such a file.
    force : bool
        Replace an existing file.

    Raises
    ------
    ConfigError
        As `check_free`, also for a file created in the meantime.
    """
    check_free(path, usual, force=force)
    path = path.absolute()
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".partial", dir=path.parent)
    staged = Path(name)
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as stream:
            stream.write(text)
        staged.chmod(0o644)
        if force:
            staged.replace(path)
            return
        try:
            # Creating a link fails if the path exists, in one atomic step.
            path.hardlink_to(staged)
        except FileExistsError:
            check_free(path, usual, force=force)
        except OSError:
            # A file system without links.
            check_free(path, usual, force=force)
            staged.replace(path)
    finally:
        with suppress(FileNotFoundError):
            staged.unlink()
