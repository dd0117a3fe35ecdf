"""Run whole commands under faults, and count what stands at the name of the result afterwards.

``python -m tests.faults kills 500``   killed at drawn instants
``python -m tests.faults every``       killed at each system call that changes a name or a file
``python -m tests.faults calls 400``   a system call fails (strace): a full disk, an error of the
                                       disk, no more memory; or the process is killed at it
``python -m tests.faults pairs 200``   two runs into one name at once

A run is a fork of a process that has all imported, but for two at once and a quarter of the kills,
which are processes of their own.

After each: the name holds the old or the new result, whole, or nothing where there was none; no
traceback; and the next run finds and leaves nothing hidden. Exits 1 if one is not so.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from subprocess import DEVNULL

from tests.cli.test_navigate_live import recorded
from tests.faults.forked import start, warmed

from strapdown.bundle import MANIFEST, claimed, read_manifest, sha256, unsealed_changes

STRAPDOWN = [sys.executable, "-m", "strapdown"]
# Calls that change names and files, and the errors that they may meet.
CALLS = {
    "write": ("ENOSPC", "EIO"),
    "pwrite64": ("ENOSPC",),
    "mkdir": ("ENOSPC", "EACCES"),
    "rename": ("EIO",),
    "renameat2": ("EINVAL", "ENOSYS"),
    "fsync": ("EIO", "ENOSPC"),
    "ftruncate": ("EIO",),
    "fcntl": ("ENOLCK",),
    "mmap": ("ENOMEM",),
    "unlink": ("EACCES",),
    "unlinkat": ("EACCES",),
    "rmdir": ("EACCES",),
}


#: Calls that change what stands on the disk. Between two of them a kill leaves the same.
CHANGING = (
    *("openat", "write", "pwrite64", "mkdir", "rename", "renameat2", "fsync", "ftruncate"),
    *("unlink", "unlinkat", "rmdir", "link", "symlink", "chmod", "fchmod", "utimensat"),
)


class Commands:
    """Four commands with results of every kind of file, and the seal of each when it is whole."""

    def __init__(self, home: Path, alone: str | None = None) -> None:
        self.home = home
        (home / "drive").mkdir()
        drive = recorded(home / "drive")
        self.run("simulate", "pole", "--out", home / "pole")
        case = home / "pole" / "case.toml"
        text = case.read_text(encoding="utf-8")
        case.write_text(text.replace("monte_carlo_runs = 2000", "monte_carlo_runs = 0"))
        self.given: dict[str, list[str]] = {
            "attitude": ["attitude", "alexiev-fig4", "--png"],
            "simulate": ["simulate", "alexiev-fig2f", "--format", "all"],
            "crash": ["crash", str(case)],
            "navigate": ["navigate", str(drive)],
        }
        self.names = [alone] if alone else list(self.given)
        self.seals: dict[str, str] = {}
        self.seconds: dict[str, float] = {}
        for name in self.names:
            given = self.given[name]
            out = home / name / "out"
            # Once as a process of its own, and twice here, so that forks find all imported.
            self.run(*given, "--force", "--out", out)
            self.seals[name] = sha256(out / MANIFEST)
            for _ in range(2):
                begin = time.monotonic()
                assert warmed([*given, "--force", "--out", home / name / "warm"]) == 0
                self.seconds[name] = time.monotonic() - begin

    def run(self, *given: object) -> subprocess.CompletedProcess:
        """Run a command to its end."""
        whole = [*STRAPDOWN, *map(str, given), "--quiet"]
        return subprocess.run(whole, capture_output=True, cwd=self.home, check=False)

    def forked(self, name: str, out: Path, strace: Sequence[str] = ()) -> tuple[int, bytes]:
        """Run a command as a fork, under strace if it is given; return its status and words."""
        place = out.parent.parent
        child, go = held(place, [*self.given[name], "--force", "--out", out])
        tracer = None
        if strace:
            tracer = subprocess.Popen(["strace", "-f", "-p", str(child), *strace], stderr=DEVNULL)
            while not traced(child):
                time.sleep(0.002)
        os.close(go)
        status = os.waitpid(child, 0)[1]
        if tracer is not None:
            tracer.wait()
        return status, (place / "log").read_bytes()


def held(place: Path, words: Sequence[object]) -> tuple[int, int]:
    """Start a fork that begins when the descriptor that is returned with it is closed."""
    read, write = os.pipe()

    def wait() -> None:
        os.close(write)
        os.read(read, 1)

    child = start(place, words, wait=wait)
    os.close(read)
    return child, write


def traced(child: int) -> bool:
    """Whether a tracer has attached to a process."""
    said = Path(f"/proc/{child}/status").read_text()
    return "TracerPid:\t0" not in said


def judged(out: Path, seals: set[str], told: bytes, had: bool) -> str:
    """Return what stands at a name, or raise AssertionError."""
    assert b"Traceback" not in told, told.decode()
    # As the next run does.
    with claimed(out, True):
        pass
    left = [p.name for p in out.parent.iterdir() if p != out] if out.parent.exists() else []
    assert left == [], left
    if not out.exists():
        assert not had, "the old result is gone"
        return "absent"
    assert unsealed_changes(out, read_manifest(out)) == []
    digest = sha256(out / MANIFEST)
    assert digest in seals, digest
    return "whole"


def kills(commands: Commands, count: int, draw: random.Random) -> Counter[str]:
    """Kill commands at drawn instants; in half of the runs over an old result."""
    found: Counter[str] = Counter()
    for number in range(count):
        name = draw.choice(commands.names)
        had, whole = draw.random() < 0.5, draw.random() < 0.25
        # Most of the writing is at the end.
        part = draw.choice((draw.uniform(0.0, 1.2), draw.uniform(0.7, 1.1)))
        with placed(commands, name, had) as out:
            if whole:
                begin = [*STRAPDOWN, *commands.given[name], "--force", "--out", str(out), "--quiet"]
                with (out.parent.parent / "log").open("wb") as log:
                    child = subprocess.Popen(begin, stdout=log, stderr=log, cwd=commands.home).pid
                time.sleep(part * (commands.seconds[name] + 3.0))
            else:
                child, go = held(
                    out.parent.parent, [*commands.given[name], "--force", "--out", out]
                )
                os.close(go)
                time.sleep(part * commands.seconds[name])
            os.kill(child, signal.SIGKILL)
            status = os.waitpid(child, 0)[1]
            ended = "ended" if status == 0 else "killed"
            told = (out.parent.parent / "log").read_bytes()
            state = judged(out, {commands.seals[name]}, told, had)
            found[f"{name} {'whole ' if whole else ''}{ended}, {state}"] += 1
        progress(number, found)
    return found


@contextmanager
def placed(commands: Commands, name: str, had: bool) -> Iterator[Path]:
    """Give a name for a result, with an old one there or not."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "deep" / "out"
        if had:
            shutil.copytree(commands.home / name / "out", out)
        yield out


