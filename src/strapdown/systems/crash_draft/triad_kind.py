"""Kind and unit of three columns of numbers: accelerometer or gyro."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from strapdown.constants import ACCEL_UNITS, GYRO_UNITS, STANDARD_GRAVITY, TIME_UNITS
from strapdown.formats.inference.conclusion import THRESHOLD, infer_accel, posterior
from strapdown.formats.inference.rotation_rate import infer_gyro
from strapdown.sensors.saturation import find_limits
from strapdown.systems.crash_draft.parts import Clock

Array = NDArray[np.float64]

__all__ = ["Answer", "Quiet", "accel_unit", "gyro_unit", "quiet_part", "same_quantity"]

# A rest ends at a sample that deviates by this many times the usual step.
BURST = 15.0
LEAST_QUIET = 10  # samples
# Noise and zero-rate offset of MEMS gyros of crash recorders: decades about these, with a
# standard deviation that covers an order of magnitude either way twice.
USUAL_NOISE, USUAL_OFFSET, DECADES = math.radians(0.1), math.radians(1.0), 0.7
# Peak rate in a crash, within a factor of four.
USUAL_PEAK, PEAK_DECADES = math.radians(120.0), 0.6
# Least correlation between two ranges of one sensor, or two recorders.
LEAST_CORRELATION = 0.8
# In logarithm: noise flattens the slope, and the next unit is a factor of 9.8 away.
SCALE_TOLERANCE = 0.35
# Full scales of accelerometers, in g, and their tolerance.
FULL_SCALES = (
    *(1.2, 1.5, 1.7, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 18.0, 20.0, 24.0, 25.0, 30.0),
    *(35.0, 37.0, 40.0, 50.0, 55.0, 64.0, 70.0, 75.0, 100.0, 120.0, 150.0, 200.0, 250.0, 400.0),
    *(500.0, 1000.0, 2000.0),
)
ROUND = 0.003
# Duration of four fifths of the power of a crash.
PULSE = (0.008, 0.8)  # s
# Least ratio of a pulse to the noise.
LEAST_PULSE = 8.0
# Share of the largest reading: a saturated low range cannot be compared beyond it.
NEAR_END = 0.98
# Values below this share of the largest are mostly noise.
MOVES = 0.15


@dataclass(frozen=True)
class Quiet:
    """Rest of a triad before the event, in recorded numbers.

    Attributes
    ----------
    count : int
        Samples from the first on.
    mean, sd : ndarray, (3,)
    """

    count: int
    mean: Array
    sd: Array


@dataclass(frozen=True)
class Answer:
    """Unit with its evidence.

    Attributes
    ----------
    unit : str
        The likeliest.
    confidence : float
    why : str
    others : tuple of (str, float)
        Units with their probabilities, the likeliest first, `unit` among them.
    gravity : float
        Probability that it is an accelerometer that measures gravity, in whatever unit.
    """

    unit: str
    confidence: float
    why: str
    others: tuple[tuple[str, float], ...] = ()
    gravity: float = 0.0

    @property
    def settled(self) -> bool:
        """Whether it is certain enough to be written without a question."""
        return self.confidence >= THRESHOLD


def quiet_part(values: Array) -> Quiet:
    """Return the samples before the first burst of any column.

    Parameters
    ----------
    values : ndarray, (n, k)
    """
    steps = np.abs(np.diff(values, axis=0))
    usual = np.median(steps, axis=0)
    # A coarse converter repeats most values; its step is the unit of change.
    least = np.array([s[s > 0].min(initial=np.inf) if (s > 0).any() else np.inf for s in steps.T])
    limit = BURST * np.maximum(usual, least)
    bursts = np.flatnonzero((steps > limit).any(axis=1))
    count = int(bursts[0]) if bursts.size else len(values)
    if count < min(LEAST_QUIET, len(values)):
        count = min(LEAST_QUIET, len(values))
    part = values[:count]
    return Quiet(count, part.mean(axis=0), part.std(axis=0))


def accel_unit(values: Array, step: float, quiet: Quiet) -> Answer:
    """Unit of an accelerometer by the magnitude of its rest.

    Parameters
    ----------
    values : ndarray, (n, 3)
    step : float, s
    quiet : Quiet
        Rest of these values.

    Returns
    -------
    Answer
        With confidence 0 where gravity is not measured; `gravity` is the probability that it is.

    Notes
    -----
    Counts of a converter may be 1024 per g, nearly as many as mg. Saturation distinguishes them:
    full scales are round in g, and converters end at a power of two.
    """
    length = float(np.linalg.norm(quiet.mean))
    said, form, gravity, _ = infer_accel(values[: quiet.count], step if step > 0 else None)
    pairs = [(str(v), p) for v, p in ((said.value, said.confidence), *said.alternatives) if v]
    there = gravity.confidence if gravity.value == "present" else 0.0
    there = min(there, form.confidence if form.value == "rate" else 0.0)
    likeliest = pairs[0][0] if pairs else "m/s2"
    told = f"at rest its length is {length:.4g}, that of gravity in {likeliest}"
    sure = pairs[0][1] if pairs else 0.0
    if there >= THRESHOLD and sure < THRESHOLD and (end := _round_end(values, likeliest)):
        told += f", and it ends at {end:g} g"
        sure = THRESHOLD
    return Answer(likeliest, min(sure, there), told, tuple(pairs), there)


def _round_end(values: Array, unit: str) -> float | None:
    """Full scale in g, where values end at a number that is round in g and no power of two."""
    limits = find_limits(
        np.arange(len(values), dtype=np.float64) * 1e-3, values, np.full(3, np.inf), np.zeros(3)
    )
    ends = [abs(e) for e in (*limits.lower, *limits.upper) if np.isfinite(e)]
    if not ends:
        return None
    end = max(ends)
    power = 2.0 ** round(math.log2(end))
    in_g = end * ACCEL_UNITS[unit] / STANDARD_GRAVITY
    near = min(FULL_SCALES, key=lambda f: abs(in_g / f - 1.0))
    if abs(in_g / near - 1.0) > ROUND or abs(end / power - 1.0) <= ROUND:
        return None
    return near


def pulse_samples(values: Array) -> int:
    """Samples in the middle four fifths of the power of the shortest pulse.

    Parameters
    ----------
    values : ndarray, (n, k)
        In any units. Columns that increase evenly, as a clock does, and those without a pulse are
        ignored. A gyro that turns long after the impact does not lengthen the pulse.

    Returns
    -------
    int
        0 without a pulse.
    """
    lengths = []
    for column in values.T:
        free = np.abs(column - np.median(column))
        noise = max(float(np.median(free)), float(np.sort(free)[int(0.7 * free.size)]))
        if np.ptp(np.diff(column)) == 0.0 or not free.max() > LEAST_PULSE * noise:
            continue
        # Without the noise, which has more power than the pulse in a long record.
        power = np.cumsum(np.where(free > 3.0 * noise, free, 0.0) ** 2)
        edges = np.searchsorted(power, np.array([0.1, 0.9]) * power[-1])
        lengths.append(int(edges[1] - edges[0]))
    return min(lengths, default=0)


def clock_by_pulse(clock: Clock, values: Array) -> tuple[str, str] | None:
    """Unit of time by the duration of the crash.

    Parameters
    ----------
    clock : Clock
        `rate` is that of its likeliest unit; its `candidates` are not settled.
    values : ndarray, (n, k)
        In any unit.

    Returns
    -------
    (unit, why) or None
        None where no unit, or more than one, gives a plausible crash.
    """
    samples = pulse_samples(values)
    if samples < 3:
        return None
    lasts = {u: samples * f * clock.step for u, f in TIME_UNITS.items()}
    fits = [u for u, length in lasts.items() if PULSE[0] <= length <= PULSE[1]]
    if len(fits) != 1:
        return None
    unit = fits[0]
    return unit, (
        f"in {unit} four fifths of the pulse last {lasts[unit]:.2g} s, as a crash does, in any "
        "other unit a thousand times less or more"
    )


def gyro_unit(time: Array, values: Array, quiet: Quiet) -> Answer:
    """Unit of a gyro by its magnitude, its rest and its noise.

    Parameters
    ----------
    time : ndarray, (n,), s
    values : ndarray, (n, 3)
    quiet : Quiet

    Notes
    -----
    The probabilities of `formats.inference` consider the largest rates of the crash. They are
    combined with the offset and noise at rest, and with the peak, each as a broad normal
    distribution of the logarithm.
    """
    crash = slice(max(quiet.count - 1, 0) if quiet.count < len(values) - LEAST_QUIET else 0, None)
    said, _, _, _ = infer_gyro(time[crash] - time[crash][0], values[crash], None, {"s": 1.0})
    prior = {str(v): p for v, p in ((said.value, said.confidence), *said.alternatives) if v}
    peak = float(np.abs(values - quiet.mean).max())
    offset = float(np.abs(quiet.mean).max())
    noise = float(np.sqrt(np.mean(quiet.sd**2)))
    weights = {}
    for unit in ("rad/s", "deg/s"):
        scale = GYRO_UNITS[unit]
        log = math.log(max(prior.get(unit, 1e-6), 1e-6))
        for size, usual, decades in (
            (peak, USUAL_PEAK, PEAK_DECADES),
            (offset, USUAL_OFFSET, DECADES),
            (noise, USUAL_NOISE, DECADES),
        ):
            if size > 0.0:
                log -= 0.5 * (math.log10(size * scale / usual) / decades) ** 2
        weights[unit] = log
    found = posterior(weights)
    unit = next(iter(found))
    factor = GYRO_UNITS[unit] / GYRO_UNITS["deg/s"]
    told = (
        f"in {unit} its largest is {peak * factor:.4g} deg/s, its rest {offset * factor:.3g} deg/s "
        f"and its noise {noise * factor:.3g} deg/s"
    )
    return Answer(unit, found[unit], told, tuple(found.items()))


def same_quantity(known: Array, other: Array) -> tuple[str, float, float] | None:
    """Unit of a triad by a known triad with the same motion.

    Parameters
    ----------
    known : ndarray, (n, 3), m/s²
    other : ndarray, (n, 3)
        At the same instants, in an unknown unit.

    Returns
    -------
    (unit, ratio, correlation) or None
        Ratio of the scale found to that of the unit; None where they do not agree.
    """
    slope, correlation = regress(known, other)
    if correlation < LEAST_CORRELATION or slope <= 0.0:
        return None
    scales = {u: s for u, s in ACCEL_UNITS.items() if s > 0.0}
    unit = min(scales, key=lambda u: abs(math.log(slope / scales[u])))
    ratio = slope / scales[unit]
    if abs(math.log(ratio)) > SCALE_TOLERANCE:
        return None
    return unit, ratio, correlation


def regress(known: Array, other: Array) -> tuple[float, float]:
    """Regress one triad on another that may have a shorter range.

    Parameters
    ----------
    known, other : ndarray, (n, k)
        At the same instants.

    Returns
    -------
    scale : float
        Of `other` to `known`, where `known` moves and is not saturated; 0 where it cannot be
        determined.
    correlation : float
        Of all axes together, `other` being clipped where `known` saturates.
    """
    x, y = (v - np.median(v, axis=0) for v in (known, other))
    largest = np.abs(x).max(axis=0)
    margin = (1.0 - NEAR_END) * np.ptp(x, axis=0)
    inside = (x > x.min(axis=0) + margin) & (x < x.max(axis=0) - margin)
    moves = inside & (np.abs(x) > MOVES * largest.max())
    x_in, y_in = x[moves], y[moves]
    power, own = float(y_in @ y_in), float(x_in @ x_in)
    if power <= 0.0 or own <= 0.0:
        return 0.0, 0.0
    # Both are noisy: the geometric mean of the two regression slopes is not biased to zero.
    scale = math.copysign(math.sqrt(own / power), float(x_in @ y_in))
    cut = np.clip(scale * y, x.min(axis=0), x.max(axis=0))
    power, own = float((cut * cut).sum()), float((x * x).sum())
    if power <= 0.0:
        return 0.0, 0.0
    return scale, float((cut * x).sum()) / math.sqrt(power * own)
