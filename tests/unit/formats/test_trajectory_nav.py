"""Trajectories as KF-GINS, Parquet and python-ins have them, and text of fixed decimals."""

from __future__ import annotations

import numpy as np
import pyarrow.parquet as pq
import pytest

from strapdown.errors import ConfigError, DataError
from strapdown.formats import ReadOptions, read_log
from strapdown.formats.clocks import GPS, RELATIVE, Clock, clock_of, with_clock
from strapdown.formats.trajectory_readers import read_trajectory
from strapdown.formats.trajectory_writers import write_decimals
from strapdown.formats.writers import FileOptions, write_trajectory
from strapdown.tables import ACCEL, GYRO, TRAJECTORY, trajectory_table

ROWS = [
    "2017 456300.000 30.444787369 114.471863247 20.899 0.001 -0.002 0.003 0.854 -2.035 185.696",
    "2017 456300.005 30.444787370 114.471863248 20.900 0.002 -0.003 0.004 0.855 -2.036 185.697",
    "2017 456300.010 30.444787371 114.471863249 20.901 0.003 -0.004 0.005 0.856 -2.037 185.698",
]


def drive(n=2000, first=0.0):
    rng = np.random.default_rng(5)
    time = first + 0.005 * np.arange(n)
    place = [30.0, 114.0, 20.0] + rng.standard_normal((n, 3)) * [1e-3, 1e-3, 5.0]
    velocity = rng.standard_normal((n, 3)) * 10.0
    euler = rng.uniform([-180, -89, -180], [180, 89, 180], (n, 3))
    return trajectory_table(time, place, velocity, euler)


@pytest.mark.parametrize("name", ["truth.nav", "truth.txt"])
def test_nav_is_read_to_the_bit(tmp_path, name):
    (tmp_path / name).write_text("\n".join(ROWS) + "\n")
    table = read_trajectory(tmp_path / name)
    numbers = np.array([[float(f) for f in row.split()] for row in ROWS])
    assert np.array_equal(table.index, numbers[:, 1])
    assert np.array_equal(table[TRAJECTORY].to_numpy(), numbers[:, 2:])
    assert clock_of(table) == Clock(GPS, 0.0, 2017)


def test_a_new_week_and_an_unknown_one(tmp_path):
    rows = [r.replace("456300.0", "604799.9", 1) for r in ROWS[:1]]
    rows += [r.replace("2017 456300.0", "2018 0.1", 1) for r in ROWS[1:2]]
    path = tmp_path / "a.nav"
    path.write_text("\n".join(rows) + "\n")
    assert read_trajectory(path).index.tolist() == [604799.9, 604800.105]
    path.write_text("\n".join(r.replace("201", "", 1).replace("7 ", "0 ", 1) for r in ROWS) + "\n")
    assert clock_of(read_trajectory(path)).week is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda rows: [r.rsplit(" ", 1)[0] for r in rows],
            "file has 10 columns; this layout has 11",
        ),
        (lambda rows: [rows[0], rows[1] + " 1", rows[2]], "row 2: 12 fields"),
        (lambda rows: [rows[0], rows[1].replace("0.855", "x"), rows[2]], "row 2, roll: 'x' is not"),
        (lambda rows: [rows[1], rows[0], rows[2]], "row 2, time: time does not increase"),
        (lambda rows: [r.replace("30.4", "95.4") for r in rows], "row 1, lat: a latitude of 95.4"),
    ],
)
def test_refused(tmp_path, change, message):
    (tmp_path / "a.nav").write_text("\n".join(change(ROWS)) + "\n")
    with pytest.raises(DataError) as error:
        read_trajectory(tmp_path / "a.nav")
    assert message in str(error.value) and "a.nav" in str(error.value)


# Half a unit of the last decimal, and what a double keeps of it: 1e-11 deg is 1.1 micrometres.
ROUNDED = 0.5000001 * np.array([1e-11, 1e-11, 1e-6, *[1e-8] * 3, *[1e-9] * 3]) + 3e-14


def test_nav_goes_round(tmp_path):
    table = with_clock(drive(first=604795.0), Clock(GPS, 0.0, 2300))
    write_trajectory(tmp_path / "a.nav", table)
    again = read_trajectory(tmp_path / "a.nav")
    assert clock_of(again) == clock_of(table)
    assert np.abs(again.index - table.index).max() < 5.1e-9
    apart = again[TRAJECTORY].to_numpy() - table[TRAJECTORY].to_numpy()
    apart[:, 8] = (apart[:, 8] + 180.0) % 360.0 - 180.0
    assert (np.abs(apart).max(axis=0) <= ROUNDED).all()
    lines = (tmp_path / "a.nav").read_text().splitlines()
    assert {line.split()[0] for line in lines} == {"2300", "2301"}
    assert all(0.0 <= float(line.split()[10]) <= 360.0 for line in lines)
    assert max(float(line.split()[1]) for line in lines) < 604800.0


