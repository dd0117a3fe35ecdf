"""The record: version 0.1 and the working tree run on this machine, and are compared.

    make record
    python tests/record [--only PATTERN] [--jobs N] [--list]

STRAPDOWN_OLD names the folder of version 0.1 (`.record/0.1`): `bin/python`, or `venv/bin/python`,
in it runs it. Where there is none it is made from the tag. STRAPDOWN_DATA names the recordings;
runs that need them are left out, and said to be, where they are absent.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from fnmatch import fnmatchcase
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(HERE))

from compare import compare, read_changes, table  # noqa: E402
from runs import RUNS  # noqa: E402

TAG = "v0.1.0"
COMMIT = "c278776f81b4dde3ec5a767f4ebd2ad7b37b0f29"
# 0.1 compiled four files of kernels with relaxed arithmetic, whose last bits depend on whether they
# were compiled or loaded from the cache. It is recorded with the same formulas compiled strictly,
# with one rounding (`fma`) where the W-D update cancels.
STRICT = HERE / "strict_kernels.patch"
WORK = ROOT / ".record"
# Of the longest run, several times over, on a machine that is busy and compiles first.
LONGEST_RUN_S = 3600


def git(*words):
    return subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, check=False)


def python_of(folder):
    for path in (folder / "bin/python", folder / "venv/bin/python"):
        if path.is_file():
            return path
    return None


def build_old(folder):
    """Make the environment of version 0.1: its wheel, with the library versions of this tree.

    The tag, or the commit behind it, is checked out and patched (see `STRICT`).
    """
    if folder.exists() and any(folder.iterdir()):
        sys.exit(
            f"{folder} has no Python of version 0.1 and is not empty; let STRAPDOWN_OLD name an "
            "environment with strapdown 0.1.0, or an empty folder, where it is then made"
        )
    tag = git("rev-parse", "-q", "--verify", f"{TAG}^{{commit}}")
    archive = git("archive", "--format=tar", COMMIT if tag.returncode else TAG)
    if archive.returncode:
        sys.exit(f"git has neither {TAG} nor {COMMIT}: fetch the tags (git fetch --tags)")
    print(f"making version 0.1 in {folder}", flush=True)
    source, venv = folder / "src", folder / "venv"
    source.mkdir(parents=True)
    try:
        subprocess.run(["tar", "-x", "-C", source], input=archive.stdout, check=True)
        subprocess.run(["patch", "-p1", "-i", STRICT], cwd=source, check=True)
        subprocess.run([sys.executable, "-m", "venv", venv], check=True)
        pip = [venv / "bin/python", "-m", "pip", "--disable-pip-version-check", "-q"]
        subprocess.run([*pip, "wheel", "--no-deps", "-w", folder / "dist", source], check=True)
        wheel = next((folder / "dist").glob("strapdown-*.whl"))
        subprocess.run([*pip, "install", "-c", ROOT / "constraints.txt", wheel], check=True)
    except BaseException:
        shutil.rmtree(folder)
        raise


def environment(side):
    """What a side runs in; the old one must not see the working tree."""
    kept = dict(os.environ)
    if side == "old":
        kept.pop("PYTHONPATH", None)
    return kept


def about(python, adapter, side):
    done = subprocess.run(
        [python, HERE / "recorder.py", adapter, "--about"],
        capture_output=True,
        text=True,
        env=environment(side),
        cwd=HERE,
        check=False,
    )
    if done.returncode:
        sys.exit(f"{python} cannot run strapdown:\n{done.stderr[-2000:]}")
    return json.loads(done.stdout)


def digest_of(files):
    digest = hashlib.sha256()
    for file in files:
        digest.update(f"{file.name}\0{file.stat().st_size}\0".encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


def keys_of_old(libraries, data, runs):
    """What each old result follows from: its run, adapter, recorder, commit, machine, data."""
    parts = [HERE / name for name in ("adapter_0_1.py", "recorder.py", STRICT.name)]
    recordings = sorted(p for p in data.rglob("*") if p.is_file()) if data.is_dir() else []
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.is_file() else []
    processor = next((line for line in lines if line.startswith("model name")), "")
    said = json.dumps([COMMIT, libraries, digest_of(parts), digest_of(recordings), processor])
    return {name: hashlib.sha256(f"{said}{RUNS[name]!r}".encode()).hexdigest() for name in runs}


def is_kept(folder, run, key):
    file = folder / f"{run}.key"
    return file.is_file() and file.read_text() == key


def forget(folder, run):
    for suffix in ("npz", "json", "key"):
        (folder / f"{run}.{suffix}").unlink(missing_ok=True)


def record(side, python, adapter, runs, out, data, jobs, keys=None):
    """Record runs, each in a process of its own; returns those that did not end.

    A run that ended keeps its key at once, so that an interrupted record goes on where it was.
    """
    out.mkdir(parents=True, exist_ok=True)

    def one(name):
        begin = time.monotonic()
        try:
            done = subprocess.run(
                [python, HERE / "recorder.py", adapter, name, out, data],
                capture_output=True,
                text=True,
                env=environment(side),
                cwd=HERE,
                timeout=LONGEST_RUN_S,
                check=False,
            )
            code, said = done.returncode, done.stderr.strip()
        except subprocess.TimeoutExpired:
            code, said = 1, f"not ended after {LONGEST_RUN_S} s"
        took = time.monotonic() - begin
        print(f"{side} {name}: {'recorded' if code == 0 else 'FAILED'}, {took:.0f} s", flush=True)
        if said:
            print("  " + said.replace("\n", "\n  "), flush=True)
        if keys and not code:
            (out / f"{name}.key").write_text(keys[name])
        return name if code else None

    with ThreadPoolExecutor(jobs) as pool:
        return [name for name in pool.map(one, runs) if name]


def main():
    parser = argparse.ArgumentParser(prog="python tests/record", description=__doc__)
    parser.add_argument("--only", default="*", help="runs whose names match (fnmatch)")
    parser.add_argument("--jobs", type=int, default=2, help="runs at a time (2)")
    parser.add_argument("--list", action="store_true", help="print the runs")
    words = parser.parse_args()
    data = Path(os.environ.get("STRAPDOWN_DATA", ROOT / "../shared/data")).resolve()
    chosen = [name for name in RUNS if fnmatchcase(name, words.only)]
    if words.list:
        print("\n".join(chosen))
        return
    runs = [n for n in chosen if all((data / r).exists() for r in RUNS[n].recordings)]
    absent = [name for name in chosen if name not in runs]
    old_folder = Path(os.environ.get("STRAPDOWN_OLD", WORK / "0.1")).resolve()
    if python_of(old_folder) is None:
        build_old(old_folder)
    old_python = python_of(old_folder)
    old = about(old_python, "adapter_0_1", "old")
    new = about(sys.executable, "adapter", "new")
    if old["version"] != "0.1.0" or Path(old["file"]).is_relative_to(ROOT / "src"):
        sys.exit(f"{old_python} runs {old['version']} of {old['file']}, and not version 0.1")
    if not Path(new["file"]).is_relative_to(ROOT / "src"):
        sys.exit(f"{sys.executable} runs {new['file']}, and not {ROOT / 'src'}")
    apart = {
        name: (old["libraries"][name], new["libraries"][name])
        for name in old["libraries"]
        if old["libraries"][name] != new["libraries"][name]
    }
    if apart:
        print(f"libraries differ, so that last bits may: {apart}")
    old_out, new_out = WORK / "results/old", WORK / "results/new"
    keys = keys_of_old(old["libraries"], data, runs)
    due = [name for name in runs if not is_kept(old_out, name, keys[name])]
    for name in runs:
        forget(new_out, name)
    for name in due:
        forget(old_out, name)
    begin = time.monotonic()
    broken = record("old", old_python, "adapter_0_1", due, old_out, data, words.jobs, keys)
    middle = time.monotonic()
    broken += record("new", sys.executable, "adapter", runs, new_out, data, words.jobs)
    end = time.monotonic()
    outcome = compare(
        old_out,
        new_out,
        runs,
        read_changes(HERE / "changes.toml"),
        (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"),
        partly=len(runs) < len(RUNS),
    )
    if outcome.unlisted:
        print("\n" + table(outcome.unlisted))
    for fault in outcome.faults:
        print(fault)
    if absent:
        print(f"left out, for want of recordings in {data}: {', '.join(absent)}")
    print(
        f"old: {len(due)} runs in {middle - begin:.0f} s, {len(runs) - len(due)} kept; "
        f"new: {len(runs)} in {end - middle:.0f} s; {outcome.listed} listed differences, "
        f"{outcome.added} quantities that only the new one has"
    )
    print(f"{len(outcome.passed)} passed, {len(outcome.failed)} failed")
    sys.exit(0 if outcome.good and not broken else 1)


if __name__ == "__main__":
    main()
