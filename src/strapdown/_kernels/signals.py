"""Filters of sampled signals: FIR decimation, recursion, fixed-lag smoother, outliers."""

from __future__ import annotations

from strapdown._kernels.compilation import njit


@njit(cache=True, error_model="numpy")
def fir_decimate(values, weights, first, factor, out):
    """Fill ``out[j] = sum_k weights[k] values[first + j factor + k]``, (m, c).

    Sums are formed in one order, so that a record in chunks gives the same bits.
    """
    for j in range(out.shape[0]):
        at = first + j * factor
        for c in range(out.shape[1]):
            out[j, c] = 0.0
        for k in range(weights.shape[0]):
            w = weights[k]
            for c in range(out.shape[1]):
                out[j, c] += w * values[at + k, c]


# The first-order recursion that a one-pole filter and a Gauss-Markov process share.


@njit(cache=True)
def first_order(decay, drive, state, out):
    """Fill ``out[k] = decay[k] out[k-1] + drive[k]``, (n, c), from ``out[-1] = state``, (c,)."""
    for j in range(drive.shape[1]):
        x = state[j]
        for k in range(drive.shape[0]):
            x = decay[k] * x + drive[k, j]
            out[k, j] = x


@njit(cache=True)
def second_order(pass_, start, values, summed, out):
    """Fill ``y[n] = a0 x[n] + a1 x[n-1] + a2 x[n-2] + b1 y[n-1] + b2 y[n-2]``, (n, c).

    `pass_`: a0, a1, a2, b1, b2. `start`, (2, c): delayed sums before the first sample. `summed`:
    those of one sample are added first, as by scipy's sosfilt, else to the delayed, as by lfilter.
    """
    a0, a1, a2, b1, b2 = pass_[0], pass_[1], pass_[2], pass_[3], pass_[4]
    for j in range(values.shape[1]):
        first, second = start[0, j], start[1, j]
        for k in range(values.shape[0]):
            x = values[k, j]
            y = a0 * x + first
            first = (a1 * x + b1 * y) + second if summed else (second + a1 * x) + b1 * y
            second = a2 * x + b2 * y
            out[k, j] = y


# Rauch, Tung and Striebel's smoother of a level and its slope, over a fixed lag.


@njit(cache=True, error_model="numpy")
def smooth_fixed_lag(x, P, Phi, Q, lag, count, out):
    """Fill ``out[k]``, level and slope, for the first `count` epochs from up to `lag` later ones.

    Filtered states x, (n, 2), and their covariances P, (n, 3) as (11, 12, 22).
    """
    a, q11, q12, q22 = Phi[0, 1], Q[0, 0], Q[0, 1], Q[1, 1]
    n = x.shape[0]
    for k in range(count):
        last = min(n - 1, k + lag)
        level, slope = x[last, 0], x[last, 1]
        for j in range(last - 1, k - 1, -1):
            p11, p12, p22 = P[j, 0], P[j, 1], P[j, 2]
            # Phi P, and the covariance that is predicted.
            c12 = p12 + a * p22
            c11 = p11 + a * p12
            m11, m12, m22 = c11 + a * c12 + q11, c12 + q12, p22 + q22
            det = m11 * m22 - m12 * m12
            # G = P Phi' / M, with P Phi' = (c11, p12; c12, p22).
            g11 = (c11 * m22 - p12 * m12) / det
            g12 = (p12 * m11 - c11 * m12) / det
            g21 = (c12 * m22 - p22 * m12) / det
            g22 = (p22 * m11 - c12 * m12) / det
            d1 = level - (x[j, 0] + a * x[j, 1])
            d2 = slope - x[j, 1]
            level = x[j, 0] + g11 * d1 + g12 * d2
            slope = x[j, 1] + g21 * d1 + g22 * d2
        out[k, 0] = level
        out[k, 1] = slope


# Outliers: samples contradicted by their neighbors on both sides are found and interpolated.
#
# A run of samples is left out and predicted by the polynomial of degree five through three samples
# on either side. Its residual is compared with the size that a quarter of the same residuals reach
# over a window before and one behind.


# Samples on either side used for the prediction.
NODES = 3
# Samples on either side whose range measures the motion of the signal.
AROUND = 10
# Stride of the residuals counted: those between overlap with them.
STRIDE = 3
# Flags.
REPLACED, KEPT = 1, 2
# Part of the residual that the straight lines from either side must confirm.
CONFIRMED = 0.5
# Part of it by which the two lines to a single sample may differ: at a step they do by twice it.
APART = 0.75
QUARTER = 4
# In steps of the converter: rounding alone makes up to 1.6.
STEPS = 2.0
# Where most residuals are below half a step, the channel repeats values: residuals below so many
# steps are not outliers there.
REPEATS, COARSE = 2.0, 30.0
# Relative difference of equal readings: no converter has 30 bits, and scaled and rotated readings
# are exact to fewer.
ROUNDING = 1e-9
# At an end of the record, with one window, the scatter is larger.
ONE_SIDE = 1.5


