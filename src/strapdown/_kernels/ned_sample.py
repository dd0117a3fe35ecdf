"""North-east-down sample by sample: the same step, one sample a call."""

from __future__ import annotations

from numba import njit

from strapdown._kernels.ned import (
    COS_LATITUDE,
    DONE,
    FREE,
    HIGHEST,
    LOWEST,
    MODE,
    PULL,
    SINCE,
    SPEED,
    SPRING,
    TAU,
    guide_height,
    ned_step,
    verdict,
)
from strapdown._kernels.sample import (
    EARTH,
    FIRST,
    OPTIONS,
    STATE,
    STEP,
    TIME,
    increments_to,
    keep,
    look,
)


@njit(cache=True, error_model="numpy")
def ned_update(r, time, gyro, accel, reference):
    """Take one sample; a sample that is refused leaves the record as it was."""
    found = look(r, time, gyro, accel, reference)
    if found < STEP:
        return found
    dt = 0.0
    if found != FIRST:
        dt = time - r[TIME]
        px, py, pz, ux, uy, uz, sx, sy, sz = increments_to(r, dt, gyro, accel)
        e = EARTH
        q = STATE
        o = OPTIONS
        lat, lon, alt, vn, ve, vd, qw, qx, qy, qz, s, c, w, turn = ned_step(
            r[q],
            r[q + 1],
            r[q + 2],
            r[q + 3],
            r[q + 4],
            r[q + 5],
            r[q + 6],
            r[q + 7],
            r[q + 8],
            r[q + 9],
            r[q + 10],
            r[q + 11],
            r[q + 12],
            dt,
            px,
            py,
            pz,
            ux,
            uy,
            uz,
            sx,
            sy,
            sz,
            r[e],
            r[e + 1],
            r[e + 2],
            r[e + 3],
            r[e + 4],
            r[e + 5],
            r[e + 6],
        )
        pull, since = r[q + PULL], r[q + SINCE]
        mode, tau, spring = r[o + MODE], r[o + TAU], r[o + SPRING]
        limit, speed = r[o + COS_LATITUDE], r[o + SPEED]
        if mode != FREE:
            alt, vd, pull, since = guide_height(
                alt, vd, pull, since, r[q + 2], reference, dt, mode, tau, spring
            )
        why = verdict(alt, vn, ve, vd, qw, c, turn, limit, speed, r[o + LOWEST], r[o + HIGHEST])
        if why != DONE:
            return why
        r[q], r[q + 1], r[q + 2], r[q + 3], r[q + 4], r[q + 5] = lat, lon, alt, vn, ve, vd
        r[q + 6], r[q + 7], r[q + 8], r[q + 9] = qw, qx, qy, qz
        r[q + 10], r[q + 11], r[q + 12] = s, c, w
        r[q + PULL], r[q + SINCE] = pull, since
    keep(r, time, dt, gyro, accel)
    return DONE
