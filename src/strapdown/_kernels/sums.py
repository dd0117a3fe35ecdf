"""Running sums of motion increments: over intervals, in inertial axes, and fading means."""

from __future__ import annotations

import math

import numpy as np

from strapdown._kernels.compilation import njit
from strapdown._kernels.rotation import (
    dcm_from_quat,
    quat_from_rotvec,
    quat_multiply,
    quat_normalise,
)
from strapdown._kernels.rotation_vector import cross

#: Indices of the memory: number of the interval; sums of dt, angle, velocity.
NUMBER, SUMS = 0, 1
MEMORY = 8
# Part of an interval within which a stamp counts as on the grid: stamps are rounded.
_SLACK = 1e-6


@njit(cache=True, error_model="numpy")
def interval_sums(time, rows, interval, memory, at, means):
    """Fill the ends of the intervals, and the mean rate and force over each; return their count.

    An interval ends with the first step that reaches or passes a multiple of it. `memory` is
    changed; its first number is NaN before the first step. `at` (k,) is the index of the step,
    `means` (k, 6) in the axes of the body at each instant.
    """
    count = 0
    for i in range(time.size):
        number = math.floor(time[i] / interval + _SLACK)
        if math.isnan(memory[NUMBER]):
            memory[NUMBER] = math.floor((time[i] - rows[i, 0]) / interval + _SLACK)
        for j in range(7):
            memory[SUMS + j] += rows[i, j]
        if number > memory[NUMBER]:
            memory[NUMBER] = number
            for j in range(6):
                means[count, j] = memory[SUMS + 1 + j] / memory[SUMS]
            for j in range(7):
                memory[SUMS + j] = 0.0
            at[count] = i
            count += 1
    return count


# Specific force summed in the body's axes at the first instant, fixed in inertial space.


# A product of unit quaternions drifts from norm one by 1e-16 a step: this keeps it there.
NORMALISE_EVERY = 1000


@njit(cache=True, error_model="numpy")
def inertial_sums(rows, last, turned, fallen, velocity, times, turns, pushes):
    """Sum motion increments; rows (n, 10) are dt, phi, dv, dr, and last (m,) ends m nodes.

    fallen (n + 1, 3) is the second integral of the force at every stamp, and turned (n + 1, 4)
    the body's attitude. At the end of each node: velocity (m, 3), the first integral. For each
    node: times (m, 3, 3), the integral of C; turns and pushes (m, 3, 3, 3), the sums of
    C[:, i] phi[j] and C[:, i] dv[j]: the effect of an error of axis i proportional to the input of
    axis j.
    """
    w, x, y, z = 1.0, 0.0, 0.0, 0.0
    v = np.zeros(3)
    s = np.zeros(3)
    dv = np.empty(3)
    dr = np.empty(3)
    c = np.empty((3, 3))
    node = 0
    fallen[0, :] = 0.0
    turned[0, 0], turned[0, 1], turned[0, 2], turned[0, 3] = w, x, y, z
    for k in range(rows.shape[0]):
        dt = rows[k, 0]
        c11, c12, c13, c21, c22, c23, c31, c32, c33 = dcm_from_quat(w, x, y, z)
        c[0, 0], c[0, 1], c[0, 2] = c11, c12, c13
        c[1, 0], c[1, 1], c[1, 2] = c21, c22, c23
        c[2, 0], c[2, 1], c[2, 2] = c31, c32, c33
        for i in range(3):
            dv[i] = c[i, 0] * rows[k, 4] + c[i, 1] * rows[k, 5] + c[i, 2] * rows[k, 6]
            dr[i] = c[i, 0] * rows[k, 7] + c[i, 1] * rows[k, 8] + c[i, 2] * rows[k, 9]
        for i in range(3):
            s[i] += v[i] * dt + dr[i]
            v[i] += dv[i]
            fallen[k + 1, i] = s[i]
            for j in range(3):
                times[node, i, j] += c[i, j] * dt
                for h in range(3):
                    turns[node, h, i, j] += c[h, i] * rows[k, 1 + j]
                    pushes[node, h, i, j] += c[h, i] * rows[k, 4 + j]
        qw, qx, qy, qz = quat_from_rotvec(rows[k, 1], rows[k, 2], rows[k, 3])
        w, x, y, z = quat_multiply(w, x, y, z, qw, qx, qy, qz)
        if (k + 1) % NORMALISE_EVERY == 0:
            w, x, y, z = quat_normalise(w, x, y, z)
        turned[k + 1, 0], turned[k + 1, 1], turned[k + 1, 2], turned[k + 1, 3] = w, x, y, z
        if k == last[node]:
            for i in range(3):
                velocity[node, i] = v[i]
            node += 1


