"""A smoothed run about its own states: what no observation shows is not thought to be known."""

from __future__ import annotations

import math
import mmap
import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from scipy.stats import chi2
from tests.aided_drives import truth_at
from tests.coded import coded

from strapdown.errors import ConfigError
from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import RotationVectorModel
from strapdown.estimation.sensor_blocks import accel_bias, gyro_bias
from strapdown.mechanization import NorthEastDown, WanderAzimuth
from strapdown.mechanization.mechanization import state_error
from strapdown.nav_state import NavState
from strapdown.navigation.compiled_engine import ReferenceEngine
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.modes import KnownStart
from strapdown.navigation.navigator import Navigator, with_states
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.recorder import IntervalRecorder
from strapdown.navigation.replay import SETTLED, relinearized, run_batch, starts_far
from strapdown.navigation.smoother import RauchTungStriebel
from strapdown.navigation.truth_comparison import smoother_consistency
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty
from strapdown.simulation import ImuErrors, Origin, PathMotion, Track, TriadErrors, simulate_imu
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.tables import POSITION_SD, VELOCITY, on_disk

#: A phone, rad/s/√Hz, m/s²/√Hz, rad/s, m/s²; and a start of which the heading is known roughly.
GYRO_NOISE, ACCEL_NOISE, GYRO_BIAS, ACCEL_BIAS = 1e-4, 2e-3, 5e-3, 0.1
TILT, HEADING = np.radians(0.5), np.radians(10.0)
FIX = 0.3


@cache
def walk():
    """A minute and a half at the pace of a walker, straight on but for a stop."""
    return PathMotion(
        90.0,
        Origin(48.0, 11.0, 500.0),
        heading_deg=60.0,
        speed=Track((0.0, 4.0, 6.0, 40.0, 42.0, 48.0, 50.0), (0.0, 0.0, 1.4, 1.4, 0.0, 0.0, 1.4)),
        turn_rate=Track((0.0, 60.0, 61.0, 70.0, 71.0), (0.0, 0.0, 1.0, 1.0, 0.0)),
    )


def started(seed, share):
    """A pipeline over a walk, its samples and fixes: all errors are this share of their sizes."""
    rng, motion = np.random.default_rng([seed, 3]), walk()
    errors = ImuErrors(
        TriadErrors(
            noise_density=share * GYRO_NOISE,
            bias=tuple(share * GYRO_BIAS * rng.standard_normal(3)),
        ),
        TriadErrors(
            noise_density=share * ACCEL_NOISE,
            bias=tuple(share * ACCEL_BIAS * rng.standard_normal(3)),
        ),
    )
    imu, _ = simulate_imu(motion, errors, rate=50.0, sampling="mean", seed=seed)
    receiver = GnssReceiver(
        rate=2.0, position_noise=share * FIX, velocity_noise=1.0, on_excess="unaffected"
    )
    fixes = simulate_gnss(motion, receiver, seed=seed)
    fixes[POSITION_SD] = FIX

    model = RotationVectorModel(
        (GYRO_NOISE,) * 3, (ACCEL_NOISE,) * 3, (gyro_bias(GYRO_BIAS), accel_bias(ACCEL_BIAS))
    )
    filter_ = ErrorFilter(NorthEastDown(), model, COVARIANCES["ud"](), step=0.1)
    aids = (Gnss(name="gnss", use_velocity=False),)
    smoother = RauchTungStriebel()
    navigator = replace(Navigator(with_states(filter_, aids), aids), smoother=smoother)
    used, truth = filter_.mechanization, truth_at(motion, float(imu.index[0]))
    sd = np.array([1.0] * 3 + [0.1] * 3 + [TILT, TILT, HEADING])
    off = used.correct(used.begin(truth), -share * sd * rng.standard_normal(9))
    start = KnownStart(
        used.nav_state(off, truth.time),
        tuple(sd[:3]),
        tuple(sd[3:6]),
        tuple(np.degrees(sd[6:])),
    )
    return NavigationPipeline(navigator, start=start), imu, {"gnss": fixes}


@cache
def smoothed(seed, share=1.0):
    """Records of a walk, smoothed once, and about its smoothed states."""
    chain, imu, tables = started(seed, share)
    run = run_batch(chain, imu, tables, IntervalRecorder(rate_hz=5.0))
    again = relinearized(chain, imu, tables, IntervalRecorder(rate_hz=5.0), run)
    return run.smoothed, again.smoothed, again.smoothing.moved()


