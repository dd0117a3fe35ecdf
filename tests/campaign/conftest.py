"""A kind of case that costs nothing, and that misbehaves where it is told to."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import pytest

from strapdown.campaign import kinds

#: Read by every process that runs cases; `places` says how a case behaves.
CHEAP = """
import dataclasses, math, os, random, time
import strapdown.campaign.kinds as kinds

class Result:
    findings = ()
    def __init__(self, value):
        self.value = value

def run(table, name):
    what = table.get("places", 1)
    if what == 2:
        os._exit(3)
    if what == 3:
        time.sleep(1e5)
    if what == 4:
        held = [bytearray(10**8) for _ in range(200)]
    if what == 5:
        raise ZeroDivisionError
    if what == 6:
        os.kill(os.getpid(), 9)
    time.sleep(table.get("at_s", 0.0))
    x = table.get("outage_s", 1.0)
    return Result(random.Random(f"{x} {what}").gauss(0.0, 1.0))

def data(result):
    return {"at_the_end": {"horizontal_95_m": result.value, "speed_sd_m_per_s": 1.959964}}

kinds.KINDS["outage"] = dataclasses.replace(kinds.KINDS["outage"], run=run, data=data)
"""


@pytest.fixture
def cheap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Replace the outage by a kind that costs nothing, here and in the processes of cases."""
    folder = tmp_path / "site"
    folder.mkdir()
    (folder / "sitecustomize.py").write_text(CHEAP)
    source = str(Path(kinds.__file__).parents[2])
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(folder), source]))
    monkeypatch.setitem(kinds.KINDS, "outage", kinds.KINDS["outage"])
    made = importlib.util.spec_from_file_location("cheap_kind", folder / "sitecustomize.py")
    assert made is not None
    assert made.loader is not None
    made.loader.exec_module(importlib.util.module_from_spec(made))
    return tmp_path
