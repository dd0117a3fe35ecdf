"""What a filter needs to know of a state, whatever axes its mechanization has.

Level axes l are those in which a mechanization keeps its velocity: north-east-down, or the axes
of a wander azimuth (up is then +z). A row holds the quaternion body to level, the velocity relative
to the Earth in level axes, the unit vector of the Earth's axis (towards the north pole) in level
axes, the height, and the rate of the level relative to the Earth in level axes.
"""

from __future__ import annotations

import math

from numba import njit

Q_LB, V_L, AXIS, ALT, OMEGA_EL = 0, 4, 7, 10, 11
LEVEL = 14


@njit(cache=True, error_model="numpy", inline="always")
def curvatures(sine, alt, a, e2):
    """Curvature of the level surface across the meridian, and what the meridian adds.

    The normal turns by ``across r + along k (k . r)`` over a horizontal displacement r, where k is
    the horizontal part of the Earth's axis (cos lat long): regular at the poles.
    """
    w2 = 1.0 / (1.0 - e2 * sine * sine)
    prime = a * math.sqrt(w2)
    meridian = prime * (1.0 - e2) * w2
    across = 1.0 / (prime + alt)
    return across, e2 * prime * w2 * across / (meridian + alt)
