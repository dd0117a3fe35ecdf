"""Inference of a gyro's unit, its form (rates or increments) and its axes."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import MAD_TO_SD, Array
from strapdown.dsp.samples import occupied_grid, running_integral
from strapdown.errors import Finding
from strapdown.formats.inference.conclusion import (
    Inference,
    Steps,
    conclude,
    evidence,
    evidence_of_counts,
    marginal,
    posterior,
)
from strapdown.units import GYRO_UNITS, INFERRED, TIME_UNITS, factor_of

# Prior of the unit of an unlabeled gyro.
_PRIOR = {"rad/s": 0.55, "deg/s": 0.43, "mdeg/s": 0.01, "mrad/s": 0.005, "deg/h": 0.005}
# Beside an accelerometer in mg, as drivers of one maker give both.
_PRIOR_MILLI = {"rad/s": 0.1, "deg/s": 0.55, "mdeg/s": 0.33, "mrad/s": 0.01, "deg/h": 0.01}
_INCREMENTS = 0.01
_OTHER = 0.02  # turns per second and other unlisted units
# Raw counts of a 16-bit sensor, deg/s each (data sheets of MPU-6050, BMI160, LSM6DS3), by the unit
# that a user states. A full scale of 2000 deg/s gives 1.06 mrad/s, close enough to be taken for it.
_OF_COUNTS = {
    "deg/s/16.4": 2000.0 / 32768.0,
    "deg/s/32.8": 1000.0 / 32768.0,
    "deg/s/65.5": 500.0 / 32768.0,
    "deg/s/131": 250.0 / 32768.0,
    "deg/s/262": 125.0 / 32768.0,
    "0.00875 deg/s": 0.00875,
    "0.0175 deg/s": 0.0175,
    "0.035 deg/s": 0.035,
    "0.07 deg/s": 0.07,
}
_COUNTS = list(_OF_COUNTS.values())
_PRIOR_COUNTS = 0.03
# Probability of integers only, for each unit; counts are integers unless averaged.
_WHOLE = {"rad/s": 1e-4, "deg/s": 0.01, "mrad/s": 0.1, "mdeg/s": 0.5, "deg/h": 0.2}
_BROKEN_COUNTS = 0.05
# Steps of 16-bit sensors, deg/s (the same data sheets, by full scale and by sensitivity): rates
# are often written as these times whole numbers. Of so many rates, spread evenly over the log,
# those within so many steps of the median must be in step by the mean of their phases, and so many
# of their neighbors one step apart, or the true step is a multiple.
_STEPS = (
    *(full / 32768.0 for full in (125.0, 250.0, 500.0, 1000.0, 2000.0)),
    *(1.0 / count for count in (16.4, 32.8, 65.5, 131.0, 262.4)),
    *(0.004375, 0.00875, 0.0175, 0.035, 0.07),
)
_OF_RATES, _WITHIN, _IN_STEP, _NEIGHBORS, _LEAST_SPREAD = 6000, 300.0, 0.85, 0.3, 5.0
_LEAST_RATES = 100
# The mean over so many differs from that over all by 0.03 (1 sd).
_OF_SOME, _SOME_IN_STEP = 500, 0.7
# Values that are few have a step of their own: not more than this in any sensor of today, rad/s,
# but in one log of so many; a round number is how it was written. Steps that agree better than this
# are the same: half of what 1/16.4 deg/s is from 2000/32768.
_COARSE, _OF_OLD, _FEW, _EXACT = np.radians(1.0), 0.005, 400, 5e-4
# Half of all logs keep the steps of their sensor; in four decades of steps the chance that
# others are in step with one of these, times the spread in steps.
_CHANCE = len(_STEPS) * 2.0 * np.sqrt(-2.0 * np.log(_IN_STEP)) / (2.0 * np.pi) / np.log(1e4)
# Gyro and accelerometer of one device usually share their axes. The rest of the prior is even:
# reversed sense of rotation and single reversed axes are as common as all other cases.
_PRIOR_SAME = 0.9
# In a car or on a swinging arm gravity may not follow the rotation; the best fit is then void.
_PRIOR_FREE = 0.05
# Range of the largest rate of a log, rad/s: from the bias of a good sensor to the full scale of a
# common one (2000 deg/s).
_QUIET, _FULL_SCALE = 3e-3, 25.0
# Evidence requires that rotation moves gravity by this much, and that one unit and one set of axes
# explain this fraction of the movement; on other time scales acceleration dominates.
LEAST_TURN = 0.02  # rad
LEAST_EXPLAINED = 0.85
LEAST_SCALES = 2
# A unit by which gravity would have turned where it stood still is excluded, but for so rare a
# motion as a roll in flight whose force keeps size and direction.
_ROLLED = 1e-3

# Unit, form, axes (empty if the rotation of gravity is inconclusive), unit of time.
Hypothesis = tuple[str | None, str, str, str]


def infer_gyro(
    ticks: Array,
    gyro: Array,
    force: Array | None,
    time_units: dict[str, float],
    increments: float = _INCREMENTS,
    milli: float = 0.0,
) -> tuple[Inference, Inference, Inference, Inference, dict[str, float]]:
    """Infer unit, form, axes and scale of a gyro; update the probabilities of the units of time.

    `ticks` ((n,)): increasing stamps from the first, in the log's own unit. `gyro` ((n, 3)): in the
    log's own unit. `force` ((n, 3), or None): accelerometer in units of gravity; None if gravity
    has been removed. `time_units`: probability of each unit of time. `increments`: prior
    probability of increments instead of rates: that of the accelerometer, which usually has the
    same form. `milli`: probability that the accelerometer is in mg. Returns `time_units`: updated
    probabilities.
    """
    largest = float(np.quantile(np.linalg.norm(gyro, axis=1), 0.99)) if len(gyro) else 0.0
    # Stationary sensors read zero in any unit; integers are evidence only where they vary.
    whole = bool((gyro == np.round(gyro)).all()) and float(np.abs(gyro).max(initial=0.0)) >= 3.0
    names, matrices = signed_permutations()
    weights: dict[Hypothesis, float] = {}
    scales: list[tuple[Turn, float]] = []
    likely = {u: p for u, p in time_units.items() if p > 1e-3} or {"s": 1.0}
    written = _written_step(gyro)
    usual = {unit: GYRO_UNITS[unit] for unit in INFERRED["gyro"]}
    steps = {unit: _in_steps(gyro, scale, written) for unit, scale in usual.items()}
    base: dict[tuple[str | None, str, str], float] = {}
    by_scale: dict[float, dict[Hypothesis, float]] = {}
    stood: list[Finding] = []
    scale_of_all: Scale | None = None
    odd: Finding | None = None
    for tau, share in likely.items():
        factor = factor_of(tau, TIME_UNITS)
        step = Steps.of(ticks).mean * factor
        candidates: dict[tuple[str | None, str], tuple[float, float]] = {}
        for k, count in enumerate(_COUNTS):
            prior = _PRIOR_COUNTS / len(_COUNTS) * (1.0 if whole else _BROKEN_COUNTS)
            candidates[None, f"counts {k}"] = (np.radians(count), prior)
        for unit, scale in usual.items():
            prior = milli * _PRIOR_MILLI[unit] + (1.0 - milli) * _PRIOR[unit]
            prior *= _WHOLE[unit] if whole else 1.0
            prior *= 1.0 + steps[unit][1]
            prior *= _OF_OLD if written[0] * scale > _COARSE else 1.0
            candidates[unit, "rate"] = (scale, prior * (1 - increments))
            candidates[unit, "increment"] = (scale / step, prior * increments)
        for key, (scale, prior) in candidates.items():
            # Log density of the largest rate of a log, relative to its plateau.
            magnitude, rate = -7.0, largest * scale
            if rate > 0:
                below = max(0.0, np.log(_QUIET / rate))
                magnitude = float(-below - 6.0 * max(0.0, np.log(rate / _FULL_SCALE)))
            base[key[0], key[1], tau] = float(np.log(share * prior * (1 - _OTHER)) + magnitude)
        base[None, "other", tau] = float(np.log(share * _OTHER))
        found = turns(ticks * factor, gyro, force) if force is not None else ()
        if share > 0.5:
            scale_of_all = scale_by_gravity(found)
            odd = None if force is None else axis_in_other_unit(found, force)
        for key, (scale, _) in candidates.items():
            beyond = [(turn.beyond_stillness(scale), turn.half_width) for turn in found]
            beyond = sorted((b for b in beyond if b[0] > STILL_TURN), reverse=True)
            if len(beyond) < LEAST_SCALES:
                continue
            base[(*key, tau)] += float(np.log(_ROLLED))
            if key[1] == "rate" and share > 0.5:
                data = {"turn_deg": np.degrees(beyond[0][0]), "half_width_s": beyond[0][1]}
                stood.append(evidence("io.evidence-gravity-stood-still", unit=key[0], **data))
        for turn in found:
            if turn.signal < LEAST_TURN:
                continue
            rows = {
                k: turn.log_likelihoods(scale * matrices) for k, (scale, _) in candidates.items()
            }
            if max(float(e.max()) for _, e in rows.values()) < LEAST_EXPLAINED:
                continue
            # Nine free parameters that fit far better than any gyro show in-phase motion.
            free = turn.log_free()
            if max(float(logs.max()) for logs, _ in rows.values()) < free + np.log(_PRIOR_FREE):
                continue
            scales.append((turn, share))
            table = by_scale.setdefault(turn.half_width, {})
            for key, (logs, _) in rows.items():
                for name, log in zip(names, logs.tolist(), strict=True):
                    same = _PRIOR_SAME if name == "x,y,z" else (1 - _PRIOR_SAME) / 47
                    table[key[0], key[1], name, tau] = (
                        base[key[0], key[1], tau] + log + np.log(same * (1 - _PRIOR_FREE))
                    )
            # A void fit leaves the magnitudes as evidence.
            for key in candidates:
                table[key[0], key[1], "", tau] = (
                    base[key[0], key[1], tau] + free + np.log(_PRIOR_FREE)
                )
            table[None, "other", "", tau] = base[None, "other", tau] + free
    # An arm in phase with its rotation can pass for a gyro on one time scale, but not on two.
    if len(by_scale) < LEAST_SCALES:
        by_scale, scales = {}, []
    for (known, kind, tau), weight in base.items():
        weights[known, kind, "", tau] = weight
        for table in by_scale.values():
            if not any(h[3] == tau and h[2] for h in table):
                table[known, kind, "", tau] = weight
    pooled = [posterior(t) for t in by_scale.values()] or [posterior(weights)]
    # Which time scale is free of in-phase motion is not known: each contributes its share.
    total: dict[Hypothesis, float] = {}
    counts = dict.fromkeys(_OF_COUNTS, 0.0)
    for probabilities in pooled:
        for hypothesis, p in probabilities.items():
            if hypothesis[1].startswith("counts"):
                counts[list(counts)[int(hypothesis[1].split()[1])]] += p / len(pooled)
            # Counts are rates in an unknown unit.
            kind = "rate" if hypothesis[1].startswith("counts") else hypothesis[1]
            merged = (hypothesis[0], kind, hypothesis[2], hypothesis[3])
            total[merged] = total.get(merged, 0.0) + p / len(pooled)
    told = (*_evidence(largest, scales, total), *stood)
    best = next(iter(marginal(total, 0)))
    if best is not None and steps[best][1]:
        told += (evidence("io.evidence-steps-of-sensor", step=steps[best][0], unit=best),)
    if whole and scales:
        told += evidence_of_counts(counts)
    axes = {k or None: v for k, v in marginal(total, 2).items()}
    said_unit = conclude("gyro_unit", marginal(total, 0), told, "--gyro-unit")
    said_form = conclude("gyro_form", marginal(total, 1), told)
    times = {str(k): v for k, v in marginal(total, 3).items()}
    said_axes = conclude("gyro_axes", axes, told, "--columns")
    return said_unit, said_form, said_axes, _said_of_scale(scale_of_all, odd), times


def _said_of_scale(scale: Scale | None, odd: Finding | None) -> Inference:
    """Return the factor to rad/s by which a gyro explains the turning of gravity, if one does.

    `odd`: evidence that one axis has another than the others.
    """
    if odd is not None:
        return Inference("gyro_scale", None, 1.0, (odd,))
    if scale is None:
        return Inference("gyro_scale", None, 1.0, (evidence("io.evidence-no-turn-of-gravity"),))
    told = evidence(
        "io.evidence-scale-by-gravity",
        scale=scale.factor,
        low=scale.low,
        high=scale.high,
        percent=100.0 * scale.share,
    )
    return Inference("gyro_scale", scale.factor, 0.95, (told,))


def _in_steps(gyro: Array, scale: float, written: tuple[float, float]) -> tuple[float, float]:
    """Step of a common sensor that the rates are multiples of, and its log-likelihood ratio.

    `scale`: of their unit, rad/s. `written`: as of `_written_step`. Returns `step`, in that unit,
    zero if there is none; `gain`: of the probability of a unit in which there is one.
    """
    sizes = np.radians(_STEPS) / scale
    step, blur = written
    if step and (off := np.abs(sizes / step - 1.0)).min() < (near := max(_EXACT, blur)):
        return float(sizes[off.argmin()]), np.log(1e4) / (2.0 * near * len(_STEPS))
    part = gyro[:: max(1, len(gyro) // _OF_RATES)]
    part = part - np.median(part, axis=0)
    # In order of their sizes, the median of those below a limit needs no search.
    ordered = np.sort(np.abs(part), axis=0)
    found = (0.0, 0.0)
    for step in sizes.tolist():
        spreads = []
        for axis, rates in zip(part.T, ordered.T, strict=True):
            count = int(np.searchsorted(rates, _WITHIN * step))
            if count < _LEAST_RATES:
                continue
            middle = 0.5 * (rates[(count - 1) // 2] + rates[count // 2])
            spread = MAD_TO_SD * float(middle) / step
            if spread < _LEAST_SPREAD:
                continue
            k = axis[np.abs(axis) < _WITHIN * step] / step
            # Some show that most steps are none.
            some = _phase(k[:: 1 + k.size // _OF_SOME])
            phase = _phase(k) if abs(some) > _SOME_IN_STEP else some
            if abs(phase) <= _IN_STEP:
                spreads.append(0.0)
                continue
            apart = np.diff(np.unique(np.round(k - np.angle(phase) / (2.0 * np.pi))))
            spreads.append(spread if np.mean(apart == 1.0) > _NEIGHBORS else 0.0)
        # Every axis that moves has the step, and the finest spread decides.
        if spreads and min(spreads) / _CHANCE > found[1]:
            found = (step, min(spreads) / _CHANCE)
    return found


def _phase(numbers: Array) -> complex:
    """Mean of the phases of numbers within whole ones."""
    turn = 2.0 * np.pi * numbers
    return complex(np.cos(turn).mean(), np.sin(turn).mean())


def _written_step(gyro: Array) -> tuple[float, float]:
    """Step of values that are few, in their unit, and its relative error by their digits.

    Zero if they are many, if they are multiples of no step, or if it is a round one.
    """
    found = (0.0, np.inf)
    for axis in gyro.T:
        values = np.unique(axis)
        if not 4 <= len(values) <= _FEW:
            continue
        steps = np.round((values - values[0]) / np.diff(values).min())
        # Written with few digits, the values are off by up to half of the last one.
        step = float(np.ptp(values) / steps[-1])
        number = steps @ (values - values.mean()) / (steps @ (steps - steps.mean()))
        off = float(np.abs(values - values.mean() - number * (steps - steps.mean())).max())
        blur = 2.0 * off / float(np.ptp(values))
        digits = step / 10.0 ** np.floor(np.log10(step))
        round_one = min(abs(digits / one - 1.0) for one in (1.0, 2.0, 5.0, 10.0)) < 0.01
        if off < 0.1 * step and blur < found[1] and not round_one:
            found = (float(number), blur)
    return found


def _evidence(
    largest: float, scales: list[tuple[Turn, float]], total: dict[Hypothesis, float]
) -> tuple[Finding, ...]:
    unit = next(iter(marginal(total, 0)))
    told = []
    if scales:
        turn = max(scales, key=lambda s: (s[1], s[0].signal))[0]
        _, left = turn.free()
        explained = 1.0 - left / turn.gram[9, 9]
        name = next((n for n in marginal(total, 2) if n), "x,y,z")
        names, matrices = signed_permutations()
        m = matrices[names.index(name)].reshape(9)
        norm = float(m @ turn.gram[:9, 9] / max(m @ turn.gram[:9, :9] @ m, 1e-300))
        told.append(
            evidence(
                "io.evidence-gravity-turns",
                half_width_s=turn.half_width,
                turn_deg=np.degrees(turn.signal),
                percent=100 * explained,
                scale=norm,
            )
        )
    else:
        told.append(evidence("io.evidence-no-turn-of-gravity"))
    if unit == "deg/s":
        told.append(evidence("io.evidence-rates", largest=largest))
    elif unit is not None:
        rate = np.degrees(largest * GYRO_UNITS[unit])
        told.append(evidence("io.evidence-rates-in-unit", largest=largest, unit=unit, deg_s=rate))
    return tuple(told)


# Rotation of gravity in the body, as measured by the accelerometer and predicted by the gyro.
#
# A specific force that is constant in the world obeys df/dt = -w x f in the body (differentiate
# f_b = C_bn f_n with dC_bn/dt = -[w x] C_bn). Weighted with a triangle of half-width T and
# integrated by parts, the left side becomes the difference of two adjacent means of f over T,
# without an assumption on how far the body turns in between. The residual is the motion's own
# acceleration, whose means over T hold no more than the change of velocity in T.
#
# With unknown gyro scale k, axes M (a signed permutation of the gyro's axes) and bias b,
# w = k M g + b is linear in (k M, b), so one small Gram matrix serves all hypotheses.


# Long enough for the accelerations of hands and legs to average out, and of different lengths,
# so that an acceleration in phase with the rotation (a swinging arm), which grows with the square
# of the frequency, does not look the same in all.
HALF_WIDTHS = (0.5, 1.0, 2.0, 4.0)  # s
LEAST_WINDOWS = 3
# A scale factor of 3 % and misalignments of 1 to 2 degrees are in the data sheets of consumer
# sensors, and the acceleration of an arm in phase with its rotation adds to them; smaller
# differences are not significant. Units differ by far more.
MODEL_ERROR = 0.1
# Zero-rate output, one sigma (MPU-6050 data sheet: within 20 deg/s).
BIAS_SD = 0.12  # rad/s
# Where the means of the force over both halves of a window have its usual norm within this, the
# force did not turn within them, and gravity is within 11° of it in a body that accelerates along
# the ground; it turned by less than twice that, or somewhat more, as a clock and a gyro have
# errors. So many of the windows must be so, and of these so many must say the same.
CALM, STILL_TURN, _OF_WINDOWS, _SAYING = 0.02, 0.5, 0.2, 0.25
# Largest zero-rate output, and the angle between gravity and the axis of a turn about it, with
# sensors out of line: 30 deg/s and 3° are beyond those of any data sheet above.
_LARGEST_BIAS, _ALONG = 0.52, np.arccos(1.0 / (1.0 + CALM)) + np.radians(3.0)
# Below this an offset or a scale error of the accelerometer could rotate the direction as much.
LEAST_SIGNAL = 1e-4  # of gravity
_LEVI_CIVITA = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    _LEVI_CIVITA[_i, _j, _k], _LEVI_CIVITA[_i, _k, _j] = 1.0, -1.0


@cache
def signed_permutations() -> tuple[tuple[str, ...], Array]:
    """List the 48 mappings of the gyro's axes to the accelerometer's, the identity first.

    Returns `names`: as ``x,-y,z``: the gyro axis along each axis of the accelerometer; `matrices`
    ((48, 3, 3)).
    """
    names, matrices = [], []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            names.append(
                ",".join(
                    ("-" if s < 0 else "") + "xyz"[k] for k, s in zip(order, signs, strict=True)
                )
            )
            matrices.append(np.eye(3)[list(order)] * np.array(signs)[:, None])
    return tuple(names), np.array(matrices)


@dataclass(frozen=True)
class Turn:
    """Sums of one time scale, from which every hypothesis is evaluated.

    `half_width` (s). `windows`: number of windows without overlap. `gram` ((10, 10)): for the nine
    elements of k M (row by row) and the change of gravity, with the bias eliminated; gravity has
    norm 1. `still_rates`, `still_force` ((m, 3)): integral of the gyro over each window in which
    gravity is constant, weighted, in its unit times s, and the direction of the force there; empty
    if these are few.
    """

    half_width: float
    windows: int
    gram: Array
    still_rates: Array
    still_force: Array

    @property
    def signal(self) -> float:
        """Root mean square change of gravity's direction, rad, without that explained by a bias."""
        return float(np.sqrt(max(self.gram[9, 9], 0.0) / max(6 * self.windows, 1)))

    def free(self) -> tuple[Array, float]:
        """Fit the nine elements; return them and the residual sum of squares."""
        a, c = self.gram[:9, :9], self.gram[:9, 9]
        scale = np.sqrt(np.diag(a))
        scale = np.where(scale > 0, scale, 1.0)
        # Axes without rotation stay zero.
        best = np.linalg.pinv(a / np.outer(scale, scale), rcond=1e-9, hermitian=True) @ (c / scale)
        best = best / scale
        return best.reshape(3, 3), float(max(self.gram[9, 9] - c @ best, 0.0))

    def log_likelihoods(self, matrices: Array) -> tuple[Array, Array]:
        """Compute the log likelihood of each (m, 3, 3) matrix k M, and the explained fraction.

        Relative to a gyro that predicts no change, so that windows of different units of time
        compare. The unknown noise is integrated out, which gives the power -windows / 2 of the
        sum of squares, to which the model's own error is added.
        """
        c = matrices.reshape(len(matrices), 9)
        a = np.einsum("ni,ij,nj->n", c, self.gram[:9, :9], c)
        left = np.maximum(self.gram[9, 9] - 2.0 * c @ self.gram[:9, 9] + a, 0.0)
        floor = MODEL_ERROR**2 * np.maximum(a, 0.0) + 6 * self.windows * LEAST_SIGNAL**2
        logs = -0.5 * self.windows * np.log((left + floor) / self._nothing())
        return logs, 1.0 - left / max(self.gram[9, 9], 1e-30)

    def beyond_stillness(self, scale: float) -> float:
        """Compute how far a gyro turns gravity where it stood still, rad.

        At least, whichever axes the gyro has, with a bias, and where gravity is near the force: in
        the share of these windows that decides. `scale`: of its unit, rad/s.
        """
        least = scale * self._unbiased
        if least > STILL_TURN:
            bias = scale * self.still_rates.mean(axis=0)
            most = _LARGEST_BIAS * self.half_width
            bias *= min(1.0, most / max(float(np.linalg.norm(bias)), 1e-300))
            least = min(least, self._across(scale * self.still_rates - bias))
        return least

    @cached_property
    def _unbiased(self) -> float:
        """`beyond_stillness` of a gyro without a bias, in its unit times s."""
        return self._across(self.still_rates) if len(self.still_rates) else 0.0

    def _across(self, rates: Array) -> float:
        """Compute the part of turns that moves gravity, with the axes that make it the least."""
        size = np.linalg.norm(rates, axis=1)
        # Reversed axes turn gravity as far: of 48 permutations half are enough.
        halves = signed_permutations()[1].reshape(6, 8, 3, 3)[:, :4].reshape(24, 3, 3)
        along = np.abs((halves @ rates.T * self.still_force.T).sum(axis=1))
        cosine = np.minimum(along / np.maximum(size, 1e-300), 1.0)
        sine = np.sqrt(1.0 - cosine * cosine)
        # The sine of the angle that is beyond the cone about the force.
        across = size * np.maximum(sine * np.cos(_ALONG) - cosine * np.sin(_ALONG), 0.0)
        deciding = int((1.0 - _SAYING) * across.shape[1])
        return float(np.partition(across, deciding, axis=1)[:, deciding].min())

    def _nothing(self) -> float:
        """Residual sum of squares of a gyro that predicts no change."""
        return float(self.gram[9, 9] + 6 * self.windows * LEAST_SIGNAL**2)

    def log_free(self) -> float:
        """Log likelihood of nine free elements, each with the penalty of a parameter."""
        best, left = self.free()
        c = best.reshape(9)
        predicted = float(c @ self.gram[:9, :9] @ c)
        floor = MODEL_ERROR**2 * predicted + 6 * self.windows * LEAST_SIGNAL**2
        # Usually five of nine elements are excited; each costs sqrt(windows). Their common scale
        # may lie anywhere in eight decades, and is determined within a tenth.
        log = -0.5 * self.windows * np.log((left + floor) / self._nothing())
        cost = 2.5 * np.log(max(self.windows, 2)) + np.log(8.0 * np.log(10.0) / MODEL_ERROR)
        return float(log - cost)


