"""Change of velocity over a trailing window as a polynomial of time, and where it meets a level.

Between samples the acceleration is a line (values at the stamps) or a constant (means), so that
the change of velocity over a trailing window is a polynomial of time between breaks: the stamps,
and the stamps moved by the length of the window. Crossings are roots of these polynomials, and
fall where they fall, not on samples.
"""

from __future__ import annotations

import math

from numba import njit

# Columns of the rows: stamp, acceleration forward and right, velocity since the record began.
T, AX, AY, VX, VY = range(5)
WIDTH = 5

NEVER = 1e300


@njit(cache=True)
def value(rows, k, at, axis, mean):
    """Velocity, acceleration and its slope at an instant of the step that ends with row k."""
    step = rows[k, T] - rows[k - 1, T]
    since = at - rows[k - 1, T]
    before = rows[k, AX + axis] if mean else rows[k - 1, AX + axis]
    slope = (rows[k, AX + axis] - before) / step
    accel = before + slope * since
    return rows[k - 1, VX + axis] + 0.5 * (before + accel) * since, accel, slope


@njit(cache=True)
def change(rows, head, tail, at, window, floor, velocity, axis, mean):
    """Change of velocity over a trailing window that ends at an instant: a quadratic of time."""
    v, a, m = value(rows, head, at, axis, mean)
    if at - window < floor:
        return v - velocity, a, 0.5 * m
    v0, a0, m0 = value(rows, tail, at - window, axis, mean)
    return v - v0, a - a0, 0.5 * (m - m0)


@njit(cache=True)
def first_upward(c0, c1, c2, length, level):
    """First instant in [0, length] at which the size of a quadratic grows through a level."""
    first = NEVER
    for sign in (-1.0, 1.0):
        a, b, c = sign * c2, sign * c1, sign * c0 - level
        disc = b * b - 4.0 * a * c
        # The root at which it rises is the one with slope +sqrt(disc).
        if disc > 0.0:
            root = math.sqrt(disc)
            # Both forms are the same root; the one that does not cancel is used.
            x = -2.0 * c / (b + root) if b >= 0.0 else (root - b) / (2.0 * a) if a != 0.0 else -1.0
            # A level that was met at the border of the piece before may lie a rounding behind.
            if -1e-15 <= x <= length:
                first = min(first, max(x, 0.0))
    return first


@njit(cache=True)
def largest(c0, c1, c2, length):
    """Largest size of a quadratic in [0, length], and where."""
    at, most = 0.0, abs(c0)
    end = abs(c0 + length * (c1 + length * c2))
    if end > most:
        at, most = length, end
    if c2 != 0.0:
        x = -0.5 * c1 / c2
        if 0.0 < x < length and abs(c0 + x * (c1 + x * c2)) > most:
            at, most = x, abs(c0 + x * (c1 + x * c2))
    return most, at


@njit(cache=True)
def excess(x, y, at, level):
    """By how much the squared resultant of two quadratics is over that of a level."""
    dx = x[0] + at * (x[1] + at * x[2])
    dy = y[0] + at * (y[1] + at * y[2])
    return dx * dx + dy * dy - level * level


@njit(cache=True)
def crossing(x, y, length, level, upward):
    """Where the resultant crosses a level in [0, length]; it does by its end."""
    if (excess(x, y, 0.0, level) > 0.0) == upward:
        return 0.0
    low, high = 0.0, length
    for _ in range(200):
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            break
        if (excess(x, y, middle, level) > 0.0) == upward:
            high = middle
        else:
            low = middle
    return high


@njit(cache=True)
def power(rows, head, tail, start, end, mean):
    """Sum of the squared weights with which the samples make the integral from start to end."""
    total, carry = 0.0, 0.0
    for k in range(tail, head + 1):
        step = rows[k, T] - rows[k - 1, T]
        u = max(start - rows[k - 1, T], 0.0) / step
        w = min(end - rows[k - 1, T], step) / step
        if mean:
            total += (step * (w - u)) ** 2
        else:
            left = step * ((w - 0.5 * w * w) - (u - 0.5 * u * u))
            total += (carry + left) ** 2
            carry = 0.5 * step * (w * w - u * u)
    return total + carry * carry
