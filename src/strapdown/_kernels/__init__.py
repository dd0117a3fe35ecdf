"""Compiled kernels: SI units and radians, float64, C-contiguous; each formula once.

Importing this package imports numba, so modules above import it only where they compute.

Numba keeps compiled code on disk, and checks only the file of a function for changes: after a
change in a file that it calls, it would return old results. The kernels are therefore cached in a
folder named after the digest of all their sources. NUMBA_CACHE_DIR takes precedence.
"""

import hashlib
import os
from importlib import import_module
from pathlib import Path

from numba import __version__ as _numba_version
from numba import config as _config


def cache_folder() -> str:
    """Return the folder of the compiled kernels, named after their digest; "" without a home."""
    digest = hashlib.sha256(_numba_version.encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes())
    try:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:
        return ""
    return str(base / "strapdown" / f"kernels-{digest.hexdigest()[:16]}")


# Numba reads the setting where a function is decorated, during these imports; afterwards it is
# restored for other users of numba in this process. Of an empty one it chooses a folder itself.
_before = _config.CACHE_DIR
try:
    if not _before:
        _config.CACHE_DIR = cache_folder()
    for _source in sorted(Path(__file__).parent.glob("[a-z]*.py")):
        if _source.stem != "arithmetic":
            import_module(f"strapdown._kernels.{_source.stem}")
finally:
    _config.CACHE_DIR = _before