@dataclass(frozen=True)
class Scale:
    """The factor from a gyro's numbers to rad/s by which it explains how gravity turned.

    `factor` (rad/s per unit), `low`, `high`: its 95 % interval. `axes`: as of
    `signed_permutations`. `share`: of the turning that is explained, the least of all time scales.
    """

    factor: float
    low: float
    high: float
    axes: str
    share: float


#: Share of the turning of gravity that one factor and one set of axes must explain, and how far
#: nine free elements may be beyond it; how near the factors of two time scales have to be, and the
#: standard deviation that the scale factor of a consumer sensor and the acceleration of the arm on
#: which it turns leave.
_EXPLAINED, _FREELY, _AGREES, _SCALE_SD = 0.9, 0.05, 0.1, 0.07


def scale_by_gravity(found: Sequence[Turn]) -> Scale | None:
    """Find the factor of a gyro by the turning of gravity; None where that does not determine it.

    `found`: sums of time scales, of which two at least have to agree.
    """
    names, matrices = signed_permutations()
    m = matrices.reshape(len(names), 9)
    rows = []
    for turn in found:
        if turn.signal < LEAST_TURN:
            continue
        whole = turn.gram[9, 9]
        size = np.maximum(np.einsum("ni,ij,nj->n", m, turn.gram[:9, :9], m), 1e-300)
        factor = m @ turn.gram[:9, 9] / size
        share = np.where(factor > 0.0, factor**2 * size / whole, 0.0)
        best = 0 if share[0] > share.max() - 0.02 else int(np.argmax(share))
        _, left = turn.free()
        if share[best] < _EXPLAINED or 1.0 - left / whole > share[best] + _FREELY:
            continue
        # Six rows of a window overlap with those of the next by half.
        spread = 2.0 * whole * (1.0 - share[best]) / (6 * turn.windows) / size[best]
        rows.append((best, float(factor[best]), float(np.sqrt(spread)), float(share[best])))
    if len(rows) < LEAST_SCALES or len({best for best, *_ in rows}) > 1:
        return None
    factors, sds = np.array([f for _, f, _, _ in rows]), np.array([sd for _, _, sd, _ in rows])
    if factors.max() > (1.0 + _AGREES) * factors.min():
        return None
    weights = 1.0 / np.maximum(sds, 1e-6 * factors) ** 2
    mean = float(weights @ factors / weights.sum())
    # The windows of all time scales are of one motion: the least deviation of any.
    sd = float(np.sqrt(sds.min() ** 2 + np.var(factors) + (_SCALE_SD * mean) ** 2))
    explained = min(one for *_, one in rows)
    return Scale(mean, mean - 1.96 * sd, mean + 1.96 * sd, names[rows[0][0]], explained)


