"""The application, its exit codes, and how errors are shown."""

from __future__ import annotations

import _thread
import atexit
import errno
import gc
import inspect
import io
import itertools
import os
import re
import shlex
import signal
import sys
import threading
from contextlib import ExitStack
from importlib import import_module
from typing import Any, NoReturn

import typer
from typer.core import TyperCommand, TyperGroup

from strapdown import __version__
from strapdown.cli.console import RESOURCES, WORDS, logged, tell
from strapdown.errors import ConfigError, Finding, StrapdownError, printable
from strapdown.parsers import start_for

_RESEND_S = 0.005

EXIT_CODES = (
    "Exit codes: 0 done; 1 an error of strapdown itself; 2 the command line was not understood; "
    "3 the data cannot be used; 4 what was asked for is unknown or cannot be done; 5 a computation "
    "diverged; 6 a result was changed after it was sealed; 7 verify could compare only a part."
)

#: Commands, each of a module, in the order of the help, with the first sentence of their own help:
#: the list of all is shown without importing them.
COMMANDS = {
    "doctor": "Examine logs: what is in them, what is wrong, the fix, and what they suffice for.",
    "allan": (
        "Find the noise of a sensor from a log at rest: Allan deviation, noise terms, sensor file."
    ),
    "calibrate": (
        "Find bias, scale, misalignment and g-sensitivity of a sensor from rests and turns."
    ),
    "sensors": "List the sensors of the catalogue, show one with its sources, or compare several.",
    "extrinsics": "Find rotation, lever arm and time offset between two sensors on one rigid body.",
    "attitude": (
        "Find the simplest attitude algorithm, and the lowest rate, of sufficient accuracy."
    ),
    "align": "Find roll, pitch and heading of a stationary body from its gyros and accelerometers.",
    "navigate": (
        "Find position, velocity and attitude over a record, by inertial sensors and measurements."
    ),
    "live": "Receive phones and sensors as they send, and show their attitude or navigation.",
    "outage": "Predict the drift during a GNSS outage, and the sources of the drift.",
    "init": "Propose a configuration from your records, with questions for missing data.",
    "convert": "Write what a log, a file of fixes or a trajectory holds in another format.",
    "crash": (
        "Reconstruct a crash: delta-V, direction of force, severity and path, each with its bound."
    ),
    "simulate": (
        "Write the log of a scenario, a trajectory or a crash together with its exact truth."
    ),
    "campaign": "Run many cases of one configuration, or one for each log, and say how often.",
    "worker": "Run cases of campaigns for a scheduler of dask, until it ends.",
    "compare": (
        "Show what differs between results: options, inputs, numbers, and positions over time."
    ),
    "studio": (
        "Look at logs, run the commands on them and compare results, in a browser on this machine."
    ),
    "verify": "Run a result again from its own configuration and compare it bit for bit.",
    "sign": "Sign the seal of a result with your key, so that others can tell that it is yours.",
    "export": (
        "Write a module as one file for a device: C99, with its own test and its most operations."
    ),
    "modules": "List the modules of each slot: algorithms, pipeline modules, sensors, formats.",
    "demo": "Run all systems and show the results on one page: navigation, attitude, crash.",
    "warm-up": (
        "Compile the kernels now instead of in the first runs, where they are not delivered "
        "compiled."
    ),
}


