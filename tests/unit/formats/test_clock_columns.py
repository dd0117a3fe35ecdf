"""Clocks of strangers' tables: in parts, in digits, of other epochs and units; all files synthetic.

Each file has the same samples at 100 Hz from 2026-03-04 09:15:30.25 UTC; what is read is compared
with these times, exactly but for the resolution of the file's stamps.
"""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

import strapdown as sd
from strapdown.errors import DataError
from strapdown.formats.arrays import nanoseconds_of

N = 4000  # over a full minute
START = datetime(2026, 3, 4, 9, 15, 30, 250_000, tzinfo=UTC)
AT = [START + timedelta(milliseconds=10 * k) for k in range(N)]
UNIX = START.timestamp()
MS = 10 * np.arange(N)
US = 250_000 + 1000 * MS  # since the whole second
SECONDS = int(UNIX) + US // 1_000_000
DAYS = 20_516  # from 1970-01-01 to 2026-03-04
OF_DAY = 33_330.25 + MS / 1000
RATES = np.round(np.random.default_rng(8).normal(0.0, 0.2, (N, 3)), 4)
VALUES = [",".join(map(str, r)) + ",0.1,0.2,-9.81" for r in RATES]
NAMES = "gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2"


def table(tmp_path, names, *columns):
    rows = (",".join(map(str, row)) for row in zip(*columns, VALUES, strict=True))
    path = tmp_path / "log.csv"
    path.write_text("\n".join([f"{names},{NAMES}", *rows]) + "\n", encoding="utf-8")
    return path


def check(imu, start=UNIX, within=1e-6):
    """Compare samples and stamps with those written; `start` None: on a clock without a date."""
    np.testing.assert_allclose(imu[["gyro_x", "gyro_y", "gyro_z"]], RATES, atol=1e-12)
    np.testing.assert_allclose(imu.index - imu.index[0], MS / 1000, atol=within)
    assert imu.attrs["clock"] == ("relative" if start is None else "unix")
    if start is not None:
        assert imu.index[0] + imu.attrs["clock_origin"] == pytest.approx(start, abs=within)


def each(form):
    return [at.strftime(form) for at in AT]


def codes(imu):
    return [f.code for f in imu.findings]