#: How much more of the turning of gravity a gyro with one axis in another unit must explain than
#: any gyro of one unit. An axis on which so much of the force stays is nearly vertical: turning
#: about it does not turn gravity, and of a vehicle the force beside it is acceleration.
_MORE, _VERTICAL = 0.1, 0.9


def axis_in_other_unit(found: Sequence[Turn], force: Array) -> Finding | None:
    """Find one axis of a gyro in deg/s beside two in rad/s, or the reverse, by turning gravity.

    `found`: sums of time scales, of which two at least have to agree. `force` ((n, 3)): of all
    samples. Returns evidence with the axis, the unit that it has beside the others, and the least
    share explained; None otherwise.
    """
    kinds = [(k, factor) for k in range(3) for factor in (np.degrees(1.0), np.radians(1.0))]
    m = np.array([np.diag([1.0 / f if j == k else 1.0 for j in range(3)]) for k, f in kinds])
    alike, rows = signed_permutations()[1].reshape(-1, 9), []
    for turn in found:
        if turn.signal < LEAST_TURN:
            continue
        mixed, plain = _shares(turn, m.reshape(-1, 9)), _shares(turn, alike)
        best = int(np.argmax(mixed))
        if mixed[best] >= _EXPLAINED and mixed[best] > plain.max() + _MORE:
            rows.append((best, float(mixed[best])))
        elif plain.max() >= _EXPLAINED:
            return None
    if len(rows) < LEAST_SCALES or len({best for best, _ in rows}) > 1:
        return None
    k, factor = kinds[rows[0][0]]
    if abs(force[:, k].mean()) > _VERTICAL * np.sqrt(np.square(force).sum(axis=1).mean()):
        return None
    units = ("deg/s", "rad/s") if factor > 1.0 else ("rad/s", "deg/s")
    return evidence(
        "io.evidence-axis-in-other-unit",
        axis="xyz"[k],
        unit=units[0],
        others=units[1],
        percent=100.0 * min(share for _, share in rows),
    )


