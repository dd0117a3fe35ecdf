"""Whole commands on damaged files: ``python -m tests.fuzz.whole COUNT [SEED] [FOLDER]``.

A command is drawn, and one of the files that it reads is changed (`mutate`). It ends with a stated
exit code, within 30 s of the processor and 2 GB; its words have no traceback and no control
character; what it wrote is a whole bundle of finite numbers, or nothing where it refused. The files
of what is not so are kept in FOLDER. Each run is a fork of a process that has all imported.
"""

from __future__ import annotations

import json
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from tests.cli.test_navigate_live import recorded
from tests.faults.forked import run_here, start, warmed
from tests.fuzz.mutate import mutated
from tests.fuzz.targets import TARGETS

from strapdown.bundle import read_manifest, unsealed_changes
from strapdown.errors import printable

#: Of the processor; by the clock four times as long, as other work may go on.
SECONDS, MEMORY = 30.0, 2 << 30
#: Done; data that cannot be used; what cannot be done; a computation diverged.
CODES = (0, 3, 4, 5)
#: The words of a command, its files by their names, and those of them that are changed.
Given = tuple[list[str], dict[str, bytes], list[str]]


def on_a_log(*words: str) -> Callable[[random.Random], Given]:
    """A command on a seed of the fuzzer; half of the runs repair."""

    def given(draw: random.Random) -> Given:
        name, data = draw.choice(list(TARGETS["log"].seeds()))
        repair = ["--repair"] if words[0] != "doctor" and draw.random() < 0.5 else []
        return [*(name if w == "LOG" else w for w in words), *repair], {name: data}, [name]

    return given


def on_a_config(command: str, target: str, home: Path) -> Callable[[random.Random], Given]:
    """A command on a configuration, with the files of `home` beside it."""
    beside = {p.name: p.read_bytes() for p in home.iterdir() if p.is_file()}

    def given(draw: random.Random) -> Given:
        seeds = list(TARGETS[target].seeds()) if target else []
        name, data = draw.choice(seeds) if seeds else ("run.toml", beside["run.toml"])
        files = {**beside, name: data}
        return [command, name], files, [name] if seeds else [*files, name]

    return given


def on_a_case(home: Path) -> Callable[[random.Random], Given]:
    """The case of a simulated crash, its records beside it."""
    files = {str(p.relative_to(home)): p.read_bytes() for p in home.rglob("*") if p.is_file()}
    text = files["case.toml"].replace(b"monte_carlo_runs = 2000", b"monte_carlo_runs = 20")
    files["case.toml"] = text
    changed = [n for n in files if n.endswith((".csv", ".toml")) and "truth" not in n]

    def given(draw: random.Random) -> Given:
        return ["crash", "case.toml"], files, ["case.toml", *changed]

    return given


def commands(home: Path) -> dict[str, Callable[[random.Random], Given]]:
    """Return the commands by name, after one run of each with sound files."""
    run, crash, empty = (home / name for name in ("run", "crash", "empty"))
    empty.mkdir()
    run.mkdir()
    recorded(run)
    assert run_here(["simulate", "pole", "--out", crash]) == 0
    shutil.rmtree(crash / "inputs", ignore_errors=True)
    (crash / "manifest.json").unlink()
    return {
        "attitude": on_a_log("attitude", "LOG", "--out", "out"),
        "doctor": on_a_log("doctor", "LOG"),
        "align": on_a_log(
            "align", "LOG", *["--lat", "50", "--sensor", "adis16470", "--out", "out"]
        ),
        "convert": on_a_log("convert", "LOG", "out.csv"),
        "init": on_a_log("init", "align", "LOG", "--out", "out.toml"),
        "navigate": on_a_config("navigate", "", run),
        "simulate": on_a_config("simulate", "scenario", empty),
        "crash": on_a_case(crash),
    }


