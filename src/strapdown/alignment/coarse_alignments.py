"""The coarse alignments, by name."""

from __future__ import annotations

from collections.abc import Mapping

from strapdown.alignment.alignment import CoarseAlignment
from strapdown.lazy_names import Choices

#: A new method is a new file and a line here.
COARSE_ALIGNMENTS: Mapping[str, type[CoarseAlignment]] = Choices(
    {
        "levelling": "strapdown.alignment.levelling:Levelling",
        "known_heading": "strapdown.alignment.levelling:KnownHeading",
        "two_vector": "strapdown.alignment.two_vector:TwoVector",
        "inertial_frame": "strapdown.alignment.inertial_frame:InertialFrame",
        "gnss_course": "strapdown.alignment.gnss_course:GnssCourse",
    }
)
