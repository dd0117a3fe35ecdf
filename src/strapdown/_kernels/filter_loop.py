"""Filter loop: a mechanization and the covariance of its errors, over steps and GNSS fixes.

Steps are grouped up to a given time: the mechanization advances step by step, the covariance group
by group. An open group is kept at the end of a chunk, so that a log may be cut anywhere.
"""

from __future__ import annotations

import math

import numpy as np

from strapdown._kernels.antenna import POSITION, VELOCITY, antenna
from strapdown._kernels.compensation import compensate, errors_of_states
from strapdown._kernels.compilation import IN_PLACE, njit
from strapdown._kernels.covariance import dense_update, ud_update, udu_matrix, wd_epoch
from strapdown._kernels.earth import E2, A, displacement
from strapdown._kernels.growth import grown_covariance, grown_factors, growth_of_step
from strapdown._kernels.level import (
    LEVEL,
    WANDER,
    level_place,
    ned_correct,
    ned_levels,
    state_error,
    wander_correct,
    wander_levels,
    wander_places,
)
from strapdown._kernels.motion_increments import split_increment
from strapdown._kernels.ned import COSINE, LAT, PRIME, SINE, ned_advance
from strapdown._kernels.ned import Q as Q_NB
from strapdown._kernels.psi_model import HELD_ROWS, means_of_steps, psi_dynamics
from strapdown._kernels.robust import PLAIN, UD, WD, take_by_steps
from strapdown._kernels.smoothing import (
    CARRIED,
    CORE,
    GROWTH,
    KIND,
    UPDATE,
    begin_of_move,
    begin_of_taken,
    head_row,
    move_by_growth,
    pack_covariance,
)
from strapdown._kernels.wander import Q_WB, wander_advance

# Status of a call: done; a covariance is due to be recorded; the mechanization diverged; the
# covariance is invalid; the rows for a smoother are full.
ALL, NOTE, DIVERGED, BAD, FULL = 0, 1, 2, 3, 4
# Indices of the times of a loop: of the covariance, of the newest step.
AT_COVARIANCE, AT_STEP = 0, 1
# Largest ratio of a group's length to its nominal time.
BEYOND = 1.000001


# Arguments that belong together:
# - kinds: (mechanization, form, whether the height is held);
# - model: (terms of gyros, terms of accelerometers, decay, drive, noise of gyros
#   and of accelerometers (3,), earth, options);
# - states: (mechanization, the same at the covariance, covariance, sensors, times, newest increment
#   without errors), which go on in place;
# - group: (rows of the history, the first at its start; increments), of what is not closed yet;
# - room: arrays to work in.
# For a smoother every propagation goes into the rows of `notes` (`smoothing`), of which `noted` are
# filled; otherwise `notes` is empty.


@njit(**IN_PLACE)
def growth_of_group(kinds, model, states, group, count, room):
    """Fill transition and noise over the steps of a group."""
    which, _, held = kinds
    gyro_terms, accel_terms, decay, drive, gyro_noise, accel_noise, earth, _ = model
    open_history, open_rows = group
    f, growth, work, matrix, level, _, _, _ = room
    q_at, up = Q_NB, -1.0
    if which == WANDER:
        q_at, up = Q_WB, 1.0
    _, dt = means_of_steps(open_history, q_at, open_rows[:count], 0, math.inf, matrix)
    middle = count // 2
    if which == WANDER:
        wander_levels(open_history[middle : middle + 1], earth, level)
    else:
        ned_levels(open_history[middle : middle + 1], earth, level)
    psi_dynamics(
        f,
        level[0],
        up,
        matrix,
        matrix[3],
        matrix[4],
        matrix[5],
        gyro_terms,
        accel_terms,
        held,
        earth,
    )
    still = HELD_ROWS if held else 0
    growth_of_step(f, decay, dt, matrix, gyro_noise, accel_noise, drive, still, growth, work)


@njit(**IN_PLACE)
def matrix_over_group(states, room):
    """Propagate a covariance matrix over a group; return -1, or the first invalid state."""
    return grown_covariance(states[2], room[1], room[2])


