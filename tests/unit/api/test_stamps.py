"""Tables in memory: clocks of pandas, names in levels, other libraries."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from tests.coded import coded

import strapdown as sd
from strapdown.api.stamps import flat, seconds_of
from strapdown.errors import DataError

N = 400
T = 0.01 * np.arange(N)
GYRO = np.column_stack([0.3 * np.sin(T), 0.2 * np.cos(2 * T), 0.4 + 0 * T])
ACCEL = np.tile([0.1, -0.2, -9.8], (N, 1))
NAMES = ["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"]
BASE = pd.DataFrame(np.column_stack([GYRO, ACCEL]), columns=NAMES)
BEGIN = pd.Timestamp("2024-03-05 12:00:00.250")


def end_of(table):
    return sd.attitude(table).iloc[-1].to_numpy()


TRUE = sd.attitude(T, GYRO, ACCEL).iloc[-1].to_numpy()


@pytest.mark.parametrize(
    "index",
    [
        pd.Index(T, name="time"),
        BEGIN + pd.to_timedelta(T, unit="s"),
        (BEGIN + pd.to_timedelta(T, unit="s")).tz_localize("Asia/Tokyo"),
        (BEGIN + pd.to_timedelta(T, unit="s")).as_unit("us"),
        pd.to_timedelta(T, unit="s"),
    ],
)
def test_dates_and_durations_are_seconds(index):
    """They were nanoseconds, taken as seconds."""
    assert end_of(BASE.set_axis(index, axis=0)) == pytest.approx(TRUE, abs=1e-7)
    assert end_of(BASE.assign(time=index)) == pytest.approx(TRUE, abs=1e-7)


def test_the_clock_of_dates_is_kept():
    stamps, said = seconds_of(BEGIN + pd.to_timedelta(T, unit="s"))
    assert said == {"clock": "unix", "clock_origin": BEGIN.floor("s").timestamp()}
    assert stamps[0] == pytest.approx(0.25, abs=1e-12)
    imu = sd.Imu.from_arrays(np.datetime64("2024-03-05") + (1e9 * T).astype("m8[ns]"), GYRO)
    assert imu.attrs["clock"] == "unix"
    assert np.diff(imu.index) == pytest.approx(0.01, abs=1e-9)


@pytest.mark.parametrize(
    ("table", "code"),
    [
        (BASE, "api.index-counts-rows"),
        (BASE.assign(timestamp=T), "api.time-in-other-column"),
        (BASE.set_axis(pd.Index(1000 * T, name="time_ms"), axis=0), "api.time-unit"),
        (BASE.assign(time=pd.to_datetime([None, *range(N - 1)])), "api.stamp-missing"),
    ],
)
def test_what_is_no_time_in_seconds_is_refused(table, code):
    """A default index was taken as seconds, without a word."""
    with pytest.raises(DataError, check=coded(code)):
        sd.attitude(table)


def test_names_in_levels():
    by_time = BASE.set_axis(pd.Index(T, name="time"), axis=0)
    levels = pd.MultiIndex.from_product([["gyro", "accel"], list("xyz")])
    assert end_of(by_time.set_axis(levels, axis=1)) == pytest.approx(TRUE, abs=1e-12)
    units = ["rad/s"] * 3 + ["m/s2"] * 3
    levels = pd.MultiIndex.from_tuples(list(zip(NAMES, units, strict=True)))
    assert end_of(by_time.set_axis(levels, axis=1)) == pytest.approx(TRUE, abs=1e-12)
    levels = pd.MultiIndex.from_tuples(
        [(name, "deg/s" if name[0] == "g" else "g") for name in NAMES]
    )
    with pytest.raises(DataError, check=coded("api.unit-of-level", quantity="gyro_x")):
        sd.attitude(by_time.set_axis(levels, axis=1))
    assert flat(BASE, NAMES) is BASE


def test_a_table_of_another_library():
    table = pa.table({"time": T, **{name: BASE[name].to_numpy() for name in NAMES}})
    assert end_of(table) == pytest.approx(TRUE, abs=1e-12)
