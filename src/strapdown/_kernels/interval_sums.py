"""Motion increments summed over the intervals of a grid of time."""

from __future__ import annotations

import math

from numba import njit

#: Places in what is remembered: number of the interval; sums of dt, angle, velocity.
NUMBER, SUMS = 0, 1
MEMORY = 8
# Part of an interval by which a stamp may miss the grid and be on it: stamps are rounded.
_SLACK = 1e-6


@njit(cache=True, error_model="numpy")
def interval_sums(time, rows, interval, memory, at, means):
    """Fill the ends of the intervals, and the mean rate and force over each; return their count.

    An interval ends with the first step that reaches or passes a multiple of it. `memory` is
    changed; its first number is NaN before the first step. `at` (k,) is the place of the step,
    `means` (k, 6) in the axes of the body at each instant.
    """
    count = 0
    for i in range(time.size):
        number = math.floor(time[i] / interval + _SLACK)
        if math.isnan(memory[NUMBER]):
            memory[NUMBER] = math.floor((time[i] - rows[i, 0]) / interval + _SLACK)
        for j in range(7):
            memory[SUMS + j] += rows[i, j]
        if number > memory[NUMBER]:
            memory[NUMBER] = number
            for j in range(6):
                means[count, j] = memory[SUMS + 1 + j] / memory[SUMS]
            for j in range(7):
                memory[SUMS + j] = 0.0
            at[count] = i
            count += 1
    return count
