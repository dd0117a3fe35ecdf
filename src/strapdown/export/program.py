"""Parts of a C file that is written from kernels: precision, constants, raw readings, test."""

from __future__ import annotations

import itertools
import re
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from strapdown.constants import Array
from strapdown.export.configuration import Channel, SensorConfiguration
from strapdown.export.device import comment, number
from strapdown.export.kernels import Kernels
from strapdown.export.sources import Kernel
from strapdown.export.types_of_c import WIDTH, wrapped

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


# Test at the end of a C file, and a program that takes rows from a pipe.

_PROGRAM = """\
#ifdef {upper}_TEST
#include <float.h>
#endif
#if defined {upper}_TEST || defined {upper}_FILTER
#include <stdio.h>

{words}
#define COLUMNS {columns}
#define RESULTS {results}

static void test_start(struct {name} *s)
{{
{start}
}}

/* Take a row. Returns the number of its results, {refusal} if it is refused. */
static int test_take(struct {name} *s, const double *v, double *out)
{{
{take}
}}
#endif

#ifdef {upper}_TEST
{data}
{bound}
#define EPSILON (sizeof(real_t) == sizeof(float) ? (double)FLT_EPSILON : DBL_EPSILON)
#define BOUND ({roundings} * EPSILON)

int main(void)
{{
    static struct {name} s;
    static double v[COLUMNS], out[RESULTS];
    double largest = 0.0;
    int failed = 0;
    test_start(&s);
    for (int k = 0; k < ROWS{plus}; k++) {{
{row}
        if (k >= TEST_FIRST) {{
            const double off = test_apart(out, test_expected[k - TEST_FIRST]);
            failed |= !(off <= BOUND); /* so written NaN fails, too */
            largest = off > largest ? off : largest;
        }}
    }}
    printf("largest difference %.3g{unit}, bound %.3g{unit}: %s\\n", largest, BOUND,
        failed ? "FAILED" : "passed");
    return failed;
}}
#endif

#ifdef {upper}_FILTER
static void test_put(int count, const double *out)
{{
    for (int i = 0; i < count; i++) {{
        printf("%.17g%c", out[i], i + 1 < count ? ' ' : '\\n');
    }}
}}

int main(void)
{{
    static struct {name} s;
    static double v[COLUMNS], out[RESULTS];
    int column = 0;
    test_start(&s);
    while (scanf("%lf", v + column) == 1) {{
        column = (column + 1) % COLUMNS;
        if (column == 0) {{
            const int count = test_take(&s, v, out);
            if (count {refused}) {{
                fprintf(stderr, "refused\\n");
            }}
            test_put(count < 0 ? -count : count, out);
        }}
    }}
{last}    return column != 0;
}}
#endif
"""


@dataclass(frozen=True)
class Harness:
    """How a test passes rows of numbers to the functions of a file.

    `name`: of its structure, ``s`` is one. `columns`, `results`: numbers of a row and its results.
    `words`: what a row consists of. `start`: statements that begin. `take`: those that give a row
    ``v`` and fill ``out``. `finish`: those at the end, if there are any, which fill ``out``. `lag`:
    rows by which results are late. `answers`: whether each row has results, unless it is refused.
    """

    name: str
    columns: int
    results: int
    words: str
    start: str
    take: str
    finish: str = ""
    lag: int = 0
    answers: bool = False


def test_program(
    harness: Harness, data: str, row: str, bound: str, roundings: float, unit: str = ""
) -> str:
    """Return the end of a file, which is compiled only for a test.

    `data`: definitions of ROWS, of TEST_FIRST, the first row with a result that is compared, of
    ``test_expected`` and ``test_apart``. `row`: statements that put row k into ``v``. `bound`: why
    the bound is what it is. `roundings`: the bound in eps of the precision.
    """
    take = "failed |= test_take(&s, v, out) < 0;"
    rows = f"{row}\n        {take}"
    if harness.finish:
        inside = "\n".join(f"    {line}" for line in rows.split("\n"))
        finish = textwrap.indent(harness.finish, " " * 8)
        rows = f"        if (k < ROWS) {{\n{inside}\n        }} else {{\n{finish}\n        }}"
    return _PROGRAM.format(
        upper=harness.name.upper(),
        **{key: getattr(harness, key) for key in ("name", "columns", "results", "take")},
        refused="<= 0" if harness.answers else "< 0",
        refusal="none" if harness.answers else "less than none",
        words="\n".join(comment(f"Numbers of a row: {harness.words}.")),
        start=harness.start,
        data=data,
        bound="\n".join(comment(f"{bound}.")),
        roundings=f"{roundings:.4g}".replace("e+0", "e"),
        plus=" + TEST_FIRST" if harness.lag else "",
        row=rows,
        unit=unit,
        last=f"{harness.finish}\n    test_put(RESULTS, out);\n" if harness.finish else "",
    )


_APART = """\
/* Angle between the attitude and an expected one, rad. */
static double test_apart(const double *q, const double *q_nb)
{
    double sum = 0.0, difference = 0.0;
    for (int i = 0; i < 4; i++) {
        difference += (q[i] - q_nb[i]) * (q[i] - q_nb[i]);
        sum += (q[i] + q_nb[i]) * (q[i] + q_nb[i]);
    }
    return 2.0 * sqrt(difference < sum ? difference : sum);
}
"""


