"""Navigates over made-up drives as the product proposes, and counts what became of them.

    python -m tests.drives.judge 0:50 --out drives
    python -m tests.drives.judge 17 --set fault='"none"' --set late_s=0
    python -m tests.drives.judge 17 --isolate
    python -m tests.drives.judge --out drives

The last prints the table of all seeds that were judged into a folder.

`init navigate` proposes, the owner of the record answers what is asked and changes no other line,
and the run is compared with the truth. `--set` changes one part of the draw, to find a cause;
`--isolate` runs a record again without each of its difficulties in turn.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import re
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest
from tests.drives.generator import GRADES, Made, draw, make, stream
from tests.drives.motion import KINDS, ecef, to_ned

import strapdown as sd
from strapdown.cli.main import app
from strapdown.errors import StrapdownError

COMPONENTS = ("north", "east", "down", "VN", "VE", "VD", "roll", "pitch", "heading")
#: One draw a run: at one instant, whether the error is within its bound of 95 %.
COVERED = (
    "north",
    "east",
    "down",
    "horizontal",
    "vertical",
    "velocity",
    "roll",
    "pitch",
    "heading",
)
FAR = 5.0  # bounds
DIVERGED = 10.0  # times what the fixes alone give
LIMITS = {1: 3.841, 2: 5.991, 3: 7.815}  # of chi-square, 95 %
#: Difficulties of a record, each with what the draw is without it.
EASIER: dict[str, dict[str, Any]] = {
    "no fault": {"fault": "none"},
    "no outage": {"outages_s": []},
    "clocks agree": {"late_s": 0.0, "drift_ppm": 0.0, "step_s": 0.0, "velocity_late_s": 0.0},
    "no clock step": {"step_s": 0.0},
    "no delay of velocity": {"velocity_late_s": 0.0},
    "stated right": {"stated": "right", "stated_factor": 1.0},
    "white errors of fixes": {"drift_m": 1e-4, "float_share": 0.0},
    "velocities": {"velocity": "ned"},
    "no vibration": {"vibration_m_s2": 0.0, "vibration_deg_s": 0.0},
    "mounted straight": {"mount_deg": [0.0, 0.0, 0.0]},
    "means at each sample": {"sampling": "mean", "jitter_s": 0.0, "lost_share": 0.0},
    "no warming": {"warming": False},
    "sensor named": {"knows_sensor": True},
    "sensor not named": {"knows_sensor": False},
    "antenna at the unit": {"antenna_m": [0.0] * 3, "arm_measured_m": [0.0] * 3},
    "begins at rest": {"start": "rest", "rest_s": 20.0},
}


# ------------------------------------------------------------------------------ the command
def propose(made: Made) -> tuple[Path, list[str], str]:
    """Run `init navigate` and answer what it asks; return the file, the answers and its words."""
    known, given, options = made.answers, [], []
    out = made.log.parent / "navigate.toml"
    codes = {f.code for f in sd.read_imu(made.log).findings}
    if any(code.startswith("io.axes-not-stated") for code in codes):
        options += ["--axes", known["axes"]]
        given.append("axes")
    if known["sensor"]:
        options += ["--sensor", known["sensor"]]
        given.append("sensor")
    argv = ["init", "navigate", str(made.log), "--gnss", str(made.fixes), "--out", str(out)]
    text = io.StringIO()
    with contextlib.redirect_stdout(text), contextlib.redirect_stderr(text):
        app([*argv, "--force", *options], standalone_mode=False)
    said = text.getvalue()
    lines = out.read_text().splitlines()
    for row, key in re.findall(r"^\s*line\s+(\d+)\s+(\w+):", said, re.M):
        if key in known and known[key] is not None and key != "sensor":
            lines[int(row) - 1] = f"{key} = {json.dumps(known[key])}"
            given.append(key)
    for k, line in enumerate(lines):
        if line.startswith("lever_arm_m ="):  # its comment asks for it to be measured
            lines[k] = f"lever_arm_m = {known['lever_arm_m']}"
            given.append("lever_arm_m")
    out.write_text("\n".join(lines) + "\n")
    return out, given, said


# -------------------------------------------------------------------------------- the truth
def _errors(made: Made, table: Any, origin: float) -> tuple[np.ndarray, np.ndarray]:
    """True times of the rows of a trajectory, and their nine errors in m, m/s, deg."""
    t = made.time(table.index.to_numpy() + origin)
    truth = made.motion.state(t)
    lat, lon = np.radians(table["lat"].to_numpy()), np.radians(table["lon"].to_numpy())
    apart = ecef(lat, lon, table["alt"].to_numpy()) - truth["ecef"]
    ned = to_ned(np.radians(truth["lat"]), np.radians(truth["lon"]))
    place = np.einsum("nij,nj->ni", ned, apart)
    speed = table[["VN", "VE", "VD"]].to_numpy() - truth["v"]
    turned = np.column_stack([table[k].to_numpy() - truth[k] for k in ("roll", "pitch", "heading")])
    return t, np.column_stack([place, speed, (turned + 180) % 360 - 180])


def _bounds(table: Any, deviations: Any) -> np.ndarray:
    """Bounds of 95 % at the rows of a trajectory."""
    own = deviations.index.to_numpy()
    at = table.index.to_numpy()
    return 1.96 * np.column_stack(
        [np.interp(at, own, deviations[c].to_numpy()) for c in COMPONENTS]
    )


def fixes_alone(made: Made, t: np.ndarray) -> np.ndarray:
    """Size of the error of positions interpolated between the fixes as they are stamped, m.

    The root mean square of the sound fixes, and the largest error within 15 s.
    """
    arm = made.draw["antenna_m"]
    stamped = made.time(made.fix_stamps)
    apart = np.linalg.norm(made.fix_ecef - made.motion.position(stamped, arm), axis=1)
    size = float(np.sqrt(np.mean(apart[made.sound] ** 2))) if made.sound.any() else 0.0
    grid = np.arange(0.0, made.motion.duration, 0.5)
    path = np.column_stack([np.interp(grid, stamped, made.fix_ecef[:, k]) for k in range(3)])
    off = np.linalg.norm(path - made.motion.position(grid, arm), axis=1)
    worst = np.array([off[(grid > x - 15) & (grid < x + 15)].max() for x in grid])
    return size + np.interp(t, grid, worst)


def _score(made: Made, record: tuple[Any, Any], origin: float, share: float) -> dict[str, Any]:
    """Compare one solution with the truth."""
    table, deviations = record
    t, off = _errors(made, table, origin)
    bound = _bounds(table, deviations)
    alone = fixes_alone(made, t)
    distance = np.linalg.norm(off[:, :3], axis=1)
    worst = int(np.argmax(np.where(np.isfinite(distance), distance, np.inf) / alone))
    ratio = np.abs(off) / np.maximum(bound, 1e-12)
    row, column = np.unravel_index(int(np.nanargmax(ratio)), ratio.shape)
    at = int(share * (len(t) - 1))
    z = np.abs(off[at]) / (bound[at] / 1.96)
    inside = {name: bool(z[k] < 1.96) for k, name in enumerate(COMPONENTS) if name in COVERED}
    inside["horizontal"] = bool((z[:2] ** 2).sum() < LIMITS[2])
    inside["vertical"] = inside["down"]
    inside["velocity"] = bool((z[3:6] ** 2).sum() < LIMITS[3])
    share_inside = {
        name: round(float((ratio[:, k] < 1).mean()), 3) for k, name in enumerate(COMPONENTS)
    }
    return {
        "start_s": round(float(t[0]), 2),
        "end_s": round(float(t[-1]), 2),
        "rms": {n: float(np.sqrt(np.mean(off[:, k] ** 2))) for k, n in enumerate(COMPONENTS)},
        "bound_median": {n: float(np.median(bound[:, k])) for k, n in enumerate(COMPONENTS)},
        "share_inside": share_inside,
        "times_fixes": float(distance[worst] / alone[worst]),
        "times_fixes_at_s": round(float(t[worst]), 1),
        "error_there_m": float(distance[worst]),
        "fixes_there_m": float(alone[worst]),
        "times_bound": float(ratio[row, column]),
        "times_bound_of": COMPONENTS[column],
        "times_bound_at_s": round(float(t[row]), 1),
        "far": {
            name: [round(float(x.max()), 1), round(float((x > FAR).mean()), 3)]
            for name, x in zip(COMPONENTS, ratio.T, strict=True) if x.max() > FAR
        },
        "instant_s": round(float(t[at]), 1),
        "inside": inside,
    }  # fmt: skip


def judge(facts: dict[str, Any], folder: Path, smoothed: bool = True) -> dict[str, Any]:
    """Make one record, navigate over it as proposed, and compare with the truth.

    Half of the records are smoothed, too, unless `smoothed` is false.
    """
    out: dict[str, Any] = {"draw": facts, "outcome": "crashed"}
    rng = stream(facts["seed"], "judge")
    smooth, share = bool(rng.random() < 0.5) and smoothed, float(rng.random())
    made = make(facts, folder)
    out["smooth"] = smooth
    stage, began = "init", time.perf_counter()
    try:
        config, out["answers"], out["said"] = propose(made)
        out["init_s"] = round(time.perf_counter() - began, 2)
        stage, began = "navigate", time.perf_counter()
        run = sd.navigate(config, smooth=smooth)
        out["navigate_s"] = round(time.perf_counter() - began, 2)
        saved = folder / "run"
        run.save(saved, report=False)
    except StrapdownError as error:
        out["code"], out["sentence"] = error.finding.code, str(error)
        out["outcome"] = f"refused by {stage}"
        return out
    except Exception:
        out["code"] = traceback.format_exc(limit=-3)
        return out
    told = json.loads((saved / "navigation.json").read_text())["trust"]
    out["verdict"], out["against"] = told["verdict"], [x["code"] for x in told["against"]]
    out["findings"] = sorted({f.code for f in run.findings})
    table = run.trajectory
    origin = 0.0
    if made.stamps[0] > table.index[-1]:  # time counts from the first stamp
        origin = float(made.stamps[0])
    one = run.forward if smooth else run
    out["filter"] = _score(made, (one.trajectory, one.sd), origin, share)
    scores = [out["filter"]]
    if smooth:
        out["smoother"] = _score(made, (table, run.sd), origin, share)
        scores.append(out["smoother"])
    status = run.integrity.heading.table["status"]
    out["green"] = round(float((status == 0).mean()), 3)
    off = max(scores, key=lambda s: s["times_bound"])
    out["diverged"] = max(s["times_fixes"] for s in scores) > DIVERGED
    out["outside"] = off["times_bound"] > FAR
    out["outcome"] = (
        "diverged" if out["diverged"]
        else f"beyond {FAR:.0f} bounds, {out['verdict']}" if out["outside"] else "sound"
    )  # fmt: skip
    return out


# -------------------------------------------------------------------------------- the table
def interval(hits: int, of: int, level: float = 0.99) -> tuple[float, float]:
    """Return the exact binomial interval (Clopper and Pearson)."""
    low, high = binomtest(hits, of).proportion_ci(level)
    return float(low), float(high)


def _rows(name: str, choices: Iterable[str], results: list[dict[str, Any]]) -> list[str]:
    out = [
        f"\n{name:12} runs refused diverged silent>5 cautioned>5 distrusted>5 sound  diverged, 99 %"
    ]
    for choice in [*choices, "all"]:
        own = [r for r in results if choice in ("all", r["draw"][name])]
        if not own:
            continue
        ran = [r for r in own if "verdict" in r]
        far = Counter(r["verdict"] for r in ran if r["outside"] and not r["diverged"])
        lost = sum(r["diverged"] for r in ran)
        low, high = interval(lost, max(len(ran), 1))
        sound = sum(r["outcome"] == "sound" for r in own)
        out.append(
            f"{choice:12} {len(own):4} {len(own) - len(ran):7} {lost:8} {far['trusted']:8} "
            f"{far['reserve']:11} {far['distrusted']:12} {sound:5}  "
            f"{100 * low:.0f} to {100 * high:.0f} %"
        )
    return out


def report(results: list[dict[str, Any]]) -> str:
    """Return the table of all outcomes and the coverage of the bounds."""
    lines = _rows("kind", KINDS, results) + _rows("grade", GRADES, results)
    lines += _rows("receiver", ("code", "phone", "rtk"), results)
    wanted: dict[str, Callable[[dict[str, Any]], bool]] = {
        "every run": lambda r: True,
        "not diverged": lambda r: not r["diverged"],
        "sound": lambda r: r["outcome"] == "sound",
    }
    for which, test in wanted.items():
        for who in ("filter", "smoother"):
            own = [r[who]["inside"] for r in results if who in r and test(r)]
            if not own:
                continue
            lines.append(f"\ninside 95 %, {who}, {which} ({len(own)} runs, one instant each)")
            for name in COVERED:
                hits = sum(x[name] for x in own)
                low, high = interval(hits, len(own))
                mark = "" if low <= 0.95 <= high else "   not 95 %"
                lines.append(
                    f"  {name:10} {hits:4}  {100 * hits / len(own):5.1f} %  "
                    f"({100 * low:.0f} to {100 * high:.0f} %){mark}"
                )
    seconds = [r["init_s"] + r["navigate_s"] for r in results if "navigate_s" in r]
    if seconds:
        lines.append(
            f"\ninit and navigate: median {np.median(seconds):.1f} s, most {max(seconds):.1f} s"
        )
    return "\n".join(lines)


def line(r: dict[str, Any]) -> str:
    """Return one result as a line."""
    d = r["draw"]
    text = f"{d['seed']:4} {d['kind']:8} {d['grade']:10} {d['start']:6} "
    text += f"{d['receiver']:5} {d['velocity']:6} {r['outcome']}"
    if "code" in r:
        return f"{text}: {r['code']}"
    for who in ("filter", "smoother"):
        if who in r:
            s = r[who]
            text += (
                f"; {who}: {s['times_fixes']:.1f} x fixes ({s['error_there_m']:.3g} m at "
                f"{s['times_fixes_at_s']:.0f} s), {s['times_bound']:.1f} bounds "
                f"of {s['times_bound_of']} at {s['times_bound_at_s']:.0f} s"
            )
    return f"{text}; {r['verdict']}, begins {r['filter']['start_s']:.0f} s"


def isolate(facts: dict[str, Any]) -> None:
    """Run one record without each of its difficulties, and print the outcomes."""
    for name, change in {"as drawn": {}, **EASIER}.items():
        easier = facts | change
        if change and easier == facts:
            continue
        with tempfile.TemporaryDirectory() as scratch:
            print(f"{name:24}{line(judge(easier, Path(scratch), smoothed=False))}", flush=True)


def main() -> int:
    """Judge a range of seeds, print the table and write one JSON for each."""
    parser = argparse.ArgumentParser(description="Judge navigation as proposed by made-up drives.")
    parser.add_argument("seeds", nargs="?", help="A:B, or one seed, or A,B,C")
    parser.add_argument("--out", type=Path, help="folder of the JSON of each seed")
    parser.add_argument("--keep", type=Path, help="folder to keep the records in")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=JSON")
    parser.add_argument("--isolate", action="store_true", help="without each difficulty in turn")
    given = parser.parse_args()
    if given.seeds is None:
        files = sorted(given.out.glob("*.json"), key=lambda path: int(path.stem))
        print(report([json.loads(path.read_text()) for path in files]))
        return 0
    first, colon, last = given.seeds.partition(":")
    seeds = range(int(first), int(last)) if colon else [int(s) for s in first.split(",")]
    warnings.simplefilter("ignore")
    results = []
    for seed in seeds:
        facts = draw(seed)
        for change in given.set:
            key, _, value = change.partition("=")
            *way, key = key.split(".")
            table = facts
            for step in way:
                table = table[step]
            if key not in table:
                parser.error(f"{key} is not part of a draw: {', '.join(table)}")
            table[key] = json.loads(value)
        if given.isolate:
            isolate(facts)
            continue
        with tempfile.TemporaryDirectory() as scratch:
            where = given.keep / str(seed) if given.keep else Path(scratch) / str(seed)
            result = judge(facts, where)
        results.append(result)
        print(line(result), flush=True)
        if given.out:
            given.out.mkdir(parents=True, exist_ok=True)
            (given.out / f"{seed}.json").write_text(json.dumps(result, indent=1) + "\n")
    if results:
        print(report(results))
    return 0


if __name__ == "__main__":
    sys.exit(main())
