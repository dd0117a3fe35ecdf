"""Jobs: two at once, ended when told, found again by a server that is started again."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from strapdown.errors import ConfigError
from strapdown.studio import job_keeper, jobs
from strapdown.studio.folder import Folder
from strapdown.studio.jobs import AT_ONCE, ENDED, LINES, WHOLE, Jobs, process_began

posix = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")

#: Stands for ``python -m strapdown``: what it does is its first word.
COMMAND = """
import json, os, signal, sys, time
word, *rest = sys.argv[1:]
def tell(**said):
    with open(os.environ["STRAPDOWN_PROGRESS"], "a") as stream:
        stream.write(json.dumps(said) + "\\n")
if word == "stubborn":
    signal.signal(signal.SIGINT, signal.SIG_IGN)
if word in ("sleep", "stubborn"):
    print("begun", flush=True)
    time.sleep(0.2)
    tell(stage="working", share=0.25)
    time.sleep(float(rest[0]))
if word == "shout":
    for k in range(60_000):
        print(k, "x" * 100)
if word == "fail":
    tell(stage="reading", share=0.1)
    tell(error={"code": "io.no-such-file", "severity": "error", "text": "not there"})
    sys.exit(3)
if word == "backward":
    for share in (0.5, 0.9, 0.2, -1, "x", 7):
        tell(stage="again", share=share)
    time.sleep(float(rest[0]))
if word == "killed":
    os.kill(os.getpid(), signal.SIGKILL)
if word == "garbage":
    with open(os.environ["STRAPDOWN_PROGRESS"], "wb") as stream:
        stream.write(b"\\xff{\\n[1]\\n{\\"stage\\": {}}\\n" + b"x" * 100_000)
    sys.stdout.buffer.write(b"\\xff\\x1b[2J\\n")
"""


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder whose jobs are `COMMAND`."""
    (tmp_path / "command.py").write_text(COMMAND, encoding="utf-8")
    python = tmp_path / "python"
    python.write_text(
        f'#!/bin/sh\nif [ "$1" = -m ]; then shift 2; exec {sys.executable} '
        f'{tmp_path}/command.py "$@"; fi\nexec {sys.executable} "$@"\n',
        encoding="utf-8",
    )
    python.chmod(0o755)
    monkeypatch.setattr(jobs.sys, "executable", str(python))
    children = []

    class Noted(subprocess.Popen):
        def __init__(self, *words, **options):
            super().__init__(*words, **options)
            children.append(self)

    monkeypatch.setattr(jobs.subprocess, "Popen", Noted)
    root = tmp_path / "folder"
    root.mkdir()
    yield Folder.open(root)
    for child in children:
        with suppress(ProcessLookupError):
            os.killpg(child.pid, signal.SIGKILL)
        child.wait()


