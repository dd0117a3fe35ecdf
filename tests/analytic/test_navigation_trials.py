"""Drives whose truth is what the filter assumes: errors are as large as they are said to be."""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.robust import (
    AdaptiveRule,
    AdaptiveScale,
    Huber,
    Igg3,
    RobustUpdate,
    Tukey,
)
from strapdown.mechanization import NorthEastDown, run_mechanization
from strapdown.mechanization.mechanization import state_error
from strapdown.navigation.truth_comparison import band_of_mean, normalised_squares

sys.path.insert(0, str(Path(__file__).parent))

from drives import MODELS, SECONDS, START_SD, Plan, exact, nav_state, run, truth_at

RUNS = 100
# Epochs before which an outlier may still find a state of which little is known.
SETTLED = 6
NED, WANDER, QUATERNIONS = MODELS
SMALL_START = tuple(0.1 * np.array(START_SD))


def kept(plan):
    """The physical states that the model knows: the quaternions have no height."""
    return [k for k in range(15) if plan.model != QUATERNIONS or k != 2]


def one(job):
    plan, seed = job
    errors, covariance, _ = run(plan, seed)
    return errors, covariance


def trials(plan, runs=RUNS):
    """Normalised squares of all runs, (runs, epochs)."""
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        out = list(pool.map(one, [(plan, seed) for seed in range(runs)], chunksize=5))
    return squares_of(plan, out)


def squares_of(plan, out):
    at = kept(plan)
    return np.array([normalised_squares(e[:, at], P[:, at][:, :, at]) for e, P in out])


def believable(squares, freedom):
    """Whether means over runs are in the band of chi-square in 95 of 100 epochs.

    Epochs of one run depend on each other, by minutes where biases are known so slowly: how the
    share then scatters follows from how the squares of the runs do. Of normal means with that
    covariance and the mean that is claimed, 0.1 % have a smaller share than is accepted.
    """
    runs, epochs = squares.shape
    low, high = band_of_mean(freedom, runs)
    means = squares.mean(axis=0)
    share = np.mean((means > low) & (means < high))
    scatter = np.cov(squares.T) / runs
    rng = np.random.default_rng(0)
    drawn = freedom + rng.multivariate_normal(np.zeros(epochs), scatter, 4000, method="eigh")
    least = np.quantile(np.mean((drawn > low) & (drawn < high), axis=1), 0.001)
    assert share >= least, (share, least)
    # The mean of all, by how the means of the runs scatter: refused once in a thousand times.
    each = squares.mean(axis=1)
    off = (each.mean() - freedom) / (each.std(ddof=1) / np.sqrt(runs))
    assert abs(off) < 3.3, (each.mean(), off)
    return share


def test_samples_without_errors_give_the_truth():
    from strapdown.increments import motion_increments

    imu, _ = exact()
    trajectory = run_mechanization(
        NorthEastDown(), truth_at(0.0), motion_increments(imu)
    ).trajectory
    error = state_error(nav_state(trajectory.iloc[-1], SECONDS), truth_at(SECONDS))
    # A hundredth of what is known best in these trials: 0.2 m, 0.02 m/s, 3e-4 rad.
    assert np.all(np.abs(error) < np.repeat([5e-3, 2e-4, 3e-6], 3)), error


@pytest.mark.slow
def test_twenty_drives_are_as_wrong_as_they_are_said_to_be():
    plan = Plan()
    squares = squares_of(plan, [one((plan, seed)) for seed in range(20)])
    low, high = band_of_mean(15, 20, 0.999)
    each = squares.mean(axis=1)
    assert low < each.mean() < high
    # A filter that stands for half of its errors would be far outside.
    assert 4.0 * each.mean() > 2.0 * high


@pytest.mark.parametrize("model", MODELS)
def test_all_forms_of_the_covariance_are_one_filter(model):
    plan = Plan(model=model, epochs=(30.0, 60.0))
    runs = {form: run(replace(plan, form=form), 3) for form in COVARIANCES}
    errors, covariance, _ = runs["joseph"]
    sd = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).clip(1e-12)
    for form, (e, P, _) in runs.items():
        # Rounding of 60 updates and 600 predictions of numbers over twelve orders of magnitude.
        assert np.abs((e - errors) / sd).max() < 1e-6, form
        scaled = (P - covariance) / (sd[:, :, None] * sd[:, None, :])
        assert np.abs(scaled).max() < 1e-6, form


def test_ned_and_wander_azimuth_are_one_filter():
    plan = Plan(epochs=(30.0, 120.0))
    errors, covariance, _ = run(plan, 4)
    e, P, _ = run(replace(plan, model=WANDER), 4)
    sd = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    # They differ by the order of their integration, some 1e-3 of what is known.
    assert np.abs((e - errors) / sd).max() < 0.01
    scaled = (P - covariance) / (sd[:, :, None] * sd[:, None, :])
    assert np.abs(scaled).max() < 0.01


