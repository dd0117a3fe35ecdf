"""Parts of a C file that is written from kernels: precision, constants, raw readings, test."""

from __future__ import annotations

import itertools
import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.export.configuration import Channel, SensorConfiguration
from strapdown.export.device import WIDTH, comment, number, wrapped
from strapdown.export.kernels import Kernels

Array = NDArray[np.float64]

# Math functions with a macro for each precision.
MACROS = (
    *("SQRT", "SIN", "COS", "ATAN2", "HYPOT", "FABS", "FMOD", "FMAX", "FMIN", "COPYSIGN"),
    *("EXP", "FMA", "TAN", "EXPM1", "LOG", "ASIN", "ACOS", "RINT", "CBRT"),
)


def precision_lines(body: str, types: Sequence[str] = (), default: str = "float") -> str:
    """Type of a number and the functions of the math library in use, for each precision.

    `types`: definitions of what functions return. `default`: precision without ``-DREAL``.
    """
    used = [m for m in MACROS if re.search(rf"\b{m}\(", body)]
    single = "\n".join(f"#define {m} {m.lower()}f" for m in used)
    double = "\n".join(f"#define {m} {m.lower()}" for m in used)
    results = "\n".join(["", *types, ""]) if types else ""
    pi = "#define PI R(3.141592653589793)\n" if re.search(r"\bPI\b", body) else ""
    return f"""\
#include <math.h>

#ifndef REAL
#define REAL {default}
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
{pi}{results}"""


def constant_lines(kernels: Kernels) -> str:
    """Definitions of the constants in use; a comment on several is above the first."""
    lines: list[str] = []
    before = ""
    for constant in kernels.constants():
        if constant.name == "LARGEST":
            continue  # that of the precision
        if constant.comment and constant.comment != before:
            lines += comment(constant.comment)
        before = constant.comment
        lines.append(f"#define {constant.name} {number(constant.value)}")
    return "\n".join([*lines, ""]) if lines else ""


# Test vector: a short record and its attitudes in double and single precision.


SAMPLES = 48
# Rounding of a step that may differ between compilers (fused products, their own sine): a
# product of quaternions is four sums of four products, 4 roundings of half an eps each, and so
# 2 eps a component, 4 eps in the vector of four, 8 eps as an angle; the same again for the
# quaternion of the increment; and both runs may have them.
ROUNDINGS = 32


@dataclass(frozen=True)
class Vector:
    """A test vector.

    `samples` ((n, 4)): dt in s and the rates in rad/s, or of a configured sensor ((n, 3)) raw
    readings, each exactly representable in single precision. `double`, `single` ((n, 4)): attitude
    at each sample from the kernels in either precision. `condition`: factor by which the algorithm
    magnifies an error near its singularity.
    """

    samples: Array
    double: Array
    single: Array
    condition: float

    @property
    def roundings(self) -> float:
        """Largest difference between two correct implementations, in eps of the precision."""
        return len(self.samples) * ROUNDINGS * self.condition


# Test at the end of the C file: a vector with its attitudes, and a filter for a pipe.

_TEST = """\
#ifdef ATTITUDE_TEST
#include <float.h>
#include <stdio.h>

#define ROWS {n}
#define LAG {lag} /* samples by which the attitude is behind */

{start}{what}
static const double samples[ROWS][{columns}] = {{
{samples}
}};

/* q_nb at each sample, by the kernels of strapdown in the same precision. */
static const double expected[ROWS][4] = {{
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
    attitude_init(&a, {begin});
    for (int k = 0; k < ROWS + LAG; k++) {{
        if (k < ROWS) {{
{take}
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
{from_}    struct attitude a;
    attitude_init(&a, {begin});
{read}
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


@dataclass(frozen=True)
class Pipe:
    """How a test passes samples to the functions of the file.

    `take`: statements that give sample k to it. `read`: those that read lines of the pipe and give
    them. `columns`: what a sample consists of, in words. `bound`: why the bound is what it is.
    `start` ((4,)): initial attitude; None: found from the samples. `lag`: delay of the attitude in
    samples.
    """

    take: str
    read: str
    columns: str
    bound: str
    start: Array | None = None
    lag: int = 0


def main_program(vector: Vector, pipe: Pipe) -> str:
    """Return the end of the file, which is compiled only for a test."""
    words = f"{pipe.columns[0].upper()}{pipe.columns[1:]}"
    begin = ("", "0") if pipe.start is None else (_start("start", pipe.start), "start")
    return _TEST.format(
        what="\n".join(comment(f"{words}; single precision holds each exactly.")),
        columns=vector.samples.shape[1],
        take=pipe.take,
        read=pipe.read,
        n=len(vector.samples),
        lag=pipe.lag,
        start=begin[0],
        begin=begin[1],
        samples=braced(vector.samples),
        single=braced(vector.single),
        double=braced(vector.double),
        bound="\n".join(comment(f"{pipe.bound}.")),
        roundings=f"{vector.roundings:.4g}".replace("e+0", "e"),
        finish=_FINISH if pipe.lag else "",
        last=_LAST if pipe.lag else "",
        from_="" if pipe.start is None else f"    {_start('start', pipe.start)}",
    )


def _start(name: str, q_nb: Array) -> str:
    values = ", ".join(f"R({float(v)!r})" for v in q_nb)
    return f"static const real_t {name}[4] = {{{values}}};\n".replace("R(", "\n        R(")


def unit_lines(configuration: SensorConfiguration, sensors: Sequence[str]) -> str:
    """Definitions of the step and of the units of raw readings."""
    lines = [
        f"#define ATTITUDE_STEP {number(1.0 / configuration.rate_hz)} "
        f"/* s, at {configuration.rate_hz:.10g} Hz */"
    ]
    for sensor in sensors:
        channel: Channel = getattr(configuration, sensor)
        if channel.scale != 1.0:
            of = {"gyro": "rad/s, of", "accel": "m/s², of", "mag": "of"}[sensor]
            scale = number(float(channel.scale))
            lines.append(
                f"#define {sensor.upper()}_UNIT {scale} /* {of} a reading in {channel.unit} */"
            )
    return "\n".join([*lines, "", ""])


def c_rows(channel: Channel, name: str, unit: str) -> str:
    """Initializers of the numbers of the body from a raw reading."""
    rows = channel.expressions(name, unit, number)
    return "\n".join(line for row in rows for line in wrapped(f"{row},", "        ")) + "\n"


def braced(values: Array) -> str:
    """Rows of numbers in braces, as C reads them."""
    # The shortest decimals that are read as the same double: C++11 has no hexadecimal ones.
    rows = (f"{{{', '.join(repr(float(v)) for v in row)}}}," for row in values)
    lines = (
        textwrap.wrap(row, WIDTH, initial_indent="    ", subsequent_indent="        ")
        for row in rows
    )
    return "\n".join(itertools.chain.from_iterable(lines))
