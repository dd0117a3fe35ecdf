"""Where the recordings are."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DATA = Path(os.environ.get("STRAPDOWN_DATA", ROOT / "../shared/data")).resolve()


@pytest.fixture(scope="session")
def recordings():
    """A function that gives the path of a shared recording, or skips."""

    def find(name: str) -> Path:
        path = DATA / name
        if not path.exists():
            pytest.skip(f"no recording {name}: set STRAPDOWN_DATA to the folder that holds it")
        return path

    return find
