"""Text tables as people write them: preambles, two lines of names, text between rows, names."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation
from tests.coded import coded

import strapdown as sd
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError, DataError
from strapdown.formats import ReadOptions, read_log, reader_of
from strapdown.formats.assemble import assemble
from strapdown.formats.columns import read_name
from strapdown.formats.gnss_files import open_fixes
from strapdown.formats.recording import RawLog
from strapdown.tables import ACCEL, GYRO, MAG

RATES = np.array([0.1, -0.2, 0.3])  # rad/s
FORCE = np.array([0.5, -1.0, -9.7])  # m/s²


def rows(count=40, *, separator=",", step=0.01, end=""):
    values = [*np.degrees(RATES), *(FORCE / STANDARD_GRAVITY)]
    return [
        separator.join([f"{step * k:.3f}", *(f"{v + 1e-4 * (k % 3):.6f}" for v in values)]) + end
        for k in range(count)
    ]


SENSORS = "x (deg/s),y (deg/s),z (deg/s),x (g),y (g),z (g)"
HEADER = "Time (s),gx (deg/s),gy (deg/s),gz (deg/s),ax (g),ay (g),az (g)"


def read(tmp_path, lines, name="log.csv", **options):
    path = tmp_path / name
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_log(path, ReadOptions(**options))


def check(log, count=40):
    imu = log.imu
    assert len(imu) == count
    assert np.allclose(imu[GYRO].to_numpy()[0], RATES, atol=1e-5)
    assert np.allclose(imu[ACCEL].to_numpy()[0], FORCE, atol=1e-4)
    assert np.allclose(np.diff(imu.index), 0.01, atol=1e-9)


@pytest.mark.parametrize(
    "top",
    [
        ["My board, v2", "Started:,2024-01-02", "", HEADER],
        ["device: x", "rate 100", "range 2000", "firmware 1, build 2, debug", HEADER],
        ["% a comment", "% another", "%" + HEADER],
        ["# note", "", HEADER],
        [",Gyroscope,,,Accelerometer,,", f"Time (s),{SENSORS}"],
        ["Time,gx,gy,gz,ax,ay,az", "s,deg/s,deg/s,deg/s,g,g,g"],
        ["Time,gx,gy,gz,ax,ay,az", "(s),(deg/s),(deg/s),(deg/s),(g),(g),(g)"],
        ["Test,bench", "Time,gx,gy,gz,ax,ay,az", "s,deg/s,deg/s,deg/s,g,g,g"],
        [HEADER + ","],
        # As a spreadsheet fills up its rows: a word and a date are half data.
        ["Bench 4,,,,,,", "Date,04.05.2023,,,,,", ",,,,,,", HEADER],
        ["Date,04.05.2023,,,,,", HEADER],
        ["% Time,gx,gy,gz,ax,ay,az", "% s,deg/s,deg/s,deg/s,g,g,g"],
        ["% Time,gx,gy,gz,ax,ay,az", "% ,deg/s,deg/s,deg/s,g,g,g"],
    ],
)
def test_what_stands_above_the_rows(tmp_path, top):
    check(read(tmp_path, [*top, *rows()]))


def test_separators_at_the_end_of_each_line(tmp_path):
    check(read(tmp_path, [HEADER, *rows(end=",")]))
    check(read(tmp_path, [HEADER + ",", *rows(end=",")]))
    tabs = HEADER.replace(",", "\t")
    check(read(tmp_path, ["# board: two", tabs + "\t", *rows(separator="\t", end="\t")]))


def test_a_mark_may_be_the_name_of_the_numbers_of_rows(tmp_path):
    numbered = [f"{k},{row}" for k, row in enumerate(rows())]
    check(read(tmp_path, ["Update Rate: 100 Hz", f"#,{HEADER}", *numbered]))


def test_a_last_number_that_is_cut_shows_by_its_digits_with_a_decimal_comma_too(tmp_path):
    lines = [row.replace(".", ",") for row in rows(41, separator=";")]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([HEADER.replace(",", ";"), *lines])[:-3])
    log = read_log(path, ReadOptions())
    check(log)
    assert "io.last-line-cut-left-out" in {f.code for f in log.findings}


def test_blanks_beside_a_separator_are_no_part_of_a_word(tmp_path):
    spread = [row.replace(",", ", ") for row in rows()]
    check(read(tmp_path, [HEADER, *spread]))
    # A word for a missing value, and a time of day.
    spread[5] = spread[5].rpartition(",")[0] + ", NULL"
    assert len(read(tmp_path, [HEADER, *spread], repair=True).imu) == 39
    times = [f"{row.partition(',')[2]}, 12:00:00.{10 * k:03d}" for k, row in enumerate(rows())]
    turned = f"{HEADER.partition(',')[2]},time"
    check(read(tmp_path, [turned, *(row.replace(",", ", ") for row in times)]))


def test_rows_of_single_sensors_keep_the_units_stated_above(tmp_path):
    lines = [f"{k * 0.005:.3f};" + (";;;" if k % 2 else "1.7;0.2;-1.1;") for k in range(80)]
    lines = [row + ("0.1;0.2;9.8" if k % 2 else ";;") for k, row in enumerate(lines)]
    above = ["# Gyroscope unit = °/s", "# Accelerometer unit = m/s2"]
    log = read(tmp_path, [*above, "time;gyroX;gyroY;gyroZ;accX;accY;accZ", *lines])
    assert log.imu[GYRO].to_numpy()[0] == pytest.approx(np.radians([1.7, 0.2, -1.1]))


def test_a_linear_acceleration_by_its_short_name_is_none_with_gravity(tmp_path):
    names = "Time (s),lin_ax,lin_ay,lin_az,X Accel,Y Accel,Z Accel,gx,gy,gz"
    time = np.arange(400) * 0.01
    lines = [
        f"{t:.2f},0.0{k % 3},0.1,-0.1,0.1,0.2,9.8{k % 7},0.1,0.2,0.3" for k, t in enumerate(time)
    ]
    log = read(tmp_path, [names, *lines], accel_unit="m/s2", gyro_unit="deg/s")
    assert log.imu[ACCEL].to_numpy()[:, 2].mean() == pytest.approx(9.8, abs=0.1)


def test_body_rates_beside_an_attitude_are_a_gyro(tmp_path):
    lines = [f"{row},0.1,0.2,0.3" for row in rows()]
    log = read(
        tmp_path, ["t [s],p,q,r,ax,ay,az,roll,pitch,yaw", *lines], gyro_unit="deg/s", accel_unit="g"
    )
    check(log)
    with pytest.raises(DataError, check=coded("io.table-of-attitudes")):
        read(tmp_path, ["t [s],a,b,c,ax,ay,az,roll,pitch,yaw", *lines])


def test_names_with_slashes_are_no_row(tmp_path):
    names = [
        f"/imu/{group}/{axis}"
        for group in ("angular_velocity", "linear_acceleration")
        for axis in "xyz"
    ]
    header, lines = ",".join(["__time", *names]), rows()
    log = read(
        tmp_path, [header, *lines[:10], header, *lines[10:]], gyro_unit="deg/s", accel_unit="g"
    )
    check(log)
    assert "io.comments-among-rows" in {f.code for f in log.findings}


def test_lines_of_text_between_rows_are_left_out_and_said(tmp_path):
    lines = rows()
    text = "--- button pressed ---"
    log = read(tmp_path, [HEADER, *lines[:10], text, *lines[10:30], HEADER, *lines[30:]])
    check(log)
    assert "io.comments-among-rows" in {f.code for f in log.findings}


def test_a_damaged_row_is_no_text(tmp_path):
    lines = rows()
    with pytest.raises(DataError, check=coded("io.csv-field-count", row=12)):
        read(tmp_path, [HEADER, *lines[:10], "0.1,2.0", *lines[10:]])


def test_a_rate_above_the_names_serves_where_no_time_is(tmp_path):
    body = [line.partition(",")[2] for line in rows()]
    log = read(tmp_path, ["Sample Rate:,100,Hz", HEADER.partition(",")[2], *body])
    check(log)


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [
        ("x_gyro", "gyro_x", None),
        ("raw_acceleration_x_gs", "accel_x", "g"),
        ("linear_acceleration.y", "accel_y", None),
        ("field.angular_velocity.z", "gyro_z", "rad/s"),
        ("field.linear_acceleration.z", "accel_z", "m/s2"),
        ("field.header.stamp", "time", "ns"),
        ("field.orientation.x", None, None),
        ("time (sec)", "time", "s"),
        ("%time", "time", None),
        ("AngVelX", "gyro_x", None),
        ("Static/Acceleration/X", "accel_x", None),
        ("timestampMs", "time", "ms"),
        ("accelX", "accel_x", None),
        ("gyroscope_x_axis (rad/s)", "gyro_x", "rad/s"),
        ("mag_heading", None, None),
        ("temperature", None, None),
        ("x", None, None),
        ("max", None, None),
        ("row", None, None),
        ("lat", None, None),
        ("roll_rate", "gyro_x", None),
        ("PitchRate", "gyro_y", None),
        ("yaw_rate_deg_s", "gyro_z", "deg/s"),
        ("wx", "gyro_x", None),
        ("w_x", "gyro_x", None),
        ("ωx", "gyro_x", None),
        ("omega_x", "gyro_x", None),
        ("ang_vel_x", "gyro_x", None),
        ("rot_rate_x", "gyro_x", None),
        ("gyrX", "gyro_x", None),
        ("GyX", "gyro_x", None),
        ("xgyro", "gyro_x", None),
        ("X-Axis Angular Rate", "gyro_x", None),
        ("Gyroscope X (rad/s)", "gyro_x", "rad/s"),
        ("motionRotationRateX(rad/s)", "gyro_x", "rad/s"),
        ("IMU1_Gyro_X", "gyro_x", None),
        ("BMI160_gyr_x", "gyro_x", None),
        ("/imu/data/angular_velocity/x", "gyro_x", None),
        ("gyro_rad[1]", "gyro_y", "rad/s"),
        ("dps_x", "gyro_x", "deg/s"),
        ("Gyr_X", "gyro_x", None),
        ("fx,m/s2", "accel_x", "m/s2"),
        ("a_x", "accel_x", None),
        ("acc_x in m s^-2", "accel_x", "m/s2"),
        ("acc_x / m/s^2", "accel_x", "m/s2"),
        ("specific_force_x", "accel_x", None),
        ("accelerometerAccelerationX(G)", "accel_x", "g"),
        ("accelerationIncludingGravity_x_mps2", "accel_x", "m/s2"),
        ("motionGravityX(G)", "gravity_x", "g"),
        ("B_x", "mag_x", None),
        ("uT_x", "mag_x", "uT"),
        ("magnetometer_ga[0]", "mag_x", "gauss"),
        ("gz_rad_s (nominal; not calibrated)", "gyro_z", "rad/s"),
        ("gyro_bias_x", None, None),
        ("bias/gyro_x", None, None),
        ("angular_velocity_covariance_0", None, None),
        ("gyro_x_min", None, "min"),
        ("rotation.x", None, None),
        ("may", None, None),
        ("temp", None, None),
        ("vel_x", None, None),
        ("Date", "time", None),
        ("ms", "time", "ms"),
        ("usec", "time", "us"),
        ("_totl,_time", "time", "s"),
        ("SampleTimeFine_us", "time", "us"),
        ("SampleTimeFine", None, None),
        ("AccX_(m/s2)", "accel_x", "m/s2"),
        ("GyroX_(rad_s^-1)", "gyro_x", "rad/s"),
    ],
)
def test_names_in_any_order(name, quantity, unit):
    said = read_name(name)
    assert (said.quantity, said.unit) == (quantity, unit)


def test_rates_p_q_r(tmp_path):
    check(read(tmp_path, ["t_s,p_deg_s,q_deg_s,r_deg_s,ax_g,ay_g,az_g", *rows()]))


def test_several_units_of_one_kind_are_asked_for_once(tmp_path):
    names = [
        f"{place}/{what}/{axis}"
        for place in ("Left", "Right")
        for what in ("Gyro", "Accel")
        for axis in "XYZ"
    ]
    one = [line.partition(",") for line in rows()]
    lines = [",".join(["Time (s)", *names])] + [f"{t},{v},{v}" for t, _, v in one]
    with pytest.raises(DataError) as refused:
        read(tmp_path, lines)
    asked = refused.value.finding.data
    assert asked["flags"] == "--gyro-unit UNIT --columns gyro=Left/Gyro,accel=Left/Accel"
    assert [f.code for f in asked["questions"]] == [
        "io.columns-ambiguous",
        "io.columns-ambiguous",
        "io.unit-undecided",
    ]
    log = read(
        tmp_path,
        lines,
        columns={"gyro": "Left/Gyro", "accel": "Left/Accel"},
        gyro_unit="deg/s",
        accel_unit="g",
    )
    check(log)


@pytest.mark.parametrize(
    "names",
    [
        "gyro_1,gyro_2,gyro_3,acc_1,acc_2,acc_3",
        "gyro0,gyro1,gyro2,acc0,acc1,acc2",
        "roll_rate,pitch_rate,yaw_rate,fx,fy,fz",
        "gx,gy,gz,ax,ay,az",
        "P,Q,R,AX,AY,AZ",
        "dps_x,dps_y,dps_z,acc_x,acc_y,acc_z",
    ],
)
def test_sensors_by_their_columns_together(tmp_path, names):
    check(read(tmp_path, [f"t_s,{names}", *rows()], gyro_unit="deg/s", accel_unit="g"))


def test_of_a_name_that_is_there_twice_one_is_asked_for(tmp_path):
    lines = ["t_s,wx,wy,wz,ax,ay,az,wy", *(f"{line},0.5" for line in rows())]
    with pytest.raises(DataError, check=coded("io.columns-ambiguous", quantity="gyro_y")) as asked:
        read(tmp_path, lines, gyro_unit="deg/s", accel_unit="g")
    assert asked.value.finding.data["flags"] == "--columns gyro_x=wx,gyro_y=wy,gyro_z=wz"


def test_numbers_that_are_not_three_axes_are_no_sensor(tmp_path):
    with pytest.raises(DataError, check=coded("io.no-gyro-columns")):
        read(tmp_path, ["t_s,gyro_2,gyro_3,gyro_4,ax,ay,az", *rows()], gyro_unit="deg/s")


G = "gx,gy,gz"
OPEN = "io.letter-g-open"


@pytest.mark.parametrize(
    ("names", "code", "answer"),
    [
        # Beside acceleration without gravity, gx is gravity as often as a rate.
        (f"{G},lin_acc_x,lin_acc_y,lin_acc_z", OPEN, {"gyro": "g"}),
        # Beside other rates without acceleration it is acceleration in g, or gravity.
        (f"wx,wy,wz,{G}", OPEN, {"accel": "g"}),
        (f"wx,wy,wz,{G},ax,ay,az", None, {}),
        (f"wx,wy,wz,userAcceleration.x,userAcceleration.y,userAcceleration.z,{G}", None, {}),
    ],
)
def test_the_letter_g_is_asked_and_never_guessed(tmp_path, names, code, answer):
    lines = [f"t_s,{names}"] + [f"{line},1,2,3" for line in rows()]
    lines = [",".join(line.split(",")[: names.count(",") + 2]) for line in lines]
    given = {"gyro_unit": "deg/s", "accel_unit": "g"}
    if code is None:
        log = read(tmp_path, lines, **given)
        assert np.allclose(log.imu[GYRO].to_numpy()[0], RATES, atol=1e-5)
        assert (
            "gx" in next(f for f in log.findings if f.code == "io.columns-not-used").data["names"]
        )
        return
    with pytest.raises(DataError, check=coded(code)) as refused:
        read(tmp_path, lines, **given)
    triad, prefix = next(iter(answer.items()))
    assert refused.value.finding.data["flags"] == f"--columns {triad}={prefix}"
    log = read(tmp_path, lines, columns=answer, **given)
    assert f"{triad}_x" in log.imu.columns


def test_of_accelerations_the_one_with_gravity_is_used(tmp_path):
    names = [f"{kind} {axis} (m/s²)" for kind in ("LINEAR ACCELERATION", "ACCEL") for axis in "XYZ"]
    lines = [",".join(["t_s", *(f"GYRO {a} (deg/s)" for a in "XYZ"), *names])]
    lines += [
        line + "".join(f",{9.80665 * float(v):.6f}" for v in line.split(",")[4:]) for line in rows()
    ]
    check(read(tmp_path, lines))


def test_a_message_of_ros_defines_its_units(tmp_path):
    names = [f"angular_velocity.{a}" for a in "xyz"] + [f"linear_acceleration.{a}" for a in "xyz"]
    head = ["Time", *names, "angular_velocity_covariance_0", "linear_acceleration_covariance_0"]
    values = ",".join(f"{v:.6f}" for v in (*RATES, *FORCE))
    log = read(tmp_path, [",".join(head)] + [f"{0.01 * k:.2f},{values},0,0" for k in range(40)])
    check(log)
    assert {r.unit for r in log.readings if r.quantity.startswith("gyro")} == {"rad/s"}


def test_linear_acceleration_is_used_only_where_gravity_is_in_it(tmp_path):
    header = (
        HEADER.replace("ax (g)", "linear_acceleration_x (g)")
        .replace("ay (g)", "linear_acceleration_y (g)")
        .replace("az (g)", "linear_acceleration_z (g)")
    )
    still = [re.sub(r",[^,]+,[^,]+,[^,]+,", ",0.0,0.0,0.0,", line, count=1) for line in rows(400)]
    force = read(tmp_path, [header, *still]).imu[ACCEL].to_numpy()
    assert np.allclose(force, FORCE, atol=4e-3)
    rng = np.random.default_rng(3)
    still = [
        ",".join([*line.split(",")[:4], *(f"{v:.5f}" for v in rng.normal(0.0, 0.02, 3))])
        for line in rows(400)
    ]
    log = read(tmp_path, [header, *still])
    assert "io.left-out-linear-acceleration" in {f.code for f in log.findings}
    assert ACCEL[0] not in log.imu.columns


def test_of_two_stamps_the_samples_own_is_used(tmp_path):
    ns = [1_700_000_000_000_000_000 + 10_000_000 * k for k in range(40)]
    late = [n + (k % 5) * 1_000_000 for k, n in enumerate(ns)]
    axes = ",".join(
        f"field.{v}.{a}" for v in ("angular_velocity", "linear_acceleration") for a in "xyz"
    )
    body = [
        f"{b},{k},{a},imu,0.1,-0.2,0.3,0.5,-1.0,-9.7"
        for k, (a, b) in enumerate(zip(ns, late, strict=True))
    ]
    log = read(
        tmp_path, ["%time,field.header.seq,field.header.stamp,field.header.frame_id," + axes, *body]
    )
    check(log)


def test_sensors_at_their_own_rates_in_one_wide_table(tmp_path):
    lines = ["time_s,gx_deg_s,gy_deg_s,gz_deg_s,ax_g,ay_g,az_g,temp"]
    for k in range(200):
        gyro = ",".join(f"{v:.6f}" for v in np.degrees(RATES)) if k % 2 == 0 else ",,"
        accel = ",".join(f"{v:.6f}" for v in FORCE / STANDARD_GRAVITY) if k % 2 else ",,"
        lines.append(f"{0.005 * k:.3f},{gyro},{accel},20")
    log = read(tmp_path, lines)
    check(log, 99)  # between the first and the last sample of the accelerometer
    codes = {f.code for f in log.findings}
    assert {"io.interpolated-stamps-gyro-not-own", "io.columns-not-used"} <= codes


def test_a_log_with_fixes_in_its_rows_gives_both(tmp_path):
    path = tmp_path / "phone.csv"
    lines = [HEADER + ",latitude,longitude,altitude,horizontal accuracy (m),battery"]
    for k, row in enumerate(rows(400)):
        fix = "" if k < 50 else f"{55.0 + 1e-5 * (k // 100):.6f}"
        lines.append(
            f"{row},{fix},{'37.1' if fix else ''},{'150' if fix else ''},{'5' if fix else ''},98"
        )
    path.write_text("\n".join(lines) + "\n")
    streams = sd.read(path)
    assert len(streams["imu"]) == 400
    assert streams["gnss"].index.tolist() == pytest.approx([0.5, 1.0, 2.0, 3.0])
    assert open_fixes(path) is not None
    check(read_log(path), 400)


def test_rows_of_several_kinds_are_named(tmp_path):
    lines = []
    for k in range(20):
        lines.append(f"0,{0.01 * k},0.1,0.2,0.3,0,0,-9.8")
        lines += ["1,45.0,7.0,150.0"] if k % 5 == 4 else []
    with pytest.raises(DataError, check=coded("io.csv-rows-of-kinds")) as refused:
        read(tmp_path, lines)
    assert refused.value.finding.data["kinds"] == (
        "'0' (20 rows of 8 fields)",
        "'1' (4 rows of 4 fields)",
    )


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [
        ("Zeit [s]", "time", "s"),
        ("Zeitstempel_ms", "time", "ms"),
        ("temps", "time", None),
        ("Tiempo (s)", "time", "s"),
        ("tempo", "time", None),
        ("Beschleunigung X [m/s²]", "accel_x", "m/s2"),
        ("Beschl. quer", "accel_y", None),
        ("Beschl_längs", "accel_x", None),
        ("Drehrate Z [°/s]", "gyro_z", "deg/s"),
        ("Wankrate", "gyro_x", None),
        ("Nickgeschwindigkeit [°/s]", "gyro_y", "deg/s"),
        ("Gierrate", "gyro_z", None),
        ("Längsbeschleunigung [m/s²]", "accel_x", "m/s2"),
        ("Querbeschleunigung", "accel_y", None),
        ("Längs-Beschleunigung", "accel_x", None),
        ("Timestamp[nanosec]", "time", "ns"),
        ("LSL timestamp", "time", None),
        ("Winkelgeschwindigkeit_x", "gyro_x", None),
        ("Accélération y (m/s²)", "accel_y", "m/s2"),
        ("accélération linéaire x", "accel_x", None),
        ("Vitesse angulaire x (rad/s)", "gyro_x", "rad/s"),
        ("Aceleración Z (m/s^2)", "accel_z", "m/s2"),
        ("giroscopio_x", "gyro_x", None),
        ("Velocidad angular X (rad/s)", "gyro_x", "rad/s"),
        ("Velocità angolare Y [rad/s]", "gyro_y", "rad/s"),
        ("accelerazione z", "accel_z", None),
        # Words that only begin alike.
        ("Temperatur X", None, None),
        ("Gierwinkel", None, None),
        ("Geschwindigkeit x", None, None),
        ("Uhr", None, None),
    ],
)
def test_words_of_other_languages(name, quantity, unit):
    said = read_name(name)
    assert (said.quantity, said.unit) == (quantity, unit)
    assert said.linear == ("linéaire" in name)


def test_a_clock_of_an_unknown_name_is_proposed_and_a_counter_is_not(tmp_path):
    for name, step, likely in (("Uhr", 10, {"time": "Uhr"}), ("n", 1, {"rate": "HZ"})):
        lines = [f"{name},gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s"]
        lines += [f"{step * k},0.1,{0.01 * (k % 7)},0.3" for k in range(50)]
        path = tmp_path / "a.csv"
        path.write_text("\n".join(lines) + "\n")
        with pytest.raises(DataError) as refused:
            read_log(path)
        assert refused.value.finding.code == "io.time-column-missing"
        assert dict(refused.value.finding.data["answers"]) == likely


def moving(n=1500, *, seed=3):
    """Stamps in s, rates in deg/s, specific force in m/s² of a body that turns about two axes."""
    rng = np.random.default_rng(seed)
    time = 0.01 * np.arange(n)
    omega = np.column_stack([0.8 * np.sin(time / 2), 0.6 * np.cos(time / 1.3), 0 * time])
    force, turn = [], Rotation.identity()
    for step in omega:
        force.append(turn.inv().apply([0.0, 0.0, STANDARD_GRAVITY]))
        turn = turn * Rotation.from_rotvec(0.01 * step)
    gyro = np.degrees(omega) + rng.normal(0, 0.1, (n, 3))
    return time, gyro, np.array(force) + rng.normal(0, 0.03, (n, 3))


def table_of(path, names, columns, *, separator=",", again="", quoted=False):
    lines = [separator.join(f"{v:.5f}" for v in row) for row in np.column_stack(columns)]
    head = separator.join(f'"{n}"' if quoted else n for n in names)
    lines[500:500] = [again.replace("HEAD", head)] if again else []
    path.write_text("\n".join([head, *lines]) + "\n")
    return path


UNITS = [f"gyro_{a} [deg/s]" for a in "xyz"] + [f"acc_{a} [m/s2]" for a in "xyz"]


@pytest.mark.parametrize(("again", "quoted"), [("HEAD", False), ("HEAD", True), ("# HEAD", False)])
def test_names_that_are_repeated_among_the_rows_are_left_out(tmp_path, again, quoted):
    time, gyro, accel = moving()
    path = table_of(
        tmp_path / "a.csv", ["t [s]", *UNITS], (time, gyro, accel), again=again, quoted=quoted
    )
    imu = sd.read_imu(path)
    assert len(imu) == len(time)
    assert "io.comments-among-rows" in {f.code for f in imu.findings}
    np.testing.assert_allclose(imu[GYRO], np.radians(gyro), atol=1e-6)


def test_a_time_zone_in_brackets_is_no_unit():
    assert read_name("Timestamp (UTC)").quantity == "time"
    assert read_name("Time (local)").quantity == "time"
    assert read_name("Time (samples)").quantity is None


def test_the_unit_of_a_sensor_stands_before_its_members():
    assert (read_name("gyroscope_dps.x").quantity, read_name("gyroscope_dps.x").unit) == (
        "gyro_x",
        "deg/s",
    )
    assert read_name("accelerometer_mps2.z").unit == "m/s2"


def test_a_table_with_some_names_of_phyphox_is_read_as_a_table(tmp_path):
    time, gyro, accel = moving()
    names = ["Time (s)", *(f"Acceleration {a} (m/s^2)" for a in "xyz")]
    names += [f"Gyroscope {a} (rad s^-1)" for a in "xyz"]
    path = table_of(tmp_path / "a.csv", names, (time, accel, np.radians(gyro)))
    assert reader_of(path)[0] == "csv"
    np.testing.assert_allclose(sd.read_imu(path)[GYRO], np.radians(gyro), atol=1e-5)


@pytest.mark.parametrize("gravity", [True, False])
def test_linear_acceleration_beside_an_angular_velocity_is_that_of_ros(tmp_path, gravity):
    time, gyro, accel = moving()
    if not gravity:
        accel = np.random.default_rng(1).normal(0, 0.5, accel.shape)
    lines = []
    for k in range(len(time)):
        for name, values in (("angular_velocity", gyro[k]), ("linear_acceleration", accel[k])):
            one = {"time_ms": round(1e3 * time[k]), "sensor": name, "values": list(values)}
            lines.append(json.dumps(one))
    (tmp_path / "a.jsonl").write_text("\n".join(lines) + "\n")
    imu = sd.read_imu(tmp_path / "a.jsonl", units={"gyro": "deg/s", "accel": "m/s2"})
    assert (ACCEL[0] in imu.columns) == gravity
    if gravity:
        np.testing.assert_allclose(imu[ACCEL], accel, atol=1e-6)


def test_samples_that_share_the_stamp_of_their_first_are_spread(tmp_path):
    """Three stamps in four are repeated, by chance: bursts of any size."""
    time, gyro, accel = moving()
    true = time.copy()
    again = np.random.default_rng(4).random(len(time)) > 0.25
    again[0] = False
    time[again] = np.nan
    time = np.maximum.accumulate(np.nan_to_num(time))
    path = table_of(tmp_path / "a.csv", ["t [s]", *UNITS], (time, gyro, accel))
    log = read_log(path)
    (finding,) = [f for f in log.findings if f.code == "io.stamps-shared-by-bursts"]
    step = true[1] - true[0]
    assert finding.data["rate_hz"] == pytest.approx(1.0 / step, rel=1e-3)
    np.testing.assert_allclose(log.imu.index, true, atol=0.5 * step)


def test_a_repair_that_loses_little_of_a_log_is_proposed(tmp_path):
    time, gyro, accel = moving()
    # A row again after 50 is a fault of rows.
    rows = np.sort(np.concatenate([np.arange(len(time)), np.arange(1, len(time), 50)]))
    time, gyro, accel = time[rows], gyro[rows], accel[rows]
    path = table_of(tmp_path / "a.csv", ["t [s]", *UNITS], (time, gyro, accel))
    with pytest.raises(DataError) as refused:
        read_log(path)
    finding = refused.value.finding
    assert finding.code == "io.stamp-repeated"
    assert "--repair" in finding.data["flags"]
    kept = read_log(path, ReadOptions(repair=True)).findings
    dropped = next(f for f in kept if f.code == "io.rows-not-later-left-out")
    assert dropped.severity == "note"


def test_a_word_before_the_numbers_of_each_row_is_a_column(tmp_path):
    time, gyro, accel = moving()
    rows = np.column_stack([time, gyro, accel])
    lines = [f"IMU: {', '.join(f'{v:.6f}' for v in row)}" for row in rows]
    path = tmp_path / "a.txt"
    path.write_text("\n".join(lines))
    with pytest.raises(DataError, check=coded("io.nameless-columns")) as refused:
        read_log(path)
    columns = dict(refused.value.finding.data["answers"])
    assert (columns["time"], columns["gyro_x"], columns["accel_z"]) == ("2", "3", "8")


@pytest.mark.parametrize(("last", "rows"), [("0.21", 59), ("0.2131", 60)])
def test_a_last_number_shorter_than_all_others_was_cut(tmp_path, last, rows):
    lines = [f"{0.01 * k:.2f},1.5,0.2,0.3{k:02d}{'7' * (k % 3)}" for k in range(60)]
    lines[-1] = lines[-1].rpartition(",")[0] + f",{last}"
    path = tmp_path / "a.csv"
    path.write_text("t_s,gyro_x_dps,gyro_y_dps,gyro_z_dps\n" + "\n".join(lines))
    assert len(sd.read_imu(path)) == rows


UNUSUAL = """"Time (s)","Acceleration x ({0})","Acceleration y ({0})","Acceleration z ({0})",\
"Gyroscope x (rad/s)","Gyroscope y (rad/s)","Gyroscope z (rad/s)"
"""


@pytest.mark.parametrize(("unit", "read"), [("m.s^-2", True), ("m s-2", True), ("furlong", False)])
def test_a_table_with_some_names_of_phyphox_keeps_its_accelerometer(tmp_path, unit, read):
    """It was taken for an export of phyphox, whose reader knows one unit of the accelerometer."""
    rows = [f"{k / 50:.2f},0.1,0.2,9.8,0.01,0.02,{0.03 * k / 500}" for k in range(500)]
    path = tmp_path / "log.csv"
    path.write_text(UNUSUAL.format(unit) + "\n".join(rows) + "\n")
    assert reader_of(path) != "phyphox"
    if not read:
        with pytest.raises(DataError, check=coded("io.unit-unknown-word")):
            read_log(path)
    recording = read_log(path, ReadOptions(accel_unit=None if read else "m/s2"))
    assert set(ACCEL) <= set(recording.imu.columns)
    assert "io.unit-inferred" not in [f.code for f in recording.findings]


def test_an_accelerometer_that_a_format_does_not_read_is_no_note():
    """A reader states its gyro alone: the log says what else looked like a sensor."""
    n = 500
    columns = {"t": np.arange(n) / 50.0, **{f"w{a}": np.full(n, 0.01) for a in "xyz"}}
    stated = {"t": ("time", "s"), **{f"w{a}": (f"gyro_{a}", "rad/s") for a in "xyz"}}
    forces = {f"Acceleration {a} (m/s^2)": np.full(n, 9.8) for a in "xyz"}
    raw = RawLog("log.csv", (), columns={**columns, **forces}, rows=np.arange(n), stated=stated)
    (found,) = [
        f for f in assemble(raw, ReadOptions()).findings if f.code == "io.accelerometer-not-read"
    ]
    assert found.severity == "warning"
    assert found.data["names"] == tuple(forces)
    sizes = {"m/s2": (0.0, 0.0, 9.8), "g": (0.6, 0.0, 0.8), "UNIT": (0.0, 137.0, 0.0)}
    for unit, triple in sizes.items():
        forces = dict(zip(forces, np.tile(triple, (n, 1)).T, strict=True))
        found = assemble(replace(raw, columns=columns | forces), ReadOptions()).findings
        (found,) = [f for f in found if f.code == "io.accelerometer-not-read"]
        assert found.data["unit"] == unit
        named = dict(item.split("=") for item in found.data["columns"].split(","))
        assert named == dict(zip(ACCEL, forces, strict=True))


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [
        ("Accel_LN_X_CAL m/(s^2)", "accel_x", "m/s2"),
        ("acc_x m/s^(2)", "accel_x", "m/s2"),
        ("ay_mss", "accel_y", "m/s2"),
        ("gyro_x rad/(s)", "gyro_x", "rad/s"),
        ("wz_degsec", "gyro_z", "deg/s"),
        ("xl_x", "accel_x", None),
        ("XL Z [mg]", "accel_z", "mg"),
    ],
)
def test_units_as_programs_write_them(name, quantity, unit):
    said = read_name(name)
    assert (said.quantity, said.unit) == (quantity, unit)


def test_three_axes_of_a_name_without_separators_are_one_sensor():
    assert len({read_name(f"xl{axis}").family for axis in "xyz"}) == 1


def unknown(names, three, n=400):
    """Make a log with rates, and columns of unknown names."""
    columns = {"t": np.arange(n) / 50.0, **{f"w{a}": np.full(n, 0.01) for a in "xyz"}}
    units = {f"w{a}": "rad/s" for a in "xyz"} | {"t": "s"}
    more = dict(zip(names, np.transpose(three), strict=True))
    return RawLog("log.csv", (), columns=columns | more, rows=np.arange(n), units=units)


TURNED = np.column_stack(
    [np.sin(np.arange(400) / 40), np.cos(np.arange(400) / 40), np.full(400, 0.1)]
)


@pytest.mark.parametrize("names", [["mxlX", "mxlY", "mxlZ"], ["s1 raw", "s2 raw", "s3 raw"]])
@pytest.mark.parametrize("size", [9.8, 1.0, 4096.0])
def test_columns_of_unknown_names_with_the_norm_of_gravity_are_named(names, size):
    raw = unknown(names, size * TURNED)
    (found,) = [f for f in assemble(raw, ReadOptions()).findings if f.quantity == "accel"]
    assert (found.code, found.severity) == ("io.columns-like-accelerometer", "warning")
    assert found.data["norm"] == pytest.approx(size * np.sqrt(1.01))
    assert found.data["unit"] == {9.8: "m/s2", 1.0: "g"}.get(size, "UNIT")
    with pytest.raises(ConfigError, check=coded("io.unit-without-column")):
        assemble(raw, ReadOptions(accel_unit="g"))
    stated = dict(item.split("=") for item in found.data["columns"].split(","))
    read_as = assemble(raw, ReadOptions(columns=stated, accel_unit="m/s2")).imu
    assert read_as[ACCEL].to_numpy() == pytest.approx(size * TURNED)


@pytest.mark.parametrize("name", ["walked", "mag", "acc_bias"])
def test_other_columns_are_not_taken_for_an_accelerometer(name):
    """A way has no steady norm, and a magnetometer has a name."""
    three = TURNED if name == "mag" else TURNED * np.linspace(0.1, 3.0, 400)[:, None]
    raw = unknown([f"{name}_{a}" for a in "xyz"], three)
    codes = {f.code for f in assemble(raw, ReadOptions()).findings}
    assert "io.columns-like-accelerometer" not in codes


# Forms of tables that people publish.


def answers(tmp_path, lines, name="log.csv", **options):
    """Return the answers that a refusal proposes."""
    with pytest.raises(DataError) as refused:
        read(tmp_path, lines, name, **options)
    return dict(refused.value.finding.data["answers"])


@pytest.mark.parametrize(
    ("name", "quantity"),
    [
        ("accelerometer_lsm6ds3_c.x", "accel_x"),
        ("icm4x6xx_gyroscope.z", "gyro_z"),
        ("BMI160 Accelerometer.y", "accel_y"),
        ("Left Shank Gyro X,", "gyro_x"),
        ("right_ankle_gyr_y", "gyro_y"),
        ("Accel_LN_X_CAL", "accel_x"),
        ("xav", "gyro_x"),
        ("wheel_speed_x", "None"),
        ("foot_f_x", "None"),
        ("gyro_scale1_x", "None"),
        ("la", "None"),
        ("front_left", "None"),
        ("GPST", "time"),
        ("rosbagTimestamp", "time"),
    ],
)
def test_a_chip_and_a_place_do_not_hide_a_sensor(name, quantity):
    assert str(read_name(name).quantity) == quantity


def test_two_chips_are_two_sensors():
    assert read_name("mpu6050_gyro_x").family != read_name("bmi160_gyro_x").family


SHIMMER = ("Timestamp_Unix", *(f"{s}_{a}" for s in ("Accel_LN", "Gyro", "Mag") for a in "XYZ"))
OF_SHIMMER = ("ms", *["m/(s^2)"] * 3, *["deg/s"] * 3, *["local_flux"] * 3)


@pytest.mark.parametrize("layout", ["row of units", "rows of both", "behind", "brackets"])
@pytest.mark.parametrize("mag", ["local_flux", "local", "uT", "T"])
def test_a_magnetometer_relative_to_the_local_field_is_named_and_left_out(tmp_path, layout, mag):
    """As Consensys exports a Shimmer: a line of the separator, names, and units below them."""
    t, (gyro, accel) = 10 * np.arange(300), np.random.default_rng(1).normal(0, 5, (2, 300, 3))
    field = np.tile([22.0, -5.0, 41.0], (300, 1)) / {"uT": 1.0, "T": 1e6}.get(mag, 47.0)
    accel[:, 2] += 9.8
    units = [u.replace("local_flux", mag) for u in OF_SHIMMER]
    names = [f"Shimmer_B663_{n}_CAL" for n in SHIMMER]
    top = {
        "row of units": ['"sep=\t"', "\t".join(names) + "\t", "\t".join(units) + "\t"],
        "rows of both": ["\t".join(SHIMMER), "\t".join(["CAL"] * 10), "\t".join(units)],
        "behind": ["\t".join(f"{n} {u}" for n, u in zip(names, units, strict=True))],
        "brackets": ["\t".join(f"{n} ({u})" for n, u in zip(names, units, strict=True))],
    }[layout]
    end = "\t" if layout == "row of units" else ""
    rows = [
        f"{1_500_000_000_000 + s}\t" + "\t".join(f"{v:.9g}" for v in values) + end
        for s, values in zip(t.tolist(), np.hstack([accel, gyro, field]), strict=True)
    ]
    path = tmp_path / "s.csv"
    path.write_text("\n".join([*top, *rows]) + "\n")
    recording = read_log(path)
    imu = recording.imu
    # Nine digits, and stamps that are whole steps of 10 ms.
    np.testing.assert_allclose(imu[GYRO], np.radians(gyro), rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(imu[ACCEL], accel, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(imu.index, 0.001 * t, atol=1e-12)
    left_out = [f for f in recording.findings if f.quantity == "mag"]
    unused = [f for f in recording.findings if f.code == "io.columns-not-used"]
    if mag in ("uT", "T"):
        np.testing.assert_allclose(imu[MAG].to_numpy()[0], [22.0, -5.0, 41.0], rtol=1e-8)
        assert not left_out
    elif (layout, mag) == ("behind", "local"):
        # The word may be of any name.
        assert [len(f.data["names"]) for f in unused] == [3]
    else:
        assert not set(MAG) & set(imu.columns)
        (fault,) = left_out
        assert fault.data["reason"].code == "io.mag-unit-relative"


def test_of_a_calibrated_and_an_uncalibrated_gyro_the_first_is_used(tmp_path):
    head = "time_s,gyroscope.x,gyroscope.y,gyroscope.z,ax,ay,az," + ",".join(
        f"uncalibrated_Gyroscope.{a}" for a in "xyz"
    )
    lines = [head, *(f"{line},9,9,9" for line in rows())]
    check(read(tmp_path, lines, gyro_unit="deg/s", accel_unit="g"))


def test_a_beginning_that_all_names_share_is_left_out(tmp_path):
    names = ["Stamp_ms", *(f"{s}_{a}" for s in ("Gyro", "Accel") for a in "XYZ")]
    lines = [",".join(f"Unit_7F2C_{n}" for n in names), *rows(step=10)]
    check(read(tmp_path, lines, gyro_unit="deg/s", accel_unit="g"))


def test_a_quaternion_named_rotation_is_no_gyro(tmp_path):
    head = HEADER + ",rot_w,rot_x,rot_y,rot_z"
    check(read(tmp_path, [head, *(f"{line},1,0,0,0" for line in rows())]))


def test_seconds_and_nanoseconds_in_two_columns_beside_a_stamp_that_was_rounded(tmp_path):
    rng = np.random.default_rng(5)
    lines = ["rosbagTimestamp,secs,nsecs,xav,yav,zav,xla,yla,zla"]
    sensors = np.round([*RATES, *FORCE] + 0.02 * rng.standard_normal((400, 6)), 6)
    for k, row in enumerate(sensors):
        ns = 1_574_069_785_990_000_000 + 10_000_000 * k
        values = ",".join(map(str, row))
        lines.append(f"1.57E+18,{ns // 10**9},{ns % 10**9},{values}")
    imu = read(tmp_path, lines, gyro_unit="rad/s").imu
    assert np.allclose(np.diff(imu.index), 0.01, atol=1e-9)
    # A linear acceleration that shows gravity is specific force, as that of ROS.
    assert np.allclose(imu[GYRO], sensors[:, :3]) and np.allclose(imu[ACCEL], sensors[:, 3:])


def test_without_a_clock_the_rate_is_asked(tmp_path):
    lines = ["gx,gy,gz,ax,ay,az", *(line.partition(",")[2] for line in rows())]
    units = {"gyro_unit": "deg/s", "accel_unit": "g"}
    assert answers(tmp_path, lines, **units) == {"rate": "HZ"}
    check(read(tmp_path, lines, rate=100.0, **units))


def test_columns_without_names_are_proposed_by_their_numbers(tmp_path):
    # Clock, accelerometer, gyro, and the steady field of a magnetometer.
    rng = np.random.default_rng(11)
    gyro = 0.02 * rng.standard_normal((400, 3)) + RATES
    accel = 0.03 * rng.standard_normal((400, 3)) + FORCE
    field = 1e-4 * rng.standard_normal((400, 3)) + (0.2, -0.1, 0.4)
    table = np.column_stack([0.01 * np.arange(400), accel, gyro, field])
    lines = ["\t".join(f"{v:.6f}" for v in row) for row in table]
    asked = answers(tmp_path, lines, "log.txt", gyro_unit="rad/s")
    columns = {"time": "1", "gyro_x": "5", "gyro_y": "6", "gyro_z": "7"}
    columns |= {"accel_x": "2", "accel_y": "3", "accel_z": "4"}
    assert asked == columns
    imu = read(tmp_path, lines, "log.txt", gyro_unit="rad/s", columns=columns).imu
    assert np.allclose(imu[GYRO], np.round(gyro, 6)) and np.allclose(imu[ACCEL], np.round(accel, 6))


@pytest.mark.parametrize("first", ["a/g:", "2023-05-04 10:11:12.000"])
@pytest.mark.parametrize("scale", [1.0, 16384.0])
def test_the_steadier_of_two_triads_without_names_is_the_accelerometer(tmp_path, first, scale):
    """A walk, and counts; a word that begins every row is no time."""
    rng = np.random.default_rng(7)
    steps = 0.02 if scale > 1.0 else 0.25
    accel = scale * (steps * rng.standard_normal((400, 3)) + (0.0, 0.0, 1.0))
    gyro = rng.standard_normal((400, 3)) * np.abs(rng.standard_normal((400, 1)))
    table = np.column_stack([accel, 30.0 * gyro])
    word = first[0].isalpha()
    lines = []
    for k, row in enumerate(table):
        stamp = first if word else f"{first[:17]}{12 + k // 100:02d}.{k % 100:02d}0"
        lines.append(",".join([stamp, *(f"{v:.4f}" for v in row)]))
    columns = {} if word else {"time": "1"}
    columns |= {f"gyro_{a}": str(k) for k, a in enumerate("xyz", 5)}
    columns |= {f"accel_{a}": str(k) for k, a in enumerate("xyz", 2)}
    asked = answers(tmp_path, lines)
    assert {q: c for q, c in asked.items() if q in columns} == columns
    assert ("time" in asked) is not word


def test_columns_without_names_and_without_gravity_are_not_guessed(tmp_path):
    rng = np.random.default_rng(12)
    table = np.column_stack([0.01 * np.arange(100), rng.standard_normal((100, 6))])
    lines = [" ".join(f"{v:.6f}" for v in row) for row in table]
    with pytest.raises(DataError) as refused:
        read(tmp_path, lines, "log.txt", gyro_unit="rad/s")
    assert "answers" not in refused.value.finding.data
    # A first column of words is no time in an example either.
    lines = [f"imu {line.partition(' ')[2]}" for line in lines]
    with pytest.raises(DataError) as refused:
        read(tmp_path, lines, "log.txt", gyro_unit="rad/s")
    assert refused.value.finding.data["example"].startswith("gyro_x=2,")


def test_rows_of_a_board_between_sentences_of_a_receiver(tmp_path):
    """By its sentences the file is NMEA; the refusal says how its other lines are read."""
    sentence = "$GPGGA,090000.00,4730.0,N,00830.0,E,4,12,0.8,450.0,M,47.0,M,,*5B"
    lines = []
    for k, line in enumerate(rows()):
        lines += [f"IMU,{line}", *([sentence] if k % 10 == 5 else [])]
    path = tmp_path / "serial.log"
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(DataError, check=coded("io.no-stream")) as refused:
        read_log(path)
    way = refused.value.finding.data["way"]
    assert (way.code, way.data["count"]) == ("io.way-of-rows-beside", 40)
    columns = {"time": "2", **{q: str(k) for k, q in enumerate([*GYRO, *ACCEL], 3)}}
    units = {"gyro_unit": "deg/s", "accel_unit": "g", "time_unit": "s"}
    log = read_log(path, ReadOptions(columns=columns, **units, format="csv"))
    check(log)
    assert "io.comments-among-rows" in {f.code for f in log.findings}


def test_a_word_that_begins_every_row_has_no_name(tmp_path):
    lines = ["CLEARDATA", HEADER, *(f"Data,{line}" for line in rows())]
    check(read(tmp_path, lines))


def test_a_semicolon_that_ends_each_line(tmp_path):
    check(read(tmp_path, [HEADER + ";", *(f"{line};" for line in rows())]))


@pytest.mark.parametrize("times", [False, True])
def test_labelled_values_behind_a_stamp(tmp_path, times):
    lines = []
    for line in rows():
        stamp, *values = line.split(",")
        names = [f"{s} {a}" for s in ("Gyr", "Acc") for a in "XYZ"]
        said = [f"{n}:{v}" for n, v in zip(names, values, strict=True)]
        first = f"Time:{stamp}" if times else stamp
        lines.append(f"{first} |{', '.join(said[:3])} |{', '.join(said[3:])}")
    log = read(tmp_path, lines, "log.txt", gyro_unit="deg/s", accel_unit="g", time_unit="s")
    check(log)


def test_labels_of_three_values(tmp_path):
    lines = []
    for line in rows():
        stamp, *values = line.split(",")
        gyro, accel = ", ".join(values[:3]), ", ".join(values[3:])
        lines.append(f"Time (s): {stamp} | Gyro (deg/s): {gyro} | Accel (g): {accel}")
    check(read(tmp_path, lines, "log.txt"))


def test_dates_as_c_writes_them(tmp_path):
    lines = [HEADER.replace("Time (s)", "Time")]
    for k, line in enumerate(rows(step=1.0)):
        lines.append(f"Wed Dec  1 21:{9 + k // 60:02d}:{k % 60:02d} 2021,{line.partition(',')[2]}")
    log = read(tmp_path, lines)
    assert np.allclose(np.diff(log.imu.index), 1.0)
    assert log.imu.attrs["clock_origin_stamp"][0] == 1_638_392_940_000_000_000


def test_rows_of_linear_acceleration_in_a_wide_table_are_no_specific_force(tmp_path):
    lines = ["time_s,sensor,accel_x_g,accel_y_g,accel_z_g,gyro_x_deg_s,gyro_y_deg_s,gyro_z_deg_s"]
    for k in range(200):
        gyro = ",".join(f"{v:.6f}" for v in np.degrees(RATES))
        row = f"gyroscope,,,,{gyro}" if k % 2 else "linear_acceleration,9.1,3.2,-1.1,,,"
        lines.append(f"{0.005 * k:.3f},{row}")
    log = read(tmp_path, lines)
    assert ACCEL[0] not in log.imu.columns
    assert "io.left-out-linear-acceleration" in {f.code for f in log.findings}
    assert ACCEL[0] in read(tmp_path, [x.replace("linear_", "") for x in lines]).imu.columns


def test_rows_of_sensors_whose_kind_is_behind_two_clocks(tmp_path):
    lines = ["epoch_ms,elapsed_ms,sensor,x,y,z"]
    for k in range(100):
        for kind, values in (
            ("gyro_dps", np.degrees(RATES)),
            ("accel_g", FORCE / STANDARD_GRAVITY),
        ):
            numbers = ",".join(f"{v:.6f}" for v in values)
            lines.append(f"{1_752_000_000_000 + 10 * k},{10 * k},{kind},{numbers}")
    check(read(tmp_path, lines), 100)


def test_the_clock_of_apple_leaves_the_sign_of_gravity_open(tmp_path):
    head = "Timestamp,TimeIntervalSince1970,gx_deg_s,gy_deg_s,gz_deg_s,ax,ay,az"
    lines = [head]
    for k, line in enumerate(rows()):
        stamp = 1_598_799_969.25 + 0.01 * k
        # The stamp of the first column has too few digits.
        lines.append(f"2020-08-30 17:06:09.{k // 20},{stamp:.6f},{line.partition(',')[2]}")
    log = read(tmp_path, lines)
    left = {
        f.quantity: f.data["reason"].code for f in log.findings if f.code == "io.left-out-unusable"
    }
    assert left == {"accel": "io.file-leaves-open-whether"}
    log = read(tmp_path, lines, accel_unit="-g")
    assert np.allclose(log.imu[ACCEL].to_numpy()[0], -np.array(FORCE), atol=1e-4)


@pytest.mark.parametrize(("clock", "first"), [("elapsed_ms", 70_000), (None, 70_000), (None, -1)])
def test_the_counter_of_an_xsens_dot(tmp_path, clock, first):
    top = [] if clock else ["sep=,", "DeviceTag:,left", "FirmwareVersion:,1.6.0", ""]
    head = "PacketCounter,SampleTimeFine,Gyr_X,Gyr_Y,Gyr_Z,Acc_X,Acc_Y,Acc_Z"
    lines = [*top, head + (f",{clock}" if clock else "")]
    for k in range(60):
        values = ",".join(f"{v:.6f}" for v in (*np.degrees(RATES), *FORCE))
        stamp = (first + 10_000 * k) % 2**32  # one wraps after the first row
        lines.append(f"{k},{stamp},{values}" + (f",{10 * k}" if clock else ""))
    # The preamble of a DOT says deg/s, and its counter is of microseconds.
    check(read(tmp_path, lines, **({"gyro_unit": "deg/s"} if clock else {})), 60)


def test_the_unit_of_an_accelerometer_is_asked_with_that_of_the_gyro(tmp_path):
    rng = np.random.default_rng(3)
    lines = ["time_ms,ax,ay,az,gx,gy,gz"]
    for k in range(500):
        force = np.array([0.0, 0.0, 1.02]) + 0.12 * rng.standard_normal(3)
        rate = 12.0 * rng.standard_normal(3)
        lines.append(f"{100 * k}," + ",".join(f"{v:.5f}" for v in (*force, *rate)))
    asked = answers(tmp_path, lines)
    assert asked.keys() == {"gyro_unit", "accel_unit"} and asked["accel_unit"] == "g"


def test_sentences_of_one_name_with_checksums(tmp_path):
    rng = np.random.default_rng(13)
    accel = 0.03 * rng.standard_normal((200, 3)) + FORCE
    gyro = 0.05 * rng.standard_normal((200, 3)) + RATES
    field = 1e-4 * rng.standard_normal((200, 3)) + (0.2, -0.1, 0.4)
    rows_ = np.column_stack([field, accel, gyro])
    lines = ["$XXIMU," + ",".join(f"{v:+.6f}" for v in row) + "*3A" for row in rows_]
    asked = answers(tmp_path, lines, "log.txt", gyro_unit="rad/s")
    columns = {f"{s}_{a}": str(5 + 3 * j + k) for j, s in enumerate(("accel", "gyro"))
               for k, a in enumerate("xyz")}  # fmt: skip
    assert asked == columns | {"rate": "HZ"}
    imu = read(tmp_path, lines, "log.txt", gyro_unit="rad/s", columns=columns, rate=50.0).imu
    assert np.allclose(imu[GYRO], gyro, atol=1e-6) and np.allclose(imu[ACCEL], accel, atol=1e-6)


def test_a_number_of_lines_before_labels_is_no_clock(tmp_path):
    lines = []
    for k, line in enumerate(rows(), 1):
        _, *values = line.split(",")
        names = [f"{s}{a}" for s in ("g", "a") for a in "xyz"]
        lines.append(f"{k}: " + ", ".join(f"{n}={v}" for n, v in zip(names, values, strict=True)))
    units = {"gyro_unit": "deg/s", "accel_unit": "g"}
    assert answers(tmp_path, lines, "log.txt", **units) == {"rate": "HZ"}


def test_a_word_before_rows_under_its_own_name_moves_no_name(tmp_path):
    lines = ["type,t_s,gx,gy,gz,ax,ay,az", *(f"IMU,{line},7" for line in rows())]
    with pytest.raises(DataError) as refused:
        read(tmp_path, lines, gyro_unit="deg/s", accel_unit="g")
    assert "gyro_x" not in dict(refused.value.finding.data.get("answers", ()))


def header_of(gyro, accel, axis="x"):
    """Return a header of a clock and of two names, each with its three axes for the braces."""
    axes = [chr(ord(axis) + k) for k in range(3)]
    return ",".join(["Time (s)", *(name.format(a) for name in (gyro, accel) for a in axes)])


@pytest.mark.parametrize(
    ("gyro", "accel"),
    [
        ("{} (dps)", "{} (g)"),
        ("{}-axis (deg/s)", "{}-axis (g)"),
        ("Angular velocity (deg/s) {}", "Acceleration (g) {}"),
        ("GYR ({}) [deg/s]", "ACC ({}) [g]"),
        ("{}_gyro_out", "{}_accl_out"),
        ("scaledGyro{}", "scaledAccel{}"),
        ("uncomp_gyro_{}", "uncomp_accel_{}"),
        ("gyr_filt_{}", "acc_lpf_{}"),
        ("gyro_{}_filtered", "total_acc_{}"),
        ("w_ib_b_{}", "f_ib_b_{}"),
        ("pqr_{}", "sf{}"),
        ("avel_{}", "spec_force_{}"),
        ("gyro_{}_rps", "accel_{}_lsb"),
        ("角速度{}(°/s)", "加速度{}(g)"),
        ("{}轴角速度(°/s)", "{}轴加速度(g)"),
        ("각속도 {} (deg/s)", "가속도 {} (g)"),
        ("Угловая скорость {}", "Ускорение {}"),
        ("hoeksnelheid {}", "versnelling {}"),
    ],
)
@pytest.mark.parametrize("capital", [False, True])
def test_sensors_by_names_of_many_programs(tmp_path, gyro, accel, capital):
    header = header_of(gyro, accel, "X" if capital else "x")
    check(read(tmp_path, [header, *rows()], gyro_unit="deg/s", accel_unit="g"))


def test_a_rate_by_its_unit_and_its_axis(tmp_path):
    """As the program of WitMotion names it."""
    header = header_of("As{}(°/s)", "Acc{}(g)", "X")
    check(read(tmp_path, [f"{header},AngleX(°),AngleY(°)", *(f"{r},1,2" for r in rows())]))


def test_an_accelerometer_by_the_axes_of_a_car_in_short(tmp_path):
    """As MoTeC and others name them; the order of the columns is not that of the axes."""
    turns = [f"Gyro {turn} Velocity" for turn in ("Roll", "Pitch", "Yaw")]
    for name in ("G Force {}", "{}Acc", "{}G"):
        forces = [name.format(axis) for axis in ("Long", "Lat", "Vert")]
        header = ",".join(["Time", *turns, *forces])
        check(read(tmp_path, [header, *rows()], gyro_unit="deg/s", accel_unit="g"))


@pytest.mark.parametrize(
    "name",
    [
        *("FreeAcc_X", "gyro_temp_x", "acc_x_std", "acc_world_x", "Earth acceleration X"),
        *("gyro_x_sat", "acc_mean_x", "gyro_angle_x", "AngularAcceleration_X", "ang_acc_x"),
        *("angular acceleration x (rad/s2)", "jerk_x (m/s3)", "AngleX(°)", "heading x (deg/s)"),
        *("setpoint x (deg/s)", "Motor_x (rad/s)", "Wheel Speed X (rad/s)", "velocity x (m/s)"),
        *("X (mG)", "x (G)", "roll x (deg/s)", "lat accuracy (m)", "gps_acc_x", "x", "foot x (g)"),
    ],
)
def test_a_quantity_beside_an_axis_is_not_taken_for_a_sensor(name):
    assert read_name(name).quantity is None


def test_names_with_words_that_are_not_known_are_asked_about(tmp_path):
    header = header_of("gyro_zorp_{}", "accel_zorp_{}")
    asked = answers(tmp_path, [header, *rows()], gyro_unit="deg/s", accel_unit="g")
    assert asked == {"gyro": "gyro_zorp", "accel": "accel_zorp"}
    check(read(tmp_path, [header, *rows()], gyro_unit="deg/s", accel_unit="g", columns=asked))
    # They are a last resort: names that are known come first, and nothing is asked.
    both = [f"{line},9,9,9" for line in rows()]
    known = HEADER + ",gyro_zorp_x,gyro_zorp_y,gyro_zorp_z"
    check(read(tmp_path, [known, *both]))


def test_names_between_commas_over_rows_between_blanks(tmp_path):
    """As POSPac exports a trajectory: a title, names, their units in words, a blank line, rows."""
    names = [
        *("TIME", "DISTANCE", "EASTING", "NORTHING", "ELLIPSOID HEIGHT", "LATITUDE", "LONGITUDE"),
        *("ELLIPSOID HEIGHT", "ROLL", "PITCH", "HEADING"),
        *("EAST VELOCITY", "NORTH VELOCITY", "UP VELOCITY"),
    ]
    values = [0.0, 413000.0, 6179000.0, 160.0, 55.7, 37.6, 160.0, 1.0, -2.0, 33.0, 3.0, 4.0, -0.5]
    rows_of = [f"{300000 + k:.3f} " + " ".join(f"{v:.6f}" for v in values) for k in range(9)]
    units = "(time in Sec, distance in Meters, lat, long in Degrees)"
    path = tmp_path / "export.txt"
    path.write_text("\n".join(["POSPac MMS 8.4", ", ".join(names), units, "", *rows_of]) + "\n")
    got = sd.read_trajectory(path)
    expected = [55.7, 37.6, 160.0, 4.0, 3.0, 0.5, 1.0, -2.0, 33.0]
    np.testing.assert_array_equal(got.to_numpy()[4], expected)
    np.testing.assert_array_equal(got.index, 300000.0 + np.arange(9))


def frame(count=40):
    names = [*(f"gyro_{a}_dps" for a in "xyz"), *(f"accel_{a}_g" for a in "xyz")]
    values = np.array([[float(v) for v in row.split(",")] for row in rows(count)])
    table = pd.DataFrame(values[:, 1:], columns=names)
    table.insert(0, "time_s", values[:, 0])
    return table


@pytest.mark.parametrize("kind", ["columns", "lists", "split", "dates", "rows"])
def test_json_of_columns(tmp_path, kind):
    table, path = frame(), tmp_path / "log.json"
    if kind == "dates":
        dates = pd.to_datetime(table.pop("time_s"), unit="s", origin="2024-05-06")
        table.insert(0, "time", [f"{d.isoformat(timespec='milliseconds')}Z" for d in dates])
    if kind in ("lists", "dates"):
        path.write_text(json.dumps({"device": "x"} | table.to_dict("list"), indent=1))
    else:
        table.to_json(path, orient={"rows": "records"}.get(kind, kind), double_precision=15)
    check(read_log(path))


def test_json_of_vectors(tmp_path):
    table, path = frame(), tmp_path / "log.json"
    content = {"t": table["time_s"].tolist()}
    content["gyro"] = table.iloc[:, 1:4].to_numpy().tolist()
    content["accel"] = table.iloc[:, 4:].to_numpy().tolist()
    path.write_text(json.dumps(content))
    check(read_log(path, ReadOptions(gyro_unit="deg/s", accel_unit="g", time_unit="s")))


def test_an_array_and_a_table_of_feather(tmp_path):
    table = frame()
    table.to_feather(tmp_path / "log.feather")
    check(read_log(tmp_path / "log.feather"))
    np.save(tmp_path / "named.npy", table.to_records(index=False))
    check(read_log(tmp_path / "named.npy"))
    stated = {q: str(k) for k, q in enumerate(["time", *GYRO, *ACCEL], 1)}
    options = ReadOptions(columns=stated, gyro_unit="deg/s", accel_unit="g", time_unit="s")
    for name, array in (("rows", table.to_numpy()), ("across", table.to_numpy().T)):
        np.save(tmp_path / f"{name}.npy", array)
        with pytest.raises(DataError) as asked:
            read_log(tmp_path / f"{name}.npy")
        assert dict(asked.value.finding.data["answers"]).items() >= stated.items()
        check(read_log(tmp_path / f"{name}.npy", options))
    np.save(tmp_path / "one.npy", table["time_s"].to_numpy())
    with pytest.raises(DataError, check=coded("io.no-array-of-numbers")):
        read_log(tmp_path / "one.npy")
