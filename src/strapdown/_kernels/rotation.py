"""Rotation formulas, scalar in and scalar out, and their loops over arrays.

Quaternions are Hamilton's, scalar first. ``q_ab`` and ``C_ab`` turn a vector from
``b`` into ``a``. A rotation vector ``r`` turns by ``|r|`` rad about ``r``. Euler angles
are 3-2-1: ``C = Rz(heading) Ry(pitch) Rx(roll)``.
"""

from __future__ import annotations

import math

import numpy as np

from strapdown._kernels.compilation import njit

# Below this square of the half angle (|r| = 0.5 rad) the series replaces sin and cos:
# the first neglected term is under 1e-17 of the value there, so both sides of the switch
# are correct to rounding, and the series needs no division by the angle.
SERIES_LIMIT = 0.0625

# Below this square of the tangent of the half angle atan(x)/x is summed as a series; the
# first neglected term is x^6/7 < 2e-19.
ATAN_SERIES_LIMIT = 1e-6

# hypot() of the two components that vanish at pitch = +-90 deg. Under it they hold nothing
# but rounding, and only heading -+ roll is defined.
GIMBAL_LOCK = 1e-14

DEGREES = 180.0 / math.pi


# Inlined: a step that calls it keeps its numbers in registers (`ned`: 91 ns instead of 99).
@njit(cache=True, inline="always")
def half_angle(u):
    """Cos(x) and sin(x)/(2x) for u = x^2: the limits of Alexiev (21) and (22), x = |r|/2."""
    if u < SERIES_LIMIT:
        c = 1.0 - u * (
            0.5
            - u
            * (
                1.0 / 24.0
                - u
                * (
                    1.0 / 720.0
                    - u * (1.0 / 40320.0 - u * (1.0 / 3628800.0 - u * (1.0 / 479001600.0)))
                )
            )
        )
        s = 0.5 * (
            1.0
            - u
            * (
                1.0 / 6.0
                - u
                * (1.0 / 120.0 - u * (1.0 / 5040.0 - u * (1.0 / 362880.0 - u * (1.0 / 39916800.0))))
            )
        )
        return c, s
    x = math.sqrt(u)
    return math.cos(x), 0.5 * math.sin(x) / x


@njit(cache=True)
def half_angle_truncated(u, order):
    """Alexiev (21) and (22) with every term up to |r|^order of the quaternion kept."""
    c = 1.0
    s = 1.0
    term = 1.0
    for k in range(1, order + 1):
        # term = u^(k//2) (-1)^(k//2) / k!; even k belongs to c, and odd k to s, where the
        # vector part brings in one more power of the angle.
        term /= float(k)
        if k % 2 == 0:
            term *= -u
            c += term
        elif k > 1:
            s += term
    return c, 0.5 * s


@njit(cache=True)
def quat_multiply(aw, ax, ay, az, bw, bx, by, bz):
    """Hamilton product: q_ac = q_ab q_bc."""
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


@njit(cache=True, inline="always")
def quat_from_rotvec(x, y, z):
    """Exponential: Alexiev (14)-(17), with the series near zero that they lack."""
    c, s = half_angle(0.25 * (x * x + y * y + z * z))
    return c, s * x, s * y, s * z


@njit(cache=True)
def rotvec_from_quat(w, x, y, z):
    """Logarithm: the rotation vector of length at most pi."""
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    v2 = x * x + y * y + z * z
    if v2 < ATAN_SERIES_LIMIT * w * w:
        t = v2 / (w * w)
        k = 2.0 * (1.0 - t * (1.0 / 3.0 - t * (1.0 / 5.0))) / w
    else:
        v = math.sqrt(v2)
        k = 2.0 * math.atan2(v, w) / v
    return k * x, k * y, k * z


@njit(cache=True)
def dcm_from_rotvec(x, y, z):
    """Alexiev (12): I + sin(n)/n [r x] + (1 - cos n)/n^2 [r x]^2, row by row.

    With c and s of the half angle, sin(n)/n = 2cs and (1 - cos n)/n^2 = 2s^2: no
    cancellation, and one series for quaternion and matrix.
    """
    c, s = half_angle(0.25 * (x * x + y * y + z * z))
    return dcm_from_coefficients(x, y, z, 2.0 * c * s, 2.0 * s * s)


@njit(cache=True)
def dcm_from_coefficients(x, y, z, a, b):
    """I + a [r x] + b [r x]^2, row by row."""
    return (
        1.0 - b * (y * y + z * z),
        b * x * y - a * z,
        b * x * z + a * y,
        b * x * y + a * z,
        1.0 - b * (x * x + z * z),
        b * y * z - a * x,
        b * x * z - a * y,
        b * y * z + a * x,
        1.0 - b * (x * x + y * y),
    )


@njit(cache=True)
def dcm_coefficients_truncated(n2, order):
    """Coefficients of [r x] and [r x]^2 with every term of exp up to [r x]^order kept."""
    a = 1.0
    b = 0.5 if order >= 2 else 0.0
    term_a = 1.0
    term_b = 0.5
    k = 1
    while 2 * k + 1 <= order:
        term_a *= -n2 / float((2 * k) * (2 * k + 1))
        a += term_a
        k += 1
    k = 1
    while 2 * k + 2 <= order:
        term_b *= -n2 / float((2 * k + 1) * (2 * k + 2))
        b += term_b
        k += 1
    return a, b