def progress(number: int, found: Counter[str]) -> None:
    """Print the counts so far after each twentieth run."""
    if number % 20 == 19:
        print(number + 1, dict(found), flush=True)


def called(
    commands: Commands, name: str, had: bool, wanted: Iterable[str]
) -> list[tuple[str, int, str]]:
    """Return the wanted calls of a run, in order: name, number of its kind, and the line of it."""
    numbers: Counter[str] = Counter()
    found = []
    with placed(commands, name, had) as out:
        file = out.parent.parent / "trace"
        trace = ("-o", str(file), "-e", f"trace={','.join(wanted)}")
        status, told = commands.forked(name, out, trace)
        assert status == 0, told
        for line in file.read_text(errors="replace").splitlines():
            call = line.split("(")[0].split()[-1]
            if call in wanted and " resumed>" not in line:
                numbers[call] += 1
                found.append((call, numbers[call], line))
    return found


def changes(call: str, line: str) -> bool:
    """Whether a call of `CHANGING` does: a file may be opened to be read."""
    return call != "openat" or "O_CREAT" in line or "O_TRUNC" in line


def faulted(
    commands: Commands, name: str, had: bool, call: str, fault: str, when: str
) -> tuple[str, int]:
    """Run a command with a fault at a call; return what stands at the name and its status."""
    with placed(commands, name, had) as out:
        inject = f"inject={call}:{fault}:when={when}"
        status, told = commands.forked(
            name, out, ("-o", "/dev/null", "-e", f"trace={call}", "-e", inject)
        )
        # Python has no words where it has no memory.
        told = b"" if call == "mmap" else told
        try:
            return judged(out, {commands.seals[name]}, told, had), status
        except AssertionError as error:
            print(f"{name}: {inject}: {str(error)[-600:]}", flush=True)
            return "FAILED", status


