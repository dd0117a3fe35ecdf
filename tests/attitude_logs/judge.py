"""Compares attitude algorithms on made-up logs as a person would, and judges what is recommended.

    python -m tests.attitude_logs.judge 0:200 --out logs
    python -m tests.attitude_logs.judge 17 --set difficulties='["none"]' --keep records
    python -m tests.attitude_logs.judge --out logs

The last prints the table of all seeds that were judged into a folder.

The log and its truth go to `sd.compare_attitude`, with the tolerance of the draw and, of some logs,
the axes that their owner knows; with nothing else.
The judge knows the exact motion: it makes ideal samples at the recommended rate, on even stamps and
without any fault, integrates them with the recommended algorithm, and sees whether the largest
error is within the tolerance, and whether half and a quarter of the rate would do as well. Each is
tried from several first instants, because where the samples fall matters at the limit: a rate does
if all of them do, and does not if none does. Across a gap nothing can be integrated, so each
segment begins from the truth.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
import traceback
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tests.attitude_logs.generator import (
    DIFFICULTIES,
    Made,
    Motion,
    draw,
    make,
    multiply,
    sampled,
)

import strapdown as sd
from strapdown.errors import StrapdownError

Array = NDArray[np.float64]

PHASES = (0.0, 0.3, 0.7)  # of a step, the first instant of ideal samples
RATE_WRONG = 0.01  # of the rate of the log
#: Outcomes, the good ones first.
OUTCOMES = (
    "right", "refused", "sensor", "blamed, right", "too low", "too high", "blamed, wrong",
    "rate wrong", "crashed",
)  # fmt: skip


# ------------------------------------------------------------------------------- the truth
def largest(t: Array, rates: Array, motion: Motion, algorithm: str, sampling: str) -> float:
    """Largest error of an algorithm over samples, from a true start, deg."""
    q, _ = motion.state(t)
    start = motion.state(t[:1] - (t[1] - t[0]))[0][0] if sampling == "mean" else q[0]
    if sampling == "mean":  # the first row is the start of the first interval
        t = np.concatenate([t[:1] - (t[1] - t[0]), t])
        rates = np.vstack([rates[:1], rates])
        q = np.vstack([start, q])
    out = sd.attitude(t, rates, algorithm=algorithm, initial=start, sampling=sampling)
    apart = multiply(q * [1, -1, -1, -1], out[["q_w", "q_x", "q_y", "q_z"]].to_numpy())
    sine = np.linalg.norm(apart[:, 1:], axis=1)
    return float(np.degrees(2 * np.arctan2(sine, np.abs(apart[:, 0]))).max())


def segments(made: Made) -> list[tuple[float, float]]:
    """Begin and end of what lies between the gaps, s."""
    first, last = float(made.instants[0]), float(made.instants[-1])
    edges = [first, *(x for gap in made.draw["gaps_s"] for x in gap), last]
    return [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def errors(made: Made, algorithm: str, rate: float, meaning: str) -> list[float]:
    """Largest error of ideal samples at a rate from each first instant, deg."""
    step, motion, out = 1 / rate, made.motion, []
    for phase in PHASES:
        worst = 0.0
        for begin, end in segments(made):
            t = np.arange(begin + phase * step, end, step)
            if len(t) < 3:
                continue
            if meaning == "drop":
                worst = max(
                    worst, largest(t, motion.state(t)[1], motion, algorithm, "instantaneous")
                )
            else:
                means = np.diff(motion.summed(t), axis=0) / step
                worst = max(worst, largest(t[1:], means, motion, algorithm, "mean"))
        out.append(worst)
    return out


def sensed(made: Made, algorithm: str) -> float:
    """Largest error on the sensor's own samples at their true instants, all there, deg.

    With the better of the two meanings of a sample.
    """
    facts, motion = made.draw, made.motion
    t = np.arange(1, int(motion.duration * facts["rate_hz"])) / facts["rate_hz"]
    rates = sampled(facts, motion, t) + np.radians(facts["bias_deg_s"])
    worst = [0.0, 0.0]
    for begin, end in segments(made):
        own = (t >= begin) & (t <= end)
        for k, kind in enumerate(("instantaneous", "mean")):
            at = t[own] + (1 / facts["rate_hz"] if facts["sampling"] == "mean after" and k else 0)
            worst[k] = max(worst[k], largest(at, rates[own], motion, algorithm, kind))
    return min(worst)


# ------------------------------------------------------------------------------ the verdict
def judge(facts: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Make one log, compare on it, and judge the answer."""
    made = make(facts, folder)
    out: dict[str, Any] = {"draw": facts, "rows": len(made.stamps), "outcome": "crashed"}
    tolerance = facts["tolerance_deg"]
    began = time.process_time()
    try:
        said = {"axes": facts["axes"]} if facts["axes_named"] == "owner" else {}
        result = sd.compare_attitude(
            made.log, reference=made.truth, tolerance_deg=tolerance, **said
        )
    except StrapdownError as error:
        out |= {"outcome": "refused", "code": error.finding.code, "sentence": str(error)}
        return out
    except Exception:
        out["code"] = traceback.format_exc(limit=-3)
        return out
    finally:
        out["compare_s"] = round(time.process_time() - began, 2)
    answer = result.answer
    own = float(result.sweep["rate_hz"].max())
    for key in ("verdict", "algorithm", "rate_hz", "meaning", "sentence"):
        out[key] = getattr(answer, key)
    out["log_rate_hz"] = own
    out["findings"] = sorted({f.code for f in result.findings})
    if abs(own / facts["rate_hz"] - 1) > RATE_WRONG:
        out["outcome"] = "rate wrong"
        return out

    def does(rate: float) -> bool | None:
        found = errors(made, answer.algorithm or "rotvec", rate, answer.meaning or "drop")
        out.setdefault("ideal_deg", {})[f"{rate:.4g}"] = [round(e, 4) for e in found]
        inside = [e <= tolerance for e in found]
        return True if all(inside) else None if any(inside) else False

    if answer.algorithm is None and answer.verdict == "sensor":
        out["sensed_deg"] = round(sensed(made, "rotvec"), 4)
        fine = out["sensed_deg"] <= 0.9 * tolerance
        out["outcome"] = "blamed, wrong" if fine else "sensor"
        return out
    if answer.verdict == "rate" or answer.algorithm is None:
        out["outcome"] = "too high" if does(own) is True else "right"  # none would do
        return out
    if does(answer.rate_hz) is False:
        rated = "too low"
    elif does(answer.rate_hz / 2) is True and does(answer.rate_hz / 4) is True:
        rated = "too high"
    else:
        rated = "right"
    out["outcome"] = rated
    if answer.verdict == "sensor":
        # Where its samples, at their true instants and in their true axes, are within the
        # tolerance, what takes it beyond is what was written of them.
        out["sensed_deg"] = round(sensed(made, answer.algorithm), 4)
        blamed = "blamed, right" if rated == "right" else "blamed, wrong"
        out["outcome"] = blamed if out["sensed_deg"] <= 0.9 * tolerance else "sensor"
    return out


