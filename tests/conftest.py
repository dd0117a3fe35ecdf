"""Where the recordings are, and a command line that runs in this process."""

from __future__ import annotations

import gc
import io
import sys
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from tests.recorded import DATA, without

# Tests assert no times: on a busy machine a draw may wait for half a minute.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the crash tests in the middle: there a second worker begins.

    The first worker compiles the filter's kernels, a third of all compilation; a second one that
    began with navigation would compile them at the same time.
    """
    crash, others = [], []
    for item in items:
        (crash if "tests/unit/crash/" in item.path.as_posix() else others).append(item)
    half = (len(items) + 1) // 2
    items[:] = [*others[:half], *crash, *others[half:]]


def pytest_collection_finish() -> None:
    """Except what collecting made from garbage collection: it lives as long as the run."""
    gc.freeze()


@pytest.fixture(scope="session")
def recordings():
    """A function that gives the path of a shared recording (see `tests.recorded.without`)."""

    def find(name: str) -> Path:
        path = DATA / name
        if not path.exists():
            without(f"recording {name}")
        return path

    return find


@dataclass(frozen=True)
class Result:
    """What a command printed and how it ended."""

    code: int
    out: str
    err: str


@pytest.fixture(scope="session")
def run_cli():
    """A function that runs the command line in this process, as `strapdown` itself would."""

    def run(*arguments: object) -> Result:
        from strapdown.cli import main

        out, err = io.StringIO(), io.StringIO()
        before = sys.argv
        sys.argv = ["strapdown", *(str(a) for a in arguments)]
        code = 0
        try:
            with redirect_stdout(out), redirect_stderr(err):
                main.run()
        except SystemExit as end:
            code = int(end.code or 0)
        finally:
            sys.argv = before
        return Result(code, out.getvalue(), err.getvalue())

    return run
