"""Statements about a file of fixes: columns, units, time, heights, origin; in Python and typed."""

from __future__ import annotations

import json
import re
import shlex
import tomllib

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

import strapdown as sd
from strapdown.errors import ConfigError, DataError
from strapdown.formats.clocks import GPS
from strapdown.formats.gnss_files import GnssOptions, read_gnss
from strapdown.frames import ecef_from_geodetic, geodetic_from_ned
from strapdown.tables.checks import HEIGHTS_AS_STATED

PLACE = np.array([47.0, 8.5, 450.0])
SD = 2.0


def written(path, columns):
    names, values = list(columns), np.column_stack(list(columns.values()))
    rows = [",".join(repr(float(v)) for v in row) for row in values]
    path.write_text("\n".join([",".join(names), *rows]) + "\n", encoding="utf-8")
    return path


def geodetic(**other):
    n = len(next(iter(other.values()))) if other else 4
    lat, lon, alt = (np.full(n, v) + np.arange(n) * 1e-9 for v in PLACE)
    return {"time": np.arange(n, dtype=float), "lat": lat, "lon": lon, "alt": alt} | other


def test_units_of_columns(tmp_path):
    table = geodetic(speed=np.full(4, 36.0), course=np.full(4, 90.0))
    plain = {**table, "lat": np.radians(table["lat"]), "lon": np.radians(table["lon"])}
    path = written(
        tmp_path / "a.csv", {**plain, "alt": table["alt"] / 0.3048, "time": table["time"] * 1e3}
    )
    units = {"lat": "rad", "lon": "rad", "alt": "ft", "time": "ms", "speed": "km/h"}
    fixes = sd.read_gnss(path, units=units, position_sd_m=SD, velocity_sd_m_per_s=0.1)
    # A degree through radians and feet through meters: four roundings of 2⁻⁵³.
    np.testing.assert_allclose(
        fixes[["lat", "lon", "alt"]],
        np.column_stack([table["lat"], table["lon"], table["alt"]]),
        rtol=5e-16,
    )
    np.testing.assert_allclose(fixes.index, table["time"], rtol=5e-16)
    np.testing.assert_allclose(fixes["VE"], 10.0, rtol=5e-16)
    with pytest.raises(ConfigError, check=coded("io.unit-of-missing-column")):
        sd.read_gnss(path, units={"VN": "km/h"}, position_sd_m=SD)
    with pytest.raises(ConfigError, check=coded("io.unknown-unit")):
        sd.read_gnss(path, units={"lat": "km/h"}, position_sd_m=SD)


