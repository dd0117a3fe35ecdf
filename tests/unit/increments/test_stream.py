"""Increments of pieces are those of the whole, to the last bit."""

from itertools import pairwise

import numpy as np
import pytest

from strapdown.errors import ConfigError
from strapdown.increments import IncrementStream, motion_increments
from strapdown.tables import ACCEL, GYRO, imu_table


def log(sampling):
    """A shaken body; stamps with jitter, a lost sample, a gap and a burst."""
    rng, n = np.random.default_rng(5), 400
    time = np.cumsum(rng.uniform(0.9e-2, 1.1e-2, n))
    time[100:] += 0.012
    time[200:] += 0.31
    time[300:] -= 0.9 * (time[300] - time[299])
    gyro, accel = rng.normal(0.0, 1.0, (n, 3)), rng.normal(0.0, 5.0, (n, 3))
    return imu_table(time, gyro, accel, sampling=sampling)


def streamed(stream, imu, cuts):
    time, values = imu.index.to_numpy(), imu[[*GYRO, *ACCEL]].to_numpy()
    state = stream.begin(imu.attrs["sampling"])
    ends, rows = [], []
    edges = [0, *cuts, len(time)]
    for first, end in pairwise(edges):
        last = end == len(time)
        state, at, made = stream.advance(state, time[first:end], values[first:end], last)
        ends.append(at)
        rows.append(made)
    return np.concatenate(ends), np.concatenate(rows)


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
@pytest.mark.parametrize(
    "cuts",
    [
        [],
        [1, 2, 3],
        [100, 101, 200, 201, 300],
        list(range(1, 400)),
        [0, 0, 5, 5, 400],
    ],
    ids=["whole", "start", "at the gaps", "by sample", "empty pieces"],
)
def test_cut_anywhere_as_the_whole(sampling, interpolation, cuts):
    imu = log(sampling)
    whole = motion_increments(imu, interpolation=interpolation)
    ends, rows = streamed(IncrementStream(interpolation), imu, cuts)
    np.testing.assert_array_equal(ends, whole.index.to_numpy())
    np.testing.assert_array_equal(rows, whole.to_numpy())


def test_a_line_gives_each_step_with_its_sample_and_a_cubic_one_later():
    imu = log("instantaneous").iloc[:4]
    time, values = imu.index.to_numpy(), imu[[*GYRO, *ACCEL]].to_numpy()
    for interpolation, late in (("linear", 0), ("cubic", 1)):
        stream = IncrementStream(interpolation)
        state, ends, _ = stream.advance(stream.begin(), time, values)
        np.testing.assert_array_equal(ends, time[1 : len(time) - late])
        _, ends, _ = stream.advance(state, time[:0], values[:0], last=True)
        np.testing.assert_array_equal(ends, time[len(time) - late :])


def test_an_unknown_interpolation_is_refused():
    with pytest.raises(ConfigError, match="constant"):
        IncrementStream("constant")
