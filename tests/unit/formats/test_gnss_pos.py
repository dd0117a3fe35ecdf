"""Solutions of RTKLIB: every header that it writes, and what is wrong in them."""

from __future__ import annotations

import numpy as np
import pytest
from tests.coded import coded

from strapdown import frames, rotation
from strapdown.errors import DataError
from strapdown.formats.gnss_files import GnssOptions, read_gnss
from strapdown.tables.checks import GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD

NOTE = "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of)"
LEVEL = "latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)"
LEVEL += "  sdne(m)  sdeu(m)  sdun(m) age(s)  ratio"
MORE = "    vn(m/s)    ve(m/s)    vu(m/s)      sdvn     sdve     sdvu    sdvne    sdveu    sdvun"
PLACE = "  -35.681236123  139.767125456    40.1234"
SDS = "   0.0123   0.0098   0.0210  -0.0011   0.0005  -0.0003   1.20   99.9"
# 2024-01-15 03:04:05.25 is a Monday: week 2297, day 1.
DAY, SOW, WEEK = "2024/01/15 03:04:05.250", 86400 + 3 * 3600 + 4 * 60 + 5.25, 2297


def row(time=DAY, place=PLACE, q=1, sds=SDS, more=""):
    return f"{time} {place} {q:3d}   9 {sds}{more}"


def pos(path, rows, header=LEVEL, system="GPST", note=NOTE, end="\r\n"):
    path = path / "rover.pos"
    head = ["% program   : RTKLIB ver.2.4.3", *([note] if note else []), f"%  {system}   {header}"]
    path.write_bytes((end.join([*head, *rows]) + end).encode())
    return path


def later(k):
    return f"2024/01/15 03:04:{5 + k:02d}.250"


def test_degrees_and_dates(tmp_path):
    table = read_gnss(pos(tmp_path, [row(), row(later(1), q=2)]))
    assert table.index.tolist() == [SOW, SOW + 1.0]
    assert table[GEODETIC].iloc[0].tolist() == [-35.681236123, 139.767125456, 40.1234]
    assert table[POSITION_SD].iloc[0].tolist() == [0.0123, 0.0098, 0.0210]
    assert np.isinf(table[VELOCITY_SD].to_numpy()).all()
    assert table["quality"].tolist() == [4, 5]
    assert table["satellites"].tolist() == [9, 9]
    assert table.attrs["clock"] == "gps-seconds-of-week" and table.attrs["gps_week"] == WEEK


@pytest.mark.parametrize(
    ("system", "time", "seconds"),
    [
        ("GPST", f"{WEEK} {SOW:.3f}", SOW),
        # 18 leap seconds since 2017; before 2015-07-01 they were 16.
        ("UTC", DAY, SOW + 18.0),
        ("UTC", "2015/06/29 03:04:05.250", SOW + 16.0),
        ("JST", "2024/01/15 12:04:05.250", SOW + 18.0),
        # The first second of a Sunday in Japan is still the week before.
        ("JST", "2024/01/14 00:00:00.500", 6 * 86400 + 15 * 3600 + 18.5),
    ],
)
def test_time_systems(tmp_path, system, time, seconds):
    table = read_gnss(pos(tmp_path, [row(time)], system=system))
    assert table.index.tolist() == [seconds]


def test_the_end_of_a_week_counts_on(tmp_path):
    rows = [row("2024/01/20 23:59:59.500"), row("2024/01/21 00:00:00.500")]
    table = read_gnss(pos(tmp_path, rows))
    assert table.index.tolist() == [604799.5, 604800.5]
    rows = [row("2297 604799.500"), row("2298 0.500")]
    assert read_gnss(pos(tmp_path, rows)).index.tolist() == [604799.5, 604800.5]


@pytest.mark.parametrize("separator", [" ", ",", ";", "\t"])
def test_degrees_minutes_seconds_and_separators(tmp_path, separator):
    fields = ["-0", "40", "52.45004", "139", "46", "01.65164", "40.1234", "1", "9"]
    fields += SDS.split()
    header = LEVEL.replace("(deg)", "(d'\")").split()
    text = separator.join([DAY, *fields])
    path = pos(tmp_path, [text], header=separator.join(header))
    if separator != " ":
        path.write_text(path.read_text().replace("GPST   ", f"GPST   {separator}"))
    table = read_gnss(path)
    # Between the equator and one degree south only the sign of a zero says where.
    assert table["lat"].iloc[0] == pytest.approx(-(40 / 60 + 52.45004 / 3600), abs=1e-14)
    assert table["lon"].iloc[0] == pytest.approx(139 + 46 / 60 + 1.65164 / 3600, abs=1e-13)


