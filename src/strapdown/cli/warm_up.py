"""``strapdown warm-up``."""

from __future__ import annotations

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from strapdown.cli.console import console
from strapdown.cli.shared_options import QUIET, VERBOSE
from strapdown.errors import ConfigError

EPILOG = "Example: strapdown warm-up"


def warm_up(*, quiet: bool = QUIET, verbose: bool = VERBOSE) -> None:
    """Compile the kernels now instead of in the first runs, where they are not delivered compiled.

    An installation from a wheel has them compiled, and this says so. Elsewhere numba compiles each
    kernel that is called: here the demonstration is run for that, into a folder that is removed.
    """
    from strapdown._kernels.compilation import MODE, NOT_KEPT
    from strapdown.cli.demo import demo_runs, made

    if MODE == "compiled":
        said = "delivered compiled: the first run is as fast as a later one"
    elif MODE == "python":
        said = "interpreted, as STRAPDOWN_KERNELS asks: there is nothing to compile"
    else:
        begun = time.monotonic()
        with TemporaryDirectory(prefix="strapdown-") as name:
            out = Path(name)
            runs = [run for run in demo_runs(out, out) if run.needs is None]
            for _ in made(runs, out, force=False, quiet=quiet):
                pass
        if NOT_KEPT:
            raise ConfigError("cli.kernels-not-kept", quantity="NUMBA_CACHE_DIR")
        said = f"compiled and kept, in {time.monotonic() - begun:.0f} s"
    if not quiet:
        console().print(f"Kernels  {said}", highlight=False)
