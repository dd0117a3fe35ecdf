"""The kernels in single precision, and counted."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from strapdown._kernels import arithmetic, rotation
from strapdown._kernels import attitude as double
from strapdown._kernels import rotation_vector as double_vector

STEPS = {
    **dict.fromkeys(("naive", "euler", "dcm", "quaternion", "rk4"), "attitude"),
    "rotvec": "rotation_vector",
}


def arguments(kind, steps=50):
    rng = np.random.default_rng(1)
    state = np.zeros(25, kind)
    state[0] = state[4] = 1.0
    shape = (steps, 3)
    return (
        state,
        np.full(steps, 0.01, kind),
        rng.normal(0.0, 0.01, shape).astype(kind),
        rng.normal(0.0, 0.001, shape).astype(kind),
        np.empty((steps, 3 if kind is None else 9), kind),
        kind(2.0),
        kind(0.0),
    )


LOOK = """
import sys
sys.path.insert(0, sys.argv[1])
from test_arithmetic import STEPS, arguments, arithmetic, np
for name, home in STEPS.items():
    advance = getattr(arithmetic.single_precision(home), f"{name}_advance")
    advance(*arguments(np.float32))
    (code,) = advance.inspect_llvm().values()
    # Numba unpacks the two options, handed over as Python numbers, by way of doubles.
    operations = [
        line for line in code.splitlines() if "double" in line and "PyFloat_AsDouble" not in line
    ]
    assert len(operations) <= 2, (name, operations[:5])
    assert "fadd float" in code or "load float" in code, name
"""


@pytest.mark.slow
def test_single_precision_is_single_in_every_operation(tmp_path):
    """In a process and a cache of its own: numba shows the code of what it has just compiled."""
    done = subprocess.run(
        [sys.executable, "-c", LOOK, str(Path(__file__).parent)],
        env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "STRAPDOWN_KERNELS": "numba"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-2000:]


@pytest.mark.parametrize("name", STEPS)
def test_single_precision_is_near_double(name):
    single, exact = arguments(np.float32), arguments(np.float64)
    # The same inputs, so that only the arithmetic differs.
    exact = (exact[0], *(a.astype(np.float64) for a in single[1:4]), exact[4], 2.0, 0.0)
    getattr(arithmetic.single_precision(STEPS[name]), f"{name}_advance")(*single)
    getattr(double_vector if name == "rotvec" else double, f"{name}_advance")(*exact)
    width = {"naive": 3, "euler": 3, "dcm": 9}.get(name, 4)
    apart = np.abs(single[4][:, :width] - exact[4][:, :width]).max()
    # 50 steps of a dozen roundings of 2^-24 each, at random: sqrt(600) of them, times 5; and
    # not none, or it was not done in single precision.
    assert 0.0 < apart < 5 * np.sqrt(600) * 2.0**-24


def test_a_count_by_hand():
    """A quaternion product is 16 multiplications and 12 additions; a norm 4, 3 and a root."""
    count = Counter()

    def numbers(*values):
        return [arithmetic.Counted(v, count) for v in values]

    product = arithmetic.counted_kernels("rotation").quat_multiply(
        *numbers(1, 0, 0, 0, 0.6, 0.8, 0, 0)
    )
    assert [float(p) for p in product] == [0.6, 0.8, 0.0, 0.0]
    assert count == {"multiply": 16, "add": 12}
    count.clear()
    arithmetic.counted_kernels("rotation").quat_normalise(*numbers(0.6, 0.8, 0.0, 0.0))
    assert count == {"multiply": 8, "add": 3, "divide": 1, "sqrt": 1}
    count.clear()
    arithmetic.counted_kernels("rotation").wrap_pi(*numbers(4.0))
    assert count == {"divide": 1, "add": 1}
    count.clear()
    arithmetic.counted_kernels("attitude").naive_step(
        numbers(0, 0, 0), *numbers(0.01, 1, 2, 3, 0, 0, 0), 0, 0
    )
    assert count == {"add": 3}


def test_counting_computes_what_the_kernels_compute():
    count = Counter()
    for x in (0.01, 0.2, 3.0):
        found = arithmetic.counted_kernels("rotation").quat_from_rotvec(
            *(arithmetic.Counted(v, count) for v in (x, -x, 0.3))
        )
        expected = rotation.quat_from_rotvec(x, -x, 0.3)
        assert [float(f) for f in found] == pytest.approx(expected, rel=4e-16)
    assert count["trig"] == 2  # of the largest turn alone; the others by the series
