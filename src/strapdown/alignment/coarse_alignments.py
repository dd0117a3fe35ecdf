"""The coarse alignments, by name."""

from __future__ import annotations

from strapdown.alignment.alignment import CoarseAlignment
from strapdown.alignment.gnss_course import GnssCourse
from strapdown.alignment.inertial_frame import InertialFrame
from strapdown.alignment.levelling import KnownHeading, Levelling
from strapdown.alignment.two_vector import TwoVector

#: A new method is a new file and a line here.
COARSE_ALIGNMENTS: dict[str, type[CoarseAlignment]] = {
    "levelling": Levelling,
    "known_heading": KnownHeading,
    "two_vector": TwoVector,
    "inertial_frame": InertialFrame,
    "gnss_course": GnssCourse,
}
