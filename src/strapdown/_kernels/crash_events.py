"""Crash events, sample by sample: a state machine over crossings of windows of velocity change."""

from __future__ import annotations

import math

from strapdown._kernels.compilation import njit

# Options.
MEAN, TRIGGER, LONG, WAKE, SHORT, SIDE, QUIET, LEVEL, LATERAL = range(9)
OPTIONS = 9

# State. Three tails (trigger, wake, side) as positions of rows; where the record begins; the
# instant up to which all is done, and the row that ends the step it lies in.
TAILS, BEGIN, NOW, ROW = 0, 3, 4, 5
# From where the trigger's window may look back, and the velocity there.
FLOOR = 6
# Whether the resultant is over the wake threshold; since when it is not, though not yet for good.
ACTIVE, PENDING = 9, 10
# Trigger: instant, axis (0 forward, 1 right).
TRIGGERED, AXIS = 11, 12
# Largest magnitude, its instant; the same since PENDING.
PEAK, PEAK_TIME, LATER, LATER_TIME = 13, 14, 15, 16
# Largest change within the trigger's window: size, axis, instant of its end.
MOST, MOST_AXIS, MOST_TIME = 17, 18, 19
# Number of wakes without an event; description of the last one.
WOKEN, KEPT = 20, 21
# Crossings: forward, right, resultant, acceleration, end; and the four of the one kept.
MARK = 6  # instant, slope, power of the weights, length, share of forward and of right
MARKS = 22
FORWARD, RIGHT, RESULTANT, FELT, END = range(5)
KEPT_MARKS = MARKS + 5 * MARK
KEPT_PEAK = KEPT_MARKS + 4 * MARK
# The largest change before the episode, which belongs to the event that it leads to.
KEPT_MOST = KEPT_PEAK + 2
SIZE = KEPT_MOST + 3

DONE, CLOSED = 0, 1


@njit(cache=True)
def begin(state, time):
    """Set the state to that before the first sample."""
    state[:] = 0.0
    state[BEGIN] = time
    state[NOW] = time
    state[ROW] = 1.0
    state[FLOOR] = time
    for i in (PENDING, TRIGGERED, PEAK_TIME, LATER_TIME, MOST_TIME, KEPT_MOST + 2):
        state[i] = math.nan
    for i in range(MARKS, KEPT_PEAK):
        state[i] = math.nan


@njit(cache=True)
def mark(state, which, rows, head, tail, at, window, mean, x, y):
    """Store the parts of a window's crossing that give its instant and uncertainty."""
    if which == FORWARD:
        cx, cy = 1.0, 0.0
    elif which == RIGHT:
        cx, cy = 0.0, 1.0
    else:
        size = math.sqrt(x[0] * x[0] + y[0] * y[0])
        cx, cy = (x[0] / size, y[0] / size) if size > 0.0 else (1.0, 0.0)
    i = MARKS + which * MARK
    start = max(at - window, state[BEGIN])
    first = tail if at - window >= state[BEGIN] else 1
    # Rows before the first one held are never needed: the window is shorter.
    state[i] = at
    state[i + 1] = abs(cx * x[1] + cy * y[1])
    state[i + 2] = power(rows, head, max(first, 1), start, at, mean)
    state[i + 3] = at - start
    state[i + 4] = cx
    state[i + 5] = cy


@njit(cache=True)
def forget(state):
    """Clear the marks and the peak of an episode."""
    for i in range(MARKS, MARKS + 4 * MARK):
        state[i] = math.nan
    state[PENDING] = math.nan
    state[TRIGGERED] = math.nan
    state[PEAK] = 0.0
    state[PEAK_TIME] = math.nan
    state[LATER] = 0.0


@njit(cache=True)
def take_later(state):
    """Count the peak since the resultant became small with the event."""
    if state[LATER] > state[PEAK]:
        state[PEAK] = state[LATER]
        state[PEAK_TIME] = state[LATER_TIME]
    state[LATER] = 0.0


@njit(cache=True)
def felt(rows, k, options):
    """Squared magnitude of a row."""
    size = rows[k, AX] * rows[k, AX]
    if options[LATERAL] > 0.0:
        size += rows[k, AY] * rows[k, AY]
    return size


@njit(cache=True)
def close(state, end, rows, head, mean):
    """End an event: the next may not count its part of the window."""
    state[FLOOR] = end
    state[FLOOR + 1] = value(rows, head, end, 0, mean)[0]
    state[FLOOR + 2] = value(rows, head, end, 1, mean)[0]
    state[KEPT] = 0.0


