"""Trial of the status of each quantity: simulated drives with truth, sound and with faults.

    python -m benchmarks.heading_integrity [SEEDS [SCENARIO ...]]

For each scenario: seconds by status and by whether the heading was within what trusted promises;
then of all, those of the positions and velocities, whose promise is twice the bound of 99 %.
One that begins with "unseen" is what no check can find, and is not counted with the others.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np

from benchmarks import heading_fixes as fixes
from benchmarks import heading_rests as rests
from benchmarks.heading_case import LIMIT, Case, run
from strapdown.navigation.heading_integrity import STATUSES

SCENARIOS: dict[str, Callable[[int], Case]] = {
    "as stated": fixes.nominal,
    "wrong start heading": fixes.wrong_heading,
    "wrong start, no manoeuvre": fixes.no_manoeuvre,
    "outliers": fixes.outliers,
    "sensors 5 to 10 times": fixes.biased_sensor,
    "fixes 3 times noisier": fixes.noise_times_three,
    "fixes that wander": fixes.gnss_drift,
    "heading aid offset": fixes.offset_heading,
    "wrong mounting": fixes.wrong_mounting,
    **rests.SCENARIOS,
}


def main(seeds: int, names: list[str]) -> None:
    print(
        "scenario | drives | seconds | green | amber | red | good that are green | false green |"
        " wrong that the bound believes | wrong: green amber red"
    )
    total = np.zeros((len(STATUSES), 2), dtype=int)
    of_others: dict[str, np.ndarray] = {}
    for name in names or SCENARIOS:
        table, believed, drives = np.zeros_like(total), 0, set()
        failed = 0
        for seed in range(seeds):
            try:
                judged = run(SCENARIOS[name](seed))
            except Exception as error_:  # a drive that the run refuses has no status
                failed += 1
                print("  ", name, seed, type(error_).__name__, error_)
                continue
            table += counts(judged.light, judged.wrong)
            believed += int((judged.wrong & (judged.bound <= LIMIT)).sum())
            if ((judged.light == 0) & judged.wrong).any():
                drives.add(seed)
            for what, (status, wrong) in judged.others.items():
                if not name.startswith("unseen"):
                    of_others[what] = of_others.get(what, 0) + counts(status, wrong)
                if falsely := ((status == 0) & wrong).sum():
                    print(f"   {what}: {falsely} s falsely green in {name}, drive {seed}")
        if not name.startswith("unseen"):
            total += table
        row(name, seeds - failed, table, believed)
        if drives:
            print("   false green in drives", sorted(drives))
    row("all", 0, total, 0)
    for what, table in of_others.items():
        row(what, 0, table, 0)


def counts(status: np.ndarray, wrong: np.ndarray) -> np.ndarray:
    """Seconds by status and by whether they are wrong."""
    out = np.zeros((len(STATUSES), 2), dtype=int)
    np.add.at(out, (status.astype(int), wrong.astype(int)), 1)
    return out


def row(name: str, drives: int, table: np.ndarray, believed: int) -> None:
    seconds = table.sum()
    share = table.sum(axis=1) / max(seconds, 1)
    good = table[0, 0] / max(table[:, 0].sum(), 1)
    false = table[0, 1] / max(table[0].sum(), 1)
    print(
        f"{name} | {drives} | {seconds} | {share[0]:.1%} | {share[1]:.1%} | {share[2]:.1%}"
        f" | {good:.1%} | {false:.2%} | {believed / max(seconds, 1):.1%}"
        f" | within {table[:, 0].tolist()} beyond {table[:, 1].tolist()}",
        flush=True,
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20, sys.argv[2:])
