"""``strapdown export``."""

from __future__ import annotations

from pathlib import Path

import typer

from strapdown.cli.console import console
from strapdown.cli.shared_options import OutFlags, spread

EPILOG = (
    "Example: strapdown export ned:height=damped navigation.c\n\n"
    "Example: strapdown export wd:states=15,observations=3 update.c --json\n\n"
    "Example: strapdown export error-state attitude.py"
)


@spread
def export(
    module: str = typer.Argument(
        metavar="MODULE",
        help="What to write, with its options, such as ned:height=damped (strapdown modules).",
    ),
    file: Path = typer.Argument(
        metavar="FILE", help="FILE.c: C99; FILE.py: MicroPython, of an attitude."
    ),
    *,
    write: OutFlags,
) -> None:
    """Write a module as one file for a device: C99, with its own test and its most operations.

    A step of a mechanization, a low-pass, a measurement update, an attitude algorithm or an
    orientation filter. For a sensor's own units and axes: attitude --export.
    """
    from strapdown.bundle import to_json
    from strapdown.bundle.atomic_folder import replace_file
    from strapdown.report.attitude_export import WRITERS, check_export, export_module

    check_export(file, write.force, quantity="FILE")
    made = export_module(module, file.suffix.lower())
    replace_file(file, made.text.encode())
    language = WRITERS[file.suffix.lower()][0]
    if write.json:
        of = {"module": made.name, "file": str(file), "language": language}
        cost = {"operations": made.operations, "memory_numbers": made.memory}
        typer.echo(to_json({**of, **cost}), nl=False)
    elif not write.quiet:
        listed = ", ".join(f"{n} {kind}" for kind, n in made.operations.items() if n)
        console().print(f"{language}   {file}: {made.name}", soft_wrap=True)
        console().print(
            f"At most {listed} each time; {made.memory} numbers of memory", soft_wrap=True
        )
