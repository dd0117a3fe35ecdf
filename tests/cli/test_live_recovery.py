"""A live run that is killed loses nothing: its journal gives the bits of one that was not."""

from __future__ import annotations

import json
import os
import resource
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from tests.cli.live_kills import RECORD, finished, killed, received
from tests.cli.test_crash_live import CASE, GYRO, line, samples
from tests.cli.test_navigate_live import lines, written
from tests.coded import coded

from strapdown.crash.watch import CrashLog
from strapdown.errors import ConfigError, DataError
from strapdown.live import journal as module
from strapdown.live.crash import CrashReception, recorder_of_case
from strapdown.live.journal import Journal
from strapdown.live.lines import Measured, Sample, Word
from strapdown.report.crash_live import COMMAND


def start(folder, *options):
    """The command in a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "strapdown", *options, "--quiet"],
        cwd=folder,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )


def three_kills(folder, command, texts, draw):
    """Kill a run at three drawn instants, and continue it each time from where it was."""
    left, done = folder / "out-received", 0
    for size in sorted(draw.integers(2, len(texts) - 60, 3).tolist()):
        begun = [*command, "--out", "out"] if not done else [command[0], "--recover", left.name]
        # Some that it may or may not have read when it is killed.
        sent = texts[done : max(size, done + 1) + int(draw.integers(1, 50))]
        killed(folder, sent, (*begun, "--live", "-"), 101 + RECORD * size, 120.0)
        assert not (folder / "out").exists()
        done = received(left)
    assert 0 < done < len(texts)
    code = finished(folder, texts[done:], command[0], "--recover", left.name, "--live", "-")
    assert (code, (folder / "log").read_text().count("Traceback")) == (0, 0)
    assert not left.exists()
    return (folder / "out" / "manifest.json").read_bytes()


def not_killed(folder, command, texts):
    """The seal of a run to its end."""
    whole = folder / "whole"
    whole.mkdir()
    shutil.copy(folder / command[1], whole)
    assert finished(whole, texts, *command, "--out", "out", "--live", "-") == 0
    return (whole / "out" / "manifest.json").read_bytes()


@pytest.mark.slow
def test_three_kills_of_a_run_of_navigation_leave_its_bits(tmp_path):
    written(tmp_path, '[live]\nsampling = "mean"\n')
    command, texts = ("navigate", "run.toml"), lines()
    killed = three_kills(tmp_path, command, texts, np.random.default_rng(1))
    assert killed == not_killed(tmp_path, command, texts)


@pytest.fixture
def case(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE + GYRO)
    return path


@pytest.fixture
def blow():
    """Lines of a crash: from two seconds on."""
    return [line(row) for row in samples()[500:].tolist()]


def test_three_kills_of_a_detection_leave_its_bits(case, blow):
    command = ("crash", "case.toml")
    killed = three_kills(case.parent, command, blow, np.random.default_rng(2))
    assert killed == not_killed(case.parent, command, blow)
    found = json.loads((case.parent / "out" / "detections.json").read_text())
    assert (found["events"], found["samples"]) == (1, len(blow))
    told = json.loads((case.parent / "out" / "latency.json").read_text())
    assert told["replayed"] + told["lines"] == len(blow)


@pytest.fixture
def left(case, blow, run_cli, monkeypatch):
    """What a run left that was killed: the crash of a case."""
    folder = case.parent / "out-received"
    options = recorder_of_case(case)
    run = {"configuration": {"recorder": vars(options)}, "every": 0.01, "out": "out", "named": {}}
    own = Journal.begin(folder, {"command": COMMAND, "strapdown": "0", "source": "-", **run})
    for text in blow[:700]:
        time, *values = (float(v) for v in text.split(",")[1:])
        own.append(Sample(time, tuple(values)))
    own.close()
    return folder


def whole(left):
    """The detections of what a journal has, as plain data; `left` is cut, and else unchanged."""
    own = Journal.reopen(left, COMMAND)
    try:
        options = recorder_of_case(left.parent / "case.toml")
        got = CrashReception(CrashLog(options, 0.01), Clock(), print, print)
        got.replay(own)
        got.finish()
        return got.rows.rows, got.log.lines
    finally:
        own.close()


class Clock:
    def now(self):
        return 0.0

    def wait_until(self, instant):
        """Never waits."""


def test_a_torn_end_is_cut_at_each_byte_of_the_last_three_records(left):
    data = (left / "journal").read_bytes()
    rows, told = whole(left)
    assert (len(rows), told[0]["status"]) == (700, "trigger")
    for cut in range(3 * RECORD + 1):
        (left / "journal").write_bytes(data[: len(data) - cut])
        count = 700 - -(-cut // RECORD)
        if cut % RECORD in (0, 1, 40):
            np.testing.assert_array_equal(whole(left)[0], rows[:count])
        own = Journal.reopen(left, COMMAND)
        assert [one.time for one in own.said()] == rows[:count, 0].tolist()
        # What comes next continues it.
        own.append(Sample(9.0, (1.0,) * 6))
        own.close()
        assert (left / "journal").stat().st_size == len(data) - RECORD * (699 - count)
        own = Journal.reopen(left, COMMAND)
        assert list(own.said())[-1] == Sample(9.0, (1.0,) * 6)
        own.close()


def test_any_other_damage_is_an_error_and_nothing_is_changed(left):
    data = (left / "journal").read_bytes()
    places = [*range(200), *range(len(data) // 2, len(data) // 2 + 140), *range(-150, 0)]
    for at in places:
        bad = bytearray(data)
        bad[at] ^= 1 << (at % 8)
        (left / "journal").write_bytes(bad)
        with pytest.raises(DataError) as caught:
            Journal.reopen(left, COMMAND)
        code = caught.value.finding.code
        assert code in ("live.journal-damaged", "live.not-a-journal", "live.not-its-run")
        assert (left / "journal").read_bytes() == bad
    # A record that is missing, and two that are exchanged.
    head = len(data) - 700 * RECORD
    one, two = data[head : head + RECORD], data[head + RECORD : head + 2 * RECORD]
    for rest in (two, two + one):
        (left / "journal").write_bytes(data[:head] + rest + data[head + 2 * RECORD :])
        with pytest.raises(DataError, check=coded("live.journal-damaged")):
            Journal.reopen(left, COMMAND)


def test_the_remedy_of_damage_recovers_what_is_before_it(left, run_cli, monkeypatch):
    monkeypatch.chdir(left.parent)
    data = bytearray((left / "journal").read_bytes())
    data[-RECORD * 50] ^= 255
    (left / "journal").write_bytes(data)
    done = run_cli("crash", "--recover", left)
    assert done.code == 3
    assert "damaged after 651 records" in done.err
    size = int(done.err.split("truncate -s ")[1].split()[0])
    os.truncate(left / "journal", size)
    assert run_cli("crash", "--recover", left, "-q").code == 0
    found = json.loads((left.parent / "out" / "detections.json").read_text())
    assert found["samples"] == 650


def test_what_cannot_be_recovered(left, run_cli, monkeypatch):
    def refused(code, said, *options, name="crash"):
        done = run_cli(name, *options)
        assert (done.code, "Traceback" in done.err) == (code, False)
        assert said in done.err

    monkeypatch.chdir(left.parent)
    assert run_cli("crash").code == 2
    assert run_cli("navigate").code == 2
    refused(4, "no journal of a live run", "--recover", "nowhere")
    refused(4, "strapdown crash --live", "--recover", left, name="navigate")
    refused(4, "CASE.toml cannot be given", "case.toml", "--recover", left)
    refused(4, "--calibration cannot be given", "--recover", left, "--calibration", "x")
    refused(4, "--smooth cannot be given", "--recover", left, "--smooth", name="navigate")
    refused(4, "--recover out-received", "case.toml", "--live", "-", "--out", "out")
    own = Journal.reopen(left, COMMAND)
    refused(4, f"process {os.getpid()}", "--recover", left)
    refused(4, f"process {os.getpid()}", "case.toml", "--live", "-", "--out", "out")
    own.sealed("ab" * 32)
    own.close()
    refused(3, "the run is complete", "--recover", left)
    run = json.loads((left / "run.json").read_text())
    (left / "run.json").write_text(json.dumps({**run, "every": 1.0}))
    refused(3, "does not belong to the journal", "--recover", left)
    (left / "run.json").write_text(json.dumps({**run, "schema": "strapdown journal 9"}))
    refused(3, "another version", "--recover", left)
    (left / "run.json").write_text("[")
    refused(3, "not of a journal", "--recover", left)
    # Nothing was written, and nothing is lost.
    assert sorted(p.name for p in left.parent.iterdir()) == ["case.toml", "out-received"]
    assert sorted(p.name for p in left.iterdir()) == ["journal", "lock", "run.json"]


def test_a_file_that_the_run_depends_on_must_be_unchanged(tmp_path):
    from strapdown.cli.live_folder import begin_journal, recovered

    sensor = tmp_path / "own.toml"
    sensor.write_text("one")
    own = begin_journal(tmp_path / "out", "x", {"configuration": {"sensor": str(sensor)}})
    own.append(Word("next"))
    own.close()
    told = []
    recovered(tmp_path / "out-received", "x", told.append).close()
    assert [one.code for one in told] == ["live.recovering"]
    sensor.write_text("another")
    with pytest.raises(DataError, check=coded("live.named-file-changed")):
        recovered(tmp_path / "out-received", "x", told.append)
    # The journal is free again.
    sensor.write_text("one")
    recovered(tmp_path / "out-received", "x", told.append).close()


def test_a_result_that_is_there_is_not_replaced(left, run_cli, monkeypatch):
    monkeypatch.chdir(left.parent)
    (left.parent / "out").mkdir()
    (left.parent / "out" / "mine").write_text("mine")
    done = run_cli("crash", "--recover", left)
    assert done.code == 4
    assert "--force" in done.err
    assert run_cli("crash", "--recover", left, "--out", "other", "-q").code == 0
    assert (left.parent / "other" / "manifest.json").is_file()
    assert not left.exists()


def test_a_run_that_received_nothing_is_begun_again(case, run_cli, monkeypatch):
    monkeypatch.chdir(case.parent)
    Journal.begin(case.parent / "out-received", {"command": COMMAND}).close()
    with pytest.raises(DataError, check=coded("live.journal-empty")):
        Journal.reopen(case.parent / "out-received", COMMAND)
    other = Journal.begin(case.parent / "out-received", {"command": COMMAND})
    other.remove()
    assert [p.name for p in case.parent.iterdir()] == ["case.toml"]
    (case.parent / "out-received").mkdir()
    (case.parent / "out-received" / "received.csv").write_text("of an earlier run")
    with pytest.raises(ConfigError, check=coded("live.received-before")):
        Journal.begin(case.parent / "out-received", {"command": COMMAND})


def test_what_lines_say_comes_back_to_the_bit(tmp_path):
    draw = np.random.default_rng(4)
    said = [Sample(v[0], tuple(v[1:])) for v in draw.standard_normal((50, 7)).tolist()]
    said += [Sample(1e-300, (0.1, -0.0, 5e-324)), Word("näv"), Measured("gps", 0.1, {"lat": 1 / 3})]
    own = Journal.begin(tmp_path / "a", {"command": "x"})
    for one in said:
        own.append(one)
    assert list(own.said()) == said
    own.close()


def test_a_full_disk_ends_the_journal_and_not_the_run(tmp_path):
    own, told = Journal.begin(tmp_path / "a", {"command": "x"}), []
    own.warn = told.append
    rows = own.spool("samples", 7)
    samples = [Sample(0.01 * k, (0.0,) * 6) for k in range(5000)]
    full = os.open("/dev/full", os.O_RDWR)
    for k, one in enumerate(samples):
        if k == 100:
            kept = os.dup(own._file)
            os.dup2(full, own._file)
            os.dup2(full, rows._file.fileno())
        own.append(one)
        rows.append((one.time, *one.values))
    assert [one.code for one in told] == ["live.journal-stopped"]
    assert "No space left" in told[0].what
    np.testing.assert_array_equal(rows.rows[:, 0], [one.time for one in samples])
    os.dup2(kept, own._file)
    os.close(kept)
    os.close(full)
    own.close()
    back = Journal.reopen(tmp_path / "a", "x")
    assert list(back.said()) == samples[:100]
    back.close()


def test_with_a_limit_of_files_states_go_on_and_the_error_says_why(case, blow):
    """The journal may have 20 kB: 300 samples; the bundle needs more."""
    job = subprocess.run(
        [sys.executable, "-m", "strapdown", "crash", "case.toml", "--live", "-", "--out", "out"],
        cwd=case.parent,
        input="\n".join(blow) + "\n",
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000)),
    )
    assert job.returncode == 4, job.stderr
    assert "Traceback" not in job.stderr
    assert job.stderr.count("can no longer be written") == 1
    assert "File too large" in job.stderr
    # It went on to the end of the event, which begins after 500 samples.
    assert json.loads(job.stdout.splitlines()[-1])["status"] == "ended"
    assert not (case.parent / "out").exists()
    own = Journal.reopen(case.parent / "out-received", COMMAND)
    assert len(list(own.said())) == (20_000 - 101) // RECORD
    own.close()


def test_a_second_recovery_waits_for_nobody(left):
    """Two at once: one recovers, the other is told."""
    jobs = [start(left.parent, "crash", "--recover", left.name) for _ in range(2)]
    ends = [(job.communicate(timeout=60)[1], job.returncode) for job in jobs]
    codes = sorted(code for _, code in ends)
    assert codes[0] == 0
    assert codes[1] in (3, 4)
    assert not any(b"Traceback" in err for err, _ in ends)
    assert (left.parent / "out" / "manifest.json").is_file()


def test_a_journal_that_is_removed_while_another_opens_it_leaves_nothing(left, monkeypatch):
    """Between that one's look at the folder and its lock; once with the lock file made anew."""
    for again in (False, True):
        folder = left if not again else shutil.copytree(left.parent / "kept", left)
        if not again:
            shutil.copytree(left, left.parent / "kept")
        own = Journal.reopen(folder, COMMAND)
        lock = module.open_locked

        def after_removal(path, own=own, lock=lock, again=again, **options):
            if again:
                # It exists for the other again, before the folder is removed.
                rmdir = Path.rmdir
                monkeypatch.setattr(Path, "rmdir", lambda p: (path.touch(), rmdir(p)))
            own.remove(whole=True)
            monkeypatch.undo()
            return lock(path, **options)

        monkeypatch.setattr(module, "open_locked", after_removal)
        with pytest.raises(ConfigError, check=coded("live.no-journal")):
            Journal.reopen(folder, COMMAND)
        assert not folder.exists()