def test_velocity_up_is_turned(tmp_path):
    more = "  1.5 -2.5 0.25  0.01 0.02 0.03 0.0 0.0 0.0"
    table = read_gnss(pos(tmp_path, [row(more=more)], header=LEVEL + MORE))
    assert table[VELOCITY].iloc[0].tolist() == [1.5, -2.5, -0.25]
    assert table[VELOCITY_SD].iloc[0].tolist() == [0.01, 0.02, 0.03]


def test_cartesian_places_with_their_covariance(tmp_path):
    lat, lon, alt = 48.0, 11.0, 500.0
    xyz = frames.ecef_from_geodetic([lat, lon, alt])
    C = rotation.dcm_from_quaternion(frames.q_ne(lat, lon))
    level = np.array([[4.0, 1.0, -0.5], [1.0, 9.0, 2.0], [-0.5, 2.0, 25.0]])
    P = C.T @ level @ C
    root = [np.sign(P[i, j]) * np.sqrt(abs(P[i, j])) for i, j in ((0, 1), (1, 2), (2, 0))]
    sds = " ".join(f"{v:.9f}" for v in [*np.sqrt(np.diag(P)), *root])
    velocity = C.T @ [3.0, -4.0, 0.5]
    header = "x-ecef(m) y-ecef(m) z-ecef(m) Q ns sdx(m) sdy(m) sdz(m) sdxy(m) sdyz(m) sdzx(m)"
    header += " age(s) ratio vx(m/s) vy(m/s) vz(m/s) sdvx sdvy sdvz sdvxy sdvyz sdvzx"
    speeds = " ".join(f"{v:.9f}" for v in velocity)
    text = row(
        place=" ".join(f"{v:.6f}" for v in xyz),
        sds=f"{sds} 1.0 2.0 {speeds} {sds}",
    )
    table = read_gnss(pos(tmp_path, [text], header=header, note="% (x/y/z-ecef=WGS84,Q=1:fix)"))
    # Half a micrometre of rounding along each axis; 1e-11 deg is a micrometre.
    assert table[GEODETIC].iloc[0].to_numpy() == pytest.approx([lat, lon, alt], abs=2e-6)
    assert table["lat"].iloc[0] == pytest.approx(lat, abs=2e-11)
    assert table[POSITION_SD].iloc[0].to_numpy() == pytest.approx([2.0, 3.0, 5.0], abs=1e-7)
    assert table[VELOCITY_SD].iloc[0].to_numpy() == pytest.approx([2.0, 3.0, 5.0], abs=1e-7)
    assert table[VELOCITY].iloc[0].to_numpy() == pytest.approx([3.0, -4.0, 0.5], abs=2e-9)


@pytest.mark.parametrize(
    ("q", "quality"), [(0, 0), (1, 4), (2, 5), (3, 2), (4, 2), (5, 1), (6, 3), (7, 6)]
)
def test_quality(tmp_path, q, quality):
    assert read_gnss(pos(tmp_path, [row(q=q)]))["quality"].tolist() == [quality]


