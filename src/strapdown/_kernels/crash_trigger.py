"""Crash detection and delta-V so far, sample by sample, in memory and time that do not grow.

In the subset of Python that `export` translates. Axes of the vehicle: x forward, y right, z down.
"""

import math

from strapdown._kernels.compilation import njit

# Trigger threshold of 49 CFR 563.5(b): 8 km/h, forward or right, within 150 ms.
TRIGGER, WINDOW = 8.0 / 3.6, 0.150
# Wake-up and end of an event: the resultant changes by 0.8 km/h within 20 ms.
WAKE, WAKE_WINDOW = 0.8 / 3.6, 0.020
# Delta-V is followed to the end of the event plus 30 ms, at most 250 ms (563.7, Table I).
AFTER, LONGEST = 0.030, 0.250
# Steps are summed into slots of at least 1 ms: 150 ms are at most 151 of them.
SLOT, SLOTS, WIDTH = 0.001, 152, 4
# The mean before the crash forgets with this time, s; what is assumed before any sample counts
# as much as that of 1 s.
MEMORY, ASSUMED = 30.0, 1.0
# A longer step leaves the acceleration within it unknown, s.
GAP = 0.015
# Rate at which a vehicle pitches or rolls in a crash, rad/s, and gravity.
TILTING, GRAVITY = 0.5, 9.80665

# State: the sample before, and whether there was one; newest slot and number of slots.
LAST, STARTED, HEAD, COUNT = 0, 4, 5, 6
# Mean of the specific force, variance of the means over 150 ms about it, and its weight in s.
MEAN, VARIANCE, WEIGHT = 7, 10, 12
# Mode; time since time zero, since the trigger, and since the change became small.
MODE, SINCE, AGE, CALM = 13, 14, 15, 16
# Delta-V in the axes at time zero, yaw since, variance of what happened between samples.
DELTA, YAW, BETWEEN = 17, 20, 21
# Time since a sample forward and right was at the end of its range; largest change in 150 ms that
# led to no event, and the same before the last wake-up.
SAFE, MOST, KEPT = 23, 25, 26
RING = 27
SIZE = RING + WIDTH * SLOTS

# Modes, and what a sample led to.
QUIET, AWAKE, TRIGGERED, ENDED, INTERRUPTED = 0, 1, 2, 3, 4

# Indices of a sample: specific force, m/s²; yaw rate, rad/s; 1 where an axis is at its range.
SPIN, CLIPPED = 3, 4
# Indices of the stated errors, as standard deviations.
DENSITY, SCALE, ACROSS, LEANING, FACING, TURNING = 0, 1, 2, 3, 4, 5


@njit(cache=True)
def begin(state, variance):
    """Set the state to that before the first sample.

    The variance, (m/s²)², is that of a horizontal component without any sample: of bias and slope.
    """
    for i in range(SIZE):
        state[i] = 0.0
    state[VARIANCE] = variance
    state[VARIANCE + 1] = variance
    state[WEIGHT] = ASSUMED
    state[SAFE] = MEMORY
    state[SAFE + 1] = MEMORY


@njit(cache=True)
def trailing(state, window):
    """Duration and change of velocity, m/s, without that of the mean, within a trailing window."""
    head = int(state[HEAD])
    count = int(state[COUNT])
    t, x, y, z = 0.0, 0.0, 0.0, 0.0
    for i in range(SLOTS):
        if i < count and t < window:
            k = (head + SLOTS - i) % SLOTS
            length = state[RING + WIDTH * k]
            share = 1.0 if t + length <= window else (window - t) / length
            t += share * length
            x += share * state[RING + WIDTH * k + 1]
            y += share * state[RING + WIDTH * k + 2]
            z += share * state[RING + WIDTH * k + 3]
    return t, x - state[MEAN] * t, y - state[MEAN + 1] * t, z - state[MEAN + 2] * t


@njit(cache=True)
def learn(state):
    """Take the oldest slot, which no window reaches any more, into the mean before a crash."""
    k = (int(state[HEAD]) + 1) % SLOTS
    length = state[RING + WIDTH * k]
    weight = state[WEIGHT] + length
    if weight > MEMORY:
        weight = MEMORY
    state[WEIGHT] = weight
    gain = length / weight
    for i in range(3):
        state[MEAN + i] += gain * (state[RING + WIDTH * k + 1 + i] / length - state[MEAN + i])
    t, x, y, _z = trailing(state, WINDOW)
    if t > 0.0:
        state[VARIANCE] += gain * ((x / t) * (x / t) - state[VARIANCE])
        state[VARIANCE + 1] += gain * ((y / t) * (y / t) - state[VARIANCE + 1])


@njit(cache=True)
def keep(state, dt, x, y, z):
    """Add a step, s and m/s, to the newest slot, or to a new one."""
    k = int(state[HEAD]) % SLOTS
    count = int(state[COUNT])
    if count == 0:
        state[COUNT] = 1.0
        state[RING + WIDTH * k] = 0.0
    elif state[RING + WIDTH * k] >= SLOT:
        k = (k + 1) % SLOTS
        if count == SLOTS:
            if state[MODE] == 0.0:
                learn(state)
        else:
            state[COUNT] = float(count + 1)
        state[HEAD] = float(k)
        state[RING + WIDTH * k] = 0.0
    if state[RING + WIDTH * k] == 0.0:
        state[RING + WIDTH * k + 1] = 0.0
        state[RING + WIDTH * k + 2] = 0.0
        state[RING + WIDTH * k + 3] = 0.0
    state[RING + WIDTH * k] += dt
    state[RING + WIDTH * k + 1] += x
    state[RING + WIDTH * k + 2] += y
    state[RING + WIDTH * k + 3] += z


