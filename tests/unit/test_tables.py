"""Tables refuse what they cannot hold, and say where."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown import tables
from strapdown.errors import DataError

TIME = np.array([0.0, 0.1, 0.2, 0.3])
RATE = np.zeros((4, 3))


def spoiled(array, index, value):
    out = np.array(array, dtype=float)
    out[index] = value
    return out


@pytest.mark.parametrize(
    ("time", "gyro", "message"),
    [
        (spoiled(TIME, 2, np.nan), RATE, r"row 3, time: not a finite number"),
        (spoiled(TIME, 2, 0.1), RATE, "row 3, time: .*time does not increase"),
        (spoiled(TIME, 2, 0.05), RATE, "row 3, time: .*time does not increase"),
        (TIME, spoiled(RATE, (1, 2), np.inf), r"row 2, gyro_z: not a finite number"),
        (TIME[:1], RATE[:1], "1 sample"),
        (TIME, RATE[:3], "different lengths"),
        (["a", "b"], RATE[:2], "an array of numbers of shape"),
        (TIME, RATE[:, :2], "shape"),
    ],
)
def test_an_imu_table_that_is_none(time, gyro, message):
    with pytest.raises(DataError, match=message) as error:
        tables.imu_table(time, gyro, source="log.csv")
    assert str(error.value).startswith("log.csv")
    assert "Remedy" in str(error.value)


def test_the_kind_of_sampling_must_be_stated():
    with pytest.raises(DataError, match="sampling"):
        tables.imu_table(TIME, RATE, sampling="average")
    table = tables.imu_table(TIME, RATE)
    table.attrs.pop("sampling")
    with pytest.raises(DataError, match="sampling"):
        tables.check_imu(table)


def test_a_table_from_elsewhere_is_checked():
    with pytest.raises(DataError, check=coded("tables.missing-columns")):
        tables.check_imu(tables.imu_table(TIME, RATE).drop(columns="gyro_y"))
    half = tables.imu_table(TIME, RATE, RATE).drop(columns="accel_y")
    with pytest.raises(DataError, check=coded("tables.missing-columns")):
        tables.check_imu(half)


def test_increments_must_not_overlap():
    with pytest.raises(
        DataError, check=coded("tables.step-ending-not-positive-or", row=2, quantity="dt")
    ):
        tables.increments_table([0.1, 0.2], [0.1, 0.15], np.zeros((2, 3)))
    with pytest.raises(
        DataError, check=coded("tables.step-ending-not-positive-or", row=1, quantity="dt")
    ):
        tables.increments_table([0.1, 0.2], [0.0, 0.1], np.zeros((2, 3)))
    tables.increments_table([0.1, 0.4], [0.1, 0.1], np.zeros((2, 3)))  # a gap is no overlap


def test_an_attitude_needs_unit_quaternions():
    with pytest.raises(DataError, match="norm 1"):
        tables.attitude_table(TIME[:2], [[1, 0, 0, 0], [1, 1, 0, 0]])
    with pytest.raises(DataError, match="row 2, q_x"):
        tables.attitude_table(TIME[:2], [[1, 0, 0, 0], [1, np.nan, 0, 0]])


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ({"time": 1.0, "kind": "sam"}, "unknown kind"),
        ({"time": 1.0, "kind": "same"}, "since"),
        ({"time": 1.0, "kind": "known", "roll": 1.0, "pitch": 0.0}, "heading"),
        ({"time": 1.0, "kind": "turns", "since": 0.0, "turns": 2}, "axis"),
    ],
)
def test_a_reference_needs_what_its_kind_needs(row, message):
    with pytest.raises(DataError, match=message):
        tables.references_table([row])


def test_gaps_are_found_against_the_log_s_own_habit():
    steady = np.arange(100) * 0.01
    assert tables.find_gaps(steady) == []
    holed = np.concatenate([steady, steady + 3.0])
    (gap,) = tables.find_gaps(holed)
    assert (gap.start, gap.end, gap.sample) == (steady[-1], 3.0, 100)
    assert gap.length == pytest.approx(3.0 - 0.99)
    # Bursts of five with a pause between them are how this log is, and no gap.
    bursts = np.cumsum(np.tile([0.002, 0.002, 0.002, 0.002, 0.042], 50))
    assert tables.find_gaps(bursts) == []
    assert len(tables.find_gaps(np.concatenate([bursts, bursts + bursts[-1] + 0.5]))) == 1


def test_errors_and_standard_deviations_of_a_trajectory():
    table = tables.trajectory_error_table(TIME, RATE, -RATE - 1.0, RATE, "err.csv")
    assert list(table.columns) == tables.TRAJECTORY_ERROR
    tables.check_trajectory_error(table.assign(further=np.nan))
    with pytest.raises(DataError, check=coded("tables.missing-columns")):
        tables.check_trajectory_error(table.drop(columns="down"))
    with pytest.raises(DataError, check=coded("tables.not-finite-number", row=3, quantity="east")):
        tables.trajectory_error_table(TIME, spoiled(RATE, (2, 1), np.nan), RATE, RATE)
    with pytest.raises(DataError, check=coded("tables.arrays-different-lengths")):
        tables.trajectory_error_table(TIME, RATE[:2], RATE, RATE)


@pytest.mark.parametrize("given", [None, "log.csv", np.zeros((3, 6))])
@pytest.mark.parametrize("check", [tables.check_imu, tables.check_trajectory])
def test_what_is_no_table_is_told_where_one_is(check, given):
    with pytest.raises(DataError, check=coded("tables.table-needed-kind", quantity="table")):
        check(given)
