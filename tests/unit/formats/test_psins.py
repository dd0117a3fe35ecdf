"""Increments of PSINS: a log by its header, a matrix by its numbers, and what is wrong in them."""

from __future__ import annotations

import numpy as np
import pytest

from strapdown import rotation
from strapdown.errors import DataError
from strapdown.formats import ReadOptions, read_log, read_raw
from strapdown.tables import ACCEL, GYRO

ARCSEC = np.pi / 180 / 3600
G = 9.79
HEAD = ["% PSINS-format SIMU log file.", "%   [pitch0(deg), roll0(deg), yaw0(deg), ...]."]
STATED = [
    "1.5 -2.5 -90.6 0.1 0.2 0.3",
    f"34.25 108.9 380.0 100.0 5.0 {G}",
    "0.1 0.2 0.3 125.0 250.0 500.0",
]
COUNTS = [[2, 0, -7, 1, 2, 16], [3, -4, 7, -1, 0, 17], [0, 5, 1, 3, -2, 16], [1, 1, 1, 0, 0, 16]]


def simu(folder, stated=STATED, rows=COUNTS, end="\n", head=HEAD):
    lines = [*head, *stated, *(" ".join(str(v) for v in row) for row in rows)]
    path = folder / "unit.imu"
    path.write_text("\n".join(lines) + end)
    return path


def matrix(folder, rows, name="plain.imu"):
    path = folder / name
    np.savetxt(path, rows, fmt="%.15g")
    return path


def test_counts_become_rates_in_body_axes(tmp_path):
    recording = read_log(simu(tmp_path))
    counts = np.array(COUNTS, dtype=float)
    rate = counts[:, :3] * [0.1, 0.2, 0.3] * ARCSEC / 5e-3
    force = counts[:, 3:] * [125e-6, 250e-6, 500e-6] * G / 5e-3
    assert recording.imu.attrs["sampling"] == "mean"
    # The stamps, near 100 s, round steps of 5 ms to 1.4e-14 / 5e-3 = 3e-12 of themselves.
    turned = [1, 0, 2]
    assert recording.imu[GYRO].to_numpy() == pytest.approx(rate[:, turned] * [1, 1, -1], rel=1e-11)
    assert recording.imu[ACCEL].to_numpy() == pytest.approx(
        force[:, turned] * [1, 1, -1], rel=1e-11
    )
    # The first increment ends one step after the start that the header states.
    assert recording.imu.index[0] == pytest.approx(100.005, abs=1e-12)
    assert recording.origin.stamp == 0


def test_the_start_that_the_header_states(tmp_path):
    start = read_log(simu(tmp_path)).start
    assert (start.lat_deg, start.lon_deg, start.alt) == (34.25, 108.9, 380.0)
    assert start.velocity_ned == (0.2, 0.1, -0.3)
    # About up, right and forward in turn: east-north-up from right-forward-up.
    pitch, roll, yaw = np.radians([1.5, -2.5, -90.6])
    c, s = np.cos, np.sin
    about_up = np.array([[c(yaw), -s(yaw), 0], [s(yaw), c(yaw), 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, c(pitch), -s(pitch)], [0, s(pitch), c(pitch)]])
    about_y = np.array([[c(roll), 0, s(roll)], [0, 1, 0], [-s(roll), 0, c(roll)]])
    swap = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
    c_nb = swap @ about_up @ about_x @ about_y @ swap.T
    ours = rotation.dcm_from_quaternion(
        rotation.quaternion_from_euler(start.roll_pitch_heading_deg)
    )
    assert ours == pytest.approx(c_nb, abs=1e-15)


def test_rows_are_those_of_the_file(tmp_path):
    raw = read_raw(simu(tmp_path))
    assert raw.row(0) == 6
    assert raw.columns["dtheta_x"][0] == 2 * 0.1 * ARCSEC


@pytest.mark.parametrize("end", ["", "\n3 1 2 0 0"])
def test_a_last_line_that_may_be_cut_is_left_out(tmp_path, end):
    raw = read_raw(simu(tmp_path, end=end))
    assert len(raw.columns["time"]) == (3 if end == "" else 4)
    assert any("may be incomplete" in f.what for f in raw.findings)


