"""Motion increments of one step: its turn, and the velocity and distance that force gave over it.

With C from the body at an instant to the body at the start of the step, ``u = int C f dt`` and
``s = int u dt``, the matrix X = [[C, u, s], [0, 1, t], [0, 0, 1]] obeys X' = X A(t) with
A = [[w x, f, 0], [0, 0, 1], [0, 0, 0]]. So turn, velocity and distance are one product of
exponentials, and coning, sculling and scrolling are one commutator. An element of the algebra
is (w, a, p, tau) = [[w x, a, p], [0, 0, tau], [0, 0, 0]], and

    [1, 2] = (w1 x w2, w1 x a2 - w2 x a1, w1 x p2 - w2 x p1 + a1 tau2 - a2 tau1, 0).

X is the exponential of the Magnus series of A (Blanes, Casas and Ros, BIT 40 (2000) 434) with
the factors of every commutator exchanged, because A multiplies from the right. Its exponential
is closed: phi = w, dv = V1 a, dr = V1 p + tau V2 a with V1 = int_0^1 exp(l w x) dl and
V2 = int_0^1 int_0^l exp(m w x) dm dl.
"""

from __future__ import annotations

import math

from strapdown._kernels.compilation import njit
from strapdown._kernels.increments import neighbour
from strapdown._kernels.ned import turn_back
from strapdown._kernels.rotation import (
    dcm_from_quat,
    quat_from_rotvec,
    quat_multiply,
    quat_normalise,
    rotvec_from_quat,
)
from strapdown._kernels.rotation_vector import ALIKE, GAUSS_FIRST, GAUSS_LAST, ROOT_15_THIRD, cross

# Below this square of the angle (0.25 rad) the integrals of sin and cos are series, whose first
# neglected terms are under 1e-17 of the value. Above, they follow from the half angle, and what
# is lost by cancellation in them is of the size of a rounding of V1 and V2.
SERIES_LIMIT = 0.0625


@njit(cache=True, error_model="numpy", inline="always")
def integral_coefficients(u):
    """Coefficients b, c, d of V1 = 1 + b [w x] + c [w x]^2, V2 = 1/2 + c [w x] + d [w x]^2.

    Of u = |w|^2 = n^2: b = (1 - cos n)/n^2, c = (n - sin n)/n^3, d = (n^2/2 - 1 + cos n)/n^4.
    """
    if u < SERIES_LIMIT:
        # Summed in pairs: a chain of five would take longer than the rest of a step.
        v = u * u
        d = (1.0 / 24.0 - u * (1.0 / 720.0)) + v * (
            (1.0 / 40320.0 - u * (1.0 / 3628800.0)) + v * (1.0 / 479001600.0)
        )
        e = (1.0 / 120.0 - u * (1.0 / 5040.0)) + v * (
            (1.0 / 362880.0 - u * (1.0 / 39916800.0)) + v * (1.0 / 6227020800.0)
        )
        return 0.5 - u * d, 1.0 / 6.0 - u * e, d
    # By the half angle, so that b itself does not cancel. Without a second series inside, which
    # would slow the loop that never comes here.
    n = math.sqrt(u)
    k, s = math.cos(0.5 * n), math.sin(0.5 * n) / n
    b = 2.0 * s * s
    return b, (1.0 - 2.0 * k * s) / u, (0.5 - b) / u


@njit(cache=True, error_model="numpy", inline="always")
def motion_exponential(wx, wy, wz, ax, ay, az, px, py, pz, tau):
    """Velocity and distance dv, dr of the exponential of (w, a, p, tau); its turn is w."""
    b, c, d = integral_coefficients(wx * wx + wy * wy + wz * wz)
    kx, ky, kz = cross(wx, wy, wz, ax, ay, az)
    lx, ly, lz = cross(wx, wy, wz, kx, ky, kz)
    mx, my, mz = cross(wx, wy, wz, px, py, pz)
    nx, ny, nz = cross(wx, wy, wz, mx, my, mz)
    half = 0.5 * tau
    e, f = tau * c, tau * d
    return (
        ax + (b * kx + c * lx),
        ay + (b * ky + c * ly),
        az + (b * kz + c * lz),
        (px + b * mx + c * nx) + (half * ax + (e * kx + f * lx)),
        (py + b * my + c * ny) + (half * ay + (e * ky + f * ly)),
        (pz + b * mz + c * nz) + (half * az + (e * kz + f * lz)),
    )


