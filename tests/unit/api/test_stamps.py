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


NAMED = dict(zip(NAMES, ("gx", "gy", "gz", "ax", "ay", "az"), strict=True))


@pytest.mark.parametrize("clock", ["t", "time_ms", "index", "dates"])
def test_a_table_of_any_names_is_read_as_a_file_of_them(tmp_path, clock):
    """Such a table was refused, and `read_imu` took paths alone."""
    table = BASE.rename(columns=NAMED)
    if clock == "index":
        table = table.set_axis(pd.Index(T, name="t"), axis=0)
    elif clock == "dates":
        table = table.set_axis(BEGIN + pd.to_timedelta(T, unit="s"), axis=0)
    else:
        table.insert(0, clock, T * (1000.0 if clock == "time_ms" else 1.0))
    units = {"gyro": "rad/s", "accel": "m/s2"}
    imu = sd.read_imu(table, units=units, axes="x,y,z")
    np.testing.assert_array_equal(imu[NAMES].to_numpy(), BASE.to_numpy())
    np.testing.assert_allclose(imu.index, T, atol=1e-9)
    file = tmp_path / "log.csv"
    table.to_csv(file, index=clock in ("index", "dates"), index_label="time")
    of_file = sd.read_imu(file, units=units, axes="x,y,z")
    np.testing.assert_array_equal(imu[NAMES], of_file[NAMES])
    assert {f.code for f in imu.findings} == {f.code for f in of_file.findings}
    # Without a file a result keeps the samples.
    assert "file" not in imu.attrs
    assert end_of(imu) == pytest.approx(TRUE, abs=1e-9)


def test_fixes_of_any_names_in_memory():
    seconds = np.arange(60.0)
    table = pd.DataFrame(
        {"utc": BEGIN + pd.to_timedelta(seconds, unit="s"), "Latitude": 47.5 + 1e-6 * seconds}
    ).assign(Longitude=8.5, **{"Altitude (m)": 450.0})
    fixes = sd.read_gnss(table, position_sd_m=2.0)
    np.testing.assert_array_equal(fixes["lat"], table["Latitude"])
    assert fixes["alt"].iloc[0] == 450.0
    assert "file" not in fixes.attrs


def test_what_a_table_of_any_names_leaves_open_is_asked():
    table = BASE.rename(columns=NAMED).assign(t=T)
    table[["gx", "gy", "gz"]] *= 1e-4
    with pytest.raises(DataError, match=r'units=\{"gyro": UNIT\}'):
        sd.attitude(table)


def test_warnings_stand_below_a_table():
    """Rates in deg/s, which are taken as rad/s, were seen in `findings` alone."""
    found = sd.attitude(T, 100.0 * GYRO, ACCEL)
    assert [f.code for f in found.findings] == ["attitude.rate-implausible"]
    for shown in (repr(found), repr(found.head(1)), found._repr_html_()):
        assert "are usually in deg/s" in shown
    assert "warning" not in repr(sd.attitude(T, GYRO, ACCEL))


# Tables for `read_imu` and `read_gnss`: rates that state their unit, of a body that turns.
TABLE = BASE.add_suffix("_rad_s").rename(columns=lambda n: n.replace("accel", "acc")).assign(time=T)
TABLE.columns = [n.replace("_rad_s", "_m_s2") if "acc" in n else n for n in TABLE.columns]
WHOLE = sd.read_imu(TABLE, axes="x,y,z", sampling="instantaneous", units={"time": "s"})


def same_as_whole(table, **units):
    read = sd.read_imu(table, axes="x,y,z", sampling="instantaneous", units=units or None)
    assert np.array_equal(read.to_numpy(), WHOLE.to_numpy())
    assert read.index.to_numpy() == pytest.approx(T, abs=1e-9)


@pytest.mark.parametrize(
    "table",
    [
        pd.concat([TABLE[:200], TABLE[200:].reset_index(drop=True)]),
        pd.concat([TABLE[:200], TABLE[200:].reset_index(drop=True)]).rename(
            columns={"time": "stamp"}
        ),
        TABLE.set_index("time", drop=False),
        TABLE.set_index(["time", "gyro_x_rad_s"], drop=False),
        TABLE.astype(str),
        TABLE.astype(object),
    ],
)
def test_a_clock_among_the_columns_is_the_clock(table):
    """An index of the same name, or of repeated numbers of rows, was a second one."""
    same_as_whole(table, time="s")


@pytest.mark.parametrize("to_objects", [False, True])
def test_durations_of_a_table_to_be_read_are_seconds(to_objects):
    """Without another answer: a unit was asked, or the column was left out."""
    clock = pd.Series(pd.to_timedelta(T, unit="s"))
    same_as_whole(TABLE.assign(time=clock.astype(object) if to_objects else clock))
    same_as_whole(TABLE.drop(columns="time").set_index(pd.TimedeltaIndex(clock)))


def test_a_text_among_numbers_is_a_row_that_is_refused_or_left_out():
    table = TABLE.astype(str)
    table.loc[7, "gyro_x_rad_s"] = "overflow"
    with pytest.raises(DataError) as caught:
        sd.read_imu(table, axes="x,y,z", units={"time": "s"})
    assert caught.value.finding.row == 8
    read = sd.read_imu(table, axes="x,y,z", units={"time": "s"}, repair=True)
    assert len(read) == N - 1


FIXES = pd.DataFrame({"time": T, "lat": 50.0 + 1e-6 * T, "lon": 30.0 + 0 * T, "alt": 100.0 + 0 * T})


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda t: pd.concat([t, t.iloc[:, :1]], axis=1), "api.column-named-twice"),
        (lambda t: t.set_axis([0, "0", *t.columns[2:]], axis=1), "api.column-named-twice"),
        (lambda t: t[:0], "api.table-too-short"),
        (lambda t: t[:1], "api.table-too-short"),
        (lambda t: t.assign(note=[1, *["a"] * (N - 1)]), "api.not-numeric"),
    ],
)
def test_a_table_that_cannot_be_read_is_refused(change, code):
    """Each was an error of another package, or of a file."""
    for read, table in ((sd.read_imu, TABLE), (sd.read_gnss, FIXES)):
        with pytest.raises(DataError, check=coded(code)):
            read(change(table))


def test_a_column_twice_is_refused_by_every_door():
    """The rates of a table with gyro_x twice were those of other columns."""
    twice = pd.concat([BASE.assign(time=T), BASE[["gyro_x"]]], axis=1)
    levels = twice.set_axis(
        pd.MultiIndex.from_tuples(
            [tuple(n.rsplit("_", 1)) if "_" in n else (n, "") for n in twice]
        ),
        axis=1,
    )
    for call in (sd.attitude, sd.doctor, sd.compare_attitude):
        for table in (twice, levels):
            with pytest.raises(DataError, check=coded("api.column-named-twice")):
                call(table)
