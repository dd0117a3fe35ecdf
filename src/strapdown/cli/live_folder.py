"""Input of a live run: its journal from the first line to the sealed result, and recovery."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import typer

from strapdown import __version__
from strapdown.bundle import named_paths, read_manifest, sha256, source_digest
from strapdown.cli.console import WORDS
from strapdown.cli.result_folder import claim
from strapdown.errors import ConfigError, DataError, Finding, StrapdownError
from strapdown.live.journal import Journal, received_folder
from strapdown.live.replay import RunClock
from strapdown.live.sources import LineSource, open_source


def begin_journal(folder: Path, command: str, run: Mapping[str, Any]) -> Journal:
    """Start the journal of a run beside its output.

    `folder`: the output. `run`: what is needed to repeat it, its ``configuration`` among it.
    """
    named = sorted(set(named_paths(run["configuration"])))
    return Journal.begin(
        received_folder(folder),
        {
            "command": command,
            "out": folder.name,
            "strapdown": __version__,
            "source": source_digest(),
            "named": {name: sha256(Path(name)) for name in named},
            **run,
        },
    )


def recovered(folder: Path, command: str, warn: Callable[[Finding], None]) -> Journal:
    """Open the journal of a killed run, and check that what it depends on is unchanged.

    ConfigError, DataError: as `Journal.reopen`; or a file that the configuration names has changed.
    """
    journal = Journal.reopen(folder, command)
    try:
        for name, digest in journal.run["named"].items():
            file = Path(name)
            if not file.is_file() or sha256(file) != digest:
                raise DataError("live.named-file-changed", file=name, quantity="--recover")
    except BaseException:
        journal.close()
        raise
    if journal.run["source"] != source_digest():
        warn(Finding("live.other-program", version=journal.run["strapdown"]))
    warn(Finding("live.recovering", severity="note", file=str(folder)))
    return journal


@contextmanager
def sealing(journal: Journal) -> Iterator[None]:
    """Keep the journal if the run has no result, and say where; it is closed in any case."""
    try:
        yield
    except BaseException as error:
        if not journal.empty:
            journal.close()
            own = journal.run["command"].split()[0]
            typer.echo(f"received data: {journal.folder}", err=True)
            if not isinstance(error, StrapdownError):
                typer.echo(f"to finish: strapdown {own} --recover {journal.folder}", err=True)
        else:
            journal.remove()
        raise


def remove_received(journal: Journal, bundle: Path) -> None:
    """Remove what was received, unless the bundle refers to it; then the journal alone."""
    journal.remove(whole=_all_copied(bundle))


def _all_copied(bundle: Path) -> bool:
    """Return whether a bundle holds all of its inputs."""
    return all(item["kept"] == "copy" for item in read_manifest(bundle)["inputs"])


def let_go_of_received(bundle: Path) -> None:
    """Remove the input that was written for a bundle, unless the bundle refers to it."""
    if _all_copied(bundle):
        shutil.rmtree(received_folder(bundle), ignore_errors=True)


def remove_empty(journal: Journal, live: bool) -> NoReturn:
    """Remove the journal of a run that received nothing: DataError. `live`: whether it listened."""
    journal.remove()
    raise DataError("cli.no-sample", quantity="--live" if live else "--recover")


def output_of(journal: Journal, out: Path | None, force: bool) -> Path:
    """Hold the folder that a killed run was to write, or `out`, and return it."""
    folder = out or journal.folder.parent / str(journal.run["out"])
    claim(folder, force)
    return folder


def open_lines(
    where: str | None, clock: RunClock, token: str | None, warn: Callable[[Finding], None]
) -> LineSource | None:
    """Open the source of a run, if it has one, and print a token that was drawn for commands."""
    if where is None:
        return None
    source = open_source(where, clock, sys.stdin.buffer, token)
    if source.token is not None and token is None:
        warn(Finding("live.command-token", severity="note", token=source.token))
    return source


def refuse_beside_recover(given: Mapping[str, Any]) -> None:
    """Refuse options and arguments that a journal states; `given`: by name, None if not given."""
    for name, value in given.items():
        if value is not None:
            raise ConfigError("live.not-beside-recover", quantity="--recover", option=name)


def warner(quiet: bool) -> Callable[[Finding], None]:
    """Return a function that writes a finding to standard error."""

    def warn(finding: Finding) -> None:
        if not quiet:
            typer.echo(f"note: {finding.text(WORDS.get())}", err=True)

    return warn
