"""Operating curve of the comparison of two points: share reported against the size of an error.

`python -m tests.unit.crash.test_operating_curve 6` prints the table of the manual, of so many
draws of each kind.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest
from tests.unit.crash.folding_crash import KINDS, Crash, Fault, prepared

from strapdown import rotation
from strapdown.crash.consistency import common_edges, compare_pair, velocity_increments
from strapdown.crash.structure import unlearnt

MANUAL = Path(__file__).parents[3] / "docs" / "crash.md"
#: Of each kind in the slow test, of other crashes than those of the manual.
DRAWS, SEED, OTHER_SEED = 4, 6000, 6500


def scaled(percent):
    return lambda one: replace(one, values=one.values * [1 + percent / 100, 1 + percent / 100, 1])


def turned(degrees):
    C = rotation.dcm_from_rotation_vector([0.0, 0.0, np.radians(degrees)])
    return lambda one: replace(one, values=one.values @ C.T)


def moved(meters):
    """The recorder by so much in all, forward and to the right: what its gyro shows is noisy."""
    return Fault(moved=(meters / np.sqrt(2.0), meters / np.sqrt(2.0), 0.0))


def reversed_axis(one):
    main = int(np.argmax(np.abs(one.values[:, :2].sum(axis=0))))
    return replace(one, values=one.values * np.where(np.arange(3) == main, -1.0, 1.0))


#: What is wrong of the second point's increments, or of its recorder, by the row of the table.
ERRORS = {
    "no error": lambda one: one,
    "scale factor, 5 %": scaled(5.0),
    "scale factor, 10 %": scaled(10.0),
    "scale factor, 25 %": scaled(25.0),
    "turned about down, 2°": turned(2.0),
    "turned about down, 5°": turned(5.0),
    "turned about down, 10°": turned(10.0),
    "position, 0.25 m": moved(0.25),
    "position, 0.5 m": moved(0.5),
    "position, 1 m": moved(1.0),
    "position, 2 m": moved(2.0),
    "trigger, 10 ms late": Fault(late=-0.01),
    "trigger, 20 ms late": Fault(late=-0.02),
    "sign": reversed_axis,
}


def reported(crash, gyro, errors=tuple(ERRORS)) -> list[bool]:
    """Whether the comparison of two points says so, by the error of the second."""
    units = [crash.unit(k, gyro=gyro) for k in range(2)]
    _, options = crash.stated(units)
    there = prepared(units, options)
    out = []
    for name in errors:
        wrong = ERRORS[name]
        pair = there
        if isinstance(wrong, Fault):
            pair = prepared([units[0], crash.unit(1, gyro=gyro, fault=wrong)], options)
        edges = common_edges(pair)
        a, b = (velocity_increments(u, edges) for u in pair)
        b = b if isinstance(wrong, Fault) else wrong(b)
        kept = np.ones(len(edges) - 1, dtype=bool)
        found = compare_pair(*pair, a, b, kept, unlearnt(pair))
        out.append(not found.agree or any(f.severity != "note" for f in found.findings))
    return out


def shares(draws, seed=SEED):
    """Share reported, (errors, kinds, 2), with gyros and without."""
    found = np.array(
        [
            [
                [reported(Crash(seed + k, kind), gyro) for k in range(draws)]
                for gyro in (True, False)
            ]
            for kind in KINDS
        ]
    )
    return found.mean(axis=2).transpose(2, 0, 1)


def table(found) -> list[str]:
    """Rows of the table of the manual: all kinds with gyros and without, in percent."""
    return [
        f"| {name} | {one[:, 0].mean():.0f} | {one[:, 1].mean():.0f} |"
        for name, one in zip(ERRORS, 100.0 * found, strict=True)
    ]


@pytest.mark.parametrize(
    "error", ["scale factor, 10 %", "turned about down, 5°", "position, 2 m", "sign"]
)
def test_an_error_that_a_chi_square_dilutes_is_reported(error):
    crash = Crash(SEED, "offset")
    assert reported(crash, True, ("no error", error)) == [False, True]


def written() -> dict[str, list[float]]:
    lines = [line.split("|")[1:-1] for line in MANUAL.read_text(encoding="utf-8").splitlines()]
    return {
        cells[0].strip(): [float(c) for c in cells[1:]]
        for cells in lines
        if cells and cells[0].strip() in ERRORS and len(cells) == 3
    }


@pytest.mark.slow
def test_the_curve_of_the_manual_is_that_of_other_crashes():
    said, found = written(), shares(DRAWS, OTHER_SEED)
    assert list(said) == list(ERRORS)
    count = DRAWS * len(KINDS)
    for name, one in zip(ERRORS, found, strict=True):
        for share, column in zip(said[name], one.T, strict=True):
            interval = binomtest(round(column.mean() * count), count).proportion_ci(1.0 - 1e-3)
            # The manual's own share is of draws, too.
            assert interval.low - 0.1 <= share / 100.0 <= interval.high + 0.1, (name, share, column)


if __name__ == "__main__":
    print("\n".join(table(shares(int(sys.argv[1])))))