def attitude_harness(
    take: str, words: str, vector: Vector, start: Array | None, lag: int = 0
) -> Harness:
    """How a test passes rows to the functions of an attitude.

    `take`: statements that give a row ``v`` and set ``refused``. `start` ((4,)): initial attitude;
    None: found from the samples.
    """
    begin = "    attitude_init(s, 0);"
    if start is not None:
        values = ",\n        ".join(number(float(v)) for v in start)
        begin = f"    static const real_t start[4] = {{\n        {values}}};\n"
        begin += "    attitude_init(s, start);"
    read = """\
    real_t q[4];
    attitude_quaternion({}s, q);
    for (int i = 0; i < 4; i++) {{
        out[i] = (double)q[i];
    }}"""
    finish = f"    attitude_finish(&s);\n{read.format('&')}" if lag else ""
    taken = f"{take}\n{read.format('')}\n    return refused ? -RESULTS : RESULTS;"
    return Harness("attitude", vector.samples.shape[1], 4, words, begin, taken, finish, lag)


def attitude_test(harness: Harness, vector: Vector, bound: str) -> str:
    """Return the end of a file of an attitude: a vector with its attitudes."""
    data = f"""\
#define ROWS {len(vector.samples)}
#define TEST_FIRST {harness.lag} /* samples by which the attitude is behind */

/* Single precision holds each exactly. */
static const double test_rows[ROWS][COLUMNS] = {{
{braced(vector.samples)}
}};

/* q_nb at each sample, by the kernels of strapdown in the same precision. */
static const double test_expected[ROWS][RESULTS] = {{
#if JOIN(IS_, REAL) == IS_float
{braced(vector.single)}
#else
{braced(vector.double)}
#endif
}};

{_APART}"""
    row = """\
        for (int i = 0; i < COLUMNS; i++) {
            v[i] = test_rows[k][i];
        }"""
    return test_program(harness, data, row, bound, vector.roundings, " rad")


# A step that is none of an attitude.

#: Rows of the test, whose numbers follow from a seed.
ROWS = 64


@dataclass(frozen=True)
class StepParts:
    """Parts of a file.

    `harness`: how a test passes rows of numbers. `gives`: what results of a row are, in words.
    `step`: the kernel of a call, `call` that of the file. `before`: the kernel and the call that
    make what it takes, for each sample. `codes`: results by name. `rows` (two):
    middle and range of the numbers of a row. `run`: results of rows by the kernels, as far as
    there are any.
    """

    title: str
    words: Sequence[str]
    kernels: Kernels
    step: Kernel
    call: str
    memory: int
    codes: dict[str, int]
    interface: str
    code: str
    harness: Harness
    gives: str
    rows: Array
    run: Callable[[Array], Array]
    before: tuple[Kernel, str] | None = None


def drawn_rows(rows: Array, count: int) -> Array:
    """Rows of the test: a middle, and a range times a number of -1/2 to 1/2 that a seed gives."""
    middle, span = rows
    seed, out = 1, np.empty((count, len(middle)))
    for k in range(count):
        for j in range(len(middle)):
            seed = (seed * 1664525 + 1013904223) & 0xFFFFFFFF
            out[k, j] = middle[j] + span[j] * (seed / 4294967296.0 - 0.5)
    return out


def listed(values: Sequence[float] | Array, indent: str = " " * 8) -> str:
    """Literals of numbers, wrapped."""
    text = ", ".join(number(float(v)) for v in values)
    return "\n".join(wrapped(text, indent)).strip().replace("\n    " + indent, "\n" + indent)


# Test: rows that follow from a seed, and the results of the last one.

_STEP_DATA = """\
#define ROWS {rows}
#define TEST_FIRST (ROWS - 1)

/* Numbers of a row: a middle, and a range times what the seed gives, -1/2 to 1/2. */
static const double test_middle[COLUMNS] = {{
    {middle}}};
static const double test_range[COLUMNS] = {{
    {range}}};
/* Results of the last row, by the kernels of strapdown in double precision. */
static const double test_expected[1][RESULTS] = {{{{
    {expected}}}}};
/* Largest of each on the way. */
static const double test_largest[RESULTS] = {{
    {largest}}};

static double test_apart(const double *found, const double *expected)
{{
    double worst = 0.0;
    for (int i = 0; i < RESULTS; i++) {{
        const double off = fabs(found[i] - expected[i]) / test_largest[i];
        worst = off <= worst ? worst : off; /* so written NaN is kept */
    }}
    return worst;
}}
"""

_STEP_ROW = """\
        static unsigned long seed = 1;
        for (int i = 0; i < COLUMNS; i++) {
            seed = (seed * 1664525UL + 1013904223UL) & 0xffffffffUL;
            v[i] = test_middle[i] + test_range[i] * ((double)seed / 4294967296.0 - 0.5);
        }"""


def step_test(parts: StepParts) -> str:
    """Return the end of a file of a step."""
    count = ROWS
    found = parts.run(drawn_rows(parts.rows, count))
    while len(found) < 4:  # a low-pass waits for its first output
        count *= 2
        found = parts.run(drawn_rows(parts.rows, count))
    data = _STEP_DATA.format(
        rows=count,
        middle=_numbers(parts.rows[0]),
        range=_numbers(parts.rows[1]),
        expected=_numbers(found[-1]),
        largest=_numbers([float(f"{max(v, 1e-3):.2g}") for v in np.abs(found).max(axis=0)]),
    )
    bound = (
        f"{count} rows of {ROUNDINGS} roundings that another compiler or another sine may make "
        "otherwise, relative to the largest of each result"
    )
    return test_program(parts.harness, data, _STEP_ROW, bound, float(count * ROUNDINGS))


def _numbers(values: Sequence[float] | Array) -> str:
    text = ", ".join(repr(float(v)) for v in values)
    return "\n".join(wrapped(text, "    ")).strip().replace("\n        ", "\n    ")


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
