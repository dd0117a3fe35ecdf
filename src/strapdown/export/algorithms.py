"""An attitude algorithm as one file for a device: what its template is filled with."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
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
from strapdown.export.kernels import Kernels
from strapdown.export.program import ROUNDINGS, SAMPLES, Vector, c_file, python_file
from strapdown.export.sources import Kernel
from strapdown.increments import BETWEEN_STAMPS
from strapdown.tables import GYRO, check_imu, check_sampling_kind


def algorithm_file(
    algorithm: AttitudeAlgorithm,
    language: str,
    *,
    kind: str,
    q_nb: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    imu: pd.DataFrame | None = None,
    configuration: SensorConfiguration | None = None,
) -> str:
    """Write an attitude algorithm as one file with its own test: `export_c`.

    `language` ({'c', 'py'}): C99 or MicroPython.
    """
    in_c, shape = language == "c", shape_of(algorithm)
    kernels, step, increments = algorithm_kernels(algorithm, shape, kind)
    start, lag = rotation.normalise(q_nb), int(kind == "cubic")
    size = count_cost(algorithm).memory if in_c else len(algorithm.begin(start))
    vector = make_vector(algorithm, start, kind, imu, configuration)
    of = {"state": "a->state" if in_c else "self.state", "dt": "dt"}
    of |= {f"t{axis}": f"theta[{i}]" for i, axis in enumerate("xyz")}
    no_change = "R(0.0)" if in_c else "0.0"
    of |= {
        f"d{axis}": no_change if kind == "mean" else f"dtheta[{i}]" for i, axis in enumerate("xyz")
    }
    facts = {
        **vars(shape),
        "kind": kind,
        "lag": lag,
        "size": size,
        "step": f"{step.name}({', '.join(of[p] for p in step.parameters)})",
        "change": "dx" in step.parameters,
        "start": tuple(start.tolist()),
        "vector": vector,
        "sensors": {"gyro": None if configuration is None else configuration.gyro},
        "configuration": configuration,
    }
    if not in_c:
        return python_file(
            "algorithm",
            [f"{algorithm.title}, {algorithm.source}", algorithm.label],
            kernels,
            {**facts, "increment": increments.name, "title": algorithm.title, "words": WORDS[kind]},
        )
    facts |= {
        "row_words": "dt in s, rates in rad/s" if configuration is None else "raw readings",
        "bound": _bound(vector),
    }
    head = _head(algorithm, kind, size, configuration)
    return c_file("algorithm", head, kernels, facts)


def sampling_kind(interpolation: str, sampling: str | None, imu: pd.DataFrame | None) -> str:
    """Which of `WORDS`."""
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


# --- the parts of the file ----------------------------------------------------------------


def _head(
    algorithm: AttitudeAlgorithm, kind: str, size: int, configuration: SensorConfiguration | None
) -> list[str]:
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
    return [
        f"Attitude by {algorithm.title.lower()}, "
        + ", ".join(filter(None, (algorithm.source, algorithm.equations)))
        + ".",
        f"{algorithm.label}, written by strapdown {version} from the kernels that it runs itself.",
        f"{WORDS[kind]}.",
        *(() if configuration is None else configuration.words(("gyro",))),
        "Axes: body forward-right-down; local level north-east-down. q_nb turns body into local "
        "level, Hamilton, scalar first. Rates in rad/s of the body relative to inertial space, "
        "time in s.",
        f"Power of the step with which the error falls, 0 where it does not: {orders}.",
        f"Operations a step, from increments of angle below 0.5 rad: {operations}. "
        f"Memory in single precision: {4 * size + _STORED[kind]} bytes.",
        "Single precision; -DREAL=double for double. Test: cc -std=c99 -O2 -DATTITUDE_TEST "
        "attitude.c -lm && ./a.out. With -DATTITUDE_FILTER it reads lines of "
        f"{'dt gx gy gz' if configuration is None else 'raw readings x y z'} and "
        f"writes a quaternion for each{', and at the end one more' if kind == 'cubic' else ''}.",
        "SPDX-License-Identifier: MIT. Copyright (c) 2026 The strapdown developers.",
    ]


# The state of an algorithm, which `begin` and `quaternions` of its class set and read: templates do
# so in C and in Python. The formulas that they call are translated.


@dataclass(frozen=True)
class Shape:
    """Initialization and output of an algorithm's state.

    `state_words`: meaning of its numbers. `form` ({'angles', 'matrix', 'quaternion'}): of the
    attitude among them. `begun`: count of numbers that are set from an attitude; the rest is zero.
    `kernels`: those that this calls. `truncated`: whether a matrix may be stretched. `ranges`:
    least and greatest value of integers that a kernel computes at run time.
    """

    state_words: str
    form: str
    begun: int
    kernels: tuple[str, ...] = ()
    truncated: bool = False
    ranges: Callable[[AttitudeAlgorithm], dict[str, tuple[int, int]]] = field(
        default=lambda algorithm: {}
    )


_BY_QUATERNION = Shape("Quaternion w, x, y, z.", "quaternion", 4)
_BY_MATRIX = Shape(
    "C_nb row by row, steps since it was orthogonalised.",
    "matrix",
    9,
    ("dcm_from_quat", "quat_from_dcm"),
)
_TRUNCATED = replace(_BY_MATRIX, kernels=(*_BY_MATRIX.kernels, "orthogonalise"), truncated=True)
SHAPES: dict[str, Shape] = {
    "naive": Shape("Roll, pitch, heading, rad.", "angles", 3, ("quat_from_euler",)),
    "euler": Shape(
        "Roll, pitch, heading, rad; least |cos pitch|, its step, steps.",
        "angles",
        4,
        ("quat_from_euler",),
    ),
    "dcm": _BY_MATRIX,
    "quaternion": _BY_QUATERNION,
    "rk4": _BY_QUATERNION,
    "rotvec": Shape(
        "Quaternion now, at the block's start; steps in it; dt and angles of each.",
        "quaternion",
        8,
        ranges=lambda algorithm: {"done": (0, int(algorithm.kernel_options()[0]) - 1)},
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


#: A sample, by its meaning or by how rates run between samples; and what is kept of the samples
#: before, bytes in single precision.
WORDS = {
    "mean": "A sample is the mean rate over the dt that ends with it",
    "linear": "A sample is the rate at its instant, and the rate is linear between samples "
    "(trapezoid)",
    "cubic": "A sample is the rate at its instant, and the rate is the cubic through four samples; "
    "a step needs the sample after it, so that the attitude is that of the sample before the last",
}
_STORED = {"mean": 0, "linear": 16, "cubic": 48}


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
