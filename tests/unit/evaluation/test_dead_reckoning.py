"""Position between rests: exact motions, and the laws by which errors grow."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown import rotation
from strapdown.attitude_algorithms.algorithm import AttitudeRun
from strapdown.constants import STANDARD_GRAVITY as G
from strapdown.errors import ConfigError, DataError
from strapdown.evaluation.position_references import (
    DeadReckoningErrors,
    dead_reckon,
    is_place,
    parse_place,
    score_places,
)
from strapdown.formats.references import read_reference_words
from strapdown.sensors.rest import rest_between
from strapdown.tables import ACCEL, attitude_table, imu_table

MOVE = 8.0  # s, of every motion here
SPAN = (2.0, 2.0 + MOVE)


def growth_laws(seconds, *, accel_error, tilt_rate):
    """Position error by constant errors (Alexiev 2021, who leaves out g)."""
    return 0.5 * accel_error * seconds**2, G * tilt_rate * seconds**3 / 6.0


def smooth(time, start, end):
    """From 0 to 1 with zero rate and acceleration at both ends: 10 u³ - 15 u⁴ + 6 u⁵."""
    u = np.clip((time - start) / (end - start), 0.0, 1.0)
    return u**3 * (10 - 15 * u + 6 * u * u), (60 * u - 180 * u**2 + 120 * u**3) / (end - start) ** 2


def motion(moved, *, rate=200.0, turned=(40.0, -30.0, 100.0), seconds=12.0, start=(0, 0, 0)):
    """Exact attitude and specific force of a body that moves and turns between two rests."""
    time = np.arange(int(seconds * rate) + 1) / rate
    share, accel = smooth(time, *SPAN)
    q = rotation.quaternion_from_euler(np.asarray(start) + share[:, None] * np.asarray(turned))
    force_n = accel[:, None] * np.asarray(moved) - np.array([0.0, 0.0, G])
    force = rotation.rotate(rotation.conjugate(q), force_n)
    return time, q, force


def bench(time, q, force):
    run = AttitudeRun("exact", "", "", attitude_table(time, q), {})
    imu = imu_table(time, np.zeros_like(force), force)
    rests = [rest_between(imu, 0.0, SPAN[0]), rest_between(imu, SPAN[1], time[-1])]
    return run, imu, rests


def test_an_exact_motion_is_found_again():
    """Between samples the force is taken for a straight line: h²/12 of its second derivative.

    Its largest value is 60·6/T⁴ times the way (10 u³ - 15 u⁴ + 6 u⁵ four times) at the ends,
    and less than that within; the error of p is at most h²/12 max|a''| T²/2 for each axis.
    """
    way = np.array([0.3, -1.2, 0.5])
    run, imu, rests = bench(*motion(way))
    (score,) = score_places(
        run, [parse_place("11 moved 0.3 -1.2 0.5 m since 1", 0, 12)], imu, rests
    )
    bound = (1 / 200) ** 2 / 12 * 360 / MOVE**4 * np.linalg.norm(way) * MOVE**2 / 2
    assert score.error_m < bound
    assert score.corrected_error_m < 2 * bound
    assert score.end_velocity_m_s < bound / MOVE * 2
    assert score.seconds == pytest.approx(MOVE)


def test_means_do_as_well_as_samples():
    """A mean over the interval is turned by the mean of the matrices: h²/12 (C' x f') is lost."""
    rate = 200.0
    time, q, force = motion((0.3, -1.2, 0.5), rate=10 * rate)
    # The mean over ten fine steps by Simpson's pairs, which is exact to the fourth order here.
    weights = np.array([1, 4, 2, 4, 2, 4, 2, 4, 2, 4, 1]) / 30.0
    mean = np.array([weights @ force[k : k + 11] for k in range(0, len(force) - 10, 10)])
    coarse = time[::10]
    imu = imu_table(coarse[1:], np.zeros_like(mean), mean, sampling="mean")
    run = AttitudeRun("exact", "", "", attitude_table(coarse, q[::10]), {})
    rests = [rest_between(imu, 0.0, SPAN[0]), rest_between(imu, SPAN[1], 12.0)]
    leg = dead_reckon(run, imu, *rests)
    # The turn of 1.96 rad has 0.46 rad/s and 0.18 rad/s² at most (1.875 and 5.77 times 1.96/T and
    # 1.96/T²). Lost is h²/12 of C'' f, (0.46² + 0.18)·9.8, and of C' f', 0.46²·9.8: 1.3e-5 m/s²
    # at the most, at worst all the time in one direction.
    assert np.linalg.norm(leg.position[-1] - [0.3, -1.2, 0.5]) < 1.3e-5 * MOVE**2 / 2


def test_a_constant_error_of_acceleration_grows_with_the_square_of_time_and_is_taken_back():
    time, q, force = motion((0, 0, 0), turned=(0, 0, 0))
    force = force + np.array([0.02, 0.0, 0.0])
    run, imu, rests = bench(time, q, force)
    leg = dead_reckon(run, imu, *rests, gravity=G)
    expected, _ = growth_laws(MOVE, accel_error=0.02, tilt_rate=0.0)
    assert leg.position[-1][0] == pytest.approx(expected, rel=1e-9)
    assert leg.velocity[-1][0] == pytest.approx(0.02 * MOVE, rel=1e-9)
    assert abs(leg.position_corrected[-1][0]) < 1e-9


def test_a_tilt_that_drifts_grows_with_the_cube_of_time():
    """g must be in it: without g the law would be ten times too small."""
    time, _, force = motion((0, 0, 0), turned=(0, 0, 0))
    drift = 1e-4
    psi = np.column_stack([0 * time, drift * np.clip(time - SPAN[0], 0, MOVE), 0 * time])
    run, imu, rests = bench(time, rotation.quaternion_from_rotation_vector(psi), force)
    leg = dead_reckon(run, imu, *rests)
    _, expected = growth_laws(MOVE, accel_error=0.0, tilt_rate=drift)
    # sin(psi) = psi (1 - psi²/6), psi at most 8e-4; the line between samples has psi as it is.
    assert abs(leg.position[-1][0]) == pytest.approx(expected, rel=1e-6)
    assert leg.position_corrected[-1][0] == pytest.approx(-0.5 * leg.position[-1][0], rel=1e-6)


@pytest.mark.parametrize("levelled", [False, True])
@pytest.mark.parametrize("own_gravity", [False, True])
def test_sensitivities_are_those_of_differences(levelled, own_gravity):
    """Each column against a run that has that error, of a size at which squares do not count."""
    time, q, force = motion((1.0, 0.5, -0.3), start=(10.0, -20.0, 30.0))
    gravity = None if own_gravity else G
    run, imu, rests = bench(time, q, force)
    exact = dead_reckon(run, imu, *rests, gravity=gravity, levelled=levelled)
    tiny = 1e-6
    turn = rotation.dcm_from_quaternion(q)
    for k in range(6):
        bias = tiny * np.eye(3)[k % 3]
        psi = np.zeros_like(force)
        off = force.copy()
        if k < 3:
            off += bias
            if levelled:
                n = turn[0] @ bias
                psi += [-n[1] / G, n[0] / G, 0.0]
        else:
            steps = 0.5 * (turn[1:] + turn[:-1]) @ bias * np.diff(time)[:, None]
            psi[1:] = np.cumsum(steps, axis=0)
        wrong = rotation.compose(rotation.quaternion_from_rotation_vector(psi), q)
        leg = dead_reckon(*bench(time, wrong, off)[:2], *bench(time, q, off)[2], gravity=gravity)
        # The second order is tiny·g·T² or less of the first.
        scale = np.abs(exact.position_by_bias).max()
        change = (leg.position[-1] - exact.position[-1]) / tiny
        assert change == pytest.approx(exact.position_by_bias[:, k], abs=1e-3 * scale)
        change = (leg.velocity[-1] - exact.velocity[-1]) / tiny
        assert change == pytest.approx(
            exact.velocity_by_bias[:, k], abs=1e-3 * np.abs(exact.velocity_by_bias).max()
        )


def test_the_sd_is_that_of_the_errors():
    """120 runs with drawn errors: the sum of squares over the variance lies within its chi².

    Components of the error share few causes, so that the mean square is bounded as if there
    were one degree of freedom a run: 1 ± 4 √(2/120).
    """
    rng = np.random.default_rng(5)
    time, q, clean = motion((1.0, 0.5, -0.3), rate=50.0)
    turn = rotation.dcm_from_quaternion(q)
    assumed = DeadReckoningErrors(0.02, 1e-4, 0.05, 0.003, levelled=False)
    place = parse_place("11 moved 1 0.5 -0.3 m since 1", 0, 12)
    ratios = []
    for _ in range(120):
        bias_a, bias_g = 0.02 * rng.normal(size=3), 1e-4 * rng.normal(size=3)
        tilt = np.radians(0.05) * np.append(rng.normal(size=2), 0.0)
        psi = np.zeros_like(clean)
        psi[1:] = np.cumsum(0.5 * (turn[1:] + turn[:-1]) @ bias_g * np.diff(time)[:, None], axis=0)
        wrong = rotation.compose(rotation.quaternion_from_rotation_vector(psi + tilt), q)
        force = clean + bias_a + 0.003 * np.sqrt(50.0) * rng.normal(size=clean.shape)
        run, imu, rests = bench(time, wrong, force)
        (score,) = score_places(run, [place], imu, rests, errors=assumed, gravity=G)
        ratios.append(
            [
                (score.error_m / score.sd_m) ** 2,
                (score.corrected_error_m / score.corrected_sd_m) ** 2,
                (score.end_velocity_m_s / score.end_velocity_sd_m_s) ** 2,
            ]
        )
    mean = np.mean(ratios, axis=0)
    assert np.abs(mean - 1.0).max() < 4 * np.sqrt(2 / 120), mean


def test_rests_between_are_used():
    """Two legs of one law: each starts anew, so that they add up to twice one and not to four."""
    time, q, force = motion((0, 0, 0), turned=(0, 0, 0), seconds=22.0)
    run, imu, _ = bench(time, q, force + np.array([0.02, 0.0, 0.0]))
    rests = [rest_between(imu, *span) for span in [(0, 2), (10, 12), (20, 22)]]
    (score,) = score_places(
        run, [parse_place("end same place as start", 0, 22)], imu, rests, gravity=G
    )
    assert score.legs == 2
    assert score.error_m == pytest.approx(2 * growth_laws(8, accel_error=0.02, tilt_rate=0)[0])


@pytest.mark.parametrize(
    ("text", "moved", "sd"),
    [
        ("12.5 same place as 3.0", (0, 0, 0), None),
        ("end same-place-as start sd 0.01", (0, 0, 0), 0.01),
        ("12.5 s moved 0.30 0 0 m since 3.0", (0.3, 0, 0), None),
        ("12.5: moved 30, -5, 0 cm since start sd 5 mm", (0.3, -0.05, 0), 0.005),
    ],
)
def test_words(text, moved, sd):
    place = parse_place(text, 0.0, 20.0)
    assert is_place(text)
    assert place.moved == pytest.approx(moved)
    assert (place.sd is None) == (sd is None)
    assert sd is None or place.sd == pytest.approx(sd)


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("12.5 moved 0.3 m since 3", ConfigError, "not understood"),
        ("12.5 moved 1 2 3 ft since 3", ConfigError, "not understood"),
        ("3 same place as 12.5", ConfigError, "s, which is not earlier"),
        ("12.5 same place as 3 sd 0", ConfigError, "not positive"),
        ("25 same place as 3", DataError, "s, and the log covers"),
    ],
)
def test_words_that_cannot_be_used(text, error, message):
    with pytest.raises(error, match=message):
        parse_place(text, 0.0, 20.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("5 same place as 1", r"s, which is not in a stationary interval \(intervals, s"),
        ("1.9 same place as 1", "' names two instants of one stationary interval"),
    ],
)
def test_instants_that_are_no_rests_are_refused(text, message):
    run, imu, rests = bench(*motion((0, 0, 0)))
    with pytest.raises(DataError, match=message):
        score_places(run, [parse_place(text, 0, 12)], imu, rests)


def test_files_may_hold_places(tmp_path):
    (tmp_path / "a.txt").write_text("12.5 same place as 3.0\nend same as start\n")
    assert read_reference_words(tmp_path / "a.txt") == [
        "12.5 same place as 3.0",
        "end same as start",
    ]
    (tmp_path / "b.txt").write_text("12.5 moved 1 2 ft since 3\n")
    with pytest.raises(
        DataError,
        check=coded("evaluation.not-understood", row=1, file="b.txt", quantity="reference"),
    ):
        read_reference_words(tmp_path / "b.txt")


def test_a_log_without_acceleration_is_refused():
    run, imu, rests = bench(*motion((0, 0, 0)))
    with pytest.raises(
        DataError, check=coded("evaluation.position-needs-acceleration-log-none", quantity="accel")
    ):
        dead_reckon(run, imu.drop(columns=ACCEL), *rests)
