"""Whole commands as a user meets them: processor time and memory of child processes."""

from __future__ import annotations

import json
import statistics
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.filters import Drive, drive
from benchmarks.measure import LIBRARIES, Row, Usage, command, libraries, new_home, strapdown

ROUNDS = 4
#: Runs the command line with a stage's processor time in place of its duration, and writes the
#: modules that were imported at the end.
OBSERVED = """
import atexit, json, sys, time
time.perf_counter = time.process_time
atexit.register(lambda: json.dump(list(sys.modules), open(sys.argv[-1] + ".modules", "w")))
from strapdown.cli.main import run
run()
"""
#: Imports them, with the collector of garbage as in a command; not a package of which the command
#: loaded a module alone (`strapdown.dsp.chi_square.special`).
IMPORTS = """
import atexit, gc, importlib, json, sys
gc.set_threshold(200_000)
atexit.register(gc.freeze)
names = json.load(open(sys.argv[1]))
packages = {"", *names}
for name in names:
    if name.rpartition(".")[0] in packages:
        try:
            importlib.import_module(name)
        except ImportError:
            pass
"""
REPORT = ("writing the tables", "drawing the figures", "writing the page", "sealing")
FILTER, CHECK = "navigation", "judging the heading"
#: Limit of memory, MiB.
MOST_MEMORY = 400.0
#: Least rows of a text table, and those that cause all imports.
ROWS, SMALL = 1_000_000, 300


def write_log(made: Drive, folder: Path) -> None:
    """Write the log and the fixes of a drive, and what `init` proposes for them."""
    from strapdown.formats.writers import WRITERS

    folder.mkdir()
    WRITERS["csv"].write(folder / "imu.csv", {"imu": made.imu})
    fixes = pd.DataFrame(made.fix, columns=["lat_deg", "lon_deg", "alt_m"])
    fixes.insert(0, "time_s", made.fix_time)
    fixes[["sd_n_m", "sd_e_m", "sd_d_m"]] = 1.0
    fixes.to_csv(folder / "fixes.csv", index=False)
    strapdown("init", "navigate", "imu.csv", "fixes.csv", "--out", "run.toml", folder=folder)


def observed(folder: Path, *words: str, **options: Any) -> tuple[Usage, dict[str, float]]:
    """Run a command whose result is the folder `out`; return its usage, and that of its stages."""
    words = (*words, "--force", "-q", "--out", "out")
    used = command([sys.executable, "-c", OBSERVED, *words], folder=folder, **options)
    return used, json.loads((folder / "out" / "timing.json").read_text())["seconds"]


def seconds(uses: list[Usage]) -> tuple[float, ...]:
    return tuple(one.seconds for one in uses)


def start_up() -> Iterator[Row]:
    jobs = (
        ("`import strapdown`", ["-c", "import strapdown"], 0.15),
        ("`strapdown --help`", ["-m", "strapdown", "--help"], 0.6),
        ("`strapdown attitude --help`", ["-m", "strapdown", "attitude", "--help"], 0.7),
    )
    for what, words, goal in jobs:
        ours, theirs = [], []
        for number in range(ROUNDS + 1):
            both = command([sys.executable, *words]), libraries()
            if number:
                ours.append(both[0])
                theirs.append(both[1])
        yield Row(what, seconds(ours), LIBRARIES, seconds(theirs), "s", goal)


