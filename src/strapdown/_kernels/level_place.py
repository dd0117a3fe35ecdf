"""Where a state of a compiled mechanization is, and how its level axes stand to north-east-down."""

from __future__ import annotations

import math

from numba import njit

from strapdown._kernels.ned import ALT as NED_ALT
from strapdown._kernels.ned import LAT, LON
from strapdown._kernels.wander import ALT as WANDER_ALT
from strapdown._kernels.wander_level import geodetic_from_wander

# Mechanizations.
NED, WANDER = 0, 1


@njit(cache=True, error_model="numpy")
def level_place(which, state, turn):
    """Latitude, longitude and height; fills C_nl, level to north-east-down, (3, 3)."""
    for i in range(3):
        for j in range(3):
            turn[i, j] = 0.0
    if which == WANDER:
        lat, lon, angle = geodetic_from_wander(state[0], state[1], state[2], state[3])
        s, c = math.sin(angle), math.cos(angle)
        turn[0, 0], turn[0, 1], turn[1, 0], turn[1, 1], turn[2, 2] = s, c, c, -s, -1.0
        return lat, lon, state[WANDER_ALT]
    turn[0, 0] = turn[1, 1] = turn[2, 2] = 1.0
    return state[LAT], state[LON], state[NED_ALT]
