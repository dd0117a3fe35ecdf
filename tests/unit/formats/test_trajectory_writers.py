"""What trajectories are written as, read by others' rules."""

from __future__ import annotations

import importlib.util
import json
import xml.etree.ElementTree as ElementTree
from datetime import UTC, datetime, timedelta, timezone
from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from tests.coded import coded

from strapdown import rotation
from strapdown.ellipsoids import ELLIPSOIDS
from strapdown.errors import ConfigError, DataError
from strapdown.evaluation.trajectory_differences import trajectory_differences
from strapdown.formats.trajectory_writers import cut_at_date_line, thin, write_error_csv
from strapdown.formats.writers import (
    TRAJECTORY_FORMATS,
    WRITERS,
    FileOptions,
    write_trajectory,
)
from strapdown.frames import ecef_from_geodetic
from strapdown.tables import trajectory_table

_spec = importlib.util.spec_from_file_location(
    "made_trajectories", Path(__file__).parents[1] / "evaluation" / "made_trajectories.py"
)
made = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(made)

KML = "{http://www.opengis.net/kml/2.2}"
GX = "{http://www.google.com/kml/ext/2.2}"
EPOCH = datetime(2026, 3, 1, 12, tzinfo=UTC)


def table(place, time=None, velocity=(0, 0, 0), euler=(0, 0, 0)):
    place = np.array(place, dtype=float)
    n = len(place)
    time = np.arange(n, dtype=float) if time is None else time
    return trajectory_table(time, place, np.tile(velocity, (n, 1)), np.tile(euler, (n, 1)), "made")


def write(form, path, trajectory, name="trajectory", **options):
    WRITERS[form].write(path, {"reference": trajectory}, FileOptions(name=name, **options))
    return path


# --- all ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", TRAJECTORY_FORMATS)
def test_the_same_trajectory_gives_the_same_bytes(tmp_path, form):
    track = made.random_trajectory(1)
    before = track.copy(deep=True)
    a = write(form, tmp_path / f"a.{form}", track, epoch=EPOCH, most_points=50).read_bytes()
    b = write(form, tmp_path / f"b.{form}", track, epoch=EPOCH, most_points=50).read_bytes()
    assert a == b
    if form not in ("parquet", "geoparquet"):
        assert a.endswith(b"\n")
        assert b"-0," not in a and b"-0.0 " not in a
    assert track.equals(before)


@pytest.mark.parametrize("form", TRAJECTORY_FORMATS)
def test_a_hostile_name_stays_a_name(tmp_path, form):
    name = 'a\n<b>&"\x00]]>\ud800 ü,'
    path = write(form, tmp_path / f"a.{form}", made.random_trajectory(1, 5), name=name)
    if form in ("parquet", "geoparquet"):
        assert pq.read_schema(path).metadata[b"trajectory"].decode() == 'a <b>&"]]> ü,'
        return
    text = path.read_text(encoding="utf-8")
    if form == "nav":
        # It has no place for a name.
        assert len(text.split()) == 11 * 5
    elif form == "kml":
        root = ElementTree.fromstring(path.read_bytes())
        assert root.find(f"{KML}Document/{KML}name").text == 'a <b>&"]]> ü,'
    elif form == "gpx":
        root = ElementTree.fromstring(path.read_bytes())
        assert root.find("{*}trk/{*}name").text == 'a <b>&"]]> ü,'
    elif form == "geojson":
        assert json.loads(text)["features"][0]["properties"]["name"] == 'a <b>&"]]> ü,'
    else:
        assert text.splitlines()[0] == '# trajectory: a <b>&"]]> ü,'


@pytest.mark.parametrize("form", TRAJECTORY_FORMATS)
def test_a_table_that_is_none_is_refused(tmp_path, form):
    track = made.random_trajectory(1, 5)
    with pytest.raises(DataError, check=coded("tables.missing-columns")):
        write(form, tmp_path / "a", track.drop(columns="VD"))
    assert not (tmp_path / "a").exists()