def _shares(turn: Turn, m: Array) -> Array:
    """Return the share of the turning that each of (n, 9) matrices explains, by its own factor."""
    size = np.maximum(np.einsum("ni,ij,nj->n", m, turn.gram[:9, :9], m), 1e-300)
    factor = m @ turn.gram[:9, 9] / size
    return np.where(factor > 0.0, factor**2 * size / turn.gram[9, 9], 0.0)


def turns(time: Array, gyro: Array, force: Array) -> tuple[Turn, ...]:
    """Compute the sums of each time scale that the log is long enough for.

    `time` ((n,), s): increasing. `gyro` ((n, 3)): in any unit. `force` ((n, 3)): in units of
    gravity, with either sign.
    """
    step = np.diff(time)
    # (w x f)_a = e_abc w_b f_c; products of the gyro's axis d and the force's axis c.
    products = (gyro[:, :, None] * force[:, None, :]).reshape(-1, 9)
    signals = np.hstack([force, products, gyro])
    once = running_integral(time, signals)
    twice = running_integral(time, once)
    holes = step > max(0.1, 5.0 * float(np.quantile(step, 0.95)))
    found = []
    for width in HALF_WIDTHS:
        if time[-1] - time[0] < (LEAST_WINDOWS + 1) * width or float(np.median(step)) > width / 4:
            continue
        found += _turn(time, once, twice, holes, width)
    return tuple(found)


