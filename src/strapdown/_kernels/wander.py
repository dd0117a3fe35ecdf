"""Navigation in a wander azimuth on the ellipsoid: one step, and its loop.

Chernodarov 2009, Eqs. (1), (2), (4). Level axes w are xi, eta, zeta with zeta up; q_ew turns
vectors from w to the Earth's axes and so holds latitude, longitude and the wander angle; q_ib is
the attitude of the body in the inertial axes that were the Earth's at the start of the run. The
Earth's angle since then is kept as cosine and sine of its half. The attitude body to level is
``q_wb = conj(q_ew) conj(q_ie) q_ib``.

A step is integrated as in `ned`: in the axes w of its start, held fixed in inertial space; the new
position by geometry from a straight displacement; no transport rate is integrated. Nothing is
divided by the cosine of the latitude: the Earth's axis enters by its components in w, which are
regular everywhere. The level turns about a horizontal axis in each step; the azimuth that remains
after many steps has no physical meaning, as position, velocity and attitude share it.

The error of a run is of the fourth order of the step, except for a first-order part from the
gradients of gravity, which are exact to 1e-3: 1e-11 m/s² for steps of 1 s in an aircraft.

The sums over a run (the two quaternions and the Earth's angle) are compensated (Kahan 1965): a day
of steps of 1 ms loses nothing by rounding.
"""

from __future__ import annotations

import math

from strapdown._kernels.compilation import njit
from strapdown._kernels.earth import gravity_parts
from strapdown._kernels.ned import (
    DIVERGED,
    DONE,
    FREE,
    HIGHEST,
    LARGEST_TURN,
    LEAP,
    LOWEST,
    MODE,
    SIXTH,
    SPEED,
    SPRING,
    TAU,
    TWELFTH,
    guide_height,
    rotate,
    turn_back,
    within,
)
from strapdown._kernels.rotation import dcm_from_quat, quat_from_rotvec, quat_multiply

# Indices of the state: quaternion w to Earth, height in m, velocity in w in m/s, quaternion body to
# w; quaternion body to inertial; rounding errors of the two summed quaternions; cosine and sine of
# half the Earth's angle and their rounding errors; the radius of the prime vertical over a; and the
# memory of the vertical loop, as `ned.PULL` and `ned.SINCE`.
Q_EW, ALT, V, Q_WB = 0, 4, 5, 8
Q_IB, LOW_EW, LOW_IB, SPIN, PRIME, PULL, SINCE = 12, 16, 20, 24, 28, 29, 30
STATE = 31
# Length of the part of the state that goes into the history.
ROW = 12

TWO_THIRDS = 2.0 / 3.0
THIRD = 1.0 / 3.0


@njit(cache=True, inline="always")
def add(high, low, more):
    """Sum, and its rounding error."""
    more += low
    total = high + more
    return total, more - (total - high)


@njit(cache=True, inline="always")
def half_turn(y):
    """Cosine less 1 and sine of a small angle."""
    y2 = y * y
    return -y2 * (0.5 - y2 * (1.0 / 24.0)), y * (1.0 - y2 * (SIXTH - y2 * (1.0 / 120.0)))


@njit(cache=True, inline="always")
def tilt_place(q, low, d, x, y):
    """Quaternion times (1 + d, x, y, 0), and its rounding error.

    No normalization is needed: d is exact to its own last digit.
    """
    w0, x0, y0, z0 = q
    w1, w2 = add(w0, low[0], d * w0 - (x0 * x + y0 * y))
    x1, x2 = add(x0, low[1], d * x0 + (w0 * x - z0 * y))
    y1, y2 = add(y0, low[2], d * y0 + (w0 * y + z0 * x))
    z1, z2 = add(z0, low[3], d * z0 + (x0 * y - y0 * x))
    return (w1, x1, y1, z1), (w2, x2, y2, z2)


@njit(cache=True, inline="always")
def turn_body(q, low, d, x, y, z):
    """Quaternion times (1 + d, x, y, z), normalized, and its rounding error.

    Only the part across q changes the rotation; along q, d may have the rounding of a number near
    1.
    """
    w0, x0, y0, z0 = q
    d += 0.5 * (1.0 - (w0 * w0 + x0 * x0 + y0 * y0 + z0 * z0))
    w1, w2 = add(w0, low[0], d * w0 - (x0 * x + y0 * y + z0 * z))
    x1, x2 = add(x0, low[1], d * x0 + (w0 * x + y0 * z - z0 * y))
    y1, y2 = add(y0, low[2], d * y0 + (w0 * y + z0 * x - x0 * z))
    z1, z2 = add(z0, low[3], d * z0 + (w0 * z + x0 * y - y0 * x))
    return (w1, x1, y1, z1), (w2, x2, y2, z2)


