"""The loop of `error_loop` with fixes of a satellite receiver whose errors are its noise alone."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from strapdown._kernels.covariance import dense_update
from strapdown._kernels.earth import E2, RATE, A
from strapdown._kernels.error_loop import (
    ALL,
    AT_COVARIANCE,
    AT_STEP,
    BAD,
    FULL,
    PLAIN,
    UD,
    WD,
    close_group,
    over_steps,
)
from strapdown._kernels.factored_update import ud_update, wd_epoch
from strapdown._kernels.factors import udu_matrix
from strapdown._kernels.geodetic import displacement
from strapdown._kernels.level_place import WANDER, level_place
from strapdown._kernels.ned import COSINE, LAT, PRIME, SINE
from strapdown._kernels.ned import Q as Q_NB
from strapdown._kernels.ned import V as V_N
from strapdown._kernels.ned_level import ned_correct
from strapdown._kernels.rotation import dcm_from_quat
from strapdown._kernels.rotation_vector import cross
from strapdown._kernels.smoothing_rows import (
    UPDATE,
    begin_of_move,
    begin_of_taken,
    head_row,
    pack_covariance,
)
from strapdown._kernels.split_increment import split_increment
from strapdown._kernels.wander import Q_WB
from strapdown._kernels.wander import V as V_W
from strapdown._kernels.wander_geometry import earth_axis
from strapdown._kernels.wander_level import wander_correct

# Of a fix: what it is of, three numbers, three variances.
CODE, VALUE, VARIANCE = 0, 1, 4
# What an observation tells: innovation, its expected variance, weight.
TOLD = 3
# An observation that is none; beside what became of a call in `error_loop`.
BAD_FIX = 5


@njit(cache=True, error_model="numpy")
def swept(which, state, earth, gyro_terms, last, c, x, y, w, speed, h):
    """Add to a velocity, and to its dependence on the errors, what an arm adds; level axes.

    ``W x r`` of the arm r = (x, y, w), with ``W = C w_ib - w_ie`` the rate of the body relative to
    the Earth; `c` is C_lb, `last` the newest increment.
    """
    if which == WANDER:
        kx, ky, kz = earth_axis(state[0], state[1], state[2], state[3])
    else:
        kx, ky, kz = state[COSINE], 0.0, -state[SINE]
    p, q, r = last[1] / last[0], last[2] / last[0], last[3] / last[0]
    ix = c[0] * p + c[1] * q + c[2] * r
    iy = c[3] * p + c[4] * q + c[5] * r
    iz = c[6] * p + c[7] * q + c[8] * r
    wx, wy, wz = ix - earth[RATE] * kx, iy - earth[RATE] * ky, iz - earth[RATE] * kz
    sx, sy, sz = cross(wx, wy, wz, x, y, w)
    speed[0] += sx
    speed[1] += sy
    speed[2] += sz
    for j in range(3):
        # By a turn e_j: the arm by -r x e_j, the rate of the body by -(C w_ib) x e_j.
        ex, ey, ez = 1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2)
        ax, ay, az = cross(wx, wy, wz, *cross(x, y, w, ex, ey, ez))
        bx, by, bz = cross(x, y, w, *cross(ix, iy, iz, ex, ey, ez))
        h[0, 6 + j] += bx - ax
        h[1, 6 + j] += by - ay
        h[2, 6 + j] += bz - az
    for e in range(gyro_terms.shape[0]):
        m, axis, j = int(gyro_terms[e, 0]), int(gyro_terms[e, 1]), 9 + int(gyro_terms[e, 2])
        weight = gyro_terms[e, 3]
        if m > 0:
            weight *= last[m] / last[0]
        dx, dy, dz = cross(x, y, w, c[axis], c[3 + axis], c[6 + axis])
        h[0, j] -= weight * dx
        h[1, j] -= weight * dy
        h[2, j] -= weight * dz


@njit(cache=True, error_model="numpy")
def meet_fix(which, state, earth, gyro_terms, last, arm, of_place, fix, turn, z, h, H, R):
    """Fill the observation of a fix of an antenna: computed less measured, north, east, down.

    `arm` is that of the antenna, body axes; `h` is room to work in, as large as H.
    """
    q_at, v_at = (Q_WB, V_W) if which == WANDER else (Q_NB, V_N)
    lat, lon, alt = level_place(which, state, turn)
    c = dcm_from_quat(state[q_at], state[q_at + 1], state[q_at + 2], state[q_at + 3])
    x = c[0] * arm[0] + c[1] * arm[1] + c[2] * arm[2]
    y = c[3] * arm[0] + c[4] * arm[1] + c[5] * arm[2]
    w = c[6] * arm[0] + c[7] * arm[1] + c[8] * arm[2]
    for i in range(3):
        R[i] = fix[VARIANCE + i]
        for j in range(h.shape[1]):
            h[i, j] = 0.0
    told = np.empty(3)
    if of_place:
        told[0], told[1], told[2] = x, y, w
        z[0], z[1], z[2] = displacement(
            lat, lon, alt, fix[VALUE], fix[VALUE + 1], fix[VALUE + 2], earth[A], earth[E2]
        )
        h[0, 0] = h[1, 1] = h[2, 2] = 1.0
        # -[arm x]
        h[0, 7], h[0, 8] = w, -y
        h[1, 6], h[1, 8] = -w, x
        h[2, 6], h[2, 7] = y, -x
    else:
        for i in range(3):
            told[i] = state[v_at + i]
            z[i] = -fix[VALUE + i]
            h[i, 3 + i] = 1.0
        if x != 0.0 or y != 0.0 or w != 0.0:
            swept(which, state, earth, gyro_terms, last, c, x, y, w, told, h)
    for i in range(3):
        for j in range(3):
            z[i] += turn[i, j] * told[j]
        for j in range(H.shape[1]):
            H[i, j] = turn[i, 0] * h[0, j] + turn[i, 1] * h[1, j] + turn[i, 2] * h[2, j]


@njit(cache=True, error_model="numpy")
def take_off(which, state, sensors, earth, x):
    """Take an estimate off a state and add it to those of the sensors."""
    if which == WANDER:
        wander_correct(state, x[:9], earth)
    else:
        ned_correct(state, x[:9], earth)
        s = math.sin(state[LAT])
        state[SINE], state[COSINE] = s, math.cos(state[LAT])
        state[PRIME] = 1.0 / math.sqrt(1.0 - earth[E2] * s * s)
    for j in range(sensors.shape[0]):
        sensors[j] += x[9 + j]


@njit(cache=True, error_model="numpy")
def mark(form, same_axes, covariance, sensors, turn, P, marked, marked_sensors, marked_sd):
    """Fill a mark: covariance of nine in north-east-down, estimates, and their deviations."""
    if form >= UD:
        udu_matrix(covariance, P)
    else:
        for i in range(P.shape[0]):
            for j in range(P.shape[1]):
                P[i, j] = covariance[i, j]
    for a in range(0, 9, 3):
        for b in range(0, 9, 3):
            if same_axes:
                for i in range(3):
                    for j in range(3):
                        marked[a + i, b + j] = P[a + i, b + j]
                continue
            for i in range(3):
                for j in range(3):
                    total = 0.0
                    for m in range(3):
                        for k in range(3):
                            total += turn[i, m] * P[a + m, b + k] * turn[j, k]
                    marked[a + i, b + j] = total
    for j in range(sensors.shape[0]):
        marked_sensors[j] = sensors[j]
        marked_sd[j] = math.sqrt(P[9 + j, 9 + j])


@njit(cache=True, error_model="numpy")
def over_fixes(
    kinds,
    model,
    states,
    group,
    count,
    room,
    step,
    note_at,
    interval,
    time,
    rows,
    history,
    made,
    notes,
    noted,
    same,
    arm,
    place_code,
    fix_time,
    fixes,
    told,
    marked_at,
    marked,
    marked_sensors,
    marked_sd,
):
    """Go over steps and fixes, to the end of either, where so many steps are made already.

    `rows` are changed where a fix cuts a step. Return what became of it, the steps made, those of
    the open group, the fixes taken, and the rows filled for a smoother; where a covariance is to be
    noted, or these rows are full, it ends as `over_steps`.
    An instant within `same` seconds of another is the same.
    """
    which, form, _ = kinds
    state, at_covariance, covariance, sensors, times, last = states
    open_history, _ = group
    earth = model[6]
    n, size = 9 + sensors.shape[0], covariance.shape[0]
    x, z, R = np.empty(size), np.empty(3), np.empty(3)
    h, H = np.empty((3, size)), np.empty((3, size))
    turn, P, after = np.empty((3, 3)), np.empty((n, n)), np.empty((size, size))
    cut = np.empty((2, rows.shape[1]))
    between = np.empty((1, history.shape[1]))
    done, total = 0, time.shape[0]
    while done < fix_time.shape[0]:
        epoch = fix_time[done]
        if epoch > times[AT_STEP] + same:
            if made == total:
                break
            end = made
            while end < total and time[end] < epoch - same:
                end += 1
            inside = end < total and time[end] > epoch + same
            if not inside:
                end = min(end + 1, total)
            why, went, count, noted = over_steps(
                kinds,
                model,
                states,
                group,
                count,
                room,
                step,
                note_at,
                time[made:end],
                rows[made:end],
                history[made:end],
                notes,
                noted,
            )
            made += went
            if why != ALL:
                return why, made, count, done, noted
            if inside:
                split_increment(rows[end], epoch - times[AT_STEP], cut[0], cut[1])
                why, went, count, noted = over_steps(
                    kinds,
                    model,
                    states,
                    group,
                    count,
                    room,
                    step,
                    note_at,
                    fix_time[done : done + 1],
                    cut[:1],
                    between,
                    notes,
                    noted,
                )
                if went == 1:
                    for j in range(rows.shape[1]):
                        rows[end, j] = cut[1, j]
                if why != ALL:
                    return why, made, count, done, noted
            continue
        if notes.shape[0] > 0 and noted + 2 > notes.shape[0]:
            return FULL, made, count, done, noted
        bad, noted = close_group(kinds, model, states, group, count, room[0], notes, noted)
        count = 0
        if bad >= 0:
            return BAD, made, count, done, noted
        of_place = fixes[done, CODE] == place_code
        meet_fix(which, state, earth, model[0], last, arm, of_place, fixes[done], turn, z, h, H, R)
        for j in range(size):
            x[j] = 0.0
        for j in range(3):
            told[done, 2, j] = 1.0
        if notes.shape[0] > 0:
            pack_covariance(form >= UD, covariance, P, notes[noted], begin_of_move(n))
        if form == UD:
            wrong = ud_update(covariance, x, z, H, R, told[done])
        elif form == WD:
            wrong = wd_epoch(
                covariance, covariance, covariance, False, x, z, H, R, told[done], after
            )
            for i in range(size):
                for j in range(size):
                    covariance[i, j] = after[i, j]
        else:
            wrong = dense_update(covariance, x, z, H, R, form != PLAIN, told[done])
        if wrong != -1:
            return BAD_FIX, made, count, done, noted
        take_off(which, state, sensors, earth, x)
        level_place(which, state, turn)
        if notes.shape[0] > 0:
            head_row(which, form >= UD, states, times[AT_STEP], UPDATE, P, notes[noted])
            for j in range(n):
                notes[noted, begin_of_taken(n) + j] = x[j]
            noted += 1
        marked_at[done] = times[AT_STEP]
        mark(
            form,
            which != WANDER,
            covariance,
            sensors,
            turn,
            P,
            marked[done],
            marked_sensors[done],
            marked_sd[done],
        )
        for j in range(open_history.shape[1]):
            open_history[0, j] = state[j]
        for j in range(state.shape[0]):
            at_covariance[j] = state[j]
        if made > 0 and times[AT_STEP] <= time[made - 1] + same:
            for j in range(history.shape[1]):
                history[made - 1, j] = state[j]
        note_at = times[AT_COVARIANCE] + interval
        done += 1
    return ALL, made, count, done, noted
