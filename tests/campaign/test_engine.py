"""Whatever happens to a case, a worker or the campaign: nothing is lost, the bits are the same."""

from __future__ import annotations

import errno
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from strapdown.campaign import run as campaign_run
from strapdown.campaign.case_process import CaseProcess
from strapdown.campaign.engine import Workers
from strapdown.campaign.run import (
    case_of,
    differing,
    merge_parts,
    open_campaign,
    resume,
    run_campaign,
)
from strapdown.errors import ConfigError

HEAD = """
[base]
kind = "outage"
configuration = { sensor = "mpu-6050", outage_s = 1.0, at_s = 0.0 }
"""
DRAWN = """
[cases]
draws = {draws}
[[parameter]]
key = "outage_s"
draw = "uniform"
low = 1.0
high = 2.0
[[coverage]]
name = "unit"
error = "horizontal_95_m"
bound = "speed_sd_m_per_s"
"""


def written(folder: Path, text: str, name: str = "c.toml") -> Path:
    (folder / name).write_text(HEAD + text)
    return folder / name


def content(folder: Path) -> dict[str, bytes]:
    """Bytes of the results, without what clocks and places change."""
    found = sorted((folder / "cases").glob("*.parquet"))
    return {p.name: p.read_bytes() for p in [*found, folder / "summary.json"]}


def test_a_case_that_dies_hangs_or_needs_all_memory_is_recorded(cheap: Path) -> None:
    file = written(
        cheap,
        """
        [cases]
        draws = 2
        [[parameter]]
        key = "places"
        values = [1, 2, 3, 4, 5, 6]
        [limits]
        time_s = 8.0
        memory_mb = 600.0
        """,
    )
    run = run_campaign(file, workers=2)
    found = run.cases.groupby("places")[["status", "code"]].first()
    assert found["status"].to_dict() == {
        1: "done",
        2: "crashed",
        3: "hung",
        4: "memory",
        5: "failed",
        6: "crashed",
    }
    assert found["code"].to_dict() == {
        1: "",
        2: "exit 3",
        3: "",
        4: "",
        5: "ZeroDivisionError",
        6: "SIGKILL",
    }
    assert len(run.cases) == 12
    assert run.cases["horizontal_95_m"].notna().sum() == 2


@contextmanager
def scheduler(
    workers: int, python_path: str
) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler and workers in processes of their own, on the loopback interface."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    environment = {**os.environ, "PYTHONPATH": python_path}
    code = (
        "import asyncio, distributed\n"
        "async def main():\n"
        f"    async with distributed.Scheduler(host='127.0.0.1', port={port},"
        " dashboard_address='127.0.0.1:0') as s:\n"
        "        await s.finished()\n"
        "asyncio.run(main())\n"
    )
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": environment}
    made = [subprocess.Popen([sys.executable, "-c", code], **quiet)]
    worker = [sys.executable, "-m", "strapdown", "worker", address, "--workers", "1"]
    made += [subprocess.Popen(worker, **quiet) for _ in range(workers)]
    try:
        yield address, made
    finally:
        for one in made:
            one.kill()
            one.wait()


def test_one_and_two_workers_and_a_scheduler_give_the_same_bytes(cheap: Path) -> None:
    file = written(cheap, DRAWN.format(draws=300))
    run_campaign(file, workers=1).save(cheap / "one", report=False)
    run_campaign(file, workers=2).save(cheap / "two", report=False)
    with scheduler(2, os.environ["PYTHONPATH"]) as (address, _):
        deadline = time.monotonic() + 120.0
        while True:
            try:
                run = run_campaign(file, workers=Workers(scheduler=address))
                break
            except ConfigError:  # it has not begun to listen
                assert time.monotonic() < deadline
                time.sleep(0.5)
        run.save(cheap / "many", report=False)
    assert content(cheap / "one") == content(cheap / "two") == content(cheap / "many")


