"""An attitude algorithm as one C99 file: header, interface, kernels, test."""

from __future__ import annotations

import importlib
import re
import textwrap
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown._kernels import arithmetic
from strapdown.attitude_algorithms import AttitudeAlgorithm
from strapdown.attitude_algorithms.cost import count_cost
from strapdown.constants import CORTEX_M4F_CYCLES, Array
from strapdown.errors import ConfigError, check_choice
from strapdown.export.configuration import SensorConfiguration
from strapdown.export.device import comment, device_translator, unpacked
from strapdown.export.kernels import Kernels
from strapdown.export.program import (
    ROUNDINGS,
    SAMPLES,
    Vector,
    attitude_harness,
    attitude_test,
    c_rows,
    constant_lines,
    precision_lines,
    unit_lines,
)
from strapdown.export.sources import Kernel
from strapdown.export.types_of_c import WIDTH
from strapdown.increments import BETWEEN_STAMPS
from strapdown.tables import GYRO, check_imu, check_sampling_kind


def algorithm_in_c(
    algorithm: AttitudeAlgorithm,
    *,
    kind: str,
    q_nb: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    imu: pd.DataFrame | None = None,
    configuration: SensorConfiguration | None = None,
) -> str:
    """Write an attitude algorithm as one C99 file with its own test: `export_c`."""
    around, shape = SAMPLINGS[kind], shape_of(algorithm)
    kernels, step, increments = algorithm_kernels(algorithm, shape, kind)
    translator = device_translator()
    functions, size = kernels.in_c(translator), count_cost(algorithm).memory
    ends = ENDS.format(
        begin=shape.begin,
        clear=_rest(shape, size) + CLEAR[kind],
        update=_update(around, step, increments),
        read=shape.read,
        angles=ANGLES,
    )
    sample = "" if configuration is None else _sample(configuration)
    body = "\n".join(filter(None, [*functions, ends, sample]))
    start = rotation.normalise(q_nb)
    vector = make_vector(algorithm, start, kind, imu, configuration)
    words = "dt in s, rates in rad/s" if configuration is None else "raw readings"
    take = TAKE_RATES if configuration is None else TAKE_RAW
    harness = attitude_harness(take, words, vector, start, around.lag)
    parts = [
        _header(algorithm, around, size, configuration),
        precision_lines(body, translator.names.text),
        _interface(shape, around, size, configuration),
        constant_lines(kernels),
        body,
        attitude_test(harness, vector, _bound(vector)),
    ]
    return "\n".join(parts)


def sampling_kind(interpolation: str, sampling: str | None, imu: pd.DataFrame | None) -> str:
    """Which of `SAMPLINGS`."""
    check_choice(
        "mechanization.no-interpolation",
        BETWEEN_STAMPS,
        quantity="interpolation",
        interpolation=interpolation,
    )
    if imu is not None:
        check_imu(imu)
        sampling = sampling or imu.attrs["sampling"]
        if sampling != imu.attrs["sampling"]:
            raise ConfigError(
                "attitude.asked-log-samples",
                quantity="sampling",
                sampling=sampling,
                attrs=imu.attrs["sampling"],
            )
    sampling = sampling or "instantaneous"
    check_sampling_kind(sampling)
    return "mean" if sampling == "mean" else interpolation


# --- required kernel functions ------------------------------------------------------------


def algorithm_kernels(
    algorithm: AttitudeAlgorithm, shape: Shape, kind: str
) -> tuple[Kernels, Kernel, Kernel]:
    """Kernels of an algorithm, among them its step and the increments of one axis."""
    kernels = Kernels(arithmetic.kernel_home(algorithm.advance_kernel), shape.ranges(algorithm))
    step = _require_step(kernels, algorithm)
    increments = _require_increments(kernels, kind, "dx" in step.parameters)
    for name in ("quat_normalise", "euler_from_quat", *shape.kernels):
        kernels.require(name)
    return kernels, step, increments


def _require_step(kernels: Kernels, algorithm: AttitudeAlgorithm) -> Kernel:
    name = algorithm.advance_kernel.__name__.replace("_advance", "_step")
    options = zip(kernels.source(name).parameters[-2:], algorithm.kernel_options(), strict=True)
    return kernels.require(name, {option: (value, value) for option, value in options})


