"""Monitor innovations as they arrive, and detect changes in their statistics."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.dsp.chi_square import chi_square_above, chi_square_below, normal_above
from strapdown.errors import ConfigError

__all__ = ["Alarm", "InnovationMonitor", "MonitorState", "Verdict", "judge"]


Array = NDArray[np.float64]


@dataclass(frozen=True)
class Alarm:
    """A change in a sequence of innovations.

    Attributes
    ----------
    component : int
        Which component of the observation.
    what : {'larger', 'high', 'low'}
        Larger scatter than predicted; mean above zero; mean below zero.
    since : float, s
        Estimated first epoch after the change.
    known : float, s
        Epoch at which the change became significant.
    """

    component: int
    what: str
    since: float
    known: float


@dataclass(frozen=True, eq=False)
class MonitorState:
    """State of the monitor of a sequence; never changed in place.

    Attributes
    ----------
    sums : ndarray, (3, k)
        Of the logarithms of likelihood ratios since `since`: of larger, high and low.
    since : ndarray, (3, k), s
        First epoch after the sum was last at zero.
    raised : ndarray of bool, (3, k)
        Whether an alarm has been raised since.
    """

    sums: Array
    since: Array
    raised: NDArray[np.bool_]


@dataclass(frozen=True)
class InnovationMonitor:
    """CUSUM tests of likelihood ratios: constant memory, bounded false-alarm rate.

    For a normalized innovation u the logarithm of the likelihood ratio of a standard deviation c is
    ``(1 - 1/c²) u²/2 - ln c``, and of a mean d ``d u - d²/2``. Their sum is kept from falling below
    zero (Page, Biometrika 41 (1954) 100); an alarm is raised when it reaches `threshold`, and the
    estimated time of the change is where it was last zero. For a consistent filter,
    a ratio that begins at any one epoch is a martingale of mean 1, and ever reaches exp(threshold)
    with a probability of at most exp(-threshold) (Ville's inequality): within n epochs a sum of the
    three raises a false alarm with a probability of at most ``n exp(-threshold)``, and on average
    not before exp(threshold) epochs (Lorden, Ann. Math. Statist. 42 (1971) 1897, Theorem 2).

    The tails of the innovations need not be normal for that: one is limited to `clip` standard
    deviations, so that a single gross error raises no alarm. Stateless.

    Attributes
    ----------
    threshold : float
    larger : float
        The standard deviation c.
    apart : float
        The mean d, in standard deviations.
    clip : float
        In standard deviations.
    """

    threshold: float = math.log(1e6)
    larger: float = 1.5
    apart: float = 0.5
    clip: float = 4.0

    def __post_init__(self) -> None:
        for name, least in (("threshold", 0.0), ("larger", 1.0), ("apart", 0.0), ("clip", 0.0)):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > least):
                raise ConfigError(
                    "navigation.monitor-option-too-small",
                    quantity=name,
                    name=name,
                    value=value,
                    least=least,
                )

    def begin(self, components: int) -> MonitorState:
        """Return the state before the first epoch."""
        shape = (3, components)
        return MonitorState(np.zeros(shape), np.full(shape, np.nan), np.zeros(shape, dtype=bool))

    def advance(
        self, state: MonitorState, time: ArrayLike, normalised: ArrayLike
    ) -> tuple[MonitorState, tuple[Alarm, ...]]:
        """Process epochs; chunks of any length give the same as the whole.

        Parameters
        ----------
        state : MonitorState
        time : array_like, (n,), s
        normalised : array_like, (n, k)
            Innovations over their predicted standard deviations. NaN is ignored.

        Returns
        -------
        state : MonitorState
        alarms : tuple of Alarm
            Each once, until the sum has been at zero again.
        """
        u = np.clip(np.asarray(normalised, dtype=np.float64), -self.clip, self.clip)
        u = np.where(np.isnan(u), 0.0, u)
        told = ~np.isnan(np.asarray(normalised, dtype=np.float64))
        gain = 0.5 * (1.0 - 1.0 / self.larger**2)
        ratios = np.stack(
            [
                gain * u * u - math.log(self.larger),
                self.apart * u - 0.5 * self.apart**2,
                -self.apart * u - 0.5 * self.apart**2,
            ],
            axis=1,
        )
        ratios *= told[:, None, :]
        sums, since, raised = state.sums.copy(), state.since.copy(), state.raised.copy()
        alarms: list[Alarm] = []
        for now, ratio in zip(np.asarray(time, dtype=np.float64).tolist(), ratios, strict=True):
            fresh = sums <= 0.0
            sums += ratio
            since[fresh] = now
            down = sums <= 0.0
            sums[down] = 0.0
            raised &= ~down
            over = (sums >= self.threshold) & ~raised
            if over.any():
                alarms += [
                    Alarm(int(k), WHAT[kind], float(since[kind, k]), now)
                    for kind, k in np.argwhere(over)
                ]
                raised |= over
        return MonitorState(sums, since, raised), tuple(alarms)


#: Quantities of the three sums.
WHAT: Sequence[str] = ("larger", "high", "low")


# Meaning of inconsistent innovations, as text.


#: A change before this part of the epochs applies to the whole run.
EARLY = 0.1
#: Epochs to which a mean and a scatter are fitted.
FEWEST_AFTER = 5


@dataclass(frozen=True)
class Verdict:
    """An inconsistency of the innovations with the filter.

    Attributes
    ----------
    kind : {'change', 'understated', 'overstated', 'bias', 'correlated', 'gross', 'few'}
    component : str
        Its label.
    since : float, s
        First epoch for which it is so.
    what : str
        As text, with the numbers.
    meaning : str
        Probable cause, and remedy.
    p : float
        Probability by chance; for a change an upper bound.
    """

    kind: str
    component: str
    since: float
    what: str
    meaning: str
    p: float


class Component(Protocol):
    """Data of one component for the tests."""

    @property
    def label(self) -> str: ...
    @property
    def count(self) -> int: ...
    @property
    def gross(self) -> int: ...
    @property
    def scale(self) -> float: ...
    @property
    def bias(self) -> float: ...
    @property
    def bias_in_unit(self) -> float: ...
    @property
    def autocorrelation(self) -> Array: ...
    @property
    def whiteness_p(self) -> float: ...
    @property
    def lag_p(self) -> float: ...
    @property
    def scale_p(self) -> float: ...


def judge(
    time: Array,
    normalised: Array,
    gross: NDArray[np.bool_],
    components: Sequence[Component],
    alarms: Sequence[Alarm],
    level: float,
    fewest: int,
) -> tuple[Verdict, ...]:
    """Return the inconsistencies of an observation.

    Parameters
    ----------
    time : ndarray, (n,), s
    normalised : ndarray, (n, k)
        NaN for missing values and gross errors.
    gross : ndarray of bool, (n, k)
    components : sequence of ComponentConsistency
    alarms : sequence of Alarm
    level : float
        Below this probability a deviation is significant.
    fewest : int
        Fewer epochs allow no test.

    Returns
    -------
    tuple of Verdict
        The least probable first; gross errors and too few epochs last.
    """
    found: list[Verdict] = []
    for k, one in enumerate(components):
        good = ~np.isnan(normalised[:, k])
        first = float(time[good][0]) if good.any() else math.nan
        if one.count - one.gross < fewest:
            found.append(_few(one, first, fewest))
        else:
            changed = _changes(time, normalised[:, k], k, one, alarms, level)
            found += changed or _throughout(one, first, level)
        if one.gross:
            at = time[gross[:, k]]
            found.append(_gross(one, at))
    return tuple(sorted(found, key=lambda v: (v.kind in ("gross", "few"), v.p)))


def _named(one: Component) -> str:
    """Of 'north, m' the north."""
    return one.label.partition(", ")[0]


def _unit(one: Component) -> str:
    """Of 'north, m' a blank and the m; empty without a unit."""
    unit = one.label.partition(", ")[2]
    return f" {unit}" if unit else ""


def _changes(
    time: Array, u: Array, k: int, one: Component, alarms: Sequence[Alarm], level: float
) -> list[Verdict]:
    """Alarms of changes within the run, consistent before them."""
    own = [alarm for alarm in alarms if alarm.component == k]
    if not own:
        return []
    alarm = min(own, key=lambda a: a.known)
    since, better = _begun(time, u, alarm.known)
    before, after = u[time < since], u[time >= since]
    before, after = before[~np.isnan(before)], after[~np.isnan(after)]
    # Limit of the largest chance improvement among so many instants.
    if len(before) < EARLY * len(u) or better < math.log(len(u) / level):
        return []
    scale = math.sqrt(float(np.mean(after**2)))
    how = {
        "larger": "scatters more than was expected",
        "high": "is above what was expected",
        "low": "is below what was expected",
    }[alarm.what]
    return [
        Verdict(
            "change",
            one.label,
            since,
            f"{_named(one)} {how} from {since:.9g} s on (mean {after.mean():+.2f}, root mean "
            f"square {scale:.2f} of what was stated; before, {before.mean():+.2f} and "
            f"{math.sqrt(float(np.mean(before**2))):.2f}); no doubt of it at {alarm.known:.9g} s",
            "something happened then: a jump of a sensor's bias, reflections or another mode of "
            "the receiver, a motion that the model does not have; look at events and sensors "
            "about this time",
            level,
        )
    ]


def _begun(time: Array, u: Array, known: float) -> tuple[float, float]:
    """Most likely begin of a change of mean and scatter to constant values.

    Among the epochs up to `known`: where ``n/2 (mean u² - 1 - ln var u)``, the logarithm of the
    likelihood ratio of the n innovations from there on, is largest; and its excess over the case
    without a change, with those values from the first epoch on.
    """
    told = ~np.isnan(u)
    t, x = time[told], u[told]
    n = np.arange(len(x), 0, -1)
    first = np.cumsum(x[::-1])[::-1] / n
    second = np.cumsum(x[::-1] ** 2)[::-1] / n
    variance = np.maximum(second - first**2, 1e-12)
    ratio = 0.5 * n * (second - 1.0 - np.log(variance))
    # A fit to a few epochs is always likely.
    ratio[(t > known) | (n < FEWEST_AFTER)] = -np.inf
    at = int(np.argmax(ratio))
    return float(t[at]), float(ratio[at] - ratio[0])


def _throughout(one: Component, first: float, level: float) -> list[Verdict]:
    """Inconsistencies of the whole run."""
    out = []
    n = one.count - one.gross
    correlated = min(one.lag_p, one.whiteness_p)
    # The mean of innovations with a larger scatter or a correlation deviates more by chance: by
    # (1 + rho)/(1 - rho) in variance for a first-order process.
    spread = max(1.0, math.sqrt(max(one.scale**2 - one.bias**2, 0.0)))
    rho = float(one.autocorrelation[0])
    if correlated < level and rho > 0.0:
        spread *= math.sqrt((1.0 + rho) / max(1.0 - rho, 1.0 / n))
    bias_p = 2.0 * float(normal_above(abs(one.bias) * math.sqrt(n) / spread))
    # A significant mean is not part of the scatter.
    scale, scale_p = one.scale, one.scale_p
    if bias_p < level:
        square = n * (scale**2 - one.bias**2)
        scale = math.sqrt(max(square, 0.0) / (n - 1))
        scale_p = 2.0 * min(chi_square_above(square, n - 1), chi_square_below(square, n - 1))
    if scale_p < level:
        larger = scale > 1.0
        out.append(
            Verdict(
                "understated" if larger else "overstated",
                one.label,
                first,
                f"{_named(one)} scatters {scale:.2f} times as much as was expected",
                (
                    "the stated noise of the observation, or what the model adds between two of "
                    f"them, is understated by up to a factor of {scale:.2g}: a larger standard "
                    "deviation, or, where it is correlated, more noise of the inertial sensors"
                    if larger
                    else "the stated noise is overstated by up to a factor of "
                    f"{1.0 / max(scale, 1e-9):.2g}; an observation that was smoothed, or is of "
                    "the same data as another, looks so too"
                ),
                scale_p,
            )
        )
    if bias_p < level:
        out.append(
            Verdict(
                "bias",
                one.label,
                first,
                f"{_named(one)} is {one.bias:+.2f} standard deviations from zero on average "
                f"({one.bias_in_unit:+.3g}{_unit(one)})",
                "a constant that no state takes up: a lever arm, a mounting, a datum of heights, "
                "a time offset at a steady speed, or the bias of another aid of the same quantity",
                bias_p,
            )
        )
    if correlated < level:
        out.append(
            Verdict(
                "correlated",
                one.label,
                first,
                f"{_named(one)} follows itself: {rho:+.2f} from one epoch to the next",
                (
                    "the errors of the observation are coloured (a receiver that filters, "
                    "atmosphere, reflections), or the model lags behind: too little noise of the "
                    "inertial sensors, a time offset, a lever arm; give the receiver a drift, or "
                    "observations farther apart, and look at time offset and lever arm first"
                    if rho > 0.0
                    else "each epoch takes back what the one before it gave: the observation is "
                    "believed too much, its stated noise is too small, or the inertial sensors' "
                    "too large"
                ),
                correlated,
            )
        )
    return out


def _gross(one: Component, at: Array) -> Verdict:
    share = one.gross / max(one.count, 1)
    return Verdict(
        "gross",
        one.label,
        float(at[0]),
        f"{_named(one)} has {one.gross} gross errors in {one.count} epochs "
        f"({100.0 * share:.1f} %), the first at {at[0]:.9g} s",
        "observations that are no part of the model; a robust rule keeps them from doing harm",
        0.0,
    )


def _few(one: Component, first: float, fewest: int) -> Verdict:
    return Verdict(
        "few",
        one.label,
        first,
        f"{_named(one)} has {one.count - one.gross} epochs",
        f"fewer than {fewest} tell of nothing",
        1.0,
    )
