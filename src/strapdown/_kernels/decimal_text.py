"""Numbers as text with a fixed number of decimals."""

from __future__ import annotations

import numpy as np
from numba import njit

# Doubles hold all whole numbers up to here.
_LARGEST = 9007199254740992.0
_ZERO, _POINT, _MINUS, _BREAK = 48, 46, 45, 10
#: Of one number: a sign, 16 digits and zeros before them, a point, a separator.
WIDTH = 40


@njit(cache=True)
def decimal_text(values, decimals, separator, text):
    """Write rows of numbers, each column with its number of decimals.

    Parameters
    ----------
    values : ndarray, (n, m)
    decimals : ndarray of int64, (m,)
        0 to 15.
    separator : int
        Code of the letter between numbers; after the last of a row stands a line feed.
    text : ndarray of uint8, (n m WIDTH,) or more
        Out.

    Returns
    -------
    int
        Letters written; -1 where a number times ``10^decimals`` is no whole number that a double
        holds.
    """
    n, m = values.shape
    at = 0
    scale = 10.0**decimals
    reverse = np.zeros(WIDTH, dtype=np.uint8)
    for i in range(n):
        for j in range(m):
            scaled = values[i, j] * scale[j]
            if not abs(scaled) < _LARGEST:
                return -1
            whole = np.int64(abs(np.rint(scaled)))
            # No minus before a zero.
            if scaled < 0.0 and whole > 0:
                text[at] = _MINUS
                at += 1
            count = 0
            while whole > 0 or count <= decimals[j]:
                rest = whole // 10
                reverse[count] = whole - 10 * rest
                whole = rest
                count += 1
            for k in range(count - 1, -1, -1):
                text[at] = _ZERO + reverse[k]
                at += 1
                if k == decimals[j] and k > 0:
                    text[at] = _POINT
                    at += 1
            text[at] = _BREAK if j == m - 1 else separator
            at += 1
    return at