def _turn(
    time: Array, once: Array, twice: Array, holes: NDArray[np.bool_], width: float
) -> list[Turn]:
    half, end = 0.5 * width, time[-1] - 2 * width + 1e-9
    grid = occupied_grid(time, end, half, half)
    # At the samples, where the integrals are known.
    at = np.array([np.searchsorted(time, grid + k * width) for k in (0, 1, 2)])
    at = np.minimum(at, time.size - 1)
    hole = np.concatenate([[0], np.cumsum(holes)])
    i0, i1, i2 = at
    keep = (hole[i2] == hole[i0]) & (i1 - i0 >= 3) & (i2 - i1 >= 3)
    i0, i1, i2 = i0[keep], i1[keep], i2[keep]
    windows = int(keep.sum()) // 2
    if windows < LEAST_WINDOWS:
        return []
    w1, w2 = (time[i1] - time[i0])[:, None], (time[i2] - time[i1])[:, None]
    # A triangle that rises over w1 and falls over w2, by parts: P at the peak minus the mean of P
    # over the rise, and the mean of P over the fall minus P at the peak.
    y = (once[i2] - once[i1])[:, :3] / w2 - (once[i1] - once[i0])[:, :3] / w1
    weighted = (twice[i2] - twice[i1]) / w2 - (twice[i1] - twice[i0]) / w1
    f_weighted, p_weighted = weighted[:, :3], weighted[:, 3:12].reshape(-1, 3, 3)
    # Regressor of element M[b, d]: -e_abc (weighted product d, c).
    x = -np.einsum("abc,ndc->nabd", _LEVI_CIVITA, p_weighted).reshape(-1, 9)
    bias = -np.einsum("abc,nc->nab", _LEVI_CIVITA, f_weighted).reshape(-1, 3)
    block = np.column_stack([x, y.reshape(-1)])
    # The unexplained spread sets how tightly the bias is held within its range.
    scale = np.linalg.norm(block, axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    full = np.column_stack([x / scale[:9], bias])
    left = block[:, 9] - full @ np.linalg.lstsq(full, block[:, 9], rcond=1e-9)[0]
    noise = float(np.sqrt(np.mean(left**2)) + LEAST_SIGNAL) / BIAS_SD
    held = bias.T @ bias + noise**2 * np.eye(3)
    cross = bias.T @ block
    gram = block.T @ block - cross.T @ np.linalg.solve(held, cross)
    means = np.array([(once[i1] - once[i0])[:, :3] / w1, (once[i2] - once[i1])[:, :3] / w2])
    calm = (np.abs(np.linalg.norm(means, axis=2) - 1.0) < CALM).all(axis=0)
    calm &= np.linalg.norm(y, axis=1) < STILL_TURN
    if calm.sum() < max(2 * LEAST_WINDOWS, _OF_WINDOWS * calm.size):
        calm[:] = False
    force = means.mean(axis=0)[calm]
    force /= np.linalg.norm(force, axis=1, keepdims=True)
    return [Turn(width, windows, gram, weighted[calm, 12:], force)]
