"""A trajectory with errors that are drawn from its covariance, against the truth it came of."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from tests.coded import coded

from strapdown import rotation
from strapdown.config.navigation import NavigationSpec
from strapdown.dsp.chi_square import chi_square_above
from strapdown.errors import DataError
from strapdown.mechanization import NorthEastDown
from strapdown.mechanization.mechanization import state_error
from strapdown.nav_state import NavState
from strapdown.navigation.truth_comparison import (
    compare_with_places,
    compare_with_truth,
    independent_errors,
    state_errors,
)
from strapdown.simulation.earth_motion import Origin
from strapdown.simulation.spline_motion import SineVelocityMotion
from strapdown.systems.navigation_run import run_navigation
from strapdown.tables import trajectory_table

MOTION = SineVelocityMotion(
    60.0, Origin(55.0, 37.0, 150.0), (5.0, -3.0, 0.0), (8.0, 8.0, 0.3), 30.0
)
SD = np.r_[[2.0, 3.0, 1.0], [0.1, 0.2, 0.1], np.radians([0.1, 0.1, 1.0])]
USED = NorthEastDown()


def state_of(row, time):
    return NavState.from_degrees(
        row["lat"],
        row["lon"],
        row["alt"],
        v_n=row[["VN", "VE", "VD"]].to_numpy(),
        roll_deg=row["roll"],
        pitch_deg=row["pitch"],
        heading_deg=row["heading"],
        time=time,
    )


def with_errors(time, errors):
    """Trajectory that is wrong by errors, in the axes of its own states."""
    rows = []
    for (_, row), t, error in zip(MOTION.trajectory(time).iterrows(), time, errors, strict=True):
        state = USED.begin(state_of(row, t))
        # Level axes of the two states are the same to a millionth of a radian.
        s = USED.nav_state(USED.correct(state, -error), t)
        lat, lon = np.degrees([s.lat, s.lon])
        rows.append([lat, lon, s.alt, *s.v_n, *rotation.euler_from_quaternion(s.q_nb)])
    rows = np.array(rows)
    return trajectory_table(time, rows[:, :3], rows[:, 3:6], rows[:, 6:])


@pytest.fixture(scope="module")
def run():
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 60.01, 0.1)
    correlation = np.eye(9)
    correlation[0, 8] = correlation[8, 0] = 0.7
    P = correlation * np.outer(SD, SD)
    errors = rng.multivariate_normal(np.zeros(9), P, len(time))
    return time, errors, P, with_errors(time, errors)


def test_errors_are_those_of_filters(run):
    time, errors, _, trajectory = run
    truth = MOTION.trajectory(time)
    found = state_errors(trajectory, truth)
    for k in (0, 17, 333):
        one = state_error(state_of(trajectory.iloc[k], 0.0), state_of(truth.iloc[k], 0.0))
        # Of 9-digit angles: 1e-9 m, and rounding of half turns.
        assert found[k] == pytest.approx(one, abs=2e-9)
    # Level axes of two states some metres apart differ by a millionth of a radian.
    assert np.abs(found - errors).max() < 1e-4


@pytest.mark.parametrize("rate", [None, 0.05, 0.07])
def test_squares_and_shares_against_a_truth_of_any_rate(run, rate):
    time, errors, P, trajectory = run
    marks = time[::10]
    truth = MOTION if rate is None else MOTION.trajectory(np.arange(0.0, 60.0, rate))
    out = compare_with_truth(trajectory, marks, np.broadcast_to(P, (len(marks), 9, 9)), truth)
    count = len(marks) if rate is None else np.sum(marks <= np.arange(0.0, 60.0, rate)[-1])
    assert len(out.time) == count
    e = errors[::10][:count]
    # Interpolation over 0.07 s: velocity to h²/8 of a jerk of 0.4 m/s³, 2e-4 m/s of 0.1.
    assert out.errors == pytest.approx(e, abs=4e-4)
    squares = np.einsum("ni,ij,nj->n", e, np.linalg.inv(P), e)
    assert out.nees["all"].to_numpy() == pytest.approx(squares, rel=0.03, abs=0.05)
    assert out.freedom == {
        "all": 9,
        "position": 3,
        "velocity": 3,
        "attitude": 3,
        "horizontal": 2,
    }
    # 60 independent errors: a share of 0.95 has a standard deviation of 0.028; four of them.
    assert all(share > 0.83 for share in out.inside.values())
    assert bool(out.findings) == (rate == 0.07)
    table = out.table
    assert table.loc["east", "rms"] == pytest.approx(np.sqrt(np.mean(e[:, 1] ** 2)), rel=1e-3)
    assert table.loc["psi_D", "max"] == pytest.approx(np.degrees(np.abs(e[:, 8]).max()), rel=1e-2)
    assert table.loc["horizontal", "max"] == pytest.approx(np.hypot(*e[:, :2].T).max(), rel=1e-3)
    assert table.loc["VN", "sd"] == pytest.approx(0.1)


def test_a_covariance_of_a_tenth_is_outside(run):
    time, _, P, trajectory = run
    marks = time[::10]
    out = compare_with_truth(
        trajectory, marks, np.broadcast_to(0.1 * P, (len(marks), 9, 9)), MOTION
    )
    assert out.inside["all"] < 0.1
    assert out.inside["horizontal"] < 0.5


def lasting(rng, count, time):
    """Normal errors of a first-order process that last for a time, of 1; a constant for inf."""
    kept = 0.0 if time == 0.0 else np.exp(-1.0 / (count - 1) / time)
    white = rng.normal(size=count) * np.sqrt(1.0 - kept**2)
    white[0] = rng.normal()
    return lfilter([1.0], [1.0, -kept], white)


@pytest.mark.parametrize(("time", "least"), [(0.0, 5.0), (0.03, 3.0), (0.3, 1.5), (np.inf, 1.001)])
def test_the_number_of_independent_errors(time, least):
    """Against its definition with the process's own autocorrelation; too small by what is said."""
    rng, count = np.random.default_rng(1), 800
    lag = np.arange(count)
    rho = (lag == 0.0) * 1.0 if time == 0.0 else np.exp(-lag / (count - 1) / time)
    exact = count**2 / (2.0 * ((count - lag) * rho**2).sum() - count)
    stamps = np.linspace(100.0, 400.0, count)
    found = [independent_errors(stamps, lasting(rng, count, time)[:, None]) for _ in range(100)]
    assert exact / least <= np.median(found) <= 1.001 * exact


