"""Allan, modified Allan and Hadamard variances of a rate, from its integral."""

from __future__ import annotations

import numpy as np

from strapdown._kernels.compilation import IN_PLACE, dot, njit

#: Samples of a part of a record.
CHUNK = 2048


@njit(cache=True, error_model="numpy")
def integrate(rate, mean, phase):
    """Fill the running sum of a rate less its mean; phase (n + 1,) begins with zero."""
    total = 0.0
    phase[0] = 0.0
    for k in range(rate.shape[0]):
        total += rate[k] - mean
        phase[k + 1] = total


@njit(cache=True, error_model="numpy", forceinline=True)
def accumulate(x, n, start):
    """Put running sums from a start in place of the first n numbers of a row; return the last."""
    # Of four parts at once, so that an addition need not wait for the one before it.
    part = n // 4
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    y, z, w = x[part:], x[2 * part :], x[3 * part :]
    for k in range(part):
        a += x[k]
        x[k] = a
        b += y[k]
        y[k] = b
        c += z[k]
        z[k] = c
        d += w[k]
        w[k] = d
    b = a + b
    c = b + c
    d = c + d
    for k in range(part):
        x[k] += start
        y[k] += start + a
        z[k] += start + b
        w[k] += start + c
    total = start + d
    for k in range(4 * part, n):
        total += x[k]
        x[k] = total
    return total


@njit(**IN_PLACE, forceinline=True)
def second_differences(x0, x1, x2, out, n):
    """Fill n second differences of three rows; return the sum of their squares, as `dot`."""
    s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = 0.0
    whole = n - n % 8
    for k in range(0, whole, 8):
        d0 = x2[k] - 2.0 * x1[k] + x0[k]
        d1 = x2[k + 1] - 2.0 * x1[k + 1] + x0[k + 1]
        d2 = x2[k + 2] - 2.0 * x1[k + 2] + x0[k + 2]
        d3 = x2[k + 3] - 2.0 * x1[k + 3] + x0[k + 3]
        d4 = x2[k + 4] - 2.0 * x1[k + 4] + x0[k + 4]
        d5 = x2[k + 5] - 2.0 * x1[k + 5] + x0[k + 5]
        d6 = x2[k + 6] - 2.0 * x1[k + 6] + x0[k + 6]
        d7 = x2[k + 7] - 2.0 * x1[k + 7] + x0[k + 7]
        s0 += d0 * d0
        s1 += d1 * d1
        s2 += d2 * d2
        s3 += d3 * d3
        s4 += d4 * d4
        s5 += d5 * d5
        s6 += d6 * d6
        s7 += d7 * d7
        out[k] = d0
        out[k + 1] = d1
        out[k + 2] = d2
        out[k + 3] = d3
        out[k + 4] = d4
        out[k + 5] = d5
        out[k + 6] = d6
        out[k + 7] = d7
    total = ((s0 + s4) + (s2 + s6)) + ((s1 + s5) + (s3 + s7))
    for k in range(whole, n):
        out[k] = x2[k] - 2.0 * x1[k] + x0[k]
        total += out[k] * out[k]
    return total


@njit(**IN_PLACE, forceinline=True)
def third_differences(x1, x2, x3, out, n):
    """Put n third differences in place of the second ones; return the sum of squares."""
    s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = 0.0
    whole = n - n % 8
    for k in range(0, whole, 8):
        d0 = (x3[k] - 2.0 * x2[k] + x1[k]) - out[k]
        d1 = (x3[k + 1] - 2.0 * x2[k + 1] + x1[k + 1]) - out[k + 1]
        d2 = (x3[k + 2] - 2.0 * x2[k + 2] + x1[k + 2]) - out[k + 2]
        d3 = (x3[k + 3] - 2.0 * x2[k + 3] + x1[k + 3]) - out[k + 3]
        d4 = (x3[k + 4] - 2.0 * x2[k + 4] + x1[k + 4]) - out[k + 4]
        d5 = (x3[k + 5] - 2.0 * x2[k + 5] + x1[k + 5]) - out[k + 5]
        d6 = (x3[k + 6] - 2.0 * x2[k + 6] + x1[k + 6]) - out[k + 6]
        d7 = (x3[k + 7] - 2.0 * x2[k + 7] + x1[k + 7]) - out[k + 7]
        s0 += d0 * d0
        s1 += d1 * d1
        s2 += d2 * d2
        s3 += d3 * d3
        s4 += d4 * d4
        s5 += d5 * d5
        s6 += d6 * d6
        s7 += d7 * d7
        out[k] = d0
        out[k + 1] = d1
        out[k + 2] = d2
        out[k + 3] = d3
        out[k + 4] = d4
        out[k + 5] = d5
        out[k + 6] = d6
        out[k + 7] = d7
    total = ((s0 + s4) + (s2 + s6)) + ((s1 + s5) + (s3 + s7))
    for k in range(whole, n):
        out[k] = (x3[k] - 2.0 * x2[k] + x1[k]) - out[k]
        total += out[k] * out[k]
    return total


@njit(cache=True, error_model="numpy", nogil=True)
def overlapping_variances(phase, factors, out):
    """Fill the sums of squares of three differences of a phase over m samples, and their counts.

    factors: the values of m. out (factors, 6): of second differences; of their running sums over m;
    of third differences; then how many of each there are. With the phase a sum of samples, the
    first is 2 m² times the overlapping Allan variance, the second 2 m⁴ times the modified one, the
    third 6 m² times the Hadamard one, each times its count. Other threads run meanwhile.
    """
    n = phase.shape[0]
    count = factors.shape[0]
    part, running = np.empty(CHUNK), np.zeros(count)
    for j in range(count):
        m = factors[j]
        for c in range(6):
            out[j, c] = 0.0
        out[j, 3] = n - 2 * m
        if n > 3 * m:
            for k in range(m):
                running[j] += phase[k + 2 * m] - 2.0 * phase[k + m] + phase[k]
            out[j, 1] = running[j] * running[j]
            out[j, 4] = n - 3 * m + 1
            out[j, 5] = n - 3 * m
    # A part of the record at a time, for all m, as a part stays in the cache.
    for begin in range(0, n, CHUNK):
        for j in range(count):
            m = factors[j]
            size = min(CHUNK, n - 2 * m - begin)
            if size < 1:
                continue
            x0, x1, x2 = phase[begin:], phase[begin + m :], phase[begin + 2 * m :]
            out[j, 0] += second_differences(x0, x1, x2, part, size)
            size = min(CHUNK, n - 3 * m - begin)
            if size < 1:
                continue
            x3 = phase[begin + 3 * m :]
            out[j, 2] += third_differences(x1, x2, x3, part, size)
            # The sum after the last third difference ends with the last second difference.
            running[j] = accumulate(part, size, running[j])
            out[j, 1] += dot(part, part, size)