def tilts(record, part=slice(6, 8)):
    """Errors of both tilts in the middle of a walk, rad, and their covariance."""
    k = len(record.sd) // 2
    row = record.trajectory.index.searchsorted(record.sd.index[k])
    state = NavState.from_trajectory(record.trajectory.iloc[[row]])
    error = state_error(state, truth_at(walk(), float(record.trajectory.index[row])))
    return error[part], record.covariance[k][part, part]


def test_the_tilt_that_a_bias_hides_is_as_unknown_as_along_the_true_path():
    once, again, moved = smoothed(1)
    # Errors of a hundredth leave the filter on the true path: what is known there is known.
    there = np.trace(tilts(smoothed(1, 0.01)[0])[1])
    assert np.trace(tilts(again)[1]) == pytest.approx(there, rel=0.1)
    assert np.trace(tilts(once)[1]) < 0.7 * there
    assert moved < SETTLED


def test_small_errors_need_no_second_pass():
    once, again, moved = smoothed(1, 0.01)
    assert moved < 0.01
    np.testing.assert_allclose(again.sd.to_numpy(), once.sd.to_numpy(), rtol=0.02)
    # The same states to a hundredth of a hundredth of their standard deviations.
    e, P = tilts(once)
    np.testing.assert_allclose(tilts(again)[0], e, rtol=0.0, atol=1e-3 * np.sqrt(P[0, 0]))


def test_what_the_filter_found_remains():
    chain, imu, tables = started(2, 1.0)
    run = run_batch(chain, imu, tables)
    again = relinearized(chain, imu, tables, None, run)
    assert again.record is run.record
    np.testing.assert_array_equal(again.smoothed.sd.index, run.record.sd.index)
    np.testing.assert_array_equal(again.smoothed.trajectory.index, run.record.trajectory.index)
    for name, table in run.smoothed.innovations.items():
        assert again.smoothed.innovations[name] is table
    only = replace(chain.navigator, smoother=RauchTungStriebel(passes=1))
    assert relinearized(replace(chain, navigator=only), imu, tables, None, run) is run


@cache
def filtered(seed, share=1.0):
    """What the filter finds of a walk at once, and about its smoothed states."""
    chain, imu, tables = started(seed, share)
    run = run_batch(chain, imu, tables, IntervalRecorder(rate_hz=5.0))
    recorder = IntervalRecorder(rate_hz=5.0)
    again = relinearized(chain, imu, tables, recorder, run, filtered=True)
    return run.record, again.record


def test_a_filter_that_starts_far_off_does_not_take_its_corrections_for_knowledge():
    once, again = filtered(1)
    # Errors of a hundredth leave the filter on the true path: what is known there is known.
    there = np.trace(tilts(filtered(1, 0.01)[0])[1])
    assert np.trace(tilts(again)[1]) == pytest.approx(there, rel=0.1)
    assert np.trace(tilts(once)[1]) < 0.8 * there
    assert again.sd.index.equals(once.sd.index)
    assert again.trajectory.index.equals(once.trajectory.index)
    # The filter knows at the begin what it was told, not what came later.
    np.testing.assert_allclose(again.sd.iloc[0], once.sd.iloc[0], rtol=0.1)


@pytest.mark.parametrize("heading", [0.0, HEADING])
def test_a_start_is_far_off_by_its_attitude_beside_the_biases_of_the_accelerometers(heading):
    record = filtered(1)[0]
    covariance = record.covariance.copy()
    covariance[0, 8, 8] = heading**2
    record = replace(record, covariance=covariance)
    gyro = TriadUncertainty(bias=GYRO_BIAS, noise_density=GYRO_NOISE)

    def far(bias):
        accel = TriadUncertainty(bias=bias, noise_density=ACCEL_NOISE)
        return starts_far(record, ImuUncertainty(gyro, accel))

    # Of two tilts of one sd the second orders are g sd² and, in both directions, g sd heading sd.
    limit = 9.80665 * TILT * math.sqrt((TILT**2 + 2.0 * heading**2) / 0.1)
    assert far(0.98 * limit)
    assert not far(1.02 * limit)


@pytest.mark.slow
def test_thirty_walks_are_as_wrong_as_they_are_said_to_be():
    squares = []
    for seed in range(30):
        once, again, _ = smoothed(seed)
        squares.append([e @ np.linalg.solve(P, e) for e, P in map(tilts, (once, again))])
    # Sums of 60 squares: within the bounds of 99.8 %, which one pass exceeds.
    one, two = np.sum(squares, axis=0)
    low, high = chi2.ppf([0.001, 0.999], 60)
    assert low < two < high < one