@pytest.mark.parametrize("form", ["tum", "kml", "geojson", "geoparquet"])
def test_a_trajectory_without_rows_is_no_file(tmp_path, form):
    with pytest.raises(DataError, check=coded("io.trajectory-no-rows")):
        write(form, tmp_path / "a", made.random_trajectory(1, 5).iloc[:0])


@pytest.mark.parametrize("form", ["kml", "geojson"])
def test_maps_know_wgs84_alone(tmp_path, form):
    with pytest.raises(ConfigError, match="refer to krassovsky1940"):
        write(
            form,
            tmp_path / "a",
            made.random_trajectory(1, 5),
            ellipsoid=ELLIPSOIDS["krassovsky1940"],
        )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"epoch": datetime(2026, 3, 1)}, "no time zone"),
        (
            {"geoid_undulation": 4000.0},
            "geoid_undulation: a geoid height of 4000 m over the ellipsoid is out",
        ),
        (
            {"geoid_undulation": float("nan")},
            "geoid_undulation: a geoid height of nan m over the ellipsoid is out",
        ),
        ({"most_points": 1}, "most_points: 1 points are too few for a line"),
        ({"tum_frame": "emu"}, "did you mean 'enu'"),
    ],
)
def test_choices_that_are_none(options, message):
    with pytest.raises(ConfigError, match=message):
        FileOptions(**options)


def test_a_date_that_is_none(tmp_path):
    with pytest.raises(
        DataError, match=r"epoch: 1e\+12 s after 2026-03-01T12:00:00\+00:00 is beyond the range"
    ):
        write("kml", tmp_path / "a", table([[1, 2, 3]], time=[1e12]), epoch=EPOCH)


# --- TUM ---------------------------------------------------------------------------------------


def poses_of(path):
    """As any reader of the format takes it: comments left out, eight numbers a line."""
    rows = [line.split(" ") for line in path.read_text().splitlines() if line[0] != "#"]
    assert {len(r) for r in rows} == {8}
    numbers = np.array(rows, dtype=float)
    q = numbers[:, [7, 4, 5, 6]]
    # Norms to the rounding of four products.
    assert np.abs((q * q).sum(axis=1) - 1.0).max() < 2e-15
    return numbers[:, 0], numbers[:, 1:4], q


@pytest.mark.parametrize("frame", ["enu", "ned"])
def test_tum_positions_are_those_of_pymap3d(tmp_path, frame):
    import pymap3d

    track = made.random_trajectory(3)
    time, position, _ = poses_of(write("tum", tmp_path / "a.tum", track, tum_frame=frame))
    assert np.array_equal(time, track.index)
    place = track[["lat", "lon", "alt"]].to_numpy()
    convert = {"enu": pymap3d.geodetic2enu, "ned": pymap3d.geodetic2ned}[frame]
    # Differences of numbers of 6.4e6 m.
    assert np.abs(position - np.column_stack(convert(*place.T, *place[0]))).max() < 5e-9
    assert not position[0].any()


def test_tum_axes_one_by_one(tmp_path):
    # Level, heading east: forward is east (x), left is north (y), up is up: no rotation at all.
    track = table([[48.0, 11.0, 500.0], [48.0, 11.001, 500.0], [48.001, 11.0, 510.0]])
    track["heading"] = 90.0
    _, position, q = poses_of(write("tum", tmp_path / "a.tum", track))
    assert np.abs(q[0] - [1, 0, 0, 0]).max() < 1e-15
    assert position[1, 0] > 70.0 > 1.0 > abs(position[1, 1])
    assert position[2, 1] > 100.0 > 11.0 > position[2, 2] > 9.0
    # In north-east-down the body's axes are ours, and the quaternion is q_nb.
    track[["roll", "pitch", "heading"]] = [10.0, -20.0, 30.0]
    _, position, q = poses_of(write("tum", tmp_path / "b.tum", track, tum_frame="ned"))
    assert np.abs(q[0] - rotation.quaternion_from_euler([10.0, -20.0, 30.0])).max() < 1e-15
    assert position[1, 1] > 70.0
    assert -11.0 < position[2, 2] < -9.0
    text = (tmp_path / "b.tum").read_text()
    assert "# world axes: north, east, down at the origin" in text
    assert "# origin lat lon deg, height m: 48.0 11.0 500.0" in text


