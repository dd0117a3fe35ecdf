"""Positions as people write them: degrees and minutes, hemispheres, grids, tracks of maps."""

from __future__ import annotations

import json
import zipfile
from datetime import UTC, datetime

import numpy as np
import pytest
from scipy.integrate import quad
from tests.coded import coded

import strapdown as sd
from strapdown.errors import ConfigError, DataError
from strapdown.formats import reader_of
from strapdown.frames import geodetic_from_utm
from strapdown.tables.checks import GEODETIC

COUNT = 90
LAT, LON, ALT = 33.9 + 1e-4 * np.arange(COUNT), 18.4 + 2e-4 * np.arange(COUNT), 120.5
#: Half of the last digit of the coarsest form, a hundredth of a second.
DIGIT = 0.5e-2 / 3600.0


def fixes(path, **options):
    return sd.read_gnss(path, position_sd_m=3.0, **options)


def table(tmp_path, header, rows, name="fixes.csv"):
    path = tmp_path / name
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


def degrees_minutes(value, letters, form):
    size = abs(value)
    minutes = 60.0 * (size % 1.0)
    side = letters[int(value < 0.0)]
    return form.format(
        side=side,
        d=int(size),
        m=minutes,
        mm=int(minutes),
        s=60.0 * (minutes % 1.0),
        ddmm=100 * int(size) + minutes,
        size=size,
        sign="-" if value < 0.0 else "",
    )


@pytest.mark.parametrize("signs", [(1, 1), (-1, 1), (1, -1), (-1, -1)])
@pytest.mark.parametrize(
    "form",
    [
        "{d}°{mm}'{s:.4f}\"{side}",
        "{d}°{mm:02d}′{s:07.4f}″ {side}",
        "{side} {d}° {m:.6f}'",
        "{d} {m:.6f} {side}",
        "{d}:{mm}:{s:.4f}{side}",
        "{side}{size:.9f}",
        "{size:.9f}{side}",
        "{sign}{d}°{mm}'{s:.4f}\"",
        "{ddmm:.6f}{side}",
        "{sign}{ddmm:.6f}",
    ],
)
def test_angles_of_text(tmp_path, form, signs):
    lat, lon = signs[0] * LAT, signs[1] * LON
    rows = [
        ",".join(
            [
                str(k),
                '"' + degrees_minutes(lat[k], "NS", form).replace('"', '""') + '"',
                '"' + degrees_minutes(lon[k], "EW", form).replace('"', '""') + '"',
                str(ALT),
            ]
        )
        for k in range(COUNT)
    ]
    got = fixes(table(tmp_path, "time,lat,lon,alt", rows))
    np.testing.assert_allclose(got["lat"], lat, rtol=0, atol=DIGIT)
    np.testing.assert_allclose(got["lon"], lon, rtol=0, atol=DIGIT)
    said = [f.code for f in got.findings]
    assert ("io.coordinates-in-one-number" in said) == ("ddmm" in form)


@pytest.mark.parametrize(
    "text", ["48°61'0\"N", "48.5°12'N", "48N N", "48°12'E", "N48S", "forty", "48°12'61\"N"]
)
def test_a_text_that_is_no_latitude_is_refused_with_its_row(tmp_path, text):
    quoted = '"' + text.replace('"', '""') + '"'
    rows = [f"{k},48°1{k}'0N,16°1{k}'0E,1" for k in range(9)]
    rows[6] = f"6,{quoted},16°16'0E,1"
    path = table(tmp_path, "time,lat,lon,alt", rows)
    with pytest.raises(DataError, check=coded("io.no-coordinate", quantity="lat", row=8)):
        fixes(path)


@pytest.mark.parametrize("signed", [False, True])
def test_hemispheres_in_columns_of_their_own(tmp_path, signed):
    """As the loggers of QStarz write them; a sign that is there already is not turned."""
    header = "INDEX,RCR,DATE,TIME,VALID,LATITUDE,N/S,LONGITUDE,E/W,HEIGHT(m),SPEED(km/h)"
    sign = "-" if signed else ""
    rows = [
        f"{k + 1},T,2010/05/16,12:{k // 60:02d}:{k % 60:02d},SPS,{sign}{LAT[k]:.6f},S,"
        f"{LON[k]:.6f},E,20,50.0"
        for k in range(COUNT)
    ]
    got = fixes(table(tmp_path, header, rows))
    np.testing.assert_allclose(got["lat"], -LAT, rtol=0, atol=1e-6)
    np.testing.assert_allclose(got["lon"], LON, rtol=0, atol=1e-6)