def short_runs() -> Iterator[Row]:
    """`navigate` over 120 s as `init` proposes it, and other short commands: first and again."""
    with tempfile.TemporaryDirectory(prefix="strapdown-") as name:
        folder = Path(name) / "drive"
        made = drive(1, 120.0)
        write_log(made, folder)
        lines = (folder / "imu.csv").read_text().splitlines(keepends=True)
        (folder / "minute.csv").write_text("".join(lines[:6003]))
        strapdown("simulate", "pole", "--units", "IMU1", "--out", "pole", folder=folder)
        jobs = {
            "navigate": ("run.toml",),
            "attitude": ("minute.csv",),
            "doctor": ("imu.csv", "fixes.csv"),
            "crash": ("pole/case.toml", "--no-report"),
        }
        uses: dict[str, list[Usage]] = {}
        report = []
        for number in range(ROUNDS + 1):
            new = {}
            for verb, arguments in jobs.items():
                first = new_home(Path(name))
                new[f"{verb}, first"], _ = observed(folder, verb, *arguments, environment=first)
                new[verb], stages = observed(folder, verb, *arguments)
                if verb == "navigate":
                    spent = sum(stages[stage] for stage in REPORT)
                names = str(folder / "out.modules")
                new[f"{verb}, imports"] = command([sys.executable, "-c", IMPORTS, names])
            new["libraries"] = libraries()
            if number:
                report.append(spent)
                for key, used in new.items():
                    uses.setdefault(key, []).append(used)
    theirs = seconds(uses["libraries"])
    for verb, what, goal, limit in (
        ("navigate", "navigate, 120 s at 100 Hz with fixes", 4.0, 5.3),
        ("attitude", "attitude, 60 s at 100 Hz", 2.5, 3.2),
        ("doctor", "doctor, 120 s at 100 Hz with fixes", 2.5, 3.2),
        ("crash", "crash of one recorder, no page", 2.5, 3.5),
    ):
        first, again = seconds(uses[f"{verb}, first"]), seconds(uses[verb])
        yield Row(f"{what}, first run", first, LIBRARIES, theirs, "s", goal, limit)
        yield Row(f"{what}, run again", again, LIBRARIES, theirs, "s", goal, limit)
        imports = seconds(uses[f"{verb}, imports"])
        yield Row(f"{verb}, its imports", imports, "the whole run", again, "s", 0.5, 0.65)
    what = "navigate, tables, report and seal"
    yield Row(what, tuple(report), "the whole run", seconds(uses["navigate"]), "s", 0.15, 0.18)


def long_runs() -> Iterator[Row]:
    """Memory of one, two and four hours, and the time of the heading check."""
    checks, filters, peaks = {}, {}, {}
    for hours, smooth in ((1, (False, True)), (2, (False,)), (4, (False, True))):
        with tempfile.TemporaryDirectory(prefix="strapdown-") as name:
            folder = Path(name) / "drive"
            write_log(drive(1, 3600.0 * hours), folder)
            for smoothed in smooth:
                words = ("--smooth",) if smoothed else ()
                used, stages = observed(folder, "navigate", "run.toml", *words)
                if not smoothed:
                    checks[hours], filters[hours] = stages[CHECK], stages[FILTER]
                if hours == 2:
                    continue
                what = f"navigate, {hours} h at 100 Hz{', smoothed' * smoothed}: peak memory"
                yield Row(what, (used.peak,), "the aim", (MOST_MEMORY,), "MiB", 1.0)
                peaks[hours, smoothed] = used.peak
    for smoothed in (False, True):
        what = f"navigate, 4 h at 100 Hz{', smoothed' * smoothed}: peak memory"
        ours, theirs = ((peaks[hours, smoothed],) for hours in (4, 1))
        yield Row(what, ours, "of 1 h", theirs, "MiB", FLAT)
    for hours, check in checks.items():
        what = f"heading check over {hours} h"
        yield Row(what, (check,), "the filter alone", (filters[hours],), "s", 0.2, 1.0)
    grown = (checks[1] * 4.0,)
    yield Row("heading check over 4 h", (checks[4],), "4 times that of 1 h", grown, "s", 1.1)


#: Four hours of a log over one: what is kept of each step is on the disk.
FLAT = 1.3


