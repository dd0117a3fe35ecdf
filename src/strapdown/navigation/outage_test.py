"""GNSS outage test: position error of a navigator at withheld fixes.

A good receiver replaces a reference: some seconds of its fixes are withheld, and the navigator,
which continues without them, is scored against them. Its stated error is tested on the same
fixes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.dsp.chi_square import PLANE_95, plane_reach
from strapdown.errors import ConfigError
from strapdown.estimation.covariance import Step
from strapdown.navigation.measurements.measurement import TabulatedMeasurement
from strapdown.navigation.navigator import Navigator
from strapdown.navigation.pipeline import NavigationPipeline, PipelineState
from strapdown.navigation.record import InnovationRecord, NavigationChunk, Span
from strapdown.progress import Progress
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import index_of, source_of, values_of

__all__ = [
    "SETTLED",
    "Withheld",
    "WithheldRun",
    "WithheldScore",
    "Withholding",
    "blinded",
    "end_of_what_tells",
    "score_of",
    "score_of_smoothed",
    "score_withholding",
    "spans_to_withhold",
    "withheld_runs",
]


Array = NDArray[np.float64]


@dataclass(frozen=True)
class Withholding:
    """Update rule with zero weight: innovations are computed but not used."""

    def step(self, nu: float, s: float, r: float) -> Step:
        """Return a step of zero corrections."""
        return Step(0.0, 1.0, r, 0.0)


@dataclass(frozen=True, eq=False)
class WithheldScore:
    """Errors of a navigator over one span without fixes.

    Attributes
    ----------
    time : ndarray, (n,), s
        Of the fixes that were withheld, on the clock of the inertial sensors.
    error : ndarray, (n, 3), m
        Computed position of the antenna minus the fix, north, east, down.
    variance : ndarray, (n, 3), m²
        Predicted variance of the error, including the noise of the fix.
    covariance : ndarray, (n, 2, 2), m²
        Of its horizontal part, the noise of the fix with it.
    """

    span: Span
    time: Array
    error: Array
    variance: Array
    covariance: Array

    @property
    def horizontal(self) -> Array:
        """Length of the horizontal error, (n,), m."""
        return np.asarray(np.hypot(self.error[:, 0], self.error[:, 1]))

    @property
    def largest(self) -> float:
        """Largest horizontal error, m."""
        return float(self.horizontal.max())

    @property
    def bound(self) -> Array:
        """95 % bound of the error, in the direction of the error, (n,), m.

        Distance at which the ray through the error leaves the 95 % ellipse: `horizontal` is below
        it if and only if the error is inside.
        """
        return plane_reach(self.horizontal, self.distance, self.covariance)

    @property
    def bound_at_largest(self) -> float:
        """95 % bound at the instant of the largest horizontal error, m."""
        return float(self.bound[int(np.argmax(self.horizontal))])

    @property
    def distance(self) -> Array:
        """Mahalanobis distance of the horizontal error, (n,): 2.45 is the 95 % bound."""
        e = self.error[:, :2]
        weighed = np.linalg.solve(self.covariance, e[:, :, None])[..., 0]
        return np.asarray(np.sqrt((e * weighed).sum(axis=1)))

    @property
    def inside(self) -> bool:
        """Whether the largest horizontal error is within the 95 % ellipse of its instant."""
        return bool(self.distance[int(np.argmax(self.horizontal))] <= PLANE_95)


def spans_to_withhold(begin: float, end: float, length: float, places: int = 5) -> tuple[Span, ...]:
    """Return evenly spread spans of one length: the first at the begin, the last at the end.

    Parameters
    ----------
    begin, end : float, s
        Interval with fixes in which the filter has settled.
    length : float, s

    Returns
    -------
    tuple of Span
        They overlap if the interval is too short; each is tested by itself.
    """
    room = end - begin - length
    if room < 0.0 or places < 1 or not length > 0.0:
        raise ConfigError(
            "evaluation.spans-do-not-fit-within",
            quantity="withhold",
            places=places,
            length=length,
            end=max(end - begin, 0.0),
        )
    starts = begin + room * (np.linspace(0.0, 1.0, places) if places > 1 else np.array([0.5]))
    return tuple(Span(f"{length:g} s", float(at), float(at + length)) for at in starts)


def blinded(navigator: Navigator, name: str) -> Navigator:
    """Return a navigator that computes an aid's innovations without using them.

    Parameters
    ----------
    name : str
        Of the aid.
    """
    aid = navigator.by_name.get(name)
    if not isinstance(aid, TabulatedMeasurement):
        raise ConfigError(
            "evaluation.no-aid-table",
            quantity="withhold",
            name=name,
            word=name,
            known=navigator.by_name,
        )
    aids = navigator.aids
    blind = tuple(replace(one, rule=Withholding()) if one.name == name else one for one in aids)
    return replace(navigator, aids=blind)


def score_of(pieces: Sequence[NavigationChunk], name: str, span: Span) -> WithheldScore:
    """Score a navigator over a span in which an aid's innovations were computed but not used.

    Parameters
    ----------
    name : str
        Of the aid; its observation ``NAME.position`` is scored.
    """
    seen = seen_of(pieces, name, span)
    time = np.array([one.time for one in seen])
    nu = np.array([one.innovations.nu for one in seen])
    s = np.array([one.innovations.s for one in seen])
    marks = {mark.time: mark.covariance for piece in pieces for mark in piece.marks}
    P = np.array([marks[at][:2, :2] for at in time.tolist()])
    return WithheldScore(span, time, nu, s, P + _beyond_place(s, P))


def seen_of(pieces: Sequence[NavigationChunk], name: str, span: Span) -> list[InnovationRecord]:
    """Return the innovations of the fixes of a span.

    Parameters
    ----------
    name : str
        Of the aid.
    span : Span
        For messages.
    """
    seen = [one for piece in pieces for one in piece.seen if one.name == f"{name}.position"]
    if not seen:
        raise ConfigError(
            "evaluation.no-fixes-score", quantity="withhold", begin=span.begin, end=span.end
        )
    return seen


def _beyond_place(s: Array, P: Array) -> Array:
    """Return the predicted variance of a fix beyond that of the position, (n, 2, 2).

    The predicted variance along north and east is P, the part of the lever arm, and the fix's own
    noise: the part beyond P is independent from axis to axis except for the lever arm.
    """
    beyond = np.maximum(s[:, :2] - np.diagonal(P, axis1=1, axis2=2), 0.0)
    return np.asarray(np.eye(2) * beyond[:, None, :])


# GNSS outage test of a smoother: its error at withheld fixes.


#: A smoother gets so many lengths of the stretch after it, and at least so many seconds: later
#: fixes add no information on the stretch.
AFTER, LEAST_AFTER = 2.0, 60.0


def end_of_what_tells(span: Span) -> float:
    """Return the time up to which a smoother gets data after a span, s."""
    return span.end + max(AFTER * (span.end - span.begin), LEAST_AFTER)


def score_of_smoothed(
    navigator: Navigator,
    pieces: Sequence[NavigationChunk],
    later: Sequence[NavigationChunk],
    name: str,
    span: Span,
) -> WithheldScore:
    """Score the smoothed solution over a span.

    The antenna position and its covariance follow from the smoothed state with the smoothed lever
    arm and the smoothed clock offset, where these are estimated.

    Parameters
    ----------
    navigator : Navigator
        With a smoother.
    pieces : sequence of NavigationChunk
        Of the span, in which the aid's innovations were computed but not used.
    later : sequence of NavigationChunk
        That follow, with the aid.
    name : str
        Of the aid, which is a receiver.
    """
    assert navigator.smoother is not None
    seen = seen_of(pieces, name, span)
    smoothing = navigator.smoother.begin(navigator)
    for piece in (*pieces, *later):
        smoothing.take(piece)
    time = np.array([one.time for one in seen])
    # With a rule of its own it does not take the compiled loop of a single receiver.
    observations = [one.observation for one in seen if one.observation is not None]
    error, covariance = smoothing.seen(time, observations)
    variance = np.einsum("kii->ki", covariance)
    return WithheldScore(span, time, error, variance, covariance[:, :2, :2])


# GNSS outage test: score a pipeline by fixes withheld from it.


#: Time after the begin of navigation until the filter has settled, s.
SETTLED = 30.0


@dataclass(frozen=True, eq=False)
class Withheld:
    """Score of one test outage.

    Attributes
    ----------
    forward : WithheldScore
        By the measurements before it.
    smoothed : WithheldScore or None
        By the measurements after it, too, where the navigator has a smoother.
    """

    forward: WithheldScore
    smoothed: WithheldScore | None

    @property
    def result(self) -> WithheldScore:
        """Score of the run: smoothed if available."""
        return self.smoothed or self.forward


def score_withholding(
    chain: NavigationPipeline,
    imu: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame],
    name: str,
    spans: Sequence[Span],
    begun: float,
    progress: Progress,
) -> tuple[Withheld, ...]:
    """Run a pipeline with all fixes up to each test outage, and through it with none.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        By name of the measurement.
    name : str
        Name of the measurement whose fixes are withheld.
    spans : sequence of Span
        The test outages.
    begun : float, s
        Begin of navigation.

    Returns
    -------
    tuple of Withheld
        In the order of the outages.
    """
    time = index_of(imu)
    values = values_of(imu, [*GYRO, *ACCEL])
    state = chain.begin(imu.attrs["sampling"], source_of(imu))
    for aid, table in tables.items():
        state = chain.tell(state, aid, table)
    for span in spans:
        if span.begin < begun or span.end > time[-1]:
            raise ConfigError(
                "navigation.not-within-navigation-goes",
                file=source_of(imu),
                quantity="withhold, spans_s",
                begin=span.begin,
                end=span.end,
                begun=begun,
                time=time[-1],
            )
    found: dict[int, Withheld] = {}
    blind = replace(chain, navigator=blinded(chain.navigator, name))
    runs = withheld_runs(chain, blind, state, time, values, spans)
    for k, withheld in enumerate(runs):
        progress("withholding fixes", k / len(spans))
        span = spans[withheld.number]
        smoothed = None
        if chain.navigator.smoother is not None:
            until = int(np.searchsorted(time, end_of_what_tells(span), side="right"))
            then = slice(withheld.rows.stop, until)
            _, after = chain.advance(withheld.through, time[then], values[then])
            smoothed = score_of_smoothed(
                chain.navigator, withheld.pieces, after.navigation, name, span
            )
        found[withheld.number] = Withheld(score_of(withheld.pieces, name, span), smoothed)
    return tuple(found[k] for k in range(len(spans)))


@dataclass(frozen=True, eq=False)
class WithheldRun:
    """Run over a test outage in which a measurement is compared and not processed.

    Attributes
    ----------
    number : int
        Of the outage.
    state : PipelineState
        At its begin, with all earlier measurements processed.
    through : PipelineState
        At its end.
    rows : slice
        Of its samples.
    """

    number: int
    state: PipelineState
    through: PipelineState
    rows: slice
    pieces: tuple[NavigationChunk, ...]


def withheld_runs(
    chain: NavigationPipeline,
    blind: NavigationPipeline,
    state: PipelineState,
    time: Array,
    values: Array,
    spans: Sequence[Span],
    with_fixes: Callable[[Sequence[NavigationChunk]], object] | None = None,
) -> Iterator[WithheldRun]:
    """Process samples with every fix up to each test outage, and through it with none.

    Parameters
    ----------
    blind : NavigationPipeline
        The same without use of the withheld fixes (`blinded`).
    state : PipelineState
        Before the first of the samples.
    time : ndarray, (n,), s
    values : ndarray, (n, 6)
    spans : sequence of Span
        Within the samples. Each is tested separately: later ones have had its fixes.
    with_fixes : callable, optional
        Called with the chunks of the run with every fix, which then goes to the end of the last
        outage.

    Yields
    ------
    WithheldRun
        In order of time.
    """
    at = 0
    for number in sorted(range(len(spans)), key=lambda k: spans[k].begin):
        span = spans[number]
        first, last = np.searchsorted(time, [span.begin, span.end], side="right").tolist()
        state, used = chain.advance(state, time[at:first], values[at:first])
        if with_fixes is not None:
            with_fixes(used.navigation)
        at = first
        through, piece = blind.advance(state, time[first:last], values[first:last])
        yield WithheldRun(number, state, through, slice(first, last), piece.navigation)
    if with_fixes is not None:
        end = int(np.searchsorted(time, max(span.end for span in spans), side="right"))
        with_fixes(chain.advance(state, time[at:end], values[at:end])[1].navigation)
