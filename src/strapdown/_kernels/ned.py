"""Navigation in local north-east-down on the ellipsoid: one step, and its loops.

A step is integrated in the axes of the local level at its start, held fixed in inertial space.
There the Earth's rate is constant, and the velocity relative to the Earth, w, obeys ``dw/dt = C f +
g - omega_ie x w``. The body's increments are the integrals of C f; the Coriolis term is integrated
by the displacement r, the integral of w; gravity is taken at the mean position of the step and
turned with the local level. The displacement, turned back by the Earth's rate, gives the new
position by geometry, and the two positions give the turn of the local level in closed form: no
transport rate is integrated. The error of a run is of the fourth order of the step, except for the
effect of the changing radii on the turn of gravity in a climb: at most 1/2 g (omega_ie + v/R) (v_d
+ e2 v)/R dt², 1e-9 m/s² for steps of 1 s at 230 m/s and a climb of 10 m/s.
"""

from __future__ import annotations

import math

from strapdown._kernels.compilation import njit
from strapdown._kernels.earth import gravity_around
from strapdown._kernels.rotation import (
    DEGREES,
    dcm_from_quat,
    euler_degrees_from_quat,
    quat_from_rotvec,
    quat_multiply,
    unit_quat,
    wrap_pi,
)

# Indices of the state: rad, m, m/s, quaternion body to level, sine and cosine of the latitude
# (turned with the level from step to step instead of computed), the radius of the prime vertical
# over a, the downward acceleration estimated by the vertical loop, m/s², and the time since its
# last reference, s.
LAT, LON, ALT, V, Q, SINE, COSINE, PRIME, PULL, SINCE = 0, 1, 2, 3, 6, 10, 11, 12, 13, 14
STATE = 15
# Length of the part of the state that goes into the history.
ROW = 10

# Modes of the height, and the indices of mode, time constant of its loop, and change of gravity
# with height, 1/s², in the options.
FREE, HELD, DAMPED = 0.0, 1.0, 2.0
MODE, TAU, SPRING = 0, 1, 2
# Limits: cosine of the latitude, turn of the level about the vertical in one step, speed, heights.
COS_LATITUDE, SPEED, LOWEST, HIGHEST = 3, 4, 5, 6
OPTIONS = 7
# A step that takes a larger part of the way around the pole is beyond the series of `displace`.
LARGEST_TURN = 0.01

# Reasons for ending early. The last is for axes without a pole: a step longer than `LARGEST_TURN`
# around the Earth.
DONE, POLE, DIVERGED, LEAP = 0, 1, 2, 3

THIRD = 1.0 / 3.0
SIXTH = 1.0 / 6.0
TWELFTH = 1.0 / 12.0


@njit(cache=True, inline="always")
def rotate(c11, c12, c13, c21, c22, c23, c31, c32, c33, x, y, z):
    return (
        c11 * x + c12 * y + c13 * z,
        c21 * x + c22 * y + c23 * z,
        c31 * x + c32 * y + c33 * z,
    )


@njit(cache=True, inline="always")
def turn_back(w, x, y, z, a, b, c):
    """Vector (a, b, c) by the inverse of the rotation of a unit quaternion."""
    # Twice the vector, which is known before the rotation; doubling is exact.
    d, e, f = 2.0 * a, 2.0 * b, 2.0 * c
    p, q, r = e * z - f * y, f * x - d * z, d * y - e * x
    return a + w * p + q * z - r * y, b + w * q + r * x - p * z, c + w * r + p * y - q * x


@njit(cache=True, error_model="numpy", inline="always")
def displace(s, c, curvature, parallel, change, north, east, down):
    """Change of latitude, longitude and height by a straight displacement in local axes.

    First to the meridian of the new position, then along it, on the circle of curvature and the
    change of its radius; the remainder is of the fourth order of displacement over radius.
    `curvature` is that of the meridian at the height, `parallel` one over the radius of the
    parallel, `change` half the derivative of the meridian's radius with latitude, over itself.
    """
    # Quotients by series: a division waits for what it divides by.
    small = (s * north + c * down) * parallel
    nearer = 1.0 + small * (1.0 + small * (1.0 + small))
    first = east * parallel
    sag = 0.5 * east * first * nearer
    x = first * nearer
    along = (north - s * sag) * curvature
    up = c * sag - down
    rise = up * curvature
    t = along * (1.0 - rise * (1.0 - rise * (1.0 - rise)))
    x2 = x * x
    return (
        t * (1.0 - t * (THIRD * t + change)),
        x * (1.0 - THIRD * x2),
        up + 0.5 * (north - s * sag) * t,
    )


