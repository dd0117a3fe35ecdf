"""Reads made-up logs as the product proposes, and counts what is right, asked, left out and wrong.

    python -m tests.strangers.judge --seeds 0:100

A log is read once. If it is refused with options that would answer, it is read once more with
exactly these. Confident numbers that differ from the truth are wrong, whatever the log.
"""

from __future__ import annotations

import argparse
import itertools
import shlex
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from tests.strangers.generator import Made, Truth, make

import strapdown as sd
from strapdown.errors import Finding, StrapdownError

RELATIVE = 3e-3  # of the value: nominal and exact scales of counts differ by less
#: Words of a warning's code that name a doubt about unit, sign, order or time.
DOUBTS = ("unit", "sign", "order", "axes", "gravity", "scale", "time", "clock", "stamp", "gyro",
          "accel", "force", "contradict", "linear", "interval", "rate", "absurd")  # fmt: skip
FACTORS = {
    "of deg/s taken as rad/s": 180 / np.pi,
    "of rad/s taken as deg/s": np.pi / 180,
    "of 1000": 1000.0,
    "of 1/1000": 1e-3,
    "of g taken as m/s2": 1 / 9.80665,
    "of m/s2 taken as g": 9.80665,
    "of 60": 60.0,
    "of 1/60": 1 / 60,
    "of 2": 2.0,
    "of 4": 4.0,
    "of 8": 8.0,
    "of 1/2": 0.5,
    "of 1/4": 0.25,
    "of 1/8": 0.125,
    "of 10": 10.0,
    "of 1/10": 0.1,
}
TURNS = [
    (np.array(p), np.array(s))
    for p in itertools.permutations(range(3))
    for s in itertools.product((1, -1), repeat=3)
]


@dataclass
class Verdict:
    """What became of one log."""

    seed: int
    made: Made
    outcome: str  # right, right after one refusal, abstained, warned, wrong, crashed
    faults: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    asked: str = ""


def arguments(flags: str) -> dict[str, Any]:
    """Translate options of the command line into arguments of `read_imu`."""
    out: dict[str, Any] = {}
    words = shlex.split(flags)
    units: dict[str, str] = {}
    columns: dict[str, str] = {}
    i = 0
    while i < len(words):
        option, _, value = words[i].partition("=")
        if option == "--repair":
            out["repair"] = True
            i += 1
            continue
        if not value or option not in _OPTIONS:
            i += 1
            value = words[i]
            option = words[i - 1]
        i += 1
        if option in ("--gyro-unit", "--accel-unit", "--time-unit"):
            units[option[2:-5]] = value
        elif option == "--columns":
            for pair in value.split(","):
                quantity, _, name = pair.partition("=")
                columns[quantity] = name
        elif option == "--rate":
            out["rate_hz"] = float(value)
        elif option in ("--axes", "--sampling"):
            out[option[2:]] = value
        else:
            raise ValueError(f"unknown option {option}")
    if units:
        out["units"] = units
    if columns:
        out["columns"] = columns
    return out


_OPTIONS = (
    "--gyro-unit",
    "--accel-unit",
    "--time-unit",
    "--columns",
    "--rate",
    "--axes",
    "--sampling",
)


def _mentions(finding: Finding, words: tuple[str, ...]) -> bool:
    text = f"{finding.code} {finding.quantity} {dict(finding.data)!r}".lower()
    return any(w.lower() in text for w in words if w)


def _near(a: np.ndarray, b: np.ndarray, quantum: float) -> np.ndarray:
    """Rows of a that agree with rows of b; rows without a number in either agree."""
    with np.errstate(invalid="ignore"):
        bad = np.abs(a - b) > quantum + 1e-9 + RELATIVE * np.abs(b)
    return ~bad.any(axis=-1)


