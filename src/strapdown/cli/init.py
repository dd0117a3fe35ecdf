"""``strapdown init``: propose a configuration from records."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from strapdown.cli import shared_options as options
from strapdown.cli.console import console, print_findings, progress
from strapdown.cli.result_folder import refuse_result
from strapdown.errors import ConfigError

if TYPE_CHECKING:
    from rich.console import Console

    from strapdown.config.logs import LogTable
    from strapdown.config.toml_text import Asked
    from strapdown.progress import Progress

EPILOG = "Example: strapdown init crash recorder.csv"
ALIGN_EPILOG = "Example: strapdown init align log.imu, then strapdown align align.toml"
NAVIGATE_EPILOG = "Example: strapdown init navigate log.csv --gnss fixes.csv"
CRASH_EPILOG = "Example: strapdown init crash left.csv right.csv --out case.toml"

# Longest number of a vehicle in the name of its file.
SHORT = 20

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _file_to_write(name: str, default: Path | None = None) -> Any:
    return options.writing("FILE", f"File to write ({name}).", default=default)


FORCE = options.writing(None, "Overwrite an existing file.", "--force", default=False)


@app.callback(epilog=EPILOG)
def init() -> None:
    """Propose a configuration from your records, with questions for missing data."""


@app.command("crash", epilog=CRASH_EPILOG)
def crash(
    records: list[Path] = typer.Argument(
        metavar="RECORD",
        help="Records of one crash: CSV or text tables of any layout, tables of an event data "
        "recorder, the folder of a test (NHTSA, ISO MME).",
        show_default=False,
    ),
    out: Path = _file_to_write("case.toml", default=Path("case.toml")),
    force: bool = FORCE,
    quiet: bool = options.QUIET,
    verbose: bool = options.VERBOSE,
) -> None:
    """Propose the case file of a crash from its records, with questions for missing data.

    Each line states whether a value was found, is assumed, or is to be filled in ("?"). Records of
    several vehicles give a file for each: case-1.toml, case-2.toml. Then: strapdown crash case.toml
    """
    from strapdown.crash.template import draft_cases, read_records

    def draft(folder: Path, report: Progress) -> Any:
        there = read_records(records)
        report("looking through", 0.5)
        return draft_cases(there, folder=folder)

    question = "Check; correct it in {} if wrong:"
    _propose("crash", records, draft, question, out, force=force, quiet=quiet)


@app.command("align", epilog=ALIGN_EPILOG)
@options.spread
def align(
    log: Path = typer.Argument(
        metavar="LOG", help="A log of gyros and accelerometers.", show_default=False
    ),
    *,
    flags: options.LogFlags,
    out: Path = _file_to_write("align.toml", default=Path("align.toml")),
    force: bool = FORCE,
    quiet: bool = options.QUIET,
    verbose: bool = options.VERBOSE,
) -> None:
    """Propose the configuration of an alignment from a log, with questions for missing data.

    Then: strapdown align align.toml
    """
    from strapdown.systems.alignment_draft import draft_alignment

    def draft(folder: Path, _: Progress) -> Any:
        return (draft_alignment(_table(log, flags), folder=folder, axes=flags.axes),)

    _propose("align", [log], draft, "", out, force=force, quiet=quiet)


@app.command("navigate", epilog=NAVIGATE_EPILOG)
@options.spread
def navigate(
    log: Path = typer.Argument(
        metavar="LOG", help="A log of gyros and accelerometers.", show_default=False
    ),
    beside: Path | None = typer.Argument(
        None, metavar="[FIXES]", help="As --gnss.", show_default=False
    ),
    gnss: Path | None = options.with_what("FIXES", "Fixes of a satellite receiver."),
    sensor: str | None = options.with_what(
        "NAME|FILE", f"{options.SENSOR[:-1]}; the nearest by noise, if not given."
    ),
    foot: bool = options.running(
        None, "Foot-mounted unit: zero velocity at each stance.", "--foot", default=False
    ),
    *,
    flags: options.LogFlags,
    fixes: options.FixFlags,
    out: Path = _file_to_write("navigate.toml", default=Path("navigate.toml")),
    force: bool = FORCE,
    quiet: bool = options.QUIET,
    verbose: bool = options.VERBOSE,
) -> None:
    """Propose the configuration of a navigation run from log and fixes.

    Then: strapdown navigate navigate.toml
    """
    from strapdown.config.logs import FixesTable
    from strapdown.config.spec import specify
    from strapdown.systems.navigation_draft import draft_navigation

    if beside is not None and gnss is not None:
        raise ConfigError("cli.fixes-twice", quantity="--gnss", files=[str(gnss), str(beside)])

    def draft(folder: Path, report: Progress) -> Any:
        keys = options.fix_keys(fixes.given(), gnss or beside)
        receiver = specify(FixesTable, **{"path": str(log), **keys}) if keys else None
        proposed = draft_navigation(
            _table(log, flags),
            folder=folder,
            axes=flags.axes,
            gnss=receiver,
            sensor=sensor,
            foot=foot,
            progress=report,
        )
        return (proposed,)

    question = "Assumed; correct it in {} if wrong:"
    _propose("navigate", [log], draft, question, out, force=force, quiet=quiet)


def _table(log: Path, flags: options.LogFlags) -> LogTable:
    from strapdown.config.logs import LogTable
    from strapdown.config.spec import specify

    return specify(LogTable, path=str(log), **options.log_keys(flags.given()))


def _propose(
    command: str,
    records: Sequence[Path],
    draft: Callable[[Path, Progress], Any],
    question: str,
    out: Path,
    *,
    force: bool,
    quiet: bool,
) -> None:
    """Write the drafts of a configuration, and print what was found and what the user must say.

    `draft`: called with the folder of the files, and progress; returns one draft, or one for each
    vehicle. `question`: above what the user is to confirm, with braces for the file; no list if
    empty.
    """
    usual = "case.toml" if command == "crash" else f"{command}.toml"
    if out.is_dir() or command != "crash":
        _check_free(out, usual, force=force)
    for record in records:
        refuse_result(record, "record" if command == "crash" else "log")
    with progress(quiet) as report:
        report("reading", 0.1)
        made = draft(out.absolute().parent, report)
        files = _files(out, [one.vehicle for one in made])
        for file in files:
            _check_free(file, usual, force=force)
        for file, one in zip(files, made, strict=True):
            _write_file(file, one.text, usual, force=force)
    if quiet:
        return
    # Findings about the records are those of each draft.
    print_findings(made[0].findings)
    page = console()
    told: list[Any] = []
    for file, one in zip(files, made, strict=True):
        if len(made) > 1:
            name = f": {one.name}" if one.name else ""
            page.print(f"\nVehicle {one.vehicle}{name}", style="bold")
        _print_draft(page, command, file, one, question, told)
    page.print(f"\nThen   strapdown {command} {' '.join(str(file) for file in files)}")


def _files(out: Path, vehicles: Sequence[str]) -> list[Path]:
    """File of each draft: that of the user for one; with the vehicle's number for several."""
    if len(vehicles) == 1:
        return [out]
    plain = all(v.isascii() and v.isalnum() and len(v) < SHORT for v in vehicles)
    if not plain or len({v.lower() for v in vehicles}) < len(vehicles):
        vehicles = [str(k) for k in range(1, len(vehicles) + 1)]
    return [out.with_stem(f"{out.stem}-{v}") for v in vehicles]