def _require_increments(kernels: Kernels, kind: str, change: bool) -> Kernel:
    if kind == "cubic":
        kernels.require("neighbour")
        return kernels.require("cubic_mean")
    if kind == "mean":
        return kernels.require("increment", {"mean": (True, True)}, keep=(0,))
    return kernels.require("increment", {"mean": (False, False)}, None if change else (0,))


def _sample(configuration: SensorConfiguration) -> str:
    """The function that takes a raw reading."""
    return unit_lines(configuration, ("gyro",)) + SAMPLE.format(
        rows=c_rows(configuration.gyro, "raw", "GYRO_UNIT")
    )


def _rest(shape: Shape, size: int) -> str:
    """Statements that clear the part of the state not set from the attitude."""
    if size == shape.begun:
        return ""
    if size == shape.begun + 1:
        return f"    a->state[{shape.begun}] = R(0.0);\n"
    head = f"    for (int i = {shape.begun}; i < {size}; i++) {{\n"
    return head + "        a->state[i] = R(0.0);\n    }\n"


def _update(around: Sampling, step: Kernel, increments: Kernel) -> str:
    change = "dx" in step.parameters
    of = {"state": "a->state", "dt": "dt"}
    of |= {f"t{axis}": f"theta[{i}]" for i, axis in enumerate("xyz")}
    zero = around is SAMPLINGS["mean"]
    of |= {f"d{axis}": "R(0.0)" if zero else f"dtheta[{i}]" for i, axis in enumerate("xyz")}
    call = f"{step.name}({', '.join(of[p] for p in step.parameters)});"
    taken = "increment(a->rate[i], gyro[i], dt)"
    both = unpacked(taken, ("theta[i]", "dtheta[i]"), " " * 12).lstrip()
    words = {
        "DTHETA": "dtheta[i] = (last - first) * dt;" if change else "",
        "THETA": "theta[3], dtheta[3]" if change else "theta[3]",
        "INCREMENT": both if change else f"theta[i] = {taken};",
        "STEP": call,
    }
    lines = []
    text = re.sub(r"\b(" + "|".join(words) + r")\b", lambda m: words[m.group()], around.code)
    for new, line in zip(text.split("\n"), text.split("\n"), strict=True):
        indent = line[: len(line) - len(line.lstrip())]
        if new.strip() or not line.strip():
            lines += textwrap.wrap(
                new, WIDTH, subsequent_indent=indent + "    ", drop_whitespace=True
            ) or [""]
    return "\n".join(lines)


# --- the parts of the file ----------------------------------------------------------------


def _header(
    algorithm: AttitudeAlgorithm,
    around: Sampling,
    size: int,
    configuration: SensorConfiguration | None,
) -> str:
    accuracy, cost = algorithm.accuracy, count_cost(algorithm)
    # Looked up at run time, because the package root imports higher layers.
    version = importlib.import_module("strapdown").__version__
    operations = ", ".join(
        f"{number:.3g} {kind}" for kind in CORTEX_M4F_CYCLES if (number := getattr(cost, kind))
    )
    orders = (
        f"increments {accuracy.increments}, rates interpolated by a cubic {accuracy.rates} (by the "
        f"trapezoid at most 2), drift on pure coning {accuracy.coning}"
    )
    lines = [
        f"Attitude by {algorithm.title.lower()}, "
        + ", ".join(filter(None, (algorithm.source, algorithm.equations)))
        + ".",
        f"{algorithm.label}, written by strapdown {version} from the kernels that it runs itself.",
        f"{around.words}.",
        *(() if configuration is None else configuration.words(("gyro",))),
        "Axes: body forward-right-down; local level north-east-down. q_nb turns body into local "
        "level, Hamilton, scalar first. Rates in rad/s of the body relative to inertial space, "
        "time in s.",
        f"Power of the step with which the error falls, 0 where it does not: {orders}.",
        f"Operations a step, from increments of angle below 0.5 rad: {operations}. "
        f"Memory in single precision: {4 * size + around.bytes} bytes.",
        "Single precision; -DREAL=double for double. Test: cc -std=c99 -O2 -DATTITUDE_TEST "
        "attitude.c -lm && ./a.out. With -DATTITUDE_FILTER it reads lines of "
        f"{'dt gx gy gz' if configuration is None else 'raw readings x y z'} and "
        f"writes a quaternion for each{', and at the end one more' if around.lag else ''}.",
        "SPDX-License-Identifier: MIT. Copyright (c) 2026 The strapdown developers.",
    ]
    return "\n".join(comment("\n\n".join(lines))) + "\n"


