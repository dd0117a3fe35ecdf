"""Motion increments of polynomials through several samples, to sixth order.

Over a window of 1 to 4 steps rate and force are one polynomial: through the samples at the
stamps, or, of means, with their integrals over the steps. A step within the window is its flow
alone, by the Magnus series to sixth order (Blanes, Casas and Ros, BIT 40 (2000) 434,
Eqs. (3.9), (3.11)) in the algebra of `motion_increments`.
"""

from __future__ import annotations

from numba import njit

from strapdown._kernels.increments import neighbour
from strapdown._kernels.motion_increments import motion_exponential, put_motion
from strapdown._kernels.rotation import (
    dcm_from_quat,
    quat_from_rotvec,
    quat_multiply,
    quat_normalise,
    rotvec_from_quat,
)
from strapdown._kernels.rotation_vector import (
    ALIKE,
    GAUSS_FIRST,
    GAUSS_LAST,
    ROOT_15_THIRD,
    cross,
)

# Nodes of the longest window; rows of the scratch array, of which the first three hold the
# weights of the samples at the three points of Gauss, and the others nodes and denominators.
WIDEST = 5
NODES, DENOMINATORS, ROWS = 3, 4, 5


@njit(cache=True)
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


@njit(cache=True)
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
    # The factors of every commutator stand exchanged, because A multiplies from the right.
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


@njit(cache=True)
def place_nodes(dt, first, count, scratch):
    """Nodes between the steps of a window in units of its length, and Lagrange's denominators."""
    length = 0.0
    for i in range(count):
        length += dt[first + i]
    at = 0.0
    for i in range(count + 1):
        scratch[NODES, i] = at / length
        if i < count:
            at += dt[first + i]
    for j in range(count + 1):
        product = 1.0
        for i in range(count + 1):
            if i != j:
                product *= scratch[NODES, j] - scratch[NODES, i]
        scratch[DENOMINATORS, j] = 1.0 / product


@njit(cache=True)
def weigh_samples(count, t, scratch, row):
    """Weights of the count + 1 samples in their polynomial at t."""
    for j in range(count + 1):
        product = scratch[DENOMINATORS, j]
        for i in range(count + 1):
            if i != j:
                product *= t - scratch[NODES, i]
        scratch[row, j] = product


@njit(cache=True)
def weigh_means(count, t, scratch, row):
    """Weights at t of the means over count steps, in the polynomial with these integrals.

    It is the derivative of the polynomial through the running sums of the increments, in which
    an increment counts at every node after it.
    """
    total = 0.0
    for j in range(count, 0, -1):
        slope = 0.0
        for i in range(count + 1):
            if i == j:
                continue
            product = scratch[DENOMINATORS, j]
            for m in range(count + 1):
                if m not in (i, j):
                    product *= t - scratch[NODES, m]
            slope += product
        total += slope
        scratch[row, j - 1] = total * (scratch[NODES, j] - scratch[NODES, j - 1])


@njit(cache=True)
def weighted(rate, force, start, count, scratch, row):
    """Rate and force as the weights of a row of the scratch array say."""
    wx, wy, wz, fx, fy, fz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(count):
        k = scratch[row, j]
        wx += k * rate[start + j, 0]
        wy += k * rate[start + j, 1]
        wz += k * rate[start + j, 2]
        fx += k * force[start + j, 0]
        fy += k * force[start + j, 1]
        fz += k * force[start + j, 2]
    return wx, wy, wz, fx, fy, fz


@njit(cache=True)
def window_motion(dt, rate, force, mean, step, first, count, scratch):
    """Phi, dv, dr of one step of a window whose nodes are placed."""
    left = scratch[NODES, step - first]
    length = scratch[NODES, step - first + 1] - left
    start, values = first, count + 1
    if mean:
        start, values = first + 1, count
    for row in range(3):
        t = left + length * (0.5, GAUSS_FIRST, GAUSS_LAST)[row]
        if mean:
            weigh_means(count, t, scratch, row)
        else:
            weigh_samples(count, t, scratch, row)
    return sixth_order_motion(
        dt[step],
        weighted(rate, force, start, values, scratch, 1),
        weighted(rate, force, start, values, scratch, 0),
        weighted(rate, force, start, values, scratch, 2),
    )


@njit(cache=True)
def alike(a, b):
    return a <= ALIKE * b and b <= ALIKE * a


@njit(cache=True)
def block_length(dt, start, samples):
    """Steps of the block that starts here: up to `samples` that are like its first."""
    count = 1
    while count < samples and start + count < dt.shape[0] and alike(dt[start + count], dt[start]):
        count += 1
    return count


@njit(cache=True)
def motion_increments_blocks(dt, rate, force, mean, samples, scratch, out):
    """Fill out, (n-1, 10), each step with the polynomial of its block.

    A block that a gap or the end of the log cuts short borrows steps before it, if they are
    like its own.
    """
    start = 0
    while start < dt.shape[0]:
        count = block_length(dt, start, samples)
        first = start
        while first > 0 and start + count - first < samples and alike(dt[first - 1], dt[start]):
            first -= 1
        place_nodes(dt, first, start + count - first, scratch)
        for k in range(start, start + count):
            motion = window_motion(dt, rate, force, mean, k, first, start + count - first, scratch)
            put_motion(out, k, dt[k], motion)
        start += count


@njit(cache=True)
def motion_increments_neighbours(dt, rate, force, mean, scratch, out):
    """Fill out, (n-1, 10), each step with the polynomial that its two neighbours share."""
    for k in range(dt.shape[0]):
        first, count = k, 1
        if k > 0 and neighbour(dt[k], dt[k - 1]) > 0.0:
            first, count = k - 1, 2
        if k + 1 < dt.shape[0] and neighbour(dt[k], dt[k + 1]) > 0.0:
            count += 1
        place_nodes(dt, first, count, scratch)
        put_motion(out, k, dt[k], window_motion(dt, rate, force, mean, k, first, count, scratch))


@njit(cache=True)
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
