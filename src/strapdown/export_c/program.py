"""The C file: header, interface, kernels, test."""

from __future__ import annotations

import importlib
import re
import textwrap

import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown.attitude import AttitudeAlgorithm
from strapdown.attitude.cost import operation_count, step_kernel
from strapdown.errors import ConfigError
from strapdown.export_c.interface import (
    CLEAR,
    ENDS,
    FINISH,
    PROTOTYPES,
    SAMPLINGS,
    Sampling,
    Shape,
    shape_of,
)
from strapdown.export_c.kernels import Function, Kernels
from strapdown.export_c.layout import WIDTH, comment, number
from strapdown.export_c.main import main_program
from strapdown.export_c.translate import Translator
from strapdown.export_c.vector import make_vector
from strapdown.increments.angle import INTERPOLATIONS
from strapdown.tables import SAMPLINGS as KINDS
from strapdown.tables import check_imu

# What a name of the math library is in either precision.
MACROS = ("SQRT", "SIN", "COS", "ATAN2", "HYPOT", "FABS", "FMOD", "FMAX", "COPYSIGN")


def export_c(
    algorithm: AttitudeAlgorithm,
    *,
    interpolation: str = "linear",
    sampling: str | None = None,
    q_nb: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    imu: pd.DataFrame | None = None,
) -> str:
    """Write an attitude algorithm as one C99 file that holds its own test.

    The formulas are translated from the kernels that strapdown itself runs: the same
    operations in the same order. In double precision the file gives the bits of
    `run_attitude` wherever the C library's sine and cosine are those of Python.

    Parameters
    ----------
    algorithm : AttitudeAlgorithm
    interpolation : {'linear', 'cubic'}
        As `increments_from_imu`; with the cubic the attitude is one sample late.
    sampling : {'instantaneous', 'mean'}, optional
        What a sample is; that of `imu` where not given, or the rate at its instant.
    q_nb : array_like, (4,)
        Where the test starts.
    imu : DataFrame, optional
        An Imu table whose first 48 samples are the test; a motion of its own where not given.

    Returns
    -------
    str
        The text of the file.

    Raises
    ------
    ConfigError
        `interpolation` or `sampling` is unknown, or `sampling` is not that of `imu`.
    DataError
        `q_nb` is no rotation; or as `tables.check_imu`.
    """
    kind = _kind(interpolation, sampling, imu)
    around, shape = SAMPLINGS[kind], shape_of(algorithm)
    kernels = Kernels(shape.ranges(algorithm))
    step = _require_step(kernels, algorithm)
    increments = _require_increments(kernels, kind, "dx" in step.parameters)
    for name in ("quat_normalise", "euler_from_quat", *shape.kernels):
        kernels.require(name)
    translator = Translator(kernels)
    functions = ["\n".join(translator.function(f)) + "\n" for f in kernels.functions]
    ends = ENDS.format(
        begin=shape.begin,
        clear=_rest(shape, translator.state_size) + CLEAR[kind],
        update=_update(around, step, increments),
        read=shape.read,
    )
    body = "\n".join([*functions, ends])
    vector = make_vector(algorithm, rotation.normalise(q_nb), kind, imu)
    parts = [
        _header(algorithm, around, translator.state_size),
        _precision(body),
        _interface(shape, around, translator.state_size),
        _constants(kernels),
        body,
        main_program(vector, rotation.normalise(q_nb), around.lag),
    ]
    return "\n".join(parts)