def _interface(
    shape: Shape, around: Sampling, size: int, configuration: SensorConfiguration | None
) -> str:
    lag = FINISH if around.lag else ""
    state = "\n".join(comment(f"{shape.state[0].upper()}{shape.state[1:]}.", "    "))
    return (
        f"struct attitude {{\n{state}\n    real_t state[{size}];\n{around.memory}}};\n\n"
        + PROTOTYPES.format(finish=lag)
        + ("" if configuration is None else SAMPLE_PROTOTYPE)
    )


# C code around the kernels: structure, initialization, one sample, output.
#
# The non-kernel part of `AttitudeTracker` and of each algorithm's `begin` and `quaternions`,
# written once in C. The formulas it calls are translated.


def _state(count: int, of: str = "a->state") -> list[str]:
    return [f"{of}[{i}]" for i in range(count)]


def _read(kernel: str, count: int, of: str = "a->state") -> str:
    return unpacked(f"{kernel}({', '.join(_state(count, of))})", _state(4, "q_nb")).lstrip()


_UNIT = _read("quat_normalise", 4)
_ANGLES = _read("quat_from_euler", 3)
_FROM_ANGLES = unpacked("euler_from_quat(w, x, y, z)", _state(3)).lstrip()
_COPY = """a->state[0] = w;
    a->state[1] = x;
    a->state[2] = y;
    a->state[3] = z;"""

# Nearest rotation in the Frobenius norm. Newton's iteration finds it from every matrix whose
# singular values are below sqrt(3), as they are when their squares sum to 3.
NEAREST = """real_t m[9];
    real_t sum = R(0.0);
    for (int i = 0; i < 9; i++) {
        sum += a->state[i] * a->state[i];
    }
    for (int i = 0; i < 9; i++) {
        m[i] = a->state[i] * SQRT(R(3.0) / sum);
    }
    /* What a truncated series stretched: the nearest rotation, each step squaring the error. */
    for (int i = 0; i < 12; i++) {
        orthogonalise(m);
    }
    """


@dataclass(frozen=True)
class Shape:
    """Initialization and output of an algorithm's state.

    `state`: meaning of its numbers. `begin`, `read`: statements: from w, x, y, z into ``a->state``;
    from there into ``q_nb``. `begun`: count of state numbers that `begin` sets; the rest is zero.
    `kernels`: kernels that these call. `python`: `begin` and `read` in Python. `ranges`: least and
    greatest value of integers that a kernel computes at run time.
    """

    state: str
    begin: str
    read: str
    begun: int
    kernels: tuple[str, ...]
    python: tuple[str, str]
    ranges: Callable[[AttitudeAlgorithm], dict[str, tuple[int, int]]] = field(
        default=lambda algorithm: {}
    )


_IN_PYTHON = ("self.state[:4] = w, x, y, z", "return quat_normalise(*self.state[:4])")
_BY_QUATERNION = Shape("quaternion w, x, y, z", _COPY, _UNIT, 4, (), _IN_PYTHON)
_BY_MATRIX = Shape(
    "C_nb row by row, steps since it was orthogonalised",
    unpacked("dcm_from_quat(w, x, y, z)", _state(9)).lstrip(),
    _read("quat_from_dcm", 9),
    9,
    ("dcm_from_quat", "quat_from_dcm"),
    ("self.state[:9] = dcm_from_quat(w, x, y, z)", "return quat_from_dcm(*self.state[:9])"),
)
_TRUNCATED = Shape(
    _BY_MATRIX.state,
    _BY_MATRIX.begin,
    NEAREST + _read("quat_from_dcm", 9, "m"),
    9,
    (*_BY_MATRIX.kernels, "orthogonalise"),
    (
        _BY_MATRIX.python[0],
        """\
scale = math.sqrt(3.0 / sum(v * v for v in self.state[:9]))
m = [scale * v for v in self.state[:9]]
for _ in range(12):
    orthogonalise(m)
return quat_from_dcm(*m)""",
    ),
)

