"""The crash detection of a live run as one C99 file with a test vector."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from strapdown._kernels import arithmetic
from strapdown._kernels import crash_trigger as kernel
from strapdown.export.device import device_translator
from strapdown.export.kernels import Kernels
from strapdown.export.program import ROUNDINGS, constant_lines, written
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
    functions = "\n".join(kernels.in_c(translator))
    used = {c.name for c in kernels.constants()}
    codes = {name: getattr(kernel, name) for name in CODES if name not in used}
    return written(
        "crash.c.jinja",
        head=_head(mean, calibration),
        types=translator.names.text,
        constants=constant_lines(kernels) + "".join(f"#define {n} {v}\n" for n, v in codes.items()),
        functions=functions,
        size=kernel.SIZE,
        errors=[float(v) for v in errors],
        variance=float(variance),
        **_tested(np.asarray(errors, dtype=np.float64), variance, mean),
    )


CODES = ("QUIET", "AWAKE", "TRIGGERED", "ENDED", "INTERRUPTED")


def _head(mean: bool, calibration: Sequence[float]) -> list[str]:
    version = importlib.import_module("strapdown").__version__
    taken = "the mean over the dt that ends with it" if mean else "the value at its instant"
    rows = [", ".join(f"{v:.9g}" for v in calibration[k : k + 3]) for k in range(0, 21, 3)]
    calibrated = (
        "The errors below are those that a calibration left. Take it off the x, y, z of the "
        f"recorder: rates less ({rows[0]}) rad/s, over one plus ({rows[2]}); forces less "
        f"({rows[1]}) m/s², over one plus ({rows[3]}); then turn both by the rows "
        f"({'), ('.join(rows[4:])})."
    )
    return [
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


def _tested(errors: Array, variance: float, mean: bool) -> dict[str, Any]:
    """Facts of the test: samples, and what the kernel makes of them."""
    rows = crash_samples()
    runs = [run_samples(rows, errors, variance, mean, single) for single in (False, True)]
    event = np.flatnonzero(runs[0][:, 0] >= kernel.TRIGGERED)
    # The sample after the clipped one is the first to be compared, to the end of the event.
    first, last = max(int(event[0]), BEFORE + 6), int(event[-1]) + 1
    double, single = (run[first:last, 1:] for run in runs)
    scale = float(np.abs(double).max())
    codes = [str(int(v)) for v in runs[0][:last, 0]]
    lines = [", ".join(codes[i : i + 24]) for i in range(0, last, 24)]
    return {
        "first": first,
        "samples": rows[:last],
        "codes": "    " + ",\n    ".join(lines),
        "single": single,
        "double": double,
        "bound": f"{last} samples, each with {ROUNDINGS} roundings that another compiler or "
        f"another sine may make otherwise, of numbers up to {scale:.3g}.",
        "roundings": last * ROUNDINGS * scale,
    }