def test_csv_of_fixed_decimals_goes_round(tmp_path):
    table = drive()
    options = FileOptions(digits="fixed")
    write_trajectory(tmp_path / "a.csv", table, options=options)
    write_trajectory(tmp_path / "b.csv", table)
    a, b = (tmp_path / f"{n}.csv" for n in "ab")
    again, exact = read_trajectory(a), read_trajectory(b)
    assert np.array_equal(exact.to_numpy(), table.to_numpy())
    apart = np.abs(again[TRAJECTORY].to_numpy() - table[TRAJECTORY].to_numpy())
    assert (apart.max(axis=0) <= ROUNDED).all()
    heads = [[x for x in p.read_text().splitlines()[:6] if "trajectory:" not in x] for p in (a, b)]
    assert heads[0] == heads[1]
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.digits-unknown"
    ):
        FileOptions(digits="few")


def test_parquet_goes_round(tmp_path):
    table = with_clock(drive(), Clock(GPS, 0.0, 2300))
    table["north_sd"] = 0.5
    table.attrs["gps_week"] = 2300
    write_trajectory(tmp_path / "a.parquet", table)
    again = read_trajectory(tmp_path / "a.parquet")
    assert np.array_equal(again.index, table.index)
    assert np.array_equal(again[TRAJECTORY].to_numpy(), table[TRAJECTORY].to_numpy())
    schema = pq.read_schema(tmp_path / "a.parquet")
    assert "north_sd" in schema.names and "lat_deg" in schema.names
    assert schema.metadata[b"ellipsoid"] == b"wgs84" and schema.metadata[b"gps_week"] == b"2300"


def test_decimals_are_those_of_python(tmp_path):
    rng = np.random.default_rng(11)
    # Odd multiples of a power of two below the last decimal: none is a tie.
    values = rng.integers(-(10**9), 10**9, (3000, 4)) / 2.0**20
    values[:3] = [[0.0, -0.0, 1.0, -1.0], [0.04, -0.04, 0.6, -0.6], [9.9996, -9.9996, 99.5, 100.0]]
    decimals = (1, 3, 8, 0)
    write_decimals(tmp_path / "a", list(values.T), decimals, separator=",")
    got = [line.split(",") for line in (tmp_path / "a").read_text().splitlines()]
    for fields, row in zip(got, values, strict=True):
        for field, value, d in zip(fields, row, decimals, strict=True):
            # No minus before a zero.
            wanted = f"{value:.{d}f}"
            assert field == (wanted.lstrip("-") if float(wanted) == 0.0 else wanted)


def test_numbers_too_long_for_a_double_are_written_all_the_same(tmp_path):
    write_decimals(tmp_path / "a", [np.array([1.7e9, 2.0])], [9], head="t\n")
    assert (tmp_path / "a").read_text() == "t\n1700000000.000000000\n2.000000000\n"


def test_arrays_of_python_ins(tmp_path):
    table = drive()
    imu = np.column_stack([0.1 * np.ones((2000, 3)), np.tile([0.1, 0.2, -9.8], (2000, 1))])
    arrays = {"time": table.index, "imu": imu, "truth": table.to_numpy(), "init_sd": np.ones(4)}
    np.savez(tmp_path / "drive.npz", **arrays)
    recording = read_log(tmp_path / "drive.npz")
    assert np.array_equal(recording.imu[[*GYRO, *ACCEL]].to_numpy(), imu)
    assert recording.imu.attrs["sampling"] == "instantaneous"
    truth = read_trajectory(tmp_path / "drive.npz")
    assert truth.attrs["findings"] == () and clock_of(truth) == Clock(RELATIVE)
    assert np.array_equal(truth.to_numpy(), table.to_numpy())
    np.savez(tmp_path / "drive.npz", time=table.index, imu=imu[:, :5])
    with pytest.raises(DataError) as error:
        read_log(tmp_path / "drive.npz")
    assert error.value.finding.data["shape"] == (2000,)
    assert error.value.finding.data["shape_2"] == (2000, 5)


def test_tables_of_python_ins(tmp_path):
    """Its columns are named as ours; their units are in no name, and have to be said."""
    sim = pytest.importorskip("pyins.sim")
    trajectory, imu = sim.generate_sine_velocity_motion(
        0.01, 60.0, [55.0, 37.0, 150.0], [5.0, -3.0, 0.0], [8.0, 8.0, 0.3], 20.0
    )
    imu.to_csv(tmp_path / "imu.csv")
    trajectory.to_csv(tmp_path / "truth.csv")
    options = ReadOptions(gyro_unit="rad/s", axes="x,y,z")
    recording = read_log(tmp_path / "imu.csv", options)
    assert np.array_equal(recording.imu[[*GYRO, *ACCEL]].to_numpy(), imu.to_numpy())
    sums = imu * 0.01
    sums.to_csv(tmp_path / "sums.csv")
    options = ReadOptions(gyro_unit="rad", accel_unit="m/s", axes="x,y,z")
    recording = read_log(tmp_path / "sums.csv", options)
    # A stamp of 60 s carries 7e-15 s, a step of 10 ms then 1.4e-12 of itself.
    assert recording.imu[[*GYRO, *ACCEL]].to_numpy() == pytest.approx(imu.to_numpy(), rel=3e-12)
    assert recording.imu.attrs["sampling"] == "mean"
    truth = read_trajectory(tmp_path / "truth.csv")
    assert np.array_equal(truth[TRAJECTORY].to_numpy(), trajectory[TRAJECTORY].to_numpy())
