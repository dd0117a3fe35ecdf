"""The one table of aids."""

from __future__ import annotations

from strapdown.aiding.aid import Aid
from strapdown.aiding.gnss import Gnss

AIDS: dict[str, type[Aid]] = {"gnss": Gnss}
