"""The process in which files are parsed, seen from the one that asks.

There is one for a process of Python, which starts with the first file that needs it, or earlier
beside slow imports (`start`). It is started by a command and not by multiprocessing, whose ways
need a ``__main__`` guard in the caller's script. Calls of several threads take turns; after a fork
the new process starts its own.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import select
import signal
import stat
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from strapdown.errors import ConfigError, DataError, Finding, StrapdownError
from strapdown.parsers.limits import declared_most, memory_most, seconds_most, size_of, text_most

if TYPE_CHECKING:
    from strapdown.parsers.wire import Room

if sys.platform == "linux":
    import fcntl

#: Endings of files that are parsed elsewhere.
ENDINGS = (
    *(".h5", ".hdf5", ".hdf", ".mat", ".npz", ".zip", ".xlsx", ".xlsm"),
    *(".parquet", ".pq", ".geoparquet"),
    *(".ulg", ".ulog", ".bag", ".mcap", ".db3", ".ubx", ".tlog", ".fit", ".gpx"),
)

#: Functions that are asked for before any other of a file of an ending: its reading begins beside
#: the imports.
FIRST = dict.fromkeys((".parquet", ".pq", ".geoparquet"), "parquet.table")

#: Bytes that pass at a time, where the system can; each time, the two processes take turns.
PIPE = 1 << 20
#: Time on a clock for one of the processor: other programs run, too.
PATIENCE = 3.0
#: How long its own clock may be late before it is ended from outside, s.
LATE = 5.0
#: One thread of each library is enough, and each reserves memory; Arrow's own allocators, too. A
#: warning that the caller wants as an error is none in there.
_ENVIRONMENT = {
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "PYTHONWARNINGS": "ignore",
    # What would fill the pipe that nobody reads.
    "PYTHONVERBOSE": "",
    "PYTHONPROFILEIMPORTTIME": "",
    "ARROW_DEFAULT_MEMORY_POOL": "system",
}
_COMMAND = "import sys; sys.path[:] = {path!r}; from strapdown.parsers.worker import main; main()"

_lock = threading.RLock()
_process: subprocess.Popen[bytes] | None = None
#: A request whose answer nobody has read yet.
_ahead = b""
#: Files that ended the process: each is asked for by several formats, and once for each stream.
_refused: dict[tuple[Any, ...], Finding] = {}
_MOST_REFUSED = 64
#: Behavior of the same file again.
_LASTING = ("io.parser-crashed", "io.parser-out-of-memory", "io.parser-out-of-time")
_in_place = False


@contextlib.contextmanager
def in_place() -> Iterator[None]:
    """Parse in this process, without limits: for tests that replace a library."""
    global _in_place
    before, _in_place = _in_place, True
    try:
        yield
    finally:
        _in_place = before


def parse(
    function: str,
    path: Path,
    *,
    label: str = "",
    memory: int = 0,
    room: Room | None = None,
    **arguments: Any,
) -> Any:
    """Run a function on a file in the process that parses.

    `function`: ``module.name`` of this package, or ``package.module:name`` of another distribution,
    which returns the like; its first parameter is the path. `path`: a file or folder, whose size
    sets the limits. `label`: name of the file in messages; by default that of `path`. `memory`
    (bytes): limit of memory instead of `limits.memory_most`. `room`: makes an array of a shape, of
    which columns of doubles that follow one another are rows. `**arguments`: further ones, of JSON.
    Dictionaries, lists, text, numbers and arrays; tuples have become lists. DataError: the function
    raised it; or it ended the process, took too much memory or time, or failed.
    """
    label = label or path.name
    if _in_place:
        from strapdown.parsers import worker

        try:
            return worker.call(function, path, arguments)
        except StrapdownError as error:
            raise type(error)(error.finding, file=label) from None
    state = () if memory else _state(path)
    if known := _refused.get(state):
        raise DataError(known, file=label)
    size = size_of(path)
    asked = _request(function, path, size, memory, arguments)
    try:
        with _lock:
            answer = _exchange(asked, label, (declared_most(size), text_most(size), room))
        return _taken(answer, label, asked["memory"])
    except DataError as error:
        if state and error.finding.code in _LASTING and not error.finding.data.get("on_clock"):
            if len(_refused) >= _MOST_REFUSED:
                _refused.clear()
            _refused[state] = error.finding
        raise


def _request(
    function: str, path: Path, size: int, memory: int, arguments: dict[str, Any]
) -> dict[str, Any]:
    seconds = seconds_most(size)
    return {
        "function": function,
        # The folder of the caller may have changed since the other process started.
        "path": str(path.absolute()),
        "arguments": arguments,
        "memory": memory or memory_most(size),
        "seconds": seconds,
        "patience": PATIENCE * seconds,
    }


def _state(path: Path) -> tuple[Any, ...]:
    """Return what shows that a file is the same; empty for a folder."""
    try:
        about = path.stat()
    except OSError:
        return ()
    if not stat.S_ISREG(about.st_mode):
        return ()
    return str(path.absolute()), about.st_ino, about.st_size, about.st_mtime_ns


def start() -> None:
    """Start the process now, without waiting for it, where a file that needs it is expected."""
    with _lock, contextlib.suppress(OSError):
        _running()


def start_for(names: Iterable[str]) -> None:
    """Start the process now if one of some words is likely the name of a file that needs it.

    If that is the only one, its reading begins, where what is asked for first is known.
    """
    files = [Path(name) for name in names if name.lower().endswith(ENDINGS)]
    if not files:
        return
    start()
    function = FIRST.get(files[0].suffix.lower())
    if function and len(files) == 1 and files[0].is_file():
        _ask_ahead(function, files[0])


def _ask_ahead(function: str, path: Path) -> None:
    global _ahead
    with _lock, contextlib.suppress(OSError, DataError):
        if not _ahead:
            line = _line(_request(function, path, size_of(path), 0, {}))
            _asked(line, path.name)
            _ahead = line


def _line(asked: dict[str, Any]) -> bytes:
    return json.dumps(asked).encode() + b"\n"


def _running() -> subprocess.Popen[bytes]:
    global _process
    if _process is None or _process.poll() is not None:
        _forget()
        if not sys.executable or getattr(sys, "frozen", False):
            raise OSError("this program is not run by a Python that can be started again")
        folders = [str(Path(p).absolute()) for p in sys.path if isinstance(p, str)]
        command = _COMMAND.format(path=folders)
        _process = subprocess.Popen(
            [sys.executable, "-P", "-c", command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            # Never read: its end tells the process that this one is gone.
            stderr=subprocess.PIPE if os.name == "posix" else subprocess.DEVNULL,
            cwd=Path(sys.executable).anchor,  # the caller may want to remove its own
            bufsize=0,
            env=os.environ | _ENVIRONMENT,
            # An interrupt at the terminal is for the caller, which ends it.
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        if sys.platform == "linux" and _process and _process.stdout:
            with contextlib.suppress(OSError):  # more than this user may have
                fcntl.fcntl(_process.stdout, fcntl.F_SETPIPE_SZ, PIPE)
    return _process


def _exchange(asked: dict[str, Any], label: str, limits: tuple[int, int, Room | None]) -> Any:
    """Send a request, and return the answer to it within the limits of `wire.decode`.

    `_lock` is held.
    """
    from strapdown.parsers import wire

    global _ahead
    whole, line = False, _line(asked)
    try:
        if _ahead and _ahead != line:
            _forget()
        known, _ahead = _ahead, b""
        process = _process if known and _process else _asked(line, label)
        with _watched(process, asked["patience"] + LATE) as stream:
            answer = wire.decode(stream, *limits)
        whole = True
        return answer
    except TimeoutError:
        said = {"seconds": asked["seconds"], "on_clock": True}
        raise DataError("io.parser-out-of-time", file=label, data=said) from None
    except EOFError:
        raise _death(process.wait(), label, asked["seconds"], asked["memory"]) from None
    except wire.BrokenAnswerError as error:
        reason = f"answer: {error}"
        raise DataError("io.parser-failed", file=label, reason=reason) from None
    finally:
        if not whole:  # an interrupt, too, leaves an answer that nobody asked for
            _forget()


def _asked(request: bytes, label: str) -> subprocess.Popen[bytes]:
    """Send a request; a process that was ended while it was idle is started again."""
    for again in (False, True):
        try:
            process = _running()
            assert process.stdin is not None
            rest = memoryview(request)
            while rest:
                rest = rest[process.stdin.write(rest) :]
            return process
        except (OSError, ValueError) as error:
            _forget()
            if again:
                raise DataError("io.parser-not-started", file=label, reason=str(error)) from None
    raise AssertionError


@contextlib.contextmanager
def _watched(process: subprocess.Popen[bytes], seconds: float) -> Iterator[Any]:
    """Give the stream of answers, whose end is waited for by so many seconds. TimeoutError."""
    assert process.stdout is not None
    if os.name == "posix":
        yield _Timed(process.stdout, time.monotonic() + seconds)
        return
    late = threading.Event()

    def end() -> None:
        late.set()
        process.kill()

    watch = threading.Timer(seconds, end)
    watch.daemon = True
    watch.start()
    try:
        yield process.stdout
    except EOFError:
        if late.is_set():
            raise TimeoutError from None
        raise
    finally:
        watch.cancel()


class _Timed:
    """A pipe that is read until an instant of the monotonic clock."""

    def __init__(self, stream: Any, end: float) -> None:
        self._stream, self._end = stream, end
        self._ready = select.poll()
        self._ready.register(stream, select.POLLIN | select.POLLHUP)

    def readinto(self, view: memoryview) -> int:
        if not self._ready.poll(max(0.0, 1e3 * (self._end - time.monotonic()))):
            raise TimeoutError
        return int(self._stream.readinto(view))


def _death(code: int, label: str, seconds: float, memory: int) -> DataError:
    """Make the error of a process that ended without an answer."""
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"exit code {code}"
    if name in ("SIGXCPU", "SIGALRM"):
        on_clock = name == "SIGALRM"  # other programs may have had the processor
        return DataError("io.parser-out-of-time", file=label, seconds=seconds, on_clock=on_clock)
    if name == "SIGKILL":  # by the system, which was short of memory, or by a person
        return DataError("io.parser-killed", file=label, memory=memory / 2**20)
    return DataError("io.parser-crashed", file=label, signal=name)


def _taken(answer: Any, label: str, memory: int) -> Any:
    """Return what was asked for, or raise what it says; the answer is not trusted."""
    if isinstance(answer, dict) and "done" in answer:
        return answer["done"]
    failed = answer.get("failed") if isinstance(answer, dict) else "no answer"
    if failed == "memory":
        with _lock:
            _forget()  # it may keep what it took
        raise DataError("io.parser-out-of-memory", file=label, memory=memory / 2**20)
    if failed is not None:
        raise DataError("io.parser-failed", file=label, reason=str(failed))
    try:
        said = answer["finding"]
        where = {k: said[k] for k in ("row", "quantity") if k in said}
        kind = ConfigError if answer["error"] == "ConfigError" else DataError
        error: StrapdownError = kind(str(said["code"]), file=label, data=said["data"], **where)
        error.finding.text()
    except Exception:  # a code that is none, data that its sentence lacks
        raise DataError("io.parser-failed", file=label, reason="no error of a parser") from None
    raise error


def _forget() -> None:
    """End the process, if there is one."""
    global _ahead, _process
    process, _process, _ahead = _process, None, b""
    if process is None:
        return
    process.kill()
    for stream in (process.stdin, process.stdout, process.stderr):
        if stream is not None:
            with contextlib.suppress(OSError):
                stream.close()
    process.wait()


def _after_fork() -> None:
    """Leave the process to the one that started it: its pipes are shared no longer."""
    global _ahead, _lock, _process
    process, _process, _ahead, _lock = _process, None, b"", threading.RLock()
    if process is not None:
        for stream in (process.stdin, process.stdout, process.stderr):
            if stream is not None:
                stream.close()
        process.returncode = 0  # nobody here waits for it


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
atexit.register(_forget)
