"""Measurements of aided navigation: one file per aid, one table of all aids."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.aiding.gnss import Gnss

__all__ = [
    "Gnss",
]

load_on_first_use(
    __name__,
    {
        "gnss": "Gnss",
    },
)
