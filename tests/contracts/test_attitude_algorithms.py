"""What every attitude algorithm promises, held for every entry of the table."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown import rotation
from strapdown.attitude_algorithms import ALGORITHMS, AttitudeTracker, make_algorithm, run_attitude
from strapdown.errors import ConfigError, DataError, DivergenceError
from strapdown.increments import increments_from_imu
from strapdown.tables import QUATERNION, imu_table, increments_table

#: Every entry of the table, and options that change the path through a kernel.
VARIANTS = [
    *ALGORITHMS,
    "euler:step=rk4",
    "dcm:order=1",
    "dcm:order=3,orthogonalise_every=7",
    "dcm:orthogonalise_every=1",
    "quaternion:order=1",
    "quaternion:order=3,normalise=false",
    "quaternion:normalise=false",
    "rk4:normalise=false",
    "rotvec:samples=1",
    "rotvec:samples=1,previous=yes",
    "rotvec:samples=3",
    "rotvec:samples=4",
    "rotvec:samples=4,coefficients=miller",
    "rotvec:samples=4,coefficients=fit",
]
START = rotation.quaternion_from_euler([20.0, -35.0, 250.0])


def shaken_log(sampling: str, samples: int = 400):
    """Irregular in time, bursts and pauses among it, and never twice about the same axis."""
    rng = np.random.default_rng(5)
    time = np.cumsum(rng.choice([0.001, 0.004, 0.01, 0.08], samples)) + 17.0
    return imu_table(time, rng.normal(0.0, 2.0, (samples, 3)), sampling=sampling)


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
@pytest.mark.parametrize("variant", VARIANTS)
def test_sample_by_sample_gives_the_bits_of_the_batch(variant, sampling):
    algorithm, log = make_algorithm(variant), shaken_log(sampling)
    batch = run_attitude(algorithm, increments_from_imu(log), START)
    tracker = AttitudeTracker(algorithm, START, sampling)
    found = []
    for time, rate in zip(log.index, log.to_numpy(), strict=True):
        tracker.update(time, rate)
        found.append(tracker.quaternion)
    assert np.array_equal(batch.attitude[QUATERNION].to_numpy(), np.array(found))


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_run_cut_anywhere_and_continued_gives_the_same_bits(variant):
    algorithm, increments = make_algorithm(variant), increments_from_imu(shaken_log("mean"))
    whole_state, whole = algorithm.advance(algorithm.begin(START), increments)
    state, parts, at = algorithm.begin(START), [], 0
    for length in (1, 1, 2, 57, 0, 100, 1, len(increments)):
        state, part = algorithm.advance(state, increments.iloc[at : at + length])
        parts.append(part)
        at += length
    assert np.array_equal(np.vstack(parts), whole)
    assert np.array_equal(state, whole_state)


@pytest.mark.parametrize("variant", VARIANTS)
def test_advance_leaves_its_inputs_alone(variant):
    algorithm, increments = make_algorithm(variant), increments_from_imu(shaken_log("mean"))
    state, table = algorithm.begin(START), increments.copy()
    before = state.copy()
    algorithm.advance(state, increments)
    assert np.array_equal(state, before)
    assert increments.equals(table)


@pytest.mark.parametrize("variant", VARIANTS)
def test_it_starts_where_it_is_told_and_stays_there_at_rest(variant):
    time = np.array([3.0, 3.5, 9.0])
    run = run_attitude(
        make_algorithm(variant), increments_from_imu(imu_table(time, np.zeros((3, 3)))), START
    )
    assert np.array_equal(run.attitude.index, time)
    angles = rotation.rotation_angle(run.attitude[QUATERNION].to_numpy(), START)
    assert angles.max() < 1e-13  # a handful of roundings of 1e-16 rad = 6e-15 deg each


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("variant", VARIANTS)
def test_a_turn_about_one_axis_from_level(variant, axis):
    """The angle of each step is known in closed form, truncated series included."""
    algorithm = make_algorithm(variant)
    steps, turn = 40, 0.03
    theta = np.zeros((steps, 3))
    theta[:, axis] = turn
    run = run_attitude(
        algorithm, increments_table(np.arange(1, steps + 1) * 0.01, np.full(steps, 0.01), theta)
    )
    about = np.zeros(3)
    about[axis] = steps * angle_of_a_step(variant, turn)
    exact = rotation.quaternion_from_rotation_vector(about)
    error = rotation.rotation_angle(run.attitude[QUATERNION].to_numpy()[-1], exact)
    assert error < steps * 4e-14  # deg: a few roundings of 1.1e-16 rad in each step


def angle_of_a_step(variant: str, turn: float) -> float:
    """2 atan of the quaternion's series, atan of the matrix's; else the turn itself."""
    if variant.startswith("rk4"):
        half = turn / 2  # the step of fourth order is the exponential's series to that order
        return 2 * np.arctan2(half - half**3 / 6, 1 - half**2 / 2 + half**4 / 24)
    if "order=1" in variant:
        return 2 * np.arctan2(turn / 2, 1.0) if "quat" in variant else np.arctan2(turn, 1.0)
    if "order=3" in variant:
        if "quat" in variant:
            return 2 * np.arctan2(turn / 2 - turn**3 / 48, 1 - turn**2 / 8)
        return np.arctan2(turn - turn**3 / 6, 1 - turn**2 / 2)
    return turn


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_bad_sample_is_refused_and_changes_nothing(variant):
    tracker = AttitudeTracker(make_algorithm(variant), START)
    tracker.update(1.0, np.array([0.1, 0.2, 0.3]))
    tracker.update(1.1, np.array([0.1, 0.2, 0.3]))
    before = tracker.quaternion
    bad = [
        (1.1, [0.1, 0.2, 0.3], "time does not increase"),
        (0.5, [0.1, 0.2, 0.3], "time does not increase"),
        (np.nan, [0.1, 0.2, 0.3], "three finite rates"),
        (1.2, [np.nan, 0.2, 0.3], "three finite rates"),
        (1.2, [0.1, np.inf, 0.3], "three finite rates"),
        (1.2, [0.1, 0.2], "three finite rates"),
        (1.2, [0.1, 0.2, 1e200], "three finite rates"),
        (1.2, np.ones((3, 1)), "three finite rates"),
        (1.2, ["a", "b", "c"], "three finite rates"),
        (None, [0.1, 0.2, 0.3], "three finite rates"),
    ]
    for time, rate, message in bad:
        with pytest.raises(DataError, match=message):
            tracker.update(time, rate)
        assert np.array_equal(tracker.quaternion, before)
    tracker.update(1.2, [0.1, 0.2, 0.3])  # and it goes on
    assert not np.array_equal(tracker.quaternion, before)


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_label_makes_the_same_algorithm_again(variant):
    algorithm = make_algorithm(variant)
    assert make_algorithm(algorithm.label) == algorithm


@pytest.mark.parametrize("variant", ["dcm:order=1", "quaternion:order=1,normalise=false"])
def test_a_truncated_series_that_runs_away_says_so(variant):
    """Each step of 3 rad stretches by sqrt(1 + 9) or sqrt(1 + 9/4); 1e150 is soon reached."""
    increments = increments_table(np.arange(1, 2001.0), np.ones(2000), np.full((2000, 3), 3**0.5))
    with pytest.raises(DivergenceError, match=f"row .*{variant[:3]}.*overflowed"):
        run_attitude(make_algorithm(variant), increments)


# --- order of accuracy ------------------------------------------------------------------


def smooth_motion(time):
    """Roll, pitch, heading as smooth functions, and the body rates that give them exactly."""
    t = np.asarray(time)
    roll, roll_dot = 0.5 * np.sin(1.3 * t), 0.65 * np.cos(1.3 * t)
    pitch, pitch_dot = 0.4 * np.sin(0.9 * t + 0.4), 0.36 * np.cos(0.9 * t + 0.4)
    heading, heading_dot = 0.7 * t + 0.3 * np.cos(1.7 * t), 0.7 - 0.51 * np.sin(1.7 * t)
    rates = np.column_stack(
        [
            roll_dot - heading_dot * np.sin(pitch),
            pitch_dot * np.cos(roll) + heading_dot * np.cos(pitch) * np.sin(roll),
            -pitch_dot * np.sin(roll) + heading_dot * np.cos(pitch) * np.cos(roll),
        ]
    )
    return np.degrees(np.column_stack([roll, pitch, heading])), rates


def exact_increments(time):
    """Integral of the rate over each step by Gauss-Legendre with ten points: to rounding."""
    nodes, weights = np.polynomial.legendre.leggauss(10)
    dt = np.diff(time)
    theta = np.zeros((len(dt), 3))
    for node, weight in zip(nodes, weights, strict=True):
        theta += weight * smooth_motion(time[:-1] + 0.5 * dt * (node + 1.0))[1]
    return increments_table(time[1:], dt, theta * 0.5 * dt[:, None])


def order_of(variant, source, rates):
    """Fit the power of the step with which the final error falls."""
    algorithm, errors = make_algorithm(variant), []
    for rate in rates:
        time = np.arange(4 * rate + 1) / rate
        if source == "unequal increments":
            # Steps between 0.6 and 1.4 of their mean, the same pattern at every rate.
            time[1:-1] += 0.2 / rate * np.sin(2.5 * np.arange(1, 4 * rate))
        euler, gyro = smooth_motion(time)
        if "increments" in source:
            increments = exact_increments(time)
        else:
            interpolation = "cubic" if source == "cubic rates" else "linear"
            increments = increments_from_imu(imu_table(time, gyro), interpolation)
        run = run_attitude(algorithm, increments, rotation.quaternion_from_euler(euler[0]))
        last = run.attitude[QUATERNION].to_numpy()[-1]
        errors.append(rotation.rotation_angle(last, rotation.quaternion_from_euler(euler[-1])))
    return -np.polyfit(np.log(rates), np.log(errors), 1)[0]


@pytest.mark.parametrize("source", ["rates", "cubic rates", "increments", "unequal increments"])
@pytest.mark.parametrize(
    "variant",
    [
        *("naive", "euler", "euler:step=rk4", "dcm", "dcm:order=1", "quaternion"),
        *("quaternion:order=1", "rk4", "rotvec:samples=1", "rotvec", "rotvec:samples=3"),
        *("rotvec:samples=4", "rotvec:samples=2,coefficients=fit"),
        *("rotvec:samples=3,coefficients=fit", "rotvec:samples=4,coefficients=fit"),
    ],
)
def test_the_order_of_accuracy_that_it_declares(variant, source):
    declared = make_algorithm(variant).accuracy
    order = {
        "rates": min(2, declared.rates),
        "cubic rates": declared.rates,
        "increments": declared.increments,
        "unequal increments": declared.increments,
    }[source]
    if source == "unequal increments" and variant == "rotvec:samples=4":
        order = 6  # unequal steps are fitted
    # The error of high orders must stay above rounding, that of low ones leave its first terms.
    slope = order_of(variant, source, np.array([24, 48, 96] if order > 2 else [50, 100, 200, 400]))
    # Between whole orders lies 1; the next term of the error moves the fit by its share, which
    # is under a tenth at these steps, and two tenths where the steps are unequal.
    assert slope == pytest.approx(order, abs=0.2 if source == "unequal increments" else 0.1)


# --- words ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("quaternoin", "did you mean 'quaternion'"),
        ("dcm:ordr=3", "did you mean 'order'"),
        ("dcm:order=x", "not a whole number"),
        ("dcm:order=99", "out of range"),
        ("dcm:orthogonalise_every=-1", "negative"),
        ("quaternion:order=-1", "out of range"),
        ("quaternion:normalise=maybe", "not true or false"),
        ("euler:step=heun", "unknown step '"),
        ("naive:order=2", "has no options"),
        ("rotvec:samples=5", "out of range"),
        ("rotvec:coefficients=milner", "did you mean 'miller'"),
        ("rk4:normalise=perhaps", "not true or false"),
    ],
)
def test_what_is_not_understood_is_named(text, message):
    with pytest.raises(ConfigError, match=message):
        make_algorithm(text)


def test_increment_before_is_refused_to_a_block_of_several():
    with pytest.raises(ConfigError, check=coded("attitude.previous-of-one-increment")):
        make_algorithm("rotvec:previous=yes")
    assert make_algorithm("rotvec:samples=1,previous=yes").label == "rotvec:samples=1,previous=true"


def test_orthogonalising_does_what_it_says():
    time, theta = np.arange(1, 301) * 0.01, np.full((300, 3), 0.02)
    increments = increments_table(time, np.full(300, 0.01), theta)
    loss = {}
    for every in (0, 1, 10):
        algorithm = make_algorithm(f"dcm:order=1,orthogonalise_every={every}")
        state, _ = algorithm.advance(algorithm.begin(START), increments)
        loss[every] = algorithm.diagnostics(state, np.zeros(1))["orthogonality_loss"]
    # I + [r x] stretches by 1 + |r|^2/2 a step: (1 + |r|^2)^300 - 1 in C^T C, |r|^2 = 0.0012.
    assert loss[0] == pytest.approx((1.0012**300 - 1) * 2 / 3, rel=1e-6)
    # One Newton step squares what a step, or ten, have left: E -> 3/4 E^2.
    assert loss[1] < 0.0012**2
    assert loss[10] < (1.0012**10 - 1) ** 2


def test_the_nearest_approach_to_the_pole_counts_stages_and_steps():
    """Half a step of 60 deg/s * 1 s from 55 deg passes the pole; both ends are 25 deg from it."""
    start = rotation.quaternion_from_euler([0.0, 65.0, 0.0])
    theta = np.radians([[0.0, 50.0, 0.0]])
    increments = increments_table([1.0], [1.0], theta)
    for step in ("forward", "rk4"):
        algorithm = make_algorithm(f"euler:step={step}")
        state, _ = algorithm.advance(algorithm.begin(start), increments)
        assert algorithm.diagnostics(state, np.array([0.0, 1.0]))["closest_to_pole_deg"] == 0.0
    # A start that is nearer than anything after it is the nearest.
    algorithm = make_algorithm("euler")
    away = increments_table([1.0], [1.0], -theta)
    state, _ = algorithm.advance(algorithm.begin(start), away)
    near = algorithm.diagnostics(state, np.array([0.0, 1.0]))
    assert near["closest_to_pole_deg"] == pytest.approx(25.0, abs=1e-9)
    assert near["closest_to_pole_time_s"] == 0.0