@pytest.mark.parametrize("time", [0.01, 0.3, 1.0, np.inf])
def test_errors_as_large_by_chance_are_not_rarer_than_said(time):
    """With right bounds; and bounds of a half are found where errors do not last."""
    rng, stamps = np.random.default_rng(2), np.linspace(0.0, 60.0, 400)
    said = {1.0: [], 2.0: []}
    for _ in range(600):
        z = lasting(rng, 400, time)
        for size, chances in said.items():
            count = independent_errors(stamps, size * z[:, None])
            chances.append(chi_square_above(count * np.mean(np.square(size * z)), count))
    # Upper end of the 99 % interval of a share of 0.05 in 600.
    assert np.mean(np.array(said[1.0]) < 0.05) < 0.074
    rare = np.mean(np.array(said[2.0]) < 0.01)
    assert rare > 0.99 if time == 0.01 else rare > 0.15


def test_the_chance_of_errors_is_of_their_own_bounds(run):
    """White errors of the stated covariance, of a tenth of it, and of none."""
    time, _, P, trajectory = run
    marks = time[::10]
    chances = {}
    for part in (1.0, 0.1):
        stated = np.broadcast_to(part * P, (len(marks), 9, 9))
        found = compare_with_truth(trajectory, marks, stated, MOTION)
        chances[part] = {one.quantity: one.chance for one in found.scores}
    assert min(chances[1.0].values()) > 0.01
    assert max(chances[0.1].values()) < 1e-9