@njit(cache=True, inline="always")
def body_to_level(q_ew, c, s, q_ib):
    """Quaternion q_wb from q_ew, the half angle of the Earth and the attitude in inertial axes."""
    w, x, y, z = q_ib
    return quat_multiply(
        q_ew[0],
        -q_ew[1],
        -q_ew[2],
        -q_ew[3],
        c * w + s * z,
        c * x + s * y,
        c * y - s * x,
        c * z - s * w,
    )


@njit(cache=True, error_model="numpy", inline="always")
def wander_step(
    q_ew, low_ew, alt, v, q_wb, q_ib, low_ib, spin, w, dt, phi, dv, dr, a, e2, gamma, k, rate, f, m
):
    """State after a step of motion increments, and the squared tangent of the level's tilt."""
    px, py, pz = earth_axis(q_ew[0], q_ew[1], q_ew[2], q_ew[3])
    s2 = pz * pz
    # One Newton step from its value a step before, as in `ned`.
    w = w * (1.5 - 0.5 * (1.0 - e2 * s2) * w * w)
    far, slope, across, curvature = curving(w, alt, a, e2)
    per = e2 * slope * curvature
    along = per * across
    c11, c12, c13, c21, c22, c23, c31, c32, c33 = dcm_from_quat(q_wb[0], q_wb[1], q_wb[2], q_wb[3])
    ux, uy, uz = rotate(c11, c12, c13, c21, c22, c23, c31, c32, c33, dv[0], dv[1], dv[2])
    sx, sy, sz = rotate(c11, c12, c13, c21, c22, c23, c31, c32, c33, dr[0], dr[1], dr[2])
    lean, down, steep, loss, loss2 = gravity_parts(s2, alt, w, curvature, a, e2, gamma, k, f, m)
    vx, vy, vz = v
    ox, oy, oz = rate * px, rate * py, rate * pz
    outward = -lean * alt * pz
    gx, gy, gz = outward * px, outward * py, -down

    # Mean displacement over the step, by Hermite's cubic through its two ends; as the force turns
    # with the plumb line, which it meets, so must gravity.
    half = 0.5 * dt
    twelfth = TWELFTH * dt
    sixth = SIXTH * dt * dt
    lift = ox * vy - oy * vx
    swing = 0.25 * dt * gz
    veer_x, veer_y = oy * vz - oz * vy, oz * vx - ox * vz
    mx = half * vx + 0.5 * sx - twelfth * ux
    my = half * vy + 0.5 * sy - twelfth * uy
    mx += sixth * (gx - veer_x + swing * (oy + across * vx))
    my += sixth * (gy - veer_y - swing * (ox - across * vy))
    mz = half * vz + 0.5 * sz - twelfth * uz + sixth * (gz - lift)

    # Effect of the climb and the change of curvature on the normal, as in `shift`, at the velocity
    # of the start: the mean of the square of time is a third.
    north = px * vx + py * vy
    sine = curvature * north
    pull = per * north
    u = (vz + pull * pz) * across
    qx, qy = (vx + pull * px) * across, (vy + pull * py) * across
    more = -(u * sine + 0.5 * pz * (qx * qx + qy * qy))
    bend = 1.5 * e2 * w * w * pz * sine * sine
    pull = along * far * (more + bend)
    third = THIRD * dt * dt
    bent_x, bent_y = third * (pull * px - u * qx), third * (pull * py - u * qy)

    # Mean change of the normal, and gravity at the mean position. Over the Earth the body is turned
    # back by its rate.
    ex, ey = mx - sixth * veer_x, my - sixth * veer_y
    toward = along * (px * ex + py * ey)
    nx, ny = across * ex + toward * px + bent_x, across * ey + toward * py + bent_y
    north = px * nx + py * ny
    rise = TWO_THIRDS * (mx * nx + my * ny) + mz - sixth * lift
    inward = lean * (alt * north + rise * pz)
    level = lean * alt * s2
    more_x = level * nx - inward * px
    more_y = level * ny - inward * py
    # Down gravity goes with the square of the sine, which a tilt changes to its second order too.
    tilted = pz * north + TWO_THIRDS * (north * north - s2 * (nx * nx + ny * ny))
    more_z = -(steep * tilted + rise * (loss + rise * loss2))
    gx += more_x
    gy += more_y
    gz += more_z
    # The level's change is in axes that the Earth has turned: twice as much of the product of the
    # two as in the square of their sum.
    zz = half * oz
    zx = half * ox - (ny + TWO_THIRDS * zz * nx)
    zy = half * oy + (nx - TWO_THIRDS * zz * ny)
    # Of turn and change, too, the product grows with the square of time.
    grown = gz + THIRD * more_z
    second = TWO_THIRDS * gz
    turn_x = zy * grown - zz * gy + second * zx * zz
    turn_y = zz * gx - zx * grown + second * zy * zz
    turn_z = zx * gy - zy * gx - second * (zx * zx + zy * zy)
    dt2 = dt * dt
    rx = dt * (vx - (oy * mz - oz * my)) + sx + dt2 * (0.5 * gx - SIXTH * more_x + THIRD * turn_x)
    ry = dt * (vy - (oz * mx - ox * mz)) + sy + dt2 * (0.5 * gy - SIXTH * more_y + THIRD * turn_y)
    rz = dt * (vz - (ox * my - oy * mx)) + sz + dt2 * (0.5 * gz - SIXTH * more_z + THIRD * turn_z)
    # The Earth's rate times the displacement.
    xx, xy, xz = oy * rz - oz * ry, oz * rx - ox * rz, ox * ry - oy * rx
    wx = vx + ux + dt * (gx + turn_x) - xx
    wy = vy + uy + dt * (gy + turn_y) - xy
    wz = vz + uz + dt * (gz + turn_z) - xz

    # Relative to the Earth: turned back by its rate, r - o x (int t dr - o x r dt²/6).
    bx = dt * (rx - mx) - sixth * xx
    by = dt * (ry - my) - sixth * xy
    bz = dt * (rz - mz) - sixth * xz
    tx, ty, t2, up = shift(
        px,
        py,
        pz,
        w,
        far,
        slope,
        across,
        curvature,
        e2,
        rx - (oy * bz - oz * by),
        ry - (oz * bx - ox * bz),
        rz - (ox * by - oy * bx),
    )

    # The velocity is turned back by the Earth's turn and then by the level's.
    yd, ys = half_turn(0.5 * rate * dt)
    wx, wy, wz = turn_back(1.0 + yd, ys * px, ys * py, ys * pz, wx, wy, wz)
    fd, fx, fy = tilt(tx, ty, t2)
    vx, vy, vz = level_with(tx, ty, t2, wx, wy, wz)
    q_ew, low_ew = tilt_place(q_ew, low_ew, fd, fx, fy)
    bw, b1, b2, b3 = quat_from_rotvec(phi[0], phi[1], phi[2])
    q_ib, low_ib = turn_body(q_ib, low_ib, bw - 1.0, b1, b2, b3)
    c, low_c = add(spin[0], spin[2], yd * spin[0] - ys * spin[1])
    s, low_s = add(spin[1], spin[3], yd * spin[1] + ys * spin[0])
    return (
        q_ew,
        low_ew,
        alt + up,
        (vx, vy, vz),
        body_to_level(q_ew, c, s, q_ib),
        q_ib,
        low_ib,
        (c, s, low_c, low_s),
        w,
        t2,
    )


