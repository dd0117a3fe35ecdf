"""Where the recordings are, and a command line that runs in this process."""

from __future__ import annotations

import gc
import io
import os
import sys
from collections.abc import Generator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from tests.recorded import DATA, without

Hook = Generator[None, pytest.CollectReport, pytest.CollectReport]

# Tests assert no times: on a busy machine a draw may wait for half a minute.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")


def _of_second_worker(config: pytest.Config) -> bool:
    """Whether this is every second process of those that share the tests."""
    worker = getattr(config, "workerinput", {}).get("workerid", "gw0")
    return bool(int(worker.removeprefix("gw")) % 2)


def pytest_configure() -> None:
    """Let modules be compiled once, and not anew by each worker and each command of a test."""
    sys.dont_write_bytecode = False
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector: pytest.Collector) -> Hook:
    """Let the second worker collect from the end: each compiles a half, and finds the other."""
    report = yield
    if isinstance(collector, pytest.Directory) and _of_second_worker(collector.config):
        report.result = report.result[::-1]
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sort what was collected from either end: all workers have one order."""
    items.sort(key=lambda item: item.path.parts)


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
