"""Allan, modified Allan and Hadamard variances of a rate, from its integral."""

from __future__ import annotations

from strapdown._kernels.compilation import njit


@njit(cache=True, error_model="numpy")
def integrate(rate, mean, phase):
    """Fill the running sum of a rate less its mean; phase (n + 1,) begins with zero."""
    total = 0.0
    phase[0] = 0.0
    for k in range(rate.shape[0]):
        total += rate[k] - mean
        phase[k + 1] = total


@njit(cache=True, error_model="numpy")
def overlapping_variances(phase, m, out):
    """Fill the sums of squares of three differences of a phase over m samples, and their counts.

    out: of second differences; of their running sums over m; of third differences; then how many
    of each there are. With the phase a sum of samples, the first is 2 m² times the overlapping
    Allan variance, the second 2 m⁴ times the modified one, the third 6 m² times the Hadamard one,
    each times its count.
    """
    n = phase.shape[0]
    for j in range(6):
        out[j] = 0.0
    second = n - 2 * m
    third = n - 3 * m
    # Four sums, so that an addition need not wait for the one before it.
    a0, a1, a2, a3 = 0.0, 0.0, 0.0, 0.0
    k = 0
    while k + 4 <= second:
        d0 = phase[k + 2 * m] - 2.0 * phase[k + m] + phase[k]
        d1 = phase[k + 1 + 2 * m] - 2.0 * phase[k + 1 + m] + phase[k + 1]
        d2 = phase[k + 2 + 2 * m] - 2.0 * phase[k + 2 + m] + phase[k + 2]
        d3 = phase[k + 3 + 2 * m] - 2.0 * phase[k + 3 + m] + phase[k + 3]
        a0 += d0 * d0
        a1 += d1 * d1
        a2 += d2 * d2
        a3 += d3 * d3
        k += 4
    while k < second:
        d0 = phase[k + 2 * m] - 2.0 * phase[k + m] + phase[k]
        a0 += d0 * d0
        k += 1
    out[0] = (a0 + a1) + (a2 + a3)
    out[3] = second
    if third < 1:
        return
    # Of four parts of the record, each with its own running sum.
    part = third // 4
    r0, r1, r2, r3 = 0.0, 0.0, 0.0, 0.0
    for k in range(m):
        r0 += phase[k + 2 * m] - 2.0 * phase[k + m] + phase[k]
        i = k + part
        r1 += phase[i + 2 * m] - 2.0 * phase[i + m] + phase[i]
        i += part
        r2 += phase[i + 2 * m] - 2.0 * phase[i + m] + phase[i]
        i += part
        r3 += phase[i + 2 * m] - 2.0 * phase[i + m] + phase[i]
    b0, b1, b2, b3 = r0 * r0, 0.0, 0.0, 0.0
    a0, a1, a2, a3 = 0.0, 0.0, 0.0, 0.0
    for k in range(part):
        d0 = phase[k + 3 * m] - 3.0 * phase[k + 2 * m] + 3.0 * phase[k + m] - phase[k]
        i = k + part
        d1 = phase[i + 3 * m] - 3.0 * phase[i + 2 * m] + 3.0 * phase[i + m] - phase[i]
        i += part
        d2 = phase[i + 3 * m] - 3.0 * phase[i + 2 * m] + 3.0 * phase[i + m] - phase[i]
        i += part
        d3 = phase[i + 3 * m] - 3.0 * phase[i + 2 * m] + 3.0 * phase[i + m] - phase[i]
        a0 += d0 * d0
        a1 += d1 * d1
        a2 += d2 * d2
        a3 += d3 * d3
        # The sum after the last third difference ends with the last second difference.
        r0 += d0
        r1 += d1
        r2 += d2
        r3 += d3
        b0 += r0 * r0
        b1 += r1 * r1
        b2 += r2 * r2
        b3 += r3 * r3
    for k in range(4 * part, third):
        d3 = phase[k + 3 * m] - 3.0 * phase[k + 2 * m] + 3.0 * phase[k + m] - phase[k]
        a3 += d3 * d3
        r3 += d3
        b3 += r3 * r3
    out[1] = (b0 + b1) + (b2 + b3)
    out[4] = third + 1
    out[2] = (a0 + a1) + (a2 + a3)
    out[5] = third
