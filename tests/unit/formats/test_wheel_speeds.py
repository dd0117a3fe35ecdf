"""Speeds of wheels beside the samples of a log: by the names of columns, and of comma2k19."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

import strapdown as sd
from strapdown.config.choice import Kinds
from strapdown.config.logs import LogTable
from strapdown.config.navigation import AidSpec
from strapdown.errors import DataError
from strapdown.formats import NoStreamError, files_of, open_stream, read_log
from strapdown.formats.aid_table import read_stream
from strapdown.systems.navigation_draft import propose_aids
from strapdown.systems.navigation_source import of_samples

COUNT = 200
TIME = np.arange(COUNT) / 50.0
RNG = np.random.default_rng(5)
SAMPLES = {f"gyro_{a}_rad_s": 0.01 * RNG.standard_normal(COUNT) for a in "xyz"}
SAMPLES |= {f"accel_{a}_m_s2": RNG.standard_normal(COUNT) - 9.8 * (a == "z") for a in "xyz"}
SPEED = 10.0 + TIME


def log(tmp_path, columns, units=None):
    path = tmp_path / "drive.csv"
    table = pd.DataFrame({"time_s": TIME, **SAMPLES, **columns})
    table.to_csv(path, index=False)
    return path


def codes(recording):
    return [f.code for f in recording.findings]


@pytest.mark.parametrize(
    ("name", "factor"),
    [
        ("wheel_speed_kmh", 1.0 / 3.6),
        ("vehicle_speed (mph)", 0.44704),
        ("obd_speed_m_s", 1.0),
        ("CAN Speed [km/h]", 1.0 / 3.6),
        ("vehicleSpeedKmh", 1.0 / 3.6),
        ("speed_wheel_kmh", 1.0 / 3.6),
        ("speed vehicle (m/s)", 1.0),
    ],
)
def test_a_column_that_says_wheel_or_vehicle_and_a_unit(tmp_path, name, factor):
    recording = read_log(log(tmp_path, {name: SPEED}))
    assert recording.wheel.name == name
    np.testing.assert_array_equal(recording.wheel.index, recording.imu.index)
    np.testing.assert_allclose(recording.wheel, SPEED * factor, rtol=1e-14)
    assert "io.wheel-speed-of" in codes(recording)
    assert "io.columns-not-used" not in codes(recording)
    (shown,) = sd.doctor(tmp_path / "drive.csv").data["logs"]
    assert [(s["name"], s["rows"]) for s in shown["streams"]] == [("imu", COUNT), ("wheel", COUNT)]
    read = sd.read(tmp_path / "drive.csv")
    np.testing.assert_allclose(read["wheel"]["speed"], SPEED * factor, rtol=1e-14)


@pytest.mark.parametrize("name", ["wheel_speed", "vehicle_speed", "OBD speed (l)"])
def test_a_unit_is_never_guessed(tmp_path, name):
    recording = read_log(log(tmp_path, {name: SPEED}))
    assert recording.wheel is None
    found = next(f for f in recording.findings if f.code == "io.wheel-speed-unit-open")
    assert (found.severity, found.data["names"]) == ("warning", (name,))


OTHERS = ["speed_kmh", "gps_speed_kmh", "wheel_speed_rpm", "rl_wheel_speed_kmh"]


@pytest.mark.parametrize("name", OTHERS)
def test_a_speed_that_may_be_another_is_left(tmp_path, name):
    recording = read_log(log(tmp_path, {name: SPEED}))
    assert recording.wheel is None
    assert "io.wheel-speed-unit-open" not in codes(recording)


def test_of_four_wheels_those_in_the_rear(tmp_path):
    names = ("wheel_speed_fl_kmh", "wheel_speed_fr_kmh")
    names += ("WheelSpeedRL [km/h]", "rr_wheel_speed_mps")
    four = dict(zip(names, (SPEED * 9.0, SPEED * 8.0, 3.6 * SPEED, SPEED + 2.0), strict=True))
    recording = read_log(log(tmp_path, {"vehicle_speed_kmh": 0.0 * SPEED, **four}))
    np.testing.assert_allclose(recording.wheel, SPEED + 1.0, rtol=1e-14)
    assert recording.wheel.name == "WheelSpeedRL [km/h], rr_wheel_speed_mps"
    front = read_log(log(tmp_path, dict(list(four.items())[:3])))
    np.testing.assert_allclose(front.wheel, SPEED * 8.5 / 3.6, rtol=1e-14)


@pytest.mark.parametrize(
    ("left", "right"),
    [
        ("wheel_rl_speed_kmh", "speed_rr_wheel_kmh"),
        ("rear_wheel_left_speed_kmh", "speed right back wheel [km/h]"),
    ],
)
def test_words_of_a_wheel_in_any_order(tmp_path, left, right):
    recording = read_log(log(tmp_path, {left: 3.6 * SPEED, right: 3.6 * SPEED + 3.6}))
    assert recording.wheel.name == f"{left}, {right}"
    np.testing.assert_allclose(recording.wheel, SPEED + 0.5, rtol=1e-14)


REAR = ("wheel_speed_rl_mps", "wheel_speed_rr_mps")


def in_rows(values, rows):
    return np.where(np.isin(np.arange(COUNT), rows), values, np.nan)


@pytest.mark.parametrize(
    ("left", "right", "expected"),
    [
        # By turns: the first row of the left wheel is before all of the right one.
        (range(0, 200, 10), range(5, 200, 10), range(10, 200, 10)),
        (range(0, 200, 20), range(4, 200, 10), range(20, 200, 20)),
        (range(0, 200, 5), range(3, 200, 10), range(3, 200, 10)),
        # Rows 55 to 145 of the right wheel are missing.
        (range(0, 200, 20), [*range(5, 60, 10), *range(145, 200, 10)], (20, 40, 160, 180)),
        # Rows 60 and 140, at the ends of a gap, have both.
        (
            range(0, 200, 20),
            [*range(0, 61, 10), *range(140, 200, 10)],
            (0, 20, 40, 60, 140, 160, 180),
        ),
        # The right wheel is there in each row of the left one.
        (range(0, 200, 10), range(200), range(0, 200, 10)),
    ],
)
def test_wheels_in_different_rows(tmp_path, left, right, expected):
    pair = (in_rows(SPEED, left), in_rows(SPEED + 2.0, right))
    for columns in (dict(zip(REAR, pair, strict=True)), dict(zip(REAR, pair[::-1], strict=True))):
        recording = read_log(log(tmp_path, columns))
        if len(left) != len(right) or columns[REAR[0]] is pair[0]:
            np.testing.assert_allclose(recording.wheel.index, TIME[list(expected)], atol=1e-12)
        np.testing.assert_allclose(recording.wheel, 11.0 + recording.wheel.index, rtol=1e-12)
        assert "io.wheel-speed-mean" in codes(recording)


NEVER = np.full(COUNT, np.nan)
EMPTY = [
    {"wheel_speed_kmh": NEVER},
    dict.fromkeys(REAR, NEVER),
    {REAR[0]: SPEED, REAR[1]: NEVER},
    # One ends before the other begins.
    {REAR[0]: in_rows(SPEED, range(80)), REAR[1]: in_rows(SPEED, range(120, 200))},
]


def odometer_of_log():
    return Kinds("aiding", base=AidSpec)({"kind": "odometer", "speed_sd_m_per_s": 1.0})


@pytest.mark.parametrize("columns", EMPTY)
def test_wheels_without_a_value(tmp_path, columns):
    path = log(tmp_path, columns)
    recording = read_log(path)
    assert recording.wheel is None
    (found,) = (f for f in recording.findings if f.code == "io.no-usable-row")
    assert (found.severity, found.quantity) == ("warning", ", ".join(columns))
    assert not {"io.wheel-speed-of", "io.wheel-speed-mean"} & set(codes(recording))
    (shown,) = sd.doctor(path).data["logs"]
    assert [s["name"] for s in shown["streams"]] == ["imu"]
    with pytest.raises(DataError, check=coded("io.no-usable-row")):
        of_samples(odometer_of_log(), recording.imu, recording)


def test_why_a_column_without_a_unit_is_not_used(tmp_path):
    recording = read_log(log(tmp_path, {"wheel_speed": SPEED}))
    with pytest.raises(DataError, check=coded("io.wheel-speed-unit-open")) as caught:
        of_samples(odometer_of_log(), recording.imu, recording)
    assert caught.value.finding.data["names"] == ("wheel_speed",)


def test_a_value_that_is_repeated_until_the_next_counts_once(tmp_path):
    held = np.repeat(SPEED[::10], 10)
    held[100:160] = 7.0  # stays: rows at the usual interval
    recording = read_log(log(tmp_path, {"wheel_speed_mps": held}))
    np.testing.assert_allclose(recording.wheel.index, TIME[::10], atol=1e-12)
    np.testing.assert_allclose(recording.wheel, held[::10], rtol=1e-14)
    sparse = np.where(np.arange(COUNT) % 25 == 3, SPEED, np.nan)
    recording = read_log(log(tmp_path, {"wheel_speed_mps": sparse}))
    np.testing.assert_allclose(recording.wheel.index, TIME[3::25], atol=1e-12)
    np.testing.assert_allclose(recording.wheel, SPEED[3::25], rtol=1e-14)


def test_the_columns_are_proposed_and_used_without_a_file(tmp_path):
    path = log(tmp_path, {"wheel_speed_kmh": 3.6 * SPEED})
    recording = read_log(path)
    tables, _ = propose_aids(LogTable(path=str(path)), recording.imu, None, recording=recording)
    assert set(tables) == {"odometer"}
    # Slip of 0.3 m/s over 2 s, in rows of 20 ms: more than 0.3 m/s by the square root of 200.
    expected = {"kind": "odometer", "speed_sd_m_per_s": 4.2, "least_speed_m_per_s": 3.0}
    assert tables["odometer"] == expected
    given = Kinds("aiding", base=AidSpec)(tables["odometer"])
    table = of_samples(given, recording.imu, recording)
    np.testing.assert_allclose(table["speed"], SPEED, rtol=1e-14)
    assert (table["speed_sd"] == 4.2).all()
    # One that goes below zero has a sign, and is used at any speed.
    signed = read_log(log(tmp_path, {"wheel_speed_kmh": 3.6 * (SPEED - 11.0)}))
    tables, _ = propose_aids(LogTable(path=str(path)), signed.imu, None, recording=signed)
    assert tables["odometer"] == {"kind": "odometer", "speed_sd_m_per_s": 4.2}
    with pytest.raises(DataError, check=coded("navigation.aid-without-sd")):
        of_samples(given.model_copy(update={"speed_sd_m_per_s": 0.0}), recording.imu, recording)
    bare = read_log(log(tmp_path, {}))
    with pytest.raises(DataError, check=coded("navigation.no-such-columns-in-log")):
        of_samples(given, bare.imu, bare)


# comma2k19.


def segment(tmp_path, arrays, flat=False):
    folder = tmp_path / "10"
    arrays = {"IMU/gyro": np.zeros((40, 3)), **arrays}
    for name, value in arrays.items():
        t = 46_408.0 + np.arange(len(value)) / 80.0
        for part, array in (("t", t), ("value", value)):
            if flat:
                folder.mkdir(exist_ok=True)
                np.save(folder / f"{name.replace('/', '__')}__{part}.npy", array)
                continue
            own = folder / "processed_log" / name
            own.mkdir(parents=True, exist_ok=True)
            with (own / part).open("wb") as stream:
                np.save(stream, array)
    return folder


FOUR = 8.0 + np.arange(160.0).reshape(40, 4) / 100.0


@pytest.mark.parametrize("flat", [True, False])
@pytest.mark.parametrize("kind", ["CAN/wheel_speed", "CAN/wheel_speeds"])
def test_rear_wheels_of_a_segment(tmp_path, kind, flat):
    folder = segment(tmp_path, {kind: FOUR, "CAN/speed": FOUR[:, :1] + 5.0}, flat)
    table = read_stream(folder, "wheel")
    np.testing.assert_array_equal(table.index, 46_408.0 + np.arange(40) / 80.0)
    np.testing.assert_allclose(table["speed"], 0.5 * (FOUR[:, 2] + FOUR[:, 3]), rtol=1e-15)
    (said,) = table.attrs["findings"]
    assert (said.code, said.data["names"]) == ("io.wheel-speed-mean", ("rear left", "rear right"))
    assert len([f for f in files_of(folder) if "wheel" in str(f)]) == 2


def test_the_speed_of_the_car_where_the_wheels_are_not_there(tmp_path):
    table = read_stream(segment(tmp_path, {"CAN/car_speed": FOUR[:, 0]}), "wheel")
    np.testing.assert_array_equal(table["speed"], FOUR[:, 0])


def test_a_segment_without_wheels_and_one_with_other_shapes(tmp_path):
    with pytest.raises(NoStreamError):
        open_stream(segment(tmp_path, {}), "wheel")
    with pytest.raises(DataError, check=coded("io.stamps-shape-values-numbers-shapes-2")):
        open_stream(segment(tmp_path, {"CAN/wheel_speed": FOUR[:, :3]}), "wheel")