def test_what_the_run_has_no_state_of_is_left_out(run):
    time, _, P, trajectory = run
    marks = time[::10]
    P = P.copy()
    P[2] = P[:, 2] = np.nan
    out = compare_with_truth(trajectory, marks, np.broadcast_to(P, (len(marks), 9, 9)), MOTION)
    assert out.freedom["all"] == 8
    assert out.freedom["position"] == 2
    assert np.isnan(out.table.loc["down", "inside"])
    assert out.sd["down"].isna().all()
    assert np.isfinite(out.sd.drop(columns="down").to_numpy()).all()
    exact = np.where(np.isnan(P), 0.0, P)
    same = compare_with_truth(trajectory, marks, np.broadcast_to(exact, (len(marks), 9, 9)), MOTION)
    # A variance of zero is another thing: a quantity that is known exactly.
    assert (same.sd["down"] == 0.0).all()
    assert same.nees.equals(out.nees)


def test_no_rounding_makes_an_estimate_of_what_is_none(run):
    """The vertical velocity of a held height is a function of the position's error, to rounding."""
    time, _, P, trajectory = run
    marks = time[::10]
    T = np.eye(9)
    T[5] = 0.0
    T[5, :2] = 1e-6, -2e-6
    P = np.broadcast_to(T @ P @ T.T, (len(marks), 9, 9)).copy()
    # As of a covariance in components of quaternions, whose entries differ by 1e13.
    P[:, 5, 5] *= 1.0 - 1e-9
    assert (P[:, 5, 5] > 0.0).all()
    with pytest.raises(DataError, check=coded("evaluation.covariance-not-positive-definite")):
        compare_with_truth(trajectory, marks, P, MOTION)
    P[:, 5] = P[:, :, 5] = np.nan
    out = compare_with_truth(trajectory, marks, P, MOTION)
    assert out.freedom["all"] == 8
    assert np.isfinite(out.nees.to_numpy()).all()


def test_places_of_a_run_without_a_height_are_compared_in_the_plane(run):
    time, _, P, trajectory = run
    places = MOTION.trajectory(time[5::10])[["lat", "lon", "alt"]]
    P = np.broadcast_to(P, (len(time), 9, 9)).copy()
    whole = compare_with_places(trajectory, time, P, places, antenna=(2.0, -1.0, -1.5))
    P[:, 2] = P[:, :, 2] = np.nan
    out = compare_with_places(trajectory, time, P, places, antenna=(2.0, -1.0, -1.5))
    assert out.freedom == {"all": 2, "position": 2, "horizontal": 2}
    assert out.nees["horizontal"].to_numpy() == pytest.approx(
        whole.nees["horizontal"].to_numpy(), rel=1e-9
    )
    assert out.sd["down"].isna().all()


def test_a_held_height_of_17_states_is_not_estimated():
    start = {"lat_deg": 55.0, "lon_deg": 37.0, "alt_m": 150.0, "heading_deg": 30.0}
    drive = [
        {"do": "accelerate", "to_km_per_h": 50.0, "duration_s": 6.0},
        {"do": "turn_left", "radius_m": 50.0},
    ]
    spec = NavigationSpec.checked(
        {
            "simulation": {
                "rate_hz": 20.0,
                "motion": {"kind": "car", **start, "manoeuvres": drive},
            },
            "sensors": {"sensor": "mpu-9250"},
            "start": {**start, "roll_deg": 0.0, "pitch_deg": 0.0},
            "mechanization": {"kind": "wander_azimuth", "height": "held"},
            "filter": {"kind": "error_state", "error_model": "quaternions"},
            "aiding": {"gnss": {}},
        }
    )
    run = run_navigation(spec)
    assert run.record.not_estimated == ("down", "VD")
    without = np.isnan(run.record.covariance)
    assert without[:, [2, 5]].all()
    assert without[:, :, [2, 5]].all()
    assert not np.delete(np.delete(without, [2, 5], axis=1), [2, 5], axis=2).any()
    out = compare_with_truth(
        run.trajectory, run.record.sd.index, run.record.covariance, run.source.truth
    )
    assert out.freedom == {
        "all": 7,
        "position": 2,
        "velocity": 2,
        "attitude": 3,
        "horizontal": 2,
    }
    assert np.isfinite(out.nees.to_numpy()).all()
    assert np.isnan(out.table.loc["VD", "inside"])
    scores = {one.quantity: one for one in out.scores}
    assert [name for name, one in scores.items() if np.isnan(one.share)] == ["down", "VD"]