@pytest.mark.slow
def test_a_worker_that_is_killed_and_a_scheduler_that_is_lost(cheap: Path) -> None:
    file = written(cheap, DRAWN.format(draws=60))
    file.write_text(file.read_text().replace("at_s = 0.0", "at_s = 0.1"))
    run_campaign(file, workers=2).save(cheap / "whole", report=False)

    def killed(which: int, folder: Path) -> None:
        with scheduler(2, os.environ["PYTHONPATH"]) as (address, made):
            ended = False

            def progress(stage: str, share: float) -> None:
                nonlocal ended
                if share > 0.2 and not ended:
                    made[which].kill()
                    ended = True

            deadline = time.monotonic() + 60.0
            while True:
                try:
                    workers = Workers(scheduler=address)
                    run = run_campaign(file, workers=workers, folder=folder, progress=progress)
                except ConfigError as error:
                    if error.finding.code != "campaign.no-scheduler" or ended:
                        raise
                    assert time.monotonic() < deadline
                    time.sleep(0.5)
                else:
                    run.save(cheap / "one", report=False)
                    assert ended
                    return

    killed(1, cheap / "one-running")
    assert content(cheap / "one") == content(cheap / "whole")
    with pytest.raises(ConfigError) as lost:
        killed(0, cheap / "two-running")
    assert lost.value.finding.code == "campaign.scheduler-lost"
    assert 0 < open_campaign(cheap / "two").dataset.there().sum() < 60
    resume(cheap / "two-running").save(cheap / "two", report=False)
    assert content(cheap / "two") == content(cheap / "whole")


def test_a_complete_campaign_has_nothing_to_resume(
    cheap: Path, run_cli: Callable[..., Any]
) -> None:
    """By its name or that of its working folder, which is gone; and it is not replaced."""
    run_campaign(written(cheap, DRAWN.format(draws=2)), workers=1).save(cheap / "a", report=False)
    before = content(cheap / "a")
    for name in ("a", "a-running"):
        told = run_cli("campaign", "resume", cheap / name, "--no-report")
        assert (told.code, "no case is left to run" in told.err) == (4, True)
    assert content(cheap / "a") == before


