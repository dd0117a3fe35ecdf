"""Alexiev's attitude algorithms and Runge-Kutta's: one step each, and its two loops.

For every algorithm there is ``*_step`` (the formula), ``*_advance`` (over many steps,
writing the state after each into `history`) and ``*_update`` (one sample; returns the
length of the step as `increments.take_sample` does). Both loops run the same formula on
the same numbers, so a run that is cut anywhere and continued ends on the same bits.

All have the same arguments: the state, the length of the step in s, theta and dtheta of the
three axes in rad, and two options as numbers, whether they use them or not. So whatever
calls them (a count of operations, single precision, an export) needs to know one form.
"""

from __future__ import annotations

import math

from strapdown._kernels.compilation import njit
from strapdown._kernels.increments import HEAD, OPTIONS, take_sample
from strapdown._kernels.rotation import (
    dcm_coefficients_truncated,
    dcm_from_coefficients,
    dcm_from_rotvec,
    half_angle_truncated,
    quat_from_rotvec,
    quat_multiply,
    quat_normalise,
    wrap_pi,
)

# Smallest |cos(pitch)| by which Alexiev (8) and (10) divide. It keeps the angles finite on
# the pole itself, where no value is right; the state records how near a run came.
COS_FLOOR = 1e-12


# --- naive (2): state (roll, pitch, heading), unwrapped ---------------------------------


@njit(cache=True)
def naive_step(state, dt, tx, ty, tz, dx, dy, dz, a, b):
    state[0] += tx
    state[1] += ty
    state[2] += tz