def test_a_covariance_that_cannot_be_one_is_refused(run):
    time, _, P, trajectory = run
    P = P.copy()
    P[0, 8] = P[8, 0] = 1.1 * SD[0] * SD[8]
    with pytest.raises(DataError, check=coded("evaluation.covariance-not-positive-definite")):
        compare_with_truth(trajectory, time, np.broadcast_to(P, (len(time), 9, 9)), MOTION)


def test_a_mark_between_samples_is_of_the_row_after_it(run):
    _, errors, P, trajectory = run
    marks = np.array([1.04, 1.06, 2.0])
    out = compare_with_truth(trajectory, marks, np.stack([P, 2.0 * P, 3.0 * P]), MOTION)
    # Of two marks before one row the later tells of it.
    assert list(out.time) == pytest.approx([1.1, 2.0])
    assert out.covariance[0] == pytest.approx(2.0 * P)
    assert out.errors[0] == pytest.approx(errors[11], abs=1e-4)


def test_places_alone_with_their_own_errors_and_their_antenna(run):
    time, errors, P, trajectory = run
    arm = np.array([2.0, -1.0, -1.5])
    at = time[5::10]
    truth = MOTION.trajectory(at)
    q = rotation.quaternion_from_euler(truth[["roll", "pitch", "heading"]].to_numpy())
    moved = rotation.rotate(q, arm)
    places = truth[["lat", "lon", "alt"]].copy()
    places["lat"] += moved[:, 0] / 111_323.0
    places["lon"] += moved[:, 1] / (111_323.0 * np.cos(np.radians(55.0))) * (1.0 - 0.0023)
    places["alt"] -= moved[:, 2]
    places[["north_sd", "east_sd", "down_sd"]] = 0.5
    out = compare_with_places(
        trajectory, time, np.broadcast_to(P, (len(time), 9, 9)), places, antenna=arm
    )
    # The attitude of the trajectory turns the arm: 1 deg of 2.2 m; the scale above is rough by
    # less than 1 % of the arm.
    assert np.abs(out.errors[:, :3] - errors[5::10, :3]).max() < 0.2
    assert np.isnan(out.errors[:, 3:]).all()
    assert set(out.freedom) == {"all", "position", "horizontal"}
    # Its own variance, and what a rotation of 0.1 deg of level makes of the arm.
    assert out.covariance[0][2, 2] == pytest.approx(1.0 + 0.25, abs=0.01)
    assert out.inside["position"] > 0.83
    assert np.isnan(out.table.loc["VN", "rms"])


def test_nothing_in_common_is_said(run):
    time, _, P, trajectory = run
    later = MOTION.trajectory(np.arange(0.0, 10.0, 0.1))
    later.index = later.index + 1000.0
    for compare in (compare_with_truth, compare_with_places):
        with pytest.raises(
            DataError,
            check=lambda refused: refused.finding.code == "evaluation.run-truth-no-instant-common",
        ):
            compare(trajectory, time[::10], np.broadcast_to(P, (61, 9, 9)), later)
