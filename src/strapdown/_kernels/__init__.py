"""Compiled kernels: SI units and radians, float64, C-contiguous; each formula once.

How they are compiled, `compilation` says.

Numba keeps compiled code on disk, and checks only the file of a function for changes: after a
change in a file that it calls, it would return old results. Its kernels are therefore cached in a
folder named after the digest of all their sources. NUMBA_CACHE_DIR takes precedence.
"""

import os
from importlib import import_module
from pathlib import Path

from strapdown._kernels.compilation import MODE, sources_digest


def cache_folder() -> str:
    """Folder of what numba compiled, named after the digest of its sources; "" without a home."""
    from numba import __version__ as version

    try:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:
        return ""
    return str(base / "strapdown" / f"kernels-{sources_digest()[:16]}-numba-{version}")


def _with_numba() -> None:
    """Import all kernels: numba reads the folder of its cache where a function is decorated."""
    from numba import config

    before = config.CACHE_DIR
    try:
        if not before:
            # Of an empty one numba chooses a folder itself.
            config.CACHE_DIR = cache_folder()
        for source in sorted(Path(__file__).parent.glob("[a-z]*.py")):
            if source.stem != "arithmetic":
                import_module(f"strapdown._kernels.{source.stem}")
    finally:
        # For other users of numba in this process.
        config.CACHE_DIR = before


if MODE == "numba":
    _with_numba()