@njit(cache=True, error_model="numpy", inline="always")
def level_turn(s, c, dlat, turn):
    """Quaternion from the new local level to the old one, in closed form of the two positions.

    `turn` is the change of longitude and, relative to inertial space, of the Earth's angle. The
    quaternion is (cos y cos h, sin y cos l, -cos y sin h, -sin y sin l) of half of it, y, half the
    change of latitude, h, and the latitude between the two, l. h, at most 1e-4 for a step of 1 km,
    is kept to second order, y to third. Also returns sine and cosine of the new latitude.
    """
    # Halves are exact wherever they are taken: not of `dlat`, for which all else waits.
    y = 0.5 * turn
    y2 = y * y
    sine, cosine = s + 0.5 * c * dlat, c - 0.5 * s * dlat
    sy = y * (1.0 - SIXTH * y2)
    w = 1.0 - (0.5 * y2 + 0.25 * dlat * (0.5 * dlat))
    return (
        w,
        sy * cosine,
        (0.25 * y2 - 0.5) * dlat,
        -sy * sine,
        s + dlat * cosine,
        c - dlat * sine,
    )


@njit(cache=True, error_model="numpy", inline="always")
def ned_step(
    lat,
    lon,
    alt,
    vn,
    ve,
    vd,
    qw,
    qx,
    qy,
    qz,
    s,
    c,
    w,
    dt,
    phi_x,
    phi_y,
    phi_z,
    dv_x,
    dv_y,
    dv_z,
    dr_x,
    dr_y,
    dr_z,
    a,
    e2,
    gamma,
    k,
    rate,
    f,
    m,
):
    """State after a step of motion increments; two-step quaternion of Tadic (11)-(19)."""
    # One Newton step from its value a step before; a root and a quotient would keep all else
    # waiting.
    w = w * (1.5 - 0.5 * (1.0 - e2 * s * s) * w * w)
    transverse = a * w
    meridian = transverse * (1.0 - e2) * w * w
    curvature = 1.0 / (meridian + alt)
    parallel = 1.0 / ((transverse + alt) * c)
    c11, c12, c13, c21, c22, c23, c31, c32, c33 = dcm_from_quat(qw, qx, qy, qz)
    un, ue, ud = rotate(c11, c12, c13, c21, c22, c23, c31, c32, c33, dv_x, dv_y, dv_z)
    sn, se, sd = rotate(c11, c12, c13, c21, c22, c23, c31, c32, c33, dr_x, dr_y, dr_z)
    gn, gd, gn_lat, gn_alt, gd_lat, gd_alt, gd_alt2 = gravity_around(
        s, c, alt, w, curvature, a, e2, gamma, k, f, m
    )
    on = rate * c
    od = -rate * s

    # Mean displacement over the step, by Hermite's cubic through its two ends.
    half = 0.5 * dt
    twelfth = TWELFTH * dt
    sixth = SIXTH * dt * dt
    mn = half * vn + 0.5 * sn - twelfth * un + sixth * (gn + od * ve)
    me = half * ve + 0.5 * se - twelfth * ue + sixth * (on * vd - od * vn)
    md = half * vd + 0.5 * sd - twelfth * ud + sixth * (gd - on * ve)

    # Gravity at the mean position. In the rise, the first term is the fall of the level surface,
    # the last the Earth's turn while the body moves: the height is relative to the Earth.
    to_north = mn * curvature
    to_east = me * parallel * c
    rise = 2.0 * THIRD * (mn * to_north + me * to_east) - md + sixth * on * ve
    more_n = to_north * gn_lat + rise * gn_alt
    more_d = to_north * gd_lat + rise * (gd_alt + rise * gd_alt2)
    gn += more_n
    gd += more_d
    # Mean turn z of the level, and gravity turned by it: g + z x (g + 2/3 z x g), because the
    # mean square of a turn at constant rate is 4/3 of the squared mean. Of the level's own turn
    # about the vertical only north takes part: down, by which the rest is, stays where it is.
    # Twice integrated, what grows with time counts for a third instead of a half.
    zn = half * on + to_east
    ze = -to_north
    zd = half * od
    two_thirds = 2.0 * THIRD * gd
    tn = ze * gd + two_thirds * zn * zd
    te = (zd - me * parallel * s) * gn - zn * gd + two_thirds * ze * zd
    td = -ze * gn - two_thirds * (zn * zn + ze * ze)
    dt2 = dt * dt
    rn = dt * (vn + od * me) + sn + dt2 * (0.5 * gn - SIXTH * more_n + THIRD * tn)
    re = dt * (ve + on * md - od * mn) + se + dt2 * THIRD * te
    rd = dt * (vd - on * me) + sd + dt2 * (0.5 * gd - SIXTH * more_d + THIRD * td)
    # The Earth's rate times the displacement.
    xn, xe, xd = -od * re, od * rn - on * rd, on * re
    wn = vn + un + dt * (gn + tn) - xn
    we = ve + ue + dt * te - xe
    wd = vd + ud + dt * (gd + td) - xd

    # Relative to the Earth: turned back by its rate, r + o x (int t dr + o x r dt²/6).
    bn = dt * (rn - mn) - sixth * xn
    be = dt * (re - me) - sixth * xe
    bd = dt * (rd - md) - sixth * xd
    dlat, dlon, dalt = displace(
        s,
        c,
        curvature,
        parallel,
        1.5 * e2 * s * c * meridian * curvature * w * w,
        rn + od * be,
        re + on * bd - od * bn,
        rd - on * be,
    )

    fw, fx, fy, fz, s1, c1 = level_turn(s, c, dlat, dlon + rate * dt)
    vn, ve, vd = turn_back(fw, fx, fy, fz, wn, we, wd)
    # One Newton step towards norm 1, of the norm before the step: so it need not wait for the end.
    n = 1.5 - 0.5 * (qw * qw + qx * qx + qy * qy + qz * qz)
    bw, bx, by, bz = quat_from_rotvec(phi_x, phi_y, phi_z)
    bw, bx, by, bz = quat_multiply(qw, qx, qy, qz, n * bw, n * bx, n * by, n * bz)
    bw, bx, by, bz = quat_multiply(fw, -fx, -fy, -fz, bw, bx, by, bz)
    return (
        lat + dlat,
        lon + dlon,
        alt + dalt,
        vn,
        ve,
        vd,
        bw,
        bx,
        by,
        bz,
        s1,
        c1,
        w,
        dlon,
    )


