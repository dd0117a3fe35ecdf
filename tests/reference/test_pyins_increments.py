"""Motion increments against python-ins, which has angle and velocity of a linear model."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from strapdown.increments import motion_increments
from strapdown.tables import ACCEL, DV, GYRO, PHI

_spec = importlib.util.spec_from_file_location(
    "smooth_motion",
    Path(__file__).parents[1] / "unit" / "increments" / "smooth_motion.py",
)
smooth = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(smooth)

START, LENGTH = 0.3, 2.4
PHI_DV = [*PHI, *DV]


def theirs(imu):
    """Their increments of our table; of means, their input is the increment itself."""
    from pyins.strapdown import compute_increments_from_imu

    mean = imu.attrs["sampling"] == "mean"
    values = imu[GYRO + ACCEL].to_numpy()
    if mean:
        time = imu.index.to_numpy()
        values = values * np.diff(time, prepend=2 * time[0] - time[1])[:, None]
    frame = pd.DataFrame(values, index=imu.index, columns=GYRO + ACCEL)
    found = compute_increments_from_imu(frame, "increment" if mean else "rate")
    names = [f"theta_{a}" for a in "xyz"] + [f"dv_{a}" for a in "xyz"]
    return found[names].to_numpy()


def end_of(rows):
    """Attitude and velocity after rows of phi and dv."""
    table = pd.DataFrame(rows, columns=PHI_DV)
    table[["dr_x", "dr_y", "dr_z"]] = 0.0
    table["dt"] = 0.0
    return smooth.compose(table)


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
def test_linear_steps_agree_up_to_the_next_order(sampling):
    """They stop after products of two: what is left falls with the third power of a step."""
    differences = []
    for count in (60, 120):
        time = START + np.arange(count + 1) * LENGTH / count
        imu = smooth.imu_at(time, sampling)
        ours = motion_increments(imu)[PHI_DV].to_numpy()
        differences.append(np.abs(ours - theirs(imu)).reshape(-1, 2, 3).max(axis=(0, 2)))
    turn, velocity = np.log2(differences[0] / differences[1])
    # Of the angle, both have all products of two: the same numbers, to rounding.
    assert differences[0][0] < 1e-17 or turn > 4
    # Of the velocity we have the third product, theta x (theta x f) T^3/6.
    assert velocity == pytest.approx(3.0, abs=0.1)


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
@pytest.mark.parametrize("count", [60, 240])
def test_ours_are_no_worse(sampling, count):
    time = START + np.arange(count + 1) * LENGTH / count
    imu = smooth.imu_at(time, sampling)
    true = smooth.truth(START, START + LENGTH)

    def wrong(state):
        return smooth.distance(state, true)[:2]

    baseline = wrong(end_of(theirs(imu)))
    ours = wrong(end_of(motion_increments(imu)[PHI_DV].to_numpy()))
    # Their turn is ours to rounding; a hundredth is granted to the velocity's luck.
    assert (ours <= 1.01 * baseline + 1e-14).all()
    for samples, gain in ((2, 5.0), (3, 5.0), (4, 100.0)):
        better = wrong(smooth.compose(motion_increments(imu, samples)))
        assert (better < baseline / gain).all()
