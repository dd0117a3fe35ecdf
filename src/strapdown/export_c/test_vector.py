"""Test vector: a short record and its attitudes in double and single precision."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown._kernels import arithmetic
from strapdown.attitude_algorithms import AttitudeAlgorithm
from strapdown.attitude_algorithms.cost import kernel_home
from strapdown.export_c.translate import comment
from strapdown.tables import GYRO

Array = NDArray[np.float64]
SAMPLES = 48
# Rounding of a step that may differ between compilers (fused products, their own sine): a
# product of quaternions is four sums of four products, 4 roundings of half an eps each, and so
# 2 eps a component, 4 eps in the vector of four, 8 eps as an angle; the same again for the
# quaternion of the increment; and both runs may have them.
ROUNDINGS = 32


@dataclass(frozen=True)
class Vector:
    """A test vector.

    Attributes
    ----------
    samples : ndarray, (n, 4)
        dt in s and the rates in rad/s, each exactly representable in single precision.
    double, single : ndarray, (n, 4)
        Attitude at each sample from the kernels in either precision.
    condition : float
        Factor by which the algorithm magnifies an error near its singularity.
    """

    samples: Array
    double: Array
    single: Array
    condition: float

    @property
    def roundings(self) -> float:
        """Largest difference between two correct implementations, in eps of the precision."""
        return len(self.samples) * ROUNDINGS * self.condition


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
    algorithm: AttitudeAlgorithm, q_nb: Array, kind: str, imu: pd.DataFrame | None
) -> Vector:
    """Run the kernels in both precisions over the same samples.

    Parameters
    ----------
    algorithm : AttitudeAlgorithm
    q_nb : ndarray, (4,)
        Initial attitude.
    kind : {'linear', 'cubic', 'mean'}
    imu : DataFrame, optional
        Its first 48 samples; by default a built-in motion.
    """
    rows = motion() if imu is None else _rows(imu)
    rows = rows.astype(np.float32).astype(np.float64)
    if kind == "mean" and imu is not None:
        rows = rows[1:]  # the first mean belongs to an interval that begins before the log
    elif kind != "mean":
        rows[0, 0] = 0.0
    double, state = _run(algorithm, rows, q_nb, kind, single=False)
    single, _ = _run(algorithm, rows, q_nb, kind, single=True)
    # The rates of the angles, and their errors, have 1/cos(pitch) as a factor.
    condition = 1.0 / max(float(state[3]), 1e-3) if algorithm.name == "euler" else 1.0
    return Vector(rows, double, single, condition)


def _run(
    algorithm: AttitudeAlgorithm, rows: Array, q_nb: Array, kind: str, single: bool
) -> tuple[Array, Array]:
    number: Any = np.float32 if single else np.float64
    home = kernel_home(algorithm)

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


# Test at the end of the C file: a vector with its attitudes, and a filter for a pipe.


_TEST = """\
#ifdef ATTITUDE_TEST
#include <float.h>
#include <stdio.h>

#define SAMPLES {n}
#define LAG {lag} /* samples by which the attitude is behind */

{start}
/* dt in s, rates in rad/s; single precision holds each exactly. */
static const double samples[SAMPLES][4] = {{
{samples}
}};

/* q_nb at each sample, by the kernels of strapdown in the same precision. */
static const double expected[SAMPLES][4] = {{
#if JOIN(IS_, REAL) == IS_float
{single}
#else
{double}
#endif
}};

{bound}
#define EPSILON (sizeof(real_t) == sizeof(float) ? (double)FLT_EPSILON : DBL_EPSILON)
#define BOUND ({roundings} * EPSILON)

/* Angle between the attitude and an expected one, rad. */
static double apart(const struct attitude *a, const double *q_nb)
{{
    real_t q[4];
    double sum = 0.0, difference = 0.0;
    attitude_quaternion(a, q);
    for (int i = 0; i < 4; i++) {{
        difference += ((double)q[i] - q_nb[i]) * ((double)q[i] - q_nb[i]);
        sum += ((double)q[i] + q_nb[i]) * ((double)q[i] + q_nb[i]);
    }}
    return 2.0 * sqrt(difference < sum ? difference : sum);
}}

int main(void)
{{
    struct attitude a;
    double largest = 0.0;
    int failed = 0;
    attitude_init(&a, start);
    for (int k = 0; k < SAMPLES + LAG; k++) {{
        if (k < SAMPLES) {{
            const real_t gyro[3] = {{R(samples[k][1]), R(samples[k][2]), R(samples[k][3])}};
            failed |= attitude_update(&a, R(samples[k][0]), gyro);
        }}{finish}
        if (k >= LAG) {{
            const double angle = apart(&a, expected[k - LAG]);
            failed |= !(angle <= BOUND); /* so written NaN fails, too */
            largest = angle > largest ? angle : largest;
        }}
    }}
    printf("largest difference %.3g rad, bound %.3g rad: %s\\n", largest, BOUND,
        failed ? "FAILED" : "passed");
    return failed;
}}
#endif

#ifdef ATTITUDE_FILTER
#include <stdio.h>

static void put(const struct attitude *a)
{{
    real_t q[4];
    attitude_quaternion(a, q);
    for (int i = 0; i < 4; i++) {{
        printf("%.17g%c", (double)q[i], i < 3 ? ' ' : '\\n');
    }}
}}

int main(void)
{{
    static const real_t from[4] = {{{from_}}};
    struct attitude a;
    double dt, x, y, z;
    attitude_init(&a, from);
    while (scanf("%lf %lf %lf %lf", &dt, &x, &y, &z) == 4) {{
        const real_t gyro[3] = {{R(x), R(y), R(z)}};
        if (attitude_update(&a, R(dt), gyro)) {{
            fprintf(stderr, "refused: %g %g %g %g\\n", dt, x, y, z);
        }}
        put(&a);
    }}
{last}    return 0;
}}
#endif
"""
_FINISH = """ else {
            attitude_finish(&a);
        }"""
_LAST = """\
    attitude_finish(&a);
    put(&a);
"""


def main_program(vector: Vector, q_nb: Array, lag: int) -> str:
    """Return the end of the file, which is compiled only for a test.

    Parameters
    ----------
    vector : Vector
    q_nb : ndarray, (4,)
        Initial attitude.
    lag : int
        Delay of the attitude in samples.
    """
    from_ = ", ".join(f"R({float(v).hex()})" for v in q_nb)
    bound = (
        f"{len(vector.samples)} steps of {ROUNDINGS} roundings that another compiler or another "
        "sine may make otherwise"
    )
    if vector.condition > 1.0:
        bound += f", each magnified by 1/cos(pitch), here up to {vector.condition:.3g}"
    return _TEST.format(
        n=len(vector.samples),
        lag=lag,
        start=f"static const real_t start[4] = {{{from_}}};\n".replace("R(", "\n    R("),
        samples=_rows_main(vector.samples),
        single=_rows_main(vector.single),
        double=_rows_main(vector.double),
        bound="\n".join(comment(f"{bound}.")),
        roundings=f"{vector.roundings:.4g}".replace("e+0", "e"),
        finish=_FINISH if lag else "",
        last=_LAST if lag else "",
        from_=from_.replace("R(", "\n        R("),
    )


def _rows_main(values: Array) -> str:
    # Hexadecimal is exact.
    return "\n".join(f"    {{{', '.join(_hex(v) for v in row)}}}," for row in values)


def _hex(value: float) -> str:
    digits, _, power = float(value).hex().partition("p")
    if "." in digits:
        digits = digits.rstrip("0").rstrip(".")
    return f"{digits}p{power}"
