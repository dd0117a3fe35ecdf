"""Redundant axes: weighted least squares, residuals over windows, and the vote.

Row i of `axes` is the direction along which axis i measures: ``z_i = axes_i . x + error_i``, errors
of different axes independent. With weights 1/c the residuals' chi-square is that of the parity
vector, ``(V z)^T (V C V^T)^-1 V z`` for any V whose rows span what is orthogonal to `axes`.
"""

from __future__ import annotations

import math

import numpy as np

from strapdown._kernels.compilation import njit

# Rows of `facts`.
NOISE2, BIAS2, DRIFT2, TIME, SCALE2, ACROSS2, OTHER2, STEP2 = range(8)
# Indices of `counts`.
SAMPLES, LEARNED = range(2)
# Kinds of events.
EXCLUDED, READMITTED, DISAGREE, TOO_FEW = range(4)
SINGULAR = 1e-9


@njit(cache=True, error_model="numpy")
def fit(axes, weights, z, x):
    """Fill x, (3,), by least squares; the chi-square, or -1 where the axes span no space."""
    a = b = c = d = e = f = u = v = w = 0.0
    for i in range(z.size):
        p = weights[i]
        if p > 0.0:
            hx, hy, hz = axes[i, 0], axes[i, 1], axes[i, 2]
            a += p * hx * hx
            b += p * hx * hy
            c += p * hx * hz
            d += p * hy * hy
            e += p * hy * hz
            f += p * hz * hz
            u += p * hx * z[i]
            v += p * hy * z[i]
            w += p * hz * z[i]
    m0, m1, m2 = d * f - e * e, c * e - b * f, b * e - c * d
    det = a * m0 + b * m1 + c * m2
    mean = (a + d + f) / 3.0
    if not det > SINGULAR * mean * mean * mean:
        return -1.0
    m3, m4, m5 = a * f - c * c, b * c - a * e, a * d - b * b
    x[0] = (m0 * u + m1 * v + m2 * w) / det
    x[1] = (m1 * u + m3 * v + m4 * w) / det
    x[2] = (m2 * u + m4 * v + m5 * w) / det
    total = 0.0
    for i in range(z.size):
        if weights[i] > 0.0:
            r = z[i] - axes[i, 0] * x[0] - axes[i, 1] * x[1] - axes[i, 2] * x[2]
            total += weights[i] * r * r
    return total


@njit(cache=True, error_model="numpy")
def variances(facts, mean, ref, other, other_ref, known, share, learned, learn, dt, quadratic, out):
    """Fill the variance of each axis's windowed mean about the truth, or its change."""
    size2 = ref2 = other2 = moved2 = 0.0
    for j in range(3):
        other2 += other[j] * other[j]
        moved2 += (other[j] - other_ref[j]) * (other[j] - other_ref[j])
    for i in range(mean.size):
        # Three axes in n have a third of all squares each, whatever their directions.
        size2 += mean[i] * mean[i] * 3.0 / mean.size
        ref2 += (mean[i] - ref[i]) * (mean[i] - ref[i]) * 3.0 / mean.size
    for i in range(mean.size):
        noise = facts[NOISE2, i] / dt * share + facts[STEP2, i]
        if known[i]:
            along = (mean[i] - ref[i]) * (mean[i] - ref[i])
            elapsed = learned * dt / facts[TIME, i]
            noise += facts[NOISE2, i] / (dt * learn)
            noise += 2.0 * facts[DRIFT2, i] * -math.expm1(-elapsed)
            noise += facts[SCALE2, i] * along + facts[ACROSS2, i] * max(ref2 - along, 0.0)
            noise += facts[OTHER2, i] * moved2
        else:
            along = mean[i] * mean[i]
            noise += facts[BIAS2, i] + facts[DRIFT2, i]
            noise += facts[SCALE2, i] * along + facts[ACROSS2, i] * max(size2 - along, 0.0)
            noise += facts[OTHER2, i] * other2
        out[i] = noise + quadratic * other2 * other2