def test_degrees_and_minutes_beside_columns_of_hemispheres(tmp_path):
    rows = []
    for k in range(COUNT):
        lat, lon = (degrees_minutes(v[k], "NS", "{d}°{m:.6f}'") for v in (LAT, LON))
        rows.append(f"{k},{lat},S,{lon},W,{ALT}")
    got = fixes(table(tmp_path, "time,lat,NS,lon,EW,alt", rows))
    np.testing.assert_allclose(got["lat"], -LAT, rtol=0, atol=DIGIT)
    np.testing.assert_allclose(got["lon"], -LON, rtol=0, atol=DIGIT)


def test_a_date_and_a_time_of_digits(tmp_path):
    """As the loggers of Columbus write them, with letters behind the angles."""
    header = "INDEX,TAG,DATE,TIME,LATITUDE N/S,LONGITUDE E/W,HEIGHT,SPEED,HEADING"
    seconds = 9 * 3600 + 59 * 60 + 10 + np.arange(COUNT)

    def rows(date):
        clock = [f"{s // 3600:02d}{s // 60 % 60:02d}{s % 60:02d}" for s in seconds.tolist()]
        return [
            f"{k + 1},T,{date},{clock[k]},{LAT[k]:.6f}S,{LON[k]:.6f}W,20,10,50"
            for k in range(COUNT)
        ]

    since = np.datetime64("2031-10-25", "s").astype(np.int64)
    got = fixes(table(tmp_path, header, rows("20311025")))
    # The digits of seconds since 1970.
    np.testing.assert_allclose(got.index, since + seconds, rtol=0, atol=5e-7)
    np.testing.assert_allclose(got["lat"], -LAT, rtol=0, atol=1e-6)
    np.testing.assert_allclose(got["lon"], -LON, rtol=0, atol=1e-6)
    # Of 2024 or of 2006, or no date at all: the time counts from midnight.
    for date in ("240506", "241306", "20241306"):
        got = fixes(table(tmp_path, header, rows(date)))
        np.testing.assert_array_equal(got.index, seconds)


def test_whole_numbers_of_receivers(tmp_path):
    header = "time,lat,lon,alt,vn,ve,vd"
    rows = [
        f"{k},{round(LAT[k] * 1e7)},{round(-LON[k] * 1e7)},{20500 + 7 * k},1,2,0"
        for k in range(COUNT)
    ]
    got = fixes(table(tmp_path, header, rows))
    np.testing.assert_allclose(got["lat"], LAT, rtol=0, atol=0.51e-7)
    np.testing.assert_allclose(got["lon"], -LON, rtol=0, atol=0.51e-7)
    np.testing.assert_allclose(got["alt"], 20.5 + 7e-3 * np.arange(COUNT), rtol=0, atol=1e-9)
    low = [",".join([*r.split(",")[:3], str(35 + k % 2), "1,2,0"]) for k, r in enumerate(rows)]
    path = table(tmp_path, header, low)
    with pytest.raises(DataError, check=coded("io.height-unit-open", quantity="alt")) as asked:
        fixes(path)
    assert "mm" in str(asked.value)
    assert fixes(path, units={"alt": "m"})["alt"].iloc[0] == 35.0
    assert fixes(path, units={"alt": "mm"})["alt"].iloc[0] == pytest.approx(0.035, abs=1e-12)


@pytest.mark.parametrize(
    "header",
    [
        "时间,纬度,经度,高度(m)",
        "Zeit,Breite,Länge,Höhe",
        "tiempo,latitud,longitud,altitud",
        "Время,Широта,Долгота,Высота",
        "GPS TOW (s),Lat (deg),Lng (deg),Ellipsoid Height (m)",
    ],
)
def test_names_of_other_languages(tmp_path, header):
    rows = [f"{k},{LAT[k]:.7f},{LON[k]:.7f},{ALT}" for k in range(COUNT)]
    got = fixes(table(tmp_path, header, rows))
    np.testing.assert_allclose(got[GEODETIC], np.column_stack([LAT, LON, [ALT] * COUNT]), atol=1e-7)


