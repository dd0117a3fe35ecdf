"""The one table of aids."""

from __future__ import annotations

from strapdown.aiding.aid import Aid
from strapdown.aiding.gnss import Gnss
from strapdown.aiding.no_slip import NoSlip

AIDS: dict[str, type[Aid]] = {
    "gnss": Gnss,
    "no_slip": NoSlip,
}