PARTS = {
    "timestamp_s,timestamp_us": (SECONDS, US % 1_000_000),
    "sec,msec": (SECONDS, US % 1_000_000 // 1000),
    "time_sec,time_nsec": (SECONDS, US % 1_000_000 * 1000),
    "header.stamp.secs,header.stamp.nsecs": (SECONDS, US % 1_000_000 * 1000),
    "datetime,milliseconds": (each("%Y-%m-%d %H:%M:%S"), US % 1_000_000 // 1000),
    "year,month,day,hour,minute,second": [
        [getattr(at, part) + (at.microsecond / 1e6 if part == "second" else 0) for at in AT]
        for part in ("year", "month", "day", "hour", "minute", "second")
    ],
}


@pytest.mark.parametrize("names", PARTS)
def test_a_clock_in_parts(tmp_path, names):
    imu = sd.read_imu(table(tmp_path, names, *PARTS[names]))
    check(imu)
    assert "io.clock-joined" in codes(imu)


@pytest.mark.parametrize(
    "names",
    {
        "Time,ms": (30_000 + US // 1_000_000, US % 1_000_000 // 1000),
        "hour,min,sec,ms": [[getattr(at, p) for at in AT] for p in ("hour", "minute", "second")],
    },
)
def test_a_clock_in_parts_without_a_date(tmp_path, names):
    ms = US % 1_000_000 // 1000
    if names == "Time,ms":
        columns = [30_000 + US // 1_000_000, ms]
    else:
        columns = [*([getattr(a, p) for a in AT] for p in ("hour", "minute", "second")), ms]
    check(sd.read_imu(table(tmp_path, names, *columns)), None)


def test_two_whole_clocks_are_not_parts_of_one(tmp_path):
    path = table(tmp_path, "timestamp_s,timestamp_us", SECONDS, SECONDS * 1_000_000 + US % 10**6)
    imu = sd.read_imu(path, columns={"time": "timestamp_us"})
    check(imu)
    several = [f for f in imu.findings if f.code == "io.clock-of-several"]
    assert [(f.data["source"], f.data["names"]) for f in several] == [
        ("timestamp_us", ("timestamp_s",))
    ]
    # A counter that begins anew elsewhere is a clock of its own.
    path = table(tmp_path, "time_s,time_us", SECONDS, (US + 500_000) % 1_000_000)
    with pytest.raises(DataError):
        sd.read_imu(path)


DATENUM, JULIAN = DAYS + 719_529, DAYS + 2_440_587.5
TICKS = (SECONDS - int(UNIX)) * 10**7 + US % 10**6 * 10
#: Name and stamps, and the resolution of the stamps, s: of doubles of days, half a unit in the last
#: place of 7e5 and 2.5e6.
EPOCHS = {
    "datenum": ([repr(DATENUM + s / 86_400) for s in OF_DAY.tolist()], 86_400 * 2.0**-34),
    "JD": ([repr(JULIAN + s / 86_400) for s in OF_DAY.tolist()], 86_400 * 2.0**-32),
    "mjd": ([repr(DAYS + 40_587 + s / 86_400) for s in OF_DAY.tolist()], 86_400 * 2.0**-38),
    "Time": ([repr(DAYS + 25_569 + s / 86_400) for s in OF_DAY.tolist()], 86_400 * 2.0**-38),
    "ticks": (621_355_968_000_000_000 + int(UNIX) * 10**7 + TICKS, 1e-6),
    "timestamp": (621_355_968_000_000_000 + int(UNIX) * 10**7 + TICKS, 1e-6),
    "filetime": (116_444_736_000_000_000 + int(UNIX) * 10**7 + TICKS, 1e-6),
    "LabVIEW time": ([f"{UNIX + 2_082_844_800 + m / 1000:.3f}" for m in MS.tolist()], 1e-6),
    "ntp_time": ([f"{UNIX + 2_208_988_800 + m / 1000:.3f}" for m in MS.tolist()], 1e-6),
    "CFAbsoluteTime": ([f"{UNIX - 978_307_200 + m / 1000:.3f}" for m in MS.tolist()], 1e-6),
}


@pytest.mark.parametrize("name", EPOCHS)
def test_clocks_of_other_epochs(tmp_path, name):
    stamps, within = EPOCHS[name]
    imu = sd.read_imu(table(tmp_path, name, stamps))
    check(imu, within=2 * within)
    assert {"io.stamps-of-epoch", "io.clock-joined"} & {*codes(imu)}


def test_stamps_beyond_2045_are_not_of_1970(tmp_path):
    """Seconds since 1904 or 1900: their clock is not named, so that it has no date."""
    imu = sd.read_imu(
        table(tmp_path, "time_s", [f"{UNIX + 2_082_844_800 + m / 1000:.3f}" for m in MS.tolist()])
    )
    check(imu, None)


@pytest.mark.parametrize(
    ("names", "forms"),
    [
        ("date,time", ("%Y%m%d", "%H%M%S.%f")),
        ("date,time", ("%Y%m%d", "%H%M%S%f")),  # cut to milliseconds below
        ("ddmmyy,hhmmss", ("%d%m%y", "%H%M%S.%f")),
        ("timestamp", ("%Y%m%d%H%M%S%f",)),
    ],
)
def test_digits_of_dates_and_times(tmp_path, names, forms):
    columns = [each(form) for form in forms]
    if forms[-1].endswith("%S%f"):
        columns[-1] = [text[:-3] for text in columns[-1]]
    check(sd.read_imu(table(tmp_path, names, *columns)))


def test_milliseconds_of_a_day_beside_a_date_are_no_digits(tmp_path):
    """09:15:30.25 is 33330250 ms, which read as 03:33:30.250 would pass for digits."""
    stamps = np.rint(OF_DAY * 1000).astype(int)
    imu = sd.read_imu(table(tmp_path, "date,time", each("%Y%m%d"), stamps))
    np.testing.assert_allclose(imu.index - imu.index[0], MS / 1000, atol=1e-9)


PAIRS = ("Fecha,Hora", "Datum,Uhrzeit", "Date,Heure", "Data,Ora", "Datum,Tijd", "Tarih,Saat")


@pytest.mark.parametrize("names", (*PAIRS, "Дата,Время", "日付,時刻", "day,clock"))
def test_dates_and_times_in_two_columns(tmp_path, names):
    check(sd.read_imu(table(tmp_path, names, each("%d.%m.%Y"), each("%H:%M:%S.%f"))))


@pytest.mark.parametrize(
    "form",
    ["%Y%m%dT%H%M%S.%fZ", "%Y-%m-%d %I:%M:%S.%f %p", "%d.%m.%Y %I:%M:%S.%f a.m.", "%Y/%m/%d %T.%f"],
)
def test_forms_of_a_date(tmp_path, form):
    check(sd.read_imu(table(tmp_path, "time", each(form))))


def test_minutes_and_seconds(tmp_path):
    check(sd.read_imu(table(tmp_path, "time", each("%M:%S.%f"))), None)


def test_a_date_whose_day_and_month_are_open(tmp_path):
    path = table(tmp_path, "time", each("%d/%m/%Y %H:%M:%S.%f"))
    imu = sd.read_imu(path)
    check(imu, None)
    said = [f for f in imu.findings if f.code == "io.date-order-open"]
    assert [f.severity for f in said] == ["warning"]
    assert [said[0].data[k] for k in ("first", "second")] == ["2026-03-04", "2026-04-03"]
    for order, start in (("d/m/y", UNIX), ("m/d/y", UNIX + 30 * 86_400)):
        stated = sd.read_imu(path, units={"time": order})
        check(stated, start)
        assert "io.date-order-open" not in codes(stated)


@pytest.mark.parametrize(
    ("dates", "first"),
    [
        (("03/04/2026", "04/04/2026"), "2026-04-03"),
        (("03/04/2026", "03/05/2026"), "2026-03-04"),
        (("05/05/2026",), "2026-05-05"),
    ],
)
def test_days_that_follow_decide_their_order(dates, first):
    texts = [f"{date} {'23:59:59' if k == 0 else '00:00:01'}" for k, date in enumerate(dates)]
    stamps = nanoseconds_of(texts)
    assert str(stamps.astype("datetime64[ns]").astype("datetime64[D]")[0]) == first


@pytest.mark.parametrize(
    ("name", "stamps"),
    [
        ("time_10us", 1000 * np.arange(N)),
        ("time (0.1 ms)", 100 * np.arange(N)),
        ("time (h)", [repr(m / 3.6e6) for m in MS.tolist()]),
        ("time_days", [repr(m / 86.4e6) for m in MS.tolist()]),
    ],
)
def test_multiples_of_a_unit_in_a_name(tmp_path, name, stamps):
    check(sd.read_imu(table(tmp_path, name, stamps)), None, 1e-9)


@pytest.mark.parametrize(("factor", "unit"), [(1e5, "10 us"), (1e4, "100 us"), (32_768, "s/32768")])
def test_ticks_are_asked_about(tmp_path, factor, unit):
    path = table(tmp_path, "ticks", np.rint(factor * MS / 1000).astype(int))
    with pytest.raises(DataError, check=coded("io.time-unit-undecided")) as error:
        sd.read_imu(path)
    choices = {c.data["unit"]: c.data["rate_hz"] for c in error.value.finding.data["choices"]}
    assert choices[unit] == pytest.approx(100.0)
    check(sd.read_imu(path, units={"time": unit}), None, 0.5 / factor + 1e-9)


def test_seconds_of_a_day_pass_midnight(tmp_path):
    stamps = [f"{s:.2f}" for s in (86_390.0 + MS / 1000) % 86_400]
    check(sd.read_imu(table(tmp_path, "seconds_of_day", stamps)), None)


# The same clocks of fixes, one a second: the part of a second stays, and a day has larger steps.


SECOND = [START + timedelta(seconds=k) for k in range(60)]
OF_FIXES = {
    "timestamp_s,timestamp_us": [(int(UNIX) + k, 250_000) for k in range(60)],
    "Fecha,Hora": [(f"{at:%d.%m.%Y}", f"{at:%H:%M:%S.%f}") for at in SECOND],
    "ddmmyy,hhmmss": [(f"{at:%d%m%y}", f"{at:%H%M%S.%f}") for at in SECOND],
    "datenum": [(DATENUM + (33_330.25 + k) / 86_400,) for k in range(60)],
    "Time": [(DAYS + 25_569 + (33_330.25 + k) / 86_400,) for k in range(60)],
    "ticks": [(621_355_968_000_000_000 + int((UNIX + k) * 10**7),) for k in range(60)],
    "time": [(UNIX + k,) for k in range(60)],
}


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("names", OF_FIXES)
def test_clocks_of_fixes(tmp_path, names, turned):
    rows = [
        ",".join(map(str, [*stamp, 48.0 + k / 1e5, 11.0, 500.0]))
        for k, stamp in enumerate(OF_FIXES[names])
    ]
    path = tmp_path / "fixes.csv"
    lines = [f"{names},lat,lon,alt_ellipsoid", *(rows[::-1] if turned else rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    fixes = sd.read_gnss(path, position_sd_m=1.0)
    assert fixes.attrs["clock"] == "unix"
    stamps = fixes.index + fixes.attrs["clock_origin"]
    np.testing.assert_allclose(stamps, UNIX + np.arange(60), atol=2e-5)
    np.testing.assert_allclose(fixes["lat"], 48.0 + np.arange(60) / 1e5, rtol=1e-14)
    assert turned == ("io.rows-in-descending-order" in codes(fixes))


def test_the_order_of_a_date_of_fixes(tmp_path):
    rows = [f"{at:%d/%m/%Y},{at:%H:%M:%S},48.0,11.0,500.0" for at in SECOND]
    path = tmp_path / "fixes.csv"
    path.write_text("\n".join(["date,time,lat,lon,alt_ellipsoid", *rows]) + "\n", encoding="utf-8")
    fixes = sd.read_gnss(path, position_sd_m=1.0)
    assert fixes.attrs["clock"] == "relative"
    assert "io.date-order-open" in codes(fixes)
    stated = sd.read_gnss(path, position_sd_m=1.0, units={"time": "d/m/y"})
    assert stated.index[0] + stated.attrs["clock_origin"] == UNIX - 0.25


@pytest.mark.parametrize("form", ["json", "parquet"])
def test_a_clock_in_parts_in_other_tables(tmp_path, form):
    columns = {"sec": SECONDS, "nsec": US % 1_000_000 * 1000}
    held = {n: np.zeros(N) - 9.81 * n.startswith("accel_z") for n in NAMES.split(",")}
    held |= dict(zip(NAMES.split(","), RATES.T, strict=False))
    frame = pd.DataFrame({**columns, **held})
    path = tmp_path / f"log.{form}"
    if form == "json":
        path.write_text(frame.to_json(orient="records"), encoding="utf-8")
    else:
        frame.to_parquet(path)
    check(sd.read_imu(path))
