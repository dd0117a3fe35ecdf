"""Rates that one unit of a gyro triad measures, sample by sample, and attitudes beside the truth.

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


@njit(cache=True, error_model="numpy")
def curve(x, scale, second, third, full):
    """Output of an axis for an input; linear along the tangent beyond full scale."""
    if second == 0.0 and third == 0.0:
        return x * (1.0 + scale)
    r = x / full
    inner = min(max(r, -1.0), 1.0)
    gain = 1.0 + scale
    value = inner * (gain + inner * (second + inner * third))
    slope = gain + inner * (2.0 * second + inner * 3.0 * third)
    return full * (value + slope * (r - inner))


@njit(cache=True, error_model="numpy")
def curves(x, scale, second, third, full, out):
    """`curve` of (n,) inputs."""
    for k in range(x.shape[0]):
        out[k] = curve(x[k], scale, second, third, full)


@njit(cache=True, error_model="numpy")
def converted(y, full, quantum):
    """Output of the converter: clipped, then rounded."""
    y = min(max(y, -full), full)
    if quantum > 0.0:
        y = np.rint(y / quantum) * quantum
    return y


@njit(cache=True, error_model="numpy")
def unit_increments(
    rate,
    force,
    felt,
    shared,
    slow,
    each,
    unit,
    limits,
    noise_sd,
    numbers,
    quantiles,
    dt,
    mean,
    theta,
    dtheta,
):
    """Fill theta and dtheta, (n - 1, 3), of the steps between n samples of a unit.

    `rate`, (n, 3), rad/s, and `force`, (n, 3), m/s², are the true ones, `felt` whether the force
    has an effect; `shared`, (n, 3), is the drift of every unit; `slow`, (blocks, 3), that of this
    one, each over `each` samples. `unit`, (3, 10): of each axis the row of I + misalignment, the
    row of the g-sensitivity, scale, second and third order, bias; `limits`, (3, 2): full scale and
    quantum. White noise of `noise_sd`, (n, 3): two bytes of `numbers`, (n, 6), choose among
    `quantiles`, (65536,).
    """
    block, left = 0, each
    before0, before1, before2 = 0.0, 0.0, 0.0
    for i in range(rate.shape[0]):
        if left == 0:
            block += 1
            left = each
        left -= 1
        y0 = _measured(
            0, i, block, rate, force, felt, shared, slow, unit, limits, noise_sd, numbers, quantiles
        )
        y1 = _measured(
            1, i, block, rate, force, felt, shared, slow, unit, limits, noise_sd, numbers, quantiles
        )
        y2 = _measured(
            2, i, block, rate, force, felt, shared, slow, unit, limits, noise_sd, numbers, quantiles
        )
        if i > 0:
            k = i - 1
            theta[k, 0], dtheta[k, 0] = increment(before0, y0, dt[k], mean)
            theta[k, 1], dtheta[k, 1] = increment(before1, y1, dt[k], mean)
            theta[k, 2], dtheta[k, 2] = increment(before2, y2, dt[k], mean)
        before0, before1, before2 = y0, y1, y2


@njit(cache=True, error_model="numpy")
def _measured(
    j, i, block, rate, force, felt, shared, slow, unit, limits, noise_sd, numbers, quantiles
):
    """Output of axis j at sample i."""
    v = unit[j, 0] * rate[i, 0] + unit[j, 1] * rate[i, 1] + unit[j, 2] * rate[i, 2]
    if felt:
        v += unit[j, FELT] * force[i, 0]
        v += unit[j, FELT + 1] * force[i, 1]
        v += unit[j, FELT + 2] * force[i, 2]
    y = curve(v, unit[j, SCALE], unit[j, SECOND], unit[j, THIRD], limits[j, FULL])
    number = int(numbers[i, 2 * j]) + 256 * int(numbers[i, 2 * j + 1])
    y += unit[j, BIAS] + shared[i, j] + slow[block, j] + noise_sd[i, j] * quantiles[number]
    return converted(y, limits[j, FULL], limits[j, QUANTUM])


@njit(cache=True, error_model="numpy")
def turns_from(truth, q):
    """Largest and last angle, rad, between attitudes q, (n, 4), of any norm, and the true ones."""
    sine, cosine, v, c = 0.0, 1.0, 0.0, 1.0
    for i in range(q.shape[0]):
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
        v, c = x * x + y * y + z * z, w * w
        # The larger of two angles between 0 and 180 deg, without a division.
        if v * cosine > sine * c:
            sine, cosine = v, c
    return 2.0 * math.atan2(math.sqrt(sine), math.sqrt(cosine)), 2.0 * math.atan2(
        math.sqrt(v), math.sqrt(c)
    )
