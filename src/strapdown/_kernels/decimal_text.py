"""Numbers as text with a fixed number of decimals."""

from __future__ import annotations

import numpy as np

from strapdown._kernels.compilation import njit

# Doubles hold all whole numbers up to here.
_LARGEST = 9007199254740992.0
_ZERO, _POINT, _MINUS, _BREAK = np.uint8(48), np.uint8(46), np.uint8(45), np.uint8(10)
_TEN, _NONE = np.uint64(10), np.uint64(0)
#: Of one number: a sign, 16 digits and zeros before them, a point, a separator.
WIDTH = 40


@njit(cache=True, error_model="numpy")
def decimal_text(values, decimals, separator, text):
    """Write rows of numbers, each column with its number of decimals.

    `values` (n, m); `decimals` (m,), int64, 0 to 15; `separator`, the code of the letter between
    numbers (a line feed ends a row); `text`, uint8, (n m WIDTH,) or more, is filled. Returns the
    letters written, or -1 where a number times ``10^decimals`` is not an integer that a double
    holds.
    """
    n, m = values.shape
    at = 0
    scale = 10.0**decimals
    for i in range(n):
        for j in range(m):
            scaled = values[i, j] * scale[j]
            if not abs(scaled) < _LARGEST:
                return -1
            left = np.uint64(abs(np.rint(scaled)))
            # No minus before a zero.
            if scaled < 0.0 and left > _NONE:
                text[at] = _MINUS
                at += 1
            count = decimals[j] + 1
            beyond = np.uint64(scale[j]) * _TEN
            while left >= beyond:
                beyond *= _TEN
                count += 1
            # From the last digit on.
            end = at + count + (1 if decimals[j] > 0 else 0)
            k = end
            for _ in range(decimals[j]):
                tens = left // _TEN
                k -= 1
                text[k] = _ZERO + np.uint8(left - _TEN * tens)
                left = tens
            if decimals[j] > 0:
                k -= 1
                text[k] = _POINT
            while k > at:
                tens = left // _TEN
                k -= 1
                text[k] = _ZERO + np.uint8(left - _TEN * tens)
                left = tens
            at = end
            text[at] = _BREAK if j == m - 1 else separator
            at += 1
    return at