@pytest.mark.parametrize(
    ("stated", "rows", "row", "what"),
    [
        (STATED[:2], [], None, "ends before line 3"),
        ([], [], None, "ends before line 1"),
        (STATED, [], None, "no samples"),
        ([STATED[0], "34.25 108.9 380.0 100.0 5.0", STATED[2]], COUNTS, 4, "5 numbers in line 2"),
        (["a 0 0 0 0 0", *STATED[1:]], COUNTS, 3, "'a' is not a finite number"),
        (["0 0 nan 0 0 0", *STATED[1:]], COUNTS, 3, "'nan' is not a finite"),
        ([STATED[0], "94 0 0 0 5 9.8", STATED[2]], COUNTS, 4, "beyond a pole"),
        ([STATED[0], "34 0 0 0 0 9.8", STATED[2]], COUNTS, 4, "0 ms is not possible"),
        ([STATED[0], "34 0 0 0 5 980", STATED[2]], COUNTS, 4, "gravity of 980 m/s²"),
        ([*STATED[:2], "0.1 0.1 0 1 1 1"], COUNTS, 5, "scale factor of 0"),
        (STATED, [COUNTS[0], [1, 2, 3, 4, 5], COUNTS[1]], 7, "5 numbers, where each sample has 6"),
        (STATED, [COUNTS[0], [1, 2, 3, 4, 5, 6, 7], COUNTS[1]], 7, "7 numbers, where"),
        (STATED, [COUNTS[0], [1, 2, 3.5, 4, 5, 6], COUNTS[1]], 7, "3.5 is not a whole number"),
        (STATED, [COUNTS[0], [1, 2, "x", 4, 5, 6], COUNTS[1]], 7, "'x' is not a number"),
        (STATED, [COUNTS[0], [1, 2, "nan", 4, 5, 6], COUNTS[1]], 7, "whole number"),
    ],
)
def test_what_is_wrong_names_its_row(tmp_path, stated, rows, row, what):
    with pytest.raises(DataError) as error:
        read_raw(simu(tmp_path, stated, rows))
    assert what in error.value.finding.what
    assert error.value.finding.row == row
    assert error.value.finding.file == "unit.imu"
    assert error.value.finding.remedy


def rates(axis, sign=1.0, n=400, step=0.01):
    """Increments of a unit at rest with gravity on one axis, and their stamps."""
    out = np.full((n, 7), 7e-7)
    out[:, 3:6] = 0.0
    out[:, 3 + axis] = sign * 9.8 * step
    out[:, 6] = step * np.arange(1, n + 1)
    return out


def test_a_matrix_is_known_by_its_clock_and_its_gravity(tmp_path):
    recording = read_log(matrix(tmp_path, rates(2)))
    assert recording.imu.attrs["sampling"] == "mean"
    assert recording.imu[ACCEL].mean().to_numpy() == pytest.approx([0, 0, -9.8], abs=1e-9)
    assert recording.imu["gyro_z"].mean() == pytest.approx(-7e-5, rel=1e-9)
    assert any("read as PSINS" in f.what for f in recording.findings)


def test_a_matrix_with_gravity_elsewhere_keeps_its_axes_open(tmp_path):
    raw = read_raw(matrix(tmp_path, rates(2, -1.0)))
    assert raw.axes is None
    assert any("not on its third axis" in f.what for f in raw.findings)
    turned = read_log(matrix(tmp_path, rates(2, -1.0)), ReadOptions(axes="x,y,z"))
    assert turned.imu["accel_z"].mean() == pytest.approx(-9.8, rel=1e-9)


@pytest.mark.parametrize("scale", [0.1, 1.0 / 9.8, 100.0])
def test_increments_in_another_unit_are_not_guessed(tmp_path, scale):
    """In g·s, as rates, or ten times too small: read as a table without names, and asked for."""
    rows = rates(2)
    rows[:, 3:6] *= scale
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.nameless-seven-columns"
    ):
        read_log(matrix(tmp_path, rows))


def test_degrees_are_what_the_user_says(tmp_path):
    rows = rates(2)
    rows[:, :3] *= 180 / np.pi
    recording = read_log(matrix(tmp_path, rows), ReadOptions(gyro_unit="deg"))
    assert recording.imu["gyro_z"].mean() == pytest.approx(-7e-5, rel=1e-9)


def test_a_named_table_with_that_ending_is_read_as_a_table(tmp_path):
    path = tmp_path / "named.imu"
    path.write_text("time_s,gx_rad_s,gy_rad_s,gz_rad_s\n0,1,2,3\n0.01,1,2,3\n")
    assert read_log(path).imu["gyro_z"].iloc[1] == 3.0


def test_the_laser_gyro_record(recordings):
    path = recordings("rlg_static") / "part1_first900s.imu"
    recording = read_log(path)
    imu = recording.imu
    assert len(imu) == 90_000
    assert imu.index[-1] == pytest.approx(900.0, abs=1e-9)
    # The description of the record states 9.79548 m/s², which the means over a second give to
    # its last digit.
    seconds = imu[ACCEL].to_numpy().reshape(-1, 100, 3).mean(axis=1)
    assert np.linalg.norm(seconds, axis=1).mean() == pytest.approx(9.79548, abs=6e-6)
    # It states 14.85 deg/h; the mean follows how the rocking vehicle lay at both ends, and 0.04°
    # of that over 900 s are 0.16 deg/h. The Earth turns at 15.04.
    rate = np.degrees(np.linalg.norm(imu[GYRO].mean())) * 3600
    assert rate == pytest.approx(14.85, abs=0.16)
    assert imu["accel_z"].mean() < -9.79
    assert recording.start.roll_pitch_heading_deg == (0.0, 0.0, 90.6)
    assert (recording.start.lat_deg, recording.start.lon_deg) == (34.246048, 108.909664)
