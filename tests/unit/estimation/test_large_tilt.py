"""Correction of a large tilt: what is unlearnt, as drawn tilts scatter, and what turns with it."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from strapdown.constants import STANDARD_GRAVITY
from strapdown.estimation.covariance import COVARIANCES, Observation
from strapdown.estimation.error_filter import (
    ATTITUDE,
    ErrorFilter,
    is_large,
    turned_force,
    unlearnt_force,
)
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.sensor_blocks import (
    accel_bias,
    accel_scale,
    gyro_bias,
)
from strapdown.mechanization import MECHANIZATIONS
from strapdown.nav_state import NavState
from strapdown.rotation import dcm_from_quaternion

START = NavState.from_degrees(48.0, 11.0, 500.0, roll_deg=4.0, pitch_deg=-7.0, heading_deg=130.0)
BOTH = (gyro_bias(1e-4), accel_bias(1.0))
TOLD, LEFT = np.radians(3.0), np.radians(0.5)


def levelled(name, sd, tied=1.0, sensors=BOTH):
    """A filter, its state, and a covariance with tilts that the accelerometers' bias hides."""
    filter_ = ErrorFilter(
        MECHANIZATIONS[name](), RotationVectorModel(sensors=sensors), COVARIANCES["ud"]()
    )
    small = np.diag(np.full(filter_.model.physical_size, 1e-10))
    state = filter_.begin(START, small)
    hides = np.zeros((len(small), 2))
    hides[6:8] = np.eye(2)
    if len(sensors) > 1:
        C = filter_.mechanization.level_from_ned(state.row) @ dcm_from_quaternion(START.q_nb)
        across = STANDARD_GRAVITY * np.array([[0.0, 1.0], [-1.0, 0.0], [0.0, 0.0]])
        hides[12:15] = tied * C.T @ across
    return filter_, state, small + sd**2 * hides @ hides.T


@pytest.mark.parametrize("name", ["ned", "wander_azimuth"])
def test_it_is_the_scatter_of_gravity_along_a_tilted_body(name):
    filter_, state, before = levelled(name, TOLD)
    _, _, after = levelled(name, LEFT)
    Q = unlearnt_force(filter_, state, before, after)
    # Of a tilt that is told to LEFT, (x² + y²)/2 of both before and after, drawn.
    rng = np.random.default_rng(3)
    drawn = 0.5 * STANDARD_GRAVITY * np.square(rng.normal(size=(400_000, 2))).sum(axis=1)
    scatter = np.var(drawn) * (TOLD**4 - LEFT**4)
    # The variance of a variance: kurtosis 9 of an exponential, 3 sd of 400 000 draws; and of the
    # covariance of 1e-10 beside the tilts 4e-8 of them.
    assert np.trace(Q) == pytest.approx(scatter, rel=3.0 * np.sqrt(8.0 / 400_000))
    # It is along the vertical, in the axes of the body, and of the bias alone.
    down = dcm_from_quaternion(START.q_nb)[2]
    assert Q[12:15, 12:15] == pytest.approx(np.trace(Q) * np.outer(down, down), abs=1e-9)
    assert np.abs(Q).sum() == pytest.approx(np.abs(Q[12:15, 12:15]).sum())


def test_many_small_updates_unlearn_as_much_as_one():
    filter_, state, before = levelled("ned", TOLD)
    steps = [before, *(levelled("ned", sd)[2] for sd in np.linspace(TOLD, LEFT, 12)[1:])]
    # Below 0.8 deg, of both together, nothing is asked any more: 0.5 g 0.014**2 = 1 mm/s².
    told = [unlearnt_force(filter_, state, a, b) for a, b in pairwise(steps)]
    at_once = np.trace(unlearnt_force(filter_, state, before, steps[-1]))
    in_steps = sum(np.trace(Q) for Q in told if Q is not None)
    assert in_steps == pytest.approx(at_once, abs=2.0 * 0.001**2)


@pytest.mark.parametrize(
    ("sd", "tied", "sensors"),
    [(np.radians(0.5), 1.0, BOTH), (TOLD, 1.0, BOTH[:1]), (TOLD, 0.0, BOTH)],
    ids=["small tilt", "accelerometers known", "nothing hides it"],
)
def test_where_nothing_was_learnt_about_a_large_tilt_nothing_is_unlearnt(sd, tied, sensors):
    filter_, state, before = levelled("ned", sd, tied, sensors)
    _, _, after = levelled("ned", 0.1 * sd, tied, sensors)
    Q = unlearnt_force(filter_, state, before, after)
    assert Q is None or np.trace(Q) < 1e-12
    assert is_large(before) == (sd == TOLD)


def test_an_update_that_tells_no_tilt_unlearns_nothing():
    filter_, state, before = levelled("ned", TOLD)
    assert unlearnt_force(filter_, state, before, before) is None


@pytest.mark.parametrize("name", ["ned", "wander_azimuth"])
def test_accelerometers_add_the_same_to_gravity_in_level_axes_after_a_correction(name):
    filter_, state, P = levelled(name, TOLD, sensors=(*BOTH, accel_scale(0.1)))
    used = filter_.mechanization
    C = dcm_from_quaternion(used.levels(state.row[None])[0, ATTITUDE])
    up = used.level_up * STANDARD_GRAVITY * C[2]
    # Half of what hides a tilt is of the scale factors, which take of gravity what is along them.
    half = np.eye(len(P))
    half[12:15, 12:15] *= 0.5
    half[15:, 12:15] = 0.5 * np.diag(1.0 / up)
    met = replace(state, covariance=filter_.form.begin(half @ P @ half.T + 1e-10 * np.eye(len(P))))
    # Both tilts are told to 3 deg, by two that are twice as far as they were thought to be.
    H = np.eye(len(P))[6:8]
    told = Observation("level", np.array([2.0, -2.0]) * TOLD, H, np.full(2, TOLD**2), ("x", "y"))
    after, _, _ = filter_.observe(met, [told])
    turned, P = turned_force(filter_, met, after), filter_.physical_covariance(after)
    assert turned is not None
    T, first = turned
    assert np.array_equal(np.flatnonzero((np.eye(len(T)) != T).any(axis=1)), first + np.arange(3))
    C_after = dcm_from_quaternion(used.levels(after.row[None])[0, ATTITUDE])
    error = np.hstack([np.eye(3), np.diag(up)])

    def known(C, P):
        """Covariance of tilt and of the error of the force, level axes."""
        to_level = np.zeros((6, len(P)))
        to_level[:3, 6:9], to_level[3:, 12:] = np.eye(3), C @ error
        return to_level @ P @ to_level.T

    scale = np.sqrt(np.diagonal(known(C, P)))
    scale = np.outer(scale, scale)
    np.testing.assert_allclose(known(C_after, T @ P @ T.T) / scale, known(C, P) / scale, atol=1e-9)
    # Without it 3 deg of either turn 0.5 m/s² into the vertical force, known to 1e-4 m/s².
    assert known(C_after, P)[5, 5] > 1e3 * known(C, P)[5, 5]


def test_without_a_bias_of_the_accelerometers_nothing_turns():
    filter_, state, _ = levelled("ned", TOLD, sensors=BOTH[:1])
    assert turned_force(filter_, state, state) is None