@njit(cache=True, inline="always")
def guide_height(alt, vd, pull, since, before, reference, dt, mode, tau, spring):
    """Height, down velocity and the loop's memory after a step, with the height held or damped.

    The loop is closed over the time since the previous reference, however many steps that was,
    with the gains of the fading memory of second degree, whose three poles are at exp(-time/tau)
    for any time: `1 - q³, 3/2 (1 - q)² (1 + q), (1 - q)³` for height, velocity times time,
    acceleration times time squared (Morrison 1969, ch. 13). For short times these are 3/tau,
    3/tau², 1/tau³ times it. `spring` is the decrease of gravity with height, 1/s².
    """
    if mode == HELD:
        return before, 0.0, pull, since
    if mode == DAMPED:
        vd += pull * dt
        since += dt
        if not math.isnan(reference):
            ahead = alt - reference
            q = math.exp(-since / tau)
            part = 1.0 - q
            alt -= (1.0 - q * q * q) * ahead
            vd += (1.5 * part * part * (1.0 + q) / since + spring * min(since, tau)) * ahead
            pull += part * part * part / (since * since) * ahead
            since = 0.0
    return alt, vd, pull, since


@njit(cache=True, inline="always")
def within(alt, vn, ve, vd, qw, cosine, speed, lowest, highest):
    """Whether a state is finite and within the limits of speed and height."""
    # Written so that NaN fails.
    return (
        vn * vn + ve * ve + vd * vd <= speed * speed
        and lowest <= alt <= highest
        and abs(qw) <= 2.0
        and abs(cosine) <= 2.0
    )


@njit(cache=True, inline="always")
def verdict(alt, vn, ve, vd, qw, cosine, turn, limit, speed, lowest, highest):
    """Whether this mechanization can continue from a state: `DONE` or the reason why not."""
    if not within(alt, vn, ve, vd, qw, cosine, speed, lowest, highest):
        return DIVERGED
    if cosine < limit or abs(turn) > LARGEST_TURN:
        return POLE
    return DONE


