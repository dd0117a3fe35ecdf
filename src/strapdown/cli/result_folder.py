"""Folders of results: how the next is named, and what is said of one that is given for a log."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from strapdown.errors import ConfigError, DataError, Finding

if TYPE_CHECKING:
    from strapdown.config.alignment import AlignmentSpec
    from strapdown.config.navigation import NavigationSpec

__all__ = ["default_folder", "refuse_result", "source_name"]

#: What folders of these commands end with.
ENDINGS = ("align", "attitude", "coast", "crash", "navigate", "simulated")


def default_folder(source: str | Path, ending: str, named: str | None = None) -> Path:
    """Return the folder that a result goes to where none is named.

    Parameters
    ----------
    source : str or Path
        What the command was given: a log, a configuration, a folder, a name.
    ending : str
        The word of the command.
    named : str, optional
        Where `source` is called after a command, as ``navigate.toml``: what it is of.

    Returns
    -------
    Path
        ``drive-navigate`` of ``drive.csv``, and of ``navigate.toml`` about it; no word is in it
        twice.
    """
    path = Path(source)
    whole = path.resolve() if path.name in ("", ".", "..") else path
    stem = whole.name if path.is_dir() else whole.stem
    if stem.lower() in ENDINGS:
        if named is None:
            return Path(f"{stem}-result" if stem.lower() == ending else f"{stem}-{ending}")
        stem = Path(named).stem
    for word in ENDINGS:
        # A result of a result is of what that was of.
        if path.is_dir() and stem.endswith(f"-{word}"):
            stem = stem.removesuffix(f"-{word}")
    return Path(stem if stem.lower().endswith(f"-{ending}") else f"{stem}-{ending}")


def source_name(spec: AlignmentSpec | NavigationSpec) -> str:
    """The log of a configuration, or in a word where its samples come from."""
    if spec.log is not None:
        return Path(spec.log.path).name
    return "simulated" if spec.simulation is not None else "live"


def refuse_result(source: str | Path, wanted: str) -> None:
    """Refuse a folder of results that is given for what a command reads.

    Parameters
    ----------
    source : str or Path
    wanted : str
        What the command reads, in words.

    Raises
    ------
    ConfigError
        It is one; the message says of which command, and what can be done with it.
    """
    from strapdown.bundle import read_manifest

    path = Path(source)
    try:
        manifest = read_manifest(path)
    except DataError:
        # Others, too, write a file of this name; what is wrong with one of ours, verify tells.
        return
    command = str(manifest["command"])
    data: dict[str, Any] = {"command": command, "wanted": wanted}
    code = "cli.result-of-run"
    if (path / "case.toml").is_file():
        code, data["case"] = "cli.result-with-case", path / "case.toml"
    elif command == "simulate":
        logs = [p for p in sorted(path.glob("log.*")) if p.is_file()]
        code, data["log"] = "cli.result-with-log", logs[0] if logs else path / "log.csv"
    else:
        data["hints"] = list(_hints(path, command, manifest))
    raise ConfigError(code, file=path.resolve().name, **data)


def _hints(path: Path, command: str, manifest: Mapping[str, Any]) -> Iterator[Finding]:
    """Yield what can be done with a folder of results."""
    yield Finding("cli.hint-open", severity="note", report=path / "report.html", folder=path)
    if command == "navigate":
        yield Finding("cli.hint-coast", severity="note", folder=path)
    own = next((i for i in manifest["inputs"] if i["role"] in ("log", "case")), None)
    if own is not None:
        at = path / own["name"] if own["kept"] == "copy" else Path(own["name"])
        yield Finding("cli.hint-input", severity="note", role=own["role"], input=at)