@njit(**IN_PLACE)
def factors_over_group(states, room):
    """Propagate the factors of a covariance over a group; return -1, or the first invalid state."""
    return grown_factors(states[2], room[1], room[2], room[6], room[7])


@njit(**IN_PLACE)
def begin_group(states, group, count, room):
    """Begin a group where one of `count` steps ended."""
    state, at_covariance, _, sensors, times, _ = states
    open_history, _ = group
    _, _, _, tail, _ = room[1]
    for j in range(state.shape[0]):
        at_covariance[j] = state[j]
    for j in range(sensors.shape[0]):
        sensors[j] *= tail[j]
    for j in range(open_history.shape[1]):
        open_history[0, j] = open_history[count, j]
    times[AT_COVARIANCE] = times[AT_STEP]


@njit(cache=True, error_model="numpy")
def close_group(kinds, model, states, group, count, room, notes, noted):
    """Propagate the covariance over the steps of a group.

    The covariance is (n, n), a matrix or its factors. Return -1, or the first invalid state, and
    the number of filled rows.
    """
    if count == 0:
        return -1, noted
    growth_of_group(kinds, model, states, group, count, room)
    factored = kinds[1] >= UD
    bad = factors_over_group(states, room) if factored else matrix_over_group(states, room)
    begin_group(states, group, count, room)
    if bad < 0 and notes.shape[0] > 0:
        row, time = notes[noted], states[4][AT_COVARIANCE]
        head_row(kinds[0], factored, states, time, GROWTH, room[5], row)
        move_by_growth(room[1], row, states[2].shape[0])
        noted += 1
    return bad, noted


@njit(cache=True, error_model="numpy")
def over_steps(
    kinds,
    model,
    states,
    group,
    count,
    room,
    step,
    note_at,
    time,
    rows,
    history,
    notes,
    noted,
):
    """Advance over steps; return the status, steps made, those of the open group, rows filled.

    `time` are the ends of the steps, `rows` their increments; `history` takes a row after each.
    The call ends early where a group was closed at `note_at` or later. After the arrays of
    `close_group`, `room` has errors of readings, (7, 3) each, and empty heights.
    """
    gyro_terms, accel_terms, _, _, _, _, earth, options = model
    state, _, _, sensors, times, newest = states
    open_history, open_rows = group
    closing, of_gyros, of_accels, heights = room
    made = 0
    total = time.shape[0]
    while made < total:
        end = made
        begun = times[AT_COVARIANCE]
        while (
            end < total
            and count + end - made < open_rows.shape[0]
            and (time[end] - begun <= step * BEYOND or count + end - made == 0)
        ):
            end += 1
        if end == made:
            if 0 < notes.shape[0] <= noted:
                return FULL, made, count, noted
            bad, noted = close_group(kinds, model, states, group, count, closing, notes, noted)
            count = 0
            if bad >= 0:
                return BAD, made, bad, noted
            if times[AT_COVARIANCE] >= note_at:
                return NOTE, made, count, noted
            continue
        errors_of_states(gyro_terms, sensors, of_gyros)
        errors_of_states(accel_terms, sensors, of_accels)
        last = count + end - made
        new, into = open_rows[count:last], open_history[count + 1 : last + 1]
        compensate(rows[made:end], of_gyros, of_accels, new)
        if kinds[0] == WANDER:
            went, why = wander_advance(state, new, heights, earth, options, into)
        else:
            went, why = ned_advance(state, new, heights, earth, options, into)
        if why != 0:
            return DIVERGED, made + went, count, noted
        for i in range(made, end):
            for j in range(history.shape[1]):
                history[i, j] = open_history[count + 1 + i - made, j]
        count = last
        made = end
        times[AT_STEP] = time[end - 1]
        for j in range(newest.shape[0]):
            newest[j] = open_rows[last - 1, j]
    return ALL, made, count, noted


# The loop with fixes of a GNSS receiver whose errors are white noise.


# Layout of a fix: kind, three numbers, three variances.
CODE, VALUE, VARIANCE = 0, 1, 4
# Record of an observation: innovation, its expected variance, weight.
TOLD = 3
# Status of an invalid observation, and of one beyond the linear range of its rule.
BAD_FIX, ASK = 5, 6


