"""A process in which everything is read that a user drops into the studio, and its keeper.

A hostile file may crash a reader, hang it, or fill the memory: the server has no part in it. A
question has a limit of time and of memory; a process that passes one, or dies, is ended and
replaced, and the question is answered by an error. Messages are lines of JSON.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from strapdown.campaign.case_process import end_with, limit_memory
from strapdown.errors import Finding, StrapdownError
from strapdown.parsers.limits import memory_most, seconds_most, size_of

#: Memory beside that of the parsers, bytes: what the packages and the tables of a log take.
MEMORY, MEMORY_PER_BYTE = 3 << 30, 24
#: Time beside that of the parsers, s, and s per MiB: tests of every channel of a log.
SECONDS, SECONDS_PER_MIB = 60.0, 5.0
#: Longest answer, bytes.
LONGEST = 64 << 20

#: Questions, each a function of `studio` with a folder, in which the process is, and arguments of
#: JSON.
QUESTIONS = {
    "look": "strapdown.studio.look:look",
    "stream": "strapdown.studio.look:stream",
    "propose": "strapdown.studio.configuration:propose",
    "check": "strapdown.studio.configuration:check",
    "kinds": "strapdown.studio.forms:kinds",
    "sample": "strapdown.studio.app:sample",
    "command": "strapdown.studio.configuration:command",
    "run": "strapdown.studio.runs:run",
    "run_stream": "strapdown.studio.runs:run_stream",
    "track": "strapdown.studio.runs:track",
    "export": "strapdown.studio.runs:export",
    "compare": "strapdown.studio.runs:compare",
    "quick": "strapdown.studio.quick_crash:quick",
}


class Refused(Exception):  # noqa: N818
    """Answer of the process where a question has no other.

    Attributes
    ----------
    error : dict
        ``code``, ``text`` and ``remedy``, as the server shows them.
    kind : str
        Name of the class of the error.
    """

    def __init__(self, error: dict[str, Any], kind: str) -> None:
        super().__init__(error["code"])
        self.error, self.kind = error, kind


def told(finding: Finding) -> dict[str, Any]:
    """Return a finding as JSON for the front end: code, severity, place, sentence, remedy."""
    where = {k: v for k in ("file", "row", "line", "quantity") if (v := getattr(finding, k))}
    said = {"text": finding.sentence("studio"), "remedy": finding.advice("studio")}
    return {"code": finding.code, "severity": finding.severity, **where, **said}


# --- within the process -------------------------------------------------------------------


def main() -> None:
    """Answer questions on the standard streams until the input ends."""
    answers = os.fdopen(os.dup(1), "wb")
    # The output that a library prints must not be among the answers.
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    asked = os.fdopen(os.dup(0), "rb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    end_with(os.getppid())
    for line in asked:
        question = json.loads(line)
        limit_memory(question["memory"])
        answer = _answered(question)
        answers.write(json.dumps(answer, allow_nan=False).encode() + b"\n")
        answers.flush()


def _answered(question: Mapping[str, Any]) -> dict[str, Any]:
    from importlib import import_module

    module, _, name = QUESTIONS[question["name"]].partition(":")
    try:
        function = getattr(import_module(module), name)
        return {"done": function(Path(question["folder"]), **question["arguments"])}
    except StrapdownError as error:
        return {"error": told(error.finding), "kind": type(error).__name__}
    except MemoryError:
        return _failed("studio.reading-out-of-memory", memory=question["memory"] / 2**30)
    except RecursionError:
        return _failed("studio.reading-failed", reason="RecursionError")
    except Exception as error:  # a fault of ours must not end the studio
        return _failed("studio.reading-failed", reason=f"{type(error).__name__}: {error}"[:300])


def _failed(code: str, **data: Any) -> dict[str, Any]:
    return {"error": told(Finding(code, severity="error", data=data)), "kind": "DataError"}


# --- its keeper ---------------------------------------------------------------------------


class ReadingProcess:
    """Keeps the process, and starts another where it ends.

    Parameters
    ----------
    folder : Path
        Of the studio.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._process: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()

    def ask(self, question: str, *, files: tuple[Path, ...] = (), **arguments: Any) -> Any:
        """Ask, and wait for the answer.

        Parameters
        ----------
        question : str
            Of `QUESTIONS`.
        files : tuple of Path
            What will be read: its size sets the limits.
        **arguments
            Of JSON.

        Raises
        ------
        Refused
            The process refused, was ended, or took too much.
        """
        size = sum(size_of(path) for path in files)
        seconds = SECONDS + SECONDS_PER_MIB * size / 2**20 + seconds_most(size)
        memory = MEMORY + MEMORY_PER_BYTE * size + memory_most(size)
        line = {"name": question, "folder": str(self._folder), "arguments": arguments}
        with self._lock:
            answer = self._exchange({**line, "memory": memory}, seconds)
        if "error" in answer:
            raise Refused(answer["error"], answer["kind"])
        return answer["done"]

    def _exchange(self, question: dict[str, Any], seconds: float) -> Any:
        process = self._running()
        assert process.stdin is not None
        whole = False
        try:
            process.stdin.write(json.dumps(question).encode() + b"\n")
            process.stdin.flush()
            answer = json.loads(self._line(process, time.monotonic() + seconds))
            whole = True
            return answer
        except TimeoutError:
            return _failed("studio.reading-out-of-time", seconds=seconds)
        except (OSError, EOFError, ValueError):
            code = process.poll()
            if code is None:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    code = process.wait(1.0)
            name = _signal_name(code)
            return _failed("studio.reading-crashed", signal=name)
        finally:
            if not whole:
                self.end()

    def _line(self, process: subprocess.Popen[bytes], end: float) -> bytes:
        """Read one line by an instant of the monotonic clock. TimeoutError, EOFError."""
        assert process.stdout is not None
        found = bytearray()
        handle = process.stdout.fileno()
        while not found.endswith(b"\n"):
            left = end - time.monotonic()
            if left <= 0.0 or not select.select([handle], [], [], left)[0]:
                raise TimeoutError
            part = os.read(handle, 1 << 20)
            if not part or len(found) > LONGEST:
                raise EOFError
            found += part
        return bytes(found)

    def _running(self) -> subprocess.Popen[bytes]:
        if self._process is None or self._process.poll() is not None:
            self.end()
            folders = [str(Path(p).absolute()) for p in sys.path if isinstance(p, str)]
            code = (
                f"import sys; sys.path[:] = {folders!r}; "
                "from strapdown.studio.reading_process import main; main()"
            )
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", code],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                cwd=self._folder,
                start_new_session=True,
            )
        return self._process

    def end(self) -> None:
        """End the process, if there is one."""
        process, self._process = self._process, None
        if process is None:
            return
        with contextlib.suppress(OSError):
            os.killpg(process.pid, signal.SIGKILL)
        process.kill()
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                with contextlib.suppress(OSError):
                    stream.close()
        process.wait()


def _signal_name(code: int | None) -> str:
    if code is not None and -code in set(signal.Signals):
        return signal.Signals(-code).name
    return f"exit code {code}"
