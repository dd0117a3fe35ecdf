"""Corrupt and hostile text: what once ended in a traceback, a huge allocation or a wrong answer."""

from __future__ import annotations

import resource
import signal
import warnings
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded
from tests.recorded import DATA

import strapdown as sd
from strapdown.crash.severity import load_severity_model
from strapdown.errors import ConfigError, DataError, StrapdownError
from strapdown.formats import read_log
from strapdown.formats.clocks import read_stamps
from strapdown.formats.inference.conclusion import differenced
from strapdown.sensors.catalogue import FOLDER, load_sensor

HOSTILE = DATA.parent / "hostile"
HEAD = "time_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2"


@contextmanager
def limits(seconds=20, memory=2 << 30):
    """Little time and memory: what asks for more fails."""

    def expired(*_):
        raise TimeoutError

    before = resource.getrlimit(resource.RLIMIT_AS)
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    old = signal.signal(signal.SIGALRM, expired)
    signal.alarm(seconds)
    resource.setrlimit(resource.RLIMIT_AS, (size + memory, before[1]))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, old)
        resource.setrlimit(resource.RLIMIT_AS, before)


def table(path, rows, head=HEAD):
    lines = [",".join(map(str, row)) for row in rows]
    path.write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    return path


def samples(count=400, rate=100.0):
    chance = np.random.default_rng(0)
    values = chance.normal(0.0, 0.01, (count, 6)) + np.array([0, 0, 0, 0, 0, -9.8])
    return [[repr(k / rate), *map(repr, row)] for k, row in enumerate(values.tolist())]


# --- stamps -----------------------------------------------------------------------------


@pytest.mark.parametrize("wild", ["2147483648.0", "4.6e9", "1e300", "-1e300"])
@pytest.mark.parametrize("at", [0, 1, 150, 398, 399])
def test_one_corrupt_stamp_is_refused_with_its_row_or_left_out(tmp_path, wild, at):
    rows = samples()
    rows[at][0] = wild
    path = table(tmp_path / "imu.csv", rows)
    with limits():
        with pytest.raises(DataError) as refused:
            sd.read_imu(path)
        assert refused.value.finding.row in (at + 1, at + 2, at + 3)
        assert refused.value.finding.quantity == "time"
        imu = sd.read_imu(path, repair=True)
        assert len(imu) >= 398
        assert imu.index[-1] - imu.index[0] < 4.0
        assert sd.doctor(path) is not None


def test_the_rate_of_a_repaired_log_is_that_of_its_samples(tmp_path):
    """It was 6e-9 Hz, and angles were nan."""
    rows = samples()
    rows[150][0] = "4592609856.045"
    path = table(tmp_path / "imu.csv", rows)
    bench = sd.compare_attitude(sd.read_imu(path, repair=True), algorithms=["quaternion"])
    assert bench.clock.rate_hz == pytest.approx(100.0, rel=1e-3)


def test_rows_that_are_out_of_order_are_no_corrupt_stamps():
    stamps = np.array([0.0, 0.1, 0.3, 0.2, 0.4, 0.5, 0.5, 0.6])
    read = read_stamps(stamps, "s", "", file="x", row=lambda k: k + 1, repair=True)
    assert read.keep.tolist() == [True, True, True, False, True, True, False, True]
    assert [f.code for f in read.findings] == ["io.rows-not-later-left-out"]


def test_many_pauses_of_years_are_refused_and_a_clock_that_was_set_is_not():
    def read(stamps, repair=False):
        return read_stamps(stamps, "s", "", file="x", row=lambda k: k + 1, repair=repair)

    part = np.arange(100) * 0.01
    assert read(np.concatenate([part, 1.7e9 + part])).keep.all()
    many = np.concatenate([k * 1e8 + part[: 10 + 5 * k] for k in range(6)])
    with pytest.raises(DataError, check=coded("io.pause-impossible")):
        read(many)
    assert read(many, repair=True).keep.sum() == 35
    with pytest.raises(DataError, check=coded("io.pause-impossible")):
        read(np.concatenate([part, 1e11 + part]))


def test_differences_of_stamps_of_64_bits_do_not_wrap():
    stamps = np.array([-(2**63), 0, 2**63 - 1])
    assert (np.diff(differenced(stamps)) > 0).all()
    assert (np.diff(differenced(np.array([0, 2**64 - 1], dtype=np.uint64))) > 0).all()