def test_tum_tells_the_turning_of_the_local_level_from_that_of_the_body(tmp_path):
    # A quarter of the Earth along the equator, level and heading east all the way: in one frame the
    # body has pitched down by the angle travelled.
    lon = np.linspace(0.0, 90.0, 7)
    track = table(np.column_stack([0 * lon, lon, 0 * lon]), euler=(0, 0, 90))
    _, position, q = poses_of(write("tum", tmp_path / "a.tum", track))
    forward = rotation.rotate(q, [1.0, 0.0, 0.0])
    angle = np.radians(lon)
    expected = np.column_stack([np.cos(angle), 0 * lon, -np.sin(angle)])
    assert np.abs(forward - expected).max() < 1e-15 * 4
    a = 6378137.0
    circle = a * np.column_stack([np.sin(angle), 0 * lon, np.cos(angle) - 1.0])
    assert np.abs(position - circle).max() < 5e-9


def test_tum_in_the_earths_axes(tmp_path):
    track = made.random_trajectory(4, 20)
    _, position, q = poses_of(write("tum", tmp_path / "a.tum", track, tum_frame="ecef"))
    assert np.array_equal(position, ecef_from_geodetic(track[["lat", "lon", "alt"]].to_numpy()))
    # Down of a level body points to the Earth.
    level = table([[0.0, 90.0, 0.0]])
    _, _, q = poses_of(write("tum", tmp_path / "b.tum", level, tum_frame="ecef"))
    assert np.abs(rotation.rotate(q[0], [0, 0, 1]) - [0, -1, 0]).max() < 1e-15
    assert "origin" not in (tmp_path / "b.tum").read_text()


def test_tum_quaternions_do_not_jump(tmp_path):
    heading = np.arange(0.0, 1000.0, 7.0)
    track = table(np.tile([10.0, 20.0, 0.0], (len(heading), 1)))
    track["heading"] = heading % 360.0
    _, _, q = poses_of(write("tum", tmp_path / "a.tum", track))
    # A turn of 7 deg moves a quaternion by 2 sin(7/4 deg).
    step = np.linalg.norm(np.diff(q, axis=0), axis=1)
    assert np.abs(step - 2.0 * np.sin(np.radians(1.75))).max() < 1e-14


# --- KML ---------------------------------------------------------------------------------------


def kml(path):
    root = ElementTree.fromstring(path.read_bytes())
    assert root.tag == f"{KML}kml"
    return root.find(f"{KML}Document")


def line_of(element):
    return np.array([[float(v) for v in c.split(",")] for c in element.text.split()])


def test_kml_has_what_the_schema_wants_in_its_order(tmp_path):
    track = made.weaving(np.arange(0.0, 10.0, 0.5))
    document = kml(write("kml", tmp_path / "a.kml", track, name="drive", epoch=EPOCH))
    tags = [e.tag.removeprefix(KML) for e in document]
    assert tags == ["name", "description", "Style", *["Placemark"] * 4]
    path, gx, start, end = document.findall(f"{KML}Placemark")
    assert [e.tag.removeprefix(KML) for e in path] == ["name", "styleUrl", "LineString"]
    assert [e.tag.removeprefix(KML) for e in path.find(f"{KML}LineString")] == [
        "altitudeMode",
        "coordinates",
    ]
    assert path.find(f"{KML}LineString/{KML}altitudeMode").text == "absolute"
    points = line_of(path.find(f"{KML}LineString/{KML}coordinates"))
    known = track[["lon", "lat", "alt"]].to_numpy()
    # Nine decimals and four.
    assert np.all(np.abs(points - known) <= [5.1e-10, 5.1e-10, 5.1e-5])
    children = [e.tag for e in gx.find(f"{GX}Track")]
    assert children == [f"{KML}altitudeMode", *[f"{KML}when"] * 20, *[f"{GX}coord"] * 20]
    coords = [c.text.split(" ") for c in gx.iter(f"{GX}coord")]
    assert np.array_equal(np.array(coords, dtype=float), points)
    whens = [w.text for w in gx.iter(f"{KML}when")]
    assert whens[1] == "2026-03-01T12:00:00.500000Z"
    assert [e.tag.removeprefix(KML) for e in start] == [
        "name",
        "description",
        "TimeStamp",
        "Point",
    ]
    assert start.find(f"{KML}TimeStamp/{KML}when").text == whens[0]
    assert np.array_equal(line_of(end.find(f"{KML}Point/{KML}coordinates"))[0], points[-1])


