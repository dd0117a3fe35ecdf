"""What is around the kernels in the C file: the structure, its start, one sample, its reading.

This is the part of `AttitudeTracker` and of each algorithm's `begin` and `quaternions` that is
no kernel, written once in C. The formulas it calls are translated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from strapdown.attitude import AttitudeAlgorithm

_PLACES = "&q_nb[0], &q_nb[1], &q_nb[2], &q_nb[3]"
_UNIT = f"quat_normalise(a->state[0], a->state[1], a->state[2], a->state[3],\n        {_PLACES});"
_ANGLES = f"quat_from_euler(a->state[0], a->state[1], a->state[2],\n        {_PLACES});"
_FROM_ANGLES = "euler_from_quat(w, x, y, z, &a->state[0], &a->state[1], &a->state[2]);"
_COPY = """a->state[0] = w;
    a->state[1] = x;
    a->state[2] = y;
    a->state[3] = z;"""
_ROWS = """quat_from_dcm({0}[0], {0}[1], {0}[2], {0}[3], {0}[4], {0}[5],
        {0}[6], {0}[7], {0}[8], &q_nb[0], &q_nb[1], &q_nb[2], &q_nb[3]);"""

# The rotation nearest in Frobenius norm. Newton's step finds it from every matrix whose
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
    """How an algorithm's state begins and is read.

    Attributes
    ----------
    state : str
        What its numbers are.
    begin, read : str
        Statements: from w, x, y, z into ``a->state``; from there into ``q_nb``.
    begun : int
        Numbers of the state that `begin` sets; the rest is zero.
    kernels : tuple of str
        What these call.
    ranges : callable
        Least and greatest value of whole numbers that a kernel works out at run time.
    """

    state: str
    begin: str
    read: str
    begun: int
    kernels: tuple[str, ...]
    ranges: Callable[[AttitudeAlgorithm], dict[str, tuple[int, int]]] = field(
        default=lambda algorithm: {}
    )


_BY_QUATERNION = Shape("quaternion w, x, y, z", _COPY, _UNIT, 4, ())
_BY_MATRIX = Shape(
    "C_nb row by row, steps since it was orthogonalised",
    "dcm_from_quat(w, x, y, z, a->state);",
    _ROWS.format("a->state"),
    9,
    ("dcm_from_quat", "quat_from_dcm"),
)
_TRUNCATED = Shape(
    _BY_MATRIX.state,
    _BY_MATRIX.begin,
    NEAREST + _ROWS.format("m"),
    9,
    (*_BY_MATRIX.kernels, "orthogonalise"),
)

SHAPES: dict[str, Shape] = {
    "naive": Shape("roll, pitch, heading, rad", _FROM_ANGLES, _ANGLES, 3, ("quat_from_euler",)),
    "euler": Shape(
        "roll, pitch, heading, rad; least |cos pitch|, its step, steps",
        f"{_FROM_ANGLES}\n    a->state[3] = FABS(COS(a->state[1]));",
        _ANGLES,
        4,
        ("quat_from_euler",),
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
        lambda algorithm: {"done": (0, int(algorithm.kernel_options()[0]) - 1)},
    ),
}


def shape_of(algorithm: AttitudeAlgorithm) -> Shape:
    """Return how the state of an algorithm begins and is read."""
    if algorithm.name == "dcm" and algorithm.kernel_options()[0]:
        return _TRUNCATED
    return SHAPES[algorithm.name]


# --- one sample, by what a sample is and how rates run between samples ----------------------


@dataclass(frozen=True)
class Sampling:
    """How samples become steps.

    Attributes
    ----------
    words : str
        What the header says of it.
    memory : str
        What the structure remembers, as declarations.
    code : str
        The functions; ``STEP`` stands for the call of the algorithm.
    bytes : int
        What the structure remembers takes in single precision.
    lag : int
        Samples by which the attitude is behind.
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

ENDS = """\
void attitude_init(struct attitude *a, const real_t q_nb[4])
{{
    real_t w, x, y, z;
    quat_normalise(q_nb[0], q_nb[1], q_nb[2], q_nb[3], &w, &x, &y, &z);
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
    euler_from_quat(q[0], q[1], q[2], q[3], &euler[0], &euler[1], &euler[2]);
}}
"""