@njit(cache=True, error_model="numpy")
def meet_fix(which, row, state, earth, gyro_terms, last, arm, of_place, fix, room, z, H, R):
    """Fill the observation of an antenna's fix: computed - measured, north, east, down.

    `row`: of the history, (1, row). `arm` is that of the antenna, body axes. `room`: arrays to work
    in, the first of which is filled with C_nl, level to north-east-down.
    """
    turn, level, felt, value, derivative = room
    up, upto = -1.0, POSITION if of_place else VELOCITY
    if which == WANDER:
        up = 1.0
        wander_levels(row, earth, level)
    else:
        ned_levels(row, earth, level)
    lat, lon, alt = level_place(which, state, turn)
    for i in range(6):
        felt[i] = last[1 + i] / last[0]
    antenna(
        level[0], up, earth, arm, -1, gyro_terms, gyro_terms, felt, felt, upto, value, derivative
    )
    if of_place:
        z[0], z[1], z[2] = displacement(
            lat, lon, alt, fix[VALUE], fix[VALUE + 1], fix[VALUE + 2], earth[A], earth[E2]
        )
    for i in range(3):
        if not of_place:
            z[i] = -fix[VALUE + i]
        R[i] = fix[VARIANCE + i]
        for j in range(3):
            z[i] += turn[i, j] * value[upto, j]
        for j in range(H.shape[1]):
            total = 0.0
            for k in range(3):
                total += turn[i, k] * derivative[upto, k, j]
            H[i, j] = total


@njit(cache=True, error_model="numpy")
def take_off(which, state, sensors, earth, x):
    """Remove an estimate from a state and add it to the sensor errors."""
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
def turn_blocks(turn, P, out):
    """Fill the covariance (9, 9) of three vectors, rotated by one matrix (3, 3)."""
    for a in range(0, 9, 3):
        for b in range(0, 9, 3):
            for i in range(3):
                for j in range(3):
                    total = 0.0
                    for m in range(3):
                        for k in range(3):
                            total += turn[i, m] * P[a + m, b + k] * turn[j, k]
                    out[a + i, b + j] = total


@njit(cache=True, error_model="numpy")
def mark(form, same_axes, covariance, sensors, turn, P, marked, marked_sensors, marked_sd):
    """Fill a snapshot: covariance of nine errors in NED, estimates, standard deviations."""
    if form >= UD:
        udu_matrix(covariance, P)
    else:
        for i in range(P.shape[0]):
            for j in range(P.shape[1]):
                P[i, j] = covariance[i, j]
    if same_axes:
        for i in range(9):
            for j in range(9):
                marked[i, j] = P[i, j]
    else:
        turn_blocks(turn, P, marked)
    for j in range(sensors.shape[0]):
        marked_sensors[j] = sensors[j]
        marked_sd[j] = math.sqrt(P[9 + j, 9 + j])


# A filter about a reference: the state follows it, and the estimated errors are kept beside.


@njit(cache=True, error_model="numpy")
def carry_errors(notes, carried, noted, errors, left):
    """Propagate errors over the rows from one to another, and fill those of the state at each."""
    n = errors.shape[0]
    at = begin_of_move(n)
    grown = np.empty(n)
    for k in range(carried, noted):
        row = notes[k]
        if row[KIND] == GROWTH:
            for i in range(CORE):
                total = 0.0
                for j in range(n):
                    total += row[at + i * n + j] * errors[j]
                grown[i] = total
            for i in range(CORE, n):
                grown[i] = row[at + CORE * n + i - CORE] * errors[i]
            for i in range(n):
                errors[i] = grown[i]
        for i in range(CORE):
            left[k, i] = errors[i]


