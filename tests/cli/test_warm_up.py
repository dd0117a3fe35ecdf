"""``strapdown warm-up``: says what there is to compile, and runs the demonstration for it."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from strapdown._kernels import compilation
from strapdown.cli import demo, main
from strapdown.cli.console import logged
from strapdown.errors import ConfigError

RUNNER = CliRunner()


def run_of(needs, made):
    def make(out, force, progress):
        assert out.is_dir()
        assert not force
        progress("stage", 0.5)
        made.append(out)

    return SimpleNamespace(shown=SimpleNamespace(title="a run"), make=make, takes=1.0, needs=needs)


@pytest.mark.parametrize(
    ("mode", "said"), [("compiled", "delivered compiled"), ("python", "nothing to compile")]
)
def test_nothing_is_run_where_nothing_is_compiled(monkeypatch, mode, said):
    monkeypatch.setattr(compilation, "MODE", mode)
    monkeypatch.setattr(demo, "demo_runs", lambda *_: pytest.fail("ran"))
    result = RUNNER.invoke(main.app, ["warm-up"])
    assert result.exit_code == 0
    assert said in result.output
    with logged():
        assert RUNNER.invoke(main.app, ["warm-up", "--quiet"]).output == ""


def test_numba_compiles_by_the_runs_that_need_no_recording(monkeypatch):
    made = []
    runs = [run_of(None, made), run_of("recordings", made), run_of(None, made)]
    monkeypatch.setattr(compilation, "MODE", "numba")
    monkeypatch.setattr(compilation, "NOT_KEPT", [])
    monkeypatch.setattr(demo, "demo_runs", lambda *_: runs)
    result = RUNNER.invoke(main.app, ["warm-up"])
    assert result.exit_code == 0
    assert "compiled and kept" in result.output
    assert len(made) == 2
    assert not made[0].exists()
    # Without a folder for them the next run would compile again.
    monkeypatch.setattr(compilation, "NOT_KEPT", ["cross"])
    refused = RUNNER.invoke(main.app, ["warm-up"]).exception
    assert isinstance(refused, ConfigError)
    assert refused.finding.code == "cli.kernels-not-kept"
