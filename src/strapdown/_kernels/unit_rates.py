"""Rates that units of a gyro triad measure, sample by sample, and attitudes beside the truth.

For many units of one sensor along one motion: what all units share is given once, and a unit is a
row of numbers for each axis.
"""

from __future__ import annotations

import math

import numpy as np

from strapdown._kernels.compilation import njit
from strapdown._kernels.increments import increment
from strapdown._kernels.rotation import quat_multiply

# Columns of the numbers of an axis of a unit: directions, g-sensitivity, and the curve.
FELT, SCALE, SECOND, THIRD, BIAS = 3, 6, 7, 8, 9
# Of an axis of every unit.
FULL, QUANTUM = 0, 1
# Samples that are formed together, in the cache.
CHUNK = 512
# Attitudes that are compared together.
SOME = 64


@njit(cache=True, error_model="numpy")
def bent(x, scale, second, third, full):
    """Output of an axis with nonlinearity; linear along the tangent beyond full scale."""
    r = x / full
    inner = min(max(r, -1.0), 1.0)
    gain = 1.0 + scale
    value = inner * (gain + inner * (second + inner * third))
    slope = gain + inner * (2.0 * second + inner * 3.0 * third)
    return full * (value + slope * (r - inner))


@njit(cache=True, error_model="numpy")
def curve(x, scale, second, third, full):
    """Replace inputs of an axis, (n,), by its output."""
    if second == 0.0 and third == 0.0:
        gain = 1.0 + scale
        for k in range(x.shape[0]):
            x[k] *= gain
    else:
        for k in range(x.shape[0]):
            x[k] = bent(x[k], scale, second, third, full)


@njit(cache=True, error_model="numpy")
def unit_increments(
    rate,
    force,
    felt,
    shared,
    slow,
    each,
    units,
    limits,
    noise_sd,
    numbers,
    quantiles,
    dt,
    mean,
    theta,
    dtheta,
):
    """Fill theta and dtheta, (units, n - 1, 3), of the steps between n samples of some units.

    `rate`, (3, n), rad/s, and `force`, (3, n), m/s², are the true ones, `felt` whether the force
    has an effect; `shared`, (3, n), is the drift of every unit; `slow`, (units, blocks, 3), that of
    each, over `each` samples a block. `units`, (units, 3, 10): of each axis the row of I +
    misalignment, the row of the g-sensitivity, scale, second and third order, bias; `limits`,
    (3, 2): full scale and quantum. White noise of `noise_sd`, (3, n): two bytes of `numbers`,
    (units, 6, n), choose among `quantiles`, (4096,).
    """
    count = rate.shape[1]
    # The last sample of a chunk is the first of the next.
    measured = np.zeros((3, CHUNK + 1))
    for u in range(units.shape[0]):
        for start in range(0, count, CHUNK):
            stop = min(start + CHUNK, count)
            for j in range(3):
                y, own = measured[j], units[u, j]
                y[0] = y[CHUNK]
                _sense(y, start, stop, rate, force, felt, own, limits[j, FULL])
                _drift(y, start, stop, j, shared[j], slow[u], each, own[BIAS])
                sd, low, high = noise_sd[j], numbers[u, 2 * j], numbers[u, 2 * j + 1]
                for i in range(start, stop):
                    number = int(low[i]) + 256 * int(high[i])
                    y[1 + i - start] += sd[i] * quantiles[number]
                _convert(y, stop - start, limits[j, FULL], limits[j, QUANTUM])
            for i in range(max(start, 1), stop):
                k, m, step = i - 1, i - start, dt[i - 1]
                for j in range(3):
                    theta[u, k, j], dtheta[u, k, j] = increment(
                        measured[j, m], measured[j, m + 1], step, mean
                    )


# Each a loop of its own, for the compiler to take several samples at once.


@njit(cache=True, error_model="numpy")
def _sense(y, start, stop, rate, force, felt, own, full):
    """Output of an axis without drift and noise, from the second element of y on."""
    a, b, c = own[0], own[1], own[2]
    x, v, w = rate[0], rate[1], rate[2]
    for i in range(start, stop):
        y[1 + i - start] = a * x[i] + b * v[i] + c * w[i]
    if felt:
        a, b, c = own[FELT], own[FELT + 1], own[FELT + 2]
        x, v, w = force[0], force[1], force[2]
        for i in range(start, stop):
            y[1 + i - start] += a * x[i] + b * v[i] + c * w[i]
    curve(y[1 : 1 + stop - start], own[SCALE], own[SECOND], own[THIRD], full)


@njit(cache=True, error_model="numpy")
def _drift(y, start, stop, j, shared, slow, each, bias):
    """Add bias, the drift of every unit and that of this one."""
    for i in range(start, stop):
        y[1 + i - start] += bias + shared[i]
    block = start // each
    begin = start
    while begin < stop:
        end = min((block + 1) * each, stop)
        wandered = slow[block, j]
        for i in range(begin, end):
            y[1 + i - start] += wandered
        begin = end
        block += 1


@njit(cache=True, error_model="numpy")
def _convert(y, count, full, quantum):
    """Clip to the range, then round to the quantum."""
    for m in range(1, 1 + count):
        y[m] = min(max(y[m], -full), full)
    if quantum > 0.0:
        for m in range(1, 1 + count):
            y[m] = np.rint(y[m] / quantum) * quantum


@njit(cache=True, error_model="numpy")
def turns_from(truth, q):
    """Largest and last angle, rad, between attitudes q, (n, 4), of any norm, and the true ones."""
    sine, cosine, v, c = 0.0, 1.0, 0.0, 1.0
    # Squares of sine and cosine of half the angle, times the norms; first for some samples, for the
    # compiler to take several at once.
    sines, cosines = np.empty(SOME), np.empty(SOME)
    for start in range(0, q.shape[0], SOME):
        stop = min(start + SOME, q.shape[0])
        for i in range(start, stop):
            w, x, y, z = quat_multiply(
                truth[i, 0],
                -truth[i, 1],
                -truth[i, 2],
                -truth[i, 3],
                q[i, 0],
                q[i, 1],
                q[i, 2],
                q[i, 3],
            )
            sines[i - start], cosines[i - start] = x * x + y * y + z * z, w * w
        for k in range(stop - start):
            v, c = sines[k], cosines[k]
            # The larger of two angles between 0 and 180 deg, without a division.
            if v * cosine > sine * c:
                sine, cosine = v, c
    return 2.0 * math.atan2(math.sqrt(sine), math.sqrt(cosine)), 2.0 * math.atan2(
        math.sqrt(v), math.sqrt(c)
    )
