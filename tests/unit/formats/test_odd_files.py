"""Files as programs, locales and accidents write them."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
from scipy.io import savemat
from tests.coded import coded

from strapdown import rotation, simulate
from strapdown.api.attitude import compare_attitude
from strapdown.errors import ConfigError, DataError
from strapdown.formats import read_log, read_raw
from strapdown.formats.recording import ReadOptions
from strapdown.formats.references import read_truth
from strapdown.tables import ACCEL, GYRO

HEAD = "time_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s"
ROWS = [f"{0.01 * k:.2f},0.1,0.2,{k}.25" for k in range(30)]


def written(path, text, encoding="utf-8"):
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize(
    ("what", "text", "encoding"),
    [
        ("CR LF", "\r\n".join([HEAD, *ROWS]) + "\r\n", "utf-8"),
        ("CR CR LF", "\r\r\n".join([HEAD, *ROWS]) + "\r\r\n", "utf-8"),
        ("CR", "\r".join([HEAD, *ROWS]) + "\r", "utf-8"),
        ("a byte order mark", "\n".join([HEAD, *ROWS]), "utf-8-sig"),
        ("UTF-16", "\n".join([HEAD, *ROWS]), "utf-16"),
        ("blank lines", "\n\n".join([HEAD, *ROWS]) + "\n\n\n", "utf-8"),
        ("separators after the rows", "\n".join([HEAD, *(r + "," for r in ROWS)]), "utf-8"),
        ("separators after all", "\n".join(r + "," for r in [HEAD, *ROWS]), "utf-8"),
        ("a row of units", "\n".join(["t,gx,gy,gz", "s,rad/s,rad/s,rad/s", *ROWS]), "utf-8"),
        (
            "quotes",
            "\n".join(",".join(f'"{f}"' for f in r.split(",")) for r in [HEAD, *ROWS]),
            "utf-8",
        ),
        ("capitals", "\n".join([HEAD.upper(), *ROWS]), "utf-8"),
        ("degree signs", "\n".join(["t [s],gx [°/s],gy [°/s],gz [°/s]", *ROWS]), "cp1252"),
        ("tabs", "\n".join([HEAD, *ROWS]).replace(",", "\t"), "utf-8"),
    ],
    ids=lambda value: value if isinstance(value, str) and len(value) < 30 else "",
)
def test_the_same_numbers_are_read(tmp_path, what, text, encoding):
    imu = read_log(written(tmp_path / "log.csv", text, encoding)).imu
    factor = np.pi / 180.0 if "degree" in what else 1.0
    assert np.array_equal(imu.index, np.round(np.arange(30) * 0.01, 2))
    assert np.array_equal(imu["gyro_z"], (np.arange(30) + 0.25) * factor)


def test_decimal_commas_that_come_late_are_seen(tmp_path):
    lines = ["t_s;gx_dps;gy_dps;gz_dps"] + [f"0,{k:02d};0;0;{int(k > 20)},5" for k in range(30)]
    lines[1:11] = [f"0,{k:02d};0;0;0" for k in range(10)]
    imu = read_log(written(tmp_path / "log.csv", "\n".join(lines))).imu
    assert imu.index[-1] == 0.29


@pytest.mark.parametrize("end", ["0.30,0.1", "0.30,0.1,0.2,", "0.30,0.1,0.2,-", "0.30,0.1,0.2,3"])
def test_a_last_line_that_was_cut_is_left_out(tmp_path, end):
    log = read_log(written(tmp_path / "log.csv", "\n".join([HEAD, *ROWS, end])))
    assert len(log.imu) == 30
    assert any("the last line is incomplete" in f.what and f.row == 32 for f in log.findings)


def test_rows_are_counted_as_an_editor_does(tmp_path):
    lines = ["# made by hand", "", HEAD, *ROWS[:5], "", "0.06,0.1,x,1", *ROWS[8:]]
    with pytest.raises(
        DataError, check=coded("io.value-not-a-number", row=10, quantity="gyro_y", values="x")
    ):
        read_log(written(tmp_path / "log.csv", "\n".join(lines)))


def test_hexadecimal_is_no_number(tmp_path):
    with pytest.raises(DataError, check=coded("io.value-not-a-number", values="0xFFF0")):
        read_log(written(tmp_path / "log.csv", "\n".join([HEAD, *ROWS, "0.30,0xFFF0,0,0", ""])))


def test_a_temperature_is_no_time(tmp_path):
    lines = ["T (degC),gx_dps,gy_dps,gz_dps"] + [f"{20 + 0.01 * k},0,0,1" for k in range(30)]
    log = read_log(written(tmp_path / "log.csv", "\n".join(lines)), ReadOptions(rate=50.0))
    assert log.imu.index[1] == 0.02


@pytest.mark.parametrize(
    ("header", "seconds"),
    [("millis", 1e-3), ("micros", 1e-6), ("seconds_elapsed", 1.0), ("imu.header.time_ns", 1e-9)],
)
def test_clocks_that_say_their_unit(tmp_path, header, seconds):
    lines = [f"{header},imu.gyro_x_dps,imu.gyro_y_dps,imu.gyro_z_dps"]
    lines += [f"{round(0.02 * k / seconds, 6):g},0,0,1" for k in range(30)]
    imu = read_log(written(tmp_path / "log.csv", "\n".join(lines))).imu
    assert imu.index[-1] == pytest.approx(0.58, abs=1e-12)


def test_a_clock_with_a_unit_goes_before_one_without(tmp_path):
    lines = ["time,seconds_elapsed,z_gyro,gyro_x_dps,gyro_y_dps,gyro_z_dps"]
    lines += [f"{1.7e18 + 1e7 * k:.0f},{0.01 * k:.2f},9,0,0,1" for k in range(30)]
    log = read_log(written(tmp_path / "log.csv", "\n".join(lines)))
    assert log.readings[0].source == "seconds_elapsed"


def test_three_names_by_prefix_must_be_x_y_and_z(tmp_path):
    lines = ["time_s,gx,gmax,gy,GyroZ"] + [f"{0.01 * k},1,2,3,4" for k in range(30)]
    path = written(tmp_path / "log.csv", "\n".join(lines))
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "io.no-such-column"
    ):
        read_log(path, ReadOptions(columns={"gyro": "g"}, gyro_unit="rad/s"))
    lines[0] = "time_s,GyrX_dps,Extra,GyrY_dps,GyrZ_dps"
    imu = read_log(written(path, "\n".join(lines)), ReadOptions(columns={"gyro": "gyr"})).imu
    assert np.allclose(imu[GYRO].iloc[0], np.radians([1, 3, 4]))
    with pytest.raises(ConfigError, check=coded("io.column-named-twice")):
        read_log(path, ReadOptions(columns={"gyro_x": "GyrY_dps", "gyro_y": "GyrY_dps"}))


@pytest.mark.parametrize(("stated", "codes"), [("deg/s", ["gyro"]), ("rad/s", []), (None, [])])
def test_a_unit_against_the_names_of_the_columns_is_used_and_said(tmp_path, stated, codes):
    time = np.arange(100) * 0.01
    gyro = {f"gyro_{a}_rad_s": np.sin(time) for a in "xyz"}
    np.savez(tmp_path / "log.npz", time_s=time, **gyro)
    log = read_log(tmp_path / "log.npz", ReadOptions(gyro_unit=stated))
    said = [f.quantity for f in log.findings if f.code == "io.unit-stated-otherwise"]
    assert said == codes
    factor = np.pi / 180.0 if stated == "deg/s" else 1.0
    assert log.imu["gyro_x"].to_numpy() == pytest.approx(factor * np.sin(time))


def test_a_crash_test_is_no_log_of_columns_without_names(recordings):
    with pytest.raises(DataError, check=coded("io.crash-test-file")):
        read_log(recordings("crash_nhtsa_10146") / "v10146.EV5")


@pytest.mark.parametrize("count", [2, 3, 4])
@pytest.mark.parametrize("transposed", [False, True])
def test_stamps_say_which_way_a_short_array_goes(tmp_path, count, transposed):
    time = np.arange(count) * 0.01
    gyro = np.arange(3.0 * count).reshape(count, 3)
    np.savez(tmp_path / "log.npz", time_s=time, gyro_rad_s=gyro.T if transposed else gyro)
    raw = read_raw(tmp_path / "log.npz")
    read = np.column_stack([raw.columns[f"gyro_rad_s[{k}]"] for k in range(3)])
    # A square is taken as it is.
    assert np.array_equal(read, gyro.T if transposed and count == 3 else gyro)


@pytest.mark.parametrize("transposed", [False, True])
def test_of_an_array_of_four_nothing_is_guessed(tmp_path, transposed):
    time = np.arange(50) * 0.01
    block = np.column_stack([time, np.ones((50, 3))])
    np.savez(tmp_path / "log.npz", time_s=time, gyro_rad_s=block.T if transposed else block)
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.no-gyro-columns"
    ):
        read_log(tmp_path / "log.npz")
    imu = read_log(tmp_path / "log.npz", ReadOptions(columns={"gyro": "gyro_rad_s[1]"})).imu
    assert (imu[GYRO].to_numpy() == 1).all()


def test_unsigned_stamps_that_go_back_are_seen(tmp_path):
    stamps = np.concatenate([np.arange(5000, 6000, 10), np.arange(0, 1000, 10)])
    for kind in (np.uint32, np.int16, np.int64, np.float32):
        np.savez(tmp_path / "log.npz", time_ms=stamps.astype(kind), gyro_rad_s=np.ones((200, 3)))
        with pytest.raises(
            DataError,
            match="row 101, time",
            check=lambda refused: refused.finding.code == "io.time-goes-back",
        ):
            read_log(tmp_path / "log.npz")


def test_a_fall_to_zero_that_is_no_wrap_is_none(tmp_path):
    ticks = np.concatenate([np.arange(100), np.arange(100)]) * 10
    lines = ["time_ms,gx_dps,gy_dps,gz_dps"] + [f"{t},0,0,1" for t in ticks]
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.time-goes-back"
    ):
        read_log(written(tmp_path / "log.csv", "\n".join(lines)))


def test_what_has_another_length_is_named(tmp_path):
    np.savez(
        tmp_path / "log.npz",
        time_s=np.arange(40) * 0.1,
        gyro_rad_s=np.ones((40, 3)),
        accel_m_s2=np.ones((20, 3)),
    )
    log = read_log(tmp_path / "log.npz")
    assert any("accel_m_s2[0] (20 values)" in f.what for f in log.findings)
    np.savez(tmp_path / "log.npz", time_s=np.arange(39) * 0.1, gyro_rad_s=np.ones((40, 3)), fs=10.0)
    with pytest.raises(DataError, match="'time_s' has 39 values"):
        read_log(tmp_path / "log.npz")


def test_structures_groups_and_attributes(tmp_path):
    time, rates = np.arange(30) * 0.02, np.random.default_rng(0).normal(size=(30, 3))
    savemat(tmp_path / "log.mat", {"log": {"t": time, "gyro_deg_s": rates}})
    assert np.array_equal(read_log(tmp_path / "log.mat").imu[GYRO], rates * (np.pi / 180.0))
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["imu/t"], file["imu/gyro"] = time, rates
        file["imu/gyro"].attrs["units"] = np.bytes_("deg/s")
        file.attrs["sampling"] = "50 Hz"
    assert np.array_equal(read_log(tmp_path / "log.h5").imu[GYRO], rates * (np.pi / 180.0))


def test_an_accelerometer_that_cannot_be_used_is_left_out(tmp_path):
    lines = [HEAD + ",ax,ay,az"] + [f"{r},0,0,-9.8" for r in ROWS]
    log = read_log(written(tmp_path / "log.csv", "\n".join(lines)))
    assert not set(ACCEL) & set(log.imu.columns)
    (finding,) = [f for f in log.findings if f.quantity == "accel"]
    assert "--accel-unit" in finding.advice("cli")


def test_nan_in_the_first_row_does_not_reach_the_report(tmp_path):
    path = written(tmp_path / "log.csv", "\n".join([HEAD, "0,nan,0,0", *ROWS[1:]]))
    bench = compare_attitude(path, repair=True)
    assert bench.readings[1].first == 0.1


def test_a_clock_that_was_set_costs_no_memory(tmp_path):
    stamps = np.concatenate([np.arange(500) * 0.01, 1.7e9 + np.arange(500) * 0.01])
    np.savez(tmp_path / "log.npz", time_s=stamps, gyro_rad_s=np.zeros((1000, 3)))
    bench = compare_attitude(tmp_path / "log.npz")
    assert len(bench.rests) == 2


# --- clocks and axes of a truth ---------------------------------------------------------


def turning(tmp_path, *, origin: float, begins: float, unit: str = "s"):
    """A turn at 0.5 rad/s about down, logged from `origin`; a truth that begins later."""
    factor = {"s": 1, "ms": 1e3}[unit]
    time = np.arange(1001) * 0.01
    lines = [f"time_{unit},gx_rad_s,gy_rad_s,gz_rad_s"]
    lines += [f"{float((origin + t) * factor)!r},0,0,0.5" for t in time]
    log = written(tmp_path / "log.csv", "\n".join(lines))
    known = time[time >= begins][::10]
    lines = ["time_s,roll_deg,pitch_deg,heading_deg"]
    lines += [f"{float(origin + t)!r},0,0,{float(np.degrees(0.5 * t) % 360)!r}" for t in known]
    return log, written(tmp_path / "truth.csv", "\n".join(lines))


@pytest.mark.parametrize("unit", ["s", "ms"])
@pytest.mark.parametrize("origin", [0.0, 999_995.0, 1.7e9])
def test_a_truth_that_begins_later_is_on_the_log_s_clock(tmp_path, origin, unit):
    log, truth = turning(tmp_path, origin=origin, begins=2.0, unit=unit)
    bench = compare_attitude(log, reference=[str(truth)], initial="zero", algorithms=["quaternion"])
    # A double of 1.7e9 s is good to 2.4e-7 s, in which 0.5 rad/s turn by 7e-6 deg.
    assert bench.scores[0].max_deg < 2e-5


def test_the_start_is_taken_from_the_truth_only_where_there_is_some(tmp_path):
    log, truth = turning(tmp_path, origin=0.0, begins=0.0)
    lines = truth.read_text().splitlines()
    holed = written(tmp_path / "holed.csv", "\n".join([*lines[:3], *lines[95:]]))
    bench = compare_attitude(log, reference=[str(holed)], from_s=4.5, initial="truth")
    assert bench.initial["time_s"] == pytest.approx(9.3, abs=0.11)
    with pytest.raises(
        DataError, match=r"holed\.csv, time: 0 instants of the reference are within the log: the"
    ):
        compare_attitude(log, reference=[str(written(holed, "\n".join(lines[:20])))], from_s=5.0)


def test_a_truth_on_dates(tmp_path):
    stamps = [f"2026-05-01T12:00:{k:02d}Z" for k in range(5)]
    log = ["timestamp,gx_rad_s,gy_rad_s,gz_rad_s"]
    log += [f"2026-05-01T12:00:{k // 10:02d}.{k % 10}Z,0,0,0.5" for k in range(50)]
    truth = ["timestamp,roll_deg,pitch_deg,heading_deg"]
    truth += [f"{s},0,0,{np.degrees(0.5 * k)}" for k, s in enumerate(stamps)]
    bench = compare_attitude(
        written(tmp_path / "log.csv", "\n".join(log)),
        algorithms="quaternion",
        reference=[str(written(tmp_path / "truth.csv", "\n".join(truth)))],
    )
    assert max(s.max_deg for s in bench.scores) < 1e-9


@pytest.mark.parametrize("axes", ["y,z,x", "z,x,y", "x,-y,-z", "-y,x,z"])
def test_axes_turn_a_log_s_own_truth_with_its_sensor(tmp_path, axes):
    simulate("alexiev-fig2c", rate_hz=100).save(tmp_path / "log")
    plain = compare_attitude(tmp_path / "log" / "log.csv", algorithms=["quaternion"])
    turned = compare_attitude(tmp_path / "log" / "log.csv", algorithms=["quaternion"], axes=axes)
    # The error is a rotation angle: what is called forward cannot change it.
    assert turned.scores[0].max_deg == pytest.approx(plain.scores[0].max_deg, abs=1e-9)


def test_markers_that_were_lost_are_unknown(tmp_path):
    lines = ["time_s,q_w,q_x,q_y,q_z", "0,1,0,0,0", "1,0,0,0,0", "2,1,0,0,0"]
    truth = read_truth(written(tmp_path / "truth.csv", "\n".join(lines)))
    assert truth.index.tolist() == [0.0, 2.0]
    assert rotation.rotation_angle(truth.iloc[0, :4], [1, 0, 0, 0]) == 0.0


def test_a_truth_whose_clock_has_no_unit_says_what_to_do(tmp_path):
    log, truth = turning(tmp_path, origin=0.0, begins=0.0)
    lines = truth.read_text().splitlines()
    in_ms = ["time,roll_deg,pitch_deg,heading_deg"]
    in_ms += [f"{float(line.split(',')[0]) * 1e3},{line.partition(',')[2]}" for line in lines[1:]]
    with pytest.raises(
        DataError, match=r"truth\.csv, time: the unit is not stated, and a mean step of 100 does"
    ):
        compare_attitude(log, reference=[str(written(truth, "\n".join(in_ms)))])
    in_ms[0] = "time_ms,roll_deg,pitch_deg,heading_deg"
    bench = compare_attitude(log, reference=[str(written(truth, "\n".join(in_ms)))])
    assert bench.scores[-1].max_deg < 1e-9


@pytest.mark.parametrize("spoiled", ["imu_gyr", "imu_acc", "opt_quat"])
@pytest.mark.parametrize("value", ["text", 1.0, np.ones((7, 3))])
def test_a_broad_trial_with_a_spoiled_dataset_is_refused(tmp_path, spoiled, value):
    with h5py.File(tmp_path / "synthetic.h5", "w") as file:
        file.attrs["sampling_rate"] = 50.0
        for name, width in (("imu_gyr", 3), ("imu_acc", 3), ("opt_quat", 4)):
            file[name] = value if name == spoiled else np.ones((30, width))
    with pytest.raises(DataError, match="shapes"):
        read_log(tmp_path / "synthetic.h5")


def test_rows_without_the_separator_of_their_header_are_refused_with_their_row(tmp_path):
    rows = [HEAD.replace(",", ";"), *(r.replace(",", " ") for r in ROWS)]
    path = written(tmp_path / "two.csv", "\n".join(rows))
    with pytest.raises(DataError, check=coded("io.csv-field-count", row=2)):
        read_log(path, ReadOptions())
