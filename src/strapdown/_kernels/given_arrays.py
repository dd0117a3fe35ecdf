"""How kernels are compiled that work in the arrays they are given, and make none."""

from __future__ import annotations

from typing import Any

from numba.core.cpu import CPUTargetOptions

# Numba counts who holds an array, by an atomic operation wherever a function names one of it: in a
# kernel of a microsecond that is a third of the time. Who calls such a kernel holds its arrays
# until it returns, so that nothing need be counted. Not for a kernel that makes or returns arrays,
# assigns to slices, or calls one that does: numba refuses to compile it.
# The option is one that numba does not document: without it kernels are slower, and right.
UNCOUNTED = {"_nrt": False} if hasattr(CPUTargetOptions, "_nrt") else {}
GIVEN: dict[str, Any] = {"cache": True, "error_model": "numpy", **UNCOUNTED}