def _match(read: np.ndarray, true: np.ndarray, quantum: float) -> np.ndarray:
    """For each row read, in order, the row of the truth with these numbers, or -1."""
    out = np.full(len(read), -1)
    at = 0
    if len(read) == len(true):
        same = _near(read, true, quantum)
        if same.mean() > 0.9:
            return np.where(same, np.arange(len(read)), -1)
    there = np.isfinite(true).all(axis=1)
    for i, row in enumerate(read):
        whole = np.isfinite(row).all()
        for window in (slice(at, at + 4), slice(at, at + 400)):
            # A row that was left out agrees with none.
            alike = _near(row[None], true[window], quantum) & (there[window] | ~whole)
            hits = np.flatnonzero(alike)
            if len(hits):
                at = window.start + int(hits[0]) + 1
                out[i] = at - 1
                break
    return out


def _describe(read: np.ndarray, true: np.ndarray) -> str:
    """In which unit, order or sign rows read differ from the rows of the truth beside them."""
    fine = np.isfinite(read).all(axis=1) & np.isfinite(true).all(axis=1)
    read, true = read[fine], true[fine]
    if len(read) < 5:
        return "no numbers"
    size = np.sqrt((true**2).sum())
    best, what = 0.2, ""
    for (p, s), (name, k) in itertools.product(TURNS, [("", 1.0), *FACTORS.items()]):
        off = np.sqrt((((true[:, p] * s * k) - read) ** 2).sum()) / (size * k)
        if off < best:
            best = off
            order = "".join(("-" if s[j] < 0 else "") + "xyz"[p[j]] for j in range(3))
            what = " ".join(
                x
                for x in (
                    f"factor {name}" if name else "",
                    f"axes {order}" if order != "xyz" else "",
                )
                if x
            )
    if what:
        return what
    k = float((read * true).sum() / max((true * true).sum(), 1e-12))
    off = np.sqrt(((true * k - read) ** 2).sum()) / (size * abs(k) + 1e-12)
    if off < 0.1:
        return f"factor {k:.4g}"
    first, wanted = np.round(read[0], 4).tolist(), np.round(true[0], 4).tolist()
    return f"other numbers (first {first}, true {wanted})"


def _beside(t: np.ndarray, n: int, truth_t: np.ndarray) -> np.ndarray:
    """Rows of the truth beside the rows read, by their share of the record."""
    if n == len(truth_t):
        return np.arange(n)
    share = (t - t[0]) / max(t[-1] - t[0], 1e-12)
    return np.clip(np.searchsorted(truth_t / truth_t[-1], share), 0, len(truth_t) - 1)


