"""The unit of a gyro, whether it holds rates or increments, and how its axes stand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import GYRO_UNITS, TIME_UNITS
from strapdown.errors import Finding
from strapdown.formats.inference.clock import mean_step
from strapdown.formats.inference.conclusion import Inference, conclude, evidence, posterior
from strapdown.formats.inference.turn import Turn, signed_permutations, turns

Array = NDArray[np.float64]

# How often a gyro without a stated unit is in each.
_PRIOR = {"rad/s": 0.55, "deg/s": 0.43, "mdeg/s": 0.01, "mrad/s": 0.005, "deg/h": 0.005}
_INCREMENTS = 0.01
_OTHER = 0.02  # turns a second and what else is not known here
# Raw counts of a 16-bit sensor, deg/s each (data sheets of MPU-6050, BMI160, LSM6DS3): 2000 deg/s
# full scale makes them 1.06 mrad/s, near enough to be taken for that.
_COUNTS = [2000.0 / 32768.0 / 2.0**k for k in range(5)] + [0.00875, 0.0175, 0.035, 0.07]
_PRIOR_COUNTS = 0.03
# How often all numbers are whole in each unit; counts always are, but for averages of them.
_WHOLE = {"rad/s": 1e-4, "deg/s": 0.01, "mrad/s": 0.1, "mdeg/s": 0.5, "deg/h": 0.2}
_BROKEN_COUNTS = 0.05
# Gyro and accelerometer of one device share their axes, as a rule; of what does not, a sense of
# rotation that counts the other way and single reversed axes are as common as all else.
_PRIOR_SAME = 0.9
# The gravity of a car or of a swinging arm may follow no turn; then the best fit means nothing.
_PRIOR_FREE = 0.05
# The largest rate of a log, rad/s: from the bias of a good sensor to the full scale of a common
# one (2000 deg/s); little lies below, and nearly nothing above.
_QUIET, _FULL_SCALE = 3e-3, 25.0
# A turn must move gravity by this much, and one unit and one set of axes explain this much of its
# movement, to be evidence; on scales on which it does not, the motion's acceleration is at work.
LEAST_TURN = 0.02  # rad
LEAST_EXPLAINED = 0.85
LEAST_SCALES = 2

# Unit, form, axes (empty where the turn of gravity says nothing), unit of time.
Hypothesis = tuple[str | None, str, str, str]


def _log_magnitude(rate: float) -> float:
    """Logarithm of the density of the largest rate of a log, relative to its plateau."""
    if not rate > 0:
        return -7.0
    below = max(0.0, np.log(_QUIET / rate))
    above = max(0.0, np.log(rate / _FULL_SCALE))
    return float(-below - 6.0 * above)


def infer_gyro(
    ticks: Array,
    gyro: Array,
    force: Array | None,
    time_units: dict[str, float],
    increments: float = _INCREMENTS,
) -> tuple[Inference, Inference, Inference, dict[str, float]]:
    """Conclude unit, form and axes of a gyro, and weigh the units of time by it.

    Parameters
    ----------
    ticks : ndarray, (n,)
        Increasing stamps from the first, in the log's own unit.
    gyro : ndarray, (n, 3)
        In the log's own unit.
    force : ndarray, (n, 3), or None
        Accelerometer in units of gravity; None where gravity is not in it.
    time_units : dict of str to float
        Probability of each unit of time.
    increments : float
        Probability of increments instead of rates; that of the accelerometer, which is of the
        same kind.

    Returns
    -------
    unit, form, axes : Inference
    time_units : dict of str to float
        Weighed anew.
    """
    largest = float(np.quantile(np.linalg.norm(gyro, axis=1), 0.99)) if len(gyro) else 0.0
    # Still sensors read zero in any unit; whole numbers say something where they vary.
    whole = bool((gyro == np.round(gyro)).all()) and float(np.abs(gyro).max(initial=0.0)) >= 3.0
    names, matrices = signed_permutations()
    weights: dict[Hypothesis, float] = {}
    scales: list[tuple[Turn, float]] = []
    likely = {u: p for u, p in time_units.items() if p > 1e-3} or {"s": 1.0}
    base: dict[tuple[str | None, str, str], float] = {}
    by_scale: dict[float, dict[Hypothesis, float]] = {}
    for tau, share in likely.items():
        factor = TIME_UNITS[tau]
        step = mean_step(ticks) * factor
        candidates: dict[tuple[str | None, str], tuple[float, float]] = {}
        for k, count in enumerate(_COUNTS):
            prior = _PRIOR_COUNTS / len(_COUNTS) * (1.0 if whole else _BROKEN_COUNTS)
            candidates[None, f"counts {k}"] = (np.radians(count), prior)
        for unit, scale in GYRO_UNITS.items():
            prior = _PRIOR[unit] * (_WHOLE[unit] if whole else 1.0)
            candidates[unit, "rate"] = (scale, prior * (1 - increments))
            candidates[unit, "increment"] = (scale / step, prior * increments)
        for key, (scale, prior) in candidates.items():
            base[key[0], key[1], tau] = float(
                np.log(share * prior * (1 - _OTHER)) + _log_magnitude(largest * scale)
            )
        base[None, "other", tau] = float(np.log(share * _OTHER))
        found = turns(ticks * factor, gyro, force) if force is not None else ()
        for turn in found:
            if turn.signal < LEAST_TURN:
                continue
            rows = {
                k: turn.log_likelihoods(scale * matrices) for k, (scale, _) in candidates.items()
            }
            if max(float(e.max()) for _, e in rows.values()) < LEAST_EXPLAINED:
                continue
            # Where nine free numbers do much better than any gyro could, motion is in step.
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
            # A fit that means nothing leaves the magnitudes to speak.
            for key in candidates:
                table[key[0], key[1], "", tau] = (
                    base[key[0], key[1], tau] + free + np.log(_PRIOR_FREE)
                )
            table[None, "other", "", tau] = base[None, "other", tau] + free
    # An arm in step with its turn can pass for a gyro on one scale; on two it does not.
    if len(by_scale) < LEAST_SCALES:
        by_scale, scales = {}, []
    for (known, kind, tau), weight in base.items():
        weights[known, kind, "", tau] = weight
        for table in by_scale.values():
            if not any(h[3] == tau and h[2] for h in table):
                table[known, kind, "", tau] = weight
    pooled = [posterior(t) for t in by_scale.values()] or [posterior(weights)]
    # Which scale is free of motion in step with the turn is not known: each has its share.
    total: dict[Hypothesis, float] = {}
    for probabilities in pooled:
        for hypothesis, p in probabilities.items():
            # Counts are rates, in no unit.
            kind = "rate" if hypothesis[1].startswith("counts") else hypothesis[1]
            merged = (hypothesis[0], kind, hypothesis[2], hypothesis[3])
            total[merged] = total.get(merged, 0.0) + p / len(pooled)
    told = _evidence(largest, scales, total)
    axes = {k or None: v for k, v in _marginal(total, 2).items()}
    said_unit = conclude("gyro_unit", _marginal(total, 0), told, "--gyro-unit")
    said_form = conclude("gyro_form", _marginal(total, 1), told)
    times = {str(k): v for k, v in _marginal(total, 3).items()}
    return said_unit, said_form, conclude("gyro_axes", axes, told, "--columns"), times


def _marginal(total: dict[Hypothesis, float], key: int) -> dict[str | None, float]:
    out: dict[str | None, float] = {}
    for hypothesis, p in total.items():
        out[hypothesis[key]] = out.get(hypothesis[key], 0.0) + p
    return dict(sorted(out.items(), key=lambda p: -p[1]))


def _evidence(
    largest: float,
    scales: list[tuple[Turn, float]],
    total: dict[Hypothesis, float],
) -> tuple[Finding, ...]:
    unit = next(iter(_marginal(total, 0)))
    told = []
    if scales:
        turn = max(scales, key=lambda s: (s[1], s[0].signal))[0]
        _, left = turn.free()
        explained = 1.0 - left / turn.gram[9, 9]
        name = next((n for n in _marginal(total, 2) if n), "x,y,z")
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
