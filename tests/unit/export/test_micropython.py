"""Algorithms and filters as files for MicroPython, run beside the kernels they were made from."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys

import numpy as np
import pytest
from tests.unit.export.test_algorithms_in_c import KINDS, SENSOR, START, VARIANTS
from tests.unit.export.test_filters_in_c import SENSORS, body_and_raw, log

from strapdown import rotation
from strapdown._kernels.arithmetic import _InSingle
from strapdown.attitude_algorithms import make_algorithm, run_attitude
from strapdown.export import export_micropython
from strapdown.increments import increments_from_imu
from strapdown.orientation_filters import FILTERS, make_filter, run_filter
from strapdown.tables import ACCEL, GYRO, MAG, QUATERNION, imu_table

MICROPYTHON = shutil.which("micropython")


def module(text: str, single: bool = False) -> dict:
    """Names of the file, as after an import; in single precision where it is asked for."""
    names: dict = {"__name__": "attitude", "_np": np}
    tree = ast.parse(text)
    if single:
        tree = ast.fix_missing_locations(_InSingle().visit(tree))
    exec(compile(tree, "attitude.py", "exec"), names)
    return names


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("variant", VARIANTS)
def test_the_test_of_an_algorithm_passes(variant, kind, capsys):
    algorithm = make_algorithm(variant)
    for sensor in (None, SENSOR):
        text = export_micropython(algorithm, **KINDS[kind], q_nb=START, configuration=sensor)
        assert module(text)["test"]()
        assert capsys.readouterr().out.endswith("passed\n")


@pytest.mark.parametrize("magnetometer", [False, True])
@pytest.mark.parametrize("variant", [*FILTERS, "complementary:declination=-7"])
def test_the_test_of_a_filter_passes(variant, magnetometer, capsys):
    for start in (None, START):
        text = export_micropython(make_filter(variant), magnetometer=magnetometer, q_nb=start)
        assert module(text)["test"]()
        assert capsys.readouterr().out.endswith("passed\n")


@pytest.mark.parametrize("name", ["quaternion", "dcm", "rotvec", *FILTERS])
def test_its_bound_allows_single_precision(name, capsys):
    made = make_filter(name) if name in FILTERS else make_algorithm(name)
    names = module(export_micropython(made), single=True)
    with np.errstate(over="ignore"):  # LARGEST, which is infinite there
        assert names["test"]()
    largest = float(capsys.readouterr().out.split()[2])
    assert 1e-8 < largest < 1e-4


def shown(program: str, file) -> subprocess.CompletedProcess:
    return subprocess.run([program, str(file)], capture_output=True, text=True, check=False)


@pytest.mark.parametrize("program", [sys.executable, MICROPYTHON])
@pytest.mark.parametrize("name", ["quaternion", "rotvec", *FILTERS])
def test_run_as_a_program(tmp_path, name, program):
    if program is None:
        pytest.skip("no micropython")
    made = make_filter(name) if name in FILTERS else make_algorithm(name)
    file = tmp_path / "attitude.py"
    file.write_text(export_micropython(made), encoding="utf-8")
    done = shown(program, file)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("largest difference ")
    assert done.stdout.endswith(" passed\n")


@pytest.mark.parametrize(
    ("name", "right", "wrong"),
    [
        ("quaternion", "0.5 * (w0 + w1)", "0.6 * (w0 + w1)"),
        ("complementary", "START_TIME = 0.2", "START_TIME = 0.21"),
        ("error-state", "FIELD_SD = 0.02", "FIELD_SD = 0.03"),
        ("error-state", "r[POWER] = 0.25", "r[POWER] = 0.3"),
        ("error-state", "return quat_normalise(w, x, y, z)", "return (math.nan,) * 4"),
    ],
)
def test_its_test_can_fail(tmp_path, name, right, wrong):
    made = make_filter(name) if name in FILTERS else make_algorithm(name)
    text = export_micropython(made)
    assert right in text
    file = tmp_path / "attitude.py"
    file.write_text(text.replace(right, wrong, 1), encoding="utf-8")
    done = shown(sys.executable, file)
    assert done.returncode == 1
    assert done.stdout.endswith("FAILED\n")


def test_it_imports_math_alone_and_has_no_decorated_kernel():
    for name in ("rotvec:samples=4", "euler:step=rk4", *FILTERS):
        made = make_filter(name) if name in FILTERS else make_algorithm(name)
        tree = ast.parse(export_micropython(made))
        imports = [n for n in ast.walk(tree) if isinstance(n, ast.Import | ast.ImportFrom)]
        assert [ast.unparse(n) for n in imports] == ["import math"]
        free = [n for n in tree.body if isinstance(n, ast.FunctionDef)]
        assert not any(n.decorator_list for n in free)
        # Functions that MicroPython's math lacks.
        assert not {n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute)} & {"hypot"}


@pytest.mark.parametrize("kind", ["linear", "mean"])
def test_raw_readings_through_an_algorithm(kind):
    rows, raw = body_and_raw()
    sampling = KINDS[kind].get("sampling", "instantaneous")
    imu = imu_table(np.arange(len(rows)) / 50.0, rows[:, :3], sampling=sampling)
    algorithm = make_algorithm("quaternion")
    text = export_micropython(algorithm, sampling=sampling, configuration=SENSORS)
    device = module(text)["Attitude"](START)
    found = []
    for row in raw:
        assert device.sample(tuple(row[:3])) is True
        found.append(device.quaternion)
    start = START
    if kind == "mean":  # a mean over the step before the first stamp, which the table does not have
        start = np.array(found[0])
    steps = increments_from_imu(imu)
    expected = run_attitude(algorithm, steps, start).attitude[QUATERNION].to_numpy()
    assert np.radians(rotation.rotation_angle(np.array(found), expected)).max() < 1e-11


@pytest.mark.parametrize("magnetometer", [False, True])
@pytest.mark.parametrize("name", ["error-state:declination=3", "complementary"])
def test_raw_readings_through_a_filter(name, magnetometer):
    chosen = make_filter(name)
    rows, raw = body_and_raw()
    columns = [*GYRO, *ACCEL, *(MAG if magnetometer else ())]
    imu = imu_table(np.arange(len(rows)) / 50.0, rows[:, :3])
    imu[columns] = rows[:, : len(columns)]
    device = module(export_micropython(chosen, imu=imu, configuration=SENSORS))["Attitude"]()
    run = run_filter(chosen, imu)
    sd = run.euler_sd()
    found = []
    for k, row in enumerate(raw):
        parts = [None if np.isnan(row[i]) else row[i : i + 3] for i in range(0, len(columns), 3)]
        assert device.sample(*parts)
        found.append(device.quaternion)
        angles = rotation.euler_from_quaternion(np.array(device.quaternion))
        assert device.roll_pitch_heading == pytest.approx(angles, abs=1e-9)
        if sd is not None:
            assert device.roll_pitch_heading_sd == pytest.approx(sd[k], rel=1e-6)
    assert np.radians(rotation.rotation_angle(np.array(found), run.q_nb)).max() < 1e-9
    assert device.gyro_bias == pytest.approx(run.bias, abs=1e-9)


def test_a_bad_sample_is_refused_and_changes_nothing():
    for name in ("quaternion", *FILTERS):
        made = make_filter(name) if name in FILTERS else make_algorithm(name)
        device = module(export_micropython(made))["Attitude"]()
        for row in log(False)[:5]:
            more = () if name == "quaternion" else (tuple(row[4:7]),)
            assert device.update(row[0], tuple(row[1:4]), *more)
        before = dict(vars(device))
        before = {key: list(value) for key, value in before.items()}
        for dt, gyro in ((0.0, (1, 2, 3)), (-1.0, (1, 2, 3)), (float("nan"), (1, 2, 3))):
            assert device.update(dt, gyro) is False
        assert device.update(0.1, (1.0, float("nan"), 0.0)) is False
        assert {key: list(value) for key, value in vars(device).items()} == before
