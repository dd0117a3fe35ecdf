"""Where the recordings are, and a command line that runs in this process."""

from __future__ import annotations

import io
import sys
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from hashlib import sha256
from importlib import import_module
from pathlib import Path

import pytest
from tests.recorded import DATA, without


@pytest.fixture(scope="session")
def recordings():
    """A function that gives the path of a shared recording (see `tests.recorded.without`)."""

    def find(name: str) -> Path:
        path = DATA / name
        if not path.exists():
            without(f"recording {name}")
        return path

    return find


@contextmanager
def _sketching():
    """Charts are written as the digest of what is to be drawn, and not drawn.

    Drawing is most of the time of a report. A chart with another number is another sketch, so that
    what is sealed and made again is compared as ever.
    """
    from strapdown.report.plotly_chart import figure

    def sketch(chart, path, *, caption=False, paper=False):
        told = repr((figure(chart), path.suffix, caption, paper))
        digest = sha256(told.encode()).hexdigest()
        path.write_text(
            f'<svg xmlns="http://www.w3.org/2000/svg" width="90pt" height="50pt" '
            f'viewBox="0 0 90 50"><desc>{digest}</desc></svg>\n',
            encoding="utf-8",
        )

    with pytest.MonkeyPatch.context() as patch:
        for name in ("svg_chart", "attitude", "trajectory_simulation"):
            patch.setattr(import_module(f"strapdown.report.{name}"), "draw", sketch)
        yield


@pytest.fixture
def sketched():
    """No chart is drawn in a test that looks at no picture."""
    with _sketching():
        yield


@pytest.fixture(scope="module")
def sketched_module():
    """As `sketched`, for a module whose own fixtures write reports; none of the session may."""
    with _sketching():
        yield


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