@njit(cache=True, error_model="numpy")
def predicted(x, i, m, weights):
    """Predicted value at one position of the run of m samples that begins at i."""
    return (
        weights[0] * x[i - 3]
        + weights[1] * x[i - 2]
        + weights[2] * x[i - 1]
        + weights[3] * x[i + m]
        + weights[4] * x[i + m + 1]
        + weights[5] * x[i + m + 2]
    )


@njit(cache=True, error_model="numpy")
def residuals(raw, low, high, i, m, weights, out):
    """Fill the residual of sample i from the prediction of runs of m, for each start."""
    a, b, c, d, e, f = weights[0], weights[1], weights[2], weights[3], weights[4], weights[5]
    for j in range(low, high):
        out[j] = raw[j + i] - (
            a * raw[j - 3]
            + b * raw[j - 2]
            + c * raw[j - 1]
            + d * raw[j + m]
            + e * raw[j + m + 1]
            + f * raw[j + m + 2]
        )


@njit(cache=True, error_model="numpy")
def usually_below(left, row, low, high, value):
    """Whether at most a quarter of them reach the value in size; decided as soon as possible."""
    most = (high - low + STRIDE - 1) // STRIDE // QUARTER
    for k in range(low, high, STRIDE):
        if abs(left[row, k]) >= value:
            most -= 1
            if most < 0:
                return False
    return True


@njit(cache=True, error_model="numpy")
def stands_out(left, row, i, low, high, guard, window, value):
    """Whether a residual is large against its like on both sides, or the one that exists."""
    least = window // 2
    a, b = max(low, i - guard - window + 1), i - guard + 1
    c, d = i + guard, min(high, i + guard + window)
    before, behind = b - a >= least, d - c >= least
    if not (before or behind):
        return False
    if not (before and behind):
        value = value / ONE_SIDE
    if before and not usually_below(left, row, a, b, value):
        return False
    return not behind or usually_below(left, row, c, d, value)


@njit(cache=True, error_model="numpy", inline="always")
def in_window(left, row, i, high, guard, window, factor):
    """Whether a residual may exceed the spread of the window behind it; if not, certainly not."""
    if i + guard + window > high:
        return True
    value = abs(left[row, i]) / factor
    most = (window + STRIDE - 1) // STRIDE // QUARTER
    for k in range(i + guard, i + guard + window, STRIDE):
        if abs(left[row, k]) >= value:
            most -= 1
            if most < 0:
                return False
    return True


@njit(cache=True, error_model="numpy")
def half_range(x, i, m):
    """Half the range of the samples around a run, without it."""
    n = x.shape[0]
    low, high = x[i - 1], x[i - 1]
    for j in range(max(0, i - AROUND), i):
        low, high = min(low, x[j]), max(high, x[j])
    for j in range(i + m, min(n, i + m + AROUND)):
        low, high = min(low, x[j]), max(high, x[j])
    return 0.5 * (high - low)


@njit(cache=True, error_model="numpy")
def middle_of_nodes(x, i, m):
    """Median of the samples that predict a run."""
    a, b, c = x[i - 3], x[i - 2], x[i - 1]
    d, e, f = x[i + m], x[i + m + 1], x[i + m + 2]
    # Of six numbers, by exchanges: the third and the fourth in order.
    a, b = min(a, b), max(a, b)
    c, d = min(c, d), max(c, d)
    e, f = min(e, f), max(e, f)
    a, c = min(a, c), max(a, c)
    d, f = min(d, f), max(d, f)
    b, e = min(b, e), max(b, e)
    a, b = min(a, b), max(a, b)
    c, d = min(c, d), max(c, d)
    e, f = min(e, f), max(e, f)
    b, c = min(b, c), max(b, c)
    d, e = min(d, e), max(d, e)
    c, d = min(c, d), max(c, d)
    return 0.5 * (c + d)


@njit(cache=True, error_model="numpy")
def same_side(line, residual):
    """Whether a straight line from one side confirms the residual."""
    return line * residual > 0.0 and abs(line) > CONFIRMED * abs(residual)


