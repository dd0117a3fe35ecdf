"""Inference from numbers: conclusions; clock and stamps; accelerometer units from gravity."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import MAD_TO_SD, STANDARD_GRAVITY
from strapdown.errors import Finding
from strapdown.tables.checks import Array
from strapdown.tables.on_disk import filled, let_go, stored
from strapdown.units import TIME_UNITS, factor_of

K = TypeVar("K", bound=Hashable)

#: Below this probability the user is asked. A wrong unit spoils a whole run while a question costs
#: one word, so a guess pays only if it fails far less than once in a hundred logs that need one.
THRESHOLD = 0.99
# Upper limit of a probability: the models idealize the physics, whatever the number of samples.
MODEL_DOUBT = 1e-4
# Less probable answers are not shown.
LEAST_SHARE = 0.005


@dataclass(frozen=True)
class Inference:
    """Inference of one quantity from the numbers of a log.

    `quantity`: ``time_unit``, ``time_faults``, ``rate``, ``accel_unit``, ``gravity``,
    ``accel_form``, ``gyro_unit``, ``gyro_form``, ``gyro_axes``, ``gyro_scale`` (rad/s per unit),
    ``up_axis``, ``accel_sign``,
    ``mag_unit``. `value`: the most probable answer; None if no known one fits. `confidence`: its
    probability, 0 to 1. `evidence`: the numbers that it is based on. `alternatives`: the other
    answers with their probabilities, the most probable first. `flag`: the option that answers the
    question; empty if there is none.
    """

    quantity: str
    value: str | float | None
    confidence: float
    evidence: tuple[Finding, ...] = ()
    alternatives: tuple[tuple[str | float | None, float], ...] = ()
    flag: str = ""

    @property
    def settled(self) -> bool:
        """Whether it is certain enough to be used without asking."""
        return self.value is not None and self.confidence >= THRESHOLD

    def finding(self, code: str = "io.inferred", **where: Any) -> Finding:
        """Return the inference as a note.

        `code`: code whose message shows `value`, `confidence` and `evidence`. `**where`: location
        and further data, as for a `Finding`.
        """
        return Finding(
            code,
            severity="note",
            value=self.value,
            confidence=self.confidence,
            evidence=self.evidence or (evidence("io.no-evidence"),),
            **where,
        )

    def shares(self) -> tuple[Finding, ...]:
        """Return the answers that are not excluded, with their probabilities, as notes."""
        pairs = ((self.value, self.confidence), *self.alternatives)
        return tuple(
            evidence(
                "io.share-of-unknown" if value is None else "io.share", value=value, share=share
            )
            for value, share in pairs
            if share > LEAST_SHARE
        )

    def __str__(self) -> str:
        return self.finding().sentence()


def evidence(code: str, **values: Any) -> Finding:
    """Return a piece of evidence as a note."""
    return Finding(code, severity="note", **values)


def evidence_of_counts(shares: Mapping[str, float]) -> tuple[Finding, ...]:
    """Return the unit of raw counts that is more probable than not; empty if there is none.

    `shares`: unit, as in ``g/16384``, to probability.
    """
    unit = max(shares, key=lambda u: shares[u])
    known = shares[unit] > 0.5
    return (evidence("io.evidence-counts", unit=unit, share=shares[unit]),) if known else ()


def posterior(log_weights: dict[K, float]) -> dict[K, float]:
    """Normalize logarithms of prior times likelihood to probabilities, in descending order.

    `log_weights`: hypothesis to natural logarithm. Returns hypothesis to probability. A total of
    1e-4 is spread over all: the models may be wrong.
    """
    if not log_weights:
        return {}
    values = np.array(list(log_weights.values()))
    weights = np.exp(values - values.max())
    weights = (1.0 - MODEL_DOUBT) * weights / weights.sum() + MODEL_DOUBT / weights.size
    pairs = sorted(zip(log_weights, weights.tolist(), strict=True), key=lambda p: -p[1])
    return dict(pairs)


def marginal(probabilities: Mapping[tuple[Any, ...], float], key: int) -> dict[Any, float]:
    """Sum the probabilities of hypotheses that share one of their parts; in descending order."""
    out: dict[Any, float] = {}
    for hypothesis, p in probabilities.items():
        out[hypothesis[key]] = out.get(hypothesis[key], 0.0) + p
    return dict(sorted(out.items(), key=lambda p: -p[1]))


def conclude(
    quantity: str,
    probabilities: Mapping[str, float] | Mapping[str | None, float],
    evidence: tuple[Finding, ...],
    flag: str = "",
) -> Inference:
    """Make an `Inference` of the most probable answer."""
    (value, confidence), *others = sorted(probabilities.items(), key=lambda p: -p[1])
    alternatives = tuple((v, p) for v, p in others if p >= 1e-4)
    return Inference(quantity, value, confidence, evidence, alternatives, flag)


# Inference of the unit of time stamps, their rate, and their faults.


# Prior of logging rates: log10 of a density over log10 of the rate in Hz. Phones, boards and
# navigation units keep 10 to 1000 Hz, crash recorders 10 to 20 kHz; a rotation is not logged every
# ten seconds.
_RATE = np.log10([1e-3, 0.01, 0.1, 1.0, 5.0, 20.0, 1e3, 2e3, 5e3, 1e4, 5e4, 1e6])
_RATE_DENSITY = np.array([-9.0, -7.0, -4.5, -1.5, -0.5, 0.0, 0.0, -0.8, -1.4, -1.6, -4.0, -8.0])
# Prior of the unit of unlabeled clocks; minutes occur in tables written by hand.
_PRIOR = {"s": 0.5, "ms": 0.25, "us": 0.15, "ns": 0.1, "min": 1e-6}
# Probability of fractional stamps in each unit.
_FRACTIONAL = {"s": 1.0, "ms": 0.6, "us": 0.1, "ns": 0.02, "min": 1.0}
#: A first stamp within these years is rarely a coincidence; clocks of 1970 are common.
EPOCH = (946_684_800.0, 2_366_841_600.0)  # 2000 to 2045
_EPOCH_RATIO = 30.0
COUNTER_BITS = (16, 24, 31, 32)


@dataclass(frozen=True)
class Steps:
    """Steps between the stamps of a log, in their unit; computed once for all questions.

    `stamps` ((n,)): finite, as in the log. `steps` ((n - 1,)). `forward`: the positive ones.
    `mean`: of the forward steps within 50 times their median, as the clock may be set between; 0 if
    time does not advance. `median`: of the forward steps; 0 if time does not advance.
    """

    stamps: NDArray[Any]
    steps: Array
    forward: Array
    mean: float
    median: float

    @classmethod
    def of(cls, stamps: NDArray[Any]) -> Steps:
        """Compute the steps of stamps."""
        exact = differenced(stamps)
        steps = filled(len(exact) - 1, lambda part: np.diff(exact[part.start : part.stop + 1]))
        let_go(exact)
        # No copy where all are forward.
        forward = steps if steps.size and steps.min() > 0 else steps[steps > 0]
        if not forward.size:
            return cls(stamps, steps, forward, 0.0, 0.0)
        usual = forward
        if forward.max() > 50.0 * forward.min():
            # Bursts have a median far below the mean; the 90 % quantile covers both.
            usual = forward[forward <= 50.0 * np.quantile(forward, 0.9)]
        # Rows of one burst that share a stamp count, too.
        repeats = steps.size - int(np.count_nonzero(steps))
        mean = float(usual.sum() / (usual.size + repeats))
        median = float(np.median(stored(forward), overwrite_input=True))
        return cls(stamps, steps, forward, mean, median)


def differenced(stamps: NDArray[Any]) -> NDArray[Any]:
    """Return stamps as a type in which their differences are right: int64, or float64.

    Small and unsigned integers would overflow for negative steps, and stamps of 64 bits that are
    far apart, as a corrupt one, for any.
    """
    if stamps.dtype.kind in "iu" and stamps.size:
        low, high = int(stamps.min()), int(stamps.max())
        if high >= 2**63 or high - low >= 2**63:
            return stamps.astype(np.float64)
    return stamps.astype(np.int64 if stamps.dtype.kind in "iub" else np.float64, copy=False)


def time_unit_probabilities(steps: Steps) -> dict[str, float]:
    """Compute the probability of each unit of time, from the mean step and the first stamp.

    Returns keys of `units.TIME_UNITS`, the most probable first; empty if time does not advance.
    """
    if not steps.mean > 0:
        return {}
    stamps = steps.stamps
    fractional = stamps.dtype.kind == "f" and bool((stamps[:1000] % 1.0 != 0).any())
    first = float(stamps[0])
    weights = {}
    for unit, factor in TIME_UNITS.items():
        rate = -np.log10(steps.mean * factor)
        log10 = float(np.interp(rate, _RATE, _RATE_DENSITY)) + np.log10(_PRIOR[unit])
        if fractional:
            log10 += np.log10(_FRACTIONAL[unit])
        if EPOCH[0] <= first * factor <= EPOCH[1]:
            log10 += np.log10(_EPOCH_RATIO)
        weights[unit] = float(np.log(10.0) * log10)
    return posterior(weights)


def infer_time_unit(stamps: NDArray[Any]) -> Inference:
    """Infer the unit of time from the stamps alone.

    `stamps` ((n,)): finite, as in the log.
    """
    steps = Steps.of(stamps)
    found = time_unit_probabilities(steps)
    if not found:
        static = (evidence("io.evidence-time-does-not-advance"),)
        return Inference("time_unit", None, 1.0, static, (), "--time-unit")
    return conclude(
        "time_unit", dict(found), time_evidence(steps, next(iter(found))), "--time-unit"
    )


def time_evidence(steps: Steps, unit: str) -> tuple[Finding, ...]:
    """List the evidence of the stamps for a unit."""
    factor, first = factor_of(unit, TIME_UNITS), float(steps.stamps[0])
    told = [evidence("io.evidence-mean-step", step=steps.mean, rate_hz=1.0 / (steps.mean * factor))]
    if EPOCH[0] <= first * factor <= EPOCH[1]:
        year = 1970 + first * factor / 31_556_952.0
        told.append(evidence("io.evidence-year-of-first-stamp", year=int(year)))
    return tuple(told)


def infer_rate(steps: Steps, unit: str) -> Inference:
    """Infer the nominal sampling rate in Hz, with its regularity.

    `unit`: of the stamps.
    """
    forward, mean, median = steps.forward, steps.mean, steps.median
    if not mean > 0:
        static = (evidence("io.evidence-time-does-not-advance"),)
        return Inference("rate", None, 1.0, static, (), "--rate")
    largest = float(forward.max())
    within, missing = 1.0, 0.0
    if max(largest - median, median - float(forward.min())) > 0.1 * median:
        within = float(np.mean(np.abs(forward - median) <= 0.1 * median))
    if largest >= 1.5 * mean:
        missing = float(np.maximum(np.round(forward / mean) - 1.0, 0.0).sum())
    factor = factor_of(unit, TIME_UNITS)
    told = (
        evidence("io.evidence-steps", mean_ms=1e3 * mean * factor, median_ms=1e3 * median * factor),
        evidence("io.evidence-regular-steps", percent=100 * within),
        evidence("io.evidence-missing-samples", missing=missing),
    )
    # With bursts the mean is the sensor's rate; with losses the median is.
    nominal = 1.0 / ((median if within > 0.5 else mean) * factor)
    return Inference("rate", nominal, 1.0 - 1e-4 if within > 0.5 else 0.9, told, (), "--rate")


def infer_time_faults(steps: Steps) -> Inference:
    """Count faults of stamps: repeated, reversed, wrapped, constant, in bursts, jumps."""
    stamps, forward, usual = steps.stamps, steps.forward, steps.median
    faults: list[str] = []
    if not forward.size:
        faults.append("constant stamps")
    else:
        back = np.flatnonzero(steps.steps < 0) if forward.size < steps.steps.size else ()
        wraps = [wrap_of(float(stamps[k]), float(steps.steps[k]), usual) for k in back]
        wrapped = [wrap[0] for wrap in wraps if wrap]
        if repeated := steps.steps.size - forward.size - len(back):
            faults.append(f"{repeated} repeated")
        if wrapped:
            faults.append(f"{len(wrapped)} wrapped (a counter of {wrapped[0]} bits)")
        if len(back) > len(wrapped):
            faults.append(f"{len(back) - len(wrapped)} backwards")
        if jumps := int(np.count_nonzero(forward > max(50.0 * usual, 10.0 * steps.mean))):
            faults.append(f"{jumps} jump{'s' if jumps > 1 else ''}")
        if usual < 0.5 * steps.mean or (repeated > 0.3 * steps.steps.size):
            faults.append("bursts")
    told = evidence("io.evidence-count-of-steps", steps=steps.steps.size)
    return Inference(
        "time_faults",
        ", ".join(faults) or "none",
        1.0 - 1e-4,
        (told,),
        (),
        "--repair" if faults else "",
    )


def wrap_of(before: float, step: float, usual: float) -> tuple[int, float] | None:
    """Return the width and the period of the counter that wrapped in this step, or None.

    Programs write a counter of 32 bits in microseconds in ms or s, too.
    """
    periods = [(bits, 2.0**bits) for bits in COUNTER_BITS]
    for bits, period in (*periods, (32, 2.0**32 * 1e-3), (32, 2.0**32 * 1e-6)):
        if 0.0 < step + period <= 50.0 * usual and 0 <= before < period:
            return bits, period
    return None


# Inference of an accelerometer's unit and form, from gravity.


# Scales without the sign. Motion cannot decide the sign, because f and -f rotate alike in the body:
# it is a separate question.
SCALES = {"m/s2": 1.0, "g": STANDARD_GRAVITY, "mg": 1e-3 * STANDARD_GRAVITY}
_GRAVITY_PRIOR = {"m/s2": 0.59, "g": 0.36, "mg": 0.05}
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

    `accel` ((n, 3)): finite, as in the log. `step` (s): mean step, if known. Returns `unit`,
    `form`, `gravity`: the form is ``rate`` or ``increment``; `magnitude`: median norm of the
    accelerometer in its own unit.

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
    # Prior and density of the norm, by unit and form.
    models: dict[tuple[str | None, str], tuple[float, float]] = {}
    for unit, scale in SCALES.items():
        prior = _GRAVITY_PRIOR[unit] * (_WHOLE[unit] if whole else 1.0)
        off = (where - np.log10(STANDARD_GRAVITY / scale)) / sd
        # A cubic tail, for sensors that shake and turn more than the median spread shows.
        peak = 0.45 / sd / (1.0 + off * off / 3.0) ** 2
        models[unit, "rate"] = prior * _PRIOR_FORM["rate"], calm * peak
        si = usual * scale
        broad = 0.25 * min(1.0, 10.0 / si) ** 2 * min(1.0, si / 1e-3)
        offset = broad * min(1.0, 0.3 / si) ** 3  # constant offset other than gravity
        still = swings * lasting * broad + (1.0 - swings) * offset
        models[unit, "linear"] = prior * _PRIOR_FORM["linear"], still
        if step:
            off = (where - np.log10(STANDARD_GRAVITY * step / scale)) / sd
            peak = calm * 0.45 / sd / (1.0 + off * off / 3.0) ** 2
            models[unit, "increment"] = prior * _PRIOR_FORM["increment"], peak
    for k, count in enumerate(_COUNTS):
        off = (where - np.log10(count)) / sd
        prior = _PRIOR_COUNTS / len(_COUNTS) * (1.0 if whole else _BROKEN_COUNTS)
        models[None, f"counts {k}"] = prior, calm * 0.45 / sd / (1.0 + off * off / 3.0) ** 2
    models[None, "other"] = _PRIOR_FORM["other"], (calm + swings) / _DECADES
    found = posterior({key: float(np.log(max(p * d, 1e-300))) for key, (p, d) in models.items()})
    units, forms = marginal(found, 0), marginal(found, 1)
    counted = math.fsum(p for f, p in forms.items() if str(f).startswith("counts"))
    forms["rate"] = forms.get("rate", 0.0) + counted
    norm = {"piece": PIECE, "norm": usual, "spread_percent": 100 * spread}
    best = next(iter(units))
    if best is not None:
        said = evidence("io.evidence-norm", **norm, unit=best, si=usual * SCALES[best])
    else:
        said = evidence("io.evidence-norm-of-no-unit", **norm, units=list(SCALES))
    told: tuple[Finding, ...] = (said,)
    if whole:
        named = {f"g/{c:.0f}": forms.get(f"counts {k}", 0.0) for k, c in enumerate(_COUNTS)}
        told += evidence_of_counts(named)
    gravity = {
        "present": forms.get("rate", 0.0) + forms.get("increment", 0.0),
        "removed": forms.get("linear", 0.0),
        None: forms.get("other", 0.0),
    }
    form = {
        "rate": forms.get("rate", 0.0) + forms.get("linear", 0.0),
        "increment": forms.get("increment", 0.0),
        None: forms.get("other", 0.0),
    }
    tell = (*told, evidence("io.evidence-mean-vector", share=direction))
    return (
        conclude("accel_unit", units, told, flag),
        conclude("accel_form", form, told),
        conclude("gravity", gravity, tell),
        usual,
    )


def infer_up(accel: Array, step: float | None) -> Inference:
    """Infer which sensor axis points up most of the time, for accelerometers that read +1 g up.

    `accel` ((n, 3)). `step` (s).

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
