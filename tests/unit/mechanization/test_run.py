"""What a run asks of its increments and its start, and what it says of them."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.mechanization import (
    NavTracker,
    NorthEastDown,
    Tadic,
    navigate_segments,
    run_mechanization,
)
from strapdown.nav_state import NavState
from strapdown.tables import imu_table, motion_increments_table

START = NavState.from_degrees(50.0, 10.0, 100.0, time=5.0)


def rest(lengths, first=5.0):
    dt = np.asarray(lengths, dtype=np.float64)
    still = np.zeros((dt.size, 3))
    down = np.column_stack([still[:, 0], still[:, 0], -9.81 * dt])
    log = motion_increments_table(first + np.cumsum(dt), dt, still, down, 0.5 * down * dt[:, None])
    log.attrs["source"] = "rest.csv"
    return log


def test_a_run_has_what_went_in_and_came_out():
    log = rest([0.1] * 20)
    run = run_mechanization(NorthEastDown(), START, log)
    assert run.start is START
    assert run.findings == ()
    assert run.source == "rest.csv"
    assert run.trajectory is run.trajectory
    assert run.trajectory.attrs["source"] == "rest.csv"
    assert len(run.time) == len(run.history) == len(run.trajectory) == 21


def test_one_step_is_a_run():
    run = run_mechanization(NorthEastDown(), START, rest([0.1]))
    assert run.end.time == 5.1


@pytest.mark.parametrize("late", [0.2, -0.2, 3600.0])
@pytest.mark.parametrize("backward", [False, True])
def test_a_start_at_another_time_is_refused(late, backward):
    log = rest([0.1] * 10)
    at = (6.0 if backward else 5.0) + late
    start = NavState(at, START.lat, START.lon, 0.0, START.v_n, START.q_nb)
    with pytest.raises(DataError, match=f"the state is of {at:.9g} s") as caught:
        run_mechanization(NorthEastDown(), start, log, backward=backward)
    assert caught.value.finding.file == "rest.csv"
    assert "cut the log" in caught.value.finding.remedy


def test_a_start_within_half_a_step_is_taken():
    start = NavState(5.04, START.lat, START.lon, 0.0, START.v_n, START.q_nb)
    assert run_mechanization(NorthEastDown(), start, rest([0.1] * 10)).trajectory.index[0] == 5.0


def test_an_empty_log_is_refused():
    with pytest.raises(
        DataError,
        match=r"rest\.csv",
        check=lambda refused: refused.finding.code == "mechanization.no-increment",
    ):
        run_mechanization(NorthEastDown(), START, rest([0.1]).iloc[:0])


def test_a_gap_is_refused_and_may_be_allowed():
    log = rest([0.1, 0.1, 2.5, 0.1, 1.5])
    with pytest.raises(DataError) as caught:
        run_mechanization(NorthEastDown(), START, log)
    finding = caught.value.finding
    assert (finding.file, finding.quantity) == ("rest.csv", "dt")
    assert "a gap of 2.5 s, from 5.2 s to 7.7 s" in finding.what
    assert "(2 such gaps)" in finding.what
    assert "longest_step=2.5" in finding.remedy
    run = run_mechanization(NorthEastDown(), START, log, longest_step=2.5)
    assert len(run.trajectory) == 6
    (found,) = run.findings
    assert "2 steps" in found.what


def test_wide_steps_are_told():
    log = rest([0.1] * 10 + [0.4] + [0.1] * 10 + [0.35])
    (found,) = run_mechanization(NorthEastDown(), START, log).findings
    assert "0.4 s, ends at 6.4 s" in found.what
    assert "2 steps are more than three times the usual 0.1 s" in found.what
    assert found.remedy


def test_steps_of_one_beat_are_no_finding():
    log = rest([0.1, 0.12, 0.29, 0.05] * 5)
    assert run_mechanization(NorthEastDown(), START, log).findings == ()


def test_a_damped_height_goes_in_one_piece():
    from strapdown.tables import imu_table

    log = imu_table(5.0 + 0.1 * np.arange(5), np.zeros((5, 3)), np.tile([0, 0, -9.81], (5, 1)))
    with pytest.raises(
        DataError,
        check=lambda refused: refused.finding.code == "mechanization.height-damped-no-reference",
    ):
        list(navigate_segments(NorthEastDown(height="damped"), START, [log]))


@pytest.mark.parametrize("kind", [NorthEastDown, Tadic])
def test_a_name_of_an_ellipsoid_in_capitals(kind):
    assert np.array_equal(
        run_mechanization(kind(ellipsoid="PZ90.11"), START, rest([0.1] * 5)).history,
        run_mechanization(kind(ellipsoid="pz90.11"), START, rest([0.1] * 5)).history,
    )


def test_a_step_that_turns_too_far_is_told():
    time = np.array([1.0, 2.0, 3.0]) * 0.1
    phi = np.array([[0.0, 0.0, 0.1], [0.0, -1.5, 0.0], [0.9, 0.0, 0.0]])
    rest = np.tile([0.0, 0.0, -0.98], (3, 1))
    table = motion_increments_table(time, np.full(3, 0.1), phi, rest, 0.05 * rest)
    run = run_mechanization(NorthEastDown(), NavState.from_degrees(55.0, 37.0), table)
    (finding,) = run.findings
    assert finding.quantity == "phi_y"
    assert "ending at 0.2 s" in finding.what
    assert "-1.5 rad" in finding.what
    calm = table.assign(phi_y=0.0)
    assert (
        run_mechanization(NorthEastDown(), NavState.from_degrees(55.0, 37.0), calm).findings == ()
    )


def test_one_table_is_one_segment():
    log = imu_table(np.arange(9) * 0.1, np.zeros((9, 3)), np.tile([0.0, 0.0, -9.8], (9, 1)))
    start = NavState.from_degrees(55.0, 37.0)
    (alone,) = navigate_segments(NorthEastDown(), start, log)
    (listed,) = navigate_segments(NorthEastDown(), start, [log])
    assert alone.equals(listed)


@pytest.mark.parametrize(("kind", "height"), [("free", 150.0), ("held", 0.0), ("damped", np.inf)])
def test_a_tracker_refuses_a_height_that_it_cannot_use(kind, height):
    tracker = NavTracker(NavState.from_degrees(55.0, 37.0), NorthEastDown(height=kind))
    force = [0.0, 0.0, -9.8]
    with pytest.raises(
        DataError,
        check=coded("mechanization.reference-height-height-or-infinite", quantity="height"),
    ):
        tracker.update(0.0, np.zeros(3), force, height)
    tracker.update(0.0, np.zeros(3), force)
