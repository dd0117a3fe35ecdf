"""Drives whose truth is what the filter assumes, smoothed: errors are as large as they are said."""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from strapdown.mechanization.mechanization import state_error
from strapdown.nav_state import NavState
from strapdown.navigation.recorder import FullRecorder
from strapdown.navigation.smoother import RauchTungStriebel
from strapdown.navigation.truth_comparison import band_of_mean, normalised_squares

sys.path.insert(0, str(Path(__file__).parent))

from test_navigation_trials import believable

from drives import ACCEL_BIAS, GYRO_BIAS, MODELS, START_SD, Plan, drawn, navigator_of, truth_at

RUNS = 100
SMALL_START = tuple(0.1 * np.array(START_SD))
NED, WANDER, QUATERNIONS = MODELS
#: A minute without fixes is smoothed, too.
OUTAGE = (100.0, 160.0)


def kept(plan):
    """The nine errors of the state that the model knows: the quaternions have no height."""
    return [k for k in range(9) if plan.model != QUATERNIONS or k != 2]


def smoothed(job):
    """Errors of a drive at its epochs, and their covariance, forward and smoothed."""
    plan, seed, outage = job
    inc, gnss, begin, _ = drawn(plan, seed)
    if outage:
        gnss = gnss[(gnss.index < OUTAGE[0]) | (gnss.index > OUTAGE[1])]
    navigator = replace(navigator_of(plan), smoother=RauchTungStriebel())
    biases = plan.bias * np.r_[[GYRO_BIAS] * 3, [ACCEL_BIAS] * 3]
    P = np.diag(np.r_[plan.start_sd, biases] ** 2)
    state = navigator.tell(navigator.begin(begin, P), "gnss", gnss)
    tape, later = FullRecorder().begin(navigator), navigator.smoother.begin(navigator)
    state, piece = navigator.advance(state, inc.index.to_numpy(), inc.to_numpy())
    for one in (piece, navigator.finish(state)):
        tape.take(one)
        later.take(one)
    out = []
    for record in (tape.record(), tape.record(smoothing=later)):
        rows, marks = record.trajectory.index.to_numpy(), record.sd.index.to_numpy()
        errors, covariance = [], []
        for epoch in plan.epochs:
            row = int(np.argmin(np.abs(rows - epoch)))
            mark = int(np.searchsorted(marks, rows[row] + 1e-7, side="right")) - 1
            computed = NavState.from_trajectory(record.trajectory.iloc[[row]])
            errors.append(state_error(computed, truth_at(rows[row])))
            covariance.append(record.covariance[mark])
        out.append((np.array(errors), np.array(covariance)))
    return out


def trials(plan, runs, outage=False):
    """Normalised squares and mean squares of place and heading, smoothed and forward."""
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        jobs = [(plan, seed, outage) for seed in range(runs)]
        found = list(pool.map(smoothed, jobs, chunksize=5))
    at = kept(plan)
    squares = np.array([normalised_squares(e[:, at], P[:, at][:, :, at]) for _, (e, P) in found])
    return squares, [np.array([one[k][0] for one in found]) for k in (0, 1)]


@pytest.mark.slow
def test_ten_drives_are_as_wrong_as_they_are_said_to_be_and_less_than_before():
    plan = Plan()
    found = [smoothed((plan, seed, True)) for seed in range(10)]
    squares = np.array([normalised_squares(e, P) for _, (e, P) in found])
    # Epochs of a run are all by the same observations: its mean is as one number of chi-square at
    # worst; refused once in a thousand times.
    low, high = band_of_mean(9, 10, 0.999)
    assert low < squares.mean() < high
    assert 4.0 * squares.mean() > 2.0 * high
    inside = [k for k, at in enumerate(plan.epochs) if OUTAGE[0] + 15.0 < at < OUTAGE[1]]
    place = [
        np.sqrt(np.mean([np.square(one[k][0][inside, :2]).sum(axis=1) for one in found]))
        for k in (0, 1)
    ]
    assert place[0] > 3.0 * place[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plan", "outage"),
    [
        *((Plan(model=model), False) for model in MODELS),
        (Plan(), True),
        (Plan(form="ud"), True),
        (Plan(form="wd", model=WANDER), True),
        (Plan(fix_offset=0.337, lever_arm=(1.5, -0.8, -1.2)), True),
        (Plan(correlation_time=60.0), True),
        (Plan(damping="feedforward", start_sd=SMALL_START, bias=0.1), False),
    ],
    ids=lambda p: (
        f"{p.model} {p.form} {p.damping} {p.fix_offset:g}" if isinstance(p, Plan) else str(p)
    ),
)
def test_a_hundred_drives_are_as_wrong_as_they_are_said_to_be(plan, outage):
    squares, (forward, after) = trials(plan, RUNS, outage)
    believable(squares, len(kept(plan)))
    for part in (slice(0, 2), slice(3, 5), slice(8, 9)):
        assert np.mean(np.square(after[..., part])) < np.mean(np.square(forward[..., part]))
