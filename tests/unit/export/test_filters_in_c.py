"""Orientation filters as C files, compiled and run beside the kernels from which they were made."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from tests.coded import coded
from tests.unit.export.test_algorithms_in_c import WARNINGS, build, needs_compiler, run

import strapdown as sd
from strapdown import rotation
from strapdown._kernels import arithmetic, orientation
from strapdown.errors import ConfigError, DataError
from strapdown.export import Channel, SensorConfiguration, export_c
from strapdown.export.filters import filter_motion, options_of, states_deviation
from strapdown.orientation_filters import FILTERS, make_filter, run_filter
from strapdown.orientation_filters.filter import euler_sd
from strapdown.report.attitude_export import write_export
from strapdown.tables import ACCEL, GYRO, MAG, imu_table

VARIANTS = ["error-state", "complementary", "error-state:velocity=10,noise=0.1,declination=3.1"]
START = rotation.quaternion_from_euler([20.0, -35.0, 250.0])

# Prints, for each sample: what `attitude_update` returned, the record, quaternion, angles, bias.
HARNESS = """
#include <stdio.h>
int main(void)
{
    struct attitude a;
    const int size = (int)(sizeof a.record / sizeof a.record[0]);
    double v[10];
    attitude_init(&a, 0);
    for (;;) {
        for (int i = 0; i < COLUMNS; i++) {
            if (scanf("%lf", v + i) != 1) {
                return i != 0;
            }
        }
        const real_t gyro[3] = {R(v[1]), R(v[2]), R(v[3])};
        const real_t accel[3] = {R(v[4]), R(v[5]), R(v[6])};
        real_t q[4], euler[3];
#if COLUMNS > 7
        const real_t mag[3] = {R(v[7]), R(v[8]), R(v[9])};
        printf("%d", attitude_update(&a, R(v[0]), gyro, accel, v[7] < 1e29 ? mag : 0));
#else
        printf("%d", attitude_update(&a, R(v[0]), gyro, v[4] < 1e29 ? accel : 0));
#endif
        attitude_quaternion(&a, q);
        attitude_euler(&a, euler);
        for (int i = 0; i < size; i++) {
            printf(" %a", (double)a.record[i]);
        }
        for (int i = 0; i < 7; i++) {
            printf(" %a", (double)(i < 4 ? q[i] : euler[i - 4]));
        }
#ifdef WITH_SD
        attitude_euler_sd(&a, euler);
        printf(" %a %a %a", (double)euler[0], (double)euler[1], (double)euler[2]);
#endif
        printf("\\n");
    }
}
"""


def log(magnetometer: bool) -> np.ndarray:
    """The motion of the test vector three times, in numbers of single precision, with noise."""
    rng = np.random.default_rng(9)
    rows = np.vstack([filter_motion(True)] * 3)
    rows[:, 1:4] += rng.normal(0.0, 0.002, (len(rows), 3))
    rows[:, 4:7] += rng.normal(0.0, 0.03, (len(rows), 3))
    rows[:, 7:] += rng.normal(0.0, 0.2, (len(rows), 3))
    return rows[:, : 10 if magnetometer else 7].astype(np.float32).astype(np.float64)


def lines(rows: np.ndarray) -> str:
    return "\n".join(" ".join(repr(float(v)) for v in row) for row in rows)


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("magnetometer", [False, True])
@pytest.mark.parametrize("variant", VARIANTS)
def test_it_gives_the_bits_of_the_kernel(tmp_path, variant, magnetometer, single, sampling):
    chosen = make_filter(variant)
    text = export_c(chosen, magnetometer=magnetometer, sampling=sampling)
    rows = log(magnetometer)
    flags = [f"-DREAL={'float' if single else 'double'}", f"-DCOLUMNS={rows.shape[1]}"]
    flags += ["-DWITH_SD"] if states_deviation(chosen) else []
    found = run(build(tmp_path, text + HARNESS, *flags), lines(rows))
    table = np.array([[float.fromhex(v) for v in line.split()] for line in found.splitlines()])
    number = np.float32 if single else np.float64
    module = arithmetic.single_precision("orientation") if single else orientation
    advance = getattr(module, type(chosen).advance_kernel.__name__)
    record = chosen.begin(None, sampling).astype(number)
    # The file has the options as constants, and counts no time.
    left_out = [getattr(orientation, name) for name in options_of(chosen, sampling)]
    seen = np.setdiff1d(np.arange(chosen.size), [*left_out, orientation.TIME])
    assert table.shape[0] == len(rows)
    for row, got in zip(rows, table, strict=True):
        parts = [np.ascontiguousarray(row[k : k + 3][None], number) for k in (1, 4, 7)]
        parts[2] = parts[2].reshape(-1, 3)
        advance(record, row[:1].astype(number), *parts, np.empty((1, chosen.row), number))
        assert got[0] == 0.0
        np.testing.assert_array_equal(got[1:][seen], record[seen].astype(np.float64))
        q = chosen.attitudes(record[None, orientation.Q : orientation.Q + 4], record)
        eps = float(np.finfo(number).eps)
        q_c = got[chosen.size + 1 : chosen.size + 5]
        assert np.abs(q_c - q[0]).max() < 4 * eps
        angles = np.radians(rotation.euler_from_quaternion(q_c / np.linalg.norm(q_c)))
        apart = np.abs(got[chosen.size + 5 : chosen.size + 8] - angles)
        assert np.minimum(apart, 2 * np.pi - apart).max() < 32 * eps / abs(np.cos(angles[1]))
        if states_deviation(chosen):
            exact = record.astype(np.float64)
            p = chosen.covariance(chosen.row_of(exact)[None, :], exact)
            expected = np.radians(euler_sd(q, p))[0]
            assert got[-3:] == pytest.approx(expected, rel=0.0, abs=1e4 * eps)


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("real", ["float", "double"])
@pytest.mark.parametrize("magnetometer", [False, True])
@pytest.mark.parametrize("name", FILTERS)
def test_its_own_test_passes_from_none_and_from_an_attitude(tmp_path, name, magnetometer, real):
    for start in (None, START):
        text = export_c(make_filter(name), magnetometer=magnetometer, q_nb=start)
        assert max(map(len, text.splitlines())) <= 100
        program = build(tmp_path, text, f"-DREAL={real}", "-DATTITUDE_TEST")
        assert run(program).endswith("passed\n")


@needs_compiler
@pytest.mark.parametrize(
    ("name", "right", "wrong"),
    [
        ("complementary", "#define START_TIME R(0.2)", "#define START_TIME R(0.3)"),
        ("complementary", "ATAN2(-ay, -az)", "ATAN2(ay, -az)"),
        ("error-state", "#define FIELD_SD R(0.02)", "#define FIELD_SD R(0.03)"),
        ("error-state", "#define RELEVEL R(0.3)", "#define RELEVEL R(3.0)"),
        ("error-state", "#define REST_VELOCITY R(0.01)", "#define REST_VELOCITY R(0.02)"),
    ],
)
def test_its_own_test_can_fail(tmp_path, name, right, wrong):
    text = export_c(make_filter(name))
    assert right in text
    # A wrong constant of the model is small beside the rounding of single precision.
    flags = [
        "-O0",
        "-DATTITUDE_TEST",
        *(["-DREAL=double"] if right.startswith(("#", "r[")) else []),
    ]
    program = build(tmp_path, text.replace(right, wrong, 1), *flags)
    assert subprocess.run([program], capture_output=True, check=False).returncode == 1


@pytest.mark.skipif(shutil.which("g++") is None, reason="no C++ compiler: install g++")
@pytest.mark.parametrize("name", FILTERS)
def test_it_is_cplusplus_too(tmp_path, name):
    (tmp_path / "attitude.cpp").write_text(export_c(make_filter(name), configuration=SENSORS))
    flags = [f for f in WARNINGS if f not in ("-std=c99", "-Wmissing-prototypes")]
    command = ["g++", "-std=c++11", *flags, "-DATTITUDE_TEST", "attitude.cpp", "-o", "attitude"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert run(tmp_path / "attitude").endswith("passed\n")


#: Sensors with units, axes and biases of their own, and a magnetometer with a soft iron.
SENSORS = SensorConfiguration(
    50.0,
    Channel("mdeg/s", np.pi / 180e3, (1, 0, 2), (1.0, 1.0, -1.0), (0.01, -0.02, 0.0)),
    Channel("mg", 9.80665e-3, (1, 0, 2), (1.0, 1.0, -1.0), (0.1, 0.0, -0.2)),
    Channel(
        "counts",
        1.0,
        (0, 1, 2),
        (1.0, -1.0, -1.0),
        (12.0, -30.0, 4.0),
        ((1.1, 0.02, 0.0), (0.02, 0.95, -0.01), (0.0, -0.01, 1.03)),
    ),
)


def body_and_raw():
    """Numbers of the body at 50 Hz and the readings of `SENSORS`, both as far as they are known."""
    rows = log(True)[:, 1:]
    rows[:, 6:] *= 8.0
    raw = np.hstack(
        [
            getattr(SENSORS, name).raw(rows[:, 3 * k : 3 * k + 3])
            for k, name in enumerate(("gyro", "accel", "mag"))
        ]
    )
    return rows, raw


def test_a_channel_and_its_inverse():
    rows, raw = body_and_raw()
    for k, name in enumerate(("gyro", "accel", "mag")):
        part = slice(3 * k, 3 * k + 3)
        back = getattr(SENSORS, name).body(raw[:, part])
        np.testing.assert_allclose(back, rows[:, part], rtol=1e-12, atol=1e-12)
    # By hand: forward is y of the sensor, 1000 mdeg/s of it 1 deg/s, less the bias.
    one = SENSORS.gyro.body(np.array([[2000.0, 1000.0, 500.0]]))[0]
    assert one == pytest.approx([np.radians(1.0) - 0.01, np.radians(2.0) + 0.02, -np.radians(0.5)])
    field = SENSORS.mag.body(np.array([[112.0, 70.0, 46.0]]))[0]
    assert field == pytest.approx([110.0 - 0.8, 2.0 - 38.0 + 0.5, 0.4 - 51.5])


@needs_compiler
@pytest.mark.parametrize("magnetometer", [False, True])
@pytest.mark.parametrize("name", FILTERS)
def test_a_configured_file_takes_the_readings_of_the_sensors(tmp_path, name, magnetometer):
    chosen = make_filter(name)
    rows, raw = body_and_raw()
    columns = [*GYRO, *ACCEL, *(MAG if magnetometer else ())]
    count = len(columns)
    imu = imu_table(np.arange(len(rows)) / 50.0, rows[:, :3])
    imu[columns] = rows[:, :count]
    text = export_c(chosen, imu=imu, configuration=SENSORS)
    assert max(map(len, text.splitlines())) <= 100
    assert run(build(tmp_path, text, "-O0", "-DATTITUDE_TEST")).endswith("passed\n")
    program = build(tmp_path, text, "-O0", "-DREAL=double", "-DATTITUDE_FILTER")
    found = np.array([v.split() for v in run(program, lines(raw[:, :count])).splitlines()], float)
    # Stamps k / 50 differ from steps of 1 / 50 by rounding alone.
    expected = run_filter(chosen, imu).q_nb
    assert np.radians(rotation.rotation_angle(found, expected)).max() < 1e-9


@needs_compiler
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("ACCEL_UNIT * accel[1]", "ACCEL_UNIT * accel[0]"),
        ("-ACCEL_UNIT * accel[2]", "ACCEL_UNIT * accel[2]"),
        ("mag[0] - R(12.0)", "mag[0] + R(12.0)"),
        ("R(0.02) * (-mag[1]", "R(0.2) * (-mag[1]"),
    ],
)
def test_its_test_finds_a_wrong_configuration(tmp_path, right, wrong):
    rows, _ = body_and_raw()
    imu = imu_table(np.arange(len(rows)) / 50.0, rows[:, :3])
    imu[[*ACCEL, *MAG]] = rows[:, 3:]
    text = export_c(make_filter("error-state"), imu=imu, configuration=SENSORS)
    assert right in text
    program = build(tmp_path, text.replace(right, wrong, 1), "-O0", "-DATTITUDE_TEST")
    assert subprocess.run([program], capture_output=True, check=False).returncode == 1


@needs_compiler
@pytest.mark.parametrize("name", FILTERS)
def test_a_bad_sample_is_refused_and_changes_nothing(tmp_path, name):
    rows = log(True)[:12]
    bad = np.repeat(rows[:1], 6, axis=0)
    bad[:, 0] = [0.0, -1.0, np.nan, np.inf, 0.1, 0.1]
    bad[4, 1], bad[5, 3] = np.nan, np.inf
    text = export_c(make_filter(name)) + HARNESS
    program = build(tmp_path, text, "-DCOLUMNS=10")
    mixed = run(program, lines(np.vstack([rows[:5], bad, rows[5:]]))).splitlines()
    assert [line.split()[0] for line in mixed] == ["0"] * 5 + ["1"] * 6 + ["0"] * 7
    good = run(program, lines(rows)).splitlines()
    assert [m for m in mixed if m.startswith("0")] == good


def test_options_are_constants_and_what_is_not_of_use_is_left_out():
    text = export_c(make_filter("complementary:tilt=2.5"), magnetometer=False)
    assert "FMIN(R(2.5), START_TIME" in text
    for absent in ("*mag", "mag[", "HEADED", "TILT_TIME"):
        assert absent not in text
    small, large = (
        len(export_c(make_filter("error-state"), magnetometer=m).partition("ATTITUDE_TEST\n")[0])
        for m in (False, True)
    )
    assert small < 0.9 * large


def test_what_a_filter_cannot_take_is_named():
    chosen = make_filter("error-state")
    with pytest.raises(ConfigError, check=coded("attitude.filter-takes-linear", name=chosen.name)):
        export_c(chosen, interpolation="cubic")
    with pytest.raises(ConfigError, match="meen"):
        export_c(chosen, sampling="meen")
    imu = imu_table(np.arange(60) / 50.0, np.zeros((60, 3)))
    with pytest.raises(DataError, check=coded("attitude.filter-needs-accelerometer")):
        export_c(chosen, imu=imu)


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("name", ["error-state", "complementary:tilt=2"])
def test_file_of_a_comparison_is_its_configuration(tmp_path, name):
    """The log's own columns through the exported file: units, axes, gyro bias and iron."""
    rng = np.random.default_rng(5)
    t = np.arange(6000) / 100.0
    moving = np.clip(t - 3.0, 0.0, 1.0)[:, None]
    rate = moving * np.column_stack([np.sin(0.7 * t), np.cos(0.9 * t), 1.2 * np.sin(0.4 * t)])
    turns = rotation.quaternion_from_rotation_vector((rate[1:] + rate[:-1]) / 200.0)
    q = [np.array([1.0, 0.0, 0.0, 0.0])]
    for turn in turns:
        q.append(rotation.compose(q[-1], turn))
    back = rotation.conjugate(np.array(q))
    force = rotation.rotate(back, np.array([0.0, 0.0, -9.80665]))
    field = rotation.rotate(back, np.array([20.0, 0.0, 44.0])) + np.array([6.0, -4.0, 9.0])
    sensed = [np.degrees(rate + np.array([0.01, -0.02, 0.005])), force / 9.80665, field / 100.0]
    noise = (0.01, 0.001, 0.001)
    raw = np.hstack([v[:, [1, 0, 2]] * [1, 1, -1] for v in sensed])
    raw += rng.normal(0.0, 1.0, raw.shape) * np.repeat(noise, 3)
    raw = np.round(raw, 7)
    units = (("gyro", "deg_s"), ("accel", "g"), ("mag", "gauss"))
    names = ",".join(f"{s}_{axis}_{unit}" for s, unit in units for axis in "xyz")
    body = "\n".join(
        f"{a:.2f}," + ",".join(f"{v:.7f}" for v in row) for a, row in zip(t, raw, strict=True)
    )
    text = f"# axes: right-forward-up\ntime_s,{names}\n{body}\n"
    (tmp_path / "log.csv").write_text(text)
    bench = sd.compare_attitude(tmp_path / "log.csv", ["quaternion"], rates_hz=[50.0])
    assert bench.magnetometer["hard_iron"] == pytest.approx([6.0, -4.0, 9.0], abs=0.2)
    for suffix in (".c", ".py"):
        write_export(bench, tmp_path / f"attitude{suffix}", name)
    exported = (tmp_path / "attitude.c").read_text(encoding="utf-8")
    assert run(build(tmp_path, exported, "-DATTITUDE_TEST")).endswith("passed\n")
    program = build(tmp_path, exported, "-DATTITUDE_FILTER", "-DREAL=double")
    found = np.array([v.split() for v in run(program, lines(raw)).splitlines()], dtype=float)
    imu = bench.imu.copy()
    imu[MAG] = (imu[MAG] - bench.magnetometer["hard_iron"]) @ np.array(
        bench.magnetometer["soft_iron"]
    )
    chosen = make_filter(name).with_heading(0.0, bench.magnetometer["heading_sd_deg"])
    expected = run_filter(chosen, imu).q_nb
    # Stamps and what is measured of them differ by the digits of stamps of 10 ms.
    assert np.radians(rotation.rotation_angle(found, expected)).max() < 1e-9
    assert rotation.rotation_angle(found, q).max() < 5.0
    # The vector of the test is of the log's own readings.
    first = next(line for line in exported.splitlines() if line.startswith("    {"))
    numbers = [float(v) for v in re.findall(r"-?[0-9.]+(?:e-?\d+)?", first)]
    assert np.abs(raw[:, : len(numbers[:3])] - numbers[:3]).max(axis=1).min() < 1e-5
    done = subprocess.run([sys.executable, tmp_path / "attitude.py"], check=False)
    assert done.returncode == 0