_ANGLES_IN_PYTHON = "self.state[:3] = euler_from_quat(w, x, y, z)"
SHAPES: dict[str, Shape] = {
    "naive": Shape(
        "roll, pitch, heading, rad",
        _FROM_ANGLES,
        _ANGLES,
        3,
        ("quat_from_euler",),
        (_ANGLES_IN_PYTHON, "return quat_from_euler(*self.state[:3])"),
    ),
    "euler": Shape(
        "roll, pitch, heading, rad; least |cos pitch|, its step, steps",
        f"{_FROM_ANGLES}\n    a->state[3] = FABS(COS(a->state[1]));",
        _ANGLES,
        4,
        ("quat_from_euler",),
        (
            f"{_ANGLES_IN_PYTHON}\n        self.state[3] = abs(math.cos(self.state[1]))",
            "return quat_from_euler(*self.state[:3])",
        ),
    ),
    "dcm": _BY_MATRIX,
    "quaternion": _BY_QUATERNION,
    "rk4": _BY_QUATERNION,
    "rotvec": Shape(
        "quaternion now, at the block's start; steps in it; dt and angles of each",
        _COPY
        + "\n    for (int i = 0; i < 4; i++) {\n        a->state[4 + i] = a->state[i];\n    }",
        _UNIT,
        8,
        (),
        ("self.state[:8] = 2 * (w, x, y, z)", _IN_PYTHON[1]),
        lambda algorithm: {"done": (0, int(algorithm.kernel_options()[0]) - 1)},
    ),
}


def shape_of(algorithm: AttitudeAlgorithm) -> Shape:
    """Return the initialization and output of an algorithm's state."""
    if algorithm.name == "dcm" and algorithm.kernel_options()[0]:
        return _TRUNCATED
    if algorithm.name in SHAPES:
        return SHAPES[algorithm.name]
    if type(algorithm).begin is not AttitudeAlgorithm.begin:
        raise ConfigError("attitude.state-not-exported", quantity="--export", name=algorithm.name)
    return _BY_QUATERNION


# --- one sample, by meaning of a sample and interpolation of rates ----------------------------


@dataclass(frozen=True)
class Sampling:
    """Conversion of samples to steps.

    `words`: description in the file header. `memory`: stored data of the structure, as
    declarations. `code`: the functions; ``STEP`` is replaced by the call of the algorithm. `bytes`:
    size of the stored data in single precision. `lag`: delay of the attitude in samples.
    """

    words: str
    memory: str
    code: str
    bytes: int
    lag: int = 0


_USABLE = """\
/* False for NaN and infinity, too, and for what is too large to be squared. */
static int usable(real_t dt, const real_t *gyro)
{
    return dt > R(0.0) && dt < LARGEST && FABS(gyro[0]) < LARGEST && FABS(gyro[1]) < LARGEST
        && FABS(gyro[2]) < LARGEST;
}
"""

MEAN = Sampling(
    "A sample is the mean rate over the dt that ends with it",
    "",
    f"""{_USABLE}
int attitude_update(struct attitude *a, real_t dt, const real_t gyro[3])
{{
    if (!usable(dt, gyro)) {{
        return 1;
    }}
    real_t theta[3];
    for (int i = 0; i < 3; i++) {{
        theta[i] = increment(gyro[i], dt);
    }}
    STEP
    return 0;
}}
""",
    bytes=0,
)

LINEAR = Sampling(
    "A sample is the rate at its instant, and the rate is linear between samples (trapezoid)",
    """\
    real_t rate[3]; /* of the sample before, rad/s */
    int started;    /* whether there was one */
""",
    f"""{_USABLE}
int attitude_update(struct attitude *a, real_t dt, const real_t gyro[3])
{{
    /* The first sample ends no step: its dt does not matter. */
    if (!usable(a->started ? dt : R(1.0), gyro)) {{
        return 1;
    }}
    if (a->started) {{
        real_t THETA;
        for (int i = 0; i < 3; i++) {{
            INCREMENT
        }}
        STEP
    }}
    for (int i = 0; i < 3; i++) {{
        a->rate[i] = gyro[i];
    }}
    a->started = 1;
    return 0;
}}
""",
    bytes=16,
)

