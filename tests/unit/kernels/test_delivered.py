"""Kernels translated to C and compiled: what Python calls is there, with Python's arithmetic."""

from __future__ import annotations

import ast
import math
import platform
import shutil
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest
from tools.kernels_to_c import build, signatures

import strapdown._kernels
from strapdown._kernels import compilation
from strapdown.export import sources

FOLDER = Path(strapdown._kernels.__file__).parent
SOURCE = """
import math
import numpy as np
from strapdown._kernels.compilation import IN_PLACE, dot, fma, njit

FIRST, SECOND = 0, 1
SCALE = 1.0 / 3.0


@njit(cache=True)
def whole(a, b):
    return a // b, a % b, a / b


@njit(cache=True)
def larger(a, b, c):
    return max(a, b, c), min(a, b, c)


@njit(cache=True)
def inside(a, x, b):
    return a <= x < b, x in (1.0, 2.0), not x > a


@njit(cache=True, error_model="numpy")
def over(a, b):
    return a / b


@njit(cache=True)
def over_or_error(a, b):
    return a / b


@njit(cache=True)
def changing(x):
    value = 3
    half = value // 2
    value = 0.5 * value * x
    pair = (value, half)
    value = pair
    return value[0], value[1], half


@njit(cache=True)
def counted(n):
    total, last = 0.0, -1
    for i in range(n, -1, -2):
        if i == 3:
            continue
        total += i * SCALE
        last = i
    while total > 4.0:
        total -= 1.5
        if total < 2.0:
            break
    for sign in (-1.0, 2.0):
        total *= sign
    return total, last, int(total)


@njit(**IN_PLACE)
def parts(rows, low, high, out):
    part = rows[low:high]
    out[FIRST] = part.shape[0]
    out[SECOND] = rows[-1, 0] + rows[0, :2].shape[0]
    column = rows[:, 1]
    for i in range(column.shape[0]):
        out[2] += column[i]
    out[3:] = 7.0
    rows[0] = rows[0]


@njit(cache=True)
def mean_rows(rows):
    n, m = rows.shape
    out = np.zeros(m)
    for i in range(n):
        for j in range(m):
            out[j] += rows[i, j] / n
    return out, [(1.0, 2.0)]


@njit(cache=True)
def reads(a, i):
    return a[i]


@njit(cache=True)
def reads_twice(a, i):
    first = reads(a, 0)
    second = reads(a, i)
    return first + second


@njit(cache=True)
def fused(a, b, c, d, n):
    return fma(a, b, c), dot(d, d, n), math.hypot(a, b), np.fmod(a, b), abs(-n)
"""
SIGNATURES = """
sample.whole(i8, i8)
sample.larger(f8, f8, f8)
sample.inside(f8, f8, f8)
sample.over(f8, f8)
sample.over_or_error(f8, f8)
sample.changing(f8)
sample.counted(i8)
sample.parts(f8[:,:], i8, i8, f8[:])
sample.mean_rows(f8[:,:])
sample.reads(f8[:], i8)
sample.reads_twice(f8[:], i8)
sample.fused(f8, f8, f8, f8[:], i8)
"""

compiler = pytest.mark.skipif(
    not build.system_compiler() or shutil.which(build.system_compiler()[0]) is None,
    reason="no C compiler",
)


def test_all_kernels_that_python_calls_have_signatures():
    kernels = {
        f"{k.module}.{k.name}"
        for space in sources.load(FOLDER).values()
        for k in space.values()
        if isinstance(k, sources.Kernel)
    }
    listed = signatures.read(build.HERE / "signatures.txt")
    called = set()
    for path in FOLDER.parent.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        if FOLDER in path.parents or sources.PACKAGE not in text:
            continue
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith(sources.PACKAGE):
                home = str(node.module).rpartition(".")[2]
                called |= {f"{home}.{item.name}" for item in node.names}
    assert called & kernels
    assert called & kernels <= set(listed)
    assert set(listed) <= kernels


@pytest.mark.skipif(compilation.MODE != "compiled", reason="numba compiles")
def test_delivered_kernels_are_of_these_sources_and_listed():
    assert sorted(compilation._COMPILED) == sorted(signatures.read(build.HERE / "signatures.txt"))


@pytest.fixture(scope="module", params=[(), ("-DSD_BOUNDS",)], ids=["plain", "bounds"])
def sample(request, tmp_path_factory):
    """The kernels above, compiled; and the same, interpreted."""
    folder = tmp_path_factory.mktemp("kernels")
    for name in ("compilation.py",):
        shutil.copy(FOLDER / name, folder)
    (folder / "sample.py").write_text(SOURCE)
    (folder / "signatures.txt").write_text(SIGNATURES)
    build.generate(folder, folder / "signatures.txt", folder, bool(request.param))
    levels = ["base", "v3"] if platform.machine() == "x86_64" else ["base"]
    made = build.compile_(folder, build.system_compiler(), ["-O1", *request.param], levels)
    spec = spec_from_file_location("_compiled", made)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return {name.rpartition(".")[2]: kernel for name, kernel in module.KERNELS.items()}