@njit(cache=True)
def naive_advance(state, dt, theta, dtheta, history, a, b):
    for k in range(theta.shape[0]):
        naive_step(
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
        history[k, 0], history[k, 1], history[k, 2] = state[0], state[1], state[2]


@njit(cache=True)
def naive_update(record, time, rate):
    dt, tx, ty, tz, dx, dy, dz = take_sample(record, time, rate)
    if dt > 0.0:
        naive_step(record[HEAD:], dt, tx, ty, tz, dx, dy, dz, record[OPTIONS], record[OPTIONS + 1])
    return dt


# --- Euler-Krylov (8)-(10): state (roll, pitch, heading, least |cos pitch|, its step, steps)


@njit(cache=True)
def euler_rates(roll, pitch, x, y, z):
    """Alexiev (8)-(10) for the body rate (x, y, z); also cos(pitch) before its floor."""
    cos_pitch = math.cos(pitch)
    safe = cos_pitch
    if abs(safe) < COS_FLOOR:
        safe = math.copysign(COS_FLOOR, cos_pitch)
    sin_roll, cos_roll = math.sin(roll), math.cos(roll)
    about_z = (sin_roll * y + cos_roll * z) / safe
    return x + math.sin(pitch) * about_z, cos_roll * y - sin_roll * z, about_z, cos_pitch


@njit(cache=True)
def euler_note(state, cos_pitch):
    if abs(cos_pitch) < state[3]:
        state[3] = abs(cos_pitch)
        state[4] = state[5]


@njit(cache=True)
def euler_finish(state, roll, pitch, heading):
    before = math.cos(state[1])
    state[0] = wrap_pi(state[0] + roll)
    state[1] += pitch
    state[2] = wrap_pi(state[2] + heading)
    state[5] += 1.0
    after = math.cos(state[1])
    # A step from one side of the pole to the other went through it.
    euler_note(state, 0.0 if before * after < 0.0 else after)


@njit(cache=True)
def euler_forward_step(state, tx, ty, tz):
    r, p, h, cos_pitch = euler_rates(state[0], state[1], tx, ty, tz)
    euler_note(state, cos_pitch)
    euler_finish(state, r, p, h)


@njit(cache=True)
def euler_rk4_step(state, tx, ty, tz, dx, dy, dz):
    roll, pitch = state[0], state[1]
    ax, ay, az = tx - 0.5 * dx, ty - 0.5 * dy, tz - 0.5 * dz
    bx, by, bz = tx + 0.5 * dx, ty + 0.5 * dy, tz + 0.5 * dz
    r1, p1, h1, c1 = euler_rates(roll, pitch, ax, ay, az)
    r2, p2, h2, c2 = euler_rates(roll + 0.5 * r1, pitch + 0.5 * p1, tx, ty, tz)
    r3, p3, h3, c3 = euler_rates(roll + 0.5 * r2, pitch + 0.5 * p2, tx, ty, tz)
    r4, p4, h4, c4 = euler_rates(roll + r3, pitch + p3, bx, by, bz)
    for c in (c1, c2, c3, c4):
        euler_note(state, c)
    euler_finish(
        state,
        (r1 + 2.0 * (r2 + r3) + r4) / 6.0,
        (p1 + 2.0 * (p2 + p3) + p4) / 6.0,
        (h1 + 2.0 * (h2 + h3) + h4) / 6.0,
    )


@njit(cache=True)
def euler_step(state, dt, tx, ty, tz, dx, dy, dz, rk4, b):
    if rk4 != 0.0:
        euler_rk4_step(state, tx, ty, tz, dx, dy, dz)
    else:
        euler_forward_step(state, tx, ty, tz)


@njit(cache=True)
def euler_advance(state, dt, theta, dtheta, history, a, b):
    for k in range(theta.shape[0]):
        euler_step(
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
        history[k, 0], history[k, 1], history[k, 2] = state[0], state[1], state[2]


@njit(cache=True)
def euler_update(record, time, rate):
    dt, tx, ty, tz, dx, dy, dz = take_sample(record, time, rate)
    if dt > 0.0:
        euler_step(record[HEAD:], dt, tx, ty, tz, dx, dy, dz, record[OPTIONS], record[OPTIONS + 1])
    return dt


# --- direction cosines (11)-(13): state (C row by row, steps since re-orthogonalisation) --


@njit(cache=True)
def dcm_increment(x, y, z, order):
    """The exponential (12) of an increment; order 0 is the closed form."""
    if order == 0.0:
        return dcm_from_rotvec(x, y, z)
    a, b = dcm_coefficients_truncated(x * x + y * y + z * z, int(order))
    return dcm_from_coefficients(x, y, z, a, b)


@njit(cache=True)
def dcm_step(state, dt, tx, ty, tz, dx, dy, dz, order, orthogonalise_every):
    m = dcm_increment(tx, ty, tz, order)
    for i in range(0, 9, 3):
        p, q, r = state[i], state[i + 1], state[i + 2]
        state[i] = p * m[0] + q * m[3] + r * m[6]
        state[i + 1] = p * m[1] + q * m[4] + r * m[7]
        state[i + 2] = p * m[2] + q * m[5] + r * m[8]
    if orthogonalise_every > 0.0:
        state[9] += 1.0
        if state[9] >= orthogonalise_every:
            state[9] = 0.0
            orthogonalise(state)


@njit(cache=True)
def orthogonalise(state):
    """One Newton step towards the nearest rotation: C <- C (3 I - C^T C) / 2.

    Quadratic: it squares the loss of orthogonality, and turns the matrix by nothing in
    first order, unlike Gram-Schmidt, which favours one axis.
    """
    a, b, c, d, e, f, g, h, i = (
        state[0],
        state[1],
        state[2],
        state[3],
        state[4],
        state[5],
        state[6],
        state[7],
        state[8],
    )
    xx = 1.5 - 0.5 * (a * a + d * d + g * g)
    yy = 1.5 - 0.5 * (b * b + e * e + h * h)
    zz = 1.5 - 0.5 * (c * c + f * f + i * i)
    xy = -0.5 * (a * b + d * e + g * h)
    xz = -0.5 * (a * c + d * f + g * i)
    yz = -0.5 * (b * c + e * f + h * i)
    for k in range(0, 9, 3):
        p, q, r = state[k], state[k + 1], state[k + 2]
        state[k] = p * xx + q * xy + r * xz
        state[k + 1] = p * xy + q * yy + r * yz
        state[k + 2] = p * xz + q * yz + r * zz


@njit(cache=True)
def dcm_advance(state, dt, theta, dtheta, history, a, b):
    for k in range(theta.shape[0]):
        dcm_step(
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
        for j in range(9):
            history[k, j] = state[j]


@njit(cache=True)
def dcm_update(record, time, rate):
    dt, tx, ty, tz, dx, dy, dz = take_sample(record, time, rate)
    if dt > 0.0:
        dcm_step(record[HEAD:], dt, tx, ty, tz, dx, dy, dz, record[OPTIONS], record[OPTIONS + 1])
    return dt


# --- quaternion (20)-(22): state (w, x, y, z) -------------------------------------------


@njit(cache=True)
def quaternion_increment(x, y, z, order):
    """A (x) sigma_q of Alexiev (20); order 0 is the limit of the series."""
    if order == 0.0:
        return quat_from_rotvec(x, y, z)
    c, s = half_angle_truncated(0.25 * (x * x + y * y + z * z), int(order))
    return c, s * x, s * y, s * z


@njit(cache=True)
def quaternion_turned(w, x, y, z, tx, ty, tz, order, normalise):
    dw, dx, dy, dz = quaternion_increment(tx, ty, tz, order)
    w, x, y, z = quat_multiply(w, x, y, z, dw, dx, dy, dz)
    if normalise != 0.0:
        return quat_normalise(w, x, y, z)
    return w, x, y, z


@njit(cache=True)
def quaternion_step(state, dt, tx, ty, tz, dx, dy, dz, order, normalise):
    state[0], state[1], state[2], state[3] = quaternion_turned(
        state[0], state[1], state[2], state[3], tx, ty, tz, order, normalise
    )


@njit(cache=True)
def quaternion_advance(state, dt, theta, dtheta, history, a, b):
    # Not by `quaternion_step`: kept in registers it is half as fast again.
    w, x, y, z = state[0], state[1], state[2], state[3]
    for k in range(theta.shape[0]):
        w, x, y, z = quaternion_turned(w, x, y, z, theta[k, 0], theta[k, 1], theta[k, 2], a, b)
        history[k, 0], history[k, 1], history[k, 2], history[k, 3] = w, x, y, z
    state[0], state[1], state[2], state[3] = w, x, y, z


@njit(cache=True)
def quaternion_update(record, time, rate):
    dt, tx, ty, tz, dx, dy, dz = take_sample(record, time, rate)
    if dt > 0.0:
        quaternion_step(
            record[HEAD:], dt, tx, ty, tz, dx, dy, dz, record[OPTIONS], record[OPTIONS + 1]
        )
    return dt


# --- the kinematic equation of the quaternion by Runge-Kutta: state (w, x, y, z) ---------


@njit(cache=True)
def quaternion_slope(w, x, y, z, rx, ry, rz):
    """Half q times the rate times the step: dq/dt = q (0, rate) / 2, times dt."""
    return (
        -0.5 * (x * rx + y * ry + z * rz),
        0.5 * (w * rx + y * rz - z * ry),
        0.5 * (w * ry + z * rx - x * rz),
        0.5 * (w * rz + x * ry - y * rx),
    )


@njit(cache=True)
def rk4_step(state, dt, tx, ty, tz, dx, dy, dz, normalise, b):
    w, x, y, z = state[0], state[1], state[2], state[3]
    # The rate as linear over the step, with its integral and its change as given.
    ax, ay, az = tx - 0.5 * dx, ty - 0.5 * dy, tz - 0.5 * dz
    bx, by, bz = tx + 0.5 * dx, ty + 0.5 * dy, tz + 0.5 * dz
    w1, x1, y1, z1 = quaternion_slope(w, x, y, z, ax, ay, az)
    w2, x2, y2, z2 = quaternion_slope(
        w + 0.5 * w1, x + 0.5 * x1, y + 0.5 * y1, z + 0.5 * z1, tx, ty, tz
    )
    w3, x3, y3, z3 = quaternion_slope(
        w + 0.5 * w2, x + 0.5 * x2, y + 0.5 * y2, z + 0.5 * z2, tx, ty, tz
    )
    w4, x4, y4, z4 = quaternion_slope(w + w3, x + x3, y + y3, z + z3, bx, by, bz)
    sixth = 1.0 / 6.0
    w += sixth * (w1 + 2.0 * (w2 + w3) + w4)
    x += sixth * (x1 + 2.0 * (x2 + x3) + x4)
    y += sixth * (y1 + 2.0 * (y2 + y3) + y4)
    z += sixth * (z1 + 2.0 * (z2 + z3) + z4)
    if normalise != 0.0:
        w, x, y, z = quat_normalise(w, x, y, z)
    state[0], state[1], state[2], state[3] = w, x, y, z


@njit(cache=True)
def rk4_advance(state, dt, theta, dtheta, history, a, b):
    for k in range(theta.shape[0]):
        rk4_step(
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
def rk4_update(record, time, rate):
    dt, tx, ty, tz, dx, dy, dz = take_sample(record, time, rate)
    if dt > 0.0:
        rk4_step(record[HEAD:], dt, tx, ty, tz, dx, dy, dz, record[OPTIONS], record[OPTIONS + 1])
    return dt
