"""How kernels are compiled, the fused product and sum, and the scalar product in lanes.

A kernel gives the same bits whether it is compiled, inlined or loaded from the cache, because none
is compiled with relaxed arithmetic (`fastmath`). A compiler that may contract a product and a sum
does so where it happens to inline, and of several copies of one function numba runs another when
kernels come from the cache: the first run of an installation differed from all later ones.
Where one rounding less keeps what would cancel, or sums in lanes are worth their speed, the source
says so: `fma` and `dot`.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any, TypeVar

import numba
from numba import config
from numba.core import types
from numba.core.cpu import CPUTargetOptions
from numba.core.dispatcher import Dispatcher
from numba.extending import intrinsic

#: Names of kernels whose compiled code is not kept.
NOT_KEPT: list[str] = []
Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def njit(**options: Any) -> Callable[[Kernel], Dispatcher[Kernel]]:
    """Decorate a kernel: `numba.njit`, with one version for all whole numbers.

    Where a kernel calls another with a number that is written in the source, numba compiles a
    version for that number; so it does for the first value of a loop's variable, and never calls
    that version. The optimizer inserts such numbers without it. No kernel is a callback of C, so
    none has the wrapper for it. Where no folder can be written (a read-only installation without
    a home), each process compiles what it runs.
    """
    options = {"no_cfunc_wrapper": True, **options}

    def decorate(function: Kernel) -> Dispatcher[Kernel]:
        try:
            kernel: Any = numba.njit(**options)(function)
        except RuntimeError:  # numba's, of a cache without a folder
            kernel = numba.njit(**{**options, "cache": False})(function)
            NOT_KEPT.append(function.__name__)
        if hasattr(kernel, "get_call_template"):  # not with NUMBA_DISABLE_JIT
            template = kernel.get_call_template
            kernel.get_call_template = lambda kinds, named: template(
                [types.unliteral(kind) for kind in kinds], named
            )
        return kernel  # type: ignore[no-any-return]

    return decorate


# Numba counts references to arrays by atomic operations, a third of the time of a kernel of 1 µs.
# The caller holds the arrays until the kernel returns, so that no counting is needed. Not for a
# kernel that allocates or returns arrays, assigns to slices, or calls one that does: numba refuses
# to compile it. The option is undocumented: without it kernels are slower, and correct.
IN_PLACE: dict[str, Any] = {"cache": True, "error_model": "numpy"}
if hasattr(CPUTargetOptions, "_nrt"):
    IN_PLACE["_nrt"] = False


@intrinsic
def fma(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
    """Return ``a b + c``, rounded once (IEEE 754 fusedMultiplyAdd)."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


def _fma_interpreted(a: float, b: float, c: float) -> float:
    """`fma` where kernels are not compiled (`NUMBA_DISABLE_JIT`): the exact sum, rounded once."""
    try:
        return float(Fraction(float(a)) * Fraction(float(b)) + Fraction(float(c)))
    except (OverflowError, ValueError):  # infinite, or not a number
        return a * b + c


if config.DISABLE_JIT:
    fma = _fma_interpreted  # type: ignore[assignment]


@njit(**IN_PLACE, forceinline=True)
def dot(a, b, n):
    """Return the scalar product of the first n numbers of two rows, in eight partial sums."""
    s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = 0.0
    whole = n - n % 8
    for k in range(0, whole, 8):
        s0 += a[k] * b[k]
        s1 += a[k + 1] * b[k + 1]
        s2 += a[k + 2] * b[k + 2]
        s3 += a[k + 3] * b[k + 3]
        s4 += a[k + 4] * b[k + 4]
        s5 += a[k + 5] * b[k + 5]
        s6 += a[k + 6] * b[k + 6]
        s7 += a[k + 7] * b[k + 7]
    total = ((s0 + s4) + (s2 + s6)) + ((s1 + s5) + (s3 + s7))
    for k in range(whole, n):
        total += a[k] * b[k]
    return total
