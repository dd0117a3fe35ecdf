"""A first run says why it takes long."""

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