@njit(cache=True, error_model="numpy", inline="always")
def line_motion(
    dt, k, wx, wy, wz, fx, fy, fz, w0x, w0y, w0z, w1x, w1y, w1z, f0x, f0y, f0z, f1x, f1y, f1z
):
    """Phi, dv, dr of a step over which rate and force run along lines; fourth order.

    w and f are their integrals over the step, and w0, w1, f0, f1 two values each. With W and F
    the changes of rate and force over the step, times its length, the Magnus series is
    (w, f, 0, dt) + 1/12 [(w, f, 0, dt), (W, F, 0, 0)], and k is such that W x w = 12 k w1 x w0,
    F dt = 12 k (f1 - f0) and so on.
    """
    x, y, z = cross(w0x, w0y, w0z, w1x, w1y, w1z)
    px, py, pz = wx + k * x, wy + k * y, wz + k * z
    ax, ay, az = cross(w0x, w0y, w0z, f1x, f1y, f1z)
    bx, by, bz = cross(f0x, f0y, f0z, w1x, w1y, w1z)
    vx, vy, vz, rx, ry, rz = motion_exponential(
        px,
        py,
        pz,
        fx + k * (ax + bx),
        fy + k * (ay + by),
        fz + k * (az + bz),
        k * (f0x - f1x),
        k * (f0y - f1y),
        k * (f0z - f1z),
        dt,
    )
    return px, py, pz, vx, vy, vz, rx, ry, rz


@njit(cache=True, error_model="numpy", inline="always")
def linear_motion(dt, w0x, w0y, w0z, w1x, w1y, w1z, f0x, f0y, f0z, f1x, f1y, f1z):
    """Phi, dv, dr of the step between two samples of rate w and force f, joined by lines."""
    h = 0.5 * dt
    return line_motion(
        dt,
        dt * dt * (1.0 / 12.0),
        h * (w0x + w1x),
        h * (w0y + w1y),
        h * (w0z + w1z),
        h * (f0x + f1x),
        h * (f0y + f1y),
        h * (f0z + f1z),
        w0x,
        w0y,
        w0z,
        w1x,
        w1y,
        w1z,
        f0x,
        f0y,
        f0z,
        f1x,
        f1y,
        f1z,
    )


@njit(cache=True, error_model="numpy", inline="always")
def mean_motion(dt, before, w0x, w0y, w0z, w1x, w1y, w1z, f0x, f0y, f0z, f1x, f1y, f1z):
    """Phi, dv, dr of a step with means w1 and f1, after one of length `before` with w0, f0.

    Rate and force run along the lines whose integrals over the two steps are the measured ones.
    After a step of very different or zero length they are taken as constant.
    """
    k = 0.0
    if before <= ALIKE * dt and dt <= ALIKE * before:
        k = dt * dt * dt / (6.0 * (dt + before))
    return line_motion(
        dt,
        k,
        dt * w1x,
        dt * w1y,
        dt * w1z,
        dt * f1x,
        dt * f1y,
        dt * f1z,
        w0x,
        w0y,
        w0z,
        w1x,
        w1y,
        w1z,
        f0x,
        f0y,
        f0z,
        f1x,
        f1y,
        f1z,
    )


@njit(cache=True, error_model="numpy", inline="always")
def put_motion(out, k, dt, motion):
    """Store a row: dt, phi, dv, dr."""
    px, py, pz, vx, vy, vz, rx, ry, rz = motion
    out[k, 0] = dt
    out[k, 1], out[k, 2], out[k, 3] = px, py, pz
    out[k, 4], out[k, 5], out[k, 6] = vx, vy, vz
    out[k, 7], out[k, 8], out[k, 9] = rx, ry, rz


