"""Observations within the linear range of a robust rule, and the learned scale of their errors.

Within that range a robust update is Kalman's with a scaled variance: a compiled loop takes such
observations, whatever the influence function is beyond it, and asks the rule for the others.
"""

from __future__ import annotations

import math

import numpy as np

from strapdown._kernels.compilation import njit
from strapdown._kernels.covariance import (
    dense_expect,
    joseph_take,
    plain_take,
    ud_expect,
    ud_take,
    wd_begin,
    wd_expect,
    wd_finish,
    wd_take,
)

# Forms of a covariance: the matrix, by two updates; its factors, by two.
JOSEPH, PLAIN, UD, WD = 0, 1, 2, 3
# Layout of a rule: end of the linear range; factor of the standard deviation; whether that is
# learned, and how: `estimation.robust.AdaptiveScale`, with the bounds of `LOG_SQUARE`, and the mean
# of the clipped square of a normal number with the part of it within the clip.
LINEAR, FACTOR, LEARNS, MEMORY, LOWEST, HIGHEST, CLIP, MEAN, WITHIN = range(9)
# Layout of a learned scale: `estimation.robust.ScaleState`.
LOG_SQUARE, INFORMATION, REJECTED, SETTLED, NU, TIME, JUMP, HELD, SINCE = range(9)
# Weight from which on an observation agrees with the estimate.
HALF = 0.5
# Layout of a step beyond the linear range, of each component: whether it is known (`NO`, `YES`) or
# asked for (`ASKED`); then what `estimation.covariance.UpdateRule.step` gives, moved, slope,
# variance and weight, or, asked for, what it takes: innovation and variance of the prediction.
NO, YES, ASKED = 0.0, 1.0, -1.0
KNOWN, MOVED, SLOPE, VARIANCE, WEIGHT = range(5)


@njit(cache=True, error_model="numpy")
def learned_scale(log_square, information, nu, s, r, rule):
    """Return the logarithm of the squared factor, and its information, after an observation.

    `nu`, `s`, `r`: innovation, variances of the prediction and of the observation as stated.
    """
    own = math.exp(log_square) * r
    total = s + own
    if not (math.isfinite(nu) and total > 0.0 and own > 0.0):
        return log_square, information
    share = own / total
    excess = min(nu * nu / total, rule[CLIP] * rule[CLIP]) - rule[MEAN]
    information += share * share * (1.0 - information / rule[MEMORY])
    square = log_square + share * excess / (rule[WITHIN] * information)
    return min(max(square, rule[LOWEST]), rule[HIGHEST]), information


@njit(cache=True, error_model="numpy")
def take_by_steps(form, covariance, x, z, H, R, rule, scales, steps, time, of_place, told):
    """Process the components of an observation; return whether all were processed.

    `scales` ((l, 9)): of each component, changed. `steps` ((l, 5)): known steps of components
    beyond the linear range; the first whose step is not known is asked for. `told`: innovations,
    ``h P h' + R``, weights. Where False is returned, covariance and x are undefined, and `scales`
    are as before; so it is, without a step asked for, after a rejection, and in a time in which the
    observation is doubted.
    """
    count = z.shape[0]
    if rule[LEARNS] != 0.0:
        for j in range(count):
            if scales[j, REJECTED] > 0.0 or time < scales[j, HELD]:
                return False
    W, d = covariance, covariance[0]
    if form == WD:
        W, d, _ = wd_begin(covariance, covariance, covariance, False, count)
    work = np.empty((4, W.shape[1]))
    for j in range(count):
        if form == WD:
            nu, s = wd_expect(W, d, x, z, H, j, work)
        elif form == UD:
            nu, s = ud_expect(W, d, x, z, H, j, work)
        else:
            nu, s = dense_expect(W, d, x, z, H, j, work)
        factor = rule[FACTOR]
        if rule[LEARNS] != 0.0:
            factor = math.exp(0.5 * scales[j, LOG_SQUARE])
        r = R[j] * (factor * factor)
        if not (math.isfinite(nu) and math.isfinite(s) and R[j] >= 0.0):
            return False
        moved, slope, weight = nu, 1.0, 1.0
        # An infinite range of an exact observation is not a number.
        if not (abs(nu) <= rule[LINEAR] * math.sqrt(s + r) or r == 0.0):
            if steps[j, KNOWN] != YES:
                steps[j, KNOWN], steps[j, MOVED], steps[j, SLOPE] = ASKED, nu, s
                return False
            moved, slope, r, weight = (
                steps[j, MOVED],
                steps[j, SLOPE],
                steps[j, VARIANCE],
                steps[j, WEIGHT],
            )
        if form == WD:
            wd_take(W, d, x, H, j, work, s, moved, slope, r)
        elif form == UD:
            ud_take(W, d, x, H, j, work, s, moved, slope, r)
        elif form == JOSEPH:
            joseph_take(W, d, x, H, j, work, s, moved, slope, r)
        else:
            plain_take(W, d, x, H, j, work, s, moved, slope, r)
        told[0, j], told[1, j], told[2, j] = nu, s + R[j], weight
    if form == WD and wd_finish(W, d, covariance) >= 0:
        return False
    if rule[LEARNS] != 0.0:
        for j in range(count):
            now = scales[j]
            now[LOG_SQUARE], now[INFORMATION] = learned_scale(
                now[LOG_SQUARE], now[INFORMATION], told[0, j], told[1, j] - R[j], R[j], rule
            )
            now[SETTLED] = now[SETTLED] + 1.0 if told[2, j] >= HALF else 0.0
            if of_place:
                now[NU], now[TIME] = told[0, j], time
                if not math.isfinite(now[SINCE]):
                    now[SINCE], now[HELD] = time, -math.inf
    for j in range(count):
        steps[j, KNOWN] = NO
    return True