class Commands(TyperGroup):
    """Commands, each imported when it is run or listed."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command, or None; then all are there, so that similar names are proposed."""
        for name in [cmd_name] if cmd_name in COMMANDS else COMMANDS:
            self.commands[name] = self.commands.get(name) or _command(name)
        return self.commands.get(cmd_name)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help, with one sentence of each command."""
        loaded = self.commands
        self.commands = {name: TyperCommand(name, help=says) for name, says in COMMANDS.items()}
        try:
            super().format_help(ctx, formatter)
        finally:
            self.commands = loaded


def _command(name: str) -> Any:
    words = name.replace("-", "_")
    module = import_module(f"strapdown.cli.{words}")
    own: typer.Typer | None = getattr(module, "app", None)
    one = own or typer.Typer(rich_markup_mode="rich", add_completion=False)
    if own is None:
        one.command(name, epilog=module.EPILOG)(getattr(module, words))
    for command in one.registered_commands:
        # Line breaks of a docstring would wrap the help twice.
        text = inspect.getdoc(command.callback) or ""
        command.help = "\n\n".join(part.replace("\n", " ") for part in text.split("\n\n"))
    made = typer.main.get_group(one) if own else typer.main.get_command(one)
    made.name = name
    return made


app = typer.Typer(
    name="strapdown",
    cls=Commands,
    help="From an inertial sensor log to an answer that you can trust.",
    epilog=EXIT_CODES,
    no_args_is_help=True,
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
    ctx: typer.Context,
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Print the version."
    ),
) -> None:
    """From an inertial sensor log to an answer that you can trust."""
    WORDS.set("cli")
    RESOURCES.set(ctx.with_resource(ExitStack()))


#: Number of new objects before a garbage collection.
NEW_OBJECTS = 200_000


def run() -> None:
    """Run the command line; expected errors become a message and an exit code."""
    # With the default of 700 new objects, drawing takes a third longer; with 20,000, what the
    # imports of a short run made was looked through for 0.06 s.
    gc.set_threshold(NEW_OBJECTS)
    # At its exit Python looks through all objects several times, for a tenth of a short run.
    atexit.register(gc.freeze)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # A terminal without a degree sign shows a question mark.
            stream.reconfigure(errors="replace")
    # A closed terminal, or a scheduler that ends a job, must not leave partial files either.
    for number in (signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)):
        signal.signal(number, lambda got, _: sys.exit(128 + got))
    _keep_interrupts()
    try:
        with logged():
            _refuse_placeholders(sys.argv[1:])
            start_for(sys.argv[1:])  # beside the imports of the command
            app()
    except StrapdownError as error:
        finding = _by_option(error.finding, sys.argv[1:])
        _tell(error.finding)
        text = "\n  ".join([finding.text(WORDS.get()), *_answers(finding)])
        _fail(text, error.exit_code)
    except OSError as error:
        if error.errno == errno.EPIPE:
            _reader_gone()
        what = Finding(
            "cli.system-error",
            severity="error",
            file=str(error.filename) if error.filename else None,
            reason=error.strerror or str(error),
        )
        _tell(what)
        _fail(what.text(WORDS.get()), 4)


def _tell(finding: Finding) -> None:
    """Tell an error to the program that follows this run, the studio, in its words."""
    from strapdown.studio.reading_process import told

    tell({"error": told(finding.replace(severity="error"))})


#: Placeholders of proposed options whose value cannot be inferred, for the user to fill in.
PLACEHOLDERS = {
    **dict.fromkeys(("--gyro-unit", "--accel-unit", "--time-unit"), "UNIT"),
    **dict.fromkeys(("--heading", "--lat", "--lon"), "DEG"),
    **dict.fromkeys(("--alt", "--gnss-position-sd", "--gnss-datum-height"), "M"),
    "--rate": "HZ",
    "--sensor": "SENSOR",
    "--axes": "AXES",
    "--columns": "NAME",
}


def _by_option(finding: Finding, given: list[str]) -> Finding:
    """Return a finding about a choice with the option that made it."""
    option = f"--{(finding.quantity or '').replace('_', '-')}"
    if finding.file or not any(word.partition("=")[0] == option for word in given):
        return finding
    known = {name for param in _parameters(given[0], given) for name in param.opts}
    return finding.replace(quantity=option) if option in known else finding


def _blanks(flags: list[str]) -> dict[str, str]:
    """Return the options that have a placeholder for their value, with it."""
    return {
        option: word
        for option, value in itertools.pairwise(flags)
        if (word := PLACEHOLDERS.get(option)) and re.search(rf"(^|=){word}(,|$)", value)
    }


def introduced(flags: list[str], given: list[str]) -> str:
    """Return the words before a proposed command: whether it is to be filled in, and with what."""
    blanks = _fill_in(flags, given)
    return f"Fill in {blanks}" if blanks else "As inferred"


def _fill_in(flags: list[str], given: list[str]) -> str:
    """Return the meaning of the placeholders, by the help of their options."""
    params = [p for name in (given[0], "attitude", "navigate") for p in _parameters(name, given)]
    said = []
    for option, word in _blanks(flags).items():
        text = next((str(p.help) for p in params if option in p.opts), "")
        said.append(f"{word} of {option}" + (f" ({text.rstrip('.')})" if text else ""))
    return "; ".join(said)


def _parameters(name: str, given: list[str]) -> list[Any]:
    """Return the parameters of a command, and of that of its own commands that is given."""
    if name not in COMMANDS:
        return []
    command = _command(name)
    own = [c for n, c in getattr(command, "commands", {}).items() if n in given]
    return [p for one in (*own, command) for p in one.params]


def _refuse_placeholders(given: list[str]) -> None:
    """Refuse a proposed command in which a placeholder is left: ConfigError."""
    # A column may have that name, and the reader says which there are.
    left = {o: w for o, w in _blanks(given).items() if o != "--columns"}
    if left:
        said = _fill_in([word for pair in left.items() for word in pair], given)
        (option, word), *_ = left.items()
        raise ConfigError("cli.placeholder-left", quantity=option, word=word, placeholders=said)


def _answers(refused: Finding) -> list[str]:
    """Return the lines that answer what a file leaves open, ready to paste.

    A command with options; beside a configuration file the keys, and the table that takes them.
    Empty if the command was refused with these answers.
    """
    flags, given = refused.data.get("flags"), sys.argv[1:]
    if not flags:
        return []
    keys = refused.data.get("keys")
    if WORDS.get() == "file":
        # Of a fault of the file itself, `keys` are names.
        if not isinstance(keys, str):
            return []
        table = "log"
        if str(flags).startswith("--gnss-"):
            table = "gnss" if given[:1] == ["align"] else "aiding.gnss"
        blanks = _fill_in(shlex.split(str(flags)), given)
        said = f"Fill in {blanks}, and write" if blanks else "Write"
        lines = re.split(r"; (?=\w+ = )", keys)
        return [f"{said} into the table [{table}] of the file:", *(f"  {line}" for line in lines)]
    if set(shlex.split(str(flags))) <= set(given):
        return []
    said = introduced(shlex.split(str(flags)), given)
    return [f"{said}: strapdown {_pasted(shlex.join(given))} {_pasted(str(flags))}"]


def _pasted(words: str) -> str:
    """Return words of a command line without control characters, to the same values in bash."""
    if printable(words) == words:
        return words
    return " ".join(
        shlex.quote(word)
        if printable(word) == word
        else "$'" + printable(word.replace("\\", r"\\").replace("'", r"\'")) + "'"
        for word in shlex.split(words)
    )


def _fail(message: str, code: int) -> NoReturn:
    colour = typer.colors.RED if sys.stderr.isatty() else None
    typer.secho(f"error: {printable(message, lines=True)}", err=True, fg=colour)
    sys.exit(code)


def _reader_gone() -> NoReturn:
    """Exit quietly: the reader has closed the pipe, as with ``| head``, which is not an error."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.__stdout__.fileno() if sys.__stdout__ else 1)
    sys.exit(0)


def _keep_interrupts() -> None:
    """Deliver an interrupt again where Python drops it.

    A signal handler may run within a callback of a weak reference or a finalizer, whose exceptions
    Python reports and ignores: the program would continue to its end. The signal is sent again
    until it is raised elsewhere.
    """
    before = sys.unraisablehook

    def hook(lost: Any) -> None:
        number = _signal_of(lost)
        if number is None:
            before(lost)
            return
        # From another thread and later: within the callback it would be dropped once more.
        again = threading.Timer(_RESEND_S, _thread.interrupt_main, (number,))
        again.daemon = True
        again.start()

    sys.unraisablehook = hook


def _signal_of(lost: Any) -> int | None:
    """Signal of a dropped exception; None for another error."""
    if issubclass(lost.exc_type, KeyboardInterrupt):
        return int(signal.SIGINT)
    if issubclass(lost.exc_type, SystemExit):
        code = getattr(lost.exc_value, "code", None)
        if isinstance(code, int) and code > 128:
            return code - 128
    return None