def test_kml_without_an_epoch_has_no_dates(tmp_path):
    path = write("kml", tmp_path / "a.kml", made.weaving(np.arange(0.0, 10.0, 0.5)))
    assert b"<when>" not in path.read_bytes()
    assert len(kml(path).findall(f"{KML}Placemark")) == 3


def test_an_epoch_of_another_zone_is_written_in_utc(tmp_path):
    zone = EPOCH.astimezone(timezone(timedelta(hours=5)))
    track = made.weaving([0.0, 1.0])
    a, b = (write("kml", tmp_path / n, track, epoch=e) for n, e in (("a", EPOCH), ("b", zone)))
    assert a.read_bytes() == b.read_bytes()


def test_kml_says_what_its_heights_are(tmp_path):
    track = table([[48.0, 11.0, 548.25], [48.1, 11.0, 549.25]])
    document = kml(write("kml", tmp_path / "a.kml", track))
    assert "from the EGM96 geoid" in document.find(f"{KML}description").text
    assert line_of(next(document.iter(f"{KML}coordinates")))[0, 2] == 548.25
    document = kml(write("kml", tmp_path / "b.kml", track, geoid_undulation=47.5))
    assert "47.5 m" in document.find(f"{KML}description").text
    assert line_of(next(document.iter(f"{KML}coordinates")))[0, 2] == 500.75


def test_kml_over_the_date_line_is_cut(tmp_path):
    track = table([[10.0, 179.5, 0.0], [10.0, -179.5, 100.0]])
    document = kml(write("kml", tmp_path / "a.kml", track))
    parts = document.findall(f".//{KML}MultiGeometry/{KML}LineString/{KML}coordinates")
    assert [line_of(p).tolist() for p in parts] == [
        [[179.5, 10, 0], [180, 10, 50]],
        [[-180, 10, 50], [-179.5, 10, 100]],
    ]


@pytest.mark.parametrize("form", ["kml", "geojson"])
def test_one_row_is_a_point(tmp_path, form):
    path = write(form, tmp_path / "a", table([[48.0, 11.0, 500.0]]), epoch=EPOCH)
    if form == "kml":
        (only,) = kml(path).findall(f"{KML}Placemark")
        assert only.find(f"{KML}Point") is not None
    else:
        (only,) = json.loads(path.read_text())["features"]
        assert only["geometry"]["type"] == "Point"


# --- GeoJSON -----------------------------------------------------------------------------------


def check_rfc7946(collection):
    """The rules that concern points and lines."""
    assert set(collection) == {"type", "features"}
    assert collection["type"] == "FeatureCollection"
    assert "crs" not in collection
    for feature in collection["features"]:
        assert set(feature) == {"type", "geometry", "properties"}
        assert feature["type"] == "Feature"
        kind, coordinates = feature["geometry"]["type"], feature["geometry"]["coordinates"]
        lines = {"Point": lambda c: [[c]], "LineString": lambda c: [c]}.get(kind, lambda c: c)
        for line in lines(coordinates):
            assert len(line) >= (1 if kind == "Point" else 2)
            for lon, lat, height in line:
                assert -180.0 <= lon <= 180.0
                assert -90.0 <= lat <= 90.0
                assert np.isfinite(height)
            # No step crosses the date line.
            assert all(abs(a[0] - b[0]) < 180.0 for a, b in pairwise(line))


