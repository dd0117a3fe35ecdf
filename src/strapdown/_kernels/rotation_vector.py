"""Bortz's rotation vector over blocks of 1 to 4 increments: its step and its two loops.

The state is (the quaternion now, that at the start of the block, steps in the block, their
increments as length and three angles each). Within a block the attitude is that of the
block's start turned by the rotation vector of the increments so far, so that it is defined
at every step and at a ragged end. A block ends when it is full or has turned by 1 rad, or
before a step that is unlike its first: a polynomial through a burst and a gap would say
nothing of either.

The rotation vector of a block is ``sum + 1/2 int(alpha x omega) + ...``, Bortz (1971). By
`MILLER` it is the sum and products of pairs of increments with the coefficients that are
best for pure coning (Miller 1983 for three; for four those of Ignagni 1990 by distance,
54, 92 and 214 over 105, shared out so that quadratic rates are integrated exactly, too),
which assume equal steps. By `FIT` the rate is the polynomial whose integrals over the steps
are the increments, whatever their lengths, and the rotation vector is its Magnus expansion
to sixth order (Blanes, Casas and Ros, BIT 40 (2000) 434, Eqs. (3.9), (3.11)).

One increment by `PREVIOUS` takes the turning of its axis from the increment before it (Savage 1998,
J. Guid. Control Dyn. 21(1) 19-28: 1/12 of their cross product, for equal steps).
"""

from __future__ import annotations

import math

from strapdown._kernels.compilation import njit
from strapdown._kernels.increments import HEAD, OPTIONS, take_sample
from strapdown._kernels.rotation import quat_from_rotvec, quat_multiply, quat_normalise

AUTO, MILLER, FIT, PREVIOUS = 0.0, 1.0, 2.0, 3.0
# Relative spread of the steps of a block that still counts as equal. Unequal steps by this
# share change the correction for coning by the same share, which is less than what
# the correction of the next higher number of increments changes at the rates it is used at.
EQUAL = 1e-3

# Ratio of two steps up to which they may share a block.
ALIKE = 3.0
# Cosine of half a turn of 1 rad: a block that has turned by more ends before the next step,
# because the series in powers of its turn no longer converge fast.
COS_HALF_LARGEST = 0.877582561890372727

COUNT = 8
FIRST = 9  # of the increments; each has four numbers
STATE = FIRST + 16

ROOT_15_THIRD = math.sqrt(15.0) / 3.0
GAUSS_FIRST = 0.5 - 0.1 * math.sqrt(15.0)
GAUSS_LAST = 0.5 + 0.1 * math.sqrt(15.0)


@njit(cache=True)
def cross(ax, ay, az, bx, by, bz):
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@njit(cache=True)
def equal_steps(state, count):
    first = state[FIRST]
    spread = 0.0
    for k in range(1, count):
        spread = max(spread, abs(state[FIRST + 4 * k] - first))
    return spread <= EQUAL * first


@njit(cache=True)
def miller_vector(state, count):
    """Rotation vector of 1 to 4 increments of equal steps, best for pure coning."""
    ax, ay, az = state[10], state[11], state[12]
    if count == 1:
        return ax, ay, az
    bx, by, bz = state[14], state[15], state[16]
    if count == 2:
        x, y, z = cross(ax, ay, az, bx, by, bz)
        k = 2.0 / 3.0
        return ax + bx + k * x, ay + by + k * y, az + bz + k * z
    cx, cy, cz = state[18], state[19], state[20]
    if count == 3:
        x, y, z = cross(ax, ay, az, cx, cy, cz)
        u, v, w = cross(bx, by, bz, cx - ax, cy - ay, cz - az)
        k, m = 9.0 / 20.0, 27.0 / 40.0
        return (
            ax + bx + cx + k * x + m * u,
            ay + by + cy + k * y + m * v,
            az + bz + cz + k * z + m * w,
        )
    dx, dy, dz = state[22], state[23], state[24]
    # k1 (1x2 + 3x4) + k2 (1x3 + 2x4) + k3 1x4 + k4 2x3, gathered by their left factors.
    k1, k2, k3, k4 = 232.0 / 315.0, 46.0 / 105.0, 54.0 / 105.0, 178.0 / 315.0
    x, y, z = cross(
        ax,
        ay,
        az,
        k1 * bx + k2 * cx + k3 * dx,
        k1 * by + k2 * cy + k3 * dy,
        k1 * bz + k2 * cz + k3 * dz,
    )
    u, v, w = cross(bx, by, bz, k4 * cx + k2 * dx, k4 * cy + k2 * dy, k4 * cz + k2 * dz)
    p, q, r = cross(k1 * cx, k1 * cy, k1 * cz, dx, dy, dz)
    return (
        ax + bx + cx + dx + x + u + p,
        ay + by + cy + dy + y + v + q,
        az + bz + cz + dz + z + w + r,
    )


