"""Write a bundle, whole or not at all."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from typing import Any

from strapdown.bundle.destination import check_destination
from strapdown.bundle.json_text import to_json
from strapdown.bundle.manifest import make_manifest
from strapdown.bundle.seal import MANIFEST, Seal, sha256
from strapdown.results.inputs import InputFiles

__all__ = ["write_bundle"]


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
        manifest = make_manifest(staging, command, configuration, inputs)
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
