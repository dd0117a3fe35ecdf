"""The entry state from fixes: exact without noise, and as wrong as it says with it."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

sys.path.insert(0, str(Path(__file__).parent))

from entry_case import (
    ACCEL_UNKNOWN,
    ARM,
    GYRO_UNKNOWN,
    IMPACT,
    LIVELY,
    ORIGIN,
    PRIORS,
    STEADY,
    Clean,
    drawn_case,
    errors_of,
)

from strapdown.crash.drive_entry import entry_state_from_gnss
from strapdown.crash.entry import biases_off
from strapdown.crash.entry_estimate import EntryPriors, FixCorrelation
from strapdown.errors import ConfigError, DataError
from strapdown.sensors.uncertainty import TriadUncertainty
from strapdown.simulation import ImuErrors, TriadErrors, car, simulate_imu
from strapdown.simulation.crash_motion import CrashMotion, HaversinePulse
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.simulation.vehicles import Straight
from strapdown.tables import GEODETIC, VELOCITY

RUNS = 200
GROUPS = {
    "position": slice(0, 3),
    "velocity": slice(3, 6),
    "attitude": slice(6, 9),
    "gyro bias": slice(9, 12),
    "accel bias": slice(12, 15),
    "all": slice(0, 15),
    "heading": slice(8, 9),
}
# Enough to be told from zero, and no more.
LOOSE = EntryPriors(TriadUncertainty(bias=0.05), TriadUncertainty(bias=0.5))


@pytest.fixture(scope="module")
def lively():
    return Clean.of(LIVELY)


@pytest.fixture(scope="module")
def steady():
    return Clean.of(STEADY)


def entry(imu, fixes, priors=PRIORS, **changes):
    return entry_state_from_gnss(
        imu, fixes, **({"impact": IMPACT, "priors": priors, "antenna": ARM} | changes)
    )


@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
def test_without_noise_it_is_the_truth(lively, sampling):
    gyro, accel = TriadErrors(bias=(0.01, -0.01, 0.02)), TriadErrors(bias=(0.2, -0.1, 0.15))
    sure = GnssReceiver(antenna=ARM, stated_position_sd=1e-4, stated_velocity_sd=1e-4)
    imu, _ = simulate_imu(LIVELY, ImuErrors(gyro, accel), rate=200.0, sampling=sampling)
    found = entry(imu, simulate_gnss(LIVELY, sure), LOOSE)
    off = errors_of(found, lively, gyro, accel)
    # Rate and force are lines between samples of 5 ms, and so is the velocity at a fix: wrong by
    # up to h²/8 times the jerk of 20 m/s³, 6e-5 m/s. That is less than what the fixes claim.
    assert (np.abs(off) < found.sd).all()
    assert np.abs(off[3:6]).max() < 6e-5
    assert np.degrees(np.abs(off[6:9]).max()) < 1e-3
    assert found.chi_square < 0.1 * found.degrees_of_freedom
    assert found.findings == ()
    assert found.speed == pytest.approx(np.linalg.norm(found.state.v_n + off[3:6]), abs=6e-5)
    assert found.state.time == IMPACT
    # The rate of its convergence is that of Newton's method.
    assert found.iterations <= 8


@pytest.fixture(scope="module")
def seeded(lively):
    """Normalised squared errors of many drives, per group of states, and the misfits."""
    scores = {name: [] for name in GROUPS} | {"misfit": [], "speed": []}
    for seed in range(RUNS):
        imu, fixes, gyro, accel = drawn_case(lively, PRIORS, seed)
        found = entry(imu, fixes)
        off = errors_of(found, lively, gyro, accel)
        for name, part in GROUPS.items():
            own = found.covariance[part, part]
            scores[name].append(float(off[part] @ np.linalg.solve(own, off[part])))
        scores["misfit"].append(found.chi_square)
        true = float(np.linalg.norm(found.state.v_n + off[3:6]))
        scores["speed"].append(((found.speed - true) / found.speed_sd) ** 2)
    return {name: np.array(values) for name, values in scores.items()}, found


@pytest.mark.slow
@pytest.mark.parametrize("group", [*GROUPS, "misfit", "speed"])
def test_errors_are_as_large_as_the_covariance_says(seeded, group):
    scores, last = seeded
    part = GROUPS.get(group)
    each = 1 if part is None else part.stop - part.start
    each = last.degrees_of_freedom if group == "misfit" else each
    # Sums of squares of normal numbers are chi-square; a sum of 200 of them leaves these bounds
    # once in 10 000 for each of the nine groups.
    low, high = chi2.ppf([5e-5, 1 - 5e-5], RUNS * each)
    assert low < scores[group].sum() < high
    # And none is impossible.
    assert chi2.sf(scores[group].max(), each) > 1e-4 / RUNS


def test_a_few_drives_are_as_wrong_as_they_say(lively):
    total = 0.0
    for seed in range(500, 512):
        imu, fixes, gyro, accel = drawn_case(lively, PRIORS, seed)
        found = entry(imu, fixes)
        off = errors_of(found, lively, gyro, accel)
        total += float(off @ np.linalg.solve(found.covariance, off))
    low, high = chi2.ppf([5e-5, 1 - 5e-5], 12 * 15)
    assert low < total < high


def crash(angles=0.0):
    """A car that brakes not and meets a wall at 11 s."""
    return CrashMotion(
        14.0,
        ORIGIN,
        (12.0, 8.0, 0.0),
        (HaversinePulse(IMPACT, 0.1, (-12.0, -8.0, 0.0), (0.0, 0.0, angles)),),
        heading_deg=33.69,
    )


def test_what_a_receiver_says_after_the_impact_does_not_matter():
    motion = crash(200.0)
    clean = Clean.of(motion)
    imu, fixes, _, _ = drawn_case(clean, PRIORS, 7, on_excess="garbage")
    found = entry(imu, fixes)
    before = fixes[fixes.index < IMPACT - 0.1]
    alone = entry(imu.loc[:IMPACT], before)
    np.testing.assert_array_equal(found.covariance, alone.covariance)
    np.testing.assert_array_equal(found.state.v_n, alone.state.v_n)
    after = found.fixes[found.fixes.index > IMPACT + 0.1]
    assert len(after) == 15
    assert not after["used"].any()
    assert {f.code for why in after["why"] for f in why} == {"crash.fix-after-impact"}


def test_an_impact_that_is_named_late_distrusts_by_what_was_felt():
    clean = Clean.of(crash())
    imu, fixes, _, _ = drawn_case(clean, PRIORS, 8, rate=10.0, on_excess="garbage")
    found = entry(imu, fixes, impact=IMPACT + 0.95)
    struck = found.fixes[(found.fixes.index > IMPACT + 0.05) & (found.fixes.index < IMPACT + 0.9)]
    assert len(struck) >= 8
    assert not struck["used"].any()
    # The mean over the middle half of the pulse is 1.64 times 144 m/s².
    for (reason,) in struck["why"]:
        assert reason.code == "crash.fix-under-acceleration-and-jerk"
        assert 230.0 <= reason.data["acceleration"] < 240.0
    assert any("are rejected" in f.what for f in found.findings)
    off = errors_of(found, clean)
    assert (np.abs(off[3:6]) < 5.0 * found.sd[3:6]).all()


def test_hard_braking_is_no_crash(lively):
    _, fixes, _, _ = drawn_case(lively, PRIORS, 9)
    imu, _, _, _ = drawn_case(lively, PRIORS, 9)
    assert entry(imu, fixes).fixes.loc[: IMPACT - 0.1, "used"].all()


@pytest.mark.parametrize("size", [30.0, 1e5])
def test_false_fixes_lose_their_weight(lively, size):
    imu, fixes, gyro, accel = drawn_case(lively, PRIORS, 11)
    clean = entry(imu, fixes)
    bad = fixes.copy()
    rows = [9, 10, 31]
    for row in rows:
        bad.iloc[row, bad.columns.get_loc("lat")] += size / 111e3
    bad.iloc[20, bad.columns.get_loc("VE")] += 5.0
    found = entry(imu, bad)
    record = found.fixes.set_index(found.fixes.index.to_numpy())
    assert (record.loc[bad.index[rows], "position_weight"] == 0.0).all()
    assert record.loc[bad.index[20], "velocity_weight"] == 0.0
    assert record.loc[bad.index[20], "position_weight"] == 1.0
    # Nothing else is taken with them.
    used = record[record["used"]]
    assert (used["position_weight"] < 1.0).sum() + (used["velocity_weight"] < 1.0).sum() == 4
    assert record.loc[bad.index[20], "why"][0].code == "crash.fix-velocity-misfit"
    assert any("4 fixes are downweighted" in f.what for f in found.findings)
    # The answer moves by a part of what three of forty-nine fixes know.
    assert (
        np.abs(errors_of(found, lively, gyro, accel) - errors_of(clean, lively, gyro, accel))
        < 0.5 * clean.sd
    ).all()


def test_a_steady_straight_drive_does_not_show_the_heading(steady):
    imu, fixes, gyro, accel = drawn_case(steady, PRIORS, 3)
    wide = entry(imu, fixes)
    assert wide.roll_pitch_heading_sd[2] > 20.0
    (said,) = (f for f in wide.findings if f.quantity == "heading")
    assert "side_slip_sd_deg" in str(said.remedy)
    # Speed and course are known nevertheless.
    assert wide.speed_sd < 0.05
    assert wide.course_sd_deg < 0.3
    along = entry(imu, fixes, replace(PRIORS, side_slip_sd_deg=1.0))
    # The slip that stays, and the course.
    assert along.roll_pitch_heading_sd[2] == pytest.approx(1.0, abs=0.1)
    off = errors_of(along, steady, gyro, accel)
    assert np.degrees(abs(off[8])) < 4.0 * along.roll_pitch_heading_sd[2]
    assert along.findings == ()


def test_a_heading_from_elsewhere_and_a_drive_backward(lively):
    imu, fixes, _, _ = drawn_case(lively, PRIORS, 5)
    told = entry(imu, fixes, replace(PRIORS, heading_deg=94.0, heading_sd_deg=0.2))
    assert told.roll_pitch_heading_sd[2] < 0.2
    # The Imu table of a car that drives backward: forward and right are reversed.
    turned = imu.copy()
    turned.attrs = dict(imu.attrs)
    turned[["gyro_x", "gyro_y", "accel_x", "accel_y"]] *= -1.0
    backward = entry(turned, fixes, antenna=(-ARM[0], -ARM[1], ARM[2]))
    forward = entry(imu, fixes)
    apart = (backward.roll_pitch_heading[2] - forward.roll_pitch_heading[2]) % 360.0
    # The two searches begin, and have their prior of 104 deg, up to half a turn apart.
    pull = 180.0 * (forward.roll_pitch_heading_sd[2] / (180.0 / math.sqrt(3.0))) ** 2
    assert apart == pytest.approx(180.0, abs=pull)
    assert backward.chi_square == pytest.approx(forward.chi_square, abs=1.001 * 3.0)


def test_a_standing_car_has_no_heading():
    still = car(ORIGIN, [("stand", Straight(12.0))], heading_deg=70.0)
    imu, fixes, _, _ = drawn_case(Clean.of(still), PRIORS, 3)
    found = entry(imu, fixes)
    assert found.speed < 0.2
    # What the noise of the accelerometers adds up to is taken for motion: a few numbers of the
    # size of their standard deviation, each worth one over a squared radian.
    assert found.roll_pitch_heading_sd[2] > 15.0
    assert any("too slow for a heading" in f.what for f in found.findings)


def test_tilt_and_bias_are_told_apart_by_the_prior_alone(steady):
    imu, fixes, _, _ = drawn_case(steady, PRIORS, 3)
    found = entry(imu, fixes, replace(PRIORS, side_slip_sd_deg=1.0))
    # A bias of b looks like a tilt of b/g: the prior of the bias with what scale and
    # misalignment make of gravity on the forward axis, 0.15 and 0.005 times 9.8.
    forward = math.degrees(math.hypot(0.15, 0.005 * 9.81) / 9.81)
    assert found.roll_pitch_heading_sd[1] == pytest.approx(forward, rel=0.05)
    # Together they are known far better.
    heading = np.radians(found.roll_pitch_heading[2])
    pitch, bias = np.zeros(15), np.zeros(15)
    pitch[6:8], bias[12] = [-np.sin(heading), np.cos(heading)], 1.0
    # Specific force forward is g times the pitch: what a bias adds, a smaller pitch takes away.
    together = 9.81 * pitch + bias
    sd = [math.sqrt(x @ found.covariance @ x) for x in (together, bias, 9.81 * pitch)]
    assert sd[0] < 0.1 * min(sd[1:])


def test_correlated_positions_are_no_new_knowledge(lively):
    imu, _, _, _ = drawn_case(lively, PRIORS, 3)
    places = {}
    for rate in (1.0, 10.0):
        _, fixes, _, _ = drawn_case(lively, PRIORS, 3, rate=rate)
        places[rate] = entry(imu, fixes).sd[0]
    # What wanders by 1.5 m over a minute stays, however often it is asked.
    assert 1.4 < places[10.0] < places[1.0] < 1.6
    _, fixes, _, _ = drawn_case(lively, PRIORS, 3, rate=10.0)
    believed = entry(imu, fixes, replace(PRIORS, position_correlation=FixCorrelation(0.0, 1.0)))
    assert believed.sd[0] < 0.3


def test_an_anchor_before_the_impact(lively):
    imu, fixes, gyro, accel = drawn_case(lively, PRIORS, 21)
    found = entry(imu, fixes, anchor=10.5024)
    assert found.state.time == 10.5
    off = errors_of(found, lively, gyro, accel)
    assert off @ np.linalg.solve(found.covariance, off) < chi2.isf(1e-4, 15)
    late = found.fixes.loc[10.51:10.99, "why"]
    assert {f.code for why in late for f in why} == {"crash.fix-after-anchor"}


def test_velocities_or_places_alone(lively):
    imu, fixes, gyro, accel = drawn_case(lively, PRIORS, 22)
    places = entry(
        imu, fixes.assign(VN=0.0, VE=0.0, VD=0.0, VN_sd=np.inf, VE_sd=np.inf, VD_sd=np.inf)
    )
    off = errors_of(places, lively, gyro, accel)
    assert off @ np.linalg.solve(places.covariance, off) < chi2.isf(1e-4, 15)
    assert places.fixes["velocity_misfit"].isna().all()
    both = entry(imu, fixes)
    assert (places.sd[3:5] > 2.0 * both.sd[3:5]).all()


def test_a_gap_before_the_impact_is_bridged_and_told(lively):
    imu, fixes, gyro, accel = drawn_case(lively, PRIORS, 23)
    found = entry(imu, fixes[fixes.index < IMPACT - 4.0])
    off = errors_of(found, lively, gyro, accel)
    assert off @ np.linalg.solve(found.covariance, off) < chi2.isf(1e-4, 15)
    assert any("dead reckoning" in f.what for f in found.findings)
    assert (found.sd[3:5] > entry(imu, fixes).sd[3:5]).all()


def test_a_receiver_that_claims_too_much_is_told(lively):
    imu, fixes, _, _ = drawn_case(lively, PRIORS, 24, velocity_noise=0.3)
    found = entry(imu, fixes.assign(VN_sd=0.12, VE_sd=0.12, VD_sd=0.12))
    assert any("fit worse" in f.what for f in found.findings)


def bad_cases(imu, fixes):
    few = fixes[(fixes.index > 10.0) & (fixes.index < 10.5)]
    return [
        (
            imu,
            few,
            {},
            DataError,
            r"gnss\.csv, fixes: 2 fixes over 0\.2 s remain before the impact, 2 of",
        ),
        (imu, fixes.assign(quality=0), {}, DataError, r"0 fixes.*49 .the receiver had no fix"),
        (imu, fixes, {"impact": 30.0}, DataError, r"imu.csv, time: the record covers 0 s to"),
        (imu, fixes[fixes.index > 12.0], {}, DataError, "from 1 s to 11 s"),
        (
            imu.drop(columns=["accel_x", "accel_y", "accel_z"]),
            fixes,
            {},
            DataError,
            "imu.csv, accel",
        ),
        (
            imu,
            fixes.assign(VN_sd=0.0),
            {},
            DataError,
            r"gnss\.csv, row 1, VN_sd: a standard deviation is zero",
        ),
        (imu, fixes, {"window": 0.2}, ConfigError, "a window of 0.2 s"),
        (imu, fixes, {"anchor": 11.5}, ConfigError, "the anchor at 11.5 s"),
        (imu, fixes, {"antenna": (0.0, 1.0)}, ConfigError, "three finite numbers"),
    ]


@pytest.mark.parametrize("number", range(9))
def test_what_cannot_be_used_is_refused(lively, number):
    imu, fixes, _, _ = drawn_case(lively, PRIORS, 1)
    imu, fixes, changes, kind, message = bad_cases(imu, fixes)[number]
    with pytest.raises(kind, match=message):
        entry(imu, fixes, **changes)


@pytest.mark.parametrize(
    "changes",
    [
        {"heading_deg": 10.0},
        {"tilt_sd_deg": 0.0},
        {"antenna_sd": -1.0},
        {"time_offset": math.nan},
        {"no_slip_point": (1.0, 2.0)},
    ],
)
def test_priors_are_checked(changes):
    with pytest.raises(ConfigError):
        EntryPriors(GYRO_UNKNOWN, ACCEL_UNKNOWN, **changes)
    with pytest.raises(ConfigError):
        FixCorrelation(1.5, 10.0)


def test_the_tables_are_left_as_they_are(lively):
    imu, fixes, _, _ = drawn_case(lively, PRIORS, 2)
    copies = imu.copy(), fixes.copy()
    found = entry(imu, fixes)
    np.testing.assert_array_equal(imu, copies[0])
    np.testing.assert_array_equal(fixes, copies[1])
    off = biases_off(imu, np.array(found.gyro_bias), np.array(found.accel_bias))
    np.testing.assert_allclose(
        imu["accel_z"] - off["accel_z"], found.accel_bias[2], rtol=0, atol=1e-14
    )
    assert [*GEODETIC, *VELOCITY] == list(fixes.columns[:6])
