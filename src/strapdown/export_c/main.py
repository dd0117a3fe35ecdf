"""The test at the end of the C file: a vector with its attitudes, and a filter from a pipe."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.export_c.layout import comment
from strapdown.export_c.vector import ROUNDINGS, Vector

Array = NDArray[np.float64]

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
    """Return the end of the file: what is compiled for a test alone.

    Parameters
    ----------
    vector : Vector
    q_nb : ndarray, (4,)
        Where it starts.
    lag : int
        Samples by which the attitude is behind.
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
        samples=_rows(vector.samples),
        single=_rows(vector.single),
        double=_rows(vector.double),
        bound="\n".join(comment(f"{bound}.")),
        roundings=f"{vector.roundings:.4g}".replace("e+0", "e"),
        finish=_FINISH if lag else "",
        last=_LAST if lag else "",
        from_=from_.replace("R(", "\n        R("),
    )


def _rows(values: Array) -> str:
    # Hexadecimal loses nothing.
    return "\n".join(f"    {{{', '.join(_hex(v) for v in row)}}}," for row in values)


def _hex(value: float) -> str:
    digits, _, power = float(value).hex().partition("p")
    if "." in digits:
        digits = digits.rstrip("0").rstrip(".")
    return f"{digits}p{power}"
