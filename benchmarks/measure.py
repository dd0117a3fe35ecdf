"""Processor time of two sides in one run, by turns, and commands as child processes."""

from __future__ import annotations

import ctypes
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

#: Yardstick of whole commands: the two libraries that every one of them imports.
LIBRARIES = "python -c 'import numpy, pandas'"


@dataclass(frozen=True)
class Row:
    """One row of the table: ours beside another side of the same run.

    Attributes
    ----------
    what, against : str
        Both sides; the other is empty where `missing` says why there is none.
    ours, theirs : tuple of float
        Of each round, in `unit`.
    goal : float or None
        Ratio to reach; None: the number is for information.
    limit : float or None
        Ratio beyond which the run fails: by default the goal. Where the goal is not reached yet,
        a little above what is measured.
    missing : str
        Why nothing was measured.
    """

    what: str
    ours: tuple[float, ...] = ()
    against: str = ""
    theirs: tuple[float, ...] = ()
    unit: str = ""
    goal: float | None = None
    limit: float | None = None
    missing: str = ""

    @property
    def ratios(self) -> tuple[float, float, float]:
        """Lower quartile, median and upper quartile of the ratio over the rounds."""
        each = [a / b for a, b in zip(self.ours, self.theirs, strict=True)]
        low, middle, high = np.quantile(each, [0.25, 0.5, 0.75])
        return float(low), float(middle), float(high)

    @property
    def verdict(self) -> str:
        """'reached', 'not yet' (within the limit alone), 'OVER'; '' without a goal.

        Over its limit is a row of which three quarters of the rounds are: what else a machine does
        adds to some of them.
        """
        if self.missing or self.goal is None:
            return ""
        low, middle, _ = self.ratios
        if middle <= self.goal:
            return "reached"
        return "OVER" if low > (self.limit or self.goal) else "not yet"

    def cells(self) -> list[str]:
        """The row as text: what, ours, against, theirs, ratio, goal, limit, verdict."""
        if self.missing:
            return [self.what, "", self.against, "", f"not measured: {self.missing}", "", "", ""]
        sides = [f"{statistics.median(side):.3g} {self.unit}" for side in (self.ours, self.theirs)]
        low, middle, high = self.ratios
        ratio = f"{middle:.2f}" if len(self.ours) == 1 else f"{middle:.2f} ({low:.2f}–{high:.2f})"
        goal = "–" if self.goal is None else f"{self.goal:.3g}"
        limit = goal if self.limit is None else f"{self.limit:.3g}"
        return [self.what, sides[0], self.against, sides[1], ratio, goal, limit, self.verdict]


def by_turns(
    *jobs: Callable[[], object], rounds: int = 15, per: float = 1.0
) -> list[tuple[float, ...]]:
    """Processor time of each job in each round, s times `per`, after one unmeasured round."""
    spent: list[list[float]] = [[] for _ in jobs]
    for number in range(rounds + 1):
        for job, times in zip(jobs, spent, strict=True):
            start = time.process_time()
            job()
            if number:
                times.append((time.process_time() - start) * per)
    return [tuple(times) for times in spent]


@dataclass(frozen=True)
class Usage:
    """Processor time, s, and largest memory, MiB, of a child process and its own children."""

    seconds: float
    peak: float


#: Starts a command and writes its status, processor time and largest memory. The memory of a
#: process counts that of the one that started it, which therefore is to be a small one.
STARTER = """
import os, sys
pid = os.posix_spawnp(sys.argv[2], sys.argv[2:], os.environ)
_, status, used = os.wait4(pid, 0)
with open(sys.argv[1], "w") as file:
    status, spent = os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime
    print(status, spent, used.ru_maxrss, file=file)
"""


def command(
    words: Sequence[str],
    *,
    folder: Path | None = None,
    environment: Mapping[str, str] | None = None,
) -> Usage:
    """Run a child process to its end; RuntimeError if it fails."""
    with tempfile.NamedTemporaryFile("r") as answer:
        done = subprocess.run(
            [sys.executable, "-I", "-S", "-c", STARTER, answer.name, *words],
            cwd=folder,
            # An installation has its bytecode: without, a third of a short run is compilation.
            env={**os.environ, "PYTHONDONTWRITEBYTECODE": "", **(environment or {})},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
        status, spent, peak = answer.read().split() or ("1", "0", "0")
    if int(status):
        raise RuntimeError(f"{' '.join(words)}: {done.stderr}")
    return Usage(float(spent), float(peak) / 1024.0)


def strapdown(*words: str, **options: Any) -> Usage:
    """Run a command of ours; options as of `command`."""
    return command([sys.executable, "-m", "strapdown", *words], **options)


def libraries(**options: Any) -> Usage:
    """Import the libraries of the yardstick."""
    return command([sys.executable, "-c", "import numpy, pandas"], **options)


def new_home(folder: Path) -> dict[str, str]:
    """Environment of a user who never ran the program, whose home is a new folder in `folder`."""
    home = tempfile.mkdtemp(dir=folder)
    names = ("HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "NUMBA_CACHE_DIR")
    return dict.fromkeys(names, home)


@cache
def c_library(source: str) -> ctypes.CDLL | None:
    """Compile a file beside this one and load it; None without a compiler."""
    if shutil.which("gcc") is None:
        return None
    library = Path(tempfile.mkdtemp()) / "limit.so"
    flags = ["-O3", "-march=native", "-fno-math-errno", "-mprefer-vector-width=128"]
    path = Path(__file__).with_name(source)
    subprocess.run(
        ["gcc", *flags, "-shared", "-fPIC", str(path), "-o", str(library), "-lm"], check=True
    )
    return ctypes.CDLL(str(library))


#: Why a row against C has no number.
NO_COMPILER = "no gcc on this machine"


def pointer(values: np.ndarray) -> ctypes.c_void_p:
    """Address of a contiguous array."""
    return ctypes.c_void_p(values.ctypes.data)
