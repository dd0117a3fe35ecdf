"""How kernels are compiled, the fused product and sum, and the scalar product in lanes.

An installation has the kernels compiled: these sources, translated to C (`tools/kernels_to_c`).
Where that is missing, or is of other sources, numba compiles them when they are first called, if it
is installed. STRAPDOWN_KERNELS chooses: ``compiled``, ``numba``, ``python`` (interpreted), or the
path of another library of these sources, as of one that checks every index.

A kernel gives the same bits in all three, because none is compiled with relaxed arithmetic: neither
numba's `fastmath`, nor C's contraction of a product and a sum where the compiler happens to inline.
Where one rounding less keeps what would cancel, or sums in lanes are worth their speed, the source
says so: `fma` and `dot`.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from fractions import Fraction
from functools import cache
from importlib import import_module
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar

#: Names of kernels that numba compiled and whose code is not kept.
NOT_KEPT: list[str] = []
Kernel = TypeVar("Kernel", bound=Callable[..., Any])

_PACKAGE = __name__.rpartition(".")[0]
_HELP = "Install strapdown again with `pip install`, or numba, which compiles them at first use."


def sources_digest() -> str:
    """SHA-256 of what the kernels are made of; `tools/kernels_to_c` writes it into the library."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        if source.stem != "__init__":
            digest.update(source.read_bytes())
    return digest.hexdigest()


def _delivered(library: str) -> tuple[dict[str, Callable[..., Any]], str]:
    """Return the compiled kernels by their names, and by what and for what processors."""
    made: Any
    try:
        if library:
            spec: Any = spec_from_file_location(f"{_PACKAGE}._compiled", library)
            made = module_from_spec(spec)
            spec.loader.exec_module(made)
        else:
            made = import_module(f"{_PACKAGE}._compiled")
    except ImportError:
        return {}, ""
    if sources_digest() != made.SOURCES:
        return {}, ""
    return made.KERNELS, f"{made.COMPILER}, {made.LEVEL}"


def _choose() -> tuple[str, dict[str, Callable[..., Any]], str]:
    wanted = os.environ.get("STRAPDOWN_KERNELS", "")
    library = wanted if os.sep in wanted else ""
    kernels, compiler = ({}, "") if wanted in ("numba", "python") else _delivered(library)
    if kernels:
        return "compiled", kernels, compiler
    if wanted == "python":
        return wanted, {}, ""
    if wanted != "compiled" and not library and find_spec("numba"):
        return "numba", {}, ""
    raise ImportError(f"The compiled kernels are missing, or of other sources. {_HELP}")


#: How kernels run; the compiled ones; and the compiler with the level of its code: "base", or "v3"
#: with AVX2 and FMA.
MODE, _COMPILED, COMPILER = _choose()


def delivered(module: str) -> dict[str, Callable[..., Any]]:
    """Return the compiled kernels of a module by their names; empty where numba compiles."""
    return {
        name.rpartition(".")[2]: kernel
        for name, kernel in _COMPILED.items()
        if name.startswith(f"{module}.")
    }


#: What a call with an argument of the wrong type raises.
ARGUMENT_ERRORS: tuple[type[Exception], ...] = (TypeError, ValueError)
if MODE == "numba":
    from numba.core.errors import NumbaError

    ARGUMENT_ERRORS = (NumbaError, TypeError, ValueError)


def njit(**options: Any) -> Callable[[Kernel], Callable[..., Any]]:
    """Decorate a kernel: the compiled one, or one compiled by numba.

    A kernel that only kernels call is part of those where they are compiled, and is itself
    interpreted.

    Where a kernel calls another with a number that is written in the source, numba compiles a
    version for that number; so it does for the first value of a loop's variable, and never calls
    that version. The optimizer inserts such numbers without it. No kernel is a callback of C, so
    none has the wrapper for it. Where no folder can be written (a read-only installation without
    a home), each process compiles what it runs.
    """

    def decorate(function: Kernel) -> Any:
        home = function.__module__
        if MODE == "python" or (MODE == "compiled" and home.startswith(f"{_PACKAGE}.")):
            name = f"{home.removeprefix(_PACKAGE + '.')}.{function.__name__}"
            kernel = _COMPILED.get(name, function)
            _SOURCES[name], _OF[id(kernel)] = function, (function, options)
            return kernel
        if MODE == "compiled":
            # A kernel of a plug-in: interpreted without numba, which compiles it with ours.
            if not find_spec("numba"):
                return function
            function.__globals__.update(_for_numba(function))
        return _by_numba(function, options)

    return decorate


_SOURCES: dict[str, Callable[..., Any]] = {}
#: Source and options of each delivered kernel, and what numba made of them for plug-ins.
_OF: dict[int, tuple[Any, dict[str, Any]]] = {}
_MADE: dict[int, Any] = {}


def _for_numba(function: Callable[..., Any]) -> dict[str, Any]:
    """Return our kernels among the names that a function uses, as numba can call them."""
    found = {}
    for name in function.__code__.co_names:
        kernel = function.__globals__.get(name)
        if kernel is fma:
            found[name] = _fma_of_numba()
        elif id(kernel) in _OF:
            if id(kernel) not in _MADE:
                source, options = _OF[id(kernel)]
                known = {**source.__globals__, **_for_numba(source)}
                copied = FunctionType(source.__code__, known, source.__name__)
                _MADE[id(kernel)] = _by_numba(copied, {**options, "cache": False})
            found[name] = _MADE[id(kernel)]
    return found


def interpreted(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """Return the Python function that a kernel was made of; kernels that it calls are as ever."""
    if hasattr(kernel, "py_func"):
        return kernel.py_func  # type: ignore[no-any-return]
    home = kernel.__module__.removeprefix(_PACKAGE + ".")
    return _SOURCES.get(f"{home}.{kernel.__name__}", kernel)


def _by_numba(function: Kernel, options: dict[str, Any]) -> Any:
    import numba
    from numba.core import types

    options = {"no_cfunc_wrapper": True, **options}
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
    return kernel


# Numba counts references to arrays by atomic operations, a third of the time of a kernel of 1 µs.
# The caller holds the arrays until the kernel returns, so that no counting is needed. Not for a
# kernel that allocates or returns arrays, assigns to slices, or calls one that does: numba refuses
# to compile it. The option is undocumented: without it kernels are slower, and correct.
IN_PLACE: dict[str, Any] = {"cache": True, "error_model": "numpy"}


def fma(a: float, b: float, c: float) -> float:
    """Return ``a b + c``, rounded once (IEEE 754 fusedMultiplyAdd)."""
    try:
        return float(Fraction(float(a)) * Fraction(float(b)) + Fraction(float(c)))
    except (OverflowError, ValueError):  # infinite, or not a number
        return a * b + c


@cache
def _fma_of_numba() -> Any:
    from numba.core import types
    from numba.extending import intrinsic

    @intrinsic
    def fused(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.fma(*arguments)

        return types.float64(types.float64, types.float64, types.float64), generate

    return fused


_fma_interpreted = fma
if MODE == "numba":
    from numba import config
    from numba.core.cpu import CPUTargetOptions

    if hasattr(CPUTargetOptions, "_nrt"):
        IN_PLACE["_nrt"] = False
    if not config.DISABLE_JIT:
        fma = _fma_of_numba()


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
