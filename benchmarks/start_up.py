"""How long a person waits for `strapdown --help`, against `import numpy` alone."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

from benchmarks.measure import Ratio, by_turns


def ratios() -> Iterator[Ratio]:
    def run(*arguments: str) -> None:
        subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)

    numpy = "python -c 'import numpy'"
    for what, arguments in (
        ("strapdown --help", ("-m", "strapdown", "--help")),
        ("strapdown attitude --help", ("-m", "strapdown", "attitude", "--help")),
        ("import strapdown", ("-c", "import strapdown")),
    ):
        ours, theirs = by_turns(
            lambda arguments=arguments: run(*arguments),  # type: ignore[misc]
            lambda: run("-c", "import numpy"),
            rounds=9,
        )
        yield Ratio(what, ours * 1e3, numpy, theirs * 1e3, "ms", 4.0)