@njit(cache=True)
def dcm_from_quat(w, x, y, z):
    """Direction cosine matrix of a unit quaternion, row by row."""
    # Doubling is exact, so that it may come first.
    a, b, c = 2.0 * x, 2.0 * y, 2.0 * z
    xx, yy, zz = x * a, y * b, z * c
    xy, xz, yz = x * b, x * c, y * c
    wx, wy, wz = w * a, w * b, w * c
    return (
        1.0 - (yy + zz),
        xy - wz,
        xz + wy,
        xy + wz,
        1.0 - (xx + zz),
        yz - wx,
        xz - wy,
        yz + wx,
        1.0 - (xx + yy),
    )


@njit(cache=True)
def quat_from_dcm(c11, c12, c13, c21, c22, c23, c31, c32, c33):
    """Unit quaternion of a rotation matrix, from its largest component (Shepperd 1978)."""
    trace = c11 + c22 + c33
    big = max(trace, c11, c22, c33)
    if big == trace:
        w, x, y, z = 1.0 + trace, c32 - c23, c13 - c31, c21 - c12
    elif big == c11:
        w, x, y, z = c32 - c23, 1.0 + c11 - c22 - c33, c12 + c21, c13 + c31
    elif big == c22:
        w, x, y, z = c13 - c31, c12 + c21, 1.0 - c11 + c22 - c33, c23 + c32
    else:
        w, x, y, z = c21 - c12, c13 + c31, c23 + c32, 1.0 - c11 - c22 + c33
    return quat_normalise(w, x, y, z)


@njit(cache=True, error_model="numpy")
def quat_normalise(w, x, y, z):
    """Scale to unit norm; the zero quaternion gives NaN, which the tables refuse."""
    k = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    return w * k, x * k, y * k, z * k


@njit(cache=True)
def quat_from_euler(roll, pitch, heading):
    """Quaternion of Rz(heading) Ry(pitch) Rx(roll)."""
    cr, sr = math.cos(0.5 * roll), math.sin(0.5 * roll)
    cp, sp = math.cos(0.5 * pitch), math.sin(0.5 * pitch)
    ch, sh = math.cos(0.5 * heading), math.sin(0.5 * heading)
    return (
        cr * cp * ch + sr * sp * sh,
        sr * cp * ch - cr * sp * sh,
        cr * sp * ch + sr * cp * sh,
        cr * cp * sh - sr * sp * ch,
    )


@njit(cache=True)
def euler_from_quat(w, x, y, z):
    """Roll and heading in (-pi, pi], pitch in [-pi/2, pi/2]; at the lock roll is zero.

    Half sum and half difference of heading and roll (Bernardes and Viollet 2022,
    doi:10.1371/journal.pone.0276302) keep full accuracy at every pitch, where the usual
    arcsine loses half its digits near +-90 deg.
    """
    up = math.hypot(w + y, z - x)
    down = math.hypot(w - y, z + x)
    pitch = 2.0 * math.atan2(up, down) - 0.5 * math.pi
    half_sum = math.atan2(z + x, w - y)
    half_difference = math.atan2(z - x, w + y)
    if down < GIMBAL_LOCK:
        half_sum = half_difference
    elif up < GIMBAL_LOCK:
        half_difference = half_sum
    roll, heading = half_sum - half_difference, half_sum + half_difference
    # A remainder takes longer than to see that nothing is to be wrapped.
    if abs(roll) >= math.pi or abs(heading) >= math.pi:
        roll, heading = wrap_pi(roll), wrap_pi(heading)
    return roll, pitch, heading


@njit(cache=True)
def wrap_pi(angle):
    """Angle in (-pi, pi]; unchanged to the last bit when it already lies there."""
    # fmod is exact, so that no multiple of 2 pi is rounded twice.
    angle = np.fmod(angle, 2.0 * math.pi)
    if angle > math.pi:
        return angle - 2.0 * math.pi
    if angle <= -math.pi:
        return angle + 2.0 * math.pi
    return angle


@njit(cache=True)
def quats_from_rotvecs(r, q):
    """Apply `quat_from_rotvec` to each row."""
    for i in range(r.shape[0]):
        q[i, 0], q[i, 1], q[i, 2], q[i, 3] = quat_from_rotvec(r[i, 0], r[i, 1], r[i, 2])


@njit(cache=True)
def rotvecs_from_quats(q, r):
    """Apply `rotvec_from_quat` to each row."""
    for i in range(q.shape[0]):
        r[i, 0], r[i, 1], r[i, 2] = rotvec_from_quat(q[i, 0], q[i, 1], q[i, 2], q[i, 3])


@njit(cache=True)
def dcms_from_quats(q, c):
    """Apply `dcm_from_quat` to each row; `c` is (n, 9), row by row."""
    for i in range(q.shape[0]):
        row = dcm_from_quat(q[i, 0], q[i, 1], q[i, 2], q[i, 3])
        for j in range(9):
            c[i, j] = row[j]