@njit(cache=True)
def advance(state, options, rows, count):
    """Process rows up to `count`; stop after each event that ends.

    Return DONE when no row is left, CLOSED when an event has ended: its marks, trigger and peak are
    then in the state until the caller calls `forget`.
    """
    mean = options[MEAN] > 0.0
    lateral = options[LATERAL] > 0.0
    windows = (options[LONG], options[SHORT], options[SIDE])
    while int(state[ROW]) < count:
        k = int(state[ROW])
        now = state[NOW]
        if now == rows[k - 1, T]:
            # The step is new: the velocity at its end.
            step = rows[k, T] - rows[k - 1, T]
            for axis in range(2):
                before = rows[k, AX + axis] if mean else rows[k - 1, AX + axis]
                rows[k, VX + axis] = (
                    rows[k - 1, VX + axis] + 0.5 * (before + rows[k, AX + axis]) * step
                )
        # How far all windows are one polynomial each.
        end = rows[k, T]
        for i in range(3):
            tail = max(int(state[TAILS + i]), 1)
            while tail < k and rows[tail, T] + windows[i] <= now:
                tail += 1
            state[TAILS + i] = tail
            start = state[FLOOR] if i == 0 else state[BEGIN]
            turn = start + windows[i] if now - windows[i] < start else rows[tail, T] + windows[i]
            if turn > now:
                end = min(end, turn)
        length = end - now
        tails = state[TAILS : TAILS + 3]
        b, fl = state[BEGIN], state[FLOOR]
        lx = change(rows, k, int(tails[0]), now, windows[0], fl, state[FLOOR + 1], 0, mean)
        ly = change(rows, k, int(tails[0]), now, windows[0], fl, state[FLOOR + 2], 1, mean)
        sx = change(rows, k, int(tails[1]), now, windows[1], b, 0.0, 0, mean)
        sy = change(rows, k, int(tails[1]), now, windows[1], b, 0.0, 1, mean)
        py = change(rows, k, int(tails[2]), now, windows[2], b, 0.0, 1, mean)
        if not lateral:
            ly = (0.0, 0.0, 0.0)
            sy = (0.0, 0.0, 0.0)
            py = (0.0, 0.0, 0.0)

        # The first event within the segment.
        what, at = -1, length
        over = excess(sx, sy, length, options[WAKE]) > 0.0
        active = state[ACTIVE] > 0.0
        pending = not math.isnan(state[PENDING])
        if over != (active and not pending):
            at = crossing(sx, sy, length, options[WAKE], over)
            what = 0
        if options[LEVEL] > 0.0:
            if math.isnan(state[MARKS + FELT * MARK]):
                for axis in range(2 if lateral else 1):
                    _v, a, m = value(rows, k, now, axis, mean)
                    x = (
                        0.0
                        if abs(a) >= options[LEVEL]
                        else first_upward(a, m, 0.0, length, options[LEVEL])
                    )
                    if x < at:
                        what, at = 1 + axis, x
        else:
            if math.isnan(state[MARKS + FORWARD * MARK]):
                x = first_upward(sx[0], sx[1], sx[2], length, options[WAKE])
                if x < at:
                    what, at = 3, x
            if lateral and math.isnan(state[MARKS + RIGHT * MARK]):
                x = first_upward(py[0], py[1], py[2], length, options[WAKE])
                if x < at:
                    what, at = 4, x
        if math.isnan(state[TRIGGERED]):
            x = first_upward(lx[0], lx[1], lx[2], length, options[TRIGGER])
            if x < at:
                what, at = 5, x
            x = first_upward(ly[0], ly[1], ly[2], length, options[TRIGGER])
            if x < at:
                what, at = 6, x
        if pending and state[PENDING] + options[QUIET] - now < at:
            what, at = 7, max(state[PENDING] + options[QUIET] - now, 0.0)
        if not active:
            # A wake that no lasting change follows is forgotten.
            for which in (FORWARD, RIGHT, FELT):
                woke = state[MARKS + which * MARK]
                if woke + windows[1] - now < at:
                    what, at = 8 + which, max(woke + windows[1] - now, 0.0)

        if math.isnan(state[TRIGGERED]):
            for axis in range(2 if lateral else 1):
                c = lx if axis == 0 else ly
                most, x = largest(c[0], c[1], c[2], at)
                # A plateau is met where it begins, whatever its rounding.
                if most > state[MOST] * (1.0 + 1e-12):
                    state[MOST] = most
                    state[MOST_AXIS] = axis
                    state[MOST_TIME] = now + x

        if what < 0:
            # A whole step is over only where its last stamp is met.
            state[NOW] = end
            if end == rows[k, T]:
                size = math.sqrt(felt(rows, k, options))
                if active and not pending:
                    if size > state[PEAK]:
                        state[PEAK] = size
                        state[PEAK_TIME] = rows[k, T]
                elif pending and size > state[LATER]:
                    state[LATER] = size
                    state[LATER_TIME] = rows[k, T]
                state[ROW] = k + 1
            continue

        now = min(now + at, end)
        state[NOW] = now
        x = (sx[0] + at * (sx[1] + at * sx[2]), sx[1] + 2.0 * at * sx[2], 0.0)
        y = (sy[0] + at * (sy[1] + at * sy[2]), sy[1] + 2.0 * at * sy[2], 0.0)
        if what == 0 and over and not active:
            state[ACTIVE] = 1.0
            state[KEPT] = 0.0
            for i in range(3):
                state[KEPT_MOST + i] = state[MOST + i]
            mark(state, RESULTANT, rows, k, int(tails[1]), now, windows[1], mean, x, y)
            first = now - windows[1]
            for which in (FORWARD, RIGHT, FELT):
                woke = state[MARKS + which * MARK]
                back = 0.0 if which == FELT else windows[2] if which == RIGHT else windows[1]
                if woke - back < first:
                    first = woke - back
            j = k - 1
            while j >= 0 and rows[j, T] >= first:
                size = math.sqrt(felt(rows, j, options))
                if size > state[PEAK]:
                    state[PEAK] = size
                    state[PEAK_TIME] = rows[j, T]
                j -= 1
        elif what == 0 and over:
            # Quiet did not last.
            state[PENDING] = math.nan
            take_later(state)
        elif what == 0:
            state[PENDING] = now
            mark(state, END, rows, k, int(tails[1]), now, windows[1], mean, x, y)
        elif what <= 2:
            i = MARKS + FELT * MARK
            u = (now - rows[k - 1, T]) / (rows[k, T] - rows[k - 1, T])
            state[i] = now
            state[i + 1] = abs(value(rows, k, now, what - 1, mean)[2])
            state[i + 2] = 1.0 if mean else (1.0 - u) * (1.0 - u) + u * u
            state[i + 3] = 1.0
            state[i + 4] = 2.0 - what
            state[i + 5] = what - 1.0
        elif what == 3:
            mark(state, FORWARD, rows, k, int(tails[1]), now, windows[1], mean, x, y)
        elif what == 4:
            p = (0.0, py[1] + 2.0 * at * py[2], 0.0)
            mark(state, RIGHT, rows, k, int(tails[2]), now, windows[2], mean, x, p)
        elif what <= 6:
            state[TRIGGERED] = now
            state[AXIS] = what - 5
            for i in range(3):
                state[MOST + i] = state[KEPT_MOST + i]
            if not active:
                # It was reached after the resultant had become small: what is over is the event.
                if state[KEPT] > 0.0:
                    for i in range(4 * MARK):
                        state[MARKS + i] = state[KEPT_MARKS + i]
                    state[PEAK] = state[KEPT_PEAK]
                    state[PEAK_TIME] = state[KEPT_PEAK + 1]
                mark(state, END, rows, k, int(tails[1]), now, windows[1], mean, x, y)
                state[MARKS + END * MARK + 1] = math.nan
                close(state, now, rows, k, mean)
                return CLOSED
            if pending:
                # An event does not end before it is one.
                state[PENDING] = now
                take_later(state)
                mark(state, END, rows, k, int(tails[1]), now, windows[1], mean, x, y)
                state[MARKS + END * MARK + 1] = math.nan
        elif what == 7:
            state[ACTIVE] = 0.0
            if not math.isnan(state[TRIGGERED]):
                close(state, state[PENDING], rows, _row_of(rows, k, state[PENDING]), mean)
                return CLOSED
            state[WOKEN] += 1.0
            state[KEPT] = 1.0
            for i in range(4 * MARK):
                state[KEPT_MARKS + i] = state[MARKS + i]
            state[KEPT_PEAK] = state[PEAK]
            state[KEPT_PEAK + 1] = state[PEAK_TIME]
            forget(state)
        else:
            i = MARKS + (what - 8) * MARK
            for j in range(MARK):
                state[i + j] = math.nan
    return DONE


