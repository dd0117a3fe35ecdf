"""Fuzz our own parsers: ``python tests/fuzz --minutes 1 --seed 0``.

With atheris (extra ``fuzz``) half of the time inputs are led by the branches that they reach. In
the other half, and without it, a seeded mutator makes them: the same seed makes the same ones.
They run in a process of their own, of which an input may take 30 s and 2 GB. Every new failure is
kept in ``tests/fuzz/corpus`` as a reproducer, which `test_corpus.py` replays.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib
import importlib.util
import json
import pkgutil
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Sequence
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

ROOT = Path(__file__).parent.parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

#: Limits of one input.
SECONDS, MEMORY = 30, 2 << 30
#: What is led by coverage: our parsers. Compiled kernels cannot be.
INSTRUMENTED = (
    "strapdown.formats",
    "strapdown.config",
    "strapdown.live.lines",
    "strapdown.crash.severity",
    "strapdown.sensors.catalogue",
)
#: Most failures of one run that are kept.
MOST = 100
#: Files in memory, where there are any.
SHM = Path("/dev/shm")
COUNTED = ("inputs", "read", "refused", "failures")


def _imported(atheris: Any) -> None:
    """Import the parsers, and have their functions report to atheris, if it is there.

    Not by its hook of imports, which takes whole packages: compiled kernels are no Python.
    """
    modules = []
    for name in INSTRUMENTED:
        module = importlib.import_module(name)
        found = pkgutil.walk_packages(getattr(module, "__path__", []), f"{name}.")
        modules += [module, *(importlib.import_module(one.name) for one in found)]
    for module in modules if atheris else ():
        of_module = [v for v in vars(module).values() if _is_own(v, module)]
        methods = [m for v in of_module if isinstance(v, type) for m in vars(v).values()]
        for one in (*of_module, *methods):
            plain = getattr(one, "__func__", getattr(one, "fget", one))
            if isinstance(plain, FunctionType) and plain.__module__ == module.__name__:
                atheris.instrument_func(plain)


def _is_own(value: Any, module: ModuleType) -> bool:
    return getattr(value, "__module__", "") == module.__name__


def _expired(*_: object) -> None:
    raise TimeoutError(f"more than {SECONDS} s")


class Session:
    """Inputs of some targets: their counts, and new failures."""

    def __init__(self, names: Sequence[str], counts: Path) -> None:
        from tests.fuzz.targets import TARGETS

        self.targets = {name: TARGETS[name] for name in names}
        self.seeds = {name: list(target.seeds()) for name, target in self.targets.items()}
        self.folder = tempfile.TemporaryDirectory(dir=SHM if SHM.is_dir() else None)
        self.counts_file, self.written = counts, 0.0
        self.counts = {name: dict.fromkeys(COUNTED, 0) for name in names}
        self.known: set[str] = set()
        signal.signal(signal.SIGALRM, _expired)

    def run(self, name: str, file: str, data: bytes) -> None:
        """Give one input to a target; keep it if it failed in a new way."""
        from tests.fuzz.targets import give

        self.counts[name]["inputs"] += 1
        signal.alarm(SECONDS)
        try:
            read = give(self.targets[name], Path(self.folder.name, name), file, data)
            self.counts[name]["read" if read else "refused"] += 1
        except Exception as error:
            signal.alarm(0)
            self.failed(name, file, data, error)
        finally:
            signal.alarm(0)
        if time.monotonic() - self.written > 0.5:
            self.write()

    def failed(self, name: str, file: str, data: bytes, error: BaseException) -> None:
        """Count a failure; the first of its place is shown and kept."""
        from tests.fuzz.targets import CORPUS

        self.counts[name]["failures"] += 1
        source = error.__cause__ or error
        frames = [
            f for f in traceback.extract_tb(source.__traceback__) if "strapdown" in f.filename
        ]
        where = "; ".join(f"{Path(f.filename).name}:{f.lineno}" for f in frames[-2:])
        key = f"{name}: {type(source).__name__} {where}"
        if key in self.known or len(self.known) >= MOST:
            return
        self.known.add(key)
        said = str(source).split("\n")[0][:200].encode("ascii", "backslashreplace").decode()
        kept = CORPUS / name / f"{hashlib.sha256(data).hexdigest()[:8]}-{file.replace('/', '+')}"
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_bytes(data)
        print(f"{key}: {said}\n  {kept}", flush=True)

    def write(self) -> None:
        """Write the counts for the parent, as libFuzzer does not return."""
        self.written = time.monotonic()
        self.counts_file.write_text(json.dumps(self.counts))

    def mutate(self, seconds: float, seed: int, most: int) -> None:
        """Give inputs of the seeded mutator, to one target after the other."""
        from tests.fuzz.mutate import mutated

        for name, seeds in self.seeds.items():
            end = time.monotonic() + seconds / len(self.seeds)
            others = [data for _, data in seeds]
            for file, data in seeds:
                self.run(name, file, data)
            number = 0
            while time.monotonic() < end and number < most:
                chance = random.Random(f"{name} {seed} {number}")
                file, data = chance.choice(seeds)
                self.run(name, file, mutated(data, chance, others))
                number += 1
        self.write()

    def lead(self, atheris: Any, seconds: float, seed: int) -> None:
        """Give inputs led by coverage; ends the process.

        The first two bytes of an input choose the target and the name of the file.
        """
        from tests.fuzz.mutate import mutated

        files = [
            (name, file)
            for name, seeds in self.seeds.items()
            for file in dict.fromkeys(file for file, _ in seeds)
        ]
        others = {name: [data for _, data in seeds] for name, seeds in self.seeds.items()}

        def chosen(data: bytes) -> tuple[str, str]:
            return files[int.from_bytes(data[:2], "big") % len(files)]

        def one(data: bytes) -> None:
            if len(data) > 2:
                self.run(*chosen(data), data[2:])

        def change(data: bytes, size: int, seed: int) -> bytes:
            if len(data) < 3 or seed % 4 == 0:
                return bytes(atheris.Mutate(data, size))
            if seed % 4 == 1:
                # Slow targets have the most branches, and would take nearly all inputs.
                data = chances.choice(firsts[chances.choice(list(firsts))])
            made = mutated(data[2:], random.Random(seed), others[chosen(data)[0]])
            return (data[:2] + made)[:size]

        firsts = {
            name: [files.index((name, file)).to_bytes(2, "big") + data for file, data in seeds]
            for name, seeds in self.seeds.items()
        }
        chances = random.Random(seed)
        with tempfile.TemporaryDirectory() as corpus:
            for name, seeds in firsts.items():
                for k, data in enumerate(seeds):
                    Path(corpus, f"{name}{k}").write_bytes(data)
            flags = [f"-max_total_time={max(1, int(seconds))}", f"-seed={seed + 1}"]
            flags += ["-max_len=65536", "-timeout=0", "-rss_limit_mb=0"]
            atheris.Setup([sys.argv[0], *flags, corpus], one, custom_mutator=change)
            self.write()
            atheris.Fuzz()


def _child(options: argparse.Namespace, names: Sequence[str]) -> None:
    warnings.simplefilter("ignore")
    atheris = importlib.import_module("atheris") if options.led else None
    _imported(atheris)
    session = Session(names, Path(options.counts))
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, size + MEMORY))
    if atheris is not None:
        session.lead(atheris, 60.0 * options.minutes, options.seed)
    session.mutate(60.0 * options.minutes, options.seed, options.inputs or sys.maxsize)


def main() -> int:
    """Run the targets, and print their counts."""
    from tests.fuzz.targets import TARGETS

    parser = argparse.ArgumentParser(prog="make fuzz", description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0, help="of all targets together")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--target", choices=TARGETS, help="this one alone")
    parser.add_argument("--inputs", type=int, default=0, help="most of a target (mutator)")
    parser.add_argument("--mutator", action="store_true", help="not atheris")
    parser.add_argument("--counts", help=argparse.SUPPRESS)
    parser.add_argument("--led", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    names = [options.target] if options.target else list(TARGETS)
    if options.counts:
        _child(options, names)
        return 0
    led = not options.mutator and importlib.util.find_spec("atheris") is not None
    if not led and not options.mutator:
        print("atheris is not installed (extra fuzz): the seeded mutator makes all inputs")
    minutes = options.minutes / 2 if led else options.minutes
    words = [*sys.argv[1:], "--minutes", str(minutes)]
    runs = [_run([*words, "--led"]), _run(words)] if led else [_run(words)]
    bad = any(code for code, _ in runs)
    total = dict.fromkeys(COUNTED, 0)
    print("".join([f"{'target':12}", *(f"{key:>10}" for key in COUNTED)]))
    for name in names:
        counts = {key: sum(of.get(name, {}).get(key, 0) for _, of in runs) for key in COUNTED}
        total = {key: total[key] + counts[key] for key in COUNTED}
        print(f"{name:12}" + "".join(f"{counts[key]:10d}" for key in COUNTED))
    print(f"{'all':12}" + "".join(f"{total[key]:10d}" for key in COUNTED))
    if led:
        print(f"of these led by coverage: {sum(of['inputs'] for of in runs[0][1].values())}")
    return int(bad or bool(total["failures"]) or not total["inputs"])


def _run(words: Sequence[str]) -> tuple[int, dict[str, dict[str, int]]]:
    """Give inputs in a process of its own; return its exit code, and the counts of each target."""
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile() as said:
        file = Path(folder, "counts.json")
        words = [sys.executable, str(Path(__file__).parent), *words, "--counts", str(file)]
        # What libFuzzer says of its progress is of use only if it ends early.
        code = subprocess.run(words, stderr=said, check=False).returncode
        if code:
            said.seek(0)
            print(said.read()[-4000:].decode(errors="replace"), file=sys.stderr)
            print(f"the process ended with {code}", file=sys.stderr)
        return code, json.loads(file.read_text()) if file.is_file() else {}


if __name__ == "__main__":
    sys.exit(main())
