"""Mutation testing: `python tests/mutation`. See README.md of this folder.

Each mutant runs in a forked process. The parent has imported the libraries and nothing of the
package; the child imports the package with the one changed text in the place of its file, and runs
the tests that should notice. Nothing is written into the source tree.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import signal
import sys
import time
import tomllib
from collections import Counter
from dataclasses import dataclass
from importlib import import_module
from importlib.machinery import SourceFileLoader
from pathlib import Path

# Imported here once, so that no child has to.
import numba
import numpy
import pandas
import pytest
import scipy.linalg
import scipy.optimize
import scipy.signal
import scipy.stats
from mutants import Mutant, sample, stated

__all__ = ["numpy", "pandas", "scipy"]

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
#: Processor time that a mutant may take, as a multiple of the unchanged source's, and at least, s.
PATIENCE, LEAST = 4.0, 10.0


@dataclass(frozen=True)
class Target:
    """A source file and the tests that should notice its mutants."""

    source: str
    tests: list[str]
    mutants: int
    known: list[list[str]]
    jit: bool
    deselect: list[str]


def targets(path: Path, only: list[str]) -> list[Target]:
    """The targets of the file whose path contains one of the given words; all without words."""
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    result = []
    for row in table["target"]:
        if only and not any(word in row["source"] for word in only):
            continue
        result.append(
            Target(
                row["source"],
                row["tests"],
                row.get("mutants", table["mutants"]),
                row.get("known", []),
                row.get("jit", "_kernels/" not in row["source"]),
                row.get("deselect", []),
            )
        )
    # Those whose kernels are compiled come last: what they share is then imported once.
    return sorted(result, key=lambda target: target.jit)


def start(target: Target, text: str | None, limit: float | None) -> int:
    """Fork a process that runs the tests against a changed text; its id."""
    child = os.fork()
    if child:
        return child
    code = 70
    try:
        os.chdir(ROOT)
        if limit is not None:
            silent = os.open(os.devnull, os.O_WRONLY)
            os.dup2(silent, 1)
            os.dup2(silent, 2)
            resource.setrlimit(resource.RLIMIT_CPU, (int(limit) + 1, int(limit) + 1))
        if "_kernels/" in target.source:
            # Not those that are delivered, which no mutant changes.
            os.environ["STRAPDOWN_KERNELS"] = "numba"
        if not target.jit:
            numba.config.DISABLE_JIT = True
            os.environ["NUMBA_DISABLE_JIT"] = "1"
        if text is not None:
            _replace(str(ROOT / target.source), text)
        options = ["-x", "-qq", "-p", "no:cacheprovider", "-p", "no:xdist"]
        options += [x for name in target.deselect for x in ("--deselect", name)]
        code = int(pytest.main([*options, *target.tests]))
    finally:
        sys.stdout.flush()
        os._exit(code)


def _replace(path: str, text: str) -> None:
    """Let the import of a file compile another text."""
    usual = SourceFileLoader.get_code

    def get_code(self: SourceFileLoader, fullname: str) -> object:
        if self.path == path:
            return compile(text, path, "exec", dont_inherit=True)
        return usual(self, fullname)

    SourceFileLoader.get_code = get_code  # type: ignore[method-assign]


def verdict(status: int) -> str:
    """What the end of a process says of its mutant."""
    if os.WIFSIGNALED(status):
        return "timeout" if os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGKILL) else "killed"
    code = os.WEXITSTATUS(status)
    # 1: a test failed; 2: collecting failed, since the mutant cannot even be imported.
    if code not in (0, 1, 2):
        raise SystemExit(f"pytest ended with {code}: look at the tests of the target")
    return "survived" if code == 0 else "killed"


def baseline(target: Target) -> float:
    """Processor time of the tests against the unchanged source, s; they must pass."""
    _, status, usage = os.wait4(start(target, None, None), 0)
    if status:
        raise SystemExit(f"{target.source}: its tests fail without a mutant (status {status})")
    return usage.ru_utime + usage.ru_stime


def examine(target: Target, chosen: list[Mutant], jobs: int) -> list[dict[str, object]]:
    """Run the tests against each mutant, so many at a time."""
    limit = max(LEAST, PATIENCE * baseline(target))
    waiting, running, rows = list(chosen), {}, []
    while waiting or running:
        while waiting and len(running) < jobs:
            mutant = waiting.pop(0)
            running[start(target, mutant.text, limit)] = mutant
        child, status = os.wait()
        mutant = running.pop(child)
        rows.append(
            {
                "source": target.source,
                "line": mutant.line,
                "kind": mutant.kind,
                "before": mutant.before,
                "after": mutant.after,
                "verdict": verdict(status),
            }
        )
    return sorted(rows, key=lambda row: (row["line"], row["after"]))


def main() -> int:
    """Run, print a table and the survivors, write JSON; 1 if a survivor is not explained."""
    parser = argparse.ArgumentParser(prog="tests/mutation")
    parser.add_argument("only", nargs="*", help="words of the paths of the sources; all without")
    parser.add_argument("--targets", type=Path, default=HERE / "targets.toml")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--mutants", type=int, help="mutants of each file")
    parser.add_argument("--known", action="store_true", help="only the mutants that are stated")
    parser.add_argument("--again", type=Path, help="only the survivors of this earlier JSON")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", type=Path, default=ROOT / "mutation.json")
    options = parser.parse_args()
    explained = {
        (row["source"], row["before"], row["after"]): row["why"]
        for row in tomllib.loads((HERE / "survivors.toml").read_text(encoding="utf-8"))["survivor"]
    }
    again = None
    if options.again:
        earlier = json.loads(options.again.read_text(encoding="utf-8"))
        again = [
            (r["source"], r["before"], r["after"]) for r in earlier if r["verdict"] != "killed"
        ]
    sys.path.insert(0, str(ROOT / "src"))
    os.environ["PYTHONPATH"] = str(ROOT / "src")
    pytest.main(["--version"])
    rows: list[dict[str, object]] = []
    for target in targets(options.targets, options.only):
        source = (ROOT / target.source).read_text(encoding="utf-8")
        count = 0 if options.known else options.mutants or target.mutants
        chosen = sample(source, target.source, count, options.seed)
        chosen += [stated(source, *pair) for pair in target.known]
        if again is not None:
            chosen = [m for m in chosen if (target.source, m.before, m.after) in again]
        if not chosen:
            continue
        if target.jit:
            # No mutant of theirs changes a kernel.
            import_module("strapdown._kernels")
        began = time.monotonic()
        some = examine(target, chosen, options.jobs)
        for row in some:
            why = explained.get((row["source"], row["before"], row["after"]))
            if row["verdict"] == "survived" and why:
                row |= {"verdict": "explained", "why": why}
        rows += some
        tally = Counter(str(row["verdict"]) for row in some)
        print(
            f"{target.source:58}{len(some):4}  "
            + "  ".join(f"{name} {n}" for name, n in sorted(tally.items()))
            + f"  ({time.monotonic() - began:.0f} s)",
            flush=True,
        )
        for row in some:
            if row["verdict"] == "survived":
                print(f"    {row['line']}: {row['before']}\n      -> {row['after']}", flush=True)
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    tally = Counter(str(row["verdict"]) for row in rows)
    print(f"{len(rows)} mutants: " + ", ".join(f"{n} {name}" for name, n in sorted(tally.items())))
    return 1 if tally["survived"] else 0


if __name__ == "__main__":
    sys.exit(main())
