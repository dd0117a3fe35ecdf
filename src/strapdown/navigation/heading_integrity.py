"""Heading integrity, second by second: trusted, unverified or rejected.

Trusted is a promise: the heading error is within the requested limit. It requires two solutions
that do not share the assumptions made at the start: the run by its own bound, and an independent
heading check by its own. The check is a solution by fixes that began without a heading
(`navigation.heading_checks`), gyrocompassing at rest carried on by the gyros
(`navigation.heading_checks.carry_headings`), or two independent sources of heading
(`navigation.heading_checks.agreeing_sources`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import TWO_SIDED_95
from strapdown.errors import ConfigError
from strapdown.navigation.record import NavigationRecord, innovation_labels

Array = NDArray[np.float64]

#: Status of the heading, in the order of the codes in a table.
STATUSES = ("trusted", "unverified", "rejected")
TRUSTED, UNVERIFIED, REJECTED = range(3)
#: Reason of a status, by its code.
REASONS: dict[str, str] = {
    "": "the run and an independent check agree that it is within the limit",
    "assumed": "its own bound is small, but rests on the start or on one measurement only",
    "faint": "the independent check has not converged",
    "wide": "its own bound exceeds the limit",
    "scatter": "innovations scatter more than expected",
    "apart": "an independent check contradicts it",
    "unknown": "it is unknown",
}
#: Independent heading checks, by kind.
CHECKS: dict[str, str] = {
    "motion": "an independent solution from GNSS fixes",
    "gyrocompass": "gyrocompassing at rest",
    "sources": "two independent heading measurements",
}
#: Two-sided 99 % quantile of the normal distribution: a larger difference is significant, and
#: so many standard deviations bound the error of an independent check.
SURE = 2.5758293035489004
#: Scatter of the innovations over the last seconds, relative to the predicted one: beyond the first
#: limit the heading is not trusted, beyond the second it is rejected.
FAR_OFF, REFUTED = 2.0, 3.0
#: Validity of the result of a check, s, and the factor on the run's own growth since then.
CARRIED, GROWS = 60.0, 2.0
#: Window of the scatter, s, and fewest components in it.
RECENT, FEWEST = 30.0, 8
#: Labels of components without information on the heading.
VERTICAL = ("down", "VD", "height")
#: Limit of one normalized innovation, and its value if it was rejected: half of all rejected refute
#: a run.
CLIP, LOST = 4.0, 3.0


@dataclass(frozen=True, eq=False)
class HeadingCheck:
    """Result of an independent heading check.

    Attributes
    ----------
    since : float, s
        When the check began.
    time : ndarray, (n,), s
        Seconds of the run, after `since`.
    difference : ndarray, (n,), deg
        Heading of the run minus that of the check.
    sd : ndarray, (n,), deg
        Standard deviation of the check's heading; carried by gyros, a 99 % bound divided by `SURE`.
    kind : str
        A key of `CHECKS`.
    scale : ndarray, (n,)
        By fixes: factor, 1 or more, by which its innovations scatter more than expected,
        correlation included; it is part of `sd`.
    covariance : ndarray, (n, 9, 9)
        By fixes: as `NavigationRecord.covariance`, of the check.
    plain : ndarray, (n,), deg
        Carried by gyros: `sd` from the stated gyro errors, without those observed during the rest.
    """

    since: float
    time: Array
    difference: Array
    sd: Array
    kind: str
    scale: Array = field(default_factory=lambda: np.empty(0))
    covariance: Array = field(default_factory=lambda: np.empty((0, 9, 9)))
    plain: Array = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True)
class StatusSpan:
    """Consecutive seconds of one status for one reason.

    Attributes
    ----------
    begin, end : float, s
    status : str
        One of `STATUSES`.
    reason : str
        A key of `REASONS`.
    """

    begin: float
    end: float
    status: str
    reason: str


@dataclass(frozen=True, eq=False)
class HeadingIntegrity:
    """Heading integrity of each second of a run.

    Attributes
    ----------
    table : DataFrame
        By time in s, the seconds of the run: ``status`` (index in `STATUSES`), ``reason`` (a key
        of `REASONS`), ``bound`` (1.96 standard deviations of the run, deg), ``difference`` (run
        minus check, deg), ``check_sd`` (standard deviation of the check, deg), ``check_bound``
        (`SURE` standard deviations of the check plus the difference, deg), ``carried`` (that, or an
        earlier one plus the growth since, deg: the value that decides on trust), ``check_since``
        (s), ``check`` (a key of `CHECKS`, or empty), ``scatter`` (of the innovations, relative
        to the predicted one).
    trusted_below, rejected_beyond : float, deg
        Limits of the heading error, and of the 95 % bound.
    """

    table: pd.DataFrame
    trusted_below: float
    rejected_beyond: float

    def share(self, status: str) -> float:
        """Share of the seconds with a status."""
        codes = self.table["status"].to_numpy()
        return float(np.mean(codes == STATUSES.index(status))) if len(codes) else 0.0

    @property
    def spans(self) -> tuple[StatusSpan, ...]:
        """Consecutive seconds of one status for one reason, in order of time."""
        time = self.table.index.to_numpy(dtype=np.float64)
        if not len(time):
            return ()
        keys = list(zip(self.table["status"].tolist(), self.table["reason"].tolist(), strict=True))
        starts = [k for k in range(len(keys)) if k == 0 or keys[k] != keys[k - 1]]
        ends = [*(time[k] for k in starts[1:]), float(time[-1]) + 1.0]
        return tuple(
            StatusSpan(float(time[k]), float(end), STATUSES[keys[k][0]], keys[k][1])
            for k, end in zip(starts, ends, strict=True)
        )


def heading_status(
    record: NavigationRecord,
    evidence: Sequence[HeadingCheck],
    scatter: Array | None = None,
    *,
    trusted_below: float = 3.0,
    rejected_beyond: float = 10.0,
) -> HeadingIntegrity:
    """Return the heading integrity of each second of a run.

    Parameters
    ----------
    evidence : sequence of HeadingCheck
        Results of the independent checks; empty without a check.
    scatter : ndarray, (n,), optional
        Of `recent_scatter` at the seconds of the run.
    trusted_below, rejected_beyond : float, deg
        Trusted promises an error below the first; a bound beyond the second is rejected.

    Raises
    ------
    ConfigError
        The limits are invalid.

    Notes
    -----
    The error e of the run is its known difference d from an independent check plus the error of the
    check: ``|e| < |d| + 2.58 sd`` in 99 % of all cases. This bound does not depend on the heading
    given to the run. For up to a minute after a check the growth since then is added: twice 2.58
    times the root of the total growth of the run's own variance, not reduced by updates. The run is
    contradicted where d is beyond 2.58 standard deviations of both, and beyond half of the limit.
    """
    if not 0.0 < trusted_below <= rejected_beyond:
        raise ConfigError(
            "evaluation.heading-limits",
            quantity="trust",
            trusted_below=trusted_below,
            rejected_beyond=rejected_beyond,
        )
    seconds = seconds_of(record)
    count = len(seconds)
    own = _own_sd(record, seconds)
    difference, check_sd, since, kind = _best(seconds, evidence)
    check_bound = np.abs(difference) + SURE * check_sd
    spread = np.ones(count) if scatter is None else scatter
    bound = TWO_SIDED_95 * own
    with np.errstate(invalid="ignore"):
        apart = (np.abs(difference) > SURE * np.hypot(check_sd, own)) & (
            np.abs(difference) > 0.5 * trusted_below
        )
    apart |= _contradicted(seconds, evidence, own, trusted_below)
    carried = _carried(seconds, check_bound, own, apart)
    status = np.full(count, UNVERIFIED)
    reason = np.full(count, "assumed", dtype=object)
    wide = ~(bound <= trusted_below)
    reason[wide] = "wide"
    good = ~wide & (carried <= trusted_below)
    status[good], reason[good] = TRUSTED, ""
    loose = ~wide & ~good & np.isfinite(check_sd) & (SURE * check_sd <= rejected_beyond)
    reason[loose] = "faint"
    off = spread > FAR_OFF
    status[off & (status == TRUSTED)] = UNVERIFIED
    reason[off] = "scatter"
    status[spread > REFUTED] = REJECTED
    status[apart], reason[apart] = REJECTED, "apart"
    unknown = ~(bound <= rejected_beyond)
    status[unknown], reason[unknown] = REJECTED, "unknown"
    table = pd.DataFrame(
        {
            "status": status,
            "reason": reason,
            "bound": bound,
            "difference": difference,
            "check_sd": check_sd,
            "check_bound": check_bound,
            "carried": carried,
            "check_since": since,
            "check": kind,
            "scatter": spread,
        },
        index=pd.Index(seconds, name="time"),
    )
    return HeadingIntegrity(table, trusted_below, rejected_beyond)


def seconds_of(record: NavigationRecord) -> Array:
    """Whole seconds within a run."""
    time = record.trajectory.index
    return np.arange(np.ceil(float(time[0])), np.floor(float(time[-1])) + 1.0)


def recent_scatter(record: NavigationRecord) -> Array:
    """Recent scatter of the innovations over the predicted one, at each second of a run.

    Returns
    -------
    ndarray, (n,)
        Of the worst observation: root mean square of the normalized innovations of the last half
        minute, each limited to four; 1 is expected, and is the value without observations.
    """
    seconds = seconds_of(record)
    worst = np.ones(len(seconds))
    for table in record.innovations.values():
        labels = [x for x in innovation_labels(table) if not x.startswith(VERTICAL)]
        if not labels:
            continue
        nu = table[[f"nu {x}" for x in labels]].to_numpy(dtype=np.float64)
        s = table[[f"s {x}" for x in labels]].to_numpy(dtype=np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.where(s > 0.0, nu / np.sqrt(s), np.nan)
        weight = table[[f"weight {x}" for x in labels]].to_numpy(dtype=np.float64)
        known = np.isfinite(u)
        # Rejected measurements did no harm, unless there are many.
        lost = known & (weight <= 0.0)
        u = np.where(lost, LOST, np.clip(u, -CLIP, CLIP))
        square = np.where(known, np.where(known, u, 0.0) ** 2, 0.0)
        total = np.concatenate([[0.0], np.cumsum(square.sum(axis=1))])
        count = np.concatenate([[0], np.cumsum(known.sum(axis=1))])
        time = table.index.to_numpy(dtype=np.float64)
        upto = np.searchsorted(time, seconds + 1e-6, side="right")
        since = np.searchsorted(time, seconds - RECENT, side="right")
        many = count[upto] - count[since]
        mean = (total[upto] - total[since]) / np.maximum(many, 1)
        worst = np.where(many >= FEWEST, np.maximum(worst, np.sqrt(mean)), worst)
    return worst


def doubts_of(
    record: NavigationRecord, trusted_below: float
) -> Callable[[Sequence[HeadingCheck], float], bool]:
    """Return the test whether a run was contradicted, or scattered too much, until an instant.

    Parameters
    ----------
    trusted_below : float, deg
        As of `heading_status`.

    Returns
    -------
    callable
        Of the results of independent checks, and the instant in s.
    """
    seconds = seconds_of(record)
    own, scattered = _own_sd(record, seconds), recent_scatter(record) > FAR_OFF

    def doubted(evidence: Sequence[HeadingCheck], upto: float) -> bool:
        until = int(np.searchsorted(seconds, upto, side="right"))
        apart = _contradicted(seconds[:until], evidence, own[:until], trusted_below)
        return bool((apart | scattered[:until]).any())

    return doubted


def _own_sd(record: NavigationRecord, seconds: Array) -> Array:
    """Standard deviation of the heading of a run at each second, deg."""
    marks = record.sd.index.to_numpy(dtype=np.float64)
    sd = record.sd["heading"].to_numpy(dtype=np.float64)
    # A standard deviation grows to the next mark: the larger of the two marks around a second.
    after = np.clip(np.searchsorted(marks, seconds - 1e-6), 0, len(marks) - 1)
    before = np.clip(after - 1, 0, None)
    return np.where(marks[after] <= seconds + 1e-6, sd[after], np.maximum(sd[before], sd[after]))


def _best(
    seconds: Array, evidence: Sequence[HeadingCheck]
) -> tuple[Array, Array, Array, NDArray[np.object_]]:
    """Difference, standard deviation, start and kind of the tightest check of each second."""
    difference, sd, since = (np.full(len(seconds), np.nan) for _ in range(3))
    who = np.full(len(seconds), "", dtype=object)
    least = np.full(len(seconds), np.inf)
    for one in evidence:
        at = np.searchsorted(seconds, one.time - 1e-6)
        inside = at < len(seconds)
        at, d, s = at[inside], one.difference[inside], one.sd[inside]
        better = np.abs(d) + SURE * s < least[at]
        at = at[better]
        difference[at], sd[at], since[at] = d[better], s[better], one.since
        who[at] = one.kind
        least[at] = (np.abs(d) + SURE * s)[better]
    return difference, sd, since, who


def _carried(seconds: Array, check_bound: Array, own: Array, apart: NDArray[np.bool_]) -> Array:
    """Bound by the checks now, or by an earlier check plus the growth since."""
    out = np.where(np.isfinite(check_bound), check_bound, np.inf)
    grown = np.maximum(np.diff(own**2, prepend=own[:1] ** 2), 0.0)
    known, added, since = math.inf, 0.0, -math.inf
    for k, now in enumerate(seconds.tolist()):
        added += float(grown[k])
        if apart[k]:
            known = math.inf
            continue
        held = known + GROWS * SURE * math.sqrt(added) if now - since <= CARRIED else math.inf
        if out[k] <= held:
            known, added, since = float(out[k]), 0.0, now
        else:
            out[k] = held
    return out


def _contradicted(
    seconds: Array, evidence: Sequence[HeadingCheck], own: Array, trusted_below: float
) -> NDArray[np.bool_]:
    """Seconds at which any check with a known heading contradicts the run."""
    out = np.zeros(len(seconds), dtype=np.bool_)
    for one in evidence:
        at = np.searchsorted(seconds, one.time - 1e-6)
        inside = at < len(seconds)
        at, d, s = at[inside], np.abs(one.difference[inside]), one.sd[inside]
        out[at[(d > SURE * np.hypot(s, own[at])) & (d > 0.5 * trusted_below)]] = True
    return out
