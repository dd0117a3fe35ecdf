"""Functions that are polynomials between knots, Legendre series over panels, and splines."""

from __future__ import annotations

import numpy as np

from strapdown._kernels.compilation import njit


@njit(cache=True)
def panel_of(edges, t, guess):
    """Panel that holds `t`, of the last one to the right of an edge; `guess` is looked at first."""
    last = edges.shape[0] - 2
    if guess <= last and edges[guess] <= t:
        # Instants mostly advance, and by less than a panel.
        if guess == last or t < edges[guess + 1]:
            return guess
        if guess + 1 == last or t < edges[guess + 2]:
            return guess + 1
    low, high = 0, last
    while low < high:
        middle = (low + high + 1) // 2
        if edges[middle] <= t:
            low = middle
        else:
            high = middle - 1
    return low


@njit(cache=True)
def lines(knots, values, time, out):
    """Rows between rows of `values`, (p, m), on straight lines; the outermost ones go on."""
    k, last = 0, knots.shape[0] - 2
    usual = (knots[last + 1] - knots[0]) / (last + 1)
    for i in range(time.shape[0]):
        t = time[i]
        # Knots are mostly even, and many from one instant to the next.
        guess = min(max(k + int((t - knots[k]) / usual), 0), last)
        if guess > 0 and knots[guess] > t:
            guess -= 1
        k = panel_of(knots, t, guess)
        share = (t - knots[k]) / (knots[k + 1] - knots[k])
        for j in range(values.shape[1]):
            out[i, j] = values[k, j] + share * (values[k + 1, j] - values[k, j])


@njit(cache=True)
def farthest(time, place, first, last):
    """Row between two others, of `place`, (n, 3), farthest from their line at its time.

    Returns its squared distance and its index, `first` where no row is between them.
    """
    span = time[last] - time[first]
    worst, at = -1.0, first
    for i in range(first + 1, last):
        share, square = (time[i] - time[first]) / span, 0.0
        for j in range(3):
            line = place[first, j] + share * (place[last, j] - place[first, j])
            square += (place[i, j] - line) * (place[i, j] - line)
        if square > worst:
            worst, at = square, i
    return worst, at


@njit(cache=True)
def legendre_sums(edges, before, series, time, out):
    """Fill ``out = before + series`` at each instant by Clenshaw's recursion.

    `before` is (p, m), `series` (p, n, m) with n of three or more, `out` (t, m). Exactly `before`
    at the left edge of a panel, whatever a series rounds that to.
    """
    terms, width = series.shape[1], series.shape[2]
    lower, upper = np.empty(terms), np.empty(terms)
    for n in range(terms):
        lower[n], upper[n] = (n + 1) / (n + 2), (2 * n + 3) / (n + 2)
    k = 0
    for i in range(time.shape[0]):
        t = time[i]
        k = panel_of(edges, t, k)
        left, right = edges[k], edges[k + 1]
        x = ((t - left) - (right - t)) / (right - left)
        for j in range(width):
            if t == left:
                out[i, j] = before[k, j]
                continue
            c0, c1 = series[k, terms - 2, j], series[k, terms - 1, j]
            for n in range(terms - 3, -1, -1):
                kept = c0
                c0 = series[k, n, j] - c1 * lower[n]
                c1 = kept + c1 * x * upper[n]
            out[i, j] = before[k, j] + (c0 + c1 * x)


@njit(cache=True)
def polynomials(knots, coefficients, time, value, first, second):
    """Piecewise polynomials with their first two derivatives, (t, m) each.

    `coefficients` is (p, n, m), highest power first, of the time since the knot to the left.
    """
    terms, width = coefficients.shape[1], coefficients.shape[2]
    k = 0
    for i in range(time.shape[0]):
        k = panel_of(knots, time[i], k)
        x = time[i] - knots[k]
        for j in range(width):
            p, d, dd = coefficients[k, 0, j], 0.0, 0.0
            for n in range(1, terms):
                dd = dd * x + d
                d = d * x + p
                p = p * x + coefficients[k, n, j]
            value[i, j], first[i, j], second[i, j] = p, d, 2.0 * dd


@njit(cache=True, error_model="numpy")
def solve_tridiagonal(lower, diagonal, upper, rows):
    """Replace `rows`, (n, m), by the solution; the diagonals, (n - 1, n, n - 1), are used up.

    Gaussian elimination with an exchange of neighboring rows, as LAPACK's gtsv.
    """
    n, width = rows.shape
    for i in range(n - 1):
        if abs(diagonal[i]) >= abs(lower[i]):
            share = lower[i] / diagonal[i]
            diagonal[i + 1] -= share * upper[i]
            for j in range(width):
                rows[i + 1, j] -= share * rows[i, j]
            lower[i] = 0.0
            continue
        share = diagonal[i] / lower[i]
        diagonal[i] = lower[i]
        kept = diagonal[i + 1]
        diagonal[i + 1] = upper[i] - share * kept
        upper[i] = kept
        if i < n - 2:
            # Of the column beyond the upper diagonal.
            lower[i] = upper[i + 1]
            upper[i + 1] = -share * lower[i]
        for j in range(width):
            kept = rows[i, j]
            rows[i, j] = rows[i + 1, j]
            rows[i + 1, j] = kept - share * rows[i + 1, j]
    for j in range(width):
        rows[n - 1, j] /= diagonal[n - 1]
        rows[n - 2, j] = (rows[n - 2, j] - upper[n - 2] * rows[n - 1, j]) / diagonal[n - 2]
        for i in range(n - 3, -1, -1):
            known = rows[i, j] - upper[i] * rows[i + 1, j] - lower[i] * rows[i + 2, j]
            rows[i, j] = known / diagonal[i]
