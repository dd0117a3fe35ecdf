"""Compiler options of kernels that work in given arrays and allocate none."""

from __future__ import annotations

from typing import Any

from numba.core.cpu import CPUTargetOptions

# Numba counts references to arrays by atomic operations, a third of the time of a kernel of 1 µs.
# The caller holds the arrays until the kernel returns, so that no counting is needed. Not for a
# kernel that allocates or returns arrays, assigns to slices, or calls one that does: numba refuses
# to compile it. The option is undocumented: without it kernels are slower, and correct.
UNCOUNTED = {"_nrt": False} if hasattr(CPUTargetOptions, "_nrt") else {}
GIVEN: dict[str, Any] = {"cache": True, "error_model": "numpy", **UNCOUNTED}
