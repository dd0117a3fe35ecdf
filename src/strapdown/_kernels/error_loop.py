"""A mechanization and the covariance of its errors, over the steps between two epochs.

Steps are taken together to groups of up to a given time; the mechanization goes from step to step,
the covariance from group to group. What is left of a group when a piece of a log ends is kept,
so that a log may be cut anywhere.
"""

from __future__ import annotations

import math

from numba import njit

from strapdown._kernels.compensation import compensate, errors_of_states
from strapdown._kernels.factors import udu_predict
from strapdown._kernels.given_arrays import GIVEN
from strapdown._kernels.growth import grown_covariance, growth_of_step, unfold_growth
from strapdown._kernels.level_place import WANDER
from strapdown._kernels.ned import Q as Q_NB
from strapdown._kernels.ned import ned_advance
from strapdown._kernels.ned_level import ned_levels
from strapdown._kernels.psi_model import HELD_ROWS, means_of_steps, psi_dynamics
from strapdown._kernels.smoothing_rows import GROWTH, head_row, move_by_growth
from strapdown._kernels.wander import Q_WB, wander_advance
from strapdown._kernels.wander_level import wander_levels

# Forms of a covariance: the matrix, by two updates; its factors, by two.
JOSEPH, PLAIN, UD, WD = 0, 1, 2, 3
# What became of a call: all is done; a covariance is to be noted; the mechanization diverged; the
# covariance is none; the rows for a smoother are full.
ALL, NOTE, DIVERGED, BAD, FULL = 0, 1, 2, 3, 4
# Places in the times of a loop: of the covariance, of the newest step.
AT_COVARIANCE, AT_STEP = 0, 1
# A group ends before it is longer than this many steps of its time.
BEYOND = 1.000001


# A call hands over what belongs together:
# - kinds: (mechanization, form, whether the height is held);
# - model: (terms of gyros, terms of accelerometers, decay, drive, noise of gyros
#   and of accelerometers (3,), earth, options);
# - states: (mechanization, the same at the covariance, covariance, sensors, times, newest increment
#   without errors), which go on in place;
# - group: (rows of the history, the first at its start; increments), of what is not closed yet;
# - room: arrays to work in.
# Where a run is to be smoothed, every growth is put to rows of `notes` (`smoothing_rows`), of which
# `noted` are filled; where it is not, `notes` has none.


@njit(**GIVEN)
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


@njit(**GIVEN)
def matrix_over_group(states, room):
    """Take a covariance that is a matrix over a group; return -1, or the first state gone bad."""
    return grown_covariance(states[2], room[1], room[2])


@njit(cache=True, error_model="numpy")
def factors_over_group(states, room):
    """Take the factors of a covariance over a group; return -1, or the first state gone bad."""
    _, growth, _, _, _, whole, added, after = room
    unfold_growth(growth, whole, added)
    bad = udu_predict(states[2], whole, added, after)
    states[2][:, :] = after
    return bad


@njit(**GIVEN)
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
    """Take the covariance over the steps of a group.

    The covariance is (n, n), as its form has it: the matrix, or its factors. Return -1, or the
    first state gone bad, and how many rows are filled now.
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
    """Go over steps; return what became of it, steps made, those of the open group, rows filled.

    `time` are the ends of the steps, `rows` their increments; `history` takes a row after each.
    A call ends before its steps where a group was closed at `note_at` or later. After the room of
    `close_group` come arrays for errors of readings, (7, 3) each, and heights, which are none.
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