@njit(cache=True, error_model="numpy")
def follow(which, states, earth, reference, reference_sensors, turn, errors):
    """Move a state to a reference, (10,); what it is moved by goes to the errors.

    `reference`: as of `level.state_error`. `turn`, (3, 3), to work in.
    """
    state, sensors = states[0], states[3]
    n = errors.shape[0]
    own, apart, moved = np.empty((1, 10)), np.empty(9), np.empty(n)
    if which == WANDER:
        wander_places(state.reshape(1, state.shape[0]), own)
    else:
        for j in range(10):
            own[0, j] = state[j]
    state_error(own[0], reference, earth, apart)
    level_place(which, state, turn)
    for a in range(0, 9, 3):
        for i in range(3):
            total = 0.0
            for j in range(3):
                total += turn[j, i] * apart[a + j]
            moved[a + i] = total
    for j in range(sensors.shape[0]):
        moved[9 + j] = reference_sensors[j] - sensors[j]
    take_off(which, state, sensors, earth, moved)
    for j in range(n):
        errors[j] -= moved[j]


@njit(cache=True, error_model="numpy")
def go_on_from(state, open_history, at_covariance, history, row):
    """Begin a group of steps at a changed state; it is shown in a row, too, unless that is -1."""
    for j in range(open_history.shape[1]):
        open_history[0, j] = state[j]
    for j in range(state.shape[0]):
        at_covariance[j] = state[j]
    if row >= 0:
        for j in range(history.shape[1]):
            history[row, j] = state[j]


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
    rule,
    scales,
    steps,
    told,
    aged,
    marked_at,
    marked,
    marked_sensors,
    marked_sd,
    about,
):
    """Advance over steps and fixes, to the end of either, after the given number of steps.

    `rows` are changed where a fix cuts a step. Snapshots are made after each fix, [:, 1], and
    before it, [:, 0], where the last one is more than `aged` seconds old (otherwise its time is
    NaN). Return the status, the steps made, those of the open
    group, the fixes processed, and the rows filled for a smoother. The call ends early as
    `over_steps`, or where these rows are full; and before a fix beyond the linear range of `rule`
    (`robust`; empty: full weight), which learns `scales`, (2, 3, 9), of positions and velocities,
    unless its `steps`, (3, 5), are known.
    Instants within `same` seconds count as one.

    `about`: estimated errors (n,), those of the state that are left at each row of `notes`; and
    times, states (m, 10) and sensor errors of a reference, which the state follows at these times
    (`follow`). The errors are then kept beside the state. Without a reference all are empty. The
    last number that is returned is that of the references followed.
    """
    which, form, _ = kinds
    errors, left, reference_time, references, reference_sensors = about
    state, at_covariance, covariance, sensors, times, last = states
    open_history, _ = group
    earth = model[6]
    n, size = 9 + sensors.shape[0], covariance.shape[0]
    x, z, R = np.empty(size), np.empty(3), np.empty(3)
    H, turn, P = np.empty((3, size)), np.empty((3, 3)), np.empty((n, n))
    after = np.empty((size, size))
    meeting = turn, np.empty((1, LEVEL)), np.empty(6), np.empty((3, 3)), np.empty((3, 3, size))
    cut = np.empty((2, rows.shape[1]))
    between = np.empty((1, history.shape[1]))
    instant = np.empty(1)
    ruled, feeds_back = rule.shape[0] > 0, errors.shape[0] == 0
    done, followed, carried, total = 0, 0, noted, time.shape[0]
    why = ALL
    while done < fix_time.shape[0] or followed < reference_time.shape[0]:
        due = math.inf if done == fix_time.shape[0] else fix_time[done]
        epoch = due
        if followed < reference_time.shape[0]:
            epoch = min(due, reference_time[followed])
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
                break
            if inside:
                split_increment(rows[end], epoch - times[AT_STEP], cut[0], cut[1])
                instant[0] = epoch
                why, went, count, noted = over_steps(
                    kinds,
                    model,
                    states,
                    group,
                    count,
                    room,
                    step,
                    note_at,
                    instant,
                    cut[:1],
                    between,
                    notes,
                    noted,
                )
                if went == 1:
                    for j in range(rows.shape[1]):
                        rows[end, j] = cut[1, j]
                if why != ALL:
                    break
            continue
        if notes.shape[0] > 0 and noted + 2 > notes.shape[0]:
            why = FULL
            break
        bad, noted = close_group(kinds, model, states, group, count, room[0], notes, noted)
        count = 0
        if bad >= 0:
            why = BAD
            break
        if not feeds_back:
            carry_errors(notes, carried, noted, errors, left)
            carried = noted
        if due > times[AT_STEP] + same:
            follow(
                which,
                states,
                earth,
                references[followed],
                reference_sensors[followed],
                turn,
                errors,
            )
            # A row of its own, where what is left on the output jumps: no error is transformed.
            head_row(which, form >= UD, states, times[AT_STEP], CARRIED, P, notes[noted])
            for j in range(1 + 3 * n):
                notes[noted, begin_of_move(n) + j] = 0.0
            for j in range(3):
                notes[noted, begin_of_move(n) + 1 + j * n + j] = 1.0
            noted += 1
            carry_errors(notes, carried, noted, errors, left)
            carried = noted
            ends = made > 0 and times[AT_STEP] <= time[made - 1] + same
            go_on_from(state, open_history, at_covariance, history, made - 1 if ends else -1)
            followed += 1
            continue
        of_place = fixes[done, CODE] == place_code
        row, fix = open_history[:1], fixes[done]
        meet_fix(which, row, state, earth, model[0], last, arm, of_place, fix, meeting, z, H, R)
        for j in range(size):
            x[j] = 0.0 if feeds_back else errors[j]
        for j in range(3):
            told[done, 2, j] = 1.0
        marked_at[done, 0] = math.nan
        if note_at > -math.inf and due > note_at - interval + aged:
            marked_at[done, 0] = times[AT_STEP]
            mark(
                form,
                which != WANDER,
                covariance,
                sensors,
                turn,
                P,
                marked[done, 0],
                marked_sensors[done, 0],
                marked_sd[done, 0],
            )
            if not feeds_back:
                for j in range(sensors.shape[0]):
                    marked_sensors[done, 0, j] += errors[9 + j]
        if notes.shape[0] > 0:
            pack_covariance(form >= UD, covariance, P, notes[noted], begin_of_move(n))
        wrong = -1
        if ruled:
            for i in range(size):
                for j in range(size):
                    after[i, j] = covariance[i, j]
            learned = scales[0] if of_place else scales[1]
            if not take_by_steps(
                form, after, x, z, H, R, rule, learned, steps, due, of_place, told[done]
            ):
                why = ASK
                break
        elif form == UD:
            wrong = ud_update(covariance, x, z, H, R, told[done])
        elif form == WD:
            wrong = wd_epoch(
                covariance, covariance, covariance, False, x, z, H, R, told[done], after
            )
        else:
            wrong = dense_update(covariance, x, z, H, R, form != PLAIN, told[done])
        if ruled or form == WD:
            for i in range(size):
                for j in range(size):
                    covariance[i, j] = after[i, j]
        if wrong != -1:
            why = BAD_FIX
            break
        if feeds_back:
            take_off(which, state, sensors, earth, x)
        level_place(which, state, turn)
        if notes.shape[0] > 0:
            head_row(which, form >= UD, states, times[AT_STEP], UPDATE, P, notes[noted])
            for j in range(n):
                notes[noted, begin_of_taken(n) + j] = x[j] if feeds_back else x[j] - errors[j]
            noted += 1
        if not feeds_back:
            for j in range(n):
                errors[j] = x[j]
            carry_errors(notes, carried, noted, errors, left)
            carried = noted
        marked_at[done, 1] = times[AT_STEP]
        mark(
            form,
            which != WANDER,
            covariance,
            sensors,
            turn,
            P,
            marked[done, 1],
            marked_sensors[done, 1],
            marked_sd[done, 1],
        )
        if not feeds_back:
            for j in range(sensors.shape[0]):
                marked_sensors[done, 1, j] += errors[9 + j]
        ends = made > 0 and times[AT_STEP] <= time[made - 1] + same
        go_on_from(state, open_history, at_covariance, history, made - 1 if ends else -1)
        note_at = times[AT_COVARIANCE] + interval
        done += 1
    if not feeds_back:
        carry_errors(notes, carried, noted, errors, left)
    return why, made, count, done, noted, followed