def test_no_position_is_carried_over_a_clock_that_was_set(tmp_path):
    rows = samples(800)
    for row in rows[400:]:
        row[0] = repr(1.7e9 + float(row[0]))
    path = table(tmp_path / "imu.csv", rows)
    start = {"lat_deg": 50.0, "lon_deg": 30.0, "alt_m": 100.0, "heading_deg": 0.0}
    with limits():
        for run in (
            lambda: sd.navigate(path, sensor="fog-1000", start=start),
            lambda: sd.align(path, site=(50.0, 30.0, 100.0), sensor="fog-1000"),
        ):
            with pytest.raises(DataError, check=coded("io.clock-set-in-log")) as refused:
                run()
            assert refused.value.finding.row == 402


# --- values, names and width ------------------------------------------------------------


def test_a_force_of_no_body_is_refused_with_its_row(tmp_path):
    rows = samples()
    rows[7][4] = "1e300"
    with limits(), pytest.raises(DataError, check=coded("io.force-impossible")) as refused:
        sd.read_imu(table(tmp_path / "imu.csv", rows))
    assert (refused.value.finding.row, refused.value.finding.quantity) == (9, "accel_x")


@pytest.mark.parametrize("separator", [",", ";", "\t", " ", "|"])
def test_a_million_columns_are_refused_at_once(tmp_path, separator):
    line = separator.join(["1"] * 1_000_000)
    path = tmp_path / "wide.csv"
    path.write_text(f"{line}\n" * 3)
    for read in (sd.read_imu, sd.read_gnss, sd.read_crash_record):
        with limits(10, 500 << 20), pytest.raises(DataError) as refused:
            read(path)
        assert refused.value.finding.code == "io.csv-too-many-columns"


def test_ten_thousand_columns_are_read(tmp_path):
    head = HEAD + "".join(f",c{k}" for k in range(9_000))
    rows = [[*row, *["1"] * 9_000] for row in samples(20)]
    assert len(sd.read_imu(table(tmp_path / "imu.csv", rows, head))) == 20


def test_what_a_file_says_does_not_steer_the_terminal(tmp_path):
    rows = samples(20)
    rows[3][1] = "\x1b[31m1\u202e"
    path = table(tmp_path / "a\x1b[2J\u2066.csv", rows, HEAD + "\x07")
    with pytest.raises(StrapdownError) as refused:
        read_log(path)
    said = str(refused.value)
    assert said.replace("\n", "").isprintable()
    assert "\\x1b[31m1\\u202e" in said
    assert "a\\x1b[2J\\u2066.csv" in said


# --- TOML -------------------------------------------------------------------------------


@pytest.mark.parametrize("text", ["x = " + "[" * 5000, f"x = {'9' * 5000}", 'title = "\udcff"'])
def test_a_sensor_file_that_is_no_toml_is_refused(tmp_path, text):
    path = tmp_path / "own.toml"
    path.write_text(text, encoding="utf-8", errors="surrogateescape")
    with pytest.raises(ConfigError, check=coded("sensors.no-toml")):
        load_sensor(path)


@pytest.mark.parametrize("figure", ["9" * 400, "1e200", "inf", "-1"])
def test_a_figure_of_a_sensor_that_is_no_number_is_refused(tmp_path, figure):
    text = (FOLDER / "mpu-6050.toml").read_text(encoding="utf-8")
    path = tmp_path / "own.toml"
    path.write_text(text.replace("value = ", f"value = {figure} # ", 1), encoding="utf-8")
    with pytest.raises(ConfigError):
        load_sensor(path)


@pytest.mark.parametrize(
    "change",
    [("coefficient = 0.15", f"coefficient = {'9' * 400}"), ('"mph"', '"mph"\ntransform = ["log"]')],
)
def test_a_coefficient_of_a_severity_model_that_is_no_number_is_refused(tmp_path, change):
    from tests.unit.crash.test_severity import FILE

    path = tmp_path / "own.toml"
    path.write_text(FILE.replace(*change), encoding="utf-8")
    with pytest.raises(ConfigError):
        load_severity_model(path)


# --- ASL, RTKLIB ------------------------------------------------------------------------

POSE = ", ".join(
    ["#timestamp", *(f"p_RS_R_{a} [m]" for a in "xyz"), *(f"q_RS_{a} []" for a in "wxyz")]
)
RATES = [f"w_RS_S_{a} [rad s^-1]" for a in "xyz"]
SENSOR = ",".join(["#timestamp [ns]", *RATES, *(f"a_RS_S_{a} [m s^-2]" for a in "xyz")])