@njit(cache=True, error_model="numpy")
def isolate(axes, weights, z, groups, limits, separation, x):
    """Find the axis, or group, whose exclusion alone makes the others agree.

    Returns the axis, or ``-2 - group``, or -1 where there is none; the most likely axis and the
    next one; and the difference of the first from the others.
    """
    m = z.size
    trial = weights.copy()
    count = 0
    for i in range(m):
        count += 1 if weights[i] > 0.0 else 0
    best, second, at, next_at = np.inf, np.inf, -1, -1
    for i in range(m):
        if weights[i] > 0.0:
            trial[i] = 0.0
            left = fit(axes, trial, z, x)
            trial[i] = weights[i]
            if left >= 0.0:
                if left < best:
                    second, next_at = best, at
                    best, at = left, i
                elif left < second:
                    second, next_at = left, i
    size = 0.0
    if at >= 0:
        trial[at] = 0.0
        fit(axes, trial, z, x)
        trial[at] = weights[at]
        size = z[at] - axes[at, 0] * x[0] - axes[at, 1] * x[1] - axes[at, 2] * x[2]
        if count >= 5 and best <= limits[count - 4] and second - best >= separation:
            return at, at, next_at, size
    best, second, group = np.inf, np.inf, -1
    for g in range(groups.max() + 1):
        left_count = count
        several = 0
        for i in range(m):
            trial[i] = weights[i]
            if groups[i] == g and weights[i] > 0.0:
                trial[i] = 0.0
                left_count -= 1
                several += 1
        if several < 2 or left_count < 4:
            continue
        left = fit(axes, trial, z, x)
        if left < 0.0 or left > limits[left_count - 3]:
            continue
        if left < best:
            second, best, group = best, left, g
        elif left < second:
            second = left
    if group >= 0 and second - best >= separation:
        return -2 - group, at, next_at, size
    return -1, at, next_at, size


@njit(cache=True, error_model="numpy")
def take_in(z, other, axes, weights, learn, offset, ref, other_ref, counts, known, out):
    """Add a sample to the readings under comparison; at the end, the offset of each axis."""
    for i in range(z.size):
        if out[i] == 0 and not math.isfinite(z[i]):
            return
    counts[LEARNED] += 1
    gain = 1.0 / counts[LEARNED]
    for i in range(z.size):
        if out[i] == 0:
            ref[i] += gain * (z[i] - ref[i])
    for j in range(3):
        other_ref[j] += gain * (other[j] - other_ref[j])
    if counts[LEARNED] < learn:
        return
    w, x = np.empty(z.size), np.empty(3)
    for i in range(z.size):
        w[i] = weights[i] if out[i] == 0 else 0.0
    fit(axes, w, ref, x)
    for i in range(z.size):
        if out[i] == 0:
            known[i] = 1
            offset[i] = ref[i] - axes[i, 0] * x[0] - axes[i, 1] * x[1] - axes[i, 2] * x[2]