# The grid of UTM.


def meridian_arc(lat):
    """Length of the meridian from the equator, m, by its integral."""
    a, f = 6378137.0, 1 / 298.257223563
    e2 = f * (2 - f)
    found = quad(lambda p: a * (1 - e2) / (1 - e2 * np.sin(p) ** 2) ** 1.5, 0, np.radians(lat))
    return found[0]


@pytest.mark.parametrize("lat", [-79.0, -33.0, -0.5, 0.0, 12.0, 48.2, 67.0, 83.5])
def test_utm_on_the_central_meridian_is_its_arc(lat):
    south = lat < 0.0
    northing = 0.9996 * meridian_arc(lat) + (1e7 if south else 0.0)
    got = geodetic_from_utm([5e5], [northing], 33, south=south)[0]
    # A nanometer of the series, and the digits of a northing of 10,000 km.
    np.testing.assert_allclose(got, [lat, 15.0], rtol=0, atol=2e-14 * 1e7 / 1.1e5 + 1e-13)


def test_utm_is_conformal():
    """With the arc of the meridian this decides the projection: it is analytic (Gauss, Krüger).

    Of isometric latitude q and longitude, dq/dN = dl/dE and dq/dE = -dl/dN.
    """
    east, north = np.meshgrid(np.linspace(1.7e5, 8.3e5, 9), np.linspace(1e5, 9.2e6, 9))
    east, north, step = east.ravel(), north.ravel(), 50.0

    def q_l(de, dn):
        lat, lon = np.radians(geodetic_from_utm(east + de, north + dn, 1)).T
        f = 1 / 298.257223563
        e = np.sqrt(f * (2 - f))
        return np.arcsinh(np.tan(lat)) - e * np.arctanh(e * np.sin(lat)), np.unwrap(lon)

    (qe1, le1), (qe0, le0) = q_l(step, 0.0), q_l(-step, 0.0)
    (qn1, ln1), (qn0, ln0) = q_l(0.0, step), q_l(0.0, -step)
    size = np.hypot(qn1 - qn0, qe1 - qe0)
    # Central differences: the third derivative, of 1/R², over the step; and digits of an angle.
    limit = 1e-8
    assert np.abs((qn1 - qn0) - (le1 - le0)).max() < limit * size.max()
    assert np.abs((qe1 - qe0) + (ln1 - ln0)).max() < limit * size.max()
    assert np.all(size > 0.0)


def test_eastings_and_northings_need_their_zone(tmp_path):
    rows = [f"{k},{601000 + k},{5339000 + k},{ALT}" for k in range(COUNT)]
    path = table(tmp_path, "time,easting,northing,height", rows)
    with pytest.raises(DataError, check=coded("io.utm-zone-open")):
        fixes(path)
    got = fixes(path, origin="33N")
    np.testing.assert_array_equal(
        got[["lat", "lon"]],
        geodetic_from_utm(601000.0 + np.arange(COUNT), 5339000.0 + np.arange(COUNT), 33),
    )
    assert (got["alt"] == ALT).all()
    with pytest.raises(ConfigError, check=coded("io.no-utm-zone")):
        fixes(path, origin="33U")
    # An elevation is over the sea or over the ellipsoid.
    other = table(tmp_path, "time,easting,northing,elevation", rows, "other.csv")
    with pytest.raises(DataError, check=coded("io.height-level-not-stated")):
        fixes(other, origin="33N")
    assert len(fixes(other, origin="33N", datum_height_m=0.0)) == COUNT
    flat = table(tmp_path, "time,easting,northing", [r.rpartition(",")[0] for r in rows], "f.csv")
    with pytest.raises(DataError, check=coded("io.missing-columns-2")):
        fixes(flat, origin="33N")


# Tracks of maps.

DATES = [f"2024-05-06T09:{k // 60:02d}:{k % 60:02d}Z" for k in range(COUNT)]
STAMPS = np.datetime64("2024-05-06T09:00:00", "s").astype(np.int64) + np.arange(COUNT)


def as_read(got, count=COUNT):
    np.testing.assert_array_equal(got.index, STAMPS[:count])
    place = np.column_stack([LAT, LON, np.full(COUNT, ALT)])[:count]
    np.testing.assert_allclose(got[GEODETIC], place, rtol=0, atol=1e-9)