def _at(t: np.ndarray, own: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.column_stack([np.interp(t, own, values[:, k]) for k in range(values.shape[1])])


def _loose(
    read: np.ndarray, t: np.ndarray, own: np.ndarray, values: np.ndarray, step: float
) -> bool:
    """Interpolated rows agree, within the noise and the change between samples."""
    inside = (t >= own[0]) & (t <= own[-1]) & np.isfinite(read).all(axis=1)
    if inside.sum() < 0.5 * len(t):
        return False
    true = _at(t[inside], own, values)
    later = [_at(t[inside] + s, own, values) for s in (-step, step)]
    change = max(float(np.abs(x - true).mean()) for x in later)
    off = float(np.abs(read[inside] - true).mean())
    return off < 1.5 * change + 1e-2 * float(np.abs(true).mean()) + 1e-3


def compare(imu: Any, truth: Truth) -> tuple[list[tuple[str, str]], bool]:
    """Faults of a reading as (what, text), and whether the accelerometer was left out."""
    faults: list[tuple[str, str]] = []
    t = np.asarray(imu.index, float)
    t = t - t[0]
    gyro = imu[["gyro_x", "gyro_y", "gyro_z"]].to_numpy(float)
    accel = None
    if "accel_x" in imu.columns:
        accel = imu[["accel_x", "accel_y", "accel_z"]].to_numpy(float)
        if not np.isfinite(accel).any():
            accel = None
    left_out = accel is None and truth.accel is not None
    true_gyro, true_accel = truth.gyro, truth.accel
    clocks = [truth.t, *truth.clocks]

    # A log that states its axes, or a format that has some, may be turned to them.
    codes = [f.code for f in imu.findings]
    turned = "io.axes-not-stated" not in codes and truth.to_frd is not None
    candidates = [np.eye(3)] + ([truth.to_frd] if turned else [])
    for turn in candidates:
        faults = []
        g = true_gyro @ turn.T
        a = None if true_accel is None else true_accel @ turn.T
        if truth.own_rates:
            step = truth.time_tolerance / 3
            if not _loose(gyro, t, truth.t, g, step):
                rows = _beside(t, len(gyro), truth.t)
                faults.append(("gyro", _describe(gyro, g[rows])))
            own = truth.accel_t
            both = accel is not None and a is not None and own is not None
            if both and not _loose(accel, t, own - truth.t[0], a, step):
                rows = _beside(t, len(accel), truth.accel_t)
                faults.append(("accel", _describe(accel, a[rows])))
            span = t[-1] / truth.t[-1] if truth.t[-1] else 1.0
            if abs(span - 1) > 0.02 + 3 * truth.time_tolerance / truth.t[-1]:
                faults.append(("time", f"span {t[-1]:.4g} s instead of {truth.t[-1]:.4g} s"))
            if len(t) < 0.45 * len(truth.t):
                faults.append(("rows", f"{len(t)} rows of {len(truth.t)}"))
        else:
            hit = _match(gyro, g, truth.gyro_quantum)
            good = hit >= 0
            if good.mean() < 0.9:
                faults.append(("gyro", _describe(gyro, g[_beside(t, len(gyro), truth.t)])))
                rows = _beside(t, len(gyro), truth.t)
                use = np.ones(len(t), bool)
            else:
                rows, use = hit[good], good
                known = np.isfinite(gyro[~good]).all(axis=1) if (~good).any() else np.zeros(0, bool)
                holes = int((~np.isfinite(g)).any(axis=1).sum())
                if known.sum() > holes:
                    which = np.flatnonzero(~good)
                    faults.append(
                        (
                            "gyro",
                            f"{int(known.sum())} rows are not of the log, "
                            f"first row {which[0]} of {len(t)}",
                        )
                    )
                lost = len(truth.t) - len(set(rows.tolist()))
                if lost - holes > 0.02 * len(truth.t) + 2:
                    faults.append(("rows", f"{lost} rows of {len(truth.t)} lost"))
            if accel is not None and a is not None:
                same = _near(accel[use], a[rows], truth.accel_quantum)
                if same.mean() < 0.9:
                    faults.append(("accel", _describe(accel[use], a[rows])))
                elif (~same).sum() > 0:
                    faults.append(("accel", f"{int((~same).sum())} rows differ"))
            offs = []
            for own in clocks:
                off = np.abs((t[use] - t[use][0]) - (own[rows] - own[rows[0]]))
                offs.append(float(np.quantile(off, 0.98)))
            if min(offs) > truth.time_tolerance + 1e-6 + 2e-4 * truth.t[-1] * (
                truth.time_tolerance > 0.003
            ):
                scale = t[use][-1] / max(truth.t[rows[-1]] - truth.t[rows[0]], 1e-9)
                faults.append(
                    (
                        "time",
                        f"stamps differ by {min(offs):.4g} s; "
                        f"span {scale:.6g} of the true one, {truth.t[-1]:.4g} s",
                    )
                )
        if accel is not None and a is None:
            faults.append(("accel", "a specific force from a file without one"))
        if not faults:
            break
    return faults, left_out


def judge(seed: int, folder: Path) -> Verdict:
    """Make, read, compare."""
    made = make(seed, folder)
    asked, refused = "", False
    given: dict[str, Any] = {}
    while True:
        try:
            imu = sd.read_imu(made.path, **given)
            break
        except StrapdownError as error:
            what = [error.finding.code]
            parts = error.finding.data.get("questions") or ()
            what += [f"{q.code}({q.quantity})" for q in parts]
            flags = error.finding.data.get("flags")
            if not refused and flags:
                refused, asked = True, str(flags)
                if "--rate HZ" in asked:  # what no file states has no answer here
                    return Verdict(seed, made, "abstained", [], what, asked)
                try:
                    given = arguments(asked)
                except (ValueError, IndexError) as fault:
                    return Verdict(
                        seed, made, "wrong", [f"options not understood: {asked} ({fault})"], what
                    )
                continue
            return Verdict(seed, made, "abstained", [], what, asked)
        except Exception as error:
            where = traceback.extract_tb(error.__traceback__)[-1]
            said = f"{type(error).__name__}: {error} ({Path(where.filename).name}:{where.lineno})"
            return Verdict(seed, made, "crashed", [said], [], asked)
    truth = made.truth
    said = [f"{f.severity[0]}:{f.code}" for f in imu.findings]
    faults, left_out = compare(imu, truth)
    if left_out:
        names = ("accel", *truth.accel_names)
        if any(_mentions(f, names) for f in imu.findings):
            if not faults:
                return Verdict(seed, made, "right" if truth.accel_optional else "abstained",
                               ["accelerometer left out"], said, asked)  # fmt: skip
        else:
            faults.append(("accel", "left out without a word"))
    if not faults:
        return Verdict(
            seed, made, "right after one refusal" if refused else "right", [], said, asked
        )
    text = [f"{a}: {b}" for a, b in faults]
    doubts = [
        f for f in imu.findings if f.severity == "warning" and any(w in f.code for w in DOUBTS)
    ]
    named = all(
        any(f.quantity is None or what in str(f.quantity) or what in f.code for f in doubts)
        for what, _ in faults
    )
    return Verdict(seed, made, "warned" if named and doubts else "wrong", text, said, asked)


OUTCOMES = ("right", "right after one refusal", "abstained", "warned", "wrong", "crashed")


def main() -> int:
    """Judge a range of seeds and print the counts."""
    parser = argparse.ArgumentParser(description="Judge the readers by logs that nobody has seen.")
    parser.add_argument("--seeds", default="0:100", help="A:B, or one seed")
    parser.add_argument("--folder", type=Path, help="keep the logs here")
    parser.add_argument("--all", action="store_true", help="list what is not wrong as well")
    given = parser.parse_args()
    first, _, last = given.seeds.partition(":")
    seeds = range(int(first), int(last) if last else int(first) + 1)
    warnings.simplefilter("ignore")
    verdicts = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.folder or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        for seed in seeds:
            one = judge(seed, folder)
            verdicts.append(one)
            if given.folder is None:
                one.made.path.unlink()
            if given.all or one.outcome in ("wrong", "crashed", "warned"):
                show(one)
    counts = Counter(v.outcome for v in verdicts)
    print(f"\n{len(verdicts)} logs: " + ", ".join(f"{counts[k]} {k}" for k in OUTCOMES))
    known = [v for v in verdicts if v.made.decidable]
    counts = Counter(v.outcome for v in known)
    print(f"{len(known)} decidable: " + ", ".join(f"{counts[k]} {k}" for k in OUTCOMES))
    after = sum(v.outcome == "wrong" and v.asked != "" for v in verdicts)
    print(f"wrong after an answer as inferred: {after}")
    return 1 if any(v.outcome in ("wrong", "crashed") for v in verdicts) else 0


def show(v: Verdict) -> None:
    """Print one verdict."""
    known = "decidable" if v.made.decidable else "undecidable"
    print(f"{v.seed} {v.outcome.upper()} ({v.made.path.name}; {v.made.kind}; {known})")
    for fault in v.faults:
        print(f"    {fault}")
    if v.asked:
        print(f"    answered: {v.asked}")
    if v.said:
        print(f"    said: {' '.join(v.said)}")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