@njit(cache=True, error_model="numpy")
def vote(
    z,
    other,
    axes,
    groups,
    weights,
    facts,
    limits,
    dt,
    alpha,
    persist,
    learn,
    readmit,
    hold,
    separation,
    quadratic,
    mean,
    other_mean,
    share,
    offset,
    ref,
    other_ref,
    counts,
    known,
    out,
    calm,
    alarms,
    told,
    fused,
    used,
):
    """Process samples z, (n, m); `mean` to `told` are the state, and change.

    Returns events ``(row, kind, axis or group, next axis, size, chi-square, limit, since)``. A
    group that failed as a whole is ``-2 - group``.
    """
    n, m = z.shape
    windows = alpha.size
    events = [(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)]
    events.clear()
    w, c, y, x = np.empty(m), np.empty(m), np.empty(m), np.empty(3)
    chi = np.zeros(windows)
    cs = np.empty((windows, m))
    for k in range(n):
        for i in range(m):
            good = out[i] == 0 and math.isfinite(z[k, i])
            used[k, i] = good
            w[i] = weights[i] if good else 0.0
            y[i] = z[k, i] - offset[i] if good else 0.0
        if fit(axes, w, y, x) < 0.0:
            events.append((float(k), float(TOO_FEW), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
            return events
        fused[k, 0], fused[k, 1], fused[k, 2] = x[0], x[1], x[2]

        counts[SAMPLES] += 1
        usual = 0
        for s in range(windows):
            gain = max(alpha[s], 1.0 / counts[SAMPLES])
            share[s] = (1.0 - gain) * (1.0 - gain) * share[s] + gain * gain
            for j in range(3):
                other_mean[s, j] += gain * (other[k, j] - other_mean[s, j])
            for i in range(m):
                value = z[k, i]
                if not math.isfinite(value):
                    value = offset[i] + axes[i, 0] * fused[k, 0]
                    value += axes[i, 1] * fused[k, 1] + axes[i, 2] * fused[k, 2]
                mean[s, i] += gain * (value - mean[s, i])
            variances(
                facts, mean[s], ref, other_mean[s], other_ref, known, share[s], counts[LEARNED],
                learn, dt, quadratic, c,
            )  # fmt: skip
            count = 0
            for i in range(m):
                cs[s, i] = c[i]
                w[i] = 1.0 / c[i] if out[i] == 0 else 0.0
                count += 1 if out[i] == 0 else 0
                y[i] = mean[s, i] - offset[i]
            chi[s] = fit(axes, w, y, x)
            if count > 3 and chi[s] > limits[count - 3]:
                alarms[s] += 1
            else:
                alarms[s] = 0
            usual += 1 if alarms[s] == 0 else 0
        # An event is repeated only after an absence as long as an exclusion.
        if usual == windows:
            for i in range(m):
                told[i] = max(told[i] - 1, 0)

        for s in range(windows):
            if alarms[s] < persist[s]:
                continue
            count = 0
            for i in range(m):
                w[i] = 1.0 / cs[s, i] if out[i] == 0 else 0.0
                count += 1 if out[i] == 0 else 0
                y[i] = mean[s, i] - offset[i]
            which, first, following, size = isolate(axes, w, y, groups, limits, separation, x)
            row, since = float(k), float(k + 1 - alarms[s])
            limit = limits[count - 3]
            if which != -1:
                for i in range(m):
                    if i == which or groups[i] == -2 - which:
                        out[i] = 1
                        calm[i] = 0
                name = float(which)
                events.append((row, float(EXCLUDED), name, -1.0, size, chi[s], limit, since))
                for t in range(windows):
                    alarms[t] = 0
                if counts[LEARNED] < learn:
                    # Values learned from it are discarded.
                    counts[LEARNED] = 0
                    ref[:] = 0.0
                    other_ref[:] = 0.0
                break
            if alarms[s] < 2 * persist[s]:
                continue
            # Further disagreement beside the known one.
            for i in range(m):
                if told[i] > 0:
                    told[i] = hold
                    if w[i] > 0.0:
                        w[i] = 0.0
                        count -= 1
            if count <= 3:
                continue
            left = fit(axes, w, y, x)
            if not left > limits[count - 3]:
                continue
            _, first, following, size = isolate(axes, w, y, groups, limits, separation, x)
            if first < 0:
                first, following = 0, -1
            told[first] = hold
            limit = limits[count - 3]
            pair = float(first), float(following)
            events.append((row, float(DISAGREE), pair[0], pair[1], size, left, limit, since))

        for i in range(m):
            if out[i] == 0 or not known[i]:
                continue
            within = math.isfinite(z[k, i])
            for s in range(windows):
                for j in range(m):
                    w[j] = 1.0 / cs[s, j] if out[j] == 0 else 0.0
                    y[j] = mean[s, j] - offset[j]
                without = fit(axes, w, y, x)
                w[i] = 1.0 / cs[s, i]
                # Its part of the chi-square has one degree of freedom.
                # Half of the limit gives hysteresis.
                if fit(axes, w, y, x) - without > 0.5 * limits[1]:
                    within = False
            calm[i] = calm[i] + 1 if within else 0
            if calm[i] >= readmit:
                out[i] = 0
                calm[i] = 0
                events.append((float(k), float(READMITTED), float(i), 0.0, 0.0, 0.0, 0.0, float(k)))

        if counts[LEARNED] < learn:
            if usual == windows:
                take_in(
                    z[k], other[k], axes, weights, learn, offset, ref, other_ref, counts, known, out
                )
        else:
            counts[LEARNED] += 1
    return events