def text_table() -> Iterator[Row]:
    """A text table of 10⁶ rows and 7 columns, after the imports, which some rows have caused.

    pandas rounds numbers nearly; ours are the nearest doubles.
    """
    jobs = {
        "pandas": ("import pandas", "pandas.read_csv"),
        "columns": ("import pandas; from strapdown.formats import read_raw", "read_raw"),
        "imu": ("import pandas; from strapdown import read_imu", "read_imu"),
    }
    spent: dict[str, list[float]] = {name: [] for name in jobs}
    peak: dict[str, list[float]] = {name: [] for name in jobs}
    with tempfile.TemporaryDirectory(prefix="strapdown-") as folder:
        path, small, told = (Path(folder) / name for name in ("log.csv", "small.csv", "told"))
        write_table(path, ROWS)
        write_table(small, SMALL)
        for _ in range(3):
            for name, (imports, call) in jobs.items():
                code = (
                    f"import sys, time; {imports}; read = {call}; read(sys.argv[2]); "
                    "start = time.process_time(); table = read(sys.argv[1]); "
                    "open(sys.argv[3], 'w').write(str(time.process_time() - start))"
                )
                used = command([sys.executable, "-c", code, str(path), str(small), str(told)])
                spent[name].append(float(told.read_text()))
                peak[name].append(used.peak)
    for name, what, goal, limit in (
        ("columns", "columns of a CSV, 10⁶ × 7", 2.0, 2.0),
        ("imu", "read_imu of it, with inference and checks", 2.5, 3.3),
    ):
        sides = (tuple(side[key]) for side in (spent, peak) for key in (name, "pandas"))
        ours, theirs, most, least = sides
        yield Row(what, ours, "pandas.read_csv", theirs, "s", goal, limit)
        yield Row(f"{what}: peak memory", most, "pandas.read_csv", least, "MiB", 1.5)


def write_table(path: Path, rows: int) -> None:
    rng = np.random.default_rng(20)
    time = np.arange(rows) * 0.01
    turning = 0.3 * np.sin(time[:, None] * [0.5, 0.7, 0.3]) + rng.normal(0.0, 0.01, (rows, 3))
    force = rng.normal(0.0, 0.05, (rows, 3)) - [0.0, 0.0, 9.80665]
    names = ["time_s", *(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]
    table = pd.DataFrame(np.column_stack([time, turning, force]), columns=names)
    table.to_csv(path, index=False, float_format="%.9f")


def hour_drive() -> Iterator[Row]:
    """The drive of 57 min at 200 Hz: the command and its filter, beside the C filter on 30 min."""
    import time

    from benchmarks import kfgins
    from benchmarks.filters import filter_in_c
    from benchmarks.measure import NO_COMPILER

    what, against = "57 min at 200 Hz, 21 states", "the C filter over 30 min at 100 Hz"
    lacking = kfgins.missing()
    beside = None if lacking else filter_in_c(drive(1))
    if lacking or beside is None:
        yield Row(what, against=against, missing=lacking or NO_COMPILER)
        return
    in_c, _ = beside
    whole, alone, theirs = [], [], []
    with tempfile.TemporaryDirectory(prefix="strapdown-") as name:
        folder = Path(name)
        kfgins.generate(folder)
        (folder / "run.toml").write_text(kfgins.written(folder, "GNSS-RTK-sim.txt"))
        for number in range(4):
            used, stages = observed(folder, "navigate", "run.toml")
            turns = []
            for _ in range(9):
                start = time.process_time()
                in_c()
                turns.append(time.process_time() - start)
            if number:
                whole.append(used.seconds)
                alone.append(stages[FILTER])
                theirs.append(statistics.median(turns))
    for of_what, ours, goal, limit in (
        (f"{what}, the command, from text to report", whole, 120.0, 180.0),
        (f"{what}, the filter alone", alone, 18.0, 36.0),
    ):
        yield Row(of_what, tuple(ours), against, tuple(theirs), "s", goal, limit)
    yield Row(what, against="KF-GINS", missing="KF-GINS is not installed")