CUBIC = Sampling(
    "A sample is the rate at its instant, and the rate is the cubic through four samples; a step "
    "needs the sample after it, so that the attitude is that of the sample before the last",
    """\
    real_t rate[3][3]; /* of the last three samples, the newest last, rad/s */
    real_t dt[2];      /* of the last two steps */
    int samples;       /* taken so far, up to 3 */
""",
    f"""{_USABLE}
/* Take the step to the newest sample, which another one follows after `next` s, or none: 0. */
static void take_step(struct attitude *a, real_t next, const real_t *after)
{{
    const real_t dt = a->dt[1];
    const real_t p = a->samples > 2 ? neighbour(dt, a->dt[0]) : R(0.0);
    const real_t r = next > R(0.0) ? neighbour(dt, next) : R(0.0);
    real_t THETA;
    for (int i = 0; i < 3; i++) {{
        const real_t before = a->rate[0][i], first = a->rate[1][i], last = a->rate[2][i];
        theta[i] = dt * cubic_mean(before, first, last, after[i], p, r);
        DTHETA
    }}
    STEP
}}

int attitude_update(struct attitude *a, real_t dt, const real_t gyro[3])
{{
    /* The first sample ends no step: its dt does not matter. */
    if (!usable(a->samples ? dt : R(1.0), gyro)) {{
        return 1;
    }}
    if (a->samples > 1) {{
        take_step(a, dt, gyro);
    }}
    for (int i = 0; i < 3; i++) {{
        a->rate[0][i] = a->rate[1][i];
        a->rate[1][i] = a->rate[2][i];
        a->rate[2][i] = gyro[i];
    }}
    a->dt[0] = a->dt[1];
    a->dt[1] = dt;
    a->samples += a->samples < 3;
    return 0;
}}

void attitude_finish(struct attitude *a)
{{
    if (a->samples > 1) {{
        take_step(a, R(0.0), a->rate[2]);
        a->samples = 1;
    }}
}}
""",
    bytes=48,
    lag=1,
)

CLEAR = {
    "mean": "",
    "linear": "    a->started = 0;\n",
    "cubic": """\
    for (int i = 0; i < 3; i++) {
        a->rate[0][i] = a->rate[1][i] = a->rate[2][i] = R(0.0);
    }
    a->dt[0] = a->dt[1] = R(0.0);
    a->samples = 0;
""",
}
SAMPLINGS = {"mean": MEAN, "linear": LINEAR, "cubic": CUBIC}

PROTOTYPES = """\
/* Start from an attitude, a quaternion of any length but zero. */
void attitude_init(struct attitude *a, const real_t q_nb[4]);

/* Take a sample: dt in s since the last sample that was taken, gyro in rad/s. Returns 0, or 1 for a
 * sample that is refused (dt not above zero, or not finite); it then has changed nothing.
 */
int attitude_update(struct attitude *a, real_t dt, const real_t gyro[3]);
{finish}
/* The attitude as a unit quaternion. */
void attitude_quaternion(const struct attitude *a, real_t q_nb[4]);

/* The attitude as roll, pitch and heading, rad. */
void attitude_euler(const struct attitude *a, real_t euler[3]);
"""
FINISH = """
/* Take the step to the last sample without the one after it: at the end of a record. */
void attitude_finish(struct attitude *a);
"""

SAMPLE_PROTOTYPE = """
/* Take a raw reading of the sensor, x, y, z in its own unit and axes, a step after the one before,
 * and give the attitude as a unit quaternion. Returns as attitude_update, which takes rates of the
 * body in rad/s and any step, as after a lost sample.
 */
int attitude_sample(struct attitude *a, const real_t raw[3], real_t q_nb[4]);
"""

SAMPLE = """\
int attitude_sample(struct attitude *a, const real_t raw[3], real_t q_nb[4])
{{
    const real_t gyro[3] = {{
{rows}    }};
    const int refused = attitude_update(a, ATTITUDE_STEP, gyro);
    attitude_quaternion(a, q_nb);
    return refused;
}}
"""

ENDS = """\
void attitude_init(struct attitude *a, const real_t q_nb[4])
{{
    const real4 unit = quat_normalise(q_nb[0], q_nb[1], q_nb[2], q_nb[3]);
    const real_t w = unit.f0, x = unit.f1, y = unit.f2, z = unit.f3;
    {begin}
{clear}}}

{update}
void attitude_quaternion(const struct attitude *a, real_t q_nb[4])
{{
    {read}
}}

void attitude_euler(const struct attitude *a, real_t euler[3])
{{
    real_t q[4];
    attitude_quaternion(a, q);
{angles}
}}
"""


#: Statements that put the angles of a quaternion ``q`` into ``euler``.
ANGLES = unpacked("euler_from_quat(q[0], q[1], q[2], q[3])", _state(3, "euler"))


# How the test passes samples.

TAKE_RATES = """\
    const real_t gyro[3] = {R(v[1]), R(v[2]), R(v[3])};
    const int refused = attitude_update(s, R(v[0]), gyro);"""
TAKE_RAW = """\
    const real_t raw[3] = {R(v[0]), R(v[1]), R(v[2])};
    real_t turned[4];
    const int refused = attitude_sample(s, raw, turned);"""


