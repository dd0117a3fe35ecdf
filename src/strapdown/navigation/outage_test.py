"""GNSS outage test: position error of a navigator at withheld fixes.

A good receiver replaces a reference: some seconds of its fixes are withheld, and the navigator,
which continues without them, is scored against them, or against the truth where it is known. Its
stated error is tested on the same instants.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.dsp.chi_square import PLANE_95, binomial_at_least, plane_reach
from strapdown.ellipsoids import Ellipsoid
from strapdown.errors import ConfigError
from strapdown.estimation.covariance import Step
from strapdown.navigation.measurements.measurement import TabulatedMeasurement
from strapdown.navigation.navigator import Navigator
from strapdown.navigation.pipeline import NavigationPipeline, PipelineState
from strapdown.navigation.record import InnovationRecord, NavigationChunk, Span
from strapdown.navigation.recorder import FullRecorder
from strapdown.navigation.smoother import Smoothing
from strapdown.navigation.truth_comparison import compare_with_truth
from strapdown.progress import Progress
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import index_of, source_of, values_of

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
        Of the fixes that were withheld, on the clock of the inertial sensors; of the marks of the
        covariance, against the truth.
    error : ndarray, (n, 3), m
        Computed position of the antenna minus the fix, north, east, down; computed minus true
        position.
    covariance : ndarray, (n, 2, 2), m²
        Predicted, of its horizontal part, the noise of the fix with it.
    drift : ndarray, (n,), m²
        Predicted variance of the horizontal position alone, sum of both components.
    against : str
        ``fixes`` or ``truth``.
    """

    span: Span
    time: Array
    error: Array
    covariance: Array
    drift: Array
    against: str = "fixes"

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
        return np.asarray(np.linalg.norm(self._whitened, axis=1))

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Whether each error is within its 95 % ellipse, (n,)."""
        return np.asarray(self.distance <= PLANE_95)

    @property
    def _whitened(self) -> Array:
        L = np.linalg.cholesky(self.covariance)
        return np.asarray(np.linalg.solve(L, self.error[:, :2, None])[..., 0])

    def without(self, times: Array) -> WithheldScore:
        """Return the score without the errors at some times."""
        kept = ~np.isin(self.time, times)
        arrays = {k: getattr(self, k)[kept] for k in ("time", "error", "covariance", "drift")}
        return replace(self, **arrays)

    def independent(self) -> tuple[float, float]:
        """Effective numbers of independent errors: for their share inside, for the largest one.

        Position errors p_i are correlated as those of a random walk, the least correlated of the
        errors that grow by themselves, and the noise of fixes is not: the correlation of two errors
        of variance s_i is ``ρ_ij = min(p_i, p_j)/√(s_i s_j)``, and of their squares ρ². A share
        of n of them has the variance of ``n²/Σρ_ij²`` independent ones; if successive errors are
        more alike (as those of a receiver are), with the correlation of an autoregressive sequence,
        ``n (1 - r²)/(1 + r²)``. To the largest one each error contributes the part of its variance
        that its predecessor does not determine, ``1 - ρ²``.
        """
        n, z = len(self.time), self._whitened
        s = np.einsum("kii->k", self.covariance)
        ρ = np.minimum.outer(self.drift, self.drift) / np.sqrt(np.multiply.outer(s, s))
        np.fill_diagonal(ρ, 1.0)
        pairs = float(np.square(z[1:]).sum() + np.square(z[:-1]).sum())
        r = max(2.0 * float((z[1:] * z[:-1]).sum()) / pairs, 0.0) if pairs > 0.0 else 0.0
        share = min(n * n / float(np.square(ρ).sum()), n * (1.0 - r * r) / (1.0 + r * r))
        return max(share, 1.0), n - float(np.square(np.diagonal(ρ, 1)).sum())


#: Probability below which errors contradict the predicted covariance.
IMPROBABLE = 0.01


@dataclass(frozen=True)
class OutageVerdict:
    """Agreement of the errors in test outages with their predicted covariance.

    Attributes
    ----------
    count : int
        Of the errors.
    inside : float
        Share of them within their 95 % ellipses.
    worst : int
        Outage with the largest error relative to its bound.
    error, bound : float, m
        That error, and its 95 % bound.
    probability : float
        Of as small a share inside, or as large an error, if the covariance is right.
    """

    count: int
    inside: float
    worst: int
    error: float
    bound: float
    probability: float

    @property
    def consistent(self) -> bool:
        """Whether the errors agree with their predicted covariance."""
        return self.probability >= IMPROBABLE


def judge_outages(scores: Sequence[WithheldScore]) -> OutageVerdict:
    """Test the errors of one or several outages against their predicted covariance.

    The share of the errors inside their bounds is tested as binomial, the largest one relative to
    its bound by the distribution of the maximum, both of effectively independent errors
    (`WithheldScore.independent`). The smaller probability counts twice, because there are two.
    """
    outside, of, largest = 0.0, 0.0, 0.0
    for one in scores:
        shares, maxima = one.independent()
        outside += shares * float(np.mean(~one.inside))
        of += shares
        largest += maxima
    # Outages that overlap have their errors in common.
    spans = sorted((one.span.begin, one.span.end) for one in scores)
    whole, until = 0.0, -math.inf
    for begin, end in spans:
        whole += max(end - max(begin, until), 0.0)
        until = max(until, end)
    apart = whole / sum(end - begin for begin, end in spans)
    farthest = [float(one.distance.max()) for one in scores]
    worst = int(np.argmax(farthest))
    at = int(np.argmax(scores[worst].distance))
    beyond = math.exp(-0.5 * farthest[worst] ** 2)
    p_largest = -math.expm1(largest * math.log1p(-beyond)) if beyond < 1.0 else 1.0
    p_share = binomial_at_least(apart * outside, apart * of, 0.05)
    return OutageVerdict(
        count=sum(len(one.time) for one in scores),
        inside=float(np.concatenate([one.inside for one in scores]).mean()),
        worst=worst,
        error=float(scores[worst].horizontal[at]),
        bound=float(scores[worst].bound[at]),
        probability=min(2.0 * min(p_share, p_largest), 1.0),
    )


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
    s = np.array([one.innovations.s[:2] for one in seen])
    marks = {mark.time: mark.covariance for piece in pieces for mark in piece.marks}
    P = np.array([marks[at][:2, :2] for at in time.tolist()])
    # Predicted along north and east are the variances of the position, of the lever arm, and of
    # the fix: what is beyond the first is independent from axis to axis except for the lever arm.
    beyond = np.maximum(s - np.diagonal(P, axis1=1, axis2=2), 0.0)
    covariance = P + np.eye(2) * beyond[:, None, :]
    return WithheldScore(span, time, nu, covariance, np.einsum("kii->k", P))


def score_by_truth(
    navigator: Navigator,
    pieces: Sequence[NavigationChunk],
    span: Span,
    truth: pd.DataFrame,
    ellipsoid: Ellipsoid,
    smoothing: Smoothing | None = None,
) -> WithheldScore:
    """Score a navigator over a span by the true path.

    Parameters
    ----------
    pieces : sequence of NavigationChunk
        Of the span; of what follows, too, if they are smoothed.
    smoothing : Smoothing, optional
        Of the same chunks.
    """
    tape = FullRecorder().begin(navigator)
    for piece in pieces:
        tape.take(piece)
    record = tape.record(smoothing=smoothing)
    marks = index_of(record.sd)
    within = marks <= span.end
    found = compare_with_truth(
        record.trajectory, marks[within], record.covariance[within], truth, ellipsoid
    )
    P = found.covariance[:, :2, :2]
    drift = np.einsum("kii->k", P)
    return WithheldScore(span, found.time, found.errors[:, :3], P, drift, "truth")


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


# GNSS outage test of a smoother: its error at withheld fixes.


#: A smoother gets so many lengths of the stretch after it, and at least so many seconds: later
#: fixes add no information on the stretch.
AFTER, LEAST_AFTER = 2.0, 60.0


def end_of_what_tells(span: Span) -> float:
    """Return the time up to which a smoother gets data after a span, s."""
    return span.end + max(AFTER * (span.end - span.begin), LEAST_AFTER)


def score_of_smoothed(
    pieces: Sequence[NavigationChunk],
    smoothing: Smoothing,
    name: str,
    span: Span,
) -> WithheldScore:
    """Score the smoothed solution over a span.

    The antenna position and its covariance follow from the smoothed state with the smoothed lever
    arm and the smoothed clock offset, where these are estimated.

    Parameters
    ----------
    pieces : sequence of NavigationChunk
        Of the span, in which the aid's innovations were computed but not used.
    smoothing : Smoothing
        Of these, and of those that follow with the aid.
    name : str
        Of the aid, which is a receiver.
    """
    seen = seen_of(pieces, name, span)
    time = np.array([one.time for one in seen])
    # With a rule of its own it does not take the compiled loop of a single receiver.
    observations = [one.observation for one in seen if one.observation is not None]
    error, covariance = smoothing.seen(time, observations)
    plane = covariance[:, :2, :2]
    noise = np.array([one.R[:2] for one in observations])
    return WithheldScore(span, time, error, plane, np.einsum("kii->k", plane) - noise.sum(axis=1))


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
    *,
    rejected: Array,
    truth: tuple[pd.DataFrame, Ellipsoid] | None = None,
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
    rejected : ndarray, (k,), s
        Times of the fixes that the run with fixes rejects: errors there are not the navigator's,
        and are left out, unless an outage has no others.
    truth : (DataFrame, Ellipsoid), optional
        Trajectory table, and the ellipsoid of its heights: an outage that it covers is scored by
        it.

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

    def score(
        pieces: tuple[NavigationChunk, ...],
        span: Span,
        smoothing: Smoothing | None = None,
        later: tuple[NavigationChunk, ...] = (),
    ) -> WithheldScore:
        if truth is not None:
            stamps = index_of(truth[0])
            if stamps[0] <= span.begin and stamps[-1] >= span.end:
                whole = (*pieces, *later)
                return score_by_truth(blind.navigator, whole, span, *truth, smoothing)
        if smoothing is None:
            found = score_of(pieces, name, span)
        else:
            found = score_of_smoothed(pieces, smoothing, name, span)
        sound = found.without(rejected)
        return sound if len(sound.time) else found

    for k, withheld in enumerate(runs):
        progress("withholding fixes", k / len(spans))
        span = spans[withheld.number]
        pieces, smoothed = withheld.pieces, None
        if chain.navigator.smoother is not None:
            until = int(np.searchsorted(time, end_of_what_tells(span), side="right"))
            then = slice(withheld.rows.stop, until)
            _, after = chain.advance(withheld.through, time[then], values[then])
            smoothing = chain.navigator.smoother.begin(chain.navigator)
            for piece in (*pieces, *after.navigation):
                smoothing.take(piece)
            smoothed = score(pieces, span, smoothing, after.navigation)
        forward = score(pieces, span)
        found[withheld.number] = Withheld(forward, smoothed)
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