def members(group):
    """Processes of a group that are not over."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            said = path.read_text(encoding="utf-8").rpartition(")")[2].split()
            found += [path] if int(said[2]) == group and said[0] not in "ZX" else []
    return found


def until(of, number, *states, seconds=30.0):
    """Wait for a state, or for a stage that is named so."""
    end = time.monotonic() + seconds
    while True:
        of.advance()
        one = of.shown(number)
        if one["state"] in states or one["stage"] in states:
            return one
        assert time.monotonic() < end, one
        time.sleep(0.02)


def test_a_job_says_how_far_it_is_and_how_it_ended(place):
    of = Jobs(place)
    one = of.submit("navigate", "a b", ["sleep", "0.5"])
    assert one["command"] == "strapdown sleep 0.5" and one["state"] == "running"
    seen = until(of, one["id"], "working")
    assert seen["share"] == 0.25 and seen["tail"] == ["begun"]
    done = until(of, one["id"], *ENDED)
    assert (done["state"], done["share"], done["error"]) == ("done", 1.0, None)
    assert done["run"] is None  # it wrote no result
    assert done["begun"] < done["ended"]


def test_a_share_does_not_go_back_and_no_nonsense_is_shown(place):
    of = Jobs(place)
    one = of.submit("navigate", "a", ["backward", "1"])
    time.sleep(0.6)
    assert until(of, one["id"], "again")["share"] in (0.5, 0.9, 0.0)
    assert until(of, of.submit("x", "b", ["garbage"])["id"], *ENDED)["state"] == "done"


def test_an_error_is_that_of_the_command(place):
    of = Jobs(place)
    failed = until(of, of.submit("navigate", "a", ["fail"])["id"], *ENDED)
    assert failed["state"] == "failed" and failed["error"]["code"] == "io.no-such-file"
    killed = until(of, of.submit("navigate", "b", ["killed"])["id"], *ENDED)
    assert killed["state"] == "failed" and killed["error"]["code"] == "studio.job-failed"
    assert "SIGKILL" in killed["error"]["text"]


def test_two_run_and_the_others_wait_in_order(place):
    of = Jobs(place)
    made = [of.submit("navigate", str(k), ["sleep", "1"])["id"] for k in range(4)]
    states = [of.shown(number)["state"] for number in made]
    assert states == ["running"] * AT_ONCE + ["waiting"] * 2
    of.cancel(made[3])
    assert of.shown(made[3])["state"] == "cancelled"
    assert until(of, made[2], "running")["state"] == "running"
    assert {of.shown(number)["state"] for number in made[:AT_ONCE]} & set(ENDED)


def test_a_name_at_work_and_a_queue_that_is_full(place, monkeypatch):
    of = Jobs(place)
    of.submit("navigate", "a", ["sleep", "5"])
    with pytest.raises(ConfigError) as caught:
        of.submit("navigate", "a", ["sleep", "5"])
    assert caught.value.finding.code == "studio.job-at-work"
    monkeypatch.setattr(jobs, "WAITING", 3)
    for k in range(4):
        of.submit("navigate", str(k), ["sleep", "5"])
    with pytest.raises(ConfigError) as caught:
        of.submit("navigate", "one more", ["sleep", "5"])
    assert caught.value.finding.code == "studio.too-many-jobs"


@posix
def test_a_job_that_is_cancelled_ends_by_an_interrupt(place):
    of = Jobs(place)
    one = of.submit("navigate", "a", ["sleep", "60"])
    until(of, one["id"], "working")
    number = of._jobs[one["id"]].process
    assert of.cancel(one["id"])["stage"] == "ending"
    done = until(of, one["id"], *ENDED)
    assert done["state"] == "cancelled" and "KeyboardInterrupt" in "".join(done["tail"])
    end = time.monotonic() + 10.0
    while process_began(number) and time.monotonic() < end:
        time.sleep(0.02)
    assert process_began(number) == ""
    assert of.cancel(one["id"])["state"] == "cancelled"


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads /proc")
def test_a_job_that_takes_no_interrupt_is_ended_with_its_group(place, monkeypatch):
    monkeypatch.setattr(jobs, "GRACE", 0.5)
    of = Jobs(place)
    one = of.submit("navigate", "a", ["stubborn", "60"])
    until(of, one["id"], "working")
    group = of._jobs[one["id"]].process
    of.cancel(one["id"])
    begun = time.monotonic()
    assert until(of, one["id"], *ENDED)["state"] == "cancelled"
    assert 0.4 < time.monotonic() - begun < 20.0
    time.sleep(0.2)
    assert not members(group)


def test_another_server_finds_a_job_that_runs(place):
    first = Jobs(place)
    one = first.submit("navigate", "a", ["sleep", "2"])
    waits = [first.submit("navigate", str(k), ["sleep", "0.1"])["id"] for k in range(2)]
    until(first, one["id"], "working")
    second = Jobs(place)
    seen = second.shown(one["id"])
    assert seen["state"] == "running" and seen["tail"] == ["begun"]
    # As if the first server were gone, which was its parent.
    first._children[one["id"]].wait()
    assert until(second, one["id"], *ENDED)["state"] == "done"
    assert until(second, waits[1], *ENDED)["state"] == "done"


def test_another_server_finds_a_job_that_ended_meanwhile(place):
    first = Jobs(place)
    made = {w: first.submit("x", w, [w, "0.1"])["id"] for w in ("sleep", "fail")}
    for number in made.values():
        first._children[number].wait()
    second = Jobs(place)
    assert second.shown(made["sleep"])["state"] == "done"
    assert second.shown(made["fail"])["error"]["code"] == "io.no-such-file"


@posix
def test_a_job_whose_processes_are_gone_is_lost(place):
    first = Jobs(place)
    one = first.submit("navigate", "a", ["sleep", "60"])
    until(first, one["id"], "working")
    os.killpg(first._jobs[one["id"]].process, signal.SIGKILL)
    first._children[one["id"]].wait()
    lost = Jobs(place).shown(one["id"])
    assert lost["state"] == "lost" and lost["error"]["code"] == "studio.job-lost"


@posix
def test_another_process_with_the_number_of_a_job_is_none(place):
    """The number is used again by the system: this process here stands for the other."""
    first = Jobs(place)
    one = first.submit("navigate", "a", ["sleep", "60"])
    until(first, one["id"], "working")
    os.killpg(first._jobs[one["id"]].process, signal.SIGKILL)
    first._children[one["id"]].wait()
    path = place.state / "jobs" / f"{one['id']}.json"
    said = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps({**said, "process": os.getpid()}), encoding="utf-8")
    again = Jobs(place)
    assert again.cancel(one["id"])["state"] == "lost"


def test_output_is_bounded_on_disk_and_in_the_answer(place):
    of = Jobs(place)
    one = until(of, of.submit("navigate", "a", ["shout"])["id"], *ENDED, seconds=60)
    assert one["state"] == "done" and len(one["tail"]) <= LINES
    assert one["tail"][-1].startswith("59999 ")
    whole = of.whole(one["id"])
    assert len(whole) > LINES and sum(map(len, whole)) <= WHOLE and whole[-LINES:] == one["tail"]
    kept = list((place.state / "jobs").glob(f"{one['id']}.log*"))
    assert sum(path.stat().st_size for path in kept) <= 2 * job_keeper.MOST


def test_jobs_that_ended_long_ago_are_forgotten(place, monkeypatch):
    monkeypatch.setattr(jobs, "REMEMBERED", 2)
    of = Jobs(place)
    made = []
    for k in range(5):
        made.append(of.submit("navigate", str(k), ["sleep", "0"])["id"])
        until(of, made[-1], *ENDED)
    of.submit("navigate", "last", ["sleep", "0"])
    assert [one["id"] for one in of.listed()][1:] == made[:-3:-1]
    kept = {path.name.split(".")[0] for path in (place.state / "jobs").iterdir()}
    assert not kept & set(made[:3])


@pytest.mark.parametrize("text", ["", "{", "[]", '{"id": 1}', '{"id": "x", "words": 3}', "\x00"])
def test_a_damaged_state_is_passed_over(place, text):
    (place.state / "jobs" / "0123.json").write_text(text, encoding="utf-8")
    assert Jobs(place).listed() == []


def test_the_begin_of_a_process():
    own = process_began(os.getpid())
    assert own and own == process_began(os.getpid())
    assert process_began(2**22 + 1) == ""
