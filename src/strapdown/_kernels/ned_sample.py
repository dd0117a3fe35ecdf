"""Navigation sample by sample: the same step, one sample a call."""

from __future__ import annotations

import math

from numba import njit

from strapdown._kernels.increments import LARGEST
from strapdown._kernels.motion_increments import linear_motion, mean_motion
from strapdown._kernels.ned import (
    COS_LATITUDE,
    DAMPED,
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
from strapdown._kernels.ned import STATE as WIDTH

# One float64 array holds everything between calls, because every further argument of a compiled
# function costs more than a part of the step: stamp, samples so far, whether samples are means,
# length of the step before, the longest step, the last sample, the Earth, the options, the state.
TIME, SAMPLES, MEAN, BEFORE, LONGEST, RATE, FORCE = 0, 1, 2, 3, 4, 5, 8
EARTH, OPTIONS, STATE = 11, 18, 25
SIZE = STATE + WIDTH

# What an update answers besides `DONE`, `POLE` and `DIVERGED` of the step.
BAD_SAMPLE, BAD_TIME, BAD_START, GAP, BAD_HEIGHT = -1, -2, -3, -4, -5


@njit(cache=True)
def usable(x, y, z):
    return abs(x) < LARGEST and abs(y) < LARGEST and abs(z) < LARGEST


@njit(cache=True, error_model="numpy")
def ned_update(r, time, gyro, accel, reference):
    """Take one sample; a sample that is refused leaves the record as it was."""
    if gyro.shape[0] != 3 or accel.shape[0] != 3 or not abs(time) < LARGEST:
        return BAD_SAMPLE
    # NaN is no reference; a reference is a number, and for a height that is damped by it.
    if not math.isnan(reference) and (r[OPTIONS] != DAMPED or not abs(reference) < LARGEST):
        return BAD_HEIGHT
    wx, wy, wz = gyro[0], gyro[1], gyro[2]
    fx, fy, fz = accel[0], accel[1], accel[2]
    if not (usable(wx, wy, wz) and usable(fx, fy, fz)):
        return BAD_SAMPLE
    dt = 0.0
    if r[SAMPLES] == 0.0:
        if not abs(time - r[TIME]) <= r[LONGEST]:
            return BAD_START
    else:
        dt = time - r[TIME]
        if dt <= 0.0:
            return BAD_TIME
        if dt > r[LONGEST]:
            return GAP
        if r[MEAN] != 0.0:
            before = r[BEFORE]
            if before == 0.0:
                before = dt
            px, py, pz, ux, uy, uz, sx, sy, sz = mean_motion(
                dt,
                before,
                r[RATE],
                r[RATE + 1],
                r[RATE + 2],
                wx,
                wy,
                wz,
                r[FORCE],
                r[FORCE + 1],
                r[FORCE + 2],
                fx,
                fy,
                fz,
            )
        else:
            px, py, pz, ux, uy, uz, sx, sy, sz = linear_motion(
                dt,
                r[RATE],
                r[RATE + 1],
                r[RATE + 2],
                wx,
                wy,
                wz,
                r[FORCE],
                r[FORCE + 1],
                r[FORCE + 2],
                fx,
                fy,
                fz,
            )
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
    r[TIME], r[BEFORE] = time, dt
    r[RATE], r[RATE + 1], r[RATE + 2] = wx, wy, wz
    r[FORCE], r[FORCE + 1], r[FORCE + 2] = fx, fy, fz
    r[SAMPLES] += 1.0
    return DONE
