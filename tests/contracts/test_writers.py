"""Every entry of the table of writers: its reader recognizes the content, and reads it back."""

from __future__ import annotations

import json
import re
import shutil
from datetime import UTC, datetime

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

from strapdown import rotation
from strapdown.errors import ConfigError, DataError
from strapdown.formats import READERS, STREAMS, read_log, readers_of
from strapdown.formats.clocks import GPS, RELATIVE, UNIX, Clock, clock_of, own_ns, with_clock
from strapdown.formats.gnss_files import read_gnss
from strapdown.formats.gnss_fixes import GnssOptions
from strapdown.formats.recording import ReadOptions
from strapdown.formats.trajectory_readers import read_trajectory
from strapdown.formats.writers import WRITERS, FileOptions, find_writer, write_streams
from strapdown.frames import ecef_from_geodetic, place_difference
from strapdown.tables import (
    ACCEL,
    EULER,
    GYRO,
    QUATERNION,
    attitude_table,
    gnss_table,
    heading_table,
    imu_table,
    trajectory_table,
)
from strapdown.tables.checks import (
    GEODETIC,
    MAG,
    POSITION_SD,
    VELOCITY,
    VELOCITY_SD,
)

# 2026-02-03 11:22:33.123456789 UTC; GPS week 2404, 18 leap seconds.
FIRST_NS = 1_770_117_753_123_456_789
WEEK_NS = 604_800_000_000_000
GPS_NS = FIRST_NS - 315_964_800_000_000_000 + 18_000_000_000
EPOCH = datetime(2026, 2, 3, 11, 0, tzinfo=UTC)
CLOCKS = {
    "unix": Clock(UNIX, FIRST_NS * 1e-9),
    "gps": Clock(GPS, 0.0, GPS_NS // WEEK_NS),
    "relative": Clock(RELATIVE),
}
ROWS = 400


def on(table: pd.DataFrame, clock: str) -> pd.DataFrame:
    """Put a table that begins at zero on a clock: of 1970, of the GPS week, or of its own."""
    if clock == "gps":
        first = GPS_NS % WEEK_NS / 1e9
        table = table.set_axis(pd.Index(first + table.index.to_numpy(), name="time"))
    with_clock(table, CLOCKS[clock])
    if clock == "unix":
        table.attrs["clock_origin_stamp"] = (FIRST_NS, "ns")
    return table


def streams(clock: str = "unix", sampling: str = "instantaneous") -> dict[str, pd.DataFrame]:
    """Make a slow turn to the right through a hill: gravity, and signs of every axis."""
    rng = np.random.default_rng(20)
    time = np.arange(ROWS) * 0.01 + 1e-6 * rng.integers(0, 900, ROWS)
    time[0] = 0.0
    heading = 350.0 + 8.0 * time
    euler = np.column_stack([3.0 + time, -2.0 + 0.5 * time, (heading + 180.0) % 360.0 - 180.0])
    speed = 5.0
    velocity = speed * np.column_stack(
        [np.cos(np.radians(heading)), np.sin(np.radians(heading)), np.full(ROWS, -0.02)]
    )
    north, east = (np.cumsum(v) * 0.01 for v in velocity.T[:2])
    place = np.column_stack(
        [48.1 + north / 111_200.0, 11.5 + east / 74_500.0, 520.0 - velocity[:, 2] * time]
    )
    q_nb = rotation.quaternion_from_euler(euler)
    force = rotation.rotate(rotation.conjugate(q_nb), np.tile([0.0, 0.0, -9.81], (ROWS, 1)))
    force += rng.normal(0.0, 0.02, (ROWS, 3))
    gyro = np.radians([1.0, 0.5, 8.0]) + rng.normal(0.0, 1e-3, (ROWS, 3))
    field = rotation.rotate(rotation.conjugate(q_nb), np.tile([21.0, 1.5, 43.0], (ROWS, 1)))
    imu = imu_table(time, gyro, force, sampling=sampling, source="made")
    fixes = slice(0, None, 20)
    at = time[fixes]
    sd = rng.uniform(0.5, 2.0, (at.size, 6))
    quality = np.resize([1.0, 2.0], at.size)
    gnss = gnss_table(
        at, place[fixes], velocity[fixes], sd[:, :3], sd[:, 3:], quality, source="made"
    )
    reference = trajectory_table(time, place, velocity, euler, source="made")
    mag = pd.DataFrame(field, columns=MAG, index=pd.Index(time, name="time"))
    pressure = {"pressure": 95_000.0 + rng.normal(0.0, 3.0, at.size)}
    barometer = pd.DataFrame(pressure, index=pd.Index(at, name="time"))
    wheel = pd.DataFrame({"speed": np.full(at.size, speed)}, index=pd.Index(at, name="time"))
    made = {"imu": imu, "gnss": gnss, "reference": reference}
    made |= {"magnetometer": mag, "barometer": barometer, "wheel": wheel}
    made["heading"] = heading_table(at, (heading[fixes] + 90.0) % 360.0, 0.25)
    return {name: on(table, clock) for name, table in made.items()}


def path_of(folder, name: str):
    return folder / f"out{next(iter(WRITERS[name].endings), '')}"


def held(name: str, made: dict[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
    return {s: t for s, t in made.items() if s in WRITERS[name].streams}


READ = [name for name, writer in WRITERS.items() if writer.reader]


@pytest.mark.parametrize("name", READ)
def test_its_reader_recognizes_the_content_of_each_stream_alone_and_of_all(tmp_path, name):
    writer, made = WRITERS[name], streams()
    sets = [[s] for s in writer.streams] if name != "kitti" else [["reference"]]
    if name == "kf-gins":
        sets = [["imu"], ["imu", "gnss"]]  # KF-GINS cannot run without increments
    for wanted in [*sets, list(writer.streams)]:
        path = path_of(tmp_path, name)
        writer.write(path, {s: made[s] for s in wanted})
        # A name that says nothing: the content alone decides, or the ending that all text has.
        other = tmp_path / f"some{'' if path.is_dir() else path.suffix}"
        path.rename(other)
        found = next(readers_of(other), ("", None))[0]
        assert found in (writer.reader, "kf-gins" if name == "kf-gins" else writer.reader), wanted
        shutil.rmtree(other) if other.is_dir() else other.unlink()


@pytest.mark.parametrize("name", WRITERS)
def test_streams_that_it_does_not_hold_are_named(tmp_path, name):
    made = streams()
    findings = WRITERS[name].write(path_of(tmp_path, name), made)
    codes = ("io.stream-of-own-file",) if WRITERS[name].alone else ("io.stream-not-written",)
    left = {f.quantity for f in findings if f.code in codes}
    written = {f.quantity for f in findings if f.code == "io.stream-written"}
    assert written == set(made) - left
    lost = set(made) - set(WRITERS[name].streams)
    if WRITERS[name].alone:
        lost = set(made) - {"imu"}
    lost |= {"gpx": {"reference"}, "nmea": {"reference"}, "kitti": {"gnss"}}.get(name, set())
    assert left == lost
    assert set(WRITERS[name].streams) <= set(STREAMS)


@pytest.mark.parametrize("name", WRITERS)
def test_the_same_streams_give_the_same_bytes_and_stay_as_they_were(tmp_path, name):
    made = streams()
    before = {s: t.copy(deep=True) for s, t in made.items()}
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        WRITERS[name].write(path_of(tmp_path / folder, name), made)
    files = [p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*") if p.is_file()]
    assert files
    for file in files:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()
    for stream, table in made.items():
        pd.testing.assert_frame_equal(table, before[stream], check_exact=True)
        assert table.attrs == before[stream].attrs


# Samples.

#: How each format is read again: what it cannot state, the user does.
SAID = {"mcap": {"axes": "x,-y,-z"}, "kitti": {}}


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize("name", [n for n in READ if "imu" in WRITERS[n].streams])
def test_samples_come_back(tmp_path, name, clock):
    made = held(name, streams(clock, sampling="mean" if name == "kf-gins" else "instantaneous"))
    imu = made["imu"]
    path = path_of(tmp_path, name)
    if name == "kitti" and clock == "relative":
        with pytest.raises(DataError, check=coded("io.written-needs-date")):
            WRITERS[name].write(path, made)
        return
    findings = {f.code for f in WRITERS[name].write(path, made)}
    back = read_log(path, ReadOptions(**SAID.get(name, {})))
    # Increments: a product with the interval and a division by it, each rounded once.
    exact = 4.0 * np.finfo(float).eps if name == "kf-gins" else 0.0
    for triad in (GYRO, ACCEL):
        ours, theirs = imu[triad].to_numpy(), back.imu[triad].to_numpy()
        if name == "kf-gins":
            # The first interval is the usual one; others are differences of stamps, rounded to ns.
            step = np.diff(imu.index).min()
            exact = 1e-9 / step
        assert np.abs(theirs - ours).max() <= exact * np.abs(ours).max()
    assert (back.imu[ACCEL[2]] < -9.0).all()
    expected = {
        "unix": own_ns(imu),
        "gps": own_ns(imu),
        "relative": own_ns(imu),
    }[clock]
    if clock == "gps" and name in ("mcap", "euroc", "kitti"):
        expected = expected - GPS_NS % WEEK_NS + FIRST_NS
        assert "io.written-gps-as-utc" in findings
    if clock == "unix" and name == "kf-gins":
        expected = expected - FIRST_NS + GPS_NS % WEEK_NS
        assert "io.written-utc-as-gps" in findings
    if clock == "relative" and name in ("mcap", "euroc", "kf-gins"):
        assert "io.written-on-own-clock" in findings
    # Seconds of the week have 2^-34 s as doubles of 200 000 s: 0.03 ns.
    assert np.abs(own_ns(back.imu) - expected).max() <= (1 if clock == "gps" else 0)


@pytest.mark.parametrize("name", ["mcap", "euroc", "kitti"])
def test_means_are_said_where_a_format_cannot(tmp_path, name):
    made = streams(sampling="mean")
    for sampling, said in (("mean", True), ("instantaneous", False)):
        made["imu"].attrs["sampling"] = sampling
        found = WRITERS[name].write(tmp_path / f"{sampling}{path_of(tmp_path, name).suffix}", made)
        assert any(f.code == "io.written-means" for f in found) == said


@pytest.mark.parametrize("name", ["csv", "parquet", "npz", "h5", "mat"])
def test_a_table_states_sampling_axes_field_and_attitude(tmp_path, name):
    imu = streams(sampling="mean")["imu"]
    imu[MAG] = streams()["magnetometer"][MAG]
    truth = attitude_table(
        imu.index, rotation.quaternion_from_euler(streams()["reference"][EULER].to_numpy())
    )
    path = path_of(tmp_path, name)
    found = WRITERS[name].write(path, {"imu": imu, "reference": truth})
    assert [f.code for f in found] == ["io.stream-written"] * 2
    back = read_log(path)
    assert [f.code for f in back.findings] == ["io.time-from-first-stamp"]
    assert np.array_equal(back.imu.to_numpy(), imu.to_numpy())
    assert back.imu.attrs["sampling"] == "mean"
    assert np.array_equal(back.truth[QUATERNION], truth[QUATERNION])
    assert (clock_of(back.imu).name, own_ns(back.imu)[0]) == (UNIX, FIRST_NS)


def test_instantaneous_samples_become_increments_of_the_line_between_two(tmp_path):
    imu = streams()["imu"]
    findings = WRITERS["kf-gins"].write(tmp_path / "out", {"imu": imu})
    assert "io.written-increments-of-line" in {f.code for f in findings}
    rows = np.loadtxt(tmp_path / "out" / "imu.txt")
    assert len(rows) == ROWS - 1
    values, step = imu[[*GYRO, *ACCEL]].to_numpy(), np.diff(imu.index)[:, None]
    assert rows[:, 1:] == pytest.approx(0.5 * (values[1:] + values[:-1]) * step, rel=1e-12)
    # A level body at rest falls by -g each second: down is positive.
    assert rows[:, 6].sum() / np.ptp(imu.index) == pytest.approx(-9.8, abs=0.1)


# Fixes.


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize("name", [n for n in READ if "gnss" in WRITERS[n].streams])
def test_fixes_come_back(tmp_path, name, clock):
    made = streams(clock)
    gnss = made["gnss"]
    path = path_of(tmp_path, name)
    tables = {"gnss": gnss} | ({"imu": made["imu"]} if name == "kf-gins" else {})
    if clock == "relative" and name == "nmea":
        with pytest.raises(DataError, check=coded("io.written-needs-date")):
            WRITERS[name].write(path, tables)
        return
    if clock == "relative" and name == "gpx":
        said = {f.code for f in WRITERS[name].write(path, tables)}
        assert "io.written-without-dates" in said
        with pytest.raises(DataError, check=coded("io.track-without-time")):
            read_gnss(path, GnssOptions())
        return
    WRITERS[name].write(path, tables)
    back = read_gnss(path, GnssOptions(unstated_position_sd=np.inf, unstated_velocity_sd=np.inf))
    assert len(back) == len(gnss)
    apart = np.abs(place_difference(back[GEODETIC].to_numpy(), gnss[GEODETIC].to_numpy()))
    # NMEA: half a unit of the seventh decimal of a minute, and of 0.1 mm.
    limits = [1.852e3 / 2e7, 1.852e3 / 2e7, 0.5e-4] if name == "nmea" else [0.0] * 3
    # Doubles of 1e2 deg and of Earth-centered metres, as the difference computes with them.
    assert (apart.max(axis=0) <= np.array(limits) + 2e-9).all()
    if name not in ("nmea", "gpx"):
        assert np.array_equal(back[GEODETIC], gnss[GEODETIC])
    columns = {"gpx": [], "nmea": [POSITION_SD]}.get(name, [POSITION_SD, VELOCITY_SD])
    for block in columns:
        ours = gnss[block].to_numpy()
        limit = 0.5e-6 if name == "nmea" else (2e-16 if name == "mcap" else 0.0)
        assert np.abs(back[block].to_numpy() - ours).max() <= limit * max(1.0, ours.max())
    plane = VELOCITY[:2] if name in ("gpx", "nmea") else VELOCITY
    # NMEA: half of 1e-5 knots, and 0.5e-5 deg of a course at 5 m/s.
    limit = {"nmea": 0.5e-5 * 0.5144 + 5.0 * np.radians(0.5e-5), "gpx": 1e-14}.get(name, 0.0)
    assert np.abs(back[plane].to_numpy() - gnss[plane].to_numpy()).max() <= limit
    if name != "kf-gins":
        assert np.array_equal(back["quality"], gnss["quality"])
    at = _unix(back)
    # Dates have microseconds; others are doubles of seconds, of 1970 or of the week.
    limit = {"gpx": 500, "nmea": 500}.get(name, 0) + (240 if clock != "relative" else 1)
    assert np.abs(at - _unix(gnss)).max() <= limit


def _unix(table: pd.DataFrame) -> np.ndarray:
    """Stamps in ns from the first, whatever the clock."""
    own = own_ns(table)
    name = clock_of(table).name
    if name == GPS and own[0] < GPS_NS % WEEK_NS:
        return own  # of seconds from zero, which the format takes for those of a week
    return own - {UNIX: FIRST_NS, GPS: GPS_NS % WEEK_NS, RELATIVE: 0}[name]


def test_fixes_without_velocity_or_accuracy_stay_without(tmp_path):
    gnss = streams()["gnss"]
    gnss[VELOCITY_SD] = np.inf
    gnss.loc[gnss.index[3], POSITION_SD] = np.inf
    for name in ("csv", "mcap", "nmea"):
        path = path_of(tmp_path, name)
        WRITERS[name].write(path, {"gnss": gnss})
        back = read_gnss(path, GnssOptions(unstated_velocity_sd=np.inf))
        assert np.isinf(back[VELOCITY_SD]).all().all()
        assert np.isinf(back[POSITION_SD].iloc[3]).all()
        assert np.isfinite(back[POSITION_SD].drop(back.index[3])).all().all()
    made = {"imu": streams()["imu"], "gnss": gnss}
    found = {f.code: f for f in WRITERS["kf-gins"].write(tmp_path / "kf", made)}
    assert found["io.written-fixes-without-sd"].data["count"] == 1
    assert np.loadtxt(tmp_path / "kf" / "gnss.txt").shape == (len(gnss) - 1, 7)


def test_velocities_of_unknown_accuracy_are_written_without_it(tmp_path):
    gnss = streams()["gnss"]
    gnss[VELOCITY_SD] = 1.0
    gnss.attrs["velocity_sd_taken"] = 1.0
    for name in ("csv", "mcap", "nmea"):
        path = path_of(tmp_path, name)
        WRITERS[name].write(path, {"gnss": gnss})
        back = read_gnss(path, GnssOptions(unstated_velocity_sd=7.0))
        plane = VELOCITY[:2] if name == "nmea" else VELOCITY
        assert back[plane].to_numpy() == pytest.approx(gnss[plane].to_numpy(), abs=1e-5)
        if name != "mcap":  # a covariance of zero is unknown there, and the reader takes it so
            assert (back[VELOCITY_SD[:2]] == 7.0).all().all()
    WRITERS["kf-gins"].write(tmp_path / "kf", {"imu": streams()["imu"], "gnss": gnss})
    assert np.loadtxt(tmp_path / "kf" / "gnss.txt").shape[1] == 7


@pytest.mark.parametrize("name", ["gpx", "nmea"])
def test_heights_over_the_sea(tmp_path, name):
    gnss = streams()["gnss"]
    for undulation in (None, 46.5):
        path = tmp_path / f"{undulation}.{name}"
        findings = WRITERS[name].write(
            path, {"gnss": gnss}, FileOptions(geoid_undulation=undulation)
        )
        warned = "io.written-height-over-ellipsoid" in {f.code for f in findings}
        assert warned == (undulation is None)
        first = re.search(r"<ele>([\d.]+)|,([\d.]+),M,", path.read_text())
        over_sea = float(first[1] or first[2])
        assert over_sea == pytest.approx(gnss["alt"].iloc[0] - (undulation or 0.0), abs=1e-4)
        back = read_gnss(path, GnssOptions(unstated_position_sd=1.0))
        assert back["alt"].to_numpy() == pytest.approx(gnss["alt"].to_numpy(), abs=1.1e-4)


def test_a_stated_epoch_makes_dates(tmp_path):
    gnss = streams("relative")["gnss"]
    options = FileOptions(epoch=EPOCH)
    found = WRITERS["nmea"].write(tmp_path / "a.nmea", {"gnss": gnss}, options)
    assert "io.written-by-epoch" in {f.code for f in found}
    back = read_gnss(tmp_path / "a.nmea", GnssOptions(unstated_velocity_sd=1.0))
    assert back.index[0] == EPOCH.timestamp()


@pytest.mark.parametrize(("lat", "lon"), [(-33.9999999999, -0.5), (0.0, 179.99999999999)])
def test_sentences_never_have_sixty_minutes(tmp_path, lat, lon):
    gnss = streams()["gnss"]
    gnss[["lat", "lon"]] = lat, lon
    gnss[VELOCITY] = 0.0
    WRITERS["nmea"].write(tmp_path / "a.nmea", {"gnss": gnss})
    assert ",3400.0000000,S," in (tmp_path / "a.nmea").read_text() or lat == 0.0
    back = read_gnss(tmp_path / "a.nmea", GnssOptions(unstated_velocity_sd=1.0))
    assert back["lat"].to_numpy() == pytest.approx(lat, abs=1e-9)
    assert back["lon"].to_numpy() == pytest.approx(lon, abs=1e-9)


# Trajectories.


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize("name", ["csv", "parquet", "kitti", "kf-gins", "tum", "nav"])
def test_a_trajectory_comes_back(tmp_path, name, clock):
    made = streams(clock)
    track = made["reference"]
    path = path_of(tmp_path, name)
    tables = {"reference": track} | ({"imu": made["imu"]} if name == "kf-gins" else {})
    if name == "kitti" and clock == "relative":
        with pytest.raises(DataError, check=coded("io.written-needs-date")):
            WRITERS[name].write(path, tables)
        return
    WRITERS[name].write(path, tables)
    back = read_trajectory(path)
    apart = np.abs(place_difference(back[GEODETIC].to_numpy(), track[GEODETIC].to_numpy())).max()
    turned = rotation.rotation_angle(
        rotation.quaternion_from_euler(back[EULER].to_numpy()),
        rotation.quaternion_from_euler(track[EULER].to_numpy()),
    ).max()
    faster = np.abs(back[VELOCITY].to_numpy() - track[VELOCITY].to_numpy()).max()
    # Position m, attitude deg, velocity m/s. .nav: 1e-11 deg, 1e-9 deg, 1e-8 m/s; TUM: doubles of
    # Earth-centered metres, and velocities by differences over 10 ms.
    rounding = 1e-12
    limits = {
        "nav": (1.2e-6, 1e-9, 1e-8),
        "kf-gins": (1.2e-6, 1e-9, 1e-8),
        "tum": (5e-9, 1e-5, np.inf),
        "kitti": (2e-9, rounding, 0.0),
    }.get(name, (2e-9, rounding, 0.0))
    assert apart <= limits[0]
    assert turned <= limits[1] + 2e-6  # of equal attitudes the angle is the root of 2^-53 rad
    assert faster <= limits[2]
    # Doubles of seconds since 1970 have 0.24 µs; .nav has 10 ns.
    assert np.abs(_unix(back) - _unix(track)).max() <= (0 if clock == "relative" else 480)


def test_velocities_of_poses_are_those_between_them(tmp_path):
    track = streams("relative")["reference"]
    track.index = pd.Index(np.arange(ROWS) * 0.01, name="time")
    found = WRITERS["tum"].write(tmp_path / "a.tum", {"reference": track})
    codes = {"io.stream-written", "io.written-origin", "io.written-without"}
    assert {f.code for f in found} == codes
    back = read_trajectory(tmp_path / "a.tum")
    assert "io.tum-velocities" in {f.code for f in back.attrs["findings"]}
    moved = np.diff(ecef_from_geodetic(track[GEODETIC].to_numpy()), axis=0)
    speed = np.linalg.norm(moved, axis=1) / 0.01
    assert np.linalg.norm(back[VELOCITY].to_numpy(), axis=1)[1:-1] == pytest.approx(
        0.5 * (speed[1:] + speed[:-1]), rel=1e-3
    )


@pytest.mark.parametrize("frame", ["enu", "ned", "ecef"])
def test_a_stated_origin(tmp_path, frame):
    track = streams()["reference"]
    options = FileOptions(origin=(48.0, 11.4, 500.0), tum_frame=frame)
    WRITERS["tum"].write(tmp_path / "a.tum", {"reference": track}, options)
    back = read_trajectory(tmp_path / "a.tum")
    apart = place_difference(back[GEODETIC].to_numpy(), track[GEODETIC].to_numpy())
    assert np.abs(apart).max() < 5e-9
    if frame == "enu":
        first = np.loadtxt(tmp_path / "a.tum")[0]
        # 11 km north, 7.4 km east, below the tangent plane by d²/2R.
        assert first[1:3] == pytest.approx([7450.0, 11120.0], abs=20.0)
        assert first[3] == pytest.approx(20.0 - 13_385.0**2 / (2 * 6.37e6), abs=0.3)


def test_a_trajectory_without_axes_and_origin_is_refused(tmp_path):
    (tmp_path / "a.txt").write_text("0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n")
    assert next(readers_of(tmp_path / "a.txt"))[0] == "tum"
    with pytest.raises(DataError, check=coded("io.tum-without-origin")):
        read_trajectory(tmp_path / "a.txt")


def test_ground_truth_of_euroc(tmp_path):
    made = streams()
    WRITERS["euroc"].write(tmp_path / "out", {"imu": made["imu"], "reference": made["reference"]})
    back = read_log(tmp_path / "out")
    q = rotation.quaternion_from_euler(made["reference"][EULER].to_numpy())
    # The world does not turn with the local level: 20 m are 0.2 millidegrees.
    turned = rotation.rotation_angle(back.truth[QUATERNION].to_numpy(), q)
    assert len(turned) == ROWS
    assert turned.max() < 20.0 / 6.37e6 * 57.3 * 1.5 + 2e-6
    file = tmp_path / "out" / "mav0" / "state_groundtruth_estimate0" / "data.csv"
    rows = pd.read_csv(file)
    assert rows["#timestamp"].iloc[0] == FIRST_NS if "#timestamp" in rows else True
    values = rows.to_numpy(dtype=np.float64)
    # x north, y west, z up.
    ned = place_difference(
        made["reference"][GEODETIC].to_numpy(), made["reference"][GEODETIC].iloc[[0]].to_numpy()
    )
    assert values[:, 1:4] == pytest.approx(ned * [1.0, -1.0, -1.0], abs=1e-3)
    ours = made["reference"][VELOCITY].to_numpy() * [1.0, -1.0, -1.0]
    assert values[:, 8:11] == pytest.approx(ours, abs=5.0 * 20.0 / 6.37e6 * 1.5)
    assert "origin lat lon deg" in (file.parent / "sensor.yaml").read_text()


def test_an_attitude_alone_has_no_positions(tmp_path):
    made = streams()
    q = rotation.quaternion_from_euler(made["reference"][EULER].to_numpy())
    truth = on(attitude_table(made["imu"].index, q), "unix")
    WRITERS["euroc"].write(tmp_path / "out", {"imu": made["imu"], "reference": truth})
    back = read_log(tmp_path / "out")
    assert rotation.rotation_angle(back.truth[QUATERNION].to_numpy(), q).max() < 2e-6
    for name in ("tum", "kml", "nav", "gpx", "kitti"):
        with pytest.raises(DataError, check=coded("io.written-needs-stream")):
            WRITERS[name].write(tmp_path / name, {"reference": truth})


def test_kitti_rows_are_the_samples_within_the_trajectory(tmp_path):
    made = streams()
    part = made["reference"].iloc[50:350:7]
    part.attrs = dict(made["reference"].attrs)
    found = {f.code: f for f in WRITERS["kitti"].write(tmp_path / "a", made | {"reference": part})}
    count = len(np.arange(50, 345)) if part.index[-1] == made["imu"].index[344] else None
    assert count is not None
    assert found["io.written-samples-left-out"].data["count"] == ROWS - count
    assert found["io.written-interpolated"].data["count"] == count - len(part)
    assert len(read_log(tmp_path / "a").imu) == count
    # Between two rows of a turn at 8 deg/s, 0.07 s apart: the largest jerk h²/8, here below 1 cm/s.
    back = read_trajectory(tmp_path / "a")
    truth = made["reference"].iloc[50:345]
    assert np.abs(back[VELOCITY].to_numpy() - truth[VELOCITY].to_numpy()).max() < 1e-2


def test_a_trajectory_alone_has_rates_of_nan_in_kitti(tmp_path):
    WRITERS["kitti"].write(tmp_path / "a", {"reference": streams()["reference"]})
    row = np.loadtxt(tmp_path / "a" / "oxts" / "data" / f"{0:010d}.txt")
    assert np.isnan(row[11:25]).all()
    assert np.isfinite(row[:11]).all()
    with pytest.raises(DataError, check=coded("io.no-stream")):
        read_log(tmp_path / "a")
    assert len(read_trajectory(tmp_path / "a")) == ROWS


# Whole or not at all.


def test_what_exists_is_kept(tmp_path):
    made = streams()
    (tmp_path / "a.csv").write_text("mine")
    with pytest.raises(ConfigError, check=coded("io.exists")):
        write_streams(tmp_path / "a.csv", made)
    assert (tmp_path / "a.csv").read_text() == "mine"
    write_streams(tmp_path / "a.csv", made, force=True)
    assert read_log(tmp_path / "a.csv").imu.shape == (ROWS, 6)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("mine")
    with pytest.raises(ConfigError, check=coded("io.exists-other")):
        write_streams(tmp_path / "mine", made, "euroc", force=True)
    assert [p.name for p in (tmp_path / "mine").iterdir()] == ["notes.txt"]
    write_streams(tmp_path / "b", made, "euroc")
    write_streams(tmp_path / "b", made, "euroc", force=True)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.csv", "b", "mine"]


@pytest.mark.parametrize("name", WRITERS)
def test_a_refusal_leaves_no_file(tmp_path, name):
    wrong = streams()
    wrong["imu"] = wrong["imu"].drop(columns=ACCEL)
    bad = {"reference": wrong["reference"].drop(columns="VD"), "imu": wrong["imu"]}
    if WRITERS[name].alone or name == "mcap":
        bad = {"wheel" if name == "mcap" else "nonsense": wrong["wheel"]}
    with pytest.raises(DataError):
        write_streams(path_of(tmp_path, name), bad, name)
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_format_lists_what_each_holds(tmp_path):
    for path, form in ((tmp_path / "a.xyz", None), (tmp_path / "a", "kiti")):
        with pytest.raises(ConfigError) as caught:
            find_writer(path, form)
        listed = caught.value.finding.data["writers"]
        assert {f.data["name"] for f in listed} == set(WRITERS)
        assert all(list(f.data["streams"]) == list(WRITERS[f.data["name"]].streams) for f in listed)
    assert {w.reader for w in WRITERS.values()} - {None} <= set(READERS)


@pytest.mark.parametrize("name", ["kml", "geojson"])
def test_a_map_needs_positions_alone(name, tmp_path):
    gnss = streams()["gnss"]
    places = gnss.assign(VN=0.0, VE=0.0, VD=0.0, **dict.fromkeys(VELOCITY_SD, np.inf))
    places.attrs = dict(gnss.attrs)
    path = tmp_path / f"track.{name}"
    (found,) = [
        f for f in write_streams(path, {"gnss": places}, name) if f.code == "io.stream-written"
    ]
    assert (found.quantity, found.data["rows"]) == ("gnss", len(gnss))
    if name == "geojson":
        line, start, end = json.loads(path.read_text())["features"]
        lon, lat, alt = np.array(line["geometry"]["coordinates"]).T
        assert np.abs(lat - gnss["lat"]).max() < 1e-9
        assert np.abs(lon - gnss["lon"]).max() < 1e-9
        assert np.abs(alt - gnss["alt"]).max() < 1e-4
        # No velocity is stated, and zero is one.
        for feature in (line, start, end):
            assert not [key for key in feature["properties"] if "m_s" in key]
    else:
        assert path.read_text().count("<gx:coord>") == len(gnss)


def test_a_map_of_an_attitude_is_refused(tmp_path):
    attitude = attitude_table([0.0, 1.0], [[1.0, 0.0, 0.0, 0.0]] * 2)
    with pytest.raises(DataError) as refused:
        write_streams(tmp_path / "track.kml", {"reference": attitude})
    assert refused.value.finding.code == "io.written-needs-stream"


def test_what_is_written_is_named_only_where_it_is_there(tmp_path):
    made = streams()
    (found, *_) = write_streams(tmp_path / "a.csv", {"imu": made["imu"]})
    (more, *_) = write_streams(
        tmp_path / "b.csv", {"imu": made["imu"].assign(**made["magnetometer"])}
    )
    assert set(more.data["held"].split(", ")) - set(found.data["held"].split(", ")) == {"µT"}


def test_the_trajectory_of_a_run_has_the_clock_of_its_samples(tmp_path):
    from strapdown.api.writing import _reader

    track = streams()["reference"].copy()
    track.attrs = {"source": "made"}
    write_streams(tmp_path / "trajectory.csv", {"reference": track})
    clock = {"name": UNIX, "origin_s": 1.7e9, "gps_week": None}
    (tmp_path / "navigation.json").write_text(json.dumps({"record": {"clock": clock}}))
    read = _reader("reference", tmp_path / "trajectory.csv", {}, None, {})()
    assert clock_of(read) == Clock(UNIX, 1.7e9)
    first = int(own_ns(read)[0])
    assert first == 1_700_000_000_000_000_000 + round(track.index[0] * 1e9)
    # The same path elsewhere is on a clock of its own.
    (tmp_path / "navigation.json").unlink()
    read = _reader("reference", tmp_path / "trajectory.csv", {}, None, {})()
    assert clock_of(read).name == RELATIVE