def kml(mode, untimed=0):
    coords = "".join(f"<gx:coord>{LON[k]:.9f} {LAT[k]:.9f} {ALT}</gx:coord>" for k in range(COUNT))
    whens = "".join(f"<when>{d}</when>" for d in DATES[: COUNT - untimed])
    return (
        '<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2" '
        'xmlns:gx="http://www.google.com/kml/ext/2.2"><Document><Placemark><gx:Track>'
        f"<altitudeMode>{mode}</altitudeMode>{whens}{coords}</gx:Track></Placemark>"
        "<Placemark><LineString><coordinates>1,2,3 4,5,6</coordinates></LineString></Placemark>"
        "</Document></kml>"
    )


def test_a_track_of_kml(tmp_path):
    path = tmp_path / "track.kml"
    path.write_text(kml("absolute"))
    assert reader_of(path)[0] == "kml"
    with pytest.raises(DataError, check=coded("io.height-over-sea-column")):
        fixes(path)
    as_read(fixes(path, datum_height_m=0.0))
    path.write_text(kml("clampToGround", untimed=5))
    with pytest.raises(DataError, check=coded("io.height-level-not-stated")):
        fixes(path)
    got = fixes(path, datum_height_m=0.0)
    as_read(got, COUNT - 5)
    assert "io.points-without-time" in [f.code for f in got.findings]
    with zipfile.ZipFile(tmp_path / "track.kmz", "w") as archive:
        archive.write(path, "doc.kml")
    as_read(fixes(tmp_path / "track.kmz", datum_height_m=0.0), COUNT - 5)


def test_places_of_kml_with_time_stamps(tmp_path):
    places = "".join(
        f"<Placemark><TimeStamp><when>{DATES[k]}</when></TimeStamp><Point>"
        f"<coordinates>{LON[k]:.9f},{LAT[k]:.9f},{ALT}</coordinates></Point></Placemark>"
        for k in range(COUNT)
    )
    path = tmp_path / "places.kml"
    path.write_text(f'<kml xmlns="http://www.opengis.net/kml/2.2"><Folder>{places}</Folder></kml>')
    as_read(fixes(path, datum_height_m=0.0))


@pytest.mark.parametrize("text", ["<kml><a>", "<kml><gx:Track/></kml>", "<kml></kml>"])
def test_kml_that_cannot_be_used(tmp_path, text):
    path = tmp_path / "bad.kml"
    path.write_text(text)
    with pytest.raises(DataError) as refused:
        fixes(path)
    assert refused.value.finding.code in ("io.track-unreadable", "io.track-without-time")


def tcx(kind="Activities", height=True):
    """Two laps, of which the second begins with the last point of the first; as Garmin has them."""

    def point(k):
        over = f"<AltitudeMeters>{ALT}</AltitudeMeters>" if height else ""
        return (
            f"<Trackpoint><Time>{DATES[k]}</Time><Position><LatitudeDegrees>{LAT[k]:.9f}"
            f"</LatitudeDegrees><LongitudeDegrees>{LON[k]:.9f}</LongitudeDegrees></Position>{over}"
            "<HeartRateBpm><Value>120</Value></HeartRateBpm><Extensions><ns3:TPX>"
            "<ns3:Speed>3.1</ns3:Speed></ns3:TPX></Extensions></Trackpoint>"
        )

    first, second = ("".join(map(point, r)) for r in (range(10), range(9, COUNT)))
    inside = "<Trackpoint><Time>2024-03-05T11:59:59Z</Time></Trackpoint>"  # no position yet
    one = "Activity" if kind == "Activities" else "Course"
    return (
        '<?xml version="1.0" encoding="UTF-8"?><TrainingCenterDatabase '
        'xmlns="http://www.garmin.com/xmlschemas/TrainingCenterDatabase/v2" '
        'xmlns:ns3="http://www.garmin.com/xmlschemas/ActivityExtension/v2">'
        f'<{kind}><{one}><Lap StartTime="{DATES[0]}"><Track>{inside}{first}</Track></Lap>'
        f"<Lap><Track>{second}</Track></Lap></{one}></{kind}></TrainingCenterDatabase>"
    )


