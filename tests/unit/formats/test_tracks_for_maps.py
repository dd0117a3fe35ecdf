"""Trajectories for programs of others: GPX 1.1 and GeoParquet 1.1."""

from __future__ import annotations

import json
import struct
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "contracts"))

from test_writers import streams
from tests.coded import coded

from strapdown.ellipsoids import ELLIPSOIDS
from strapdown.errors import ConfigError, DataError
from strapdown.formats.gnss_files import read_gnss
from strapdown.formats.table_files import EPSG_4979
from strapdown.formats.trajectory_readers import read_trajectory
from strapdown.formats.writers import WRITERS, write_trajectory
from strapdown.formats.writing import FileOptions
from strapdown.report.content import compare_files
from strapdown.tables import TRAJECTORY

GPX = "{http://www.topografix.com/GPX/1/1}"
#: Elements of a point in the order of the schema (https://www.topografix.com/GPX/1/1/gpx.xsd).
ORDER = ["ele", "time", "geoidheight", "fix", "extensions"]


@pytest.fixture(scope="module")
def track():
    return streams()["reference"]


# --- GPX --------------------------------------------------------------------------------


@pytest.mark.parametrize("geoid", [None, 46.5])
def test_gpx_says_over_what_its_heights_are(tmp_path, track, geoid):
    options = FileOptions(geoid_undulation=geoid)
    write_trajectory(tmp_path / "a.gpx", track, options=options)
    root = ET.parse(tmp_path / "a.gpx").getroot()
    assert root.tag == f"{GPX}gpx" and root.get("version") == "1.1"
    said = root.find(f"{GPX}metadata/{GPX}desc").text
    assert ("not over mean sea level" in said) == (geoid is None)
    assert ("46.5 m" in said) == (geoid is not None)
    points = list(root.iter(f"{GPX}trkpt"))
    over = np.array([float(p.find(f"{GPX}ele").text) for p in points])
    assert over == pytest.approx(track["alt"].to_numpy() - (geoid or 0.0), abs=1e-9)
    for point in points:
        names = [e.tag.removeprefix(GPX) for e in point]
        assert names == [n for n in ORDER if n in names]


def test_gpx_without_utc_has_no_times(tmp_path):
    made = streams("relative")["reference"]
    findings = WRITERS["gpx"].write(tmp_path / "a.gpx", {"reference": made})
    assert "io.written-without-dates" in {f.code for f in findings}
    assert "<time>" not in (tmp_path / "a.gpx").read_text()
    # Which is neither fixes nor a trajectory, and each refusal says so.
    with pytest.raises(DataError, check=coded("io.track-without-time")):
        read_gnss(tmp_path / "a.gpx")
    with pytest.raises(DataError, check=coded("io.no-stream")) as refused:
        read_trajectory(tmp_path / "a.gpx")
    assert refused.value.finding.data["way"].code == "io.way-of-gnss-as-reference"


def test_small_numbers_of_gpx_are_decimals(tmp_path, track):
    # XML Schema has no exponent in a decimal.
    made = track.copy()
    made["lon"] = np.linspace(-1e-7, 1e-7, len(made))
    made.attrs = dict(track.attrs)
    write_trajectory(tmp_path / "a.gpx", made)
    points = list(ET.parse(tmp_path / "a.gpx").iter(f"{GPX}trkpt"))
    texts = [p.get("lon") for p in points]
    assert not any("e" in text for text in texts)
    assert [float(text) for text in texts] == made["lon"].tolist()


# --- GeoParquet ---------------------------------------------------------------------------


def test_geoparquet_has_every_row_as_a_point(tmp_path, track):
    write_trajectory(tmp_path / "a.geoparquet", track)
    table = pq.read_table(tmp_path / "a.geoparquet")
    column = table.column("geometry")
    # A BYTE_ARRAY in Parquet, neither repeated nor nested.
    file = pq.ParquetFile(tmp_path / "a.geoparquet")
    stored = file.schema.column(table.column_names.index("geometry"))
    assert (stored.physical_type, stored.max_repetition_level) == ("BYTE_ARRAY", 0)
    points = [struct.unpack("<BI3d", value) for value in column.to_pylist()]
    # Low byte first; 1001 is a point with height in ISO WKB.
    assert {p[:2] for p in points} == {(1, 1001)}
    np.testing.assert_array_equal([p[2:] for p in points], track[["lon", "lat", "alt"]])
    assert {"lat_deg", "alt_m", "VN_m_s", "heading_deg"} <= set(table.column_names)


def test_the_metadata_of_geoparquet_are_those_of_its_specification(tmp_path, track):
    write_trajectory(tmp_path / "a.geoparquet", track)
    geo = json.loads(pq.read_schema(tmp_path / "a.geoparquet").metadata[b"geo"])
    assert set(geo) == {"version", "primary_column", "columns"}
    assert geo["version"] == "1.1.0"
    assert list(geo["columns"]) == [geo["primary_column"]] == ["geometry"]
    column = geo["columns"]["geometry"]
    assert set(column) == {"encoding", "geometry_types", "crs", "bbox"}
    assert column["encoding"] == "WKB" and column["geometry_types"] == ["Point Z"]
    assert column["crs"] == EPSG_4979
    assert column["crs"]["id"] == {"authority": "EPSG", "code": 4979}
    places = track[["lon", "lat", "alt"]]
    assert column["bbox"] == [*places.min(), *places.max()]


def test_geoparquet_comes_back(tmp_path, track):
    write_trajectory(tmp_path / "a.geoparquet", track)
    back = read_trajectory(tmp_path / "a.geoparquet")
    np.testing.assert_array_equal(back[TRAJECTORY], track[TRAJECTORY])


def test_geoparquet_across_the_date_line_has_no_box(tmp_path, track):
    made = track.copy()
    made["lon"] = np.linspace(179.9, 180.1, len(made))
    made.attrs = dict(track.attrs)
    write_trajectory(tmp_path / "a.geoparquet", made)
    table = pq.read_table(tmp_path / "a.geoparquet")
    column = json.loads(table.schema.metadata[b"geo"])["columns"]["geometry"]
    assert "bbox" not in column
    lon = [struct.unpack("<BI3d", value)[2] for value in table.column("geometry").to_pylist()]
    assert max(lon) <= 180.0 and min(lon) >= -180.0


def test_another_ellipsoid_is_refused(tmp_path, track):
    options = FileOptions(ellipsoid=next(e for n, e in ELLIPSOIDS.items() if n != "wgs84"))
    with pytest.raises(ConfigError) as caught:
        write_trajectory(tmp_path / "a.geoparquet", track, options=options)
    assert caught.value.finding.quantity == "ellipsoid"
    assert not (tmp_path / "a.geoparquet").exists()


def test_a_forged_point_is_seen_where_versions_differ(tmp_path, track):
    write_trajectory(tmp_path / "a.geoparquet", track)
    table = pq.read_table(tmp_path / "a.geoparquet")
    k = table.column_names.index("geometry")
    values = table.column(k).to_pylist()
    values[3] = values[4]
    forged = table.set_column(k, "geometry", pa.array(values, pa.binary()))
    pq.write_table(table, tmp_path / "same.geoparquet")
    pq.write_table(forged, tmp_path / "forged.geoparquet")
    first = tmp_path / "a.geoparquet"
    assert compare_files(first, tmp_path / "same.geoparquet", drawn_alike=False).within == 0.0
    other = compare_files(first, tmp_path / "forged.geoparquet", drawn_alike=False)
    assert other.within == np.inf or other.within > 1e-6
