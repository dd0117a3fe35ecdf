"""What every error model promises, held for every entry of the table."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))

from strapdown.errors import ConfigError
from strapdown.estimation.error_model import ERROR_MODELS
from strapdown.estimation.sensor_blocks import ERRORS_OF_SENSORS
from strapdown.mechanization.wander_azimuth import WanderAzimuth
from wander_runs import history_of, made_up, segment_of, start

# All blocks that there are, each with a standard deviation of its own.
BLOCKS = tuple(
    make(1e-4, 60.0) if name.endswith("drift") else make(1e-4)
    for name, make in ERRORS_OF_SENSORS.items()
)
NOISE = {"gyro_noise": (1e-5, 2e-5, 3e-5), "accel_noise": (1e-3, 2e-3, 3e-3), "sensors": BLOCKS}
# m, m/s, rad, and the sensors'.
SIZE = np.concatenate(
    [np.repeat([100.0, 0.1, 1e-4], 3), np.full(sum(len(b.block) for b in BLOCKS), 1e-4)]
)


@pytest.fixture(scope="module")
def segment():
    mechanization = WanderAzimuth()
    begin = mechanization.begin(start(60.0, 100.0, (30.0, 5.0, 0.0)))
    rows = made_up(begin[8:12], 2.0, 0.02)
    return segment_of(mechanization, history_of(mechanization, begin, rows), rows)


def physical(model, segment, step, first=0, last=None):
    """T Phi E and T Q T' from one row to another."""
    used, rows = segment.mechanization, segment.increments[first:last]
    history = segment.history[first : first + len(rows) + 1]
    part = segment_of(used, history, rows, segment.time[first])
    Phi, Q = model.transition(part, step)
    T = model.to_physical(used, part.time[-1], history[-1])
    return T @ Phi @ model.from_physical(used, part.time[0], history[0]), T @ Q @ T.T


@pytest.mark.parametrize("name", list(ERROR_MODELS))
def test_it_says_what_it_is(name):
    model = ERROR_MODELS[name](**NOISE)
    assert model.name == name
    assert model.summary
    assert model.source
    assert model.layout.size == sum(len(b) for b in model.core) + len(SIZE) - 9
    assert model.physical_size == len(SIZE)
    assert len(list(model.layout.labels())) == model.layout.size


@pytest.mark.parametrize("name", list(ERROR_MODELS))
def test_states_of_physical_errors_tell_these_errors(name, segment):
    model = ERROR_MODELS[name](**NOISE)
    used, time, row = segment.mechanization, segment.time[3], segment.history[3]
    both = model.to_physical(used, time, row) @ model.from_physical(used, time, row)
    expected = np.eye(len(SIZE))
    if not model.has_height:
        expected[2, 2] = 0.0
    np.testing.assert_allclose(both * SIZE / SIZE[:, None], expected, atol=1e-9)


@pytest.mark.parametrize("height", ["free", "held"])
@pytest.mark.parametrize("name", list(ERROR_MODELS))
def test_what_it_estimates_is_what_its_states_can_hold(name, height):
    model, used = ERROR_MODELS[name](**NOISE), WanderAzimuth(height=height)
    row = used.history_row(used.begin(start(60.0, 100.0, (30.0, 5.0, 0.0))))
    both = model.to_physical(used, 3.0, row) @ model.from_physical(used, 3.0, row)
    # An error that has no state is lost on the way: one by one, whatever the size of a variance.
    np.testing.assert_allclose(np.diag(both)[:9], model.estimated(used), atol=1e-9)
    assert all(model.estimated(used)) == model.has_height


@pytest.mark.parametrize("name", list(ERROR_MODELS))
def test_noise_is_a_covariance_and_grows(name, segment):
    model = ERROR_MODELS[name](**NOISE)
    _, Q = model.transition(segment, 0.1)
    np.testing.assert_array_equal(Q, Q.T)
    sd = np.sqrt(np.diag(Q)) + (np.diag(Q) == 0.0)
    assert np.linalg.eigvalsh(Q / np.outer(sd, sd)).min() > -1e-12
    half = physical(model, segment, 0.1, 0, 50)[1]
    whole = physical(model, segment, 0.1)[1]
    moved = [0, 1, *range(3, 9)]
    assert (np.diag(whole)[moved] > 1.5 * np.diag(half)[moved]).all()


@pytest.mark.parametrize("cut", [5, 50, 95])
@pytest.mark.parametrize("name", list(ERROR_MODELS))
def test_a_segment_cut_between_groups_gives_the_same(name, cut, segment):
    model = ERROR_MODELS[name](**NOISE)
    Phi, Q = physical(model, segment, 0.1)
    Phi1, Q1 = physical(model, segment, 0.1, 0, cut)
    Phi2, Q2 = physical(model, segment, 0.1, cut)
    scale = SIZE / SIZE[:, None]
    np.testing.assert_allclose(Phi2 @ Phi1 * scale, Phi * scale, atol=1e-9)
    np.testing.assert_allclose(
        (Phi2 @ Q1 @ Phi2.T + Q2) / np.outer(SIZE, SIZE), Q / np.outer(SIZE, SIZE), atol=1e-9
    )


@pytest.mark.parametrize("name", list(ERROR_MODELS))
def test_a_height_that_is_damped_is_refused(name, segment):
    used = WanderAzimuth(height="damped")
    part = segment_of(used, segment.history, segment.increments)
    with pytest.raises(ConfigError, match="held"):
        ERROR_MODELS[name]().transition(part, 0.1)
