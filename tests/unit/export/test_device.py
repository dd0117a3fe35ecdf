"""Kernels that are like none of the package, as C for a device, beside themselves."""

from __future__ import annotations

import sys
from types import ModuleType

import numpy as np
import pytest
from tests.unit.export.test_algorithms_in_c import build, needs_compiler, run

from strapdown.export.device import device_translator
from strapdown.export.kernels import Kernels
from strapdown.export.program import constant_lines, precision_lines
from strapdown.export.translate import UntranslatableError

SOURCE = '''
import math

import numpy as np

from strapdown._kernels.compilation import fma, njit
from strapdown._kernels.ned import STATE
from strapdown._kernels.wander import STATE as WIDER

FIRST, LAST = 0, 3
# What is added in a round.
STEP = 0.25


@njit(cache=True)
def carried(x, out):
    """A number that lives from round to round, and one that does not."""
    for i in range(4):
        if i == 0:
            before = x
        now = before * 0.5 + STEP
        out[i] = now - before
        before = now


@njit(cache=True)
def ways(x, out):
    if x < -1.0:
        out[0] = 1.0
    elif x < 0.0:
        out[0] = 2.0
    else:
        if x > 3.0:
            out[0] = 3.0
            return
        out[0] = 4.0
    for i in range(9, 0, -2):
        if i == 5:
            continue
        if i * x > 40.0:
            break
        out[1] += i
    while out[1] > 7.0:
        out[1] -= 1.5
    out[2] = float(int(x) + 7 % 4) + (1.0 if -1.0 <= x < 2.0 else 0.0)
    out[3] = STATE + 0.5 * WIDER


@njit(cache=True)
def pair(p, x):
    return (p[1], p[0] + x), x * x


@njit(cache=True)
def tuples(x, out):
    p = (x, 2.0 * x)
    p, square = pair(p, x)
    (out[0], out[1]), _unused = pair(p, square)
    out[2], out[LAST] = out[0] + p[FIRST], max(square, x, 1.0) - min(x, 0.5)


@njit(cache=True)
def both(rows, y):
    n, m = rows.shape
    made, sums = np.zeros((n, m)), np.zeros(n)
    for i in range(n):
        row, to = rows[i], made[i]
        for j in range(m):
            to[j] = fma(row[j], y, STEP)
            sums[i] += to[j]
    return made, sums


@njit(cache=True)
def matrices(x, out):
    a = np.empty((2, 3))
    for i in range(2):
        for j in range(3):
            a[i, j] = x + i - j
    made, sums = both(a, x)
    out[0], out[1], out[2], out[3] = made[0, 2], made[1, 1], sums[0], math.fmod(sums[1], 1.0)


@njit(cache=True)
def unbounded(x, out):
    a = np.empty(int(x))
    out[0] = a[0]
'''
VALUES = (-2.5, -0.75, 0.125, 1.75, 2.5, 7.0)


@pytest.fixture
def kernels(tmp_path, monkeypatch):
    """The module above, as a plug-in brings one, and its kernels."""
    (tmp_path / "drawn_kernels.py").write_text(SOURCE)
    module = ModuleType("drawn_kernels")
    module.__file__ = str(tmp_path / "drawn_kernels.py")
    exec(compile(SOURCE, "drawn_kernels", "exec"), vars(module))
    monkeypatch.setitem(sys.modules, "drawn_kernels", module)
    return module


def python_of(function):
    return getattr(function, "py_func", function)


@needs_compiler
@pytest.mark.parametrize("name", ["carried", "ways", "tuples", "matrices"])
def test_the_c_gives_what_the_kernel_gives(tmp_path, kernels, name):
    made = Kernels("drawn_kernels")
    made.require(name)
    translator = device_translator()
    body = "\n".join(made.in_c(translator))
    main = f"""
#include <stdio.h>
int main(void)
{{
    double x;
    while (scanf("%la", &x) == 1) {{
        double out[4] = {{0}};
        {name}(x, out);
        printf("%a %a %a %a\\n", out[0], out[1], out[2], out[3]);
    }}
    return 0;
}}
"""
    text = precision_lines(body, translator.names.text) + constant_lines(made) + body + main
    program = build(tmp_path, text, "-DREAL=double")
    lines = run(program, "\n".join(v.hex() for v in VALUES)).splitlines()
    for x, line in zip(VALUES, lines, strict=True):
        out = np.zeros(4)
        python_of(getattr(kernels, name))(x, out)
        np.testing.assert_array_equal([float.fromhex(v) for v in line.split()], out)
    if name == "ways":
        # Two constants of one name, of two modules.
        assert "#define STATE 15" in text and "#define WANDER_STATE 31" in text
        assert "} else if (x < R(0.0)) {" in text
    if name == "carried":
        assert "/* What is added in a round. */\n#define STEP R(0.25)" in text


def test_an_array_of_unknown_size_is_refused(kernels):
    made = Kernels("drawn_kernels")
    made.require("unbounded")
    with pytest.raises(UntranslatableError, match=r"line \d+ of unbounded: array whose size"):
        made.in_c(device_translator())


def test_an_option_leaves_out_what_it_excludes(kernels):
    made = Kernels("drawn_kernels")
    made.require("ways", {"x": (-2.0, -2.0)})
    (text,) = made.in_c(device_translator())
    assert "out[0] = R(1.0);" in text and "else" not in text and "real_t x" not in text
