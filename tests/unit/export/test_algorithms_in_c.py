"""The C file, compiled and run beside the kernels from which it was made."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

import strapdown as sd
from strapdown import rotation
from strapdown._kernels import arithmetic
from strapdown.attitude_algorithms import ALGORITHMS, make_algorithm, run_attitude
from strapdown.attitude_algorithms.cost import count_cost
from strapdown.errors import ConfigError, DataError
from strapdown.export import Channel, SensorConfiguration, export_c
from strapdown.export.algorithms import SHAPES
from strapdown.export.device import device_translator
from strapdown.export.kernels import Kernels
from strapdown.export.translate import UntranslatableError
from strapdown.increments import increments_from_imu
from strapdown.report.attitude_export import write_export
from strapdown.tables import GYRO, QUATERNION, imu_table, increments_table

# Those of the contracts: a new algorithm is in the subset, or the contract is not yet kept.
CONTRACTS = Path(__file__).parents[2] / "contracts" / "test_attitude_algorithms.py"
VARIANTS = next(
    [*ALGORITHMS, *(item.value for item in node.value.elts if isinstance(item, ast.Constant))]
    for node in ast.parse(CONTRACTS.read_text(encoding="utf-8")).body
    if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "VARIANTS"
)
KINDS = {"linear": {}, "cubic": {"interpolation": "cubic"}, "mean": {"sampling": "mean"}}
START = rotation.quaternion_from_euler([20.0, -35.0, 250.0])
WARNINGS = [
    *("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion"),
    *("-Wshadow", "-Wmissing-prototypes", "-Werror"),
]
COMPILER = shutil.which("cc") or shutil.which("gcc")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler: install gcc or clang")

# Prints, for each sample: what `attitude_update` returned, the state, quaternion and angles.
HARNESS = """
#include <stdio.h>
int main(void)
{
    struct attitude a;
    const real_t level[4] = {R(1.0), R(0.0), R(0.0), R(0.0)};
    const int size = (int)(sizeof a.state / sizeof a.state[0]);
    double v[4];
    attitude_init(&a, level);
    printf("%d\\n", (int)sizeof a);
    for (int i = 0; i < size; i++) {
        if (scanf("%la", v) != 1) {
            return 2;
        }
        a.state[i] = R(v[0]);
    }
    while (scanf("%la %la %la %la", v, v + 1, v + 2, v + 3) == 4) {
        const real_t gyro[3] = {R(v[1]), R(v[2]), R(v[3])};
        real_t q[4], euler[3];
        printf("%d", attitude_update(&a, R(v[0]), gyro));
        attitude_quaternion(&a, q);
        attitude_euler(&a, euler);
        for (int i = 0; i < size + 7; i++) {
            const real_t read = i < size + 4 ? q[i < size ? 0 : i - size] : euler[i - size - 4];
            printf(" %a", (double)(i < size ? a.state[i] : read));
        }
        printf("\\n");
    }
    return 0;
}
"""


def build(folder: Path, text: str, *options: str) -> Path:
    source, program = folder / "attitude.c", folder / "attitude"
    source.write_text(text, encoding="utf-8")
    # No fused products, which round once where Python rounds twice.
    flags = [*WARNINGS, "-O2", "-ffp-contract=off", *options]
    done = subprocess.run(
        [str(COMPILER), *flags, str(source), "-o", str(program), "-lm"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return program


def run(program: Path, given: str = "") -> str:
    done = subprocess.run([program], input=given, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def state_size(text: str) -> int:
    found = re.search(r"real_t state\[(\d+)\]", text)
    assert found
    return int(found[1])


def through_harness(folder: Path, variant: str, rows: np.ndarray, single: bool):
    """Codes, states, quaternions and angles that the C file finds for rows of dt and rates."""
    algorithm = make_algorithm(variant)
    text = export_c(algorithm)
    size = state_size(text)
    start = algorithm.begin(START)[:size]
    numbers = [*start, *rows.ravel()]
    program = build(folder, text + HARNESS, f"-DREAL={'float' if single else 'double'}")
    head, *lines = run(program, "\n".join(float(v).hex() for v in numbers)).splitlines()
    found = [[float.fromhex(v) for v in line.split()] for line in lines]
    table = np.array(found)
    assert table.shape == (len(rows), size + 8)
    return (
        int(head),
        table[:, 0],
        table[:, 1 : size + 1],
        table[:, size + 1 : size + 5],
        table[:, -3:],
    )


def log(samples: int = 300, longest: float = 0.02):
    """Irregular steps; every number is one of single precision, so that both runs read the same."""
    rng = np.random.default_rng(8)
    dt = rng.choice([0.0009765625, 0.00390625, longest], samples)
    dt[: samples // 2] = longest / 2  # equal steps are another path of the rotation vector
    rates = np.cumsum(rng.normal(0.0, 0.3, (samples, 3)), axis=0)
    rates -= np.linspace(0, 1, samples)[:, None] * rates[-1]
    return np.column_stack([dt, rates]).astype(np.float32).astype(np.float64)


def by_kernels(variant: str, rows: np.ndarray, single: bool):
    """The state after every sample by the kernels, in either precision."""
    algorithm = make_algorithm(variant)
    kind = np.float32 if single else np.float64
    home = arithmetic.kernel_home(algorithm.advance_kernel)
    if single:
        kernel, increments = map(arithmetic.single_precision, (home, "increments"))
    else:
        kernel, increments = (
            importlib.import_module(f"strapdown._kernels.{n}") for n in (home, "increments")
        )
    dt, rate = rows[1:, 0].astype(kind), np.ascontiguousarray(rows[:, 1:]).astype(kind)
    theta = np.empty((len(dt), 3), kind)
    dtheta = np.empty_like(theta)
    increments.increments(np.ascontiguousarray(dt), rate, False, theta, dtheta)
    state = algorithm.begin(START).astype(kind)
    history = np.empty((len(dt), algorithm.width), kind)
    advance = getattr(kernel, type(algorithm).advance_kernel.__name__)
    options = [kind(v) for v in algorithm.kernel_options()]
    first = state[None, : algorithm.width].copy()
    advance(state, np.ascontiguousarray(dt), theta, dtheta, history, *options)
    return np.vstack([first, history])


def test_the_variants_cover_the_table():
    assert {v.partition(":")[0] for v in VARIANTS} == set(ALGORITHMS) == set(SHAPES)


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("variant", VARIANTS)
def test_it_gives_the_bits_of_the_kernels(tmp_path, variant, precision):
    """Steps below 0.5 rad use no function but the square root, which IEEE 754 rounds exactly."""
    single = precision == "single"
    rows, algorithm = log(), make_algorithm(variant)
    found = through_harness(tmp_path, variant, rows, single)
    expected = by_kernels(variant, rows, single)
    size, codes, states, quaternions, angles = found
    assert not codes.any()
    eps = np.finfo(np.float32 if single else np.float64).eps
    if algorithm.name == "euler":
        # Sines of another library may be an ulp off: in each of 300 steps six of them, magnified
        # by 1/cos(pitch), which stays below 4 here.
        assert np.abs(states[:, :3] - expected).max() < 300 * 6 * 4 * eps
    else:
        assert np.array_equal(states[:, : algorithm.width], expected)
    # Reading: a norm, or a matrix, or half angles: a dozen roundings each.
    q = algorithm.quaternions(states[:, : algorithm.width].copy())
    apart = np.minimum(np.abs(quaternions - q).max(axis=1), np.abs(quaternions + q).max(axis=1))
    # What was truncated is read by Newton's steps and by singular values: a matrix whose
    # singular values differ by a factor of 2 makes an error of rounding as much larger.
    assert apart.max() < 24 * eps
    turned = np.radians(rotation.euler_from_quaternion(quaternions))
    turned[:, 2] = np.remainder(turned[:, 2] + np.pi, 2 * np.pi) - np.pi
    differences = np.remainder(angles - turned + np.pi, 2 * np.pi) - np.pi
    # The half sums are of components of cos and sin of half (90 deg - |pitch|).
    cosine = np.cos(turned[:, 1]).min()
    assert np.abs(differences).max() < 16 * eps / cosine
    if single:
        head = re.search(r"(\d+)[\s*]+bytes", export_c(algorithm))
        assert head and int(head[1]) == size


@needs_compiler
@pytest.mark.parametrize(
    "variant",
    ["dcm", "quaternion", "rotvec", "rotvec:samples=1", "rotvec:samples=1,previous=yes"],
)
def test_large_turns_take_sine_and_cosine(tmp_path, variant):
    rows = log(100, longest=0.5)
    assert (np.linalg.norm(rows[:, 1:], axis=1) * rows[:, 0]).max() > 0.5
    *_, states, _, _ = through_harness(tmp_path, variant, rows, single=False)
    expected = by_kernels(variant, rows, single=False)
    # Each step may have sine and cosine an ulp off, and a product of four terms carries it on.
    tolerance = len(rows) * 8 * np.finfo(np.float64).eps
    assert np.abs(states[:, : expected.shape[1]] - expected).max() < tolerance


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize(
    ("variant", "kind", "precision"),
    [
        *((v, "linear", "float") for v in VARIANTS),
        *((v, k, "double") for v in ("naive", "rk4", "rotvec", "euler:step=rk4") for k in KINDS),
    ],
)
def test_its_own_test_passes(tmp_path, variant, kind, precision):
    text = export_c(make_algorithm(variant), **KINDS[kind], q_nb=START)
    assert max(map(len, text.splitlines())) <= 100
    out = run(build(tmp_path, text, "-O0", f"-DREAL={precision}", "-DATTITUDE_TEST"))
    assert out.rstrip().endswith("passed")


@needs_compiler
@pytest.mark.parametrize(
    ("variant", "right", "wrong"),
    [
        ("naive", "state[1] += ty", "state[1] -= ty"),
        ("euler", "R(0.5) * (w0 + w1)", "R(0.5000001) * (w0 + w1)"),
        ("euler:step=rk4", "/ R(6.0)", "/ R(6.00001)"),
        ("dcm", "R(1.0) / R(24.0)", "R(1.0) / R(25.0)"),
        ("dcm:orthogonalise_every=1", "R(1.5) -", "R(1.50001) -"),
        ("quaternion", "R(1.0) / R(120.0)", "R(1.0) / R(121.0)"),
        ("quaternion", "R(0.5) * SIN(x)", "R(0.50001) * SIN(x)"),
        ("quaternion:order=3,normalise=false", "k <= 3", "k <= 2"),
        ("rk4", "R(1.0) / R(6.0)", "R(1.0) / R(6.00001)"),
        ("rotvec", "R(2.0) / R(3.0)", "R(2.0) / R(3.00001)"),
        ("rotvec", "R(1.0) / R(240.0)", "R(1.0) / R(241.0)"),
    ],
)
def test_its_own_test_can_fail(tmp_path, variant, right, wrong):
    text = export_c(make_algorithm(variant))
    if right == "k <= 3":  # a range ends before its bound
        right, wrong = "k < 4", "k < 3"
    assert right in text
    wrong_text = text.replace(right, wrong)
    program = build(tmp_path, wrong_text, "-O0", "-DREAL=double", "-DATTITUDE_TEST")
    done = subprocess.run([program], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "FAILED" in done.stdout


@needs_compiler
@pytest.mark.parametrize("kind", KINDS)
def test_a_whole_log_through_its_filter(tmp_path, kind):
    rows = log(1000)
    time = 17.0 + np.cumsum(rows[:, 0])
    sampling = "mean" if kind == "mean" else "instantaneous"
    imu = imu_table(time, rows[:, 1:], sampling=sampling)
    algorithm = make_algorithm("rotvec")
    interpolation = "cubic" if kind == "cubic" else "linear"
    steps = increments_from_imu(imu, interpolation)
    expected = run_attitude(algorithm, steps, START).attitude[QUATERNION].to_numpy()
    lines = np.column_stack([np.diff(time, prepend=time[0]), imu[GYRO].to_numpy()])
    if kind == "mean":
        lines, expected = lines[1:], expected[1:]
    text = export_c(algorithm, **KINDS[kind], q_nb=START)
    program = build(tmp_path, text, "-DREAL=double", "-DATTITUDE_FILTER")
    given = "\n".join(" ".join(repr(float(v)) for v in row) for row in lines)
    found = np.array([line.split() for line in run(program, given).splitlines()], dtype=float)
    if kind == "cubic":
        found = found[1:]  # one sample late
    # The start is scaled once more than in Python: 2 eps, which every product carries on.
    assert np.abs(found - expected).max() < 8 * np.finfo(np.float64).eps


@needs_compiler
@pytest.mark.parametrize("variant", ["naive", "quaternion", "rotvec"])
def test_a_bad_sample_is_refused_and_changes_nothing(tmp_path, variant):
    good = [[0.0, 0.1, 0.2, 0.3], [0.1, 0.1, 0.2, 0.3]]
    bad = [
        [0.0, 0.1, 0.2, 0.3],
        [-0.1, 0.1, 0.2, 0.3],
        [np.nan, 0.1, 0.2, 0.3],
        [np.inf, 0.1, 0.2, 0.3],
        [0.1, np.nan, 0.2, 0.3],
        [0.1, 0.1, -np.inf, 0.3],
        [0.1, 0.1, 0.2, 1e19],
    ]
    rows = np.array([*good, *bad, [0.1, 0.4, 0.5, 0.6]])
    _, codes, states, *_ = through_harness(tmp_path, variant, rows, single=True)
    assert codes.tolist() == [0.0, 0.0, *[1.0] * len(bad), 0.0]
    assert (states[2 : 2 + len(bad)] == states[1]).all()
    # Nor was the rate remembered: the same without them ends on the same bits.
    _, _, clean, *_ = through_harness(tmp_path, variant, rows[[0, 1, -1]], single=True)
    assert np.array_equal(clean[-1], states[-1])
    assert not np.array_equal(states[-1], states[1])


@pytest.mark.skipif(shutil.which("g++") is None, reason="no C++ compiler: install g++")
@pytest.mark.parametrize("variant", ["dcm:order=3,orthogonalise_every=7", "rotvec:samples=4"])
def test_it_is_cplusplus_too(tmp_path, variant):
    text = export_c(make_algorithm(variant), interpolation="cubic")
    options = [
        "-x",
        "c++",
        "-std=c++11",
        "-pedantic",
        "-Wall",
        "-Wextra",
        "-Wconversion",
        "-Werror",
    ]
    source = tmp_path / "attitude.c"
    source.write_text(text)
    command = ["g++", *options, "-DATTITUDE_TEST", str(source), "-o", str(tmp_path / "a"), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert run(tmp_path / "a").rstrip().endswith("passed")


@needs_compiler
def test_the_first_samples_of_a_log_can_be_the_test(tmp_path):
    rows = log(60)
    imu = imu_table(17.0 + np.cumsum(rows[:, 0]), rows[:, 1:], sampling="mean")
    text = export_c(make_algorithm("quaternion"), imu=imu, q_nb=START)
    assert "mean rate" in text  # taken from the log
    assert "#define ROWS 47" in text  # the first mean began before the log
    for real in ("float", "double"):
        run(build(tmp_path, text, "-O0", f"-DREAL={real}", "-DATTITUDE_TEST"))


@pytest.mark.parametrize("variant", VARIANTS)
def test_it_is_short_alone_and_in_the_open(variant):
    text = export_c(make_algorithm(variant))
    code = text.partition("#ifdef ATTITUDE_TEST")[0]
    assert re.findall(r"#include <(\S+)>", code) == ["math.h"]
    assert "malloc" not in text
    # Between functions there are only those, the structure and macros: no variable is global.
    outside = re.sub(r"/\*.*?\*/|^#.*?$|\{.*?^\}", "", code, flags=re.S | re.M)
    assert not re.findall(r"=", outside)
    assert len(code.splitlines()) < 500
    assert make_algorithm(variant).label in text
    assert state_size(text) == count_cost(make_algorithm(variant)).memory


def test_the_same_every_time():
    algorithm = make_algorithm("rotvec:samples=3")
    assert export_c(algorithm) == export_c(algorithm)


def test_what_is_not_of_use_is_left_out():
    text = export_c(make_algorithm("rotvec:samples=4,coefficients=miller"))
    assert "polynomial_rate" not in text and "equal_steps" not in text
    text = export_c(make_algorithm("rotvec"))  # two increments: no formula for three
    assert "R(9.0) / R(20.0)" not in text and "k <= 2" not in text


def test_a_kernel_outside_the_subset_is_refused():
    kernels = Kernels("increments")
    kernels.require("increments")  # arrays of unknown size
    with pytest.raises(UntranslatableError, match=r"line .*dt\.shape"):
        kernels.in_c(device_translator())


def test_what_is_not_understood_is_named():
    algorithm = make_algorithm("quaternion")
    with pytest.raises(ConfigError, check=coded("mechanization.no-interpolation")):
        export_c(algorithm, interpolation="cubik")
    with pytest.raises(ConfigError, check=coded("tables.no-kind-sampling")):
        export_c(algorithm, sampling="meen")
    with pytest.raises(DataError):
        export_c(algorithm, q_nb=(0.0, 0.0, 0.0, 0.0))
    imu = imu_table([0.0, 1.0], np.zeros((2, 3)), sampling="mean")
    with pytest.raises(
        ConfigError, check=lambda refused: refused.finding.code == "attitude.asked-log-samples"
    ):
        export_c(algorithm, sampling="instantaneous", imu=imu)


EXAMPLE = Path(__file__).parents[3] / "docs" / "examples" / "attitude.c"


def test_the_example_of_the_manual_is_what_is_written():
    """All but the vector, whose last digits are those of a sine."""
    shown, now = (
        [line for line in text.splitlines() if "{0x" not in line and "{-0x" not in line]
        for text in (EXAMPLE.read_text(encoding="utf-8"), export_c(make_algorithm("quaternion")))
    )
    assert shown == now


#: A sensor in milli-degrees a second, whose y points forward, x right and z up, with a bias.
SENSOR = SensorConfiguration(
    50.0,
    Channel("mdeg/s", np.pi / 180e3, (1, 0, 2), (1.0, 1.0, -1.0), (0.01, -0.02, 0.0)),
    sources=("Rate: by the test.",),
)


def readings(count=200):
    """Raw readings, as single precision holds them, and the rates of the body that they mean."""
    t = np.arange(count) / SENSOR.rate_hz
    body = np.column_stack([2 * np.sin(3 * t), np.cos(2 * t), 1.5 * np.sin(t + 1)])
    x, y, z = body[:, 1] - 0.02, body[:, 0] + 0.01, -body[:, 2]
    raw = np.column_stack([x, y, z]) * 180e3 / np.pi
    raw = raw.astype(np.float32).astype(np.float64)
    rates = raw[:, [1, 0, 2]] * [1, 1, -1] * np.pi / 180e3 - [0.01, -0.02, 0.0]
    assert np.abs(rates - body).max() < 1e-6
    return t, raw, rates


@needs_compiler
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("real", ["float", "double"])
def test_configured_file_takes_the_readings_of_the_sensor(tmp_path, kind, real):
    t, raw, rates = readings()
    sampling = KINDS[kind].get("sampling", "instantaneous")
    algorithm = make_algorithm("rotvec:samples=1")
    imu = imu_table(t, rates, sampling=sampling)
    text = export_c(algorithm, **KINDS[kind], q_nb=START, imu=imu, configuration=SENSOR)
    assert max(map(len, text.splitlines())) <= 100
    made = build(tmp_path, text, "-O0", f"-DREAL={real}", "-DATTITUDE_TEST")
    assert run(made).endswith("passed\n")
    program = build(tmp_path, text, "-O0", f"-DREAL={real}", "-DATTITUDE_FILTER")
    given = "\n".join(" ".join(repr(float(v)) for v in row) for row in raw)
    found = np.array([line.split() for line in run(program, given).splitlines()], dtype=float)
    steps = increments_from_imu(imu, KINDS[kind].get("interpolation", "linear"))
    expected = run_attitude(algorithm, steps, START).attitude[QUATERNION].to_numpy()
    if kind == "mean":  # the device takes the first mean, too
        first = increments_table([0.02], [0.02], rates[:1] * 0.02)
        start = run_attitude(algorithm, first, START).attitude[QUATERNION].to_numpy()[-1]
        expected = run_attitude(algorithm, steps, start).attitude[QUATERNION].to_numpy()
    if kind == "cubic":
        found = found[1:]
    apart = np.radians(rotation.rotation_angle(found / norms(found), expected))
    # A reading of 2 rad/s in single precision is known to eps / 2 of it, and so are unit and bias.
    eps = np.finfo(np.float32 if real == "float" else np.float64).eps
    assert apart.max() < len(t) * (32 + 3 * 0.04) * eps


def norms(q):
    return np.linalg.norm(q, axis=1)[:, None]


@needs_compiler
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("GYRO_UNIT * raw[1]", "GYRO_UNIT * raw[0]"),
        ("-GYRO_UNIT * raw[2]", "GYRO_UNIT * raw[2]"),
        ("- R(0.01)", "+ R(0.01)"),
        ("define ATTITUDE_STEP R(0.02)", "define ATTITUDE_STEP R(0.0201)"),
        ("define GYRO_UNIT R(1.7453", "define GYRO_UNIT R(1.7553"),
    ],
)
def test_its_test_finds_a_wrong_configuration(tmp_path, right, wrong):
    t, _, rates = readings()
    text = export_c(make_algorithm("quaternion"), imu=imu_table(t, rates), configuration=SENSOR)
    assert right in text
    program = build(tmp_path, text.replace(right, wrong, 1), "-O0", "-DATTITUDE_TEST")
    assert subprocess.run([program], capture_output=True, check=False).returncode == 1


@needs_compiler
@pytest.mark.parametrize("meaning", ["drop", "sum"])
def test_file_of_a_comparison_is_its_configuration(tmp_path, meaning):
    """The log's own numbers, at the recommended rate, through the exported file."""
    rng = np.random.default_rng(3)
    t = np.arange(2400) / 200.0
    moving = np.clip(t - 2.0, 0.0, 1.0)[:, None]
    body = moving * np.column_stack([np.sin(2 * t), np.cos(3 * t), 0.5 * np.sin(t)])
    sensed = np.column_stack([body[:, 1] + 0.02, body[:, 0] + 0.01, -body[:, 2] - 0.03])
    raw = np.round(np.degrees(sensed) + rng.normal(0.0, 0.01, sensed.shape), 6)
    lines = ["# axes: right-forward-up", "time_s,gyro_x_deg_s,gyro_y_deg_s,gyro_z_deg_s"]
    lines += [
        f"{a:.3f}," + ",".join(f"{v:.6f}" for v in row) for a, row in zip(t, raw, strict=True)
    ]
    (tmp_path / "log.csv").write_text("\n".join(lines))
    bench = sd.compare_attitude(
        tmp_path / "log.csv", ["quaternion"], gyro_bias="rest", tolerance_deg=2.0
    )
    each = round(200.0 / bench.answer.rate_hz)
    assert each > 1
    # How a sample of the lower rate is made is the answer's, whichever it gave here.
    answer = dataclasses.replace(bench.answer, meaning=meaning)
    write_export(dataclasses.replace(bench, answer=answer), tmp_path / "attitude.c")
    text = (tmp_path / "attitude.c").read_text()
    assert run(build(tmp_path, text, "-DATTITUDE_TEST")).endswith("passed\n")
    program = build(tmp_path, text, "-DATTITUDE_FILTER", "-DREAL=double")
    used = raw[::each]
    if meaning == "sum":
        count = (len(raw) - 1) // each
        middle = 0.5 * (raw[1:] + raw[:-1])[: count * each]
        used = middle.reshape(count, each, 3).mean(axis=1)
    given = "\n".join(" ".join(repr(float(v)) for v in row) for row in used)
    found = np.array([line.split() for line in run(program, given).splitlines()], dtype=float)
    rates = np.radians(used[:, [1, 0, 2]] * [1, 1, -1]) - bench.gyro_bias["rad_per_s"]
    if meaning == "sum":
        rates = np.vstack([rates[:1], rates])  # of the start, which is not used
    imu = imu_table(
        np.arange(len(rates)) * each / 200.0,
        rates,
        sampling="mean" if meaning == "sum" else "instantaneous",
    )
    from_ = re.search(r"start\[4\] = \{(.*?)\};", text, re.S)
    start = [float(v) for v in re.findall(r"R\((.*?)\)", from_[1])]
    run_ = run_attitude(make_algorithm("quaternion"), increments_from_imu(imu), start)
    expected = run_.attitude[QUATERNION].to_numpy()[meaning == "sum" :]
    apart = np.radians(rotation.rotation_angle(found / norms(found), expected))
    # 1 / 200 s and what is measured of it differ by the digits of stamps of a millisecond.
    assert apart.max() < 1e-9
    assert np.radians(rotation.rotation_angle(expected, expected[0])).max() > 0.5
