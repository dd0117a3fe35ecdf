"""What a number may depend on besides its inputs: packages and the platform."""

from __future__ import annotations

import functools
import hashlib
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

__all__ = ["machine", "source_digest", "versions"]

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
    """Versions of the packages that numbers depend on, and the digest of our own sources."""
    found = {"python": platform.python_version(), "strapdown source": source_digest()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


@functools.cache
def source_digest() -> str:
    """SHA-256 of the sources and data of this package: two installations of one version may differ.

    Returns
    -------
    str
        Of the name and the content of each file but compiled ones, in the order of their names.
    """
    root = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*")):
        if path.is_file() and path.suffix in (".py", ".toml", ".j2", ".html", ".js", ".css"):
            content = hashlib.sha256(path.read_bytes()).hexdigest()
            digest.update(f"{path.relative_to(root).as_posix()} {content}\n".encode())
    return digest.hexdigest()


def machine() -> dict[str, str]:
    """What of the platform can change the last bit of a number."""
    from llvmlite.binding import get_host_cpu_name

    return {
        "system": platform.system(),
        "machine": platform.machine(),
        "cpu": get_host_cpu_name(),
        "libc": " ".join(platform.libc_ver()).strip(),
    }