@pytest.mark.parametrize(("unit", "factor"), [("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_the_unit_of_a_stamp_of_1970_follows_from_date_and_step(tmp_path, unit, factor):
    stamps = 1.7e9 + np.arange(4.0)
    path = written(tmp_path / "a.csv", geodetic(time=stamps * factor))
    fixes = read_gnss(path, GnssOptions(position_sd=SD))
    # Stamps of 1970 in ns have a step of 2⁸ in a double.
    np.testing.assert_allclose(fixes.index, stamps, atol=256e-9)
    said = [f for f in fixes.attrs["findings"] if f.code == "io.time-unit-by-date"]
    assert [f.data["unit"] for f in said] == [unit]


def test_a_phone_s_clock_in_ns_is_no_date_in_ms(tmp_path):
    """28 minutes after its start it counts 1.7e12, as a clock of 1970 in ms does."""
    path = written(tmp_path / "a.csv", geodetic(time=1.7e12 + 1e9 * np.arange(4.0)))
    with pytest.raises(DataError, check=coded("io.stamp-no-date-clock-tells")) as error:
        read_gnss(path, GnssOptions(position_sd=SD))
    assert error.value.finding.data["flags"] == "--gnss-units time=ns"
    fixes = read_gnss(path, GnssOptions(position_sd=SD, units={"time": "ns"}))
    np.testing.assert_allclose(np.diff(fixes.index), 1.0, rtol=1e-9)


def test_heights_over_the_sea(tmp_path):
    table = geodetic()
    table["altitude_msl"] = table.pop("alt")
    path = written(tmp_path / "a.csv", table)
    with pytest.raises(DataError, check=coded("io.height-over-sea-column")) as error:
        sd.read_gnss(path, position_sd_m=SD)
    assert error.value.finding.data["flags"] == "--gnss-datum-height 0"
    for height, code in ((0.0, "io.heights-stay-over-datum"), (48.5, "io.heights-with-datum")):
        fixes = sd.read_gnss(path, position_sd_m=SD, datum_height_m=height)
        np.testing.assert_array_equal(fixes["alt"], table["altitude_msl"] + height)
        assert code in [f.code for f in fixes.findings]


def test_a_height_over_the_ellipsoid_takes_no_datum(tmp_path):
    table = geodetic()
    table["alt_ellipsoid"] = table.pop("alt")
    path = written(tmp_path / "a.csv", table)
    with pytest.raises(ConfigError, check=coded("io.heights-over-ellipsoid-already")):
        sd.read_gnss(path, position_sd_m=SD, datum_height_m=48.5)
    with pytest.raises(ConfigError, check=coded("io.origin-beside-positions")):
        sd.read_gnss(path, position_sd_m=SD, origin=tuple(PLACE))


@pytest.mark.parametrize("name", ["alt", "altitude", "Height (m)"])
def test_a_bare_name_leaves_the_level_of_heights_open(tmp_path, name):
    table = geodetic()
    heights = table[name] = table.pop("alt")
    path = written(tmp_path / "a.csv", table)
    fixes = sd.read_gnss(path, position_sd_m=SD)
    assert "io.height-level-open" in [f.code for f in fixes.findings]
    assert fixes.attrs[HEIGHTS_AS_STATED]  # the result says so
    raised = sd.read_gnss(path, position_sd_m=SD, datum_height_m=48.5)
    np.testing.assert_array_equal(raised["alt"], heights + 48.5)
    named = sd.read_gnss(path, position_sd_m=SD, columns={"alt": name})
    assert HEIGHTS_AS_STATED not in named.attrs
    for each, as_stated in ((fixes, True), (raised, False)):  # what is written says it
        sd.write({"gnss": each}, tmp_path / "b.csv", force=True)
        again = sd.read_gnss(tmp_path / "b.csv", position_sd_m=SD)
        assert bool(again.attrs.get(HEIGHTS_AS_STATED)) == as_stated
        assert "io.height-level-open" not in [f.code for f in again.findings]


def test_heights_of_a_drone_over_sea_and_take_off(tmp_path):
    """Columns of DJI flight logs as Airdata exports them; heights over the sea come first."""
    table = geodetic()
    table["altitude_above_seaLevel(feet)"] = table.pop("alt")
    table["height_above_takeoff(feet)"] = np.arange(4.0)
    for left_out, code in (
        ("", "io.height-over-sea-column"),
        ("altitude_above_seaLevel(feet)", "io.heights-over-take-off"),
    ):
        held = {name: values for name, values in table.items() if name != left_out}
        path = written(tmp_path / "a.csv", held)
        with pytest.raises(DataError, check=coded(code)):
            sd.read_gnss(path, position_sd_m=SD)


def test_local_positions_need_an_origin(tmp_path):
    ned = np.array([[0.0, 0.0, 0.0], [10.0, -20.0, 3.0], [1000.0, 2000.0, -30.0]])
    table = {"Time": np.arange(3.0), "X": ned[:, 1], "Y": ned[:, 0], "Z": -ned[:, 2]}
    path = written(tmp_path / "a.csv", table)
    with pytest.raises(DataError, check=coded("io.positions-without-origin")):
        sd.read_gnss(path, position_sd_m=SD)
    columns = {"east": "X", "north": "Y", "up": "Z"}
    with pytest.raises(DataError, check=coded("io.local-positions-origin-open")):
        sd.read_gnss(path, columns=columns, position_sd_m=SD)
    fixes = sd.read_gnss(path, columns=columns, origin=tuple(PLACE), position_sd_m=SD)
    wanted = geodetic_from_ned(ned, PLACE)
    np.testing.assert_array_equal(fixes[["lat", "lon", "alt"]], wanted)


def test_positions_of_the_earth_are_proposed(tmp_path):
    places = np.tile(PLACE, (3, 1)) + np.arange(3)[:, None] * [1e-5, 1e-5, 1.0]
    xyz = ecef_from_geodetic(places)
    table = {"t": np.arange(3.0), "pos_x": xyz[:, 0], "pos_y": xyz[:, 1], "pos_z": xyz[:, 2]}
    path = written(tmp_path / "a.csv", table)
    with pytest.raises(DataError, check=coded("io.positions-likely-ecef")) as error:
        sd.read_gnss(path, position_sd_m=SD)
    typed = error.value.finding.data["flags"].split()[1]
    columns = dict(part.split("=") for part in typed.split(","))
    fixes = sd.read_gnss(path, columns=columns, position_sd_m=SD)
    # 1e-8 deg is a millimeter; a double of 6.4e6 m resolves a nanometer.
    np.testing.assert_allclose(fixes[["lat", "lon"]], places[:, :2], atol=1e-12)
    np.testing.assert_allclose(fixes["alt"], places[:, 2], atol=1e-8)


# --- typed ------------------------------------------------------------------------------


@pytest.fixture
def drive(tmp_path):
    """A log of an hour's rest in short, and fixes over the sea whose names nobody knows."""
    rng = np.random.default_rng(5)
    time = np.arange(0.0, 20.0, 0.01)
    log = {"time_s": time}
    log |= {f"gyro_{a}_rad_s": 1e-3 * rng.normal(size=time.size) for a in "xyz"}
    force = (0.0, 0.0, -9.80665)
    log |= {
        f"accel_{a}_m_s2": f + 1e-2 * rng.normal(size=time.size)
        for a, f in zip("xyz", force, strict=True)
    }
    written(tmp_path / "log.csv", log)
    fixes = geodetic(north_sd=np.full(20, 0.1), east_sd=np.full(20, 0.1), down_sd=np.full(20, 0.1))
    names = {"time": "tick", "lat": "breite", "lon": "laenge", "alt": "hmsl"}
    table = {names.get(name, name): values for name, values in fixes.items()}
    table["tick"] = table["tick"] * 1e3
    written(tmp_path / "fixes.csv", table)
    return tmp_path


def pasted(run_cli, done):
    """Run the command that a refusal proposes."""
    line = re.search(r"As inferred: strapdown (.*)", done.err)
    assert line, done.err
    return run_cli(*shlex.split(line[1]))


def test_the_draft_keeps_what_was_typed(run_cli, drive, monkeypatch):
    monkeypatch.chdir(drive)
    columns = ("--gnss-columns", "time=tick,lat=breite", "--gnss-columns", "lon=laenge")
    asked = (
        "init",
        "navigate",
        "log.csv",
        "--gnss",
        "fixes.csv",
        *columns,
        "--gnss-units",
        "time=ms",
    )
    refused = run_cli(*asked)
    assert refused.code == 3
    done = pasted(run_cli, refused)
    assert done.code == 0, done.err
    assert "20 of 20 fixes within the log" in done.out
    aid = tomllib.loads((drive / "navigate.toml").read_text(encoding="utf-8"))["aiding"]["gnss"]
    assert aid["columns"] == {"time": "tick", "lat": "breite", "lon": "laenge"}
    assert aid["units"] == {"time": "ms"} and aid["datum_height_m"] == 0.0


def test_a_run_asks_everything_at_once_and_uses_the_flags(run_cli, drive, monkeypatch):
    monkeypatch.chdir(drive)
    columns = "time=tick,lat=breite,lon=laenge"
    asked = ("navigate", "log.csv", "--gnss", "fixes.csv", "--gnss-columns", columns)
    asked += ("--gnss-units", "time=ms", "--gnss-datum-height", "48.5")
    refused = run_cli(*asked)
    assert refused.code == 4
    for flag in ("--sensor", "--heading"):
        assert flag in refused.err
    done = run_cli(*asked, "--sensor", "mpu-6050", "--heading", "90", "--quiet")
    assert done.code == 0, done.err
    rows = pd.read_csv(drive / "log-navigate" / "trajectory.csv", comment="#")
    name = next(n for n in rows.columns if n.startswith("alt"))
    assert abs(rows[name].iloc[-1] - 498.5) < 0.3  # three standard deviations of a fix


@pytest.mark.parametrize("height", [0.0, 48.5])
def test_every_output_says_from_which_level_heights_count(run_cli, drive, monkeypatch, height):
    """Heights kept over the sea were called heights over the ellipsoid in five files."""
    monkeypatch.chdir(drive)
    flags = ("--gnss-columns", "time=tick,lat=breite,lon=laenge", "--gnss-units", "time=ms")
    flags += ("--sensor", "mpu-6050", "--heading", "90", "--gnss-datum-height", f"{height}")
    done = run_cli("navigate", "log.csv", "--gnss", "fixes.csv", *flags, "--quiet")
    assert done.code == 0, done.err
    assert run_cli("convert", "log-navigate", "a.gpx", "--epoch", "2026-05-01T12:00:00Z").code == 0
    assert run_cli("convert", "log-navigate", "a.kml").code == 0
    assert run_cli("convert", "log-navigate", "a.nmea", "--epoch", "2026-05-01T12:00:00Z").code == 0
    out = drive / "log-navigate"
    facts = json.loads((out / "navigation.json").read_text(encoding="utf-8"))
    written = {
        name: path.read_text(encoding="utf-8")
        for name, path in (
            ("trajectory", out / "trajectory.csv"),
            ("gpx", drive / "a.gpx"),
            ("kml", drive / "a.kml"),
            ("nmea", drive / "a.nmea"),
        )
    }
    said = [
        facts["conventions"]["position"],
        re.search(r"# place: (.*)", written["trajectory"])[1],
        re.search(r"<desc>(.*)</desc>", written["gpx"])[1],
        re.search(r"<description>(.*)</description>", written["kml"])[1],
    ]
    for text in said:
        assert ("not the ellipsoid" in text) == (height == 0.0)
        assert ("WGS 84 ellipsoid" in text or "over the ellipsoid" in text) == (height != 0.0)
    # Without the height of the geoid it is not claimed to be 0 where heights are over the sea.
    assert ("<geoidheight>" in written["gpx"]) == (height != 0.0)
    assert (",M,,M," in written["nmea"]) == (height == 0.0)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert ("Above the ellipsoid" in page) == (height != 0.0)


def test_a_form_that_cannot_be_read(run_cli, drive):
    base = ("navigate", drive / "log.csv", "--gnss", drive / "fixes.csv")
    for flag, text in (("--gnss-origin", "1,2"), ("--gnss-columns", "lat"), ("--gnss-units", "x=")):
        done = run_cli(*base, flag, text)
        assert done.code == 4 and flag in done.err


# Courses, and coordinates, whose unit or sense the file does not state.

_T = np.arange(300) * 0.5
_TURN = 0.4 + 0.9 * np.sin(_T / 11) + _T / 24
_SPEED = 12.0 + 5.0 * np.sin(_T / 7)


def wound(tmp_path, **columns):
    """A winding drive without noise, with further columns."""
    v = np.column_stack([_SPEED * np.cos(_TURN), _SPEED * np.sin(_TURN), 0 * _T])
    way = np.vstack([np.zeros(3), np.cumsum(0.25 * (v[1:] + v[:-1]), axis=0)])
    lat, lon, alt = geodetic_from_ned(way, (48.1, 11.5, 500.0)).T
    path = tmp_path / "fixes.csv"
    return written(path, {"time": _T, "lat": lat, "lon": lon, "alt": alt, **columns}), v


def read_course(path, **units):
    return sd.read_gnss(path, units=units, position_sd_m=1.0, velocity_sd_m_per_s=0.1)


DEGREES = np.degrees(_TURN) % 360.0


@pytest.mark.parametrize(
    ("course", "factor", "units"),
    [
        (DEGREES, 1.0, {}),
        ((DEGREES + 180.0) % 360.0 - 180.0, 1.0, {}),
        (np.radians(DEGREES), 1.0, {"course": "rad"}),
        (np.radians((DEGREES + 180.0) % 360.0 - 180.0), 1.0, {"course": "rad"}),
        (np.round(100 * DEGREES), 1.0, {"course": "cdeg"}),
        (np.round(1e5 * DEGREES), 1.0, {"course": "1e-5 deg"}),
        (360.0 - DEGREES, 1.0, {"course": "-deg"}),
        ((DEGREES + 180.0) % 360.0, 1.0, {"speed": "-m/s"}),
        (np.radians(DEGREES), 3.6, {"speed": "km/h", "course": "rad"}),
    ],
)
def test_a_course_without_a_unit_is_held_against_the_positions(tmp_path, course, factor, units):
    path, v = wound(tmp_path, speed=factor * _SPEED, course=course)
    if units:
        with pytest.raises(DataError) as refused:
            read_course(path)
        assert refused.value.finding.data["python"] == str(units).replace("'", '"')
    fixes = read_course(path, **units)
    # The course is rounded to 0.01 deg: 1.5 mm/s of 17 m/s.
    np.testing.assert_allclose(fixes[["VN", "VE"]], v[:, :2], atol=2e-3)


def test_a_course_from_east_is_told(tmp_path):
    path, _ = wound(tmp_path, speed=_SPEED, course=(90.0 - DEGREES) % 360.0)
    with pytest.raises(DataError, check=coded("io.course-from-east")):
        read_course(path)


def test_a_course_beyond_a_turn_is_asked_about_where_nothing_moves(tmp_path):
    path = written(tmp_path / "a.csv", geodetic(speed=0.1 + 0 * _T, course=9000.0 + 10 * _T))
    with pytest.raises(DataError, check=coded("io.course-beyond-turn")):
        read_course(path)


def test_a_velocity_up_is_stated_with_a_minus(tmp_path):
    north, east = _SPEED * np.cos(_TURN), _SPEED * np.sin(_TURN)
    path, _ = wound(tmp_path, VN=north, VE=east, VD=0 * _T + 1.0)
    np.testing.assert_array_equal(read_course(path, VD="-m/s")["VD"], -1.0)


def test_velocities_of_nothing_are_warned_of(tmp_path):
    path, _ = wound(tmp_path, VN=_SPEED, VE=0.0 * _T, VD=0.0 * _T)
    codes = [f.code for f in read_course(path).findings]
    assert "io.velocity-unlike-positions" in codes


def test_coordinates_that_may_be_radians_are_asked_about(tmp_path):
    """Degrees and radians are both on the Earth; the unit in a name answers it."""
    path, _ = wound(tmp_path)
    table = pd.read_csv(path)
    radians = table.assign(lat=np.radians(table.lat), lon=np.radians(table.lon))
    radians.to_csv(path, index=False)
    with pytest.raises(DataError, check=coded("io.degrees-or-radians")):
        read_course(path)
    fixes = read_course(path, lat="rad", lon="rad")
    np.testing.assert_allclose(fixes[["lat", "lon"]], table[["lat", "lon"]], atol=1e-9)
    assert read_course(path, lat="deg", lon="deg")["lat"].max() < 1.0
    radians.rename(columns={"lat": "lat_rad", "lon": "lon_rad"}).to_csv(path, index=False)
    np.testing.assert_allclose(read_course(path)[["lat", "lon"]], table[["lat", "lon"]], atol=1e-9)


# Whole numbers of u-blox: UBX-NAV-PVT, Interface Description.


def nav_pvt():
    """A drive as NAV-PVT has it, and its positions and velocities."""
    north, east = _SPEED * np.cos(_TURN), _SPEED * np.sin(_TURN)
    v = np.column_stack([north, east, 0.2 * np.cos(_T / 30)])
    way = np.vstack([np.zeros(3), np.cumsum(0.25 * (v[1:] + v[:-1]), axis=0)])
    place = geodetic_from_ned(way, (48.1, 11.5, 6.0))  # 6 m: 6000 may be a height in m, too
    whole = {
        "iTOW": 302_400_000 + 500 * np.arange(len(_T)),
        **dict(zip(("lat", "lon"), np.rint(place[:, :2].T * 1e7), strict=True)),
        "height": np.rint(place[:, 2] * 1e3),
        "hAcc": 1500 + 0 * _T,
        "vAcc": 2300 + 0 * _T,
        **dict(zip(("velN", "velE", "velD"), np.rint(v.T * 1e3), strict=True)),
        "gSpeed": np.rint(1e3 * _SPEED),
        "headMot": np.rint(1e5 * DEGREES),
        "sAcc": 150 + 0 * _T,
    }
    return {name: np.asarray(values).astype(np.int64) for name, values in whole.items()}, place, v


SCALED = {"lat": 1e-7, "lon": 1e-7, "headMot": 1e-5}


@pytest.mark.parametrize("without", [(), ("velN", "velE", "velD")])
@pytest.mark.parametrize("scaled", [(), ("lat", "lon", "headMot")])
@pytest.mark.parametrize("parts", [False, True])
def test_whole_numbers_of_u_blox(tmp_path, without, scaled, parts):
    """As they are, and as programs scale some of them, beside the parts of a date."""
    whole, place, v = nav_pvt()
    table = pd.DataFrame({n: c * SCALED[n] if n in scaled else c for n, c in whole.items()})
    table = table.drop(columns=[*without])
    if parts:
        table = table.assign(year=2024, min=3, sec=5, valid=55)
    table.to_csv(tmp_path / "pvt.csv", index=False)
    fixes = sd.read_gnss(tmp_path / "pvt.csv")
    assert "io.units-of-ublox" in {f.code for f in fixes.findings}
    assert fixes.attrs["clock"] == GPS
    np.testing.assert_allclose(fixes.index, 302_400.0 + _T, atol=1e-9)
    np.testing.assert_allclose(fixes[["lat", "lon"]], place[:, :2], atol=0.51e-7)
    np.testing.assert_allclose(fixes["alt"], place[:, 2], atol=0.51e-3)
    np.testing.assert_allclose(fixes[["VN", "VE"]], v[:, :2], atol=2e-3)
    assert fixes["down_sd"].unique() == pytest.approx([2.3])
    assert fixes["north_sd"].unique() == pytest.approx([1.5 / 1.5096], rel=1e-4)
    assert fixes["VN_sd"].unique() == pytest.approx([0.15])


def test_meters_under_these_names_stay_meters(tmp_path):
    whole, _, v = nav_pvt()
    table = pd.DataFrame(whole).assign(height=6.25, hAcc=2, vAcc=3, sAcc=0.2, gSpeed=_SPEED)
    table = table.assign(velN=v[:, 0], velE=v[:, 1], velD=v[:, 2])
    table.assign(lat=table.lat * 1e-7, lon=table.lon * 1e-7).to_csv(tmp_path / "a.csv", index=False)
    fixes = sd.read_gnss(tmp_path / "a.csv")
    assert fixes["alt"].unique() == [6.25] and fixes["down_sd"].unique() == [3.0]
    np.testing.assert_allclose(fixes[["VN", "VE", "VD"]], v, atol=1e-9)


def test_whole_accuracies_beside_whole_coordinates_are_asked_about(tmp_path):
    whole, _, _ = nav_pvt()
    names = {"iTOW": "time_ms", "height": "alt_mm", "hAcc": "accuracy", "vAcc": "vertical_accuracy"}
    table = pd.DataFrame(whole).rename(columns=names)[["lat", "lon", *names.values()]]
    table.to_csv(tmp_path / "a.csv", index=False)
    with pytest.raises(DataError, check=coded("io.accuracy-unit-open")):
        sd.read_gnss(tmp_path / "a.csv")
    units = {"horizontal_accuracy": "mm", "vertical_accuracy": "mm"}
    assert sd.read_gnss(tmp_path / "a.csv", units=units)["down_sd"].unique() == pytest.approx([2.3])
    units = {"horizontal_accuracy": "m", "vertical_accuracy": "m"}
    assert sd.read_gnss(tmp_path / "a.csv", units=units)["down_sd"].unique() == [2300.0]
