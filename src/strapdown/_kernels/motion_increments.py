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

from numba import njit

from strapdown._kernels.rotation import half_angle
from strapdown._kernels.rotation_vector import ALIKE, cross

# Below this square of the angle (0.25 rad) the integrals of sin and cos are series, whose first
# neglected terms are under 1e-17 of the value. Above, they follow from the half angle, and what
# is lost by cancellation in them is of the size of a rounding of V1 and V2.
SERIES_LIMIT = 0.0625


@njit(cache=True)
def integral_coefficients(u):
    """Coefficients b, c, d of V1 = 1 + b [w x] + c [w x]^2, V2 = 1/2 + c [w x] + d [w x]^2.

    Of u = |w|^2 = n^2: b = (1 - cos n)/n^2, c = (n - sin n)/n^3, d = (n^2/2 - 1 + cos n)/n^4.
    """
    if u < SERIES_LIMIT:
        d = 1.0 / 24.0 - u * (
            1.0 / 720.0 - u * (1.0 / 40320.0 - u * (1.0 / 3628800.0 - u * (1.0 / 479001600.0)))
        )
        e = 1.0 / 120.0 - u * (
            1.0 / 5040.0 - u * (1.0 / 362880.0 - u * (1.0 / 39916800.0 - u * (1.0 / 6227020800.0)))
        )
        return 0.5 - u * d, 1.0 / 6.0 - u * e, d
    k, s = half_angle(0.25 * u)
    b = 2.0 * s * s
    return b, (1.0 - 2.0 * k * s) / u, (0.5 - b) / u


@njit(cache=True)
def motion_exponential(wx, wy, wz, ax, ay, az, px, py, pz, tau):
    """Velocity and distance dv, dr of the exponential of (w, a, p, tau); its turn is w."""
    b, c, d = integral_coefficients(wx * wx + wy * wy + wz * wz)
    # V1 p + tau V2 a = p + a' / 2 + w x (b p + c a' + w x (c p + d a')) with a' = tau a.
    kx, ky, kz = cross(wx, wy, wz, ax, ay, az)
    ux, uy, uz = cross(wx, wy, wz, b * ax + c * kx, b * ay + c * ky, b * az + c * kz)
    tx, ty, tz = tau * ax, tau * ay, tau * az
    kx, ky, kz = cross(wx, wy, wz, c * px + d * tx, c * py + d * ty, c * pz + d * tz)
    sx, sy, sz = cross(wx, wy, wz, b * px + c * tx + kx, b * py + c * ty + ky, b * pz + c * tz + kz)
    return (
        ax + ux,
        ay + uy,
        az + uz,
        px + 0.5 * tx + sx,
        py + 0.5 * ty + sy,
        pz + 0.5 * tz + sz,
    )


@njit(cache=True)
def line_motion(dt, wx, wy, wz, dx, dy, dz, fx, fy, fz, gx, gy, gz):
    """Phi, dv, dr of a step over which rate and force run along lines; fourth order.

    w and f are the integrals of rate and force over the step, d and g their change over it
    times its length: the Magnus series is (w, f, 0, dt) + 1/12 [(w, f, 0, dt), (d, g, 0, 0)].
    """
    k = 1.0 / 12.0
    x, y, z = cross(wx, wy, wz, dx, dy, dz)
    px, py, pz = wx + k * x, wy + k * y, wz + k * z
    ax, ay, az = cross(wx, wy, wz, gx, gy, gz)
    bx, by, bz = cross(fx, fy, fz, dx, dy, dz)
    m = -k * dt
    vx, vy, vz, rx, ry, rz = motion_exponential(
        px,
        py,
        pz,
        fx + k * (ax + bx),
        fy + k * (ay + by),
        fz + k * (az + bz),
        m * gx,
        m * gy,
        m * gz,
        dt,
    )
    return px, py, pz, vx, vy, vz, rx, ry, rz


@njit(cache=True)
def linear_motion(dt, w0x, w0y, w0z, w1x, w1y, w1z, f0x, f0y, f0z, f1x, f1y, f1z):
    """Phi, dv, dr of the step between two samples of rate w and force f, joined by lines."""
    h = 0.5 * dt
    return line_motion(
        dt,
        h * (w0x + w1x),
        h * (w0y + w1y),
        h * (w0z + w1z),
        dt * (w1x - w0x),
        dt * (w1y - w0y),
        dt * (w1z - w0z),
        h * (f0x + f1x),
        h * (f0y + f1y),
        h * (f0z + f1z),
        dt * (f1x - f0x),
        dt * (f1y - f0y),
        dt * (f1z - f0z),
    )


@njit(cache=True)
def mean_slope(dt, before):
    """Change over a step per difference of its mean from the mean before it, times dt.

    Zero where there is no step before it, or an unlike one: that tells nothing of this one.
    """
    if before <= ALIKE * dt and dt <= ALIKE * before:
        return 2.0 * dt * dt / (dt + before)
    return 0.0


@njit(cache=True)
def mean_motion(dt, before, w0x, w0y, w0z, w1x, w1y, w1z, f0x, f0y, f0z, f1x, f1y, f1z):
    """Phi, dv, dr of a step with means w1 and f1, after one of length `before` with w0, f0.

    Rate and force run along the lines whose integrals over the two steps are what was measured.
    """
    m = mean_slope(dt, before)
    return line_motion(
        dt,
        dt * w1x,
        dt * w1y,
        dt * w1z,
        m * (w1x - w0x),
        m * (w1y - w0y),
        m * (w1z - w0z),
        dt * f1x,
        dt * f1y,
        dt * f1z,
        m * (f1x - f0x),
        m * (f1y - f0y),
        m * (f1z - f0z),
    )


@njit(cache=True)
def motion_increments_linear(dt, rate, force, mean, out):
    """Fill out, (n-1, 10): dt, phi, dv, dr of the steps between n samples.

    The interval of the first mean ends where the first step begins; its length is not known,
    and taken for that of the first step.
    """
    before = dt[0] if dt.shape[0] > 0 else 0.0
    for k in range(dt.shape[0]):
        h = dt[k]
        w0x, w0y, w0z = rate[k, 0], rate[k, 1], rate[k, 2]
        w1x, w1y, w1z = rate[k + 1, 0], rate[k + 1, 1], rate[k + 1, 2]
        f0x, f0y, f0z = force[k, 0], force[k, 1], force[k, 2]
        f1x, f1y, f1z = force[k + 1, 0], force[k + 1, 1], force[k + 1, 2]
        if mean:
            px, py, pz, vx, vy, vz, rx, ry, rz = mean_motion(
                h, before, w0x, w0y, w0z, w1x, w1y, w1z, f0x, f0y, f0z, f1x, f1y, f1z
            )
        else:
            px, py, pz, vx, vy, vz, rx, ry, rz = linear_motion(
                h, w0x, w0y, w0z, w1x, w1y, w1z, f0x, f0y, f0z, f1x, f1y, f1z
            )
        before = h
        out[k, 0] = h
        out[k, 1], out[k, 2], out[k, 3] = px, py, pz
        out[k, 4], out[k, 5], out[k, 6] = vx, vy, vz
        out[k, 7], out[k, 8], out[k, 9] = rx, ry, rz
