"""The unit of a gyro, whether it holds rates or increments, and how its axes stand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import GYRO_UNITS, TIME_UNITS
from strapdown.formats.inference.clock import mean_step
from strapdown.formats.inference.conclusion import Inference, conclude, posterior
from strapdown.formats.inference.turn import Turn, signed_permutations, turns

Array = NDArray[np.float64]

# How often a gyro without a stated unit is in each.
_PRIOR = {"rad/s": 0.55, "deg/s": 0.43, "mdeg/s": 0.01, "mrad/s": 0.005, "deg/h": 0.005}
_INCREMENTS = 0.01
_OTHER = 0.02  # counts, turns a second: nothing known here
_DECADES = 8.0
# Gyro and accelerometer of one device share their axes, as a rule; of what does not, a sense of
# rotation that counts the other way and single reversed axes are as common as all else.
_PRIOR_SAME = 0.9
# The gravity of a car or of a swinging arm may follow no turn; then the best fit means nothing.
_PRIOR_FREE = 0.05
# The largest rate of a log, rad/s: from the bias of a good sensor to the full scale of a common
# one (2000 deg/s); little lies below, and nearly nothing above.
_QUIET, _FULL_SCALE = 3e-3, 25.0
# A turn must move gravity by this much, and explain this much of its movement, to be evidence.
LEAST_TURN = 0.02  # rad
LEAST_EXPLAINED = 0.5


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

    Returns
    -------
    unit, form, axes : Inference
    time_units : dict of str to float
        Weighed anew.
    """
    largest = float(np.quantile(np.linalg.norm(gyro, axis=1), 0.99)) if len(gyro) else 0.0
    names, matrices = signed_permutations()
    weights: dict[tuple[str | None, str, str, str], float] = {}
    scales: list[tuple[Turn, float]] = []
    pooled: list[dict[tuple[str | None, str, str, str], float]] = []
    likely = {u: p for u, p in time_units.items() if p > 1e-3} or {"s": 1.0}
    base: dict[tuple[str | None, str, str], float] = {}
    by_scale: dict[float, dict[tuple[str | None, str, str, str], float]] = {}
    for tau, share in likely.items():
        factor = TIME_UNITS[tau]
        step = mean_step(ticks) * factor
        candidates: dict[tuple[str | None, str], tuple[float, float]] = {}
        for unit, scale in GYRO_UNITS.items():
            candidates[unit, "rate"] = (scale, _PRIOR[unit] * (1 - _INCREMENTS))
            candidates[unit, "increment"] = (scale / step, _PRIOR[unit] * _INCREMENTS)
        for key, (scale, prior) in candidates.items():
            base[key[0], key[1], tau] = float(
                np.log(share * prior * (1 - _OTHER)) + _log_magnitude(largest * scale)
            )
        base[None, "other", tau] = float(np.log(share * _OTHER))
        found = turns(ticks * factor, gyro, force) if force is not None else ()
        for turn in found:
            _, left = turn.free()
            explained = 1.0 - left / max(turn.gram[9, 9], 1e-30)
            if turn.signal < LEAST_TURN or explained < LEAST_EXPLAINED:
                continue
            scales.append((turn, share))
            table = by_scale.setdefault(turn.half_width, {})
            for key, (scale, _) in candidates.items():
                logs, _explained = turn.log_likelihoods(scale * matrices)
                for name, log in zip(names, logs.tolist(), strict=True):
                    same = _PRIOR_SAME if name == "x,y,z" else (1 - _PRIOR_SAME) / 47
                    table[key[0], key[1], name, tau] = (
                        base[key[0], key[1], tau] + log + np.log(same * (1 - _PRIOR_FREE))
                    )
            free = turn.log_free()
            # A fit that means nothing leaves the magnitudes to speak.
            for key in candidates:
                table[key[0], key[1], "", tau] = (
                    base[key[0], key[1], tau] + free + np.log(_PRIOR_FREE)
                )
            table[None, "other", "", tau] = base[None, "other", tau] + free
    for (unit, form, tau), weight in base.items():
        weights[unit, form, "", tau] = weight
        for table in by_scale.values():
            if not any(h[3] == tau and h[2] for h in table):
                table[unit, form, "", tau] = weight
    pooled = [posterior(t) for t in by_scale.values()] or [posterior(weights)]
    # Which scale is free of motion in step with the turn is not known: each has its share.
    share = 1.0 / len(pooled)
    total: dict[tuple[str | None, str, str, str], float] = {}
    for table in pooled:
        for hypothesis, p in table.items():
            total[hypothesis] = total.get(hypothesis, 0.0) + share * p
    evidence = _evidence(largest, scales, total)
    units = _marginal(total, 0)
    forms = _marginal(total, 1)
    axes = {k or None: v for k, v in _marginal(total, 2).items()}
    unit = conclude("gyro_unit", units, evidence, "--gyro-unit")
    form = conclude("gyro_form", forms, evidence)
    times = {str(k): v for k, v in _marginal(total, 3).items()}
    return unit, form, conclude("gyro_axes", axes, evidence, "--columns"), times


def _marginal(
    total: dict[tuple[str | None, str, str, str], float], key: int
) -> dict[str | None, float]:
    out: dict[str | None, float] = {}
    for hypothesis, p in total.items():
        out[hypothesis[key]] = out.get(hypothesis[key], 0.0) + p
    return dict(sorted(out.items(), key=lambda p: -p[1]))


def _evidence(
    largest: float,
    scales: list[tuple[Turn, float]],
    total: dict[tuple[str | None, str, str, str], float],
) -> tuple[str, ...]:
    unit = next(iter(_marginal(total, 0)))
    told = []
    if scales:
        turn = max(scales, key=lambda s: (s[1], s[0].signal))[0]
        best, left = turn.free()
        explained = 1.0 - left / turn.gram[9, 9]
        name = next((n for n in _marginal(total, 2) if n), "x,y,z")
        names, matrices = signed_permutations()
        m = matrices[names.index(name)].reshape(9)
        norm = float(m @ turn.gram[:9, 9] / max(m @ turn.gram[:9, :9] @ m, 1e-300))
        told.append(
            f"over {turn.half_width:g} s gravity turns by {np.degrees(turn.signal):.3g}° rms in the "
            f"accelerometer, and the gyro explains {100 * explained:.3g} % of that at "
            f"{norm:.4g} rad/s a unit"
        )
    else:
        told.append("no turn of gravity to hold the gyro against")
    if unit is not None:
        told.append(
            f"99 % of the rates are below {largest:.4g}, "
            f"{np.degrees(largest * GYRO_UNITS[unit]):.4g} deg/s in {unit}"
        )
    return tuple(told)
