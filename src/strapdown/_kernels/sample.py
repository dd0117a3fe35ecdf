"""Mechanizations sample by sample: the record between calls, and one sample as one step."""

from __future__ import annotations

import math

from strapdown._kernels.compilation import njit
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
from strapdown._kernels.wander import (
    ALT,
    LOW_EW,
    LOW_IB,
    PRIME,
    Q_EW,
    Q_IB,
    Q_WB,
    SPIN,
    V,
    four,
    put_state,
    wander_step,
    wander_verdict,
)
from strapdown._kernels.wander import PULL as WANDER_PULL
from strapdown._kernels.wander import SINCE as WANDER_SINCE

# One float64 array holds everything between calls, because every further argument of a compiled
# function costs more than a part of the step: stamp, samples so far, whether samples are means,
# length of the step before, the longest step, the last sample, the Earth, the options, the state.
TIME, SAMPLES, MEAN, BEFORE, LONGEST, RATE, FORCE = 0, 1, 2, 3, 4, 5, 8
EARTH, OPTIONS, STATE = 11, 18, 25

# Results of an update besides `DONE`, `POLE`, `DIVERGED` and `LEAP` of the step.
BAD_SAMPLE, BAD_TIME, BAD_START, GAP, BAD_HEIGHT = -1, -2, -3, -4, -5
# Accepted as the first sample, without a step; accepted with a step.
FIRST, STEP = 1, 0


@njit(cache=True)
def usable(x, y, z):
    return abs(x) < LARGEST and abs(y) < LARGEST and abs(z) < LARGEST


@njit(cache=True, error_model="numpy")
def look(r, time, gyro, accel, reference):
    """`STEP`, `FIRST`, or the reason to refuse a sample."""
    if gyro.shape[0] != 3 or accel.shape[0] != 3 or not abs(time) < LARGEST:
        return BAD_SAMPLE
    # NaN means no reference; a reference must be finite, and requires a damped height.
    if not math.isnan(reference) and (r[OPTIONS] != DAMPED or not abs(reference) < LARGEST):
        return BAD_HEIGHT
    if not (usable(gyro[0], gyro[1], gyro[2]) and usable(accel[0], accel[1], accel[2])):
        return BAD_SAMPLE
    if r[SAMPLES] == 0.0:
        return FIRST if abs(time - r[TIME]) <= r[LONGEST] else BAD_START
    dt = time - r[TIME]
    if dt <= 0.0:
        return BAD_TIME
    return GAP if dt > r[LONGEST] else STEP


@njit(cache=True, error_model="numpy", inline="always")
def increments_to(r, dt, gyro, accel):
    """Motion increments from the last sample to this one."""
    if r[MEAN] != 0.0:
        before = r[BEFORE]
        if before == 0.0:
            before = dt
        return mean_motion(
            dt,
            before,
            r[RATE],
            r[RATE + 1],
            r[RATE + 2],
            gyro[0],
            gyro[1],
            gyro[2],
            r[FORCE],
            r[FORCE + 1],
            r[FORCE + 2],
            accel[0],
            accel[1],
            accel[2],
        )
    return linear_motion(
        dt,
        r[RATE],
        r[RATE + 1],
        r[RATE + 2],
        gyro[0],
        gyro[1],
        gyro[2],
        r[FORCE],
        r[FORCE + 1],
        r[FORCE + 2],
        accel[0],
        accel[1],
        accel[2],
    )


@njit(cache=True, inline="always")
def keep(r, time, dt, gyro, accel):
    """Store an accepted sample for the next call."""
    r[TIME], r[BEFORE] = time, dt
    r[RATE], r[RATE + 1], r[RATE + 2] = gyro[0], gyro[1], gyro[2]
    r[FORCE], r[FORCE + 1], r[FORCE + 2] = accel[0], accel[1], accel[2]
    r[SAMPLES] += 1.0


@njit(cache=True, error_model="numpy")
def ned_update(r, time, gyro, accel, reference):
    """Process one sample; a refused sample leaves the record unchanged."""
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


@njit(cache=True, error_model="numpy")
def wander_update(r, time, gyro, accel, reference):
    """Process one sample; a refused sample leaves the record unchanged."""
    found = look(r, time, gyro, accel, reference)
    if found < STEP:
        return found
    dt = 0.0
    if found != FIRST:
        dt = time - r[TIME]
        px, py, pz, ux, uy, uz, sx, sy, sz = increments_to(r, dt, gyro, accel)
        e = EARTH
        q = r[STATE:]
        o = OPTIONS
        q_ew, low_ew, alt, v, q_wb, q_ib, low_ib, spin, w, t2 = wander_step(
            four(q, Q_EW),
            four(q, LOW_EW),
            q[ALT],
            (q[V], q[V + 1], q[V + 2]),
            four(q, Q_WB),
            four(q, Q_IB),
            four(q, LOW_IB),
            four(q, SPIN),
            q[PRIME],
            dt,
            (px, py, pz),
            (ux, uy, uz),
            (sx, sy, sz),
            r[e],
            r[e + 1],
            r[e + 2],
            r[e + 3],
            r[e + 4],
            r[e + 5],
            r[e + 6],
        )
        pull, since = q[WANDER_PULL], q[WANDER_SINCE]
        if r[o + MODE] != FREE:
            alt, vd, pull, since = guide_height(
                alt,
                -v[2],
                pull,
                since,
                q[ALT],
                reference,
                dt,
                r[o + MODE],
                r[o + TAU],
                r[o + SPRING],
            )
            v = (v[0], v[1], -vd)
        why = wander_verdict(alt, v, q_wb, q_ew, t2, r[o + SPEED], r[o + LOWEST], r[o + HIGHEST])
        if why != DONE:
            return why
        put_state(q, q_ew, low_ew, alt, v, q_wb, q_ib, low_ib, spin, w, pull, since)
    keep(r, time, dt, gyro, accel)
    return DONE
