"""Fixes of other formats: seven columns, tables with names, arrays; and what is wrong in them."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

from strapdown.errors import ConfigError, DataError
from strapdown.formats import ReadOptions, read_log
from strapdown.formats.gnss_files import GnssOptions, open_fixes, read_gnss
from strapdown.frames import geodetic_from_ned
from strapdown.tables import GNSS, check_gnss, gnss_table
from strapdown.tables.checks import GEODETIC, POSITION_SD, VELOCITY, VELOCITY_SD

KF = [
    "456300.000 30.44478468337 114.47186919892 21.26567 0.010 0.009 0.019",
    "456301.000 30.44478452606 114.47186918825 21.28777 0.010 0.009 0.020",
    "456302.000 30.44478450000 114.47186918000 21.29000 0.011 0.009 0.019",
]
HEAD = "time,lat,lon,alt,VN,VE,VD,north_sd,east_sd,down_sd,VN_sd,VE_sd,VD_sd"
ROW = "45.0,15.0,100.0,1.0,2.0,-0.5,0.01,0.02,0.03,0.1,0.2,0.3"


def written(folder, text, name="gnss.csv", encoding="utf-8"):
    path = folder / name
    path.write_bytes(text.encode(encoding))
    return path


def table_of(folder, head, rows):
    return read_gnss(written(folder, "\n".join([head, *rows]) + "\n"))


def test_kf_gins(tmp_path):
    table = read_gnss(written(tmp_path, "\n".join(KF) + "\n", "gnss.txt"))
    check_gnss(table)
    rows = np.array([[float(f) for f in line.split()] for line in KF])
    assert np.array_equal(table.index, rows[:, 0])
    assert np.array_equal(table[[*GEODETIC, *POSITION_SD]].to_numpy(), rows[:, 1:])
    assert np.isinf(table[VELOCITY_SD].to_numpy()).all()
    assert table.attrs["clock"] == "gps-seconds-of-week" and table.attrs["gps_week"] is None
    more = "\n".join(f"{line} 1.0 2.0 3.0 0.1 0.2 0.3" for line in KF)
    table = read_gnss(written(tmp_path, more + "\n", "gnss.txt"))
    assert table[[*VELOCITY, *VELOCITY_SD]].iloc[2].tolist() == [1.0, 2.0, 3.0, 0.1, 0.2, 0.3]


def test_the_table_itself_by_text_and_parquet(tmp_path):
    table = table_of(tmp_path, HEAD, [f"-1.0,{ROW}", f"-0.9,{ROW}"])
    assert list(table.columns) == GNSS
    assert table.iloc[0].tolist() == [float(f) for f in ROW.split(",")] + [1.0]
    assert table.attrs["clock"] == "relative"
    table.reset_index().to_parquet(tmp_path / "gnss.parquet")
    again = read_gnss(tmp_path / "gnss.parquet")
    pd.testing.assert_frame_equal(again, table)


@pytest.mark.parametrize(
    ("head", "factors"),
    [
        ("# gps_sow_s,lat_deg,lon_deg,h_ell_m,vN,vE,vD,sdN,sdE,sdU,sdvN,sdvE,sdvU", {}),
        (
            "tow,Latitude,Longitude,Height (m),vel_north [m/s],vel_east [m/s],vel_down [m/s],"
            "std_n,std_e,std_d,std_vn,std_ve,std_vd",
            {},
        ),
        (
            "Time [ms],lat_rad,lon_rad,alt_km,VN_km_h,VE_km_h,VU_km_h,north_sd_mm,east_sd_mm,"
            "up_sd_mm,sdVN_cm_s,sdVE_cm_s,sdVU_cm_s",
            {
                "time": 1e-3,
                "lat": 180 / np.pi,
                "lon": 180 / np.pi,
                "alt": 1e3,
                **dict.fromkeys(VELOCITY, 1 / 3.6),
                "VD": -1 / 3.6,
                **dict.fromkeys(POSITION_SD, 1e-3),
                **dict.fromkeys(VELOCITY_SD, 1e-2),
            },
        ),
    ],
)
def test_names_and_units(tmp_path, head, factors):
    place = (0.7, 0.2) if "lat" in factors else (47.0, 8.0)
    numbers = [1000.0, *place, 1.5, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0]
    names = ["time", *GNSS[:-1]]
    table = table_of(tmp_path, head, [",".join(map(str, numbers))])
    got = table.reset_index().iloc[0]
    for name, number in zip(names, numbers, strict=True):
        assert got[name] == number * factors.get(name, 1.0), name


@pytest.mark.parametrize(
    ("head", "values", "read"),
    [
        ("num_SV", ("7", "12"), [7.0, 12.0]),
        ("Satellites", ("7.0", "12.0"), [7.0, 12.0]),
        # Words, and a name of something else: shown nowhere, refused neither.
        ("sats", ("many", "few"), None),
        ("satellite_id", ("7", "12"), None),
    ],
)
def test_satellites_are_kept_where_a_column_counts_them(tmp_path, head, values, read):
    rows = [f"{k}.0,{ROW},{value}" for k, value in enumerate(values)]
    table = table_of(tmp_path, f"{HEAD},{head}", rows)
    assert [*table.columns] == [*GNSS, *(["satellites"] if read else [])]
    assert read is None or table["satellites"].tolist() == read


def test_speeds_that_are_never_known_are_no_velocity(tmp_path):
    head = "time,lat,lon,alt,speed [m/s],course [deg]"
    rows = [f"{k}.0,45.0,15.0,100.0,-1,-1" for k in range(4)]
    options = GnssOptions(position_sd=(1.0, 1.0, 1.0))
    table = read_gnss(written(tmp_path, "\n".join([head, *rows]) + "\n"), options)
    assert np.isinf(table[VELOCITY_SD].to_numpy()).all()
    codes = {f.code for f in table.attrs["findings"]}
    assert "io.speed-and-course-never-known" in codes
    assert "io.velocity-by-speed-and-course" not in codes


def test_car_rtk(recordings):
    path = recordings("car_rtk") / "part1_gnss_rtk.csv"
    table = read_gnss(path)
    rows = np.loadtxt(path, delimiter=",")
    assert np.array_equal(table.index, rows[:, 0])
    assert np.array_equal(table[GNSS[:-1]].to_numpy(), rows[:, 1:13])
    assert set(table["quality"]) <= {4.0, 5.0}
    assert table.attrs["clock"] == "gps-seconds-of-week"


def test_week_dates_and_unix(tmp_path):
    head = "week,sow,lat,lon,alt,sdn,sde,sdu"
    table = table_of(tmp_path, head, ["2297,604799.5,1,2,3,1,1,1", "2298,0.5,1,2,3,1,1,1"])
    assert table.index.tolist() == [604799.5, 604800.5] and table.attrs["gps_week"] == 2297
    head = "utc,lat,lon,alt,sdn,sde,sdu"
    table = table_of(tmp_path, head, ["2024-01-15T03:04:05.250Z,1,2,3,1,1,1"])
    assert table.attrs["clock"] == "unix" and table.index[0] == 1705287845.25


def test_heights_over_the_sea(tmp_path):
    head = "time,lat,lon,altitude_msl,sdn,sde,sdu"
    with pytest.raises(DataError, check=coded("io.height-over-sea-column")):
        table_of(tmp_path, head, ["0,1,2,3,1,1,1"])
    table = table_of(tmp_path, f"{head},geoid_separation", ["0,1,2,3,1,1,1,45.5"])
    assert table["alt"].iloc[0] == 48.5


def test_what_is_missing_in_a_row(tmp_path):
    rows = [f"0,{ROW}", "1,45.0,15.0,100.0,,,,0.01,0.02,,0.1,0.2,0.3"]
    table = table_of(tmp_path, HEAD, rows)
    assert np.isinf(table.loc[1.0, [*VELOCITY_SD, "down_sd"]]).all()
    assert table.loc[1.0, "north_sd"] == 0.01
    rows = [f"{r},1" for r in (f"0,{ROW}",)] + ["1,,,,,,,,,,,,,0"]
    table = table_of(tmp_path, f"{HEAD},quality", rows)
    assert table.index.tolist() == [0.0]
    out = [f for f in table.attrs["findings"] if f.code == "io.fixes-without-position-left-out"]
    assert [f.data["count"] for f in out] == [1]


def test_speed_and_course_give_the_velocity_over_ground(tmp_path):
    head = "time,lat,lon,alt,speed [km/h],course,sdn,sde,sdu,speed accuracy [m/s]"
    rows = ["0,1,2,3,36,30,1,1,1,0.5", "1,1,2,3,-1,-1,1,1,1,0.5"]
    table = table_of(tmp_path, head, rows)
    assert "io.velocity-by-speed-and-course" in {f.code for f in table.attrs["findings"]}
    velocity, sd = table[VELOCITY].to_numpy(), table[VELOCITY_SD].to_numpy()
    assert velocity[0] == pytest.approx([10.0 * np.sqrt(0.75), 5.0, 0.0], abs=1e-12)
    assert sd[0].tolist() == [0.5, 0.5, np.inf]
    assert np.isinf(sd[1]).all()


def test_accuracies_of_a_phone_give_standard_deviations(tmp_path):
    head = "time,lat,lon,alt,Horizontal Accuracy (m),Vertical Accuracy (m)"
    table = table_of(tmp_path, head, ["0,1,2,3,15.1,6", "1,1,2,3,-1,6"])
    sd = table[POSITION_SD].to_numpy()
    # The radius of 68 % of a circular normal distribution is 1.5096 standard deviations.
    assert sd[0] == pytest.approx([15.1 / 1.5096, 15.1 / 1.5096, 6.0], rel=1e-4)
    assert np.isinf(sd[1, :2]).all() and sd[1, 2] == 6.0
    assert "io.sd-by-accuracy" in {f.code for f in table.attrs["findings"]}


def test_arrays_of_python_ins(tmp_path):
    place = np.array([[55.0, 37.0, 150.0], [55.1, 37.1, 151.0]])
    np.savez(tmp_path / "drive.npz", fix_time=[1.0, 2.0], fix=place)
    with pytest.raises(DataError, check=coded("io.position-sd-not-stated")):
        read_gnss(tmp_path / "drive.npz")
    table = read_gnss(tmp_path / "drive.npz", GnssOptions(position_sd=1.0))
    assert np.array_equal(table[GEODETIC].to_numpy(), place)
    assert (table[POSITION_SD].to_numpy() == 1.0).all()
    np.savez(tmp_path / "drive.npz", fix_time=[1.0, 2.0], fix=place[:, :2])
    with pytest.raises(DataError) as error:
        read_gnss(tmp_path / "drive.npz", GnssOptions(position_sd=1.0))
    assert error.value.finding.data["shape"] == (2,)
    assert error.value.finding.data["shape_2"] == (2, 2)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig", "cp1252"])
def test_encodings(tmp_path, encoding):
    text = f"{HEAD.replace('lat', 'lat [°]')}\n0,{ROW}\n1,{ROW}\n"
    assert len(read_gnss(written(tmp_path, text, encoding=encoding))) == 2


def test_repair_leaves_rows_out(tmp_path):
    rows = [f"0,{ROW}", f"0,{ROW}", f"nan,{ROW}", "2,,15,100" + ROW[15:], f"3,{ROW}"]
    path = written(tmp_path, "\n".join([HEAD, *rows]) + "\n")
    with pytest.raises(
        DataError,
        match="row 4, time",
        check=lambda refused: refused.finding.code == "io.fix-stamp-no-number",
    ):
        read_gnss(path)
    table = read_gnss(path, GnssOptions(repair=True))
    assert table.index.tolist() == [0.0, 3.0]


FAST = [f"{k},{45 + 1e-4 * k},15,100,11.1,0,0,0.01,0.01,0.01,0.1,0.1,0.1" for k in range(40)]


def swapped_names(line):
    fields = line.split(",")
    return ",".join([fields[0], fields[2], fields[1], *fields[3:]])


@pytest.mark.parametrize(
    ("head", "rows", "message"),
    [
        (HEAD, [f"0,{ROW}", f"0,{ROW}"], "row 3, time: the stamp 0 s repeats an earlier one"),
        (HEAD, [f"1,{ROW}", f"0,{ROW}"], "row 3, time: the stamp 0 s follows 1 s"),
        (HEAD, [f"0,{ROW},7"], "row 2: 14 fields, where the first line has 13"),
        (HEAD, [f"0,{ROW.replace('0.02', 'x')}"], "row 2, east_sd: 'x' is not a number"),
        (HEAD, [f"0,{ROW.replace('0.02', '0')}"], "row 2, east_sd: a standard deviation of 0 "),
        (HEAD, [f"0,{ROW.replace('0.02', '-2')}"], "row 2, east_sd: a standard deviation of -2 "),
        (HEAD, [f"0,{ROW.replace('45.0', '')}"], "row 2, lat: not a number"),
        (HEAD, [f"0,{ROW.replace('45.0', '95.0')}"], "row 2, lat: a latitude of 95 deg is beyond"),
        (HEAD.replace("lat", "lat_m"), [f"0,{ROW}"], "lat: 'm' is not a unit of this quantity"),
        (HEAD.replace("VE", "V2", 1), [f"0,{ROW}"], "VE: the column is missing, and VN is given"),
        (HEAD.replace("lon", "x"), [f"0,{ROW}"], "missing columns: lon"),
        (
            HEAD.replace("lon", "latitude"),
            [f"0,{ROW}"],
            "lat: the quantity matches columns 'lat' and 'latitude'",
        ),
        ("time,lat,lon,alt", ["0,1,2,3"], "the positions have no standard deviations"),
        (f"{HEAD},quality", [f"0,{ROW},9"], "row 2, quality: unknown fix quality 9"),
        (f"{HEAD},Q", [f"0,{ROW},9"], "row 2, Q: unknown solution type 9"),
        (HEAD, [], "row 1: the file has a header and no data"),
        (HEAD, [swapped_names(r) for r in FAST], "lat, lon: the velocity (11.1 m/s) contradicts"),
    ],
)
def test_refused(tmp_path, head, rows, message):
    with pytest.raises(DataError) as error:
        table_of(tmp_path, head, rows)
    assert str(error.value).startswith("gnss.csv, ") or str(error.value).startswith("gnss.csv: ")
    assert message in str(error.value)
    assert error.value.finding.remedy


def test_no_file_of_fixes(tmp_path):
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.no-such-file"
    ):
        read_gnss(tmp_path / "none.csv")
    with pytest.raises(DataError, check=coded("io.folder-no-known-recording-holds")):
        read_gnss(tmp_path)
    with pytest.raises(DataError, check=coded("io.file-empty")):
        read_gnss(written(tmp_path, ""))
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.ending-no-known-format"
    ):
        read_gnss(written(tmp_path, "x", "a.docx"))
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.text-with-zero-bytes"
    ):
        read_gnss(written(tmp_path, "\0\1\2" * 100, "a.pos"))
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.unknown-format-of-log"
    ):
        read_gnss(written(tmp_path, "x"), GnssOptions(format="rtk"))
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.no-standard-deviation"
    ):
        GnssOptions(position_sd=0.0)


def drive(before, speed, *, factor=1.0, stated=""):
    """A turn at 10 m/s, 1 Hz, with inertial samples beside the fixes."""
    t = np.arange(60.0)
    course = 0.02 * t
    north, east = np.cumsum(10.0 * np.cos(course)), np.cumsum(10.0 * np.sin(course))
    lat, lon = 47.0 + np.degrees(north / 6.371e6), 9.0 + np.degrees(east / 6.371e6 / 0.682)
    lines = [
        "time,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,"
        + ",".join(before + w for w in ("lat", "longitude", "alt", "accuracy", "course"))
        + f",{before}{speed}{stated}"
    ]
    for k in range(60):
        row = (t[k], 0.0, 0.0, 0.02, lat[k], lon[k], 400.0, 3.0, np.degrees(course[k]), 10 * factor)
        lines.append(",".join(f"{v:.9f}" for v in row))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    "before", ["gps_", "gps.", "gnss_", "location.", "position_", "fix ", "GPS"]
)
def test_fixes_as_other_people_name_them(tmp_path, before):
    path = written(tmp_path, drive(before, "speed"))
    table = read_gnss(path)
    assert table[["lat", "lon", "alt"]].iloc[0].tolist() == pytest.approx([47, 9, 400], abs=1e-3)
    assert table["VN"].iloc[0] == pytest.approx(10.0)
    assert open_fixes(path) is not None
    # What a fix takes is not listed as unused by the inertial sensors.
    log = read_log(path, ReadOptions(time_unit="s"))
    assert "io.columns-not-used" not in {f.code for f in log.findings}


def test_a_plain_name_precedes_one_with_a_word_before_it(tmp_path):
    text = drive("", "speed").replace("time,", "gps_v,time,", 1).replace("\n", "\n7,")
    table = read_gnss(written(tmp_path, text.removesuffix("7,")))
    assert table["VN"].iloc[0] == pytest.approx(10.0)


@pytest.mark.parametrize(("unit", "factor"), [("km/h", 3.6), ("kn", 1.94384), ("mph", 2.23694)])
def test_a_speed_without_its_unit_is_asked_for_if_the_positions_contradict(tmp_path, unit, factor):
    path = written(tmp_path, drive("gps_", "speed", factor=factor))
    flags = f"--gnss-units speed={unit}"
    with pytest.raises(DataError, check=coded("io.speed-unit-not-stated", flags=flags)):
        read_gnss(path)
    table = read_gnss(path, GnssOptions(units={"speed": unit}))
    assert table["VN"].iloc[0] == pytest.approx(10.0, rel=1e-4)
    # A person may insist, and a name that states the unit is believed.
    table = read_gnss(path, GnssOptions(units={"speed": "m/s"}))
    assert table["VN"].iloc[0] == pytest.approx(10.0 * factor, rel=1e-4)
    text = drive("gps_", "speed", factor=factor, stated=f" [{unit}]")
    assert read_gnss(written(tmp_path, text))["VN"].iloc[0] == pytest.approx(10.0, rel=1e-4)


def test_of_two_clocks_of_fixes_the_one_that_states_its_unit_is_used(tmp_path):
    head = "Timestamp,TimeIntervalSince1970,lat,lon,alt,sdN,sdE,sdD"
    rows = [f"{k // 2},{1_600_000_000.25 + k},45,7,100,1,1,1" for k in range(6)]
    assert np.allclose(np.diff(table_of(tmp_path, head, rows).index), 1.0)


def test_fixes_without_a_height_say_so(tmp_path):
    with pytest.raises(DataError, check=coded("io.fixes-without-height")):
        table_of(tmp_path, "time_ms,lat,lng,accuracy", [f"{1000 * k},45,7,5" for k in range(5)])


@pytest.mark.parametrize(("asked", "sd"), [(None, 100.0), (4.0, 100.0), ((4.0, 4.0, 30.0), 30.0)])
def test_fixes_without_a_height_have_the_stated_one_and_say_it_once(tmp_path, asked, sd):
    """The information of all of them on the height is that of one statement."""
    rows = [f"{1000 * k},45,7,5" for k in range(25)]
    path = written(tmp_path, "\n".join(["time_ms,lat,lng,accuracy", *rows]))
    table = read_gnss(path, GnssOptions(datum_height=250.0, position_sd=asked))
    assert (table["alt"] == 250.0).all()
    assert np.sum(1.0 / table["down_sd"] ** 2) ** -0.5 == pytest.approx(sd, rel=1e-12)
    assert table["north_sd"].iloc[0] == pytest.approx(4.0 if asked else 5.0 / 1.5096, rel=1e-3)
    (said,) = [f for f in table.attrs["findings"] if f.code == "io.fixes-with-stated-height"]
    assert (said.severity, said.data["height"], said.data["sd"]) == ("warning", 250.0, sd)


@pytest.mark.parametrize(("sign", "fixes"), [(1.0, True), (-1.0, False)])
def test_negative_numbers_are_no_standard_deviations(tmp_path, sign, fixes):
    rows = [f"{0.5 * k:.3f} 45.0 7.0 100.0 {sign * 0.02} 0.03 0.04" for k in range(20)]
    path = written(tmp_path, "\n".join(rows) + "\n", "fix.txt")
    if fixes:
        assert len(read_gnss(path)) == 20
    else:
        with pytest.raises(DataError, check=coded("io.missing-columns-2")):
            read_gnss(path)


def turning(rows=60):
    """Stamps, s, places, deg, deg, m, and velocity, m/s, of fixes of a turn at 10 m/s."""
    time, angle = np.arange(float(rows)), np.linspace(0.0, 1.2, rows)
    velocity = 10.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    way = np.vstack([[0.0, 0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]), axis=0)])
    up = np.full(rows, 200.0)
    return time, geodetic_from_ned(np.column_stack([way, 0.0 * up]), (48.2, 16.3, 200.0)), velocity


def read_columns(folder, head, columns, sep=",", **options):
    rows = [sep.join(str(c) for c in row) for row in zip(*columns, strict=True)]
    path = written(folder, "\n".join([head, *rows]) + "\n")
    return read_gnss(path, GnssOptions(position_sd=1.0, velocity_sd=0.1, **options))


def unused(table):
    found = [f for f in table.attrs["findings"] if f.code == "io.columns-not-used"]
    return [name for f in found for name in f.data["names"]]


@pytest.mark.parametrize(
    ("head", "sep"),
    [
        ("Zeit;Breite;Länge;Höhe;Geschwindigkeit (km/h);Kurs", ";"),
        ("время;широта;долгота;высота;скорость, км/ч;курс", ";"),
        ("时间,纬度,经度,高度,速度(km/h),航向", ","),
        ("tiempo,latitud,longitud,altitud,velocidad (km/h),rumbo", ","),
        ("temps;latitude;longitude;altitude;vitesse (km/h);cap", ";"),
        ("tempo;latitudine;longitudine;altitudine;velocità (km/h);rotta", ";"),
        ("czas;lat;lon;wysokość;prędkość (km/h);kurs", ";"),
        ("time,lat,lon,alt,speed [km/h],heading [deg]", ","),
        ("time,lat,lon,alt,velocity [km/h],course", ","),
    ],
)
def test_speed_and_course_in_words_of_several_languages(tmp_path, head, sep):
    time, place, velocity = turning()
    course = np.degrees(np.arctan2(velocity[:, 1], velocity[:, 0]))
    table = read_columns(tmp_path, head, (time, *place.T, 36.0 + 0.0 * time, course), sep)
    assert np.allclose(table[["VN", "VE"]], velocity, rtol=0.0, atol=1e-12)
    assert (table[["VN_sd", "VE_sd"]] == 0.1).all(axis=None) and np.isinf(table["VD_sd"]).all()
    assert not unused(table)


def test_columns_of_fixes_that_nothing_uses_are_listed(tmp_path):
    time, place, velocity = turning()
    north, east = velocity.T
    still = 0.0 * time
    # Which way is up is not said, and of which axes x and y are.
    head = "temps;latitude;longitude;altitude;vitesse nord (m/s);vitesse est (m/s);"
    table = read_columns(
        tmp_path, head + "vitesse verticale (m/s)", (time, *place.T, north, east, still), ";"
    )
    assert np.array_equal(table[["VN", "VE"]], velocity) and np.isinf(table["VD_sd"]).all()
    assert unused(table) == ["vitesse verticale (m/s)"]
    table = read_columns(
        tmp_path, "time,lat,lon,alt,vx,vy,vz", (time, *place.T, *velocity.T, still)
    )
    assert np.isinf(table[VELOCITY_SD]).all(axis=None) and unused(table) == ["vx", "vy", "vz"]
    # A course precedes a heading, and a heading without a speed says nothing of a velocity.
    course = np.degrees(np.arctan2(east, north))
    columns = (time, *place.T, 10.0 + still, course, course + 90.0)
    table = read_columns(tmp_path, "time,lat,lon,alt,speed,course,heading", columns)
    assert np.allclose(table[["VN", "VE"]], velocity) and unused(table) == ["heading"]
    table = read_columns(tmp_path, "time,lat,lon,alt,heading", (time, *place.T, course))
    assert np.isinf(table[VELOCITY_SD]).all(axis=None) and unused(table) == ["heading"]
    table = read_columns(tmp_path, "time,lat,lon,alt,speed", (time, *place.T, 10.0 + still))
    assert unused(table) == ["speed"]


@pytest.mark.parametrize(
    ("name", "factor", "unit"),
    [("time_s", 1e3, "ms"), ("time", 1e6, "us"), ("time_ms", 1.0, "s")],
)
def test_a_clock_of_another_unit_is_told_by_the_speed(tmp_path, name, factor, unit):
    time, place, velocity = turning()
    columns = (factor * time, *place.T, *velocity.T, 0.0 * time)
    head = f"{name},lat,lon,alt,vn,ve,vd"
    with pytest.raises(DataError, check=coded("io.time-unit-unlike-speed", unit=unit)):
        read_columns(tmp_path, head, columns)
    table = read_columns(tmp_path, head, columns, units={"time": unit})
    assert np.allclose(table.index, time) and np.array_equal(table[["VN", "VE"]], velocity)


def test_a_table_of_another_clock_is_refused():
    time, place, velocity = turning()
    velocity = np.column_stack([velocity, 0.0 * time])
    gnss_table(time, place, velocity, 1.0 * np.ones(3), 0.1 * np.ones(3))
    for factor in (1e3, 1e6, 1e-3):
        with pytest.raises(
            DataError, check=coded("tables.time-in-other-unit", factor=1.0 / factor)
        ):
            gnss_table(factor * time, place, velocity, np.ones(3), 0.1 * np.ones(3))
    # A receiver that stands says nothing of its clock.
    still = np.random.default_rng(1).normal(0.0, 0.01, (60, 3))
    gnss_table(1e3 * time, place[:1] + 0.0 * place, still, np.ones(3), 0.1 * np.ones(3))


def test_rows_at_latitude_and_longitude_zero_are_no_fixes(tmp_path):
    time, place, _ = turning()
    place[:15] = 0.0
    table = read_columns(tmp_path, "time,lat,lon,alt", (time, *place.T))
    assert np.array_equal(table.index, time[15:]) and np.array_equal(table[GEODETIC], place[15:])
    said = [f for f in table.attrs["findings"] if f.code == "io.fixes-at-zero-left-out"]
    assert [(f.row, f.data["count"]) for f in said] == [(2, 15)]
    # Off the coast of Ghana they may be: 0.8 deg of arc are 89 km, 1 deg is 111 km.
    for east, left in ((0.8, 60), (1.0, 45)):
        place[15:, :2] = 0.0, east
        table = read_columns(tmp_path, "time,lat_deg,lon_deg,alt", (time, *place.T))
        assert len(table) == left


@pytest.mark.parametrize(
    ("zone", "origin"), [("33 u", "33N"), ("33U", "33N"), ("33N", "33N"), ("33M", "33S")]
)
def test_the_zone_of_utm_in_a_column(tmp_path, zone, origin):
    time = np.arange(5.0)
    columns = (time, 5e5 + 10.0 * time, 5.34e6 + 0.0 * time, 200.0 + 0.0 * time)
    head = "time,easting,northing,height"
    stated = read_columns(tmp_path, head, columns, origin=origin)
    table = read_columns(tmp_path, f"{head},zone", (*columns, [zone] * 5))
    assert np.array_equal(table[GEODETIC], stated[GEODETIC]) and not unused(table)
    # The band S is north of the equator, the S of a hemisphere is not; two zones are two grids.
    for zones in (["33S"] * 5, ["33U"] * 4 + ["32U"], ["61U"] * 5):
        with pytest.raises(DataError, check=coded("io.utm-zone-open")):
            read_columns(tmp_path, f"{head},zone", (*columns, zones))


@pytest.mark.parametrize("head", ["altHAE,altMSL", "altMSL,altHAE", "alt,altHAE,altMSL,geoidSep"])
def test_the_height_over_the_ellipsoid_precedes_others(tmp_path, head):
    time, place, _ = turning()
    heights = {"altHAE": place[:, 2], "altMSL": place[:, 2] - 45.0, "geoidSep": 0.0 * time + 44.0}
    heights["alt"] = heights["altMSL"]
    columns = [heights[name] for name in head.split(",")]
    table = read_columns(tmp_path, f"time,lat,lon,{head}", (time, *place[:, :2].T, *columns))
    assert np.array_equal(table["alt"], place[:, 2])
    assert set(unused(table)) == set(head.split(",")) - {"altHAE"}
    assert "io.height-level-open" not in {f.code for f in table.attrs["findings"]}