def every(commands: Commands, count: int, draw: random.Random) -> Counter[str]:
    """Kill four commands at each call that changes something, over an old result and over none."""
    found: Counter[str] = Counter()
    for name in commands.names:
        for had in (False, True):
            met = called(commands, name, had, CHANGING)
            kept = [(call, when) for call, when, line in met if changes(call, line)]
            for number, (call, when) in enumerate(kept):
                state, status = faulted(commands, name, had, call, "signal=KILL", str(when))
                ended = "killed" if os.WIFSIGNALED(status) else "ended"
                found[f"{name} {'over an old' if had else 'alone'}, {ended}, {state}"] += 1
                progress(number, found)
    return found


def calls(commands: Commands, count: int, draw: random.Random) -> Counter[str]:
    """Let one system call of a command fail, or all from one on; or kill the process at it."""
    found: Counter[str] = Counter()
    totals: dict[tuple[str, str], int] = {}
    for name in commands.names:
        totals |= {(name, call): number for call, number, _ in called(commands, name, True, CALLS)}
    kinds = sorted(totals)
    for number in range(count):
        name, call = draw.choice(kinds)
        when = draw.randint(1, totals[name, call])
        if draw.random() < 0.1:
            fault, what = "signal=KILL", "killed"
        else:
            what = draw.choice(CALLS[call])
            fault = f"error={what}"
        # A folder that can never be removed sends the library's cleaning round in circles.
        once = "KILL" in fault or call in ("rmdir", "unlinkat") or draw.random() < 0.5
        had = draw.random() < 0.5
        state, status = faulted(commands, name, had, call, fault, f"{when}{'' if once else '+'}")
        code = "signal" if os.WIFSIGNALED(status) else f"code {os.WEXITSTATUS(status)}"
        found[f"{call} {what}, {code}, {state}"] += 1
        progress(number, found)
    return found


def pairs(commands: Commands, count: int, draw: random.Random) -> Counter[str]:
    """Start two runs into one name within a drawn time; each that says 0 has written it."""
    found: Counter[str] = Counter()
    for number in range(count):
        name = draw.choice(("attitude", "simulate"))
        had = draw.random() < 0.5
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "out"
            if had:
                shutil.copytree(commands.home / name / "out", out)
            force = ["--force"] if had else []
            whole = [*STRAPDOWN, *commands.given[name], *force, "--out", str(out), "--quiet"]
            both = []
            for _ in range(2):
                both.append(
                    subprocess.Popen(
                        whole,
                        stdout=subprocess.PIPE,
                        stderr=subprocess.STDOUT,
                        cwd=commands.home,
                    )
                )
                time.sleep(draw.uniform(0.0, 1.3 * (commands.seconds[name] + 3.0)))
            told = b"".join(child.communicate()[0] for child in both)
            codes = sorted(child.returncode for child in both)
            assert codes in ([0, 0], [0, 4]), (codes, told)
            # Two that both end with 0 came one after the other, and by force.
            assert had or codes == [0, 4], codes
            found[f"{name} {codes}, {judged(out, {commands.seals[name]}, told, had)}"] += 1
        progress(number, found)
    return found


def main() -> int:
    """Run one kind of fault and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=("kills", "every", "calls", "pairs"))
    parser.add_argument("count", type=int, nargs="?", default=500)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--command", choices=("attitude", "simulate", "crash", "navigate"))
    asked = parser.parse_args()
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    if asked.kind in ("every", "calls") and shutil.which("strace") is None:
        sys.exit("strace is not installed")
    with tempfile.TemporaryDirectory(prefix="strapdown-faults-") as home:
        commands = Commands(Path(home), asked.command)
        draw = random.Random(asked.seed)
        found = globals()[asked.kind](commands, asked.count, draw)
    for what, number in sorted(found.items()):
        print(f"{number:6d}  {what}")
    return int(any("FAILED" in what for what in found))


if __name__ == "__main__":
    sys.exit(main())
