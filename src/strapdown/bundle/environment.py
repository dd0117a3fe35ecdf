"""What a number may depend on besides its inputs: packages and the platform."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version

__all__ = ["machine", "versions"]

PACKAGES = (
    "strapdown",
    "numpy",
    "scipy",
    "numba",
    "pandas",
    "pyarrow",
    "h5py",
    "matplotlib",
    "plotly",
)


def versions() -> dict[str, str]:
    """Versions of the packages that numbers depend on."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def machine() -> dict[str, str]:
    """What of the platform can change the last bit of a number."""
    from llvmlite.binding import get_host_cpu_name

    return {
        "system": platform.system(),
        "machine": platform.machine(),
        "cpu": get_host_cpu_name(),
        "libc": " ".join(platform.libc_ver()).strip(),
    }