# -------------------------------------------------------------------------------- the table
def line(r: dict[str, Any]) -> str:
    """Return one result as a line."""
    d = r["draw"]
    text = f"{d['seed']:4} {' + '.join(d['difficulties']):24} {d['kind']:6} {d['sampling']:11} "
    text += f"{d['rate_hz']:5.0f} Hz {d['tolerance_deg']:g}°: {r['outcome']}"
    if "code" in r:
        return f"{text} {r['code']}"
    text += f"; {r['verdict']}: {r['algorithm']}"
    if r["rate_hz"]:
        text += f" {r['meaning']} at {r['rate_hz']:.5g} Hz"
    text += f" of {r['log_rate_hz']:.5g}"
    for rate, found in r.get("ideal_deg", {}).items():
        text += f"; {rate} Hz {min(found):.3g}° to {max(found):.3g}°"
    if "sensed_deg" in r:
        text += f"; its samples alone {r['sensed_deg']:.3g}°"
    return f"{text} ({r['compare_s']:.1f} s)"


def report(results: list[dict[str, Any]]) -> str:
    """Return the outcomes by difficulty, by motion and by what a sample is."""
    lines = []
    groups: dict[str, Any] = {
        "difficulty": (DIFFICULTIES, lambda d: d["difficulties"]),
        "motion": (sorted({r["draw"]["kind"] for r in results}), lambda d: [d["kind"]]),
        "sample": (sorted({r["draw"]["sampling"] for r in results}), lambda d: [d["sampling"]]),
    }
    for title, (choices, of) in groups.items():
        lines.append(f"\n{title:14} logs " + " ".join(f"{name:>13}" for name in OUTCOMES))
        for choice in [*choices, "all"]:
            own = [r for r in results if choice == "all" or choice in of(r["draw"])]
            if own:
                counts = [sum(r["outcome"] == name for r in own) for name in OUTCOMES]
                lines.append(f"{choice:14} {len(own):4} " + " ".join(f"{n:13}" for n in counts))
    seconds = [r["compare_s"] for r in results]
    lines += [
        f"\nprocessor time of a comparison: median {np.median(seconds):.2f} s, "
        f"most {max(seconds):.2f} s",
        "A log with two difficulties counts under both. right: the rate does, and not a quarter",
        "of it; sensor: beyond the tolerance by the sensor's own samples; blamed: said to be, and",
        "these alone are within it; and whether the rate is right all the same.",
    ]
    return "\n".join(lines)


def main() -> int:
    """Judge a range of seeds, print the table and write one JSON for each."""
    parser = argparse.ArgumentParser(description="Judge recommended rates by made-up gyro logs.")
    parser.add_argument("seeds", nargs="?", help="A:B, or one seed, or A,B,C")
    parser.add_argument("--out", type=Path, help="folder of the JSON of each seed")
    parser.add_argument("--keep", type=Path, help="folder to keep the logs in")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=JSON")
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
            if key not in facts:
                parser.error(f"{key} is not part of a draw: {', '.join(facts)}")
            facts[key] = json.loads(value)
        with tempfile.TemporaryDirectory() as scratch:
            result = judge(facts, (given.keep or Path(scratch)) / str(seed))
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
