"""Evaluation of a navigation run, computed once for its report."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.config.navigation import make_aids
from strapdown.constants import Array
from strapdown.dsp.chi_square import chi_square_exceeded, plane_bound
from strapdown.dsp.samples import true_runs
from strapdown.errors import Finding
from strapdown.estimation.robust import AdaptiveScale
from strapdown.navigation.blame import BLAMES, REFUTING
from strapdown.navigation.consistency import (
    ObservationConsistency,
    consistency_of,
)
from strapdown.navigation.measurements.measurement import lasting
from strapdown.navigation.record import NavigationRecord, Span, innovation_labels
from strapdown.navigation.truth_comparison import (
    TruthComparison,
    band_of_mean,
    compare_with_truth,
)
from strapdown.report.document import Trust, reason
from strapdown.report.values import shown_unit
from strapdown.systems.navigation_run import NavigationRun
from strapdown.tables import EULER
from strapdown.tables.checks import index_of, values_of, view_of
from strapdown.tables.on_disk import let_go, let_go_of_all, parts_of

if TYPE_CHECKING:
    from strapdown.report.paired_corrections import HorizontalErrors

#: A smaller relative reduction of a bound means that the motion made the state not observable.
FELL = 0.1


@dataclass(frozen=True, eq=False)
class NavigationEvaluation:
    """A navigation run with what its report computes from it, each once."""

    run: NavigationRun

    @property
    def record(self) -> NavigationRecord:
        """Record of the run, smoothed if specified."""
        return self.run.record

    @property
    def truth_name(self) -> str:
        """Words that follow "error against"."""
        return self.run.source.truth_name or "the truth"

    @cached_property
    def bounds(self) -> Array:
        """95 % bounds of the horizontal position at the covariance marks, (n,), m."""
        return horizontal_bounds(self.record)

    @cached_property
    def outages(self) -> tuple[tuple[str, Span, float | None], ...]:
        """Source, span and largest horizontal bound in m of each outage; None without a mark."""
        time = index_of(self.record.sd)
        found: list[tuple[str, Span, float | None]] = []
        for aid, spans in self.record.outages.items():
            for span in spans:
                inside = (time >= span.begin) & (time <= span.end)
                bound = float(self.bounds[inside].max()) if inside.any() else None
                found.append((aid, span, bound))
        return tuple(found)

    @cached_property
    def heading_spans(self) -> tuple[Span, ...]:
        """Stretches of one heading status, whatever its reason."""
        return heading_spans(self.run)

    @cached_property
    def states(self) -> tuple[ShownStates, ...]:
        """Sensor and measurement error states of the filter, for display, in their order."""
        out, record = [], self.run.filtered
        for name, columns in state_groups(record).items():
            labels = [c.removeprefix(name).lstrip("_") for c in columns]
            # The unit must suit both the estimates and their standard deviations.
            sizes = [view_of(table, columns) for table in (record.sensors, record.sensors_sd)]
            size = max((float(np.nanmax(np.abs(v))) for v in sizes if v.size), default=0.0)
            let_go_of_all()
            factor, unit = shown_unit(record.units.get(columns[0], ""), size)
            aid, dot, own = name.rpartition(".")
            words = own.replace("_", " ")
            words = f"{aid}: {words}" if dot else words.replace("accel ", "accelerometer ")
            slug = name.replace("_", "-").replace(".", "-")
            out.append(ShownStates(words, slug, tuple(columns), tuple(labels), unit, factor))
        return tuple(out)

    def unobserved(self, block: ShownStates) -> tuple[str, ...]:
        """Labels of the states of a block whose bounds hardly decreased in the run."""
        sd = self.run.filtered.sensors_sd
        if len(sd) < 2:
            return ()
        first, last = sd.iloc[0], sd.iloc[-1]
        return tuple(
            label
            for label, column in zip(block.labels, block.columns, strict=True)
            if first[column] > 0.0 and last[column] > (1.0 - FELL) * first[column]
        )

    @cached_property
    def agreements(self) -> tuple[Agreement, ...]:
        """Consistency of each observation that has innovations."""
        return agreements(self.record, lasting(make_aids(self.run.spec)))

    @cached_property
    def errors(self) -> TruthComparison | None:
        """Errors against the truth, which has an instant in common with the run, else DataError."""
        return self._errors(self.record)

    @cached_property
    def forward_errors(self) -> TruthComparison | None:
        """Errors of the filter alone, for a smoothed run."""
        return None if self.run.forward is None else self._errors(self.run.forward)

    @cached_property
    def pair(self) -> tuple[HorizontalErrors, ...]:
        """Errors of the run and of the one with the other correction; empty without a second."""
        if self.run.beside is None:
            return ()
        from strapdown.report.paired_corrections import paired_errors

        return paired_errors(self.run)

    def _errors(self, record: NavigationRecord) -> TruthComparison | None:
        truth = self.run.source.truth
        if truth is None:
            return None
        return compare_with_truth(
            record.trajectory, record.sd.index, record.covariance, truth, self.run.ellipsoid
        )


def heading_spans(run: NavigationRun) -> tuple[Span, ...]:
    """Stretches of a run with one heading status each, by its name."""
    spans: list[Span] = []
    for one in run.trust.heading.spans:
        if spans and spans[-1].name == one.status:
            spans[-1] = replace(spans[-1], end=one.end)
        else:
            spans.append(Span(one.status, one.begin, one.end))
    return tuple(spans)


def horizontal_bounds(record: NavigationRecord) -> Array:
    """95 % bounds of the horizontal position at the covariance marks, (n,), m."""
    out = np.empty(len(record.covariance))
    for part in parts_of(len(out), 81):
        out[part] = plane_bound(record.covariance[part])
        let_go(record.covariance)
    return out


# Consistency of innovations: size and whiteness, against the filter's expectation.


#: An RMS of normalized innovations above this factor, or below its inverse, contradicts the
#: stated errors.
FAR_OFF = 2.0
#: Median normalized innovation, as a multiple of its expected value, that refutes the answer;
#: outliers do not affect a median.
REFUTES, LEAST_EPOCHS = 3.0, 5
#: Correlation above which time-correlated measurement errors matter for the bounds.
REMEMBER = 0.3


@dataclass(frozen=True, eq=False)
class Agreement:
    """Innovations of one observation with their consistency statistics.

    Components are processed sequentially, so their innovations are independent, and the normalized
    innovation squared (NIS) of an epoch is the sum of nu²/s.

    Attributes
    ----------
    labels : tuple of str
        Of the components, with units.
    time : ndarray, (n,), s
    nu, sd : ndarray, (n, m)
    weight : ndarray, (n, m)
        0 if rejected.
    used : ndarray of bool, (n,)
        Epochs without a rejected component.
    nis : ndarray, (n,)
    consistency : ObservationConsistency
        Consistency statistics of the filter.
    rejected, weakened : int
        Epochs with a rejected component; those with one of reduced weight and none rejected.
    mean_nis : float
        Over the used epochs; NaN if there are none.
    band : (float, float)
        95 % interval of the mean NIS of a consistent filter.
    ratio : float
        RMS of the innovations in units of their expected standard deviations.
    usual : float
        Square root of the median NIS over its expected median; outliers do not affect it.
    correlation : float
        Largest lag-1 autocorrelation of a component; NaN for too few epochs.
    correlation_bound : float
        95 % bound of the lag-1 autocorrelation of each component for white innovations.
    lasting : float
        `ratio` of independent errors with the effect of these first-order Gauss-Markov ones.
    stated : bool
        Whether the errors are stated as time-correlated.
    """

    name: str
    labels: tuple[str, ...]
    time: Array
    nu: Array
    sd: Array
    weight: Array
    used: NDArray[np.bool_]
    nis: Array
    consistency: ObservationConsistency
    rejected: int
    weakened: int
    mean_nis: float
    band: tuple[float, float]
    ratio: float
    usual: float
    correlation: float
    correlation_bound: float
    lasting: float
    stated: bool

    @property
    def epochs(self) -> int:
        """Number of epochs."""
        return len(self.time)

    @property
    def refutes(self) -> bool:
        """Whether most epochs contradict the answer or are rejected, or errors correlate."""
        if self.epochs < LEAST_EPOCHS:
            return False
        lasts = self.ratio > REFUTES and self.remembers
        return self.usual > REFUTES or lasts or 2 * self.rejected > self.epochs

    @property
    def remembers(self) -> bool:
        """Whether the innovations are correlated in time so much that a bound may be too narrow.

        Time-correlated errors have the effect of independent ones of `lasting` times the stated
        size. If that is at most the stated size, as for a constraint whose deviation is stated
        accordingly, no bound is too narrow. For errors stated as time-correlated the limit is
        `FAR_OFF`, as for the size.
        """
        far = bool(abs(self.correlation) > max(REMEMBER, 2.0 * self.correlation_bound))
        most = FAR_OFF if self.stated else 1.0
        return far and (self.correlation < 0.0 or self.lasting > most)

    @property
    def inside(self) -> bool:
        """Whether the mean NIS is within its 95 % interval."""
        return self.band[0] <= self.mean_nis <= self.band[1]

    @property
    def acceptable(self) -> bool:
        """Whether the size is as expected within a factor of two, correlation included."""
        near = self.ratio < FAR_OFF and max(self.ratio, self.lasting) > 1.0 / FAR_OFF
        return self.inside or near


def agreements(record: NavigationRecord, lasting: Collection[str] = ()) -> tuple[Agreement, ...]:
    """Return the consistency of each observation that has innovations.

    `lasting`: names of the measurement sources with stated time-correlated errors.
    """
    return tuple(
        _agreement(name, table, (name.rpartition(".")[0] or name) in lasting)
        for name, table in record.innovations.items()
        if len(table)
    )


def _agreement(name: str, table: pd.DataFrame, stated: bool) -> Agreement:
    labels = tuple(innovation_labels(table))
    nu, s, weight = (
        values_of(table, [f"{part} {label}" for label in labels]) for part in ("nu", "s", "weight")
    )
    sd = np.sqrt(s)
    some, lost = (weight < 1.0).any(axis=1), (weight <= 0.0).any(axis=1)
    used = np.asarray((weight > 0.0).all(axis=1) & (sd > 0.0).all(axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        nis = np.square(nu / sd).sum(axis=1)
    count, freedom = int(used.sum()), len(labels)
    mean, band, usual = math.nan, (math.nan, math.nan), math.nan
    if count:
        mean = float(nis[used].mean())
        band = band_of_mean(freedom, count)
        usual = math.sqrt(float(np.median(nis[used])) / float(chi_square_exceeded(0.5, freedom)))
    ratio = math.sqrt(mean / freedom) if freedom else math.nan
    consistency = consistency_of(name, table)
    long = [one for one in consistency.components if one.autocorrelation.size]
    correlation = max((float(one.autocorrelation[0]) for one in long), key=abs, default=math.nan)
    rho = min(correlation, 1.0 - 1.0 / max(count, 2))
    return Agreement(
        name=name,
        labels=labels,
        time=index_of(table),
        nu=nu,
        sd=sd,
        weight=weight,
        used=used,
        nis=nis,
        consistency=consistency,
        rejected=int(lost.sum()),
        weakened=int((some & ~lost).sum()),
        mean_nis=mean,
        band=band,
        ratio=ratio,
        usual=usual,
        correlation=correlation,
        correlation_bound=max((one.autocorrelation_bound for one in long), default=math.nan),
        lasting=ratio * math.sqrt((1.0 + rho) / (1.0 - rho)) if rho > 0.0 else ratio,
        stated=stated,
    )


@dataclass(frozen=True)
class ShownStates:
    """States of one kind, with their display unit.

    Attributes
    ----------
    name : str
        In words: ``gyro bias``, ``rtk: lever arm``.
    columns : tuple of str
        Columns of the record.
    labels : tuple of str
        ``x``, ``y``, ``z``.
    factor : float
        Conversion from SI.
    """

    name: str
    slug: str
    columns: tuple[str, ...]
    labels: tuple[str, ...]
    unit: str
    factor: float


def state_groups(record: NavigationRecord) -> dict[str, list[str]]:
    """Columns of the states of each kind."""
    groups: dict[str, list[str]] = {}
    for column in map(str, record.sensors.columns):
        groups.setdefault(column.rpartition("_")[0] or column, []).append(column)
    return groups


def rejected_times(table: pd.DataFrame) -> Array:
    """Times of the epochs with a rejected component in a table of innovations."""
    weights = values_of(table, [f"weight {label}" for label in innovation_labels(table)])
    return index_of(table)[(weights <= 0.0).any(axis=1)]


def rms(values: Array) -> float:
    """Root mean square of the finite values; NaN if there are none."""
    known = values[np.isfinite(values)]
    return math.sqrt(float(np.square(known).mean())) if known.size else math.nan


def distance_over_ground(trajectory: pd.DataFrame) -> float:
    """Distance over ground, m: the horizontal speed integrated by the trapezoidal rule."""
    time = index_of(trajectory)
    speed = np.hypot(*(trajectory[c].to_numpy(dtype=np.float64) for c in ("VN", "VE")))
    let_go(trajectory)
    return float(np.trapezoid(speed, time))


# Judge whether a navigation run can be trusted, from its consistency with its bounds.


# Errors of one run are correlated in time, so less than 95 % may lie within a good bound, and of an
# error that hardly changes all or none. Then it counts how rarely one as large occurs with right
# bounds: at most one in twenty of such runs is refuted by any of its quantities.
_ENOUGH, _RARE = 0.8, 0.05
# Share of the epochs; more rejected epochs are not outliers.
_MANY = 0.1


def trust(evaluation: NavigationEvaluation) -> Trust:
    """Judge a run by its consistency."""
    known = _against_known(evaluation)
    used = [one for one in evaluation.agreements if one.used.any()]
    # The cause, where one is found, stands before what it does.
    warned = [f for f in evaluation.run.findings if f.severity == "warning"]
    reasons = [f for f in warned if f.code in BLAMES] + known + [_innovations(one) for one in used]
    for one in evaluation.agreements:
        if one.remembers:
            chance = {"correlation": one.correlation, "by_chance": one.correlation_bound}
            reasons.append(
                reason(False, "navigation.innovations-correlated", name=one.name, **chance)
            )
    reasons += _rejected(evaluation)
    # Notes appear among the findings and do not count against the run.
    reasons += [f for f in warned if f.code not in BLAMES]
    if not used and evaluation.errors is None and not evaluation.run.withheld:
        reasons.append(reason(False, "navigation.nothing-observed"))
    wrong = any(one.severity == "warning" for one in known)
    wrong |= any(one.refutes for one in evaluation.agreements)
    refuting = (*REFUTING, "navigation.heading-ambiguous")
    wrong |= any(one.code in refuting for one in evaluation.run.findings)
    against = any(one.severity == "warning" for one in reasons)
    verdict = "trusted" if not against else "distrusted" if wrong else "reserve"
    return Trust(verdict, tuple(reasons), _short(evaluation))


def _short(evaluation: NavigationEvaluation) -> tuple[Finding, ...]:
    parts = []
    if evaluation.errors is not None:
        share, name = evaluation.errors.score("horizontal").share, evaluation.truth_name
        code = "navigation.position-within-bound"
        parts.append(reason(True, code, reference=name, share=share))
    if (count := len(evaluation.run.withheld)) == 1:
        parts.append(reason(True, "navigation.outage-test-passed"))
    elif count:
        parts.append(reason(True, "navigation.outage-tests-passed", count=count))
    if used := [one for one in evaluation.agreements if one.used.any()]:
        worst = max(used, key=lambda a: abs(a.ratio - 1.0))
        code = "navigation.innovations-as-expected-worst"
        code = "navigation.innovations-as-expected" if len(used) == 1 else code
        parts.append(reason(True, code, name=worst.name, ratio=worst.ratio))
    return tuple(parts)


def _against_known(evaluation: NavigationEvaluation) -> list[Finding]:
    """Compare the run with the truth and with withheld fixes."""
    out = []
    words = {"horizontal": "horizontal position", "down": "height"}
    names = ("horizontal", "down", *reversed(EULER))
    scores = [] if evaluation.errors is None else [evaluation.errors.score(n) for n in names]
    known = [one for one in scores if not np.isnan(one.share)]
    for score in known:
        lasting = score.share < _ENOUGH and score.chance >= _RARE / len(known)
        code = "navigation.error-beside-bound"
        good = bool(score.share >= _ENOUGH or lasting)
        component = words.get(score.quantity, score.quantity)
        keys = ("rms", "bound", "unit", "share", "chance")
        data = {key: getattr(score, key) for key in keys}
        code = "navigation.error-beside-bound-lasting" if lasting else code
        out.append(reason(good, code, component=component, **data))
    tests = [one.result for one in evaluation.run.withheld]
    if tests:
        from strapdown.navigation.outage_test import judge_outages

        verdict = judge_outages(tests)
        worst = tests[verdict.worst]
        code = "navigation.outage-tests"
        out.append(
            reason(
                verdict.consistent,
                code if worst.against == "fixes" else "navigation.outage-tests-truth",
                inside=verdict.inside,
                instants=verdict.count,
                count=len(tests),
                error_m=verdict.error,
                bound_m=verdict.bound,
                length_s=worst.span.end - worst.span.begin,
                probability=verdict.probability,
            )
        )
    return out


def _innovations(one: Agreement) -> Finding:
    larger = one.ratio > 1.0
    if one.inside:
        code = "navigation.innovations-agree"
    elif one.acceptable and one.ratio <= 1.0 / FAR_OFF:
        code = "navigation.innovations-small-but-correlated"
    elif one.acceptable and larger:
        code = "navigation.innovations-a-little-larger"
    elif one.acceptable:
        code = "navigation.innovations-a-little-smaller"
    else:
        code = "navigation.innovations-larger" if larger else "navigation.innovations-smaller"
    good = one.inside or one.acceptable
    return reason(good, code, name=one.name, ratio=one.ratio, independent=one.lasting)


def _rejected(evaluation: NavigationEvaluation) -> list[Finding]:
    out = []
    for one in evaluation.agreements:
        if one.rejected > _MANY * one.epochs:
            out.append(
                reason(
                    False,
                    "navigation.many-rejected",
                    name=one.name,
                    rejected=one.rejected,
                    epochs=one.epochs,
                    share=one.rejected / one.epochs,
                )
            )
        for label, column in zip(one.labels, one.weight.T, strict=True):
            # After so many in a row the adaptive rule processed the next one.
            ends = [
                k for k in true_runs(~(column > 0.0)) if k.stop - k.start >= AdaptiveScale.patience
            ]
            if ends:
                out.append(
                    reason(
                        False,
                        "navigation.rejected-in-a-row",
                        component=f"{one.name} {label.partition(',')[0]}",
                        count=max(k.stop - k.start for k in ends),
                        since=float(one.time[ends[0].start]),
                        until=float(one.time[ends[-1].stop - 1]),
                    )
                )
    return out