@njit(cache=True)
def _row_of(rows, k, at):
    """Row that ends the step in which an instant lies, from row k back."""
    while k > 1 and rows[k - 1, T] >= at:
        k -= 1
    return k


# Between samples the acceleration is a line (values at the stamps) or a constant (means): the
# change of velocity over a trailing window is a polynomial of time between breaks, which are the
# stamps, and the stamps moved by the length of the window. Crossings are roots of these
# polynomials.


# Columns of the rows: stamp, acceleration forward and right, velocity since the record began.
T, AX, AY, VX, VY = range(5)
WIDTH = 5

NEVER = 1e300


@njit(cache=True)
def value(rows, k, at, axis, mean):
    """Velocity, acceleration and its slope at an instant of the step that ends with row k."""
    step = rows[k, T] - rows[k - 1, T]
    since = at - rows[k - 1, T]
    before = rows[k, AX + axis] if mean else rows[k - 1, AX + axis]
    slope = (rows[k, AX + axis] - before) / step
    accel = before + slope * since
    return rows[k - 1, VX + axis] + 0.5 * (before + accel) * since, accel, slope


@njit(cache=True)
def change(rows, head, tail, at, window, floor, velocity, axis, mean):
    """Change of velocity over a trailing window that ends at an instant: a quadratic of time."""
    v, a, m = value(rows, head, at, axis, mean)
    if at - window < floor:
        return v - velocity, a, 0.5 * m
    v0, a0, m0 = value(rows, tail, at - window, axis, mean)
    return v - v0, a - a0, 0.5 * (m - m0)


