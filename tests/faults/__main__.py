"""Run whole commands under faults, and count what stands at the name of the result afterwards.

``python -m tests.faults kills 500``   killed at drawn instants
``python -m tests.faults calls 400``   a system call fails (strace): a full disk, an error of the
                                       disk, no more memory; or the process is killed at it
``python -m tests.faults pairs 200``   two runs into one name at once

After each: the name holds the old or the new result, whole, or nothing where there was none; no
traceback; and the next run finds and leaves nothing hidden. Exits 1 if one is not so.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from strapdown.bundle import MANIFEST, claimed, read_manifest, sha256, unsealed_changes

ROOT = Path(__file__).parents[2]
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
    "rmdir": ("EACCES",),
}


class Commands:
    """Four commands with results of every kind of file, and the seal of each when it is whole."""

    def __init__(self, home: Path) -> None:
        self.home = home
        drive = home / "drive.toml"
        shutil.copytree(ROOT / "docs" / "examples", home / "examples")
        example = (ROOT / "docs" / "examples" / "navigate_drive.toml").read_text(encoding="utf-8")
        drive.write_text(example, encoding="utf-8")
        self.run("simulate", "pole", "--out", home / "pole")
        case = home / "pole" / "case.toml"
        text = case.read_text(encoding="utf-8")
        case.write_text(text.replace("monte_carlo_runs = 2000", "monte_carlo_runs = 0"))
        self.given: dict[str, list[str]] = {
            "attitude": ["attitude", "alexiev-fig4", "--png"],
            "simulate": ["simulate", "alexiev-fig2f", "--format", "all"],
            "crash": ["crash", str(case)],
            "navigate": ["navigate", str(home / "examples" / "navigate_drive.toml")],
        }
        self.seals: dict[str, str] = {}
        self.seconds: dict[str, float] = {}
        for name, given in self.given.items():
            for _ in range(2):  # the second with compiled kernels
                begin = time.monotonic()
                self.run(*given, "--force", "--out", home / name / "out")
                self.seconds[name] = time.monotonic() - begin
            self.seals[name] = sha256(home / name / "out" / MANIFEST)

    def run(self, *given: object, before: tuple[str, ...] = ()) -> subprocess.CompletedProcess:
        """Run a command to its end."""
        whole = [*before, *STRAPDOWN, *map(str, given), "--quiet"]
        return subprocess.run(whole, capture_output=True, cwd=self.home, check=False)


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
    for _ in range(count):
        name = draw.choice(list(commands.given))
        had = draw.random() < 0.5
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "deep" / "out"
            if had:
                shutil.copytree(commands.home / name / "out", out)
            child = subprocess.Popen(
                [*STRAPDOWN, *commands.given[name], "--force", "--out", str(out), "--quiet"],
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                cwd=commands.home,
            )
            # Most of the writing is at the end.
            part = draw.choice((draw.uniform(0.0, 1.2), draw.uniform(0.7, 1.1)))
            time.sleep(part * commands.seconds[name])
            child.kill()
            told = child.communicate()[0]
            ended = "ended" if child.returncode == 0 else "killed"
            found[f"{name} {ended}, {judged(out, {commands.seals[name]}, told, had)}"] += 1
    return found


def calls(commands: Commands, count: int, draw: random.Random) -> Counter[str]:
    """Let one system call of a command fail, or all from one on; or kill the process at it."""
    if shutil.which("strace") is None:
        sys.exit("strace is not installed")
    found: Counter[str] = Counter()
    totals: dict[tuple[str, str], int] = {}
    for name, given in commands.given.items():
        with tempfile.TemporaryDirectory() as folder:
            summary = Path(folder) / "summary"
            trace = ("strace", "-f", "-c", "-U", "name,calls", "-o", str(summary))
            commands.run(*given, "--out", Path(folder) / "x" / "out", before=trace)
            for line in summary.read_text().splitlines():
                words = line.split()
                if len(words) == 2 and words[0] in CALLS:
                    totals[name, words[0]] = int(words[1])
    kinds = sorted(totals)
    for _ in range(count):
        name, call = draw.choice(kinds)
        # The last ones write the result; those at the start load the program.
        total = totals[name, call]
        when = draw.randint(max(1, total - 150), total)
        if draw.random() < 0.3:
            fault, what = "signal=KILL", "killed"
        else:
            what = draw.choice(CALLS[call])
            fault = f"error={what}"
        # A folder that can never be removed sends the library's cleaning round in circles.
        once = "KILL" in fault or call == "rmdir" or draw.random() < 0.5
        more = "" if once else "+"
        had = draw.random() < 0.5
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "out"
            if had:
                shutil.copytree(commands.home / name / "out", out)
            inject = f"inject={call}:{fault}:when={when}{more}"
            trace = ("strace", "-f", "-o", "/dev/null", "-e", f"trace={call}", "-e", inject)
            done = commands.run(*commands.given[name], "--force", "--out", out, before=trace)
            told = b"" if call == "mmap" else done.stdout + done.stderr
            try:
                state = judged(out, {commands.seals[name]}, told, had)
            except AssertionError as error:
                print(f"{name}: {inject}: {str(error)[-600:]}")
                state = "FAILED"
            found[f"{call} {what}, {state}"] += 1
    return found


def pairs(commands: Commands, count: int, draw: random.Random) -> Counter[str]:
    """Start two runs into one name within a drawn time; each that says 0 has written it."""
    found: Counter[str] = Counter()
    for _ in range(count):
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
                time.sleep(draw.uniform(0.0, 1.3 * commands.seconds[name]))
            told = b"".join(child.communicate()[0] for child in both)
            codes = sorted(child.returncode for child in both)
            assert codes in ([0, 0], [0, 4]), (codes, told)
            # Two that both end with 0 came one after the other, and by force.
            assert had or codes == [0, 4], codes
            found[f"{name} {codes}, {judged(out, {commands.seals[name]}, told, had)}"] += 1
    return found


def main() -> int:
    """Run one kind of fault and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=("kills", "calls", "pairs"))
    parser.add_argument("count", type=int)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    with tempfile.TemporaryDirectory(prefix="strapdown-faults-") as home:
        commands = Commands(Path(home))
        draw = random.Random(asked.seed)
        found = globals()[asked.kind](commands, asked.count, draw)
    for what, number in sorted(found.items()):
        print(f"{number:6d}  {what}")
    return int(any("FAILED" in what for what in found))


if __name__ == "__main__":
    sys.exit(main())
