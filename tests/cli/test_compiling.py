"""A first run says why it takes long."""

import os
import subprocess
import sys

from numba import njit

from strapdown.cli.console import Compilations


def test_compiling_is_told_once_for_nested_functions():
    told = []
    compilations = Compilations(told.append)
    compilations.listen()
    try:

        @njit
        def inner(x):
            return x + 1.0

        @njit
        def outer(x):
            return inner(x) * 2.0

        assert outer(1.0) == 4.0
        assert told == [True, False]
        assert outer(2.0) == 6.0
        assert told == [True, False]
    finally:
        compilations.stop()
    njit(lambda x: x - 1.0)(1.0)
    assert told == [True, False]


def test_without_a_folder_to_write_kernels_are_compiled_and_not_kept():
    code = """
from strapdown._kernels.compilation import NOT_KEPT
from strapdown._kernels.rotation_vector import cross
assert cross(1.0, 0.0, 0.0, 0.0, 1.0, 0.0) == (0.0, 0.0, 1.0)
assert "cross" in NOT_KEPT
"""
    # The one locator that is left takes archives alone, as if no folder could be written.
    environment = {**os.environ, "NUMBA_CACHE_LOCATOR_CLASSES": "_ZipCacheLocator"}
    environment["STRAPDOWN_KERNELS"] = "numba"
    subprocess.run([sys.executable, "-c", code], env=environment, check=True)
