"""Inference of the unit of time stamps, their rate, and their faults."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import TIME_UNITS
from strapdown.errors import Finding
from strapdown.formats.inference.conclusion import Inference, conclude, evidence, posterior

Array = NDArray[np.float64]

# Prior of logging rates: log10 of a density over log10 of the rate in Hz. Phones, boards and
# navigation units keep 10 to 1000 Hz, crash recorders 10 to 20 kHz; a rotation is not logged every
# ten seconds.
_RATE = np.log10([1e-3, 0.01, 0.1, 1.0, 5.0, 20.0, 1e3, 2e3, 5e3, 1e4, 5e4, 1e6])
_RATE_DENSITY = np.array([-9.0, -7.0, -4.5, -1.5, -0.5, 0.0, 0.0, -0.8, -1.4, -1.6, -4.0, -8.0])
# Prior of the unit of unlabeled clocks; minutes occur in tables written by hand.
_PRIOR = {"s": 0.5, "ms": 0.25, "us": 0.15, "ns": 0.1, "min": 1e-6}
# Probability of fractional stamps in each unit.
_FRACTIONAL = {"s": 1.0, "ms": 0.6, "us": 0.1, "ns": 0.02, "min": 1.0}
# A first stamp within these years is rarely a coincidence; clocks of 1970 are common.
_EPOCH = (946_684_800.0, 2_366_841_600.0)  # 2000 to 2045
_EPOCH_RATIO = 30.0
COUNTER_BITS = (16, 24, 31, 32)


def time_unit_probabilities(stamps: NDArray[Any]) -> dict[str, float]:
    """Compute the probability of each unit of time, from the mean step and the first stamp.

    Parameters
    ----------
    stamps : ndarray, (n,)
        Finite, as in the log.

    Returns
    -------
    dict of str to float
        Keys of `constants.TIME_UNITS`, the most probable first; empty if time does not
        advance.
    """
    step = mean_step(stamps)
    if not step > 0:
        return {}
    fractional = stamps.dtype.kind == "f" and bool((stamps[:1000] % 1.0 != 0).any())
    first = float(stamps[0])
    weights = {}
    for unit, factor in TIME_UNITS.items():
        rate = -np.log10(step * factor)
        log10 = float(np.interp(rate, _RATE, _RATE_DENSITY)) + np.log10(_PRIOR[unit])
        if fractional:
            log10 += np.log10(_FRACTIONAL[unit])
        if _EPOCH[0] <= first * factor <= _EPOCH[1]:
            log10 += np.log10(_EPOCH_RATIO)
        weights[unit] = float(np.log(10.0) * log10)
    return posterior(weights)


def infer_time_unit(stamps: NDArray[Any]) -> Inference:
    """Infer the unit of time from the stamps alone.

    Parameters
    ----------
    stamps : ndarray, (n,)
        Finite, as in the log.
    """
    found = time_unit_probabilities(stamps)
    if not found:
        static = (evidence("io.evidence-time-does-not-advance"),)
        return Inference("time_unit", None, 1.0, static, (), "--time-unit")
    step = mean_step(stamps)
    return conclude(
        "time_unit", dict(found), time_evidence(stamps, step, next(iter(found))), "--time-unit"
    )


def time_evidence(stamps: NDArray[Any], step: float, unit: str) -> tuple[Finding, ...]:
    """List the evidence of the stamps for a unit."""
    factor = TIME_UNITS[unit]
    told = [evidence("io.evidence-mean-step", step=step, rate_hz=1.0 / (step * factor))]
    if _EPOCH[0] <= float(stamps[0]) * factor <= _EPOCH[1]:
        year = 1970 + float(stamps[0]) * factor / 31_556_952.0
        told.append(evidence("io.evidence-year-of-first-stamp", year=int(year)))
    return tuple(told)


def mean_step(stamps: NDArray[Any]) -> float:
    """Average the forward steps within 50 times their median; the clock may be set between."""
    if stamps.size < 2:
        return 0.0
    exact = stamps.astype(np.int64) if stamps.dtype.kind in "iub" else stamps
    steps = np.diff(exact).astype(np.float64)
    forward = steps[steps > 0]
    if not forward.size:
        return 0.0
    # Bursts have a median far below the mean; the 90 % quantile covers both.
    usual = forward[forward <= 50.0 * np.quantile(forward, 0.9)]
    # Rows of one burst that share a stamp count, too.
    repeats = int((steps == 0).sum())
    return float(usual.sum() / (usual.size + repeats))


def infer_rate(stamps: NDArray[Any], unit: str) -> Inference:
    """Infer the nominal sampling rate in Hz, with its regularity.

    Parameters
    ----------
    stamps : ndarray, (n,)
    unit : str
        Of the stamps.
    """
    step = mean_step(stamps) * TIME_UNITS[unit]
    exact = stamps.astype(np.int64) if stamps.dtype.kind in "iub" else stamps
    steps = np.diff(exact).astype(np.float64) * TIME_UNITS[unit]
    forward = steps[steps > 0]
    if not (step > 0):
        static = (evidence("io.evidence-time-does-not-advance"),)
        return Inference("rate", None, 1.0, static, (), "--rate")
    median = float(np.median(forward))
    within = float(np.mean(np.abs(forward - median) <= 0.1 * median))
    missing = float(np.maximum(np.round(forward / step) - 1.0, 0.0).sum())
    told = (
        evidence("io.evidence-steps", mean_ms=1e3 * step, median_ms=1e3 * median),
        evidence("io.evidence-regular-steps", percent=100 * within),
        evidence("io.evidence-missing-samples", missing=missing),
    )
    # With bursts the mean is the sensor's rate; with losses the median is.
    nominal = 1.0 / median if within > 0.5 else 1.0 / step
    return Inference("rate", nominal, 1.0 - 1e-4 if within > 0.5 else 0.9, told, (), "--rate")


def infer_time_faults(stamps: NDArray[Any]) -> Inference:
    """Count faults of stamps: repeated, reversed, wrapped, constant, in bursts, jumps.

    Parameters
    ----------
    stamps : ndarray, (n,)
    """
    exact = stamps.astype(np.int64) if stamps.dtype.kind in "iub" else stamps.astype(np.float64)
    steps = np.diff(exact).astype(np.float64)
    forward = steps[steps > 0]
    faults: list[str] = []
    if not forward.size:
        faults.append("constant stamps")
    else:
        usual = float(np.median(forward))
        mean = mean_step(stamps)
        back = np.flatnonzero(steps < 0)
        bits = [wrap_bits(float(stamps[k]), float(steps[k]), usual) for k in back]
        wrapped = [b for b in bits if b]
        if repeated := int((steps == 0).sum()):
            faults.append(f"{repeated} repeated")
        if wrapped:
            faults.append(f"{len(wrapped)} wrapped (a counter of {wrapped[0]} bits)")
        if len(back) > len(wrapped):
            faults.append(f"{len(back) - len(wrapped)} backwards")
        if jumps := int((forward > max(50.0 * usual, 10.0 * mean)).sum()):
            faults.append(f"{jumps} jump{'s' if jumps > 1 else ''}")
        if usual < 0.5 * mean or (repeated > 0.3 * steps.size):
            faults.append("bursts")
    told = evidence("io.evidence-count-of-steps", steps=steps.size)
    return Inference(
        "time_faults",
        ", ".join(faults) or "none",
        1.0 - 1e-4,
        (told,),
        (),
        "--repair" if faults else "",
    )


def wrap_bits(before: float, step: float, usual: float) -> int | None:
    """Return the width of the counter that wrapped in this step, or None."""
    for bits in COUNTER_BITS:
        if 0.0 < step + 2.0**bits <= 50.0 * usual and 0 <= before < 2.0**bits:
            return bits
    return None
