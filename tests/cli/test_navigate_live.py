"""`strapdown navigate --live` and `--pace`: the command itself, its signals, and its bundles."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time

import numpy as np
import pandas as pd
import pytest
from tests.contracts.test_chain_cuts import drive
from tests.town_drive import fixes, motion

from strapdown.bundle import read_manifest, unsealed_changes
from strapdown.formats import csv
from strapdown.formats.writers import WRITERS

START = """
[start]
lat_deg = {lat!r}
lon_deg = {lon!r}
alt_m = {alt!r}
v_ned_m_per_s = [10.0, 0.0, 0.0]
roll_deg = 0.0
pitch_deg = 0.0
heading_deg = 0.0
[sensors]
sensor = "adis16470"
[output]
files = ["csv"]
[aiding.gnss]
lever_arm_m = [1.0, -0.4, -1.2]
"""


def inside():
    table = fixes()
    return table[table.index <= 5.0]


def written(folder, head, aid=""):
    truth = motion().trajectory([0.0]).iloc[0]
    places = {name: float(truth[name]) for name in ("lat", "lon", "alt")}
    path = folder / "run.toml"
    path.write_text(head + START.format(**places) + aid)
    return path


def recorded(folder):
    """The drive in files, with its fixes; its configuration."""
    WRITERS["csv"].write(folder / "log.csv", {"imu": drive()})
    table = inside()
    columns = {"time_s": table.index.to_numpy()}
    csv.write(
        folder / "fix.csv", columns | {str(c): table[c].to_numpy() for c in table.columns}, {}
    )
    return written(folder, '[log]\npath = "log.csv"\n', 'path = "fix.csv"\n')


def lines(until=5.0):
    imu = drive()
    out = [
        (t, 1, ",".join(["imu", repr(t), *(repr(float(v)) for v in row)]))
        for t, row in zip(imu.index.tolist(), imu.to_numpy(), strict=True)
    ]
    for t, row in inside().iterrows():
        said = ",".join(f"{name}={float(value)!r}" for name, value in row.items())
        out.append((t, 0, f"gnss,{float(t)!r},{said}"))
    return [text for t, _, text in sorted(out) if t <= until]


def start(folder, *options):
    return subprocess.Popen(
        [sys.executable, "-m", "strapdown", "navigate", *asked(options), "--out", "out", *options],
        cwd=folder,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def asked(options):
    return [] if "--recover" in options else ["run.toml"]


@pytest.fixture
def live(tmp_path):
    written(tmp_path, '[live]\nsampling = "mean"\n')
    return tmp_path


def trajectory(folder):
    return pd.read_csv(folder / "trajectory.csv", comment="#").to_numpy()


@pytest.mark.slow
def test_standard_input_to_its_end_is_the_batch_run(live, run_cli):
    job = start(live, "--live", "-", "--every", "0.5")
    out, err = job.communicate("\n".join(lines()) + "\n", timeout=120)
    assert job.returncode == 0, err
    told = [json.loads(text) for text in out.splitlines()]
    np.testing.assert_allclose(np.diff([one["time"] for one in told]), 0.5, atol=0.15)  # gaps
    assert "listening to stdin" in err
    assert sorted(p.name for p in live.iterdir()) == ["out", "run.toml"]
    assert unsealed_changes(live / "out", read_manifest(live / "out")) == []
    latency = json.loads((live / "out" / "latency.json").read_text())
    assert (latency["lines"], latency["not_used"], latency["late"]) == (len(lines()), {}, {})
    # The same from files, at once.
    other = live / "batch"
    other.mkdir()
    done = run_cli("navigate", recorded(other), "--out", other / "out", "-q")
    assert done.code == 0, done.err
    np.testing.assert_array_equal(trajectory(live / "out"), trajectory(other / "out"))


@pytest.mark.slow
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_in_good_order(live, sent):
    job = start(live, "--live", "-", "--every", "0")
    job.stdin.write("\n".join(lines(3.0)) + "\n")
    job.stdin.flush()
    for _ in range(60):  # states are there: it navigates
        job.stdout.readline()
    job.send_signal(sent)
    _, err = job.communicate(timeout=120)
    assert job.returncode == 0, err
    assert "Traceback" not in err
    assert sorted(p.name for p in live.iterdir()) == ["out", "run.toml"]
    assert unsealed_changes(live / "out", read_manifest(live / "out")) == []


@pytest.mark.slow
def test_a_second_signal_ends_it_at_once(live):
    job = start(live, "--live", "-", "--every", "0")
    job.stdin.write("\n".join(lines(3.0)) + "\n")
    job.stdin.flush()
    for _ in range(60):
        job.stdout.readline()
    job.send_signal(signal.SIGTERM)
    deadline = time.monotonic() + 60
    while not any(live.glob(".out.*.partial")) and time.monotonic() < deadline:
        time.sleep(0.002)
    job.send_signal(signal.SIGTERM)
    _, err = job.communicate(timeout=120)
    assert "Traceback" not in err
    assert not any(live.glob(".out.*"))
    if (live / "out").exists():
        assert unsealed_changes(live / "out", read_manifest(live / "out")) == []
        return
    # What was received is not lost with the result.
    assert "strapdown navigate --recover out-received" in err
    job = start(live, "--recover", "out-received")
    _, err = job.communicate(timeout=120)
    assert job.returncode == 0, err
    assert sorted(p.name for p in live.iterdir()) == ["out", "run.toml"]


def test_without_a_sample_there_is_no_bundle(live, run_cli, monkeypatch, tmp_path_factory):
    given = tmp_path_factory.mktemp("given") / "lines"
    given.write_text("imu,1,2\n")
    monkeypatch.chdir(live)
    with given.open() as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        done = run_cli("navigate", "run.toml", "--out", "out", "--live", "-")
    assert done.code == 3
    assert "line 1: line not used: imu needs 7 numbers, not 2" in done.err
    assert "no sample was received" in done.err
    assert [p.name for p in live.iterdir()] == ["run.toml"]


@pytest.mark.slow
def test_what_came_is_kept_where_navigation_never_began(live, run_cli):
    job = start(live, "--live", "-")
    _, err = job.communicate("\n".join(lines(0.0)) + "\n", timeout=120)
    assert job.returncode == 3
    assert "out-received" in err
    assert (live / "out-received" / "received.csv").is_file()
    assert not (live / "out").exists()


def test_a_live_run_needs_lines(live, run_cli):
    done = run_cli("navigate", live / "run.toml", "--out", live / "out")
    assert done.code == 4
    assert "--live" in done.err


@pytest.mark.parametrize(
    ("options", "what"),
    [
        (["--live", "tcp://1"], "'tcp://1' is not a source"),
        (["--live", "-", "--pace", "1"], "--pace"),
        (["--live", "-", "--from", "3"], "--from"),
        (["--live", "udp://127.0.0.1:0", "--lines", "xml"], "json or csv"),
        (["--live", "udp://127.0.0.1:0", "--every", "-1"], "--every"),
    ],
)
def test_what_cannot_be_asked(live, run_cli, options, what):
    done = run_cli("navigate", live / "run.toml", "--out", live / "out", *options)
    assert done.code == 4
    assert what in done.err
    assert not (live / "out").exists()


def test_a_pace_writes_what_each_sample_took_outside_the_seal(tmp_path, run_cli):
    WRITERS["csv"].write(tmp_path / "log.csv", {"imu": drive()})
    path = written(tmp_path, '[log]\npath = "log.csv"\n').rename(tmp_path / "run.toml")
    text = path.read_text().replace("[aiding.gnss]\nlever_arm_m = [1.0, -0.4, -1.2]\n", "")
    path.write_text(text)
    plain = run_cli("navigate", path, "--out", tmp_path / "a" / "out", "-q")
    played = run_cli("navigate", path, "--out", tmp_path / "b" / "out", "--pace", "max")
    assert (plain.code, played.code) == (0, 0), plain.err + played.err
    assert "sample to state, ms" in played.out
    # One name, the same numbers: one seal.
    seals = [(tmp_path / n / "out" / "manifest.json").read_bytes() for n in "ab"]
    assert seals[0] == seals[1]
    latency = json.loads((tmp_path / "b" / "out" / "latency.json").read_text())
    assert (latency["samples"], latency["missed_deadlines"]) == (len(drive()), None)
    assert unsealed_changes(tmp_path / "b" / "out", read_manifest(tmp_path / "b" / "out")) == []