@njit(cache=True, error_model="numpy")
def motion_increments_linear(dt, samples, mean, out):
    """Fill out, (n-1, 10): dt, phi, dv, dr of the steps between n samples of rate and force.

    The interval of the first mean ends where the first step begins; its length is not known,
    and taken for that of the first step.
    """
    before = dt[0] if dt.shape[0] > 0 else 0.0
    for k in range(dt.shape[0]):
        h = dt[k]
        w0x, w0y, w0z = samples[k, 0], samples[k, 1], samples[k, 2]
        f0x, f0y, f0z = samples[k, 3], samples[k, 4], samples[k, 5]
        w1x, w1y, w1z = samples[k + 1, 0], samples[k + 1, 1], samples[k + 1, 2]
        f1x, f1y, f1z = samples[k + 1, 3], samples[k + 1, 4], samples[k + 1, 5]
        if mean:
            motion = mean_motion(
                h, before, w0x, w0y, w0z, w1x, w1y, w1z, f0x, f0y, f0z, f1x, f1y, f1z
            )
        else:
            motion = linear_motion(h, w0x, w0y, w0z, w1x, w1y, w1z, f0x, f0y, f0z, f1x, f1y, f1z)
        put_motion(out, k, h, motion)
        before = h


@njit(cache=True)
def largest_turn(rows):
    """Row and axis of the largest component of phi."""
    row, axis, largest = 0, 0, -1.0
    for k in range(rows.shape[0]):
        for j in range(3):
            if abs(rows[k, 1 + j]) > largest:
                row, axis, largest = k, j, abs(rows[k, 1 + j])
    return row, axis


# Polynomials through several samples, to sixth order.
#
# Over a window of 1 to 4 steps rate and force are one polynomial: through the samples at the
# stamps, or, for means, with their integrals over the steps. The increments of each step are its
# flow, by the Magnus series to sixth order (Blanes, Casas and Ros, BIT 40 (2000) 434, Eqs. (3.9),
# (3.11)) in the algebra above.


# The scratch array: Newton's coefficients of up to five samples of six numbers, and the nodes.
NODES, ROWS, WIDEST = 5, 6, 6


@njit(cache=True, error_model="numpy")
def bracket(
    w1x, w1y, w1z, a1x, a1y, a1z, p1x, p1y, p1z, t1, w2x, w2y, w2z, a2x, a2y, a2z, p2x, p2y, p2z, t2
):
    """The commutator [1, 2]; its tau is zero."""
    wx, wy, wz = cross(w1x, w1y, w1z, w2x, w2y, w2z)
    ax, ay, az = cross(w1x, w1y, w1z, a2x, a2y, a2z)
    bx, by, bz = cross(w2x, w2y, w2z, a1x, a1y, a1z)
    px, py, pz = cross(w1x, w1y, w1z, p2x, p2y, p2z)
    qx, qy, qz = cross(w2x, w2y, w2z, p1x, p1y, p1z)
    return (
        wx,
        wy,
        wz,
        ax - bx,
        ay - by,
        az - bz,
        px - qx + a1x * t2 - a2x * t1,
        py - qy + a1y * t2 - a2y * t1,
        pz - qz + a1z * t2 - a2z * t1,
    )


@njit(cache=True, error_model="numpy")
def sixth_order_motion(dt, low, mid, high):
    """Phi, dv, dr of a step from rate and force, six numbers each, at its points of Gauss."""
    o = 0.0
    ax, ay, az, au, av, aw = mid
    ax, ay, az, au, av, aw = dt * ax, dt * ay, dt * az, dt * au, dt * av, dt * aw
    m = ROOT_15_THIRD * dt
    bx, by, bz = m * (high[0] - low[0]), m * (high[1] - low[1]), m * (high[2] - low[2])
    bu, bv, bw = m * (high[3] - low[3]), m * (high[4] - low[4]), m * (high[5] - low[5])
    m = 10.0 / 3.0 * dt
    cx = m * (high[0] - 2.0 * mid[0] + low[0])
    cy = m * (high[1] - 2.0 * mid[1] + low[1])
    cz = m * (high[2] - 2.0 * mid[2] + low[2])
    cu = m * (high[3] - 2.0 * mid[3] + low[3])
    cv = m * (high[4] - 2.0 * mid[4] + low[4])
    cw = m * (high[5] - 2.0 * mid[5] + low[5])
    # The factors of every commutator are exchanged, because A multiplies from the right.
    dx, dy, dz, du, dv, dw, dr, ds, dq = bracket(
        bx, by, bz, bu, bv, bw, o, o, o, o, ax, ay, az, au, av, aw, o, o, o, dt
    )
    ex, ey, ez, eu, ev, ew, er, es, eq = bracket(
        2.0 * cx + dx,
        2.0 * cy + dy,
        2.0 * cz + dz,
        2.0 * cu + du,
        2.0 * cv + dv,
        2.0 * cw + dw,
        dr,
        ds,
        dq,
        o,
        ax,
        ay,
        az,
        au,
        av,
        aw,
        o,
        o,
        o,
        dt,
    )
    m = -1.0 / 60.0
    gx, gy, gz, gu, gv, gw, gr, gs, gq = bracket(
        bx + m * ex,
        by + m * ey,
        bz + m * ez,
        bu + m * eu,
        bv + m * ev,
        bw + m * ew,
        m * er,
        m * es,
        m * eq,
        o,
        dx - 20.0 * ax - cx,
        dy - 20.0 * ay - cy,
        dz - 20.0 * az - cz,
        du - 20.0 * au - cu,
        dv - 20.0 * av - cv,
        dw - 20.0 * aw - cw,
        dr,
        ds,
        dq,
        -20.0 * dt,
    )
    k, m = 1.0 / 12.0, 1.0 / 240.0
    wx, wy, wz = ax + k * cx + m * gx, ay + k * cy + m * gy, az + k * cz + m * gz
    vx, vy, vz, rx, ry, rz = motion_exponential(
        wx,
        wy,
        wz,
        au + k * cu + m * gu,
        av + k * cv + m * gv,
        aw + k * cw + m * gw,
        m * gr,
        m * gs,
        m * gq,
        dt,
    )
    return wx, wy, wz, vx, vy, vz, rx, ry, rz