def judged(place: Path, names: set[str], status: int) -> str:
    """Return how a run ended, or raise AssertionError."""
    told = (place / "log").read_text(encoding="utf-8", errors="strict")
    assert not os.WIFSIGNALED(status), f"signal {os.WTERMSIG(status)}"
    code = os.WEXITSTATUS(status)
    assert "Traceback" not in told, told
    assert code in CODES, f"exit code {code}: {told}"
    assert printable(told, lines=True) == told, "control characters"
    new = [p for p in place.iterdir() if p.name not in names]
    assert not [p for p in new if p.name.startswith(".")], new
    if code in (3, 4):
        assert told.strip(), "no words"
        assert not new, f"refused, and wrote {new}"
    for out in new:
        if not out.is_dir():
            _of_numbers(out)
            continue
        assert unsealed_changes(out, read_manifest(out)) == []
        for file in (p for p in out.rglob("*") if "inputs" not in p.relative_to(out).parts):
            _of_numbers(file)
    return f"code {code}"


def _of_numbers(file: Path) -> None:
    """Check that a file of results has no NaN that says nothing."""
    if file.suffix == ".json":
        json.loads(file.read_text(encoding="utf-8"), parse_constant=_refused)
    # Of a stretch that nothing checked the heading has no check: its name is empty.
    elif file.suffix == ".csv" and file.name != "heading_integrity.csv":
        text = file.read_text(encoding="utf-8", errors="replace").lower()
        assert ",nan" not in text and ",inf" not in text and ",-inf" not in text, file.name


def _refused(name: str) -> float:
    raise AssertionError(f"{name} in JSON")


def _limited() -> None:
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, size + MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (int(SECONDS), int(SECONDS)))


def main() -> int:
    """Run drawn commands on changed files; print the counts, and what failed."""
    count, seed = int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0
    kept = Path(sys.argv[3]) if len(sys.argv) > 3 else None
    found: Counter[str] = Counter()
    slowest = 0.0
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        known = commands(home)
        for name, make in known.items():  # so that forks find all imported
            words, files, _ = make(random.Random(0))
            print(name, run_place(home / "warm", words, files, here=True))
        for number in range(count):
            draw = random.Random(f"{seed} {number}")
            name = draw.choice(list(known))
            words, files, changed = known[name](draw)
            files = dict(files)
            target = draw.choice(changed)
            files[target] = mutated(files[target], draw, list(files.values()))
            begin = time.monotonic()
            place = home / "place"
            try:
                ended = run_place(place, words, files)
            except (AssertionError, UnicodeDecodeError) as error:
                ended = "FAILED"
                print(f"{number} {' '.join(words)} ({target}): {str(error)[-900:]}", flush=True)
                if kept is not None:
                    shutil.copytree(place, kept / str(number), dirs_exist_ok=True)
            slowest = max(slowest, time.monotonic() - begin)
            shutil.rmtree(place, ignore_errors=True)
            found[f"{name}, {ended}"] += 1
            if number % 50 == 49:
                print(number + 1, dict(sorted(found.items())), flush=True)
    for what, number in sorted(found.items()):
        print(f"{number:6d}  {what}")
    print(f"the slowest {slowest:.1f} s")
    return int(any("FAILED" in what for what in found))


def run_place(place: Path, words: list[str], files: dict[str, bytes], *, here: bool = False) -> str:
    """Run a command in a folder of its own with files."""
    shutil.rmtree(place, ignore_errors=True)
    for name, data in files.items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_bytes(data)
    if here:
        os.chdir(place)
        return f"code {warmed(words)}"
    names = {p.name for p in place.iterdir()} | {"log"}
    child = start(place, words, wait=_limited)
    ends = time.monotonic() + 4.0 * SECONDS
    while (ended := os.waitpid(child, os.WNOHANG))[0] == 0:
        if time.monotonic() > ends:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            raise AssertionError("no end")
        time.sleep(0.005)
    return judged(place, names, ended[1])


if __name__ == "__main__":
    sys.exit(main())
