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
    run = 0.0
    for k in range(m):
        run += phase[k + 2 * m] - 2.0 * phase[k + m] + phase[k]
    b, c = run * run, 0.0
    for k in range(third):
        d0 = phase[k + 3 * m] - 3.0 * phase[k + 2 * m] + 3.0 * phase[k + m] - phase[k]
        c += d0 * d0
        run += d0
        # The sum after the last third difference ends with the last second difference.
        b += run * run
    out[1] = b
    out[4] = third + 1
    out[2] = c
    out[5] = third
