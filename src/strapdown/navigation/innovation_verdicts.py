"""What innovations that are not as expected mean, in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from strapdown.dsp.chi_square import chi_square_above, chi_square_below, normal_above
from strapdown.navigation.innovation_monitor import Alarm

__all__ = ["Verdict", "judge"]

Array = NDArray[np.float64]

#: What began before this part of the epochs holds of the whole run.
EARLY = 0.1
#: Epochs of which a mean and a scatter are fitted.
FEWEST_AFTER = 5


@dataclass(frozen=True)
class Verdict:
    """Something that innovations say against a filter.

    Attributes
    ----------
    kind : {'change', 'understated', 'overstated', 'bias', 'correlated', 'gross', 'few'}
    component : str
        Its label.
    since : float, s
        First epoch for which it is so.
    what : str
        In words, with the numbers.
    meaning : str
        What it would mean, and what to try.
    p : float
        Probability of it by chance; of a change a bound of it.
    """

    kind: str
    component: str
    since: float
    what: str
    meaning: str
    p: float


class Component(Protocol):
    """What is asked of the numbers of a component."""

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
    """Say what is wrong.

    Parameters
    ----------
    time : ndarray, (n,), s
    normalised : ndarray, (n, k)
        NaN where there is none, or a gross error.
    gross : ndarray of bool, (n, k)
    components : sequence of ComponentConsistency
    alarms : sequence of Alarm
    level : float
        Below this probability something is no chance.
    fewest : int
        Fewer epochs tell of nothing.

    Returns
    -------
    tuple of Verdict
        The least probable first; what is said of gross errors and of too few epochs last.
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
    """Of 'north, m' a blank and the m; nothing where it has none."""
    unit = one.label.partition(", ")[2]
    return f" {unit}" if unit else ""


def _changes(
    time: Array, u: Array, k: int, one: Component, alarms: Sequence[Alarm], level: float
) -> list[Verdict]:
    """Alarms of what began within the run: before them all was as expected."""
    own = [alarm for alarm in alarms if alarm.component == k]
    if not own:
        return []
    alarm = min(own, key=lambda a: a.known)
    since, better = _begun(time, u, alarm.known)
    before, after = u[time < since], u[time >= since]
    before, after = before[~np.isnan(before)], after[~np.isnan(after)]
    # Among so many instants one is better by chance by no more than this.
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
    """Most likely begin of a change of mean and scatter to values that then hold.

    Of those not after `known`: where ``n/2 (mean u² - 1 - ln var u)``, the logarithm of the ratio
    of the likelihoods of the n innovations from there on, is largest; and how much larger it is
    than with no change at all, but those values from the first epoch on.
    """
    told = ~np.isnan(u)
    t, x = time[told], u[told]
    n = np.arange(len(x), 0, -1)
    first = np.cumsum(x[::-1])[::-1] / n
    second = np.cumsum(x[::-1] ** 2)[::-1] / n
    variance = np.maximum(second - first**2, 1e-12)
    ratio = 0.5 * n * (second - 1.0 - np.log(variance))
    # What is fitted to a few epochs is always likely.
    ratio[(t > known) | (n < FEWEST_AFTER)] = -np.inf
    at = int(np.argmax(ratio))
    return float(t[at]), float(ratio[at] - ratio[0])


def _throughout(one: Component, first: float, level: float) -> list[Verdict]:
    """What holds of the whole run."""
    out = []
    n = one.count - one.gross
    correlated = min(one.lag_p, one.whiteness_p)
    # A mean of what scatters more, or follows itself, is farther from zero by chance: by
    # (1 + rho)/(1 - rho) in variance, as that of a first-order process is.
    spread = max(1.0, math.sqrt(max(one.scale**2 - one.bias**2, 0.0)))
    rho = float(one.autocorrelation[0])
    if correlated < level and rho > 0.0:
        spread *= math.sqrt((1.0 + rho) / max(1.0 - rho, 1.0 / n))
    bias_p = 2.0 * float(normal_above(abs(one.bias) * math.sqrt(n) / spread))
    # The mean is no part of the scatter where it is no chance.
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
