"""The first run of an installation, which compiles its kernels, repeats bit for bit."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.cli.test_navigate_live import inside, written
from tests.contracts.test_chain_cuts import drive

from strapdown.formats import csv
from strapdown.formats.writers import WRITERS

SOURCE = Path(__file__).parents[2] / "src" / "strapdown"


def test_no_kernel_is_compiled_with_relaxed_arithmetic():
    # A contracted product depends on what the compiler inlines: see _kernels/compilation.py.
    relaxed = [
        path.name
        for path in SOURCE.rglob("*.py")
        for line in path.read_text(encoding="utf-8").splitlines()
        if "fastmath=" in line
    ]
    assert relaxed == []


@pytest.mark.slow
@pytest.mark.parametrize("form", ["joseph", "wd"])
def test_a_run_that_compiles_its_kernels_equals_one_that_loads_them(tmp_path, form):
    WRITERS["csv"].write(tmp_path / "log.csv", {"imu": drive()})
    table = inside()
    columns = {"time_s": table.index.to_numpy()}
    values = {str(c): table[c].to_numpy() for c in table.columns}
    csv.write(tmp_path / "fix.csv", columns | values, {})
    head = '[log]\npath = "log.csv"\n'
    run = written(tmp_path, head, f'path = "fix.csv"\n[filter]\ncovariance = "{form}"\n')
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
    for out in ("first", "second"):
        subprocess.run(
            [sys.executable, "-m", "strapdown", "navigate", str(run), "--out", out, "-q"],
            cwd=tmp_path,
            env=environment,
            check=True,
        )
    for path in sorted((tmp_path / "first").rglob("*.csv")):
        same = (tmp_path / "second" / path.relative_to(tmp_path / "first")).read_bytes()
        assert path.read_bytes() == same, path.name
    assert len(list((tmp_path / "first").rglob("*.csv"))) >= 4
