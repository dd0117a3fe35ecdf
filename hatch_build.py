"""Build step of the package: compile the kernels (`tools/kernels_to_c`) into the wheel.

With STRAPDOWN_BUILD=none the wheel holds the sources of the kernels alone, for numba.
"""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# The translator is of the package, and needs none of what the package depends on.
sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parent / "src")]


class KernelsHook(BuildHookInterface):  # type: ignore[type-arg]
    """Compile the kernels for a wheel; in place for an editable installation."""

    def dependencies(self) -> list[str]:
        """Return the C compiler from PyPI where the system has none."""
        from tools.kernels_to_c.build import system_compiler

        return [] if system_compiler() or _skipped() else ["ziglang>=0.13"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, and add the library to the wheel; without it numba compiles at first use."""
        if self.target_name != "wheel" or _skipped():
            return
        from tools.kernels_to_c.build import NAME, PACKAGE, build

        editable = version == "editable"
        folder = PACKAGE if editable else Path(tempfile.mkdtemp(prefix="strapdown-kernels-"))
        try:
            made = build(folder)
        except (SystemExit, OSError, subprocess.CalledProcessError) as error:
            self.app.display_warning(f"the kernels were not compiled ({error}): numba will do it")
            return
        if not editable:
            build_data["force_include"][str(made)] = f"strapdown/_kernels/{NAME}"
        platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
        build_data["pure_python"] = False
        build_data["tag"] = f"cp311-abi3-{platform}"


def _skipped() -> bool:
    # Not tried on Windows yet: there numba is among the dependencies.
    return os.environ.get("STRAPDOWN_BUILD") == "none" or sys.platform == "win32"