def test_geojson_has_path_and_ends(tmp_path):
    track = made.weaving(np.arange(0.0, 10.5, 0.5))
    collection = json.loads(
        write("geojson", tmp_path / "a", track, name="drive", epoch=EPOCH).read_text()
    )
    check_rfc7946(collection)
    path, start, end = collection["features"]
    assert path["geometry"]["type"] == "LineString"
    known = track[["lon", "lat", "alt"]].to_numpy()
    off = np.abs(np.array(path["geometry"]["coordinates"]) - known).max(axis=0)
    assert np.all(off <= [5.1e-10, 5.1e-10, 5.1e-5])
    properties = path["properties"]
    assert properties["time_s"] == track.index.tolist()
    assert (properties["start_s"], properties["end_s"]) == (0.0, 10.0)
    assert properties["end_utc"] == "2026-03-01T12:00:10.000000Z"
    speed = np.linalg.norm(track[["VN", "VE", "VD"]], axis=1)
    assert properties["largest_speed_m_s"] == speed.max()
    assert speed.min() < properties["mean_speed_m_s"] < speed.max()
    assert properties["largest_deviation_m"] == 0.0
    assert start["properties"]["VE_m_s"] == track["VE"].iloc[0]
    assert end["properties"]["heading_deg"] == track["heading"].iloc[-1]
    assert end["properties"]["time_utc"] == properties["end_utc"]
    assert start["geometry"]["coordinates"] == path["geometry"]["coordinates"][0]


def test_geojson_over_the_date_line_is_cut(tmp_path):
    # The example of RFC 7946, 3.1.9.
    track = table([[45.0, 170.0, 0.0], [45.0, -170.0, 0.0]])
    collection = json.loads(write("geojson", tmp_path / "a", track).read_text())
    check_rfc7946(collection)
    assert collection["features"][0]["geometry"] == {
        "type": "MultiLineString",
        "coordinates": [[[170, 45, 0], [180, 45, 0]], [[-180, 45, 0], [-170, 45, 0]]],
    }
    assert collection["features"][0]["properties"]["time_s"] == [[0.0, 0.5], [0.5, 1.0]]


@pytest.mark.parametrize(
    ("lon", "parts"),
    [
        ([170.0, 179.0], [[170, 179]]),
        ([179.0, 180.0, -179.0], [[179, 180], [-180, -179]]),
        ([179.0, -180.0, 179.0], [[179, 180, 179]]),
        ([-179.0, 180.0, 180.0, 179.0], [[-179, -180, -180], [180, 179]]),
        ([179.0, -179.0, 179.0], [[179, 180], [-180, -179, -180], [180, 179]]),
        ([350.0, 370.0], [[-10, 10]]),
        ([190.0, 170.0], [[-170, -180], [180, 170]]),
        ([180.0, 180.0], [[-180, -180]]),
        ([0.0, 120.0, -120.0, 0.0, 120.0], [[0, 120, 180], [-180, -120, 0, 120]]),
    ],
)
def test_cuts(lon, parts):
    cut = cut_at_date_line(np.column_stack([np.array(lon), np.arange(len(lon))]))
    assert [p[:, 0].tolist() for p in cut] == parts
    assert cut[0][0, 1] == 0.0
    assert cut[-1][-1, 1] == len(lon) - 1
    for a, b in pairwise(cut):
        assert a[-1, 1] == b[0, 1]


# --- thinning ----------------------------------------------------------------------------------


def test_few_rows_are_all_kept():
    thinned = thin(made.random_trajectory(1, 20), 20)
    assert thinned.rows.tolist() == list(range(20))
    assert thinned.sentence == "All 20 points."


@pytest.mark.parametrize("n", [300, 20_000])
def test_what_was_left_out_lies_within_what_is_said(n):
    track = made.weaving(np.linspace(0.0, 200.0, n))
    previous = np.inf
    for most in (20, 80, 280):
        thinned = thin(track, most)
        rows = thinned.rows
        assert len(rows) == most
        assert (rows[0], rows[-1]) == (0, n - 1)
        r = ecef_from_geodetic(track[["lat", "lon", "alt"]].to_numpy())
        t = track.index.to_numpy()
        line = np.column_stack([np.interp(t, t[rows], c[rows]) for c in r.T])
        # Found by the same differences of 6.4e6 m.
        worst = np.linalg.norm(r - line, axis=1).max()
        assert worst == pytest.approx(thinned.deviation_m, abs=5e-9)
        # Halving leaves pieces up to twice as long as they could be, and the sag of a chord goes
        # with the square of its length: four times what even pieces have, and no more.
        even = np.linspace(0, n - 1, most).round().astype(int)
        rough = np.column_stack([np.interp(t, t[even], c[even]) for c in r.T])
        assert worst < 4.0 * np.linalg.norm(r - rough, axis=1).max()
        assert worst < previous
        previous = worst


