"""Trajectories come back as they were, and what cannot be used says why."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

from strapdown.ellipsoids import ELLIPSOIDS
from strapdown.errors import ConfigError, DataError
from strapdown.formats.trajectory_readers import read_trajectory
from strapdown.formats.writers import WRITERS, FileOptions
from strapdown.tables import TRAJECTORY

_spec = importlib.util.spec_from_file_location(
    "made_trajectories", Path(__file__).parents[1] / "evaluation" / "made_trajectories.py"
)
made = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(made)

HEAD = "time,lat,lon,alt,VN,VE,VD,roll,pitch,heading"
ROWS = ["0,48,11,500,0,0,0,0,0,90", "1,48,11,500,0,0,0,0,0,90", "2,48,11,500,0,0,0,0,0,90"]


def driven(n=200):
    """A drive to the north-east at 48 N 11 E that is its own integral on a sphere."""
    t = np.arange(n) * 0.5
    vn, ve = 12.0 + 4.0 * np.sin(0.1 * t), 6.0 + 5.0 * np.cos(0.07 * t)
    radius = 6.371e6
    lat = 48.0 + np.degrees((12.0 * t - 40.0 * (np.cos(0.1 * t) - 1.0)) / radius)
    east = 6.0 * t + 5.0 / 0.07 * np.sin(0.07 * t)
    lon = 11.0 + np.degrees(east / radius / np.cos(np.radians(48.05)))
    heading = np.degrees(np.arctan2(ve, vn))
    zero = np.zeros(n)
    return np.column_stack([t, lat, lon, zero, vn, ve, zero, zero, zero, heading])


def save(path, rows, head=HEAD, comments=()):
    lines = [row if isinstance(row, str) else ",".join(map(repr, row.tolist())) for row in rows]
    path.write_text("\n".join([*comments, head, *lines]) + "\n")
    return path


def test_our_own_files_come_back_to_the_bit(tmp_path):
    track = made.weaving(np.arange(0.0, 20.0, 0.1))
    path = tmp_path / "track.csv"
    options = FileOptions(ellipsoid=ELLIPSOIDS["pz90.11"])
    WRITERS["csv"].write(path, {"reference": track}, options)
    back = read_trajectory(path)
    assert np.array_equal(back.to_numpy(), track.to_numpy())
    assert np.array_equal(back.index, track.index)
    assert list(back.columns) == TRAJECTORY
    assert back.attrs == {
        "source": "track.csv",
        "ellipsoid": "pz90.11",
        "findings": (),
        "clock": "relative",
        "clock_origin": 0.0,
        "gps_week": None,
    }


def test_random_numbers_come_back_to_the_bit(tmp_path):
    # No vehicle moves like that, and a finding says so.
    track = made.random_trajectory(2)
    WRITERS["csv"].write(tmp_path / "a.csv", {"reference": track})
    back = read_trajectory(tmp_path / "a.csv")
    assert np.array_equal(back.to_numpy(), track.to_numpy())
    (finding,) = back.attrs["findings"]
    assert "positions and the integral of velocity disagree" in finding.what


@pytest.mark.parametrize(
    ("head", "factors"),
    [
        (
            "Time (ms);Latitude [deg];Longitude [deg];Height (m);vel_north [m/s];vel_east [m/s];"
            "vel_up [m/s];Roll (rad);Pitch (rad);Yaw (rad)",
            [1e3, 1, 1, 1, 1, 1, -1, *[np.pi / 180] * 3],
        ),
        (
            "timestamp_ns;lat_rad;lng_rad;altitude_km;v_n_km_h;v_e_km_h;v_d_km_h;phi;theta;psi",
            [1e9, *[np.pi / 180] * 2, 1e-3, 3.6, 3.6, 3.6, 1, 1, 1],
        ),
        (
            "secs;LAT;LON;ALT;velocityNorth (kn);velocityEast (knots);velocityDown (mm/s);"
            "roll_deg;pitch_deg;heading_deg",
            [1, 1, 1, 1, 3600 / 1852, 3600 / 1852, 1000, 1, 1, 1],
        ),
    ],
)
def test_names_and_units_as_others_write_them(tmp_path, head, factors):
    rows = driven()
    rows[:, 3], rows[:, 6] = 512.0, 0.25
    path = save(tmp_path / "a.csv", rows * factors, head.replace(";", ","))
    back = read_trajectory(path)
    # A product and its inverse.
    assert (
        np.abs(back.to_numpy() / np.where(rows[:, 1:], rows[:, 1:], 1.0) - (rows[:, 1:] != 0)).max()
        < 1e-14
    )
    assert np.abs(back.index - rows[:, 0]).max() < 1e-13


def test_columns_that_are_called_otherwise(tmp_path):
    head = HEAD.replace("lat", "breite").replace("alt", "alt,height")
    rows = [r.replace("500,", "500,600,", 1) for r in ROWS]
    path = save(tmp_path / "a.csv", rows, head)
    with pytest.raises(
        DataError,
        match=r"a\.csv, alt",
        check=lambda refused: refused.finding.code == "io.column-names-ambiguous",
    ):
        read_trajectory(path, {"lat": "breite"})
    back = read_trajectory(path, {"lat": "breite", "alt": "height"})
    assert back["alt"].tolist() == [600.0] * 3
    with pytest.raises(ConfigError, check=coded("io.no-column-3")):
        read_trajectory(path, {"lat": "breit"})
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.unknown-quantity-of-table"
    ):
        read_trajectory(path, {"latt": "breite"})


def test_dates_are_stamps(tmp_path):
    rows = [r.replace(str(k), f"2026-03-01T12:00:0{k}.5Z", 1) for k, r in enumerate(ROWS)]
    back = read_trajectory(save(tmp_path / "a.csv", rows))
    # 1772366400 s carry 2.4e-7.
    assert back.index[0] == pytest.approx(1772366400.5, abs=3e-7)
    assert np.diff(back.index) == pytest.approx([1.0, 1.0], abs=5e-7)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda r: (HEAD.replace(",VD", ",down"), r), "missing columns"),
        (lambda r: (HEAD, [r[0], r[1].replace("500", "nan"), r[2]]), r"row 4, alt: not a finite"),
        (lambda r: (HEAD, [r[0], r[1].replace("500", ""), r[2]]), r"row 4, alt: not a finite"),
        (lambda r: (HEAD, [r[0], r[1].replace("500", "high"), r[2]]), r"row 4, alt: 'high' is not"),
        (lambda r: (HEAD, [r[0], r[2], r[1]]), "row 5, time: .*time does not increase"),
        (lambda r: (HEAD, [r[0], r[1].replace("48", "98"), r[2]]), r"row 4, lat: .* beyond the"),
        (
            lambda r: (HEAD.replace("alt", "alt_kn"), r),
            r"alt: .*' is not a unit of this quantity \(column '",
        ),
        (
            lambda r: (HEAD.replace("lat", "lat [gon]"), r),
            r"lat: .*' is not a unit of this quantity \(column '",
        ),
        (lambda r: (HEAD, r[:0]), "the file has a header and no data"),
        (lambda r: (HEAD, [r[0], r[1] + ",7", r[2]]), r"row 4: 11 fields"),
    ],
)
def test_what_cannot_be_used(tmp_path, change, message):
    head, rows = change(ROWS)
    with pytest.raises(DataError, match=message) as error:
        # The comment is a row of the file, too.
        read_trajectory(save(tmp_path / "a.csv", rows, head, ["# from somewhere"]))
    assert str(error.value).startswith("a.csv")
    assert "Remedy" in str(error.value)


def test_files_that_are_none(tmp_path):
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.no-such-file"
    ):
        read_trajectory(tmp_path / "none.csv")
    (tmp_path / "a.csv").write_text("")
    with pytest.raises(DataError, check=coded("io.file-empty")):
        read_trajectory(tmp_path / "a.csv")
    (tmp_path / "a.kml").write_text("<kml/>")
    with pytest.raises(
        DataError,
        check=lambda refused: refused.finding.code == "io.ending-no-known-format",
    ):
        read_trajectory(tmp_path / "a.kml")


def test_a_drive_is_believed(tmp_path):
    back = read_trajectory(save(tmp_path / "a.csv", driven()))
    assert back.attrs["findings"] == ()
    assert back.attrs["ellipsoid"] is None


def test_radians_are_told_from_degrees(tmp_path):
    rows = driven()
    rows[:, 1:3] = np.radians(rows[:, 1:3])
    with pytest.raises(DataError, check=coded("io.lat-lon-in-radians")):
        read_trajectory(save(tmp_path / "a.csv", rows))
    head = HEAD.replace("lat", "lat_rad").replace("lon", "lon_rad")
    back = read_trajectory(save(tmp_path / "b.csv", rows, head))
    assert np.abs(back["lat"] - driven()[:, 1]).max() < 1e-13


def test_degrees_near_the_origin_are_not_taken_for_radians(tmp_path):
    rows = driven()
    rows[:, 1] -= 47.0
    rows[:, 2] = 1.0 + (rows[:, 2] - 11.0) * np.cos(np.radians(48.05))
    assert read_trajectory(save(tmp_path / "a.csv", rows)).attrs["findings"] == ()


def test_exchanged_latitude_and_longitude(tmp_path):
    rows = driven()
    rows[:, [1, 2]] = rows[:, [2, 1]]
    with pytest.raises(DataError, check=coded("io.lat-lon-exchanged")):
        read_trajectory(save(tmp_path / "a.csv", rows))
    rows = driven()
    rows[:, 2] += 100.0
    rows[:, [1, 2]] = rows[:, [2, 1]]
    with pytest.raises(
        DataError, check=coded("tables.latitude-beyond-pole", row=2, quantity="lat")
    ):
        read_trajectory(save(tmp_path / "b.csv", rows))


def test_an_attitude_in_radians(tmp_path):
    rows = driven()
    rows[:, 7:] = np.radians(rows[:, 7:])
    with pytest.raises(
        DataError,
        match=r"heading is \d+° from the course",
        check=lambda refused: refused.finding.code == "io.heading-in-radians",
    ):
        read_trajectory(save(tmp_path / "a.csv", rows))
    head = HEAD.replace("roll", "roll_rad").replace("pitch", "pitch_rad")
    back = read_trajectory(save(tmp_path / "b.csv", rows, head.replace("heading", "heading (rad)")))
    assert np.abs(back["heading"] - driven()[:, 9]).max() < 1e-13


def test_what_stands_still_tells_nothing(tmp_path):
    assert read_trajectory(save(tmp_path / "a.csv", ROWS)).attrs["findings"] == ()
    one = read_trajectory(save(tmp_path / "b.csv", ROWS[:1]))
    assert len(one) == 1


def test_a_recorded_drive_is_believed_and_its_mistakes_are_seen(tmp_path, recordings):
    # A car with an RTK receiver; it has no attitude, so that the course stands for the heading.
    import pandas as pd

    log = pd.read_csv(recordings("car_rtk/part1_gnss_rtk.csv"))
    log.columns = [c.removeprefix("# ") for c in log.columns]
    log["roll"], log["pitch"] = 0.0, 0.0
    log["heading"] = np.degrees(np.arctan2(log["vE"], log["vN"])) % 360.0

    def read(table):
        table.to_csv(tmp_path / "a.csv", index=False)
        return read_trajectory(tmp_path / "a.csv", {"time": "gps_sow_s"})

    back = read(log)
    assert back.attrs["findings"] == ()
    assert np.array_equal(back["alt"], log["h_ell_m"])
    plain = log.rename(columns={"lat_deg": "lat", "lon_deg": "lon"})
    with pytest.raises(DataError, check=coded("io.lat-lon-in-radians")):
        read(plain.assign(lat=np.radians(plain["lat"]), lon=np.radians(plain["lon"])))
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.heading-in-radians"
    ):
        read(log.assign(heading=np.radians(log["heading"])))
    with pytest.raises(
        DataError, check=coded("tables.latitude-beyond-pole", row=2, quantity="lat")
    ):
        read(log.rename(columns={"lat_deg": "lon_deg", "lon_deg": "lat_deg"}))