@njit(cache=True)
def polynomial_rate(t, s1, s2, s3, d1, d2, d3, d4):
    """Derivative at t of Newton's polynomial through zero at 0 with nodes s1, s2, s3."""
    e1, e2, e3 = s1 + s2 + s3, s1 * s2 + (s1 + s2) * s3, s1 * s2 * s3
    second = 2.0 * t - s1
    third = (3.0 * t - 2.0 * (s1 + s2)) * t + s1 * s2
    fourth = ((4.0 * t - 3.0 * e1) * t + 2.0 * e2) * t - e3
    return d1 + d2 * second + d3 * third + d4 * fourth


@njit(cache=True)
def rate_moments(count, s1, s2, s3, a, b, c, d):
    """Moments of one axis: of the polynomial rate whose integrals are a, b, c, d.

    The nodes between the steps are s1, s2, s3 of the whole block, whose length is 1. Returns
    the rate in the middle, and what Blanes, Casas and Ros call alpha2 and alpha3.
    """
    # Divided differences of the integral: its value at the nodes is a, a + b, ...
    if count == 2:
        r1, r2 = a / s1, b / (1.0 - s1)
        d1, d2, d3, d4 = r1, r2 - r1, 0.0, 0.0
    elif count == 3:
        r1, r2, r3 = a / s1, b / (s2 - s1), c / (1.0 - s2)
        p1, p2 = (r2 - r1) / s2, (r3 - r2) / (1.0 - s1)
        d1, d2, d3, d4 = r1, p1, p2 - p1, 0.0
    else:
        r1, r2, r3, r4 = a / s1, b / (s2 - s1), c / (s3 - s2), d / (1.0 - s3)
        p1, p2, p3 = (r2 - r1) / s2, (r3 - r2) / (s3 - s1), (r4 - r3) / (1.0 - s2)
        q1, q2 = (p2 - p1) / s3, (p3 - p2) / (1.0 - s1)
        d1, d2, d3, d4 = r1, p1, q1, q2 - q1
    low = polynomial_rate(GAUSS_FIRST, s1, s2, s3, d1, d2, d3, d4)
    mid = polynomial_rate(0.5, s1, s2, s3, d1, d2, d3, d4)
    high = polynomial_rate(GAUSS_LAST, s1, s2, s3, d1, d2, d3, d4)
    return mid, ROOT_15_THIRD * (high - low), 10.0 / 3.0 * (high - 2.0 * mid + low)


@njit(cache=True)
def fitted_vector(state, count):
    """Rotation vector of the polynomial rate through 1 to 4 increments of any lengths."""
    if count == 1:
        return state[10], state[11], state[12]
    length = state[9] + state[13]
    if count > 2:
        length += state[17]
    if count > 3:
        length += state[21]
    s1 = state[9] / length
    s2 = (state[9] + state[13]) / length
    s3 = 1.0
    if count == 4:
        s3 = (state[9] + state[13] + state[17]) / length
    ax, bx, cx = rate_moments(count, s1, s2, s3, state[10], state[14], state[18], state[22])
    ay, by, cy = rate_moments(count, s1, s2, s3, state[11], state[15], state[19], state[23])
    az, bz, cz = rate_moments(count, s1, s2, s3, state[12], state[16], state[20], state[24])
    # The commutator of two rates is here the cross product with its factors exchanged,
    # because body rates multiply from the right.
    px, py, pz = cross(bx, by, bz, ax, ay, az)
    qx, qy, qz = cross(2.0 * cx + px, 2.0 * cy + py, 2.0 * cz + pz, ax, ay, az)
    k = 1.0 / 60.0
    ux, uy, uz = bx - k * qx, by - k * qy, bz - k * qz
    vx, vy, vz = cross(ux, uy, uz, px - 20.0 * ax - cx, py - 20.0 * ay - cy, pz - 20.0 * az - cz)
    k, m = 1.0 / 12.0, 1.0 / 240.0
    return ax + k * cx + m * vx, ay + k * cy + m * vy, az + k * cz + m * vz