def asl(folder, poses, rows, *, sensor=SENSOR):
    for name, head, body in (("imu0", sensor, rows), ("state_groundtruth_estimate0", POSE, poses)):
        place = folder / "mav0" / name
        place.mkdir(parents=True)
        table(place / "data.csv", body, head)
    return folder / "mav0"


def test_names_over_rows_without_numbers(tmp_path):
    poses = [[f"{k}x 2", 0, 0, 0, "0.8 5", "0.1 1", "0.1 7", "0.4 1"] for k in range(9)]
    rows = [[f"14{k}e6e", *["0.1e1e"] * 6] for k in range(9)]
    folder = asl(tmp_path, poses, rows)
    for path in (folder, folder / "imu0" / "data.csv"):
        with pytest.raises(DataError) as refused:
            sd.read_imu(path)
        assert refused.value.finding.code != "io.not-of-format"


def test_poses_that_are_not_in_order_are_left_out(tmp_path):
    stamps = [3, 1, 2, 4, 5, 6, 7, 8, 9, 10]
    poses = [[s * 10_000_000, 0, 0, 0, 1, 0, 0, 0] for s in stamps]
    rows = [[s * 10_000_000, 0, 0, 0, 0, 0, 9.8] for s in range(1, 11)]
    assert len(sd.read_imu(asl(tmp_path, poses, rows))) == 10


@pytest.mark.parametrize(
    ("old", "new"), [("50.1", "5٠.1"), (" 1 9", " ٠ 9"), ("2024/01", "2024/13"), ("2024", "1e300")]
)
def test_a_solution_with_digits_of_another_script_or_no_date(tmp_path, old, new):
    text = (
        "%  GPST latitude(deg) longitude(deg) height(m) Q ns sdn(m) sde(m) sdu(m)\n"
        "2024/01/15 03:04:05.250 50.1 30.2 120.0 1 9 0.01 0.01 0.02\n"
        "2024/01/15 03:04:05.500 50.1 30.2 120.0 1 9 0.01 0.01 0.02\n"
    )
    path = tmp_path / "rover.pos"
    path.write_text(text, encoding="utf-8")
    assert len(sd.read_gnss(path)) == 2
    path.write_text(text.replace(old, new), encoding="utf-8")
    with limits(), pytest.raises(DataError) as refused:
        sd.read_gnss(path)
    assert refused.value.finding.code != "io.not-of-format"


# --- the corpus that version 0.1 did not survive ------------------------------------------


def sensor(path):
    load_sensor(path)


def crash(path):
    for channel in sd.read_crash_record(path).channels:
        channel.load()


def repaired(path):
    sd.read_imu(path, repair=True)


READERS = (sd.read_imu, repaired, sd.read_gnss, sd.read_trajectory, sd.read, sd.doctor, crash)
#: Of the corpus what our own parsers read; binary files are read in a process of their own.
TEXTS = [
    "0ddb16",
    "7037bd",
    "82b960",
    "aa55fa",
    "ae7380",
    "c9b115",
    "e60740",
    "huge-rate",
    "1457c3",
]
TOMLS = ("10d0ed", "3191ed", "8343ca", "e3be7d", "d664c1")


def used(path, *readers):
    for read in readers:
        with limits():
            try:
                read(path)
            except StrapdownError as error:
                assert error.finding.code != "io.not-of-format", (path, error)
                assert error.finding.what


@pytest.mark.parametrize("name", TEXTS)
def test_hostile_text(name):
    if not HOSTILE.is_dir():
        pytest.skip("no corpus of hostile files beside the recordings")
    folder = HOSTILE / name
    files = [p for p in sorted(folder.rglob("*")) if p.is_file()]
    folders = [p for p in (folder, *sorted(folder.rglob("*"))) if p.is_dir()]
    for path in [*files, *(folders if len(files) > 1 else [])]:
        used(path, *READERS)


@pytest.mark.parametrize("name", TOMLS)
def test_hostile_toml(name):
    from strapdown.config.navigation import NavigationSpec

    if not HOSTILE.is_dir():
        pytest.skip("no corpus of hostile files beside the recordings")
    (file,) = (HOSTILE / name).iterdir()
    used(file, sensor, NavigationSpec.read)