@njit(cache=True)
def first_upward(c0, c1, c2, length, level):
    """First instant in [0, length] at which the size of a quadratic grows through a level."""
    first = NEVER
    for sign in (-1.0, 1.0):
        a, b, c = sign * c2, sign * c1, sign * c0 - level
        disc = b * b - 4.0 * a * c
        # The root at which it rises is the one with slope +sqrt(disc).
        if disc > 0.0:
            root = math.sqrt(disc)
            # Both forms are the same root; the one that does not cancel is used.
            x = -2.0 * c / (b + root) if b >= 0.0 else (root - b) / (2.0 * a) if a != 0.0 else -1.0
            # A level met at the previous border may lie a rounding behind.
            if -1e-15 <= x <= length:
                first = min(first, max(x, 0.0))
    return first


@njit(cache=True)
def largest(c0, c1, c2, length):
    """Largest size of a quadratic in [0, length], and where."""
    at, most = 0.0, abs(c0)
    end = abs(c0 + length * (c1 + length * c2))
    if end > most:
        at, most = length, end
    if c2 != 0.0:
        x = -0.5 * c1 / c2
        if 0.0 < x < length and abs(c0 + x * (c1 + x * c2)) > most:
            at, most = x, abs(c0 + x * (c1 + x * c2))
    return most, at


@njit(cache=True)
def excess(x, y, at, level):
    """Excess of the squared resultant of two quadratics over that of a level."""
    dx = x[0] + at * (x[1] + at * x[2])
    dy = y[0] + at * (y[1] + at * y[2])
    return dx * dx + dy * dy - level * level


@njit(cache=True)
def crossing(x, y, length, level, upward):
    """Instant at which the resultant crosses a level in [0, length]; it does so by its end."""
    if (excess(x, y, 0.0, level) > 0.0) == upward:
        return 0.0
    low, high = 0.0, length
    for _ in range(200):
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            break
        if (excess(x, y, middle, level) > 0.0) == upward:
            high = middle
        else:
            low = middle
    return high


@njit(cache=True)
def power(rows, head, tail, start, end, mean):
    """Sum of the squared weights of the samples in the integral from start to end."""
    total, carry = 0.0, 0.0
    for k in range(tail, head + 1):
        step = rows[k, T] - rows[k - 1, T]
        u = max(start - rows[k - 1, T], 0.0) / step
        w = min(end - rows[k - 1, T], step) / step
        if mean:
            total += (step * (w - u)) ** 2
        else:
            left = step * ((w - 0.5 * w * w) - (u - 0.5 * u * u))
            total += (carry + left) ** 2
            carry = 0.5 * step * (w * w - u * u)
    return total + carry * carry