@njit(cache=True, error_model="numpy")
def ned_advance(state, increments, reference, earth, options, history):
    """Advance over a segment; returns the steps made, and why it ended.

    `reference` holds a height for every step, or is empty; `history` takes the first ten numbers
    of the state after each step. A step with an invalid end is not made.
    """
    lat, lon, alt, vn, ve, vd = state[0], state[1], state[2], state[3], state[4], state[5]
    qw, qx, qy, qz = state[6], state[7], state[8], state[9]
    s, c, w = state[SINE], state[COSINE], state[PRIME]
    pull, since = state[PULL], state[SINCE]
    a, e2, gamma, k = earth[0], earth[1], earth[2], earth[3]
    rate, f, m = earth[4], earth[5], earth[6]
    mode, tau, spring = options[MODE], options[TAU], options[SPRING]
    limit, speed = options[COS_LATITUDE], options[SPEED]
    lowest, highest = options[LOWEST], options[HIGHEST]
    steps = increments.shape[0]
    why = DONE
    made = steps
    for i in range(steps):
        before = alt
        dt = increments[i, 0]
        lat, lon, alt, vn, ve, vd, qw, qx, qy, qz, s, c, w, turn = ned_step(
            lat,
            lon,
            alt,
            vn,
            ve,
            vd,
            qw,
            qx,
            qy,
            qz,
            s,
            c,
            w,
            dt,
            increments[i, 1],
            increments[i, 2],
            increments[i, 3],
            increments[i, 4],
            increments[i, 5],
            increments[i, 6],
            increments[i, 7],
            increments[i, 8],
            increments[i, 9],
            a,
            e2,
            gamma,
            k,
            rate,
            f,
            m,
        )
        if mode != FREE:
            height = math.nan
            if reference.shape[0] > 0:
                height = reference[i]
            alt, vd, pull, since = guide_height(
                alt, vd, pull, since, before, height, dt, mode, tau, spring
            )
        why = verdict(alt, vn, ve, vd, qw, c, turn, limit, speed, lowest, highest)
        if why != DONE:
            made = i
            break
        history[i, 0], history[i, 1], history[i, 2] = lat, lon, alt
        history[i, 3], history[i, 4], history[i, 5] = vn, ve, vd
        history[i, 6], history[i, 7], history[i, 8], history[i, 9] = qw, qx, qy, qz
        state[SINE], state[COSINE], state[PRIME] = s, c, w
        state[PULL], state[SINCE] = pull, since
    if made > 0:
        for j in range(ROW):
            state[j] = history[made - 1, j]
    return made, why


@njit(cache=True)
def reverse_increments(increments, out):
    """Increments of the same motion run backward, in reverse order.

    Backward the body turns by the opposite rotation vector; the specific force is the same, and its
    velocity and distance are in the axes of what was the end of the step.
    """
    steps = increments.shape[0]
    for i in range(steps):
        back = steps - 1 - i
        dt = increments[i, 0]
        x, y, z = increments[i, 1], increments[i, 2], increments[i, 3]
        w, bx, by, bz = quat_from_rotvec(x, y, z)
        ux, uy, uz = increments[i, 4], increments[i, 5], increments[i, 6]
        out[back, 0] = dt
        out[back, 1], out[back, 2], out[back, 3] = -x, -y, -z
        out[back, 4], out[back, 5], out[back, 6] = turn_back(w, bx, by, bz, ux, uy, uz)
        out[back, 7], out[back, 8], out[back, 9] = turn_back(
            w,
            bx,
            by,
            bz,
            ux * dt - increments[i, 7],
            uy * dt - increments[i, 8],
            uz * dt - increments[i, 9],
        )


@njit(cache=True)
def nav_numbers(row, out):
    """Numbers of a row with the longitude within half a turn and the quaternion of norm 1.

    Returns latitude, longitude and height, and whether the row is a state: finite, its latitude
    within a right angle, its quaternion of norm 1 to 1 %.
    """
    w, x, y, z, norm = unit_quat(row[Q], row[Q + 1], row[Q + 2], row[Q + 3])
    lat, lon, alt = row[LAT], wrap_pi(row[LON]), row[ALT]
    out[0], out[1], out[2] = lat, lon, alt
    out[3], out[4], out[5] = row[V], row[V + 1], row[V + 2]
    out[6], out[7], out[8], out[9] = w, x, y, z
    # So written NaN fails, too.
    near = abs(lat) <= 0.5 * math.pi and abs(lon) <= math.pi and abs(norm - 1.0) < 0.01
    return lat, lon, alt, near and math.isfinite(alt + row[V] + row[V + 1] + row[V + 2])


@njit(cache=True)
def trajectory_rows(history, out):
    """Latitude, longitude in deg, height, velocity, roll, pitch and heading in deg."""
    for k in range(history.shape[0]):
        out[k, 0], out[k, 1] = history[k, 0] * DEGREES, wrap_pi(history[k, 1]) * DEGREES
        for j in range(2, 6):
            out[k, j] = history[k, j]
        out[k, 6], out[k, 7], out[k, 8] = euler_degrees_from_quat(
            history[k, 6], history[k, 7], history[k, 8], history[k, 9]
        )
