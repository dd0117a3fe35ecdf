"""The coarse alignments, by name."""

from __future__ import annotations

from strapdown.alignment.coarse import CoarseAlignment
from strapdown.alignment.inertial_frame import InertialFrame
from strapdown.alignment.two_vector import TwoVector

__all__ = ["COARSE_ALIGNMENTS"]

#: One line each: a new method is a new file and a line here.
COARSE_ALIGNMENTS: dict[str, type[CoarseAlignment]] = {
    cls.name: cls for cls in (TwoVector, InertialFrame)
}
