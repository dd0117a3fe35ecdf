"""The process that parses: it reads requests from its input and answers on its output.

Its limits hold from before the first file: nothing can be written, no core is left, and memory
and time are set for each file anew. It ends when its input does, and while it parses, too, if the
caller is gone: that closes the pipe that is this process's standard error.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import signal
import sys
from pathlib import Path
from typing import Any

from strapdown.errors import ConfigError, StrapdownError
from strapdown.parsers import wire

#: Modules whose functions can be asked for.
MODULES = ("hdf5", "matlab", "parquet", "archives", "workbooks", "recorders", "bags")


def call(function: str, path: Path, arguments: dict[str, Any]) -> Any:
    """Call ``module.name`` of this package, or ``package.module:name`` of another."""
    module, name = _names(function)
    if name.startswith("_"):
        raise LookupError(function)
    return getattr(importlib.import_module(module), name)(path, **arguments)


def _names(function: str) -> tuple[str, str]:
    if ":" in function:
        module, _, name = function.partition(":")
        return module, name
    module, _, name = function.partition(".")
    if module not in MODULES:
        raise LookupError(function)
    return f"strapdown.parsers.{module}", name


def main() -> None:
    """Answer requests until the input ends."""
    source, sink, caller = os.dup(0), os.dup(1), os.dup(2)
    nothing = os.open(os.devnull, os.O_RDWR)
    # What libraries print must not be an answer.
    os.dup2(nothing, 0)
    os.dup2(nothing, 1)
    os.dup2(nothing, 2)
    _end_with_caller(caller)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Arrow would import it to convert columns: 0.3 s for no function that is used here.
    sys.modules["pandas"] = None  # type: ignore[assignment]
    requests = os.fdopen(source, "rb")
    locked = False
    while line := requests.readline():
        asked = json.loads(line)
        # Before the limits, which are for the file; before the lock, because a module that is not
        # compiled yet is written.
        with contextlib.suppress(Exception):  # the call says why
            importlib.import_module(_names(asked["function"])[0])
        if not locked:
            locked = True
            _lock()
        _limit(asked["memory"], asked["seconds"], asked["patience"])
        buffers = _encoded(_answer(asked))
        _limit(None, None, 0)
        for buffer in buffers:
            view = memoryview(buffer)
            while view:
                view = view[os.write(sink, view) :]
    os._exit(0)


def _answer(asked: dict[str, Any]) -> dict[str, Any]:
    try:
        return {"done": call(asked["function"], Path(asked["path"]), asked["arguments"])}
    except StrapdownError as error:
        kind = "ConfigError" if isinstance(error, ConfigError) else "DataError"
        return {"error": kind, "finding": error.finding.plain()}
    except MemoryError:
        return {"failed": "memory"}
    except Exception as error:  # a damaged file can break any of the libraries anywhere
        return {"failed": f"{type(error).__name__}: {error}"[:300]}


def _encoded(answer: dict[str, Any]) -> list[Any]:
    try:
        return wire.encode(answer)
    except MemoryError:
        return wire.encode({"failed": "memory"})
    except Exception as error:  # names of a file that are no text
        return wire.encode({"failed": f"{type(error).__name__}: {error}"[:300]})


def _lock() -> None:
    """Give up what no parser needs: files that it writes, and core dumps."""
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform == "linux":
        _landlock()


def _landlock() -> None:
    """Refuse, by the kernel of Linux, to write, make or remove files, and to connect to anything.

    It is there since 5.13, and for connections since 6.7; without it the limits above are left.
    """
    import ctypes

    create, restrict = 444, 446  # numbers of the system calls, on every architecture
    no_new_privileges, version = 38, 1
    libc = ctypes.CDLL(None, use_errno=True)
    abi = libc.syscall(create, None, ctypes.c_size_t(0), ctypes.c_uint(version))
    if abi < 1:
        return
    # Bits 1 and 4 to 12: write to a file, remove and make entries. Bits 13, 14: refer, truncate.
    files = 1 << 1 | sum(1 << bit for bit in range(4, 13))
    files |= (1 << 13 if abi >= 2 else 0) | (1 << 14 if abi >= 3 else 0)
    rules = (ctypes.c_uint64 * 2)(files, 0b11 if abi >= 4 else 0)
    size = ctypes.c_size_t(16 if abi >= 4 else 8)
    handle = libc.syscall(create, rules, size, ctypes.c_uint(0))
    if handle >= 0:
        libc.prctl(no_new_privileges, 1, 0, 0, 0)
        libc.syscall(restrict, ctypes.c_int(handle), ctypes.c_uint(0))
        os.close(handle)


def _limit(memory: int | None, seconds: float | None, patience: float) -> None:
    """Set what may be taken from now on: memory and processor time beside what is in use.

    `patience`: time on a clock, s, after which the kernel ends the process; none if 0.
    """
    if sys.platform == "win32":
        return
    import resource

    def soft(which: int, value: float | None) -> None:
        _, hard = resource.getrlimit(which)
        wanted = resource.RLIM_INFINITY if value is None else int(value)
        if hard != resource.RLIM_INFINITY and (value is None or wanted > hard):
            wanted = hard
        resource.setrlimit(which, (wanted, hard))

    spent = resource.getrusage(resource.RUSAGE_SELF)
    soft(resource.RLIMIT_CPU, seconds and spent.ru_utime + spent.ru_stime + 1.0 + seconds)
    signal.setitimer(signal.ITIMER_REAL, patience)
    if sys.platform == "linux":  # elsewhere the limit is not kept, or counts other things
        soft(resource.RLIMIT_AS, memory and memory + _in_use())


def _in_use() -> int:
    """Return the address space that is in use, bytes."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")


def _end_with_caller(pipe: int) -> None:
    """Let the end of the caller end this process, whatever it does, where the system can.

    `pipe`: the end for writing of a pipe of which the caller holds the other and never reads. The
    input would not do: a signal of its last request may come late, and would end the process, too.
    """
    try:
        import fcntl
        import select

        fcntl.fcntl(pipe, fcntl.F_SETOWN, os.getpid())
        asynchronous = os.O_ASYNC  # type: ignore[attr-defined, unused-ignore]
        fcntl.fcntl(pipe, fcntl.F_SETFL, fcntl.fcntl(pipe, fcntl.F_GETFL) | asynchronous)
        gone = select.poll()
        gone.register(pipe, select.POLLERR)
        if gone.poll(0):
            os._exit(0)
    except (ImportError, AttributeError, OSError):
        pass
