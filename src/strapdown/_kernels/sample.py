"""A sample a call: the record between calls, and a sample as motion increments."""

from __future__ import annotations

import math

from numba import njit

from strapdown._kernels.increments import LARGEST
from strapdown._kernels.motion_increments import linear_motion, mean_motion
from strapdown._kernels.ned import DAMPED

# One float64 array holds everything between calls, because every further argument of a compiled
# function costs more than a part of the step: stamp, samples so far, whether samples are means,
# length of the step before, the longest step, the last sample, the Earth, the options, the state.
TIME, SAMPLES, MEAN, BEFORE, LONGEST, RATE, FORCE = 0, 1, 2, 3, 4, 5, 8
EARTH, OPTIONS, STATE = 11, 18, 25

# What an update answers besides `DONE`, `POLE`, `DIVERGED` and `LEAP` of the step.
BAD_SAMPLE, BAD_TIME, BAD_START, GAP, BAD_HEIGHT = -1, -2, -3, -4, -5
# A sample that is good, and the first: there is no step yet.
FIRST, STEP = 1, 0


@njit(cache=True)
def usable(x, y, z):
    return abs(x) < LARGEST and abs(y) < LARGEST and abs(z) < LARGEST


@njit(cache=True, error_model="numpy")
def look(r, time, gyro, accel, reference):
    """`STEP`, `FIRST`, or why a sample cannot be taken."""
    if gyro.shape[0] != 3 or accel.shape[0] != 3 or not abs(time) < LARGEST:
        return BAD_SAMPLE
    # NaN is no reference; a reference is a number, and for a height that is damped by it.
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
    """Keep a sample that was taken, for the next."""
    r[TIME], r[BEFORE] = time, dt
    r[RATE], r[RATE + 1], r[RATE + 2] = gyro[0], gyro[1], gyro[2]
    r[FORCE], r[FORCE + 1], r[FORCE + 2] = accel[0], accel[1], accel[2]
    r[SAMPLES] += 1.0