@compiler
def test_whole_numbers_divide_as_in_python(sample):
    for a, b in ((7, 2), (-7, 2), (7, -2), (-7, -2), (6, 3), (-6, 3), (0, 5)):
        assert sample["whole"](a, b) == (a // b, a % b, a / b)
    with pytest.raises(ZeroDivisionError):
        sample["whole"](1, 0)


@compiler
def test_larger_and_smaller_as_in_python_with_nan(sample):
    for row in ((1.0, 3.0, 2.0), (1.0, math.nan, 2.5), (math.nan, 1.0, 2.0), (0.0, -0.0, 0.0)):
        got = sample["larger"](*row)
        assert [math.copysign(1.0, g) for g in got] == [
            math.copysign(1.0, f(row)) for f in (max, min)
        ]
        np.testing.assert_array_equal(got, (max(row), min(row)))


@compiler
def test_comparisons(sample):
    for a, x, b in ((0.0, 1.0, 2.0), (0.0, 2.0, 2.0), (0.0, -1.0, 2.0), (math.nan, 1.0, 2.0)):
        assert sample["inside"](a, x, b) == (a <= x < b, x in (1.0, 2.0), not x > a)


@compiler
def test_division_by_zero_as_the_kernel_declares(sample):
    assert sample["over"](1.0, 0.0) == math.inf
    with pytest.raises(ZeroDivisionError):
        sample["over_or_error"](1.0, 0.0)
    assert sample["over_or_error"](1.0, 4.0) == 0.25


@compiler
def test_a_name_may_hold_unlike_values_in_turn(sample):
    assert sample["changing"](3.0) == (4.5, 1, 1)


@compiler
def test_loops(sample):
    total, last = 0.0, -1
    for i in range(9, -1, -2):
        if i != 3:
            total, last = total + i * (1.0 / 3.0), i
    while total > 4.0:
        total -= 1.5
        if total < 2.0:
            break
    total *= -2.0
    assert sample["counted"](9) == (total, last, int(total))


@compiler
def test_parts_of_arrays(sample):
    rows, out = np.arange(12.0).reshape(4, 3), np.zeros(6)
    for low, high in ((1, 3), (-2, 9), (3, 1)):
        out[:] = 0.0
        sample["parts"](rows, low, high, out)
        assert out.tolist() == [len(rows[low:high]), 11.0, rows[:, 1].sum(), 7.0, 7.0, 7.0]


@compiler
def test_arrays_and_lists_are_returned(sample):
    mean, pairs = sample["mean_rows"](np.arange(6.0).reshape(3, 2))
    assert mean.tolist() == [2.0, 3.0]
    assert pairs == [(1.0, 2.0)]


@compiler
def test_arguments_are_checked(sample):
    rows, out = np.ones((4, 3)), np.zeros(6)
    # Copied where the kernel only reads; an error where it writes.
    assert sample["mean_rows"](np.ones((2, 3), np.float32))[0].tolist() == [1.0, 1.0, 1.0]
    assert sample["mean_rows"](np.ones((3, 2)).T)[0].tolist() == [1.0, 1.0, 1.0]
    # Written back into another layout.
    wide = np.zeros((6, 2))
    sample["parts"](rows, 0, 1, wide[:, 1])
    assert wide.T.tolist() == [[0.0] * 6, [1.0, 3.0, 4.0, 7.0, 7.0, 7.0]]
    for wrong in (out.astype(np.float32), np.zeros((6, 2)), list(out), 1.0):
        with pytest.raises(TypeError, match=r"sample\.parts: argument 4"):
            sample["parts"](rows, 0, 1, wrong)
    out.flags.writeable = False
    with pytest.raises(TypeError, match="argument 4"):
        sample["parts"](rows, 0, 1, out)
    with pytest.raises(TypeError, match="takes 4 arguments"):
        sample["parts"](rows, 0, 1)


@compiler
def test_bounds_are_checked_in_the_build_for_it(sample, request):
    assert sample["reads"](np.arange(3.0), 2) == 2.0
    if "[bounds]" in request.node.name:
        line = SOURCE.splitlines().index("    return a[i]") + 1
        for name in ("reads", "reads_twice"):
            said = rf"sample\.{name}: index is out of bounds in sample\.py, line {line}$"
            for index in (3, -1):
                with pytest.raises(IndexError, match=said):
                    sample[name](np.arange(3.0), index)


@compiler
def test_fused_and_library_functions(sample):
    d = np.linspace(0.1, 1.0, 11)
    a, b = 1.0 + 2.0**-30, 1.0 - 2.0**-30
    got = sample["fused"](a, b, -1.0, d, 11)
    assert got[0] == compilation._fma_interpreted(a, b, -1.0) != a * b - 1.0
    assert got[1] == pytest.approx(float(d @ d), rel=1e-15)
    assert got[2:] == (math.hypot(a, b), math.fmod(a, b), 11)
