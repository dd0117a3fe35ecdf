"""Angular increments of the steps between samples.

A step carries ``theta``, the integral of the rate over it, and ``dtheta``, the change of
the rate over it times its length (zero for a mean rate). Taken as linear over the step the
rate times its length is ``theta -+ dtheta/2`` at the two ends: by the trapezoid these are the
samples; by the cubic they differ from them by an even term of the second order, whose
integral is zero and whose effect on the attitude is of the fifth.
"""

from __future__ import annotations

from strapdown._kernels.compilation import njit


@njit(cache=True)
def increment(w0, w1, dt, mean):
    """Theta and dtheta of one axis: trapezoid of instantaneous rates, or a mean rate."""
    if mean:
        return w1 * dt, 0.0
    return 0.5 * (w0 + w1) * dt, (w1 - w0) * dt


@njit(cache=True)
def increments(dt, rate, mean, theta, dtheta):
    """Fill theta and dtheta, both (n-1, 3), from n samples of the rate and n-1 steps."""
    for k in range(dt.shape[0]):
        for j in range(3):
            theta[k, j], dtheta[k, j] = increment(rate[k, j], rate[k + 1, j], dt[k], mean)


# Neighbours help only where their steps are like the one between them: in a burst, or beside
# a gap, the polynomial through them does not describe it.
ALIKE = 2.0


@njit(cache=True)
def cubic_mean(before, first, last, after, p, r):
    """Mean over a step of the cubic through its two ends and one neighbour on each side.

    The neighbours are p and r steps away; one whose distance is zero is not used, and then
    it is the parabola through three, or the chord.
    """
    slope = last - first
    left = 0.0
    right = 0.0
    if p > 0.0:
        left = (slope - (first - before) / p) / (1.0 + p)
    if r > 0.0:
        right = ((after - last) / r - slope) / (1.0 + r)
    mean = 0.5 * (first + last)
    if p > 0.0 and r > 0.0:
        third = (right - left) / (1.0 + p + r)
        return mean - left / 6.0 - third * (1.0 / 12.0 + p / 6.0)
    return mean - (left + right) / 6.0


@njit(cache=True)
def neighbour(step, other):
    """Distance of a neighbour in steps, or zero where it does not help."""
    if other <= ALIKE * step and step <= ALIKE * other:
        return other / step
    return 0.0


@njit(cache=True)
def increments_cubic(dt, rate, theta, dtheta):
    """As `increments` of instantaneous rates, with the rate as a cubic over each step."""
    steps = dt.shape[0]
    for k in range(steps):
        p, r = 0.0, 0.0
        if k > 0:
            p = neighbour(dt[k], dt[k - 1])
        if k + 1 < steps:
            r = neighbour(dt[k], dt[k + 1])
        for j in range(3):
            first, last = rate[k, j], rate[k + 1, j]
            before, after = rate[max(k - 1, 0), j], rate[min(k + 2, steps), j]
            theta[k, j] = dt[k] * cubic_mean(before, first, last, after, p, r)
            dtheta[k, j] = (last - first) * dt[k]


# Memory of a sample-by-sample run between calls: the head of one float64 array whose tail
# is the algorithm's state. One array, because every further argument of a compiled function
# costs several times what the attitude update itself does.
LARGEST = 1e150
TIME, RATE, SAMPLES, MEAN, OPTIONS = 0, 1, 4, 5, 6
HEAD = 8


@njit(cache=True)
def take_sample(record, time, rate):
    """Step from the remembered sample to this one; remember this one.

    Returns the length of the step, theta and dtheta of the three axes. The length is 0 for
    the first sample; negative, or NaN, for a sample that must be refused (time does not
    advance; not three finite rates), and then nothing has been remembered.
    """
    refused = float("nan")
    if rate.shape[0] != 3:
        return refused, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    x, y, z = rate[0], rate[1], rate[2]
    # So written NaN is refused, too; a larger rate's square leaves the range of a double.
    if not (abs(x) < LARGEST and abs(y) < LARGEST and abs(z) < LARGEST and abs(time) < LARGEST):
        return refused, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if record[SAMPLES] == 0.0:
        dt, tx, ty, tz, dx, dy, dz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    else:
        dt = time - record[TIME]
        if dt <= 0.0:
            return -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        mean = record[MEAN] != 0.0
        tx, dx = increment(record[RATE], x, dt, mean)
        ty, dy = increment(record[RATE + 1], y, dt, mean)
        tz, dz = increment(record[RATE + 2], z, dt, mean)
    record[TIME], record[RATE], record[RATE + 1], record[RATE + 2] = time, x, y, z
    record[SAMPLES] += 1.0
    return dt, tx, ty, tz, dx, dy, dz
