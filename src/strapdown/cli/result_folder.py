"""Name result folders, and refuse one that is given as a log."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from strapdown.cli.console import RESOURCES, Stopwatch, print_seal, progress
from strapdown.errors import ConfigError, DataError, Finding

if TYPE_CHECKING:
    from strapdown.bundle import Seal
    from strapdown.cli.shared_options import ReportFlags
    from strapdown.config.alignment import AlignmentSpec
    from strapdown.config.navigation import NavigationSpec

#: Suffixes of the folders of these commands.
ENDINGS = (
    *("align", "allan", "attitude", "calibrate", "campaign", "outage", "crash"),
    *("doctor", "extrinsics", "navigate", "simulated"),
)


def default_folder(source: str | Path, ending: str, named: str | None = None) -> Path:
    """Return the default folder of a result.

    `source`: argument of the command: a log, a configuration, a folder, a name. `ending`: suffix by
    the command. `named`: name of the subject, if `source` is named after a command, such as
    ``navigate.toml``. Returns ``drive-navigate`` for ``drive.csv``, and for its ``navigate.toml``;
    without repeated words.
    """
    path = Path(source)
    whole = path.resolve() if path.name in ("", ".", "..") else path
    stem = whole.name if path.is_dir() else whole.stem
    if stem.lower() in ENDINGS:
        if named is None:
            return Path(f"{stem}-result" if stem.lower() == ending else f"{stem}-{ending}")
        stem = Path(named).stem
    for word in ENDINGS:
        # The result of a result is named after the first source.
        if path.is_dir() and (first := re.fullmatch(rf"(.+)-{word}(-\d+)?", stem)):
            stem = first[1]
    return Path(stem if stem.lower().endswith(f"-{ending}") else f"{stem}-{ending}")


def folder_to_write(
    out: Path | None, source: str | Path, ending: str, force: bool, named: str | None = None
) -> Path:
    """Return the folder that a result goes into: as asked, or the default one.

    A default folder that is there, as after a second try with an answer more, is left as it is: a
    number is put behind the name. `out`: as the user asked. `force`: replace what is there.
    `source`, `ending`, `named`: as in `default_folder`.
    """
    folder = out or default_folder(source, ending, named)
    if out is not None or force:
        return folder
    others = (folder.with_name(f"{folder.name}-{k}") for k in itertools.count(2))
    free = (one for one in itertools.chain([folder], others) if not _is_taken(one))
    return next(free)


def _is_taken(folder: Path) -> bool:
    return folder.is_symlink() or folder.is_file() or (folder.is_dir() and any(folder.iterdir()))


def source_name(spec: AlignmentSpec | NavigationSpec) -> str:
    """Log of a configuration, or one word for the source of its samples."""
    if spec.log is not None:
        return Path(spec.log.path).name
    return "simulated" if spec.simulation is not None else "live"


def refuse_result(source: str | Path, wanted: str) -> None:
    """Refuse a result folder given as the input of a command.

    `wanted`: expected input, in words. ConfigError: it is one; the message names its command, and
    what can be done with it.
    """
    from strapdown.bundle import read_manifest

    path = Path(source)
    try:
        manifest = read_manifest(path)
    except DataError:
        # Other programs write files of this name, too; damage to one of ours is reported by verify.
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
    """Yield the possible commands for a result folder."""
    if (path / "report.html").is_file():
        yield Finding("cli.hint-open", severity="note", report=path / "report.html", folder=path)
    if command == "navigate":
        yield Finding("cli.hint-outage", severity="note", folder=path)
    own = next((i for i in manifest["inputs"] if i["role"] in ("log", "case")), None)
    if own is not None:
        at = path / own["name"] if own["kept"] == "copy" else Path(own["name"])
        yield Finding("cli.hint-input", severity="note", role=own["role"], input=at)


def claim(folder: Path, force: bool) -> None:
    """Hold the folder of a result until the command ends; no other run writes it.

    ConfigError: it exists and must not be replaced, or another run holds it.
    """
    from strapdown.bundle import claimed

    RESOURCES.get().enter_context(claimed(folder, force))


def run_and_save(
    compute: Callable[[Stopwatch], Any],
    folder: Path,
    write: ReportFlags,
    answer: str,
    show: Callable[[Any], None],
    *more: Callable[[Any, Seal], None],
    look_at: str | None = None,
) -> Any:
    """Run with progress, save the result with the times of its stages, print and return it.

    `compute`: returns a result with `save`; it reports its stages. `answer`: file of the result
    that ``--json`` prints. `show`: prints the result. `*more`: write further files outside the
    seal. `look_at`: file to open where there is no page, if not `answer`. ConfigError: the folder
    exists and must not be replaced; or as `compute`.
    """
    from strapdown.bundle import write_timing

    claim(folder, write.force)
    with progress(write.quiet or write.json) as bar:
        report = Stopwatch(bar)
        result = compute(report)
        seal: Seal = result.save(
            folder, report=not write.no_report, force=write.force, progress=report
        )
        report.stop()
        write_timing(seal, report.seconds)
        for one in more:
            one(result, seal)
    if write.json:
        typer.echo((seal.path / answer).read_text(encoding="utf-8"), nl=False)
    elif not write.quiet:
        show(result)
        print_seal(seal, look_at or answer, write.no_report)
    return result


def file_beside(
    path: Path | None, flag: str, force: bool, text: Callable[[Any], str]
) -> Callable[[Any, Seal], None]:
    """Return what writes a TOML file of a result beside its folder, if there is a path.

    ConfigError: it is none, or is there and must not be replaced.
    """
    if path is not None and path.suffix.lower() != ".toml":
        raise ConfigError("cli.sensor-file-no-toml", quantity=flag, file=path.name)
    if path is not None and path.exists() and not force:
        raise ConfigError("cli.file-exists", quantity=flag, file=path.name)

    def write(result: Any, _: Seal) -> None:
        if path is not None:
            from strapdown.bundle.atomic_folder import replace_file

            replace_file(path, text(result).encode())

    return write
