"""Initial attitude."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.alignment.alignment import Site
    from strapdown.alignment.fine import FineAlignment, FineResult
    from strapdown.alignment.two_vector import TwoVector

__all__ = ["FineAlignment", "FineResult", "Site", "TwoVector"]

load_on_first_use(
    __name__, {"alignment": "Site", "fine": "FineAlignment FineResult", "two_vector": "TwoVector"}
)