def _bound(vector: Vector) -> str:
    text = (
        f"{len(vector.samples)} steps of {ROUNDINGS} roundings that another compiler or another "
        "sine may make otherwise"
    )
    if vector.condition > 1.0:
        text += f", each magnified by 1/cos(pitch), here up to {vector.condition:.3g}"
    return text


# Test vector: a short record and its attitudes in double and single precision.


def motion() -> Array:
    """Rotations that grow from zero to 0.8 rad per step, in equal and then in unequal steps.

    They exercise both the series and the functions, and both kinds of blocks.
    """
    k = np.arange(SAMPLES)
    dt = np.where((k > SAMPLES / 2) & (k % 5 > 2), 0.09375, 0.0625)
    grow = 0.2 * k
    # Mostly about one axis, so that pitch stays away from its pole.
    rates = [grow, 0.4 * grow * np.sin(0.9 * k), 0.4 * grow * np.cos(0.7 * k)]
    return np.column_stack([dt, *rates])


def _rows(imu: pd.DataFrame) -> Array:
    part = imu.iloc[:SAMPLES]
    time = part.index.to_numpy(dtype=np.float64)
    return np.column_stack([np.diff(time, prepend=time[0]), part[GYRO].to_numpy(dtype=np.float64)])


def make_vector(
    algorithm: AttitudeAlgorithm,
    q_nb: Array,
    kind: str,
    imu: pd.DataFrame | None,
    configuration: SensorConfiguration | None = None,
) -> Vector:
    """Run the kernels in both precisions over the same samples.

    `q_nb` ((4,)): initial attitude. `kind` ({'linear', 'cubic', 'mean'}). `imu`: its first 48
    samples; by default a built-in motion. `configuration`: samples are raw readings at its rate.
    """
    rows = motion() if imu is None else _rows(imu)
    rows = rows.astype(np.float32).astype(np.float64)
    if kind == "mean" and imu is not None:
        rows = rows[1:]  # the first mean belongs to an interval that begins before the log
    elif kind != "mean":
        rows[0, 0] = 0.0
    samples, rounded = rows, rows
    if configuration is not None:
        gyro = configuration.gyro
        samples = gyro.raw(rows[:, 1:]).astype(np.float32).astype(np.float64)
        step = np.full((len(rows), 1), 1.0 / configuration.rate_hz)
        rows = np.hstack([step, gyro.body(samples)])
        rounded = np.hstack([step, gyro.body(samples, np.float32)])
    double, state = _run(algorithm, rows, q_nb, kind, single=False)
    single, _ = _run(algorithm, rounded, q_nb, kind, single=True)
    # The rates of the angles, and their errors, have 1/cos(pitch) as a factor.
    condition = 1.0 / max(float(state[3]), 1e-3) if algorithm.name == "euler" else 1.0
    return Vector(samples, double, single, condition)


def _run(
    algorithm: AttitudeAlgorithm, rows: Array, q_nb: Array, kind: str, single: bool
) -> tuple[Array, Array]:
    number: Any = np.float32 if single else np.float64
    home = arithmetic.kernel_home(algorithm.advance_kernel)

    def module(name: str) -> Any:
        if single:
            return arithmetic.single_precision(name)
        return arithmetic.kernel_module(name)

    dt, rate = rows[:, 0].astype(number), rows[:, 1:].astype(number)
    if kind == "mean":
        # A mean has no sample at the start; the value there is not used.
        rate = np.vstack([rate[:1], rate])
    else:
        dt = dt[1:]
    dt, rate = np.ascontiguousarray(dt), np.ascontiguousarray(rate)
    theta = np.empty((len(dt), 3), number)
    dtheta = np.empty_like(theta)
    if kind == "cubic":
        module("increments").increments_cubic(dt, rate, theta, dtheta)
    else:
        module("increments").increments(dt, rate, kind == "mean", theta, dtheta)
    state = algorithm.begin(q_nb).astype(number)
    history = np.empty((len(dt), algorithm.width), number)
    first = state[None, : algorithm.width].copy()
    name = type(algorithm).advance_kernel.__name__
    options = [number(o) for o in algorithm.kernel_options()]
    getattr(module(home), name)(state, dt, theta, dtheta, history, *options)
    if kind != "mean":
        history = np.vstack([first, history])
    return algorithm.quaternions(np.ascontiguousarray(history, dtype=np.float64)), state
