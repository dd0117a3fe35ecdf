"""The experiment of Tadic and Vukajlovic (2016) in small: recorders against two cameras."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown.crash.entry import Entry
from strapdown.crash.path import compare_with_reference
from strapdown.crash.reconstruction import CrashOptions, reconstruct_crash
from strapdown.simulation import point_kinematics
from strapdown.simulation.cameras import film, paper_cameras, path_from_cameras
from strapdown.simulation.crash_motion import find_crash
from strapdown.simulation.crash_recording import paper_units, record_crash
from strapdown.tables import NED, POSITION_SD

CRASH = find_crash("pole")
IMPACT = CRASH.impacts[0]
MARKER = (0.2, 0.1, -0.6)
SEEDS = 6


@pytest.fixture(scope="module")
def comparisons():
    designs = [d for d in paper_units() if d.gyro is not None][:1]
    found = []
    speed = float(point_kinematics(CRASH.motion, MARKER, np.array([IMPACT])).velocity[0, 0])
    for seed in range(SEEDS):
        units = [record_crash(CRASH.motion, d, impact=IMPACT, seed=seed)[0] for d in designs]
        answer = reconstruct_crash(units, Entry.from_speed(speed, 0.02), CrashOptions(point=MARKER))
        cameras = paper_cameras()
        tracks = [
            film(
                CRASH.motion,
                {"centre": MARKER},
                camera,
                impact=IMPACT,
                seed=seed,
                start=IMPACT - 0.1,
                end=IMPACT + 0.78,
            )
            for camera in cameras
        ]
        reference = path_from_cameras(*tracks, cameras, marker="centre")
        found.append((answer, reference, compare_with_reference(answer.main.path, reference)))
    return found


def test_recorders_and_cameras_agree_within_their_bounds(comparisons):
    # Of each axis at the end, the mean of the square in units of its variance: chi-square of six
    # runs over six, of which 1e-4 lie above 4.7.
    z = [(c.errors.iloc[-1] / (c.bound.iloc[-1] / 1.96)).to_numpy() ** 2 for _, _, c in comparisons]
    assert (np.mean(z, axis=0) < 4.7).all()
    assert sum(c.consistent for _, _, c in comparisons) >= SEEDS - 2


def test_the_error_is_of_decimetres(comparisons):
    # The paper's statement, with the reference's own centimetre in it.
    largest = np.array([np.abs(c.largest) for _, _, c in comparisons])
    assert 0.005 < np.median(largest) < 0.3


def test_the_cameras_are_the_better_of_the_two(comparisons):
    answer, reference, comparison = comparisons[0]
    assert list(reference[POSITION_SD].columns) == POSITION_SD
    assert (reference[POSITION_SD].max() < 0.05).all()
    assert (answer.main.path.sd[NED].iloc[-1] > 2.0 * reference[POSITION_SD].median().max()).all()
    assert len(comparison.errors) > 800  # frames