def test_laps_of_tcx(tmp_path):
    path = tmp_path / "activity.tcx"
    path.write_text(tcx())
    assert reader_of(path)[0] == "tcx"
    with pytest.raises(DataError, check=coded("io.height-level-not-stated")):
        fixes(path)
    as_read(fixes(path, datum_height_m=0.0))
    path.write_text(tcx(height=False))
    with pytest.raises(DataError, check=coded("io.fixes-without-height")):
        fixes(path)
    # The times of a planned course are not measured.
    path.write_text(tcx("Courses"))
    with pytest.raises(DataError, check=coded("io.track-without-time")):
        fixes(path, datum_height_m=0.0)
    path.write_text(tcx()[:-30])
    with pytest.raises(DataError, check=coded("io.track-unreadable", title="TCX")):
        fixes(path)


@pytest.mark.parametrize(
    ("level", "code"),
    [("HFALGALTGPS:ELL", ""), ("HFALGALTGPS:GEO", "io.height-over-sea-column"), ("", "open")],
)
def test_a_flight_recorder(tmp_path, level, code):
    """Across midnight, with a fix of which the receiver has no altitude."""

    def row(at, lat, lon, valid="A"):
        minutes = [round(60e3 * abs(v)) for v in (lat, lon)]
        places = f"{minutes[0] // 60000:02d}{minutes[0] % 60000:05d}{'NS'[lat < 0]}"
        places += f"{minutes[1] // 60000:03d}{minutes[1] % 60000:05d}{'EW'[lon < 0]}"
        return f"B{at}{places}{valid}00480{520 if valid == 'A' else 0:05d}009"

    rows = ["AXYZABC", "HFDTEDATE:050324,01", "HFFXA035", *([level] if level else [])]
    rows += [row("235958", -48.25, -11.5), row("235959", -48.25, -11.5, "V")]
    rows += [row("000000", -48.250100, -11.500050), "LXYZ a comment", row("000001", -48.25, -11.5)]
    path = tmp_path / "flight.igc"
    path.write_text("\r\n".join(rows) + "\r\n")
    assert reader_of(path)[0] == "igc"
    stated = {} if level.endswith("ELL") else {"datum_height_m": 0.0}
    if stated:
        code = "io.height-level-not-stated" if code == "open" else code
        with pytest.raises(DataError, check=coded(code)):
            fixes(path)
    got = fixes(path, **stated)
    noon = datetime(2024, 3, 5, 23, 59, 58, tzinfo=UTC).timestamp()
    np.testing.assert_array_equal(got.index, noon + np.array([0.0, 2.0, 3.0]))
    # A thousandth of a minute.
    np.testing.assert_allclose(got["lat"], [-48.25, -48.2501, -48.25], rtol=0, atol=0.5 / 60e3)
    np.testing.assert_allclose(got["lon"], [-11.5, -11.50005, -11.5], rtol=0, atol=0.5 / 60e3)
    np.testing.assert_array_equal(got["alt"], 520.0)
    assert "io.fixes-without-position-left-out" in [f.code for f in got.findings]
    path.write_text("\n".join(rows).replace("050324", "990324"))
    with pytest.raises(DataError, check=coded("io.track-time-no-date")):
        fixes(path, **stated)


def feature(kind, where, **properties):
    geometry = {"type": kind, "coordinates": where}
    return {"type": "Feature", "geometry": geometry, "properties": properties}


@pytest.mark.parametrize("shape", ["points", "path", "one path"])
def test_geojson_with_times(tmp_path, shape):
    where = [[float(LON[k]), float(LAT[k]), ALT] for k in range(COUNT)]
    path_of_all = feature("LineString", where, coordTimes=DATES)
    content = {
        "points": {
            "type": "FeatureCollection",
            "features": [feature("Point", p, time=d) for p, d in zip(where, DATES, strict=True)],
        },
        "path": {"type": "FeatureCollection", "features": [path_of_all]},
        "one path": path_of_all,
    }[shape]
    path = tmp_path / "track.geojson"
    path.write_text(json.dumps(content))
    assert reader_of(path)[0] == "geojson"
    as_read(fixes(path))


