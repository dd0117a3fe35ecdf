"""The crash detection of a live run as one C99 file with a test vector."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from strapdown._kernels import arithmetic
from strapdown._kernels import crash_trigger as kernel
from strapdown.export.device import comment, device_translator, unpacked
from strapdown.export.kernels import Kernels
from strapdown.export.program import (
    ROUNDINGS,
    braced,
    constant_lines,
    precision_lines,
)
from strapdown.tables.checks import Array

HOME = "strapdown._kernels.crash_trigger"
#: Samples of the test, and those before its crash; the step is exact in single precision.
SAMPLES, BEFORE, STEP = 340, 300, 0.0078125
#: Terms of the expected rows: delta-V forward and right, their variances and covariance.
TERMS = 5


def export_detector(
    errors: Sequence[float],
    variance: float,
    *,
    mean: bool = False,
    calibration: Sequence[float] = (),
) -> str:
    """Write the detection as C99, translated from the kernel that `CrashWatch` runs.

    `errors`, `variance`, `mean`: as in `WatchOptions`. `calibration`: its `bias`, `scale` and
    `axes`, 21 numbers, which the caller of the C takes off; they are in the first comment. Returns
    the text of the file.
    """
    kernels = Kernels(HOME)
    for name in ("begin", "spread"):
        kernels.require(name)
    kernels.require("take", {"mean": (mean, mean)})
    translator = device_translator()
    functions = kernels.in_c(translator)
    body = "\n".join(functions)
    codes = {name: getattr(kernel, name) for name in CODES}
    used = {c.name for c in kernels.constants()}
    more = "".join(f"#define {n} {v}\n" for n, v in codes.items() if n not in used)
    parts = [
        _header(mean, calibration),
        precision_lines(body + _WRAPPER, translator.names.text),
        constant_lines(kernels) + more,
        _INTERFACE.format(size=kernel.SIZE),
        body,
        _WRAPPER.format(
            errors=",\n    ".join(f"R({float(v)!r})" for v in errors),
            variance=f"R({float(variance)!r})",
            variances=unpacked(
                "spread(state, stated_errors)", [f"variance[{i}]" for i in range(3)]
            ),
        ),
        _test(np.asarray(errors, dtype=np.float64), variance, mean),
    ]
    return "\n".join(parts)


CODES = ("QUIET", "AWAKE", "TRIGGERED", "ENDED", "INTERRUPTED")


def _header(mean: bool, calibration: Sequence[float]) -> str:
    version = importlib.import_module("strapdown").__version__
    taken = "the mean over the dt that ends with it" if mean else "the value at its instant"
    rows = [", ".join(f"{v:.9g}" for v in calibration[k : k + 3]) for k in range(0, 21, 3)]
    calibrated = (
        "The errors below are those that a calibration left. Take it off the x, y, z of the "
        f"recorder: rates less ({rows[0]}) rad/s, over one plus ({rows[2]}); forces less "
        f"({rows[1]}) m/s², over one plus ({rows[3]}); then turn both by the rows "
        f"({'), ('.join(rows[4:])})."
    )
    lines = [
        "Crash detection and delta-V so far, after 49 CFR 563.5(b): 8 km/h forward or right "
        f"within 150 ms. Written by strapdown {version} from the kernel that it runs itself.",
        f"A sample is {taken}, in the axes of the vehicle, forward-right-down: specific force in "
        "m/s², yaw rate in rad/s (0 without a gyro), and 1 where the force forward, and right, is "
        "at the end of its range. dt is in s.",
        *([calibrated] if calibration else []),
        "The trigger is known at the sample at which the threshold is met. At least 100 samples a "
        "second. Each sample costs two passes over at most "
        f"{kernel.SLOTS} slots; memory in single precision: {4 * kernel.SIZE} bytes.",
        "Single precision; -DREAL=double for double. Test: cc -std=c99 -O2 -DCRASH_TEST crash.c "
        "-lm && ./a.out.",
        "SPDX-License-Identifier: MIT. Copyright (c) 2026 The strapdown developers.",
    ]
    return "\n".join(comment("\n\n".join(lines))) + "\n"


_INTERFACE = """\
struct crash {{
    real_t state[{size}];
}};

/* Before the first sample. */
void crash_init(struct crash *c);

/* Take a sample: returns QUIET, AWAKE (a change that may become a crash), TRIGGERED from the
 * trigger on, ENDED once at its end, INTERRUPTED where more than 150 ms of samples are missing
 * in it; or -1 for a sample that is refused (dt not above zero, or not finite) and has changed
 * nothing. The dt of the first sample only has to be above zero.
 */
int crash_update(struct crash *c, real_t dt, const real_t sample[6]);

/* Delta-V since time zero forward and right, m/s, in the axes at time zero; its variances and
 * covariance, (m/s)^2, where 95 % are 1.96 standard deviations; bit 0 and 1: at least so much
 * forward, right, as a sample was clipped. Valid where crash_update returned TRIGGERED or more.
 */
int crash_delta_v(const struct crash *c, real_t delta_v[2], real_t variance[3]);
"""

_WRAPPER = """\
static const real_t stated_errors[6] = {{
    {errors}
}};

void crash_init(struct crash *c)
{{
    begin(c->state, {variance});
}}

int crash_update(struct crash *c, real_t dt, const real_t sample[6])
{{
    /* Written so, NaN is refused, too. */
    int good = dt > R(0.0) && dt < LARGEST;
    for (int i = 0; i < 6; i++) {{
        good = good && FABS(sample[i]) < LARGEST;
    }}
    return good ? take(c->state, dt, sample) : -1;
}}

