"""Compiled kernels: SI units and radians, float64, C-contiguous; each formula once.

Importing this package imports numba, so everything above imports it only where it is about to
compute.

Numba keeps compiled code on disk, and looks only at the file of a function to tell whether it
is still good: after a change in a file that it calls, it would go on returning old results.
The kernels are therefore kept in a folder of their own whose name is the digest of all their
sources. NUMBA_CACHE_DIR goes before it.
"""

import hashlib
import os
from importlib import import_module
from pathlib import Path

from numba import __version__ as _numba_version
from numba import config as _config


def cache_folder() -> str:
    """Folder of the compiled kernels, named after the digest of their sources."""
    digest = hashlib.sha256(_numba_version.encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return str(base / "strapdown" / f"kernels-{digest.hexdigest()[:16]}")


# Numba reads the setting where a function is decorated, which is while these are imported;
# afterwards it is again what it was, for whoever else uses numba in this process.
_before = _config.CACHE_DIR
try:
    if not _before:
        _config.CACHE_DIR = cache_folder()
    for _name in (
        *("rotation", "earth", "increments", "attitude", "rotation_vector", "recursion"),
        *("motion_increments", "motion_blocks"),
    ):
        import_module(f"strapdown._kernels.{_name}")
except RuntimeError:
    # Path.home() without a home; numba then chooses a place of its own.
    pass
finally:
    _config.CACHE_DIR = _before
