"""What a fine alignment knows is what navigation begins with, correlations and all."""

import math

import numpy as np
import pytest
from scipy import stats

from strapdown import rotation
from strapdown.alignment.alignment import Alignment, Site
from strapdown.alignment.coarse_alignments import COARSE_ALIGNMENTS
from strapdown.alignment.fine import FineAlignment
from strapdown.estimation.covariance import COVARIANCES
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import ERROR_MODELS, PHYSICAL
from strapdown.estimation.sensor_blocks import accel_bias, accel_scale, gyro_bias, gyro_drift
from strapdown.mechanization import MECHANIZATIONS
from strapdown.nav_state import NavState
from strapdown.navigation.filter_options import OpenLoop
from strapdown.navigation.handover import _with_biases, from_alignment, from_fine, with_drift
from strapdown.navigation.navigator import Navigator
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty
from strapdown.simulation import Origin, StationaryMotion, simulate_imu
from strapdown.tables import ACCEL, GYRO

HERE = (50.0, 10.0, 100.0)
GYRO_SD, ACCEL_SD = 1e-7, 3e-4
SITE = Site(*HERE)


@pytest.fixture(scope="module")
def aligned():
    errors = ImuErrors(
        TriadErrors(noise_density=1e-6, bias=(1e-7, -0.5e-7, 0.3e-7)),
        TriadErrors(noise_density=1e-4, bias=(2e-4, -3e-4, 1e-4)),
    )
    still = StationaryMotion(80.0, Origin(*HERE), roll_deg=3.0, pitch_deg=5.0, heading_deg=70.0)
    imu, _ = simulate_imu(still, errors, rate=20.0, seed=2)
    sensors = ImuUncertainty(
        TriadUncertainty(bias=GYRO_SD, noise_density=1e-6),
        TriadUncertainty(bias=ACCEL_SD, noise_density=1e-4),
    )
    coarse = COARSE_ALIGNMENTS["two_vector"]().align(imu, SITE, sensors)
    fine = FineAlignment().align(imu, SITE, sensors, coarse)
    return fine, imu[[*GYRO, *ACCEL]].to_numpy().mean(axis=0)


def made(name="ned", model="rotation_vector", form="ud", more=()):
    sensors = (gyro_bias(GYRO_SD), accel_bias(ACCEL_SD), *more)
    error_model = ERROR_MODELS[model]((1e-6,) * 3, (1e-4,) * 3, sensors)
    return ErrorFilter(MECHANIZATIONS[name](), error_model, COVARIANCES[form]())


def in_ned(filter_, state):
    """Covariance of the physical errors in north-east-down."""
    P = filter_.physical_covariance(state)
    turn = np.eye(len(P))
    for at in (0, 3, 6):
        turn[at : at + 3, at : at + 3] = filter_.mechanization.level_from_ned(state.row).T
    return turn @ P @ turn.T


@pytest.mark.parametrize(
    ("name", "model"),
    [("ned", "rotation_vector"), ("wander_azimuth", "rotation_vector")],
)
@pytest.mark.parametrize("form", COVARIANCES)
def test_biases_alone_go_on_with_all_their_correlations(aligned, name, model, form):
    fine, rest = aligned
    filter_ = made(name, model, form)
    state = from_fine(filter_, fine, rest)
    before, after = in_ned(fine.filter, fine.state), in_ned(filter_, state)
    # Of the size of the standard deviations: a form keeps P to some 1e-13 of it, the turns of
    # axes and the inverse of a diagonal to less.
    sd = np.sqrt(np.diagonal(before))
    np.testing.assert_allclose(after / np.outer(sd, sd), before / np.outer(sd, sd), atol=1e-9)
    np.testing.assert_allclose(state.sensors, fine.state.sensors, rtol=1e-12)
    there = filter_.mechanization.nav_state(state.mechanization, state.time)
    then = fine.filter.mechanization.nav_state(fine.state.mechanization, fine.state.time)
    np.testing.assert_allclose(there.q_nb, then.q_nb, atol=1e-14)
    # What no rest can tell: the heading from an east drift. It survives.
    C = rotation.dcm_from_quaternion(there.q_nb)
    east = np.zeros(len(after))
    east[PHYSICAL : PHYSICAL + 3] = C[1]
    heading = np.zeros(len(after))
    heading[8] = 1.0
    correlation = heading @ after @ east
    correlation /= math.sqrt((heading @ after @ heading) * (east @ after @ east))
    # Over 80 s the noise of the gyros is 1.1e-7 rad/s of the mean, beside a bias of 1e-7.
    assert abs(correlation) == pytest.approx(
        1.0 / math.hypot(1.0, 1e-6 / math.sqrt(80.0) / 1e-7), abs=0.05
    )


