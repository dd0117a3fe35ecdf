"""A kernel is compiled once: not for each whole number, nor for arrays that cannot be written."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numba import config

import strapdown._kernels
from strapdown import rotation
from strapdown._kernels import rotation as kernel
from strapdown._kernels.compilation import MODE, njit
from strapdown.tables import GYRO, values_of

SOURCES = sorted(Path(strapdown._kernels.__file__).parent.glob("*.py"))


@pytest.mark.skipif(config.DISABLE_JIT, reason="nothing is compiled")
def test_whole_numbers_in_the_source_make_no_versions():
    @njit()
    def taken(values, at):
        return values[at], at + 2

    @njit()
    def total(values):
        at = 0  # a loop's variable: its first value is a number of the source
        out = taken(values, 1)[0] + taken(values, 3)[0]
        while at < values.shape[0]:
            value, at = taken(values, at)
            out += value
        return out

    assert total(np.arange(5.0)) == 10.0
    assert len(taken.signatures) == 1


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.stem)
def test_no_array_is_assigned_to_a_slice(path):
    # It compiles thirty functions of numba's, for the text of an error.
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Subscript):
            sliced = any(isinstance(part, ast.Slice) for part in ast.walk(node.targets[0].slice))
            number = isinstance(node.value, ast.Constant | ast.Attribute) or (
                isinstance(node.value, ast.Name) and node.value.id.isupper()
            )
            assert not sliced or number, f"{path.name}:{node.lineno}"


def test_arrays_of_a_table_can_be_written():
    table = pd.DataFrame(np.arange(6.0).reshape(2, 3), columns=GYRO)
    values = values_of(table, GYRO)
    assert values.flags.writeable
    values[0, 0] = 9.0
    assert table.loc[0, "gyro_x"] == 0.0


@pytest.mark.skipif(MODE != "numba" or config.DISABLE_JIT, reason="numba compiles nothing")
def test_arrays_that_cannot_be_written_make_no_versions():
    q, v = np.array([[1.0, 0.0, 0.0, 0.0]] * 2), np.ones((2, 3))
    q.flags.writeable = v.flags.writeable = False
    rotation.rotate(q, v)
    rotation.rotate(q[0], v)
    rotation.rotation_angle(q, q[0])
    for one in (kernel.quats_rotate, kernel.quats_angle):
        arrays = [kind for kinds in one.signatures for kind in kinds]
        assert all(kind.mutable for kind in arrays)
