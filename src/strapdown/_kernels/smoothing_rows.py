"""What a smoother is told of a filter, a row each: a begin, how errors grew, what was observed.

Of n errors a row has its time, its kind, the turn from north-east-down to level axes (C_ln, row by
row), and the upper half of the covariance after it, row by row. Then, from `begin_of_move` on, has
a growth the rows of its transition for place, velocity and attitude, and the decay of the others;
an update has the upper half of the covariance before it, and the error that it took off.
"""

from __future__ import annotations

from numba import njit

from strapdown._kernels.factors import udu_matrix
from strapdown._kernels.given_arrays import GIVEN
from strapdown._kernels.growth import LANES
from strapdown._kernels.level_place import level_place

# Of a row: how the errors grew to it; what was observed at it; or that a filter begins with it, of
# which nothing before it is told.
GROWTH, UPDATE, BEGIN = 0, 1, 2
# Rows of a transition that are more than a decay.
CORE = 9
# Places in a row.
TIME, KIND, TURN, COVARIANCE = 0, 1, 2, 11


@njit(cache=True)
def begin_of_move(n):
    """Where in a row of n errors the covariance after it has ended."""
    return COVARIANCE + n * (n + 1) // 2


@njit(cache=True)
def begin_of_taken(n):
    """Where in a row of an update the covariance before it has ended."""
    return begin_of_move(n) + n * (n + 1) // 2


@njit(cache=True)
def row_width(n):
    """Numbers in a row of n errors."""
    return max(begin_of_taken(n) + n, begin_of_move(n) + CORE * n + n - CORE)


@njit(**GIVEN)
def unpack(row, at, out):
    """Fill a symmetric matrix from its upper half, row by row, which begins at a place of a row."""
    n = out.shape[0]
    for i in range(n):
        for j in range(i, n):
            out[i, j] = out[j, i] = row[at]
            at += 1


@njit(**GIVEN)
def pack(matrix, row, at):
    """Put the upper half of a symmetric matrix, row by row, to a place of a row."""
    n = matrix.shape[0]
    for i in range(n):
        for j in range(i, n):
            row[at] = 0.5 * (matrix[i, j] + matrix[j, i])
            at += 1


@njit(cache=True, error_model="numpy")
def pack_covariance(factored, covariance, P, row, at):
    """Put a covariance, or what it is of its factors, to a place of a row; P is room to work in."""
    if factored:
        udu_matrix(covariance, P)
        pack(P, row, at)
    else:
        pack(covariance, row, at)


@njit(cache=True, error_model="numpy")
def head_row(which, factored, states, time, kind, P, row):
    """Fill the time, the kind, the turn and the covariance of a row: P, (n, n), is room."""
    turn = row[TURN:COVARIANCE].reshape(3, 3)
    # Of either mechanization the turn is its own transpose.
    level_place(which, states[0], turn)
    row[TIME], row[KIND] = time, kind
    pack_covariance(factored, states[2], P, row, COVARIANCE)


@njit(cache=True, error_model="numpy")
def move_by_growth(growth, row, n):
    """Fill what is of a growth (`growth.growth_of_step`) alone in a row of n errors."""
    phi, _, _, tail, _ = growth
    at = begin_of_move(n)
    for i in range(CORE):
        for j in range(n):
            row[at] = phi[j // LANES, LANES * i + j % LANES]
            at += 1
    for s in range(n - CORE):
        row[at] = tail[s]
        at += 1