def test_quaternions_carry_the_same_attitude(aligned):
    fine, rest = aligned
    filter_ = made("wander_azimuth", "quaternions")
    before = in_ned(fine.filter, fine.state)
    after = in_ned(filter_, from_fine(filter_, fine, rest))
    sd = np.sqrt(np.diagonal(before))
    some = np.r_[3:15]  # a quaternion of place tells displacement to a part of its own rounding
    np.testing.assert_allclose(
        (after / np.outer(sd, sd))[np.ix_(some, some)],
        (before / np.outer(sd, sd))[np.ix_(some, some)],
        atol=1e-6,
    )


def test_further_states_share_a_bias_by_their_variances(aligned):
    fine, rest = aligned
    more = (gyro_drift(0.5 * GYRO_SD, 500.0), accel_scale(1e-5))
    filter_ = made(more=more)
    state = from_fine(filter_, fine, rest)
    P, before = in_ned(filter_, state), in_ned(fine.filter, fine.state)
    # The sum that is read at rest is known as it was, and errs with the attitude as it did.
    A = np.zeros((6, len(P)))
    A[:, PHYSICAL : PHYSICAL + 6] = np.eye(6)
    A[:3, PHYSICAL + 6 : PHYSICAL + 9] = np.eye(3)
    # A scale factor acts on what is left without the bias.
    A[3:, PHYSICAL + 9 :] = np.diag(rest[3:] - fine.state.sensors[3:])
    joint = np.vstack([np.eye(PHYSICAL, len(P)), A])
    sd = np.sqrt(np.diagonal(before))
    np.testing.assert_allclose(
        joint @ P @ joint.T / np.outer(sd, sd), before / np.outer(sd, sd), atol=1e-9
    )
    np.testing.assert_allclose(A[:, PHYSICAL:] @ state.sensors, fine.state.sensors, rtol=1e-9)
    # And each state is known no worse than before it.
    assert (np.diagonal(P)[PHYSICAL:] <= np.square(filter_.model.stacked.sd) * (1 + 1e-9)).all()