int crash_delta_v(const struct crash *c, real_t delta_v[2], real_t variance[3])
{{
    const real_t *state = c->state;
{variances}
    delta_v[0] = state[DELTA];
    delta_v[1] = state[DELTA + 1];
    return (state[SAFE] <= state[SINCE]) + 2 * (state[SAFE + 1] <= state[SINCE]);
}}
"""


def crash_samples() -> Array:
    """Samples of the test, (n, 7): dt, forces, yaw rate, clipped forward and right.

    A drive with slight noise and a slope, then an oblique crash of 86 ms that turns the vehicle,
    clipped in one sample, and what follows until the event ends. Each number is one of single
    precision.
    """
    rng = np.random.default_rng(563)
    rows = np.zeros((SAMPLES, 7))
    rows[:, 0] = STEP
    rows[:, 1:4] = rng.normal((1.3, -0.9, -9.8), 0.05, (SAMPLES, 3))
    rows[BEFORE : BEFORE + 11, 1] -= 240.0 * np.sin(np.linspace(0.0, np.pi, 11))
    rows[BEFORE : BEFORE + 11, 2] += 90.0 * np.sin(np.linspace(0.0, np.pi, 11))
    rows[BEFORE:, 4] = np.minimum(2.0, 0.25 * np.arange(SAMPLES - BEFORE))
    # Few digits, so that the file is short.
    rows[:, 1:4] = np.round(64.0 * rows[:, 1:4]) / 64.0
    rows[BEFORE + 5, 5] = 1.0
    return rows.astype(np.float32).astype(np.float64)


def run_samples(rows: Array, errors: Array, variance: float, mean: bool, single: bool) -> Array:
    """Code and terms after each sample by the kernel in either precision, (n, 1 + 5)."""
    number: Any = np.float32 if single else np.float64
    module = arithmetic.single_precision(HOME) if single else kernel
    state = np.zeros(kernel.SIZE, number)
    module.begin(state, number(variance))
    stated, out = errors.astype(number), np.zeros((len(rows), 1 + TERMS))
    for k, row in enumerate(rows.astype(number)):
        out[k, 0] = module.take(state, mean, number(row[0]), np.ascontiguousarray(row[1:]))
        out[k, 1:3] = state[kernel.DELTA : kernel.DELTA + 2]
        out[k, 3:] = module.spread(state, stated)
    return out


_TEST = """\
#ifdef CRASH_TEST
#include <float.h>
#include <stdio.h>

#define SAMPLES {n}
#define FIRST {first} /* of the event */

/* dt, forces, yaw rate, clipped forward and right; single precision holds each exactly. */
static const double samples[SAMPLES][7] = {{
{samples}
}};

/* Result of crash_update. */
static const int codes[SAMPLES] = {{
{codes}
}};

/* From FIRST on: delta-V, variances and covariance by the kernel in the same precision. */
static const double expected[SAMPLES - FIRST][5] = {{
#if JOIN(IS_, REAL) == IS_float
{single}
#else
{double}
#endif
}};

{bound}
#define EPSILON (sizeof(real_t) == sizeof(float) ? (double)FLT_EPSILON : DBL_EPSILON)
#define BOUND ({roundings} * EPSILON)

int main(void)
{{
    struct crash c;
    double largest = 0.0;
    int failed = 0;
    crash_init(&c);
    for (int k = 0; k < SAMPLES; k++) {{
        real_t sample[6], v[5];
        for (int i = 0; i < 6; i++) {{
            sample[i] = R(samples[k][i + 1]);
        }}
        failed |= crash_update(&c, R(samples[k][0]), sample) != codes[k];
        if (k >= FIRST) {{
            failed |= crash_delta_v(&c, v, v + 2) != {clipped};
            for (int i = 0; i < 5; i++) {{
                const double off = fabs((double)v[i] - expected[k - FIRST][i]);
                failed |= !(off <= BOUND); /* so written NaN fails, too */
                largest = off > largest ? off : largest;
            }}
        }}
    }}
    printf("largest difference %.3g m/s, bound %.3g m/s: %s\\n", largest, BOUND,
        failed ? "FAILED" : "passed");
    return failed;
}}
#endif
"""


def _test(errors: Array, variance: float, mean: bool) -> str:
    rows = crash_samples()
    runs = [run_samples(rows, errors, variance, mean, single) for single in (False, True)]
    event = np.flatnonzero(runs[0][:, 0] >= kernel.TRIGGERED)
    # The sample after the clipped one is the first to be compared, to the end of the event.
    first, last = max(int(event[0]), BEFORE + 6), int(event[-1]) + 1
    double, single = (run[first:last, 1:] for run in runs)
    scale = float(np.abs(double).max())
    text = (
        f"{last} samples, each with {ROUNDINGS} roundings that another compiler or another sine "
        f"may make otherwise, of numbers up to {scale:.3g}."
    )
    codes = [str(int(v)) for v in runs[0][:last, 0]]
    lines = [", ".join(codes[i : i + 24]) for i in range(0, last, 24)]
    return _TEST.format(
        n=last,
        first=first,
        samples=braced(rows[:last]),
        codes="    " + ",\n    ".join(lines),
        single=braced(single),
        double=braced(double),
        bound="\n".join(comment(text)),
        roundings=f"{last * ROUNDINGS * scale:.4g}".replace("e+0", "e"),
        clipped=1,
    )
