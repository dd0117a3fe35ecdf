"""Navigation in local north-east-down as Tadic and Vukajlovic (2016) describe it, term by term.

Every step uses velocity, position and their rates at its start, and integrates the position by the
trapezoid: first order of the step in slow quantities. Terms that the paper omits, or says may be
omitted, are switches.
"""

from __future__ import annotations

import math

from strapdown._kernels.compilation import njit
from strapdown._kernels.earth import earth_rate, gravity_around, radii, transport_rate
from strapdown._kernels.ned import (
    COS_LATITUDE,
    DONE,
    FREE,
    HIGHEST,
    LOWEST,
    MODE,
    ROW,
    SPEED,
    SPRING,
    TAU,
    guide_height,
    verdict,
)
from strapdown._kernels.rotation import (
    dcm_from_quat,
    quat_from_rotvec,
    quat_multiply,
    quat_normalise,
)

# Indices of the state after the ten of the history: the vertical loop's, as in `ned`.
PULL, SINCE = 10, 11
STATE = 12


@njit(cache=True, error_model="numpy")
def simplified_advance(
    state,
    increments,
    reference,
    earth,
    options,
    coriolis,
    turning,
    transport,
    azimuth,
    fixed,
    history,
):
    """As `ned.ned_advance`; three switches are 1 or 0.

    `coriolis` is the second term of (1); `turning` and `transport` are the Earth's rate (7) and
    the transport rate (8), in the attitude and in that term. `azimuth` is 1, or -1 for the sign
    that the third component of (8) has in print; `fixed` is a gravity, or NaN for that of the
    position.
    """
    a, e2, gamma, k = earth[0], earth[1], earth[2], earth[3]
    rate, f, m = earth[4], earth[5], earth[6]
    mode, tau, spring = options[MODE], options[TAU], options[SPRING]
    limit, speed = options[COS_LATITUDE], options[SPEED]
    lowest, highest = options[LOWEST], options[HIGHEST]
    steps = increments.shape[0]
    for i in range(steps):
        lat, lon, alt, vn, ve, vd = state[0], state[1], state[2], state[3], state[4], state[5]
        qw, qx, qy, qz = state[6], state[7], state[8], state[9]
        dt = increments[i, 0]
        s, c = math.sin(lat), math.cos(lat)
        meridian, transverse = radii(s, a, e2)
        _, g, _, _, _, _, _ = gravity_around(
            s, c, alt, transverse / a, 1.0 / (meridian + alt), a, e2, gamma, k, f, m
        )
        if not math.isnan(fixed):
            g = fixed
        rm, rp = meridian + alt, transverse + alt
        on, od = earth_rate(s, c, turning * rate)
        tn, te, td = transport_rate(s, c, vn, ve, rm, rp)
        tn, te, td = transport * tn, transport * te, transport * azimuth * td
        # (3)-(6), the specific force of (1) integrated over the step.
        c11, c12, c13, c21, c22, c23, c31, c32, c33 = dcm_from_quat(qw, qx, qy, qz)
        ux, uy, uz = increments[i, 4], increments[i, 5], increments[i, 6]
        wn, we, wd = coriolis * (2.0 * on + tn), coriolis * te, coriolis * (2.0 * od + td)
        n1 = vn + c11 * ux + c12 * uy + c13 * uz - dt * (we * vd - wd * ve)
        e1 = ve + c21 * ux + c22 * uy + c23 * uz - dt * (wd * vn - wn * vd)
        d1 = vd + c31 * ux + c32 * uy + c33 * uz - dt * (wn * ve - we * vn) + dt * g
        # (9), by the trapezoid.
        mean_n, mean_e, mean_d = 0.5 * (vn + n1), 0.5 * (ve + e1), 0.5 * (vd + d1)
        turn = dt * mean_e / (rp * c)
        lat1 = lat + dt * mean_n / rm
        # (11)-(13): the body; (14)-(17): the level, conjugated, from the left.
        bw, bx, by, bz = quat_from_rotvec(increments[i, 1], increments[i, 2], increments[i, 3])
        bw, bx, by, bz = quat_multiply(qw, qx, qy, qz, bw, bx, by, bz)
        mw, mx, my, mz = quat_from_rotvec(-dt * (on + tn), -dt * te, -dt * (od + td))
        bw, bx, by, bz = quat_multiply(mw, mx, my, mz, bw, bx, by, bz)
        bw, bx, by, bz = quat_normalise(bw, bx, by, bz)
        height, pull, since = alt - dt * mean_d, state[PULL], state[SINCE]
        if mode != FREE:
            wanted = math.nan
            if reference.shape[0] > 0:
                wanted = reference[i]
            height, d1, pull, since = guide_height(
                height, d1, pull, since, alt, wanted, dt, mode, tau, spring
            )
        cosine = math.cos(lat1)
        why = verdict(height, n1, e1, d1, bw, cosine, turn, limit, speed, lowest, highest)
        if why != DONE:
            return i, why
        state[0], state[1], state[2] = lat1, lon + turn, height
        state[3], state[4], state[5] = n1, e1, d1
        state[6], state[7], state[8], state[9] = bw, bx, by, bz
        state[PULL], state[SINCE] = pull, since
        for j in range(ROW):
            history[i, j] = state[j]
    return steps, DONE
