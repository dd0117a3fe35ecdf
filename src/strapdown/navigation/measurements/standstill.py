"""Standstill detection, and the measurements of a stationary body: ZUPT and ZARU."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from strapdown._kernels.level import AXIS
from strapdown.constants import MAD_TO_SD
from strapdown.errors import check_choice
from strapdown.estimation.covariance import Observation
from strapdown.estimation.error_model import PHYSICAL
from strapdown.navigation.measurements.measurement import (
    ROTATION,
    VELOCITY,
    Epochs,
    ImuDerivedMeasurement,
    View,
    check_number,
    longer_by,
)
from strapdown.navigation.measurements.vehicle import rate_columns
from strapdown.rotation import cross_matrix

Array = NDArray[np.float64]

# A window of fewer samples has no meaningful variance.
LEAST_SAMPLES = 3
# Fraction of a window that may be missing.
GAPS = 0.2
# Tolerance of time stamps by rounding, as a fraction of a window or an interval.
SLACK = 1e-3
#: Columns of a window: end and length of a step, rate, force.
TIME, DT, RATE, FORCE = 0, 1, slice(2, 5), slice(5, 8)
#: Values of an epoch: number of samples, means of rate and force, variances of the rates.
COUNT, MEAN_RATE, MEAN_FORCE, RATE_VARIANCE = 0, slice(1, 4), slice(4, 7), slice(7, 10)


class Window(NamedTuple):
    """State of a detector between chunks.

    Attributes
    ----------
    samples : ndarray, (m, 8)
        The latest ones: a window, and one sample before it.
    number : float
        Of the interval of the last sample; NaN before the first.
    rule : object
        State of the threshold rule.
    """

    samples: Array
    number: float
    rule: Any


@dataclass(frozen=True)
class StandstillAid(ImuDerivedMeasurement):
    """An aid that observes while a detector finds the body stationary.

    The detector uses the samples of the `window` that ends at an epoch, and no later ones.

    A vehicle that glides over a smooth road looks like a stationary one. The update is
    therefore not made while the computed velocity is not near zero: above `largest_speed` by more
    than `gate` standard deviations of the computed velocity along its direction.

    Attributes
    ----------
    detector : str
        One of `STANDSTILL_DETECTORS`.
    window : float, s
    threshold : float
        The statistic of a rest is below it: one, if the noise is as stated.
    threshold_rule : str
        One of `STANDSTILL_THRESHOLDS`: adaptation of the threshold during a run.
    threshold_time : float, s
        For so long a rule remembers, or is patient.
    rate_sd_deg_per_s, force_sd : float, deg/s and m/s²
        Of the noise of one sample at rest, an idling engine included.
    gravity : float, m/s²
        At the site, for detectors that use it.
    interval : float, s
        Between observations; zero: at every sample.
    largest_speed : float, m/s
        Infinite: the detector alone decides, as on a foot.
    gate_time : float, s
        After this time without an observation a rest is accepted at any speed: a filter with an
        error beyond its covariance would never accept one again. Zero: never, as for vehicles
        that glide for longer.
    """

    detector: str = "force_variance"
    window: float = field(default=1.0, metadata={"unit": "s"})
    threshold: float = 3.0
    threshold_rule: str = "stated"
    threshold_time: float = field(default=10.0, metadata={"unit": "s"})
    rate_sd_deg_per_s: float = 0.2
    force_sd: float = field(default=0.05, metadata={"unit": "m_per_s2"})
    gravity: float = 9.81
    interval: float = 0.5
    largest_speed: float = 0.5
    gate: float = 4.0
    gate_time: float = field(default=0.0, metadata={"unit": "s"})

    def __post_init__(self) -> None:
        for name, code, table in (
            ("detector", "navigation.unknown-detector", STANDSTILL_DETECTORS),
            ("threshold_rule", "navigation.unknown-threshold-rule", STANDSTILL_THRESHOLDS),
        ):
            value = getattr(self, name)
            check_choice(code, table, quantity=name, file=self.name or None, value=value)
        for name in ("window", "threshold", "threshold_time"):
            check_number(self, name, low=0.0, above=True)
        for name in ("rate_sd_deg_per_s", "force_sd", "gravity"):
            check_number(self, name, low=0.0, above=True)
        for name in ("interval", "gate", "gate_time"):
            check_number(self, name, low=0.0)
        if self.largest_speed != math.inf:
            check_number(self, "largest_speed", low=0.0)

    def begin(self) -> Window:
        """Return an empty window."""
        rule = STANDSTILL_THRESHOLDS[self.threshold_rule]
        return Window(np.empty((0, 8)), math.nan, rule.begin(self.threshold, self.threshold_time))

    def watch(self, memory: Window, time: Array, rows: Array) -> tuple[Window, Epochs]:
        """Return an epoch for each end of a stationary window."""
        if not len(time):
            return memory, Epochs(np.empty(0), np.empty((0, 10)))
        new = len(memory.samples)
        seen = np.empty((new + len(time), 8))
        seen[:new] = memory.samples
        seen[new:, TIME], seen[new:, DT] = time, rows[:, 0]
        np.divide(rows[:, 1:7], rows[:, :1], out=seen[new:, 2:])
        rule, remembered = STANDSTILL_THRESHOLDS[self.threshold_rule], memory.rule
        at, values = [], []
        for i in self._ends(seen, new, memory.number):
            looked = self._look(seen, int(i))
            if looked is None:
                continue
            statistic, told = looked
            remembered, threshold = rule.next(remembered, float(seen[i, TIME]), statistic)
            if statistic < threshold:
                at.append(seen[i, TIME])
                values.append(told)
        kept = self._first(seen, len(seen) - 1)
        number = self._number(seen[-1:, TIME])[0]
        after = Window(seen[max(kept - 1, 0) :].copy(), number, remembered)
        return after, Epochs(np.array(at), np.array(values).reshape(-1, 10))

    def near_rest(self, view: View) -> bool:
        """Whether the computed velocity is compatible with rest."""
        speed = float(np.linalg.norm(view.velocity))
        if speed <= self.largest_speed or 0.0 < self.gate_time <= view.unobserved:
            return True
        along = view.velocity / speed
        sd = math.sqrt(along @ view.covariance[VELOCITY, VELOCITY] @ along)
        return speed - self.largest_speed <= self.gate * sd

    def _number(self, time: Array) -> Array:
        """Number of the interval of an instant."""
        return np.floor(time / self.interval + SLACK) if self.interval else np.zeros(len(time))

    def _ends(self, seen: Array, new: int, number: float) -> NDArray[np.int64]:
        """Indices of the samples that end an interval."""
        if not self.interval:
            return np.arange(new, len(seen))
        numbers = self._number(seen[new:, TIME])
        before = np.concatenate([[numbers[0] if math.isnan(number) else number], numbers[:-1]])
        return new + np.flatnonzero(numbers > before)

    def _first(self, seen: Array, i: int) -> int:
        """Index of the first sample of the window that ends with a sample."""
        begin = seen[i, TIME] - self.window * (1.0 - SLACK)
        # Ends of steps: the first after the begin of the window.
        return int(seen[: i + 1, TIME].searchsorted(begin, side="right"))

    def _look(self, seen: Array, i: int) -> tuple[float, Array] | None:
        """Statistic of a complete window, and the observation if it is stationary."""
        first = self._first(seen, i)
        count = i + 1 - first
        within = np.ascontiguousarray(seen[first : i + 1])
        begun = seen[0, TIME] - seen[0, DT] <= seen[i, TIME] - self.window * (1.0 - SLACK)
        if count < LEAST_SAMPLES or not begun or within[:, DT].sum() < (1.0 - GAPS) * self.window:
            return None
        rate, force = within[:, RATE].copy(), within[:, FORCE].copy()
        statistic = STANDSTILL_DETECTORS[self.detector].statistic(
            rate, force, math.radians(self.rate_sd_deg_per_s), self.force_sd, self.gravity
        )
        told = [[count], rate.mean(axis=0), force.mean(axis=0), rate.var(axis=0, ddof=1)]
        return statistic, np.concatenate(told)


# Standstill detectors by name: the statistic of a window of samples.
#
# Skog, Händel, Nilsson and Rantakokko, Zero-velocity detection - an algorithm evaluation, IEEE
# Trans. Biomedical Engineering 57 (2010) 2657: a generalized likelihood ratio test of rest
# against any motion, and its variants for less knowledge of the signals. Theirs are sums of
# squares T, to be below a threshold; here each is divided by the number of squares whose
# expectation is one at a quiet rest, and its root taken, so that it is one there and a threshold
# is a number of standard deviations: ``gamma = n threshold²``, n as in
# `StandstillDetector.squares`.


@dataclass(frozen=True)
class StandstillDetector:
    """A statistic of a window of samples.

    Attributes
    ----------
    squares : int
        Squares a sample with an expectation of one at rest.
    of : callable
        ``of(rate, force, gravity)`` with rates (w, 3) and forces (w, 3), each over the standard
        deviation of its noise, and gravity over that of the force: the mean square per sample.
    """

    summary: str
    source: str
    squares: int
    of: Callable[[Array, Array, float], float]

    def statistic(
        self, rate: Array, force: Array, rate_sd: float, force_sd: float, gravity: float
    ) -> float:
        """Return the statistic of a window: one at a quiet rest.

        Parameters
        ----------
        rate : ndarray, (w, 3), rad/s
        force : ndarray, (w, 3), m/s²
        rate_sd, force_sd : float
            Of the noise of a sample, in these units.
        gravity : float, m/s²
        """
        mean = self.of(rate / rate_sd, force / force_sd, gravity / force_sd)
        return float(np.sqrt(mean / self.squares))


def _rate_energy(rate: Array, force: Array, gravity: float) -> float:
    return float((rate**2).sum() / len(rate))


def _force_variance(rate: Array, force: Array, gravity: float) -> float:
    return float(force.var(axis=0, ddof=1).sum())


def _force_magnitude(rate: Array, force: Array, gravity: float) -> float:
    size = np.sqrt((force**2).sum(axis=1))
    return float(((size - gravity) ** 2).sum() / len(force))


def _shoe(rate: Array, force: Array, gravity: float) -> float:
    mean = force.sum(axis=0) / len(force)
    up = mean * (gravity / np.sqrt((mean**2).sum()))
    return float(((force - up) ** 2).sum() / len(force)) + _rate_energy(rate, force, gravity)


def _variance(rate: Array, force: Array, gravity: float) -> float:
    return float(rate.var(axis=0, ddof=1).sum()) + _force_variance(rate, force, gravity)


def _force_spread(rate: Array, force: Array, gravity: float) -> float:
    apart = np.median(np.abs(force - np.median(force, axis=0)), axis=0)
    return float(((MAD_TO_SD * apart) ** 2).sum())


SKOG = "Skog et al. (2010)"

STANDSTILL_DETECTORS: dict[str, StandstillDetector] = {
    "shoe": StandstillDetector(
        "rates about zero, and a force as long as gravity that stays where it is (GLRT)",
        f"{SKOG}, stance hypothesis optimal detector",
        6,
        _shoe,
    ),
    "rate_energy": StandstillDetector(
        "rates about zero; needs gyros without bias",
        f"{SKOG}, angular rate energy",
        3,
        _rate_energy,
    ),
    "force_variance": StandstillDetector(
        "a force that stays where it is, whatever it is: biases and scale factors do not matter",
        f"{SKOG}, acceleration moving variance",
        3,
        _force_variance,
    ),
    "force_magnitude": StandstillDetector(
        "a force as long as gravity, whatever its direction",
        f"{SKOG}, acceleration magnitude",
        1,
        _force_magnitude,
    ),
    "variance": StandstillDetector(
        "a rate and a force that stay where they are: no bias matters",
        f"{SKOG}, with unknown means of both",
        6,
        _variance,
    ),
    "force_spread": StandstillDetector(
        "as force_variance by medians, so that a slammed door does not count",
        "median absolute deviation (Hampel 1974)",
        3,
        _force_spread,
    ),
}


# Threshold rules by name: the statistic below which a body counts as stationary.
#
# A statistic (`standstill_detectors`) is in standard deviations of the stated noise at rest. A
# stated threshold fits a vehicle whose engine was measured. On a shoe, the motion in stance depends
# on gait, sole and ground; there a rule adapts the threshold. Each rule sees statistics one by one,
# never a later one, so that the chunks of a record give the same as the whole.


# Histogram of the logarithm of a statistic: first edge, width of a bin, number of bins.
LOWEST, WIDTH, BINS = math.log(1e-3), 0.1, 200
# Least share of a class, and least part of the variance between two separate classes: 0.64 for one
# normal class cut in two, 0.75 for a uniform one.
LEAST_SHARE, LEAST_BETWEEN = 0.1, 0.65
# Least ratio of the statistics of motion and rest.
LEAST_RATIO = 5.0
# Time before the first split, s, and between splits.
SEEN, ANEW = 2.0, 0.25


class StandstillThreshold(ABC):
    """A rule for a threshold; its state is a value that is never changed in place."""

    summary: ClassVar[str]
    source: ClassVar[str]

    @abstractmethod
    def begin(self, stated: float, scale: float) -> NamedTuple:
        """Return the state before the first statistic.

        Parameters
        ----------
        stated : float
            Threshold that is stated.
        scale : float, s
            Time scale of the rule: its memory, or its patience.
        """

    @abstractmethod
    def next(self, memory: NamedTuple, time: float, statistic: float) -> tuple[NamedTuple, float]:
        """Return the threshold for a statistic.

        Parameters
        ----------
        time : float, s

        Returns
        -------
        memory : NamedTuple
        threshold : float
            It rests, if the statistic is below.
        """


class Told(NamedTuple):
    """The stated threshold, constant."""

    stated: float


class Stated(StandstillThreshold):
    """Constant stated threshold."""

    summary: ClassVar[str] = "the threshold that is stated"
    source: ClassVar[str] = "Skog et al. (2010)"

    def begin(self, stated: float, scale: float) -> Told:
        """Return the stated threshold."""
        return Told(stated)

    def next(self, memory: Told, time: float, statistic: float) -> tuple[Told, float]:  # type: ignore[override]
        """Return the stated threshold."""
        return memory, memory.stated


class Split(NamedTuple):
    """A histogram with fading memory.

    Attributes
    ----------
    now : float
        Threshold.
    scale : float, s
    counts : ndarray, (BINS,), s
        Time spent in each bin of the logarithm of the statistic.
    time, made : float, s
        Of the newest statistic, and of the last split; NaN before the first.
    """

    now: float
    scale: float
    counts: Array
    time: float
    made: float


class Otsu(StandstillThreshold):
    """Threshold between the two classes of the statistics so far: stances and swings."""

    summary: ClassVar[str] = (
        "between the two classes of the statistics so far; until there are two, as stated"
    )
    source: ClassVar[str] = "Otsu (1979), of the logarithm"

    def begin(self, stated: float, scale: float) -> Split:
        """Return an empty histogram."""
        return Split(stated, scale, np.zeros(BINS), math.nan, math.nan)

    def next(self, memory: Split, time: float, statistic: float) -> tuple[Split, float]:  # type: ignore[override]
        """Return the threshold of the newest split, this statistic included."""
        now, scale, counts, before, made = memory
        if math.isnan(before):
            return Split(now, scale, counts, time, time), now
        step = time - before
        counts = counts * math.exp(-step / scale)
        at = (math.log(max(statistic, 1e-300)) - LOWEST) / WIDTH
        counts[min(max(int(at), 0), BINS - 1)] += step
        if time - made >= ANEW:
            made = time
            found = otsu(counts) if counts.sum() >= SEEN else None
            now = now if found is None else math.exp(LOWEST + WIDTH * found)
        return Split(now, scale, counts, time, made), now


class Waiting(NamedTuple):
    """Time since the last rest; NaN before the first statistic."""

    stated: float
    scale: float
    since: float


class Patience(StandstillThreshold):
    """The cost of a missed rest grows with the time since the last one, and so does the threshold.

    The likelihood ratio of rest against any motion is ``exp(-n w s²/2)`` for a statistic s (n
    squares, w samples), and Bayes' rule decides for rest where it is above the cost of a false
    alarm over that of a missed one, times the odds. With a cost of a missed rest that grows with
    the time since the last as ``exp(theta t)``, the bound of s² grows with t: here
    ``threshold² = stated² (1 + t / scale)``, ``theta = n w stated²/(2 scale)``.
    """

    summary: ClassVar[str] = "as stated after a rest, and the wider the longer none was seen"
    source: ClassVar[str] = "Wahlström et al. (2019), exponential cost of a missed rest"

    def begin(self, stated: float, scale: float) -> Waiting:
        """Return empty statistics."""
        return Waiting(stated, scale, math.nan)

    def next(self, memory: Waiting, time: float, statistic: float) -> tuple[Waiting, float]:  # type: ignore[override]
        """Return the threshold; restart the time if this is a rest."""
        since = time if math.isnan(memory.since) else memory.since
        now = memory.stated * math.sqrt(1.0 + max(time - since, 0.0) / memory.scale)
        if statistic < now:
            since = time
        return memory._replace(since=since), now


def otsu(counts: Array) -> float | None:
    """Return the threshold between two classes of a histogram, in bins from its first edge.

    Parameters
    ----------
    counts : ndarray, (m,)
        Of bins of the logarithm, `WIDTH` wide.

    Returns
    -------
    float or None
        The edge of the largest variance between the classes; the middle of such edges, if bins
        between the classes are empty. None without two classes: one has less than a tenth, their
        means are less than a factor of five apart, or the variance between them is less than 0.65
        of the total.

    Notes
    -----
    Otsu, A threshold selection method from gray-level histograms, IEEE Trans. Systems, Man and
    Cybernetics 9 (1979) 62, Eqs. (14) to (19).
    """
    p = counts / counts.sum()
    bins = np.arange(len(p)) + 0.5
    share, first = np.cumsum(p)[:-1], np.cumsum(p * bins)[:-1]
    mean = float((p * bins).sum())
    total = float((p * (bins - mean) ** 2).sum())
    possible = (share >= LEAST_SHARE) & (share <= 1.0 - LEAST_SHARE)
    if not possible.any() or not total > 0.0:
        return None
    weight = np.where(possible, share * (1.0 - share), 1.0)
    between = np.where(possible, (mean * share - first) ** 2 / weight, -1.0)
    most = float(between.max())
    at = np.flatnonzero(between >= most * (1.0 - 1e-12))
    k = int(at[len(at) // 2])
    apart = (mean - first[k]) / (1.0 - share[k]) - first[k] / share[k]
    if most < LEAST_BETWEEN * total or apart * WIDTH < math.log(LEAST_RATIO):
        return None
    return float(k + 1)


STANDSTILL_THRESHOLDS: dict[str, StandstillThreshold] = {
    "stated": Stated(),
    "otsu": Otsu(),
    "patience": Patience(),
}


# Zero velocity of a stationary body (ZUPT).


@dataclass(frozen=True)
class ZeroVelocity(StandstillAid):
    """Zero velocity relative to the Earth while a detector finds rest (ZUPT, zero-velocity update).

    Attributes
    ----------
    sd : float, m/s
        Of the velocity in a detected standstill, each component. The velocity of a body that
        sways about a position soon has zero mean, so that subsequent observations are at least
        as good as independent ones.
    pivot : float, m
        From the sensors to the point about which the body rolls in a detected standstill, as the
        sole of a shoe over the ground: the mean rate of the window times this is a velocity,
        and its square adds to that of `sd`.
    correlation_time : float, s
        Correlation time of the velocity in a detected standstill: its variance is increased by
        `correlated.longer_by`. A shoe that rolls over its sole moves all through a stance.
    """

    sd: float = field(default=0.02, metadata={"unit": "m_per_s"})
    pivot: float = field(default=0.0, metadata={"unit": "m"})
    correlation_time: float = field(default=0.0, metadata={"unit": "s"})

    kind: ClassVar[str] = "zero_velocity"
    summary: ClassVar[str] = "zero velocity at a standstill that is detected"
    source: ClassVar[str] = "Skog et al. (2010)"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number(self, "sd", low=0.0, above=True)
        for name in ("pivot", "correlation_time"):
            check_number(self, name, low=0.0)

    @property
    def lasts(self) -> bool:
        """As `Aid.lasts`: with a stated correlation time."""
        return self.correlation_time > 0.0

    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return the velocity, north, east, down, unless it is far from zero."""
        if not self.near_rest(view):
            return []
        C_nl = view.C_ln.T
        H = np.zeros((3, view.columns))
        H[:, VELOCITY] = C_nl
        rolls = self.pivot * float(np.linalg.norm(values[MEAN_RATE]))
        interval = self.interval or self.window / float(values[COUNT])
        R = np.full(3, (self.sd**2 + rolls**2) * longer_by(interval, self.correlation_time))
        return [Observation(f"{self.name}.velocity", C_nl @ view.velocity, H, R, LABELS)]