@njit(cache=True, error_model="numpy")
def fit_window(dt, samples, mean, first, count, scratch):
    """Newton's polynomial of rate and force over the steps of a window.

    Its nodes are the stamps, in units of the window's length. Means are the first divided
    differences of their running sums, so that theirs begin one higher. Coefficient k of the
    six numbers is in row k of the scratch array.
    """
    length = 0.0
    for i in range(count):
        length += dt[first + i]
    at = 0.0
    for i in range(count):
        scratch[NODES, i] = at / length
        at += dt[first + i]
    scratch[NODES, count] = 1.0
    values, higher, start = count + 1, 0, first
    if mean:
        values, higher, start = count, 1, first + 1
    for i in range(values):
        for j in range(6):
            scratch[i, j] = samples[start + i, j]
    for k in range(1, values):
        for i in range(values - 1, k - 1, -1):
            m = 1.0 / (scratch[NODES, i + higher] - scratch[NODES, i - k])
            for j in range(6):
                scratch[i, j] = (scratch[i, j] - scratch[i - 1, j]) * m
    return values


@njit(cache=True, error_model="numpy")
def fitted_values(t, mean, values, scratch):
    """Rate and force at t of the window's length."""
    # Newton's products of distances to the nodes, and their derivatives.
    product, slope = 1.0, 0.0
    wx, wy, wz, fx, fy, fz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(values):
        d = t - scratch[NODES, k]
        slope = slope * d + product
        k_basis = product
        if mean:
            k_basis = slope
        product *= d
        wx += k_basis * scratch[k, 0]
        wy += k_basis * scratch[k, 1]
        wz += k_basis * scratch[k, 2]
        fx += k_basis * scratch[k, 3]
        fy += k_basis * scratch[k, 4]
        fz += k_basis * scratch[k, 5]
    return wx, wy, wz, fx, fy, fz


@njit(cache=True, error_model="numpy")
def window_motion(dt, mean, step, values, scratch):
    """Phi, dv, dr of one step of a window, counted from its first."""
    left = scratch[NODES, step]
    length = scratch[NODES, step + 1] - left
    return sixth_order_motion(
        dt,
        fitted_values(left + length * GAUSS_FIRST, mean, values, scratch),
        fitted_values(left + length * 0.5, mean, values, scratch),
        fitted_values(left + length * GAUSS_LAST, mean, values, scratch),
    )


@njit(cache=True, error_model="numpy")
def alike(a, b):
    return a <= ALIKE * b and b <= ALIKE * a


@njit(cache=True, error_model="numpy")
def block_length(dt, start, samples):
    """Steps of the block that starts here: up to `samples` that are like its first."""
    count = 1
    while count < samples and start + count < dt.shape[0] and alike(dt[start + count], dt[start]):
        count += 1
    return count