@njit(cache=True)
def block_vector(state, count, coefficients):
    if coefficients == MILLER or (coefficients == AUTO and equal_steps(state, count)):
        return miller_vector(state, count)
    return fitted_vector(state, count)


@njit(cache=True)
def linear_rate_vector(tx, ty, tz, dx, dy, dz):
    """Rotation vector of one step whose rate changes linearly by dtheta over it."""
    k = 1.0 / 12.0
    x, y, z = cross(tx, ty, tz, dx, dy, dz)
    return tx + k * x, ty + k * y, tz + k * z


@njit(cache=True)
def previous_vector(state, dt, tx, ty, tz, dx, dy, dz):
    """Rotation vector of one step whose axis turns as since the step before; remember this one.

    Of a rate that is linear over both steps the increments determine the slope, and the step has
    ``phi = theta + h^2 / (6 p (p + h)) theta_p x theta`` for a step h after a step p: 1/12 for
    equal ones. Where rates at the stamps were given, the chord under their arc
    is too short: its errors telescope but for a drift of ``h^2/12 int omega x omega'``, the same as
    that within the step, so that the term of the change is added and not replaced.
    """
    x, y, z = linear_rate_vector(tx, ty, tz, dx, dy, dz)
    before = state[FIRST]
    if state[COUNT] > 0.0 and dt <= ALIKE * before and before <= ALIKE * dt:
        k = dt * dt / (6.0 * before * (before + dt))
        u, v, w = cross(state[FIRST + 1], state[FIRST + 2], state[FIRST + 3], tx, ty, tz)
        x, y, z = x + k * u, y + k * v, z + k * w
    state[FIRST], state[FIRST + 1], state[FIRST + 2], state[FIRST + 3] = dt, tx, ty, tz
    return x, y, z


@njit(cache=True)
def rotvec_step(state, dt, tx, ty, tz, dx, dy, dz, samples, coefficients):
    if coefficients == PREVIOUS:
        x, y, z = previous_vector(state, dt, tx, ty, tz, dx, dy, dz)
    elif samples == 1.0:
        x, y, z = linear_rate_vector(tx, ty, tz, dx, dy, dz)
    else:
        first = state[FIRST]
        w = state[0] * state[4] + state[1] * state[5] + state[2] * state[6] + state[3] * state[7]
        if state[COUNT] > 0.0 and (
            dt > ALIKE * first or first > ALIKE * dt or abs(w) < COS_HALF_LARGEST
        ):
            state[4], state[5], state[6], state[7] = state[0], state[1], state[2], state[3]
            state[COUNT] = 0.0
        done = int(state[COUNT])
        at = FIRST + 4 * done
        state[at], state[at + 1], state[at + 2], state[at + 3] = dt, tx, ty, tz
        state[COUNT] += 1.0
        x, y, z = block_vector(state, done + 1, coefficients)
    w, x, y, z = quat_from_rotvec(x, y, z)
    w, x, y, z = quat_multiply(state[4], state[5], state[6], state[7], w, x, y, z)
    w, x, y, z = quat_normalise(w, x, y, z)
    state[0], state[1], state[2], state[3] = w, x, y, z
    if samples == 1.0 or state[COUNT] >= samples:
        state[4], state[5], state[6], state[7] = w, x, y, z
        state[COUNT] = 1.0 if coefficients == PREVIOUS else 0.0


@njit(cache=True)
def rotvec_advance(state, dt, theta, dtheta, history, a, b):
    for k in range(theta.shape[0]):
        rotvec_step(
            state,
            dt[k],
            theta[k, 0],
            theta[k, 1],
            theta[k, 2],
            dtheta[k, 0],
            dtheta[k, 1],
            dtheta[k, 2],
            a,
            b,
        )
        history[k, 0], history[k, 1], history[k, 2], history[k, 3] = (
            state[0],
            state[1],
            state[2],
            state[3],
        )


@njit(cache=True)
def rotvec_update(record, time, rate):
    dt, tx, ty, tz, dx, dy, dz = take_sample(record, time, rate)
    if dt > 0.0:
        rotvec_step(record[HEAD:], dt, tx, ty, tz, dx, dy, dz, record[OPTIONS], record[OPTIONS + 1])
    return dt