def _print_draft(
    page: Console, command: str, out: Path, made: Any, question: str, told: list[Any]
) -> None:
    """Print what was found for one file; `told`: what was left out and is listed already."""
    page.print("Found", style="bold")
    for line in made.found:
        page.print(f"  {line}")
    left_out = [s for s in made.left_out if s not in told]
    told += left_out
    if left_out:
        page.print("Left out", style="bold")
        for gone in left_out:
            page.print(f"  {gone.path}, {gone.what}: {gone.why}")
    page.print(f"\nWrote {out}")
    _list(page, f'To be filled in; replace each "?" in {out}:', made.asked)
    if question:
        _list(page, question.format(out), made.to_check)
    if command == "crash":
        page.print("\nCheck the lines marked 'assumed' as well.")


def _list(page: Console, head: str, lines: Sequence[Asked]) -> None:
    """Print the lines of the file that need the user, if any."""
    if lines:
        page.print(f"\n{head}", style="bold")
    for one in lines:
        page.print(f"  line {one.line:>3}  {one.key}: {one.what}")


def _check_free(path: Path, usual: str, *, force: bool) -> None:
    """Refuse an existing file, unless `force`, or a folder; `usual` is the usual name."""
    if path.is_dir():
        raise ConfigError("cli.out-is-folder", file=str(path), quantity="--out", path=path / usual)
    if path.exists() and not force:
        raise ConfigError("cli.file-exists", file=str(path), quantity="--out")


def _write_file(path: Path, text: str, usual: str, *, force: bool) -> None:
    """Write a text file atomically; refuse as `_check_free`."""
    _check_free(path, usual, force=force)
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
            _check_free(path, usual, force=force)
        except OSError:
            # A file system without links.
            _check_free(path, usual, force=force)
            staged.replace(path)
    finally:
        with suppress(FileNotFoundError):
            staged.unlink()
