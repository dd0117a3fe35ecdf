"""What a table's time counts, and how two clocks are brought together."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.formats import read_log
from strapdown.formats.clocks import (
    GPS,
    RELATIVE,
    UNIX,
    WEEK,
    Clock,
    clock_of,
    clock_of_name,
    even_stamps,
    gps_from_unix,
    leap_seconds,
    on_clock_of,
    spread_bursts,
    unix_from_gps,
    unrolled,
    with_clock,
)


def table(time, clock):
    return with_clock(pd.DataFrame({"a": np.zeros(len(time))}, index=pd.Index(time)), clock)


@pytest.mark.parametrize(
    ("date", "ahead"),
    [
        (datetime(1980, 1, 6, tzinfo=UTC), 0),
        (datetime(1981, 6, 30, 23, 59, 59, tzinfo=UTC), 0),
        (datetime(1981, 7, 1, tzinfo=UTC), 1),
        (datetime(1990, 12, 31, tzinfo=UTC), 6),
        (datetime(1999, 1, 1, tzinfo=UTC), 13),
        (datetime(2005, 12, 31, tzinfo=UTC), 13),
        (datetime(2006, 1, 1, tzinfo=UTC), 14),
        (datetime(2009, 1, 1, tzinfo=UTC), 15),
        (datetime(2012, 7, 1, tzinfo=UTC), 16),
        (datetime(2015, 7, 1, tzinfo=UTC), 17),
        (datetime(2017, 1, 1, tzinfo=UTC), 18),
    ],
)
def test_leap_seconds(date, ahead):
    # Differences of GPS time and UTC, Bulletin C of the IERS.
    unix = np.array([date.timestamp()])
    assert leap_seconds(unix).tolist() == [ahead]
    assert unix_from_gps(gps_from_unix(unix)).tolist() == unix.tolist()


def test_every_leap_second_is_at_a_half_year():
    steps = np.arange(315_964_800.0, 1.6e9, 43200.0)
    at = steps[1:][np.diff(leap_seconds(steps)) != 0]
    dates = [datetime.fromtimestamp(t, UTC) for t in at]
    assert len(dates) == 18
    assert {(d.month, d.day, d.hour) for d in dates} <= {(1, 1, 0), (7, 1, 0)}


@pytest.mark.parametrize(
    ("name", "first", "clock"),
    [
        ("gps_sow_s", 243258.0, GPS),
        ("TOW (s)", 1.0, GPS),
        ("time", 456300.0, RELATIVE),
        ("t", 0.0, RELATIVE),
        ("unix_time_ms", 1.7e9, UNIX),
        ("time_ns", 1.7e9, UNIX),
        ("gps_time", 1.4e9, RELATIVE),
    ],
)
def test_what_a_name_tells(name, first, clock):
    assert clock_of_name(name, first) == clock


def test_unrolled():
    time = np.array([WEEK - 1.0, WEEK - 0.5, 0.0, 0.5])
    assert unrolled(time)[0].tolist() == [WEEK - 1.0, WEEK - 0.5, WEEK, WEEK + 0.5]
    assert unrolled(time)[1] == [2]
    # A clock that falls elsewhere is not one of a week.
    for other in ([10.0, 5.0], [WEEK - 1.0, 4000.0], [2 * WEEK, 0.5]):
        assert unrolled(np.array(other)) == (pytest.approx(other), [])


def test_the_origin_of_a_log_of_1970(tmp_path):
    path = tmp_path / "phone.csv"
    first = 1_705_287_845_250
    rows = "".join(f"{first + 10 * k},0.1,0.2,{k / 1000}\n" for k in range(300))
    path.write_text(f"time_ms,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s\n{rows}")
    imu = read_log(path).imu
    assert clock_of(imu) == Clock(UNIX, first * 1e-3)
    fixes = table([1_705_287_846.25], Clock(UNIX))
    shifted, said = on_clock_of(fixes, imu)
    # A double holds a clock of 1970 to 0.24 µs.
    assert shifted.index[0] == pytest.approx(1.0, abs=3e-7)
    assert "count from 1970" in said.what
    assert clock_of(shifted) == clock_of(imu)


def test_gps_and_unix():
    # 2024-01-15 03:04:05.25 UTC: Monday of week 2297, 18 s ahead.
    unix, sow = 1_705_287_845.25, 86400 + 3 * 3600 + 4 * 60 + 5.25 + 18
    imu = table([sow], Clock(GPS))
    assert on_clock_of(table([unix], Clock(UNIX)), imu)[0].index[0] == pytest.approx(sow, abs=3e-7)
    imu = table([sow + WEEK], Clock(GPS, 0.0, 2296))
    shifted, _ = on_clock_of(table([unix], Clock(UNIX)), imu)
    assert shifted.index[0] == pytest.approx(sow + WEEK, abs=3e-7)
    imu = table([0.0], Clock(UNIX, unix))
    shifted, said = on_clock_of(table([sow], Clock(GPS, 0.0, 2297)), imu)
    assert shifted.index[0] == pytest.approx(0.0, abs=3e-7)
    assert "leap seconds" in said.what
    with pytest.raises(DataError, check=coded("io.gps-week-not-stated")):
        on_clock_of(table([sow], Clock(GPS)), imu, "gnss.csv")


def test_weeks_and_unknown_clocks():
    imu = table([5.0], Clock(GPS, 0.0, 2298))
    shifted, said = on_clock_of(table([WEEK + 5.0], Clock(GPS, 0.0, 2297)), imu)
    assert shifted.index.tolist() == [5.0]
    assert "-604800 s were added" in said.what
    same = table([5.0], Clock(GPS))
    unchanged, said = on_clock_of(same, imu)
    assert unchanged is same and said is None
    for other in (Clock(RELATIVE), Clock(UNIX)):
        assert on_clock_of(table([5.0], other), table([0.0], Clock(RELATIVE)))[1] is None


@pytest.mark.parametrize("offset", [0.0, 0.37, 0.99])
@pytest.mark.parametrize("step", [0.02, 0.0203, 0.1])
def test_samples_of_whole_seconds_are_spread_evenly(step, offset):
    """Within one tick over the record in length, and within a tick in the start."""
    true = 1_700_000_000.0 + offset + step * np.arange(1500)
    even = even_stamps(np.floor(true).astype(np.int64))
    assert abs(even.step - step) < 1.0 / 1499
    assert np.abs(even.ticks - true).max() < 1.0
    assert even.tick == 1.0
    # Doubles of a clock of 1970 have 0.24 µs.
    assert np.ptp(np.diff(even.ticks)) < 1e-6
    assert even.off < 1e-6
    # The same in nanoseconds, whole numbers.
    ns = even_stamps(np.floor(true).astype(np.int64) * 10**9)
    assert ns.ticks.dtype == np.int64
    assert np.allclose((ns.ticks - ns.ticks[0]) * 1e-9, even.ticks - even.ticks[0], atol=1e-6)


def test_stamps_that_do_not_fit_a_constant_rate_are_not_spread():
    second = np.floor(0.3 + 0.02 * np.arange(3000))
    assert even_stamps(second) is not None
    # 15 samples lost, 0.3 s, which no constant rate explains; a loss within the tolerance is kept.
    assert even_stamps(np.delete(second, slice(1510, 1525))) is None
    assert even_stamps(np.delete(second, slice(1510, 1514))).off <= 0.1
    assert even_stamps(second[::-1].copy()) is None
    assert even_stamps(np.arange(100.0)) is None
    # Ticks of different lengths are bursts.
    assert even_stamps(np.repeat([0.0, 1.0, 2.7, 3.1, 4.0, 5.3, 6.0], 20)) is None


def test_a_log_of_whole_seconds_says_what_its_stamps_leave_open(tmp_path):
    rows = [f"{int(1.7e9 + 0.4 + 0.02 * k)},0.1,{0.01 * (k % 7)},{k}e-4" for k in range(1000)]
    path = tmp_path / "log.csv"
    path.write_text("time_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s\n" + "\n".join(rows))
    log = read_log(path)
    (said,) = [f for f in log.findings if f.code == "io.stamps-spread-evenly"]
    assert (said.severity, said.data["tick"]) == ("warning", 1.0)
    assert abs(said.data["rate"] - 50.0) < said.data["rate_within"]
    # A tick in the 20 s of the record, of 50 Hz.
    assert said.data["rate_within"] == pytest.approx(50.0 / 20.0, rel=0.01)
    assert len(log.imu) == 1000


def test_a_clock_of_10_ms_repeats_a_stamp_of_104_hz_now_and_then():
    """One stamp in 25 is repeated, and the samples are even all the same."""
    true = np.arange(3000) / 104.0
    stamps = np.floor(true * 100.0).astype(np.int64) * 10
    assert 0.01 < np.mean(np.diff(stamps) == 0) < 0.05
    even = even_stamps(stamps)
    assert even.step == pytest.approx(1000.0 / 104.0, rel=1e-4)
    assert np.abs(even.ticks - 1000.0 * true).max() <= 10.0
    # A stamp or two that are repeated show no clock.
    assert even_stamps(stamps[:50]) is None


def test_packets_with_some_stamps_alike_are_spread():
    """Ten samples a delivery, rounded to the millisecond: some of a packet share their stamp."""
    rng = np.random.default_rng(2)
    true = np.arange(1000) * 0.02
    arrival = np.repeat(true[9::10], 10) + np.tile(np.arange(10) * 4e-4, 100)
    bursts = spread_bursts(np.round(arrival, 3))
    assert bursts.step == pytest.approx(0.02, rel=1e-3)
    assert np.std(bursts.ticks - true) < 0.002
    # Rows that were written twice are no bursts.
    assert spread_bursts(np.sort(np.concatenate([true, true[::50]]))) is None
    assert spread_bursts(true) is None
    assert spread_bursts(rng.permutation(true)) is None