def test_a_journal_is_held_until_all_of_it_is_removed(left, monkeypatch):
    """Another that comes while the files are removed finds it in use, and the folder goes."""
    own, told = Journal.reopen(left, COMMAND), []
    (left / "received.csv").write_text("t\n")
    unlink = Path.unlink

    def meanwhile(path, **options):
        with pytest.raises(ConfigError) as refused:
            Journal.reopen(left, COMMAND)
        told.append(refused.value.finding.code)
        unlink(path, **options)

    monkeypatch.setattr(Path, "unlink", meanwhile)
    own.remove(whole=True)
    assert set(told) <= {"live.journal-in-use", "live.no-journal"}
    assert len(told) == 4
    assert not left.exists()


def test_the_disk_is_told_to_keep_it_and_a_disk_that_cannot_is_told_of(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "SYNCED", 0.01)
    calls, real, told = [], os.fsync, []

    def sync(file):
        calls.append(file)
        real(file)

    monkeypatch.setattr(os, "fsync", sync)
    own = Journal.begin(tmp_path / "a", {"command": "x"})
    own.warn = told.append
    assert len(calls) == 3, "the configuration, and both folders"

    def wait(enough):
        deadline = time.monotonic() + 10.0
        while not enough() and time.monotonic() < deadline:
            time.sleep(0.005)
        assert enough()

    own.append(Word("next"))
    wait(lambda: own._file in calls)

    def fails(file):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(os, "fsync", fails)
    own.append(Word("fine"))
    wait(lambda: told)
    own.append(Word("navigation"))
    assert [one.code for one in told] == ["live.journal-stopped"]
    assert [one.word for one in own.said()] == ["next", "fine"]
    own.close()


def test_a_command_over_the_network_needs_the_token_that_was_told(case, blow):
    job = subprocess.Popen(
        [sys.executable, "-m", "strapdown", "crash", "case.toml", "--live", "udp://:0"],
        cwd=case.parent,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    token = job.stderr.readline().split("command,WORD,")[1].strip()
    port = int(job.stderr.readline().rpartition(":")[2])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for text in (*blow[:50], "command,end", "command,end,guessed", f"command,end,{token}"):
            sender.sendto(text.encode(), ("127.0.0.1", port))
    _, err = job.communicate(timeout=60)
    assert job.returncode == 0, err
    assert "line 51: line not used: the command 'end' came without the token" in err
    assert token not in err
    told = json.loads((case.parent / "case-crash-live" / "latency.json").read_text())
    assert (told["lines"], told["not_used"]) == (53, {"command refused": 2})


def test_a_recovery_by_another_program_says_so(left, run_cli, monkeypatch):
    monkeypatch.chdir(left.parent)
    done = run_cli("crash", "--recover", left)
    assert done.code == 0
    assert "another version of strapdown (0)" in done.err
    assert "is recovered" in done.err