def test_a_straight_drive_needs_two_points_and_a_stop_is_kept():
    lon = np.r_[np.linspace(0, 0.01, 500), np.full(500, 0.01), np.linspace(0.01, 0.02, 500)]
    track = table(np.column_stack([0 * lon, lon, 0 * lon]))
    thinned = thin(track, 10)
    # Four corners in time; a kilometre of the Earth lies 2 cm below its chord.
    assert {0, 499, 1499} <= set(thinned.rows.tolist())
    assert thinned.deviation_m < 0.02


def test_a_long_track_is_thinned_in_good_time_and_says_so(tmp_path):
    track = made.weaving(np.arange(100_000) * 0.01)
    document = kml(write("kml", tmp_path / "a.kml", track, most_points=1000))
    assert (
        "1000 of 100000 points; those left out lie within"
        in document.find(f"{KML}description").text
    )
    assert len(line_of(next(document.iter(f"{KML}coordinates")))) == 1000


# --- errors ------------------------------------------------------------------------------------


def test_differences_are_written_with_their_sign(tmp_path):
    est = made.random_trajectory(1, 5)
    ref = made.perturbed(est, [0, 0, 1.0], 0.0, 0.0)
    write_error_csv(tmp_path / "a.csv", trajectory_differences(est, ref), name="run 1")
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines[:2] == ["# trajectory error: run 1", "# sign: estimate minus reference"]
    assert lines[3] == (
        "time_s,north_m,east_m,down_m,VN_m_s,VE_m_s,VD_m_s,roll_deg,pitch_deg,heading_deg,"
        "phi_N_deg,phi_E_deg,phi_D_deg"
    )
    assert float(lines[4].split(",")[3]) == pytest.approx(1.0, abs=5e-9)


@pytest.mark.parametrize(
    ("options", "quantity"),
    [
        ({"ellipsoid": "wgs84"}, "ellipsoid"),
        ({"epoch": "2026-03-01"}, "epoch"),
        ({"most_points": "many"}, "most_points"),
        ({"tum_frame": None}, "tum_frame"),
    ],
)
def test_options_of_a_wrong_kind_are_refused(options, quantity):
    with pytest.raises(ConfigError) as caught:
        FileOptions(**options)
    assert caught.value.finding.quantity == quantity


def level(count=3):
    place = np.column_stack([np.full(count, 10.0), 20.0 + 1e-5 * np.arange(count), np.zeros(count)])
    return trajectory_table(
        np.arange(float(count)), place, np.zeros((count, 3)), np.zeros((count, 3))
    )


@pytest.mark.parametrize("form", sorted(TRAJECTORY_FORMATS))
def test_the_ending_says_the_form(form, tmp_path):
    WRITERS[form].write(tmp_path / "by_name", {"reference": level()}, FileOptions(name="drive"))
    write_trajectory(str(tmp_path / f"drive.{form.upper()}"), level())
    written = (tmp_path / f"drive.{form.upper()}").read_bytes()
    assert written == (tmp_path / "by_name").read_bytes()


@pytest.mark.parametrize("name", ["drive.kmz", "drive", "none/drive.kml"])
def test_a_file_that_cannot_be_is_refused(name, tmp_path):
    with pytest.raises(ConfigError, match="drive"):
        write_trajectory(tmp_path / name, level())
    assert list(tmp_path.iterdir()) == []


def test_a_table_that_is_refused_leaves_the_old_file(tmp_path):
    write_trajectory(tmp_path / "drive.kml", level())
    before = (tmp_path / "drive.kml").read_bytes()
    with pytest.raises(DataError):
        write_trajectory(tmp_path / "drive.kml", level().iloc[:0])
    assert [p.name for p in tmp_path.iterdir()] == ["drive.kml"]
    assert (tmp_path / "drive.kml").read_bytes() == before
