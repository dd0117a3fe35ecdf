"""The one table of rules that say below which statistic a body stands.

A statistic (`standstill_detectors`) is in standard deviations of the noise that is stated of a
rest. What is stated fits a vehicle whose engine was measured. On a shoe, how still a stance is
depends on the gait, the sole and the ground; then a rule finds the threshold while it goes. Each
sees statistics one by one and none that is later, so that pieces of a record give the same as the
whole.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["STANDSTILL_THRESHOLDS", "StandstillThreshold", "otsu"]

Array = NDArray[np.float64]

# Of the histogram of the logarithm of a statistic: first edge, width of a bin, number of bins.
LOWEST, WIDTH, BINS = math.log(1e-3), 0.1, 200
# A class has at least this share, and of two that are apart at least this part of the variance is
# between them: 0.64 of one normal class cut in two, 0.75 of a uniform one.
LEAST_SHARE, LEAST_BETWEEN = 0.1, 0.65
# A motion is so many times a rest.
LEAST_RATIO = 5.0
# So much must have been seen, s, and after so much the split is made anew.
SEEN, ANEW = 2.0, 0.25


class StandstillThreshold(ABC):
    """A rule for a threshold; what it remembers is a value that is never changed in place."""

    summary: ClassVar[str]
    source: ClassVar[str]

    @abstractmethod
    def begin(self, stated: float, scale: float) -> NamedTuple:
        """Return what is remembered before the first statistic.

        Parameters
        ----------
        stated : float
            Threshold that is stated.
        scale : float, s
            Time of the rule: how long it remembers, or how long it is patient.
        """

    @abstractmethod
    def next(self, memory: NamedTuple, time: float, statistic: float) -> tuple[NamedTuple, float]:
        """Return the threshold for a statistic.

        Parameters
        ----------
        memory : NamedTuple
        time : float, s
        statistic : float

        Returns
        -------
        memory : NamedTuple
        threshold : float
            It rests, if the statistic is below.
        """


class Told(NamedTuple):
    """What is stated, and nothing else."""

    stated: float


class Stated(StandstillThreshold):
    """The threshold that is stated."""

    summary: ClassVar[str] = "the threshold that is stated"
    source: ClassVar[str] = "Skog et al. (2010)"

    def begin(self, stated: float, scale: float) -> Told:
        """Return what is stated."""
        return Told(stated)

    def next(self, memory: Told, time: float, statistic: float) -> tuple[Told, float]:  # type: ignore[override]
        """Return what is stated."""
        return memory, memory.stated


class Split(NamedTuple):
    """A histogram that fades.

    Attributes
    ----------
    now : float
        Threshold.
    scale : float, s
    counts : ndarray, (BINS,), s
        Time spent in each bin of the logarithm of the statistic.
    time, made : float, s
        Of the newest statistic, and when the split was made; NaN before the first.
    """

    now: float
    scale: float
    counts: Array
    time: float
    made: float


class Otsu(StandstillThreshold):
    """Between the two classes of the statistics so far: stances and swings."""

    summary: ClassVar[str] = (
        "between the two classes of the statistics so far; until there are two, as stated"
    )
    source: ClassVar[str] = "Otsu (1979), of the logarithm"

    def begin(self, stated: float, scale: float) -> Split:
        """Return an empty histogram."""
        return Split(stated, scale, np.zeros(BINS), math.nan, math.nan)

    def next(self, memory: Split, time: float, statistic: float) -> tuple[Split, float]:  # type: ignore[override]
        """Return the threshold of the newest split, this statistic taken in first."""
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
    """Since when no rest was seen; NaN before the first statistic."""

    stated: float
    scale: float
    since: float


class Patience(StandstillThreshold):
    """A missed rest costs the more, the longer ago the last one was: so the threshold grows.

    The likelihood ratio of rest against any motion is ``exp(-n w s²/2)`` of a statistic s (n
    squares, w samples), and Bayes' rule takes a rest where it is above the cost of a false alarm
    over that of a missed one, times the odds. With a cost of a missed rest that grows with the
    time since the last as ``exp(theta t)``, the bound of s² grows with t: here
    ``threshold² = stated² (1 + t / scale)``, ``theta = n w stated²/(2 scale)``.
    """

    summary: ClassVar[str] = "as stated after a rest, and the wider the longer none was seen"
    source: ClassVar[str] = "Wahlström et al. (2019), exponential cost of a missed rest"

    def begin(self, stated: float, scale: float) -> Waiting:
        """Return nothing seen."""
        return Waiting(stated, scale, math.nan)

    def next(self, memory: Waiting, time: float, statistic: float) -> tuple[Waiting, float]:  # type: ignore[override]
        """Return the threshold, and count from here on, if this is a rest."""
        since = time if math.isnan(memory.since) else memory.since
        now = memory.stated * math.sqrt(1.0 + max(time - since, 0.0) / memory.scale)
        if statistic < now:
            since = time
        return memory._replace(since=since), now


def otsu(counts: Array) -> float | None:
    """Return where two classes of a histogram part, in bins from its first edge.

    Parameters
    ----------
    counts : ndarray, (m,)
        Of bins of the logarithm, `WIDTH` wide.

    Returns
    -------
    float or None
        The edge for which the variance between the classes is the most; the middle of such edges,
        where bins between the classes are empty. None where there are no two classes: one has
        less than a tenth, their means are less than a factor of five apart, or what is between
        them is less than 0.65 of the variance.

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