def _kind(interpolation: str, sampling: str | None, imu: pd.DataFrame | None) -> str:
    if interpolation not in INTERPOLATIONS:
        raise ConfigError(
            "attitude.no-interpolation",
            quantity="interpolation",
            interpolation=interpolation,
            word=interpolation,
            known=INTERPOLATIONS,
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
    sampling = sampling or KINDS[0]
    if sampling not in KINDS:
        raise ConfigError(
            "attitude.no-kind-sampling-2",
            quantity="sampling",
            sampling=sampling,
            word=sampling,
            known=KINDS,
        )
    return "mean" if sampling == "mean" else interpolation


# --- what is asked of the kernels ---------------------------------------------------------


def _require_step(kernels: Kernels, algorithm: AttitudeAlgorithm) -> Function:
    name = step_kernel(algorithm)[1]
    options = zip(kernels.parameters(name)[-2:], algorithm.kernel_options(), strict=True)
    return kernels.require(name, {option: (value, value) for option, value in options})


def _require_increments(kernels: Kernels, kind: str, change: bool) -> Function:
    if kind == "cubic":
        kernels.require("neighbour")
        return kernels.require("cubic_mean")
    if kind == "mean":
        return kernels.require("increment", {"mean": (True, True)}, keep=(0,))
    return kernels.require("increment", {"mean": (False, False)}, None if change else (0,))


def _rest(shape: Shape, size: int) -> str:
    """Statements that clear what of the state does not begin with the attitude."""
    if size == shape.begun:
        return ""
    if size == shape.begun + 1:
        return f"    a->state[{shape.begun}] = R(0.0);\n"
    head = f"    for (int i = {shape.begun}; i < {size}; i++) {{\n"
    return head + "        a->state[i] = R(0.0);\n    }\n"


def _update(around: Sampling, step: Function, increments: Function) -> str:
    change = "dx" in step.parameters
    of = {"state": "a->state", "dt": "dt"}
    of |= {f"t{axis}": f"theta[{i}]" for i, axis in enumerate("xyz")}
    zero = around is SAMPLINGS["mean"]
    of |= {f"d{axis}": "R(0.0)" if zero else f"dtheta[{i}]" for i, axis in enumerate("xyz")}
    call = f"{step.name}({', '.join(of[p] for p in step.parameters)});"
    results = ", &theta[i], &dtheta[i]);" if change else ");"
    taken = "increment(a->rate[i], gyro[i], dt" + results
    words = {
        "DTHETA": "dtheta[i] = (last - first) * dt;" if change else "",
        "THETA": "theta[3], dtheta[3]" if change else "theta[3]",
        "INCREMENT": taken if change else f"theta[i] = {taken}",
        "STEP": call,
    }
    lines = []
    for line in around.code.split("\n"):
        new = re.sub(r"\b(" + "|".join(words) + r")\b", lambda m: words[m.group()], line)
        indent = line[: len(line) - len(line.lstrip())]
        if new.strip() or not line.strip():
            lines += textwrap.wrap(
                new, WIDTH, subsequent_indent=indent + "    ", drop_whitespace=True
            ) or [""]
    return "\n".join(lines)


# --- the parts of the file ----------------------------------------------------------------


def _header(algorithm: AttitudeAlgorithm, around: Sampling, size: int) -> str:
    accuracy, count = algorithm.accuracy, operation_count(algorithm)
    # Looked up, because the package itself names what stands on higher floors.
    version = importlib.import_module("strapdown").__version__
    operations = ", ".join(f"{count[k]:.3g} {k}" for k in count if count[k])
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
        "Axes: body forward-right-down; local level north-east-down. q_nb turns body into local "
        "level, Hamilton, scalar first. Rates in rad/s of the body relative to inertial space, "
        "time in s.",
        f"Power of the step with which the error falls, 0 where it does not: {orders}.",
        f"Operations a step, from increments of angle below 0.5 rad: {operations}. "
        f"Memory in single precision: {4 * size + around.bytes} bytes.",
        "Single precision; -DREAL=double for double. Test: cc -std=c99 -O2 -DATTITUDE_TEST "
        "attitude.c -lm && ./a.out. With -DATTITUDE_FILTER it reads lines of dt gx gy gz and "
        f"writes a quaternion for each{', and at the end one more' if around.lag else ''}.",
        "SPDX-License-Identifier: MIT. Copyright (c) 2026 The strapdown developers.",
    ]
    return "\n".join(comment("\n\n".join(lines))) + "\n"


def _precision(body: str) -> str:
    used = [m for m in MACROS if re.search(rf"\b{m}\(", body)]
    single = "\n".join(f"#define {m} {m.lower()}f" for m in used)
    double = "\n".join(f"#define {m} {m.lower()}" for m in used)
    pi = "#define PI R(3.141592653589793)\n" if re.search(r"\bPI\b", body) else ""
    return f"""\
#include <math.h>

#ifndef REAL
#define REAL float
#endif
typedef REAL real_t;
#define R(x) ((real_t)(x))

/* The square of what is below LARGEST is still a number. */
#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#define IS_float 1
#define IS_double 2
#if JOIN(IS_, REAL) == IS_float
#define LARGEST 1e18F
{single}
#elif JOIN(IS_, REAL) == IS_double
#define LARGEST 1e150
{double}
#else
#error "REAL must be float or double"
#endif
{pi}"""


def _interface(shape: Shape, around: Sampling, size: int) -> str:
    lag = FINISH if around.lag else ""
    state = "\n".join(comment(f"{shape.state[0].upper()}{shape.state[1:]}.", "    "))
    return (
        f"struct attitude {{\n{state}\n    real_t state[{size}];\n{around.memory}}};\n\n"
        + PROTOTYPES.format(finish=lag)
    )


def _constants(kernels: Kernels) -> str:
    lines: list[str] = []
    for constant in kernels.constants():
        if constant.comment:
            lines += comment(constant.comment)
        lines.append(f"#define {constant.name} {number(constant.value)}")
    return "\n".join([*lines, ""]) if lines else ""
