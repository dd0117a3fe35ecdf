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

from numba import njit

from strapdown._kernels.rotation_vector import ALIKE, cross

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

    Rate and force run along the lines whose integrals over the two steps are what was measured.
    A step before it that is unlike it, or of length zero, tells nothing: then they are constant.
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


@njit(cache=True, error_model="numpy")
def put_motion(out, k, dt, motion):
    """Store a row: dt, phi, dv, dr."""
    px, py, pz, vx, vy, vz, rx, ry, rz = motion
    out[k, 0] = dt
    out[k, 1], out[k, 2], out[k, 3] = px, py, pz
    out[k, 4], out[k, 5], out[k, 6] = vx, vy, vz
    out[k, 7], out[k, 8], out[k, 9] = rx, ry, rz


@njit(cache=True, error_model="numpy")
def motion_increments_linear(dt, rate, force, mean, out):
    """Fill out, (n-1, 10): dt, phi, dv, dr of the steps between n samples.

    The interval of the first mean ends where the first step begins; its length is not known,
    and taken for that of the first step.
    """
    if mean:
        before = dt[0] if dt.shape[0] > 0 else 0.0
        for k in range(dt.shape[0]):
            put_motion(
                out,
                k,
                dt[k],
                mean_motion(
                    dt[k],
                    before,
                    rate[k, 0],
                    rate[k, 1],
                    rate[k, 2],
                    rate[k + 1, 0],
                    rate[k + 1, 1],
                    rate[k + 1, 2],
                    force[k, 0],
                    force[k, 1],
                    force[k, 2],
                    force[k + 1, 0],
                    force[k + 1, 1],
                    force[k + 1, 2],
                ),
            )
            before = dt[k]
        return
    for k in range(dt.shape[0]):
        put_motion(
            out,
            k,
            dt[k],
            linear_motion(
                dt[k],
                rate[k, 0],
                rate[k, 1],
                rate[k, 2],
                rate[k + 1, 0],
                rate[k + 1, 1],
                rate[k + 1, 2],
                force[k, 0],
                force[k, 1],
                force[k, 2],
                force[k + 1, 0],
                force[k + 1, 1],
                force[k + 1, 2],
            ),
        )