@njit(cache=True)
def follow(state, mean, dt, sample, x, y, z):
    """Add a step to the delta-V since time zero, in the axes at time zero."""
    spin = sample[SPIN] if mean else 0.5 * (state[LAST + SPIN] + sample[SPIN])
    middle = state[YAW] + 0.5 * spin * dt
    c, s = math.cos(middle), math.sin(middle)
    fx, fy = x - state[MEAN] * dt, y - state[MEAN + 1] * dt
    state[DELTA] += c * fx - s * fy
    state[DELTA + 1] += s * fx + c * fy
    state[DELTA + 2] += z - state[MEAN + 2] * dt
    state[YAW] += spin * dt
    state[SINCE] += dt
    for i in range(2):
        a, b = state[LAST + i] - state[MEAN + i], sample[i] - state[MEAN + i]
        if not mean:
            state[BETWEEN + i] += dt * dt * (b - a) * (b - a) / 12.0
        if dt > GAP:
            large = max(abs(a), abs(b))
            state[BETWEEN + i] += dt * dt * large * large / 3.0


@njit(cache=True)
def start(state, t, x, y, z):
    """Begin at time zero, `t` before this sample, with the change since."""
    state[SINCE] = t
    state[DELTA] = x
    state[DELTA + 1] = y
    state[DELTA + 2] = z
    state[YAW] = 0.0
    state[BETWEEN] = 0.0
    state[BETWEEN + 1] = 0.0


@njit(cache=True)
def remember(state, sample):
    """Keep a sample for the next step."""
    for i in range(4):
        state[LAST + i] = sample[i]
    for i in range(2):
        if sample[CLIPPED + i] > 0.0:
            state[SAFE + i] = 0.0


@njit(cache=True)
def take(state, mean, dt, sample):
    """Process a sample, `dt` s after the one before; return a mode, ENDED or INTERRUPTED."""
    first = state[STARTED] == 0.0
    state[STARTED] = 1.0
    if first or dt > WINDOW:
        # Nothing is known of what was between.
        following = state[MODE] == 2.0
        state[COUNT] = 0.0
        state[MODE] = 0.0
        state[SAFE] = MEMORY
        state[SAFE + 1] = MEMORY
        remember(state, sample)
        if following:
            return INTERRUPTED
        return QUIET
    before = 0.0 if mean else 0.5
    x = dt * (before * state[LAST] + (1.0 - before) * sample[0])
    y = dt * (before * state[LAST + 1] + (1.0 - before) * sample[1])
    z = dt * (before * state[LAST + 2] + (1.0 - before) * sample[2])
    keep(state, dt, x, y, z)
    for i in range(2):
        if state[SAFE + i] < MEMORY:
            state[SAFE + i] += dt
    if state[MODE] > 0.0:
        follow(state, mean, dt, sample, x, y, z)
    remember(state, sample)
    ts, xs, ys, zs = trailing(state, WAKE_WINDOW)
    tl, xl, yl, zl = trailing(state, WINDOW)
    moves = xs * xs + ys * ys > WAKE * WAKE
    most = max(abs(xl), abs(yl))
    if state[MODE] < 2.0:
        if state[MODE] == 0.0 and moves:
            state[MODE] = 1.0
            state[KEPT] = state[MOST]
            start(state, ts, xs, ys, zs)
        if most >= TRIGGER:
            # Time zero is never further back than the trigger looks.
            if state[MODE] == 0.0:
                state[KEPT] = state[MOST]
                start(state, tl, xl, yl, zl)
            elif state[SINCE] > tl:
                start(state, tl, xl, yl, zl)
            state[MODE] = 2.0
            state[AGE] = 0.0
            state[CALM] = 0.0
            state[MOST] = state[KEPT]
            return TRIGGERED
        state[MOST] = max(state[MOST], most)
        if state[MODE] == 1.0 and state[SINCE] > WINDOW and not moves:
            state[MODE] = 0.0
        if state[MODE] > 0.0:
            return AWAKE
        return QUIET
    state[AGE] += dt
    state[CALM] = 0.0 if moves else state[CALM] + dt
    if state[CALM] >= AFTER or state[SINCE] >= LONGEST:
        # The next trigger does not look back into this event.
        state[MODE] = 0.0
        state[COUNT] = 0.0
        return ENDED
    return TRIGGERED


@njit(cache=True)
def spread(state, errors):
    """Variances forward and right of delta-V so far, and their covariance, (m/s)², first order."""
    t = state[SINCE]
    x, y, z = state[DELTA], state[DELTA + 1], state[DELTA + 2]
    tilt = 0.5 * GRAVITY * TILTING * t * t
    same = tilt * tilt + errors[DENSITY] * errors[DENSITY] * t
    across = errors[ACROSS] * errors[ACROSS]
    leaning = errors[LEANING] * errors[LEANING] * z * z
    turned = errors[TURNING] * 0.5 * t
    facing = errors[FACING] * errors[FACING] + turned * turned
    scale = errors[SCALE] * errors[SCALE]
    own_x = state[VARIANCE] * t * t + state[BETWEEN] + scale * x * x
    own_y = state[VARIANCE + 1] * t * t + state[BETWEEN + 1] + scale * y * y
    var_x = own_x + same + across * (y * y + z * z) + leaning + facing * y * y
    var_y = own_y + same + across * (x * x + z * z) + leaning + facing * x * x
    return var_x, var_y, -facing * x * y
