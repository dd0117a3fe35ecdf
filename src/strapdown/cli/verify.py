"""``strapdown verify``."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import typer

from strapdown.cli.console import WORDS, console, progress
from strapdown.cli.shared_options import JSON, QUIET, VERBOSE, option, writing
from strapdown.errors import ConfigError

EPILOG = "Example: strapdown verify alexiev-fig4-attitude"
CHANGED, IN_PART = 6, 7
checking = partial(option, "What to check")


def verify(
    folder: Path = typer.Argument(metavar="DIR", help="A folder that a run wrote."),
    seal: str | None = checking("DIGEST", "The seal that was printed when it was made."),
    signer: str | None = checking(
        "KEY", "Public key by which it is to be signed: a file, or its name."
    ),
    inputs: list[Path] | None = checking(
        "PATH", "A file or folder outside DIR that may be read; repeatable.", "--input"
    ),
    again: Path | None = writing("DIR", "Keep the repeated run in this folder."),
    page: Path | None = writing("FILE.html", "Write the result on one page."),
    json: bool = JSON,
    quiet: bool = QUIET,
    verbose: bool = VERBOSE,
) -> None:
    """Run a result again from its own configuration and compare it bit for bit.

    Answers identical; numerically equal within a number (another processor or version); equal in
    part, if of some files only the text could be compared; or changed, and names what. Exit code 6
    where it has changed and 7 where it is equal in part, with --quiet, too.
    """
    from strapdown.bundle import to_json
    from strapdown.bundle.atomic_folder import replace_file
    from strapdown.report.verify import verification_page
    from strapdown.report.verify import verify as check

    if page is not None and page.exists():
        raise ConfigError("cli.file-exists", file=str(page), quantity="--page")
    if page is not None and page.resolve().is_relative_to(folder.resolve()):
        raise ConfigError("verify.inside", file=str(page), quantity="--page")
    with progress(quiet or json) as report:
        report("running it again", 0.5)
        result = check(folder, seal=seal, signer=signer, inputs=inputs or (), again=again)
    if page is not None:
        text = verification_page(result, folder, seal=seal, signer=signer)
        replace_file(page, text.encode())
    if json:
        finite = result.within if result.within < float("inf") else None
        told = {
            "verdict": result.verdict,
            "within": finite,
            "digest": result.digest,
            "details": list(result.details),
            "findings": [found.plain() for found in result.findings],
            "files": dict(result.files),
        }
        typer.echo(to_json(told), nl=False)
    elif not quiet:
        out = console()
        style = {"identical": "bold green", "changed": "bold red"}
        within = f" within {result.within:.1e}" if result.verdict == "numerically equal" else ""
        out.print(f"{result.verdict}{within}", style=style.get(result.verdict, "bold yellow"))
        for found in result.findings:
            for line in found.text(WORDS.get()).split("\n"):
                out.print(f"  {line}")
        if result.verdict == "changed":
            out.print(
                f"The manifest states the seal sha256 {result.digest}: this folder breaks it."
            )
        else:
            out.print(f"Seal  sha256 {result.digest}")
        if seal is None and signer is None and result.verdict != "changed":
            out.print("Compare it with the seal printed at the time, or give that by --seal.")
        if page is not None:
            out.print(f"Page  {page}")
    if result.verdict == "changed":
        raise typer.Exit(CHANGED)
    if result.verdict == "equal in part":
        raise typer.Exit(IN_PART)
