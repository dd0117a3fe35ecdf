"""A motion increment cut in two at an instant within its step."""

from __future__ import annotations

from numba import njit

from strapdown._kernels.ned import turn_back
from strapdown._kernels.rotation import quat_from_rotvec


@njit(cache=True, error_model="numpy")
def split_increment(row, part, first, second):
    """Fill the increments before and after ``part`` seconds of a step; put together they are it.

    The rate is constant over the step; the force, in the axes of its start, is the line that has
    the velocity and the distance of the step: with ``a + b t`` these are ``a T + b T²/2`` and
    ``a T²/2 + b T³/6``.
    """
    whole = row[0]
    share = part / whole
    rest = whole - part
    first[0], second[0] = part, rest
    for j in range(3):
        u, s = row[4 + j], row[7 + j]
        first[1 + j] = share * row[1 + j]
        second[1 + j] = row[1 + j] - first[1 + j]
        a = (6.0 * s / whole - 2.0 * u) / whole
        b = (6.0 * u - 12.0 * s / whole) / (whole * whole)
        first[4 + j] = part * (a + 0.5 * b * part)
        first[7 + j] = part * part * (0.5 * a + b * part / 6.0)
    w, x, y, z = quat_from_rotvec(first[1], first[2], first[3])
    second[4], second[5], second[6] = turn_back(
        w, x, y, z, row[4] - first[4], row[5] - first[5], row[6] - first[6]
    )
    second[7], second[8], second[9] = turn_back(
        w,
        x,
        y,
        z,
        row[7] - first[7] - first[4] * rest,
        row[8] - first[8] - first[5] * rest,
        row[9] - first[9] - first[6] * rest,
    )