@njit(cache=True, error_model="numpy")
def motion_increments_blocks(dt, samples, mean, size, scratch, out):
    """Fill out, (n-1, 10), each step with the polynomial of its block.

    A block that a gap or the end of the log cuts short borrows steps before it, if they are
    like its own.
    """
    start = 0
    while start < dt.shape[0]:
        count = block_length(dt, start, size)
        first = start
        while first > 0 and start + count - first < size and alike(dt[first - 1], dt[start]):
            first -= 1
        values = fit_window(dt, samples, mean, first, start + count - first, scratch)
        for k in range(start, start + count):
            motion = window_motion(dt[k], mean, k - first, values, scratch)
            put_motion(out, k, dt[k], motion)
        start += count


@njit(cache=True, error_model="numpy")
def motion_increments_neighbours(dt, samples, mean, scratch, out):
    """Fill out, (n-1, 10), each step with the polynomial that its two neighbours share."""
    for k in range(dt.shape[0]):
        first, count = k, 1
        if k > 0 and neighbour(dt[k], dt[k - 1]) > 0.0:
            first, count = k - 1, 2
        if k + 1 < dt.shape[0] and neighbour(dt[k], dt[k + 1]) > 0.0:
            count += 1
        values = fit_window(dt, samples, mean, first, count, scratch)
        put_motion(out, k, dt[k], window_motion(dt[k], mean, k - first, values, scratch))


@njit(cache=True, error_model="numpy")
def join_blocks(dt, samples, rows, last, out):
    """Put the rows of each block together into one row of out; return the number of blocks.

    ``last`` becomes the number of the last step of each block. Of two motions one after the
    other C = C1 C2, dv = dv1 + C1 dv2, dr = dr1 + dv1 t2 + C1 dr2.
    """
    start, block = 0, 0
    while start < dt.shape[0]:
        count = block_length(dt, start, samples)
        w, x, y, z = 1.0, 0.0, 0.0, 0.0
        t, vx, vy, vz, rx, ry, rz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(start, start + count):
            c = dcm_from_quat(w, x, y, z)
            h, dx, dy, dz = rows[k, 0], rows[k, 7], rows[k, 8], rows[k, 9]
            rx += vx * h + c[0] * dx + c[1] * dy + c[2] * dz
            ry += vy * h + c[3] * dx + c[4] * dy + c[5] * dz
            rz += vz * h + c[6] * dx + c[7] * dy + c[8] * dz
            dx, dy, dz = rows[k, 4], rows[k, 5], rows[k, 6]
            vx += c[0] * dx + c[1] * dy + c[2] * dz
            vy += c[3] * dx + c[4] * dy + c[5] * dz
            vz += c[6] * dx + c[7] * dy + c[8] * dz
            a, b, d, e = quat_from_rotvec(rows[k, 1], rows[k, 2], rows[k, 3])
            w, x, y, z = quat_multiply(w, x, y, z, a, b, d, e)
            w, x, y, z = quat_normalise(w, x, y, z)
            t += h
        px, py, pz = rotvec_from_quat(w, x, y, z)
        put_motion(out, block, t, (px, py, pz, vx, vy, vz, rx, ry, rz))
        last[block] = start + count - 1
        start += count
        block += 1
    return block


@njit(cache=True, error_model="numpy")
def split_increment(row, part, first, second):
    """Fill the increments before and after ``part`` seconds of a step; combined they equal it."""
    whole = row[0]
    share = part / whole
    rest = whole - part
    first[0], second[0] = part, rest
    for j in range(3):
        u, s = row[4 + j], row[7 + j]
        first[1 + j] = share * row[1 + j]
        second[1 + j] = row[1 + j] - first[1 + j]
        a = (6.0 * s / whole - 2.0 * u) / whole
        b = (6.0 * u - 12.0 * s / whole) / (whole * whole)
        first[4 + j] = part * (a + 0.5 * b * part)
        first[7 + j] = part * part * (0.5 * a + b * part / 6.0)
    w, x, y, z = quat_from_rotvec(first[1], first[2], first[3])
    second[4], second[5], second[6] = turn_back(
        w, x, y, z, row[4] - first[4], row[5] - first[5], row[6] - first[6]
    )
    second[7], second[8], second[9] = turn_back(
        w,
        x,
        y,
        z,
        row[7] - first[7] - first[4] * rest,
        row[8] - first[8] - first[5] * rest,
        row[9] - first[9] - first[6] * rest,
    )