@njit(cache=True)
def dcms_from_rotvecs(r, c):
    """Apply `dcm_from_rotvec` to each row; `c` is (n, 9), row by row."""
    for i in range(r.shape[0]):
        row = dcm_from_rotvec(r[i, 0], r[i, 1], r[i, 2])
        for j in range(9):
            c[i, j] = row[j]


@njit(cache=True)
def quats_from_dcms(c, q):
    """Apply `quat_from_dcm` to each row; `c` is (n, 9), row by row."""
    for i in range(c.shape[0]):
        q[i, 0], q[i, 1], q[i, 2], q[i, 3] = quat_from_dcm(
            c[i, 0], c[i, 1], c[i, 2], c[i, 3], c[i, 4], c[i, 5], c[i, 6], c[i, 7], c[i, 8]
        )


@njit(cache=True)
def quats_from_eulers(e, q):
    """Apply `quat_from_euler` to each row of roll, pitch, heading."""
    for i in range(e.shape[0]):
        q[i, 0], q[i, 1], q[i, 2], q[i, 3] = quat_from_euler(e[i, 0], e[i, 1], e[i, 2])


@njit(cache=True)
def euler_degrees_from_quat(w, x, y, z):
    """As `euler_from_quat` in deg, with the heading in [0, 360)."""
    roll, pitch, heading = euler_from_quat(w, x, y, z)
    heading *= DEGREES
    if heading < 0.0:
        heading += 360.0
        # -1e-17 deg rounds to 360 and not to just under it.
        if heading >= 360.0:
            heading = 0.0
    return roll * DEGREES, pitch * DEGREES, heading


@njit(cache=True, error_model="numpy")
def unit_quat(w, x, y, z):
    """Scale to norm 1 by quotients, as tables are; the norm is returned, too."""
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    return w / norm, x / norm, y / norm, z / norm, norm


@njit(cache=True)
def unit_quats(q, tolerance, out):
    """Apply `unit_quat` to each row; return the first whose norm is not 1 to `tolerance`, or -1."""
    far = -1
    for i in range(q.shape[0]):
        w, x, y, z, norm = unit_quat(q[i, 0], q[i, 1], q[i, 2], q[i, 3])
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = w, x, y, z
        if far < 0 and abs(norm - 1.0) > tolerance:
            far = i
    return far


@njit(cache=True)
def unit_quat_of(a, first, out):
    """Apply `unit_quat` to four numbers of an array, from `first` on."""
    w, x, y, z, _ = unit_quat(a[first], a[first + 1], a[first + 2], a[first + 3])
    out[0], out[1], out[2], out[3] = w, x, y, z


@njit(cache=True)
def unit_euler_degrees(a, first, out):
    """As `euler_degrees_from_quat` of four numbers of an array, as a table has it.

    There the quaternion is scaled to norm 1, and once more where its angles are computed, which can
    change its last bit.
    """
    w, x, y, z, _ = unit_quat(a[first], a[first + 1], a[first + 2], a[first + 3])
    w, x, y, z, _ = unit_quat(w, x, y, z)
    out[0], out[1], out[2] = euler_degrees_from_quat(w, x, y, z)


@njit(cache=True)
def eulers_degrees_from_quats(q, e):
    """Apply `euler_degrees_from_quat` to each row."""
    for i in range(q.shape[0]):
        e[i, 0], e[i, 1], e[i, 2] = euler_degrees_from_quat(q[i, 0], q[i, 1], q[i, 2], q[i, 3])


@njit(cache=True)
def quats_multiply(a, b, q):
    """Apply `quat_multiply` to each pair of rows."""
    for i in range(a.shape[0]):
        q[i, 0], q[i, 1], q[i, 2], q[i, 3] = quat_multiply(
            a[i, 0], a[i, 1], a[i, 2], a[i, 3], b[i, 0], b[i, 1], b[i, 2], b[i, 3]
        )


@njit(cache=True)
def quat_angle(aw, ax, ay, az, bw, bx, by, bz):
    """Angle of the rotation from a to b, at most pi; right however small it is."""
    w, x, y, z = quat_multiply(aw, -ax, -ay, -az, bw, bx, by, bz)
    return 2.0 * math.atan2(math.sqrt(x * x + y * y + z * z), abs(w))


@njit(cache=True)
def quats_angle(a, b, out):
    for k in range(a.shape[0]):
        out[k] = quat_angle(a[k, 0], a[k, 1], a[k, 2], a[k, 3], b[k, 0], b[k, 1], b[k, 2], b[k, 3])


@njit(cache=True)
def quats_rotate(q, v, out):
    """Turn each row of `v` by the unit quaternion in the same row."""
    for i in range(q.shape[0]):
        c = dcm_from_quat(q[i, 0], q[i, 1], q[i, 2], q[i, 3])
        for j in range(3):
            out[i, j] = c[3 * j] * v[i, 0] + c[3 * j + 1] * v[i, 1] + c[3 * j + 2] * v[i, 2]