@njit(cache=True, error_model="numpy")
def legendre_moments(u, values, out):
    """Coefficients out (d, k) of values (n, k) in Legendre polynomials of u in [-1, 1].

    Each is (2 d + 1)/2 times the integral of P_d times the values, by the trapezoidal rule.
    """
    n, width = values.shape
    degrees = out.shape[0]
    out[:, :] = 0.0
    ahead, behind = np.empty(degrees), np.empty(degrees)
    for d in range(degrees):
        ahead[d], behind[d] = (2.0 * d + 1.0) / (d + 1.0), d / (d + 1.0)
    for i in range(n):
        before = u[i] - u[i - 1] if i > 0 else 0.0
        after = u[i + 1] - u[i] if i < n - 1 else 0.0
        weight = 0.5 * (before + after)
        older, p = 0.0, 1.0
        for d in range(degrees):
            part = weight * p
            for j in range(width):
                out[d, j] += part * values[i, j]
            older, p = p, ahead[d] * u[i] * p - behind[d] * older
    for d in range(degrees):
        for j in range(width):
            out[d, j] *= 0.5 * (2 * d + 1)


# Fading means of rate and force, without vibration, in body axes.


#: Length of the memory: rate, force, and whether it is set.
STEADY = 7


@njit(cache=True, error_model="numpy")
def steady_motion(rows, memory_time, memory, out):
    """Fill rates and forces, (k, 6), at the ends of steps; `memory` continues with them.

    The remembered force is turned against the turn of the body, so that a force constant in
    inertial axes, as gravity is, does not change in a turn.
    """
    for i in range(rows.shape[0]):
        dt = rows[i, 0]
        px, py, pz = rows[i, 1], rows[i, 2], rows[i, 3]
        if memory[6] == 0.0:
            for k in range(6):
                memory[k] = rows[i, 1 + k] / dt
            memory[6] = 1.0
        fx, fy, fz = memory[3], memory[4], memory[5]
        ax, ay, az = cross(px, py, pz, fx, fy, fz)
        bx, by, bz = cross(px, py, pz, ax, ay, az)
        memory[3], memory[4], memory[5] = fx - ax + 0.5 * bx, fy - ay + 0.5 * by, fz - az + 0.5 * bz
        part = 1.0 - math.exp(-dt / memory_time)
        for k in range(6):
            memory[k] += part * (rows[i, 1 + k] / dt - memory[k])
            out[i, k] = memory[k]


@njit(cache=True)
def window_moments(values, starts, ends, mean, variance):
    """Fill mean and variance, (m, k), of columns (n, k) over windows of samples.

    The variance of each about its own mean: of running sums the rounding would appear as noise.
    """
    for w in range(starts.shape[0]):
        count = ends[w] - starts[w]
        for j in range(values.shape[1]):
            total = 0.0
            for i in range(starts[w], ends[w]):
                total += values[i, j]
            middle = total / count
            total = 0.0
            for i in range(starts[w], ends[w]):
                total += (values[i, j] - middle) * (values[i, j] - middle)
            mean[w, j], variance[w, j] = middle, total / count