@njit(cache=True, error_model="numpy")
def is_run(x, left, i, m, low, high, weights, allowed, guard, window, factor, step):
    """Whether the m samples from i on are outliers."""
    j = i + m - 1
    first = x[i] - predicted(x, i, m, weights[m - 1, 0])
    last = x[j] - predicted(x, i, m, weights[m - 1, m - 1])
    small = min(abs(first), abs(last))
    if small <= STEPS * step:
        return False
    # A sample closer to its neighbors than its prediction is not an outlier.
    middle = middle_of_nodes(x, i, m)
    if abs(x[i] - middle) <= abs(x[i] - first - middle) or abs(x[j] - middle) <= abs(
        x[j] - last - middle
    ):
        return False
    before = x[i] - 2.0 * x[i - 1] + x[i - 2]
    behind = x[j] - 2.0 * x[j + 1] + x[j + 2]
    if not (same_side(before, first) and same_side(behind, last)):
        return False
    if m == 1 and abs(before - behind) > APART * abs(first):
        return False
    a, b = abs(first) / factor, abs(last) / factor
    if not stands_out(left, 2 * m - 2, i, low, high, guard, window, a):
        return False
    if not stands_out(left, 2 * m - 1, i, low, high, guard, window, b):
        return False
    if small <= COARSE * step and stands_out(
        left, 2 * m - 2, i, low, high, guard, window, REPEATS * step
    ):
        return False
    motion = allowed[m - 1] * half_range(x, i, m)
    a, b = (abs(first) - motion) / factor, (abs(last) - motion) / factor
    return (
        a > 0.0
        and b > 0.0
        and stands_out(left, 2 * m - 2, i, low, high, guard, window, a)
        and stands_out(left, 2 * m - 1, i, low, high, guard, window, b)
    )


@njit(cache=True, error_model="numpy")
def is_odd(x, left, i, low, high, weights, allowed, guard, window, factor, step):
    """Whether a sample is off its prediction by more than the signal and its noise explain."""
    size = abs(x[i] - predicted(x, i, 1, weights[0, 0]))
    if size <= STEPS * step or not stands_out(left, 0, i, low, high, guard, window, size / factor):
        return False
    if size <= COARSE * step and stands_out(left, 0, i, low, high, guard, window, REPEATS * step):
        return False
    size -= allowed[0] * half_range(x, i, 1)
    return size > 0.0 and stands_out(left, 0, i, low, high, guard, window, size / factor)


@njit(cache=True, error_model="numpy")
def fill_run(x, i, m, weights):
    for k in range(m):
        x[i + k] = predicted(x, i, m, weights[m - 1, k])


@njit(cache=True, error_model="numpy")
def replace_outliers(
    raw, work, flags, begin, stop, weights, allowed, guard, window, factor, state, left
):
    """Judge the samples from begin to before stop; work and flags are changed in place.

    ``state`` is the converter's step, or minus the least difference so far where it is to be
    determined, then start and length of the last run. A run may reach beyond stop. Returns the next
    sample.
    """
    n, runs = raw.shape[0], weights.shape[0]
    low, high = NODES, n - runs - NODES + 1
    for m in range(1, runs + 1):
        residuals(raw, low, high, 0, m, weights[m - 1, 0], left[2 * m - 2])
        residuals(raw, low, high, m - 1, m, weights[m - 1, m - 1], left[2 * m - 1])
    i = begin
    while i < stop:
        if state[0] <= 0.0 and i + 1 < n:
            d = abs(raw[i + 1] - raw[i])
            if d > ROUNDING * (abs(raw[i]) + abs(raw[i + 1])) and d < -state[0]:
                state[0] = -d
        if i < NODES or i + NODES > n - 1:
            i += 1
            continue
        step = abs(state[0])
        found = 0
        line = work[i] - 2.0 * work[i - 1] + work[i - 2]
        # Most samples are settled without a call, by the residuals already there.
        as_it_came = low < i < high - 1 and i >= state[1] + state[2] + NODES
        for m in range(min(runs, n - NODES - i), 0, -1):
            if as_it_came:
                j = i + m - 1
                behind = work[j] - 2.0 * work[j + 1] + work[j + 2]
                if not (
                    same_side(line, left[2 * m - 2, i])
                    and same_side(behind, left[2 * m - 1, i])
                    and in_window(left, 2 * m - 2, i, high, guard, window, factor)
                ):
                    continue
            if is_run(work, left, i, m, low, high, weights, allowed, guard, window, factor, step):
                found = m
                break
        if found:
            fill_run(work, i, found, weights)
            flags[i : i + found] = REPLACED
            # Earlier judgments included these samples.
            before, length = int(state[1]), int(state[2])
            if length > 0 and before + length + NODES > i:
                for j in range(before, before + length):
                    work[j] = raw[j]
                if is_run(
                    work,
                    left,
                    before,
                    length,
                    low,
                    high,
                    weights,
                    allowed,
                    guard,
                    window,
                    factor,
                    step,
                ):
                    fill_run(work, before, length, weights)
                else:
                    flags[before : before + length] = 0
            for j in range(max(NODES, i - NODES), i):
                if flags[j] == KEPT and not is_odd(
                    work, left, j, low, high, weights, allowed, guard, window, factor, step
                ):
                    flags[j] = 0
            state[1], state[2] = i, found
            i += found
            continue
        if as_it_came and (
            abs(left[0, i]) < abs(left[0, i - 1])
            or abs(left[0, i]) < abs(left[0, i + 1])
            or not in_window(left, 0, i, high, guard, window, factor)
        ):
            i += 1
            continue
        if is_odd(work, left, i, low, high, weights, allowed, guard, window, factor, step):
            flags[i] = KEPT
        i += 1
    return i
