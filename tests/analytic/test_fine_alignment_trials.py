"""Two hundred alignments of the FOG-1000 class: errors as large as they are said to be."""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2, kstest

sys.path.insert(0, str(Path(__file__).parents[1] / "unit" / "alignment"))

from resting import SITE, UNCERTAINTY, resting

RUNS = 200
# Of the paper: coarse to 100 s, fine to 600 s.
COARSE_ROWS, SECONDS = 5000, 600.0


def one(seed):
    """Errors of coarse and of fine alignment, each with what is claimed of them."""
    from strapdown import rotation
    from strapdown.alignment.coarse_alignments import COARSE_ALIGNMENTS
    from strapdown.alignment.fine import FineAlignment

    rest = resting(seed, SECONDS)
    first = rest.imu.iloc[:COARSE_ROWS]
    first.attrs = dict(rest.imu.attrs)
    coarse = COARSE_ALIGNMENTS["inertial_frame"]().align(first, SITE, UNCERTAINTY)
    others = rest.imu.iloc[COARSE_ROWS - 1 :]
    others.attrs = dict(rest.imu.attrs)
    fine = FineAlignment().align(others, SITE, UNCERTAINTY, coarse)

    def off(found):
        return rotation.rotation_vector_from_quaternion(
            rotation.compose(found.q_nb, rotation.conjugate(rest.q_nb))
        )

    last = fine.alignment
    # Of the sensors the error is what is left after the estimate is taken off.
    error = np.concatenate(
        [off(last), rest.gyro_bias - last.gyro_bias, rest.accel_bias - last.accel_bias]
    )
    P = fine.filter.physical_covariance(fine.state)[6:, 6:]
    phi = off(coarse)
    return (
        phi @ np.linalg.solve(coarse.covariance, phi),
        error @ np.linalg.solve(P, error),
        error,
        P,
    )


@pytest.fixture(scope="module")
def runs():
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        return list(pool.map(one, range(RUNS), chunksize=10))


def believable(values, freedom):
    """Whether sums of squares are chi-square, one a run: all of them, and those in the tail."""
    inside = np.mean(np.asarray(values) < chi2.ppf(0.95, freedom))
    # Of 200 runs a share of 0.95 has a standard deviation of 0.0154; four of them.
    assert 0.888 < inside, inside
    # Kolmogorov-Smirnov: a sound filter is refused once in a thousand times.
    assert kstest(values, chi2(freedom).cdf).pvalue > 1e-3


@pytest.mark.slow
def test_nine_physical_states_are_as_wrong_as_they_are_said_to_be(runs):
    believable([run[1] for run in runs], 9)


@pytest.mark.slow
def test_each_state_alone(runs):
    errors = np.array([run[2] for run in runs])
    claimed = np.array([np.sqrt(np.diagonal(run[3])) for run in runs])
    rms = np.sqrt(np.mean((errors / claimed) ** 2, axis=0))
    # Of 200 the root mean square is known to 5 %; four of them.
    assert np.all(np.abs(rms - 1.0) < 0.2), rms


@pytest.mark.slow
def test_coarse_alignments_are_as_wrong_as_they_are_said_to_be(runs):
    believable([run[0] for run in runs], 3)