@pytest.mark.parametrize("passes", [0, 101, 2.0, "two"])
def test_a_number_of_passes_is_a_small_whole_number(passes):
    with pytest.raises(ConfigError, check=coded("navigation.smoother-passes")):
        RauchTungStriebel(passes=passes)


@pytest.mark.parametrize("mechanization", [NorthEastDown(), WanderAzimuth()])
@pytest.mark.parametrize("form", ["joseph", "ud", "wd"])
def test_the_compiled_loop_of_a_pass_is_its_reference_engine(monkeypatch, mechanization, form):
    chain, imu, tables = started(1, 1.0)
    filter_ = replace(chain.navigator.filter, form=COVARIANCES[form](), mechanization=mechanization)
    chain = replace(chain, navigator=replace(chain.navigator, filter=filter_))
    run = run_batch(chain, imu, tables, IntervalRecorder(rate_hz=5.0))
    followed = []
    follow = ReferenceEngine.follow

    def counted(engine, *reference):
        followed.append(engine.time)
        follow(engine, *reference)

    monkeypatch.setattr(ReferenceEngine, "follow", counted)
    compiled = relinearized(chain, imu, tables, IntervalRecorder(rate_hz=5.0), run).smoothed
    assert not followed
    monkeypatch.setattr(Navigator, "lone_receiver", None)
    asked = relinearized(chain, imu, tables, IntervalRecorder(rate_hz=5.0), run).smoothed
    assert len(followed) > 80
    # Both sum the same rows, each of which adds a rounding of the filter's covariance: in units of
    # the smoothed one, which is what is left of it, and by the condition of what is inverted.
    sd = np.hstack([np.sqrt(np.diagonal(asked.covariance, axis1=1, axis2=2)), asked.sensors_sd])
    wide = np.hstack(
        [np.sqrt(np.diagonal(run.record.covariance, axis1=1, axis2=2)), run.record.sensors_sd]
    )
    correlation = run.record.covariance / (wide[:, :9, None] * wide[:, None, :9])
    rows = 90 * (10 + 2 * 2 + 1)
    bound = np.finfo(float).eps * rows * np.linalg.cond(correlation).max()
    bound *= np.square(wide / sd).max()
    assert bound < 1e-4
    off = (compiled.sensors - asked.sensors) / asked.sensors_sd
    assert np.abs(off.to_numpy()).max() < bound
    assert np.abs(compiled.sensors_sd / asked.sensors_sd - 1.0).to_numpy().max() < bound
    at = asked.trajectory.index.searchsorted(asked.sd.index).clip(max=len(asked.trajectory) - 1)
    apart = (compiled.trajectory - asked.trajectory)[VELOCITY].to_numpy()[at] / sd[:, 3:6]
    assert np.abs(apart).max() < bound


def on_disk_of(array):
    """Whether an array is of a file."""
    while isinstance(array, np.ndarray):
        array = array.base
    return isinstance(array, mmap.mmap)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems keep arrays in memory")
def test_what_a_run_keeps_is_on_the_disk_and_made_part_by_part(monkeypatch):
    chain, imu, tables = started(1, 1.0)
    recorder = IntervalRecorder(rate_hz=5.0)
    run = run_batch(chain, imu, tables, recorder)
    whole = relinearized(chain, imu, tables, recorder, run)
    # Every array, and a few rows at a time.
    monkeypatch.setattr(on_disk, "LARGE", 1)
    monkeypatch.setattr(on_disk, "PART", 8 * 81 * 7)
    run = run_batch(chain, imu, tables, recorder)
    parts = relinearized(chain, imu, tables, recorder, run)
    for one, other in ((whole.record, parts.record), (whole.smoothed, parts.smoothed)):
        np.testing.assert_array_equal(other.covariance, one.covariance)
        assert on_disk_of(other.covariance)
        for name in ("trajectory", "sd", "sensors", "sensors_sd"):
            found, wanted = getattr(other, name), getattr(one, name)
            pd.testing.assert_frame_equal(found, wanted, check_exact=True)
            assert on_disk_of(found.to_numpy()), name
    found, wanted = parts.smoothing.reference(), whole.smoothing.reference()
    for name in ("time", "states", "sensors", "marks"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name))
    assert on_disk_of(found.states)
    assert on_disk_of(found.sensors)
    assert smoother_consistency(parts.record, parts.smoothed).rms.tolist() == (
        smoother_consistency(whole.record, whole.smoothed).rms.tolist()
    )