@njit(cache=True, inline="always")
def four(state, at):
    return state[at], state[at + 1], state[at + 2], state[at + 3]


@njit(cache=True, inline="always")
def put(state, at, numbers):
    for j in range(len(numbers)):
        state[at + j] = numbers[j]


@njit(cache=True, inline="always")
def put_state(state, q_ew, low_ew, alt, v, q_wb, q_ib, low_ib, spin, w, pull, since):
    put(state, Q_EW, q_ew)
    state[ALT] = alt
    put(state, V, v)
    put(state, Q_WB, q_wb)
    put(state, Q_IB, q_ib)
    put(state, LOW_EW, low_ew)
    put(state, LOW_IB, low_ib)
    put(state, SPIN, spin)
    state[PRIME], state[PULL], state[SINCE] = w, pull, since


@njit(cache=True, inline="always")
def wander_verdict(alt, v, q_wb, q_ew, t2, speed, lowest, highest):
    """Whether this mechanization can continue from a state: `DONE` or the reason why not."""
    if not within(alt, v[0], v[1], v[2], q_wb[0], q_ew[0], speed, lowest, highest):
        return DIVERGED
    if t2 > LARGEST_TURN * LARGEST_TURN:
        return LEAP
    return DONE


@njit(cache=True, error_model="numpy")
def wander_advance(state, increments, reference, earth, options, history):
    """Advance over a segment, as `ned.ned_advance`; `history` takes the first twelve numbers."""
    q_ew, low_ew = four(state, Q_EW), four(state, LOW_EW)
    q_ib, low_ib = four(state, Q_IB), four(state, LOW_IB)
    q_wb, spin = four(state, Q_WB), four(state, SPIN)
    alt, v, w = state[ALT], (state[V], state[V + 1], state[V + 2]), state[PRIME]
    pull, since = state[PULL], state[SINCE]
    a, e2, gamma, k = earth[0], earth[1], earth[2], earth[3]
    rate, f, m = earth[4], earth[5], earth[6]
    mode, tau, spring = options[MODE], options[TAU], options[SPRING]
    speed, lowest, highest = options[SPEED], options[LOWEST], options[HIGHEST]
    steps = increments.shape[0]
    why = DONE
    made = steps
    for i in range(steps):
        dt = increments[i, 0]
        e1, e2_low, alt1, v1, b1, i1, i_low, spin1, w1, t2 = wander_step(
            q_ew,
            low_ew,
            alt,
            v,
            q_wb,
            q_ib,
            low_ib,
            spin,
            w,
            dt,
            (increments[i, 1], increments[i, 2], increments[i, 3]),
            (increments[i, 4], increments[i, 5], increments[i, 6]),
            (increments[i, 7], increments[i, 8], increments[i, 9]),
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
            alt1, vd, pull1, since1 = guide_height(
                alt1, -v1[2], pull, since, alt, height, dt, mode, tau, spring
            )
            v1 = (v1[0], v1[1], -vd)
        why = wander_verdict(alt1, v1, b1, e1, t2, speed, lowest, highest)
        if why != DONE:
            made = i
            break
        if mode != FREE:
            pull, since = pull1, since1
        q_ew, low_ew, alt, v, q_wb, q_ib, low_ib = e1, e2_low, alt1, v1, b1, i1, i_low
        spin, w = spin1, w1
        history[i, 0], history[i, 1], history[i, 2], history[i, 3] = q_ew
        history[i, ALT] = alt
        history[i, 5], history[i, 6], history[i, 7] = v
        history[i, 8], history[i, 9], history[i, 10], history[i, 11] = q_wb
    put_state(state, q_ew, low_ew, alt, v, q_wb, q_ib, low_ib, spin, w, pull, since)
    return made, why


# How the level lies on the ellipsoid, by the Earth's axis in its axes: regular at the poles.


@njit(cache=True, inline="always")
def earth_axis(w, x, y, z):
    """Components in w of the unit vector of the Earth's axis, from q_ew."""
    return 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w + z * z - (x * x + y * y)


@njit(cache=True, error_model="numpy", inline="always")
def curving(w, alt, a, e2):
    """N + h, the derivative of N s by s, and the curvatures across and along the meridian.

    N is the radius of the prime vertical, `w` that over a, s the sine of the latitude; the
    curvatures are those of the level surface at the height h.
    """
    prime = a * w
    slope = prime * w * w
    return prime + alt, slope, 1.0 / (prime + alt), 1.0 / (slope * (1.0 - e2) + alt)


@njit(cache=True, error_model="numpy", inline="always")
def shift(kx, ky, s, w, far, slope, across, curvature, e2, rx, ry, rz):
    """Tilt of the normal, as tangents along xi and eta, and rise, by a straight displacement r.

    A point of normal n and height h is ``(N + h) n - e² N s p``, p the Earth's axis and s = p . n.
    So the new normal is along ``(N + h) zeta + r + e² d p`` with d the change of N s, taken to
    third order in r: the remainder is of ``e² (r/R)⁴`` and ``e⁴ (r/R)³``. `far` is N + h; the
    others are as in `curving`.
    """
    north = kx * rx + ky * ry
    sine = curvature * north
    per = e2 * slope * curvature
    pull = per * north
    u = (rz + pull * s) * across
    tx, ty = (rx + pull * kx) * across, (ry + pull * ky) * across
    t2 = tx * tx + ty * ty
    lost = 0.5 * t2
    # The second and the third order of the change of s, but for what d's own have on it: that is
    # the factor (N + h) / (M + h).
    more = u * (u * sine + s * t2 - sine) - lost * (s + sine)
    sine += more
    bend = 1.5 * e2 * w * w * s * sine * sine
    pull = per * (north + far * (more + bend))
    u = (rz + pull * s) * across
    inverse = across * ((1.0 - u) * (1.0 + u * u))
    tx, ty = (rx + pull * kx) * inverse, (ry + pull * ky) * inverse
    t2 = tx * tx + ty * ty
    rise = rz + (far + rz + pull * s) * t2 * (0.5 - 0.125 * t2) - 0.5 * e2 * slope * sine * sine
    return tx, ty, t2, rise


@njit(cache=True, inline="always")
def tilt(tx, ty, t2):
    """Quaternion from the new w to the old one, less 1, of a tilt by tangents; its zeta is 0."""
    half = 0.5 - t2 * (0.1875 - 0.12109375 * t2)
    return -t2 * (0.125 - 0.0859375 * t2), -ty * half, tx * half


@njit(cache=True, inline="always")
def level_with(tx, ty, t2, x, y, z):
    """Vector in the new w, of one in the old, as `tilt` turns it; up to the sixth order."""
    less = 0.5 - 0.375 * t2
    along = tx * x + ty * y
    lean = z - t2 * less * z + less * along
    return x - tx * lean, y - ty * lean, (1.0 - t2 * less) * (z + along)
