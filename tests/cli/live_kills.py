"""Kill live runs at drawn instants, recover each, and compare the seal with a run that was not.

``python -m tests.cli.live_kills 100 [SEED]``: half of the kills while lines come, half at any
instant of the whole command, its bundle included. Each run is a fork of a process that has all
imported, so that an instant is not spent in imports.
"""

from __future__ import annotations

import os
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
from tests.cli.test_crash_live import CASE, GYRO, line, samples
from tests.cli.test_navigate_live import lines, written
from tests.faults.forked import start

from strapdown.cli import crash_live, navigate_live
from strapdown.live.journal import MAGIC

RECORD = 65  # of a sample of rates and forces, with its frame
NEVER = 1 << 40


def received(folder):
    """How many records a journal has, an incomplete one not counted."""
    data, at, count = (folder / "journal").read_bytes(), len(MAGIC), 0
    while at + 8 <= len(data):
        at += 8 + int.from_bytes(data[at : at + 2], "little")
        count += at <= len(data)
    return count - 1


def begun(folder, *options):
    """The command as a fork, with a pipe to its standard input."""
    read, write = os.pipe()
    child = start(folder, options, stdin=read, wait=lambda: os.close(write))
    os.close(read)
    return child, write


def finished(folder, texts, *options):
    """Run to the end, and return the exit code."""
    child, write = begun(folder, *options)
    with os.fdopen(write, "w") as end:
        end.write("".join(f"{text}\n" for text in texts))
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def killed(folder, texts, options, size, wait):
    """Run to a kill: once the journal has a size, or after a time; the input ends only then."""
    child, write = begun(folder, *options)
    os.set_blocking(write, False)
    data, journal = "".join(f"{text}\n" for text in texts).encode(), folder / "out-received/journal"
    due = time.monotonic() + wait
    while time.monotonic() < due and not (journal.is_file() and journal.stat().st_size >= size):
        try:
            data = data[os.write(write, data[:2048]) :] if data else data
        except BlockingIOError:
            time.sleep(1e-4)
        if not data and write >= 0 and size == NEVER:
            os.close(write)
            write = -1
        if not data:
            time.sleep(1e-4)
        if os.waitpid(child, os.WNOHANG)[0]:
            return
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    if write >= 0:
        os.close(write)


def kills(name, command, prepare, texts, count, draw):
    """Kill `count` runs of a command; return how they ended."""
    ends: Counter[str] = Counter()
    seals: dict[int, bytes] = {}
    with tempfile.TemporaryDirectory() as root:

        def reference(n):
            if n not in seals:
                folder = Path(root) / f"ref{n}"
                folder.mkdir()
                prepare(folder)
                code = finished(folder, texts[:n], *command, "--live", "-", "--out", "out")
                assert code in (0, 3), (folder / "log").read_text()
                seal = folder / "out" / "manifest.json"
                seals[n] = seal.read_bytes() if seal.is_file() else b""
            return seals[n]

        reference(len(texts))
        del seals[len(texts)]
        shutil.rmtree(Path(root) / f"ref{len(texts)}")
        at = time.monotonic()
        reference(len(texts))
        whole = time.monotonic() - at
        for k in range(count):
            folder = Path(root) / str(k)
            folder.mkdir()
            prepare(folder)
            size = 101 + RECORD * int(draw.integers(0, len(texts))) if k % 2 else NEVER
            options = (*command, "--live", "-", "--out", "out")
            killed(folder, texts, options, size, 60.0 if k % 2 else draw.uniform(0.0, whole))
            left, out = folder / "out-received", folder / "out" / "manifest.json"
            n, was = (received(left) if (left / "journal").is_file() else -1), out.is_file()
            if was:
                # Whole, and of all lines.
                assert out.read_bytes() == reference(len(texts))
            if n <= 0:
                ends["complete" if was else "before the first record"] += 1
                continue
            code = finished(folder, [], command[0], "--recover", "out-received")
            told = (folder / "log").read_text()
            assert "Traceback" not in told, told
            if was:
                assert code in (3, 4)
                assert out.read_bytes() == reference(len(texts))
                ends["sealed, its journal not yet removed"] += 1
                continue
            want = reference(n)
            if not want:
                assert code == 3, told
                ends["too short to navigate, as without the kill"] += 1
                continue
            assert code == 0, told
            assert out.read_bytes() == want, f"{folder}: {n} lines"
            assert not left.exists()
            ends["recovered to the same seal"] += 1
            if k % 10 == 9:
                print(name, k + 1, dict(ends), flush=True)
    return ends


#: Imported before the forks.
IMPORTED = (crash_live, navigate_live)

if __name__ == "__main__":
    number, seed = int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1

    def run_file(folder):
        written(folder, '[live]\nsampling = "mean"\n')

    def case_file(folder):
        (folder / "case.toml").write_text(CASE + GYRO)

    blow = [line(row) for row in samples()[500:].tolist()]
    drawn = np.random.default_rng(seed)
    print(kills("crash", ("crash", "case.toml"), case_file, blow, number, drawn))
    print(kills("navigate", ("navigate", "run.toml"), run_file, lines(), number, drawn))
