"""Where the shared recordings and measuring sticks are, and what a test does without one."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NoReturn

import pytest

ROOT = Path(__file__).parent.parent
DATA = Path(os.environ.get("STRAPDOWN_DATA", ROOT / "../shared/data")).resolve()


def without(what: str) -> NoReturn:
    """Skip where there are no recordings at all; fail where one of them is missing."""
    if DATA.is_dir():
        pytest.fail(f"the recordings are in {DATA}, and there is no {what}")
    pytest.skip(f"no {what}: set STRAPDOWN_DATA to the folder of recordings")