def test_zero_means_unknown(tmp_path):
    zero = SDS.replace("0.0098", "0.0000")
    table = read_gnss(pos(tmp_path, [row(), row(later(1), sds=zero)]))
    assert table["east_sd"].tolist() == [0.0098, np.inf]
    said = next(f for f in table.attrs["findings"] if "of zero" in f.what)
    assert (said.row, said.quantity) == (5, "east_sd")
    table = read_gnss(tmp_path / "rover.pos", GnssOptions(position_sd=(0.1, 0.2, 0.3)))
    assert table[POSITION_SD].iloc[1].tolist() == [0.1, 0.2, 0.3]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"note": NOTE.replace("ellipsoidal", "geodetic")}, "alt: heights are over the sea"),
        ({"note": NOTE.replace("WGS84", "Tokyo")}, "lat, lon: the positions refer to the datum"),
        (
            {
                "header": LEVEL.replace(
                    "latitude(deg) longitude(deg)", "e-baseline(m) n-baseline(m)"
                )
            },
            "row 3, lat, lon: the file has baselines from the base station",
        ),
        (
            {"header": LEVEL.replace(" height(m)", " heit(m)")},
            "row 3, height(m): the line with the names of the columns is damaged",
        ),
        ({"header": "nothing of use"}, "no line names the columns"),
        ({"rows": []}, "row 3: the file has a header and no solution"),
        ({"rows": [row(), row(later(1)) + " 1.0", row(later(2))]}, "row 5: 20 numbers"),
        (
            {"rows": [row(), row(later(1), sds=SDS.replace("0.0098", "0,0098")), row(later(2))]},
            "row 5, sde(m): '0,0098' is not a number\n  Remedy: correct or delete that row; dec",
        ),
        ({"rows": [row(), row(later(1), q=8)]}, "row 5, Q: unknown solution type 8"),
        (
            {"rows": [row(later(1)), row()]},
            "row 5, time: the stamp 97445.25 s follows 97446.25",
        ),
        ({"rows": [row(), row()]}, "row 5, time: the stamp 97445.25 s repeats an earlier one"),
        ({"rows": [row(), row("1979/01/15 03:04:05.250")]}, "row 5, time: the time is neither"),
        (
            {"rows": [row(), row(later(1), sds=SDS.replace("0.0098", "-0.098"))]},
            "row 5, east_sd: a standard deviation of -0.098",
        ),
        (
            {"rows": [row(), row(later(1), place="139.767125456 -35.681236123 40.0")]},
            "row 5, lat: a latitude of 139.767125 deg is beyond the pole",
        ),
    ],
)
def test_refused(tmp_path, options, message):
    asked = {"rows": [row()]} | options
    with pytest.raises(DataError) as error:
        read_gnss(pos(tmp_path, **asked))
    assert message in str(error.value)
    assert str(error.value).startswith("rover.pos")
    assert error.value.finding.remedy


def test_a_file_that_is_cut(tmp_path):
    path = pos(tmp_path, [row(), row(later(1))])
    path.write_bytes(path.read_bytes()[:-60])
    table = read_gnss(path)
    assert len(table) == 1
    assert [f.row for f in table.attrs["findings"] if "is incomplete" in f.what] == [5]


def test_a_file_of_one_line_that_is_cut(tmp_path):
    path = pos(tmp_path, [row()])
    path.write_bytes(path.read_bytes()[:-60])
    with pytest.raises(
        DataError,
        match="row 4",
        check=lambda refused: refused.finding.code == "io.only-line-under-header-cut",
    ):
        read_gnss(path)


def bare(folder, rows):
    path = folder / "bare.pos"
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("more", ["", MORE])
@pytest.mark.parametrize("when", [DAY, f"{WEEK} {SOW:.3f}"])
def test_without_a_header_the_columns_are_those_of_rtklib(tmp_path, more, when):
    velocity = "   1.50000   -2.50000    0.50000 0.1 0.2 0.3 0.0 0.0 0.0" if more else ""
    whole = read_gnss(pos(tmp_path, [row(when, more=velocity)], header=LEVEL + more))
    table = read_gnss(bare(tmp_path, [row(when, more=velocity)]))
    assert np.array_equal(table.to_numpy(), whole.to_numpy())
    assert table.index[0] == whole.index[0]
    assert table.attrs["clock"] == whole.attrs["clock"]
    assert "io.pos-without-header" in [f.code for f in table.attrs["findings"]]


def test_without_a_header_positions_of_the_earth(tmp_path):
    place = " -3962108.6730   3381309.5740   3668678.6370"
    table = read_gnss(bare(tmp_path, [row(place=place)]))
    assert abs(table["lat"].iloc[0] - 35.34) < 0.01 and abs(table["lon"].iloc[0] - 139.52) < 0.01


@pytest.mark.parametrize(
    ("rows", "code"),
    [
        # Four decimals are meters: a baseline.
        ([row(place="  10.1234  20.2345  1.3456")], "io.no-line-names-columns-gpst"),
        (["# stations", " 34.949756936  139.069904560   411.2090   0841"], "io.list-of-stations"),
        (["one two three"], "io.no-line-names-columns-gpst"),
        ([], "io.no-line-names-columns-gpst"),
    ],
)  # fmt: skip
def test_without_a_header_nothing_else_is_read(tmp_path, rows, code):
    with pytest.raises(DataError, check=coded(code)):
        read_gnss(bare(tmp_path, rows))
