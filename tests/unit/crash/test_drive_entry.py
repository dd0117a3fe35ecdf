"""What a drive before the crash shows of a recorder, and what the crash inherits of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom
from tests.coded import coded
from tests.unit.crash import drive_case as case

from strapdown.crash import entry_estimate
from strapdown.crash.delta_v import delta_v
from strapdown.crash.delta_v_bound import body_delta_v_bound
from strapdown.crash.drive_entry import DriveEntry, lower_root
from strapdown.crash.entry import STATES, rotated
from strapdown.errors import ConfigError
from strapdown.rotation import (
    cross_matrix,
    dcm_from_quaternion,
    dcm_from_rotation_vector,
    rotation_vector_from_dcm,
)

SHORT = case.Road(
    length=16.0,
    pushes=((-15.0, 3.0, 6.0), (-8.0, 3.0, -6.0), (-4.0, 2.0, 4.0)),
    bends=((-12.0, 3.0, 50.0), (-5.0, 3.0, -60.0)),
)
KEYS = {"bias": "accel bias", "scale": "accel scale"}
#: Runs of each coverage.
RUNS = 60


@pytest.fixture(scope="module")
def drive():
    return case.Drive(SHORT)


@pytest.fixture(scope="module")
def draw(drive):
    return case.drawn(drive, 3)


@pytest.fixture(scope="module")
def by_fixes(draw):
    return case.reconstructed(draw, "fixes", window=16.0)


def errors_of(state, truth):
    """Estimate minus truth in standard deviations, and the share of the stated one that is left."""
    rows = state.calibration[~state.calibration["quantity"].str.startswith("speed")]
    return {
        (row["quantity"], row["axis"]): (
            (row["error"] - truth[KEYS.get(row["quantity"], row["quantity"])][row["axis"]])
            / row["sd"],
            row["sd"] / row["stated"],
            row["in_crash"] / row["stated"],
        )
        for row in rows.to_dict("records")
    }


def test_it_is_as_wrong_as_it_says_and_less_than_was_stated(by_fixes, draw):
    *_, state = by_fixes
    found = errors_of(state, draw.truth)
    # Of 15 normal numbers one in 100 draws has one beyond 3.4.
    assert max(abs(z) for z, *_ in found.values()) < 3.4
    for what in (("scale", 0), ("scale", 1), ("gyro scale", 2), ("mounting", 2), ("bias", 1)):
        assert found[what][1] < 0.6, what
    # A slope looks the same, and no drive turns about the forward axis.
    for what in (("scale", 2), ("bias", 2), ("gyro scale", 0), ("gyro scale", 1)):
        assert found[what][1] > 0.9, what
    # Nothing is more certain in the crash than by the drive.
    assert all(kept >= left * (1.0 - 1e-9) for _, left, kept in found.values())


def test_the_crash_inherits_what_is_left(by_fixes, draw, drive):
    at, entry, _ = by_fixes
    answer = case.answer(at, entry)
    found = delta_v(answer.acceleration, *case.OVER, across_gaps=True)
    bound = body_delta_v_bound(at.effects, found.weights)
    off = found.vector - drive.delta_v()
    assert (np.abs(off) < 3.4 * np.array(bound.sd)).all()
    # As stated: 2 % of 9 m/s and 3 deg of it.
    assert bound.sd[0] < 0.5 * 0.02 * 9.0
    assert bound.sd[1] < 0.5 * np.radians(3.0) * 9.0
    # Ranges beyond the drive have their nonlinearity as stated: 0.3 % at 50 g, bent by the square.
    t = at.time
    within = (t > -0.1) & (t < 0.2)
    named = at.effects.names.index("box accelerometer nonlinearity x")
    bent = 0.003 / 490.0 * np.square(at.force[within, 0]).max()
    assert np.abs(at.effects.force[named][within]).max() == pytest.approx(bent, rel=0.1)


def test_a_range_without_nonlinearity_keeps_its_stated_scale(draw):
    unit = draw.unit
    low = unit.accelerometers[0]
    linear = replace(low, uncertainty=replace(low.uncertainty, nonlinearity_2=0.0))
    bare = replace(draw, unit=replace(unit, accelerometers=(linear,)))
    at, _, state = case.reconstructed(bare, "fixes", window=16.0)
    found = errors_of(state, draw.truth)
    assert found["scale", 0][1] < 0.6
    assert found["scale", 0][2] == 1.0
    # The gyro is not asked for more than three times what the drive turned.
    assert [f.code for f in state.findings if f.code == "crash.drive-below-crash"]
    own = [k for k, name in enumerate(at.effects.names) if "scale x" in name and "gyro" not in name]
    felt = np.abs(at.force[:, 0]).max()
    kept = np.sqrt(np.square(np.abs(at.effects.force[own]).max(axis=1)).sum())
    assert kept == pytest.approx(0.02 * felt, rel=0.1)


def test_a_speed_may_be_of_the_instant_of_a_fix(draw):
    # Late by 0.1 s as stated, the means of five stamps are of quarter seconds, fixes of halves.
    fixes, speeds = draw.fixes.copy(), draw.speeds.copy()
    for table in (fixes, speeds):
        table.index = table.index.to_numpy().round(2)
    together = replace(draw, fixes=fixes, speeds=speeds)
    _, _, state = case.reconstructed(together, "both", window=16.0)
    assert max(abs(z) for z, *_ in errors_of(state, draw.truth).values()) < 3.4
    assert state.fixes["used"].sum() > 20
    assert state.speeds["used"].sum() > 30


def test_speeds_show_the_mounting_and_not_more_than_the_tires(draw):
    _, entry, state = case.reconstructed(draw, "speeds", window=16.0)
    found = errors_of(state, draw.truth)
    assert max(abs(z) for z, *_ in found.values()) < 3.4
    assert found["mounting", 2][1] < 0.6
    rows = state.calibration.set_index("quantity")
    assert rows.loc["scale", "sd"].iloc[0] > 0.9 * rows.loc["speed scale", "sd"] * 0.5
    # In axes of the vehicle at the entry.
    assert entry.heading_deg == pytest.approx(0.0, abs=0.5) or entry.heading_deg > 359.5
    assert state.speeds["used"].any()
    late = state.speeds.index > -0.02
    assert not state.speeds["used"][late].any()


def test_a_delay_that_is_far_off_is_found_and_one_beyond_chance_is_said(drive):
    """Two stated standard deviations late: linear about the stated delay it was 0.25 s."""
    late = case.drawn(drive, 3, delay=0.3)
    _, _, state = case.reconstructed(late, "speeds", window=16.0)
    row = state.calibration.set_index("quantity").loc["speed delay"]
    assert abs(row["error"] - 0.3) < 3.4 * row["sd"] < 0.1
    assert "crash.drive-contradicts-stated" not in {one.code for one in state.findings}
    _, _, state = case.reconstructed(late, "speeds", window=16.0, speed_delay_sd=0.03)
    said = [f for f in state.findings if f.code == "crash.drive-contradicts-stated"]
    assert [f.data["sigmas"] > 4.0 for f in said if f.quantity == "speed delay"] == [True]


def test_a_unit_bolted_across_is_found_about_its_stated_angle(drive):
    across = case.drawn(drive, 4, turned=90.0)
    _, _, state = case.reconstructed(across, "fixes", window=16.0)
    assert abs(errors_of(state, across.truth)["mounting", 2][0]) < 3.4


@pytest.fixture(scope="module", params=["fixes", "speeds"])
def solved(request, draw):
    """Search of a drive at its solution, and the solution."""
    found = []
    result = entry_estimate._Search.result

    def kept(search, *arguments):
        best = result(search, *arguments)
        found.append((search, best))
        return best

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(entry_estimate._Search, "result", kept)
        case.reconstructed(draw, request.param, window=16.0)
    search, best = found[-1]
    search._moved = np.inf
    return search, best, search.problem()


def test_derivatives_are_those_of_the_residuals(solved):
    search, best, before = solved
    sd = np.sqrt(np.diag(best.joint))
    own, further = best.own_bias, np.concatenate([best.parameters, best.constants])
    # Positions move nothing else, and constants of vehicle and receiver are linear.
    for k in np.flatnonzero(sd[3:] > 0.0) + 3:
        step = np.zeros(STATES + len(further))
        step[k] = 0.01 * sd[k]
        search.state = replace(
            best.state, v_n=best.state.v_n + step[3:6], q_nb=rotated(best.state.q_nb, step[6:9])
        )
        search.bias, search.further = own + step[9:STATES], further + step[STATES:]
        change = before.residuals - search.problem().residuals
        search.state, search.bias, search.further = best.state, own, further
        linear = before.by_constants[:, :, k] * step[k]
        off = np.where(before.there, change - linear, 0.0)
        # To a fifth of itself, or a standard deviation of the unknown to a fifth of the noise.
        # Without the order of the turns of a mounting (left Jacobian) it is half of both; what
        # the Earth's rotation adds, and the derivatives neglect, is an eighth.
        size = np.abs(np.where(before.there, linear, 0.0)).max(axis=0)
        noise = 0.01 * np.sqrt(before.variance).max(axis=0)
        assert (np.abs(off).max(axis=0) <= 0.2 * np.maximum(size, noise)).all(), k


def test_a_turn_of_the_unit_in_the_vehicle_is_no_turn_of_antenna_and_axle(solved):
    search, best, before = solved
    C = dcm_from_quaternion(best.state.q_nb)
    mounted = search.errors.rotation
    for k in np.flatnonzero(mounted.any(axis=0)):
        # The vehicle turns back, so that the unit stays where it is: no force is felt otherwise.
        size = 0.1
        more = np.concatenate([best.parameters, best.constants])
        whole = mounted @ best.parameters
        more[k] += size
        turned = dcm_from_rotation_vector(mounted @ more[: len(best.parameters)])
        turn = C @ rotation_vector_from_dcm(dcm_from_rotation_vector(whole) @ turned.T)
        search.state = replace(best.state, q_nb=rotated(best.state.q_nb, turn))
        search.further = more
        change = before.residuals - search.problem().residuals
        by = before.by_constants
        linear = size * by[:, :, STATES + k] + by[:, :, 6:9] @ turn
        left = np.where(before.there, np.abs(change - linear), 0.0)[:, 3:8].max(axis=0)
        search.state = best.state
        search.further = np.concatenate([best.parameters, best.constants])
        # The turning of the Earth, neglected in the derivatives, tilts this turn over 16 s.
        earth = 7.3e-5 * 16.0 * size * np.radians(case.MOUNTING_SD) * 9.81 * 16.0 / 2.0
        assert (left < [earth] * 3 + [earth / SHORT.speed] * 2).all()


def test_standing_is_what_fixes_or_speeds_say():
    speed = [5.0, 0.0, 0.1, 0.0, 3.0, 0.0, 0.0]
    table = pd.DataFrame({"speed": speed}, index=pd.Index(np.arange(7.0), name="time"))
    assert DriveEntry(speeds=table).stood() == ((1.0, 3.0), (5.0, 6.0))


def test_neither_fixes_nor_speeds_are_refused():
    with pytest.raises(ConfigError, check=coded("crash.drive-without-fixes-or-speeds")):
        DriveEntry()


def test_the_root_of_a_covariance_leaves_out_what_has_no_variance():
    root = np.array([[2.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.5, 0.0, 1.0]])
    assert lower_root(root @ root.T) == pytest.approx(root)
    some = cross_matrix(np.array([1.0, 2.0, 3.0])) + 2.0 * np.eye(3)
    assert lower_root(some @ some.T) == pytest.approx(np.linalg.cholesky(some @ some.T))


@pytest.mark.slow
@pytest.mark.parametrize("by", ["fixes", "speeds"])
def test_bounds_hold_as_often_as_they_say(by):
    held: dict[object, list[bool]] = {}
    for seed in range(RUNS):
        g = np.random.default_rng(10_000 + seed)
        road = case.Road(
            slip_deg=0.5 * g.standard_normal(),
            slip_slope_deg=0.5 * g.standard_normal(),
            squat_deg=0.2 * g.standard_normal(),
        )
        drive = case.Drive(road)
        draw = case.drawn(drive, seed)
        at, entry, state = case.reconstructed(draw, by)
        for what, (z, *_) in errors_of(state, draw.truth).items():
            held.setdefault(what, []).append(abs(z) < 1.96)
        found = delta_v(case.answer(at, entry).acceleration, *case.OVER, across_gaps=True)
        bound = body_delta_v_bound(at.effects, found.weights)
        true = drive.delta_v()
        for k, off in enumerate(found.vector - true):
            held.setdefault(f"delta-V {k}", []).append(abs(off) < 1.96 * bound.sd[k])
        x, y, _ = found.vector
        turned = np.arctan2(y, x) - np.arctan2(true[1], true[0])
        sd = bound.along([-y, x, 0.0]) / np.hypot(x, y)
        held.setdefault("PDOF", []).append(abs(turned) < 1.96 * sd)
    # Lower end of the 99 % interval of a count of RUNS at 95 %; the priors of slip and of the
    # receiver are wider than what was drawn, so that more may hold.
    least = binom.ppf(0.005, RUNS, 0.95)
    assert {what: sum(rows) for what, rows in held.items() if sum(rows) < least} == {}