LABELS = ("VN, m/s", "VE, m/s", "VD, m/s")


# Zero rate of a stationary body (ZARU): the gyros read the Earth's rate and their errors.


@dataclass(frozen=True)
class ZeroRate(StandstillAid):
    """Zero rate relative to the Earth while a detector finds rest (ZARU, zero angular rate update).

    The observation is the mean rate over the window. Its variance is that of the samples in the
    window over their number, plus `sd_deg_per_s` squared; where windows overlap, it is increased
    by the number of uses of each sample.

    Attributes
    ----------
    sd_deg_per_s : float, deg/s
        Of the mean rate in a detected standstill, beyond the noise: a body that sways.
    """

    sd_deg_per_s: float = 0.005

    kind: ClassVar[str] = "zero_rate"
    summary: ClassVar[str] = "zero angular rate (ZARU) at a detected standstill: gyro bias"
    source: ClassVar[str] = "Groves (2013), sec. 15.2"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number(self, "sd_deg_per_s", low=0.0, above=True)

    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return the rate minus the Earth's, body axes, unless the velocity is far from zero."""
        if not self.near_rest(view):
            return []
        count = float(values[COUNT])
        used = max(self.window / self.interval, 1.0) if self.interval else count
        R = used * (values[RATE_VARIANCE] / count + math.radians(self.sd_deg_per_s) ** 2)
        readings = np.concatenate([values[MEAN_RATE], values[MEAN_FORCE]])
        return [rate_at_rest(f"{self.name}.rate", view, readings, R)]


def rate_at_rest(name: str, view: View, readings: Array, variance: Array) -> Observation:
    """Return the rate of a stationary body minus the Earth's, body axes.

    Parameters
    ----------
    readings : ndarray, (6,), rad/s and m/s²
        Mean rate and specific force, as measured.
    variance : ndarray, (3,)
        Of the mean rate.
    """
    earth = view.ellipsoid.rotation_rate * view.level[AXIS : AXIS + 3]
    C_bl = view.C_lb.T
    # A scale factor acts on the true rate, at rest the Earth's: with the reading, that of an
    # axis would be correlated with its bias.
    H = rate_columns(view, C_bl @ earth, view.without_errors(readings)[3:])
    z = readings[:3] - H[:, PHYSICAL:] @ view.sensors - C_bl @ earth
    H[:, ROTATION] = -C_bl @ cross_matrix(earth)
    return Observation(name, z, H, variance, ZERO_RATE_LABELS)


ZERO_RATE_LABELS = ("x, rad/s", "y, rad/s", "z, rad/s")
