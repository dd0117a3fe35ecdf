"""From samples to steps: what is refused, how stamps survive a pre-filter, how holes are filled."""

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.increments import motion_increments
from strapdown.navigation.preprocessing import ImuPreprocessor
from strapdown.prefilter import PREFILTERS, RobustFir, Summed
from strapdown.rotation import dcm_from_euler
from strapdown.tables import imu_table

RNG = np.random.default_rng(8)


def samples(n=1000, step=0.002, start=50.0):
    time = start + step * np.arange(n)
    values = np.r_[0.1, -0.2, 0.05, 0.3, 0.2, -9.8] + 0.01 * np.random.default_rng(8).normal(
        size=(n, 6)
    )
    return time, values


def steps_of(intake, time, values, sampling="instantaneous"):
    state, steps = intake.advance(intake.begin(sampling, "log.csv"), time, values, last=True)
    return steps, state


def test_without_a_prefilter_steps_are_the_motion_increments():
    time, values = samples()
    steps, _ = steps_of(ImuPreprocessor(), time, values)
    table = motion_increments(imu_table(time, values[:, :3], values[:, 3:]))
    np.testing.assert_array_equal(steps.rows, table.to_numpy())
    np.testing.assert_array_equal(steps.time, time[1:])
    np.testing.assert_array_equal(steps.values, values[1:])
    assert steps.opening[0] == time[0] and (steps.opening[1] == values[0]).all()


def test_axes_turn_both_triads():
    time, values = samples()
    gyro, accel = dcm_from_euler([0.0, 0.0, 90.0]), dcm_from_euler([180.0, 0.0, 0.0])
    steps, _ = steps_of(ImuPreprocessor(gyro, accel), time, values)
    np.testing.assert_allclose(steps.values[:, :3], values[1:, :3] @ gyro.T, atol=1e-15)
    np.testing.assert_allclose(steps.values[:, 3:], values[1:, 3:] @ accel.T, atol=1e-14)


@pytest.mark.parametrize("name", PREFILTERS)
@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
def test_a_prefilter_within_a_chain_is_the_prefilter(name, sampling):
    time, values = samples()
    module = PREFILTERS[name]() if name == "none" else PREFILTERS[name](rate=100.0)
    steps, _ = steps_of(ImuPreprocessor(prefilter=module), time, values, sampling)
    whole = module.apply(imu_table(time, values[:, :3], values[:, 3:], sampling=sampling))
    # Stamps here are those of the samples, there those of an even grid: to rounding the same, and
    # so are the steps.
    np.testing.assert_allclose(steps.time[-50:], whole.increments.index[-50:], atol=1e-9)
    np.testing.assert_allclose(
        steps.rows[-50:], whole.increments.to_numpy()[-50:], rtol=1e-9, atol=1e-12
    )
    count = len(whole.increments)
    assert len(steps.rows) == count


def test_stamps_that_drift_against_their_grid_are_kept():
    # 1e-3 of the step each: after 1000 samples the clock is a step off what 64 of them told.
    n = 2000
    time = 50.0 + np.cumsum(0.002 * (1.0 + 1e-3 * np.arange(n) / n))
    values = samples(n)[1]
    for module in (RobustFir(rate=100.0), Summed(rate=100.0)):
        steps, _ = steps_of(ImuPreprocessor(prefilter=module), time, values)
        assert np.isin(steps.time, time).all()
        gone = steps.time[-1] - steps.time[0]
        assert gone == pytest.approx(5.0 * 0.002 * (len(steps.time) - 1), rel=2e-3)


def test_lost_samples_before_a_prefilter_lie_on_a_line():
    time, values = samples()
    lost = slice(400, 404)
    there = np.r_[time[:400], time[404:]]
    filled = values.copy()
    for k in range(6):
        filled[lost, k] = np.interp(time[lost], there, np.r_[values[:400, k], values[404:, k]])
    module = RobustFir(rate=100.0)
    steps, _ = steps_of(
        ImuPreprocessor(prefilter=module), there, np.vstack([values[:400], values[404:]])
    )
    expected, _ = steps_of(ImuPreprocessor(prefilter=module), time, filled)
    np.testing.assert_allclose(steps.values, expected.values, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(steps.time, expected.time, atol=1e-12)
    (hole,) = steps.holes
    assert (hole.begin, hole.end) == (time[399], time[404]) and not expected.holes


@pytest.mark.parametrize("cut", [None, 500])
def test_what_cannot_be_is_named_with_its_row(cut):
    def fed(time, values):
        intake, first = ImuPreprocessor(), cut or len(time)
        state, _ = intake.advance(intake.begin(source="log.csv"), time[:first], values[:first])
        intake.advance(state, time[first:], values[first:])

    time, values = samples()
    values[600, 4] = np.nan
    with pytest.raises(
        DataError,
        check=coded(
            "navigation.values-time", row=601, file="log.csv", quantity="accel_y", time=51.2
        ),
    ):
        fed(time, values)
    time, values = samples()
    time[600] = time[599]
    with pytest.raises(DataError, match=r"log.csv, row 601.*51.198 s is followed by 51.198 s"):
        fed(time, values)
    time, values = samples()
    time[500] = 3.0
    with pytest.raises(
        DataError, check=coded("navigation.time-decreases", row=501, file="log.csv")
    ):
        fed(time, values)
    time, values = samples()
    time[600] = np.nan
    with pytest.raises(
        DataError,
        check=coded("navigation.not-finite-number", row=601, file="log.csv", quantity="time"),
    ):
        fed(time, values)


def test_one_sample_and_uneven_stamps_are_refused():
    time, values = samples()
    with pytest.raises(DataError, match="1 sample"):
        steps_of(ImuPreprocessor(), time[:1], values[:1])
    rng = np.random.default_rng(1)
    uneven = np.cumsum(rng.uniform(0.001, 0.003, len(time)))
    with pytest.raises(
        DataError, check=coded("navigation.prefilter-needs-even-stamps", file="log.csv")
    ):
        steps_of(ImuPreprocessor(prefilter=RobustFir()), uneven, values)
    time[700:] -= 0.0015
    with pytest.raises(
        DataError, check=coded("navigation.samples-uneven", stamps=51.398, stamps_2=51.3985)
    ):
        steps_of(ImuPreprocessor(prefilter=RobustFir(rate=100.0)), time, values)