@pytest.mark.slow
@pytest.mark.parametrize(
    "plan",
    [
        *(Plan(model=model) for model in MODELS),
        *(Plan(form=form) for form in COVARIANCES if form != "joseph"),
        Plan(fix_offset=0.337, lever_arm=(1.5, -0.8, -1.2)),
        Plan(correlation_time=60.0),
        Plan(model=QUATERNIONS, correlation_time=60.0),
        Plan(step=1.0),
        Plan(start_sd=(*START_SD[:8], np.radians(10.0))),
        # What is not taken off the state stays: a better start and better sensors, see below.
        Plan(damping="feedforward", start_sd=SMALL_START, bias=0.1),
    ],
    ids=lambda plan: (
        f"{plan.model} {plan.form} {plan.damping} {plan.fix_offset:g} {plan.correlation_time:g} "
        f"{plan.step:g} {np.degrees(plan.start_sd[8]):.1f}"
    ),
)
def test_a_hundred_drives_are_as_wrong_as_they_are_said_to_be(plan):
    believable(trials(plan), len(kept(plan)))


@pytest.mark.slow
def test_forward_alone_errors_that_are_not_small_leave_the_linear_model():
    # 2 deg of heading and 20 deg/h stay in a mechanization that is never corrected: over 4 minutes
    # the squares of the errors, which the equations leave out, outgrow what is known by fixes.
    forward = trials(Plan(damping="feedforward"), 20).mean(axis=0)
    _, high = band_of_mean(15, 20)
    assert forward[-5:].mean() > 1.5 * high


@pytest.mark.slow
def test_with_a_heading_unknown_by_30_degrees_a_minute_is_not_believable_and_then_it_is():
    # The equations are of the first order: of 30 deg the second is a quarter.
    squares = trials(Plan(start_sd=(*START_SD[:8], np.radians(30.0)))).mean(axis=0)
    _, high = band_of_mean(15, RUNS)
    assert squares[0] > 1.3 * high
    # Errors that have been seen to be small are small; 99.9 % of 5 epochs that are as one.
    assert squares[-5:].mean() < band_of_mean(15, RUNS, 0.999)[1]


@pytest.mark.slow
def test_a_covariance_that_is_too_small_is_refused():
    # Noise of the gyros of twenty times the usual, and a third of it assumed.
    squares = trials(Plan(grade=20.0, gyro_noise=1.0 / 3.0), 40)
    with pytest.raises(AssertionError):
        believable(squares, 15)


def place_rms(plan, seeds):
    """Root mean square of the place in three dimensions over runs, from 30 s on, m."""
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        out = pool.map(one, [(plan, seed) for seed in seeds], chunksize=5)
        places = [errors[SETTLED:, :3] for errors, _ in out]
    return float(np.sqrt(np.mean(np.sum(np.square(places), axis=-1))))


def test_one_drive_with_gross_errors():
    at = (60.0, 120.0, 180.0, 235.0)

    def rms(**more):
        errors, _, _ = run(Plan(epochs=at, **more), 1)
        return np.sqrt(np.mean(np.sum(errors[:, :3] ** 2, axis=1)))

    # Four instants of one drive scatter by a half; a gross error of 50 m leaves some metres.
    assert rms(rule=RobustUpdate(Igg3()), outliers=0.1) < 2.0 * rms()
    assert rms(outliers=0.1) > 3.0 * rms()


@pytest.mark.slow
def test_a_robust_rule_keeps_its_accuracy_among_gross_errors_and_the_plain_one_does_not():
    seeds = range(40)
    clean = place_rms(Plan(), seeds)
    # The same noise, and in a tenth of the fixes 50 standard deviations in some direction.
    # What is proposed for a log, which cannot reject for ever, and does not call a receiver better
    # than it says: 10 % worse over a hundred drives.
    proposed = AdaptiveRule(Igg3(), AdaptiveScale(lowest=1.0))
    for rule in (RobustUpdate(Igg3()), RobustUpdate(Tukey()), proposed):
        assert place_rms(Plan(rule=rule, outliers=0.1), seeds) < 1.2 * clean
        assert place_rms(Plan(rule=rule), seeds) < 1.1 * clean
    assert place_rms(Plan(outliers=0.1), seeds) > 3.0 * clean
    # Huber's bounds a gross error, and does not forget it: 28 % worse here.
    huber = place_rms(Plan(rule=RobustUpdate(Huber()), outliers=0.1), seeds)
    assert 1.15 * clean < huber < 1.45 * clean
