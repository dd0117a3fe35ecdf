"""A drive of 57 minutes by the command, as near to the truth as KF-GINS came on the same data.

A recorded RTK track; 200 Hz increments of a tactical unit whose biases and scale factors fade over
hours. Generator, scores and the figures of KF-GINS (C++, 21 states) are those of the measuring
sticks beside the recordings.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))
from benchmarks.kfgins import BENCH, generate, missing, written
from tests.recorded import without

SCORED_FROM = "456600"
#: Within so much of each figure, and half of its last digit.
WITHIN = 1.03
# Seed 1: horizontal and vertical place in m, attitude in deg.
KF_GINS = {
    "pos_rms_H": 0.0084,
    "pos_max_H": 0.0252,
    "pos_rms_V": 0.0108,
    "pos_max_V": 0.0532,
    "roll_rms": 0.00050,
    "pitch_rms": 0.00061,
    "heading_rms": 0.0068,
}
#: Of 45 outages of 60 s the largest horizontal error, m.
OUTAGES = {"median": 0.295, "rms": 0.341, "worst": 0.591}


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """Folder of the generated drive."""
    if lacking := missing():
        without(lacking)
    folder = tmp_path_factory.mktemp("kfgins")
    generate(folder)
    return folder


def scored(folder, out, outages=()):
    """Scores of a run by the script of the measuring stick."""
    more = [word for name in outages for word in ("--outages", str(folder / name))]
    command = [sys.executable, str(BENCH / "evaluate.py"), str(out / "trajectory.nav")]
    command += [str(folder / "truth.nav"), "--start", SCORED_FROM, "--json", *more]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


def navigated(folder, fixes, more="figures = false\n"):
    """Folder of a run by the command."""
    name = fixes.removesuffix(".txt")
    file, out = folder / f"{name}.toml", folder / name
    file.write_text(written(folder, fixes) + more)
    command = [sys.executable, "-m", "strapdown", "navigate", str(file), "--out", str(out)]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return out


@pytest.mark.slow
def test_every_figure_is_that_of_kf_gins_or_better(drive):
    scores = scored(drive, navigated(drive, "GNSS-RTK-sim.txt"))
    for name, theirs in KF_GINS.items():
        # Their figures are rounded to the fourth or the fifth digit.
        half = 5e-6 if name in ("roll_rms", "pitch_rms") else 5e-5
        assert scores[name] <= WITHIN * (theirs + half), name


@pytest.mark.slow
def test_45_outages_cost_no_more_and_smoothed_a_third_of_it_at_most(drive):
    largest, smoothed = [], []
    for k in ("0", "60", "120"):
        more = 'figures = false\n[smoother]\nkind = "rts"\n'
        out = navigated(drive, f"GNSS-RTK-sim_outage{k}.txt", more)
        for folder, rows in ((out / "forward", largest), (out, smoothed)):
            rows += [row[2] for row in scored(drive, folder, [f"outages{k}.txt"])["outages"]]
            (folder / "trajectory.nav").unlink()
    largest, smoothed = np.array(largest), np.array(smoothed)
    assert len(largest) == len(smoothed) == 45
    # As far as is known from both sides: errors that grow with the square of the time over half of
    # it, joined, are less than a third; what was seen is a tenth.
    assert np.median(largest) > 3.0 * np.median(smoothed)
    assert largest.max() > 3.0 * smoothed.max()
    ours = {
        "median": np.median(largest),
        "rms": np.sqrt(np.mean(largest**2)),
        "worst": largest.max(),
    }
    for name, theirs in OUTAGES.items():
        assert ours[name] <= WITHIN * (theirs + 5e-4), (name, ours)
