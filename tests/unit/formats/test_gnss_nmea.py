"""Sentences of NMEA 0183."""

from __future__ import annotations

from functools import reduce
from operator import xor

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import DataError
from strapdown.formats.gnss_files import GnssOptions, read_gnss
from strapdown.tables.checks import GEODETIC, POSITION_SD, VELOCITY_SD

# 2024-01-15 23:59:59.5 UTC.
LATE = 1705363199.5


def sentence(body):
    return f"${body}*{reduce(xor, body.encode(), 0):02X}"


def gga(time, lat="4807.0380", ns="N", quality=4, height="545.4", geoid="46.9"):
    return sentence(
        f"GNGGA,{time},{lat},{ns},01131.0000,W,{quality},12,0.9,{height},M,{geoid},M,1.0,0"
    )


def rmc(time, date):
    return sentence(f"GNRMC,{time},A,4807.0380,N,01131.0000,W,10.0,90.0,{date},,,A")


def gst(time, lat="0.011"):
    return sentence(f"GNGST,{time},1.0,,,,{lat},0.012,0.030")


def written(folder, lines):
    path = folder / "rover.nmea"
    path.write_bytes(("\r\n".join(lines) + "\r\n").encode())
    return path


def test_checksum_of_the_standard():
    # The example that manuals of receivers print.
    body = "GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,"
    assert sentence(body).endswith("*47")


def test_places_deviations_dates_over_midnight(tmp_path):
    lines = [gga("235959.50"), rmc("235959.50", "150124"), gst("235959.50")]
    lines += [gga("000000.50", ns="S", quality=1), rmc("000000.50", "160124"), gst("000000.50")]
    table = read_gnss(written(tmp_path, lines))
    assert table.index.tolist() == [LATE, LATE + 1.0]
    lat, lon = 48 + 7.038 / 60, -(11 + 31 / 60)
    # A minute of so many digits is a sum of doubles: 1e-13 deg is 11 nm.
    assert table[GEODETIC].iloc[0].to_numpy() == pytest.approx([lat, lon, 592.3], abs=1e-12)
    assert table["lat"].iloc[1] == pytest.approx(-lat, abs=1e-13)
    assert table[POSITION_SD].iloc[0].tolist() == [0.011, 0.012, 0.03]
    assert table["quality"].tolist() == [4.0, 1.0]
    assert table["satellites"].tolist() == [12.0, 12.0]
    assert table.attrs["clock"] == "unix"


def test_without_a_date_and_without_deviations(tmp_path):
    path = written(tmp_path, [gga("235959.50"), gga("000000.50")])
    with pytest.raises(DataError, check=coded("io.position-sd-not-stated")):
        read_gnss(path)
    table = read_gnss(path, GnssOptions(position_sd=2.0))
    assert table.index.tolist() == [86399.5, 86400.5]
    assert table.attrs["clock"] == "relative"


def test_no_fix_and_a_line_that_is_spoiled(tmp_path):
    empty = sentence("GNGGA,000001.00,,,,,0,00,,,M,,M,,")
    spoiled = gga("000002.00").replace("4807", "4907")
    table = read_gnss(
        written(tmp_path, [empty, spoiled, gga("000003.00"), "# noise"]),
        GnssOptions(position_sd=1.0),
    )
    assert table.index.tolist() == [3.0]
    said = [(f.row, f.code, f.data["count"]) for f in table.attrs["findings"][:2]]
    assert said[0] == (2, "io.nmea-lines-left-out", 1)
    assert said[1] == (1, "io.fixes-without-position-left-out", 1)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([rmc("000000.50", "160124")], "the file has no complete GGA sentence"),
        (
            [gga("000000.50"), gga("000001.50", geoid="")],
            "row 2, GGA height of the geoid: the height is over the sea",
        ),
        ([gga("000000.50", lat="x")], "row 1, GGA latitude: 'x' is not a number"),
        ([sentence("GNGGA,000000.50,1,N")], "row 1, GGA: a GGA of 3 fields"),
        ([gga("000001.00"), gga("000000.50")], "row 2, time: the stamp 0.5 s follows 1 s"),
    ],
)
def test_refused(tmp_path, lines, message):
    with pytest.raises(DataError) as error:
        read_gnss(written(tmp_path, lines), GnssOptions(position_sd=1.0))
    assert message in str(error.value) and "rover.nmea" in str(error.value)
    assert error.value.finding.remedy


def test_speed_and_course_are_a_velocity_without_its_vertical_part(tmp_path):
    lines = [gga("120000.00"), rmc("120000.00", "150124")]
    lines += [gga("120001.00"), sentence("GNVTG,180.0,T,,M,36.0,N,66.7,K,A")]
    lines += [gga("120002.00"), sentence("GNVTG,,T,,M,0.0,N,0.0,K,A")]
    lines += [gga("120003.00"), sentence("GNVTG,,T,,M,0.2,N,0.4,K,A")]
    table = read_gnss(written(tmp_path, lines), GnssOptions(position_sd=2.0, velocity_sd=0.1))
    # A knot is 1852 m an hour: 10 to the east, 36 to the south; a stand; no course of a creep.
    knot = 1852.0 / 3600.0
    told = table[["VN", "VE"]].to_numpy()
    assert told == pytest.approx(np.array([[0, 10], [-36, 0], [0, 0], [0, 0]]) * knot, abs=1e-12)
    known = np.isfinite(table[VELOCITY_SD].to_numpy())
    assert known.tolist() == [[True, True, False]] * 3 + [[False] * 3]
