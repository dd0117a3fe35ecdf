"""Conventions of the report of a run of navigation."""

from __future__ import annotations

__all__ = ["CONVENTIONS"]

CONVENTIONS = (
    ("Body axes", "forward, right, down; local level: north, east, down"),
    (
        "Place",
        "geodetic latitude north and longitude east in deg, height over the ellipsoid in m, of the "
        "inertial sensors",
    ),
    ("Velocity", "relative to the Earth, in m/s: north, east, down"),
    ("Attitude", "roll, pitch, heading (3-2-1): right side down, nose up, clockwise are positive"),
    ("Heading", "from true north, clockwise seen from above"),
    ("Errors", "computed or measured less true; so the truth is the reading less the bias"),
    (
        "Rotation errors",
        "vector psi about north, east, down: C_computed = exp([psi x]) C_true",
    ),
    ("Innovations", "observed less expected, after what was observed before at the same instant"),
    (
        "Bounds",
        "hold the truth in 95 of 100 cases (1.96 standard deviations; of an ellipse in a plane "
        "2.45) where what is stated of the sensors and the aids is right",
    ),
    ("Time", "s, on the record's own clock"),
)
