"""Inference of an accelerometer's unit and form, from gravity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import MAD_TO_SD, STANDARD_GRAVITY
from strapdown.formats.inference.conclusion import Inference, conclude, evidence, posterior

Array = NDArray[np.float64]

# Scales without the sign. Motion cannot decide the sign, because f and -f rotate alike in the body:
# it is a separate question.
SCALES = {"m/s2": 1.0, "g": STANDARD_GRAVITY, "mg": 1e-3 * STANDARD_GRAVITY}
_PRIOR = {"m/s2": 0.6, "g": 0.37, "mg": 0.03}
# Prior of the content of a log under these names.
_PRIOR_FORM = {"rate": 0.93, "linear": 0.03, "increment": 0.01, "other": 0.03}
# Raw counts per g of 8 to 16 bits; 1024 is close enough to mg.
_COUNTS = (256.0, 1024.0, 2048.0, 4096.0, 8192.0, 16384.0)
_PRIOR_COUNTS = 0.03
_BROKEN_COUNTS = 0.05  # probability of fractional counts
# Probability of integers only, for each unit.
_WHOLE = {"m/s2": 1e-4, "g": 1e-4, "mg": 0.7}
# Scale and offset error of low-cost sensors: 3 % and 80 mg (MPU-6050 data sheet, section 6.2).
_ERROR = 0.04  # of g
_DECADES = 12.0  # range of scales for unknown units
PIECE = 0.2  # s, interval of a mean vector


def piece_means(values: Array, per_piece: int) -> Array:
    """Average over consecutive intervals of equally many samples, (m, 3)."""
    count = max(len(values) // per_piece, 1)
    per_piece = min(per_piece, len(values))
    whole = values[: count * per_piece].reshape(count, per_piece, -1)
    return np.asarray(whole.mean(axis=1), dtype=np.float64)


def infer_accel(accel: Array, step: float | None) -> tuple[Inference, Inference, Inference, float]:
    """Infer unit, form, and presence of gravity.

    Parameters
    ----------
    accel : ndarray, (n, 3)
        Finite, as in the log.
    step : float or None, s
        Mean step, if known.

    Returns
    -------
    unit, form, gravity : Inference
        The form is ``rate`` or ``increment``.
    magnitude : float
        Median norm of the accelerometer in its own unit.

    Notes
    -----
    The norm of short means stays at 9.8 m/s² in a sensor that is carried, up to the offset of the
    sensor and the part of the motion that does not average out; its spread over the log measures
    the latter. Without gravity it may have any value, and its spread is as large as its mean.
    """
    pieces = piece_means(accel, max(round(PIECE / step), 1) if step else 10)
    norms = np.linalg.norm(pieces, axis=1)
    usual = float(np.median(norms))
    flag = "--accel-unit"
    if not usual > 0:
        nothing = (evidence("io.evidence-all-zero"),)
        return (
            Inference("accel_unit", None, 1.0, nothing, (), flag),
            Inference("accel_form", None, 1.0, nothing),
            Inference("gravity", "removed", 0.5, nothing),
            usual,
        )
    whole = bool((accel == np.round(accel)).all())
    spread = MAD_TO_SD * float(np.median(np.abs(norms - usual))) / usual
    # The median over m means is more accurate than one, but the effect of motion is one-sided. A
    # short log cannot measure its spread, and a crash is shorter than one interval.
    few = 2.0 / len(norms) if step else 0.4
    sd = np.hypot(np.hypot(_ERROR, 0.5 * spread), few) / np.log(10.0)
    where = np.log10(usual)
    # Without gravity the mean vectors are those of random motion, whose norm has a relative spread
    # of 0.4 or more; a constant offset is possible, and small.
    swings = min(spread / 0.3, 1.0) ** 2
    direction = float(np.linalg.norm(pieces.mean(axis=0))) / usual
    # Acceleration without gravity averages to zero, because velocities stay bounded.
    lasting = 0.01 if direction > 0.7 and len(norms) > 20 else 1.0
    # With gravity the motion of a hand or a car spreads the norm by a tenth.
    calm = float(np.exp(-spread / 0.12)) if len(norms) >= 5 else 0.1
    weights: dict[tuple[str | None, str], float] = {}

    def add(unit: str | None, form: str, prior: float, density: float) -> None:
        weights[unit, form] = float(np.log(max(prior * density, 1e-300)))

    for unit, scale in SCALES.items():
        prior = _PRIOR[unit] * (_WHOLE[unit] if whole else 1.0)
        off = (where - np.log10(STANDARD_GRAVITY / scale)) / sd
        # A cubic tail, for sensors that shake and turn more than the median spread shows.
        peak = 0.45 / sd / (1.0 + off * off / 3.0) ** 2
        add(unit, "rate", prior * _PRIOR_FORM["rate"], calm * peak)
        si = usual * scale
        broad = 0.25 * min(1.0, 10.0 / si) ** 2 * min(1.0, si / 1e-3)
        offset = broad * min(1.0, 0.3 / si) ** 3  # constant offset other than gravity
        add(
            unit,
            "linear",
            prior * _PRIOR_FORM["linear"],
            swings * lasting * broad + (1.0 - swings) * offset,
        )
        if step:
            off = (where - np.log10(STANDARD_GRAVITY * step / scale)) / sd
            add(
                unit,
                "increment",
                prior * _PRIOR_FORM["increment"],
                calm * 0.45 / sd / (1.0 + off * off / 3.0) ** 2,
            )
    for k, count in enumerate(_COUNTS):
        off = (where - np.log10(count)) / sd
        prior = _PRIOR_COUNTS / len(_COUNTS) * (1.0 if whole else _BROKEN_COUNTS)
        add(None, f"counts {k}", prior, calm * 0.45 / sd / (1.0 + off * off / 3.0) ** 2)
    add(None, "other", _PRIOR_FORM["other"], (calm + swings) / _DECADES)
    found = posterior(weights)
    units = _summed(found, 0)
    forms = _summed(found, 1)
    counted = sum(p for f, p in forms.items() if str(f).startswith("counts"))
    forms["rate"] = forms.get("rate", 0.0) + counted
    norm = {"piece": PIECE, "norm": usual, "spread_percent": 100 * spread}
    best = next(iter(units))
    if best is not None:
        said = evidence("io.evidence-norm", **norm, unit=best, si=usual * SCALES[best])
    else:
        said = evidence("io.evidence-norm-of-no-unit", **norm, units=list(SCALES))
    told = (said,)
    gravity = posterior_of(
        {
            "present": forms.get("rate", 0.0) + forms.get("increment", 0.0),
            "removed": forms.get("linear", 0.0),
            None: forms.get("other", 0.0),
        }
    )
    form = posterior_of(
        {
            "rate": forms.get("rate", 0.0) + forms.get("linear", 0.0),
            "increment": forms.get("increment", 0.0),
            None: forms.get("other", 0.0),
        }
    )
    tell = (*told, evidence("io.evidence-mean-vector", share=direction))
    return (
        conclude("accel_unit", units, told, flag),
        conclude("accel_form", form, told),
        conclude("gravity", gravity, tell),
        usual,
    )


def posterior_of(probabilities: dict[str | None, float]) -> dict[str | None, float]:
    """Sort probabilities in descending order."""
    return dict(sorted(probabilities.items(), key=lambda p: -p[1]))


def _summed(found: dict[tuple[str | None, str], float], key: int) -> dict[str | None, float]:
    out: dict[str | None, float] = {}
    for hypothesis, p in found.items():
        out[hypothesis[key]] = out.get(hypothesis[key], 0.0) + p
    return posterior_of(out)


def infer_up(accel: Array, step: float | None) -> Inference:
    """Infer which sensor axis points up most of the time, for accelerometers that read +1 g up.

    Parameters
    ----------
    accel : ndarray, (n, 3)
    step : float or None, s

    Notes
    -----
    A sensor of the opposite sign (iOS) gives the same numbers upside down. The share of such
    sensors, a twentieth, limits the confidence; the flag is left to the user.
    """
    pieces = piece_means(accel, max(round(1.0 / step), 1) if step else 100)
    norms = np.linalg.norm(pieces, axis=1, keepdims=True)
    units = pieces / np.where(norms > 0, norms, 1.0)
    # Within 30 deg of an axis; in more than half of the log it is the sensor's usual attitude.
    shares = {
        f"{'-' if sign < 0 else ''}{'xyz'[k]}": float(np.mean(sign * units[:, k] > np.sqrt(0.75)))
        for k in range(3)
        for sign in (1.0, -1.0)
    }
    best = max(shares, key=lambda a: shares[a])
    share = shares[best]
    told = (
        evidence("io.evidence-axis-up", axis=best, percent=100 * share),
        evidence("io.evidence-sign-turns-up-down"),
    )
    if share <= 0.5:
        return Inference("up_axis", None, 1.0 - share, told[:1], (), "--axes")
    other = best[1:] if best.startswith("-") else f"-{best}"
    return Inference("up_axis", best, 0.95 * share, told, ((other, 0.05),), "--axes")
