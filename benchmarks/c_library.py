"""The same work in C, compiled for this machine where it has a compiler."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path


def c_library(source: str) -> ctypes.CDLL | None:
    """Compile a file beside this one and load it; None without a compiler."""
    if shutil.which("gcc") is None:
        print(f"no gcc on this machine: {source} is left out")
        return None
    library = Path(tempfile.mkdtemp()) / "limit.so"
    flags = ["-O3", "-march=native", "-fno-math-errno", "-mprefer-vector-width=128"]
    path = Path(__file__).with_name(source)
    subprocess.run(
        ["gcc", *flags, "-shared", "-fPIC", str(path), "-o", str(library), "-lm"], check=True
    )
    return ctypes.CDLL(str(library))