def test_as_if_the_filter_had_observed_the_sum_itself():
    # y = b + noise of a bias b = A x: to be told the posterior of b and to be told y are one.
    filter_ = made(more=(gyro_drift(0.5 * GYRO_SD, 500.0),))
    P0 = np.diag(np.square(filter_.model.stacked.sd))
    A = np.zeros((6, 9))
    A[:, :6], A[:3, 6:] = np.eye(6), np.eye(3)
    R = np.diag(np.r_[[4e-15] * 3, [5e-8] * 3])
    y = np.r_[1e-7, -2e-7, 5e-8, 1e-4, 2e-4, -3e-4]
    K = P0 @ A.T @ np.linalg.inv(A @ P0 @ A.T + R)
    S = A @ P0 @ A.T
    of_sum = S @ np.linalg.inv(S + R)
    joint = np.zeros((PHYSICAL + 6,) * 2)
    joint[:PHYSICAL, :PHYSICAL] = np.eye(PHYSICAL)
    joint[PHYSICAL:, PHYSICAL:] = S - of_sum @ S
    start = NavState.from_degrees(*HERE)
    state = _with_biases(filter_, start, joint, of_sum @ y, np.zeros(6))
    found = in_ned(filter_, state)[PHYSICAL:, PHYSICAL:]
    sd = np.sqrt(np.diagonal(P0))
    np.testing.assert_allclose(state.sensors / sd, (K @ y) / sd, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(
        found / np.outer(sd, sd), (P0 - K @ A @ P0) / np.outer(sd, sd), atol=1e-9
    )


def test_the_place_is_no_better_known_than_the_site(aligned):
    fine, rest = aligned
    filter_ = made()
    P = in_ned(filter_, from_fine(filter_, fine, rest, (3.0, 4.0, 5.0)))
    own = np.diagonal(in_ned(fine.filter, fine.state))[:3]
    np.testing.assert_allclose(np.diagonal(P)[:3], own + np.square([3.0, 4.0, 5.0]), rtol=1e-9)


def test_a_navigator_that_feeds_nothing_back_keeps_what_was_found(aligned):
    fine, rest = aligned
    filter_ = made()
    begun = from_fine(filter_, fine, rest)
    fed = Navigator(filter_)
    free = Navigator(filter_, damping=OpenLoop())
    state = free.begin_from(begun)
    assert not state.engine.filter.sensors.any()
    engine = free.engine(state.engine)
    np.testing.assert_allclose(engine.estimates(filter_), begun.sensors, rtol=1e-12)
    # What is not fed back is shown as of the last instant of the covariance, up to 0.1 s before:
    # 3e-5 m/s of a bias of 3e-4 m/s². Left in, it would be 3e-4 m/s after this second.
    time = begun.time + 0.05 * np.arange(1, 21)
    rows = np.zeros((20, 10))
    rows[:, 0] = 0.05
    rows[:, 1:4], rows[:, 4:7] = 0.05 * rest[:3], 0.05 * rest[3:]
    rows[:, 7:10] = 0.5 * 0.05**2 * rest[3:]
    one = fed.advance(fed.begin_from(begun), time, rows)[1].history
    two = free.advance(state, time, rows)[1].history
    assert np.abs(one[:, 3:6] - two[:, 3:6]).max() < 3e-5
    assert np.abs(begun.sensors[3:6]).max() > 2e-5


@pytest.mark.parametrize("method", ["known_heading", "two_vector"])
def test_a_levelled_tilt_goes_with_the_accelerometers_that_made_it(method):
    still = StationaryMotion(20.0, Origin(*HERE), roll_deg=20.0, pitch_deg=-30.0, heading_deg=70.0)
    imu, _ = simulate_imu(still, ImuErrors(TriadErrors(), TriadErrors()), rate=20.0, seed=2)
    sensors = ImuUncertainty(TriadUncertainty(bias=GYRO_SD), TriadUncertainty(bias=ACCEL_SD))
    given = {"heading_deg": 70.0, "sd_deg": 0.1} if method == "known_heading" else {}
    found = COARSE_ALIGNMENTS[method](**given).align(imu, SITE, sensors)
    rest = imu[[*GYRO, *ACCEL]].to_numpy().mean(axis=0)
    filter_ = made()
    start = NavState.from_degrees(*HERE, time=found.time)
    P = in_ned(filter_, from_alignment(filter_, found, start, np.eye(6), rest))
    # The force along the level that is computed, psi x (0, 0, -g) + C e: nothing is felt of it,
    # though each of the two alone is as large as a bias. Rounding and C's own second order.
    C = rotation.dcm_from_quaternion(found.q_nb)
    felt = np.zeros((2, len(P)))
    felt[0, 7], felt[1, 6] = -9.81, 9.81
    felt[:, PHYSICAL + 3 : PHYSICAL + 6] = C[:2]
    left = np.sqrt(np.diagonal(felt @ P @ felt.T))
    assert left == pytest.approx(0.0, abs=0.03 * ACCEL_SD)
    assert np.sqrt(np.diagonal(P))[6:8] * 9.81 == pytest.approx(ACCEL_SD, rel=0.01)
    assert np.linalg.eigvalsh(P[6:15, 6:15]).min() > -1e-12


def levelled(bias, tilt=(0.0, 0.0), more=(), scatter=0.0):
    """State and covariance after leveling with these biases, m/s², body axes."""
    filter_ = made(more=more)
    C = rotation.dcm_from_quaternion(rotation.quaternion_from_euler([*tilt, 70.0]))
    force = -C.T @ SITE.gravity + np.asarray(bias)
    roll, pitch = rotation.level(force)
    sd = math.hypot(ACCEL_SD, scatter) / 9.81
    found = Alignment(
        method="known_heading",
        time=0.0,
        q_nb=rotation.quaternion_from_euler([roll, pitch, 70.0]),
        covariance=np.diag(np.square([sd, sd, 0.02])),
        heading_given=True,
    )
    start = NavState.from_degrees(*HERE, time=0.0)
    rest = np.r_[np.zeros(3), force]
    return filter_, in_ned(filter_, from_alignment(filter_, found, start, np.eye(6), rest))


def test_a_force_that_contradicts_gravity_widens_the_tilt_with_the_biases():
    _, as_stated = levelled((0.0, 0.0, 0.5 * ACCEL_SD))
    _, P = levelled((0.0, 0.0, 6.0 * ACCEL_SD))
    # Student's t of four degrees of freedom, one error of six standard deviations: (4 + 36) / 5.
    wider = np.diagonal(P) / np.diagonal(as_stated)
    assert wider[6:8] == pytest.approx(8.0, rel=0.01)
    assert wider[PHYSICAL + 3 : PHYSICAL + 6] == pytest.approx(8.0, rel=0.01)
    assert wider[PHYSICAL : PHYSICAL + 3] == pytest.approx(1.0)
    assert wider[:6] == pytest.approx(1.0)
    # Of a level body the heading does not depend on the tilt.
    assert wider[8] == pytest.approx(1.0)
    sd = np.sqrt(np.diagonal(as_stated))
    assert sd[6:8] * 9.81 == pytest.approx(ACCEL_SD, rel=0.01)
    assert sd[PHYSICAL + 3 :] == pytest.approx(ACCEL_SD)
    # Tilt and bias are as correlated as before.
    assert P[7, PHYSICAL + 3] / as_stated[7, PHYSICAL + 3] == pytest.approx(8.0, rel=0.01)


def test_a_force_of_a_moving_hand_does_not_blame_the_accelerometers():
    # The mean force of a body that is not at rest is off by about its effect on the tilt.
    shaken = 20.0 * ACCEL_SD
    _, as_stated = levelled((0.0, 0.0, 0.0), scatter=shaken)
    _, P = levelled((0.0, 0.0, 20.0 * ACCEL_SD), scatter=shaken)
    assert np.diagonal(P) == pytest.approx(np.diagonal(as_stated), rel=1e-4)


def test_tilts_of_units_far_outside_of_their_type_are_inside_more_often():
    # Biases of the units of a type by Student's t, as large together as one draw of its scale.
    draws, inside, before = 400, 0, 0
    rng = np.random.default_rng(7)
    for _ in range(draws):
        scale = math.sqrt(4.0 / rng.chisquare(4.0))
        bias = ACCEL_SD * scale * rng.normal(size=3)
        _, P = levelled(bias)
        tilt = bias[:2] / 9.81  # of a level body, in its own axes
        inside += int(np.square(tilt).sum() < stats.chi2(2).ppf(0.95) * P[6, 6])
        before += int(np.square(tilt).sum() < stats.chi2(2).ppf(0.95) * (ACCEL_SD / 9.81) ** 2)
    # Without the evidence F(2, 4) is below 3.0: in 84 %; with the true scale 95 would be.
    assert before / draws < 0.88
    assert inside > before + 10


@pytest.mark.parametrize("after", [0.0, 0.2, 1.5])
def test_a_place_that_was_carried_goes_with_all_that_goes_with_the_velocity(after):
    root = (
        np.random.default_rng(5).normal(size=(12, 12))
        * np.repeat([0.1, 0.02, 1e-3, 0.1], 3)[:, None]
    )
    known = root @ root.T
    found = Alignment(
        method="gnss_course",
        time=0.0,
        q_nb=rotation.quaternion_from_euler([1.0, -2.0, 60.0]),
        covariance=known[3:6, 3:6],
        gyro_bias=np.zeros(3),
        accel_bias=np.zeros(3),
        gyro_bias_sd=np.sqrt(np.diagonal(known)[6:9]),
        accel_bias_sd=np.sqrt(np.diagonal(known)[9:]),
        velocity=np.zeros(3),
        joint=known,
    )
    fix = np.diag([1e-4, 2e-4, 4e-4])
    # The place is a fix, whose error is its own, and the velocity times the time since.
    carried = np.zeros((15, 15))
    carried[3:, 3:] = known
    carried[:3, 3:] = after * known[:3]
    carried[3:, :3] = carried[:3, 3:].T
    carried[:3, :3] = fix + after**2 * known[:3, :3]
    filter_ = made()
    start = NavState.from_degrees(*HERE, time=0.0)
    begun = from_alignment(filter_, found, start, carried[:6, :6], np.r_[np.zeros(5), -9.81])
    told = in_ned(filter_, begun)
    sd = np.sqrt(np.diagonal(carried))
    assert told / sd / sd[:, None] == pytest.approx(carried / sd / sd[:, None], abs=1e-9)


def test_a_hypothesis_of_the_drift_is_that_of_the_heading():
    """It is known as stated, and about level axes nothing else is: the prior is far wider."""
    filter_ = ErrorFilter(
        MECHANIZATIONS["ned"](),
        ERROR_MODELS["rotation_vector"](
            (1e-6,) * 3, (1e-4,) * 3, (gyro_bias(0.05), gyro_drift(0.05, 100.0))
        ),
        COVARIANCES["ud"](),
    )
    start = NavState.from_degrees(*HERE, roll_deg=20.0, pitch_deg=-30.0, heading_deg=70.0)
    begun = filter_.begin(start, np.eye(PHYSICAL + 6) * 0.05**2)
    after = with_drift(filter_, begun, 0.02, 0.001)
    level = rotation.dcm_from_quaternion(start.q_nb)
    drift = level @ (after.sensors[:3] + after.sensors[3:])
    P = filter_.physical_covariance(after)[PHYSICAL:, PHYSICAL:]
    both = level @ (P[:3, :3] + P[:3, 3:] + P[3:, :3] + P[3:, 3:]) @ level.T
    prior = 2.0 * 0.05**2
    share = prior / (prior + 0.001**2)
    np.testing.assert_allclose(drift, [0.0, 0.0, 0.02 * share], atol=1e-12)
    np.testing.assert_allclose(both, np.diag([prior, prior, prior * (1.0 - share)]), atol=1e-12)
