"""The 17-state model against the mechanization itself, and what is nothing physical in it."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))

from strapdown import rotation
from strapdown._kernels.compensation import compensate
from strapdown.ellipsoids import WGS84
from strapdown.errors import ConfigError
from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.error_model import QuaternionModel
from strapdown.estimation.sensor_blocks import (
    accel_bias,
    accel_misalignment,
    accel_scale,
    g_sensitivity,
    gauss_markov,
    gyro_bias,
    gyro_misalignment,
    gyro_scale,
    lever_arm,
)
from strapdown.estimation.sensor_states import stack
from strapdown.frames import C_ne
from strapdown.mechanization.mechanization import state_error
from strapdown.mechanization.ned import NorthEastDown
from strapdown.mechanization.wander_azimuth import WanderAzimuth
from wander_runs import (
    dcm,
    history_of,
    made_up,
    physical_error,
    rocking,
    segment_of,
    start,
    still,
    weaving,
)

# Perturbations: m, m/s, rad.
SIZE = np.repeat([100.0, 0.1, 1e-4], 3)


def run(mechanization, begin, rows):
    return history_of(mechanization, begin, rows)


def perturbed(mechanization, begin, rows, error):
    """Error at the end after an error at the start: the odd part, so of the third order."""
    base = run(mechanization, begin, rows)[-1]
    plus, minus = (
        physical_error(
            run(mechanization, mechanization.correct(begin, -sign * error), rows)[-1], base, WGS84
        )
        for sign in (1.0, -1.0)
    )
    return 0.5 * (plus - minus)


def mapped(model, segment, step):
    """T Phi E."""
    used, time, history = segment.mechanization, segment.time, segment.history
    Phi, _ = model.transition(segment, step)
    T = model.to_physical(used, time[-1], history[-1])
    return T @ Phi @ model.from_physical(used, time[0], history[0])


def held_back(model, mechanization, row, time=7000.0):
    """T E: what of physical errors the states can tell."""
    return model.to_physical(mechanization, time, row) @ model.from_physical(
        mechanization, time, row
    )


# Place, height, motion; over the pole at 150 m/s within the run.
CASES = {
    "rocking": (52.0, 200.0, rocking, weaving),
    "high, south": (-40.0, 9000.0, rocking, weaving),
    "still attitude": (0.0, 0.0, still, weaving),
    "at the pole": (89.9999, 200.0, rocking, weaving),
    "spinning": (70.0, 0.0, lambda t: np.array([0.1, 0.0, 2.0]), still),
}


@pytest.mark.slow
@pytest.mark.parametrize("height", ["held", "free"])
@pytest.mark.parametrize("case", list(CASES))
def test_transition_is_the_derivative_of_the_mechanization(case, height):
    lat, alt, rate, acceleration = CASES[case]
    mechanization = WanderAzimuth(height=height)
    begin = mechanization.begin(start(lat, alt))
    rows = made_up(begin[8:12], 12.0, 0.02, rate, acceleration)
    model = QuaternionModel()
    segment = segment_of(mechanization, run(mechanization, begin, rows), rows)
    can_tell = held_back(model, mechanization, segment.history[0])
    fine = mapped(model, segment, 0.02)
    for j in range(9):
        error = can_tell[:, j] * SIZE[j]
        expected = perturbed(mechanization, begin, rows, error)
        off = np.abs(fine @ error - expected) / SIZE
        if height == "held":
            # The square of 1e-4 rad and of 100 m over a radius, in tilts that have grown to 0.01
            # m/s: 1e-9 of 0.1 m/s; means over 0.02 s of rates of 0.4 rad/s: 5e-6 of how the
            # force turns, 1e-2 m/s², and of what else it does, hence a few of 1e-9. Rounding: 1e-9
            # of 100 m.
            assert off.max() < 2e-8
        else:
            # It has no height, which a vertical velocity v changes by h = v t. Gravity falls by
            # 3e-6 per s² of it: v is off by its half v t², 2.2e-4 of v. Its direction turns by up
            # to 8e-9 per s² of it: 6e-8 m/s. The level turns by V h / R too fast: V t h / 2 R,
            # 1.7e-4 m.
            assert off[[0, 1]].max() < 2e-6
            assert off[[3, 4]].max() < 1e-6
            assert off[5] < 3e-4
            assert off[6:].max() < 1e-11


@pytest.mark.parametrize("case", ["rocking", "spinning"])
def test_what_the_means_lose_falls_with_the_square_of_the_step(case):
    lat, alt, rate, acceleration = CASES[case]
    mechanization = WanderAzimuth(height="held")
    begin = mechanization.begin(start(lat, alt))
    rows = made_up(begin[8:12], 12.8, 0.01, rate, acceleration)
    blocks = (gyro_bias(1.0), accel_bias(1.0))
    model = QuaternionModel(sensors=blocks)
    segment = segment_of(mechanization, run(mechanization, begin, rows), rows)
    exact = mapped(model, segment, 0.01)
    size = np.concatenate([SIZE, np.repeat([1e-6, 1e-3], 3)])
    steps = np.array([0.8, 0.4, 0.2, 0.1])
    lost = [
        np.abs((mapped(model, segment, s) - exact)[:9] * size / SIZE[:, None]).max() for s in steps
    ]
    order = np.polyfit(np.log(steps), np.log(lost), 1)[0]
    assert 1.8 < order < 2.2


def test_error_of_the_derivative_falls_with_the_square_of_the_perturbation():
    mechanization = WanderAzimuth(height="held")
    begin = mechanization.begin(start())
    rows = made_up(begin[8:12], 12.0, 0.02)
    model = QuaternionModel()
    segment = segment_of(mechanization, run(mechanization, begin, rows), rows)
    linear = mapped(model, segment, 0.02)
    can_tell = held_back(model, mechanization, segment.history[0])
    error = can_tell @ np.repeat([1e4, 1.0, 1e-2], 3)
    off = [
        np.linalg.norm((perturbed(mechanization, begin, rows, s * error) / s - linear @ error)[:2])
        for s in (1.0, 0.5, 0.25)
    ]
    # The odd part is taken: what is left is of the third order, so of the second of the ratio.
    np.testing.assert_allclose(np.array(off[:-1]) / off[1:], 4.0, rtol=0.02)


SENSORS = (
    gyro_bias(1.0),
    accel_bias(1.0),
    gyro_scale(1.0),
    accel_scale(1.0),
    gyro_misalignment(1.0),
    accel_misalignment(1.0),
    g_sensitivity(1.0),
    lever_arm(1.0),
)


@pytest.mark.parametrize("case", ["rocking", "at the pole"])
def test_sensors_act_as_in_the_mechanization(case):
    lat, alt, rate, acceleration = CASES[case]
    mechanization = WanderAzimuth(height="held")
    begin = mechanization.begin(start(lat, alt))
    rows = made_up(begin[8:12], 12.0, 0.02, rate, acceleration)
    model = QuaternionModel(sensors=SENSORS)
    history = run(mechanization, begin, rows)
    segment = segment_of(mechanization, history, rows)
    ours = mapped(model, segment, 0.02)[:9, 9:]
    k = ours.shape[1]
    gyro, accel, *_ = stack(SENSORS)
    ends = {}
    for sign in (1.0, -1.0):
        for j in range(k):
            states, wrong = np.zeros(k), np.empty_like(rows)
            # So small that tilts stay under 1e-4; taken off with the other sign, it is put on.
            states[j] = -sign * 1e-6
            compensate(rows, gyro @ states, accel @ states, wrong)
            ends[j, sign] = physical_error(run(mechanization, begin, wrong)[-1], history[-1], WGS84)
    found = np.stack([(ends[j, 1.0] - ends[j, -1.0]) / 2e-6 for j in range(k)], axis=1)
    # Means over h = 0.02 s leave out of a product, as of attitude and rate, h²/12 of what both
    # change in a second (0.4, and 1 of itself): 1e-5. The height is held: rounding.
    size = np.maximum(np.abs(found).max(axis=1, keepdims=True), 10.0)
    moved = [0, 1, 3, 4, 5, 6, 7, 8]
    np.testing.assert_allclose((ours / size)[moved], (found / size)[moved], atol=1e-5)
    np.testing.assert_allclose((ours - found)[2], 0.0, atol=0.01)
    assert np.abs(found[:2, :-3]).max(axis=0).min() > 1.0
    assert not found[:, -3:].any()


@pytest.mark.parametrize("lat", [-40.0, 52.0, 89.9999, 90.0])
def test_components_and_physical_errors_are_those_of_two_states(lat):
    mechanization = WanderAzimuth()
    begin = mechanization.begin(start(lat, 9000.0, (60.0, -150.0, 20.0)))
    row = mechanization.history_row(begin)
    model, time = QuaternionModel(), 4.0e5
    E = model.from_physical(mechanization, time, row)
    T = model.to_physical(mechanization, time, row)
    error = np.array([40.0, -70.0, 0.0, 0.2, 0.3, -0.1, 2e-4, -1e-4, 3e-4])
    off = []
    for size in (1.0, 0.5):
        other = mechanization.history_row(mechanization.correct(begin, size * error))
        half = 0.5 * WGS84.rotation_rate * time
        turn = [np.cos(half), 0.0, 0.0, np.sin(half)]
        q0, q0_other = (
            rotation.compose(turn, rotation.compose(r[:4], r[8:12])) for r in (row, other)
        )
        x = np.concatenate([row[5:8] - other[5:8], q0 - q0_other, row[:4] - other[:4]])
        found = physical_error(row, other, WGS84)
        off.append(
            [
                np.abs((T @ x - found) / SIZE)[[0, 1, 3, 4, 5, 6, 7, 8]].max(),
                np.abs(x - E @ (size * error)).max(),
            ]
        )
    off = np.array(off)
    # Second order: quarters when the error is halved.
    assert off[0].max() < 1e-3
    np.testing.assert_allclose(off[0] / off[1], 4.0, rtol=0.01)


def test_physical_errors_of_rows_are_those_of_states():
    mechanization = WanderAzimuth()
    begin = mechanization.begin(start())
    error = np.array([30.0, -20.0, 5.0, 0.2, 0.3, -0.1, 2e-4, -1e-4, 3e-4])
    other = mechanization.correct(begin, error)
    states = [mechanization.nav_state(s, 0.0) for s in (begin, other)]
    turn = dcm(begin[:4]).T @ C_ne(*np.degrees([states[0].lat, states[0].lon])).T
    expected = np.concatenate([turn @ part for part in state_error(*states).reshape(3, 3)])
    np.testing.assert_allclose(physical_error(begin, other, WGS84), expected, atol=5e-9)


@pytest.mark.parametrize("height", ["free", "held"])
def test_there_and_back_is_one_but_for_the_height(height):
    mechanization = WanderAzimuth(height=height)
    v_n = (60.0, -150.0, 0.0)
    row = mechanization.history_row(mechanization.begin(start(80.0, 3000.0, v_n)))
    model = QuaternionModel(sensors=SENSORS)
    both = held_back(model, mechanization, row)
    expected = np.eye(model.physical_size)
    expected[2, 2] = 0.0
    if height == "held":
        # The vertical velocity is known; as a vector it still turns with the level.
        assert np.linalg.matrix_rank(both) == model.physical_size - 2
        both, expected = np.delete(both, 5, 0), np.delete(expected, 5, 0)
    # Rounding of 1e-16 against displacements over a radius.
    size = np.concatenate([SIZE, np.ones(model.physical_size - 9)])
    keep = np.delete(size, 5) if height == "held" else size
    np.testing.assert_allclose(
        both * size / keep[:, None], expected * size / keep[:, None], atol=1e-9
    )


def variances(P, model, segment, at):
    """Of the two norms, and of the turn of the level axes about zeta, with their scale."""
    row = segment.history[at]
    T = model.to_physical(segment.mechanization, segment.time[at], row)
    null = model.null_directions(segment.mechanization, segment.time[at], row)
    q0, q1 = null[0], null[1]
    about = np.zeros(len(q0))
    # 2 conj(q1) (x) dq1, third component of the vector.
    w, x, y, z = row[:4]
    about[7:11] = 2.0 * np.array([-z, y, -x, w])
    functionals = np.stack([2.0 * q0, 2.0 * q1, about])
    return np.abs(functionals @ P).max(), np.sqrt(np.diag(P)[:11].max()), T @ null.T


@pytest.mark.parametrize("form", ["joseph", "ud", "wd"])
def test_what_is_nothing_physical_stays_zero(form):
    mechanization = WanderAzimuth()
    begin = mechanization.begin(start(84.0, 500.0, (60.0, -150.0, 3.0)))
    rows = made_up(begin[8:12], 120.0, 0.05)
    sensors = (gauss_markov(gyro_bias(1e-6), 100.0), accel_bias(1e-3))
    model = QuaternionModel((1e-5,) * 3, (1e-3,) * 3, sensors)
    whole = segment_of(mechanization, run(mechanization, begin, rows), rows)
    covariance = COVARIANCES[form]()
    E = model.from_physical(mechanization, whole.time[0], whole.history[0])
    sd = np.concatenate([[10.0] * 3, [0.1] * 3, [1e-3] * 3, [1e-6] * 3, [1e-3] * 3])
    P = E @ np.diag(sd**2) @ E.T
    state = covariance.begin(0.5 * (P + P.T))
    x = np.zeros(model.layout.size)
    rng = np.random.default_rng(1)
    for at in range(0, len(rows), 20):
        part = segment_of(
            mechanization, whole.history[at : at + 21], rows[at : at + 20], whole.time[at]
        )
        Phi, Q = model.transition(part, 0.2)
        state, x = covariance.predict(state, Phi, Q), Phi @ x
        T = model.to_physical(mechanization, part.time[-1], part.history[-1])
        H = T[[0, 1, 3, 4, 5]]
        z = rng.normal(0.0, [3.0, 3.0, 0.1, 0.1, 0.1])
        state, x, _ = covariance.update(state, x, z, H, np.array([9.0, 9.0, 0.01, 0.01, 0.01]))
    P = covariance.matrix(state)
    seen, scale, tells = variances(P, model, whole, -1)
    # Rounding of P: 1e-16 of its largest parts, of a hundred predictions.
    assert seen < 1e-13 * scale**2
    null = model.null_directions(mechanization, whole.time[-1], whole.history[-1])
    assert abs(null[0] @ x) < 1e-13
    assert abs(null[1] @ x) < 1e-13
    # T tells nothing of them: rounding times the radius of the Earth, and speed.
    assert np.abs(tells[:3]).max() < 1e-8
    assert np.abs(tells[3:]).max() < 1e-12
    # All else is there: 17 states less three.
    inner = np.linalg.eigvalsh(scaled(P))
    assert (inner > 1e-12).sum() == 14


def scaled(P):
    """Correlations; what has no variance stays zero."""
    sd = np.sqrt(np.diag(P))
    return P / np.outer(sd, sd)


def test_norms_stay_and_the_turn_about_zeta_is_nothing():
    mechanization = WanderAzimuth()
    begin = mechanization.begin(start(84.0, 500.0, (60.0, -150.0, 3.0)))
    rows = made_up(begin[8:12], 30.0, 0.02)
    model = QuaternionModel(sensors=(gyro_bias(1.0), accel_bias(1.0)))
    segment = segment_of(mechanization, run(mechanization, begin, rows), rows)
    before, after = (
        model.null_directions(mechanization, segment.time[at], segment.history[at])
        for at in (0, -1)
    )
    lost = []
    for step in (0.8, 0.4, 0.2):
        Phi, _ = model.transition(segment, step)
        # Rounding: velocities of g t, 300 m/s, cancel.
        np.testing.assert_allclose(Phi @ before[0], after[0], atol=1e-13)
        np.testing.assert_allclose(Phi @ before[1], after[1], atol=1e-13)
        # Velocities of 150 m/s that turn by 1 rad would change by 150 m/s.
        T = model.to_physical(mechanization, segment.time[-1], segment.history[-1])
        lost.append(np.abs(T @ Phi @ before[2])[3:6].max())
    assert lost[-1] < 8e-3
    # All that is left is what the means of a group lose, while it is more than increments do.
    np.testing.assert_allclose(np.array(lost[:-1]) / lost[1:], 4.0, rtol=0.1)


@pytest.mark.parametrize("cut", [1, 250, 599])
def test_a_segment_cut_between_groups_gives_the_same(cut):
    mechanization = WanderAzimuth(height="held")
    begin = mechanization.begin(start())
    rows = made_up(begin[8:12], 6.0, 0.01)
    model = QuaternionModel((1e-5,) * 3, (1e-3,) * 3, (gyro_bias(1.0), accel_bias(1.0)))
    whole = segment_of(mechanization, run(mechanization, begin, rows), rows)
    first = segment_of(mechanization, whole.history[: cut + 1], rows[:cut])
    second = segment_of(mechanization, whole.history[cut:], rows[cut:], whole.time[cut])
    Phi, Q = model.transition(whole, 0.01)
    Phi1, Q1 = model.transition(first, 0.01)
    Phi2, Q2 = model.transition(second, 0.01)
    # Rounding; and the turn about zeta, which is taken out twice.
    T = model.to_physical(mechanization, whole.time[-1], whole.history[-1])
    E = model.from_physical(mechanization, whole.time[0], whole.history[0])
    size = np.concatenate([SIZE, np.repeat([1e-6, 1e-3], 3)])
    one, two = T @ Phi @ E * size / size[:, None], T @ Phi2 @ Phi1 @ E * size / size[:, None]
    np.testing.assert_allclose(two, one, atol=1e-9)
    np.testing.assert_allclose(Phi2 @ Q1 @ Phi2.T + Q2, Q, atol=1e-12 * np.abs(Q).max())


@pytest.mark.parametrize(
    ("mechanization", "said"),
    [
        (NorthEastDown(), "wander_azimuth"),
        (WanderAzimuth(height="damped"), "held"),
    ],
)
def test_what_it_is_no_model_of_is_refused(mechanization, said):
    model = QuaternionModel()
    row = np.zeros(mechanization.row)
    with pytest.raises(ConfigError, match=said):
        model.to_physical(mechanization, 0.0, row)
    with pytest.raises(ConfigError, match=said):
        model.from_physical(mechanization, 0.0, row)
    with pytest.raises(ConfigError, match=said):
        model.transition(segment_of(mechanization, row[None], np.zeros((0, 10))), 0.1)


@pytest.mark.slow
def test_with_a_held_height_the_vertical_velocity_is_known():
    mechanization = WanderAzimuth(height="held")
    begin = mechanization.begin(start())
    rows = made_up(begin[8:12], 2.0, 0.02)
    model = QuaternionModel((1e-5,) * 3, (1e-3,) * 3, (accel_bias(1e-3),))
    segment = segment_of(mechanization, run(mechanization, begin, rows), rows)
    Phi, Q = model.transition(segment, 0.1)
    # As in the mechanization, whatever it was before.
    assert not Phi[2].any()
    assert not Phi[:, 2].any()
    assert not Q[2].any()


def test_states_of_the_paper():
    model = QuaternionModel(sensors=(gyro_bias(1.0), accel_bias(1.0)))
    assert model.layout.size == 17
    assert model.physical_size == 15
    assert list(model.layout.labels())[:4] == [
        "velocity_xi",
        "velocity_eta",
        "velocity_zeta",
        "q_ib_w",
    ]