@pytest.mark.parametrize(
    ("one", "code"),
    [
        (feature("Point", [16.0, 48.0]), "io.track-without-time"),
        (feature("Point", [16.0, 48.0], time="noon"), "io.track-time-no-date"),
        (feature("Point", ["x", 48.0], time=DATES[0]), "io.track-place-no-number"),
        (feature("Point", None, time=DATES[0]), "io.track-place-no-number"),
        (feature("LineString", 4, coordTimes=DATES), "io.track-place-no-number"),
        (feature("Polygon", [[[16.0, 48.0]]], time=DATES[0]), "io.track-without-time"),
    ],
)
def test_geojson_that_cannot_be_used(tmp_path, one, code):
    path = tmp_path / "bad.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [one]}))
    with pytest.raises(DataError, check=coded(code)):
        fixes(path)


def test_a_list_that_is_the_member_of_an_object(tmp_path):
    """As the locations that Google hands out."""
    places = [
        {
            "timestampMs": str(1000 * int(STAMPS[k])),
            "latitudeE7": round(LAT[k] * 1e7),
            "longitudeE7": round(LON[k] * 1e7),
            "accuracy": 5,
            "altitude": 120,
        }
        for k in range(COUNT)
    ]
    path = tmp_path / "records.json"
    path.write_text(json.dumps({"version": 1, "locations": places}, indent=1))
    got = fixes(path)
    np.testing.assert_array_equal(got.index, STAMPS)
    np.testing.assert_allclose(got["lat"], LAT, rtol=0, atol=0.51e-7)
    assert (got["alt"] == 120.0).all()


# What a second reader of the first version found read wrong in silence.


@pytest.mark.parametrize("name", ["time", "UTC", "utc_time", "Zeit"])
@pytest.mark.parametrize("form", ["{h:02d}{m:02d}{s:02d}", "{h:02d}{m:02d}{s:02d}.00"])
def test_a_time_of_day_of_digits_without_a_date(tmp_path, name, form):
    """It crosses a full hour; as a number it would jump by 4,040 s there."""
    seconds = 9 * 3600 + 59 * 60 + 10 + np.arange(COUNT)
    rows = [
        f"{form.format(h=s // 3600, m=s // 60 % 60, s=s % 60)},{LAT[k]:.6f},{LON[k]:.6f},{ALT}"
        for k, s in enumerate(seconds.tolist())
    ]
    got = fixes(table(tmp_path, f"{name},lat,lon,alt", rows))
    np.testing.assert_array_equal(got.index, seconds)


def test_seconds_with_a_gap_stay_seconds(tmp_path):
    seconds = np.r_[np.arange(40.0), np.arange(100.0, 140.0)]
    rows = [f"{s},{LAT[k]:.6f},{LON[k]:.6f},{ALT}" for k, s in enumerate(seconds)]
    got = fixes(table(tmp_path, "time,lat,lon,alt", rows))
    np.testing.assert_array_equal(got.index, seconds)


@pytest.mark.parametrize(
    ("south", "west"), [("South", "West"), ("Sur", "Oeste"), ("sud", "OUEST"), ("s", "w")]
)
def test_hemispheres_in_words(tmp_path, south, west):
    rows = [f"{k},{LAT[k]:.6f},{south},{LON[k]:.6f},{west},{ALT}" for k in range(COUNT)]
    got = fixes(table(tmp_path, "time,lat,ns,lon,ew,alt", rows))
    np.testing.assert_allclose(got[["lat", "lon"]], -np.column_stack([LAT, LON]), atol=1e-6)


def test_the_letter_o_is_east_or_west(tmp_path):
    rows = [f"{k},{LAT[k]:.6f},S,{LON[k]:.6f},O,{ALT}" for k in range(COUNT)]
    with pytest.raises(DataError, check=coded("io.hemisphere-open", quantity="lon")):
        fixes(table(tmp_path, "time,lat,ns,lon,ew,alt", rows))
    rows = [r.replace(",O,", ",E,") if k else r for k, r in enumerate(rows)]
    got = fixes(table(tmp_path, "time,lat,ns,lon,ew,alt", rows))
    assert np.sign(got["lon"]).tolist() == [-1.0] + [1.0] * (COUNT - 1)


@pytest.mark.parametrize(
    ("lat", "lon", "signs"),
    [
        ("lat (S)", "longitude (W)", (-1, -1)),
        ("Latitude N", "Longitude W", (1, -1)),
        ("lat_N", "lon_E", (1, 1)),
    ],
)
def test_hemispheres_in_names(tmp_path, lat, lon, signs):
    rows = [f"{k},{LAT[k]:.6f},{LON[k]:.6f},{ALT}" for k in range(COUNT)]
    got = fixes(table(tmp_path, f"time,{lat},{lon},alt", rows))
    expected = np.column_stack([signs[0] * LAT, signs[1] * LON])
    np.testing.assert_allclose(got[["lat", "lon"]], expected, atol=1e-6)


