"""A command as a fork of a process that has all imported, so that a run begins at its own work."""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from unittest.mock import patch

from strapdown.cli import main


def run_here(words: Sequence[object]) -> int:
    """Run a command in this process, and return its exit code."""
    sys.argv = ["strapdown", *map(str, words), "--quiet"]
    try:
        main.run()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
        return 1
    return 0


def warmed(words: Sequence[object]) -> int:
    """Run a command in this process, so that later forks find all imported; its PDF is empty.

    The threads that lay out a PDF are not in a fork, which would wait for them.
    """
    with patch("typst.compile", return_value=b""):
        return run_here(words)


def start(
    folder: Path,
    words: Sequence[object],
    *,
    stdin: int | None = None,
    wait: Callable[[], object] | None = None,
) -> int:
    """Begin a command as a fork with `folder` as its place, and return its process.

    Its standard output and error go to the file ``log`` there. It begins when `wait`, which it
    calls, returns.
    """
    child = os.fork()
    if child:
        return child
    os.chdir(folder)
    log = os.open("log", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(log, 1)
    os.dup2(log, 2)
    if stdin is not None:
        os.dup2(stdin, 0)
    sys.stdin, sys.stdout, sys.stderr = os.fdopen(0), os.fdopen(1, "w"), os.fdopen(2, "w")
    if wait is not None:
        wait()
    code = run_here(words)
    with suppress(OSError):
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(code)
