"""The application, its exit codes, and how errors are shown."""

from __future__ import annotations

import os
import sys

import typer

from strapdown import __version__
from strapdown.cli import attitude, demo, modules, simulate, verify
from strapdown.exceptions import StrapdownError

EXIT_CODES = """
Exit codes: 0 done; 1 an error of strapdown itself; 2 the command line was not understood;
3 the data cannot be used; 4 what was asked for is unknown or cannot be done; 5 a computation
diverged; 6 verify found a change.
"""

app = typer.Typer(
    name="strapdown",
    help="From an inertial sensor log to an answer that you can trust.",
    epilog=EXIT_CODES,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"strapdown {__version__}")
        raise typer.Exit


@app.callback()
def main(
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Print the version."
    ),
) -> None:
    """From an inertial sensor log to an answer that you can trust."""


app.command("attitude", epilog=attitude.EPILOG)(attitude.attitude)
app.command("simulate", epilog=simulate.EPILOG)(simulate.simulate)
app.command("verify", epilog=verify.EPILOG)(verify.verify)
app.command("modules")(modules.modules)
app.command("demo", epilog=demo.EPILOG)(demo.demo)


def run() -> None:
    """Run the command line; errors that are foreseen become a message and an exit code."""
    try:
        app()
    except StrapdownError as error:
        colour = sys.stderr.isatty()
        typer.secho(f"error: {error}", err=True, fg=typer.colors.RED if colour else None)
        sys.exit(error.exit_code)
    except BrokenPipeError:
        # The reader of our output has gone, as `| head` does; nothing is wrong here.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