def test_longitudes_that_go_round(tmp_path):
    rows = [f"{k},{LAT[k]:.6f},{360.0 - 105.2 + 1e-4 * k:.6f},{ALT}" for k in range(COUNT)]
    got = fixes(table(tmp_path, "time,lat,lon,alt", rows))
    np.testing.assert_allclose(got["lat"], LAT, atol=1e-6)
    np.testing.assert_allclose(got["lon"], -105.2 + 1e-4 * np.arange(COUNT), atol=1e-6)


def test_whole_numbers_that_may_be_of_1e_6_deg_are_asked_about(tmp_path):
    rows = [f"{k},{round(1e6 * LAT[k])},{round(1e6 * LON[k])},120500" for k in range(COUNT)]
    with pytest.raises(DataError, check=coded("io.coordinate-scale-open")):
        fixes(table(tmp_path, "time,lat,lon,alt", rows))


def test_a_height_above_all_aircraft_is_asked_about(tmp_path):
    rows = [f"{k},{LAT[k]:.6f},{LON[k]:.6f},1600000" for k in range(COUNT)]
    path = table(tmp_path, "time,lat,lon,alt", rows)
    with pytest.raises(DataError, check=coded("io.height-too-large", quantity="alt")):
        fixes(path)
    assert fixes(path, units={"alt": "mm"})["alt"].iloc[0] == pytest.approx(1600.0, abs=1e-9)


def test_the_remedy_for_a_velocity_names_all_its_parts(tmp_path):
    """Typed with one part alone, the others stayed a thousand times too large."""
    north = 33.9 + np.arange(COUNT) * 9.4 / 111_000.0
    east = 18.4 + np.arange(COUNT) * 12.1 / 92_300.0
    rows = [f"{k},{north[k]:.8f},{east[k]:.8f},{ALT},9400,12100,0" for k in range(COUNT)]
    path = table(tmp_path, "time,lat,lon,alt,vel_n,vel_e,vel_d", rows)
    with pytest.raises(DataError, check=coded("io.speed-unit-not-stated")) as asked:
        fixes(path)
    answer = json.loads(str(asked.value).partition("units=")[2].partition("}")[0] + "}")
    got = fixes(path, units=answer)
    np.testing.assert_allclose(got[["VN", "VE"]].iloc[0], [9.4, 12.1], rtol=1e-9)


def test_a_row_without_a_longitude_does_not_hide_that_they_go_round(tmp_path):
    rows = [f"{k},{LAT[k]:.6f},{254.8 + 1e-4 * k:.6f},{ALT}" for k in range(COUNT)]
    rows[7] = f"7,{LAT[7]:.6f},,{ALT}"
    got = fixes(table(tmp_path, "time,lat,lon,alt", rows), repair=True)
    assert len(got) == COUNT - 1
    np.testing.assert_allclose(got["lat"], np.delete(LAT, 7), atol=1e-6)


@pytest.mark.parametrize(("lat", "lon"), [("lat_N", "lon_E"), ("lat (S)", "lon (W)")])
def test_angles_that_have_a_sign_keep_it_whatever_their_name_says(tmp_path, lat, lon):
    rows = [f"{k},{-LAT[k]:.6f},{-LON[k]:.6f},{ALT}" for k in range(COUNT)]
    got = fixes(table(tmp_path, f"time,{lat},{lon},alt", rows))
    np.testing.assert_allclose(got[["lat", "lon"]], -np.column_stack([LAT, LON]), atol=1e-6)


def test_a_letter_of_another_column_is_no_hemisphere(tmp_path):
    """A mode E (estimated) or N (not valid), apart from the angles, says nothing of them."""
    rows = [f"{k},{-LAT[k]:.6f},{-LON[k]:.6f},{ALT},N,E,7" for k in range(COUNT)]
    got = fixes(table(tmp_path, "time,lat,lon,alt,mode,state,count", rows))
    np.testing.assert_allclose(got[["lat", "lon"]], -np.column_stack([LAT, LON]), atol=1e-6)