@pytest.mark.slow
def test_a_scheduler_without_workers_and_none_at_all(
    cheap: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = written(cheap, DRAWN.format(draws=10))
    monkeypatch.setattr("strapdown.campaign.engine.WORKERS", 2.0)
    with pytest.raises(ConfigError) as none:
        run_campaign(file, workers=Workers(scheduler="tcp://127.0.0.1:9"))
    assert none.value.finding.code == "campaign.no-scheduler"
    with scheduler(0, os.environ["PYTHONPATH"]) as (address, _):
        code = ""
        deadline = time.monotonic() + 60.0
        while code != "campaign.no-workers" and time.monotonic() < deadline:
            with pytest.raises(ConfigError) as caught:
                run_campaign(file, workers=Workers(scheduler=address))
            code = caught.value.finding.code
    assert code == "campaign.no-workers"


@pytest.mark.parametrize(
    ("missing", "code"), [("distributed", "campaign.no-dask"), ("bokeh", "campaign.no-bokeh")]
)
def test_what_is_not_installed_is_said_before_a_case_runs(
    missing: str, code: str, cheap: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = written(cheap, DRAWN.format(draws=2))
    monkeypatch.setattr(
        "strapdown.campaign.engine.find_spec", lambda name: None if name == missing else object()
    )
    monkeypatch.setattr("strapdown.campaign.engine.CaseProcess", None)
    with pytest.raises(ConfigError) as caught:
        run_campaign(file, workers=Workers(1, dashboard=True))
    assert caught.value.finding.code == code


def test_the_dashboard_is_where_it_is_said_to_be(
    cheap: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without bokeh dask serves a page at its address that says so."""
    monkeypatch.setattr("strapdown.campaign.engine.find_spec", lambda name: object())
    pages: list[tuple[str, bytes]] = []

    def look(address: str) -> None:
        with urllib.request.urlopen(address, timeout=60.0) as answer:
            pages.append((address, answer.read()))

    file = written(cheap, DRAWN.format(draws=2))
    run_campaign(file, workers=Workers(1, dashboard=True), shown=look)
    ((address, page),) = pages
    assert address.startswith("http://127.0.0.1:")
    assert b"bokeh" in page.lower()


def test_processes_begin_before_their_workers_and_end_with_them(
    cheap: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[CaseProcess] = []
    begin = CaseProcess.begin

    def noted(one: CaseProcess) -> threading.Thread:
        begun.append(one)
        return begin(one)

    monkeypatch.setattr(CaseProcess, "begin", noted)
    file = written(cheap, DRAWN.format(draws=3))
    assert set(run_campaign(file, workers=2).cases["status"]) == {"done"}
    # No more than there are cases, and those that began run them: no further one is started.
    assert len(begun) == 2
    run_campaign(written(cheap, DRAWN.format(draws=1), "one.toml"), workers=2)
    assert len(begun) == 3
    for one in begun:
        assert one._process is None
        begin(one).join()
        assert one._process is None


@pytest.mark.slow
def test_killed_at_drawn_instants_and_resumed(cheap: Path) -> None:
    """``STRAPDOWN_KILLS=50`` for so many; a row that is not written within 5 s is run again."""
    kills = int(os.environ.get("STRAPDOWN_KILLS", "3"))
    text = DRAWN.format(draws=40 * kills)
    file = written(cheap, text.replace("[cases]", "[cases]\nseed = 5"))
    text = file.read_text().replace("at_s = 0.0", "at_s = 0.05")
    file.write_text(text)
    run_campaign(file, workers=2).save(cheap / "whole", report=False)
    command = [sys.executable, "-m", "strapdown", "campaign"]
    rng = random.Random(kills)
    start = [str(file), "--out", str(cheap / "cut"), "--no-report", "--workers", "2", "-q"]
    kept, killed = [0], 0
    # Killed while it starts, runs, or writes; then until its end.
    for wait in (*(2.0 + 10.0 * rng.random() for _ in range(kills)), None):
        begun = (cheap / "cut-running" / "campaign.json").exists()
        more = ["resume", str(cheap / "cut"), "--no-report", "-q"] if begun else start
        process = subprocess.Popen([*command, *more], start_new_session=True)
        if wait is None:
            assert process.wait() == 0
            break
        time.sleep(wait)
        if process.poll() is not None:
            break
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        killed += 1
        if (cheap / "cut-running" / "campaign.json").exists():
            kept.append(int(open_campaign(cheap / "cut").dataset.there().sum()))
    print(f"{killed} kills; cases kept after each: {kept[1:]}")
    assert kept == sorted(kept)  # what was written stays
    assert content(cheap / "cut") == content(cheap / "whole")
    assert not (cheap / "cut-running").exists()


def test_a_full_disk_loses_nothing_that_was_written(
    cheap: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = written(cheap, DRAWN.format(draws=200))
    run_campaign(file, workers=1).save(cheap / "whole", report=False)
    plain = campaign_run.Dataset.add
    calls = []

    def full(self: campaign_run.Dataset, rows: list[object]) -> None:
        calls.append(len(rows))
        if len(calls) == 2:
            raise OSError(errno.ENOSPC, "no space left on device")
        plain(self, rows)  # type: ignore[arg-type]

    monkeypatch.setattr(campaign_run.Dataset, "add", full)
    monkeypatch.setattr("strapdown.campaign.run.SECONDS", 0.0)
    monkeypatch.setattr("strapdown.campaign.engine.MOST", 20)
    with pytest.raises(OSError, match="no space"):
        run_campaign(file, workers=1, folder=cheap / "c-running")
    monkeypatch.setattr(campaign_run.Dataset, "add", plain)
    found = open_campaign(cheap / "c").dataset.there().sum()
    assert 0 < found < 200
    resume(cheap / "c-running", workers=Workers(1)).save(cheap / "again", report=False)
    assert content(cheap / "again") == content(cheap / "whole")


def test_parts_of_two_machines_merge(cheap: Path) -> None:
    file = written(cheap, DRAWN.format(draws=100))
    run_campaign(file, workers=1).save(cheap / "whole", report=False)
    for k in (1, 2):
        run_campaign(file, workers=1, folder=cheap / f"p{k}-running", part=(k, 2))
    assert merge_parts([cheap / "p1"], cheap / "m-running") == 50
    assert merge_parts([cheap / "p1", cheap / "p2"], cheap / "m-running") == 0
    resume(cheap / "m-running").save(cheap / "m", report=False)
    assert content(cheap / "m") == content(cheap / "whole")
    other = written(cheap, DRAWN.format(draws=100).replace("1.0", "1.1"), "d.toml")
    run_campaign(other, workers=1, folder=cheap / "o-running", part=(1, 50))
    with pytest.raises(ConfigError, match="another campaign"):
        merge_parts([cheap / "p1", cheap / "o"], cheap / "n-running")


def test_a_case_by_itself_has_the_same_bits(cheap: Path) -> None:
    file = written(cheap, DRAWN.format(draws=20))
    run = run_campaign(file, workers=1)
    run.save(cheap / "c", report=False)
    _, row, recorded = case_of(cheap / "c", 13)
    assert recorded is not None
    assert differing(run.dataset.frozen, row, recorded) == []
    recorded["horizontal_95_m"] += 1e-12
    assert differing(run.dataset.frozen, row, recorded) == ["horizontal_95_m"]
    with pytest.raises(ConfigError, match="last is 19"):
        case_of(cheap / "c", 20)


def test_stopping_depends_on_the_order_of_draws_alone(cheap: Path) -> None:
    stop = '[stop]\ncoverage = "unit"\nhalf_width = 0.04\nevery = 20\n'
    grid = '[[parameter]]\nkey = "places"\nvalues = [1, 7]\n'
    file = written(cheap, DRAWN.format(draws=2000) + grid + stop)
    run = run_campaign(file, workers=2)
    counts = run.cases["cell"].value_counts().to_dict()
    assert {str(k): v for k, v in counts.items()} == {
        str(k): v for k, v in run.summary["stopped"].items()
    }
    assert all(v % 20 == 0 and 60 <= v < 600 for v in counts.values())
    again = run_campaign(file, workers=1)
    pd.testing.assert_frame_equal(again.cases, run.cases)
    # The look before was too wide, the last is not.
    from strapdown.dsp.chi_square import clopper_pearson

    for cell, draws in run.stopped.items():
        own = run.cases[run.cases["cell"] == cell]
        inside = own["horizontal_95_m"].abs() <= own["speed_sd_m_per_s"]
        halves = [
            0.5 * (high - low)
            for n in (draws - 20, draws)
            for low, high in [clopper_pearson(int(inside.iloc[:n].sum()), n, 0.95)]
        ]
        assert halves[0] > 0.04 >= halves[1]


def test_read_by_duckdb_and_polars(cheap: Path) -> None:
    duckdb = pytest.importorskip("duckdb")
    polars = pytest.importorskip("polars")
    file = written(cheap, DRAWN.format(draws=30))
    run = run_campaign(file, workers=1)
    run.save(cheap / "c", report=False)
    pattern = str(cheap / "c" / "cases" / "*.parquet")
    expected = run.cases["horizontal_95_m"].sum()
    ((total,),) = duckdb.sql(f"select sum(horizontal_95_m) from '{pattern}'").fetchall()
    assert total == pytest.approx(expected, rel=1e-12)
    table = polars.read_parquet(pattern)
    assert table["horizontal_95_m"].sum() == pytest.approx(expected, rel=1e-12)
    assert pd.read_parquet(cheap / "c" / "cases")["case"].tolist() == list(range(30))
